//! Drawings of tools: the silhouette has the tool's measures, the document is well formed.

use claymill_tooling::{Library, LibraryTool, Silhouette, tool_svg};

#[test]
fn the_silhouette_has_the_measures_of_the_tool() {
    let library = Library::shipped();
    let ball = library.get("T7").unwrap();
    let shape = Silhouette::of(ball);
    let top = |part: &[[f64; 2]]| part.iter().map(|p| p[1]).fold(0.0, f64::max);
    assert_eq!((top(&shape.flutes), top(&shape.shank)), (60.0, 110.0));
    assert_eq!(shape.height_mm(), ball.length_in_spindle_mm().unwrap());
    assert_eq!(shape.radius_mm(), 31.5);
    // On the ball: |p − (0, 10)| = 10 below its centre.
    for [r, z] in shape.flutes.iter().filter(|p| p[1] < 10.0 && p[0] > 0.0) {
        approx::assert_relative_eq!(r.hypot(z - 10.0), 10.0, max_relative = 1e-9);
    }
}

#[test]
fn tapers_flats_and_thick_shanks_are_drawn() {
    let drawn = |tool: &str| {
        let tool = LibraryTool {
            stick_out_mm: Some(60.0),
            ..LibraryTool::new("T1", "a <b> & \"c\"", tool.parse().unwrap())
        };
        let svg = tool_svg(&tool);
        assert!(
            svg.contains("a &lt;b&gt; &amp; &quot;c&quot;") && !svg.contains("NaN") && !svg.contains("inf"),
            "{svg}"
        );
        Silhouette::of(&tool)
    };
    let bull = drawn("bull:10:2");
    assert!(bull.flutes.contains(&[8.0, 0.0]) && bull.flutes.contains(&[10.0, 2.0]), "{:?}", bull.flutes);
    let flat = drawn("flat:5");
    assert!(flat.flutes.contains(&[5.0, 0.0]), "{:?}", flat.flutes);
    let neck = drawn("ball:5,length:20,shank:16");
    assert_eq!((neck.radius_mm(), neck.height_mm()), (8.0, 60.0));
    assert_eq!(neck.shank, [[0.0, 20.0], [8.0, 20.0], [8.0, 60.0], [0.0, 60.0]]);
    assert!(neck.flutes.iter().all(|[r, z]| *r <= 5.0 && *z <= 20.0));
    let cone = drawn("ball:3,taper:10,length:50,shank:30");
    // The flank at 30 mm, by the tangent of the taper.
    let sides = "ball:3,taper:10,length:50,shank:30".parse::<claymill_toolpath::Tool>().unwrap().sides();
    let [from, _] = sides[0];
    let expected = from[1] + (50.0 - from[0]) * 10_f64.to_radians().tan();
    assert!(cone.flutes.iter().any(|p| (p[0] - expected).abs() < 1e-9), "{:?} {expected}", cone.flutes);
}

#[test]
fn every_shipped_tool_has_a_document_whose_tags_are_closed() {
    for tool in &Library::shipped().tools {
        let svg = tool_svg(tool);
        assert_eq!(svg.matches("<text").count(), svg.matches("</text>").count());
        assert_eq!(svg.matches("<polygon").count(), 4, "{}: flutes, shank, two sections", tool.id);
        for name in ["flutes ", "stick-out ", "in spindle ", "⌀"] {
            assert!(svg.contains(name), "{}: {name}", tool.id);
        }
    }
}
