//! The pressure, which keeps the volume:
//!
//! ```text
//!     lap p' = div(rho u*/dt + grad p),    p' = p at the free surface,    n . grad p' = rho n . g at walls
//! ```
//!
//! with u* what the velocities are under the pressure p; in the order of the paper p = 0 and u* = u (Basic 2021, Eq. 17). What the Laplacian sees of a pressure and the divergence of its gradient does not
//! would add up from step to step if only the change of p were found, but if all of it is, the fluid is never quite free of divergence, the less the stiffer it is. So of div grad p a share
//! is told by the divergence and the rest by the Laplacian, as elements are stabilised that have velocity and pressure at the same nodes. Images in walls have the pressure of their nodes and the weight of the fluid between them.
//!
//! What a step leaves besides, and what the surface bears, is in `tremie_cloud::stiffness`.

use tremie_cloud::stiffness::Stiffness;
use tremie_cloud::{
    Block, Failure, Gradients, Matrix, Method, Multigrid, Operator, Settings, Source, crowding, solve_poisson,
};
use tremie_numerics::DVec3;

use crate::Fluid;
use crate::stencils::Stencils;

const SETTINGS: Settings = Settings { method: Method::BiCgStab, tolerance: 1e-7, iterations: 500 };
/// Places need not be as exact.
const ROUGHLY: Settings = Settings { tolerance: 1e-2, ..SETTINGS };

/// chi: of the pressure that would stop what diverges, in the midst of even fluid. From 0.7 on what alternates between nodes grows.
const SHARE: f64 = 0.4;

/// What a step's velocities have of divergence too much, in 1/s, and by how much div grad p is more than lap p, in Pa/m2, of what pushed them.
pub(crate) struct Excess {
    divergence: Vec<f64>,
    rough: Vec<f64>,
}

/// The problem of Poisson over nodes.
pub(crate) struct Poisson<'a> {
    pub(crate) stencils: &'a Stencils<'a>,
    fluid: &'a Fluid,
    /// Of minus the Laplacian.
    matrix: Matrix,
    multigrid: Multigrid<1, 1>,
    /// What images add to minus the Laplacian by the weight of the fluid up to them, in Pa/m2; none in rows that give a value.
    weights: Vec<Option<f64>>,
    /// Whether any row gives a value: there is a surface.
    given: bool,
    /// Who has nobody around it that is at the surface.
    deep: Vec<bool>,
}

/// What an image's pressure in Pa is more than that of its node: the weight of the fluid between them.
fn weight(fluid: &Fluid, source: &Source) -> f64 {
    fluid.density * fluid.gravity.dot(source.off)
}

impl<'a> Poisson<'a> {
    /// Over nodes of a fluid.
    pub(crate) fn new(stencils: &'a Stencils<'a>, fluid: &'a Fluid) -> Self {
        let around = stencils.around;
        let row = |a: usize, others: &mut Vec<(u32, Block<1>)>| {
            if stencils.surface[a] {
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
            (!stencils.surface[a])
                .then(|| images.map(|(n, _, c)| c * weight(fluid, &around.sources[n])).sum())
        });
        let multigrid = Multigrid::new(&matrix, &around.positions[..around.number], around.spacing);
        let given = stencils.surface.contains(&true);
        let deep =
            around.each(|a| stencils.near.of(a).iter().all(|n| !stencils.surface[around.of(*n as usize)]));
        Self { stencils, fluid, matrix, multigrid, weights, given, deep }
    }

    /// Finds the pressures in Pa from those given whose Laplacian is `source`; gives the iterations.
    fn solve(
        &self,
        source: impl Fn(usize) -> f64 + Sync + Send,
        pressures: &mut [f64],
    ) -> Result<usize, Failure> {
        let row = |a: usize| self.weights[a].map_or(pressures[a], |weight| weight - source(a));
        let right = self.stencils.around.each(row);
        self.found(&right, pressures, &SETTINGS)
    }

    /// Finds the values, from those given, that the matrix makes a right-hand side of; gives the iterations.
    fn found(&self, right: &[f64], values: &mut [f64], settings: &Settings) -> Result<usize, Failure> {
        Ok(solve_poisson(&self.matrix, &self.multigrid, self.given, right, values, settings)?.iterations)
    }

    /// The pressures in Pa under which fluid that is about to fall is held by walls.
    pub(crate) fn at_rest(&self) -> Result<Vec<f64>, Failure> {
        let mut pressures = vec![0.0; self.stencils.around.number];
        self.solve(|_| 0.0, &mut pressures)?;
        Ok(pressures)
    }

    /// Gives those who do not know their own pressure one: none if nothing presses on them, else that of those around them.
    pub(crate) fn settle(&self, pressures: &mut [f64]) {
        let stencils = self.stencils;
        pressures.iter_mut().zip(&stencils.loose).filter(|(_, loose)| **loose).for_each(|(p, _)| *p = 0.0);
        let between = |a: usize, weight: f64| {
            let others = stencils.pairs(a).map(|(n, _, c)| (stencils.around.of(n), c));
            let sums = |(own, sum): (f64, f64), (of, c): (usize, f64)| (own + c, sum + c * pressures[of]);
            let (own, sum) = others.filter(|(of, _)| *of != a).fold((0.0, weight), sums);
            if own > 0.0 { sum / own } else { pressures[a] }
        };
        let settled = stencils.around.each(|a| match self.weights[a] {
            Some(weight) if stencils.mute[a] => between(a, weight),
            _ => pressures[a],
        });
        pressures.copy_from_slice(&settled);
    }

    /// How far velocities in m/s that `pressures` in Pa have changed by their gradients `pushed` in Pa/m are from the divergence in 1/s that is `wanted`.
    pub(crate) fn excess(
        &self,
        pushed: &[DVec3],
        pressures: &[f64],
        velocities: &[DVec3],
        wanted: &[f64],
    ) -> Excess {
        let (around, stencils) = (self.stencils.around, self.stencils);
        let weight = self.fluid.density * self.fluid.gravity;
        let mut bends = vec![0.0; around.number];
        self.matrix.times(pressures, &mut bends);
        // What images have for friction continues fluid that shears, but diverges where it is drawn along a wall; what mirrors make of velocities does not, but has a kink at the wall, which only
        // neighbours on all sides even out: where a front rolls over a floor it would be driven off.
        let [even, odd] = [around.reflected(velocities), around.velocities(velocities)];
        let moved = |a: usize| if self.deep[a] { &even } else { &odd };
        let pushes: Vec<DVec3> =
            around.mirrored(|source| weight + source.mirror * (pushed[source.of] - weight));
        Excess {
            divergence: around.each(|a| stencils.divergence(a, moved(a)) - wanted[a]),
            rough: around.each(|a| match self.weights[a] {
                Some(weight) => stencils.divergence(a, &pushes) - (weight - bends[a]),
                None => 0.0,
            }),
        }
    }

    fn stiffness(&self, step: f64) -> Stiffness {
        let around = self.stencils.around;
        Stiffness::new(self.fluid.density, around.spacing, around.dimension.number(), step)
    }

    /// Brings `pressures` in Pa to those that take an excess away in a step in s, by viscosities in Pa s. Gives the iterations.
    pub(crate) fn project(
        &self,
        excess: &Excess,
        pressures: &mut [f64],
        viscosity: &[f64],
        step: f64,
    ) -> Result<usize, Failure> {
        let (rate, stiffness) = (self.fluid.density / step, self.stiffness(step));
        let mut bends = vec![0.0; pressures.len()];
        self.matrix.times(pressures, &mut bends);
        let source = |a: usize| {
            let told = stiffness.inertia(viscosity[a]);
            let laplacian = self.weights[a].unwrap_or(0.0) - bends[a];
            match self.stencils.mute[a] {
                true => (1.0 - told) * laplacian,
                false => rate * excess.divergence[a] + told * excess.rough[a] + laplacian,
            }
        };
        self.solve(source, pressures)
    }

    /// By how much in Pa pressures are too large for steps in s to leave no excess by themselves, as far as that can be told node by node, by viscosities in Pa s.
    pub(crate) fn stress(&self, excess: &Excess, viscosity: &[f64], step: f64) -> Vec<f64> {
        let (stencils, stiffness) = (self.stencils, self.stiffness(step));
        stencils.around.each(|a| {
            // Who is mute is told by those around it.
            let answers = !stencils.loose[a] && (stencils.surface[a] || !stencils.mute[a]);
            let (divergence, rough) = (excess.divergence[a], excess.rough[a]);
            if answers { stiffness.excess(SHARE, viscosity[a], divergence, rough) } else { 0.0 }
        })
    }

    /// Takes off `pressures` in Pa what a `stress` in Pa wants, and at the surface what is left from when viscosities in Pa s were more to a step in s.
    pub(crate) fn follow(&self, pressures: &mut [f64], stress: &[f64], viscosity: &[f64], step: f64) {
        self.stiffness(step).follow(&self.stencils.surface, stress, viscosity, pressures);
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
        self.found(&right, &mut values, &ROUGHLY)?;
        let all = around.mirrored(|source| values[source.of]);
        Ok(around.each(|a| stencils.gradient(a, &all)))
    }
}

/// Gradients of pressures, in Pa/m.
pub(crate) fn slopes(stencils: &Stencils, fluid: &Fluid, pressures: &[f64]) -> Vec<DVec3> {
    let all = stencils.around.mirrored(|source| pressures[source.of] + weight(fluid, source));
    stencils.around.each(|a| stencils.gradient(a, &all))
}

/// What pressures in Pa push nodes with, in N/m3: the gradients `slopes` in Pa/m, and at the surface where nothing meets them.
pub(crate) fn forces(stencils: &Stencils, slopes: &[DVec3], pressures: &[f64]) -> Vec<DVec3> {
    stencils.around.each(|a| -slopes[a] - pressures[a] * stencils.open(a))
}
