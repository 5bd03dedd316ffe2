//! Pockets cleared by claymill, or as another planner would, judged alike.
//!
//! ```text
//! pockets clear LIMIT_DEG       clears ten pockets; one JSON object a line, with their contours and figures
//! pockets judge < FILE          judges ways that others found: lines {"name", "contours", "strokes": [{"over", "points"}]}
//! ```

mod figures;
mod shapes;

use std::io::BufRead;

use claymill_clearing::{Approach, Area, EngagementLimit, Entry, PathPiece, PlanarSet, Stroke, clear};
use serde_json::{Value, json};

use figures::{RADIUS_MM, figures};

type Failure = Box<dyn std::error::Error>;

fn main() -> Result<(), Failure> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    match arguments.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        ["clear", limit_deg] => all_cleared(limit_deg.parse()?),
        ["judge"] => std::io::stdin().lock().lines().try_for_each(|line| judged(&line?)),
        _ => Err("say 'clear LIMIT_DEG' or 'judge'".into()),
    }
}

/// Clears the pockets and writes what came of it.
fn all_cleared(limit_deg: f64) -> Result<(), Failure> {
    let generated = (1..=5).map(|seed| (format!("generated {seed}"), shapes::generated(seed)));
    for (name, pocket) in shapes::plain().into_iter().chain(generated) {
        let feasible = pocket.eroded(RADIUS_MM);
        let limit = EngagementLimit::new(RADIUS_MM, limit_deg)?;
        let began = std::time::Instant::now();
        // What is beyond the walls is never cut: the pocket itself is all the stock that counts.
        let area = Area { feasible: &feasible, stock: &pocket, limit, entry: Entry::usual(RADIUS_MM) };
        let cleared = clear(&area, &())?;
        let seconds = began.elapsed().as_secs_f64();
        let found = figures(&pocket, &cleared.strokes)?;
        let contours = pocket.contours();
        println!(
            "{}",
            json!({ "name": name, "contours": contours, "tool_mm": 2.0 * RADIUS_MM,
                "step_mm": limit.straight_step_mm(), "plan_s": seconds, "figures": found })
        );
    }
    Ok(())
}

/// Judges the way through one pocket.
fn judged(line: &str) -> Result<(), Failure> {
    let value: Value = serde_json::from_str(line)?;
    let contours: Vec<Vec<[f64; 2]>> = serde_json::from_value(value["contours"].clone())?;
    let pocket = PlanarSet::of_polygons(&contours);
    let mut strokes = Vec::new();
    for stroke in value["strokes"].as_array().ok_or("no strokes")? {
        strokes.push(stroke_of(stroke)?);
    }
    println!("{}", json!({ "name": value["name"], "figures": figures(&pocket, &strokes)? }));
    Ok(())
}

fn stroke_of(value: &Value) -> Result<Stroke, Failure> {
    if let Some(helix) = value.get("helix") {
        let (centre, radius_mm): ([f64; 2], f64) = serde_json::from_value(helix.clone())?;
        let cut = PathPiece::circle(centre, radius_mm).to_vec();
        let approach = Approach::Helix { centre, radius_mm };
        return Ok(Stroke { approach, via: Vec::new(), lead_in: Vec::new(), cut, lead_out: Vec::new() });
    }
    let points: Vec<[f64; 2]> = serde_json::from_value(value["points"].clone())?;
    let approach = if value["over"] == true { Approach::Over } else { Approach::Along };
    let cut = points.windows(2).filter(|w| w[0] != w[1]).map(|w| PathPiece::line(w[0], w[1])).collect();
    Ok(Stroke { approach, via: Vec::new(), lead_in: Vec::new(), cut, lead_out: Vec::new() })
}
