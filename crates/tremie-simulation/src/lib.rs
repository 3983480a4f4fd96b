//! The contract of all methods, and what is written once against it.
//!
//! A method is a [`Simulation`]: it advances in time, shows itself as a [`Snapshot`], and can be saved and restored
//! to the bit. It does no input or output and never learns which experiment it runs. Gauges, stop rules,
//! writers and checkpoints know only these three things, so that two methods are measured by the same ruler.
//!
//! [`run()`] brings them together: it advances a simulation to its end and fills a [`RunFolder`] with results.
//!
//! Units are SI everywhere.

pub mod bodies;
mod checkpoint;
mod contract;
mod fibres;
mod fields;
mod filling;
mod folder;
pub mod gauges;
pub mod pictures;
mod plan;
mod progress;
pub mod rest;
mod run;
pub mod scattered;
mod schedule;
mod snapshot;
mod summary;
pub mod surface;

pub use checkpoint::Checkpoint;
pub use contract::{Breakdown, Load, RestoreError, Simulation};
pub use filling::{FillingFigures, Pocket};
pub use folder::{FolderError, Machine, RunFolder, RunRecord};
pub use progress::{Observer, Progress};
pub use run::{Outcome, RunError, run};
pub use snapshot::{Cells, Fluid, Lying, Snapshot, SolidLoad, Wall, WallFace, WallLoads};
pub use summary::{EndReason, Summary};
