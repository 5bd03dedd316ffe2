//! The material that is left at the time shown, found beside everything else.

use std::sync::{Arc, Condvar, Mutex};
use std::time::Duration;

use claymill_viewer::{Course, Scene, Stock, SurfaceMesh};

use crate::exhibit::Shared;

/// What is asked of it: when, s, and how much there is at first, mm.
type Asked = (f64, f64);

/// So long a picture waits for its material rather than showing that of another moment.
const PATIENCE: Duration = Duration::from_millis(60);

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
    stock: Stock,
}

impl Saw {
    fn new(exhibit: &Shared, bare: Scene, allowance_mm: f64) -> Option<Self> {
        let job = exhibit.job.as_ref()?;
        let course = Course::new(&job.program, &job.seconds, &job.job.tools);
        let stock = Stock::of(&bare, &course, allowance_mm).with_checkpoints();
        Some(Saw { bare, course, stock })
    }

    fn left(&mut self, asked: Asked) -> Left {
        let (at_s, allowance_mm) = asked;
        if self.stock.allowance_mm() != allowance_mm {
            self.stock.begin_anew(allowance_mm);
        }
        self.stock.go_to(&self.bare, &self.course, at_s);
        let mut skin = Scene::new(self.bare.origin);
        let (colours, ()) = rayon::join(|| self.stock.colours(&self.bare), || self.stock.add_skin(&mut skin));
        Left { asked, colours, skin: skin.surfaces }
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
    bench: Arc<(Mutex<Bench>, Condvar)>,
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
        if exhibit.job.is_none() {
            return (None, true);
        }
        let (bench, idle) = &*self.bench;
        let Ok(mut bench) = bench.lock() else { return (None, true) };
        let is_asked = |found: &Option<Arc<Left>>| found.as_ref().is_some_and(|l| l.asked == asked);
        if !is_asked(&bench.found) {
            if !bench.busy {
                bench.busy = true;
                let saw = bench.saw.take();
                let bare = if saw.is_none() { scene.clone() } else { Scene::default() };
                self.cut(exhibit, saw, bare, asked);
            }
            match idle.wait_timeout_while(bench, PATIENCE, |b| b.busy) {
                Ok((after, _)) => bench = after,
                Err(_) => return (None, true),
            }
        }
        (bench.found.clone(), is_asked(&bench.found))
    }

    /// Cuts what was asked, on a thread.
    fn cut(&self, exhibit: &Shared, saw: Option<Saw>, bare: Scene, asked: Asked) {
        let (exhibit, bench) = (Arc::clone(exhibit), Arc::clone(&self.bench));
        std::thread::spawn(move || {
            let saw = saw.or_else(|| Saw::new(&exhibit, bare, asked.1));
            let done = saw.map(|mut saw| (saw.left(asked), saw));
            let (bench, idle) = &*bench;
            if let Ok(mut bench) = bench.lock() {
                bench.busy = false;
                if let Some((left, saw)) = done {
                    (bench.found, bench.saw) = (Some(Arc::new(left)), Some(saw));
                }
            }
            idle.notify_all();
        });
    }
}
