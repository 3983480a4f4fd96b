//! A wall that a load moves along a line, against what the fluid does to it.
//!
//! ```text
//!     M (V - V_n)/dt = F + P(V)
//! ```
//!
//! with F the load along the line and P what the fluid pushes and pulls when the plate has moved with V through the step. Viscosities are those that the speeds before give in the step's middle and pressures those
//! of an incompressible fluid, so P is all but linear in V, and a few steps on trial find V (the secant method). So plates may be as light as they like, even without mass: what they must
//! push out of the way, which makes them unstable where P is that of the step before, is in P(V).
//!
//! P is summed over the pairs of particles and their images in the wall: of the pressure (p_a + p_b) V^2 grad W, the gradient of the paper (Wu 2016, Eq. 19; 004, Eq. 26), over what a lattice has
//! of it, and of viscosity what module `viscosity` has.

use tremie_cloud::{Failure, Surroundings};
use tremie_geometry::{Motion, Waypoint};
use tremie_numerics::DVec3;

use crate::particles::{Particles, shear_rates};
use crate::pressure::pushes;
use crate::viscosity::pulls;

/// A wall that a load moves. In a plane force and mass are per metre of depth.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Plate {
    /// Number of the wall.
    pub wall: usize,
    /// Unit vector along its way.
    pub direction: DVec3,
    /// Force in N along it, weight included.
    pub force: f64,
    /// Mass in kg.
    pub mass: f64,
    /// Way in m that it has gone.
    pub way: f64,
    /// Speed in m/s along its way.
    pub speed: f64,
}

/// What is left of the load unbalanced when a speed is good enough, over the load; and trials at most.
const BALANCED: f64 = 1e-3;
const TRIALS: usize = 8;
/// Shorter steps that are tried at most, so that the plate does not go too far in one.
const SHORTER: usize = 30;

impl Particles {
    /// Gives them a plate that a load moves.
    pub fn set_plate(&mut self, plate: Plate) {
        self.plate = Some(plate);
        self.drive(plate.speed);
    }

    /// Lets the plate go on from where it is at a speed in m/s.
    fn drive(&mut self, speed: f64) {
        let Some(plate) = &mut self.plate else { return };
        plate.speed = speed;
        let here = Waypoint { time: self.time, offset: plate.way * plate.direction };
        self.space.walls[plate.wall].motion = Motion::Through(here, speed * plate.direction);
    }

    /// Goes on by a step in s at most, in which the plate moves so that load, inertia and fluid are in balance.
    pub(crate) fn balance(&mut self, plate: Plate, step: f64, past: &[f64]) -> Result<(), Failure> {
        let far = self.stepping.courant * self.space.smoothing_length();
        let mut step = step;
        for _ in 0..SHORTER {
            let after = self.balanced(plate, step, past)?;
            let gone = after.plate.map_or(0.0, |after| (after.way - plate.way).abs());
            if gone <= far {
                *self = after;
                return Ok(());
            }
            // What is accelerated goes as the square of the time, what creeps as the time.
            step *= (0.8 * far / gone).clamp(0.1, 0.8);
        }
        Err(Failure::Slow { iterations: SHORTER, residual: 1.0 })
    }

    /// As they are after a step in s in which all is in balance.
    fn balanced(&self, plate: Plate, step: f64, past: &[f64]) -> Result<Self, Failure> {
        // A speed on trial against fluid that has not taken it up yet would be a shear of its own, and thin the fluid.
        let rates = self.rates_half_way(step);
        // What is missing along the line when the plate has gone with a speed, in N.
        let trial = |speed: f64| -> Result<(f64, Self), Failure> {
            let mut after = self.clone();
            after.drive(speed);
            after.go_on(step, past, Some(&rates))?;
            after.plate = Some(Plate { way: plate.way + speed * step, speed, ..plate });
            after.drive(speed);
            let inertia = plate.mass * (speed - plate.speed) / step;
            let missing = plate.force - inertia + after.borne(&plate, step).dot(plate.direction);
            Ok((missing, after))
        };
        let fluid = self.positions.len() as f64 * self.fluid.density * self.space.volume();
        let (mut one, mut other) = (plate.speed, plate.speed + step * plate.force / (plate.mass + fluid));
        let (mut missing, mut after) = trial(one)?;
        for _ in 0..TRIALS {
            if missing.abs() <= BALANCED * plate.force.abs() {
                break;
            }
            let (found, next) = trial(other)?;
            let slope = (found - missing) / (other - one);
            (one, missing, after) = (other, found, next);
            other = one - missing / slope;
            if !other.is_finite() {
                return Err(Failure::Breakdown { iterations: 0 });
            }
        }
        Ok(after)
    }

    /// Shear rates in 1/s half-way in a step in s, with the plate as fast as it is.
    fn rates_half_way(&self, step: f64) -> Vec<f64> {
        if self.three.is_some() {
            return self.rates_in_three_steps(step);
        }
        let half = self.half_way(step);
        let gradients = half.gradients();
        shear_rates(&half, &gradients, &half.surface(&gradients), &self.velocities)
    }

    /// Force in N of the fluid on the plate after a step in s.
    pub(crate) fn borne(&self, plate: &Plate, step: f64) -> DVec3 {
        if self.three.is_some() {
            return self.borne_by_particles(plate, step);
        }
        let around = Surroundings::new(&self.positions, &self.space, self.time, step);
        let viscosity: Vec<f64> = self.shear_rates.iter().map(|rate| self.fluid.viscosity(*rate)).collect();
        let pulled = pulls(&around, &viscosity, &self.velocities);
        let pulled = pulled.into_iter().filter(|(wall, ..)| *wall == plate.wall);
        self.space.volume() * pulled.map(|(.., pull)| pull).sum::<DVec3>()
            + pushes(&around, &self.fluid, &self.pressures, plate.wall)
    }
}
