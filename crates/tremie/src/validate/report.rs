//! What is shown: a table that grows as benchmarks end, or a JSON list.

use std::io::{self, Write, stderr, stdout};
use std::path::Path;

use anyhow::Context as _;
use serde::Serialize;

use super::benchmark::Check;

/// A benchmark that has run.
pub(super) struct Verdict {
    id: &'static str,
    title: String,
    checks: Vec<Check>,
    /// Why it broke down, if it did.
    failure: Option<String>,
    /// Wall-clock time in s.
    seconds: f64,
}

impl Verdict {
    pub(super) fn new(
        id: &'static str,
        title: &str,
        checks: anyhow::Result<Vec<Check>>,
        seconds: f64,
    ) -> Self {
        let (checks, failure) = match checks {
            Ok(checks) => (checks, None),
            Err(error) => (Vec::new(), Some(format!("{error:#}"))),
        };
        Self { id, title: title.to_owned(), checks, failure, seconds }
    }

    fn passes(&self) -> bool {
        self.failure.is_none() && self.checks.iter().all(Check::passes)
    }

    fn entries(&self) -> impl Iterator<Item = Entry<'_>> {
        let (id, seconds) = (self.id, self.seconds);
        let checks = self.checks.iter().map(move |check| Entry {
            id,
            quantity: &check.quantity,
            unit: check.unit,
            reference: Some(check.reference),
            value: Some(check.value),
            error: Some(check.error),
            tolerance: check.tolerance,
            pass: check.passes(),
            seconds,
        });
        let failure = self.failure.as_ref().map(move |failure| Entry {
            id,
            quantity: failure,
            unit: "",
            reference: None,
            value: None,
            error: None,
            tolerance: None,
            pass: false,
            seconds,
        });
        checks.chain(failure)
    }

    fn write(&self, to: &mut impl Write) -> io::Result<()> {
        for check in &self.checks {
            let verdict = match (check.tolerance, check.passes()) {
                (None, _) => "shown",
                (_, true) => "ok",
                (_, false) => "FAILED",
            };
            writeln!(
                to,
                "  {:<52} {:>11} {:>11} {:<5} {:>9} {:>9}  {verdict}",
                check.quantity,
                number(check.reference),
                number(check.value),
                check.unit,
                scientific(check.error),
                check.tolerance.map_or_else(String::new, scientific),
            )?;
        }
        if let Some(failure) = &self.failure {
            writeln!(to, "  {failure}  FAILED")?;
        }
        Ok(())
    }
}

/// An entry of the JSON list.
#[derive(Debug, Serialize)]
struct Entry<'a> {
    id: &'a str,
    /// What was measured; why there is nothing if the benchmark broke down.
    quantity: &'a str,
    unit: &'a str,
    reference: Option<f64>,
    value: Option<f64>,
    error: Option<f64>,
    /// None if the value is only shown.
    tolerance: Option<f64>,
    pass: bool,
    /// Wall-clock time of the whole benchmark.
    seconds: f64,
}

/// All verdicts so far.
pub(super) struct Report {
    json: bool,
    verdicts: Vec<Verdict>,
}

impl Report {
    pub(super) fn new(json: bool) -> Self {
        Self { json, verdicts: Vec::new() }
    }

    /// How many benchmarks are shown.
    pub(super) fn shown(&self) -> usize {
        self.verdicts.len()
    }

    pub(super) fn ends(&mut self, verdict: Verdict) -> io::Result<()> {
        if !self.json {
            let mut out = stdout().lock();
            writeln!(out, "{}: {}", verdict.id, verdict.title)?;
            if self.verdicts.is_empty() {
                header(&mut out)?;
            }
            verdict.write(&mut out)?;
            writeln!(out, "  {:.1} s\n", verdict.seconds)?;
        }
        self.verdicts.push(verdict);
        Ok(())
    }

    pub(super) fn all_pass(&self) -> bool {
        self.verdicts.iter().all(Verdict::passes)
    }

    /// Shows the end, and writes `validation.json` and `validation.txt` into `folder`.
    pub(super) fn close(&self, folder: Option<&Path>) -> anyhow::Result<()> {
        let entries: Vec<Entry> = self.verdicts.iter().flat_map(Verdict::entries).collect();
        let list = serde_json::to_string_pretty(&entries)?;
        if self.json {
            writeln!(stdout(), "{list}")?;
        } else {
            writeln!(stdout(), "{}", self.conclusion())?;
        }
        if let Some(folder) = folder {
            let mut table = Vec::new();
            header(&mut table)?;
            for verdict in &self.verdicts {
                writeln!(table, "{} ({:.1} s)", verdict.id, verdict.seconds)?;
                verdict.write(&mut table)?;
            }
            writeln!(table, "{}", self.conclusion())?;
            std::fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
            for (name, bytes) in [("validation.json", list.as_bytes()), ("validation.txt", &table)] {
                let path = folder.join(name);
                std::fs::write(&path, bytes).with_context(|| path.display().to_string())?;
            }
        }
        Ok(())
    }

    fn conclusion(&self) -> String {
        let seconds: f64 = self.verdicts.iter().map(|verdict| verdict.seconds).sum();
        let failed: Vec<&str> = self.verdicts.iter().filter(|v| !v.passes()).map(|v| v.id).collect();
        let number = self.verdicts.len();
        if failed.is_empty() {
            format!("All of {number} benchmarks pass ({seconds:.0} s)")
        } else {
            format!("{} of {number} benchmarks fail ({seconds:.0} s): {}", failed.len(), failed.join(", "))
        }
    }
}

/// A sign of life of a long benchmark; where nobody can see it, nothing is lost.
pub(super) fn progress(text: &str) {
    let _ = writeln!(stderr(), "    {text}");
}

fn header(to: &mut impl Write) -> io::Result<()> {
    let [quantity, reference, value, error, tolerance] =
        ["quantity", "reference", "value", "error", "tolerance"];
    writeln!(to, "  {quantity:<52} {reference:>11} {value:>11} {:<5} {error:>9} {tolerance:>9}", "")
}

/// Six digits, as short as they come.
fn number(value: f64) -> String {
    if value == 0.0 || (1e-3..1e6).contains(&value.abs()) {
        let digits = if value == 0.0 { 0 } else { (5 - value.abs().log10().floor() as i32).max(0) as usize };
        let text = format!("{value:.digits$}");
        if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
    } else {
        format!("{value:.4e}")
    }
}

fn scientific(value: f64) -> String {
    if value == 0.0 { "0".to_owned() } else { format!("{value:.1e}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(error: f64, tolerance: Option<f64>) -> Check {
        Check {
            quantity: "spread".to_owned(),
            unit: "m",
            reference: 0.6,
            value: 0.6 + error,
            error,
            tolerance,
        }
    }

    #[test]
    fn a_benchmark_passes_only_if_all_of_it_does() {
        let verdict = |checks| Verdict::new("a", "A", Ok(checks), 1.0);
        assert!(verdict(vec![check(0.01, Some(0.01)), check(9.0, None)]).passes());
        assert!(!verdict(vec![check(0.0, Some(0.01)), check(0.02, Some(0.01))]).passes());
        assert!(!verdict(vec![check(f64::NAN, Some(0.01))]).passes());
        assert!(!Verdict::new("a", "A", Err(anyhow::anyhow!("broke down")), 1.0).passes());
    }

    #[test]
    fn the_list_has_the_keys_that_scripts_ask_for() {
        let verdicts = [
            Verdict::new("a", "A", Ok(vec![check(0.01, Some(0.02))]), 1.5),
            Verdict::new("b", "B", Err(anyhow::anyhow!("broke down")), 1.5),
        ];
        let entries: Vec<Entry> = verdicts.iter().flat_map(Verdict::entries).collect();
        let list = serde_json::to_value(&entries).unwrap();
        for key in ["id", "quantity", "reference", "value", "error", "tolerance", "pass", "seconds"] {
            assert!(!list[0][key].is_null(), "{key}");
        }
        assert_eq!(list[0]["pass"], true);
        assert_eq!((&list[1]["pass"], &list[1]["quantity"]), (&false.into(), &"broke down".into()));
    }

    #[test]
    fn numbers_are_short() {
        for (value, text) in [(0.0, "0"), (427.0, "427"), (0.562124, "0.562124"), (8.77e-5, "8.7700e-5")] {
            assert_eq!(number(value), text);
        }
    }
}
