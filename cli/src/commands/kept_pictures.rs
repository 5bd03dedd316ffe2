//! Pictures of a job that were drawn before: of the same moves, model and job, on the same adapter, there is one set.

use std::fs;
use std::path::Path;

use claymill::Finished;
use claymill_toolpath::{Kept, KeyMaker, LONGEST_MADE, Packed, PartKey, read_plain, write_whole};
use claymill_viewer::{Renderer, ReportPicture, Rgb, SetupSheet, Thumbnail, ViewError};
use serde::{Deserialize, Serialize};

use super::finished::title;
use super::pictures::{self, Sights};
use super::stages::StockState;
use crate::console::Console;
use crate::failure::Failure;

/// Another version of what draws may draw otherwise: a hash of its sources.
const DRAWN_BY: &str = env!("CLAYMILL_DRAWING_SOURCES");

/// As [`pictures::take`], unless that was done before.
pub(super) fn take_or_know(
    console: &Console,
    finished: &Finished<'_>,
    states: &[StockState],
    folder: &Path,
    kept: &Kept,
) -> Result<Sights, Failure> {
    let renderer = pictures::renderer(console);
    let key = kept.is_somewhere().then(|| key(finished, renderer.as_ref()));
    let known = key.and_then(|key| kept.known::<KeptSights>(&key)).filter(KeptSights::stays_inside);
    if let Some(known) = known {
        return known.put_into(folder);
    }
    let sights = pictures::take(console, renderer.as_ref(), finished, states, folder)?;
    if let Some((key, drawn)) = key.zip(KeptSights::of(&sights, folder)) {
        kept.keep(&key, &drawn);
    }
    Ok(sights)
}

/// The verdict says on what it was passed: that, the name of the job and the adapter are all that pictures follow from.
fn key(finished: &Finished<'_>, renderer: Option<&Renderer>) -> PartKey {
    let adapter = renderer.map(Renderer::adapter);
    let key = KeyMaker::new("pictures").text(DRAWN_BY).text(&title(finished.job));
    key.debug(&(adapter, &finished.found.judged, finished.orientation)).finish()
}

/// What was drawn, as it is kept.
#[derive(Serialize, Deserialize)]
struct KeptSights {
    /// Pictures in the job folder: names and bytes.
    files: Vec<(String, Packed)>,
    colours: Vec<Rgb>,
    shots: Vec<KeptPicture>,
    sheets: Vec<(Option<KeptPicture>, [[f64; 3]; 3])>,
    /// From where a region is seen, and how.
    thumbnails: Vec<(String, Packed)>,
    space: Packed,
}

#[derive(Serialize, Deserialize)]
struct KeptPicture {
    caption: String,
    alt: String,
    png: Packed,
}

impl KeptSights {
    /// `None` where a picture in the folder cannot be read.
    fn of(sights: &Sights, folder: &Path) -> Option<Self> {
        let mut files = Vec::new();
        for entry in fs::read_dir(folder).ok()? {
            let path = entry.ok()?.path();
            if path.extension().is_some_and(|extension| extension == "png") {
                let name = path.file_name()?.to_str()?.to_owned();
                files.push((name, Packed::of_bytes(read_plain(&path, LONGEST_MADE).ok()?)));
            }
        }
        files.sort_by(|a, b| a.0.cmp(&b.0));
        let of_sheet = |s: &SetupSheet| (s.picture.as_ref().map(KeptPicture::from), s.axes);
        let of_region = |t: &Thumbnail| (t.seen_from.clone(), Packed::of_bytes(t.png.clone()));
        Some(KeptSights {
            files,
            colours: sights.colours.clone(),
            shots: sights.shots.iter().map(KeptPicture::from).collect(),
            sheets: sights.sheets.iter().map(of_sheet).collect(),
            thumbnails: sights.thumbnails.iter().map(of_region).collect(),
            space: Packed::of_bytes(sights.space.clone()),
        })
    }

    /// Whether all pictures lie in the job folder itself: others may write into a store.
    fn stays_inside(&self) -> bool {
        self.files
            .iter()
            .all(|(name, _)| Path::new(name).file_name().is_some_and(|file| file == name.as_str()))
    }

    /// The same as if it had been drawn into this folder.
    fn put_into(self, folder: &Path) -> Result<Sights, Failure> {
        for (name, png) in &self.files {
            let path = folder.join(name);
            write_whole(&path, png.as_bytes()).map_err(|source| ViewError::Write { path, source })?;
        }
        let sheet = |(picture, axes): (Option<KeptPicture>, _)| SetupSheet {
            picture: picture.map(KeptPicture::picture),
            axes,
        };
        let thumbnail =
            |(seen_from, png): (String, Packed)| Thumbnail { seen_from, png: png.as_bytes().to_vec() };
        Ok(Sights {
            colours: self.colours,
            shots: self.shots.into_iter().map(KeptPicture::picture).collect(),
            sheets: self.sheets.into_iter().map(sheet).collect(),
            thumbnails: self.thumbnails.into_iter().map(thumbnail).collect(),
            space: self.space.as_bytes().to_vec(),
        })
    }
}

impl From<&ReportPicture> for KeptPicture {
    fn from(ReportPicture { caption, alt, png }: &ReportPicture) -> Self {
        KeptPicture { caption: caption.clone(), alt: alt.clone(), png: Packed::of_bytes(png.clone()) }
    }
}

impl KeptPicture {
    fn picture(self) -> ReportPicture {
        ReportPicture { caption: self.caption, alt: self.alt, png: self.png.as_bytes().to_vec() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_that_lead_out_of_the_folder_are_not_taken() {
        let kept = |name: &str| KeptSights {
            files: vec![("preview-iso.png".into(), Packed::default()), (name.into(), Packed::default())],
            colours: Vec::new(),
            shots: Vec::new(),
            sheets: Vec::new(),
            thumbnails: Vec::new(),
            space: Packed::default(),
        };
        assert!(kept("stock-1-rough.png").stays_inside());
        for name in ["../preview.png", "/preview.png", "a/b.png", "..", "", "a.png/"] {
            assert!(!kept(name).stays_inside(), "{name}");
        }
    }
}
