//! The floating-point type of populations: `f32` or `f64`.

use std::fmt::Debug;
use tremie_output::state::Array;

use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

/// Arithmetic that the kernels need, no more: on one number, or on the eight cells of a row at once (`lanes`).
///
/// There is no fused multiply-add on purpose: without it every processor, with whatever vector width, gives
/// the same bits.
pub trait Number:
    Copy
    + Debug
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + AddAssign
    + SubAssign
    + PartialEq
{
    /// The type of one number.
    type Scalar: Real;
    /// Zero.
    const ZERO: Self;
    /// One.
    const ONE: Self;
    /// A positive number whose reciprocal is still finite.
    const TINY: Self;
    /// Infinity.
    const INFINITY: Self;
    /// Rounds from `f64`.
    fn from_f64(value: f64) -> Self;
    /// The same number in every lane.
    fn splat(value: Self::Scalar) -> Self;
    /// Square root.
    fn sqrt(self) -> Self;
    /// Absolute value.
    fn abs(self) -> Self;
    /// `yes` where `a > b`, `no` elsewhere.
    fn where_greater(a: Self, b: Self, yes: Self, no: Self) -> Self;
    /// Whether `a > b` in any lane.
    fn any_greater(a: Self, b: Self) -> bool;
    /// A function of one number, in every lane.
    fn each(self, f: impl Fn(Self::Scalar) -> Self::Scalar) -> Self;
}

/// The type of populations, as stored.
pub trait Real: Number<Scalar = Self> + Default + PartialOrd + Send + Sync + bytemuck::Pod + 'static {
    /// Name as in the case file.
    const NAME: &'static str;
    /// Widens to `f64`.
    fn to_f64(self) -> f64;
    /// `set` where `mask` is all ones, `other` where it is 0. (Bit by bit: of comparisons with a table that it knows the compiler makes
    /// a case for each lane.)
    fn choose(mask: i32, set: Self, other: Self) -> Self;
    /// The interval in which a number >= 0 lies, if each octave from 2^`first` on is cut into 2^DIGITS of them, and the place
    /// in it from 0 to 1; the nearer end of the first `count` where it lies in none.
    fn logarithmic_place<const DIGITS: u32>(self, first: i32, count: usize) -> (usize, Self);
    /// As an array of a checkpoint.
    fn into_array(values: Vec<Self>) -> Array;
    /// From an array of a checkpoint; `None` if that has another type.
    fn from_array(array: &Array) -> Option<&[Self]>;
}

macro_rules! real {
    ($type:ident, $bits:ident, $array:ident) => {
        impl Number for $type {
            type Scalar = Self;
            const ZERO: Self = 0.0;
            const ONE: Self = 1.0;
            const TINY: Self = 1e-30;
            const INFINITY: Self = $type::INFINITY;
            #[inline(always)]
            fn from_f64(value: f64) -> Self {
                value as $type
            }
            #[inline(always)]
            fn splat(value: Self) -> Self {
                value
            }
            #[inline(always)]
            fn sqrt(self) -> Self {
                self.sqrt()
            }
            #[inline(always)]
            fn abs(self) -> Self {
                self.abs()
            }
            #[inline(always)]
            fn where_greater(a: Self, b: Self, yes: Self, no: Self) -> Self {
                if a > b { yes } else { no }
            }
            #[inline(always)]
            fn any_greater(a: Self, b: Self) -> bool {
                a > b
            }
            #[inline(always)]
            fn each(self, f: impl Fn(Self) -> Self) -> Self {
                f(self)
            }
        }

        impl Real for $type {
            const NAME: &'static str = stringify!($type);
            #[inline(always)]
            fn to_f64(self) -> f64 {
                self as f64
            }
            #[inline(always)]
            fn choose(mask: i32, set: Self, other: Self) -> Self {
                let mask = i64::from(mask) as $bits;
                $type::from_bits(set.to_bits() & mask | other.to_bits() & !mask)
            }
            #[inline(always)]
            fn logarithmic_place<const DIGITS: u32>(self, first: i32, count: usize) -> (usize, Self) {
                const MANTISSA: u32 = $type::MANTISSA_DIGITS - 1;
                let rest = MANTISSA - DIGITS;
                let one = ((first + $type::MAX_EXP - 1) as $bits) << MANTISSA;
                let bits = self.to_bits();
                let interval = (bits.saturating_sub(one) >> rest) as usize;
                let place = (bits & ((1 << rest) - 1)) as $type / (1u64 << rest) as $type;
                if bits < one {
                    (0, 0.0)
                } else if interval >= count {
                    (count - 1, 1.0)
                } else {
                    (interval, place)
                }
            }
            fn into_array(values: Vec<Self>) -> Array {
                Array::$array(values)
            }
            fn from_array(array: &Array) -> Option<&[Self]> {
                match array {
                    Array::$array(values) => Some(values),
                    _ => None,
                }
            }
        }
    };
}

real!(f32, u32, F32);
real!(f64, u64, F64);

/// One number for each axis. (`array::map` is not always made part of the loop around it, and then costs as much as the loop.)
#[inline(always)]
pub(crate) fn by_axis<N>(of: impl Fn(usize) -> N) -> [N; 3] {
    [of(0), of(1), of(2)]
}

/// The larger of two numbers (`b` if either is not a number).
#[inline(always)]
pub(crate) fn larger<N: Number>(a: N, b: N) -> N {
    N::where_greater(a, b, a, b)
}

/// The smaller of two numbers (`b` if either is not a number).
#[inline(always)]
pub(crate) fn smaller<N: Number>(a: N, b: N) -> N {
    N::where_greater(b, a, a, b)
}
