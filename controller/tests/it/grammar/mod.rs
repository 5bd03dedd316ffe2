//! What each control takes and what it refuses, fact by fact: a right program beside one with a fault.

mod apt;
mod beckhoff;
mod fanuc;
mod heidenhain;
mod linuxcnc;
mod plain;
mod siemens;
mod step_nc;

use claymill_controller::{Dialect, Machine, Shape, check, elements};
use claymill_nurbs::Curve3;

/// Something that programs of a control obey or violate.
pub(crate) struct Fact {
    says: &'static str,
    right: Vec<String>,
    faults: Vec<Fault>,
}

/// A program with one fault.
pub(crate) struct Fault {
    text: String,
    rule: &'static str,
    /// Whether the control takes it all the same, and executes something else.
    taken: bool,
}

pub(crate) fn fact(says: &'static str) -> Fact {
    Fact { says, right: Vec::new(), faults: Vec::new() }
}

impl Fact {
    pub(crate) fn right(mut self, text: impl Into<String>) -> Self {
        self.right.push(text.into());
        self
    }

    /// The control refuses it too.
    pub(crate) fn refused(mut self, text: impl Into<String>, rule: &'static str) -> Self {
        self.faults.push(Fault { text: text.into(), rule, taken: false });
        self
    }

    /// The control takes it and does something else.
    pub(crate) fn wrong(mut self, text: impl Into<String>, rule: &'static str) -> Self {
        self.faults.push(Fault { text: text.into(), rule, taken: true });
        self
    }
}

/// A program of the dialect around `body`, at X0 Y0 Z0 with a feed.
pub(crate) fn program(dialect: Dialect, body: &str) -> String {
    match dialect {
        Dialect::Heidenhain => format!(
            "0 BEGIN PGM A MM\n1 TOOL CALL 1 Z S1000\n2 L Z+0 R0 FMAX\n3 L X+0 Y+0 R0 FMAX\n{body}\n8 END PGM A MM\n"
        ),
        Dialect::AptCatia | Dialect::AptCreo => {
            format!("UNITS/MM\nRAPID\nGOTO/0.,0.,0.\nFEDRAT/600.,MMPM\n{body}\nFINI\n")
        }
        Dialect::Siemens => format!("G90 G94 G71\nG0 Z0.\nG0 X0. Y0.\nG1 F600.\n{body}\nM30\n"),
        Dialect::LinuxCnc29 | Dialect::LinuxCnc210 => {
            format!("G90 G94 G21 G64 P0.002\nG0 Z0.\nG0 X0. Y0.\nG1 F600.\n{body}\nM2\n")
        }
        Dialect::StepNc => body.to_owned(),
        _ => format!("G90 G94 G21\nG0 Z0.\nG0 X0. Y0.\nG1 F600.\n{body}\nM30\n"),
    }
}

/// Whether a block is rapid, its feed and its shape.
pub(crate) type Block = (bool, f64, Shape);

pub(crate) fn blocks(dialect: Dialect, body: &str) -> Vec<Block> {
    let text = program(dialect, body);
    let found = elements(&text, dialect, &Machine::default());
    let found = found.unwrap_or_else(|e| panic!("{dialect}: {e:?}\n{text}"));
    found.into_iter().map(|e| (e.rapid, e.feed, e.shape)).collect()
}

/// The first block's curve and feed.
pub(crate) fn curve(dialect: Dialect, body: &str) -> (Curve3, f64) {
    match blocks(dialect, body).swap_remove(0) {
        (false, feed, Shape::Spline(curve)) => (curve, feed),
        other => panic!("{other:?}\n{body}"),
    }
}

/// Every fact has a program that is right, which moves, and one that is refused by the name of its rule.
pub(crate) fn hold(dialect: Dialect, facts: &[Fact]) {
    for Fact { says, right, faults } in facts {
        assert!(!right.is_empty() && !faults.is_empty(), "{dialect}: {says}: both sides are needed");
        for body in right {
            let text = program(dialect, body);
            match check(&text, dialect, &Machine::default()) {
                Ok(blocks) => assert!(blocks > 0, "{dialect}: {says}: nothing moves in\n{text}"),
                Err((line, refusal)) => panic!("{dialect}: {says}: line {line}: {refusal}\n{text}"),
            }
        }
        for Fault { text: body, rule, .. } in faults {
            let text = program(dialect, body);
            match check(&text, dialect, &Machine::default()) {
                Ok(_) => panic!("{dialect}: {says}: taken, though against {rule}:\n{text}"),
                Err((line, refusal)) => {
                    assert_eq!(refusal.rule, *rule, "{dialect}: {says}: line {line}: {refusal}\n{text}");
                    assert!(line >= 1 && !refusal.detail.is_empty(), "{refusal}");
                }
            }
        }
    }
    eprintln!("{dialect}: {} facts", facts.len());
}

/// `text` with a part of it exchanged, which must be there.
pub(crate) fn with(text: &str, from: &str, to: &str) -> String {
    assert!(text.contains(from), "`{from}` is not in\n{text}");
    text.replacen(from, to, 1)
}
