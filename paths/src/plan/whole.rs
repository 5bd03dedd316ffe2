//! What a plan is made of, checked and covered with triangles; faces that cannot be covered are replaced by their boxes.

use std::borrow::Cow;
use std::ops::Range;

use claymill_contact::Covering;
use claymill_nurbs::{Aabb, FaceId, Model};
use claymill_toolpath::Monitor;

use crate::pattern::step_over::flat_mm;
use crate::plan::covered::{Covered, LeftOut, WiderRegions};
use crate::plan::error::{EndRefusal, PlanError};
use crate::plan::keys::{Aside, PlanKeys};
use crate::plan::laying::{Laying, with_laying};
use crate::plan::options::{PlanOptions, check_end, check_tools};
use crate::plan::regions::Regions;

/// What each setup cuts is decided on triangles with sides of a ball radius; of half of one for rest strips, which are
/// narrow, and where that makes no more squares than this in all. But what two setups cut has to overlap by more than a
/// step-over, and overlaps by a triangle.
const FINEST: f64 = 0.5;
const MANY_SQUARES: f64 = 2e5;
const FINEST_STEPS: f64 = 1.5;
/// But for a rest no more triangles than this, as every setup holds them for two balls: 2 kB each. Of small balls in large models
/// they are larger.
const MOST_TRIANGLES: f64 = 2.5e6;
/// On surfaces with uneven parameters there are up to so many times as many as the area asks for.
const UNEVEN: f64 = 20.0;
/// Where there are no more of the smallest squares than this, strips that a setup gets to are looked for on parts of triangles.
const FEW_SQUARES: f64 = 1e5;

/// What a plan is made of. Its options leave nothing on the surface.
pub(super) struct Whole<'a> {
    model: &'a Model,
    regions: &'a Regions<'a>,
    obstacles: Vec<FaceId>,
    options: &'a PlanOptions,
    fineness_mm: f64,
    /// Where parts are kept.
    pub(super) keys: Option<PlanKeys<'a>>,
}

impl<'a> Whole<'a> {
    pub(super) fn new(
        model: &'a Model,
        regions: &'a Regions<'a>,
        obstacles: Range<FaceId>,
        options: &'a PlanOptions,
    ) -> Result<Self, PlanError> {
        check_size(model, options.tool.radius_mm())?;
        let obstacles: Vec<FaceId> = obstacles.collect();
        let fineness_mm = fineness_mm(model, regions, options);
        let aside = Aside { bare: &[], obstacles: &obstacles };
        let keys = PlanKeys::new(model, regions, options, &aside, fineness_mm);
        Ok(Whole { model, regions, obstacles, options, fineness_mm, keys })
    }

    /// Covers the model, decides what each setup cuts, and goes on with that; with the faces that had to be left out.
    pub(super) fn laid<T>(
        &self,
        monitor: &dyn Monitor,
        then: impl FnOnce(&Laying) -> Result<T, PlanError>,
    ) -> Result<(T, Vec<LeftOut>), PlanError> {
        let &Whole { model, regions, options, fineness_mm, .. } = self;
        let covered = Covered::new(model, regions.excluded, area_mm2(regions), fineness_mm)
            .map_err(|e| PlanError::of_face(model, e))?;
        if covered.left_out.is_empty() {
            let aside = Aside { bare: &[], obstacles: &self.obstacles };
            let laid = with_laying(&covered, &aside, self.keys.as_ref(), regions, options, monitor, then)?;
            return Ok((laid, Vec::new()));
        }
        let bare: Vec<FaceId> =
            covered.left_out.iter().map(|l| l.face).filter(|&face| !regions.excluded[face]).collect();
        let mut wider = WiderRegions::over(regions, &covered.model);
        wider.leave_out(bare.iter().copied());
        let wider = wider.as_regions(regions);
        let aside = Aside { bare: &bare, obstacles: &self.obstacles };
        let keys = PlanKeys::new(&covered.model, &wider, options, &aside, fineness_mm);
        let laid = with_laying(&covered, &aside, keys.as_ref(), &wider, options, monitor, then)?;
        Ok((laid, covered.left_out))
    }
}

/// Whether options suit each other.
pub(super) fn check(options: &PlanOptions, has_obstacles: bool) -> Result<(), PlanError> {
    check_tools(&options.tool, options.rest_of.as_ref(), options.scallop_mm)?;
    check_end(options)?;
    options.rest()?;
    if has_obstacles && !options.tool.is_ball() {
        return Err(PlanError::EndNotFor { tool: options.tool, what: EndRefusal::Obstacles });
    }
    Ok(())
}

/// The options by which passes are laid that leave nothing on the surface: those of a larger tool.
pub(super) fn on_the_surface(options: &PlanOptions) -> Result<Cow<'_, PlanOptions>, PlanError> {
    Ok(match options.allowance_mm {
        0.0 => Cow::Borrowed(options),
        _ => Cow::Owned(options.on_the_surface()?),
    })
}

/// Whether strips that a setup gets to are looked for on parts of triangles.
pub(super) fn divides(area_mm2: f64, radius_mm: f64) -> bool {
    area_mm2 <= FEW_SQUARES * (FINEST * radius_mm).powi(2)
}

fn area_mm2(regions: &Regions) -> f64 {
    regions.face_area_mm2.iter().sum()
}

/// Sides of the triangles on which it is decided what a setup cuts, mm.
fn fineness_mm(model: &Model, regions: &Regions, options: &PlanOptions) -> f64 {
    let (radius_mm, area_mm2) = (options.tool.radius_mm(), area_mm2(regions));
    if options.is_rest() {
        let finest_mm = FINEST * radius_mm;
        // Mostly the area tells that they are few.
        let edge_mm = Covering::longest_edge_mm(area_mm2, finest_mm);
        if UNEVEN * 2.0 * area_mm2 / (edge_mm * edge_mm) < MOST_TRIANGLES {
            return finest_mm;
        }
        let expected = Covering::expected_triangles(model, regions.excluded, area_mm2, finest_mm);
        return finest_mm * (expected / MOST_TRIANGLES).max(1.0).sqrt();
    }
    let step_mm = flat_mm(radius_mm, options.scallop_mm);
    let finest_mm = (FINEST * radius_mm).max(FINEST_STEPS * step_mm).min(radius_mm);
    (area_mm2 / MANY_SQUARES).sqrt().clamp(finest_mm, radius_mm)
}

fn check_size(model: &Model, radius_mm: f64) -> Result<(), PlanError> {
    let nets = model.faces.iter().flat_map(|f| f.surface.net());
    let bounds = nets.fold(Aabb::empty(), |mut b, h| {
        b.add(&(h.xyz() / h.w).into());
        b
    });
    let size = if bounds.is_empty() { 0.0 } else { (bounds.max - bounds.min).amax() };
    if 2.0 * radius_mm > size {
        return Err(PlanError::ToolTooBig { radius_mm, size_mm: size });
    }
    Ok(())
}
