//! Rows whose cells collide together, as vectors.
//!
//! A collision is written for one cell (`collision`). The loops over cells are functions of their own, in which it is plain that nothing read
//! is written: only then does the compiler do all cells in one run. Rows full of fluid go in pairs: sixteen numbers of 32 bits are one
//! vector of AVX-512, and take half the instructions of two rows one after the other. Laws that are looked up in tables are asked by
//! row instead ([`Law::BY_ROW`]). `own` is what the rows' flow curves have of their own ([`Law::own`]).

use crate::collision::{Held, collide, rescale};
use crate::lanes::{LANES, Lanes};
use crate::lattice::Q;
use crate::processor::for_this_processor;
use crate::real::{Number, Real, by_axis};
use crate::relaxation::Law;

/// What drives the fluid and resists, in lattice units.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Physics<T, R> {
    /// Acceleration.
    pub(crate) gravity: [T; 3],
    /// Flow curve.
    pub(crate) law: R,
    /// Least relaxation rate of the odd moments.
    pub(crate) least_odd: T,
}

/// Populations of a row.
pub(crate) type Populations<T> = [Lanes<T>; Q];

impl<T> From<[Lanes<T>; 2]> for Held<Lanes<T>> {
    fn from([mass, least]: [Lanes<T>; 2]) -> Self {
        Self::Partly { mass, least }
    }
}

/// [`rescale`] for a row; the density too. Few steps do it, and it is not worth a copy in every kernel.
#[inline(never)]
pub(crate) fn rescale_row<T: Real, R: Law<T>>(
    f: &Populations<T>,
    held: Held<Lanes<T>>,
    own: &R::Own,
    physics: &Physics<T, R>,
    factor: T,
    to: &mut [[T; LANES]; Q],
) -> Lanes<T> {
    let gravity = by_axis(|a| Lanes::splat(physics.gravity[a]));
    let (post, density) = rescale(f, held, gravity, &physics.law.row(own), Lanes::splat(factor));
    for i in 0..Q {
        to[i] = post[i].0;
    }
    density
}

/// Populations of two rows beside each other: sixteen numbers are one vector, where processors have such.
#[derive(Clone, Copy, bytemuck::Zeroable)]
#[repr(C, align(64))]
pub(crate) struct Pair<T>(pub(crate) [[[T; LANES]; 2]; Q]);

/// Collides the cells of two rows that hold nothing but fluid; the densities too.
#[inline(always)]
fn collide_pair<T: Real, R: Law<T>>(
    f: &Pair<T>,
    own: &[R::Own; 2],
    physics: &Physics<T, R>,
    to: &mut Pair<T>,
    density: &mut [[T; LANES]; 2],
) {
    if R::BY_ROW {
        let gravity = by_axis(|a| Lanes::splat(physics.gravity[a]));
        let least_odd = Lanes::splat(physics.least_odd);
        for half in 0..2 {
            let f: Populations<T> = std::array::from_fn(|i| Lanes(f.0[i][half]));
            let law = physics.law.row(&own[half]);
            let (post, dense) = collide(&f, Held::Whole, gravity, &law, least_odd);
            for i in 0..Q {
                to.0[i][half] = post[i].0;
            }
            density[half] = dense.0;
        }
        return;
    }
    // One by one, of which the compiler makes one run over all sixteen.
    for k in 0..2 * LANES {
        let f: [T; Q] = std::array::from_fn(|i| f.0[i].as_flattened()[k]);
        let law = physics.law.cell(&own[k / LANES], k % LANES);
        let (post, dense) = collide(&f, Held::Whole, physics.gravity, &law, physics.least_odd);
        for i in 0..Q {
            to.0[i].as_flattened_mut()[k] = post[i];
        }
        density.as_flattened_mut()[k] = dense;
    }
}

/// The same for one row, of cells that are held in part.
#[inline(always)]
fn collide_partly<T: Real, R: Law<T>>(
    f: &Populations<T>,
    held: &[Lanes<T>; 2],
    own: &R::Own,
    physics: &Physics<T, R>,
    to: &mut [[T; LANES]; Q],
    density: &mut Lanes<T>,
) {
    let [mass, least] = *held;
    if R::BY_ROW {
        let gravity = by_axis(|a| Lanes::splat(physics.gravity[a]));
        let held = Held::Partly { mass, least };
        let law = physics.law.row(own);
        let (post, dense) = collide(f, held, gravity, &law, Lanes::splat(physics.least_odd));
        for i in 0..Q {
            to[i] = post[i].0;
        }
        *density = dense;
        return;
    }
    for k in 0..LANES {
        let f: [T; Q] = std::array::from_fn(|i| f[i].0[k]);
        let held = Held::Partly { mass: mass.0[k], least: least.0[k] };
        let law = physics.law.cell(own, k);
        let (post, dense) = collide(&f, held, physics.gravity, &law, physics.least_odd);
        for i in 0..Q {
            to[i][k] = post[i];
        }
        density.0[k] = dense;
    }
}

for_this_processor! {
    /// [`collide_pair`] for the processor at hand.
    pub(crate) collide_pair_here = collide_pair<T: Real, R: Law<T>>(
        f: &Pair<T>,
        own: &[R::Own; 2],
        physics: &Physics<T, R>,
        to: &mut Pair<T>,
        density: &mut [[T; LANES]; 2]
    )
}

for_this_processor! {
    /// [`collide_partly`] for the processor at hand.
    pub(crate) collide_partly_here = collide_partly<T: Real, R: Law<T>>(
        f: &Populations<T>,
        held: &[Lanes<T>; 2],
        own: &R::Own,
        physics: &Physics<T, R>,
        to: &mut [[T; LANES]; Q],
        density: &mut Lanes<T>
    )
}
