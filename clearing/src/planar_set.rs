//! Sets of the plane, bounded by polygons on a grid of 20 nm: the one type through which the polygon library is used.
//!
//! ```text
//!      ╭───╮  dilated: inscribed arcs, so never too large          union, intersection, difference: exact
//!      │ ■ │  eroded: by a hair more than asked, so never too large    up to the grid
//!      ╰───╯
//! ```

use i_overlay::core::fill_rule::FillRule;
use i_overlay::core::overlay::{IntOverlayOptions, Overlay};
use i_overlay::core::overlay_rule::OverlayRule;
use i_overlay::core::solver::{Precision, Solver};
use i_overlay::i_float::int::point::IntPoint;
use i_overlay::i_shape::source::int::resource::IntShapeResource;

use crate::offset;

/// Steps of the grid per mm.
pub(crate) const STEPS_PER_MM: f64 = 5e4;
/// Nothing may lie further from the origin than this, mm: the integers of the grid have 32 bits.
pub const FARTHEST_MM: f64 = 9000.0;
/// Arcs become chords within this distance, mm.
pub(crate) const CHORD_MM: f64 = 1e-3;
/// Vertices that are no further than this from the line past them are left out, steps of the grid.
const STRAIGHT_STEPS: f64 = 1.5e-3 * STEPS_PER_MM;
/// Vertices that may be left out one after the other.
const LONGEST_RUN: usize = 64;

/// Crossings are snapped to corners within 4 steps of the grid, and twice as far in every pass that this takes: borders that are
/// almost the same, of which there are many, then take few passes.
const SNAPPING: Precision = Precision { start: 4, progression: 2 };

pub(crate) type Contour = Vec<IntPoint<i32>>;

/// A set of the plane: what lies left of its contours. Coordinates are mm.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct PlanarSet {
    /// Outlines run anticlockwise, holes clockwise; the outline of a part comes before its holes.
    parts: Vec<Vec<Contour>>,
}

pub(crate) fn on_grid([x, y]: [f64; 2]) -> IntPoint<i32> {
    let limit = FARTHEST_MM * STEPS_PER_MM;
    IntPoint::new(
        (x * STEPS_PER_MM).round().clamp(-limit, limit) as i32,
        (y * STEPS_PER_MM).round().clamp(-limit, limit) as i32,
    )
}

pub(crate) fn to_mm(p: IntPoint<i32>) -> [f64; 2] {
    [f64::from(p.x) / STEPS_PER_MM, f64::from(p.y) / STEPS_PER_MM]
}

/// A boolean operation on sets of contours.
pub(crate) fn overlay<A, B>(a: &A, b: &B, rule: OverlayRule, fill: FillRule) -> Vec<Vec<Contour>>
where
    A: IntShapeResource<i32> + ?Sized,
    B: IntShapeResource<i32> + ?Sized,
{
    let solver = Solver::with_precision(SNAPPING);
    Overlay::from_subj_and_clip_custom(a, b, IntOverlayOptions::default(), solver).overlay(rule, fill)
}

impl PlanarSet {
    /// What polygons enclose an odd number of times. Coordinates beyond [`FARTHEST_MM`] are moved there.
    #[must_use]
    pub fn of_polygons(polygons: &[Vec<[f64; 2]>]) -> Self {
        Self::of_contours(&contours(polygons), FillRule::EvenOdd)
    }

    /// All that lies in any of the polygons, which may overlap, and run one way round or the other. Coordinates beyond
    /// [`FARTHEST_MM`] are moved there.
    #[must_use]
    pub fn covered_by(polygons: &[Vec<[f64; 2]>]) -> Self {
        Self::of_contours(&contours(polygons), FillRule::NonZero)
    }

    /// What anticlockwise polygons enclose, which may touch and overlap.
    pub(crate) fn of_disjoint(polygons: &[Vec<[f64; 2]>]) -> Self {
        Self::of_contours(&contours(polygons), FillRule::Positive)
    }

    /// What contours enclose by a rule, which may cross.
    fn of_contours(contours: &[Contour], rule: FillRule) -> Self {
        let nothing: &[Contour] = &[];
        PlanarSet { parts: overlay(contours, nothing, OverlayRule::Subject, rule) }
    }

    /// A rectangle: xmin, ymin, xmax, ymax.
    #[must_use]
    pub fn rectangle([x0, y0, x1, y1]: [f64; 4]) -> Self {
        PlanarSet::of_polygons(&[vec![[x0, y0], [x1, y0], [x1, y1], [x0, y1]]])
    }

    /// A disc, as an inscribed polygon.
    #[must_use]
    pub fn disc(centre: [f64; 2], radius_mm: f64) -> Self {
        let count = (std::f64::consts::TAU / chord_angle(radius_mm)).ceil().max(12.0) as usize;
        let corner = |k: usize| {
            let (sine, cosine) = (std::f64::consts::TAU * k as f64 / count as f64).sin_cos();
            [centre[0] + radius_mm * cosine, centre[1] + radius_mm * sine]
        };
        PlanarSet::of_polygons(&[(0..count).map(corner).collect()])
    }

    /// Whether there is nothing in it.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.parts.is_empty()
    }

    fn with(&self, other: &Self, rule: OverlayRule) -> Self {
        PlanarSet { parts: overlay(&self.parts, &other.parts, rule, FillRule::NonZero) }
    }

    /// What is in this set or in another.
    #[must_use]
    pub fn union(&self, other: &Self) -> Self {
        self.with(other, OverlayRule::Union)
    }

    /// What is in both.
    #[must_use]
    pub fn intersection(&self, other: &Self) -> Self {
        self.with(other, OverlayRule::Intersect)
    }

    /// What is in this one and not in the other.
    #[must_use]
    pub fn minus(&self, other: &Self) -> Self {
        self.with(other, OverlayRule::Difference)
    }

    /// All that is within a distance of it, less a hair along arcs.
    #[must_use]
    pub fn dilated(&self, mm: f64) -> Self {
        self.offset(mm)
    }

    /// What is further than a distance from all that is not in it, less a hair everywhere.
    #[must_use]
    pub fn eroded(&self, mm: f64) -> Self {
        self.offset(-(mm + CHORD_MM))
    }

    /// Outlines and holes are offset one by one, as sets without holes.
    fn offset(&self, mm: f64) -> Self {
        let of_part = |part: &Vec<Contour>| {
            let mut contours = part.iter();
            let outline =
                PlanarSet { parts: contours.next().map_or_else(Vec::new, |c| offset::offset(c, mm)) };
            contours.fold(outline, |set, hole| {
                let hole: Contour = hole.iter().rev().copied().collect();
                set.minus(&PlanarSet { parts: offset::offset(&hole, -mm) })
            })
        };
        // Where an arc is run along to and fro, the chords of both ways enclose slivers.
        let parts: Vec<Self> =
            self.parts.iter().map(|part| of_part(part).without_slivers(CHORD_MM)).collect();
        let parts: Vec<Self> = parts.into_iter().filter(|part| !part.is_empty()).collect();
        match &parts[..] {
            [one] => one.clone(),
            _ if mm <= 0.0 => parts.iter().fold(PlanarSet::default(), Self::joined),
            _ => {
                let contours: Vec<Contour> = parts.into_iter().flat_map(|p| p.parts).flatten().collect();
                Self::of_contours(&contours, FillRule::Positive)
            }
        }
    }

    /// The same without vertices that change it by less than a quarter of a micrometre.
    #[must_use]
    pub fn simplified(&self) -> Self {
        let contours: Vec<Contour> =
            self.parts.iter().flatten().map(simplified).filter(|c| c.len() > 2).collect();
        // Where two borders are beside each other they may cross now.
        Self::of_contours(&contours, FillRule::Positive)
    }

    /// Without parts and holes that are thinner than this on the mean, mm: noise of the grid.
    pub(crate) fn without_slivers(&self, mm: f64) -> Self {
        let is_thick = |c: &Contour| mean_width(c) > mm * STEPS_PER_MM;
        let of_part = |part: &Vec<Contour>| -> Vec<Contour> {
            if part.first().is_some_and(is_thick) {
                part.iter().filter(|c| is_thick(c)).cloned().collect()
            } else {
                Vec::new()
            }
        };
        PlanarSet { parts: self.parts.iter().map(of_part).filter(|part| !part.is_empty()).collect() }
    }

    /// Twice the area by the length of the border: the width of a long set, mm.
    pub(crate) fn mean_width_mm(&self) -> f64 {
        let border: f64 = self.parts.iter().flatten().map(length).sum();
        2.0 * self.area_mm2() * STEPS_PER_MM / border.max(1.0)
    }

    /// Its connected parts.
    #[must_use]
    pub fn parts(&self) -> Vec<PlanarSet> {
        self.parts.iter().map(|part| PlanarSet { parts: vec![part.clone()] }).collect()
    }

    /// Both sets, of which nothing overlaps.
    pub(crate) fn joined(mut self, other: &Self) -> Self {
        self.parts.extend(other.parts.iter().cloned());
        self
    }

    /// Its area, mm².
    #[must_use]
    pub fn area_mm2(&self) -> f64 {
        let twice = self.parts.iter().flatten().map(twice_area).fold(0, i64::wrapping_add);
        0.5 * twice as f64 / (STEPS_PER_MM * STEPS_PER_MM)
    }

    /// Its contours, mm: outlines anticlockwise, holes clockwise.
    #[must_use]
    pub fn contours(&self) -> Vec<Vec<[f64; 2]>> {
        self.parts.iter().flatten().map(|c| c.iter().copied().map(to_mm).collect()).collect()
    }

    /// Its box: xmin, ymin, xmax, ymax; `None` if it is empty.
    #[must_use]
    pub fn bounds(&self) -> Option<[f64; 4]> {
        let mut points = self.parts.iter().flatten().flatten().map(|&p| to_mm(p));
        let [x, y] = points.next()?;
        Some(points.fold([x, y, x, y], |b, [x, y]| [b[0].min(x), b[1].min(y), b[2].max(x), b[3].max(y)]))
    }

    /// Vertices of all contours.
    #[must_use]
    pub fn vertex_count(&self) -> usize {
        self.parts.iter().flatten().map(Vec::len).sum()
    }
}

fn contours(polygons: &[Vec<[f64; 2]>]) -> Vec<Contour> {
    polygons.iter().map(|p| p.iter().copied().map(on_grid).collect()).collect()
}

fn twice_area(c: &Contour) -> i64 {
    let cross = |(a, b): (&IntPoint<i32>, &IntPoint<i32>)| {
        i64::from(a.x) * i64::from(b.y) - i64::from(b.x) * i64::from(a.y)
    };
    c.iter().zip(c.iter().cycle().skip(1)).map(cross).fold(0, i64::wrapping_add)
}

/// The length of a side of an outline, in units of the grid.
pub(crate) fn side_length(a: IntPoint<i32>, b: IntPoint<i32>) -> f64 {
    let (x, y) = (f64::from(a.x) - f64::from(b.x), f64::from(a.y) - f64::from(b.y));
    (x * x + y * y).sqrt()
}

fn length(c: &Contour) -> f64 {
    c.iter().zip(c.iter().cycle().skip(1)).map(|(&a, &b)| side_length(a, b)).sum()
}

fn mean_width(c: &Contour) -> f64 {
    twice_area(c).unsigned_abs() as f64 / length(c).max(1.0)
}

/// The angle of a chord that is within [`CHORD_MM`] of an arc.
pub(crate) fn chord_angle(radius_mm: f64) -> f64 {
    (2.0 * (1.0 - CHORD_MM / radius_mm.max(CHORD_MM)).acos()).clamp(0.004, 0.5)
}

/// Leaves vertices out while the line past them stays near all of them.
fn simplified(contour: &Contour) -> Contour {
    let n = contour.len();
    let apart = |a: IntPoint<i32>, b: IntPoint<i32>, p: IntPoint<i32>| {
        let [ax, ay, px, py] = [b.x - a.x, b.y - a.y, p.x - a.x, p.y - a.y].map(f64::from);
        let length = (ax * ax + ay * ay).sqrt();
        let share =
            if length > 0.0 { ((ax * px + ay * py) / (length * length)).clamp(0.0, 1.0) } else { 0.0 };
        let (x, y) = (px - share * ax, py - share * ay);
        (x * x + y * y).sqrt()
    };
    let mut kept: Contour = Vec::with_capacity(n);
    let (mut last, mut k) = (0, 0);
    kept.push(contour[0]);
    while k < n {
        k += 1;
        let next = contour[(k + 1) % n];
        let run = last + 1..=k;
        let is_straight = k < n
            && k - last < LONGEST_RUN
            && run.clone().all(|i| apart(contour[last], next, contour[i]) <= STRAIGHT_STEPS);
        if !is_straight && k < n {
            kept.push(contour[k]);
            last = k;
        }
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    fn near(found: f64, wanted: f64, slack: f64) {
        assert!((found - wanted).abs() <= slack, "{found} instead of {wanted}");
    }

    #[test]
    fn an_opening_rounds_the_corners_of_a_square() {
        let square = PlanarSet::rectangle([0.0, 0.0, 10.0, 10.0]);
        near(square.area_mm2(), 100.0, 1e-9);
        let opened = square.eroded(2.0).dilated(2.0);
        near(opened.area_mm2(), 100.0 - (4.0 - std::f64::consts::PI) * 4.0, 0.06);
        assert!(opened.minus(&square).is_empty());
        near(square.dilated(2.0).area_mm2(), 100.0 + 80.0 + 4.0 * std::f64::consts::PI, 0.02);
    }

    #[test]
    fn holes_are_kept_and_grow_when_a_set_is_eroded() {
        let frame =
            PlanarSet::rectangle([0.0, 0.0, 10.0, 10.0]).minus(&PlanarSet::rectangle([4.0, 4.0, 6.0, 6.0]));
        near(frame.area_mm2(), 96.0, 1e-9);
        let eroded = frame.eroded(1.0);
        near(eroded.area_mm2(), 64.0 - 4.0 - 8.0 - std::f64::consts::PI, 0.06);
        assert_eq!(eroded.contours().len(), 2);
        assert!(frame.eroded(2.0).minus(&frame).is_empty());
        assert!(frame.eroded(6.0).is_empty());
    }

    #[test]
    fn straight_vertices_are_left_out_and_arcs_are_kept() {
        let many: Vec<[f64; 2]> =
            (0..40).map(|k| [0.25 * f64::from(k), 1e-5 * f64::from(k % 2)]).chain([[9.75, 5.0]]).collect();
        let set = PlanarSet::of_polygons(&[many]);
        let simple = set.simplified();
        assert!(simple.vertex_count() < 6, "{}", simple.vertex_count());
        near(simple.area_mm2(), set.area_mm2(), 1e-3);
        let disc = PlanarSet::disc([1.0, 2.0], 5.0);
        assert_eq!(disc.simplified().vertex_count(), disc.vertex_count());
    }
}
