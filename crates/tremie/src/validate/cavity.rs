//! Square cavities whose lid moves along itself, against velocities on their centre lines.
//!
//! The lid is the upper side; u is the velocity along it, v that across it. Lengths, velocities and times are in units of the
//! cavity's edge and the lid's speed, which the cases set to 1 m and 1 m/s.

use anyhow::anyhow;
use rayon::prelude::*;
use tremie_case::Case;
use tremie_numerics::DVec3;
use tremie_rheology::FlowCurve;
use tremie_simulation::Cells;

use super::benchmark::{Check, Context, Row, observed_order, shown};
use super::flow::{Flow, lattice};

/// Share of the lid's speed by which a flow may still change while the lid goes one cavity further. The slowest mode of the flow at
/// Re 1000 decays by e in about 20 such times, so that less than 0.1 % is left to change.
const STEADY: f64 = 1e-5;

/// Cells across in the runs that show the order.
const ORDER: [usize; 3] = [32, 64, 128];
/// Speed of the lid in cells a step, in the coarsest of them and in all other runs.
const LID: f64 = 0.1;

/// The steady flow in a cavity of `cells` cells across whose lid moves by `lid` cells a step.
fn cavity(mut case: Case, cells: usize, lid: f64) -> anyhow::Result<Cells> {
    let size = 1.0 / cells as f64;
    case.domain.max = DVec3::new(1.0, size, 1.0);
    lattice(&mut case).cell_size = size;
    lattice(&mut case).lattice_speed = lid;
    Flow::new(case).until_steady(1.0, STEADY)
}

/// Velocities at the centres of the cells along the two centre lines: u upwards, v from left to right.
struct Lines {
    u: Vec<f64>,
    v: Vec<f64>,
}

impl Lines {
    fn of(cells: &Cells) -> Self {
        let n = cells.count[0];
        let at = |i: usize, k: usize| cells.velocity[cells.index(i, 0, k)];
        // The line lies between two cells.
        Self {
            u: (0..n).map(|k| 0.5 * (at(n / 2 - 1, k).x + at(n / 2, k).x)).collect(),
            v: (0..n).map(|i| 0.5 * (at(i, n / 2 - 1).z + at(i, n / 2).z)).collect(),
        }
    }

    /// Smallest u, largest v, smallest v.
    fn extrema(&self) -> [f64; 3] {
        let negative = |values: &[f64]| values.iter().map(|value| -value).collect::<Vec<f64>>();
        [-largest(&negative(&self.u)), largest(&self.v), -largest(&negative(&self.v))]
    }
}

/// Largest of some evenly spaced values, by a parabola through the three around it.
fn largest(values: &[f64]) -> f64 {
    let n = (1..values.len() - 1).max_by(|a, b| values[*a].total_cmp(&values[*b])).unwrap_or(1);
    let [before, here, after] = [values[n - 1], values[n], values[n + 1]];
    let (slope, bend) = (0.5 * (after - before), after - 2.0 * here + before);
    if bend < 0.0 { here - 0.5 * slope * slope / bend } else { here }
}

/// Value at the coordinate `place`, from 0 to 1, by a straight line between the centres of cells around it.
fn between(values: &[f64], place: f64) -> f64 {
    let at = (place * values.len() as f64 - 0.5).clamp(0.0, (values.len() - 1) as f64);
    let n = (at as usize).min(values.len() - 2);
    let share = at - n as f64;
    (1.0 - share) * values[n] + share * values[n + 1]
}

/// Norm of the difference between values along a line and those of a table inside the cavity, over the norm of the latter.
fn difference(values: &[f64], rows: &[Row], place: &str, column: &str) -> f64 {
    let (mut off, mut norm) = (0.0, 0.0);
    for row in rows.iter().filter(|row| row[place] > 0.0 && row[place] < 1.0) {
        off += (between(values, row[place]) - row[column]).powi(2);
        norm += row[column].powi(2);
    }
    (off / norm).sqrt()
}

/// A cavity of a Newtonian fluid.
struct Newtonian {
    reynolds: f64,
    cells: usize,
    lid: f64,
}

impl Newtonian {
    fn run(&self, context: &Context) -> anyhow::Result<Lines> {
        let mut case = context.case("case.toml")?;
        case.material.curve = FlowCurve::Newtonian { viscosity: case.material.density / self.reynolds };
        Ok(Lines::of(&cavity(case, self.cells, self.lid)?))
    }
}

/// Lid-driven cavity of a Newtonian fluid at three Reynolds numbers.
pub(super) fn cavity_newtonian(context: &Context) -> anyhow::Result<Vec<Check>> {
    // Errors of compressibility go with the square of the lid's speed, so that they fall as those of the cells do.
    let order = ORDER.map(|cells| {
        let lid = LID * ORDER[0] as f64 / cells as f64;
        Newtonian { reynolds: 100.0, cells, lid }
    });
    let others =
        [(1000.0, 200), (400.0, 128)].map(|(reynolds, cells)| Newtonian { reynolds, cells, lid: LID });
    // The longest first.
    let runs: Vec<Newtonian> = others.into_iter().chain(order.into_iter().rev()).collect();
    let flows: anyhow::Result<Vec<Lines>> =
        runs.par_iter().with_max_len(1).map(|run| run.run(context)).collect();
    let (rows, mut checks, mut errors) = (context.reference()?, Vec::new(), Vec::new());
    for (Newtonian { reynolds, cells, .. }, lines) in runs.iter().zip(flows?).rev() {
        let row = rows.iter().find(|row| row["Re"] == *reynolds);
        let row = row.ok_or_else(|| anyhow!("reference.csv has no row for Re {reynolds}"))?;
        let mut square = 0.0;
        for (name, value) in ["u_min", "v_max", "v_min"].into_iter().zip(lines.extrema()) {
            let what = format!("{name}, Re {reynolds}, {cells} cells");
            let tolerance = format!("extrema Re {reynolds}");
            let check = context.relative(&tolerance, what, "", row[name], value)?;
            square += check.error.powi(2);
            // Coarse cavities are there for the order.
            let judged = *cells >= 128;
            checks.push(if judged { check } else { Check { tolerance: None, ..check } });
        }
        if *reynolds == 100.0 {
            errors.push(square.sqrt());
        }
        if *cells >= 128 {
            let off = [
                difference(&lines.u, &context.table("ghia-u.csv")?, "y", &format!("u_Re{reynolds}")),
                difference(&lines.v, &right_rows(context, *reynolds)?, "x", &format!("v_Re{reynolds}")),
            ];
            for (name, off) in ["u", "v"].into_iter().zip(off) {
                checks.push(shown(format!("{name} against Ghia et al., Re {reynolds} (L2)"), off));
            }
        }
    }
    checks.push(context.at_least("order", "order, Re 100", observed_order(&ORDER, &errors))?);
    Ok(checks)
}

/// The table of v without what is a misprint in it: the value at x = 0.9063 and Re 400.
fn right_rows(context: &Context, reynolds: f64) -> anyhow::Result<Vec<Row>> {
    let rows = context.table("ghia-v.csv")?;
    Ok(rows.into_iter().filter(|row| reynolds != 400.0 || row["x"] != 0.9063).collect())
}

/// Lid-driven cavity of a Casson fluid.
pub(super) fn cavity_casson(context: &Context) -> anyhow::Result<Vec<Check>> {
    const CELLS: [usize; 2] = [64, 128];
    let runs: anyhow::Result<Vec<Lines>> = CELLS
        .par_iter()
        .rev()
        .with_max_len(1)
        .map(|cells| Ok(Lines::of(&cavity(context.case("case.toml")?, *cells, LID)?)))
        .collect();
    let (rows, mut checks) = (context.reference()?, Vec::new());
    for (lines, cells) in runs?.iter().zip(CELLS.into_iter().rev()) {
        for (name, off) in [
            ("u along the vertical line", difference(&lines.u, &rows, "yA", "uA_ext")),
            ("v along the horizontal line", difference(&lines.v, &rows, "xB", "vB_ext")),
        ] {
            let what = format!("{name}, {cells} cells (L2)");
            checks.push(if cells == 128 {
                context.zero("profile", what, "", off)?
            } else {
                shown(what, off)
            });
        }
    }
    Ok(checks)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_extremum_is_found_between_cells() {
        let place = |n: usize| (n as f64 + 0.5) / 20.0;
        let parabola: Vec<f64> = (0..20).map(|n| 0.3 - (place(n) - 0.437).powi(2)).collect();
        assert!((largest(&parabola) - 0.3).abs() < 1e-12);
        assert!((between(&parabola, place(3)) - parabola[3]).abs() < 1e-12);
        assert!((between(&parabola, 0.25) - 0.5 * (parabola[4] + parabola[5])).abs() < 1e-12);
    }
}
