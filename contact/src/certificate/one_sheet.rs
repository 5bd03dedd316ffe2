//! Where one contact is all there is.
//!
//! A ball that touches a surface in `p` with the normal `n` can be held higher by nothing that stays below the tangent
//! plane there, raised by `t² / 2R` at a distance `t` ([`SupportBound`](crate::certificate::support_bound::SupportBound)). Over a whole triangle `p` is in
//! a known box and `n` in a known cone, so most of the model is out for all of its contacts at once. What is left must
//! be the sheet itself: triangles curved less tightly than the ball (docs/theory.md §6.4) that hang together, over joints
//! without a step and without a valley. Then every contact inside of the triangle is where the ball comes to rest.

use std::ops::ControlFlow;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicU8, Ordering};

use claymill_nurbs::{BRANCHES, BoxTree, Boxes, Point3, Vector3};
use pulp::{Arch, Simd, WithSimd};

use crate::certificate::adjacency::{Adjacency, Beyond};
use crate::certificate::joint::{Joint, is_across};
use crate::certificate::support_bound::{Hulls, larger};
use crate::drop::{BallDrop, Triangle};

/// A triangle with what normals on it may differ by, and all contacts inside.
struct Member<'a> {
    triangle: u32,
    of: (&'a Triangle, f64),
    contacts: Contacts,
}

/// What something is to a sheet.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Of {
    Sheet,
    /// Where it is not smooth, or lies above itself.
    Broken,
    Neither,
}

/// What could hold a ball up over a group of triangles, at most.
const MOST: usize = 512;
/// Triangles that are looked at together, and the parts that they fall into if their normals spread too far.
const GROUP: usize = 16;
const PARTS: usize = 4;
/// Contacts lean no further than this from the vertical (cosine, 84°).
const STEEPEST_NZ: f64 = 0.1;
/// Triangles of a sheet are inclined to each other by no more than this (cosine, 60°).
const INCLINED_COSINE: f64 = 0.5;
/// Heights on both sides of a joint differ by no more than this, mm.
const UNEVEN_MM: f64 = 0.02;

/// A body that stands on the plane no more steeply than this, or less than this more steeply than surfaces may rise, is
/// not looked at.
const LEAST_SINE: f64 = 1e-3;
const LEAST_APART: f64 = 0.02;

/// A place that is free.
const NOWHERE: u16 = u16::MAX;

const UNKNOWN: u8 = 0;
pub(crate) const SHARED: u8 = 1;
const ALONE: u8 = 2;

/// What is known about triangles and the sides on which faces end. It is found when somebody asks for it, and is the
/// same whoever does.
#[derive(Debug)]
pub(crate) struct Certificates {
    pub(crate) triangles: Vec<AtomicU8>,
    joints: Vec<OnceLock<Joint>>,
    /// Per triangle: its group in the tree.
    groups: Vec<u32>,
}

impl Certificates {
    pub(crate) fn new(adjacency: &Adjacency, tree: &BoxTree) -> Self {
        let (triangles, rims) = (adjacency.triangles(), adjacency.rims());
        let mut groups = vec![0; triangles];
        for (group, items) in tree.groups(GROUP).enumerate() {
            for &item in items {
                if let Some(of) = groups.get_mut(item as usize) {
                    *of = group as u32;
                }
            }
        }
        Certificates {
            triangles: (0..triangles).map(|_| AtomicU8::new(UNKNOWN)).collect(),
            joints: (0..rims).map(|_| OnceLock::new()).collect(),
            groups,
        }
    }
}

/// All contacts inside of triangles.
#[derive(Debug, Clone, Copy)]
struct Contacts {
    low: Point3,
    high: Point3,
    /// Where the ball's centres are, in x and y.
    over: [[f64; 2]; 2],
    axis: Vector3,
    /// Normals differ from the axis by no more than this.
    lean: f64,
    /// `1 / (1 − lean)`.
    steepened: f64,
    /// Along the axis all contacts are above this.
    level: f64,
    diameter_mm: f64,
    /// Uphill the ball's lower side ends so far along the tangent plane; from there on the body stands as `t·slope − drop`.
    end_mm: f64,
    drop_mm: f64,
    /// `1 / (slope − lean)`, the latter steepened.
    apart: f64,
}

/// The side that faces the tool.
pub(crate) fn upward(n: Vector3) -> Vector3 {
    if n.z < 0.0 { -n } else { n }
}

fn upright(t: &Triangle) -> Option<Vector3> {
    (t.p[1] - t.p[0]).cross(&(t.p[2] - t.p[0])).try_normalize(0.0).map(upward)
}

/// By how much normals on a triangle may differ from its own, where the surface is curved by no more than `curvature`.
fn lean(t: &Triangle, curvature: f64) -> f64 {
    let sides = [t.p[1] - t.p[0], t.p[2] - t.p[1], t.p[0] - t.p[2]];
    let [a, b, c] = sides.map(|s| s.norm());
    let circumradius = a * b * c / (2.0 * sides[0].cross(&sides[1]).norm());
    // A surface turns away from the plane through three of its points no faster.
    let lean = curvature * a.max(b).max(c).max(circumradius);
    if lean.is_nan() { f64::INFINITY } else { lean }
}

impl Contacts {
    /// `None` where they are steep.
    fn of(triangles: &[(&Triangle, f64)], radius_mm: f64) -> Option<Self> {
        let axes: Vec<Vector3> = triangles.iter().map(|(t, _)| upright(t)).collect::<Option<_>>()?;
        let axis = axes.iter().sum::<Vector3>().try_normalize(0.0)?;
        let leans = triangles.iter().zip(&axes).map(|((_, lean), n)| lean + (n - axis).norm());
        let lean = leans.fold(0.0, f64::max);
        let steepest = axis.z - lean;
        if steepest < STEEPEST_NZ || lean >= 1.0 {
            return None;
        }
        let (mut low, mut high) = (Point3::from([f64::INFINITY; 3]), Point3::from([f64::NEG_INFINITY; 3]));
        let mut level = f64::INFINITY;
        for (t, _) in triangles {
            let delta = f64::from(t.deviation_mm);
            for p in &t.p {
                (low, high) = (low.inf(&p.map(|x| x - delta)), high.sup(&p.map(|x| x + delta)));
                level = level.min(axis.dot(&p.coords) - delta);
            }
        }
        let over = [0, 1].map(|k| {
            let [near, far] = [axis[k] - lean, axis[k] + lean];
            [low[k] + radius_mm * near, high[k] + radius_mm * far]
        });
        let steepened = 1.0 / (1.0 - lean);
        let sine = (1.0 - steepest * steepest).max(0.0).sqrt();
        let slope = steepest / sine.max(LEAST_SINE);
        let apart = slope - lean * steepened;
        if apart < LEAST_APART {
            return None;
        }
        let (diameter_mm, end_mm) = (2.0 * radius_mm, radius_mm * steepest);
        let (drop_mm, apart) = (end_mm * slope - radius_mm * (1.0 - sine), 1.0 / apart);
        Some(Contacts { low, high, over, axis, lean, steepened, level, diameter_mm, end_mm, drop_mm, apart })
    }

    /// Whether what lies between `low` and `high` and rises to `top` along the axis cannot hold the ball up.
    ///
    /// At a distance `t` along a tangent plane it is no higher above that than `(rise + lean·t) / (1 − lean)`. The body of
    /// the ball and all above it is higher than `t² / 2R` there and, where it is no longer the ball, than a straight line:
    /// both are above the former from some distance on.
    #[inline(always)]
    fn clears(&self, top: f64, low: [f64; 3], high: [f64; 3]) -> bool {
        let (mut near, mut beside) = (0.0, 0.0);
        for k in 0..3 {
            let gap = larger(larger(low[k] - self.high[k], self.low[k] - high[k]), 0.0);
            near += gap * gap;
            if k < 2 {
                let gap = larger(larger(low[k] - self.over[k][1], self.over[k][0] - high[k]), 0.0);
                beside += gap * gap;
            }
        }
        let rise = (top - self.level) * self.steepened;
        let lean = self.lean * self.steepened;
        let half = 0.5 * self.diameter_mm * lean;
        let square = half * half + self.diameter_mm * rise;
        let by_ball = half + larger(square, 0.0).sqrt();
        let by_ball = if by_ball < self.end_mm { by_ball } else { self.end_mm };
        let by_body = (rise + self.drop_mm) * self.apart;
        let t = if by_body > self.end_mm { by_body } else { by_ball };
        let is_below = (square < 0.0) & (by_body <= self.end_mm);
        // It is no nearer along the plane than in space, but for its height.
        let is_far = near.sqrt() >= t + larger(rise + lean * t, 0.0);
        let is_out = 4.0 * beside >= self.diameter_mm * self.diameter_mm;
        is_out | is_below | is_far
    }
}

/// Which of eight boxes have in them what could hold a ball up that touches in `Contacts`.
struct InBoxes<'a>(&'a Contacts, &'a Boxes);

impl WithSimd for InBoxes<'_> {
    type Output = [bool; BRANCHES];

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> [bool; BRANCHES] {
        let InBoxes(contacts, Boxes { min, max }) = self;
        let n = &contacts.axis;
        let highest = [0, 1, 2].map(|axis| if n[axis] > 0.0 { &max[axis] } else { &min[axis] });
        let mut reached = [true; BRANCHES];
        for k in 0..BRANCHES {
            let low = [f64::from(min[0][k]), f64::from(min[1][k]), f64::from(min[2][k])];
            let high = [f64::from(max[0][k]), f64::from(max[1][k]), f64::from(max[2][k])];
            let top = n.x * f64::from(highest[0][k])
                + n.y * f64::from(highest[1][k])
                + n.z * f64::from(highest[2][k]);
            reached[k] = !contacts.clears(top, low, high);
        }
        reached
    }
}

/// The same of eight triangles or pieces of edges.
struct AmongHulls<'a>(&'a Contacts, &'a Hulls);

impl WithSimd for AmongHulls<'_> {
    type Output = [bool; 8];

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> [bool; 8] {
        let AmongHulls(contacts, hulls) = self;
        let mut reached = [true; 8];
        for k in 0..8 {
            let low = [hulls.low[0][k], hulls.low[1][k], hulls.low[2][k]];
            let high = [hulls.high[0][k], hulls.high[1][k], hulls.high[2][k]];
            reached[k] = !contacts.clears(hulls.top(&contacts.axis, k), low, high);
        }
        reached
    }
}

/// What could hold a ball up over a group of triangles.
struct Around {
    items: Vec<u32>,
    /// Where they are in `items`: a table with open addresses, a power of two long, half full at most.
    places: Vec<u16>,
    hulls: Vec<Hulls>,
}

impl Around {
    /// Which ones could if the ball touches in these places.
    fn reaching(&self, contacts: &Contacts) -> Vec<bool> {
        let arch = Arch::new();
        let eights = self.hulls.iter().flat_map(|hulls| arch.dispatch(AmongHulls(contacts, hulls)));
        eights.take(self.items.len()).collect()
    }

    /// Whether one of the items could, `among` these.
    fn any_reaches(&self, among: &[bool], contacts: &Contacts) -> bool {
        let arch = Arch::new();
        self.hulls.iter().zip(among.chunks(8)).any(|(hulls, among)| {
            among.contains(&true)
                && arch.dispatch(AmongHulls(contacts, hulls)).iter().zip(among).any(|(r, a)| *r && *a)
        })
    }

    /// Where an item is among them.
    #[inline]
    fn position(&self, item: u32) -> Option<usize> {
        let mut slot = self.slot(item);
        loop {
            match self.places[slot] {
                NOWHERE => return None,
                at if self.items[at as usize] == item => return Some(at as usize),
                _ => slot = (slot + 1) % self.places.len(),
            }
        }
    }

    /// Where an item's place is looked for first (Fibonacci hashing).
    #[inline]
    fn slot(&self, item: u32) -> usize {
        (item.wrapping_mul(0x9E37_79B9) >> 16) as usize % self.places.len()
    }
}

impl BallDrop<'_> {
    /// Whether a ball that touches the inside of this triangle's surface rests there.
    pub(crate) fn is_alone(&self, triangle: u32) -> bool {
        let known = &self.certificates.triangles[triangle as usize];
        if known.load(Ordering::Relaxed) == UNKNOWN {
            self.look_around(self.certificates.groups[triangle as usize]);
        }
        known.load(Ordering::Relaxed) == ALONE
    }

    /// What goes on from a side of a triangle, if its face ends there.
    pub(crate) fn joint(&self, triangle: u32, side: usize) -> Option<&Joint> {
        match self.covering.adjacency.beyond(triangle)[side] {
            Beyond::Triangle(_) => None,
            Beyond::Rim(rim) => Some(self.joint_on(rim, triangle, side)),
        }
    }

    fn joint_on(&self, rim: u32, triangle: u32, side: usize) -> &Joint {
        self.certificates.joints[rim as usize].get_or_init(|| self.look_beyond(triangle, side))
    }

    /// Finds out about a group of triangles.
    fn look_around(&self, group: u32) {
        let mut smooth = Vec::with_capacity(GROUP);
        for &item in self.tree.0.group(group as usize, GROUP) {
            let Some(t) = self.triangles.get(item as usize) else { continue };
            let [low, high] = self.covering.curvature[t.face as usize][t.index as usize].map(f64::from);
            let of = (t, lean(t, low.abs().max(high.abs())));
            match Contacts::of(&[of], self.radius_mm()).filter(|_| !t.tight) {
                Some(contacts) => smooth.push(Member { triangle: item, of, contacts }),
                None => self.settle(item, false),
            }
        }
        self.examine(&smooth);
    }

    /// Finds out about triangles that lie close together; about parts of them if their normals spread too far.
    fn examine(&self, members: &[Member]) {
        let all: Vec<(&Triangle, f64)> = members.iter().map(|m| m.of).collect();
        let Some(contacts) = Contacts::of(&all, self.radius_mm()) else {
            if members.len() > 1 {
                members.chunks(members.len().div_ceil(PARTS)).for_each(|part| self.examine(part));
            }
            return;
        };
        let Some(around) = self.around(&contacts) else {
            members.iter().for_each(|member| self.settle(member.triangle, false));
            return;
        };
        let near = around.reaching(&contacts);
        let mut open: Vec<&Member> = members.iter().collect();
        while let Some(Member { triangle: first, .. }) = open.last().copied() {
            let sheet = self.sheet(*first, &contacts.axis, &around, &near);
            let is_other: Vec<bool> =
                near.iter().zip(&sheet).map(|(near, of)| *near && *of != Of::Sheet).collect();
            open.retain(|member| {
                let of = around.position(member.triangle).map_or(Of::Neither, |at| sheet[at]);
                let is_first = member.triangle == *first;
                if of != Of::Neither || is_first {
                    let alone = of == Of::Sheet && !around.any_reaches(&is_other, &member.contacts);
                    self.settle(member.triangle, alone);
                }
                of == Of::Neither && !is_first
            });
        }
    }

    fn settle(&self, triangle: u32, alone: bool) {
        let answer = if alone { ALONE } else { SHARED };
        self.certificates.triangles[triangle as usize].store(answer, Ordering::Relaxed);
    }

    /// All that could hold a ball up that touches in these places; `None` if it is too much.
    fn around(&self, contacts: &Contacts) -> Option<Around> {
        let arch = Arch::new();
        let mut around = Around { items: Vec::with_capacity(128), places: Vec::new(), hulls: Vec::new() };
        let items = &mut around.items;
        self.tree.0.visit(
            |boxes| arch.dispatch(InBoxes(contacts, boxes)),
            |item| {
                items.push(item as u32);
                if items.len() > MOST { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
            },
        );
        if items.len() > MOST {
            return None;
        }
        around.places = vec![NOWHERE; (2 * items.len().max(1)).next_power_of_two()];
        for at in 0..around.items.len() {
            let mut slot = around.slot(around.items[at]);
            while around.places[slot] != NOWHERE {
                slot = (slot + 1) % around.places.len();
            }
            around.places[slot] = at as u16;
        }
        around.hulls.reserve_exact(around.items.len().div_ceil(8));
        for eight in around.items.chunks(8) {
            let mut hulls = Hulls::NONE;
            for (k, &item) in eight.iter().enumerate() {
                let (points, delta) = self.hull(item as usize);
                hulls.put(k, points, delta);
            }
            around.hulls.push(hulls);
        }
        Some(around)
    }

    /// What belongs to the smooth sheet around a triangle, of what is `near`; with its edges.
    fn sheet(&self, triangle: u32, axis: &Vector3, around: &Around, near: &[bool]) -> Vec<Of> {
        let mut found = vec![Of::Neither; near.len()];
        let (mut linked, mut faces) = (Vec::with_capacity(near.len()), Vec::new());
        let mut steepest = 1.0f64;
        let mut link = |found: &mut [Of], linked: &mut Vec<usize>, item: u32| {
            let Some(at) = around.position(item).filter(|&at| near[at]) else { return false };
            if found[at] == Of::Neither {
                let t = &self.triangles[item as usize];
                let cosine = upright(t).map_or(0.0, |n| n.dot(axis));
                if !t.tight && cosine >= INCLINED_COSINE {
                    steepest = steepest.min(cosine);
                    found[at] = Of::Sheet;
                    linked.push(at);
                }
            }
            true
        };
        link(&mut found, &mut linked, triangle);
        let (mut next, mut open) = (0, Vec::new());
        while let Some(&from) = linked.get(next) {
            next += 1;
            let item = around.items[from];
            for (side, beyond) in self.covering.adjacency.beyond(item).into_iter().enumerate() {
                let joint = match beyond {
                    Beyond::Triangle(other) => {
                        link(&mut found, &mut linked, other);
                        continue;
                    }
                    Beyond::Rim(rim) => self.joint_on(rim, item, side),
                };
                if joint.is_open {
                    open.push((from, side));
                }
                if !joint.is_sound {
                    found[from] = Of::Broken;
                    continue;
                }
                for &(through, _) in &joint.onward {
                    if !link(&mut found, &mut linked, through) {
                        for beyond in self.covering.adjacency.beyond(through) {
                            if let Beyond::Triangle(other) = beyond {
                                link(&mut found, &mut linked, other);
                            }
                        }
                    }
                }
            }
        }
        // Across a crack that closes elsewhere the sheet hangs together, but is no smooth one.
        for (from, side) in open {
            let t = &self.triangles[around.items[from] as usize];
            for &at in &linked {
                let other = &self.triangles[around.items[at] as usize];
                if other.face != t.face && is_across(t, side, other, 2.0 * self.radius_mm()) {
                    (found[from], found[at]) = (Of::Broken, Of::Broken);
                }
            }
        }
        // What lies above or below itself is no single sheet: it would rise more steeply from here than its triangles do.
        let slope = (1.0 - steepest * steepest).max(0.0).sqrt() / steepest;
        let here = self.triangles[triangle as usize].p[0];
        let is_folded = |p: &Point3| {
            let height = (p - here).dot(axis);
            let along = ((p - here).norm_squared() - height * height).max(0.0).sqrt();
            height.abs() > slope * along + UNEVEN_MM
        };
        for at in linked {
            let t = &self.triangles[around.items[at] as usize];
            if t.p.iter().any(is_folded) {
                found[at] = Of::Broken;
            }
            if !faces.contains(&t.face) {
                faces.push(t.face);
            }
        }
        // An edge is part of its face's sheet.
        for (at, item) in around.items.iter().enumerate() {
            if let Some(edge) = (*item as usize).checked_sub(self.triangles.len())
                && faces.contains(&self.edges[edge].face)
            {
                found[at] = Of::Sheet;
            }
        }
        found
    }

    /// Whether two triangles of one face have a corner in common.
    pub(crate) fn touch_each_other(&self, a: u32, b: u32) -> bool {
        let [a, b] = [a, b].map(|k| &self.triangles[k as usize]);
        let corners = |t: &Triangle| self.covering.meshes[t.face as usize].triangles[t.index as usize];
        a.face == b.face && corners(a).iter().any(|i| corners(b).contains(i))
    }
}
