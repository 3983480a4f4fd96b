//! Solids inside the domain: where they are, how fast they go, and which cells they cover.
//!
//! Where a solid is depends on the time alone, not on the flow: nothing of it needs to be kept. (Plates of inlets that stay above the
//! fill are the exception; module `rise` keeps their way.) A cell is solid when its centre lies
//! inside. That is asked again only when it may have changed: a row of cells whose centres are at least d away from a surface
//! that moves no faster than v stays as it is for the time d/v.

use tremie_case::{Case, Solid, Surface};
use tremie_geometry::Motion;
use tremie_numerics::DVec3;

use crate::friction::Friction;
use crate::inlet::{THICKNESS, plate};
use crate::lanes::LANES;
use crate::lattice::{Q, vector};
use crate::scaling::Scaling;
use crate::sticking;
use crate::topology::{Links, ROWS};

/// Share of the time for which a row surely stays as it is that is made use of: keeps rounding out.
const CERTAIN: f64 = 0.999;

/// The solids of a case, the plates of its inlets last.
#[derive(Debug, Clone, Default)]
pub(crate) struct Solids {
    bodies: Vec<Placed>,
    /// Number of the first plate.
    plates: usize,
    /// Lower corner of the domain and edge of a cell in m.
    corner: DVec3,
    size: f64,
    /// For each slot and row the time in s before which no cell is covered or uncovered.
    until: Vec<[f64; ROWS]>,
    /// Whether none will ever move again.
    pub(crate) still: bool,
    /// Whether there is air that can come in between the fluid and a wall that recedes.
    pub(crate) air: bool,
}

/// A solid at the present time.
#[derive(Debug, Clone)]
struct Placed {
    solid: Solid,
    /// The box around it where it is drawn, as its two corners in m.
    bounds: (DVec3, DVec3),
    /// Way in m from where it is drawn.
    offset: DVec3,
    /// Velocity in the coming step in lattice units.
    velocity: DVec3,
    /// Friction, if the fluid slides along it with any.
    friction: Option<Friction>,
    /// Largest speed in m/s at any time, if the fluid decides how it moves.
    follows: Option<f64>,
}

impl Placed {
    /// Largest speed in m/s from a time in s on.
    fn largest_speed(&self, time: f64) -> f64 {
        self.follows.unwrap_or_else(|| self.solid.motion.largest_speed(time))
    }

    /// Whether it moves at any time.
    fn moves(&self) -> bool {
        self.largest_speed(0.0) > 0.0
    }
}

/// A surface that a cell is in contact with, in lattice units.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Contact {
    /// Number of the solid.
    pub(crate) solid: usize,
    /// Velocities that come out of it into the cell, as bits.
    links: u32,
    /// Those of them along which it mirrors the flow.
    mirrored: u32,
    /// Its velocity.
    pub(crate) velocity: DVec3,
    /// Its unit normal, into the fluid.
    pub(crate) normal: DVec3,
    /// Distance of the cell's centre.
    pub(crate) distance: f64,
    /// Whether the fluid slides along it.
    pub(crate) slides: bool,
    /// Whether the fluid sticks to it, and not all its links end there (module `sticking`).
    pub(crate) held: bool,
}

/// Least distance of a cell's centre from a surface that it touches, in cells.
const NEAREST: f64 = 1e-3;
/// Cosine of the angle up to which a surface counts as along the lattice.
const ALONG: f64 = 0.9999;

impl Contact {
    /// Whether the surface lies along the lattice.
    pub(crate) fn along_lattice(&self) -> bool {
        self.normal.abs().max_element() > ALONG
    }

    /// What room it leaves beyond the cell, or takes of it, as it comes on along the lattice: of an interface cell, which is full by as much more or less than 1.
    pub(crate) fn room(&self) -> f64 {
        if self.velocity.dot(self.normal) > 0.0 && self.along_lattice() { self.distance - 0.5 } else { 0.0 }
    }

    /// Whether the velocity `i` comes out of the surface.
    pub(crate) fn has(&self, i: usize) -> bool {
        self.links >> i & 1 == 1
    }

    /// Velocities that come out of the surface.
    pub(crate) fn links(&self) -> impl Iterator<Item = usize> {
        (1..Q).filter(|i| self.has(*i))
    }

    /// Where the link along `c` ends, half-way to the cell that the solid covers: the distance of that place from the surface, over that of the cell.
    pub(crate) fn place(&self, c: DVec3) -> f64 {
        // A cell's centre may lie in the surface itself.
        let distance = if self.distance.abs() < NEAREST { NEAREST } else { self.distance };
        1.0 - 0.5 * c.dot(self.normal) / distance
    }

    /// Whether the surface mirrors the flow along the velocity `i`.
    pub(crate) fn mirrored(&self, i: usize) -> bool {
        self.mirrored >> i & 1 == 1
    }

    /// Whether the surface can mirror the flow: it is a flat sliding wall along the lattice, and stays where it is.
    fn mirrors(&self) -> bool {
        self.slides && self.along_lattice() && self.velocity.dot(self.normal) == 0.0
    }
}

/// What a cell is in contact with, the nearest surface first; there are more in edges and corners.
pub(crate) type Touching = [Option<Contact>; 3];

/// What the cells of a row are in contact with.
pub(crate) type Contacts = [Touching; LANES];

/// Surfaces of a solid whose normals have a larger cosine are one, curved; others meet in an edge.
const SMOOTH: f64 = 0.5;

impl Solids {
    /// The solids of a case at time zero.
    pub(crate) fn new(case: &Case, scaling: &Scaling) -> Self {
        let size = scaling.cell_size;
        let place = |(solid, bounds, follows): (Solid, (DVec3, DVec3), Option<f64>)| Placed {
            follows,
            offset: solid.motion.offset(0.0),
            velocity: DVec3::ZERO,
            friction: Friction::new(solid.surface, scaling),
            bounds,
            solid,
        };
        let plates = case.inlets.iter().map(|inlet| {
            let (_, body) = plate(inlet.face, size);
            let plate = Solid {
                name: String::new(),
                body,
                motion: inlet.motion.clone(),
                load: None,
                surface: Surface::NoSlip,
            };
            (plate, inlet.face.bounds(THICKNESS * size), inlet.above_fill.map(|above| above.speed))
        });
        // What a load moves goes a cell in a step at most.
        let fastest = |solid: &Solid| solid.load.map(|_| scaling.velocity_unit());
        let solids = case.solids.iter().map(|solid| (solid.clone(), solid.body.bounds(), fastest(solid)));
        Self {
            bodies: solids.chain(plates).map(place).collect(),
            plates: case.solids.len(),
            corner: case.domain.min,
            size: scaling.cell_size,
            until: Vec::new(),
            still: false,
            air: false,
        }
    }

    /// Number of solids.
    pub(crate) fn count(&self) -> usize {
        self.bodies.len()
    }

    /// How far in m each is from where it is drawn.
    pub(crate) fn moved(&self) -> impl Iterator<Item = DVec3> {
        self.bodies.iter().map(|body| body.offset)
    }

    /// Whether there are any.
    pub(crate) fn any(&self) -> bool {
        !self.bodies.is_empty()
    }

    /// Lets the plate of the inlet number `n` go another way from now on, on which it is where it is.
    pub(crate) fn redirect(&mut self, n: usize, motion: Motion) {
        self.send(self.plates + n, motion);
    }

    /// Lets the solid number `n` go another way from now on, on which it is where it is.
    pub(crate) fn send(&mut self, n: usize, motion: Motion) {
        self.bodies[n].solid.motion = motion;
    }

    /// Takes another length of the time step into use.
    pub(crate) fn rescale(&mut self, scaling: &Scaling) {
        for body in self.bodies.iter_mut().filter(|body| body.solid.load.is_some()) {
            body.follows = Some(scaling.velocity_unit());
            self.until.fill([f64::NEG_INFINITY; ROWS]);
        }
    }

    /// Puts the solids where they are at a time in s, with the velocities that take them on in a step.
    pub(crate) fn place(&mut self, time: f64, scaling: &Scaling) {
        for body in &mut self.bodies {
            body.offset = body.solid.motion.offset(time);
            let next = body.solid.motion.offset(time + scaling.time_step);
            body.velocity = (next - body.offset) / self.size;
            body.friction = Friction::new(body.solid.surface, scaling);
        }
        self.still = self.bodies.iter().all(|body| body.largest_speed(time) == 0.0);
    }

    /// Largest speed in m/s of the solids that are in the domain, or have yet to come, at a time in s or later.
    pub(crate) fn largest_speed(&self, time: f64, end: f64, upper: DVec3) -> f64 {
        let ahead = |body: &&Placed| {
            let (min, max) = body.solid.swept(time, end);
            min.cmplt(upper).all() && max.cmpgt(self.corner).all()
        };
        // What a load moves is as fast as it is; `follows` is only a bound.
        let speed = |body: &Placed| match body.solid.load {
            Some(_) => body.solid.motion.largest_speed(time),
            None => body.largest_speed(time),
        };
        self.bodies.iter().filter(ahead).map(speed).fold(0.0, f64::max)
    }

    /// Those of the case that move, or have, or will; what comes in through the plate of an inlet is counted there.
    fn moving(&self) -> impl Iterator<Item = &Placed> {
        self.bodies[..self.plates].iter().filter(|body| body.moves())
    }

    /// Whether there are any such.
    pub(crate) fn any_moves(&self) -> bool {
        self.moving().next().is_some()
    }

    /// What one that moves leaves beside the cells that it does not cover in the column along the velocity `i`, against which it covers the next cell.
    pub(crate) fn left_in_column(&self, at: [usize; 3], i: usize) -> f64 {
        let to_next = -self.size * vector(i);
        let left = |body: &Placed| {
            let p = self.centre(at) - body.offset;
            let covers = body.solid.body.signed_distance(p + to_next) < 0.0;
            covers.then(|| body.solid.body.left_in_column(p, to_next))
        };
        self.moving().find_map(left).unwrap_or(0.0)
    }

    /// Edge of a cell in m.
    pub(crate) fn size(&self) -> f64 {
        self.size
    }

    /// Lower corner of the domain in m.
    pub(crate) fn corner(&self) -> DVec3 {
        self.corner
    }

    /// Centre in m of a cell of the lattice.
    pub(crate) fn centre(&self, at: [usize; 3]) -> DVec3 {
        self.corner + self.size * (DVec3::from(at.map(|n| n as f64)) + 0.5)
    }

    /// Signed distance in m of a point from the nearest solid.
    pub(crate) fn distance(&self, p: DVec3) -> f64 {
        let all = self.bodies.iter().map(|body| body.solid.body.signed_distance(p - body.offset));
        all.fold(f64::INFINITY, f64::min)
    }

    /// The solid nearest to a point, if one is nearer than `within` in m: the signed distance in m, the normal, and the velocity in lattice units.
    pub(crate) fn nearest_to(&self, p: DVec3, within: f64) -> Option<(f64, DVec3, DVec3)> {
        let mut found: Option<(f64, DVec3, DVec3)> = None;
        for body in &self.bodies {
            let (p, (low, high)) = (p - body.offset, body.bounds);
            if p.cmplt(low - within).any() || p.cmpgt(high + within).any() {
                continue;
            }
            let (distance, normal) = body.solid.body.nearest(p);
            if distance < found.map_or(within, |(nearest, ..)| nearest) {
                found = Some((distance, normal, body.velocity));
            }
        }
        found
    }

    /// Whether a solid may reach into the cube of `cells` cells along each axis whose lowest cell is `at`.
    pub(crate) fn reach(&self, at: [usize; 3], cells: usize) -> bool {
        let half = 0.5 * cells as f64 * self.size;
        self.distance(self.centre(at) - 0.5 * self.size + half) < 3f64.sqrt() * half
    }

    /// Whether a cell is solid.
    pub(crate) fn cover(&self, at: [usize; 3]) -> bool {
        self.distance(self.centre(at)) < 0.0
    }

    /// The surface nearest to the centre of a cell and the distance of the point `from` the centre, in cells.
    fn nearest(&self, centre: DVec3, from: DVec3) -> Option<Contact> {
        let p = centre + self.size * from;
        let found = self.bodies.iter().enumerate().map(|(n, body)| {
            let (distance, normal) = body.solid.body.nearest(p - body.offset);
            (distance, n, normal)
        });
        let (distance, n, normal) = found.min_by(|a, b| a.0.total_cmp(&b.0))?;
        let body = &self.bodies[n];
        Some(Contact {
            solid: n,
            links: 0,
            mirrored: 0,
            velocity: body.velocity,
            normal,
            distance: distance / self.size - from.dot(normal),
            slides: body.solid.surface == Surface::FreeSlip,
            held: false,
        })
    }

    /// What a cell is in contact with; the velocities `links` come out of solids.
    fn touching(&self, at: [usize; 3], links: impl Iterator<Item = usize>) -> Touching {
        let centre = self.centre(at);
        let mut found: Touching = [self.nearest(centre, DVec3::ZERO), None, None];
        for i in links {
            let c = vector(i);
            let comes_out = |contact: &Contact| c.dot(contact.normal) > 0.0;
            // The nearest surface, if it is flat, or else that which the link meets.
            let mut of = 0;
            if !found[0].as_ref().is_some_and(comes_out) {
                let met = self.nearest(centre, -0.5 * c).filter(comes_out);
                let like = |contact: &Contact, met: &Contact| {
                    contact.solid == met.solid && contact.normal.dot(met.normal) > SMOOTH
                };
                if let Some(met) = met {
                    let known =
                        |other: &Option<Contact>| other.as_ref().is_none_or(|other| like(other, &met));
                    if let Some(n) = found.iter().position(known) {
                        of = n;
                        found[n].get_or_insert(met);
                    }
                }
            }
            let Some(contact) = &mut found[of] else { continue };
            contact.links |= 1 << i;
            if of == 0 && contact.mirrors() {
                // The cell from which what is mirrored comes mirrors too.
                let n = contact.normal;
                let beside = self.nearest(centre, n * c.dot(n) - c);
                let goes_on = beside.is_some_and(|wall| wall.mirrors() && wall.normal.dot(n) > ALONG);
                contact.mirrored |= u32::from(goes_on) << i;
            }
        }
        for contact in found.iter_mut().flatten() {
            let sticks = !contact.slides && self.bodies[contact.solid].friction.is_none();
            contact.held = sticks && sticking::off_half_way(contact);
        }
        found
    }

    /// What the cells of a row are in contact with; `immersed` are those beside a solid, for each velocity out of it.
    pub(crate) fn contacts(&self, links: &Links, first: usize, immersed: &[u8; Q]) -> Contacts {
        std::array::from_fn(|k| {
            let mut out = (1..Q).filter(|i| immersed[*i] >> k & 1 == 1).peekable();
            match out.peek() {
                Some(_) => self.touching(links.coordinates(first + k), out),
                None => [None; 3],
            }
        })
    }

    /// Forgets what is known about the rows of a slot.
    pub(crate) fn forget(&mut self, slot: usize) {
        if self.until.len() <= slot {
            self.until.resize(slot + 1, [f64::NEG_INFINITY; ROWS]);
        }
        self.until[slot] = [f64::NEG_INFINITY; ROWS];
    }

    /// Forgets what is known about all rows.
    pub(crate) fn forget_all(&mut self) {
        self.until.fill([f64::NEG_INFINITY; ROWS]);
    }

    /// Whether cells of a row may have been covered or uncovered by the time `time` in s.
    pub(crate) fn due(&self, slot: usize, row: usize, time: f64) -> bool {
        self.until[slot][row] <= time
    }

    /// Which of the first `lanes` cells of a row are solid at the time `time` in s, as bits; `at` is the first.
    pub(crate) fn covered(&mut self, slot: usize, row: usize, at: [usize; 3], lanes: usize, time: f64) -> u8 {
        let (mut bits, mut until) = (0, f64::INFINITY);
        for k in 0..lanes {
            let p = self.centre([at[0] + k, at[1], at[2]]);
            for body in &self.bodies {
                let distance = body.solid.body.signed_distance(p - body.offset);
                bits |= u8::from(distance < 0.0) << k;
                let speed = body.largest_speed(time);
                if speed > 0.0 {
                    until = until.min(time + CERTAIN * distance.abs() / speed);
                }
            }
        }
        self.until[slot][row] = until;
        bits
    }

    /// Friction of the solid number `n`, if the fluid slides along it with any.
    pub(crate) fn friction(&self, n: usize) -> Option<Friction> {
        self.bodies[n].friction
    }

    /// Whether the fluid slides with friction along any.
    pub(crate) fn rub(&self) -> bool {
        self.bodies.iter().any(|body| body.friction.is_some())
    }

    /// For each solid that meets a domain of so many cells, the first cells and the ends of the box around it.
    pub(crate) fn extents(&self, cells: [usize; 3]) -> Vec<[[usize; 3]; 2]> {
        let boxed = |body: &Placed| {
            let (min, max) = body.bounds;
            let place = |p: DVec3, a: usize| (p[a] + body.offset[a] - self.corner[a]) / self.size;
            let first = [0, 1, 2].map(|a| place(min, a).max(0.0) as usize);
            let end = [0, 1, 2].map(|a| place(max, a).ceil().clamp(0.0, cells[a] as f64) as usize);
            (0..3).all(|a| first[a] < end[a]).then_some([first, end])
        };
        self.bodies.iter().filter_map(boxed).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use tremie_case::Case;

    #[test]
    fn solids_are_still_once_none_will_move_again() {
        let case = Case::parse(
            "gate.toml",
            r#"
            title = "Gate"
            method = "lbm"
            [material]
            density = "2300 kg/m3"
            newtonian = { viscosity = "10 Pa s" }
            [domain]
            min = ["0 m", "0 m", "0 m"]
            max = ["160 mm", "80 mm", "80 mm"]
            [[fluid]]
            box = { min = ["0 m", "0 m", "0 m"], max = ["80 mm", "80 mm", "80 mm"] }
            [[solid]]
            box = { min = ["80 mm", "0 m", "0 m"], max = ["100 mm", "80 mm", "80 mm"] }
            [solid.motion.path]
            points = [
                { time = "0 s", offset = ["0 m", "0 m", "0 m"] },
                { time = "1 s", offset = ["0 m", "0 m", "0.2 m"] },
            ]
            [lbm]
            cell_size = "10 mm"
            [gauges]
            interval = "0.1 s"
            [stop]
            time = "2 s"
            "#,
        )
        .unwrap();
        let scaling = Scaling { cell_size: 0.01, time_step: 1e-3, density: 2300.0 };
        let mut solids = Solids::new(&case, &scaling);
        for (time, still) in [(0.0, false), (0.9, false), (1.0, true), (1.5, true)] {
            solids.place(time, &scaling);
            assert_eq!(solids.still, still, "{time}");
        }
    }
}
