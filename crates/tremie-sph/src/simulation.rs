//! Particles as a simulation of a case.

use tremie_case::{Case, Scheme};
use tremie_cloud::{Failure, Follower, Surroundings, reorder};
use tremie_numerics::DVec3;
use tremie_output::state::{Array, State};
use tremie_simulation::scattered::{self, Pull, Scattered};
use tremie_simulation::{Breakdown, Load, RestoreError, Simulation, Snapshot, Wall};

use crate::particles::Particles;
use crate::plate::Plate;
use crate::setup;
use crate::three_steps::PressureStep;
use crate::viscosity::pulls;

/// Sweeps in which particles make room for slanted walls before they start, and how far each may go in spacings.
const SETTLES: usize = 20;
const FAR: f64 = 0.5;
/// Speeds beyond so many times what a fall through the domain and walls give are a breakdown.
const RUNAWAY: f64 = 20.0;

/// A running simulation.
pub(crate) struct Isph {
    case: Case,
    particles: Particles,
    /// Whose walls those of the particles' space are.
    whose: Vec<Wall>,
    /// Particles that have left.
    left: u64,
    /// Updates of particles since the start of the process.
    updates: u64,
    /// Iterations of both linear systems since then.
    iterations: [u64; 2],
    /// A speed in m/s that is not reached by anything right.
    runaway: f64,
}

/// Particles as a case has them.
///
/// # Panics
/// If the case is for another method.
pub fn simulation(case: &Case) -> Box<dyn Simulation> {
    Box::new(Isph::new(case))
}

impl Isph {
    fn new(case: &Case) -> Self {
        let (space, whose) = scattered::space(case);
        let (fluid, stepping) = (setup::fluid(case), setup::stepping(case));
        let (positions, velocities) = scattered::nodes(case, &space);
        let size = case.domain.max - case.domain.min;
        let fall = (2.0 * fluid.gravity.abs().dot(size)).sqrt();
        // What walls drive out between them goes faster than they do, as the fluid is wider than high.
        let (low, high) = case.fluid_box();
        let wide = (high - low).max_element() / (high - low).min_element();
        let walls = space
            .walls
            .iter()
            .map(|wall| wide.max(1.0) * wall.motion.largest_speed(0.0) + wall.sliding.length());
        let pressed = scattered::pressed_speed(case, positions.len());
        let fastest = walls.chain(velocities.iter().map(|u| u.length())).fold(fall.max(pressed), f64::max);
        let mut particles = Particles::new(positions, space, fluid, stepping);
        particles.velocities = velocities;
        settle(&mut particles);
        if let Scheme::ThreeStep(pressure) = setup::settings(case).scheme {
            particles = particles.in_three_steps(match pressure {
                tremie_case::PressureStep::Solve => PressureStep::Solve,
                tremie_case::PressureStep::Sweep => PressureStep::Sweep,
            });
        }
        if let Some(plate) = setup::plate(case, &whose) {
            particles.set_plate(plate);
        }
        // Where nothing is known that drives it, there is no bound.
        let runaway = if fastest > 0.0 { RUNAWAY * fastest } else { f64::INFINITY };
        Self { case: case.clone(), particles, whose, left: 0, updates: 0, iterations: [0; 2], runaway }
    }

    /// What a checkpoint must be for.
    fn identity(&self) -> String {
        let space = &self.particles.space;
        format!(
            "{}, {} dimensions, spacing {} m",
            self.case.method.name(),
            space.dimension.number(),
            space.spacing
        )
    }

    fn breakdown(&self, at: DVec3, what: String, advice: &str) -> Breakdown {
        Breakdown { time: self.particles.time(), position: at, what, advice: advice.into() }
    }

    /// The fastest particle, and how fast it is in m/s; not a number if one's speed is none.
    fn fastest(&self) -> (DVec3, f64) {
        let mut found = (DVec3::ZERO, 0.0);
        for (at, u) in self.particles.positions.iter().zip(&self.particles.velocities) {
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

    /// Takes out particles that have left through open sides.
    fn drain(&mut self) {
        if !self.case.has_outlets() {
            return;
        }
        let domain = &self.case.domain;
        let stays: Vec<bool> = self.particles.positions.iter().map(|at| domain.holds(*at)).collect();
        self.left += stays.iter().filter(|stays| !**stays).count() as u64;
        self.particles.keep(&stays);
    }
}

/// Lets particles that a lattice has put too near to slanted walls, or too far from them, make room.
fn settle(particles: &mut Particles) {
    if particles.space.walls.iter().all(|wall| !wall.hides) {
        return;
    }
    let space = particles.space.clone();
    let around = Surroundings::new(&particles.positions, &space, 0.0, 1.0);
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
    particles.positions.iter_mut().zip(ways).for_each(|(at, way)| *at += way);
}

impl Simulation for Isph {
    fn time(&self) -> f64 {
        self.particles.time()
    }

    fn time_step(&self) -> f64 {
        self.particles.time_step()
    }

    fn advance(&mut self) -> Result<(), Breakdown> {
        self.updates += self.particles.positions.len() as u64;
        if let Err(failure) = self.particles.advance() {
            let (at, _) = self.fastest();
            let advice = match failure {
                Failure::Slow { .. } => "set a smaller `largest_viscosity` or `courant` under [isph]",
                Failure::Breakdown { .. } => "set a smaller `courant` or `spacing` under [isph]",
            };
            return Err(self.breakdown(at, failure.to_string(), advice));
        }
        self.iterations = std::array::from_fn(|k| self.iterations[k] + self.particles.iterations[k] as u64);
        self.drain();
        let (at, speed) = self.fastest();
        if speed.is_nan() || speed > self.runaway {
            let what = format!("a particle runs away at {speed:.3e} m/s");
            return Err(self.breakdown(at, what, "set a smaller `courant` or `spacing` under [isph]"));
        }
        Ok(())
    }

    fn snapshot(&self) -> Snapshot {
        let (particles, time, step) = (&self.particles, self.particles.time(), self.particles.time_step());
        let of = |rate: &f64| particles.fluid.viscosity(*rate);
        let viscosities: Vec<f64> = particles.shear_rates.iter().map(of).collect();
        let around = Surroundings::new(&particles.positions, &particles.space, time, step);
        let pulls = pulls(&around, &viscosities, &particles.velocities);
        let volume = particles.space.spacing.powi(3);
        let pulls = pulls.into_iter().map(|(wall, at, pull)| Pull { wall, at, force: volume * pull });
        let pulls: Vec<Pull> = pulls.collect();
        let nodes = Scattered {
            case: &self.case,
            space: &particles.space,
            whose: &self.whose,
            time,
            step,
            positions: &particles.positions,
            velocities: &particles.velocities,
            pressures: &particles.pressures,
            shear_rates: &particles.shear_rates,
            viscosities: &viscosities,
            left: self.left,
        };
        nodes.view(&pulls)
    }

    fn load(&self) -> Load {
        let number = self.particles.positions.len();
        Load {
            wet: number,
            allocated: number,
            bytes: self.particles.bytes(),
            updates: self.updates,
            iterations: self.iterations,
        }
    }

    fn save(&self) -> State {
        let particles = &self.particles;
        let flat = |vectors: &[DVec3]| Array::F64(vectors.iter().flat_map(|v| v.to_array()).collect());
        State {
            header: serde_json::json!({
                "for": self.identity(),
                "time": particles.time(),
                "left": self.left,
                "plate": particles.plate.map(|plate| [plate.way, plate.speed]),
            }),
            arrays: vec![
                ("positions".into(), flat(&particles.positions)),
                ("velocities".into(), flat(&particles.velocities)),
                ("pressures".into(), Array::F64(particles.pressures.clone())),
                ("shear rates".into(), Array::F64(particles.shear_rates.clone())),
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
        let plate = match self.particles.plate {
            Some(plate) => {
                let [way, speed] =
                    serde_json::from_value(state.header["plate"].clone()).map_err(|_| missing("plate"))?;
                Some(Plate { way, speed, ..plate })
            }
            None => None,
        };
        self.particles.go_back(time, positions, velocities, pressures, shear_rates, plate);
        Ok(())
    }
}
