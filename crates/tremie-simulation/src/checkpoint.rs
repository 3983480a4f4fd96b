//! Checkpoints: the state of a simulation together with that of its run loop.
//!
//! In the file's header the method's own header stands under `simulation` and the run loop's state under `run`. Nothing
//! in it depends on wall-clock time, so that the same moment of the same run gives the same file.

use serde::{Deserialize, Serialize};
use tremie_output::state::{Array, State};

use crate::filling::Filling;
use crate::folder::RunFolder;
use crate::gauges::{Peak, TargetTime};
use crate::rest::RestWatch;
use crate::run::RunError;
use crate::schedule::Schedule;
use crate::{RestoreError, Simulation};

/// A moment to resume a run from.
#[derive(Debug, Clone, PartialEq)]
pub struct Checkpoint {
    pub(crate) simulation: State,
    pub(crate) run: RunState,
    /// What had been seen of the filling, if the case asks for it.
    pub(crate) filling: Vec<(String, Array)>,
}

/// What the run loop must know to go on as if it had not been interrupted.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct RunState {
    /// Simulated time in s.
    pub(crate) time: f64,
    /// Time steps since the start of the run.
    pub(crate) steps: u64,
    /// Volume in m3 at the start of the run.
    pub(crate) first_volume: f64,
    pub(crate) readings: Schedule,
    pub(crate) snapshots: Schedule,
    pub(crate) pictures: Schedule,
    pub(crate) t500: TargetTime,
    /// What front and light gauges wait for.
    pub(crate) events: Vec<TargetTime>,
    /// The largest pressure on each wall that is gauged.
    pub(crate) peaks: Vec<Peak>,
    pub(crate) rest: RestWatch,
}

/// The header of the file.
#[derive(Serialize, Deserialize)]
struct Header<R> {
    simulation: serde_json::Value,
    run: R,
}

impl Checkpoint {
    /// Reads the checkpoint in a folder.
    ///
    /// # Errors
    /// If it is missing or damaged, or was not written by a run.
    pub fn read(folder: &RunFolder) -> Result<Self, RunError> {
        let path = folder.checkpoint();
        let mut simulation = State::read(&path)?;
        let header: Header<RunState> = serde_json::from_value(std::mem::take(&mut simulation.header))
            .map_err(|source| RunError::Checkpoint { path, source })?;
        simulation.header = header.simulation;
        let (filling, arrays) = simulation.arrays.into_iter().partition(|(name, _)| Filling::owns(name));
        simulation.arrays = arrays;
        Ok(Self { simulation, run: header.run, filling })
    }

    /// Simulated time in s.
    pub fn time(&self) -> f64 {
        self.run.time
    }

    /// Puts a simulation of the same case back to this moment.
    ///
    /// # Errors
    /// If it is a simulation of another case.
    pub fn restore(&self, simulation: &mut dyn Simulation) -> Result<(), RestoreError> {
        simulation.restore(&self.simulation)
    }

    /// Writes the state of a run; the checkpoint before stays usable until this one is complete.
    pub(crate) fn write(
        folder: &RunFolder,
        mut state: State,
        run: &RunState,
        filling: Option<&Filling>,
    ) -> Result<(), RunError> {
        let path = folder.checkpoint();
        state.arrays.extend(filling.into_iter().flat_map(Filling::save));
        let header = Header { simulation: std::mem::take(&mut state.header), run };
        state.header = serde_json::to_value(header)
            .map_err(|source| RunError::Checkpoint { path: path.clone(), source })?;
        Ok(state.write(&path)?)
    }
}
