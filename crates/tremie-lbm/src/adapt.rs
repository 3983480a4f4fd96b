//! When the time step may grow, and when it must shrink.
//!
//! A slump spends most of its time creeping, at a tenth of its first height and a thousandth of its first speed; what set the time
//! step at the start holds no longer. Every [`INTERVAL`] steps the limits of `scaling` are asked again, for the fluid as it
//! is: the 99th percentile of its speed (single cells spike when they convert), and what weighs on its bottom: its height along gravity, or
//! the 99th percentile of its pressure if that is less. (What falls from a hose, or clings to a wall high up, does not weigh on what lies below as if it stood there.)
//! While fluid comes in, the jet is a small part of all fluid, but the fastest:
//! the speed counts that 99 % of the kinetic energy does not exceed. Until a jet has had the time to fall, it is taken to fall freely.
//! The largest speed of a while counts, as long as the fluid needs to fall its height, so that a flow that has yet to begin is
//! not taken for one that has come to rest.
//!
//! The lattice viscosity may grow beyond what a first time step aims at, to [`VISCOSITY`]: with the odd moments tied to the
//! even ones the steady flow does not depend on it, and a flow that creeps is nearly steady. (A planar slump of 20 Pa at a lattice
//! viscosity of 0.44 instead of 1/6 differs by 0.02 % in its spread at 200 s.)

use rayon::prelude::*;

use crate::collision::density_and_momentum;
use crate::grid::Grid;
use crate::lattice::Q;
use crate::real::Real;
use crate::scaling::Limits;
use crate::topology::{CELLS, EDGE};

/// Steps between two looks.
pub(crate) const INTERVAL: u64 = 200;
/// Largest lattice viscosity of a step that has grown.
pub(crate) const VISCOSITY: f64 = 0.75;
/// A step changes only if it would grow by more than this,
const WORTH: f64 = 1.25;
/// grows by no more than this at once,
const LARGEST: f64 = 2.0;
/// and keeps this share of what the limits allow.
const MARGIN: f64 = 0.9;
/// Share of the fluid that is no faster than the speed that counts.
const PERCENTILE: f64 = 0.99;

/// The fluid as a look finds it, in lattice units of the present time step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Look {
    /// Simulated time in s.
    pub(crate) time: f64,
    /// Speed that 99 % of the fluid does not exceed.
    pub(crate) speed: f64,
    /// Relative density error of the hydrostatic pressure, and of that of surface tension.
    pub(crate) hydrostatic_error: f64,
    /// Viscosity.
    pub(crate) viscosity: f64,
    /// Time in s in which fluid falls the present height.
    pub(crate) fall: f64,
}

/// What most of the fluid does not exceed, in lattice units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Common {
    /// Speed.
    pub(crate) speed: f64,
    /// Speed that most of the kinetic energy does not exceed.
    pub(crate) energetic_speed: f64,
    /// Excess of the density, by its pressure.
    pub(crate) excess: f64,
}

/// Speeds seen lately, in m/s, with their times in s.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Watch {
    pub(crate) seen: Vec<(f64, f64)>,
}

impl Watch {
    /// How many times as long the time step should be from now on, if it should change; `unit` is the velocity in m/s of one
    /// lattice unit.
    pub(crate) fn change(&mut self, look: &Look, unit: f64, limits: &Limits) -> Option<f64> {
        self.seen.push((look.time, look.speed * unit));
        let start = look.time - look.fall;
        let whole = self.seen[0].0 <= start;
        self.seen.retain(|(time, _)| *time >= start);
        let fastest = self.seen.iter().map(|(_, speed)| *speed).fold(0.0, f64::max) / unit;
        let by_speed = limits.lattice_speed / fastest;
        let by_pressure = (limits.hydrostatic_error / look.hydrostatic_error).sqrt();
        let allowed = by_speed.min(by_pressure);
        if allowed < 1.0 {
            return Some(MARGIN * allowed);
        }
        let factor = (MARGIN * allowed).min(VISCOSITY / look.viscosity).min(LARGEST);
        (whole && factor > WORTH).then_some(factor)
    }
}

impl<T: Real> Grid<T> {
    /// What the share [`PERCENTILE`] of the fluid does not exceed, in cells at least half full, within 2 %.
    pub(crate) fn common(&self, gravity: [T; 3]) -> Common {
        const BINS: usize = 1024;
        const RATIO: f64 = 1.02;
        const LEAST: f64 = 1e-9;
        let bin = |value: f64| (((value / LEAST).max(1.0).ln() / RATIO.ln()) as usize).min(BINS - 1);
        let slots: Vec<usize> = self.slots().collect();
        let count = |slot: &usize| {
            let mut bins = vec![[0.0; 3]; BINS];
            for cell in 0..CELLS {
                let wet = self.kinds[*slot][cell / EDGE].wet() >> (cell % EDGE) & 1 == 1;
                let fill = self.fills[*slot][(0, cell)].to_f64().min(1.0);
                if !wet || fill < 0.5 {
                    continue;
                }
                let f: [T; Q] = std::array::from_fn(|i| self.front[*slot][(i, cell)]);
                let (excess, momentum) = density_and_momentum(&f);
                let square: f64 = (0..3)
                    .map(|a| (momentum[a] / (1.0 + excess) - 0.5 * fill * gravity[a].to_f64()).powi(2))
                    .sum();
                let speed = bin(square.sqrt());
                bins[speed][0] += 1.0;
                bins[speed][1] += square;
                bins[bin(excess)][2] += 1.0;
            }
            bins
        };
        let counts: Vec<Vec<[f64; 3]>> = slots.par_iter().map(count).collect();
        let [speed, energetic_speed, excess] = [0, 1, 2].map(|k| {
            let bins: Vec<f64> = (0..BINS).map(|bin| counts.iter().map(|bins| bins[bin][k]).sum()).collect();
            let all: f64 = bins.iter().sum();
            let mut below = 0.0;
            let bin = bins.iter().position(|n| {
                below += n;
                below > 0.0 && below >= PERCENTILE * all
            });
            bin.map_or(0.0, |bin| LEAST * RATIO.powi(bin as i32 + 1))
        });
        Common { speed, energetic_speed, excess }
    }

    /// Height of the fluid in cells along an axis.
    pub(crate) fn height(&self, axis: usize) -> usize {
        let (mut low, mut high) = (usize::MAX, 0);
        for slot in self.slots() {
            for (row, kinds) in self.kinds[slot].iter().enumerate() {
                for k in (0..EDGE).filter(|k| kinds.wet() >> k & 1 == 1) {
                    let at = self.links[slot].coordinates(row * EDGE + k)[axis];
                    low = low.min(at);
                    high = high.max(at + 1);
                }
            }
        }
        high.saturating_sub(low)
    }

    /// Gives interface cells the mass of their fill, after their densities were rescaled.
    pub(crate) fn reweigh(&mut self) {
        for (slot, cell) in self.interface_cells().collect::<Vec<_>>() {
            let excess: f64 = (0..Q).map(|i| self.front[slot][(i, cell)].to_f64()).sum();
            self.mass[slot][cell] = self.fills[slot][(0, cell)].to_f64() * (1.0 + excess);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LIMITS: Limits =
        Limits { lattice_viscosity: 1.0 / 6.0, lattice_speed: 0.1, hydrostatic_error: 0.02 };
    const LOOK: Look = Look { time: 0.0, speed: 1e-4, hydrostatic_error: 0.002, viscosity: 0.1, fall: 0.1 };

    #[test]
    fn a_step_grows_when_the_flow_has_been_slow_for_a_while() {
        let mut watch = Watch::default();
        assert_eq!(watch.change(&LOOK, 25.0, &LIMITS), None);
        assert_eq!(watch.change(&Look { time: 0.05, ..LOOK }, 25.0, &LIMITS), None);
        assert_eq!(watch.change(&Look { time: 0.1, ..LOOK }, 25.0, &LIMITS), Some(2.0));
        // No more than pressure and viscosity allow.
        let near = Look { time: 0.2, hydrostatic_error: 0.01, ..LOOK };
        assert!((watch.change(&near, 25.0, &LIMITS).unwrap() - 0.9 * 2f64.sqrt()).abs() < 1e-12);
        let viscous = Look { time: 0.3, viscosity: 0.5, ..LOOK };
        assert_eq!(watch.change(&viscous, 25.0, &LIMITS), Some(1.5));
        assert_eq!(watch.change(&Look { time: 0.4, viscosity: 0.7, ..LOOK }, 25.0, &LIMITS), None);
    }

    #[test]
    fn a_step_shrinks_at_once() {
        let mut watch = Watch::default();
        assert_eq!(watch.change(&Look { speed: 0.2, ..LOOK }, 25.0, &LIMITS), Some(0.45));
        // The fast flow is remembered for a while.
        assert_eq!(watch.change(&Look { time: 0.09, ..LOOK }, 50.0, &LIMITS), None);
    }
}
