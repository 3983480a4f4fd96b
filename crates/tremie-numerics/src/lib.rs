//! What all of Tremie computes with: vectors, roots, small systems of equations, and sums whose result does not depend on the number of threads.
//!
//! Vectors are those of `glam`, re-exported here once so that the whole workspace agrees on one version.

pub use glam::{DMat3, DQuat, DVec2, DVec3, DVec4, EulerRot, Vec4};

pub mod definite;
pub mod root;
pub mod sum;
