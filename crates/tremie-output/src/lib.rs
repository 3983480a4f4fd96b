//! Files: VTK images and surfaces, time series, checkpoints and pictures.
//!
//! This crate knows arrays and how they are laid out in files, and nothing of the method that filled them. Lengths
//! are in metres and times in seconds; a field's name carries its unit ("pressure \[Pa\]"). Arrays over a grid have x
//! running fastest, then y, then z. A file that replaces another is written aside and renamed, so that a reader
//! never sees half of it.

#[cfg(target_endian = "big")]
compile_error!("arrays are copied to little-endian files as they lie in memory");

pub mod atomic;
mod error;
pub mod packing;
pub mod picture;
pub mod pvd;
pub mod series;
pub mod state;
pub mod table;
pub mod vti;
mod vtk;
pub mod vtp;

pub use error::{Error, StateFault};
pub use vtk::{Field, Values};
