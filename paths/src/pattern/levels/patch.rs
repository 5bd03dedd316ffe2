//! Parameter lines of single patches: what the papers called iso-curve paths.

use crate::pattern::levels::pattern::{Levels, Spot};
use claymill_nurbs::{Domain, Face, FaceId, NurbsSurface, Point2};

/// Places along a parameter line are about this far apart, mm.
const APART_MM: f64 = 1.5;
const FEWEST: usize = 8;
const MOST: usize = 20_000;
/// Where a trim curve ends a line is narrowed down this often.
const HALVINGS: usize = 20;
/// Lines at which lengths are compared to choose a direction.
const COMPARED: usize = 5;

/// The lines of one face along one parameter, the other being the level.
pub(crate) struct PatchLevels<'a> {
    face: FaceId,
    surface: &'a NurbsSurface,
    domain: Option<Domain>,
    /// Lines run along `v`, the level is `u`.
    along_v: bool,
    count: Option<usize>,
}

impl<'a> PatchLevels<'a> {
    /// Lines run along whichever parameter gives the longer ones: `count` of them, evenly over the patch, or as many as it
    /// takes.
    pub(crate) fn new(id: FaceId, face: &'a Face, count: Option<usize>) -> Self {
        let mut lines = PatchLevels {
            face: id,
            surface: &face.surface,
            domain: (!face.loops.is_empty()).then(|| Domain::new(face)),
            along_v: true,
            count,
        };
        let mean_mm = |lines: &Self| {
            let ((low, high), (a, b)) = (lines.levels(), lines.run());
            let level = |k: usize| low + (high - low) * (k as f64 + 0.5) / COMPARED as f64;
            (0..COMPARED).map(|k| lines.length_mm(level(k), a, b)).sum::<f64>()
        };
        let along_v_mm = mean_mm(&lines);
        lines.along_v = false;
        lines.along_v = along_v_mm >= mean_mm(&lines);
        lines
    }

    fn levels(&self) -> (f64, f64) {
        let (u, v) = self.surface.domain();
        if self.along_v { u } else { v }
    }

    fn run(&self) -> (f64, f64) {
        let (u, v) = self.surface.domain();
        if self.along_v { v } else { u }
    }

    fn at(&self, level: f64, t: f64) -> Point2 {
        if self.along_v { Point2::new(level, t) } else { Point2::new(t, level) }
    }

    fn length_mm(&self, level: f64, a: f64, b: f64) -> f64 {
        const CHORDS: u32 = 32;
        let point = |k: u32| {
            let p = self.at(level, a + (b - a) * f64::from(k) / f64::from(CHORDS));
            self.surface.point(p.x, p.y)
        };
        (0..CHORDS).map(|k| (point(k + 1) - point(k)).norm()).sum()
    }

    fn holds(&self, level: f64, t: f64) -> bool {
        let p = self.at(level, t);
        self.domain.as_ref().is_none_or(|d| d.contains(p.x, p.y))
    }

    /// Where the line leaves the face between an inner and an outer parameter.
    fn end(&self, level: f64, mut inner: f64, mut outer: f64) -> f64 {
        for _ in 0..HALVINGS {
            let middle = 0.5 * (inner + outer);
            *(if self.holds(level, middle) { &mut inner } else { &mut outer }) = middle;
        }
        inner
    }

    fn spot(&self, level: f64, t: f64) -> Spot {
        let p = self.at(level, t);
        let jet = self.surface.jet(p.x, p.y);
        let (across, along) = if self.along_v { (jet.su, jet.sv) } else { (jet.sv, jet.su) };
        let aside = match along.try_normalize(0.0) {
            Some(t) => across - t * across.dot(&t),
            None => across,
        };
        Spot { face: self.face, u: p.x, v: p.y, per_level_mm: aside.norm() }
    }
}

impl Levels for PatchLevels<'_> {
    fn range(&self) -> (f64, f64) {
        self.levels()
    }

    fn count(&self) -> Option<usize> {
        self.count
    }

    fn whole_lines(&self, level: f64) -> Vec<Vec<Spot>> {
        let (a, b) = self.run();
        let count = ((self.length_mm(level, a, b) / APART_MM).ceil() as usize).clamp(FEWEST, MOST);
        let mut lines: Vec<Vec<Spot>> = Vec::new();
        let mut before: Option<(f64, bool)> = None;
        for k in 0..=count {
            let t = a + (b - a) * k as f64 / count as f64;
            let inside = self.holds(level, t);
            match before {
                Some((s, false)) if inside => lines.push(vec![self.spot(level, self.end(level, t, s))]),
                Some((s, true)) if !inside => {
                    if let Some(line) = lines.last_mut() {
                        line.push(self.spot(level, self.end(level, s, t)));
                    }
                }
                None if inside => lines.push(Vec::new()),
                _ => {}
            }
            if inside && let Some(line) = lines.last_mut() {
                line.push(self.spot(level, t));
            }
            before = Some((t, inside));
        }
        lines
    }
}
