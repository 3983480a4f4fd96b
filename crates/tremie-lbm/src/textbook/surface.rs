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
        let interface: Vec<usize> =
            (0..self.kinds.len()).filter(|cell| self.kinds[*cell] == Kind::Interface).collect();
        let (mut full, mut empty) = (Vec::new(), Vec::new());
        for &cell in &interface {
            let around: Vec<Kind> = self.around(cell).map(|beside| self.kinds[beside]).collect();
            let only = |kind: Kind| !around.is_empty() && around.iter().all(|k| *k == kind);
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
        for &cell in &full {
            for beside in self.around(cell).collect::<Vec<_>>() {
                if self.kinds[beside] == Kind::Air {
                    self.begin(beside);
                }
            }
        }
        for &cell in &empty {
            // The neighbour of a cell that has just filled up stays.
            if self.around(cell).any(|beside| full.contains(&beside)) {
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
        let takers: Vec<usize> =
            (0..self.kinds.len()).filter(|cell| self.kinds[*cell] == Kind::Interface).collect();
        for &cell in &takers {
            self.mass[cell] += left / takers.len() as f64;
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

    /// Air becomes interface without mass, in equilibrium with the fluid around.
    fn begin(&mut self, cell: usize) {
        let wet: Vec<Seen> = self
            .around(cell)
            .filter(|beside| self.kinds[*beside] != Kind::Air)
            .map(|beside| self.seen[beside])
            .collect();
        let share = 1.0 / wet.len() as f64;
        let density = share * wet.iter().map(|seen| seen.density).sum::<f64>();
        let velocity = [0, 1, 2].map(|a| share * wet.iter().map(|seen| seen.velocity[a]).sum::<f64>());
        self.front[cell] = equilibrium(&self.lattice, density, velocity);
        self.seen[cell] = Seen { density, velocity, ..Seen::default() };
        self.kinds[cell] = Kind::Interface;
        self.mass[cell] = 0.0;
    }
}
