//! The profiles at hand: those that are shipped, and those that a shop adds or replaces.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use claymill_toolpath::{LONGEST_WRITTEN, read_plain_text};

use super::condition::{Condition, Facts};
use super::files::{MATERIAL_FORMAT, Material, PROCESS_FORMAT, ProcessFile, VERSION};
use super::sense::{check_material, check_process};
use crate::error::{Fault, ToolingError, one_line};

/// What is shipped: file names and texts.
const SHIPPED: [(&str, &str); 7] = [
    ("material-clay.toml", include_str!("../../data/material-clay.toml")),
    ("material-foam.toml", include_str!("../../data/material-foam.toml")),
    ("material-aluminium.toml", include_str!("../../data/material-aluminium.toml")),
    ("process-general.toml", include_str!("../../data/process-general.toml")),
    ("process-clay.toml", include_str!("../../data/process-clay.toml")),
    ("process-foam.toml", include_str!("../../data/process-foam.toml")),
    ("process-aluminium.toml", include_str!("../../data/process-aluminium.toml")),
];
/// More profiles nobody has.
const MOST_PROFILES: usize = 1000;

/// Materials and processes by their names.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Profiles {
    pub(super) materials: BTreeMap<String, (Material, PathBuf)>,
    pub(super) processes: BTreeMap<String, (ProcessFile, PathBuf)>,
}

impl Profiles {
    /// The materials and processes that are shipped.
    #[must_use]
    pub fn shipped() -> Self {
        let mut profiles = Profiles::default();
        for (file, text) in SHIPPED {
            let added = profiles.add(text, &Path::new("(shipped)").join(file));
            debug_assert!(added.is_ok(), "{file}: {added:?}");
        }
        profiles
    }

    /// Reads a material or a process from a file. One of the same name is replaced.
    ///
    /// # Errors
    /// The file cannot be read, is neither, or has values that make no sense. Returns the profile's name.
    pub fn add_file(&mut self, path: &Path) -> Result<String, ToolingError> {
        let text = read_plain_text(path, LONGEST_WRITTEN)
            .map_err(|source| ToolingError::Io { path: path.to_owned(), source })?;
        self.add(&text, path)
    }

    /// The same from a text; `path` is for messages and origins.
    ///
    /// # Errors
    /// As [`Profiles::add_file`].
    pub fn add(&mut self, text: &str, path: &Path) -> Result<String, ToolingError> {
        if self.materials.len() + self.processes.len() >= MOST_PROFILES {
            return Err(ToolingError::TooMuch { path: path.into(), what: "profiles", most: MOST_PROFILES });
        }
        let entry = |name: &str| if name.is_empty() { "(no name)".to_owned() } else { one_line(name) };
        if crate::form::stated(text).as_deref() == Some(MATERIAL_FORMAT) {
            let material: Material = crate::form::parse(text, path, MATERIAL_FORMAT, VERSION)?;
            check_material(&material).map_err(|f| f.of_entry(path, &entry(&material.name)))?;
            let name = material.name.clone();
            self.materials.insert(name.clone(), (material, path.to_owned()));
            return Ok(name);
        }
        let process: ProcessFile = crate::form::parse(text, path, PROCESS_FORMAT, VERSION)?;
        check_process(&process).map_err(|f| f.of_entry(path, &entry(&process.name)))?;
        let name = process.name.clone();
        self.processes.insert(name.clone(), (process, path.to_owned()));
        Ok(name)
    }

    /// A material by one of its names.
    #[must_use]
    pub fn material(&self, name: &str) -> Option<&Material> {
        let own = self.materials.get(name).map(|(material, _)| material);
        own.or_else(|| self.materials.values().map(|(m, _)| m).find(|m| m.is_named(name)))
    }

    /// Names of the materials.
    pub fn material_names(&self) -> impl Iterator<Item = &str> {
        self.materials.keys().map(String::as_str)
    }

    /// Names of the processes.
    pub fn process_names(&self) -> impl Iterator<Item = &str> {
        self.processes.keys().map(String::as_str)
    }

    /// The process whose condition holds. Where several hold, one from which another one that holds inherits steps back. A
    /// process without a condition is chosen where no condition holds, if it is general and the only one.
    ///
    /// # Errors
    /// None or several are left; the names are in the message.
    pub fn choose(&self, facts: &Facts) -> Result<&str, Fault> {
        let holds = |process: &ProcessFile| {
            let when = process.when.as_deref().map(Condition::parse);
            when.is_some_and(|c| c.is_ok_and(|c| c.holds(facts) == Some(true)))
        };
        let all = || self.processes.iter().map(|(name, (process, _))| (name.as_str(), process));
        let holding: Vec<&str> = all().filter(|(_, p)| holds(p)).map(|(name, _)| name).collect();
        let is_parent =
            |name: &str| holding.iter().any(|other| *other != name && self.inherits_from(other, name));
        let mut left: Vec<&str> = holding.iter().copied().filter(|name| !is_parent(name)).collect();
        if holding.is_empty() {
            left = all().filter(|(_, p)| p.when.is_none() && p.general).map(|(name, _)| name).collect();
        }
        match left[..] {
            [name] => Ok(name),
            [] => Err(Fault::new(
                "no process has a condition that holds",
                format!("Name a process: {}.", self.process_names().collect::<Vec<_>>().join(", ")),
            )),
            _ => Err(Fault::new(
                format!("the conditions of several processes hold: {}", left.join(", ")),
                "Name one of them, or make their conditions exclude each other.",
            )),
        }
    }

    fn inherits_from(&self, name: &str, ancestor: &str) -> bool {
        let parent = |name: &str| self.processes.get(name).and_then(|(p, _)| p.inherits.as_deref());
        let line = std::iter::successors(parent(name), |name| parent(name));
        // A circle is another one's error.
        line.take(self.processes.len()).any(|name| name == ancestor)
    }
}
