//! Balances of the whole fluid: momentum against the forces on all walls, mass, volume.

use tremie_case::Case;
use tremie_lbm::lattice_boltzmann;
use tremie_numerics::DVec3;
use tremie_simulation::gauges::{Gauges, Readings};
use tremie_simulation::{Cells, Fluid, Snapshot};

use super::benchmark::{Check, Context, shown};
use super::flow::lattice;

/// When the first balance begins, in s: at the start of the L-box, and when the jet of the slab has landed.
const BEGINS: [(&str, f64); 2] = [("l-box", 0.0), ("slab", 1.0)];

/// When that of the slab ends in finer cells, in s: until then its jet falls freely, and what is left is largest.
const UNTIL: f64 = 2.0;

/// An L-box and a slab.
pub(super) fn control_volume(context: &Context) -> anyhow::Result<Vec<Check>> {
    let mut checks = Vec::new();
    for (name, from) in BEGINS {
        let balance = Balance::of(&context.case(&format!("{name}.toml"))?, from)?;
        let what = |quantity: &str| format!("{quantity}, {name}");
        checks.extend([
            context.zero(
                "momentum",
                what("what is left of the momentum over the weight"),
                "",
                balance.largest,
            )?,
            shown(what("the same, root of the mean square"), balance.usual),
            context.zero("mass", what("mass"), "", balance.mass)?,
            context.zero("volume", what("volume"), "", balance.volume)?,
        ]);
    }
    let mut finer = context.case("slab.toml")?;
    lattice(&mut finer).cell_size /= 2.0;
    finer.stop.time = UNTIL;
    let balance = Balance::of(&finer, BEGINS[1].1)?;
    checks.push(shown("the largest, slab, cells half as wide, to 2 s", balance.largest));
    Ok(checks)
}

/// What is left over of the balances, as shares.
struct Balance {
    /// The largest of the momentum, over the weight.
    largest: f64,
    /// The root of its mean square.
    usual: f64,
    mass: f64,
    volume: f64,
}

impl Balance {
    /// Balances a case over each of its intervals from a time in s to its stop time.
    fn of(case: &Case, from: f64) -> anyhow::Result<Self> {
        let mut fluid = lattice_boltzmann(case);
        let gauges = Gauges::new(case);
        let (first, first_mass) = (gauges.measure(&fluid.snapshot()), fluid.mass());
        while fluid.time() < from {
            fluid.advance()?;
        }
        let (mut left, mut volume) = (Vec::new(), 0.0f64);
        while fluid.time() < case.stop.time {
            let start = (fluid.time(), fluid.mass(), momentum(&fluid.snapshot()));
            let (mut steps, mut borne) = (0.0, DVec3::ZERO);
            while fluid.time() < start.0 + case.gauges.interval {
                borne += force(&fluid.snapshot());
                steps += 1.0;
                fluid.advance()?;
            }
            let snapshot = fluid.snapshot();
            let rate = (momentum(&snapshot) - start.2) / (fluid.time() - start.0);
            let weight = 0.5 * (start.1 + fluid.mass()) * case.domain.gravity;
            left.push((weight - borne / steps - rate).length() / weight.length());
            volume = volume.max(volume_error(&gauges.measure(&snapshot), &first));
        }
        let [poured, drained, pressed] = fluid.passed();
        let change = fluid.mass() - first_mass - poured + drained - pressed;
        Ok(Self {
            largest: left.iter().copied().fold(0.0, f64::max),
            usual: (left.iter().map(|share| share * share).sum::<f64>() / left.len() as f64).sqrt(),
            mass: change.abs() / if poured > 0.0 { poured } else { first_mass },
            volume,
        })
    }
}

/// Force in N on all that bounds the fluid.
fn force(snapshot: &Snapshot) -> DVec3 {
    let walls = &snapshot.walls;
    walls
        .sides
        .iter()
        .chain(&walls.inlets)
        .chain(&snapshot.solids)
        .chain(&snapshot.cages)
        .map(|load| load.force)
        .sum()
}

/// Momentum of the fluid in kg m/s.
fn momentum(snapshot: &Snapshot) -> DVec3 {
    let Fluid::Cells(cells) = &snapshot.fluid;
    let Cells { fill, velocity, density, size, .. } = cells;
    *density * size.powi(3) * fill.iter().zip(velocity).map(|(fill, u)| *fill * *u).sum::<DVec3>()
}

/// How far the volume is off what was there at first and came in since, as a share.
fn volume_error(now: &Readings, first: &Readings) -> f64 {
    let passed = now.inflow.iter().sum::<f64>() - now.outflow.unwrap_or(0.0);
    (now.volume / (first.volume + passed) - 1.0).abs()
}
