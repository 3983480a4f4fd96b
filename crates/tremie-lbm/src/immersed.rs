//! What the lattice keeps for inclusions.
//!
//! Each step leaves the velocity of every cell as it was in the middle of the step, half of the forces included, and the share of
//! the cell that is fluid; and takes a force on each cell, beside its weight. Both are kept cell by cell, because inclusions lie where they like:
//! what is asked for at a point are runs of four cells (module `delta`), not rows.
//!
//! What a point sees is the mean of the last two steps. In a rigid cell at a wall an impulse is left over that alternates between steps for ever, as nothing relaxes there.
//! A fibre that answered it, a step late, would drive it: by the drag k for each unit of velocity, u goes to -(1 + k) u in each step. The mean of two
//! steps does not see it; and what moves steadily is slowed by the fibre as before, up to k = 2.

use crate::grid::Grid;
use crate::lanes::{LANES, Lanes};
use crate::real::Real;
use crate::spread::{Sorted, Windows};
use crate::topology::{CELLS, ROWS};

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

    /// The same to write.
    #[inline(always)]
    pub(crate) fn row_mut(&mut self, row: usize) -> &mut [[T; 4]; LANES] {
        &mut self.0[row & (ROWS - 1)]
    }

    /// All cells, to be saved.
    pub(crate) fn cells(&self) -> &[[T; 4]] {
        self.0.as_flattened()
    }

    /// All cells, to be loaded.
    pub(crate) fn cells_mut(&mut self) -> &mut [[T; 4]] {
        self.0.as_flattened_mut()
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

/// A slot and the forces on it, while they are taken out of the field.
pub(crate) type Pushed<T> = (usize, Option<Box<Vectors<T>>>);

/// What all blocks keep for inclusions, by slot; nothing where there are none.
#[derive(Debug, Clone)]
pub(crate) struct Immersed<T> {
    /// Whether there are inclusions.
    any: bool,
    /// The share of the cell that is fluid, last, and the velocity times it.
    pub(crate) seen: Field<T>,
    /// The same as it was a step before.
    pub(crate) before: Field<T>,
    /// Forces.
    pub(crate) pushes: Field<T>,
    /// The points that were asked for last, in the order in which they are gone through.
    pub(crate) sorted: Sorted,
    /// What is seen around each of them, in that order, by weights that sum to 64: the share that is fluid last, or 0 if that is as good as nothing.
    pub(crate) sums: Vec<[T; 4]>,
    /// Where the cells are that points see, once there are points.
    pub(crate) windows: Option<Windows>,
}

impl<T: Real> Immersed<T> {
    /// For a fluid with inclusions in it, or without.
    pub(crate) fn new(any: bool) -> Self {
        Self {
            any,
            seen: Vec::new(),
            before: Vec::new(),
            pushes: Vec::new(),
            sorted: Sorted::default(),
            sums: Vec::new(),
            windows: None,
        }
    }

    /// Without any fluid.
    pub(crate) fn emptied(&self) -> Self {
        Self::new(self.any)
    }

    /// Appends a slot.
    pub(crate) fn push_slot(&mut self) {
        self.seen.push(self.any.then(bytemuck::allocation::zeroed_box));
        self.before.push(self.any.then(bytemuck::allocation::zeroed_box));
        self.pushes.push(self.any.then(bytemuck::allocation::zeroed_box));
    }

    /// Forgets what a slot held.
    pub(crate) fn clear(&mut self, slot: usize) {
        for vectors in
            [&mut self.seen[slot], &mut self.before[slot], &mut self.pushes[slot]].into_iter().flatten()
        {
            **vectors = bytemuck::Zeroable::zeroed();
        }
    }

    /// Forces on the cells of a block, where any push.
    pub(crate) fn pushes(&self, slot: usize) -> Option<&Vectors<T>> {
        self.pushes[slot].as_deref()
    }

    /// Begins a step: what there is to see of all blocks, to be written, and the forces on them.
    pub(crate) fn begin(&mut self) -> (&mut Field<T>, &Field<T>) {
        std::mem::swap(&mut self.seen, &mut self.before);
        (&mut self.seen, &self.pushes)
    }

    /// Brings what was seen a step before into the units of a time step that is `factor` times as long.
    pub(crate) fn rescale(&mut self, factor: f64) {
        let factor = T::from_f64(factor);
        for cell in self.before.iter_mut().flatten().flat_map(|vectors| vectors.cells_mut()) {
            cell[..3].iter_mut().for_each(|u| *u = *u * factor);
        }
    }

    /// What a slot holds for the cells that are `wet`, in a form that can be saved; zero for others.
    pub(crate) fn saved(&self, slot: usize, wet: impl Fn(usize) -> bool) -> Vec<T> {
        let of = |vectors: &Vectors<T>| -> Vec<T> {
            let cells = vectors.cells().iter().enumerate();
            cells.flat_map(|(n, cell)| if wet(n) { *cell } else { [T::ZERO; 4] }).collect()
        };
        let all = [&self.seen[slot], &self.before[slot], &self.pushes[slot]];
        all.into_iter().flatten().flat_map(|vectors| of(vectors)).collect()
    }

    /// Memory in bytes.
    pub(crate) fn bytes(&self) -> usize {
        let boxes = self.seen.iter().chain(&self.before).chain(&self.pushes).flatten().count();
        boxes * size_of::<Vectors<T>>()
    }
}

impl<T: Real> Grid<T> {
    /// Fills the blocks with what was saved, in the order of their slots; none if it is of another size.
    pub(crate) fn load_immersed(&mut self, saved: &[T]) -> Option<()> {
        let slots: Vec<usize> = self.slots().collect();
        if saved.len() != slots.len() * 3 * 4 * CELLS {
            return None;
        }
        for (slot, saved) in slots.into_iter().zip(saved.chunks_exact(3 * 4 * CELLS)) {
            let Immersed { seen, before, pushes, .. } = &mut self.immersed;
            let all = [&mut seen[slot], &mut before[slot], &mut pushes[slot]];
            for (to, from) in all.into_iter().zip(saved.chunks_exact(4 * CELLS)) {
                let cells = to.as_deref_mut()?.cells_mut();
                cells.as_flattened_mut().copy_from_slice(from);
            }
        }
        Some(())
    }
}
