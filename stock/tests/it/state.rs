//! The same bytes in any order and on any number of threads; families that agree; states that share memory.

use claymill_nurbs::{Point3, Vector3};
use claymill_stock::{Stock, Sweep, ToolBody};
use claymill_toolpath::Holder;
use rand::seq::SliceRandom;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::{block, cutting, end, tool, upright};

fn on_threads<T: Send>(count: usize, run: impl FnOnce() -> T + Send) -> T {
    rayon::ThreadPoolBuilder::new().num_threads(count).build().unwrap().install(run)
}

#[test]
fn neither_threads_nor_the_order_of_moves_change_a_byte() {
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    let holder = Holder::parse("40:20-30x20", &tool("bull:4:1")).unwrap();
    let bodies =
        [end("ball:6"), cutting("flat:5"), ToolBody::whole(&tool("bull:4:1"), Some(&holder)).unwrap()];
    let mut sweeps = Vec::new();
    for i in 0..600 {
        let axis = Vector3::from_fn(|_, _| rng.random_range(-1.0..1.0));
        let [from, to] = [0; 2].map(|_| Point3::from([0; 3].map(|_| rng.random_range(-60.0..60.0))));
        let axis = if i % 2 == 0 { Vector3::z() } else { axis.normalize() };
        sweeps.push(Sweep::new(&bodies[i % 3], axis, from, from + (to - from) * 0.2).unwrap());
    }
    let stock = block([-50.0; 3], [50.0; 3], 1.0);
    let cut = |sweeps: &[Sweep<'_>]| {
        let mut later = stock.clone();
        later.cut_all(sweeps);
        later
    };
    let once = on_threads(1, || cut(&sweeps));
    let volume = once.volume();
    assert!(volume.best_mm3() > 1e4 && volume.best_mm3() < 9e5, "{volume:?}");
    for threads in [1, 2, 3] {
        sweeps.shuffle(&mut rng);
        let other = on_threads(threads, || cut(&sweeps));
        assert!(other == once);
        assert_eq!(on_threads(threads, || other.digest()), once.digest());
        assert_eq!(other.volume(), volume);
    }
    // One at a time, and again.
    let mut slowly = stock.clone();
    sweeps.iter().chain(&sweeps[..9]).for_each(|s| slowly.cut(s));
    assert!(slowly == once && slowly.digest() == once.digest());
    assert_ne!(stock.digest(), once.digest());
}

/// Rings over a dome, level by level, with a ball and its flutes.
fn roughing(body: &ToolBody) -> Vec<Sweep<'_>> {
    let (mut sweeps, mut depth): (Vec<Sweep<'_>>, f64) = (Vec::new(), 2.0);
    while depth < 20.0 {
        let mut radius = (70.0 * 70.0 - (70.0 - depth) * (70.0 - depth)).sqrt() + 6.0;
        while radius < 75.0 {
            let at = |i: u32| {
                let (sine, cosine) = (f64::from(i) * std::f64::consts::TAU / 90.0).sin_cos();
                [radius * cosine, radius * sine, -depth]
            };
            sweeps.extend((0..90).map(|i| upright(body, at(i), at(i + 1))));
            radius += 4.3;
        }
        depth += 2.7;
    }
    sweeps
}

#[test]
fn families_agree_after_roughing() {
    let body = cutting("ball:6");
    for (pitch, bound) in [(0.5, 3e-3), (0.2, 1e-3)] {
        let mut stock = block([-60.0, -60.0, -30.0], [60.0, 60.0, 0.0], pitch);
        let before = stock.clone();
        stock.cut_all(&roughing(&body));
        for volume in [stock.volume(), before.removed_since(&stock).unwrap()] {
            let best = volume.best_mm3();
            let off = volume.families_mm3.map(|v| v / best - 1.0);
            println!("roughing at {pitch}: {best} {off:?}");
            assert!(off.iter().all(|v| v.abs() < bound), "{pitch}: {off:?}");
        }
    }
}

/// Undercut: a slot from above to its floor, then a T-slot from the side under what stands.
#[test]
fn what_two_directions_undercut_is_gone_and_what_is_above_it_stands() {
    let body = cutting("flat:4,length:100");
    let mut stock = block([0.0; 3], [60.0, 40.0, 30.0], 0.5);
    // From above, along y through everything, 8 wide and 20 deep.
    stock.cut(&upright(&body, [20.0, -10.0, 10.0], [20.0, 50.0, 10.0]));
    // From +x, along y, 8 high about z = 14, from the slot out: under the roof over x > 24.
    let from_x = |x: f64, y: f64| Point3::new(x, y, 14.0);
    stock.cut(&Sweep::new(&body, Vector3::x(), from_x(24.0, -10.0), from_x(24.0, 50.0)).unwrap());
    let exact = 60.0 * 40.0 * 30.0 - 8.0 * 20.0 * 40.0 - 36.0 * 8.0 * 40.0;
    for volume in stock.volume().families_mm3 {
        assert!((volume / exact - 1.0).abs() < 1e-9, "{volume} {exact}");
    }
    // The roof over the undercut, and the floor below it.
    assert_eq!(stock.on_ray(claymill_stock::Family::Z, [60, 40]), [[0.0, 10.0], [18.0, 30.0]]);
}

#[test]
fn states_share_what_was_not_cut() {
    let ball = end("ball:5");
    let stock = block([0.0; 3], [200.0, 200.0, 20.0], 1.0);
    let mut later = stock.clone();
    later.cut(&upright(&ball, [300.0, 0.0, 0.0], [300.0, 10.0, 0.0]));
    assert!(later == stock);
    assert_eq!(stock.removed_since(&later).unwrap().families_mm3, [0.0; 3]);
    later.cut(&upright(&ball, [50.0, 50.0, 16.0], [60.0, 50.0, 16.0]));
    let removed = stock.removed_since(&later).unwrap();
    assert_eq!(removed, stock.removed_by(&[upright(&ball, [50.0, 50.0, 16.0], [60.0, 50.0, 16.0])]));
    assert!(removed.best_mm3() > 100.0);
    let other = block([0.0; 3], [200.0, 200.0, 21.0], 1.0);
    assert!(stock.removed_since(&other).is_err());
    // All is cut away.
    let mut nothing: Stock = block([0.0; 3], [10.0; 3], 1.0);
    nothing.cut(&upright(&end("ball:50"), [0.0, 0.0, -50.0], [0.0, 0.0, -50.0]));
    assert!(nothing.is_empty());
    assert_eq!(nothing.volume().families_mm3, [0.0; 3]);
}
