//! Which files of a crate import which, as far as paths that begin with `crate`, `super` or `self` say.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

/// A module by its path in the crate; that of the crate itself is empty.
type Module = Vec<String>;

/// Files and the files that they import.
pub(super) struct Graph {
    imports: BTreeMap<Module, BTreeSet<Module>>,
}

impl Graph {
    /// The files of a `src` folder. Their tests are left out, and so is what they import of the crate's root: a
    /// root that says what is public imports everything.
    pub(super) fn of(src: &Path) -> Self {
        let texts: BTreeMap<Module, String> = super::files(src, "rs")
            .into_iter()
            .map(|(path, text)| (module(src, &super::root().join(path)), text))
            .filter(|(module, _)| module.last().is_none_or(|name| !name.ends_with("tests")))
            .collect();
        let known: BTreeSet<Module> = texts.keys().cloned().collect();
        let imports = texts.into_iter().map(|(module, text)| {
            let paths = paths(&without_tests_and_comments(&text), &module);
            let of: BTreeSet<Module> = paths.into_iter().filter_map(|path| file_of(path, &known)).collect();
            let of = of.into_iter().filter(|m| !m.is_empty() && *m != module).collect();
            (module, of)
        });
        Graph { imports: imports.collect() }
    }

    /// Imports between two files.
    pub(super) fn arrows(&self) -> usize {
        self.imports.values().map(BTreeSet::len).sum()
    }

    /// Sets of more than one file each of which reaches all others of the set.
    pub(super) fn circles(&self) -> Vec<Vec<String>> {
        let reached: BTreeMap<&Module, BTreeSet<&Module>> =
            self.imports.keys().map(|module| (module, self.reached_from(module))).collect();
        let mut circles = BTreeSet::new();
        for (module, of) in &reached {
            let circle: Vec<String> = (of.iter())
                .filter(|other| reached[**other].contains(module))
                .map(|other| other.join("::"))
                .collect();
            if circle.len() > 1 {
                circles.insert(circle);
            }
        }
        circles.into_iter().collect()
    }

    fn reached_from<'a>(&'a self, module: &'a Module) -> BTreeSet<&'a Module> {
        let (mut reached, mut waiting) = (BTreeSet::new(), vec![module]);
        while let Some(module) = waiting.pop() {
            waiting.extend(self.imports[module].iter().filter(|m| reached.insert(*m)));
        }
        reached
    }
}

/// The module of a file.
fn module(src: &Path, file: &Path) -> Module {
    let inside = file.strip_prefix(src).unwrap().with_extension("");
    let mut names: Module = inside.iter().map(|name| name.to_string_lossy().into_owned()).collect();
    if names.last().is_some_and(|name| ["lib", "main", "mod"].contains(&name.as_str())) {
        names.pop();
    }
    names
}

/// The file that a path leads into: that of the longest part of it that is a module.
fn file_of(mut path: Module, known: &BTreeSet<Module>) -> Option<Module> {
    while !known.contains(&path) {
        path.pop()?;
    }
    Some(path)
}

/// The text up to its module of tests, without comments.
fn without_tests_and_comments(text: &str) -> String {
    let mut kept = String::new();
    let mut lines = text.lines().peekable();
    while let Some(line) = lines.next() {
        if line == "#[cfg(test)]" && lines.peek().is_some_and(|next| next.starts_with("mod tests {")) {
            break;
        }
        kept.push_str(line.split("//").next().unwrap_or_default());
        kept.push('\n');
    }
    kept
}

/// All paths in a file's text that begin with `crate`, `super` or `self`, from the crate's root.
fn paths(text: &str, module: &Module) -> Vec<Module> {
    let mut found = Vec::new();
    for keyword in ["crate::", "super::", "self::"] {
        for (at, _) in text.match_indices(keyword) {
            let before = text[..at].chars().next_back();
            if before.is_some_and(|c| c.is_alphanumeric() || c == '_' || c == ':') {
                continue;
            }
            let (base, rest) = base(&text[at..], module);
            tree(rest, &base, &mut found);
        }
    }
    found
}

/// The module that a path begins at, and what follows.
fn base<'t>(mut text: &'t str, module: &Module) -> (Module, &'t str) {
    let mut base = module.clone();
    if let Some(rest) = text.strip_prefix("crate::") {
        return (Module::new(), rest);
    }
    text = text.strip_prefix("self::").unwrap_or(text);
    while let Some(rest) = text.strip_prefix("super::") {
        (text, _) = (rest, base.pop());
    }
    (base, text)
}

/// Follows a path or a tree of them (`a::{b, c::d}`); returns what comes behind.
fn tree<'t>(text: &'t str, base: &Module, found: &mut Vec<Module>) -> &'t str {
    let mut path = base.clone();
    let mut text = text.trim_start();
    loop {
        if let Some(inside) = text.strip_prefix('{') {
            let mut rest = inside.trim_start();
            while !rest.is_empty() && !rest.starts_with('}') {
                let behind = tree(rest, &path, found).trim_start();
                let next = behind.strip_prefix(',').unwrap_or(behind).trim_start();
                // What is no list of names is left.
                if next.len() == rest.len() {
                    return next;
                }
                rest = next;
            }
            return rest.strip_prefix('}').unwrap_or(rest);
        }
        let end = text.find(|c: char| !c.is_alphanumeric() && c != '_').unwrap_or(text.len());
        let (name, rest) = text.split_at(end);
        if name.is_empty() {
            found.push(path);
            return rest;
        }
        path.push(name.to_owned());
        let Some(onward) = rest.strip_prefix("::") else {
            found.push(path);
            return rest;
        };
        text = onward;
    }
}

#[test]
fn trees_of_imports_are_followed() {
    let module = vec!["a".to_owned(), "b".to_owned()];
    let text = "use crate::c::{d, e::{f, self}};\nuse super::g;\nlet x = self::h::I::new();";
    let found: BTreeSet<String> = paths(text, &module).iter().map(|p| p.join("::")).collect();
    let expected = ["c::d", "c::e::f", "c::e::self", "a::g", "a::b::h::I::new"];
    assert_eq!(found, expected.map(str::to_owned).into());
}

#[test]
fn a_planted_circle_is_found() {
    let folder = tempfile::tempdir_in(super::root().join("tests")).unwrap();
    for (name, text) in
        [("a", "use crate::b::X;"), ("b", "use super::c;"), ("c", "use crate::a;"), ("d", "use crate::a;")]
    {
        std::fs::write(folder.path().join(name).with_extension("rs"), text).unwrap();
    }
    let graph = Graph::of(folder.path());
    assert_eq!((graph.arrows(), graph.circles()), (4, vec![["a", "b", "c"].map(str::to_owned).to_vec()]));
}
