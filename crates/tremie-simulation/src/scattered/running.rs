//! A cloud of nodes as a running simulation of a case: how it begins, goes on, is seen, saved and restored. What moves the nodes is the method's.

use serde_json::Value;
use tremie_case::Case;
use tremie_cloud::{Failure, Follower, Space, Surroundings, reorder};
use tremie_numerics::DVec3;
use tremie_output::state::{Array, State};

use super::setup::{nodes, pressed_speed, space};
use super::view::{Pull, Scattered};
use crate::{Breakdown, Load, RestoreError, Simulation, Snapshot, Wall};

/// Sweeps in which nodes make room for slanted walls before they start, and how far each may go in spacings.
const SETTLES: usize = 20;
const FAR: f64 = 0.5;
/// Speeds beyond so many times what a fall through the domain and walls give are a breakdown.
const RUNAWAY: f64 = 20.0;

/// What is known of nodes: places in m, velocities in m/s, pressures in Pa and shear rates in 1/s.
#[derive(Debug)]
pub struct Known<V, S> {
    /// Places in m.
    pub positions: V,
    /// Velocities in m/s.
    pub velocities: V,
    /// Pressures in Pa.
    pub pressures: S,
    /// Shear rates in 1/s.
    pub shear_rates: S,
}

/// Nodes that a method moves.
pub trait Cloud: Send {
    /// What one of them is called.
    const NODE: &'static str;

    /// Where they are, and its walls.
    fn space(&self) -> &Space;
    /// Time in s.
    fn time(&self) -> f64;
    /// Length in s of the step that is taken next.
    fn time_step(&self) -> f64;
    /// What is known of them.
    fn known(&self) -> Known<&[DVec3], &[f64]>;
    /// The same to be changed.
    fn known_mut(&mut self) -> Known<&mut Vec<DVec3>, &mut Vec<f64>>;
    /// Apparent viscosity in Pa s at a shear rate in 1/s.
    fn viscosity(&self, shear_rate: f64) -> f64;
    /// How walls are pulled by what is viscous in the fluid of these viscosities in Pa s; a step is so long in s.
    fn pulls(&self, viscosities: &[f64], step: f64) -> Vec<Pull>;

    /// Goes on by a step, and gives the iterations that it took: of the viscous part and of the pressure.
    ///
    /// # Errors
    /// If a linear system cannot be solved.
    fn go_on(&mut self) -> Result<[usize; 2], Failure>;

    /// What else a checkpoint must hold.
    fn more(&self) -> Value;

    /// Goes to a time in s of which all else is known already.
    ///
    /// # Errors
    /// The name of what is missing.
    fn go_back(&mut self, time: f64, more: &Value) -> Result<(), &'static str>;
}

/// A running simulation.
#[derive(Debug)]
pub struct Running<C> {
    case: Case,
    cloud: C,
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

impl<C: Cloud> Running<C> {
    /// A case at time zero; `make` makes the cloud of places in m in a space, whose walls are told.
    pub fn new(case: &Case, make: impl FnOnce(Vec<DVec3>, Space, &[Wall]) -> C) -> Self {
        let (space, whose) = space(case);
        let (positions, velocities) = nodes(case, &space);
        let size = case.domain.max - case.domain.min;
        let fall = (2.0 * case.domain.gravity.abs().dot(size)).sqrt();
        // What walls drive out between them goes faster than they do, as the fluid is wider than high.
        let (low, high) = case.fluid_box();
        let wide = (high - low).max_element() / (high - low).min_element();
        let walls = space
            .walls
            .iter()
            .map(|wall| wide.max(1.0) * wall.motion.largest_speed(0.0) + wall.sliding.length());
        let pressed = pressed_speed(case, positions.len());
        let fastest = walls.chain(velocities.iter().map(|u| u.length())).fold(fall.max(pressed), f64::max);
        // Where nothing is known that drives it, there is no bound.
        let runaway = if fastest > 0.0 { RUNAWAY * fastest } else { f64::INFINITY };
        let mut cloud = make(positions, space, &whose);
        *cloud.known_mut().velocities = velocities;
        settle(&mut cloud);
        Self { case: case.clone(), cloud, whose, left: 0, updates: 0, iterations: [0; 2], runaway }
    }

    /// What a checkpoint must be for.
    fn identity(&self) -> String {
        let (method, space) = (self.case.method.name(), self.cloud.space());
        format!("{method}, {} dimensions, spacing {} m", space.dimension.number(), space.spacing)
    }

    /// A breakdown somewhere, against which smaller values of these settings are likely to help.
    fn breakdown(&self, at: DVec3, what: String, settings: &str) -> Breakdown {
        let advice = format!("set a smaller {settings} under [{}]", self.case.method.name());
        Breakdown { time: self.cloud.time(), position: at, what, advice }
    }

    /// The fastest node, and how fast it is in m/s; not a number if one's speed is none.
    fn fastest(&self) -> (DVec3, f64) {
        let mut found = (DVec3::ZERO, 0.0);
        let known = self.cloud.known();
        for (at, u) in known.positions.iter().zip(known.velocities) {
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
        fn only<T>(of: &mut Vec<T>, stays: &[bool]) {
            let mut stays = stays.iter();
            of.retain(|_| stays.next().is_some_and(|stays| *stays));
        }
        if !self.case.has_outlets() {
            return;
        }
        let domain = &self.case.domain;
        let known = self.cloud.known_mut();
        let stays: Vec<bool> = known.positions.iter().map(|at| domain.holds(*at)).collect();
        self.left += stays.iter().filter(|stays| !**stays).count() as u64;
        only(known.positions, &stays);
        only(known.velocities, &stays);
        only(known.pressures, &stays);
        only(known.shear_rates, &stays);
    }
}

/// Lets nodes that a lattice has put too near to slanted walls, or too far from them, make room.
fn settle(cloud: &mut impl Cloud) {
    let space = cloud.space();
    if space.walls.iter().all(|wall| !wall.hides) {
        return;
    }
    let around = Surroundings::new(cloud.known().positions, space, 0.0, 1.0);
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
    cloud.known_mut().positions.iter_mut().zip(ways).for_each(|(at, way)| *at += way);
}

impl<C: Cloud> Simulation for Running<C> {
    fn time(&self) -> f64 {
        self.cloud.time()
    }

    fn time_step(&self) -> f64 {
        self.cloud.time_step()
    }

    fn advance(&mut self) -> Result<(), Breakdown> {
        self.updates += self.cloud.known().positions.len() as u64;
        match self.cloud.go_on() {
            Ok(taken) => self.iterations.iter_mut().zip(taken).for_each(|(all, taken)| *all += taken as u64),
            Err(failure) => {
                let settings = match failure {
                    Failure::Slow { .. } => "`largest_viscosity` or `courant`",
                    Failure::Breakdown { .. } => "`courant` or `spacing`",
                };
                return Err(self.breakdown(self.fastest().0, failure.to_string(), settings));
            }
        }
        self.drain();
        let (at, speed) = self.fastest();
        if speed.is_nan() || speed > self.runaway {
            let what = format!("a {} runs away at {speed:.3e} m/s", C::NODE);
            return Err(self.breakdown(at, what, "`courant` or `spacing`"));
        }
        Ok(())
    }

    fn see(&self, snapshot: &mut Snapshot) {
        let (known, step) = (self.cloud.known(), self.cloud.time_step());
        let viscosities: Vec<f64> =
            known.shear_rates.iter().map(|rate| self.cloud.viscosity(*rate)).collect();
        let nodes = Scattered {
            case: &self.case,
            space: self.cloud.space(),
            whose: &self.whose,
            time: self.cloud.time(),
            step,
            positions: known.positions,
            velocities: known.velocities,
            pressures: known.pressures,
            shear_rates: known.shear_rates,
            viscosities: &viscosities,
            left: self.left,
        };
        nodes.show(&self.cloud.pulls(&viscosities, step), snapshot);
    }

    fn load(&self) -> Load {
        let number = self.cloud.known().positions.len();
        Load {
            wet: number,
            allocated: number,
            bytes: number * (2 * size_of::<DVec3>() + 2 * size_of::<f64>()),
            updates: self.updates,
            iterations: self.iterations,
        }
    }

    fn save(&self) -> State {
        let known = self.cloud.known();
        let flat = |vectors: &[DVec3]| Array::F64(vectors.iter().flat_map(|v| v.to_array()).collect());
        State {
            header: serde_json::json!({
                "for": self.identity(),
                "time": self.cloud.time(),
                "left": self.left,
                "more": self.cloud.more(),
            }),
            arrays: vec![
                ("positions".into(), flat(known.positions)),
                ("velocities".into(), flat(known.velocities)),
                ("pressures".into(), Array::F64(known.pressures.to_vec())),
                ("shear rates".into(), Array::F64(known.shear_rates.to_vec())),
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
            Some((_, Array::F64(numbers))) => Ok(numbers.as_slice()),
            _ => Err(missing(name)),
        };
        let (places, rest) = numbers("positions")?.as_chunks::<3>();
        if !rest.is_empty() {
            return Err(missing("positions"));
        }
        let same = |name: &str, of_each: usize| {
            let numbers = numbers(name)?;
            if numbers.len() == of_each * places.len() { Ok(numbers) } else { Err(missing(name)) }
        };
        let (velocities, _) = same("velocities", 3)?.as_chunks::<3>();
        let (pressures, shear_rates) = (same("pressures", 1)?, same("shear rates", 1)?);
        let time = state.header["time"].as_f64().ok_or_else(|| missing("time"))?;
        self.left = state.header["left"].as_u64().ok_or_else(|| missing("left"))?;
        let vectors = |of: &[[f64; 3]]| of.iter().map(|v| DVec3::from(*v)).collect();
        let known = self.cloud.known_mut();
        (*known.positions, *known.velocities) = (vectors(places), vectors(velocities));
        (*known.pressures, *known.shear_rates) = (pressures.to_vec(), shear_rates.to_vec());
        self.cloud.go_back(time, &state.header["more"]).map_err(missing)
    }
}
