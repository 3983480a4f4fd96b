//! Stresses in which a body stands, before the clock starts.
//!
//! A body of yield-stress fluid that is stiff enough does not move at all when its mould is taken away. The hydrostatic
//! pressure it had in the mould then turns into stresses that are free of load on its sides. In the fluid that
//! costs no motion. On the lattice it does: below the yield stress it is an elastic body with bulk and shear moduli of
//! rho c_s^2, and on the way to these stresses it bulges by a share of the hydrostatic density error.
//!
//! So the way is gone with the surface held where it is, and with a brake on the motion (dynamic relaxation): if the fluid comes
//! to rest there, stresses in equilibrium with its weight exist that nowhere exceed the yield stress, and it stands (the
//! lower-bound theorem of limit analysis); it starts with them. If it does not come to rest, it flows, and starts with its
//! hydrostatic pressure. Where that is in equilibrium, as in a tank, nothing changes.
//!
//! It is tried only for bodies that might stand: a vertical bank is at most about 4 tau_y / (rho g) high (3.83 by Fellenius 1927).

use rayon::prelude::*;

use crate::collision::density_and_momentum;
use crate::grid::{Fill, Grid};
use crate::lattice::{C, Q, W};
use crate::real::Real;
use crate::topology::{CELLS, EDGE};

/// Height of a bank that might stand, in yield stresses over the specific weight.
const HIGHEST_BANK: f64 = 4.0;
/// Rest: the body would move by less than this, in cells, until sound has crossed its height.
const REST: f64 = 1e-3;
/// After so many crossings of the height it does not come to rest any more.
const PATIENCE: usize = 60;
/// Share of the velocity taken per step, times the height in cells: near the critical damping of a free-standing column, whose
/// lowest frequency is 1.36 over its height.
const BRAKE: f64 = 2.7;

/// What a braked relaxation is run with.
pub(crate) struct Braking {
    /// Steps between two looks, in which sound crosses the height.
    pub(crate) crossing: usize,
    /// Number of looks.
    pub(crate) patience: usize,
    /// Share of the velocity taken in a step.
    brake: f64,
    /// Speed in lattice units below which the body rests.
    pub(crate) rest: f64,
}

impl Braking {
    /// For fluid with the largest pressure `pressure` under the acceleration `gravity`, in lattice units; none if it cannot stand
    /// with the yield stress `yield_stress`, or need not.
    pub(crate) fn new(pressure: f64, gravity: f64, yield_stress: f64) -> Option<Self> {
        if pressure <= 0.0 || gravity <= 0.0 || HIGHEST_BANK * yield_stress < pressure {
            return None;
        }
        let height = (pressure / gravity).max(1.0);
        Some(Self {
            crossing: (3f64.sqrt() * height).ceil() as usize,
            patience: PATIENCE,
            brake: (BRAKE / height).min(0.5),
            rest: REST / (3f64.sqrt() * height),
        })
    }
}

/// The surface as it was.
pub(crate) struct Held<T> {
    fills: Vec<Box<Fill<T>>>,
    mass: Vec<[f64; CELLS]>,
}

impl<T: Real> Grid<T> {
    /// Largest pressure in lattice units.
    pub(crate) fn largest_pressure(&self) -> f64 {
        self.wet_cells().map(|(slot, cell)| self.excess_density(slot, cell) / 3.0).fold(0.0, f64::max)
    }

    /// The surface, to hold it.
    pub(crate) fn held(&self) -> Held<T> {
        Held { fills: self.fills.clone(), mass: self.mass.iter().map(|mass| **mass).collect() }
    }

    /// Puts the masses of the surface back, and takes away a share of the velocity.
    pub(crate) fn brake(&mut self, held: &Held<T>, gravity: [f64; 3], braking: &Braking) {
        let Self { front, mass, kinds, .. } = self;
        (front.par_iter_mut(), mass.par_iter_mut(), kinds.par_iter(), held.mass.par_iter())
            .into_par_iter()
            .for_each(|(front, mass, kinds, held)| {
                **mass = *held;
                for cell in (0..CELLS).filter(|cell| kinds[cell / EDGE].wet() >> (cell % EDGE) & 1 == 1) {
                    let f: [T; Q] = std::array::from_fn(|i| front[(i, cell)]);
                    let (excess, momentum) = density_and_momentum(&f);
                    let weighs = if kinds[cell / EDGE].interface >> (cell % EDGE) & 1 == 1 {
                        mass[cell].clamp(0.0, 1.0 + excess)
                    } else {
                        1.0 + excess
                    };
                    // After a collision the momentum is rho u + F/2.
                    let taken = [0, 1, 2].map(|a| braking.brake * (momentum[a] - 0.5 * weighs * gravity[a]));
                    for i in 1..Q {
                        let along: f64 = (0..3).map(|a| f64::from(C[i][a]) * taken[a]).sum();
                        front[(i, cell)] = T::from_f64(f[i].to_f64() - 3.0 * W[i] * along);
                    }
                }
            });
    }

    /// Gives the surface cells the fill they had, at their present density.
    pub(crate) fn put_back(&mut self, held: &Held<T>) {
        for (slot, cell) in self.interface_cells().collect::<Vec<_>>() {
            let fill = held.fills[slot][(0, cell)];
            self.fills[slot][(0, cell)] = fill;
            self.mass[slot][cell] = fill.to_f64() * (1.0 + self.excess_density(slot, cell));
        }
    }

    fn excess_density(&self, slot: usize, cell: usize) -> f64 {
        (0..Q).map(|i| self.front[slot][(i, cell)].to_f64()).sum()
    }

    fn wet_cells(&self) -> impl Iterator<Item = (usize, usize)> + '_ {
        self.slots().flat_map(move |slot| {
            (0..CELLS)
                .filter(move |cell| self.kinds[slot][cell / EDGE].wet() >> (cell % EDGE) & 1 == 1)
                .map(move |cell| (slot, cell))
        })
    }
}
