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
//! P is what the balance of momentum says of the layer beside the plate, two spacings D thick:
//!
//! ```text
//!     P = sum V (-w(d) p n + o(d) (f + rho (g - a))) + Q,      w = sin^2(pi d/(2 D))/D,      o = 1 - d/(2 D) + sin(pi d/D)/(2 pi)
//! ```
//!
//! with V what a particle stands for, d its distance from the plate, n the normal out of it there, p its pressure, a its acceleration, f the viscous force on it and Q that of the pairs of particles and images on the plate; o is
//! the share of w beyond d. On layers of particles D apart w sums up to 1/D wherever the first of them is, so pressures act on all that is wet of the plate: sums over pairs of particles and their images, the gradient of the papers, see
//! 6 % too little of it where particles have come to stand a little off. Viscous forces are those of pairs, which conserve momentum: stresses by gradients differ from them where fluid that has not yielded sticks to the plate. In
//! three steps friction is that of the particles of the plate on those of the fluid, without f.

use std::f64::consts::PI;

use tremie_cloud::{Failure, Surroundings};
use tremie_geometry::{Motion, Waypoint};
use tremie_numerics::DVec3;

use crate::particles::{Particles, shear_rates};
use crate::viscosity::drag;

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
            let missing = plate.force - inertia + after.borne(self, &plate, step).dot(plate.direction);
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

    /// Particles within two spacings of the plate, with their distances over that and the normal out of the plate there.
    fn beside(&self, plate: &Plate) -> Vec<(usize, f64, DVec3)> {
        let (standing, reach) = (self.space.standing(self.time), 2.0 * self.space.spacing);
        let place = |(a, at): (usize, &DVec3)| {
            let (distance, normal) = standing[plate.wall].nearest(*at);
            (a, distance / reach, normal)
        };
        let all = self.positions.iter().enumerate().map(place);
        all.filter(|(_, far, _)| (0.0..1.0).contains(far)).collect()
    }

    /// Force in N/m3 of the pressures on the plate, of particles `beside` it.
    fn pressed(&self, beside: &[(usize, f64, DVec3)]) -> DVec3 {
        let push = |(a, far, normal): &(usize, f64, DVec3)| {
            let share = (PI * far).sin().powi(2) / self.space.spacing;
            -share * self.pressures[*a] * *normal
        };
        beside.iter().map(push).sum()
    }

    /// Force in N of the fluid on the plate after a step in s from how it was `before`.
    fn borne(&self, before: &Self, plate: &Plate, step: f64) -> DVec3 {
        let beside = self.beside(plate);
        let pressed = self.pressed(&beside);
        let mut share = vec![0.0; self.positions.len()];
        let mut held = DVec3::ZERO;
        for (a, far, _) in beside {
            share[a] = 1.0 - far + (2.0 * PI * far).sin() / (2.0 * PI);
            let accelerated = (self.velocities[a] - before.velocities[a]) / step;
            held += share[a] * self.fluid.density * (self.fluid.gravity - accelerated);
        }
        let dragged = if self.three.is_some() {
            self.rubbed(plate, step)
        } else {
            let around = Surroundings::new(&self.positions, &self.space, self.time, step);
            let viscosity: Vec<f64> =
                self.shear_rates.iter().map(|rate| self.fluid.viscosity(*rate)).collect();
            drag(&around, &viscosity, &self.velocities, plate.wall, &share)
        };
        self.space.volume() * (pressed + held + dragged)
    }
}

#[cfg(test)]
mod tests {
    use tremie_cloud::{Dimension, nodes};
    use tremie_geometry::{Body, Shape};
    use tremie_rheology::FlowCurve;

    use super::*;
    use crate::{Fluid, Space, Stepping, Wall};

    /// Fluid at rest under an even pressure bears a plate by the area that is wet, wherever its particles stand.
    #[test]
    fn plates_bear_what_they_are_wet_of() {
        let (spacing, pressure) = (0.01, 50.0);
        let (low, high) = (DVec3::ZERO, DVec3::new(0.2, 1.0, 0.1));
        for off in [-0.2, 0.0, 0.2, 0.4] {
            let point = (high.z + off * spacing) * DVec3::Z;
            let wall = Wall {
                body: Body::Shape(Shape::HalfSpace { point, normal: DVec3::NEG_Z }),
                motion: Motion::REST,
                sliding: DVec3::ZERO,
                slip_length: 0.0,
                hides: false,
            };
            let periodic = [true, false, false];
            let space =
                Space { low, high, periodic, walls: vec![wall], ..Space::free(Dimension::Two, spacing) };
            let body = Body::Shape(Shape::Box { min: low, max: high });
            let fluid = Fluid {
                density: 2000.0,
                curve: FlowCurve::Newtonian { viscosity: 10.0 },
                largest_viscosity: f64::INFINITY,
                gravity: DVec3::ZERO,
                as_printed: false,
            };
            let stepping = Stepping { courant: 0.25, longest: 0.1, explicit: false };
            let positions = nodes(&body, spacing, Dimension::Two, 0.5);
            let mut particles = Particles::new(positions, space, fluid, stepping);
            particles.pressures.fill(pressure);
            let plate = Plate { wall: 0, direction: DVec3::Z, force: 0.0, mass: 0.0, way: 0.0, speed: 0.0 };
            let borne = particles.borne(&particles, &plate, 0.01);
            assert!((borne - pressure * high.x * DVec3::Z).length() < 1e-9, "{off}: {borne}");
        }
    }
}
