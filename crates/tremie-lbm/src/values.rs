//! Numbers of a block, as memory likes them.
//!
//! A block has N numbers for each of its cells, 19 populations and a fill, say. They lie row by row: first the eight values of the
//! first number in the cells of row 0, then those of the second, and so on; then the same for row 1. What the work on a row writes is thus
//! one run of whole cache lines, and what it reads are nine such runs that its neighbours read too. With one
//! array for each number a step goes along 38 streams of 2 kB at once, more than a processor foresees, and
//! spends half of its time waiting.

use std::ops::{Index, IndexMut};

use crate::lanes::{LANES, Lanes};
use crate::topology::ROWS;

/// N numbers for each cell of a block, by `[(number, cell)]` or eight at once.
#[derive(Debug, Clone, Copy, bytemuck::Zeroable)]
#[repr(C, align(64))]
pub(crate) struct Values<T, const N: usize>([[[T; LANES]; N]; ROWS]);

impl<T, const N: usize> Values<T, N> {
    /// All numbers of a row.
    #[inline(always)]
    pub(crate) fn row(&self, row: usize) -> &[[T; LANES]; N] {
        &self.0[row & (ROWS - 1)]
    }

    /// The same to write.
    #[inline(always)]
    pub(crate) fn row_mut(&mut self, row: usize) -> &mut [[T; LANES]; N] {
        &mut self.0[row & (ROWS - 1)]
    }

    /// Asks the processor to fetch a row.
    #[inline(always)]
    #[allow(unsafe_code)]
    pub(crate) fn ask(&self, row: usize) {
        #[cfg(target_arch = "x86_64")]
        for line in 0..size_of::<[[T; LANES]; N]>() / 64 {
            use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
            let row: *const [[T; LANES]; N] = self.row(row);
            // SAFETY: a prefetch reads nothing, whatever the address.
            unsafe { _mm_prefetch::<_MM_HINT_T0>(row.cast::<i8>().wrapping_add(64 * line)) };
        }
    }

    /// One number of a row, given the row's first cell.
    #[inline(always)]
    pub(crate) fn lanes(&self, number: usize, first: usize) -> Lanes<T>
    where
        T: Copy,
    {
        Lanes(self.row(first / LANES)[number])
    }

    /// One number of a row moved along by a lane, up or down. The lane that nothing moves into holds anything.
    ///
    /// Taken as eight numbers in a run from where the first one lies, so that it is one instruction.
    #[inline(always)]
    pub(crate) fn moved(&self, number: usize, row: usize, up: bool) -> Lanes<T>
    where
        T: Copy,
    {
        let all = self.row(row).as_flattened();
        let first = LANES * number;
        let run = if up { first.checked_sub(1) } else { Some(first + 1) };
        match run.and_then(|start| all.get(start..start + LANES)?.try_into().ok()) {
            Some(run) => Lanes(run),
            // At the ends of the row there is no such run.
            None => {
                let mut moved = self.row(row)[number];
                moved.copy_within(if up { 0..LANES - 1 } else { 1..LANES }, usize::from(up));
                Lanes(moved)
            }
        }
    }

    /// Writes one number of a row, given the row's first cell.
    #[inline(always)]
    pub(crate) fn put(&mut self, number: usize, first: usize, lanes: Lanes<T>) {
        self.row_mut(first / LANES)[number] = lanes.0;
    }

    /// Copies one number of all cells.
    pub(crate) fn copy(&mut self, number: usize, from: &Self)
    where
        T: Copy,
    {
        for (to, from) in self.0.iter_mut().zip(&from.0) {
            to[number] = from[number];
        }
    }
}

impl<T, const N: usize> Index<(usize, usize)> for Values<T, N> {
    type Output = T;

    #[inline(always)]
    fn index(&self, (number, cell): (usize, usize)) -> &T {
        &self.0[cell / LANES][number][cell % LANES]
    }
}

impl<T, const N: usize> IndexMut<(usize, usize)> for Values<T, N> {
    #[inline(always)]
    fn index_mut(&mut self, (number, cell): (usize, usize)) -> &mut T {
        &mut self.0[cell / LANES][number][cell % LANES]
    }
}
