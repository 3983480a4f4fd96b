//! The files that a case names: where they lie, and what has been read from them.

use std::cell::RefCell;
use std::path::{Component, Path, PathBuf};
use std::sync::Arc;

use crate::case::{MeshFile, NamedFile};
use crate::document::Value;
use crate::fault::Fault;

/// The folder of the case file, and what has been read from it.
pub(crate) struct Files {
    folder: PathBuf,
    files: RefCell<Vec<NamedFile>>,
    meshes: RefCell<Vec<MeshFile>>,
}

impl Files {
    pub(crate) fn new(folder: &Path) -> Self {
        Self { folder: folder.to_owned(), files: RefCell::default(), meshes: RefCell::default() }
    }

    /// All files that have been read, in this order.
    pub(crate) fn all(&self) -> Vec<NamedFile> {
        self.files.borrow().clone()
    }

    /// All meshes among them.
    pub(crate) fn meshes(&self) -> Vec<MeshFile> {
        self.meshes.borrow().clone()
    }

    /// Remembers a mesh.
    pub(crate) fn keep(&self, mesh: MeshFile) {
        self.meshes.borrow_mut().push(mesh);
    }

    /// Reads the file at `path`, whose name ends in `ending` as that of `what` does; `value` is where the case names it.
    pub(crate) fn read(
        &self,
        value: &Value<'_>,
        path: &str,
        ending: &str,
        what: &str,
    ) -> Result<Arc<[u8]>, Fault> {
        let inside = |part| matches!(part, Component::Normal(_) | Component::CurDir);
        if !Path::new(path).components().all(inside) {
            return Err(value.fault(
                "leads out of the case's folder",
                "put the file beside the case file, or in a folder below, and write its path from there",
            ));
        }
        if !path.to_lowercase().ends_with(ending) {
            return Err(value.fault(
                format!("is not the name of {what}"),
                format!("write a name that ends in \"{ending}\""),
            ));
        }
        let bytes: Arc<[u8]> = match std::fs::read(self.folder.join(path)) {
            Ok(bytes) => bytes.into(),
            Err(error) => {
                let advice = "write the path of the file from the folder of the case file";
                return Err(value.fault(format!("cannot be read: {error}"), advice));
            }
        };
        self.files.borrow_mut().push(NamedFile { path: path.to_owned(), bytes: bytes.clone() });
        Ok(bytes)
    }
}
