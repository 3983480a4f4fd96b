//! How cells, rows and blocks of the lattice lie beside each other, and what lies beyond the sides of the domain.
//!
//! The lattice is cut into blocks of 8 x 8 x 8 cells. Within a block, cell (x, y, z) has number
//! `x + 8 (y + 8 z)`, and the eight cells with equal y and z form a row. A row is the unit that kernels work on: its
//! values are one vector, its kinds of cells are bits of one byte.
//!
//! Beyond a periodic side lies the opposite side; beyond a symmetry plane lies the mirror image, in which velocities
//! are mirrored too; beyond a wall lies solid, beyond an open side air. All of this is resolved when a neighbour is looked up, so no values are
//! copied to ghost cells and kernels need no special cases.

use crate::friction::Friction;

/// Cells along the edge of a block.
pub(crate) const EDGE: usize = 8;
/// Rows in a block.
pub(crate) const ROWS: usize = EDGE * EDGE;
/// Cells in a block.
pub(crate) const CELLS: usize = EDGE * ROWS;

/// Slot of a block that is not allocated: only air.
pub(crate) const AIR: u32 = 0;
/// Slot of everything beyond a wall: only solid.
pub(crate) const OUTSIDE: u32 = 1;

/// What a side of the domain is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Boundary {
    /// No-slip wall half a cell beyond the last centre, with its velocity in lattice units.
    Wall([f64; 3]),
    /// The flow goes on mirrored.
    Symmetry,
    /// The flow goes on at the opposite side.
    Periodic,
    /// Air.
    Open,
}

/// Where a coordinate just outside of a block leads to, along one axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct Step {
    /// Block to go to: 0 the one before, 1 this one, 2 the one after.
    pub(crate) block: u8,
    /// Coordinate there.
    pub(crate) index: u8,
    /// Whether a mirror was crossed: bit of the axis, or 0.
    pub(crate) flip: u8,
}

/// What lies beside one block.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Links {
    /// Slots of the 3 x 3 x 3 blocks around (and with) this one, x fastest.
    pub(crate) slots: [u32; 27],
    /// For each axis the steps to coordinates -1, 0, ..., 8.
    pub(crate) steps: [[Step; EDGE + 2]; 3],
    /// The last lane of a row that lies in the domain.
    pub(crate) last: u8,
    /// Coordinates of the block.
    pub(crate) place: [u32; 3],
}

/// A row beside a row, at an offset in y and z. Blocks are numbered as in [`Links::slots`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct Neighbour {
    /// Block that holds the row.
    pub(crate) block: u8,
    /// Block that holds the cell before the row's first.
    pub(crate) low: u8,
    /// Block that holds the cell after the row's last.
    pub(crate) high: u8,
    /// Number of the row in its block.
    pub(crate) row: u8,
    /// Mirrors crossed in y and z, as bits.
    pub(crate) flip: u8,
}

impl Links {
    /// The row at (dy, dz) from row `row` of this block.
    #[inline(always)]
    pub(crate) fn row(&self, row: usize, dy: i32, dz: i32) -> Neighbour {
        let y = self.steps[1][((row % EDGE) as i32 + dy + 1) as usize];
        let z = self.steps[2][((row / EDGE) as i32 + dz + 1) as usize];
        let base = 3 * (y.block + 3 * z.block);
        Neighbour {
            block: base + 1,
            low: base + self.before().block,
            high: base + self.after().block,
            row: y.index + EDGE as u8 * z.index,
            flip: y.flip | z.flip,
        }
    }

    /// Step to the cell before the first of a row.
    #[inline(always)]
    pub(crate) fn before(&self) -> Step {
        self.steps[0][0]
    }

    /// Step to the cell after the last of a row.
    #[inline(always)]
    pub(crate) fn after(&self) -> Step {
        self.steps[0][usize::from(self.last) + 2]
    }

    /// Whether all lanes of a row lie in the domain and what is beside its ends lies beyond its block: so it is in most blocks.
    pub(crate) fn regular(&self) -> bool {
        usize::from(self.last) == EDGE - 1
            && self.before().block == 0
            && self.after().block == 2
            && usize::from(self.before().index) == EDGE - 1
    }

    /// Coordinates in the lattice of a cell of this block.
    pub(crate) fn coordinates(&self, cell: usize) -> [usize; 3] {
        let at = [cell % EDGE, cell / EDGE % EDGE, cell / ROWS];
        [0, 1, 2].map(|a| self.place[a] as usize * EDGE + at[a])
    }

    /// Slot, cell number and mirrors crossed at the lattice velocity `c` from the cell `cell` of this block.
    pub(crate) fn cell(&self, cell: usize, c: [i32; 3]) -> (u32, usize, u8) {
        let at = [cell % EDGE, cell / EDGE % EDGE, cell / ROWS];
        let mut steps = [Step::default(); 3];
        for a in 0..3 {
            steps[a] = self.steps[a][(at[a] as i32 + c[a] + 1) as usize];
        }
        let [x, y, z] = steps;
        let slot = self.slots[usize::from(x.block) + 3 * (usize::from(y.block) + 3 * usize::from(z.block))];
        let cell = usize::from(x.index) + EDGE * (usize::from(y.index) + EDGE * usize::from(z.index));
        (slot, cell, x.flip | y.flip | z.flip)
    }
}

/// The lattice as a whole: its size and its sides.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Topology {
    /// Cells along each axis.
    pub(crate) cells: [usize; 3],
    /// Blocks along each axis.
    pub(crate) blocks: [usize; 3],
    /// For each axis the lower and the upper side.
    pub(crate) sides: [[Boundary; 2]; 3],
    /// Friction of sides along which the fluid slides.
    pub(crate) frictions: [[Option<Friction>; 2]; 3],
    /// Boxes of cells in which fluid leaves, each by its first cells and its ends.
    pub(crate) outlets: Vec<[[usize; 3]; 2]>,
}

impl Topology {
    pub(crate) fn new(cells: [usize; 3], sides: [[Boundary; 2]; 3]) -> Self {
        let frictions = [[None; 2]; 3];
        Self { cells, blocks: cells.map(|n| n.div_ceil(EDGE)), sides, frictions, outlets: Vec::new() }
    }

    /// Number of the block with coordinates `place`.
    pub(crate) fn number(&self, place: [usize; 3]) -> usize {
        place[0] + self.blocks[0] * (place[1] + self.blocks[1] * place[2])
    }

    /// The block at an offset of -1, 0 or 1 along each axis; `None` beyond a wall.
    ///
    /// Beyond a symmetry plane there is no block (steps lead back into the block itself), which is also `None`.
    pub(crate) fn beside(&self, place: [usize; 3], offset: [i32; 3]) -> Option<[usize; 3]> {
        let mut beside = place;
        for a in 0..3 {
            let moved = place[a] as i64 + i64::from(offset[a]);
            let n = self.blocks[a] as i64;
            beside[a] = if (0..n).contains(&moved) {
                moved as usize
            } else if self.sides[a][0] == Boundary::Periodic {
                moved.rem_euclid(n) as usize
            } else {
                return None;
            };
        }
        Some(beside)
    }

    /// What lies beyond the domain at an offset of -1, 0 or 1 blocks along each axis, where [`Topology::beside`] finds no block: air only if
    /// no wall is crossed.
    pub(crate) fn beyond(&self, place: [usize; 3], offset: [i32; 3]) -> u32 {
        let passes = |side: Boundary| matches!(side, Boundary::Open | Boundary::Periodic);
        let open = |a: usize| match place[a] as i64 + i64::from(offset[a]) {
            moved if moved < 0 => passes(self.sides[a][0]),
            moved if moved >= self.blocks[a] as i64 => passes(self.sides[a][1]),
            _ => true,
        };
        if (0..3).all(open) { AIR } else { OUTSIDE }
    }

    /// The cell at the lattice velocity `c` from the cell at `at`, through mirrors and periodic sides; none beyond other sides.
    pub(crate) fn reached(&self, at: [usize; 3], c: [i32; 3]) -> Option<[usize; 3]> {
        let mut there = at;
        for a in 0..3 {
            let (moved, n) = (at[a] as i64 + i64::from(c[a]), self.cells[a] as i64);
            if !(0..n).contains(&moved) {
                match self.sides[a][usize::from(moved >= n)] {
                    Boundary::Symmetry => {}
                    Boundary::Periodic => there[a] = moved.rem_euclid(n) as usize,
                    Boundary::Wall(_) | Boundary::Open => return None,
                }
            } else {
                there[a] = moved as usize;
            }
        }
        Some(there)
    }

    /// Whether fluid leaves at a cell.
    pub(crate) fn drains(&self, at: [usize; 3]) -> bool {
        let holds = |[first, end]: &[[usize; 3]; 2]| (0..3).all(|a| (first[a]..end[a]).contains(&at[a]));
        self.outlets.iter().any(holds)
    }

    /// Number in its block of the cell at `at`.
    pub(crate) fn cell_at(&self, at: [usize; 3]) -> usize {
        at[0] % EDGE + EDGE * (at[1] % EDGE + EDGE * (at[2] % EDGE))
    }

    /// The last coordinate in the domain, within the block at `place` along `axis`.
    pub(crate) fn last(&self, place: usize, axis: usize) -> usize {
        (self.cells[axis] - EDGE * place).min(EDGE) - 1
    }

    /// Steps along `axis` from the block with coordinate `place`.
    pub(crate) fn steps(&self, place: usize, axis: usize) -> [Step; EDGE + 2] {
        let flip = 1u8 << axis;
        let mut steps = [Step::default(); EDGE + 2];
        for (k, step) in steps.iter_mut().enumerate() {
            *step = match k {
                0 => Step { block: 0, index: EDGE as u8 - 1, flip: 0 },
                9 => Step { block: 2, index: 0, flip: 0 },
                _ => Step { block: 1, index: k as u8 - 1, flip: 0 },
            };
        }
        if place == 0 {
            match self.sides[axis][0] {
                Boundary::Wall(_) | Boundary::Open => {}
                Boundary::Symmetry => steps[0] = Step { block: 1, index: 0, flip },
                Boundary::Periodic => {
                    let end = self.last(self.blocks[axis] - 1, axis) as u8;
                    steps[0] = Step { block: 0, index: end, flip: 0 };
                }
            }
        }
        if place + 1 == self.blocks[axis] {
            let end = self.last(place, axis);
            match self.sides[axis][1] {
                Boundary::Wall(_) | Boundary::Open => {}
                Boundary::Symmetry => steps[end + 2] = Step { block: 1, index: end as u8, flip },
                Boundary::Periodic => steps[end + 2] = Step { block: 2, index: 0, flip: 0 },
            }
        }
        steps
    }

    /// Whether the fluid slides with friction along any side.
    pub(crate) fn rubs(&self) -> bool {
        self.frictions.iter().flatten().any(Option::is_some)
    }

    /// Whether any wall moves.
    pub(crate) fn moving_walls(&self) -> bool {
        self.sides.iter().flatten().any(|side| matches!(side, Boundary::Wall(u) if *u != [0.0; 3]))
    }

    /// Velocity of the wall that a link from the cell at `at` along `c` runs into, in lattice units.
    ///
    /// A link into an edge between two walls meets a moving wall only if both move.
    pub(crate) fn wall_velocity(&self, at: [usize; 3], c: [i32; 3]) -> [f64; 3] {
        let mut velocity: Option<[f64; 3]> = None;
        for a in 0..3 {
            let reached = at[a] as i64 + i64::from(c[a]);
            let side = match reached {
                r if r < 0 => self.sides[a][0],
                r if r >= self.cells[a] as i64 => self.sides[a][1],
                _ => continue,
            };
            if let Boundary::Wall(u) = side {
                let slower = |v: &[f64; 3]| v.iter().map(|x| x * x).sum::<f64>();
                velocity = Some(match velocity {
                    Some(other) if slower(&other) <= slower(&u) => other,
                    _ => u,
                });
            }
        }
        velocity.unwrap_or([0.0; 3])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const WALL: Boundary = Boundary::Wall([0.0; 3]);

    /// Links of the only block, or of the first of several, of a lattice in which slot = 2 + block number.
    fn links(topology: &Topology, place: [usize; 3]) -> Links {
        let mut slots = [OUTSIDE; 27];
        for (n, slot) in slots.iter_mut().enumerate() {
            let offset = [(n % 3) as i32 - 1, (n / 3 % 3) as i32 - 1, (n / 9) as i32 - 1];
            *slot = match topology.beside(place, offset) {
                Some(beside) => 2 + topology.number(beside) as u32,
                None => topology.beyond(place, offset),
            };
        }
        let steps = [0, 1, 2].map(|a| topology.steps(place[a], a));
        {
            let last = topology.last(place[0], 0) as u8;
            Links { slots, steps, last, place: place.map(|p| p as u32) }
        }
    }

    #[test]
    fn every_neighbour_of_every_cell() {
        // Against the definition, cell by cell, for all kinds of sides and for sizes that do and do not fill blocks.
        let kinds = [[WALL, WALL], [Boundary::Symmetry, WALL], [WALL, Boundary::Symmetry]];
        let open = [[WALL, Boundary::Open], [Boundary::Open; 2]];
        let kinds = [kinds[0], kinds[1], kinds[2], [Boundary::Symmetry; 2], [Boundary::Periodic; 2]];
        let kinds = [&kinds[..], &open].concat();
        for n in [1, 3, 8, 11] {
            for &side in &kinds {
                let topology = Topology::new([n, 5, 1], [side, [WALL; 2], [Boundary::Periodic; 2]]);
                for x in 0..n {
                    let place = [x / EDGE, 0, 0];
                    let links = links(&topology, place);
                    for dx in [-1, 0, 1] {
                        let (slot, cell, flip) = links.cell(x % EDGE + EDGE * 2, [dx, 1, 1]);
                        let beyond = x as i64 + i64::from(dx);
                        let reached = if (0..n as i64).contains(&beyond) {
                            Some((beyond, 0))
                        } else {
                            match side[usize::from(beyond >= 0)] {
                                Boundary::Wall(_) | Boundary::Open => None,
                                Boundary::Symmetry => Some((x as i64, 1)),
                                Boundary::Periodic => Some((beyond.rem_euclid(n as i64), 0)),
                            }
                        };
                        match reached {
                            // Solid, or air: outside of all blocks, or a lane beyond the last one of the domain.
                            None => {
                                let open = side[usize::from(beyond >= 0)] == Boundary::Open;
                                let there = if open { AIR } else { OUTSIDE };
                                assert!(slot == there || cell % EDGE > usize::from(links.last));
                            }
                            Some((x, mirrored)) => {
                                assert_eq!(slot as usize, 2 + x as usize / EDGE, "n {n}, {side:?}, {beyond}");
                                assert_eq!(cell, x as usize % EDGE + EDGE * 3);
                                assert_eq!(flip, mirrored);
                            }
                        }
                    }
                }
            }
        }
    }

    #[test]
    fn a_lid_does_not_drag_the_corner_of_a_wall_at_rest() {
        let lid = Boundary::Wall([0.1, 0.0, 0.0]);
        let topology = Topology::new([8, 8, 8], [[WALL; 2], [Boundary::Periodic; 2], [WALL, lid]]);
        assert_eq!(topology.wall_velocity([3, 3, 7], [1, 0, 1]), [0.1, 0.0, 0.0]);
        assert_eq!(topology.wall_velocity([7, 3, 7], [1, 0, 1]), [0.0; 3]);
        assert_eq!(topology.wall_velocity([3, 3, 0], [1, 0, -1]), [0.0; 3]);
        assert_eq!(topology.wall_velocity([3, 0, 7], [0, -1, 1]), [0.1, 0.0, 0.0]);
    }
}
