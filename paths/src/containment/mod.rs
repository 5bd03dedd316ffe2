//! Where the tool is kept in a setup: inside of boxes, over what is cut, away from what is to be avoided.
//!
//! ```text
//!   │    ╭───╮    ╭───╮    ╭───╮ │   seen along the tool axis: the contact point, the centre or all of
//!   │    │ ╳─┼────┼─● │    │ ● │ │   the ball stays inside
//!   │    ╰───╯    ╰───╯    ╰───╯ │
//! ```

pub(crate) mod clip;
pub(crate) mod outline;
pub(crate) mod room;

use claymill_contact::{BallDrop, Covering};
use claymill_nurbs::{Aabb, FaceId, Model, NurbsError, Point3};
use claymill_toolpath::{Bounds, Contain};

use crate::Frame;
use crate::containment::outline::Outline;
use crate::containment::room::ShankRoom;
use crate::plan::covered::Covered;

/// So far inside of its bounds the tool is kept on passes, mm: written ones lie beside the exact ones by less, and a link from the
/// end of one to that of another is inside as well, where the border bends a little.
const INSIDE_MM: f64 = 0.01;

/// What the tool is on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum On {
    /// A pass.
    Pass,
    /// A lead or a link.
    Way,
}

impl On {
    fn inside_mm(self) -> f64 {
        match self {
            On::Pass => INSIDE_MM,
            On::Way => 0.0,
        }
    }
}

/// Faces that the tool keeps away from, and how far.
pub(crate) struct Avoided {
    model: Model,
    covering: Covering,
    margin_mm: f64,
}

impl Avoided {
    /// `None` where there are none.
    ///
    /// # Errors
    /// A face that cannot be covered with triangles, with the reason.
    pub(crate) fn new(
        model: &Model,
        avoid: &[FaceId],
        margin_mm: f64,
        radius_mm: f64,
    ) -> Result<Option<Self>, (FaceId, NurbsError)> {
        if avoid.is_empty() {
            return Ok(None);
        }
        let faces: Vec<_> = avoid.iter().filter_map(|&face| model.faces.get(face).cloned()).collect();
        let area_mm2 = faces.iter().map(claymill_nurbs::Face::area_mm2).sum();
        let excluded = vec![true; faces.len()];
        let Model { tolerance_mm, coordinate_step_mm, .. } = *model;
        let avoided = Model { faces, tolerance_mm, coordinate_step_mm };
        let Covered { model, covering, .. } = Covered::new(&avoided, &excluded, area_mm2, radius_mm)
            .map_err(|(index, source)| (avoid[index], source))?;
        Ok(Some(Avoided { model: model.into_owned(), covering, margin_mm }))
    }

    /// Balls that are larger by the distance to be kept, for passes and for ways.
    fn balls(&self, frame: &Frame, radius_mm: f64) -> [BallDrop<'_>; 2] {
        [On::Pass, On::Way].map(|on| {
            let kept_mm = radius_mm + self.margin_mm + on.inside_mm();
            BallDrop::new(&self.model, &self.covering, frame, kept_mm)
        })
    }
}

/// What keeps the tool of one setup in its bounds. Places are in the setup's coordinates.
pub(crate) struct Containment<'a> {
    contain: Contain,
    radius_mm: f64,
    boxes: Vec<Aabb>,
    /// Where the centre of the ball is on passes, in the model's coordinates.
    centre_box: Option<Aabb>,
    /// In one that is not parallel to the model's axes, the boxes are in model coordinates too.
    frame: Frame,
    /// The borders of what is cut, where the tool is not to reach over them.
    outline: Option<Outline>,
    /// Balls that are larger by the distance to be kept, on what is to be avoided: for passes, and for ways.
    avoided: Option<[BallDrop<'a>; 2]>,
    /// The same on obstacles.
    obstacles: Option<[BallDrop<'a>; 2]>,
    /// Where passes keep the shank clear of the stock.
    room: Option<ShankRoom>,
}

impl<'a> Containment<'a> {
    /// For a ball, with the faces to be avoided and the obstacles, and with the room that the shank has; `None` where it may be
    /// anywhere.
    pub(crate) fn new(
        bounds: &Bounds,
        frame: &Frame,
        radius_mm: f64,
        covering: &Covering,
        excluded: &[bool],
        avoided: [Option<&'a Avoided>; 2],
        room: Option<ShankRoom>,
    ) -> Option<Self> {
        let [avoided, obstacles] = avoided.map(|a| a.map(|a| a.balls(frame, radius_mm)));
        let is_free = bounds.within_mm.is_empty()
            && bounds.centre_within_mm.is_none()
            && bounds.contain == Contain::Contact
            && avoided.is_none()
            && obstacles.is_none()
            && room.is_none();
        if is_free {
            return None;
        }
        let ends = |[x0, y0, z0, x1, y1, z1]: [f64; 6]| [Point3::new(x0, y0, z0), Point3::new(x1, y1, z1)];
        let corners = |sides: &[f64; 6]| {
            let ends = ends(*sides);
            Aabb::of(&if frame.is_tilted() { ends } else { ends.map(|p| frame.to_setup(&p)) })
        };
        Some(Containment {
            contain: bounds.contain,
            radius_mm,
            boxes: bounds.within_mm.iter().map(corners).collect(),
            frame: *frame,
            centre_box: bounds.centre_within_mm.map(|sides| Aabb::of(&ends(sides))),
            outline: (bounds.contain != Contain::Contact)
                .then(|| Outline::new(covering, excluded, frame, radius_mm)),
            avoided,
            obstacles,
            room,
        })
    }

    /// Whether the ball may touch the model there.
    pub(crate) fn allows(&self, centre: &Point3, contact: &Point3, on: On) -> bool {
        let is_over_cut = |outline: &Outline| {
            !outline.comes_within(&centre.xy(), self.reach_mm() + on.inside_mm())
                && !outline.is_crossed(&contact.xy(), &centre.xy())
                && outline.is_over_cut(&centre.xy())
        };
        self.is_boxed(centre, Some(contact), on.inside_mm())
            && self.is_near_block(centre, on.inside_mm())
            && self.is_away(centre, on)
            && self.outline.as_ref().is_none_or(is_over_cut)
            && self.room.as_ref().filter(|_| on == On::Pass).is_none_or(|room| room.holds(centre))
    }

    /// Whether places close by, up to `near_mm` away, may be touched by a pass.
    pub(crate) fn allows_near(&self, centre: &Point3, contact: &Point3, near_mm: f64) -> bool {
        // The borders of what is cut may be anywhere around.
        self.is_boxed(centre, Some(contact), -near_mm)
            && self.is_near_block(centre, -near_mm)
            && self.is_away(centre, On::Pass)
    }

    /// Whether the ball may go along places close to each other without touching anything.
    pub(crate) fn allows_way(&self, centres: &[Point3]) -> bool {
        let inside_mm = On::Way.inside_mm();
        let is_over_cut = |outline: &Outline| {
            !centres.iter().any(|at| outline.comes_within(&at.xy(), self.reach_mm() + inside_mm))
                && !centres.windows(2).any(|w| outline.is_crossed(&w[0].xy(), &w[1].xy()))
                && centres.iter().all(|at| outline.is_over_cut(&at.xy()))
        };
        centres.iter().all(|at| self.is_boxed(at, None, inside_mm) && self.is_away(at, On::Way))
            && self.outline.as_ref().is_none_or(is_over_cut)
    }

    /// Radius around the centre, seen along the axis, of what stays inside.
    fn reach_mm(&self) -> f64 {
        if self.contain == Contain::Edge { self.radius_mm } else { 0.0 }
    }

    /// Whether the centre of the ball is where it cuts something of a block.
    fn is_near_block(&self, centre: &Point3, inside_mm: f64) -> bool {
        self.centre_box.as_ref().is_none_or(|b| {
            let at = self.frame.to_model(centre);
            (0..3).all(|k| (b.min[k] + inside_mm..=b.max[k] - inside_mm).contains(&at[k]))
        })
    }

    /// Whether a box holds what it is to hold of a ball, which touches the model or nothing.
    fn is_boxed(&self, centre: &Point3, contact: Option<&Point3>, inside_mm: f64) -> bool {
        let across = if self.contain == Contain::Contact { contact } else { Some(centre) };
        let inside = |b: &Aabb, k: usize, at: &Point3, inset_mm: f64| {
            (b.min[k] + inset_mm..=b.max[k] - inset_mm).contains(&at[k])
        };
        let inset_mm = self.reach_mm() + inside_mm;
        if self.frame.is_tilted() {
            // No side of a box is along the axis: all of them bound the tool.
            let [across, contact] = [across, contact].map(|at| at.map(|p| self.frame.to_model(p)));
            let holds = |b: &Aabb| {
                across.is_none_or(|at| (0..3).all(|k| inside(b, k, &at, inset_mm)))
                    && contact.is_none_or(|at| (0..3).all(|k| inside(b, k, &at, inside_mm)))
            };
            return self.boxes.is_empty() || self.boxes.iter().any(holds);
        }
        let holds = |b: &Aabb| {
            across.is_none_or(|at| (0..2).all(|k| inside(b, k, at, inset_mm)))
                && contact.is_none_or(|at| inside(b, 2, at, inside_mm))
        };
        self.boxes.is_empty() || self.boxes.iter().any(holds)
    }

    /// Whether what is to be avoided is far enough from a ball, and from one that comes down to there.
    fn is_away(&self, centre: &Point3, on: On) -> bool {
        let is_held = |balls: &[BallDrop; 2]| balls[on as usize].is_blocked_at(centre.x, centre.y, centre.z);
        ![&self.avoided, &self.obstacles].into_iter().flatten().any(is_held)
    }

    /// Height of the tip at which the ball keeps its distance from obstacles over a place, or this one if that is larger.
    pub(crate) fn over_obstacles(&self, x: f64, y: f64, tip: f64) -> f64 {
        let balls = self.obstacles.as_ref().map(|balls| &balls[On::Way as usize]);
        balls.map_or(tip, |ball| ball.tip_above(x, y, tip, self.radius_mm))
    }
}
