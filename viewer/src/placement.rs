//! Where captions and legends stand in a picture: the size and corner that hide the least of the
//! model.

use crate::picture::Picture;

/// A rectangle of a picture, pixels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Area {
    /// Top left.
    pub(crate) corner: [f32; 2],
    /// Width and height.
    pub(crate) size: [f32; 2],
}

/// Where something may stand.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Corner {
    TopLeft,
    TopRight,
    BottomLeft,
    BottomRight,
}

/// A choice among places.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Stand {
    /// Which of the sizes.
    pub(crate) size: usize,
    corner: Corner,
    /// Beside what stands in the corner already, not above or below it.
    beside: bool,
}

/// Which pixels show the model, before the backdrop is made opaque.
#[derive(Debug, Clone)]
pub(crate) struct Covered {
    width: usize,
    pixels: Vec<bool>,
}

impl Covered {
    /// Where the picture is not transparent.
    pub(crate) fn of(picture: &Picture) -> Self {
        let pixels = picture.rgba.chunks_exact(4).map(|p| p[3] > 0).collect();
        Covered { width: picture.width as usize, pixels }
    }

    /// Pixels of `area` that show the model.
    fn count(&self, area: &Area) -> usize {
        // Float to integer conversion saturates, so that nothing is counted outside the picture.
        let range = |i: usize, end: usize| {
            let low = area.corner[i].floor() as usize;
            let high = ((area.corner[i] + area.size[i]).ceil() as usize).min(end);
            low.min(high)..high
        };
        let height = self.pixels.len() / self.width.max(1);
        let columns = range(0, self.width);
        range(1, height)
            .map(|y| self.pixels[y * self.width..][columns.clone()].iter().filter(|c| **c).count())
            .sum()
    }
}

/// A picture on which things are placed where neither the model nor anything placed before is.
pub(crate) struct Page<'a> {
    size: [f32; 2],
    model: &'a Covered,
    taken: Vec<Area>,
    /// Things keep so far away from the model where they can, pixels.
    away: f32,
}

impl<'a> Page<'a> {
    pub(crate) fn new(size: [u32; 2], model: &'a Covered, away: f32) -> Self {
        Page { size: size.map(|s| s as f32), model, taken: Vec::new(), away }
    }

    /// Keeps an area free.
    pub(crate) fn take(&mut self, area: Area) {
        self.taken.push(area);
    }

    /// What is kept free, in the order in which it was taken.
    #[cfg(test)]
    pub(crate) fn taken(&self) -> &[Area] {
        &self.taken
    }

    /// Whether nothing placed before is in `area`.
    pub(crate) fn is_free(&self, area: &Area) -> bool {
        self.taken.iter().all(|t| !overlap(t, area))
    }

    /// Whether `area` lies in the picture.
    pub(crate) fn holds(&self, area: &Area) -> bool {
        (0..2).all(|i| area.corner[i] >= 0.0 && area.corner[i] + area.size[i] <= self.size[i])
    }

    /// Part of `area` that shows the model.
    pub(crate) fn covered_share(&self, area: &Area) -> f32 {
        self.model.count(area) as f32 / (area.size[0] * area.size[1]).max(1.0)
    }

    /// Chooses one of several sizes and a corner: the first size that comes near the model in no corner, else what comes
    /// nearest least. Returns the choice and the top left of its place.
    pub(crate) fn place(&mut self, sizes: &[[f32; 2]], border: f32, corners: &[Corner]) -> (Stand, [f32; 2]) {
        let stand = self.best(sizes, border, corners).unwrap_or(Stand {
            size: 0,
            corner: Corner::TopLeft,
            beside: false,
        });
        (stand, self.place_again(&stand, sizes, border))
    }

    /// Top left of what stands as it did in another picture.
    pub(crate) fn place_again(&mut self, stand: &Stand, sizes: &[[f32; 2]], border: f32) -> [f32; 2] {
        let size = sizes.get(stand.size).or(sizes.last()).copied().unwrap_or_default();
        let area = self.area(size, border, stand);
        self.take(area);
        area.corner
    }

    /// Whether one of several sizes comes near the model in some corner not at all.
    pub(crate) fn has_room(&self, sizes: &[[f32; 2]], border: f32, corners: &[Corner]) -> bool {
        let best = self.best(sizes, border, corners);
        best.is_some_and(|s| self.is_clear(&self.area(sizes[s.size], border, &s)))
    }

    /// Whether the model is nowhere near.
    pub(crate) fn is_clear(&self, area: &Area) -> bool {
        self.near(area) == 0
    }

    /// Pixels of the model in an area and about it.
    fn near(&self, area: &Area) -> usize {
        let corner = area.corner.map(|c| c - self.away);
        self.model.count(&Area { corner, size: area.size.map(|s| s + 2.0 * self.away) })
    }

    fn best(&self, sizes: &[[f32; 2]], border: f32, corners: &[Corner]) -> Option<Stand> {
        let each = |beside: bool| {
            let stand = move |size| corners.iter().map(move |&corner| Stand { size, corner, beside });
            (0..sizes.len()).flat_map(stand)
        };
        let beside = each(true).filter(|s| {
            let area = self.area(sizes[s.size], border, s);
            self.holds(&area) && self.is_free(&area)
        });
        // The first of equal ones.
        each(false).chain(beside).min_by_key(|s| self.near(&self.area(sizes[s.size], border, s)))
    }

    fn area(&self, size: [f32; 2], border: f32, stand: &Stand) -> Area {
        let left = matches!(stand.corner, Corner::TopLeft | Corner::BottomLeft);
        let top = matches!(stand.corner, Corner::TopLeft | Corner::TopRight);
        let x = if left { border } else { self.size[0] - border - size[0] };
        let y = if top { border } else { self.size[1] - border - size[1] };
        let mut area = Area { corner: [x, y], size };
        // Each look passes at least one of what is taken, so that this many are enough.
        for _ in 0..self.taken.len() {
            let Some(other) = self.taken.iter().find(|t| overlap(t, &area)) else {
                break;
            };
            let (i, forward, gap) = if stand.beside { (0, left, border) } else { (1, top, 0.0) };
            area.corner[i] =
                if forward { other.corner[i] + other.size[i] + gap } else { other.corner[i] - size[i] - gap };
        }
        area
    }
}

fn overlap(a: &Area, b: &Area) -> bool {
    (0..2).all(|i| a.corner[i] < b.corner[i] + b.size[i] && b.corner[i] < a.corner[i] + a.size[i])
}

#[cfg(test)]
mod tests {
    use super::*;

    const ALL: [Corner; 4] = [Corner::TopRight, Corner::BottomRight, Corner::TopLeft, Corner::BottomLeft];

    /// 200 x 100 pixels with the model where `covered` says.
    fn model(covered: impl Fn(u32, u32) -> bool) -> Covered {
        let pixels = (0..100).flat_map(|y| (0..200).map(move |x| (x, y)));
        let opacity = |(x, y)| [0, 0, 0, u8::from(covered(x, y))];
        Covered::of(&Picture { width: 200, height: 100, rgba: pixels.flat_map(opacity).collect() })
    }

    #[test]
    fn things_stand_in_the_first_corner_that_is_free_of_the_model() {
        let in_page = |model: &Covered, size| Page::new([200, 100], model, 0.0).place(&[size], 10.0, &ALL).1;
        let size = [50.0, 30.0];
        assert_eq!(in_page(&model(|_, _| false), size), [140.0, 10.0]);
        assert_eq!(in_page(&model(|x, y| x > 120 && y < 30), size), [140.0, 60.0]);
        assert_eq!(in_page(&model(|x, _| x > 120), size), [10.0, 10.0]);
        // Nowhere free: where it hides least.
        assert_eq!(in_page(&model(|x, y| x > 30 || y < 80), size), [10.0, 60.0]);
        // Larger than the picture: harmless.
        assert!(in_page(&model(|_, _| true), [500.0, 300.0]).iter().all(|v| v.is_finite()));
    }

    #[test]
    fn a_wide_shape_is_taken_where_a_tall_one_would_hide_the_model() {
        let band = model(|_, y| (45..75).contains(&y));
        let mut page = Page::new([200, 100], &band, 0.0);
        let sizes = [[30.0, 60.0], [60.0, 30.0], [120.0, 15.0]];
        let (stand, at) = page.place(&sizes, 10.0, &ALL);
        assert_eq!((stand.size, at), (1, [130.0, 10.0]));
        // Farther away from the model only the lowest has room; in the next picture it stands there whatever is below.
        let mut page = Page::new([200, 100], &band, 8.0);
        let (stand, at) = page.place(&sizes, 10.0, &ALL);
        assert_eq!((stand.size, at), (2, [70.0, 10.0]));
        let all = model(|_, _| true);
        assert_eq!(Page::new([200, 100], &all, 8.0).place_again(&stand, &sizes, 10.0), [70.0, 10.0]);
    }

    #[test]
    fn things_stand_beside_each_other_where_above_is_the_model() {
        let upper = model(|_, y| y < 60);
        let mut page = Page::new([200, 100], &upper, 2.0);
        page.take(Area { corner: [10.0, 80.0], size: [40.0, 20.0] });
        assert_eq!(page.place(&[[80.0, 25.0]], 10.0, &[Corner::BottomLeft]).1, [60.0, 65.0]);
        // No room beside those: above, over the model.
        assert_eq!(page.place(&[[80.0, 25.0]], 10.0, &[Corner::BottomLeft]).1[0], 10.0);
    }

    #[test]
    fn things_in_one_corner_stand_above_each_other() {
        let right = model(|x, _| x > 100);
        let mut page = Page::new([200, 100], &right, 0.0);
        page.take(Area { corner: [0.0, 0.0], size: [60.0, 12.0] });
        let size = [[40.0, 20.0]];
        assert_eq!(page.place(&size, 10.0, &ALL).1, [10.0, 12.0]);
        assert_eq!(page.place(&size, 10.0, &[Corner::TopLeft]).1, [10.0, 32.0]);
        assert_eq!(page.place(&size, 10.0, &[Corner::BottomLeft]).1, [10.0, 70.0]);
    }
}
