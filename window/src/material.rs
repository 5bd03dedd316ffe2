//! The material that is left at the time shown, found beside everything else.

use std::sync::{Arc, Mutex};

use claymill_viewer::{Course, Scene, Stock, SurfaceMesh};

use crate::exhibit::Shared;

/// What is asked of it: when, s, and how much there is at first, mm.
type Asked = (f64, f64);

/// The material at a time.
#[derive(Debug)]
pub(crate) struct Left {
    asked: Asked,
    /// Of the model's vertices, surface by surface.
    pub(crate) colours: Vec<Vec<[u8; 4]>>,
    /// Over what is not cut yet.
    pub(crate) skin: Vec<SurfaceMesh>,
}

/// What cuts, kept from time to time.
struct Saw {
    bare: Scene,
    course: Course,
    stock: Option<(Asked, Stock)>,
}

impl Saw {
    fn left(&mut self, asked: Asked) -> Left {
        let (at_s, allowance_mm) = asked;
        // Material does not grow again: before what was asked last it is cut from the beginning.
        let going_on = self.stock.take().filter(|((s, mm), _)| *s <= at_s && *mm == allowance_mm);
        let mut stock =
            going_on.map_or_else(|| Stock::of(&self.bare, &self.course, allowance_mm), |(_, stock)| stock);
        stock.advance(&self.bare, &self.course, at_s);
        let mut painted = self.bare.clone();
        stock.paint(&self.bare, &mut painted);
        let mut skin = Scene::new(self.bare.origin);
        stock.add_skin(&mut skin);
        self.stock = Some((asked, stock));
        let colours = |s: &SurfaceMesh| s.vertices.iter().map(|v| v.colour).collect();
        Left { asked, colours: painted.surfaces.iter().map(colours).collect(), skin: skin.surfaces }
    }
}

#[derive(Default)]
struct Bench {
    busy: bool,
    saw: Option<Saw>,
    found: Option<Arc<Left>>,
}

/// Cuts on a thread of its own, and always what was asked last.
#[derive(Default)]
pub(crate) struct Material {
    bench: Arc<Mutex<Bench>>,
}

impl Material {
    /// The latest that is known, and whether it is what is asked.
    pub(crate) fn left(
        &self,
        exhibit: &Shared,
        scene: &Scene,
        at_s: f64,
        allowance_mm: f64,
    ) -> (Option<Arc<Left>>, bool) {
        let asked = (at_s, allowance_mm);
        let Ok(mut bench) = self.bench.lock() else { return (None, true) };
        let known = bench.found.clone();
        let done = known.as_ref().is_some_and(|l| l.asked == asked);
        if done || bench.busy || exhibit.job.is_none() {
            return (known, done || exhibit.job.is_none());
        }
        bench.busy = true;
        let saw = bench.saw.take();
        let bare = if saw.is_none() { scene.clone() } else { Scene::default() };
        let (exhibit, bench) = (Arc::clone(exhibit), Arc::clone(&self.bench));
        std::thread::spawn(move || {
            let course = || {
                let job = exhibit.job.as_ref();
                job.map(|j| Course::new(&j.program, &j.seconds, &j.job.tools))
            };
            let saw = saw.or_else(|| Some(Saw { bare, course: course()?, stock: None }));
            let done = saw.map(|mut saw| (saw.left(asked), saw));
            if let Ok(mut bench) = bench.lock() {
                bench.busy = false;
                if let Some((left, saw)) = done {
                    (bench.found, bench.saw) = (Some(Arc::new(left)), Some(saw));
                }
            }
        });
        (known, false)
    }
}
