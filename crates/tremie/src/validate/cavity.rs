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

/// Nodes across in the runs of methods without a mesh.
const NODES: [usize; 2] = [100, 200];

/// Mean velocities on the cells of a flow that is steady but for the disorder of what carries it, over the last third of the case's time.
fn mean(case: Case) -> anyhow::Result<Cells> {
    const MOMENTS: usize = 21;
    let end = case.stop.time;
    let mut flow = Flow::new(case);
    let mut sum = vec![DVec3::ZERO; 0];
    for n in 0..MOMENTS {
        flow.until(end * (2.0 + n as f64 / (MOMENTS - 1) as f64) / 3.0)?;
        let now = flow.cells().velocity;
        sum.resize(now.len(), DVec3::ZERO);
        sum.iter_mut().zip(now).for_each(|(sum, u)| *sum += u / MOMENTS as f64);
    }
    Ok(Cells { velocity: sum, ..flow.cells() })
}

/// The mean flow in a square cavity with so many nodes across.
fn square(mut case: Case, nodes: usize) -> anyhow::Result<Lines> {
    let size = 1.0 / nodes as f64;
    case.domain.max = DVec3::new(1.0, size, 1.0);
    case.method.set_resolution(size);
    Ok(Lines::of(&mean(case)?))
}

/// What is wrong with the extrema on the centre lines.
fn extrema(context: &Context, lines: &Lines, exact: [f64; 3], nodes: usize) -> anyhow::Result<Vec<Check>> {
    ["u_min", "v_max", "v_min"]
        .into_iter()
        .zip(exact.into_iter().zip(lines.extrema()))
        .map(|(name, (exact, found))| {
            context.relative(&format!("extrema {nodes}"), format!("{name}, {nodes} nodes"), "", exact, found)
        })
        .collect()
}

/// Lid-driven cavity of a Newtonian fluid by nodes.
pub(super) fn cavity_newtonian_nodes(context: &Context) -> anyhow::Result<Vec<Check>> {
    const REYNOLDS: f64 = 100.0;
    let rows = context.reference()?;
    let row = rows.iter().find(|row| row["Re"] == REYNOLDS);
    let row = row.ok_or_else(|| anyhow!("reference.csv has no row for Re {REYNOLDS}"))?;
    let mut checks = Vec::new();
    for nodes in NODES {
        let lines = square(context.case("case.toml")?, nodes)?;
        checks.extend(extrema(context, &lines, ["u_min", "v_max", "v_min"].map(|name| row[name]), nodes)?);
        let off = [
            difference(&lines.u, &context.table("ghia-u.csv")?, "y", &format!("u_Re{REYNOLDS}")),
            difference(&lines.v, &right_rows(context, REYNOLDS)?, "x", &format!("v_Re{REYNOLDS}")),
        ];
        for (name, off) in ["u", "v"].into_iter().zip(off) {
            checks.push(shown(format!("{name} against Ghia et al., {nodes} nodes (L2)"), off));
        }
    }
    Ok(checks)
}

/// Lid-driven cavity of a Casson fluid by nodes.
pub(super) fn cavity_casson_nodes(context: &Context) -> anyhow::Result<Vec<Check>> {
    let (rows, mut checks) = (context.reference()?, Vec::new());
    let column = |name: &str| -> Vec<f64> { rows.iter().map(|row| row[name]).collect() };
    let exact = Lines { u: column("uA_ext"), v: column("vB_ext") }.extrema();
    for nodes in NODES {
        let lines = square(context.case("case.toml")?, nodes)?;
        checks.extend(extrema(context, &lines, exact, nodes)?);
        let off = [difference(&lines.u, &rows, "yA", "uA_ext"), difference(&lines.v, &rows, "xB", "vB_ext")];
        for (name, off) in ["u", "v"].into_iter().zip(off) {
            checks.push(shown(format!("{name} against the reference, {nodes} nodes (L2)"), off));
        }
    }
    Ok(checks)
}

/// Lid-driven cavity of a power law whose side walls are slanted.
pub(super) fn cavity_skewed(context: &Context) -> anyhow::Result<Vec<Check>> {
    let (rows, mut checks) = (context.table("computed.csv")?, Vec::new());
    for nodes in NODES {
        let mut case = context.case("case.toml")?;
        let size = case.domain.max.z / nodes as f64;
        case.domain.max = DVec3::new((case.domain.max.x / size).ceil() * size, size, case.domain.max.z);
        case.method.set_resolution(size);
        let cells = mean(case)?;
        for (name, x, y, column, axis) in [
            ("u half-way between the walls", "xA", "yA", "uA_ext", 0),
            ("v at half of the height", "xB", "yB", "vB_ext", 2),
        ] {
            let (mut off, mut norm) = (0.0, 0.0);
            for row in rows.iter().filter(|row| row["s"] > 0.0 && row["s"] < 1.0) {
                let found = among(&cells, DVec3::new(row[x], 0.0, row[y]))[axis];
                off += (found - row[column]).powi(2);
                norm += row[column].powi(2);
            }
            let what = format!("{name}, {nodes} nodes (L2)");
            checks.push(context.zero(&format!("profile {nodes}"), what, "", (off / norm).sqrt())?);
        }
    }
    Ok(checks)
}

/// Velocity at a place, linear between the four cells around it of a planar flow; cells without fluid do not count.
fn among(cells: &Cells, at: DVec3) -> DVec3 {
    let place = (at - cells.origin) / cells.size - 0.5;
    let (i, k) = (place.x.floor(), place.z.floor());
    let (mut sum, mut whole) = (DVec3::ZERO, 0.0);
    for (x, z) in [(i, k), (i + 1.0, k), (i, k + 1.0), (i + 1.0, k + 1.0)] {
        let within = |x: f64, axis: usize| x >= 0.0 && x < cells.count[axis] as f64;
        if !(within(x, 0) && within(z, 2)) {
            continue;
        }
        let n = cells.index(x as usize, 0, z as usize);
        let share = (1.0 - (place.x - x).abs()) * (1.0 - (place.z - z).abs());
        if cells.fill[n] > 0.0 {
            sum += share * cells.velocity[n];
            whole += share;
        }
    }
    if whole > 0.0 { sum / whole } else { DVec3::ZERO }
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
