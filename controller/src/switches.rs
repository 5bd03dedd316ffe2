//! The last commanded tool, spindle, coolant and outputs, kept in the queue's file so that a
//! restarted controller commands them again.

use crate::shared::{OUTPUTS_AT, SWITCHES_AT, Word};
use crate::{Consumer, QueueError, Record};

/// What a machine was told beside its paths: kept in the queue's file, so that whoever goes on after a kill can tell it again.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Switches {
    tool: Option<u32>,
    spindle: Option<f64>,
    coolant: Option<bool>,
    /// Outputs that were switched, a bit each, and those of them that are on.
    outputs: u64,
    on: u64,
}

impl Switches {
    /// Takes note of a record; whether anything is to be remembered of it.
    pub(crate) fn note(&mut self, record: &Record) -> bool {
        match *record {
            Record::Tool(number) => self.tool = Some(number),
            Record::Spindle(rpm) => self.spindle = Some(rpm),
            Record::Coolant(on) => self.coolant = Some(on),
            Record::Output { number, on } => {
                let bit = 1u64.checked_shl(number.into()).unwrap_or(0);
                self.outputs |= bit;
                self.on = if on { self.on | bit } else { self.on & !bit };
            }
            Record::Path(_) | Record::End | Record::Feed(_) => return false,
        }
        true
    }

    /// Records that bring a machine that was told `told` to where this one is: tool first, then spindle, coolant, outputs.
    pub(crate) fn missing(&self, told: &Switches) -> Vec<Record> {
        let mut records = Vec::new();
        records.extend(self.tool.filter(|_| told.tool.is_none()).map(Record::Tool));
        records.extend(self.spindle.filter(|_| told.spindle.is_none()).map(Record::Spindle));
        records.extend(self.coolant.filter(|_| told.coolant.is_none()).map(Record::Coolant));
        let left = |bit: &u16| (self.outputs & !told.outputs) >> bit & 1 == 1;
        records.extend((0..64).filter(left).map(|number| {
            let on = self.on >> number & 1 == 1;
            Record::Output { number, on }
        }));
        records
    }

    fn words(&self) -> [Word; 2] {
        let first = Word {
            bytes: self.tool.map_or(u64::MAX, u64::from),
            records: self.spindle.map_or(u64::MAX, f64::to_bits),
            beats: self.coolant.map_or(u64::MAX, u64::from),
        };
        [first, Word { bytes: self.outputs, records: self.on, beats: 0 }]
    }

    fn of_words([first, second]: [Word; 2]) -> Self {
        Switches {
            tool: u32::try_from(first.bytes).ok(),
            spindle: Some(f64::from_bits(first.records)).filter(|rpm| rpm.is_finite()),
            coolant: match first.beats {
                0 => Some(false),
                1 => Some(true),
                _ => None,
            },
            outputs: second.bytes,
            on: second.records,
        }
    }
}

impl Consumer {
    /// What the machine was told by whoever took from this queue.
    pub(crate) fn switches(&self) -> Result<Switches, QueueError> {
        let [first, second] = [SWITCHES_AT, OUTPUTS_AT].map(|at| self.shared.read_word(at));
        Ok(Switches::of_words([first?, second?]))
    }

    /// Notes what the machine is told, before it is.
    pub(crate) fn set_switches(&mut self, switches: &Switches) -> Result<(), QueueError> {
        for (at, word) in [SWITCHES_AT, OUTPUTS_AT].into_iter().zip(switches.words()) {
            self.shared.write_word(at, word)?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_told_survives_and_is_told_in_order() {
        let all = [
            Record::Tool(7),
            Record::Spindle(-900.0),
            Record::Coolant(true),
            Record::Output { number: 0, on: true },
            Record::Output { number: 63, on: false },
        ];
        let mut switches = Switches::default();
        assert_eq!(Switches::of_words(switches.words()), switches);
        assert!(switches.missing(&Switches::default()).is_empty());
        for record in all.iter().rev() {
            assert!(switches.note(record));
        }
        let again = Switches::of_words(switches.words());
        assert_eq!(again.missing(&Switches::default()), all);
        let mut told = Switches::default();
        told.note(&Record::Spindle(0.0));
        told.note(&Record::Output { number: 63, on: true });
        assert_eq!(again.missing(&told), [all[0].clone(), all[2].clone(), all[3].clone()]);
    }
}
