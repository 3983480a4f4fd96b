//! What the lattice keeps for inclusions.
//!
//! Each step leaves the velocity of every cell as it was in the middle of the step, half of the forces included, and the share of
//! the cell that is fluid; and takes a force on each cell, beside its weight. Both are kept cell by cell, because inclusions lie where they like:
//! what is asked for at a point are runs of four cells (module `delta`), not rows.
//!
//! Of cells beside walls, air or the surface, points see the mean velocity of two steps. There velocities can ring, changing their sign in each step: one across a wall
//! keeps half of its size, one towards one wall and away from another that it meets two thirds, as populations are thrown back into the cell they left; in a rigid cell
//! nothing dies down. And a point at a wall or a surface takes hold of few cells. A body that answered what rings, a step late, would drive it: by a drag of k for each unit of velocity,
//! u goes to -(p + k) u, if p of it is left by itself. The mean of two steps does not see it; what does not ring is slowed by the body
//! as it should be, up to k = 4/3. In the midst of fluid the weights that a point spreads by, which are the same for even and for odd
//! cells, do not see what alternates from cell to cell, and k may be as large as for a line of points alone
//! ([`tremie_suspension::hold`]).
//!
//! Where many bodies lie in one place they ask for more together. So cells are also told the friction that all points ask of them, and what a point
//! sees of that, as it sees velocities, bounds the k that matters around it (it is a row of the matrix that takes velocities of the fluid at all points to what their frictions
//! make of them there, and no eigenvalue of a matrix is larger than its largest row). Beyond what the fluid takes ([`TAKES`]) the point gets
//! as much less friction ([`tremie_suspension::Seen::crowding`]). In shorter steps less is asked, and steps that are short enough change nothing.

use rayon::prelude::*;

use crate::grid::Grid;
use crate::lanes::{LANES, Lanes};
use crate::real::{Number, Real};
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

/// Part of its momentum in a step of which the fluid takes hold by points beside walls, air or the surface.
pub(crate) const TAKES: f64 = 4.0 / 3.0;

/// What is to see of a block, while a step writes it.
pub(crate) struct Sight<'a, T> {
    /// What points see.
    pub(crate) seen: &'a mut Vectors<T>,
    /// The velocities of the step.
    pub(crate) last: &'a mut Vectors<T>,
}

impl<T: Real> Sight<'_, T> {
    /// Writes a row that lies in the midst of fluid.
    #[inline(always)]
    pub(crate) fn put(&mut self, row: usize, velocity: [Lanes<T>; 3]) {
        self.seen.put(row, velocity, Lanes::ONE);
        self.last.put(row, velocity, Lanes::ONE);
    }

    /// Writes a row, from the velocity of its cells and the share of each that is fluid; for the cells that `ring` by the mean of two steps.
    #[inline(always)]
    pub(crate) fn put_mean(&mut self, row: usize, velocity: [Lanes<T>; 3], fill: Lanes<T>, ring: u8) {
        let (seen, last) = (self.seen.row_mut(row), self.last.row_mut(row));
        for k in 0..LANES {
            let fill = fill.0[k];
            let now = velocity.map(|u| fill * u.0[k]);
            let [before @ .., whole] = last[k];
            // Fluid that was not there before was not seen.
            let share = if ring >> k & 1 == 1 && whole > T::ZERO { fill / whole } else { T::ZERO };
            let half = T::from_f64(0.5);
            let mean = |a: usize| {
                if share > T::ZERO { half * (now[a] + share * before[a]) } else { now[a] }
            };
            seen[k] = [mean(0), mean(1), mean(2), fill];
            last[k] = [now[0], now[1], now[2], fill];
        }
    }
}

/// What all blocks keep for inclusions, by slot; nothing where there are none.
#[derive(Debug, Clone)]
pub(crate) struct Immersed<T> {
    /// Whether there are inclusions.
    any: bool,
    /// The share of the cell that is fluid, last, and the velocity times it.
    pub(crate) seen: Field<T>,
    /// The same as the velocity is in each step, no mean taken.
    pub(crate) last: Field<T>,
    /// Forces, and the friction that all points ask for.
    pub(crate) pushes: Field<T>,
    /// The blocks with cells of which too much is asked.
    pub(crate) crowded: Vec<bool>,
    /// The points that were asked for last, in the order in which they are gone through.
    pub(crate) sorted: Sorted<T>,
    /// What is seen around each of them, in that order, by weights that sum to 64: the share that is fluid last, or 0 if that is as good as nothing.
    pub(crate) sums: Vec<[T; 4]>,
    /// The friction asked of the cells around each of them, summed in the same way, where it is crowded; else 0.
    pub(crate) crowding: Vec<T>,
    /// Where the cells are that points see, once there are points.
    pub(crate) windows: Option<Windows>,
}

impl<T: Real> Immersed<T> {
    /// For a fluid with inclusions in it, or without.
    pub(crate) fn new(any: bool) -> Self {
        Self {
            any,
            seen: Vec::new(),
            last: Vec::new(),
            pushes: Vec::new(),
            crowded: Vec::new(),
            sorted: Sorted::default(),
            sums: Vec::new(),
            crowding: Vec::new(),
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
        self.last.push(self.any.then(bytemuck::allocation::zeroed_box));
        self.pushes.push(self.any.then(bytemuck::allocation::zeroed_box));
    }

    /// Forgets what a slot held.
    pub(crate) fn clear(&mut self, slot: usize) {
        for vectors in
            [&mut self.seen[slot], &mut self.last[slot], &mut self.pushes[slot]].into_iter().flatten()
        {
            **vectors = bytemuck::Zeroable::zeroed();
        }
    }

    /// Finds the blocks in which any cell is asked for more friction than some would take.
    pub(crate) fn find_crowded(&mut self, least: f64) {
        let least = T::from_f64(least);
        let too_much = |(push, seen): (&[T; 4], &[T; 4])| push[3] > least * seen[3];
        let blocks = (self.pushes.par_iter(), self.seen.par_iter()).into_par_iter();
        let crowded = blocks.map(|(pushes, seen)| match (pushes, seen) {
            (Some(pushes), Some(seen)) => pushes.cells().iter().zip(seen.cells()).any(too_much),
            _ => false,
        });
        crowded.collect_into_vec(&mut self.crowded);
    }

    /// Forces on the cells of a block, where any push.
    pub(crate) fn pushes(&self, slot: usize) -> Option<&Vectors<T>> {
        self.pushes[slot].as_deref()
    }

    /// What there is to see of all blocks and its last velocities, to be written, and the forces on them.
    pub(crate) fn split(&mut self) -> (&mut Field<T>, &mut Field<T>, &Field<T>) {
        (&mut self.seen, &mut self.last, &self.pushes)
    }

    /// What a slot holds for the cells that are `wet`, in a form that can be saved; zero for others.
    pub(crate) fn saved(&self, slot: usize, wet: impl Fn(usize) -> bool) -> Vec<T> {
        let of = |vectors: &Vectors<T>| -> Vec<T> {
            let cells = vectors.cells().iter().enumerate();
            cells.flat_map(|(n, cell)| if wet(n) { *cell } else { [T::ZERO; 4] }).collect()
        };
        let all = [&self.seen[slot], &self.last[slot], &self.pushes[slot]];
        all.into_iter().flatten().flat_map(|vectors| of(vectors)).collect()
    }

    /// Memory in bytes.
    pub(crate) fn bytes(&self) -> usize {
        let boxes = self.seen.iter().chain(&self.last).chain(&self.pushes).flatten().count();
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
            let Immersed { seen, last, pushes, .. } = &mut self.immersed;
            let all = [&mut seen[slot], &mut last[slot], &mut pushes[slot]];
            for (to, from) in all.into_iter().zip(saved.chunks_exact(4 * CELLS)) {
                let cells = to.as_deref_mut()?.cells_mut();
                cells.as_flattened_mut().copy_from_slice(from);
            }
        }
        Some(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What is seen of a velocity in x, step by step, in a cell that rings or does not.
    fn seen(velocity: impl Fn(i32) -> f64, ring: u8) -> f64 {
        let (mut seen, mut last): (Vectors<f64>, Vectors<f64>) =
            (bytemuck::Zeroable::zeroed(), bytemuck::Zeroable::zeroed());
        for step in 0..4 {
            let velocity = [Lanes::from_f64(velocity(step)), Lanes::ZERO, Lanes::ZERO];
            let fill = Lanes::from_f64(0.5);
            Sight { seen: &mut seen, last: &mut last }.put_mean(0, velocity, fill, ring);
        }
        seen.row(0)[0][0] / seen.row(0)[0][3]
    }

    #[test]
    fn what_rings_at_walls_is_not_seen_and_what_flows_is() {
        let rings = |step: i32| if step % 2 == 0 { 0.1 } else { -0.1 };
        assert_eq!([0, 0xff].map(|ring| seen(rings, ring)), [-0.1, 0.0]);
        assert_eq!([0, 0xff].map(|ring| seen(|_| 0.1, ring)), [0.1; 2]);
    }
}
