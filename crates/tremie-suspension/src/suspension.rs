//! All bodies and their fluid: the order of things in a step.
//!
//! 1. The points of all bodies ask the fluid how fast it moves there ([`Carrier::see`]).
//! 2. Each body finds its velocity at the end of the step (module `motion`).
//! 3. The fluid gets the drag, turned round ([`Carrier::push`]), and the bodies go on.

use rayon::prelude::*;
use tremie_numerics::DVec3;

use crate::friction::{Coupling, Grip, Medium, grips};
use crate::motion::{Dragged, Motion, Scheme};
use crate::{Carrier, Inclusions, Periods, Response, Seen, Walls};

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

/// Bodies in a fluid.
#[derive(Debug, Clone)]
pub struct Suspension {
    /// The bodies.
    pub inclusions: Inclusions,
    method: Method,
    periods: Periods,
    /// Lower corner of space in m, where it repeats itself.
    origin: DVec3,
    /// The points of each kind, and what they were worked out for.
    grips: Vec<Vec<Grip>>,
    medium: Option<Medium>,
    points: Vec<DVec3>,
    seen: Vec<Seen>,
    forces: Vec<DVec3>,
}

impl Suspension {
    /// Bodies in a space that repeats itself after `periods`, from `origin` in m on.
    pub fn new(inclusions: Inclusions, method: Method, origin: DVec3, periods: Periods) -> Self {
        Self {
            inclusions,
            method,
            periods,
            origin,
            grips: Vec::new(),
            medium: None,
            points: Vec::new(),
            seen: Vec::new(),
            forces: Vec::new(),
        }
    }

    /// Goes on for the step of the fluid that follows.
    pub fn step(&mut self, carrier: &mut impl Carrier, _walls: &impl Walls) {
        let medium = Medium::of(carrier);
        if self.medium != Some(medium) {
            self.medium = Some(medium);
            let kinds = &self.inclusions.kinds;
            self.grips = kinds.iter().map(|kind| grips(&kind.form, self.method.coupling, &medium)).collect();
        }
        let firsts = self.place_points();
        self.seen.resize(self.points.len(), Seen::default());
        carrier.see(&self.points, &mut self.seen);
        let (step, density, gravity) = (carrier.time_step(), carrier.density(), carrier.gravity());
        let method = self.method;
        let moved: Vec<(Motion, Motion, Response)> = (0..self.inclusions.len())
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
                let from = self.motion(n);
                let (mut to, response) = match method.held {
                    true => (from, Response::FIXED),
                    false => dragged.implicit(&from, step),
                };
                // What the fluid feels is the mean over the step.
                let mut mean = to;
                if method.scheme == Scheme::Fehlberg && !method.held {
                    to = dragged.fehlberg(&from, step, TOLERANCE);
                    mean.velocity = (to.position - from.position) / step;
                    let turn = to.orientation * from.orientation.inverse();
                    mean.angular_velocity = turn.to_scaled_axis() / step;
                } else {
                    to.move_on(step);
                }
                (to, mean, response)
            })
            .collect();
        self.react(&firsts, &moved);
        carrier.push(&self.points, &self.forces);
        for (n, (to, _, _)) in moved.into_iter().enumerate() {
            self.inclusions.position[n] = self.periods.inside(self.origin, to.position);
            self.inclusions.orientation[n] = to.orientation;
            self.inclusions.velocity[n] = to.velocity;
            self.inclusions.angular_velocity[n] = to.angular_velocity;
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
    fn react(&mut self, firsts: &[usize], moved: &[(Motion, Motion, Response)]) {
        let mut forces = std::mem::take(&mut self.forces);
        forces.resize(self.points.len(), DVec3::ZERO);
        for (n, (_, mean, _)) in moved.iter().enumerate() {
            let (turn, first) = (self.inclusions.orientation[n], firsts[n]);
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
