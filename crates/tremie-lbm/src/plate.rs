//! A solid that a load moves along a line, against what the fluid does to it.
//!
//! By bounce-back (modules `contact`, `loads`) the force on a wall is, by its velocity V along the line n, in lattice units
//!
//! ```text
//!     P = - sum over links of 2 f c.n - V Z + V^2 S,      Z = sum over links of 6 w rho (c.n)^2,     S = sum over links of 6 w rho c.n
//! ```
//!
//! with f the populations that are about to enter it; V^2 is taken as the speed times the one before. Of a cell of the surface that it has reached by a share s (module `contact`)
//! s V + (1 - s) u stands for V, u being the cell's own velocity, as long as that is less. So the speed with which it goes through the coming step is known before,
//!
//! ```text
//!     M (V - V_n) = F + P(V)
//! ```
//!
//! and the plate is stable however light it is (as particles with implicit updates of their velocities are: Nguyen and Ladd 2002). One without mass is held by Z alone, the impedance of the
//! fluid to sound. What is left of its oscillations is sound, which dies away as fast.

use tremie_case::{Case, Loaded};
use tremie_geometry::{Motion, Waypoint};
use tremie_numerics::DVec3;

use crate::contact::reached;
use crate::grid::Grid;
use crate::lattice::{Q, W, opposite, vector};
use crate::real::Real;
use crate::rows::Rows;
use crate::scaling::Scaling;
use crate::source::Source;

/// Speed of the plate in cells per step that it never exceeds; time steps shrink before that.
const FASTEST: f64 = 0.3;

/// The solid that a load moves.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Plate {
    pub(crate) loaded: Loaded,
    /// Way in m that it has gone.
    pub(crate) way: f64,
    /// Speed in m/s along its way.
    pub(crate) speed: f64,
    /// Load over the area that the fluid wets, in lattice units.
    pub(crate) pressure: f64,
}

/// What the fluid does to the plate in the coming step, in lattice units.
#[derive(Debug, Clone, Copy, Default)]
struct Resistance {
    /// Force along its way if it stays where it is.
    still: f64,
    /// How much that falls with its speed.
    impedance: f64,
    /// Part of the force that grows with the square of its speed.
    square: f64,
    /// Area across its way.
    area: f64,
}

impl Plate {
    /// That of a case at rest, if there is one.
    pub(crate) fn new(case: &Case) -> Option<Self> {
        Some(Self { loaded: case.loaded()?, way: 0.0, speed: 0.0, pressure: 0.0 })
    }

    /// Its motion from a time in s on.
    pub(crate) fn motion(&self, time: f64) -> Motion {
        let here = Waypoint { time, offset: self.way * self.loaded.direction };
        Motion::Through(here, self.speed * self.loaded.direction)
    }

    /// Acceleration in m/s2 that the load would give it and a mass of fluid in kg.
    pub(crate) fn acceleration(&self, fluid: f64) -> DVec3 {
        self.loaded.force / (self.loaded.mass + fluid) * self.loaded.direction
    }

    /// Finds how fast it goes in the coming step, as the fluid is.
    pub(crate) fn accelerate<T: Real>(&mut self, grid: &Grid<T>, rows: &[Rows], scaling: &Scaling) {
        let found = grid.resistance(rows, &self.loaded);
        let size = scaling.cell_size;
        let force = self.loaded.force / (scaling.stress_unit() * size * size);
        let mass = self.loaded.mass / (scaling.density * size.powi(3));
        let before = scaling.velocity(self.speed);
        let resists = mass + found.impedance - before * found.square;
        let speed = (mass * before + force + found.still) / resists;
        // One without mass that touches nothing falls as fast as it may.
        let speed = if speed.is_finite() { speed } else { FASTEST * force.signum() };
        self.speed = speed.clamp(-FASTEST, FASTEST) * scaling.velocity_unit();
        self.pressure = if found.area > 0.0 { force.abs() / found.area } else { 0.0 };
    }
}

impl<T: Real> Grid<T> {
    fn resistance(&self, rows: &[Rows], loaded: &Loaded) -> Resistance {
        let mut sum = Resistance::default();
        let n = loaded.direction;
        for slot in self.slots() {
            let source =
                Source::new(&self.topology, &self.solids, &self.inlets, &self.links[slot], &self.front, slot);
            for row in rows[slot].surface.iter().filter(|row| row.any_immersed != 0) {
                let first = usize::from(row.row) * crate::lanes::LANES;
                for (k, touching) in source.contacts(row, first).iter().enumerate() {
                    let mine = touching.iter().flatten().filter(|contact| contact.solid == loaded.solid);
                    for contact in mine {
                        let cell = first + k;
                        let leaving = |i: usize| self.front[slot][(i, cell)].to_f64();
                        let density = 1.0 + (0..Q).map(leaving).sum::<f64>();
                        let fluid = (1..Q).map(|i| vector(i) * leaving(i)).sum::<DVec3>() / density;
                        let interface = row.kinds.interface >> k & 1 == 1;
                        let ahead = (contact.velocity - fluid).dot(contact.normal) > 0.0;
                        let share = match interface && ahead {
                            true => reached(contact, self.fills[slot][(0, cell)].to_f64()),
                            false => 1.0,
                        };
                        for i in contact.links() {
                            let c = vector(i).dot(n);
                            let weight = 6.0 * W[i] * density;
                            sum.still -=
                                (2.0 * leaving(opposite(i)) + weight * (1.0 - share) * fluid.dot(n) * c) * c;
                            sum.impedance += share * weight * c * c;
                            sum.square += share * weight * c;
                            sum.area += 6.0 * W[i] * c.abs();
                        }
                    }
                }
            }
        }
        sum
    }
}
