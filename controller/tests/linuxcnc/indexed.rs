//! A machine whose A axis turns the part, with tools of different lengths, on a real control with its own kinematics.

use claymill_controller::{Dialect, Machine, MachineJob, post};
use claymill_nurbs::{Point3, Vector3};
use claymill_toolpath::{MoveKind, RotaryAxis};
use nalgebra::{Rotation3, Unit};

use crate::programs::{BAR_MM, HAL, INI, distance, executed, installed, moves_of_lines, samples};
use crate::{alone, job};

/// Two tools; the second one is 35 mm longer.
const TOOLS: &str = "T1 P1 Z40 D12 ;ball\nT2 P2 Z75 D12 ;ball\n";
/// A fourth axis for the machine of the other tests, and less to go up for a tool change.
const A_AXIS: &str = "
[AXIS_A]
MIN_LIMIT = -400
MAX_LIMIT = 400
MAX_VELOCITY = 360
MAX_ACCELERATION = 3600
[JOINT_3]
TYPE = ANGULAR
HOME = 0
MAX_VELOCITY = 360
MAX_ACCELERATION = 3600
MIN_LIMIT = -400
MAX_LIMIT = 400
FERROR = 10
MIN_FERROR = 5
HOME_SEQUENCE = 3
";

fn with(text: &str, from: &str, to: &str) -> String {
    assert!(text.contains(from), "`{from}` is not in\n{text}");
    text.replace(from, to)
}

#[test]
fn executed_positions_of_an_indexed_part_are_on_the_model() {
    let _alone = alone();
    if !installed("linuxcnc") {
        return;
    }
    let direction = Vector3::x();
    let table = RotaryAxis {
        travel_deg: [-400.0, 400.0],
        direction: direction.into(),
        point_mm: [0.0; 3],
        turns_table: true,
        max_deg_per_min: None,
    };
    let machine = Machine { rotary: [("a".to_owned(), table)].into(), ..Machine::default() };
    // The last curves of the setup beside are cut with the second tool.
    let curves = job::curves();
    let mut program = job::program(&curves);
    let last = program.moves.iter().map(|m| m.pass).max().unwrap();
    // A tool ends with a cut and begins with the way down, as tools of different operations do.
    program.moves.retain(|m| m.pass != last || matches!(m.kind, MoveKind::LeadIn | MoveKind::Cut));
    program.moves.iter_mut().filter(|m| m.pass == last).for_each(|m| m.tool = "T2".into());
    let mut record = job::record();
    let mut second = record.tools[0].clone();
    second.id = "T2".into();
    record.tools.push(second);
    record.model.box_mm = [0.0, -60.0, -80.0, 80.0, 60.0, 50.0];
    let job = MachineJob::new(record, &program, &machine).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("part.ngc");
    post(&job, Dialect::LinuxCnc29, &machine, &out, &|_| ()).unwrap();
    let text = std::fs::read_to_string(&out).unwrap();
    assert!(
        text.contains("T1 M6") && text.contains("T2 M6") && text.contains("G0 A") && !text.contains("\nM0"),
        "{text}"
    );
    let ini = with(INI, "COORDINATES = X Y Z", "COORDINATES = X Y Z A");
    let ini = with(&ini, "KINEMATICS = trivkins", "KINEMATICS = trivkins coordinates=xyza");
    let ini = with(&with(&ini, "JOINTS = 3", "JOINTS = 4"), "MAX_LIMIT = 6000", "MAX_LIMIT = 400") + A_AXIS;
    let hal = HAL.to_owned() + "net Apos joint.3.motor-pos-cmd => joint.3.motor-pos-fb\n";
    let (trace, said) = executed(folder.path(), &out, &ini, &hal, TOOLS);
    let line_of_move = moves_of_lines(&out);
    let cuts: Vec<_> = program
        .moves
        .iter()
        .filter(|m| m.kind == MoveKind::Cut)
        .map(|m| (m.seq, m.setup.as_str(), Vector3::from(m.axis_start), samples(&m.curve().unwrap())))
        .collect();
    let mut worst = vec![(0, 0.0_f64); cuts.len()];
    let axis = Unit::new_normalize(direction);
    for [line, x, y, z, a, length] in trace {
        let Some(Some(seq)) = (line as usize).checked_sub(1).and_then(|l| line_of_move.get(l)) else {
            continue;
        };
        let Some(i) = cuts.iter().position(|(s, ..)| s == seq) else { continue };
        // The part goes back by what the table turned it; X and Y of the machine run against the model's.
        let tip = Rotation3::from_axis_angle(&axis, -a.to_radians()) * Point3::new(x, y, z - length);
        let p = Point3::new(-tip.x, -tip.y, tip.z);
        let (_, _, up, curve) = &cuts[i];
        // The next pass is announced while the tool still comes down onto its start.
        let above = |end: &Point3| {
            let off = p - end;
            off.dot(up) > 0.0 && (off - up * off.dot(up)).norm() < 2e-3
        };
        if above(&curve[0]) || above(&curve[curve.len() - 1]) {
            continue;
        }
        let Some(far) = distance(curve, &p) else { continue };
        let (count, largest) = worst[i];
        worst[i] = (count + 1, largest.max(far));
    }
    for ((seq, setup, ..), (count, far)) in cuts.iter().zip(&worst) {
        eprintln!("move {seq} in {setup}: {count} samples, {far:.6} mm from the curve");
    }
    for ((seq, ..), (count, far)) in cuts.iter().zip(&worst) {
        assert!(*count >= 5, "move {seq} was hardly seen:\n{said}");
        assert!(*far <= BAR_MM, "move {seq}: {far} mm");
    }
}
