//! Rows whose cells collide together, as vectors.
//!
//! A collision is written for one cell (`collision`). The loops over cells are functions of their own, in which it is plain that nothing read
//! is written: only then does the compiler do all cells in one run. Rows go in pairs: sixteen numbers of 32 bits are one
//! vector of AVX-512, and take half the instructions of two rows one after the other. Laws that are looked up in tables are asked by
//! row instead ([`Law::BY_ROW`]).

use crate::ahead::Ahead;
use crate::collision::{Drive, Held, Rates, collide, rescale};
use crate::lanes::{LANES, Lanes};
use crate::lattice::Q;
use crate::processor::for_this_processor;
use crate::real::{Number, Real, by_axis};
use crate::relaxation::Law;
use crate::source::Source;

/// What drives the fluid and resists, in lattice units.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Physics<T, R> {
    /// Acceleration.
    pub(crate) gravity: [T; 3],
    /// Flow curve.
    pub(crate) law: R,
    /// Relaxation rates that do not depend on the stress.
    pub(crate) rates: Rates<T>,
}

/// What the cells of a row have of their own.
#[derive(Clone, Copy)]
pub(crate) struct Own<'a, T: Real, R: Law<T>> {
    /// Of the flow curve ([`Law::own`]).
    pub(crate) law: R::Own,
    /// Forces (modules `immersed` and `cage`), where any push.
    pub(crate) push: Option<&'a Pushes<T>>,
}

/// A force on each cell of a row, and last the friction with bodies there.
pub(crate) type Pushes<T> = [[T; 4]; LANES];

impl<T: Real, R: Law<T>> Own<'_, T, R> {
    /// The same with these forces instead, if there are any.
    #[inline(always)]
    pub(crate) fn or<'b>(&'b self, push: &'b Option<Pushes<T>>) -> Own<'b, T, R> {
        Own { law: self.law, push: push.as_ref().or(self.push) }
    }
}

impl<T: Real, R: Law<T>> Physics<T, R> {
    /// What the row whose first cell is `first` has of its own.
    #[inline(always)]
    pub(crate) fn own<'a>(&self, source: &Source<'a, T>, first: usize) -> Own<'a, T, R> {
        Own { law: self.law.own(source.structure, first), push: source.push(first) }
    }

    /// What drives a row.
    #[inline(always)]
    pub(crate) fn drive_row(&self, own: &Own<'_, T, R>) -> Drive<Lanes<T>> {
        match own.push {
            None => Weight(self.gravity).row(0),
            Some(push) => Pushed::new(self.gravity, [push; 2]).row(0),
        }
    }

    /// What drives one of its cells.
    #[inline(always)]
    pub(crate) fn drive(&self, own: &Own<'_, T, R>, lane: usize) -> Drive<T> {
        match own.push {
            None => Weight(self.gravity).cell(0),
            Some(push) => Pushed::new(self.gravity, [push; 2]).cell(lane),
        }
    }
}

/// What drives the cells of a row or two: known to the compiler where it is nothing but their weight, the same everywhere.
pub(crate) trait Driving<T: Real> {
    /// The nth cell.
    fn cell(&self, n: usize) -> Drive<T>;
    /// The nth row.
    fn row(&self, n: usize) -> Drive<Lanes<T>>;
}

/// By their weight, under this acceleration.
pub(crate) struct Weight<T>(pub(crate) [T; 3]);

impl<T: Real> Driving<T> for Weight<T> {
    #[inline(always)]
    fn cell(&self, _: usize) -> Drive<T> {
        Drive::by_weight(self.0)
    }

    #[inline(always)]
    fn row(&self, _: usize) -> Drive<Lanes<T>> {
        Drive::by_weight(by_axis(|a| Lanes::splat(self.0[a])))
    }
}

/// By their weight and by forces.
pub(crate) struct Pushed<T> {
    gravity: [T; 3],
    push: [[[T; LANES]; 2]; 3],
    friction: [[T; LANES]; 2],
}

impl<T: Real> Pushed<T> {
    /// The cells of one row, twice, or of two.
    #[inline(always)]
    pub(crate) fn new(gravity: [T; 3], rows: [&[[T; 4]; LANES]; 2]) -> Self {
        let all = |n: usize| rows.map(|row| row.map(|push| push[n]));
        Self { gravity, push: by_axis(all), friction: all(3) }
    }
}

impl<T: Real> Driving<T> for Pushed<T> {
    #[inline(always)]
    fn cell(&self, n: usize) -> Drive<T> {
        let push = by_axis(|a| self.push[a].as_flattened()[n]);
        Drive { gravity: self.gravity, push, friction: Some(self.friction.as_flattened()[n]) }
    }

    #[inline(always)]
    fn row(&self, n: usize) -> Drive<Lanes<T>> {
        let gravity = by_axis(|a| Lanes::splat(self.gravity[a]));
        let push = by_axis(|a| Lanes(self.push[a][n]));
        Drive { gravity, push, friction: Some(Lanes(self.friction[n])) }
    }
}

/// Populations of a row.
pub(crate) type Populations<T> = [Lanes<T>; Q];

impl<T> From<[Lanes<T>; HOLDS]> for Held<Lanes<T>> {
    fn from([mass, least, support]: [Lanes<T>; HOLDS]) -> Self {
        Self::Partly { mass, least, support }
    }
}

/// [`rescale`] for a row. Few steps do it, and it is not worth a copy in every kernel.
#[inline(never)]
pub(crate) fn rescale_row<T: Real, R: Law<T>>(
    f: &Populations<T>,
    held: Held<Lanes<T>>,
    own: &Own<'_, T, R>,
    physics: &Physics<T, R>,
    factor: T,
) -> (Populations<T>, Lanes<T>) {
    let law = physics.law.row(&own.law);
    let (trace, factor) = (Lanes::splat(physics.rates.trace), Lanes::splat(factor));
    rescale(f, held, physics.drive_row(own), &law, trace, factor)
}

/// Numbers of the cells of two rows beside each other, their populations if not told otherwise: sixteen numbers are one vector, where processors
/// have such.
#[derive(Clone, Copy, bytemuck::Zeroable)]
#[repr(C, align(64))]
pub(crate) struct Pair<T, const N: usize = Q>(pub(crate) [[[T; LANES]; 2]; N]);

impl<T: Real, const N: usize> Pair<T, N> {
    /// The numbers of one of the rows.
    #[inline(always)]
    pub(crate) fn row(&self, row: usize) -> [Lanes<T>; N] {
        std::array::from_fn(|n| Lanes(self.0[n][row]))
    }

    /// Puts the numbers of one of the rows in.
    #[inline(always)]
    pub(crate) fn put(&mut self, row: usize, numbers: &[Lanes<T>; N]) {
        for n in 0..N {
            self.0[n][row] = numbers[n].0;
        }
    }

    /// The numbers of one of the cells.
    #[inline(always)]
    pub(crate) fn cell(&self, cell: usize) -> [T; N] {
        std::array::from_fn(|n| self.0[n].as_flattened()[cell])
    }

    /// Puts the numbers of one of the cells in.
    #[inline(always)]
    pub(crate) fn put_cell(&mut self, cell: usize, numbers: &[T; N]) {
        for n in 0..N {
            self.0[n].as_flattened_mut()[cell] = numbers[n];
        }
    }
}

/// What up to [`PAIRS`] pairs of rows have of their own, with these forces instead where there are any; what comes after row number
/// `last` is as that.
#[inline(always)]
pub(crate) fn pair_up<'b, T: Real, R: Law<T>>(
    own: &'b [Own<'_, T, R>; 2 * PAIRS],
    pushes: &'b [Option<Pushes<T>>; 2 * PAIRS],
    last: usize,
) -> [[Own<'b, T, R>; 2]; PAIRS] {
    let of = |m: usize| own[m.min(last)].or(&pushes[m.min(last)]);
    std::array::from_fn(|n| [of(2 * n), of(2 * n + 1)])
}

/// How much of their cells the fluid of two rows fills: known to the compiler where it is all of them.
pub(crate) trait Filling<T: Real> {
    /// The nth cell.
    fn cell(&self, n: usize) -> Held<T>;
    /// The nth row.
    fn row(&self, n: usize) -> Held<Lanes<T>>;
}

/// All of them.
#[derive(Clone, Copy)]
pub(crate) struct Whole;

impl<T: Real> Filling<T> for Whole {
    #[inline(always)]
    fn cell(&self, _: usize) -> Held<T> {
        Held::Whole
    }

    #[inline(always)]
    fn row(&self, _: usize) -> Held<Lanes<T>> {
        Held::Whole
    }
}

/// Numbers of [`Held::Partly`].
pub(crate) const HOLDS: usize = 3;

/// What masses they hold, by what they resist at least, and how they are held ([`Held::Partly`]).
impl<T: Real> Filling<T> for Pair<T, HOLDS> {
    #[inline(always)]
    fn cell(&self, n: usize) -> Held<T> {
        let [mass, least, support] = Pair::cell(self, n);
        Held::Partly { mass, least, support }
    }

    #[inline(always)]
    fn row(&self, n: usize) -> Held<Lanes<T>> {
        Pair::row(self, n).into()
    }
}

/// Pairs of rows that collide one right after the other. (A collision waits for its roots and quotients one by one; meanwhile the
/// processor begins with the next.)
pub(crate) const PAIRS: usize = 4;

/// Collides the cells of pairs of rows; the densities too. Before each pair what two rows of a block to come
/// need is asked for, from the row of number `first` on: while collisions wait for their quotients, memory has nothing else to do.
#[inline(always)]
fn collide_pairs<T: Real, R: Law<T>, F: Filling<T>>(
    f: &[Pair<T>],
    held: &[F],
    own: &[[Own<'_, T, R>; 2]],
    physics: &Physics<T, R>,
    (ahead, first): (&Ahead<'_, T>, usize),
    to: &mut [Pair<T>],
    density: &mut [[[T; LANES]; 2]],
) {
    for (n, ((((f, held), own), to), density)) in f.iter().zip(held).zip(own).zip(to).zip(density).enumerate()
    {
        ahead.ask(first + 2 * n);
        ahead.ask(first + 2 * n + 1);
        let laws = [own[0].law, own[1].law];
        match [own[0].push, own[1].push] {
            [Some(a), Some(b)] => {
                let driving = Pushed::new(physics.gravity, [a, b]);
                collide_pair(f, held, &laws, &driving, physics, to, density);
            }
            _ => collide_pair(f, held, &laws, &Weight(physics.gravity), physics, to, density),
        }
    }
}

/// Collides the cells of two rows; the densities too.
#[inline(always)]
fn collide_pair<T: Real, R: Law<T>, F: Filling<T>, D: Driving<T>>(
    f: &Pair<T>,
    held: &F,
    own: &[R::Own; 2],
    driving: &D,
    physics: &Physics<T, R>,
    to: &mut Pair<T>,
    density: &mut [[T; LANES]; 2],
) {
    if R::BY_ROW {
        let rates = physics.rates.of_row();
        for half in 0..2 {
            let (law, drive) = (physics.law.row(&own[half]), driving.row(half));
            let (post, dense) = collide(&f.row(half), held.row(half), drive, &law, rates);
            to.put(half, &post);
            density[half] = dense.0;
        }
        return;
    }
    // One by one, of which the compiler makes one run over all sixteen.
    for k in 0..2 * LANES {
        let (law, drive) = (physics.law.cell(&own[k / LANES], k % LANES), driving.cell(k));
        let (post, dense) = collide(&f.cell(k), held.cell(k), drive, &law, physics.rates);
        to.put_cell(k, &post);
        density.as_flattened_mut()[k] = dense;
    }
}

for_this_processor! {
    /// [`collide_pairs`] for the processor at hand.
    pub(crate) collide_pairs_here = collide_pairs<T: Real, R: Law<T>, F: Filling<T>>(
        f: &[Pair<T>],
        held: &[F],
        own: &[[Own<'_, T, R>; 2]],
        physics: &Physics<T, R>,
        ahead: (&Ahead<'_, T>, usize),
        to: &mut [Pair<T>],
        density: &mut [[[T; LANES]; 2]]
    )
}
