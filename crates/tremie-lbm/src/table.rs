//! A function of one variable as a table: cubics on intervals that are spaced logarithmically about two points.
//!
//! Functions that belong to a flow curve are smooth in the logarithm of their argument x, but for one place, the bend b, where
//! a fluid begins to yield, or begins to thin; there they are smooth in the logarithm of the distance. So there are
//! three ranges of intervals, by the distance d
//!
//! ```text
//!     0 <= x < b/2:  d = x         b/2 <= x < b:  d = b - x         b <= x:  d = x - b
//! ```
//!
//! in each of which every octave of d, from 2^-50 to 2^6, is cut into 16 intervals. A cubic passes through the function at the two ends
//! of an interval and two points between; for a power d^p its relative error is 4e-5 at p = 10 and 2e-7 at p = 4. Exponent and
//! leading digits of d are the number of the interval, its other digits the place within: nothing is searched, and no
//! logarithm is taken, whose last digits would depend on the machine.

use crate::real::{Number, Real, larger};

/// Octaves of the distance: the exponent of the first, and their number.
const FIRST_OCTAVE: i32 = -50;
const OCTAVES: usize = 56;
/// Intervals in an octave are 2 to this.
const DIGITS: u32 = 4;
/// Intervals in one range.
const INTERVALS: usize = OCTAVES << DIGITS;

/// Coefficients of a cubic in the place t from 0 to 1 within the interval.
type Cubic<T> = [T; 4];

/// A function of a number >= 0.
#[derive(Debug, Clone)]
pub(crate) struct Table<T> {
    bend: T,
    cubics: Box<[Cubic<T>]>,
}

/// The distance at the beginning of an interval.
fn distance(interval: usize) -> f64 {
    let steps = 1 << DIGITS;
    2f64.powi(FIRST_OCTAVE + (interval / steps) as i32) * (1.0 + (interval % steps) as f64 / steps as f64)
}

/// The cubic through values at t = 0, 1/3, 2/3, 1.
fn cubic<T: Real>([a, b, c, d]: [f64; 4]) -> Cubic<T> {
    [
        a,
        -5.5 * a + 9.0 * b - 4.5 * c + d,
        9.0 * a - 22.5 * b + 18.0 * c - 4.5 * d,
        -4.5 * a + 13.5 * b - 13.5 * c + 4.5 * d,
    ]
    .map(T::from_f64)
}

impl<T: Real> Table<T> {
    /// Tabulates `function`, which bends at `bend` >= 0. It is asked in the order of growing arguments, so that it may be
    /// a sum that runs along.
    pub(crate) fn new(bend: f64, mut function: impl FnMut(f64) -> f64) -> Self {
        // The bend as the kernel knows it.
        let bend = T::from_f64(bend).to_f64();
        let mut cubics = vec![[T::ZERO; 4]; 3 * INTERVALS];
        let mut fit = |range: usize, interval: usize, argument: &dyn Fn(f64) -> f64| {
            let (from, to) = (distance(interval), distance(interval + 1));
            let mut points = [0.0, 1.0 / 3.0, 2.0 / 3.0, 1.0].map(|t| argument(from + t * (to - from)));
            let falling = points[3] < points[0];
            if falling {
                points.reverse();
            }
            let mut values = points.map(|x| function(x.max(0.0)));
            if falling {
                values.reverse();
            }
            cubics[range * INTERVALS + interval] = cubic(values);
        };
        let needed = |interval: &usize| distance(*interval) <= 0.5 * bend;
        (0..INTERVALS).filter(needed).for_each(|interval| fit(0, interval, &|d| d));
        (0..INTERVALS).rev().filter(needed).for_each(|interval| fit(1, interval, &|d| bend - d));
        (0..INTERVALS).for_each(|interval| fit(2, interval, &|d| bend + d));
        Self { bend: T::from_f64(bend), cubics: cubics.into() }
    }

    /// The function at `x`, at 0 for x < 0.
    #[inline(always)]
    pub(crate) fn at<N: Number<Scalar = T>>(&self, x: N) -> N {
        x.each(|x| {
            let x = larger(x, T::ZERO);
            let (range, d) = if x + x < self.bend {
                (0, x)
            } else if x < self.bend {
                (1, self.bend - x)
            } else {
                (2, x - self.bend)
            };
            let (interval, t) = d.logarithmic_place::<DIGITS>(FIRST_OCTAVE, INTERVALS);
            let [a, b, c, d] = self.cubics[range * INTERVALS + interval];
            a + t * (b + t * (c + t * d))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn powers_of_the_distance_from_the_bend_are_found_on_both_sides() {
        for (power, tolerance) in [(1.0, 1e-9), (2.5, 1e-6), (10.0, 1e-4)] {
            let bend = 3e-5;
            let exact = |x: f64| (x - bend).abs().powf(power) * if x > bend { 2.0 } else { 1.0 };
            let table = Table::<f64>::new(bend, exact);
            for k in 0..3000 {
                let d = 10f64.powf(-11.0 + 0.004 * f64::from(k));
                for x in [bend - d, bend + d].into_iter().filter(|x| *x > 0.5 * bend) {
                    let error = table.at(x) / exact(x) - 1.0;
                    assert!(error.abs() < tolerance, "{power} {x:e} {error:e}");
                }
            }
        }
    }

    #[test]
    fn small_arguments_are_resolved_too() {
        let table = Table::<f32>::new(3e-5, |x| x * x);
        for k in 0..100 {
            let x = 1e-12f32 * 1.18f32.powi(k);
            assert!((table.at(x) / (x * x) - 1.0).abs() < 1e-5, "{x}");
        }
    }

    #[test]
    fn beyond_its_ends_the_table_goes_on_as_it_ends() {
        let table = Table::<f64>::new(0.0, |x| x + 1.0);
        assert!((table.at(0.0) - 1.0).abs() < 1e-12);
        assert_eq!(table.at(-1.0), table.at(0.0));
        assert_eq!(table.at(1e9), table.at(64.0));
        // What is not a number finds some interval.
        let _ = table.at(f64::NAN);
    }

    #[test]
    fn arguments_are_asked_in_order() {
        let mut last = -1.0;
        let mut back = 0.0f64;
        let _ = Table::<f64>::new(1e-4, |x| {
            back = back.max(last - x);
            last = x;
            0.0
        });
        // But for the one interval in which two ranges meet.
        assert!(back < 1e-5, "{back}");
    }
}
