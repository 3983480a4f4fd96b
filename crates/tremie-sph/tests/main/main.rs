//! Particles against what is known of fluids.

mod simulation;

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use tremie_cloud::{Dimension, nodes};
use tremie_geometry::{Body, Motion, Shape};
use tremie_numerics::DVec3;
use tremie_rheology::FlowCurve;
use tremie_sph::{Fluid, Particles, Space, Stepping, Wall};

fn wall(point: DVec3, normal: DVec3) -> Wall {
    let body = Body::Shape(Shape::HalfSpace { point, normal });
    Wall { body, motion: Motion::REST, sliding: DVec3::ZERO, slip_length: 0.0, hides: false }
}

fn water(viscosity: f64) -> Fluid {
    Fluid {
        density: 1000.0,
        curve: FlowCurve::Newtonian { viscosity },
        largest_viscosity: f64::INFINITY,
        gravity: -9.81 * DVec3::Z,
        as_printed: false,
    }
}

/// A tank 0.2 m wide, open at the top, and fluid in it so wide and high in m.
fn tank(
    dimension: Dimension,
    spacing: f64,
    [width, height]: [f64; 2],
    jitter: f64,
    fluid: Fluid,
) -> Particles {
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
    let stepping = Stepping { courant: 0.2, longest: 0.01, explicit: false };
    Particles::new(positions, space, fluid, stepping)
}

/// On any cloud: a hydrostatic pressure is linear.
#[test]
fn fluid_in_a_tank_stays_at_rest_under_its_weight() {
    for (dimension, spacing, steps) in [(Dimension::Two, 0.01, 100), (Dimension::Three, 0.02, 15)] {
        let mut particles = tank(dimension, spacing, [0.2, 0.2], 0.1, water(1.0));
        for _ in 0..steps {
            particles.advance().unwrap();
        }
        let top = particles.positions.iter().map(|at| at.z).fold(0.0, f64::max);
        let off = particles.positions.iter().zip(&particles.pressures);
        let off = off.map(|(at, p)| (p - 9810.0 * (top - at.z)).abs()).fold(0.0, f64::max) / 1962.0;
        let fastest = particles.velocities.iter().map(|u| u.length()).fold(0.0, f64::max);
        assert!(off < 1e-7, "{dimension:?}: {off:e}");
        assert!(fastest < 1e-6, "{dimension:?}: {fastest:e}");
    }
}

/// A column falls over, stays in the tank, keeps its volume and comes to rest level.
#[test]
fn a_column_falls_over() {
    let mut particles = tank(Dimension::Two, 0.01, [0.1, 0.2], 0.0, water(5.0));
    while particles.time() < 2.0 {
        particles.advance().unwrap();
    }
    let inside = |at: &DVec3| at.x > 0.0 && at.x < 0.2 && at.z > 0.0 && at.y == 0.1;
    assert!(particles.positions.iter().all(inside));
    // Of a tank that is filled to 0.1 m.
    let middle = particles.positions.iter().sum::<DVec3>() / particles.positions.len() as f64;
    assert!((middle - DVec3::new(0.1, 0.1, 0.05)).length() < 0.003, "{middle}");
    let fastest = particles.velocities.iter().map(|u| u.length()).fold(0.0, f64::max);
    assert!(fastest < 0.01, "{fastest}");
}

#[test]
fn the_same_bits_on_any_number_of_threads() {
    let with = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let mut particles = tank(Dimension::Two, 0.01, [0.1, 0.2], 0.1, water(5.0));
            for _ in 0..10 {
                particles.advance().unwrap();
            }
            particles.positions
        })
    };
    assert_eq!(with(1), with(3));
}
