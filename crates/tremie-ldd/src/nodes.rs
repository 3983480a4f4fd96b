//! Nodes and their step.
//!
//! The paper takes velocities for those at the places, and nodes on by the second order (Eq. 20); but as forces are those at the end of what they act for, a vortex that turns at omega loses dt omega^2/2 of its
//! energy in a time. Here velocities are those half-way between places, as in leap-frogging: x' = x + dt u', and it loses nothing. They are to be free of divergence half-way, which is where nodes are
//! div u' = dt/2 tr(L L), L = grad u. In the paper's order its own rule is kept.

use rayon::prelude::*;
use tremie_cloud::{
    Dimension, Failure, Follower, Gradients, Pressed, Source, Space, Surroundings, Wall, along_curve,
    at_start, balance, else_borne, reorder,
};
use tremie_numerics::DVec3;
use tremie_rheology::FlowCurve;

use crate::pressure::{self, Excess, Poisson};
use crate::stencils::Stencils;
use crate::viscosity::{self, Viscous};

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

impl Fluid {
    /// Apparent viscosity in Pa s at a shear rate sqrt(2 E:E) in 1/s, by which stress is 2 mu E; that of a power law that thickens is none at rest, and not quite here.
    pub fn viscosity(&self, shear_rate: f64) -> f64 {
        let least = LEAST * self.curve.plastic_viscosity();
        self.curve.viscosity(shear_rate).max(least).min(self.largest_viscosity)
    }
}

/// In which order pressure and velocity are found.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Coupling {
    /// Velocities under the old pressure, and then what it must be besides.
    Incremental,
    /// The pressure that takes away what the old velocities have of divergence, and then new velocities under it (Basic 2021).
    PressureFirst,
}

/// What of a step's stress is that of the new velocities.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scheme {
    /// All but the apparent viscosity.
    Lagged,
    /// The apparent viscosity, too.
    Implicit,
    /// mu lap u, and not 2 E grad mu (Basic 2021, Eq. 19).
    Paper,
}

/// Which Laplacian is taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Operators {
    /// The one that is exact for quadratic fields, over 2.1 spacings.
    Exact,
    /// That of Basic (2021, Eq. 15), over 1.6 spacings.
    Paper,
}

/// How a step is taken.
#[derive(Debug, Clone, Copy)]
pub struct Stepping {
    /// Spacings that nodes may go in a step.
    pub courant: f64,
    /// Longest step in s.
    pub longest: f64,
    /// The order of its parts.
    pub coupling: Coupling,
    /// Its stress.
    pub scheme: Scheme,
    /// Its Laplacian.
    pub operators: Operators,
}

/// Share of the plastic viscosity that the apparent one is at least.
const LEAST: f64 = 1e-4;
/// Share of the time in which nodes fall a spacing.
const FALL: f64 = 0.5;
/// Distance from walls in spacings below which no node may be; at rest they are half a spacing off.
const CLOSEST: f64 = 0.25;
/// How far nodes that are too near to each other may part in a step, over the way that they go past others in it; and in how many sweeps.
const PARTS: f64 = 0.5;
const SWEEPS: usize = 5;
/// Spacings below which neighbours are so near that a node may go so many in any case to part from them: where nothing presses, at the surface and in drops, they may come to lie on each other.
const CROWDED: f64 = 0.55;
const LEAVES: f64 = 0.1;
/// Largest change of a velocity over the way to a neighbour in a step that is seen in where it goes.
const TURNS: f64 = 0.1;
/// How often viscosities and velocities are found from each other at most, until these change by so little of the largest.
const ROUNDS: usize = 20;
const SETTLED: f64 = 1e-4;

/// Nodes of a fluid.
#[derive(Debug, Clone)]
pub struct Nodes {
    pub(crate) space: Space,
    pub(crate) fluid: Fluid,
    pub(crate) stepping: Stepping,
    pub(crate) time: f64,
    /// Length in s of the step before; 0 at first.
    pub(crate) last_step: f64,
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

impl Nodes {
    /// Nodes at rest.
    pub fn new(positions: Vec<DVec3>, space: Space, fluid: Fluid, stepping: Stepping) -> Self {
        let number = positions.len();
        Self {
            space,
            fluid,
            stepping,
            time: 0.0,
            last_step: 0.0,
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
        let moves = |wall: &Wall| wall.motion.largest_speed(self.time) + wall.sliding.length();
        let walls = self.space.walls.iter().map(moves);
        let fastest = self.velocities.iter().map(|u| u.length()).chain(walls).fold(0.0, f64::max);
        let longest = longest_step(self.space.spacing, fastest, &self.stepping, self.fluid.gravity);
        if self.fluid.curve.is_newtonian() { longest } else { at_start(longest, self.time) }
    }

    /// Brings nodes into the order in which they stand along a curve through space, so that those who are near stand near in memory.
    fn line_up(&mut self) {
        let order = along_curve(&self.positions, self.space.spacing);
        fn by<T: Copy>(of: &mut Vec<T>, order: &[u32]) {
            *of = order.iter().map(|n| of[*n as usize]).collect();
        }
        by(&mut self.positions, &order);
        by(&mut self.velocities, &order);
        by(&mut self.pressures, &order);
        by(&mut self.shear_rates, &order);
    }

    /// What surrounds nodes where they are, in a step in s.
    pub(crate) fn surroundings(&self, step: f64) -> Surroundings {
        Surroundings::new(&self.positions, &self.space, self.time, step)
    }

    /// Goes on by a step.
    ///
    /// # Errors
    /// If one of the linear systems cannot be solved.
    pub fn advance(&mut self) -> Result<(), Failure> {
        self.line_up();
        let (step, fluid, spacing) = (self.time_step(), self.fluid, self.space.spacing);
        let around = self.surroundings(step);
        let wide = around.gradients();
        let stencils = Stencils::new(&around, &wide, self.stepping.operators);
        let poisson = Poisson::new(&stencils, &fluid);
        if self.time == 0.0 && self.stepping.coupling == Coupling::Incremental {
            self.pressures = poisson.at_rest()?;
        }
        let before = self.velocities.clone();
        let mut pressures = std::mem::take(&mut self.pressures);
        let weight = fluid.density * fluid.gravity;
        self.iterations = match self.stepping.coupling {
            Coupling::Incremental => {
                poisson.settle(&mut pressures);
                let mut last = None;
                let diffusion =
                    self.push(&stencils, step, |system, velocities, viscosity, shear_rates| {
                        let felt = stencils.felt(viscosity);
                        let (stencils, poisson, fluid) = (&stencils, &poisson, &fluid);
                        let mut pressed =
                            Viscously { poisson, system, fluid, felt: &felt, wanted: Vec::new(), step };
                        let pushed = pressed.slopes(&pressures);
                        let iterations = pressed.advance(&pushed, &pressures, velocities)?;
                        pressed.wanted = half_way(stencils, velocities, step);
                        let else_borne = else_borne(weight, spacing, &felt, shear_rates);
                        let found = balance(&pressed, pushed, &mut pressures, velocities, else_borne)?;
                        let iterations = iterations + found.iterations;
                        last = Some((found, felt));
                        Ok(iterations)
                    })?;
                let (found, felt) = last.expect("velocities are found at least once");
                let projection = poisson.project(&found.excess, &mut pressures, &felt, step)?;
                let pushes = pressure::slopes(&stencils, &fluid, &pressures);
                let share = step / fluid.density;
                for (u, (new, old)) in self.velocities.iter_mut().zip(pushes.iter().zip(&found.pushed)) {
                    *u -= share * (*new - *old);
                }
                poisson.follow(&mut pressures, &found.stress, &felt, step);
                [diffusion, projection]
            }
            Coupling::PressureFirst => {
                let at_surface = pressures.iter_mut().zip(&stencils.surface).filter(|(_, at)| **at);
                at_surface.for_each(|(p, _)| *p = 0.0);
                let (still, none) = (vec![weight; around.number], vec![0.0; around.number]);
                let excess = poisson.excess(&still, &pressures, &self.velocities, &none);
                let projection = poisson.project(&excess, &mut pressures, &none, step)?;
                let pushed = pressure::slopes(&stencils, &fluid, &pressures);
                let forces: Vec<DVec3> = pushed.iter().map(|pushed| weight - *pushed).collect();
                let diffusion = self
                    .push(&stencils, step, |system, velocities, _, _| system.advance(&forces, velocities))?;
                [diffusion, projection]
            }
        };
        self.pressures = pressures;
        self.go(&stencils, &poisson, &wide, &before, step)?;
        self.time += step;
        self.last_step = step;
        Ok(())
    }

    /// Finds velocities at the end of a step in s, and the shear rates before it; gives the iterations. They are found by a system for viscosities in Pa s at shear rates in 1/s, from those that were found before.
    fn push(
        &mut self,
        stencils: &Stencils,
        step: f64,
        mut find: impl FnMut(&dyn Viscous, &mut Vec<DVec3>, &[f64], &[f64]) -> Result<usize, Failure>,
    ) -> Result<usize, Failure> {
        let fluid = self.fluid;
        let start = self.velocities.clone();
        let mut iterations = 0;
        let rounds = if self.stepping.scheme == Scheme::Implicit { ROUNDS } else { 1 };
        for _ in 0..rounds {
            self.shear_rates = stencils.shear_rates(&self.velocities);
            let viscosity: Vec<f64> = self.shear_rates.iter().map(|rate| fluid.viscosity(*rate)).collect();
            let turns = self.stepping.scheme != Scheme::Paper;
            let system = viscosity::system(stencils, &viscosity, turns, fluid.density / step, &start);
            let (before, new) = (self.velocities.clone(), &mut self.velocities);
            iterations += find(&*system, new, &viscosity, &self.shear_rates)?;
            let largest = new.iter().map(|u| u.length()).fold(0.0, f64::max);
            let changed = new.iter().zip(&before).map(|(new, old)| new.distance(*old)).fold(0.0, f64::max);
            if changed <= SETTLED * largest {
                break;
            }
        }
        Ok(iterations)
    }

    /// Moves nodes on by the new velocities and those `before` in m/s in a step in s (Basic 2021, Eq. 20), and apart from each other; their velocities become those of the fluid there.
    fn go(
        &mut self,
        stencils: &Stencils,
        poisson: &Poisson,
        wide: &Gradients,
        before: &[DVec3],
        step: f64,
    ) -> Result<(), Failure> {
        let (space, around) = (&self.space, stencils.around);
        let ahead = match self.stepping.coupling {
            Coupling::PressureFirst if self.last_step > 0.0 => 0.5 * step / self.last_step,
            _ => 0.0,
        };
        let seen = around.velocities(&self.velocities);
        // What is between a node and its image, a wall, has the mean of their velocities.
        let share = |n: usize| if n < around.number || around.sources[n].wall.is_none() { 1.0 } else { 0.25 };
        let past = around.each(|a| {
            let others = around.near.of(a).iter().map(|n| *n as usize);
            let squares = others.map(|n| share(n) * seen[a].distance_squared(seen[n]));
            squares.fold(0.0, f64::max).sqrt()
        });
        let spread = poisson.spread(wide, &past, step)?;
        let velocities = self.velocities.iter().zip(before);
        let gone = velocities.map(|(u, old)| step * ((1.0 + ahead) * *u - ahead * *old));
        let ways: Vec<DVec3> = gone.zip(&spread).map(|(way, spread)| way + *spread).collect();
        let follower = |source: &Source| Follower { of: source.of, turn: source.mirror };
        let followers: Vec<Follower> = around.sources[around.number..].iter().map(follower).collect();
        let images = around.positions[around.number..].iter().zip(&followers);
        let images = images.map(|(at, follower)| *at + follower.turn * ways[follower.of]);
        let gone = around.positions.iter().zip(&ways).map(|(at, way)| *at + *way);
        let all: Vec<DVec3> = gone.chain(images).collect();
        let (spacing, dimension) = (space.spacing, space.dimension);
        let crowded = around.each(|a| {
            let least = (CROWDED * spacing).powi(2);
            let mut others = stencils.near.of(a).iter().map(|n| *n as usize);
            others
                .any(|n| around.positions[n].distance_squared(around.positions[a]) < least && share(n) == 1.0)
        });
        let most =
            around.each(|a| (PARTS * past[a] * step).max(if crowded[a] { LEAVES * spacing } else { 0.0 }));
        // Who lies on another leaves to any side.
        let outward = around.each(|a| if crowded[a] { DVec3::ZERO } else { stencils.outward[a] });
        let parted = reorder(&all, &around.near, &followers, spacing, dimension, &most, &outward, SWEEPS);
        // At the surface gradients are told from one side only.
        let changes = around.each(|a| match spread[a] + parted[a] {
            way if way == DVec3::ZERO || stencils.surface[a] => DVec3::ZERO,
            way => stencils.velocity_gradient(a, &seen) * way,
        });
        self.velocities.iter_mut().zip(changes).for_each(|(u, change)| *u += change);
        self.positions = all.iter().zip(parted).map(|(at, way)| *at + way).collect();
        self.keep_out(step);
        Ok(())
    }

    /// Keeps nodes a little off the walls where they are after a step in s, and from going there.
    fn keep_out(&mut self, step: f64) {
        let least = CLOSEST * self.space.spacing;
        let standing = self.space.standing(self.time + step);
        let walls: Vec<_> = self.space.walls.iter().map(|wall| wall.velocity(self.time, step)).collect();
        let space = &self.space;
        self.positions.par_iter_mut().zip(&mut self.velocities).with_min_len(64).for_each(|(at, u)| {
            for (wall, velocity) in standing.iter().zip(&walls) {
                let (distance, normal) = wall.nearest(*at);
                if distance < least {
                    *at += (least - distance) * normal;
                    *u -= (*u - *velocity).dot(normal).min(0.0) * normal;
                }
            }
            *at = space.wrapped(*at);
        });
    }
}

/// The viscous part of a step in s, by viscosities in Pa s that nodes feel, whose velocities are to have the divergence in 1/s that is `wanted`.
struct Viscously<'a> {
    poisson: &'a Poisson<'a>,
    system: &'a dyn Viscous,
    fluid: &'a Fluid,
    felt: &'a [f64],
    wanted: Vec<f64>,
    step: f64,
}

impl Pressed for Viscously<'_> {
    type Excess = Excess;

    fn slopes(&self, pressures: &[f64]) -> Vec<DVec3> {
        pressure::slopes(self.poisson.stencils, self.fluid, pressures)
    }

    fn advance(
        &self,
        slopes: &[DVec3],
        pressures: &[f64],
        velocities: &mut [DVec3],
    ) -> Result<usize, Failure> {
        let weight = self.fluid.density * self.fluid.gravity;
        let forces = pressure::forces(self.poisson.stencils, slopes, pressures);
        let forces: Vec<DVec3> = forces.into_iter().map(|force| weight + force).collect();
        self.system.advance(&forces, velocities)
    }

    fn excess(&self, slopes: &[DVec3], pressures: &[f64], velocities: &[DVec3]) -> (Excess, Vec<f64>) {
        let excess = self.poisson.excess(slopes, pressures, velocities, &self.wanted);
        let stress = self.poisson.stress(&excess, self.felt, self.step);
        (excess, stress)
    }

    fn settle(&self, pressures: &mut [f64]) {
        self.poisson.settle(pressures);
    }
}

/// Divergence in 1/s where nodes are of velocities in m/s that have none half a step in s further on: dt/2 tr(L L), with L = grad u.
fn half_way(stencils: &Stencils, velocities: &[DVec3], step: f64) -> Vec<f64> {
    let seen = stencils.around.velocities(velocities);
    stencils.around.each(|a| {
        let l = stencils.velocity_gradient(a, &seen);
        let square = l * l;
        let most = 0.5 * TURNS / step;
        (0.5 * step * (square.x_axis.x + square.y_axis.y + square.z_axis.z)).clamp(-most, most)
    })
}

/// Longest step in s of nodes so far apart in m at a speed in m/s.
pub(crate) fn longest_step(spacing: f64, speed: f64, stepping: &Stepping, gravity: DVec3) -> f64 {
    let fall = FALL * (spacing / gravity.length()).sqrt();
    fall.min(stepping.courant * spacing / speed).min(stepping.longest)
}

/// Nodes in three dimensions see more of each other: bytes that a node takes, with its lists of neighbours and its rows of both linear systems while they are solved: an estimate.
pub(crate) fn bytes_of_node(dimension: Dimension) -> f64 {
    match dimension {
        Dimension::Two => 3e3,
        Dimension::Three => 1.5e4,
    }
}
