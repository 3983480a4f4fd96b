//! The folder of a test: complete, and its own.
//!
//! | file | holds |
//! | --- | --- |
//! | `beam.toml`, `fibres.csv` | the beam as read, and the fibres of a cast |
//! | `run.json`, `summary.json` | program and machine; the results in SI units |
//! | `beam_1.csv` ... | readings of each beam |
//! | `crack_1.csv` ..., `crack_1.vtp` ... | fibres across its crack; the opening of the crack, at the end |
//! | `fibres_1.vtp` ... | its fibres |
//! | `results.csv`, `sections.csv` | strengths of each beam; fibres through its sections |
//! | `load_opening.png`, `load_deflection.png`, `energy.png`, `crack.png` | pictures |
//! | `report.html` | all of it as a page |
//! | `checkpoint.tremie` | the state to go on from |

use std::io;
use std::path::{Path, PathBuf};

use serde::Serialize;
use tremie_case::NamedFile;
use tremie_output::atomic;
use tremie_simulation::{FolderError, RunRecord};

use crate::failure::WrongInput;

/// The fibres of a cast.
pub(super) const FIBRES: &str = "fibres.csv";
const CASE: &str = "beam.toml";
const RECORD: &str = "run.json";
const FILES: [&str; 13] = [
    CASE,
    FIBRES,
    RECORD,
    "summary.json",
    "results.csv",
    "sections.csv",
    "load_opening.png",
    "load_deflection.png",
    "energy.png",
    "crack.png",
    "pull_out.csv",
    "pull_out.png",
    "report.html",
];
const CHECKPOINT: &str = "checkpoint.tremie";
const NUMBERED: [(&str, &str); 4] =
    [("beam_", ".csv"), ("crack_", ".csv"), ("crack_", ".vtp"), ("fibres_", ".vtp")];

/// A folder that holds, or is to hold, one test.
pub(super) struct Folder {
    path: PathBuf,
}

impl Folder {
    /// Makes the folder for a new test; with `force` the files of an earlier one in it are removed, and only these.
    pub(super) fn create(path: &Path, force: bool) -> Result<Self, FolderError> {
        let refused = |path: &Path| {
            let path = path.to_owned();
            move |source: io::Error| FolderError::Io { path, source }
        };
        std::fs::create_dir_all(path).map_err(refused(path))?;
        for entry in std::fs::read_dir(path).map_err(refused(path))? {
            let entry = entry.map_err(refused(path))?;
            if !force {
                return Err(FolderError::NotEmpty { path: path.to_owned() });
            }
            if entry.file_name().to_str().is_some_and(belongs) {
                std::fs::remove_file(entry.path()).map_err(refused(&entry.path()))?;
            }
        }
        Ok(Self { path: path.to_owned() })
    }

    /// Opens the folder of a test that was interrupted.
    pub(super) fn open(path: &Path) -> Result<Self, FolderError> {
        for missing in [CASE, RECORD] {
            if !path.join(missing).is_file() {
                return Err(FolderError::NoRun { path: path.to_owned(), missing });
            }
        }
        Ok(Self { path: path.to_owned() })
    }

    /// Writes what describes a new test.
    pub(super) fn begin(&self, text: &str, files: &[NamedFile]) -> anyhow::Result<()> {
        if let Some(file) =
            files.iter().find(|file| belongs(file.path.trim_start_matches("./")) && file.path != FIBRES)
        {
            return Err(FolderError::Taken { name: file.path.clone() }.into());
        }
        for file in files {
            let path = self.path.join(&file.path);
            if let Some(folder) = path.parent() {
                std::fs::create_dir_all(folder)
                    .map_err(|source| FolderError::Io { path: folder.to_owned(), source })?;
            }
            atomic::write(&path, &file.bytes)?;
        }
        atomic::write(&self.case(), text.as_bytes())?;
        let program = format!("tremie {}", env!("CARGO_PKG_VERSION"));
        self.json(RECORD, &RunRecord::new(program, "fracture", None, serde_json::json!({})))
    }

    /// Where it is.
    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    /// The file of a name in it.
    pub(super) fn file(&self, name: &str) -> PathBuf {
        self.path.join(name)
    }

    /// The beam as read.
    pub(super) fn case(&self) -> PathBuf {
        self.file(CASE)
    }

    /// The state to go on from.
    pub(super) fn checkpoint(&self) -> PathBuf {
        self.file(CHECKPOINT)
    }

    /// Writes a file of JSON.
    pub(super) fn json(&self, name: &str, value: &impl Serialize) -> anyhow::Result<()> {
        let text = serde_json::to_string_pretty(value)? + "\n";
        Ok(atomic::write(&self.file(name), text.as_bytes())?)
    }

    /// The record of the run.
    pub(super) fn record(&self) -> anyhow::Result<RunRecord> {
        let path = self.file(RECORD);
        let text = std::fs::read_to_string(&path)
            .map_err(|source| FolderError::Io { path: path.clone(), source })?;
        Ok(serde_json::from_str(&text).map_err(|source| FolderError::Json { path, source })?)
    }

    /// Writes the record with what the test has cost, in s and solutions, and how it ended.
    pub(super) fn cost(&self, seconds: f64, solutions: u64, end: &str) -> anyhow::Result<()> {
        let mut record = self.record()?;
        record.wall_s += seconds;
        record.steps = solutions;
        record.end_reason = Some(end.to_owned());
        self.json(RECORD, &record)
    }

    /// What to say where a checkpoint is of no use.
    pub(super) fn start_again(&self, problem: &str) -> WrongInput {
        let (case, path) = (self.case(), self.path());
        WrongInput(format!(
            "{problem}\nStart the test again with\n  tremie fracture {} --out ANOTHER-FOLDER\nand not with {}",
            crate::run::quoted(&case),
            path.display()
        ))
    }
}

/// Whether a test writes files of this name.
fn belongs(name: &str) -> bool {
    let numbered = |(prefix, ending): &(&str, &str)| {
        name.strip_prefix(prefix)
            .and_then(|rest| rest.strip_suffix(ending))
            .is_some_and(|number| !number.is_empty() && number.bytes().all(|b| b.is_ascii_digit()))
    };
    FILES.contains(&name)
        || name == CHECKPOINT
        || NUMBERED.iter().any(numbered)
        || atomic::is_unfinished(name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn force_removes_the_files_of_a_test_and_no_others() {
        let place = tempfile::tempdir().unwrap();
        let own = ["beam.toml", "beam_12.csv", "crack_1.vtp", "checkpoint.tremie", "report.html"];
        let others = ["notes.txt", "beam_.csv", "case.toml"];
        for name in own.iter().chain(&others) {
            std::fs::write(place.path().join(name), "").unwrap();
        }
        assert!(matches!(Folder::create(place.path(), false), Err(FolderError::NotEmpty { .. })));
        Folder::create(place.path(), true).unwrap();
        assert!(own.iter().all(|name| !place.path().join(name).exists()));
        assert!(others.iter().all(|name| place.path().join(name).exists()));
    }
}
