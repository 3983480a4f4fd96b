//! Small systems with a positive definite matrix, as sums of squares have them (Cholesky).

/// Solves A x = b with a positive definite matrix of which the lower half is given; none if of a row no more than the share `singular` is independent of the rows before.
pub fn solve<const N: usize>(mut a: [[f64; N]; N], mut b: [f64; N], singular: f64) -> Option<[f64; N]> {
    for j in 0..N {
        let whole = a[j][j];
        for k in 0..j {
            a[j][j] -= a[j][k] * a[j][k];
        }
        if a[j][j].is_nan() || a[j][j] <= singular * whole {
            return None;
        }
        // Kept the other way up: what divides is divided by once.
        a[j][j] = 1.0 / a[j][j].sqrt();
        for i in j + 1..N {
            for k in 0..j {
                a[i][j] -= a[i][k] * a[j][k];
            }
            a[i][j] *= a[j][j];
        }
    }
    for i in 0..N {
        for k in 0..i {
            b[i] -= a[i][k] * b[k];
        }
        b[i] *= a[i][i];
    }
    for i in (0..N).rev() {
        for k in i + 1..N {
            b[i] -= a[k][i] * b[k];
        }
        b[i] *= a[i][i];
    }
    Some(b)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_solved_meets_the_equations() {
        let a = [[4.0, 0.0, 0.0], [2.0, 5.0, 0.0], [-1.0, 0.5, 3.0]];
        let x = solve(a, [7.0, 13.5, 9.0], 1e-9).unwrap();
        let full = |i: usize, j: usize| if j <= i { a[i][j] } else { a[j][i] };
        for (i, right) in [7.0, 13.5, 9.0].into_iter().enumerate() {
            let found: f64 = (0..3).map(|j| full(i, j) * x[j]).sum();
            assert!((found - right).abs() < 1e-12, "row {i}: {found}, not {right}");
        }
    }

    #[test]
    fn rows_that_say_the_same_have_no_solution() {
        assert_eq!(solve([[1.0, 0.0], [1.0, 1.0]], [1.0, 1.0], 1e-9), None);
    }
}
