//! Rigid inclusions: aggregates and fibres that feel a fluid and are felt by it.
//!
//! [`Inclusions`] are the bodies, as arrays. The fluid is only a trait here, a [`Carrier`]: anything that can say how fast it moves at a point
//! and take a force there. What bodies can touch besides each other is another, [`Walls`]. [`Contacts`] keeps them out of each other.
//! Everything is in SI units.

mod carrier;
mod confined;
mod contact;
mod distance;
mod distribution;
mod entrance;
mod folgar_tucker;
mod form;
mod friction;
mod impulse;
mod inclusions;
mod motion;
mod near_wall;
mod neighbours;
pub mod orientation;
mod placement;
mod regions;
mod response;
mod separation;
mod suspension;
mod walls;

pub use carrier::{Carrier, Push, Seen};
pub use confined::confined;
pub use contact::{ContactLaw, Contacts, Film};
pub use distribution::Distribution;
pub use entrance::{Entrant, Opening, passes};
pub use folgar_tucker::{Closure, FolgarTucker, admissible, interaction_coefficient, shape_factor};
pub use form::Form;
pub use friction::{Coupling, Felt, hold, svec_correction};
pub use inclusions::{Inclusions, Kind};
pub use motion::Scheme;
pub use placement::{Amount, AtWalls, Direction, Order, PlacementError, Region, place};
pub use response::Response;
pub use suspension::{Freedom, Method, Suspension};
pub use walls::{Flat, Periods, Wall, Walls};
