//! Recognises a shop's own blocks from the machine definition in a program, tool numbers included.

use crate::Machine;

/// Blocks of a machine definition, to be known again in a program.
pub(crate) struct OwnBlocks(Vec<Vec<String>>);

const TOOL: &str = "{tool}";

impl OwnBlocks {
    /// `bare` takes from a line what the reader takes from it: comments and line numbers.
    pub(crate) fn new(machine: &Machine, bare: impl Fn(&str) -> String) -> Self {
        let fixed = machine.own_blocks().map(|line| vec![bare(line)]);
        let tool_change = machine.tool_change.iter().flatten();
        let with_tool = tool_change.map(|line| bare(line).split(TOOL).map(str::to_owned).collect());
        OwnBlocks(fixed.chain(with_tool).collect())
    }

    /// Whether a bare line is one of them.
    pub(crate) fn has(&self, text: &str) -> bool {
        self.0.iter().any(|parts| fits(parts, text))
    }
}

/// Whether a text is these parts with one number between them.
fn fits(parts: &[String], text: &str) -> bool {
    let [first, between @ ..] = parts else { return false };
    let Some(mut rest) = text.strip_prefix(first.as_str()) else { return false };
    let number: String = rest.chars().take_while(char::is_ascii_digit).collect();
    for part in between {
        let behind = rest.strip_prefix(number.as_str()).filter(|_| !number.is_empty());
        match behind.and_then(|b| b.strip_prefix(part.as_str())) {
            Some(behind) => rest = behind,
            None => return false,
        }
    }
    rest.is_empty()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tool_s_number_is_the_same_everywhere() {
        let machine = Machine {
            start: vec!["G91 G28 Z0.".into()],
            tool_change: Some(vec!["T{tool} M6".into(), "G43 H{tool} D{tool}".into(), "T{tool}".into()]),
            ..Machine::default()
        };
        let own = OwnBlocks::new(&machine, str::to_owned);
        for known in ["G91 G28 Z0.", "T1 M6", "T12 M6", "G43 H3 D3", "T7"] {
            assert!(own.has(known), "{known}");
        }
        for other in ["G91 G28 Z0. X0.", "T M6", "T1 M60", "G43 H3 D4", "TRANS X10", "T7 M3", ""] {
            assert!(!own.has(other), "{other}");
        }
    }
}
