//! Samples squeezed between plates: closed forms of lubrication and plasticity, and both methods on one case.
//!
//! All are in a plane, one cell deep, and half of the sample beside a plane of symmetry. Forces are on the whole and per metre of depth. A lattice has a staircase for a moving wall: its gap closes a cell
//! at a time, each closing sends sound through the sample, and only over the passage of a cell is its gap the right one. So forces at constant speeds are told from readings over the passage of one or several, by all methods.

use anyhow::anyhow;
use tremie_case::{
    Case, Isph, Ldd, LddCoupling, LddLaplacian, LddScheme, Method, PressureStep, Scheme, StrainConvention,
    StressStep,
};
use tremie_geometry::{Body, Motion, Shape};
use tremie_rheology::FlowCurve;
use tremie_simulation::Snapshot;
use tremie_simulation::gauges::Gauges;

use super::benchmark::{Check, Context, Row};
use super::flow::Flow;
use crate::calc::{Bingham, squeezed_in_a_plane};

/// The methods that move plates.
const METHODS: [&str; 2] = ["lbm", "isph"];
/// The methods that are held against finite elements where they move evenly.
const EVENLY: [&str; 3] = ["lbm", "isph", "ldd"];
/// The methods that move them under a load.
const LOADED: [&str; 3] = ["lbm", "isph", "sph"];
/// Cells or particles over the height; and where plates close evenly.
const OVER: [usize; 2] = [20, 10];
const OVER_EVENLY: [usize; 2] = [40, 20];
/// The same of samples that hardly yield: layers of a particle or two bear the load.
const OVER_BINGHAM: [usize; 3] = [40, 20, 10];
/// Readings during the passage of a cell.
const READINGS: f64 = 20.0;
/// Way over H along which forces at constant speeds are read, as those of the finite elements are.
const ALONG: f64 = 0.1;

/// A sample of a half width and a height in m, cut into so many cells over its height.
struct Sample {
    case: Case,
    half_width: f64,
    height: f64,
    size: f64,
}

impl Sample {
    /// The one of a case; with other cells it is as deep as one of them, and its load as large by depth.
    fn new(case: &Case, method: &str, over: usize) -> Self {
        let mut case = case.clone();
        let (_, high) = case.fluid[0].shape.bounds();
        let size = high.z / over as f64;
        let deep = case.domain.max.y;
        let whole = |length: f64| (length / size - 1e-9).ceil() * size;
        case.domain.max.x = whole(case.domain.max.x);
        case.domain.max.z = whole(case.domain.max.z).max(high.z + 2.0 * size);
        case.domain.max.y = size;
        if let Some(load) = &mut case.solids[0].load {
            load.force *= size / deep;
        }
        match method {
            "isph" | "sph" => {
                let scheme = match method {
                    "sph" => Scheme::ThreeStep(PressureStep::Solve),
                    _ => Scheme::Projection,
                };
                case.method = Method::Isph(Isph {
                    spacing: size,
                    courant: 0.25,
                    stress: StressStep::Implicit,
                    strain_convention: StrainConvention::Standard,
                    largest_viscosity: None,
                    time_step: None,
                    scheme,
                });
            }
            "ldd" => {
                case.method = Method::Ldd(Ldd {
                    spacing: size,
                    courant: 0.3,
                    time_step: None,
                    coupling: LddCoupling::Incremental,
                    scheme: LddScheme::Lagged,
                    laplacian: LddLaplacian::Exact,
                    largest_viscosity: None,
                });
            }
            _ => case.method.set_resolution(size),
        }
        Self { case, half_width: high.x, height: high.z, size }
    }

    /// The fluid that it is, as Bingham has it.
    fn fluid(&self) -> Bingham {
        let curve = &self.case.material.curve;
        Bingham { yield_stress: curve.yield_stress(), viscosity: curve.plastic_viscosity() }
    }

    /// Gives it another yield stress in Pa.
    fn stiffened(mut self, yield_stress: f64) -> Self {
        let plastic_viscosity = self.case.material.curve.plastic_viscosity();
        self.case.material.curve = match yield_stress {
            0.0 => FlowCurve::Newtonian { viscosity: plastic_viscosity },
            _ => FlowCurve::Bingham { yield_stress, plastic_viscosity },
        };
        self
    }

    /// Forces in N/m on the upper plate and on the lower, and the volume over that at the start.
    fn read(&self, snapshot: &Snapshot) -> [f64; 3] {
        // Gauges count what lies behind the plane of symmetry, too; forces do not.
        let depth = 2.0 / self.size;
        let volume = Gauges::new(&self.case).measure(snapshot).volume;
        [
            depth * snapshot.solids[0].force.z,
            -depth * snapshot.walls.sides[4].force.z,
            volume / (2.0 * self.half_width * self.height * self.size),
        ]
    }
}

/// Forces in N/m on the upper plate and the lower, and the volume over that at the start, when the plate passes heights in m: the middle of what is read along a way of so many cells, by the weight of each
/// reading, of which the place on that way is told from -1/2 to 1/2.
fn closing(
    sample: &Sample,
    heights: &[f64],
    cells: f64,
    weight: impl Fn(f64) -> f64,
) -> anyhow::Result<Vec<[f64; 3]>> {
    let Motion::Uniform(velocity) = sample.case.solids[0].motion else {
        anyhow::bail!("the plate has no even motion")
    };
    let mut flow = Flow::new(sample.case.clone());
    let readings = (cells * READINGS).round();
    let places = (0..readings as u32).map(|n| (f64::from(n) + 0.5) / readings - 0.5);
    let read = |height: &f64| {
        let mut middle = [0.0; 3];
        for place in places.clone() {
            flow.until((sample.height - height + place * cells * sample.size) / velocity.length())?;
            let read = sample.read(&flow.simulation.snapshot());
            middle.iter_mut().zip(read).for_each(|(sum, read)| *sum += weight(place) * read / readings);
        }
        Ok(middle)
    };
    heights.iter().map(read).collect()
}

/// The middle of a parabola by least squares, as the reference is read.
fn parabola(place: f64) -> f64 {
    2.25 - 15.0 * place * place
}

/// How far the lower plate's force is from the upper one's, over that.
fn off_balance([upper, lower]: [f64; 2]) -> f64 {
    (lower / upper - 1.0).abs()
}

/// The heights in m of a plate under a load at times in s, and how far forces and volume are from balanced and kept.
fn loaded(sample: &Sample, times: &[f64]) -> anyhow::Result<(Vec<f64>, [f64; 2])> {
    let mut flow = Flow::new(sample.case.clone());
    let (mut heights, mut off) = (Vec::new(), [0.0f64; 2]);
    for time in times {
        flow.until(*time)?;
        let snapshot = flow.simulation.snapshot();
        let height = sample.height + snapshot.moved[0].z;
        let [upper, lower, volume] = sample.read(&snapshot);
        heights.push(height);
        off = [off[0].max(off_balance([upper, lower])), off[1].max((volume - 1.0).abs())];
    }
    Ok((heights, off))
}

/// What must hold besides.
fn kept(context: &Context, what: &str, [balance, volume]: [f64; 2]) -> anyhow::Result<[Check; 2]> {
    Ok([
        context.zero(
            "balance",
            format!("force of the lower plate over that of the upper, less 1, {what}"),
            "",
            balance,
        )?,
        context.zero("volume", format!("volume over that at the start, less 1, {what}"), "", volume)?,
    ])
}

/// A tolerance counts for the finest cells only.
fn judged(check: Check, over: usize) -> Check {
    finest(check, over == OVER[0])
}

fn finest(check: Check, finest: bool) -> Check {
    if finest { check } else { Check { tolerance: None, ..check } }
}

/// Plates that close on a thin gap.
pub(super) fn thin_gap(context: &Context) -> anyhow::Result<Vec<Check>> {
    let case = context.case("case.toml")?;
    let mut checks = Vec::new();
    for method in METHODS {
        for over in OVER {
            for bingham in [0.0, 1.0, 10.0] {
                let mut sample = Sample::new(&case, method, over);
                let Motion::Uniform(velocity) = sample.case.solids[0].motion else {
                    anyhow::bail!("the plate has no even motion")
                };
                let (gap, speed) = (sample.height, velocity.length());
                let viscosity = sample.fluid().viscosity;
                sample = sample.stiffened(bingham * viscosity * speed / gap);
                // A cell higher at first, and as much narrower.
                sample.height += sample.size;
                sample.half_width *= gap / sample.height;
                let [width, height] = [sample.half_width, sample.height];
                if let Shape::Box { max, .. } = &mut sample.case.fluid[0].shape {
                    (max.x, max.z) = (width, height);
                }
                if let Body::Shape(Shape::Box { min, .. }) = &mut sample.case.solids[0].body {
                    min.z = height;
                }
                sample.case.domain.max.z = height + 2.0 * sample.size;
                if let Method::Isph(isph) = &mut sample.case.method {
                    isph.time_step = Some(0.1 * case.material.density * gap * gap / viscosity);
                }
                let [upper, lower, volume] = closing(&sample, &[gap], 1.0, |_| 1.0)?[0];
                let off = [off_balance([upper, lower]), (volume - 1.0).abs()];
                let length = width * height / gap;
                let exact = squeezed_in_a_plane(sample.fluid(), length, gap, speed);
                let what = format!("{method}, Bingham number {bingham}, {over} over the gap");
                let check = context.relative("force", format!("force, {what}"), "N/m", exact, upper)?;
                checks.push(judged(check, over));
                checks.extend(kept(context, &what, off)?.map(|check| judged(check, over)));
            }
        }
    }
    Ok(checks)
}

/// A Newtonian sample under a load.
pub(super) fn newtonian(context: &Context) -> anyhow::Result<Vec<Check>> {
    const TIMES: [f64; 3] = [10.0, 20.0, 50.0];
    let case = context.case("case.toml")?;
    let mut checks = Vec::new();
    for method in LOADED {
        for over in OVER {
            for wide in [1.0, 2.0] {
                let mut sample = Sample::new(&case, method, over);
                sample.half_width *= wide;
                if let Shape::Box { max, .. } = &mut sample.case.fluid[0].shape {
                    max.x = sample.half_width;
                }
                let (height, viscosity) = (sample.height, sample.fluid().viscosity);
                let force = sample.case.solids[0].load.map_or(0.0, |load| load.force.length()) / sample.size;
                let (heights, off) = loaded(&sample, &TIMES)?;
                let spread = 8.0 * viscosity * (sample.half_width * height).powi(3);
                let what = format!("{method}, a0/H {}, {over} over the height", sample.half_width / height);
                for (time, found) in TIMES.iter().zip(&heights) {
                    let exact = (height.powi(-5) + 5.0 * force * time / spread).powf(-0.2);
                    let name = format!("height over H after {time} s, {what}");
                    let check = context.relative("height", name, "", exact / height, found / height)?;
                    // The theory is one for late times.
                    checks.push(if *time < 50.0 {
                        Check { tolerance: None, ..check }
                    } else {
                        judged(check, over)
                    });
                }
                let slope = (heights[2] / heights[1]).ln() / (TIMES[2] / TIMES[1]).ln();
                checks.push(judged(
                    context.absolute("slope", format!("slope, {what}"), "", -0.2, slope)?,
                    over,
                ));
                checks.extend(kept(context, &what, off)?.map(|check| judged(check, over)));
            }
        }
    }
    Ok(checks)
}

/// Height over H at which a plastic block of a half width, with sides that stay even, comes to rest under a load in viscous units.
fn at_rest(half_width: f64, bingham: f64, load: f64) -> f64 {
    let force = |h: f64| {
        let length = half_width / h;
        2.0 * bingham * length * length / h * (1.0 + 1.5 * h / length)
    };
    let (mut low, mut high) = (1e-3, 1.0);
    if force(high) > load {
        return 1.0;
    }
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if force(middle) > load { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}

/// The row of a reference that has these values.
fn row_with<'a>(rows: &'a [Row], values: &[(&str, f64)]) -> anyhow::Result<&'a Row> {
    let has = |row: &&Row| values.iter().all(|(name, value)| (row[*name] - value).abs() < 1e-9);
    rows.iter().find(has).ok_or_else(|| anyhow!("reference.csv has no row with {values:?}"))
}

/// Bingham samples under loads.
pub(super) fn load(context: &Context) -> anyhow::Result<Vec<Check>> {
    const TIME: f64 = 20.0;
    let case = context.case("case.toml")?;
    let unit = case.material.curve.yield_stress();
    let rows = context.reference()?;
    let mut checks = Vec::new();
    for over in OVER_BINGHAM {
        let judged = |check| finest(check, over == OVER_BINGHAM[0]);
        let mut all = Vec::new();
        for method in METHODS {
            let mut found = Vec::new();
            for (bingham, load) in [(1.0, 10.0), (4.0, 10.0), (5.0, 10.0), (1.0, 5.0), (1.0, 20.0)] {
                let mut sample = Sample::new(&case, method, over).stiffened(bingham * unit);
                if let Some(of) = &mut sample.case.solids[0].load {
                    of.force *= load / 10.0;
                }
                let (heights, off) = loaded(&sample, &[TIME])?;
                let height = heights[0] / sample.height;
                found.push(height);
                let what = format!("{method}, Bingham number {bingham}, load {load}, {over} over the height");
                let name = format!("height over H, {what}");
                if bingham == 5.0 {
                    checks.push(judged(context.at_least("creeps", name, height)?));
                } else {
                    let even = at_rest(sample.half_width / sample.height, bingham, load);
                    let elements = row_with(
                        &rows,
                        &[
                            ("bn", bingham),
                            ("load", load),
                            ("half_width_over_H", 0.5),
                            ("time_U_over_H", TIME),
                        ],
                    )?["height_over_H"];
                    for (against, reference) in [("even sides", even), ("finite elements", elements)] {
                        let name = format!("{name}, {against}");
                        checks.push(judged(context.relative("height", name, "", reference, height)?));
                    }
                }
                checks.extend(kept(context, &what, off)?.map(judged));
            }
            let ordered =
                found[0] < found[1] && found[1] < found[2] && found[4] < found[0] && found[0] < found[3];
            let name = format!(
                "heights in the order of Bingham numbers and loads, {method}, {over} over the height"
            );
            checks.push(context.at_least("ordered", name, f64::from(u8::from(ordered)))?);
            all.push(found);
        }
        for n in 0..2 {
            let name = format!(
                "height over H by particles, of that by the lattice, Bingham number {}, {over} over the height",
                [1, 4][n]
            );
            checks.push(judged(context.relative("methods", name, "", all[0][n], all[1][n])?));
        }
    }
    Ok(checks)
}

/// Plates that close evenly.
pub(super) fn velocity(context: &Context) -> anyhow::Result<Vec<Check>> {
    const SHARES: [f64; 3] = [0.8, 0.6, 0.4];
    let (case, rows) = (context.case("case.toml")?, context.reference()?);
    let mut checks = Vec::new();
    for over in OVER_EVENLY {
        for (reynolds, bingham) in [(1.0, 0.5), (5.0, 0.5), (10.0, 0.5), (10.0, 1.0), (10.0, 5.0)] {
            let mut all = Vec::new();
            for method in EVENLY {
                let mut sample = Sample::new(&case, method, over);
                let speed = 0.1;
                let viscosity = sample.case.material.density * speed * sample.height / reynolds;
                sample.case.material.curve = FlowCurve::Bingham {
                    yield_stress: bingham * viscosity * speed / sample.height,
                    plastic_viscosity: viscosity,
                };
                let heights = SHARES.map(|share| share * sample.height);
                let read = closing(&sample, &heights, ALONG * sample.height / sample.size, parabola)?;
                let unit = viscosity * speed;
                let forces: Vec<[f64; 2]> =
                    read.iter().map(|[upper, lower, _]| [upper / unit, lower / unit]).collect();
                let what =
                    format!("{method}, Re {reynolds}, Bingham number {bingham}, {over} over the height");
                let rises = forces.is_sorted_by_key(|[upper, _]| *upper);
                checks.push(context.at_least(
                    "rises",
                    format!("force rises, {what}"),
                    f64::from(u8::from(rises)),
                )?);
                let mut off = [0.0f64; 2];
                for ((height, found), [.., volume]) in SHARES.iter().zip(&forces).zip(&read) {
                    let row =
                        row_with(&rows, &[("re", reynolds), ("bn", bingham), ("height_over_H", *height)])?;
                    let exact = ["force_upper_over_muU", "force_lower_over_muU"].map(|column| row[column]);
                    off[1] = off[1].max((volume - 1.0).abs());
                    // While the fluid is still being set in motion its plates are not in balance.
                    if off_balance(exact) < context.tolerance("balance")? {
                        off[0] = off[0].max(off_balance(*found));
                    }
                    for (plate, (exact, found)) in ["upper", "lower"].iter().zip(exact.iter().zip(found)) {
                        let name = format!("force over mu U on the {plate} plate at {height} H, {what}");
                        let check = context.relative("force", name, "", *exact, *found)?;
                        checks.push(finest(check, over == OVER_EVENLY[0]));
                    }
                }
                checks.extend(kept(context, &what, off)?.map(|check| finest(check, over == OVER_EVENLY[0])));
                all.push(forces);
            }
            for (method, found) in EVENLY.iter().zip(&all).skip(1) {
                for (n, height) in SHARES.iter().enumerate() {
                    let name = format!(
                        "force over mu U at {height} H by {method}, of that by the lattice, Re {reynolds}, Bingham number {bingham}, {over} over the height"
                    );
                    let check = context.relative("methods", name, "", all[0][n][0], found[n][0])?;
                    checks.push(finest(check, over == OVER_EVENLY[0]));
                }
            }
        }
    }
    Ok(checks)
}
