//! The kernel from outside: each module has a subject, and all of them one program.

mod bounds;
mod budgets;
mod closest;
mod crossing;
mod derivatives;
mod domain;
mod measure;
mod mesh;
mod rays;
mod shapes;
mod unique;
