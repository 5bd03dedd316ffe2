//! Faces named on the command line: `region:3`, `layer:NAME`, `colour:#RRGGBB`, `face:10-20`, as
//! `--only`, `--skip`, `--avoid` and others take them.

use std::collections::BTreeSet;

use claymill_nurbs::{Face, Model};

use crate::failure::Failure;

/// What an option names.
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

fn parse(text: &str, regions: Option<usize>, model: &Model) -> Result<Choice, Failure> {
    let forms = if regions.is_some() { FORMS } else { FORMS_OF_FACES };
    let bad = || Failure::usage(format!("`{text}` names no region, layer, colour or face"), forms);
    let (kind, value) = text.split_once(':').ok_or_else(bad)?;
    let number = |v: &str, count: usize, what: &str| {
        let n: usize = v.parse().map_err(|_| bad())?;
        if n < count {
            Ok(n)
        } else {
            Err(Failure::usage(format!("`{text}`: there are only {count} {what}, counted from 0"), forms))
        }
    };
    let there = |choice: Choice, name: fn(&Face) -> Option<String>, what: &str| {
        if model.faces.iter().any(|f| choice.is(f)) {
            return Ok(choice);
        }
        let names: BTreeSet<String> = model.faces.iter().filter_map(name).collect();
        let mut listed: Vec<String> = names.iter().take(LISTED).cloned().collect();
        if names.len() > LISTED {
            listed.push(format!("and {} more", names.len() - LISTED));
        }
        let advice = match listed.is_empty() {
            true => format!("The faces of this file have no {what}."),
            false => format!("There are: {}.", listed.join(", ")),
        };
        Err(Failure::usage(format!("`{text}`: no face has this {what}"), advice))
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
                return Err(Failure::usage(
                    format!("`{text}` runs backwards"),
                    format!("Write face:{b}-{a}."),
                ));
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
}

/// How options write a colour.
pub(crate) fn colour_name([r, g, b]: [u8; 3]) -> String {
    format!("#{r:02x}{g:02x}{b:02x}")
}

/// The faces named by `what`, without regions: several choices with commas between.
pub(crate) fn faces(model: &Model, what: &str) -> Result<Vec<bool>, Failure> {
    let choices = what.split(',').map(|t| parse(t.trim(), None, model)).collect::<Result<Vec<_>, _>>()?;
    let named = |face: usize| {
        choices.iter().any(|c| match c {
            Choice::Faces(a, b) => (*a..=*b).contains(&face),
            _ => c.is(&model.faces[face]),
        })
    };
    Ok((0..model.faces.len()).map(named).collect())
}

/// The faces named by one choice, regions included.
pub(crate) fn named(model: &Model, region_of_face: &[usize], what: &str) -> Result<Vec<bool>, Failure> {
    let regions = region_of_face.iter().max().map_or(0, |m| m + 1);
    let choice = parse(what, Some(regions), model)?;
    let is_named = |face: usize| match choice {
        Choice::Region(r) => region_of_face[face] == r,
        Choice::Faces(a, b) => (a..=b).contains(&face),
        Choice::Layer(_) | Choice::Colour(_) => choice.is(&model.faces[face]),
    };
    Ok((0..model.faces.len()).map(is_named).collect())
}

/// Which faces are left out, given `--only` (everything when empty), `--skip` and `--avoid`; and the numbers of those that the
/// last one names.
pub(crate) fn left_out(
    model: &Model,
    region_of_face: &[usize],
    only: &[String],
    skip: &[String],
    avoid: &[String],
) -> Result<(Vec<bool>, Vec<usize>), Failure> {
    let regions = region_of_face.iter().max().map_or(0, |m| m + 1);
    let parse_all = |texts: &[String]| {
        texts.iter().map(|t| parse(t, Some(regions), model)).collect::<Result<Vec<_>, _>>()
    };
    let (only, skip, avoid) = (parse_all(only)?, parse_all(skip)?, parse_all(avoid)?);
    let named = |choices: &[Choice], face: usize| {
        choices.iter().any(|c| match c {
            Choice::Region(r) => region_of_face[face] == *r,
            Choice::Faces(a, b) => (*a..=*b).contains(&face),
            _ => c.is(&model.faces[face]),
        })
    };
    let faces = 0..model.faces.len();
    let avoided: Vec<usize> = faces.clone().filter(|&face| named(&avoid, face)).collect();
    let out = |face| (!only.is_empty() && !named(&only, face)) || named(&skip, face) || named(&avoid, face);
    Ok((faces.map(out).collect(), avoided))
}
