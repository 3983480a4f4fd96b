//! The free surface between steps: interface cells that fill up or run dry.
//!
//! A step only *proposes* ([`Findings`]). Here the proposals of all blocks are *resolved* against each other, new
//! interface cells are *initialised* from what is around them, and all is *committed*; each stage sees the state the
//! stage before left, so the order of cells does not matter. The work is proportional to the number of conversions.
//!
//! - A full cell becomes liquid; air beside it becomes interface.
//! - An empty cell becomes air, unless a cell beside it has just become liquid; liquid beside it becomes interface.
//! - A new interface cell starts at equilibrium with the mean density and velocity of the fluid beside it (Schwarzmeier
//!   and Ruede 2022), but what it first sends into that fluid is what the air would have sent. Otherwise the fluid feels a blow, by as much as its stress is;
//!   and where it does not yield it rings, by which cells beside it come and go, so that it rings for ever: by a few mm/s on coarse cells.
//! - What a converted cell has too much or too little goes evenly to the interface cells beside it; under a wall that comes on it lies between the cell and the wall
//!   (module `sweep`). Where there are
//!   none (a bubble closes, a crumb dries up), it goes to the nearest interface cell: never dropped, and counted.
//! - Air that an interface cell on a wall flows into through a wet face becomes interface (`stream`), so that a film thinner than
//!   a cell, which never fills one, moves on.
//! - Crumbs, interface cells that touch neither liquid nor an interface cell that touches liquid, and do not lie on a wall with a face, would fall
//!   freely where they are, ever faster; they are taken up by the nearest interface cell. A mirror on which they weigh is a wall: films without liquid lie on floors without friction, too.

use tremie_numerics::DVec3;

use crate::collision::{density_and_momentum, equilibrium};
use crate::grid::{Grid, Kinds};
use crate::lattice::{C, MIRROR, Q, W, opposite, vector};
use crate::outlet::Amount;
use crate::real::Real;
use crate::stream::Findings;
use crate::topology::{AIR, CELLS, EDGE, OUTSIDE, ROWS};

/// A cell: its block's slot and its number there.
pub(crate) type Cell = (usize, usize);

/// What was done to keep every bit of mass, since the start.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Ledger {
    /// Events in which mass had no interface beside it and went to the nearest one.
    pub(crate) stranded: u64,
    /// Mass that has nowhere to go at present, because there is no interface at all.
    pub(crate) waiting: f64,
    /// Mass that the walls of solids have taken by their motion and not given back yet (module `sweep`).
    pub(crate) swept: f64,
    /// Mass that has come in (module `inlet`).
    pub(crate) poured: f64,
    /// What has left (module `outlet`).
    pub(crate) drained: Amount,
    /// How much of that was of each batch.
    pub(crate) drained_of: Vec<Amount>,
    /// Mass given to the fluid, or taken from it, so that it keeps its volume.
    pub(crate) pressed: f64,
}

/// By how much the density is more than 1, and the velocity without half of the force.
fn density_and_velocity<T: Real>(f: &[T; Q]) -> (f64, DVec3) {
    let (excess, momentum) = density_and_momentum(f);
    (excess, DVec3::from(momentum) / (1.0 + excess))
}

impl<T: Real> Grid<T> {
    fn kind(&self, (slot, cell): Cell) -> (Kinds, u8) {
        (self.kinds[slot][cell / EDGE], 1 << (cell % EDGE))
    }

    pub(crate) fn is_interface(&self, cell: Cell) -> bool {
        let (kinds, bit) = self.kind(cell);
        kinds.interface & bit != 0
    }

    pub(crate) fn is_liquid(&self, cell: Cell) -> bool {
        let (kinds, bit) = self.kind(cell);
        kinds.liquid & bit != 0
    }

    pub(crate) fn is_air(&self, cell: Cell) -> bool {
        let (kinds, bit) = self.kind(cell);
        kinds.air() & bit != 0
    }

    /// Whether a cell lies in the domain.
    fn inside(&self, (slot, cell): Cell) -> bool {
        let at = self.links[slot].coordinates(cell);
        slot > OUTSIDE as usize && (0..3).all(|a| at[a] < self.topology.cells[a])
    }

    pub(crate) fn is_solid(&self, cell: Cell) -> bool {
        let (kinds, bit) = self.kind(cell);
        kinds.solid & bit != 0
    }

    pub(crate) fn set_populations(&mut self, (slot, cell): Cell, f: &[T; Q]) {
        for i in 0..Q {
            self.front[slot][(i, cell)] = f[i];
        }
    }

    pub(crate) fn set_kind(&mut self, (slot, cell): Cell, liquid: bool, interface: bool) {
        let bit = 1u8 << (cell % EDGE);
        self.mass[slot][cell] = 0.0;
        let kinds = &mut self.kinds[slot][cell / EDGE];
        let before = kinds.wet() & bit != 0;
        self.wet = self.wet + usize::from(liquid || interface) - usize::from(before);
        if self.carried.any() && !before && (liquid || interface) {
            self.begin_values((slot, cell));
        }
        let kinds = &mut self.kinds[slot][cell / EDGE];
        kinds.liquid = kinds.liquid & !bit | if liquid { bit } else { 0 };
        kinds.interface = kinds.interface & !bit | if interface { bit } else { 0 };
        self.fills[slot][(0, cell)] = if liquid { T::ONE } else { T::ZERO };
        self.touch(slot, cell);
    }

    fn populations(&self, (slot, cell): Cell) -> [T; Q] {
        std::array::from_fn(|i| self.front[slot][(i, cell)])
    }

    /// The cells around a cell, with the mirrors crossed; a cell seen twice, directly and in a mirror, comes twice.
    pub(crate) fn around(&self, (slot, cell): Cell) -> impl Iterator<Item = (Cell, u8)> + '_ {
        let links = &self.links[slot];
        (1..Q).map(move |i| {
            let (slot, cell, flip) = links.cell(cell, C[i]);
            ((slot as usize, cell), flip)
        })
    }

    /// Mass of a liquid cell: its density and its store.
    pub(crate) fn liquid_mass(&self, cell: Cell) -> f64 {
        1.0 + density_and_momentum(&self.populations(cell)).0 + self.mass[cell.0][cell.1]
    }

    /// Resolves and commits what a step proposed.
    pub(crate) fn convert(&mut self, findings: &[Findings], ledger: &mut Ledger) {
        let cells_of = |pick: fn(&Findings) -> &[u8; ROWS]| -> Vec<Cell> {
            let mut cells = Vec::new();
            for slot in self.slots().filter(|slot| findings[*slot].any) {
                for (row, bits) in pick(&findings[slot]).iter().enumerate() {
                    cells.extend((0..EDGE).filter(|k| bits >> k & 1 == 1).map(|k| (slot, row * EDGE + k)));
                }
            }
            cells
        };
        let mut full = cells_of(|found| &found.full);
        full.retain(|cell| !self.drains(*cell));
        let mut empty = cells_of(|found| &found.empty);
        let reached: Vec<(Cell, usize)> = self
            .slots()
            .filter(|slot| findings[*slot].any)
            .flat_map(|slot| findings[slot].reached.iter().map(move |(cell, i)| ((slot, *cell), *i)))
            .collect();
        if full.is_empty() && empty.is_empty() && reached.is_empty() {
            return;
        }
        // An empty cell beside one that has just filled stays, or the new liquid would touch air.
        let fills = |(slot, cell): Cell| {
            slot < findings.len()
                && findings[slot].any
                && findings[slot].full[cell / EDGE] >> (cell % EDGE) & 1 == 1
        };
        empty.retain(|cell| !self.around(*cell).any(|(beside, _)| fills(beside)));

        for &(slot, cell) in full.iter().chain(reached.iter().map(|(film, _)| film)) {
            self.allocate_around(slot, cell);
        }
        let mut wetted: Vec<Cell> = Vec::new();
        for &cell in &full {
            wetted.extend(self.around(cell).map(|(beside, _)| beside).filter(|beside| self.is_air(*beside)));
        }
        for &((slot, cell), i) in &reached {
            let (beside, at, _) = self.links[slot].cell(cell, C[i].map(|c| -c));
            // Beyond an open side there is air that never becomes anything else.
            if self.inside((beside as usize, at)) {
                wetted.push((beside as usize, at));
            }
        }
        let mut drained: Vec<Cell> = Vec::new();
        for &cell in &empty {
            drained
                .extend(self.around(cell).map(|(beside, _)| beside).filter(|beside| self.is_liquid(*beside)));
        }
        for list in [&mut wetted, &mut drained] {
            list.sort_unstable();
            list.dedup();
        }

        let fresh: Vec<[T; Q]> = wetted.iter().map(|cell| self.wetted(*cell)).collect();
        self.begin_borne(&[&wetted[..], &drained].concat());
        for &cell in &drained {
            let mass = self.liquid_mass(cell);
            self.set_interface(cell, mass, T::ONE);
        }
        for (&cell, fresh) in wetted.iter().zip(&fresh) {
            self.set_populations(cell, fresh);
            self.set_interface(cell, 0.0, T::ZERO);
        }
        let mut excess: Vec<(Cell, f64)> = Vec::with_capacity(full.len() + empty.len());
        for &cell in &full {
            let held = self.mass[cell.0][cell.1];
            self.set_kind(cell, true, false);
            let more = held - self.liquid_mass(cell);
            match findings[cell.0].pressed.contains(&cell.1) {
                true => ledger.swept += more,
                false => excess.push((cell, more)),
            }
        }
        for &cell in &empty {
            excess.push((cell, self.mass[cell.0][cell.1]));
            self.set_kind(cell, false, false);
        }
        for (cell, excess) in excess {
            self.hand_out(cell, excess, ledger);
        }
    }

    pub(crate) fn set_interface(&mut self, cell: Cell, mass: f64, fill: T) {
        self.set_kind(cell, false, true);
        self.mass[cell.0][cell.1] = mass;
        self.fills[cell.0][(0, cell.1)] = fill;
    }

    /// Makes sure that blocks exist for all neighbours of a cell.
    pub(crate) fn allocate_around(&mut self, slot: usize, cell: usize) {
        let at = [cell % EDGE, cell / EDGE % EDGE, cell / ROWS];
        if at.iter().all(|x| (1..EDGE - 1).contains(x)) {
            return;
        }
        for i in 1..Q {
            let (beside, ..) = self.links[slot].cell(cell, C[i]);
            if beside != AIR {
                continue;
            }
            // Absent blocks are found by coordinates; mirrors and walls lead to blocks that exist.
            let offset = [0, 1, 2].map(|a| {
                let step = self.links[slot].steps[a][(at[a] as i32 + C[i][a] + 1) as usize];
                i32::from(step.block) - 1
            });
            let place = self.links[slot].place.map(|p| p as usize);
            if let Some(place) = self.topology.beside(place, offset) {
                self.allocate(place);
            }
        }
    }

    /// The fluid beside a cell: where its cells lie, they, and their populations as they are seen from there.
    fn fluid_around(&self, cell: Cell) -> impl Iterator<Item = (usize, Cell, [T; Q])> + '_ {
        (1..Q).zip(self.around(cell)).filter_map(|(i, (beside, flip))| {
            let (kinds, bit) = self.kind(beside);
            (kinds.wet() & bit != 0).then(|| {
                let f = self.populations(beside);
                (i, beside, std::array::from_fn(|i| f[usize::from(MIRROR[usize::from(flip)][i])]))
            })
        })
    }

    /// Equilibrium at the mean density and velocity of the fluid beside a cell.
    pub(crate) fn mean_equilibrium(&self, cell: Cell) -> [T; Q] {
        let (mut n, mut density, mut velocity) = (0.0, 0.0, DVec3::ZERO);
        for (.., f) in self.fluid_around(cell) {
            let (excess, u) = density_and_velocity(&f);
            n += 1.0;
            density += excess;
            velocity += u;
        }
        equilibrium(density / n, (velocity / n).to_array())
    }

    /// What air begins with that becomes interface: the same, but for what goes into the fluid beside it, which is what the air has sent there
    /// (module `stream`).
    fn wetted(&self, cell: Cell) -> [T; Q] {
        let mut f = self.mean_equilibrium(cell);
        for (i, (slot, beside), left) in self.fluid_around(cell) {
            let (_, u) = density_and_velocity(&left);
            let excess = self.tension.as_ref().and_then(|tension| tension.excess(slot));
            let pressed = excess.map_or(0.0, |excess| excess[(0, beside)].to_f64());
            let both = W[i] * (9.0 * vector(i).dot(u).powi(2) - 3.0 * u.length_squared() + 2.0 * pressed);
            f[i] = T::from_f64(both) - left[opposite(i)];
        }
        f
    }

    /// Gives mass in equal shares to the interface beside a cell, or else to the nearest.
    pub(crate) fn hand_out(&mut self, cell: Cell, mass: f64, ledger: &mut Ledger) {
        let takers: Vec<Cell> =
            self.around(cell).map(|(beside, _)| beside).filter(|beside| self.is_interface(*beside)).collect();
        if takers.is_empty() {
            self.strand(cell, mass, ledger);
            return;
        }
        let share = mass / takers.len() as f64;
        self.take_along(cell, &takers, share);
        for (slot, cell) in takers {
            self.mass[slot][cell] += share;
        }
    }

    /// Lets mass take along what it carries from a cell to each of others.
    pub(crate) fn take_along(&mut self, from: Cell, takers: &[Cell], share: f64) {
        if self.carried.any() {
            let alive = self.is_liquid(from) || self.is_interface(from);
            self.carried.hand_out(from, takers, share, alive);
        }
    }

    /// Gives mass to the nearest interface cell, in equal shares if several are equally near.
    fn strand(&mut self, from: Cell, mass: f64, ledger: &mut Ledger) {
        ledger.stranded += 1;
        let origin = self.links[from.0].coordinates(from.1);
        let (mut nearest, mut least) = (Vec::new(), usize::MAX);
        for cell in self.interface_cells().filter(|cell| *cell != from) {
            let at = self.links[cell.0].coordinates(cell.1);
            let distance = (0..3).map(|a| at[a].abs_diff(origin[a]).pow(2)).sum();
            if distance < least {
                nearest.clear();
                least = distance;
            }
            if distance == least {
                nearest.push(cell);
            }
        }
        if nearest.is_empty() {
            ledger.waiting += mass;
        }
        let share = mass / nearest.len() as f64;
        self.take_along(from, &nearest, share);
        for (slot, cell) in nearest {
            self.mass[slot][cell] += share;
        }
    }

    /// All interface cells, in the order of their slots.
    pub(crate) fn interface_cells(&self) -> impl Iterator<Item = Cell> + '_ {
        self.slots().flat_map(move |slot| {
            (0..CELLS).filter(move |cell| self.is_interface((slot, *cell))).map(move |cell| (slot, cell))
        })
    }

    /// Removes crumbs under this gravity.
    pub(crate) fn remove_crumbs(&mut self, gravity: [T; 3], ledger: &mut Ledger) {
        let touches_liquid = |cell: Cell| self.around(cell).any(|(beside, _)| self.is_liquid(beside));
        let bears = |flip: u8, c: [i32; 3]| {
            (0..3).any(|a| flip >> a & 1 == 1 && f64::from(c[a]) * gravity[a].to_f64() > 0.0)
        };
        let on_a_wall = |cell: Cell| {
            (1..=6).zip(self.around(cell)).any(|(i, (beside, flip))| {
                let (kinds, bit) = self.kind(beside);
                bears(flip, C[i]) || kinds.solid & bit != 0
            })
        };
        let crumbs: Vec<Cell> = self
            .interface_cells()
            .filter(|cell| !touches_liquid(*cell) && !on_a_wall(*cell))
            .filter(|cell| {
                !self.around(*cell).any(|(beside, _)| self.is_interface(beside) && touches_liquid(beside))
            })
            .collect();
        let masses: Vec<f64> = crumbs.iter().map(|cell| self.mass[cell.0][cell.1]).collect();
        for &cell in &crumbs {
            self.set_kind(cell, false, false);
        }
        for (&cell, mass) in crumbs.iter().zip(masses) {
            self.strand(cell, mass, ledger);
        }
    }

    /// Releases blocks without fluid and without solids, which fluid beside them must go on seeing.
    pub(crate) fn release_dry(&mut self) {
        let bare = |kinds: &Kinds| kinds.wet() | kinds.immersed == 0;
        let dry: Vec<usize> = self.slots().filter(|slot| self.kinds[*slot].iter().all(bare)).collect();
        for slot in dry {
            self.release(slot);
        }
    }

    /// Mass of all fluid in cells of density 1.
    pub(crate) fn total_mass(&self) -> f64 {
        let mut slots: Vec<usize> = self.slots().collect();
        slots.retain(|slot| *slot > OUTSIDE as usize);
        tremie_numerics::sum::ordered_sum(&slots, |&slot| {
            let mut mass = 0.0;
            for (row, kinds) in self.kinds[slot].iter().enumerate() {
                for k in 0..EDGE {
                    let cell = row * EDGE + k;
                    if kinds.liquid >> k & 1 == 1 {
                        mass += self.liquid_mass((slot, cell));
                    } else if kinds.interface >> k & 1 == 1 {
                        mass += self.mass[slot][cell];
                    }
                }
            }
            mass
        })
    }

    /// Volume of all fluid in cells: liquid cells and the fill of interface cells.
    pub(crate) fn volume(&self) -> f64 {
        self.slots()
            .map(|slot| {
                let liquid: u32 = self.kinds[slot].iter().map(|kinds| kinds.liquid.count_ones()).sum();
                let held = (0..CELLS).filter(|cell| self.is_interface((slot, *cell)));
                f64::from(liquid) + held.map(|cell| self.fills[slot][(0, cell)].to_f64()).sum::<f64>()
            })
            .sum()
    }

    /// Spreads mass evenly over all interface cells; returns whether there are any.
    pub(crate) fn spread_mass(&mut self, mass: f64) -> bool {
        let cells: Vec<Cell> = self.interface_cells().collect();
        if cells.is_empty() {
            return false;
        }
        let share = mass / cells.len() as f64;
        for (slot, cell) in &cells {
            self.mass[*slot][*cell] += share;
        }
        true
    }
}
