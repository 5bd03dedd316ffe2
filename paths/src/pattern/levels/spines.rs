//! One pass along a seam instead of many short ones across.
//!
//! ```text
//!   ╲   ╱        fronts of a field that meet: between two levels too much is left
//!    ╲x╱         at x, and on the next levels beside it
//!     │          the spine: one pass over all of these
//!    ╲x╱
//! ```
//!
//! Where lines of a field turn sharply, or end at a border that runs aslant, too little is cut at one place a level. Each such
//! place asks for a pass a few millimetres long; together they are one pass.

use claymill_nurbs::{Point2, Point3};

/// A place that asks for a pass, on the line of this rank: lines of ranks one apart are neighbours.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Asking {
    pub(crate) rank: usize,
    /// The ball's centre.
    pub(crate) centre: Point3,
}

/// Fewer places in a row are not worth a pass of its own.
const FEWEST: usize = 3;
/// How often each of its places moves halfway to the middle of its neighbours.
const SMOOTHINGS: usize = 2;
/// A line on which nothing is asked for is passed over.
const RANKS: usize = 2;

/// Rows of places on neighbouring lines, each the nearest to the other there and no further apart than `reach_mm` a line, as
/// numbers of the places, which come by rank.
pub(crate) fn spines(asking: &[Asking], reach_mm: f64) -> Vec<Vec<usize>> {
    let of_rank = |rank: usize| {
        let from = asking.partition_point(|a| a.rank < rank);
        from..asking.partition_point(|a| a.rank <= rank)
    };
    let nearest = |from: usize, rank: usize| {
        let away = |k: &usize| (asking[*k].centre - asking[from].centre).norm();
        let found = of_rank(rank).min_by(|a, b| away(a).total_cmp(&away(b)));
        found.filter(|k| away(k) <= reach_mm * rank.abs_diff(asking[from].rank) as f64)
    };
    let (mut next, mut follows) = (vec![None; asking.len()], vec![false; asking.len()]);
    for ranks in 1..=RANKS {
        for k in 0..asking.len() {
            let rank = asking[k].rank;
            if next[k].is_none()
                && let Some(other) = nearest(k, rank + ranks).filter(|&other| !follows[other])
                && nearest(other, rank) == Some(k)
            {
                (next[k], follows[other]) = (Some(other), true);
            }
        }
    }
    let begins: Vec<bool> = follows.iter().map(|f| !f).collect();
    let spine = |start: usize| std::iter::successors(Some(start), |&k| next[k]).collect::<Vec<_>>();
    let all = (0..asking.len()).filter(|&k| begins[k]).map(spine);
    all.filter(|spine| spine.len() >= FEWEST).collect()
}

/// Where the spine runs in plan: its places are in the middle of what is missing, more or less, and it need not turn with each of
/// them.
pub(crate) fn in_plan(spine: &[usize], asking: &[Asking]) -> Vec<Point2> {
    let mut places: Vec<Point2> = spine.iter().map(|&k| asking[k].centre.xy()).collect();
    for _ in 0..SMOOTHINGS {
        let inner = places.windows(3).map(|w| nalgebra::center(&w[1], &nalgebra::center(&w[0], &w[2])));
        let ends = [places[0], places[places.len() - 1]];
        places = [ends[0]].into_iter().chain(inner).chain([ends[1]]).collect();
    }
    places
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_on_neighbouring_lines_make_a_spine() {
        // Two seams that part, and a place far from both.
        let mut asking = Vec::new();
        for rank in 0..8 {
            let (x, apart) = (3.0 * rank as f64, rank as f64);
            for y in [apart + 2.0, -apart - 2.0] {
                asking.push(Asking { rank, centre: Point3::new(x, y, 0.0) });
            }
            if rank == 5 {
                asking.push(Asking { rank, centre: Point3::new(x, 50.0, 0.0) });
            }
        }
        let found = spines(&asking, 4.0);
        assert_eq!(found.iter().map(Vec::len).collect::<Vec<_>>(), [8, 8]);
        let plan = in_plan(&found[0], &asking);
        assert!(plan.iter().all(|p| p.y > 0.0) && plan[7] == Point2::new(21.0, 9.0));
        // Lines three apart are no neighbours.
        asking.iter_mut().for_each(|a| a.rank *= 3);
        assert!(spines(&asking, 40.0).is_empty());
    }
}
