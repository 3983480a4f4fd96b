//! Incompressible smoothed particle hydrodynamics (ISPH) for generalised Newtonian fluids with a free surface (Wu 2016, after Cummins and Rudman 1999), in a plane or in space.
//!
//! A step of dt takes particles from x, u, p to x', u', p':
//!
//! ```text
//!     u*  = u + dt (g - grad p/rho + div(2 mu E)(u*)/rho)         implicit (module `viscosity`)
//!     x*  = x + dt u*
//!     lap p' (x*) = div(rho u*/dt + grad p),   p' = 0 at the surface      (module `pressure`)
//!     u'  = u* - dt grad (p' - p)/rho
//!     x'  = x + dt (u + u')/2
//! ```
//!
//! The paper leaves p out of the first line. Where a step is long for viscosity, which it is in concrete, that gives wrong pressures at walls, whose fluid the viscous part of the step
//! has already held; with it fluid at rest stays at rest.
//!
//! `mu` is the apparent viscosity at the shear rate sqrt(2 E:E), and E the symmetric part of grad u. The paper takes the stress explicitly, which for its Cross fluid, a thousand times as
//! viscous at rest as in flow, holds for steps of 1e-7 s. Kernels are those of Wendland; walls are mirrors (`tremie_cloud::images`); what divides
//! distances squared has (0.01 h)^2 added, as in the paper.
//!
//! This is a beginning: no case file knows it yet, the smoothing length is the same everywhere, and after a column has fallen over particles stand as near to each other as a quarter
//! of their spacing, where there should be hardly less than half. On a lattice shear along its axes meets 0.96 of the viscosity in a plane and 0.87 in space, as sums over neighbours stand for integrals.
//!
//! Units are SI; in a plane masses and forces are per metre of depth.

mod particles;
mod plan;
mod pressure;
mod setup;
mod simulation;
mod space;
mod surroundings;
mod view;
mod viscosity;

pub use particles::{Fluid, Particles, Stepping};
pub use plan::Plan;
pub use simulation::simulation;
pub use space::{Space, Wall};
