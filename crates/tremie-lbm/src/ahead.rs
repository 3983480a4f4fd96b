//! Memory asked for in time.
//!
//! A step goes through more memory than a processor's caches hold, and a row looks into nine others and into the two blocks
//! beside it, an order that no processor foresees: left alone it waits most of the time. So while the nth row of a block is
//! worked on, what the nth row of the block after the next will read is asked for.

use crate::grid::{Field, Shape};
use crate::real::Real;
use crate::rows::{Beside, Rows};
use crate::topology::{Links, Neighbour};

/// Blocks from the one that is worked on to the one that is asked for.
const BLOCKS: usize = 2;

/// The block itself among those around it.
const OWN: usize = 13;

/// A block that will be worked on soon.
#[derive(Clone, Copy)]
pub(crate) struct Ahead<'a, T> {
    rows: &'a Rows,
    links: &'a Links,
    front: &'a [Box<Field<T>>],
    shape: &'a Shape<T>,
}

impl<'a, T: Real> Ahead<'a, T> {
    /// What comes after the block in a slot.
    pub(crate) fn of(
        slot: usize,
        rows: &'a [Rows],
        links: &'a [Links],
        front: &'a [Box<Field<T>>],
        shape: &'a [Box<Shape<T>>],
    ) -> Self {
        let slot = (slot + BLOCKS).min(rows.len() - 1);
        Self { rows: &rows[slot], links: &links[slot], front, shape: &shape[slot] }
    }

    /// Asks for what its nth row will read, if it has so many.
    #[inline(always)]
    pub(crate) fn ask(&self, n: usize) {
        let bulk = self.rows.bulk.len();
        if let Some(row) = self.rows.bulk.get(n) {
            self.ask_around(&row.beside);
        } else if let Some(row) = self.rows.surface.get(n - bulk) {
            self.ask_around(&row.beside);
            self.shape.ask(usize::from(row.row));
        }
    }

    /// Asks for the rest of the rows, from the nth on.
    #[inline(always)]
    pub(crate) fn ask_rest(&self, n: usize) {
        for n in n..self.rows.bulk.len() + self.rows.surface.len() {
            self.ask(n);
        }
    }

    /// Asks for a row, for those straight beside it in other blocks, and for one across an edge where it is the only row to do so.
    #[inline(always)]
    fn ask_around(&self, beside: &Beside) {
        let outside = |n: usize| usize::from(beside[n].block) != OWN;
        let ask = |n: usize| {
            let Neighbour { block, row, .. } = beside[n];
            self.front[self.links.slots[usize::from(block)] as usize].ask(usize::from(row));
        };
        ask(4);
        for n in [1, 3, 5, 7] {
            if outside(n) {
                ask(n);
            }
        }
        for (n, y, z) in [(0, 3, 1), (2, 5, 1), (6, 3, 7), (8, 5, 7)] {
            if outside(y) && outside(z) {
                ask(n);
            }
        }
    }
}
