//! The one trait of all methods.

use tremie_numerics::DVec3;
use tremie_output::state::State;

use crate::Snapshot;

/// A running simulation, whatever its method.
pub trait Simulation: Send {
    /// Simulated time in s.
    fn time(&self) -> f64;

    /// Length in s of the step that [`Simulation::advance`] takes next.
    fn time_step(&self) -> f64;

    /// Goes one step further in time.
    ///
    /// # Errors
    /// [`Breakdown`] where the numbers cannot be trusted any more; the state is then of no further use.
    fn advance(&mut self) -> Result<(), Breakdown>;

    /// What gauges and writers see of the present state, in place of what was seen before, in its memory.
    fn see(&self, snapshot: &mut Snapshot);

    /// What gauges and writers see of the present state.
    fn snapshot(&self) -> Snapshot {
        let mut snapshot = Snapshot::default();
        self.see(&mut snapshot);
        snapshot
    }

    /// How much there is to compute at present.
    fn load(&self) -> Load;

    /// Everything needed to go on from here to the bit.
    fn save(&self) -> State;

    /// Goes back to a saved state of the same case.
    ///
    /// # Errors
    /// [`RestoreError`] if the state belongs to another case or method, or is incomplete.
    fn restore(&mut self, state: &State) -> Result<(), RestoreError>;
}

/// The size of a simulation at one moment.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Load {
    /// Cells or nodes that hold fluid.
    pub wet: usize,
    /// Cells or nodes that memory is kept for.
    pub allocated: usize,
    /// Memory for fields, in bytes.
    pub bytes: usize,
    /// Updates of wet cells or nodes since the start (of this process).
    pub updates: u64,
    /// Iterations of the linear systems in all steps since then: of viscous forces, and of the pressure. None where a method has no such systems.
    pub iterations: [u64; 2],
}

/// A numerical breakdown: where, when, and what is likely to help.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("at t = {time:.6} s near ({:.4}, {:.4}, {:.4}) m: {what}; {advice}", position.x, position.y, position.z)]
pub struct Breakdown {
    /// Simulated time in s.
    pub time: f64,
    /// Place in m.
    pub position: DVec3,
    /// What was found there.
    pub what: String,
    /// The likely cause and what to change.
    pub advice: String,
}

/// Why a saved state cannot be used.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum RestoreError {
    /// An array is missing, or has another type or length than it should.
    #[error("the checkpoint's array `{0}` is missing or has the wrong size")]
    Array(String),
    /// The state was written by another method, precision or case.
    #[error("the checkpoint was written for {found}, this run is {expected}")]
    Mismatch {
        /// What this run is.
        expected: String,
        /// What the checkpoint says.
        found: String,
    },
}
