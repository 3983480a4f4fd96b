//! The contract of all methods, and what is written once against it.
//!
//! A method is a [`Simulation`]: it advances in time, shows itself as a [`Snapshot`], and can be saved and restored
//! to the bit. It does no input or output and never learns which experiment it runs. Gauges, stop rules,
//! writers and checkpoints know only these three things, so that two methods are measured by the same ruler.
//!
//! Units are SI everywhere.

mod contract;
mod snapshot;

pub use contract::{Breakdown, Load, RestoreError, Simulation};
pub use snapshot::{Cells, Fluid, Snapshot};
