//! Reads the obstacles of a job and measures how near the ball comes to them on any move, rapids
//! too.

use std::path::Path;

use claymill_exchange::{ObstacleMesh, read_mesh};
use claymill_nurbs::{Aabb, BoxTree, Point3};
use claymill_toolpath::{Cancelled, Job, sha256_of};
use rayon::prelude::*;

use crate::VerifyError;
use crate::options::VerifyOptions;
use crate::report::{Obstacles, Place};
use crate::scene::{Scene, Stage};
use crate::track::Track;

/// What may hide between two samples, mm: the distance from a fixed point falls below the straight line between two
/// values by `step² / 8R` at most.
pub(crate) const UNSEEN_MM: f64 = 5e-4;
/// Moves may come nearer to an obstacle than was asked for by this, mm: they are written and fitted beside the exact ones.
const KEPT_MM: f64 = 0.02;
/// Allows for the curvature of the path between two samples.
pub(crate) const SAG_MARGIN: f64 = 1.5;

/// The triangles of all obstacles, ready for distances.
#[derive(Debug)]
pub(crate) struct ObstacleSet {
    pub(crate) files: Vec<String>,
    pub(crate) triangles: Vec<[Point3; 3]>,
    tree: BoxTree,
}

impl ObstacleSet {
    /// Reads the obstacles that the job was planned around, and those that the options add.
    pub(crate) fn read(job: &Job, options: &VerifyOptions) -> Result<Self, VerifyError> {
        let mut set = ObstacleSet { files: Vec::new(), triangles: Vec::new(), tree: BoxTree::new(&[]) };
        for obstacle in &job.request.check {
            let path = &obstacle.find(&options.folder);
            let found = sha256_of(path)?;
            if found != obstacle.sha256 {
                let expected = obstacle.sha256.clone();
                return Err(VerifyError::ModelChanged { path: path.to_owned(), expected, found });
            }
            set.add(path, &read_mesh(path, obstacle.unit_mm)?);
        }
        for path in &options.obstacles {
            set.add(path, &read_mesh(path, options.obstacle_unit_mm)?);
        }
        let boxes: Vec<Aabb> = set.triangles.iter().map(Aabb::of).collect();
        Ok(ObstacleSet { tree: BoxTree::new(&boxes), ..set })
    }

    fn add(&mut self, path: &Path, mesh: &ObstacleMesh) {
        self.files.push(path.display().to_string());
        let corners = mesh.triangles.iter().map(|t| t.map(|i| mesh.vertices[i as usize]));
        self.triangles.extend(corners);
    }

    /// Distance from `p` to the nearest triangle and the point there; `None` if that is not below `within`.
    fn nearest(&self, p: &Point3, within: f64) -> Option<(f64, Point3)> {
        let mut best: Option<(f64, Point3)> = None;
        let reach = |best: &Option<(f64, Point3)>| best.map_or(within, |b| b.0);
        let bound = |best: &Option<(f64, Point3)>| reach(best).powi(2);
        self.tree.nearest_first(p, &mut best, bound, |best, i| {
            let q = closest_on_triangle(&self.triangles[i], p);
            let d = (q - p).norm();
            if d < reach(best) {
                *best = Some((d, q));
            }
        });
        best
    }

    /// Whether a triangle is nearer than `within`.
    pub(crate) fn any_within(&self, p: &Point3, within: f64) -> bool {
        self.nearest(p, within).is_some()
    }
}

/// The point of a triangle that is nearest to `p`: its foot on the plane if that is inside, else on a side.
pub(crate) fn closest_on_triangle(corners: &[Point3; 3], p: &Point3) -> Point3 {
    let [a, b, c] = corners;
    let n = (b - a).cross(&(c - a));
    let inside = |from: &Point3, to: &Point3| (to - from).cross(&(p - from)).dot(&n) >= 0.0;
    if n.norm_squared() > 0.0 && inside(a, b) && inside(b, c) && inside(c, a) {
        return p - n * ((p - a).dot(&n) / n.norm_squared());
    }
    let on_side = |from: &Point3, to: &Point3| {
        let way = to - from;
        let size = way.norm_squared();
        let t = if size > 0.0 { ((p - from).dot(&way) / size).clamp(0.0, 1.0) } else { 0.0 };
        from + way * t
    };
    let sides = [on_side(a, b), on_side(b, c), on_side(c, a)];
    let away = |q: &Point3| (q - p).norm_squared();
    sides.into_iter().min_by(|q, r| away(q).total_cmp(&away(r))).unwrap_or(*a)
}

/// Sweeps the ball along every move, rapids too, and measures its distance from the obstacles.
pub(crate) fn measure(scene: &Scene<'_>, stage: &Stage<'_>) -> Result<Option<Obstacles>, Cancelled> {
    let set = &scene.obstacles;
    if set.files.is_empty() {
        return Ok(None);
    }
    let asked_mm = scene.check_clearance_mm();
    let walk = |track: &Track| {
        let margin = asked_mm + scene.options.path_spacing_mm;
        let mut walk = Walk { set, track, asked_mm, margin, least: None, samples: 0 };
        let stations = track.stations(scene.options.path_spacing_mm);
        let probes: Vec<Probe> = stations.into_iter().map(|t| walk.probe(t)).collect();
        probes.windows(2).for_each(|pair| walk.between(&pair[0], &pair[1]));
        (walk.least.map(|(gap, t, at)| (gap, t, at, track.seq)), walk.samples)
    };
    let part = |track| stage.part(scene.tracks.len(), || walk(track));
    let found: Vec<_> = scene.tracks.par_iter().map(part).collect::<Result<_, _>>()?;
    let bar = -scene.options.gouge_limit_mm;
    let below = |bar: f64| found.iter().filter(|f| f.0.is_some_and(|l| l.0 < bar)).count() as u64;
    let least = found.iter().filter_map(|f| f.0).reduce(|a, b| if b.0 < a.0 { b } else { a });
    Ok(Some(Obstacles {
        files: set.files.clone(),
        triangles: set.triangles.len() as u64,
        samples: found.iter().map(|f| f.1).sum(),
        touching: below(bar),
        asked_mm,
        near: if asked_mm > 0.0 { below((asked_mm - KEPT_MM).max(bar)) } else { 0 },
        clearance_min_mm: least.map(|l| l.0),
        clearance_min_at: least.map(|(_, t, at, seq)| Place {
            move_seq: Some(seq),
            parameter: Some(t),
            ..scene.place(at, None)
        }),
    }))
}

struct Walk<'a> {
    set: &'a ObstacleSet,
    track: &'a Track,
    /// The gap that has to be kept.
    asked_mm: f64,
    /// Gaps beyond this are not measured.
    margin: f64,
    /// Smallest gap, its parameter, and the obstacle's point there.
    least: Option<(f64, f64, Point3)>,
    samples: u64,
}

#[derive(Clone, Copy)]
struct Probe {
    t: f64,
    centre: Point3,
    gap: f64,
}

impl Walk<'_> {
    fn probe(&mut self, t: f64) -> Probe {
        self.samples += 1;
        let centre = self.track.centre(t).0;
        let radius = self.track.radius_mm;
        let Some((distance, at)) = self.set.nearest(&centre, radius + self.margin) else {
            return Probe { t, centre, gap: self.margin };
        };
        let gap = distance - radius;
        if self.least.is_none_or(|l| gap < l.0) {
            self.least = Some((gap, t, at));
        }
        Probe { t, centre, gap }
    }

    /// Halves the way between two probes until nothing can hide there.
    fn between(&mut self, a: &Probe, b: &Probe) {
        let step = (b.centre - a.centre).norm();
        let sag = SAG_MARGIN * step * step / (8.0 * self.track.radius_mm);
        if sag <= UNSEEN_MM || a.gap.min(b.gap) - self.asked_mm > sag {
            return;
        }
        let middle = self.probe(0.5 * (a.t + b.t));
        self.between(a, &middle);
        self.between(&middle, b);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_point_of_a_triangle_is_that_of_a_dense_sampling() {
        let t = [Point3::new(0.0, 0.0, 0.0), Point3::new(9.0, 2.0, 5.0), Point3::new(1.0, 8.0, -3.0)];
        let steps = 400;
        for p in [[3.0, 3.0, 4.0], [12.0, 0.0, 0.0], [-3.0, -4.0, 1.0], [5.0, 9.0, 2.0], [4.0, 2.0, -6.0]] {
            let p = Point3::from(p);
            let found = (closest_on_triangle(&t, &p) - p).norm();
            let mut brute = f64::INFINITY;
            for i in 0..=steps {
                for j in 0..=steps - i {
                    let (u, v) = (f64::from(i) / f64::from(steps), f64::from(j) / f64::from(steps));
                    brute = brute.min((t[0] + (t[1] - t[0]) * u + (t[2] - t[0]) * v - p).norm());
                }
            }
            assert!(found <= brute + 1e-12 && brute - found < 1e-3, "{p}: {found} {brute}");
        }
    }
}
