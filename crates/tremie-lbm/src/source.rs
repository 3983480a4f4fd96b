//! What the work on one block reads: its own values and those of the blocks around it, row by row.

use crate::grid::{FILL, Field, Shape};
use crate::lanes::{LANES, Lanes};
use crate::lattice::{C, MIRROR, Q, each_pair};
use crate::real::{Number, Real};
use crate::rows::{Beside, upstream};
use crate::solids::Solids;
use crate::topology::{Links, Topology};
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
    /// The block that will be worked on after the next.
    soon: &'a Field<T>,
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
    to: &mut Lanes<T>,
) {
    let beside = beside[upstream(c)];
    let row = |block: u8, flip: u8| &near[usize::from(block) & 31].row(usize::from(beside.row))[seen(flip)].0;
    let here = row(beside.block, beside.flip);
    match c[0] {
        0 => to.0 = *here,
        1 => {
            let step = links.before();
            to.0[1..].copy_from_slice(&here[..LANES - 1]);
            to.0[0] = row(beside.low, beside.flip | step.flip)[usize::from(step.index) & (LANES - 1)];
        }
        _ => {
            let step = links.after();
            to.0[..LANES - 1].copy_from_slice(&here[1..]);
            to.0[usize::from(links.last) & (LANES - 1)] =
                row(beside.high, beside.flip | step.flip)[usize::from(step.index) & (LANES - 1)];
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
        let soon = front.get(slot + 2).unwrap_or(&front[slot]);
        Self { topology, solids, links, own: &front[slot], near: near(links, front), soon, mirrors }
    }

    /// The fill of the cells of a row, each taken from the cell at -c.
    #[inline(always)]
    pub(crate) fn fill(&self, beside: &Beside, c: [i32; 3]) -> Lanes<T> {
        let mut to = Lanes::ZERO;
        pull(&self.near, self.links, beside, c, |_| FILL, &mut to);
        to
    }

    /// Populations arriving in a row from the cells around it, whatever these are, seen in mirrors where there are some.
    #[inline(always)]
    fn pull_all(&self, beside: &Beside, seen: impl Fn(usize, u8) -> usize, to: &mut [Lanes<T>; Q]) {
        pull(&self.near, self.links, beside, C[0], |flip| seen(0, flip), &mut to[0]);
        each_pair!(P, {
            let (a, b) = (2 * P + 1, 2 * P + 2);
            let (c, d) = const { (C[2 * P + 1], C[2 * P + 2]) };
            pull(&self.near, self.links, beside, c, |flip| seen(a, flip), &mut to[a]);
            pull(&self.near, self.links, beside, d, |flip| seen(b, flip), &mut to[b]);
        });
    }

    /// Populations arriving in a row from the cells around it, whatever these are.
    ///
    /// Half of them are written in pieces, which a processor cannot read as a whole at once. The work on a row should begin
    /// when those of some more rows have been fetched.
    #[inline(always)]
    pub(crate) fn arriving(&self, beside: &Beside, to: &mut [Lanes<T>; Q]) {
        if self.mirrors { self.arriving_mirrored(beside, to) } else { self.pull_all(beside, |i, _| i, to) }
    }

    /// [`Source::arriving`] where rows look into mirrors: few blocks, and not worth a copy in every kernel.
    #[inline(never)]
    fn arriving_mirrored(&self, beside: &Beside, to: &mut [Lanes<T>; Q]) {
        self.pull_all(beside, |i, flip| usize::from(MIRROR[usize::from(flip & 7)][i]), to);
    }

    /// Asks for a row of the block that will be worked on after the next, which the work on the next one looks into.
    #[inline(always)]
    pub(crate) fn expect(&self, row: u8) {
        self.soon.expect(usize::from(row));
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
        let mut to = Lanes::ZERO;
        pull(&self.near, self.links, beside, c, |_| array, &mut to);
        to
    }
}
