//! Instances of a Part 21 file being written.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use claymill_nurbs::{NurbsCurve, NurbsSurface, Point3, Vector3};

/// The data section so far.
#[derive(Debug, Default)]
pub(super) struct Script {
    text: String,
    last: u64,
    styles: BTreeMap<[u8; 3], u64>,
}

impl Script {
    pub(super) fn text(&self) -> &str {
        &self.text
    }

    /// Adds an instance; gives its id.
    pub(super) fn add(&mut self, body: &str) -> u64 {
        self.last += 1;
        let _ = writeln!(self.text, "#{}={body};", self.last);
        self.last
    }

    pub(super) fn point<const D: usize>(&mut self, p: &[f64; D]) -> u64 {
        let c = p.map(real).join(",");
        self.add(&format!("CARTESIAN_POINT('',({c}))"))
    }

    pub(super) fn vertex(&mut self, p: &Point3) -> u64 {
        let point = self.point(&[p.x, p.y, p.z]);
        self.add(&format!("VERTEX_POINT('',#{point})"))
    }

    pub(super) fn direction(&mut self, d: Vector3) -> u64 {
        let c = [d.x, d.y, d.z].map(real).join(",");
        self.add(&format!("DIRECTION('',({c}))"))
    }

    /// A curve in space or in a parameter plane.
    pub(super) fn curve<const D: usize>(&mut self, curve: &NurbsCurve<D>) -> u64 {
        let points: Vec<u64> = curve.points().iter().map(|p| self.point::<D>(&p.coords.data.0[0])).collect();
        let (degree, points) = (curve.knots().degree(), references(&points));
        let (times, knots) = knots(curve.knots().as_slice());
        let shape = format!("{degree},{points},.UNSPECIFIED.,.F.,.F.");
        match curve.weights() {
            None => self.add(&format!(
                "B_SPLINE_CURVE_WITH_KNOTS('',{shape},{times},{knots},.UNSPECIFIED.)"
            )),
            Some(w) => self.add(&format!(
                "(BOUNDED_CURVE()B_SPLINE_CURVE({shape})B_SPLINE_CURVE_WITH_KNOTS({times},{knots},.UNSPECIFIED.)\
                 CURVE()GEOMETRIC_REPRESENTATION_ITEM()RATIONAL_B_SPLINE_CURVE({})REPRESENTATION_ITEM(''))",
                reals(w)
            )),
        }
    }

    pub(super) fn surface(&mut self, surface: &NurbsSurface) -> u64 {
        let (rows, columns) = surface.size();
        let mut net = Vec::with_capacity(rows);
        for i in 0..rows {
            let row: Vec<u64> = (0..columns)
                .map(|j| {
                    let p = surface.control_point(i, j);
                    self.point(&[p.x, p.y, p.z])
                })
                .collect();
            net.push(references(&row));
        }
        let (ku, kv) = (surface.knots_u(), surface.knots_v());
        let ((times_u, knots_u), (times_v, knots_v)) = (knots(ku.as_slice()), knots(kv.as_slice()));
        let net = net.join(",");
        let shape = format!("{},{},({net}),.UNSPECIFIED.,.F.,.F.,.F.", ku.degree(), kv.degree());
        let all_knots = format!("{times_u},{times_v},{knots_u},{knots_v},.UNSPECIFIED.");
        if !surface.is_rational() {
            return self.add(&format!("B_SPLINE_SURFACE_WITH_KNOTS('',{shape},{all_knots})"));
        }
        let row = |i: usize| reals(&(0..columns).map(|j| surface.weight(i, j)).collect::<Vec<_>>());
        let weights: Vec<String> = (0..rows).map(row).collect();
        self.add(&format!(
            "(BOUNDED_SURFACE()B_SPLINE_SURFACE({shape})B_SPLINE_SURFACE_WITH_KNOTS({all_knots})\
             GEOMETRIC_REPRESENTATION_ITEM()RATIONAL_B_SPLINE_SURFACE(({}))REPRESENTATION_ITEM('')SURFACE())",
            weights.join(",")
        ))
    }

    /// A styled item that gives `item` a colour.
    pub(super) fn coloured(&mut self, item: u64, rgb: [u8; 3]) -> u64 {
        let style = match self.styles.get(&rgb) {
            Some(style) => *style,
            None => {
                let parts = rgb.map(|c| real(f64::from(c) / 255.0)).join(",");
                let colour = self.add(&format!("COLOUR_RGB('',{parts})"));
                let fill = self.add(&format!("FILL_AREA_STYLE_COLOUR('',#{colour})"));
                let fill = self.add(&format!("FILL_AREA_STYLE('',(#{fill}))"));
                let fill = self.add(&format!("SURFACE_STYLE_FILL_AREA(#{fill})"));
                let side = self.add(&format!("SURFACE_SIDE_STYLE('',(#{fill}))"));
                let usage = self.add(&format!("SURFACE_STYLE_USAGE(.BOTH.,#{side})"));
                let style = self.add(&format!("PRESENTATION_STYLE_ASSIGNMENT((#{usage}))"));
                self.styles.insert(rgb, style);
                style
            }
        };
        self.add(&format!("STYLED_ITEM('',(#{style}),#{item})"))
    }
}

/// The shortest number that reads back as the same bits, in the notation of Part 21.
pub(super) fn real(x: f64) -> String {
    let text = format!("{x:?}");
    match text.split_once('e') {
        Some((mantissa, exponent)) if mantissa.contains('.') => format!("{mantissa}E{exponent}"),
        Some((mantissa, exponent)) => format!("{mantissa}.E{exponent}"),
        None => text.strip_suffix(".0").map_or(text.clone(), |whole| format!("{whole}.")),
    }
}

fn reals(values: &[f64]) -> String {
    let all: Vec<String> = values.iter().map(|x| real(*x)).collect();
    format!("({})", all.join(","))
}

pub(super) fn references(ids: &[u64]) -> String {
    let all: Vec<String> = ids.iter().map(|id| format!("#{id}")).collect();
    format!("({})", all.join(","))
}

/// Multiplicities and values.
fn knots(all: &[f64]) -> (String, String) {
    let runs: Vec<&[f64]> = all.chunk_by(|a, b| a == b).collect();
    let times: Vec<String> = runs.iter().map(|r| r.len().to_string()).collect();
    (format!("({})", times.join(",")), reals(&runs.iter().map(|r| r[0]).collect::<Vec<_>>()))
}

/// A string with its quotes, everything but printable ASCII as `\X2\` or `\X4\`.
pub(super) fn quoted(text: &str) -> String {
    let mut out = String::from("'");
    for c in text.chars() {
        let _ = match c {
            '\'' => write!(out, "''"),
            '\\' => write!(out, "\\\\"),
            ' '..='~' => write!(out, "{c}"),
            c if u32::from(c) < 0x1_0000 => write!(out, "\\X2\\{:04X}\\X0\\", u32::from(c)),
            c => write!(out, "\\X4\\{:08X}\\X0\\", u32::from(c)),
        };
    }
    out.push('\'');
    out
}
