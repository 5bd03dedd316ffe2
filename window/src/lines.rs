//! Many lines, sorted so that a picture needs only some of them.
//!
//! ```text
//!   strokes in order ─► thinning, coarse to fine ─► level of every segment ─► vertices by level, then in order
//!                                                                                └► chunks with boxes
//!   a picture:  levels as coarse as its scale ∩ chunks in sight ∩ strokes up to now ─► ranges to draw or to pick from
//! ```

use std::collections::HashMap;
use std::ops::Range;

use claymill_nurbs::{Aabb, Point3};
use claymill_viewer::Cells;

/// A polyline that belongs to something: a move, a joint.
#[derive(Debug, Clone)]
pub(crate) struct Stroke {
    /// What it belongs to; strokes come in the order of their tags.
    pub(crate) tag: u32,
    /// Strokes in a row with the same number do not keep each other away.
    pub(crate) group: u32,
    /// Whether it may be left out where strokes crowd.
    pub(crate) thinned: bool,
    /// Points relative to the origin of the picture, mm.
    pub(crate) points: Vec<[f32; 3]>,
}

/// A vertex as the graphics card reads it; with its successor it is a segment.
#[derive(Debug, Clone, Copy, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(crate) struct LineVertex {
    pub(crate) at: [f32; 3],
    /// The tag, and [`BREAK`] where no segment begins.
    pub(crate) tag: u32,
}

/// Marks the last vertex of a run.
pub(crate) const BREAK: u32 = 1 << 31;
/// Vertices with one box.
const CHUNK: usize = 4096;
/// Each level keeps lines twice as far apart as the next one.
const LEVELS: i32 = 6;
/// Segments are cut to this multiple of the finest spacing, so that parts of them can be left out.
const LONGEST: f32 = 8.0;

/// Vertices that lie together.
#[derive(Debug, Clone)]
pub(crate) struct Chunk {
    /// Its vertices.
    pub(crate) vertices: Range<usize>,
    /// Lines of this level are this far apart, mm; 0: all.
    pub(crate) spacing_mm: f32,
    /// Around them, relative to the origin of the picture.
    pub(crate) bounds: Aabb,
}

/// Lines of one kind of thing, ready to be drawn and picked.
#[derive(Debug, Clone, Default)]
pub(crate) struct Lines {
    pub(crate) vertices: Vec<LineVertex>,
    /// Where on the drawn length of its tag a vertex is, 0 to 1.
    pub(crate) share: Vec<f32>,
    pub(crate) chunks: Vec<Chunk>,
}

impl Lines {
    /// Sorts `strokes`. `closest_mm`: usual distance of neighbours that may be thinned out; 0 keeps all.
    pub(crate) fn new(strokes: &[Stroke], closest_mm: f32) -> Self {
        let finest_mm = 2.0 * closest_mm;
        let longest_mm = if finest_mm > 0.0 { LONGEST * finest_mm } else { f32::INFINITY };
        let cut: Vec<Vec<[f32; 3]>> = strokes.iter().map(|s| divided(&s.points, longest_mm)).collect();
        let spacings: Vec<f32> = match finest_mm > 0.0 {
            true => (0..LEVELS).rev().map(|k| finest_mm * 2.0_f32.powi(k)).collect(),
            false => vec![],
        };
        // By segment: the coarsest level that has it, as an index into `spacings` and then all.
        let mut levels: Vec<Vec<u8>> = cut.iter().map(|c| vec![u8::MAX; c.len().saturating_sub(1)]).collect();
        for (s, of_stroke) in strokes.iter().zip(&mut levels) {
            if !s.thinned || spacings.is_empty() {
                of_stroke.fill(0);
            }
        }
        for (level, &spacing_mm) in spacings.iter().enumerate() {
            thin(strokes, &cut, &mut levels, level as u8, spacing_mm);
        }
        let mut lines = Lines::default();
        let lengths = tag_lengths(strokes, &cut);
        for level in 0..=spacings.len() as u8 {
            let spacing_mm = spacings.get(usize::from(level)).copied().unwrap_or(0.0);
            let wanted = |l: u8| l.min(spacings.len() as u8) == level;
            lines.add_level(strokes, &cut, &levels, &lengths, wanted, spacing_mm);
        }
        lines
    }

    fn add_level(
        &mut self,
        strokes: &[Stroke],
        cut: &[Vec<[f32; 3]>],
        levels: &[Vec<u8>],
        lengths: &HashMap<u32, f64>,
        wanted: impl Fn(u8) -> bool,
        spacing_mm: f32,
    ) {
        let mut first = self.vertices.len();
        let (mut tag, mut gone_mm) = (u32::MAX, 0.0);
        for ((stroke, points), levels) in strokes.iter().zip(cut).zip(levels) {
            if stroke.tag != tag {
                (tag, gone_mm) = (stroke.tag, 0.0);
            }
            let whole_mm = lengths.get(&tag).copied().unwrap_or(0.0).max(1e-9);
            for (i, ab) in points.windows(2).enumerate() {
                let next_mm = gone_mm + f64::from(distance2(&ab[0], &ab[1]).sqrt());
                if wanted(levels[i]) {
                    if i == 0 || !wanted(levels[i - 1]) {
                        self.vertices.push(LineVertex { at: ab[0], tag });
                        self.share.push((gone_mm / whole_mm) as f32);
                    }
                    let ends = levels.get(i + 1).is_none_or(|l| !wanted(*l));
                    self.vertices.push(LineVertex { at: ab[1], tag: if ends { tag | BREAK } else { tag } });
                    self.share.push((next_mm / whole_mm) as f32);
                }
                gone_mm = next_mm;
            }
            let full = self.vertices.len() - first >= CHUNK;
            if full {
                self.close_chunk(first, spacing_mm);
                first = self.vertices.len();
            }
        }
        self.close_chunk(first, spacing_mm);
    }

    fn close_chunk(&mut self, first: usize, spacing_mm: f32) {
        if first < self.vertices.len() {
            let points: Vec<Point3> =
                self.vertices[first..].iter().map(|v| Point3::from(v.at.map(f64::from))).collect();
            let bounds = Aabb::of(&points);
            self.chunks.push(Chunk { vertices: first..self.vertices.len(), spacing_mm, bounds });
        }
    }

    /// What a picture shows that keeps lines at least `spacing_mm` apart: the chunks that `in_sight` lets through,
    /// up to the tag and the share of it that were reached.
    pub(crate) fn visible<'a>(
        &'a self,
        spacing_mm: f32,
        until: (u32, f32),
        in_sight: impl Fn(&Aabb) -> bool + 'a,
    ) -> impl Iterator<Item = Range<usize>> + 'a {
        let coarsest = self.chunks.first().map_or(0.0, |c| c.spacing_mm);
        let shown =
            move |c: &&Chunk| (c.spacing_mm >= spacing_mm || c.spacing_mm >= coarsest) && in_sight(&c.bounds);
        self.chunks.iter().filter(shown).filter_map(move |c| {
            let reached = |i: &usize| {
                let (tag, share) = (self.vertices[*i].tag & !BREAK, self.share[*i]);
                tag < until.0 || tag == until.0 && share <= until.1
            };
            let (mut low, mut high) = (c.vertices.start, c.vertices.end);
            while low < high {
                let middle = low + (high - low) / 2;
                if reached(&middle) { low = middle + 1 } else { high = middle }
            }
            (low > c.vertices.start + 1).then_some(c.vertices.start..low)
        })
    }

    /// The points of a tag in order, as runs; of a large one only what is drawn coarsest to finest, unsorted.
    pub(crate) fn of_tag(&self, tag: u32) -> Vec<[[f32; 3]; 2]> {
        let mut found = Vec::new();
        for c in &self.chunks {
            let vertices = &self.vertices[c.vertices.clone()];
            let first = vertices.partition_point(|v| v.tag & !BREAK < tag);
            let of_tag = vertices[first..].iter().take_while(|v| v.tag & !BREAK == tag);
            for (v, next) in of_tag.zip(&vertices[(first + 1).min(vertices.len())..]) {
                if v.tag & BREAK == 0 {
                    found.push([v.at, next.at]);
                }
            }
        }
        found
    }
}

/// The same polyline with no segment longer than `longest_mm`.
fn divided(points: &[[f32; 3]], longest_mm: f32) -> Vec<[f32; 3]> {
    let mut all = Vec::with_capacity(points.len());
    all.extend(points.first());
    for ab in points.windows(2) {
        let pieces = (distance2(&ab[0], &ab[1]).sqrt() / longest_mm).ceil().clamp(1.0, 1e4) as u32;
        all.extend((1..pieces).map(|i| between(&ab[0], &ab[1], i as f32 / pieces as f32)));
        all.push(ab[1]);
    }
    all
}

fn tag_lengths(strokes: &[Stroke], cut: &[Vec<[f32; 3]>]) -> HashMap<u32, f64> {
    let mut lengths = HashMap::new();
    for (s, points) in strokes.iter().zip(cut) {
        let mm: f64 = points.windows(2).map(|ab| f64::from(distance2(&ab[0], &ab[1]).sqrt())).sum();
        *lengths.entry(s.tag).or_default() += mm;
    }
    lengths
}

/// How near a segment is to what is drawn already.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Room {
    None,
    ToGoOn,
    ToBegin,
}

/// Gives `level` to segments that still have room among those of coarser levels: a run needs `spacing_mm` somewhere to
/// begin with and half of it to go on (the ratio of Jobard and Lefer, *Creating Evenly-Spaced Streamlines of Arbitrary
/// Density*, 1997). Neighbouring passes follow each other, so that every n-th is taken.
fn thin(strokes: &[Stroke], cut: &[Vec<[f32; 3]>], levels: &mut [Vec<u8>], level: u8, spacing_mm: f32) {
    let mut drawn = Drawn::new(spacing_mm);
    for ((stroke, points), levels) in strokes.iter().zip(cut).zip(levels.iter()) {
        if stroke.thinned {
            drawn.add(points, |i| levels[i] < level);
        }
    }
    let order: Vec<usize> = (0..strokes.len()).filter(|&s| strokes[s].thinned).collect();
    for group in order.chunk_by(|&a, &b| strokes[a].group == strokes[b].group) {
        let mut taken: Vec<(usize, Range<usize>)> = Vec::new();
        for &s in group {
            let rooms = drawn.rooms(&cut[s], |i| levels[s][i] < level);
            let mut first = 0;
            for i in 0..rooms.len() {
                if rooms[i] == Room::None {
                    first = i + 1;
                } else if rooms.get(i + 1).is_none_or(|r| *r == Room::None) {
                    if rooms[first..=i].contains(&Room::ToBegin) {
                        taken.push((s, first..i + 1));
                    }
                    first = i + 1;
                }
            }
        }
        for (s, run) in taken {
            levels[s][run.clone()].fill(level);
            drawn.add(&cut[s], |i| run.contains(&i));
        }
    }
}

/// Places on drawn segments, to be found by place.
struct Drawn {
    spacing_mm: f32,
    /// Twice the spacing wide, so that what is near a place is in eight of them.
    cells: Cells<Vec<[f32; 3]>>,
}

/// Stations along a line, as a part of the spacing: what lies between two is taken for the first.
const STATION: f32 = 0.4;

impl Drawn {
    fn new(spacing_mm: f32) -> Self {
        Drawn { spacing_mm, cells: Cells::default() }
    }

    /// Enters those segments of a polyline that `chosen` says.
    fn add(&mut self, points: &[[f32; 3]], chosen: impl Fn(usize) -> bool) {
        let step_mm = STATION * self.spacing_mm;
        let mut since_mm = f32::INFINITY;
        for (i, ab) in points.windows(2).enumerate() {
            if !chosen(i) {
                since_mm = f32::INFINITY;
                continue;
            }
            let length_mm = distance2(&ab[0], &ab[1]).sqrt();
            let mut at_mm = (step_mm - since_mm).max(0.0);
            if since_mm == f32::INFINITY {
                at_mm = (0.5 * step_mm).min(0.5 * length_mm);
            }
            while at_mm <= length_mm {
                let p = between(&ab[0], &ab[1], at_mm / length_mm.max(f32::MIN_POSITIVE));
                let cell = p.map(|mm| (mm / (2.0 * self.spacing_mm)).floor() as i32);
                self.cells.entry(cell).or_default().push(p);
                since_mm = -at_mm;
                let next_mm = at_mm + step_mm;
                // So far from the beginning, rounding takes the step away.
                if next_mm <= at_mm {
                    break;
                }
                at_mm = next_mm;
            }
            since_mm += length_mm;
        }
    }

    /// The room of each segment; none for those that `done` says.
    fn rooms(&self, points: &[[f32; 3]], done: impl Fn(usize) -> bool) -> Vec<Room> {
        let mut known: Option<(Room, f32)> = None;
        let room = |(i, ab): (usize, &[[f32; 3]])| {
            if done(i) {
                known = None;
                return Room::None;
            }
            let length_mm = distance2(&ab[0], &ab[1]).sqrt();
            let (room, since_mm) = match known {
                Some((room, since_mm)) if since_mm + length_mm < STATION * self.spacing_mm => {
                    (room, since_mm)
                }
                _ => (self.room(&between(&ab[0], &ab[1], 0.5)), 0.0),
            };
            known = Some((room, since_mm + length_mm));
            room
        };
        points.windows(2).enumerate().map(room).collect()
    }

    fn room(&self, p: &[f32; 3]) -> Room {
        // The cell that the place is in, and the next one on the nearer side, along each axis.
        let low = p.map(|mm| (mm / (2.0 * self.spacing_mm) - 0.5).floor() as i32);
        let (begin2, go_on2) = (self.spacing_mm.powi(2), (0.5 * self.spacing_mm).powi(2));
        let mut nearest2 = f32::INFINITY;
        for d in 0..8 {
            let Some(cell) = self.cells.get(&[low[0] + (d & 1), low[1] + (d >> 1 & 1), low[2] + (d >> 2)])
            else {
                continue;
            };
            for q in cell {
                nearest2 = nearest2.min(distance2(p, q));
            }
            if nearest2 < go_on2 {
                return Room::None;
            }
        }
        if nearest2 < begin2 { Room::ToGoOn } else { Room::ToBegin }
    }
}

fn distance2(a: &[f32; 3], b: &[f32; 3]) -> f32 {
    (0..3).map(|i| (a[i] - b[i]).powi(2)).sum()
}

fn between(a: &[f32; 3], b: &[f32; 3], t: f32) -> [f32; 3] {
    [0, 1, 2].map(|i| a[i] + (b[i] - a[i]) * t)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rows of 100 mm, 1 mm apart.
    fn rows(count: u32) -> Vec<Stroke> {
        let row = |i: u32| Stroke {
            tag: i,
            group: i,
            thinned: true,
            points: vec![[0.0, i as f32, 0.0], [100.0, i as f32, 0.0]],
        };
        (0..count).map(row).collect()
    }

    const ALL: (u32, f32) = (u32::MAX, 1.0);

    fn tags(lines: &Lines, spacing_mm: f32, until: (u32, f32)) -> Vec<u32> {
        let ranges = lines.visible(spacing_mm, until, |_| true);
        let mut tags: Vec<u32> =
            ranges.flat_map(|r| lines.vertices[r].iter().map(|v| v.tag & !BREAK)).collect();
        tags.sort_unstable();
        tags.dedup();
        tags
    }

    #[test]
    fn coarser_levels_are_part_of_finer_ones_and_keep_their_distance() {
        let lines = Lines::new(&rows(200), 1.0);
        assert_eq!(tags(&lines, 0.0, ALL).len(), 200);
        let mut finer = tags(&lines, 0.0, ALL);
        for spacing in [2.0, 4.0, 8.0, 16.0, 32.0, 64.0] {
            let coarse = tags(&lines, spacing, ALL);
            assert!(coarse.iter().all(|t| finer.contains(t)), "{spacing}");
            let gaps: Vec<u32> = coarse.windows(2).map(|ab| ab[1] - ab[0]).collect();
            // Stations are seen at most half a step aside.
            let nearest = spacing * (1.0 - (0.5 * STATION).powi(2)).sqrt();
            assert!(gaps.iter().all(|&g| g as f32 >= nearest), "{spacing}: {gaps:?}");
            assert!(gaps.iter().all(|&g| (g as f32) < 2.5 * spacing), "{spacing}: {gaps:?}");
            finer = coarse;
        }
    }

    #[test]
    fn nothing_is_drawn_twice_and_nothing_is_lost() {
        let lines = Lines::new(&rows(50), 1.0);
        let mut length = 0.0_f64;
        for c in &lines.chunks {
            for ab in lines.vertices[c.vertices.clone()].windows(2).filter(|ab| ab[0].tag & BREAK == 0) {
                length += f64::from(distance2(&ab[0].at, &ab[1].at).sqrt());
            }
        }
        assert!((length - 5000.0).abs() < 1e-3, "{length}");
        assert_eq!(lines.share.len(), lines.vertices.len());
        let of_one: f32 = lines.of_tag(7).iter().map(|[a, b]| distance2(a, b).sqrt()).sum();
        assert!((of_one - 100.0).abs() < 1e-3, "{of_one}");
    }

    #[test]
    fn at_half_time_only_what_is_done_is_visible() {
        let lines = Lines::new(&rows(50), 1.0);
        assert_eq!(tags(&lines, 0.0, (20, 0.5)).last(), Some(&20));
        let far = |r: Range<usize>| {
            let of_last = lines.vertices[r]
                .iter()
                .filter(|v| v.tag & !BREAK == 20)
                .map(|v| v.at[0])
                .collect::<Vec<_>>();
            of_last.into_iter().fold(0.0, f32::max)
        };
        let reached = lines.visible(0.0, (20, 0.5), |_| true).map(far).fold(0.0, f32::max);
        assert!((reached - 50.0).abs() <= 16.0 && reached <= 50.0, "{reached}");
        assert!(lines.visible(0.0, ALL, |_| false).next().is_none());
    }
}
