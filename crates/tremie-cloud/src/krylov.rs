//! Solving linear systems over neighbours: conjugate gradients (Hestenes and Stiefel 1952) where the matrix is symmetric, BiCGStab (van der Vorst 1992)
//! where it is not, with a multigrid cycle or the diagonal for preconditioner.
//!
//! With the diagonal, iterations are many: then what is left of the right-hand side is known in 64 bits, and what takes it away is found in 32 (iterative refinement; Wilkinson 1963). Each round takes as many digits away as 32 bits
//! can tell; where one takes none, because what is small beside the stiffness around it is lost in them, the rest is found in 64. With a multigrid a few iterations are enough, and each round would cost one more.

use rayon::prelude::*;
use thiserror::Error;
use tremie_numerics::sum::ordered_sum;

use crate::Multigrid;
use crate::matrix::{Number, rows};

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

    /// `to` = A x as far as 32 bits tell.
    fn times_roughly(&self, x: &[f32], to: &mut [f32]);

    /// `to` = numbers over what stands on the diagonal.
    fn over_diagonal<T: Number>(&self, of: &[T], to: &mut [T]);
}

/// Residual over the smallest so far from which on BiCGStab will not find back; and over that at the start if none was smaller yet: errors of given values spread into rows with far larger numbers at first.
const LOST: f64 = 100.0;
const HOPELESS: f64 = 1e12;

/// Share of a residual that a round in 32 bits leaves at least, and from which on it has been in vain.
const DIGITS: f64 = 1e-4;
const VAIN: f64 = 0.5;

fn dot<T: Number>(a: &[T], b: &[T]) -> f64 {
    /// Numbers that are multiplied in one piece.
    const CHUNK: usize = 512;
    let pieces: Vec<(&[T], &[T])> = a.chunks(CHUNK).zip(b.chunks(CHUNK)).collect();
    ordered_sum(&pieces, |(a, b)| a.iter().zip(*b).map(|(a, b)| a.in_full() * b.in_full()).sum())
}

fn norm<T: Number>(of: &[T]) -> f64 {
    dot(of, of).sqrt()
}

/// What becomes of y by x.
fn combine<T: Number>(y: &mut [T], x: &[T], of: impl Fn(T, T) -> T + Sync + Send) {
    /// Numbers in one piece.
    const CHUNK: usize = 4096;
    y.par_chunks_mut(CHUNK).zip(x.par_chunks(CHUNK)).for_each(|(y, x)| {
        y.iter_mut().zip(x).for_each(|(y, x)| *y = of(*y, *x));
    });
}

/// y += a x
fn add<T: Number>(y: &mut [T], a: f64, x: &[T]) {
    let a = T::told(a);
    combine(y, x, |y, x| y + a * x);
}

/// y = x + a y
fn onto<T: Number>(y: &mut [T], a: f64, x: &[T]) {
    let a = T::told(a);
    combine(y, x, |y, x| x + a * y);
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

fn precondition<const N: usize, const M: usize, T: Number>(
    matrix: &impl Operator,
    multigrid: Option<&Multigrid<N, M>>,
    of: &[T],
    to: &mut [T],
) {
    match multigrid {
        Some(multigrid) => multigrid.cycle(of, to),
        None => matrix.over_diagonal(of, to),
    }
}

fn attempt<const N: usize, const M: usize>(
    matrix: &impl Operator,
    multigrid: Option<&Multigrid<N, M>>,
    b: &[f64],
    x: &mut [f64],
    settings: &Settings,
) -> Result<Solved, Failure> {
    let scale = norm(b);
    if scale == 0.0 {
        x.fill(0.0);
        return Ok(Solved { iterations: 0, residual: 0.0 });
    }
    let mut r = vec![0.0; b.len()];
    let (mut iterations, mut last, mut roughly) = (0, f64::INFINITY, multigrid.is_none());
    // What the recursion takes for the residual is not always it: it goes on from the true one until that is small.
    loop {
        matrix.times(x, &mut r);
        onto(&mut r, -1.0, b);
        let size = norm(&r);
        let residual = size / scale;
        if residual <= settings.tolerance {
            return Ok(Solved { iterations, residual });
        }
        if iterations >= settings.iterations {
            return Err(Failure::Slow { iterations, residual });
        }
        roughly = roughly && size <= VAIN * last;
        last = size;
        let most = settings.iterations - iterations;
        if roughly {
            let of = Iterated {
                times: |x: &[f32], to: &mut [f32]| matrix.times_roughly(x, to),
                precondition: |r: &[f32], to: &mut [f32]| precondition(matrix, multigrid, r, to),
                goal: DIGITS.max(settings.tolerance / residual),
                // Half of them are left for 64 bits.
                most: most.div_ceil(2),
            };
            let mut left: Vec<f32> = r.iter().map(|r| (r / size) as f32).collect();
            let mut way = vec![0.0; left.len()];
            match of.go(settings.method, &mut left, &mut way) {
                Some(taken @ 1..) if norm(&left) < VAIN => {
                    iterations += taken;
                    rows(x, |row, x| *x += size * f64::from(way[row]));
                }
                _ => roughly = false,
            }
        }
        if !roughly {
            let of = Iterated {
                times: |x: &[f64], to: &mut [f64]| matrix.times(x, to),
                precondition: |r: &[f64], to: &mut [f64]| precondition(matrix, multigrid, r, to),
                goal: settings.tolerance * scale,
                most,
            };
            match of.go(settings.method, &mut r, x) {
                Some(taken @ 1..) => iterations += taken,
                _ => return Err(Failure::Breakdown { iterations }),
            }
        }
    }
}

/// What takes residuals away: until their norm is a `goal`, in so many iterations at `most`.
struct Iterated<A, P> {
    times: A,
    precondition: P,
    goal: f64,
    most: usize,
}

impl<A, P> Iterated<A, P> {
    /// Adds to `x` what takes the residual `r` away; gives the number of iterations, or none where they break down.
    fn go<T: Number>(&self, method: Method, r: &mut [T], x: &mut [T]) -> Option<usize>
    where
        A: Fn(&[T], &mut [T]),
        P: Fn(&[T], &mut [T]),
    {
        match method {
            Method::ConjugateGradients => self.conjugate(r, x),
            Method::BiCgStab => self.stabilised(r, x),
        }
    }

    fn conjugate<T: Number>(&self, r: &mut [T], x: &mut [T]) -> Option<usize>
    where
        A: Fn(&[T], &mut [T]),
        P: Fn(&[T], &mut [T]),
    {
        let mut z = vec![T::default(); r.len()];
        (self.precondition)(r, &mut z);
        let mut p = z.clone();
        let mut rz = dot(r, &z);
        let mut ap = vec![T::default(); r.len()];
        let mut iterations = 0;
        while iterations < self.most {
            (self.times)(&p, &mut ap);
            let alpha = rz / dot(&p, &ap);
            if !alpha.is_finite() {
                return None;
            }
            iterations += 1;
            add(x, alpha, &p);
            add(r, -alpha, &ap);
            if norm(r) <= self.goal {
                break;
            }
            (self.precondition)(r, &mut z);
            let before = std::mem::replace(&mut rz, dot(r, &z));
            onto(&mut p, rz / before, &z);
        }
        Some(iterations)
    }

    fn stabilised<T: Number>(&self, r: &mut [T], x: &mut [T]) -> Option<usize>
    where
        A: Fn(&[T], &mut [T]),
        P: Fn(&[T], &mut [T]),
    {
        let shadow = r.to_vec();
        // The best so far, its residual, and whether it is better than where this began.
        let (mut best, mut least, mut better) = (x.to_vec(), norm(r), false);
        let mut p = r.to_vec();
        let mut rho = dot(&shadow, r);
        let [mut hat, mut v, mut t] = std::array::from_fn(|_| vec![T::default(); r.len()]);
        let mut iterations = 0;
        while iterations < self.most {
            (self.precondition)(&p, &mut hat);
            (self.times)(&hat, &mut v);
            let alpha = rho / dot(&shadow, &v);
            if !alpha.is_finite() {
                return None;
            }
            iterations += 1;
            add(x, alpha, &hat);
            add(r, -alpha, &v);
            if norm(r) <= self.goal {
                break;
            }
            (self.precondition)(r, &mut hat);
            (self.times)(&hat, &mut t);
            let omega = dot(&t, r) / dot(&t, &t);
            add(x, omega, &hat);
            add(r, -omega, &t);
            let size = norm(r);
            if size <= self.goal {
                break;
            }
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
}
