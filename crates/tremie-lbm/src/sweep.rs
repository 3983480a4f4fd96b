//! Cells that solids cover and uncover as they move.
//!
//! The flow past a moving wall takes the volume that the wall sweeps: with the bounce-back of `contact`, a wall that advances presses mass into
//! the liquid beside it, and one that recedes takes mass out, continuously, as much as the volume it sweeps. By the time a wall has come on by a
//! cell, it has pressed in the mass of a cell, and covers a cell of liquid: that goes. And it has taken out the mass of a cell when it
//! uncovers one, which is filled. So no pressure jumps, and what the walls hold for the time being ([`Ledger::swept`]) is what lies
//! between them and the faces of the cells beside them: up to half a cell, or as much less than nothing, for each cell of their surface. Where the surface of the fluid meets them other mass may gather; that goes back
//! to the interface little by little.
//!
//! - An interface cell is full once it holds what there is between its far side and a wall that comes on along the lattice, up to half a cell more or less than 1. When it is covered it
//!   leaves its mass to the cell that the wall drives it into, which is interface then, too, or else to the interface beside it.
//! - An uncovered cell is liquid if it touches liquid and no air, interface if it touches both, and else air. As interface it holds what the
//!   liquid beside it has paid. If that owes more than a quarter of it, because a wall has drawn away from it (module `contact`), the cell is
//!   interface too and holds nothing: a gap that air has come into.
//!
//! Blocks exist where a solid reaches into the surroundings of fluid, so that it is seen there.

use crate::collision::density_and_momentum;
use crate::grid::Grid;
use crate::lattice::{C, Q, W, opposite};
use crate::real::Real;
use crate::surface::{Cell, Ledger};
use crate::topology::{AIR, CELLS, EDGE, ROWS};

/// Share of an uncovered cell that the liquid beside it has to owe for a gap to be there. (A wall between two cells
/// uncovers the next after half a cell.)
const GAP: f64 = 0.25;

impl<T: Real> Grid<T> {
    /// Covers and uncovers cells as the solids are at the time `time` in s.
    pub(crate) fn sweep(&mut self, time: f64, ledger: &mut Ledger) {
        if !self.solids.any() {
            return;
        }
        self.surround();
        let (covered, uncovered) = self.changes(time);
        if covered.is_empty() && uncovered.is_empty() {
            return;
        }
        let mut left: Vec<(Cell, f64)> = Vec::new();
        let mut stores: Vec<(Cell, f64)> = Vec::new();
        for &cell in &covered {
            if self.is_liquid(cell) {
                let store = self.mass[cell.0][cell.1];
                ledger.swept += self.liquid_mass(cell) - store;
                stores.push((cell, store));
            } else if self.is_interface(cell) {
                left.push((cell, self.mass[cell.0][cell.1]));
            }
            self.set_kind(cell, false, false);
            self.set_solid(cell, true);
        }
        self.uncover(&uncovered, ledger);
        for (cell, mass) in left {
            match self.ahead(cell, &covered) {
                Some(taker) => {
                    let (fill, held) = match self.is_liquid(taker) {
                        true => (T::ONE, self.liquid_mass(taker)),
                        false => (self.fills[taker.0][(0, taker.1)], self.mass[taker.0][taker.1]),
                    };
                    self.take_along(cell, &[taker], mass);
                    if self.is_liquid(taker) {
                        self.begin_borne(&[taker]);
                    }
                    self.set_interface(taker, held + mass, fill);
                }
                None => self.hand_out(cell, mass, ledger),
            }
        }
        // Liquid that has left the wall.
        let mut parted: Vec<Cell> =
            uncovered.iter().flat_map(|cell| self.around(*cell).map(|(beside, _)| beside)).collect();
        parted.sort_unstable();
        parted.dedup();
        for cell in parted {
            if self.is_liquid(cell) && self.mass[cell.0][cell.1] != 0.0 && !self.touches_solid(cell) {
                stores.push((cell, std::mem::take(&mut self.mass[cell.0][cell.1])));
            }
        }
        for (cell, store) in stores {
            self.leave_store(cell, store, ledger);
        }
    }

    /// The wet cell that a wall along the lattice drives what a covered cell held into, away from the solid; `covered` are all, in order.
    fn ahead(&self, cell: Cell, covered: &[Cell]) -> Option<Cell> {
        // The velocities along axes come first.
        let around: Vec<Cell> = self.around(cell).take(6).map(|(beside, _)| beside).collect();
        let was_solid = |cell: &Cell| self.is_solid(*cell) && covered.binary_search(cell).is_err();
        let mut onward = (0..6).filter(|n| was_solid(&around[n ^ 1])).map(|n| around[n]);
        let ahead = onward.next().filter(|cell| self.is_liquid(*cell) || self.is_interface(*cell))?;
        onward.next().is_none().then_some(ahead)
    }

    /// Marks the solid cells of the first state.
    pub(crate) fn place_solids(&mut self) {
        if !self.solids.any() {
            return;
        }
        let slots: Vec<usize> = self.slots().collect();
        for slot in slots {
            self.surround_block(slot);
        }
        self.mark_solids(0.0);
    }

    /// Marks the solid cells of blocks without fluid that are new at the time `time` in s.
    pub(crate) fn mark_solids(&mut self, time: f64) {
        for cell in self.changes(time).0 {
            self.set_solid(cell, true);
        }
    }

    /// Allocates the blocks beside fluid that solids reach into.
    fn surround(&mut self) {
        let wet: Vec<usize> =
            self.slots().filter(|slot| self.kinds[*slot].iter().any(|kinds| kinds.wet() != 0)).collect();
        for slot in wet {
            self.surround_block(slot);
        }
    }

    fn surround_block(&mut self, slot: usize) {
        for n in 0..27 {
            if self.links[slot].slots[n] != AIR {
                continue;
            }
            let offset = [(n % 3) as i32 - 1, (n / 3 % 3) as i32 - 1, (n / 9) as i32 - 1];
            let place = self.links[slot].place.map(|p| p as usize);
            if let Some(place) = self.topology.beside(place, offset)
                && self.solids.reach(place.map(|p| p * EDGE), EDGE)
            {
                self.allocate(place);
            }
        }
    }

    /// Cells that are to be covered, and to be uncovered, in the order of their slots.
    fn changes(&mut self, time: f64) -> (Vec<Cell>, Vec<Cell>) {
        let (mut covered, mut uncovered) = (Vec::new(), Vec::new());
        let slots: Vec<usize> = self.slots().collect();
        for slot in slots {
            let place = self.links[slot].place.map(|p| p as usize);
            let last = [0, 1, 2].map(|a| self.topology.last(place[a], a));
            for row in 0..ROWS {
                let (y, z) = (row % EDGE, row / EDGE);
                if y > last[1] || z > last[2] || !self.solids.due(slot, row, time) {
                    continue;
                }
                let at = [place[0] * EDGE, place[1] * EDGE + y, place[2] * EDGE + z];
                let now = self.solids.covered(slot, row, at, last[0] + 1, time);
                let before = self.kinds[slot][row].immersed;
                let cells = |bits: u8| {
                    (0..EDGE).filter(move |k| bits >> k & 1 == 1).map(move |k| (slot, row * EDGE + k))
                };
                covered.extend(cells(now & !before));
                uncovered.extend(cells(before & !now));
            }
        }
        (covered, uncovered)
    }

    fn set_solid(&mut self, (slot, cell): Cell, solid: bool) {
        let bit = 1u8 << (cell % EDGE);
        let kinds = &mut self.kinds[slot][cell / EDGE];
        for bits in [&mut kinds.solid, &mut kinds.immersed] {
            *bits = *bits & !bit | if solid { bit } else { 0 };
        }
        self.touch(slot, cell);
    }

    fn uncover(&mut self, uncovered: &[Cell], ledger: &mut Ledger) {
        let (mut liquid, mut interface) = (Vec::new(), Vec::new());
        let debts = self.debts(uncovered);
        let (mut gaps, mut owing) = (Vec::new(), Vec::new());
        for (&cell, debt) in uncovered.iter().zip(&debts) {
            let around: Vec<Cell> = self.around(cell).map(|(beside, _)| beside).collect();
            let wet = around.iter().any(|beside| self.is_liquid(*beside));
            // What is uncovered in an outlet never fills.
            let air = self.drains(cell) || around.iter().any(|beside| self.is_air(*beside));
            match (wet, air) {
                (true, false) if debt.iter().map(|(_, owed)| owed).sum::<f64>() > GAP => {
                    gaps.push(cell);
                    owing.push(debt);
                }
                (true, false) => liquid.push(cell),
                (true, true) => interface.push(cell),
                (false, false) if around.iter().any(|beside| self.is_interface(*beside)) => {
                    interface.push(cell);
                }
                _ => {}
            }
        }
        let fresh = |grid: &Self, cells: &[Cell]| -> Vec<[T; Q]> {
            cells.iter().map(|cell| grid.mean_equilibrium(*cell)).collect()
        };
        let (full, empty, open) = (fresh(self, &liquid), fresh(self, &interface), fresh(self, &gaps));
        let shares: Vec<f64> = interface.iter().map(|cell| self.paid(*cell)).collect();
        self.begin_borne(&[&interface[..], &gaps].concat());
        for &cell in uncovered {
            self.set_solid(cell, false);
        }
        for (cell, f) in liquid.iter().zip(&full) {
            self.set_populations(*cell, f);
            self.set_kind(*cell, true, false);
            ledger.swept -= 1.0 + density_and_momentum(f).0;
        }
        for ((cell, f), share) in interface.iter().zip(&empty).zip(shares) {
            self.set_populations(*cell, f);
            self.set_interface(*cell, share, T::from_f64(share));
            ledger.swept -= share;
        }
        for ((cell, f), debt) in gaps.iter().zip(&open).zip(owing) {
            // The wall has not got what it should have taken, and nothing has come after it.
            for ((slot, at), owed) in debt {
                self.mass[*slot][*at] += owed;
                ledger.swept -= owed;
            }
            self.set_populations(*cell, f);
            self.set_interface(*cell, 0.0, T::ZERO);
        }
        // Liquid never touches air.
        for &(slot, cell) in &liquid {
            self.allocate_around(slot, cell);
        }
        let mut wetted: Vec<Cell> = liquid
            .iter()
            .flat_map(|cell| self.around(*cell).map(|(beside, _)| beside).collect::<Vec<_>>())
            .filter(|beside| self.is_air(*beside))
            .collect();
        wetted.sort_unstable();
        wetted.dedup();
        let fresh = fresh(self, &wetted);
        self.begin_borne(&wetted);
        for (cell, f) in wetted.iter().zip(&fresh) {
            self.set_populations(*cell, f);
            self.set_interface(*cell, 0.0, T::ZERO);
        }
    }

    /// What the liquid around each uncovered cell owes it: the debts of its stores, in equal parts to all uncovered cells beside it.
    fn debts(&self, uncovered: &[Cell]) -> Vec<Vec<(Cell, f64)>> {
        let liquid = |cell: &Cell| -> Vec<Cell> {
            self.around(*cell).map(|(beside, _)| beside).filter(|beside| self.is_liquid(*beside)).collect()
        };
        let beside: Vec<Vec<Cell>> = uncovered.iter().map(liquid).collect();
        let mut claims = beside.concat();
        claims.sort_unstable();
        let number = |cell: Cell| {
            claims.partition_point(|claim| *claim <= cell) - claims.partition_point(|claim| *claim < cell)
        };
        let owed = |cell: &Cell| (*cell, -self.mass[cell.0][cell.1] / number(*cell) as f64);
        beside.iter().map(|cells| cells.iter().map(owed).collect()).collect()
    }

    /// Share of the links into an uncovered cell through which liquid has paid for it.
    fn paid(&self, cell: Cell) -> f64 {
        let (mut liquid, mut all) = (0.0, 0.0);
        for (i, (beside, _)) in (1..Q).zip(self.around(cell)) {
            if self.is_liquid(beside) {
                liquid += W[i];
            }
            if self.is_liquid(beside) || self.is_interface(beside) || self.is_air(beside) {
                all += W[i];
            }
        }
        liquid / all
    }

    /// Volume in cells between walls that move and the liquid beside them (`tremie_geometry::Body::left_in_column`).
    pub(crate) fn left_by_walls(&self) -> f64 {
        if !self.solids.any_moves() {
            return 0.0;
        }
        let has_solid = |slot: usize| self.kinds[slot].iter().any(|kinds| kinds.immersed != 0);
        let immersed: Vec<bool> = (0..self.kinds.len()).map(has_solid).collect();
        let near = |slot: &usize| self.links[*slot].slots.iter().any(|beside| immersed[*beside as usize]);
        let liquid =
            |slot: usize| (0..CELLS).map(move |cell| (slot, cell)).filter(|cell| self.is_liquid(*cell));
        self.slots().filter(near).flat_map(liquid).map(|cell| self.left_beside(cell)).sum()
    }

    /// The same beside one cell.
    pub(crate) fn left_beside(&self, (slot, cell): Cell) -> f64 {
        // The velocities along axes come first, and what comes in by i comes from the cell against it.
        let left = |i: usize| {
            let (beside, at, _) = self.links[slot].cell(cell, C[opposite(i)]);
            match self.kinds[beside as usize][at / EDGE].immersed >> (at % EDGE) & 1 == 1 {
                true => self.solids.left_in_column(self.links[slot].coordinates(cell), i),
                false => 0.0,
            }
        };
        (1..=6).map(left).sum()
    }

    /// Whether liquid touches a solid.
    pub(crate) fn solids_touch_liquid(&self) -> bool {
        self.slots().any(|slot| {
            (0..ROWS * EDGE).any(|cell| self.is_liquid((slot, cell)) && self.touches_solid((slot, cell)))
        })
    }
}
