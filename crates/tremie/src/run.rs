//! `tremie run` and `tremie resume`, and what every run has in common.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;
use indicatif::HumanCount;
use tremie_case::Case;
use tremie_numerics::DVec3;
use tremie_simulation::gauges::BodyCount;
use tremie_simulation::{Checkpoint, EndReason, FillingFigures, RunError, RunFolder, RunRecord, Summary};

use crate::failure::{WrongInput, chain};
use crate::numbers::{Numbers, duration, significant};
use crate::{interrupt, lab, plan, progress, report, terminal};

/// Folder in which runs get folders of their own if nothing else is said.
const RUNS: &str = "runs";

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  tremie run cases/slump-flow/case.toml
  tremie run my-case.toml --out results/first --quiet

The folder holds the case, series.csv, summary.json, pictures, and fields for ParaView (open fluid.pvd
or surface.pvd). Ctrl-C saves the run; `tremie resume DIR` goes on with it.")]
pub(crate) struct RunArguments {
    /// The case file
    case: PathBuf,
    #[command(flatten)]
    place: Place,
    #[command(flatten)]
    manner: Manner,
}

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  tremie resume runs/slump-flow

A run that has come to its end goes on if its case.toml has been given a later stop time.")]
pub(crate) struct ResumeArguments {
    /// The folder of the run
    dir: PathBuf,
    #[command(flatten)]
    manner: Manner,
}

/// Where the results go.
#[derive(Debug, Args)]
pub(crate) struct Place {
    /// Folder for the results [default: runs/NAME in the current folder]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Replace the results of an earlier run in that folder
    #[arg(long)]
    force: bool,
}

/// How a run and its results are shown.
#[derive(Debug, Clone, Copy, Args)]
pub(crate) struct Manner {
    /// Show no progress
    #[arg(long, short)]
    quiet: bool,
    /// Print the results as JSON (the content of summary.json)
    #[arg(long)]
    json: bool,
}

/// Runs a case file.
pub(crate) fn run(arguments: RunArguments) -> anyhow::Result<ExitCode> {
    let case = Case::read(&arguments.case)?;
    let name = name(&arguments.case);
    Job::new(case, arguments.place, &name, None)?.run(arguments.manner)
}

/// Goes on with a run.
pub(crate) fn resume(arguments: &ResumeArguments) -> anyhow::Result<ExitCode> {
    Job::resume(&arguments.dir)?.run(arguments.manner)
}

/// What a run is called after its case file: the file's name, or the folder's if the file is just `case.toml`.
pub(crate) fn name(path: &Path) -> String {
    let stem = |path: &Path| Some(path.file_stem()?.to_string_lossy().into_owned());
    let folder = || {
        let path = path.canonicalize().ok()?;
        Some(path.parent()?.file_name()?.to_string_lossy().into_owned())
    };
    match stem(path) {
        Some(stem) if stem != "case" => stem,
        _ => folder().unwrap_or_else(|| "case".to_owned()),
    }
}

/// A run to be, from its start or from where an earlier one ended.
pub(crate) struct Job {
    case: Case,
    folder: RunFolder,
    /// Name of the standard experiment that the case stands for.
    experiment: Option<String>,
    checkpoint: Option<Checkpoint>,
}

impl Job {
    /// A new run of a case; `name` is that of its folder if `place` says none.
    pub(crate) fn new(
        case: Case,
        place: Place,
        name: &str,
        experiment: Option<&str>,
    ) -> anyhow::Result<Self> {
        let numbers = Numbers::new(&case);
        if let Some(refusal) = numbers.refusal(&case) {
            return Err(refusal.into());
        }
        let out = place.out.unwrap_or_else(|| Path::new(RUNS).join(name));
        let folder = RunFolder::create(&out, place.force)?;
        let program = format!("tremie {}", env!("CARGO_PKG_VERSION"));
        let mut record = RunRecord::new(program, case.method.name(), None, numbers.json());
        record.experiment = experiment.map(str::to_owned);
        folder.begin(&case.text, &case.files, &record)?;
        Ok(Self { case, folder, experiment: record.experiment, checkpoint: None })
    }

    /// The run in a folder, from its checkpoint.
    fn resume(path: &Path) -> anyhow::Result<Self> {
        let folder = RunFolder::open(path)?;
        let case = Case::read(&folder.case())?;
        let experiment = folder.record()?.experiment;
        if !folder.checkpoint().is_file() {
            let problem = format!("{} has no checkpoint yet", path.display());
            return Err(start_again(&problem, &folder).into());
        }
        let checkpoint = Checkpoint::read(&folder).map_err(|error| start_again(&chain(&error), &folder))?;
        Ok(Self { case, folder, experiment, checkpoint: Some(checkpoint) })
    }

    /// Runs it to its end, and tells the results.
    pub(crate) fn run(self, manner: Manner) -> anyhow::Result<ExitCode> {
        let Self { case, folder, experiment, checkpoint } = self;
        let numbers = Numbers::new(&case);
        if !manner.quiet {
            let from = checkpoint.as_ref().map(|c| format!(", from t = {:.3} s", c.time()));
            terminal::note(&format!(
                "{} in {}{}",
                case.title,
                folder.path().display(),
                from.unwrap_or_default()
            ));
            terminal::note(&numbers.short());
        }
        for warning in numbers.warnings() {
            terminal::warn(&warning);
        }
        let interrupt = interrupt::watch()?;
        let mut simulation = plan::simulation(&case);
        let mut observer = progress::observer(manner.quiet, case.stop.rest.is_some());
        let outcome = tremie_simulation::run(
            simulation.as_mut(),
            &case,
            &folder,
            checkpoint,
            observer.as_mut(),
            interrupt,
        );
        drop(observer);
        let outcome = outcome.map_err(|error| match error {
            RunError::Restore(_) => start_again(&error.to_string(), &folder).into(),
            _ => anyhow::Error::from(error),
        })?;
        if outcome.reason == EndReason::Interrupted {
            terminal::note(&format!(
                "Interrupted at t = {:.3} s. Go on with\n  tremie resume {}",
                outcome.summary.readings.time,
                quoted(folder.path())
            ));
            return Ok(ExitCode::from(interrupt::EXIT_CODE));
        }

        // The report makes a simulation of its own.
        drop(simulation);
        let mut json = outcome.summary.json();
        let standard = experiment.is_some();
        let mut rows = match experiment.and_then(|name| lab::figures(&name, &case, &outcome.summary)) {
            Some(figures) => {
                if let Some(results) = json.as_object_mut() {
                    results.extend(figures.json);
                }
                folder.write_summary(&json)?;
                figures.rows
            }
            None => readings(&outcome.summary),
        };
        rows.extend(ending(&outcome.summary, &folder));
        if standard {
            report::write(&folder, &folder.report())?;
            rows.push(("report", folder.report().display().to_string()));
        }
        terminal::say(&if manner.json {
            format!("{json:#}")
        } else {
            format!("\n{}", terminal::columns(&rows))
        });
        Ok(ExitCode::SUCCESS)
    }
}

/// What a run without a standard experiment has to tell.
pub(crate) fn readings(summary: &Summary) -> Vec<(&'static str, String)> {
    let readings = &summary.readings;
    let mut rows = Vec::new();
    if let Some(spread) = &readings.spread {
        rows.push((
            "spread",
            format!("{:.0} mm ({:.0} x {:.0} mm)", 1e3 * spread.mean, 1e3 * spread.x, 1e3 * spread.y),
        ));
    }
    rows.push(("largest height", format!("{:.0} mm", 1e3 * readings.top)));
    rows.push(("volume", format!("{} litres", significant(1e3 * readings.volume))));
    let passed = |volume: f64| format!("{} litres", significant(1e3 * volume));
    if !readings.inflow.is_empty() {
        rows.push(("came in", passed(readings.inflow.iter().sum())));
    }
    rows.extend(readings.outflow.map(|volume| ("left", passed(volume))));
    let of = |(n, volume): (usize, &f64)| ("", format!("{} of batch {}", passed(*volume), n + 1));
    rows.extend(readings.batches_out.iter().enumerate().map(of));
    rows.extend(readings.bodies.iter().map(|(name, count)| {
        let BodyCount { came, left, present } = count;
        ("bodies", format!("{came} {name} in all: {left} have left, {present} are there"))
    }));
    rows.push(("speed, 99th percentile", format!("{} mm/s", significant(1e3 * readings.speed_p99))));
    rows.extend(summary.filling.iter().flat_map(filling));
    rows
}

/// How the form filled.
fn filling(figures: &FillingFigures) -> Vec<(&'static str, String)> {
    let place = |p: DVec3| {
        let [x, y, z] = (1e3 * p).to_array();
        format!("at ({x:.0}, {y:.0}, {z:.0}) mm")
    };
    let litres = |volume: f64| format!("{} litres", significant(1e3 * volume));
    let last = figures.last.iter().enumerate().map(|(n, (time, p))| {
        let name = if n == 0 { "filled last" } else { "" };
        (name, format!("{} s {}", significant(*time), place(*p)))
    });
    let mut rows: Vec<(&'static str, String)> = last.collect();
    rows.push(("dead zones", litres(figures.dead_volume)));
    let number = figures.pockets.len();
    let air: f64 = figures.pockets.iter().map(|pocket| pocket.volume).sum();
    rows.push((
        "trapped air",
        match figures.pockets.first() {
            Some(largest) => {
                format!("{} in {number} pockets, the largest {}", litres(air), place(largest.centre))
            }
            None => "none".to_owned(),
        },
    ));
    rows
}

/// How a run ended, in words.
pub(crate) fn reason(end: EndReason) -> &'static str {
    match end {
        EndReason::Rest => "came to rest",
        EndReason::Event => "came to its event",
        EndReason::Time => "stop time reached",
        EndReason::Interrupted => "interrupted",
    }
}

/// How a run ended, what it cost and where its results are.
fn ending(summary: &Summary, folder: &RunFolder) -> Vec<(&'static str, String)> {
    let reason = reason(summary.end_reason);
    vec![
        ("end", format!("{reason} at {:.2} s", summary.readings.time)),
        (
            "cost",
            format!(
                "{}, {} steps, {} M updates/s",
                duration(summary.wall),
                HumanCount(summary.steps),
                significant(1e-6 * summary.updates_per_second)
            ),
        ),
        ("results", folder.path().display().to_string()),
    ]
}

/// A run that cannot be resumed must be started again from its case.
fn start_again(problem: &str, folder: &RunFolder) -> WrongInput {
    let (case, path) = (folder.case(), folder.path());
    WrongInput(format!(
        "{problem}\nStart the run again with\n  tremie run {} --out {} --force",
        quoted(&case),
        quoted(path)
    ))
}

/// A path as one types it.
pub(crate) fn quoted(path: &Path) -> String {
    let text = path.display().to_string();
    if text.contains(char::is_whitespace) { format!("\"{text}\"") } else { text }
}
