//! Shapes by signed distance: where fluid starts, where solids stand, and how they move.
//!
//! A [`Shape`] answers one question, [`Shape::signed_distance`] (metres, negative inside); everything else about
//! it follows from that. A [`Body`] is a shape or a [`mesh`], or made from several. A [`Motion`] says where it is at a time.
//! A [`Face`] is what fluid comes in through.
//! [`isosurface`] goes the other way: from values on a grid to the surface they describe.

mod body;
mod face;
pub mod isosurface;
pub mod mesh;
mod motion;
mod shape;
mod tree;

pub use body::{Body, Union};
pub use face::{Face, Outline};
pub use motion::{Motion, Waypoint};
pub use shape::{Shape, share};

/// Share of the coordinates around it that a distance from a surface is by rounding: less than that away, nothing tells the normal but the surface.
const ROUNDING: f64 = 1e-12;
