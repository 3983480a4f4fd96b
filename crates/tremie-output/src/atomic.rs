//! Whole files, written aside and then renamed: at every moment a reader finds the old file or the new one.

use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::Path;

use crate::Error;

/// Around the random part of the name of a file that is not whole yet.
const UNFINISHED: [&str; 2] = [".", ".part"];

/// Whether a file of this name was being written here, and is left over if nobody does so any more.
pub fn is_unfinished(name: &str) -> bool {
    let [prefix, suffix] = UNFINISHED;
    name.strip_prefix(prefix).is_some_and(|rest| rest.ends_with(suffix))
}

/// Replaces the file at `path` by `content`.
///
/// # Errors
/// If the file system refuses; the previous file is then untouched.
pub fn write(path: &Path, content: &[u8]) -> Result<(), Error> {
    write_with(path, |file| file.write_all(content))
}

/// Replaces the file at `path` by what `write` writes.
///
/// # Errors
/// If the file system or `write` refuses; the previous file is then untouched.
pub fn write_with(path: &Path, write: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> Result<(), Error> {
    replace(path, write).map_err(Error::io(path))
}

fn replace(path: &Path, write: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> io::Result<()> {
    let folder = match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    };
    let mut builder = tempfile::Builder::new();
    builder.prefix(UNFINISHED[0]).suffix(UNFINISHED[1]);
    // Temporary files are private by default, results are not; the umask still applies.
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    let mut buffer = BufWriter::new(builder.tempfile_in(folder)?);
    write(&mut buffer)?;
    let file = buffer.into_inner().map_err(io::IntoInnerError::into_error)?;
    // Without this the name could reach the disk before the content does.
    file.as_file().sync_all()?;
    file.persist(path).map_err(|error| error.error)?;
    if cfg!(unix) {
        File::open(folder)?.sync_all()?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_failed_write_leaves_the_previous_file_and_nothing_else() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("file");
        write(&path, b"first").unwrap();
        let failed = write_with(&path, |file| {
            file.write_all(b"half of the sec")?;
            Err(io::Error::other("disk full"))
        });
        assert!(matches!(failed, Err(Error::Io { .. })));
        assert!(is_unfinished(".a1b2c3.part") && !is_unfinished("a.part") && !is_unfinished(".part.toml"));
        assert_eq!(std::fs::read(&path).unwrap(), b"first");
        write(&path, b"second").unwrap();
        assert_eq!(std::fs::read(&path).unwrap(), b"second");
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[test]
    fn a_missing_folder_is_an_error() {
        let folder = tempfile::tempdir().unwrap();
        assert!(matches!(write(&folder.path().join("no/file"), b""), Err(Error::Io { .. })));
    }
}
