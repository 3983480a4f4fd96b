//! Collections of VTK files over time (`.pvd`): what ParaView opens to play a run.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use crate::vtk::escape;
use crate::{Error, atomic};

/// A `.pvd` file, rewritten whole at each added entry.
#[derive(Debug)]
pub struct Collection {
    path: PathBuf,
    entries: Vec<Entry>,
}

/// One file of a collection.
#[derive(Debug, Clone, PartialEq)]
pub struct Entry {
    /// Time in seconds.
    pub time: f64,
    /// The file, relative to the folder of the collection.
    pub file: String,
}

impl Collection {
    /// Begins an empty collection; the file appears at once and replaces an existing one.
    ///
    /// # Errors
    /// If the file system refuses.
    pub fn create(path: &Path) -> Result<Self, Error> {
        let collection = Self { path: path.to_owned(), entries: Vec::new() };
        collection.write()?;
        Ok(collection)
    }

    /// Goes on with an existing collection after `time` seconds: later entries are dropped.
    ///
    /// # Errors
    /// If the file is missing, is no collection, or the file system refuses.
    pub fn resume(path: &Path, time: f64) -> Result<Self, Error> {
        let text = std::fs::read_to_string(path).map_err(Error::io(path))?;
        let mut entries = parse(&text).map_err(|reason| Error::malformed(path, reason))?;
        entries.retain(|entry| entry.time <= time);
        let collection = Self { path: path.to_owned(), entries };
        collection.write()?;
        Ok(collection)
    }

    /// Adds a file at `time` seconds.
    ///
    /// # Errors
    /// If the file system refuses.
    pub fn push(&mut self, time: f64, file: &str) -> Result<(), Error> {
        self.entries.push(Entry { time, file: file.to_owned() });
        self.write()
    }

    /// The files so far.
    pub fn entries(&self) -> &[Entry] {
        &self.entries
    }

    fn write(&self) -> Result<(), Error> {
        let mut xml =
            String::from("<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"1.0\">\n");
        xml.push_str("<Collection>\n");
        for Entry { time, file } in &self.entries {
            // Writing to a string cannot fail.
            let _ = writeln!(xml, "<DataSet timestep=\"{time:?}\" part=\"0\" file=\"{}\"/>", escape(file));
        }
        xml.push_str("</Collection>\n</VTKFile>\n");
        atomic::write(&self.path, xml.as_bytes())
    }
}

fn parse(text: &str) -> Result<Vec<Entry>, String> {
    let document = roxmltree::Document::parse(text).map_err(|error| error.to_string())?;
    if document.root_element().attribute("type") != Some("Collection") {
        return Err("not a collection of VTK files".into());
    }
    document
        .descendants()
        .filter(|node| node.has_tag_name("DataSet"))
        .map(|node| {
            let time = node.attribute("timestep").and_then(|t| t.parse().ok());
            let file = node.attribute("file").map(str::to_owned);
            time.zip(file)
                .map(|(time, file)| Entry { time, file })
                .ok_or_else(|| "entry without time or file".into())
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_resumed_collection_goes_on_from_the_given_time() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("fields.pvd");
        let mut collection = Collection::create(&path).unwrap();
        let times = [0.0, 0.1 + 0.2, 0.5, 1e-7 + 0.5];
        for (n, time) in times.into_iter().enumerate() {
            collection.push(time, &format!("a & b/{n}.vti")).unwrap();
        }
        let mut resumed = Collection::resume(&path, 0.5).unwrap();
        assert_eq!(resumed.entries(), &collection.entries()[..3]);
        resumed.push(0.6, "next.vti").unwrap();
        let again = Collection::resume(&path, f64::INFINITY).unwrap();
        assert_eq!(again.entries(), resumed.entries());
        assert_eq!(again.entries()[1], Entry { time: 0.1 + 0.2, file: "a & b/1.vti".into() });
    }

    #[test]
    fn other_files_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("fields.pvd");
        assert!(matches!(Collection::resume(&path, 0.0), Err(Error::Io { .. })));
        for text in [
            "",
            "time_s,spread_m\n",
            "<VTKFile type=\"ImageData\"/>",
            "<VTKFile type=\"Collection\"><DataSet/></VTKFile>",
        ] {
            std::fs::write(&path, text).unwrap();
            assert!(matches!(Collection::resume(&path, 0.0), Err(Error::Malformed { .. })), "{text}");
        }
    }
}
