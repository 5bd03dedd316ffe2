//! Passes along the level curves of a function on the part: parameter lines of patches, sweeps of fields.
//!
//! ```text
//!   level ──lines──► places on the faces ──R·n──► places of the ball's centre ──smooth──► guide
//!                                                            guide ──follow──► exact path
//! ```
//!
//! A pattern only says where passes run. Halfway between neighbouring levels the model is looked at again:
//! where the passes laid so far leave too much, the level halfway is laid over that stretch, and so on.

use claymill_nurbs::{FaceId, Point2, Point3, Vector3};
use rayon::prelude::*;

use crate::between::SoFar;
use crate::contact::Location;
use crate::contour::contour;
use crate::crests::Laid;
use crate::ground::Ground;
use crate::halfway::{Found, Halfway, Level, halfway};
use crate::near::{LaidNear, Touch};
use crate::part::{SetupContext, TOO_HIGH};
use crate::plan_curve::{Drawn, through};
use crate::profile::{follow, parted};
use crate::proofs::Proofs;
use crate::raster::cheapest_step;
use crate::reach::{LEAST_FACING, OVERHANGING};
use crate::step_over::on_contact_mm;

/// Levels, at most, at which the step-over is asked for before the first passes are laid.
const ASKED: usize = 48;
/// Levels are spread by up to this factor rather than one more laid: crests grow by twice as much.
const SPREAD: f64 = 1.005;
/// Rounds of laying levels halfway between levels: on a long arm a field changes by little.
const LEVEL_ROUNDS: usize = 16;
/// Gaps in what a setup claims of a line are crossed when they are no longer than this, mm.
pub(crate) const BRIDGE_MM: f64 = 30.0;
/// Places between which the model is looked at are at least this share of the flat step-over apart.
const LOOK: f64 = 0.5;
/// Lines of constant height run at most this share of the flat step-over beside their places on the mesh.
pub(crate) const ASIDE: f64 = 0.5;
/// Passes are not laid closer together than this share of the flat step-over.
const CLOSEST: f64 = 0.08;
/// And where what the ball reaches ends is not looked for more closely than to this share.
const END_OF_REACH: f64 = 0.25;

/// A place on a level curve.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Spot {
    pub(crate) face: FaceId,
    pub(crate) u: f64,
    pub(crate) v: f64,
    /// How far the curves lie apart here for a unit of level, mm on the surface.
    pub(crate) per_level_mm: f64,
}

/// A function on faces, by its level curves.
pub(crate) trait Levels: Sync {
    /// Lowest and highest level.
    fn range(&self) -> (f64, f64);
    /// Whether a unit of level is a step-over.
    fn in_steps(&self) -> bool {
        false
    }
    /// The curves at a level, each as places that follow each other closely.
    fn whole_lines(&self, level: f64) -> Vec<Vec<Spot>>;
    /// The same, but for what is far from anything that the setup cuts.
    fn lines(&self, level: f64) -> Vec<Vec<Spot>> {
        self.whole_lines(level)
    }
    /// The height that the ball's centre keeps along the curves at a level, if it does.
    fn height_mm(&self, _level: f64) -> Option<f64> {
        None
    }
}

/// A place where the ball should touch.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Place {
    pub(crate) spot: Spot,
    point: Point3,
    pub(crate) normal: Vector3,
    pub(crate) centre: Point3,
    claimed: bool,
}

/// A guide with the places that it is made of.
struct Stroke {
    drawn: Drawn,
    places: Vec<Place>,
}

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
    laid: Vec<(Laid, Proofs)>,
    found: Found,
    /// Whether what lies on both sides has to be looked at.
    goes_on: bool,
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
        laid: &mut Vec<Laid>,
        ground: &Ground,
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
    fn first(&self, rounds: &LevelRounds, ground: &Ground) -> Vec<AtLevel> {
        let patterns: Vec<&dyn Levels> = rounds.patterns.iter().map(AsRef::as_ref).collect();
        let levels: Vec<Vec<f64>> = patterns.par_iter().map(|p| self.first_levels(*p)).collect();
        let whole = |(pattern, level): (usize, f64)| {
            let on = patterns[pattern];
            let (runs, leans) = self.runs(on, level);
            let strokes = self.strokes(runs, on.height_mm(level));
            let laid: Vec<_> = strokes.iter().map(|k| self.lay_stroke(k, level, None, ground)).collect();
            let is_held = |(laid, _): &(Laid, Proofs)| laid.left_mm() > END_OF_REACH * self.flat_step_mm();
            let barred = leans || on.height_mm(level).is_some() && laid.iter().any(is_held);
            let found = found(&laid, barred);
            AtLevel {
                pattern,
                level,
                laid,
                found: Found { barred: barred || !found.laid, ..found },
                goes_on: true,
            }
        };
        of_each(&levels, Vec::clone).into_par_iter().map(whole).collect()
    }

    /// What is missing halfway between the levels of all patterns.
    fn further(&self, rounds: &LevelRounds, laid: &[Laid], ground: &Ground) -> Vec<AtLevel> {
        let LevelRounds { patterns, levels, round, .. } = rounds;
        let between: Vec<(usize, Halfway)> =
            of_each(&levels.iter().zip(patterns).collect::<Vec<_>>(), |(levels, pattern)| {
                halfway(levels, pattern.range(), *round == 1)
            });
        let near = LaidNear::new(laid, self.flat_step_mm());
        let of_level = |&(pattern, Halfway { at: level, gap, beside_barred }): &(usize, Halfway)| {
            let (on, so_far) =
                (patterns[pattern].as_ref(), SoFar { near: [&near, &ground.in_valleys], ground });
            let (mut runs, leans) = self.runs(on, level);
            let is_wide = |place: &Place| self.gap_steps(place, gap) >= END_OF_REACH;
            let goes_on = beside_barred && runs.iter().flatten().any(is_wide);
            runs.retain(|run| !self.is_done(run, gap, &so_far));
            let (mut laid, mut barred) = (Vec::new(), leans);
            for stroke in &self.strokes(runs, on.height_mm(level)) {
                let (missing, barred_here) = self.missing(stroke, gap, &so_far);
                laid.extend(missing.into_iter().map(|s| self.lay_stroke(stroke, level, Some(s), ground)));
                barred |= barred_here;
            }
            let found = found(&laid, barred);
            AtLevel { pattern, level, laid, found, goes_on: goes_on || found.laid || found.barred }
        };
        between.par_iter().map(of_level).collect()
    }

    /// Levels at a distance that wastes least: their density is asked for all over the range. Where levels count
    /// step-overs they are one apart: what single places ask for differs from that by accident.
    fn first_levels(&self, pattern: &dyn Levels) -> Vec<f64> {
        let (low, high) = pattern.range();
        let asked = if pattern.in_steps() { 1 } else { ASKED };
        let width = (high - low) / asked as f64;
        let density = |k: usize| {
            if pattern.in_steps() {
                return 1.0;
            }
            let level = low + (k as f64 + 0.5) * width;
            let needs: Vec<f32> =
                pattern.whole_lines(level).iter().flat_map(|line| self.needs(line)).collect();
            let widest = f64::from(needs.iter().copied().fold(0.0f32, f32::max));
            if widest <= 0.0 { 0.0 } else { 1.0 / cheapest_step(&needs, widest) }
        };
        let density: Vec<f64> = (0..asked).map(density).collect();
        let mut sums = vec![0.0];
        for d in &density {
            sums.push(sums[sums.len() - 1] + d * width);
        }
        let total = sums[asked];
        let count = (total / SPREAD).ceil() as usize;
        (0..count)
            .map(|k| {
                let wanted = total * (k as f64 + 0.5) / count as f64;
                let cell = sums.partition_point(|&s| s <= wanted).clamp(1, asked) - 1;
                low + width * (cell as f64 + (wanted - sums[cell]) / (sums[cell + 1] - sums[cell]))
            })
            .collect()
    }

    /// For the claimed places of a line, how far in level the next line may be; where nothing is claimed on it, for all
    /// of them: what is claimed may begin between it and the next line that is asked.
    fn needs(&self, line: &[Spot]) -> Vec<f32> {
        let places = self.places(line);
        let (mut needs, mut unclaimed) = (Vec::new(), Vec::new());
        for (a, b) in places.iter().zip(places.iter().skip(1)) {
            let (Some(a), Some(b)) = (a, b) else { continue };
            if a.spot.per_level_mm <= 0.0 {
                continue;
            }
            let jet = self.ball.surface(a.spot.face).jet(a.spot.u, a.spot.v);
            let across = a.normal.cross(&(b.point - a.point));
            let step = on_contact_mm(&jet, &across, &a.normal, self.ball.radius_mm(), self.scallop_mm);
            if let Some(step) = step {
                let kept = if a.claimed { &mut needs } else { &mut unclaimed };
                kept.push((step / a.spot.per_level_mm) as f32);
            }
        }
        if needs.is_empty() { unclaimed } else { needs }
    }

    /// Where the ball is when it touches the spots, `None` where they lean too far. What is claimed within half a step
    /// beside a line counts as well: it is for this line to cut.
    fn places(&self, line: &[Spot]) -> Vec<Option<Place>> {
        let mut places: Vec<Option<Place>> = line.iter().map(|&spot| self.place(spot)).collect();
        for w in 1..places.len() {
            let [Some(a), Some(b)] = [places[w - 1], places[w]] else { continue };
            let beside = |p: &Place| self.is_claimed_beside(p, b.point - a.point);
            let claimed = [a, b].map(|p| p.claimed || beside(&p));
            for (place, claimed) in places[w - 1..=w].iter_mut().flatten().zip(claimed) {
                place.claimed = claimed;
            }
        }
        places
    }

    /// Whether the setup cuts what is half a step away from a place on its face, across a line.
    fn is_claimed_beside(&self, place: &Place, along: Vector3) -> bool {
        let Spot { face, u, v, .. } = place.spot;
        if !self.claims.any(face) {
            return false;
        }
        let jet = self.ball.surface(face).jet(u, v);
        let Some(across) = place.normal.cross(&along).try_normalize(0.0) else { return false };
        [0.5, -0.5].into_iter().any(|steps| {
            let aside = jet.tangent_coordinates(&(across * (steps * self.flat_step_mm())));
            aside.is_some_and(|d| self.claims_at(face, u + d.x, v + d.y))
        })
    }

    fn place(&self, spot: Spot) -> Option<Place> {
        let surface = self.ball.surface(spot.face);
        let (n, _) = surface.normal(spot.u, spot.v)?;
        let (normal, least_facing) = match self.beside_walls {
            Some(sides) => (n * sides[spot.face], OVERHANGING),
            None => (if n.z < 0.0 { -n } else { n }, LEAST_FACING),
        };
        let point = surface.point(spot.u, spot.v);
        (normal.z >= least_facing).then(|| Place {
            spot,
            point,
            normal,
            centre: point + normal * self.ball.radius_mm(),
            claimed: self.claims_at(spot.face, spot.u, spot.v),
        })
    }

    /// Claimed stretches of the lines at a level, and whether one of these ends where the ball cannot touch any more: such a
    /// wall leans over. Other lines than those at a height end where others' faces begin.
    fn runs(&self, pattern: &dyn Levels, level: f64) -> (Vec<Vec<Place>>, bool) {
        let (mut all, mut leans) = (Vec::new(), false);
        for line in pattern.lines(level) {
            let places = self.places(&line);
            leans |= pattern.height_mm(level).is_some() && self.leans(&places, &line);
            all.extend(runs(&places));
        }
        (all, leans)
    }

    /// Whether claimed places of a line lean too far, or end at one that does.
    fn leans(&self, places: &[Option<Place>], line: &[Spot]) -> bool {
        let is_claimed = |k: usize| match places[k] {
            Some(place) => place.claimed,
            None => self.claims_at(line[k].face, line[k].u, line[k].v),
        };
        let leans =
            |k: usize| places[k].is_none() && (k.saturating_sub(1)..line.len().min(k + 2)).any(is_claimed);
        (0..line.len()).any(leans)
    }

    fn strokes(&self, runs: Vec<Vec<Place>>, height_mm: Option<f64>) -> Vec<Stroke> {
        let mut strokes = Vec::new();
        for run in runs {
            let plan: Vec<Point2> = run.iter().map(|p| p.centre.xy()).collect();
            let drawn = match height_mm {
                Some(height) if self.beside_walls.is_some() => self.wall_contour(&plan, height),
                Some(height) => contour(self.ball, &plan, height, ASIDE * self.flat_step_mm()),
                None => through(&plan),
            };
            strokes.extend(drawn.into_iter().map(|drawn| Stroke { drawn, places: run.clone() }));
        }
        strokes
    }

    /// Follows a stroke, or one stretch of it.
    fn lay_stroke(
        &self,
        stroke: &Stroke,
        level: f64,
        stretch: Option<(f64, f64)>,
        ground: &Ground,
    ) -> (Laid, Proofs) {
        let at = &stroke.drawn.at;
        let (s0, s1) = stretch.unwrap_or((at[0].1, at[at.len() - 1].1));
        let guide = &stroke.drawn.guide;
        let followed = match self.beside_walls {
            Some(_) => self.follow_beside(guide, level, [s0, s1]),
            None => follow(self.ball, guide, s0, s1),
        };
        let proofs = followed.proofs;
        let corners = &stroke.drawn.corners;
        let passes = followed.passes(|face| ground.owns(face));
        let chains = passes.into_iter().map(|chain| parted(chain, corners)).collect();
        (Laid { q: level, guide: guide.clone(), planned: vec![(s0, s1)], chains, fresh: true }, proofs)
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
                match self.done(&place, stroke.drawn.guide.direction(s), gap_steps, so_far) {
                    Done::Cut => {}
                    Done::Barred => barred |= gap_steps >= END_OF_REACH,
                    Done::Left => {
                        let (a, b) = (s - reach_mm, s + reach_mm);
                        match found.last_mut() {
                            Some(open) if a - open.1 <= BRIDGE_MM => open.1 = b,
                            _ => found.push((a, b)),
                        }
                    }
                }
            }
        }
        let end = at[at.len() - 1].1;
        (found.into_iter().map(|(a, b)| (a.max(0.0), b.min(end))).collect(), barred)
    }

    /// Whether the passes laid so far have done all of a run, before any guide is drawn through it.
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
    fn go_on(&self, from: &Place, to: &Place) -> bool {
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
        let most_mm = TOO_HIGH * self.scallop_mm;
        if so_far.is_cut(&touch, self.ball.radius_mm(), most_mm) {
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
        self.ball.is_held_from(&location, 0.5 * self.scallop_mm / normal.z)
    }
}

/// The median of some distances.
fn of_each<T, L>(all: &[T], levels: impl Fn(&T) -> Vec<L>) -> Vec<(usize, L)> {
    all.iter().enumerate().flat_map(|(k, t)| levels(t).into_iter().map(move |l| (k, l))).collect()
}

/// Claimed stretches of a line, over short gaps and with one place more at either end: what is claimed ends
/// somewhere between two places.
fn runs(places: &[Option<Place>]) -> Vec<Vec<Place>> {
    let mut runs = Vec::new();
    for part in places.split(Option::is_none) {
        let part: Vec<Place> = part.iter().flatten().copied().collect();
        let mut claimed: Vec<(usize, usize)> = Vec::new();
        for i in (0..part.len()).filter(|&i| part[i].claimed) {
            match claimed.last_mut() {
                Some(open) if (part[i].point - part[open.1].point).norm() <= BRIDGE_MM => open.1 = i,
                _ => claimed.push((i, i)),
            }
        }
        let beyond =
            |(from, to): (usize, usize)| part[from.saturating_sub(1)..part.len().min(to + 2)].to_vec();
        runs.extend(claimed.into_iter().map(beyond).filter(|run| run.len() > 1));
    }
    runs
}

/// What was found where this was laid.
fn found(laid: &[(Laid, Proofs)], barred: bool) -> Found {
    Found { laid: laid.iter().any(|(laid, _)| !laid.chains.is_empty()), barred }
}
