//! Borders between what setups cut, as smooth lines.
//!
//! ```text
//!    by triangles        smoothed
//!    ╲╱╲╱╲__╱╲╱╲         ‿‿‿‿‿‿‿‿
//! ```
//!
//! Probes decide triangle by triangle. Where either setup gets to a place, the border between them need not follow the
//! triangles: what each setup cuts is blurred over the surface by a normal distribution, and a place goes to the setup with
//! the largest share. Repeated, that is the flow by mean curvature of Merriman, Bence and Osher (1992): islands vanish that
//! are no larger than the blur, and teeth. No setup gets a triangle that it does not reach as a whole. The border is where
//! the last two shares are equal. Lines that run within half a step-over beside it are still the setup's
//! ([`SetupContext::places`](crate::setup::context::SetupContext)): they are for the place where both meet.
//!
//! Along a straight border the difference of two shares at the distance `d` from it is `erf(d / √2σ)`, near it `√(2/π)·d/σ`:
//! so a difference tells a distance.

use claymill_contact::Covering;
use claymill_nurbs::{FaceId, Point3, Vector3};
use rayon::prelude::*;
use rustc_hash::{FxHashMap, FxHashSet};
use serde::{Deserialize, Serialize};

use crate::pattern::together::{Cell, around, cell_of};
use crate::setup::assignment::{Assignment, MOST_SETUPS};
use crate::setup::in_triangle::area_vector;
use crate::setup::probe::{PROBES, Seen, is_in_doubt, of_setup};

/// What is blurred is blurred over so many ball radii (standard deviation), or over so many triangles where these are larger.
const BLUR_RADII: f64 = 1.0;
const BLUR_TRIANGLES: f64 = 1.0;
/// Beyond so many standard deviations the normal distribution is nothing.
const FARTHEST: f64 = 3.0;
/// A setup may get a triangle that another one faces better from this facing on (`n·axis`, 72°).
const LEAST_FACING_OF_OTHERS: f64 = 0.3;
/// Rounds of blurring at most.
const MOST_ROUNDS: usize = 8;

/// Where a setup's border crosses a triangle.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) struct Border {
    /// Number of the triangle in the covering of its face.
    pub(crate) triangle: u32,
    pub(crate) setup: u8,
    /// How far the corners are inside of what the setup cuts, mm; negative outside. Linear in between.
    pub(crate) inside_mm: [f32; 3],
}

/// What borders are looked for in.
pub(crate) struct Ground<'a> {
    pub(crate) covering: &'a Covering,
    pub(crate) region_of_face: &'a [usize],
    /// By face, triangle after triangle.
    pub(crate) seen: &'a [Vec<Seen>],
    pub(crate) setups: usize,
    pub(crate) radius_mm: f64,
}

/// A triangle beside a border.
struct Node {
    face: FaceId,
    triangle: usize,
    region: usize,
    centre: Point3,
    /// On the side that is cut.
    normal: Vector3,
    area_mm2: f64,
    setup: u8,
    /// Bits of the setups that could cut it as a whole; none where it is left as it is.
    choices: u8,
}

/// Triangles beside borders, by cells.
struct Nodes {
    all: Vec<Node>,
    of_cell: FxHashMap<Cell, Vec<u32>>,
    sigma_mm: f64,
}

/// Makes borders smooth: changes who cuts which triangle, and says by face where borders cross triangles.
pub(crate) fn smooth(ground: &Ground, assignments: &mut [Vec<Assignment>]) -> Vec<Vec<Border>> {
    let mut borders = vec![Vec::new(); assignments.len()];
    let Some(mut nodes) = ground.nodes(assignments) else { return borders };
    let mut changed = None;
    for _ in 0..MOST_ROUNDS {
        let now = nodes.flow(changed.as_ref());
        if now.is_empty() {
            break;
        }
        changed = Some(now);
    }
    let parted: Vec<Option<Parted>> =
        nodes.all.par_iter().map(|node| nodes.parted(node, ground.covering)).collect();
    for (node, parted) in nodes.all.iter().zip(parted) {
        let Some(Parted { cut, inside_mm }) = parted else { continue };
        assignments[node.face][node.triangle].part(cut);
        let crossing = inside_mm
            .iter()
            .enumerate()
            .filter(|(setup, inside)| cut[*setup].is_some() && inside.iter().any(|mm| *mm < 0.0));
        borders[node.face].extend(crossing.map(|(setup, inside)| Border {
            triangle: node.triangle as u32,
            setup: setup as u8,
            inside_mm: inside.map(|mm| mm as f32),
        }));
    }
    borders.iter_mut().for_each(|of_face| of_face.sort_by_key(|b| (b.triangle, b.setup)));
    borders
}

/// How setups part a triangle between them.
struct Parted {
    /// The share that is a setup's own; none where it does not get there.
    cut: [Option<f32>; MOST_SETUPS],
    inside_mm: [[f64; 3]; MOST_SETUPS],
}

impl Ground<'_> {
    /// The triangles around borders between setups.
    fn nodes(&self, assignments: &[Vec<Assignment>]) -> Option<Nodes> {
        let sigma_mm = self.sigma_mm();
        let mut setups_in: FxHashMap<Cell, u8> = FxHashMap::default();
        let each = |then: &mut dyn FnMut(FaceId, usize, u8, Cell)| {
            for (face, of_face) in assignments.iter().enumerate() {
                for (triangle, assignment) in of_face.iter().enumerate() {
                    if let Some(setup) = assignment.main_setup() {
                        let cell = cell_of(&self.centre(face, triangle), FARTHEST * sigma_mm);
                        then(face, triangle, setup, cell);
                    }
                }
            }
        };
        each(&mut |face, triangle, _, cell| {
            *setups_in.entry(cell).or_default() |= assignments[face][triangle].setups;
        });
        let setups_around =
            |cell: &Cell| around(*cell).filter_map(|c| setups_in.get(&c)).fold(0, |a, b| a | b);
        let mixed: FxHashMap<Cell, bool> =
            setups_in.keys().map(|cell| (*cell, setups_around(cell).count_ones() > 1)).collect();
        let is_mixed = |cell: &Cell| mixed.get(cell) == Some(&true);
        let wanted: FxHashMap<Cell, bool> =
            mixed.keys().map(|cell| (*cell, around(*cell).any(|c| is_mixed(&c)))).collect();
        let mut nodes = Nodes { all: Vec::new(), of_cell: FxHashMap::default(), sigma_mm };
        each(&mut |face, triangle, setup, cell| {
            if wanted[&cell] {
                let assignment = &assignments[face][triangle];
                nodes.of_cell.entry(cell).or_default().push(nodes.all.len() as u32);
                nodes.all.push(self.node(face, triangle, setup, assignment));
            }
        });
        (!nodes.all.is_empty()).then_some(nodes)
    }

    fn sigma_mm(&self) -> f64 {
        let meshes = self.covering.meshes();
        let triangles = self.seen.iter().map(|of_face| of_face.len() / (PROBES * self.setups)).sum::<usize>();
        let cut = (0..meshes.len()).filter(|&face| !self.seen[face].is_empty());
        let area_mm2: f64 = cut.flat_map(|face| self.covering.areas_mm2(face)).sum();
        // The side of a square of two triangles.
        let triangle_mm = (2.0 * area_mm2 / triangles.max(1) as f64).sqrt();
        (BLUR_RADII * self.radius_mm).max(BLUR_TRIANGLES * triangle_mm)
    }

    fn centre(&self, face: FaceId, triangle: usize) -> Point3 {
        let mesh = &self.covering.meshes()[face];
        let [a, b, c] = mesh.triangles[triangle].map(|i| mesh.points[i as usize].coords);
        Point3::from((a + b + c) / 3.0)
    }

    fn node(&self, face: FaceId, triangle: usize, setup: u8, assignment: &Assignment) -> Node {
        let mesh = &self.covering.meshes()[face];
        let area = area_vector(mesh, &mesh.triangles[triangle]);
        let side = assignment.side(usize::from(setup));
        let choices = match self.choices(face, triangle, side) {
            // What is faced too little by any other is its own setup's.
            bits if assignment.setups == 1 << setup && bits != 0 => bits | 1 << setup,
            bits => bits,
        };
        Node {
            face,
            triangle,
            region: self.region_of_face[face],
            centre: self.centre(face, triangle),
            normal: (area * side).try_normalize(0.0).unwrap_or_else(Vector3::zeros),
            area_mm2: area.norm(),
            setup: assignment.main_of(choices).unwrap_or(setup),
            choices,
        }
    }

    /// The setups that could cut all that is cut of a triangle, on the same side. None where they are to keep what they have:
    /// only together they reach it, or it was looked at more closely than by its probes.
    fn choices(&self, face: FaceId, triangle: usize, side: f64) -> u8 {
        let probed = &self.seen[face][PROBES * self.setups * triangle..][..PROBES * self.setups];
        if is_in_doubt(probed) {
            return 0;
        }
        let reaches = |k: usize, probe: usize, least: f64| match of_setup(probed, k)[probe] {
            Seen::Reached { facing, in_bounds, .. } => in_bounds && facing * side >= least,
            _ => false,
        };
        let is_cut = |probe: usize| (0..self.setups).any(|k| reaches(k, probe, -1.0));
        let cuts_all = |k: &usize| (0..PROBES).all(|p| !is_cut(p) || reaches(*k, p, LEAST_FACING_OF_OTHERS));
        (0..self.setups).filter(cuts_all).fold(0, |bits, k| bits | 1 << k)
    }
}

impl Nodes {
    /// The nodes around a place on the side of the surface that a node is on, and in its region.
    fn around(&self, at: &Point3, node: &Node) -> impl Iterator<Item = &Node> {
        let cell = cell_of(at, FARTHEST * self.sigma_mm);
        let (region, normal) = (node.region, node.normal);
        let near = around(cell).filter_map(|c| self.of_cell.get(&c)).flatten();
        near.map(|&k| &self.all[k as usize])
            .filter(move |other| other.region == region && other.normal.dot(&normal) > 0.0)
    }

    /// The share of each setup at a place beside a node.
    fn shares(&self, at: &Point3, node: &Node) -> [f64; MOST_SETUPS] {
        let mut shares = [0.0; MOST_SETUPS];
        for other in self.around(at, node) {
            let facing = other.normal.dot(&node.normal);
            let away = (other.centre - at).norm_squared() / self.sigma_mm.powi(2);
            if away < FARTHEST.powi(2) {
                shares[usize::from(other.setup)] += facing * other.area_mm2 * (-0.5 * away).exp();
            }
        }
        let sum: f64 = shares.iter().sum();
        if sum > 0.0 { shares.map(|share| share / sum) } else { shares }
    }

    /// Gives every node to the setup with the largest share around, and tells the cells in which any changes: elsewhere than around
    /// those that `changed` before, all stays as it is.
    fn flow(&mut self, changed: Option<&FxHashSet<Cell>>) -> FxHashSet<Cell> {
        let own_cell = |node: &Node| cell_of(&node.centre, FARTHEST * self.sigma_mm);
        let is_settled = |node: &Node| {
            changed.is_some_and(|changed| !around(own_cell(node)).any(|cell| changed.contains(&cell)))
        };
        let next = |node: &Node| {
            if node.choices.count_ones() < 2 || is_settled(node) {
                return node.setup;
            }
            let shares = self.shares(&node.centre, node);
            let choices = (0..MOST_SETUPS).filter(|k| node.choices & (1 << k) != 0);
            choices.fold(
                node.setup,
                |best, k| {
                    if shares[k] > shares[usize::from(best)] { k as u8 } else { best }
                },
            )
        };
        let next: Vec<u8> = self.all.par_iter().map(next).collect();
        let mut changes = FxHashSet::default();
        let cell_mm = FARTHEST * self.sigma_mm;
        for (node, setup) in self.all.iter_mut().zip(next).filter(|(node, setup)| node.setup != *setup) {
            changes.insert(cell_of(&node.centre, cell_mm));
            node.setup = setup;
        }
        changes
    }

    /// How the setups part a triangle, if it is not left to the one that has it already.
    fn parted(&self, node: &Node, covering: &Covering) -> Option<Parted> {
        if node.choices == 0 {
            return None;
        }
        let choices: Vec<usize> = (0..MOST_SETUPS).filter(|k| node.choices & (1 << k) != 0).collect();
        let mesh = &covering.meshes()[node.face];
        let [a, b, c] = mesh.triangles[node.triangle].map(|i| mesh.points[i as usize]);
        let shares = [node.centre, a, b, c].map(|at| self.shares(&at, node));
        // How much more a setup has at each corner than others.
        let before = |k: usize, others: &[usize]| {
            [1, 2, 3].map(|corner: usize| {
                let shares = &shares[corner];
                shares[k] - others.iter().filter(|&&l| l != k).map(|&l| shares[l]).fold(0.0, f64::max)
            })
        };
        let is_there = |k: &usize| before(*k, &choices).iter().any(|more| *more > 0.0);
        let there: Vec<usize> = choices.iter().copied().filter(is_there).collect();
        // Without an area it has no neighbours.
        if there.is_empty() {
            return None;
        }
        let mm = self.sigma_mm * std::f64::consts::FRAC_PI_2.sqrt();
        let mut parted = Parted { cut: [None; MOST_SETUPS], inside_mm: [[0.0; 3]; MOST_SETUPS] };
        for &k in &there {
            parted.cut[k] = Some(0.0);
            // Where three meet, the triangle is cut as a whole by each.
            if there.len() == 2 {
                parted.inside_mm[k] = before(k, &there).map(|more| mm * more);
            }
        }
        for shares in shares {
            let best = there.iter().copied().reduce(|a, b| if shares[b] > shares[a] { b } else { a });
            if let Some(share) = best.and_then(|k| parted.cut[k].as_mut()) {
                *share += 1.0 / PROBES as f32;
            }
        }
        Some(parted)
    }
}

#[cfg(test)]
mod tests {
    use claymill_nurbs::Point2;
    use claymill_nurbs::analytic::{Frame as Placement, plane_patch};

    use super::*;
    use crate::setup::assignment::Assignments;
    use crate::setup::claims::Claims;

    const RADIUS_MM: f64 = 6.0;
    const SIZE_MM: [f64; 2] = [200.0, 100.0];

    const SETUPS: usize = 3;
    const TWO: [bool; SETUPS] = [true, true, false];

    /// A plate that setups cut, each what `setup_of` tells of the middles of triangles, and get to as `reached` tells.
    struct Plate {
        covering: Covering,
        assignments: Assignments,
    }

    impl Plate {
        fn new(
            mut setup_of: impl FnMut(&Point3) -> usize,
            reached: impl Fn(&Point3) -> [bool; SETUPS],
        ) -> Self {
            let placement = Placement::new(Point3::origin(), Vector3::z(), Vector3::x()).unwrap();
            let surface = plane_patch(&placement, (0.0, SIZE_MM[0]), (0.0, SIZE_MM[1])).unwrap();
            let model = claymill_tests::model_of([surface]);
            let covering = Covering::new(&model, &[false], SIZE_MM[0] * SIZE_MM[1], 0.5 * RADIUS_MM).unwrap();
            let mesh = &covering.meshes()[0];
            let (mut seen, mut of_face) = (Vec::new(), Vec::new());
            for t in &mesh.triangles {
                let [a, b, c] = t.map(|i| mesh.points[i as usize]);
                let centre = Point3::from((a.coords + b.coords + c.coords) / 3.0);
                for reached in reached(&centre) {
                    let here = Seen::Reached { facing: 0.7, done: false, in_bounds: true };
                    seen.extend([if reached { here } else { Seen::Hidden }; PROBES]);
                }
                let mut assignment = Assignment::default();
                let setup = setup_of(&centre);
                assignment.setups = 1 << setup;
                assignment.cut[setup] = 1.0;
                of_face.push(assignment);
            }
            let mut of = vec![of_face];
            let ground = Ground {
                covering: &covering,
                region_of_face: &[0],
                seen: &[seen],
                setups: SETUPS,
                radius_mm: RADIUS_MM,
            };
            let borders = smooth(&ground, &mut of);
            Plate {
                covering,
                assignments: Assignments { of, missed: vec![Vec::new()], borders, slants: false },
            }
        }

        fn claims(&self) -> [Claims; SETUPS] {
            [0, 1, 2].map(|setup| Claims::of_setup(&self.covering, &self.assignments, setup))
        }

        /// The places on a raster that are cut by one setup, by both or by none, as bits.
        fn cut_by(&self, step_mm: f64) -> Vec<(Point2, usize)> {
            let claims = self.claims();
            let count = SIZE_MM.map(|mm| (mm / step_mm) as usize);
            let places = (0..count[0] * count[1]).map(|k| [k % count[0], k / count[0]]);
            let places = places.map(|[i, j]| Point2::new(i as f64 + 0.37, j as f64 + 0.41) * step_mm);
            let cut = |at: Point2| (0..SETUPS).map(|k| usize::from(claims[k].holds(0, at)) << k).sum();
            places.map(|at| (at, cut(at))).collect()
        }

        /// The border as short straight pieces.
        fn pieces(&self) -> Vec<[Point3; 2]> {
            let mesh = &self.covering.meshes()[0];
            let own = self.assignments.borders[0].iter().filter(|border| border.setup == 0);
            let piece = |border: &Border| {
                let corners = mesh.triangles[border.triangle as usize].map(|i| mesh.points[i as usize]);
                let inside = border.inside_mm.map(f64::from);
                let sides = [0, 1, 2].map(|k| (k, (k + 1) % 3)).into_iter();
                let crossed = sides.filter(|&(i, j)| (inside[i] >= 0.0) != (inside[j] >= 0.0));
                let at = |(i, j): (usize, usize)| {
                    corners[i] + (corners[j] - corners[i]) * (inside[i] / (inside[i] - inside[j]))
                };
                <[Point3; 2]>::try_from(crossed.map(at).collect::<Vec<_>>()).ok()
            };
            own.filter_map(piece).collect()
        }
    }

    /// What lies beyond a border with teeth of 4 mm.
    fn toothed(mean_mm: f64) -> impl FnMut(&Point3) -> usize {
        let mut share: f64 = 0.0;
        move |p| {
            share = (share + 0.618_034).fract();
            usize::from(p.x + 8.0 * (share - 0.5) > mean_mm)
        }
    }

    #[test]
    fn a_border_with_teeth_becomes_a_line() {
        let plate = Plate::new(toothed(100.0), |_| TWO);
        let pieces = plate.pieces();
        let length_mm: f64 = pieces.iter().map(|[a, b]| (b - a).norm()).sum();
        assert!((99.0..102.0).contains(&length_mm), "{length_mm}");
        for p in pieces.iter().flatten() {
            assert!((p.x - 100.0).abs() < 2.0, "{p}");
        }
        let of_first: f32 = plate.assignments.of[0].iter().map(|a| a.cut[0]).sum();
        let share = of_first / plate.assignments.of[0].len() as f32;
        assert!((share - 0.5).abs() < 0.02, "{share}");
    }

    #[test]
    fn every_place_is_cut_and_but_for_the_border_once() {
        let plate = Plate::new(toothed(80.0), |_| TWO);
        for (at, cut) in plate.cut_by(0.7) {
            assert_ne!(cut, 0, "{at} is nobody's");
            let expected = 1 + usize::from(at.x > 80.0);
            assert!(cut == expected || (at.x - 80.0).abs() < 2.0, "{at} is cut by {cut:b}");
        }
    }

    #[test]
    fn an_island_as_large_as_the_ball_vanishes() {
        let radius_mm = RADIUS_MM;
        let on_island = |p: &Point3| (p - Point3::new(60.0, 50.0, 0.0)).norm() < radius_mm;
        let plate = Plate::new(|p| usize::from(p.x > 140.0 || on_island(p)), |_| TWO);
        let cut = plate.cut_by(0.7);
        assert!(cut.iter().all(|(at, cut)| at.x > 130.0 || *cut == 1));
        let large = |p: &Point3| (p - Point3::new(60.0, 50.0, 0.0)).norm() < 4.0 * radius_mm;
        let plate = Plate::new(|p| usize::from(p.x > 140.0 || large(p)), |_| TWO);
        let cut = plate.cut_by(0.7);
        assert!(cut.iter().any(|(at, cut)| at.x < 130.0 && *cut == 2));
    }

    #[test]
    fn nobody_gets_what_he_does_not_reach() {
        // The second setup alone reaches an island.
        let on_island = |p: &Point3| (p - Point3::new(60.0, 50.0, 0.0)).norm() < RADIUS_MM;
        let plate =
            Plate::new(|p| usize::from(p.x > 140.0 || on_island(p)), |p| [!on_island(p), true, false]);
        let well_on = |at: &Point2| (at - Point2::new(60.0, 50.0)).norm() < 0.5 * RADIUS_MM;
        for (at, cut) in plate.cut_by(0.7).into_iter().filter(|(at, _)| well_on(at)) {
            assert_eq!(cut, 2, "{at}");
        }
    }

    #[test]
    fn one_setup_alone_has_no_borders() {
        let plate = Plate::new(|_| 0, |_| TWO);
        assert!(plate.assignments.borders[0].is_empty());
        assert!(plate.cut_by(2.0).iter().all(|(_, cut)| *cut == 1));
    }

    /// Whatever the setups reach, somebody cuts every place, and nobody what he does not reach.
    #[test]
    fn where_three_meet_every_place_is_cut_by_one_that_reaches_it() {
        for seed in 0..20 {
            let random = move |p: &Point3, k: usize| {
                let phase = f64::from(seed) + 1.7 * k as f64;
                (0.11 * p.x + phase).sin() * (0.13 * p.y + 2.0 * phase).cos() + 0.4 * (1.3 * p.x * p.y).sin()
            };
            let setup_of =
                move |p: &Point3| (0..SETUPS).max_by(|&a, &b| random(p, a).total_cmp(&random(p, b))).unwrap();
            let reached = move |p: &Point3| {
                [0, 1, 2].map(|k| k == setup_of(p) || random(&Point3::new(p.y, p.x, 0.0), k) > -0.3)
            };
            let plate = Plate::new(setup_of, reached);
            let mesh = &plate.covering.meshes()[0];
            for (at, cut) in plate.cut_by(1.3) {
                assert_ne!(cut, 0, "{at} is nobody's, seed {seed}");
                let uv = |i: u32| mesh.uv[i as usize];
                let mut triangles = mesh.triangles.iter().map(|t| t.map(uv));
                let [a, b, c] = triangles.find(|t| crate::setup::in_triangle::contains(t, at)).unwrap();
                let reached = reached(&Point3::from(((a.coords + b.coords + c.coords) / 3.0).push(0.0)));
                let missed = (0..SETUPS).filter(|k| cut & (1 << k) != 0 && !reached[*k]).count();
                assert_eq!(missed, 0, "{at}, seed {seed}");
            }
        }
    }
}
