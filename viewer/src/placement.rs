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
}

impl<'a> Page<'a> {
    pub(crate) fn new(size: [u32; 2], model: &'a Covered) -> Self {
        Page { size: size.map(|s| s as f32), model, taken: Vec::new() }
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

    /// Chooses one of several sizes and a corner: the first size that hides nothing of the model in some
    /// corner, else what hides least. Returns which size, and the top left of its place.
    pub(crate) fn place(&mut self, sizes: &[[f32; 2]], border: f32, corners: &[Corner]) -> (usize, [f32; 2]) {
        let Some((i, area)) = self.best(sizes, border, corners) else {
            return (0, [border; 2]);
        };
        self.take(area);
        (i, area.corner)
    }

    /// Whether one of several sizes hides nothing of the model in some corner.
    pub(crate) fn has_room(&self, sizes: &[[f32; 2]], border: f32, corners: &[Corner]) -> bool {
        self.best(sizes, border, corners).is_some_and(|(_, area)| self.model.count(&area) == 0)
    }

    fn best(&self, sizes: &[[f32; 2]], border: f32, corners: &[Corner]) -> Option<(usize, Area)> {
        let each = sizes.iter().enumerate().flat_map(|(i, &size)| corners.iter().map(move |&c| (i, size, c)));
        let places = each.map(|(i, size, corner)| (i, self.in_corner(size, border, corner)));
        // The first of equal ones.
        places.min_by_key(|(_, area)| self.model.count(area))
    }

    fn in_corner(&self, size: [f32; 2], border: f32, corner: Corner) -> Area {
        let left = matches!(corner, Corner::TopLeft | Corner::BottomLeft);
        let top = matches!(corner, Corner::TopLeft | Corner::TopRight);
        let x = if left { border } else { self.size[0] - border - size[0] };
        let y = if top { border } else { self.size[1] - border - size[1] };
        let mut area = Area { corner: [x, y], size };
        // Each look passes at least one of what is taken, so that this many are enough.
        for _ in 0..self.taken.len() {
            let Some(other) = self.taken.iter().find(|t| overlap(t, &area)) else {
                break;
            };
            area.corner[1] = if top { other.corner[1] + other.size[1] } else { other.corner[1] - size[1] };
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
        let in_page = |model: &Covered, size| Page::new([200, 100], model).place(&[size], 10.0, &ALL).1;
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
        let mut page = Page::new([200, 100], &band);
        let sizes = [[30.0, 60.0], [60.0, 30.0], [120.0, 15.0]];
        assert_eq!(page.place(&sizes, 10.0, &ALL), (1, [130.0, 10.0]));
    }

    #[test]
    fn things_in_one_corner_stand_above_each_other() {
        let right = model(|x, _| x > 100);
        let mut page = Page::new([200, 100], &right);
        page.take(Area { corner: [0.0, 0.0], size: [60.0, 12.0] });
        let size = [[40.0, 20.0]];
        assert_eq!(page.place(&size, 10.0, &ALL).1, [10.0, 12.0]);
        assert_eq!(page.place(&size, 10.0, &[Corner::TopLeft]).1, [10.0, 32.0]);
        assert_eq!(page.place(&size, 10.0, &[Corner::BottomLeft]).1, [10.0, 70.0]);
    }
}
