//! Wakes: how few fibres the flow leaves behind bars (Svec 2013, sections 8.2 and 8.5).
//!
//! The fluid says which way is behind: the mean of its velocity around a bar, across it, over all that came past so far. What has passed close by the bar need not go on that way:
//! where gaps are of different widths, the flow behind a bar goes aside. Fibres and fluid are thus gathered in strips along the middle of the two
//! streamlines that pass the bar a cell off its surface on either side, from half a fibre's length behind the axis of the bar, where it stands in no fibre's way, to two lengths. This is done again and
//! again while they flow past, each time with the speed of the fluid for its weight: so all fibres that pass count alike, and what stands still not at all.
//!
//! A fibre cannot come nearer to a bar than they both are thick; fluid does, and sticks to the bar. What flows on from there, without fibres, closes behind
//! the bar to a strip much thinner than it, and the fibres that had to go round lie close beside. The shadow is thus the middle half of the bar's width.

use std::collections::BTreeMap;

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

/// Width of a strip, and how far they reach from the way through the axis, in diameters of the bar.
const WIDTH: f64 = 0.25;
const REACH: f64 = 3.0;

/// The distances in diameters between which a strip is in the shadow, or beside it.
const SHADOW: [f64; 2] = [0.0, 0.25];
const BESIDE: [f64; 2] = [1.0, 2.0];

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
    /// How far in m the middle of what passed close by lies across that way at the last look, piece by piece of its strips.
    path: Vec<f64>,
    /// What came past, in each strip.
    strips: Vec<Gathered>,
}

impl Bar {
    fn new(start: DVec3, end: DVec3, diameter: f64) -> Self {
        let strips = vec![Gathered::default(); (2.0 * REACH / WIDTH) as usize];
        Self { start, end, diameter, way: DVec3::ZERO, path: Vec::new(), strips }
    }

    fn axis(&self) -> DVec3 {
        (self.end - self.start).normalize()
    }

    /// Point of the axis nearest to a place.
    fn nearest(&self, at: DVec3) -> DVec3 {
        let length = self.start.distance(self.end);
        self.start + self.axis() * (at - self.start).dot(self.axis()).clamp(0.0, length)
    }

    /// Adds how the fluid around it flows now, and what is in its strips.
    fn look(&mut self, cells: &Cells, bodies: &Inclusions, fibre: f64) {
        let reach = AROUND * self.diameter;
        let [nx, ny, _] = cells.count;
        let (mut momentum, mut fluid) = (DVec3::ZERO, 0.0);
        for n in (0..cells.fill.len()).filter(|n| cells.fill[*n] > 0.0) {
            let at = cells.centre(n % nx, n / nx % ny, n / (nx * ny));
            if at.distance(self.nearest(at)) < reach {
                momentum += cells.fill[n] * cells.velocity[n];
                fluid += cells.fill[n];
            }
        }
        self.way += momentum;
        if momentum == DVec3::ZERO {
            return;
        }
        let speed = momentum.length() / fluid;
        self.path = self.path(cells, fibre);
        for n in 0..self.strips.len() {
            let low = n as f64 * WIDTH - REACH;
            let found = strip(self, [low, low + WIDTH], cells, bodies, fibre);
            self.strips[n].add(&found, speed);
        }
    }

    /// Goes along the streamlines of the flow, in the mean over the bar's length.
    fn path(&self, cells: &Cells, fibre: f64) -> Vec<f64> {
        let frame = self.frame();
        let layers = (self.start.distance(self.end) / cells.size).ceil();
        let flow = |along: f64, across: f64| -> DVec3 {
            let layer = |n: usize| {
                let up = self.start.distance(self.end) * (n as f64 + 0.5) / layers;
                let at = self.start + frame * DVec3::new(along, across, up);
                cell_at(cells, at).map_or(DVec3::ZERO, |cell| cells.fill[cell] * cells.velocity[cell])
            };
            frame.transpose() * (0..layers as usize).map(layer).sum::<DVec3>()
        };
        let length = (BEHIND[1] - BEHIND[0]) * fibre;
        let pieces = (length / cells.size).ceil();
        let step = 0.5 * cells.size;
        let passing = |side: f64| -> Vec<f64> {
            let (mut along, mut across) = (0.0, side * (0.5 * self.diameter + cells.size));
            let piece = |n: usize| {
                while along < BEHIND[0] * fibre + (n as f64 + 0.5) * length / pieces {
                    let flow = flow(along, across);
                    if flow.x > 0.0 {
                        across += step * flow.y / flow.x;
                    }
                    along += step;
                }
                across
            };
            (0..pieces as usize).map(piece).collect()
        };
        passing(-1.0).into_iter().zip(passing(1.0)).map(|(one, other)| 0.5 * (one + other)).collect()
    }

    /// All in its strips whose middles are between these distances.
    fn gathered(&self, between: [f64; 2]) -> Gathered {
        let mut sum = Gathered::default();
        for (n, strip) in self.strips.iter().enumerate() {
            let distance = ((n as f64 + 0.5) * WIDTH - REACH).abs();
            if distance > between[0] && distance < between[1] {
                sum.add(strip, 1.0);
            }
        }
        sum
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
        Body::Shape(Shape::Bar { start, end, radius }) => Some(Bar::new(start, end, 2.0 * radius)),
        _ => None,
    };
    unions.flatten().filter_map(bar).collect()
}

/// Pieces of fibres, and the fluid that they are in.
#[derive(Debug, Clone, Default)]
struct Gathered {
    /// Length of each fibre, by its number.
    pieces: BTreeMap<u64, f64>,
    fluid: f64,
}

impl Gathered {
    fn add(&mut self, more: &Self, weight: f64) {
        for (id, length) in &more.pieces {
            *self.pieces.entry(*id).or_default() += weight * length;
        }
        self.fluid += weight * more.fluid;
    }

    /// Length of fibres per volume of fluid.
    fn density(&self) -> f64 {
        self.pieces.values().sum::<f64>() / self.fluid
    }

    /// Its standard error, as fibres come one by one.
    fn error(&self) -> f64 {
        self.pieces.values().map(|length| length * length).sum::<f64>().sqrt() / self.fluid
    }

    /// The density over that of others, and its standard error.
    fn over(&self, other: &Self) -> [f64; 2] {
        let ratio = self.density() / other.density();
        [ratio, self.error().hypot(ratio * other.error()) / other.density()]
    }
}

/// What lies in a strip of a bar, `across` in diameters.
fn strip(bar: &Bar, across: [f64; 2], cells: &Cells, bodies: &Inclusions, fibre: f64) -> Gathered {
    let turned = bar.frame().transpose();
    let length = (BEHIND[1] - BEHIND[0]) * fibre / bar.path.len() as f64;
    let line = |n: usize| {
        let [start, end] = bodies.ends(n)?;
        Some((bodies.id[n], turned * (start - bar.start), turned * (end - start)))
    };
    let lines: Vec<_> = (0..bodies.len()).filter_map(line).collect();
    let mut found = Gathered::default();
    for (n, aside) in bar.path.iter().enumerate() {
        let along = BEHIND[0] * fibre + n as f64 * length;
        let [near, far] = across.map(|across| across * bar.diameter + aside);
        let block = Block {
            low: DVec3::new(along, near, 0.0),
            high: DVec3::new(along + length, far, bar.start.distance(bar.end)),
        };
        for (id, start, way) in &lines {
            if let Some((from, to)) = block.part(*start, *way) {
                *found.pieces.entry(*id).or_default() += (to - from) * way.length();
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
    }
    found
}

/// What a cast leaves behind its bars.
struct Wakes {
    /// Density in the shadow over that beside it, and its standard error: of each bar, then of all.
    ratios: Vec<[f64; 2]>,
    /// Density up to the outer strips over that in all of the fluid.
    around: f64,
    /// Ways of the flow, and how far in m the wakes lie across them in the end, where strips end.
    ways: Vec<(DVec3, f64)>,
    /// Density over the mean of all fluid, across the way in diameters.
    profile: Vec<[f64; 2]>,
}

/// Runs a case to its end.
fn cast(case: &Case) -> anyhow::Result<Wakes> {
    let mut bars = bars(case);
    ensure!(!bars.is_empty(), "the case must have bars");
    let mut flow = Flow::new(case.clone());
    let fibres = flow.simulation.snapshot().inclusions.kinds.iter().find_map(|kind| match kind.form {
        Form::Fibre { length, .. } => Some(length),
        _ => None,
    });
    let Some(fibre) = fibres else { anyhow::bail!("the case must have fibres") };
    let looks = (case.stop.time / LOOK).round() as usize;
    let mut whole = 0.0;
    for n in 1..=looks {
        flow.until(n as f64 * LOOK)?;
        let (cells, bodies) = (flow.cells(), flow.simulation.snapshot().inclusions);
        bars.iter_mut().for_each(|bar| bar.look(&cells, &bodies, fibre));
        whole = bodies.len() as f64 * fibre / (cells.fill.iter().sum::<f64>() * cells.size.powi(3));
    }
    // The same fibre behind two bars is seen twice: each bar has numbers of its own.
    let all = |between: [f64; 2]| {
        let mut sum = Gathered::default();
        for (n, bar) in bars.iter().enumerate() {
            let Gathered { pieces, fluid } = bar.gathered(between);
            let pieces = pieces.into_iter().map(|(id, length)| (id * bars.len() as u64 + n as u64, length));
            sum.add(&Gathered { pieces: pieces.collect(), fluid }, 1.0);
        }
        sum
    };
    let each = bars.iter().map(|bar| bar.gathered(SHADOW).over(&bar.gathered(BESIDE)));
    let ratios = each.chain([all(SHADOW).over(&all(BESIDE))]).collect();
    let profile = (0..bars[0].strips.len())
        .map(|n| {
            let mut sum = Gathered::default();
            bars.iter().for_each(|bar| sum.add(&bar.strips[n], 1.0));
            [(n as f64 + 0.5) * WIDTH - REACH, sum.density() / whole]
        })
        .collect();
    let ways =
        bars.iter().map(|bar| (bar.frame().x_axis, bar.path.last().copied().unwrap_or_default())).collect();
    Ok(Wakes { ratios, around: all([0.0, BESIDE[1]]).density() / whole, ways, profile })
}

/// The bars of an L-box, and the stiffeners of a wall.
pub(super) fn wake(context: &Context) -> anyhow::Result<Vec<Check>> {
    let wakes = cast(&context.case("case.toml")?)?;
    let mut checks = Vec::new();
    for (n, [ratio, error]) in wakes.ratios.iter().enumerate() {
        let Some((way, aside)) = wakes.ways.get(n) else {
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
        checks.push(shown(format!("two lengths behind it goes aside by, bar {}, mm", n + 1), 1e3 * aside));
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

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_pcg::Pcg64;
    use tremie_numerics::DQuat;
    use tremie_suspension::Kind;

    use super::*;

    const FIBRE: f64 = 0.03;

    /// A bar of 1 cm in fluid that flows across it.
    fn bar() -> (Bar, Cells) {
        let (count, flow) = ([60, 40, 30], DVec3::new(0.2, 0.1, 0.3));
        let number = count.iter().product();
        let cells = Cells {
            size: 0.005,
            count,
            fill: vec![1.0; number],
            velocity: vec![flow; number],
            ..Cells::default()
        };
        let [start, end] = [0.0, 0.15].map(|z| DVec3::new(0.1, 0.1, z));
        (Bar::new(start, end, 0.01), cells)
    }

    /// Fibres at random, anywhere and any way.
    fn fibres() -> Inclusions {
        let form = Form::Fibre { length: FIBRE, diameter: 0.0004 };
        let kinds = vec![Kind { name: "f".into(), form, density: 7500.0 }];
        let (mut bodies, mut random) =
            (Inclusions { kinds, ..Inclusions::default() }, Pcg64::seed_from_u64(7));
        for _ in 0..8000 {
            let at = DVec3::new(0.3, 0.2, 0.15) * DVec3::from_array([(); 3].map(|()| random.random::<f64>()));
            let turned = DQuat::from_array([(); 4].map(|()| random.random_range(-1.0..1.0))).normalize();
            bodies.add(0, 0, at, turned);
        }
        bodies
    }

    #[test]
    fn fibres_at_random_show_no_wake() {
        let ((mut bar, cells), bodies) = (bar(), fibres());
        (0..3).for_each(|_| bar.look(&cells, &bodies, FIBRE));
        let way = bar.frame().x_axis;
        assert!((way - DVec3::new(0.2, 0.1, 0.0).normalize()).length() < 1e-12, "{way}");
        let [ratio, error] = bar.gathered(SHADOW).over(&bar.gathered(BESIDE));
        assert!(error > 0.03 && error < 0.3 && (ratio - 1.0).abs() < 3.0 * error, "{ratio} +- {error}");
        // Looking again at the same fibres tells nothing new.
        let (mut once, _) = self::bar();
        once.look(&cells, &bodies, FIBRE);
        let [same, like] = once.gathered(SHADOW).over(&once.gathered(BESIDE));
        assert!((same - ratio).abs() < 1e-12 && (like - error).abs() < 1e-12, "{same} +- {like}");
    }

    #[test]
    fn wakes_follow_the_flow() {
        // Rigid rotation about a point far aside: streamlines are circles about it.
        let (mut bar, mut cells) = bar();
        let middle = DVec3::new(0.1, 0.5, 0.0);
        let [nx, ny, _] = cells.count;
        for n in 0..cells.fill.len() {
            let at = cells.centre(n % nx, n / nx % ny, n / (nx * ny)) - middle;
            cells.velocity[n] = DVec3::new(-at.y, at.x, 0.0);
        }
        bar.look(&cells, &Inclusions::default(), FIBRE);
        assert!(bar.frame().x_axis.distance(DVec3::X) < 1e-12, "{}", bar.frame());
        let along = BEHIND[1] * FIBRE - 0.5 * cells.size;
        let exact = 0.4 - (0.4_f64.powi(2) - along * along).sqrt();
        let aside = bar.path.last().unwrap();
        assert!((aside / exact - 1.0).abs() < 0.1, "{aside} {exact}");
    }

    #[test]
    fn a_strip_without_fibres_is_a_wake() {
        let ((mut bar, cells), mut bodies) = (bar(), fibres());
        bar.look(&cells, &bodies, FIBRE);
        let there = bar.gathered(SHADOW).pieces;
        let ids = bodies.id.clone();
        bodies.retain(|n| !there.contains_key(&ids[n]));
        bar.strips.fill(Gathered::default());
        bar.look(&cells, &bodies, FIBRE);
        let [ratio, error] = bar.gathered(SHADOW).over(&bar.gathered(BESIDE));
        assert!(ratio == 0.0 && error < 1e-12 && bar.gathered(BESIDE).density() > 0.0, "{ratio} +- {error}");
    }
}
