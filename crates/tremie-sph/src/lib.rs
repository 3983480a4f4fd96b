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
//! viscous at rest as in flow, holds for steps of 1e-7 s. The kernel is that of Wendland; walls are mirrors (`tremie_cloud::images`).
//!
//! Where the paper is left, it is to keep the cloud in order and the pressure right: particles that come too near to each other are parted (`tremie_cloud::reorder`) instead of shifted, the smoothing
//! length is 1.5 spacings in a plane instead of 2 to 3, and all operators are corrected for what is missing of the kernel. Steps are of the first order in time.
//!
//! Units are SI; in a plane masses and forces are per metre of depth.

mod particles;
mod plan;
mod plate;
mod pressure;
mod setup;
mod simulation;
mod three_steps;
mod viscosity;

pub use particles::{Fluid, Particles, Stepping};
pub use plan::plan;
pub use plate::Plate;
pub use simulation::simulation;
pub use three_steps::PressureStep;
pub use tremie_cloud::{Space, Wall};
