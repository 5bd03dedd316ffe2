//! Colours of regions: a palette in OKLCH, and a greedy choice that keeps neighbours apart for
//! normal and for colour-blind eyes.

use claymill_nurbs::{Aabb, Vector3};

/// An sRGB colour.
pub type Rgb = [u8; 3];

/// Clay: the colour of a model that is not coloured by anything.
pub const CLAY: Rgb = [205, 196, 184];
/// The side of the material, as legends show it.
pub const MATERIAL_SIDE: Rgb = [118, 86, 70];
/// Faces or areas that are not cut.
pub const NOT_CUT: Rgb = [150, 152, 156];

/// The colours that regions take, light enough for dark strokes on top. Hues step around the circle in
/// OKLCH while lightness alternates, so that neighbours in the list stay apart also for the colour-blind.
#[must_use]
pub fn region_palette() -> Vec<Rgb> {
    const HUES: [(f64, f64, f64); 12] = [
        (0.78, 0.095, 245.0),
        (0.85, 0.105, 80.0),
        (0.75, 0.095, 160.0),
        (0.72, 0.120, 28.0),
        (0.90, 0.100, 108.0),
        (0.70, 0.105, 305.0),
        (0.87, 0.065, 200.0),
        (0.84, 0.075, 355.0),
        (0.64, 0.095, 265.0),
        (0.71, 0.100, 128.0),
        (0.65, 0.085, 55.0),
        (0.87, 0.055, 290.0),
    ];
    HUES.iter().map(|&(l, c, h)| from_oklch(l, c, h)).collect()
}

/// A darker, stronger shade of the same hue: for strokes on a surface of colour `c`.
#[must_use]
pub fn stroke_shade(c: Rgb) -> Rgb {
    let lab = to_oklab(c);
    let chroma = lab.y.hypot(lab.z);
    let wanted = (chroma * 1.25).clamp(0.02, 0.16);
    let k = if chroma > 1e-6 { wanted / chroma } else { 0.0 };
    from_oklab(Vector3::new(0.52 * lab.x, lab.y * k, lab.z * k))
}

/// What the choice of a region's colour depends on.
#[derive(Debug, Clone)]
pub struct RegionExtent {
    /// Area or any measure of how much of the picture it takes.
    pub area: f64,
    /// Boxes of its faces.
    pub boxes: Vec<Aabb>,
}

/// One palette colour a region: large regions choose first, each the colour that differs most from its
/// neighbours' and from the large ones', for normal and for colour-blind eyes.
#[must_use]
pub fn colour_regions(regions: &[RegionExtent]) -> Vec<Rgb> {
    let palette = region_palette();
    let looks: Vec<[Vector3; 2]> =
        palette.iter().map(|&c| [to_oklab(c), to_oklab(deuteranopic(c))]).collect();
    let difference = |a: usize, b: usize| {
        let d = |k: usize| (looks[a][k] - looks[b][k]).norm();
        d(0).min(1.6 * d(1))
    };
    let hulls: Vec<Aabb> =
        regions.iter().map(|r| r.boxes.iter().fold(Aabb::empty(), |all, b| all.union(b))).collect();
    let whole = hulls.iter().fold(Aabb::empty(), |all, b| all.union(b));
    let reach = 0.004 * if whole.is_empty() { 0.0 } else { whole.diagonal() };
    let total: f64 = regions.iter().map(|r| r.area).sum::<f64>().max(f64::MIN_POSITIVE);

    let mut order: Vec<usize> = (0..regions.len()).collect();
    order.sort_by(|&a, &b| regions[b].area.total_cmp(&regions[a].area).then(a.cmp(&b)));
    let mut chosen: Vec<Option<usize>> = vec![None; regions.len()];
    for &r in &order {
        let mut cost = vec![0.0; palette.len()];
        for (other, pick) in chosen.iter().enumerate() {
            let Some(pick) = *pick else { continue };
            let near = close(&hulls[r], &hulls[other], reach)
                && regions[r].boxes.iter().any(|a| regions[other].boxes.iter().any(|b| close(a, b, reach)));
            let weight = regions[other].area / total + if near { 1.0 } else { 0.0 };
            for (colour, cost) in cost.iter_mut().enumerate() {
                *cost += weight / (difference(colour, pick).powi(2) + 1e-3);
            }
        }
        // The first of equal costs: deterministic, and the palette's own order when nothing presses.
        chosen[r] = (0..palette.len()).min_by(|&a, &b| cost[a].total_cmp(&cost[b]));
    }
    chosen.into_iter().map(|c| c.map_or(CLAY, |c| palette[c])).collect()
}

fn close(a: &Aabb, b: &Aabb, reach: f64) -> bool {
    (0..3).all(|i| a.min[i] - reach <= b.max[i] && b.min[i] - reach <= a.max[i])
}

fn linear(c: Rgb) -> Vector3 {
    let f = |v: u8| {
        let v = f64::from(v) / 255.0;
        if v <= 0.04045 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) }
    };
    Vector3::new(f(c[0]), f(c[1]), f(c[2]))
}

fn encoded(c: Vector3) -> Rgb {
    let f = |v: f64| {
        let v = v.clamp(0.0, 1.0);
        let v = if v <= 0.003_130_8 { 12.92 * v } else { 1.055 * v.powf(1.0 / 2.4) - 0.055 };
        (v * 255.0).round() as u8
    };
    [f(c.x), f(c.y), f(c.z)]
}

/// OKLab (B. Ottosson, 2020): a space in which distance is about perceived difference.
fn to_oklab(c: Rgb) -> Vector3 {
    let c = linear(c);
    let l = (0.412_221_470_8 * c.x + 0.536_332_536_3 * c.y + 0.051_445_992_9 * c.z).cbrt();
    let m = (0.211_903_498_2 * c.x + 0.680_699_545_1 * c.y + 0.107_396_956_6 * c.z).cbrt();
    let s = (0.088_302_461_9 * c.x + 0.281_718_837_6 * c.y + 0.629_978_700_5 * c.z).cbrt();
    Vector3::new(
        0.210_454_255_3 * l + 0.793_617_785_0 * m - 0.004_072_046_8 * s,
        1.977_998_495_1 * l - 2.428_592_205_0 * m + 0.450_593_709_9 * s,
        0.025_904_037_1 * l + 0.782_771_766_2 * m - 0.808_675_766_0 * s,
    )
}

fn from_oklab(lab: Vector3) -> Rgb {
    let l = (lab.x + 0.396_337_777_4 * lab.y + 0.215_803_757_3 * lab.z).powi(3);
    let m = (lab.x - 0.105_561_345_8 * lab.y - 0.063_854_172_8 * lab.z).powi(3);
    let s = (lab.x - 0.089_484_177_5 * lab.y - 1.291_485_548_0 * lab.z).powi(3);
    encoded(Vector3::new(
        4.076_741_662_1 * l - 3.307_711_591_3 * m + 0.230_969_929_2 * s,
        -1.268_438_004_6 * l + 2.609_757_401_1 * m - 0.341_319_396_5 * s,
        -0.004_196_086_3 * l - 0.703_418_614_7 * m + 1.707_614_701_0 * s,
    ))
}

fn from_oklch(l: f64, c: f64, hue_deg: f64) -> Rgb {
    let (sin, cos) = hue_deg.to_radians().sin_cos();
    from_oklab(Vector3::new(l, c * cos, c * sin))
}

/// What a deuteranope sees (red-green confusion; one-plane projection after Viénot, Brettel and Mollon 1999).
fn deuteranopic(c: Rgb) -> Rgb {
    let c = linear(c);
    let yellow = 0.292_75 * c.x + 0.707_25 * c.y;
    encoded(Vector3::new(yellow, yellow, -0.022_34 * c.x + 0.022_34 * c.y + c.z))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::legend::region_legend;
    use claymill_nurbs::Point3;

    #[test]
    fn oklab_has_its_published_white_and_returns() {
        let white = to_oklab([255, 255, 255]);
        approx::assert_abs_diff_eq!(white, Vector3::new(1.0, 0.0, 0.0), epsilon = 1e-6);
        for c in region_palette() {
            assert_eq!(from_oklab(to_oklab(c)), c);
        }
    }

    #[test]
    fn the_legend_names_every_region_or_says_how_many_more() {
        let (red, blue) = ([200, 0, 0], [0, 0, 200]);
        let colours: Vec<Rgb> = (0..10).map(|k| if k == 3 { blue } else { red }).collect();
        let legend = region_legend(&colours);
        let lines: Vec<(Rgb, &str)> = legend.iter().map(|e| (e.colour, e.text.as_str())).collect();
        assert_eq!(lines, [(red, "regions 0, 1, 2, 4, 5, 6 and 3 more"), (blue, "region 3")]);
    }

    #[test]
    fn palette_colours_are_told_apart() {
        let p = region_palette();
        for i in 0..p.len() {
            for j in 0..i {
                let d = (to_oklab(p[i]) - to_oklab(p[j])).norm();
                assert!(d > 0.06, "colours {i} and {j} differ by {d:.3} only");
            }
        }
    }

    #[test]
    fn neighbours_never_share_a_colour() {
        // A 6 x 6 chessboard of regions: each cell has up to eight neighbours.
        let cell = |i: usize| {
            let min = Point3::new((i % 6) as f64, (i / 6) as f64, 0.0);
            RegionExtent {
                area: 1.0 + (i * 7 % 5) as f64,
                boxes: vec![Aabb { min, max: min + Vector3::new(1.0, 1.0, 0.0) }],
            }
        };
        let regions: Vec<_> = (0..36).map(cell).collect();
        let colours = colour_regions(&regions);
        for i in 0..36 {
            for j in 0..i {
                if close(&regions[i].boxes[0], &regions[j].boxes[0], 0.0) {
                    assert_ne!(colours[i], colours[j], "regions {i} and {j}");
                }
            }
        }
        assert_eq!(colours, colour_regions(&regions));
    }
}
