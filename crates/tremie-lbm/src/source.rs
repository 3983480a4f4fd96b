//! What the work on one block reads: its own values and those of the blocks around it, row by row.

use crate::grid::{FILL, Field, SHAPES, STRIDE, Shape};
use crate::lanes::{LANES, Lanes};
use crate::lattice::{C, MIRROR, Q, each_pair};
use crate::real::{Number, Real};
use crate::rows::{Beside, upstream};
use crate::solids::Solids;
use crate::topology::{Links, ROWS, Topology};

/// The values of the 27 blocks around and with a block, in one array each; the last five are never asked for.
type Near<'a, T, const N: usize> = [&'a [T; N]; 32];

/// Values in a field.
const VALUES: usize = (Q + 1) * STRIDE;

/// What the work on one block reads.
#[derive(Clone, Copy)]
pub(crate) struct Source<'a, T: Real> {
    pub(crate) topology: &'a Topology,
    pub(crate) solids: &'a Solids,
    pub(crate) links: &'a Links,
    /// The block's own values.
    pub(crate) own: &'a Field<T>,
    near: Near<'a, T, VALUES>,
    /// Whether rows look into mirrors anywhere.
    mirrors: bool,
}

/// The array to read beyond the mirrors `flip`.
#[inline(always)]
fn mirrored(array: usize, flip: u8) -> usize {
    if array == FILL { FILL } else { usize::from(MIRROR[usize::from(flip & 7)][array]) }
}

/// The blocks around a block.
fn near<'a, T: Real, A: bytemuck::Pod, const N: usize>(links: &Links, all: &'a [Box<A>]) -> Near<'a, T, N> {
    std::array::from_fn(|n| bytemuck::cast_ref(&*all[links.slots[n.min(26)] as usize]))
}

/// Eight values of a row, each taken from the cell at -c. `seen` tells where the array starts beyond mirrors.
#[inline(always)]
fn pull<T: Real, const N: usize>(
    near: &Near<'_, T, N>,
    links: &Links,
    beside: &Beside,
    c: [i32; 3],
    seen: impl Fn(u8) -> usize,
    to: &mut [T],
) {
    let block = |n: u8| near[usize::from(n) & 31];
    let beside = beside[upstream(c)];
    let first = (usize::from(beside.row) & (ROWS - 1)) * LANES;
    let row = seen(beside.flip) + first;
    let values = block(beside.block);
    // A shifted row takes one lane from beyond its array; it is then put right.
    match c[0] {
        0 => to[..LANES].copy_from_slice(&values[row..row + LANES]),
        1 => {
            let step = links.before();
            to[..LANES].copy_from_slice(&values[row - 1..row + LANES - 1]);
            let lane = seen(beside.flip | step.flip) + first + (usize::from(step.index) & (LANES - 1));
            to[0] = block(beside.low)[lane];
        }
        _ => {
            let step = links.after();
            to[..LANES].copy_from_slice(&values[row + 1..row + LANES + 1]);
            let lane = seen(beside.flip | step.flip) + first + (usize::from(step.index) & (LANES - 1));
            to[usize::from(links.last) & (LANES - 1)] = block(beside.high)[lane];
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

    /// The eight values of array `array` for a row, each taken from the cell at -c; populations come mirrored.
    #[inline(always)]
    pub(crate) fn pull(&self, beside: &Beside, c: [i32; 3], array: usize, mirrors: bool, to: &mut [T]) {
        let seen = |flip: u8| if mirrors { mirrored(array, flip) * STRIDE } else { array * STRIDE };
        pull(&self.near, self.links, beside, c, seen, to);
    }

    /// Populations arriving in a row from the cells around it, whatever these are.
    #[inline(always)]
    fn pull_all(&self, beside: &Beside, mirrors: bool) -> [Lanes<T>; Q] {
        let mut f = [Lanes::ZERO; Q];
        self.pull(beside, C[0], 0, mirrors, &mut f[0].0);
        each_pair!(P, {
            let (a, b) = (2 * P + 1, 2 * P + 2);
            self.pull(beside, const { C[2 * P + 1] }, a, mirrors, &mut f[a].0);
            self.pull(beside, const { C[2 * P + 2] }, b, mirrors, &mut f[b].0);
        });
        f
    }

    /// [`Source::pull_all`] with the choice about mirrors made once for the row.
    #[inline(always)]
    pub(crate) fn arriving(&self, beside: &Beside) -> [Lanes<T>; Q] {
        if self.mirrors { self.pull_all(beside, true) } else { self.pull_all(beside, false) }
    }

    /// The block's own values of a row in the array `i`.
    #[inline(always)]
    pub(crate) fn own(&self, i: usize, first: usize) -> Lanes<T> {
        Lanes::load(&self.own[i][first..])
    }
}

/// The surface's shape in a block and those around it.
#[derive(Clone, Copy)]
pub(crate) struct Surroundings<'a, T: Real> {
    links: &'a Links,
    /// In the block itself.
    pub(crate) own: &'a Shape<T>,
    near: Near<'a, T, { SHAPES * STRIDE }>,
}

impl<'a, T: Real> Surroundings<'a, T> {
    pub(crate) fn new(links: &'a Links, shape: &'a [Box<Shape<T>>], slot: usize) -> Self {
        Self { links, own: &shape[slot], near: near(links, shape) }
    }

    /// The eight values of array `array` for a row, each taken from the cell at -c. Mirrors do not change them.
    #[inline(always)]
    pub(crate) fn pull(&self, beside: &Beside, c: [i32; 3], array: usize) -> Lanes<T> {
        let mut to = Lanes::from_f64(0.0);
        pull(&self.near, self.links, beside, c, |_| array * STRIDE, &mut to.0);
        to
    }
}
