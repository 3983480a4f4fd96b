//! Planar columns that collapse: water that runs away, Bingham blocks that come to rest.

use anyhow::anyhow;
use rayon::prelude::*;
use tremie_rheology::FlowCurve;
use tremie_simulation::Cells;

use super::benchmark::{Check, Context, shown};
use super::flow::Flow;

/// Height in cells of the fluid in each column of a planar flow, from the lower side of x on.
pub(super) fn heights(cells: &Cells) -> Vec<f64> {
    let column = |i| (0..cells.count[2]).map(|k| cells.fill[cells.index(i, 0, k)]).sum();
    (0..cells.count[0]).map(column).collect()
}

/// Distance in m of the front from the lower side of x: where, going outwards, the fluid is first less than half a cell high.
pub(super) fn front(cells: &Cells) -> f64 {
    let cover: Vec<f64> = heights(cells).iter().map(|height| height.min(1.0)).collect();
    let dry = cover.iter().position(|cover| *cover < 0.5).unwrap_or(cover.len());
    let outside = cover.get(dry).copied().unwrap_or(0.0);
    match dry.checked_sub(1) {
        Some(wet) => {
            let share = (cover[wet] - 0.5) / (cover[wet] - outside);
            cells.centre(wet, 0, 0).x + share * cells.size
        }
        None => cells.origin.x,
    }
}

/// Height in m at the lower side of x.
fn height(cells: &Cells) -> f64 {
    heights(cells).first().map_or(0.0, |height| height * cells.size)
}

/// A column of water whose gate vanishes.
pub(super) fn dam_break_water(context: &Context) -> anyhow::Result<Vec<Check>> {
    let (fine, coarse) = rayon::join(|| dam_break(context, 1.0), || dam_break(context, 2.0));
    Ok([fine?, coarse?].concat())
}

/// The case in cells `coarser` times as large.
fn dam_break(context: &Context, coarser: f64) -> anyhow::Result<Vec<Check>> {
    /// From here on how the gate opened does not matter any more.
    const FROM: f64 = 0.5;
    /// Between two readings, in units of T.
    const READING: f64 = 0.02;
    let mut case = context.case("case.toml")?;
    let size = coarser * case.method.resolution();
    case.method.set_resolution(size);
    case.domain.max.y *= coarser;
    let (width, gravity) = (case.fluid[0].shape.bounds().1.x, -case.domain.gravity.z);
    let initial = case.fluid[0].shape.bounds().1.z;
    let cells = format!("{} cells", (width / size).round());
    // T = t sqrt(2 g / a); the heights are given over tau = T / sqrt(2).
    let unit = (0.5 * width / gravity).sqrt();
    let (fronts, heights) = (context.reference()?, context.table("height.csv")?);
    let last = fronts.iter().map(|row| row["T"]).fold(0.0, f64::max);
    let mut flow = Flow::new(case);
    let (mut path, mut level) = (Vec::new(), Vec::new());
    for n in 0..=(last / READING).ceil() as usize {
        let t = n as f64 * READING;
        flow.until(t * unit)?;
        let now = flow.cells();
        path.push([t, front(&now) / width]);
        level.push([t, height(&now) / initial]);
    }
    let late: Vec<f64> = fronts
        .iter()
        .filter(|row| row["T"] > FROM)
        .filter_map(|row| Some(row["T"] - passes(&path, row["Z"])?))
        .collect();
    let late = late.iter().sum::<f64>() / late.len() as f64;
    let judged = |check: Check| if coarser == 1.0 { check } else { Check { tolerance: None, ..check } };
    let mut checks = Vec::new();
    for row in &fronts {
        let (t, z) = (row["T"], row["Z"]);
        let check = context.relative("front", format!("front at T = {t}, {cells}"), "", z, at(&path, t))?;
        checks.push(if t > FROM { judged(check) } else { Check { tolerance: None, ..check } });
    }
    checks.push(shown(format!("mean delay of the measured front, in T, {cells}"), late));
    let off = fronts
        .iter()
        .filter(|row| row["T"] > FROM)
        .map(|row| (at(&path, row["T"] - late) / row["Z"] - 1.0).abs())
        .fold(0.0, f64::max);
    checks.push(shown(format!("front by a clock late by that, furthest off, {cells}"), off));
    let off = heights
        .iter()
        .map(|row| (2f64.sqrt() * row["tau"], row["H"]))
        .filter(|(t, _)| *t <= last)
        .map(|(t, h)| (at(&level, t) - h).abs())
        .fold(0.0, f64::max);
    checks.push(shown(format!("height at the wall, furthest off, {cells}"), off));
    Ok(checks)
}

/// When a front whose times and places are given passes a place.
fn passes(path: &[[f64; 2]], place: f64) -> Option<f64> {
    let swapped: Vec<[f64; 2]> = path.iter().map(|[t, z]| [*z, *t]).collect();
    between(&swapped, place)
}

/// The place at a time; none is not a number.
fn at(path: &[[f64; 2]], time: f64) -> f64 {
    between(path, time).unwrap_or(f64::NAN)
}

/// The second of two numbers where the first has a value, on straight lines between points.
pub(super) fn between(points: &[[f64; 2]], value: f64) -> Option<f64> {
    let [[a, b], [c, d]] = points.windows(2).find_map(|pair| match pair {
        [from, to] if from[0] <= value && value <= to[0] && from[0] < to[0] => Some([*from, *to]),
        _ => None,
    })?;
    Some(b + (d - b) * (value - a) / (c - a))
}

/// A long column of a Bingham fluid whose gate vanishes.
pub(super) fn dam_break_bingham(context: &Context) -> anyhow::Result<Vec<Check>> {
    let (coarse, fine) = rayon::join(|| run_out(context, 1.0), || run_out(context, 0.5));
    Ok([coarse?, fine?].concat())
}

/// The case in cells `coarser` times as large.
fn run_out(context: &Context, coarser: f64) -> anyhow::Result<Vec<Check>> {
    /// From here on how the column was let go does not matter any more.
    const FROM: f64 = 0.23;
    let mut case = context.case("case.toml")?;
    let size = coarser * case.method.resolution();
    case.method.set_resolution(size);
    case.domain.max.y *= coarser;
    let gate = case.fluid[0].shape.bounds().1.x;
    let mut flow = Flow::new(case);
    let mut checks = Vec::new();
    for (row, paper) in context.reference()?.iter().zip(context.table("paper.csv")?) {
        let time = row["t_s"];
        flow.until(time)?;
        let what = format!("front at {time} s, cells of {} mm", 1e3 * size);
        let front = front(&flow.cells()) - gate;
        let check = context.relative("front", what, "m", row["front_vof_nu0_10"], front)?;
        let judged = time >= FROM && coarser == 1.0;
        checks.push(if judged { check } else { Check { tolerance: None, ..check } });
        if coarser == 1.0 {
            checks.push(shown(format!("experiment at {time} s"), paper["x_exp"]));
            checks.push(shown(format!("the paper's at {time} s, nodes of 1 mm"), paper["x_1mm_1e-4"]));
        }
    }
    Ok(checks)
}

/// A block of Bingham fluid that stands.
pub(super) fn block_at_rest(context: &Context) -> anyhow::Result<Vec<Check>> {
    let (fine, coarse) = rayon::join(|| standing(context, 1.0), || standing(context, 2.0));
    Ok([fine?, coarse?].concat())
}

/// The case in cells `coarser` times as large.
fn standing(context: &Context, coarser: f64) -> anyhow::Result<Vec<Check>> {
    let mut case = context.case("case.toml")?;
    let size = coarser * case.method.resolution();
    case.method.set_resolution(size);
    case.domain.max.y *= coarser;
    let end = case.stop.time;
    let block = case.fluid[0].shape.bounds().1;
    let edge = (block.x / size).round() as usize - 1;
    let mut flow = Flow::new(case);
    let measures = |cells: &Cells| {
        let heights = heights(cells);
        [heights[0] * cells.size, heights[edge] * cells.size, front(cells)]
    };
    let start = measures(&flow.cells());
    flow.until(end)?;
    let now = measures(&flow.cells());
    ["height in the middle", "height at the edge", "width"]
        .into_iter()
        .zip(start.into_iter().zip(now))
        .map(|(what, (start, now))| {
            context.zero(
                "shape",
                format!("{what}: change over the height, cells of {} mm", 1e3 * size),
                "",
                (now - start).abs() / block.z,
            )
        })
        .collect()
}

/// Blocks of Bingham fluid that collapse and come to rest.
pub(super) fn collapse_planar_bingham(context: &Context) -> anyhow::Result<Vec<Check>> {
    let rows = context.reference()?;
    let runs: Vec<(f64, f64)> =
        [1.0, 2.0].into_iter().flat_map(|coarser| rows.iter().map(move |row| (row["B"], coarser))).collect();
    let runs: anyhow::Result<Vec<Vec<Check>>> =
        runs.par_iter().with_max_len(1).map(|(b, coarser)| block(context, *b, *coarser)).collect();
    Ok(runs?.concat())
}

/// The block of the yield stress `b` rho g H in cells `coarser` times as large as those of the case.
fn block(context: &Context, b: f64, coarser: f64) -> anyhow::Result<Vec<Check>> {
    let mut case = context.case("case.toml")?;
    let size = coarser * case.method.resolution();
    case.method.set_resolution(size);
    let side = case.fluid[0].shape.bounds().1.z;
    // The domain stays a whole number of cells.
    case.domain.max = (case.domain.max / size).ceil() * size;
    case.domain.max.y = size;
    let weight = case.material.density * -case.domain.gravity.z * side;
    case.material.curve = FlowCurve::Bingham {
        yield_stress: b * weight,
        plastic_viscosity: case.material.curve.plastic_viscosity(),
    };
    let mut flow = Flow::new(case);
    flow.until_rest(|_| {})?;
    let cells = flow.cells();
    let rows = context.reference()?;
    let row = rows.iter().find(|row| row["B"] == b).ok_or_else(|| anyhow!("reference.csv has no B {b}"))?;
    let what = |quantity: &str| format!("{quantity} over H, B {b}, {} cells", (side / size).round());
    let tolerance = format!("B {b}");
    let run_out = context.relative(&tolerance, what("run-out"), "", row["X"], front(&cells) / side)?;
    let top = context.relative(&tolerance, what("height"), "", row["h0"], height(&cells) / side)?;
    Ok(if coarser == 1.0 {
        vec![run_out, top]
    } else {
        [run_out, top].map(|check| Check { tolerance: None, ..check }).to_vec()
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use tremie_numerics::DVec3;

    #[test]
    fn a_front_is_found_between_columns() {
        let (size, count) = (0.1, [4, 1, 2]);
        // Columns of 2, 1.5, 1 and 0.2 cells.
        let fill = vec![1.0, 1.0, 1.0, 0.2, 1.0, 0.5, 0.0, 0.0];
        let cells = Cells { size, count, fill, origin: DVec3::ZERO, ..Cells::default() };
        // Between the centres at 0.25 (1) and 0.35 (0.2).
        assert!((front(&cells) - (0.25 + 0.1 * 0.5 / 0.8)).abs() < 1e-12);
        assert!((height(&cells) - 0.2).abs() < 1e-12);
    }

    #[test]
    fn a_front_passes_places_between_its_readings() {
        let path = [[0.0, 1.0], [1.0, 1.5], [2.0, 3.5]];
        assert_eq!([1.25, 2.5, 9.0].map(|place| passes(&path, place)), [Some(0.5), Some(1.5), None]);
        assert_eq!([0.5, 1.5].map(|time| at(&path, time)), [1.25, 2.5]);
    }
}
