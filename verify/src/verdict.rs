//! The verdict: findings from the measurements, and whether any of them is an error.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use claymill_toolpath::{Contain, Job};

use crate::options::VerifyOptions;
use crate::report::{
    BoundsKept, Contact, Coverage, Gouge, Obstacles, Place, Rapids, Scallop, Sequence, SidesKept,
    SurfaceState,
};
use crate::{HolderClearance, ShankContact};

/// Areas of states sum to the total, and the total to the planner's, within this share.
const AREAS_AGREE: f64 = 1e-6;
/// Reachable area left on less than this share of the cut area is sampling noise along boundaries.
const LEFT_SHARE: f64 = 1e-3;
/// And what is smaller than a square of this many radii, and of this many millimetres, is shorter than any pass: of a small part any
/// corner is a large share.
const SHORTEST_PASS_RADII: f64 = 0.25;
const SHORTEST_PASS_MM: f64 = 1.0;
/// From this share of all area on it is said what is out of reach for the holder.
const SAID_SHARE: f64 = 1e-5;
/// The planner's areas by state may differ from the measured ones by this share of the total.
const ACCOUNT_SHARE: f64 = 0.01;

/// Where passes end at a border, a ball may be on the other side for no longer than this, mm.
const WRONG_SIDE_MM: f64 = 1.0;

/// Rapids may come nearer than the job says by this, mm: triangles stand for the model below them.
const RAPIDS_KEPT_MM: f64 = 0.25;
/// Regions that a finding names; the others are in `verify.json`.
const REGIONS_NAMED: usize = 5;

/// The conclusion: passed when no finding is an error.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Verdict {
    /// No finding is an error.
    pub passed: bool,
    /// What was found, errors first.
    pub findings: Vec<Finding>,
}

impl Verdict {
    /// Findings, errors first.
    pub(crate) fn of(mut findings: Vec<Finding>) -> Self {
        findings.sort_by_key(|finding| finding.severity);
        Verdict { passed: findings.iter().all(|f| f.severity != Severity::Error), findings }
    }
}

/// Something that is not as it should be.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Finding {
    /// What it is.
    pub code: FindingCode,
    /// How bad it is.
    pub severity: Severity,
    /// One sentence with the figures.
    pub message: String,
    /// Where, if at one place.
    pub place: Option<Place>,
}

/// Kinds of findings.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum FindingCode {
    /// The ball enters a face deeper than the bar.
    Gouge,
    /// A pass leaves more than the bar under the ball.
    Excess,
    /// A pass stands off the rim of a face that it rolls over by more than the bar.
    Rim,
    /// Passes run through the air.
    InAir,
    /// A move begins elsewhere than where the one before ended.
    Jump,
    /// A move is out of its order.
    Order,
    /// A move's feed is not what the job says.
    Feed,
    /// A setup begins or ends down at the model.
    Retract,
    /// The moves do not come to the job's totals.
    Totals,
    /// A rapid touches or enters the model.
    RapidTouches,
    /// A move enters an obstacle, or comes nearer to it than was asked for.
    Obstacle,
    /// The tool leaves its bounds, or comes too near to a face to be avoided.
    OutOfBounds,
    /// The tool cuts on the side of the material.
    WrongSide,
    /// The shank touches the model.
    Shank,
    /// A holder touches the model or an obstacle, or comes nearer than was asked for.
    Holder,
    /// What the tool would reach is out of reach for its holder.
    HolderReach,
    /// Moves along which the holder was not looked at.
    HolderNotChecked,
    /// A rapid runs through stock.
    RapidInStock,
    /// It could not be decided whether a rapid is clear of stock.
    RapidUndecided,
    /// Shank or holder run through stock.
    BodyInStock,
    /// The tool cuts along a larger angle than was allowed.
    Engagement,
    /// A straight link or lead-in of levels runs through stock.
    LinkInStock,
    /// Levels leave more stock than the band over what the tool reaches.
    StockLeft,
    /// The tool has no way into pockets into which it would fit.
    ClosedPockets,
    /// Scallop crests are higher than the bar.
    Scallop,
    /// Area that the tool reaches was left.
    ReachableLeft,
    /// A face could not be sampled.
    NotMeasured,
    /// Areas do not sum to the model's.
    AreaSum,
    /// The planner's account differs from what was measured.
    PlannerAccount,
    /// There is nothing to measure.
    NothingCut,
}

/// How bad a finding is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Severity {
    /// The job must not be run.
    Error,
    /// The job may be run, but somebody should look.
    Warning,
}

pub(crate) struct Measured<'a> {
    pub(crate) gouge: &'a Gouge,
    /// What surfaces are judged by: none of levels, which cut none.
    pub(crate) contact: Option<&'a Contact>,
    pub(crate) sequence: Option<&'a Sequence>,
    pub(crate) rapids: &'a Rapids,
    pub(crate) obstacles: Option<&'a Obstacles>,
    pub(crate) bounds: Option<&'a BoundsKept>,
    pub(crate) shank: &'a ShankContact,
    pub(crate) holder: Option<&'a HolderClearance>,
    pub(crate) scallop: Option<&'a Scallop>,
    pub(crate) coverage: Option<&'a Coverage>,
    pub(crate) sides: Option<&'a SidesKept>,
}

/// Holds the measurements against the bars.
pub(crate) fn conclude(job: &Job, options: &VerifyOptions, m: &Measured<'_>) -> Verdict {
    use FindingCode as Code;
    use Severity::{Error, Warning};
    let mut findings = Vec::new();
    let mut find = |code, severity, message, place: &Option<Place>| {
        findings.push(Finding { code, severity, message, place: place.clone() });
    };
    let um = |mm: f64| mm * 1e3;

    if m.gouge.deepest_mm > options.gouge_limit_mm {
        let text = format!(
            "the ball enters the model by {:.2} µm, {} places are deeper than 5 µm",
            um(m.gouge.deepest_mm),
            m.gouge.deeper_than_5_um
        );
        find(Code::Gouge, Error, text, &m.gouge.deepest_at);
    }
    if let Some(contact) = m.contact {
        contact_findings(contact, options, &mut find);
    }
    if let Some(sequence) = m.sequence {
        sequence_findings(sequence, &mut find);
    }
    if let Some(least) = m.rapids.clearance_min_mm
        && least <= 0.0
    {
        let text =
            format!("{} rapid moves touch the model, the worst by {:.3} mm", m.rapids.touching, -least);
        find(Code::RapidTouches, Error, text, &m.rapids.clearance_min_at);
    }
    if let (Some(least), Some(asked)) = (m.rapids.clearance_min_mm, job.tolerances.get("clearance_mm"))
        && least > 0.0
        && least < asked - RAPIDS_KEPT_MM
    {
        let text = format!(
            "rapids come within {least:.2} mm of the finished model, the job says {asked} mm: raw material may stand there"
        );
        find(Code::RapidTouches, Warning, text, &m.rapids.clearance_min_at);
    }
    if let Some(obstacles) = m.obstacles {
        obstacle_findings(obstacles, &mut find);
    }
    if let Some(kept) = m.bounds {
        bounds_findings(job, kept, &mut find);
    }
    if let Some(sides) = m.sides {
        side_findings(sides, options, &mut find);
    }
    if m.shank.touching > 0 {
        let (moves, depth) = (m.shank.touching, m.shank.deepest_mm);
        let text = format!("the shank enters the model on {moves} moves, the worst by {depth:.3} mm");
        find(Code::Shank, Error, text, &m.shank.deepest_at);
    }
    if let Some(holder) = m.holder {
        holder_findings(holder, &mut find);
    }
    let bar = options.scallop_limit * job.request.scallop_mm;
    if let Some(crests) = m.scallop.map(|s| &s.crests).filter(|crests| crests.p99_mm > bar) {
        let text = format!(
            "the 99th percentile of the scallop crests is {:.4} mm, the bar is {bar:.4} mm",
            crests.p99_mm
        );
        find(Code::Scallop, Error, text, &crests.max_at);
    }
    if let Some(coverage) = m.coverage {
        coverage_findings(job, coverage, &mut find);
    }
    Verdict::of(findings)
}

fn contact_findings(
    contact: &Contact,
    options: &VerifyOptions,
    find: &mut impl FnMut(FindingCode, Severity, String, &Option<Place>),
) {
    let um = |mm: f64| mm * 1e3;
    if contact.excess_max_mm > options.excess_limit_mm {
        let text = format!(
            "a pass runs {:.2} µm above its face; of the contact are {}",
            um(contact.excess_max_mm),
            contact.within_limits()
        );
        find(FindingCode::Excess, Severity::Error, text, &contact.excess_max_at);
    }
    if contact.edge_excess_max_mm > options.excess_limit_mm {
        let text = format!(
            "a pass runs {:.2} µm off the rim of a face that it rolls over, the bar is {:.1} µm",
            um(contact.edge_excess_max_mm),
            um(options.excess_limit_mm)
        );
        find(FindingCode::Rim, Severity::Error, text, &contact.edge_excess_max_at);
    }
    if contact.in_air_share > 0.0 {
        let text = format!("{:.3} % of the cutting length touches no face", 100.0 * contact.in_air_share);
        find(FindingCode::InAir, Severity::Warning, text, &None);
    }
}

fn sequence_findings(
    sequence: &Sequence,
    find: &mut impl FnMut(FindingCode, Severity, String, &Option<Place>),
) {
    use FindingCode as Code;
    for (fault, code, what) in [
        (&sequence.jump, Code::Jump, "moves do not begin where the one before ended"),
        (&sequence.order, Code::Order, "moves are out of order"),
        (&sequence.feed, Code::Feed, "moves do not have the job's feed"),
        (&sequence.retract, Code::Retract, "setups do not begin or end above everything"),
        (&sequence.totals, Code::Totals, "totals are not those of the moves"),
    ] {
        if let Some(first) = &fault.first {
            let text = match fault.count {
                1 => first.clone(),
                count => format!("{count} {what}: {first}"),
            };
            find(code, Severity::Error, text, &fault.first_at);
        }
    }
}

fn obstacle_findings(near: &Obstacles, find: &mut impl FnMut(FindingCode, Severity, String, &Option<Place>)) {
    let least = near.clearance_min_mm.unwrap_or(f64::INFINITY);
    let text = if near.touching > 0 {
        format!("{} moves enter an obstacle, the worst by {:.3} mm", near.touching, -least)
    } else if near.near > 0 {
        format!(
            "{} moves come too near to an obstacle, the worst within {least:.3} mm; asked for were {} mm",
            near.near, near.asked_mm
        )
    } else {
        return;
    };
    find(FindingCode::Obstacle, Severity::Error, text, &near.clearance_min_at);
}

fn bounds_findings(
    job: &Job,
    kept: &BoundsKept,
    find: &mut impl FnMut(FindingCode, Severity, String, &Option<Place>),
) {
    if kept.beyond > 0 {
        let what = match job.request.bounds.contain {
            _ if job.request.levels.is_some() => "the tool's axis",
            Contain::Contact => "where the ball touches",
            Contain::Centre => "the ball's centre",
            Contain::Edge => "the ball's edge",
        };
        let (moves, by) = (kept.beyond, kept.beyond_max_mm);
        let text = format!("{what} is out of bounds on {moves} moves, the worst by {by:.3} mm");
        find(FindingCode::OutOfBounds, Severity::Error, text, &kept.beyond_at);
    }
    if kept.too_near > 0 {
        let (asked, least) = (kept.avoid_mm.unwrap_or(0.0), kept.avoided_min_mm.unwrap_or(0.0));
        let text = format!(
            "the ball comes within {least:.3} mm of a face to be avoided, asked for were {asked} mm; it is too near on {} moves",
            kept.too_near
        );
        find(FindingCode::OutOfBounds, Severity::Error, text, &kept.avoided_min_at);
    }
}

fn side_findings(
    sides: &SidesKept,
    options: &VerifyOptions,
    find: &mut impl FnMut(FindingCode, Severity, String, &Option<Place>),
) {
    if sides.wrong_length_mm > WRONG_SIDE_MM {
        let text = format!(
            "the ball is on the side of the material along {:.1} mm, and cuts {:.1} mm² from there",
            sides.wrong_length_mm, sides.wrong_mm2
        );
        find(FindingCode::WrongSide, Severity::Error, text, &sides.wrong_at);
    } else if sides.wrong_mm2 > 0.0 {
        let text = format!(
            "{:.1} mm² beside open borders are cut from the side of the material, by a ball that rolls over them",
            sides.wrong_mm2
        );
        find(FindingCode::WrongSide, Severity::Warning, text, &sides.wrong_at);
    }
    if sides.inside_mm2 > options.area_per_sample_mm2 {
        let text = format!("{:.1} mm² are cut with the ball inside of a body", sides.inside_mm2);
        find(FindingCode::WrongSide, Severity::Error, text, &sides.inside_at);
    }
}

fn holder_findings(
    holder: &HolderClearance,
    find: &mut impl FnMut(FindingCode, Severity, String, &Option<Place>),
) {
    let short = || holder.regions.iter().filter(|r| r.stick_out_needed_mm > r.stick_out_mm);
    let mut regions: Vec<usize> = short().map(|r| r.region).collect();
    regions.sort_unstable();
    regions.dedup();
    let needed = |setup: &str| {
        let most = short().filter(|r| r.setup == setup).map(|r| r.stick_out_needed_mm).reduce(f64::max)?;
        // Rounded up: what is advised must do.
        Some(format!("{:.1} mm or more in {setup}", (most * 10.0).ceil() / 10.0))
    };
    let needed: Vec<String> = holder.setups().into_iter().filter_map(needed).collect();
    let named: Vec<String> = regions.iter().take(REGIONS_NAMED).map(usize::to_string).collect();
    let remedy = format!(
        "let the tool stick out {}, or cut {} {}{} from another direction",
        needed.join(", "),
        if regions.len() == 1 { "region" } else { "regions" },
        named.join(", "),
        if regions.len() > named.len() {
            format!(" and {} more", regions.len() - named.len())
        } else {
            String::new()
        }
    );
    let (asked, least) = (holder.asked_mm, holder.clearance_min_mm.unwrap_or(f64::INFINITY));
    if holder.touching > 0 {
        let text = format!("the holder touches on {} moves; {remedy}", holder.touching);
        find(FindingCode::Holder, Severity::Error, text, &holder.clearance_min_at);
    } else if holder.near > 0 {
        let text = format!(
            "the holder comes within {least:.2} mm on {} moves, asked for were {asked} mm; {remedy}",
            holder.near
        );
        find(FindingCode::Holder, Severity::Warning, text, &holder.clearance_min_at);
    }
    if holder.moves_not_checked > 0 {
        let text = format!(
            "the holder was not looked at on {} moves, whose tool leans against its setup's axis",
            holder.moves_not_checked
        );
        find(FindingCode::HolderNotChecked, Severity::Warning, text, &None);
    }
}

/// Whether an area that is left, beside one that is finished, mm², is more than sampling and the shortest pass account for.
fn is_much_left(left_mm2: f64, finished_mm2: f64, radius_mm: f64) -> bool {
    let shortest_mm = SHORTEST_PASS_MM.min(SHORTEST_PASS_RADII * radius_mm);
    left_mm2 > LEFT_SHARE * finished_mm2 && left_mm2 > shortest_mm * shortest_mm
}

fn coverage_findings(
    job: &Job,
    coverage: &Coverage,
    find: &mut impl FnMut(FindingCode, Severity, String, &Option<Place>),
) {
    use FindingCode as Code;
    use Severity::{Error, Warning};
    let area = |state| coverage.by_state_mm2.get(&state).copied().unwrap_or(0.0);
    let (cut, left) = (area(SurfaceState::Cut), area(SurfaceState::ReachableLeft));
    let sum: f64 = coverage.by_state_mm2.values().sum();
    let total = coverage.total_mm2;
    if cut == 0.0 {
        find(Code::NothingCut, Error, "no part of the model is cut".into(), &None);
    }
    if left > 0.0 {
        let finished = cut + area(SurfaceState::EarlierTool);
        let severity =
            if is_much_left(left, finished, job.request.tool.radius_mm()) { Error } else { Warning };
        let text = format!(
            "{left:.0} mm² within reach of the tool were left ({:.3} % of the cut area)",
            100.0 * left / cut.max(1e-9)
        );
        let at = coverage.reachable_left_at.first().map(|a| a.at.clone());
        find(Code::ReachableLeft, severity, text, &at);
    }
    let held_off = area(SurfaceState::HolderInTheWay);
    if held_off > SAID_SHARE * total {
        let text = format!(
            "{held_off:.0} mm² are out of reach for the holder; let the tool stick out farther, or cut them from another direction"
        );
        find(Code::HolderReach, Warning, text, &None);
    }
    let unknown = area(SurfaceState::NotMeasured);
    let faces =
        coverage.faces.iter().filter(|f| f.by_state_mm2.contains_key(&SurfaceState::NotMeasured)).count();
    if faces > 0 {
        // A few tiny faces are boxed in; of a model that can hardly be measured nothing can be said.
        let severity = if unknown > LEFT_SHARE * total { Error } else { Warning };
        let text = format!("{unknown:.4} mm² on {faces} faces could not be sampled");
        find(Code::NotMeasured, severity, text, &None);
    }
    if (sum - total).abs() > AREAS_AGREE * total {
        let text = format!("the areas by state sum to {sum:.1} mm², the faces to {total:.1} mm²");
        find(Code::AreaSum, Error, text, &None);
    }
    let planned: f64 = job.area.cut_mm2 + job.area.uncut_mm2.values().sum::<f64>();
    for (what, claimed) in
        [("cut and uncut areas in job.json", planned), ("total area in job.json", job.area.total_mm2)]
    {
        if (claimed - total).abs() > AREAS_AGREE * total {
            let text = format!("the {what} are {claimed:.1} mm², the faces have {total:.1} mm²");
            find(Code::AreaSum, Error, text, &None);
        }
    }
    for (state, difference) in &coverage.planner_difference_mm2 {
        if difference.abs() > ACCOUNT_SHARE * total {
            let (size, than) = (difference.abs(), if *difference > 0.0 { "more" } else { "less" });
            let text =
                format!("the planner counted {size:.0} mm² {than} as {} than was measured", words(*state));
            find(Code::PlannerAccount, Warning, text, &None);
        }
    }
}

fn words(state: SurfaceState) -> &'static str {
    match state {
        SurfaceState::Cut => "cut",
        SurfaceState::Hidden => "hidden",
        SurfaceState::TooTight => "too tight",
        SurfaceState::HolderInTheWay => "out of reach for the holder",
        SurfaceState::ReachableLeft => "within reach but left",
        SurfaceState::Excluded => "excluded",
        SurfaceState::EarlierTool => "left to the earlier tool",
        SurfaceState::OutOfBounds => "out of bounds",
        SurfaceState::NotMeasured => "not measured",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Passes of a large ball are no longer than those of one of 4 mm have to be.
    #[test]
    fn what_the_shortest_pass_would_cut_is_much() {
        assert!(is_much_left(1.05, 400.0, 4.0) && !is_much_left(0.95, 400.0, 4.0));
        assert!(is_much_left(1.05, 400.0, 25.0) && !is_much_left(0.95, 400.0, 25.0));
        assert!(is_much_left(0.3, 200.0, 2.0) && !is_much_left(0.2, 100.0, 2.0));
        assert!(!is_much_left(9.0, 1e4, 4.0), "a share of it is noise along boundaries");
    }
}
