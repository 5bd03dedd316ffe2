//! Small pictures that show where on the model a region is. They are drawn by the processor, so that every job has
//! them and their bytes are the same everywhere.

use claymill_nurbs::{Point3, Vector3};
use rayon::prelude::*;

use crate::camera::Axes;
use crate::model_view::ModelView;
use crate::palette::{Rgb, stroke_shade};

/// Size, pixels.
const WIDTH: usize = 144;
const HEIGHT: usize = 84;
/// Free border, pixels.
const BORDER: f64 = 3.0;
/// Shades from seen edge-on to seen face-on.
const SHADES: usize = 6;
/// A region with fewer pixels gets a ring around it.
const SMALL: usize = 40;
const RING_PX: f64 = 9.0;
/// Palette: nothing, the model's shades, the region's, the ring.
const NOTHING: u8 = 0;
const MODEL: u8 = 1;
const REGION: u8 = MODEL + SHADES as u8;
const RING: u8 = REGION + SHADES as u8;
const RING_COLOUR: Rgb = [180, 30, 30];

/// What is in front at each pixel, from one direction.
struct Front {
    seen_from: String,
    depth: Vec<f32>,
    region: Vec<u32>,
    shade: Vec<u8>,
}

/// A region on the model.
#[derive(Debug, Clone, PartialEq)]
pub struct Thumbnail {
    /// From where it is seen: `front left, above`; or, where it is seen from nowhere, that it lies inside.
    pub seen_from: String,
    /// The PNG file's bytes.
    pub png: Vec<u8>,
}

/// A picture of each region by its id, from the corner of the vehicle where most of it is to be seen.
#[must_use]
pub fn region_thumbnails(view: &ModelView<'_>, axes: &Axes, colours: &[Rgb]) -> Vec<Thumbnail> {
    let corners: Vec<(String, Vector3)> = [(1.0, "above"), (-1.0, "below")]
        .into_iter()
        .flat_map(|up| [(1.0, "front"), (-1.0, "rear")].map(|forward| (up, forward)))
        .flat_map(|(up, forward)| [(1.0, "left"), (-1.0, "right")].map(|left| (up, forward, left)))
        .map(|((u, above), (f, front), (l, left))| {
            let side = axes.up.cross(&axes.forward);
            let to_eye = axes.forward * (0.75 * f) + side * (0.95 * l) + axes.up * (0.62 * u);
            (format!("{front} {left}, {above}"), to_eye.normalize())
        })
        .collect();
    let fronts: Vec<Front> =
        corners.par_iter().map(|(name, to_eye)| front(view, axes, name, to_eye)).collect();
    let counts: Vec<Vec<usize>> = fronts.iter().map(|f| pixels_of(&f.region, colours.len())).collect();
    let thumbnail = |region: usize| {
        // The first of equals: the cover's corner.
        let best = (0..fronts.len()).rev().max_by_key(|&k| counts[k][region]).unwrap_or(0);
        let (front, pixels) = (&fronts[best], counts[best][region]);
        let mut picture: Vec<u8> = (0..WIDTH * HEIGHT)
            .map(|i| match front.region[i] {
                u32::MAX => NOTHING,
                r if r as usize == region => REGION + front.shade[i],
                _ => MODEL + front.shade[i],
            })
            .collect();
        let seen_from =
            if pixels > 0 { front.seen_from.clone() } else { "inside, seen from nowhere".to_owned() };
        if pixels < SMALL {
            ring(&mut picture, middle(view, axes, &corners[best].1, region, &front.region));
        }
        Thumbnail { seen_from, png: png_of(&picture, colours[region]) }
    };
    (0..colours.len()).into_par_iter().map(thumbnail).collect()
}

/// From model to pixels: right, down and towards the eye.
struct Projection {
    rows: [Vector3; 3],
    middle: Vector3,
    px_per_mm: f64,
}

impl Projection {
    fn new(view: &ModelView<'_>, axes: &Axes, to_eye: &Vector3) -> Self {
        let right = axes.up.cross(to_eye).normalize();
        let rows = [right, right.cross(to_eye), *to_eye];
        let (mut low, mut high) = (Vector3::repeat(f64::INFINITY), Vector3::repeat(f64::NEG_INFINITY));
        for p in view.meshes.iter().flat_map(|m| &m.points) {
            let q = Vector3::new(rows[0].dot(&p.coords), rows[1].dot(&p.coords), rows[2].dot(&p.coords));
            (low, high) = (low.inf(&q), high.sup(&q));
        }
        let size = high - low;
        let fit = |pixels: usize, mm: f64| (pixels as f64 - 2.0 * BORDER) / mm.max(1e-9);
        let px_per_mm = fit(WIDTH, size.x).min(fit(HEIGHT, size.y));
        Projection {
            rows,
            middle: (low + high) * 0.5,
            px_per_mm: if px_per_mm.is_finite() { px_per_mm } else { 1.0 },
        }
    }

    fn place(&self, p: &Point3) -> [f64; 3] {
        let along = |i: usize| (self.rows[i].dot(&p.coords) - self.middle[i]) * self.px_per_mm;
        [along(0) + 0.5 * WIDTH as f64, along(1) + 0.5 * HEIGHT as f64, along(2)]
    }
}

fn front(view: &ModelView<'_>, axes: &Axes, name: &str, to_eye: &Vector3) -> Front {
    let projection = Projection::new(view, axes, to_eye);
    let mut front = Front {
        seen_from: name.to_owned(),
        depth: vec![f32::NEG_INFINITY; WIDTH * HEIGHT],
        region: vec![u32::MAX; WIDTH * HEIGHT],
        shade: vec![0; WIDTH * HEIGHT],
    };
    for (mesh, &region) in view.meshes.iter().zip(view.region_of_face) {
        let places: Vec<[f64; 3]> = mesh.points.iter().map(|p| projection.place(p)).collect();
        for t in &mesh.triangles {
            front.fill(t.map(|i| places[i as usize]), region as u32);
        }
    }
    front
}

impl Front {
    fn fill(&mut self, [a, b, c]: [[f64; 3]; 3], region: u32) {
        let cross = |p: &[f64; 3], q: &[f64; 3], x: f64, y: f64| {
            (q[0] - p[0]) * (y - p[1]) - (q[1] - p[1]) * (x - p[0])
        };
        let twice_area = cross(&a, &b, c[0], c[1]);
        if twice_area == 0.0 || !twice_area.is_finite() {
            return;
        }
        let (u, v) = (Vector3::from(b) - Vector3::from(a), Vector3::from(c) - Vector3::from(a));
        let facing = u.cross(&v).try_normalize(0.0).map_or(0.0, |n| n.z.abs());
        let shade = ((facing * SHADES as f64) as u8).min(SHADES as u8 - 1);
        let range = |i: usize, size: usize| {
            let (low, high) = (a[i].min(b[i]).min(c[i]), a[i].max(b[i]).max(c[i]));
            // Pixels whose middle may lie inside.
            ((low - 0.5).ceil().max(0.0) as usize)..((high + 0.5).floor().clamp(0.0, size as f64) as usize)
        };
        for y in range(1, HEIGHT) {
            for x in range(0, WIDTH) {
                let (px, py) = (x as f64 + 0.5, y as f64 + 0.5);
                let weights = [cross(&b, &c, px, py), cross(&c, &a, px, py), cross(&a, &b, px, py)];
                if weights.iter().any(|w| w * twice_area < 0.0) {
                    continue;
                }
                let depth = (weights[0] * a[2] + weights[1] * b[2] + weights[2] * c[2]) / twice_area;
                let at = y * WIDTH + x;
                if depth as f32 > self.depth[at] {
                    (self.depth[at], self.region[at], self.shade[at]) = (depth as f32, region, shade);
                }
            }
        }
    }
}

fn pixels_of(regions: &[u32], count: usize) -> Vec<usize> {
    let mut pixels = vec![0; count];
    for &r in regions {
        if let Some(n) = pixels.get_mut(r as usize) {
            *n += 1;
        }
    }
    pixels
}

/// Where a small region is: the middle of its pixels, or of its vertices where it has none.
fn middle(view: &ModelView<'_>, axes: &Axes, to_eye: &Vector3, region: usize, seen: &[u32]) -> [f64; 2] {
    let own: Vec<[f64; 2]> = (0..seen.len())
        .filter(|&i| seen[i] as usize == region)
        .map(|i| [(i % WIDTH) as f64, (i / WIDTH) as f64])
        .collect();
    let places = if own.is_empty() {
        let projection = Projection::new(view, axes, to_eye);
        let meshes = view.meshes.iter().zip(view.region_of_face).filter(|(_, r)| **r == region);
        meshes.flat_map(|(m, _)| &m.points).map(|p| projection.place(p)).map(|p| [p[0], p[1]]).collect()
    } else {
        own
    };
    let mean = |i: usize| places.iter().map(|p| p[i]).sum::<f64>() / places.len().max(1) as f64;
    [mean(0), mean(1)]
}

fn ring(picture: &mut [u8], [x0, y0]: [f64; 2]) {
    for (i, pixel) in picture.iter_mut().enumerate() {
        let (x, y) = ((i % WIDTH) as f64, (i / WIDTH) as f64);
        if ((x - x0).hypot(y - y0) - RING_PX).abs() < 0.9 {
            *pixel = RING;
        }
    }
}

/// Four bits a pixel: shades of light grey, and of the region's colour strong enough to stand out without colours.
fn png_of(picture: &[u8], colour: Rgb) -> Vec<u8> {
    let strong = stroke_shade(colour);
    let mix = |c: Rgb, k: usize, darkest: f64| {
        let light = darkest + (1.0 - darkest) * k as f64 / (SHADES - 1) as f64;
        c.map(|v| (f64::from(v) * light).round() as u8)
    };
    let mut palette = vec![255, 255, 255];
    palette.extend((0..SHADES).flat_map(|k| mix([226, 227, 230], k, 0.82)));
    palette.extend((0..SHADES).flat_map(|k| mix(strong, k, 0.6)));
    palette.extend(RING_COLOUR);
    let packed: Vec<u8> = picture
        .chunks(WIDTH)
        .flat_map(|row| row.chunks(2))
        .map(|p| p[0] << 4 | p.get(1).unwrap_or(&0))
        .collect();
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, WIDTH as u32, HEIGHT as u32);
    encoder.set_color(png::ColorType::Indexed);
    encoder.set_depth(png::BitDepth::Four);
    encoder.set_palette(palette);
    encoder.set_trns(vec![0]);
    let written = encoder.write_header().and_then(|mut w| w.write_image_data(&packed));
    debug_assert!(written.is_ok(), "writing to memory cannot fail");
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;
    use claymill_nurbs::{Face, FaceMesh, KnotVector, Model, NurbsSurface, Source, SurfaceKind};

    fn square(z: f64, half: f64) -> (Face, FaceMesh) {
        let line = KnotVector::clamped_uniform(1, 2);
        let corners: Vec<Point3> = [(-1., -1.), (-1., 1.), (1., -1.), (1., 1.)]
            .map(|(x, y)| Point3::new(x * half, y * half, z))
            .into();
        let face = Face {
            surface: NurbsSurface::new(line.clone(), line, corners.clone(), None).unwrap(),
            loops: Vec::new(),
            reversed: false,
            kind: SurfaceKind::Plane,
            source: Source::default(),
        };
        let mesh = FaceMesh { points: corners, triangles: vec![[0, 2, 3], [0, 3, 1]], ..FaceMesh::default() };
        (face, mesh)
    }

    fn pixels(thumbnail: &Thumbnail) -> Vec<u8> {
        let mut reader = png::Decoder::new(std::io::Cursor::new(&thumbnail.png)).read_info().unwrap();
        let mut packed = vec![0; reader.output_buffer_size().unwrap()];
        reader.next_frame(&mut packed).unwrap();
        packed.iter().flat_map(|b| [b >> 4, b & 15]).collect()
    }

    #[test]
    fn a_region_is_shown_from_where_it_is_seen() {
        // A large roof, a floor under it, and a small plate shut in between two large ones.
        let parts = [square(100.0, 100.0), square(0.0, 100.0), square(50.0, 1.0)];
        let (faces, meshes): (Vec<_>, Vec<_>) = parts.into_iter().unzip();
        let model = Model { faces, ..Model::default() };
        let view = ModelView {
            model: &model,
            meshes: &meshes,
            region_of_face: &[0, 1, 2],
            cut: None,
            joint_tolerance_mm: 0.01,
            free_sides: None,
        };
        let all = region_thumbnails(&view, &Axes::default(), &[[200, 60, 60], [60, 200, 60], [60, 60, 200]]);
        assert_eq!(all[0].seen_from, "front left, above");
        assert_eq!(all[1].seen_from, "front left, below");
        let count =
            |t: &Thumbnail, what: std::ops::Range<u8>| pixels(t).iter().filter(|p| what.contains(p)).count();
        assert!(count(&all[0], REGION..RING) > 1000 && count(&all[1], REGION..RING) > 1000);
        assert_eq!(count(&all[0], RING..RING + 1), 0);
        assert!(count(&all[2], RING..RING + 1) > 30, "a ring marks what is too small to be seen");
        assert_eq!(
            all,
            region_thumbnails(&view, &Axes::default(), &[[200, 60, 60], [60, 200, 60], [60, 60, 200]])
        );
    }
}
