//! Rigid-body-spring lattice for the fracture of hardened fibre concrete.

mod dense;
mod lattice;
pub mod mesh;
mod nodes;
mod sparse;
mod voronoi;

pub use mesh::Mesh;
pub use nodes::Grading;
pub use sparse::Singular;
