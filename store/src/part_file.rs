//! The file of one part: a header that knows what follows, and what follows.

use std::fs::{self, File};
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use claymill_toolpath::PartKey;
use sha2::{Digest, Sha256};

use crate::error::Damage;

/// The form of parts and of the folder.
pub(crate) const FORM: u32 = 1;
const MARK: &[u8; 8] = b"claypart";
/// Mark, form, key, SHA-256 of the payload, its length.
const HEADER_BYTES: usize = 8 + 4 + 32 + 32 + 8;
pub(crate) const PART: &str = "part";
pub(crate) const PARTIAL: &str = "partial";

/// Where a part is.
pub(crate) fn path_of(folder: &Path, key: &PartKey) -> PathBuf {
    folder.join(format!("{key}.{PART}"))
}

/// Whether a file has the name of a part.
pub(crate) fn is_part(name: &str) -> bool {
    let key = name.strip_suffix(PART).and_then(|name| name.strip_suffix('.'));
    key.is_some_and(|key| key.len() == 64 && key.bytes().all(|b| b.is_ascii_hexdigit()))
}

/// Whether a file has the name of a part that is being written.
pub(crate) fn is_partial(name: &str) -> bool {
    let inner = name.strip_prefix('.').and_then(|name| name.strip_suffix(PARTIAL)).unwrap_or_default();
    let mut words = inner.split('.');
    let key = words.next().unwrap_or_default();
    let is_key = key.len() == 64 && key.bytes().all(|b| b.is_ascii_hexdigit());
    is_key && words.next().is_some_and(|pid| !pid.is_empty() && pid.bytes().all(|b| b.is_ascii_digit()))
}

fn header(key: &PartKey, payload: &[u8]) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(HEADER_BYTES);
    bytes.extend_from_slice(MARK);
    bytes.extend_from_slice(&FORM.to_le_bytes());
    bytes.extend_from_slice(key.as_bytes());
    bytes.extend_from_slice(&Sha256::digest(payload));
    bytes.extend_from_slice(&(payload.len() as u64).to_le_bytes());
    bytes
}

/// The payload of a part; `None` where there is no such file.
pub(crate) fn read(folder: &Path, key: &PartKey) -> Result<Option<Vec<u8>>, Damage> {
    let mut file = match File::open(path_of(folder, key)) {
        Ok(file) => file,
        Err(e) if e.kind() == io::ErrorKind::NotFound => return Ok(None),
        Err(e) => return Err(e.into()),
    };
    let found = file.metadata()?.len().saturating_sub(HEADER_BYTES as u64);
    let mut header = [0; HEADER_BYTES];
    file.read_exact(&mut header).map_err(|e| match e.kind() {
        io::ErrorKind::UnexpectedEof => Damage::NoPart,
        _ => Damage::Unreadable(e),
    })?;
    let (mark, rest) = header.split_at(MARK.len());
    let (form, rest) = rest.split_at(4);
    let (own_key, rest) = rest.split_at(32);
    let (hash, length) = rest.split_at(32);
    let form = form.iter().rev().fold(0, |all, byte| all << 8 | u32::from(*byte));
    let stated = length.iter().rev().fold(0, |all, byte| all << 8 | u64::from(*byte));
    match () {
        () if mark != MARK => return Err(Damage::NoPart),
        () if form != FORM => return Err(Damage::Version { found: form }),
        () if own_key != key.as_bytes() => return Err(Damage::OtherKey),
        () if found != stated => return Err(Damage::Length { found, stated }),
        () => {}
    }
    let mut payload = Vec::new();
    std::io::copy(&mut file, &mut payload)?;
    if Sha256::digest(&payload).as_slice() != hash {
        return Err(Damage::Content);
    }
    // When it was last used. A store that cannot be written to does not remember.
    let _ = file.set_modified(SystemTime::now());
    Ok(Some(payload))
}

/// Writes a part beside its place and renames it. Nothing is left of one that cannot be written whole. Returns its size.
pub(crate) fn write(folder: &Path, key: &PartKey, payload: &[u8]) -> io::Result<u64> {
    // Threads of one process write different parts, or the same one with the same bytes.
    let partial = folder.join(format!(".{key}.{}.{PARTIAL}", std::process::id()));
    let whole = path_of(folder, key);
    let written = (|| {
        let mut file = File::options().write(true).create_new(true).open(&partial)?;
        // As long as it is held the process is alive. Where files cannot be locked nobody removes it.
        let _ = file.try_lock();
        file.write_all(&header(key, payload))?;
        file.write_all(payload)?;
        file.sync_all()?;
        fs::rename(&partial, &whole)
    })();
    if let Err(e) = &written
        && e.kind() != io::ErrorKind::AlreadyExists
    {
        let _ = fs::remove_file(&partial);
    }
    written.map(|()| (HEADER_BYTES + payload.len()) as u64)
}

/// Removes what a process was writing if that process is dead: its lock is gone then.
pub(crate) fn remove_if_dead(partial: &Path) {
    let Ok(file) = File::options().write(true).open(partial) else { return };
    if file.try_lock().is_ok() {
        // A part without a lock yet is only just begun, and empty.
        let is_begun = file.metadata().is_ok_and(|about| about.len() > 0 || is_old(&about));
        if is_begun {
            let _ = fs::remove_file(partial);
        }
    }
}

/// Whether nobody has written to it for a minute.
fn is_old(about: &fs::Metadata) -> bool {
    let age = about.modified().ok().and_then(|at| SystemTime::now().duration_since(at).ok());
    age.is_some_and(|age| age.as_secs() > 60)
}
