//! Passes along the level curves of a function on the part: parameter lines of patches, sweeps of fields.
//!
//! ```text
//!   level ──lines──► places on the faces ──R·n──► places of the ball's centre ──smooth──► drive curve
//!                                                            drive curve ──follow──► exact path
//! ```
//!
//! A pattern only says where passes run. Halfway between neighbouring levels the model is looked at again:
//! where the passes laid so far leave too much, the level halfway is laid over that stretch, and so on.

pub(crate) mod between;
pub(crate) mod field;
pub(crate) mod first;
pub(crate) mod halfway;
pub(crate) mod patch;
pub(crate) mod pattern;
pub(crate) mod spines;
pub(crate) mod strokes;
pub(crate) mod sweeps;
pub(crate) mod waterline;

use std::collections::BTreeSet;

use claymill_contact::Location;
use claymill_nurbs::Vector3;
use claymill_toolpath::LinkStyle;
use rayon::prelude::*;

use crate::curve::plan_curve::{Drawn, through, within};
use crate::curve::spiral;
use crate::follow::proofs::Proofs;
use crate::pattern::levels::between::SoFar;
use crate::pattern::levels::halfway::{Found, Halfway, Level, halfway};
use crate::pattern::levels::pattern::{BRIDGE_MM, Levels, Spot};
use crate::pattern::levels::spines::{Asking, in_plan, spines};
use crate::pattern::levels::strokes::{Place, Stroke};
use crate::pattern::near::{PassIndex, Touch};
use crate::pattern::part_region::PartRegion;
use crate::pattern::rows::crests::PlannedPass;
use crate::setup::context::SetupContext;

/// Rounds of laying levels halfway between levels: on a long arm a field changes by little.
const LEVEL_ROUNDS: usize = 16;
/// Places between which the model is looked at are at least this share of the flat step-over apart.
const LOOK: f64 = 0.5;
/// Passes are not laid closer together than this share of the flat step-over.
const CLOSEST: f64 = 0.08;
/// And where what the ball reaches ends is not looked for more closely than to this share.
const END_OF_REACH: f64 = 0.25;

/// Levels are next to each other when they are no further apart than this times what lies between them and their neighbours.
const NEXT: f64 = 1.1;
/// Stretches no longer than this may be cut by a pass across, which has one of them at most so far from the next, in flat
/// step-overs; and it runs by this share of one beside their middles at most.
const SHORT_STEPS: f64 = 8.0;
const SEAM_STEPS: f64 = 4.0;
/// Stretches of one level no further apart than this are one to them.
const SAME_STEPS: f64 = 2.0;
const SPINE_ASIDE: f64 = 0.3;
/// A long pass is fitted in stretches of at most this length, mm.
const STRETCH_MM: f64 = 1000.0;
/// Ranks of lines that are no neighbours are so far apart.
const APART: usize = 10;

/// What the passes laid so far have done for a place.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Done {
    /// They have cut it, or nobody asks for it.
    Cut,
    Left,
    /// It is left, and the ball cannot touch it.
    Barred,
}

/// What was laid at a level: paths, and what their locations are proven by.
struct AtLevel {
    pattern: usize,
    level: f64,
    laid: Vec<(PlannedPass, Proofs)>,
    found: Found,
    /// Whether what lies on both sides has to be looked at.
    goes_on: bool,
}

/// What a setup claims of the lines at a level.
struct Line {
    pattern: usize,
    level: f64,
    runs: Vec<Vec<Place>>,
    /// Some of it leans too far.
    leans: bool,
}

/// What is left along the lines at a level halfway between two.
struct Look {
    pattern: usize,
    halfway: Halfway,
    goes_on: bool,
    barred: bool,
    /// With the stretches on which too much is left.
    strokes: Vec<(Stroke, Vec<(f64, f64)>)>,
}

/// Levels of some patterns that passes are laid along, round by round.
pub(crate) struct LevelRounds<'p> {
    patterns: Vec<Box<dyn Levels + 'p>>,
    /// Those looked at, ascending, by pattern.
    levels: Vec<Vec<Level>>,
    round: usize,
    more: bool,
}

impl LevelRounds<'_> {
    pub(crate) fn go_on(&self) -> bool {
        self.more && self.round <= LEVEL_ROUNDS
    }
}

impl SetupContext<'_> {
    /// The first levels of all patterns.
    pub(crate) fn begin_levels<'p>(&self, patterns: Vec<Box<dyn Levels + 'p>>) -> LevelRounds<'p> {
        let levels = vec![Vec::new(); patterns.len()];
        LevelRounds { patterns, levels, round: 0, more: true }
    }

    /// Adds the passes of a round to those laid so far: along the first levels of all patterns, then along those halfway
    /// between two where too much is left. Tells what their locations are proven by.
    pub(crate) fn lay_levels(
        &self,
        rounds: &mut LevelRounds,
        laid: &mut Vec<PlannedPass>,
        ground: &PartRegion,
    ) -> Proofs {
        let found =
            if rounds.round == 0 { self.first(rounds, ground) } else { self.further(rounds, laid, ground) };
        rounds.levels.iter_mut().flatten().for_each(|l| l.fresh = false);
        rounds.more = false;
        let mut proofs = Proofs::default();
        for AtLevel { pattern, level, laid: of_level, found, goes_on } in found {
            if goes_on {
                rounds.more = true;
                rounds.levels[pattern].push(Level { at: level, fresh: true, found });
            }
            proofs += of_level.iter().map(|f| f.1).sum();
            laid.extend(of_level.into_iter().map(|f| f.0).filter(|l| !l.chains.is_empty()));
        }
        rounds.levels.iter_mut().for_each(|l| l.sort_by(|a, b| a.at.total_cmp(&b.at)));
        rounds.round += 1;
        proofs
    }

    /// What is laid along the first levels of all patterns.
    fn first(&self, rounds: &LevelRounds, ground: &PartRegion) -> Vec<AtLevel> {
        let patterns: Vec<&dyn Levels> = rounds.patterns.iter().map(AsRef::as_ref).collect();
        let levels: Vec<Vec<f64>> = patterns.par_iter().map(|p| self.first_levels(*p)).collect();
        let look = |(pattern, level): (usize, f64)| {
            let (runs, leans) = self.runs(patterns[pattern], level);
            Line { pattern, level, runs, leans }
        };
        let lines: Vec<Line> = of_each(&levels, Vec::clone).into_par_iter().map(look).collect();
        let goes_round = |line: &Line| match &line.runs[..] {
            [run] => patterns[line.pattern].height_mm(line.level).is_none() && is_closed(run),
            _ => false,
        };
        let together = |a: &Line, b: &Line| a.pattern == b.pattern && goes_round(a) && goes_round(b);
        let groups: Vec<&[Line]> = lines.chunk_by(together).collect();
        groups.par_iter().flat_map_iter(|lines| self.at_firsts(lines, &patterns, ground)).collect()
    }

    /// What is laid along first levels of one pattern: where they lie in each other, a spiral, or else spirals over parts of
    /// them.
    fn at_firsts(&self, lines: &[Line], patterns: &[&dyn Levels], ground: &PartRegion) -> Vec<AtLevel> {
        if let Some(spiral) = self.round_and_round(lines, ground) {
            return spiral;
        }
        if lines.len() < 2 * spiral::FEWEST {
            let lay = |line: &Line| self.at_first(line, patterns[line.pattern], ground);
            return lines.iter().map(lay).collect();
        }
        let halves = lines.split_at(lines.len() / 2);
        [halves.0, halves.1].into_iter().flat_map(|half| self.at_firsts(half, patterns, ground)).collect()
    }

    /// What is laid along a first level.
    fn at_first(&self, line: &Line, on: &dyn Levels, ground: &PartRegion) -> AtLevel {
        let &Line { pattern, level, ref runs, leans } = line;
        let strokes = self.strokes(runs.clone(), on.height_mm(level));
        let laid: Vec<_> = strokes.iter().map(|k| self.lay_stroke(k, level, None, ground)).collect();
        let is_held = |(laid, _): &(PlannedPass, Proofs)| laid.left_mm() > END_OF_REACH * self.flat_step_mm();
        let barred = leans || on.height_mm(level).is_some() && laid.iter().any(is_held);
        let found = found(&laid, barred);
        let found = Found { barred: barred || !found.laid, ..found };
        AtLevel { pattern, level, laid, found, goes_on: true }
    }

    /// One spiral over closed lines that lie in each other, if these are such.
    fn round_and_round(&self, lines: &[Line], ground: &PartRegion) -> Option<Vec<AtLevel>> {
        if lines.len() < spiral::FEWEST || self.link == LinkStyle::OneWay {
            return None;
        }
        let plan = |line: &Line| line.runs[0].iter().map(|p| p.centre.xy()).collect::<Vec<_>>();
        let way = spiral::spiral(&lines.iter().map(plan).collect::<Vec<_>>(), self.flat_step_mm())?;
        let lay = |drawn: Drawn| {
            let end_mm = drawn.at[drawn.at.len() - 1].1;
            let stretches = (end_mm / STRETCH_MM).ceil() as usize;
            let corners = (1..stretches).map(|k| end_mm * k as f64 / stretches as f64).collect();
            let stroke = Stroke { drawn: Drawn { corners, ..drawn }, places: Vec::new() };
            self.lay_stroke(&stroke, lines[0].level, None, ground)
        };
        // Where lines turn sharply it is parted, as they are.
        let mut laid: Vec<_> = through(&way).into_iter().map(lay).collect();
        let at_level = |line: &Line| AtLevel {
            pattern: line.pattern,
            level: line.level,
            laid: std::mem::take(&mut laid),
            found: Found { laid: true, barred: line.leans },
            goes_on: true,
        };
        Some(lines.iter().map(at_level).collect())
    }

    /// What is missing halfway between the levels of all patterns.
    fn further(&self, rounds: &LevelRounds, laid: &[PlannedPass], ground: &PartRegion) -> Vec<AtLevel> {
        let LevelRounds { patterns, levels, round, .. } = rounds;
        let between: Vec<(usize, Halfway)> =
            of_each(&levels.iter().zip(patterns).collect::<Vec<_>>(), |(levels, pattern)| {
                match pattern.count() {
                    Some(_) => Vec::new(),
                    None => halfway(levels, pattern.range(), *round == 1),
                }
            });
        let (near, none) = (PassIndex::new(laid, self.flat_step_mm()), PassIndex::new(&[], 1.0));
        let look = |&(pattern, halfway): &(usize, Halfway)| {
            let so_far = SoFar { near: [&near, &ground.in_valleys, &none], ground };
            self.look(patterns[pattern].as_ref(), pattern, halfway, &so_far)
        };
        let mut looks: Vec<Look> = between.par_iter().map(look).collect();
        let mut found = self.lay_spines(&mut looks, patterns, [&near, &ground.in_valleys], ground);
        let of_level = |look: Look| {
            let stretches = |(stroke, missing): &(Stroke, Vec<(f64, f64)>)| -> Vec<(PlannedPass, Proofs)> {
                let bridged = bridged(missing).into_iter();
                bridged.map(|s| self.lay_stroke(stroke, look.halfway.at, Some(s), ground)).collect()
            };
            let laid: Vec<(PlannedPass, Proofs)> = look.strokes.iter().flat_map(stretches).collect();
            let found = self::found(&laid, look.barred);
            let goes_on = look.goes_on || found.laid || found.barred;
            AtLevel { pattern: look.pattern, level: look.halfway.at, laid, found, goes_on }
        };
        found.par_extend(looks.into_par_iter().map(of_level));
        found
    }

    /// Where too much is left along the lines at a level halfway between two.
    fn look(&self, on: &dyn Levels, pattern: usize, halfway: Halfway, so_far: &SoFar) -> Look {
        let Halfway { at: level, gap, beside_barred } = halfway;
        let (mut runs, leans) = self.runs(on, level);
        let is_wide = |place: &Place| self.gap_steps(place, gap) >= END_OF_REACH;
        let goes_on = beside_barred && runs.iter().flatten().any(is_wide);
        runs.retain(|run| !self.is_done(run, gap, so_far));
        let mut look = Look { pattern, halfway, goes_on, barred: leans, strokes: Vec::new() };
        for stroke in self.strokes(runs, on.height_mm(level)) {
            let (missing, barred) = self.missing(&stroke, gap, so_far);
            look.barred |= barred;
            look.strokes.push((stroke, missing));
        }
        look
    }

    /// Lays a spine wherever short stretches are missing side by side on neighbouring lines, and looks again at these.
    fn lay_spines(
        &self,
        looks: &mut [Look],
        patterns: &[Box<dyn Levels + '_>],
        near: [&PassIndex; 2],
        ground: &PartRegion,
    ) -> Vec<AtLevel> {
        let step_mm = self.flat_step_mm();
        let (mut asking, mut rank): (Vec<Asking>, usize) = (Vec::new(), 0);
        let mut asked_by: Vec<Vec<(usize, usize)>> = Vec::new();
        for (k, look) in looks.iter().enumerate() {
            let follows = k > 0 && looks[k - 1].pattern == look.pattern && {
                let (before, here) = (looks[k - 1].halfway, look.halfway);
                here.at - before.at <= NEXT * (before.gap + here.gap)
            };
            rank += if follows { 1 } else { APART };
            if patterns[look.pattern].height_mm(look.halfway.at).is_some() || self.beside_walls.is_some() {
                continue;
            }
            for (s, (stroke, missing)) in look.strokes.iter().enumerate() {
                for &(from, to) in missing.iter().filter(|(from, to)| to - from <= SHORT_STEPS * step_mm) {
                    let centre = stroke.centre(0.5 * (from + to));
                    let same =
                        |a: &Asking| a.rank == rank && (a.centre - centre).norm() <= SAME_STEPS * step_mm;
                    // A line that turns sharply is two strokes, and asks on both sides of its corner.
                    if let Some(other) = asking.iter().rposition(same) {
                        asking[other].centre = nalgebra::center(&asking[other].centre, &centre);
                        asked_by[other].push((k, s));
                    } else {
                        asking.push(Asking { rank, centre });
                        asked_by.push(vec![(k, s)]);
                    }
                }
            }
        }
        let spines = spines(&asking, SEAM_STEPS * step_mm);
        let lay = |spine: &Vec<usize>| -> Vec<AtLevel> {
            let look = &looks[asked_by[spine[0]][0].0];
            let (pattern, level) = (look.pattern, look.halfway.at);
            let drawn = within(&in_plan(spine, &asking), SPINE_ASIDE * step_mm).into_iter();
            let laid = drawn
                .map(|drawn| self.lay_stroke(&Stroke { drawn, places: Vec::new() }, level, None, ground));
            let laid = laid.collect();
            vec![AtLevel { pattern, level, laid, found: Found::default(), goes_on: false }]
        };
        let laid: Vec<AtLevel> = spines.par_iter().flat_map_iter(lay).collect();
        let of_spines: Vec<PlannedPass> =
            laid.iter().flat_map(|at| at.laid.iter().map(|l| l.0.clone())).collect();
        let with_spines = PassIndex::new(&of_spines, step_mm);
        let so_far = SoFar { near: [near[0], near[1], &with_spines], ground };
        let crossed: BTreeSet<(usize, usize)> =
            spines.iter().flatten().flat_map(|&k| asked_by[k].iter().copied()).collect();
        let again =
            |&(k, s): &(usize, usize)| self.missing(&looks[k].strokes[s].0, looks[k].halfway.gap, &so_far).0;
        let again: Vec<_> = crossed.par_iter().map(again).collect();
        for (&(k, s), missing) in crossed.iter().zip(again) {
            looks[k].strokes[s].1 = missing;
        }
        laid
    }

    /// Stretches of a stroke on which the passes laid so far leave too much that the ball could cut, the next
    /// ones being `gap` away in level, and whether they leave anything that it could not.
    fn missing(&self, stroke: &Stroke, gap: f64, so_far: &SoFar) -> (Vec<(f64, f64)>, bool) {
        let reach_mm = 1.5 * LOOK * self.flat_step_mm();
        let at = &stroke.drawn.at;
        let (mut found, mut barred): (Vec<(f64, f64)>, bool) = (Vec::new(), false);
        for w in at.windows(2) {
            let ((i, s0), (j, s1)) = (w[0], w[1]);
            for (share, place) in self.looked_at(&stroke.places[i], &stroke.places[j], s1 - s0) {
                let gap_steps = self.gap_steps(&place, gap);
                let s = s0 + (s1 - s0) * share;
                if gap_steps < CLOSEST {
                    continue;
                }
                match self.done(&place, stroke.drawn.drive.direction(s), gap_steps, so_far) {
                    Done::Cut => {}
                    Done::Barred => barred |= gap_steps >= END_OF_REACH,
                    Done::Left => {
                        let (a, b) = (s - reach_mm, s + reach_mm);
                        match found.last_mut() {
                            Some(open) if a <= open.1 => open.1 = b,
                            _ => found.push((a, b)),
                        }
                    }
                }
            }
        }
        let end = at[at.len() - 1].1;
        (found.into_iter().map(|(a, b)| (a.max(0.0), b.min(end))).collect(), barred)
    }

    /// Whether the passes laid so far have done all of a run, before any drive curve is drawn through it.
    fn is_done(&self, run: &[Place], gap: f64, so_far: &SoFar) -> bool {
        run.windows(2).all(|w| {
            let along = (w[1].centre - w[0].centre).xy();
            let Some(direction) = along.try_normalize(0.0) else { return true };
            self.looked_at(&w[0], &w[1], along.norm()).all(|(_, place)| {
                let gap_steps = self.gap_steps(&place, gap);
                gap_steps < CLOSEST || self.done(&place, direction.into(), gap_steps, so_far) == Done::Cut
            })
        })
    }

    /// How far away the next levels are from a place, in flat step-overs.
    fn gap_steps(&self, place: &Place, gap: f64) -> f64 {
        gap * place.spot.per_level_mm / self.flat_step_mm()
    }

    /// The places to look at from one to before the next, `apart_mm` away, with the share of the way there.
    fn looked_at(&self, from: &Place, to: &Place, apart_mm: f64) -> impl Iterator<Item = (f64, Place)> {
        let (a, b) = (from.spot, to.spot);
        let looks = if self.go_on(from, to) { (apart_mm / (LOOK * self.flat_step_mm())).ceil() } else { 1.0 };
        (0..looks as u32).filter_map(move |k| {
            let share = f64::from(k) / looks;
            let spot = Spot { u: a.u + (b.u - a.u) * share, v: a.v + (b.v - a.v) * share, ..a };
            Some((share, self.place(spot)?))
        })
    }

    /// Whether the parameters lead from one place to the next: on one face, but not across the seam of a closed one.
    pub(super) fn go_on(&self, from: &Place, to: &Place) -> bool {
        let (a, b) = (from.spot, to.spot);
        a.face == b.face && {
            let halfway = self.ball.surface(a.face).point(0.5 * (a.u + b.u), 0.5 * (a.v + b.v));
            let middle = nalgebra::center(&from.point, &to.point);
            (halfway - middle).norm() <= (to.point - from.point).norm()
        }
    }

    /// What the passes laid so far, which mostly run in the horizontal direction given, have done for a place; the next
    /// levels are `gap_steps` flat step-overs away.
    fn done(&self, place: &Place, [ex, ey]: [f64; 2], gap_steps: f64, so_far: &SoFar) -> Done {
        if !place.claimed {
            return Done::Cut;
        }
        let Place { point, normal, centre, .. } = *place;
        let slope =
            if self.beside_walls.is_some() { 0.0 } else { -(normal.x * ex + normal.y * ey) / normal.z };
        let feed = Vector3::new(ex, ey, slope).normalize();
        let touch = Touch { point, normal, centre, feed };
        let most_mm = self.too_high_mm(so_far.ground.area_mm2);
        if so_far.is_cut(&touch, &self.ball.end(), most_mm) {
            let beside_mm = gap_steps * self.flat_step_mm();
            return if self.is_crest_cut(place, &touch, beside_mm, so_far) { Done::Cut } else { Done::Left };
        }
        if self.is_held(place) { Done::Barred } else { Done::Left }
    }

    /// Whether something else holds the ball up before it touches there.
    fn is_held(&self, place: &Place) -> bool {
        let Place { spot: Spot { face, u, v, .. }, normal, centre, .. } = *place;
        if self.beside_walls.is_some() {
            return self.is_kept_from_wall(centre, normal, (face, [u, v]));
        }
        let location = Location::touching(centre, normal, face, [u, v]);
        self.ball.is_blocked_from(&location, 0.5 * self.scallop_mm / normal.z)
    }
}

/// The median of some distances.
fn of_each<T, L>(all: &[T], levels: impl Fn(&T) -> Vec<L>) -> Vec<(usize, L)> {
    all.iter().enumerate().flat_map(|(k, t)| levels(t).into_iter().map(move |l| (k, l))).collect()
}

/// Stretches over short gaps.
fn bridged(stretches: &[(f64, f64)]) -> Vec<(f64, f64)> {
    let mut bridged: Vec<(f64, f64)> = Vec::new();
    for &(from, to) in stretches {
        match bridged.last_mut() {
            Some(open) if from - open.1 <= BRIDGE_MM => open.1 = to,
            _ => bridged.push((from, to)),
        }
    }
    bridged
}

/// Whether a run leads back to where it began.
fn is_closed(run: &[Place]) -> bool {
    run.len() > 3 && run[0].point == run[run.len() - 1].point
}

/// What was found where this was laid.
fn found(laid: &[(PlannedPass, Proofs)], barred: bool) -> Found {
    Found { laid: laid.iter().any(|(laid, _)| !laid.chains.is_empty()), barred }
}
