//! How a body moves in a step of the fluid.
//!
//! The fluid's velocity u_i at the points of the body is known, and its friction there is linear in the body's velocity v and angular velocity w
//! (module `friction`, Z_i the matrix of the point at the arm r_i):
//!
//! ```text
//!     m dv/dt   = sum Z_i (u_i - v - w x r_i) + K
//!     d(I w)/dt = sum r_i x Z_i (u_i - v - w x r_i)
//! ```
//!
//! and, in volumes, what the points share of the mean drag of the steps before and of its first moment; with m and I those of the body's own density (Svec 2013, Eq. 2.19 to 2.21) and K its weight less that of the fluid in its place, since the fluid fills the
//! body's volume too. The friction of a fibre in a step is many times its mass; so the step is **implicit**: `(M + dt A) w1 = M w0 + dt (A u + K)`, one system of
//! six unknowns, stable at any stiffness; what turns a free body's velocity comes after it ([`Motion::move_on`]). The inverse of `M + dt A` is also how the body answers to what it hits in the step ([`Response`]).
//!
//! The other scheme is that of the thesis, **Runge-Kutta-Fehlberg 4(5)** with steps of its own (Fehlberg 1969), arms turning with the body: to
//! check the first against.

use tremie_numerics::{DMat3, DQuat, DVec3};

use crate::distance::outer;
use crate::friction::Grip;
use crate::{Form, Response, Seen};

/// How motion is followed through a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Scheme {
    /// One implicit step.
    #[default]
    Implicit,
    /// Runge-Kutta-Fehlberg 4(5), as many steps as its error asks for.
    Fehlberg,
}

/// Where a body is and how it moves.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Motion {
    pub(crate) position: DVec3,
    pub(crate) orientation: DQuat,
    pub(crate) velocity: DVec3,
    pub(crate) angular_velocity: DVec3,
}

impl Motion {
    /// Velocity at an arm.
    pub(crate) fn at(&self, arm: DVec3) -> DVec3 {
        self.velocity + self.angular_velocity.cross(arm)
    }

    /// Goes on for a time with nothing to turn the body, whose moments of inertia over its mass are `gyration`.
    ///
    /// A free body turns as its energy `sum l_n^2/(2 I_n)` has it, l its angular momentum along its own axes: about this momentum at the rate `l/I_0`, and about
    /// each axis at `(1/I_n - 1/I_0) l_n`, one after the other. With the median of the moments for I_0 that is exact for bodies of
    /// revolution; the angular momentum stays what it is for all (a splitting after Touma and Wisdom 1994). (A fibre that rolls along a dry floor turns by
    /// a radian in a step: the gyroscopic moment as a step forward in time throws it up.)
    pub(crate) fn move_on(&mut self, gyration: DVec3, duration: f64) {
        self.position += duration * self.velocity;
        let mut own = gyration * (self.orientation.inverse() * self.angular_velocity);
        let median = gyration.element_sum() - gyration.max_element() - gyration.min_element();
        let about_all = DQuat::from_scaled_axis(duration / median * (self.orientation * own));
        for (n, axis) in DVec3::AXES.into_iter().enumerate() {
            let angle = duration * (gyration[n].recip() - median.recip()) * own[n];
            if angle != 0.0 {
                let turn = DQuat::from_axis_angle(axis, angle);
                self.orientation *= turn;
                own = turn.inverse() * own;
            }
        }
        self.orientation = (about_all * self.orientation).normalize();
        self.angular_velocity = self.orientation * (own / gyration);
    }
}

/// A body in the fluid, at the beginning of a step.
pub(crate) struct Dragged<'a> {
    pub(crate) form: &'a Form,
    pub(crate) density: f64,
    pub(crate) grips: &'a [Grip],
    pub(crate) seen: &'a [Seen],
    pub(crate) fluid_density: f64,
    pub(crate) gravity: DVec3,
    /// What the fluid is handed whatever its velocities are.
    pub(crate) handed: Handed,
    /// Force in N by which the skin of the fluid draws in a point that has come out of it.
    pub(crate) skin: f64,
}

/// What of the drag of the steps before a body's points feel again, whatever the velocities are.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Handed {
    /// Mean drag in N.
    pub(crate) drag: DVec3,
    /// Mean of its first moment in N m, as [`crate::Inclusions`] has it.
    pub(crate) moment: DMat3,
}

impl Handed {
    /// Force in N on the body at a point.
    pub(crate) fn at(&self, grip: &Grip, orientation: DQuat) -> DVec3 {
        if grip.steady == 0.0 {
            return DVec3::ZERO;
        }
        grip.steady * self.drag + self.moment.transpose() * (orientation * grip.lever)
    }
}

/// The matrix of the cross product by a vector from the left.
fn cross(a: DVec3) -> DMat3 {
    DMat3::from_cols(DVec3::new(0.0, a.z, -a.y), DVec3::new(-a.z, 0.0, a.x), DVec3::new(a.y, -a.x, 0.0))
}

impl Dragged<'_> {
    fn mass(&self) -> f64 {
        self.density * self.form.volume()
    }

    /// Moments of inertia along the axes of space.
    fn inertia(&self, orientation: DQuat) -> DMat3 {
        let turn = DMat3::from_quat(orientation);
        turn * DMat3::from_diagonal(self.mass() * self.form.gyration()) * turn.transpose()
    }

    /// Weight less buoyancy, by the share of the body that lies in the fluid.
    fn weight(&self) -> DVec3 {
        let wet = self.seen.iter().map(|seen| seen.share).sum::<f64>() / self.seen.len().max(1) as f64;
        (self.density - wet * self.fluid_density) * self.form.volume() * self.gravity
    }

    /// Friction about the axis of a body of lines, in a fluid that does not turn about it.
    fn spin(&self, orientation: DQuat) -> DMat3 {
        let axis = orientation * DVec3::Z;
        let wet = self.grips.iter().zip(self.seen).filter(|(_, seen)| seen.share > 0.0);
        wet.map(|(grip, _)| grip.spin).sum::<f64>() * outer(axis, axis)
    }

    /// The points that lie in the fluid: the arm of each, its friction across the body's z, what it has more along it, and what the fluid there does.
    fn held(&self, orientation: DQuat) -> impl Iterator<Item = (DVec3, [f64; 2], DVec3)> {
        let turn = DMat3::from_quat(orientation);
        self.grips.iter().zip(self.seen).filter(|(_, seen)| seen.share > 0.0).map(move |(grip, seen)| {
            let [across, along] = grip.felt(seen);
            let handed = self.handed.at(grip, orientation) + self.skin * seen.inward;
            let push = |u: DVec3| across * u + (along - across) * u.dot(turn.z_axis) * turn.z_axis + handed;
            (turn * grip.at, [across, along - across], push(seen.velocity))
        })
    }

    /// How the body moves at the end of an implicit step, and how it answers to impulses in it.
    ///
    /// With `Z = a I + b e e^T`, e the body's z and X the matrix of the cross product by the arm r, the sums over points are
    /// `sum Z X = X(sum a r) + e (e x sum b r)^T` and `sum X Z X^T = tr(A) I - A + E B E^T`, where `A = sum a r r^T`, `B = sum b r r^T`, and E is the matrix of the
    /// cross product by e.
    pub(crate) fn implicit(&self, from: &Motion, step: f64) -> (Motion, Response) {
        let inertia = self.inertia(from.orientation);
        let spin = inertia * from.angular_velocity;
        let (mut force, mut moment) = (self.weight(), DVec3::ZERO);
        // Of frictions across z, and of what there is more of them along it: sums, first and second moments.
        let (mut sums, mut firsts, mut seconds) = ([0.0; 2], [DVec3::ZERO; 2], [DMat3::ZERO; 2]);
        for (arm, friction, push) in self.held(from.orientation) {
            for k in 0..2 {
                let first = friction[k] * arm;
                sums[k] += friction[k];
                firsts[k] += first;
                seconds[k] += outer(first, arm);
            }
            force += push;
            moment += arm.cross(push);
        }
        let axis = from.orientation * DVec3::Z;
        let across = seconds[0];
        let trace = across.x_axis.x + across.y_axis.y + across.z_axis.z;
        let sideways = cross(axis) * seconds[1] * cross(axis).transpose();
        let diagonal = |of: f64| DMat3::from_diagonal(DVec3::splat(of));
        let p = diagonal(self.mass() + step * sums[0]) + outer(axis, axis) * (step * sums[1]);
        let q = (cross(firsts[0]) + outer(axis, axis.cross(firsts[1]))) * -step;
        let r = inertia + (self.spin(from.orientation) + diagonal(trace) - across + sideways) * step;
        let (impulse, angular) = (self.mass() * from.velocity + step * force, spin + step * moment);
        let response = inverse(p, q, r);
        let velocity = response.linear * impulse + response.cross * angular;
        let angular_velocity = response.cross.transpose() * impulse + response.angular * angular;
        (Motion { velocity, angular_velocity, ..*from }, response)
    }

    /// Acceleration and angular acceleration.
    fn acceleration(&self, of: &Motion) -> [DVec3; 2] {
        let axis = of.orientation * DVec3::Z;
        let (mut force, mut moment) = (self.weight(), -(self.spin(of.orientation) * of.angular_velocity));
        for (arm, [across, more], push) in self.held(of.orientation) {
            let own = of.at(arm);
            let push = push - across * own - more * own.dot(axis) * axis;
            force += push;
            moment += arm.cross(push);
        }
        let inertia = self.inertia(of.orientation);
        let spin = inertia * of.angular_velocity;
        [force / self.mass(), inertia.inverse() * (moment - of.angular_velocity.cross(spin))]
    }

    /// The motion after a step by Runge-Kutta-Fehlberg 4(5), with a relative error of `tolerance` in each of its own steps.
    pub(crate) fn fehlberg(&self, from: &Motion, step: f64, tolerance: f64) -> Motion {
        let (mut at, mut time, mut own) = (*from, 0.0, 0.01 * step);
        let length = self.form.reach();
        let speed = self.seen.iter().map(|seen| seen.velocity.length()).fold(0.0, f64::max)
            + step * self.gravity.length();
        // Bounded, so that a body that is thrown about cannot hold up the rest.
        for _ in 0..100_000 {
            if time >= step {
                break;
            }
            own = f64::min(own, step - time);
            let (next, error) = self.fehlberg_step(&at, own);
            let scale = speed + at.velocity.length() + length * at.angular_velocity.length();
            let error = error / (tolerance * scale + f64::MIN_POSITIVE);
            if error <= 1.0 {
                at = next;
                time += own;
            }
            own *= (0.9 * error.powf(-0.2)).clamp(0.2, 4.0);
        }
        at
    }

    /// One step of it, and its error as a speed.
    fn fehlberg_step(&self, from: &Motion, step: f64) -> (Motion, f64) {
        let mut slopes: Vec<[DVec3; 4]> = Vec::with_capacity(6);
        let along = |slopes: &[[DVec3; 4]], weights: &[f64]| {
            let sum =
                |m: usize| -> DVec3 { slopes.iter().zip(weights).map(|(slope, w)| *w * slope[m]).sum() };
            [0, 1, 2, 3].map(|m| step * sum(m))
        };
        let moved = |[x, turn, v, w]: [DVec3; 4]| Motion {
            position: from.position + x,
            orientation: (DQuat::from_scaled_axis(turn) * from.orientation).normalize(),
            velocity: from.velocity + v,
            angular_velocity: from.angular_velocity + w,
        };
        for weights in FEHLBERG {
            let at = moved(along(&slopes, weights));
            let [a, b] = self.acceleration(&at);
            slopes.push([at.velocity, at.angular_velocity, a, b]);
        }
        let [fourth, fifth] = [FOURTH, FIFTH].map(|weights| along(&slopes, &weights));
        let off = [0, 1, 2, 3].map(|m| (fifth[m] - fourth[m]).length());
        (moved(fifth), off[2] + self.form.reach() * off[3])
    }
}

/// The stages of Fehlberg (1969), formula 2, table III; and the weights of fourth and of fifth order.
const FEHLBERG: [&[f64]; 6] = [
    &[],
    &[1.0 / 4.0],
    &[3.0 / 32.0, 9.0 / 32.0],
    &[1932.0 / 2197.0, -7200.0 / 2197.0, 7296.0 / 2197.0],
    &[439.0 / 216.0, -8.0, 3680.0 / 513.0, -845.0 / 4104.0],
    &[-8.0 / 27.0, 2.0, -3544.0 / 2565.0, 1859.0 / 4104.0, -11.0 / 40.0],
];
const FOURTH: [f64; 6] = [25.0 / 216.0, 0.0, 1408.0 / 2565.0, 2197.0 / 4104.0, -1.0 / 5.0, 0.0];
const FIFTH: [f64; 6] = [16.0 / 135.0, 0.0, 6656.0 / 12825.0, 28561.0 / 56430.0, -9.0 / 50.0, 2.0 / 55.0];

/// The inverse of `[[p, q], [q^T, r]]`, symmetric and positive, by the Schur complement of r.
fn inverse(p: DMat3, q: DMat3, r: DMat3) -> Response {
    let turned = r.inverse();
    let aside = q * turned;
    let linear = (p - aside * q.transpose()).inverse();
    let cross = -linear * aside;
    Response { linear, cross, angular: turned - aside.transpose() * cross }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Method;
    use crate::friction::{Medium, grips};

    const STEEL: f64 = 7850.0;
    const GRAVITY: DVec3 = DVec3::new(0.0, 0.0, -9.81);
    const FIBRE: Form = Form::Fibre { length: 0.06, diameter: 0.75e-3 };
    const AT_REST: Motion = Motion {
        position: DVec3::ZERO,
        orientation: DQuat::IDENTITY,
        velocity: DVec3::ZERO,
        angular_velocity: DVec3::ZERO,
    };

    fn medium(time_step: f64) -> Medium {
        Medium { grain: 0.01, line_radius: 0.0115, density: 2300.0, viscosity: 30.0, time_step }
    }

    /// The fibre in a fluid that it is heavier than.
    fn fibre<'a>(grips: &'a [Grip], seen: &'a [Seen]) -> Dragged<'a> {
        Dragged {
            form: &FIBRE,
            density: STEEL,
            grips,
            seen,
            fluid_density: 2300.0,
            gravity: GRAVITY,
            handed: Handed::default(),
            skin: 0.0,
        }
    }

    fn seen(grips: &[Grip], orientation: DQuat, velocity: impl Fn(DVec3) -> DVec3) -> Vec<Seen> {
        grips
            .iter()
            .map(|grip| Seen { velocity: velocity(orientation * grip.at), share: 1.0, ..Seen::default() })
            .collect()
    }

    /// Angular momentum and energy of a free body over its mass, and how it has turned after some steps.
    fn turned(gyration: DVec3, spin: DVec3, step: f64, steps: u32) -> [(DVec3, f64); 2] {
        let orientation = DQuat::from_scaled_axis(DVec3::new(0.4, -0.9, 0.2));
        let mut motion = Motion { orientation, angular_velocity: orientation * spin, ..AT_REST };
        let state = |motion: &Motion| {
            let own = motion.orientation.inverse() * motion.angular_velocity;
            (motion.orientation * (gyration * own), 0.5 * own.dot(gyration * own))
        };
        let before = state(&motion);
        for _ in 0..steps {
            motion.move_on(gyration, step);
        }
        [before, state(&motion)]
    }

    #[test]
    fn a_free_body_keeps_its_angular_momentum_and_energy_however_fast_it_spins() {
        // A radian in a step about a fibre's axis, and about any axis of other bodies of revolution.
        let spheroid = Form::Ellipsoid { half_axes: DVec3::new(0.01, 0.03, 0.01) };
        for (form, spin) in
            [(FIBRE, DVec3::new(3.0, -5.0, 600.0)), (spheroid, DVec3::new(600.0, 200.0, -400.0))]
        {
            let [before, after] = turned(form.gyration(), spin, 1.7e-3, 1000);
            assert!((after.0 - before.0).length() < 1e-10 * before.0.length(), "{before:?} {after:?}");
            approx::assert_relative_eq!(after.1, before.1, max_relative = 1e-10);
        }
        // One of three axes keeps its energy in the mean.
        let gyration = Form::Ellipsoid { half_axes: DVec3::new(0.01, 0.02, 0.03) }.gyration();
        let [before, after] = turned(gyration, DVec3::new(30.0, 20.0, -40.0), 1e-3, 10_000);
        assert!((after.0 - before.0).length() < 1e-10 * before.0.length(), "{before:?} {after:?}");
        approx::assert_relative_eq!(after.1, before.1, max_relative = 0.02);
    }

    #[test]
    fn a_free_body_turns_as_eulers_equations_have_it() {
        // A brick-like one, thrown about its middle axis; in a fluid that does nothing.
        let form = Form::Ellipsoid { half_axes: DVec3::new(0.01, 0.02, 0.03) };
        let alone = Dragged { form: &form, gravity: DVec3::ZERO, ..fibre(&[], &[]) };
        let start = Motion { angular_velocity: DVec3::new(3.0, 20.0, 1.0), ..AT_REST };
        let exact = alone.fehlberg(&start, 0.2, 1e-12);
        let off = |steps: u32| {
            let mut motion = start;
            for _ in 0..steps {
                motion.move_on(form.gyration(), 0.2 / f64::from(steps));
            }
            (motion.angular_velocity - exact.angular_velocity).length()
                + motion.orientation.angle_between(exact.orientation)
        };
        let [coarse, fine] = [off(100), off(400)];
        assert!(fine < 0.3 * coarse && fine < 0.02, "{coarse} {fine}");
    }

    #[test]
    fn the_answer_is_the_inverse() {
        let outer = |v: DVec3| DMat3::from_cols(v * v.x, v * v.y, v * v.z);
        let p = DMat3::from_diagonal(DVec3::new(2.0, 3.0, 4.0)) + outer(DVec3::new(0.3, -0.2, 0.5));
        let r = DMat3::from_diagonal(DVec3::new(1.0, 0.7, 0.2)) + outer(DVec3::new(-0.1, 0.4, 0.2));
        let q = DMat3::from_cols(
            DVec3::new(0.1, 0.2, 0.0),
            DVec3::new(-0.1, 0.0, 0.1),
            DVec3::new(0.2, 0.1, -0.1),
        );
        let k = inverse(p, q, r);
        let (j, t) = (DVec3::new(1.0, -2.0, 0.5), DVec3::new(0.3, 0.1, -0.7));
        let (v, w) = (k.linear * j + k.cross * t, k.cross.transpose() * j + k.angular * t);
        assert!((p * v + q * w - j).length() < 1e-13 && (q.transpose() * v + r * w - t).length() < 1e-13);
    }

    #[test]
    fn an_implicit_step_is_made_by_the_forces_at_its_end() {
        // Points anywhere in the body, some in air.
        let own = grips(&FIBRE, &Method::default(), &medium(1e-3));
        let aside = |n: usize| 0.01 * DVec3::new((n as f64).sin(), (2.0 * n as f64).cos(), 0.3);
        let grips: Vec<Grip> =
            own.iter().enumerate().map(|(n, grip)| Grip { at: grip.at + aside(n), ..*grip }).collect();
        let orientation = DQuat::from_scaled_axis(DVec3::new(0.4, -0.9, 0.2));
        let mut seen = seen(&grips, orientation, |arm| DVec3::new(0.1, arm.z, -3.0 * arm.x));
        (seen[0].share, seen[4].share) = (0.0, 0.0);
        let dragged = fibre(&grips, &seen);
        let (from, step) = (Motion { orientation, ..AT_REST }, 1e-3);
        let (to, _) = dragged.implicit(&from, step);
        let inertia = dragged.inertia(orientation);
        let gyroscopic = inertia.inverse() * to.angular_velocity.cross(inertia * to.angular_velocity);
        let [linear, angular] = dragged.acceleration(&to);
        let off = [to.velocity - step * linear, to.angular_velocity - step * (angular + gyroscopic)];
        assert!(off[0].length() < 1e-9 * to.velocity.length(), "{off:?}");
        assert!(off[1].length() < 1e-9 * to.angular_velocity.length(), "{off:?} {to:?}");
    }

    #[test]
    fn a_fibre_in_a_stream_goes_with_it_and_one_that_sinks_does_so_at_its_terminal_speed() {
        let medium = medium(1e-3);
        let grips = grips(&FIBRE, &Method::default(), &medium);
        let orientation = DQuat::from_rotation_arc(DVec3::Z, DVec3::new(0.6, 0.0, 0.8));
        let stream = |arm: DVec3| DVec3::new(0.1, 0.02, -0.03) + DVec3::new(0.3, -0.5, 0.7).cross(arm);
        let seen = seen(&grips, orientation, stream);
        let zeta: [f64; 2] = [grips.iter().map(|g| g.across).sum(), grips.iter().map(|g| g.along).sum()];
        let dragged = fibre(&grips, &seen);
        let mut motion = Motion { orientation, ..AT_REST };
        for _ in 0..200 {
            motion = dragged.implicit(&motion, 1e-3).0;
        }
        let axis = orientation * DVec3::Z;
        let weight = (STEEL - 2300.0) * FIBRE.volume() * GRAVITY;
        let sinks = (weight - axis * weight.dot(axis)) / zeta[0] + axis * weight.dot(axis) / zeta[1];
        assert!((motion.velocity - stream(DVec3::ZERO) - sinks).length() < 1e-9, "{}", motion.velocity);
        let turns = motion.angular_velocity - axis * motion.angular_velocity.dot(axis);
        let asked = DVec3::new(0.3, -0.5, 0.7);
        assert!((turns - (asked - axis * asked.dot(axis))).length() < 1e-6, "{turns}");
    }

    #[test]
    fn a_fibre_that_spins_about_its_axis_is_stopped_by_the_fluid() {
        let grips = grips(&FIBRE, &Method::default(), &medium(1e-6));
        let turned = DQuat::from_rotation_arc(DVec3::Z, DVec3::new(-0.6, 0.0, 0.8));
        let axis = turned * DVec3::Z;
        let seen = seen(&grips, turned, |_| DVec3::ZERO);
        let still = Dragged { gravity: DVec3::ZERO, ..fibre(&grips, &seen) };
        // I dw/dt = -pi mu d^2 L w with I = m d^2 / 8.
        let rate = 8.0 * 30.0 / (STEEL * (0.5 * 0.75e-3_f64).powi(2));
        let mut motion = Motion { orientation: turned, angular_velocity: 100.0 * axis, ..AT_REST };
        let exact = still.fehlberg(&motion, 1e-6, 1e-8).angular_velocity.dot(axis);
        approx::assert_relative_eq!(exact, 100.0 * (-1e-6 * rate).exp(), max_relative = 1e-6);
        motion = still.implicit(&motion, 1e-6).0;
        let left = 100.0 / (1.0 + 1e-6 * rate) * axis;
        assert!((motion.angular_velocity - left).length() < 1e-6, "{}", motion.angular_velocity);
    }

    #[test]
    fn the_two_schemes_agree_and_only_the_implicit_one_bears_a_hundred_times_the_stiffness() {
        // Sheared and sinking, from rest. A friction of twice the mass in a step is as much as a step forward in time bears: a third of a real
        // fibre's here, in steps of 0.1 ms.
        for stiffness in [0.3, 1.0, 60.0] {
            let step = 1e-4;
            let medium = medium(step);
            let mut grips = grips(&FIBRE, &Method::default(), &medium);
            for grip in &mut grips {
                grip.across *= stiffness;
                grip.along *= stiffness;
            }
            let turned = DQuat::from_rotation_arc(DVec3::Z, DVec3::new(-0.6, 0.0, 0.8));
            let shear = |x: DVec3| DVec3::new(5.0 * x.z, 0.0, 0.0);
            let mut ends = [Motion { orientation: turned, ..AT_REST }; 2];
            let mut forward = ends[0];
            for _ in 0..400 {
                for (scheme, motion) in ends.iter_mut().enumerate() {
                    let at = motion.position;
                    let seen = seen(&grips, motion.orientation, |arm| shear(at + arm));
                    let dragged = fibre(&grips, &seen);
                    if scheme == 0 {
                        *motion = dragged.implicit(motion, step).0;
                        motion.move_on(FIBRE.gyration(), step);
                    } else {
                        *motion = dragged.fehlberg(motion, step, 1e-6);
                    }
                }
                let at = forward.position;
                let seen = seen(&grips, forward.orientation, |arm| shear(at + arm));
                let dragged = fibre(&grips, &seen);
                let [a, _] = dragged.acceleration(&forward);
                forward.velocity += step * a;
            }
            let [a, b] = ends;
            assert!(
                a.velocity.is_finite() && (a.velocity - b.velocity).length() < 5e-3 * b.velocity.length()
            );
            let (p, q) = (a.orientation * DVec3::Z, b.orientation * DVec3::Z);
            assert!((p - q).length() < 5e-3 * (q - turned * DVec3::Z).length(), "{p} {q}");
            let explicit_blows_up = forward.velocity.length().is_nan() || forward.velocity.length() > 1e3;
            assert_eq!(explicit_blows_up, stiffness > 0.5, "{}", forward.velocity);
        }
    }
}
