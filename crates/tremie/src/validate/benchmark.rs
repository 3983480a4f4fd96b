//! What a benchmark is: a folder of files, built into the program, and a function that computes it.
//!
//! The folder says what is computed and why, where the reference comes from, and how far off the result may be
//! (`benchmark.toml`); the function makes its [`Check`]s through [`Context`], which looks the tolerances up there, so that
//! each stands in one place.

use std::collections::BTreeMap;
use std::path::Path;

use anyhow::{Context as _, anyhow};
use serde::Deserialize;
use tremie_case::Case;

/// A folder of `validation/` and the function that computes it.
pub(super) struct Benchmark {
    /// Name of the folder, and of the benchmark on the command line.
    pub(super) id: &'static str,
    /// Its files by name.
    pub(super) files: &'static [(&'static str, &'static str)],
    /// Computes it.
    pub(super) run: fn(&Context) -> anyhow::Result<Vec<Check>>,
}

/// `benchmark.toml`.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Definition {
    /// One line for tables.
    pub(super) title: String,
    /// What is computed, and how it is measured.
    pub(super) what: String,
    /// What it would reveal.
    pub(super) why: String,
    /// Where the reference comes from.
    pub(super) reference: String,
    /// Whether `--quick` runs it.
    pub(super) quick: bool,
    /// Largest error by name: a share of the reference, or in the unit of the quantity, as its check says.
    #[serde(default)]
    pub(super) tolerances: BTreeMap<String, f64>,
    /// Values that must be reached, by name.
    #[serde(default)]
    pub(super) at_least: BTreeMap<String, f64>,
}

impl Benchmark {
    fn file(&self, name: &str) -> anyhow::Result<&'static str> {
        let file = self.files.iter().find(|(n, _)| *n == name);
        file.map(|(_, text)| *text).ok_or_else(|| anyhow!("validation/{}/{name} is not built in", self.id))
    }

    /// Reads `benchmark.toml`.
    pub(super) fn definition(&self) -> anyhow::Result<Definition> {
        toml::from_str(self.file("benchmark.toml")?)
            .with_context(|| format!("validation/{}/benchmark.toml", self.id))
    }
}

/// A row of a table: column names to numbers.
pub(super) type Row = BTreeMap<&'static str, f64>;

/// One quantity held against its reference.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Check {
    /// What was measured.
    pub(super) quantity: String,
    /// Unit of `reference` and `value`; empty for pure numbers.
    pub(super) unit: &'static str,
    /// What it should be.
    pub(super) reference: f64,
    /// What it is.
    pub(super) value: f64,
    /// How far off it is, on the scale of the tolerance.
    pub(super) error: f64,
    /// How far off it may be; none if it is only shown.
    pub(super) tolerance: Option<f64>,
}

impl Check {
    /// Whether the error is within the tolerance. What is not a number is not.
    pub(super) fn passes(&self) -> bool {
        self.tolerance.is_none_or(|tolerance| self.error <= tolerance)
    }
}

/// What a benchmark works with: its files and tolerances.
pub(super) struct Context<'a> {
    benchmark: &'a Benchmark,
    definition: Definition,
    out: Option<&'a Path>,
}

impl<'a> Context<'a> {
    pub(super) fn new(benchmark: &'a Benchmark) -> anyhow::Result<Self> {
        Ok(Self { benchmark, definition: benchmark.definition()?, out: None })
    }

    /// The same with a folder that figures go to, if any.
    pub(super) fn drawing(self, out: Option<&'a Path>) -> Self {
        Self { out, ..self }
    }

    /// Computes the benchmark.
    pub(super) fn run(&self) -> anyhow::Result<Vec<Check>> {
        (self.benchmark.run)(self)
    }

    /// Name of the benchmark.
    pub(super) fn id(&self) -> &'static str {
        self.benchmark.id
    }

    /// The folder that figures go to, if any.
    pub(super) fn out(&self) -> Option<&Path> {
        self.out
    }

    /// What `benchmark.toml` says.
    pub(super) fn definition(&self) -> &Definition {
        &self.definition
    }

    /// The case of this name in the benchmark's folder.
    pub(super) fn case(&self, name: &str) -> anyhow::Result<Case> {
        let path = format!("validation/{}/{name}", self.benchmark.id);
        Ok(Case::parse(&path, self.benchmark.file(name)?)?)
    }

    /// Rows of the folder's `reference.csv`.
    pub(super) fn reference(&self) -> anyhow::Result<Vec<Row>> {
        self.table("reference.csv")
    }

    /// Rows of a table in the folder.
    pub(super) fn table(&self, name: &str) -> anyhow::Result<Vec<Row>> {
        let text = self.benchmark.file(name)?;
        let mut lines = text.lines().filter(|line| !line.starts_with('#'));
        let names: Vec<&str> = lines.next().unwrap_or_default().split(',').collect();
        lines
            .map(|line| {
                let numbers = line.split(',').map(|number| number.trim().parse::<f64>());
                let numbers: Result<Vec<f64>, _> = numbers.collect();
                let numbers = numbers.with_context(|| format!("{name} of {}", self.benchmark.id))?;
                Ok(names.iter().copied().zip(numbers).collect())
            })
            .collect()
    }

    /// A tolerance of the benchmark.
    pub(super) fn tolerance(&self, name: &str) -> anyhow::Result<f64> {
        let tolerance = self.definition.tolerances.get(name).copied();
        tolerance.ok_or_else(|| anyhow!("{}: no tolerance `{name}`", self.benchmark.id))
    }

    /// A value whose error is a share of its reference.
    pub(super) fn relative(
        &self,
        tolerance: &str,
        quantity: impl Into<String>,
        unit: &'static str,
        reference: f64,
        value: f64,
    ) -> anyhow::Result<Check> {
        Ok(Check {
            quantity: quantity.into(),
            unit,
            reference,
            value,
            error: (value / reference - 1.0).abs(),
            tolerance: Some(self.tolerance(tolerance)?),
        })
    }

    /// A value whose error is a difference in its own unit.
    pub(super) fn absolute(
        &self,
        tolerance: &str,
        quantity: impl Into<String>,
        unit: &'static str,
        reference: f64,
        value: f64,
    ) -> anyhow::Result<Check> {
        let error = (value - reference).abs();
        Ok(Check {
            quantity: quantity.into(),
            unit,
            reference,
            value,
            error,
            tolerance: Some(self.tolerance(tolerance)?),
        })
    }

    /// A value that should be zero.
    pub(super) fn zero(
        &self,
        tolerance: &str,
        quantity: impl Into<String>,
        unit: &'static str,
        value: f64,
    ) -> anyhow::Result<Check> {
        self.absolute(tolerance, quantity, unit, 0.0, value)
    }

    /// A value that must reach its reference; what is missing is the error.
    pub(super) fn at_least(
        &self,
        name: &str,
        quantity: impl Into<String>,
        value: f64,
    ) -> anyhow::Result<Check> {
        let least = self.definition.at_least.get(name).copied();
        let reference = least.ok_or_else(|| anyhow!("{}: no `{name}` to reach", self.benchmark.id))?;
        let error = if value >= reference { 0.0 } else { reference - value };
        Ok(Check { quantity: quantity.into(), unit: "", reference, value, error, tolerance: Some(0.0) })
    }
}

/// An error that is shown for comparison but not judged.
pub(super) fn shown(quantity: impl Into<String>, value: f64) -> Check {
    Check { quantity: quantity.into(), unit: "", reference: 0.0, value, error: value.abs(), tolerance: None }
}

/// Order of convergence between the first and the last of `errors` at the given numbers of cells.
pub(super) fn observed_order(cells: &[usize], errors: &[f64]) -> f64 {
    match (cells, errors) {
        ([coarse, .., fine], [large, .., small]) => {
            (large / small).ln() / (*fine as f64 / *coarse as f64).ln()
        }
        _ => f64::NAN,
    }
}
