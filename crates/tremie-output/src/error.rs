//! What can go wrong with a file.

use std::io;
use std::path::{Path, PathBuf};

/// Why a file could not be written or read.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The file system refused.
    #[error("cannot read or write {}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// Its reason.
        source: io::Error,
    },
    /// An array does not fit the grid, the points or the columns that it belongs to.
    #[error("{what}: {expected} values are needed, there are {found}")]
    Length {
        /// What the array holds.
        what: String,
        /// Number of values that would fit.
        expected: usize,
        /// Number of values given.
        found: usize,
    },
    /// A triangle refers to a vertex that does not exist.
    #[error("a triangle refers to vertex {index}, but there are {count}")]
    Vertex {
        /// Index that the triangle holds.
        index: u32,
        /// Number of vertices.
        count: usize,
    },
    /// The name of a column holds a comma, a quote or a line break, or is empty.
    #[error("{name:?} cannot be the name of a column")]
    Column {
        /// The name.
        name: String,
    },
    /// A grid for a picture has no cells, or no finite extent.
    #[error("a picture needs a grid of finite extent")]
    EmptyGrid,
    /// The file holds something else than expected.
    #[error("{}: {reason}", path.display())]
    Malformed {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        reason: String,
    },
    /// The file is no usable checkpoint.
    #[error("{}: {fault}", path.display())]
    State {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        fault: StateFault,
    },
}

/// What makes a checkpoint unusable.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum StateFault {
    /// It does not begin like one.
    #[error("not a checkpoint")]
    NotACheckpoint,
    /// It was written in a format that this version does not know.
    #[error("checkpoint format {found} is not supported, only {supported} is")]
    Version {
        /// Format of the file.
        found: u32,
        /// Format that this version reads and writes.
        supported: u32,
    },
    /// It ends too early.
    #[error("the checkpoint is truncated")]
    Truncated,
    /// Its bytes are not those that were written.
    #[error("the checkpoint is damaged: a checksum does not agree")]
    Checksum,
    /// It contradicts itself.
    #[error("the checkpoint is damaged: {0}")]
    Inconsistent(String),
}

impl Error {
    /// For `map_err`: a failure of the file system at `path`.
    pub(crate) fn io(path: &Path) -> impl FnOnce(io::Error) -> Self {
        move |source| Self::Io { path: path.to_owned(), source }
    }

    pub(crate) fn malformed(path: &Path, reason: impl Into<String>) -> Self {
        Self::Malformed { path: path.to_owned(), reason: reason.into() }
    }
}
