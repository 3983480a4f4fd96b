//! What inclusions see of the fluid, and do to it.
//!
//! Each step leaves the velocity of every cell as it was in the middle of the step, half of the forces included, and the share of
//! the cell that is fluid; and takes a force on each cell, beside its weight. Both are kept cell by cell, because inclusions lie where they like:
//! what is asked for at a point are runs of four cells, not rows.

use crate::lanes::{LANES, Lanes};
use crate::real::Real;
use crate::topology::ROWS;

/// A vector and one more number for each cell of a block.
#[derive(Debug, Clone, Copy, bytemuck::Zeroable)]
#[repr(C, align(64))]
pub(crate) struct Vectors<T>([[[T; 4]; LANES]; ROWS]);

impl<T: Real> Vectors<T> {
    /// The cells of a row.
    #[inline(always)]
    pub(crate) fn row(&self, row: usize) -> &[[T; 4]; LANES] {
        &self.0[row & (ROWS - 1)]
    }

    /// Writes the cells of a row.
    #[inline(always)]
    pub(crate) fn put(&mut self, row: usize, vector: [Lanes<T>; 3], more: Lanes<T>) {
        for (k, cell) in self.0[row & (ROWS - 1)].iter_mut().enumerate() {
            *cell = [vector[0].0[k], vector[1].0[k], vector[2].0[k], more.0[k]];
        }
    }
}

/// Vectors of all blocks, where there are any.
pub(crate) type Field<T> = Vec<Option<Box<Vectors<T>>>>;

/// What all blocks keep for inclusions, by slot; nothing where there are none.
#[derive(Debug, Clone, Default)]
pub(crate) struct Immersed<T> {
    /// Whether there are inclusions.
    any: bool,
    /// Velocity, and the share of the cell that is fluid.
    seen: Field<T>,
    /// Forces.
    pushes: Field<T>,
}

impl<T: Real> Immersed<T> {
    /// For a fluid with inclusions in it, or without.
    pub(crate) fn new(any: bool) -> Self {
        Self { any, seen: Vec::new(), pushes: Vec::new() }
    }

    /// Without any fluid.
    pub(crate) fn emptied(&self) -> Self {
        Self::new(self.any)
    }

    /// Appends a slot.
    pub(crate) fn push_slot(&mut self) {
        self.seen.push(self.any.then(bytemuck::allocation::zeroed_box));
        self.pushes.push(None);
    }

    /// Forgets what a slot held.
    pub(crate) fn clear(&mut self, slot: usize) {
        if let Some(seen) = &mut self.seen[slot] {
            **seen = bytemuck::Zeroable::zeroed();
        }
        self.pushes[slot] = None;
    }

    /// Forces on the cells of a block, where any push.
    pub(crate) fn pushes(&self, slot: usize) -> Option<&Vectors<T>> {
        self.pushes[slot].as_deref()
    }

    /// What there is to see of all blocks, to be written, and the forces on them.
    pub(crate) fn split(&mut self) -> (&mut Field<T>, &Field<T>) {
        (&mut self.seen, &self.pushes)
    }

    /// Memory in bytes.
    pub(crate) fn bytes(&self) -> usize {
        let boxes = self.seen.iter().chain(&self.pushes).flatten().count();
        boxes * size_of::<Vectors<T>>()
    }
}
