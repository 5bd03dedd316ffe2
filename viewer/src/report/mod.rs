//! The report of a job: one HTML file that needs nothing else, for screen and paper.
//!
//! The order is that of a reader with little time: may this job be run, what is it, what does it look like,
//! and only then the tables.

mod checks;
mod choices;
mod comparison;
pub mod figures;
mod levels;
mod merging;
mod model;
mod plots;
mod sheets;
mod space;
mod tool;
mod work;

use std::path::Path;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use claymill_toolpath::{Job, Program, RegionsFile};
use claymill_verify::Verification;
use maud::{DOCTYPE, Markup, PreEscaped, html};
use thiserror::Error;

use crate::error::write_whole;
use crate::{Rgb, Thumbnail, ViewError};

pub use comparison::{Compared, ComparisonInput, comparison_html};
pub use space::deflated;

/// What a report is made of. Everything but the pictures comes from the job folder.
#[derive(Debug, Clone, Copy)]
pub struct ReportInput<'a> {
    /// Heading, usually the model's name.
    pub title: &'a str,
    /// The command line that makes this job again.
    pub command: &'a str,
    /// `job.json`.
    pub job: &'a Job,
    /// `regions.json`.
    pub regions: &'a RegionsFile,
    /// `verify.json`; `None` when the job has not been verified, which the report says loudly.
    pub verification: Option<&'a Verification>,
    /// Colour of each region in the pictures, by region id.
    pub region_colours: &'a [Rgb],
    /// Where each region is, by region id; may be empty.
    pub thumbnails: &'a [Thumbnail],
    /// The moves; the setup sheets tell what they reach.
    pub program: &'a Program,
    /// Seconds of each move, for the 3-D view's slider; may be empty.
    pub seconds: &'a [f64],
    /// For every setup of the job what its sheet shows; may be empty.
    pub sheets: &'a [SetupSheet],
    /// The pictures; the first one is shown large.
    pub pictures: &'a [ReportPicture],
    /// The job for the 3-D view, from [`crate::browser_glb`], [`deflated`]; `None`: the report has pictures only.
    pub space: Option<&'a [u8]>,
}

/// A picture of the report.
#[derive(Debug, Clone)]
pub struct ReportPicture {
    /// What is to be seen, for everybody.
    pub caption: String,
    /// What is to be seen, for those who cannot see it.
    pub alt: String,
    /// The PNG file's bytes.
    pub png: Vec<u8>,
}

/// What is to be seen on a setup sheet.
#[derive(Debug, Clone)]
pub struct SetupSheet {
    /// The model from that direction, with what is cut from there.
    pub picture: Option<ReportPicture>,
    /// The machine's X, Y and Z in model coordinates.
    pub axes: [[f64; 3]; 3],
}

/// Why a report could not be written.
#[derive(Debug, Error)]
pub enum ReportError {
    /// The file could not be written.
    #[error(transparent)]
    Write(#[from] ViewError),
}

/// Writes the report, beside its destination and then renamed.
///
/// # Errors
/// The file cannot be written.
pub fn write_report(path: &Path, input: &ReportInput<'_>) -> Result<(), ReportError> {
    Ok(write_whole(path, report_html(input).as_bytes())?)
}

/// What browsers may do with the page: nothing is fetched from anywhere, and nothing sent.
const POLICY: &str = "default-src 'none'; img-src data:; style-src 'unsafe-inline'; script-src 'unsafe-inline'; \
                      base-uri 'none'; form-action 'none'";

/// What every page begins with.
fn head(title: &str) -> Markup {
    html! {
        head {
            meta charset="utf-8";
            meta name="viewport" content="width=device-width, initial-scale=1";
            meta http-equiv="Content-Security-Policy" content=(POLICY);
            title { (title) }
            style { (PreEscaped(include_str!("style.css"))) }
        }
    }
}

/// The report as text.
#[must_use]
pub fn report_html(input: &ReportInput<'_>) -> String {
    let job = input.job;
    let page = html! {
        (DOCTYPE)
        html lang="en" {
            (head(&format!("{} – claymill report", input.title)))
            body {
                header {
                    h1 { (input.title) }
                    p.soft { (work::subtitle(job)) }
                    (checks::verdict(input.verification))
                    (work::key_figures(job, input.regions, input.verification))
                }
                main {
                    (space::section(input, input.pictures.first()))
                    (contents(job, input))
                    (pictures(input.pictures.get(1..).unwrap_or_default()))
                    (work::asked(job))
                    (work::path_lengths(job))
                    (work::setups(job))
                    (checks::section(input.verification))
                    (levels::section(input.verification))
                    (work::regions(input))
                    (choices::section(job))
                    (work::not_cut(job, input.verification.is_some()))
                    (sheets::section(input))
                    (merging::section(input.regions))
                    (model::section(job, input.regions))
                    (model::tolerances_and_timings(job))
                    (model::reproduce(input.command, job))
                }
                footer {
                    "claymill " (job.claymill_version) ", job folder format " (job.format_version)
                    ". Lengths are in millimetres of model coordinates unless a unit is given."
                }
                (space::scripts(input))
            }
        }
    };
    page.into_string()
}

/// Where to go from here; not on paper.
fn contents(job: &Job, input: &ReportInput<'_>) -> Markup {
    let checked = input.verification.is_some();
    let uncut = !job.area.uncut_mm2.is_empty();
    let places = [
        ("asked", "Asked", true),
        ("done", "Tool paths", true),
        ("checks", "Verification", checked),
        ("regions", "Regions", true),
        ("uncut", "Not cut", uncut),
        ("sheets", "Setup sheets", true),
        ("file", "The file", true),
        ("again", "Make it again", true),
    ];
    html! {
        nav aria-label="Contents" {
            @for (id, words, _) in places.iter().filter(|p| p.2) { a href=(format!("#{id}")) { (words) } }
        }
    }
}

fn pictures(pictures: &[ReportPicture]) -> Markup {
    html! {
        @if !pictures.is_empty() {
            section.pictures aria-label="Pictures" {
                @for picture in pictures { figure { (image(picture)) figcaption { (picture.caption) } } }
            }
        }
    }
}

fn image(picture: &ReportPicture) -> Markup {
    html! { img alt=(picture.alt) decoding="async" src=(format!("data:image/png;base64,{}", STANDARD.encode(&picture.png))); }
}
