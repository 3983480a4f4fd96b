//! What a case means to its method, and its simulation.

use indicatif::HumanCount;
use tremie_case::{Case, Method};
use tremie_simulation::Simulation;

use crate::numbers::significant;

/// Relative change of the volume that particles enclose, as their cloud loosens or closes up, that is of no account.
const LOOSENS: f64 = 0.01;

/// The numbers of a run, by its method.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Plan {
    /// Free-surface lattice Boltzmann.
    Lattice(tremie_lbm::Plan),
    /// Particles or nodes without a mesh.
    Particles(tremie_simulation::scattered::Plan),
}

/// A case as a running simulation.
pub(crate) fn simulation(case: &Case) -> Box<dyn Simulation> {
    match case.method {
        Method::Lbm(_) => tremie_lbm::simulation(case),
        Method::Isph(_) => tremie_sph::simulation(case),
        Method::Ldd(_) => tremie_ldd::simulation(case),
    }
}

impl Plan {
    pub(crate) fn new(case: &Case) -> Self {
        match case.method {
            Method::Lbm(_) => Self::Lattice(tremie_lbm::Plan::new(case)),
            Method::Isph(_) => Self::Particles(tremie_sph::plan(case)),
            Method::Ldd(_) => Self::Particles(tremie_ldd::plan(case)),
        }
    }

    /// The lattice's own numbers, if it is one.
    pub(crate) fn lattice(&self) -> Option<&tremie_lbm::Plan> {
        match self {
            Self::Lattice(plan) => Some(plan),
            Self::Particles(_) => None,
        }
    }

    /// Edge of a cell, or distance of particles, in m.
    pub(crate) fn resolution(&self) -> f64 {
        match self {
            Self::Lattice(plan) => plan.scaling.cell_size,
            Self::Particles(plan) => plan.spacing,
        }
    }

    /// What it is called.
    pub(crate) fn elements(&self) -> &'static str {
        match self {
            Self::Lattice(_) => "cells",
            Self::Particles(_) => "particles",
        }
    }

    /// One of them.
    pub(crate) fn element(&self) -> &'static str {
        match self {
            Self::Lattice(_) => "cell",
            Self::Particles(_) => "particle",
        }
    }

    /// What is made smaller or larger to have more or fewer of them.
    pub(crate) fn sizes(&self) -> &'static str {
        match self {
            Self::Lattice(_) => "cells",
            Self::Particles(_) => "spacings",
        }
    }

    /// Length of the first step, or of steps at the reference speed, in s.
    pub(crate) fn time_step(&self) -> f64 {
        match self {
            Self::Lattice(plan) => plan.scaling.time_step,
            Self::Particles(plan) => plan.time_step,
        }
    }

    /// Steps of that length to the stop time.
    pub(crate) fn steps(&self) -> f64 {
        match self {
            Self::Lattice(plan) => plan.steps,
            Self::Particles(plan) => plan.steps,
        }
    }

    /// Cells that hold fluid at the start, or particles.
    pub(crate) fn wet(&self) -> f64 {
        match self {
            Self::Lattice(plan) => plan.wet_cells,
            Self::Particles(plan) => plan.particles as f64,
        }
    }

    /// Memory in bytes.
    pub(crate) fn memory(&self) -> f64 {
        match self {
            Self::Lattice(plan) => plan.memory,
            Self::Particles(plan) => plan.memory,
        }
    }

    /// Height of the fluid in m, speed that it may reach in m/s, and its Bingham and Reynolds numbers.
    pub(crate) fn flow(&self) -> [f64; 4] {
        match self {
            Self::Lattice(plan) => [plan.height, plan.reference_speed, plan.bingham, plan.reynolds],
            Self::Particles(plan) => [plan.height, plan.reference_speed, plan.bingham, plan.reynolds],
        }
    }

    /// Relative change of volume that the method itself may cause.
    pub(crate) fn compressibility(&self) -> f64 {
        match self {
            Self::Lattice(plan) => plan.hydrostatic_error,
            Self::Particles(_) => LOOSENS,
        }
    }

    /// What the fluid is cut into, for people.
    pub(crate) fn resolved(&self) -> String {
        let size = significant(1e3 * self.resolution());
        match self {
            Self::Lattice(plan) => {
                let [nx, ny, nz] = plan.cells;
                let all = HumanCount((nx * ny * nz) as u64);
                format!("{nx} x {ny} x {nz} = {all} cells of {size} mm")
            }
            Self::Particles(plan) => {
                let place = if plan.plane { "in a plane" } else { "in space" };
                format!("{} particles {size} mm apart, {place}", HumanCount(plan.particles as u64))
            }
        }
    }
}
