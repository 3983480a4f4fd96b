//! What keeps the volume: the pressure, at the places x* at the end of the step,
//!
//! ```text
//!     lap p' = div(rho u*/dt + grad p),    p' = p at the free surface,    d p'/dn = rho g . n at walls
//! ```
//!
//! As far as inertia counts, all of it is found anew, not only its change: what the Laplacian sees of a pressure and the divergence of its gradient does not would add up from step to step. What a step leaves besides, and what the
//! surface bears, is in `tremie_cloud::stiffness`.
//!
//! Particles are moved back to where they fill the volume evenly, too (`tremie_cloud::crowding`).
//!
//! The Laplacian of Wu (2016, Eq. 20) is wrong for linear fields where part of the kernel is empty, which is two rows of particles below a surface, and wrong everywhere on disordered particles; so
//! the weights of its pairs are corrected to be exact for quadratic fields (`tremie_cloud::Gradients::exact_laplacian`), as those of Lagrangian differencing dynamics are here, or for linear ones where
//! many would be negative. A hydrostatic pressure is exact on any cloud.
//!
//! Such operators are not each other's adjoints as those of the paper are, which alone keeps energy from growing; where neighbours are on one side only a pressure would even drive apart what
//! it should hold together. So whoever has neighbours on one side only is at the surface.

use tremie_cloud::stiffness::Stiffness;
use tremie_cloud::{
    Failure, Gradients, Matrix, Method, Multigrid, Operator, Settings, Source, Surroundings, crowding,
    solve_poisson,
};
use tremie_numerics::DVec3;

use crate::Fluid;

const SETTINGS: Settings = Settings { method: Method::BiCgStab, tolerance: 1e-7, iterations: 500 };
/// chi of `tremie_cloud::stiffness`: radial pairs resist what diverges by three times the viscosity.
const SHARE: f64 = 1.0;
/// Share of the neighbours of a particle at the surface that must not be there for it to have a pressure: between the 0.36 of a thread of three rows and the 0.5 in a corner of right angles, both in a plane.
const INNER: f64 = 0.4;
/// Places need not be as exact.
const ROUGHLY: Settings = Settings { tolerance: 1e-2, ..SETTINGS };

/// What a step's velocities have of divergence, in 1/s, and by how much div grad p is more than lap p, in Pa/m2, of what pushed them.
pub(crate) struct Excess {
    divergence: Vec<f64>,
    rough: Vec<f64>,
}

/// Problems of Poisson over particles, with values that are given at the free surface.
pub(crate) struct Poisson<'a> {
    around: &'a Surroundings,
    fluid: &'a Fluid,
    /// What gradients are formed with.
    pub(crate) gradients: Gradients<'a>,
    /// Which particles are at the free surface.
    pub(crate) surface: Vec<bool>,
    /// Which of them have a pressure.
    bears: Vec<bool>,
    /// Of minus the Laplacian.
    matrix: Matrix,
    multigrid: Multigrid<1, 1>,
    /// What images add to minus the Laplacian of a pressure by the weight of the fluid up to them, in Pa/m2.
    weights: Vec<f64>,
    /// Rows that give a value.
    given: Vec<bool>,
}

/// Which particles at the `surface` have a pressure: in threads, films and spray nearly all are there, and those that are not are too few to hold the others.
pub(crate) fn bears(around: &Surroundings, surface: &[bool]) -> Vec<bool> {
    let sprayed = around.sprayed();
    around.each(|a| {
        let near = around.near.of(a);
        let inner = near.iter().filter(|n| !surface[around.of(**n as usize)]).count();
        surface[a] && !sprayed[a] && inner as f64 > INNER * near.len() as f64
    })
}

/// Weights of the Laplacian at a particle, in the order of its neighbours, in 1/m2; none where it cannot be told.
fn laplacian(around: &Surroundings, gradients: &Gradients, a: usize) -> Option<Vec<f64>> {
    let exact: Option<Vec<f64>> = gradients.exact_laplacian(a).map(Iterator::collect);
    // Its own images tell nothing of a pressure.
    let good = |c: &Vec<f64>| gradients.mostly_positive(a, c, |n| around.of(n) != a);
    exact.filter(good).or_else(|| Some(gradients.laplacian(a)?.collect()))
}

/// What an image's pressure in Pa is more than that of its particle: the weight of the fluid between them.
fn weight(fluid: &Fluid, source: &Source) -> f64 {
    fluid.density * fluid.gravity.dot(source.off)
}

impl<'a> Poisson<'a> {
    /// Over particles of a fluid.
    pub(crate) fn new(around: &'a Surroundings, fluid: &'a Fluid) -> Self {
        let gradients = around.gradients();
        let surface = around.surface(&gradients);
        let bears = bears(around, &surface);
        let row = |a: usize| {
            let weights = (!surface[a]).then(|| laplacian(around, &gradients, a)).flatten();
            let Some(weights) = weights else { return (1.0, Vec::new(), None) };
            let (mut own, mut others, mut right) = (0.0, Vec::<(u32, f64)>::new(), 0.0);
            for ((_, _, source), c) in around.around(a).zip(weights) {
                right += c * weight(fluid, source);
                if source.of != a {
                    own += c;
                    others.push((source.of as u32, -c));
                }
            }
            // In the order of particles, and of the images of each.
            others.sort_by_key(|(of, _)| *of);
            others.dedup_by(|next, kept| {
                let same = next.0 == kept.0;
                kept.1 += if same { next.1 } else { 0.0 };
                same
            });
            (own, others, Some(right))
        };
        let rows = around.each(row);
        let weights = rows.iter().map(|(_, _, right)| right.unwrap_or(0.0)).collect();
        let given = rows.iter().map(|(_, _, right)| right.is_none()).collect();
        let matrix = Matrix::from_rows(rows.into_iter().map(|(own, others, _)| (own, others)));
        let multigrid = Multigrid::new(&matrix, &around.positions[..around.number], around.spacing);
        Self { around, fluid, gradients, surface, bears, matrix, multigrid, weights, given }
    }

    /// Finds `values` whose Laplacian is `source`; those of images are those of their particles, and where they are pressures the weight of the fluid besides. Gives the iterations.
    fn solve(
        &self,
        source: impl Fn(usize) -> f64 + Sync + Send,
        weighs: bool,
        settings: &Settings,
        values: &mut [f64],
    ) -> Result<usize, Failure> {
        let weight = |a: usize| if weighs { self.weights[a] } else { 0.0 };
        let given = |a: usize| if weighs && self.surface[a] { values[a] } else { 0.0 };
        let right = self.around.each(|a| if self.given[a] { given(a) } else { weight(a) - source(a) });
        let any = self.given.contains(&true);
        Ok(solve_poisson(&self.matrix, &self.multigrid, any, &right, values, settings)?.iterations)
    }

    /// The pressures in Pa under which fluid that is about to fall is held by walls.
    pub(crate) fn at_rest(&self) -> Result<Vec<f64>, Failure> {
        let mut pressures = vec![0.0; self.around.number];
        self.solve(|_| 0.0, true, &SETTINGS, &mut pressures)?;
        Ok(pressures)
    }

    /// What velocities in m/s that `pressures` in Pa have changed by their gradients `pushed` in Pa/m have of divergence.
    pub(crate) fn excess(&self, pushed: &[DVec3], pressures: &[f64], velocities: &[DVec3]) -> Excess {
        let around = self.around;
        let all = around.reflected(velocities);
        let weight = self.fluid.density * self.fluid.gravity;
        let pushes = around.mirrored(|source| weight + source.mirror * (pushed[source.of] - weight));
        let mut bends = vec![0.0; around.number];
        self.matrix.times(pressures, &mut bends);
        let divergence = |a: usize, of: &[DVec3]| {
            let l = self.gradients.velocity_gradient(a, of);
            l.x_axis.x + l.y_axis.y + l.z_axis.z
        };
        Excess {
            divergence: around.each(|a| divergence(a, &all)),
            rough: around.each(|a| match self.given[a] {
                true => 0.0,
                false => divergence(a, &pushes) - (self.weights[a] - bends[a]),
            }),
        }
    }

    fn stiffness(&self, step: f64) -> Stiffness {
        let around = self.around;
        Stiffness::new(self.fluid.density, around.spacing, around.dimension.number(), step)
    }

    /// Brings `pressures` in Pa to those that take an excess away in a step in s, by viscosities in Pa s that particles feel. Gives the iterations.
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
            let (divergence, rough) = (excess.divergence[a], excess.rough[a]);
            rate * divergence + stiffness.inertia(viscosity[a]) * rough + (self.weights[a] - bends[a])
        };
        // What pushed may have been borne by somebody.
        self.settle(pressures);
        self.solve(source, true, &SETTINGS, pressures)
    }

    /// By how much in Pa pressures are too large for steps in s to leave no excess by themselves, as far as that can be told particle by particle, by viscosities in Pa s that they feel; none where nobody bears a pressure.
    pub(crate) fn stress(&self, excess: &Excess, viscosity: &[f64], step: f64) -> Vec<f64> {
        let stiffness = self.stiffness(step);
        self.around.each(|a| match self.alone(a) {
            true => 0.0,
            false => stiffness.excess(SHARE, viscosity[a], excess.divergence[a], excess.rough[a]),
        })
    }

    /// Takes off `pressures` in Pa what a `stress` in Pa wants, and at the surface what is left from when viscosities in Pa s were more to a step in s.
    pub(crate) fn follow(&self, pressures: &mut [f64], stress: &[f64], viscosity: &[f64], step: f64) {
        self.stiffness(step).follow(&self.surface, stress, viscosity, pressures);
        self.settle(pressures);
    }

    /// Takes pressures in Pa off those at the surface that have nobody to bear them.
    pub(crate) fn settle(&self, pressures: &mut [f64]) {
        pressures.iter_mut().enumerate().filter(|(a, _)| self.alone(*a)).for_each(|(_, p)| *p = 0.0);
    }

    /// Whether a particle at the surface has nobody to bear a pressure.
    fn alone(&self, a: usize) -> bool {
        self.surface[a] && !self.bears[a]
    }

    /// Ways in m by which particles, which go so fast in m/s `past` others, come back to where they fill the volume evenly, in a step in s.
    pub(crate) fn spread(&self, past: &[f64], step: f64) -> Result<Vec<DVec3>, Failure> {
        let around = self.around;
        let sources = crowding(around, &self.gradients, &self.surface, past, step);
        let source = |a: usize| sources[a];
        let mut values = vec![0.0; around.number];
        self.solve(source, false, &ROUGHLY, &mut values)?;
        let all = around.mirrored(|source| values[source.of]);
        Ok(around.each(|a| self.gradients.gradient(a, &all)))
    }
}

/// Gradients of pressures, in Pa/m.
pub(crate) fn slopes(
    around: &Surroundings,
    gradients: &Gradients,
    fluid: &Fluid,
    pressures: &[f64],
) -> Vec<DVec3> {
    let all = around.mirrored(|source| pressures[source.of] + weight(fluid, source));
    around.each(|a| gradients.gradient(a, &all))
}
