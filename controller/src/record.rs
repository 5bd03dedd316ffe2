//! The records of a stream and their byte layout: paths as NURBS, and tool, spindle, coolant,
//! output and feed commands, each with a CRC-32.

use claymill_nurbs::{Curve3, KnotVector, Point3, Vector3};
use claymill_toolpath::{Move, MoveKind};
use thiserror::Error;

/// Version of the layout; a reader refuses others, and kinds that it does not know.
pub const RECORD_VERSION: u16 = 2;
/// A record is never longer than this, bytes.
pub const LONGEST_RECORD: usize = 1 << 20;

/// Points of a record are never farther from zero, mm.
const FARTHEST_MM: f64 = 1e6;
/// Knots of a record's curve.
const LARGEST_KNOT: f64 = 1e9;
const CLOSEST_KNOTS: f64 = 1e-9;
/// Weights of a record's curve.
const WEIGHTS: std::ops::RangeInclusive<f64> = 1e-6..=1e6;
/// Spindles of a record turn no faster, 1/min.
const FASTEST_RPM: f64 = 1e6;
/// Outputs of a record are numbered from 0 up to this.
const LAST_OUTPUT: u16 = 63;
/// Version, kind, 0 and number, and the check sum behind everything.
const HEAD_BYTES: usize = 12;
const SUM_BYTES: usize = 4;
/// Feeds of a record.
const FEEDS_MM_PER_MIN: std::ops::RangeInclusive<f64> = 1e-3..=1e6;

/// What goes through the queue: a path, or an order to the machine.
#[derive(Debug, Clone, PartialEq)]
pub enum Record {
    /// A curve to run along.
    Path(Box<Path>),
    /// Change to a tool.
    Tool(u32),
    /// Spindle speed, 1/min; negative turns counterclockwise, 0 stops.
    Spindle(f64),
    /// Coolant on or off.
    Coolant(bool),
    /// Switch a numbered output.
    Output {
        /// Its number, 0 to 63.
        number: u16,
        /// On.
        on: bool,
    },
    /// Nothing follows.
    End,
    /// The paths that follow are run with this part of their own feed, 0.01 to 2.
    Feed(f64),
}

/// What [`Record::Feed`] may ask for.
pub(crate) const FEED_SHARES: std::ops::RangeInclusive<f64> = 0.01..=2.0;

/// A tool path record: curve, frames at its ends, feed.
#[derive(Debug, Clone, PartialEq)]
pub struct Path {
    /// What the move is for.
    pub kind: MoveKind,
    /// The tip's curve, mm.
    pub curve: Curve3,
    /// Tool axis at the start.
    pub axis_start: Vector3,
    /// Tool axis at the end.
    pub axis_end: Vector3,
    /// Feed, mm/min.
    pub feed: f64,
}

/// Why bytes are no record.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum RecordError {
    /// Fewer bytes than the record needs.
    #[error("it ends after {0} bytes")]
    Short(usize),
    /// The layout of another claymill.
    #[error(
        "its version is {0}, of {age} claymill; this one reads version {RECORD_VERSION}",
        age = if *.0 < RECORD_VERSION { "an earlier" } else { "a later" }
    )]
    Version(u16),
    /// The check sum does not fit.
    #[error("it is damaged: its check sum does not fit")]
    Sum,
    /// A field has no meaning.
    #[error("{0}")]
    Field(String),
    /// Another record comes next: one was lost, or comes twice.
    #[error("record {expected} of the stream should come here")]
    Order {
        /// The number that comes next.
        expected: u64,
    },
    /// A path begins elsewhere, though the part was not turned in between.
    #[error("it begins {gap_mm:.4} mm from the end of the path before it")]
    Gap {
        /// How far.
        gap_mm: f64,
    },
}

impl Path {
    /// The path of a move of the job.
    ///
    /// # Errors
    /// The move is no curve.
    pub fn of(m: &Move) -> Result<Self, claymill_toolpath::MoveError> {
        Ok(Path {
            kind: m.kind,
            curve: m.curve()?,
            axis_start: m.axis_start.into(),
            axis_end: m.axis_end.into(),
            feed: m.feed,
        })
    }
}

const KINDS: [MoveKind; 5] =
    [MoveKind::Cut, MoveKind::LeadIn, MoveKind::LeadOut, MoveKind::Link, MoveKind::Rapid];

impl Record {
    /// Appends the record: version u16, tag u8, reserved u8, sequence number u64, then the fields, then the CRC-32 of
    /// all that; all little-endian, floating-point numbers as IEEE 754 doubles.
    ///
    /// A path: kind u8, degree u8, rational u8, reserved u8, points u32, start axis 3 × f64, end axis 3 × f64,
    /// feed f64, knots, points (x, y, z), weights if rational.
    pub fn encode(&self, seq: u64, out: &mut Vec<u8>) {
        let tag = match self {
            Record::Path(_) => 1u8,
            Record::Tool(_) => 2,
            Record::Spindle(_) => 3,
            Record::Coolant(_) => 4,
            Record::Output { .. } => 5,
            Record::End => 6,
            Record::Feed(_) => 7,
        };
        let begin = out.len();
        out.extend(RECORD_VERSION.to_le_bytes());
        out.extend([tag, 0]);
        out.extend(seq.to_le_bytes());
        match self {
            Record::Path(path) => path.encode(out),
            Record::Tool(number) => out.extend(number.to_le_bytes()),
            Record::Spindle(value) | Record::Feed(value) => out.extend(value.to_le_bytes()),
            Record::Coolant(on) => out.push(u8::from(*on)),
            Record::Output { number, on } => {
                out.extend(number.to_le_bytes());
                out.push(u8::from(*on));
            }
            Record::End => {}
        }
        let sum = crc32fast::hash(&out[begin..]);
        out.extend(sum.to_le_bytes());
    }

    /// The number that bytes claim to have, whatever else is wrong with them.
    pub(crate) fn claimed_seq(bytes: &[u8]) -> Option<u64> {
        Some(u64::from_le_bytes(bytes.get(4..HEAD_BYTES)?.try_into().ok()?))
    }

    /// Reads one record and its sequence number.
    ///
    /// # Errors
    /// The bytes are no record of this version, or some are left over.
    pub fn decode(bytes: &[u8]) -> Result<(u64, Record), RecordError> {
        // An earlier layout has no check sum, but says so itself.
        let version = u16::from_le_bytes(Bytes { bytes, at: 0 }.take()?);
        if version != RECORD_VERSION {
            return Err(RecordError::Version(version));
        }
        let length = bytes.len().checked_sub(SUM_BYTES).filter(|l| *l >= HEAD_BYTES);
        let (bytes, sum) = bytes.split_at(length.ok_or(RecordError::Short(bytes.len()))?);
        if sum != crc32fast::hash(bytes).to_le_bytes() {
            return Err(RecordError::Sum);
        }
        let mut from = Bytes { bytes, at: 2 };
        let [tag, reserved] = from.take::<2>()?;
        if reserved != 0 {
            return Err(RecordError::Field("a byte that means nothing is not 0".into()));
        }
        let seq = u64::from_le_bytes(from.take()?);
        let flag = |b: [u8; 1]| match b[0] {
            0 => Ok(false),
            1 => Ok(true),
            other => Err(RecordError::Field(format!("{other} is neither on nor off"))),
        };
        let record = match tag {
            1 => Record::Path(Box::new(Path::decode(&mut from)?)),
            2 => Record::Tool(u32::from_le_bytes(from.take()?)),
            3 => match from.number()? {
                rpm if rpm.abs() <= FASTEST_RPM => Record::Spindle(rpm),
                other => return Err(RecordError::Field(format!("no spindle turns {other} times a minute"))),
            },
            4 => Record::Coolant(flag(from.take()?)?),
            5 => match u16::from_le_bytes(from.take()?) {
                number @ 0..=LAST_OUTPUT => Record::Output { number, on: flag(from.take()?)? },
                other => {
                    return Err(RecordError::Field(format!("output {other} is not from 0 to {LAST_OUTPUT}")));
                }
            },
            6 => Record::End,
            7 => match from.number()? {
                share if FEED_SHARES.contains(&share) => Record::Feed(share),
                other => {
                    return Err(RecordError::Field(format!(
                        "a feed's share of {other} is not from 0.01 to 2"
                    )));
                }
            },
            other => return Err(RecordError::Field(format!("{other} is no kind of record"))),
        };
        if from.at != bytes.len() {
            return Err(RecordError::Field(format!("{} bytes are left over", bytes.len() - from.at)));
        }
        Ok((seq, record))
    }
}

impl Path {
    fn encode(&self, out: &mut Vec<u8>) {
        let curve = &self.curve;
        let kind = KINDS.iter().position(|k| *k == self.kind).unwrap_or(0) as u8;
        out.extend([kind, curve.knots().degree() as u8, u8::from(curve.weights().is_some()), 0]);
        out.extend((curve.points().len() as u32).to_le_bytes());
        let mut put = |v: f64| out.extend(v.to_le_bytes());
        self.axis_start.iter().chain(self.axis_end.iter()).for_each(|v| put(*v));
        put(self.feed);
        curve.knots().as_slice().iter().for_each(|v| put(*v));
        curve.points().iter().flat_map(|p| [p.x, p.y, p.z]).for_each(&mut put);
        curve.weights().unwrap_or(&[]).iter().for_each(|v| put(*v));
    }

    fn decode(from: &mut Bytes) -> Result<Path, RecordError> {
        let field = |what: &str| RecordError::Field(what.into());
        let [kind, degree, rational, reserved] = from.take::<4>()?;
        if reserved != 0 || rational > 1 {
            return Err(field("whether the curve is rational is neither 0 nor 1"));
        }
        let kind = *KINDS.get(usize::from(kind)).ok_or_else(|| field("the kind of move is not known"))?;
        let degree = usize::from(degree);
        let count = u32::from_le_bytes(from.take()?) as usize;
        if count * 24 > LONGEST_RECORD {
            return Err(field("more control points than a record holds"));
        }
        let mut vector = || Ok(Vector3::new(from.number()?, from.number()?, from.number()?));
        let (axis_start, axis_end): (Vector3, Vector3) = (vector()?, vector()?);
        if [axis_start, axis_end].iter().any(|a| !(0.999..1.001).contains(&a.norm())) {
            return Err(field("a tool axis is no unit vector"));
        }
        let feed = from.number()?;
        if !FEEDS_MM_PER_MIN.contains(&feed) {
            return Err(field("the feed is not from 0.001 to 1e6 mm/min"));
        }
        let knots = (0..count + degree + 1).map(|_| from.number()).collect::<Result<Vec<_>, _>>()?;
        let close = |w: &[f64]| w[0] != w[1] && (w[1] - w[0]).abs() < CLOSEST_KNOTS;
        if knots.iter().any(|k| k.abs() > LARGEST_KNOT) || knots.windows(2).any(close) {
            return Err(field("knots are beyond 1e9, or closer together than 1e-9"));
        }
        let points = (0..count)
            .map(|_| Ok(Point3::new(from.number()?, from.number()?, from.number()?)))
            .collect::<Result<Vec<_>, _>>()?;
        if points.iter().any(|p| p.iter().any(|c| c.abs() > FARTHEST_MM)) {
            return Err(field("a point is farther away than any machine reaches"));
        }
        let weights = match rational {
            0 => None,
            _ => Some((0..count).map(|_| from.number()).collect::<Result<Vec<_>, _>>()?),
        };
        if weights.iter().flatten().any(|w| !WEIGHTS.contains(w)) {
            return Err(field("a weight is not from 1e-6 to 1e6"));
        }
        let curve = KnotVector::new(degree, knots)
            .and_then(|knots| Curve3::new(knots, points, weights))
            .map_err(|e| RecordError::Field(e.to_string()))?;
        Ok(Path { kind, curve, axis_start, axis_end, feed })
    }
}

struct Bytes<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl Bytes<'_> {
    fn take<const N: usize>(&mut self) -> Result<[u8; N], RecordError> {
        let part = self.bytes.get(self.at..self.at + N).and_then(|p| p.try_into().ok());
        self.at += N;
        part.ok_or(RecordError::Short(self.bytes.len()))
    }

    fn number(&mut self) -> Result<f64, RecordError> {
        let value = f64::from_le_bytes(self.take()?);
        if value.is_finite() { Ok(value) } else { Err(RecordError::Field("a number is not finite".into())) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{Rng, SeedableRng};

    fn path() -> Record {
        let knots = KnotVector::new(2, vec![0.0, 0.0, 0.0, 5.0, 5.0, 5.0]).unwrap();
        let points = vec![Point3::origin(), Point3::new(1.0, 2.0, 3.0), Point3::new(4.0, 0.0, 0.5)];
        let curve = Curve3::new(knots, points, Some(vec![1.0, 0.5, 1.0])).unwrap();
        let axis = Vector3::z();
        Record::Path(Box::new(Path {
            kind: MoveKind::Link,
            curve,
            axis_start: axis,
            axis_end: axis,
            feed: 600.0,
        }))
    }

    #[test]
    fn records_survive() {
        let all = [
            path(),
            Record::Tool(7),
            Record::Spindle(-1200.0),
            Record::Coolant(true),
            Record::Output { number: 3, on: false },
            Record::End,
            Record::Feed(0.5),
        ];
        for (i, record) in all.iter().enumerate() {
            let mut bytes = Vec::new();
            record.encode(i as u64, &mut bytes);
            assert_eq!(Record::decode(&bytes).unwrap(), (i as u64, record.clone()));
            for cut in 0..bytes.len() {
                assert!(Record::decode(&bytes[..cut]).is_err());
            }
            // A single bit is never taken for another record.
            for bit in 0..8 * bytes.len() {
                let mut damaged = bytes.clone();
                damaged[bit / 8] ^= 1 << (bit % 8);
                assert!(Record::decode(&damaged).is_err(), "{record:?}, bit {bit}");
            }
        }
    }

    #[test]
    fn an_earlier_layout_is_refused_by_name() {
        // The end of a stream as version 1 had it, without a check sum.
        let bytes = [1, 0, 6, 0, 9, 0, 0, 0, 0, 0, 0, 0];
        let refused = Record::decode(&bytes).unwrap_err();
        assert_eq!(refused, RecordError::Version(1));
        assert_eq!(refused.to_string(), "its version is 1, of an earlier claymill; this one reads version 2");
        assert_eq!(Record::claimed_seq(&bytes), Some(9));
    }

    #[test]
    fn damaged_records_never_panic() {
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(5);
        let mut whole = Vec::new();
        path().encode(1, &mut whole);
        for _ in 0..200_000 {
            let mut bytes = whole.clone();
            for _ in 0..rng.random_range(1..4) {
                let at = rng.random_range(0..bytes.len());
                bytes[at] = rng.random();
            }
            bytes.truncate(rng.random_range(0..=whole.len()));
            let _ = Record::decode(&bytes);
            // The same fields under a check sum that fits.
            bytes.truncate(bytes.len().saturating_sub(SUM_BYTES));
            bytes.extend(crc32fast::hash(&bytes).to_le_bytes());
            let _ = Record::decode(&bytes);
        }
    }
}
