//! `tremie schema`: the keys of the case file, for editors.

use std::process::ExitCode;

use clap::Args;

use crate::terminal;

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  tremie schema > tremie.schema.json
  tremie schema --beam > beam.schema.json

An editor with TOML support (Taplo, Even Better TOML) then completes keys, explains them and marks mistakes in a case
file whose first line is
  #:schema ./tremie.schema.json")]
pub(crate) struct Arguments {
    /// That of the file of a hardened beam, for `tremie fracture`
    #[arg(long)]
    beam: bool,
}

/// Prints the schema.
pub(crate) fn run(arguments: &Arguments) -> ExitCode {
    let schema = if arguments.beam { tremie_case::beam_schema() } else { tremie_case::json_schema() };
    terminal::say(&format!("{schema:#}"));
    ExitCode::SUCCESS
}
