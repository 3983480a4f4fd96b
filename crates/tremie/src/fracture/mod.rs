//! `tremie fracture`: a hardened beam is tested, with the fibres that a cast has left in it or others.
//!
//! `beam` makes the beam out of its file, `cast` takes fibres out of a finished run, `folder` is where results lie, `job` does the tests one
//! after the other, `results` puts them together, `files` writes them, `page` is the report, `pull_out` the test of a single fibre.

pub(crate) mod beam;
mod cast;
mod files;
mod folder;
mod job;
mod page;
mod progress;
mod pull_out;
mod results;

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use tremie_case::{BeamCase, BeamTest};

use crate::failure::WrongInput;
use crate::{interrupt, terminal};
use folder::Folder;
use job::Job;

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  tremie fracture cases/plain-beam/case.toml
  tremie new random-fibre-beam && tremie fracture random-fibre-beam.toml
  tremie fibres runs/slab --cut cuts.toml
  tremie fracture --from runs/slab --beam B1
  tremie fracture my-material.toml --from runs/slab --beam B3 --cut cuts.toml --out runs/B3
  tremie fracture --resume runs/B3

Four-point bending (NSBT), three-point bending with a notch (EN 14651), tension, or a single fibre. The beam is a lattice of
rigid cells and springs, graded to its crack plane; every fibre that crosses the plane debonds and is pulled out. With --from, the
fibres are those of a beam that was cut out of a finished cast; its lower face is in tension, and the material is that of the
file, or of Svec's thesis if there is none.
The folder holds load, opening, deflection and energy of each beam (beam_1.csv), strengths (results.csv, summary.json), fibres through
sections (sections.csv), pictures, the crack and the fibres for ParaView, and report.html. Ctrl-C saves the test.
More of it stands in docs/fracture.md.")]
pub(crate) struct Arguments {
    /// The beam file
    beam_file: Option<PathBuf>,
    /// Take the fibres of a finished cast: the folder of its run
    #[arg(long, value_name = "DIR", requires = "beam")]
    from: Option<PathBuf>,
    /// The beam to cut out of the cast
    #[arg(long, value_name = "NAME", requires = "from")]
    beam: Option<String>,
    /// The file that says where beams are cut [default: that of the last `tremie fibres --cut` of the run]
    #[arg(long, value_name = "FILE", requires = "from")]
    cut: Option<PathBuf>,
    /// Folder for the results [default: runs/NAME in the current folder]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Replace the results of an earlier test in that folder
    #[arg(long)]
    force: bool,
    /// Go on with an interrupted test: its folder
    #[arg(long, value_name = "DIR", conflicts_with_all = ["beam_file", "from", "out", "force"])]
    resume: Option<PathBuf>,
    /// Show no progress
    #[arg(long, short)]
    quiet: bool,
    /// Print the results as JSON (the content of summary.json)
    #[arg(long)]
    json: bool,
}

/// Tests a beam.
pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<ExitCode> {
    let (folder, case, resumed) = match &arguments.resume {
        Some(path) => {
            let folder = Folder::open(path)?;
            let case = BeamCase::read(&folder.case())?;
            (folder, case, true)
        }
        None => {
            let (folder, case) = begin(arguments)?;
            (folder, case, false)
        }
    };
    if let BeamTest::PullOut { .. } = case.test {
        return pull_out::run(&case, &folder, arguments.json);
    }
    let interrupt = interrupt::watch()?;
    let job = Job::new(case, folder, resumed)?;
    if !arguments.quiet {
        terminal::note(&job.greeting());
    }
    let Some(done) = job.run(arguments.quiet, interrupt)? else {
        return Ok(ExitCode::from(interrupt::EXIT_CODE));
    };
    terminal::say(&if arguments.json {
        format!("{:#}", done.json())
    } else {
        format!("\n{}", terminal::columns(&done.rows()))
    });
    Ok(ExitCode::SUCCESS)
}

/// The beam that is asked for, in a folder of its own.
fn begin(arguments: &Arguments) -> anyhow::Result<(Folder, BeamCase)> {
    let out = |name: &str| arguments.out.clone().unwrap_or_else(|| PathBuf::from("runs").join(name));
    let given = arguments.beam_file.as_deref().map(BeamCase::read).transpose()?;
    let Some((run, name)) = arguments.from.as_deref().zip(arguments.beam.as_deref()) else {
        let Some((path, case)) = arguments.beam_file.as_deref().zip(given) else {
            let advice =
                "say what to test: a beam file (`tremie new --list` names some), or --from RUN --beam NAME";
            return Err(WrongInput(advice.to_owned()).into());
        };
        beam::check(&case)?;
        let folder = Folder::create(&out(&crate::run::name(path)), arguments.force)?;
        folder.begin(&case.text, &case.files)?;
        return Ok((folder, case));
    };
    let piece = cast::cut(run, name, arguments.cut.as_deref())?;
    let text = cast::text(given.as_ref(), &piece)?;
    let folder = Folder::create(&out(name), arguments.force)?;
    folder.begin(&text, &[])?;
    files::listed(&folder, &piece.fibres)?;
    let case = BeamCase::parse(&folder.case().display().to_string(), &text)?;
    beam::check(&case)?;
    Ok((folder, case))
}
