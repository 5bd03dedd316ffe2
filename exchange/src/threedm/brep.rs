//! Boundary representations (`ON_Brep`): arrays of curves, surfaces, edges, trims, loops and faces that refer
//! to each other by index.

use super::archive::{ANONYMOUS, Reader};
use super::body::{Body, RawFace, Trim};
use super::class;
use super::context::Context;
use super::curves::{self, Native};
use super::fault::Fault;
use super::surfaces;

/// Loop types beyond this are curves and points on a face.
const SLIT: i32 = 3;
/// Stated by bodies whose faces look inwards.
const INSIDE_OUT: i32 = 2;

struct RawTrim {
    curve: i32,
    domain: [f64; 2],
    edge: i32,
    owner: i32,
    backwards: bool,
}

struct Loop {
    trims: Vec<i32>,
    kind: i32,
    owner: i32,
}

struct RawFaceRecord {
    loops: Vec<i32>,
    surface: i32,
    reversed: bool,
    colour: Option<[u8; 3]>,
}

/// Everything the faces are made of.
struct Parts<'a> {
    context: &'a Context,
    pcurves: Vec<Result<Native, Fault>>,
    edges: usize,
    trims: Vec<RawTrim>,
    loops: Vec<Loop>,
}

/// Reads the data of a brep.
pub(super) fn read(mut r: Reader, context: &Context) -> Result<Body, Fault> {
    let minor = match r.version()? {
        (3, minor) => minor,
        (version, _) => return Err(Fault::Version { what: "a polysurface", version }),
    };
    let pcurves = objects(&mut r, curves::read, "the parameter curves")?;
    let _curves = r.chunk_of(ANONYMOUS, "the curves")?;
    let surfaces = objects(&mut r, |o| surfaces::read(o, context), "the surfaces")?;
    let _vertices = r.chunk_of(ANONYMOUS, "the vertices")?;
    let edges = array(&mut r, "the edges", 48, |r| edge(r, context.legacy_edges))?.len();
    let trims = array(&mut r, "the trims", 132, trim)?;
    let loops = array(&mut r, "the loops", 16, trim_loop)?;
    let faces = faces(&mut r)?;
    let _bounds = r.reals::<6>()?;
    let mut inside_out = false;
    if minor >= 1 {
        let _render_meshes = r.chunk_of(ANONYMOUS, "the render meshes")?;
        let _analysis_meshes = r.chunk_of(ANONYMOUS, "the analysis meshes")?;
    }
    if minor >= 2 {
        inside_out = r.integer()? == INSIDE_OUT;
    }
    if minor >= 3 {
        let _regions = r.chunk()?;
    }
    r.finish()?;

    let parts = Parts { context, pcurves, edges, trims, loops };
    let faces = faces
        .iter()
        .enumerate()
        .map(|(i, f)| {
            Ok(RawFace {
                surface: place("surface", f.surface, surfaces.len())?,
                loops: parts.loops_of(i, f)?,
                reversed: f.reversed ^ inside_out,
                colour: f.colour,
            })
        })
        .collect();
    Ok(Body { surfaces, faces })
}

/// An array of objects. A damaged one is kept as its fault: the others do not suffer.
fn objects<T>(
    r: &mut Reader,
    read: impl Fn(class::Object) -> Result<T, Fault>,
    what: &'static str,
) -> Result<Vec<Result<T, Fault>>, Fault> {
    let (mut part, _) = r.part(what)?;
    let items = part.list(4, |r| {
        if r.integer()? != 1 {
            return Ok(Err(Fault::Geometry("a curve or surface is empty")));
        }
        let at = r.position();
        let missing = || Fault::Found { at, found: "an empty object".into(), wanted: "a curve or surface" };
        Ok(class::optional(r)?.ok_or_else(missing).and_then(&read))
    })?;
    part.finish()?;
    Ok(items)
}

/// An array of records of at least `size` bytes.
fn array<T>(
    r: &mut Reader,
    what: &'static str,
    size: usize,
    item: impl FnMut(&mut Reader) -> Result<T, Fault>,
) -> Result<Vec<T>, Fault> {
    let (mut part, _) = r.part(what)?;
    let items = part.list(size, item)?;
    part.finish()?;
    Ok(items)
}

fn edge(r: &mut Reader, legacy: bool) -> Result<(), Fault> {
    let _index_curve_sense = r.take(12)?;
    let _part_of_curve = r.reals::<2>()?;
    let _vertices = r.take(8)?;
    let _trims = r.integers()?;
    let _tolerance = r.real()?;
    if !legacy {
        let _domain = r.reals::<2>()?;
    }
    Ok(())
}

fn trim(r: &mut Reader) -> Result<RawTrim, Fault> {
    let _index = r.integer()?;
    let curve = r.integer()?;
    let domain = r.reals()?;
    let edge = r.integer()?;
    let _vertices = r.take(8)?;
    let _edge_backwards = r.integer()?;
    let _type_and_iso = r.take(8)?;
    let owner = r.integer()?;
    let _tolerances = r.reals::<2>()?;
    // In archives before toolkit 200206180 these 48 bytes are two points, written as zeros.
    let _domain = r.reals::<2>()?;
    let backwards = r.byte()? == 1;
    r.take(31)?;
    let _legacy_tolerances = r.reals::<2>()?;
    Ok(RawTrim { curve, domain, edge, owner, backwards })
}

fn trim_loop(r: &mut Reader) -> Result<Loop, Fault> {
    let _index = r.integer()?;
    let trims = r.integers()?;
    let kind = r.integer()?;
    let owner = r.integer()?;
    Ok(Loop { trims, kind, owner })
}

fn faces(r: &mut Reader) -> Result<Vec<RawFaceRecord>, Fault> {
    let (mut part, minor) = r.part("the faces")?;
    let mut faces = part.list(20, |r| {
        let _index = r.integer()?;
        let loops = r.integers()?;
        let (surface, reversed) = (r.integer()?, r.integer()? != 0);
        let _material = r.integer()?;
        Ok(RawFaceRecord { loops, surface, reversed, colour: None })
    })?;
    if minor >= 1 {
        part.times(faces.len(), Reader::uuid)?;
    }
    if minor >= 2 && part.flag()? {
        for face in &mut faces {
            face.colour = part.colour()?;
        }
    }
    part.finish()?;
    Ok(faces)
}

/// The index as one into an array of `count`.
fn place(what: &'static str, index: i32, count: usize) -> Result<usize, Fault> {
    let missing = Fault::Missing { what, index: index.into() };
    usize::try_from(index).ok().filter(|i| *i < count).ok_or(missing)
}

impl Parts<'_> {
    fn loops_of(&self, face: usize, record: &RawFaceRecord) -> Result<Vec<Vec<Trim>>, Fault> {
        let mut loops = Vec::with_capacity(record.loops.len());
        for index in &record.loops {
            let at = place("loop", *index, self.loops.len())?;
            let found = &self.loops[at];
            if usize::try_from(found.owner) != Ok(face) {
                return Err(Fault::Geometry("a loop belongs to another face"));
            }
            if found.kind > SLIT {
                continue;
            }
            let trims: Result<Vec<_>, _> = found.trims.iter().map(|t| self.trim(*t, *index)).collect();
            loops.push(trims?);
        }
        Ok(loops)
    }

    fn trim(&self, index: i32, owner: i32) -> Result<Trim, Fault> {
        let trim = &self.trims[place("trim", index, self.trims.len())?];
        if trim.owner != owner {
            return Err(Fault::Geometry("a trim belongs to another loop"));
        }
        let native = at("parameter curve", trim.curve, &self.pcurves)?;
        self.context.spend(native.curve.points().len())?;
        let pcurve = native.part((trim.domain[0], trim.domain[1])).and_then(|c| curves::flat(&c))?;
        Ok(Trim {
            pcurve: if trim.backwards { pcurve.reversed() } else { pcurve },
            edge: usize::try_from(trim.edge).ok().filter(|i| *i < self.edges),
        })
    }
}

fn at<'a>(what: &'static str, index: i32, natives: &'a [Result<Native, Fault>]) -> Result<&'a Native, Fault> {
    natives[place(what, index, natives.len())?].as_ref().map_err(Clone::clone)
}
