//! Whatever happens to a store, a part comes back as it was put there or not at all.

use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};

use claymill_store::{Damage, Store, StoreError, Trouble};
use claymill_toolpath::{KeyMaker, PartKey, PartStore};

const LIMIT: u64 = 1 << 20;

fn key(number: usize) -> PartKey {
    KeyMaker::new("test").count(number).finish()
}

fn path(store: &Store, number: usize) -> PathBuf {
    store.folder().join(format!("{}.part", key(number)))
}

fn names(folder: &Path) -> Vec<String> {
    let names = fs::read_dir(folder).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap());
    let mut names: Vec<String> = names.collect();
    names.sort();
    names
}

/// A store with one part, which something is done to; what is then said of it. The part is put there again.
fn after(change: impl FnOnce(&Path)) -> Damage {
    let folder = tempfile::tempdir().unwrap();
    let store = Store::open(&folder.path().join("parts"), LIMIT).unwrap();
    store.put(&key(1), b"what was computed");
    change(&path(&store, 1));
    assert_eq!(store.get(&key(1)), None);
    let mut troubles = store.troubles();
    assert_eq!(troubles.len(), 1);
    let Some(Trouble::Damaged { path: named, damage }) = troubles.pop() else { panic!("{troubles:?}") };
    assert_eq!(named, path(&store, 1));
    // It is computed again, and kept.
    store.put(&key(1), b"what was computed");
    assert_eq!(store.get(&key(1)).as_deref(), Some(&b"what was computed"[..]));
    assert!(store.troubles().is_empty());
    damage
}

#[test]
fn every_flipped_bit_is_found() {
    let length = 84 + b"what was computed".len();
    for at in 0..length {
        let damage = after(|file| {
            let mut bytes = fs::read(file).unwrap();
            assert_eq!(bytes.len(), length);
            bytes[at] ^= 1 << (at % 8);
            fs::write(file, bytes).unwrap();
        });
        let is_right = match at {
            0..8 => matches!(damage, Damage::NoPart),
            8..12 => matches!(damage, Damage::Version { .. }),
            12..44 => matches!(damage, Damage::OtherKey),
            76..84 => matches!(damage, Damage::Length { .. }),
            _ => matches!(damage, Damage::Content),
        };
        assert!(is_right, "byte {at}: {damage:?}");
    }
}

#[test]
fn a_file_that_was_cut_off_is_no_part() {
    for length in [0, 10, 83] {
        let cut = |file: &Path| File::options().write(true).open(file).unwrap().set_len(length).unwrap();
        assert!(matches!(after(cut), Damage::NoPart), "{length}");
    }
    let cut = |file: &Path| File::options().write(true).open(file).unwrap().set_len(90).unwrap();
    assert!(matches!(after(cut), Damage::Length { found: 6, stated: 17 }));
}

#[test]
fn a_part_under_the_name_of_another_is_none() {
    let folder = tempfile::tempdir().unwrap();
    let store = Store::open(folder.path(), LIMIT).unwrap();
    store.put(&key(1), b"one");
    fs::copy(path(&store, 1), path(&store, 2)).unwrap();
    assert_eq!(store.get(&key(2)), None);
    assert!(matches!(store.troubles()[..], [Trouble::Damaged { damage: Damage::OtherKey, .. }]));
    assert_eq!(store.get(&key(1)).as_deref(), Some(&b"one"[..]));
}

#[test]
fn a_folder_with_something_else_is_refused_and_left_alone() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("letter.txt"), "dear reader").unwrap();
    let error = Store::open(folder.path(), LIMIT).unwrap_err();
    assert!(matches!(error, StoreError::Foreign { .. }));
    assert!(error.to_string().contains(&folder.path().display().to_string()));
    assert_eq!(names(folder.path()), ["letter.txt"]);
    let nowhere = folder.path().join("nowhere");
    assert!(matches!(Store::open_existing(&nowhere, LIMIT), Err(StoreError::Foreign { .. })));
    assert!(!nowhere.exists());
    let error = Store::open(&folder.path().join("letter.txt"), LIMIT).unwrap_err();
    assert!(matches!(error, StoreError::Io { .. }), "{error}");
}

#[test]
fn a_store_of_another_form_is_refused_by_name() {
    let folder = tempfile::tempdir().unwrap();
    drop(Store::open(folder.path(), LIMIT).unwrap());
    fs::write(folder.path().join("STORE"), "claymill parts, form 99\n").unwrap();
    let error = Store::open(folder.path(), LIMIT).unwrap_err();
    assert!(matches!(&error, StoreError::Version { found, .. } if found == "form 99"), "{error}");
}

#[test]
fn what_a_dead_process_was_writing_goes_and_what_a_living_one_writes_stays() {
    let folder = tempfile::tempdir().unwrap();
    drop(Store::open(folder.path(), LIMIT).unwrap());
    let dead = folder.path().join(format!(".{}.4000000.partial", key(1)));
    let alive = folder.path().join(format!(".{}.4000001.partial", key(2)));
    let foreign = folder.path().join(".notes.partial");
    for file in [&dead, &alive, &foreign] {
        fs::write(file, "half of it").unwrap();
    }
    let held = File::open(&alive).unwrap();
    held.lock().unwrap();
    drop(Store::open(folder.path(), LIMIT).unwrap());
    assert!(!dead.exists() && alive.exists() && foreign.exists());
    drop(held);
    drop(Store::open(folder.path(), LIMIT).unwrap());
    assert!(!alive.exists());
}

#[test]
fn a_part_that_cannot_be_written_is_said_once_and_leaves_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let store = Store::open(&folder.path().join("parts"), LIMIT).unwrap();
    store.put(&key(1), b"one");
    // The same as on a disk that is full, or may not be written to: even root gets an error.
    fs::rename(store.folder(), folder.path().join("elsewhere")).unwrap();
    store.put(&key(2), b"two");
    store.put(&key(3), b"three");
    let troubles = store.troubles();
    assert!(matches!(&troubles[..], [Trouble::NotKept { path, .. }] if path.starts_with(store.folder())));
    assert!(troubles[0].to_string().contains(&key(2).to_string()));
    assert_eq!(names(&folder.path().join("elsewhere")), [format!("{}.part", key(1)), "STORE".into()]);
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_costs_the_part_and_nothing_else() {
    // A device that is always full, in the place where the part is written.
    let folder = tempfile::tempdir().unwrap();
    let store = Store::open(folder.path(), LIMIT).unwrap();
    let large = vec![7; 100_000];
    let child = std::process::Command::new("sh")
        .args(["-c", "ulimit -f 8; trap '' XFSZ; exec \"$0\" --exact --ignored write_a_large_part"])
        .arg(std::env::current_exe().unwrap())
        .env("CLAYMILL_TEST_STORE", folder.path())
        .output()
        .unwrap();
    assert!(child.status.success(), "{}", String::from_utf8_lossy(&child.stdout));
    assert_eq!(names(folder.path()), ["STORE"]);
    store.put(&key(1), &large);
    assert_eq!(store.get(&key(1)), Some(large));
}

#[cfg(target_os = "linux")]
#[test]
#[ignore = "run by a_full_disk_costs_the_part_and_nothing_else, where files may not grow"]
fn write_a_large_part() {
    let Some(folder) = std::env::var_os("CLAYMILL_TEST_STORE") else { return };
    let store = Store::open(Path::new(&folder), LIMIT).unwrap();
    store.put(&key(1), &vec![7; 100_000]);
    assert!(matches!(store.troubles()[..], [Trouble::NotKept { .. }]));
    assert_eq!(store.get(&key(1)), None);
}

#[test]
fn parts_that_were_not_used_for_the_longest_time_go_first() {
    let folder = tempfile::tempdir().unwrap();
    let store = Store::open(folder.path(), 10_000).unwrap();
    for number in 0..9 {
        store.put(&key(number), &[0; 916]);
        let used = SystemTime::now() - Duration::from_secs(1000 - number as u64);
        File::options().write(true).open(path(&store, number)).unwrap().set_modified(used).unwrap();
    }
    assert!(store.get(&key(0)).is_some());
    assert_eq!(store.contents().unwrap().bytes, 9000);
    store.put(&key(9), &[0; 916]);
    assert_eq!(store.contents().unwrap().parts, 10);
    // The eleventh does not fit: the oldest two go, not the first, which was used since.
    store.put(&key(10), &[0; 916]);
    let left: Vec<usize> = (0..11).filter(|&number| path(&store, number).exists()).collect();
    assert_eq!(left, [0, 3, 4, 5, 6, 7, 8, 9, 10]);
    let gone = store.shrink(0).unwrap();
    assert_eq!((gone.parts, store.contents().unwrap().parts), (9, 0));
    assert_eq!(names(folder.path()), ["STORE"]);
}

#[test]
fn two_processes_use_one_store() {
    let folder = tempfile::tempdir().unwrap();
    let stores = [(); 2].map(|()| Store::open(folder.path(), 4000).unwrap());
    let payload = |number: usize| vec![number as u8; 100 + number];
    std::thread::scope(|scope| {
        for store in &stores {
            for _ in 0..2 {
                scope.spawn(|| {
                    for round in 0..20 {
                        for number in 0..20 {
                            if let Some(found) = store.get(&key(number)) {
                                assert_eq!(found, payload(number));
                            } else if round % 2 == 0 {
                                store.put(&key(number), &payload(number));
                            }
                        }
                    }
                });
            }
        }
    });
    assert!(stores.iter().all(|store| store.troubles().is_empty()));
    assert!(names(folder.path()).iter().all(|name| name == "STORE" || name.ends_with(".part")));
}
