//! Matrices with few entries in a row: one for the node itself, and others for its neighbours. A node has N unknowns, such as the components of a velocity, and an entry is a block that
//! couples those of two nodes. Vectors hold the unknowns of the nodes one after the other.

use std::ops::{AddAssign, Mul, Sub};

use rayon::prelude::*;

/// Nodes that one thread takes at a time; with fewer there is nothing to share.
const CHUNK: usize = 1024;

/// Numbers that matrices are made of.
pub trait Number: Copy + Default + Send + Sync + Sub<Output = Self> + Mul<Output = Self> + AddAssign {}

impl Number for f64 {}
impl Number for f32 {}

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
        let mut new = Self { diagonal: Vec::new(), firsts: vec![0], columns: Vec::new(), values: Vec::new() };
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

    /// Adds a number to all that is on the diagonal.
    pub fn shift(&mut self, by: f64) {
        self.diagonal.iter_mut().for_each(|block| (0..N).for_each(|k| block[k][k] += by));
    }

    /// Without the blocks that are smaller than a share of the largest beside the diagonal of their row, by their largest numbers; what they hold is added to the diagonal, so that what is even stays so.
    pub(crate) fn strong(&self, share: f64) -> Self {
        let size =
            |block: &Block<N>| block.iter().flatten().fold(0.0, |size: f64, value| size.max(value.abs()));
        let row = |row: usize| {
            let largest = self.others(row).map(|(_, block)| size(block)).fold(0.0, f64::max);
            let (mut own, least) = (self.diagonal[row], share * largest);
            let mut kept = Vec::with_capacity(32);
            for (column, block) in self.others(row) {
                if size(block) < least {
                    own.iter_mut()
                        .flatten()
                        .zip(block.iter().flatten())
                        .for_each(|(own, value)| *own += value);
                } else {
                    kept.push((column as u32, *block));
                }
            }
            (own, kept)
        };
        Self::from_blocks((0..self.len()).into_par_iter().with_min_len(CHUNK).map(row).collect::<Vec<_>>())
    }

    /// The same in fewer digits, which takes half of the memory.
    pub(crate) fn rounded(&self) -> Matrix<N, f32> {
        let round = |block: &Block<N>| block.map(|row| row.map(|value| value as f32));
        let all = |blocks: &[Block<N>]| blocks.par_iter().with_min_len(CHUNK).map(round).collect();
        Matrix {
            diagonal: all(&self.diagonal),
            firsts: self.firsts.clone(),
            columns: self.columns.clone(),
            values: all(&self.values),
        }
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

    /// A row times a vector.
    #[inline]
    fn row(&self, row: usize, x: &[[T; N]]) -> [T; N] {
        let mut sum = [T::default(); N];
        add_product(&mut sum, &self.diagonal[row], &x[row]);
        for (column, block) in self.others(row) {
            add_product(&mut sum, block, &x[column]);
        }
        sum
    }

    /// `to` = A x.
    pub fn times(&self, x: &[T], to: &mut [T]) {
        let x = nodes(x);
        rows(nodes_mut(to), |row, to| *to = self.row(row, x));
    }

    /// `to` = b - A x.
    pub(crate) fn residual(&self, b: &[T], x: &[T], to: &mut [T]) {
        let (b, x) = (nodes::<N, T>(b), nodes(x));
        rows(nodes_mut::<N, T>(to), |row, to| {
            let product = self.row(row, x);
            *to = std::array::from_fn(|k| b[row][k] - product[k]);
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_left_out_goes_to_the_diagonal() {
        let rows = [(5.0, vec![(1, -4.0), (2, -0.5)]), (5.0, vec![(0, -4.0)]), (1e9, vec![(0, -0.5)])];
        let strong = Matrix::from_rows(rows).strong(0.2);
        let left =
            |row: usize| strong.others(row).map(|(column, block)| (column, block[0][0])).collect::<Vec<_>>();
        assert_eq!([left(0), left(1), left(2)], [vec![(1, -4.0)], vec![(0, -4.0)], vec![(0, -0.5)]]);
        assert_eq!(strong.diagonal, [[[4.5]], [[5.0]], [[1e9]]]);
    }
}
