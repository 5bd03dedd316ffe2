//! Writing faces and groups as IGES 5.3.

use std::path::Path;

use claymill_nurbs::{Curve2, Curve3, Face, KnotVector, Model, NurbsError, NurbsSurface, Point2};
use claymill_nurbs::{TrimEdge, TrimLoop};

use crate::export::{Group, WriteError, group_of_face, write_whole};
use crate::lift::lifted;

use super::deck::{Deck, Draft, Parameters};

/// Writes `model` as IGES: untrimmed faces as B-spline surfaces (128), trimmed ones as trimmed surfaces (144) with
/// curves in the parameter plane and in space, each group as a group (402) with its name and a colour
/// definition (314). Faces outside all groups are written too, all faces in the model's order. Numbers have as many
/// digits as it takes to read back the same bits; the surface of a face with `reversed` is written turned
/// round. The file appears whole or not at all.
///
/// # Errors
/// See [`WriteError`].
pub fn write_iges(path: &Path, model: &Model, groups: &[Group]) -> Result<(), WriteError> {
    let text = compose(path, model, groups)?;
    write_whole(path, text.as_bytes())
}

fn compose(path: &Path, model: &Model, groups: &[Group]) -> Result<String, WriteError> {
    let mut deck = Deck::new();
    let group_of = group_of_face(model, groups)?;
    let mut pointers = Vec::with_capacity(model.faces.len());
    for (id, face) in model.faces.iter().enumerate() {
        let colour = group_of[id].and_then(|g| groups[g].colour).or(face.source.colour);
        let written = add_face(&mut deck, face, colour);
        pointers.push(written.map_err(|source| WriteError::Face { face: id, source })?);
    }
    for group in groups {
        let members: Vec<_> = group.faces.iter().map(|&face| pointers[face]).collect();
        let mut parameters = Parameters::of(402);
        parameters.pointers(&members);
        let draft = Draft { form: 7, colour: deck.colour(group.colour), ..Draft::new(parameters) };
        deck.add_named(draft, Some(&group.name));
    }
    Ok(deck.text(path, model.tolerance_mm))
}

/// Adds the face; gives its DE number.
fn add_face(deck: &mut Deck, face: &Face, colour: Option<[u8; 3]>) -> Result<usize, NurbsError> {
    let turned;
    let face = if face.reversed {
        turned = turned_round(face)?;
        &turned
    } else {
        face
    };
    let colour = deck.colour(colour);
    let level = face.source.layer.as_ref().and_then(|l| l.parse().ok()).unwrap_or(0);
    let surface = Draft {
        colour,
        level,
        dependent: !face.loops.is_empty(),
        ..Draft::new(surface_parameters(&face.surface))
    };
    let name = face.source.name.as_deref();
    if face.loops.is_empty() {
        return Ok(deck.add_named(surface, name));
    }
    let surface = deck.add(surface);
    let mut loops = Vec::new();
    for trim in outer_first(&face.loops) {
        loops.push(add_loop(deck, &face.surface, surface, trim)?);
    }
    let mut parameters = Parameters::of(144);
    parameters.integers(&[surface, 1, loops.len() - 1]);
    parameters.integers(&loops);
    let draft = Draft { colour, level, ..Draft::new(parameters) };
    Ok(deck.add_named(draft, name))
}

/// The face with `u` run backwards, which turns its normal.
fn turned_round(face: &Face) -> Result<Face, NurbsError> {
    let ((u0, u1), _) = face.surface.domain();
    let mirrored = |c: &Curve2| {
        let points = c.points().iter().map(|p| Point2::new(u0 + u1 - p.x, p.y)).collect();
        Curve2::new(c.knots().clone(), points, c.weights().map(<[f64]>::to_vec))
    };
    let mut loops = Vec::new();
    for trim in &face.loops {
        let edges: Result<_, NurbsError> = (trim.edges.iter().rev())
            .map(|e| Ok(TrimEdge { pcurve: mirrored(&e.pcurve)?.reversed(), shared: e.shared }))
            .collect();
        loops.push(TrimLoop { edges: edges? });
    }
    Ok(Face { surface: face.surface.reversed_u(), loops, reversed: false, ..face.clone() })
}

/// The format wants one outer loop in front: the one with the widest box is.
fn outer_first(loops: &[TrimLoop]) -> Vec<&TrimLoop> {
    let width = |l: &TrimLoop| {
        let points = || l.edges.iter().flat_map(|e| e.pcurve.points());
        let span = |f: fn(&Point2) -> f64| {
            let (low, high) =
                points().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), p| (a.min(f(p)), b.max(f(p))));
            high - low
        };
        span(|p| p.x) * span(|p| p.y)
    };
    let mut sorted: Vec<_> = loops.iter().collect();
    sorted.sort_by(|a, b| width(b).total_cmp(&width(a)));
    sorted
}

/// A curve on a surface (142) from composites (102) in the plane and in space.
fn add_loop(
    deck: &mut Deck,
    surface: &NurbsSurface,
    surface_de: usize,
    trim: &TrimLoop,
) -> Result<usize, NurbsError> {
    let (mut plane, mut space) = (Vec::new(), Vec::new());
    for edge in &trim.edges {
        let flat = Draft {
            dependent: true,
            flat: true,
            ..Draft::new(curve_parameters(&flat_in_space(&edge.pcurve)?))
        };
        plane.push(deck.add(flat));
        let lifted =
            Draft { dependent: true, ..Draft::new(curve_parameters(&lifted(surface, &edge.pcurve)?)) };
        space.push(deck.add(lifted));
    }
    let mut composite = |parts: &[usize], flat: bool| {
        let mut parameters = Parameters::of(102);
        parameters.pointers(parts);
        deck.add(Draft { dependent: true, flat, ..Draft::new(parameters) })
    };
    let (plane, space) = (composite(&plane, true), composite(&space, false));
    let mut parameters = Parameters::of(142);
    // Made by no named method; the parameter curve is the exact one.
    parameters.integers(&[0, surface_de, plane, space, 1]);
    Ok(deck.add(Draft { dependent: true, ..Draft::new(parameters) }))
}

fn flat_in_space(c: &Curve2) -> Result<Curve3, NurbsError> {
    let points = c.points().iter().map(|p| claymill_nurbs::Point3::new(p.x, p.y, 0.0)).collect();
    Curve3::new(c.knots().clone(), points, c.weights().map(<[f64]>::to_vec))
}

fn surface_parameters(surface: &NurbsSurface) -> Parameters {
    let (nu, nv) = surface.size();
    let (ku, kv) = (surface.knots_u(), surface.knots_v());
    let mut p = Parameters::of(128);
    p.integers(&[nu - 1, nv - 1, ku.degree(), kv.degree(), 0, 0]);
    p.integers(&[usize::from(!surface.is_rational()), 0, 0]);
    p.reals(ku.as_slice());
    p.reals(kv.as_slice());
    // The file runs fastest in u.
    let order = || (0..nv).flat_map(|j| (0..nu).map(move |i| (i, j)));
    for (i, j) in order() {
        p.reals(&[surface.weight(i, j)]);
    }
    for (i, j) in order() {
        p.reals(surface.control_point(i, j).coords.as_slice());
    }
    let ((u0, u1), (v0, v1)) = surface.domain();
    p.reals(&[u0, u1, v0, v1]);
    p
}

fn curve_parameters(curve: &Curve3) -> Parameters {
    let knots: &KnotVector = curve.knots();
    let count = curve.points().len();
    let mut p = Parameters::of(126);
    let polynomial = usize::from(curve.weights().is_none());
    p.integers(&[count - 1, knots.degree(), 0, 0, polynomial, 0]);
    p.reals(knots.as_slice());
    for i in 0..count {
        p.reals(&[curve.weights().map_or(1.0, |w| w[i])]);
    }
    for point in curve.points() {
        p.reals(point.coords.as_slice());
    }
    let (a, b) = curve.domain();
    p.reals(&[a, b, 0.0, 0.0, 1.0]);
    p
}
