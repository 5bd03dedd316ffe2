//! Setup sheets: a page for the machine for every tool direction.

use claymill_nurbs::Vector3;
use claymill_toolpath::{MoveKind, Setup, Stock};
use maud::{Markup, html};

use super::figures::{area, count, duration, length, plural, share};
use super::{ReportInput, SetupSheet, image, tool};

/// Extent of something along three axes, mm.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Extent {
    low: [f64; 3],
    high: [f64; 3],
}

impl Extent {
    fn of(points: impl Iterator<Item = [f64; 3]>) -> Option<Self> {
        let one = |p: [f64; 3]| Extent { low: p, high: p };
        points.map(one).reduce(|a, b| Extent {
            low: [0, 1, 2].map(|i| a.low[i].min(b.low[i])),
            high: [0, 1, 2].map(|i| a.high[i].max(b.high[i])),
        })
    }

    fn words(&self, i: usize) -> String {
        format!("{:.2} to {:.2} mm", self.low[i], self.high[i])
    }
}

/// A page for the machine for every direction.
pub(super) fn section(input: &ReportInput<'_>) -> Markup {
    html! {
        h2 id="sheets" { "Setup sheets" }
        @for (i, setup) in input.job.setups.iter().enumerate() {
            (sheet(input, setup, input.sheets.get(i)))
        }
    }
}

fn sheet(input: &ReportInput<'_>, setup: &Setup, drawn: Option<&SetupSheet>) -> Markup {
    let job = input.job;
    let rows = rows(input, setup, drawn.map(|d| d.axes));
    let tools = job.tools.iter().filter(|t| {
        t.holder.is_some() && input.program.moves.iter().any(|m| m.setup == setup.name && m.tool == t.id)
    });
    let tools = tools.map(|t| t.in_setup(&setup.name));
    html! {
        article.sheet {
            h3 { "Setup " (setup.name) }
            div.beside {
                div {
                    @if let Some(picture) = drawn.and_then(|d| d.picture.as_ref()) {
                        figure { (image(picture)) figcaption { (picture.caption) } }
                    }
                    @for tool in tools {
                        figure.held { (tool::drawing(&tool)) figcaption { (tool.id) " in its holder, mm, to scale" } }
                    }
                }
                table { tbody { @for (name, value) in &rows { tr { th scope="row" { (name) } td { (value) } } } } }
            }
        }
    }
}

/// How far the tool sticks out, and how far it has to.
fn stick_out(input: &ReportInput<'_>, setup: &Setup, above_all_mm: f64) -> String {
    let holders = input.job.tools.iter().filter_map(|t| t.in_setup(&setup.name).holder);
    let given = holders.map(|h| h.stick_out_mm).reduce(f64::min);
    let measured = input.verification.and_then(|v| v.holder.as_ref());
    match (given, measured.and_then(|h| Some((h, h.stick_out_needed_mm(Some(&setup.name))?)))) {
        (Some(given_mm), Some((holder, needed_mm))) => {
            let verdict = if needed_mm > given_mm { ", which is too little" } else { "" };
            let asked = holder.asked_mm;
            format!(
                "{given_mm} mm{verdict}: {needed_mm:.2} mm keep the holder {asked} mm away from the model here"
            )
        }
        (Some(given_mm), None) => {
            format!(
                "{given_mm} mm as given, not verified; {above_all_mm:.0} mm keep it above the whole model"
            )
        }
        (None, _) => format!(
            "no holder was given; {above_all_mm:.0} mm keep any holder above the whole model, less needs a look: the shank \
             was checked, as thick as the ball along its whole length"
        ),
    }
}

fn rows(input: &ReportInput<'_>, setup: &Setup, axes: Option<[[f64; 3]; 3]>) -> Vec<(&'static str, String)> {
    let (job, program) = (input.job, input.program);
    let mine = || program.moves.iter().filter(|m| m.setup == setup.name);
    let mut rows = Vec::new();
    let mut used: Vec<_> = job.tools.iter().filter(|t| mine().any(|m| m.tool == t.id)).collect();
    used.sort_by_key(|t| magazine_place(&t.id));
    let tools: Vec<String> = used.iter().map(|t| tool::words(&t.in_setup(&setup.name))).collect();
    rows.push((
        if tools.len() > 1 { "Tools, in the order of the magazine" } else { "Tool" },
        if tools.is_empty() { super::tool::mill(&job.request.tool) } else { tools.join("; ") },
    ));
    let axis = Vector3::from(setup.axis);
    let tips = || mine().filter(|m| m.kind != MoveKind::Rapid).flat_map(|m| m.points.iter());
    let lowest = tips().map(|p| axis.dot(&Vector3::from(*p))).fold(f64::INFINITY, f64::min);
    if lowest.is_finite() {
        let above_all_mm = (setup.clearance_mm - lowest).ceil();
        rows.push(("Stick-out", stick_out(input, setup, above_all_mm)));
    }
    for tool in job.tools.iter().filter(|t| t.holder.is_some()) {
        rows.push(("Holder, from the tool up", tool::sections(tool).join("; ")));
    }
    if let Some(axes) = axes {
        let [x, y, z] = axes.map(axis_name);
        rows.push(("Axes", format!("X is the model's {x}, Y its {y}, Z (towards the spindle) its {z}")));
        let turned = |p: [f64; 3]| axes.map(|a| Vector3::from(a).dot(&Vector3::from(p)));
        let b = job.model.box_mm;
        let corners = (0..8).map(|k| [0, 1, 2].map(|i| b[i + 3 * (k >> i & 1)]));
        if let Some(stock) = Extent::of(corners.map(turned)) {
            rows.push(("Zero point", zero_point(&stock)));
            rows.push(("Model, X", stock.words(0)));
            rows.push(("Model, Y", stock.words(1)));
            rows.push(("Model, Z", stock.words(2)));
        }
        if let Some(tips) = Extent::of(tips().map(|p| turned(*p))) {
            rows.push(("Tip while cutting, Z", tips.words(2)));
        }
        if let Some(way) = Extent::of(mine().flat_map(|m| m.points.iter()).map(|p| turned(*p))) {
            // Every section begins and ends at the clearance height.
            let way = Extent { high: [way.high[0], way.high[1], way.high[2].max(setup.clearance_mm)], ..way };
            let axis = |i: usize| format!("{} {}", ["X", "Y", "Z"][i], way.words(i));
            let travel = [0, 1, 2].map(axis).join(", ");
            rows.push(("Travel of the tip, rapids included", format!("{travel}; a retreat goes higher")));
        }
    }
    let height = match axes {
        // The machine's Z is the tool axis.
        Some(_) => format!("at Z {:.1} mm", setup.clearance_mm),
        None => format!("at {}", height_along(setup.axis, setup.clearance_mm)),
    };
    rows.push(("Rapids between regions", height));
    if let Some(stock) = &job.stock {
        rows.push(("Raw material", stock_words(stock)));
    } else if let Some(mm) = input.job.tolerances.get("clearance_mm") {
        rows.push((
            "Raw material",
            format!(
                "within {mm} mm of the finished model along the tool axis: rapids keep this from the model, stock is not known"
            ),
        ));
    }
    let r = &job.request;
    rows.push(("Feed", format!("{} mm/min cutting, {} mm/min rapid", r.feed_mm_per_min, r.rapid_mm_per_min)));
    rows.push(("Time", format!("{} of {}", duration(setup.time_s), duration(job.totals.time_s))));
    let totals: Vec<_> = job.regions.iter().filter(|t| t.setup == setup.name).collect();
    let cut_mm: f64 = totals.iter().map(|t| t.length.cut_mm).sum();
    let all_mm: f64 = totals.iter().map(|t| t.length.total_mm()).sum();
    rows.push(("Cutting length", format!("{} ({} of the way)", length(cut_mm), share(cut_mm, all_mm))));
    let (passes, retracts) =
        totals.iter().fold((0, 0), |s, t| (s.0 + u64::from(t.passes), s.1 + u64::from(t.retracts)));
    rows.push(("Passes", format!("{}, {}", count(passes), plural(retracts, "retract"))));
    let names: Vec<String> = totals.iter().map(|t| t.region.to_string()).collect();
    rows.push(("Area cut", area(setup.area_mm2)));
    rows.push(("Regions, in order", names.join(", ")));
    rows
}

/// Number of a tool in the magazine, by its id; tools without one come last.
fn magazine_place(id: &str) -> u32 {
    let digits: String = id.chars().filter(char::is_ascii_digit).take(9).collect();
    digits.parse().unwrap_or(u32::MAX)
}

/// What the model is cut from, in model coordinates.
fn stock_words(stock: &Stock) -> String {
    match stock {
        Stock::Layer { thickness_mm } => format!("a layer of {thickness_mm} mm on all faces"),
        Stock::File(file) => match file.box_mm {
            Some(box_mm) => format!("the body in {}, {}", file.path, box_words(&box_mm)),
            None => format!("the body in {}", file.path),
        },
        Stock::Block { box_mm } => format!("a block of {}", box_words(box_mm)),
        Stock::Bar { from_mm, to_mm, diameter_mm } => {
            let axis = stock.bar_axis().unwrap_or(0);
            let [y, z] = [(axis + 1) % 3, (axis + 2) % 3].map(|k| ["x", "y", "z"][k]).map(str::to_owned);
            let name = ["x", "y", "z"][axis];
            let at = [(axis + 1) % 3, (axis + 2) % 3].map(|k| from_mm[k]);
            format!(
                "a round bar of {diameter_mm} x {} mm along {name}, in the model from {name} {} to {name} {} about {y} {}, {z} {}",
                to_mm[axis] - from_mm[axis],
                from_mm[axis],
                to_mm[axis],
                at[0],
                at[1]
            )
        }
    }
}

/// The size of a box, and where it lies in the model.
fn box_words([x0, y0, z0, x1, y1, z1]: &[f64; 6]) -> String {
    format!(
        "{} x {} x {} mm, in the model from x {x0}, y {y0}, z {z0} to x {x1}, y {y1}, z {z1}",
        x1 - x0,
        y1 - y0,
        z1 - z0
    )
}

/// `+x` where the direction is an axis, else its components.
pub(super) fn axis_name(direction: [f64; 3]) -> String {
    let along = (0..3).find(|&i| direction[i].abs() > 1.0 - 1e-9);
    match along {
        Some(i) => format!("{}{}", if direction[i] > 0.0 { '+' } else { '-' }, ['x', 'y', 'z'][i]),
        None => format!("({:.4}, {:.4}, {:.4})", direction[0], direction[1], direction[2]),
    }
}

/// A height along a direction as a coordinate: `y = -12.5 mm` where the direction is an axis.
pub(super) fn height_along(direction: [f64; 3], height_mm: f64) -> String {
    match (0..3).find(|&i| direction[i].abs() > 1.0 - 1e-9) {
        Some(i) => format!("{} = {:.1} mm", ['x', 'y', 'z'][i], direction[i].signum() * height_mm + 0.0),
        None => format!("{height_mm:.1} mm along it"),
    }
}

/// Where the zero point lies, seen from a corner of the model that an operator finds: the one with the smallest X and Y, on top.
fn zero_point(model: &Extent) -> String {
    let from = [model.low[0], model.low[1], model.high[2]];
    let [x, y, z] = from.map(|c| -c + 0.0);
    format!(
        "the origin of the model's file, unless the machine definition of the post moves it; from the corner of the model's box \
         with the smallest X and Y and the largest Z it lies at X {x:+.2}, Y {y:+.2}, Z {z:+.2} mm"
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tools_have_their_places_and_stock_its_measures() {
        let mut ids = ["T12", "mill", "T3", "T7"];
        ids.sort_by_key(|id| magazine_place(id));
        assert_eq!(ids, ["T3", "T7", "T12", "mill"]);
        let block = Stock::Block { box_mm: [0.0, -10.0, 5.0, 200.0, 90.0, 45.0] };
        assert!(stock_words(&block).starts_with("a block of 200 x 100 x 40 mm"));
        assert_eq!(stock_words(&Stock::Layer { thickness_mm: 25.0 }), "a layer of 25 mm on all faces");
    }

    #[test]
    fn axes_have_names_and_slanting_ones_components() {
        assert_eq!(axis_name([0.0, -1.0, 0.0]), "-y");
        assert_eq!(height_along([0.0, -1.0, 0.0], 1733.4), "y = -1733.4 mm");
        assert_eq!(height_along([1.0, 0.0, 0.0], -0.0), "x = 0.0 mm");
        assert_eq!(axis_name([0.6, 0.0, 0.8]), "(0.6000, 0.0000, 0.8000)");
    }
}
