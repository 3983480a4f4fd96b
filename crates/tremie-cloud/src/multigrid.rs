//! A preconditioner whose cost is linear: corrections on ever larger cells.
//!
//! The nodes of a cell of space move together on the next level, which has the sum of their rows and columns (aggregation with Galerkin's coarse
//! matrix), and so on with cells twice as large each time. What is known of nodes is the same all over the cell, and where it is a velocity the cell turns besides, about the middle
//! of its nodes: fluid that has not yielded moves as a solid does, and drops of it spin. A cycle smooths by damped Jacobi sweeps, all unknowns of a node or cell at once, corrects by the next level and smooths again. Such pieces are
//! stiffer than what they stand for: the correction is taken [`OVER`] times (Braess 1995).
//!
//! A correction need not be exact: on all levels matrices and values have 32 bits, because their memory is what a cycle waits for. The sums over cells are formed in 64 bits, or what small there is beside the
//! stiffness of a cell, its mass, would be lost from level to level.
//!
//! A node without entries beside the diagonal, such as a given pressure, is solved by the sweeps and belongs to no cell.

use rayon::prelude::*;
use tremie_numerics::DVec3;

use crate::Matrix;
use crate::matrix::{Block, add_product, nodes, nodes_mut, rows};

/// Couplings smaller than this share of the largest in their row are left out: those beyond the nearest neighbours of a lattice along its axes and across its squares. In space they are three of four,
/// and without them there are about as many iterations.
const WEAK: f64 = 0.2;
/// Sweeps before and after the correction.
const SWEEPS: usize = 2;
/// Damping of a sweep.
const DAMPING: f64 = 0.67;
/// By how much corrections are larger than those of constant pieces.
const OVER: f32 = 1.8;
/// Unknowns of the last level at most, and sweeps there.
const FEW: usize = 64;
const LAST: usize = 40;
/// Nodes or cells that one thread takes at a time.
const CHUNK: usize = 256;

/// The levels below a matrix for nodes with N unknowns, and cells with M: as many, and the turns of velocities, one in a plane and three in space.
#[derive(Debug, Clone)]
pub struct Multigrid<const N: usize, const M: usize> {
    matrix: Matrix<N, f32>,
    smoother: Smoother<N>,
    first: Option<Level<N, M>>,
    rest: Vec<Level<M, M>>,
}

/// A level below another one.
#[derive(Debug, Clone)]
struct Level<const A: usize, const M: usize> {
    transfer: Transfer<A, M, f32>,
    matrix: Matrix<M, f32>,
    smoother: Smoother<M>,
}

/// How pieces with A unknowns move with cells of them.
#[derive(Debug, Clone)]
struct Transfer<const A: usize, const M: usize, T> {
    /// The cell of each piece, or [`NONE`], and how its unknowns follow those of the cell.
    cells: Vec<u32>,
    follows: Vec<[[T; M]; A]>,
    /// The pieces of each cell, and where they begin.
    members: Vec<u32>,
    firsts: Vec<usize>,
}

/// The cell of who belongs to none.
const NONE: u32 = u32::MAX;

/// What the unknowns of a level belong to: nodes, or cells of them.
struct Pieces {
    /// Where each is, in m, and in which cell of that level.
    at: Vec<DVec3>,
    cells: Vec<[i64; 3]>,
    /// Turns are in m/s at a distance of `length` in m.
    length: f64,
}

impl<const N: usize, const M: usize> Multigrid<N, M> {
    /// For a matrix over nodes at `positions`, `spacing` apart; both in m. Two unknowns of a node are the velocities along x and z in a plane, three those in space.
    pub fn new(matrix: &Matrix<N>, positions: &[DVec3], spacing: f64) -> Self {
        const { assert!((N == 1 && M == 1) || (N == 2 && M == 3) || (N == 3 && M == 6)) };
        let matrix = &matrix.strong(WEAK);
        let cell = |at: &DVec3| (*at / spacing).floor().to_array().map(|x| x as i64);
        let cells = positions.iter().map(cell).collect();
        let mut pieces = Pieces { at: positions.to_vec(), cells, length: spacing };
        let (mut first, mut rest) = (None, Vec::new());
        if let Some((level, mut exact)) = coarser::<N, N, M>(matrix, &mut pieces) {
            first = Some(level);
            while let Some((level, next)) = coarser::<N, M, M>(&exact, &mut pieces) {
                rest.push(level);
                exact = next;
            }
        }
        Self { matrix: matrix.rounded(), smoother: Smoother::new(matrix), first, rest }
    }

    /// Entries of all levels over those of the first.
    pub fn complexity(&self) -> f64 {
        let first = self.first.iter().map(|level| level.matrix.entries());
        let entries: usize = first.chain(self.rest.iter().map(|level| level.matrix.entries())).sum();
        1.0 + entries as f64 / self.matrix.entries() as f64
    }

    /// About the solution of `A x = b`, by one cycle from zero on; symmetric if A is.
    pub(crate) fn cycle(&self, b: &[f64]) -> Vec<f64> {
        // So that nothing is too small or too large for 32 bits.
        let scale = b.iter().fold(0.0, |scale: f64, b| scale.max(b.abs()));
        if scale == 0.0 {
            return vec![0.0; b.len()];
        }
        let b: Vec<f32> = b.iter().map(|b| (b / scale) as f32).collect();
        let x = descend(&self.matrix, &self.smoother, self.first.as_ref(), &self.rest, &b);
        x.into_iter().map(|x| scale * f64::from(x)).collect()
    }
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
    let cell = |piece: u32| pieces.cells[piece as usize].map(|x| x.div_euclid(2));
    let coupled = |piece: &u32| fine.others(*piece as usize).next().is_some();
    let mut members: Vec<u32> = (0..number as u32).filter(coupled).collect();
    members.par_sort_by_key(|piece| cell(*piece));
    let groups: Vec<&[u32]> = members.chunk_by(|a, b| cell(*a) == cell(*b)).collect();
    if groups.is_empty() || groups.len() == number {
        return None;
    }
    let length = 2.0 * pieces.length;
    let (mut cells, mut follows) = (vec![NONE; number], vec![[[0.0; M]; A]; number]);
    let (mut firsts, mut larger) = (vec![0], Pieces { at: Vec::new(), cells: Vec::new(), length });
    for (number, group) in (0..).zip(&groups) {
        let middle = group.iter().map(|piece| pieces.at[*piece as usize]).sum::<DVec3>() / group.len() as f64;
        for piece in group.iter().map(|piece| *piece as usize) {
            cells[piece] = number;
            follows[piece] = follow::<N, A, M>((pieces.at[piece] - middle) / length, pieces.length / length);
        }
        firsts.push(firsts[firsts.len() - 1] + group.len());
        larger.at.push(middle);
        larger.cells.push(cell(group[0]));
    }
    *pieces = larger;
    let transfer = Transfer { cells, follows, members, firsts };
    let matrix = transfer.galerkin(fine);
    let smoother = Smoother::new(&matrix);
    Some((Level { transfer: transfer.rounded(), matrix: matrix.rounded(), smoother }, matrix))
}

impl<const A: usize, const M: usize, T> Transfer<A, M, T> {
    fn members(&self, cell: usize) -> impl Iterator<Item = usize> {
        self.members[self.firsts[cell]..self.firsts[cell + 1]].iter().map(|piece| *piece as usize)
    }
}

impl<const A: usize, const M: usize> Transfer<A, M, f64> {
    /// The sums of rows and columns over cells: P^T A P, P being how pieces follow.
    fn galerkin(&self, fine: &Matrix<A>) -> Matrix<M> {
        let row = |cell: usize| {
            let mut own = [[0.0; M]; M];
            let mut others: Vec<(u32, Block<M>)> = Vec::new();
            for piece in self.members(cell) {
                let diagonal = std::iter::once((piece, &fine.diagonal[piece]));
                for (column, block) in diagonal.chain(fine.others(piece)) {
                    let there = self.cells[column];
                    if there == NONE {
                        continue;
                    }
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
            others.sort_unstable_by_key(|(cell, _)| *cell);
            (own, others)
        };
        let cells = 0..self.firsts.len() - 1;
        let rows: Vec<_> = cells.into_par_iter().with_min_len(CHUNK / 4).map(row).collect();
        Matrix::from_blocks(rows)
    }

    fn rounded(self) -> Transfer<A, M, f32> {
        let Self { cells, follows, members, firsts } = self;
        let follows = follows.into_iter().map(|piece| piece.map(|row| row.map(|by| by as f32))).collect();
        Transfer { cells, follows, members, firsts }
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
            if self.cells[piece] != NONE {
                let value: &[f32; M] = &cells[self.cells[piece] as usize];
                for (x, row) in x.iter_mut().zip(&self.follows[piece]) {
                    *x += times * row.iter().zip(value).map(|(by, value)| by * value).sum::<f32>();
                }
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

/// Damped Jacobi sweeps: the inverses of what couples the unknowns of each piece. Smoothed row by row instead, what is stiff along one slanted line only would grow.
#[derive(Debug, Clone)]
struct Smoother<const A: usize>(Vec<Block<A, f32>>);

impl<const A: usize> Smoother<A> {
    fn new(matrix: &Matrix<A>) -> Self {
        let rounded = |block: &Block<A>| inverse(*block).map(|row| row.map(|value| value as f32));
        Self(matrix.diagonal.par_iter().with_min_len(CHUNK).map(rounded).collect())
    }

    /// Adds what a residual tells values to change by.
    fn change(&self, residual: &[f32], x: &mut [f32]) {
        let residual = nodes::<A, f32>(residual);
        rows(nodes_mut::<A, f32>(x), |piece, x| add_product(x, &self.0[piece], &residual[piece]));
    }

    fn sweep(&self, matrix: &Matrix<A, f32>, b: &[f32], x: &mut [f32], residual: &mut [f32]) {
        matrix.residual(b, x, residual);
        self.change(residual, x);
    }
}

/// What of a diagonal must be left to divide by: less, such as the turns of pieces along a line about it, is drowned in what 32 bits round off.
const LEFT: f64 = 1e-4;

/// The damped inverse, by Gauss and Jordan along the diagonal, which is positive; what is as good as not there stays zero.
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
    block.map(|row| row.map(|value| DAMPING * value))
}

/// A cycle on a level and those below.
fn descend<const A: usize, const M: usize>(
    matrix: &Matrix<A, f32>,
    smoother: &Smoother<A>,
    next: Option<&Level<A, M>>,
    below: &[Level<M, M>],
    b: &[f32],
) -> Vec<f32> {
    let (mut x, mut residual) = (vec![0.0; b.len()], vec![0.0; b.len()]);
    // The first sweep from zero.
    smoother.change(b, &mut x);
    let Some(next) = next else {
        (1..LAST).for_each(|_| smoother.sweep(matrix, b, &mut x, &mut residual));
        return x;
    };
    (1..SWEEPS).for_each(|_| smoother.sweep(matrix, b, &mut x, &mut residual));
    matrix.residual(b, &x, &mut residual);
    let coarse = next.transfer.gather(&residual);
    let rest = below.get(1..).unwrap_or_default();
    let correction = descend(&next.matrix, &next.smoother, below.first(), rest, &coarse);
    next.transfer.follow(&correction, OVER, &mut x);
    (0..SWEEPS).for_each(|_| smoother.sweep(matrix, b, &mut x, &mut residual));
    x
}
