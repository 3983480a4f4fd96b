//! Arithmetic on the eight cells of a row at once.
//!
//! Each operation is a loop over the lanes that the compiler turns into one vector instruction; what differs between lanes is
//! a choice, never a branch.

use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

use crate::real::{Number, Real};
use crate::topology::EDGE;

/// Lanes of a row.
pub(crate) const LANES: usize = EDGE;

/// One number for each cell of a row.
#[derive(Debug, Clone, Copy, PartialEq, bytemuck::Zeroable)]
#[repr(C, align(32))]
pub(crate) struct Lanes<T>(pub(crate) [T; LANES]);

/// For each byte all ones in the lanes whose bits are set: quicker read than worked out.
static SET: [[i32; LANES]; 256] = {
    let mut table = [[0; LANES]; 256];
    let mut bits = 0;
    while bits < 256 {
        let mut k = 0;
        while k < LANES {
            table[bits][k] = -((bits >> k & 1) as i32);
            k += 1;
        }
        bits += 1;
    }
    table
};

/// A bit for each lane in which something holds. All lanes are asked in the same way and the answers gathered as
/// bytes, so that the compiler treats them alike; with a shift for each it would cut the row in unequal pieces, and all that
/// went before.
#[inline(always)]
pub(crate) fn bits(holds: impl Fn(usize) -> bool) -> u8 {
    let mut bytes = [0u8; LANES];
    for k in 0..LANES {
        bytes[k] = u8::from(holds(k));
    }
    // Moves the lowest bit of byte k to bit 56 + k.
    (u64::from_le_bytes(bytes).wrapping_mul(0x0102_0408_1020_4080) >> 56) as u8
}

impl<T: Real> Lanes<T> {
    #[inline(always)]
    fn with(self, other: Self, f: impl Fn(T, T) -> T) -> Self {
        let mut new = self;
        for k in 0..LANES {
            new.0[k] = f(self.0[k], other.0[k]);
        }
        new
    }

    /// The numbers in lanes whose bit is set, those of `other` in the rest.
    #[inline(always)]
    pub(crate) fn choose(bits: u8, set: Self, other: Self) -> Self {
        let mask = &SET[usize::from(bits)];
        let mut new = other;
        for k in 0..LANES {
            new.0[k] = T::choose(mask[k], set.0[k], other.0[k]);
        }
        new
    }

    /// The numbers in lanes whose bit is set, 0 in the others.
    #[inline(always)]
    pub(crate) fn only(self, bits: u8) -> Self {
        Self::choose(bits, self, Self::ZERO)
    }
}

impl<T: Real> Number for Lanes<T> {
    type Scalar = T;
    const ZERO: Self = Self([T::ZERO; LANES]);
    const ONE: Self = Self([T::ONE; LANES]);
    const TINY: Self = Self([T::TINY; LANES]);
    const INFINITY: Self = Self([T::INFINITY; LANES]);
    #[inline(always)]
    fn from_f64(value: f64) -> Self {
        Self::splat(T::from_f64(value))
    }
    #[inline(always)]
    fn splat(value: T) -> Self {
        Self([value; LANES])
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        self.each(T::sqrt)
    }
    #[inline(always)]
    fn abs(self) -> Self {
        self.each(T::abs)
    }
    #[inline(always)]
    fn where_greater(a: Self, b: Self, yes: Self, no: Self) -> Self {
        let mut new = no;
        for k in 0..LANES {
            new.0[k] = if a.0[k] > b.0[k] { yes.0[k] } else { no.0[k] };
        }
        new
    }
    #[inline(always)]
    fn any_greater(a: Self, b: Self) -> bool {
        bits(|k| a.0[k] > b.0[k]) != 0
    }
    #[inline(always)]
    fn each(self, f: impl Fn(T) -> T) -> Self {
        let mut new = self;
        for k in 0..LANES {
            new.0[k] = f(self.0[k]);
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

impl<T: Real> Div for Lanes<T> {
    type Output = Self;
    #[inline(always)]
    fn div(self, other: Self) -> Self {
        self.with(other, |a, b| a / b)
    }
}

impl<T: Real> AddAssign for Lanes<T> {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl<T: Real> SubAssign for Lanes<T> {
    #[inline(always)]
    fn sub_assign(&mut self, other: Self) {
        *self = *self - other;
    }
}

impl<T: Real> Neg for Lanes<T> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        self.each(|x| -x)
    }
}
