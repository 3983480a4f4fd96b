//! The first state: which cells hold fluid, at which pressure, how fast.

use rayon::prelude::*;
use tremie_case::{Case, FluidRegion};
use tremie_geometry::share;
use tremie_numerics::DVec3;

use crate::collision::equilibrium;
use crate::grid::Grid;
use crate::lattice::{C, Q};
use crate::plan::confined_gravity;
use crate::real::Real;
use crate::scaling::Scaling;
use crate::topology::{CELLS, EDGE};

/// Fills closer to full than this are full.
const FULL: f64 = 1.0 - 1e-9;

impl<T: Real> Grid<T> {
    /// Puts the fluid of a case into an empty grid.
    pub(crate) fn fill(&mut self, case: &Case, scaling: &Scaling) {
        self.fill_blocks(case, scaling.cell_size);
        self.place_solids();
        let slots: Vec<usize> = self.slots().collect();
        for &slot in &slots {
            self.classify(slot);
        }
        self.count_wet();
        let gravity = (case.domain.gravity.to_array()).map(|g| scaling.acceleration(g));
        let depth = self.depths(case);
        let pressure = confined_gravity(case).abs().max_element();
        for &slot in &slots {
            for cell in 0..CELLS {
                let (row, bit) = (cell / EDGE, 1u8 << (cell % EDGE));
                let kinds = self.kinds[slot][row];
                if kinds.wet() & bit == 0 {
                    continue;
                }
                let fill = self.fills[slot][(0, cell)].to_f64();
                // d rho / dz = 3 g rho integrates to this.
                let excess = (3.0 * scaling.acceleration(pressure) * depth[slot][cell]).exp_m1();
                let centre = centre(case, scaling.cell_size, self.links[slot].coordinates(cell));
                let velocity = velocity_at(case, centre).to_array().map(|u| scaling.velocity(u));
                // Populations are those after a collision, in which the fluid has just felt the second half of the force.
                let pushed = [0, 1, 2].map(|a| velocity[a] + 0.5 * gravity[a] * fill);
                let f = equilibrium::<T>(excess, pushed);
                for i in 0..Q {
                    self.front[slot][(i, cell)] = f[i];
                }
                if kinds.interface & bit != 0 {
                    self.mass[slot][cell] = fill * (1.0 + excess);
                }
            }
        }
    }

    /// Allocates the blocks that hold fluid and stores the fill of their cells.
    fn fill_blocks(&mut self, case: &Case, size: f64) {
        let blocks = self.topology.blocks;
        let half_diagonal = 0.5 * 3f64.sqrt() * size * EDGE as f64;
        let fills = |n: usize| {
            let place = [n % blocks[0], n / blocks[0] % blocks[1], n / blocks[0] / blocks[1]];
            let middle = [0, 1, 2].map(|a| (place[a] * EDGE + EDGE / 2) as f64);
            let middle = case.domain.min + size * DVec3::from(middle);
            if !case.fluid.iter().any(|region| region.shape.signed_distance(middle) < half_diagonal) {
                return None;
            }
            let mut fills = Box::new([0.0; CELLS]);
            for (cell, fill) in fills.iter_mut().enumerate() {
                let at = [cell % EDGE, cell / EDGE % EDGE, cell / EDGE / EDGE];
                let at = [0, 1, 2].map(|a| place[a] * EDGE + at[a]);
                if (0..3).all(|a| at[a] < self.topology.cells[a]) {
                    let centre = centre(case, size, at);
                    // What lies in an outlet has left.
                    let drains = self.topology.drains(at);
                    *fill = if drains { 0.0 } else { self.share_of_fluid(case, centre, size) };
                }
            }
            fills.iter().any(|fill| *fill > 0.0).then_some((place, fills))
        };
        let number: usize = blocks.iter().product();
        let filled: Vec<_> = (0..number).into_par_iter().filter_map(fills).collect();
        for (place, fills) in filled {
            let slot = self.allocate(place);
            for (cell, fill) in fills.into_iter().enumerate() {
                self.fills[slot][(0, cell)] = T::from_f64(fill);
            }
        }
    }

    /// Share of fluid in what solids leave of a cell; none in a solid cell.
    fn share_of_fluid(&self, case: &Case, centre: DVec3, size: f64) -> f64 {
        let distance = self.solids.distance(centre);
        let half_diagonal = 0.5 * 3f64.sqrt() * size;
        if distance >= half_diagonal {
            return case.fluid.iter().map(|region| region.shape.fill(centre, size)).fold(0.0, f64::max);
        }
        if distance < 0.0 {
            return 0.0;
        }
        let fluid = |p| {
            let all = case.fluid.iter().map(|region| region.shape.signed_distance(p));
            all.fold(f64::INFINITY, f64::min)
        };
        let depth = -fluid(centre);
        if depth.abs() >= half_diagonal {
            return if depth > 0.0 { 1.0 } else { 0.0 };
        }
        let free = share(centre, size, |p| -self.solids.distance(p));
        let wet = share(centre, size, |p| fluid(p).max(-self.solids.distance(p)));
        if wet > 0.0 { wet / free } else { 0.0 }
    }

    /// Tells liquid from interface by fill and neighbours.
    fn classify(&mut self, slot: usize) {
        for cell in 0..CELLS {
            let full = |fill: T| fill.to_f64() >= FULL;
            let fill = self.fills[slot][(0, cell)];
            if fill <= T::ZERO {
                continue;
            }
            let beside_air = (1..Q).any(|i| {
                let (beside, at, _) = self.links[slot].cell(cell, C[i]);
                let solid = self.kinds[beside as usize][at / EDGE].solid >> (at % EDGE) & 1 == 1;
                !solid && self.fills[beside as usize][(0, at)] <= T::ZERO
            });
            let bit = 1u8 << (cell % EDGE);
            let kinds = &mut self.kinds[slot][cell / EDGE];
            if full(fill) && !beside_air { kinds.liquid |= bit } else { kinds.interface |= bit }
        }
    }

    /// Depth in cells of each cell's centre of mass below the top of its column of fluid, along the axis that gravity acts on most. What
    /// lies under a solid has the pressure of a body that is filled up to the highest fluid.
    fn depths(&self, case: &Case) -> Vec<[f64; CELLS]> {
        let mut depths = vec![[0.0; CELLS]; self.len()];
        let gravity = confined_gravity(case).to_array();
        let axis = (0..3).max_by(|a, b| gravity[*a].abs().total_cmp(&gravity[*b].abs())).unwrap_or(2);
        if gravity[axis] == 0.0 {
            return depths;
        }
        let n = self.topology.cells;
        let (p, r) = ((axis + 1) % 3, (axis + 2) % 3);
        let look = |column: usize, k: usize| {
            let mut at = [0; 3];
            at[p] = column % n[p];
            at[r] = column / n[p];
            at[axis] = if gravity[axis] < 0.0 { n[axis] - 1 - k } else { k };
            let slot = self.slot_at(at) as usize;
            let cell = at[0] % EDGE + EDGE * (at[1] % EDGE + EDGE * (at[2] % EDGE));
            let solid = self.kinds[slot][cell / EDGE].immersed >> (cell % EDGE) & 1 == 1;
            (slot, cell, self.fills[slot][(0, cell)].to_f64(), solid)
        };
        let mut level = f64::INFINITY;
        if self.solids.any() {
            for column in 0..n[p] * n[r] {
                let first = (0..n[axis]).map(|k| (k, look(column, k).2)).find(|(_, fill)| *fill > 0.0);
                level = first.map_or(level, |(k, fill)| level.min((k + 1) as f64 - fill));
            }
        }
        for column in 0..n[p] * n[r] {
            let mut depth = 0.0;
            for k in 0..n[axis] {
                let (slot, cell, fill, solid) = look(column, k);
                depths[slot][cell] = depth + fill - 0.5;
                depth = match fill > 0.0 {
                    true => depth + fill,
                    false if solid => ((k + 1) as f64 - level).max(0.0),
                    false => 0.0,
                };
            }
        }
        depths
    }
}

/// Centre in m of a cell.
pub(crate) fn centre(case: &Case, size: f64, at: [usize; 3]) -> DVec3 {
    case.domain.min + size * (DVec3::new(at[0] as f64, at[1] as f64, at[2] as f64) + 0.5)
}

/// Velocity in m/s that the case gives to the fluid at a point.
pub(crate) fn velocity_at(case: &Case, p: DVec3) -> DVec3 {
    region_at(case, p).map_or(DVec3::ZERO, |region| region.velocity)
}

/// The region of fluid nearest to a point.
pub(crate) fn region_at(case: &Case, p: DVec3) -> Option<&FluidRegion> {
    case.fluid.iter().min_by(|a, b| a.shape.signed_distance(p).total_cmp(&b.shape.signed_distance(p)))
}
