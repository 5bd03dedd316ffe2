//! Figures of a way through a pocket: times, engagement, what is left.

use std::collections::BTreeMap;

use claymill_clearing::{LevelFeeds, PathPiece, PlanarSet, Stroke, level_moves};
use claymill_contact::Frame;
use claymill_nurbs::Point3;
use claymill_toolpath::{Move, MoveKind, ToolRecord};
use claymill_verify::stock::{InitialStock, level_engagement};
use serde_json::{Value, json};

use crate::Failure;

/// Radius of the tool, a flat end, mm.
pub(crate) const RADIUS_MM: f64 = 3.0;
/// Heights of the level, of what was cut before, and of rapids, mm.
const HEIGHTS_MM: [f64; 3] = [-6.0, 0.0, 5.0];
/// Cells in which it is counted what is left, mm.
const CELL_MM: f64 = 0.05;
/// Ways are followed in steps of this, mm.
const STEP_MM: f64 = 0.02;
/// The stock goes this far beyond the pocket, mm.
const BEYOND_MM: f64 = 20.0;
/// Feeds of both planners, mm/min, and slope of helices.
const FEEDS: LevelFeeds =
    LevelFeeds { cut_mm_per_min: 1000.0, lead_mm_per_min: 500.0, rapid_mm_per_min: 10_000.0, ramp_deg: 3.0 };

/// All figures of a way through a pocket that is cut from a block.
pub(crate) fn figures(pocket: &PlanarSet, strokes: &[Stroke]) -> Result<Value, Failure> {
    let five = Frame::five("+z".parse()?, "+x".parse()?)?;
    let moves = level_moves(strokes, HEIGHTS_MM, &five[0], FEEDS)?;
    let moves: Vec<Move> = moves.into_iter().map(|m| Move { tool: "T1".into(), ..m }).collect();
    let tool = ToolRecord {
        id: "T1".into(),
        tool: format!("flat:{RADIUS_MM}").parse()?,
        holder: None,
        setup_stick_out_mm: BTreeMap::new(),
    };
    let [x0, y0, x1, y1] = pocket.bounds().ok_or("an empty pocket")?;
    let block = InitialStock::block(
        Point3::new(x0 - BEYOND_MM, y0 - BEYOND_MM, -20.0),
        Point3::new(x1 + BEYOND_MM, y1 + BEYOND_MM, 0.0),
    )?;
    let found = level_engagement(&block, &moves, &[tool], &|_| true, &|| true)?;
    let mut length_mm: BTreeMap<MoveKind, f64> = BTreeMap::new();
    let mut minutes = 0.0;
    for moved in &moves {
        let mm = moved.length_mm();
        *length_mm.entry(moved.kind).or_default() += mm;
        minutes += mm / moved.feed;
    }
    let retracts = moves.windows(2).filter(|w| w[0].kind != MoveKind::Rapid && w[1].kind == MoveKind::Rapid);
    let (left_mm2, reachable_mm2) = left(pocket, strokes);
    Ok(json!({
        "minutes": minutes,
        "length_mm": length_mm,
        "retracts": retracts.count(),
        "engagement_deg": found.largest.map(|pose| pose.angle_deg),
        "histogram_mm": found.histogram_mm,
        "left_mm2": left_mm2,
        "reachable_mm2": reachable_mm2,
    }))
}

/// Area of cells that the tool reaches in a pocket and that no stroke cuts, and of all that it reaches, mm².
fn left(pocket: &PlanarSet, strokes: &[Stroke]) -> (f64, f64) {
    let Some([x0, y0, x1, y1]) = pocket.bounds() else { return (0.0, 0.0) };
    let columns = ((x1 - x0) / CELL_MM).ceil() as usize;
    let rows = ((y1 - y0) / CELL_MM).ceil() as usize;
    let row = |k: usize| y0 + (k as f64 + 0.5) * CELL_MM;
    let column = |x: f64| (((x - x0) / CELL_MM - 0.5).ceil().max(0.0) as usize).min(columns);
    let mut cells = vec![0_u8; columns * rows];
    // Cells whose middles the tool reaches.
    let contours = pocket.eroded(RADIUS_MM).dilated(RADIUS_MM).contours();
    for k in 0..rows {
        let crossings = contours.iter().flat_map(|c| c.iter().zip(c.iter().cycle().skip(1)));
        let crossings = crossings.filter(|(a, b)| (a[1] <= row(k)) != (b[1] <= row(k)));
        let at = |(a, b): (&[f64; 2], &[f64; 2])| a[0] + (row(k) - a[1]) / (b[1] - a[1]) * (b[0] - a[0]);
        let mut crossings: Vec<f64> = crossings.map(at).collect();
        crossings.sort_by(f64::total_cmp);
        for pair in crossings.chunks_exact(2) {
            cells[k * columns + column(pair[0])..k * columns + column(pair[1])].fill(1);
        }
    }
    let reachable = cells.iter().filter(|cell| **cell == 1).count();
    for piece in strokes.iter().flat_map(|s| s.lead_in.iter().chain(&s.cut).chain(&s.lead_out)) {
        let steps = (piece.length_mm() / STEP_MM).ceil().max(1.0) as usize;
        for step in 0..=steps {
            cut(&mut cells, piece, step as f64 / steps as f64, columns, &row, &column);
        }
    }
    let left = cells.iter().filter(|cell| **cell == 1).count();
    (left as f64 * CELL_MM * CELL_MM, reachable as f64 * CELL_MM * CELL_MM)
}

/// Cuts the cells below the tool at a share of a piece.
fn cut(
    cells: &mut [u8],
    piece: &PathPiece,
    share: f64,
    columns: usize,
    row: &dyn Fn(usize) -> f64,
    column: &dyn Fn(f64) -> usize,
) {
    let [x, y] = piece.at(share);
    for k in 0..cells.len() / columns {
        let half2 = RADIUS_MM.powi(2) - (row(k) - y).powi(2);
        if half2 > 0.0 {
            let half = half2.sqrt();
            cells[k * columns + column(x - half)..k * columns + column(x + half)].fill(0);
        }
    }
}
