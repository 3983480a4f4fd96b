//! Time series as CSV: a header whose names carry the units (`time_s,spread_m`), then a row a moment.
//!
//! The first column is the time in seconds. A value that does not exist is NaN, written as an empty cell. Numbers are
//! written such that reading gives back the same bits.

use std::fmt::Write as _;
use std::fs::{File, OpenOptions};
use std::io::Write as _;
use std::path::{Path, PathBuf};

use crate::{Error, atomic};

/// A series that is being written.
#[derive(Debug)]
pub struct Series {
    path: PathBuf,
    file: File,
    columns: usize,
}

/// A series as read from a file.
#[derive(Debug, Clone, PartialEq)]
pub struct Table {
    /// Names of the columns, with units.
    pub columns: Vec<String>,
    /// One value a column each; the first is the time in seconds.
    pub rows: Vec<Vec<f64>>,
}

impl Series {
    /// Begins a series with the given columns, of which the first is the time; replaces an existing file.
    ///
    /// # Errors
    /// If a name cannot stand in a header, or the file system refuses.
    pub fn create(path: &Path, columns: &[&str]) -> Result<Self, Error> {
        let unfit = |name: &&&str| name.is_empty() || name.contains(['"', ',', '\n', '\r']);
        if let Some(name) = columns.iter().find(unfit) {
            return Err(Error::Column { name: (*name).to_owned() });
        }
        let table = Table { columns: columns.iter().map(|&c| c.to_owned()).collect(), rows: Vec::new() };
        Self::open(path, &table)
    }

    /// Goes on with an existing series after `time` seconds: later rows are dropped.
    ///
    /// # Errors
    /// If the file is missing, does not have these columns, or the file system refuses.
    pub fn resume(path: &Path, columns: &[&str], time: f64) -> Result<Self, Error> {
        let mut table = read(path)?;
        if table.columns != columns {
            return Err(Error::malformed(path, format!("the columns are not {}", columns.join(","))));
        }
        table.rows.retain(|row| row.first().is_none_or(|&t| t <= time));
        Self::open(path, &table)
    }

    fn open(path: &Path, table: &Table) -> Result<Self, Error> {
        let mut text = table.columns.join(",");
        text.push('\n');
        for row in &table.rows {
            text.push_str(&line(row));
        }
        atomic::write(path, text.as_bytes())?;
        let file = OpenOptions::new().append(true).open(path).map_err(Error::io(path))?;
        Ok(Self { path: path.to_owned(), file, columns: table.columns.len() })
    }

    /// Adds a row, which is in the file when this returns.
    ///
    /// # Errors
    /// If there is not one value for each column, or the file system refuses.
    pub fn append(&mut self, row: &[f64]) -> Result<(), Error> {
        if row.len() != self.columns {
            return Err(Error::Length { what: "row".into(), expected: self.columns, found: row.len() });
        }
        self.file.write_all(line(row).as_bytes()).map_err(Error::io(&self.path))
    }
}

/// Reads a series. A last line that was not written to its end is left out.
///
/// # Errors
/// If the file is missing, or holds anything but a header and rows of numbers.
pub fn read(path: &Path) -> Result<Table, Error> {
    let text = std::fs::read_to_string(path).map_err(Error::io(path))?;
    let complete = &text[..text.rfind('\n').map_or(0, |end| end + 1)];
    let mut lines = complete.lines();
    let header = lines.next().ok_or_else(|| Error::malformed(path, "no header"))?;
    let columns: Vec<String> = header.split(',').map(str::to_owned).collect();
    let mut rows = Vec::new();
    for (n, line) in lines.enumerate() {
        let row: Option<Vec<f64>> = line
            .split(',')
            .map(|cell| if cell.is_empty() { Some(f64::NAN) } else { cell.parse().ok() })
            .collect();
        match row {
            Some(row) if row.len() == columns.len() => rows.push(row),
            _ => {
                return Err(Error::malformed(
                    path,
                    format!("line {} is no row of {} numbers", n + 2, columns.len()),
                ));
            }
        }
    }
    Ok(Table { columns, rows })
}

fn line(row: &[f64]) -> String {
    let mut line = String::new();
    for (n, value) in row.iter().enumerate() {
        line.push_str(if n > 0 { "," } else { "" });
        if !value.is_nan() {
            // Writing to a string cannot fail.
            let _ = write!(line, "{value:?}");
        }
    }
    line.push('\n');
    line
}

#[cfg(test)]
mod tests {
    use super::*;

    const COLUMNS: [&str; 3] = ["time_s", "spread_m", "slump_m"];

    #[test]
    fn rows_come_back_bit_by_bit_and_are_there_at_once() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("series.csv");
        let mut series = Series::create(&path, &COLUMNS).unwrap();
        let rows = [[0.0, 0.2, -0.0], [0.1 + 0.2, 1e-300, f64::MAX], [1.0 / 3.0, f64::INFINITY, 12345678.9]];
        for (n, row) in rows.iter().enumerate() {
            series.append(row).unwrap();
            let table = read(&path).unwrap();
            assert_eq!(table.columns, COLUMNS);
            assert_eq!(table.rows, rows[..=n]);
        }
        series.append(&[1.0, f64::NAN, 2.0]).unwrap();
        assert!(std::fs::read_to_string(&path).unwrap().ends_with("\n1.0,,2.0\n"));
        assert!(read(&path).unwrap().rows[3][1].is_nan());
        assert!(matches!(series.append(&[1.0]), Err(Error::Length { expected: 3, found: 1, .. })));
    }

    #[test]
    fn a_resumed_series_goes_on_from_the_given_time() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("series.csv");
        let mut series = Series::create(&path, &COLUMNS).unwrap();
        for n in 0..10 {
            series.append(&[f64::from(n), 0.5, 0.25]).unwrap();
        }
        // Killed in the middle of a row.
        series.file.write_all(b"10.0,0.").unwrap();
        let mut resumed = Series::resume(&path, &COLUMNS, 6.5).unwrap();
        resumed.append(&[6.75, 0.5, f64::NAN]).unwrap();
        let times: Vec<f64> = read(&path).unwrap().rows.iter().map(|row| row[0]).collect();
        assert_eq!(times, [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 6.75]);
        assert!(matches!(Series::resume(&path, &COLUMNS[..2], 1.0), Err(Error::Malformed { .. })));
    }

    #[test]
    fn what_is_no_series_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("series.csv");
        for name in ["", "a,b", "a\nb", "\"a\""] {
            assert!(matches!(Series::create(&path, &["time_s", name]), Err(Error::Column { .. })));
        }
        for text in ["", "time_s", "time_s,a\n1\n", "time_s,a\n1,b\n", "time_s,a\n1,2,3\n"] {
            std::fs::write(&path, text).unwrap();
            assert!(matches!(read(&path), Err(Error::Malformed { .. })), "{text}");
        }
    }
}
