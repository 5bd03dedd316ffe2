//! Faces with holes, written in every way that the format allows.

use std::f64::consts::PI;
use std::fmt::Write as _;

use claymill_nurbs::{FaceMesh, MeshOptions, tessellate};

use super::green::green_area;
use super::text::{file, read};

/// Writes instances with numbers of their own.
#[derive(Default)]
struct Script {
    text: String,
    count: u64,
}

impl Script {
    fn add(&mut self, instance: &str) -> u64 {
        self.count += 1;
        let id = 100 + self.count;
        writeln!(self.text, "#{id}={instance};").unwrap();
        id
    }

    fn point(&mut self, [x, y]: [f64; 2]) -> u64 {
        self.add(&format!("CARTESIAN_POINT('',({x:?},{y:?},0.))"))
    }

    fn list(ids: &[u64]) -> String {
        let ids: Vec<String> = ids.iter().map(|id| format!("#{id}")).collect();
        format!("({})", ids.join(","))
    }
}

/// How one half of a circle is stored: along the loop or against it, on a circle about +z or −z.
#[derive(Clone, Copy)]
struct Half {
    along: bool,
    up: bool,
}

const HALVES: [Half; 4] = [
    Half { along: true, up: true },
    Half { along: true, up: false },
    Half { along: false, up: true },
    Half { along: false, up: false },
];

fn flag(yes: bool) -> &'static str {
    if yes { ".T." } else { ".F." }
}

/// A circle of two halves that begins at `deg`, as a loop that runs anticlockwise.
fn circle(script: &mut Script, centre: [f64; 2], r: f64, deg: f64, halves: [Half; 2]) -> u64 {
    let (sine, cosine) = deg.to_radians().sin_cos();
    let ends = [1.0, -1.0].map(|side| {
        let at = script.point([centre[0] + side * r * cosine, centre[1] + side * r * sine]);
        script.add(&format!("VERTEX_POINT('',#{at})"))
    });
    let middle = script.point(centre);
    let oriented = [0, 1].map(|k| {
        let Half { along, up } = halves[k];
        let axis = if up { 12 } else { 14 };
        let place = script.add(&format!("AXIS2_PLACEMENT_3D('',#{middle},#{axis},#13)"));
        let curve = script.add(&format!("CIRCLE('',#{place},{r:?})"));
        let (from, to) = if along { (ends[k], ends[1 - k]) } else { (ends[1 - k], ends[k]) };
        let sense = flag(along == up);
        let edge = script.add(&format!("EDGE_CURVE('',#{from},#{to},#{curve},{sense})"));
        script.add(&format!("ORIENTED_EDGE('',*,*,#{edge},{})", flag(along)))
    });
    script.add(&format!("EDGE_LOOP('',{})", Script::list(&oriented)))
}

/// A polygon as a loop.
fn polygon(script: &mut Script, corners: &[[f64; 2]]) -> u64 {
    let corners: Vec<u64> = corners.iter().map(|c| script.point(*c)).collect();
    script.add(&format!("POLY_LOOP('',{})", Script::list(&corners)))
}

/// Faces on the plane z = 0, each with its true area.
#[derive(Default)]
struct Plate {
    script: Script,
    faces: Vec<(u64, f64)>,
}

impl Plate {
    /// The face with these loops, with every way of naming and turning the bounds.
    fn all_ways(&mut self, loops: &[u64], area: f64) {
        let outer_kinds: [Option<usize>; 2] = [None, Some(0)];
        for turned in 0..1 << loops.len() {
            for sense in [true, false] {
                for (back, outer) in [false, true].into_iter().zip(outer_kinds) {
                    let mut bounds: Vec<u64> = (loops.iter().enumerate())
                        .map(|(k, edges)| {
                            let kind = if outer == Some(k) { "FACE_OUTER_BOUND" } else { "FACE_BOUND" };
                            self.script.add(&format!("{kind}('',#{edges},{})", flag(turned >> k & 1 == 0)))
                        })
                        .collect();
                    if back {
                        bounds.reverse();
                    }
                    let bounds = Script::list(&bounds);
                    let face = self.script.add(&format!("ADVANCED_FACE('',{bounds},#50,{})", flag(sense)));
                    self.faces.push((face, area));
                }
            }
        }
    }

    /// Every face has its area, by the kernel, by Green's theorem over the loops as they stand, by its mesh and by the file's
    /// own edges; nothing is in doubt.
    #[track_caller]
    fn check(&self) {
        let list = Script::list(&self.faces.iter().map(|f| f.0).collect::<Vec<_>>());
        let text = file(&format!(
            "#7=SHAPE_REPRESENTATION('',(#8),#1);\n#8=SHELL_BASED_SURFACE_MODEL('',(#9));\n#9=OPEN_SHELL('',{list});\n\
             #10=AXIS2_PLACEMENT_3D('',#11,#12,#13);\n#11=CARTESIAN_POINT('',(1.,2.,0.));\n\
             #12=DIRECTION('',(0.,0.,1.));\n#13=DIRECTION('',(1.,0.,0.));\n#14=DIRECTION('',(0.,0.,-1.));\n\
             #50=PLANE('',#10);\n{}",
            self.script.text
        ));
        let import = read(&text);
        assert_eq!(import.report.skipped, []);
        assert_eq!(import.model.faces.len(), self.faces.len());
        assert_eq!(import.report.faces.len(), self.faces.len());
        for ((face, reading), (id, area)) in
            import.model.faces.iter().zip(&import.report.faces).zip(&self.faces)
        {
            let close = |found: f64, limit: f64| (found / area - 1.0).abs() < limit;
            let meshed = mesh_area(
                &tessellate(face, &MeshOptions { deviation_mm: 0.02, longest_edge_mm: 1e3 }).unwrap(),
            );
            let found = [face.area_mm2(), green_area(face), meshed];
            assert!(
                close(found[0], 1e-7) && close(found[1], 1e-6) && close(found[2], 0.01),
                "#{id}: {found:?} instead of {area}"
            );
            assert!(close(reading.area_in_file_mm2.unwrap(), 1e-9), "#{id}: {reading:?}");
            assert_eq!((reading.doubt.as_ref(), reading.bounds_in_file), (None, face.loops.len()), "#{id}");
        }
    }
}

fn mesh_area(mesh: &FaceMesh) -> f64 {
    let of = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|i| mesh.points[i as usize]);
        0.5 * (b - a).cross(&(c - a)).norm()
    };
    mesh.triangles.iter().map(of).sum()
}

/// The control points of half a circle reach beyond it, as far as beyond a tight outer loop.
#[test]
fn a_round_hole_of_two_half_circles_stays_open_however_it_is_written() {
    let r = 10.4368;
    for deg in [0.0, 45.0] {
        let mut plate = Plate::default();
        let side = 1.02 * r;
        let square =
            polygon(&mut plate.script, &[[-side, -side], [side, -side], [side, side], [-side, side]]);
        let ring = circle(&mut plate.script, [0.0, 0.0], 1.25 * r, 0.0, [HALVES[0]; 2]);
        // Touches its outer loop in one point.
        let cam = circle(&mut plate.script, [0.2 * r, 0.0], 1.2 * r, deg, [HALVES[3]; 2]);
        for (first, second) in (0..4).map(|k| (HALVES[k], HALVES[(k + 1) % 4])) {
            let hole = circle(&mut plate.script, [0.0, 0.0], r, deg, [first, second]);
            plate.all_ways(&[square, hole], 4.0 * side * side - PI * r * r);
            plate.all_ways(&[ring, hole], PI * r * r * (1.25 * 1.25 - 1.0));
            plate.all_ways(&[cam, hole], PI * r * r * (1.2 * 1.2 - 1.0));
        }
        plate.check();
    }
}

/// Holes that touch each other and their outer loop, and an outer loop that is round while its holes have corners.
#[test]
fn holes_may_touch_each_other_and_their_outer_loop() {
    let mut plate = Plate::default();
    let whole = circle(&mut plate.script, [3.0, -2.0], 10.0, 20.0, [HALVES[0], HALVES[2]]);
    let left = circle(&mut plate.script, [-2.0, -2.0], 5.0, 45.0, [HALVES[1], HALVES[1]]);
    let right = circle(&mut plate.script, [8.0, -2.0], 5.0, 10.0, [HALVES[0], HALVES[3]]);
    plate.all_ways(&[whole, left, right], 50.0 * PI);
    // Its corners lie on the outer loop.
    let diamond = polygon(&mut plate.script, &[[13.0, -2.0], [3.0, 8.0], [-7.0, -2.0], [3.0, -12.0]]);
    plate.all_ways(&[whole, diamond], 100.0 * PI - 200.0);
    plate.check();
}
