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
//! At the surface c is as in the lattice, and the sum over c x_ij points into the fluid: what is missing on the other side is the stress that is not there.

use tremie_cloud::{Block, Failure, Matrix, Method, Multigrid, Settings, solve};
use tremie_numerics::{DMat3, DVec3};
use tremie_simulation::scattered::Pull;

use crate::stencils::Stencils;

const SETTINGS: Settings = Settings { method: Method::BiCgStab, tolerance: 1e-5, iterations: 2000 };

/// Viscosity times a step over density and spacing^2 up to which the diagonal alone is the preconditioner.
const MILD: f64 = 10.0;

/// Along a line; never here.
const AXES: [&[usize]; 4] = [&[], &[2], &[0, 2], &[0, 1, 2]];

/// Minus div(2 mu E) of nodes in D dimensions, of which cells move and turn in M ways.
pub(crate) struct System<'a, const D: usize, const M: usize> {
    stencils: &'a Stencils<'a>,
    matrix: Matrix<D>,
    /// What walls that move push, in N/m3.
    carried: Vec<f64>,
    largest: f64,
}

/// The components of a vector that count, in a plane x and z.
fn flat<const D: usize>(vector: DVec3) -> [f64; D] {
    std::array::from_fn(|k| vector[AXES[D][k]])
}

/// The neighbours of a node: number, what the difference of velocities is multiplied with.
fn pairs(
    stencils: &Stencils,
    node: usize,
    viscosity: &[f64],
    turns: bool,
) -> impl Iterator<Item = (usize, DMat3)> {
    let around = stencils.around;
    let mean = move |n: usize| {
        let (one, other) = (viscosity[node], viscosity[around.sources[n].of]);
        2.0 * one * other / (one + other)
    };
    let at = around.positions[node];
    let weight = move |n: usize, x: DVec3| stencils.kernel.weight(x.length()) * mean(n);
    let (mut slope, mut moment) = (DVec3::ZERO, DMat3::ZERO);
    if turns && !stencils.loose[node] {
        for (n, _, c) in stencils.pairs(node) {
            let x = around.positions[n] - at;
            let stiff = weight(n, x) * x;
            slope += c * mean(n) * x;
            moment += DMat3::from_cols(x.x * stiff, x.y * stiff, x.z * stiff);
        }
        if stencils.flat() {
            moment.y_axis.y = moment.x_axis.x + moment.z_axis.z;
        }
    }
    let inverse = moment.inverse();
    let turned = if inverse.is_finite() { slope } else { DVec3::ZERO };
    stencils.pairs(node).map(move |(n, _, c)| {
        let mut block = DMat3::from_diagonal(DVec3::splat(c * mean(n)));
        if turned != DVec3::ZERO {
            let x = around.positions[n] - at;
            let g = inverse * (weight(n, x) * x);
            block += DMat3::from_cols(turned.x * g, turned.y * g, turned.z * g);
        }
        (n, block)
    })
}

impl<'a, const D: usize, const M: usize> System<'a, D, M> {
    /// For apparent viscosities in Pa s of nodes; without what `turns` the stress with its gradient if so asked.
    pub(crate) fn new(stencils: &'a Stencils<'a>, viscosity: &[f64], turns: bool) -> Self {
        let around = stencils.around;
        let entries = |block: DMat3| -> Block<D> {
            std::array::from_fn(|i| std::array::from_fn(|j| block.col(AXES[D][j])[AXES[D][i]]))
        };
        let row = |a: usize| {
            let (mut own, mut carried) = (DMat3::ZERO, DVec3::ZERO);
            let mut others: Vec<(u32, DMat3)> = Vec::new();
            for (n, block) in pairs(stencils, a, viscosity, turns) {
                let source = &around.sources[n];
                own += block;
                carried += block * source.carried;
                match source.of == a {
                    true => own -= block * source.turn,
                    false => others.push((source.of as u32, -(block * source.turn))),
                }
            }
            // What comes from images belongs to their nodes; in the order of these, and then of the images.
            others.sort_by_key(|(of, _)| *of);
            others.dedup_by(|next, kept| {
                let same = next.0 == kept.0;
                kept.1 += if same { next.1 } else { DMat3::ZERO };
                same
            });
            let others: Vec<_> = others.into_iter().map(|(of, block)| (of, entries(block))).collect();
            (entries(own), others, flat::<D>(carried))
        };
        let rows = around.each(row);
        let carried = rows.iter().flat_map(|(_, _, carried)| *carried).collect();
        let matrix = Matrix::from_blocks(rows.into_iter().map(|(own, others, _)| (own, others)));
        let largest = viscosity.iter().copied().fold(0.0, f64::max);
        Self { stencils, matrix, carried, largest }
    }

    /// Brings velocities in m/s to the end of a step in s under forces in N/m3; gives the iterations that it took.
    pub(crate) fn advance(
        mut self,
        density: f64,
        forces: &[DVec3],
        velocities: &mut [DVec3],
        start: &[DVec3],
        step: f64,
    ) -> Result<usize, Failure> {
        let (around, rate) = (self.stencils.around, density / step);
        self.matrix.shift(rate);
        let pushed = forces.iter().zip(start).flat_map(|(force, u)| flat::<D>(rate * *u + *force));
        let right: Vec<f64> = pushed.zip(&self.carried).map(|(pushed, carried)| pushed + carried).collect();
        let mut new: Vec<f64> = velocities.iter().flat_map(|u| flat::<D>(*u)).collect();
        let stiff = self.largest > MILD * rate * around.spacing * around.spacing;
        let places = &around.positions[..around.number];
        let multigrid = stiff.then(|| Multigrid::<D, M>::new(&self.matrix, places, around.spacing));
        let solved = solve(&self.matrix, multigrid.as_ref(), &right, &mut new, &SETTINGS)?;
        for (u, new) in velocities.iter_mut().zip(new.as_chunks::<D>().0) {
            AXES[D].iter().zip(new).for_each(|(axis, new)| u[*axis] = *new);
        }
        Ok(solved.iterations)
    }
}

/// 2 E grad mu in N/m3, for nodes that are not at the surface.
pub(crate) fn bends(stencils: &Stencils, viscosity: &[f64], velocities: &[DVec3]) -> Vec<DVec3> {
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
    let of = |a: usize| -> Vec<Pull> {
        let pull = |(n, block): (usize, DMat3)| {
            let source = &around.sources[n];
            let seen = source.turn * velocities[source.of] + source.carried;
            let at = 0.5 * (around.positions[a] + around.positions[n]);
            Some(Pull { wall: source.wall?, at, force: volume * (block * (velocities[a] - seen)) })
        };
        pairs(stencils, a, viscosity, true).filter_map(pull).collect()
    };
    around.each(of).concat()
}
