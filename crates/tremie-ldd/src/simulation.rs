//! Nodes as a simulation of a case.

use tremie_case::Case;
use tremie_cloud::{Failure, Follower, Surroundings, reorder};
use tremie_numerics::DVec3;
use tremie_output::state::{Array, State};
use tremie_simulation::scattered::{self, Scattered};
use tremie_simulation::{Breakdown, Load, RestoreError, Simulation, Snapshot, Wall};

use crate::nodes::Nodes;
use crate::setup;
use crate::stencils::Stencils;
use crate::viscosity::pulls;

/// Sweeps in which nodes make room for slanted walls before they start, and how far each may go in spacings.
const SETTLES: usize = 20;
const FAR: f64 = 0.5;
/// Speeds beyond so many times what a fall through the domain and walls give are a breakdown.
const RUNAWAY: f64 = 20.0;

/// A running simulation.
pub(crate) struct LagrangianDifferencing {
    case: Case,
    nodes: Nodes,
    /// Whose walls those of the nodes' space are.
    whose: Vec<Wall>,
    /// Nodes that have left.
    left: u64,
    /// Updates of nodes since the start of the process.
    updates: u64,
    /// Iterations of both linear systems since then.
    iterations: [u64; 2],
    /// A speed in m/s that is not reached by anything right.
    runaway: f64,
}

/// Nodes as a case has them.
///
/// # Panics
/// If the case is for another method.
pub fn simulation(case: &Case) -> Box<dyn Simulation> {
    Box::new(LagrangianDifferencing::new(case))
}

impl LagrangianDifferencing {
    fn new(case: &Case) -> Self {
        let (space, whose) = scattered::space(case);
        let (fluid, stepping) = (setup::fluid(case), setup::stepping(case));
        let (positions, velocities) = scattered::nodes(case, &space);
        let size = case.domain.max - case.domain.min;
        let fall = (2.0 * fluid.gravity.abs().dot(size)).sqrt();
        let walls = space.walls.iter().map(|wall| wall.motion.largest_speed(0.0) + wall.sliding.length());
        let fastest = walls.chain(velocities.iter().map(|u| u.length())).fold(fall, f64::max);
        let mut nodes = Nodes::new(positions, space, fluid, stepping);
        nodes.velocities = velocities;
        settle(&mut nodes);
        // Where nothing is known that drives it, there is no bound.
        let runaway = if fastest > 0.0 { RUNAWAY * fastest } else { f64::INFINITY };
        Self { case: case.clone(), nodes, whose, left: 0, updates: 0, iterations: [0; 2], runaway }
    }

    /// What a checkpoint must be for.
    fn identity(&self) -> String {
        let space = &self.nodes.space;
        format!("ldd, {} dimensions, spacing {} m", space.dimension.number(), space.spacing)
    }

    fn breakdown(&self, at: DVec3, what: String, advice: &str) -> Breakdown {
        Breakdown { time: self.nodes.time(), position: at, what, advice: advice.into() }
    }

    /// The fastest node, and how fast it is in m/s; not a number if one's speed is none.
    fn fastest(&self) -> (DVec3, f64) {
        let mut found = (DVec3::ZERO, 0.0);
        for (at, u) in self.nodes.positions.iter().zip(&self.nodes.velocities) {
            let speed = u.length();
            if speed.is_nan() {
                return (*at, speed);
            }
            if speed > found.1 {
                found = (*at, speed);
            }
        }
        found
    }

    /// Takes out nodes that have left through open sides.
    fn drain(&mut self) {
        if !self.case.has_outlets() {
            return;
        }
        let domain = &self.case.domain;
        let stays: Vec<bool> = self.nodes.positions.iter().map(|at| domain.holds(*at)).collect();
        self.left += stays.iter().filter(|stays| !**stays).count() as u64;
        self.nodes.keep(&stays);
    }
}

/// Lets nodes that a lattice has put too near to slanted walls, or too far from them, make room.
fn settle(nodes: &mut Nodes) {
    if nodes.space.walls.iter().all(|wall| !wall.hides) {
        return;
    }
    let space = nodes.space.clone();
    let around = Surroundings::new(&nodes.positions, &space, 0.0, 1.0);
    let followers: Vec<Follower> = around.sources[around.number..]
        .iter()
        .map(|source| Follower { of: source.of, turn: source.mirror })
        .collect();
    let most = vec![FAR * space.spacing; around.number];
    let free = vec![DVec3::ZERO; around.number];
    let ways = reorder(
        &around.positions,
        &around.near,
        &followers,
        space.spacing,
        space.dimension,
        &most,
        &free,
        SETTLES,
    );
    nodes.positions.iter_mut().zip(ways).for_each(|(at, way)| *at += way);
}

impl Simulation for LagrangianDifferencing {
    fn time(&self) -> f64 {
        self.nodes.time()
    }

    fn time_step(&self) -> f64 {
        self.nodes.time_step()
    }

    fn advance(&mut self) -> Result<(), Breakdown> {
        self.updates += self.nodes.positions.len() as u64;
        if let Err(failure) = self.nodes.advance() {
            let (at, _) = self.fastest();
            let advice = match failure {
                Failure::Slow { .. } => "set a smaller `largest_viscosity` or `courant` under [ldd]",
                Failure::Breakdown { .. } => "set a smaller `courant` or `spacing` under [ldd]",
            };
            return Err(self.breakdown(at, failure.to_string(), advice));
        }
        for (all, taken) in self.iterations.iter_mut().zip(self.nodes.iterations) {
            *all += taken as u64;
        }
        self.drain();
        let (at, speed) = self.fastest();
        if speed.is_nan() || speed > self.runaway {
            let what = format!("a node runs away at {speed:.3e} m/s");
            return Err(self.breakdown(at, what, "set a smaller `courant` or `spacing` under [ldd]"));
        }
        Ok(())
    }

    fn snapshot(&self) -> Snapshot {
        let (nodes, time, step) = (&self.nodes, self.nodes.time(), self.nodes.time_step());
        let viscosities: Vec<f64> =
            nodes.shear_rates.iter().map(|rate| nodes.fluid.viscosity(*rate)).collect();
        let around = nodes.surroundings(step);
        let stencils = Stencils::new(&around, &around.gradients(), nodes.stepping.operators);
        let pulls = pulls(&stencils, &viscosities, &nodes.velocities, nodes.space.spacing.powi(3));
        let nodes = Scattered {
            case: &self.case,
            space: &nodes.space,
            whose: &self.whose,
            time,
            step,
            positions: &nodes.positions,
            velocities: &nodes.velocities,
            pressures: &nodes.pressures,
            shear_rates: &nodes.shear_rates,
            viscosities: &viscosities,
            left: self.left,
        };
        nodes.view(&pulls)
    }

    fn load(&self) -> Load {
        let number = self.nodes.positions.len();
        Load {
            wet: number,
            allocated: number,
            bytes: self.nodes.bytes(),
            updates: self.updates,
            iterations: self.iterations,
        }
    }

    fn save(&self) -> State {
        let nodes = &self.nodes;
        let flat = |vectors: &[DVec3]| Array::F64(vectors.iter().flat_map(|v| v.to_array()).collect());
        State {
            header: serde_json::json!({
                "for": self.identity(),
                "time": nodes.time(),
                "last step": nodes.last_step,
                "left": self.left,
            }),
            arrays: vec![
                ("positions".into(), flat(&nodes.positions)),
                ("velocities".into(), flat(&nodes.velocities)),
                ("pressures".into(), Array::F64(nodes.pressures.clone())),
                ("shear rates".into(), Array::F64(nodes.shear_rates.clone())),
            ],
        }
    }

    fn restore(&mut self, state: &State) -> Result<(), RestoreError> {
        let found = state.header["for"].as_str().unwrap_or("another program").to_owned();
        if found != self.identity() {
            return Err(RestoreError::Mismatch { expected: self.identity(), found });
        }
        let missing = |name: &str| RestoreError::Array(name.into());
        let numbers = |name: &str| match state.arrays.iter().find(|(n, _)| n == name) {
            Some((_, Array::F64(numbers))) => Ok(numbers),
            _ => Err(missing(name)),
        };
        let vectors = |name: &str| -> Result<Vec<DVec3>, RestoreError> {
            let (vectors, rest) = numbers(name)?.as_chunks::<3>();
            if rest.is_empty() {
                Ok(vectors.iter().map(|v| DVec3::from(*v)).collect())
            } else {
                Err(missing(name))
            }
        };
        let positions = vectors("positions")?;
        let same = |name: &str, count: usize| {
            if count == positions.len() { Ok(()) } else { Err(missing(name)) }
        };
        let velocities = vectors("velocities")?;
        let (pressures, shear_rates) = (numbers("pressures")?.clone(), numbers("shear rates")?.clone());
        same("velocities", velocities.len())?;
        same("pressures", pressures.len())?;
        same("shear rates", shear_rates.len())?;
        let time = state.header["time"].as_f64().ok_or_else(|| missing("time"))?;
        self.left = state.header["left"].as_u64().ok_or_else(|| missing("left"))?;
        let last_step = state.header["last step"].as_f64().ok_or_else(|| missing("last step"))?;
        let nodes = &mut self.nodes;
        (nodes.time, nodes.last_step) = (time, last_step);
        (nodes.positions, nodes.velocities) = (positions, velocities);
        (nodes.pressures, nodes.shear_rates) = (pressures, shear_rates);
        Ok(())
    }
}
