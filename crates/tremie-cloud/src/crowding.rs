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
//!
//! n sums weights K of the distances to all particles, its own place among them. As that one is never away from itself while the others are off their places in a lattice, disorder makes n larger where fluid is as dense, by about
//! -s^2 lap K(0) over n0, s^2 being the variance along an axis: with the kernel W itself by 0.9 % in a plane and 1.2 % in space if places are off by up to a fifth of the spacing, and so much the fluid would swell. So K is W (1 + b r^2), which is flat in its middle: 0.1 % are left. Near a surface it is W: what is missing there is known for that, and K hardly sees two particles that lie on each other,
//! as where drops land.

use crate::{Gradients, Smoothing, Surroundings};

/// How much of what particles stand too near to each other or too far apart is taken back, over the smoothing lengths that one goes past others in a step: in the midst of others, and near a surface, where n0 is only roughly
/// known. (What parts those too near to each other swells the fluid where it is drawn out along one axis, as all are then too near to some along another. With 4 everywhere the middle of a sample that a load pressed to a third of its height became
/// 4 % less dense, with 16 by 0.1 %; with 12 and more near the surface, too, the cut through a slump a few particles thin shrank by 1 to 7 %.)
const RELAXES: [f64; 2] = [16.0, 4.0];
/// What of the volume around is missing right below a flat surface, over how one-sided the neighbours are there times the kernel's support.
const MISSING: f64 = 0.1;

/// The weight K by the distance in m from a particle.
fn weight(kernel: &Smoothing) -> impl Fn(f64) -> f64 {
    let near = 1e-6 * kernel.support();
    let flattens = -0.5 * kernel.slope(near) / (near * kernel.weight(0.0));
    move |distance| kernel.weight(distance) * (1.0 + flattens * distance * distance)
}

/// k (n/n0 - 1) of particles of which some are at the `surface`, and which go so fast in m/s `past` others in a step in s.
pub fn crowding(
    around: &Surroundings,
    gradients: &Gradients,
    surface: &[bool],
    past: &[f64],
    step: f64,
) -> Vec<f64> {
    let length = 0.5 * around.kernel.support();
    let kernel = |distance: f64| around.kernel.weight(distance);
    let flattened = weight(&around.kernel);
    let whole = [around.on_lattice(kernel), around.on_lattice(&flattened)];
    let crowd = |a: usize, weight: &dyn Fn(f64) -> f64| {
        let (at, others) = (around.positions[a], around.near.of(a).iter());
        let others = others.map(|n| weight(around.positions[*n as usize].distance(at))).sum::<f64>();
        around.volume * (weight(0.0) + others)
    };
    let crowded = |a: usize| {
        if surface[a] {
            return 0.0;
        }
        let taken = |relaxes: f64| (relaxes * past[a] * step / length).min(1.0);
        let deep = around.near.of(a).iter().all(|n| !surface[around.of(*n as usize)]);
        match gradients.leaning(a) {
            Some(b) if !deep => {
                let missing = MISSING * b.length() * around.kernel.support();
                taken(RELAXES[1]) * (crowd(a, &kernel) / whole[0] - 1.0 + missing)
            }
            _ => taken(RELAXES[0]) * (crowd(a, &flattened) / whole[1] - 1.0),
        }
    };
    around.each(crowded)
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_pcg::Pcg64Mcg;
    use tremie_geometry::{Body, Shape};
    use tremie_numerics::DVec3;

    use super::*;
    use crate::{Dimension, Kernel, Neighbours, nodes};

    /// n/n0 - 1 in the mean of nodes that fill space evenly but for being off a lattice by up to a fifth of its spacing.
    #[test]
    fn disorder_is_not_crowding() {
        for (dimension, length) in [(Dimension::Two, 1.5), (Dimension::Three, 1.3)] {
            let (spacing, number) = (0.1, if dimension == Dimension::Two { 100.0 } else { 24.0 });
            let size = DVec3::splat(0.5 * spacing * number);
            let full = Body::Shape(Shape::Box { min: -size, max: size });
            let mut random = Pcg64Mcg::seed_from_u64(5);
            let mut off = || 0.2 * spacing * random.random_range(-1.0..1.0);
            let flat = dimension == Dimension::Two;
            let places = nodes(&full, spacing, dimension, 0.0);
            let shaken: Vec<DVec3> = places
                .iter()
                .map(|at| at + DVec3::new(off(), if flat { 0.0 } else { off() }, off()))
                .collect();
            let kernel = Smoothing::new(Kernel::Wendland, dimension, length * spacing);
            let near = Neighbours::within(&shaken, kernel.support());
            let inside = |at: &DVec3| at.abs().max_element() < size.x - kernel.support();
            let mean = |weight: &dyn Fn(f64) -> f64| {
                let sum = |n: usize, at: &[DVec3], near: &Neighbours| {
                    let others = near.of(n).iter().map(|m| weight(at[*m as usize].distance(at[n])));
                    weight(0.0) + others.sum::<f64>()
                };
                let still = Neighbours::within(&places, kernel.support());
                let all: Vec<usize> = (0..places.len()).filter(|n| inside(&places[*n])).collect();
                let shares = all.iter().map(|n| sum(*n, &shaken, &near) / sum(*n, &places, &still) - 1.0);
                shares.sum::<f64>() / all.len() as f64
            };
            let (plain, flattened) = (mean(&|r| kernel.weight(r)), mean(&weight(&kernel)));
            assert!(plain > 8e-3, "{dimension:?}: {plain}");
            assert!(flattened.abs() < 2e-3, "{dimension:?}: {flattened}");
        }
    }
}
