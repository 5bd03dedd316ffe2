//! One master surface cut into patches by knot insertion: joints and regions are known exactly.

use std::collections::{BTreeMap, BTreeSet};

use crate::scene::{self, master, model, moved, part, plate};
use approx::assert_abs_diff_eq;
use claymill_nurbs::{KnotVector, Model, NurbsSurface, Vector3};
use claymill_surface_merge::{Continuity, Merge, MergeOptions, merge};
use rand::seq::SliceRandom;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Rows of patches: each row is a range of `v` and its cuts in `u`.
type Layout = Vec<((f64, f64), Vec<f64>)>;

/// Every row has its own cuts: all joints between rows are T-junctions.
fn layout(rows: usize, columns: usize, rng: &mut ChaCha8Rng) -> Layout {
    (0..rows)
        .map(|r| {
            let v = (r as f64 / rows as f64, (r + 1) as f64 / rows as f64);
            let jitter = 0.7 / columns as f64;
            let mut cuts = vec![0.0];
            cuts.extend(
                (1..columns).map(|c| c as f64 / columns as f64 + jitter * (rng.random::<f64>() - 0.5)),
            );
            cuts.push(1.0);
            (v, cuts)
        })
        .collect()
}

fn patches(surface: &NurbsSurface, layout: &Layout) -> Vec<NurbsSurface> {
    let row = |(v, cuts): &((f64, f64), Vec<f64>)| {
        cuts.windows(2).map(|w| part(surface, (w[0], w[1]), *v)).collect::<Vec<_>>()
    };
    layout.iter().flat_map(row).collect()
}

/// Pairs of patches that share a stretch.
fn neighbours(layout: &Layout) -> BTreeSet<[usize; 2]> {
    let mut pairs = BTreeSet::new();
    let mut first = 0;
    for (r, (_, cuts)) in layout.iter().enumerate() {
        let count = cuts.len() - 1;
        pairs.extend((1..count).map(|c| [first + c - 1, first + c]));
        if let Some((_, above)) = layout.get(r + 1) {
            for (a, w) in cuts.windows(2).enumerate() {
                for (b, x) in above.windows(2).enumerate() {
                    if w[0].max(x[0]) < w[1].min(x[1]) {
                        pairs.insert([first + a, first + count + b]);
                    }
                }
            }
        }
        first += count;
    }
    pairs
}

/// The same surface over other knot ranges.
fn restretched(s: &NurbsSurface, rng: &mut ChaCha8Rng) -> NurbsSurface {
    let mut knots = |k: &KnotVector| {
        let ((a, b), start, length) =
            (k.domain(), rng.random_range(-40.0..40.0), rng.random_range(0.01..300.0));
        let moved = k.as_slice().iter().map(|t| start + (t - a) / (b - a) * length).collect();
        KnotVector::new(k.degree(), moved).unwrap()
    };
    let (u, v) = (knots(s.knots_u()), knots(s.knots_v()));
    let points = s.net().iter().map(|h| claymill_nurbs::Point3::from(h.xyz() / h.w)).collect();
    NurbsSurface::new(u, v, points, Some(s.net().iter().map(|h| h.w).collect())).unwrap()
}

/// The same patches in another order, each with its parameters run another way. `order[k]` is the patch
/// that became face `k`.
fn shuffled(surfaces: &[NurbsSurface], rng: &mut ChaCha8Rng) -> (Model, Vec<usize>) {
    let mut order: Vec<usize> = (0..surfaces.len()).collect();
    order.shuffle(rng);
    let disguised = order.iter().map(|&k| {
        let mut s = surfaces[k].clone();
        if rng.random() {
            s = s.transposed();
        }
        if rng.random() {
            s = s.reversed_u();
        }
        if rng.random() {
            s = s.transposed();
        }
        restretched(&s, rng)
    });
    (model(disguised.collect()), order)
}

fn found(m: &Merge, order: &[usize]) -> BTreeSet<[usize; 2]> {
    let pairs: Vec<[usize; 2]> =
        m.joints.iter().map(|j| j.sides.map(|s| order[s.face])).map(|[a, b]| [a.min(b), a.max(b)]).collect();
    let set: BTreeSet<_> = pairs.iter().copied().collect();
    assert_eq!(set.len(), pairs.len(), "a joint is listed twice");
    set
}

fn partition(m: &Merge, order: &[usize]) -> BTreeSet<BTreeSet<usize>> {
    m.regions.iter().map(|r| r.faces.iter().map(|&f| order[f]).collect()).collect()
}

#[test]
fn planted_joints_are_found_one_for_one() {
    let master = master();
    for seed in 0..6 {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let layout = layout(rng.random_range(2..6), rng.random_range(2..9), &mut rng);
        let surfaces = patches(&master, &layout);
        let (model, order) = shuffled(&surfaces, &mut rng);
        let m = merge(&model, &MergeOptions::default()).unwrap();
        assert_eq!(found(&m, &order), neighbours(&layout), "seed {seed}");
        assert_eq!(m.regions.len(), 1, "seed {seed}");
        assert_eq!(m.regions[0].boundary_loops, 1);
        assert!(m.joints.iter().all(|j| j.continuity == Continuity::G2), "seed {seed}");
        let whole = merge(&scene::model(vec![master.clone()]), &MergeOptions::default()).unwrap();
        assert_abs_diff_eq!(m.account.naked_mm, whole.account.naked_mm, epsilon = 1e-2);
        // All patches turn to one side although half of them are turned over.
        let sides: BTreeSet<bool> = m.regions[0]
            .faces
            .iter()
            .zip(&m.regions[0].flipped)
            .map(|(&f, flip)| {
                let ((u0, u1), (v0, v1)) = model.faces[f].surface.domain();
                let n = model.faces[f].surface.normal(0.5 * (u0 + u1), 0.5 * (v0 + v1)).unwrap().0;
                (n.z > 0.0) != *flip
            })
            .collect();
        assert_eq!(sides.len(), 1, "seed {seed}");
    }
}

/// A tent of three waves with creases between: three regions.
fn tent(rng: &mut ChaCha8Rng) -> (Vec<NurbsSurface>, BTreeSet<BTreeSet<usize>>) {
    let mut surfaces = Vec::new();
    let mut regions = BTreeSet::new();
    for k in 0..3 {
        // Neighbours share a border curve: the master's side u = 1 is mirrored at a plane through it.
        let grid = patches(&plate((0.0, 1.0), (0.0, 1.0), 0.0), &layout(3, 4, rng));
        let lean = [0.3, -0.5, 0.2][k];
        let start = surfaces.len();
        let shift = [0.0, 0.3, -0.2][k];
        for s in grid {
            surfaces.push(sheared(&s, 40.0, 40.0 * k as f64, lean, 40.0 * shift));
        }
        regions.insert((start..surfaces.len()).collect());
    }
    (surfaces, regions)
}

/// `(x, y) ↦ (size x + offset, size y, lean size x + height)`.
fn sheared(s: &NurbsSurface, size: f64, offset: f64, lean: f64, height: f64) -> NurbsSurface {
    let (rows, columns) = s.size();
    let points = (0..rows * columns).map(|k| {
        let p = s.control_point(k / columns, k % columns) * size;
        claymill_nurbs::Point3::new(p.x + offset, p.y, lean * p.x + height)
    });
    NurbsSurface::new(s.knots_u().clone(), s.knots_v().clone(), points.collect(), None).unwrap()
}

#[test]
fn a_hundred_shuffles_give_one_partition() {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let (surfaces, expected) = tent(&mut rng);
    for _ in 0..100 {
        let (model, order) = shuffled(&surfaces, &mut rng);
        let m = merge(&model, &MergeOptions::default()).unwrap();
        assert_eq!(partition(&m, &order), expected);
        let ids: Vec<BTreeSet<usize>> =
            m.regions.iter().map(|r| r.faces.iter().map(|&f| order[f]).collect()).collect();
        // Areas differ by the lean: 0.5, then 0.3, then 0.2.
        let first: Vec<usize> = ids.iter().map(|r| *r.first().unwrap()).collect();
        assert_eq!(first, [12, 0, 24]);
    }
}

#[test]
fn a_gap_does_not_hide_a_joint_and_is_measured() {
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    let layout = layout(4, 5, &mut rng);
    let mut surfaces = patches(&sheared(&plate((0.0, 1.0), (0.0, 1.0), 0.0), 200.0, 0.0, 0.0, 0.0), &layout);
    let sunk = [3, 7, 11, 16];
    for (k, depth) in sunk.iter().zip([0.001, 0.004, 0.006, 0.0085]) {
        surfaces[*k] = moved(&surfaces[*k], Vector3::z() * -depth);
    }
    let depth: BTreeMap<usize, f64> = sunk.iter().copied().zip([0.001, 0.004, 0.006, 0.0085]).collect();
    let (model, order) = shuffled(&surfaces, &mut rng);
    let m = merge(&model, &MergeOptions::default()).unwrap();
    assert_eq!(found(&m, &order), neighbours(&layout));
    for j in &m.joints {
        let [a, b] = j.sides.map(|s| depth.get(&order[s.face]).copied().unwrap_or(0.0));
        assert_abs_diff_eq!(j.gap_normal_mm.max, f64::abs(a - b), epsilon = 1e-12);
        assert_abs_diff_eq!(j.gap_normal_mm.rms, f64::abs(a - b), epsilon = 1e-12);
    }
    assert_eq!(m.regions.len(), 1);
    // Two thirds of the patches are gone: what was matched with them is naked now.
    let kept: Vec<_> = surfaces.iter().step_by(3).cloned().collect();
    let lone = merge(&scene::model(kept), &MergeOptions::default()).unwrap();
    let a = lone.account;
    assert_abs_diff_eq!(
        a.matched_mm + a.naked_mm + a.non_manifold_mm,
        a.total_mm,
        epsilon = 1e-9 * a.total_mm
    );
    let listed: f64 = lone.naked.iter().map(|n| n.length_mm).sum();
    assert_abs_diff_eq!(listed, a.naked_mm, epsilon = 1e-6);
}

#[test]
fn the_number_of_threads_changes_nothing() {
    let mut rng = ChaCha8Rng::seed_from_u64(9);
    let surfaces = patches(&master(), &layout(4, 6, &mut rng));
    let model = model(surfaces);
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| merge(&model, &MergeOptions::default()).unwrap())
    };
    assert_eq!(on(1), on(5));
}
