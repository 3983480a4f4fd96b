//! Wakes: how few fibres the flow leaves behind bars (Svec 2013, sections 8.2 and 8.5).
//!
//! The fluid says which way is behind: the mean of its velocity around a bar, across it, over all that came past. Fibres and fluid are then gathered in
//! strips along that way, from half a fibre's length behind the axis of the bar, where it stands in no fibre's way, to two lengths: one in the bar's
//! shadow, as wide as it, and others beside it.

use anyhow::ensure;
use tremie_case::Case;
use tremie_geometry::{Body, Shape};
use tremie_numerics::{DMat3, DVec3};
use tremie_output::picture::{Axis, Style};
use tremie_simulation::Cells;
use tremie_suspension::orientation::Block;
use tremie_suspension::{Form, Inclusions};

use super::benchmark::{Check, Context, shown};
use super::figure::Figure;
use super::flow::{Flow, cell_at};

/// Where strips begin and end behind the axis, in lengths of a fibre.
const BEHIND: [f64; 2] = [0.5, 2.0];

/// The strips in the shadow and beside it, in diameters of the bar from the axis.
const SHADOW: [[f64; 2]; 1] = [[-0.5, 0.5]];
const BESIDE: [[f64; 2]; 2] = [[-2.0, -1.0], [1.0, 2.0]];

/// Radius in diameters of the fluid around a bar that says which way it flows.
const AROUND: f64 = 3.0;

/// Time in s between two looks at the flow.
const LOOK: f64 = 0.1;

/// A bar.
struct Bar {
    start: DVec3,
    end: DVec3,
    diameter: f64,
    /// Sum over time of the momentum around it.
    way: DVec3,
}

impl Bar {
    fn axis(&self) -> DVec3 {
        (self.end - self.start).normalize()
    }

    /// Point of the axis nearest to a place.
    fn nearest(&self, at: DVec3) -> DVec3 {
        let length = self.start.distance(self.end);
        self.start + self.axis() * (at - self.start).dot(self.axis()).clamp(0.0, length)
    }

    /// Adds how the fluid around it flows now.
    fn look(&mut self, cells: &Cells) {
        let reach = AROUND * self.diameter;
        let [nx, ny, _] = cells.count;
        for n in (0..cells.fill.len()).filter(|n| cells.fill[*n] > 0.0) {
            let at = cells.centre(n % nx, n / nx % ny, n / (nx * ny));
            if at.distance(self.nearest(at)) < reach {
                self.way += cells.fill[n] * cells.velocity[n];
            }
        }
    }

    /// The axes of its strips: the way of the flow, across it, and along the bar.
    fn frame(&self) -> DMat3 {
        let axis = self.axis();
        let way = (self.way - axis * axis.dot(self.way)).normalize();
        DMat3::from_cols(way, axis.cross(way), axis)
    }
}

/// The bars of a case.
fn bars(case: &Case) -> Vec<Bar> {
    let unions = case.solids.iter().filter_map(|solid| match &solid.body {
        Body::Union(union) => Some(union.bodies()),
        _ => None,
    });
    let bar = |body: &Body| match *body {
        Body::Shape(Shape::Bar { start, end, radius }) => {
            Some(Bar { start, end, diameter: 2.0 * radius, way: DVec3::ZERO })
        }
        _ => None,
    };
    unions.flatten().filter_map(bar).collect()
}

/// Pieces of fibres, and the fluid that they are in.
#[derive(Debug, Clone, Copy, Default)]
struct Gathered {
    length: f64,
    squares: f64,
    fluid: f64,
}

impl Gathered {
    fn add(&mut self, more: Self) {
        self.length += more.length;
        self.squares += more.squares;
        self.fluid += more.fluid;
    }

    /// Length of fibres per volume of fluid.
    fn density(&self) -> f64 {
        self.length / self.fluid
    }

    /// Its standard error, as pieces come one by one: that of one whole fibre at least.
    fn error(&self, fibre: f64) -> f64 {
        self.squares.sqrt().max(fibre) / self.fluid
    }

    /// The density over that of others, and its standard error.
    fn over(&self, other: &Self, fibre: f64) -> [f64; 2] {
        let ratio = self.density() / other.density();
        [ratio, self.error(fibre).hypot(ratio * other.error(fibre)) / other.density()]
    }
}

/// What lies in a strip of a bar, `across` in diameters.
fn strip(bar: &Bar, across: [f64; 2], cells: &Cells, bodies: &Inclusions, fibre: f64) -> Gathered {
    let turned = bar.frame().transpose();
    let block = Block {
        low: DVec3::new(BEHIND[0] * fibre, across[0] * bar.diameter, 0.0),
        high: DVec3::new(BEHIND[1] * fibre, across[1] * bar.diameter, bar.start.distance(bar.end)),
    };
    let mut found = Gathered::default();
    for [start, end] in (0..bodies.len()).filter_map(|n| bodies.ends(n)) {
        let (start, way) = (turned * (start - bar.start), turned * (end - start));
        if let Some((from, to)) = block.part(start, way) {
            let length = (to - from) * way.length();
            found.length += length;
            found.squares += length * length;
        }
    }
    // The fluid by points, three to a cell's edge at least.
    let size = block.high - block.low;
    let number = (3.0 * size / cells.size).ceil();
    let step = size / number;
    let [nx, ny, nz] = number.to_array().map(|n| n as usize);
    for n in 0..nx * ny * nz {
        let at = DVec3::new((n % nx) as f64, (n / nx % ny) as f64, (n / (nx * ny)) as f64) + 0.5;
        let place = bar.start + bar.frame() * (block.low + at * step);
        if let Some(cell) = cell_at(cells, place) {
            found.fluid += cells.fill[cell] * step.element_product();
        }
    }
    found
}

/// What a cast leaves behind its bars.
struct Wakes {
    /// Density in the shadow over that beside it, and its standard error: of each bar, then of all.
    ratios: Vec<[f64; 2]>,
    /// Density in all strips over that in all of the fluid.
    around: f64,
    /// Ways of the flow.
    ways: Vec<DVec3>,
    /// Density over the mean of all fluid, across the way in diameters.
    profile: Vec<[f64; 2]>,
}

/// Runs a case to its end.
fn cast(case: &Case) -> anyhow::Result<Wakes> {
    let mut bars = bars(case);
    ensure!(!bars.is_empty(), "the case must have bars");
    let mut flow = Flow::new(case.clone());
    let looks = (case.stop.time / LOOK).round() as usize;
    for n in 1..=looks {
        flow.until(n as f64 * LOOK)?;
        let cells = flow.cells();
        bars.iter_mut().for_each(|bar| bar.look(&cells));
    }
    let (cells, bodies) = (flow.cells(), flow.simulation.snapshot().inclusions);
    let fibres = bodies.kinds.iter().find_map(|kind| match kind.form {
        Form::Fibre { length, .. } => Some(length),
        _ => None,
    });
    let Some(fibre) = fibres else { anyhow::bail!("the case must have fibres") };
    let all = |bar: &Bar, strips: &[[f64; 2]]| {
        let mut sum = Gathered::default();
        strips.iter().for_each(|across| sum.add(strip(bar, *across, &cells, &bodies, fibre)));
        sum
    };
    let (mut shadows, mut besides, mut ratios) = (Gathered::default(), Gathered::default(), Vec::new());
    for bar in &bars {
        let (shadow, beside) = (all(bar, &SHADOW), all(bar, &BESIDE));
        ratios.push(shadow.over(&beside, fibre));
        shadows.add(shadow);
        besides.add(beside);
    }
    ratios.push(shadows.over(&besides, fibre));
    let whole = bodies.len() as f64 * fibre / (cells.fill.iter().sum::<f64>() * cells.size.powi(3));
    let profile = (-6..=6)
        .map(|n| {
            let at = 0.5 * f64::from(n);
            let mut sum = Gathered::default();
            bars.iter().for_each(|bar| sum.add(all(bar, &[[at - 0.25, at + 0.25]])));
            [at, sum.density() / whole]
        })
        .collect();
    shadows.add(besides);
    let ways = bars.iter().map(|bar| bar.frame().x_axis).collect();
    Ok(Wakes { ratios, around: shadows.density() / whole, ways, profile })
}

/// The bars of an L-box, and the stiffeners of a wall.
pub(super) fn wake(context: &Context) -> anyhow::Result<Vec<Check>> {
    let wakes = cast(&context.case("case.toml")?)?;
    let mut checks = Vec::new();
    for (n, [ratio, error]) in wakes.ratios.iter().enumerate() {
        let Some(way) = wakes.ways.get(n) else {
            let below = (1.0 - ratio) / error;
            checks.push(context.at_least(
                "wake",
                "below the fluid beside, all bars, standard errors",
                below,
            )?);
            checks.push(shown("behind over beside, all bars", *ratio));
            checks.push(shown("its standard error", *error));
            continue;
        };
        let degrees = way.z.atan2(way.x).to_degrees();
        checks.push(shown(format!("behind over beside, bar {}", n + 1), *ratio));
        checks.push(shown(format!("its standard error, bar {}", n + 1), *error));
        checks.push(shown(format!("way of the flow upwards from x, bar {}, degrees", n + 1), degrees));
    }
    checks.push(shown("strips over all fluid", wakes.around));
    context.show(&Figure {
        name: "profile",
        title: "Fibres behind bars",
        x: Axis::linear("across the way of the flow [diameters of the bar]"),
        y: Axis::linear("fibres over their mean"),
        curves: vec![("fibres".to_owned(), Style::Line, wakes.profile)],
    })?;
    Ok(checks)
}
