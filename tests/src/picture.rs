//! Reads PNG files and compares two pictures as an eye sees them: blurred, by distance in OKLab.

use std::path::Path;

/// A picture: red, green, blue and opacity, rows from the top.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Pixels {
    /// Width and height, pixels.
    pub size: [usize; 2],
    /// sRGB and opacity of each pixel.
    pub rgba: Vec<[u8; 4]>,
}

/// How much two pictures differ to an eye, in hundredths of OKLab's unit: about 2 is just seen side by side.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Perceived {
    /// At the place where they differ most.
    pub worst: f64,
    /// On the whole.
    pub mean: f64,
}

/// Standard deviation of the blur before pictures are compared, pixels: drivers may place edges differently by part of one.
const BLUR_PX: f64 = 1.2;
/// What two drivers, or two builds of one, may differ by.
const ALIKE: Perceived = Perceived { worst: 3.0, mean: 0.06 };

impl Pixels {
    /// Reads a PNG file.
    ///
    /// # Errors
    /// It cannot be read, or holds no colours of eight bits.
    pub fn read(path: &Path) -> Result<Self, String> {
        let said = |e: &dyn std::fmt::Display| format!("{}: {e}", path.display());
        let file = std::fs::File::open(path).map_err(|e| said(&e))?;
        let mut reader =
            png::Decoder::new(std::io::BufReader::new(file)).read_info().map_err(|e| said(&e))?;
        let mut data = vec![0; reader.output_buffer_size().ok_or_else(|| said(&"too large"))?];
        let info = reader.next_frame(&mut data).map_err(|e| said(&e))?;
        let rgba = match (info.color_type, info.bit_depth) {
            (png::ColorType::Rgb, png::BitDepth::Eight) => {
                data.chunks_exact(3).map(|p| [p[0], p[1], p[2], 255]).collect()
            }
            (png::ColorType::Rgba, png::BitDepth::Eight) => {
                data.chunks_exact(4).map(|p| [p[0], p[1], p[2], p[3]]).collect()
            }
            other => return Err(said(&format!("{other:?}"))),
        };
        Ok(Pixels { size: [info.width as usize, info.height as usize], rgba })
    }

    /// Each channel of OKLab (B. Ottosson, 2020), over a grey ground where the picture is transparent, blurred.
    fn seen(&self) -> [Vec<f64>; 3] {
        let mut channels = [(); 3].map(|()| Vec::with_capacity(self.rgba.len()));
        for &[r, g, b, a] in &self.rgba {
            let opacity = f64::from(a) / 255.0;
            let light = [r, g, b].map(|v| {
                let v = f64::from(v) / 255.0;
                let own = if v <= 0.04045 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) };
                own * opacity + 0.5 * (1.0 - opacity)
            });
            for (channel, v) in channels.iter_mut().zip(oklab(light)) {
                channel.push(v);
            }
        }
        channels.map(|c| self.blurred(&c))
    }

    fn blurred(&self, channel: &[f64]) -> Vec<f64> {
        let reach = (3.0 * BLUR_PX).ceil() as i64;
        let weight = |d: i64| (-0.5 * (d as f64 / BLUR_PX).powi(2)).exp();
        let total: f64 = (-reach..=reach).map(weight).sum();
        let [width, height] = self.size.map(|s| s as i64);
        let along = |from: &[f64], dx: i64, dy: i64| -> Vec<f64> {
            let at = |x: i64, y: i64| from[(y.clamp(0, height - 1) * width + x.clamp(0, width - 1)) as usize];
            let sum = |x: i64, y: i64| {
                (-reach..=reach).map(|d| weight(d) * at(x + d * dx, y + d * dy)).sum::<f64>()
            };
            (0..height)
                .flat_map(|y| (0..width).map(move |x| (x, y)))
                .map(|(x, y)| sum(x, y) / total)
                .collect()
        };
        along(&along(channel, 1, 0), 0, 1)
    }
}

fn oklab([r, g, b]: [f64; 3]) -> [f64; 3] {
    let l = (0.412_221_470_8 * r + 0.536_332_536_3 * g + 0.051_445_992_9 * b).cbrt();
    let m = (0.211_903_498_2 * r + 0.680_699_545_1 * g + 0.107_396_956_6 * b).cbrt();
    let s = (0.088_302_461_9 * r + 0.281_718_837_6 * g + 0.629_978_700_5 * b).cbrt();
    [
        0.210_454_255_3 * l + 0.793_617_785_0 * m - 0.004_072_046_8 * s,
        1.977_998_495_1 * l - 2.428_592_205_0 * m + 0.450_593_709_9 * s,
        0.025_904_037_1 * l + 0.782_771_766_2 * m - 0.808_675_766_0 * s,
    ]
}

/// The difference of two pictures as an eye sees it: both blurred, then by colour and lightness at every place.
///
/// # Panics
/// They are of different sizes.
#[must_use]
pub fn perceived(a: &Pixels, b: &Pixels) -> Perceived {
    assert_eq!(a.size, b.size, "pictures of different sizes");
    let (a, b) = (a.seen(), b.seen());
    let far = |i: usize| 100.0 * (0..3).map(|c| (a[c][i] - b[c][i]).powi(2)).sum::<f64>().sqrt();
    let count = a[0].len();
    let worst = (0..count).map(far).fold(0.0, f64::max);
    Perceived { worst, mean: (0..count).map(far).sum::<f64>() / count.max(1) as f64 }
}

impl Perceived {
    /// Whether that is no more than drivers may differ by.
    #[must_use]
    pub fn is_alike(&self) -> bool {
        self.worst <= ALIKE.worst && self.mean <= ALIKE.mean
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn picture(colour: impl Fn(usize, usize) -> [u8; 3]) -> Pixels {
        let pixels = (0..60).flat_map(|y| (0..80).map(move |x| (x, y)));
        let rgba = pixels.map(|(x, y)| colour(x, y)).map(|[r, g, b]| [r, g, b, 255]).collect();
        Pixels { size: [80, 60], rgba }
    }

    #[test]
    fn black_and_white_are_a_hundred_apart_and_a_picture_is_like_itself() {
        let (black, white) = (picture(|_, _| [0; 3]), picture(|_, _| [255; 3]));
        let found = perceived(&black, &white);
        approx::assert_abs_diff_eq!(found.mean, 100.0, epsilon = 1e-3);
        assert_eq!(perceived(&white, &white), Perceived { worst: 0.0, mean: 0.0 });
    }

    #[test]
    fn noise_of_one_step_passes_and_what_an_eye_sees_does_not() {
        let edge = |at: usize, low: u8| {
            move |x: usize, _: usize| if x < at { [low, 90, 60] } else { [220, 224, 230] }
        };
        let plain = picture(edge(40, 200));
        let noisy = picture(|x, y| edge(40, 200)(x, y).map(|v| v + ((7 * x + 13 * y) % 3) as u8 - 1));
        assert!(perceived(&plain, &noisy).is_alike());
        for (what, other) in [
            ("a colour", picture(edge(40, 185))),
            ("an edge moved by a pixel", picture(edge(41, 200))),
            ("a thin line", picture(|x, y| if y == 30 && x > 10 { [60; 3] } else { edge(40, 200)(x, y) })),
        ] {
            let found = perceived(&plain, &other);
            assert!(!found.is_alike(), "{what}: {found:?}");
        }
    }
}
