//! What must not change the result: number of threads, precision, a pause, the way the set-up is turned.

use anyhow::{anyhow, ensure};
use rayon::ThreadPoolBuilder;
use tremie_case::{Case, Precision, Side};
use tremie_geometry::Shape;
use tremie_numerics::DVec3;
use tremie_output::state::{Array, State};
use tremie_simulation::Cells;

use super::benchmark::{Check, Context};
use super::flow::{Flow, cell_at, centres, lattice};

/// Steps of the runs that are compared to the bit.
const STEPS: u64 = 1000;

/// All of them.
pub(super) fn invariance(context: &Context) -> anyhow::Result<Vec<Check>> {
    let slump = context.case("slump.toml")?;
    let mut checks = threads(context, &slump)?;
    checks.push(restart(context, &slump)?);
    checks.push(precision(context, &slump)?);
    checks.push(quarter(context, &slump)?);
    checks.extend(turned(context, &context.case("lumps.toml")?)?);
    Ok(checks)
}

/// The same bits on any number of threads.
fn threads(context: &Context, case: &Case) -> anyhow::Result<Vec<Check>> {
    let on = |threads: usize| -> anyhow::Result<State> {
        ThreadPoolBuilder::new().num_threads(threads).build()?.install(|| {
            let mut flow = Flow::new(case.clone());
            flow.steps(STEPS)?;
            Ok(flow.simulation.save())
        })
    };
    let one = on(1)?;
    [2, 3]
        .map(|threads| {
            let name = format!("numbers that differ, 1 and {threads} threads");
            context.zero("bits", name, "", different(&one, &on(threads)?)?)
        })
        .into_iter()
        .collect()
}

/// Half a run and another half from its saved state are the whole run.
fn restart(context: &Context, case: &Case) -> anyhow::Result<Check> {
    let mut whole = Flow::new(case.clone());
    whole.steps(STEPS / 2)?;
    let half = whole.simulation.save();
    whole.steps(STEPS / 2)?;
    let mut resumed = Flow::new(case.clone());
    resumed.simulation.restore(&half)?;
    resumed.steps(STEPS / 2)?;
    let numbers = different(&whole.simulation.save(), &resumed.simulation.save())?;
    context.zero("bits", "numbers that differ, whole run and two halves", "", numbers)
}

/// How many numbers of two states differ in a bit.
fn different(a: &State, b: &State) -> anyhow::Result<f64> {
    ensure!(a.header == b.header && a.arrays.len() == b.arrays.len(), "the states are of different make");
    fn count<T>(a: &[T], b: &[T], same: impl Fn(&T, &T) -> bool) -> usize {
        a.len().abs_diff(b.len()) + a.iter().zip(b).filter(|(a, b)| !same(a, b)).count()
    }
    let numbers = a.arrays.iter().zip(&b.arrays).map(|((_, a), (_, b))| match (a, b) {
        (Array::U8(a), Array::U8(b)) => Ok(count(a, b, u8::eq)),
        (Array::U32(a), Array::U32(b)) => Ok(count(a, b, u32::eq)),
        (Array::U64(a), Array::U64(b)) => Ok(count(a, b, u64::eq)),
        (Array::F32(a), Array::F32(b)) => Ok(count(a, b, |a, b| a.to_bits() == b.to_bits())),
        (Array::F64(a), Array::F64(b)) => Ok(count(a, b, |a, b| a.to_bits() == b.to_bits())),
        _ => Err(anyhow!("the states are of different make")),
    });
    Ok(numbers.sum::<anyhow::Result<usize>>()? as f64)
}

/// Spread in m of the slump at the case's stop time.
fn spread(case: Case) -> anyhow::Result<f64> {
    let time = case.stop.time;
    let mut flow = Flow::new(case);
    flow.until(time)?;
    flow.readings().spread.map(|spread| spread.mean).ok_or_else(|| anyhow!("the case has no spread gauge"))
}

/// Single against double precision.
fn precision(context: &Context, case: &Case) -> anyhow::Result<Check> {
    let with = |precision: Precision| {
        let mut case = case.clone();
        lattice(&mut case).precision = precision;
        spread(case)
    };
    let (single, double) = rayon::join(|| with(Precision::F32), || with(Precision::F64));
    context.relative("precision", "spread, f32 against f64", "m", double?, single?)
}

/// A quarter between symmetry planes against the whole.
fn quarter(context: &Context, quarter: &Case) -> anyhow::Result<Check> {
    let mut whole = quarter.clone();
    whole.domain.min.x = -whole.domain.max.x;
    whole.domain.min.y = -whole.domain.max.y;
    whole.domain.sides[0] = Side::REST;
    whole.domain.sides[2] = Side::REST;
    let (part, whole) = rayon::join(|| spread(quarter.clone()), || spread(whole));
    context.relative("quarter", "spread, quarter against whole", "m", whole?, part?)
}

/// A motion of space that keeps the vertical: along x and y it exchanges or mirrors axes.
#[derive(Clone, Copy)]
struct Motion {
    /// Images of the unit vectors along x and y.
    x: DVec3,
    y: DVec3,
}

impl Motion {
    fn direction(self, v: DVec3) -> DVec3 {
        v.x * self.x + v.y * self.y + DVec3::Z * v.z
    }

    /// A box after the motion about the origin, as its lower and upper corner.
    fn corners(self, min: DVec3, max: DVec3) -> (DVec3, DVec3) {
        let (a, b) = (self.direction(min), self.direction(max));
        (a.min(b), a.max(b))
    }

    /// The domain moves about the origin and is not shifted back.
    fn case(self, case: &Case) -> anyhow::Result<Case> {
        let mut moved = case.clone();
        (moved.domain.min, moved.domain.max) = self.corners(case.domain.min, case.domain.max);
        for region in &mut moved.fluid {
            region.velocity = self.direction(region.velocity);
            region.shape = match region.shape {
                Shape::Box { min, max } => {
                    let (min, max) = self.corners(min, max);
                    Shape::Box { min, max }
                }
                Shape::Sphere { centre, radius } => Shape::Sphere { centre: self.direction(centre), radius },
                _ => anyhow::bail!("only boxes and spheres can be turned here"),
            };
        }
        Ok(moved)
    }
}

/// A set-up without any symmetry, mirrored and turned.
fn turned(context: &Context, case: &Case) -> anyhow::Result<Vec<Check>> {
    ensure!(case.domain.sides == [Side::REST; 6], "walls all around can be turned, nothing else");
    let after = |case: &Case| -> anyhow::Result<Cells> {
        let mut flow = Flow::new(case.clone());
        flow.until(case.stop.time)?;
        Ok(flow.cells())
    };
    let straight = after(case)?;
    let mut checks = Vec::new();
    for (name, motion) in [
        ("mirrored", Motion { x: -DVec3::X, y: DVec3::Y }),
        ("turned by 90 degrees", Motion { x: DVec3::Y, y: -DVec3::X }),
    ] {
        let moved = after(&motion.case(case)?)?;
        let (mut fill, mut velocity, mut largest) = (0.0f64, 0.0f64, 0.0f64);
        for place in centres(&straight) {
            let here = cell_at(&straight, place);
            let there = cell_at(&moved, motion.direction(place));
            let fill_of = |cells: &Cells, n: Option<usize>| n.map_or(0.0, |n| cells.fill[n]);
            let velocity_of = |cells: &Cells, n: Option<usize>| n.map_or(DVec3::ZERO, |n| cells.velocity[n]);
            fill = fill.max((fill_of(&straight, here) - fill_of(&moved, there)).abs());
            let expected = motion.direction(velocity_of(&straight, here));
            velocity = velocity.max(expected.distance(velocity_of(&moved, there)));
            largest = largest.max(expected.length());
        }
        checks.push(context.zero("rounding", format!("fill, {name}"), "", fill)?);
        checks.push(context.zero("rounding", format!("velocity, {name}"), "", velocity / largest)?);
    }
    Ok(checks)
}
