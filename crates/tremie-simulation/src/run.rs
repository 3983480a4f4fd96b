//! The run loop: advances a simulation from its start, or from a checkpoint, to its end.
//!
//! Readings, snapshots and pictures come at the first step at or past each multiple of their interval of simulated
//! time, and once more at the end; a run that was interrupted and resumed therefore leaves the same files as one that
//! was not. Checkpoints come at intervals of wall-clock time and at the end, and influence nothing.

use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use tremie_case::Case;
use tremie_output::pvd::Collection;
use tremie_output::series::Series;
use tremie_output::vtp;
use tremie_output::{Field, Values};

use crate::bodies;
use crate::checkpoint::{Checkpoint, RunState};
use crate::fibres::Records;
use crate::filling::Filling;
use crate::folder::{FolderError, RunFolder, RunRecord};
use crate::gauges::{Gauges, Readings, TargetTime};
use crate::progress::{Amounts, Meter, Observer, Progress};
use crate::rest::RestWatch;
use crate::schedule::{self, Schedule};
use crate::summary::{EndReason, Summary};
use crate::surface::Surface;
use crate::{Breakdown, Fluid, RestoreError, Simulation, Snapshot, fields, pictures};

/// Spread in m whose time is T500 (EN 12350-8): the first touch of the 500 mm circle.
const T500_SPREAD: f64 = 0.5;

/// How a run ended.
#[derive(Debug, Clone, PartialEq)]
pub struct Outcome {
    /// Why it ended.
    pub reason: EndReason,
    /// Its results, as far as it went.
    pub summary: Summary,
}

/// Why a run failed.
#[derive(Debug, thiserror::Error)]
pub enum RunError {
    /// The numbers broke down.
    #[error("{breakdown}. {}", match checkpoint {
        Some(path) => format!("The last good state is in {}", path.display()),
        None => "No checkpoint had been written yet".to_owned(),
    })]
    Breakdown {
        /// Where, when and why.
        breakdown: Breakdown,
        /// The last good state.
        checkpoint: Option<PathBuf>,
    },
    /// The checkpoint belongs to another run.
    #[error(transparent)]
    Restore(#[from] RestoreError),
    /// The checkpoint lacks the run loop's state.
    #[error("{} is no checkpoint of a run", path.display())]
    Checkpoint {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        source: serde_json::Error,
    },
    /// The folder cannot be used.
    #[error(transparent)]
    Folder(#[from] FolderError),
    /// A file could not be written.
    #[error(transparent)]
    Output(#[from] tremie_output::Error),
}

/// Runs a simulation of `case` to its end, with all results in `folder`, in which [`RunFolder::begin`] has been called.
///
/// With `resume` the simulation, made from the same case, is first put back to that checkpoint of the same folder, and
/// what the folder holds of later times is dropped. When `interrupt` becomes true the step is finished and a
/// checkpoint is written.
///
/// # Errors
/// [`RunError`] if the numbers break down or a file cannot be written.
pub fn run(
    simulation: &mut dyn Simulation,
    case: &Case,
    folder: &RunFolder,
    resume: Option<Checkpoint>,
    observer: &mut dyn Observer,
    interrupt: &AtomicBool,
) -> Result<Outcome, RunError> {
    let mut run = Run::begin(simulation, case, folder, resume)?;
    let mut meter = Meter::new(Instant::now(), run.amounts(simulation));
    let mut saved = Instant::now();
    let reason = loop {
        run.write(simulation, false)?;
        if let Some(reason) = run.end(simulation) {
            run.write(simulation, true)?;
            run.show_filling()?;
            break reason;
        }
        if interrupt.load(Ordering::Relaxed) {
            break EndReason::Interrupted;
        }
        if saved.elapsed().as_secs_f64() >= case.output.checkpoint_interval {
            run.save(simulation, None)?;
            saved = Instant::now();
        }
        if let Err(breakdown) = simulation.advance() {
            return Err(run.fail(simulation, breakdown)?);
        }
        run.state.time = simulation.time();
        run.state.steps += 1;
        let now = Instant::now();
        if meter.due(now) {
            observer.progress(&run.progress(simulation, &mut meter, now));
        }
    };
    observer.progress(&run.progress(simulation, &mut meter, Instant::now()));
    run.save(simulation, Some(reason))?;
    let summary = run.summary(simulation, reason);
    folder.write_summary(&summary.json())?;
    Ok(Outcome { reason, summary })
}

/// A run that is going on.
struct Run<'a> {
    case: &'a Case,
    folder: &'a RunFolder,
    gauges: Gauges,
    /// What was seen last, whose memory is used again: taken anew for each reading, it would cost about as much as what is seen in it.
    view: Snapshot,
    /// How the form fills, if the case asks for it.
    filling: Option<Filling>,
    state: RunState,
    series: Series,
    /// Fields, surfaces and bodies, if the case wants snapshots.
    collections: Option<[Collection; 2]>,
    body_collection: Option<Collection>,
    /// How bodies lie, if there are any.
    records: Option<Records>,
    latest: Readings,
    /// The record when this process began, and that moment.
    before: RunRecord,
    began: Instant,
    /// Updates that the simulation had counted by then.
    updates_before: u64,
}

impl<'a> Run<'a> {
    fn begin(
        simulation: &mut dyn Simulation,
        case: &'a Case,
        folder: &'a RunFolder,
        resume: Option<Checkpoint>,
    ) -> Result<Self, RunError> {
        folder.sweep()?;
        let before = folder.record()?;
        if let Some(checkpoint) = &resume {
            checkpoint.restore(simulation)?;
        }
        let gauges = Gauges::new(case);
        let view = simulation.snapshot();
        let latest = gauges.measure(&view);
        let Fluid::Cells(cells) = &view.fluid;
        let mut filling = Filling::new(case, cells);
        let resumed = match resume {
            Some(checkpoint) => {
                if let Some(filling) = &mut filling {
                    filling.restore(&checkpoint.filling).map_err(RestoreError::Array)?;
                }
                Some(checkpoint.run)
            }
            None => None,
        };
        let columns = latest.columns();
        let columns: Vec<&str> = columns.iter().map(|(name, _)| name.as_str()).collect();
        let time = resumed.as_ref().map(|state| state.time);
        let series = match time {
            Some(time) => Series::resume(&folder.series(), &columns, time)?,
            None => Series::create(&folder.series(), &columns)?,
        };
        let collection = |path: PathBuf| match time {
            Some(time) => Collection::resume(&path, time),
            None => Collection::create(&path),
        };
        let collections = match case.output.snapshot_interval {
            Some(_) => Some([collection(folder.fluid())?, collection(folder.surface())?]),
            None => None,
        };
        let swims = !view.inclusions.kinds.is_empty() && case.output.snapshot_interval.is_some();
        let body_collection = if swims { Some(collection(folder.bodies())?) } else { None };
        let records = Records::begin(case, &view.inclusions, folder, time)?;
        let state = resumed.unwrap_or_else(|| RunState {
            time: simulation.time(),
            steps: 0,
            first_volume: latest.volume,
            readings: Schedule::default(),
            snapshots: Schedule::default(),
            pictures: Schedule::default(),
            t500: TargetTime::new(T500_SPREAD),
            events: gauges.targets(),
            peaks: gauges.no_peaks(),
            rest: RestWatch::default(),
        });
        let updates_before = simulation.load().updates;
        Ok(Self {
            case,
            folder,
            gauges,
            view,
            filling,
            state,
            series,
            collections,
            body_collection,
            records,
            latest,
            before,
            began: Instant::now(),
            updates_before,
        })
    }

    /// Writes what is due at the present time; at the `end` everything that has not just been written.
    fn write(&mut self, simulation: &dyn Simulation, end: bool) -> Result<(), RunError> {
        let time = self.state.time;
        let due = |schedule: &Schedule, interval: Option<f64>| {
            interval.filter(|interval| schedule.due(time, *interval) || (end && !schedule.done_at(time)))
        };
        let reading = due(&self.state.readings, Some(self.case.gauges.interval));
        let snapshot = due(&self.state.snapshots, self.case.output.snapshot_interval);
        let picture = due(&self.state.pictures, self.case.output.picture_interval);
        if reading.or(snapshot).or(picture).is_none() && !end {
            return Ok(());
        }
        let mut view = std::mem::take(&mut self.view);
        simulation.see(&mut view);
        if end && !view.inclusions.kinds.is_empty() {
            bodies::write_table(&view.inclusions, &self.folder.body_table())?;
        }
        let only = end && self.case.output.snapshot_interval.is_none();
        if let Some(records) = self.records.as_mut().filter(|_| snapshot.is_some() || only) {
            records.write(&view, self.folder, time, self.state.snapshots.count)?;
        }
        if let Some(interval) = reading {
            self.read(&view)?;
            self.state.readings.done(time, interval);
        }
        if let Some(interval) = snapshot {
            self.write_snapshot(&view)?;
            self.state.snapshots.done(time, interval);
        }
        if let Some(interval) = picture {
            pictures::draw(&view, time, self.case, self.folder, self.state.pictures.count)?;
            self.state.pictures.done(time, interval);
        }
        self.view = view;
        Ok(())
    }

    fn read(&mut self, view: &Snapshot) -> Result<(), RunError> {
        let readings = self.gauges.measure(view);
        if let Some(filling) = &mut self.filling {
            let Fluid::Cells(cells) = &view.fluid;
            filling.see(cells, readings.time);
        }
        let row: Vec<f64> = readings.columns().into_iter().map(|(_, value)| value).collect();
        self.series.append(&row)?;
        if let Some(records) = &mut self.records {
            records.read(view, self.case, readings.time)?;
        }
        if let Some(spread) = &readings.spread {
            self.state.t500.update(readings.time, spread.max);
        }
        for (event, value) in self.state.events.iter_mut().zip(readings.awaited()) {
            event.update(readings.time, value);
        }
        self.gauges.watch_pressures(&mut self.state.peaks, &readings, view);
        if let Some(rest) = &self.case.stop.rest {
            self.state.rest.update(rest, &readings);
        }
        self.latest = readings;
        Ok(())
    }

    fn write_snapshot(&mut self, view: &Snapshot) -> Result<(), RunError> {
        let Some([fluid, surfaces]) = &mut self.collections else {
            return Ok(());
        };
        let Fluid::Cells(cells) = &view.fluid;
        let number = self.state.snapshots.count;
        let name = format!("fluid_{number:06}.vti");
        fields::write(cells, self.state.time, &self.folder.path().join(&name))?;
        fluid.push(self.state.time, &name)?;

        let name = format!("surface_{number:06}.vtp");
        let surface = Surface::new(cells);
        let scalar = |name, values| Field { name, components: 1, values: Values::F32(values) };
        vtp::Surface {
            positions: &surface.mesh.positions,
            triangles: &surface.mesh.triangles,
            time: self.state.time,
            fields: vec![scalar("speed [m/s]", &surface.speed), scalar("pressure [Pa]", &surface.pressure)],
        }
        .write(&self.folder.path().join(&name))?;
        surfaces.push(self.state.time, &name)?;
        if let Some(collection) = &mut self.body_collection {
            let name = format!("bodies_{number:06}.vtp");
            bodies::write(&view.inclusions, self.state.time, &self.folder.path().join(&name))?;
            collection.push(self.state.time, &name)?;
        }
        Ok(())
    }

    /// Whether the run has come to its end.
    fn end(&self, simulation: &dyn Simulation) -> Option<EndReason> {
        // While a mould is on its way, or fluid has yet to come, a fluid at rest has not come to its rest.
        let time = simulation.time();
        let settled = !self.case.solids_move(time) && !self.case.pours(time);
        if settled && self.case.stop.rest.as_ref().is_some_and(|rest| self.state.rest.reached(rest)) {
            Some(EndReason::Rest)
        } else if self.event() {
            Some(EndReason::Event)
        } else if schedule::reached(simulation.time(), self.case.stop.time) {
            Some(EndReason::Time)
        } else {
            None
        }
    }

    /// Whether that has come by which the case ends.
    fn event(&self) -> bool {
        let awaited = self.case.stop.event.as_ref().and_then(|name| self.gauges.event(name));
        awaited.is_some_and(|n| self.state.events[n].reached().is_some())
    }

    /// Writes a checkpoint and brings the record up to date.
    fn save(&self, simulation: &dyn Simulation, end: Option<EndReason>) -> Result<(), RunError> {
        Checkpoint::write(self.folder, simulation.save(), &self.state, self.filling.as_ref())?;
        Ok(self.folder.write_record(&self.record(simulation, end.map(EndReason::name)))?)
    }

    fn record(&self, simulation: &dyn Simulation, end_reason: Option<&str>) -> RunRecord {
        let wall_s = self.before.wall_s + self.began.elapsed().as_secs_f64();
        let updates = self.before.updates + self.updates(simulation);
        RunRecord {
            wall_s,
            steps: self.state.steps,
            updates,
            updates_per_second: updates as f64 / wall_s,
            end_reason: end_reason.map(str::to_owned),
            ..self.before.clone()
        }
    }

    /// Records a breakdown, and makes it an error that says where the last good state is.
    fn fail(&self, simulation: &dyn Simulation, breakdown: Breakdown) -> Result<RunError, RunError> {
        self.folder.write_record(&self.record(simulation, Some("breakdown")))?;
        let path = self.folder.checkpoint();
        Ok(RunError::Breakdown { breakdown, checkpoint: path.is_file().then_some(path) })
    }

    /// Shows how the form has filled, by what was seen last.
    fn show_filling(&self) -> Result<(), RunError> {
        let Some(filling) = &self.filling else { return Ok(()) };
        let Fluid::Cells(cells) = &self.view.fluid;
        let maps = filling.maps(cells);
        fields::write_filling(cells, &maps, self.state.time, &self.folder.filling())?;
        Ok(pictures::draw_filling(cells, &maps, self.case, self.folder)?)
    }

    fn summary(&mut self, simulation: &dyn Simulation, end_reason: EndReason) -> Summary {
        simulation.see(&mut self.view);
        let Fluid::Cells(cells) = &self.view.fluid;
        let readings = self.gauges.measure(&self.view);
        let record = self.record(simulation, None);
        let passed = readings.inflow.iter().sum::<f64>() - readings.outflow.unwrap_or(0.0);
        let due = self.state.first_volume + passed;
        let volume = readings.volume;
        Summary {
            end_reason,
            readings,
            t500: self.state.t500.reached(),
            events: self
                .gauges
                .events()
                .into_iter()
                .zip(self.state.events.iter().map(TargetTime::reached))
                .collect(),
            peaks: self.gauges.pressure_names().cloned().zip(self.state.peaks.iter().copied()).collect(),
            filling: self.filling.as_ref().map(|filling| filling.figures(cells)),
            volume_error: if due > 0.0 { volume / due - 1.0 } else { 0.0 },
            steps: record.steps,
            wall: record.wall_s,
            updates_per_second: record.updates_per_second,
        }
    }

    /// Updates since this process began.
    fn updates(&self, simulation: &dyn Simulation) -> u64 {
        simulation.load().updates.saturating_sub(self.updates_before)
    }

    fn amounts(&self, simulation: &dyn Simulation) -> Amounts {
        Amounts {
            time: self.state.time,
            steps: self.state.steps as f64,
            updates: self.updates(simulation) as f64,
        }
    }

    fn progress(&self, simulation: &dyn Simulation, meter: &mut Meter, now: Instant) -> Progress {
        let rates = meter.rates(now, self.amounts(simulation));
        let end_time = self.case.stop.time;
        let left = (end_time - self.state.time).max(0.0);
        Progress {
            time: self.state.time,
            end_time,
            steps: self.state.steps,
            steps_per_second: rates.steps,
            updates_per_second: rates.updates,
            time_left: (rates.time > 0.0).then(|| left / rates.time),
            readings: self.latest.clone(),
        }
    }
}
