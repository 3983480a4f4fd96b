//! What lies around the rows of a block, kept until it changes.
//!
//! Most rows of a body of fluid touch only liquid ("bulk"): they need nothing but populations. All others ("surface")
//! touch air, walls or interface, hold interface themselves, or lie in a cage; for these the kinds of the cells around are kept as
//! bits, one byte for each velocity.
//!
//! An interface cell with no air beside it holds a void that fluid has closed over, as a front does that rolls on
//! over a floor without slip. Left to itself it would exchange as much as any liquid cell and stay hollow for ever: a film of
//! a tenth of a slump's volume. The void is air too, at the pressure of air; so such a cell and the interface cells beside it see air towards each other
//! (both: what one alone took for air would take its momentum from nowhere, up to 1 % of the weight of a slab while it reaches its form), and
//! the fluid around presses into it until it is full.

use std::ops::Index;

use rayon::prelude::*;

use crate::cage::Cages;
use crate::grid::{AT_ONCE, Kinds};
use crate::lanes::LANES;
use crate::lattice::{C, Q};
use crate::solids::{Contacts, Solids};
use crate::topology::{Links, Neighbour, ROWS};
use crate::transport::WAYS;
use crate::wall;

/// The nine rows around a row (and the row itself), dy fastest.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Beside {
    rows: [Neighbour; 9],
    /// Whether any of them is seen in a mirror.
    pub(crate) mirrored: bool,
}

impl Index<usize> for Beside {
    type Output = Neighbour;

    #[inline(always)]
    fn index(&self, n: usize) -> &Neighbour {
        &self.rows[n]
    }
}

/// The rows of a block that hold fluid.
#[derive(Debug, Clone, Default)]
pub(crate) struct Rows {
    /// Rows that touch only liquid.
    pub(crate) bulk: Vec<BulkRow>,
    /// All others.
    pub(crate) surface: Vec<SurfaceRow>,
    /// Whether any interface cell is too fast to be held for sure (module `support`).
    pub(crate) fast: bool,
    /// Interface cells around a void, by row; none if there are none in the block.
    voids: Option<[u8; ROWS]>,
    /// Whether there are any here or in a block beside.
    sees_voids: bool,
}

/// A row that touches only liquid.
#[derive(Debug, Clone)]
pub(crate) struct BulkRow {
    /// Number of the row in its block.
    pub(crate) row: u8,
    /// The rows around.
    pub(crate) beside: Beside,
    /// Whether there is interface beside it.
    pub(crate) shore: bool,
}

/// A row with what lies around its cells. For each velocity c a byte tells what lies at -c.
#[derive(Debug, Clone)]
pub(crate) struct SurfaceRow {
    /// Number of the row in its block.
    pub(crate) row: u8,
    /// What the cells themselves are.
    pub(crate) kinds: Kinds,
    /// The rows around.
    pub(crate) beside: Beside,
    /// Solid at -c, for cells that hold fluid.
    pub(crate) solid: [u8; Q],
    /// A solid in the domain at -c, for cells that hold fluid.
    pub(crate) immersed: [u8; Q],
    /// Nothing that could send a population from -c, for interface cells: air, or a void in interface.
    pub(crate) missing: [u8; Q],
    /// Liquid at -c, for interface cells.
    pub(crate) liquid: [u8; Q],
    /// Interface at -c, for interface cells.
    pub(crate) interface: [u8; Q],
    /// Cells that exchange mass with those at -c over the link between them, and over half of it (module `transport`), for interface cells.
    pub(crate) whole: [u8; Q],
    pub(crate) halves: [u8; Q],
    /// Interface at -c, other than a cell's own mirror image, for interface cells and the velocities 1 to 6.
    pub(crate) faces: [u8; 6],
    /// Interface cells with air, with liquid, and with interface anywhere around.
    pub(crate) any_air: u8,
    pub(crate) any_liquid: u8,
    pub(crate) any_interface: u8,
    /// Cells with a wall anywhere around.
    pub(crate) any_solid: u8,
    /// Cells with a solid of the domain anywhere around.
    pub(crate) any_immersed: u8,
    /// Cells at a flat wall, for each face.
    pub(crate) flat: [u8; 6],
    /// Whether there is interface in it, or beside it.
    pub(crate) shore: bool,
    /// Whether any cell lies in a cage.
    pub(crate) caged: bool,
    /// What the cells are in contact with, if that stays as it is. (Distances from a drawing of many facets are dear.)
    pub(crate) contacts: Option<Box<Contacts>>,
}

/// The first cell of a row of a block.
#[inline(always)]
pub(crate) fn first_of(row: u8) -> usize {
    (usize::from(row) & (ROWS - 1)) * LANES
}

impl BulkRow {
    /// Its first cell in the block.
    #[inline(always)]
    pub(crate) fn first(&self) -> usize {
        first_of(self.row)
    }
}

impl SurfaceRow {
    fn see_voids(&mut self, voids: &[Option<[u8; ROWS]>], links: &Links) {
        let of = |slot: usize, row: usize| voids[slot].map_or(0, |voids| voids[row]);
        let here = bits_at(of, links, &self.beside, C[0]);
        for i in 1..Q {
            let there = bits_at(of, links, &self.beside, C[i]);
            self.missing[i] = self.air(i) | self.interface[i] & (here | there);
        }
    }

    /// Air at -c, for interface cells.
    pub(crate) fn air(&self, i: usize) -> u8 {
        self.kinds.interface & !(self.liquid[i] | self.interface[i] | self.solid[i])
    }

    /// Its first cell in the block.
    #[inline(always)]
    pub(crate) fn first(&self) -> usize {
        first_of(self.row)
    }
}

impl Links {
    /// The nine rows around a row.
    #[inline(always)]
    pub(crate) fn beside(&self, row: usize) -> Beside {
        let rows: [Neighbour; 9] =
            std::array::from_fn(|n| self.row(row, (n % 3) as i32 - 1, (n / 3) as i32 - 1));
        Beside { rows, mirrored: rows.iter().any(|row| row.flip != 0) }
    }
}

/// Which of the nine rows holds the cells at -c.
pub(crate) const fn upstream(c: [i32; 3]) -> usize {
    ((1 - c[1]) + 3 * (1 - c[2])) as usize
}

/// What there is of the cells at -c of the cells of a row, of which `row_of` tells the bits of a row in a slot.
#[inline(always)]
fn bits_at(row_of: impl Fn(usize, usize) -> u8, links: &Links, beside: &Beside, c: [i32; 3]) -> u8 {
    let beside = beside[upstream(c)];
    let row_of = |block: u8| row_of(links.slots[usize::from(block)] as usize, usize::from(beside.row));
    let row = row_of(beside.block);
    match c[0] {
        0 => row,
        1 => row << 1 | row_of(beside.low) >> links.before().index & 1,
        _ => {
            let last = (row_of(beside.high) >> links.after().index & 1) << links.last;
            row >> 1 & !(1 << links.last) | last
        }
    }
}

/// The kinds of the cells at -c of the cells of a row.
fn kinds_at(all: &[[Kinds; ROWS]], links: &Links, beside: &Beside, c: [i32; 3]) -> Kinds {
    let of = |kind: fn(&Kinds) -> u8| bits_at(|slot, row| kind(&all[slot][row]), links, beside, c);
    Kinds {
        liquid: of(|kinds| kinds.liquid),
        interface: of(|kinds| kinds.interface),
        solid: of(|kinds| kinds.solid),
        immersed: of(|kinds| kinds.immersed),
    }
}

/// Cells of a row whose neighbour at -c is their own mirror image.
fn own_images(links: &Links, beside: &Beside, c: [i32; 3]) -> u8 {
    match c[0] {
        0 if beside[upstream(c)].flip != 0 => 0xff,
        1 if links.before().flip != 0 => 1,
        -1 if links.after().flip != 0 => 1 << links.last,
        _ => 0,
    }
}

impl Rows {
    /// Sorts those rows of one block that are `stale` (a bit each), those that lie in cages (`caged`) to those of the surface.
    fn sort(
        &mut self,
        stale: u64,
        all: &[[Kinds; ROWS]],
        links: &Links,
        solids: &Solids,
        caged: u64,
        slot: usize,
    ) {
        let is_stale = |row: u8| stale >> row & 1 == 1;
        self.bulk.retain(|row| !is_stale(row.row));
        self.surface.retain(|row| !is_stale(row.row));
        let mut voids = self.voids.unwrap_or([0; ROWS]);
        for row in (0..ROWS).filter(|row| is_stale(*row as u8)) {
            let kinds = all[slot][row];
            let wet = kinds.wet();
            voids[row] = 0;
            if wet == 0 {
                continue;
            }
            let mut found = SurfaceRow {
                row: row as u8,
                kinds,
                beside: links.beside(row),
                solid: [0; Q],
                immersed: [0; Q],
                missing: [0; Q],
                liquid: [0; Q],
                interface: [0; Q],
                whole: [0; Q],
                halves: [0; Q],
                faces: [0; 6],
                any_air: 0,
                any_liquid: 0,
                any_interface: 0,
                any_solid: 0,
                any_immersed: 0,
                flat: [0; 6],
                shore: kinds.interface != 0,
                caged: caged >> row & 1 == 1,
                contacts: None,
            };
            let mut wet_around = 0xff;
            for i in 1..Q {
                let there = kinds_at(all, links, &found.beside, C[i]);
                wet_around &= there.wet();
                found.shore |= there.interface != 0;
                found.solid[i] = there.solid & wet;
                found.immersed[i] = there.immersed & wet;
                found.any_immersed |= found.immersed[i];
                found.missing[i] = there.air() & kinds.interface;
                found.liquid[i] = there.liquid & kinds.interface;
                found.interface[i] = there.interface & kinds.interface;
                found.any_solid |= found.solid[i];
                found.any_air |= found.missing[i];
                found.any_interface |= found.interface[i];
                found.any_liquid |= found.liquid[i];
            }
            for i in 1..Q {
                // Liquid on the two ways around the corner: none along the axes.
                let [a, b] = WAYS[i].map(|way| found.liquid[way]);
                found.whole[i] = found.liquid[i] | found.interface[i] & a & b;
                found.halves[i] = found.interface[i] & (a ^ b);
            }
            for i in 1..=6 {
                found.faces[i - 1] = found.interface[i] & !own_images(links, &found.beside, C[i]);
            }
            found.flat = wall::flat(&found.solid);
            if found.any_immersed != 0 && solids.still {
                found.contacts = Some(Box::new(solids.contacts(links, row * LANES, &found.immersed)));
            }
            voids[row] = found.any_interface & !found.any_air;
            if kinds.liquid & wet_around == 0xff && !found.caged {
                let SurfaceRow { row, beside, shore, .. } = found;
                self.bulk.push(BulkRow { row, beside, shore });
            } else {
                self.surface.push(found);
            }
        }
        self.voids = (voids != [0; ROWS]).then_some(voids);
        self.bulk.sort_by_key(|row| row.row);
        self.surface.sort_by_key(|row| row.row);
    }

    /// Lets the rows of all blocks that are in use see voids as they are now.
    pub(crate) fn see_voids(all: &mut [Rows], links: &[Links]) {
        if !all.iter().any(|rows| rows.sees_voids || rows.voids.is_some()) {
            return;
        }
        let voids: Vec<_> = all.iter().map(|rows| rows.voids).collect();
        all.par_iter_mut().zip(links).with_max_len(AT_ONCE).for_each(|(rows, links)| {
            let near = links.slots.iter().any(|slot| voids[*slot as usize].is_some());
            if near || rows.sees_voids {
                for row in rows.surface.iter_mut().filter(|row| row.any_interface != 0) {
                    row.see_voids(&voids, links);
                }
            }
            rows.sees_voids = near;
        });
    }

    /// Whether no row holds fluid.
    pub(crate) fn is_empty(&self) -> bool {
        self.bulk.is_empty() && self.surface.is_empty()
    }
}

/// What rows are sorted by.
#[derive(Clone, Copy)]
pub(crate) struct Sorting<'a> {
    pub(crate) kinds: &'a [[Kinds; ROWS]],
    pub(crate) links: &'a [Links],
    pub(crate) solids: &'a Solids,
    pub(crate) cages: &'a Cages,
    pub(crate) used: &'a [bool],
}

impl Sorting<'_> {
    /// Sorts the `stale` rows (a bit each) of the block in a slot.
    pub(crate) fn sort(self, slot: usize, stale: u64, rows: &mut Rows) {
        match self.used[slot] {
            true if stale != 0 => {
                let caged = self.cages.block(slot).rows();
                rows.sort(stale, self.kinds, &self.links[slot], self.solids, caged, slot);
            }
            true => {}
            false => *rows = Rows::default(),
        }
    }
}
