//! Bodies placed at random, without overlap.
//!
//! Each body in turn is drawn until it is inside the region and free of those before it (random sequential addition). That goes up to 30 % of
//! spheres. Where a body finds no free place it is put where it overlaps, and in the end all new ones are pushed apart, a little larger than they
//! are; that goes beyond 40 %. Each body draws from a generator of its own, by the seed and its id, so that what one draws does
//! not depend on how often another had to.
//!
//! Beside a wall a fibre cannot lie in all directions. Which it then has is a convention ([`AtWalls`]), and matters: between walls, isotropic
//! fibres have the orientation factor 0.60 if their direction is drawn anew, 0.54 if the whole fibre is (Dupont and Vandewalle 2005 have the
//! former).

use std::collections::HashMap;
use std::f64::consts::PI;

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use thiserror::Error;
use tremie_numerics::sum::ordered_sum;
use tremie_numerics::{DMat3, DQuat, DVec3};

use crate::distance::{Outline, gap, outer};
use crate::neighbours::Cut;
use crate::{Contacts, Film, Form, Inclusions, Kind, Periods, Response, Wall, Walls, separation};

/// Where bodies may be.
#[derive(Clone, Copy)]
pub struct Region<'a> {
    /// Lower corner in m of a box around it.
    pub low: DVec3,
    /// Upper corner in m.
    pub high: DVec3,
    /// Signed distance in m from its surface, negative inside; nowhere further from zero than the true one.
    pub distance: &'a (dyn Fn(DVec3) -> f64 + Sync),
}

/// How many bodies.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Amount {
    /// A number.
    Number(usize),
    /// A share of the region's volume, from 0 to 1.
    Share(f64),
}

/// How the axes of bodies lie.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Direction {
    /// In all directions alike.
    Isotropic,
    /// In all directions alike of the plane with this normal.
    Planar(DVec3),
    /// Along this.
    Aligned(DVec3),
}

impl Direction {
    /// The orientation tensor of bodies that lie so.
    pub fn tensor(self) -> DMat3 {
        match self {
            Self::Isotropic => DMat3::IDENTITY * 3.0_f64.recip(),
            Self::Planar(normal) => (DMat3::IDENTITY - outer(normal, normal)) * 0.5,
            Self::Aligned(axis) => outer(axis, axis),
        }
    }

    /// How a body lies whose axis is drawn so; about its axis it may be turned in any way.
    pub(crate) fn draw(self, random: &mut Pcg64Mcg) -> DQuat {
        let axis = match self {
            Self::Isotropic => {
                let (z, angle) = (random.random_range(-1.0..1.0), random.random_range(0.0..2.0 * PI));
                let flat = f64::sqrt(1.0 - z * z);
                DVec3::new(flat * angle.cos(), flat * angle.sin(), z)
            }
            Self::Planar(normal) => {
                let (one, two) = normal.try_normalize().unwrap_or(DVec3::Z).any_orthonormal_pair();
                let angle = random.random_range(0.0..2.0 * PI);
                angle.cos() * one + angle.sin() * two
            }
            Self::Aligned(axis) => axis.try_normalize().unwrap_or(DVec3::Z),
        };
        let spin = DQuat::from_rotation_z(random.random_range(0.0..2.0 * PI));
        DQuat::from_rotation_arc(DVec3::Z, axis) * spin
    }

    /// Whether to draw again cannot help a body to fit: not a sphere, nor one whose axis is given.
    pub(crate) fn is_settled_for(self, form: &Form) -> bool {
        matches!(form, Form::Sphere { .. }) || matches!(self, Self::Aligned(_))
    }
}

/// What becomes of a fibre that was drawn with its centre inside and an end outside.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum AtWalls {
    /// Its direction is drawn anew, its centre stays: centres are uniform, fibres near walls lie along them.
    #[default]
    Turned,
    /// All of it is drawn anew: there are fewer fibres near walls.
    Redrawn,
}

/// What to place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Order {
    /// Kind, by its place among the kinds.
    pub kind: u16,
    /// Batch, from 1; 0 for none.
    pub batch: u16,
    /// How many.
    pub amount: Amount,
    /// How they lie.
    pub direction: Direction,
    /// What happens at walls.
    pub at_walls: AtWalls,
    /// The same seed gives the same places.
    pub seed: u64,
}

/// Why bodies could not be placed. None of them are then.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum PlacementError {
    /// There is no such kind.
    #[error("there is no kind of inclusions with the number {0}")]
    Kind(u16),
    /// They do not fit.
    #[error(
        "only {placed} of {wanted} inclusions \"{kind}\" found a place without overlap: {:.3} % of the region's volume instead of {:.3} %",
        100.0 * .reached,
        100.0 * .asked
    )]
    Full {
        /// Name of their kind.
        kind: String,
        /// How many found a place.
        placed: usize,
        /// How many were to.
        wanted: usize,
        /// Share of the region's volume that those have.
        reached: f64,
        /// Share that was asked for.
        asked: f64,
    },
}

/// Draws of a free place for a body, before it is put where it overlaps.
const TRIES: u32 = 1000;

/// The same once it is crowded.
const CROWDED: u32 = 20;

/// Draws of a centre inside the region, and of a direction that fits there.
const DRAWS: u32 = 10_000;

/// Bodies that are pushed apart are as much larger, and pushed so often.
const LARGER: f64 = 1.005;
const ROUNDS: u32 = 2000;

/// Share of solids beyond which pushing apart is hopeless even for spheres, whose densest random packing has 0.64.
const HOPELESS: f64 = 0.6;

/// Places bodies at random in a region, free of each other and of those that are there.
pub fn place(
    bodies: &mut Inclusions,
    order: &Order,
    region: &Region,
    periods: &Periods,
) -> Result<(), PlacementError> {
    let kind = bodies.kinds.get(usize::from(order.kind)).ok_or(PlacementError::Kind(order.kind))?.clone();
    let (each, room) = (kind.form.volume(), volume(region));
    let number = match order.amount {
        Amount::Number(number) => number,
        Amount::Share(share) => (share * room / each).round() as usize,
    };
    let full = |placed: usize| PlacementError::Full {
        kind: kind.name.clone(),
        placed,
        wanted: number,
        reached: placed as f64 * each / room,
        asked: number as f64 * each / room,
    };
    let hopeless = number as f64 * each > HOPELESS * room;
    let (old, mut new) = (bodies.len(), bodies.clone());
    let first = bodies.next;
    let mut crowd = Crowd::new(&new, &kind, order.kind, region, periods);
    let mut overlapping = 0;
    for n in 0..number {
        let id = first + n as u64;
        let mut random = Pcg64Mcg::seed_from_u64(order.seed ^ id.wrapping_mul(0x9E37_79B9_7F4A_7C15));
        let mut free = false;
        let mut last = None;
        for _ in 0..if overlapping > 0 { CROWDED } else { TRIES } {
            let Some((position, orientation)) = draw(&kind.form, order, region, &mut random) else { break };
            last = Some((position, orientation));
            free = crowd.is_free(&Outline::new(&kind.form, position, orientation));
            if free {
                break;
            }
        }
        let Some((position, orientation)) = last else { return Err(full(n - overlapping)) };
        if !free {
            if hopeless {
                return Err(full(n - overlapping));
            }
            overlapping += 1;
        }
        crowd.add(Outline::new(&kind.form, position, orientation));
        new.add(order.kind, order.batch, position, orientation);
    }
    if overlapping > 0 && !push_apart(&mut new, old, &kind, region, periods) {
        return Err(full(number - overlapping));
    }
    *bodies = new;
    Ok(())
}

/// Volume of a region in m3.
fn volume(region: &Region) -> f64 {
    const CELLS: u32 = 100;
    let size = (region.high - region.low) / f64::from(CELLS);
    let width = size.element_product().cbrt();
    let layers: Vec<u32> = (0..CELLS).collect();
    let layer = |&z: &u32| {
        let cell = |n: u32| {
            let place = DVec3::new(f64::from(n % CELLS), f64::from(n / CELLS), f64::from(z));
            (0.5 - (region.distance)(region.low + (place + 0.5) * size) / width).clamp(0.0, 1.0)
        };
        (0..CELLS * CELLS).map(cell).sum()
    };
    ordered_sum(&layers, layer) * size.element_product()
}

/// A body inside the region.
fn draw(form: &Form, order: &Order, region: &Region, random: &mut Pcg64Mcg) -> Option<(DVec3, DQuat)> {
    let turns = if order.at_walls == AtWalls::Turned { DRAWS } else { 1 };
    for _ in 0..DRAWS {
        let part = DVec3::from_array(std::array::from_fn(|_| random.random::<f64>()));
        let position = region.low + part * (region.high - region.low);
        if (region.distance)(position) > 0.0 {
            continue;
        }
        for _ in 0..turns {
            let orientation = order.direction.draw(random);
            if fits(&Outline::new(form, position, orientation), region) {
                return Some((position, orientation));
            }
            if order.direction.is_settled_for(form) {
                break;
            }
        }
    }
    None
}

/// Whether a body is entirely inside: ellipsoids with the sphere around them.
fn fits(outline: &Outline, region: &Region) -> bool {
    if outline.half == DVec3::ZERO {
        return (region.distance)(outline.centre) <= -outline.reach();
    }
    let length = 2.0 * outline.half.length();
    let at = |s: f64| outline.centre + outline.half * (2.0 * s / length - 1.0);
    if (region.distance)(at(length)) > -outline.radius {
        return false;
    }
    // As far as the wall is away, it is safe to go on.
    let mut s = 0.0;
    while s < length {
        let clear = -(region.distance)(at(s)) - outline.radius;
        if clear.is_nan() || clear < 0.0 {
            return false;
        }
        s += clear.max(0.25 * outline.radius);
    }
    true
}

/// Fibres in about ten pieces: more fill memory, fewer find too many others.
fn cut(outline: &Outline) -> Cut {
    Cut::of(outline, 0.0, 0.2 * outline.half.length())
}

/// Bodies that have their place, by cells.
struct Crowd {
    origin: DVec3,
    size: DVec3,
    /// Number of cells along periodic axes.
    round: [Option<i64>; 3],
    periods: Periods,
    cells: HashMap<[i64; 3], Vec<u32>>,
    outlines: Vec<Outline>,
}

impl Crowd {
    fn new(bodies: &Inclusions, kind: &Kind, number: u16, region: &Region, periods: &Periods) -> Self {
        let cut = |form: &Form| cut(&Outline::new(form, DVec3::ZERO, DQuat::IDENTITY)).reach;
        let present =
            |k: usize| k == usize::from(number) || bodies.kind.iter().any(|&kind| usize::from(kind) == k);
        let reaches = (0..bodies.kinds.len()).filter(|&k| present(k)).map(|k| cut(&bodies.kinds[k].form));
        let (least, most) = reaches.fold((cut(&kind.form), 0.0_f64), |(l, m), r| (l.min(r), m.max(r)));
        let mut size = DVec3::splat((2.0 * least).max(0.5 * most));
        let mut round = [None; 3];
        for axis in 0..3 {
            if let Some(period) = periods.0[axis] {
                let cells = (period / size[axis]).floor().max(1.0);
                size[axis] = period / cells;
                round[axis] = Some(cells as i64);
            }
        }
        let mut crowd = Self {
            origin: region.low,
            size,
            round,
            periods: *periods,
            cells: HashMap::new(),
            outlines: Vec::new(),
        };
        for n in 0..bodies.len() {
            crowd.add(Outline::of(bodies, n));
        }
        crowd
    }

    /// The cells that a body's pieces reach, some more than once.
    fn reached(&self, outline: &Outline) -> impl Iterator<Item = [i64; 3]> + use<> {
        let cut = cut(outline);
        let (origin, size, round) = (self.origin, self.size, self.round);
        cut.pieces(outline).flat_map(move |at| {
            let cell = |at: DVec3| ((at - origin) / size).floor().to_array().map(|x| x as i64);
            let (low, high) = (cell(at - cut.reach), cell(at + cut.reach));
            let along = move |axis: usize| {
                // Around a period once is enough.
                let high = round[axis].map_or(high[axis], |cells| high[axis].min(low[axis] + cells - 1));
                (low[axis]..=high).map(move |n| round[axis].map_or(n, |cells: i64| n.rem_euclid(cells)))
            };
            along(0).flat_map(move |x| along(1).flat_map(move |y| along(2).map(move |z| [x, y, z])))
        })
    }

    fn is_free(&self, outline: &Outline) -> bool {
        let near = self.reached(outline).filter_map(|cell| self.cells.get(&cell));
        let mut near: Vec<u32> = near.flatten().copied().collect();
        near.sort_unstable();
        near.dedup();
        near.into_iter().all(|n| {
            let other = &self.outlines[n as usize];
            let way = self.periods.shortest(other.centre - outline.centre);
            gap(outline, other, way).distance > 0.0
        })
    }

    fn add(&mut self, outline: Outline) {
        let number = self.outlines.len() as u32;
        for cell in self.reached(&outline) {
            let others = self.cells.entry(cell).or_default();
            if others.last() != Some(&number) {
                others.push(number);
            }
        }
        self.outlines.push(outline);
    }
}

/// The outside of a region, as walls at rest.
struct Outside<'a>(&'a Region<'a>);

impl Walls for Outside<'_> {
    fn nearest(&self, at: DVec3, within: f64) -> Option<Wall> {
        let distance = -(self.0.distance)(at);
        (distance <= within).then(|| {
            let step = 1e-6 * (self.0.high - self.0.low).length();
            let slope =
                |axis: DVec3| (self.0.distance)(at - step * axis) - (self.0.distance)(at + step * axis);
            let way = DVec3::new(slope(DVec3::X), slope(DVec3::Y), slope(DVec3::Z));
            Wall { distance, normal: way.try_normalize().unwrap_or(DVec3::Z), velocity: DVec3::ZERO }
        })
    }
}

/// Pushes the bodies from `old` on apart, and says whether none overlaps then.
fn push_apart(new: &mut Inclusions, old: usize, kind: &Kind, region: &Region, periods: &Periods) -> bool {
    let larger = match kind.form {
        Form::Sphere { diameter } => Form::Sphere { diameter: LARGER * diameter },
        Form::Ellipsoid { half_axes } => Form::Ellipsoid { half_axes: LARGER * half_axes },
        Form::Fibre { length, diameter } => {
            Form::Fibre { length: length + (LARGER - 1.0) * diameter, diameter: LARGER * diameter }
        }
    };
    let mut swollen = new.clone();
    let number = swollen.kinds.len() as u16;
    swollen.kinds.push(Kind { form: larger, ..kind.clone() });
    swollen.kind[old..].fill(number);
    let mut contacts = Contacts::default();
    for _ in 0..ROUNDS {
        let response = |n: usize| {
            if n < old { Response::FIXED } else { Response::of_mass(&larger, 1.0, swollen.orientation[n]) }
        };
        let responses: Vec<Response> = (0..swollen.len()).map(response).collect();
        let worst = contacts.push(&mut swollen, &responses, &Outside(region), periods, Film::default());
        if worst <= separation::ALLOWED {
            new.position = swollen.position;
            new.orientation = swollen.orientation;
            return true;
        }
    }
    false
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: f64 = 0.3;

    fn kinds() -> Inclusions {
        let kind = |name: &str, form, density| Kind { name: name.into(), form, density };
        Inclusions {
            kinds: vec![
                kind("gravel", Form::Sphere { diameter: 0.02 }, 2600.0),
                kind("fibres", Form::Fibre { length: 0.06, diameter: 0.00075 }, 7850.0),
                kind("flint", Form::Ellipsoid { half_axes: DVec3::new(0.004, 0.006, 0.01) }, 2600.0),
            ],
            ..Inclusions::default()
        }
    }

    fn order(kind: u16, amount: Amount) -> Order {
        let at_walls = AtWalls::Turned;
        Order { kind, batch: 1, amount, direction: Direction::Isotropic, at_walls, seed: 42 }
    }

    fn cube(p: DVec3) -> f64 {
        let off = (p - 0.5 * SIZE).abs() - 0.5 * SIZE;
        off.max(DVec3::ZERO).length() + off.max_element().min(0.0)
    }

    fn region() -> Region<'static> {
        Region { low: DVec3::ZERO, high: DVec3::splat(SIZE), distance: &cube }
    }

    fn space(_: DVec3) -> f64 {
        -1.0
    }

    /// Nothing overlaps, and all is inside.
    fn check(bodies: &Inclusions, region: &Region, periods: &Periods) {
        let outlines: Vec<Outline> = (0..bodies.len()).map(|n| Outline::of(bodies, n)).collect();
        for (n, p) in outlines.iter().enumerate() {
            assert!((region.distance)(p.centre) <= -p.radius);
            for end in [p.half, -p.half] {
                assert!((region.distance)(p.centre + end) <= -p.radius);
            }
            for q in &outlines[..n] {
                let way = periods.shortest(q.centre - p.centre);
                assert!(way.length() > p.reach() + q.reach() || gap(p, q, way).distance > 0.0);
            }
        }
    }

    #[test]
    fn kinds_of_all_forms_find_their_places() {
        let (mut bodies, none) = (kinds(), Periods::default());
        place(&mut bodies, &order(0, Amount::Share(0.2)), &region(), &none).unwrap();
        place(&mut bodies, &order(2, Amount::Number(500)), &region(), &none).unwrap();
        place(&mut bodies, &order(1, Amount::Share(0.003)), &region(), &none).unwrap();
        let count = |kind| bodies.kind.iter().filter(|&&k| k == kind).count() as f64;
        approx::assert_relative_eq!(
            count(0) * bodies.kinds[0].form.volume(),
            0.2 * SIZE.powi(3),
            max_relative = 2e-3
        );
        check(&bodies, &region(), &none);
        let mut again = kinds();
        place(&mut again, &order(0, Amount::Share(0.2)), &region(), &none).unwrap();
        place(&mut again, &order(2, Amount::Number(500)), &region(), &none).unwrap();
        place(&mut again, &order(1, Amount::Share(0.003)), &region(), &none).unwrap();
        assert_eq!(bodies, again);
    }

    #[test]
    fn dense_spheres_are_pushed_apart() {
        let mut bodies = kinds();
        place(&mut bodies, &order(0, Amount::Share(0.4)), &region(), &Periods::default()).unwrap();
        check(&bodies, &region(), &Periods::default());
        assert!(bodies.len() as f64 * bodies.kinds[0].form.volume() > 0.399 * SIZE.powi(3));
        let (mut bodies, periods) = (kinds(), Periods([Some(SIZE); 3]));
        let region = Region { distance: &space, ..region() };
        place(&mut bodies, &order(0, Amount::Share(0.42)), &region, &periods).unwrap();
        check(&bodies, &region, &periods);
    }

    /// Centres of fibres in periodic space are uniform (chi squared over the cells of a net), and their directions isotropic.
    #[test]
    fn places_are_uniform_and_directions_isotropic() {
        let (mut bodies, periods) = (kinds(), Periods([Some(SIZE); 3]));
        let region = Region { distance: &space, ..region() };
        let number = 6000;
        place(&mut bodies, &order(1, Amount::Number(number)), &region, &periods).unwrap();
        let mut counts = [0.0; 64];
        for at in &bodies.position {
            let cell = (*at / SIZE * 4.0).floor();
            counts[(cell.x + 4.0 * cell.y + 16.0 * cell.z) as usize] += 1.0;
        }
        let mean = number as f64 / 64.0;
        let chi: f64 = counts.iter().map(|count: &f64| (count - mean).powi(2) / mean).sum();
        // 63 degrees of freedom: three standard deviations of sqrt(126).
        assert!((chi - 63.0).abs() < 3.0 * 126.0_f64.sqrt(), "{chi}");
        let mean =
            |of: &dyn Fn(DVec3) -> f64| (0..number).map(|n| of(bodies.axis(n))).sum::<f64>() / number as f64;
        // Variances of p_i^2 and p_i p_j: 4/45 and 1/15.
        let error = 3.0 / (number as f64).sqrt();
        for i in 0..3 {
            assert!((mean(&|p| p[i] * p[i]) - 1.0 / 3.0).abs() < error * (4.0_f64 / 45.0).sqrt());
            assert!(mean(&|p| p[i] * p[(i + 1) % 3]).abs() < error * (1.0_f64 / 15.0).sqrt());
        }
    }

    /// Beside a wall, at height z < L/2, a direction fits if |p_z| < 2 z/L: over the strip, the mean of p_x is 0.60 if directions are redrawn.
    #[test]
    fn fibres_beside_a_wall_lie_along_it() {
        let floor = |p: DVec3| -p.z;
        let region = Region { low: DVec3::ZERO, high: DVec3::new(SIZE, SIZE, 0.03), distance: &floor };
        let periods = Periods([Some(SIZE), Some(SIZE), None]);
        let factor = |at_walls| {
            let mut bodies = kinds();
            bodies.kinds[1].form = Form::Fibre { length: 0.06, diameter: 2e-5 };
            let order = Order { at_walls, ..order(1, Amount::Number(20_000)) };
            place(&mut bodies, &order, &region, &periods).unwrap();
            (0..bodies.len()).map(|n| bodies.axis(n).x.abs()).sum::<f64>() / bodies.len() as f64
        };
        // With c = 2 z/L uniform in 0 to 1, |p_z| uniform in 0 to c: |p_x| is 2/pi sqrt(1 - p_z^2) in the mean.
        let steps = 2000;
        let (mut turned, mut redrawn) = (0.0, 0.0);
        for k in 0..steps {
            let c = (f64::from(k) + 0.5) / f64::from(steps);
            let flat = 0.5 * (c * (1.0 - c * c).sqrt() + c.asin());
            turned += 2.0 / PI * flat / c / f64::from(steps);
            // Those that fit are c of all: weights of c, which are 1/2 in the mean.
            redrawn += 2.0 / PI * flat * 2.0 / f64::from(steps);
        }
        let error = 3.0 * 0.3 / 20_000_f64.sqrt();
        assert!((turned - 0.60).abs() < 0.01, "{turned}");
        assert!((factor(AtWalls::Turned) - turned).abs() < error);
        assert!((factor(AtWalls::Redrawn) - redrawn).abs() < error);
    }

    #[test]
    fn what_does_not_fit_is_told() {
        let mut bodies = kinds();
        let error =
            place(&mut bodies, &order(0, Amount::Share(0.7)), &region(), &Periods::default()).unwrap_err();
        let PlacementError::Full { placed, wanted, reached, .. } = error else { panic!("{error}") };
        assert!(wanted > placed && placed > 0 && reached > 0.25 && reached < 0.4, "{error}");
        assert!(error.to_string().contains("inclusions \"gravel\" found a place without overlap"), "{error}");
        assert!(bodies.is_empty());
        let narrow = |p: DVec3| (p.z - 0.01).abs() - 0.005;
        let region = Region { distance: &narrow, ..region() };
        let error =
            place(&mut bodies, &order(0, Amount::Number(7)), &region, &Periods::default()).unwrap_err();
        assert!(error.to_string().starts_with("only 0 of 7 inclusions \"gravel\""), "{error}");
        assert_eq!(
            place(&mut bodies, &order(9, Amount::Number(1)), &region, &Periods::default()),
            Err(PlacementError::Kind(9))
        );
    }
}
