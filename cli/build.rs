//! Names for what the command computes: a hash of the sources of everything that plans or verifies, and one of what draws
//! besides. Parts that another version has kept are not taken for those of this one.

use std::path::{Path, PathBuf};
use std::{env, fs, io};

use sha2::{Digest, Sha256};

const PLANNING: [&str; 14] = [
    "elementary",
    "nurbs",
    "exchange",
    "surface-merge",
    "toolpath",
    "tooling",
    "motion",
    "contact",
    "stock",
    "clearing",
    "reach",
    "paths",
    "verify",
    "claymill",
];
/// The command chooses what its pictures show.
const DRAWING: [&str; 2] = ["viewer", "cli"];

fn main() -> io::Result<()> {
    println!("cargo:rustc-env=CLAYMILL_SOURCES={}", hash_of(&PLANNING)?);
    println!("cargo:rustc-env=CLAYMILL_DRAWING_SOURCES={}", hash_of(&DRAWING)?);
    Ok(())
}

/// A hash of the sources of these crates, of their libraries, and of what machine they are for.
fn hash_of(crates: &[&str]) -> io::Result<String> {
    let root = Path::new("..");
    let mut hash = Sha256::new();
    let mut files = vec![root.join("Cargo.lock")];
    for name in crates {
        let folder = root.join(name).join("src");
        println!("cargo:rerun-if-changed={}", folder.display());
        sources(&folder, &mut files)?;
    }
    println!("cargo:rerun-if-changed=../Cargo.lock");
    files.sort();
    for file in files {
        hash.update(file.to_string_lossy().as_bytes());
        hash.update(fs::read(&file)?);
    }
    // Other mathematics gives other digits.
    hash.update(env::var("TARGET").unwrap_or_default());
    Ok(hash.finalize().iter().map(|byte| format!("{byte:02x}")).collect())
}

fn sources(folder: &Path, into: &mut Vec<PathBuf>) -> io::Result<()> {
    for entry in fs::read_dir(folder)? {
        let path = entry?.path();
        if path.is_dir() {
            sources(&path, into)?;
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            into.push(path);
        }
    }
    Ok(())
}
