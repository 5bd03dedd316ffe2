//! The outline of a flat or bull-nosed end as seen from its tip.

use claymill_nurbs::Vector3;
use claymill_toolpath::Tool;

/// The end of a tool with flutes as thick as it above, without end upwards.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct EndBody {
    /// Largest radius, mm.
    pub(crate) radius_mm: f64,
    /// Radius of the corner, mm; 0 of a flat end.
    pub(crate) corner_mm: f64,
}

impl EndBody {
    /// That of a tool; `None` of a ball.
    pub(crate) fn of(tool: &Tool) -> Option<Self> {
        let (radius_mm, corner_mm) = (tool.radius_mm(), tool.corner_radius_mm());
        (!tool.is_ball()).then_some(EndBody { radius_mm, corner_mm })
    }

    /// Distance of a place from the tool, negative inside, by its height over the tip and its distance from the axis; and how
    /// that changes with the distance from the axis and with the height.
    fn outside(&self, from_axis: f64, height: f64) -> (f64, [f64; 2]) {
        let (flat, corner) = (self.radius_mm - self.corner_mm, self.corner_mm);
        let by_side = (from_axis - self.radius_mm, [1.0, 0.0]);
        let by_bottom = (-height, [0.0, -1.0]);
        if height < corner && from_axis > flat {
            // Nearest is the corner's arc, or its rim where it has none.
            let (out, down) = (from_axis - flat, corner - height);
            let away = (out * out + down * down).sqrt();
            return (away - corner, [out / away, -down / away]);
        }
        match () {
            () if from_axis <= flat && height <= 0.0 => by_bottom,
            () if by_side.0 >= by_bottom.0 => by_side,
            () => by_bottom,
        }
    }

    /// The same of a place as seen `from_tip`, with the gradient.
    pub(crate) fn distance(&self, from_tip: &Vector3, axis: &Vector3) -> (f64, Vector3) {
        let height = from_tip.dot(axis);
        let across = from_tip - axis * height;
        let from_axis = across.norm();
        let (mm, [out, up]) = self.outside(from_axis, height);
        let outward = if from_axis > 0.0 { across / from_axis } else { Vector3::zeros() };
        (mm, outward * out + axis * up)
    }

    /// The tip where the tool touches a place from the side of `n`; over level ground right above it.
    pub(crate) fn tip_over(
        &self,
        place: &claymill_nurbs::Point3,
        n: &Vector3,
        axis: &Vector3,
    ) -> claymill_nurbs::Point3 {
        let across = n - axis * n.dot(axis);
        let outward = across.try_normalize(LEVEL).unwrap_or_else(Vector3::zeros);
        place + n * self.corner_mm + outward * (self.radius_mm - self.corner_mm) - axis * self.corner_mm
    }
}

/// Ground that leans by less (sine) is level.
const LEVEL: f64 = 1e-6;

#[cfg(test)]
mod tests {
    use super::*;
    use claymill_nurbs::Point3;
    use proptest::prelude::*;

    fn body() -> impl Strategy<Value = EndBody> {
        (1.0..12.0, 0.0..1.0)
            .prop_map(|(radius_mm, share)| EndBody { radius_mm, corner_mm: share * 0.95 * radius_mm })
    }

    fn vector() -> impl Strategy<Value = Vector3> {
        [-15.0..15.0, -15.0..15.0, -15.0..15.0].prop_map(Vector3::from)
    }

    proptest! {
        #[test]
        fn it_is_convex_and_falls_no_faster_than_the_way(body in body(), p in vector(), q in vector()) {
            let at = |v: &Vector3| body.distance(v, &Vector3::z()).0;
            prop_assert!(at(&((p + q) * 0.5)) <= 0.5 * (at(&p) + at(&q)) + 1e-9);
            prop_assert!((at(&p) - at(&q)).abs() <= (p - q).norm() + 1e-9);
            let (mm, gradient) = body.distance(&p, &Vector3::z());
            prop_assert!(at(&q) >= mm + gradient.dot(&(q - p)) - 1e-9);
        }

        #[test]
        fn it_touches_where_it_is_said_to(body in body(), n in vector()) {
            prop_assume!(n.z > 0.1 && n.norm() > 1.0);
            let n = n.normalize();
            let place = Point3::new(3.0, -2.0, 1.0);
            let tip = body.tip_over(&place, &n, &Vector3::z());
            let (mm, _) = body.distance(&(place - tip), &Vector3::z());
            prop_assert!(mm.abs() < 1e-9);
            // What lies on the plane through there is not inside.
            let beside = n.cross(&Vector3::x()) * 0.7 + n.cross(&Vector3::y()) * 0.4;
            prop_assert!(body.distance(&(place + beside - tip), &Vector3::z()).0 > -1e-9);
        }
    }
}
