//! The examples of `docs/tools.md` are read.

use std::collections::BTreeMap;
use std::path::Path;

use claymill_tooling::{KNOWN_FACTS, Library, MachineShape, Profiles};

const PAGE: &str = include_str!("../../../docs/tools.md");

#[test]
fn the_examples_of_the_page_are_read() {
    let blocks: Vec<&str> = PAGE.split("```toml\n").skip(1).filter_map(|b| b.split("```").next()).collect();
    let [tools, machine, process] = blocks[..] else { panic!("{} examples", blocks.len()) };
    let path = Path::new("fine-clay.toml");
    assert!(Library::parse(tools, path).unwrap().get("T7").is_some());
    assert_eq!(MachineShape::parse(machine.as_bytes(), path).unwrap().axis_count(), 4);
    let mut profiles = Profiles::shipped();
    let name = profiles.add(process, path).unwrap();
    let explained = profiles.resolve(&name, "clay", &BTreeMap::new()).unwrap().explain();
    // The lines that the page shows are those that are printed.
    let shown = PAGE.split("```\n").find(|block| block.starts_with("finish  spacing")).unwrap();
    for line in shown.lines() {
        assert!(explained.contains(line), "{line}\n{explained}");
    }
}

#[test]
fn the_page_has_every_fact_and_finding() {
    for (fact, _) in KNOWN_FACTS {
        assert!(PAGE.contains(&format!("`{fact}`")), "{fact}");
    }
}
