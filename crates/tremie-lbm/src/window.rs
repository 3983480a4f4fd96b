//! What the points in one place see and push, beside each other in memory.
//!
//! The cells around points whose first cells lie in one cube of eight along each axis are a cube of eleven: a window. It is copied out of the blocks once for all of
//! its points, with what mirrors and periodic sides show of it; and the forces of its points are summed in it before they go to the blocks. So what one point sees or
//! pushes are sixteen runs of four cells at known places.

use tremie_numerics::DVec3;

use crate::delta::{beyond, first, mirrored, weights};
use crate::grid::Grid;
use crate::immersed::{Field, Pushed};
use crate::lanes::{LANES, Lanes};
use crate::real::{Number, Real, by_axis};
use crate::topology::{EDGE, Topology};

/// Edge of a window in cells.
const SPAN: usize = EDGE + 3;

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

/// A point in its window.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Placed<T> {
    /// The first of the four cells around it along each axis.
    first: [u8; 3],
    /// How far it lies beyond the middle of the second.
    beyond: [T; 3],
}

impl<T: Real> Placed<T> {
    /// Of a point in cells from the domain's lower corner.
    #[inline(always)]
    pub(crate) fn new(topology: &Topology, at: DVec3) -> Self {
        let found = by_axis(|a| first(topology, a, at[a]));
        let edge = EDGE as i64;
        Self {
            first: by_axis(|a| found[a].0.rem_euclid(edge) as u8),
            beyond: by_axis(|a| T::from_f64(found[a].1)),
        }
    }

    /// The first of the cells around it, so many rows on.
    #[inline(always)]
    fn four(&self, m: usize, n: usize) -> usize {
        let [i, j, k] = self.first.map(usize::from);
        i + SPAN * (j + m + SPAN * (k + n))
    }

    /// Weights of the cells along each axis.
    #[inline(always)]
    fn weights(&self) -> [[T; 4]; 3] {
        by_axis(|a| weights(self.beyond[a]))
    }
}

/// The cells of a window of which something is asked, along each axis: the first, and the one after the last.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Asked([[usize; 2]; 3]);

impl Asked {
    /// What points ask for.
    #[inline(always)]
    pub(crate) fn by<T: Real>(points: &[Placed<T>]) -> Self {
        let mut asked = [[SPAN as u8, 0]; 3];
        for point in points {
            for (asked, first) in asked.iter_mut().zip(point.first) {
                *asked = [asked[0].min(first), asked[1].max(first + 4)];
            }
        }
        Self(asked.map(|asked| asked.map(usize::from)))
    }
}

/// Cells that lie beside each other both in a window and in a block.
#[derive(Debug, Clone, Copy)]
struct Run {
    /// The first in the window.
    cell: usize,
    number: usize,
    /// Which of the blocks of the spans.
    block: [usize; 3],
    /// The row in the block, and the first cell in it.
    row: usize,
    first: usize,
    /// The mirrors they are seen in, as bits.
    mirrors: u8,
}

/// The cells of a window, four numbers each.
#[derive(Debug, Clone)]
pub(crate) struct Window<T> {
    cells: Vec<[T; 4]>,
    /// Where those that are asked for lie.
    runs: Vec<Run>,
    /// Sums around points, over every other cell along x.
    halves: Vec<Lanes<T>>,
}

impl<T: Real> Window<T> {
    pub(crate) fn new() -> Self {
        Self { cells: vec![[T::ZERO; 4]; SPAN * SPAN * SPAN], runs: Vec::new(), halves: Vec::new() }
    }

    /// Finds where the cells lie that are asked for, `spans` saying where the window is, and zeroes those that lie nowhere.
    fn find(&mut self, [x, y, z]: [&Span; 3], asked: &Asked) {
        self.runs.clear();
        for k in asked.0[2][0]..asked.0[2][1].min(SPAN) {
            for j in asked.0[1][0]..asked.0[1][1].min(SPAN) {
                let from = SPAN * (j + SPAN * k);
                let (Some((bz, atz, flipz)), Some((by, aty, flipy))) = (z.cells[k], y.cells[j]) else {
                    self.cells[from..from + SPAN].fill([T::ZERO; 4]);
                    continue;
                };
                for (n, _) in x.cells.iter().enumerate().filter(|(_, cell)| cell.is_none()) {
                    self.cells[from + n] = [T::ZERO; 4];
                }
                for &(first, number) in &x.runs {
                    let Some((bx, atx, flipx)) = x.cells[first] else { continue };
                    let mirrors = u8::from(flipx) | u8::from(flipy) << 1 | u8::from(flipz) << 2;
                    let (cell, block, row) = (from + first, [bx, by, bz], aty + EDGE * atz);
                    self.runs.push(Run { cell, number, block, row, first: atx, mirrors });
                }
            }
        }
    }

    /// Copies the cells of a field that are asked for.
    #[inline(always)]
    pub(crate) fn look(&mut self, grid: &Grid<T>, spans: [&Span; 3], asked: &Asked, field: &Field<T>) {
        self.find(spans, asked);
        for run in &self.runs {
            let to = &mut self.cells[run.cell..run.cell + run.number];
            let Some(cells) = &field[slot(grid, spans, run)] else {
                to.fill([T::ZERO; 4]);
                continue;
            };
            for (to, cell) in to.iter_mut().zip(&cells.row(run.row)[run.first..run.first + run.number]) {
                *to = *cell;
            }
            if run.mirrors != 0 {
                to.iter_mut().for_each(|cell| *cell = mirrored(*cell, run.mirrors));
            }
        }
    }

    /// Whether any block that was looked at last is one of these, by slots.
    pub(crate) fn touches(&self, grid: &Grid<T>, spans: [&Span; 3], slots: &[bool]) -> bool {
        self.runs.iter().any(|run| slots[slot(grid, spans, run)])
    }

    /// Zeroes the cells.
    pub(crate) fn clear(&mut self) {
        self.cells.fill([T::ZERO; 4]);
    }

    /// Adds the forces on the cells that were asked for, times the share of each that is fluid as `seen`, to those on the blocks: `place` says where among
    /// `pushed`, slots and the forces on them, a block is.
    #[inline(always)]
    pub(crate) fn give(
        &mut self,
        spans: [&Span; 3],
        asked: &Asked,
        seen: &Field<T>,
        pushed: &mut [Pushed<T>],
        place: impl Fn([usize; 3]) -> usize,
    ) {
        self.find(spans, asked);
        for run in &self.runs {
            let Some((slot, Some(push))) = pushed.get_mut(place(run.block)) else { continue };
            let Some(seen) = &seen[*slot] else { continue };
            let own = &mut self.cells[run.cell..run.cell + run.number];
            if run.mirrors != 0 {
                own.iter_mut().for_each(|cell| *cell = mirrored(*cell, run.mirrors));
            }
            let cells = run.first..run.first + run.number;
            let (seen, push) = (&seen.row(run.row)[cells.clone()], &mut push.row_mut(run.row)[cells]);
            for ((own, seen), push) in own.chunks(2).zip(seen.chunks(2)).zip(push.chunks_mut(2)) {
                if let ([a, b], [c, d], [e, f]) = (own, seen, &mut *push) {
                    let (own, share) = ([*a, *b], [c[3], d[3]]);
                    let mut sum = Lanes::<T>::ZERO;
                    for k in 0..LANES {
                        sum.0[k] = [&*e, &*f][k / 4][k % 4] + own[k / 4][k % 4] * share[k / 4];
                    }
                    for k in 0..4 {
                        (e[k], f[k]) = (sum.0[k], sum.0[4 + k]);
                    }
                    continue;
                }
                for ((own, seen), push) in own.iter().zip(seen).zip(push) {
                    for a in 0..4 {
                        push[a] += own[a] * seen[3];
                    }
                }
            }
        }
    }

    /// Sums of the cells around points by their weights.
    #[inline(always)]
    pub(crate) fn sums(&mut self, points: &[Placed<T>], sums: &mut [[T; 4]]) {
        // Both halves are put together only after all others are done: else the compiler takes neither as a vector.
        let halves = points.iter().map(|point| halves(&self.cells, point));
        self.halves.clear();
        self.halves.extend(halves);
        for (sum, Lanes(halves)) in sums.iter_mut().zip(&self.halves) {
            for a in 0..4 {
                sum[a] = halves[a] + halves[4 + a];
            }
        }
    }

    /// Adds a vector to the cells around a point by their weights.
    #[inline(always)]
    pub(crate) fn add(&mut self, point: &Placed<T>, vector: [T; 4]) {
        let [along, across, up] = point.weights();
        let vector = two(&[vector; 4], 0);
        let along = [each(along, 0) * vector, each(along, 1) * vector];
        for n in 0..4 {
            for m in 0..4 {
                let four = self.cells.get_mut(point.four(m, n)..).and_then(|cells| cells.first_chunk_mut());
                let Some(four) = four else { continue };
                let weight = Lanes::splat(across[m] * up[n]);
                for half in 0..2 {
                    let sum = two(four, half) + weight * along[half];
                    for k in 0..LANES {
                        four[2 * half + k / 4][k % 4] = sum.0[k];
                    }
                }
            }
        }
    }
}

/// Sum of the cells around a point by their weights, of every other cell along x by itself.
#[inline(always)]
fn halves<T: Real>(cells: &[[T; 4]], point: &Placed<T>) -> Lanes<T> {
    let [along, across, up] = point.weights();
    let mut sum = [Lanes::ZERO; 2];
    for n in 0..4 {
        for m in 0..4 {
            let Some(four) = cells.get(point.four(m, n)..).and_then(|cells| cells.first_chunk()) else {
                continue;
            };
            let weight = Lanes::splat(across[m] * up[n]);
            for half in 0..2 {
                sum[half] += weight * two(four, half);
            }
        }
    }
    each(along, 0) * sum[0] + each(along, 1) * sum[1]
}

/// The first two or the last two of four cells, beside each other.
#[inline(always)]
fn two<T: Real>(four: &[[T; 4]; 4], half: usize) -> Lanes<T> {
    let mut two = Lanes::ZERO;
    for k in 0..LANES {
        two.0[k] = four[2 * half + k / 4][k % 4];
    }
    two
}

/// A number for all of each of these cells.
#[inline(always)]
fn each<T: Real>(four: [T; 4], half: usize) -> Lanes<T> {
    let mut two = Lanes::ZERO;
    for k in 0..LANES {
        two.0[k] = four[2 * half + k / 4];
    }
    two
}

/// The slot that a run lies in.
#[inline(always)]
fn slot<T: Real>(grid: &Grid<T>, spans: [&Span; 3], run: &Run) -> usize {
    grid.slot_of_block(by_axis(|a| spans[a].blocks[run.block[a]])) as usize
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::delta::Around;
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
        for (n, cell) in window.cells.as_flattened_mut().iter_mut().enumerate() {
            *cell = value(n);
        }
        let at = DVec3::new(5.3, 8.9, 6.05);
        let (placed, around) = (Placed::new(&topology, at), Around::<f64>::new(&topology, at));
        let mut exact = [0.0; 4];
        let mut pushed = Window::<f64>::new();
        pushed.add(&placed, [1.0, 2.0, 3.0, 4.0]);
        for n in 0..64 {
            let off = [n % 4, n / 4 % 4, n / 16];
            let at = [0, 1, 2].map(|a| around.first[a] as usize % EDGE + off[a]);
            let cell = 4 * (at[0] + SPAN * (at[1] + SPAN * at[2]));
            let weight: f64 = (0..3).map(|a| around.weight[a][off[a]]).product();
            for c in 0..4 {
                exact[c] += weight * value(cell + c);
                assert!((pushed.cells.as_flattened()[cell + c] - weight * (c + 1) as f64).abs() < 1e-12);
            }
        }
        let mut sum = [[0.0; 4]];
        window.sums(&[placed], &mut sum);
        let [sum] = sum;
        assert!((0..4).all(|c| (sum[c] - exact[c]).abs() < 1e-9), "{sum:?} {exact:?}");
        assert!((pushed.cells.as_flattened().iter().sum::<f64>() - 640.0).abs() < 1e-9);
    }
}
