//! Records and queue files made for tests.
#![allow(dead_code, reason = "not every test needs all of them")]

use std::fs::OpenOptions;
use std::os::unix::fs::FileExt;
use std::path::Path as FilePath;

use claymill_controller::{Path, Record};
use claymill_nurbs::{Curve3, Point3, Vector3};
use claymill_toolpath::MoveKind;

/// A straight cut along X, in mm and mm/min.
pub(crate) fn line(from: f64, to: f64, feed: f64) -> Record {
    let at = |x| Point3::new(x, 0.0, 0.0);
    let axis = Vector3::z();
    let curve = Curve3::line(at(from), at(to));
    Record::Path(Box::new(Path { kind: MoveKind::Cut, curve, axis_start: axis, axis_end: axis, feed }))
}

pub(crate) fn encoded(seq: u64, record: &Record) -> Vec<u8> {
    let mut bytes = Vec::new();
    record.encode(seq, &mut bytes);
    bytes
}

/// A record whose bytes `at` are others, under a check sum that fits.
pub(crate) fn changed(record: &[u8], at: usize, bytes: &[u8]) -> Vec<u8> {
    let mut record = record[..record.len() - 4].to_vec();
    record[at..at + bytes.len()].copy_from_slice(bytes);
    summed(record)
}

pub(crate) fn summed(mut record: Vec<u8>) -> Vec<u8> {
    record.extend(crc32fast::hash(&record).to_le_bytes());
    record
}

/// Where the producer's word is.
const PRODUCER_AT: u64 = 64;
const RING_AT: u64 = 4096;

/// Writes bytes that nobody has judged behind what is in a queue, as one record of a length that may be a lie.
pub(crate) fn plant(queue: &FilePath, bytes: &[u8], length: u32) {
    let file = OpenOptions::new().read(true).write(true).open(queue).unwrap();
    let number = |at: u64| {
        let mut eight = [0; 8];
        file.read_exact_at(&mut eight, at).unwrap();
        u64::from_le_bytes(eight)
    };
    let (magic, capacity) = (number(0), number(8));
    let (begin, records, beats) = (number(PRODUCER_AT), number(PRODUCER_AT + 8), number(PRODUCER_AT + 16));
    let all = [&length.to_le_bytes()[..], bytes].concat();
    assert!(begin % capacity + all.len() as u64 <= capacity, "no record here goes round the end");
    file.write_all_at(&all, RING_AT + begin % capacity).unwrap();
    let word = [begin + all.len() as u64, records + 1, beats + 1];
    let check = magic ^ word[0].rotate_left(7) ^ word[1].rotate_left(23) ^ word[2].rotate_left(41);
    let bytes: Vec<u8> = word.into_iter().chain([check]).flat_map(u64::to_le_bytes).collect();
    file.write_all_at(&bytes, PRODUCER_AT).unwrap();
}

/// Damages the producer's word.
pub(crate) fn damage_word(queue: &FilePath) {
    let file = OpenOptions::new().write(true).open(queue).unwrap();
    file.write_all_at(&[0xff; 8], PRODUCER_AT + 24).unwrap();
}

/// Bytes that are no record number `seq` behind a path that ends at X `end_mm`, with what is wrong with each.
pub(crate) fn bad(seq: u64, end_mm: f64) -> Vec<(&'static str, Vec<u8>)> {
    let of = |record: &Record| encoded(seq, record);
    let path = of(&line(end_mm, end_mm + 10.0, 3000.0));
    let number = f64::to_le_bytes;
    let (spindle, feed) = (of(&Record::Spindle(900.0)), of(&Record::Feed(0.5)));
    let coolant = of(&Record::Coolant(true));
    let output = of(&Record::Output { number: 3, on: true });
    let mut sum = spindle.clone();
    *sum.last_mut().unwrap() ^= 1;
    // Kind of move, degree, rational, 0, points u32; axes at 20 and 44, feed 68, knots 76 to 108, points 108 to 156.
    let mut weighted = changed(&path, 14, &[1]);
    weighted.truncate(weighted.len() - 4);
    weighted.extend(number(1.0));
    weighted.extend(number(0.0));
    vec![
        ("nothing", Vec::new()),
        ("a byte", vec![2]),
        ("version 1", changed(&spindle, 0, &[1, 0])),
        ("version 3", changed(&spindle, 0, &[3, 0])),
        ("no kind", changed(&spindle, 2, &[0])),
        ("kind 8", changed(&spindle, 2, &[8])),
        ("a kind with other fields", changed(&spindle, 2, &[1])),
        ("reserved byte", changed(&spindle, 3, &[1])),
        ("number 0", changed(&spindle, 4, &0u64.to_le_bytes())),
        ("a number too far", changed(&spindle, 4, &(seq + 1).to_le_bytes())),
        ("the largest number", changed(&spindle, 4, &u64::MAX.to_le_bytes())),
        ("check sum", sum),
        ("cut off", spindle[..spindle.len() - 1].to_vec()),
        ("a byte more", summed([&spindle[..spindle.len() - 4], &[0]].concat())),
        ("spindle that is no number", changed(&spindle, 12, &number(f64::NAN))),
        ("spindle without end", changed(&spindle, 12, &number(f64::INFINITY))),
        ("spindle too fast", changed(&spindle, 12, &number(-1e300))),
        ("feed's share that is no number", changed(&feed, 12, &number(f64::NAN))),
        ("feed's share 0", changed(&feed, 12, &number(0.0))),
        ("feed's share 3", changed(&feed, 12, &number(3.0))),
        ("coolant 2", changed(&coolant, 12, &[2])),
        ("output 64", changed(&output, 12, &[64, 0])),
        ("output 3 to 7", changed(&output, 14, &[7])),
        ("a tool without its number", summed(of(&Record::Tool(1))[..14].to_vec())),
        ("kind of move", changed(&path, 12, &[9])),
        ("degree 0", changed(&path, 13, &[0])),
        ("degree 255", changed(&path, 13, &[255])),
        ("rational 2", changed(&path, 14, &[2])),
        ("rational without weights", changed(&path, 14, &[1])),
        ("a path's reserved byte", changed(&path, 15, &[1])),
        ("no points", changed(&path, 16, &0u32.to_le_bytes())),
        ("points without end", changed(&path, 16, &u32::MAX.to_le_bytes())),
        ("axis that is no number", changed(&path, 20, &number(f64::NAN))),
        ("axis at the end of no length", changed(&path, 60, &number(0.0))),
        ("feed that is no number", changed(&path, 68, &number(f64::NAN))),
        ("feed 0", changed(&path, 68, &number(0.0))),
        ("feed backwards", changed(&path, 68, &number(-600.0))),
        ("feed without end", changed(&path, 68, &number(1e300))),
        ("knot that is no number", changed(&path, 84, &number(f64::NAN))),
        ("knots that fall", changed(&path, 84, &number(-7.0))),
        ("knots too large", changed(&path, 100, &number(1e300))),
        ("point that is no number", changed(&path, 132, &number(f64::NAN))),
        ("point beyond every machine", changed(&path, 132, &number(1e7))),
        ("a gap", changed(&path, 116, &number(3.0))),
        ("weight 0", summed(weighted)),
    ]
}
