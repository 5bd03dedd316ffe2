//! Runs every example as `cargo run --example` does without arguments.
#![allow(dead_code, reason = "tests call `run`, not `main`")]

#[path = "../examples/drop_a_tool.rs"]
mod drop_a_tool;
#[path = "../examples/plan_and_verify.rs"]
mod plan_and_verify;
#[path = "../examples/post_a_program.rs"]
mod post_a_program;
#[path = "../examples/read_and_merge.rs"]
mod read_and_merge;
#[cfg(feature = "viewer")]
#[path = "../examples/render.rs"]
mod render;

#[test]
fn a_model_is_read_and_merged() {
    read_and_merge::run(None).unwrap();
}

#[test]
fn a_tool_is_dropped() {
    drop_a_tool::run(None).unwrap();
}

#[test]
fn a_job_is_planned_verified_and_written() {
    let place = tempfile::tempdir().unwrap();
    let out = place.path().join("job");
    plan_and_verify::run(None, Some(out.clone())).unwrap();
    let folder = claymill::JobFolder::open(&out).unwrap();
    assert_eq!(*folder.standing(), claymill::Standing::Passed);
}

#[test]
fn a_verified_job_is_posted() {
    let place = tempfile::tempdir().unwrap();
    let program = place.path().join("program.ngc");
    post_a_program::run(None, Some(program.clone())).unwrap();
    assert!(std::fs::read_to_string(program).unwrap().lines().count() > 100);
}

#[test]
#[cfg(feature = "viewer")]
fn passes_are_drawn() {
    render::run(None, None).unwrap();
}
