//! Where the tool is kept in a setup: inside of boxes, over what is cut, away from what is to be avoided.
//!
//! ```text
//!   │    ╭───╮    ╭───╮    ╭───╮ │   seen along the tool axis: the contact point, the centre or all of
//!   │    │ ╳─┼────┼─● │    │ ● │ │   the ball stays inside
//!   │    ╰───╯    ╰───╯    ╰───╯ │
//! ```

use claymill_nurbs::{Aabb, FaceId, Model, NurbsError, Point3};
use claymill_toolpath::{Bounds, Contain};

use crate::Frame;
use crate::contact::{BallDrop, Covering};
use crate::outline::Outline;

/// So far inside of its bounds the tool is kept on passes, mm: written ones lie beside the exact ones by less, and a link from the
/// end of one to that of another is inside as well, where the border bends a little.
pub(crate) const INSIDE_MM: f64 = 0.01;

/// The faces to be avoided.
pub(crate) struct Avoided {
    model: Model,
    covering: Covering,
}

impl Avoided {
    /// `None` where there are none.
    ///
    /// # Errors
    /// A face that cannot be covered with triangles, with the reason.
    pub(crate) fn new(
        model: &Model,
        bounds: &Bounds,
        radius_mm: f64,
    ) -> Result<Option<Self>, (FaceId, NurbsError)> {
        if bounds.avoid.is_empty() {
            return Ok(None);
        }
        let faces: Vec<_> = bounds.avoid.iter().filter_map(|&face| model.faces.get(face).cloned()).collect();
        let area_mm2 = faces.iter().map(claymill_nurbs::Face::area_mm2).sum();
        let excluded = vec![true; faces.len()];
        let avoided = Model { faces, ..model.clone() };
        let covering = Covering::new(&avoided, &excluded, area_mm2, radius_mm)
            .map_err(|(index, source)| (bounds.avoid[index], source))?;
        Ok(Some(Avoided { model: avoided, covering }))
    }
}

/// What keeps the tool of one setup in its bounds. Places are in the setup's coordinates.
pub(crate) struct Keep<'a> {
    contain: Contain,
    radius_mm: f64,
    boxes: Vec<Aabb>,
    /// The borders of what is cut, where the tool is not to reach over them.
    outline: Option<Outline>,
    /// Balls that are larger by the distance to be kept, on what is to be avoided: for passes, and for what leads from one to the next.
    avoided: Option<[BallDrop<'a>; 2]>,
}

impl<'a> Keep<'a> {
    /// For a ball; `None` where it may be anywhere.
    pub(crate) fn new(
        bounds: &Bounds,
        frame: &Frame,
        radius_mm: f64,
        covering: &Covering,
        excluded: &[bool],
        avoided: Option<&'a Avoided>,
    ) -> Option<Self> {
        let is_free = bounds.within_mm.is_empty() && bounds.contain == Contain::Contact && avoided.is_none();
        if is_free {
            return None;
        }
        let corners = |sides: &[f64; 6]| {
            let [x0, y0, z0, x1, y1, z1] = *sides;
            Aabb::of(&[Point3::new(x0, y0, z0), Point3::new(x1, y1, z1)].map(|p| frame.to_setup(&p)))
        };
        Some(Keep {
            contain: bounds.contain,
            radius_mm,
            boxes: bounds.within_mm.iter().map(corners).collect(),
            outline: (bounds.contain != Contain::Contact)
                .then(|| Outline::new(covering, excluded, frame, radius_mm)),
            avoided: avoided.map(|avoided| {
                [INSIDE_MM, 0.0].map(|inside_mm| {
                    let kept_mm = radius_mm + bounds.avoid_mm + inside_mm;
                    BallDrop::new(&avoided.model, &avoided.covering, frame, kept_mm)
                })
            }),
        })
    }

    /// Whether the ball may touch the model there, so far inside.
    pub(crate) fn allows(&self, centre: &Point3, contact: &Point3, inside_mm: f64) -> bool {
        let is_over_cut = |outline: &Outline| {
            !outline.comes_within(&centre.xy(), self.reach_mm() + inside_mm)
                && !outline.is_crossed(&contact.xy(), &centre.xy())
                && outline.is_over_cut(&centre.xy())
        };
        self.is_boxed(centre, contact, inside_mm)
            && self.is_away(centre, inside_mm)
            && self.outline.as_ref().is_none_or(is_over_cut)
    }

    /// Whether places close by, up to `near_mm` away, may be touched.
    pub(crate) fn allows_near(&self, centre: &Point3, contact: &Point3, near_mm: f64) -> bool {
        // The borders of what is cut may be anywhere around.
        self.is_boxed(centre, contact, -near_mm) && self.is_away(centre, INSIDE_MM)
    }

    /// Whether the ball may go along places close to each other without touching anything.
    pub(crate) fn allows_way(&self, centres: &[Point3]) -> bool {
        let inset_mm = self.reach_mm();
        let is_boxed = |at: &Point3| {
            let inside =
                |b: &Aabb| (0..2).all(|k| (b.min[k] + inset_mm..=b.max[k] - inset_mm).contains(&at[k]));
            self.contain == Contain::Contact || self.boxes.is_empty() || self.boxes.iter().any(inside)
        };
        let is_over_cut = |outline: &Outline| {
            !centres.iter().any(|at| outline.comes_within(&at.xy(), inset_mm))
                && !centres.windows(2).any(|w| outline.is_crossed(&w[0].xy(), &w[1].xy()))
                && centres.iter().all(|at| outline.is_over_cut(&at.xy()))
        };
        centres.iter().all(|at| is_boxed(at) && self.is_away(at, 0.0))
            && self.outline.as_ref().is_none_or(is_over_cut)
    }

    fn reach_mm(&self) -> f64 {
        if self.contain == Contain::Edge { self.radius_mm } else { 0.0 }
    }

    fn is_boxed(&self, centre: &Point3, contact: &Point3, inside_mm: f64) -> bool {
        let middle = if self.contain == Contain::Contact { contact } else { centre };
        let inside = |b: &Aabb| {
            let across = (0..2).all(|k| {
                let inset_mm = self.reach_mm() + inside_mm;
                (b.min[k] + inset_mm..=b.max[k] - inset_mm).contains(&middle[k])
            });
            across && (b.min.z + inside_mm..=b.max.z - inside_mm).contains(&contact.z)
        };
        self.boxes.is_empty() || self.boxes.iter().any(inside)
    }

    /// Whether what is to be avoided is far enough from a ball, and from one that comes down to there.
    fn is_away(&self, centre: &Point3, inside_mm: f64) -> bool {
        self.avoided.as_ref().is_none_or(|balls| {
            let ball = &balls[usize::from(inside_mm == 0.0)];
            !ball.is_held_at(centre.x, centre.y, centre.z)
        })
    }
}
