//! Winding numbers of closed chains of Bézier arcs, exact to rounding: signed crossings of a ray,
//! with arcs sorted into bands.

use nalgebra::Vector2;

use crate::Point2;
use crate::arc::Arc;
use crate::bisect::between;

/// Winding numbers of closed chains of arcs, exact to rounding: signed crossings of the ray from the point
/// toward `+u`. Arcs are cut at their extremes, so that a ray meets each at most once and most are decided
/// by their box or their chord; bands in `v` keep the list short.
#[derive(Debug, Clone, Default)]
pub(crate) struct Winding {
    arcs: Vec<Monotone>,
    lowest: f64,
    bands_per_v: f64,
    /// Indices into `arcs`, per band.
    bands: Vec<Vec<u32>>,
}

#[derive(Debug, Clone)]
struct Monotone {
    /// Run so that `v` rises.
    arc: Arc,
    min: Point2,
    max: Point2,
    /// +1 when the loop runs upward here.
    sign: i32,
    from: Point2,
    chord: Vector2<f64>,
    /// Range of the control points' offsets from the chord, as cross products, left positive.
    offsets: (f64, f64),
}

impl Winding {
    /// Prepares closed chains of arcs. Ends must chain to the last bit.
    pub(crate) fn new<'a>(arcs: impl IntoIterator<Item = &'a Arc>) -> Self {
        let arcs: Vec<Monotone> =
            arcs.into_iter().flat_map(|a| a.monotone()).filter_map(Monotone::new).collect();
        let lowest = arcs.iter().fold(f64::INFINITY, |m, a| m.min(a.min.y));
        let highest = arcs.iter().fold(f64::NEG_INFINITY, |m, a| m.max(a.max.y));
        if arcs.is_empty() || highest <= lowest {
            return Winding::default();
        }
        let count = (2 * arcs.len()).min(4096);
        let mut this = Winding {
            lowest,
            bands_per_v: count as f64 / (highest - lowest),
            bands: vec![Vec::new(); count],
            arcs,
        };
        for i in 0..this.arcs.len() {
            let (first, last) = (this.band(this.arcs[i].min.y), this.band(this.arcs[i].max.y));
            this.bands[first..=last].iter_mut().for_each(|b| b.push(i as u32));
        }
        this
    }

    /// Monotone in `v`, which is all that is needed: an arc and a point on one level meet in one band.
    fn band(&self, v: f64) -> usize {
        (((v - self.lowest) * self.bands_per_v) as usize).min(self.bands.len() - 1)
    }

    /// The winding number at `p`; on the curve itself it is that of either side.
    pub(crate) fn number(&self, p: Point2) -> i32 {
        if self.bands.is_empty() {
            return 0;
        }
        let band = &self.bands[self.band(p.y)];
        band.iter().map(|&i| self.arcs[i as usize].crossed(p)).sum()
    }
}

impl Monotone {
    /// `None` for level arcs: no level ray crosses them.
    fn new(arc: Arc) -> Option<Self> {
        let (a, b) = (arc.start(), arc.end());
        let sign = match () {
            () if a.y < b.y => 1,
            () if a.y > b.y => -1,
            () => return None,
        };
        let arc = if sign > 0 { arc } else { arc.reversed() };
        let (from, chord) = (arc.start(), arc.end() - arc.start());
        let offsets = arc.control_points().map(|p| chord.perp(&(p - from)));
        let offsets = offsets.fold((0.0f64, 0.0f64), |(l, h), o| (l.min(o), h.max(o)));
        Some(Monotone { min: a.inf(&b), max: a.sup(&b), arc, sign, from, chord, offsets })
    }

    /// `sign` when the ray from `p` toward `+u` crosses the arc, else 0. Levels are half open, so that a ray
    /// through the common end of two arcs counts once.
    fn crossed(&self, p: Point2) -> i32 {
        if p.y < self.min.y || p.y >= self.max.y || p.x >= self.max.x {
            return 0;
        }
        if p.x < self.min.x {
            return self.sign;
        }
        let offset = self.chord.perp(&(p - self.from));
        if offset > self.offsets.1 {
            return self.sign;
        }
        if offset <= self.offsets.0 {
            return 0;
        }
        self.crossed_within_hull(p)
    }

    #[cold]
    fn crossed_within_hull(&self, p: Point2) -> i32 {
        let (mut low, mut high) = ((0.0, self.arc.start()), (1.0, self.arc.end()));
        // Parameters closer than the last digit give the same point.
        let apart = |low: f64, high: f64| high - low > f64::EPSILON * high;
        while let Some(t) = between(low.0, high.0).filter(|_| apart(low.0, high.0)) {
            if p.x < low.1.x.min(high.1.x) {
                return self.sign;
            }
            if p.x >= low.1.x.max(high.1.x) {
                return 0;
            }
            let m = self.arc.point(t);
            *(if m.y <= p.y { &mut low } else { &mut high }) = (t, m);
        }
        0
    }
}
