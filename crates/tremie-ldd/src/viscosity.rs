//! The viscous part of a step: for the new velocities u
//!
//! ```text
//!     rho/dt (u_i - u_i^n) = F_i + sum_j c_ij mu_ij (u_j - u_i) + L_i^T m_i,      m_i = sum_j c_ij mu_ij x_ij
//! ```
//!
//! with the weights c of the Laplacian, mu_ij the harmonic mean, L_i = grad u at the node by neighbours of the weights W mu_ij, and F what else pushes, in N/m3. The sum stands for div(mu grad u) and m for grad mu, so that the last term is
//! (grad u)^T grad mu, and all of it div(2 mu E), which Basic (2021, Eq. 18) writes mu lap u + 2 E grad mu. Both terms are of the new velocities: a solid turn, u_j - u_i = W x_ij with an antisymmetric W,
//! makes the sum W m and the last term -W m, and costs nothing, whatever the viscosities.
//!
//! By those weights the last term resists what the first does, too, or nothing: with others, between a stiff and a soft neighbour at the surface, it could drive the node.
//!
//! Velocities are those half-way between places, and forces those at the places, so that half of the stress should be that of the old velocities u^n: all of it by the new ones is wrong by the first order in
//! the step. As much of it is as leaves what it makes of the old ones a mean of them: a half of it up to a viscosity of rho/(dt sum c), and hardly any where fluid is stiff. The paper takes none.
//!
//! At the surface c is as in the lattice, and the sum over c x_ij points into the fluid: what is missing on the other side is the stress that is not there. Across the surface all of it is raised (`tremie_cloud::stiffness`).

use std::ops::{AddAssign, Mul, Sub};
use std::sync::OnceLock;

use rayon::prelude::*;
use tremie_cloud::stiffness::raise;
use tremie_cloud::{Block, Failure, Matrix, Method, Multigrid, Number, Operator, Settings, solve};
use tremie_numerics::{DMat3, DVec3, DVec4, Vec4};
use tremie_simulation::scattered::Pull;

use crate::stencils::Stencils;

const SETTINGS: Settings = Settings { method: Method::BiCgStab, tolerance: 1e-5, iterations: 2000 };

/// Viscosity times a step over density and spacing^2 up to which the diagonal alone is the preconditioner.
const MILD: f64 = 50.0;
/// Couplings below this share of the largest of either node are left out of the preconditioner.
const WEAK: f64 = 0.2;

/// Largest share of the stress that is of the old velocities.
const OLD: f64 = 0.5;

/// Along a line; never here.
const AXES: [&[usize]; 4] = [&[], &[2], &[0, 2], &[0, 1, 2]];

/// The components of a vector that count, in a plane x and z.
#[inline(always)]
fn flat<const D: usize>(vector: DVec3) -> [f64; D] {
    std::array::from_fn(|k| vector[AXES[D][k]])
}

/// A vector of such components.
#[inline(always)]
fn full<const D: usize>(of: &[f64; D]) -> DVec3 {
    if D == 2 { DVec3::new(of[0], 0.0, of[1]) } else { DVec3::new(of[0], of[1], of[2]) }
}

/// What the difference of velocities to a neighbour in the way x is multiplied with: c mu + B (W mu x) s^T, at the surface raised across it.
#[derive(Debug, Clone, Copy, Default)]
struct Pair<T = f64> {
    /// c mu in Pa s/m2.
    stiff: T,
    /// W mu in Pa s.
    turning: T,
}

/// B and s of a node: s = sum c mu x, and B = (sum W mu x x^T)^-1, and by what forces across the surface are raised; zero where the stress does not turn with its gradient.
#[derive(Debug, Clone, Copy, Default)]
struct Turn {
    inverse: DMat3,
    slope: DVec3,
    raised: DVec3,
}

impl Turn {
    fn block(&self, pair: &Pair, x: DVec3) -> DMat3 {
        let (g, s) = (self.inverse * (pair.turning * x), self.slope);
        let block =
            DMat3::from_diagonal(DVec3::splat(pair.stiff)) + DMat3::from_cols(s.x * g, s.y * g, s.z * g);
        if self.raised == DVec3::ZERO { block } else { raise(self.raised) * block }
    }
}

/// What couples nodes, by apparent viscosities in Pa s; without what `turns` the stress with its gradient if so asked.
fn couplings(stencils: &Stencils, viscosity: &[f64], turns: bool) -> (Vec<Turn>, Vec<Pair>) {
    let around = stencils.around;
    stencils.near.told(|a, pairs: &mut [Pair]| {
        let (at, one) = (around.positions[a], viscosity[a]);
        let (mut slope, mut moment) = (DVec3::ZERO, DMat3::ZERO);
        let weights = &stencils.weights[stencils.near.range(a)];
        for ((pair, (n, _, c)), w) in pairs.iter_mut().zip(stencils.pairs(a)).zip(weights) {
            let (x, other) = (around.positions[n] - at, viscosity[around.of(n)]);
            let mean = 2.0 * one * other / (one + other);
            *pair = Pair { stiff: c * mean, turning: w * mean };
            let way = pair.turning * x;
            slope += pair.stiff * x;
            moment += DMat3::from_cols(x.x * way, x.y * way, x.z * way);
        }
        if stencils.flat() {
            moment.y_axis.y = moment.x_axis.x + moment.z_axis.z;
        }
        let inverse = moment.inverse();
        match turns && !stencils.loose[a] && inverse.is_finite() {
            true => Turn { inverse, slope, raised: stencils.raised[a] },
            false => Turn { inverse: DMat3::ZERO, ..Turn::default() },
        }
    })
}

/// Vectors where they are multiplied: three components and one that is zero, so that they fill a register.
trait Wide:
    Copy
    + Default
    + Send
    + Sync
    + Sub<Output = Self>
    + AddAssign
    + Mul<Self::Part, Output = Self>
    + From<[Self::Part; 4]>
    + Into<[Self::Part; 4]>
{
    /// What components are.
    type Part: Number;

    fn dot(self, other: Self) -> Self::Part;
}

impl Wide for Vec4 {
    type Part = f32;

    #[inline(always)]
    fn dot(self, other: Self) -> f32 {
        self.dot(other)
    }
}

impl Wide for DVec4 {
    type Part = f64;

    #[inline(always)]
    fn dot(self, other: Self) -> f64 {
        self.dot(other)
    }
}

/// A vector of so many components.
#[inline(always)]
fn wide<const D: usize, V: Wide>(of: &[V::Part; D]) -> V {
    V::from(std::array::from_fn(|k| of.get(k).copied().unwrap_or_default()))
}

/// The same vector in other digits.
fn told<V: Wide>(of: DVec4) -> V {
    V::from(of.to_array().map(V::Part::told))
}

/// What a node makes of the differences of velocities around it: a `Turn` by columns of B, and density over the step and the share of its stress that is of the new velocities.
#[derive(Debug, Clone, Copy)]
struct Row<V: Wide> {
    inverse: [V; 3],
    slope: V,
    raised: V,
    rate: V::Part,
}

/// Minus div(2 mu E), and what the mass of nodes adds.
struct Coupled<V: Wide> {
    /// Places of nodes and images in m.
    places: Vec<V>,
    rows: Vec<Row<V>>,
    pairs: Vec<Pair<V::Part>>,
}

impl Coupled<DVec4> {
    /// The same in other digits.
    fn told<V: Wide>(&self) -> Coupled<V> {
        let row = |row: &Row<DVec4>| Row {
            inverse: row.inverse.map(told),
            slope: told(row.slope),
            raised: told(row.raised),
            rate: V::Part::told(row.rate),
        };
        let pair =
            |pair: &Pair| Pair { stiff: V::Part::told(pair.stiff), turning: V::Part::told(pair.turning) };
        Coupled {
            places: self.places.par_iter().with_min_len(1024).map(|at| told(*at)).collect(),
            rows: self.rows.par_iter().with_min_len(1024).map(row).collect(),
            pairs: self.pairs.par_iter().with_min_len(1024).map(pair).collect(),
        }
    }
}

impl<V: Wide> Coupled<V> {
    /// `to` = A x.
    fn times<const D: usize>(&self, stencils: &Stencils, x: &[V::Part], to: &mut [V::Part]) {
        let around = stencils.around;
        let own = x.as_chunks::<D>().0;
        let mut seen: Vec<[V; 2]> = Vec::with_capacity(self.places.len());
        seen.extend(own.iter().zip(&self.places).map(|(u, at)| [wide::<D, V>(u), *at]));
        let images = around.sources[around.number..].iter().zip(&self.places[around.number..]);
        seen.extend(images.map(|(source, at)| {
            let turned: [f64; D] = flat(source.turn * full(&own[source.of].map(Number::in_full)));
            [wide::<D, V>(&turned.map(V::Part::told)), *at]
        }));
        let row = |a: usize, to: &mut [V::Part; D]| {
            let ([u, at], row) = (seen[a], &self.rows[a]);
            let (mut force, mut turned) = (V::default(), V::default());
            for (n, pair) in stencils.near.of(a).iter().zip(&self.pairs[stencils.near.range(a)]) {
                let [other, place] = seen[*n as usize];
                let past = u - other;
                force += past * pair.stiff;
                turned += (place - at) * (pair.turning * row.slope.dot(past));
            }
            for (column, turned) in row.inverse.into_iter().zip(turned.into()) {
                force += column * turned;
            }
            force += row.raised * row.raised.dot(force);
            force += u * row.rate;
            let force: [V::Part; 4] = force.into();
            *to = std::array::from_fn(|k| force[k]);
        };
        around.fill(to.as_chunks_mut::<D>().0, row);
    }
}

/// The system of a step for nodes in D dimensions, of which cells move and turn in M ways.
struct System<'a, const D: usize, const M: usize> {
    stencils: &'a Stencils<'a>,
    coupled: Coupled<DVec4>,
    /// The same in 32 bits, once it is asked for.
    roughly: OnceLock<Coupled<Vec4>>,
    diagonal: Vec<[f64; D]>,
    /// Velocities in m/s at the start.
    start: Vec<[f64; D]>,
    /// What walls that move push, and what is of the old velocities only, in N/m3.
    carried: Vec<[f64; D]>,
    /// Whether cells of nodes move as one.
    multigrid: Option<Multigrid<D, M>>,
    /// Share of the stress that is of the new velocities.
    shares: Vec<f64>,
}

fn entries<const D: usize>(block: DMat3) -> Block<D> {
    std::array::from_fn(|i| std::array::from_fn(|j| block.col(AXES[D][j])[AXES[D][i]]))
}

/// What brings velocities to the end of a step.
pub(crate) trait Viscous {
    /// Brings velocities in m/s to the end of the step under forces in N/m3, from such as are near; gives the iterations that it took.
    fn advance(&self, forces: &[DVec3], velocities: &mut [DVec3]) -> Result<usize, Failure>;
}

/// For apparent viscosities in Pa s of nodes, a density over the step in kg/(m3 s) and velocities in m/s at its start; as in the paper without the stress that is `turning` with its gradient, and all by new velocities.
pub(crate) fn system<'a>(
    stencils: &'a Stencils<'a>,
    viscosity: &[f64],
    turning: bool,
    rate: f64,
    start: &[DVec3],
) -> Box<dyn Viscous + 'a> {
    match stencils.flat() {
        true => Box::new(System::<2, 3>::new(stencils, viscosity, turning, rate, start)),
        false => Box::new(System::<3, 6>::new(stencils, viscosity, turning, rate, start)),
    }
}

impl<'a, const D: usize, const M: usize> System<'a, D, M> {
    fn new(stencils: &'a Stencils<'a>, viscosity: &[f64], turning: bool, rate: f64, start: &[DVec3]) -> Self {
        let around = stencils.around;
        let (turns, pairs) = couplings(stencils, viscosity, turning);
        let at = &around.positions;
        let others = |a: usize| {
            let range = stencils.near.range(a);
            let near = stencils.near.of(a).iter().map(|n| *n as usize).zip(&pairs[range]);
            near.map(move |(n, pair)| (at[n] - at[a], pair, around.image(n), around.of(n)))
        };
        let share = |a: usize| {
            // From 0: the sum of nothing is -0, and over that a node by itself would have no mass.
            let stiff = others(a).fold(0.0, |sum, (_, pair, ..)| sum + pair.stiff.abs());
            if turning { 1.0 - (rate / stiff).min(OLD) } else { 1.0 }
        };
        let shares = around.each(share);
        let rates: Vec<f64> = shares.iter().map(|share| rate / share).collect();
        let bends = if turning { Vec::new() } else { bends(stencils, viscosity, start) };
        let own = |a: usize| {
            let mut own = DMat3::from_diagonal(DVec3::splat(rates[a]));
            let mut carried = bends.get(a).copied().unwrap_or_default();
            // All of them are as one that weighs and turns as they do together.
            let (mut all, mut way) = (Pair { stiff: 0.0, turning: 1.0 }, DVec3::ZERO);
            for (x, pair, image, of) in others(a) {
                all.stiff += pair.stiff;
                way += pair.turning * x;
                if let Some(image) = image {
                    let block = turns[a].block(pair, x);
                    carried += block * image.carried;
                    if of == a {
                        own -= block * image.turn;
                    }
                }
            }
            own += turns[a].block(&all, way);
            (flat(DVec3::new(own.x_axis.x, own.y_axis.y, own.z_axis.z)), flat(carried))
        };
        let (diagonal, carried) = around.each(own).into_iter().unzip();
        let largest = viscosity.iter().copied().fold(0.0, f64::max);
        let multigrid = (largest > MILD * rate * around.spacing * around.spacing).then(|| {
            let most = around.each(|a| others(a).map(|(_, pair, ..)| pair.stiff.abs()).fold(0.0, f64::max));
            let row = |a: usize, row: &mut Vec<(u32, Block<D>)>| {
                let mut own = DMat3::from_diagonal(DVec3::splat(rates[a]));
                for (x, pair, image, of) in others(a) {
                    let weak = pair.stiff.abs() < WEAK * most[a].min(most[of]);
                    if weak && image.is_none() {
                        continue;
                    }
                    let block = turns[a].block(pair, x);
                    let seen = image.map_or(block, |image| block * image.turn);
                    own += block;
                    if of == a || weak {
                        own -= seen;
                    } else {
                        row.push((of as u32, entries(-seen)));
                    }
                }
                entries(own)
            };
            let strong = Matrix::build(around.number, row);
            Multigrid::new(&strong, &at[..around.number], around.spacing)
        });
        let row = |(turn, rate): (&Turn, &f64)| {
            let columns = entries::<D>(turn.inverse.transpose());
            Row {
                inverse: std::array::from_fn(|k| columns.get(k).map_or(DVec4::ZERO, wide)),
                slope: wide(&flat::<D>(turn.slope)),
                raised: wide(&flat::<D>(turn.raised)),
                rate: *rate,
            }
        };
        let coupled = Coupled {
            places: at.iter().map(|at| wide(&flat::<D>(*at))).collect(),
            rows: turns.iter().zip(&rates).map(row).collect(),
            pairs,
        };
        let start = start.iter().map(|u| flat(*u)).collect();
        Self { stencils, coupled, roughly: OnceLock::new(), diagonal, start, carried, multigrid, shares }
    }
}

impl<const D: usize, const M: usize> Viscous for System<'_, D, M> {
    fn advance(&self, forces: &[DVec3], velocities: &mut [DVec3]) -> Result<usize, Failure> {
        let old = &self.start;
        let mut kept = vec![[0.0; D]; old.len()];
        self.times(old.as_flattened(), kept.as_flattened_mut());
        let right = (0..old.len()).flat_map(|a| {
            let (force, carried, share, rate) =
                (flat::<D>(forces[a]), &self.carried[a], self.shares[a], self.coupled.rows[a].rate);
            let (old, kept) = (&old[a], &kept[a]);
            std::array::from_fn::<f64, D, _>(|k| {
                (rate * old[k] + force[k] + carried[k] - (1.0 - share) * kept[k]) / share
            })
        });
        let right: Vec<f64> = right.collect();
        let mut new: Vec<f64> = velocities.iter().flat_map(|u| flat::<D>(*u)).collect();
        let solved = solve(self, self.multigrid.as_ref(), &right, &mut new, &SETTINGS)?;
        for (u, new) in velocities.iter_mut().zip(new.as_chunks::<D>().0) {
            AXES[D].iter().zip(new).for_each(|(axis, new)| u[*axis] = *new);
        }
        Ok(solved.iterations)
    }
}

impl<const D: usize, const M: usize> Operator for System<'_, D, M> {
    fn times(&self, x: &[f64], to: &mut [f64]) {
        self.coupled.times::<D>(self.stencils, x, to);
    }

    fn times_roughly(&self, x: &[f32], to: &mut [f32]) {
        self.roughly.get_or_init(|| self.coupled.told()).times::<D>(self.stencils, x, to);
    }

    fn over_diagonal<T: Number>(&self, of: &[T], to: &mut [T]) {
        let all = to.par_iter_mut().zip(of).zip(self.diagonal.as_flattened()).with_min_len(1024);
        all.for_each(|((to, of), diagonal)| *to = *of / T::told(*diagonal));
    }
}

/// 2 E grad mu in N/m3, for nodes that are not at the surface.
fn bends(stencils: &Stencils, viscosity: &[f64], velocities: &[DVec3]) -> Vec<DVec3> {
    let around = stencils.around;
    let (all, mu) = (around.velocities(velocities), around.mirrored(|source| viscosity[source.of]));
    around.each(|a| {
        let l = stencils.velocity_gradient(a, &all);
        if stencils.surface[a] { DVec3::ZERO } else { (l + l.transpose()) * stencils.gradient(a, &mu) }
    })
}

/// What walls are pulled by: what images in them give their nodes.
pub(crate) fn pulls(stencils: &Stencils, viscosity: &[f64], velocities: &[DVec3], volume: f64) -> Vec<Pull> {
    let around = stencils.around;
    let (turns, pairs) = couplings(stencils, viscosity, true);
    let of = |a: usize| -> Vec<Pull> {
        let pull = |(n, pair): (&u32, &Pair)| {
            let (n, at) = (*n as usize, around.positions[a]);
            let source = &around.sources[n];
            let wall = source.wall?;
            let seen = source.turn * velocities[source.of] + source.carried;
            let block = turns[a].block(pair, around.positions[n] - at);
            let at = 0.5 * (at + around.positions[n]);
            Some(Pull { wall, at, force: volume * (block * (velocities[a] - seen)) })
        };
        stencils.near.of(a).iter().zip(&pairs[stencils.near.range(a)]).filter_map(pull).collect()
    };
    around.each(of).concat()
}
