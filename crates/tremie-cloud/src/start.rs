//! Steps at the start of a flow whose viscosity depends on the shear rate.
//!
//! Viscosities are told by the velocities before a step: what is at rest is stiff, and what is let go begins to flow one or two steps late. So the first step is short, and
//! later ones grow by a fifth at most from one to the next: `dt_n = FIRST dt 1.2^n = FIRST dt + 0.2 t_n`.

/// The first step over the longest one, and how much longer than the one before a step may be, over that.
const FIRST: f64 = 0.05;
const GROWS: f64 = 0.2;

/// A step in s, at a time in s, that may be as long as `longest` in s.
pub fn at_start(longest: f64, time: f64) -> f64 {
    longest.min(FIRST * longest + GROWS * time)
}
