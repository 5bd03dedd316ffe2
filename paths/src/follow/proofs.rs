//! Counts of pass locations by what proves them: certified, lifted to a bound, or searched.

use std::iter::Sum;
use std::ops::AddAssign;

use claymill_contact::{Location, Support};
use serde::{Deserialize, Serialize};

/// How many locations of passes there are, by what proves them.
#[derive(Debug, Clone, Copy, Default, Serialize, Deserialize)]
pub(crate) struct Proofs {
    pub(crate) locations: u64,
    /// By the sheet around the contact.
    pub(crate) certified: u64,
    /// By a bound that they were lifted to.
    pub(crate) lifted: u64,
}

impl Proofs {
    pub(crate) fn add(&mut self, location: &Location) {
        self.locations += 1;
        self.certified += u64::from(location.certified);
        self.lifted += u64::from(location.support == Support::Bound);
    }
}

impl AddAssign for Proofs {
    fn add_assign(&mut self, other: Proofs) {
        self.locations += other.locations;
        self.certified += other.certified;
        self.lifted += other.lifted;
    }
}

impl Sum for Proofs {
    fn sum<I: Iterator<Item = Proofs>>(all: I) -> Proofs {
        all.fold(Proofs::default(), |mut sum, of| {
            sum += of;
            sum
        })
    }
}
