//! Solving linear systems over neighbours: conjugate gradients (Hestenes and Stiefel 1952) where the matrix is symmetric, BiCGStab (van der Vorst 1992)
//! where it is not, with a multigrid cycle or the diagonal for preconditioner.

use thiserror::Error;
use tremie_numerics::sum::ordered_sum;

use crate::Multigrid;
use crate::matrix::rows;

/// How a system is solved.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Method {
    /// Conjugate gradients: the matrix must be symmetric, and all of its eigenvalues of one sign.
    ConjugateGradients,
    /// Stabilised biconjugate gradients, for any matrix.
    BiCgStab,
}

/// When a system counts as solved.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// How it is solved.
    pub method: Method,
    /// Norm of the residual over that of the right-hand side.
    pub tolerance: f64,
    /// Iterations at most.
    pub iterations: usize,
}

/// How a solution was found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Solved {
    /// Iterations that it took.
    pub iterations: usize,
    /// Norm of the residual, computed anew, over that of the right-hand side.
    pub residual: f64,
}

/// Why a system was not solved.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
pub enum Failure {
    /// It took too long.
    #[error("the residual is still {residual:e} of the right-hand side after {iterations} iterations")]
    Slow {
        /// Iterations that were taken.
        iterations: usize,
        /// What is left of the residual.
        residual: f64,
    },
    /// The method cannot go on: the matrix or the right-hand side is not a number, or the matrix is singular.
    #[error("the linear system broke down after {iterations} iterations")]
    Breakdown {
        /// Iterations that were taken.
        iterations: usize,
    },
}

/// What a linear system multiplies its unknowns with.
pub trait Operator: Sync {
    /// `to` = A x.
    fn times(&self, x: &[f64], to: &mut [f64]);

    /// Numbers over what stands on the diagonal.
    fn over_diagonal(&self, of: &[f64]) -> Vec<f64>;
}

/// Residual over the smallest so far from which on BiCGStab will not find back; and over that at the start if none was smaller yet: errors of given values spread into rows with far larger numbers at first.
const LOST: f64 = 100.0;
const HOPELESS: f64 = 1e12;

fn dot(a: &[f64], b: &[f64]) -> f64 {
    /// Numbers that are multiplied in one piece.
    const CHUNK: usize = 512;
    let pieces: Vec<(&[f64], &[f64])> = a.chunks(CHUNK).zip(b.chunks(CHUNK)).collect();
    ordered_sum(&pieces, |(a, b)| a.iter().zip(*b).map(|(a, b)| a * b).sum())
}

/// y += a x
fn add(y: &mut [f64], a: f64, x: &[f64]) {
    rows(y, |row, y| *y += a * x[row]);
}

/// y = x + a y
fn onto(y: &mut [f64], a: f64, x: &[f64]) {
    rows(y, |row, y| *y = x[row] + a * *y);
}

/// Solves `A x = b` from the values that `x` has; without a `multigrid`, or where that does not lead anywhere, the diagonal is the preconditioner.
///
/// # Errors
/// If the residual does not become small enough.
pub fn solve<const N: usize, const M: usize>(
    matrix: &impl Operator,
    multigrid: Option<&Multigrid<N, M>>,
    b: &[f64],
    x: &mut [f64],
    settings: &Settings,
) -> Result<Solved, Failure> {
    let before = x.to_vec();
    let found = attempt(matrix, multigrid, b, x, settings);
    if found.is_ok() || multigrid.is_none() {
        return found;
    }
    x.copy_from_slice(&before);
    attempt(matrix, None::<&Multigrid<N, M>>, b, x, settings)
}

fn attempt<const N: usize, const M: usize>(
    matrix: &impl Operator,
    multigrid: Option<&Multigrid<N, M>>,
    b: &[f64],
    x: &mut [f64],
    settings: &Settings,
) -> Result<Solved, Failure> {
    let precondition = |r: &[f64]| match multigrid {
        Some(multigrid) => multigrid.cycle(r),
        None => matrix.over_diagonal(r),
    };
    let scale = dot(b, b).sqrt();
    if scale == 0.0 {
        x.fill(0.0);
        return Ok(Solved { iterations: 0, residual: 0.0 });
    }
    let mut r = vec![0.0; b.len()];
    let mut iterations = 0;
    // What the recursion takes for the residual is not always it: it goes on from the true one until that is small.
    loop {
        matrix.times(x, &mut r);
        onto(&mut r, -1.0, b);
        let residual = dot(&r, &r).sqrt() / scale;
        if residual <= settings.tolerance {
            return Ok(Solved { iterations, residual });
        }
        if iterations >= settings.iterations {
            return Err(Failure::Slow { iterations, residual });
        }
        let before = iterations;
        let good = |r: &[f64]| dot(r, r).sqrt() <= settings.tolerance * scale;
        iterations = match settings.method {
            Method::ConjugateGradients => {
                conjugate(matrix, precondition, &mut r, x, iterations, settings, good)
            }
            Method::BiCgStab => stabilised(matrix, precondition, &mut r, x, iterations, settings, good),
        }
        .ok_or(Failure::Breakdown { iterations })?;
        if iterations == before {
            return Err(Failure::Breakdown { iterations });
        }
    }
}

/// Goes on with conjugate gradients until the residual is good; gives the number of iterations then, or none where they break down.
fn conjugate(
    matrix: &impl Operator,
    precondition: impl Fn(&[f64]) -> Vec<f64>,
    r: &mut [f64],
    x: &mut [f64],
    mut iterations: usize,
    settings: &Settings,
    good: impl Fn(&[f64]) -> bool,
) -> Option<usize> {
    let mut z = precondition(r);
    let mut p = z.clone();
    let mut rz = dot(r, &z);
    let mut ap = vec![0.0; r.len()];
    while iterations < settings.iterations {
        matrix.times(&p, &mut ap);
        let alpha = rz / dot(&p, &ap);
        if !alpha.is_finite() {
            return None;
        }
        iterations += 1;
        add(x, alpha, &p);
        add(r, -alpha, &ap);
        if good(r) {
            break;
        }
        z = precondition(r);
        let before = std::mem::replace(&mut rz, dot(r, &z));
        onto(&mut p, rz / before, &z);
    }
    Some(iterations)
}

/// The same with BiCGStab.
fn stabilised(
    matrix: &impl Operator,
    precondition: impl Fn(&[f64]) -> Vec<f64>,
    r: &mut [f64],
    x: &mut [f64],
    mut iterations: usize,
    settings: &Settings,
    good: impl Fn(&[f64]) -> bool,
) -> Option<usize> {
    let shadow = r.to_vec();
    // The best so far, its residual, and whether it is better than where this began.
    let (mut best, mut least, mut better) = (x.to_vec(), dot(r, r).sqrt(), false);
    let mut p = r.to_vec();
    let mut rho = dot(&shadow, r);
    let (mut v, mut t) = (vec![0.0; r.len()], vec![0.0; r.len()]);
    while iterations < settings.iterations {
        let p_hat = precondition(&p);
        matrix.times(&p_hat, &mut v);
        let alpha = rho / dot(&shadow, &v);
        if !alpha.is_finite() {
            return None;
        }
        iterations += 1;
        add(x, alpha, &p_hat);
        add(r, -alpha, &v);
        if good(r) {
            break;
        }
        let s_hat = precondition(r);
        matrix.times(&s_hat, &mut t);
        let omega = dot(&t, r) / dot(&t, &t);
        add(x, omega, &s_hat);
        add(r, -omega, &t);
        if good(r) {
            break;
        }
        let size = dot(r, r).sqrt();
        if size < 0.5 * least {
            (least, better) = (size, true);
            best.copy_from_slice(x);
        } else if better && (size.is_nan() || size > LOST * least) {
            // It has lost its way, and begins anew from there.
            x.copy_from_slice(&best);
            break;
        } else if size > HOPELESS * least {
            return None;
        }
        let before = std::mem::replace(&mut rho, dot(&shadow, r));
        let beta = rho / before * alpha / omega;
        if !(beta.is_finite() && omega != 0.0) {
            return None;
        }
        add(&mut p, -omega, &v);
        onto(&mut p, beta, r);
    }
    Some(iterations)
}
