//! A cell between two walls that move against each other, with bodies in it: how benchmarks of shear set it up and what they read from it.
//!
//! The walls are across z and go along x, each at half the speed, so that the middle is at rest; x and y are periodic. Sizes are in cells, viscosities
//! in units of the lattice; the rate comes from a Reynolds number `rate length^2 / viscosity`.

use tremie_case::{Case, Side};
use tremie_numerics::DVec3;
use tremie_simulation::{Cells, Snapshot};
use tremie_suspension::{ContactLaw, Freedom, Inclusions, Method, Region, Suspension};

use super::flow::{Flow, lattice};

/// A cell that is sheared.
#[derive(Clone)]
pub(super) struct Shear {
    /// The case, its walls moving.
    pub(super) case: Case,
    /// Speed of the walls against each other over their distance, in 1/s.
    pub(super) rate: f64,
    /// Steps in which this is a shear of one.
    pub(super) steps: f64,
}

impl Shear {
    /// So many cells, and the Reynolds number of a body that is `length` cells long.
    pub(super) fn new(mut case: Case, cells: [usize; 3], viscosity: f64, reynolds: f64, length: f64) -> Self {
        let size = lattice(&mut case).cell_size;
        case.domain.max = case.domain.min + size * DVec3::from(cells.map(|n| n as f64));
        let kinematic = case.material.curve.plastic_viscosity() / case.material.density;
        let step = viscosity * size * size / kinematic;
        lattice(&mut case).time_step = Some(step);
        let rate = reynolds * kinematic / (length * size).powi(2);
        let speed = 0.5 * rate * size * cells[2] as f64;
        for (side, speed) in [(4, -speed), (5, speed)] {
            if let Side::Wall { velocity, .. } = &mut case.domain.sides[side] {
                *velocity = speed * DVec3::X;
            }
        }
        Self { case, rate, steps: 1.0 / (rate * step) }
    }

    /// Edge of a cell in m.
    pub(super) fn size(&mut self) -> f64 {
        lattice(&mut self.case).cell_size
    }

    /// Centre of the cell.
    pub(super) fn middle(&self) -> DVec3 {
        0.5 * (self.case.domain.min + self.case.domain.max)
    }

    /// Velocity in m/s that undisturbed fluid has.
    pub(super) fn velocity(&self, at: DVec3) -> DVec3 {
        self.rate * (at - self.middle()).z * DVec3::X
    }

    /// Puts bodies between the walls by `place`, which is told the region that is free.
    pub(super) fn between_walls<E>(&self, place: impl FnOnce(&Region) -> Result<(), E>) -> Result<(), E> {
        let (low, high) = (self.case.domain.min, self.case.domain.max);
        let distance = move |at: DVec3| (low.z - at.z).max(at.z - high.z);
        place(&Region { low, high, distance: &distance })
    }

    /// These bodies, in the space of the cell.
    pub(super) fn suspension(&self, bodies: Inclusions, freedom: Freedom) -> Suspension {
        let (origin, periods) = (self.case.domain.min, self.case.periods());
        Suspension::new(
            bodies,
            Method { freedom, ..Method::default() },
            ContactLaw::default(),
            origin,
            periods,
        )
    }

    /// The fluid with bodies in it.
    pub(super) fn flow(&self, suspension: Suspension) -> Flow {
        Flow::with(self.case.clone(), suspension)
    }

    /// Shear stress on the walls over that without bodies: in the mean of both.
    pub(super) fn relative_stress(&self, snapshot: &Snapshot) -> f64 {
        let extent = self.case.domain.max - self.case.domain.min;
        let alone = self.case.material.curve.stress(self.rate) * extent.x * extent.y;
        0.5 * (snapshot.walls.sides[4].force - snapshot.walls.sides[5].force).x / alone
    }
}

/// Mean velocity along x in m/s of each layer of cells.
pub(super) fn layers(cells: &Cells) -> Vec<f64> {
    let layer = cells.count[0] * cells.count[1];
    cells
        .velocity
        .chunks(layer)
        .map(|layer| layer.iter().map(|u| u.x).sum::<f64>() / layer.len() as f64)
        .collect()
}

/// Shear rate of layers that are `size` in m thick, but for so many at each wall: that of the straight line of least squares.
pub(super) fn core_rate(layers: &[f64], walls: usize, size: f64) -> f64 {
    let core = &layers[walls..layers.len() - walls];
    let points: Vec<(f64, f64)> = core.iter().enumerate().map(|(k, u)| (k as f64 * size, *u)).collect();
    line(&points).1
}

/// The straight line of least squares through points (x, y): its value at zero and its slope.
pub(super) fn line(points: &[(f64, f64)]) -> (f64, f64) {
    let number = points.len() as f64;
    let mean = |of: &dyn Fn(&(f64, f64)) -> f64| points.iter().map(of).sum::<f64>() / number;
    let (x, y) = (mean(&|p| p.0), mean(&|p| p.1));
    let slope = mean(&|p| (p.0 - x) * (p.1 - y)) / mean(&|p| (p.0 - x).powi(2));
    (y - slope * x, slope)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_rate_of_the_core_is_that_of_its_layers_only() {
        let profile: Vec<f64> =
            (0..16).map(|k| if (4..12).contains(&k) { 0.3 * f64::from(k) } else { 9.0 }).collect();
        assert!((core_rate(&profile, 4, 0.1) - 3.0).abs() < 1e-11);
    }
}
