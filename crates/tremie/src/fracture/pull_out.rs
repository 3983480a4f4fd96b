//! A single fibre that is pulled out of the matrix.

use std::process::ExitCode;

use serde_json::json;
use tremie_case::{BeamCase, BeamTest};
use tremie_fracture::PullOut;
use tremie_output::picture::{Axis, Curve, Plot, Reference, Style};
use tremie_output::table::{self, Cell};

use super::beam;
use super::folder::Folder;
use crate::numbers::significant;
use crate::terminal;

/// Readings up to where the fibre is loose, and from there on.
const STEPS: [usize; 2] = [50, 200];

/// Does the test and tells its results.
pub(super) fn run(case: &BeamCase, folder: &Folder, as_json: bool) -> anyhow::Result<ExitCode> {
    let BeamTest::PullOut { embedded, diameter, angle } = case.test else {
        anyhow::bail!("the file has another test");
    };
    let law = PullOut::new(&beam::bond(case), diameter, embedded, angle);
    let loose = law.loose().min(case.opening);
    let early = (1..=STEPS[0]).map(|k| loose * (k as f64 / STEPS[0] as f64).powi(2));
    let late = (1..=STEPS[1]).map(|k| loose + (case.opening - loose) * k as f64 / STEPS[1] as f64);
    let readings: Vec<[f64; 3]> = std::iter::once(0.0)
        .chain(early)
        .chain(late)
        .map(|opening| [opening, law.force(opening), law.work(opening)])
        .collect();
    let rows: Vec<Vec<Cell>> = readings.iter().map(|row| row.map(Cell::Number).to_vec()).collect();
    table::write(&folder.file("pull_out.csv"), &["opening_m", "force_N", "work_J"], &rows)?;
    let points: Vec<[f64; 2]> = readings.iter().map(|[opening, force, _]| [1e3 * opening, *force]).collect();
    Plot {
        title: &case.title,
        x: Axis::linear("opening [mm]"),
        y: Axis::linear("force [N]"),
        curves: vec![Curve { label: "", points: &points, style: Style::Line }],
        horizontals: Vec::new(),
        verticals: vec![Reference { at: 1e3 * law.loose(), label: "loose" }],
    }
    .draw()
    .write(&folder.file("pull_out.png"))?;
    let peak = readings.iter().map(|[_, force, _]| *force).fold(0.0, f64::max);
    let work = law.work(case.opening);
    let json = json!({
        "title": case.title,
        "peak_N": peak,
        "loose_opening_m": law.loose(),
        "loose_force_N": law.loose_force(),
        "work_J": work,
        "breaks": law.breaks(),
    });
    folder.json("summary.json", &json)?;
    folder.cost(0.0, readings.len() as u64, "opening")?;
    let rows = [
        ("largest force", format!("{} N", significant(peak))),
        (
            "comes loose",
            format!("at {} mm, {} N", significant(1e3 * law.loose()), significant(law.loose_force())),
        ),
        ("work", format!("{} mJ to {} mm", significant(1e3 * work), significant(1e3 * case.opening))),
        ("fibre", if law.breaks() { "breaks".to_owned() } else { "is pulled out".to_owned() }),
        ("results", folder.path().display().to_string()),
    ];
    terminal::say(&if as_json { format!("{json:#}") } else { terminal::columns(&rows) });
    Ok(ExitCode::SUCCESS)
}
