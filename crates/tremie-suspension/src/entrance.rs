//! Bodies that come in through an opening, one by one.
//!
//! Each is drawn a place in the opening, uniform over it, and then a direction, anew until it lies between the walls: near the rim fibres lie along
//! it, as they do beside walls at the start ([`AtWalls::Turned`](crate::AtWalls)). It is put as far in front of the opening as it reaches back, and
//! a sphere as much further as a film would hold it that fluid cannot flow into: here it comes from where the film would be. What is drawn depends on nothing but the numbers that stand for the draw.

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use tremie_numerics::{DQuat, DVec3};

use crate::distance::{Outline, gap};
use crate::near_wall::near_walls;
use crate::{Direction, Film, Form, Inclusions, Periods, Walls};

/// Draws of a place in the opening, and of a direction in which the body lies between the walls there.
const DRAWS: u32 = 10_000;

/// Places that are tried for a body to see whether it can come in at all.
const TRIES: u64 = 200;

/// Space between the body and the plane of the opening, as a share of its least diameter: keeps rounding out.
const CLEAR: f64 = 0.01;

/// What bodies come in through. Its walls are all that they must lie between; the rim is one, straight on in front of it.
pub trait Opening: Walls {
    /// Point in m that two numbers from 0 to 1 stand for: where these are uniform, so is it over the opening. None beside it.
    fn point(&self, numbers: [f64; 2]) -> Option<DVec3>;

    /// Unit vector of the way that bodies come.
    fn direction(&self) -> DVec3;

    /// Whether there is fluid at a point.
    fn is_wet(&self, at: DVec3) -> bool;
}

/// A body that is to come in.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Entrant {
    /// Kind, by its place among the kinds.
    pub kind: u16,
    /// Batch, from 1; 0 for none.
    pub batch: u16,
    /// How such bodies lie.
    pub direction: Direction,
    /// Velocity in m/s.
    pub velocity: DVec3,
    /// What tells this draw from all others: the same numbers give the same place.
    pub draw: [u64; 5],
}

/// Numbers that look random, by the numbers that stand for a draw (mixed as in SplitMix64, Steele et al. 2014).
fn random(draw: [u64; 5]) -> Pcg64Mcg {
    let mix = |state: u64, number: u64| {
        let mut z = (state ^ number).wrapping_add(0x9E37_79B9_7F4A_7C15);
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    };
    Pcg64Mcg::seed_from_u64(draw.into_iter().fold(0, mix))
}

/// Centre in m and turn of a body between the walls in front of an opening; none if it finds no direction at the place that it was drawn.
fn draw(
    form: &Form,
    direction: Direction,
    opening: &impl Opening,
    film: Film,
    random: &mut Pcg64Mcg,
) -> Option<(DVec3, DQuat)> {
    let at = (0..DRAWS).find_map(|_| opening.point([random.random(), random.random()]))?;
    let normal = opening.direction();
    let mut touches = Vec::new();
    for _ in 0..DRAWS {
        let orientation = direction.draw(random);
        let mut outline = Outline::new(form, at, orientation);
        let space = if outline.is_sphere() { film.width() } else { 0.0 };
        outline.centre += (outline.extent(normal) + space + CLEAR * outline.thickness) * normal;
        // Most that do not fit have an end in a wall, which is soon seen.
        let ends = [outline.half, -outline.half].map(|end| outline.centre + end);
        if ends.iter().all(|end| opening.nearest(*end, outline.radius).is_none()) {
            near_walls(&outline, opening, 0.0, &mut touches);
            if touches.is_empty() {
                return Some((outline.centre, orientation));
            }
        }
        if direction.is_settled_for(form) {
            break;
        }
    }
    None
}

/// Whether bodies of a form that lie so can come in through an opening: one of some hundred does.
pub fn passes(form: &Form, direction: Direction, opening: &impl Opening) -> bool {
    (0..TRIES).any(|n| draw(form, direction, opening, Film::default(), &mut random([n; 5])).is_some())
}

impl Inclusions {
    /// Lets a body in if the place that it is drawn lies in fluid, between the walls and free of other bodies, and says whether it has come.
    ///
    /// There is such a kind.
    pub fn enter(
        &mut self,
        entrant: &Entrant,
        opening: &impl Opening,
        periods: &Periods,
        film: Film,
    ) -> bool {
        let form = &self.kinds[usize::from(entrant.kind)].form;
        let found = draw(form, entrant.direction, opening, film, &mut random(entrant.draw));
        let Some((centre, orientation)) = found.filter(|(centre, _)| opening.is_wet(*centre)) else {
            return false;
        };
        let outline = Outline::new(form, centre, orientation);
        let reach = |form: &Form| Outline::new(form, DVec3::ZERO, DQuat::IDENTITY).reach();
        let reaches: Vec<f64> = self.kinds.iter().map(|kind| outline.reach() + reach(&kind.form)).collect();
        let free = (0..self.len()).all(|n| {
            let way = periods.shortest(self.position[n] - centre);
            let apart = way.length_squared() > reaches[usize::from(self.kind[n])].powi(2);
            apart || gap(&outline, &Outline::of(self, n), way).distance > 0.0
        });
        if free {
            self.add(entrant.kind, entrant.batch, centre, orientation);
            let n = self.len() - 1;
            self.velocity[n] = entrant.velocity;
        }
        free
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Kind, Wall};

    /// A round hole of this radius in m that looks along z.
    struct Hole(f64);

    impl Walls for Hole {
        fn nearest(&self, at: DVec3, within: f64) -> Option<Wall> {
            let way = at.with_z(0.0);
            let distance = self.0 - way.length();
            let normal = -way.try_normalize().unwrap_or(DVec3::X);
            (distance < within).then_some(Wall { distance, normal, velocity: DVec3::ZERO })
        }
    }

    impl Opening for Hole {
        fn point(&self, numbers: [f64; 2]) -> Option<DVec3> {
            let [x, y] = numbers.map(|x| (2.0 * x - 1.0) * self.0);
            (x.hypot(y) < self.0).then_some(DVec3::new(x, y, 0.0))
        }

        fn direction(&self) -> DVec3 {
            DVec3::Z
        }

        fn is_wet(&self, at: DVec3) -> bool {
            at.z < 0.05
        }
    }

    const FIBRE: Form = Form::Fibre { length: 0.06, diameter: 1e-3 };
    const STONE: Form = Form::Ellipsoid { half_axes: DVec3::new(0.01, 0.015, 0.02) };
    const BALL: Form = Form::Sphere { diameter: 0.03 };

    fn bodies() -> Inclusions {
        let kind = |form| Kind { name: "body".into(), form, density: 2600.0 };
        Inclusions { kinds: [FIBRE, STONE, BALL].map(kind).to_vec(), ..Inclusions::default() }
    }

    fn entrant(kind: u16, n: u64) -> Entrant {
        let draw = [1, 0, u64::from(kind), n, 0];
        Entrant { kind, batch: 2, direction: Direction::Isotropic, velocity: DVec3::Z, draw }
    }

    #[test]
    fn bodies_lie_in_front_of_the_hole_within_its_rim_and_free_of_each_other() {
        let (mut bodies, hole, none) = (bodies(), Hole(0.04), Periods::default());
        let mut came = 0;
        for n in 0..300 {
            came += usize::from(bodies.enter(&entrant((n % 3) as u16, n), &hole, &none, Film::default()));
        }
        assert_eq!(came, bodies.len());
        // It fills up: not all come, and all kinds do.
        assert!(came < 300 && (0..3).all(|kind| bodies.kind.contains(&kind)), "{came}");
        for n in 0..bodies.len() {
            let outline = Outline::of(&bodies, n);
            assert!(outline.centre.z >= outline.extent(DVec3::Z) && outline.centre.z < 0.05);
            for angle in (0..64).map(|n| f64::from(n) * 0.1) {
                let way = DVec3::new(angle.cos(), angle.sin(), 0.0);
                assert!(outline.centre.dot(way) + outline.extent(way) < 0.04 + 1e-9, "body {n}");
            }
            for m in 0..n {
                let other = Outline::of(&bodies, m);
                assert!(gap(&outline, &other, other.centre - outline.centre).distance > 0.0);
            }
            assert_eq!((bodies.velocity[n], bodies.batch[n]), (DVec3::Z, 2));
        }
        // Where there is a film spheres stay out of it.
        let film = Film { viscosity: 1.0, grain: 0.005 };
        let ball = draw(&BALL, Direction::Isotropic, &hole, film, &mut random([7; 5])).unwrap();
        assert!(ball.0.z >= 0.015 + film.width());
        // The same again, and something else by another draw.
        let mut again = self::bodies();
        (0..300).for_each(|n| {
            again.enter(&entrant((n % 3) as u16, n), &hole, &none, Film::default());
        });
        assert_eq!(bodies, again);
        again.retain(|_| false);
        assert!(again.is_empty() && again.next == bodies.next);
        again.enter(&entrant(0, 1000), &hole, &none, Film::default());
        assert_eq!(again.id, [bodies.next], "no number is given twice");
    }

    /// The places of fibres longer than the hole is wide are uniform: half of them within half of its area.
    #[test]
    fn long_fibres_are_turned_not_rejected() {
        let hole = Hole(0.02);
        let number = 2000;
        let drawn: Vec<(DVec3, DQuat)> = (0..number)
            .filter_map(|n| draw(&FIBRE, Direction::Isotropic, &hole, Film::default(), &mut random([n; 5])))
            .collect();
        // Nearer to the rim than its radius no axis can be.
        let radius = 0.02 - 0.5e-3;
        let possible = number as f64 * (radius / 0.02f64).powi(2);
        assert!(drawn.len() as f64 > 0.97 * possible, "{} of {possible}", drawn.len());
        let inner = drawn.iter().filter(|(at, _)| at.truncate().length() < radius * 0.5f64.sqrt()).count();
        let share = inner as f64 / drawn.len() as f64;
        // Within three standard errors.
        assert!((share - 0.5).abs() < 1.5 / (number as f64).sqrt(), "{share}");
        let along = drawn.iter().map(|(_, turn)| (*turn * DVec3::Z).z.abs()).fold(1.0, f64::min);
        // At its steepest it reaches across: length times sine is the width.
        assert!(along > (1.0 - (0.04f64 / 0.06).powi(2)).sqrt() - 0.02, "{along}");
    }

    #[test]
    fn what_is_wider_than_the_hole_does_not_pass() {
        let isotropic = Direction::Isotropic;
        assert!(passes(&FIBRE, isotropic, &Hole(0.01)));
        assert!(!passes(&FIBRE, Direction::Planar(DVec3::Z), &Hole(0.02)));
        assert!(!passes(&FIBRE, Direction::Aligned(DVec3::X), &Hole(0.02)));
        assert!(passes(&BALL, isotropic, &Hole(0.02)) && !passes(&BALL, isotropic, &Hole(0.0149)));
        // The second of its axes decides.
        assert!(passes(&STONE, isotropic, &Hole(0.016)) && !passes(&STONE, isotropic, &Hole(0.014)));
    }
}
