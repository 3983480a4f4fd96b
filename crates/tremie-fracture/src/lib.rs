//! Rigid-body-spring lattice for the fracture of hardened fibre concrete.

mod dense;
pub mod fibres;
mod lattice;
pub mod mesh;
mod nodes;
mod pull_out;
mod softening;
mod shear_lag;
mod sparse;
mod trial;
mod voronoi;

pub use mesh::Mesh;
pub use nodes::Grading;
pub use pull_out::{Bond, PullOut};
pub use softening::Softening;
pub use sparse::Singular;
pub use trial::{BridgeState, Loading, Reading, Setup, State, Trial, TrialError};
