//! Dense symmetric matrices: Cholesky's factorisation of the first rows and columns, which leaves what those do to the rest.
//!
//! With A = [A11 A21'; A21 A22] and A11 = L11 L11', the rows below become L21 = A21 L11'^-1 and the rest the Schur complement
//! A22 - L21 L21'. Rows are stored one after the other; only the lower triangle counts.
//!
//! Every number is computed by itself in an order that does not depend on threads.

use rayon::prelude::*;

/// Columns that are eliminated together.
const PANEL: usize = 64;
/// Columns of a tile whose sums stay in registers.
const TILE: usize = 4;
/// Rows of such a tile.
const ROWS: usize = 4;
/// Rows that one thread takes at a time.
const SHARE: usize = 32;

/// Eliminates the first `pivots` of the `n` unknowns; what they do to the others is left in the lower right.
///
/// # Errors
/// The number of the pivot that is not positive.
pub(crate) fn eliminate(a: &mut [f64], n: usize, pivots: usize) -> Result<(), usize> {
    let mut first = 0;
    while first < pivots {
        let last = (first + PANEL).min(pivots);
        let width = last - first;
        // The panel's own triangle.
        for k in first..last {
            for j in first..k {
                let sum = dot(&a[k * n + first..][..j - first], &a[j * n + first..][..j - first]);
                a[k * n + j] = (a[k * n + j] - sum) / a[j * n + j];
            }
            let row = &a[k * n + first..][..k - first];
            let pivot = a[k * n + k] - dot(row, row);
            if pivot.is_nan() || pivot <= 0.0 {
                return Err(k);
            }
            a[k * n + k] = pivot.sqrt();
        }
        let (above, below) = a.split_at_mut(last * n);
        let triangle = &above[first * n..];
        // The rows below it.
        below.par_chunks_mut(SHARE * n).for_each(|rows| {
            for row in rows.chunks_mut(n) {
                let part = &mut row[first..last];
                for j in 0..width {
                    let along = &triangle[j * n + first..][..=j];
                    let sum = dot(&part[..j], &along[..j]);
                    part[j] = (part[j] - sum) / along[j];
                }
            }
        });
        // What is left: each row takes off its products with the rows up to itself. The panel is copied by tiles of columns.
        let rest = n - last;
        let tiles = rest.div_ceil(TILE);
        let mut packed = vec![0.0; tiles * TILE * width];
        packed.par_chunks_mut(TILE * width).enumerate().for_each(|(tile, to)| {
            for lane in 0..TILE.min(rest - tile * TILE) {
                let from = &below[(tile * TILE + lane) * n + first..][..width];
                for k in 0..width {
                    to[k * TILE + lane] = from[k];
                }
            }
        });
        below.par_chunks_mut(SHARE * n).enumerate().for_each(|(share, rows)| {
            for (group, rows) in rows.chunks_mut(ROWS * n).enumerate() {
                let row = share * SHARE + group * ROWS;
                let height = rows.len() / n;
                for tile in 0..(row + height).div_ceil(TILE).min(tiles) {
                    let panel = &packed[tile * TILE * width..][..TILE * width];
                    let sums = products(rows, n, first, width, height, panel);
                    for (r, sums) in sums.iter().enumerate().take(height) {
                        let column = tile * TILE;
                        let most = (row + r + 1).saturating_sub(column).min(TILE);
                        for (value, sum) in rows[r * n + last + column..].iter_mut().zip(&sums[..most]) {
                            *value -= sum;
                        }
                    }
                }
            }
        });
        first = last;
    }
    Ok(())
}

/// Products of up to [`ROWS`] rows with a tile of the panel.
#[inline(always)]
fn products(
    rows: &[f64],
    n: usize,
    first: usize,
    width: usize,
    height: usize,
    panel: &[f64],
) -> [[f64; TILE]; ROWS] {
    // Rows that are missing repeat the last; their sums are not used.
    let row = |r: usize| &rows[r.min(height - 1) * n + first..][..width];
    let [a, b, c, d] = [row(0), row(1), row(2), row(3)];
    let mut sums = [[0.0; TILE]; ROWS];
    for (k, column) in panel.chunks_exact(TILE).enumerate() {
        for lane in 0..TILE {
            sums[0][lane] += a[k] * column[lane];
            sums[1][lane] += b[k] * column[lane];
            sums[2][lane] += c[k] * column[lane];
            sums[3][lane] += d[k] * column[lane];
        }
    }
    sums
}

pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    // Four sums that do not wait for each other.
    let mut sums = [0.0; 4];
    let (heads, tails) = (a.chunks_exact(4), b.chunks_exact(4));
    let rest: f64 = heads.remainder().iter().zip(tails.remainder()).map(|(a, b)| a * b).sum();
    for (a, b) in heads.zip(tails) {
        for lane in 0..4 {
            sums[lane] += a[lane] * b[lane];
        }
    }
    (sums[0] + sums[1]) + (sums[2] + sums[3]) + rest
}

/// Solves L y = b in place; rows of L are `stride` apart.
pub(crate) fn forward(l: &[f64], stride: usize, b: &mut [f64]) {
    for k in 0..b.len() {
        let row = &l[k * stride..][..=k];
        b[k] = (b[k] - dot(&b[..k], &row[..k])) / row[k];
    }
}

/// Solves L' x = b in place.
pub(crate) fn backward(l: &[f64], stride: usize, b: &mut [f64]) {
    for k in (0..b.len()).rev() {
        let row = &l[k * stride..][..=k];
        b[k] /= row[k];
        let (before, here) = b.split_at_mut(k);
        for (value, factor) in before.iter_mut().zip(row) {
            *value -= factor * here[0];
        }
    }
}

/// The inverse of a symmetric positive matrix, by the complement of [A 1; 1 0].
///
/// # Errors
/// The number of the pivot that is not positive.
pub(crate) fn inverse(a: &[f64], n: usize) -> Result<Vec<f64>, usize> {
    let wide = 2 * n;
    let mut all = vec![0.0; wide * wide];
    for row in 0..n {
        all[row * wide..][..n].copy_from_slice(&a[row * n..][..n]);
        all[(n + row) * wide + row] = 1.0;
    }
    eliminate(&mut all, wide, n)?;
    let mut inverse = vec![0.0; n * n];
    for row in 0..n {
        for column in 0..=row {
            let value = -all[(n + row) * wide + n + column];
            inverse[row * n + column] = value;
            inverse[column * n + row] = value;
        }
    }
    Ok(inverse)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A symmetric positive matrix that is full.
    fn matrix(n: usize) -> Vec<f64> {
        let entry = |i: usize, j: usize| {
            let far = i.abs_diff(j) as f64;
            (-0.1 * far).exp() + if i == j { 1.0 + 0.01 * i as f64 } else { 0.0 }
        };
        (0..n * n).map(|k| entry(k / n, k % n)).collect()
    }

    #[test]
    fn systems_are_solved() {
        for n in [1, 5, 64, 67, 150] {
            let a = matrix(n);
            let mut l = a.clone();
            eliminate(&mut l, n, n).unwrap();
            let x: Vec<f64> = (0..n).map(|k| (k as f64 * 0.37).sin()).collect();
            let mut b: Vec<f64> = a.chunks(n).map(|row| dot(row, &x)).collect();
            forward(&l, n, &mut b);
            backward(&l, n, &mut b);
            let error = b.iter().zip(&x).map(|(b, x)| (b - x).abs()).fold(0.0, f64::max);
            assert!(error < 1e-12, "{n}: {error:e}");
        }
    }

    #[test]
    fn what_is_left_is_the_schur_complement() {
        let (n, pivots) = (131, 70);
        let mut a = matrix(n);
        let first: Vec<f64> = (0..pivots * pivots).map(|k| a[k / pivots * n + k % pivots]).collect();
        let inverse = inverse(&first, pivots).unwrap();
        let full = a.clone();
        eliminate(&mut a, n, pivots).unwrap();
        for (i, j) in [(70, 70), (100, 80), (130, 130), (130, 71)] {
            let through: f64 = (0..pivots)
                .map(|k| full[i * n + k] * dot(&inverse[k * pivots..][..pivots], &full[j * n..][..pivots]))
                .sum();
            let exact = full[i * n + j] - through;
            assert!((a[i * n + j] - exact).abs() < 1e-12, "{i} {j}");
        }
    }

    #[test]
    fn same_bits_on_any_number_of_threads() {
        let with = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            let mut a = matrix(150);
            pool.install(|| eliminate(&mut a, 150, 100)).unwrap();
            a.iter().map(|x| x.to_bits()).collect::<Vec<_>>()
        };
        assert_eq!(with(1), with(3));
    }

    #[test]
    fn a_matrix_that_is_not_positive_is_refused() {
        assert_eq!(eliminate(&mut [1.0, 0.0, 2.0, 1.0], 2, 2), Err(1));
    }
}
