//! What a file unfolds to. Entities that are used again and again are built as often, so that a few kilobytes can
//! stand for billions of faces: what comes of a file is counted before anything of it is built.
//!
//! ```text
//!   entity ─ refers to ─► entities        Sizes      bytes of text of one face, shared things as often as used
//!   part ─── holds ─────► placed parts    tallies    what all placements of all faces come to
//!                                         Allowance  whether a file of this length may stand for that
//! ```

/// One face may unfold to the text of the whole file so many times, and to so many bytes besides. Faces use most of
/// what they refer to once, and seams twice.
const FACE_TIMES: u64 = 16;
const FACE_BESIDES: u64 = 1 << 20;
/// All faces, wherever they are placed, may unfold to the text of the file so many times, and to so many bytes
/// besides. Each placement costs a file some hundred bytes: only assemblies within assemblies within assemblies, and
/// thousands of parts that are larger than any screw, get here.
const WHOLE_TIMES: u64 = 128;
const WHOLE_BESIDES: u64 = 8 << 20;
/// What the placement of a part takes, in the same measure.
pub(crate) const PLACEMENT: u64 = 1000;

/// What a file of some length may unfold to.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Allowance {
    bytes: u64,
}

impl Allowance {
    /// For a file of so many bytes.
    pub(crate) fn new(bytes: usize) -> Self {
        Allowance { bytes: bytes as u64 }
    }

    /// Whether one face may have the size.
    pub(crate) fn suits_face(self, size: u64) -> bool {
        size <= self.bytes.saturating_mul(FACE_TIMES).saturating_add(FACE_BESIDES)
    }

    /// Whether all faces together may have the size.
    pub(crate) fn suits_whole(self, size: u64) -> bool {
        size <= self.bytes.saturating_mul(WHOLE_TIMES).saturating_add(WHOLE_BESIDES)
    }
}

/// The size of entities with all that they refer to, in bytes of text, counted as often as it is referred to.
#[derive(Debug)]
pub(crate) struct Sizes {
    /// By index; of those that are open it is 0, since readers refuse what refers to itself.
    known: Vec<Option<u64>>,
}

/// An entity whose references are being looked at.
struct Open {
    at: usize,
    own: u64,
    parts: Vec<usize>,
    next: usize,
}

impl Sizes {
    /// For so many entities.
    pub(crate) fn new(count: usize) -> Self {
        Sizes { known: vec![None; count] }
    }

    /// The unfolded size of entity `root`; `look` gives an entity's own length and what it refers to.
    pub(crate) fn of(&mut self, root: usize, look: impl Fn(usize) -> (u64, Vec<usize>)) -> u64 {
        let mut open = Vec::new();
        let begin = |known: &mut Vec<Option<u64>>, at: usize, open: &mut Vec<Open>| {
            known[at] = Some(0);
            let (own, parts) = look(at);
            open.push(Open { at, own, parts, next: 0 });
        };
        match self.known.get(root) {
            None => return 0,
            Some(Some(size)) => return *size,
            Some(None) => begin(&mut self.known, root, &mut open),
        }
        while let Some(Open { at, own, parts, next }) = open.last_mut() {
            let Some(part) = parts.get(*next).copied() else {
                let parts = parts.iter().filter_map(|p| self.known.get(*p).copied().flatten());
                self.known[*at] = Some(parts.fold(*own, u64::saturating_add));
                open.pop();
                continue;
            };
            *next += 1;
            if self.known.get(part) == Some(&None) {
                begin(&mut self.known, part, &mut open);
            }
        }
        self.known[root].unwrap_or(0)
    }
}

/// How much comes of a part, or of it and all that stands inside of it.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) struct Tally {
    pub(crate) size: u64,
    pub(crate) parts: u64,
    pub(crate) faces: u64,
}

impl Tally {
    pub(crate) fn plus(self, other: Tally) -> Self {
        Tally {
            size: self.size.saturating_add(other.size),
            parts: self.parts.saturating_add(other.parts),
            faces: self.faces.saturating_add(other.faces),
        }
    }
}

impl std::fmt::Display for Tally {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let many = |n: u64| if n == u64::MAX { "endlessly many".to_owned() } else { n.to_string() };
        write!(f, "{} placed parts with {} faces", many(self.parts), many(self.faces))
    }
}

/// What every part comes to with all that stands inside of it down to `depth`: `own` is what it holds itself,
/// `inside` the parts that are placed in it, as often as they are.
pub(crate) fn tallies(own: &[Tally], inside: &[Vec<usize>], depth: usize) -> Vec<Tally> {
    let mut sums = own.to_vec();
    for _ in 1..depth {
        let of = |(own, inside): (&Tally, &Vec<usize>)| {
            inside.iter().filter_map(|part| sums.get(*part)).fold(*own, |sum, part| sum.plus(*part))
        };
        let next: Vec<Tally> = own.iter().zip(inside).map(of).collect();
        if next == sums {
            break;
        }
        sums = next;
    }
    sums
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_used_twice_counts_twice_and_rings_end() {
        let parts = [vec![1, 1], vec![2, 2], vec![], vec![4], vec![3, 9]];
        let size = |root| Sizes::new(parts.len()).of(root, |at| (10, parts[at].clone()));
        assert_eq!([2, 1, 0].map(size), [10, 30, 70]);
        assert_eq!(size(3), 20);
        assert_eq!(size(9), 0);
    }

    #[test]
    fn doubling_is_counted_without_being_done() {
        let mut sizes = Sizes::new(80);
        assert_eq!(sizes.of(0, |at| (1, vec![at + 1, at + 1])), u64::MAX);
        let own = [Tally { size: 1, parts: 1, faces: 1 }; 80];
        let inside: Vec<Vec<usize>> = (1..=80).map(|i| vec![i, i]).collect();
        assert_eq!(tallies(&own, &inside, 12)[0].parts, (1 << 12) - 1);
        assert_eq!(tallies(&own, &inside, 99)[0].faces, u64::MAX);
        // A part in itself counts as deep as one looks.
        assert_eq!(tallies(&own[..1], &[vec![0]], 32)[0].parts, 32);
    }

    #[test]
    fn small_files_stand_for_little() {
        let file = Allowance::new(7000);
        assert!(file.suits_face(1 << 20) && !file.suits_face(2 << 20));
        assert!(file.suits_whole(8 << 20) && !file.suits_whole(4096 * 6 * 2500));
    }
}
