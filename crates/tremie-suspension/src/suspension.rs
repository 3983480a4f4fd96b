//! All bodies and their fluid: the order of things in a step.
//!
//! 1. The points of all bodies ask the fluid how fast it moves there ([`Carrier::see`]). Those that have come out of the surface feel a pull back into the
//!    fluid beside the drag: the skin that a real surface has, and the method has not. All points of a body are pulled by no more than its weight: a body that others hold
//!    where it is would else drive the fluid out along it, for ever, by however much its friction takes.
//! 2. Each body finds its velocity (module `motion`).
//! 3. Bodies that would run into each other or into walls are kept from it ([`Contacts`]), each by as much as it answers while the fluid holds it: so what
//!    the fluid gets and what bodies hand each other together are all that there is.
//! 4. The fluid gets the drag, turned round ([`Carrier::push`]), and the bodies go on.

use rayon::prelude::*;
use tremie_numerics::{DMat3, DVec3};

use crate::friction::{Coupling, FORGETS, Felt, Grip, Medium, grips};
use crate::motion::{Dragged, Handed, Motion, Scheme};
use crate::neighbours::CHUNK;
use crate::{Carrier, ContactLaw, Contacts, Film, Inclusions, Periods, Push, Response, Seen, Walls};

/// Relative error of each step of the scheme of Fehlberg.
const TOLERANCE: f64 = 1e-6;

/// How bodies are followed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Method {
    /// How fibres are coupled to the fluid.
    pub coupling: Coupling,
    /// The viscosity that fibres feel.
    pub felt: Felt,
    /// How bodies move.
    pub scheme: Scheme,
    /// What they are free to do.
    pub freedom: Freedom,
}

/// What bodies are free to do.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Freedom {
    /// To move and to turn, out of each other's way.
    #[default]
    Free,
    /// To move, but not to turn: they pass through each other and through walls, and stay as they lay at first (Svec 2013, section 3.3.3).
    Unturned,
    /// To do nothing: they keep the velocity they have, whatever the fluid does.
    Held,
}

/// How a body moves in a step: in the mean, and what its velocity and angular velocity have at the end more than one that goes on freely.
#[derive(Debug, Clone, Copy)]
struct Moved {
    mean: [DVec3; 2],
    more: [DVec3; 2],
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
    /// The points of each kind, and what they were worked out for.
    grips: Vec<Vec<Grip>>,
    medium: Option<Medium>,
    /// The first point of each body, and the end of all.
    firsts: Vec<usize>,
    points: Vec<DVec3>,
    seen: Vec<Seen>,
    pushes: Vec<Push>,
    moved: Vec<Moved>,
    responses: Vec<Response>,
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
            grips: Vec::new(),
            medium: None,
            firsts: Vec::new(),
            points: Vec::new(),
            seen: Vec::new(),
            pushes: Vec::new(),
            moved: Vec::new(),
            responses: Vec::new(),
        }
    }

    /// Forces at contacts, from which those of the next step begin, in a form that can be saved: numbers and labels.
    pub fn saved_contacts(&self) -> (Vec<f64>, Vec<u32>) {
        self.contacts.saved()
    }

    /// Puts such forces in place of these; none if that is not what they are.
    pub fn load_contacts(&mut self, numbers: &[f64], labels: &[u32]) -> Option<()> {
        self.contacts.load(numbers, labels)
    }

    /// Lets the bodies feel this gravity in m/s2, whatever the fluid's is.
    ///
    /// Fluid that fills a closed box bears its own weight by its pressure, and moves as one without weight; but a compressible method would press it
    /// together. Bodies still weigh as much less as the fluid in their place would.
    pub fn under(self, gravity: DVec3) -> Self {
        Self { gravity: Some(gravity), ..self }
    }

    /// Goes on for the step of the fluid that follows.
    pub fn step(&mut self, carrier: &mut impl Carrier, walls: &impl Walls) {
        let medium = Medium::of(carrier);
        if self.medium != Some(medium) {
            self.medium = Some(medium);
            let kinds = &self.inclusions.kinds;
            self.grips = kinds.iter().map(|kind| grips(&kind.form, &self.method, &medium)).collect();
        }
        self.place_points();
        carrier.see(&self.points, self.method.felt.part(), &mut self.seen);
        if self.method.felt == Felt::Apparent {
            carrier.thicken(&self.points, &mut self.seen);
        }
        let (step, density) = (carrier.time_step(), carrier.density());
        let gravity = self.gravity.unwrap_or_else(|| carrier.gravity());
        let (mut moved, mut responses) =
            (std::mem::take(&mut self.moved), std::mem::take(&mut self.responses));
        (0..self.inclusions.len())
            .into_par_iter()
            .with_min_len(CHUNK)
            .map(|n| {
                let kind = &self.inclusions.kinds[usize::from(self.inclusions.kind[n])];
                let dragged = Dragged {
                    form: &kind.form,
                    density: kind.density,
                    grips: self.grips_of(n),
                    seen: &self.seen[self.firsts[n]..self.firsts[n + 1]],
                    fluid_density: density,
                    gravity,
                    handed: self.handed(n),
                    skin: self.skin(n, gravity),
                };
                self.moved(n, &dragged, step)
            })
            .unzip_into_vecs(&mut moved, &mut responses);
        let bodies = &mut self.inclusions;
        (&mut bodies.velocity, &mut bodies.angular_velocity, &moved)
            .into_par_iter()
            .with_min_len(CHUNK)
            .for_each(|(velocity, angular, moved)| [*velocity, *angular] = moved.mean);
        let film = Film::of(carrier);
        let (periods, origin) = (self.periods, self.origin);
        let touches = self.method.freedom == Freedom::Free;
        if touches {
            self.contacts.resolve(&mut self.inclusions, &responses, walls, &periods, film, step);
        }
        self.react(gravity);
        carrier.push(&self.pushes);
        let bodies = &mut self.inclusions;
        let motions = (
            &mut bodies.position,
            &mut bodies.orientation,
            &mut bodies.velocity,
            &mut bodies.angular_velocity,
        );
        let gyrations: Vec<DVec3> = bodies.kinds.iter().map(|kind| kind.form.gyration()).collect();
        let (position, orientation, velocity, angular) = motions;
        let each = (position, orientation, velocity, angular, &bodies.kind, &moved);
        each.into_par_iter().with_min_len(CHUNK).for_each(
            |(position, orientation, velocity, angular_velocity, kind, moved)| {
                let mut motion = Motion {
                    position: *position,
                    orientation: *orientation,
                    velocity: *velocity,
                    angular_velocity: *angular_velocity,
                };
                motion.move_on(gyrations[usize::from(*kind)], step);
                *position = periods.inside(origin, motion.position);
                *orientation = motion.orientation;
                *velocity = motion.velocity + moved.more[0];
                *angular_velocity = motion.angular_velocity + moved.more[1];
            },
        );
        if touches {
            self.contacts.separate(&mut self.inclusions, &responses, walls, &periods, film, step);
        }
        (self.moved, self.responses) = (moved, responses);
    }

    /// How a body moves in a step if it meets nothing, and how it answers to impulses.
    fn moved(&self, n: usize, dragged: &Dragged<'_>, step: f64) -> (Moved, Response) {
        let from = self.motion(n);
        let freely = |mean: [DVec3; 2]| Moved { mean, more: [DVec3::ZERO; 2] };
        let ending = |mean: [DVec3; 2], to: [DVec3; 2]| {
            let mut free = Motion { velocity: mean[0], angular_velocity: mean[1], ..from };
            free.move_on(dragged.form.gyration(), step);
            Moved { mean, more: [to[0] - free.velocity, to[1] - free.angular_velocity] }
        };
        if self.method.freedom == Freedom::Held {
            let now = [from.velocity, from.angular_velocity];
            return (ending(now, now), Response::FIXED);
        }
        let (to, response) = dragged.implicit(&from, step);
        if self.method.freedom == Freedom::Unturned {
            // The moment that takes the turning away moves the centre, too.
            let moment = response.angular.inverse() * to.angular_velocity;
            let mean = [to.velocity - response.cross * moment, DVec3::ZERO];
            return (freely(mean), Response::FIXED);
        }
        match self.method.scheme {
            Scheme::Implicit => (freely([to.velocity, to.angular_velocity]), response),
            Scheme::Fehlberg => {
                let to = dragged.fehlberg(&from, step, TOLERANCE);
                let turn = to.orientation * from.orientation.inverse();
                let mean = [(to.position - from.position) / step, turn.to_scaled_axis() / step];
                (ending(mean, [to.velocity, to.angular_velocity]), response)
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

    /// Finds the points of all bodies.
    fn place_points(&mut self) {
        let Self { inclusions, grips, firsts, points, .. } = self;
        firsts.clear();
        let mut end = 0;
        firsts.extend(inclusions.kind.iter().map(|kind| {
            let first = end;
            end += grips[usize::from(*kind)].len();
            first
        }));
        firsts.push(end);
        points.resize(end, DVec3::ZERO);
        self.seen.resize(end, Seen::default());
        let at = inclusions.position.par_chunks(CHUNK).zip(inclusions.orientation.par_chunks(CHUNK));
        at.zip(inclusions.kind.par_chunks(CHUNK)).zip(of_chunks(firsts, points)).for_each(
            |(((position, orientation), kind), points)| {
                let mut points = points.iter_mut();
                for ((at, turn), kind) in position.iter().zip(orientation).zip(kind) {
                    for (grip, point) in grips[usize::from(*kind)].iter().zip(&mut points) {
                        *point = *at + *turn * grip.at;
                    }
                }
            },
        );
    }

    /// The drag at each point, turned round, and what comes of it for each body.
    fn react(&mut self, gravity: DVec3) {
        let mut pushes = std::mem::take(&mut self.pushes);
        let bodies = &mut self.inclusions;
        let mut drags = [&mut bodies.drag, &mut bodies.torque, &mut bodies.mean_drag].map(std::mem::take);
        let mut moments = std::mem::take(&mut bodies.mean_moment);
        pushes.resize(self.points.len(), Push::default());
        let [one, two, three] = drags.each_mut().map(|of| of.par_chunks_mut(CHUNK));
        let own = (one, two, three, moments.par_chunks_mut(CHUNK)).into_par_iter();
        own.zip(of_chunks(&self.firsts, &mut pushes)).enumerate().for_each(
            |(chunk, ((drags, torques, means, moments), pushes))| {
                let mut pushes = pushes.iter_mut();
                for k in 0..drags.len() {
                    let mut handed = Handed { drag: means[k], moment: moments[k] };
                    [drags[k], torques[k]] = self.drag(chunk * CHUNK + k, gravity, &mut handed, &mut pushes);
                    (means[k], moments[k]) = (handed.drag, handed.moment);
                }
            },
        );
        self.pushes = pushes;
        let bodies = &mut self.inclusions;
        [bodies.drag, bodies.torque, bodies.mean_drag] = drags;
        bodies.mean_moment = moments;
    }

    /// Drag and its moment on a body, what it hands the fluid in the next step, and what it does to the fluid at its points.
    fn drag<'a>(
        &self,
        n: usize,
        gravity: DVec3,
        handed: &mut Handed,
        pushes: &mut impl Iterator<Item = &'a mut Push>,
    ) -> [DVec3; 2] {
        let (mean, turn) = (self.motion(n), self.inclusions.orientation[n]);
        let axis = turn * DVec3::Z;
        let (mut drag, mut torque, mut moment) = (DVec3::ZERO, DVec3::ZERO, DMat3::ZERO);
        let (skin, mut drawn) = (self.skin(n, gravity), DVec3::ZERO);
        for ((grip, seen), push) in self.grips_of(n).iter().zip(&self.seen[self.firsts[n]..]).zip(pushes) {
            let arm = turn * grip.at;
            if seen.share == 0.0 {
                *push = Push::default();
                continue;
            }
            let slip = mean.at(arm) - seen.velocity;
            let along = axis * slip.dot(axis);
            let [across, lengthwise] = grip.felt(seen);
            let force = across * (slip - along) + lengthwise * along - handed.at(grip, turn);
            let [a, b] = grip.asked(seen);
            let inward = skin * seen.inward;
            *push = Push { force: force - inward, friction: a.max(b) };
            drag -= force;
            drawn += inward;
            torque -= arm.cross(force - inward);
            if grip.steady > 0.0 {
                moment -= DMat3::from_cols(force.x * arm, force.y * arm, force.z * arm);
            }
        }
        handed.drag += FORGETS * (drag - handed.drag);
        handed.moment += (moment - handed.moment) * FORGETS;
        [drag + drawn, torque]
    }

    /// Force in N by which the skin of the fluid draws in a point of a body that has come out of it: all points together by its weight at most.
    fn skin(&self, n: usize, gravity: DVec3) -> f64 {
        let kind = &self.inclusions.kinds[usize::from(self.inclusions.kind[n])];
        kind.density * kind.form.volume() * gravity.length() / self.grips_of(n).len() as f64
    }

    /// What of the drag of the steps before the points of a body feel again.
    fn handed(&self, n: usize) -> Handed {
        Handed { drag: self.inclusions.mean_drag[n], moment: self.inclusions.mean_moment[n] }
    }
}

/// What belongs to the bodies of each chunk, of what their points have.
fn of_chunks<'a, T: Send>(firsts: &[usize], all: &'a mut [T]) -> rayon::vec::IntoIter<&'a mut [T]> {
    let mut rest = all;
    let mut chunk = |end: usize| {
        let (own, others) = std::mem::take(&mut rest).split_at_mut(end);
        rest = others;
        own
    };
    let number = firsts.len() - 1;
    let ends = (0..number.div_ceil(CHUNK)).map(|n| (n * CHUNK, ((n + 1) * CHUNK).min(number)));
    ends.map(|(from, to)| chunk(firsts[to] - firsts[from])).collect::<Vec<_>>().into_par_iter()
}
