//! Reading STEP files.

mod corpus;
mod damage;
mod features;
mod green;
mod holes;
mod products;
mod surfaces;
mod text;
