//! Rigid-body-spring lattice for the fracture of hardened fibre concrete.

mod dense;
pub mod mesh;
mod nodes;
mod voronoi;

pub use mesh::Mesh;
pub use nodes::Grading;
