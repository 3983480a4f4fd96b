//! The last state of a run, from the checkpoint in its folder.

use tremie_case::Case;
use tremie_simulation::{Checkpoint, RunFolder, Snapshot};

use crate::failure::{WrongInput, chain};

/// The state in the checkpoint, or why there is none.
pub(crate) fn read(folder: &RunFolder, case: &Case) -> Result<Result<Snapshot, String>, WrongInput> {
    if !folder.checkpoint().is_file() {
        return Ok(Err("the folder has no checkpoint".to_owned()));
    }
    let checkpoint = Checkpoint::read(folder).map_err(|error| WrongInput(chain(&error)))?;
    let mut simulation = crate::plan::simulation(case);
    Ok(match checkpoint.restore(simulation.as_mut()) {
        Ok(()) => Ok(simulation.snapshot()),
        Err(error) => Err(error.to_string()),
    })
}
