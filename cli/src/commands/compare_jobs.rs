//! What a comparison is made of: one job for each combination of strategy, tool and scallop height.

use claymill::{Job, Strategy, name};

use super::finished::quoted;
use super::job_file;
use super::request::{Request, USUAL_SCALLOP_MM, USUAL_TOOL};
use crate::args::{CompareArgs, JobOptions, StrategyName};
use crate::failure::Failure;

/// The dimensions of a comparison, and what is the same in all its jobs.
pub(super) struct Wanted {
    tools: Vec<String>,
    scallops_mm: Vec<f64>,
    strategies: Vec<StrategyName>,
    /// The options of every job, without tool, scallop height and strategy.
    shared: JobOptions,
}

/// One job of a comparison.
pub(super) struct Combination {
    /// Its folder inside the comparison's.
    pub(super) name: String,
    pub(super) request: Request,
}

impl Wanted {
    pub(super) fn of(args: &CompareArgs) -> Result<Self, Failure> {
        let mut shared = job_file::with(args.job.clone(), args.job_file.as_deref())?;
        let (tool, scallop_mm) = (shared.tool.take(), shared.scallop.take());
        // What a job file has of this is what others are held against.
        shared.strategy = None;
        let several = &args.several;
        let wanted = Wanted {
            tools: unless_given(tools(&several.tool), || tool.unwrap_or_else(|| USUAL_TOOL.to_owned())),
            scallops_mm: unless_given(several.scallop.clone(), || scallop_mm.unwrap_or(USUAL_SCALLOP_MM)),
            strategies: once(several.strategies.clone()),
            shared,
        };
        if wanted.shared.tool_number.is_some() && wanted.tools.len() > 1 {
            return Err(Failure::usage(
                "several tools cannot have one number in the machine",
                "Leave --tool-number out, or compare with one --tool.",
            ));
        }
        Ok(wanted)
    }

    /// Its jobs, strategies changing first.
    pub(super) fn combinations(&self, args: &CompareArgs) -> Result<Vec<Combination>, Failure> {
        let mut all = Vec::new();
        for tool in &self.tools {
            for &scallop_mm in &self.scallops_mm {
                for &strategy in &self.strategies {
                    let request = Request::new(&args.model, &self.options(tool, scallop_mm, strategy))?;
                    all.push(Combination { name: self.name(tool, scallop_mm, strategy), request });
                }
            }
        }
        Ok(all)
    }

    /// The options of one job. What only some strategies have is left out for the others.
    fn options(&self, tool: &str, scallop_mm: f64, strategy: StrategyName) -> JobOptions {
        let shared = &self.shared;
        // Where no strategy has it, it stays, and is refused as `plan` refuses it.
        let suits = |has: fn(Strategy) -> bool| {
            has(strategy.into()) || !self.strategies.iter().any(|&other| has(other.into()))
        };
        JobOptions {
            tool: Some(tool.to_owned()),
            scallop: Some(scallop_mm),
            strategy: Some(strategy),
            lines: shared.lines.filter(|_| suits(Job::has_lines)),
            guide: if suits(Job::has_guides) { shared.guide.clone() } else { Vec::new() },
            ..shared.clone()
        }
    }

    /// The strategy's name, with tool and scallop height where there are several.
    fn name(&self, tool: &str, scallop_mm: f64, strategy: StrategyName) -> String {
        let mut folder = name(&strategy);
        if self.tools.len() > 1 {
            folder = format!("{folder}-{}", tool.replace(':', "").replace(',', "-"));
        }
        if self.scallops_mm.len() > 1 {
            folder = format!("{folder}-{scallop_mm}");
        }
        folder
    }

    /// What is the same in all jobs, as a job file.
    pub(super) fn job_file(&self) -> Result<String, Failure> {
        job_file::toml_text(&self.shared)
    }

    /// The command line that makes the comparison again, whose shared options are in the file `job_file` of its folder.
    pub(super) fn command(&self, args: &CompareArgs, job_file: &str) -> String {
        let list = |words: Vec<String>| words.join(",");
        let words = [
            "claymill".to_owned(),
            "compare".to_owned(),
            args.model.display().to_string(),
            "--job".to_owned(),
            args.out.join(job_file).display().to_string(),
            "--strategies".to_owned(),
            list(self.strategies.iter().map(name).collect()),
            "--scallop".to_owned(),
            list(self.scallops_mm.iter().map(f64::to_string).collect()),
            "--tool".to_owned(),
            list(self.tools.clone()),
            "-o".to_owned(),
            args.out.display().to_string(),
        ];
        words.iter().map(|word| quoted(word)).collect::<Vec<_>>().join(" ")
    }
}

/// The tools: what is said of a tool after a comma belongs to the one before.
fn tools(parts: &[String]) -> Vec<String> {
    let mut tools: Vec<String> = Vec::new();
    for part in parts {
        let more = ["taper:", "length:", "shank:"].iter().any(|name| part.trim_start().starts_with(name));
        match tools.last_mut() {
            Some(tool) if more => *tool += &format!(",{}", part.trim()),
            _ => tools.push(part.trim().to_owned()),
        }
    }
    tools
}

/// A list without repetitions, or what is usual where nothing was given.
fn unless_given<T: PartialEq>(list: Vec<T>, usual: impl FnOnce() -> T) -> Vec<T> {
    if list.is_empty() { vec![usual()] } else { once(list) }
}

/// What is named twice is planned once.
fn once<T: PartialEq>(list: Vec<T>) -> Vec<T> {
    list.into_iter().fold(Vec::new(), |mut kept, item| {
        if !kept.contains(&item) {
            kept.push(item);
        }
        kept
    })
}

#[cfg(test)]
mod tests {
    use clap::{CommandFactory, Parser};

    use super::*;
    use crate::args::{Cli, Command};

    /// The command line behind `claymill compare m.igs -o out`.
    fn args(more: &[&str]) -> CompareArgs {
        let line = ["claymill", "compare", "m.igs", "-o", "out"];
        let cli = Cli::try_parse_from(line.iter().chain(more)).unwrap_or_else(|e| panic!("{e}"));
        let Command::Compare(args) = cli.command else { panic!("another command") };
        args
    }

    fn texts(more: &[&str]) -> Result<Vec<(String, JobOptions)>, Failure> {
        let args = args(more);
        let combinations = Wanted::of(&args)?.combinations(&args)?;
        Ok(combinations.into_iter().map(|c| (c.name, c.request.options)).collect())
    }

    #[test]
    fn compare_takes_every_option_of_plan_but_those_of_whole_jobs() {
        let command = Cli::command();
        let options = |name: &str| -> Vec<String> {
            let command = command.find_subcommand(name).unwrap();
            // Operations are chosen for a whole job; what is compared are jobs of one operation. And a comparison goes on by itself.
            let others = ["Whole job", "Reuse"];
            let of_one =
                command.get_arguments().filter(|a| !others.iter().any(|o| a.get_help_heading() == Some(*o)));
            let all = of_one.flat_map(|a| a.get_long_and_visible_aliases().unwrap_or_default());
            all.map(str::to_owned).collect()
        };
        let (plan, compare) = (options("plan"), options("compare"));
        assert!(plan.len() > 40, "{plan:?}");
        let missing: Vec<&String> = plan.iter().filter(|o| !compare.contains(o)).collect();
        assert!(missing.is_empty(), "{missing:?}");
    }

    #[test]
    fn a_combination_is_named_by_what_differs() {
        let names = |more: &[&str]| -> Vec<String> {
            texts(more).unwrap().into_iter().map(|(name, _)| name).collect()
        };
        assert_eq!(names(&[]), ["planar", "flow", "scallop", "isoparametric", "auto"]);
        assert_eq!(names(&["--strategy", "planar,planar", "--scallop", "0.1,0.10"]), ["planar"]);
        let tools =
            ["--tool", "ball:5,taper:3,length:30,ball:10", "--strategies", "auto", "--scallop", "0.2,0.1"];
        assert_eq!(
            names(&tools),
            [
                "auto-ball5-taper3-length30-0.2",
                "auto-ball5-taper3-length30-0.1",
                "auto-ball10-0.2",
                "auto-ball10-0.1"
            ]
        );
    }

    #[test]
    fn what_only_some_strategies_have_is_theirs_alone() {
        let jobs = texts(&["--lines", "20", "--guide", "1,2,3", "--angle", "30", "--pencil"]).unwrap();
        for (name, options) in &jobs {
            assert_eq!(options.lines, (name == "isoparametric").then_some(20), "{name}");
            let follows = ["flow", "scallop", "auto"].contains(&name.as_str());
            assert_eq!(options.guide.len(), usize::from(follows), "{name}");
            assert!(options.pencil && options.angle == Some(30.0), "{name}");
        }
        let refused = texts(&["--lines", "20", "--strategies", "planar,flow"]).unwrap_err();
        assert!(refused.message().contains("only isoparametric"), "{refused}");
        let refused = texts(&["--tool-number", "3", "--tool", "ball:5,ball:6"]).unwrap_err();
        assert!(refused.message().contains("one number"), "{refused}");
        assert_eq!(texts(&["--tool-number", "3"]).unwrap()[0].1.tool_number, Some(3));
    }

    #[test]
    fn a_job_file_gives_all_but_the_strategy() {
        let place = tempfile::tempdir().unwrap();
        let file = place.path().join("job.toml");
        std::fs::write(&file, "tool = \"ball:6\"\nscallop = 0.2\nstrategy = \"planar\"\nfeed = 4000.0\n")
            .unwrap();
        let file = file.to_str().unwrap();
        let jobs = texts(&["--job", file]).unwrap();
        assert_eq!(jobs.len(), 5);
        for (_, options) in &jobs {
            let found = (options.tool.as_deref(), options.scallop, options.feed);
            assert_eq!(found, (Some("ball:6"), Some(0.2), Some(4000.0)));
        }
        let (_, first) = &texts(&["--job", file, "--tool", "ball:8", "--feed", "3000"]).unwrap()[0];
        assert_eq!(
            (first.tool.as_deref(), first.scallop, first.feed),
            (Some("ball:8"), Some(0.2), Some(3000.0))
        );
        // The command that makes it again says the same.
        let args = args(&["--job", file, "--strategies", "auto,planar", "--check", "post 1.stl"]);
        let wanted = Wanted::of(&args).unwrap();
        let kept = place.path().join("compare.toml");
        std::fs::write(&kept, wanted.job_file().unwrap()).unwrap();
        let again = ["--job", kept.to_str().unwrap(), "--strategies", "auto,planar", "--scallop", "0.2"];
        let again = texts(&[&again[..], &["--tool", "ball:6"]].concat()).unwrap();
        let toml = |options: &JobOptions| job_file::toml_text(options).unwrap();
        let first: Vec<String> =
            wanted.combinations(&args).unwrap().iter().map(|c| toml(&c.request.options)).collect();
        assert_eq!(again.iter().map(|(_, options)| toml(options)).collect::<Vec<_>>(), first);
        let command = wanted.command(&args, "compare.toml");
        assert_eq!(
            command,
            "claymill compare m.igs --job out/compare.toml --strategies auto,planar --scallop 0.2 --tool ball:6 -o out"
        );
    }
}
