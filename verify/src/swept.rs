//! The space that the ball sweeps on all moves but rapids, as capsules in a box tree, and the
//! residual that they leave on a surface point.

use std::ops::ControlFlow;

use claymill_nurbs::{Aabb, BoxTree, Point3, Vector3, outward};
use claymill_toolpath::FreeSide;
use rayon::prelude::*;

use crate::capsule::{Capsule, ball_entry};
use crate::end::sweep::SweptEnd;
use crate::golden::golden_section;
use crate::track::Track;

/// How far below the surface an entry may lie and still belong to this side of the sheet, in radii: a ball
/// on the far side enters about two radii before.
const FAR_SIDE: f64 = 0.5;

/// The space that the ball sweeps on all moves but rapids: capsules along flattened paths.
#[derive(Debug)]
pub(crate) struct Swept<'a> {
    tracks: &'a [Track],
    pieces: Vec<Piece>,
    tree: BoxTree,
    largest_radius_mm: f64,
}

/// Along a chord the exact path is looked for in so many steps of the golden section.
const GOLDEN_STEPS: u32 = 24;
/// Pieces between which [`Swept::left_on`] has to choose, with some to spare.
const RIVALS: usize = 16;

/// What is left exactly on a point of the surface, and which move left it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Left<'a> {
    /// Height along the normal, mm.
    pub(crate) height_mm: f64,
    /// The move that cut lowest.
    pub(crate) track: &'a Track,
    /// Its parameter there.
    pub(crate) parameter: f64,
    /// Its way there, of any length.
    pub(crate) way: Vector3,
}

/// One capsule and where it came from.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Piece {
    pub(crate) capsule: Capsule,
    /// What it is of an end that is no ball.
    pub(crate) end: Option<SweptEnd>,
    /// Index of the track.
    track: u32,
    /// The track's parameters at its ends.
    pub(crate) parameters: (f64, f64),
}

/// What is left on a point of the surface.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Residual {
    /// Height along the normal, mm.
    pub(crate) height_mm: f64,
    /// +1 on the side of the normal, −1 on the other.
    pub(crate) side: f64,
    /// The way of the ball that cut lowest, of any length.
    pub(crate) way: Vector3,
}

impl Piece {
    /// Where the line `p + t·n` enters what is swept, if that may be lower than `below_mm`.
    fn entry(&self, p: &Point3, n: &Vector3, below_mm: f64) -> Option<f64> {
        let Some(end) = &self.end else { return self.capsule.entry(p, n) };
        let half_mm = 0.5 * (end.b - end.a).norm();
        let middle = SweptEnd::at(nalgebra::center(&end.a, &end.b), end.axis, end.body);
        let highest = p + n * below_mm;
        if middle.distance(&highest).0 > half_mm {
            return None;
        }
        if end.is_clear_up_to(&highest, n) {
            return None;
        }
        end.entry(p, n, FAR_SIDE * end.body.radius_mm)
    }
}

/// Where the line `p + t·n` enters the tool at one place of its track.
fn entry_at(track: &Track, parameter: f64, p: &Point3, n: &Vector3) -> Option<f64> {
    let centre = track.centre(parameter).0;
    match track.end {
        None => ball_entry(&(p - centre), n, track.radius_mm),
        Some(body) => {
            let end = SweptEnd::at(centre, track.axis_at(parameter), body);
            end.entry(p, n, FAR_SIDE * body.radius_mm)
        }
    }
}

impl<'a> Swept<'a> {
    /// Flattens all paths within `chord_mm`.
    pub(crate) fn new(tracks: &'a [Track], chord_mm: f64) -> Self {
        let pieces: Vec<Piece> = tracks
            .par_iter()
            .enumerate()
            .filter(|(_, track)| track.sweeps())
            .flat_map_iter(|(index, track)| {
                let corner = |t: f64| (t, track.centre(t).0);
                let corners: Vec<(f64, Point3)> = track.polygon(chord_mm).into_iter().map(corner).collect();
                (1..corners.len()).map(move |i| Piece {
                    capsule: Capsule { a: corners[i - 1].1, b: corners[i].1, radius: track.radius_mm },
                    end: track.end.map(|body| SweptEnd {
                        a: corners[i - 1].1,
                        b: corners[i].1,
                        axis: track.axis_at(corners[i].0),
                        body,
                    }),
                    track: index as u32,
                    parameters: (corners[i - 1].0, corners[i].0),
                })
            })
            .collect();
        let axes: Vec<Aabb> = pieces.par_iter().map(|p| Aabb::of([&p.capsule.a, &p.capsule.b])).collect();
        Swept {
            tree: BoxTree::new(&axes),
            largest_radius_mm: pieces.iter().map(|p| p.capsule.radius).fold(0.0, f64::max),
            pieces,
            tracks,
        }
    }

    /// The track that a piece is of.
    pub(crate) fn track(&self, piece: &Piece) -> &'a Track {
        &self.tracks[piece.track as usize]
    }

    /// The largest ball, mm.
    pub(crate) fn largest_radius_mm(&self) -> f64 {
        self.largest_radius_mm
    }

    /// Calls `found` for every capsule whose axis may come within `distance_mm` of `p`.
    pub(crate) fn visit_near(
        &self,
        p: &Point3,
        distance_mm: f64,
        mut found: impl FnMut(&Piece) -> ControlFlow<()>,
    ) {
        let (place, reach) = ([p.x, p.y, p.z].map(|x| outward([x, x])), distance_mm * distance_mm);
        self.tree.visit(
            |boxes| boxes.distances_squared(&place).map(|d| f64::from(d) <= reach),
            |i| found(&self.pieces[i]),
        );
    }

    /// Whether a ball has been deeper than `tolerance_mm` beyond `p`.
    pub(crate) fn covers(&self, p: &Point3, tolerance_mm: f64) -> bool {
        let mut covered = false;
        self.visit_near(p, self.largest_radius_mm, |piece| {
            covered = match &piece.end {
                None => piece.capsule.axis_distance(p) < piece.capsule.radius - tolerance_mm,
                Some(end) => end.distance(p).0 < -tolerance_mm,
            };
            if covered { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        });
        covered
    }

    /// As [`Swept::residual`], of the exact paths instead of chords within `chord_mm` of them.
    pub(crate) fn left_on(
        &self,
        p: &Point3,
        n: &Vector3,
        cap_mm: f64,
        chord_mm: f64,
        free: FreeSide,
    ) -> Option<Left<'a>> {
        let slack_mm = 2.0 * chord_mm;
        let mut lowest = cap_mm;
        let mut rivals: Vec<(f64, Piece, Vector3)> = Vec::with_capacity(RIVALS);
        self.visit_near(p, self.largest_radius_mm + cap_mm, |piece| {
            let capsule = &piece.capsule;
            let side = (nalgebra::center(&capsule.a, &capsule.b) - p).dot(n).signum();
            let n = n * side;
            if free.allows(side > 0.0)
                && let Some(t) = piece.entry(p, &n, lowest + slack_mm)
                && t <= lowest + slack_mm
                && t > -FAR_SIDE * capsule.radius
            {
                lowest = lowest.min(t);
                rivals.push((t, *piece, n));
            }
            ControlFlow::Continue(())
        });
        rivals.retain(|(t, ..)| *t <= lowest + slack_mm);
        let exact = rivals.into_iter().filter_map(|(_, piece, n)| {
            let track = self.track(&piece);
            let parameter = lowest_entry(track, &piece, p, &n);
            let (_, way) = track.centre(parameter);
            let height_mm = entry_at(track, parameter, p, &n)?;
            Some(Left { height_mm, track, parameter, way })
        });
        // Ties go to the earlier move.
        exact.min_by(|a, b| a.height_mm.total_cmp(&b.height_mm).then(a.track.seq.cmp(&b.track.seq)))
    }

    /// Whether some ball on a `free` side of the surface point `p` with normal `±n`, whose centre is where `counts`, leaves no
    /// more than `cap_mm` there.
    pub(crate) fn reaches(
        &self,
        p: &Point3,
        n: &Vector3,
        cap_mm: f64,
        free: FreeSide,
        mut counts: impl FnMut(&Point3) -> bool,
    ) -> bool {
        let mut reaches = false;
        self.visit_near(p, self.largest_radius_mm + cap_mm, |piece| {
            let capsule = &piece.capsule;
            let side = (nalgebra::center(&capsule.a, &capsule.b) - p).dot(n).signum();
            let n = n * side;
            let comes_down = |t: f64| t <= cap_mm && t > -FAR_SIDE * capsule.radius;
            if free.allows(side > 0.0) && capsule.entry(p, &n).is_some_and(comes_down) {
                let track = self.track(piece);
                reaches = counts(&track.centre(lowest_entry(track, piece, p, &n)).0);
            }
            if reaches { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        });
        reaches
    }

    /// Height of the material that all balls on a `free` side together leave on the surface point `p` with normal `±n`, mm,
    /// if it is no higher than `cap_mm`; where a sheet may be cut from either side, the lower height counts.
    pub(crate) fn residual(&self, p: &Point3, n: &Vector3, cap_mm: f64, free: FreeSide) -> Option<Residual> {
        self.residual_after(&mut None, p, n, cap_mm, free)
    }

    /// The same, beginning with the piece that cut lowest at a place near by: most others are then known to be higher at once.
    /// Which piece it is here takes its place.
    pub(crate) fn residual_after(
        &self,
        near_by: &mut Option<Piece>,
        p: &Point3,
        n: &Vector3,
        cap_mm: f64,
        free: FreeSide,
    ) -> Option<Residual> {
        let mut lowest: Option<Residual> = None;
        let mut look = |piece: &Piece| {
            let capsule = &piece.capsule;
            let side = (nalgebra::center(&capsule.a, &capsule.b) - p).dot(n).signum();
            if free.allows(side > 0.0)
                && let Some(t) = piece.entry(p, &(n * side), lowest.map_or(cap_mm, |low| low.height_mm))
                && t <= cap_mm
                && t > -FAR_SIDE * capsule.radius
                && lowest.as_ref().is_none_or(|low| t < low.height_mm)
            {
                lowest = Some(Residual { height_mm: t, side, way: capsule.b - capsule.a });
                return true;
            }
            false
        };
        let mut cut = near_by.filter(&mut look);
        self.visit_near(p, self.largest_radius_mm + cap_mm, |piece| {
            if look(piece) {
                cut = Some(*piece);
            }
            ControlFlow::Continue(())
        });
        *near_by = cut.or(*near_by);
        lowest
    }
}

/// The parameter within a piece at which the ball enters the line from `p` along `n` lowest: the golden section, for along a
/// chord the height falls and rises once.
fn lowest_entry(track: &Track, piece: &Piece, p: &Point3, n: &Vector3) -> f64 {
    let height = |t: f64| {
        // Beside the ball the line is the nearer the lower.
        entry_at(track, t, p, n).unwrap_or_else(|| {
            let m = p - track.centre(t).0;
            track.radius_mm + (m - n * m.dot(n)).norm()
        })
    };
    let (first, last) = piece.parameters;
    let [a, b] = golden_section([first, last], GOLDEN_STEPS, |t| -height(t));
    // The ends of a path are sharp.
    [first, last, 0.5 * (a + b)].into_iter().min_by(|s, t| height(*s).total_cmp(&height(*t))).unwrap_or(first)
}
