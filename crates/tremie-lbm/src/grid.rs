//! Storage: blocks that exist only where there is fluid.
//!
//! Populations are kept twice, those that a step reads (`front`) and those that it writes (`back`), so that every cell
//! writes only itself and no order of work can change the result. Everything else is kept once.

use crate::cage::Cages;
use crate::carried::Carried;
use crate::immersed::Immersed;
use crate::inlet::Inlets;
use crate::lattice::{C, Q};
use crate::real::Real;
use crate::solids::Solids;
use crate::tension::Tension;
use crate::topology::{AIR, Boundary, CELLS, EDGE, Links, OUTSIDE, ROWS, Topology};
use crate::values::Values;

/// What the eight cells of a row are, as bits; a cell that is none of these is air.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(crate) struct Kinds {
    /// Full of fluid.
    pub(crate) liquid: u8,
    /// Between fluid and air: holds a mass of its own.
    pub(crate) interface: u8,
    /// Wall, or beyond the domain.
    pub(crate) solid: u8,
    /// Those of them that lie in the domain: parts of solids.
    pub(crate) immersed: u8,
}

impl Kinds {
    /// Cells with populations.
    #[inline(always)]
    pub(crate) fn wet(self) -> u8 {
        self.liquid | self.interface
    }

    /// Cells of air.
    #[inline(always)]
    pub(crate) fn air(self) -> u8 {
        !(self.liquid | self.interface | self.solid)
    }
}

/// Blocks that a thread works on before it looks for more: few, because some hold a hundred times as much as others.
pub(crate) const AT_ONCE: usize = 4;

/// All rows of a block, a bit each.
pub(crate) const ALL_ROWS: u64 = u64::MAX;

/// Post-collision populations of a block, less their weights.
pub(crate) type Field<T> = Values<T, Q>;

/// Fill of a block's cells: mass over density of interface cells, 1 in liquid, 0 in air. (Few need it, but these need it of 27 cells:
/// among the populations each would lie in a cache line of its own.)
pub(crate) type Fill<T> = Values<T, 1>;

/// What bears the interface cells of a block, over the weight of a full cell (module `support`): a mean over steps.
pub(crate) type Borne<T> = Values<T, 1>;

/// The surface in the interface cells of a block (module `plane`): their velocity and the wet shares of their six
/// faces (in the order of the velocities 1 to 6).
pub(crate) type Shape<T> = Values<T, 9>;

/// Where a [`Shape`] keeps the velocity and the wet shares.
pub(crate) const VELOCITY: usize = 0;
pub(crate) const SHARE: usize = 3;

/// All blocks.
pub(crate) struct Grid<T: Real> {
    /// Size and sides.
    pub(crate) topology: Topology,
    /// What stands or moves in it.
    pub(crate) solids: Solids,
    /// Where fluid comes in.
    pub(crate) inlets: Inlets,
    /// Slot of each block by its number, `AIR` where none is allocated.
    slot_of: Vec<u32>,
    /// Whether a slot holds a block.
    pub(crate) used: Vec<bool>,
    /// Slots free for new blocks, the one to take next last.
    free: Vec<u32>,
    /// Surroundings of each block.
    pub(crate) links: Vec<Links>,
    /// Kinds of cells.
    pub(crate) kinds: Vec<[Kinds; ROWS]>,
    /// Populations to read.
    pub(crate) front: Vec<Box<Field<T>>>,
    /// Populations to write.
    pub(crate) back: Vec<Box<Field<T>>>,
    /// Fill of the cells after the last step.
    pub(crate) fills: Vec<Box<Fill<T>>>,
    /// Shape of the surface as the next step sees it.
    pub(crate) shape: Vec<Box<Shape<T>>>,
    /// Mass of interface cells; in liquid cells at sliding walls, their store (module `contact`).
    pub(crate) mass: Vec<Box<[f64; CELLS]>>,
    /// What bears interface cells.
    pub(crate) borne: Vec<Box<Borne<T>>>,
    /// What the fluid carries along.
    pub(crate) carried: Carried,
    /// What inclusions see of the fluid and do to it.
    pub(crate) immersed: Immersed<T>,
    /// Bars too thin for the cells.
    pub(crate) cages: Cages,
    /// What the surface presses by its tension, if it has any.
    pub(crate) tension: Option<Tension<T>>,
    /// For each block the rows whose surroundings changed since they were last sorted into bulk and surface, a bit each.
    pub(crate) stale: Vec<u64>,
    /// Whether solids were still when rows were last sorted: what rows are in contact with is kept from then on.
    pub(crate) sorted_still: bool,
    /// Cells that hold fluid.
    pub(crate) wet: usize,
}

impl<T: Real> Grid<T> {
    pub(crate) fn new(
        topology: Topology,
        solids: Solids,
        inlets: Inlets,
        carried: Carried,
        immersed: Immersed<T>,
        cages: Cages,
        tension: Option<Tension<T>>,
    ) -> Self {
        let blocks = topology.blocks.iter().product();
        let mut grid = Self {
            topology,
            solids,
            inlets,
            slot_of: vec![AIR; blocks],
            used: Vec::new(),
            free: Vec::new(),
            links: Vec::new(),
            kinds: Vec::new(),
            front: Vec::new(),
            back: Vec::new(),
            fills: Vec::new(),
            shape: Vec::new(),
            mass: Vec::new(),
            borne: Vec::new(),
            carried,
            immersed,
            cages,
            tension,
            stale: Vec::new(),
            sorted_still: false,
            wet: 0,
        };
        // The two slots that stand for no block: air and solid.
        for _ in [AIR, OUTSIDE] {
            grid.push();
        }
        grid.kinds[OUTSIDE as usize] = [Kinds { solid: 0xff, ..Kinds::default() }; ROWS];
        grid
    }

    /// Appends an empty slot.
    fn push(&mut self) -> u32 {
        self.used.push(false);
        self.links.push(Links { slots: [AIR; 27], steps: Default::default(), last: 7, place: [0; 3] });
        self.kinds.push([Kinds::default(); ROWS]);
        self.front.push(bytemuck::allocation::zeroed_box());
        self.back.push(bytemuck::allocation::zeroed_box());
        self.fills.push(bytemuck::allocation::zeroed_box());
        self.shape.push(bytemuck::allocation::zeroed_box());
        self.mass.push(bytemuck::allocation::zeroed_box());
        self.borne.push(bytemuck::allocation::zeroed_box());
        self.carried.push();
        self.immersed.push_slot();
        self.cages.push();
        self.stale.push(0);
        (self.used.len() - 1) as u32
    }

    /// Slots that hold blocks, in the order of their numbers.
    pub(crate) fn slots(&self) -> impl Iterator<Item = usize> + '_ {
        (0..self.used.len()).filter(|slot| self.used[*slot])
    }

    /// Number of slots, with and without blocks.
    pub(crate) fn len(&self) -> usize {
        self.used.len()
    }

    /// Slot of the block that holds a cell of the lattice, or `AIR`.
    pub(crate) fn slot_at(&self, at: [usize; 3]) -> u32 {
        self.slot_of[self.topology.number(at.map(|n| n / EDGE))]
    }

    /// Slot of the block at `place`, allocated if need be.
    pub(crate) fn allocate(&mut self, place: [usize; 3]) -> usize {
        let number = self.topology.number(place);
        if self.slot_of[number] != AIR {
            return self.slot_of[number] as usize;
        }
        let slot = match self.free.pop() {
            Some(slot) => slot as usize,
            None => self.push() as usize,
        };
        self.occupy(slot, place);
        slot
    }

    /// Puts the block at `place` into a free slot.
    fn occupy(&mut self, slot: usize, place: [usize; 3]) {
        let last = [0, 1, 2].map(|a| self.topology.last(place[a], a));
        self.slot_of[self.topology.number(place)] = slot as u32;
        self.used[slot] = true;
        for (row, kinds) in self.kinds[slot].iter_mut().enumerate() {
            // Beyond an open side lies air.
            let within = |a: usize, at: usize| at <= last[a] || self.topology.sides[a][1] == Boundary::Open;
            let inside = within(1, row % EDGE) && within(2, row / EDGE);
            let lanes = match inside {
                true if within(0, EDGE) => 0xff,
                true => 0xffu8 >> (EDGE - 1 - last[0]),
                false => 0,
            };
            *kinds = Kinds { solid: !lanes, ..Kinds::default() };
        }
        *self.front[slot] = bytemuck::Zeroable::zeroed();
        *self.fills[slot] = bytemuck::Zeroable::zeroed();
        *self.mass[slot] = [0.0; CELLS];
        *self.borne[slot] = Borne::all(T::ONE);
        self.immersed.clear(slot);
        self.links[slot].steps = [0, 1, 2].map(|a| self.topology.steps(place[a], a));
        self.links[slot].last = last[0] as u8;
        self.links[slot].place = place.map(|p| p as u32);
        self.solids.forget(slot);
        self.cages.enter(slot, &self.links[slot]);
        self.link(slot);
    }

    /// Frees the slot of a block that holds nothing.
    pub(crate) fn release(&mut self, slot: usize) {
        let place = self.links[slot].place.map(|p| p as usize);
        self.slot_of[self.topology.number(place)] = AIR;
        self.used[slot] = false;
        self.kinds[slot] = [Kinds::default(); ROWS];
        self.stale[slot] = ALL_ROWS;
        self.free.push(slot as u32);
        self.link(slot);
    }

    /// Makes the block in `slot` and those around it know each other (or forget it, once it is no longer used).
    fn link(&mut self, slot: usize) {
        let place = self.links[slot].place.map(|p| p as usize);
        for n in 0..27 {
            let offset = [(n % 3) as i32 - 1, (n / 3 % 3) as i32 - 1, (n / 9) as i32 - 1];
            let beside = match self.topology.beside(place, offset) {
                None => self.topology.beyond(place, offset),
                Some(beside) => self.slot_of[self.topology.number(beside)],
            };
            self.links[slot].slots[n] = beside;
            if beside > OUTSIDE {
                self.links[beside as usize].slots[26 - n] = self.slot_of[self.topology.number(place)];
                self.stale[beside as usize] = ALL_ROWS;
            }
        }
        self.stale[slot] = ALL_ROWS;
    }

    /// Marks the rows that have a cell, or a neighbour of it, in them.
    pub(crate) fn touch(&mut self, slot: usize, cell: usize) {
        self.stale[slot] |= 1 << (cell / EDGE);
        for i in 1..Q {
            let (beside, at, _) = self.links[slot].cell(cell, C[i]);
            self.stale[beside as usize] |= 1 << (at / EDGE);
        }
    }

    /// The slots, free ones too, in a form that can be saved: coordinates of blocks, `u32::MAX` for none.
    pub(crate) fn layout(&self) -> (Vec<u32>, Vec<u32>) {
        let places = (2..self.len())
            .flat_map(|slot| if self.used[slot] { self.links[slot].place } else { [u32::MAX; 3] })
            .collect();
        (places, self.free.clone())
    }

    /// An empty grid of the same case with its blocks in the same slots as saved by [`Grid::layout`]; `None` if these are impossible.
    pub(crate) fn restored(&self, places: &[u32], free: &[u32]) -> Option<Self> {
        let (solids, inlets, carried) = (self.solids.clone(), self.inlets.clone(), self.carried.emptied());
        let (immersed, cages) = (self.immersed.emptied(), self.cages.emptied());
        let tension = self.tension.as_ref().map(Tension::emptied);
        let mut grid = Self::new(self.topology.clone(), solids, inlets, carried, immersed, cages, tension);
        for place in places.chunks_exact(3) {
            let slot = grid.push() as usize;
            if place == [u32::MAX; 3] {
                continue;
            }
            let place = [place[0] as usize, place[1] as usize, place[2] as usize];
            let inside = (0..3).all(|a| place[a] < grid.topology.blocks[a]);
            if !inside || grid.slot_of[grid.topology.number(place)] != AIR {
                return None;
            }
            grid.occupy(slot, place);
        }
        if free.iter().any(|slot| grid.used.get(*slot as usize) != Some(&false) || *slot <= OUTSIDE) {
            return None;
        }
        grid.free = free.to_vec();
        Some(grid)
    }

    /// Fills the blocks with saved values, in the order of their slots; the name of what does not fit otherwise.
    pub(crate) fn load(
        &mut self,
        fields: &[T],
        mass: &[f64],
        kinds: &[u8],
        carried: &[f64],
    ) -> Result<(), &'static str> {
        let slots: Vec<usize> = self.slots().collect();
        let (populations, per_block) = (Q * CELLS, (Q + 2) * CELLS);
        let per_kinds = ROWS * size_of::<Kinds>();
        for (name, length, expected) in [
            ("fields", fields.len(), slots.len() * per_block),
            ("mass", mass.len(), slots.len() * CELLS),
            ("kinds", kinds.len(), slots.len() * per_kinds),
            ("carried", carried.len(), slots.len() * self.carried.per_block()),
        ] {
            if length != expected {
                return Err(name);
            }
        }
        for (n, &slot) in slots.iter().enumerate() {
            let (field, others) = fields[n * per_block..][..per_block].split_at(populations);
            let (fill, borne) = others.split_at(CELLS);
            for (at, value) in field.iter().enumerate() {
                self.front[slot][(at / CELLS, at % CELLS)] = *value;
            }
            for (cell, value) in fill.iter().enumerate() {
                self.fills[slot][(0, cell)] = *value;
            }
            for (cell, value) in borne.iter().enumerate() {
                self.borne[slot][(0, cell)] = *value;
            }
            self.mass[slot].copy_from_slice(&mass[n * CELLS..][..CELLS]);
            let per_block = self.carried.per_block();
            self.carried.load(slot, &carried[n * per_block..][..per_block]);
            bytemuck::cast_slice_mut(&mut self.kinds[slot])
                .copy_from_slice(&kinds[n * per_kinds..][..per_kinds]);
        }
        self.count_wet();
        Ok(())
    }

    /// Counts the cells that hold fluid.
    pub(crate) fn count_wet(&mut self) {
        let rows = self.slots().flat_map(|slot| self.kinds[slot].iter());
        self.wet = rows.map(|kinds| kinds.wet().count_ones() as usize).sum();
    }

    /// Memory in bytes.
    pub(crate) fn bytes(&self) -> usize {
        let block = 2 * size_of::<Field<T>>()
            + size_of::<Fill<T>>()
            + size_of::<Shape<T>>()
            + size_of::<[f64; CELLS]>()
            + size_of::<Borne<T>>()
            + size_of::<[Kinds; ROWS]>()
            + size_of::<Links>();
        self.len() * block
            + self.carried.bytes()
            + self.immersed.bytes()
            + self.cages.bytes()
            + self.tension.as_ref().map_or(0, Tension::bytes)
            + self.slot_of.len() * size_of::<u32>()
    }
}
