//! Lists of intervals with integer ends on one ray: ascending, with a gap between neighbours.
//!
//! Subtracting intervals with integer ends is a difference of sets. It commutes, so moves may come in any order.

/// Takes `[low, high)` out of a list. Returns whether anything was there.
#[inline]
pub(crate) fn subtract(list: &mut Vec<[i32; 2]>, low: i32, high: i32) -> bool {
    let first = list.partition_point(|i| i[1] <= low);
    if low >= high || first == list.len() || list[first][0] >= high {
        return false;
    }
    let count = list[first..].iter().take_while(|i| i[0] < high).count();
    let (start, end) = (list[first][0], list[first + count - 1][1]);
    match (start < low, end > high) {
        (true, true) if count == 1 => {
            list[first][1] = low;
            list.insert(first + 1, [high, end]);
        }
        (below, above) => {
            let (mut from, mut to) = (first, first + count);
            if below {
                list[from][1] = low;
                from += 1;
            }
            if above {
                list[to - 1][0] = high;
                to -= 1;
            }
            list.drain(from..to);
        }
    }
    true
}

/// Whether an interval shares more than its ends with a list.
#[inline]
pub(crate) fn overlaps(list: &[[i32; 2]], low: i32, high: i32) -> bool {
    let first = list.partition_point(|i| i[1] <= low);
    low < high && list.get(first).is_some_and(|i| i[0] < high)
}

/// Sorts intervals and joins those that touch or overlap; drops empty ones.
pub(crate) fn united(mut list: Vec<[i32; 2]>) -> Vec<[i32; 2]> {
    list.retain(|i| i[0] < i[1]);
    list.sort_unstable();
    let mut kept: Vec<[i32; 2]> = Vec::with_capacity(list.len());
    for next in list {
        match kept.last_mut() {
            Some(last) if next[0] <= last[1] => last[1] = last[1].max(next[1]),
            _ => kept.push(next),
        }
    }
    kept
}

/// Sum of the lengths, quanta.
pub(crate) fn length(list: &[[i32; 2]]) -> i64 {
    list.iter().map(|i| i64::from(i[1]) - i64::from(i[0])).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{Rng, SeedableRng};

    /// Against one flag for each quantum.
    #[test]
    fn subtracting_is_a_difference_of_sets_in_any_order() {
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(1);
        for _ in 0..2000 {
            let (mut list, mut flags) = (vec![[0, 60]], [true; 60]);
            for _ in 0..rng.random_range(1..12) {
                let low = rng.random_range(-5..60);
                let high = low + rng.random_range(0..14);
                let there = (low..high).any(|i| (0..60).contains(&i) && flags[i as usize]);
                assert_eq!(overlaps(&list, low, high), there);
                assert_eq!(subtract(&mut list, low, high), there);
                for i in low.max(0)..high.min(60) {
                    flags[i as usize] = false;
                }
            }
            let all = (0..60).filter(|&i| flags[i as usize]).map(|i| [i, i + 1]).collect();
            assert_eq!(list, united(all));
            assert_eq!(length(&list), flags.iter().filter(|f| **f).count() as i64);
        }
    }
}
