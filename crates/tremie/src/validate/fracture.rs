//! Hardened beams: the lattice, its crack and its fibres.

use std::f64::consts::PI;

use anyhow::anyhow;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use tremie_fracture::fibres::{Fibre, Orientation, Placement, count};
use tremie_fracture::standard::{openings, regression, stress_at};
use tremie_fracture::{
    Bond, Facet, Grading, Lattice, Loading, Mesh, PullOut, Reading, Setup, Softening, Trial,
};
use tremie_numerics::{DMat3, DVec3};
use tremie_output::picture::{Axis, Style};

use super::benchmark::{Check, Context, observed_order, shown};
use super::figure::Figure;

/// The matrix of Svec's thesis (7.2.2).
const MATRIX: Softening =
    Softening { strength: 2e6, kink_stress: 0.5e6, kink_opening: 0.05e-3, last_opening: 0.3e-3 };
/// Work in J/m2 to crack it.
const ENERGY: f64 = 125.0;
/// Its fibres; snubbing and spalling are assumed.
const BOND: Bond = Bond {
    modulus: 200e9,
    strength: 1050e6,
    friction: 4e6,
    hardening: 0.0,
    snubbing: 0.5,
    spalling: 1.4,
    bending: 0.0,
};
const MODULUS: f64 = 30e9;
/// Length and diameter of a fibre in m, and its share of the volume.
const FIBRE: [f64; 2] = [0.06, 0.75e-3];
const SHARE: f64 = 0.005;
/// The beam in m.
const SIZE: DVec3 = DVec3::new(0.6, 0.15, 0.15);
const FOUR_POINT: Loading = Loading::FourPoint { span: 0.45, inner: 0.15 };
const THREE_POINT: Loading = Loading::ThreePoint { span: 0.5 };
/// Far from the crack, graded lattices have nodes so far apart, in m.
const COARSEST: f64 = 0.025;

/// The thesis's beam without fibres; uniform if `finest` is `coarsest`.
fn beam(loading: Loading, finest: f64, coarsest: f64, seed: u64) -> Setup {
    Setup {
        size: SIZE,
        crack: 0.5 * SIZE.x,
        anywhere: false,
        notch: if loading == THREE_POINT { 0.025 } else { 0.0 },
        loading,
        modulus: MODULUS,
        softening: MATRIX,
        bond: BOND,
        fibres: Vec::new(),
        shear_lag: true,
        grading: Grading { finest, coarsest },
        seed,
    }
}

/// Tests a beam up to an opening in m.
fn test(setup: Setup, end: f64) -> anyhow::Result<Vec<Reading>> {
    let mut trial = Trial::new(setup)?;
    let mut readings = Vec::new();
    for opening in openings(end) {
        readings.extend(trial.advance(opening)?);
    }
    Ok(readings)
}

fn peak(readings: &[Reading]) -> anyhow::Result<Reading> {
    let top = readings.iter().max_by(|a, b| a.stress.total_cmp(&b.stress));
    top.copied().ok_or_else(|| anyhow!("there are no readings"))
}

fn worst(values: impl Iterator<Item = f64>) -> f64 {
    values.fold(0.0, |most, value| if value.is_nan() { f64::NAN } else { most.max(value.abs()) })
}

/// Nine cells, after OOFEM's test `sm/lattice3d2.in`.
pub(super) fn nine_cells(context: &Context) -> anyhow::Result<Vec<Check>> {
    let corner = |k: usize| DVec3::new((k & 1) as f64, (k >> 1 & 1) as f64, (k >> 2) as f64);
    let mut nodes: Vec<DVec3> = (0..8).map(|k| 0.7 * corner(k)).collect();
    nodes.push(DVec3::splat(0.35));
    let mut facets = Vec::new();
    for i in 0..8 {
        for axis in (0..3).filter(|axis| i >> axis & 1 == 0) {
            let middle = nodes[i] + 0.35 * DVec3::AXES[axis];
            let [u, v] = [DVec3::AXES[(axis + 1) % 3], DVec3::AXES[(axis + 2) % 3]];
            let square = [u, v, -u, -v].map(|way| middle + 0.175 * way);
            facets.push(Facet::between(&nodes, [i, i + (1 << axis)], square.to_vec()));
        }
        let inwards = (nodes[8] - nodes[i]) / 0.35;
        let hexagon = [
            [0.0, 1.0, 2.0],
            [1.0, 0.0, 2.0],
            [2.0, 0.0, 1.0],
            [2.0, 1.0, 0.0],
            [1.0, 2.0, 0.0],
            [0.0, 2.0, 1.0],
        ]
        .map(|at| nodes[i] + 0.175 * inwards * DVec3::from(at));
        facets.push(Facet::between(&nodes, [i, 8], hexagon.to_vec()));
    }
    let mut given = vec![[None; 6]; 9];
    given[0] = [Some(0.0); 6];
    for (k, cell) in given.iter_mut().enumerate().take(8).skip(1) {
        cell[0] = Some(1e-3 * (k & 1) as f64);
    }
    let reaction = Lattice::new(nodes, facets.iter(), 1.0).reactions(&given)?[0];
    Ok(vec![context.relative("reaction", "reaction at node 1", "N", -2.2533e-4, reaction)?])
}

/// Uniform strain and rigid motions.
pub(super) fn patch(context: &Context) -> anyhow::Result<Vec<Check>> {
    let mesh = Mesh::new(DVec3::new(0.3, 0.1, 0.1), 0.15, Grading { finest: 0.015, coarsest: 0.025 }, 5);
    let lattice = Lattice::of(&mesh, MODULUS);
    let strain = DMat3::from_cols_array(&[1.0, 0.4, -0.3, 0.4, -0.7, 0.2, -0.3, 0.2, 0.5]) * 1e-4;
    let moved = |of: &dyn Fn(DVec3) -> (DVec3, DVec3)| -> Vec<f64> {
        mesh.nodes
            .iter()
            .flat_map(|node| {
                let (shift, turn) = of(*node);
                shift.to_array().into_iter().chain(turn.to_array())
            })
            .collect()
    };
    let mut forces = lattice.forces(&moved(&|node| (strain * node, DVec3::ZERO)));
    for facet in mesh.sides.iter().flatten() {
        let traction = MODULUS * (strain * facet.normal) * facet.area;
        let moment = (facet.centroid - mesh.nodes[facet.cell]).cross(traction);
        for k in 0..3 {
            forces[6 * facet.cell + k] -= traction[k];
            forces[6 * facet.cell + 3 + k] -= moment[k];
        }
    }
    let left = worst(forces.into_iter()) / (MODULUS * 1e-4 * 0.015 * 0.015);
    let rigid = (0..6).map(|k| {
        let axis = DVec3::AXES[k % 3];
        let motion = |node: DVec3| if k < 3 { (axis, DVec3::ZERO) } else { (axis.cross(node), axis) };
        worst(lattice.forces(&moved(&motion)).into_iter()) / (MODULUS * 0.015)
    });
    Ok(vec![
        context.zero("strain", "forces left under uniform strain", "", left)?,
        context.zero("rigid", "forces left under six rigid motions", "", worst(rigid))?,
    ])
}

/// Cells, sides and crack plane.
pub(super) fn geometry(context: &Context) -> anyhow::Result<Vec<Check>> {
    let mut checks = Vec::new();
    for (name, grading) in [
        ("graded, 10 mm", Grading { finest: 0.01, coarsest: COARSEST }),
        ("uniform, 20 mm", Grading { finest: 0.02, coarsest: 0.02 }),
    ] {
        let mesh = Mesh::new(SIZE, 0.3, grading, 1);
        let mut open = vec![DVec3::ZERO; mesh.nodes.len()];
        let mut volume = 0.0;
        let all = mesh.facets.iter().chain(&mesh.plane).chain(mesh.sides.iter().flatten());
        for facet in all {
            for (cell, sign) in [(Some(facet.cell), 1.0), (facet.other, -1.0)] {
                let Some(cell) = cell else { continue };
                let normal = sign * facet.normal;
                open[cell] += facet.area * normal;
                volume += facet.area * (facet.centroid - mesh.nodes[cell]).dot(normal) / 3.0;
            }
        }
        let sides = mesh.sides.iter().enumerate().map(|(side, facets)| {
            let area: f64 = facets.iter().map(|facet| facet.area).sum();
            area / (SIZE.element_product() / SIZE[side / 2]) - 1.0
        });
        let plane: f64 = mesh.plane.iter().map(|facet| facet.area).sum();
        let middle = mesh.facets.iter().chain(&mesh.plane).map(|facet| {
            let other = facet.other.map_or(DVec3::NAN, |other| mesh.nodes[other]);
            (facet.centroid - 0.5 * (mesh.nodes[facet.cell] + other)).dot(facet.normal)
        });
        let told = |what: &str| format!("{what} ({name})");
        checks.extend([
            context.zero("closure", told("cells close"), "m2", worst(open.iter().map(|v| v.length())))?,
            context.relative("volume", told("volume"), "m3", SIZE.element_product(), volume)?,
            context.zero("sides", told("sides, worst"), "", worst(sides))?,
            context.relative("plane", told("crack plane"), "m2", SIZE.y * SIZE.z, plane)?,
            context.zero("middle", told("facets half-way"), "m", worst(middle))?,
        ]);
    }
    Ok(checks)
}

/// Timoshenko's deflection in m at `x` in m from a support, for 1 N, and its largest.
fn timoshenko(loading: Loading, x: f64) -> f64 {
    let stiffness = MODULUS * SIZE.y * SIZE.z.powi(3) / 12.0;
    let shear = 5.0 / 6.0 * 0.5 * MODULUS * SIZE.y * SIZE.z;
    match loading {
        Loading::FourPoint { span, inner } => {
            let x = x.min(span - x);
            let a = 0.5 * (span - inner);
            let bending = if x < a {
                x * (3.0 * span * a - 3.0 * a * a - x * x)
            } else {
                a * (3.0 * span * x - 3.0 * x * x - a * a)
            };
            bending / (12.0 * stiffness) + 0.5 * x.min(a) / shear
        }
        Loading::ThreePoint { span } => {
            let x = x.min(span - x);
            x * (3.0 * span * span - 4.0 * x * x) / (48.0 * stiffness) + 0.5 * x / shear
        }
        Loading::Tension => 0.0,
    }
}

/// The least squares of `rows . x = values`, by the normal equations.
fn fit<const N: usize>(rows: &[[f64; N]], values: &[f64]) -> [f64; N] {
    let mut a = [[0.0; N]; N];
    let mut b = [0.0; N];
    for (row, value) in rows.iter().zip(values) {
        for i in 0..N {
            b[i] += row[i] * value;
            for j in 0..N {
                a[i][j] += row[i] * row[j];
            }
        }
    }
    for k in 0..N {
        for i in k + 1..N {
            let factor = a[i][k] / a[k][k];
            for j in k..N {
                a[i][j] -= factor * a[k][j];
            }
            b[i] -= factor * b[k];
        }
    }
    for k in (0..N).rev() {
        let known: f64 = (k + 1..N).map(|j| a[k][j] * b[j]).sum();
        b[k] = (b[k] - known) / a[k][k];
    }
    b
}

/// Deflections of elastic beams.
pub(super) fn elastic(context: &Context) -> anyhow::Result<Vec<Check>> {
    let mut checks = Vec::new();
    for (name, loading, span) in [("four-point", FOUR_POINT, 0.45), ("three-point", THREE_POINT, 0.5)] {
        let mut errors = Vec::new();
        for distance in [0.02, 0.015, 0.01] {
            let trial = Trial::new(Setup { notch: 0.0, ..beam(loading, distance, distance, 1) })?;
            let u = trial.elastic();
            let (mut rows, mut values) = (Vec::new(), Vec::new());
            let start = 0.5 * (SIZE.x - span);
            // In units of the largest deflection and of the beam, so that the equations are well conditioned.
            let largest = timoshenko(loading, 0.5 * span);
            for (n, node) in trial.mesh().nodes.iter().enumerate() {
                let x = node.x - start;
                if (node.x - 0.5 * SIZE.x).abs() < 0.5 * span - 0.02 {
                    let (a, b) = (node.x / SIZE.x - 0.5, node.y / SIZE.y - 0.5);
                    rows.push([timoshenko(loading, x) / largest, 1.0, a, b, a * b]);
                    values.push(-u[6 * n + 2] / largest);
                }
            }
            let [scale, ..] = fit(&rows, &values);
            let mm = format!("{:.0} mm", 1e3 * distance);
            checks.push(context.relative(
                &mm,
                format!("deflection over Timoshenko's ({name}, {mm})"),
                "",
                1.0,
                scale,
            )?);
            errors.push((1.0 - scale).abs());
        }
        let order = observed_order(&[20, 15, 10].map(|d| 600 / d), &errors);
        checks.push(context.at_least("order", format!("order of convergence ({name})"), order)?);
    }
    Ok(checks)
}

/// The law of one spring.
pub(super) fn softening(context: &Context) -> anyhow::Result<Vec<Check>> {
    let law = MATRIX.spring(0.01, MODULUS);
    let (steps, end) = (200_000, 0.35e-3);
    let step = end / f64::from(steps);
    let area: f64 = (0..steps).map(|k| law.stress((f64::from(k) + 0.5) * step) * step).sum();
    let most = 0.04e-3;
    let back = law.secant(0.25 * most, most) * 0.25 * most;
    Ok(vec![
        context.relative("area", "area under the law", "J/m2", ENERGY, area)?,
        context.relative("unloading", "stress on the way back", "Pa", 0.25 * law.stress(most), back)?,
    ])
}

/// A prism in tension.
pub(super) fn tension(context: &Context) -> anyhow::Result<Vec<Check>> {
    let size = DVec3::new(0.2, 0.1, 0.1);
    let setup = Setup { size, crack: 0.1, ..beam(Loading::Tension, 0.02, COARSEST, 2) };
    let readings = test(setup, 0.35e-3)?;
    let work = readings.last().map_or(f64::NAN, |reading| reading.work);
    // Between the plates all springs are equal but for their lengths, and w follows from the stress.
    let opening = |stress: f64, beyond: bool| match stress {
        s if !beyond => 0.0 * s,
        s if s > MATRIX.kink_stress => {
            MATRIX.kink_opening * (MATRIX.strength - s) / (MATRIX.strength - MATRIX.kink_stress)
        }
        s => MATRIX.last_opening - s / MATRIX.kink_stress * (MATRIX.last_opening - MATRIX.kink_opening),
    };
    let top = peak(&readings)?;
    // Where nothing is borne any more, no stress tells how far the crack is open.
    let bears = readings.iter().filter(|reading| reading.stress > 1e-3 * MATRIX.strength);
    let off = bears.map(|reading| {
        let w = opening(reading.stress, reading.opening > top.opening);
        reading.deflection - reading.stress * size.x / MODULUS - w
    });
    Ok(vec![
        context.relative("work", "work over G_F A", "", 1.0, work / (ENERGY * size.y * size.z))?,
        context.relative("strength", "largest stress", "Pa", MATRIX.strength, top.stress)?,
        context.zero("elongation", "elongation, worst", "m", worst(off))?,
    ])
}

/// Uniform lattices of plain beams, in mm, and with how many seeds each.
const SPACINGS: [f64; 3] = [20.0, 15.0, 10.0];
const SEEDS: u64 = 3;

/// A plain beam by finer and finer lattices, against finite elements of the same continuum with a cohesive crack.
///
/// The finest is judged, and how fast the largest stress comes nearer. `prototype` holds the largest stress in MPa and the work that a
/// prototype of the lattice found with spacings of 10 to 15 mm.
fn continuum(context: &Context, loading: Loading, prototype: [f64; 2]) -> anyhow::Result<Vec<Check>> {
    let table = context.reference()?;
    let exact = table.last().ok_or_else(|| anyhow!("no reference"))?;
    let quantities = [
        ("peak", "largest stress", "MPa", exact["largest_stress_MPa"]),
        ("opening", "opening there", "mm", exact["opening_there_mm"]),
        ("work", "work over G_F A", "", exact["work_over_GF_A"]),
        ("tail", "stress at 0.3 mm", "MPa", exact["stress_0.3mm_MPa"]),
        ("tail", "stress at 0.5 mm", "MPa", exact["stress_0.5mm_MPa"]),
        ("tail", "stress at 1.0 mm", "MPa", exact["stress_1.0mm_MPa"]),
    ];
    let (mut lattices, mut curves) = (Vec::new(), Vec::new());
    for spacing in SPACINGS {
        let mut mean = [0.0; 6];
        for seed in 1..=SEEDS {
            let setup = beam(loading, 1e-3 * spacing, 1e-3 * spacing, seed);
            let ligament = setup.size.y * (setup.size.z - setup.notch);
            let mut trial = Trial::new(setup)?;
            // Close to each other, so that the work is not that of straight lines between them.
            let openings =
                (1..=60).map(|k| 1e-6 * f64::from(k)).chain((7..=120).map(|k| 10e-6 * f64::from(k)));
            let mut readings = Vec::new();
            for opening in openings {
                readings.extend(trial.advance(opening)?);
            }
            let top = peak(&readings)?;
            let tail = [0.3e-3, 0.5e-3, 1e-3].map(|opening| 1e-6 * stress_at(&readings, opening));
            let work = trial.last().work / (ENERGY * ligament);
            let found = [1e-6 * top.stress, 1e3 * top.opening, work, tail[0], tail[1], tail[2]];
            mean.iter_mut().zip(found).for_each(|(sum, value)| *sum += value / SEEDS as f64);
            if seed == 1 {
                curves.push((format!("{spacing} mm"), Style::Line, curve(&readings)));
            }
        }
        lattices.push((spacing, mean));
    }
    context.show(&Figure {
        name: "curves",
        title: context.definition().title.as_str(),
        x: Axis::linear("opening of the crack [mm]"),
        y: Axis::linear("nominal stress [MPa]"),
        curves,
    })?;
    let mut checks = Vec::new();
    if let Some((spacing, finest)) = lattices.last() {
        for ((tolerance, what, unit, reference), value) in quantities.into_iter().zip(*finest) {
            checks.push(context.absolute(
                tolerance,
                format!("{what} ({spacing} mm)"),
                unit,
                reference,
                value,
            )?);
        }
    }
    let above: Vec<f64> = lattices.iter().map(|(_, mean)| (mean[0] - quantities[0].3).abs()).collect();
    let order = observed_order(&SPACINGS.map(|spacing| (600.0 / spacing) as usize), &above);
    checks.push(context.at_least("order", "order of convergence of the largest stress", order)?);
    for (spacing, [stress, _, work, ..]) in lattices {
        checks.push(shown(
            format!("{spacing} mm: largest stress above the continuum's [MPa]"),
            stress - quantities[0].3,
        ));
        checks.push(shown(format!("{spacing} mm: and above the prototype's [MPa]"), stress - prototype[0]));
        checks.push(shown(format!("{spacing} mm: work above the prototype's"), work - prototype[1]));
    }
    Ok(checks)
}

/// The plain beam in four-point bending.
pub(super) fn plain(context: &Context) -> anyhow::Result<Vec<Check>> {
    continuum(context, FOUR_POINT, [3.133, 0.937])
}

/// The plain beam with a notch.
pub(super) fn notched(context: &Context) -> anyhow::Result<Vec<Check>> {
    continuum(context, THREE_POINT, [3.49, 0.926])
}

/// Stress over opening in MPa and mm.
fn curve(readings: &[Reading]) -> Vec<[f64; 2]> {
    std::iter::once([0.0; 2]).chain(readings.iter().map(|r| [1e3 * r.opening, 1e-6 * r.stress])).collect()
}

/// Cracks that go where they like.
pub(super) fn anywhere(context: &Context) -> anyhow::Result<Vec<Check>> {
    let mut checks = Vec::new();
    let size = DVec3::new(0.2, 0.1, 0.1);
    for seed in 1..=3 {
        let setup = Setup { size, crack: 0.1, anywhere: true, ..beam(Loading::Tension, 0.02, 0.02, seed) };
        let readings = test(setup, 0.35e-3)?;
        let last = readings.last().map_or(f64::NAN, |reading| reading.work);
        let told = |what: &str| format!("{what} (prism in tension, seed {seed})");
        checks.extend([
            context.relative(
                "strength",
                told("largest stress"),
                "Pa",
                MATRIX.strength,
                peak(&readings)?.stress,
            )?,
            context.zero(
                "energy",
                told("work not found"),
                "",
                worst(readings.iter().map(Reading::imbalance)),
            )?,
            shown(told("work over G_F A, less 1"), last / (ENERGY * size.y * size.z) - 1.0),
        ]);
    }
    let table = context.reference()?;
    let exact = table.last().ok_or_else(|| anyhow!("no reference"))?;
    let readings = test(Setup { anywhere: true, ..beam(THREE_POINT, 0.01, COARSEST, 1) }, 1.2e-3)?;
    let top = peak(&readings)?;
    let work = readings.last().map_or(f64::NAN, |reading| reading.work) / (ENERGY * SIZE.y * 0.125);
    let balance = worst(readings.iter().map(Reading::imbalance));
    checks.extend([
        context.absolute(
            "peak",
            "largest stress (notched beam)",
            "MPa",
            exact["largest_stress_MPa"],
            1e-6 * top.stress,
        )?,
        context.absolute(
            "opening",
            "opening there (notched beam)",
            "mm",
            exact["opening_there_mm"],
            1e3 * top.opening,
        )?,
        context.absolute("work", "work over G_F A (notched beam)", "", exact["work_over_GF_A"], work)?,
        context.zero("energy", "work not found (notched beam)", "", balance)?,
    ]);
    Ok(checks)
}

/// Against a cracked hinge.
pub(super) fn hinge(context: &Context) -> anyhow::Result<Vec<Check>> {
    let readings = test(beam(FOUR_POINT, 0.012, COARSEST, 1), 1.2e-3)?;
    let mut checks = Vec::new();
    for (opening, reference) in [(0.3e-3, 0.670), (0.5e-3, 0.257), (1.0e-3, 0.067)] {
        let stress = 1e-6 * stress_at(&readings, opening);
        checks.push(context.relative(
            "tail",
            format!("stress at {:.1} mm", 1e3 * opening),
            "MPa",
            reference,
            stress,
        )?);
    }
    checks.push(shown(
        "largest stress over the hinge's 3.40 MPa, less 1",
        peak(&readings)?.stress / 3.40e6 - 1.0,
    ));
    Ok(checks)
}

/// One fibre.
pub(super) fn single_fibre(context: &Context) -> anyhow::Result<Vec<Check>> {
    let mut checks = Vec::new();
    for length in [0.01, 0.02, 0.03] {
        let diameter = FIBRE[1];
        let law = PullOut::new(&BOND, diameter, length, 0.0);
        let force = PI * diameter * BOND.friction * length;
        let loose = 4.0 * BOND.friction * length * length / (BOND.modulus * diameter);
        let work = force * (2.0 / 3.0 * loose + 0.5 * length);
        let told = |what: &str| format!("{what} ({:.0} mm)", 1e3 * length);
        let [before, after] = [1.0 - 1e-12, 1.0 + 1e-12].map(|x| law.force(x * loose));
        checks.extend([
            context.relative("force", told("force where it comes loose"), "N", force, law.force(loose))?,
            context.relative("opening", told("opening there"), "m", loose, law.loose())?,
            context.relative("work", told("work"), "J", work, law.work(1.0))?,
            context.zero("jump", told("jump of the force"), "", (after - before) / force)?,
        ]);
    }
    Ok(checks)
}

/// Bridging stress in Pa of fibres in all directions, without spalling (Li, Stang and Krenchel 1993).
fn bridging(opening: f64, snubbing: f64, share: f64) -> f64 {
    let [length, diameter] = FIBRE;
    let x = 2.0 * opening / length;
    let loose = 2.0 * BOND.friction / BOND.modulus * length / diameter;
    let full = 0.5 * share * BOND.friction * length / diameter;
    let g = 2.0 * (1.0 + (0.5 * PI * snubbing).exp()) / (4.0 + snubbing * snubbing);
    g * full * if x < loose { 2.0 * (x / loose).sqrt() - x / loose } else { (1.0 - x).powi(2) }
}

/// Many fibres.
pub(super) fn many_fibres(context: &Context) -> anyhow::Result<Vec<Check>> {
    const FIBRES: usize = 400_000;
    /// The closed form knows no fibres that break, as steep ones do with snubbing; strength in Pa.
    const UNBROKEN: f64 = 1e12;
    let [length, diameter] = FIBRE;
    let section = 0.25 * PI * diameter * diameter;
    let mut random = Pcg64Mcg::seed_from_u64(4);
    let mut checks = Vec::new();
    // Of fibres that cross a plane, the squares of the cosines and the shorter lengths are uniform.
    let draw = |random: &mut Pcg64Mcg| (random.random::<f64>().sqrt(), 0.5 * length * random.random::<f64>());
    for snubbing in [0.0, 0.5] {
        let bond = Bond { snubbing, spalling: 0.0, strength: UNBROKEN, ..BOND };
        let laws: Vec<PullOut> = (0..FIBRES)
            .map(|_| {
                let (cosine, short) = draw(&mut random);
                PullOut::new(&bond, diameter, short, cosine.acos())
            })
            .collect();
        for opening in [0.01e-3, 0.04e-3, 0.5e-3, 1.5e-3, 2.5e-3, 3.5e-3] {
            let mean = laws.iter().map(|law| law.force(opening)).sum::<f64>() / FIBRES as f64;
            let stress = mean * 0.5 * SHARE / section;
            let quantity = format!("mean of {FIBRES}, f = {snubbing}, {:.2} mm", 1e3 * opening);
            checks.push(context.relative(
                "mean",
                quantity,
                "Pa",
                bridging(opening, snubbing, SHARE),
                stress,
            )?);
        }
    }
    // 2 % of the volume.
    let (number, size) = (2000, DVec3::new(0.2, 0.3, 0.3));
    let fibres: Vec<Fibre> = (0..number)
        .map(|_| {
            let (cosine, short) = draw(&mut random);
            let [y, z, turn] = [size.y, size.z, 2.0 * PI].map(|most| most * random.random::<f64>());
            let sine = (1.0 - cosine * cosine).sqrt();
            let way = DVec3::new(cosine, sine * turn.cos(), sine * turn.sin());
            let point = DVec3::new(0.1, y, z);
            Fibre { ends: [point - short * way, point + (length - short) * way], diameter }
        })
        .collect();
    let share = 2.0 * number as f64 * section / (size.y * size.z);
    for snubbing in [0.0, 0.5] {
        let setup = Setup {
            size,
            crack: 0.1,
            bond: Bond { snubbing, spalling: 0.0, strength: UNBROKEN, ..BOND },
            fibres: fibres.clone(),
            shear_lag: false,
            ..beam(Loading::Tension, 0.03, 0.03, 2)
        };
        let readings = test(setup, 3.5e-3)?;
        for opening in [0.5e-3, 1.5e-3, 2.5e-3, 3.5e-3] {
            let quantity = format!("{number} across a prism, f = {snubbing}, {:.2} mm", 1e3 * opening);
            let stress = stress_at(&readings, opening);
            checks.push(context.relative(
                "prism",
                quantity,
                "Pa",
                bridging(opening, snubbing, share),
                stress,
            )?);
        }
    }
    Ok(checks)
}

fn placement(orientation: Orientation) -> Placement {
    Placement { length: FIBRE[0], diameter: FIBRE[1], share: SHARE, orientation }
}

/// Fibres through sections.
pub(super) fn counts(context: &Context) -> anyhow::Result<Vec<Check>> {
    let section = 0.25 * PI * FIBRE[1] * FIBRE[1];
    let mut checks = Vec::new();
    for (name, orientation, alpha) in [
        ("in all directions", Orientation::Random, 0.5),
        ("in horizontal directions", Orientation::Planar, 2.0 / PI),
        ("along the beam", Orientation::Aligned, 1.0),
    ] {
        let fibres = placement(orientation).sow(SIZE, 11);
        // More than a fibre apart.
        let places = [0.05, 0.12, 0.2, 0.3, 0.41, 0.48, 0.55];
        let found: usize = places.iter().map(|at| count(&fibres, *at, 0.0, SIZE).fibres).sum();
        let exact = places.len() as f64 * alpha * SHARE / section * SIZE.y * SIZE.z;
        let off = (found as f64 - exact) / exact.sqrt();
        checks.push(context.zero(
            "count",
            format!("{name}: {found}, {exact:.0} expected"),
            "deviations",
            off,
        )?);
    }
    let slab = 0.216 * SHARE / (section * FIBRE[0]);
    checks.push(context.absolute("slab", "fibres of a slab", "", 40_744.0, slab.round())?);
    Ok(checks)
}

/// Residual stress over the number of fibres.
pub(super) fn fibre_count(context: &Context) -> anyhow::Result<Vec<Check>> {
    let (mut points, mut means, mut curves) = (Vec::new(), Vec::new(), Vec::new());
    let mut checks = Vec::new();
    for k in [-12.0, -5.0, -1.5, 0.0, 1.5, 5.0] {
        let mut mean = 0.0;
        for seed in 1..=2 {
            let fibres = placement(Orientation::Concentrated(k)).sow(SIZE, seed);
            let crack = count(&fibres, 0.5 * SIZE.x, 0.0, SIZE);
            let readings = test(Setup { fibres, ..beam(FOUR_POINT, 0.012, COARSEST, seed) }, 2.5e-3)?;
            let stress = 1e-6 * stress_at(&readings, 2.5e-3);
            points.push([crack.density, stress]);
            mean += 0.5 * stress;
            checks.push(shown(
                format!("stress at 2.5 mm, k = {k}, {:.0} fibres/m2 [MPa]", crack.density),
                stress,
            ));
            if seed == 1 {
                curves.push((format!("{:.0} fibres/m2", crack.density), Style::Line, curve(&readings)));
            }
        }
        means.push(mean);
    }
    let [slope, at_zero, share] = regression(&points);
    let steps = means.windows(2).filter(|pair| pair[1] > pair[0]).count();
    let start = -at_zero / slope;
    let most = points.iter().map(|point| point[0]).fold(0.0, f64::max);
    context.show(&Figure {
        name: "residual",
        title: "Stress at an opening of 2.5 mm (as Svec 2013, Figure 7.20)",
        x: Axis::linear("fibres in the crack plane [1/m2]"),
        y: Axis::linear("nominal stress [MPa]"),
        curves: vec![
            ("twelve beams".to_owned(), Style::Marks, points),
            (format!("R2 = {share:.2}"), Style::Line, vec![[start, 0.0], [most, at_zero + slope * most]]),
        ],
    })?;
    context.show(&Figure {
        name: "curves",
        title: "Beams with fewer and more fibres in the crack plane",
        x: Axis::linear("opening of the crack [mm]"),
        y: Axis::linear("nominal stress [MPa]"),
        curves,
    })?;
    let gates = vec![
        context.at_least("R2", "R2 of a straight line", share)?,
        context.absolute("start", "fibres where the line starts", "1/m2", 1700.0, start)?,
        context.at_least("steps", "steps of k in which the stress grows", steps as f64)?,
        shown("slope [MPa for 1,000 fibres/m2]", 1e3 * slope),
    ];
    Ok(gates.into_iter().chain(checks).collect())
}

/// Lattices and seeds.
pub(super) fn lattices(context: &Context) -> anyhow::Result<Vec<Check>> {
    let fibres = placement(Orientation::Random).sow(SIZE, 5);
    let (mut found, mut balance) = (Vec::new(), 0.0_f64);
    for distance in [0.012, 0.01, 0.0075] {
        for seed in 1..=3 {
            let readings =
                test(Setup { fibres: fibres.clone(), ..beam(FOUR_POINT, distance, COARSEST, seed) }, 2.5e-3)?;
            balance = balance.max(worst(readings.iter().map(Reading::imbalance)));
            let name = format!("{:.1} mm, seed {seed}", 1e3 * distance);
            found.push((name, 1e-6 * stress_at(&readings, 2.5e-3)));
        }
    }
    let mean = found.iter().map(|(_, stress)| stress).sum::<f64>() / found.len() as f64;
    let mut checks = vec![context.zero("energy", "work that was not found", "", balance)?];
    for (name, stress) in found {
        checks.push(context.relative("stress", format!("stress at 2.5 mm ({name})"), "MPa", mean, stress)?);
    }
    Ok(checks)
}

/// Beams B1, B2 and B3 out of a slab that was cast in a smooth form.
pub(super) fn slab(context: &Context) -> anyhow::Result<Vec<Check>> {
    let (mut checks, mut curves, mut stresses, mut balance) = (Vec::new(), Vec::new(), Vec::new(), 0.0_f64);
    for name in ["B1", "B2", "B3"] {
        let table = context.table(&format!("{}.csv", name.to_lowercase()))?;
        let fibres: Vec<Fibre> = table
            .iter()
            .map(|row| Fibre {
                ends: [["x1_m", "y1_m", "z1_m"], ["x2_m", "y2_m", "z2_m"]]
                    .map(|end| DVec3::from(end.map(|key| row[key]))),
                diameter: row["d_m"],
            })
            .collect();
        let crack = count(&fibres, 0.5 * SIZE.x, 0.0, SIZE);
        let readings = test(Setup { fibres, ..beam(FOUR_POINT, 0.01, COARSEST, 1) }, 2.5e-3)?;
        balance = balance.max(worst(readings.iter().map(Reading::imbalance)));
        let stress = 1e-6 * stress_at(&readings, 2.5e-3);
        checks.push(shown(format!("{name}: fibres in the crack for each m2"), crack.density));
        checks.push(shown(
            format!("{name}: mean angle to the beam's axis [degrees]"),
            crack.angle.to_degrees(),
        ));
        checks.push(shown(format!("{name}: largest stress [MPa]"), 1e-6 * peak(&readings)?.stress));
        checks.push(shown(format!("{name}: stress at 2.5 mm [MPa]"), stress));
        stresses.push(stress);
        curves.push((name.to_owned(), Style::Line, curve(&readings)));
    }
    context.show(&Figure {
        name: "curves",
        title: "Beams out of a slab (as Svec 2013, Figure 7.19)",
        x: Axis::linear("opening of the crack [mm]"),
        y: Axis::linear("nominal stress [MPa]"),
        curves,
    })?;
    checks.push(shown(
        "stress of B3 over that of B1 (the thesis's experiments: more than 10)",
        stresses[2] / stresses[0],
    ));
    checks.push(context.zero("energy", "work that was not found", "", balance)?);
    Ok(checks)
}
