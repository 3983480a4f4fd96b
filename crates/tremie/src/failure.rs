//! What goes wrong, as it is told to the user.

use std::process::ExitCode;

use tremie_case::CaseError;
use tremie_simulation::FolderError;

use crate::terminal;

/// Exit code after wrong input or arguments.
const WRONG_INPUT: u8 = 2;

/// Input that makes no sense; the text says what to give instead.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub(crate) struct WrongInput(pub(crate) String);

/// Tells what went wrong; the exit code says whose fault it is.
pub(crate) fn report(error: &anyhow::Error) -> ExitCode {
    match error.downcast_ref::<CaseError>() {
        Some(case) => terminal::note(case.render(terminal::colours()).trim_end()),
        None => terminal::error(&chain(error.as_ref())),
    }
    if error.is::<CaseError>() || error.is::<WrongInput>() || error.is::<FolderError>() {
        ExitCode::from(WRONG_INPUT)
    } else {
        ExitCode::FAILURE
    }
}

/// An error and its causes on one line; a transparent error is not told twice.
pub(crate) fn chain(error: &(dyn std::error::Error + 'static)) -> String {
    let causes = std::iter::successors(Some(error), |error| error.source());
    let mut parts: Vec<String> = causes.map(ToString::to_string).collect();
    parts.dedup();
    parts.join(": ")
}
