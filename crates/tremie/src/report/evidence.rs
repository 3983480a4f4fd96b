//! What a run folder holds, read once.

use std::path::PathBuf;

use tremie_case::Case;
use tremie_output::series::{self, Table};
use tremie_simulation::{Cells, Fluid, FolderError, RunFolder, RunRecord, Snapshot, Summary};
use tremie_suspension::Inclusions;

use crate::lab::{self, Figures};
use crate::last_state;
use crate::numbers::Numbers;

/// All that the report is made from.
pub(super) struct Evidence {
    pub(super) folder: PathBuf,
    pub(super) case: Case,
    pub(super) record: RunRecord,
    pub(super) summary: Summary,
    pub(super) numbers: Numbers,
    /// Name of the standard experiment and its figures, if the run is one.
    pub(super) experiment: Option<(String, Figures)>,
    series: Table,
    /// The time in s of the last state, the fluid, and what swims in it.
    pub(super) last: Option<(f64, Cells, Inclusions)>,
    /// Pictures from above, and cuts.
    pub(super) pictures: [Vec<PathBuf>; 2],
    /// Pictures of how the form filled.
    pub(super) filling: Vec<PathBuf>,
    /// What could not be shown, and why.
    pub(super) missing: Vec<String>,
}

impl Evidence {
    pub(super) fn gather(folder: &RunFolder) -> anyhow::Result<Self> {
        let case = Case::read(&folder.case())?;
        let record = folder.record()?;
        let summary = folder.read_summary(&case)?;
        let series = series::read(&folder.series()).map_err(FolderError::from)?;
        let experiment = record.experiment.clone().or_else(|| lab::recognised(&case).map(str::to_owned));
        let experiment = experiment.and_then(|name| {
            let figures = lab::figures(&name, &case, &summary)?;
            Some((name, figures))
        });
        let mut missing = Vec::new();
        let last = match last_state::read(folder, &case)? {
            Ok(Snapshot { time, fluid: Fluid::Cells(cells), inclusions, .. }) => {
                Some((time, cells, inclusions))
            }
            Err(reason) => {
                missing.push(format!("The last state and the profile are not shown: {reason}."));
                None
            }
        };
        let pictures = folder.pictures()?;
        if pictures.iter().all(Vec::is_empty) {
            missing.push(
                "There are no pictures over time: the case has no picture_interval under [output]."
                    .to_owned(),
            );
        }
        Ok(Self {
            folder: folder.path().to_owned(),
            numbers: Numbers::new(&case),
            case,
            record,
            summary,
            experiment,
            series,
            last,
            pictures,
            filling: folder.filling_pictures(),
            missing,
        })
    }

    /// Readings over time as points (time in s, value times `factor`); none if they were not taken.
    pub(super) fn readings(&self, column: &str, factor: f64) -> Option<Vec<[f64; 2]>> {
        let place = |name: &str| self.series.columns.iter().position(|column| column == name);
        let (time, value) = (place("time_s")?, place(column)?);
        Some(self.series.rows.iter().map(|row| [row[time], factor * row[value]]).collect())
    }

    /// Volume in m3 at the start.
    pub(super) fn first_volume(&self) -> f64 {
        self.summary.readings.volume / (1.0 + self.summary.volume_error)
    }

    /// Gravity in m/s2 if it points straight down.
    pub(super) fn gravity(&self) -> Option<f64> {
        let gravity = self.case.domain.gravity;
        (gravity.x == 0.0 && gravity.y == 0.0 && gravity.z < 0.0).then_some(-gravity.z)
    }

    /// What a thin sheet of this fluid would be, if it is to spread around an axis.
    pub(super) fn sheet(&self) -> Option<lab::ThinSheet> {
        let material = &self.case.material;
        let yield_stress = material.curve.yield_stress();
        self.case.gauges.spread?;
        let gravity = self.gravity().filter(|_| yield_stress > 0.0)?;
        Some(lab::ThinSheet::new(self.first_volume(), yield_stress, material.density, gravity))
    }
}
