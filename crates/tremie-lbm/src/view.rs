//! The state in SI units, as gauges and writers see it.
//!
//! Velocity, pressure, shear rate and stress of a cell are those that its next collision will use: the same pull, the
//! same moments, the same law.

use tremie_case::Side;
use tremie_numerics::DVec3;
use tremie_simulation::{Cells, Fluid, Simulation, Snapshot};

use crate::real::Real;
use crate::simulation::LatticeBoltzmann;
use crate::topology::EDGE;

impl<T: Real> LatticeBoltzmann<T> {
    pub(crate) fn take_snapshot(&self) -> Snapshot {
        let (low, count) = self.wet_box();
        let total = count.iter().product();
        let size = self.scaling.cell_size;
        let symmetric = |n: usize| self.case.domain.sides[n] == Side::Symmetry;
        let mut cells = Cells {
            origin: self.case.domain.min + size * DVec3::from(low.map(|n| n as f64)),
            size,
            count,
            fill: vec![0.0; total],
            pressure: vec![0.0; total],
            velocity: vec![DVec3::ZERO; total],
            shear_rate: vec![0.0; total],
            stress: vec![0.0; total],
            solid: vec![0; total],
            density: self.scaling.density,
            domain: [self.case.domain.min, self.case.domain.max],
            symmetry: [0, 1, 2].map(|a| [symmetric(2 * a), symmetric(2 * a + 1)]),
        };
        for slot in self.grid.slots() {
            self.show_block(slot, low, &mut cells);
        }
        Snapshot { time: self.time(), fluid: Fluid::Cells(cells) }
    }

    fn show_block(&self, slot: usize, low: [usize; 3], cells: &mut Cells) {
        let pressure_unit = self.scaling.stress_unit();
        let velocity_unit = self.scaling.velocity_unit();
        let rate_unit = 1.0 / self.scaling.time_step;
        let links = &self.grid.links[slot];
        self.fluid.moments(&self.grid, slot, &self.rows[slot], |cell, m, omega| {
            let at = links.coordinates(cell);
            let n = cells.index(at[0] - low[0], at[1] - low[1], at[2] - low[2]);
            let interface = self.grid.kinds[slot][cell / EDGE].interface >> (cell % EDGE) & 1 == 1;
            cells.fill[n] = if interface {
                (self.grid.mass[slot][cell] / m.density.to_f64()).clamp(0.0, 1.0)
            } else {
                1.0
            };
            cells.pressure[n] = m.excess_density.to_f64() / 3.0 * pressure_unit;
            cells.velocity[n] = DVec3::from(m.velocity.map(|u| u.to_f64() * velocity_unit));
            // omega = s/q, and q = 3 sigma + s/2.
            let q = m.q.to_f64();
            let rate = omega.to_f64() * q;
            cells.shear_rate[n] = rate * rate_unit;
            cells.stress[n] = (q - 0.5 * rate) / 3.0 * pressure_unit;
        });
    }

    /// Lower corner and size in cells of the smallest box around the fluid.
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
        (low, [0, 1, 2].map(|a| high[a] - low[a]))
    }
}
