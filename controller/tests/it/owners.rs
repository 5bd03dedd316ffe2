//! Whose a queue is: one controller, one writer, one user, and never a file that is something else.

use std::fs::{self, File};
use std::io::Write;
use std::os::unix::fs::{MetadataExt, PermissionsExt, symlink};
use std::path::Path;
use std::process::Command;

use crate::records::{encoded, line};
use claymill_controller::{Consumer, Producer, QueueError, Record};

const CAPACITY: u64 = 1 << 16;

fn set_mode(path: &Path, mode: u32) {
    fs::set_permissions(path, fs::Permissions::from_mode(mode)).unwrap();
}

/// Both sides refuse the file, and leave it as it is.
fn refused(path: &Path, why: &str) {
    let before = fs::symlink_metadata(path).ok().filter(|m| m.is_file()).map(|_| fs::read(path).unwrap());
    let sides = [
        Producer::open(path, CAPACITY).map(drop).unwrap_err(),
        Consumer::open(path, CAPACITY).map(drop).unwrap_err(),
    ];
    for error in sides {
        assert!(error.to_string().contains(why), "{error}, not {why}");
    }
    if let Some(before) = before {
        assert_eq!(fs::read(path).unwrap(), before);
    }
}

#[test]
fn only_what_is_new_or_empty_becomes_a_queue() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    // New, and for its owner alone.
    Producer::open(&at("new"), CAPACITY).unwrap();
    assert_eq!(fs::metadata(at("new")).unwrap().mode() & 0o777, 0o600);
    // Empty.
    File::create(at("empty")).unwrap();
    set_mode(&at("empty"), 0o600);
    Consumer::open(&at("empty"), CAPACITY).unwrap();
    Producer::open(&at("empty"), CAPACITY).unwrap();
    // Whose maker died in the middle.
    let whole = fs::read(at("new")).unwrap();
    let half = [b"CLAYMLQ~", &whole[8..16]].concat();
    fs::write(at("half"), &half).unwrap();
    set_mode(&at("half"), 0o600);
    Consumer::open(&at("half"), CAPACITY).unwrap();
    assert_eq!(fs::read(at("half")).unwrap(), whole);
    // Anything else stays what it is, short or long.
    for (length, why) in
        [(1, "is no queue"), (15, "is no queue"), (100, "is no queue"), (5000, "is no queue")]
    {
        fs::write(at("notes"), vec![b'n'; length]).unwrap();
        set_mode(&at("notes"), 0o600);
        refused(&at("notes"), why);
    }
    let mut earlier = whole;
    earlier[7] = b'2';
    fs::write(at("earlier"), &earlier).unwrap();
    set_mode(&at("earlier"), 0o600);
    refused(&at("earlier"), "another version");
}

#[test]
fn what_others_could_touch_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    Producer::open(&at("queue"), CAPACITY).unwrap();
    for mode in [0o604, 0o640, 0o602, 0o660, 0o601] {
        set_mode(&at("queue"), mode);
        refused(&at("queue"), "other users");
    }
    set_mode(&at("queue"), 0o600);
    fs::hard_link(at("queue"), at("second")).unwrap();
    refused(&at("second"), "other names");
    fs::remove_file(at("second")).unwrap();
    // Links are not followed, to a queue, to an empty file or to none.
    fs::write(at("empty"), "").unwrap();
    for target in ["queue", "empty", "nothing"] {
        let _ = fs::remove_file(at("link"));
        symlink(at(target), at("link")).unwrap();
        refused(&at("link"), "is a link");
    }
    assert_eq!(fs::metadata(at("empty")).unwrap().len(), 0);
    assert!(!at("nothing").exists());
    refused(folder.path(), "is a folder");
    assert!(Command::new("mkfifo").arg(at("pipe")).status().unwrap().success());
    set_mode(&at("pipe"), 0o600);
    refused(&at("pipe"), "no regular file");
    // Somebody else's, where this user may make such a file.
    if std::os::unix::fs::chown(at("queue"), Some(12_345), None).is_ok() {
        refused(&at("queue"), "another user");
    }
}

#[test]
fn random_bytes_are_no_queue() {
    use rand::{Rng, SeedableRng};
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("queue");
    let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(3);
    let mut head = [0; 8];
    {
        Producer::open(&path, CAPACITY).unwrap();
        head.copy_from_slice(&fs::read(&path).unwrap()[..8]);
    }
    for i in 0..200 {
        let mut bytes = vec![0u8; rng.random_range(4096..9000)];
        rng.fill(&mut bytes[..]);
        // Some that begin as queues do.
        if i % 2 == 0 {
            bytes[..8].copy_from_slice(&head);
        }
        File::create(&path).unwrap().write_all(&bytes).unwrap();
        assert!(Consumer::open(&path, CAPACITY).is_err());
        assert!(Producer::open(&path, CAPACITY).is_err());
    }
}

#[test]
fn one_controller_takes_and_one_producer_writes() {
    let folder = tempfile::tempdir().unwrap();
    let queue = folder.path().join("queue");
    let consumer = Consumer::open(&queue, CAPACITY).unwrap();
    assert!(matches!(Consumer::open(&queue, CAPACITY), Err(QueueError::Taken)));
    drop(consumer);
    Consumer::open(&queue, CAPACITY).unwrap();
    let mut first = Producer::open(&queue, CAPACITY).unwrap();
    first.resume(7).unwrap();
    let mut second = Producer::open(&queue, CAPACITY).unwrap();
    for name in [7, 8] {
        assert!(matches!(second.resume(name), Err(QueueError::Written)));
    }
    assert!(matches!(second.push(&encoded(0, &Record::Tool(1))), Err(QueueError::Written)));
    // It goes on as if nobody had asked.
    first.push(&encoded(0, &line(0.0, 1.0, 600.0))).unwrap();
    first.flush().unwrap();
    drop(first);
    // The first one has gone without an end: its stream may go on, another one may not begin.
    assert!(matches!(second.resume(8), Err(QueueError::Unfinished)));
    assert_eq!(second.resume(7).unwrap(), 1);
    second.push(&encoded(1, &Record::End)).unwrap();
    second.flush().unwrap();
    // Written to its end is not enough: it is to be executed.
    assert!(matches!(second.resume(8), Err(QueueError::Unfinished)));
    let mut consumer = Consumer::open(&queue, CAPACITY).unwrap();
    while consumer.peek().unwrap().is_some() {
        consumer.done().unwrap();
    }
    assert_eq!(second.resume(8).unwrap(), 0);
}
