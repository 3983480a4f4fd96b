//! Kernels: how much a neighbour counts, by its distance. Each has a smoothing length h and is zero beyond its support; its integral is 1.
//!
//! ```text
//!     Wendland C2 (quintic)   a (1 - q/2)^4 (2 q + 1)                               q = r/h < 2   a = 7/(4 pi h^2), 21/(16 pi h^3)
//!     quintic spline          a ((3 - q)^5 - 6 (2 - q)^5 + 15 (1 - q)^5)            q < 3         a = 7/(478 pi h^2), 1/(120 pi h^3)
//!     cubic                   a (1 - q)^3                                           q < 1         a = 10/(pi h^2), 15/(pi h^3)
//! ```
//!
//! with each bracket zero where it would be negative: Wendland (1995), as in Wu (2016, Eq. 17); Morris, Fox and Zhu (1997); Basic (2021, Eq. 13).
//! (In space the spline's constant is often printed as 3/(359 pi h^3), which is 0.28 % too much.)

use std::f64::consts::PI;

/// A plane or space.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Dimension {
    /// A vertical plane: y is the same everywhere.
    Two,
    /// Space.
    Three,
}

impl Dimension {
    /// Its number.
    pub fn number(self) -> usize {
        match self {
            Self::Two => 2,
            Self::Three => 3,
        }
    }
}

/// A shape of kernels.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kernel {
    /// Wendland's quintic of class C2.
    Wendland,
    /// The quintic spline.
    Spline,
    /// The cubic of Lagrangian differencing dynamics, with a cusp in the middle.
    Cubic,
}

/// A kernel of a smoothing length.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Smoothing {
    kernel: Kernel,
    length: f64,
    /// Factor a.
    scale: f64,
}

/// A power of what is positive of x.
fn positive(x: f64, power: i32) -> f64 {
    x.max(0.0).powi(power)
}

impl Smoothing {
    /// A kernel with the smoothing length `length` in m.
    pub fn new(kernel: Kernel, dimension: Dimension, length: f64) -> Self {
        let of = |plane: f64, space: f64| match dimension {
            Dimension::Two => plane / (length * length),
            Dimension::Three => space / (length * length * length),
        };
        let scale = match kernel {
            Kernel::Wendland => of(7.0 / (4.0 * PI), 21.0 / (16.0 * PI)),
            Kernel::Spline => of(7.0 / (478.0 * PI), 1.0 / (120.0 * PI)),
            Kernel::Cubic => of(10.0 / PI, 15.0 / PI),
        };
        Self { kernel, length, scale }
    }

    /// Distance in m from which on it is zero.
    pub fn support(&self) -> f64 {
        self.length
            * match self.kernel {
                Kernel::Wendland => 2.0,
                Kernel::Spline => 3.0,
                Kernel::Cubic => 1.0,
            }
    }

    /// W at a distance in m, in 1/m2 in a plane and in 1/m3 in space.
    #[inline]
    pub fn weight(&self, distance: f64) -> f64 {
        let q = distance / self.length;
        self.scale
            * match self.kernel {
                Kernel::Wendland => positive(1.0 - 0.5 * q, 4) * (2.0 * q + 1.0),
                Kernel::Spline => {
                    positive(3.0 - q, 5) - 6.0 * positive(2.0 - q, 5) + 15.0 * positive(1.0 - q, 5)
                }
                Kernel::Cubic => positive(1.0 - q, 3),
            }
    }

    /// dW/dr at a distance in m: nowhere positive.
    #[inline]
    pub fn slope(&self, distance: f64) -> f64 {
        let q = distance / self.length;
        -self.scale / self.length
            * match self.kernel {
                Kernel::Wendland => 5.0 * q * positive(1.0 - 0.5 * q, 3),
                Kernel::Spline => {
                    5.0 * (positive(3.0 - q, 4) - 6.0 * positive(2.0 - q, 4) + 15.0 * positive(1.0 - q, 4))
                }
                Kernel::Cubic => 3.0 * positive(1.0 - q, 2),
            }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn all() -> impl Iterator<Item = (Dimension, Smoothing)> {
        [Kernel::Wendland, Kernel::Spline, Kernel::Cubic].into_iter().flat_map(|kernel| {
            [Dimension::Two, Dimension::Three].map(|dim| (dim, Smoothing::new(kernel, dim, 0.013)))
        })
    }

    /// By Simpson's rule over shells.
    #[test]
    fn kernels_integrate_to_one() {
        for (dimension, kernel) in all() {
            let steps = 3000;
            let width = kernel.support() / f64::from(steps);
            let shell = |r: f64| match dimension {
                Dimension::Two => 2.0 * PI * r,
                Dimension::Three => 4.0 * PI * r * r,
            };
            let sum: f64 = (0..=steps)
                .map(|n| {
                    let r = f64::from(n) * width;
                    let share = if n == 0 || n == steps { 1.0 } else { 2.0 + 2.0 * f64::from(n % 2) };
                    share * shell(r) * kernel.weight(r)
                })
                .sum();
            approx::assert_relative_eq!(sum * width / 3.0, 1.0, max_relative = 1e-9);
        }
    }

    #[test]
    fn slopes_are_those_of_the_weights() {
        for (_, kernel) in all() {
            let step = 1e-6 * kernel.support();
            for n in 1..100 {
                let r = 0.0099 * f64::from(n) * kernel.support();
                let difference = (kernel.weight(r + step) - kernel.weight(r - step)) / (2.0 * step);
                let scale = kernel.weight(0.0) / kernel.support();
                assert!((kernel.slope(r) - difference).abs() < 1e-6 * scale, "{kernel:?} {r}");
                assert!(kernel.slope(r) <= 0.0);
            }
            assert_eq!([kernel.weight(kernel.support()), kernel.slope(1.1 * kernel.support())], [0.0, -0.0]);
        }
    }
}
