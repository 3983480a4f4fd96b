//! A simulation under way, as benchmarks drive it: to a time, to a steady flow, to rest.

use std::time::{Duration, Instant};

use anyhow::ensure;
use tremie_case::{Case, Lbm, Method};
use tremie_numerics::DVec3;
use tremie_simulation::gauges::{Gauges, Readings};
use tremie_simulation::rest::RestWatch;
use tremie_simulation::{Cells, Fluid, Simulation};
use tremie_suspension::Suspension;

use crate::terminal;

/// A simulation of a case and its gauges.
pub(super) struct Flow {
    case: Case,
    /// The simulation itself.
    pub(super) simulation: Box<dyn Simulation>,
    /// When it began, or was last told how far it is.
    told: Instant,
}

/// Wall-clock time between two lines that say how far a simulation is.
const LINE_INTERVAL: Duration = Duration::from_secs(60);

impl Flow {
    /// The case at time zero.
    pub(super) fn new(case: Case) -> Self {
        let simulation = crate::plan::simulation(&case);
        Self { case, simulation, told: Instant::now() }
    }

    /// The case at time zero with these bodies in it.
    pub(super) fn with(case: Case, suspension: Suspension) -> Self {
        let simulation = tremie_lbm::simulation_with(&case, Some(suspension));
        Self { case, simulation, told: Instant::now() }
    }

    /// The fluid at present.
    pub(super) fn cells(&self) -> Cells {
        let Fluid::Cells(cells) = self.simulation.snapshot().fluid;
        cells
    }

    /// The gauges at present.
    pub(super) fn readings(&self) -> Readings {
        Gauges::new(&self.case).measure(&self.simulation.snapshot())
    }

    /// Advances by a number of steps.
    pub(super) fn steps(&mut self, number: u64) -> anyhow::Result<()> {
        for _ in 0..number {
            self.advance()?;
        }
        Ok(())
    }

    /// Advances to the first step at or past a time in s.
    pub(super) fn until(&mut self, time: f64) -> anyhow::Result<()> {
        while self.simulation.time() < time {
            self.advance()?;
        }
        Ok(())
    }

    fn advance(&mut self) -> anyhow::Result<()> {
        self.simulation.advance()?;
        if self.told.elapsed() >= LINE_INTERVAL {
            self.told = Instant::now();
            terminal::note(&format!("  {}: t = {:.3} s", self.case.title, self.simulation.time()));
        }
        Ok(())
    }

    /// Advances until no velocity has changed by more than the share `change` of the largest one over the time
    /// `interval` in s, and gives the fluid then.
    ///
    /// Take the diffusion time of the flow for `interval`: what is left to change is then of the size of `change`.
    pub(super) fn until_steady(&mut self, interval: f64, change: f64) -> anyhow::Result<Cells> {
        let mut before = self.cells();
        loop {
            self.until(self.simulation.time() + interval)?;
            let now = self.cells();
            let largest = now.velocity.iter().map(|u| u.length()).fold(0.0, f64::max);
            let moved = largest_difference(&now.velocity, &before.velocity);
            if now.count == before.count && moved <= change * largest && largest > 0.0 {
                return Ok(now);
            }
            let time = self.simulation.time();
            ensure!(
                time < self.case.stop.time,
                "not steady after {time} s: velocities still change by {:e} of the largest",
                moved / largest
            );
            before = now;
        }
    }

    /// Advances until the stop rule of the case sees rest, and gives the readings then; `see` is shown all on the way.
    pub(super) fn until_rest(&mut self, see: impl Fn(&Readings)) -> anyhow::Result<Readings> {
        let Some(rest) = self.case.stop.rest else { anyhow::bail!("the case has no stop rule for rest") };
        let mut watch = RestWatch::default();
        let mut reading = 0u32;
        loop {
            let readings = self.readings();
            see(&readings);
            watch.update(&rest, &readings);
            let settled = !self.case.solids_move(readings.time) && !self.case.pours(readings.time);
            if settled && watch.reached(&rest) {
                return Ok(readings);
            }
            ensure!(
                readings.time < self.case.stop.time,
                "not at rest after {} s: 99 % of the fluid slower than {} m/s",
                readings.time,
                readings.speed_p99
            );
            reading += 1;
            self.until(f64::from(reading) * self.case.gauges.interval)?;
        }
    }
}

/// Largest difference between two fields of vectors.
pub(super) fn largest_difference(a: &[DVec3], b: &[DVec3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a.distance(*b)).fold(0.0, f64::max)
}

/// The settings of a case's lattice, to vary them.
///
/// # Panics
/// If the benchmark's case is for another method.
pub(super) fn lattice(case: &mut Case) -> &mut Lbm {
    match &mut case.method {
        Method::Lbm(lbm) => lbm,
        other => panic!("the case is for the method {}", other.name()),
    }
}

/// Number of the cell around a point, if the snapshot reaches so far.
pub(super) fn cell_at(cells: &Cells, place: DVec3) -> Option<usize> {
    let at = ((place - cells.origin) / cells.size).floor().to_array();
    let within = (0..3).all(|a| at[a] >= 0.0 && at[a] < cells.count[a] as f64);
    within.then(|| cells.index(at[0] as usize, at[1] as usize, at[2] as usize))
}

/// Centres of all cells of the domain.
pub(super) fn centres(cells: &Cells) -> impl Iterator<Item = DVec3> {
    let (low, size) = (cells.domain[0], cells.size);
    let count = ((cells.domain[1] - low) / size).round().to_array().map(|n| n as usize);
    (0..count.iter().product()).map(move |n| {
        let at = [n % count[0], n / count[0] % count[1], n / count[0] / count[1]];
        low + size * DVec3::from(at.map(|i| i as f64 + 0.5))
    })
}
