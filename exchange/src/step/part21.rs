//! The exchange structure of ISO 10303-21: one fast pass finds where every instance lies, arguments are
//! parsed only when an instance is asked for.

use std::sync::atomic::{AtomicBool, Ordering};

use memchr::{memchr, memchr2, memchr3, memmem};

use super::StepError;
use super::value::{Entity, parse_instance};

/// An indexed file.
#[derive(Debug)]
pub(super) struct Part21<'a> {
    bytes: &'a [u8],
    /// Sorted by id, without duplicates.
    instances: Vec<Instance>,
    /// Whether each instance was asked for.
    used: Vec<AtomicBool>,
    /// Statements of the header section: `FILE_NAME(…)`.
    header: Vec<&'a [u8]>,
    /// Ids that occur more than once; the first instance counts.
    pub(super) duplicates: Vec<u64>,
}

/// Where the right-hand side of `#id = …;` lies.
#[derive(Debug, Clone, Copy)]
struct Instance {
    id: u64,
    start: usize,
    end: usize,
}

/// The file ends in the middle.
#[derive(Debug, PartialEq)]
pub(super) struct BreaksOff {
    pub(super) line: usize,
    pub(super) what: &'static str,
}

impl<'a> Part21<'a> {
    /// Finds the instances of all data sections.
    pub(super) fn index(bytes: &'a [u8]) -> Result<Self, BreaksOff> {
        let mut file = Part21 {
            bytes,
            instances: Vec::with_capacity(bytes.len() / 72),
            used: Vec::new(),
            header: Vec::new(),
            duplicates: Vec::new(),
        };
        let mut at = 0;
        loop {
            at = skip_blank(bytes, at);
            if at >= bytes.len() {
                let what = "the line END-ISO-10303-21 is missing";
                return Err(file.breaks_off(bytes.len(), what));
            }
            let end = statement_end(bytes, at)
                .ok_or_else(|| file.breaks_off(at, "a statement has no closing semicolon"))?;
            let statement = &bytes[at..end];
            if statement.starts_with(b"#") {
                file.instances.extend(left_side(bytes, at, end));
            } else if statement.starts_with(b"FILE_") {
                file.header.push(statement);
            } else if statement.starts_with(b"END-ISO-10303-21") {
                break;
            }
            at = end + 1;
        }
        // Stable: of equal ids the first in the file stays.
        if !file.instances.is_sorted_by_key(|i| i.id) {
            file.instances.sort_by_key(|i| i.id);
        }
        let duplicates = &mut file.duplicates;
        file.instances.dedup_by(|later, first| {
            let same = later.id == first.id;
            if same {
                duplicates.push(later.id);
            }
            same
        });
        file.used.resize_with(file.instances.len(), AtomicBool::default);
        Ok(file)
    }

    fn breaks_off(&self, at: usize, what: &'static str) -> BreaksOff {
        BreaksOff { line: self.line(at), what }
    }

    /// Line number (from 1) of a byte.
    fn line(&self, at: usize) -> usize {
        1 + memchr::memchr_iter(b'\n', &self.bytes[..at.min(self.bytes.len())]).count()
    }

    /// Parses instance `#id`.
    pub(super) fn get(&self, id: u64) -> Result<Entity<'a>, StepError> {
        let index = self.position(id).ok_or(StepError::Missing { id })?;
        self.used[index].store(true, Ordering::Relaxed);
        self.parse(&self.instances[index])
    }

    fn parse(&self, at: &Instance) -> Result<Entity<'a>, StepError> {
        parse_instance(at.id, &self.bytes[at.start..at.end])
            .map_err(|offset| StepError::Syntax { id: at.id, line: self.line(at.start + offset) })
    }

    /// All instances for whose type name `wanted` holds, in order of id. Complex instances are asked with the
    /// empty name.
    pub(super) fn of_type(&self, wanted: impl Fn(&[u8]) -> bool) -> impl Iterator<Item = u64> {
        self.type_names().filter(move |(_, name)| wanted(name)).map(|(id, _)| id)
    }

    /// Id and type name of every instance; the name of a complex instance is empty.
    pub(super) fn type_names(&self) -> impl Iterator<Item = (u64, &'a [u8])> {
        self.instances.iter().map(|i| {
            let text = &self.bytes[i.start..i.end];
            (i.id, &text[..name_length(text)])
        })
    }

    /// Type name of every instance and whether it was asked for.
    pub(super) fn usage(&self) -> impl Iterator<Item = (&'a [u8], bool)> {
        let used = self.used.iter().map(|u| u.load(Ordering::Relaxed));
        self.type_names().map(|(_, name)| name).zip(used)
    }

    /// The text of `#id`, unparsed; empty when there is none.
    pub(super) fn text(&self, id: u64) -> &'a [u8] {
        self.position(id).map_or(&[], |k| self.text_at(k))
    }

    /// Where `#id` stands among all instances.
    pub(super) fn position(&self, id: u64) -> Option<usize> {
        // Most writers leave no number out.
        let first = self.instances.first()?.id;
        let guess = usize::try_from(id.checked_sub(first)?).ok()?;
        if self.instances.get(guess).is_some_and(|i| i.id == id) {
            return Some(guess);
        }
        self.instances.binary_search_by_key(&id, |i| i.id).ok()
    }

    /// The text of the instance at a position.
    pub(super) fn text_at(&self, position: usize) -> &'a [u8] {
        let at = &self.instances[position];
        &self.bytes[at.start..at.end]
    }

    /// Number of instances.
    pub(super) fn len(&self) -> usize {
        self.instances.len()
    }

    /// Length of the file, bytes.
    pub(super) fn size(&self) -> usize {
        self.bytes.len()
    }

    /// The largest id in the file.
    pub(super) fn largest_id(&self) -> u64 {
        self.instances.last().map_or(0, |i| i.id)
    }

    /// Header statement `name`, parsed as if it were an instance.
    pub(super) fn header(&self, name: &str) -> Option<Entity<'a>> {
        let text = self.header.iter().find(|s| &s[..name_length(s)] == name.as_bytes())?;
        parse_instance(0, text).ok()
    }
}

/// Length of the keyword that `text` starts with.
pub(super) fn name_length(text: &[u8]) -> usize {
    text.iter().position(|b| !(b.is_ascii_alphanumeric() || *b == b'_')).unwrap_or(text.len())
}

/// The first byte from `at` on that is neither white space nor comment.
pub(super) fn skip_blank(bytes: &[u8], mut at: usize) -> usize {
    while let Some(b) = bytes.get(at) {
        if b.is_ascii_whitespace() || *b == 0 {
            at += 1;
        } else if bytes[at..].starts_with(b"/*") {
            at = memmem::find(&bytes[at..], b"*/").map_or(bytes.len(), |k| at + k + 2);
        } else {
            break;
        }
    }
    at
}

/// Where the semicolon of the statement that starts at `at` is.
fn statement_end(bytes: &[u8], mut at: usize) -> Option<usize> {
    loop {
        at += memchr3(b';', b'\'', b'/', &bytes[at..])?;
        match bytes[at] {
            b';' => return Some(at),
            b'\'' => match string_end(bytes, at + 1)? {
                StringEnd::Quote(end) => at = end + 1,
                StringEnd::Lost(semicolon) => return Some(semicolon),
            },
            _ if bytes[at..].starts_with(b"/*") => at += 2 + memmem::find(&bytes[at + 2..], b"*/")? + 2,
            _ => at += 1,
        }
    }
}

enum StringEnd {
    Quote(usize),
    Lost(usize),
}

/// Where the string whose first character is at `at` ends. A quote that was lost must not turn the rest of
/// the file inside out: a semicolon with `#17 =` on the next line ends the statement even inside a string.
fn string_end(bytes: &[u8], mut at: usize) -> Option<StringEnd> {
    loop {
        at += memchr2(b'\'', b';', bytes.get(at..)?)?;
        if bytes[at] == b'\'' {
            return Some(StringEnd::Quote(at));
        }
        let next = skip_blank(bytes, at + 1);
        let end = (next + 24).min(bytes.len());
        if bytes[at..next].contains(&b'\n') && left_side(bytes, next, end).is_some() {
            return Some(StringEnd::Lost(at));
        }
        at += 1;
    }
}

/// Reads `#id =` at `start` and gives the instance up to `end`.
fn left_side(bytes: &[u8], start: usize, end: usize) -> Option<Instance> {
    let text = bytes[start..end].strip_prefix(b"#")?;
    let digits = text.iter().position(|b| !b.is_ascii_digit())?;
    let id = std::str::from_utf8(&text[..digits]).ok()?.parse().ok()?;
    let equals = memchr(b'=', text)?;
    let blank = text[digits..equals].iter().all(u8::is_ascii_whitespace);
    blank.then(|| Instance { id, start: skip_blank(bytes, start + 1 + equals + 1).min(end), end })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn file(data: &str) -> String {
        format!(
            "ISO-10303-21;\nHEADER;\nFILE_NAME('a;b''c','');\nENDSEC;\nDATA;\n{data}\nENDSEC;\nEND-ISO-10303-21;\n"
        )
    }

    #[test]
    fn strings_comments_and_several_sections_are_told_apart() {
        let text = file(
            "#1=A('it''s; #9=X()');/* #8=Y(); */ #2 =\n B(\n#1);\nENDSEC;\nDATA('second',('S'));\n#7= ( P() Q(1.) );",
        );
        let f = Part21::index(text.as_bytes()).unwrap();
        let names: Vec<_> = f.type_names().collect();
        assert_eq!(names, [(1, &b"A"[..]), (2, b"B"), (7, b"")]);
        assert_eq!(f.get(7).unwrap().part("Q").unwrap().number(0).unwrap(), 1.0);
        assert!(matches!(f.get(8), Err(StepError::Missing { id: 8 })));
        assert_eq!(f.header("FILE_NAME").unwrap().only().unwrap().text(0), "a;b'c");
    }

    #[test]
    fn a_lost_quote_costs_one_instance_only() {
        let text = file("#1=A('broken,(1.));\n#2=B('x');\n#3=B('y');");
        let f = Part21::index(text.as_bytes()).unwrap();
        assert_eq!(f.type_names().count(), 3);
        assert!(matches!(f.get(1), Err(StepError::Syntax { id: 1, line: 6 })));
        assert!(f.get(2).is_ok());
    }

    #[test]
    fn a_truncated_file_says_where() {
        let text = file("#1=A('x');\n#2=B('y');");
        let cut = &text[..text.len() - 40];
        assert!(Part21::index(cut.as_bytes()).is_err());
        let cut = &text[..text.find("y')").unwrap()];
        assert_eq!(Part21::index(cut.as_bytes()).unwrap_err().line, 7);
    }

    #[test]
    fn of_equal_ids_the_first_counts() {
        let text = file("#2=A();\n#1=C();\n#2=B();");
        let f = Part21::index(text.as_bytes()).unwrap();
        assert_eq!(f.get(2).unwrap().name(), "A");
        assert_eq!(f.duplicates, [2]);
    }
}
