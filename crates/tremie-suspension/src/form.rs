//! The forms of inclusions.

use std::f64::consts::PI;

use tremie_numerics::DVec3;

/// The form of a body, in m, about its centre. The axis of a fibre is the body's z.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Form {
    /// A sphere, such as an aggregate.
    Sphere {
        /// Diameter.
        diameter: f64,
    },
    /// An ellipsoid along the body's axes.
    Ellipsoid {
        /// Half-axes.
        half_axes: DVec3,
    },
    /// A straight fibre: a cylinder, which meets others as a capsule about the segment between the centres of its ends.
    Fibre {
        /// Length.
        length: f64,
        /// Diameter.
        diameter: f64,
    },
}

impl Form {
    /// Volume in m3.
    pub fn volume(&self) -> f64 {
        match *self {
            Self::Sphere { diameter } => PI / 6.0 * diameter.powi(3),
            Self::Ellipsoid { half_axes } => 4.0 / 3.0 * PI * half_axes.element_product(),
            Self::Fibre { length, diameter } => PI / 4.0 * diameter * diameter * length,
        }
    }

    /// Moments of inertia about the body's axes over its mass, in m2 (Svec 2013, Eq. 2.21).
    pub fn gyration(&self) -> DVec3 {
        match *self {
            Self::Sphere { diameter } => DVec3::splat(diameter * diameter / 10.0),
            Self::Ellipsoid { half_axes } => {
                let square = half_axes * half_axes;
                (DVec3::splat(square.element_sum()) - square) / 5.0
            }
            Self::Fibre { length, diameter } => {
                let square = diameter * diameter;
                let across = square / 16.0 + length * length / 12.0;
                DVec3::new(across, across, square / 8.0)
            }
        }
    }

    /// Radius in m of the sphere about the centre that holds the body.
    pub fn reach(&self) -> f64 {
        match *self {
            Self::Sphere { diameter } => 0.5 * diameter,
            Self::Ellipsoid { half_axes } => half_axes.max_element(),
            Self::Fibre { length, diameter } => 0.5 * length.hypot(diameter),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_ellipsoid_of_equal_axes_is_a_sphere() {
        let sphere = Form::Sphere { diameter: 0.02 };
        let ellipsoid = Form::Ellipsoid { half_axes: DVec3::splat(0.01) };
        approx::assert_relative_eq!(sphere.volume(), ellipsoid.volume(), max_relative = 1e-14);
        assert!((sphere.gyration() - ellipsoid.gyration()).length() < 1e-18);
        assert_eq!(sphere.reach(), ellipsoid.reach());
    }
}
