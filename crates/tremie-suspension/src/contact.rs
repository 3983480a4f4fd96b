//! Contacts of bodies with each other and with walls.
//!
//! A step goes in two halves. [`Contacts::resolve`] takes the velocities that bodies would have and changes them by impulses
//! (`impulse`), so that nobody approaches another by more than the gap between them: bodies that are moved by these velocities do
//! not overlap but by what is of second order in the step. After they have moved, [`Contacts::separate`] takes that away, and lets bounce
//! who has met. Both read the walls by their distance only.
//!
//! Contacts are worked on in the order of the bodies' ids, so that neither the number of threads nor the order in memory shows.
//! In periodic space, periods are at least twice as long as the longest body: of two bodies only the nearest images meet.

use rayon::prelude::*;
use tremie_numerics::DVec3;

use crate::distance::{Outline, gap};
use crate::impulse::{self, Contact, Forces, WALL};
use crate::near_wall::{Touch, near_walls};
use crate::neighbours::{CHUNK, Neighbours};
use crate::{Carrier, Inclusions, Periods, Response, Walls, separation};

/// How bodies bounce and slide.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ContactLaw {
    /// Coefficient of restitution: speed apart over speed of approach, from 0 to 1.
    pub restitution: f64,
    /// Coefficient of Coulomb friction.
    pub friction: f64,
}

impl Default for ContactLaw {
    /// As Svec (2013) has it in section 2.3.2.
    fn default() -> Self {
        Self { restitution: 0.0, friction: 0.6 }
    }
}

/// What contacts must know of the fluid between bodies.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Film {
    /// Viscosity in Pa s; without one there is no lubrication.
    pub viscosity: f64,
    /// Size in m of the carrier's grain: films thinner than 1.1 of these are not resolved by the fluid itself.
    pub grain: f64,
}

impl Film {
    /// Of a carrier.
    pub fn of(carrier: &impl Carrier) -> Self {
        Self { viscosity: carrier.viscosity(), grain: carrier.grain() }
    }

    /// Width in m of a gap that is too narrow for the fluid.
    pub(crate) fn width(self) -> f64 {
        if self.viscosity > 0.0 { 1.1 * self.grain } else { 0.0 }
    }
}

/// Share of its diameter by which pairs are watched beyond what their motion asks for.
const WATCH: f64 = 0.02;

/// Finds contacts and resolves them, step after step.
#[derive(Debug, Clone, Default)]
pub struct Contacts {
    law: ContactLaw,
    neighbours: Neighbours,
    outlines: Vec<Outline>,
    /// Pairs that were close in the last round of moving apart, by their distance over the lesser diameter; and whom it has moved.
    close: Vec<(f64, (u32, u32))>,
    stirred: Vec<bool>,
    /// Who met in this step and is to bounce after it.
    bounces: Vec<Contact>,
    /// What pushed in the last step at contacts, by the ids of who touched.
    forces: Vec<((u64, u64), Forces)>,
}

impl Contacts {
    /// With a law.
    pub fn new(law: ContactLaw) -> Self {
        Self { law, ..Self::default() }
    }

    /// Changes velocities so that no body overlaps another or a wall when all have moved for `time_step` seconds, and says how many
    /// others each touched; all walls count as one.
    ///
    /// Each body has its response.
    pub fn resolve(
        &mut self,
        bodies: &mut Inclusions,
        responses: &[Response],
        walls: &impl Walls,
        periods: &Periods,
        film: Film,
        time_step: f64,
    ) {
        self.look(bodies);
        let outlines = std::mem::take(&mut self.outlines);
        // How far a body moves in the step, and how much nearer to others it may come by turning.
        let ways = |n: usize| {
            (time_step * bodies.velocity[n], time_step * outlines[n].turns(bodies.angular_velocity[n]))
        };
        self.find(bodies, &outlines, periods, film, ways);
        let contacts = self.together(|n, touches, found| {
            let own = ways(n);
            for other in self.neighbours.of(n) {
                let other_own = ways(other as usize);
                let nearer = (own.0 - other_own.0).length() + own.1 + other_own.1;
                let pair = ordered(bodies, n as u32, other);
                let (a, b) = (pair.0 as usize, pair.1 as usize);
                let (p, q) = (&outlines[a], &outlines[b]);
                let way = periods.shortest(q.centre - p.centre);
                let met = gap(p, q, way);
                let squeezed = (p.is_sphere() && q.is_sphere())
                    .then(|| p.radius * q.radius / (p.radius + q.radius))
                    .map_or(0.0, |radius| squeeze(film, radius, met.distance));
                let watched = WATCH * p.thickness.min(q.thickness);
                if met.distance >= watched + nearer && squeezed == 0.0 {
                    continue;
                }
                let arms = (met.at, met.at - way);
                let passing = bodies.velocity[b] + bodies.angular_velocity[b].cross(arms.1)
                    - bodies.velocity[a]
                    - bodies.angular_velocity[a].cross(arms.0);
                if met.distance < watched + time_step * passing.length() || squeezed > 0.0 {
                    found.push(Contact {
                        bodies: pair,
                        normal: met.normal,
                        arms,
                        gap: met.distance,
                        surface: DVec3::ZERO,
                        least: -met.distance.max(0.0) / time_step,
                        squeezed,
                        thickness: p.thickness.min(q.thickness),
                    });
                }
            }
            let outline = &outlines[n];
            let round = outline.is_sphere();
            // What walls do themselves in a step is less than a fifth of a grain, or the fluid could not follow.
            let own = own.0.length() + own.1 + 0.2 * film.grain + WATCH * outline.thickness;
            let margin = if round { own.max(film.width()) } else { own };
            near_walls(outline, walls, margin, touches);
            found.extend(touches.iter().map(|touch| Contact {
                bodies: (n as u32, WALL),
                normal: -touch.normal,
                arms: (touch.at, DVec3::ZERO),
                gap: touch.distance,
                surface: touch.velocity,
                least: -touch.distance.max(0.0) / time_step,
                squeezed: if round { squeeze(film, outline.radius, touch.distance) } else { 0.0 },
                thickness: outline.thickness,
            }));
        });
        self.outlines = outlines;
        let mut order: Vec<((u64, u64), u32)> =
            contacts.iter().zip(0..).map(|(contact, n)| (ids(bodies, contact.bodies), n)).collect();
        order.par_sort_unstable();
        let contacts: Vec<Contact> = order.iter().map(|(_, n)| contacts[*n as usize]).collect();
        let mut forces = self.remembered(order.iter().map(|(ids, _)| *ids));
        let pushed =
            impulse::resolve(&contacts, &mut forces, bodies, responses, self.law.friction, time_step);
        let held = order.iter().zip(forces).filter(|(_, force)| *force != Forces::default());
        self.forces = held.map(|((ids, _), force)| (*ids, force)).collect();
        count(&pushed, &mut bodies.contacts);
        self.bounces.clear();
        if self.law.restitution > 0.0 {
            let back = |(contact, before): (Contact, f64)| Contact {
                least: (-self.law.restitution * before).max(0.0),
                squeezed: 0.0,
                ..contact
            };
            self.bounces.extend(pushed.into_iter().map(back));
        }
    }

    /// Lets bodies bounce that met in the step, moves those that overlap apart, each as far as it answers to the push, and says how far
    /// some still overlap, as a share of the lesser diameter.
    ///
    /// The bodies are in the order that [`Contacts::resolve`] saw.
    pub fn separate(
        &mut self,
        bodies: &mut Inclusions,
        responses: &[Response],
        walls: &impl Walls,
        periods: &Periods,
        film: Film,
        time_step: f64,
    ) -> f64 {
        let mut forces = vec![Forces::default(); self.bounces.len()];
        impulse::resolve(&self.bounces, &mut forces, bodies, responses, self.law.friction, time_step);
        self.bounces.clear();
        let mut left = self.push(bodies, responses, walls, periods, film);
        // What was pushed may meet others that were not near before.
        for _ in 1..separation::ROUNDS {
            if left <= separation::ALLOWED {
                break;
            }
            let before = left;
            left = self.push_again(bodies, responses, walls, periods, film);
            if left > 0.99 * before {
                break;
            }
        }
        left
    }

    /// One round of this; the overlap said is that from before.
    pub(crate) fn push(
        &mut self,
        bodies: &mut Inclusions,
        responses: &[Response],
        walls: &impl Walls,
        periods: &Periods,
        film: Film,
    ) -> f64 {
        self.close.clear();
        self.stirred.clear();
        self.stirred.resize(bodies.len(), true);
        self.look(bodies);
        self.push_again(bodies, responses, walls, periods, film)
    }

    /// The same, asking anew only for what the last round has moved.
    fn push_again(
        &mut self,
        bodies: &mut Inclusions,
        responses: &[Response],
        walls: &impl Walls,
        periods: &Periods,
        film: Film,
    ) -> f64 {
        let mut outlines = std::mem::take(&mut self.outlines);
        self.find(bodies, &outlines, periods, film, |_| (DVec3::ZERO, 0.0));
        let stirred = &self.stirred;
        let found = self.together(|n, touches, close| {
            for other in self.neighbours.of(n).filter(|other| stirred[n] || stirred[*other as usize]) {
                let (a, b) = ordered(bodies, n as u32, other);
                let (p, q) = (&outlines[a as usize], &outlines[b as usize]);
                let met = gap(p, q, periods.shortest(q.centre - p.centre));
                let share = met.distance / p.thickness.min(q.thickness);
                if share < WATCH {
                    close.push((share, (a, b)));
                }
            }
            if stirred[n] {
                near_walls(&outlines[n], walls, WATCH * outlines[n].thickness, touches);
                let least = touches.iter().map(|touch| touch.distance).reduce(f64::min);
                close.extend(least.map(|distance| (distance / outlines[n].thickness, (n as u32, WALL))));
            }
        });
        let mut close = std::mem::take(&mut self.close);
        close.retain(|&(_, (a, b))| !stirred[a as usize] && (b == WALL || !stirred[b as usize]));
        close.extend(found);
        let worst = close.iter().map(|(share, _)| -share).fold(0.0, f64::max);
        if worst > separation::ALLOWED {
            close.par_sort_by_key(|&(_, pair)| ids(bodies, pair));
            let pairs: Vec<(u32, u32)> = close.iter().map(|(_, pair)| *pair).collect();
            self.stirred = separation::push_apart(&pairs, bodies, &mut outlines, responses, walls, periods);
        }
        self.close = close;
        self.outlines = outlines;
        worst
    }

    /// What pushed at contacts in the last step, for pairs in the order of their ids. A body that touches walls at several places does so in the order in which they were found.
    fn remembered(&self, pairs: impl Iterator<Item = (u64, u64)>) -> Vec<Forces> {
        let mut known = self.forces.iter().peekable();
        let force = |pair: (u64, u64)| {
            while known.next_if(|(ids, _)| *ids < pair).is_some() {}
            known.next_if(|(ids, _)| *ids == pair).map_or(Forces::default(), |(_, force)| *force)
        };
        pairs.map(force).collect()
    }

    /// Forces at contacts as numbers and labels that can be saved: 5 and 4 for each.
    pub(crate) fn saved(&self) -> (Vec<f64>, Vec<u32>) {
        let halves = |id: u64| [id as u32, (id >> 32) as u32];
        let of =
            |Forces { normal, film, friction }: &Forces| [*normal, *film, friction.x, friction.y, friction.z];
        let numbers = self.forces.iter().flat_map(|(_, force)| of(force)).collect();
        let labels = self.forces.iter().flat_map(|((a, b), _)| [halves(*a), halves(*b)]).flatten().collect();
        (numbers, labels)
    }

    /// Puts forces in place of these, as they were saved; none if that is not what these are.
    pub(crate) fn load(&mut self, numbers: &[f64], labels: &[u32]) -> Option<()> {
        let (numbers, rest) = numbers.as_chunks::<5>();
        let (labels, others) = labels.as_chunks::<4>();
        if !rest.is_empty() || !others.is_empty() || numbers.len() != labels.len() {
            return None;
        }
        let id = |low: u32, high: u32| u64::from(low) | u64::from(high) << 32;
        let of = |(&[normal, film, x, y, z], &[a, b, c, d]): (&[f64; 5], &[u32; 4])| {
            ((id(a, b), id(c, d)), Forces { normal, film, friction: DVec3::new(x, y, z) })
        };
        self.forces = numbers.iter().zip(labels).map(of).collect();
        Some(())
    }

    /// Takes the outlines of all bodies.
    fn look(&mut self, bodies: &Inclusions) {
        (0..bodies.len())
            .into_par_iter()
            .with_min_len(CHUNK)
            .map(|n| Outline::of(bodies, n))
            .collect_into_vec(&mut self.outlines);
    }

    /// Makes the list of neighbours hold all pairs that may touch when bodies go by `ways` in m and by as much more as turning gives, and those that
    /// a film ties.
    fn find(
        &mut self,
        bodies: &Inclusions,
        outlines: &[Outline],
        periods: &Periods,
        film: Film,
        ways: impl Fn(usize) -> (DVec3, f64) + Sync,
    ) {
        let (mut least, mut most) = (f64::INFINITY, 0.0_f64);
        for outline in outlines {
            // Sparse neighbours cost little, and a list that lasts saves much: for thin bodies sooner than for thick ones.
            least = least.min(outline.thickness * if outline.half == DVec3::ZERO { 0.4 } else { 20.0 });
            most = most.max(outline.thickness);
        }
        self.neighbours.update(
            &bodies.id,
            outlines,
            periods,
            0.5 * film.width(),
            WATCH * most,
            0.1 * least..=least,
            ways,
        );
    }

    /// What is found for each body, in their order; with room for what it touches of walls.
    fn together<T: Send>(&self, of: impl Fn(usize, &mut Vec<Touch>, &mut Vec<T>) + Sync) -> Vec<T> {
        let number = self.neighbours.len();
        let chunks: Vec<Vec<T>> = (0..number.div_ceil(CHUNK))
            .into_par_iter()
            .map(|chunk| {
                let (mut touches, mut found) = (Vec::new(), Vec::new());
                for n in chunk * CHUNK..((chunk + 1) * CHUNK).min(number) {
                    of(n, &mut touches, &mut found);
                }
                found
            })
            .collect();
        chunks.into_iter().flatten().collect()
    }
}

/// Counts whom each body touched; a wall that touches at several points is one.
fn count(pushed: &[(Contact, f64)], contacts: &mut [u32]) {
    contacts.fill(0);
    let mut before = (WALL, WALL);
    for (contact, _) in pushed {
        if contact.bodies != before {
            before = contact.bodies;
            for body in [before.0, before.1].into_iter().filter(|&body| body != WALL) {
                contacts[body as usize] += 1;
            }
        }
    }
}

/// A pair, the body with the smaller id first, wherever it lies in memory.
fn ordered(bodies: &Inclusions, a: u32, b: u32) -> (u32, u32) {
    if bodies.id[a as usize] < bodies.id[b as usize] { (a, b) } else { (b, a) }
}

/// The ids of a pair; walls come last.
fn ids(bodies: &Inclusions, (a, b): (u32, u32)) -> (u64, u64) {
    (bodies.id[a as usize], if b == WALL { u64::MAX } else { bodies.id[b as usize] })
}

/// Force in N per speed of approach in m/s by the film in a gap between spheres (Svec 2013, Eq. 2.35, after Nguyen and Ladd 2002):
/// what it has beyond what a film of 1.1 grains has, which the fluid itself gives.
///
/// `radius` is r_p r_q / (r_p + r_q): beside a wall, the sphere's. The equation's viscosity is a lattice's, of density one; in SI it is that in
/// Pa s. A film is never thinner than a thousandth of the radius: surfaces are rough.
fn squeeze(film: Film, radius: f64, gap: f64) -> f64 {
    let width = film.width();
    if gap >= width {
        return 0.0;
    }
    let thin = gap.max(1e-3 * radius).min(width);
    6.0 * std::f64::consts::PI * film.viscosity * radius * radius * (thin.recip() - width.recip())
}

#[cfg(test)]
mod tests;
