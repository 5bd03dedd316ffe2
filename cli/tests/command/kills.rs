//! `claymill control` and `claymill stream` are killed in turns, at any moment: the machine executes the job once.

use std::fs::{File, OpenOptions};
use std::net::TcpListener;
use std::path::Path;
use std::process::{Child, Stdio};
use std::time::{Duration, Instant};

use rand::{Rng, SeedableRng};
use serde_json::Value;

use crate::machine::{far, tip, workshop};
use crate::run::claymill;
use crate::scratch;

/// A side is killed when it has lived for less than this, ms.
const LIVES_MS: u64 = 150;

fn start(folder: &Path, args: &[&str], said: &str) -> Child {
    let mut command = claymill();
    let said = OpenOptions::new().create(true).append(true).open(folder.join(said)).unwrap();
    command.current_dir(folder).args(args).stdout(said).stderr(File::create(folder.join("errors")).unwrap());
    command.stdin(Stdio::null()).spawn().unwrap()
}

fn kill(kills: u64, tcp: bool) {
    let folder = scratch();
    let folder = folder.path();
    let moves = workshop(folder);
    let free = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = free.local_addr().unwrap().to_string();
    drop(free);
    let to = if tcp { format!("tcp:{address}") } else { "shm:queue".into() };
    let stream = ["stream", "job", "--to", &to, "--secret", "secret"];
    let control = |more: &[&str]| {
        let mut args = vec!["control", "--queue", "queue", "--json", "--machine", "quick.toml"];
        if tcp {
            args.extend(["--listen", &address, "--secret", "secret"]);
        }
        args.extend(more);
        start(folder, &args, "log")
    };
    let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(kills);
    let mut sides = [start(folder, &stream, "streamed"), control(&[])];
    for i in 0..kills {
        std::thread::sleep(Duration::from_millis(rng.random_range(5..LIVES_MS)));
        let side = (i % 2) as usize;
        sides[side].kill().unwrap();
        sides[side].wait().unwrap();
        sides[side] = if side == 0 { start(folder, &stream, "streamed") } else { control(&[]) };
    }
    // The last one need not keep to real time.
    sides[1].kill().unwrap();
    sides[1].wait().unwrap();
    sides[1] = control(&["--fast"]);
    let begun = Instant::now();
    for side in [1, 0] {
        loop {
            if let Some(status) = sides[side].try_wait().unwrap() {
                // A sender may not have heard of the end before the machine had gone.
                assert!(
                    status.success() || (tcp && side == 0),
                    "{:?}",
                    std::fs::read_to_string(folder.join("errors"))
                );
                break;
            }
            if tcp && side == 0 {
                let _ = sides[0].kill();
            }
            assert!(begun.elapsed() < Duration::from_secs(240), "it never ends");
            std::thread::sleep(Duration::from_millis(20));
        }
    }
    let log = std::fs::read_to_string(folder.join("log")).unwrap();
    // A line that its writer was killed in is none.
    let lines: Vec<Value> = log.lines().filter_map(|l| serde_json::from_str(l).ok()).collect();
    assert!(lines.iter().all(|l| l.get("fault").is_none()));
    // What is no path: all of it, in order; what was executed and not noted any more when the kill came, is told again.
    let executed: Vec<u64> =
        lines.iter().filter(|l| l.get("executed").is_some()).map(|l| l["seq"].as_u64().unwrap()).collect();
    let mut once = executed.clone();
    once.dedup();
    assert!(once.windows(2).all(|w| w[0] < w[1]), "{executed:?}");
    assert!(executed.len() - once.len() <= kills as usize);
    assert!(lines.iter().any(|l| l["executed"] == "End"));
    // The paths: without a jump, without a repetition, to the end.
    let tips: Vec<[f64; 3]> = lines.iter().filter_map(|l| l.get("tip").map(tip)).collect();
    let steps = || tips.windows(2).map(|w| far(w[0], w[1]));
    let step_mm = 60_000.0 / 60.0 * 1e-3;
    let farthest = steps().fold(0.0, f64::max);
    assert!(farthest <= step_mm * 1.01, "{farthest} mm in a cycle");
    let points = |m: &Value| m["points"].as_array().unwrap().iter().map(tip).collect::<Vec<_>>();
    let end = *points(moves.last().unwrap()).last().unwrap();
    assert!(far(tips[tips.len() - 1], end) < 1e-3);
    let seqs: Vec<u64> =
        lines.iter().filter(|l| l.get("tip").is_some()).map(|l| l["seq"].as_u64().unwrap()).collect();
    assert!(seqs.windows(2).all(|w| w[0] <= w[1]), "a record comes again");
    let way_mm: f64 = steps().sum();
    // Control polygons are longer than their curves, by little here.
    let polygons_mm: f64 =
        moves.iter().flat_map(|m| points(m).windows(2).map(|w| far(w[0], w[1])).collect::<Vec<_>>()).sum();
    assert!(way_mm <= polygons_mm + 2.0 * kills as f64 * step_mm, "{way_mm} of {polygons_mm} mm");
    assert!(way_mm > 0.98 * polygons_mm, "{way_mm} of {polygons_mm} mm");
    let again = lines.iter().filter(|l| l.get("told_again").is_some()).count();
    eprintln!(
        "{to}: {kills} kills, {} set points, {way_mm:.0} mm, {} orders executed, {} of them told twice, {again} told again \
         after a start",
        tips.len(),
        once.len(),
        executed.len() - once.len()
    );
}

#[test]
fn a_few_kills_of_either_command_over_a_queue_in_memory() {
    kill(8, false);
}

#[test]
fn a_few_kills_of_either_command_over_a_connection() {
    kill(8, true);
}

#[test]
#[ignore = "100 kills, and what they take: half a minute on a machine without other work"]
fn a_hundred_kills_of_either_command_over_a_queue_in_memory() {
    kill(100, false);
}

#[test]
#[ignore = "100 kills, and what they take: half a minute on a machine without other work"]
fn a_hundred_kills_of_either_command_over_a_connection() {
    kill(100, true);
}
