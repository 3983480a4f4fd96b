//! Where fronts met.
//!
//! Fluid comes from where a place was filled earlier: it went along the gradient of the time of filling. Fronts have met in a cell if it was filled no
//! earlier than those beside it along an axis, and if two cells to either side the fluid went towards it, the two ways more than 90
//! degrees apart:
//!
//! ```text
//!     g_low . e > 0,   g_high . e < 0,   g_low . g_high < 0
//! ```
//!
//! The last keeps out a level that rises, in which neighbours differ by chance. Fronts that pass more than some two cells between readings
//! leave no gradient and are not told.

use tremie_numerics::DVec3;

use super::Filling;

/// Cells over which a gradient is taken, and away from which it is asked for.
const REACH: isize = 2;

fn moved(mut at: [isize; 3], axis: usize, by: isize) -> [isize; 3] {
    at[axis] += by;
    at
}

impl Filling {
    fn time(&self, at: [isize; 3]) -> Option<f64> {
        let n = self.grid.cell(at).filter(|n| self.is_filled(*n))?;
        Some(f64::from(self.times[n]))
    }

    /// How far filled cells go on along an axis, up to [`REACH`], and the time of the last.
    fn end(&self, at: [isize; 3], axis: usize, sign: isize) -> (isize, f64) {
        let mut end = (0, self.time(at).unwrap_or(0.0));
        for by in 1..=REACH {
            match self.time(moved(at, axis, sign * by)) {
                Some(time) => end = (by, time),
                None => break,
            }
        }
        end
    }

    /// Gradient of the time of filling, in s a cell.
    fn gradient(&self, at: [isize; 3]) -> DVec3 {
        let along = |axis: usize| {
            let ((low, before), (high, after)) = (self.end(at, axis, -1), self.end(at, axis, 1));
            if low + high == 0 { 0.0 } else { (after - before) / (low + high) as f64 }
        };
        DVec3::new(along(0), along(1), along(2))
    }

    /// Whether fronts met in a cell.
    pub(super) fn fronts_meet(&self, n: usize) -> bool {
        if !self.is_filled(n) {
            return false;
        }
        let at = self.grid.place(n).map(|i| i as isize);
        (0..3).any(|axis| self.meet_along(at, axis))
    }

    fn meet_along(&self, at: [isize; 3], axis: usize) -> bool {
        let ends = [-1, 1].map(|sign| self.end(at, axis, sign).0);
        if ends != [REACH; 2] {
            return false;
        }
        let time = |by: isize| self.time(moved(at, axis, by)).unwrap_or(f64::INFINITY);
        if time(0) < time(-1) || time(0) < time(1) {
            return false;
        }
        let [low, high] = [-REACH, REACH].map(|by| self.gradient(moved(at, axis, by)));
        low[axis] > 0.0 && high[axis] < 0.0 && low.dot(high) < 0.0
    }
}
