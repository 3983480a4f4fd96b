//! What methods without a mesh share: nodes of a fluid that a case puts between walls, what is known of a run beforehand, and how gauges and writers see them.

mod plan;
mod setup;
mod view;

pub use plan::Plan;
pub use setup::{dimension, largest_viscosity, nodes, pressed_speed, space};
pub use view::{Pull, Scattered};
