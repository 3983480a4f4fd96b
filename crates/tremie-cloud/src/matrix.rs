//! Matrices with few entries in a row: one for the node itself, and others for its neighbours. A node has N unknowns, such as the components of a velocity, and an entry is a block that
//! couples those of two nodes. Vectors hold the unknowns of the nodes one after the other.

use std::ops::{Add, AddAssign, Div, Mul, Sub};

use rayon::prelude::*;

use crate::Operator;

/// Nodes that one thread takes at a time; with fewer there is nothing to share.
const CHUNK: usize = 1024;

/// Numbers that matrices are made of.
pub trait Number:
    Copy
    + Default
    + Send
    + Sync
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + AddAssign
{
    /// As many digits of a number as it has.
    fn told(number: f64) -> Self;
    /// It in 64 bits.
    fn in_full(self) -> f64;
}

impl Number for f64 {
    #[inline(always)]
    fn told(number: f64) -> Self {
        number
    }

    #[inline(always)]
    fn in_full(self) -> f64 {
        self
    }
}

impl Number for f32 {
    #[inline(always)]
    fn told(number: f64) -> Self {
        number as f32
    }

    #[inline(always)]
    fn in_full(self) -> f64 {
        f64::from(self)
    }
}

/// What couples the unknowns of two nodes, by rows.
pub type Block<const N: usize, T = f64> = [[T; N]; N];

/// A square matrix by rows of blocks.
#[derive(Debug, Clone, PartialEq)]
pub struct Matrix<const N: usize = 1, T = f64> {
    pub(crate) diagonal: Vec<Block<N, T>>,
    /// Where the entries of each row begin beside the diagonal, and the end of all.
    firsts: Vec<usize>,
    columns: Vec<u32>,
    values: Vec<Block<N, T>>,
}

/// Does something for each of many; a few are not worth the waking of threads.
pub(crate) fn rows<T: Send>(of: &mut [T], make: impl Fn(usize, &mut T) + Sync + Send) {
    if of.len() < 2 * CHUNK {
        of.iter_mut().enumerate().for_each(|(row, of)| make(row, of));
    } else {
        of.par_iter_mut().with_min_len(CHUNK).enumerate().for_each(|(row, of)| make(row, of));
    }
}

/// The unknowns of nodes.
pub(crate) fn nodes<const N: usize, T>(x: &[T]) -> &[[T; N]] {
    x.as_chunks().0
}

/// The same to be changed.
pub(crate) fn nodes_mut<const N: usize, T>(x: &mut [T]) -> &mut [[T; N]] {
    x.as_chunks_mut().0
}

/// `sum` += A x for a block.
#[inline(always)]
pub(crate) fn add_product<const N: usize, T: Number>(sum: &mut [T; N], block: &Block<N, T>, x: &[T; N]) {
    for (sum, row) in sum.iter_mut().zip(block) {
        for (value, x) in row.iter().zip(x) {
            *sum += *value * *x;
        }
    }
}

/// Brings entries into the order of their columns, and adds those of the same, in the order in which they are listed.
fn merge<const N: usize>(entries: &mut Vec<(u32, Block<N>)>) {
    if entries.is_sorted_by(|a, b| a.0 < b.0) {
        return;
    }
    entries.sort_by_key(|(column, _)| *column);
    entries.dedup_by(|next, kept| {
        let same = next.0 == kept.0;
        if same {
            kept.1.iter_mut().flatten().zip(next.1.iter().flatten()).for_each(|(sum, value)| *sum += value);
        }
        same
    });
}

impl Matrix {
    /// By its rows: the entry on the diagonal, and columns and values of the others.
    pub fn from_rows<R: IntoIterator<Item = (u32, f64)>>(rows: impl IntoIterator<Item = (f64, R)>) -> Self {
        let block = |(column, value)| (column, [[value]]);
        Self::from_blocks(rows.into_iter().map(|(own, others)| ([[own]], others.into_iter().map(block))))
    }
}

impl<const N: usize> Matrix<N> {
    /// By the rows of nodes: the block on the diagonal, and columns and blocks of the others.
    pub fn from_blocks<R: IntoIterator<Item = (u32, Block<N>)>>(
        rows: impl IntoIterator<Item = (Block<N>, R)>,
    ) -> Self {
        let mut new = Self::empty();
        for (diagonal, others) in rows {
            new.diagonal.push(diagonal);
            for (column, value) in others {
                new.columns.push(column);
                new.values.push(value);
            }
            new.firsts.push(new.columns.len());
        }
        new
    }

    /// So many rows at once: each tells the block on the diagonal and lists columns and blocks of the others, in any order; those of the same column are added.
    pub fn build(rows: usize, row: impl Fn(usize, &mut Vec<(u32, Block<N>)>) -> Block<N> + Sync) -> Self {
        /// Rows in one piece.
        const PIECE: usize = 256;
        let piece = |piece: usize| {
            let mut part = Self::empty();
            let mut others = Vec::new();
            for number in piece * PIECE..((piece + 1) * PIECE).min(rows) {
                others.clear();
                part.diagonal.push(row(number, &mut others));
                merge(&mut others);
                part.columns.extend(others.iter().map(|(column, _)| *column));
                part.values.extend(others.iter().map(|(_, value)| *value));
                part.firsts.push(part.columns.len());
            }
            part
        };
        let parts: Vec<Self> = (0..rows.div_ceil(PIECE)).into_par_iter().map(piece).collect();
        let mut new = Self::empty();
        let entries = parts.iter().map(|part| part.columns.len()).sum();
        new.diagonal.reserve_exact(rows);
        new.columns.reserve_exact(entries);
        new.values.reserve_exact(entries);
        for part in parts {
            let before = new.columns.len();
            new.diagonal.extend(part.diagonal);
            new.columns.extend(part.columns);
            new.values.extend(part.values);
            new.firsts.extend(part.firsts[1..].iter().map(|end| before + end));
        }
        new
    }

    fn empty() -> Self {
        Self { diagonal: Vec::new(), firsts: vec![0], columns: Vec::new(), values: Vec::new() }
    }

    /// The same with blocks as `of` tells them.
    pub(crate) fn as_told<T: Send>(&self, of: impl Fn(&Block<N>) -> Block<N, T> + Sync) -> Matrix<N, T> {
        let all = |blocks: &[Block<N>]| blocks.par_iter().with_min_len(CHUNK).map(&of).collect();
        Matrix {
            diagonal: all(&self.diagonal),
            firsts: self.firsts.clone(),
            columns: self.columns.clone(),
            values: all(&self.values),
        }
    }

    /// Adds a number to all that is on the diagonal.
    pub fn shift(&mut self, by: f64) {
        self.diagonal.iter_mut().for_each(|block| (0..N).for_each(|k| block[k][k] += by));
    }
}

impl<const N: usize, T: Number> Matrix<N, T> {
    /// Number of nodes.
    pub fn len(&self) -> usize {
        self.diagonal.len()
    }

    /// Whether it has no nodes.
    pub fn is_empty(&self) -> bool {
        self.diagonal.is_empty()
    }

    /// Number of entries.
    pub fn entries(&self) -> usize {
        (self.diagonal.len() + self.values.len()) * N * N
    }

    /// Columns and blocks of a row beside the diagonal.
    #[inline]
    pub(crate) fn others(&self, row: usize) -> impl Iterator<Item = (usize, &Block<N, T>)> {
        let range = self.firsts[row]..self.firsts[row + 1];
        let columns = self.columns[range.clone()].iter().map(|column| *column as usize);
        columns.zip(&self.values[range])
    }

    /// Columns and blocks of a row beside the diagonal, up to so many and the rest.
    #[inline]
    pub(crate) fn split(&self, row: usize, at: u32) -> [(&[u32], &[Block<N, T>]); 2] {
        let range = self.firsts[row]..self.firsts[row + 1];
        let (columns, values) = (&self.columns[range.clone()], &self.values[range]);
        let ((low, high), (lower, upper)) = (columns.split_at(at as usize), values.split_at(at as usize));
        [(low, lower), (high, upper)]
    }
}

impl<const N: usize> Matrix<N> {
    /// A row times a vector.
    #[inline]
    fn row<T: Number>(&self, row: usize, x: &[[T; N]]) -> [T; N] {
        let mut sum = [T::default(); N];
        let mut add = |block: &Block<N>, x: &[T; N]| {
            for (sum, row) in sum.iter_mut().zip(block) {
                row.iter().zip(x).for_each(|(value, x)| *sum += T::told(*value) * *x);
            }
        };
        add(&self.diagonal[row], &x[row]);
        self.others(row).for_each(|(column, block)| add(block, &x[column]));
        sum
    }
}

impl<const N: usize> Operator for Matrix<N> {
    fn times(&self, x: &[f64], to: &mut [f64]) {
        let x = nodes(x);
        rows(nodes_mut(to), |row, to| *to = self.row(row, x));
    }

    fn times_roughly(&self, x: &[f32], to: &mut [f32]) {
        let x = nodes(x);
        rows(nodes_mut(to), |row, to| *to = self.row(row, x));
    }

    fn over_diagonal<T: Number>(&self, of: &[T], to: &mut [T]) {
        rows(to, |n, to| *to = of[n] / T::told(self.diagonal[n / N][n % N][n % N]));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn entries_of_the_same_column_are_added() {
        let row = |row: usize, others: &mut Vec<(u32, Block<1>)>| {
            others.extend([(2, [[1.0]]), (7, [[row as f64]]), (2, [[0.5]])]);
            [[4.0]]
        };
        let built = Matrix::build(600, row);
        let rows = (0..600).map(|row| (4.0, [(2, 1.5), (7, f64::from(row))]));
        assert_eq!(built, Matrix::from_rows(rows));
    }
}
