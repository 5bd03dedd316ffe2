//! What comments and pages refer to is there.

use std::collections::BTreeSet;
use std::path::Path;

use super::{files, root};

/// The numbered sections of `docs/theory.md`: `6.3` of the heading `### 6.3 Certificates`.
fn sections() -> BTreeSet<String> {
    let theory = std::fs::read_to_string(root().join("docs/theory.md")).unwrap();
    let headings = theory.lines().filter_map(|line| line.strip_prefix('#'));
    let numbers = headings.filter_map(|line| line.trim_start_matches('#').split_whitespace().next());
    numbers
        .map(|n| n.trim_end_matches('.').to_owned())
        .filter(|n| n.starts_with(|c: char| c.is_ascii_digit()))
        .collect()
}

#[test]
fn cited_sections_of_the_theory_exist() {
    let sections = sections();
    let mut cited = 0;
    for (path, text) in files(root(), "rs") {
        for (at, _) in text.match_indices('§') {
            let before = text[..at].trim_end_matches(|c: char| c.is_whitespace() || c == '/' || c == '!');
            let number: String =
                text[at + '§'.len_utf8()..].chars().take_while(|c| c.is_ascii_digit() || *c == '.').collect();
            let number = number.trim_end_matches('.');
            if before.ends_with("theory.md") {
                assert!(
                    sections.contains(number),
                    "{}: docs/theory.md has no section {number}",
                    path.display()
                );
                cited += 1;
            }
        }
        assert!(!text.contains(concat!("geometry", ".md")), "{}: cite docs/theory.md", path.display());
    }
    assert!(cited > 10, "{cited}");
}

/// The anchor that a heading has on a page.
fn anchor(heading: &str) -> String {
    let heading = heading.trim_start_matches('#').trim().to_lowercase();
    let kept = heading.chars().filter(|c| c.is_alphanumeric() || [' ', '-', '_'].contains(c));
    kept.map(|c| if c == ' ' { '-' } else { c }).collect()
}

#[test]
fn links_between_pages_lead_somewhere() {
    let pages = files(root(), "md");
    let mut followed = 0;
    for (path, text) in &pages {
        for part in text.split("](").skip(1) {
            let Some(target) = part.split([')', ' ']).next().filter(|t| !t.contains("://")) else { continue };
            let (file, place) = target.split_once('#').unwrap_or((target, ""));
            let file = match file {
                "" => root().join(path),
                file => root().join(path).parent().unwrap_or(Path::new("")).join(file),
            };
            assert!(file.exists(), "{}: {target} is not there", path.display());
            if !place.is_empty() {
                let there = std::fs::read_to_string(&file).unwrap();
                let known = there.lines().filter(|l| l.starts_with('#')).any(|l| anchor(l) == place);
                assert!(known, "{}: {target} has no such heading", path.display());
            }
            followed += 1;
        }
    }
    assert!(followed > 20, "{followed}");
}
