//! Particles as a simulation of a case.

use serde_json::Value;
use tremie_case::{Case, Scheme};
use tremie_cloud::{Failure, Space, Surroundings};
use tremie_numerics::DVec3;
use tremie_simulation::Simulation;
use tremie_simulation::scattered::{Cloud, Known, Pull, Running};

use crate::particles::Particles;
use crate::plate::Plate;
use crate::setup;
use crate::three_steps::PressureStep;
use crate::viscosity::pulls;

/// Particles as a case has them.
///
/// # Panics
/// If the case is for another method.
pub fn simulation(case: &Case) -> Box<dyn Simulation> {
    Box::new(Running::new(case, |positions, space, whose| {
        let mut particles = Particles::new(positions, space, setup::fluid(case), setup::stepping(case));
        if let Scheme::ThreeStep(pressure) = setup::settings(case).scheme {
            particles = particles.in_three_steps(match pressure {
                tremie_case::PressureStep::Solve => PressureStep::Solve,
                tremie_case::PressureStep::Sweep => PressureStep::Sweep,
            });
        }
        if let Some(plate) = setup::plate(case, whose) {
            particles.set_plate(plate);
        }
        particles
    }))
}

impl Cloud for Particles {
    const NODE: &'static str = "particle";

    fn space(&self) -> &Space {
        &self.space
    }

    fn time(&self) -> f64 {
        self.time
    }

    fn time_step(&self) -> f64 {
        Self::time_step(self)
    }

    fn known(&self) -> Known<&[DVec3], &[f64]> {
        Known {
            positions: &self.positions,
            velocities: &self.velocities,
            pressures: &self.pressures,
            shear_rates: &self.shear_rates,
        }
    }

    fn known_mut(&mut self) -> Known<&mut Vec<DVec3>, &mut Vec<f64>> {
        Known {
            positions: &mut self.positions,
            velocities: &mut self.velocities,
            pressures: &mut self.pressures,
            shear_rates: &mut self.shear_rates,
        }
    }

    fn viscosity(&self, shear_rate: f64) -> f64 {
        self.fluid.viscosity(shear_rate)
    }

    fn pulls(&self, viscosities: &[f64], step: f64) -> Vec<Pull> {
        let around = Surroundings::new(&self.positions, &self.space, self.time, step);
        let volume = self.space.spacing.powi(3);
        let pulls = pulls(&around, viscosities, &self.velocities);
        pulls.into_iter().map(|(wall, at, pull)| Pull { wall, at, force: volume * pull }).collect()
    }

    fn go_on(&mut self) -> Result<[usize; 2], Failure> {
        self.advance()?;
        Ok(self.iterations)
    }

    fn more(&self) -> Value {
        serde_json::json!({ "plate": self.plate.map(|plate| [plate.way, plate.speed]) })
    }

    fn go_back(&mut self, time: f64, more: &Value) -> Result<(), &'static str> {
        self.time = time;
        if let Some(plate) = self.plate {
            let [way, speed] = serde_json::from_value(more["plate"].clone()).map_err(|_| "plate")?;
            self.set_plate(Plate { way, speed, ..plate });
        }
        Ok(())
    }
}
