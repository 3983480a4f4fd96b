//! Matrices with few entries in a row: one for the node itself, and others for its neighbours.

use rayon::prelude::*;

/// Rows that one thread takes at a time; with fewer there is nothing to share.
const CHUNK: usize = 1024;

/// A square matrix by rows.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Matrix {
    pub(crate) diagonal: Vec<f64>,
    /// Where the entries of each row begin beside the diagonal, and the end of all.
    pub(crate) firsts: Vec<usize>,
    pub(crate) columns: Vec<u32>,
    pub(crate) values: Vec<f64>,
}

/// Does something for each row; a few rows are not worth the waking of threads.
pub(crate) fn rows<T: Send>(of: &mut [T], make: impl Fn(usize, &mut T) + Sync + Send) {
    if of.len() < 2 * CHUNK {
        of.iter_mut().enumerate().for_each(|(row, of)| make(row, of));
    } else {
        of.par_iter_mut().with_min_len(CHUNK).enumerate().for_each(|(row, of)| make(row, of));
    }
}

impl Matrix {
    /// By its rows: the entry on the diagonal, and columns and values of the others.
    pub fn from_rows<R: IntoIterator<Item = (u32, f64)>>(rows: impl IntoIterator<Item = (f64, R)>) -> Self {
        let mut new = Self { firsts: vec![0], ..Self::default() };
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

    /// Number of rows.
    pub fn len(&self) -> usize {
        self.diagonal.len()
    }

    /// Whether it has no rows.
    pub fn is_empty(&self) -> bool {
        self.diagonal.is_empty()
    }

    /// Number of entries.
    pub fn entries(&self) -> usize {
        self.diagonal.len() + self.values.len()
    }

    /// Columns and values of a row beside the diagonal.
    pub(crate) fn others(&self, row: usize) -> impl Iterator<Item = (usize, f64)> {
        let range = self.firsts[row]..self.firsts[row + 1];
        let columns = self.columns[range.clone()].iter().map(|column| *column as usize);
        columns.zip(self.values[range].iter().copied())
    }

    /// A row times a vector.
    #[inline]
    fn row(&self, row: usize, x: &[f64]) -> f64 {
        let others = self.others(row).map(|(column, value)| value * x[column]).sum::<f64>();
        self.diagonal[row] * x[row] + others
    }

    /// `to` = A x.
    pub fn times(&self, x: &[f64], to: &mut [f64]) {
        rows(to, |row, to| *to = self.row(row, x));
    }

    /// `to` = b - A x.
    pub(crate) fn residual(&self, b: &[f64], x: &[f64], to: &mut [f64]) {
        rows(to, |row, to| *to = b[row] - self.row(row, x));
    }
}
