//! The feature lines of the roadster as cubic B-splines, mm, and the parameters at which its panels
//! meet along them.

use claymill_nurbs::{Point3, Vector3};

use crate::network::{CurveId, Edge, Network};
use crate::spline::Spline;

/// Parameters (mm from the nose) at which the belt line passes from one neighbour to the next.
pub(super) mod belt {
    pub(in crate::roadster) const NOSE: f64 = 150.0;
    pub(in crate::roadster) const WINDSCREEN: f64 = 1250.0;
    pub(in crate::roadster) const DOOR: f64 = 1400.0;
    pub(in crate::roadster) const WINDOW_END: f64 = 2560.0;
    pub(in crate::roadster) const DECK: f64 = 2720.0;
    pub(in crate::roadster) const TAIL: f64 = 4180.0;
}

/// Angles (degrees from the horizontal, front to rear over the top) at which an arch changes neighbours.
pub(super) mod arch {
    /// Front arch: valance, top of the bumper, top and foot of the sill.
    pub(in crate::roadster) const FRONT: [f64; 4] = [-17.0, 30.0, 178.0, 198.0];
    /// Rear arch: foot and top of the sill, top of the bumper, valance.
    pub(in crate::roadster) const REAR: [f64; 4] = [-17.0, 1.0, 150.0, 198.0];
}

/// Where lamps end on the lines across nose and tail (these run over `[-1, 1]`).
pub(super) const LAMP_LOW: f64 = 0.45;
/// The same on the leading edge of the bonnet and on the tail.
pub(super) const LAMP_HIGH: f64 = 0.6;
/// Where the windscreen pillar's top ends on the header.
pub(super) const PILLAR_TOP: f64 = 0.84;
/// Where the rear pillar's top starts on the roof's side (which runs over `[0, 1]`).
pub(super) const REAR_PILLAR_TOP: f64 = 0.78;
/// Parameters of the shoulder's fillet on the body's upright profiles.
pub(super) const SHOULDER: (f64, f64) = (0.55, 0.8);

/// The feature lines of the vehicle. Millimetres; x rearwards from the nose, y to the right, z up from the
/// ground. Lines of one side name the right one; lines across run from right to left over `[-1, 1]`.
pub(super) struct Lines {
    pub(super) network: Network,
    pub(super) belt: CurveId,
    pub(super) arch_front: CurveId,
    pub(super) arch_rear: CurveId,
    pub(super) liner_front: CurveId,
    pub(super) liner_rear: CurveId,
    pub(super) liner_ends: [CurveId; 4],
    pub(super) sill_top: CurveId,
    pub(super) sill_foot: CurveId,
    pub(super) wing_nose: CurveId,
    pub(super) door_front: CurveId,
    pub(super) door_rear: CurveId,
    pub(super) wing_tail: CurveId,
    pub(super) valance_front: CurveId,
    pub(super) bumper_front: CurveId,
    pub(super) lamp_front: CurveId,
    pub(super) bonnet_lip: CurveId,
    pub(super) windscreen_foot: CurveId,
    pub(super) header: CurveId,
    pub(super) pillar_inner: CurveId,
    pub(super) pillar_outer: CurveId,
    pub(super) roof_side: CurveId,
    pub(super) roof_rear: CurveId,
    pub(super) rear_pillar_front: CurveId,
    pub(super) rear_pillar_rear: CurveId,
    pub(super) deck_front: CurveId,
    pub(super) tail: CurveId,
    pub(super) lamp_rear: CurveId,
    pub(super) bumper_rear: CurveId,
    pub(super) valance_rear: CurveId,
}

/// A wheel arch: centre and radius in side view, half width at the foot and flare at the top, mm.
struct Arch {
    x: f64,
    z: f64,
    radius: f64,
    foot: f64,
    flare: f64,
}

/// How deep the wheelhouse reaches inward, mm.
const LINER_MM: f64 = 210.0;

impl Arch {
    fn point(&self, degrees: f64) -> Point3 {
        let (sin, cos) = degrees.to_radians().sin_cos();
        let y = self.foot + self.flare * sin;
        Point3::new(self.x - self.radius * cos, y, self.z + self.radius * sin)
    }

    fn lip(&self, stations: [f64; 4]) -> Spline {
        self.line(stations, |degrees| self.point(degrees))
    }

    fn liner(&self, stations: [f64; 4]) -> Spline {
        self.line(stations, |degrees| {
            let p = self.point(degrees);
            Point3::new(p.x, self.foot - LINER_MM, p.z)
        })
    }

    fn line(&self, stations: [f64; 4], at: impl Fn(f64) -> Point3) -> Spline {
        const POINTS: usize = 13;
        let step = (stations[3] - stations[0]) / (POINTS - 1) as f64;
        let angle = |i: usize| stations[0] + step * i as f64;
        Spline::through(&(0..POINTS).map(|i| (angle(i), at(angle(i)))).collect::<Vec<_>>())
    }
}

fn at(x: f64, y: f64, z: f64) -> Point3 {
    Point3::new(x, y, z)
}

fn to(x: f64, y: f64, z: f64) -> Vector3 {
    Vector3::new(x, y, z)
}

impl Lines {
    pub(super) fn new() -> Lines {
        let mut n = Network::default();
        let front = Arch { x: 850.0, z: 345.0, radius: 405.0, foot: 872.0, flare: 68.0 };
        let rear = Arch { x: 3400.0, z: 355.0, radius: 415.0, foot: 876.0, flare: 74.0 };
        let arch_front = n.add_pair(front.lip(arch::FRONT));
        let arch_rear = n.add_pair(rear.lip(arch::REAR));
        let liner_front = n.add_pair(front.liner(arch::FRONT));
        let liner_rear = n.add_pair(rear.liner(arch::REAR));
        let liner_ends = [(arch_front, liner_front, arch::FRONT), (arch_rear, liner_rear, arch::REAR)]
            .map(|(lip, liner, stations)| {
                [stations[0], stations[3]].map(|t| {
                    let line = Spline::line(n.point(lip, t), n.point(liner, t));
                    n.add_pair(line)
                })
            })
            .concat()
            .try_into()
            .expect("two arches with two ends");

        let belt = n.add_pair(along_x(&[
            (belt::NOSE, 640.0, 760.0),
            (350.0, 676.0, 818.0),
            (600.0, 704.0, 872.0),
            (900.0, 724.0, 922.0),
            (belt::WINDSCREEN, 738.0, 968.0),
            (belt::DOOR, 742.0, 984.0),
            (2000.0, 752.0, 1014.0),
            (belt::WINDOW_END, 760.0, 1030.0),
            (belt::DECK, 762.0, 1034.0),
            (3300.0, 758.0, 1042.0),
            (3800.0, 728.0, 1030.0),
            (belt::TAIL, 660.0, 990.0),
        ]));
        let belt_at = |n: &Network, t| n.point(belt, t);
        let edge = |n: &Network, id: CurveId, t| n.point(id, t);

        // Sides.
        let (a, b) = (edge(&n, arch_front, arch::FRONT[2]), edge(&n, arch_rear, arch::REAR[1]));
        let sill_top = n.add_pair(Spline::through(&[
            (0.0, a),
            (0.3, at(1780.0, 884.0, 352.0)),
            (0.7, at(2460.0, 886.0, 352.0)),
            (1.0, b),
        ]));
        let (a, b) = (edge(&n, arch_front, arch::FRONT[3]), edge(&n, arch_rear, arch::REAR[0]));
        let sill_foot = n.add_pair(Spline::through(&[
            (0.0, a),
            (0.3, at(1780.0, 832.0, 206.0)),
            (0.7, at(2460.0, 832.0, 206.0)),
            (1.0, b),
        ]));
        let (low, high) = SHOULDER;
        let wing_nose = n.add_pair(Spline::profile(&[
            (0.0, edge(&n, arch_front, arch::FRONT[1]), to(-0.8, 0.05, 0.45)),
            (low, at(290.0, 832.0, 660.0), to(-0.75, -0.42, 0.5)),
            (high, at(210.0, 740.0, 715.0), to(-0.55, -0.6, 0.58)),
            (1.0, belt_at(&n, belt::NOSE), to(-0.45, -0.62, 0.55)),
        ]));
        let door_front = n.add_pair(Spline::profile(&[
            (0.0, edge(&n, arch_front, arch::FRONT[2]), to(0.7, 0.12, 0.7)),
            (low, at(1375.0, 905.0, 800.0), to(0.12, 0.02, 1.0)),
            (high, at(1395.0, 830.0, 990.0), to(0.05, -1.0, 0.12)),
            (1.0, belt_at(&n, belt::DOOR), to(0.0, -1.0, -0.08)),
        ]));
        let door_rear = n.add_pair(Spline::profile(&[
            (0.0, edge(&n, arch_rear, arch::REAR[1]), to(-0.65, 0.12, 0.72)),
            (low, at(2790.0, 912.0, 830.0), to(-0.25, 0.02, 1.0)),
            (high, at(2735.0, 845.0, 1040.0), to(-0.05, -1.0, 0.1)),
            (1.0, belt_at(&n, belt::DECK), to(0.0, -1.0, -0.08)),
        ]));
        let wing_tail = n.add_pair(Spline::profile(&[
            (0.0, edge(&n, arch_rear, arch::REAR[2]), to(0.8, 0.05, 0.5)),
            (low, at(4040.0, 862.0, 700.0), to(0.8, -0.4, 0.55)),
            (high, at(4138.0, 775.0, 850.0), to(0.35, -0.5, 0.8)),
            (1.0, belt_at(&n, belt::TAIL), to(0.2, -0.65, 0.72)),
        ]));

        // Nose.
        let a = edge(&n, arch_front, arch::FRONT[0]);
        let valance_front = n.add_across(&[
            (-1.0, a),
            (-0.8, at(285.0, 790.0, 222.0)),
            (-0.6, at(170.0, 650.0, 220.0)),
            (-0.4, at(112.0, 450.0, 218.0)),
            (-0.2, at(84.0, 225.0, 217.0)),
            (0.0, at(76.0, 0.0, 217.0)),
        ]);
        let a = edge(&n, arch_front, arch::FRONT[1]);
        let bumper_front = n.add_across(&[
            (-1.0, a),
            (-0.82, at(300.0, 850.0, 552.0)),
            (-0.64, at(160.0, 710.0, 556.0)),
            (-LAMP_LOW, at(86.0, 500.0, 559.0)),
            (-0.22, at(46.0, 250.0, 561.0)),
            (0.0, at(34.0, 0.0, 562.0)),
        ]);
        let bonnet_lip = n.add_across(&[
            (-1.0, belt_at(&n, belt::NOSE)),
            (-0.8, at(119.0, 525.0, 775.0)),
            (-LAMP_HIGH, at(98.0, 400.0, 785.0)),
            (-0.3, at(79.0, 200.0, 794.0)),
            (0.0, at(73.0, 0.0, 797.0)),
        ]);
        let lamp_front = n.add_pair(Spline::profile(&[
            (0.0, edge(&n, bumper_front, -LAMP_LOW), to(-0.1, -0.25, 1.0)),
            (1.0, edge(&n, bonnet_lip, -LAMP_HIGH), to(0.25, -0.6, 1.0)),
        ]));

        // Cabin.
        let windscreen_foot = n.add_across(&[
            (-1.0, belt_at(&n, belt::WINDSCREEN)),
            (-0.66, at(1165.0, 500.0, 1010.0)),
            (-0.33, at(1105.0, 250.0, 1030.0)),
            (0.0, at(1085.0, 0.0, 1036.0)),
        ]);
        let header = n.add_across(&[
            (-1.0, at(1890.0, 628.0, 1392.0)),
            (-PILLAR_TOP, at(1838.0, 550.0, 1430.0)),
            (-0.45, at(1800.0, 300.0, 1464.0)),
            (0.0, at(1784.0, 0.0, 1474.0)),
        ]);
        let a = edge(&n, header, -1.0);
        let roof_side = n.add_pair(Spline::through(&[
            (0.0, a),
            (0.4, at(2200.0, 652.0, 1414.0)),
            (REAR_PILLAR_TOP, at(2490.0, 648.0, 1404.0)),
            (1.0, at(2650.0, 634.0, 1376.0)),
        ]));
        let a = edge(&n, roof_side, 1.0);
        let roof_rear = n.add_across(&[
            (-1.0, a),
            (-0.66, at(2694.0, 430.0, 1426.0)),
            (-0.33, at(2716.0, 215.0, 1448.0)),
            (0.0, at(2724.0, 0.0, 1454.0)),
        ]);
        let pillar_inner = n.add_pair(Spline::profile(&[
            (0.0, belt_at(&n, belt::WINDSCREEN), to(0.75, -0.2, 0.62)),
            (1.0, edge(&n, header, -PILLAR_TOP), to(0.8, -0.25, 0.5)),
        ]));
        let pillar_outer = n.add_pair(Spline::profile(&[
            (0.0, belt_at(&n, belt::DOOR), to(0.72, -0.12, 0.68)),
            (1.0, edge(&n, header, -1.0), to(0.82, -0.22, 0.5)),
        ]));
        let rear_pillar_front = n.add_pair(Spline::profile(&[
            (0.0, belt_at(&n, belt::WINDOW_END), to(-0.12, -0.22, 1.0)),
            (1.0, edge(&n, roof_side, REAR_PILLAR_TOP), to(-0.25, -0.4, 0.9)),
        ]));
        let rear_pillar_rear = n.add_pair(Spline::profile(&[
            (0.0, belt_at(&n, belt::DECK), to(-0.15, -0.25, 1.0)),
            (1.0, edge(&n, roof_side, 1.0), to(-0.25, -0.45, 0.9)),
        ]));

        // Bed and tail.
        let deck_front = n.add_across(&[
            (-1.0, belt_at(&n, belt::DECK)),
            (-0.66, at(2770.0, 500.0, 1052.0)),
            (-0.33, at(2796.0, 250.0, 1060.0)),
            (0.0, at(2804.0, 0.0, 1063.0)),
        ]);
        let tail = n.add_across(&[
            (-1.0, belt_at(&n, belt::TAIL)),
            (-0.8, at(4206.0, 530.0, 1001.0)),
            (-LAMP_HIGH, at(4222.0, 400.0, 1008.0)),
            (-0.3, at(4236.0, 200.0, 1014.0)),
            (0.0, at(4240.0, 0.0, 1016.0)),
        ]);
        let a = edge(&n, arch_rear, arch::REAR[2]);
        let bumper_rear = n.add_across(&[
            (-1.0, a),
            (-0.82, at(3965.0, 866.0, 570.0)),
            (-0.64, at(4115.0, 735.0, 578.0)),
            (-LAMP_LOW, at(4200.0, 520.0, 584.0)),
            (-0.22, at(4246.0, 260.0, 588.0)),
            (0.0, at(4258.0, 0.0, 590.0)),
        ]);
        let a = edge(&n, arch_rear, arch::REAR[3]);
        let valance_rear = n.add_across(&[
            (-1.0, a),
            (-0.8, at(3980.0, 800.0, 240.0)),
            (-0.6, at(4100.0, 665.0, 246.0)),
            (-0.4, at(4165.0, 460.0, 250.0)),
            (-0.2, at(4195.0, 230.0, 252.0)),
            (0.0, at(4204.0, 0.0, 252.0)),
        ]);
        let lamp_rear = n.add_pair(Spline::profile(&[
            (0.0, edge(&n, bumper_rear, -LAMP_LOW), to(0.15, -0.2, 1.0)),
            (1.0, edge(&n, tail, -LAMP_HIGH), to(-0.15, -0.35, 1.0)),
        ]));

        Lines {
            network: n,
            belt,
            arch_front,
            arch_rear,
            liner_front,
            liner_rear,
            liner_ends,
            sill_top,
            sill_foot,
            wing_nose,
            door_front,
            door_rear,
            wing_tail,
            valance_front,
            bumper_front,
            lamp_front,
            bonnet_lip,
            windscreen_foot,
            header,
            pillar_inner,
            pillar_outer,
            roof_side,
            roof_rear,
            rear_pillar_front,
            rear_pillar_rear,
            deck_front,
            tail,
            lamp_rear,
            bumper_rear,
            valance_rear,
        }
    }

    /// The right side's edge over part of a line.
    pub(super) fn part(&self, curve: CurveId, from: f64, to: f64) -> Edge {
        Edge { curve, from, to }
    }

    /// The whole line as an edge.
    pub(super) fn whole(&self, curve: CurveId) -> Edge {
        self.network.whole(curve)
    }
}

/// A line along the vehicle through `(x, y, z)`, with x as its parameter.
fn along_x(table: &[(f64, f64, f64)]) -> Spline {
    Spline::through(&table.iter().map(|&(x, y, z)| (x, at(x, y, z))).collect::<Vec<_>>())
}
