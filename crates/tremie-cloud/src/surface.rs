//! Which nodes lie at the free surface.
//!
//! Where neighbours are missing on one side, `b_i = B_i sum g_ij x_ij` (module `operators`) points to the others. With weights -W'/r of Wendland's kernel over three spacings, b times the kernel's
//! support is 2.5 in the outermost row of a square lattice, 0.3 in the one below it and 0 inside; on nodes that are off it by up to 0.4 of their spacing at random, 99 of 100 have less than 0.9.
//! It is simpler than the number of neighbours, which is as small in holes, with a cone in which there is nobody (Lee et al. 2008; Marrone et al. 2010), and does not
//! take for inside what stands alone before others.

use rayon::prelude::*;

use crate::Gradients;

/// One-sidedness over the kernel's support from which on a node is at the surface.
const LEANS: f64 = 1.6;

/// Whether each node is at the surface, by gradients whose weights reach as far as `support` in m; so are those whose neighbours are too few to tell.
///
/// Walls count as empty, unless what mirrors them is among the nodes.
pub fn at_surface(gradients: &Gradients, support: f64) -> Vec<bool> {
    let leans = |i: usize| gradients.leaning(i).is_none_or(|b| b.length() * support > LEANS);
    (0..gradients.len()).into_par_iter().with_min_len(64).map(leans).collect()
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_pcg::Pcg64Mcg;
    use tremie_geometry::{Body, Shape};
    use tremie_numerics::DVec3;

    use super::*;
    use crate::{Dimension, Kernel, Neighbours, Smoothing, nodes};

    /// A box with a hole for one node and a drop beside it, disordered by a tenth of the spacing.
    #[test]
    fn the_outermost_nodes_are_the_surface() {
        for dimension in [Dimension::Two, Dimension::Three] {
            let (size, spacing) = (DVec3::splat(0.5), 0.05);
            let tank = Body::Shape(Shape::Box { min: -size, max: size });
            let mut random = Pcg64Mcg::seed_from_u64(3);
            let middle = |at: DVec3| at.abs().max_element() < 0.6 * spacing && at.min_element() > -1e-9;
            let lattice = nodes(&tank, spacing, dimension, 0.0);
            let lattice: Vec<DVec3> = lattice.into_iter().filter(|at| !middle(*at)).collect();
            let mut shaken: Vec<DVec3> = lattice
                .iter()
                .map(|at| {
                    let mut off = || 0.1 * spacing * random.random_range(-1.0..1.0);
                    let off = DVec3::new(off(), off(), off());
                    at + if dimension == Dimension::Two { off.with_y(0.0) } else { off }
                })
                .collect();
            shaken.push(DVec3::new(3.0, 0.0, 0.0));
            let length = if dimension == Dimension::Two { 2.0 } else { 1.3 } * spacing;
            let kernel = Smoothing::new(Kernel::Wendland, dimension, length);
            let near = Neighbours::within(&shaken, kernel.support());
            let volume = spacing.powi(dimension.number() as i32);
            let weight = |_: usize, _: usize, r: f64| -volume * kernel.slope(r) / r;
            let gradients = Gradients::new(&shaken, &near, dimension, weight);
            let found = at_surface(&gradients, kernel.support());
            let flat = if dimension == Dimension::Two { DVec3::new(1.0, 0.0, 1.0) } else { DVec3::ONE };
            for (at, found) in lattice.iter().zip(&found) {
                let outermost = (*at * flat).abs().max_element() > 0.5 - 0.6 * spacing;
                assert_eq!(*found, outermost, "{dimension:?} {at}");
            }
            assert_eq!(found.last(), Some(&true));
        }
    }
}
