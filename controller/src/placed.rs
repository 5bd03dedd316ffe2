//! Setups that the machine turns to by itself: tilted planes of the control, or an indexed rotary axis. The part then stays
//! where it is clamped.

use std::borrow::Cow;
use std::path::PathBuf;

use claymill_nurbs::{Aabb, Point3, Vector3};
use claymill_toolpath::{RotaryAxis, Stock};

use crate::dialects::Dialect;
use crate::frame::{Frame, signed_axis};
use crate::job::{MachineJob, Section, turned};
use crate::machine::PlaneBy;
use crate::tilt::{Angles, Placed, Tilt, Turn};
use crate::{Machine, PostError, ReadError, Refusal};

/// Stands in the header of programs that tilt planes.
pub(crate) const TILTED: &str = "tilted setups by the control's plane";
/// The tool is this far above what turns, mm.
const INDEX_CLEARANCE_MM: f64 = 10.0;
/// A setup is a turn about the rotary axis where their common direction agrees as well as this.
const SAME: f64 = 1e-6;
/// Decimals of an index.
const INDEX_DIGITS: u8 = 4;

/// How a control is told of a tilted plane, and with how many decimals.
pub(crate) fn plane_of(dialect: Dialect) -> Option<(Angles, u8)> {
    match dialect {
        Dialect::Siemens => Some((Angles::Xyz, 6)),
        Dialect::Heidenhain => Some((Angles::SpatialXyz, 4)),
        Dialect::Fanuc => Some((Angles::Zxz, 3)),
        _ => None,
    }
}

/// The axis that turns the part, where a control and a machine have one that is indexed.
pub(crate) fn index_axis(dialect: Dialect, machine: &Machine) -> Option<&RotaryAxis> {
    let linuxcnc = matches!(dialect, Dialect::LinuxCnc29 | Dialect::LinuxCnc210);
    machine.rotary.get("a").filter(|axis| linuxcnc && axis.turns_table)
}

/// The job as the machine turns to its setups; as it is where the machine turns to none, or has been asked already.
///
/// # Errors
/// The rotary axis does not come to a setup.
pub(crate) fn placed<'j>(
    job: &'j MachineJob,
    dialect: Dialect,
    machine: &Machine,
    by: PlaneBy,
) -> Result<Cow<'j, MachineJob>, PostError> {
    let planes = plane_of(dialect).filter(|_| by == PlaneBy::Control);
    let index = index_axis(dialect, machine);
    let is_done = job.sections.iter().any(|s| s.placed.is_some());
    if is_done || (planes.is_none() && index.is_none()) {
        return Ok(Cow::Borrowed(job));
    }
    let mut job = job.clone();
    let upright = Upright::of(&job, machine)?;
    for section in &mut job.sections {
        if let Some(axis) = index {
            upright.index(section, axis, machine)?;
        } else if let Some(how) = planes {
            upright.tilt(section, how, machine)?;
        }
    }
    Ok(Cow::Owned(job))
}

impl Dialect {
    /// Whether a job's setups off the axes are meant to be the control's tilted planes, and this post writes none.
    #[must_use]
    pub fn lacks_plane(self, job: &MachineJob, machine: &Machine) -> bool {
        let is_meant = machine.tilt.by == PlaneBy::Control && plane_of(self).is_none();
        let off_axes = |s: &Section| s.placed.is_none() && s.frame.axes().iter().any(|a| a.amax() != 1.0);
        is_meant && job.sections.iter().any(off_axes)
    }
}

impl MachineJob {
    /// The job as the machine turns to its setups, where it does so by itself.
    ///
    /// # Errors
    /// The rotary axis does not come to a setup.
    pub fn placed(self, dialect: Dialect, machine: &Machine) -> Result<MachineJob, PostError> {
        let turned = match placed(&self, dialect, machine, machine.tilt.by)? {
            Cow::Owned(turned) => Some(turned),
            Cow::Borrowed(_) => None,
        };
        Ok(turned.unwrap_or(self))
    }
}

/// As [`placed`], for a program that is there: its header says whether it tilts planes.
pub(crate) fn placed_as_written<'j>(
    job: &'j MachineJob,
    files: &[PathBuf],
    dialect: Dialect,
    machine: &Machine,
) -> Result<Cow<'j, MachineJob>, ReadError> {
    let said = match files.first() {
        Some(path) => crate::compare::head(path)?.contains(TILTED),
        None => false,
    };
    let by = if said { PlaneBy::Control } else { PlaneBy::Program };
    placed(job, dialect, machine, by).map_err(|e| ReadError::Astray {
        path: files.first().cloned().unwrap_or_default(),
        what: e.to_string(),
    })
}

/// The part as it stands in the setup from above.
struct Upright {
    up: Vector3,
    front: Vector3,
    /// Name of the setup from above, where the job has one.
    name: Option<String>,
    /// Corners of a box around the model and its stock, model mm.
    corners: Vec<Point3>,
}

impl Upright {
    fn of(job: &MachineJob, machine: &Machine) -> Result<Self, PostError> {
        let axis = |text: &str| {
            signed_axis(text)
                .ok_or_else(|| PostError::Job(format!("`{text}` is no axis; it should be like +z")))
        };
        let (up, front) = (axis(&job.job.request.up)?, axis(&job.job.request.length)?);
        let is_up = |axis: [f64; 3]| (Vector3::from(axis) - up).norm() < SAME;
        let in_job = job.job.setups.iter().find(|s| is_up(s.axis)).map(|s| s.name.clone());
        let name = in_job.or_else(|| machine.setups.contains_key("top").then(|| "top".to_owned()));
        let mut around = Aabb::of_corners(job.job.model.box_mm);
        if let Some(Stock::Layer { thickness_mm }) = job.job.stock {
            around = around.inflated(thickness_mm);
        }
        if let Some(box_mm) = job.job.stock.as_ref().and_then(Stock::box_mm) {
            around = around.union(&Aabb::of_corners(box_mm));
        }
        let corners = around.vertices().into();
        Ok(Upright { up, front, name, corners })
    }

    /// How the part stands for a section: with the zero of its own setup, else of the setup from above.
    fn stands(&self, section: &mut Section, machine: &Machine) -> Result<Frame, PostError> {
        if let Some(name) = self.name.as_ref().filter(|_| !machine.setups.contains_key(&section.setup)) {
            section.place.clone_from(name);
        }
        let zero = Point3::from(machine.place(&section.place).zero_mm);
        Frame::new(self.up, self.up, self.front, zero)
            .ok_or_else(|| PostError::Job("its up and length axes are parallel".into()))
    }

    /// Off the axes: a plane with angles in the control's digits, and the section's moves in exactly that plane.
    fn tilt(
        &self,
        section: &mut Section,
        (angles, digits): (Angles, u8),
        machine: &Machine,
    ) -> Result<(), PostError> {
        let along_axes = section.frame.axes().iter().all(|a| a.amax() == 1.0);
        if along_axes {
            return Ok(());
        }
        let stands = self.stands(section, machine)?;
        let Some(exact) = tilt_of(&section.frame, &stands) else {
            return Err(PostError::Job(format!("setup `{}` is no turn", section.setup)));
        };
        let deg = exact.angles_deg(angles).map(|a| crate::number::round(a, digits) + 0.0);
        let tilt = Tilt::by(angles, deg, Point3::origin());
        put(section, Placed { tilt, by: Turn::Plane { deg }, stands });
        Ok(())
    }

    /// A turn about the rotary axis: its position, and the section's moves where the part has come to.
    fn index(&self, section: &mut Section, axis: &RotaryAxis, machine: &Machine) -> Result<(), PostError> {
        let named = section.place.clone();
        let stands = self.stands(section, machine)?;
        let direction = Vector3::from(axis.direction).normalize();
        let turn =
            tilt_of(&section.frame, &stands).filter(|_| direction.x.abs() > 1.0 - SAME).and_then(|exact| {
                let [_, y, z] = exact.axes();
                // A turn about x leaves x; the part goes back what the plane went on.
                let deg = -y.z.atan2(z.z).to_degrees() * direction.x.signum();
                let deg = crate::number::round(deg, INDEX_DIGITS) + 0.0;
                let about_x = (exact.axes()[0] - Vector3::x()).norm() < SAME;
                about_x.then(|| Tilt::of_turned_part(&direction, deg).map(|tilt| (tilt, deg)))?
            });
        let Some((tilt, deg)) = turn else {
            // Another direction: the part is turned by hand, as on any machine.
            section.place = named;
            return Ok(());
        };
        let [low, high] = axis.travel_deg;
        let reached =
            [0.0, 360.0, -360.0].map(|turn| deg + turn).into_iter().find(|d| (low..=high).contains(d));
        let Some(reached) = reached else {
            let seq = section.strokes.first().map_or(0, |s| s.seq);
            let detail =
                format!("setup {} is at A{deg} degrees; A travels from {low} to {high}", section.setup);
            return Err(PostError::Refused { seq, refusal: Refusal::new("head-limit", detail) });
        };
        let radius = self.corners.iter().map(|p| {
            let q = stands.to_machine(p);
            q.y.hypot(q.z)
        });
        let safe_mm = radius.fold(section.clearance_mm, f64::max) + INDEX_CLEARANCE_MM;
        put(section, Placed { tilt, by: Turn::Index { deg: reached, safe_mm }, stands });
        Ok(())
    }
}

/// A setup's frame in the coordinates in which the part stands.
fn tilt_of(frame: &Frame, stands: &Frame) -> Option<Tilt> {
    let [x, y, z] = stands.axes();
    let seen = |a: Vector3| Vector3::new(x.dot(&a), y.dot(&a), z.dot(&a));
    Tilt::new(frame.axes().map(seen), Point3::origin())
}

/// Takes a section's moves into the coordinates of its plane as it is written.
fn put(section: &mut Section, placed: Placed) {
    let Placed { tilt, stands, .. } = placed;
    let [x, y, z] = stands.axes();
    let to_model = |v: Vector3| x * v.x + y * v.y + z * v.z;
    let zero = stands.to_model(&Point3::origin());
    let frame = Frame::of_axes(tilt.axes().map(to_model), zero);
    let before = section.frame;
    for stroke in &mut section.strokes {
        stroke.curve = turned(&stroke.curve, |p| frame.to_machine(&before.to_model(p)));
    }
    // Heights along the tool axis go with the zero.
    let shift = (before.to_model(&Point3::origin()) - zero).dot(&frame.axis());
    section.clearance_mm += shift;
    section.retreat_mm += shift;
    section.frame = frame;
    section.placed = Some(placed);
}

impl Section {
    /// Whether the part stands as in another section, so that nobody has to turn it in between.
    #[must_use]
    pub fn stands_as(&self, other: &Section) -> bool {
        let stands = |s: &Section| s.placed.map_or(s.frame, |p| p.stands);
        let is_placed = self.placed.is_some() || other.placed.is_some();
        is_placed && stands(self).axes().iter().zip(stands(other).axes()).all(|(a, b)| (a - b).norm() < SAME)
    }
}
