//! Pictures of models and tool paths, made without a window, and the HTML report of a job.
//!
//! ```text
//!   Model + meshes + regions ─┐
//!                             ├─► Scene (triangles, polylines, legend: plain data)
//!   Program (tool paths) ─────┘       │
//!                             View ─► Camera ─► Renderer (wgpu) ─► Picture ─► PNG
//!                                                                     │
//!   Job, RegionsFile, Verification ───────────────────────────────────┴─► report.html
//! ```
//!
//! Scenes and cameras are computed on the processor in double precision and need no graphics card; only
//! [`Renderer`] does, and a software driver serves as well. The same scene, view and adapter give the same
//! pixels, whatever the number of threads.
//!
//! ```no_run
//! use claymill_viewer::{Axes, PictureOptions, Renderer, Scene, View, render_png};
//! # let scene = Scene::default();
//! let view = View::iso(&Axes::default());
//! render_png(&Renderer::new()?, &scene, &view, &PictureOptions::default(), "iso.png".as_ref())?;
//! # Ok::<(), claymill_viewer::ViewError>(())
//! ```

// What is to be said is returned: only the command prints.
#![cfg_attr(not(test), warn(clippy::print_stdout, clippy::print_stderr))]

mod adapter;
mod animation;
mod borders;
mod browser;
mod camera;
mod cells;
mod course;
mod error;
mod front;
mod heat;
mod labels;
mod legend;
mod lettering;
mod marks;
mod model_view;
mod movie;
mod nets;
mod overlay;
mod palette;
mod passes;
mod picture;
mod pins;
mod pipelines;
mod placement;
mod render;
mod report;
mod scene;
mod segments;
mod shapes;
mod stock;
mod stroke_font;
mod strokes;
mod thinning;
mod thumbnail;
mod tool;
mod touch;

pub use adapter::Gpu;
pub use animation::Reel;
pub use browser::{BrowserInput, browser_glb};
pub use camera::{Axes, Camera, View};
pub use cells::{CellHasher, Cells};
pub use course::Course;
pub use error::ViewError;
pub use heat::{HeatScale, heat_colour, heat_legend};
pub use legend::region_legend;
pub use legend::{LegendEntry, Mark};
pub use marks::StateScale;
pub use model_view::{Colouring, ModelView};
pub use movie::Movie;
pub use overlay::Places;
pub use palette::{
    CLAY, MATERIAL_SIDE, NOT_CUT, RegionExtent, Rgb, colour_regions, region_palette, stroke_shade,
};
pub use passes::{DEPTH_FORMAT, FrameLayouts, MULTIPLY, Pass, Press, surface_layout};
pub use picture::Picture;
pub use pins::{Pin, PinShape};
pub use render::{Backdrop, PictureOptions, Renderer, render_png};
pub use report::figures;
pub use report::{
    Compared, ComparisonInput, ReportError, ReportInput, ReportPicture, SetupSheet, comparison_html,
    deflated, report_html, write_report,
};
pub use scene::{Scene, face_colours, region_colours, shows_material};
pub use segments::CLOSEST_PASSES_PX;
pub use shapes::Label;
pub use shapes::{
    BOTH_SIDES, FREE_AGAINST, FREE_ALONG, LineKind, LineLayer, Strip, SurfaceMesh, SurfaceVertex,
};
pub use stock::Stock;
pub use strokes::{ColourBy, StrokeStyle, drawn_moves, flatten, kind_colour};
pub use thumbnail::{Thumbnail, region_thumbnails};
pub use tool::PosedTool;
