//! A setup off the axes as the control's tilted plane: posted, and verified from the program in model coordinates.

use std::fs;

use crate::run::{panel, run, run_without_adapter};
use crate::scratch;

#[test]
fn tilted_setups_are_posted_and_verified_from_their_programs() {
    let folder = scratch();
    let folder = folder.path();
    panel(folder);
    let job = [
        "plan",
        "panel.igs",
        "--tool",
        "ball:10",
        "--scallop",
        "1",
        "--setup",
        "lean:0,-0.3,0.9",
        "-o",
        "job",
    ];
    let made = run_without_adapter(folder, job);
    assert_eq!(made.code, Some(0), "{made:?}");
    for (dialect, plane) in [("siemens", "CYCLE800("), ("fanuc", "G68.2 "), ("heidenhain", "PLANE SPATIAL ")]
    {
        let out = format!("{dialect}.nc");
        let posted = run(folder, ["post", "job", "--to", dialect, "--tilt", "-o", &out]);
        assert_eq!(posted.code, Some(0), "{dialect}: {posted:?}");
        assert!(posted.stderr.contains("plane tilted by"), "{dialect}: {posted:?}");
        assert!(fs::read_to_string(folder.join(&out)).unwrap().contains(plane), "{dialect}");
        let verified = run(folder, ["verify", "job", "--program", &out]);
        assert_eq!(verified.code, Some(0), "{dialect}: {verified:?}");
    }
    let plain = run(folder, ["post", "job", "--to", "g1", "--tilt", "-o", "g1.nc"]);
    assert!(plain.code == Some(0) && plain.stderr.contains("no tilted planes"), "{plain:?}");
    // The machine file may ask for it too, and a head that does not come there is named.
    let file = "[tilt]\nby = \"control\"\n[rotary.a]\ntravel_deg = [-5, 5]\ndirection = [1, 0, 0]\n";
    fs::write(folder.join("short.toml"), file).unwrap();
    let refused =
        run(folder, ["post", "job", "--to", "siemens", "--machine", "short.toml", "-o", "short.mpf"]);
    assert!(refused.code == Some(1) && refused.stderr.contains("head-limit: setup lean"), "{refused:?}");
    fs::write(folder.join("odd.toml"), "[spindle]\nmin_rpm = 900\nmax_rpm = 100\n").unwrap();
    let refused = run(folder, ["post", "job", "--to", "siemens", "--machine", "odd.toml", "-o", "odd.mpf"]);
    assert!(refused.code == Some(2) && refused.stderr.contains("min_rpm below max_rpm"), "{refused:?}");
}
