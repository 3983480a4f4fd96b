//! Numbers of a block, as memory likes them.
//!
//! A block has N numbers for each of its cells, 19 populations, say. They lie row by row: first the eight values of the
//! first number in the cells of row 0, then those of the second, and so on; then the same for row 1. What the work on a row writes is thus
//! one run of whole cache lines, and what it reads are nine such runs that its neighbours read too. With one
//! array for each number a step goes along 38 streams of 2 kB at once, more than a processor foresees, and
//! spends half of its time waiting.

use std::ops::{Index, IndexMut};

use crate::lanes::{LANES, Lanes};
use crate::topology::ROWS;

/// Makes what was written past the caches visible to other threads.
#[inline(always)]
#[allow(unsafe_code)]
pub(crate) fn written() {
    #[cfg(target_arch = "x86_64")]
    // SAFETY: every x86-64 processor has this.
    unsafe {
        std::arch::x86_64::_mm_sfence();
    }
}

/// N numbers for each cell of a block, by `[(number, cell)]` or eight at once.
#[derive(Debug, Clone, Copy, bytemuck::Zeroable)]
#[repr(C, align(64))]
pub(crate) struct Values<T, const N: usize>([[[T; LANES]; N]; ROWS]);

impl<T, const N: usize> Values<T, N> {
    /// All of them the same.
    pub(crate) fn all(number: T) -> Self
    where
        T: Copy,
    {
        Self([[[number; LANES]; N]; ROWS])
    }

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

    /// Writes all numbers of a row; past the caches if the next step would not find them there anyway. (A write into a cache first
    /// fetches from memory what it is about to replace.) [`written`] must follow before other threads read them.
    #[inline(always)]
    #[allow(unsafe_code)]
    pub(crate) fn put_row(&mut self, row: usize, numbers: impl Fn(usize) -> [T; LANES], past_caches: bool)
    where
        T: bytemuck::Pod,
    {
        let to = self.row_mut(row);
        #[cfg(target_arch = "x86_64")]
        if past_caches && std::arch::is_x86_feature_detected!("avx") {
            use std::arch::x86_64::{__m256i, _mm256_loadu_si256, _mm256_stream_si256};
            const { assert!(size_of::<[T; LANES]>().is_multiple_of(size_of::<__m256i>())) };
            for i in 0..N {
                let numbers = numbers(i);
                let from = numbers.as_ptr().cast::<__m256i>();
                let to = to[i].as_mut_ptr().cast::<__m256i>();
                for part in 0..size_of::<[T; LANES]>() / size_of::<__m256i>() {
                    // SAFETY: both lie in the eight numbers; `to` is aligned, as blocks are and eight numbers have 32 or 64 bytes; the
                    // processor was asked; and [`written`] is called before others read it.
                    unsafe { _mm256_stream_si256(to.add(part), _mm256_loadu_si256(from.add(part))) };
                }
            }
            return;
        }
        let _ = past_caches;
        for i in 0..N {
            to[i] = numbers(i);
        }
    }

    /// Asks the processor to fetch a row, into a cache that holds what is asked for until it is read. (The first one holds little
    /// more than one block.)
    #[inline(always)]
    #[allow(unsafe_code)]
    pub(crate) fn ask(&self, row: usize) {
        #[cfg(target_arch = "x86_64")]
        for line in 0..size_of::<[[T; LANES]; N]>() / 64 {
            use std::arch::x86_64::{_MM_HINT_T1, _mm_prefetch};
            let row: *const [[T; LANES]; N] = self.row(row);
            // SAFETY: a prefetch reads nothing, whatever the address.
            unsafe { _mm_prefetch::<_MM_HINT_T1>(row.cast::<i8>().wrapping_add(64 * line)) };
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
        fn run<T>(all: &[T], first: usize, up: bool) -> Option<&[T; LANES]> {
            let start = if up { first.checked_sub(1) } else { Some(first + 1) }?;
            all.get(start..start + LANES)?.try_into().ok()
        }
        // Most runs lie in the row, which is known when this is compiled. Those at its ends lie in the block.
        let first = LANES * number;
        if let Some(run) = run(self.row(row).as_flattened(), first, up) {
            return Lanes(*run);
        }
        let moved;
        let run = run(self.0.as_flattened().as_flattened(), LANES * N * (row & (ROWS - 1)) + first, up);
        Lanes(*match run {
            Some(run) => run,
            None => {
                let mut of = self.row(row)[number];
                of.copy_within(if up { 0..LANES - 1 } else { 1..LANES }, usize::from(up));
                moved = of;
                &moved
            }
        })
    }

    /// Writes one number of a row, given the row's first cell.
    #[inline(always)]
    pub(crate) fn put(&mut self, number: usize, first: usize, lanes: Lanes<T>) {
        self.row_mut(first / LANES)[number] = lanes.0;
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_row_past_the_caches_is_the_same_row() {
        fn check<T: crate::real::Real + std::fmt::Debug>() {
            let number = |i: usize| std::array::from_fn(|k| T::from_f64((100 * i + k) as f64));
            let mut blocks: [Box<Values<T, 19>>; 2] =
                [false, true].map(|_| bytemuck::allocation::zeroed_box());
            for (block, past_caches) in blocks.iter_mut().zip([false, true]) {
                for row in [0, 5, ROWS - 1] {
                    block.put_row(row, number, past_caches);
                }
                written();
            }
            assert_eq!(blocks[0].0, blocks[1].0);
            assert_eq!(blocks[1][(18, 8 * 5 + 7)], T::from_f64(1807.0));
        }
        check::<f32>();
        check::<f64>();
    }

    #[test]
    fn moving_along_by_a_lane() {
        let mut block: Box<Values<f64, 2>> = bytemuck::allocation::zeroed_box();
        for row in 0..ROWS {
            for number in 0..2 {
                block.put(
                    number,
                    LANES * row,
                    Lanes(std::array::from_fn(|k| (100 * row + 10 * number + k) as f64)),
                );
            }
        }
        for row in [0, 1, ROWS - 1] {
            for number in 0..2 {
                let own = block.lanes(number, LANES * row).0;
                assert_eq!(block.moved(number, row, true).0[1..], own[..LANES - 1]);
                assert_eq!(block.moved(number, row, false).0[..LANES - 1], own[1..]);
            }
        }
    }
}
