//! `tremie report`: a run as one page that needs nothing else: to be read in a browser, sent, printed.
//!
//! `evidence` gathers what the run folder holds, `figures` draws it, `judgement` says what to think of it, and `page`
//! puts it together.

mod evidence;
mod figures;
mod judgement;
mod page;

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;
use tremie_simulation::RunFolder;

use crate::failure::WrongInput;
use crate::terminal;
use evidence::Evidence;

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  tremie report runs/slump-flow
  tremie report runs/slump-flow --out slump-flow.html

The page holds its figures in itself; open it in a browser, which also prints it to PDF.")]
pub(crate) struct Arguments {
    /// The folder of the run
    dir: PathBuf,
    /// The file to write [default: report.html in the folder]; a report in that place is replaced
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
}

/// Writes the report of a run.
pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<ExitCode> {
    let folder = RunFolder::open(&arguments.dir)?;
    let path = arguments.out.clone().unwrap_or_else(|| folder.report());
    write(&folder, &path)?;
    terminal::say(&format!("{} written", path.display()));
    Ok(ExitCode::SUCCESS)
}

/// Writes the report of the run in a folder to a file.
pub(crate) fn write(folder: &RunFolder, path: &Path) -> anyhow::Result<()> {
    let evidence = Evidence::gather(folder)?;
    let page = page::page(&evidence)?;
    tremie_output::atomic::write(path, page.as_bytes()).map_err(|error| {
        let reason = std::error::Error::source(&error).unwrap_or(&error);
        WrongInput(format!("{} cannot be written: {reason}", path.display())).into()
    })
}
