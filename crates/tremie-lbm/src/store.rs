//! The stores of liquid cells at solids (module `contact`): what a solid has taken from a cell, other than by its motion, and owes it.
//!
//! On a staircase the debts of some cells are the credits of others a few cells on. Stores beside each other even out, which meets
//! both; what is left over is put back into the cells so slowly ([`crate::contact`]) that it does not see the steps. A cell that
//! leaves the wall leaves its store to those at the wall beside it.

use rayon::prelude::*;

use crate::grid::{AT_ONCE, Grid};
use crate::lattice::{C, Q};
use crate::real::Real;
use crate::rows::Rows;
use crate::surface::{Cell, Ledger};
use crate::topology::{CELLS, EDGE, ROWS};

/// Share of the difference to each of up to 18 stores around that is made up for at once.
const EVENED: f64 = 1.0 / 18.0;

impl<T: Real> Grid<T> {
    /// Lets stores beside each other even out.
    pub(crate) fn even_stores(&mut self, rows: &[Rows]) {
        let walls: Vec<[u8; ROWS]> = rows
            .iter()
            .map(|rows| {
                let mut bits = [0; ROWS];
                for row in &rows.surface {
                    bits[usize::from(row.row)] = row.any_immersed & row.kinds.liquid;
                }
                bits
            })
            .collect();
        let at_wall = |slot: usize, cell: usize| walls[slot][cell / EDGE] >> (cell % EDGE) & 1 == 1;
        let Self { links, mass, .. } = self;
        let change = |slot: usize| -> Vec<(usize, f64)> {
            let cells = (0..CELLS).filter(|cell| at_wall(slot, *cell));
            cells
                .map(|cell| {
                    let own = mass[slot][cell];
                    let around = (1..Q).map(|i| links[slot].cell(cell, C[i]));
                    let flows = around
                        .filter(|(beside, at, _)| at_wall(*beside as usize, *at))
                        .map(|(beside, at, _)| mass[beside as usize][at] - own);
                    (cell, EVENED * flows.sum::<f64>())
                })
                .collect()
        };
        let holds_any = |slot: usize, row: usize| {
            (0..EDGE).any(|k| walls[slot][row] >> k & 1 == 1 && mass[slot][EDGE * row + k] != 0.0)
        };
        let holds: Vec<bool> = (0..walls.len())
            .map(|slot| (0..ROWS).any(|row| walls[slot][row] != 0 && holds_any(slot, row)))
            .collect();
        let near = |slot: &usize| links[*slot].slots.iter().any(|beside| holds[*beside as usize]);
        let slots: Vec<usize> =
            (0..walls.len()).filter(|slot| walls[*slot] != [0; ROWS]).filter(near).collect();
        let changes: Vec<Vec<(usize, f64)>> =
            slots.par_iter().with_max_len(AT_ONCE).map(|slot| change(*slot)).collect();
        for (slot, changes) in slots.into_iter().zip(changes) {
            for (cell, change) in changes {
                self.mass[slot][cell] += change;
            }
        }
    }

    /// Whether a cell touches a solid.
    pub(crate) fn touches_solid(&self, (slot, cell): Cell) -> bool {
        (1..Q).any(|i| {
            let (beside, at, _) = self.links[slot].cell(cell, C[i]);
            self.kinds[beside as usize][at / EDGE].immersed >> (at % EDGE) & 1 == 1
        })
    }

    /// Leaves a store in equal shares to the liquid at the wall beside a cell, or else to the interface.
    pub(crate) fn leave_store(&mut self, cell: Cell, store: f64, ledger: &mut Ledger) {
        let takers: Vec<Cell> = self
            .around(cell)
            .map(|(beside, _)| beside)
            .filter(|beside| self.is_liquid(*beside) && self.touches_solid(*beside))
            .collect();
        if takers.is_empty() {
            return self.hand_out(cell, store, ledger);
        }
        let share = store / takers.len() as f64;
        for (slot, cell) in takers {
            self.mass[slot][cell] += share;
        }
    }
}
