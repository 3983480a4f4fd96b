//! The pressure, which keeps the volume:
//!
//! ```text
//!     lap p' = div(rho u*/dt + grad p),    p' = 0 at the free surface,    n . grad p' = rho n . g at walls
//! ```
//!
//! with u* what the velocities are under the pressure p; in the order of the paper p = 0 and u* = u (Basic 2021, Eq. 17). What the Laplacian sees of a pressure and the divergence of its gradient does not
//! would add up from step to step if only the change of p were found, but if all of it is, the fluid is never quite free of divergence, the less the stiffer it is. So of div grad p the share
//!
//! ```text
//!     s = 1/(1 + 2 d mu dt/(rho D^2))
//! ```
//!
//! is told by the divergence and the rest by the Laplacian (D: spacing): as elements are stabilised that have velocity and pressure at the same nodes (Hughes, Franca and Balestra 1986). Images in walls have the pressure of their nodes and the weight of the fluid between them.

use tremie_cloud::{Block, Failure, Gradients, Matrix, Method, Multigrid, Settings, Source, crowding, solve};
use tremie_numerics::DVec3;

use crate::Fluid;
use crate::stencils::Stencils;

const SETTINGS: Settings = Settings { method: Method::BiCgStab, tolerance: 1e-7, iterations: 500 };
/// Places need not be as exact.
const ROUGHLY: Settings = Settings { tolerance: 1e-2, ..SETTINGS };

/// The problem of Poisson over nodes.
pub(crate) struct Poisson<'a> {
    stencils: &'a Stencils<'a>,
    fluid: &'a Fluid,
    /// Of minus the Laplacian.
    matrix: Matrix,
    multigrid: Multigrid<1, 1>,
    /// What images add to minus the Laplacian by the weight of the fluid up to them, in Pa/m2; none in rows that give a value.
    weights: Vec<Option<f64>>,
    /// Whether there is no surface.
    confined: bool,
}

/// What an image's pressure in Pa is more than that of its node: the weight of the fluid between them.
fn weight(fluid: &Fluid, source: &Source) -> f64 {
    fluid.density * fluid.gravity.dot(source.off)
}

impl<'a> Poisson<'a> {
    /// Over nodes of a fluid.
    pub(crate) fn new(stencils: &'a Stencils<'a>, fluid: &'a Fluid) -> Self {
        let around = stencils.around;
        // Without a surface pressures are known but for a constant.
        let confined = !stencils.surface.contains(&true);
        let given = |a: usize| stencils.surface[a] || (confined && a == 0);
        let row = |a: usize, others: &mut Vec<(u32, Block<1>)>| {
            if given(a) {
                return [[1.0]];
            }
            let mut own = 0.0;
            for (n, _, c) in stencils.pairs(a) {
                let of = around.of(n);
                if of != a {
                    own += c;
                    others.push((of as u32, [[-c]]));
                }
            }
            [[own]]
        };
        let matrix = Matrix::build(around.number, row);
        let weights = around.each(|a| {
            let images = stencils.pairs(a).filter(|(n, ..)| *n >= around.number);
            (!given(a)).then(|| images.map(|(n, _, c)| c * weight(fluid, &around.sources[n])).sum())
        });
        let multigrid = Multigrid::new(&matrix, &around.positions[..around.number], around.spacing);
        Self { stencils, fluid, matrix, multigrid, weights, confined }
    }

    /// Finds the pressures in Pa from those given whose Laplacian is `source`; gives the iterations.
    fn solve(
        &self,
        source: impl Fn(usize) -> f64 + Sync + Send,
        pressures: &mut [f64],
    ) -> Result<usize, Failure> {
        let around = self.stencils.around;
        let mut right = around.each(|a| self.weights[a].map_or(0.0, |weight| weight - source(a)));
        if self.confined {
            // What cannot be met: fluid that appears all over.
            let mean = right.iter().sum::<f64>() / right.len() as f64;
            right.iter_mut().skip(1).for_each(|right| *right -= mean);
            right[0] = 0.0;
        }
        Ok(solve(&self.matrix, Some(&self.multigrid), &right, pressures, &SETTINGS)?.iterations)
    }

    /// The pressures in Pa under which fluid that is about to fall is held by walls.
    pub(crate) fn at_rest(&self) -> Result<Vec<f64>, Failure> {
        let mut pressures = vec![0.0; self.stencils.around.number];
        self.solve(|_| 0.0, &mut pressures)?;
        Ok(pressures)
    }

    /// Finds the `pressures` in Pa that leave velocities in m/s with no more divergence in 1/s than is `wanted`, if others have changed these by their gradients `pushed` in Pa/m in a step in s.
    /// Gives the iterations.
    pub(crate) fn project(
        &self,
        pushed: &[DVec3],
        pressures: &mut [f64],
        velocities: &[DVec3],
        step: f64,
        wanted: &[f64],
        viscosity: &[f64],
    ) -> Result<usize, Failure> {
        let (around, fluid) = (self.stencils.around, self.fluid);
        let rate = fluid.density / step;
        let weight = fluid.density * fluid.gravity;
        let stiff = 2.0 * around.dimension.number() as f64 / (rate * around.spacing * around.spacing);
        let mut bends = vec![0.0; around.number];
        self.matrix.times(pressures, &mut bends);
        let moved: Vec<DVec3> =
            around.mirrored(|source| source.turn * velocities[source.of] + source.carried);
        let pushes: Vec<DVec3> =
            around.mirrored(|source| weight + source.mirror * (pushed[source.of] - weight));
        let source = |a: usize| {
            if self.stencils.mute[a] {
                return 0.0;
            }
            let told = 1.0 / (1.0 + stiff * viscosity[a]);
            let laplacian = self.weights[a].unwrap_or(0.0) - bends[a];
            rate * (self.stencils.divergence(a, &moved) - wanted[a])
                + told * self.stencils.divergence(a, &pushes)
                + (1.0 - told) * laplacian
        };
        self.solve(source, pressures)
    }

    /// Ways in m by which nodes, which go so fast in m/s `past` others, come back to where they fill the volume evenly, in a step in s.
    pub(crate) fn spread(&self, wide: &Gradients, past: &[f64], step: f64) -> Result<Vec<DVec3>, Failure> {
        let (around, stencils) = (self.stencils.around, self.stencils);
        let mut right = crowding(around, wide, &stencils.surface, past, step);
        right
            .iter_mut()
            .zip(&self.weights)
            .for_each(|(of, row)| *of = if row.is_some() { -*of } else { 0.0 });
        let mut values = vec![0.0; around.number];
        solve(&self.matrix, Some(&self.multigrid), &right, &mut values, &ROUGHLY)?;
        let all = around.mirrored(|source| values[source.of]);
        Ok(around.each(|a| stencils.gradient(a, &all)))
    }
}

/// Gradients of pressures, in Pa/m.
pub(crate) fn slopes(stencils: &Stencils, fluid: &Fluid, pressures: &[f64]) -> Vec<DVec3> {
    let all = stencils.around.mirrored(|source| pressures[source.of] + weight(fluid, source));
    stencils.around.each(|a| stencils.gradient(a, &all))
}
