//! Tools with a taper and a shank of their own: planned so that nothing above the ball touches, and found where it does; and
//! ends of all kinds at rest.

use std::fs;
use std::path::Path;

use serde_json::{Value, json};

use crate::obstacle::block;
use crate::run::{panel, run, run_without_adapter};
use crate::scratch;

fn read(folder: &Path, file: &str) -> Value {
    serde_json::from_slice(&fs::read(folder.join(file)).unwrap()).unwrap()
}

#[test]
fn what_stands_above_the_ball_is_planned_around_and_verified() {
    let folder = scratch();
    let folder = folder.path();
    panel(folder);
    // A post that is higher than the flutes are long.
    fs::write(folder.join("post.stl"), block([-20.0, -15.0, -40.0], [20.0, 15.0, 120.0])).unwrap();
    let plan = |tool: &str, out: &str| {
        let job = ["plan", "panel.igs", "--scallop", "0.3", "--check", "post.stl"];
        run_without_adapter(folder, job.iter().chain(&["--tool", tool, "-o", out]))
    };
    let thick = "ball:8,taper:4,length:50,shank:36";
    for (tool, out) in [(thick, "thick"), ("ball:8", "plain")] {
        let planned = plan(tool, out);
        assert_eq!(planned.code, Some(0), "{planned:?}");
    }
    let found = read(folder, "thick/verify.json");
    assert_eq!(found["shank"]["touching"], 0, "{found}");
    assert_eq!(found["rapids"]["touching"], 0, "{found}");
    assert!(found["shank"]["moves"].as_u64().unwrap() > 50);
    let toml = fs::read_to_string(folder.join("thick/job.toml")).unwrap();
    assert!(toml.contains(&format!("tool = \"{thick}\"")), "{toml}");
    // Beside the post the thick shank cannot come down to the panel: the ball stays 18 mm away there, not 8 and the 1 mm that it
    // keeps from obstacles.
    let nearest = |out: &str| {
        let moves = claymill_toolpath::read_moves(&folder.join(out)).unwrap().moves;
        let low = moves.iter().flat_map(|m| &m.points).filter(|p| p[2] < 60.0 && p[1].abs() < 15.0);
        low.map(|p| p[0].abs() - 20.0).fold(f64::INFINITY, f64::min)
    };
    let (plain, beside) = (nearest("plain"), nearest("thick"));
    assert!(plain < 9.1 && beside > 17.99, "{plain} {beside}");

    // What was written is read again.
    let again = run(folder, ["verify", "thick"]);
    assert_eq!(again.code, Some(0), "{again:?}");
    assert!(read(folder, "thick/job.json")["tools"][0]["taper_deg"] == 4.0);

    // The same moves with a thicker shank than they were planned for.
    let path = folder.join("plain/job.json");
    let mut job = read(folder, "plain/job.json");
    for tool in ["/request/tool", "/tools/0"] {
        let tool = job.pointer_mut(tool).and_then(Value::as_object_mut).unwrap();
        tool.extend([
            ("flute_length_mm".to_owned(), json!(50.0)),
            ("shank_diameter_mm".to_owned(), json!(36.0)),
        ]);
    }
    fs::write(&path, job.to_string()).unwrap();
    let entered = run(folder, ["verify", "plain"]);
    assert_eq!(entered.code, Some(3), "{entered:?}");
    assert!(entered.stderr.contains("FAILED: the shank enters the model on"), "{entered:?}");
}

#[test]
fn tools_that_make_no_sense_are_refused_by_name() {
    let folder = scratch();
    let folder = folder.path();
    panel(folder);
    for (tool, said) in [
        ("bull:5:6", "a corner radius of 6 mm does not suit a tool of radius 5 mm"),
        ("ball:5,taper:3", "needs the height above the tip where the shank begins"),
        ("drill:5", "is not a tool's end"),
    ] {
        let refused = run(folder, ["plan", "panel.igs", "--tool", tool, "-o", "out"]);
        assert_eq!(refused.code, Some(2), "{refused:?}");
        let words = refused.stderr.split_whitespace().collect::<Vec<_>>().join(" ");
        assert!(words.contains(said), "{words}");
        assert!(!folder.join("out").exists());
    }
}

#[test]
fn a_tool_of_any_kind_comes_to_rest_and_says_on_what() {
    let folder = scratch();
    let folder = folder.path();
    panel(folder);
    let rests = |tool: &str| -> Value {
        let at = ["--at", "40,30,0", "--at=-75.5,20,0", "--at", "9000,0,0"];
        let run = run(
            folder,
            ["drop", "panel.igs", "--json", "--up", "+z", "--length", "+x", "--tool", tool]
                .into_iter()
                .chain(at),
        );
        assert_eq!(run.code, Some(0), "{run:?}");
        serde_json::from_str(&run.stdout).unwrap()
    };
    let tools = ["ball:10", "bull:10:6", "bull:10:2", "flat:10"].map(rests);
    for place in 0..2 {
        let tips: Vec<f64> = tools.iter().map(|t| t[place]["tip_mm"][2].as_f64().unwrap()).collect();
        // Each has the one before inside.
        assert!(tips.is_sorted() && tips[0] < tips[3], "{tips:?}");
        for rest in tools.iter().map(|t| &t[place]) {
            assert!(rest["gap_mm"].as_f64().unwrap() < 2e-5 && rest["part"] == "end", "{rest}");
            // It touches no further away than its radius, nor below its tip.
            let [p, tip] =
                ["contact_mm", "tip_mm"].map(|name| [0, 1, 2].map(|k| rest[name][k].as_f64().unwrap()));
            assert!((p[0] - tip[0]).hypot(p[1] - tip[1]) <= 10.0 && p[2] > tip[2] - 2e-5, "{rest}");
        }
    }
    assert!(tools.iter().all(|t| t[2].is_null()));
    let refused = run(folder, ["drop", "panel.igs", "--tool", "ball:3", "--at", "1,2"]);
    assert_eq!(refused.code, Some(2), "{refused:?}");
}
