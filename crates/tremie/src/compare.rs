//! `tremie compare`: the same gauges of several runs in one table and in plots, and their profiles over each other.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::Context as _;
use clap::Args;
use serde_json::{Value, json};
use tremie_case::Case;
use tremie_output::picture::{Axis, Curve, Plot, Style};
use tremie_output::series::{self, Table};
use tremie_simulation::{Cells, Fluid, FolderError, RunFolder, Snapshot, gauges};

use crate::failure::WrongInput;
use crate::numbers::significant;
use crate::{last_state, terminal};

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  tremie compare runs/slump-lbm runs/slump-isph
  tremie compare runs/coarse runs/fine --out comparison

Shown are the gauges that all runs have: their values at the end, and by how much they differ from the first run's at most over
the time that both have, over the largest value there. The folder gets a plot of each, the last profiles, and the table.")]
pub(crate) struct Arguments {
    /// Folders of two runs or more
    #[arg(required = true, num_args = 2.., value_name = "RUN")]
    runs: Vec<PathBuf>,
    /// Folder for plots and the table; without it there are none
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Print JSON, in SI units
    #[arg(long)]
    json: bool,
}

/// A run that is compared.
struct Run {
    /// Its folder's name and its method.
    name: String,
    series: Table,
    /// Times of events in s, by their names in summary.json.
    events: BTreeMap<String, f64>,
    /// Time in s and profile of the last state, in m, if it is known.
    profile: Option<(f64, Vec<[f64; 2]>)>,
}

impl Run {
    fn read(path: &Path) -> anyhow::Result<Self> {
        let folder = RunFolder::open(path)?;
        let case = Case::read(&folder.case())?;
        let series = series::read(&folder.series()).map_err(FolderError::from)?;
        if series.rows.is_empty() {
            return Err(WrongInput(format!("{} has no readings yet", path.display())).into());
        }
        let text = std::fs::read_to_string(folder.summary()).unwrap_or_default();
        let summary: Value = serde_json::from_str(&text).unwrap_or_default();
        let times = summary.as_object().into_iter().flatten();
        let events = times
            .filter(|(key, _)| key.starts_with("front_") || key.starts_with("light_") || *key == "t500_s")
            .filter_map(|(key, value)| Some((key.clone(), value.as_f64()?)));
        let profile = match last_state::read(&folder, &case)? {
            Ok(Snapshot { time, fluid: Fluid::Cells(cells), .. }) => Some((time, profile(&cells, &case))),
            Err(_) => None,
        };
        let last = path
            .canonicalize()
            .ok()
            .and_then(|path| path.file_name().map(|name| name.to_string_lossy().into_owned()));
        let name = last.unwrap_or_else(|| path.display().to_string());
        let name = format!("{name} ({})", case.method.name());
        Ok(Self { name, series, events: events.collect(), profile })
    }

    /// Times and values of a column.
    fn column(&self, name: &str) -> Option<Vec<[f64; 2]>> {
        let column = self.series.columns.iter().position(|column| column == name)?;
        Some(self.series.rows.iter().map(|row| [row[0], row[column]]).collect())
    }
}

/// Height in m over the radius where the case measures a spread, else over x in the middle of the domain along y.
fn profile(cells: &Cells, case: &Case) -> Vec<[f64; 2]> {
    if let Some(spread) = case.gauges.spread {
        return gauges::profile(cells, spread.centre);
    }
    let middle = 0.5 * (case.domain.min.y + case.domain.max.y);
    let row = ((middle - cells.origin.y) / cells.size).floor();
    if row < 0.0 || row >= cells.count[1] as f64 {
        return Vec::new();
    }
    let height = |i: usize| -> f64 {
        let fills = (0..cells.count[2]).map(|k| cells.fill[cells.index(i, row as usize, k)]);
        cells.size * fills.sum::<f64>()
    };
    (0..cells.count[0]).map(|i| [cells.centre(i, 0, 0).x, height(i)]).collect()
}

/// The value of a column at a time, on straight lines between readings; none outside of them.
fn at(points: &[[f64; 2]], time: f64) -> Option<f64> {
    let next = points.partition_point(|[t, _]| *t < time);
    let [t1, v1] = *points.get(next)?;
    match next.checked_sub(1).map(|before| points[before]) {
        Some([t0, v0]) => Some(v0 + (v1 - v0) * (time - t0) / (t1 - t0)),
        None => (t1 == time).then_some(v1),
    }
}

/// Largest difference of two columns over the largest value of the first, over the time that both have.
fn difference(one: &[[f64; 2]], other: &[[f64; 2]]) -> f64 {
    let both = one.iter().filter_map(|[t, value]| Some((*value, at(other, *t)?)));
    let (off, most) = both
        .filter(|(a, b)| a.is_finite() && b.is_finite())
        .fold((0.0, 0.0), |(off, most): (f64, f64), (a, b)| (off.max((a - b).abs()), most.max(a.abs())));
    if off == 0.0 { 0.0 } else { off / most }
}

/// Compares runs.
pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<ExitCode> {
    let runs: Vec<Run> = arguments.runs.iter().map(|path| Run::read(path)).collect::<anyhow::Result<_>>()?;
    let (first, others) = (&runs[0], &runs[1..]);
    let names = first.series.columns.iter().skip(1);
    let common: Vec<(&String, Vec<Vec<[f64; 2]>>)> = names
        .filter_map(|name| Some((name, runs.iter().map(|run| run.column(name)).collect::<Option<_>>()?)))
        .collect();
    let events = first.events.keys().filter(|key| others.iter().all(|run| run.events.contains_key(*key)));
    let events: Vec<&String> = events.collect();

    let last = |column: &Vec<[f64; 2]>| column.last().map_or(f64::NAN, |[_, value]| *value);
    let json = json!({
        "runs": runs.iter().map(|run| &run.name).collect::<Vec<_>>(),
        "time_s": runs.iter().map(|run| run.series.rows.last().map(|row| row[0])).collect::<Vec<_>>(),
        "at_the_end": common.iter().map(|(name, columns)| {
            ((*name).clone(), columns.iter().map(last).map(Value::from).collect())
        }).collect::<serde_json::Map<String, Value>>(),
        "largest_difference": common.iter().map(|(name, columns)| {
            let off = columns[1..].iter().map(|column| Value::from(difference(&columns[0], column)));
            ((*name).clone(), off.collect())
        }).collect::<serde_json::Map<String, Value>>(),
        "events": events.iter().map(|key| {
            ((*key).clone(), runs.iter().map(|run| Value::from(run.events[*key])).collect())
        }).collect::<serde_json::Map<String, Value>>(),
    });
    if let Some(out) = &arguments.out {
        std::fs::create_dir_all(out).with_context(|| out.display().to_string())?;
        for (name, columns) in &common {
            let curves: Vec<(&str, &[[f64; 2]])> = runs
                .iter()
                .zip(columns)
                .map(|(run, column)| (run.name.as_str(), column.as_slice()))
                .collect();
            draw(name, "time [s]", &label(name), &curves, &out.join(format!("{name}.png")))?;
        }
        let profiles: Vec<(String, Vec<[f64; 2]>)> = (runs.iter())
            .filter_map(|run| {
                let (time, profile) = run.profile.as_ref()?;
                let millimetres = profile.iter().map(|point| point.map(|x| 1e3 * x)).collect();
                Some((format!("{}, {time:.2} s", run.name), millimetres))
            })
            .collect();
        if !profiles.is_empty() {
            let curves: Vec<(&str, &[[f64; 2]])> =
                profiles.iter().map(|(name, points)| (name.as_str(), points.as_slice())).collect();
            draw("Last profiles", "x or radius [mm]", "height [mm]", &curves, &out.join("profile.png"))?;
        }
        let path = out.join("comparison.json");
        std::fs::write(&path, format!("{json:#}\n")).with_context(|| path.display().to_string())?;
    }
    terminal::say(&if arguments.json { format!("{json:#}") } else { table(&runs, &common, &events) });
    Ok(ExitCode::SUCCESS)
}

/// The label of an axis from the name of a column, which ends with its unit.
fn label(column: &str) -> String {
    column.replace('_', " ")
}

fn draw(title: &str, x: &str, y: &str, curves: &[(&str, &[[f64; 2]])], path: &Path) -> anyhow::Result<()> {
    let style = |n: usize| if n == 0 { Style::Line } else { Style::Dashed };
    let curves = curves.iter().enumerate();
    let plot = Plot {
        title,
        x: Axis::linear(x),
        y: Axis::linear(y),
        curves: curves.map(|(n, (label, points))| Curve { label, points, style: style(n) }).collect(),
        horizontals: Vec::new(),
        verticals: Vec::new(),
    };
    Ok(plot.draw().write(path)?)
}

/// The table for people.
fn table(runs: &[Run], common: &[(&String, Vec<Vec<[f64; 2]>>)], events: &[&String]) -> String {
    let mut rows: Vec<Vec<String>> = Vec::new();
    let names = runs.iter().map(|run| run.name.clone());
    let off = runs[1..].iter().enumerate().map(|(n, _)| format!("{} off", n + 2));
    rows.push(std::iter::once("at the end".to_owned()).chain(names).chain(off).collect());
    let times = runs.iter().map(|run| run.series.rows.last().map_or(f64::NAN, |row| row[0]));
    rows.push(std::iter::once("time_s".to_owned()).chain(times.map(significant)).collect());
    for (name, columns) in common {
        let last = columns.iter().map(|column| column.last().map_or(f64::NAN, |[_, value]| *value));
        let off = columns[1..]
            .iter()
            .map(|column| format!("{} %", significant(100.0 * difference(&columns[0], column))));
        rows.push(std::iter::once((*name).clone()).chain(last.map(significant)).chain(off).collect());
    }
    for key in events {
        let times = runs.iter().map(|run| significant(run.events[*key]));
        rows.push(std::iter::once((*key).clone()).chain(times).collect());
    }
    let columns = rows.iter().map(Vec::len).max().unwrap_or(0);
    let width = |n: usize| rows.iter().filter_map(|row| row.get(n)).map(|cell| cell.chars().count()).max();
    let widths: Vec<usize> = (0..columns).map(|n| width(n).unwrap_or(0)).collect();
    let line = |row: &Vec<String>| {
        let cells = row.iter().zip(&widths).enumerate();
        let cells = cells.map(|(n, (cell, width))| match n {
            0 => format!("{cell:<width$}"),
            _ => format!("{cell:>width$}"),
        });
        cells.collect::<Vec<_>>().join("  ").trim_end().to_owned()
    };
    rows.iter().map(line).collect::<Vec<_>>().join("\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_are_compared_where_both_have_values() {
        let one = [[0.0, 1.0], [1.0, 2.0], [2.0, 4.0]];
        let other = [[0.0, 1.0], [0.5, 1.0], [1.5, 3.0]];
        assert_eq!((at(&other, 1.0), at(&other, 2.0), at(&other, 0.0)), (Some(2.0), None, Some(1.0)));
        assert_eq!(difference(&one, &other), 0.0);
        let higher = other.map(|[t, value]| [t, value + 0.5]);
        assert_eq!(difference(&one, &higher), 0.25);
    }
}
