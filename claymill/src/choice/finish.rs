//! The tools of a surface: the ball of the finish and those of the rest after it.
//!
//! ```text
//!     ball 20   ▓▓▓▓▓▓▓▓▓▓▓▓▓▓░░░░░   reaches little, quickly: much is left for a chain of smaller ones
//!     ball 8    ▓▓▓▓▓▓▓▓▓▓▓▓▓▓▓▓▓░░   ← the least time with the chain that follows
//!     ball 4    ▓▓▓▓▓▓▓▓▓▓▓▓▓▓▓▓▓▓▓   reaches all, slowly
//! ```

use claymill_tooling::{
    ChainTool, Fact, LibraryTool, ReachModel, ReachPatch, Spacing, Stage, ToolChain, Way, tool_chain,
};
use claymill_toolpath::OperationKind;

use crate::choice::ChosenOperation;
use crate::choice::chooser::{Chooser, cusp_mm, is_within, no_tool, radii, round_up};
use crate::choice::fits::Sample;
use crate::error::Error;

/// The finish with what follows it leaves no more than this share of the area that any tool reaches.
const LEFT_SHARE: f64 = 0.03;
/// A ball whose radius differs by no more than this share from that of a bore or fillet is as wide.
const AS_WIDE: f64 = 2e-3;
/// Times that differ by less are alike: they are estimates.
const ALIKE: f64 = 0.03;
/// Rests smaller than this share of the area are sampling noise.
const NOISE_SHARE: f64 = 2e-3;
/// A ball fits where one that is larger by this share does not: samples are exact to it.
const FITS: f64 = 1e-3;
/// Between two passes of a finish the tool turns, or goes back for the next one, s.
const TURN_S: f64 = 0.3;
const RETURN_S: f64 = 1.5;
/// What a larger ball leaves are strips along valleys. A pass there is so long on average, in radii of that ball, and takes so much
/// longer than its length at full feed: lead-in, lead-out, the way to the next one, and slowing down at both ends.
const REST_PASS_RADII: f64 = 1.4;
const REST_PASS_S: f64 = 0.8;
/// Every tool of a chain overlaps what is cut beside the strips by this share of their whole area.
const REST_OVERLAP: f64 = 0.5;
/// A tool change takes this long where the machine does not say, s.
const CHANGE_S: f64 = 20.0;

/// Balls from large to small, and what of the surface each of them reaches.
struct Reached {
    balls: Vec<LibraryTool>,
    patches: Vec<ReachPatch>,
    /// Bores and fillets that are exactly as wide as each ball. There is no room in them to go around, and none to lead in.
    stuck_mm2: Vec<f64>,
    /// All that the setups see.
    seen_mm2: f64,
}

impl Reached {
    /// Balls that are as wide as places of the surface reach nothing, unless all that are asked for are.
    fn new(balls: Vec<LibraryTool>, samples: &[Sample], asked: &[usize]) -> Self {
        let seen_mm2: f64 = samples.iter().map(|s| s.area_mm2).sum();
        let as_wide = |radius_mm: f64| {
            let own = samples.iter().filter(|s| (s.hollow_mm / radius_mm - 1.0).abs() <= AS_WIDE);
            own.map(|s| s.area_mm2).sum::<f64>()
        };
        let stuck_mm2: Vec<f64> = balls.iter().map(|tool| as_wide(tool.tool.radius_mm())).collect();
        let is_stuck = |k: usize| stuck_mm2[k] > NOISE_SHARE * seen_mm2;
        let are_all_stuck = asked.iter().all(|&k| is_stuck(k));
        let fits = |k: usize, sample: &Sample| {
            sample.fits_mm >= balls[k].tool.radius_mm() * (1.0 - FITS) && sample.stands >> k & 1 == 1
        };
        let patch = |sample: &Sample| {
            let reached_by = balls
                .iter()
                .enumerate()
                .filter(|(k, _)| (are_all_stuck || !is_stuck(*k)) && fits(*k, sample));
            let reached_by = reached_by.fold(0, |bits, (k, _)| bits | 1_u64 << k);
            ReachPatch { area_mm2: sample.area_mm2, reached_by }
        };
        let patches = samples.iter().map(patch).collect();
        Reached { balls, patches, stuck_mm2, seen_mm2 }
    }

    fn area_mm2(&self, which: impl Fn(u64) -> bool) -> f64 {
        self.patches.iter().filter(|p| which(p.reached_by)).map(|p| p.area_mm2).sum()
    }

    fn by_mm2(&self, k: usize) -> f64 {
        self.area_mm2(|bits| bits >> k & 1 == 1)
    }

    fn by_any_mm2(&self) -> f64 {
        self.area_mm2(|bits| bits != 0)
    }

    fn percent(&self, mm2: f64) -> f64 {
        100.0 * mm2.max(0.0) / self.seen_mm2.max(f64::MIN_POSITIVE)
    }

    /// What a ball does not reach, and which of the smaller ones do.
    fn left_by(&self, k: usize) -> Vec<ReachPatch> {
        let left = self.patches.iter().filter(|p| p.reached_by >> k & 1 == 0);
        left.map(|p| ReachPatch { reached_by: p.reached_by >> k >> 1, ..*p }).collect()
    }
}

/// A finish and what follows it.
struct FinishWay {
    /// The ball of the finish.
    first: usize,
    total_s: f64,
    /// What it leaves for smaller balls, and what these leave, mm².
    rest_mm2: f64,
    left_mm2: f64,
    chain: Option<ToolChain>,
}

impl Chooser<'_> {
    /// The finish and the chain of tools for what it leaves: those that take the least time together.
    pub(super) fn surface(
        &mut self,
        finish: &Stage,
        rest: Option<&Stage>,
        samples: &[Sample],
        scallop_mm: Option<f64>,
    ) -> Result<(), Error> {
        let balls = self.balls(None);
        if balls.is_empty() {
            return Err(no_tool(finish, self.material));
        }
        let range = radii(finish);
        let in_range = |k: &usize| is_within(range, &balls[*k]);
        let told = self.told(finish, &balls);
        let asked: Vec<usize> = told.map_or_else(|| (0..balls.len()).filter(in_range).collect(), |k| vec![k]);
        let reached = Reached::new(balls, samples, &asked);
        let spacing = scallop_mm.map_or(finish.spacing.value, Spacing::ScallopMm);
        let height_mm = |tool: &LibraryTool| match spacing {
            Spacing::ScallopMm(mm) => mm,
            other => round_up(cusp_mm(tool.tool.radius_mm(), other.step_mm(&tool.tool))),
        };
        let ways = asked.into_iter().map(|first| self.with_rest((finish, rest), &reached, first, &height_mm));
        let ways: Vec<FinishWay> = ways.collect::<Result<_, Error>>()?;
        let reaching = || ways.iter().filter(|way| reached.by_mm2(way.first) > 0.0);
        let enough = |way: &&FinishWay| way.left_mm2 <= LEFT_SHARE * reached.by_any_mm2();
        let least_s = reaching().filter(enough).map(|way| way.total_s).fold(f64::INFINITY, f64::min);
        // From large to small: the larger one of those that are alike.
        let best = reaching().filter(enough).find(|way| way.total_s <= (1.0 + ALIKE) * least_s);
        // Of those in the range the one that leaves least, where none leaves little.
        let best = best
            .or_else(|| reaching().min_by(|a, b| a.left_mm2.total_cmp(&b.left_mm2)))
            .or_else(|| ways.last());
        let Some(best) = best else {
            return Err(no_tool(finish, self.material));
        };
        for way in ways.iter().filter(|way| way.first != best.first) {
            let stuck_mm2 = reached.stuck_mm2[way.first];
            if reached.by_mm2(way.first) == 0.0 && stuck_mm2 > 0.0 {
                self.refusals.push(format!(
                    "{} is not taken: bores or fillets of {stuck_mm2:.0} mm² are exactly as wide as it is",
                    reached.balls[way.first].name
                ));
                continue;
            }
            self.refusals.push(format!(
                "{} is not taken for the finish: it reaches {:.1} % of the surface that the setups see, and takes {:.0} s with \
                 what follows it, which leaves {:.1} %",
                reached.balls[way.first].name,
                reached.percent(reached.by_mm2(way.first)),
                way.total_s,
                reached.percent(way.left_mm2),
            ));
        }
        let tool = &reached.balls[best.first];
        let reason = format!(
            "{} reaches {:.1} % of the surface that the setups see, and takes {:.0} s with what follows it; all balls together \
             reach {:.1} %",
            tool.name,
            reached.percent(reached.by_mm2(best.first)),
            best.total_s,
            reached.percent(reached.by_any_mm2())
        );
        let whole =
            self.operation(finish, OperationKind::Finish, "finish".into(), tool, height_mm(tool), reason);
        self.operations.push(whole);
        self.facts.insert("rest.area_mm2", Fact::Number(best.rest_mm2));
        match (rest, &best.chain) {
            (Some(stage), Some(chain)) => self.rests(stage, &reached.balls[best.first..], chain, &height_mm),
            (Some(_), None) => self.refusals.push(format!(
                "rest is not needed: {:.0} mm² are left for smaller balls, of {:.0} mm²",
                best.rest_mm2, reached.seen_mm2
            )),
            (None, _) => {}
        }
        Ok(())
    }

    /// A finish with a ball, and the cheapest chain of smaller ones for what it leaves.
    fn with_rest(
        &self,
        (finish, rest): (&Stage, Option<&Stage>),
        reached: &Reached,
        first: usize,
        height_mm: &dyn Fn(&LibraryTool) -> f64,
    ) -> Result<FinishWay, Error> {
        let (tool, seen_mm2) = (&reached.balls[first], reached.seen_mm2);
        let step_mm = |tool: &LibraryTool| Spacing::ScallopMm(height_mm(tool)).step_mm(&tool.tool);
        let rate = |stage: &Stage, tool: &LibraryTool, pass_mm: f64, aside_s: f64| {
            step_mm(tool) * pass_mm / (pass_mm / (self.feed(stage, tool) / 60.0) + aside_s)
        };
        let aside_s = if finish.way.value == Way::Lace { TURN_S } else { RETURN_S };
        let finish_s = reached.by_mm2(first) / rate(finish, tool, seen_mm2.sqrt(), aside_s);
        let left = reached.left_by(first);
        let rest_mm2: f64 = left.iter().filter(|p| p.reached_by != 0).map(|p| p.area_mm2).sum();
        let mut facts = self.facts.clone();
        facts.insert("rest.area_mm2", Fact::Number(rest_mm2));
        let runs = |stage: &&Stage| stage.runs(&facts) != Some(false);
        let stage = rest.filter(runs).filter(|_| rest_mm2 > NOISE_SHARE * seen_mm2);
        let Some(stage) = stage else {
            return Ok(FinishWay { first, total_s: finish_s, rest_mm2, left_mm2: rest_mm2, chain: None });
        };
        let change_s = self.shop.machine.changer.change_s.unwrap_or(CHANGE_S);
        let pass_mm = REST_PASS_RADII * tool.tool.radius_mm();
        let tools = reached.balls[first + 1..].iter().map(|tool| {
            let mm2_per_s = rate(stage, tool, pass_mm, REST_PASS_S);
            let change_s = change_s + REST_OVERLAP * rest_mm2 / mm2_per_s;
            ChainTool { id: tool.id.clone(), mm2_per_s, change_s, wear: self.material.wear }
        });
        let model = ReachModel::new(tools.collect(), &left).map_err(|e| Error::Choice {
            what: format!("the tools for the rest cannot be chosen: {e}"),
            advice: "Look at the tools' radii and feeds.".into(),
        })?;
        let chain = tool_chain(&model, NOISE_SHARE * seen_mm2);
        let (total_s, left_mm2) = (finish_s + chain.total_s, chain.left_mm2);
        Ok(FinishWay { first, total_s, rest_mm2, left_mm2, chain: Some(chain) })
    }

    /// Rest operations with the tools of a chain; `balls` begin with the finishing one.
    fn rests(
        &mut self,
        stage: &Stage,
        balls: &[LibraryTool],
        chain: &ToolChain,
        height_mm: &dyn Fn(&LibraryTool) -> f64,
    ) {
        let mut before = balls[0].tool;
        for (index, step) in chain.steps.iter().enumerate() {
            let tool = &balls[1 + step.tool];
            let name = if chain.steps.len() == 1 { "rest".to_owned() } else { format!("rest-{}", index + 1) };
            let reason = format!(
                "{} cuts {:.0} mm² that {before} does not reach; the chain of {} takes {:.0} s, {:.0} mm² are left to none",
                tool.name,
                step.area_mm2,
                chain.steps.len(),
                chain.total_s,
                chain.left_mm2
            );
            let whole = self.operation(stage, OperationKind::Rest, name, tool, height_mm(tool), reason);
            self.operations.push(ChosenOperation { rest_of: Some(before), ..whole });
            before = tool.tool;
        }
        for other in &chain.others {
            self.refusals.push(format!(
                "{} is not taken for the rest: the best chain with it takes {:.0} s",
                other.id, other.total_s
            ));
        }
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use claymill_nurbs::{Aabb, Point3};
    use claymill_tooling::{Facts, StageKind};
    use claymill_toolpath::Stock;

    use super::*;
    use crate::choice::Shop;

    /// A square metre, of which a share has room for no more than the second ball.
    fn samples(narrow_share: f64, fits_mm: [f64; 2]) -> [Sample; 2] {
        // Valleys are hollow arcs.
        let of = |share: f64, fits_mm: f64| Sample {
            area_mm2: 1e6 * share,
            fits_mm,
            hollow_mm: fits_mm,
            stands: u64::MAX,
        };
        [of(1.0 - narrow_share, fits_mm[0]), of(narrow_share, fits_mm[1])]
    }

    /// The balls of the finish and of the rest for a surface of a square metre with narrow valleys.
    fn chosen(narrow_share: f64) -> Vec<String> {
        chosen_with([30.0, 2.5], narrow_share)
    }

    /// The same with other balls that fit, and a share of the area where the second one does.
    fn chosen_with(fits_mm: [f64; 2], narrow_share: f64) -> Vec<String> {
        let shop = Shop::shipped();
        let material = shop.profiles.material("aluminium").unwrap();
        let facts = Facts::from([("material", Fact::Text(material.name.clone()))]);
        let process = shop.profiles.choose(&facts).unwrap();
        let process = shop.profiles.resolve(process, &material.name, &BTreeMap::new()).unwrap();
        let part = Aabb { min: Point3::origin(), max: Point3::new(1000.0, 1000.0, 100.0) };
        let mut chooser = Chooser {
            shop: &shop,
            material,
            facts,
            stock: &Stock::Layer { thickness_mm: 1.0 },
            part,
            thickest_mm: 1.0,
            left_mm: 1.0,
            operations: Vec::new(),
            refusals: Vec::new(),
        };
        let samples = samples(narrow_share, fits_mm);
        let stage = |kind| process.stage(kind);
        let finish = stage(StageKind::Finish).unwrap();
        chooser.surface(finish, stage(StageKind::Rest), &samples, None).unwrap();
        let others = chooser.refusals.iter().filter(|text| text.contains("not taken for the finish"));
        assert!((5..=6).contains(&others.count()));
        chooser.operations.iter().map(|operation| operation.tool.name.clone()).collect()
    }

    /// A ball of 20 mm turns so much more slowly than one of 10 mm that it takes longer, but the strips that it leaves are wider. A
    /// small ball cuts these; where most is narrow, it does it all.
    #[test]
    fn the_finish_is_the_one_that_takes_least_with_its_rest() {
        assert_eq!(chosen(0.0), ["ball 10"]);
        assert_eq!(chosen(0.05), ["ball 20", "ball 4"]);
        assert_eq!(chosen(0.9), ["ball 4"]);
    }

    /// Where only the smallest ball sticks out far enough, it is the one of the rest.
    #[test]
    fn a_ball_reaches_nothing_where_its_holder_is_in_the_way() {
        let balls: Vec<LibraryTool> = Shop::shipped()
            .library
            .tools
            .into_iter()
            .filter(|t| ["ball 4", "ball 10"].contains(&&*t.name))
            .collect();
        let deep = Sample { stands: 0b01, ..samples(0.0, [30.0; 2])[0] };
        let reached = Reached::new(balls, &[deep], &[0, 1]);
        assert_eq!((reached.by_mm2(0), reached.by_mm2(1), reached.by_any_mm2()), (1e6, 0.0, 1e6));
    }

    /// Where bores are as wide as a ball, it has no room in them.
    #[test]
    fn a_ball_as_wide_as_a_bore_is_not_taken() {
        assert_eq!(chosen_with([30.0, 5.05], 0.05), ["ball 10"]);
        let others = chosen_with([30.0, 5.0], 0.05);
        assert!(!others.is_empty() && !others.contains(&"ball 10".to_owned()), "{others:?}");
        // Unless it is the only one.
        let alone = samples(0.5, [5.0, 5.0]);
        let balls: Vec<LibraryTool> =
            Shop::shipped().library.tools.into_iter().filter(|t| t.name == "ball 10").collect();
        assert!((Reached::new(balls.clone(), &alone, &[0]).by_mm2(0) - 1e6).abs() < 1.0);
        assert!(
            Reached::new([balls.clone(), balls].concat(), &samples(1.0, [30.0, 30.0]), &[1]).by_mm2(1) > 0.0
        );
    }
}
