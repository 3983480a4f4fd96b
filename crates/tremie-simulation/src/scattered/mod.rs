//! What methods without a mesh share: nodes of a fluid that a case puts between walls, what is known of a run beforehand, how it runs, and how gauges and writers see it.

mod plan;
mod running;
mod setup;
mod view;

pub use plan::Plan;
pub use running::{Cloud, Known, Running};
pub use setup::{dimension, largest_viscosity, nodes, space};
pub use view::Pull;
