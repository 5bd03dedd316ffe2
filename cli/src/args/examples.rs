//! Examples under the help of each command, one to three.

pub(super) const CLAYMILL: &str = "\
Examples:
  claymill demo
  claymill plan body.igs --tool ball:10 -o out/body
  claymill plan --help";

pub(super) const DEMO: &str = "\
Examples:
  claymill demo
  claymill demo --scale 1 --tool ball:10 -o out/full-size";

pub(super) const INSPECT: &str = "\
Examples:
  claymill inspect body.igs
  claymill inspect body.igs -o defects.png --view left
  claymill inspect clamp.stl --mesh-unit 25.4";

pub(super) const DROP: &str = "\
Examples:
  claymill drop body.igs --tool ball:10 --at 1200,-300,0
  claymill drop body.igs --tool bull:5:1 --at 1200,-300,0 -o drop.png";

pub(super) const REACH: &str = "\
Examples:
  claymill reach body.igs --tool ball:10 --tilt-limit 60 -o reach.json
  claymill reach part.stp --tool flat:5 --axis auto --forced 0 --forced 180
  claymill reach part.stp --tool flat:5 --tilt-limit 180 --picture reach.png";

pub(super) const PROTOTYPE: &str = "\
Examples:
  claymill prototype part.stp --stock auto --material delrin --tool ball:3 -o out/part
  claymill prototype part.stp --stock round:60 --machine linuxcnc-a-axis.toml -o out/part
  claymill prototype part.stp --axis x --forced 0 --forced 180 --no-passes -o out/part";

pub(super) const MERGE: &str = "\
Examples:
  claymill merge body.igs -o out/regions
  claymill merge body.igs --preset class-a --why 10
  claymill merge body.igs --export regions.stp";

pub(super) const PLAN: &str = "\
Examples:
  claymill plan body.igs --tool ball:10 --scallop 0.1 -o out/body
  claymill plan body.igs --up +z --length=-y --strategy auto --check clamps.stl -o out/body
  claymill plan new-body.igs --job out/body/job.toml --only region:0,layer:ROOF -o out/new-body";

pub(super) const DIFF: &str = "\
Examples:
  claymill diff out/body new-body.igs
  claymill diff out/body new-body.igs --json > changed.json";

pub(super) const STOCK: &str = "\
Examples:
  claymill stock out/body
  claymill stock out/body -o left.stl --pitch 1";

pub(super) const STORE: &str = "\
Examples:
  claymill store status out/.claymill-store
  claymill store clean out/.claymill-store --to 1000";

pub(super) const SHARD: &str = "\
Examples:
  claymill shard open body.igs --tool ball:6 --scallop 0.1 -o work
  claymill shard run work 0-3
  claymill shard join work -o out/body";

pub(super) const COMPARE: &str = "\
Examples:
  claymill compare body.igs -o out/compare
  claymill compare body.igs --strategies planar,scallop --scallop 0.05,0.1 -o out/compare";

pub(super) const VERIFY: &str = "\
Examples:
  claymill verify out/body
  claymill verify out/body --json > found.json
  claymill verify out/body --program body.nc --machine mill.toml";

pub(super) const POST: &str = "\
Examples:
  claymill post out/body --to siemens -o body.mpf
  claymill post out/body --to g1 --machine mill.toml -o body.nc --simulate";

pub(super) const SIMULATE: &str = "\
Examples:
  claymill simulate out/body --program body.mpf --machine mill.toml";

pub(super) const STREAM: &str = "\
Examples:
  claymill stream out/body --to shm:/dev/shm/mill
  claymill stream out/body --to linuxcnc:localhost:5007
  claymill stream out/body --to tcp:mill:7000 --secret secret.key --remote --from 1200";

pub(super) const CONTROL: &str = "\
Examples:
  claymill control --queue /dev/shm/mill
  claymill control --queue /dev/shm/mill --listen 127.0.0.1:7000 --secret secret.key --hold";

pub(super) const ORDER: &str = "\
Examples:
  claymill order hold --to 127.0.0.1:7000 --secret secret.key
  claymill order status --to 127.0.0.1:7000 --secret secret.key --json";

pub(super) const RENDER: &str = "\
Examples:
  claymill render body.igs -o body.png
  claymill render out/body --view iso,top --show scallop,joints -o out/body.png
  claymill render out/body --at 40% --show stock,tool -o stock.png";

pub(super) const VIEW: &str = "\
Examples:
  claymill view out/body
  claymill view body.igs --picture window.png";

pub(super) const ANIMATE: &str = "\
Examples:
  claymill animate out/body -o body.png
  claymill animate out/body --stock 3 --follow 300 -o body.mp4
  claymill animate out/body --storyboard -o sheet.png";

pub(super) const TOOLS: &str = "\
Examples:
  claymill tools shop.toml
  claymill tools library.json --material aluminium --machine mill.toml
  claymill tools tool.tbl --table-unit mm --svg tools.svg";

pub(super) const REPORT: &str = "\
Examples:
  claymill report out/body";

pub(super) const SAMPLE: &str = "\
Examples:
  claymill sample roadster -o roadster.igs
  claymill sample roadster --edit -o roadster-edited.igs
  claymill sample ribbon --flaw gap:0.05 --flaw t-junctions -o ribbon.stp";

pub(super) const SCHEMA: &str = "\
Examples:
  claymill schema
  claymill schema > schemas.json";

pub(super) const COMPLETIONS: &str = "\
Examples:
  claymill completions bash > ~/.local/share/bash-completion/completions/claymill
  claymill completions zsh > ~/.zfunc/_claymill";

pub(super) const MAN: &str = "\
Examples:
  claymill man -o ~/.local/share/man/man1";

#[cfg(test)]
mod tests {
    use clap::error::ErrorKind;
    use clap::{Command, CommandFactory, Parser};

    use super::super::Cli;

    /// The examples at the end of a command's help.
    fn examples(command: &mut Command) -> Vec<String> {
        let (name, help) = (command.get_name().to_owned(), command.render_help().to_string());
        let (_, last) = help.rsplit_once("\nExamples:\n").unwrap_or_else(|| panic!("{name}: no examples"));
        last.lines().map(|line| line.trim().to_owned()).collect()
    }

    #[test]
    fn the_help_of_every_command_ends_with_one_to_three_examples_that_it_takes() {
        let mut whole = Cli::command().disable_help_subcommand(true);
        whole.build();
        let mut commands: Vec<Command> = whole.get_subcommands().cloned().collect();
        assert!(commands.len() >= 20);
        commands.push(whole);
        for command in &mut commands {
            let examples = examples(command);
            let begin = format!("claymill {}", command.get_name().trim_start_matches("claymill"));
            assert!((1..=3).contains(&examples.len()), "{examples:?}");
            for example in &examples {
                assert!(example.starts_with(begin.trim()), "{example}");
                // What the shell does with the rest is no matter of the command.
                let line = example.split(" > ").next().unwrap_or_default();
                match Cli::try_parse_from(line.split_whitespace()) {
                    Ok(_) => {}
                    Err(e) => assert_eq!(e.kind(), ErrorKind::DisplayHelp, "{example}: {e}"),
                }
            }
        }
    }
}
