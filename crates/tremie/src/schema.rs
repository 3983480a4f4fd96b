//! `tremie schema`: the keys of the case file, for editors.

use std::process::ExitCode;

use clap::Args;

use crate::terminal;

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  tremie schema > tremie.schema.json

An editor with TOML support (Taplo, Even Better TOML) then completes keys, explains them and marks mistakes in a case
file whose first line is
  #:schema ./tremie.schema.json")]
pub(crate) struct Arguments {}

/// Prints the schema.
pub(crate) fn run() -> ExitCode {
    terminal::say(&format!("{:#}", tremie_case::json_schema()));
    ExitCode::SUCCESS
}
