//! The three steps of Hosseini, Manzari and Hannani (2007), as they were used for squeeze flows: of particles at x with velocities u
//!
//! ```text
//!     1   u1 = u + dt g                                                                  (here in the third, with the pressure that holds it)
//!     2   u2 = u1 + dt/rho sum V (mu_a + mu_b) (u_a - u_b) W'/r                     viscous term of Morris, Fox and Zhu (1997),   x2 = x + dt u2
//!     3   rho2/rho - 1 = dt sum V (u2_a - u2_b) . grad W                            at x2
//!         p_a = ((rho2/rho - 1) rho/dt^2 + sum c_ab p_b)/sum c_ab,   c_ab = 2 V r |W'|/(r^2 + eta^2)
//!         u'  = u2 - dt/rho sum V (p_a + p_b) grad W,     x' = x + dt/2 (u + u')
//! ```
//!
//! with the quintic spline. One such equation for each particle, with the pressures p_b of the step before, is the paper's (one sweep of Jacobi: it is slightly compressible, and needs steps as short as
//! those of an explicit viscous part); all of them are solved at once otherwise. The second step may be implicit: it then takes what has not yielded, but for the flow to be
//! right steps must still be as short as an explicit part needs with the plastic viscosity alone, for a pressure that is found after the viscous part comes too late for what that has held.
//!
//! Walls are filled with particles that move with them. What they seem to move with against a particle a at the distance d_a from the wall, themselves d_b behind it, is `U - (d_b/d_a) (u_a - U)`
//! (Morris, Fox and Zhu 1997), with d_a no less than half a spacing; planes without friction are mirrors. Where they bound d_b/d_a by 1.5 the fluid slips: a film of eight particles sinks by 10 % too fast
//! under a plate, without that bound by 6 %.
//!
//! Where the paper is left: pressure is zero at the free surface; a wall particle has the pressure of the particle that sees it, with the weight of the fluid between, instead of one of its own;
//! eta is h/100 instead of h/10, which takes 4 % off nearest neighbours; in the midst of fluid pressures push by their differences, p_b - p_a: of 2 p_a sum V grad W, what irregular neighbours make of a pressure that is
//! the same everywhere, more diverged in a wide thin gap than of its gradient, so that from step to step the pressure between plates that close at a given speed changed its sign and grew; the tensor of the strain rate is formed with corrected gradients. The viscous term stands for div(mu grad u): what varies of mu across the
//! flow's own direction is not in it.
//!
//! Nor does the paper bring particles back to order, without which one ran away in a channel: here they are, as after a projection (module `particles`).

use tremie_cloud::{
    Dimension, Failure, Gradients, Kernel, Matrix, Method, Multigrid, Neighbours, Operator, Settings,
    Smoothing, Source, Space, Surroundings, solve_poisson,
};
use tremie_numerics::{DMat3, DVec3};

use crate::particles::{Particles, norm_of_strain};
use crate::plate::Plate;
use crate::pressure::Poisson;
use crate::viscosity::{Row, Start, System, Viscous};

/// Smoothing length in spacings.
const LENGTH: f64 = 1.2;
/// Least distance from a wall in spacings by which d_b/d_a is told.
const LEAST: f64 = 0.5;
/// eta over the smoothing length.
const SOFT: f64 = 0.01;

const SETTINGS: Settings = Settings { method: Method::BiCgStab, tolerance: 1e-7, iterations: 500 };

/// How the pressure is found.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PressureStep {
    /// All at once.
    Solve,
    /// Each from those of the step before.
    Sweep,
}

/// A particle of a wall: where it is drawn in m, how deep in m, and the wall's number.
#[derive(Debug, Clone, Copy)]
pub(crate) struct WallParticle {
    at: DVec3,
    depth: f64,
    wall: usize,
}

/// The kernel of a space.
fn kernel(space: &Space) -> Smoothing {
    Smoothing::new(Kernel::Spline, space.dimension, LENGTH * space.spacing)
}

/// The particles of all walls to which fluid sticks, so deep as any reaches, on the lattice of the box.
pub(crate) fn wall_particles(space: &Space) -> Vec<WallParticle> {
    let (reach, spacing) = (kernel(space).support(), space.spacing);
    let beyond = (reach / spacing).ceil();
    let standing = space.standing(0.0);
    let mirrors = |out: DVec3| {
        let middle = 0.5 * (space.low + space.high);
        let outside = middle + out * (0.5 * (space.high - space.low) + 0.5 * spacing);
        let wall = standing.iter().position(|wall| wall.signed_distance(outside) < 0.0);
        wall.is_none_or(|wall| space.walls[wall].slip_length.is_infinite())
    };
    let range = |axis: usize| {
        let number = ((space.high[axis] - space.low[axis]) / spacing).round();
        let flat = space.dimension == Dimension::Two && axis == 1;
        let closed = |out: DVec3| flat || space.periodic[axis] || mirrors(out);
        let from = if closed(-DVec3::AXES[axis]) { 0.0 } else { -beyond };
        let to = if closed(DVec3::AXES[axis]) { number } else { number + beyond };
        from as i64..to as i64
    };
    let mut found = Vec::new();
    for (k, j, i) in range(2).flat_map(|k| range(1).flat_map(move |j| range(0).map(move |i| (k, j, i)))) {
        let at = space.low + spacing * (DVec3::new(i as f64, j as f64, k as f64) + 0.5);
        let inside = |(wall, body): (usize, &tremie_cloud::Standing)| {
            let depth = -body.signed_distance(at);
            (depth > 0.0 && depth < reach && space.walls[wall].slip_length.is_finite())
                .then_some(WallParticle { at, depth, wall })
        };
        found.extend(standing.iter().enumerate().find_map(inside));
    }
    found
}

/// Particles with what surrounds them, walls among it.
struct Scene {
    around: Surroundings,
    /// Number of the first wall particle.
    first: usize,
    depths: Vec<f64>,
    /// Distances of particles from each wall, and slip lengths, in m.
    distances: Vec<Vec<f64>>,
    slips: Vec<f64>,
    least: f64,
    /// What gravity adds to pressures by a metre, in Pa/m.
    weight: DVec3,
}

impl Scene {
    fn new(positions: &[DVec3], particles: &Particles, time: f64, step: f64) -> Self {
        let space = &particles.space;
        let smooth = space.walls.iter().filter(|wall| wall.slip_length.is_infinite()).cloned().collect();
        let mirrors = Space { walls: smooth, ..space.clone() };
        let kernel = kernel(space);
        let mut around = Surroundings::with(kernel, positions, &mirrors, time, step);
        let first = around.positions.len();
        let wall_at = |wall: usize| space.walls[wall].motion.offset(time);
        for particle in &particles.walls {
            let velocity = space.walls[particle.wall].velocity(time - 0.5 * step, step);
            around.positions.push(particle.at + wall_at(particle.wall));
            around.sources.push(Source {
                of: 0,
                turn: DMat3::ZERO,
                carried: velocity,
                thrown: DVec3::ZERO,
                mirror: DMat3::IDENTITY,
                off: DVec3::ZERO,
                wall: Some(particle.wall),
            });
        }
        around.near = Neighbours::of_first(around.number, &around.positions, kernel.support());
        let standing = space.standing(time);
        let distances =
            around.each(|a| standing.iter().map(|wall| wall.signed_distance(positions[a])).collect());
        Self {
            first,
            depths: particles.walls.iter().map(|particle| particle.depth).collect(),
            distances,
            slips: space.walls.iter().map(|wall| wall.slip_length).collect(),
            least: LEAST * space.spacing,
            weight: particles.fluid.density * particles.fluid.gravity,
            around,
        }
    }

    /// How much faster a wall particle seems to go against the wall than a particle, the other way; none if it is no wall particle.
    fn opposes(&self, a: usize, n: usize) -> Option<f64> {
        let depth = self.depths[n.checked_sub(self.first)?];
        let wall = self.around.sources[n].wall?;
        let (slip, distance) = (self.slips[wall], self.distances[a][wall].max(self.least));
        Some((depth - slip) / (distance + slip))
    }

    /// The velocity in m/s with which a particle sees another one.
    fn velocity(&self, a: usize, n: usize, of: &[DVec3]) -> DVec3 {
        let source = &self.around.sources[n];
        match self.opposes(a, n) {
            Some(share) => source.carried - share * (of[a] - source.carried),
            None => source.turn * of[source.of] + source.carried,
        }
    }

    /// V |W'|/r of a pair.
    fn weight_of(&self, x: DVec3) -> f64 {
        let r = x.length();
        -self.around.volume * self.around.kernel.slope(r) / r
    }

    /// The pressure in Pa of a neighbour.
    fn pressure(&self, a: usize, n: usize, x: DVec3, pressures: &[f64]) -> f64 {
        let source = &self.around.sources[n];
        match self.opposes(a, n) {
            Some(_) => pressures[a] + self.weight.dot(x),
            None => pressures[source.of] + self.weight.dot(source.off),
        }
    }

    fn shear_rates(&self, gradients: &Gradients, velocities: &[DVec3]) -> Vec<f64> {
        self.around.each(|a| {
            norm_of_strain(gradients.velocity_gradient_of(a, |n| {
                if n == a { velocities[a] } else { self.velocity(a, n, velocities) }
            }))
        })
    }

    /// What keeps a pair from going past each other, in Pa s/m2.
    fn friction(&self, x: DVec3, both: f64) -> f64 {
        both * self.weight_of(x)
    }

    fn viscous<const D: usize, const M: usize>(&self, viscosity: &[f64]) -> System<'_, D, M> {
        let row = |a: usize| {
            let mut row = Row::NONE;
            for (n, x, source) in self.around.around(a) {
                match self.opposes(a, n) {
                    Some(share) => {
                        let block = self.friction(x, 2.0 * viscosity[a]) * (1.0 + share) * DMat3::IDENTITY;
                        row.own += block;
                        row.carried += block * source.carried;
                    }
                    None => {
                        let both = viscosity[a] + viscosity[source.of];
                        row.add(a, source, self.friction(x, both) * DMat3::IDENTITY);
                    }
                }
            }
            row
        };
        System::of(&self.around, row)
    }

    fn divergence(&self, a: usize, seen: impl Fn(usize) -> DVec3, own: DVec3) -> f64 {
        self.around.around(a).map(|(n, x, _)| self.weight_of(x) * (seen(n) - own).dot(x)).sum()
    }

    fn slopes(&self, gradients: &Gradients, pressures: &[f64]) -> Vec<DVec3> {
        let around = &self.around;
        let surface = around.surface(gradients);
        let open = |n: u32| (n as usize) < self.first && surface[around.of(n as usize)];
        around.each(|a| {
            let deep = !around.near.of(a).iter().any(|n| open(*n));
            let own = if deep { -pressures[a] } else { pressures[a] };
            let pairs = around.around(a);
            pairs.map(|(n, x, _)| self.weight_of(x) * (own + self.pressure(a, n, x, pressures)) * x).sum()
        })
    }
}

impl Particles {
    /// Shear rates in 1/s half-way in a step in s.
    pub(crate) fn rates_in_three_steps(&self, step: f64) -> Vec<f64> {
        let scene = Scene::new(&self.positions, self, self.time + 0.5 * step, step);
        scene.shear_rates(&scene.around.gradients(), &self.velocities)
    }

    /// Goes on by a step in s in three steps, in which particles go so fast in m/s `past` others; shear rates in 1/s are those by the velocities at its beginning, unless they are `known`.
    pub(crate) fn three_steps(
        &mut self,
        step: f64,
        past: &[f64],
        pressure: PressureStep,
        known: Option<&[f64]>,
    ) -> Result<(), Failure> {
        let (fluid, explicit) = (self.fluid, self.stepping.explicit);
        let scene = Scene::new(&self.positions, self, self.time + 0.5 * step, step);
        let gradients = scene.around.gradients();
        self.shear_rates = match known {
            Some(rates) => rates.to_vec(),
            None => scene.shear_rates(&gradients, &self.velocities),
        };
        let viscosity: Vec<f64> = self.shear_rates.iter().map(|rate| fluid.viscosity(*rate)).collect();
        let weight = fluid.density * fluid.gravity;
        // Gravity goes with the pressure that holds it: fluid at rest stays there.
        let forces = vec![DVec3::ZERO; self.positions.len()];
        let mut velocities = self.velocities.clone();
        let density = fluid.density;
        let start = Start { density, velocities: &self.velocities, step, explicit };
        let viscous: Box<dyn Viscous> = match self.space.dimension {
            Dimension::Two => Box::new(scene.viscous::<2, 3>(&viscosity).step(&start)),
            Dimension::Three => Box::new(scene.viscous::<3, 6>(&viscosity).step(&start)),
        };
        let diffusion = viscous.advance(&forces, &mut velocities)?;
        let go = |share: f64, with: &[DVec3]| -> Vec<DVec3> {
            let way = |((at, one), other): ((&DVec3, &DVec3), &DVec3)| *at + share * step * (*one + *other);
            self.positions.iter().zip(&self.velocities).zip(with).map(way).collect()
        };
        let after = Scene::new(&go(0.5, &velocities), self, self.time + step, step);
        let mut pressures = self.pressures.clone();
        let projection = self.squeeze(&after, &velocities, step, pressure, &mut pressures)?;
        for (u, push) in velocities.iter_mut().zip(scene.slopes(&gradients, &pressures)) {
            *u -= step / density * (push - weight);
        }
        let places = go(0.5, &velocities);
        self.iterations = [diffusion, projection];
        (self.velocities, self.pressures) = (velocities, pressures);
        let there = Surroundings::new(&places, &self.space, self.time + step, step);
        let poisson = Poisson::new(&there, &fluid);
        let spread = poisson.spread(past, step)?;
        let places: Vec<DVec3> = places.iter().zip(spread).map(|(at, way)| *at + way).collect();
        self.arrange(&there, &poisson, &places, past, step);
        self.keep_out(step);
        self.time += step;
        Ok(())
    }

    /// The third step's pressures in Pa, of velocities in m/s after the second. Gives the iterations.
    fn squeeze(
        &self,
        after: &Scene,
        velocities: &[DVec3],
        step: f64,
        pressure: PressureStep,
        pressures: &mut [f64],
    ) -> Result<usize, Failure> {
        let (around, density) = (&after.around, self.fluid.density);
        let gradients = around.gradients();
        let surface = around.surface(&gradients);
        let soft = (SOFT * LENGTH * self.space.spacing).powi(2);
        let row = |a: usize| {
            if surface[a] {
                return (1.0, Vec::new(), 0.0);
            }
            let (mut own, mut others, mut right) = (0.0, Vec::<(u32, f64)>::new(), 0.0);
            for (n, x, source) in around.around(a) {
                let square = x.length_squared();
                let c = 2.0 * after.weight_of(x) * square / (square + soft);
                if after.opposes(a, n).is_some() {
                    right += c * after.weight.dot(x);
                } else {
                    right += c * after.weight.dot(source.off);
                    if source.of != a {
                        own += c;
                        if !surface[source.of] {
                            others.push((source.of as u32, -c));
                        }
                    }
                }
            }
            others.sort_by_key(|(of, _)| *of);
            others.dedup_by(|next, kept| {
                let same = next.0 == kept.0;
                kept.1 += if same { next.1 } else { 0.0 };
                same
            });
            let swells = after.divergence(a, |n| after.velocity(a, n, velocities), velocities[a]);
            right -= density / step * swells;
            (own, others, right)
        };
        let rows = around.each(row);
        let own: Vec<f64> = rows.iter().map(|(own, ..)| *own).collect();
        let right: Vec<f64> = rows.iter().map(|(.., right)| *right).collect();
        let matrix = Matrix::from_rows(rows.into_iter().map(|(own, others, _)| (own, others)));
        match pressure {
            PressureStep::Solve => {
                let places = &around.positions[..around.number];
                let multigrid = Multigrid::<1, 1>::new(&matrix, places, around.spacing);
                let given = surface.contains(&true);
                Ok(solve_poisson(&matrix, &multigrid, given, &right, pressures, &SETTINGS)?.iterations)
            }
            PressureStep::Sweep => {
                let mut product = vec![0.0; right.len()];
                matrix.times(pressures, &mut product);
                for (a, pressure) in pressures.iter_mut().enumerate() {
                    *pressure += (right[a] - product[a]) / own[a].max(f64::MIN_POSITIVE);
                }
                Ok(1)
            }
        }
    }

    /// Friction in N/m3 of the fluid on the particles of the plate after a step in s.
    pub(crate) fn rubbed(&self, plate: &Plate, step: f64) -> DVec3 {
        let scene = Scene::new(&self.positions, self, self.time, step);
        let viscosity: Vec<f64> = self.shear_rates.iter().map(|rate| self.fluid.viscosity(*rate)).collect();
        let of = |a: usize| {
            let mine = scene.around.around(a).filter(|(.., source)| source.wall == Some(plate.wall));
            let pair = |(n, x, source): (usize, DVec3, &Source)| {
                let Some(share) = scene.opposes(a, n) else { return DVec3::ZERO };
                let rubbed = scene.friction(x, 2.0 * viscosity[a]) * (1.0 + share);
                rubbed * (self.velocities[a] - source.carried)
            };
            mine.map(pair).sum::<DVec3>()
        };
        scene.around.each(of).into_iter().sum()
    }
}
