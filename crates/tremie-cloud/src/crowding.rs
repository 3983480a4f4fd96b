//! How much denser particles stand than in a lattice, and how much of it a step takes back.
//!
//! Velocities without divergence do not keep particles as dense as they were: what is left of errors adds up, and who is parted from others goes where there is room. So particles are moved back
//! besides, as incompressible fluids are in which places are projected, too (Hu and Adams 2007): by
//!
//! ```text
//!     dx = grad phi,    lap phi = k (n/n0 - 1),    phi = 0 at the free surface,    d phi/dn = 0 at walls
//! ```
//!
//! with n the share of the volume around that particles stand for, n0 that of a lattice, less right below a surface, and k the share that is taken back, as large as the way that a particle goes past others: what is at rest, or moves as a solid does, stays as it is.

use crate::{Gradients, Surroundings};

/// How much of what particles stand too near to each other or too far apart is taken back, over the smoothing lengths that one goes past others in a step: all of it in steps of the usual length.
const RELAXES: f64 = 4.0;
/// What of the volume around is missing right below a flat surface, over how one-sided the neighbours are there times the kernel's support.
const MISSING: f64 = 0.1;

/// k (n/n0 - 1) of particles of which some are at the `surface`, and which go so fast in m/s `past` others in a step in s.
pub fn crowding(
    around: &Surroundings,
    gradients: &Gradients,
    surface: &[bool],
    past: &[f64],
    step: f64,
) -> Vec<f64> {
    let length = 0.5 * around.kernel.support();
    let whole = around.on_lattice(|r| around.kernel.weight(r));
    let crowded = |a: usize| {
        let deep = || around.near.of(a).iter().all(|n| !surface[around.of(*n as usize)]);
        let full = match gradients.leaning(a) {
            _ if surface[a] => return 0.0,
            Some(b) if !deep() => 1.0 - MISSING * b.length() * around.kernel.support(),
            _ => 1.0,
        };
        around.crowd(a) / whole - full
    };
    let taken = |a: usize| (RELAXES * past[a] * step / length).min(1.0);
    let mut all = around.each(|a| taken(a) * crowded(a));
    // Without a surface the volume cannot change.
    if !surface.contains(&true) {
        let mean = all.iter().sum::<f64>() / all.len() as f64;
        all.iter_mut().for_each(|of| *of -= mean);
    }
    all
}
