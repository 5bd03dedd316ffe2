//! Tool paths as coloured polylines: flattened within a chord error, drawn where the ball touches
//! the surface, coloured by region, setup, kind, pass or feed.

use std::collections::BTreeMap;

use claymill_nurbs::{Curve3, Point3, Vector3};
use claymill_toolpath::{Move, MoveKind, Program, ToolRecord};
use rayon::prelude::*;

use crate::legend::{LegendEntry, Mark};
use crate::palette::{Rgb, stroke_shade};
use crate::scene::Scene;
use crate::shapes::{LineKind, LineLayer};
use crate::touch::TriangleTree;

/// What decides the colour of tool paths.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum ColourBy {
    /// Cuts take a dark shade of their region's colour, where [`StrokeStyle::region_colours`] has one; all else its kind's.
    #[default]
    Region,
    /// Every setup has its colour: where one ends and the next goes on.
    Setup,
    /// Every kind of move has its colour.
    Kind,
    /// From the first pass of a region to its last.
    Pass,
    /// From the slowest feed to the fastest.
    Feed,
}

/// How tool paths are drawn.
#[derive(Debug, Clone, Copy)]
pub struct StrokeStyle<'a> {
    /// Largest distance of a drawn line from its curve, mm. A third of a pixel is enough.
    pub chord_mm: f64,
    /// Cuts take a dark shade of their region's colour (by region id); `None`: one colour for all.
    pub region_colours: Option<&'a [Rgb]>,
    /// What decides their colour.
    pub by: ColourBy,
    /// Whether rapids are drawn.
    pub rapids: bool,
    /// The job's tools. Moves hold the tip, which lies inside the surface on every slope (at 45 degrees by
    /// 0.3 radii). Moves of these tools are drawn where the ball touches the scene's surfaces; those of other
    /// tools, and all in a scene without surfaces, at the tip.
    pub tools: &'a [ToolRecord],
}

impl StrokeStyle<'_> {
    /// A plain style with this chord tolerance.
    #[must_use]
    pub fn new(chord_mm: f64) -> Self {
        StrokeStyle { chord_mm, region_colours: None, by: ColourBy::Region, rapids: true, tools: &[] }
    }
}

/// Colour of each kind of move: the Okabe-Ito set, which colour-blind eyes tell apart.
#[must_use]
pub fn kind_colour(kind: MoveKind) -> Rgb {
    match kind {
        MoveKind::Cut => [0, 84, 148],
        MoveKind::LeadIn | MoveKind::LeadOut => [0, 158, 115],
        MoveKind::Link => [230, 140, 0],
        MoveKind::Rapid => [205, 62, 0],
    }
}

/// Colours of setups, of the Okabe-Ito set.
const SETUP_COLOURS: [Rgb; 6] =
    [[0, 114, 178], [230, 159, 0], [0, 158, 115], [204, 121, 167], [86, 180, 233], [213, 94, 0]];

/// Points along `curve` such that no chord is farther than `chord_mm` from it (within each knot span:
/// distance ≤ h²·max|C″|/8). Straight curves give their control points.
#[must_use]
pub fn flatten(curve: &Curve3, chord_mm: f64) -> Vec<Point3> {
    if curve.knots().degree() == 1 && curve.weights().is_none() {
        return curve.points().to_vec();
    }
    let (start, end) = curve.domain();
    let mut knots: Vec<f64> = curve.knots().as_slice().to_vec();
    knots.retain(|k| (start..=end).contains(k));
    knots.dedup();
    let mut points = vec![curve.start()];
    for span in knots.windows(2) {
        let h = span[1] - span[0];
        // Just inside, so that the second derivative is this span's; for cubics it is largest at an end.
        let bend = [1e-9, 0.25, 0.5, 0.75, 1.0 - 1e-9]
            .map(|s| curve.derivatives(span[0] + s * h)[2].norm())
            .into_iter()
            .fold(0.0, f64::max);
        let pieces = (h * (bend / (8.0 * chord_mm)).sqrt()).ceil().clamp(1.0, 1e4) as u32;
        points.extend((1..=pieces).map(|i| curve.point(span[0] + h * f64::from(i) / f64::from(pieces))));
    }
    points
}

/// The layer that a move is drawn in.
fn layer_of(kind: MoveKind) -> LineKind {
    match kind {
        MoveKind::Rapid => LineKind::Rapid,
        MoveKind::LeadIn | MoveKind::LeadOut => LineKind::Lead,
        MoveKind::Link => LineKind::Link,
        MoveKind::Cut => LineKind::Cut,
    }
}

/// A contact that moves by more than this, in ball radii, and by more than twice what the tip moves, jumps.
const JUMP_RADII: f64 = 0.3;

/// Each move as the polylines that are drawn for it over the surfaces of `scene`: several where the contact jumps.
/// `None`: it is no curve.
#[must_use]
pub fn drawn_moves(
    scene: &Scene,
    program: &Program,
    style: &StrokeStyle<'_>,
) -> Vec<Option<Vec<Vec<Point3>>>> {
    let chord_mm = if style.chord_mm > 0.0 { style.chord_mm } else { 1e-3 };
    let surfaces = TriangleTree::new(if style.tools.is_empty() { &[] } else { &scene.surfaces });
    let draw =
        |m: &Move| m.curve().ok().map(|curve| drawn_points(m, &curve, chord_mm, scene, style, &surfaces));
    program.moves.par_iter().map(draw).collect()
}

impl Scene {
    /// Adds the tool paths, one layer a kind: rapids below, then leads, links and cuts.
    ///
    /// Moves that are not curves are left out; their number is returned.
    pub fn add_paths(&mut self, program: &Program, style: &StrokeStyle<'_>) -> usize {
        add_paths(self, program, style)
    }
}

fn add_paths(scene: &mut Scene, program: &Program, style: &StrokeStyle<'_>) -> usize {
    let flat = drawn_moves(scene, program, style);
    let pass_numbers = consecutive_passes(&program.moves);
    let colours = PathColours::new(program, style);
    let seen = |kind: LineKind| {
        program.moves.iter().zip(&flat).any(|(m, parts)| layer_of(m.kind) == kind && parts.is_some())
    };

    for (layer, width_px, name) in [
        (LineKind::Rapid, 1.0, "rapid"),
        (LineKind::Link, 1.4, "link"),
        (LineKind::Lead, 1.4, "lead in and out"),
        (LineKind::Cut, 1.5, "cut"),
    ] {
        if layer == LineKind::Rapid && !style.rapids {
            continue;
        }
        let mut lines = LineLayer {
            kind: layer,
            width_px,
            opacity: if layer == LineKind::Rapid { 0.75 } else { 1.0 },
            thinned: matches!(layer, LineKind::Cut | LineKind::Link),
            ..LineLayer::default()
        };
        let mut colour = kind_colour(MoveKind::Cut);
        for ((m, parts), &pass) in program.moves.iter().zip(&flat).zip(&pass_numbers) {
            let Some(parts) = parts.as_ref().filter(|_| layer_of(m.kind) == layer) else {
                continue;
            };
            colour = colours.of(m);
            for points in parts {
                lines.add(points.iter(), &scene.origin, colour, pass);
            }
        }
        if lines.strips.is_empty() {
            continue;
        }
        let own =
            matches!(style.by, ColourBy::Kind) || layer != LineKind::Cut && style.by == ColourBy::Region;
        let mut name = name.to_owned();
        let mut shades = lines.strips.iter().map(|s| s.colour);
        let first = shades.next().unwrap_or(colour);
        if layer == LineKind::Cut && style.by == ColourBy::Region && shades.any(|c| c != first) {
            name += ", in a darker shade of its region";
        }
        if own || style.by == ColourBy::Region {
            scene.legend.push(LegendEntry { mark: Mark::Line(width_px.max(1.5)), colour: first, text: name });
        }
        scene.lines.push(lines);
    }
    if [LineKind::Rapid, LineKind::Link, LineKind::Lead, LineKind::Cut].into_iter().any(seen) {
        scene.legend.extend(colours.legend());
    }
    flat.iter().filter(|f| f.is_none()).count()
}

/// Dark blue to yellow, light growing all the way, so that the order shows without colours too.
const SCALE: [Rgb; 5] = [[48, 18, 98], [58, 82, 139], [33, 145, 140], [94, 201, 98], [250, 218, 36]];

/// Colour at `share` of the scale, 0 to 1.
fn scale_colour(share: f64) -> Rgb {
    let at = share.clamp(0.0, 1.0) * (SCALE.len() - 1) as f64;
    let k = (at as usize).min(SCALE.len() - 2);
    let x = at - k as f64;
    [0, 1, 2].map(|c| (f64::from(SCALE[k][c]) * (1.0 - x) + f64::from(SCALE[k + 1][c]) * x).round() as u8)
}

/// The colours of a program's moves.
pub(crate) struct PathColours<'a> {
    style: StrokeStyle<'a>,
    /// Feeds that occur, mm/min, ascending.
    feeds: Vec<f64>,
    /// Lowest and highest pass number of each setup and region.
    passes: BTreeMap<(&'a str, usize), [u32; 2]>,
    /// In the order of the program.
    setups: Vec<&'a str>,
}

impl<'a> PathColours<'a> {
    pub(crate) fn new(program: &'a Program, style: &StrokeStyle<'a>) -> Self {
        let mut feeds: Vec<f64> = program.moves.iter().map(|m| m.feed).collect();
        feeds.sort_by(f64::total_cmp);
        feeds.dedup();
        let mut passes: BTreeMap<(&str, usize), [u32; 2]> = BTreeMap::new();
        let mut setups: Vec<&str> = Vec::new();
        for m in &program.moves {
            if !setups.contains(&m.setup.as_str()) {
                setups.push(&m.setup);
            }
            let range = passes.entry((m.setup.as_str(), m.region)).or_insert([m.pass; 2]);
            *range = [range[0].min(m.pass), range[1].max(m.pass)];
        }
        PathColours { style: *style, feeds, passes, setups }
    }

    pub(crate) fn of(&self, m: &Move) -> Rgb {
        match self.style.by {
            ColourBy::Kind => kind_colour(m.kind),
            ColourBy::Setup => {
                let number = self.setups.iter().position(|setup| *setup == m.setup).unwrap_or(0);
                SETUP_COLOURS[number % SETUP_COLOURS.len()]
            }
            ColourBy::Region => {
                let of_region = self.style.region_colours.and_then(|colours| colours.get(m.region));
                match of_region {
                    Some(&colour) if m.kind == MoveKind::Cut => stroke_shade(colour),
                    _ => kind_colour(m.kind),
                }
            }
            ColourBy::Feed => {
                let below = self.feeds.partition_point(|f| *f < m.feed);
                scale_colour(below as f64 / self.feeds.len().saturating_sub(1).max(1) as f64)
            }
            ColourBy::Pass => {
                let range = self.passes.get(&(m.setup.as_str(), m.region)).copied();
                let [first, last] = range.unwrap_or([m.pass; 2]);
                scale_colour(f64::from(m.pass - first) / f64::from((last - first).max(1)))
            }
        }
    }

    fn legend(&self) -> Vec<LegendEntry> {
        const WIDTH_PX: f32 = 3.0;
        let entry = |share: f64, text: String| LegendEntry {
            mark: Mark::Line(WIDTH_PX),
            colour: scale_colour(share),
            text,
        };
        match self.style.by {
            ColourBy::Region | ColourBy::Kind => Vec::new(),
            ColourBy::Setup => {
                let numbered = self.setups.iter().zip(SETUP_COLOURS.iter().cycle());
                let named = |(setup, colour): (&&str, &Rgb)| LegendEntry {
                    mark: Mark::Line(WIDTH_PX),
                    colour: *colour,
                    text: (*setup).to_owned(),
                };
                numbered.map(named).collect()
            }
            ColourBy::Pass => [(0.0, "first pass of its region"), (0.5, "in the middle"), (1.0, "last pass")]
                .map(|(share, text)| entry(share, text.to_owned()))
                .into(),
            ColourBy::Feed => {
                let last = self.feeds.len().saturating_sub(1).max(1);
                // All feeds of a plan; of a post's program some in between.
                let step = last.div_ceil(8);
                let named = (0..self.feeds.len()).filter(|k| k % step == 0 || *k == last);
                named.map(|k| entry(k as f64 / last as f64, format!("{} mm/min", self.feeds[k]))).collect()
            }
        }
    }
}

/// A number for each move that changes wherever the pass does: passes are counted anew in every region.
pub(crate) fn consecutive_passes(moves: &[Move]) -> Vec<u32> {
    let pass = |m: &Move| (m.region, m.pass);
    let mut number = 0;
    let numbered = moves.iter().enumerate().map(|(i, m)| {
        let before = i.checked_sub(1).map(|b| &moves[b]);
        number += u32::from(before.is_some_and(|b| pass(b) != pass(m) || b.setup != m.setup));
        number
    });
    numbered.collect()
}

fn drawn_points(
    m: &Move,
    curve: &Curve3,
    chord_mm: f64,
    scene: &Scene,
    style: &StrokeStyle<'_>,
    surfaces: &TriangleTree,
) -> Vec<Vec<Point3>> {
    let points = flatten(curve, chord_mm);
    // Rapids are far from what they could touch.
    let tool = style.tools.iter().find(|t| t.id == m.tool && m.kind != MoveKind::Rapid);
    let Some(radius_mm) = tool.map(|t| t.tool.radius_mm()) else {
        return vec![points];
    };
    let last = points.len().saturating_sub(1).max(1) as f64;
    let (start, end) = (Vector3::from(m.axis_start), Vector3::from(m.axis_end));
    let mut parts: Vec<Vec<Point3>> = vec![Vec::new()];
    for (i, tip) in points.iter().enumerate() {
        let axis = start.lerp(&end, i as f64 / last).try_normalize(0.0).unwrap_or(start);
        let drawn = surfaces.touched(&(tip - scene.origin.coords), &axis, radius_mm) + scene.origin.coords;
        // In a corner the contact jumps from one wall to the other: nothing is cut in between.
        let step = |parts: &[Vec<Point3>]| Some((drawn - parts.last()?.last()?).norm());
        let moved_mm = i.checked_sub(1).map_or(0.0, |before| (tip - points[before]).norm());
        if step(&parts).is_some_and(|mm| mm > 2.0 * moved_mm + JUMP_RADII * radius_mm) {
            parts.push(Vec::new());
        }
        if let Some(part) = parts.last_mut() {
            part.push(drawn);
        }
    }
    parts
}

#[cfg(test)]
mod tests {
    use super::*;
    use claymill_nurbs::KnotVector;

    #[test]
    fn a_flattened_arc_keeps_the_chord_tolerance_and_wastes_little() {
        let s = std::f64::consts::FRAC_1_SQRT_2;
        let p = |x: f64, y: f64| Point3::new(x, y, 0.0);
        let arc = Curve3::new(
            KnotVector::clamped_uniform(2, 3),
            vec![p(50.0, 0.0), p(50.0, 50.0), p(0.0, 50.0)],
            Some(vec![1.0, s, 1.0]),
        )
        .unwrap();
        let points = flatten(&arc, 0.01);
        let sagitta = |ab: &[Point3]| 50.0 - nalgebra::center(&ab[0], &ab[1]).coords.norm();
        let worst = points.windows(2).map(sagitta).fold(0.0, f64::max);
        assert!(worst <= 0.01, "{worst}");
        // The fewest chords of an arc with this sagitta: angle / (2·acos(1 − s/R)).
        let fewest = std::f64::consts::FRAC_PI_2 / (2.0 * (1.0 - 0.01 / 50.0_f64).acos());
        assert!((points.len() as f64) < 2.0 * fewest + 2.0, "{} points, {fewest} needed", points.len());
    }

    #[test]
    fn passes_of_different_regions_and_setups_are_not_taken_for_one() {
        let cut = |setup: &str, region: usize, pass: u32| Move {
            setup: setup.to_owned(),
            region,
            pass,
            ..Move::straight(
                MoveKind::Cut,
                Point3::origin(),
                Point3::new(1.0, 0.0, 0.0),
                Vector3::z(),
                6000.0,
            )
        };
        let moves = [cut("A", 0, 1), cut("A", 0, 1), cut("A", 0, 2), cut("A", 1, 2), cut("B", 1, 2)];
        assert_eq!(consecutive_passes(&moves), [0, 0, 1, 2, 3]);
    }
}
