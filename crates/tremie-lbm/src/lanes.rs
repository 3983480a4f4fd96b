//! Arithmetic on the eight cells of a row at once.
//!
//! Each operation is a loop over the lanes that the compiler turns into one vector instruction; what differs between lanes is
//! a choice, never a branch.

use std::ops::{Add, Mul, Neg, Sub};

use crate::real::{Real, larger, smaller};
use crate::topology::EDGE;

/// Lanes of a row.
pub(crate) const LANES: usize = EDGE;

/// One number for each cell of a row.
#[derive(Debug, Clone, Copy)]
#[repr(align(32))]
pub(crate) struct Lanes<T>(pub(crate) [T; LANES]);

impl<T: Real> Lanes<T> {
    #[inline(always)]
    pub(crate) fn all(value: f64) -> Self {
        Self([T::from_f64(value); LANES])
    }

    /// The first eight values of a slice.
    #[inline(always)]
    pub(crate) fn load(from: &[T]) -> Self {
        let mut new = [T::ZERO; LANES];
        new.copy_from_slice(&from[..LANES]);
        Self(new)
    }

    #[inline(always)]
    fn each(self, f: impl Fn(T) -> T) -> Self {
        let mut new = self;
        for k in 0..LANES {
            new.0[k] = f(self.0[k]);
        }
        new
    }

    #[inline(always)]
    fn with(self, other: Self, f: impl Fn(T, T) -> T) -> Self {
        let mut new = self;
        for k in 0..LANES {
            new.0[k] = f(self.0[k], other.0[k]);
        }
        new
    }

    #[inline(always)]
    pub(crate) fn abs(self) -> Self {
        self.each(T::abs)
    }

    #[inline(always)]
    pub(crate) fn sqrt(self) -> Self {
        self.each(T::sqrt)
    }

    #[inline(always)]
    pub(crate) fn reciprocal(self) -> Self {
        self.each(|x| T::ONE / x)
    }

    /// 1, 0 or -1.
    #[inline(always)]
    pub(crate) fn sign(self) -> Self {
        let zero = Self::all(0.0);
        let below = Self::where_greater(zero, self, Self::all(-1.0), zero);
        Self::where_greater(self, zero, Self::all(1.0), below)
    }

    #[inline(always)]
    pub(crate) fn max(self, other: Self) -> Self {
        self.with(other, larger)
    }

    #[inline(always)]
    pub(crate) fn min(self, other: Self) -> Self {
        self.with(other, smaller)
    }

    /// `yes` in the lanes in which `a > b`, `no` in the others.
    #[inline(always)]
    pub(crate) fn where_greater(a: Self, b: Self, yes: Self, no: Self) -> Self {
        let mut new = no;
        for k in 0..LANES {
            new.0[k] = if a.0[k] > b.0[k] { yes.0[k] } else { no.0[k] };
        }
        new
    }

    /// The numbers in lanes whose bit is set, 0 in the others.
    #[inline(always)]
    pub(crate) fn only(self, bits: u8) -> Self {
        let mut new = self;
        for k in 0..LANES {
            new.0[k] = if bits & (1 << k) != 0 { self.0[k] } else { T::ZERO };
        }
        new
    }
}

impl<T: Real> Add for Lanes<T> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        self.with(other, |a, b| a + b)
    }
}

impl<T: Real> Sub for Lanes<T> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        self.with(other, |a, b| a - b)
    }
}

impl<T: Real> Mul for Lanes<T> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        self.with(other, |a, b| a * b)
    }
}

impl<T: Real> Neg for Lanes<T> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        self.each(|x| -x)
    }
}
