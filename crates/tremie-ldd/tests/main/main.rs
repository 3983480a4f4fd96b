//! Nodes against what is known of fluids.

use std::f64::consts::TAU;

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use tremie_cloud::{Dimension, Space, Wall, nodes};
use tremie_geometry::{Body, Motion, Shape};
use tremie_ldd::{Coupling, Fluid, Nodes, Operators, Scheme, Stepping};
use tremie_numerics::DVec3;
use tremie_rheology::FlowCurve;

const STEPPING: Stepping = Stepping {
    courant: 0.3,
    longest: 0.01,
    coupling: Coupling::Incremental,
    scheme: Scheme::Lagged,
    operators: Operators::Exact,
};

fn wall(point: DVec3, normal: DVec3) -> Wall {
    let body = Body::Shape(Shape::HalfSpace { point, normal });
    Wall { body, motion: Motion::REST, sliding: DVec3::ZERO, slip_length: 0.0, hides: false }
}

fn fluid(curve: FlowCurve, largest_viscosity: f64) -> Fluid {
    Fluid { density: 1000.0, curve, largest_viscosity, gravity: -9.81 * DVec3::Z }
}

fn water(viscosity: f64) -> Fluid {
    fluid(FlowCurve::Newtonian { viscosity }, f64::INFINITY)
}

/// A tank 0.2 m wide, open at the top, and fluid in it so wide and high in m.
fn tank(
    dimension: Dimension,
    spacing: f64,
    [width, height]: [f64; 2],
    jitter: f64,
    fluid: Fluid,
    stepping: Stepping,
) -> Nodes {
    let size = DVec3::new(width, 0.2, height);
    let full = Body::Shape(Shape::Box { min: DVec3::ZERO, max: size });
    let mut walls =
        vec![wall(DVec3::ZERO, DVec3::X), wall(DVec3::splat(0.2), DVec3::NEG_X), wall(DVec3::ZERO, DVec3::Z)];
    if dimension == Dimension::Three {
        walls.extend([wall(DVec3::ZERO, DVec3::Y), wall(DVec3::splat(0.2), DVec3::NEG_Y)]);
    }
    let mut random = Pcg64Mcg::seed_from_u64(5);
    let mut positions = nodes(&full, spacing, dimension, 0.1);
    for at in positions.iter_mut().filter(|at| at.z < size.z - spacing) {
        let mut off = || jitter * spacing * random.random_range(-1.0..1.0);
        let off = DVec3::new(off(), off(), off());
        *at += if dimension == Dimension::Two { off.with_y(0.0) } else { off };
    }
    let space = Space { walls, ..Space::free(dimension, spacing) };
    Nodes::new(positions, space, fluid, stepping)
}

/// Rate in 1/s at which four vortices in a periodic square of 1 m, so many nodes along its edge, lose their energy until a time in s; exactly 4 nu (2 pi/m)^2 (Taylor and Green 1937).
fn decay(edge: usize, fluid: Fluid, stepping: Stepping, end: f64) -> f64 {
    let spacing = 1.0 / edge as f64;
    let full = Body::Shape(Shape::Box { min: DVec3::ZERO, max: DVec3::ONE });
    let periodic = [true, false, true];
    let space =
        Space { low: DVec3::ZERO, high: DVec3::ONE, periodic, ..Space::free(Dimension::Two, spacing) };
    let positions = nodes(&full, spacing, Dimension::Two, 0.5);
    let fluid = Fluid { gravity: DVec3::ZERO, ..fluid };
    let mut nodes = Nodes::new(positions, space, fluid, stepping);
    for (at, u) in nodes.positions.iter().zip(&mut nodes.velocities) {
        let (x, z) = (TAU * at.x, TAU * at.z);
        *u = DVec3::new(x.sin() * z.cos(), 0.0, -x.cos() * z.sin());
    }
    let energy = |nodes: &Nodes| nodes.velocities.iter().map(|u| u.length_squared()).sum::<f64>();
    let first = energy(&nodes);
    while nodes.time() < end {
        nodes.advance().unwrap_or_else(|error| panic!("{error}"));
    }
    println!("energy {} nearest {}", energy(&nodes) / first, nearest(&nodes));
    -(energy(&nodes) / first).ln() / nodes.time()
}

/// Smallest distance of two nodes in spacings.
fn nearest(nodes: &Nodes) -> f64 {
    let near = tremie_cloud::Neighbours::within(&nodes.positions, 0.1);
    let of =
        |n: usize| near.of(n).iter().map(move |m| nodes.positions[n].distance(nodes.positions[*m as usize]));
    (0..nodes.positions.len()).flat_map(of).fold(f64::MAX, f64::min)
}

#[test]
fn vortices_die_away() {
    for (coupling, operators) in [
        (Coupling::Incremental, Operators::Exact),
        (Coupling::PressureFirst, Operators::Exact),
        (Coupling::Incremental, Operators::Paper),
        (Coupling::PressureFirst, Operators::Paper),
    ] {
        for edge in [32, 64] {
            let stepping = Stepping { coupling, operators, ..STEPPING };
            let rate = decay(edge, water(10.0), stepping, 1.0);
            println!("{coupling:?} {operators:?} {edge}: {}", rate / (4.0 * TAU * TAU / 100.0));
        }
    }
}

#[test]
fn fluid_at_rest_stays_at_rest() {
    for dimension in [Dimension::Two, Dimension::Three] {
        for jitter in [0.1, 0.2] {
            for coupling in [Coupling::Incremental, Coupling::PressureFirst] {
                let stepping = Stepping { coupling, ..STEPPING };
                let mut nodes = tank(dimension, 0.02, [0.2, 0.2], jitter, water(1.0), stepping);
                for _ in 0..100 {
                    nodes.advance().unwrap();
                }
                let fastest = nodes.velocities.iter().map(|u| u.length()).fold(0.0, f64::max);
                let off = nodes.positions.iter().zip(&nodes.pressures);
                let off = off.map(|(at, p)| (p - 9810.0 * (0.19 - at.z)).abs()).fold(0.0, f64::max);
                println!("{dimension:?} {jitter} {coupling:?}: {fastest} {off} {:?}", nodes.iterations);
            }
        }
    }
}

#[test]
fn a_column_collapses() {
    for curve in [
        FlowCurve::Newtonian { viscosity: 1.0 },
        FlowCurve::Bingham { yield_stress: 50.0, plastic_viscosity: 1.0 },
    ] {
        for coupling in [Coupling::Incremental, Coupling::PressureFirst] {
            let stepping = Stepping { coupling, ..STEPPING };
            let mut nodes = tank(Dimension::Two, 0.005, [0.1, 0.15], 0.0, fluid(curve, 1000.0), stepping);
            let mut n = 0;
            while nodes.time() < 1.0 {
                if let Err(e) = nodes.advance() {
                    println!("failed at {} {e}", nodes.time());
                    break;
                }
                n += 1;
                if n % 40 == 0 {
                    let front = nodes.positions.iter().map(|at| at.x).fold(0.0, f64::max);
                    let top = nodes.positions.iter().map(|at| at.z).fold(0.0, f64::max);
                    let fastest = nodes.velocities.iter().map(|u| u.length()).fold(0.0, f64::max);
                    let mean: f64 =
                        nodes.positions.iter().map(|at| at.z).sum::<f64>() / nodes.positions.len() as f64;
                    println!(
                        "{:.3} front {front:.4} top {top:.4} fastest {fastest:.3} mean height {mean:.5} nearest {:.3} its {:?}",
                        nodes.time(),
                        nearest(&nodes) / 0.005,
                        nodes.iterations
                    );
                }
            }
            println!("{curve:?} {coupling:?} steps {n}");
        }
    }
}
