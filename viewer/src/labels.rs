//! Names on surfaces: each where its surface has most room in the picture, or beside it at the end of a line.

use crate::camera::Camera;
use crate::front::{Front, NOBODY, Owned};
use crate::lettering::{draw_strokes, fill, text_width, write_text};
use crate::palette::Rgb;
use crate::picture::Picture;
use crate::placement::{Area, Page};
use crate::scene::Scene;
use crate::shapes::Label;

const INK: Rgb = [24, 26, 32];
const PAPER: Rgb = [255, 255, 255];
/// Side of the cells in which room is looked for, pixels.
const CELL_PX: f64 = 2.0;
/// What is seen of fewer cells than this has no name.
const SMALLEST_CELLS: usize = 12;
/// Nor what is nowhere thicker: a gap between other surfaces.
const THINNEST_CELLS: f32 = 1.5;
/// Part of a name that must lie on its own surface, else it stands beside.
const ON_OWN: f32 = 0.75;
/// Places that are tried around a surface too small for its name: directions, and steps outwards.
const DIRECTIONS: usize = 24;
const STEPS: usize = 18;

/// A name and the place that it points to.
struct Wanted<'a> {
    label: &'a Label,
    anchor: [f32; 2],
    cells: usize,
    size: [f32; 2],
    fits: bool,
}

/// Where a name stands, and the line from there if it stands beside.
struct Placed<'a> {
    label: &'a Label,
    area: Area,
    line: Option<[[f32; 2]; 2]>,
}

/// Writes the labels of `scene`; the page keeps their places. Returns how many of what is seen found no place.
pub(crate) fn draw_labels(
    picture: &mut Picture,
    scene: &Scene,
    camera: &Camera,
    page: &mut Page<'_>,
    letter: f32,
) -> usize {
    if scene.labels.is_empty() {
        return 0;
    }
    let owned: Vec<Owned> = (scene.labels.iter().enumerate())
        .flat_map(|(k, label)| {
            label.faces.iter().filter_map(move |&f| scene.face_vertices.get(f)).map(move |of| (k, of))
        })
        .map(|(k, (surface, vertices))| Owned {
            surface: *surface,
            vertices: vertices.clone(),
            owner: k as u32,
        })
        .collect();
    let front = Front::of(scene, camera, [picture.width, picture.height], CELL_PX, &owned);
    let mut wanted = wanted(scene, &front, letter);
    // What has room where it is goes first, then the largest.
    wanted.sort_by(|a, b| b.fits.cmp(&a.fits).then(b.cells.cmp(&a.cells)));
    let mut placed: Vec<Placed<'_>> = Vec::new();
    let mut without = 0;
    for w in &wanted {
        let inside = centred(w.anchor, w.size);
        let found = if w.fits && page.is_free(&inside) {
            Some((inside, None))
        } else {
            beside(w, page, &placed, letter).map(|area| (area, Some([w.anchor, nearest_on(&area, w.anchor)])))
        };
        match found {
            Some((area, line)) => {
                page.take(area);
                placed.push(Placed { label: w.label, area, line });
            }
            None => without += 1,
        }
    }
    // Lines below all names.
    for (p, [from, to]) in placed.iter().filter_map(|p| Some((p, p.line?))) {
        draw_strokes(picture, &[[from, to]], 0.34 * letter, PAPER, 0.7);
        draw_strokes(picture, &[[from, to]], 0.13 * letter, INK, 1.0);
        draw_strokes(picture, &[[from, from]], 0.75 * letter, PAPER, 0.9);
        draw_strokes(
            picture,
            &[[from, from]],
            0.5 * letter,
            crate::palette::stroke_shade(p.label.colour),
            1.0,
        );
    }
    for p in &placed {
        let [x, y] = p.area.corner;
        let [width, height] = p.area.size;
        let edge = (0.12 * letter).max(1.0);
        fill(picture, [x, y], [width, height], crate::palette::stroke_shade(p.label.colour), 0.9);
        fill(picture, [x + edge, y + edge], [width - 2.0 * edge, height - 2.0 * edge], PAPER, 0.88);
        let half = 0.5 * text_width(&p.label.text, letter);
        write_text(picture, &p.label.text, x + 0.5 * width - half, y + 0.5 * (height + letter), letter, INK);
    }
    without
}

fn wanted<'a>(scene: &'a Scene, front: &Front, letter: f32) -> Vec<Wanted<'a>> {
    let room = front.room();
    let mut cells = vec![0; scene.labels.len()];
    let mut sum = vec![[0.0_f32; 2]; scene.labels.len()];
    let place = |i: usize| [(i % front.size[0]) as f32 + 0.5, (i / front.size[0]) as f32 + 0.5];
    let owned =
        || (0..front.owner.len()).filter(|&i| front.owner[i] != NOBODY).map(|i| (i, front.owner[i] as usize));
    for (i, k) in owned() {
        cells[k] += 1;
        sum[k] = [0, 1].map(|c| sum[k][c] + place(i)[c]);
    }
    // Of all places with room enough the one nearest to the middle of what is seen.
    let enough = letter / front.cell_px as f32 * 1.5;
    let mut best: Vec<Option<(f32, f32, usize)>> = vec![None; scene.labels.len()];
    for (i, k) in owned() {
        let middle = sum[k].map(|s| s / cells[k] as f32);
        let [x, y] = place(i);
        let off = (x - middle[0]).hypot(y - middle[1]);
        let has = room[i].min(enough);
        if best[k].is_none_or(|(most, least_off, _)| has > most || has == most && off < least_off) {
            best[k] = Some((has, off, i));
        }
    }
    let cell = front.cell_px as f32;
    let of = |(k, label): (usize, &'a Label)| {
        let (.., i) = best[k].filter(|b| cells[k] >= SMALLEST_CELLS && room[b.2] >= THINNEST_CELLS)?;
        let anchor = place(i).map(|c| c * cell);
        let size = [text_width(&label.text, letter) + 1.1 * letter, 1.9 * letter];
        let tall_enough = room[i] * cell >= 0.5 * size[1];
        let fits = tall_enough && share_owned(front, &centred(anchor, size), k as u32) >= ON_OWN;
        Some(Wanted { label, anchor, cells: cells[k], size, fits })
    };
    scene.labels.iter().enumerate().filter_map(of).collect()
}

fn share_owned(front: &Front, area: &Area, owner: u32) -> f32 {
    let cell = front.cell_px as f32;
    let range = |i: usize| {
        let low = (area.corner[i] / cell).floor().max(0.0) as usize;
        low..((area.corner[i] + area.size[i]) / cell).ceil().max(0.0) as usize
    };
    let (mut own, mut all) = (0, 0);
    for y in range(1) {
        for x in range(0) {
            all += 1;
            let inside = x < front.size[0] && y < front.size[1];
            own += usize::from(inside && front.owner[y * front.size[0] + x] == owner);
        }
    }
    own as f32 / all.max(1) as f32
}

fn centred(at: [f32; 2], size: [f32; 2]) -> Area {
    Area { corner: [at[0] - 0.5 * size[0], at[1] - 0.5 * size[1]], size }
}

/// The free place that is nearest, rather off the model than on it and without crossing lines; no line runs through a name.
fn beside(w: &Wanted<'_>, page: &Page<'_>, placed: &[Placed<'_>], letter: f32) -> Option<Area> {
    let mut best: Option<(f32, Area)> = None;
    for step in 1..=STEPS {
        let away = 1.6 * letter * step as f32 + 0.6 * w.size[0];
        for turn in 0..DIRECTIONS {
            let (sin, cos) = (std::f32::consts::TAU * turn as f32 / DIRECTIONS as f32).sin_cos();
            let area = centred([w.anchor[0] + away * cos, w.anchor[1] - away * sin], w.size);
            if !page.holds(&area) || !page.is_free(&grown(&area, 0.4 * letter)) {
                continue;
            }
            let line = [w.anchor, nearest_on(&area, w.anchor)];
            let over_names =
                placed.iter().any(|p| p.line.is_some_and(|l| through(&area, &l)) || through(&p.area, &line));
            if over_names {
                continue;
            }
            let crossed = placed.iter().filter(|p| p.line.is_some_and(|l| cross(&l, &line))).count();
            let cost = away + letter * (14.0 * page.covered_share(&area) + 30.0 * crossed as f32);
            if best.as_ref().is_none_or(|(lowest, _)| cost < *lowest) {
                best = Some((cost, area));
            }
        }
    }
    best.map(|(_, area)| area)
}

fn grown(area: &Area, by: f32) -> Area {
    Area { corner: area.corner.map(|c| c - by), size: area.size.map(|s| s + 2.0 * by) }
}

fn nearest_on(area: &Area, p: [f32; 2]) -> [f32; 2] {
    [0, 1].map(|i| p[i].clamp(area.corner[i], area.corner[i] + area.size[i]))
}

fn cross([a, b]: &[[f32; 2]; 2], [c, d]: &[[f32; 2]; 2]) -> bool {
    let side = |p: &[f32; 2], q: &[f32; 2], r: &[f32; 2]| {
        (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0])
    };
    side(a, b, c) * side(a, b, d) < 0.0 && side(c, d, a) * side(c, d, b) < 0.0
}

fn through(area: &Area, line: &[[f32; 2]; 2]) -> bool {
    let [x, y] = area.corner;
    let [width, height] = area.size;
    let inside = |p: &[f32; 2]| p[0] > x && p[0] < x + width && p[1] > y && p[1] < y + height;
    let diagonals = [[[x, y], [x + width, y + height]], [[x + width, y], [x, y + height]]];
    line.iter().any(inside) || diagonals.iter().any(|d| cross(d, line))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::View;
    use crate::placement::Covered;
    use crate::shapes::SurfaceVertex;
    use claymill_nurbs::Vector3;

    /// A large plate and eight narrow strips beside it.
    fn scene() -> Scene {
        let mut scene = Scene::default();
        let plates = std::iter::once((0.0, 60.0)).chain((0..8).map(|k| (62.0 + 3.0 * f64::from(k), 2.0)));
        for (k, (x, width)) in plates.enumerate() {
            let corner = |dx: f64, y: f64| SurfaceVertex {
                position: [(x + dx * width) as f32, y as f32, 0.0],
                normal: [0.0, 0.0, 1.0],
                colour: [200; 4],
            };
            let corners = [corner(0.0, 0.0), corner(1.0, 0.0), corner(1.0, 40.0), corner(0.0, 40.0)];
            scene.add_triangles(&corners, &[[0, 1, 2], [0, 2, 3]]);
            let first = 4 * k as u32;
            scene.face_vertices.push((0, first..first + 4));
            scene.labels.push(Label { text: format!("{}", 10 + k), colour: [90, 120, 200], faces: vec![k] });
        }
        scene
    }

    #[test]
    fn every_name_has_a_place_of_its_own_and_the_wide_ones_lie_on_their_surface() {
        let scene = scene();
        let size = [600, 400];
        let view = View { margin: 0.2, ..View::looking("above", -Vector3::z(), Vector3::y()) };
        let camera = Camera::frame(&view, scene.points(), size);
        let mut picture = Picture { width: 600, height: 400, rgba: vec![0; 4 * 600 * 400] };
        let [left, top] = camera.project(&claymill_nurbs::Point3::new(0.0, 40.0, 0.0)).unwrap();
        for (i, pixel) in picture.rgba.chunks_exact_mut(4).enumerate() {
            let (x, y) = ((i % 600) as f64, (i / 600) as f64);
            pixel[3] =
                if (left..600.0 - left).contains(&x) && (top..400.0 - top).contains(&y) { 255 } else { 0 };
            pixel[..3].fill(210);
        }
        let covered = Covered::of(&picture);
        let mut page = Page::new(size, &covered, 0.0);
        assert_eq!(draw_labels(&mut picture, &scene, &camera, &mut page, 12.0), 0);
        let areas = page.taken();
        assert_eq!(areas.len(), 9);
        for (i, a) in areas.iter().enumerate() {
            assert!(page.holds(a), "{a:?}");
            for b in &areas[..i] {
                let apart = (0..2).any(|k| {
                    a.corner[k] + a.size[k] <= b.corner[k] || b.corner[k] + b.size[k] <= a.corner[k]
                });
                assert!(apart, "{a:?} {b:?}");
            }
        }
        let middle = camera.project(&claymill_nurbs::Point3::new(30.0, 20.0, 0.0)).unwrap();
        let own = areas[0].corner.map(f64::from);
        assert!((own[0]..own[0] + f64::from(areas[0].size[0])).contains(&middle[0]), "{own:?} {middle:?}");
        // Names are readable: dark on light.
        let inked = picture.rgba.chunks_exact(4).filter(|p| p[3] > 200 && p[0] < 90).count();
        assert!(inked > 300, "{inked}");
    }
}
