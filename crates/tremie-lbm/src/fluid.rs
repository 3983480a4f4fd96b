//! The fluid as the grid sees it: what drives it, and its flow curve, in closed form where there is one, or a flow curve in each cell.
//!
//! Which law it is is asked once a step, not in each cell: the kernels are compiled for each.

use tremie_case::Material;
use tremie_rheology::FlowCurve;

use crate::collision::{Moments, Rates, least_odd};
use crate::grid::Grid;
use crate::loads::Loads;
use crate::real::Real;
use crate::relaxation::Bingham;
use crate::rows::Rows;
use crate::scaling::Scaling;
use crate::stream::Findings;
use crate::structure::Structured;
use crate::tabulated::Tabulated;
use crate::together::Physics;

/// What drives the fluid and resists.
#[derive(Debug, Clone)]
pub(crate) enum Fluid<T> {
    /// Newtonian and Bingham fluids.
    Bingham(Physics<T, Bingham<T>>),
    /// All others.
    Tabulated(Physics<T, Tabulated<T>>),
    /// Thixotropic Bingham fluids.
    Structured(Physics<T, Structured<T>>),
}

impl<T: Real> Fluid<T> {
    /// A fluid under an acceleration in m/s2, with a relaxation rate of the trace of its stress.
    pub(crate) fn new(material: &Material, gravity: [f64; 3], trace: f64, scaling: &Scaling) -> Self {
        let curve = &material.curve;
        let gravity = gravity.map(|g| T::from_f64(scaling.acceleration(g)));
        let viscosity = scaling.viscosity(curve.plastic_viscosity());
        let rates = Rates { least_odd: T::from_f64(least_odd(viscosity)), trace: T::from_f64(trace) };
        match curve {
            FlowCurve::Newtonian { .. } | FlowCurve::Bingham { .. } => {
                let yield_stress = scaling.stress(curve.yield_stress());
                let law = Bingham::new(yield_stress, viscosity);
                match material.thixotropy {
                    None => Self::Bingham(Physics { gravity, law, rates }),
                    Some(_) => Self::Structured(Physics { gravity, law: Structured(law), rates }),
                }
            }
            _ => Self::Tabulated(Physics { gravity, law: Tabulated::new(curve, scaling), rates }),
        }
    }

    /// Acceleration in lattice units.
    pub(crate) fn gravity(&self) -> [T; 3] {
        match self {
            Self::Bingham(physics) => physics.gravity,
            Self::Tabulated(physics) => physics.gravity,
            Self::Structured(physics) => physics.gravity,
        }
    }

    /// See [`Grid::step`].
    pub(crate) fn step(
        &self,
        grid: &mut Grid<T>,
        rows: &[Rows],
        change: Option<T>,
        findings: &mut Vec<Findings>,
    ) {
        match self {
            Self::Bingham(physics) => grid.step(rows, physics, change, findings),
            Self::Tabulated(physics) => grid.step(rows, physics, change, findings),
            Self::Structured(physics) => grid.step(rows, physics, change, findings),
        }
    }

    /// See [`Grid::moments`].
    pub(crate) fn moments(
        &self,
        grid: &Grid<T>,
        slot: usize,
        rows: &Rows,
        loads: Option<&mut Loads>,
        see: impl FnMut(usize, &Moments<T>, T),
    ) {
        match self {
            Self::Bingham(physics) => grid.moments(slot, rows, physics, loads, see),
            Self::Tabulated(physics) => grid.moments(slot, rows, physics, loads, see),
            Self::Structured(physics) => grid.moments(slot, rows, physics, loads, see),
        }
    }
}
