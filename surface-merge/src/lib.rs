//! surface-merge
