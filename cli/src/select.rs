use claymill_nurbs::Model;

use crate::failure::Failure;

/// What `--only` or `--skip` names.
#[derive(Debug, Clone, PartialEq)]
enum Choice {
    Region(usize),
    Faces(usize, usize),
    Layer(String),
}

const FORMS: &str = "Write region:3, layer:NAME, face:17 or face:10-20; `claymill merge` lists regions.";

fn parse(text: &str, regions: usize, faces: usize) -> Result<Choice, Failure> {
    let bad = || Failure::usage(format!("`{text}` names no region, layer or face"), FORMS);
    let (kind, value) = text.split_once(':').ok_or_else(bad)?;
    let number = |v: &str, count: usize, what: &str| {
        let n: usize = v.parse().map_err(|_| bad())?;
        if n < count {
            Ok(n)
        } else {
            Err(Failure::usage(format!("`{text}`: there are only {count} {what}, counted from 0"), FORMS))
        }
    };
    match kind {
        "region" => Ok(Choice::Region(number(value, regions, "regions")?)),
        "layer" => Ok(Choice::Layer(value.to_owned())),
        "face" => {
            let (a, b) = value.split_once('-').unwrap_or((value, value));
            Ok(Choice::Faces(number(a, faces, "faces")?, number(b, faces, "faces")?))
        }
        _ => Err(bad()),
    }
}

/// Which faces are left out, given `--only` (everything when empty) and `--skip`.
pub(crate) fn excluded(
    model: &Model,
    region_of_face: &[usize],
    only: &[String],
    skip: &[String],
) -> Result<Vec<bool>, Failure> {
    let regions = region_of_face.iter().max().map_or(0, |m| m + 1);
    let parse_all = |texts: &[String]| {
        texts.iter().map(|t| parse(t, regions, model.faces.len())).collect::<Result<Vec<_>, _>>()
    };
    let (only, skip) = (parse_all(only)?, parse_all(skip)?);
    let named = |choices: &[Choice], face: usize| {
        choices.iter().any(|c| match c {
            Choice::Region(r) => region_of_face[face] == *r,
            Choice::Faces(a, b) => (*a..=*b).contains(&face),
            Choice::Layer(l) => model.faces[face].source.layer.as_ref() == Some(l),
        })
    };
    let out = |face| (!only.is_empty() && !named(&only, face)) || named(&skip, face);
    Ok((0..model.faces.len()).map(out).collect())
}
