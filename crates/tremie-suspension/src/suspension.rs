//! All bodies and their fluid: the order of things in a step.
//!
//! 1. The points of all bodies ask the fluid how fast it moves there ([`Carrier::see`]). Those that have come out of the surface feel a pull back into the
//!    fluid beside the drag: the skin that a real surface has, and the method has not.
//! 2. Each body finds its velocity (module `motion`).
//! 3. Bodies that would run into each other or into walls are kept from it ([`Contacts`]), each by as much as it answers while the fluid holds it: so what
//!    the fluid gets and what bodies hand each other together are all that there is.
//! 4. The fluid gets the drag, turned round ([`Carrier::push`]), and the bodies go on.

use rayon::prelude::*;
use tremie_numerics::DVec3;

use crate::friction::{Coupling, Grip, Medium, grips};
use crate::motion::{Dragged, Motion, Scheme};
use crate::{Carrier, ContactLaw, Contacts, Film, Inclusions, Periods, Response, Seen, Walls};

/// Relative error of each step of the scheme of Fehlberg.
const TOLERANCE: f64 = 1e-6;

/// How bodies are followed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Method {
    /// How fibres are coupled to the fluid.
    pub coupling: Coupling,
    /// How bodies move.
    pub scheme: Scheme,
    /// Whether they keep the velocity they have, whatever the fluid does.
    pub held: bool,
}

/// How a body moves in a step: in the mean, what its velocity and angular velocity have more than that at the end, and how it answers to impulses.
struct Moved {
    mean: [DVec3; 2],
    more: [DVec3; 2],
    response: Response,
}

/// Bodies in a fluid.
#[derive(Debug, Clone)]
pub struct Suspension {
    /// The bodies.
    pub inclusions: Inclusions,
    method: Method,
    contacts: Contacts,
    periods: Periods,
    /// Lower corner of space in m, where it repeats itself.
    origin: DVec3,
    /// Gravity in m/s2 that bodies feel, if it is not the fluid's.
    gravity: Option<DVec3>,
    /// Whether bodies keep their direction and pass through each other.
    unturned: bool,
    /// The points of each kind, and what they were worked out for.
    grips: Vec<Vec<Grip>>,
    medium: Option<Medium>,
    points: Vec<DVec3>,
    seen: Vec<Seen>,
    forces: Vec<DVec3>,
}

impl Suspension {
    /// Bodies in a space that repeats itself after `periods`, from `origin` in m on.
    pub fn new(
        inclusions: Inclusions,
        method: Method,
        contact: ContactLaw,
        origin: DVec3,
        periods: Periods,
    ) -> Self {
        Self {
            inclusions,
            method,
            contacts: Contacts::new(contact),
            periods,
            origin,
            gravity: None,
            unturned: false,
            grips: Vec::new(),
            medium: None,
            points: Vec::new(),
            seen: Vec::new(),
            forces: Vec::new(),
        }
    }

    /// Lets the bodies feel this gravity in m/s2, whatever the fluid's is.
    ///
    /// Fluid that fills a closed box bears its own weight by its pressure, and moves as one without weight; but a compressible method would press it
    /// together. Bodies still weigh as much less as the fluid in their place would.
    pub fn under(self, gravity: DVec3) -> Self {
        Self { gravity: Some(gravity), ..self }
    }

    /// Lets bodies move as the fluid does, but not turn, and pass through each other and through walls: so Svec (2013, section 3.3.3) has fibres that stay
    /// as they lay at first.
    pub fn unturned(self) -> Self {
        Self { unturned: true, ..self }
    }

    /// Goes on for the step of the fluid that follows.
    pub fn step(&mut self, carrier: &mut impl Carrier, walls: &impl Walls) {
        let medium = Medium::of(carrier);
        if self.medium != Some(medium) {
            self.medium = Some(medium);
            let kinds = &self.inclusions.kinds;
            self.grips = kinds.iter().map(|kind| grips(&kind.form, self.method.coupling, &medium)).collect();
        }
        let firsts = self.place_points();
        self.seen.resize(self.points.len(), Seen::default());
        carrier.see(&self.points, &mut self.seen);
        let (step, density) = (carrier.time_step(), carrier.density());
        let gravity = self.gravity.unwrap_or_else(|| carrier.gravity());
        // What comes out of the surface is drawn back, no faster than a grain of fluid falls back by itself.
        let back = (gravity.length() * carrier.grain()).sqrt();
        self.seen.par_iter_mut().for_each(|seen| seen.velocity += back * seen.inward);
        let moved: Vec<Moved> = (0..self.inclusions.len())
            .into_par_iter()
            .map(|n| {
                let kind = &self.inclusions.kinds[usize::from(self.inclusions.kind[n])];
                let dragged = Dragged {
                    form: &kind.form,
                    density: kind.density,
                    grips: self.grips_of(n),
                    seen: &self.seen[firsts[n]..firsts[n + 1]],
                    fluid_density: density,
                    gravity,
                };
                self.moved(n, &dragged, step)
            })
            .collect();
        let responses: Vec<Response> = moved.iter().map(|moved| moved.response).collect();
        for (n, moved) in moved.iter().enumerate() {
            [self.inclusions.velocity[n], self.inclusions.angular_velocity[n]] = moved.mean;
        }
        let film = Film::of(carrier);
        let periods = self.periods;
        let touches = !self.method.held && !self.unturned;
        if touches {
            self.contacts.resolve(&mut self.inclusions, &responses, walls, &periods, film, step);
        }
        self.react(&firsts);
        carrier.push(&self.points, &self.forces);
        for (n, moved) in moved.iter().enumerate() {
            let mut motion = self.motion(n);
            motion.move_on(step);
            self.inclusions.position[n] = self.periods.inside(self.origin, motion.position);
            self.inclusions.orientation[n] = motion.orientation;
            self.inclusions.velocity[n] = motion.velocity + moved.more[0];
            self.inclusions.angular_velocity[n] = motion.angular_velocity + moved.more[1];
        }
        if touches {
            self.contacts.separate(&mut self.inclusions, &responses, walls, &periods, film, step);
        }
    }

    /// How a body moves in a step if it meets nothing.
    fn moved(&self, n: usize, dragged: &Dragged<'_>, step: f64) -> Moved {
        let from = self.motion(n);
        if self.method.held {
            let mean = [from.velocity, from.angular_velocity];
            return Moved { mean, more: [DVec3::ZERO; 2], response: Response::FIXED };
        }
        let (to, response) = dragged.implicit(&from, step);
        if self.unturned {
            // The moment that takes the turning away moves the centre, too.
            let moment = response.angular.inverse() * to.angular_velocity;
            let mean = [to.velocity - response.cross * moment, DVec3::ZERO];
            return Moved { mean, more: [DVec3::ZERO; 2], response: Response::FIXED };
        }
        match self.method.scheme {
            Scheme::Implicit => {
                Moved { mean: [to.velocity, to.angular_velocity], more: [DVec3::ZERO; 2], response }
            }
            Scheme::Fehlberg => {
                let to = dragged.fehlberg(&from, step, TOLERANCE);
                let turn = to.orientation * from.orientation.inverse();
                let mean = [(to.position - from.position) / step, turn.to_scaled_axis() / step];
                let more = [to.velocity - mean[0], to.angular_velocity - mean[1]];
                Moved { mean, more, response }
            }
        }
    }

    fn grips_of(&self, n: usize) -> &[Grip] {
        &self.grips[usize::from(self.inclusions.kind[n])]
    }

    fn motion(&self, n: usize) -> Motion {
        Motion {
            position: self.inclusions.position[n],
            orientation: self.inclusions.orientation[n],
            velocity: self.inclusions.velocity[n],
            angular_velocity: self.inclusions.angular_velocity[n],
        }
    }

    /// Finds the points of all bodies, and says which is the first of each.
    fn place_points(&mut self) -> Vec<usize> {
        let mut firsts = Vec::with_capacity(self.inclusions.len() + 1);
        let mut points = std::mem::take(&mut self.points);
        points.clear();
        for n in 0..self.inclusions.len() {
            firsts.push(points.len());
            let (at, turn) = (self.inclusions.position[n], self.inclusions.orientation[n]);
            points.extend(self.grips_of(n).iter().map(|grip| at + turn * grip.at));
        }
        firsts.push(points.len());
        self.points = points;
        firsts
    }

    /// The drag at each point, turned round, and what comes of it for each body.
    fn react(&mut self, firsts: &[usize]) {
        let mut forces = std::mem::take(&mut self.forces);
        forces.resize(self.points.len(), DVec3::ZERO);
        for n in 0..self.inclusions.len() {
            let (mean, turn, first) = (self.motion(n), self.inclusions.orientation[n], firsts[n]);
            let axis = turn * DVec3::Z;
            let (mut drag, mut torque) = (DVec3::ZERO, DVec3::ZERO);
            for (k, grip) in self.grips_of(n).iter().enumerate() {
                let seen = &self.seen[first + k];
                let arm = turn * grip.at;
                let slip = if seen.share > 0.0 { mean.at(arm) - seen.velocity } else { DVec3::ZERO };
                let along = axis * slip.dot(axis);
                let force = grip.across * (slip - along) + grip.along * along;
                drag -= force;
                torque -= arm.cross(force);
                forces[first + k] = force;
            }
            self.inclusions.drag[n] = drag;
            self.inclusions.torque[n] = torque;
        }
        self.forces = forces;
    }
}
