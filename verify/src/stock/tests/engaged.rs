//! Engagement angles against closed forms (B1 of the reference cases).

use claymill_toolpath::MoveKind;

use super::*;

fn engaged(first_y: f64, text: &str, height: f64) -> super::super::Engagement {
    // A wall is cut along y = 30 + R, then the tool goes along it with another offset.
    let moves = numbered(vec![
        straight(MoveKind::Cut, [-40.0, first_y, 5.0], [140.0, first_y, 5.0]),
        straight(MoveKind::Cut, [-40.0, 30.0, 5.0], [140.0, 30.0, 5.0]),
    ]);
    let check = check(block([0.0, 0.0, 0.0], [100.0, 60.0, 20.0]), &moves, &[tool("T1", text, None)]);
    check.engagement(1, 90.0, height, 2.0).unwrap().unwrap()
}

#[test]
fn b1_engagement_of_a_step_aside_and_of_a_slot() {
    // R5: radial depths 1 and 5; a slot where nothing was cut before.
    for (ae, exact) in
        [(1.0f64, 36.869_897_646), (5.0, 90.0), (2.4, (1.0f64 - 2.4 / 5.0).acos().to_degrees())]
    {
        let found = engaged(30.0 + ae, "flat:5", 2.0);
        assert!((found.angle_deg - exact).abs() < 0.05, "{ae}: {found:?}, exactly {exact}");
    }
    let slot = engaged(90.0, "flat:5", 2.0);
    assert!((slot.angle_deg - 180.0).abs() < 0.05, "{slot:?}");
    // A ball at half its height: the circle there has radius √(R² − (R − z)²).
    let ball = engaged(31.0, "ball:5", 2.0);
    let radius = (25.0f64 - 9.0).sqrt();
    let exact = (1.0 - 1.0 / radius).acos().to_degrees();
    assert!(
        (ball.radius_mm - radius).abs() < 1e-12 && (ball.angle_deg - exact).abs() < 0.05,
        "{ball:?} {exact}"
    );
    // Above the block and above the flutes there is nothing.
    assert_eq!(engaged(31.0, "flat:5", 16.0).angle_deg, 0.0);
}

/// Along a circle inside a wall that was cut with a smaller one: B2, concave, R5 ae1, the tip on ρ 10.
#[test]
fn b2_engagement_on_a_concave_wall() {
    let moves = numbered(vec![circle(9.0, 5.0), circle(10.0, 5.0)]);
    let stock = super::super::InitialStock::cylinder(Point3::origin(), Vector3::z(), 50.0, 20.0).unwrap();
    let check = check(stock, &moves, &[tool("T1", "flat:5", None)]);
    let found = check.engagement(1, 13.0, 2.0, 2.0).unwrap().unwrap();
    assert!((found.angle_deg - 44.765_084_671).abs() < 0.1, "{found:?}");
}

#[test]
fn the_largest_engagement_of_a_program_is_its_slot() {
    let moves = numbered(vec![
        straight(MoveKind::Cut, [20.0, 30.0, 5.0], [80.0, 30.0, 5.0]),
        straight(MoveKind::Cut, [20.0, 31.0, 5.0], [80.0, 31.0, 5.0]),
    ]);
    let check = check(block([0.0, 0.0, 0.0], [100.0, 60.0, 20.0]), &moves, &[tool("T1", "flat:5", None)]);
    let found = check.largest_engagement(&|| true).unwrap().unwrap();
    assert!((found.engagement.angle_deg - 180.0).abs() < 0.05 && found.at.move_seq == Some(0), "{found:?}");
    assert_eq!(found.poses, 2);
}
