//! What directions reach of a model, and the fewest that reach all that can be reached.

use claymill_contact::OpenStretch;
use claymill_paths::{Axis, Orientation, open_borders};
use claymill_reach::{
    AxisView, Cover, Direction, Gain, Origin, Part, Reach, ReachError, ReachFile, Reacher, at_angle,
    axis_views, best_axis, choose, circle, gains, sphere,
};
use claymill_toolpath::{FreeSide, Holder, Monitor, Tool};

use crate::error::Error;
use crate::material::free_sides;
use crate::merged::Merged;
use crate::model_file::ModelFile;

/// Angles about a rotary axis are so far apart, degrees.
const STEP_DEG: f64 = 1.0;
/// Directions of a head are spread this finely: 162 over the whole sphere.
const FINENESS: u32 = 2;
/// So many directions more than were chosen are looked at for what they would add.
const MORE: usize = 1;
/// Choices with more directions are not listed.
const MOST_GAINS: usize = 12;

/// Which directions there are to choose from.
#[derive(Debug, Clone, PartialEq)]
pub enum DirectionsFrom {
    /// Those that a head tilts to from the up axis, by so many degrees at most.
    Head(f64),
    /// Angles about an axis of the model.
    Rotary(Axis),
    /// Angles about the axis that suits the model.
    BestRotary,
}

/// What is asked of a model.
#[derive(Debug, Clone, PartialEq)]
pub struct ReachAsked {
    /// The tool.
    pub tool: Tool,
    /// What holds it.
    pub holder: Option<Holder>,
    /// The surface leans no further from the tool's axis, degrees.
    pub steepest_deg: f64,
    /// The candidates.
    pub from: DirectionsFrom,
    /// Directions that are taken in any case, in model coordinates.
    pub forced: Vec<[f64; 3]>,
    /// Angles about the rotary axis that are taken in any case, degrees.
    pub forced_deg: Vec<f64>,
    /// Share of what can be reached that the chosen directions reach at least, from 0 to 1.
    pub share: f64,
}

impl ReachAsked {
    /// Directions of a head over the whole upper half, by a tool without a holder.
    #[must_use]
    pub fn of(tool: Tool) -> Self {
        let (from, steepest_deg) = (DirectionsFrom::Head(90.0), claymill_reach::USUAL_STEEPEST_DEG);
        let (forced, forced_deg) = (Vec::new(), Vec::new());
        ReachAsked { tool, holder: None, steepest_deg, from, forced, forced_deg, share: USUAL_SHARE }
    }
}

/// Directions reach so much of what can be reached, unless more or less is asked for: what is left takes setups of its own for
/// corners of a few square millimetres.
pub const USUAL_SHARE: f64 = 0.99;

/// What was found.
#[derive(Debug, Clone)]
pub struct ReachFound {
    /// Of the axes that were looked at, what is seen from around them.
    pub axes: Vec<AxisView>,
    /// The rotary axis, if any.
    pub axis: Option<Axis>,
    /// The candidates; those that are forced come first.
    pub directions: Vec<Direction>,
    /// What each of them reaches.
    pub reach: Reach,
    /// The chosen ones, and the proof.
    pub cover: Cover,
    /// The most area for one direction more at a time.
    pub gains: Vec<Gain>,
    /// The same as `reach.json` holds it.
    pub record: ReachFile,
}

/// Finds what directions reach of a model whose sides were found, and the fewest of them.
///
/// # Errors
/// A number cannot be, a face cannot be covered, there is no direction, or the monitor ends it.
pub fn find_reach(
    file: &ModelFile,
    merged: &Merged,
    orientation: Orientation,
    asked: &ReachAsked,
    monitor: &dyn Monitor,
) -> Result<ReachFound, Error> {
    let free = free_sides(&merged.record.sheets, file.model().faces.len());
    let excluded = vec![false; file.model().faces.len()];
    let name = file.name();
    let open = open_borders(&merged.found);
    let part = part(file, &free, &open, &excluded);
    Ok(of_part((&part, &name), orientation, asked, monitor)?)
}

/// A model as it is reached.
pub(crate) fn part<'a>(
    file: &'a ModelFile,
    free_sides: &'a [FreeSide],
    open: &'a [OpenStretch],
    excluded: &'a [bool],
) -> Part<'a> {
    Part { model: file.model(), face_area_mm2: &file.face_area_mm2, free_sides, open, excluded }
}

pub(crate) fn of_part(
    (part, name): (&Part, &str),
    orientation: Orientation,
    asked: &ReachAsked,
    monitor: &dyn Monitor,
) -> Result<ReachFound, ReachError> {
    let Orientation { up, front } = orientation;
    let model_axes = |index| Axis { index, negative: false };
    let axes = match asked.from {
        DirectionsFrom::Head(_) => Vec::new(),
        DirectionsFrom::Rotary(axis) => axis_views(part, &[axis], monitor)?,
        DirectionsFrom::BestRotary => axis_views(part, &[0, 1, 2].map(model_axes), monitor)?,
    };
    let axis = match asked.from {
        DirectionsFrom::Head(_) => None,
        DirectionsFrom::Rotary(axis) => Some(axis),
        DirectionsFrom::BestRotary => best_axis(&axes).map(|view| view.axis),
    };
    let directions = match (axis, &asked.from) {
        (Some(axis), _) => {
            let forced = asked.forced_deg.iter().map(|&deg| at_angle(axis, deg, up, front));
            let mut directions: Vec<Direction> = forced.collect::<Result<_, _>>()?;
            let taken: Vec<_> = directions.iter().map(|d| d.frame.axis()).collect();
            let all = circle(axis, STEP_DEG, up, front)?;
            directions.extend(all.into_iter().filter(|d| !taken.contains(&d.frame.axis())));
            directions
        }
        (None, DirectionsFrom::Head(range_deg)) => {
            sphere(part, &asked.forced, *range_deg, FINENESS, (up, front))?
        }
        (None, _) => return Err(ReachError::Nothing),
    };
    let forced: Vec<usize> = (0..asked.forced.len() + asked.forced_deg.len())
        .filter(|&k| k < asked.forced_deg.len() || matches!(directions[k].origin, Origin::Forced))
        .collect();
    let reacher =
        Reacher { holder: asked.holder.clone(), steepest_deg: asked.steepest_deg, ..Reacher::of(asked.tool) };
    let reach = Reach::new(part, &reacher, &directions, monitor)?;
    let weights = reach.weights();
    let cover = choose(&reach.table, &weights, &forced, 1.0 - asked.share, monitor)?;
    let most = (cover.chosen().len() + MORE).min(MOST_GAINS);
    let gains = gains(&reach.table, &weights, &forced, most);
    let record = ReachFile::new((name, part, &reacher), &directions, &reach, &cover, &gains);
    Ok(ReachFound { axes, axis, directions, reach, cover, gains, record })
}

impl ReachFound {
    /// The chosen directions as setups, `NAME:X,Y,Z`, those along axes of the model by their usual names.
    #[must_use]
    pub fn setups(&self, orientation: Orientation) -> Vec<String> {
        let usual = Orientation::SETUPS.iter().filter_map(|name| orientation.setup(name).ok());
        let usual: Vec<_> = usual.collect();
        let mut of_auto = 0;
        let name = |&column: &usize| {
            let axis = self.directions[column].frame.axis();
            if let Some(frame) = usual.iter().find(|frame| frame.axis() == axis) {
                return frame.name.as_str().to_owned();
            }
            of_auto += 1;
            // The shortest digits that give the same numbers again.
            format!("auto-{of_auto}:{},{},{}", axis.x, axis.y, axis.z)
        };
        self.cover.columns.iter().map(name).collect()
    }
}
