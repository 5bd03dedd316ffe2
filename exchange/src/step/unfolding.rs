//! What the faces of a file unfold to.

use memchr::{memchr, memchr2, memmem};

use super::part21::{Part21, name_length};
use crate::unfolding::{Allowance, Sizes};

/// Measures instances with all that they refer to.
#[derive(Debug)]
pub(super) struct Unfolding<'a> {
    file: &'a Part21<'a>,
    sizes: Sizes,
}

impl<'a> Unfolding<'a> {
    pub(super) fn new(file: &'a Part21<'a>) -> Self {
        Unfolding { file, sizes: Sizes::new(file.len()) }
    }

    /// The unfolded size of `#id`, bytes of text.
    pub(super) fn size(&mut self, id: u64) -> u64 {
        let Some(root) = self.file.position(id) else { return 0 };
        let look = |at: usize| {
            let text = self.file.text_at(at);
            (text.len() as u64, references(self.file, text))
        };
        self.sizes.of(root, look)
    }

    /// The unfolded size of the face `#id`; an error where it is too large for one face.
    pub(super) fn face(&mut self, id: u64) -> Result<u64, u64> {
        let size = self.size(id);
        if Allowance::new(self.file.size()).suits_face(size) { Ok(size) } else { Err(size) }
    }
}

/// Positions of what the reader follows from an instance. It does not go through a pcurve to the surface below, and a
/// bound that a face lists again is no other bound.
fn references(file: &Part21, text: &[u8]) -> Vec<usize> {
    let name = &text[..name_length(text)];
    // Behind this the next reference is that of a surface below.
    let mut below = match name {
        b"PCURVE" | b"DEGENERATE_PCURVE" => Some(0),
        b"" => memmem::find(text, b"PCURVE("),
        _ => None,
    };
    let mut found = Vec::new();
    let mut at = 0;
    while let Some(k) = memchr2(b'#', b'\'', &text[at..]) {
        at += k + 1;
        if text[at - 1] == b'\'' {
            let Some(end) = memchr(b'\'', &text[at..]) else { break };
            at += end + 1;
            continue;
        }
        if below.is_some_and(|from| at > from) {
            below = None;
            continue;
        }
        let digits = text[at..].iter().take_while(|b| b.is_ascii_digit());
        let id = digits.fold(0_u64, |n, d| n.saturating_mul(10).saturating_add(u64::from(d - b'0')));
        found.extend(file.position(id));
    }
    if matches!(name, b"ADVANCED_FACE" | b"FACE_SURFACE") {
        found.sort_unstable();
        found.dedup();
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sizes(data: &str, ids: &[u64]) -> Vec<u64> {
        let text = format!("ISO-10303-21;\nHEADER;\nENDSEC;\nDATA;\n{data}\nENDSEC;\nEND-ISO-10303-21;\n");
        let file = Part21::index(text.as_bytes()).unwrap();
        let mut unfolding = Unfolding::new(&file);
        ids.iter().map(|id| unfolding.size(*id)).collect()
    }

    #[test]
    fn what_is_referred_to_twice_counts_twice() {
        let b = "B('#2 ''#2',#3)";
        let sized = sizes(&format!("#1=A(#2,#2);\n#2={b};\n#3=C();"), &[3, 2, 1]);
        let [one, two] = [3, 3 + b.len() as u64];
        assert_eq!(sized, [one, two, 8 + 2 * two]);
        assert_eq!(sizes("#1=A(#9);", &[1, 9]), [5, 0]);
    }

    #[test]
    fn the_surface_below_a_pcurve_and_bounds_listed_again_do_not_count() {
        for pcurve in ["PCURVE('',#9,#2)", "(CURVE()PCURVE(#9,#2))", "ADVANCED_FACE('',(#2,#2,#2),#2)"] {
            let data = format!("#1={pcurve};\n#2=C();\n#9=S(1234567890);");
            assert_eq!(sizes(&data, &[1]), [pcurve.len() as u64 + 3], "{pcurve}");
        }
    }
}
