//! What a case means for particles: how many, how long steps are, and how much memory they take. Known before anything runs.

use tremie_case::{Case, Side};
use tremie_cloud::Dimension;
use tremie_numerics::DVec3;

use crate::particles::{Particles, longest_fall};
use crate::setup;

/// Bytes that a particle takes, with its lists of neighbours and its rows of both linear systems while they are solved: an estimate.
const BYTES: [f64; 2] = [6e3, 3e4];

/// The numbers of a run.
#[derive(Debug, Clone, PartialEq)]
pub struct Plan {
    /// Distance of particles in m.
    pub spacing: f64,
    /// Whether it is a case in a plane.
    pub plane: bool,
    /// Particles at the start.
    pub particles: usize,
    /// Step in s at the reference speed; real ones are longer while it is not reached.
    pub time_step: f64,
    /// Steps of that length to the case's stop time.
    pub steps: f64,
    /// Height in m of the fluid along gravity.
    pub height: f64,
    /// Speed in m/s that the fluid may reach.
    pub reference_speed: f64,
    /// Largest apparent viscosity in Pa s.
    pub largest_viscosity: f64,
    /// Bingham number tau0 H / (mu U), with the yield stress of a regularised fluid too.
    pub bingham: f64,
    /// Reynolds number rho U H / mu.
    pub reynolds: f64,
    /// Expected memory in bytes.
    pub memory: f64,
}

impl Plan {
    /// Works out the numbers of a case.
    ///
    /// # Panics
    /// If the case is for another method.
    pub fn new(case: &Case) -> Self {
        let (space, _) = setup::space(case);
        let (fluid, stepping) = (setup::fluid(case), setup::stepping(case));
        let (positions, velocities) = setup::particles(case, &space);
        let plane = space.dimension == Dimension::Two;
        let down = fluid.gravity.normalize_or_zero();
        let depths = || positions.iter().map(|at| at.dot(down));
        let height = (depths().fold(f64::MIN, f64::max) - depths().fold(f64::MAX, f64::min)).max(0.0);
        let floor = (case.domain.max - case.domain.min).dot(down.abs());
        let fall = if down == DVec3::ZERO { 0.0 } else { height.min(floor) };
        let walls = case.domain.sides.iter().map(|side| match side {
            Side::Wall { velocity, .. } => velocity.length(),
            _ => 0.0,
        });
        let solids = case.solids.iter().map(|solid| solid.motion.largest_speed(0.0));
        let given = velocities.iter().map(|u| u.length());
        let speed =
            walls.chain(solids).chain(given).fold((2.0 * fluid.gravity.length() * fall).sqrt(), f64::max);
        let number = positions.len();
        let particles = Particles::new(positions, space, fluid, stepping);
        let length = particles.space.smoothing_length();
        let time_step = (stepping.courant * length / speed)
            .min(longest_fall(length, fluid.gravity))
            .min(stepping.longest)
            .min(if stepping.explicit {
                particles.explicit_limit(fluid.largest_viscosity)
            } else {
                f64::MAX
            });
        let curve = &case.material.curve;
        let viscosity = curve.plastic_viscosity();
        let yield_stress = curve.viscoplastic().map_or(0.0, |law| law.yield_stress);
        Self {
            spacing: particles.space.spacing,
            plane,
            particles: number,
            time_step,
            steps: (case.stop.time / time_step).ceil(),
            height,
            reference_speed: speed,
            largest_viscosity: fluid.largest_viscosity,
            bingham: yield_stress * height / (viscosity * speed),
            reynolds: fluid.density * speed * height / viscosity,
            memory: number as f64 * if plane { BYTES[0] } else { BYTES[1] },
        }
    }
}
