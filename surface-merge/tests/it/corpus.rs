//! Real models: exact answers where they are known, a second opinion where not.

use claymill_nurbs::Model;
use claymill_surface_merge::{Continuity, Merge, MergeOptions, merge};

/// The names of all models that are there.
#[track_caller]
fn models() -> Vec<String> {
    let Some(folder) = claymill_tests::corpus() else { return Vec::new() };
    let names = std::fs::read_dir(folder).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap());
    let is_model = |n: &String| [".igs", ".iges", ".stp", ".3dm"].iter().any(|end| n.ends_with(end));
    let mut models: Vec<String> = names.filter(is_model).collect();
    models.sort();
    models
}

#[track_caller]
fn corpus(file: &str) -> Option<Model> {
    let path = claymill_tests::corpus_file(file)?;
    Some(claymill_exchange::read(&path).unwrap().model)
}

fn merged(model: &Model) -> Merge {
    let m = merge(model, &MergeOptions::default()).unwrap();
    let a = &m.account;
    let parts = a.matched_mm + a.lapped_mm + a.naked_mm + a.non_manifold_mm;
    approx::assert_abs_diff_eq!(parts, a.total_mm, epsilon = 1e-9 * a.total_mm);
    m
}

fn count(m: &Merge, class: Continuity) -> usize {
    m.joints.iter().filter(|j| j.continuity == class).count()
}

#[test]
fn the_boundary_of_every_model_is_accounted_for() {
    for file in models() {
        let Some(model) = corpus(&file) else { return };
        let m = merged(&model);
        let tolerance_mm = m.tolerance.value_mm;
        let naked: f64 = m.naked.iter().map(|n| n.length_mm).sum();
        // Slivers shorter than the tolerance are counted, but not listed.
        assert!(naked <= m.account.naked_mm * (1.0 + 1e-9), "{file}");
        let slivers = m.account.naked_mm - naked;
        assert!(slivers <= tolerance_mm * 20.0 * model.faces.len() as f64, "{file}: {slivers} mm of slivers");
        let laps: f64 = m.laps.iter().map(|l| l.length_mm).sum();
        assert!(laps <= m.account.lapped_mm * (1.0 + 1e-9), "{file}");
        assert!(m.laps.iter().all(|l| l.gap_mm <= tolerance_mm && l.onto != l.stretch.face), "{file}");
    }
}

#[test]
fn the_helmet_has_exactly_its_creases() {
    let Some(model) = corpus("helmet_928.igs") else {
        return;
    };
    let m = merged(&model);
    assert_eq!(count(&m, Continuity::C0), 152);
    assert_eq!(count(&m, Continuity::G2), 1652);
    assert_eq!(m.joints.len(), 152 + 1652);
    assert_eq!(m.naked.len(), 104);
    assert_eq!(m.regions.len(), 7);
}

#[test]
fn the_sports_car_falls_into_few_large_regions() {
    let Some(model) = corpus("sports_car_1399.igs") else {
        return;
    };
    let m = merged(&model);
    let total: f64 = m.regions.iter().map(|r| r.area_mm2).sum();
    let largest: f64 = m.regions.iter().take(10).map(|r| r.area_mm2).sum();
    assert!(m.regions.len() <= 60, "{} regions", m.regions.len());
    assert!(largest > 0.9 * total);
    assert_eq!(m.region_of_face.len(), 1399);
}

#[test]
fn the_airliner_s_fuselage_is_one_region_and_two_caps() {
    let Some(model) = corpus("airliner_fuselage_238.igs") else {
        return;
    };
    let m = merged(&model);
    let faces: Vec<usize> = m.regions.iter().map(|r| r.faces.len()).collect();
    assert_eq!(faces, [236, 1, 1]);
    assert_eq!((count(&m, Continuity::C0), count(&m, Continuity::G2)), (8, 468));
    assert!(m.naked.is_empty());
}

#[test]
fn the_same_car_in_more_patches_gives_the_same_regions() {
    let (Some(coarse), Some(fine)) = (corpus("sports_car_1399.igs"), corpus("sports_car_6300.igs")) else {
        return;
    };
    let (coarse, fine) = (merged(&coarse), merged(&fine));
    assert_eq!(coarse.regions.len(), fine.regions.len());
    for (a, b) in coarse.regions.iter().zip(&fine.regions) {
        approx::assert_relative_eq!(a.area_mm2, b.area_mm2, max_relative = 1e-5);
        assert_eq!(a.boundary_loops, b.boundary_loops, "region {}", a.id);
    }
}

/// Length of the naked stretches that are not on a side of the box around all of them, by face, mm.
fn naked_inside(m: &Merge) -> std::collections::BTreeMap<usize, f64> {
    let ends = || m.naked.iter().flat_map(|n| n.ends);
    let side =
        |k: usize| ends().fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], p| [a.min(p[k]), b.max(p[k])]);
    let sides = [side(0), side(1), side(2)];
    let on_side = |ends: &[claymill_nurbs::Point3; 2]| {
        (0..3).any(|k| sides[k].iter().any(|at| ends.iter().all(|p| (p[k] - at).abs() < 1.0)))
    };
    let mut inside = std::collections::BTreeMap::new();
    for n in m.naked.iter().filter(|n| !on_side(&n.ends)) {
        *inside.entry(n.stretch.face).or_default() += n.length_mm;
    }
    inside
}

#[test]
fn what_is_naked_is_a_rim_or_a_wide_gap() {
    if let Some(hull) = corpus("ship_hull_55.iges") {
        let m = merged(&hull);
        // Half a hull is open at the middle plane, the deck, the transom and the keel; all else gapes.
        let inside: f64 = naked_inside(&m).values().sum();
        let gaps: f64 = m.wide_gaps.iter().map(|g| if g.to_edge { 2.0 } else { 1.0 } * g.length_mm).sum();
        assert!(m.wide_gaps.len() > 20 && gaps > 3400.0, "{gaps}");
        // The rest gapes wider than the search radius.
        assert!(inside - gaps < 0.02 * m.account.naked_mm, "{inside} {gaps}");
    }
    if let Some(nose) = corpus("race_car_nose_141.stp") {
        let m = merged(&nose);
        // Half a nose is open at the middle plane and at its rear; the outline of one plate is free.
        let inside = naked_inside(&m);
        let rest: f64 = inside.iter().filter(|(face, _)| **face != 140).map(|(_, length)| length).sum();
        assert!(rest < 1.0, "{inside:?}");
        assert_eq!(m.wide_gaps.len(), 1);
    }
}
