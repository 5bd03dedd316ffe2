use std::ops::ControlFlow;

use claymill_nurbs::{Aabb, BoxTree, Point3, Vector3, outward};
use claymill_toolpath::FreeSide;
use rayon::prelude::*;

use crate::capsule::Capsule;
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

/// One capsule and where it came from.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Piece {
    pub(crate) capsule: Capsule,
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
            covered = piece.capsule.axis_distance(p) < piece.capsule.radius - tolerance_mm;
            if covered { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        });
        covered
    }

    /// Height of the material that all balls on a `free` side together leave on the surface point `p` with normal `±n`, mm,
    /// if it is no higher than `cap_mm`; where a sheet may be cut from either side, the lower height counts.
    pub(crate) fn residual(&self, p: &Point3, n: &Vector3, cap_mm: f64, free: FreeSide) -> Option<Residual> {
        let mut lowest: Option<Residual> = None;
        self.visit_near(p, self.largest_radius_mm + cap_mm, |piece| {
            let capsule = &piece.capsule;
            let side = (nalgebra::center(&capsule.a, &capsule.b) - p).dot(n).signum();
            if free.allows(side > 0.0)
                && let Some(t) = capsule.entry(p, &(n * side))
                && t <= cap_mm
                && t > -FAR_SIDE * capsule.radius
                && lowest.as_ref().is_none_or(|low| t < low.height_mm)
            {
                lowest = Some(Residual { height_mm: t, side, way: capsule.b - capsule.a });
            }
            ControlFlow::Continue(())
        });
        lowest
    }
}
