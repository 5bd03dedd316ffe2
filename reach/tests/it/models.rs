//! Real parts: the fewest directions, proven.

use claymill_contact::Axis;
use claymill_reach::{Reach, Reacher, choose, sphere};

use crate::shapes::Shape;

#[test]
fn covers_of_real_parts_are_proven() {
    let axis = |text: &str| text.parse::<Axis>().unwrap();
    let Some(corpus) = claymill_tests::corpus() else { return };
    let mut files: Vec<_> = ["mfcad", "nist"]
        .iter()
        .flat_map(|folder| std::fs::read_dir(corpus.join(folder)).into_iter().flatten().flatten())
        .map(|entry| entry.path())
        .filter(|path| path.extension().is_some_and(|e| e == "step" || e == "stp"))
        .collect();
    files.sort();
    let every: usize = std::env::var("CLAYMILL_EVERY").ok().and_then(|n| n.parse().ok()).unwrap_or(40);
    let (mut proven, mut all) = (0, 0);
    for path in files.iter().step_by(every.max(1)) {
        let shape = Shape::read(path);
        let part = shape.part();
        let directions = sphere(&part, &[], 180.0, 1, (axis("+z"), axis("-y"))).unwrap();
        let reach = Reach::new(&part, &Reacher::of("flat:1".parse().unwrap()), &directions, &()).unwrap();
        let found = choose(&reach.table, &reach.weights(), &[], 0.005, &()).unwrap();
        assert_eq!(found.certificate.check(&reach.table, &[]), Ok(()), "{}", path.display());
        let [all_mm2, own_mm2] =
            [reach.table.coverable(), reach.table.covered(&found.columns)].map(|rows| reach.area_mm2(&rows));
        assert!(own_mm2 >= 0.995 * all_mm2, "{own_mm2} of {all_mm2}");
        all += 1;
        proven += usize::from(found.is_optimal());
        let reached = reach.area_mm2(&reach.table.coverable()) / reach.whole_mm2();
        println!(
            "{}: {} of {} directions, {} at least, {:.2} % of the area",
            path.display(),
            found.columns.len(),
            directions.len(),
            found.certificate.least,
            100.0 * reached
        );
    }
    println!("{proven} of {all} proven");
    assert!(100 * proven >= 95 * all, "{proven} of {all}");
}
