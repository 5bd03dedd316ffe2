//! A name for what the command computes: a hash of the sources of everything that plans or verifies. Parts that another
//! version has kept are not taken for those of this one.

use std::path::{Path, PathBuf};
use std::{env, fs, io};

use sha2::{Digest, Sha256};

const CRATES: [&str; 14] = [
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

fn main() -> io::Result<()> {
    let root = Path::new("..");
    let mut hash = Sha256::new();
    let mut files = vec![root.join("Cargo.lock")];
    for name in CRATES {
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
    let text: String = hash.finalize().iter().map(|byte| format!("{byte:02x}")).collect();
    println!("cargo:rustc-env=CLAYMILL_SOURCES={text}");
    Ok(())
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
