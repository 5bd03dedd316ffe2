//! Tiles of 32 × 32 rays that stocks share until one of them cuts there.

use std::cell::RefCell;
use std::sync::Arc;

use crate::grid::{SIDE, TILE};

/// Interval lists of 32 × 32 neighbouring rays, one after the other.
#[derive(Debug, PartialEq, Eq)]
pub(crate) struct Tile {
    /// Where the list of each ray begins; one more at the end.
    first: Box<[u32]>,
    ends: Box<[[i32; 2]]>,
    /// From the lowest to the highest end.
    pub(crate) span: [i32; 2],
}

impl Tile {
    /// The intervals of a ray, by its number in the tile.
    #[inline]
    pub(crate) fn ray(&self, ray: usize) -> &[[i32; 2]] {
        &self.ends[self.first[ray] as usize..self.first[ray + 1] as usize]
    }

    /// The lists of all rays.
    pub(crate) fn rays(&self) -> impl Iterator<Item = &[[i32; 2]]> {
        (0..TILE).map(|ray| self.ray(ray))
    }

    /// All ends, for digests.
    pub(crate) fn parts(&self) -> (&[u32], &[[i32; 2]]) {
        (&self.first, &self.ends)
    }

    /// Memory, bytes.
    pub(crate) fn bytes(&self) -> usize {
        size_of::<Tile>() + size_of_val(&*self.first) + size_of_val(&*self.ends)
    }
}

/// A tile that was never filled or is cut away has no memory.
pub(crate) type Shared = Option<Arc<Tile>>;

/// Calls a function with the thread's own lists, which may hold anything.
pub(crate) fn with_lists<T>(with: impl FnOnce(&mut Lists) -> T) -> T {
    thread_local! {
        static LISTS: RefCell<Lists> = RefCell::new(Lists::new());
    }
    LISTS.with_borrow_mut(with)
}

/// One tile unpacked: a list that can grow for every ray. Threads keep one and use it for tile after tile.
pub(crate) struct Lists {
    pub(crate) rays: Vec<Vec<[i32; 2]>>,
}

impl Lists {
    pub(crate) fn new() -> Self {
        Lists { rays: (0..TILE).map(|_| Vec::with_capacity(2)).collect() }
    }

    pub(crate) fn load(&mut self, tile: &Shared) {
        for (ray, list) in self.rays.iter_mut().enumerate() {
            list.clear();
            if let Some(tile) = tile {
                list.extend_from_slice(tile.ray(ray));
            }
        }
    }

    pub(crate) fn store(&self) -> Shared {
        let count: usize = self.rays.iter().map(Vec::len).sum();
        if count == 0 {
            return None;
        }
        let (mut first, mut ends) = (Vec::with_capacity(TILE + 1), Vec::with_capacity(count));
        let mut span = [i32::MAX, i32::MIN];
        first.push(0);
        for list in &self.rays {
            if let (Some(low), Some(high)) = (list.first(), list.last()) {
                span = [span[0].min(low[0]), span[1].max(high[1])];
            }
            ends.extend_from_slice(list);
            first.push(u32::try_from(ends.len()).expect("a tile has far fewer intervals: 4e6 for each ray"));
        }
        Some(Arc::new(Tile { first: first.into(), ends: ends.into(), span }))
    }
}

/// Number of a ray in its tile.
#[inline]
pub(crate) fn ray_in_tile(u: u32, v: u32) -> usize {
    ((v % SIDE) * SIDE + u % SIDE) as usize
}
