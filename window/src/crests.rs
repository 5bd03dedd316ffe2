//! Scallops, measured while the window goes on.

use std::sync::{Arc, Mutex};

use claymill_nurbs::Point3;
use claymill_toolpath::Stage;
use claymill_verify::VerifyOptions;

use crate::desk::Desk;

/// How far the map looks for crests along the passes, mm.
const CREST_SPACING_MM: f64 = 4.0;

/// The measurement of scallops, which takes its time.
#[derive(Debug, Clone, PartialEq)]
pub enum Crests {
    /// Not asked for.
    Unknown,
    /// Under way: the stage and its share.
    Measuring(String, f64),
    /// Done: place and height, mm.
    Known(Arc<Vec<(Point3, f64)>>),
    /// Why not.
    Failed(String),
}

/// Where the measuring thread leaves its news, until they are taken.
pub(crate) type News = Arc<Mutex<Option<Crests>>>;

impl Desk<'_> {
    /// How far the measurement of scallops is.
    #[must_use]
    pub fn crests(&self) -> &Crests {
        &self.crests
    }

    /// Starts to measure scallops, beside everything else. `folder` holds the job, for obstacles named in it.
    pub fn measure_crests(&mut self) {
        if self.exhibit.job.is_none() || matches!(self.crests, Crests::Measuring(..) | Crests::Known(_)) {
            return;
        }
        self.crests = Crests::Measuring("preparing the model".into(), 0.0);
        let (exhibit, news) = (Arc::clone(self.exhibit), Arc::clone(&self.news));
        let say = move |news: &News, what: Crests| {
            if let Ok(mut news) = news.lock() {
                *news = Some(what);
            }
        };
        std::thread::spawn(move || {
            let Some(job) = &exhibit.job else { return };
            let options = VerifyOptions { crest_spacing_mm: CREST_SPACING_MM, ..VerifyOptions::default() };
            let progress = |stage: Stage, share: f64| say(&news, Crests::Measuring(stage.to_string(), share));
            let found =
                claymill_verify::crest_samples(&exhibit.model, &job.job, &job.program, &options, &progress);
            let done = match found {
                Ok(samples) => {
                    Crests::Known(Arc::new(samples.into_iter().map(|c| (c.foot, c.height_mm)).collect()))
                }
                Err(e) => Crests::Failed(e.to_string()),
            };
            say(&news, done);
        });
    }
}
