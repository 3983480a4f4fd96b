//! What the points in one place see and push, beside each other in memory.
//!
//! The cells around points whose first cells lie in one cube of eight along each axis are a cube of eleven: a window. It is copied out of the blocks once for all of
//! its points, with what mirrors and periodic sides show of it; and the forces of its points are summed in it before they go to the blocks. So what one point sees or
//! pushes are sixteen runs of four cells at known places.

use crate::delta::{Around, beyond, mirrored};
use crate::grid::Grid;
use crate::immersed::{Field, Pushed};
use crate::real::{Four, Real};
use crate::topology::{EDGE, Topology};

/// Edge of a window in cells.
const SPAN: usize = EDGE + 3;

/// Numbers of a run of four cells.
const RUN: usize = 16;

/// Where the cells of a window lie along one axis.
#[derive(Debug, Clone, Default)]
pub(crate) struct Span {
    /// The blocks that they lie in.
    pub(crate) blocks: Vec<usize>,
    /// Each of them: which of these blocks, where in it, and whether in a mirror; none beyond other sides.
    cells: [Option<(usize, usize, bool)>; SPAN],
    /// The same for runs that lie beside each other in a block: the first, and how many.
    runs: Vec<(usize, usize)>,
}

impl Span {
    /// The window that begins at the cell `8 (number - 1)`.
    pub(crate) fn new(topology: &Topology, axis: usize, number: usize) -> Self {
        let mut span = Self::default();
        for n in 0..SPAN {
            let Some((at, flip)) = beyond(topology, axis, (EDGE * number + n) as i64 - EDGE as i64) else {
                continue;
            };
            let which = span.blocks.iter().position(|block| *block == at / EDGE);
            let which = which.unwrap_or_else(|| {
                span.blocks.push(at / EDGE);
                span.blocks.len() - 1
            });
            span.cells[n] = Some((which, at % EDGE, flip));
            let goes_on = n > 0 && at % EDGE > 0 && span.cells[n - 1] == Some((which, at % EDGE - 1, flip));
            match span.runs.last_mut() {
                Some(run) if goes_on && !flip => run.1 += 1,
                _ => span.runs.push((n, 1)),
            }
        }
        span
    }

    /// Number of the window, along an axis, with a first cell.
    pub(crate) fn of(first: i64) -> usize {
        (first.div_euclid(EDGE as i64) + 1).max(0) as usize
    }
}

/// The cells of a window of which something is asked, along each axis: the first, and the one after the last.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Asked([[usize; 2]; 3]);

impl Asked {
    pub(crate) const NOTHING: Self = Self([[SPAN, 0]; 3]);

    /// Asks for the four cells from `first` on, too.
    #[inline(always)]
    pub(crate) fn add(&mut self, first: [usize; 3]) {
        for (asked, first) in self.0.iter_mut().zip(first) {
            *asked = [asked[0].min(first), asked[1].max(first + 4)];
        }
    }
}

/// Place in its window of a first cell.
#[inline(always)]
pub(crate) fn within(first: [i64; 3]) -> [usize; 3] {
    [first[0] as usize % EDGE, first[1] as usize % EDGE, first[2] as usize % EDGE]
}

/// The cells of a window, four numbers each.
#[derive(Debug, Clone)]
pub(crate) struct Window<T>(Vec<T>);

impl<T: Real> Window<T> {
    pub(crate) fn new() -> Self {
        Self(vec![T::ZERO; 4 * SPAN * SPAN * SPAN])
    }

    /// Zeroes all.
    pub(crate) fn clear(&mut self) {
        self.0.fill(T::ZERO);
    }

    /// Copies what is seen of the cells that are asked for, `spans` saying where they are.
    #[inline(always)]
    pub(crate) fn look(&mut self, grid: &Grid<T>, spans: [&Span; 3], asked: &Asked) {
        let blocks = spans.map(|span| span.blocks.as_slice());
        let seen = |which: [usize; 3]| {
            let block = [0, 1, 2].map(|a| blocks[a][which[a]]);
            grid.immersed.seen[grid.slot_of_block(block) as usize].as_deref()
        };
        each_run(spans, asked, |to, count, which, row, from, mirrors| {
            let Some(to) = self.0.get_mut(4 * to..4 * (to + count)) else { return };
            let cells = seen(which).and_then(|seen| seen.row(row).get(from..from + count));
            match (cells, mirrors) {
                (Some(cells), 0) => to.copy_from_slice(cells.as_flattened()),
                (Some(cells), _) => {
                    for (to, cell) in to.chunks_exact_mut(4).zip(cells) {
                        to.copy_from_slice(&mirrored(*cell, mirrors));
                    }
                }
                (None, _) => to.fill(T::ZERO),
            }
        });
        // Beyond sides that nothing is seen through.
        if spans.iter().any(|span| span.cells.contains(&None)) {
            for n in 0..SPAN * SPAN * SPAN {
                let at = [n % SPAN, n / SPAN % SPAN, n / SPAN / SPAN];
                if (0..3).any(|a| spans[a].cells[at[a]].is_none()) {
                    self.0[4 * n..4 * (n + 1)].fill(T::ZERO);
                }
            }
        }
    }

    /// Adds the forces on the cells that were asked for, times the share of each that is fluid as `seen`, to those on the blocks: `place` says where among
    /// `pushed`, slots and the forces on them, a block is.
    #[inline(always)]
    pub(crate) fn give(
        &self,
        spans: [&Span; 3],
        asked: &Asked,
        seen: &Field<T>,
        pushed: &mut [Pushed<T>],
        place: impl Fn([usize; 3]) -> usize,
    ) {
        let own = self.0.as_chunks::<4>().0;
        each_run(spans, asked, |from, count, which, row, to, mirrors| {
            let Some((slot, Some(push))) = pushed.get_mut(place(which)) else { return };
            let Some(seen) = &seen[*slot] else { return };
            let cells = own[from..from + count].iter().zip(&seen.row(row)[to..to + count]);
            for ((own, seen), push) in cells.zip(&mut push.row_mut(row)[to..to + count]) {
                let own = if mirrors == 0 { *own } else { mirrored(*own, mirrors) };
                (T::Four::read(push) + T::Four::read(&own) * T::Four::splat(seen[3])).write(push);
            }
        });
    }

    /// The run of four cells from a place on, so many rows on.
    #[inline(always)]
    fn run([i, j, k]: [usize; 3], m: usize, n: usize) -> usize {
        4 * (i + SPAN * (j + m + SPAN * (k + n)))
    }

    /// Sum of the cells around a point by their weights.
    #[inline(always)]
    pub(crate) fn sum(&self, around: &Around<T>) -> [T; 4] {
        let at = within(around.first);
        let mut sum = [T::ZERO; RUN];
        for n in 0..4 {
            for m in 0..4 {
                let weight = around.weight[1][m] * around.weight[2][n];
                let cells = self.0.get(Self::run(at, m, n)..).and_then(|cells| cells.first_chunk::<RUN>());
                let Some(cells) = cells else { continue };
                for l in 0..RUN {
                    sum[l] += weight * cells[l];
                }
            }
        }
        let w = &around.weight[0];
        let of = |c: usize| (w[0] * sum[c] + w[1] * sum[4 + c]) + (w[2] * sum[8 + c] + w[3] * sum[12 + c]);
        [of(0), of(1), of(2), of(3)]
    }

    /// Adds a vector to the cells around a point by their weights.
    #[inline(always)]
    pub(crate) fn add(&mut self, around: &Around<T>, vector: [T; 4]) {
        let at = within(around.first);
        let mut along = [T::ZERO; RUN];
        for l in 0..RUN {
            along[l] = around.weight[0][l / 4] * vector[l % 4];
        }
        for n in 0..4 {
            for m in 0..4 {
                let weight = around.weight[1][m] * around.weight[2][n];
                let cells =
                    self.0.get_mut(Self::run(at, m, n)..).and_then(|cells| cells.first_chunk_mut::<RUN>());
                let Some(cells) = cells else { continue };
                for l in 0..RUN {
                    cells[l] += weight * along[l];
                }
            }
        }
    }
}

/// Goes through the cells that are asked for, as far as there are any, run by run: the first of it in the window, how many, which blocks, the row and the first in
/// it, and the mirrors they are seen in.
#[inline(always)]
fn each_run(
    [x, y, z]: [&Span; 3],
    asked: &Asked,
    mut run: impl FnMut(usize, usize, [usize; 3], usize, usize, u8),
) {
    for k in asked.0[2][0]..asked.0[2][1].min(SPAN) {
        let Some((bz, atz, flipz)) = z.cells[k] else { continue };
        for j in asked.0[1][0]..asked.0[1][1].min(SPAN) {
            let Some((by, aty, flipy)) = y.cells[j] else { continue };
            for &(first, count) in &x.runs {
                let Some((bx, from, flipx)) = x.cells[first] else { continue };
                let mirrors = u8::from(flipx) | u8::from(flipy) << 1 | u8::from(flipz) << 2;
                run(first + SPAN * (j + SPAN * k), count, [bx, by, bz], aty + EDGE * atz, from, mirrors);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use tremie_numerics::DVec3;

    use super::*;
    use crate::topology::Boundary;

    #[test]
    fn spans_are_blocks_and_what_mirrors_and_periodic_sides_show() {
        let sides = [[Boundary::Symmetry; 2], [Boundary::Periodic; 2], [Boundary::Wall([0.0; 3]); 2]];
        let topology = Topology::new([16, 20, 16], sides);
        let inner = Span::new(&topology, 0, 1);
        assert_eq!(
            (inner.blocks.as_slice(), inner.runs.as_slice()),
            ([0, 1].as_slice(), [(0, 8), (8, 3)].as_slice())
        );
        // Cells -8 to 2: seen in the mirror up to -1.
        let mirror = Span::new(&topology, 0, 0);
        assert_eq!(
            (mirror.cells[7], mirror.cells[6], mirror.cells[8]),
            (Some((0, 0, true)), Some((0, 1, true)), Some((0, 0, false)))
        );
        // Cells 16 to 26 of 20.
        let periodic = Span::new(&topology, 1, 3);
        assert_eq!(periodic.blocks, [2, 0]);
        assert_eq!(periodic.runs, [(0, 4), (4, 7)]);
        let wall = Span::new(&topology, 2, 2);
        assert_eq!((wall.cells[7], wall.cells[8]), (Some((0, 7, false)), None));
    }

    #[test]
    fn what_points_see_of_a_window_is_what_they_see_of_its_cells() {
        let topology = Topology::new([16; 3], [[Boundary::Periodic; 2]; 3]);
        let value = |n: usize| ((n * 7919) % 101) as f64 - 50.0;
        let mut window = Window::<f64>::new();
        for (n, cell) in window.0.iter_mut().enumerate() {
            *cell = value(n);
        }
        let around = Around::<f64>::new(&topology, DVec3::new(5.3, 8.9, 6.05));
        let mut exact = [0.0; 4];
        let mut pushed = Window::<f64>::new();
        pushed.add(&around, [1.0, 2.0, 3.0, 4.0]);
        for n in 0..64 {
            let off = [n % 4, n / 4 % 4, n / 16];
            let at = [0, 1, 2].map(|a| around.first[a] as usize % EDGE + off[a]);
            let cell = 4 * (at[0] + SPAN * (at[1] + SPAN * at[2]));
            let weight: f64 = (0..3).map(|a| around.weight[a][off[a]]).product();
            for c in 0..4 {
                exact[c] += weight * value(cell + c);
                assert!((pushed.0[cell + c] - weight * (c + 1) as f64).abs() < 1e-12);
            }
        }
        let sum = window.sum(&around);
        assert!((0..4).all(|c| (sum[c] - exact[c]).abs() < 1e-9), "{sum:?} {exact:?}");
        assert!((pushed.0.iter().sum::<f64>() - 640.0).abs() < 1e-9);
    }
}
