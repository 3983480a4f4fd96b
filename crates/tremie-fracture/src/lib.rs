//! Rigid-body-spring lattice for the fracture of hardened fibre concrete.
//!
//! A beam is a Voronoi diagram (`voronoi`) of random nodes (`nodes`), graded to a crack plane and mirrored about it: rigid cells and
//! facets ([`mesh`]). Springs at the facets hold the cells together ([`Lattice`]); `sparse` factorises them once, `dense` what is left at the crack plane.
//! There, the matrix softens ([`Softening`]) and fibres ([`fibres`]) debond and are pulled out ([`PullOut`]); before, they stiffen the lattice
//! (`shear_lag`). A [`Trial`] is a test of a beam, led by the opening of its crack.
//!
//! Everything is in SI units. Nothing here knows of fresh concrete, files or the screen.
//!
//! Sources: Kawai 1978; Bolander and Saito, Engineering Fracture Mechanics 61 (1998); Berton and Bolander, Computer Methods in Applied Mechanics and
//! Engineering 195 (2006); Kang, Kim, Lim and Bolander, Cement and Concrete Composites 2014; Svec's thesis (2013), chapter 7.

mod anywhere;
mod beam;
mod bearings;
mod bridge;
mod dense;
pub mod fibres;
mod lattice;
pub mod mesh;
mod nodes;
mod path;
mod plane;
mod pull_out;
mod setup;
mod shear_lag;
mod softening;
mod sparse;
pub mod standard;
mod trial;
mod voronoi;

pub use bridge::BridgeState;
pub use lattice::Lattice;
pub use mesh::{Facet, Mesh};
pub use nodes::Grading;
pub use pull_out::{Bond, PullOut};
pub use setup::{Loading, Reading, Setup, TrialError};
pub use softening::{Law, Softening};
pub use sparse::Singular;
pub use trial::{State, Trial};
