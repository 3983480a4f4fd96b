//! A preconditioner whose cost is linear: corrections on ever larger cells.
//!
//! The nodes of a cell of space move together on the next level, which has the sum of their rows and columns (aggregation with Galerkin's coarse
//! matrix), and so on with cells twice as large each time. What is known of nodes is the same all over the cell, and where it is a velocity the cell turns besides, about the middle
//! of its nodes: fluid that has not yielded moves as a solid does, and drops of it spin. A cycle sweeps by Gauss and Seidel from the first node to the last, all unknowns of a node or cell at once, corrects by two cycles on the
//! next level and sweeps back; with one on each, iterations would grow with the number of levels. Such pieces are stiffer than what they stand for: the correction is taken [`OVER`] times (Braess 1995).
//!
//! Nodes stand along a curve through space, so that those of a cell follow each other on all levels, and that of some thousand in a row, within which a sweep goes one after the other, few have neighbours
//! elsewhere: of these it takes what they were before, whatever the threads do.
//!
//! A correction need not be exact: on all levels matrices and values have 32 bits, because their memory is what a cycle waits for. The sums over cells are formed in 64 bits, or what small there is beside the
//! stiffness of a cell, its mass, would be lost from level to level.
//!
//! A node without entries beside the diagonal, such as a given pressure, is solved by itself and belongs to no cell.

use std::ops::Range;

use rayon::prelude::*;
use tremie_numerics::DVec3;

use crate::Matrix;
use crate::curve::keys;
use crate::matrix::{Block, Number, add_product, nodes, nodes_mut, rows};

/// Couplings smaller than this share of the largest of either node are left out: those beyond the nearest neighbours of a lattice along its axes and across its squares. In space they are three of four,
/// and without them there are about as many iterations.
const WEAK: f64 = 0.2;
/// By how much corrections are larger than those of constant pieces.
const OVER: f32 = 1.4;
/// Unknowns of the last level at most, and sweeps to and fro there.
const FEW: usize = 64;
const LAST: usize = 10;
/// Nodes or cells that one thread takes at a time.
const CHUNK: usize = 256;
/// Nodes or cells in a row that a sweep takes one after the other.
const RUN: usize = 2048;

/// The levels below a matrix for nodes with N unknowns, and cells with M: as many, and the turns of velocities, one in a plane and three in space.
#[derive(Debug, Clone)]
pub struct Multigrid<const N: usize, const M: usize> {
    /// The nodes that others are coupled to, along the curve.
    order: Vec<u32>,
    /// The place of each node there, or [`NONE`].
    places: Vec<u32>,
    /// Inverses of what couples the unknowns of the others, by their numbers.
    alone: Vec<(u32, Block<N>)>,
    grid: Grid<N>,
    first: Option<Level<N, M>>,
    rest: Vec<Level<M, M>>,
}

/// A level below another one.
#[derive(Debug, Clone)]
struct Level<const A: usize, const M: usize> {
    transfer: Transfer<A, M, f32>,
    grid: Grid<M>,
}

/// How pieces with A unknowns move with cells of them.
#[derive(Debug, Clone)]
struct Transfer<const A: usize, const M: usize, T> {
    /// The cell of each piece, and how its unknowns follow those of the cell.
    cells: Vec<u32>,
    follows: Vec<[[T; M]; A]>,
    /// Where the pieces of each cell begin, and the end of all.
    firsts: Vec<u32>,
}

/// Stands for no place.
const NONE: u32 = u32::MAX;

/// What the unknowns of a level belong to: nodes, or cells of them.
struct Pieces {
    /// Where each is, in m, and its key along the curve.
    at: Vec<DVec3>,
    keys: Vec<u64>,
    /// Turns are in m/s at a distance of `length` in m.
    length: f64,
}

impl<const N: usize, const M: usize> Multigrid<N, M> {
    /// For a matrix over nodes at `positions`, `spacing` apart; both in m. Two unknowns of a node are the velocities along x and z in a plane, three those in space.
    pub fn new(matrix: &Matrix<N>, positions: &[DVec3], spacing: f64) -> Self {
        const { assert!((N == 1 && M == 1) || (N == 2 && M == 3) || (N == 3 && M == 6)) };
        let coupled = |node: &u32| matrix.others(*node as usize).next().is_some();
        let (coupled, alone): (Vec<u32>, Vec<u32>) = (0..matrix.len() as u32).partition(coupled);
        let alone = alone.into_iter().map(|node| (node, inverse(matrix.diagonal[node as usize]))).collect();
        let (keys, order): (Vec<u64>, Vec<u32>) = keys(positions, &coupled, spacing).into_iter().unzip();
        let mut places = vec![NONE; matrix.len()];
        (0..).zip(&order).for_each(|(place, node)| places[*node as usize] = place);
        let strong = strong(matrix, &order, &places);
        let at = order.iter().map(|node| positions[*node as usize]).collect();
        let mut pieces = Pieces { at, keys, length: spacing };
        let (mut first, mut rest) = (None, Vec::new());
        if let Some((level, mut exact)) = coarser::<N, N, M>(&strong, &mut pieces) {
            first = Some(level);
            while let Some((level, next)) = coarser::<N, M, M>(&exact, &mut pieces) {
                rest.push(level);
                exact = next;
            }
        }
        Self { order, places, alone, grid: Grid::new(&strong), first, rest }
    }

    /// Entries of all levels over those of the first.
    pub fn complexity(&self) -> f64 {
        let first = self.first.iter().map(|level| level.grid.matrix.entries());
        let entries: usize = first.chain(self.rest.iter().map(|level| level.grid.matrix.entries())).sum();
        1.0 + entries as f64 / self.grid.matrix.entries() as f64
    }

    /// About the solution of `A x = b`, by one cycle from zero on; symmetric if A is.
    pub(crate) fn cycle<T: Number>(&self, b: &[T], to: &mut [T]) {
        to.fill(T::default());
        // So that nothing is too small or too large for 32 bits.
        let scale = b.iter().fold(0.0, |scale: f64, b| scale.max(b.in_full().abs()));
        if scale == 0.0 {
            return;
        }
        let b = nodes::<N, T>(b);
        let mut ordered = vec![0.0; N * self.order.len()];
        rows(nodes_mut::<N, f32>(&mut ordered), |place, to| {
            *to = b[self.order[place] as usize].map(|b| (b.in_full() / scale) as f32);
        });
        let x = descend(&self.grid, self.first.as_ref(), &self.rest, &ordered);
        let x = nodes::<N, f32>(&x);
        rows(nodes_mut::<N, T>(to), |node, to| {
            if self.places[node] != NONE {
                *to = x[self.places[node] as usize].map(|x| T::told(scale * f64::from(x)));
            }
        });
        for (node, inverse) in &self.alone {
            let mut sum = [0.0; N];
            add_product(&mut sum, inverse, &b[*node as usize].map(Number::in_full));
            nodes_mut::<N, T>(to)[*node as usize] = sum.map(T::told);
        }
    }
}

/// The matrix among nodes in this order, without the blocks that are smaller than [`WEAK`] of the largest beside the diagonal of either row, by their largest numbers; what they hold is added to the diagonal, so that what is even
/// stays so.
fn strong<const N: usize>(matrix: &Matrix<N>, order: &[u32], places: &[u32]) -> Matrix<N> {
    let size = |block: &Block<N>| block.iter().flatten().fold(0.0, |size: f64, value| size.max(value.abs()));
    let least =
        |row: &u32| WEAK * matrix.others(*row as usize).map(|(_, block)| size(block)).fold(0.0, f64::max);
    let least: Vec<f64> = order.par_iter().with_min_len(CHUNK).map(least).collect();
    Matrix::build(order.len(), |row, kept| {
        let (own_least, row) = (least[row], order[row] as usize);
        let mut own = matrix.diagonal[row];
        for (column, block) in matrix.others(row) {
            let place = places[column];
            if place == NONE {
                continue;
            }
            // Stiff nodes must not lose what couples them to soft ones, or those lean on what does not lean on them.
            if size(block) < own_least.min(least[place as usize]) {
                own.iter_mut().flatten().zip(block.iter().flatten()).for_each(|(own, value)| *own += value);
            } else {
                kept.push((place, *block));
            }
        }
        own
    })
}

/// How a piece with A unknowns follows a cell whose middle it is `way` away from, over the length of the cell, N of the unknowns being no turns; turns are in m/s at so much of the length of
/// the cell as is the `length` of the piece.
fn follow<const N: usize, const A: usize, const M: usize>(way: DVec3, length: f64) -> [[f64; M]; A] {
    let (axes, turns): (&[usize], &[DVec3]) = match N {
        2 => (&[0, 2], &[DVec3::Y]),
        3 => (&[0, 1, 2], &DVec3::AXES),
        _ => (&[0], &[]),
    };
    let mut follows = [[0.0; M]; A];
    for k in 0..N {
        follows[k][k] = 1.0;
        for (m, turn) in turns.iter().enumerate() {
            follows[k][N + m] = turn.cross(way)[axes[k]];
        }
    }
    (N..A).for_each(|k| follows[k][k] = length);
    follows
}

/// The next level and its matrix in all digits, on cells twice as large, whose pieces take the place of those given; none if there are few already, or cells would hold a piece each.
fn coarser<const N: usize, const A: usize, const M: usize>(
    fine: &Matrix<A>,
    pieces: &mut Pieces,
) -> Option<(Level<A, M>, Matrix<M>)> {
    let number = fine.len();
    if number * A <= FEW {
        return None;
    }
    let length = 2.0 * pieces.length;
    let (mut cells, mut follows) = (Vec::with_capacity(number), Vec::with_capacity(number));
    let (mut firsts, mut larger) = (vec![0], Pieces { at: Vec::new(), keys: Vec::new(), length });
    for group in pieces.keys.chunk_by(|a, b| a >> 3 == b >> 3) {
        let range = cells.len()..cells.len() + group.len();
        let middle = pieces.at[range.clone()].iter().sum::<DVec3>() / group.len() as f64;
        cells.extend(range.clone().map(|_| larger.at.len() as u32));
        let way = |piece: usize| (pieces.at[piece] - middle) / length;
        follows.extend(range.map(|piece| follow::<N, A, M>(way(piece), pieces.length / length)));
        firsts.push(cells.len() as u32);
        larger.at.push(middle);
        larger.keys.push(group[0] >> 3);
    }
    if larger.at.len() == number {
        return None;
    }
    *pieces = larger;
    let transfer = Transfer { cells, follows, firsts };
    let matrix = transfer.galerkin(fine);
    Some((Level { transfer: transfer.rounded(), grid: Grid::new(&matrix) }, matrix))
}

impl<const A: usize, const M: usize, T> Transfer<A, M, T> {
    fn members(&self, cell: usize) -> Range<usize> {
        self.firsts[cell] as usize..self.firsts[cell + 1] as usize
    }
}

impl<const A: usize, const M: usize> Transfer<A, M, f64> {
    /// The sums of rows and columns over cells: P^T A P, P being how pieces follow.
    fn galerkin(&self, fine: &Matrix<A>) -> Matrix<M> {
        Matrix::build(self.firsts.len() - 1, |cell, others| {
            let mut own = [[0.0; M]; M];
            for piece in self.members(cell) {
                let diagonal = std::iter::once((piece, &fine.diagonal[piece]));
                for (column, block) in diagonal.chain(fine.others(piece)) {
                    let there = self.cells[column];
                    let sum = if there as usize == cell {
                        &mut own
                    } else {
                        let found = others.iter().position(|(cell, _)| *cell == there);
                        let place = found.unwrap_or_else(|| {
                            others.push((there, [[0.0; M]; M]));
                            others.len() - 1
                        });
                        &mut others[place].1
                    };
                    add_seen(sum, &self.follows[piece], block, &self.follows[column]);
                }
            }
            // A cell with one piece cannot turn.
            for (k, row) in own.iter_mut().enumerate().filter(|(k, row)| row[*k] == 0.0) {
                row[k] = 1.0;
            }
            own
        })
    }

    fn rounded(self) -> Transfer<A, M, f32> {
        let Self { cells, follows, firsts } = self;
        let follows = follows.into_iter().map(|piece| piece.map(|row| row.map(|by| by as f32))).collect();
        Transfer { cells, follows, firsts }
    }
}

impl<const A: usize, const M: usize> Transfer<A, M, f32> {
    /// What cells get of what their pieces have.
    fn gather(&self, of: &[f32]) -> Vec<f32> {
        let of = nodes::<A, f32>(of);
        let mut to = vec![0.0; M * (self.firsts.len() - 1)];
        rows(nodes_mut::<M, f32>(&mut to), |cell, sum| {
            for piece in self.members(cell) {
                let value: &[f32; A] = &of[piece];
                for (row, value) in self.follows[piece].iter().zip(value) {
                    sum.iter_mut().zip(row).for_each(|(sum, by)| *sum += by * value);
                }
            }
        });
        to
    }

    /// Adds to pieces, so many times, what they have of their cells.
    fn follow(&self, cells: &[f32], times: f32, to: &mut [f32]) {
        let cells = nodes::<M, f32>(cells);
        rows(nodes_mut::<A, f32>(to), |piece, x| {
            let value: &[f32; M] = &cells[self.cells[piece] as usize];
            for (x, row) in x.iter_mut().zip(&self.follows[piece]) {
                *x += times * row.iter().zip(value).map(|(by, value)| by * value).sum::<f32>();
            }
        });
    }
}

/// `sum` += P^T B Q
#[inline(always)]
fn add_seen<const A: usize, const M: usize>(
    sum: &mut Block<M>,
    p: &[[f64; M]; A],
    block: &Block<A>,
    q: &[[f64; M]; A],
) {
    for (p, row) in p.iter().zip(block) {
        let mut seen = [0.0; M];
        for (value, q) in row.iter().zip(q) {
            seen.iter_mut().zip(q).for_each(|(seen, q)| *seen += value * q);
        }
        for (sum, p) in sum.iter_mut().zip(p) {
            sum.iter_mut().zip(&seen).for_each(|(sum, seen)| *sum += p * seen);
        }
    }
}

/// A matrix and the inverses of what couples the unknowns of each piece. Smoothed row by row instead, what is stiff along one slanted line only would grow.
#[derive(Debug, Clone)]
struct Grid<const A: usize> {
    matrix: Matrix<A, f32>,
    /// Where in each row columns beyond its own begin.
    middles: Vec<u32>,
    inverses: Vec<Block<A, f32>>,
}

/// The other way round, by columns, so that what they add to needs no sums across.
fn turned<const A: usize>(block: &Block<A>) -> Block<A, f32> {
    std::array::from_fn(|j| std::array::from_fn(|i| block[i][j] as f32))
}

/// `sum` += A x for a block by columns.
#[inline(always)]
fn add_columns<const A: usize>(sum: &mut [f32; A], block: &Block<A, f32>, x: &[f32; A]) {
    for (column, x) in block.iter().zip(x) {
        for (sum, value) in sum.iter_mut().zip(column) {
            *sum += *value * *x;
        }
    }
}

/// Does something for each run of pieces, by its first; for one alone nobody is woken.
fn runs<T: Send>(of: &mut [T], make: impl Fn(usize, &mut [T]) + Sync + Send) {
    if of.len() <= RUN {
        make(0, of);
    } else {
        of.par_chunks_mut(RUN).enumerate().for_each(|(run, of)| make(run * RUN, of));
    }
}

impl<const A: usize> Grid<A> {
    fn new(matrix: &Matrix<A>) -> Self {
        let inverses = matrix.diagonal.par_iter().with_min_len(CHUNK);
        let inverses = inverses.map(|block| turned(&inverse(*block))).collect();
        let before = |row: usize| matrix.others(row).take_while(|(column, _)| *column < row).count() as u32;
        let middles = (0..matrix.len()).into_par_iter().with_min_len(CHUNK).map(before).collect();
        Self { matrix: matrix.as_told(turned), middles, inverses }
    }

    /// What a piece has if what else there is of its row is `seen`.
    #[inline(always)]
    fn solved(&self, piece: usize, b: &[f32; A], seen: &[f32; A]) -> [f32; A] {
        let (mut x, left) = ([0.0; A], std::array::from_fn(|k| b[k] - seen[k]));
        add_columns(&mut x, &self.inverses[piece], &left);
        x
    }

    /// The sweep from the first to the last, from zero on, and the residual after it.
    fn down(&self, b: &[f32]) -> [Vec<f32>; 2] {
        let (mut all, mut residual) = (vec![0.0; b.len()], vec![0.0; b.len()]);
        let b = nodes::<A, f32>(b);
        runs(nodes_mut::<A, f32>(&mut all), |first, x| {
            for k in 0..x.len() {
                let (mut seen, row) = ([0.0; A], first + k);
                let [(columns, blocks), _] = self.matrix.split(row, self.middles[row]);
                for (column, block) in columns.iter().zip(blocks) {
                    if let Some(before) = (*column as usize).checked_sub(first) {
                        add_columns(&mut seen, block, &x[before]);
                    }
                }
                x[k] = self.solved(row, &b[row], &seen);
            }
        });
        // Nothing is left of what the sweep has seen.
        let x = nodes::<A, f32>(&all);
        rows(nodes_mut::<A, f32>(&mut residual), |row, to| {
            let mut unseen = [0.0; A];
            let [(before, of_before), (after, of_after)] = self.matrix.split(row, self.middles[row]);
            let outside =
                before.iter().zip(of_before).filter(|(column, _)| (**column as usize) < row - row % RUN);
            for (column, block) in outside.chain(after.iter().zip(of_after)) {
                add_columns(&mut unseen, block, &x[*column as usize]);
            }
            *to = unseen.map(|unseen| -unseen);
        });
        [all, residual]
    }

    /// b - A x
    fn residual(&self, b: &[f32], x: &[f32]) -> Vec<f32> {
        let mut residual = vec![0.0; b.len()];
        let (b, x) = (nodes::<A, f32>(b), nodes::<A, f32>(x));
        rows(nodes_mut::<A, f32>(&mut residual), |row, to| {
            let mut seen = [0.0; A];
            add_columns(&mut seen, &self.matrix.diagonal[row], &x[row]);
            for (column, block) in self.matrix.others(row) {
                add_columns(&mut seen, block, &x[column]);
            }
            *to = std::array::from_fn(|k| b[row][k] - seen[k]);
        });
        residual
    }

    /// A sweep in which each run goes through its pieces as told.
    fn sweep<I: Iterator<Item = usize>>(
        &self,
        b: &[f32],
        all: &mut [f32],
        through: impl Fn(Range<usize>) -> I + Sync,
    ) {
        let before = if all.len() > A * RUN { all.to_vec() } else { Vec::new() };
        let (b, before) = (nodes::<A, f32>(b), nodes::<A, f32>(&before));
        runs(nodes_mut::<A, f32>(all), |first, x| {
            for k in through(0..x.len()) {
                let (mut seen, row) = ([0.0; A], first + k);
                for (column, block) in self.matrix.others(row) {
                    let of = x.get(column.wrapping_sub(first)).unwrap_or_else(|| &before[column]);
                    add_columns(&mut seen, block, of);
                }
                x[k] = self.solved(row, &b[row], &seen);
            }
        });
    }
}

/// What of a diagonal must be left to divide by: less, such as the turns of pieces along a line about it, is drowned in what 32 bits round off.
const LEFT: f64 = 1e-4;

/// The inverse, by Gauss and Jordan along the diagonal, which is positive; what is as good as not there stays zero.
fn inverse<const A: usize>(mut block: Block<A>) -> Block<A> {
    let scale: [f64; A] = std::array::from_fn(|k| block[k][k]);
    for k in 0..A {
        let pivot = block[k][k];
        if pivot.abs() <= LEFT * scale[k].abs() {
            for j in 0..A {
                block[k][j] = 0.0;
                block[j][k] = 0.0;
            }
            continue;
        }
        block[k][k] = 1.0;
        block[k].iter_mut().for_each(|value| *value /= pivot);
        let row = block[k];
        for j in (0..A).filter(|j| *j != k) {
            let by = std::mem::replace(&mut block[j][k], 0.0);
            block[j].iter_mut().zip(row).for_each(|(value, of_row)| *value -= by * of_row);
        }
    }
    block
}

/// A cycle on a level and those below.
fn descend<const A: usize, const M: usize>(
    grid: &Grid<A>,
    next: Option<&Level<A, M>>,
    below: &[Level<M, M>],
    b: &[f32],
) -> Vec<f32> {
    let Some(next) = next else {
        let mut x = vec![0.0; b.len()];
        for _ in 0..LAST {
            grid.sweep(b, &mut x, |run| run);
            grid.sweep(b, &mut x, |run| run.rev());
        }
        return x;
    };
    let [mut x, residual] = grid.down(b);
    let coarse = next.transfer.gather(&residual);
    let rest = below.get(1..).unwrap_or_default();
    let again = |b: &[f32]| descend(&next.grid, below.first(), rest, b);
    let mut correction = again(&coarse);
    let more = again(&next.grid.residual(&coarse, &correction));
    correction.iter_mut().zip(more).for_each(|(correction, more)| *correction += more);
    next.transfer.follow(&correction, OVER, &mut x);
    grid.sweep(b, &mut x, |run| run.rev());
    x
}
