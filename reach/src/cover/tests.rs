//! Covers against brute force, and certificates that are no proof.

use claymill_toolpath::Cancelled;
use proptest::prelude::*;

use super::*;

fn table(rows: usize, columns: &[Vec<usize>]) -> Table {
    Table { columns: columns.iter().map(|c| BitSet::of(rows, c.iter().copied())).collect(), rows }
}

/// The fewest columns by trying all choices, with the forced ones.
fn by_force(table: &Table, forced: &[usize]) -> usize {
    let wanted = table.coverable();
    (0..1_u32 << table.columns.len())
        .filter(|chosen| {
            let chosen: Vec<usize> = (0..table.columns.len()).filter(|k| chosen >> k & 1 == 1).collect();
            let mut all = table.covered(&chosen);
            all.add(&table.covered(forced));
            wanted.is_within(&all)
        })
        .map(u32::count_ones)
        .min()
        .unwrap_or(0) as usize
}

fn columns() -> impl Strategy<Value = Vec<Vec<usize>>> {
    prop::collection::vec(prop::collection::vec(0..12_usize, 0..6), 1..11)
}

proptest! {
    #[test]
    fn no_choice_of_columns_is_smaller_and_the_certificate_holds(columns in columns(), force in 0..11_usize) {
        let table = table(12, &columns);
        let forced: Vec<usize> = (force < columns.len()).then_some(force).into_iter().collect();
        let cover = cover(&table, &forced, &()).unwrap();
        prop_assert!(table.coverable().is_within(&table.covered(&cover.columns)));
        prop_assert_eq!(cover.chosen().len(), by_force(&table, &forced));
        prop_assert!(cover.is_optimal());
        prop_assert_eq!(cover.certificate.check(&table, &forced), Ok(()));
        // What claims one more proves nothing.
        let more = Certificate { least: cover.certificate.least + 1, ..cover.certificate.clone() };
        prop_assert!(more.check(&table, &forced).is_err());
    }

    #[test]
    fn gains_rise_and_no_choice_covers_more_than_is_said(
        columns in columns(),
        weights in prop::collection::vec(0.1..5.0_f64, 12)
    ) {
        let table = table(12, &columns);
        for (k, gain) in gains(&table, &weights, &[], 4).iter().enumerate() {
            let weigh = |rows: &BitSet| rows.iter().map(|r| weights[r]).sum::<f64>();
            prop_assert!((weigh(&table.covered(&gain.columns)) - gain.covered).abs() < 1e-9);
            let most = (0..1_u32 << columns.len()).filter(|c| c.count_ones() as usize <= k + 1).map(|chosen| {
                let chosen: Vec<usize> = (0..columns.len()).filter(|k| chosen >> k & 1 == 1).collect();
                weigh(&table.covered(&chosen))
            });
            let most = most.fold(0.0, f64::max);
            prop_assert!(gain.covered <= most + 1e-9 && most <= gain.at_most + 1e-9);
        }
    }
}

#[test]
fn a_gap_of_the_linear_program_is_closed_by_branching() {
    // The seven lines of a plane with seven points: shares prove 7/3, three columns are needed.
    let lines = [[0, 1, 2], [0, 3, 4], [0, 5, 6], [1, 3, 5], [1, 4, 6], [2, 3, 6], [2, 4, 5]];
    let table = table(7, &lines.map(|l| l.to_vec()));
    let found = cover(&table, &[], &()).unwrap();
    assert_eq!((found.columns.len(), found.is_optimal()), (3, true));
    assert_eq!(found.certificate.check(&table, &[]), Ok(()));
}

#[test]
fn forced_columns_are_kept_and_the_rest_is_the_fewest() {
    let table = table(4, &[vec![0], vec![0, 1], vec![2, 3], vec![1, 2]]);
    let found = cover(&table, &[0], &()).unwrap();
    assert_eq!((found.columns.clone(), found.forced), (vec![0, 1, 2], 1));
    assert_eq!(found.certificate.check(&table, &[0]), Ok(()));
}

#[test]
fn a_certificate_that_was_tampered_with_is_found_out() {
    let table = table(3, &[vec![0, 1], vec![1, 2], vec![0, 2]]);
    let found = cover(&table, &[], &()).unwrap();
    assert_eq!((found.columns.len(), found.certificate.least), (2, 2));
    let of = |proof| Certificate { least: 2, rows: vec![0, 1, 2], proof }.check(&table, &[]);
    let over = of(Proof::Shares(vec![(0, SHARE), (1, SHARE)]));
    assert!(matches!(over, Err(CertificateError::Overloaded { column: 0, .. })));
    assert!(matches!(of(Proof::Shares(vec![(0, SHARE)])), Err(CertificateError::Short { .. })));
    assert!(matches!(of(Proof::Shares(vec![(0, SHARE), (0, SHARE)])), Err(CertificateError::Number(0))));
    let child = Child { column: 0, proof: Proof::Shares(vec![(2, SHARE)]) };
    let missing = of(Proof::Branch { row: 0, children: vec![child] });
    assert_eq!(missing, Err(CertificateError::Missing { row: 0, column: 2 }));
}

#[test]
fn nothing_to_cover_takes_nothing() {
    let empty = table(3, &[vec![], vec![]]);
    let found = cover(&empty, &[], &()).unwrap();
    assert!(found.columns.is_empty() && found.is_optimal());
}

#[test]
fn it_is_cancelled() {
    struct Ended;
    impl claymill_toolpath::Monitor for Ended {
        fn at(&self, _: claymill_toolpath::Stage, _: f64) {}
        fn is_cancelled(&self) -> bool {
            true
        }
    }
    assert_eq!(cover(&table(2, &[vec![0], vec![1]]), &[], &Ended), Err(Cancelled));
}
