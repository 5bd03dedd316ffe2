//! Ways into closed passes: along a circle that touches the pass from inside and starts where nothing is left to cut, or along a
//! spiral that comes nearer to the pass from there.
//!
//! ```text
//!       pass ───────•───────►        A circle that may be run along (see `rounds`) is one way in: the tool comes out of
//!                 ╱   ╲              what it has reached, cuts deeper and deeper, and joins the pass along its tangent.
//!        way in  (  c  )  way out
//!     ~~~~~~~~~~~~\~~~/~~~~~~~~ A
//!
//!       pass ──────────────────►        Where the wall is all around, no circle that is smaller than the pass keeps to the
//!             ___..--''                 engagement. A spiral does: at a smaller depth there is room for a heading towards the
//!        A --''                         wall. What it leaves is cut at the end of the pass.
//! ```

use crate::fronts::{Ground, Lead, Pass};
use crate::outline::{Place, distance};

/// Places of a contour that are tried.
const MOST_TRIED: usize = 48;
/// Circles from as large as the tool, halved so often.
const HALVINGS: usize = 7;
/// A circle may stick out of what is reached by this, mm: chords do.
const SLACK_MM: f64 = 3e-3;
/// Steps along a circle, of which it takes this many to go around.
const STEPS: usize = 72;
/// The way out, in steps.
const STEPS_OUT: usize = 6;

/// Starts of spirals that are tried: those that are nearest to where the tool may come from, and those nearest to what was reached.
const SPIRALS_TRIED: usize = 12;
/// Steps along a spiral, in radii of the tool.
const SPIRAL_STEP: f64 = 0.05;
/// A spiral may cut at the limit less this, degrees.
const SPIRAL_RESERVE_DEG: f64 = 0.3;
/// Steepest and flattest heading of a spiral towards the wall, degrees.
const SPIRAL_HEADINGS_DEG: [f64; 2] = [0.4, 20.0];
/// Where the engagement along a step is looked at.
const SHARES_OF_STEP: [f64; 4] = [0.0, 1.0 / 3.0, 2.0 / 3.0, 1.0];
/// Headings that are tried, each half as steep.
const GENTLER: i32 = 5;
/// The least cosine between the headings of a spiral and of the contour beside it.
const LEAST_AHEAD: f64 = 0.9;
/// Contours that are this near to what was reached are entered by a step, mm.
const LARGEST_STEP_MM: f64 = 0.05;
/// A spiral starts this far inside of what was reached, mm.
const INSIDE_MM: f64 = 2e-3;

/// A whole contour, from where it is entered best; without a way in if none fits.
pub(crate) fn entered(contour: &[Place], ground: &Ground<'_>) -> Pass {
    let n = contour.len();
    let stride = n.div_ceil(MOST_TRIED);
    let radius_mm = ground.limit.radius_mm();
    let radii = (0..HALVINGS).map(|halving| radius_mm * 0.5_f64.powi(halving as i32));
    let mut places: Vec<usize> = (0..n).step_by(stride).collect();
    places.sort_by(|a, b| ground.gap_to_ends_mm(contour[*a]).total_cmp(&ground.gap_to_ends_mm(contour[*b])));
    let tried = radii.flat_map(|r| places.iter().map(move |k| (r, *k)));
    let circle = tried.filter_map(|(r, k)| Some((k, circle(contour, k, r, ground)?))).next();
    let from = |start: usize| {
        let ring = contour[start..].iter().chain(&contour[..=start]);
        ring.copied().collect()
    };
    match circle {
        Some((k, lead)) => Pass { points: from(k), lead: Some(lead) },
        None => spiral(contour, ground).unwrap_or_else(|| Pass { points: from(0), lead: None }),
    }
}

/// A place on a contour.
struct Station {
    /// The vertex before it.
    vertex: usize,
    on: Place,
    tangent: Place,
}

/// Places along a contour in even steps. Tangents are those of chords over a few of them: vertices of borders are noisy.
fn stations(contour: &[Place], step_mm: f64) -> Vec<Station> {
    let n = contour.len();
    let length_mm: f64 = (0..n).map(|k| distance(contour[k], contour[(k + 1) % n])).sum();
    let count = (length_mm / step_mm).ceil().max(8.0);
    let mut places = Vec::new();
    let (mut vertex, mut before_mm) = (0, 0.0);
    for j in 0..count as usize {
        let run_mm = length_mm * j as f64 / count;
        let mut of_segment_mm = distance(contour[vertex], contour[(vertex + 1) % n]);
        while before_mm + of_segment_mm < run_mm && vertex + 1 < n {
            before_mm += of_segment_mm;
            vertex += 1;
            of_segment_mm = distance(contour[vertex], contour[(vertex + 1) % n]);
        }
        let share = ((run_mm - before_mm) / of_segment_mm.max(f64::MIN_POSITIVE)).min(1.0);
        let (from, to) = (contour[vertex], contour[(vertex + 1) % n]);
        places.push((vertex, [0, 1].map(|i| from[i] + share * (to[i] - from[i]))));
    }
    let m = places.len();
    let tangent = |j: usize| unit(places[(j + m - 2) % m].1, places[(j + 2) % m].1).unwrap_or([0.0, 0.0]);
    (0..m).map(|j| Station { vertex: places[j].0, on: places[j].1, tangent: tangent(j) }).collect()
}

/// A spiral into a contour.
fn spiral(contour: &[Place], ground: &Ground<'_>) -> Option<Pass> {
    let radius_mm = ground.limit.radius_mm();
    let stations = stations(contour, SPIRAL_STEP * radius_mm);
    let stride = stations.len().div_ceil(MOST_TRIED);
    let starts = (0..stations.len()).step_by(stride);
    let starts = starts.map(|k| (ground.reached.distance(stations[k].on, radius_mm), k));
    let starts: Vec<(f64, usize)> = starts.filter(|(away_mm, _)| *away_mm < radius_mm).collect();
    let first_by = |cost: &dyn Fn(&(f64, usize)) -> f64| {
        let mut sorted = starts.clone();
        sorted.sort_unstable_by(|a, b| cost(a).total_cmp(&cost(b)).then(a.1.cmp(&b.1)));
        sorted.into_iter().take(SPIRALS_TRIED)
    };
    let handy = first_by(&|(_, k)| ground.gap_to_ends_mm(stations[*k].on));
    let near = first_by(&|(away_mm, _)| *away_mm);
    let found = handy.chain(near.clone()).find_map(|start| spiral_from(&stations, start, ground));
    let found = found.or_else(|| near.into_iter().find_map(|start| step(&stations, start, ground)));
    let (end, points) = found?;
    // All around: at its end the pass cuts what the spiral left.
    let Station { vertex, on, .. } = stations[end];
    let lap = contour[vertex + 1..].iter().chain(&contour[..=vertex]).copied();
    let points_of_pass = std::iter::once(on).chain(lap).chain([on]).collect();
    Some(Pass { points: points_of_pass, lead: Some(Lead::Spiral(points)) })
}

/// A step over from what was reached, which was parted from the contour by next to nothing.
fn step(
    stations: &[Station],
    (away_mm, k): (f64, usize),
    ground: &Ground<'_>,
) -> Option<(usize, Vec<Place>)> {
    if away_mm > LARGEST_STEP_MM {
        return None;
    }
    let on = stations[k].on;
    let around = (0..STEPS).map(|j| (std::f64::consts::TAU * j as f64 / STEPS as f64).sin_cos());
    let from = around.map(|(sine, cosine)| [cosine, sine].map(|c| c * (away_mm + 2.0 * INSIDE_MM)));
    let mut from = from.map(|d| [on[0] + d[0], on[1] + d[1]]);
    let from = from.find(|p| ground.is_reached(*p))?;
    let engaged_rad = ground.uncut.front_inside(on, ground.limit.radius_mm(), unit(from, on)?);
    (engaged_rad <= ground.limit.limit_deg().to_radians()).then(|| (k, vec![from, on]))
}

/// The spiral that starts beside a station, which is so far from what was reached: the station at which it ends, and its points.
fn spiral_from(
    stations: &[Station],
    (away_mm, first): (f64, usize),
    ground: &Ground<'_>,
) -> Option<(usize, Vec<Place>)> {
    let radius_mm = ground.limit.radius_mm();
    let most_rad = (ground.limit.limit_deg() - SPIRAL_RESERVE_DEG).to_radians();
    let [flattest_rad, steepest_rad] = SPIRAL_HEADINGS_DEG.map(f64::to_radians);
    let beside = |k: usize, gap_mm: f64| {
        let Station { on, tangent, .. } = &stations[k];
        [on[0] - gap_mm * tangent[1], on[1] + gap_mm * tangent[0]]
    };
    let mut gap_mm = away_mm + INSIDE_MM;
    let mut points = vec![beside(first, gap_mm)];
    if !ground.is_reached(points[0]) {
        return None;
    }
    for k in (first..first + stations.len() - 1).map(|k| k % stations.len()) {
        let to = (k + 1) % stations.len();
        let last = *points.last()?;
        let step_mm = distance(stations[k].on, stations[to].on);
        let straight_rad = ground.uncut.front_inside(last, radius_mm, stations[k].tangent);
        let tilt_rad = (most_rad - straight_rad).clamp(flattest_rad, steepest_rad);
        // Deeper, it cuts at more: the next heading is as steep as that allows.
        let gentler = (0..GENTLER).map(|halvings| tilt_rad * 0.5_f64.powi(halvings));
        let next = gentler.map(|tilt| (gap_mm - step_mm * tilt.tan()).max(0.0)).find(|next_mm| {
            let at = beside(to, *next_mm);
            let Some(heading) = unit(last, at) else { return false };
            let [tx, ty] = stations[to].tangent;
            // Neither back nor aside where the contour turns sharply.
            heading[0] * tx + heading[1] * ty > LEAST_AHEAD
                && (*next_mm == 0.0 || ground.next.contains(at))
                && SHARES_OF_STEP.iter().all(|share| {
                    let on_the_way = [0, 1].map(|i| last[i] + share * (at[i] - last[i]));
                    ground.uncut.front_inside(on_the_way, radius_mm, heading) <= most_rad
                })
        });
        gap_mm = next?;
        points.push(beside(to, gap_mm));
        if gap_mm == 0.0 {
            return Some((to, points));
        }
    }
    None
}

/// The direction from a place to another.
fn unit(a: Place, b: Place) -> Option<Place> {
    let length_mm = distance(a, b);
    (length_mm > 0.0).then(|| [(b[0] - a[0]) / length_mm, (b[1] - a[1]) / length_mm])
}

/// The circle of a radius that touches a contour at a vertex from its left.
fn circle(contour: &[Place], k: usize, r: f64, ground: &Ground<'_>) -> Option<Lead> {
    let n = contour.len();
    let p = contour[k];
    let (before, after) = (contour[(k + n - 1) % n], contour[(k + 1) % n]);
    let ([ux, uy], [vx, vy]) = (unit(before, p)?, unit(p, after)?);
    let tangent = unit([0.0, 0.0], [ux + vx, uy + vy])?;
    let centre = [p[0] - r * tangent[1], p[1] + r * tangent[0]];
    let clear_mm = ground.limit.cleared_radius_mm(r);
    let fits = ground.next.contains(centre)
        && ground.next.distance(centre, r) >= r - SLACK_MM
        && ground.uncut.distance(centre, clear_mm) >= clear_mm
        && !ground.uncut.contains(centre);
    if !fits {
        return None;
    }
    let at = |steps: f64| {
        let (sine, cosine) = (std::f64::consts::TAU * steps / STEPS as f64).sin_cos();
        let d = [p[0] - centre[0], p[1] - centre[1]];
        [centre[0] + cosine * d[0] - sine * d[1], centre[1] + sine * d[0] + cosine * d[1]]
    };
    let steps = (STEPS / 8..STEPS * 3 / 4).find(|&s| ground.is_reached(at(-(s as f64))))?;
    Some(Lead::Circle { centre, from: at(-(steps as f64)), to: at(STEPS_OUT as f64) })
}
