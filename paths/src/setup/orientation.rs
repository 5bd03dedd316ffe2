//! Which way a model lies in its file: what is up and which way it is long.
//!
//! ```text
//!        up          the side that no setup cuts is the one below
//!        │   ┌───┐
//!    ┌───┴───┘   └──┐
//!    └──────────────┘──► front      across: the model is its own mirror image
//! ```
//!
//! A file does not say it. Most are modelled with z up; a vehicle is the mirror image of itself across its length; and what
//! is much longer than wide and high lies on its side.

use claymill_contact::{Axis, Frame, FrameError, ParallelAxes};
use claymill_nurbs::{Aabb, Domain, Face, Model, Point3, Vector3};
use rayon::prelude::*;
use thiserror::Error;

/// How the vehicle lies in its file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Orientation {
    /// Points up.
    pub up: Axis,
    /// Points from rear to front.
    pub front: Axis,
}

/// Why there is no such setup.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum SetupError {
    /// Neither a name that is known nor one with a direction.
    #[error("`{0}` is not a setup")]
    Unknown(String),
    /// Its name or direction cannot be.
    #[error(transparent)]
    Frame(#[from] FrameError),
}

/// An orientation that was worked out, as far as it was not told.
#[derive(Debug, Clone, PartialEq)]
pub struct OrientationGuess {
    /// What was told, and the rest as guessed.
    pub orientation: Orientation,
    /// Nothing speaks against it: a vehicle in its usual position.
    pub is_likely: bool,
    /// What it follows from, in one sentence without a full stop.
    pub reason: String,
}

/// Points that the surface is looked at with.
const POINTS: f64 = 20_000.0;
/// At most so many along each parameter of a face.
const MOST_ALONG: usize = 32;
/// Cells along each side of the box when two halves are compared.
const CELLS: f64 = 16.0;
/// A side is not divided finer than this share of the longest one.
const FINEST_CELL: f64 = 0.002;
/// A model whose halves agree to this share of the area is its own mirror image.
const MIRRORED: f64 = 0.80;
/// By so much the next best plane has to be worse, or the model has more than one.
const CLEARLY: f64 = 0.08;
/// What stands this many times higher than it is wide and long lies on its side when it is milled.
const SLENDER: f64 = 2.5;
/// Sides of the box whose lengths differ by no more than this share do not say which is longer.
const ALIKE: f64 = 0.1;

impl Orientation {
    /// Checks that the axes differ.
    ///
    /// # Errors
    /// They are parallel.
    pub fn new(up: Axis, front: Axis) -> Result<Self, ParallelAxes> {
        if up.index == front.index {
            Err(ParallelAxes { up, length: front })
        } else {
            Ok(Orientation { up, front })
        }
    }

    /// Names of the setups that need no direction.
    pub const SETUPS: [&str; 6] = ["top", "left", "right", "front", "rear", "bottom"];

    /// A setup by one of the names in [`Orientation::SETUPS`], or as `NAME:X,Y,Z`, with the direction from the tip to the
    /// holder in model coordinates.
    ///
    /// # Errors
    /// There is no such name, or no such direction.
    pub fn setup(self, text: &str) -> Result<Frame, SetupError> {
        let unknown = || SetupError::Unknown(text.to_owned());
        if let Some((name, direction)) = text.split_once(':') {
            let numbers: Option<Vec<f64>> = direction.split(',').map(|c| c.trim().parse().ok()).collect();
            let axis = <[f64; 3]>::try_from(numbers.ok_or_else(unknown)?).map_err(|_| unknown())?;
            return Ok(Frame::tilted(name, axis, self.up, self.front)?);
        }
        if text == "bottom" {
            return Ok(Frame::new(text, self.up.opposite(), self.front)?);
        }
        self.five_setups()?.into_iter().find(|frame| frame.name == text).ok_or_else(unknown)
    }

    /// The five setups of the vehicle: top, left, right, front, rear. Left and right are those of the driver.
    ///
    /// # Errors
    /// The axes are parallel, which [`Orientation::new`] refuses.
    pub fn five_setups(self) -> Result<[Frame; 5], FrameError> {
        Frame::five(self.up, self.front)
    }

    /// Works out what was not told. Up is `+z`, unless the model is mirrored in `z` and in no other direction, or much
    /// longer along `z` than otherwise: then it is `+y`, or `+x` where a mirrored model is longer along `y`. The length is perpendicular to up; of the two directions left it is
    /// the one in which the model is not its own mirror image, or else the longer one. Which end is the front cannot be
    /// told: the negative end is taken, which only decides whether a setup is called front or rear.
    ///
    /// `face_area_mm2` has the area of each face.
    ///
    /// # Errors
    /// The axes that were told are parallel.
    pub fn guess(
        model: &Model,
        face_area_mm2: &[f64],
        up: Option<Axis>,
        front: Option<Axis>,
    ) -> Result<OrientationGuess, ParallelAxes> {
        if let (Some(up), Some(front)) = (up, front) {
            let orientation = Orientation::new(up, front)?;
            return Ok(OrientationGuess { orientation, is_likely: true, reason: "as told".into() });
        }
        let points = points(model, face_area_mm2);
        let bounds = Aabb::of(points.iter().map(|(p, _)| p));
        let size = if bounds.is_empty() { [0.0; 3] } else { (bounds.max - bounds.min).into() };
        let across = mirrored_along(&points, &bounds);
        let positive = |index| Axis { index, negative: false };
        let (up, why_up) = match (up, front) {
            (Some(up), _) => (up, None),
            (None, front) => {
                let (index, why) = up_index(size, across, front);
                (positive(index), Some(why))
            }
        };
        let (front, why_front) = match front {
            Some(front) => (front, None),
            None => {
                let (index, why) = length_index(size, across, up.index);
                (Axis { index, negative: true }, Some(why))
            }
        };
        let whys: Vec<Why> = [why_up, why_front].into_iter().flatten().collect();
        Ok(OrientationGuess {
            orientation: Orientation::new(up, front)?,
            is_likely: whys.iter().all(|why| why.is_likely),
            reason: {
                let mut words: Vec<String> = whys.into_iter().map(|why| why.words).collect();
                words.dedup();
                words.join("; ")
            },
        })
    }
}

/// What a choice follows from.
struct Why {
    words: String,
    is_likely: bool,
}

const NAMES: [&str; 3] = ["x", "y", "z"];

fn up_index(size: [f64; 3], across: Option<usize>, front: Option<Axis>) -> (usize, Why) {
    let why = |words: &str, is_likely| Why { words: words.to_owned(), is_likely };
    let taken = |index| front.is_some_and(|f| f.index == index);
    if taken(2) {
        return (1, why("z is the length", true));
    }
    let second = if taken(1) { 0 } else { 1 };
    if across == Some(2) {
        // What is left are height and length: the height is the shorter one.
        let second = if !taken(0) && size[0] < (1.0 - ALIKE) * size[1] { 0 } else { second };
        return (second, why("the model is its own mirror image in z", true));
    }
    if size[2] > SLENDER * size[0].max(size[1]) {
        return (second, why("the model is slender along z, so it lies", false));
    }
    if size[2] > size[0].max(size[1]) {
        return (2, why("most files have z up, though z is the longest side", false));
    }
    (2, why("most files have z up", true))
}

fn length_index(size: [f64; 3], across: Option<usize>, up: usize) -> (usize, Why) {
    let [a, b] = [(up + 1) % 3, (up + 2) % 3];
    if let Some(side) = across.filter(|&side| side != up) {
        let length = if side == a { b } else { a };
        let words = format!("the model is its own mirror image in {}", NAMES[side]);
        return (length, Why { words, is_likely: true });
    }
    let (longer, shorter) = if size[a] >= size[b] { (a, b) } else { (b, a) };
    let is_likely = size[shorter] < (1.0 - ALIKE) * size[longer];
    // Of two alike the first.
    let longer = if is_likely { longer } else { a.min(b) };
    let words = if is_likely {
        format!("{} is the longest side across", NAMES[longer])
    } else {
        format!("{} and {} are alike", NAMES[a.min(b)], NAMES[a.max(b)])
    };
    (longer, Why { words, is_likely })
}

/// Points of the surface with the area that each stands for, mm².
fn points(model: &Model, face_area_mm2: &[f64]) -> Vec<(Point3, f64)> {
    let whole: f64 = face_area_mm2.iter().sum();
    let of_face = |(face, &area_mm2): (&Face, &f64)| {
        let count = (POINTS * area_mm2 / whole).sqrt().ceil();
        let along = if count.is_finite() { (count as usize).clamp(1, MOST_ALONG) } else { 1 };
        let found = points_of(face, along);
        let each = area_mm2 / found.len().max(1) as f64;
        found.into_iter().map(|p| (p, each)).collect::<Vec<_>>()
    };
    model.faces.par_iter().zip(face_area_mm2).flat_map_iter(of_face).collect()
}

/// Points on a face, evenly in its parameters.
fn points_of(face: &Face, along: usize) -> Vec<Point3> {
    let domain = (!face.loops.is_empty()).then(|| Domain::new(face));
    let ((mut u0, mut u1), (mut v0, mut v1)) = face.surface.domain();
    let ends = face.loops.iter().flat_map(|l| &l.edges).flat_map(|e| e.pcurve.points());
    let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
    for p in ends {
        (low, high) = ([low[0].min(p.x), low[1].min(p.y)], [high[0].max(p.x), high[1].max(p.y)]);
    }
    if low[0] < high[0] && low[1] < high[1] {
        (u0, u1, v0, v1) = (u0.max(low[0]), u1.min(high[0]), v0.max(low[1]), v1.min(high[1]));
    }
    let at = |i: usize, from: f64, to: f64| from + (to - from) * (i as f64 + 0.5) / along as f64;
    let grid = (0..along).flat_map(|i| (0..along).map(move |j| (i, j)));
    grid.map(|(i, j)| (at(i, u0, u1), at(j, v0, v1)))
        .filter(|&(u, v)| domain.as_ref().is_none_or(|d| d.contains(u, v)))
        .map(|(u, v)| face.surface.point(u, v))
        .filter(|p| p.coords.iter().all(|c| c.is_finite()))
        .collect()
}

/// The direction in which the model is its own mirror image, if there is one and no other.
fn mirrored_along(points: &[(Point3, f64)], bounds: &Aabb) -> Option<usize> {
    let longest_mm = (bounds.max - bounds.min).amax();
    if points.is_empty() || longest_mm <= 0.0 {
        return None;
    }
    let cell_mm = (bounds.max - bounds.min).map(|side| (side / CELLS).max(FINEST_CELL * longest_mm));
    let shares = [0, 1, 2].map(|axis| mirrored_share(points, bounds, cell_mm, axis));
    let best = (0..3).max_by(|&a, &b| shares[a].total_cmp(&shares[b]))?;
    let others = (0..3).filter(|&axis| axis != best).map(|axis| shares[axis]).fold(0.0, f64::max);
    (shares[best] >= MIRRORED && shares[best] - others >= CLEARLY).then_some(best)
}

/// The share of the area that lies in the same cells as its mirror image through the middle of the box. Every point is
/// spread over the eight cells around it, so that it does not matter on which side of a cell's wall it lies.
fn mirrored_share(points: &[(Point3, f64)], bounds: &Aabb, cell_mm: Vector3, axis: usize) -> f64 {
    let centre = bounds.centre();
    let half = (CELLS / 2.0).ceil() as i32 + 1;
    let width = (2 * half + 2) as usize;
    let mut difference = vec![0.0; width.pow(3)];
    let mut total = 0.0;
    for (p, mm2) in points {
        let local = (p - centre).component_div(&cell_mm);
        for sign in [1.0, -1.0] {
            let mut at = local;
            at[axis] *= sign;
            let low = at.map(f64::floor);
            for corner in 0..8 {
                let step = |k: usize| f64::from(u8::from(corner >> k & 1 == 1));
                let share = |k: usize| {
                    let beyond = at[k] - low[k];
                    if step(k) > 0.0 { beyond } else { 1.0 - beyond }
                };
                let index = |k: usize| (low[k] + step(k)) as i32 + half;
                let flat = (index(0) as usize * width + index(1) as usize) * width + index(2) as usize;
                if let Some(cell) = difference.get_mut(flat) {
                    *cell += sign * mm2 * share(0) * share(1) * share(2);
                }
            }
        }
        total += mm2;
    }
    1.0 - difference.iter().map(|d: &f64| d.abs()).sum::<f64>() / (2.0 * total)
}

#[cfg(test)]
mod tests {
    use claymill_nurbs::{Face, KnotVector, NurbsSurface, SurfaceKind};

    use super::*;

    fn plane(corners: [[f64; 3]; 4]) -> Face {
        let line = || KnotVector::new(1, vec![0.0, 0.0, 1.0, 1.0]).unwrap();
        // Corners in the order of the net: u runs slowest.
        let net = corners.map(Point3::from).to_vec();
        let surface = NurbsSurface::new(line(), line(), net, None).unwrap();
        Face {
            surface,
            loops: Vec::new(),
            reversed: false,
            kind: SurfaceKind::Plane,
            source: claymill_nurbs::Source::default(),
        }
    }

    /// A roof over a rectangle of `length × width`, higher at one end, with its ridge along the length.
    fn roof(length: f64, width: f64, heights: [f64; 2]) -> Vec<Face> {
        let [h0, h1] = heights;
        let w = 0.5 * width;
        vec![
            plane([[0.0, -w, 0.0], [0.0, 0.0, h0], [length, -w, 0.0], [length, 0.0, h1]]),
            plane([[0.0, 0.0, h0], [0.0, w, 0.0], [length, 0.0, h1], [length, w, 0.0]]),
        ]
    }

    fn guess(faces: Vec<Face>, turn: impl Fn(Point3) -> Point3, up: Option<&str>) -> OrientationGuess {
        let faces: Vec<Face> =
            faces.into_iter().map(|f| Face { surface: f.surface.mapped(&turn), ..f }).collect();
        let areas: Vec<f64> = faces.iter().map(Face::area_mm2).collect();
        let model = Model { faces, ..Model::default() };
        Orientation::guess(&model, &areas, up.map(|u| u.parse().unwrap()), None).unwrap()
    }

    fn axes(found: &OrientationGuess) -> (String, String) {
        (found.orientation.up.to_string(), found.orientation.front.to_string())
    }

    #[test]
    fn what_is_wider_than_long_has_its_length_along_the_plane_of_symmetry() {
        let found = guess(roof(600.0, 1400.0, [50.0, 300.0]), |p| p, None);
        assert_eq!(axes(&found), ("+z".into(), "-x".into()));
        assert!(found.is_likely, "{}", found.reason);
    }

    #[test]
    fn a_model_mirrored_in_z_has_y_up() {
        let found = guess(roof(600.0, 400.0, [50.0, 300.0]), |p| Point3::new(p.x, p.z, p.y), None);
        assert_eq!(axes(&found), ("+y".into(), "-x".into()));
        assert!(found.is_likely, "{}", found.reason);
    }

    #[test]
    fn the_rest_is_guessed_beside_what_is_told() {
        // Tall, with z up: the length is not z.
        let tall = || roof(100.0, 150.0, [400.0, 300.0]);
        assert_eq!(axes(&guess(tall(), |p| p, Some("+z"))).0, "+z");
        assert_eq!(axes(&guess(tall(), |p| p, Some("-z"))), ("-z".into(), "-x".into()));
        let told = guess(tall(), |p| p, Some("+x"));
        assert_eq!(told.orientation.up.index, 0);
        assert_ne!(told.orientation.front.index, 0);
    }

    #[test]
    fn a_square_says_that_it_does_not_know() {
        let found = guess(roof(400.0, 400.0, [100.0, 100.0]), |p| p, None);
        assert_eq!(found.orientation.up.to_string(), "+z");
        assert!(!found.is_likely, "{}", found.reason);
    }

    #[test]
    fn what_has_no_area_or_no_face_is_guessed_too() {
        let empty = Orientation::guess(&Model::default(), &[], None, None).unwrap();
        assert_eq!((axes(&empty).0.as_str(), empty.is_likely), ("+z", false));
        let up = "+z".parse().unwrap();
        assert!(Orientation::guess(&Model::default(), &[], Some(up), Some(up)).is_err());
    }
}
