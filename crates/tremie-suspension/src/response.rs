//! How a body answers an impulse.
//!
//! In vacuum this is the inverse of its mass. In a fluid it is less: over a step of length dt the drag takes up a part, and the answer is
//! the inverse of M + dt A, where A is the body's friction in the fluid. For fibres, whose friction over a step is 18 to 39 times their mass,
//! that is another world; therefore contacts ask for this and never for masses.

use tremie_numerics::{DMat3, DQuat, DVec3};

use crate::Form;

/// Change of a body's velocity v and angular velocity w by an impulse J at its centre and an angular impulse T:
/// dv = linear J + cross T, dw = crossᵀ J + angular T.
///
/// In 1/kg, 1/(kg m) and 1/(kg m2), along the axes of space.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Response {
    /// dv by J; symmetric.
    pub linear: DMat3,
    /// dv by T; its transpose is dw by J.
    pub cross: DMat3,
    /// dw by T; symmetric.
    pub angular: DMat3,
}

impl Response {
    /// Of a body that nothing moves.
    pub const FIXED: Self = Self { linear: DMat3::ZERO, cross: DMat3::ZERO, angular: DMat3::ZERO };

    /// Of a body with a density in kg/m3, in vacuum.
    pub fn of_mass(form: &Form, density: f64, orientation: DQuat) -> Self {
        let mass = density * form.volume();
        let turn = DMat3::from_quat(orientation);
        let angular = turn * DMat3::from_diagonal((mass * form.gyration()).recip()) * turn.transpose();
        Self { linear: DMat3::from_diagonal(DVec3::splat(mass.recip())), cross: DMat3::ZERO, angular }
    }

    /// Changes of velocity and angular velocity by an impulse at `arm` from the centre.
    pub fn to(&self, arm: DVec3, impulse: DVec3) -> (DVec3, DVec3) {
        let torque = arm.cross(impulse);
        (
            self.linear * impulse + self.cross * torque,
            self.cross.transpose() * impulse + self.angular * torque,
        )
    }

    /// Change of the velocity at `arm` from the centre by an impulse there: symmetric, in 1/kg.
    pub fn at(&self, arm: DVec3) -> DMat3 {
        // T = X J and du = dv - X dw with X the matrix of the cross product by the arm.
        let x = DMat3::from_cols(
            DVec3::new(0.0, arm.z, -arm.y),
            DVec3::new(-arm.z, 0.0, arm.x),
            DVec3::new(arm.y, -arm.x, 0.0),
        );
        let (mixed, xt) = (self.cross * x, x.transpose());
        self.linear + mixed + mixed.transpose() + xt * self.angular * x
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_free_rod_hit_at_its_end_answers_with_four_times_its_inverse_mass() {
        let fibre = Form::Fibre { length: 0.06, diameter: 1e-6 };
        let turn = DQuat::from_rotation_arc(DVec3::Z, DVec3::X);
        let response = Response::of_mass(&fibre, 7850.0, turn);
        let mass = 7850.0 * fibre.volume();
        let answer = response.at(0.03 * DVec3::X) * DVec3::Y;
        approx::assert_relative_eq!(answer.y * mass, 4.0, max_relative = 1e-6);
    }

    #[test]
    fn the_answer_at_a_point_is_that_of_the_body() {
        let some = |seed: f64| {
            let column =
                |k: f64| DVec3::new((seed + k).sin(), (2.0 * seed + k).cos(), (3.0 * seed - k).sin());
            DMat3::from_cols(column(0.3), column(1.1), column(2.7))
        };
        let symmetric = |m: DMat3| m * m.transpose();
        let response =
            Response { linear: symmetric(some(1.0)), cross: some(2.0), angular: symmetric(some(3.0)) };
        let (arm, impulse) = (DVec3::new(0.1, -0.7, 0.4), DVec3::new(-1.0, 0.2, 0.5));
        let (dv, dw) = response.to(arm, impulse);
        assert!((dv + dw.cross(arm) - response.at(arm) * impulse).length() < 1e-14);
    }
}
