//! Particles and their step.

use rayon::prelude::*;
use tremie_cloud::{Dimension, Failure};
use tremie_geometry::Body;
use tremie_numerics::DVec3;
use tremie_rheology::FlowCurve;

use crate::surroundings::{Surroundings, kernel};
use crate::{pressure, viscosity};

/// A wall.
#[derive(Debug, Clone)]
pub struct Wall {
    /// What no fluid is in.
    pub body: Body,
    /// How it moves, in m/s.
    pub velocity: DVec3,
    /// Slip length in m: 0 where fluid sticks to it, infinite without friction.
    pub slip_length: f64,
}

/// What flows.
#[derive(Debug, Clone, Copy)]
pub struct Fluid {
    /// Density in kg/m3.
    pub density: f64,
    /// Its flow curve.
    pub curve: FlowCurve,
    /// Largest apparent viscosity in Pa s: fluid that has not yielded creeps by it.
    pub largest_viscosity: f64,
    /// Gravity in m/s2.
    pub gravity: DVec3,
}

/// Share of a smoothing length that particles may go in a step.
const COURANT: f64 = 0.2;
/// Share of the time in which they fall so far.
const FALL: f64 = 0.25;
/// Distance from walls in spacings below which no particle may be; at rest they are half a spacing off.
const CLOSEST: f64 = 0.25;
/// Shift against the gradient of concentration, in smoothing lengths times the way that a particle goes (Lind et al. 2012).
const SHIFT: f64 = 1.0;

/// Particles of a fluid.
#[derive(Debug, Clone)]
pub struct Particles {
    dimension: Dimension,
    spacing: f64,
    fluid: Fluid,
    walls: Vec<Wall>,
    time: f64,
    /// Places in m.
    pub positions: Vec<DVec3>,
    /// Velocities in m/s.
    pub velocities: Vec<DVec3>,
    /// Pressures in Pa.
    pub pressures: Vec<f64>,
    /// Shear rates in 1/s.
    pub shear_rates: Vec<f64>,
    /// Iterations of the last step: of the viscous part and of the pressure.
    pub iterations: [usize; 2],
}

impl Particles {
    /// Particles at rest, `spacing` in m apart.
    pub fn new(
        positions: Vec<DVec3>,
        spacing: f64,
        dimension: Dimension,
        fluid: Fluid,
        walls: Vec<Wall>,
    ) -> Self {
        let number = positions.len();
        Self {
            dimension,
            spacing,
            fluid,
            walls,
            time: 0.0,
            positions,
            velocities: vec![DVec3::ZERO; number],
            pressures: vec![0.0; number],
            shear_rates: vec![0.0; number],
            iterations: [0; 2],
        }
    }

    /// Time in s.
    pub fn time(&self) -> f64 {
        self.time
    }

    /// Largest step in s for the speeds at present.
    pub fn time_step(&self) -> f64 {
        let length = 0.5 * kernel(self.dimension, self.spacing).support();
        let fastest = self.velocities.iter().map(|u| u.length()).fold(0.0, f64::max);
        let fall = FALL * (length / self.fluid.gravity.length()).sqrt();
        fall.min(COURANT * length / fastest)
    }

    fn surroundings(&self, positions: &[DVec3]) -> Surroundings {
        Surroundings::new(positions, self.spacing, self.dimension, &self.walls)
    }

    /// Goes on by a step.
    ///
    /// # Errors
    /// If one of the linear systems cannot be solved.
    pub fn advance(&mut self) -> Result<(), Failure> {
        let step = self.time_step();
        let before = self.surroundings(&self.positions);
        if self.time == 0.0 {
            self.pressures = pressure::at_rest(&before, &self.fluid, self.spacing)?;
        }
        let viscosity = self.apparent_viscosity(&before);
        let mut velocities = self.velocities.clone();
        let pushed = pressure::gradients(&before, &self.fluid, &self.pressures);
        let force = |a: usize| self.fluid.density * self.fluid.gravity - pushed[a];
        let viscous = viscosity::diffuse(&before, &self.fluid, &viscosity, force, &mut velocities, step)?;
        let go = |by: &dyn Fn(usize) -> DVec3| -> Vec<DVec3> {
            self.positions.iter().enumerate().map(|(n, at)| *at + step * by(n)).collect()
        };
        let after = self.surroundings(&go(&|n| velocities[n]));
        let mut pressures = self.pressures.clone();
        let projection = pressure::project(
            &after,
            &self.fluid,
            &pushed,
            &mut pressures,
            &mut velocities,
            step,
            self.spacing,
        )?;
        let positions = go(&|n| 0.5 * (self.velocities[n] + velocities[n]));
        self.iterations = [viscous, projection];
        (self.positions, self.velocities, self.pressures) = (positions, velocities, pressures);
        self.keep_out();
        self.shift(step);
        self.time += step;
        Ok(())
    }

    /// Apparent viscosities at the shear rates, which are noted.
    fn apparent_viscosity(&mut self, around: &Surroundings) -> Vec<f64> {
        let gradients = around.gradients();
        let all = around.mirrored(|source| source.turn * self.velocities[source.of] + source.carried);
        let rate = |a: usize| {
            let l = gradients.velocity_gradient(a, &all);
            let e = 0.5 * (l + l.transpose());
            (2.0 * e.to_cols_array().into_iter().map(|x| x * x).sum::<f64>()).sqrt()
        };
        self.shear_rates = (0..around.number).into_par_iter().with_min_len(64).map(rate).collect();
        let largest = self.fluid.largest_viscosity;
        self.shear_rates.iter().map(|rate| self.fluid.curve.viscosity(*rate).min(largest)).collect()
    }

    /// Keeps particles a little off the walls, and from going there.
    fn keep_out(&mut self) {
        let least = CLOSEST * self.spacing;
        for (at, u) in self.positions.iter_mut().zip(&mut self.velocities) {
            for wall in &self.walls {
                let (distance, normal) = wall.body.nearest(*at);
                if distance < least {
                    *at += (least - distance) * normal;
                    *u -= (*u - wall.velocity).dot(normal).min(0.0) * normal;
                }
            }
        }
    }

    /// Moves particles a little to where there are fewer, but not across the surface; their velocities become those of the fluid there.
    fn shift(&mut self, step: f64) {
        let around = self.surroundings(&self.positions);
        let surface = around.surface();
        let gradients = around.gradients();
        let length = 0.5 * around.kernel.support();
        let all = around.mirrored(|source| source.turn * self.velocities[source.of] + source.carried);
        let shifted = |a: usize| {
            let open = surface[a] || around.around(a).any(|(_, _, source)| surface[source.of]);
            // grad W points away from the neighbour: -x W'/r times -1.
            let crowded: DVec3 = around
                .around(a)
                .map(|(_, x, _)| -around.volume * around.kernel.slope(x.length()) / x.length() * x)
                .sum();
            // At the surface and beside it only along it.
            let inward: DVec3 = around.around(a).map(|(_, x, _)| around.kernel.weight(x.length()) * x).sum();
            let inward = if open { inward.normalize_or_zero() } else { DVec3::ZERO };
            let along = crowded - crowded.dot(inward) * inward;
            let way = -SHIFT * length * self.velocities[a].length() * step * along;
            (way, gradients.velocity_gradient(a, &all) * way)
        };
        let moves: Vec<_> = (0..around.number).into_par_iter().with_min_len(64).map(shifted).collect();
        for (n, (way, change)) in moves.into_iter().enumerate() {
            self.positions[n] += way;
            self.velocities[n] += change;
        }
    }
}
