//! Between SI units and lattice units, in which the cell size, the time step and the fluid's density are 1.
//!
//! The time step is the largest that keeps four numbers in hand (Svec 2013, section 1.10.2, for the first):
//!
//! ```text
//!     dt <= nu_lattice dx^2 / nu            lattice viscosity near its most accurate value
//!     dt <= u_lattice dx / u_ref            speed well below that of sound (1/sqrt 3)
//!     dt <= dx sqrt(e / (3 g H))            hydrostatic pressure changes the density by no more than e
//!     dt <= dx sqrt(e rho dx / (3 sigma))   nor does a surface as curved as 1/dx: waves of a few cells by surface tension are slow then, too
//! ```

/// Scales of a run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scaling {
    /// Edge of a cell in m.
    pub cell_size: f64,
    /// Time step in s.
    pub time_step: f64,
    /// Density of the fluid in kg/m3.
    pub density: f64,
}

impl Scaling {
    /// Lattice velocity of a velocity in m/s.
    pub fn velocity(&self, si: f64) -> f64 {
        si * self.time_step / self.cell_size
    }

    /// Lattice acceleration of an acceleration in m/s2.
    pub fn acceleration(&self, si: f64) -> f64 {
        si * self.time_step * self.time_step / self.cell_size
    }

    /// Lattice kinematic viscosity of a dynamic viscosity in Pa s.
    pub fn viscosity(&self, si: f64) -> f64 {
        si / self.density * self.time_step / (self.cell_size * self.cell_size)
    }

    /// Lattice (kinematic) stress of a stress or pressure in Pa.
    pub fn stress(&self, si: f64) -> f64 {
        si / self.density * (self.time_step / self.cell_size).powi(2)
    }

    /// Lattice tension of a surface tension in N/m.
    pub fn tension(&self, si: f64) -> f64 {
        self.stress(si / self.cell_size)
    }

    /// Velocity in m/s of one lattice unit.
    pub fn velocity_unit(&self) -> f64 {
        self.cell_size / self.time_step
    }

    /// Stress in Pa of one lattice unit.
    pub fn stress_unit(&self) -> f64 {
        self.density * self.velocity_unit().powi(2)
    }

    /// Relative density error of the pressure in a drop of a radius of two cells, with a surface tension in N/m.
    pub fn capillary_error(&self, tension: f64) -> f64 {
        3.0 * self.tension(tension)
    }

    /// Relative density error of the hydrostatic pressure under `height` m of fluid at `gravity` m/s2.
    pub fn hydrostatic_error(&self, gravity: f64, height: f64) -> f64 {
        3.0 * gravity * height * (self.time_step / self.cell_size).powi(2)
    }
}

/// What limits the time step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limits {
    /// Largest lattice viscosity wanted for the plastic viscosity.
    pub lattice_viscosity: f64,
    /// Largest lattice speed wanted for the reference speed.
    pub lattice_speed: f64,
    /// Largest relative density error of the hydrostatic pressure.
    pub hydrostatic_error: f64,
}

/// What the flow asks for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Flow {
    /// Plastic viscosity in Pa s.
    pub viscosity: f64,
    /// Density in kg/m3.
    pub density: f64,
    /// Acceleration of gravity in m/s2.
    pub gravity: f64,
    /// Height of the fluid along gravity in m.
    pub height: f64,
    /// Surface tension in N/m.
    pub tension: f64,
    /// Speed in m/s that the fluid may reach: the largest of sqrt(2 g H) and the speeds given in the case.
    pub speed: f64,
}

/// The largest time step in s that meets all limits.
pub fn time_step(cell_size: f64, flow: &Flow, limits: &Limits) -> f64 {
    let by_viscosity = limits.lattice_viscosity * cell_size * cell_size * flow.density / flow.viscosity;
    let by_speed = limits.lattice_speed * cell_size / flow.speed;
    let by_pressure = cell_size * (limits.hydrostatic_error / (3.0 * flow.gravity * flow.height)).sqrt();
    let by_tension =
        cell_size * (limits.hydrostatic_error * flow.density * cell_size / (3.0 * flow.tension)).sqrt();
    by_viscosity.min(by_speed).min(by_pressure).min(by_tension)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn worked_example_of_the_thesis() {
        // Svec 2013, 1.10.2: 0.5 m over 20 cells, 100 Pa s at nu = 0.15, 2500 kg/m3.
        let flow =
            Flow { viscosity: 100.0, density: 2500.0, gravity: 0.0, height: 0.0, tension: 0.0, speed: 0.0 };
        let limits = Limits { lattice_viscosity: 0.15, lattice_speed: 0.1, hydrostatic_error: 0.02 };
        let scaling =
            Scaling { cell_size: 0.025, time_step: time_step(0.025, &flow, &limits), density: 2500.0 };
        assert!((1.0 / scaling.time_step / 427.0 - 1.0).abs() < 5e-3);
        assert!((scaling.stress(25.0) / 8.77e-5 - 1.0).abs() < 5e-3);
        assert!((scaling.viscosity(100.0) - 0.15).abs() < 1e-12);
    }

    #[test]
    fn back_and_forth() {
        let scaling = Scaling { cell_size: 0.005, time_step: 2e-4, density: 2300.0 };
        assert!((scaling.velocity(3.0) * scaling.velocity_unit() - 3.0).abs() < 1e-12);
        assert!((scaling.stress(50.0) * scaling.stress_unit() - 50.0).abs() < 1e-12);
        // p = rho g H in lattice units is a third of the density error.
        let error = scaling.hydrostatic_error(9.81, 0.3);
        assert!((3.0 * scaling.stress(2300.0 * 9.81 * 0.3) - error).abs() < 1e-12);
    }
}
