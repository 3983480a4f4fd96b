//! Tables of names and numbers as CSV, for what is no series over time.
//!
//! Numbers are written such that reading gives back the same bits; a cell is empty where there is no number.

use std::fmt::Write as _;
use std::path::Path;

use crate::{Error, atomic};

/// What stands in a cell.
#[derive(Debug, Clone, PartialEq)]
pub enum Cell {
    /// A name; no comma, quote or line break in it.
    Name(String),
    /// A number; not a number where there is none.
    Number(f64),
    /// A number of things.
    Count(usize),
    /// Nothing.
    Empty,
}

/// A table as CSV.
///
/// # Errors
/// If a row has not one cell for each column.
pub fn csv(columns: &[&str], rows: &[Vec<Cell>]) -> Result<String, Error> {
    let mut text = columns.join(",");
    text.push('\n');
    for row in rows {
        if row.len() != columns.len() {
            let (expected, found) = (columns.len(), row.len());
            return Err(Error::Length { what: "a row of a table".to_owned(), expected, found });
        }
        for (n, cell) in row.iter().enumerate() {
            text.push_str(if n > 0 { "," } else { "" });
            // Writing to a string cannot fail.
            let _ = match cell {
                Cell::Name(name) => write!(text, "{name}"),
                Cell::Number(number) if number.is_nan() => Ok(()),
                Cell::Number(number) => write!(text, "{number:?}"),
                Cell::Count(count) => write!(text, "{count}"),
                Cell::Empty => Ok(()),
            };
        }
        text.push('\n');
    }
    Ok(text)
}

/// Writes a table as CSV.
///
/// # Errors
/// If a row has not one cell for each column, or the file system refuses.
pub fn write(path: &Path, columns: &[&str], rows: &[Vec<Cell>]) -> Result<(), Error> {
    atomic::write(path, csv(columns, rows)?.as_bytes())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_stand_under_their_columns() {
        let row = |x: f64| vec![Cell::Name("B1".into()), Cell::Count(3), Cell::Number(x), Cell::Empty];
        let text = csv(&["beam", "fibres", "alpha", "more"], &[row(0.1 + 0.2), row(f64::NAN)]).unwrap();
        assert_eq!(text, "beam,fibres,alpha,more\nB1,3,0.30000000000000004,\nB1,3,,\n");
        assert!(matches!(csv(&["beam"], &[row(1.0)]), Err(Error::Length { expected: 1, found: 4, .. })));
    }
}
