//! Cells that fill up or run dry, as the thesis has it (Svec 2013, 2.2.2).
//!
//! An interface cell becomes liquid when its mass reaches its density and air when it has none left; then air beside liquid, and liquid
//! beside air, become interface. What a cell holds beyond its density, or lacks, is shared evenly by all interface cells. So is
//! that of artefacts: interface cells that have only liquid, or only air, around them.

use super::collision::equilibrium;
use super::{Dense, From, Seen};

/// What a cell holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub(super) enum Kind {
    Air,
    Interface,
    Liquid,
}

impl Kind {
    /// The kind of this number.
    pub(super) fn of(number: u8) -> Option<Self> {
        [Self::Air, Self::Interface, Self::Liquid].into_iter().find(|kind| *kind as u8 == number)
    }
}

impl<const Q: usize> Dense<Q> {
    /// Turns cells that are full or empty into what they have become.
    pub(super) fn convert(&mut self) {
        let (mut full, mut empty) = (Vec::new(), Vec::new());
        for &cell in &self.interface {
            let only = |kind: Kind| self.around(cell).all(|beside| self.kinds[beside] == kind);
            if self.mass[cell] >= self.seen[cell].density || only(Kind::Liquid) {
                full.push(cell);
            } else if self.mass[cell] <= 0.0 || only(Kind::Air) {
                empty.push(cell);
            }
        }
        if full.is_empty() && empty.is_empty() {
            return;
        }
        let mut left = 0.0;
        for &cell in &full {
            left += self.mass[cell] - self.seen[cell].density;
            self.kinds[cell] = Kind::Liquid;
            self.mass[cell] = self.seen[cell].density;
        }
        // All begin from what was there before, whichever comes first.
        let air = |cell: &usize| self.kinds[*cell] == Kind::Air;
        let mut begun: Vec<usize> = full.iter().flat_map(|cell| self.around(*cell)).filter(air).collect();
        begun.sort_unstable();
        begun.dedup();
        let states: Vec<Seen> = begun.iter().map(|cell| self.mean_around(*cell)).collect();
        for (cell, seen) in begun.into_iter().zip(states) {
            self.front[cell] = equilibrium(&self.lattice, seen.density, seen.velocity);
            self.seen[cell] = seen;
            self.kinds[cell] = Kind::Interface;
            self.mass[cell] = 0.0;
        }
        for &cell in &empty {
            // The neighbour of a cell that has just filled up stays.
            if self.around(cell).any(|beside| full.binary_search(&beside).is_ok()) {
                continue;
            }
            left += self.mass[cell];
            self.kinds[cell] = Kind::Air;
            self.mass[cell] = 0.0;
            for beside in self.around(cell).collect::<Vec<_>>() {
                if self.kinds[beside] == Kind::Liquid {
                    self.kinds[beside] = Kind::Interface;
                    self.mass[beside] = self.seen[beside].density;
                }
            }
        }
        self.list();
        for cell in &self.interface {
            self.mass[*cell] += left / self.interface.len() as f64;
        }
    }

    /// Cells that a cell has links with, itself and mirror images left out.
    fn around(&self, cell: usize) -> impl Iterator<Item = usize> + '_ {
        let at = self.place(cell);
        (1..Q).filter_map(move |i| match self.from(at, i) {
            From::Cell(beside, _) if beside != cell => Some(beside),
            _ => None,
        })
    }

    /// Mean density and velocity of the fluid around a cell.
    fn mean_around(&self, cell: usize) -> Seen {
        let wet = || self.around(cell).filter(|beside| self.kinds[*beside] != Kind::Air);
        let share = 1.0 / wet().count() as f64;
        let mean =
            |of: &dyn Fn(&Seen) -> f64| share * wet().map(|beside| of(&self.seen[beside])).sum::<f64>();
        let velocity = [0, 1, 2].map(|a| mean(&|seen| seen.velocity[a]));
        Seen { density: mean(&|seen| seen.density), velocity, ..Seen::default() }
    }
}
