//! Finished pictures in sRGB with opacity: PNG encoding, halving by light, and opacity after the
//! PNG format.

use std::path::Path;

use crate::ViewError;
use crate::error::write_whole;

/// A finished picture: sRGB and opacity, rows from the top.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Picture {
    /// Width, pixels.
    pub width: u32,
    /// Height, pixels.
    pub height: u32,
    /// Four bytes a pixel.
    pub rgba: Vec<u8>,
}

impl Picture {
    /// The pixel in column `x` and row `y`; transparent black outside.
    #[must_use]
    pub fn pixel(&self, x: u32, y: u32) -> [u8; 4] {
        let at = 4 * (y as usize * self.width as usize + x as usize);
        match self.rgba.get(at..at + 4) {
            Some(&[r, g, b, a]) if x < self.width => [r, g, b, a],
            _ => [0; 4],
        }
    }

    /// The picture as a PNG file's bytes.
    #[must_use]
    pub fn png(&self) -> Vec<u8> {
        let opaque = self.rgba.chunks_exact(4).all(|p| p[3] == 255);
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, self.width, self.height);
        encoder.set_depth(png::BitDepth::Eight);
        encoder.set_color(if opaque { png::ColorType::Rgb } else { png::ColorType::Rgba });
        let rgb: Vec<u8>;
        let data = if opaque {
            rgb = self.rgba.chunks_exact(4).flat_map(|p| [p[0], p[1], p[2]]).collect();
            &rgb
        } else {
            &self.rgba
        };
        // Known again as one of ours.
        let marked = encoder.add_text_chunk("Software".into(), "claymill".into());
        debug_assert!(marked.is_ok(), "both are Latin");
        let written = encoder.write_header().and_then(|mut w| w.write_image_data(data));
        debug_assert!(written.is_ok(), "writing to memory cannot fail");
        bytes
    }

    /// Writes the picture as a PNG file, beside its destination and then renamed; returns the file's bytes.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn save(&self, path: &Path) -> Result<Vec<u8>, ViewError> {
        let bytes = self.png();
        write_whole(path, &bytes)?;
        Ok(bytes)
    }

    /// Forgets the opacity.
    pub(crate) fn make_opaque(&mut self) {
        for pixel in self.rgba.chunks_exact_mut(4) {
            pixel[3] = 255;
        }
    }

    /// From light that is already weakened by the opacity, as drawing on nothing leaves it, to the
    /// independent colour and opacity of the PNG format: without this, edges are dark on any ground.
    pub(crate) fn unmultiply(&mut self) {
        for pixel in self.rgba.chunks_exact_mut(4).filter(|p| !matches!(p[3], 0 | 255)) {
            let opacity = f32::from(pixel[3]) / 255.0;
            for c in &mut pixel[..3] {
                let light = (to_linear(f32::from(*c) / 255.0) / opacity).min(1.0);
                *c = (to_srgb(light) * 255.0).round() as u8;
            }
        }
    }

    /// The picture at half the size: each pixel the mean, by light, of four.
    pub(crate) fn halved(&self) -> Picture {
        let light: Vec<f32> = (0..256).map(|v| to_linear(v as f32 / 255.0)).collect();
        let (width, height) = (self.width / 2, self.height / 2);
        let row_bytes = 4 * self.width as usize;
        let mut rgba = Vec::with_capacity(4 * width as usize * height as usize);
        for y in 0..height as usize {
            for x in 0..width as usize {
                let first = 2 * y * row_bytes + 8 * x;
                let four = [first, first + 4, first + row_bytes, first + row_bytes + 4];
                for c in 0..3 {
                    let sum: f32 = four.iter().map(|&at| light[self.rgba[at + c] as usize]).sum();
                    rgba.push((to_srgb(sum / 4.0) * 255.0).round() as u8);
                }
                let sum: u32 = four.iter().map(|&at| u32::from(self.rgba[at + 3])).sum();
                rgba.push(((sum + 2) / 4) as u8);
            }
        }
        Picture { width, height, rgba }
    }
}

fn to_linear(v: f32) -> f32 {
    if v <= 0.04045 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) }
}

fn to_srgb(v: f32) -> f32 {
    if v <= 0.003_130_8 { 12.92 * v } else { 1.055 * v.powf(1.0 / 2.4) - 0.055 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn png_returns_the_same_pixels_and_halving_averages_light() {
        let picture = Picture {
            width: 2,
            height: 2,
            rgba: [[0, 0, 0, 255], [255, 255, 255, 255], [255, 255, 255, 255], [0, 0, 0, 255]].concat(),
        };
        let mut reader = png::Decoder::new(std::io::Cursor::new(picture.png())).read_info().unwrap();
        let mut rgb = vec![0; reader.output_buffer_size().unwrap()];
        reader.next_frame(&mut rgb).unwrap();
        assert_eq!(rgb, [0, 0, 0, 255, 255, 255, 255, 255, 255, 0, 0, 0]);
        // Half the light of white is sRGB 188.
        assert_eq!(picture.halved().rgba, [188, 188, 188, 255]);
    }

    #[test]
    fn a_half_covered_edge_keeps_its_colour() {
        // White over nothing in half of the pixel.
        let mut picture = Picture { width: 2, height: 1, rgba: vec![188, 188, 188, 128, 0, 0, 0, 0] };
        picture.unmultiply();
        assert_eq!(picture.rgba, [255, 255, 255, 128, 0, 0, 0, 0]);
    }
}
