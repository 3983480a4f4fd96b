//! Velocities and pressures of stiff fluid, which must be found together: the pressures p under which the viscous part of a step, u = V(p), leaves no excess s of pressure by itself (`Poisson::stress`).
//!
//! s is as good as linear in p. From round to round p falls by s, as Uzawa has it, but as far as leaves least of s, and by directions in which it has not fallen before (generalised conjugate residuals; Eisenstat, Elman
//! and Schultz 1983): where viscosities differ by orders of magnitude between neighbours, and at the foot of a front, a fixed share of s would be too much somewhere, and grow.

use tremie_cloud::Failure;
use tremie_numerics::DVec3;

use crate::Fluid;
use crate::pressure::{self, Excess, Poisson};
use crate::stencils::Stencils;
use crate::viscosity::Viscous;

/// Rounds at most, and what share of itself the pressure may be wrong by.
const ROUNDS: usize = 5;
const SMALL: f64 = 0.05;

/// What a step has to balance.
pub(crate) struct Balance<'a> {
    pub(crate) stencils: &'a Stencils<'a>,
    pub(crate) poisson: &'a Poisson<'a>,
    pub(crate) fluid: &'a Fluid,
    pub(crate) step: f64,
}

/// What pushed velocities, by gradients in Pa/m, and what is left of excess, with what pressures in Pa may still fall by; and iterations that it took.
pub(crate) struct Found {
    pub(crate) pushed: Vec<DVec3>,
    pub(crate) excess: Excess,
    pub(crate) stress: Vec<f64>,
    pub(crate) iterations: usize,
}

/// A way that has been tried: changes of pressures in Pa and velocities in m/s, and of the stress in Pa.
type Tried = (Vec<f64>, Vec<DVec3>, Vec<f64>);

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn add(to: &mut [f64], share: f64, of: &[f64]) {
    to.iter_mut().zip(of).for_each(|(to, of)| *to += share * of);
}

fn add_vectors(to: &mut [DVec3], share: f64, of: &[DVec3]) {
    to.iter_mut().zip(of).for_each(|(to, of)| *to += share * *of);
}

impl Balance<'_> {
    /// Brings velocities in m/s to the end of the step, and pressures in Pa to those under which they are, by viscosities in Pa s that nodes feel at shear rates in 1/s; they are to have the divergence
    /// in 1/s that is `wanted` of them.
    pub(crate) fn find(
        &self,
        system: &dyn Viscous,
        pressures: &mut [f64],
        velocities: &mut Vec<DVec3>,
        felt: &[f64],
        shear_rates: &[f64],
        wanted: impl Fn(&[DVec3]) -> Vec<f64>,
    ) -> Result<Found, Failure> {
        let (stencils, poisson) = (self.stencils, self.poisson);
        let weight = self.fluid.density * self.fluid.gravity;
        let mut iterations = 0;
        let mut solve = |pressures: &[f64], velocities: &mut Vec<DVec3>| {
            let pushed = pressure::slopes(stencils, self.fluid, pressures);
            let forces = pressure::forces(stencils, &pushed, pressures);
            let forces: Vec<DVec3> = forces.into_iter().map(|force| weight + force).collect();
            iterations += system.advance(&forces, velocities)?;
            Ok(pushed)
        };
        let mut pushed = solve(pressures, velocities)?;
        let wanted = wanted(velocities);
        let left = |pushed: &[DVec3], pressures: &[f64], velocities: &[DVec3]| {
            let excess = poisson.excess(pushed, pressures, velocities, &wanted);
            let stress = poisson.stress(&excess, felt, self.step);
            (excess, stress)
        };
        // Where pressures are none, as in channels, what does not diverge bears stress, too.
        let shear: f64 =
            felt.iter().zip(shear_rates).map(|(viscosity, rate)| (viscosity * rate).powi(2)).sum();
        let is_small = |stress: &[f64], pressures: &[f64]| {
            dot(stress, stress) <= SMALL * SMALL * (dot(pressures, pressures) + shear)
        };
        let (mut excess, mut stress) = left(&pushed, pressures, velocities);
        let mut tried: Vec<Tried> = Vec::new();
        while tried.len() < ROUNDS && !is_small(&stress, pressures) {
            let (mut p, mut u) = (pressures.to_owned(), velocities.clone());
            add(&mut p, -1.0, &stress);
            poisson.settle(&mut p);
            let slopes = solve(&p, &mut u)?;
            let (_, mut change) = left(&slopes, &p, &u);
            add(&mut p, -1.0, pressures);
            add_vectors(&mut u, -1.0, velocities);
            add(&mut change, -1.0, &stress);
            for (dp, du, ds) in &tried {
                let share = -dot(&change, ds) / dot(ds, ds);
                add(&mut p, share, dp);
                add_vectors(&mut u, share, du);
                add(&mut change, share, ds);
            }
            let share = -dot(&stress, &change) / dot(&change, &change);
            if !share.is_finite() {
                break;
            }
            add(pressures, share, &p);
            add_vectors(velocities, share, &u);
            pushed = pressure::slopes(stencils, self.fluid, pressures);
            (excess, stress) = left(&pushed, pressures, velocities);
            tried.push((p, u, change));
        }
        if !is_small(&stress, pressures) {
            // A share of it might grow where the fluid has not followed.
            stress.fill(0.0);
        }
        Ok(Found { pushed, excess, stress, iterations })
    }
}
