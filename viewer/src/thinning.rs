//! Evenly spaced selection of passes (Jobard and Lefer 1997), so that drawn lines stay a few pixels
//! apart.

use std::ops::Range;

use rayon::prelude::*;

use crate::cells::Cells;
use crate::shapes::{LineLayer, Strip};

type Place = [f32; 3];

/// A run goes on until it is nearer than this part of the spacing to what is drawn already: the ratio that
/// Jobard and Lefer found to give long lines and still even ones.
const KEPT_ABOVE: f32 = 0.5;
/// Distance of the stations along a strip, as a part of the spacing.
const STATION: f32 = 0.5;
/// Side of a grid cell, as a multiple of the spacing: balances entries a station against looks a query.
const CELL: f32 = 3.0;

/// A part of a strip that is drawn.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Run {
    /// Index of the strip.
    pub(crate) strip: usize,
    /// Its points.
    pub(crate) points: Vec<Place>,
}

/// What is left of a layer for a picture in which lines should stay about `spacing_mm` apart.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Thinned {
    /// What is drawn, in the order of the strips.
    pub(crate) runs: Vec<Run>,
    /// Drawn part of the length that is in the picture.
    pub(crate) share: f32,
}

/// How near a station is to what is drawn already.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Room {
    None,
    ToGoOn,
    ToBegin,
}

/// A place on a strip, to be judged.
#[derive(Debug, Clone, Copy)]
struct Station {
    /// Length along the strip up to here, mm.
    along_mm: f32,
    at: Place,
}

/// Evenly spaced lines after B. Jobard and W. Lefer, *Creating Evenly-Spaced Streamlines of Arbitrary
/// Density* (1997), with the passes as candidates, in program order: a pass is drawn where it has room to
/// begin, farther than `spacing_mm` from all passes drawn before, and on both sides of there as long as it
/// keeps half of that. Neighbouring rows follow each other in a program, so that every n-th row is drawn,
/// with n following the distance of the rows from place to place.
///
/// Only segments that `in_frame` are looked at, the rest is not drawn.
pub(crate) fn evenly_spaced(
    layer: &LineLayer,
    spacing_mm: f32,
    in_frame: impl Fn(&Place, &Place) -> bool + Sync,
) -> Thinned {
    let points = |s: &Strip| &layer.points[s.first..s.first + s.count];
    let stations: Vec<Vec<Station>> =
        layer.strips.par_iter().map(|s| stations(points(s), STATION * spacing_mm, &in_frame)).collect();
    let mut drawn = DrawnStations::new(spacing_mm);
    let mut spans: Vec<(usize, Range<f32>)> = Vec::new();
    let (mut kept, mut all) = (0, 0);
    let indices: Vec<usize> = (0..layer.strips.len()).collect();
    for pass in indices.chunk_by(|&a, &b| layer.strips[a].pass == layer.strips[b].pass) {
        let first_span = spans.len();
        for &strip in pass {
            let rooms = drawn.rooms(&stations[strip]);
            let neighbours = |a: usize| {
                // A gap: the strip leaves the picture in between.
                stations[strip][a + 1].along_mm - stations[strip][a].along_mm < 1.5 * STATION * spacing_mm
            };
            for run in runs(&rooms, neighbours) {
                let half = 0.5 * STATION * spacing_mm;
                let ends = [run.start, run.end - 1].map(|i| stations[strip][i].along_mm);
                spans.push((strip, ends[0] - half..ends[1] + half));
                kept += run.len();
            }
            all += rooms.len();
        }
        // Only now: the parts of one pass do not keep each other away.
        for (strip, span) in &spans[first_span..] {
            let stations = &stations[*strip];
            let first = stations.partition_point(|s| s.along_mm < span.start);
            for s in stations[first..].iter().take_while(|s| s.along_mm < span.end) {
                drawn.add(s.at);
            }
        }
    }
    let cut = |(strip, span): &(usize, Range<f32>)| Run {
        strip: *strip,
        points: part(points(&layer.strips[*strip]), span),
    };
    Thinned { runs: spans.par_iter().map(cut).collect(), share: kept as f32 / all.max(1) as f32 }
}

/// Ranges of stations with room, each with a station somewhere that has room to begin.
fn runs(rooms: &[Room], neighbours: impl Fn(usize) -> bool) -> Vec<Range<usize>> {
    let mut runs = Vec::new();
    let mut start = 0;
    for i in 0..rooms.len() {
        if rooms[i] == Room::None {
            start = i + 1;
            continue;
        }
        let goes_on = i + 1 < rooms.len() && rooms[i + 1] != Room::None && neighbours(i);
        if !goes_on {
            if rooms[start..=i].contains(&Room::ToBegin) {
                runs.push(start..i + 1);
            }
            start = i + 1;
        }
    }
    runs
}

/// Places on one polyline at most: more are closer than any picture shows.
const MOST_STATIONS: usize = 10_000_000;

/// Places every `step_mm` along a polyline, on its segments in the frame.
fn stations(points: &[Place], step_mm: f32, in_frame: impl Fn(&Place, &Place) -> bool) -> Vec<Station> {
    let mut stations = Vec::new();
    let (mut along_mm, mut next) = (0.0_f64, 0.5_f64);
    let step_mm = f64::from(step_mm);
    for ab in points.windows(2) {
        let length = f64::from(distance2(&ab[0], &ab[1]).sqrt());
        let end = along_mm + length;
        if in_frame(&ab[0], &ab[1]) {
            while next * step_mm < end && stations.len() < MOST_STATIONS {
                let along = next * step_mm;
                let at = between(&ab[0], &ab[1], ((along - along_mm) / length) as f32);
                stations.push(Station { along_mm: along as f32, at });
                next += 1.0;
            }
        } else {
            next = next.max((end / step_mm - 0.5).ceil() + 0.5);
        }
        along_mm = end;
    }
    if stations.is_empty() && along_mm < step_mm {
        // Shorter than a step, and yet it may stand alone.
        stations.extend(
            points
                .windows(2)
                .take(1)
                .filter(|ab| in_frame(&ab[0], &ab[1]))
                .map(|ab| Station { along_mm: 0.0, at: ab[0] }),
        );
    }
    stations
}

/// The part of a polyline between two lengths along it.
fn part(points: &[Place], span: &Range<f32>) -> Vec<Place> {
    let mut part = Vec::new();
    let mut along_mm = 0.0_f64;
    let (from, to) = (f64::from(span.start), f64::from(span.end));
    for ab in points.windows(2) {
        let length = f64::from(distance2(&ab[0], &ab[1]).sqrt());
        let end = along_mm + length;
        if end >= from && along_mm <= to && length > 0.0 {
            let at = |mm: f64| between(&ab[0], &ab[1], ((mm - along_mm) / length).clamp(0.0, 1.0) as f32);
            if part.is_empty() {
                part.push(at(from));
            }
            part.push(at(to));
        }
        along_mm = end;
    }
    part
}

/// The stations of all drawn runs, to be found by place: each is entered in every cell that it may matter
/// to, so that a query looks into one.
struct DrawnStations {
    spacing_mm: f32,
    cells: Cells<Vec<Place>>,
}

impl DrawnStations {
    fn new(spacing_mm: f32) -> Self {
        DrawnStations { spacing_mm, cells: Cells::default() }
    }

    fn cell(&self, mm: f32) -> i32 {
        (mm / (CELL * self.spacing_mm)).floor() as i32
    }

    fn add(&mut self, at: Place) {
        let range = |i: usize| self.cell(at[i] - self.spacing_mm)..=self.cell(at[i] + self.spacing_mm);
        let [xs, ys, zs] = [0, 1, 2].map(range);
        for x in xs {
            for y in ys.clone() {
                for z in zs.clone() {
                    self.cells.entry([x, y, z]).or_default().push(at);
                }
            }
        }
    }

    fn rooms(&self, stations: &[Station]) -> Vec<Room> {
        // Stations in a row share a cell.
        let mut known: Option<([i32; 3], &[Place])> = None;
        let room = |s: &Station| {
            let cell = s.at.map(|mm| self.cell(mm));
            let near = match known {
                Some((of, near)) if of == cell => near,
                _ => self.cells.get(&cell).map_or(&[][..], Vec::as_slice),
            };
            known = Some((cell, near));
            self.room(&s.at, near)
        };
        stations.iter().map(room).collect()
    }

    fn room(&self, at: &Place, near: &[Place]) -> Room {
        let (begin2, go_on2) = (self.spacing_mm.powi(2), (KEPT_ABOVE * self.spacing_mm).powi(2));
        let mut nearest2 = f32::INFINITY;
        // What is in the way is most often what was drawn last.
        for place in near.iter().rev() {
            nearest2 = nearest2.min(distance2(place, at));
            if nearest2 < go_on2 {
                return Room::None;
            }
        }
        if nearest2 < begin2 { Room::ToGoOn } else { Room::ToBegin }
    }
}

fn distance2(a: &Place, b: &Place) -> f32 {
    (0..3).map(|i| (a[i] - b[i]).powi(2)).sum()
}

fn between(a: &Place, b: &Place, t: f32) -> Place {
    [0, 1, 2].map(|i| a[i] + (b[i] - a[i]) * t)
}

#[cfg(test)]
mod tests {
    use super::*;
    use claymill_nurbs::Point3;

    fn everywhere(_: &Place, _: &Place) -> bool {
        true
    }

    /// Rows along x from `x0` to `x1`, `step` apart in y, each cut into `parts` passes.
    fn rows(layer: &mut LineLayer, count: u32, step: f64, [x0, x1]: [f64; 2], parts: u32) {
        for row in 0..count {
            let y = step * f64::from(row);
            for part in 0..parts {
                let x = |k: u32| x0 + (x1 - x0) * f64::from(k) / f64::from(parts);
                let ends = [Point3::new(x(part), y, 0.0), Point3::new(x(part + 1), y, 0.0)];
                let pass = layer.strips.len() as u32;
                layer.add(ends.iter(), &Point3::origin(), [0; 3], pass);
            }
        }
    }

    fn length(run: &Run) -> f32 {
        run.points.windows(2).map(|ab| distance2(&ab[0], &ab[1]).sqrt()).sum()
    }

    #[test]
    fn every_nth_row_is_drawn_whole_however_the_rows_are_split_into_passes() {
        for parts in [1, 3, 5] {
            let mut layer = LineLayer::default();
            rows(&mut layer, 61, 2.8, [0.0, 900.0], parts);
            let thinned = evenly_spaced(&layer, 8.0, everywhere);
            // Three rows are 8.4 mm apart, two only 5.6.
            let mut drawn: Vec<f32> = thinned.runs.iter().map(|r| r.points[0][1]).collect();
            drawn.dedup();
            let expected: Vec<f32> = (0..21).map(|k| (8.4 * f64::from(k)) as f32).collect();
            assert_eq!(drawn, expected, "{parts} parts");
            let total: f32 = thinned.runs.iter().map(length).sum();
            assert!((total - 21.0 * 900.0).abs() < 1.0, "{parts} parts: {total} mm drawn");
            assert!((thinned.share - 1.0 / 3.0).abs() < 0.02, "{}", thinned.share);
        }
    }

    #[test]
    fn drawn_lines_keep_half_the_spacing_and_leave_no_gap_that_a_row_fits_in() {
        // Rows that fan out from 1 mm to 9 mm.
        let mut layer = LineLayer::default();
        for row in 0..80_u32 {
            let s = f64::from(row);
            let line: Vec<Point3> =
                (0..=100).map(f64::from).map(|t| Point3::new(5.0 * t, s * (1.0 + 0.08 * t), 0.0)).collect();
            layer.add(line.iter(), &Point3::origin(), [0; 3], row);
        }
        let spacing = 6.0;
        let thinned = evenly_spaced(&layer, spacing, everywhere);
        for k in 0..50 {
            let x = 10.0 * k as f32 + 3.0;
            let crossing = |run: &Run| {
                let at = |ab: &[Place]| {
                    let t = (x - ab[0][0]) / (ab[1][0] - ab[0][0]);
                    (0.0..1.0).contains(&t).then(|| between(&ab[0], &ab[1], t)[1])
                };
                run.points.windows(2).find_map(at)
            };
            let mut ys: Vec<f32> = thinned.runs.iter().filter_map(crossing).collect();
            ys.sort_by(f32::total_cmp);
            let row_mm = 1.0 + 0.016 * x;
            for pair in ys.windows(2) {
                let gap = pair[1] - pair[0];
                // Stations stand half a spacing apart, and rows fan out by a little.
                assert!(gap > 0.4 * spacing, "lines {gap} mm apart at {x}");
                // A wider gap would hold a row with room to begin on both sides.
                assert!(gap < 2.0 * (spacing + row_mm), "a gap of {gap} mm at {x}");
            }
        }
    }

    #[test]
    fn wide_rows_and_lonely_short_ones_are_all_drawn_and_rows_outside_the_frame_are_not() {
        let mut layer = LineLayer::default();
        rows(&mut layer, 10, 20.0, [0.0, 100.0], 1);
        rows(&mut layer, 1, 20.0, [150.0, 150.5], 1);
        let thinned = evenly_spaced(&layer, 8.0, everywhere);
        assert_eq!(thinned.runs.len(), 11);
        assert_eq!(thinned.share, 1.0);
        let framed = evenly_spaced(&layer, 8.0, |a, _| a[1] < 50.0 && a[0] < 120.0);
        assert_eq!(framed.runs.len(), 3);
    }
}
