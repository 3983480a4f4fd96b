//! The state in SI units, as gauges and writers see it.
//!
//! Velocity, pressure, shear rate and stress of a cell are those that its next collision will use: the same pull, the
//! same moments, the same law.

use rayon::prelude::*;
use tremie_case::Side;
use tremie_numerics::DVec3;
use tremie_simulation::{Cells, Fluid, Lying, Simulation, Snapshot, SolidLoad, Wall, WallFace, WallLoads};

use crate::grid::AT_ONCE;
use crate::loads::{Face, Loads};
use crate::real::Real;
use crate::simulation::FreeSurface;
use crate::topology::{CELLS, EDGE};

/// Blocks that are looked at before what was seen in them is put among all: no more, to need little memory.
const LOOKED_AT: usize = 64;

/// One cell, in SI units.
struct Seen {
    /// Number in its block.
    cell: usize,
    fill: f64,
    pressure: f64,
    velocity: DVec3,
    shear_rate: f64,
    stress: f64,
}

impl<T: Real> FreeSurface<T> {
    /// See [`Simulation::see`].
    pub(crate) fn show(&self, snapshot: &mut Snapshot) {
        let (low, count) = self.wet_box();
        let size = self.scaling.cell_size;
        let mut cells = self.blank(low, count, std::mem::take(&mut snapshot.fluid));
        let mut loads = Loads::new(self.grid.solids.count(), self.case.cages.len());
        let slots: Vec<usize> = self.grid.slots().collect();
        for slots in slots.chunks(LOOKED_AT) {
            let seen: Vec<(Vec<Seen>, Loads)> =
                slots.par_iter().with_max_len(AT_ONCE).map(|slot| self.see_block(*slot)).collect();
            for (slot, (seen, more)) in slots.iter().zip(seen) {
                self.show_block(*slot, low, &seen, &mut cells);
                loads.add(more);
            }
        }
        self.show_solids(low, &mut cells);
        let cages = loads.cages.iter().map(|load| self.load(*load)).collect();
        let (solids, walls) = self.loads(loads, low, &cells);
        let inflow = self.inflow.iter().map(|inflow| inflow.volume).collect();
        let cubed = size.powi(3);
        let outflow = self.case.has_outlets().then_some(self.ledger.drained.volume * cubed);
        let batches_out = match self.case.has_outlets() {
            true => self.ledger.drained_of.iter().map(|out| out.volume * cubed).collect(),
            false => Vec::new(),
        };
        let inclusions = self.suspension.as_ref().map(|suspension| suspension.inclusions.clone());
        *snapshot = Snapshot {
            time: self.time(),
            fluid: Fluid::Cells(cells),
            inclusions: inclusions.unwrap_or_default(),
            solids,
            moved: self.grid.solids.moved().take(self.case.solids.len()).collect(),
            cages,
            walls,
            inflow,
            outflow,
            batches_out,
            bodies_in: self.passage.came().to_vec(),
            bodies_out: self.passage.left().to_vec(),
        };
    }

    /// A box of cells with nothing in it yet, from the cell `low` on, in the memory of one that is used up.
    fn blank(&self, low: [usize; 3], count: [usize; 3], Fluid::Cells(used): Fluid) -> Cells {
        let case = &self.case;
        let symmetric = |n: usize| case.domain.sides[n] == Side::Symmetry;
        let mut shares = used.batches.into_iter().map(|(_, shares)| shares);
        let mut batch = |name: &&str| (name.to_string(), shares.next().unwrap_or_default());
        let lying = |field: tremie_case::FibreField| Lying {
            form: field.form,
            share: field.share,
            tensors: used.lying.map_or_else(Vec::new, |lying| lying.tensors),
        };
        let cells = Cells {
            origin: case.domain.min + self.scaling.cell_size * DVec3::from(low.map(|n| n as f64)),
            size: self.scaling.cell_size,
            batches: case.batches().iter().map(&mut batch).collect(),
            structure: case.material.thixotropy.map(|_| used.structure.unwrap_or_default()),
            cage: (!case.cages.is_empty()).then(|| used.cage.unwrap_or_default()),
            lying: case.fibre_field.map(lying),
            density: self.scaling.density,
            domain: [case.domain.min, case.domain.max],
            symmetry: [0, 1, 2].map(|a| [symmetric(2 * a), symmetric(2 * a + 1)]),
            ..used
        };
        cells.blank(count)
    }

    /// What solids bear, and what all else does, in SI units.
    fn loads(&self, loads: Loads, low: [usize; 3], cells: &Cells) -> (Vec<SolidLoad>, WallLoads) {
        let mut solids: Vec<SolidLoad> = loads.solids.into_iter().map(|load| self.load(load)).collect();
        // The last are the plates of inlets.
        let inlets = solids.split_off(self.case.solids.len());
        let of_case = |face: &Face| !matches!(face.wall, Wall::Solid(n) if n >= solids.len());
        let size = self.scaling.cell_size;
        let seen = |face: Face| {
            let [i, j, k] = [0, 1, 2].map(|a| face.at[a] as usize - low[a]);
            WallFace {
                wall: face.wall,
                cell: self.case.domain.min + face.at * size,
                normal: face.normal,
                fill: cells.fill[cells.index(i, j, k)],
                area: face.area * size * size,
                force: face.force * self.scaling.stress_unit() * size * size,
            }
        };
        let faces = loads.faces.into_iter().filter(of_case).map(seen).collect();
        let sides = loads.sides.map(|load| self.load(load));
        (solids, WallLoads { sides, inlets, faces })
    }

    /// Force and moment in SI units; on the lattice the moment is about the domain's lower corner.
    fn load(&self, [force, moment]: [DVec3; 2]) -> SolidLoad {
        let size = self.scaling.cell_size;
        let force = force * self.scaling.stress_unit() * size * size;
        let moment = moment * self.scaling.stress_unit() * size.powi(3);
        SolidLoad { force, moment: moment + self.case.domain.min.cross(force) }
    }

    /// Marks the cells that solids cover.
    fn show_solids(&self, low: [usize; 3], cells: &mut Cells) {
        let solids = &self.grid.solids;
        if !solids.any() {
            return;
        }
        let [nx, ny, nz] = cells.count.map(|n| n.div_ceil(EDGE));
        for (i, j, k) in (0..nx * ny * nz).map(|n| (n % nx, n / nx % ny, n / nx / ny)) {
            let first = [i * EDGE, j * EDGE, k * EDGE];
            if !solids.reach([0, 1, 2].map(|a| low[a] + first[a]), EDGE) {
                continue;
            }
            for n in 0..CELLS {
                let at = [n % EDGE, n / EDGE % EDGE, n / EDGE / EDGE];
                let at = [0, 1, 2].map(|a| first[a] + at[a]);
                if (0..3).all(|a| at[a] < cells.count[a]) {
                    let cell = cells.index(at[0], at[1], at[2]);
                    cells.solid[cell] = u8::from(solids.cover([0, 1, 2].map(|a| low[a] + at[a])));
                }
            }
        }
    }

    /// What the cells of a block are like, and what walls bear there.
    fn see_block(&self, slot: usize) -> (Vec<Seen>, Loads) {
        let pressure_unit = self.scaling.stress_unit();
        let velocity_unit = self.scaling.velocity_unit();
        let rate_unit = 1.0 / self.scaling.time_step;
        let mut loads = Loads::new(self.grid.solids.count(), self.case.cages.len());
        let moves = self.grid.solids.any_moves();
        let mut all = Vec::new();
        self.fluid.moments(&self.grid, slot, &self.rows[slot], Some(&mut loads), |cell, m, omega| {
            let interface = self.grid.kinds[slot][cell / EDGE].interface >> (cell % EDGE) & 1 == 1;
            // omega = s/q, and q = 3 sigma + s/2.
            let q = m.q.to_f64();
            let rate = omega.to_f64() * q;
            all.push(Seen {
                cell,
                fill: match interface {
                    true => {
                        // Of what walls that move leave of it; between two there may be nothing left.
                        let room = 1.0 + if moves { self.grid.left_beside((slot, cell)) } else { 0.0 };
                        let whole = m.density.to_f64() * room.max(f64::EPSILON);
                        (self.grid.mass[slot][cell] / whole).clamp(0.0, 1.0)
                    }
                    false => 1.0,
                },
                pressure: m.excess_density.to_f64() / 3.0 * pressure_unit,
                velocity: DVec3::from(m.velocity.map(|u| u.to_f64() * velocity_unit)),
                shear_rate: rate * rate_unit,
                stress: (q - 0.5 * rate) / 3.0 * pressure_unit,
            });
        });
        (all, loads)
    }

    /// Puts what the cells of a block are like among all.
    fn show_block(&self, slot: usize, low: [usize; 3], seen: &[Seen], cells: &mut Cells) {
        for seen in seen {
            let cell = seen.cell;
            let at = self.grid.links[slot].coordinates(cell);
            let n = cells.index(at[0] - low[0], at[1] - low[1], at[2] - low[2]);
            for (q, (_, shares)) in cells.batches.iter_mut().enumerate() {
                shares[n] = self.grid.carried.value((slot, cell), q);
            }
            if let Some(cage) = &mut cells.cage {
                cage[n] = self.grid.cages.block(slot).share(cell);
            }
            if let Some(structure) = &mut cells.structure {
                structure[n] = self.grid.carried.structure(slot)[cell];
            }
            if let (Some(lying), Some(fibres)) = (&mut cells.lying, &self.fibres) {
                lying.tensors[n] = fibres.tensor((slot, cell));
            }
            cells.fill[n] = seen.fill;
            cells.pressure[n] = seen.pressure;
            cells.velocity[n] = seen.velocity;
            cells.shear_rate[n] = seen.shear_rate;
            cells.stress[n] = seen.stress;
        }
    }

    /// Lower corner and size in cells of the smallest box around the fluid, and around the solids that meet the domain.
    fn wet_box(&self) -> ([usize; 3], [usize; 3]) {
        let (mut low, mut high) = ([usize::MAX; 3], [0; 3]);
        for slot in self.grid.slots() {
            for (row, kinds) in self.grid.kinds[slot].iter().enumerate() {
                if kinds.wet() == 0 {
                    continue;
                }
                let (first, last) = (kinds.wet().trailing_zeros(), 7 - kinds.wet().leading_zeros());
                for lane in [first, last] {
                    let at = self.grid.links[slot].coordinates(row * EDGE + lane as usize);
                    for a in 0..3 {
                        low[a] = low[a].min(at[a]);
                        high[a] = high[a].max(at[a] + 1);
                    }
                }
            }
        }
        if low[0] == usize::MAX {
            return ([0; 3], [0; 3]);
        }
        for [first, end] in self.grid.solids.extents(self.grid.topology.cells) {
            for a in 0..3 {
                low[a] = low[a].min(first[a]);
                high[a] = high[a].max(end[a]);
            }
        }
        (low, [0, 1, 2].map(|a| high[a] - low[a]))
    }
}
