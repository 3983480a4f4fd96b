//! `tremie fibres`: how fibres lie in a finished cast, and in beams and planes that are cut out of it.

mod against;
mod figures;
mod files;
mod json;
mod table;

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;
use tremie_case::{Case, Cuts};
use tremie_simulation::{Fluid, RunFolder, Snapshot};
use tremie_suspension::{Form, Inclusions};

use crate::failure::WrongInput;
use crate::{last_state, terminal};
use figures::Figures;

/// The folder for files, within that of the run.
const FOLDER: &str = "fibres";

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  tremie fibres runs/slab
  tremie fibres runs/slab --cut cases/fibre-slab/cuts.toml --out cuts
  tremie fibres runs/slab --cut cases/fibre-slab/cuts.toml --against runs/rough
  tremie fibres runs/slab --field --against runs/slab
  tremie fibres runs/slab --json

A file of cuts has beams, boxes along the axes, and pieces of planes:

  [[beam]]
  name = \"B1\"
  min = [\"250 mm\", \"100 mm\", \"0 mm\"]     # corners
  max = [\"850 mm\", \"250 mm\", \"150 mm\"]
  #along = \"x\"                            # its axis; the longest edge if absent

  [[plane]]
  name = \"middle\"
  point = [\"600 mm\", \"600 mm\", \"75 mm\"]  # centre
  normal = [1, 0, 0]
  size = [\"150 mm\", \"150 mm\"]            # edges; the second is horizontal, or along y if both are

Fibres are clipped at the faces of the beams, and counted in the section in the middle of each.
The orientation factor of a section is alpha = N A_f / (phi A_c): N fibres of the cross-section A_f
through the area A_c of concrete, and the share phi of fibres in the beam; for planes, in the whole
cast. It is 1/2 for fibres in all directions alike, 1 if they stand across the section. The halves
of a beam are parted at half of its height, those of the cast where half of its volume lies below.
The bodies are those of the last checkpoint; what lies beyond planes of symmetry does not count.
More of it stands in docs/fibres.md.")]
pub(crate) struct Arguments {
    /// The folder of the run
    dir: PathBuf,
    /// The file that says which beams and planes to cut out
    #[arg(long, value_name = "FILE")]
    cut: Option<PathBuf>,
    /// Another run to compare with, of the same case or another
    #[arg(long, value_name = "DIR")]
    against: Option<PathBuf>,
    /// The folder for tables, clipped fibres and a picture [default: `fibres` in the folder of the run]; files in these places are replaced
    #[arg(long, value_name = "DIR", requires = "cut")]
    out: Option<PathBuf>,
    /// Take the field of a case with `fibre_field`, where there are fibres as bodies too
    #[arg(long)]
    field: bool,
    /// Print JSON, in SI units
    #[arg(long)]
    json: bool,
}

/// The file of cuts that was used last, as a run keeps it.
const CUTS: &str = "cuts.toml";

/// Where a run keeps the file of cuts that was used last.
pub(crate) fn kept_cuts(run: &Path) -> PathBuf {
    run.join(FOLDER).join(CUTS)
}

/// A run and its last state.
pub(crate) struct Cast {
    folder: RunFolder,
    pub(crate) case: Case,
    pub(crate) state: Snapshot,
}

impl Cast {
    /// Reads the last state of a run that has fibres.
    pub(crate) fn read(dir: &Path, field: bool) -> anyhow::Result<Self> {
        let folder = RunFolder::open(dir)?;
        let case = Case::read(&folder.case())?;
        let shown = folder.path().display();
        let mut state = last_state::read(&folder, &case)?.map_err(|reason| {
            WrongInput(format!(
                "how fibres lie in {shown} cannot be told: {reason}; `tremie run` or `tremie resume` writes one"
            ))
        })?;
        if field {
            if case.fibre_field.is_none() {
                return Err(WrongInput(format!("{shown} has no field of fibres; leave out --field")).into());
            }
            state.inclusions = Inclusions::default();
        }
        let bodies = &state.inclusions;
        let followed = (0..bodies.len()).any(|n| matches!(bodies.form(n), Form::Fibre { .. }));
        let Fluid::Cells(cells) = &state.fluid;
        if !followed && cells.field_beside(bodies).is_none() {
            return Err(WrongInput(format!(
                "{shown} has no fibres at t = {:.3} s; they are [[inclusions]], [[inlet.inclusions]] or [fibre_field] of a case",
                state.time
            ))
            .into());
        }
        Ok(Self { folder, case, state })
    }
}

/// Tells how fibres lie.
pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<ExitCode> {
    let cuts = arguments.cut.as_deref().map(Cuts::read).transpose()?;
    let cast = Cast::read(&arguments.dir, arguments.field)?;
    let figures = Figures::new(&cast, cuts.as_ref())?;
    let other = match &arguments.against {
        Some(dir) => Some(Figures::new(&Cast::read(dir, false)?, cuts.as_ref())?),
        None => None,
    };
    let written = match &cuts {
        Some(cuts) => {
            let folder = arguments.out.clone().unwrap_or_else(|| cast.folder.path().join(FOLDER));
            files::write(&cast, &figures, cuts, &folder)?
        }
        None => Vec::new(),
    };
    if arguments.json {
        terminal::say(&format!("{:#}", json::all(&figures, other.as_ref(), &written)));
        return Ok(ExitCode::SUCCESS);
    }
    terminal::say(&table::all(&figures));
    if let Some(other) = &other {
        terminal::say(&format!("\n{}", against::all(&figures, other)));
    }
    if !written.is_empty() {
        let paths: Vec<String> = written.iter().map(|path| format!("  {}", path.display())).collect();
        terminal::say(&format!("\nWritten\n{}", paths.join("\n")));
    }
    Ok(ExitCode::SUCCESS)
}
