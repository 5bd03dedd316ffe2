//! Conditions of processes and stages: `material = clay & (machine.axes >= 5 | rest.area_mm2 > 1000)`.

use std::collections::BTreeMap;
use std::fmt;

use thiserror::Error;

/// What conditions may ask for; `true` where it is a number.
pub const KNOWN_FACTS: [(&str, bool); 12] = [
    ("material", false),
    ("machine.name", false),
    ("machine.axes", true),
    ("machine.max_rpm", true),
    ("stock.thickness_mm", true),
    ("stock.varies_mm", true),
    ("rest.area_mm2", true),
    ("rest.volume_mm3", true),
    ("valleys.length_mm", true),
    ("tool.radius_mm", true),
    ("tool.shape", false),
    ("part.height_mm", true),
];

/// Conditions are no longer than this, bytes, and nest no deeper.
const LONGEST: usize = 1000;
const DEEPEST: usize = 50;

/// A value of a fact.
#[derive(Debug, Clone, PartialEq)]
pub enum Fact {
    /// A number.
    Number(f64),
    /// A text.
    Text(String),
}

/// What is known when a condition is asked.
pub type Facts = BTreeMap<&'static str, Fact>;

/// A condition that was read.
#[derive(Debug, Clone, PartialEq)]
pub struct Condition {
    text: String,
    root: Node,
}

#[derive(Debug, Clone, PartialEq)]
enum Node {
    All(Vec<Node>),
    Any(Vec<Node>),
    Not(Box<Node>),
    Compare { name: &'static str, relation: Relation, value: Fact },
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Relation {
    Equal,
    Unequal,
    Less,
    AtMost,
    More,
    AtLeast,
}

/// Why a text is no condition.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("`{text}` is no condition: {what} at byte {at}")]
pub struct ConditionError {
    /// The text.
    pub text: String,
    /// What is wrong.
    pub what: String,
    /// Where.
    pub at: usize,
}

impl Condition {
    /// Reads a condition: comparisons with `=`, `!=`, `<`, `<=`, `>`, `>=`, joined by `&` and `|`, with `!` and parentheses.
    /// `&` binds before `|`.
    ///
    /// # Errors
    /// What is no comparison of a known fact, with its place.
    pub fn parse(text: &str) -> Result<Self, ConditionError> {
        let fail =
            |(what, at): (String, usize)| ConditionError { text: text.chars().take(80).collect(), what, at };
        if text.len() > LONGEST {
            return Err(fail((format!("it is longer than {LONGEST} bytes"), LONGEST)));
        }
        let mut reader = Reader { text, at: 0, depth: 0 };
        let root = reader.any().map_err(fail)?;
        reader.skip_space();
        if reader.at < text.len() {
            return Err(fail(("`&`, `|` or the end is missing".into(), reader.at)));
        }
        Ok(Condition { text: text.trim().to_owned(), root })
    }

    /// Whether it holds; `None` where that depends on what is not known yet.
    #[must_use]
    pub fn holds(&self, facts: &Facts) -> Option<bool> {
        self.root.holds(facts)
    }
}

impl fmt::Display for Condition {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.text)
    }
}

impl Node {
    fn holds(&self, facts: &Facts) -> Option<bool> {
        // What decides, decides although others are unknown.
        let decided = |nodes: &[Node], by: bool| {
            let all: Vec<Option<bool>> = nodes.iter().map(|n| n.holds(facts)).collect();
            if all.contains(&Some(by)) {
                return Some(by);
            }
            (!all.contains(&None)).then_some(!by)
        };
        match self {
            Node::All(nodes) => decided(nodes, false),
            Node::Any(nodes) => decided(nodes, true),
            Node::Not(node) => node.holds(facts).map(|h| !h),
            Node::Compare { name, relation, value } => match (facts.get(name)?, value) {
                (Fact::Number(a), Fact::Number(b)) => Some(relation.of_numbers(*a, *b)),
                (Fact::Text(a), Fact::Text(b)) => {
                    Some((a.to_lowercase() == b.to_lowercase()) == (*relation == Relation::Equal))
                }
                _ => None,
            },
        }
    }
}

impl Relation {
    #[expect(clippy::float_cmp, reason = "equality is what is asked for")]
    fn of_numbers(self, a: f64, b: f64) -> bool {
        match self {
            Relation::Equal => a == b,
            Relation::Unequal => a != b,
            Relation::Less => a < b,
            Relation::AtMost => a <= b,
            Relation::More => a > b,
            Relation::AtLeast => a >= b,
        }
    }
}

struct Reader<'t> {
    text: &'t str,
    at: usize,
    depth: usize,
}

type Read<T> = Result<T, (String, usize)>;

impl<'t> Reader<'t> {
    fn rest(&self) -> &'t str {
        &self.text[self.at..]
    }

    fn skip_space(&mut self) {
        self.at = self.text.len() - self.rest().trim_start().len();
    }

    fn takes(&mut self, mark: &str) -> bool {
        self.skip_space();
        let found = self.rest().starts_with(mark);
        self.at += if found { mark.len() } else { 0 };
        found
    }

    fn any(&mut self) -> Read<Node> {
        let mut nodes = vec![self.all()?];
        while self.takes("|") {
            nodes.push(self.all()?);
        }
        Ok(if nodes.len() == 1 { nodes.remove(0) } else { Node::Any(nodes) })
    }

    fn all(&mut self) -> Read<Node> {
        let mut nodes = vec![self.one()?];
        while self.takes("&") {
            nodes.push(self.one()?);
        }
        Ok(if nodes.len() == 1 { nodes.remove(0) } else { Node::All(nodes) })
    }

    fn one(&mut self) -> Read<Node> {
        self.depth += 1;
        if self.depth > DEEPEST {
            return Err((format!("it nests more than {DEEPEST} times"), self.at));
        }
        let node = if self.takes("!") {
            Node::Not(Box::new(self.one()?))
        } else if self.takes("(") {
            let inside = self.any()?;
            if !self.takes(")") {
                return Err(("`)` is missing".into(), self.at));
            }
            inside
        } else {
            self.compare()?
        };
        self.depth -= 1;
        Ok(node)
    }

    fn word(&mut self) -> &'t str {
        self.skip_space();
        let rest = self.rest();
        let end = rest.find(|c: char| !(c.is_alphanumeric() || "._-+".contains(c))).unwrap_or(rest.len());
        self.at += end;
        &rest[..end]
    }

    fn compare(&mut self) -> Read<Node> {
        self.skip_space();
        let begin = self.at;
        let word = self.word();
        let Some((name, is_number)) = KNOWN_FACTS.iter().find(|(name, _)| *name == word) else {
            let known: Vec<&str> = KNOWN_FACTS.iter().map(|(name, _)| *name).collect();
            return Err((format!("`{word}` is not known; there are {}", known.join(", ")), begin));
        };
        let marks = [
            ("!=", Relation::Unequal),
            ("<=", Relation::AtMost),
            (">=", Relation::AtLeast),
            ("=", Relation::Equal),
            ("<", Relation::Less),
            (">", Relation::More),
        ];
        let relation = marks.into_iter().find(|(mark, _)| self.takes(mark)).map(|(_, relation)| relation);
        let relation = relation.ok_or_else(|| ("=, !=, <, <=, > or >= is missing".to_owned(), self.at))?;
        self.skip_space();
        let begin = self.at;
        let value = if self.takes("\"") {
            let inside = self.rest().split_once('"').map(|(inside, _)| inside);
            let inside = inside.ok_or_else(|| ("`\"` is missing at its end".to_owned(), begin))?;
            self.at += inside.len() + 1;
            inside
        } else {
            self.word()
        };
        if value.is_empty() {
            return Err(("a value is missing".into(), begin));
        }
        let value = match (*is_number, value.parse::<f64>()) {
            (true, Ok(v)) if v.is_finite() => Fact::Number(v),
            (true, _) => return Err((format!("`{name}` is a number, and `{value}` is none"), begin)),
            (false, _) if matches!(relation, Relation::Equal | Relation::Unequal) => {
                Fact::Text(value.to_owned())
            }
            (false, _) => return Err((format!("`{name}` is a text: it is only = or != another"), begin)),
        };
        Ok(Node::Compare { name, relation, value })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn facts() -> Facts {
        let mut facts = Facts::new();
        facts.insert("material", Fact::Text("clay".into()));
        facts.insert("machine.axes", Fact::Number(3.0));
        facts
    }

    #[test]
    fn conditions_hold_fail_or_wait() {
        let cases = [
            ("material = clay", Some(true)),
            ("material = \"Clay\" & machine.axes >= 5", Some(false)),
            ("material=foam | machine.axes<=3", Some(true)),
            ("!(material = foam) & !machine.axes > 3", Some(true)),
            ("rest.area_mm2 > 10", None),
            ("rest.area_mm2 > 10 & material = foam", Some(false)),
            ("rest.area_mm2 > 10 | material != foam", Some(true)),
            // `&` binds before `|`.
            ("material = clay | material = clay & machine.axes = 5", Some(true)),
        ];
        for (text, holds) in cases {
            assert_eq!(Condition::parse(text).unwrap().holds(&facts()), holds, "{text}");
        }
    }

    #[test]
    fn what_is_no_condition_is_refused_with_its_place() {
        let cases = [
            ("", 0, "is not known"),
            ("color = red", 0, "`color` is not known"),
            ("material", 8, "is missing"),
            ("material < clay", 11, "only = or !="),
            ("machine.axes = five", 15, "`five` is none"),
            ("(material = clay", 16, "`)` is missing"),
            ("material = clay clay", 16, "the end is missing"),
            ("material = ", 11, "a value is missing"),
            ("material = \"clay", 11, "is missing at its end"),
        ];
        for (text, at, what) in cases {
            let error = Condition::parse(text).unwrap_err();
            assert!(error.what.contains(what) && error.at == at, "{text}: {error}");
        }
        assert!(Condition::parse(&"(".repeat(900)).unwrap_err().what.contains("nests"));
        assert!(Condition::parse(&"!".repeat(2000)).unwrap_err().what.contains("longer"));
    }
}
