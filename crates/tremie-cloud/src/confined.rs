//! Problems of Poisson whose values are known but for a constant: those of fluid that fills all there is.
//!
//! Their rows add up to nothing each, and something of the right-hand side cannot be met; the weights of disordered neighbours are not symmetric, so that nobody knows how much. A value that is given instead
//! of one row leaves all of it to this place, where fluid then comes or goes. Here all rows bear the same:
//!
//! ```text
//!     A x + c = b,    sum x = 0
//! ```
//!
//! with c unknown, by taking their mean off b and off all products with A.

use rayon::prelude::*;
use tremie_numerics::sum::ordered_sum;

use crate::matrix::Number;
use crate::{Failure, Matrix, Multigrid, Operator, Settings, Solved, solve};

/// What is not the same everywhere of the products with a matrix.
struct Uneven<'a>(&'a Matrix);

fn level<T: Number>(values: &mut [T]) {
    let mean = T::told(ordered_sum(values, |value| value.in_full()) / values.len() as f64);
    values.par_iter_mut().with_min_len(4096).for_each(|value| *value = *value - mean);
}

impl Operator for Uneven<'_> {
    fn times(&self, x: &[f64], to: &mut [f64]) {
        self.0.times(x, to);
        level(to);
    }

    fn times_roughly(&self, x: &[f32], to: &mut [f32]) {
        self.0.times_roughly(x, to);
        level(to);
    }

    fn over_diagonal<T: Number>(&self, of: &[T], to: &mut [T]) {
        self.0.over_diagonal(of, to);
    }
}

/// Solves `A x = b` from the values that `x` has; where no row is `given` a value all must add up to nothing, and it is solved but for what is the same in all of them, with a mean of `x` of none.
///
/// # Errors
/// If the residual does not become small enough.
pub fn solve_poisson(
    matrix: &Matrix,
    multigrid: &Multigrid<1, 1>,
    given: bool,
    b: &[f64],
    x: &mut [f64],
    settings: &Settings,
) -> Result<Solved, Failure> {
    if given {
        return solve(matrix, Some(multigrid), b, x, settings);
    }
    let mut right = b.to_vec();
    level(&mut right);
    let solved = solve(&Uneven(matrix), Some(multigrid), &right, x, settings);
    level(x);
    solved
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_pcg::Pcg64Mcg;
    use tremie_numerics::DVec3;

    use super::*;
    use crate::Method;

    /// A row of nodes that see those beside them with weights that are not symmetric: what cannot be met is the same everywhere.
    #[test]
    fn all_rows_bear_the_same() {
        let mut random = Pcg64Mcg::seed_from_u64(11);
        let number = 200;
        let weights: Vec<[f64; 2]> =
            (0..number).map(|_| [random.random_range(0.5..1.5), random.random_range(0.5..1.5)]).collect();
        let matrix = Matrix::from_rows((0..number).map(|n| {
            let left = (n > 0).then(|| (n as u32 - 1, -weights[n][0]));
            let right = (n + 1 < number).then(|| (n as u32 + 1, -weights[n][1]));
            let others: Vec<(u32, f64)> = left.into_iter().chain(right).collect();
            (-others.iter().map(|(_, c)| c).sum::<f64>(), others)
        }));
        let places: Vec<DVec3> = (0..number).map(|n| DVec3::X * n as f64).collect();
        let multigrid = Multigrid::new(&matrix, &places, 1.0);
        let b: Vec<f64> = (0..number).map(|_| random.random_range(-1.0..1.0)).collect();
        let (mut x, mut product) = (vec![3.0; number], vec![0.0; number]);
        let settings = Settings { method: Method::BiCgStab, tolerance: 1e-9, iterations: 500 };
        solve_poisson(&matrix, &multigrid, false, &b, &mut x, &settings).unwrap();
        matrix.times(&x, &mut product);
        let left: Vec<f64> = b.iter().zip(&product).map(|(b, product)| b - product).collect();
        let largest = x.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
        assert!(left.iter().all(|of| (of - left[0]).abs() < 1e-7), "{left:?}");
        assert!(largest > 1.0 && x.iter().sum::<f64>().abs() < 1e-9 * largest * number as f64);
    }
}
