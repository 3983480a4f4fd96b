//! What the methods without a mesh share: nodes that are scattered over a plane or over space, and what can be told of fields that are known at them.
//!
//! - [`Kernel`]: how much a neighbour counts, by its distance.
//! - [`nodes`]: where there are any at first; [`Neighbours`]: who is near whom; [`at_surface`]: who is at the free surface; [`images`]: what walls show of them, [`copies`]: what is there again beyond periodic sides; [`reorder`]: how those that move stay apart; [`crowding`]: how much denser they stand than they should.
//! - [`Space`] with its walls, and [`Surroundings`]: all of that together at a moment.
//! - [`Gradients`]: derivatives that are exact for linear fields on any cloud, and the Laplacian of Lagrangian differencing dynamics.
//! - [`Matrix`], [`Multigrid`], [`solve`]: linear systems over neighbours, by conjugate gradients with a preconditioner whose cost is linear.
//! - [`stiffness`], [`balance()`]: pressures of fluid so stiff that it follows stresses at once.
//!
//! Positions are in m, in three components; a plane is one of x and z, and y the same everywhere. All sums are taken in a fixed order, so that results are the same to the bit on
//! any number of threads.

mod balance;
mod confined;
mod crowding;
mod curve;
mod kernel;
mod krylov;
mod matrix;
mod mirror;
mod multigrid;
mod neighbours;
mod nodes;
mod operators;
mod order;
mod periodic;
mod sharpen;
mod space;
mod start;
pub mod stiffness;
mod surface;
mod surroundings;

pub use balance::{Balanced, Pressed, balance, else_borne};
pub use confined::solve_poisson;
pub use crowding::crowding;
pub use curve::along_curve;
pub use kernel::{Dimension, Kernel, Smoothing};
pub use krylov::{Failure, Method, Operator, Settings, Solved, solve};
pub use matrix::{Block, Matrix, Number};
pub use mirror::{Image, Standing, images};
pub use multigrid::Multigrid;
pub use neighbours::Neighbours;
pub use nodes::nodes;
pub use operators::Gradients;
pub use order::{Follower, reorder};
pub use periodic::{Copy, copies};
pub use sharpen::sharpened;
pub use space::{Space, Wall};
pub use start::at_start;
pub use surface::at_surface;
pub use surroundings::{Seen, Source, Surroundings};
