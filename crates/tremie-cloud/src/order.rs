//! Order among nodes that move: none nearer to each other than they should be.
//!
//! With the kernel W of Lagrangian differencing dynamics over 1.6 spacings, `n_i = sum W_ij`, and n0 that of a lattice, nodes are moved until `C_i = n_i/n0 - 1` is not positive any more
//! (position-based dynamics: Macklin and Mueller 2013; Basic 2021, section 2.6):
//!
//! ```text
//!     lambda_i = -C_i / (sum_j |g_ij|^2 + |sum_j g_ij|^2 + eps),     g_ij = grad W_ij/n0
//!     dx_i = sum_j (lambda_i + lambda_j) g_ij
//! ```
//!
//! in sweeps over all nodes at once. Where there are too few nodes, at the surface, nothing draws them together. The kernel has a slope in its middle, so that nodes at almost the same place part. Nodes
//! at a surface may be held back from going outward, or those inside would push them out bit by bit, and the fluid would swell.

use rayon::prelude::*;
use tremie_numerics::{DMat3, DVec3};

use crate::{Dimension, Kernel, Neighbours, Smoothing};

/// The kernel's support in spacings.
const REACH: f64 = 1.6;
/// What is added to the sum of squares of slopes, over spacing^-2: weak constraints move nodes little.
const SOFT: f64 = 0.01;
/// How much more than n0 is let pass: disordered nodes have more neighbours nearby than a lattice has, where they stand as densely.
const SLACK: f64 = 0.05;
/// Share of a spacing that a node may be moved in a sweep.
const MOST: f64 = 0.1;

/// A node that follows another one, as images in walls do: its number, and what becomes of the other's way.
#[derive(Debug, Clone, Copy)]
pub struct Follower {
    /// The node that it follows.
    pub of: usize,
    /// Its way is this times that of the other.
    pub turn: DMat3,
}

/// How far in m each node is to be moved, so many sweeps long, at most as far as `most` in m tells, and not along `outward`, a unit vector out of the fluid where there is a surface that must not
/// swell, zero elsewhere.
///
/// The first nodes are those that have neighbours listed, within 1.6 spacings at least; all others follow.
pub fn reorder(
    positions: &[DVec3],
    near: &Neighbours,
    followers: &[Follower],
    spacing: f64,
    dimension: Dimension,
    most: &[f64],
    outward: &[DVec3],
    sweeps: usize,
) -> Vec<DVec3> {
    let kernel = Smoothing::new(Kernel::Cubic, dimension, REACH * spacing);
    let number = near.len();
    let reach = kernel.support() + MOST * spacing;
    let near = near.nearer(positions, reach);
    // Nearest and next to nearest neighbours in a lattice, and in space also those across a face of a cube.
    let (first, second) = if dimension == Dimension::Two { (4.0, 4.0) } else { (6.0, 12.0) };
    let whole = first * kernel.weight(spacing) + second * kernel.weight(2f64.sqrt() * spacing);
    let soft = SOFT / (spacing * spacing);
    let each = || (0..number).into_par_iter().with_min_len(64);
    let mut at = positions.to_vec();
    let mut ways = vec![DVec3::ZERO; number];
    for _ in 0..sweeps {
        // Slope of W at a node by its own place.
        let slope = |a: usize, b: usize| {
            let x = at[a] - at[b];
            let r = x.length();
            if r > 0.0 { kernel.slope(r) / (whole * r) * x } else { DVec3::ZERO }
        };
        let constraint = |a: usize| {
            let others = || near.of(a).iter().map(|b| *b as usize);
            let crowd: f64 = others().map(|b| kernel.weight(at[a].distance(at[b]))).sum();
            let too_much = (crowd / whole - 1.0 - SLACK).max(0.0);
            if too_much == 0.0 {
                return 0.0;
            }
            let (squares, sum) = others()
                .map(|b| slope(a, b))
                .fold((0.0, DVec3::ZERO), |(squares, sum), g| (squares + g.length_squared(), sum + g));
            -too_much / (squares + sum.length_squared() + soft)
        };
        let factors: Vec<f64> = each().map(constraint).collect();
        let factor = |b: usize| factors[if b < number { b } else { followers[b - number].of }];
        let moved = |a: usize| {
            let mut way = DVec3::ZERO;
            for b in near.of(a).iter().map(|b| *b as usize) {
                let by = factors[a] + factor(b);
                if by != 0.0 {
                    way += by * slope(a, b);
                }
            }
            let way = ways[a] + way.clamp_length_max(MOST * spacing);
            (way - way.dot(outward[a]).max(0.0) * outward[a]).clamp_length_max(most[a])
        };
        ways = each().map(moved).collect();
        at.par_iter_mut().enumerate().for_each(|(n, at)| {
            *at = positions[n]
                + match n.checked_sub(number) {
                    None => ways[n],
                    Some(follower) => followers[follower].turn * ways[followers[follower].of],
                };
        });
    }
    ways
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_pcg::Pcg64Mcg;
    use tremie_geometry::{Body, Shape};

    use super::*;
    use crate::nodes;

    /// Smallest distance between nodes in spacings, after some sweeps, on a lattice that was shaken by a share of its spacing.
    fn least(dimension: Dimension, jitter: f64, sweeps: usize) -> f64 {
        let spacing = 0.05;
        let full = Body::Shape(Shape::Box { min: DVec3::splat(-0.5), max: DVec3::splat(0.5) });
        let mut random = Pcg64Mcg::seed_from_u64(17);
        let mut positions = nodes(&full, spacing, dimension, 0.0);
        for at in &mut positions {
            let [x, z, y] = [(); 3].map(|()| jitter * spacing * random.random_range(-1.0..1.0));
            *at += if dimension == Dimension::Two { DVec3::new(x, 0.0, z) } else { DVec3::new(x, y, z) };
        }
        let near = Neighbours::within(&positions, 2.0 * spacing);
        let most = vec![spacing; positions.len()];
        let free = vec![DVec3::ZERO; positions.len()];
        let ways = reorder(&positions, &near, &[], spacing, dimension, &most, &free, sweeps);
        positions.iter_mut().zip(ways).for_each(|(at, way)| *at += way);
        let near = Neighbours::within(&positions, 2.0 * spacing);
        let nearest = |n: usize| {
            near.of(n).iter().map(|m| positions[n].distance(positions[*m as usize])).fold(f64::MAX, f64::min)
        };
        (0..positions.len()).map(nearest).fold(f64::MAX, f64::min) / spacing
    }

    #[test]
    fn crowded_nodes_part() {
        for dimension in [Dimension::Two, Dimension::Three] {
            assert_eq!(least(dimension, 0.0, 5), least(dimension, 0.0, 0));
            for (jitter, distance) in [(0.2, 0.65_f64), (0.45, 0.5)] {
                let (before, after) = (least(dimension, jitter, 0), least(dimension, jitter, 10));
                assert!(after > distance.max(before), "{dimension:?} {jitter}: from {before} to {after}");
            }
        }
    }
}
