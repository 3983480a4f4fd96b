//! The program: commands, progress and the virtual laboratory, over the libraries of the workspace.
//!
//! This is the only crate that prints.

mod cli;
pub mod validate;

pub use cli::main;
