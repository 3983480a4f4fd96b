//! Steady shear flows between parallel planes, against their closed forms.
//!
//! All are periodic along x and y, one cell thick along y, and have their planes across z. They start from rest or from
//! a uniform velocity and run until they are steady.

use rayon::prelude::*;
use tremie_case::{Case, Side};
use tremie_numerics::DVec3;
use tremie_rheology::FlowCurve;
use tremie_simulation::Cells;

use super::benchmark::{Check, Context, observed_order, shown};
use super::flow::Flow;
use super::profile::Model;

/// Share of the largest velocity by which a flow may still change in one diffusion time when it counts as steady: far
/// below the tolerance of each benchmark.
const STEADY: f64 = 1e-9;
pub(super) const NEARLY_STEADY: f64 = 1e-7;

/// Share of the shear rate at the wall up to which a cell belongs to the plug: a plug does not shear at all.
const PLUG: f64 = 0.0;

/// Cells across.
pub(super) const CELLS: [usize; 3] = [16, 32, 64];

/// Height in m between the planes.
pub(super) fn gap(case: &Case) -> f64 {
    case.domain.max.z - case.domain.min.z
}

/// Time in s in which momentum diffuses across `height` m: the slowest mode decays by e in pi^2 times less.
pub(super) fn diffusion_time(case: &Case, height: f64) -> f64 {
    height * height * case.material.density / case.material.curve.plastic_viscosity()
}

/// Makes the domain 8 x 1 x `cells` cells of the size `size` in m.
pub(super) fn set_cells(case: &mut Case, size: f64, cells: usize) {
    case.method.set_resolution(size);
    case.domain.max = case.domain.min + size * DVec3::new(8.0, 1.0, cells as f64);
}

/// Height z in m, fill, velocity along x in m/s, shear rate in 1/s and stress in Pa of the cells of one column.
pub(super) struct Level {
    pub(super) z: f64,
    fill: f64,
    pub(super) u: f64,
    rate: f64,
    stress: f64,
}

pub(super) fn column(cells: &Cells) -> Vec<Level> {
    column_at(cells, 0)
}

/// The column of the cells number `i` along x.
fn column_at(cells: &Cells, i: usize) -> Vec<Level> {
    (0..cells.count[2])
        .map(|k| {
            let n = cells.index(i, 0, k);
            Level {
                z: cells.centre(0, 0, k).z,
                fill: cells.fill[n],
                u: cells.velocity[n].x,
                rate: cells.shear_rate[n],
                stress: cells.stress[n],
            }
        })
        .collect()
}

/// Norm of the difference between the velocities of a column and `exact(z)`, over the norm of the latter.
pub(super) fn l2_error(column: &[Level], exact: impl Fn(f64) -> f64) -> f64 {
    let square = |f: &dyn Fn(&Level) -> f64| column.iter().map(|level| f(level).powi(2)).sum::<f64>();
    (square(&|level| level.u - exact(level.z)) / square(&|level| exact(level.z))).sqrt()
}

fn largest_error(column: &[Level], exact: impl Fn(f64) -> f64) -> f64 {
    let largest = |f: &dyn Fn(&Level) -> f64| column.iter().map(|level| f(level).abs()).fold(0.0, f64::max);
    largest(&|level| level.u - exact(level.z)) / largest(&|level| exact(level.z))
}

/// The flow of a channel that a body force drives along x (Bird, Dai and Yarusso 1983, Eq. 5.1-5.3, for the Bingham
/// fluid).
pub(super) struct Poiseuille {
    /// Half the gap in m.
    pub(super) half_gap: f64,
    /// Shear stress at the walls in Pa.
    pub(super) wall_stress: f64,
    yield_stress: f64,
    viscosity: f64,
}

impl Poiseuille {
    pub(super) fn of(case: &Case) -> Self {
        let half_gap = 0.5 * gap(case);
        Self {
            half_gap,
            wall_stress: case.material.density * case.domain.gravity.x * half_gap,
            yield_stress: case.material.curve.yield_stress(),
            viscosity: case.material.curve.plastic_viscosity(),
        }
    }

    /// Share of the gap that the plug takes.
    pub(super) fn plug(&self) -> f64 {
        self.yield_stress / self.wall_stress
    }

    /// Velocity in m/s at the share `eta` of the half gap from the middle.
    fn velocity(&self, eta: f64) -> f64 {
        let (eta, phi) = (eta.abs().max(self.plug()), self.plug());
        let parabola = 0.5 * (1.0 - eta * eta) - phi * (1.0 - eta);
        self.wall_stress * self.half_gap / self.viscosity * parabola
    }

    /// Velocity in m/s at the height `z` m above the middle of a channel whose lower wall is at zero.
    pub(super) fn at(&self, z: f64) -> f64 {
        self.velocity(z / self.half_gap - 1.0)
    }
}

/// Runs a channel at all resolutions; gives the columns of cells.
fn channels(
    context: &Context,
    curve: Option<FlowCurve>,
    change: f64,
) -> anyhow::Result<Vec<(Case, Vec<Level>)>> {
    CELLS
        .par_iter()
        .map(|cells| {
            let mut case = context.case("case.toml")?;
            let case_gap = gap(&case);
            set_cells(&mut case, case_gap / *cells as f64, *cells);
            if let Some(curve) = curve {
                case.material.curve = curve;
            }
            let steady =
                Flow::new(case.clone()).until_steady(diffusion_time(&case, 0.5 * case_gap), change)?;
            Ok((case, column(&steady)))
        })
        .collect()
}

/// Plane channel of a Newtonian fluid: the half-way wall is exact.
pub(super) fn channel_newtonian(context: &Context) -> anyhow::Result<Vec<Check>> {
    let runs = channels(context, None, STEADY)?;
    runs.iter()
        .zip(CELLS)
        .map(|((case, column), cells)| {
            let exact = Poiseuille::of(case);
            let error = largest_error(column, |z| exact.at(z));
            context.zero("velocity", format!("velocity, {cells} cells"), "", error)
        })
        .collect()
}

/// Plane channel of a Bingham fluid whose plug takes a fifth and half of the gap.
pub(super) fn channel_bingham(context: &Context) -> anyhow::Result<Vec<Check>> {
    let case = context.case("case.toml")?;
    let wall_stress = Poiseuille::of(&case).wall_stress;
    let plastic_viscosity = case.material.curve.plastic_viscosity();
    let mut checks = Vec::new();
    for phi in [0.2, 0.5] {
        let curve = FlowCurve::Bingham { yield_stress: phi * wall_stress, plastic_viscosity };
        let exact = Poiseuille { yield_stress: phi * wall_stress, ..Poiseuille::of(&case) };
        checks.extend(channel(context, &format!("plug {phi}"), curve, phi, |z| exact.at(z))?);
    }
    Ok(checks)
}

/// Plane channel of the fluid `name` that flows by `curve`, whose plug takes the share `phi` of the gap, and whose velocity at
/// the height z is `exact(z)`.
fn channel(
    context: &Context,
    name: &str,
    curve: FlowCurve,
    phi: f64,
    exact: impl Fn(f64) -> f64,
) -> anyhow::Result<Vec<Check>> {
    let runs = channels(context, Some(curve), NEARLY_STEADY)?;
    let (mut checks, mut errors) = (Vec::new(), Vec::new());
    for ((case, column), cells) in runs.iter().zip(CELLS) {
        let error = l2_error(column, &exact);
        let velocity = format!("velocity, {name}, {cells} cells (L2)");
        checks.push(if cells == 32 {
            context.zero("profile", velocity, "", error)?
        } else {
            shown(velocity, error)
        });
        errors.push(error);
        if phi > 0.0 {
            let wall_rate = curve.shear_rate(Poiseuille::of(case).wall_stress);
            let plug = || column.iter().filter(|level| level.rate <= PLUG * wall_rate);
            let width = format!("plug width, {name}, {cells} cells");
            let reference = phi * cells as f64;
            checks.push(context.absolute("plug width", width, "cells", reference, plug().count() as f64)?);
            let creep = plug().map(|level| level.rate).fold(0.0, f64::max) / wall_rate;
            checks.push(shown(format!("largest rate in {name} over that at the wall, {cells} cells"), creep));
        }
    }
    let order = observed_order(&CELLS, &errors);
    checks.push(context.at_least("order", format!("order, {name}"), order)?);
    Ok(checks)
}

/// The same for a model with a reference profile; the case gives the channel.
fn channel_of(context: &Context, name: &str, model: Model, phi: f64) -> anyhow::Result<Vec<Check>> {
    let Poiseuille { half_gap, wall_stress, .. } = Poiseuille::of(&context.case("case.toml")?);
    channel(context, name, model.curve(), phi, |z| model.velocity(half_gap, wall_stress, z / half_gap - 1.0))
}

/// Consistency in Pa s^n, or viscosity in Pa s, of the fluids in these channels.
const CONSISTENCY: f64 = 20.0;

/// Plane channel of a Herschel-Bulkley fluid that thins and one that thickens.
pub(super) fn channel_herschel_bulkley(context: &Context) -> anyhow::Result<Vec<Check>> {
    let phi = 0.3;
    let yield_stress = phi * Poiseuille::of(&context.case("case.toml")?).wall_stress;
    let of = |index: f64| {
        let model = Model::HerschelBulkley { yield_stress, consistency: CONSISTENCY, index };
        channel_of(context, &format!("index {index}"), model, phi)
    };
    Ok([of(0.5)?, of(1.5)?].concat())
}

/// Plane channel of a Casson fluid whose plug takes a tenth and 0.3 of the gap.
pub(super) fn channel_casson(context: &Context) -> anyhow::Result<Vec<Check>> {
    let wall_stress = Poiseuille::of(&context.case("case.toml")?).wall_stress;
    let of = |phi: f64| {
        let model = Model::Casson { yield_stress: phi * wall_stress, viscosity: CONSISTENCY };
        channel_of(context, &format!("plug {phi}"), model, phi)
    };
    Ok([of(0.1)?, of(0.3)?].concat())
}

/// Plane channel of a power law that thins and one that thickens.
pub(super) fn channel_power_law(context: &Context) -> anyhow::Result<Vec<Check>> {
    let of = |index: f64| {
        let model = Model::HerschelBulkley { yield_stress: 0.0, consistency: CONSISTENCY, index };
        channel_of(context, &format!("index {index}"), model, 0.0)
    };
    Ok([of(0.5)?, of(1.5)?].concat())
}

/// Plane channel of a Cross fluid that is nearly rigid up to 0.3 of the stress at the walls.
pub(super) fn channel_cross(context: &Context) -> anyhow::Result<Vec<Check>> {
    let wall_stress = Poiseuille::of(&context.case("case.toml")?).wall_stress;
    let zero = 1000.0 * CONSISTENCY;
    let model = Model::Cross { zero, infinite: CONSISTENCY, time: zero / (0.3 * wall_stress), index: 1.0 };
    channel_of(context, "Cross", model, 0.0)
}

/// Plane channel of a Carreau fluid.
pub(super) fn channel_carreau(context: &Context) -> anyhow::Result<Vec<Check>> {
    let model = Model::CarreauYasuda { zero: 40.0, infinite: 2.0, time: 2.0, index: 0.4, a: 2.0 };
    channel_of(context, "Carreau", model, 0.0)
}

/// Plane shear of a Bingham fluid between a wall at rest and a moving one.
pub(super) fn couette_bingham(context: &Context) -> anyhow::Result<Vec<Check>> {
    let mut checks = Vec::new();
    for ((case, column), cells) in channels(context, None, NEARLY_STEADY)?.iter().zip(CELLS) {
        let Side::Wall { velocity, .. } = case.domain.sides[5] else {
            anyhow::bail!("the upper side must be a wall");
        };
        let rate = velocity.x / gap(case);
        let stress = case.material.curve.yield_stress() + case.material.curve.plastic_viscosity() * rate;
        let profile = largest_error(column, |z| rate * z);
        let furthest = |values: &dyn Fn(&Level) -> f64, from: f64| {
            column
                .iter()
                .map(values)
                .fold(from, |a, b| if (b - from).abs() > (a - from).abs() { b } else { a })
        };
        checks.push(context.zero("share", format!("velocity, {cells} cells"), "", profile)?);
        checks.push(context.relative(
            "share",
            format!("stress furthest off, {cells} cells"),
            "Pa",
            stress,
            furthest(&|level| level.stress, stress),
        )?);
        checks.push(context.relative(
            "share",
            format!("shear rate furthest off, {cells} cells"),
            "1/s",
            rate,
            furthest(&|level| level.rate, rate),
        )?);
        // Continued by half a cell, the profile reaches the wall.
        if let [.., below, last] = column.as_slice() {
            let wall = last.u + 0.5 * (last.u - below.u);
            let name = format!("velocity at the moving wall, {cells} cells");
            checks.push(context.relative("share", name, "m/s", velocity.x, wall)?);
        }
    }
    Ok(checks)
}

/// The flow of a Bingham fluid that a lid drags along a closed box, far from its ends.
///
/// The stress grows from floor to lid by the pressure gradient, `tau = gradient (z - floor - plug/2)` with the layer `floor`
/// that flows back over the floor and the plug `plug = 2 tau_y / gradient` above it, so that
///
/// ```text
///     u = -gradient/(2 mu) (floor^2 - (floor - z)^2)                   below the plug, and at its speed up to its top
///     u = -gradient/(2 mu) (floor^2 - (z - floor - plug)^2)            above it
/// ```
///
/// The lid's speed gives the gradient, and no flow through the section gives the layer.
struct Return {
    /// Height in m of the layer that shears at the floor.
    floor: f64,
    /// Height in m of the plug.
    plug: f64,
    /// Pressure gradient over twice the plastic viscosity, in 1/(m s).
    curvature: f64,
}

impl Return {
    fn of(case: &Case, lid: f64) -> Self {
        let FlowCurve::Bingham { yield_stress, plastic_viscosity } = case.material.curve else {
            return Self { floor: f64::NAN, plug: f64::NAN, curvature: f64::NAN };
        };
        let height = gap(case);
        let with_floor = |floor: f64| {
            let plug = |curvature: f64| yield_stress / (plastic_viscosity * curvature);
            let of = |curvature: f64| Self { floor, plug: plug(curvature), curvature };
            // The layer under the lid has some height.
            let least = yield_stress / (plastic_viscosity * (height - floor));
            let most = least + 1e3 * lid / (height * height);
            of(bisection(least, most, |curvature| of(curvature).velocity(height) - lid))
        };
        with_floor(bisection(0.0, height / 3.0, |floor| -with_floor(floor).flow(height)))
    }

    /// Velocity in m/s at the height z in m.
    fn velocity(&self, z: f64) -> f64 {
        let below = (self.floor - z).max(0.0);
        let above = (z - self.floor - self.plug).max(0.0);
        self.curvature * (below * below + above * above - self.floor * self.floor)
    }

    /// Flow in m2/s through the section of the given height.
    fn flow(&self, height: f64) -> f64 {
        let above = height - self.floor - self.plug;
        let cubes = (self.floor.powi(3) + above.powi(3)) / 3.0;
        self.curvature * (cubes - self.floor * self.floor * height)
    }
}

/// Where a function that grows from below zero to above it between two places is zero.
fn bisection(mut low: f64, mut high: f64, f: impl Fn(f64) -> f64) -> f64 {
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        if f(middle) < 0.0 { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}

/// Return flow of a Bingham fluid in a closed box under a moving lid.
pub(super) fn couette_return(context: &Context) -> anyhow::Result<Vec<Check>> {
    const CELLS: [usize; 3] = [8, 16, 32];
    const BINGHAM_NUMBERS: [f64; 2] = [0.5, 5.0];
    // In times of diffusion; a long plug goes on quivering by 5e-5 of the lid's speed.
    const SETTLED: f64 = 5.0;
    let runs: Vec<(f64, usize)> =
        BINGHAM_NUMBERS.into_iter().flat_map(|number| CELLS.map(|cells| (number, cells))).collect();
    // The longest first.
    let columns: anyhow::Result<Vec<(Return, Vec<Level>)>> = runs
        .par_iter()
        .rev()
        .with_max_len(1)
        .map(|(number, cells)| {
            let mut case = context.case("case.toml")?;
            let Side::Wall { velocity, .. } = case.domain.sides[5] else {
                anyhow::bail!("the upper side must be a wall");
            };
            let size = gap(&case) / *cells as f64;
            case.method.set_resolution(size);
            case.domain.max.y = case.domain.min.y + size;
            let plastic_viscosity = case.material.curve.plastic_viscosity();
            let yield_stress = number * plastic_viscosity * velocity.x / gap(&case);
            case.material.curve = FlowCurve::Bingham { yield_stress, plastic_viscosity };
            let exact = Return::of(&case, velocity.x);
            let time = SETTLED * diffusion_time(&case, gap(&case));
            let mut flow = Flow::new(case);
            flow.until(time)?;
            let now = flow.cells();
            Ok((exact, column_at(&now, now.count[0] / 2)))
        })
        .collect();
    let (mut checks, mut errors) = (Vec::new(), Vec::new());
    for ((exact, column), (number, cells)) in columns?.iter().rev().zip(&runs) {
        let error = l2_error(column, |z| exact.velocity(z));
        let name = format!("Bi {number}, {cells} cells");
        let back = column.iter().map(|level| level.u).fold(0.0, f64::min);
        let plug = exact.velocity(exact.floor);
        let judged = |check: Check| if *cells == 32 { check } else { Check { tolerance: None, ..check } };
        checks.push(judged(context.zero("profile", format!("velocity, {name} (L2)"), "", error)?));
        checks.push(judged(context.relative("plug", format!("plug, {name}"), "m/s", plug, back)?));
        errors.push(error);
    }
    for (number, errors) in BINGHAM_NUMBERS.iter().zip(errors.chunks(CELLS.len())) {
        let order = observed_order(&CELLS, errors);
        checks.push(context.at_least("order", format!("order, Bi {number}"), order)?);
    }
    Ok(checks)
}

/// Films down an incline, of thicknesses that are no whole number of cells.
pub(super) fn film_newtonian(context: &Context) -> anyhow::Result<Vec<Check>> {
    const THICKNESS: [f64; 6] = [16.3, 16.5, 16.8, 32.3, 32.5, 32.8];
    let runs: anyhow::Result<Vec<Vec<Check>>> =
        THICKNESS.par_iter().map(|cells| film(context, *cells)).collect();
    Ok(runs?.concat())
}

/// A film of the case's thickness over `cells` cells.
fn film(context: &Context, cells: f64) -> anyhow::Result<Vec<Check>> {
    let mut case = context.case("case.toml")?;
    let thickness = case.fluid[0].shape.bounds().1.z;
    let size = thickness / cells;
    set_cells(&mut case, size, cells.ceil() as usize + 3);
    let driving = case.material.density * case.domain.gravity.x;
    let viscosity = case.material.curve.plastic_viscosity();
    // Momentum balance of the film: mu du/dz = rho g_x (h - z).
    let surface = 0.5 * driving * thickness * thickness / viscosity;
    let steady = Flow::new(case.clone()).until_steady(diffusion_time(&case, thickness), NEARLY_STEADY)?;
    let column: Vec<Level> = column(&steady).into_iter().filter(|level| level.fill > 0.0).collect();
    let volume: f64 = column.iter().map(|level| level.fill).sum();
    let mean = column.iter().map(|level| level.fill * level.u).sum::<f64>() / volume;
    let top = column.last().map_or(f64::NAN, |level| level.u);
    Ok(vec![
        context.relative("share", format!("surface speed, {cells} cells"), "m/s", surface, top)?,
        context.relative("share", format!("mean speed, {cells} cells"), "m/s", surface * 2.0 / 3.0, mean)?,
    ])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_closed_form_is_that_of_the_tables() {
        let benchmark = super::super::BENCHMARKS.iter().find(|b| b.id == "channel-bingham");
        let context = Context::new(benchmark.unwrap()).unwrap();
        let rows = context.reference().unwrap();
        assert!(rows.len() > 40);
        for row in rows {
            // In units of the half gap, the viscosity and the mean velocity.
            let (phi, eta) = (row["phi"], row["y_over_H"]);
            let wall_stress = 3.0 / (1.0 - 1.5 * phi + 0.5 * phi.powi(3));
            let exact =
                Poiseuille { half_gap: 1.0, wall_stress, yield_stress: phi * wall_stress, viscosity: 1.0 };
            assert!((exact.velocity(eta) - row["u_over_U"]).abs() < 1e-5, "{row:?}");
            assert!((exact.yield_stress - row["Bn"]).abs() < 1e-4, "{row:?}");
        }
    }

    #[test]
    fn a_return_flow_meets_its_conditions() {
        let benchmark = super::super::BENCHMARKS.iter().find(|b| b.id == "couette-return");
        let mut case = Context::new(benchmark.unwrap()).unwrap().case("case.toml").unwrap();
        let (height, lid, plastic_viscosity) = (gap(&case), 0.3, 20.0);
        for yield_stress in [0.0, 50.0, 1000.0] {
            case.material.curve = FlowCurve::Bingham { yield_stress, plastic_viscosity };
            let exact = Return::of(&case, lid);
            assert!((exact.velocity(height) - lid).abs() < 1e-9 && exact.velocity(0.0).abs() < 1e-9);
            let n = 20_000;
            let sum: f64 = (0..n).map(|k| exact.velocity((f64::from(k) + 0.5) / f64::from(n) * height)).sum();
            assert!((sum / f64::from(n)).abs() < 1e-6 * lid, "{sum}");
            // Without yield stress two parabolas: u = U (3 z^2/H^2 - 2 z/H).
            let parabola = lid * (3.0 * 0.25 - 1.0);
            assert!(yield_stress > 0.0 || (exact.velocity(0.5 * height) - parabola).abs() < 1e-9);
        }
    }

    #[test]
    fn profiles_are_those_of_the_tables() {
        let power_law = |index| Model::HerschelBulkley { yield_stress: 0.0, consistency: 1.0, index };
        let rigid = |index| Model::HerschelBulkley { yield_stress: 0.3, consistency: 1.0, index };
        let casson = |yield_stress| Model::Casson { yield_stress, viscosity: 1.0 };
        let cross = Model::Cross { zero: 1000.0, infinite: 1.0, time: 1000.0 / 0.3, index: 1.0 };
        for (id, name, model) in [
            ("channel-herschel-bulkley", "n0.5", rigid(0.5)),
            ("channel-herschel-bulkley", "n1.5", rigid(1.5)),
            ("channel-casson", "plug 0.1", casson(0.1)),
            ("channel-casson", "plug 0.3", casson(0.3)),
            ("channel-power-law", "n0.5", power_law(0.5)),
            ("channel-power-law", "n1.5", power_law(1.5)),
            ("channel-cross", "cross", cross),
        ] {
            let benchmark = super::super::BENCHMARKS.iter().find(|b| b.id == id);
            let rows = Context::new(benchmark.unwrap()).unwrap().reference().unwrap();
            assert!(rows.len() > 20);
            for row in rows {
                let error = model.velocity(1.0, 1.0, row["y"]) - row[name];
                assert!(error.abs() < 1e-6, "{id} {name} {row:?} {error:e}");
            }
        }
    }
}
