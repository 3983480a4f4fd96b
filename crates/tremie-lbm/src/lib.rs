//! Free-surface lattice Boltzmann for generalised Newtonian fluids (after Svec 2013, chapter 2).
//!
//! The fluid lives on cubic cells; each carries 19 populations of particles that stream to the neighbouring
//! cells and collide. Density and momentum are their moments, and so is the stress, from which the flow curve gives
//! the relaxation rate without differences between cells and without iteration (`relaxation`). The free surface is
//! followed by the mass of interface cells (`transport`, `plane`, `surface`).
//!
//! A step, in `simulation`: blocks stream and collide (`stream`, `collision`), interface cells that fill up or run
//! dry are converted (`surface`), rows of cells are sorted by what they touch (`rows`), and the surface is found anew
//! (`plane`). Solids cover and uncover cells (`sweep`); fluid comes in by `inlet` and leaves by `outlet`. Storage is `grid`,
//! neighbours are `topology`.
//!
//! Inside, everything is in lattice units (cell, step and density are 1); the door speaks SI ([`Scaling`]).

mod adapt;
mod ahead;
mod cage;
mod carried;
mod carrier;
mod collision;
mod contact;
mod delta;
mod fibre_field;
mod fluid;
mod friction;
mod grid;
mod immersed;
mod initial;
mod inlet;
mod lanes;
mod lattice;
mod loads;
mod outlet;
mod passage;
mod plan;
mod plane;
mod plate;
mod processor;
mod real;
mod relaxation;
mod rise;
mod rows;
mod scaling;
mod simulation;
mod slanted;
mod solids;
mod source;
mod spread;
mod standing;
mod sticking;
mod store;
mod stream;
mod structure;
mod support;
mod surface;
mod sweep;
mod table;
mod tabulated;
mod tension;
mod textbook;
mod together;
mod topology;
mod transport;
mod values;
mod view;
mod wall;
mod window;
mod yielding;

pub use plan::Plan;
pub use real::{Number, Real};
pub use relaxation::{Bingham, Relaxation};
pub use scaling::{Flow, Limits, Scaling, time_step};
pub use simulation::{LatticeBoltzmann, lattice_boltzmann, simulation, simulation_with};
pub use tabulated::Tabulated;
