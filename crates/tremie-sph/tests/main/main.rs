//! Particles against what is known of fluids.

mod simulation;

use std::f64::consts::TAU;

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
fn stepped(
    dimension: Dimension,
    spacing: f64,
    [width, height]: [f64; 2],
    jitter: f64,
    fluid: Fluid,
    stepping: Stepping,
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
    Particles::new(positions, space, fluid, stepping)
}

/// The same in implicit steps.
fn tank(dimension: Dimension, spacing: f64, size: [f64; 2], jitter: f64, fluid: Fluid) -> Particles {
    stepped(
        dimension,
        spacing,
        size,
        jitter,
        fluid,
        Stepping { courant: 0.2, longest: 0.01, explicit: false },
    )
}

/// A column of Bingham fluid that is let go begins to flow at once in long steps, too.
#[test]
fn what_is_let_go_begins_to_flow_in_time() {
    let curve = FlowCurve::Bingham { yield_stress: 25.0, plastic_viscosity: 0.1 };
    let fluid = Fluid { curve, largest_viscosity: 1000.0, ..water(0.1) };
    let [long, short] = [1.0, 5e-4].map(|longest| {
        let stepping = Stepping { courant: 0.2, longest, explicit: false };
        let mut particles = stepped(Dimension::Two, 0.005, [0.1, 0.1], 0.0, fluid, stepping);
        while particles.time() < 0.06 {
            particles.advance().unwrap();
        }
        particles.positions.iter().map(|at| at.x).fold(0.0, f64::max) - 0.1
    });
    assert!(short > 0.01 && (long / short - 1.0).abs() < 0.1, "{long} {short}");
}

/// Rate in 1/s at which four vortices in a periodic square of 1 m, so many particles along its edge, lose their energy until a time in s; exactly 4 nu (2 pi/m)^2 (Taylor and Green 1937).
fn decay(edge: usize, fluid: Fluid, explicit: bool, end: f64) -> f64 {
    let spacing = 1.0 / edge as f64;
    let full = Body::Shape(Shape::Box { min: DVec3::ZERO, max: DVec3::ONE });
    let periodic = [true, false, true];
    let space =
        Space { low: DVec3::ZERO, high: DVec3::ONE, periodic, ..Space::free(Dimension::Two, spacing) };
    let stepping = Stepping { courant: 0.25, longest: 0.1, explicit };
    let positions = nodes(&full, spacing, Dimension::Two, 0.5);
    let fluid = Fluid { gravity: DVec3::ZERO, ..fluid };
    let mut particles = Particles::new(positions, space, fluid, stepping);
    for (at, u) in particles.positions.iter().zip(&mut particles.velocities) {
        let (x, z) = (TAU * at.x, TAU * at.z);
        *u = DVec3::new(x.sin() * z.cos(), 0.0, -x.cos() * z.sin());
    }
    let energy = |particles: &Particles| particles.velocities.iter().map(|u| u.length_squared()).sum::<f64>();
    let first = energy(&particles);
    while particles.time() < end {
        particles.advance().unwrap_or_else(|error| panic!("{error}"));
    }
    -(energy(&particles) / first).ln() / particles.time()
}

/// The viscous part by velocities before and after the step, and as Wu (2016) prints it: by half of the viscosity.
#[test]
fn vortices_die_away_by_the_viscosity() {
    let exact = 4.0 * 0.05 * TAU * TAU;
    let shares = [
        decay(24, water(50.0), false, 0.1) / exact,
        decay(24, water(50.0), true, 0.1) / exact,
        2.0 * decay(24, Fluid { as_printed: true, ..water(50.0) }, false, 0.1) / exact,
    ];
    for share in shares {
        assert!((share - 1.0).abs() < 0.05, "{shares:?}");
    }
}

/// Pressure alone takes no energy from particles, while they go around their vortices.
#[test]
fn vortices_without_viscosity_stay() {
    let rate = decay(32, water(1e-3), false, 1.0);
    assert!(rate.abs() < 0.06, "{rate} 1/s");
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

/// Drops 11 particles of 2 mm across, at places in m above a floor, that are thrown down at speeds in m/s.
fn thrown(viscosity: f64, drops: &[(DVec3, f64)]) -> Particles {
    let spacing = 0.002;
    let space = Space { walls: vec![wall(DVec3::ZERO, DVec3::Z)], ..Space::free(Dimension::Two, spacing) };
    let stepping = Stepping { courant: 0.2, longest: 0.01, explicit: false };
    let one = |&(centre, speed): &(DVec3, f64)| {
        let full = Body::Shape(Shape::Sphere { centre, radius: 5.5 * spacing });
        nodes(&full, spacing, Dimension::Two, 0.0).into_iter().map(move |at| (at, -speed * DVec3::Z))
    };
    let (positions, velocities) = drops.iter().flat_map(one).unzip();
    let mut drops = Particles::new(positions, space, water(viscosity), stepping);
    drops.velocities = velocities;
    drops
}

fn lowest(drop: &Particles) -> f64 {
    drop.positions.iter().map(|at| at.z).fold(f64::INFINITY, f64::min)
}

/// Stiff paste that falls does not change, and goes as far as is seen beforehand in a step; beside a floor only as far as may be gone along walls.
#[test]
fn steps_grow_short_where_a_drop_lands() {
    let speed = 2.0;
    let mut drop = thrown(1e4, &[(0.5 * DVec3::Z, speed)]);
    let (start, spacing) = (drop.positions.clone(), 0.002);
    let length = 1.5 * spacing;
    // The linear systems are solved to a millionth of the speeds.
    while lowest(&drop) > 0.1 {
        assert!(drop.time_step() > 0.79 * length / drop.velocities[0].length());
        drop.advance().unwrap();
        let t = drop.time();
        let way = -(speed * t + 0.5 * 9.81 * t * t) * DVec3::Z;
        for (at, from) in drop.positions.iter().zip(&start) {
            assert!((*at - *from - way).length() < 0.01 * spacing, "{t}: {at} instead of {}", *from + way);
        }
    }
    while lowest(&drop) > length {
        drop.advance().unwrap();
    }
    assert!(drop.time_step() < 0.21 * length / drop.velocities[0].length());
}

/// However stiff it is, nothing throws it up again.
#[test]
fn a_drop_stays_where_it_lands() {
    let spacing = 0.002;
    for viscosity in [1e3, 1e4, 1e5, 1e6] {
        let mut drop = thrown(viscosity, &[(0.1 * DVec3::Z, 2.7)]);
        let mut down = f64::INFINITY;
        while drop.time() < 0.1 {
            drop.advance().unwrap();
            down = down.min(lowest(&drop));
            assert!(lowest(&drop) < down + 0.1 * spacing, "{viscosity}: rises at {}", drop.time());
        }
        assert!(down > 0.5 * spacing && down < 1.5 * spacing, "{viscosity}: {down}");
        let fastest = drop.velocities.iter().map(|u| u.length()).fold(0.0, f64::max);
        assert!(fastest < 5e-3, "{viscosity}: {fastest}");
    }
}

/// Nor where it lands on another, beside whose middle it does: it rolls off.
#[test]
fn a_drop_stays_on_a_drop() {
    let spacing = 0.002;
    for viscosity in [1e3, 1e4] {
        let lower = DVec3::new(0.006, 0.0, 0.012);
        let mut drops = thrown(viscosity, &[(0.1 * DVec3::Z, 2.7), (lower, 0.0)]);
        let top = |drops: &Particles| drops.positions.iter().map(|at| at.z).fold(0.0, f64::max);
        let mut down = f64::INFINITY;
        while drops.time() < 0.1 {
            drops.advance().unwrap();
            down = down.min(top(&drops));
            assert!(top(&drops) < down + 0.1 * spacing, "{viscosity}: rises at {}", drops.time());
        }
        let fastest = drops.velocities.iter().map(|u| u.length()).fold(0.0, f64::max);
        assert!(fastest < 0.1, "{viscosity}: {fastest}");
    }
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

/// A column that falls over does so in explicit steps as in implicit ones, its surface included.
#[test]
fn explicit_steps_go_where_implicit_ones_do() {
    let fallen = |explicit: bool| {
        let stepping = Stepping { courant: 0.2, longest: 0.01, explicit };
        let mut column = stepped(Dimension::Two, 0.01, [0.1, 0.15], 0.0, water(20.0), stepping);
        while column.time() < 0.4 {
            column.advance().unwrap();
        }
        let fastest = column.velocities.iter().map(|u| u.length()).fold(0.0, f64::max);
        let middle = column.positions.iter().sum::<DVec3>() / column.positions.len() as f64;
        (middle, fastest)
    };
    let ((explicit, fast), (implicit, slow)) = (fallen(true), fallen(false));
    assert!((explicit - implicit).length() < 0.002, "{explicit} {implicit}");
    assert!(fast < 1.5 * slow && slow < 1.5 * fast, "{fast} {slow}");
}

/// A block squeezed by V from both sides between plates along which it slides: as its other sides are free, the stress is the same everywhere, and the pressure 2 mu 2V/H (half of Trouton's viscosity in a plane), at the
/// surface, too, however stiff the fluid.
#[test]
fn the_surface_bears_what_viscosity_pushes_out() {
    let (half, height, speed, spacing) = (0.1, 0.1, 0.01, 0.00625);
    let rate = 2.0 * speed / height;
    for (viscosity, jitter) in [(100.0, 0.0), (1e5, 0.0), (100.0, 0.2), (1e5, 0.2)] {
        let full = Body::Shape(Shape::Box { min: DVec3::ZERO, max: DVec3::new(half, 1.0, height) });
        let mut random = Pcg64Mcg::seed_from_u64(5);
        let mut off = || jitter * spacing * random.random_range(-1.0..1.0);
        let positions = nodes(&full, spacing, Dimension::Two, 0.1);
        let positions = positions.into_iter().map(|at| at + DVec3::new(off(), 0.0, off())).collect();
        let slides = |point, normal, velocity| Wall {
            motion: Motion::Uniform(velocity * DVec3::Z),
            slip_length: f64::INFINITY,
            ..wall(point, normal)
        };
        let walls = vec![
            slides(DVec3::ZERO, DVec3::X, 0.0),
            slides(DVec3::ZERO, DVec3::Z, speed),
            slides(height * DVec3::Z, DVec3::NEG_Z, -speed),
        ];
        let space = Space { walls, ..Space::free(Dimension::Two, spacing) };
        let still = Fluid { gravity: DVec3::ZERO, ..water(viscosity) };
        let stepping = Stepping { courant: 0.2, longest: 0.01, explicit: false };
        let mut particles = Particles::new(positions, space, still, stepping);
        while particles.time() < 0.5 {
            particles.advance().unwrap();
        }
        let rate = rate / (1.0 - rate * particles.time());
        let exact = 2.0 * viscosity * rate;
        let number = particles.positions.len() as f64;
        let mean = particles.pressures.iter().sum::<f64>() / number / exact - 1.0;
        let square = |p: &f64| (p / exact - 1.0 - mean).powi(2);
        let uneven = (particles.pressures.iter().map(square).sum::<f64>() / number).sqrt();
        let moved = particles.positions.iter().zip(&particles.velocities);
        let off = moved.map(|(at, u)| (u.x - rate * at.x).abs() / (rate * half)).fold(0.0, f64::max);
        let most = if jitter == 0.0 { [0.05, 0.06, 0.01] } else { [0.12, 0.15, 0.05] };
        let found = [mean.abs(), uneven, off];
        assert!(found.iter().zip(most).all(|(of, most)| *of < most), "{viscosity} Pa s, {jitter}: {found:?}");
    }
}
