//! `tremie validate`: benchmarks against references.

use std::process::ExitCode;

/// Arguments of `tremie validate`.
#[derive(Debug, clap::Args)]
pub struct Arguments {}

/// Runs the benchmarks and says which pass.
///
/// # Errors
/// If a benchmark cannot be run.
pub fn run(_arguments: Arguments) -> anyhow::Result<ExitCode> {
    anyhow::bail!("no benchmark yet")
}
