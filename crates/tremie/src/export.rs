//! `tremie export`: the aggregates and fibres of a run, as other programs read them.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Args, ValueEnum};
use tremie_case::{Case, Side};
use tremie_output::packing::Frame;
use tremie_simulation::RunFolder;
use tremie_simulation::bodies::{Format, export};
use tremie_suspension::Form;

use crate::failure::WrongInput;
use crate::{last_state, terminal};

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  tremie export runs/fibre-slump --format csv
  tremie export runs/fibre-slump --format oofem --out packing.dat

The bodies are those of the last checkpoint: of the end, if the run has come to it.")]
pub(crate) struct Arguments {
    /// The folder of the run
    dir: PathBuf,
    /// What to write
    #[arg(long, value_name = "FORMAT")]
    format: Name,
    /// The file to write [default: fibres.csv, packing.dat, fibres.txt or bodies.vtp in the current folder]; a file in that place is replaced
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Name {
    /// A table: both ends of each fibre and the centres of others, in m; `[[inclusions]]` reads it
    Csv,
    /// The packing file of OOFEM: fibres, spheres and ellipsoids, in m from the domain's lower corner
    Oofem,
    /// Both ends of each fibre in mm, as the LDPM workbench of Chrono reads them
    Ldpm,
    /// Lines and points for ParaView
    Vtp,
}

impl Name {
    fn file(self) -> &'static str {
        match self {
            Self::Csv => "fibres.csv",
            Self::Oofem => "packing.dat",
            Self::Ldpm => "fibres.txt",
            Self::Vtp => "bodies.vtp",
        }
    }
}

/// Exports the bodies of a run.
pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<ExitCode> {
    let folder = RunFolder::open(&arguments.dir)?;
    let case = Case::read(&folder.case())?;
    let shown = folder.path().display();
    if !case.has_bodies() {
        return Err(
            WrongInput(format!("{shown} has nothing to export: its case has no [[inclusions]]")).into()
        );
    }
    let last = last_state::read(&folder, &case)?.map_err(|reason| {
        WrongInput(format!(
            "{shown} cannot be exported: {reason}; `tremie run` or `tremie resume` writes one"
        ))
    })?;
    let bodies = &last.inclusions;
    let fibres = (0..bodies.len()).filter(|n| matches!(bodies.form(*n), Form::Fibre { .. })).count();
    if arguments.format == Name::Ldpm && fibres == 0 {
        return Err(WrongInput(format!("{shown} has no fibres, and this format knows nothing else")).into());
    }
    let (format, count) = match arguments.format {
        Name::Csv => (Format::Csv, bodies.len()),
        Name::Oofem => (Format::Oofem(frame(&case)), bodies.len()),
        Name::Ldpm => (Format::Ldpm, fibres),
        Name::Vtp => (Format::Vtp { time: last.time }, bodies.len()),
    };
    let path = arguments.out.clone().unwrap_or_else(|| arguments.format.file().into());
    export(bodies, format, &path).map_err(|error| {
        let reason = std::error::Error::source(&error).unwrap_or(&error);
        WrongInput(format!("{} cannot be written: {reason}", path.display()))
    })?;
    let left = match bodies.len() - count {
        0 => String::new(),
        others => format!("; {others} that are no fibres are left out"),
    };
    let path = path.display();
    terminal::say(&format!("{path} written: {count} bodies at t = {:.3} s{left}", last.time));
    Ok(ExitCode::SUCCESS)
}

/// The domain as a box.
fn frame(case: &Case) -> Frame {
    let domain = &case.domain;
    Frame {
        low: domain.min.to_array(),
        size: (domain.max - domain.min).to_array(),
        periodic: [0, 2, 4].map(|side| domain.sides[side] == Side::Periodic),
    }
}
