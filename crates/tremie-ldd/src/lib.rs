//! Lagrangian differencing dynamics (LDD) for generalised Newtonian fluids with a free surface (Basic et al. 2021), in a plane or in space.
//!
//! Nodes go with the fluid; what is known of it is known at them, and derivatives are told from few neighbours by finite differences that are exact for linear or quadratic fields on any cloud
//! (`tremie_cloud::Gradients`). A step of dt takes u, p of nodes at x to u', p' there, and the nodes on:
//!
//! ```text
//!     rho (u* - u)/dt = -grad p + rho g + div(2 mu E),   E between u and u*, of stiff fluid that of u*      (module `viscosity`)
//!     lap p' = div(rho u*/dt + grad p),   p' = p at the surface, n . grad p' = rho n . g at walls      (module `pressure`)
//!     u' = u* - dt/rho grad (p' - p),   and what the stress adds to p'
//!     x' = x + dt u', and what keeps nodes apart and as dense as they were (`tremie_cloud::reorder`, `crowding`)
//! ```
//!
//! The paper finds the pressure first, by `lap p' = rho/dt div u`, and then u' with it (`Coupling::PressureFirst`). What the new velocities are not free of divergence by is taken up in the next
//! step; where a step is long for viscosity, as in concrete, walls are then held by wrong pressures.
//!
//! Where the paper is left: the Laplacian is exact for quadratic fields (`Operators::Exact`), because on disordered nodes solutions with that of the paper (`Operators::Paper`) converge with the first order
//! only; stress is implicit with all of its terms, because 2 E grad mu, which the paper takes from the old velocities, is as stiff where fluid yields as what is implicit; and nodes near walls see mirror
//! images behind them (`tremie_cloud::images`) that are projected twice as far as the paper's nodes on the wall, so that the cloud is as even there as elsewhere.
//!
//! Units are SI; in a plane masses and forces are per metre of depth.

mod nodes;
mod plan;
mod pressure;
mod setup;
mod simulation;
mod stencils;
mod viscosity;

pub use nodes::{Coupling, Fluid, Nodes, Operators, Scheme, Stepping};
pub use plan::plan;
pub use simulation::simulation;
