//! Rules of the tree that no compiler holds: see `ARCHITECTURE.md` and `STYLE.md`.

mod documents;
mod imports;

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// Lines of a source file at most.
const LONGEST: usize = 600;
/// Files of a crate that import each other in a circle at most: none of them can be understood alone.
const LARGEST_CIRCLE: usize = 3;
/// The crates, each with those of the workspace that it may build on. Anything else is a new direction: decide, then
/// write it here and in `ARCHITECTURE.md`.
const DIRECTIONS: [(&str, &[&str]); 21] = [
    ("elementary", &[]),
    ("nurbs", &["elementary"]),
    ("exchange", &["nurbs"]),
    ("surface-merge", &["nurbs"]),
    ("toolpath", &["nurbs"]),
    ("tooling", &["toolpath"]),
    ("motion", &["nurbs"]),
    ("contact", &["nurbs", "toolpath"]),
    ("stock", &["nurbs", "toolpath"]),
    ("clearing", &["nurbs", "contact", "toolpath"]),
    ("reach", &["nurbs", "contact", "toolpath"]),
    ("paths", &["nurbs", "motion", "contact", "stock", "surface-merge", "toolpath"]),
    ("store", &["toolpath"]),
    // Not `paths`: what is verified must not be computed by the code that is judged.
    ("verify", &["nurbs", "exchange", "toolpath"]),
    ("controller", &["nurbs", "motion", "toolpath"]),
    ("viewer", &["nurbs", "toolpath", "verify"]),
    ("window", &["nurbs", "toolpath", "verify", "viewer"]),
    ("models", &["nurbs", "exchange"]),
    ("tests", &["nurbs", "toolpath"]),
    (
        "claymill",
        &[
            "nurbs",
            "exchange",
            "stock",
            "surface-merge",
            "tooling",
            "toolpath",
            "contact",
            "clearing",
            "reach",
            "paths",
            "verify",
            "controller",
            "viewer",
        ],
    ),
    (
        "cli",
        &[
            "claymill",
            "nurbs",
            "exchange",
            "surface-merge",
            "tooling",
            "toolpath",
            "reach",
            "paths",
            "store",
            "verify",
            "controller",
            "viewer",
            "window",
            "models",
        ],
    ),
];

/// The workspace's folder.
fn root() -> &'static Path {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/.."))
}

/// Files with this extension under a folder, by their names in the workspace, without what is built.
fn files(folder: &Path, extension: &str) -> Vec<(PathBuf, String)> {
    let mut found = Vec::new();
    let mut folders = vec![folder.to_owned()];
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(&folder).unwrap() {
            let path = entry.unwrap().path();
            let name = path.file_name().unwrap().to_string_lossy().into_owned();
            if path.is_dir() && !name.starts_with('.') && !["target", "out"].contains(&name.as_str()) {
                folders.push(path);
            } else if path.extension().is_some_and(|e| e == extension) {
                let text = std::fs::read_to_string(&path).unwrap();
                found.push((path.strip_prefix(root()).unwrap().to_owned(), text));
            }
        }
    }
    found.sort();
    found
}

fn crate_names() -> BTreeSet<String> {
    let manifest = std::fs::read_to_string(root().join("Cargo.toml")).unwrap();
    let members = manifest.split_once("members = [").unwrap().1.split_once(']').unwrap().0;
    let names = members.split(',').map(|m| m.trim().trim_matches('"').to_owned());
    names.filter(|m| !m.is_empty()).collect()
}

/// The crates of the workspace that a manifest names under `[dependencies]`.
fn dependencies(manifest: &str) -> BTreeSet<String> {
    let (_, rest) = manifest.split_once("[dependencies]").unwrap_or_default();
    let table = rest.split("\n[").next().unwrap_or_default();
    let names = table.lines().filter_map(|line| line.split(['.', ' ', '=']).next());
    // The package of the folder `claymill` has no prefix.
    let names =
        names.filter_map(|name| (name == "claymill").then_some(name).or(name.strip_prefix("claymill-")));
    names.map(str::to_owned).collect()
}

#[test]
fn crates_build_on_each_other_in_the_directions_of_the_list() {
    let listed: BTreeSet<String> = DIRECTIONS.iter().map(|(name, _)| (*name).to_owned()).collect();
    assert_eq!(listed, crate_names());
    for (name, allowed) in DIRECTIONS {
        let manifest = std::fs::read_to_string(root().join(name).join("Cargo.toml")).unwrap();
        let allowed: BTreeSet<String> = allowed.iter().map(|a| (*a).to_owned()).collect();
        assert_eq!(dependencies(&manifest), allowed, "{name}");
    }
}

#[test]
fn files_are_short_enough_to_be_read() {
    let sources = files(root(), "rs");
    assert!(sources.len() > 300);
    let long: Vec<_> = (sources.iter())
        .map(|(path, text)| (path, text.lines().count()))
        .filter(|(_, lines)| *lines > LONGEST)
        .collect();
    assert!(long.is_empty(), "more than {LONGEST} lines: {long:?}");
}

#[test]
fn every_source_file_says_what_it_is_for() {
    for name in crate_names() {
        let silent: Vec<_> = files(&root().join(name).join("src"), "rs")
            .into_iter()
            .filter(|(_, text)| !text.starts_with("//!"))
            .map(|(path, _)| path)
            .collect();
        assert!(silent.is_empty(), "no `//!` line at the top: {silent:?}");
    }
}

#[test]
fn files_do_not_import_each_other_in_large_circles() {
    let mut arrows = 0;
    for name in crate_names() {
        let graph = imports::Graph::of(&root().join(&name).join("src"));
        arrows += graph.arrows();
        for circle in graph.circles() {
            assert!(circle.len() <= LARGEST_CIRCLE, "{name}: {circle:?}");
        }
    }
    // The imports are found at all.
    assert!(arrows > 1000, "{arrows}");
}
