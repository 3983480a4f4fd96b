//! Nodes as a simulation of a case.

use serde_json::Value;
use tremie_case::Case;
use tremie_cloud::{Failure, Space};
use tremie_numerics::DVec3;
use tremie_simulation::Simulation;
use tremie_simulation::scattered::{Cloud, Known, Pull, Running};

use crate::nodes::Nodes;
use crate::setup;
use crate::stencils::Stencils;
use crate::viscosity::pulls;

/// Nodes as a case has them.
///
/// # Panics
/// If the case is for another method.
pub fn simulation(case: &Case) -> Box<dyn Simulation> {
    let (fluid, stepping) = (setup::fluid(case), setup::stepping(case));
    Box::new(Running::new(case, |positions, space, _| Nodes::new(positions, space, fluid, stepping)))
}

impl Cloud for Nodes {
    const NODE: &'static str = "node";

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
        let around = self.surroundings(step);
        let stencils = Stencils::new(&around, &around.gradients(), self.stepping.operators);
        pulls(&stencils, viscosities, &self.velocities, self.space.spacing.powi(3))
    }

    fn go_on(&mut self) -> Result<[usize; 2], Failure> {
        self.advance()?;
        Ok(self.iterations)
    }

    fn more(&self) -> Value {
        serde_json::json!({ "last step": self.last_step })
    }

    fn go_back(&mut self, time: f64, more: &Value) -> Result<(), &'static str> {
        self.last_step = more["last step"].as_f64().ok_or("last step")?;
        self.time = time;
        Ok(())
    }
}
