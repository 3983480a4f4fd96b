//! Cell values on a plane grid, and the smooth surface that is shown of them.

use crate::Error;

/// Cells of equal size in a plane; values over them have the first axis running fastest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Grid {
    /// Lower corner of the first cell in metres.
    pub origin: [f64; 2],
    /// Edges of a cell in metres.
    pub spacing: [f64; 2],
    /// Number of cells along each axis.
    pub cells: [usize; 2],
    /// Whether the lower face along each axis is a plane of symmetry, beyond which the mirror image is shown.
    pub mirror: [bool; 2],
}

/// What is seen of the cells of a grid from a coordinate along one axis.
#[derive(Debug, Clone, Copy)]
pub(super) struct Along {
    /// Number along the axis of the cell that holds it.
    nearest: usize,
    /// Numbers of those that weigh in there.
    cells: [usize; 4],
    weights: [f64; 4],
    /// Slopes of the weights per metre.
    slopes: [f64; 4],
}

/// A point by what is seen along both axes: pixels in a row share the one, those in a column the other.
pub(super) type Place<'a> = [&'a Along; 2];

impl Grid {
    pub(super) fn check(&self, what: &str, values: &[f32]) -> Result<(), Error> {
        let positive = (0..2).all(|d| {
            let [low, high] = self.extent(d);
            self.spacing[d] > 0.0 && low.is_finite() && high.is_finite() && high > low
        });
        if !positive {
            return Err(Error::EmptyGrid);
        }
        // The product cannot overflow where it equals the length of a slice.
        let expected = self.cells[0].saturating_mul(self.cells[1]);
        if values.len() != expected {
            return Err(Error::Length { what: what.to_owned(), expected, found: values.len() });
        }
        Ok(())
    }

    /// From where to where the picture reaches along an axis, in metres.
    pub(super) fn extent(&self, axis: usize) -> [f64; 2] {
        let length = self.spacing[axis] * self.cells[axis] as f64;
        let low = self.origin[axis];
        [if self.mirror[axis] { low - length } else { low }, low + length]
    }

    /// The cell at a distance `offset`, in cells, from the lower face; cells beyond the border repeat or mirror it.
    fn cell(&self, axis: usize, offset: i64) -> usize {
        let inside = if self.mirror[axis] && offset < 0 { -1 - offset } else { offset };
        inside.clamp(0, self.cells[axis] as i64 - 1) as usize
    }

    /// What is seen of the cells from a coordinate in metres along an axis.
    pub(super) fn along(&self, axis: usize, coordinate: f64) -> Along {
        let offset = (coordinate - self.origin[axis]) / self.spacing[axis];
        let base = (offset - 0.5).floor();
        let (weights, slopes) = spline(offset - 0.5 - base);
        Along {
            nearest: self.cell(axis, offset.floor() as i64),
            cells: std::array::from_fn(|n| self.cell(axis, base as i64 + n as i64 - 1)),
            weights,
            slopes: slopes.map(|slope| slope / self.spacing[axis]),
        }
    }

    /// The cell whose area holds a point.
    pub(super) fn nearest(&self, [x, y]: Place) -> usize {
        x.nearest + self.cells[0] * y.nearest
    }

    /// The nine cells around and including cell `n`, repeated or mirrored at the border, with binomial weights.
    pub(super) fn around(&self, n: usize) -> impl Iterator<Item = (usize, f32)> {
        let [i, j] = [n % self.cells[0], n / self.cells[0]];
        (0..9).map(move |m| {
            let (a, b) = (m % 3, m / 3);
            let cell = self.cell(0, (i + a) as i64 - 1) + self.cells[0] * self.cell(1, (j + b) as i64 - 1);
            (cell, [0.25, 0.5, 0.25][a] * [0.25, 0.5, 0.25][b])
        })
    }

    /// Value and gradient (per metre) of the cubic B-spline through the cell values at a point.
    pub(super) fn sample(&self, values: &[f32], [x, y]: Place) -> (f64, [f64; 2]) {
        let (mut value, mut gradient) = (0.0, [0.0; 2]);
        for n in 0..4 {
            let row = self.cells[0] * y.cells[n];
            let (mut along, mut slope) = (0.0, 0.0);
            for m in 0..4 {
                let v = f64::from(values[row + x.cells[m]]);
                along += x.weights[m] * v;
                slope += x.slopes[m] * v;
            }
            value += y.weights[n] * along;
            gradient[0] += y.weights[n] * slope;
            gradient[1] += y.slopes[n] * along;
        }
        (value, gradient)
    }

    /// Which cells have the same value as all that [`Grid::sample`] looks at from anywhere in them.
    pub(super) fn even(&self, values: &[f32]) -> Vec<bool> {
        // Two cells to each side.
        let same = |n: usize| {
            let [i, j] = [n % self.cells[0], n / self.cells[0]].map(|at| at as i64);
            (-2..=2).all(|b| {
                let row = self.cells[0] * self.cell(1, j + b);
                (-2..=2).all(|a| values[row + self.cell(0, i + a)] == values[n])
            })
        };
        (0..values.len()).map(same).collect()
    }

    /// Values with the gaps filled from their surroundings, so that a smooth surface can be shown up to the edge of
    /// what is given. Where nothing is near, zero.
    pub(super) fn fill_gaps(&self, values: &[f32], given: impl Fn(usize) -> bool) -> Vec<f32> {
        // A spline reaches two cells beyond a point, and the edge may lie one cell outside what is given.
        const REACH: usize = 3;
        let mut known: Vec<bool> = (0..values.len()).map(|n| given(n) && values[n].is_finite()).collect();
        let mut filled: Vec<f32> =
            values.iter().zip(&known).map(|(&v, &k)| if k { v } else { 0.0 }).collect();
        for _ in 0..REACH {
            let mut found = Vec::new();
            for n in (0..values.len()).filter(|&n| !known[n]) {
                let near = || self.around(n).filter(|&(m, _)| known[m]);
                let total: f32 = near().map(|(_, weight)| weight).sum();
                if total > 0.0 {
                    let sum: f32 = near().map(|(m, weight)| weight * filled[m]).sum();
                    found.push((n, sum / total));
                }
            }
            for (n, value) in found {
                (filled[n], known[n]) = (value, true);
            }
        }
        filled
    }
}

/// Weights and their slopes of the four cells around a point that lies a share `t` past the second of them.
fn spline(t: f64) -> ([f64; 4], [f64; 4]) {
    let u = 1.0 - t;
    let weights =
        [u * u * u, 4.0 - 6.0 * t * t + 3.0 * t * t * t, 4.0 - 6.0 * u * u + 3.0 * u * u * u, t * t * t];
    let slopes = [-u * u, 3.0 * t * t - 4.0 * t, 4.0 * u - 3.0 * u * u, t * t];
    (weights.map(|w| w / 6.0), slopes.map(|s| s / 2.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample(grid: &Grid, values: &[f32], point: [f64; 2]) -> (f64, [f64; 2]) {
        let [x, y] = [0, 1].map(|d| grid.along(d, point[d]));
        grid.sample(values, [&x, &y])
    }

    #[test]
    fn linear_values_are_shown_as_they_are() {
        let grid = Grid { origin: [-1.0, 2.0], spacing: [0.5, 0.25], cells: [8, 9], mirror: [false; 2] };
        let values: Vec<f32> = (0..72).map(|n| 3.0 * (n % 8) as f32 - 2.0 * (n / 8) as f32).collect();
        for point in [[0.3, 3.1], [1.0, 3.3], [0.75, 3.0]] {
            let (value, gradient) = sample(&grid, &values, point);
            let exact = 3.0 * ((point[0] + 1.0) / 0.5 - 0.5) - 2.0 * ((point[1] - 2.0) / 0.25 - 0.5);
            assert!((value - exact).abs() < 1e-12, "{value} against {exact}");
            assert!((gradient[0] - 6.0).abs() < 1e-12 && (gradient[1] + 8.0).abs() < 1e-12, "{gradient:?}");
        }
    }

    #[test]
    fn mirrored_values_are_even() {
        let grid = Grid { origin: [0.0; 2], spacing: [1.0; 2], cells: [6, 1], mirror: [true, false] };
        let values = [5.0, 3.0, 4.0, 1.0, 0.0, 2.0];
        assert_eq!(grid.extent(0), [-6.0, 6.0]);
        for x in [0.0, 0.2, 0.7, 1.9, 3.3] {
            let ((right, [a, _]), (left, [b, _])) =
                (sample(&grid, &values, [x, 0.5]), sample(&grid, &values, [-x, 0.5]));
            assert!((right - left).abs() < 1e-12 && (a + b).abs() < 1e-12, "at {x}");
        }
        assert_eq!(grid.nearest([&grid.along(0, -2.5), &grid.along(1, 0.5)]), 2);
    }

    #[test]
    fn what_is_even_is_sampled_as_it_is() {
        let grid = Grid { origin: [0.0; 2], spacing: [1.0; 2], cells: [12, 9], mirror: [true, false] };
        let values: Vec<f32> = (0..108).map(|n| if n % 12 > 7 && n / 12 > 5 { 1.0 } else { 0.25 }).collect();
        let even = grid.even(&values);
        assert!(even[0] && even[5 + 12 * 8] && even[11 + 12 * 3] && !even[6 + 12 * 8] && !even[11 + 12 * 4]);
        for n in (0..108).filter(|n| even[*n]) {
            for [a, b] in [[0.01, 0.01], [0.01, 0.99], [0.5, 0.5], [0.99, 0.01], [0.99, 0.99]] {
                let point = [(n % 12) as f64 + a, (n / 12) as f64 + b];
                let (value, [x, y]) = sample(&grid, &values, point);
                assert!((value - f64::from(values[n])).abs() < 1e-12 && x.abs() < 1e-12 && y.abs() < 1e-12);
            }
        }
    }

    #[test]
    fn gaps_take_the_values_around_them() {
        let grid = Grid { origin: [0.0; 2], spacing: [1.0; 2], cells: [7, 1], mirror: [false; 2] };
        let values = [2.0, 4.0, 9.0, f32::NAN, 0.0, 0.0, 0.0];
        assert_eq!(grid.fill_gaps(&values, |n| n < 2), [2.0, 4.0, 4.0, 4.0, 4.0, 0.0, 0.0]);
        assert_eq!(grid.fill_gaps(&values, |n| n != 2), [2.0, 4.0, 4.0, 0.0, 0.0, 0.0, 0.0]);
    }
}
