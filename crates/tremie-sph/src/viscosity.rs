//! The viscous part of a step: for the new velocities u
//!
//! ```text
//!     rho/dt (u_a - u_a^n) = F_a + sum_b V 2 (d + 2) mu_ab (u_a - u_b) . x_ab f(r) x_ab / (r^2 + eta^2)
//! ```
//!
//! with `mu_ab` the harmonic mean and F what else pushes, in N/m3; on the right are the new velocities, or where the step is explicit the old ones. The radial form (Monaghan 2005; Espanol and Revenga 2003) stands for
//! div(2 mu E), with what varies of mu, and conserves both momenta.
//!
//! With `f = -W'/r` of the kernel shear along the axes of a lattice would meet 0.89 of the viscosity, as sums over neighbours stand for integrals, and shear at 45 degrees to them as much too much: the
//! nearest neighbours count too much. With `f ~ r^m (1 - r/R)^(9/2)`, R the kernel's support and m = 3 in a plane, 5/2 in space, and the factor that a lattice at rest then needs, it is 0.99 to 1.01 for
//! both, and wherever the rows of a lattice are that slide along each other.
//!
//! Among disordered particles these forces are not zero where the shear rate is even, and what they set in motion makes the fluid too thin, by 1.2 % in Taylor's vortices. So where a particle has neighbours
//! on all sides each is weighed by `1 - x_ab . b_a`, with the b of module `tremie_cloud::operators` for these weights, as in the Laplacian of Lagrangian differencing dynamics: 0.1 %. Right
//! below a surface nothing is changed, or it would not be free of stress.

use rayon::prelude::*;
use tremie_cloud::{Dimension, Failure, Gradients, Matrix, Method, Multigrid, Settings, solve};
use tremie_numerics::{DMat3, DVec3};

use crate::Fluid;
use crate::surroundings::Surroundings;

const SETTINGS: Settings = Settings { method: Method::BiCgStab, tolerance: 1e-6, iterations: 2000 };

/// The share of a smoothing length that is added to distances where they divide (Wu 2016: eta = 0.01 h).
const SOFT: f64 = 0.01;

/// A particle's row of div(2 mu E) with the sign turned: the blocks of particles, and what walls that move push.
struct Row {
    own: DMat3,
    others: Vec<(usize, DMat3)>,
    carried: DVec3,
}

/// div(2 mu E) of particles.
pub(crate) struct System<'a> {
    around: &'a Surroundings,
    rows: Vec<Row>,
}

/// The weight f of a pair so far from each other in m.
fn weight(around: &Surroundings) -> impl Fn(f64) -> f64 + Copy {
    let reach = around.kernel.support();
    let flat = around.dimension == Dimension::Two;
    move |distance: f64| {
        let (r, left) = (distance / reach, (1.0 - distance / reach).max(0.0));
        r * r * if flat { r } else { r.sqrt() } * left.powi(4) * left.sqrt()
    }
}

/// What makes weights even out: b in 1/m of particles that have nobody at the `surface` around them, zero for others.
fn leaning(around: &Surroundings, surface: &[bool]) -> Vec<DVec3> {
    let weight = weight(around);
    let by = |_, _, distance| weight(distance);
    let gradients = Gradients::new(&around.positions, &around.near, around.dimension, by);
    around.each(|a| {
        let below = surface[a] || around.around(a).any(|(_, _, source)| surface[source.of]);
        if below { DVec3::ZERO } else { gradients.leaning(a).unwrap_or(DVec3::ZERO) }
    })
}

/// What a pair of particles, so far in m from each other and so viscous in Pa s, adds to the force, as a matrix to be multiplied with the difference of their velocities.
fn pairs(around: &Surroundings) -> impl Fn(DVec3, f64, f64) -> DMat3 {
    let d = around.dimension.number();
    let weight = weight(around);
    // f r^2 of a lattice sums up to the number of dimensions.
    let whole = around.on_lattice(|r| weight(r) * r * r) / d as f64;
    let constant = around.volume * 2.0 * (d + 2) as f64 / whole;
    let soft = (0.5 * SOFT * around.kernel.support()).powi(2);
    move |x, one, other| {
        let r = x.length();
        let mean = 2.0 * one * other / (one + other);
        let factor = constant * mean * weight(r) / (r * r + soft);
        DMat3::from_cols(factor * x.x * x, factor * x.y * x, factor * x.z * x)
    }
}

impl<'a> System<'a> {
    /// For apparent viscosities in Pa s of particles of which some are at the `surface`.
    pub(crate) fn new(around: &'a Surroundings, surface: &[bool], viscosity: &[f64]) -> Self {
        let pair = pairs(around);
        let lean = leaning(around, surface);
        let row = |a: usize| {
            let (mut own, mut carried) = (DMat3::ZERO, DVec3::ZERO);
            let mut others: Vec<(usize, DMat3)> = Vec::new();
            for (_, x, source) in around.around(a) {
                let block = (1.0 - x.dot(lean[a])) * pair(x, viscosity[a], viscosity[source.of]);
                own += block;
                carried += block * source.carried;
                others.push((source.of, block * source.turn));
            }
            // What comes from images belongs to their particles; in the order of these, and then of the images.
            others.sort_by_key(|(of, _)| *of);
            let mut merged: Vec<(usize, DMat3)> = Vec::with_capacity(others.len());
            for (of, block) in others {
                match merged.last_mut() {
                    _ if of == a => own -= block,
                    Some((last, sum)) if *last == of => *sum -= block,
                    _ => merged.push((of, -block)),
                }
            }
            Row { own, others: merged, carried }
        };
        Self { around, rows: around.each(row) }
    }

    /// Brings velocities in m/s to the end of a step of `step` in s under a `force` in N/m3, all at once; gives the iterations that it took.
    pub(crate) fn diffuse(
        &self,
        fluid: &Fluid,
        force: impl Fn(usize) -> DVec3 + Sync + Send,
        velocities: &mut [DVec3],
        step: f64,
    ) -> Result<usize, Failure> {
        // The components of a plane are x and z.
        let axes: &[usize] = if self.around.dimension == Dimension::Two { &[0, 2] } else { &[0, 1, 2] };
        let (d, rate) = (axes.len(), fluid.density / step);
        let entry = move |block: &DMat3, i: usize, j: usize| block.col(axes[j])[axes[i]];
        let scalar = |n: usize| {
            let (row, a, i) = (&self.rows[n / d], n / d, n % d);
            let beside = (0..d).filter(move |j| *j != i);
            let beside = beside.map(move |j| ((a * d + j) as u32, entry(&row.own, i, j)));
            let others = row
                .others
                .iter()
                .flat_map(move |(of, block)| (0..d).map(move |j| ((of * d + j) as u32, entry(block, i, j))));
            (rate + entry(&row.own, i, i), beside.chain(others))
        };
        let matrix = Matrix::from_rows((0..self.around.number * d).map(scalar));
        let flat = |vectors: Vec<DVec3>| -> Vec<f64> {
            vectors.iter().flat_map(|v| axes.iter().map(move |axis| v[*axis])).collect()
        };
        let right = flat(self.around.each(|a| rate * velocities[a] + force(a) + self.rows[a].carried));
        let mut u = flat(velocities.to_vec());
        let multigrid =
            Multigrid::new(&matrix, &self.around.positions[..self.around.number], self.around.spacing);
        let solved = solve(&matrix, Some(&multigrid), &right, &mut u, &SETTINGS)?;
        for (velocity, u) in velocities.iter_mut().zip(u.chunks_exact(d)) {
            axes.iter().zip(u).for_each(|(axis, u)| velocity[*axis] = *u);
        }
        Ok(solved.iterations)
    }

    /// What walls are pulled by: each with the place in m half-way to an image in it and the force of the pair in N/m3.
    pub(crate) fn pulls(&self, viscosity: &[f64], velocities: &[DVec3]) -> Vec<(usize, DVec3, DVec3)> {
        let (around, pair) = (self.around, pairs(self.around));
        let mut pulls = Vec::new();
        for a in 0..around.number {
            for (_, x, source) in around.around(a) {
                if let Some(wall) = source.wall {
                    let seen = source.turn * velocities[source.of] + source.carried;
                    let block = pair(x, viscosity[a], viscosity[source.of]);
                    pulls.push((wall, around.positions[a] + 0.5 * x, block * (velocities[a] - seen)));
                }
            }
        }
        pulls
    }

    /// The same by the velocities at the beginning of the step; no iterations.
    pub(crate) fn push(
        &self,
        fluid: &Fluid,
        force: impl Fn(usize) -> DVec3 + Sync + Send,
        velocities: &mut [DVec3],
        step: f64,
    ) -> usize {
        let pushes = self.around.each(|a| {
            let row = &self.rows[a];
            let others: DVec3 = row.others.iter().map(|(of, block)| *block * velocities[*of]).sum();
            force(a) + row.carried - row.own * velocities[a] - others
        });
        velocities.par_iter_mut().zip(pushes).for_each(|(u, push)| *u += step / fluid.density * push);
        0
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use tremie_cloud::{Dimension, nodes};
    use tremie_geometry::{Body, Shape};
    use tremie_numerics::DQuat;
    use tremie_rheology::FlowCurve;

    use super::*;
    use crate::Space;

    /// div(2 mu E) in the midst of a lattice, by which the velocity changes in a step, along its axes and at 45 degrees to them.
    #[test]
    fn viscous_forces_are_those_of_the_stress() {
        for (dimension, spacing) in [(Dimension::Two, 0.025), (Dimension::Three, 0.05)] {
            for angle in [0.0, 0.25 * PI] {
                let turn = DQuat::from_rotation_y(angle);
                let found = share(dimension, spacing, |at| turn * at);
                assert!((found - 1.0).abs() < 0.015, "{dimension:?} at {angle}: {found}");
            }
        }
    }

    /// The same where the rows of the lattice have slid along each other.
    #[test]
    fn rows_slide_as_the_viscosity_has_it() {
        for (dimension, spacing) in [(Dimension::Two, 0.025), (Dimension::Three, 0.05)] {
            for slid in [0.2, 0.35, 0.5] {
                let found = share(dimension, spacing, |at| at + slid * (at.z - 0.5 * spacing) * DVec3::X);
                assert!((found - 1.0).abs() < 0.025, "{dimension:?}, by {slid}: {found}");
            }
        }
    }

    /// Share of the viscous force in the midst of a lattice that is put elsewhere.
    fn share(dimension: Dimension, spacing: f64, put: impl Fn(DVec3) -> DVec3) -> f64 {
        let body = Body::Shape(Shape::Box { min: DVec3::splat(-0.5), max: DVec3::splat(0.5) });
        let positions: Vec<DVec3> = nodes(&body, spacing, dimension, 0.0).iter().map(|at| put(*at)).collect();
        let around = Surroundings::new(&positions, &Space::free(dimension, spacing), 0.0, 1.0);
        let fluid = Fluid {
            density: 1000.0,
            curve: FlowCurve::Newtonian { viscosity: 3.0 },
            largest_viscosity: f64::INFINITY,
            gravity: DVec3::ZERO,
            as_printed: false,
        };
        // Free of divergence: (z^2, 0, x^2).
        let viscosity: Vec<f64> = positions.iter().map(|at| 3.0 * (1.0 + 0.5 * at.x)).collect();
        let before: Vec<DVec3> =
            positions.iter().map(|at| DVec3::new(at.z * at.z, 0.0, at.x * at.x)).collect();
        let (mut after, step) = (before.clone(), 0.02);
        let system = System::new(&around, &around.surface(&around.gradients()), &viscosity);
        let solved = system.diffuse(&fluid, |_| DVec3::ZERO, &mut after, step);
        assert!(solved.is_ok(), "{solved:?}");
        let (mut sum, mut whole) = (0.0, 0.0);
        for n in (0..positions.len()).filter(|n| positions[*n].abs().max_element() < 0.2) {
            let at = positions[n];
            // mu lap u + 2 E grad mu
            let exact = 6.0 * (1.0 + 0.5 * at.x) * DVec3::new(1.0, 0.0, 1.0)
                + DVec3::new(0.0, 0.0, 3.0 * (at.x + at.z));
            sum += exact.dot((after[n] - before[n]) * fluid.density / step);
            whole += exact.length_squared();
        }
        sum / whole
    }
}
