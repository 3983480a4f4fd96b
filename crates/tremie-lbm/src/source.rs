//! What the work on one block reads: its own values and those of the blocks around it, row by row.

use crate::grid::{FILL, Field, Shape};
use crate::lanes::{LANES, Lanes};
use crate::lattice::{C, MIRROR, Q, each_pair};
use crate::real::{Number, Real};
use crate::rows::{Beside, upstream};
use crate::solids::Solids;
use crate::topology::{Links, Step, Topology};
use crate::values::Values;

/// The 27 blocks around and with a block; the last five are never asked for.
type Near<'a, T, const N: usize> = [&'a Values<T, N>; 32];

/// What the work on one block reads.
#[derive(Clone, Copy)]
pub(crate) struct Source<'a, T: Real> {
    pub(crate) topology: &'a Topology,
    pub(crate) solids: &'a Solids,
    pub(crate) links: &'a Links,
    /// The block's own values.
    pub(crate) own: &'a Field<T>,
    near: Near<'a, T, { Q + 1 }>,
    /// Whether rows look into mirrors anywhere.
    mirrors: bool,
}

/// The blocks around a block.
fn near<'a, T: Real, const N: usize>(links: &Links, all: &'a [Box<Values<T, N>>]) -> Near<'a, T, N> {
    std::array::from_fn(|n| &*all[links.slots[n.min(26)] as usize])
}

/// One number of the cells of a row, each taken from the cell at -c. `seen` tells which number that is beyond mirrors.
#[inline(always)]
fn pull<T: Real, const N: usize>(
    near: &Near<'_, T, N>,
    links: &Links,
    beside: &Beside,
    c: [i32; 3],
    seen: impl Fn(u8) -> usize,
) -> Lanes<T> {
    let beside = beside[upstream(c)];
    let row = usize::from(beside.row);
    let block = |block: u8| near[usize::from(block) & 31];
    let (here, number) = (block(beside.block), seen(beside.flip));
    // What comes into a row at its end is one cell of another row.
    let entering = |block: &Values<T, N>, step: Step| {
        Lanes::splat(block.row(row)[seen(beside.flip | step.flip)][usize::from(step.index) & (LANES - 1)])
    };
    match c[0] {
        0 => Lanes(here.row(row)[number]),
        1 => {
            let end = entering(block(beside.low), links.before());
            Lanes::choose(links.ends[0], end, here.moved(number, row, true))
        }
        _ => {
            let end = entering(block(beside.high), links.after());
            Lanes::choose(links.ends[1], end, here.moved(number, row, false))
        }
    }
}

impl<'a, T: Real> Source<'a, T> {
    pub(crate) fn new(
        topology: &'a Topology,
        solids: &'a Solids,
        links: &'a Links,
        front: &'a [Box<Field<T>>],
        slot: usize,
    ) -> Self {
        let mirrors = links.steps.iter().flatten().any(|step| step.flip != 0);
        Self { topology, solids, links, own: &front[slot], near: near(links, front), mirrors }
    }

    /// The fill of the cells of a row, each taken from the cell at -c.
    #[inline(always)]
    pub(crate) fn fill(&self, beside: &Beside, c: [i32; 3]) -> Lanes<T> {
        pull(&self.near, self.links, beside, c, |_| FILL)
    }

    /// Populations arriving in a row from the cells around it, whatever these are, seen in mirrors where there are some.
    #[inline(always)]
    fn pull_all(&self, beside: &Beside, seen: impl Fn(usize, u8) -> usize) -> [Lanes<T>; Q] {
        let mut f = [Lanes::ZERO; Q];
        f[0] = pull(&self.near, self.links, beside, C[0], |flip| seen(0, flip));
        each_pair!(P, {
            let (a, b) = (2 * P + 1, 2 * P + 2);
            let (c, d) = const { (C[2 * P + 1], C[2 * P + 2]) };
            f[a] = pull(&self.near, self.links, beside, c, |flip| seen(a, flip));
            f[b] = pull(&self.near, self.links, beside, d, |flip| seen(b, flip));
        });
        f
    }

    /// Populations arriving in a row from the cells around it, whatever these are.
    #[inline(always)]
    pub(crate) fn arriving(&self, beside: &Beside) -> [Lanes<T>; Q] {
        if self.mirrors { self.arriving_mirrored(beside) } else { self.pull_all(beside, |i, _| i) }
    }

    /// [`Source::arriving`] where rows look into mirrors: few blocks, and not worth a copy in every kernel.
    #[inline(never)]
    fn arriving_mirrored(&self, beside: &Beside) -> [Lanes<T>; Q] {
        self.pull_all(beside, |i, flip| usize::from(MIRROR[usize::from(flip & 7)][i]))
    }

    /// The block's own values of a row in the array `i`.
    #[inline(always)]
    pub(crate) fn own(&self, i: usize, first: usize) -> Lanes<T> {
        self.own.lanes(i, first)
    }
}

/// The surface's shape in a block and those around it.
#[derive(Clone, Copy)]
pub(crate) struct Surroundings<'a, T: Real> {
    links: &'a Links,
    /// In the block itself.
    pub(crate) own: &'a Shape<T>,
    near: Near<'a, T, 9>,
}

impl<'a, T: Real> Surroundings<'a, T> {
    pub(crate) fn new(links: &'a Links, shape: &'a [Box<Shape<T>>], slot: usize) -> Self {
        Self { links, own: &shape[slot], near: near(links, shape) }
    }

    /// The eight values of array `array` for a row, each taken from the cell at -c. Mirrors do not change them.
    #[inline(always)]
    pub(crate) fn pull(&self, beside: &Beside, c: [i32; 3], array: usize) -> Lanes<T> {
        pull(&self.near, self.links, beside, c, |_| array)
    }
}
