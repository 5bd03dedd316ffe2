//! Joints between the patches of a generated model. They follow from how the patches were cut and
//! from shared feature curves; nothing is searched for by geometry.

use std::collections::BTreeMap;

use claymill_nurbs::KnotVector;

use crate::answers::Continuity;
use crate::layout::Layout;
use crate::network::CurveId;
use crate::sheet::Sheet;

/// A piece of a sheet that becomes a face.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Patch {
    pub(crate) sheet: usize,
    pub(crate) u: (f64, f64),
    pub(crate) v: (f64, f64),
}

/// A stretch that two patches share, known from how they were cut.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Contact {
    pub(crate) patches: [usize; 2],
    pub(crate) class: Continuity,
    pub(crate) length_mm: f64,
    /// Least and largest angle between the tangent planes, degrees; 0 where smooth.
    pub(crate) angle_deg: (f64, f64),
}

/// The patches of a layout, sheet by sheet and row by row.
pub(crate) fn patches(layout: &Layout) -> Vec<Patch> {
    let mut all = Vec::new();
    for (sheet, rows) in layout.iter().enumerate() {
        for row in rows {
            all.extend(row.cuts.windows(2).map(|w| Patch { sheet, u: (w[0], w[1]), v: row.v }));
        }
    }
    all
}

/// All contacts between patches. Nothing is searched for: inside a sheet the cuts say who adjoins whom and
/// the knots how smoothly; between sheets two pieces of one feature curve do.
pub(crate) fn contacts(sheets: &[Sheet], layout: &Layout) -> Vec<Contact> {
    let mut found = Vec::new();
    let mut rims: BTreeMap<CurveId, Vec<Rim>> = BTreeMap::new();
    let mut first = 0;
    for (index, rows) in layout.iter().enumerate() {
        let sheet = &sheets[index];
        let (knots_u, knots_v) = (sheet.surface.knots_u(), sheet.surface.knots_v());
        for (r, row) in rows.iter().enumerate() {
            let count = row.cuts.len() - 1;
            let mut across = |a: usize, b: usize, u: f64| {
                found.push(Contact {
                    patches: [first + a, first + b],
                    class: class_at(knots_u, u),
                    length_mm: gauss(row.v, |v| sheet.surface.jet(u, v).sv.norm()),
                    angle_deg: (0.0, 0.0),
                });
            };
            for c in 1..count {
                across(c - 1, c, row.cuts[c]);
            }
            if sheet.closed {
                across(0, count - 1, 0.0);
            }
            if let Some(above) = rows.get(r + 1) {
                for (a, b, range) in overlaps(&row.cuts, &above.cuts) {
                    found.push(Contact {
                        patches: [first + a, first + count + b],
                        class: class_at(knots_v, row.v.1),
                        length_mm: gauss(range, |u| sheet.surface.jet(u, row.v.1).su.norm()),
                        angle_deg: (0.0, 0.0),
                    });
                }
            }
            let mut rim = |side: usize, share: (f64, f64), patch: usize| {
                if let Some(edge) = sheet.edges[side] {
                    let t = (edge.parameter(share.0), edge.parameter(share.1));
                    rims.entry(edge.curve).or_default().push(Rim {
                        t: (t.0.min(t.1), t.0.max(t.1)),
                        sheet: index,
                        side,
                        patch,
                    });
                }
            };
            for (c, w) in row.cuts.windows(2).enumerate() {
                for (side, is_rim) in [(0, r == 0), (1, r + 1 == rows.len())] {
                    if is_rim {
                        rim(side, (w[0], w[1]), first + c);
                    }
                }
            }
            rim(2, row.v, first);
            rim(3, row.v, first + count - 1);
            first += count;
        }
    }
    for mut along in rims.into_values() {
        along.sort_by(|a, b| a.t.0.total_cmp(&b.t.0).then(a.patch.cmp(&b.patch)));
        creases(sheets, &along, &mut found);
    }
    found
}

/// A patch's side on a feature curve.
#[derive(Debug, Clone, Copy)]
struct Rim {
    t: (f64, f64),
    sheet: usize,
    side: usize,
    patch: usize,
}

impl Rim {
    /// The sheet's parameters at the curve's parameter `t`.
    fn parameters(&self, sheets: &[Sheet], t: f64) -> (f64, f64) {
        let share = sheets[self.sheet].edges[self.side].map_or(0.0, |e| e.share(t)).clamp(0.0, 1.0);
        [(share, 0.0), (share, 1.0), (0.0, share), (1.0, share)][self.side]
    }
}

/// Contacts across one feature curve, whose rims come ordered by where they start.
fn creases(sheets: &[Sheet], along: &[Rim], found: &mut Vec<Contact>) {
    let span = along.iter().fold(0.0f64, |m, r| m.max(r.t.1.abs()));
    for (i, a) in along.iter().enumerate() {
        for b in along[i + 1..].iter().take_while(|b| b.t.0 < a.t.1) {
            let range = (a.t.0.max(b.t.0), a.t.1.min(b.t.1));
            // Rounding of a shared corner is no contact.
            if range.1 - range.0 <= 1e-9 * span || (a.sheet, a.side) == (b.sheet, b.side) {
                continue;
            }
            let speed = |t: f64| {
                let (u, v) = a.parameters(sheets, t);
                let jet = sheets[a.sheet].surface.jet(u, v);
                let along = if a.side < 2 { jet.su } else { jet.sv };
                let edge = sheets[a.sheet].edges[a.side].map_or(1.0, |e| e.to - e.from);
                (along / edge).norm()
            };
            found.push(Contact {
                patches: [a.patch, b.patch],
                class: Continuity::C0,
                length_mm: gauss(range, speed),
                angle_deg: crease_angle(sheets, a, b, range),
            });
        }
    }
}

/// Least and largest angle between two sheets along their common curve, degrees.
fn crease_angle(sheets: &[Sheet], a: &Rim, b: &Rim, (t0, t1): (f64, f64)) -> (f64, f64) {
    const SAMPLES: usize = 32;
    let normal = |rim: &Rim, t: f64| {
        let (u, v) = rim.parameters(sheets, t);
        sheets[rim.sheet].surface.jet(u, v).normal()
    };
    // Whether both normals point to the same side of the skin follows from the sides that adjoin.
    let flip = rim_sign(sheets, a) * rim_sign(sheets, b);
    let mut range = (f64::INFINITY, 0.0f64);
    for i in 0..=SAMPLES {
        let t = t0 + (t1 - t0) * i as f64 / SAMPLES as f64;
        let (Some(m), Some(n)) = (normal(a, t), normal(b, t)) else {
            continue;
        };
        let n = -n * flip;
        let angle = m.cross(&n).norm().atan2(m.dot(&n)).to_degrees();
        range = (range.0.min(angle), range.1.max(angle));
    }
    range
}

/// +1 when the sheet's domain lies to the left of its rim run along the curve, else -1: two sheets across a
/// curve with equal signs have opposite orientations.
fn rim_sign(sheets: &[Sheet], rim: &Rim) -> f64 {
    let runs = sheets[rim.sheet].edges[rim.side].map_or(1.0, |e| (e.to - e.from).signum());
    [1.0, -1.0, -1.0, 1.0][rim.side] * runs
}

fn class_at(knots: &KnotVector, t: f64) -> Continuity {
    let (first, last) = knots.domain();
    // A seam of a tube is as smooth as its inside.
    let inside = first < t && t < last;
    if inside && knots.multiplicity(t) > 1 { Continuity::G1 } else { Continuity::G2 }
}

/// Index pairs of intervals of the two subdivisions that overlap, with the overlap.
pub(crate) fn overlaps(a: &[f64], b: &[f64]) -> Vec<(usize, usize, (f64, f64))> {
    let (mut i, mut j, mut found) = (0, 0, Vec::new());
    while i + 1 < a.len() && j + 1 < b.len() {
        let (low, high) = (a[i].max(b[j]), a[i + 1].min(b[j + 1]));
        if low < high {
            found.push((i, j, (low, high)));
        }
        if a[i + 1] <= b[j + 1] {
            i += 1;
        } else {
            j += 1;
        }
    }
    found
}

/// Integral over `[a, b]` by the five-point Gauss rule on four pieces.
pub(crate) fn gauss((a, b): (f64, f64), f: impl Fn(f64) -> f64) -> f64 {
    const NODES: [(f64, f64); 5] = [
        (0.0, 0.568_888_888_888_888_9),
        (0.538_469_310_105_683_1, 0.478_628_670_499_366_5),
        (-0.538_469_310_105_683_1, 0.478_628_670_499_366_5),
        (0.906_179_845_938_664, 0.236_926_885_056_189_1),
        (-0.906_179_845_938_664, 0.236_926_885_056_189_1),
    ];
    const PIECES: usize = 4;
    let half = 0.5 * (b - a) / PIECES as f64;
    (0..PIECES)
        .map(|k| {
            let middle = a + half * (2 * k + 1) as f64;
            NODES.iter().map(|(x, w)| w * f(middle + half * x)).sum::<f64>() * half
        })
        .sum()
}
