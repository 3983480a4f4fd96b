//! The viscous part of a step: for the new velocities u
//!
//! ```text
//!     rho/dt (u_a - u_a^n) = F_a + sum_b V 2 (d + 2) S_ab mu_ab (u_a - u_b) . x_ab f(r) x_ab / (r^2 + eta^2)
//! ```
//!
//! with `mu_ab` the harmonic mean, S what the pairs stand for and F what else pushes, in N/m3. On the right are new and old velocities: half of the stress should be of each, as both are those of one half of the way. As much is of the old ones as the stiffest particle bears, whom it must
//! not throw beyond their mean: a half up to a viscosity of rho/dt over what multiplies it, hardly any where fluid is stiff; the same share for all, or pairs would not act as they are acted on. Explicit steps take all of it. The radial form (Monaghan 2005; Espanol and Revenga 2003) stands for
//! div(2 mu E), with what varies of mu, and conserves both momenta.
//!
//! With `f = -W'/r` of the kernel shear along the axes of a lattice would meet 0.89 of the viscosity, as sums over neighbours stand for integrals, and shear at 45 degrees to them as much too much: the
//! nearest neighbours count too much. With `f ~ r^m (1 - r/R)^(9/2)`, R the kernel's support and m = 3 in a plane, 5/2 in space, and the factor that a lattice at rest then needs, it is 0.99 to 1.01 for
//! both, and wherever the rows of a lattice are that slide along each other.
//!
//! A particle at the surface has half of the pairs of others, and would bear half of the stress along it. So pairs stand for more where
//! some are missing, `S_ab = (S_a + S_b)/2` with S_a the sum of f r^2 of a lattice over that around a: then what a particle dissipates is that of its shear rate, and still no stress goes through the surface. So they stand for less where
//! particles crowd; if only for more, the fluid would be too viscous, by 0.5 % in Taylor's vortices. Across the surface forces on particles there are raised, and pressures push them as much (`tremie_cloud::stiffness`).
//!
//! Among disordered particles these forces are not zero where the shear rate is even, and what they set in motion makes the fluid too thin, by 1.2 % in Taylor's vortices. So where a particle has neighbours
//! on all sides each is weighed by `1 - x_ab . b_a`, with the b of module `tremie_cloud::operators` for these weights, as in the Laplacian of Lagrangian differencing dynamics: 0.2 to 0.3 % in short steps. Right
//! below a surface nothing is changed, or it would not be free of stress.

use tremie_cloud::stiffness::{self, raise, raised};
use tremie_cloud::{
    Block, Dimension, Failure, Gradients, Matrix, Method, Multigrid, Operator, Settings, Source,
    Surroundings, solve,
};
use tremie_numerics::{DMat3, DVec3};

const SETTINGS: Settings = Settings { method: Method::BiCgStab, tolerance: 2e-7, iterations: 2000 };

/// Largest share of the stress that is of the old velocities.
const OLD: f64 = 0.5;
/// The share of a smoothing length that is added to distances where they divide (Wu 2016: eta = 0.01 h).
const SOFT: f64 = 0.01;
/// What the pairs of a particle stand for at most, over those in the midst of a lattice. Where it would be more, in threads and drops, they stand for themselves, or systems are hardly
/// to be solved. (A corner of right angles in a plane would need 4.)
const CORNER: f64 = 3.0;

/// Minus div(2 mu E) of particles in D dimensions, of which pieces move and turn in M ways.
pub(crate) struct System<'a, const D: usize, const M: usize> {
    around: &'a Surroundings,
    matrix: Matrix<D>,
    /// The largest of what multiplies the velocity of a particle itself, in Pa s/m2.
    stiffest: f64,
    /// What walls that move push, in N/m3.
    carried: Vec<f64>,
}

/// What multiplies the velocities of a particle itself and of others, and what walls that move push.
#[derive(Debug, Clone)]
pub(crate) struct Row {
    pub(crate) own: DMat3,
    others: Vec<(u32, DMat3)>,
    pub(crate) carried: DVec3,
}

impl Row {
    /// Nothing yet.
    pub(crate) const NONE: Self = Self { own: DMat3::ZERO, others: Vec::new(), carried: DVec3::ZERO };

    /// Adds the pair of a particle and another one, an image or a copy.
    pub(crate) fn add(&mut self, a: usize, source: &Source, block: DMat3) {
        self.own += block;
        self.carried += block * source.carried;
        match source.of == a {
            true => self.own -= block * source.turn,
            false => self.others.push((source.of as u32, -(block * source.turn))),
        }
    }
}

/// Along a line; never here.
const AXES: [&[usize]; 4] = [&[], &[2], &[0, 2], &[0, 1, 2]];

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

/// What a pair of two particles, so far in m from each other and so viscous in Pa s each, adds to the force, as a matrix to be multiplied with the difference of their velocities.
fn pairs<'a>(around: &'a Surroundings, viscosity: &'a [f64]) -> impl Fn(DVec3, usize, usize) -> DMat3 + 'a {
    let d = around.dimension.number();
    let weight = weight(around);
    // f r^2 of a lattice sums up to the number of dimensions.
    let whole = around.on_lattice(|r| weight(r) * r * r);
    let constant = around.volume * 2.0 * (d * (d + 2)) as f64 / whole;
    let soft = (0.5 * SOFT * around.kernel.support()).powi(2);
    let share = |x: DVec3| around.volume * weight(x.length()) * x.length_squared();
    let stands_for = around.each(|a| {
        let found: f64 = around.around(a).map(|(_, x, _)| share(x)).sum();
        let stands_for = whole / found;
        if stands_for > CORNER { 1.0 } else { stands_for }
    });
    move |x, a, b| {
        let r = x.length();
        let mean = 2.0 * viscosity[a] * viscosity[b] / (viscosity[a] + viscosity[b]);
        let both = 0.5 * (stands_for[a] + stands_for[b]);
        let factor = constant * both * mean * weight(r) / (r * r + soft);
        DMat3::from_cols(factor * x.x * x, factor * x.y * x, factor * x.z * x)
    }
}

/// The components of a vector that count, in a plane x and z.
fn flat<const D: usize>(vector: DVec3) -> [f64; D] {
    std::array::from_fn(|k| vector[AXES[D][k]])
}

/// How particles at the surface stand open to what is not there (`tremie_cloud::stiffness`); zero for others.
pub(crate) struct Openness {
    /// By how much more than along it forces across the surface count.
    raised: Vec<DVec3>,
    /// By what an even stress pushes, in 1/m.
    pub(crate) open: Vec<DVec3>,
}

impl Openness {
    /// Of so many particles that are pushed as if nobody were at the surface.
    pub(crate) fn none(number: usize) -> Self {
        Self { raised: vec![DVec3::ZERO; number], open: vec![DVec3::ZERO; number] }
    }

    /// By what gradients are formed with, of particles of which some at the `surface` have a pressure.
    pub(crate) fn new(around: &Surroundings, gradients: &Gradients, surface: &[bool]) -> Self {
        let even = vec![1.0; around.number];
        let pair = pairs(around, &even);
        let sides = (around.dimension.number() - 1) as f64;
        let of = |a: usize| {
            let leaning = surface[a].then(|| gradients.leaning(a)).flatten();
            let (Some(leaning), Some(slopes)) = (leaning, gradients.slopes(a)) else {
                return (DVec3::ZERO, DVec3::ZERO);
            };
            let normal = -leaning.normalize_or_zero();
            // What pairs make of the strain that has the stress one across the surface, and is even along it.
            let push = |(_, x, source): (usize, DVec3, &Source)| {
                let through = x.dot(normal) * normal;
                pair(x, a, source.of) * (0.5 * (through - (x - through) / sides))
            };
            let open: DVec3 = around.around(a).map(push).sum();
            let raised = raised(normal, open, slopes.sum());
            (raised, raise(raised) * open)
        };
        let (raised, open) = around.each(of).into_iter().unzip();
        Self { raised, open }
    }
}

/// Viscosities in Pa s that particles feel.
pub(crate) fn felt(around: &Surroundings, viscosity: &[f64]) -> Vec<f64> {
    let weight = weight(around);
    around.each(|a| {
        let pairs = around.around(a);
        let pair = |(_, x, source): (usize, DVec3, &Source)| {
            (weight(x.length()) * x.length_squared(), viscosity[source.of])
        };
        stiffness::felt(viscosity[a], pairs.map(pair))
    })
}

impl<'a, const D: usize, const M: usize> System<'a, D, M> {
    /// For apparent viscosities in Pa s of particles of which some are at the `surface`, and how they stand open there.
    pub(crate) fn new(
        around: &'a Surroundings,
        surface: &[bool],
        openness: &Openness,
        viscosity: &[f64],
    ) -> Self {
        let pair = pairs(around, viscosity);
        let lean = leaning(around, surface);
        Self::of(around, |a| {
            let mut row = Row::NONE;
            let raise = raise(openness.raised[a]);
            for (_, x, source) in around.around(a) {
                let block = (1.0 - x.dot(lean[a])) * pair(x, a, source.of);
                row.add(a, source, raise * block);
            }
            row
        })
    }

    /// By the rows of particles.
    pub(crate) fn of(around: &'a Surroundings, row: impl Fn(usize) -> Row + Sync + Send) -> Self {
        let entries = |block: DMat3| -> Block<D> {
            std::array::from_fn(|i| std::array::from_fn(|j| block.col(AXES[D][j])[AXES[D][i]]))
        };
        let row = |a: usize| {
            let row = row(a);
            let mut others = row.others;
            // What comes from images belongs to their particles; in the order of these, and then of the images.
            others.sort_by_key(|(of, _)| *of);
            others.dedup_by(|next, kept| {
                let same = next.0 == kept.0;
                kept.1 += if same { next.1 } else { DMat3::ZERO };
                same
            });
            let others: Vec<_> = others.into_iter().map(|(of, block)| (of, entries(block))).collect();
            (entries(row.own), others, flat::<D>(row.carried))
        };
        let rows = around.each(row);
        let stiff = |own: &Block<D>| (0..D).map(|k| own[k][k]).sum::<f64>() / D as f64;
        let stiffest = rows.iter().map(|(own, ..)| stiff(own)).fold(0.0, f64::max);
        let carried = rows.iter().flat_map(|(_, _, carried)| *carried).collect();
        let matrix = Matrix::from_blocks(rows.into_iter().map(|(own, others, _)| (own, others)));
        Self { around, matrix, stiffest, carried }
    }

    /// What is to be solved for the velocities at the end of a step.
    pub(crate) fn step(mut self, start: &Start) -> Step<D, M> {
        let Start { density, velocities, step, explicit } = *start;
        let rate = density / step;
        // Of the new velocities.
        let share = if explicit { 0.0 } else { 1.0 - (rate / self.stiffest).min(OLD) };
        let before: Vec<f64> = velocities.iter().flat_map(|u| flat::<D>(*u)).collect();
        let mut braked = vec![0.0; before.len()];
        self.matrix.times(&before, &mut braked);
        let pushed = before.iter().zip(self.carried.iter().zip(&braked));
        let still = pushed.map(|(u, (carried, braked))| rate * u + carried - (1.0 - share) * braked);
        let still = still.collect();
        if explicit {
            return Step { still, whole: rate, solver: None };
        }
        self.matrix.shift(rate / share);
        let around = self.around;
        let places = &around.positions[..around.number];
        let multigrid = Multigrid::<D, M>::new(&self.matrix, places, around.spacing);
        Step { still, whole: share, solver: Some((self.matrix, multigrid)) }
    }
}

/// A step of the viscous part that can be taken under any forces.
pub(crate) trait Viscous {
    /// Brings velocities in m/s to the end of the step under forces in N/m3, from such as are near; gives the iterations that it took.
    fn advance(&self, forces: &[DVec3], velocities: &mut [DVec3]) -> Result<usize, Failure>;
}

/// What a step starts from.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Start<'a> {
    /// In kg/m3.
    pub(crate) density: f64,
    /// In m/s.
    pub(crate) velocities: &'a [DVec3],
    /// In s.
    pub(crate) step: f64,
    /// Whether the stress is that of those velocities, and not of the new ones.
    pub(crate) explicit: bool,
}

/// Such a step of particles of which some are at the `surface`, by apparent viscosities in Pa s.
pub(crate) fn system(
    around: &Surroundings,
    surface: &[bool],
    openness: &Openness,
    viscosity: &[f64],
    start: &Start,
) -> Box<dyn Viscous> {
    match around.dimension {
        Dimension::Two => Box::new(System::<2, 3>::new(around, surface, openness, viscosity).step(start)),
        Dimension::Three => Box::new(System::<3, 6>::new(around, surface, openness, viscosity).step(start)),
    }
}

/// The same in D dimensions, of which pieces move and turn in M ways.
pub(crate) struct Step<const D: usize, const M: usize> {
    /// What the momentum would be over the step without forces, but for the stress of the new velocities, in N/m3.
    still: Vec<f64>,
    /// What that is divided by.
    whole: f64,
    /// What the new velocities are multiplied with; nothing else in explicit steps.
    solver: Option<(Matrix<D>, Multigrid<D, M>)>,
}

impl<const D: usize, const M: usize> Viscous for Step<D, M> {
    fn advance(&self, forces: &[DVec3], velocities: &mut [DVec3]) -> Result<usize, Failure> {
        let forces = forces.iter().flat_map(|force| flat::<D>(*force));
        let right = self.still.iter().zip(forces).map(|(still, force)| (still + force) / self.whole);
        let right: Vec<f64> = right.collect();
        let (new, iterations) = match &self.solver {
            Some((matrix, multigrid)) => {
                let mut new: Vec<f64> = velocities.iter().flat_map(|u| flat::<D>(*u)).collect();
                let solved = solve(matrix, Some(multigrid), &right, &mut new, &SETTINGS)?;
                (new, solved.iterations)
            }
            None => (right, 0),
        };
        for (u, new) in velocities.iter_mut().zip(new.as_chunks::<D>().0) {
            AXES[D].iter().zip(new).for_each(|(axis, new)| u[*axis] = *new);
        }
        Ok(iterations)
    }
}

/// What walls are pulled by: each with the place in m half-way to an image in it and the force of the pair in N/m3.
pub(crate) fn pulls(
    around: &Surroundings,
    viscosity: &[f64],
    velocities: &[DVec3],
) -> Vec<(usize, DVec3, DVec3)> {
    let pair = pairs(around, viscosity);
    let mut pulls = Vec::new();
    for a in 0..around.number {
        for (_, x, source) in around.around(a) {
            if let Some(wall) = source.wall {
                let seen = source.turn * velocities[source.of] + source.carried;
                let block = pair(x, a, source.of);
                pulls.push((wall, around.positions[a] + 0.5 * x, block * (velocities[a] - seen)));
            }
        }
    }
    pulls
}

/// The viscous force in N/m3 that a wall bears, and with it what lies beside it: of the force on each particle the share that there is of it `beside` the wall.
pub(crate) fn drag(
    around: &Surroundings,
    viscosity: &[f64],
    velocities: &[DVec3],
    wall: usize,
    beside: &[f64],
) -> DVec3 {
    let surface = around.surface(&around.gradients());
    let (pair, lean) = (pairs(around, viscosity), leaning(around, &surface));
    let of = |a: usize| {
        let drag = |(_, x, source): (usize, DVec3, &Source)| {
            let onto_wall = if source.wall == Some(wall) { 1.0 } else { 0.0 };
            let share = onto_wall - beside[a];
            if share == 0.0 {
                return DVec3::ZERO;
            }
            let seen = source.turn * velocities[source.of] + source.carried;
            let block = share * (1.0 - x.dot(lean[a])) * pair(x, a, source.of);
            block * (velocities[a] - seen)
        };
        around.around(a).map(drag).sum::<DVec3>()
    };
    around.each(of).into_iter().sum()
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;
    use crate::Space;
    use tremie_cloud::{Dimension, nodes};
    use tremie_geometry::{Body, Shape};
    use tremie_numerics::DQuat;

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

    /// Fluid that has yielded around a stiff thread that hangs into it and out of it: hardly anything in the rows of the thread tells what holds it.
    #[test]
    fn stiff_threads_in_soft_fluid_hardly_take_longer() {
        let spacing = 0.02;
        let iterations = |contrast: f64| {
            let body = Body::Shape(Shape::Box { min: DVec3::splat(-0.5), max: DVec3::new(0.5, 0.5, 0.1) });
            let mut positions = nodes(&body, spacing, Dimension::Two, 0.0);
            positions.extend((0..20).map(|n| DVec3::new(0.01, 0.0, 0.11 + spacing * f64::from(n))));
            let around = Surroundings::new(&positions, &Space::free(Dimension::Two, spacing), 0.0, 1.0);
            let stiff = |at: &DVec3| (at.x - 0.01).abs() < 0.5 * spacing && at.z > -0.3;
            let viscosity: Vec<f64> =
                positions.iter().map(|at| if stiff(at) { 50.0 * contrast } else { 50.0 }).collect();
            let gradients = around.gradients();
            let surface = around.surface(&gradients);
            let openness = Openness::new(&around, &gradients, &surface);
            let forces: Vec<DVec3> =
                positions.iter().map(|at| DVec3::new(9.0 * at.z, 0.0, -2e4 * at.x)).collect();
            let still = vec![DVec3::ZERO; positions.len()];
            let mut velocities = still.clone();
            System::<2, 3>::new(&around, &surface, &openness, &viscosity)
                .step(&Start { density: 2000.0, velocities: &still, step: 0.01, explicit: false })
                .advance(&forces, &mut velocities)
                .unwrap()
        };
        let [even, stiff] = [1.0, 1e3].map(iterations);
        assert!(stiff <= 2 * even, "{even} {stiff}");
    }

    /// Share of the viscous force in the midst of a lattice that is put elsewhere.
    fn share(dimension: Dimension, spacing: f64, put: impl Fn(DVec3) -> DVec3) -> f64 {
        let body = Body::Shape(Shape::Box { min: DVec3::splat(-0.5), max: DVec3::splat(0.5) });
        let positions: Vec<DVec3> = nodes(&body, spacing, dimension, 0.0).iter().map(|at| put(*at)).collect();
        let around = Surroundings::new(&positions, &Space::free(dimension, spacing), 0.0, 1.0);
        let density = 1000.0;
        // Free of divergence: (z^2, 0, x^2).
        let viscosity: Vec<f64> = positions.iter().map(|at| 3.0 * (1.0 + 0.5 * at.x)).collect();
        let before: Vec<DVec3> =
            positions.iter().map(|at| DVec3::new(at.z * at.z, 0.0, at.x * at.x)).collect();
        let (mut after, step) = (before.clone(), 0.02);
        let gradients = around.gradients();
        let surface = around.surface(&gradients);
        let openness = Openness::new(&around, &gradients, &surface);
        let still = vec![DVec3::ZERO; positions.len()];
        let start = Start { density, velocities: &before, step, explicit: false };
        let system = system(&around, &surface, &openness, &viscosity, &start);
        let solved = system.advance(&still, &mut after);
        assert!(solved.is_ok(), "{solved:?}");
        let (mut sum, mut whole) = (0.0, 0.0);
        for n in (0..positions.len()).filter(|n| positions[*n].abs().max_element() < 0.2) {
            let at = positions[n];
            // mu lap u + 2 E grad mu
            let exact = 6.0 * (1.0 + 0.5 * at.x) * DVec3::new(1.0, 0.0, 1.0)
                + DVec3::new(0.0, 0.0, 3.0 * (at.x + at.z));
            sum += exact.dot((after[n] - before[n]) * density / step);
            whole += exact.length_squared();
        }
        sum / whole
    }
}
