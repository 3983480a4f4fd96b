use std::f64::consts::PI;

use approx::assert_relative_eq;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use tremie_numerics::DQuat;

use super::*;
use crate::{Amount, AtWalls, Direction, Flat, Form, Kind, Order, Region, Wall, place};

const SPHERE: u16 = 0;
const FIBRE: u16 = 1;
const ELLIPSOID: u16 = 2;

fn bodies() -> Inclusions {
    let kind = |name: &str, form, density| Kind { name: name.into(), form, density };
    Inclusions {
        kinds: vec![
            kind("sphere", Form::Sphere { diameter: 0.02 }, 2600.0),
            kind("fibre", Form::Fibre { length: 0.06, diameter: 0.00075 }, 7850.0),
            kind("ellipsoid", Form::Ellipsoid { half_axes: DVec3::new(0.01, 0.006, 0.014) }, 2600.0),
        ],
        ..Inclusions::default()
    }
}

fn vector(random: &mut Pcg64Mcg) -> DVec3 {
    DVec3::from_array(std::array::from_fn(|_| random.random_range(-1.0..1.0)))
}

fn turn(random: &mut Pcg64Mcg) -> DQuat {
    DQuat::from_scaled_axis(3.0 * vector(random))
}

fn masses(bodies: &Inclusions) -> Vec<Response> {
    (0..bodies.len())
        .map(|n| {
            let density = bodies.kinds[usize::from(bodies.kind[n])].density;
            Response::of_mass(bodies.form(n), density, bodies.orientation[n])
        })
        .collect()
}

fn advance(bodies: &mut Inclusions, time_step: f64) {
    for n in 0..bodies.len() {
        bodies.position[n] += time_step * bodies.velocity[n];
        let turn = DQuat::from_scaled_axis(time_step * bodies.angular_velocity[n]);
        bodies.orientation[n] = (turn * bodies.orientation[n]).normalize();
    }
}

/// Half spaces, and endless bars along an axis, by a point, the axis and the radius.
#[derive(Default)]
struct Room {
    planes: Vec<Flat>,
    bars: Vec<(DVec3, DVec3, f64)>,
}

impl Walls for Room {
    fn flat(&self) -> &[Flat] {
        &self.planes
    }

    fn nearest(&self, at: DVec3, within: f64) -> Option<Wall> {
        let bars = self.bars.iter().map(|(point, axis, radius)| {
            let off = (at - point).reject_from_normalized(*axis);
            (off.length() - radius, off.normalize())
        });
        let (distance, normal) = bars.min_by(|a, b| a.0.total_cmp(&b.0))?;
        (distance <= within).then_some(Wall { distance, normal, velocity: DVec3::ZERO })
    }
}

/// A plane through a point.
fn plane(point: DVec3, normal: DVec3) -> Flat {
    Flat { normal, place: normal.dot(point), velocity: DVec3::ZERO }
}

fn floor() -> Room {
    Room { planes: vec![plane(DVec3::ZERO, DVec3::Z)], ..Room::default() }
}

/// Worst overlap of all pairs and walls, as a share of the lesser diameter, by asking all.
fn worst(bodies: &Inclusions, walls: &impl Walls, periods: &Periods) -> f64 {
    let outlines: Vec<Outline> = (0..bodies.len()).map(|n| Outline::of(bodies, n)).collect();
    let (mut worst, mut touches) = (0.0_f64, Vec::new());
    for (n, p) in outlines.iter().enumerate() {
        for q in &outlines[..n] {
            let way = periods.shortest(q.centre - p.centre);
            if way.length() < p.reach() + q.reach() {
                worst = worst.max(-gap(p, q, way).distance / p.thickness.min(q.thickness));
            }
        }
        near_walls(p, walls, 0.0, &mut touches);
        worst = touches.iter().map(|touch| -touch.distance / p.thickness).fold(worst, f64::max);
    }
    worst
}

fn law(restitution: f64, friction: f64) -> Contacts {
    Contacts::new(ContactLaw { restitution, friction })
}

/// A step in vacuum of bodies that touch, without the way that they go in it.
fn meet(bodies: &mut Inclusions, mut contacts: Contacts, walls: &impl Walls) {
    let (responses, periods) = (masses(bodies), Periods::default());
    contacts.resolve(bodies, &responses, walls, &periods, Film::default(), 1e-3);
    contacts.separate(bodies, &responses, walls, &periods, Film::default(), 1e-3);
}

/// Momentum, angular momentum about the origin, and energy.
fn sums(bodies: &Inclusions) -> (DVec3, DVec3, f64) {
    let (mut momentum, mut turning, mut energy) = (DVec3::ZERO, DVec3::ZERO, 0.0);
    for (n, response) in masses(bodies).iter().enumerate() {
        let (v, w) = (bodies.velocity[n], bodies.angular_velocity[n]);
        let (p, l) = (response.linear.inverse() * v, response.angular.inverse() * w);
        momentum += p;
        turning += bodies.position[n].cross(p) + l;
        energy += 0.5 * (p.dot(v) + l.dot(w));
    }
    (momentum, turning, energy)
}

/// A crowd at random places that overlap, all with random velocities.
fn crowd(seed: u64, number: usize, size: f64, kinds: &[u16]) -> Inclusions {
    let (mut crowd, mut random) = (bodies(), Pcg64Mcg::seed_from_u64(seed));
    for n in 0..number {
        crowd.add(kinds[n % kinds.len()], 0, size * vector(&mut random), turn(&mut random));
        crowd.velocity[n] = vector(&mut random);
        crowd.angular_velocity[n] = 10.0 * vector(&mut random);
    }
    crowd
}

#[test]
fn spheres_meet_head_on() {
    for restitution in [0.0, 0.3, 1.0] {
        let mut pair = bodies();
        pair.kinds.push(Kind { density: 1300.0, ..pair.kinds[0].clone() });
        pair.add(SPHERE, 0, DVec3::ZERO, DQuat::IDENTITY);
        pair.add(3, 0, DVec3::new(0.02, 0.0, 0.0), DQuat::IDENTITY);
        pair.velocity = vec![DVec3::X, -0.5 * DVec3::X];
        meet(&mut pair, law(restitution, 0.6), &());
        // Masses 2 and 1: the centre of mass moves with 0.5 m/s.
        assert_relative_eq!(pair.velocity[0].x, 0.5 - restitution * 0.5, epsilon = 1e-12);
        assert_relative_eq!(pair.velocity[1].x, 0.5 + restitution, epsilon = 1e-12);
        assert_eq!(pair.contacts, [1, 1]);
    }
}

/// A sphere meets a wall askew: it rolls off, or slides, by the cone of friction.
#[test]
fn friction_stops_a_sphere_at_a_wall_or_does_all_it_can() {
    let (e, mu, down) = (0.4, 0.3, 1.0);
    for across in [0.2, 1.0, 1.4, 1.6, 5.0] {
        let mut one = bodies();
        one.add(SPHERE, 0, DVec3::new(0.0, 0.0, 0.01), DQuat::IDENTITY);
        one.velocity[0] = DVec3::new(across, 0.0, -down);
        meet(&mut one, law(e, mu), &floor());
        let (normal, stopping) = ((1.0 + e) * down, across * 2.0 / 7.0);
        let braked = stopping.min(mu * normal);
        assert_relative_eq!(one.velocity[0].z, e * down, epsilon = 1e-12);
        assert_relative_eq!(one.velocity[0].x, across - braked, epsilon = 1e-12);
        // I = 2/5 m r^2: the spin is 5/2 of the braking over the radius.
        assert_relative_eq!(one.angular_velocity[0].y, 2.5 * braked / 0.01, epsilon = 1e-9);
    }
}

/// Eq. 2.25 for a rod whose end meets a smooth wall.
#[test]
fn a_fibre_falls_on_its_end() {
    let (mut one, tilt) = (bodies(), 0.7_f64);
    let axis = DVec3::new(tilt.cos(), 0.0, tilt.sin());
    let centre = DVec3::Z * (0.03 * tilt.sin() + 0.000375);
    one.add(FIBRE, 0, centre, DQuat::from_rotation_arc(DVec3::Z, axis));
    one.velocity[0] = DVec3::new(0.3, 0.0, -1.0);
    meet(&mut one, law(0.5, 0.0), &floor());
    let gyration = one.form(0).gyration().x;
    let lever = 0.03 * tilt.cos();
    let impulse = 1.5 / (1.0 + lever * lever / gyration);
    assert_relative_eq!(one.velocity[0].z, impulse - 1.0, epsilon = 1e-12);
    assert_relative_eq!(one.velocity[0].x, 0.3, epsilon = 1e-12);
    assert_relative_eq!(one.angular_velocity[0].y, impulse * lever / gyration, epsilon = 1e-9);
}

#[test]
fn crowds_keep_momentum_and_gain_no_energy() {
    for seed in 0..20 {
        let mut crowd = crowd(seed, 120, 0.05, &[SPHERE, FIBRE, ELLIPSOID, FIBRE]);
        let responses = masses(&crowd);
        let before = sums(&crowd);
        law(0.0, 0.6).resolve(&mut crowd, &responses, &(), &Periods::default(), Film::default(), 1e-4);
        let after = sums(&crowd);
        // What all have, added up without signs.
        let all: f64 = responses.iter().map(|r| r.linear.x_axis.x.recip()).sum();
        assert!((after.0 - before.0).length() < 1e-13 * all, "momentum: {}", after.0 - before.0);
        assert!((after.1 - before.1).length() < 1e-14 * all, "angular momentum: {}", after.1 - before.1);
        assert!(after.2 <= before.2, "energy: {} {}", before.2, after.2);
        assert!(crowd.contacts.iter().sum::<u32>() > 20, "something must have met");
    }
}

/// The same crowd between films: they take energy, too, however stiff.
#[test]
fn films_are_stable() {
    for viscosity in [1.0, 1e3, 1e9] {
        let mut crowd = crowd(5, 100, 0.05, &[SPHERE]);
        let responses = masses(&crowd);
        let before = sums(&crowd);
        law(0.0, 0.0).resolve(
            &mut crowd,
            &responses,
            &(),
            &Periods::default(),
            Film { viscosity, grain: 0.005 },
            1e-3,
        );
        let after = sums(&crowd);
        assert!(after.2 < before.2 && after.2.is_finite());
        assert!((after.0 - before.0).length() < 1e-12);
    }
}

/// m du/dt = -c(h) u, dh/dt = u has m u + C(h) = constant with C' = c: the film stops a sphere before it meets the wall, or does not.
#[test]
fn a_film_brakes_a_sphere_as_its_integral_has_it() {
    let film = Film { viscosity: 10.0, grain: 0.005 };
    let (mut one, width, time_step) = (bodies(), film.width(), 1e-6);
    one.add(SPHERE, 0, DVec3::Z * (0.01 + width), DQuat::IDENTITY);
    one.velocity[0] = -2.0 * DVec3::Z;
    let responses = masses(&one);
    let mut contacts = law(0.0, 0.0);
    let integral = |h: f64| 6.0 * PI * 10.0 * 1e-4 * ((h / width).ln() - (h - width) / width);
    for _ in 0..1500 {
        contacts.resolve(&mut one, &responses, &floor(), &Periods::default(), film, time_step);
        advance(&mut one, time_step);
    }
    let h = one.position[0].z - 0.01;
    assert!(h < 0.6 * width && h > 0.2 * width, "{h}");
    let speed = -2.0 - integral(h) * responses[0].linear.x_axis.x;
    assert_relative_eq!(one.velocity[0].z, speed, max_relative = 2e-3);
}

/// Down an incline a sphere rolls with 5/7 g sin, or slides with g (sin - mu cos) where that is more.
#[test]
fn a_sphere_rolls_or_slides_down_an_incline() {
    let time_step = 1e-4;
    for (angle, friction) in [(0.3_f64, 0.6), (0.8, 0.1)] {
        let mut one = bodies();
        one.add(SPHERE, 0, 0.01 * DVec3::Z, DQuat::IDENTITY);
        let gravity = 9.81 * DVec3::new(angle.sin(), 0.0, -angle.cos());
        let responses = masses(&one);
        let mut contacts = law(0.0, friction);
        for _ in 0..2000 {
            one.velocity[0] += time_step * gravity;
            contacts.resolve(&mut one, &responses, &floor(), &Periods::default(), Film::default(), time_step);
            advance(&mut one, time_step);
        }
        let rolls = 5.0 / 7.0 * 9.81 * angle.sin();
        let slides = 9.81 * (angle.sin() - friction * angle.cos());
        assert_relative_eq!(one.velocity[0].x, 0.2 * rolls.max(slides), max_relative = 1e-6);
        assert_relative_eq!(one.position[0].z, 0.01, epsilon = 1e-9);
        assert_eq!(one.contacts[0], 1);
    }
}

#[test]
fn a_stack_of_spheres_stands() {
    let (mut stack, time_step) = (bodies(), 5e-4);
    for n in 0..6 {
        stack.add(SPHERE, 0, DVec3::Z * (0.01 + 0.02 * f64::from(n)), DQuat::IDENTITY);
    }
    let responses = masses(&stack);
    let mut contacts = Contacts::default();
    for _ in 0..2000 {
        stack.velocity.iter_mut().for_each(|v| v.z -= 9.81 * time_step);
        contacts.resolve(&mut stack, &responses, &floor(), &Periods::default(), Film::default(), time_step);
        advance(&mut stack, time_step);
        contacts.separate(&mut stack, &responses, &floor(), &Periods::default(), Film::default(), time_step);
        assert!(worst(&stack, &floor(), &Periods::default()) < 0.003);
    }
    assert_relative_eq!(stack.position[5].z, 0.11, max_relative = 0.01);
    assert_eq!(stack.contacts, [2, 2, 2, 2, 2, 1]);
}

#[test]
fn each_sphere_of_a_high_stack_bears_what_lies_on_it() {
    const NUMBER: usize = 40;
    const MEAN_OF: usize = 200;
    let (mut stack, time_step) = (bodies(), 5e-4);
    for n in 0..NUMBER {
        stack.add(SPHERE, 0, DVec3::Z * (0.01 + 0.02 * n as f64), DQuat::IDENTITY);
    }
    let responses = masses(&stack);
    let weight = 9.81 / responses[0].linear.z_axis.z;
    let mut contacts = Contacts::default();
    // By how many each sphere is borne by what is under it.
    let mut borne = [0.0; NUMBER];
    for step in 0..400 {
        stack.velocity.iter_mut().for_each(|v| v.z -= 9.81 * time_step);
        contacts.resolve(&mut stack, &responses, &floor(), &Periods::default(), Film::default(), time_step);
        advance(&mut stack, time_step);
        contacts.separate(&mut stack, &responses, &floor(), &Periods::default(), Film::default(), time_step);
        for ((lower, upper), force) in contacts.forces.iter().filter(|_| step + MEAN_OF >= 400) {
            let upper = if *upper == u64::MAX { *lower } else { *upper };
            borne[upper as usize] += force.normal / (weight * MEAN_OF as f64);
        }
    }
    for (under, borne) in borne.into_iter().enumerate() {
        assert_relative_eq!(borne, (NUMBER - under) as f64, max_relative = 0.01);
    }
}

/// What the fluid makes of a fibre: its drag takes up nearly all of an impulse.
fn in_fluid(bodies: &Inclusions) -> Vec<Response> {
    let drag = |response: Response| Response {
        linear: response.linear * 0.04,
        angular: response.angular * 0.03,
        ..response
    };
    masses(bodies).into_iter().map(drag).collect()
}

/// The fluid carries a fibre across a bar, on a floor that is nearer than the bar, and with the end over another one.
#[test]
fn a_fibre_is_blocked_by_a_bar() {
    for (lift, angle, shift) in
        [(0.05, 0.0, 0.0), (0.000375, 0.0, 0.0), (0.000375, 0.1, 0.0), (0.05, 0.2, 0.004)]
    {
        let walls = Room { bars: vec![(DVec3::X * 0.02, DVec3::Z, 0.006)], ..floor() };
        let (mut one, time_step) = (bodies(), 5e-4);
        let axis = DVec3::new(f64::sin(angle), f64::cos(angle), 0.0);
        one.add(FIBRE, 0, DVec3::new(0.0, shift, lift), DQuat::from_rotation_arc(DVec3::Z, axis));
        let mut contacts = law(0.0, 0.3);
        for _ in 0..200 {
            // 0.5 m/s: 0.25 mm a step, a third of a diameter.
            let responses = in_fluid(&one);
            one.velocity[0] = 0.5 * DVec3::X;
            one.angular_velocity[0] = DVec3::ZERO;
            contacts.resolve(&mut one, &responses, &walls, &Periods::default(), Film::default(), time_step);
            advance(&mut one, time_step);
            contacts.separate(&mut one, &responses, &walls, &Periods::default(), Film::default(), time_step);
            assert!(worst(&one, &walls, &Periods::default()) < 0.01);
        }
        if angle == 0.0 {
            assert_relative_eq!(one.position[0].x, 0.014 - 0.000375, epsilon = 1e-5);
            assert!(one.velocity[0].length() < 1e-6);
        }
    }
}

/// A fibre, a sphere and an ellipsoid that are carried into a corner end there, out of all three walls.
#[test]
fn corners_hold_from_all_sides() {
    let planes = [DVec3::X, DVec3::Y, DVec3::Z].map(|normal| plane(DVec3::ZERO, normal)).to_vec();
    let walls = Room { planes, bars: vec![] };
    for kind in [SPHERE, FIBRE, ELLIPSOID] {
        let mut one = bodies();
        one.add(kind, 0, DVec3::splat(0.04), DQuat::from_rotation_arc(DVec3::Z, DVec3::X));
        let mut contacts = Contacts::default();
        for _ in 0..500 {
            let responses = in_fluid(&one);
            one.velocity[0] = DVec3::splat(-0.3);
            one.angular_velocity[0] = DVec3::ZERO;
            contacts.resolve(&mut one, &responses, &walls, &Periods::default(), Film::default(), 1e-3);
            advance(&mut one, 1e-3);
            contacts.separate(&mut one, &responses, &walls, &Periods::default(), Film::default(), 1e-3);
            assert!(worst(&one, &walls, &Periods::default()) < 0.01, "{kind}");
        }
        assert!(one.velocity[0].length() < 1e-3, "{kind}: {}", one.velocity[0]);
        assert_eq!(one.contacts[0], 1);
    }
}

/// Neighbours that a search through all pairs finds, in periodic space and not, with bodies of very different sizes, while all are carried far
/// and some past each other.
#[test]
fn the_list_holds_all_that_are_near() {
    let periodic = Periods([Some(0.3), None, Some(0.24)]);
    for (periods, shear) in [(Periods::default(), 0.01), (periodic, 0.01), (periodic, 0.001)] {
        let mut crowd = crowd(7, 900, 0.15, &[SPHERE, FIBRE, FIBRE, ELLIPSOID]);
        crowd.kinds.push(Kind {
            name: "grain".into(),
            form: Form::Sphere { diameter: 0.001 },
            density: 2600.0,
        });
        for n in (0..900).step_by(5) {
            crowd.kind[n] = 3;
        }
        let mut neighbours = Neighbours::default();
        for step in 0..12 {
            // Some come later.
            let there = 845 + 5 * step;
            let outlines: Vec<Outline> = (0..there).map(|n| Outline::of(&crowd, n)).collect();
            let ways: Vec<(DVec3, f64)> = (0..there)
                .map(|n| {
                    let sheared = shear * crowd.position[n].y + 2e-5 * f64::from(n as u32 % 7);
                    (DVec3::new(5e-4 + sheared, 1e-4, 0.0), 2e-5 * f64::from(n as u32 % 3))
                })
                .collect();
            neighbours
                .update(&crowd.id[..there], &outlines, &periods, 0.0005, 0.001, 0.0005..=0.002, |n| ways[n]);
            let mut listed: Vec<(usize, usize)> = (0..there)
                .flat_map(|n| neighbours.of(n).map(move |k| (n.min(k as usize), n.max(k as usize))))
                .collect();
            let number = listed.len();
            listed.sort_unstable();
            listed.dedup();
            assert_eq!(listed.len(), number, "a pair twice");
            for b in 0..there {
                for a in 0..b {
                    let (p, q) = (&outlines[a], &outlines[b]);
                    let halo = 0.0005 * f64::from(u8::from(p.is_sphere()) + u8::from(q.is_sphere()));
                    let way = (ways[a].0 - ways[b].0).length() + ways[a].1 + ways[b].1;
                    let near = gap(p, q, periods.shortest(q.centre - p.centre)).distance < 0.001 + halo + way;
                    assert!(!near || listed.binary_search(&(a, b)).is_ok(), "step {step}: {a} {b}");
                }
            }
            for (n, (way, turn)) in ways.into_iter().enumerate() {
                crowd.position[n] = periods.inside(DVec3::ZERO, crowd.position[n] + way);
                let turn = DQuat::from_rotation_y(turn / outlines[n].reach());
                crowd.orientation[n] = turn * crowd.orientation[n];
            }
        }
    }
}

fn state(bodies: &Inclusions) -> Vec<u64> {
    let vectors = bodies.position.iter().chain(&bodies.velocity).chain(&bodies.angular_velocity);
    vectors.flat_map(|v| v.to_array().map(f64::to_bits)).collect()
}

fn run(mut crowd: Inclusions, steps: usize) -> Inclusions {
    let mut contacts = Contacts::default();
    let film = Film { viscosity: 1.0, grain: 0.004 };
    for _ in 0..steps {
        let responses = masses(&crowd);
        contacts.resolve(&mut crowd, &responses, &floor(), &Periods::default(), film, 1e-4);
        advance(&mut crowd, 1e-4);
        contacts.separate(&mut crowd, &responses, &floor(), &Periods::default(), film, 1e-4);
    }
    crowd
}

#[test]
fn the_same_bits_on_any_number_of_threads_and_in_any_order_of_memory() {
    let with = |threads, crowd: &Inclusions| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| run(crowd.clone(), 5))
    };
    let mut crowd = crowd(11, 3000, 0.2, &[SPHERE, FIBRE, ELLIPSOID, FIBRE, FIBRE]);
    crowd.position.iter_mut().for_each(|at| at.z += 0.2);
    let one = with(1, &crowd);
    assert_eq!(state(&one), state(&with(2, &crowd)));
    let mut backwards = crowd.clone();
    backwards.id.reverse();
    backwards.kind.reverse();
    backwards.position.reverse();
    backwards.orientation.reverse();
    backwards.velocity.reverse();
    backwards.angular_velocity.reverse();
    let mut two = with(2, &backwards);
    two.position.reverse();
    two.velocity.reverse();
    two.angular_velocity.reverse();
    assert_eq!(state(&one), state(&two));
}

#[test]
fn nothing_depends_on_how_space_is_turned() {
    let mut crowd = crowd(13, 200, 0.06, &[SPHERE, FIBRE, ELLIPSOID, FIBRE]);
    // Apart first: in the depth of an ellipsoid there are two ways out that are equally short.
    let responses = masses(&crowd);
    for _ in 0..20 {
        Contacts::default().push(&mut crowd, &responses, &(), &Periods::default(), Film::default());
    }
    assert!(worst(&crowd, &(), &Periods::default()) < 0.01);
    let turn = DQuat::from_scaled_axis(DVec3::new(0.3, -1.1, 0.7));
    let mut turned = crowd.clone();
    for n in 0..crowd.len() {
        turned.position[n] = turn * crowd.position[n];
        turned.orientation[n] = turn * crowd.orientation[n];
        turned.velocity[n] = turn * crowd.velocity[n];
        turned.angular_velocity[n] = turn * crowd.angular_velocity[n];
    }
    let resolve = |mut crowd: Inclusions| {
        let responses = masses(&crowd);
        Contacts::default().resolve(&mut crowd, &responses, &(), &Periods::default(), Film::default(), 1e-4);
        crowd
    };
    let (one, two) = (resolve(crowd), resolve(turned));
    for n in 0..one.len() {
        // Rounding changes which turn is the last one: within what counts as still.
        assert!((turn * one.velocity[n] - two.velocity[n]).length() < 1e-3, "{n}");
    }
    assert_eq!(one.contacts, two.contacts);
}

/// 40 % spheres in a periodic box, thrown about anew in every step by a tenth of a diameter, and pressed together.
#[test]
fn dense_spheres_stay_out_of_each_other() {
    let (mut dense, mut random, side) = (bodies(), Pcg64Mcg::seed_from_u64(17), 10);
    let spacing = 0.02 * (PI / 6.0 / 0.4_f64).cbrt();
    let size = spacing * f64::from(side);
    for n in 0..side * side * side {
        let place = DVec3::new(f64::from(n % side), f64::from(n / side % side), f64::from(n / side / side));
        dense.add(SPHERE, 0, spacing * (place + 0.5), DQuat::IDENTITY);
    }
    let periods = Periods([Some(size), Some(size), None]);
    let walls =
        Room { planes: vec![plane(DVec3::ZERO, DVec3::Z), plane(DVec3::Z * size, -DVec3::Z)], bars: vec![] };
    let responses = masses(&dense);
    let mut contacts = Contacts::default();
    for step in 0..60 {
        for n in 0..dense.len() {
            let place = dense.position[n] / size - 0.5;
            let squeeze = DVec3::new(-(2.0 * PI * place.x).sin(), place.z, 0.0);
            dense.velocity[n] = 2.0 * vector(&mut random) + squeeze;
        }
        contacts.resolve(&mut dense, &responses, &walls, &periods, Film::default(), 1e-3);
        advance(&mut dense, 1e-3);
        let said = contacts.separate(&mut dense, &responses, &walls, &periods, Film::default(), 1e-3);
        let left = worst(&dense, &walls, &periods);
        assert!(left < 0.01, "{step}: {left}");
        assert_relative_eq!(said, left, epsilon = 1e-12);
    }
}

/// Spheres and fibres between plates that shear them, with the drag of a fluid: 35 % and 0.3 %.
#[test]
fn a_sheared_mixture_stays_out_of_itself_and_of_the_plates() {
    let size = 0.16;
    let between = move |p: DVec3| (p.z - 0.5 * size).abs() - 0.5 * size;
    let region = Region { low: DVec3::ZERO, high: DVec3::splat(size), distance: &between };
    let periods = Periods([Some(size), Some(size), None]);
    let walls =
        Room { planes: vec![plane(DVec3::ZERO, DVec3::Z), plane(DVec3::Z * size, -DVec3::Z)], bars: vec![] };
    let (mut mixture, time_step) = (bodies(), 1e-3);
    for (kind, share) in [(SPHERE, 0.35), (FIBRE, 0.003)] {
        let (amount, direction) = (Amount::Share(share), Direction::Isotropic);
        let order = Order { kind, batch: 0, amount, direction, at_walls: AtWalls::Turned, seed: 5 };
        place(&mut mixture, &order, &region, &periods).unwrap();
    }
    let mut contacts = Contacts::default();
    for step in 0..100 {
        let responses = in_fluid(&mixture);
        for n in 0..mixture.len() {
            // 3/s: half a millimetre a step at the plates.
            let axis = mixture.axis(n);
            mixture.velocity[n] = 3.0 * (mixture.position[n].z - 0.5 * size) * DVec3::X;
            mixture.angular_velocity[n] = match mixture.kind[n] {
                FIBRE => axis.cross(3.0 * axis.z * DVec3::X),
                _ => 1.5 * DVec3::Y,
            };
        }
        contacts.resolve(&mut mixture, &responses, &walls, &periods, Film::default(), time_step);
        advance(&mut mixture, time_step);
        contacts.separate(&mut mixture, &responses, &walls, &periods, Film::default(), time_step);
        let left = worst(&mixture, &walls, &periods);
        assert!(left < 0.01, "{step}: {left}");
    }
}

/// A wall that moves takes a sphere along, or throws it ahead.
#[test]
fn walls_push() {
    struct Piston;
    impl Walls for Piston {
        fn nearest(&self, at: DVec3, within: f64) -> Option<Wall> {
            (at.z <= within).then_some(Wall { distance: at.z, normal: DVec3::Z, velocity: 0.3 * DVec3::Z })
        }
    }
    for restitution in [0.0, 0.5] {
        let mut one = bodies();
        one.add(SPHERE, 0, 0.01 * DVec3::Z, DQuat::IDENTITY);
        meet(&mut one, law(restitution, 0.6), &Piston);
        assert_relative_eq!(one.velocity[0].z, 0.3 * (1.0 + restitution), max_relative = 1e-12);
    }
}

/// `cargo test -p tremie-suspension --release hundred -- --ignored`.
#[test]
#[ignore = "takes a minute"]
fn a_hundred_thousand_bodies_have_the_same_bits_on_two_threads() {
    let mut crowd = crowd(23, 100_000, 0.7, &[SPHERE, FIBRE, FIBRE, ELLIPSOID, FIBRE, FIBRE]);
    crowd.position.iter_mut().for_each(|at| at.z += 0.7);
    let with = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| run(crowd.clone(), 3))
    };
    assert_eq!(state(&with(1)), state(&with(2)));
}

/// What a step costs: `cargo test -p tremie-suspension --release cost -- --ignored --nocapture`.
#[test]
#[ignore = "measures"]
fn cost_of_a_step() {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(2).build().unwrap();
    let run = |name: &str, mut crowd: Inclusions, size: f64, step: f64, steps: u32| {
        let periods = Periods([Some(size); 3]);
        let time_step = 1e-3;
        let fibres = crowd.kind[0] == FIBRE;
        let velocities = crowd.velocity.clone();
        pool.install(|| {
            let mut contacts = Contacts::default();
            let responses = in_fluid(&crowd);
            while contacts.push(&mut crowd, &responses, &(), &periods, Film::default()) > separation::ALLOWED {}
            let (mut one, mut two, mut touched) = (0.0, 0.0, 0);
            for _ in 0..steps {
                for n in 0..crowd.len() {
                    // Vortices that fill the box: fibres turn as lines of the fluid do, spheres with it and a tenth at random.
                    let (speed, wave) = (step / time_step, 2.0 * PI / size);
                    let phase = wave * crowd.position[n];
                    let ((sx, cx), (sy, cy)) = (phase.x.sin_cos(), phase.y.sin_cos());
                    let (stretch, spin) = (speed * wave * cx * cy, speed * wave * sx * sy);
                    crowd.velocity[n] = speed * DVec3::new(sx * cy, -cx * sy, 0.0);
                    let axis = crowd.axis(n);
                    crowd.angular_velocity[n] = if fibres {
                        let along = DVec3::new(stretch * axis.x - spin * axis.y, spin * axis.x - stretch * axis.y, 0.0);
                        axis.cross(along)
                    } else {
                        crowd.velocity[n] += 0.1 * speed * velocities[n];
                        spin * DVec3::Z
                    };
                }
                let responses = in_fluid(&crowd);
                let start = std::time::Instant::now();
                contacts.resolve(&mut crowd, &responses, &(), &periods, Film::default(), time_step);
                one += start.elapsed().as_secs_f64();
                touched += crowd.contacts.iter().sum::<u32>();
                advance(&mut crowd, time_step);
                let start = std::time::Instant::now();
                contacts.separate(&mut crowd, &responses, &(), &periods, Film::default(), time_step);
                two += start.elapsed().as_secs_f64();
            }
            let each = 1e6 / f64::from(steps) / crowd.len() as f64;
            let touched = f64::from(touched) / f64::from(steps) / crowd.len() as f64;
            println!(
                "{name}: resolve {:.3}, separate {:.3} us a body and step; {touched:.2} contacts a body; overlap {:.4}",
                one * each,
                two * each,
                contacts.push(&mut crowd, &responses, &(), &periods, Film::default())
            );
        });
    };
    for (number, step) in [(1000, 1e-4), (10_000, 1e-4), (50_000, 1e-4), (50_000, 5e-4)] {
        let size = (f64::from(number) * PI / 4.0 * 0.00075_f64.powi(2) * 0.06 / 0.01).cbrt();
        let fibres = sorted(crowd(1, number as usize, 0.5 * size, &[FIBRE]));
        run(&format!("{number} fibres, 1 %, {} mm a step", 1e3 * step), fibres, size, step, 40);
    }
    for (share, step) in [(0.3, 2e-4), (0.4, 2e-4)] {
        let size = (20_000.0 * PI / 6.0 * 0.02_f64.powi(3) / share).cbrt();
        let spheres = sorted(crowd(2, 20_000, 0.5 * size, &[SPHERE]));
        run(&format!("20000 spheres, {share}"), spheres, size, step, 20);
    }
}

/// The same crowd, with neighbours in space near in memory.
fn sorted(mut crowd: Inclusions) -> Inclusions {
    let mut places = crowd.position.clone();
    places.sort_by_key(|at| (*at / 0.03).floor().to_array().map(|x| x as i64));
    crowd.position = places;
    crowd
}
