//! Which nodes lie at the free surface.
//!
//! The sum of `V_j (x_j - x_i) . grad W` is the number of dimensions inside of the cloud, and less where part of the kernel is empty (Lee et al. 2008). What is
//! below [`SPARSE`] of that may also be a hole between nodes in the midst of others: at the surface there is nobody in a cone that opens away from
//! the neighbours (Marrone et al. 2010).

use rayon::prelude::*;
use tremie_numerics::DVec3;

use crate::{Dimension, Neighbours, Smoothing};

/// Share of the number of dimensions below which a node may be at the surface.
const SPARSE: f64 = 0.75;
/// Cosine of half of the cone's opening of 60 degrees.
const CONE: f64 = 0.866;

/// Whether each node is at the surface; `near` holds the neighbours within the kernel's support, and each node stands for `volume` (in a plane: area).
///
/// Walls count as empty, unless what mirrors them is among the nodes.
pub fn at_surface(
    positions: &[DVec3],
    near: &Neighbours,
    kernel: &Smoothing,
    volume: f64,
    dimension: Dimension,
) -> Vec<bool> {
    let of = |i: usize| {
        let ways = || near.of(i).iter().map(|j| positions[*j as usize] - positions[i]);
        let whole: f64 = ways().map(|x| -volume * kernel.slope(x.length()) * x.length()).sum();
        if whole >= SPARSE * dimension.number() as f64 {
            return false;
        }
        let inward: DVec3 = ways().map(|x| kernel.weight(x.length()) * x).sum();
        ways().all(|x| x.dot(-inward) < CONE * x.length() * inward.length()) || inward == DVec3::ZERO
    };
    (0..positions.len()).into_par_iter().with_min_len(64).map(of).collect()
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_pcg::Pcg64Mcg;
    use tremie_geometry::{Body, Shape};

    use super::*;
    use crate::{Kernel, nodes};

    /// A box with a hole for one node and a drop beside it, disordered by a tenth of the spacing.
    #[test]
    fn the_outermost_nodes_are_the_surface() {
        for dimension in [Dimension::Two, Dimension::Three] {
            let (size, spacing) = (DVec3::splat(0.5), 0.05);
            let tank = Body::Shape(Shape::Box { min: -size, max: size });
            let mut random = Pcg64Mcg::seed_from_u64(3);
            let middle = |at: DVec3| at.abs().max_element() < 0.6 * spacing && at.min_element() > -1e-9;
            let lattice = nodes(&tank, spacing, dimension);
            let lattice: Vec<DVec3> = lattice.into_iter().filter(|at| !middle(*at)).collect();
            let mut shaken: Vec<DVec3> = lattice
                .iter()
                .map(|at| {
                    let mut off = || 0.1 * spacing * random.random_range(-1.0..1.0);
                    let off = DVec3::new(off(), off(), off());
                    at + if dimension == Dimension::Two { off.with_z(0.0) } else { off }
                })
                .collect();
            shaken.push(DVec3::new(3.0, 0.0, 0.0));
            let length = if dimension == Dimension::Two { 2.0 } else { 1.3 } * spacing;
            let kernel = Smoothing::new(Kernel::Wendland, dimension, length);
            let near = Neighbours::within(&shaken, kernel.support());
            let volume = spacing.powi(dimension.number() as i32);
            let found = at_surface(&shaken, &near, &kernel, volume, dimension);
            let flat = if dimension == Dimension::Two { DVec3::new(1.0, 1.0, 0.0) } else { DVec3::ONE };
            for (at, found) in lattice.iter().zip(&found) {
                let outermost = (*at * flat).abs().max_element() > 0.5 - 0.6 * spacing;
                assert_eq!(*found, outermost, "{dimension:?} {at}");
            }
            assert_eq!(found.last(), Some(&true));
        }
    }
}
