//! What a case means for nodes: how many, how long steps are, and how much memory they take. Known before anything runs.

use tremie_case::{Case, Side};
use tremie_cloud::{Dimension, Space};
use tremie_numerics::DVec3;

use super::setup::pressed_speed;

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
    /// Works out the numbers of a case with these nodes and their velocities in m/s, a largest apparent viscosity in Pa s, steps in s at a speed in m/s, and so many bytes for each of them.
    pub fn new(
        case: &Case,
        space: &Space,
        (positions, velocities): (&[DVec3], &[DVec3]),
        largest_viscosity: f64,
        time_step: impl Fn(f64) -> f64,
        bytes: f64,
    ) -> Self {
        let gravity = case.domain.gravity;
        let down = gravity.normalize_or_zero();
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
        let speed = walls.chain(solids).chain(given).fold((2.0 * gravity.length() * fall).sqrt(), f64::max);
        let speed = speed.max(pressed_speed(case, positions.len()));
        let time_step = time_step(speed);
        let curve = &case.material.curve;
        let (density, viscosity) = (case.material.density, curve.plastic_viscosity());
        let yield_stress = curve.viscoplastic().map_or(0.0, |law| law.yield_stress);
        Self {
            spacing: space.spacing,
            plane: space.dimension == Dimension::Two,
            particles: positions.len(),
            time_step,
            steps: (case.stop.time / time_step).ceil(),
            height,
            reference_speed: speed,
            largest_viscosity,
            bingham: yield_stress * height / (viscosity * speed),
            reynolds: density * speed * height / viscosity,
            memory: positions.len() as f64 * bytes,
        }
    }
}
