//! The only module that prints.
//!
//! A reader that has gone away (`tremie check CASE | head`) is no reason to fail, so what cannot be written is dropped.

use std::io::{IsTerminal, Write, stderr, stdout};

/// Writes a result and a line break to standard output.
pub(crate) fn say(text: &str) {
    let _ = writeln!(stdout().lock(), "{text}");
}

/// Writes a message and a line break to standard error.
pub(crate) fn note(text: &str) {
    let _ = writeln!(stderr().lock(), "{text}");
}

/// Writes a warning to standard error.
pub(crate) fn warn(text: &str) {
    note(&format!("{} {text}", painted("warning:", "1;33")));
}

/// Writes an error to standard error.
pub(crate) fn error(text: &str) {
    note(&format!("{} {text}", painted("error:", "1;31")));
}

/// Whether messages may have colours: on a terminal, unless `NO_COLOR` is set (no-color.org).
pub(crate) fn colours() -> bool {
    stderr().is_terminal() && std::env::var_os("NO_COLOR").is_none_or(|value| value.is_empty())
}

fn painted(text: &str, code: &str) -> String {
    if colours() { format!("\u{1b}[{code}m{text}\u{1b}[0m") } else { text.to_owned() }
}

/// Lines of names and what belongs to them, in two columns.
pub(crate) fn columns(rows: &[(&str, String)]) -> String {
    let width = rows.iter().map(|(name, _)| name.chars().count()).max().unwrap_or(0);
    let lines: Vec<String> =
        rows.iter().map(|(name, text)| format!("  {name:width$}  {text}").trim_end().to_owned()).collect();
    lines.join("\n")
}
