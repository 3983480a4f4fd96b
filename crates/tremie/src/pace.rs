//! How long a step of a case takes, by trial.
//!
//! What is there at the start is run for a moment. What comes in later is not there yet: a closed box full of the same fluid, at rest and with
//! as many bodies in its volume, tells what a cell of it costs. Its walls, its flow and what its bodies do to each other cost more.

use std::time::{Duration, Instant};

use tremie_case::{Case, Domain, FluidRegion, Incoming, Side};
use tremie_geometry::Shape;
use tremie_numerics::DVec3;
use tremie_simulation::Simulation;
use tremie_suspension::{Amount, AtWalls, Inclusions, Kind, Order, Periods, Region, place};

use crate::plan::{self, Plan};

/// Wall-clock time for which a simulation is run to see how fast it is.
const TRIAL: Duration = Duration::from_millis(500);
/// Steps before that, in which memory and caches warm up.
const WARM_UP: usize = 3;
/// Edge in cells of the box that stands for what comes in.
const EDGE: f64 = 24.0;

/// How fast a simulation is, in the mean of its run.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Pace {
    /// Wall-clock seconds a step; without the bodies' motion and contacts where they are still to come.
    pub(crate) step: f64,
    /// Updates of wet cells per wall-clock second.
    pub(crate) updates: f64,
    /// What bodies add to a step, as a share of it.
    pub(crate) burden: f64,
}

/// What a trial of a simulation says.
struct Trial {
    /// Wall-clock seconds a step.
    step: f64,
    /// Updates of wet cells a step.
    cells: f64,
}

impl Trial {
    /// For a moment, or to where the case ends in s.
    fn of(mut simulation: Box<dyn Simulation>, end: f64) -> anyhow::Result<Self> {
        for _ in 0..WARM_UP {
            simulation.advance()?;
        }
        let (began, before) = (Instant::now(), simulation.load().updates);
        let mut steps = 0.0;
        while steps == 0.0 || (began.elapsed() < TRIAL && simulation.time() < end) {
            simulation.advance()?;
            steps += 1.0;
        }
        let seconds = began.elapsed().as_secs_f64();
        Ok(Self { step: seconds / steps, cells: (simulation.load().updates - before) as f64 / steps })
    }

    /// Of a case, and of its fluid alone.
    fn both(case: &Case) -> anyhow::Result<[Self; 2]> {
        let alone = Self::of(tremie_lbm::simulation_with(case, None), case.stop.time)?;
        let with = match case.has_bodies() {
            false => Self { ..alone },
            true => Self::of(tremie_lbm::simulation(case), case.stop.time)?,
        };
        Ok([with, alone])
    }
}

impl Pace {
    /// Measures that of a case.
    ///
    /// # Errors
    /// If the simulation breaks down in its first steps.
    pub(crate) fn of(case: &Case, plan: &Plan) -> anyhow::Result<Self> {
        let Plan::Lattice(plan) = plan else {
            let Trial { step, cells } = Trial::of(plan::simulation(case), case.stop.time)?;
            return Ok(Self { step, updates: cells / step, burden: 0.0 });
        };
        let [start, start_alone] = Trial::both(case)?;
        let (mut step, mut alone, mut cells) = (start.step, start_alone.step, start.cells);
        if !case.inlets.is_empty() {
            let [all, fluid] = Trial::both(&standing_in(case, plan.inflow))?;
            let more = mean_inflow(case) / plan.scaling.cell_size.powi(3);
            step += more * all.step / all.cells;
            alone += more * fluid.step / fluid.cells;
            cells += more;
        }
        Ok(Self { step, updates: cells / step, burden: (step / alone - 1.0).max(0.0) })
    }
}

/// Volume in m3 that has come in, in the mean over the time to the case's stop.
fn mean_inflow(case: &Case) -> f64 {
    let stop = case.stop.time;
    let of = |(start, end, rate): (f64, f64, f64)| rate * (end - start) * (stop - 0.5 * (start + end)) / stop;
    let inlets = case.inlets.iter().map(|inlet| (inlet.start, inlet.end().min(stop), inlet.flow_rate));
    inlets.filter(|(start, end, _)| start < end).map(of).sum()
}

/// A closed box full of what comes in, of which there is so much in m3. Bodies for which the box is too narrow are left out.
fn standing_in(case: &Case, inflow: f64) -> Case {
    let (min, edge) = (case.domain.min, EDGE * case.method.resolution());
    let max = min + DVec3::splat(edge);
    let mut bodies = Inclusions::default();
    let region = Region { low: min, high: max, distance: &|at| (min - at).max(at - max).max_element() };
    for (inlet, incoming) in
        case.inlets.iter().flat_map(|inlet| inlet.inclusions.iter().map(move |of| (inlet, of)))
    {
        let Incoming { name, density, form, share, direction, seed } = incoming.clone();
        bodies.kinds.push(Kind { name, form, density });
        let kind = (bodies.kinds.len() - 1) as u16;
        let share =
            share * inlet.flow_rate * (inlet.end().min(case.stop.time) - inlet.start).max(0.0) / inflow;
        let order = Order {
            kind,
            batch: 0,
            amount: Amount::Share(share),
            direction,
            at_walls: AtWalls::Turned,
            seed,
        };
        if place(&mut bodies, &order, &region, &Periods::default()).is_err() {
            bodies.kinds.pop();
        }
    }
    let fluid =
        FluidRegion { shape: Shape::Box { min, max }, velocity: DVec3::ZERO, batch: None, structure: None };
    Case {
        domain: Domain { max, sides: [Side::REST; 6], ..case.domain },
        fluid: vec![fluid],
        inlets: Vec::new(),
        outlets: Vec::new(),
        solids: Vec::new(),
        cages: Vec::new(),
        meshes: Vec::new(),
        groups: Vec::new(),
        inclusions: bodies,
        ..case.clone()
    }
}
