//! A preconditioner whose cost is linear: corrections on ever larger cells.
//!
//! The nodes of a cell of space move together on the next level, which has the sum of their rows and columns (aggregation with Galerkin's coarse
//! matrix), and so on with cells twice as large each time. What is known of nodes is the same all over the cell, and where it is a velocity the cell turns besides, about the middle
//! of its nodes: fluid that has not yielded moves as a solid does, and drops of it spin. A cycle smooths by damped Jacobi sweeps, all unknowns of a node or cell at once, corrects by the next level and smooths again. Such pieces are
//! stiffer than what they stand for: the correction is taken [`OVER`] times (Braess 1995).
//!
//! A node without entries beside the diagonal, such as a given pressure, is solved by the sweeps and belongs to no cell.

use std::collections::BTreeMap;

use rayon::prelude::*;
use tremie_numerics::DVec3;

use crate::Matrix;
use crate::matrix::rows;

/// Sweeps before and after the correction.
const SWEEPS: usize = 2;
/// Damping of a sweep.
const DAMPING: f64 = 0.67;
/// By how much corrections are larger than those of constant pieces.
const OVER: f64 = 1.8;
/// Rows of the last level at most, and sweeps there.
const FEW: usize = 64;
const LAST: usize = 40;

/// A level below another one.
#[derive(Debug, Clone)]
struct Level {
    /// For each row of the level above, the rows of this one that it moves with, and by how much; none where it belongs to no cell.
    moves: Vec<Vec<(u32, f64)>>,
    /// The same for each row of this level.
    moved: Vec<Vec<(u32, f64)>>,
    matrix: Matrix,
    /// Unknowns of a cell, and the inverses of what couples those of each; none if there is one.
    unknowns: usize,
    inverses: Vec<Inverse>,
}

/// The levels below a matrix.
#[derive(Debug, Clone)]
pub struct Multigrid {
    /// Unknowns of a node, and the inverses of what couples those of each; none if there is one.
    kinds: usize,
    inverses: Vec<Inverse>,
    levels: Vec<Level>,
}

/// What the unknowns of a level belong to: nodes, or cells of them.
struct Pieces {
    /// Where each is, in m, and in which cell of that level.
    at: Vec<DVec3>,
    cells: Vec<[i64; 3]>,
    /// Unknowns of each: first what nodes have, then turns, in m/s at a distance of `length` in m.
    unknowns: usize,
    length: f64,
}

/// Axes of the components that a node has, and of turns.
fn axes(kinds: usize) -> (&'static [usize], &'static [DVec3]) {
    match kinds {
        2 => (&[0, 2], &[DVec3::Y]),
        3 => (&[0, 1, 2], &DVec3::AXES),
        _ => (&[0], &[]),
    }
}

impl Multigrid {
    /// For a matrix over nodes at `positions`, `spacing` apart; both in m. A node may have several unknowns, whose rows follow each other: the components of a velocity, two of them in a plane.
    pub fn new(matrix: &Matrix, positions: &[DVec3], spacing: f64) -> Self {
        let kinds = (matrix.len() / positions.len().max(1)).max(1);
        let cell = |at: &DVec3| (*at / spacing).floor().to_array().map(|x| x as i64);
        let cells = positions.iter().map(cell).collect();
        let mut pieces = Pieces { at: positions.to_vec(), cells, unknowns: kinds, length: spacing };
        let mut levels: Vec<Level> = Vec::new();
        loop {
            let fine = levels.last().map_or(matrix, |level| &level.matrix);
            if fine.len() <= FEW {
                break;
            }
            let Some((level, larger)) = coarser(fine, &pieces, kinds) else { break };
            pieces = larger;
            levels.push(level);
        }
        let inverses = if kinds == 1 { Vec::new() } else { inverses(matrix, kinds) };
        Self { kinds, inverses, levels }
    }

    /// Entries of all levels over those of the first.
    pub fn complexity(&self, matrix: &Matrix) -> f64 {
        let entries: usize = self.levels.iter().map(|level| level.matrix.entries()).sum();
        1.0 + entries as f64 / matrix.entries() as f64
    }

    /// About the solution of `A x = b`, by one cycle from zero on; symmetric if A is.
    pub(crate) fn cycle(&self, matrix: &Matrix, b: &[f64]) -> Vec<f64> {
        let sweeps = Sweeps { kinds: self.kinds, inverses: &self.inverses };
        descend(matrix, sweeps, &self.levels, b)
    }
}

/// The next level, on cells twice as large; none if they would hold a piece each.
fn coarser(fine: &Matrix, pieces: &Pieces, kinds: usize) -> Option<(Level, Pieces)> {
    let (components, turns) = axes(kinds);
    let (old, new) = (pieces.unknowns, kinds + turns.len());
    let mut members = BTreeMap::<[i64; 3], Vec<usize>>::new();
    for (piece, cell) in pieces.cells.iter().enumerate() {
        if (0..old).any(|k| fine.others(piece * old + k).next().is_some()) {
            members.entry(cell.map(|x| x.div_euclid(2))).or_default().push(piece);
        }
    }
    if members.is_empty() || members.len() == pieces.at.len() {
        return None;
    }
    let middle = |of: &Vec<usize>| of.iter().map(|n| pieces.at[*n]).sum::<DVec3>() / of.len() as f64;
    let at: Vec<DVec3> = members.values().map(middle).collect();
    let length = 2.0 * pieces.length;
    let mut moves = vec![Vec::new(); fine.len()];
    for (cell, of) in members.values().enumerate() {
        let column = |k: usize| (cell * new + k) as u32;
        for piece in of.iter().copied() {
            let way = (pieces.at[piece] - at[cell]) / length;
            for (k, axis) in components.iter().enumerate().take(kinds) {
                let turned =
                    turns.iter().enumerate().map(|(m, turn)| (column(kinds + m), turn.cross(way)[*axis]));
                moves[piece * old + k] =
                    std::iter::once((column(k), 1.0)).chain(turned.filter(|(_, by)| *by != 0.0)).collect();
            }
            for k in kinds..old {
                moves[piece * old + k] = vec![(column(k), pieces.length / length)];
            }
        }
    }
    let mut moved = vec![Vec::new(); members.len() * new];
    for (row, columns) in (0..).zip(&moves) {
        columns.iter().for_each(|(column, by)| moved[*column as usize].push((row, *by)));
    }
    let matrix = galerkin(fine, &moves, members.values(), old, new);
    let inverses = if new == 1 { Vec::new() } else { inverses(&matrix, new) };
    let cells = members.into_keys().collect();
    Some((
        Level { moves, moved, matrix, unknowns: new, inverses },
        Pieces { at, cells, unknowns: new, length },
    ))
}

/// The sums of rows and columns over cells: P^T A P, P being `moves`.
fn galerkin<'a>(
    fine: &Matrix,
    moves: &[Vec<(u32, f64)>],
    members: impl Iterator<Item = &'a Vec<usize>>,
    old: usize,
    new: usize,
) -> Matrix {
    type Block = [f64; 36];
    let rows = |(cell, pieces): (usize, &Vec<usize>)| {
        let mut blocks = BTreeMap::<u32, Block>::new();
        for row in pieces.iter().flat_map(|piece| piece * old..(piece + 1) * old) {
            let own = std::iter::once((row, fine.diagonal[row]));
            for (column, value) in own.chain(fine.others(row)) {
                let Some((first, _)) = moves[column].first() else { continue };
                let block = blocks.entry(first / new as u32).or_insert([0.0; 36]);
                for (i, by) in &moves[row] {
                    for (j, there) in &moves[column] {
                        block[*i as usize % new * new + *j as usize % new] += by * value * there;
                    }
                }
            }
        }
        let row = |k: usize| {
            let (mut diagonal, mut others) = (0.0, Vec::new());
            for (other, block) in &blocks {
                for (j, value) in block[k * new..(k + 1) * new].iter().enumerate() {
                    let column = other * new as u32 + j as u32;
                    match column as usize == cell * new + k {
                        true => diagonal = *value,
                        false if *value != 0.0 => others.push((column, *value)),
                        false => {}
                    }
                }
            }
            // A cell with one piece cannot turn.
            if diagonal == 0.0 { (1.0, Vec::new()) } else { (diagonal, others) }
        };
        (0..new).map(row).collect::<Vec<_>>()
    };
    let members: Vec<&Vec<usize>> = members.collect();
    let rows: Vec<_> = members.into_par_iter().enumerate().map(rows).collect();
    Matrix::from_rows(rows.into_iter().flatten())
}

/// Unknowns of a piece at most: what moves and turns in space.
const MOST: usize = 6;

/// The inverse of what couples the unknowns of a piece; what is as good as not there stays zero.
type Inverse = [[f64; MOST]; MOST];

/// The inverses of what couples the unknowns of each piece, so many of them. Smoothed row by row instead, what is stiff along one slanted line only would grow.
fn inverses(matrix: &Matrix, unknowns: usize) -> Vec<Inverse> {
    let of = |piece: usize| {
        let mut block = [[0.0; MOST]; MOST];
        for (k, of_row) in block.iter_mut().enumerate().take(unknowns) {
            let row = piece * unknowns + k;
            of_row[k] = matrix.diagonal[row];
            for (column, value) in matrix.others(row).filter(|(column, _)| column / unknowns == piece) {
                of_row[column % unknowns] = value;
            }
        }
        inverse(block, unknowns)
    };
    (0..matrix.len() / unknowns).into_par_iter().with_min_len(256).map(of).collect()
}

/// By Gauss and Jordan along the diagonal, which is positive.
fn inverse(mut block: Inverse, unknowns: usize) -> Inverse {
    let scale: [f64; MOST] = std::array::from_fn(|k| block[k][k]);
    for k in 0..unknowns {
        let pivot = block[k][k];
        if pivot.abs() <= 1e-10 * scale[k].abs() {
            for j in 0..unknowns {
                block[k][j] = 0.0;
                block[j][k] = 0.0;
            }
            continue;
        }
        block[k][k] = 1.0;
        block[k].iter_mut().take(unknowns).for_each(|value| *value /= pivot);
        let row = block[k];
        for j in (0..unknowns).filter(|j| *j != k) {
            let by = std::mem::replace(&mut block[j][k], 0.0);
            for (value, of_row) in block[j].iter_mut().zip(row).take(unknowns) {
                *value -= by * of_row;
            }
        }
    }
    block
}

/// How a level is smoothed: piece by piece where inverses are given, row by row elsewhere.
#[derive(Clone, Copy)]
struct Sweeps<'a> {
    kinds: usize,
    inverses: &'a [Inverse],
}

impl Sweeps<'_> {
    /// What a residual tells a row to change by.
    fn change(self, matrix: &Matrix, residual: &[f64], row: usize) -> f64 {
        if self.inverses.is_empty() {
            return DAMPING * residual[row] / matrix.diagonal[row];
        }
        let (node, k) = (row / self.kinds, row % self.kinds);
        let of = &residual[node * self.kinds..(node + 1) * self.kinds];
        let inverse = &self.inverses[node];
        DAMPING * of.iter().zip(inverse[k]).map(|(r, by)| by * r).sum::<f64>()
    }

    fn sweep(self, matrix: &Matrix, b: &[f64], x: &mut [f64], residual: &mut [f64]) {
        matrix.residual(b, x, residual);
        rows(x, |row, x| *x += self.change(matrix, residual, row));
    }
}

fn descend(matrix: &Matrix, sweeps: Sweeps, below: &[Level], b: &[f64]) -> Vec<f64> {
    // The first sweep from zero.
    let mut x: Vec<f64> = (0..b.len()).map(|row| sweeps.change(matrix, b, row)).collect();
    let mut residual = vec![0.0; b.len()];
    let Some((next, rest)) = below.split_first() else {
        (1..LAST).for_each(|_| sweeps.sweep(matrix, b, &mut x, &mut residual));
        return x;
    };
    (1..SWEEPS).for_each(|_| sweeps.sweep(matrix, b, &mut x, &mut residual));
    matrix.residual(b, &x, &mut residual);
    let mut coarse = vec![0.0; next.moved.len()];
    rows(&mut coarse, |row, sum| {
        *sum = next.moved[row].iter().map(|(fine, by)| by * residual[*fine as usize]).sum();
    });
    let correction =
        descend(&next.matrix, Sweeps { kinds: next.unknowns, inverses: &next.inverses }, rest, &coarse);
    rows(&mut x, |row, x| {
        *x +=
            OVER * next.moves[row].iter().map(|(coarse, by)| by * correction[*coarse as usize]).sum::<f64>();
    });
    (0..SWEEPS).for_each(|_| sweeps.sweep(matrix, b, &mut x, &mut residual));
    x
}
