//! Where fluid leaves.
//!
//! The cells of an outlet, a box or the last layer along an open side, never fill: what comes into one stays interface, at the pressure of the
//! air behind it, and what it holds beyond half a cell is taken out after each step.

use tremie_case::{Case, Side};

use crate::collision::density_and_momentum;
use crate::grid::Grid;
use crate::lattice::Q;
use crate::real::Real;
use crate::surface::Cell;
use crate::topology::{CELLS, EDGE};

/// Mass that stays in a cell of an outlet, in cells.
const LEFT: f64 = 0.5;

/// Mass and volume, in cells.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Amount {
    pub(crate) mass: f64,
    pub(crate) volume: f64,
}

/// The outlets of a case on a lattice of so many cells, each by its first cells and the ends along each axis.
pub(crate) fn outlets(case: &Case, cells: [usize; 3], size: f64) -> Vec<[[usize; 3]; 2]> {
    let boxed = |outlet: &tremie_case::Outlet| {
        let place = |n: f64| (n / size).round().max(0.0) as usize;
        let (min, max) = (outlet.min - case.domain.min, outlet.max - case.domain.min);
        let end = |a: usize| place(max[a]).min(cells[a]);
        [[0, 1, 2].map(|a| place(min[a]).min(cells[a])), [0, 1, 2].map(end)]
    };
    let open = |side: usize| {
        let (mut first, mut end) = ([0; 3], cells);
        match side % 2 {
            0 => end[side / 2] = 1,
            _ => first[side / 2] = cells[side / 2] - 1,
        }
        [first, end]
    };
    let sides = (0..6).filter(|side| case.domain.sides[*side] == Side::Open).map(open);
    case.outlets.iter().map(boxed).chain(sides).collect()
}

impl<T: Real> Grid<T> {
    /// Whether a cell belongs to an outlet.
    pub(crate) fn drains(&self, (slot, cell): Cell) -> bool {
        !self.topology.outlets.is_empty() && self.topology.drains(self.links[slot].coordinates(cell))
    }

    /// Takes out what has come into outlets: all of it, and of each of so many batches.
    pub(crate) fn drain(&mut self, batches: usize) -> Vec<Amount> {
        let mut out = vec![Amount::default(); 1 + batches];
        if self.topology.outlets.is_empty() {
            return out;
        }
        let near = |slot: &usize| {
            let first = self.links[*slot].coordinates(0);
            let meets = |[from, end]: &[[usize; 3]; 2]| {
                (0..3).all(|a| from[a] < first[a] + EDGE && first[a] < end[a])
            };
            self.topology.outlets.iter().any(meets)
        };
        let slots: Vec<usize> = self.slots().filter(near).collect();
        for slot in slots {
            for cell in 0..CELLS {
                if !self.is_interface((slot, cell)) || !self.drains((slot, cell)) {
                    continue;
                }
                let excess = self.mass[slot][cell] - LEFT;
                if excess > 0.0 {
                    let f: [T; Q] = std::array::from_fn(|i| self.front[slot][(i, cell)]);
                    let density = 1.0 + density_and_momentum(&f).0;
                    let shares = (0..batches).map(|batch| self.carried.mixed((slot, cell), batch));
                    for (out, share) in out.iter_mut().zip(std::iter::once(1.0).chain(shares)) {
                        out.mass += excess * share;
                        out.volume += excess / density * share;
                    }
                    self.mass[slot][cell] = LEFT;
                    self.fills[slot][(0, cell)] = T::from_f64(LEFT / density);
                }
            }
        }
        out
    }
}
