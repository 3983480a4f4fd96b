//! The tests of a file, one beam after the other; what was interrupted goes on.

use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use serde_json::json;
use tremie_case::{BeamCase, CaseError};
use tremie_fracture::standard::openings;
use tremie_fracture::{Reading, State, Trial, TrialError};
use tremie_output::state::Array;

use super::folder::Folder;
use super::progress::Progress;
use super::results::{Beam, Done};
use super::{beam, files};
use crate::failure::chain;
use crate::run::quoted;
use crate::terminal;

/// Wall-clock time between two checkpoints.
const CHECKPOINTS: Duration = Duration::from_secs(30);

/// Tests to be done.
pub(super) struct Job {
    case: BeamCase,
    folder: Folder,
    openings: Vec<f64>,
    /// Beams that are done.
    done: Vec<Beam>,
    /// The one that was interrupted: its readings and state.
    begun: Option<(Vec<Reading>, State)>,
}

impl Job {
    /// The tests of a beam file, from their start or from the checkpoint in the folder.
    pub(super) fn new(case: BeamCase, folder: Folder, resumed: bool) -> anyhow::Result<Self> {
        let openings = openings(case.opening);
        let mut job = Self { case, folder, openings, done: Vec::new(), begun: None };
        if resumed {
            job.restore()?;
        }
        Ok(job)
    }

    /// What is to be done, in a line or two.
    pub(super) fn greeting(&self) -> String {
        let lattice = &self.case.lattice;
        let fibres = beam::fibres(&self.case, lattice.seed).len();
        let from = match (&self.begun, self.done.len()) {
            (Some((_, state)), n) => {
                format!(", from beam {}, opening {:.3} mm", n + 1, 1e3 * state.last.opening)
            }
            (None, 0) => String::new(),
            (None, n) => format!(", from beam {}", n + 1),
        };
        let anywhere = if lattice.anywhere { ", which may be anywhere" } else { "" };
        let beams = if lattice.beams == 1 { "1 beam".to_owned() } else { format!("{} beams", lattice.beams) };
        format!(
            "{} in {}{from}\n{beams}, {fibres} fibres, cells of {} mm at the crack{anywhere}, to an opening of {} mm",
            self.case.title,
            self.folder.path().display(),
            1e3 * lattice.finest,
            1e3 * self.case.opening
        )
    }

    /// Does them; nothing if it was interrupted.
    pub(super) fn run(mut self, quiet: bool, interrupt: &AtomicBool) -> anyhow::Result<Option<Done>> {
        let beams = self.case.lattice.beams;
        let steps = self.openings.len() as u64;
        let end = self.case.opening;
        let reached = |readings: &[Reading], openings: &[f64]| {
            let last = readings.last().map_or(0.0, |reading| reading.opening);
            openings.iter().filter(|opening| **opening <= last * (1.0 + 1e-9)).count()
        };
        let before = self.done.len() as u64 * steps
            + self.begun.as_ref().map_or(0, |(readings, _)| reached(readings, &self.openings) as u64);
        let mut progress = Progress::new(quiet, beams * steps, before);
        let begin = Instant::now();
        let mut saved = Instant::now();
        while (self.done.len() as u64) < beams {
            let number = self.done.len() as u64 + 1;
            let seed = self.case.lattice.seed + number - 1;
            let mut trial = Trial::new(beam::setup(&self.case, seed)).map_err(|error| self.told(error))?;
            let mut readings = Vec::new();
            if let Some((earlier, state)) = self.begun.take() {
                trial.restore(state).map_err(|error| self.folder.start_again(&error.to_string()))?;
                readings = earlier;
            }
            for step in reached(&readings, &self.openings)..self.openings.len() {
                readings.extend(trial.advance(self.openings[step]).map_err(|error| self.told(error))?);
                progress.show((number - 1) * steps + step as u64 + 1, number, beams, trial.last(), end);
                let stop = interrupt.load(Ordering::Relaxed);
                if stop || saved.elapsed() > CHECKPOINTS {
                    self.save(&readings, &trial)?;
                    saved = Instant::now();
                }
                if stop {
                    drop(progress);
                    self.folder.cost(
                        begin.elapsed().as_secs_f64(),
                        solutions(&self.done, &readings),
                        "interrupted",
                    )?;
                    terminal::note(&format!(
                        "Interrupted at beam {number}, opening {:.3} mm. Go on with\n  tremie fracture --resume {}",
                        1e3 * trial.last().opening,
                        quoted(self.folder.path())
                    ));
                    return Ok(None);
                }
            }
            files::beam(&self.folder, number, &readings, &trial)?;
            self.done.push(Beam::new(&self.case, seed, readings));
        }
        drop(progress);
        let seconds = begin.elapsed().as_secs_f64();
        self.folder.cost(seconds, solutions(&self.done, &[]), "opening")?;
        let seconds = self.folder.record()?.wall_s;
        let done = Done { case: self.case, beams: self.done, seconds, path: self.folder.path().to_owned() };
        files::all(&self.folder, &done)?;
        let checkpoint = self.folder.checkpoint();
        if checkpoint.is_file() {
            std::fs::remove_file(checkpoint)?;
        }
        Ok(Some(done))
    }

    /// What a lattice cannot do, at the key that it depends on.
    fn told(&self, error: TrialError) -> anyhow::Error {
        let refuse = |key: &str, advice: &str| -> anyhow::Error {
            let error: CaseError = self.case.refuse(key, error.to_string(), advice);
            error.into()
        };
        match error {
            TrialError::Coarse { .. } => refuse("lattice.spacing", "write a smaller `spacing` or `coarsest`"),
            TrialError::Brittle { .. } => {
                refuse("matrix.kink_opening", "make the softening longer, or `spacing` smaller")
            }
            TrialError::Singular(_) => refuse("test", "let the supports stand further apart"),
            error => anyhow::Error::from(error),
        }
    }

    fn save(&self, readings: &[Reading], trial: &Trial) -> anyhow::Result<()> {
        let state = trial.save();
        let [older, newer] = state.jumps;
        let rows = |readings: &[Reading]| readings.iter().flat_map(row).collect::<Vec<f64>>();
        let arrays = [
            ("most", state.most),
            ("older", older),
            ("newer", newer),
            ("openings", state.openings.to_vec()),
            ("last", row(&state.last).to_vec()),
            ("readings", rows(readings)),
        ];
        let arrays = arrays.map(|(name, values)| (name.to_owned(), Array::F64(values))).to_vec();
        let header = json!({ "kind": "fracture", "beams": self.done.len() });
        Ok(tremie_output::state::State { header, arrays }.write(&self.folder.checkpoint())?)
    }

    fn restore(&mut self) -> anyhow::Result<()> {
        let path = self.folder.checkpoint();
        if !path.is_file() {
            let shown = self.folder.path().display();
            let problem = if self.folder.file("summary.json").is_file() {
                format!("{shown} holds a test that has come to its end")
            } else {
                format!("{shown} has no checkpoint yet")
            };
            return Err(self.folder.start_again(&problem).into());
        }
        let state = tremie_output::state::State::read(&path)
            .map_err(|error| self.folder.start_again(&chain(&error)))?;
        let foreign = || self.folder.start_again("the checkpoint is not that of this test");
        let array = |name: &str| match state.arrays.iter().find(|(other, _)| other == name) {
            Some((_, Array::F64(values))) => Ok(values.clone()),
            _ => Err(foreign()),
        };
        let beams = state.header["beams"].as_u64().ok_or_else(foreign)?;
        if state.header["kind"] != "fracture" || beams >= self.case.lattice.beams {
            return Err(foreign().into());
        }
        let mut done = Vec::new();
        for n in 0..beams {
            let table = tremie_output::series::read(&beam_file(&self.folder, n + 1))
                .map_err(|error| self.folder.start_again(&chain(&error)))?;
            let readings: Option<Vec<Reading>> = table.rows.iter().map(|row| reading(row)).collect();
            done.push(Beam::new(&self.case, self.case.lattice.seed + n, readings.ok_or_else(foreign)?));
        }
        let rows = array("readings")?;
        let readings: Option<Vec<Reading>> = rows.chunks(COLUMNS.len()).map(reading).collect();
        let openings: [f64; 2] = array("openings")?.try_into().map_err(|_| foreign())?;
        let state = State {
            most: array("most")?,
            jumps: [array("older")?, array("newer")?],
            openings,
            last: reading(&array("last")?).ok_or_else(foreign)?,
        };
        self.begun = Some((readings.ok_or_else(foreign)?, state));
        self.done = done;
        Ok(())
    }
}

/// The readings of a beam, by its number from 1.
pub(super) fn beam_file(folder: &Folder, number: u64) -> PathBuf {
    folder.file(&format!("beam_{number}.csv"))
}

/// The columns of readings.
pub(super) const COLUMNS: [&str; 9] = [
    "opening_m",
    "load_N",
    "stress_Pa",
    "deflection_m",
    "deflection_middle_m",
    "work_J",
    "matrix_loss_J",
    "fibre_loss_J",
    "solutions",
];

/// A reading as a row.
pub(super) fn row(reading: &Reading) -> [f64; COLUMNS.len()] {
    let Reading { opening, load, stress, deflection, middle, work, matrix_loss, fibre_loss, attempts } =
        *reading;
    [opening, load, stress, deflection, middle, work, matrix_loss, fibre_loss, attempts as f64]
}

fn reading(row: &[f64]) -> Option<Reading> {
    let [opening, load, stress, deflection, middle, work, matrix_loss, fibre_loss, attempts] = *row else {
        return None;
    };
    let attempts = attempts as usize;
    Some(Reading { opening, load, stress, deflection, middle, work, matrix_loss, fibre_loss, attempts })
}

/// Solutions that readings took.
fn solutions(done: &[Beam], readings: &[Reading]) -> u64 {
    let all = done.iter().flat_map(|beam| &beam.readings).chain(readings);
    all.map(|reading| reading.attempts as u64).sum()
}
