//! Reading STEP files.

mod corpus;
mod damage;
mod features;
mod green;
mod surfaces;
mod text;
