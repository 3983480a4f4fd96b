//! Particles and their step.

use tremie_cloud::{Failure, Follower, reorder};
use tremie_numerics::DVec3;
use tremie_rheology::FlowCurve;

use crate::space::Space;
use crate::surroundings::{Source, Surroundings};
use crate::{pressure, viscosity};

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
    /// Whether stress and shear rate are taken as Wu (2016, Eq. 3 to 7) prints them: mu E at the shear rate sqrt(E:E/2), half of what they are here. A Cross fluid then has its
    /// yield stress, and half of its plastic viscosity.
    pub as_printed: bool,
}

impl Fluid {
    /// Apparent viscosity in Pa s at a shear rate sqrt(2 E:E) in 1/s, by which stress is 2 mu E.
    pub fn viscosity(&self, shear_rate: f64) -> f64 {
        let of = |rate: f64| self.curve.viscosity(rate).min(self.largest_viscosity);
        if self.as_printed { 0.5 * of(0.5 * shear_rate) } else { of(shear_rate) }
    }
}

/// How a step is taken.
#[derive(Debug, Clone, Copy)]
pub struct Stepping {
    /// Share of a smoothing length that particles may go in a step.
    pub courant: f64,
    /// Longest step in s.
    pub longest: f64,
    /// Whether the viscous part is explicit, with steps as short as that needs.
    pub explicit: bool,
}

/// Share of the time in which particles fall a smoothing length.
const FALL: f64 = 0.25;
/// Share of rho h^2/mu that an explicit step may take (Morris et al. 1997).
const DIFFUSES: f64 = 0.125;
/// Distance from walls in spacings below which no particle may be; at rest they are half a spacing off.
const CLOSEST: f64 = 0.25;
/// How far particles that are too near to each other may part in a step, over the way that they go in it; and in how many sweeps.
const PARTS: f64 = 0.5;
const SWEEPS: usize = 5;

/// Particles of a fluid.
#[derive(Debug, Clone)]
pub struct Particles {
    pub(crate) space: Space,
    pub(crate) fluid: Fluid,
    pub(crate) stepping: Stepping,
    pub(crate) time: f64,
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
    /// Particles at rest.
    pub fn new(positions: Vec<DVec3>, space: Space, fluid: Fluid, stepping: Stepping) -> Self {
        let number = positions.len();
        Self {
            space,
            fluid,
            stepping,
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

    /// Largest step in s for the speeds at present, of fluid and walls.
    pub fn time_step(&self) -> f64 {
        let length = self.space.smoothing_length();
        let walls = self.space.walls.iter().map(|wall| wall.motion.largest_speed(self.time));
        let speeds = self.velocities.iter().map(|u| u.length());
        let fastest = speeds.chain(walls).fold(0.0, f64::max);
        let fall = longest_fall(length, self.fluid.gravity);
        let mut step = fall.min(self.stepping.courant * length / fastest).min(self.stepping.longest);
        if self.stepping.explicit {
            let stiffest =
                self.shear_rates.iter().map(|rate| self.fluid.viscosity(*rate)).fold(0.0, f64::max);
            step = step.min(self.explicit_limit(stiffest));
        }
        step
    }

    /// Longest explicit step in s with so large a viscosity in Pa s.
    pub(crate) fn explicit_limit(&self, viscosity: f64) -> f64 {
        DIFFUSES * self.fluid.density * self.space.smoothing_length().powi(2) / viscosity
    }

    /// Memory in bytes that what is kept from step to step takes.
    pub(crate) fn bytes(&self) -> usize {
        let each = 2 * size_of::<DVec3>() + 2 * size_of::<f64>();
        self.positions.len() * each
    }

    /// Leaves only those that stay.
    pub(crate) fn keep(&mut self, stays: &[bool]) {
        fn only<T: Copy>(of: &mut Vec<T>, stays: &[bool]) {
            let mut n = 0;
            of.retain(|_| {
                n += 1;
                stays[n - 1]
            });
        }
        only(&mut self.positions, stays);
        only(&mut self.velocities, stays);
        only(&mut self.pressures, stays);
        only(&mut self.shear_rates, stays);
    }

    /// Goes to another moment.
    pub(crate) fn go_back(
        &mut self,
        time: f64,
        positions: Vec<DVec3>,
        velocities: Vec<DVec3>,
        pressures: Vec<f64>,
        shear_rates: Vec<f64>,
    ) {
        self.time = time;
        (self.positions, self.velocities) = (positions, velocities);
        (self.pressures, self.shear_rates) = (pressures, shear_rates);
    }

    /// Goes on by a step.
    ///
    /// # Errors
    /// If one of the linear systems cannot be solved.
    pub fn advance(&mut self) -> Result<(), Failure> {
        let step = self.time_step();
        let before = Surroundings::new(&self.positions, &self.space, self.time, step);
        if self.time == 0.0 {
            self.pressures = pressure::at_rest(&before, &self.fluid)?;
        }
        self.shear_rates = shear_rates(&before, &self.velocities);
        let viscosity: Vec<f64> = self.shear_rates.iter().map(|rate| self.fluid.viscosity(*rate)).collect();
        let mut velocities = self.velocities.clone();
        let pushed = pressure::gradients(&before, &self.fluid, &self.pressures);
        let force = |a: usize| self.fluid.density * self.fluid.gravity - pushed[a];
        let viscous = viscosity::System::new(&before, &viscosity);
        let iterations = match self.stepping.explicit {
            true => viscous.push(&self.fluid, force, &mut velocities, step),
            false => viscous.diffuse(&self.fluid, force, &mut velocities, step)?,
        };
        let go = |by: &dyn Fn(usize) -> DVec3| -> Vec<DVec3> {
            let way = |(n, at): (usize, &DVec3)| *at + step * by(n);
            self.positions.iter().enumerate().map(way).collect()
        };
        // Those that have left the box are seen as copies are: they come back at the end.
        let after = Surroundings::new(&go(&|n| velocities[n]), &self.space, self.time + step, step);
        let mut pressures = self.pressures.clone();
        let projection =
            pressure::project(&after, &self.fluid, &pushed, &mut pressures, &mut velocities, step)?;
        let positions = go(&|n| 0.5 * (self.velocities[n] + velocities[n]));
        self.iterations = [iterations, projection];
        (self.positions, self.velocities, self.pressures) = (positions, velocities, pressures);
        self.part(&after, step);
        self.keep_out(step);
        self.time += step;
        Ok(())
    }

    /// Keeps particles a little off the walls where they are after a step in s, and from going there.
    fn keep_out(&mut self, step: f64) {
        let least = CLOSEST * self.space.spacing;
        let standing = self.space.standing(self.time + step);
        let walls: Vec<_> = self.space.walls.iter().map(|wall| wall.velocity(self.time, step)).collect();
        for (at, u) in self.positions.iter_mut().zip(&mut self.velocities) {
            for (wall, velocity) in standing.iter().zip(&walls) {
                let (distance, normal) = wall.nearest(*at);
                if distance < least {
                    *at += (least - distance) * normal;
                    *u -= (*u - *velocity).dot(normal).min(0.0) * normal;
                }
            }
            *at = self.space.wrapped(*at);
        }
    }

    /// Parts particles that have come too near to each other; their velocities become those of the fluid where they are then.
    fn part(&mut self, after: &Surroundings, step: f64) {
        let space = &self.space;
        let mut all = self.positions.clone();
        let follower = |source: &Source| Follower { of: source.of, turn: source.mirror };
        let followers: Vec<Follower> = after.sources[self.positions.len()..].iter().map(follower).collect();
        // Images and copies are as far from where they were as their particles, each in its mirror.
        let gone: Vec<DVec3> =
            self.positions.iter().zip(&after.positions).map(|(to, from)| *to - *from).collect();
        let others = after.positions[self.positions.len()..].iter().zip(&followers);
        all.extend(others.map(|(at, follower)| *at + follower.turn * gone[follower.of]));
        let most: Vec<f64> = self.velocities.iter().map(|u| PARTS * u.length() * step).collect();
        let ways = reorder(&all, &after.near, &followers, space.spacing, space.dimension, &most, SWEEPS);
        let gradients = after.gradients();
        let seen = after.velocities(&self.velocities);
        // At the surface gradients are told from one side only.
        let surface = after.surface();
        let changes = after.each(|a| match ways[a] {
            way if surface[a] || way == DVec3::ZERO => DVec3::ZERO,
            way => gradients.velocity_gradient(a, &seen) * way,
        });
        for (n, way) in ways.into_iter().enumerate() {
            self.positions[n] += way;
            self.velocities[n] += changes[n];
        }
    }
}

/// Step in s in which particles at rest fall by a share of a length in m.
pub(crate) fn longest_fall(length: f64, gravity: DVec3) -> f64 {
    FALL * (length / gravity.length()).sqrt()
}

/// Shear rates sqrt(2 E:E) in 1/s of velocities in m/s.
pub(crate) fn shear_rates(around: &Surroundings, velocities: &[DVec3]) -> Vec<f64> {
    let gradients = around.gradients();
    let all = around.velocities(velocities);
    around.each(|a| {
        let l = gradients.velocity_gradient(a, &all);
        let e = 0.5 * (l + l.transpose());
        (2.0 * e.to_cols_array().into_iter().map(|x| x * x).sum::<f64>()).sqrt()
    })
}
