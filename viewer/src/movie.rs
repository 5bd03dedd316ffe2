//! Pictures one after the other: animated PNG, GIF, a pipe into an encoder, or all on one sheet.

use std::io::Write;

use crate::picture::Picture;

/// Frames in the order of time, all of one size.
#[derive(Debug, Clone)]
pub struct Movie {
    /// The frames.
    pub frames: Vec<Picture>,
    /// Frames a second.
    pub frames_per_s: u16,
}

/// The part of a picture that differs from the one before: left, top, width, height. One pixel where nothing does.
fn changed(before: &Picture, now: &Picture) -> [u32; 4] {
    let width = now.width as usize;
    let differs =
        before.rgba.chunks_exact(4).zip(now.rgba.chunks_exact(4)).enumerate().filter(|(_, (a, b))| a != b);
    let (mut low, mut high) = ([usize::MAX; 2], [0; 2]);
    for (i, _) in differs {
        let at = [i % width, i / width];
        low = [low[0].min(at[0]), low[1].min(at[1])];
        high = [high[0].max(at[0]), high[1].max(at[1])];
    }
    if low[0] == usize::MAX {
        return [0, 0, 1, 1];
    }
    [low[0] as u32, low[1] as u32, (high[0] - low[0] + 1) as u32, (high[1] - low[1] + 1) as u32]
}

/// Red, green and blue of a part.
fn part_rgb(picture: &Picture, [left, top, width, height]: [u32; 4]) -> Vec<u8> {
    let row = |y: u32| {
        let at = 4 * (y as usize * picture.width as usize + left as usize);
        picture.rgba[at..at + 4 * width as usize].chunks_exact(4).flat_map(|p| [p[0], p[1], p[2]])
    };
    (top..top + height).flat_map(row).collect()
}

impl Movie {
    /// What each frame adds to the one before it.
    fn parts(&self) -> impl Iterator<Item = ([u32; 4], Vec<u8>)> {
        self.frames.iter().enumerate().map(|(i, now)| {
            let part = match i.checked_sub(1) {
                Some(before) => changed(&self.frames[before], now),
                None => [0, 0, now.width, now.height],
            };
            (part, part_rgb(now, part))
        })
    }

    /// As an animated PNG that runs for ever. Only what changes is written.
    ///
    /// # Errors
    /// There is no frame.
    pub fn apng(&self) -> Result<Vec<u8>, png::EncodingError> {
        let mut bytes = Vec::new();
        let first = self.frames.first().ok_or_else(empty)?;
        let mut encoder = png::Encoder::new(&mut bytes, first.width, first.height);
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(png::BitDepth::Eight);
        encoder.add_text_chunk("Software".into(), "claymill".into())?;
        encoder.set_animated(self.frames.len() as u32, 0)?;
        encoder.set_frame_delay(1, self.frames_per_s)?;
        let mut writer = encoder.write_header()?;
        for ([left, top, width, height], rgb) in self.parts() {
            // Smaller before it moves, or it would stick out.
            writer.reset_frame_position()?;
            writer.set_frame_dimension(width, height)?;
            writer.set_frame_position(left, top)?;
            writer.write_image_data(&rgb)?;
        }
        writer.finish()?;
        Ok(bytes)
    }

    /// As a GIF that runs for ever: 256 colours a frame.
    ///
    /// # Errors
    /// There is no frame, or one is too large for the format (65 535 pixels a side).
    pub fn gif(&self) -> Result<Vec<u8>, gif::EncodingError> {
        const FINE: i32 = 10;
        /// A comment, by which the file is known again as one of ours.
        const COMMENT: u8 = 0xFE;
        let side = |pixels: u32| u16::try_from(pixels).map_err(|_| gif::EncodingError::from(too_large()));
        let mut bytes = Vec::new();
        let (width, height) = match self.frames.first() {
            Some(f) => (side(f.width)?, side(f.height)?),
            None => return Err(gif::EncodingError::from(too_large())),
        };
        let mut encoder = gif::Encoder::new(&mut bytes, width, height, &[])?;
        encoder.set_repeat(gif::Repeat::Infinite)?;
        encoder.write_raw_extension(gif::AnyExtension(COMMENT), &[b"claymill"])?;
        for ([left, top, width, height], rgb) in self.parts() {
            let mut frame = gif::Frame::from_rgb_speed(side(width)?, side(height)?, &rgb, FINE);
            (frame.left, frame.top) = (side(left)?, side(top)?);
            frame.delay = 100 / self.frames_per_s.max(1);
            frame.dispose = gif::DisposalMethod::Keep;
            encoder.write_frame(&frame)?;
        }
        drop(encoder);
        Ok(bytes)
    }

    /// All pixels of all frames, red, green and blue, as encoders take them on standard input.
    ///
    /// # Errors
    /// The reader has gone.
    pub fn write_raw(&self, to: &mut impl Write) -> std::io::Result<()> {
        for f in &self.frames {
            to.write_all(&part_rgb(f, [0, 0, f.width, f.height]))?;
        }
        Ok(())
    }

    /// All frames on one sheet, row by row, with so many columns.
    #[must_use]
    pub fn sheet(&self, columns: u32) -> Picture {
        const GAP: u32 = 6;
        let columns = columns.clamp(1, self.frames.len().max(1) as u32);
        let rows = (self.frames.len() as u32).div_ceil(columns);
        let (w, h) = self.frames.first().map_or((1, 1), |f| (f.width, f.height));
        let (width, height) = (columns * (w + GAP) + GAP, rows * (h + GAP) + GAP);
        let mut rgba = vec![255; 4 * width as usize * height as usize];
        for (k, frame) in self.frames.iter().enumerate() {
            let (left, top) = (GAP + k as u32 % columns * (w + GAP), GAP + k as u32 / columns * (h + GAP));
            for (y, row) in frame.rgba.chunks_exact(4 * w as usize).enumerate() {
                let at = 4 * ((top as usize + y) * width as usize + left as usize);
                rgba[at..at + row.len()].copy_from_slice(row);
            }
        }
        Picture { width, height, rgba }
    }
}

fn empty() -> png::EncodingError {
    png::EncodingError::IoError(std::io::Error::other("an animation needs a frame"))
}

fn too_large() -> std::io::Error {
    std::io::Error::other("a GIF needs a frame of at most 65535 pixels a side")
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A dot that runs over a field.
    fn movie() -> Movie {
        let frame = |k: usize| {
            let dot =
                |i: usize| if i == 33 * k + 5 { [200, 30, 40, 255] } else { [90, 120, (i % 7) as u8, 255] };
            Picture { width: 32, height: 20, rgba: (0..640).flat_map(dot).collect() }
        };
        Movie { frames: (0..6).map(frame).chain([frame(5)]).collect(), frames_per_s: 10 }
    }

    #[test]
    fn an_animated_png_gives_every_frame_back() {
        let movie = movie();
        let bytes = movie.apng().unwrap();
        let mut reader = png::Decoder::new(std::io::Cursor::new(&bytes)).read_info().unwrap();
        assert_eq!(reader.info().animation_control().unwrap().num_frames, 7);
        let mut canvas = vec![0; 3 * 640];
        let mut buffer = vec![0; reader.output_buffer_size().unwrap()];
        for frame in &movie.frames {
            reader.next_frame(&mut buffer).unwrap();
            let c = *reader.info().frame_control().unwrap();
            for y in 0..c.height as usize {
                let (from, n) = (3 * y * c.width as usize, 3 * c.width as usize);
                let to = 3 * ((c.y_offset as usize + y) * 32 + c.x_offset as usize);
                canvas[to..to + n].copy_from_slice(&buffer[from..from + n]);
            }
            assert_eq!(canvas, part_rgb(frame, [0, 0, 32, 20]));
        }
        assert!(Movie { frames: Vec::new(), ..movie }.apng().is_err());
    }

    #[test]
    fn a_gif_has_all_frames_and_a_sheet_all_pictures() {
        let movie = movie();
        let bytes = movie.gif().unwrap();
        let mut reader = gif::Decoder::new(bytes.as_slice()).unwrap();
        let mut frames = 0;
        while let Some(frame) = reader.read_next_frame().unwrap() {
            assert_eq!(frame.delay, 10);
            frames += 1;
        }
        assert_eq!(frames, 7);
        let sheet = movie.sheet(3);
        assert_eq!((sheet.width, sheet.height), (3 * 38 + 6, 3 * 26 + 6));
        assert_eq!(sheet.pixel(6 + 5, 6), movie.frames[0].pixel(5, 0));
        assert_eq!(sheet.pixel(6 + 38 + 6, 7), movie.frames[1].pixel(6, 1));
    }
}
