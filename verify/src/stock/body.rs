//! Convex bodies of revolution that a tool consists of: the swollen disc of an end and frusta, with
//! the same bodies grown or shrunk.

/// A convex body of revolution about the tool axis. Heights are counted from the tip, mm.
///
/// ```text
///    ╲       ╱ high          ╭───────────╮   cut off at `cap`
///     ╲     ╱   frustum     (  ───disc──  )  centre
///      ╲___╱  low            ╰───────────╯   swollen by `corner`
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Shape {
    /// A disc swollen by a ball: all ball when `disc` is 0.
    End {
        /// Radius of the disc, mm.
        disc: f64,
        /// Radius of the ball, mm.
        corner: f64,
        /// Height of the disc, mm.
        centre: f64,
        /// Nothing of it is higher than this, mm.
        cap: f64,
    },
    /// A cylinder or cone.
    Frustum {
        /// Height of the lower end, mm.
        low: f64,
        /// Height of the upper end, mm.
        high: f64,
        /// Radius at the lower end, mm.
        radius: f64,
        /// Radius gained for a millimetre of height.
        slope: f64,
        /// Cosine of the angle between flank and axis.
        cosine: f64,
    },
}

/// Bodies thinner than this are none, mm.
const THINNEST_MM: f64 = 1e-9;

impl Shape {
    /// Between two ends of height and radius, mm.
    pub(super) fn frustum([low, radius]: [f64; 2], [high, upper]: [f64; 2]) -> Self {
        let slope = if high > low { (upper - radius) / (high - low) } else { 0.0 };
        Shape::Frustum { low, high, radius, slope, cosine: 1.0 / slope.hypot(1.0) }
    }

    /// The body with its surface moved outwards by `by_mm`, or inwards where that is negative. Grown it holds every point within
    /// that distance of it; of the shrunk one every point has that distance from the surface. `None` where nothing is left.
    pub(super) fn grown(&self, by_mm: f64) -> Option<Self> {
        match *self {
            Shape::End { disc, corner, centre, cap } => {
                let (grown, cap) = (corner + by_mm, cap + by_mm);
                // A sharp end has its corner rounded by growing it; that holds the whole cylinder no longer than a disc.
                (grown > THINNEST_MM && cap > centre - grown).then_some(Shape::End {
                    disc,
                    corner: grown,
                    centre,
                    cap,
                })
            }
            Shape::Frustum { low, high, radius, slope, cosine } => {
                let (lower, upper) = (low - by_mm, high + by_mm);
                let radius = radius + by_mm / cosine - slope * by_mm;
                let widest = radius.max(radius + slope * (upper - lower));
                (upper > lower && widest > THINNEST_MM).then_some(Shape::Frustum {
                    low: lower,
                    high: upper,
                    radius,
                    slope,
                    cosine,
                })
            }
        }
    }

    /// How far it sticks out of another body at the same place, at most, mm; `None` where that is not looked into.
    pub(super) fn beyond(&self, other: &Shape) -> Option<f64> {
        match (*self, *other) {
            (
                Shape::End { disc, corner, centre, cap },
                Shape::End { disc: d, corner: c, centre: m, cap: top },
            ) => {
                let above = if cap == top { 0.0 } else { (cap.min(centre + corner) - top).max(0.0) };
                Some((corner - c + (disc - d).max(0.0) + (centre - m).abs()).max(above))
            }
            (Shape::Frustum { .. }, Shape::Frustum { low, high, radius, slope, cosine }) => {
                let [bottom, top, _] = self.extent();
                let rim = |z: f64| (self.radius_at(z).unwrap_or(0.0) - radius - slope * (z - low)) * cosine;
                Some((low - bottom).max(top - high).max(rim(bottom)).max(rim(top)))
            }
            (Shape::End { .. }, Shape::Frustum { low, high, radius, slope: 0.0, .. }) => {
                let [bottom, top, widest] = self.extent();
                Some((low - bottom).max(top - high).max(widest - radius))
            }
            _ => None,
        }
    }

    /// The same farther up.
    pub(super) fn raised(&self, by_mm: f64) -> Shape {
        match *self {
            Shape::End { disc, corner, centre, cap } => {
                Shape::End { disc, corner, centre: centre + by_mm, cap: cap + by_mm }
            }
            Shape::Frustum { low, high, radius, slope, cosine } => {
                Shape::Frustum { low: low + by_mm, high: high + by_mm, radius, slope, cosine }
            }
        }
    }

    /// What of it is below a height, for a frustum; all of an end, if any of it is. `None` where nothing is.
    pub(super) fn below(&self, height: f64) -> Option<Shape> {
        match *self {
            Shape::Frustum { low, .. } if low >= height => None,
            Shape::Frustum { low, high, radius, slope, .. } if high > height => {
                Some(Shape::frustum([low, radius], [height, radius + slope * (height - low)]))
            }
            _ => (self.extent()[0] < height).then_some(*self),
        }
    }

    /// Radius at a height; `None` above and below.
    pub(super) fn radius_at(&self, height: f64) -> Option<f64> {
        match *self {
            Shape::End { disc, corner, centre, cap } => {
                let square = corner * corner - (height - centre).powi(2);
                (square >= 0.0 && height <= cap).then(|| disc + square.sqrt())
            }
            Shape::Frustum { low, high, radius, slope, .. } => {
                let here = radius + slope * (height - low);
                ((low..=high).contains(&height) && here > 0.0).then_some(here)
            }
        }
    }

    /// Lowest and highest height and largest radius, mm.
    pub(super) fn extent(&self) -> [f64; 3] {
        match *self {
            Shape::End { disc, corner, centre, cap } => {
                [centre - corner, (centre + corner).min(cap), disc + corner]
            }
            Shape::Frustum { low, high, radius, slope, .. } => {
                [low, high, radius.max(radius + slope * (high - low)).max(0.0)]
            }
        }
    }

    /// The greatest distance of one of its points from the tip, mm.
    pub(super) fn reach(&self) -> f64 {
        let [low, high, radius] = self.extent();
        low.abs().max(high.abs()).hypot(radius)
    }
}
