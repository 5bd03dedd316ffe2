//! Tools as stacked convex bodies of revolution, larger or smaller by a distance.

use claymill_toolpath::{Holder, Tool};

use crate::StockError;

/// A convex body of revolution about the tool axis. Heights are above the tip, mm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Solid {
    /// A disc swollen by a ball: all ball where `flat` is 0.
    Swollen {
        /// Height of the disc.
        height: f64,
        /// Its radius.
        flat: f64,
        /// Radius of the ball, positive.
        corner: f64,
    },
    /// A cone or cylinder between two discs.
    Frustum {
        /// Height and radius of the lower disc.
        low: [f64; 2],
        /// The same of the upper one; its height is infinite only for a cylinder.
        high: [f64; 2],
        /// The end below goes on into it as a tangent.
        tangent: bool,
    },
}

/// What moves: the end of a tool, what of it cuts, or everything down from the spindle.
///
/// ```text
///   ┌──┴──┐
///   │     │ holder: frusta                a frustum that is made larger or smaller keeps its slope: its
///   └┐   ┌┘                               sides and its discs move by the distance. Larger, it holds
///    │   │ flutes, shank: frusta          everything within the distance; smaller, everything within
///     ╲ ╱                                 the distance of it lies in the first
///      ● end: a disc swollen by a ball
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct ToolBody {
    pub(crate) solids: Vec<Solid>,
}

impl ToolBody {
    /// The end alone: the ball, or the disc with its corner. Of a flat tool it has no thickness and cuts nothing: ask for
    /// [`ToolBody::cutting`].
    ///
    /// # Errors
    /// A radius that is none.
    pub fn end(tool: &Tool) -> Result<Self, StockError> {
        checked(tool)?;
        Ok(ToolBody { solids: end(tool).into_iter().collect() })
    }

    /// What cuts: the end, and the flutes up to their length; without a length they have no end.
    ///
    /// # Errors
    /// A tool whose sizes do not suit each other.
    pub fn cutting(tool: &Tool) -> Result<Self, StockError> {
        checked(tool)?;
        ToolBody::of(end(tool), tool.sides().into_iter().take(1), tool)
    }

    /// What must touch nothing: the shank above the flutes, up to the holder, and the holder. Without a holder the shank has
    /// no end. Without a flute length only the holder is left.
    ///
    /// # Errors
    /// Sizes that do not suit each other.
    pub fn above(tool: &Tool, holder: Option<&Holder>) -> Result<Self, StockError> {
        checked(tool)?;
        let up_to = holder.map_or(f64::INFINITY, |h| h.stick_out_mm);
        let shank = tool.sides().into_iter().skip(1).filter_map(|s| cut_off(s, up_to));
        ToolBody::of(None, shank.chain(holder.iter().flat_map(|h| h.profile())), tool)
    }

    /// Everything: end, flutes, shank and holder.
    ///
    /// # Errors
    /// Sizes that do not suit each other.
    pub fn whole(tool: &Tool, holder: Option<&Holder>) -> Result<Self, StockError> {
        checked(tool)?;
        let up_to = holder.map_or(f64::INFINITY, |h| h.stick_out_mm);
        let sides = tool.sides().into_iter().filter_map(|s| cut_off(s, up_to));
        ToolBody::of(end(tool), sides.chain(holder.iter().flat_map(|h| h.profile())), tool)
    }

    fn of(
        end: Option<Solid>,
        sections: impl Iterator<Item = [[f64; 2]; 2]>,
        tool: &Tool,
    ) -> Result<Self, StockError> {
        let joint = tool.sides()[0][0];
        let mut solids: Vec<Solid> = end.into_iter().collect();
        for [low, high] in sections {
            let level = low[0] == high[0];
            let sound = low.iter().chain(&high[1..]).all(|v| v.is_finite() && *v >= 0.0)
                && low[0] <= high[0]
                && low[1].max(high[1]) > 0.0
                && (high[0].is_finite() || low[1] == high[1]);
            if !sound {
                return Err(StockError::Section { low, high });
            }
            if !level {
                solids.push(Solid::Frustum { low, high, tangent: low == joint && !solids.is_empty() });
            }
        }
        Ok(ToolBody { solids })
    }

    /// The body with everything within a distance of it (more, but never less, at sharp rims), or for a negative distance the
    /// part of it from which everything within the distance lies in the body. Distances in mm.
    ///
    /// Of a curve that is replaced by chords within `δ`, a body smaller by `δ` removes less than the tool on the curve, and
    /// one larger by `δ` touches more.
    ///
    /// # Errors
    /// A distance that is not finite.
    pub fn offset(&self, distance_mm: f64) -> Result<Self, StockError> {
        if !distance_mm.is_finite() {
            return Err(StockError::NotFinite("the distance by which a tool is larger"));
        }
        let smallest = self.solids.iter().map(Solid::lowest).fold(f64::INFINITY, f64::min);
        let solids = self.solids.iter().filter_map(|s| s.offset(distance_mm, smallest)).collect();
        Ok(ToolBody { solids })
    }

    /// The body narrower by a distance, and no shorter: what lies in it on a curve at one height lies in the tool wherever that is
    /// beside the curve by no more than the distance. `None` of a ball, or of another end with less flat than that, mm.
    #[must_use]
    pub fn narrowed(&self, distance_mm: f64) -> Option<Self> {
        let narrower = |solid: &Solid| match *solid {
            Solid::Swollen { height, flat, corner } => {
                (flat > distance_mm).then_some(Solid::Swollen { height, flat: flat - distance_mm, corner })
            }
            Solid::Frustum { low, high, tangent } => {
                let [low, high] = [low, high].map(|[height, radius]| [height, radius - distance_mm]);
                (low[1].min(high[1]) > 0.0).then_some(Solid::Frustum { low, high, tangent })
            }
        };
        let solids = self.solids.iter().map(narrower).collect::<Option<Vec<_>>>()?;
        Some(ToolBody { solids })
    }

    /// The distance from the axis beyond which nothing of it is, mm.
    #[must_use]
    pub fn widest_mm(&self) -> f64 {
        let radius = |s: &Solid| match s {
            Solid::Swollen { flat, corner, .. } => flat + corner,
            Solid::Frustum { low, high, .. } => low[1].max(high[1]),
        };
        self.solids.iter().map(radius).fold(0.0, f64::max)
    }
}

impl Solid {
    /// Height of the lowest point.
    fn lowest(&self) -> f64 {
        match self {
            Solid::Swollen { height, corner, .. } => height - corner,
            Solid::Frustum { low, .. } => low[0],
        }
    }

    fn offset(&self, by: f64, bottom: f64) -> Option<Self> {
        match *self {
            Solid::Swollen { height, flat, corner } => {
                Some(Solid::Swollen { height, flat, corner: corner + by }).filter(|_| corner + by > 0.0)
            }
            Solid::Frustum { low, high, tangent } => {
                let slope = if high[0].is_finite() { (high[1] - low[1]) / (high[0] - low[0]) } else { 0.0 };
                // Per millimetre the side moves so much away from the axis, and its normal points down by `sine`.
                let out = (1.0 + slope * slope).sqrt();
                let radius = |height: f64| low[1] + slope * (height - low[0]) + by * out;
                let (mut from, mut to) = (low[0] - by, high[0] + by);
                if tangent && by < 0.0 {
                    // The end shrinks to a smaller one with the same centre, as far as there is any.
                    from = (low[0] - by * slope / out).max(bottom - by);
                }
                // Where the cone ends in a point.
                if slope > 0.0 {
                    from = from.max(low[0] - (low[1] + by * out) / slope);
                } else if slope < 0.0 {
                    to = to.min(low[0] - (low[1] + by * out) / slope);
                }
                let at = |height: f64| if slope == 0.0 { low[1] + by } else { radius(height).max(0.0) };
                let frustum = Solid::Frustum { low: [from, at(from)], high: [to, at(to)], tangent };
                Some(frustum).filter(|_| from < to && at(from).max(at(to)) > 0.0)
            }
        }
    }
}

/// The end of a tool, if it has any thickness.
fn end(tool: &Tool) -> Option<Solid> {
    let corner = tool.corner_radius_mm();
    (corner > 0.0).then(|| Solid::Swollen { height: corner, flat: tool.radius_mm() - corner, corner })
}

/// The part of a section below a height.
fn cut_off([low, high]: [[f64; 2]; 2], height: f64) -> Option<[[f64; 2]; 2]> {
    if low[0] >= height {
        return None;
    }
    if high[0] <= height {
        return Some([low, high]);
    }
    let slope = if high[0].is_finite() { (high[1] - low[1]) / (high[0] - low[0]) } else { 0.0 };
    Some([low, [height, low[1] + slope * (height - low[0])]])
}

/// Refuses tools that were put together without being read.
fn checked(tool: &Tool) -> Result<(), StockError> {
    // The text form is checked when it is read.
    tool.to_string().parse::<Tool>()?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tool(text: &str) -> Tool {
        text.parse().unwrap()
    }

    /// Radius of a body at a height above the tip; negative where there is nothing.
    fn radius(body: &ToolBody, height: f64) -> f64 {
        let at = |s: &Solid| match *s {
            Solid::Swollen { height: disc, flat, corner } => {
                let square = corner * corner - (height - disc) * (height - disc);
                if square < 0.0 { -1.0 } else { flat + square.sqrt() }
            }
            Solid::Frustum { low, high, .. } if height < low[0] || height > high[0] => -1.0,
            Solid::Frustum { low, high, .. } if high[0].is_infinite() => low[1],
            Solid::Frustum { low, high, .. } => {
                low[1] + (high[1] - low[1]) * (height - low[0]) / (high[0] - low[0])
            }
        };
        body.solids.iter().map(at).fold(-1.0, f64::max)
    }

    /// A disc of the larger one that touches no place of the outline nearer than the distance.
    #[test]
    fn a_smaller_body_stays_that_far_inside_and_a_larger_one_outside() {
        for text in
            ["ball:10", "flat:5", "bull:10:2", "ball:5,taper:12,length:40", "flat:4,taper:30,length:20"]
        {
            let body = ToolBody::cutting(&tool(text)).unwrap();
            for distance in [0.05, 0.7, 2.5] {
                let (small, large) = (body.offset(-distance).unwrap(), body.offset(distance).unwrap());
                for i in 0..400 {
                    let height = -3.0 + 0.05 * f64::from(i);
                    for j in 0..64 {
                        let (sine, cosine) = (f64::from(j) * 0.0981747).sin_cos();
                        let near = height + distance * sine;
                        let inside = radius(&small, height);
                        if inside >= 0.0 {
                            let there = radius(&body, near);
                            assert!(
                                there >= inside + distance * cosine - 1e-9,
                                "{text} {distance} {height} {j}"
                            );
                        }
                        let inside = radius(&body, height);
                        if inside >= 0.0 {
                            let there = radius(&large, near);
                            assert!(
                                there >= inside + distance * cosine - 1e-9,
                                "{text} {distance} {height} {j}"
                            );
                        }
                    }
                }
            }
        }
    }

    #[test]
    fn the_parts_of_a_tool_are_those_of_its_outline() {
        let holder = Holder::parse("60:27-34x50,63x26", &tool("ball:5")).unwrap();
        let text = "ball:5,taper:3,length:30,shank:12";
        let count = |body: Result<ToolBody, StockError>| body.unwrap().solids.len();
        assert_eq!(count(ToolBody::end(&tool(text))), 1);
        assert_eq!(count(ToolBody::end(&tool("flat:5"))), 0);
        assert_eq!(count(ToolBody::cutting(&tool(text))), 2);
        assert_eq!(count(ToolBody::above(&tool(text), Some(&holder))), 3);
        assert_eq!(count(ToolBody::whole(&tool(text), Some(&holder))), 5);
        assert_eq!(count(ToolBody::above(&tool("ball:5"), None)), 0);
        assert_eq!(ToolBody::whole(&tool(text), Some(&holder)).unwrap().widest_mm(), 31.5);
        assert!(matches!(ToolBody::end(&Tool::ball(f64::NAN)), Err(StockError::Tool(_))));
        let mut holder = holder;
        holder.sections[0].upper_diameter_mm = f64::NAN;
        assert!(matches!(ToolBody::whole(&tool(text), Some(&holder)), Err(StockError::Section { .. })));
        assert!(ToolBody::end(&Tool::ball(5.0)).unwrap().offset(f64::NAN).is_err());
    }
}
