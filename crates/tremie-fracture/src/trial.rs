//! A test of a beam, led by the opening of its crack: in one plane across it ([`Plane`]), or wherever it goes ([`Anywhere`]).

use crate::anywhere::Anywhere;
use crate::beam::Beam;
use crate::bridge::BridgeState;
use crate::lattice::value;
use crate::mesh::Mesh;
use crate::path::{Cracking, Path};
use crate::plane::Plane;
use crate::setup::{Reading, Setup, TrialError};
use crate::sparse::{Factor, UNKNOWNS};
use tremie_numerics::DVec3;

/// Largest residual of a linear system, as a share of the load.
const RESIDUAL: f64 = 1e-7;

/// A test that goes on.
pub struct Trial {
    beam: Beam,
    body: Body,
    path: Path,
}

/// Where the crack may be.
enum Body {
    Plane(Box<Plane>),
    Anywhere(Box<Anywhere>),
}

/// What a test is at a moment, to go on from.
#[derive(Debug, Clone, PartialEq)]
pub struct State {
    /// What points and fibres have been through, and from where the next response is found.
    pub most: Vec<f64>,
    /// Unknowns at the last reading and at the one before.
    pub jumps: [Vec<f64>; 2],
    /// The last two openings in m.
    pub openings: [f64; 2],
    /// The last reading.
    pub last: Reading,
}

impl Trial {
    /// Makes a lattice of the beam and prepares its test.
    ///
    /// # Errors
    /// If the lattice is too coarse, not held, or cannot follow the softening.
    pub fn new(setup: Setup) -> Result<Self, TrialError> {
        let beam = Beam::new(setup)?;
        let (body, count) = if beam.setup.anywhere {
            let body = Anywhere::new(&beam)?;
            (Body::Anywhere(Box::new(body)), UNKNOWNS * beam.lattice.nodes.len())
        } else {
            let body = Plane::new(&beam)?;
            let count = body.unknowns();
            (Body::Plane(Box::new(body)), count)
        };
        let steps = [(0.0, vec![0.0; count]), (0.0, vec![0.0; count])];
        let path = Path { steps, last: Reading::default(), nominal: beam.setup.nominal() };
        let trial = Self { beam, body, path };
        let residual = trial.residual();
        if residual > RESIDUAL || residual.is_nan() {
            return Err(TrialError::Residual { residual });
        }
        Ok(trial)
    }

    fn factor(&self) -> &Factor {
        match &self.body {
            Body::Plane(plane) => plane.factor(),
            Body::Anywhere(anywhere) => anywhere.factor(),
        }
    }

    /// Residual of the intact beam under its load, as a share of the load.
    pub fn residual(&self) -> f64 {
        self.beam.residual(self.factor())
    }

    /// Goes on to a larger opening in m: the readings on the way, and the last. A step is halved if it does not converge, or is so long that
    /// load times deflection is not the work that was done.
    ///
    /// # Errors
    /// If no equilibrium is found.
    pub fn advance(&mut self, opening: f64) -> Result<Vec<Reading>, TrialError> {
        let body: &mut dyn Cracking = match &mut self.body {
            Body::Plane(plane) => plane.as_mut(),
            Body::Anywhere(anywhere) => anywhere.as_mut(),
        };
        self.path.advance(body, opening)
    }

    /// The last reading.
    pub fn last(&self) -> &Reading {
        &self.path.last
    }

    /// The beam and its test.
    pub fn setup(&self) -> &Setup {
        &self.beam.setup
    }

    /// The lattice.
    pub fn mesh(&self) -> &Mesh {
        &self.beam.mesh
    }

    fn unknowns(&self) -> &[f64] {
        &self.path.steps[1].1
    }

    /// Fibres across the crack; one may cross several facets of a crack that is not in one plane.
    pub fn bridges(&self) -> Vec<BridgeState> {
        match &self.body {
            Body::Plane(plane) => plane.bridges(self.unknowns()),
            Body::Anywhere(anywhere) => anywhere.bridges(self.unknowns()),
        }
    }

    /// The facets of the crack: their corners in m, and the openings there in m.
    pub fn crack(&self) -> Vec<(Vec<DVec3>, Vec<f64>)> {
        match &self.body {
            Body::Plane(plane) => plane.crack(&self.beam, self.unknowns()),
            Body::Anywhere(anywhere) => anywhere.crack(self.unknowns()),
        }
    }

    /// Displacements and rotations of the cells: six numbers each, in m and rad, held at one of them.
    pub fn displacements(&self) -> Vec<f64> {
        match &self.body {
            Body::Plane(plane) => plane.displacements(&self.beam, self.last().load, self.unknowns()),
            Body::Anywhere(_) => self.unknowns()[..UNKNOWNS * self.beam.mesh.nodes.len()].to_vec(),
        }
    }

    /// Displacements of the intact beam under a load of 1 N: six numbers a cell.
    pub fn elastic(&self) -> Vec<f64> {
        let mut found = self.factor().solve(&self.beam.load());
        found.truncate(UNKNOWNS * self.beam.mesh.nodes.len());
        found
    }

    /// The displacement that the load does work on, of displacements as [`Self::elastic`] gives them, in m.
    pub fn deflection_of(&self, displacements: &[f64]) -> f64 {
        value(&self.beam.force, displacements)
    }

    /// What it takes to go on from here.
    pub fn save(&self) -> State {
        let most = match &self.body {
            Body::Plane(plane) => plane.save(),
            Body::Anywhere(anywhere) => anywhere.save(),
        };
        let [older, newer] = self.path.steps.clone();
        State { most, openings: [older.0, newer.0], jumps: [older.1, newer.1], last: self.path.last }
    }

    /// Goes on from a state of the same test.
    ///
    /// # Errors
    /// If it is of another.
    pub fn restore(&mut self, state: State) -> Result<(), TrialError> {
        let count = self.unknowns().len();
        let fits = state.jumps.iter().all(|jumps| jumps.len() == count);
        let taken = fits
            && match &mut self.body {
                Body::Plane(plane) => plane.restore(&state.most),
                Body::Anywhere(anywhere) => anywhere.restore(&state.most),
            };
        if !taken {
            return Err(TrialError::Foreign);
        }
        let [older, newer] = state.jumps;
        self.path.steps = [(state.openings[0], older), (state.openings[1], newer)];
        self.path.last = state.last;
        Ok(())
    }
}

#[cfg(test)]
mod tests;
