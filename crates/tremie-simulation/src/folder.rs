//! The folder of a run: complete and self-describing.
//!
//! | file | holds |
//! | --- | --- |
//! | `case.toml` | the case as read, byte for byte |
//! | `form.stl` ... | the files that it names, byte for byte |
//! | `run.json` | program, method, machine, scaling, cost so far |
//! | `summary.json` | the results in SI units |
//! | `series.csv` | the readings of the gauges over time |
//! | `fluid.pvd`, `fluid_000000.vti` ... | the fields |
//! | `surface.pvd`, `surface_000000.vtp` ... | the free surface |
//! | `bodies.pvd`, `bodies_000000.vtp` ..., `bodies.csv` | aggregates and fibres, if there are any; the table as of the end |
//! | `segregation.csv` | share of the volume that bodies take by height, if there are any |
//! | `orientation.csv`, `orientation.pvd`, `orientation_000000.vtp` ... | how fibres lie, region by region |
//! | `sections.csv` | fibres through the sections of the case over time |
//! | `filling.vti`, `filling_time_cut.png`, `filling_time_level.png` ... | how the form filled, if the case asks for it |
//! | `above_000000.png`, `cut_000000.png`, `pressure_000000.png`, `shear_rate_000000.png`, `batches_000000.png`, `orientation_lower_000000.png`, `orientation_upper_000000.png`, `viscosity_000000.png` ... | pictures |
//! | `report.html` | all of it as a page, if one was asked for |
//! | `fibres/` | beams and planes that were cut out of it, if they were asked for; a run leaves it alone |
//! | `checkpoint.tremie` | the state to go on from |

use std::io;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use serde::{Deserialize, Serialize};
use tremie_case::{Case, NamedFile};
use tremie_output::atomic;

use crate::gauges::Gauges;
use crate::pictures::FILLING_PICTURES;
use crate::summary::Summary;

/// A folder that holds, or is to hold, one run.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RunFolder {
    path: PathBuf,
}

/// Why a folder cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum FolderError {
    /// It holds something already.
    #[error("{} is not empty: resume the run in it, give --force to replace it, or choose another folder", path.display())]
    NotEmpty {
        /// The folder.
        path: PathBuf,
    },
    /// There is no run in it.
    #[error("{} holds no run: it has no {missing}", path.display())]
    NoRun {
        /// The folder.
        path: PathBuf,
        /// The file that is missing.
        missing: &'static str,
    },
    /// The case names a file as the run names one of its own.
    #[error("the case names {name}, which the run writes itself: give the file another name")]
    Taken {
        /// The name.
        name: String,
    },
    /// The file system refuses.
    #[error("cannot read or write {}", path.display())]
    Io {
        /// The file or folder.
        path: PathBuf,
        /// Its reason.
        source: io::Error,
    },
    /// `run.json` was not written by a run.
    #[error("{} is damaged", path.display())]
    Json {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        source: serde_json::Error,
    },
    /// The run in it has not come to results.
    #[error("{} holds no results yet: it has no {SUMMARY}; `tremie resume` goes on with its run", path.display())]
    NoResults {
        /// The folder.
        path: PathBuf,
    },
    /// A file lacks something that a run writes into it.
    #[error("{} is damaged: something is missing in it", path.display())]
    Incomplete {
        /// The file.
        path: PathBuf,
    },
    /// A file could not be written.
    #[error(transparent)]
    Output(#[from] tremie_output::Error),
}

const CASE: &str = "case.toml";
const RECORD: &str = "run.json";
const SUMMARY: &str = "summary.json";
const SERIES: &str = "series.csv";
const REPORT: &str = "report.html";
const CHECKPOINT: &str = "checkpoint.tremie";
const FLUID: &str = "fluid.pvd";
const SURFACE: &str = "surface.pvd";
const BODIES: &str = "bodies.pvd";
const BODY_TABLE: &str = "bodies.csv";
const SEGREGATION: &str = "segregation.csv";
const ORIENTATION: &str = "orientation.csv";
const ORIENTATIONS: &str = "orientation.pvd";
const SECTIONS: &str = "sections.csv";
const FILLING: &str = "filling.vti";
/// The files that are not numbered, but for the pictures of how the form filled.
const FILES: [&str; 15] = [
    CASE,
    RECORD,
    SUMMARY,
    SERIES,
    FLUID,
    SURFACE,
    BODIES,
    BODY_TABLE,
    SEGREGATION,
    ORIENTATION,
    ORIENTATIONS,
    SECTIONS,
    FILLING,
    REPORT,
    CHECKPOINT,
];
/// Prefixes and endings of the files that are numbered.
const NUMBERED: [(&str, &str); 12] = [
    ("fluid_", ".vti"),
    ("surface_", ".vtp"),
    ("bodies_", ".vtp"),
    ("orientation_", ".vtp"),
    ("orientation_lower_", ".png"),
    ("orientation_upper_", ".png"),
    ("above_", ".png"),
    ("cut_", ".png"),
    ("pressure_", ".png"),
    ("shear_rate_", ".png"),
    ("viscosity_", ".png"),
    ("batches_", ".png"),
];

impl RunFolder {
    /// Makes the folder for a new run.
    ///
    /// An existing folder must be empty, unless `force` is given: then the files of the run in it are removed, and
    /// only these.
    ///
    /// # Errors
    /// [`FolderError::NotEmpty`] if something is in the way, [`FolderError::Io`] if the file system refuses.
    pub fn create(path: &Path, force: bool) -> Result<Self, FolderError> {
        std::fs::create_dir_all(path).map_err(io_error(path))?;
        for entry in std::fs::read_dir(path).map_err(io_error(path))? {
            let entry = entry.map_err(io_error(path))?;
            if !force {
                return Err(FolderError::NotEmpty { path: path.to_owned() });
            }
            if entry.file_name().to_str().is_some_and(belongs_to_run) {
                std::fs::remove_file(entry.path()).map_err(io_error(&entry.path()))?;
            }
        }
        Ok(Self { path: path.to_owned() })
    }

    /// Opens the folder of an earlier run, to resume it.
    ///
    /// # Errors
    /// [`FolderError::NoRun`] if there is none in it.
    pub fn open(path: &Path) -> Result<Self, FolderError> {
        for missing in [CASE, RECORD] {
            if !path.join(missing).is_file() {
                return Err(FolderError::NoRun { path: path.to_owned(), missing });
            }
        }
        Ok(Self { path: path.to_owned() })
    }

    /// Removes what a process that was killed left half-written.
    ///
    /// # Errors
    /// If the file system refuses.
    pub(crate) fn sweep(&self) -> Result<(), FolderError> {
        for entry in std::fs::read_dir(&self.path).map_err(io_error(&self.path))? {
            let entry = entry.map_err(io_error(&self.path))?;
            if entry.file_name().to_str().is_some_and(atomic::is_unfinished) {
                std::fs::remove_file(entry.path()).map_err(io_error(&entry.path()))?;
            }
        }
        Ok(())
    }

    /// Writes what describes a new run: the case as read, the files that it names, and the record.
    ///
    /// # Errors
    /// If a file has the name of one that the run writes, or the file system refuses.
    pub fn begin(&self, case: &str, files: &[NamedFile], record: &RunRecord) -> Result<(), FolderError> {
        if let Some(file) = files.iter().find(|file| belongs_to_run(file.path.trim_start_matches("./"))) {
            return Err(FolderError::Taken { name: file.path.clone() });
        }
        for file in files {
            let path = self.path.join(&file.path);
            let folder = path.parent().unwrap_or(&self.path);
            std::fs::create_dir_all(folder).map_err(io_error(folder))?;
            atomic::write(&path, &file.bytes)?;
        }
        atomic::write(&self.case(), case.as_bytes())?;
        self.write_record(record)
    }

    /// Where it is.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The case as read.
    pub fn case(&self) -> PathBuf {
        self.path.join(CASE)
    }

    /// The readings over time.
    pub fn series(&self) -> PathBuf {
        self.path.join(SERIES)
    }

    /// The results.
    pub fn summary(&self) -> PathBuf {
        self.path.join(SUMMARY)
    }

    /// The report.
    pub fn report(&self) -> PathBuf {
        self.path.join(REPORT)
    }

    /// The pictures of the surface from above and of the cut, each in the order of time.
    ///
    /// # Errors
    /// If the file system refuses.
    pub fn pictures(&self) -> Result<[Vec<PathBuf>; 2], FolderError> {
        let mut found = [Vec::new(), Vec::new()];
        for entry in std::fs::read_dir(&self.path).map_err(io_error(&self.path))? {
            let entry = entry.map_err(io_error(&self.path))?;
            let name = entry.file_name();
            let Some(name) = name.to_str().filter(|name| name.ends_with(".png") && belongs_to_run(name))
            else {
                continue;
            };
            if let Some(kind) = ["above_", "cut_"].iter().position(|kind| name.starts_with(kind)) {
                found[kind].push(entry.path());
            }
        }
        found.iter_mut().for_each(|paths| paths.sort());
        Ok(found)
    }

    /// The results of the run of a case, as the run loop left them.
    ///
    /// # Errors
    /// If there are none yet, or they are damaged.
    pub fn read_summary(&self, case: &Case) -> Result<Summary, FolderError> {
        let path = self.summary();
        if !path.is_file() {
            return Err(FolderError::NoResults { path: self.path.clone() });
        }
        let text = std::fs::read_to_string(&path).map_err(io_error(&path))?;
        let json: serde_json::Value =
            serde_json::from_str(&text).map_err(|source| FolderError::Json { path: path.clone(), source })?;
        Summary::from_json(&json, &Gauges::new(case)).ok_or(FolderError::Incomplete { path })
    }

    /// How the form filled, as fields.
    pub(crate) fn filling(&self) -> PathBuf {
        self.path.join(FILLING)
    }

    /// The pictures of how the form filled that there are.
    pub fn filling_pictures(&self) -> Vec<PathBuf> {
        let paths = FILLING_PICTURES.iter().map(|name| self.path.join(name));
        paths.filter(|path| path.is_file()).collect()
    }

    /// The collection of the fields.
    pub fn fluid(&self) -> PathBuf {
        self.path.join(FLUID)
    }

    /// The collection of the surfaces.
    pub fn surface(&self) -> PathBuf {
        self.path.join(SURFACE)
    }

    /// The collection of the bodies in the fluid.
    pub fn bodies(&self) -> PathBuf {
        self.path.join(BODIES)
    }

    /// The table of the bodies in the fluid.
    pub fn body_table(&self) -> PathBuf {
        self.path.join(BODY_TABLE)
    }

    /// The share of the volume that bodies take, by height.
    pub(crate) fn segregation(&self) -> PathBuf {
        self.path.join(SEGREGATION)
    }

    /// How fibres lie, region by region: as a table, and the collection for ParaView.
    pub(crate) fn orientation(&self) -> [PathBuf; 2] {
        [ORIENTATION, ORIENTATIONS].map(|name| self.path.join(name))
    }

    /// Fibres through sections over time.
    pub(crate) fn sections(&self) -> PathBuf {
        self.path.join(SECTIONS)
    }

    /// The state to go on from.
    pub fn checkpoint(&self) -> PathBuf {
        self.path.join(CHECKPOINT)
    }

    /// The record of the run.
    ///
    /// # Errors
    /// If it is missing or damaged.
    pub fn record(&self) -> Result<RunRecord, FolderError> {
        let path = self.path.join(RECORD);
        let text = std::fs::read_to_string(&path).map_err(io_error(&path))?;
        serde_json::from_str(&text).map_err(|source| FolderError::Json { path, source })
    }

    /// Writes the results, as the run loop does; for those who have more to say about them.
    ///
    /// # Errors
    /// If the file system refuses.
    pub fn write_summary(&self, summary: &serde_json::Value) -> Result<(), FolderError> {
        self.write_json(&self.summary(), summary)
    }

    pub(crate) fn write_record(&self, record: &RunRecord) -> Result<(), FolderError> {
        self.write_json(&self.path.join(RECORD), record)
    }

    fn write_json(&self, path: &Path, value: &impl Serialize) -> Result<(), FolderError> {
        let mut text = serde_json::to_string_pretty(value)
            .map_err(|source| FolderError::Json { path: path.to_owned(), source })?;
        text.push('\n');
        Ok(atomic::write(path, text.as_bytes())?)
    }
}

/// Whether a run writes files of this name.
fn belongs_to_run(name: &str) -> bool {
    let numbered = |(prefix, ending): &(&str, &str)| {
        name.strip_prefix(prefix)
            .and_then(|rest| rest.strip_suffix(ending))
            .is_some_and(|number| !number.is_empty() && number.bytes().all(|b| b.is_ascii_digit()))
    };
    FILES.contains(&name)
        || FILLING_PICTURES.contains(&name)
        || NUMBERED.iter().any(numbered)
        || atomic::is_unfinished(name)
}

fn io_error(path: &Path) -> impl FnOnce(io::Error) -> FolderError {
    move |source| FolderError::Io { path: path.to_owned(), source }
}

/// `run.json`: what ran where, and what it has cost so far.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RunRecord {
    /// Name and version of the program.
    pub program: String,
    /// Numerical method.
    pub method: String,
    /// Name of the standard experiment that the case stands for, if it does; its figures join the results.
    #[serde(default)]
    pub experiment: Option<String>,
    /// Seed of the random streams, if the case uses any.
    pub seed: Option<u64>,
    /// Time step, lattice units and the like, as the method describes them.
    pub scaling: serde_json::Value,
    /// Where it ran.
    pub machine: Machine,
    /// When the run began, in UTC.
    pub started: String,
    /// Wall-clock time in s, without the time between interruption and resumption.
    pub wall_s: f64,
    /// Time steps.
    pub steps: u64,
    /// Updates of wet cells or nodes.
    pub updates: u64,
    /// Updates of wet cells or nodes per second of wall-clock time.
    pub updates_per_second: f64,
    /// Why the run ended: `rest`, `time`, `interrupted` or `breakdown`; null while it goes on.
    pub end_reason: Option<String>,
}

impl RunRecord {
    /// The record of a run that begins now on this machine.
    pub fn new(
        program: impl Into<String>,
        method: impl Into<String>,
        seed: Option<u64>,
        scaling: serde_json::Value,
    ) -> Self {
        Self {
            program: program.into(),
            method: method.into(),
            experiment: None,
            seed,
            scaling,
            machine: Machine::this(),
            started: humantime::format_rfc3339_seconds(SystemTime::now()).to_string(),
            wall_s: 0.0,
            steps: 0,
            updates: 0,
            updates_per_second: 0.0,
            end_reason: None,
        }
    }
}

/// The machine of a run.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Machine {
    /// Operating system and architecture.
    pub system: String,
    /// Name of the processor, if known.
    pub processor: Option<String>,
    /// Cores that this process may use.
    pub cores: usize,
    /// Threads that compute.
    pub threads: usize,
}

impl Machine {
    /// The machine that this runs on.
    pub fn this() -> Self {
        // Linux only; elsewhere the processor stays unknown.
        let processor = std::fs::read_to_string("/proc/cpuinfo").ok().and_then(|text| {
            let line = text.lines().find(|line| line.starts_with("model name"))?;
            Some(line.split_once(':')?.1.trim().to_owned())
        });
        Self {
            system: format!("{} {}", std::env::consts::OS, std::env::consts::ARCH),
            processor,
            cores: std::thread::available_parallelism().map_or(1, usize::from),
            threads: rayon::current_num_threads(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn record() -> RunRecord {
        RunRecord::new("tremie 0.1.0", "lbm", None, serde_json::json!({ "time_step_s": 1e-4 }))
    }

    #[test]
    fn results_are_not_overwritten_without_force() {
        let place = tempfile::tempdir().unwrap();
        let path = place.path().join("deep/run");
        let folder = RunFolder::create(&path, false).unwrap();
        // Still empty.
        RunFolder::create(&path, false).unwrap();
        folder.begin("title = \"x\"\r\n", &[], &record()).unwrap();
        let error = RunFolder::create(&path, false).unwrap_err();
        assert!(matches!(error, FolderError::NotEmpty { .. }));
        assert!(error.to_string().contains("--force") && error.to_string().contains("resume"));
        assert_eq!(std::fs::read(folder.case()).unwrap(), b"title = \"x\"\r\n");
    }

    #[test]
    fn force_removes_the_files_of_a_run_and_no_others() {
        let place = tempfile::tempdir().unwrap();
        let run = [
            CASE,
            RECORD,
            SUMMARY,
            SERIES,
            CHECKPOINT,
            "fluid.pvd",
            "fluid_000012.vti",
            "cut_000000.png",
            "shear_rate_000000.png",
            "filling.vti",
            "filling_time_cut.png",
            "orientation.csv",
            "orientation_000003.vtp",
            "orientation_upper_000003.png",
            "segregation.csv",
            "sections.csv",
            ".a1b2c3.part",
        ];
        let others = ["notes.txt", "fluid_.vti", "fluid_mine.vti", "above.png"];
        for name in run.iter().chain(&others) {
            std::fs::write(place.path().join(name), "").unwrap();
        }
        RunFolder::create(place.path(), true).unwrap();
        assert!(run.iter().all(|name| !place.path().join(name).exists()));
        assert!(others.iter().all(|name| place.path().join(name).exists()));
    }

    #[test]
    fn a_folder_without_a_run_is_not_opened() {
        let place = tempfile::tempdir().unwrap();
        assert!(matches!(RunFolder::open(place.path()), Err(FolderError::NoRun { missing: CASE, .. })));
        assert!(matches!(RunFolder::open(&place.path().join("no")), Err(FolderError::NoRun { .. })));
        let folder = RunFolder::create(place.path(), false).unwrap();
        folder.begin("", &[], &record()).unwrap();
        assert_eq!(RunFolder::open(place.path()).unwrap().record().unwrap(), record_of(&folder));
    }

    fn record_of(folder: &RunFolder) -> RunRecord {
        folder.record().unwrap()
    }

    #[test]
    fn a_file_in_the_way_is_named() {
        let place = tempfile::tempdir().unwrap();
        let path = place.path().join("file");
        std::fs::write(&path, "").unwrap();
        let error = RunFolder::create(&path, true).unwrap_err();
        assert!(error.to_string().contains(&path.display().to_string()), "{error}");
    }
}
