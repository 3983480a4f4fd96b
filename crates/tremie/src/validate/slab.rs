//! A slab cast from a hose: how its fibres come to lie (Svec 2013, chapter 7).

use rayon::prelude::*;
use tremie_case::{Case, Side, Surface};
use tremie_numerics::{DMat3, DVec3};
use tremie_simulation::gauges::Readings;
use tremie_suspension::orientation::{Block, Share, principal};
use tremie_suspension::{Form, Inclusions};

use super::benchmark::{Check, Context, shown};
use super::flow::Flow;

/// Surfaces of the form, from rough to smooth.
const SURFACES: [(&str, Surface); 3] = [
    ("no slip", Surface::NoSlip),
    ("8 cm", Surface::Navier { slip_length: 0.08 }),
    ("no friction", Surface::FreeSlip),
];

/// Edge in m of the squares and lengths that means are taken over.
const SQUARE: f64 = 0.15;

/// Nearer to the hose's axis than this in m, fibres fall into place rather than being turned by the flow.
const UNDER_HOSE: f64 = 0.2;

/// A mean and its standard error, from what separate places say.
#[derive(Debug, Clone, Copy)]
struct Mean {
    value: f64,
    error: f64,
}

impl Mean {
    fn of(values: &[f64]) -> Self {
        let number = values.len() as f64;
        let value = values.iter().sum::<f64>() / number;
        let squares = values.iter().map(|x| (x - value).powi(2)).sum::<f64>();
        Self { value, error: (squares / (number - 1.0) / number).sqrt() }
    }

    /// By how many standard errors this is more than another.
    fn above(self, other: Self) -> f64 {
        (self.value - other.value) / self.error.hypot(other.error)
    }
}

/// A number that is known.
fn exactly(value: f64) -> Mean {
    Mean { value, error: 0.0 }
}

/// The findings in one form.
struct Found {
    /// Share of the largest eigenvalue of the horizontal tensor in the lower half.
    aligned: Mean,
    /// |cos| between fibres and the way from the hose in the upper half.
    radial: Mean,
    /// |cos| between fibres at the sides and these.
    along: Mean,
    /// Mean shares of directions from the hose, around it and upwards, a_rr, a_tt and a_zz, in the lower and the upper half: of fibres, then of the field.
    shares: [[[f64; 3]; 2]; 2],
    end: Readings,
    due: u64,
}

/// Mean squares of the cosines to the way from the hose, around it and upwards, of what is given by places, tensors and weights.
fn mean_shares(hose: DVec3, of: impl Iterator<Item = (DVec3, DMat3, f64)>) -> [f64; 3] {
    let (mut sums, mut whole) = ([0.0; 3], 0.0);
    for (at, tensor, weight) in of {
        let way = (at - hose).with_z(0.0).normalize();
        for (sum, axis) in sums.iter_mut().zip([way, way.cross(DVec3::Z), DVec3::Z]) {
            *sum += weight * axis.dot(tensor * axis);
        }
        whole += weight;
    }
    sums.map(|sum| sum / whole)
}

/// Casts the slab in a form with this surface.
fn cast(case: &Case, surface: Surface) -> anyhow::Result<Found> {
    let mut case = case.clone();
    for side in &mut case.domain.sides {
        if let Side::Wall { surface: own, .. } = side {
            *own = surface;
        }
    }
    let (inlet, (low, high)) = (&case.inlets[0], (case.domain.min, case.domain.max));
    let (hose, height) =
        (inlet.face.centre, inlet.flow_rate * inlet.end() / (high - low).truncate().element_product());
    let due = inlet.inclusions.iter().map(|of| of.due(inlet.flow_rate * inlet.end())).sum();
    let Form::Fibre { length, .. } = inlet.inclusions[0].form else { anyhow::bail!("there must be fibres") };
    let mut flow = Flow::new(case.clone());
    let end = flow.until_rest(|_| {})?;
    let (cells, bodies) = (flow.cells(), flow.simulation.snapshot().inclusions);
    let off = |at: DVec3| (at - low).min(high - at).truncate().min_element();
    let halves = |upper: bool| {
        let place = move |at: DVec3| off(at) > length && (at.z > low.z + 0.5 * height) == upper;
        by_square(&bodies, place)
    };
    let aligned: Vec<f64> = halves(false).iter().filter_map(|fibres| alignment(&bodies, fibres)).collect();
    let way = |n: usize| (bodies.position[n] - hose).with_z(0.0);
    let outer = |fibres: &Vec<usize>| fibres.iter().all(|n| way(*n).length() > UNDER_HOSE);
    let cosine = |n: usize, along: DVec3| bodies.axis(n).dot(along.normalize()).abs();
    let radial: Vec<f64> = halves(true)
        .iter()
        .filter(|fibres| outer(fibres))
        .map(|fibres| fibres.iter().map(|n| cosine(*n, way(*n))).sum::<f64>() / fibres.len() as f64)
        .collect();
    let mut along = Vec::new();
    for side in 0..4 {
        let (axis, other) = (side / 2, 1 - side / 2);
        let end = if side % 2 == 0 { low } else { high };
        let beside =
            |at: DVec3| (at - end)[axis].abs() < 0.5 * length && (at - low).min(high - at)[other] > length;
        along.extend(by_square(&bodies, beside).iter().map(|fibres| {
            fibres.iter().map(|n| cosine(*n, DVec3::AXES[other])).sum::<f64>() / fibres.len() as f64
        }));
    }
    let Some(field) = &cells.lying else { anyhow::bail!("there must be a field of fibres") };
    let shares = [false, true].map(|upper| {
        let inside = |at: &DVec3| {
            off(*at) > length
                && (*at - hose).truncate().length() > UNDER_HOSE
                && (at.z > low.z + 0.5 * height) == upper
        };
        let fibre = |n: usize| (bodies.position[n], dyad(bodies.axis(n)), 1.0);
        let [nx, ny, _] = cells.count;
        let cell =
            |n: usize| (cells.centre(n % nx, n / nx % ny, n / (nx * ny)), field.tensor(n), cells.fill[n]);
        let fibres = (0..bodies.len()).map(fibre).filter(|(at, ..)| inside(at));
        let field = (0..cells.fill.len()).map(cell).filter(|(at, ..)| inside(at));
        [mean_shares(hose, fibres), mean_shares(hose, field)]
    });
    Ok(Found {
        shares,
        aligned: Mean::of(&aligned),
        radial: Mean::of(&radial),
        along: Mean::of(&along),
        end,
        due,
    })
}

/// The fibres with their centres at such places, by the squares that these are in; squares with fewer than ten are left out.
fn by_square(bodies: &Inclusions, place: impl Fn(DVec3) -> bool) -> Vec<Vec<usize>> {
    let mut squares = std::collections::BTreeMap::<[i64; 2], Vec<usize>>::new();
    for n in (0..bodies.len()).filter(|n| place(bodies.position[*n])) {
        let square = (bodies.position[n] / SQUARE).floor();
        squares.entry([square.x as i64, square.y as i64]).or_default().push(n);
    }
    squares.into_values().filter(|fibres| fibres.len() >= 10).collect()
}

/// The tensor of one direction.
fn dyad(p: DVec3) -> DMat3 {
    DMat3::from_cols(p.x * p, p.y * p, p.z * p)
}

/// Share of the largest eigenvalue of the horizontal part of some fibres' orientation tensor.
fn alignment(bodies: &Inclusions, fibres: &[usize]) -> Option<f64> {
    let mut share = Share::NONE;
    fibres.iter().for_each(|n| share.add(bodies, *n, &Block::SPACE));
    let a = share.tensor()?;
    let flat = DMat3::from_cols(a.x_axis.with_z(0.0), a.y_axis.with_z(0.0), DVec3::ZERO);
    Some(principal(&flat).values[0] / (a.x_axis.x + a.y_axis.y))
}

/// The slab in three forms.
pub(super) fn slab_fibres(context: &Context) -> anyhow::Result<Vec<Check>> {
    let case = context.case("case.toml")?;
    let found: anyhow::Result<Vec<Found>> =
        SURFACES.par_iter().with_max_len(1).map(|(_, surface)| cast(&case, *surface)).collect();
    let found = found?;
    let mut checks = Vec::new();
    for (n, pair) in found.windows(2).enumerate() {
        let (name, rougher) = (SURFACES[n + 1].0, SURFACES[n].0);
        let what = format!("(a) alignment below, {name} over {rougher}, standard errors");
        checks.push(context.at_least(name, what, pair[1].aligned.above(pair[0].aligned))?);
    }
    for ((name, _), found) in SURFACES.iter().zip(&found) {
        let below = exactly(0.5).above(found.radial);
        checks.push(context.at_least(
            "across",
            format!("(b) across the way from the hose, {name}, standard errors"),
            below,
        )?);
        let above = found.along.above(exactly(0.5));
        checks.push(context.at_least(
            "along",
            format!("(c) along the sides, {name}, standard errors"),
            above,
        )?);
        for (what, mean) in [
            ("alignment below", found.aligned),
            ("|cos| to the way from the hose above", found.radial),
            ("|cos| to the sides beside them", found.along),
        ] {
            checks.push(shown(format!("{what}, {name}"), mean.value));
            checks.push(shown(format!("{what}, {name}: standard error"), mean.error));
        }
        for (half, [fibres, field]) in ["lower", "upper"].into_iter().zip(found.shares) {
            for (what, (fibres, field)) in
                ["a_rr", "a_tt", "a_zz"].into_iter().zip(fibres.into_iter().zip(field))
            {
                let what = format!("{what} of the field, {half} half, {name}");
                checks.push(context.absolute("field", what, "", fibres, field)?);
            }
        }
        let inflow: f64 = found.end.inflow.iter().sum();
        checks.push(context.relative("volume", format!("volume, {name}"), "m3", inflow, found.end.volume)?);
        for (_, count) in &found.end.bodies {
            let lost = (count.came - found.due as f64).abs() + (count.came - count.present).abs();
            checks.push(context.zero("count", format!("fibres lost or come twice, {name}"), "", lost)?);
            checks.push(shown(format!("fibres, {name}"), count.present));
        }
        checks.push(shown(format!("at rest, {name}, s"), found.end.time));
    }
    Ok(checks)
}
