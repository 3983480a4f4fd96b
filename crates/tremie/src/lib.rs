//! The program: commands, progress and the virtual laboratory, over the libraries of the workspace.
//!
//! This is the only crate that prints, and only `terminal` does it. Results go to standard output; progress,
//! warnings and errors to standard error. What a command computes runs in one pool of threads (`cli`). A run, whether
//! started from a case file, resumed or set up by the laboratory, goes through one door, `run::Job`.
//!
//! Exit codes: 0 done, 1 failed (the numbers broke down, a benchmark failed), 2 wrong input or arguments, 130
//! interrupted.

mod bench;
mod calc;
mod check;
mod cli;
mod compare;
mod export;
mod failure;
mod fibres;
mod fracture;
mod gaps;
mod interrupt;
mod lab;
mod last_state;
mod numbers;
mod pace;
mod plan;
mod progress;
mod quantities;
mod report;
mod run;
mod schema;
mod template;
mod terminal;
pub mod validate;

pub use cli::main;
