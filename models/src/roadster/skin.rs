//! The body panels of the roadster: Coons surfaces hung between its feature lines, with a relief
//! each.

use claymill_nurbs::Vector3;

use super::lines::{LAMP_HIGH, LAMP_LOW, Lines, PILLAR_TOP, REAR_PILLAR_TOP, arch, belt};
use crate::network::Edge;
use crate::sheet::{Form, Frame, Sheet};

/// All sheets of the body that hang between feature lines.
pub(super) fn skin(lines: &Lines) -> Vec<Sheet> {
    let mut sheets = Vec::new();
    sides(lines, &mut sheets);
    nose(lines, &mut sheets);
    cabin(lines, &mut sheets);
    tail(lines, &mut sheets);
    wheelhouses(lines, &mut sheets);
    sheets
}

/// 0 at both ends of `[0, 1]`, 1 in the middle, with a slope at the ends: a bulge that leaves a crease.
fn bulge(t: f64) -> f64 {
    4.0 * t * (1.0 - t)
}

/// 0 at both ends of `[0, 1]`, level at 0 but with a slope at 1.
fn late_bulge(t: f64) -> f64 {
    6.75 * t * t * (1.0 - t)
}

/// 0 up to `from`, 1 beyond `to`, straight between.
fn ramp(t: f64, from: f64, to: f64) -> f64 {
    ((t - from) / (to - from)).clamp(0.0, 1.0)
}

fn by(x: f64, y: f64, z: f64) -> Vector3 {
    Vector3::new(x, y, z)
}

/// The form of a sheet that looks in the direction `(x, y, z)`, still without seams or lines.
fn facing<'a>(x: f64, y: f64, z: f64, relief: &'a dyn Fn(f64, f64) -> Vector3) -> Form<'a> {
    Form { outward: by(x, y, z), lines: (&[], &[]), relief, seams_deg: [0.0; 4] }
}

/// Adds a sheet of the right side and its mirror image.
fn pair(lines: &Lines, into: &mut Vec<Sheet>, name: &str, frame: Frame, form: &Form) {
    let right = Sheet::hung(&format!("{name} right"), &lines.network, frame, form);
    let left = right.mirrored(&format!("{name} left"), &lines.network);
    into.extend([right, left]);
}

/// Adds a sheet across the middle; its left edge (on the right side of the vehicle) is mirrored to the right.
fn across(lines: &Lines, into: &mut Vec<Sheet>, name: &str, [bottom, top, side]: [Edge; 3], form: &Form) {
    let frame = [bottom, top, side, lines.network.mirrored(side)];
    into.push(Sheet::hung(name, &lines.network, frame, form));
}

fn sides(l: &Lines, into: &mut Vec<Sheet>) {
    let [_, wing, sill, sill_foot] = arch::FRONT;
    let front_wing = [
        l.part(l.arch_front, wing, sill),
        l.part(l.belt, belt::NOSE, belt::DOOR),
        l.whole(l.wing_nose),
        l.whole(l.door_front),
    ];
    pair(
        l,
        into,
        "front wing",
        front_wing,
        &Form {
            seams_deg: [0.0, 0.0, -10.0, 4.0],
            ..facing(0.0, 1.0, 0.3, &|u, v| {
                let crest = ramp(v, 0.2, 0.75) * ramp(1.0 - v, 0.0, 0.25);
                by(0.0, 40.0 * bulge(v), 70.0 * crest) * late_bulge(u)
            })
        },
    );
    let door = [
        l.whole(l.sill_top),
        l.part(l.belt, belt::DOOR, belt::DECK),
        l.whole(l.door_front),
        l.whole(l.door_rear),
    ];
    pair(
        l,
        into,
        "door",
        door,
        &Form {
            seams_deg: [4.0, 0.0, 4.0, 4.0],
            ..facing(0.0, 1.0, 0.0, &|u, v| by(0.0, -28.0 * bulge(u) * bulge(v), 0.0))
        },
    );
    let [rear_sill_foot, rear_sill, rear_wing, _] = arch::REAR;
    let rear_wing = [
        l.part(l.arch_rear, rear_sill, rear_wing),
        l.part(l.belt, belt::DECK, belt::TAIL),
        l.whole(l.door_rear),
        l.whole(l.wing_tail),
    ];
    pair(
        l,
        into,
        "rear wing",
        rear_wing,
        &Form {
            seams_deg: [0.0, 0.0, 4.0, -5.0],
            ..facing(0.0, 1.0, 0.3, &|u, v| {
                let crest = ramp(v, 0.2, 0.75) * ramp(1.0 - v, 0.0, 0.25);
                by(0.0, 40.0 * bulge(v) * late_bulge(1.0 - u), 60.0 * crest * bulge(u))
            })
        },
    );
    let sill_frame = [
        l.whole(l.sill_foot),
        l.whole(l.sill_top),
        l.part(l.arch_front, sill_foot, sill),
        l.part(l.arch_rear, rear_sill_foot, rear_sill),
    ];
    pair(
        l,
        into,
        "sill",
        sill_frame,
        &Form {
            lines: (&[], &[0.35, 0.35, 0.7, 0.7]),
            seams_deg: [0.0, 4.0, 0.0, 0.0],
            ..facing(0.0, 1.0, 0.0, &|u, v| {
                by(0.0, 45.0 * ramp(v, 0.0, 0.45) * ramp(1.0 - v, 0.0, 0.25), 0.0) * bulge(u).sqrt()
            })
        },
    );
}

/// Outward in plan on a strip that wraps around an end of the vehicle, `u` from right to left.
fn around(u: f64, lengthwise: f64) -> Vector3 {
    let angle = (1.0 - 2.0 * u) * 1.35;
    by(lengthwise * angle.cos(), angle.sin(), 0.0)
}

fn nose(l: &Lines, into: &mut Vec<Sheet>) {
    let [foot, bumper, ..] = arch::FRONT;
    let frame = [l.whole(l.valance_front), l.whole(l.bumper_front), l.part(l.arch_front, foot, bumper)];
    across(
        l,
        into,
        "front bumper",
        frame,
        &Form {
            lines: (&[], &[0.3, 0.3, 0.75, 0.75]),
            ..facing(-1.0, 0.0, 0.0, &|u, v| {
                around(u, -1.0) * (55.0 * ramp(v, 0.0, 0.35) * ramp(1.0 - v, 0.0, 0.2) * bulge(u).sqrt())
            })
        },
    );
    let frame = [
        l.part(l.bumper_front, -LAMP_LOW, LAMP_LOW),
        l.part(l.bonnet_lip, -LAMP_HIGH, LAMP_HIGH),
        l.whole(l.lamp_front),
    ];
    let bar = [0.3, 0.3, 0.42, 0.42, 0.58, 0.58, 0.7, 0.7];
    across(
        l,
        into,
        "grille",
        frame,
        &Form {
            lines: (&[0.06, 0.12, 0.18, 0.82, 0.88, 0.94], &bar),
            seams_deg: [0.0, 0.0, 5.0, 5.0],
            ..facing(-1.0, 0.0, 0.0, &|u, v| {
                let in_bar = ramp(v, 0.32, 0.44) * ramp(1.0 - v, 0.32, 0.44);
                by(30.0 - 55.0 * in_bar, 0.0, 0.0)
                    * (ramp(u.min(1.0 - u), 0.06, 0.18) * ramp(v.min(1.0 - v), 0.0, 0.2))
            })
        },
    );
    let lamp = [
        l.part(l.bumper_front, -1.0, -LAMP_LOW),
        l.part(l.bonnet_lip, -1.0, -LAMP_HIGH),
        l.whole(l.wing_nose),
        l.whole(l.lamp_front),
    ];
    pair(
        l,
        into,
        "headlamp",
        lamp,
        &Form {
            seams_deg: [0.0, 0.0, -10.0, 5.0],
            ..facing(-1.0, 1.0, 0.2, &|u, v| by(-32.0, 26.0, 6.0) * (late_bulge(u) * bulge(v)))
        },
    );
    let frame =
        [l.whole(l.bonnet_lip), l.whole(l.windscreen_foot), l.part(l.belt, belt::NOSE, belt::WINDSCREEN)];
    let dome = [0.22, 0.22, 0.32, 0.32, 0.68, 0.68, 0.78, 0.78];
    across(
        l,
        into,
        "bonnet",
        frame,
        &Form {
            lines: (&dome, &[]),
            ..facing(0.0, 0.0, 1.0, &|u, v| {
                let dome = 22.0 * ramp(u.min(1.0 - u), 0.22, 0.32) * ramp(v, 0.0, 0.3);
                by(0.0, 0.0, 30.0 * bulge(u) * bulge(v) + dome * ramp(1.0 - v, 0.0, 0.3))
            })
        },
    );
}

fn cabin(l: &Lines, into: &mut Vec<Sheet>) {
    let frame =
        [l.whole(l.windscreen_foot), l.part(l.header, -PILLAR_TOP, PILLAR_TOP), l.whole(l.pillar_inner)];
    across(
        l,
        into,
        "windscreen",
        frame,
        &Form {
            seams_deg: [0.0, 0.0, -7.0, -7.0],
            ..facing(-0.5, 0.0, 1.0, &|u, v| by(-2.0, 0.0, 4.0) * (bulge(u) * bulge(v)))
        },
    );
    let pillar = [
        l.part(l.belt, belt::WINDSCREEN, belt::DOOR),
        l.part(l.header, -PILLAR_TOP, -1.0),
        l.whole(l.pillar_inner),
        l.whole(l.pillar_outer),
    ];
    pair(
        l,
        into,
        "windscreen pillar",
        pillar,
        &Form {
            seams_deg: [0.0, 0.0, -7.0, 5.0],
            ..facing(-0.3, 1.0, 0.5, &|u, v| by(-2.0, 4.0, 3.0) * (bulge(u) * bulge(v)))
        },
    );
    let frame = [l.whole(l.header), l.whole(l.roof_rear), l.whole(l.roof_side)];
    across(
        l,
        into,
        "roof",
        frame,
        &Form {
            lines: (&[0.14, 0.14, 0.86, 0.86], &[]),
            seams_deg: [-3.0, 0.0, -4.0, -4.0],
            ..facing(0.0, 0.0, 1.0, &|u, v| {
                by(
                    0.0,
                    0.0,
                    26.0 * bulge(u).sqrt() * bulge(v) + 14.0 * ramp(u.min(1.0 - u), 0.0, 0.14) * bulge(v),
                )
            })
        },
    );
    let window = [
        l.part(l.belt, belt::DOOR, belt::WINDOW_END),
        l.part(l.roof_side, 0.0, REAR_PILLAR_TOP),
        l.whole(l.pillar_outer),
        l.whole(l.rear_pillar_front),
    ];
    pair(
        l,
        into,
        "side window",
        window,
        &Form {
            seams_deg: [0.0, 0.0, 5.0, 7.0],
            ..facing(0.0, 1.0, 0.2, &|u, v| by(0.0, -10.0 * bulge(u) * bulge(v), 0.0))
        },
    );
    let pillar = [
        l.part(l.belt, belt::WINDOW_END, belt::DECK),
        l.part(l.roof_side, REAR_PILLAR_TOP, 1.0),
        l.whole(l.rear_pillar_front),
        l.whole(l.rear_pillar_rear),
    ];
    pair(
        l,
        into,
        "rear pillar",
        pillar,
        &Form {
            seams_deg: [0.0, 0.0, 7.0, 0.0],
            ..facing(0.0, 1.0, 0.2, &|u, v| by(3.0, 6.0, 0.0) * (bulge(u) * bulge(v)))
        },
    );
    let frame = [l.whole(l.deck_front), l.whole(l.roof_rear), l.whole(l.rear_pillar_rear)];
    across(
        l,
        into,
        "rear window",
        frame,
        &facing(1.0, 0.0, 0.3, &|u, v| by(-16.0, 0.0, 0.0) * (bulge(u) * bulge(v))),
    );
}

fn tail(l: &Lines, into: &mut Vec<Sheet>) {
    let frame = [l.whole(l.deck_front), l.whole(l.tail), l.part(l.belt, belt::DECK, belt::TAIL)];
    let flutes = [0.2, 0.2, 0.3, 0.3, 0.44, 0.44, 0.56, 0.56, 0.7, 0.7, 0.8, 0.8];
    across(
        l,
        into,
        "tonneau cover",
        frame,
        &Form {
            lines: (&flutes, &[]),
            ..facing(0.0, 0.0, 1.0, &|u, v| {
                let m = u.min(1.0 - u);
                let flute = ramp(m, 0.2, 0.3) * ramp(0.5 - m, 0.02, 0.08);
                by(0.0, 0.0, 12.0 * bulge(u) * bulge(v) + 20.0 * flute * ramp(v.min(1.0 - v), 0.0, 0.15))
            })
        },
    );
    let [.., bumper, foot] = arch::REAR;
    let frame = [l.whole(l.valance_rear), l.whole(l.bumper_rear), l.part(l.arch_rear, foot, bumper)];
    across(
        l,
        into,
        "rear bumper",
        frame,
        &Form {
            lines: (&[], &[0.3, 0.3, 0.75, 0.75]),
            ..facing(1.0, 0.0, 0.0, &|u, v| {
                around(u, 1.0) * (50.0 * ramp(v, 0.0, 0.35) * ramp(1.0 - v, 0.0, 0.2) * bulge(u).sqrt())
            })
        },
    );
    let frame = [
        l.part(l.bumper_rear, -LAMP_LOW, LAMP_LOW),
        l.part(l.tail, -LAMP_HIGH, LAMP_HIGH),
        l.whole(l.lamp_rear),
    ];
    across(
        l,
        into,
        "tailgate",
        frame,
        &Form {
            lines: (&[0.06, 0.13, 0.2, 0.8, 0.87, 0.94], &[0.25, 0.25, 0.4, 0.4]),
            seams_deg: [0.0, 0.0, 5.0, 5.0],
            ..facing(1.0, 0.0, 0.0, &|u, v| {
                by(-26.0 * ramp(v, 0.0, 0.3) * ramp(1.0 - v, 0.0, 0.5), 0.0, 0.0)
                    * ramp(u.min(1.0 - u), 0.06, 0.2)
            })
        },
    );
    let lamp = [
        l.part(l.bumper_rear, -1.0, -LAMP_LOW),
        l.part(l.tail, -1.0, -LAMP_HIGH),
        l.whole(l.wing_tail),
        l.whole(l.lamp_rear),
    ];
    pair(
        l,
        into,
        "tail lamp",
        lamp,
        &Form {
            seams_deg: [0.0, 0.0, -5.0, 5.0],
            ..facing(1.0, 1.0, 0.2, &|u, v| by(32.0, 26.0, 6.0) * (late_bulge(u) * bulge(v)))
        },
    );
}

fn wheelhouses(l: &Lines, into: &mut Vec<Sheet>) {
    let [front_start, front_end, rear_start, rear_end] = l.liner_ends.map(|id| l.whole(id));
    let front = [l.whole(l.arch_front), l.whole(l.liner_front), front_start, front_end];
    let rear = [l.whole(l.arch_rear), l.whole(l.liner_rear), rear_start, rear_end];
    pair(l, into, "front wheelhouse", front, &facing(0.0, 0.0, 1.0, &|_, _| by(0.0, 0.0, 0.0)));
    pair(l, into, "rear wheelhouse", rear, &facing(0.0, 0.0, 1.0, &|_, _| by(0.0, 0.0, 0.0)));
}
