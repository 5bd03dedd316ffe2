//! Passes as far as the tool may follow them.

use claymill_nurbs::{FaceId, Hint, Point3, bisect};

use crate::containment::{Containment, On};
use crate::curve::drive::DriveCurve;
use crate::follow::profile::{Chain, Profile, Sample, is_long_enough};
use crate::setup::context::SetupContext;

/// Where bounds end a pass is narrowed down to this, mm.
const END_MM: f64 = 1e-3;
/// Closest points are looked for this much farther than the ball is large, mm.
const FARTHER_MM: f64 = 1.0;

impl SetupContext<'_> {
    /// The stretches of passes over a drive curve on which the tool is in its bounds.
    pub(crate) fn kept(&self, passes: Vec<Chain>, drive: &DriveCurve) -> Vec<Chain> {
        match self.containment {
            Some(containment) => {
                let long = |chain: &Chain| is_long_enough(chain, self.shortest_pass_mm());
                self.cut(containment, &passes, drive, On::Pass).into_iter().filter(long).collect()
            }
            None => passes,
        }
    }

    /// The same of links, however short.
    pub(crate) fn kept_of_link(&self, links: Vec<Chain>, drive: &DriveCurve) -> Vec<Chain> {
        match self.containment {
            Some(containment) => self.cut(containment, &links, drive, On::Way),
            None => links,
        }
    }

    fn cut(&self, containment: &Containment, chains: &[Chain], drive: &DriveCurve, on: On) -> Vec<Chain> {
        let (hint, kept, goes_on) = (Hint::default(), Vec::new(), false);
        let mut cutter = Cutter { context: self, containment, drive, on, hint, kept, goes_on };
        for chain in chains {
            cutter.goes_on = false;
            chain.iter().for_each(|profile| cutter.cut(profile));
        }
        cutter.kept
    }

    /// Whether the tool is in its bounds where it touches a face.
    pub(crate) fn may_touch(&self, containment: &Containment, face: FaceId, u: f64, v: f64) -> bool {
        let surface = self.ball.surface(face);
        let Some((n, _)) = surface.normal(u, v) else { return false };
        let normal = self.upper(face, n);
        let contact = surface.point(u, v);
        containment.allows(&(contact + normal * self.ball.radius_mm()), &contact, On::Pass)
    }
}

/// Takes what the tool may not follow out of chains.
struct Cutter<'c, 'a> {
    context: &'c SetupContext<'a>,
    containment: &'c Containment<'a>,
    drive: &'c DriveCurve,
    on: On,
    hint: Hint,
    kept: Vec<Chain>,
    /// Whether the last stretch goes on where the next one begins.
    goes_on: bool,
}

impl Cutter<'_, '_> {
    fn allows(&mut self, at: &Sample) -> bool {
        let [x, y] = self.drive.at(at.s);
        let centre = Point3::new(x, y, at.z);
        let frame = &self.context.frame;
        let within_mm = self.context.ball.radius_mm() + FARTHER_MM;
        let foot =
            self.context.walls.closest.closest_from(&frame.to_model(&centre), within_mm, &mut self.hint);
        foot.is_some_and(|foot| self.containment.allows(&centre, &frame.to_setup(&foot.point), self.on))
    }

    fn cut(&mut self, profile: &Profile) {
        let mut before: Option<(Sample, bool)> = None;
        let mut stretch: Vec<Sample> = Vec::new();
        for &sample in &profile.samples {
            let is_in = self.allows(&sample);
            if let Some((last, was_in)) = before.filter(|(_, was_in)| *was_in != is_in) {
                let border =
                    self.border(profile, if was_in { [last.s, sample.s] } else { [sample.s, last.s] });
                stretch.push(border);
                if was_in {
                    self.end(&mut stretch);
                    self.goes_on = false;
                }
            }
            if is_in {
                stretch.push(sample);
            }
            before = Some((sample, is_in));
        }
        self.goes_on = self.end(&mut stretch) && before.is_some_and(|(_, is_in)| is_in);
    }

    /// The last place that is allowed on the way from one that is to one that is not.
    fn border(&mut self, profile: &Profile, [inside, outside]: [f64; 2]) -> Sample {
        let (inside, _) = bisect(inside, outside, END_MM, |s| self.allows(&profile.sampled(s)));
        profile.sampled(inside)
    }

    /// Ends a stretch; whether there is one.
    fn end(&mut self, stretch: &mut Vec<Sample>) -> bool {
        let mut samples = std::mem::take(stretch);
        samples.dedup_by(|b, a| b.s <= a.s);
        if samples.len() < 2 {
            return false;
        }
        match self.kept.last_mut().filter(|_| self.goes_on) {
            Some(chain) => chain.push(Profile { samples }),
            None => self.kept.push(vec![Profile { samples }]),
        }
        true
    }
}
