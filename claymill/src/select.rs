//! Faces named by text: `region:3`, `layer:NAME`, `colour:#RRGGBB`, `face:10-20`, as [`Job::only`](crate::Job::only)
//! and others take them.

use std::collections::BTreeSet;

use claymill_nurbs::{Face, Model};
use thiserror::Error;

/// Why a text names no faces of a model.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum SelectError {
    /// It has none of the known forms.
    #[error("`{text}` names no region, layer, colour or face")]
    Form {
        /// The text.
        text: String,
        /// Whether regions may be named.
        has_regions: bool,
    },
    /// A number beyond the last one.
    #[error("`{text}`: there are only {count} {what}, counted from 0")]
    Beyond {
        /// The text.
        text: String,
        /// How many there are.
        count: usize,
        /// Of what: `faces` or `regions`.
        what: &'static str,
        /// Whether regions may be named.
        has_regions: bool,
    },
    /// No face has this layer or colour.
    #[error("`{text}`: no face has this {what}")]
    Absent {
        /// The text.
        text: String,
        /// `layer` or `colour`.
        what: &'static str,
        /// The names that faces have.
        names: Vec<String>,
    },
    /// A range whose last face comes before its first.
    #[error("`{text}` runs backwards")]
    Backwards {
        /// The text.
        text: String,
        /// The face before the dash.
        first: usize,
        /// The face behind it.
        last: usize,
    },
}

/// What a text names.
#[derive(Debug, Clone, PartialEq)]
enum Choice {
    Region(usize),
    Faces(usize, usize),
    Layer(String),
    Colour(String),
}

const FORMS: &str =
    "Write region:3, layer:NAME, colour:#RRGGBB, face:17 or face:10-20; `claymill merge` lists regions.";
/// Before there are regions.
const FORMS_OF_FACES: &str = "Write layer:NAME, colour:#RRGGBB, face:17 or face:10-20, several with commas.";
/// Names listed in a message.
const LISTED: usize = 12;

impl SelectError {
    /// What to do about it, in one sentence.
    #[must_use]
    pub fn advice(&self) -> String {
        match self {
            SelectError::Form { has_regions, .. } | SelectError::Beyond { has_regions, .. } => {
                if *has_regions { FORMS } else { FORMS_OF_FACES }.to_owned()
            }
            SelectError::Absent { what, names, .. } if names.is_empty() => {
                format!("The faces of this file have no {what}.")
            }
            SelectError::Absent { names, .. } => {
                let mut listed: Vec<String> = names.iter().take(LISTED).cloned().collect();
                if names.len() > LISTED {
                    listed.push(format!("and {} more", names.len() - LISTED));
                }
                format!("There are: {}.", listed.join(", "))
            }
            SelectError::Backwards { first, last, .. } => format!("Write face:{last}-{first}."),
        }
    }
}

fn parse(text: &str, regions: Option<usize>, model: &Model) -> Result<Choice, SelectError> {
    let has_regions = regions.is_some();
    let bad = || SelectError::Form { text: text.to_owned(), has_regions };
    let (kind, value) = text.split_once(':').ok_or_else(bad)?;
    let number = |v: &str, count: usize, what: &'static str| {
        let n: usize = v.parse().map_err(|_| bad())?;
        if n < count {
            Ok(n)
        } else {
            Err(SelectError::Beyond { text: text.to_owned(), count, what, has_regions })
        }
    };
    let there = |choice: Choice, name: fn(&Face) -> Option<String>, what: &'static str| {
        if model.faces.iter().any(|f| choice.is(f)) {
            return Ok(choice);
        }
        let names: BTreeSet<String> = model.faces.iter().filter_map(name).collect();
        Err(SelectError::Absent { text: text.to_owned(), what, names: names.into_iter().collect() })
    };
    match (kind, regions) {
        ("region", Some(count)) => Ok(Choice::Region(number(value, count, "regions")?)),
        ("layer", _) => there(Choice::Layer(value.to_owned()), |f| f.source.layer.clone(), "layer"),
        ("colour", _) => {
            let choice = Choice::Colour(value.to_lowercase());
            there(choice, |f| f.source.colour.map(colour_name), "colour")
        }
        ("face", _) => {
            let (a, b) = value.split_once('-').unwrap_or((value, value));
            let faces = model.faces.len();
            let (a, b) = (number(a, faces, "faces")?, number(b, faces, "faces")?);
            if b < a {
                return Err(SelectError::Backwards { text: text.to_owned(), first: a, last: b });
            }
            Ok(Choice::Faces(a, b))
        }
        _ => Err(bad()),
    }
}

impl Choice {
    /// Whether it names a face by what the file says of it.
    fn is(&self, face: &Face) -> bool {
        match self {
            Choice::Layer(l) => face.source.layer.as_ref() == Some(l),
            Choice::Colour(c) => face.source.colour.map(colour_name).as_ref() == Some(c),
            Choice::Region(_) | Choice::Faces(..) => false,
        }
    }

    /// Whether it names a face of the model that lies in a region.
    fn names(&self, model: &Model, face: usize, region: Option<usize>) -> bool {
        match self {
            Choice::Region(r) => region == Some(*r),
            Choice::Faces(a, b) => (*a..=*b).contains(&face),
            _ => self.is(&model.faces[face]),
        }
    }
}

/// How options write a colour.
pub(crate) fn colour_name([r, g, b]: [u8; 3]) -> String {
    format!("#{r:02x}{g:02x}{b:02x}")
}

/// The faces named by `what`, without regions: several choices with commas between.
pub(crate) fn faces(model: &Model, what: &str) -> Result<Vec<bool>, SelectError> {
    let choices = what.split(',').map(|t| parse(t.trim(), None, model)).collect::<Result<Vec<_>, _>>()?;
    Ok((0..model.faces.len()).map(|face| choices.iter().any(|c| c.names(model, face, None))).collect())
}

/// Which faces some texts name, regions included: `region:3`, `layer:NAME`, `colour:#RRGGBB`, `face:10-20`.
///
/// # Errors
/// A text names nothing of this model.
pub fn named_faces(
    model: &Model,
    region_of_face: &[usize],
    texts: &[String],
) -> Result<Vec<bool>, SelectError> {
    let regions = region_of_face.iter().max().map_or(0, |m| m + 1);
    let choices = texts.iter().map(|t| parse(t, Some(regions), model)).collect::<Result<Vec<_>, _>>()?;
    let is_named =
        |face: usize| choices.iter().any(|c| c.names(model, face, region_of_face.get(face).copied()));
    Ok((0..model.faces.len()).map(is_named).collect())
}

/// Which faces are left out, given what is cut (everything when empty), what is not, and what is avoided; and the numbers of
/// those that the last one names.
pub(crate) fn left_out(
    model: &Model,
    region_of_face: &[usize],
    only: &[String],
    skip: &[String],
    avoid: &[String],
) -> Result<(Vec<bool>, Vec<usize>), SelectError> {
    let named = |texts: &[String]| named_faces(model, region_of_face, texts);
    let (is_asked, is_skipped, is_avoided) = (named(only)?, named(skip)?, named(avoid)?);
    let faces = 0..model.faces.len();
    let avoided = faces.clone().filter(|&face| is_avoided[face]).collect();
    let is_out = |face: usize| (!only.is_empty() && !is_asked[face]) || is_skipped[face] || is_avoided[face];
    Ok((faces.map(is_out).collect(), avoided))
}
