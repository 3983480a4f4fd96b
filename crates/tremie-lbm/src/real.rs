//! The floating-point type of populations: `f32` or `f64`.

use std::fmt::Debug;
use tremie_output::state::Array;

use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

/// Arithmetic that the kernels need, no more.
///
/// There is no fused multiply-add on purpose: without it every processor, with whatever vector width, gives
/// the same bits.
pub trait Real:
    Copy
    + Debug
    + Default
    + PartialOrd
    + Send
    + Sync
    + bytemuck::Pod
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + AddAssign
    + SubAssign
    + 'static
{
    /// Name as in the case file.
    const NAME: &'static str;
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
    /// Widens to `f64`.
    fn to_f64(self) -> f64;
    /// Square root.
    fn sqrt(self) -> Self;
    /// Absolute value.
    fn abs(self) -> Self;
    /// As an array of a checkpoint.
    fn into_array(values: Vec<Self>) -> Array;
    /// From an array of a checkpoint; `None` if that has another type.
    fn from_array(array: &Array) -> Option<&[Self]>;
}

macro_rules! real {
    ($type:ident, $array:ident) => {
        impl Real for $type {
            const NAME: &'static str = stringify!($type);
            const ZERO: Self = 0.0;
            const ONE: Self = 1.0;
            const TINY: Self = 1e-30;
            const INFINITY: Self = $type::INFINITY;
            #[inline(always)]
            fn from_f64(value: f64) -> Self {
                value as $type
            }
            #[inline(always)]
            fn to_f64(self) -> f64 {
                self as f64
            }
            #[inline(always)]
            fn sqrt(self) -> Self {
                self.sqrt()
            }
            #[inline(always)]
            fn abs(self) -> Self {
                self.abs()
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

real!(f32, F32);
real!(f64, F64);

/// The larger of two numbers, compiled to one vector instruction (`b` if either is not a number).
#[inline(always)]
pub(crate) fn larger<T: Real>(a: T, b: T) -> T {
    if a > b { a } else { b }
}

/// The smaller of two numbers (`b` if either is not a number).
#[inline(always)]
pub(crate) fn smaller<T: Real>(a: T, b: T) -> T {
    if a < b { a } else { b }
}
