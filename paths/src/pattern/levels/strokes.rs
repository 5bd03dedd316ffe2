//! Places along a level curve, and the drive curves through them.

use claymill_nurbs::{FaceId, Point2, Point3, Vector3};

use crate::curve::contour::contour;
use crate::curve::plan_curve::{Drawn, through};
use crate::follow::profile::{follow, parted};
use crate::follow::proofs::Proofs;
use crate::pattern::levels::pattern::{ASIDE, BRIDGE_MM, Levels, Spot};
use crate::pattern::part_region::PartRegion;
use crate::pattern::rows::crests::PlannedPass;
use crate::setup::context::SetupContext;
use crate::setup::leaning::OVERHANGING;

/// Where a border crosses a line is bisected so many times: to 1 µm of a few millimetres.
const BISECTIONS: usize = 12;

/// A place where the ball should touch.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Place {
    pub(crate) spot: Spot,
    pub(crate) point: Point3,
    pub(crate) normal: Vector3,
    pub(crate) centre: Point3,
    pub(crate) claimed: bool,
}

/// A drive curve with the places that it is made of.
pub(crate) struct Stroke {
    pub(crate) drawn: Drawn,
    pub(crate) places: Vec<Place>,
}

impl Stroke {
    /// About where the ball's centre is over the drive curve.
    pub(crate) fn centre(&self, s: f64) -> Point3 {
        let at = &self.drawn.at;
        let near = at.partition_point(|p| p.1 < s).min(at.len() - 1);
        let [x, y] = self.drawn.drive.at(s);
        Point3::new(x, y, self.places[at[near].0].centre.z)
    }
}

impl SetupContext<'_> {
    /// Where the ball is when it touches the spots, `None` where they lean too far. What is claimed within half a step
    /// beside a line counts as well: it is for this line to cut.
    pub(crate) fn places(&self, line: &[Spot]) -> Vec<Option<Place>> {
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

    /// The normal on the side of a face that is cut, of one on either side.
    pub(crate) fn upper(&self, face: FaceId, normal: Vector3) -> Vector3 {
        match self.beside_walls {
            Some(sides) => normal * sides[face],
            None if normal.z < 0.0 => -normal,
            None => normal,
        }
    }

    pub(crate) fn place(&self, spot: Spot) -> Option<Place> {
        let surface = self.ball.surface(spot.face);
        let (n, _) = surface.normal(spot.u, spot.v)?;
        let normal = self.upper(spot.face, n);
        let least_facing = if self.beside_walls.is_some() { OVERHANGING } else { self.least_facing };
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
    pub(crate) fn runs(&self, pattern: &dyn Levels, level: f64) -> (Vec<Vec<Place>>, bool) {
        let (mut all, mut leans) = (Vec::new(), false);
        for line in pattern.lines(level) {
            let places = self.places(&line);
            leans |= pattern.height_mm(level).is_some() && self.leans(&places, &line);
            all.extend(runs(&places).into_iter().map(|run| self.up_to_borders(run)));
        }
        (all, leans)
    }

    /// A run whose ends lie where the border of the setup crosses the line, and not at the place beyond.
    fn up_to_borders(&self, mut run: Vec<Place>) -> Vec<Place> {
        let last = run.len() - 1;
        for (beyond, within) in [(0, 1), (last, last - 1)] {
            if let Some(end) = self.at_border(&run[within], &run[beyond]) {
                run[beyond] = end;
            }
        }
        run
    }

    /// Where the border of the setup crosses the way from a claimed place to one that is not, if it does on their face.
    fn at_border(&self, within: &Place, beyond: &Place) -> Option<Place> {
        let (a, b) = (within.spot, beyond.spot);
        if beyond.claimed || !self.go_on(within, beyond) {
            return None;
        }
        let at = |share: f64| Spot { u: a.u + (b.u - a.u) * share, v: a.v + (b.v - a.v) * share, ..a };
        let along = beyond.point - within.point;
        let is_claimed = |place: &Place| place.claimed || self.is_claimed_beside(place, along);
        let (mut inside, mut outside) = (0.0, 1.0);
        let mut end = *within;
        for _ in 0..BISECTIONS {
            let middle = 0.5 * (inside + outside);
            match self.place(at(middle)).filter(is_claimed) {
                Some(place) => (inside, end) = (middle, place),
                None => outside = middle,
            }
        }
        let far = at(outside);
        let is_border = self.claims.is_crossed(far.face, Point2::new(far.u, far.v));
        is_border.then_some(Place { claimed: true, ..end })
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

    pub(crate) fn strokes(&self, runs: Vec<Vec<Place>>, height_mm: Option<f64>) -> Vec<Stroke> {
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
    pub(crate) fn lay_stroke(
        &self,
        stroke: &Stroke,
        level: f64,
        stretch: Option<(f64, f64)>,
        ground: &PartRegion,
    ) -> (PlannedPass, Proofs) {
        let at = &stroke.drawn.at;
        let (s0, s1) = stretch.unwrap_or((at[0].1, at[at.len() - 1].1));
        let drive = &stroke.drawn.drive;
        let followed = match self.beside_walls {
            Some(_) => self.follow_beside(drive, level, [s0, s1]),
            None => follow(self.ball, drive, s0, s1),
        };
        let proofs = followed.proofs;
        let corners = &stroke.drawn.corners;
        let passes = self.kept(followed.passes(self.shortest_pass_mm(), |face| ground.owns(face)), drive);
        let chains = passes.into_iter().map(|chain| parted(chain, corners)).collect();
        (PlannedPass { q: level, drive: drive.clone(), planned: vec![(s0, s1)], chains, fresh: true }, proofs)
    }
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
