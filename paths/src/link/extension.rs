//! Passes go on straight over open borders, and turn round out there.
//!
//! ```text
//!   ═══════════╡─────╮      ═ pass, on what is cut
//!              │     │      ─ run-out, along the tangent: nothing is touched
//!   ═══════════╡─────╯      ╮ link in the open
//!       border ┘
//! ```

use claymill_nurbs::{Foot, Point3, Vector3};
use claymill_toolpath::{Move, MoveKind, round_to_written};

use crate::fit::written::one_span;
use crate::link::leads::End;
use crate::setup::context::SetupContext;

/// So far behind the end of a pass it is looked whether the surface goes on, mm.
const PROBE_MM: f64 = 1.0;
/// It does where the nearest place moves along by this share of that.
const MOVES_ALONG: f64 = 0.3;
/// Where there is no room for a run-out, it is tried with these shares of its length.
const SHARES: [f64; 3] = [1.0, 0.5, 0.25];
/// Arms of a cubic that turns round, in distances between its ends: those of half a circle.
const ARM: f64 = 2.0 / 3.0;

impl SetupContext<'_> {
    /// Where a pass runs out to, if it ends at an open border and there is room.
    pub(crate) fn extend_pass(&self, End { at, onward }: End) -> Option<Point3> {
        let way = onward.try_normalize(0.0).filter(|_| self.extend_mm > 0.0)?;
        if !self.is_open_behind(at, way) {
            return None;
        }
        SHARES.iter().find_map(|share| {
            let to = (at + way * (share * self.extend_mm)).map(round_to_written);
            self.is_way_clear(at, to).then_some(to)
        })
    }

    /// Whether what is cut does not go on behind the end of a pass.
    fn is_open_behind(&self, tip: Point3, way: Vector3) -> bool {
        let centre = tip + self.frame.axis() * self.ball.radius_mm();
        let foot = |from: Point3| self.walls.closest.closest(&from, self.ball.radius_mm() + 2.0 * PROBE_MM);
        let Some(here) = foot(centre) else { return false };
        let goes_on = |there: &Foot| {
            !self.excluded[there.face] && (there.point - here.point).dot(&way) >= MOVES_ALONG * PROBE_MM
        };
        foot(centre + way * PROBE_MM).is_none_or(|there| !goes_on(&there))
    }

    /// A link in the open from behind one pass to before another.
    pub(crate) fn link_in_the_open(&self, from: End, to: End) -> Option<Vec<Move>> {
        let apart_mm = (to.at - from.at).norm();
        if apart_mm > self.longest_link_mm() {
            return None;
        }
        let arm = |end: End| Some(end.at + end.onward.try_normalize(0.0)? * (ARM * apart_mm));
        let points = [from.at, arm(from)?, arm(to)?, to.at].map(|p| p.map(round_to_written));
        let length_mm = round_to_written(points.windows(2).map(|w| (w[1] - w[0]).norm()).sum());
        let curve = one_span(points, length_mm)?;
        let (axis, feed) = (self.frame.axis(), self.feeds.cut_mm_per_min);
        self.is_curve_clear(&curve).then(|| vec![Move::along(MoveKind::Link, &curve, axis, feed)])
    }
}
