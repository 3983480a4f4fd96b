//! Many bodies in shear: what they do to the fluid's viscosity, and whether they keep out of each other.

use rayon::prelude::*;
use tremie_case::Case;
use tremie_numerics::DVec3;
use tremie_output::picture::{Axis, Style};
use tremie_suspension::{Amount, AtWalls, Direction, Form, Freedom, Inclusions, Kind, Order, Suspension};

use super::benchmark::{Check, Context, shown};
use super::figure::Figure;
use super::flow::lattice;
use super::shear::{Shear, core_rate, layers, line};

/// Bodies of one form at random between the walls, so much of the volume, moving with the undisturbed fluid.
fn scattered(shear: &Shear, form: Form, share: f64, seed: u64) -> anyhow::Result<Inclusions> {
    let kinds = vec![Kind { name: "body".into(), form, density: shear.case.material.density }];
    let mut bodies = Inclusions { kinds, ..Inclusions::default() };
    let order = Order {
        kind: 0,
        batch: 0,
        amount: Amount::Share(share),
        direction: Direction::Isotropic,
        at_walls: AtWalls::Turned,
        seed,
    };
    let periods = shear.case.periods();
    shear.between_walls(|region| tremie_suspension::place(&mut bodies, &order, region, &periods))?;
    for n in 0..bodies.len() {
        bodies.velocity[n] = shear.velocity(bodies.position[n]);
    }
    Ok(bodies)
}

/// Viscosities of a mixture over that of the fluid: by the speed of the walls over their distance, and by the shear rate of the core.
#[derive(Debug, Clone, Copy)]
struct Thickened {
    nominal: f64,
    core: f64,
}

/// What a mixture has in the mean from one shear to another, the layers at the walls being no core.
fn thickened(
    shear: &Shear,
    suspension: Suspension,
    walls: usize,
    [from, to]: [f64; 2],
) -> anyhow::Result<Thickened> {
    const LOOKS: u32 = 20;
    let mut flow = shear.flow(suspension);
    flow.until(from / shear.rate)?;
    let (mut stress, mut rate) = (0.0, 0.0);
    for look in 1..=LOOKS {
        flow.until((from + (to - from) * f64::from(look) / f64::from(LOOKS)) / shear.rate)?;
        let snapshot = flow.simulation.snapshot();
        stress += shear.relative_stress(&snapshot) / f64::from(LOOKS);
        let tremie_simulation::Fluid::Cells(cells) = &snapshot.fluid;
        rate += core_rate(&layers(cells), walls, cells.size) / shear.rate / f64::from(LOOKS);
    }
    Ok(Thickened { nominal: stress, core: stress / rate })
}

fn mean(of: impl Iterator<Item = f64> + Clone) -> f64 {
    of.clone().sum::<f64>() / of.count() as f64
}

/// Spheres of 8 cells in shear, as Svec (2013) has them in Figure 2.10.
pub(super) fn suspension_viscosity(context: &Context) -> anyhow::Result<Vec<Check>> {
    const DIAMETER: f64 = 8.0;
    const CELLS: [usize; 3] = [40, 32, 64];
    const SEEDS: [u64; 3] = [1, 2, 3];
    const VISCOSITY: f64 = 0.3;
    const REYNOLDS: f64 = 0.1;
    const SEEN: [f64; 2] = [1.0, 2.0];
    let reference = context.reference()?;
    let shear = Shear::new(context.case("case.toml")?, CELLS, VISCOSITY, REYNOLDS, DIAMETER);
    let runs: Vec<(f64, u64)> =
        reference.iter().flat_map(|row| SEEDS.map(|seed| (row["phi"], seed))).collect();
    let seen: anyhow::Result<Vec<Thickened>> = runs
        .par_iter()
        .with_max_len(1)
        .map(|&(share, seed)| {
            let mut shear = shear.clone();
            let form = Form::Sphere { diameter: DIAMETER * shear.size() };
            let bodies = scattered(&shear, form, share, seed)?;
            thickened(&shear, shear.suspension(bodies, Freedom::Free), CELLS[2] / 4, SEEN)
        })
        .collect();
    let seen = seen?;
    draw_thickening(context, &runs, &seen)?;
    let mut checks = Vec::new();
    for (row, seen) in reference.iter().zip(seen.chunks(SEEDS.len())) {
        let (share, exact) = (row["phi"], row["KD_phim0.60"]);
        let tolerance = if share > 0.35 { "dense" } else { "dilute" };
        let name = format!("viscosity over the fluid's, phi {share}");
        let value = mean(seen.iter().map(|run| run.nominal));
        checks.push(context.relative(tolerance, name, "", exact, value)?);
        let furthest = seen.iter().map(|run| (run.nominal / value - 1.0).abs()).fold(0.0, f64::max);
        checks.push(shown(format!("the same, phi {share}: seed furthest from the mean"), furthest));
        let core = mean(seen.iter().map(|run| run.core));
        checks.push(shown(format!("the same, phi {share}: by the shear rate of the core"), core));
    }
    Ok(checks)
}

/// As in Figure 2.10 of Svec (2013).
fn draw_thickening(context: &Context, runs: &[(f64, u64)], seen: &[Thickened]) -> anyhow::Result<()> {
    // Krieger and Dougherty (1959), with the intrinsic viscosity of spheres, 2.5.
    let krieger =
        (0..=40).map(|n| 0.01 * f64::from(n)).map(|phi| [phi, (1.0f64 - phi / 0.6).powf(-1.5)]).collect();
    let points =
        |of: fn(&Thickened) -> f64| runs.iter().zip(seen).map(|(run, seen)| [run.0, of(seen)]).collect();
    context.show(&Figure {
        name: "viscosity",
        title: "Spheres in shear: viscosity of the mixture",
        x: Axis::linear("volume fraction"),
        y: Axis::linear("viscosity over the fluid's"),
        curves: vec![
            ("Krieger and Dougherty, largest fraction 0.6".into(), Style::Dashed, krieger),
            ("by the speed of the walls".into(), Style::Marks, points(|seen| seen.nominal)),
            ("by the shear rate of the core".into(), Style::Marks, points(|seen| seen.core)),
        ],
    })
}

/// Fibres that go with the fluid but do not turn: the viscosity of the mixture over the fluid's.
fn stiffened(case: &Case, length: usize, cells: [usize; 3], share: f64) -> anyhow::Result<Thickened> {
    const ASPECT: f64 = 80.0;
    const REYNOLDS: f64 = 0.1;
    // So fibres of any length take as much from the velocity of a cell in a step.
    let viscosity = 0.05 * (length as f64 / 6.0).powi(2);
    let mut case = case.clone();
    lattice(&mut case).cell_size *= 6.0 / length as f64;
    let mut shear = Shear::new(case, cells.map(|n| n * length), viscosity, REYNOLDS, length as f64);
    let size = shear.size();
    let form = Form::Fibre { length: length as f64 * size, diameter: length as f64 / ASPECT * size };
    let bodies = scattered(&shear, form, share, 1)?;
    // Times of decay of the slowest part of what walls set going, in the fluid alone.
    let height = (cells[2] * length) as f64;
    let decay = height * height / (4.0 * std::f64::consts::PI.powi(2) * viscosity) / shear.steps;
    thickened(&shear, shear.suspension(bodies, Freedom::Unturned), length, [3.5 * decay, 4.0 * decay])
}

/// Fibres that may not turn, in shear.
pub(super) fn fibre_viscosity(context: &Context) -> anyhow::Result<Vec<Check>> {
    const SHARES: [f64; 4] = [0.00125, 0.0025, 0.00375, 0.005];
    const HIGH: [usize; 3] = [4, 4, 8];
    const THESIS: [usize; 3] = [6, 3, 3];
    let case = context.case("case.toml")?;
    let row = context.reference()?;
    let row = row.first().cloned().unwrap_or_default();
    let (slender, karihaloo) = (row["slender_per_phi"], row["karihaloo_per_phi"]);
    let runs: Vec<(usize, [usize; 3], f64)> = SHARES
        .map(|share| (6, HIGH, share))
        .into_iter()
        .chain([(12, HIGH, 0.0025), (6, THESIS, 0.0025), (6, THESIS, 0.005)])
        .collect();
    let seen: anyhow::Result<Vec<Thickened>> = runs
        .par_iter()
        .with_max_len(1)
        .map(|&(length, cells, share)| stiffened(&case, length, cells, share))
        .collect();
    let seen = seen?;
    let mut checks = Vec::new();
    let points: Vec<(f64, f64)> =
        SHARES.iter().zip(&seen).map(|(share, run)| (*share, run.nominal - 1.0)).collect();
    for ((share, increment), run) in points.iter().zip(&seen) {
        let name = format!("increment over that of slender bodies, phi {} %", 100.0 * share);
        checks.push(context.absolute("slender", name.clone(), "", 1.15, increment / (slender * share))?);
        let core = (run.core - 1.0) / (slender * share);
        checks.push(shown(format!("{name}, by the shear rate of the core"), core));
    }
    let (start, slope) = line(&points);
    let off = |(share, increment): &(f64, f64)| (increment - start - slope * share).abs();
    let bent = points.iter().map(off).fold(start.abs(), f64::max) / (slope * SHARES[3]);
    checks.push(context.zero("linear", "furthest from a line through zero, over the largest", "", bent)?);
    let fine = (seen[4].nominal - 1.0) / (seen[1].nominal - 1.0);
    checks.push(context.relative("resolution", "increment with 12 cells a fibre over 6", "", 1.0, fine)?);
    for (share, run) in [(0.0025, seen[5]), (0.005, seen[6])] {
        let name = format!("cell of the thesis, phi {} %: viscosity over Eq. 3.15", 100.0 * share);
        checks.push(context.absolute("thesis", name, "", 0.8, run.core / (1.0 + karihaloo * share))?);
    }
    Ok(checks)
}

/// Spheres that crowd in shear.
pub(super) fn dense_contacts(context: &Context) -> anyhow::Result<Vec<Check>> {
    const DIAMETER: f64 = 8.0;
    const CELLS: [usize; 3] = [40, 32, 40];
    const STRAIN: f64 = 3.0;
    let mut shear = Shear::new(context.case("case.toml")?, CELLS, 0.2, 0.5, DIAMETER);
    let diameter = DIAMETER * shear.size();
    let bodies = scattered(&shear, Form::Sphere { diameter }, 0.4, 1)?;
    let (low, high) = (shear.case.domain.min.z, shear.case.domain.max.z);
    let periods = shear.case.periods();
    let mut flow = shear.flow(shear.suspension(bodies, Freedom::Free));
    let (mut between, mut walls, mut touched) = (0.0f64, 0.0f64, 0u32);
    while shear.rate * flow.simulation.time() < STRAIN {
        flow.steps(1)?;
        let bodies = flow.simulation.snapshot().inclusions;
        for (n, at) in bodies.position.iter().enumerate() {
            let apart = |other: &DVec3| periods.shortest(*other - *at).length();
            let nearest = bodies.position[..n].iter().map(apart).fold(f64::INFINITY, f64::min);
            between = between.max(1.0 - nearest / diameter);
            walls = walls.max(0.5 - (at.z - low).min(high - at.z) / diameter);
        }
        touched = touched.max(bodies.contacts.iter().copied().max().unwrap_or(0));
    }
    Ok(vec![
        context.zero("overlap", "deepest overlap of two spheres, over their diameter", "", between)?,
        context.zero("overlap", "deepest overlap with a wall", "", walls)?,
        context.at_least("touched", "most others that one sphere touched", f64::from(touched))?,
    ])
}
