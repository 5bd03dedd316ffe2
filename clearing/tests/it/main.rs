//! Clearing, judged by the verifier's own meter and by closed forms.

mod pockets;
mod regions;
mod starts;
mod whole;
