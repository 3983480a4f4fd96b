//! A preconditioner whose cost is linear: corrections on ever larger cells.
//!
//! The nodes of a cell of space make one unknown of the next level, which has the sum of their rows and columns (piecewise constant aggregation with Galerkin's coarse
//! matrix), and so on with cells twice as large each time. A cycle smooths by damped Jacobi sweeps, corrects by the next level and smooths again. Constant pieces are stiffer than
//! what they stand for: the correction is taken [`OVER`] times (Braess 1995).
//!
//! A row without entries beside its diagonal, such as a given pressure, is solved by the sweeps and belongs to no cell.

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
/// No cell.
const NONE: u32 = u32::MAX;

/// A level below the first.
#[derive(Debug, Clone)]
struct Level {
    /// For each row of the level above, that of its cell.
    cells: Vec<u32>,
    /// For each row, those of the level above, by their numbers.
    members: Vec<Vec<u32>>,
    matrix: Matrix,
}

/// The levels below a matrix.
#[derive(Debug, Clone)]
pub struct Multigrid {
    levels: Vec<Level>,
}

impl Multigrid {
    /// For a matrix over nodes at `positions`, `spacing` apart; both in m. A node may have several unknowns, such as the components of a vector, whose rows follow each other; those of a kind go
    /// together.
    pub fn new(matrix: &Matrix, positions: &[DVec3], spacing: f64) -> Self {
        let kinds = (matrix.len() / positions.len().max(1)).max(1);
        let place = |row: usize| {
            let at = (positions[row / kinds] / spacing).floor().to_array().map(|x| x as i64);
            (row % kinds, at)
        };
        let mut places: Vec<(usize, [i64; 3])> = (0..matrix.len()).map(place).collect();
        let mut levels: Vec<Level> = Vec::new();
        loop {
            let fine = levels.last().map_or(matrix, |level| &level.matrix);
            if fine.len() <= FEW {
                break;
            }
            let mut numbers = BTreeMap::new();
            for (place, row) in places.iter_mut().zip(0..) {
                place.1 = place.1.map(|x| x.div_euclid(2));
                if fine.others(row).next().is_some() {
                    numbers.entry(*place).or_insert(0);
                }
            }
            for (number, cell) in (0..).zip(numbers.values_mut()) {
                *cell = number;
            }
            let cell = |row: usize| match fine.others(row).next() {
                Some(_) => numbers.get(&places[row]).copied().unwrap_or(NONE),
                None => NONE,
            };
            let cells: Vec<u32> = (0..fine.len()).map(cell).collect();
            let mut members = vec![Vec::new(); numbers.len()];
            for (row, cell) in (0..).zip(&cells).filter(|(_, cell)| **cell != NONE) {
                members[*cell as usize].push(row);
            }
            // Cells that hold one row each would go on for ever.
            if members.is_empty() || members.len() == fine.len() {
                break;
            }
            let coarse = coarser(fine, &cells, &members);
            places = numbers.into_keys().collect();
            levels.push(Level { cells, members, matrix: coarse });
        }
        Self { levels }
    }

    /// Entries of all levels over those of the first.
    pub fn complexity(&self, matrix: &Matrix) -> f64 {
        let entries: usize = self.levels.iter().map(|level| level.matrix.entries()).sum();
        1.0 + entries as f64 / matrix.entries() as f64
    }

    /// About the solution of `A x = b`, by one cycle from zero on; symmetric if A is.
    pub(crate) fn cycle(&self, matrix: &Matrix, b: &[f64]) -> Vec<f64> {
        descend(matrix, &self.levels, b)
    }
}

/// The sums of rows and columns over cells.
fn coarser(fine: &Matrix, cells: &[u32], members: &[Vec<u32>]) -> Matrix {
    let row = |(cell, rows): (usize, &Vec<u32>)| {
        let (mut diagonal, mut others) = (0.0, BTreeMap::<u32, f64>::new());
        for row in rows.iter().map(|row| *row as usize) {
            diagonal += fine.diagonal[row];
            for (column, value) in fine.others(row) {
                match cells[column] {
                    NONE => {}
                    other if other as usize == cell => diagonal += value,
                    other => *others.entry(other).or_default() += value,
                }
            }
        }
        (diagonal, others)
    };
    let rows: Vec<_> = members.par_iter().enumerate().map(row).collect();
    Matrix::from_rows(rows)
}

fn sweep(matrix: &Matrix, b: &[f64], x: &mut [f64], residual: &mut [f64]) {
    matrix.residual(b, x, residual);
    rows(x, |row, x| *x += DAMPING * residual[row] / matrix.diagonal[row]);
}

fn descend(matrix: &Matrix, below: &[Level], b: &[f64]) -> Vec<f64> {
    // The first sweep from zero.
    let mut x: Vec<f64> =
        b.iter().zip(&matrix.diagonal).map(|(b, diagonal)| DAMPING * b / diagonal).collect();
    let mut residual = vec![0.0; b.len()];
    let Some((next, rest)) = below.split_first() else {
        (1..LAST).for_each(|_| sweep(matrix, b, &mut x, &mut residual));
        return x;
    };
    (1..SWEEPS).for_each(|_| sweep(matrix, b, &mut x, &mut residual));
    matrix.residual(b, &x, &mut residual);
    let mut coarse = vec![0.0; next.members.len()];
    rows(&mut coarse, |cell, sum| {
        *sum = next.members[cell].iter().map(|row| residual[*row as usize]).sum();
    });
    let correction = descend(&next.matrix, rest, &coarse);
    for (x, cell) in x.iter_mut().zip(&next.cells).filter(|(_, cell)| **cell != NONE) {
        *x += OVER * correction[*cell as usize];
    }
    (0..SWEEPS).for_each(|_| sweep(matrix, b, &mut x, &mut residual));
    x
}
