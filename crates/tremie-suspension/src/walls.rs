//! What bodies can touch besides each other.

use tremie_numerics::DVec3;

/// The wall nearest to a point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Wall {
    /// Distance in m from the point to the wall, negative inside it.
    pub distance: f64,
    /// Unit normal out of the wall.
    pub normal: DVec3,
    /// Velocity in m/s of the wall there.
    pub velocity: DVec3,
}

/// A wall without end in a plane, nobody being beyond it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Flat {
    /// Unit normal out of the wall.
    pub normal: DVec3,
    /// Distance in m of the plane from the origin along the normal.
    pub place: f64,
    /// Velocity in m/s of the wall.
    pub velocity: DVec3,
}

impl Flat {
    /// Distance in m from the wall to a point, negative inside it.
    pub fn distance(&self, at: DVec3) -> f64 {
        self.normal.dot(at) - self.place
    }
}

/// Sides of a form, bars and moving solids.
pub trait Walls: Sync {
    /// The walls that are planes: where a body is near these is known at once.
    fn flat(&self) -> &[Flat] {
        &[]
    }

    /// The one of all other walls that is nearest to a point, if one is nearer than `within` in m.
    fn nearest(&self, at: DVec3, within: f64) -> Option<Wall>;
}

/// No walls anywhere.
impl Walls for () {
    fn nearest(&self, _: DVec3, _: f64) -> Option<Wall> {
        None
    }
}

/// Lengths in m after which space repeats itself, along each axis.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Periods(pub [Option<f64>; 3]);

impl Periods {
    /// The shortest of the vectors that mean the same as `way`.
    pub fn shortest(&self, mut way: DVec3) -> DVec3 {
        for axis in 0..3 {
            // Most ways are short already, and rounding is slow.
            if let Some(period) = self.0[axis]
                && way[axis].abs() > 0.5 * period
            {
                way[axis] -= period * (way[axis] / period).round();
            }
        }
        way
    }

    /// The point between 0 and the period that means the same as `at`, where space began at `origin`.
    pub fn inside(&self, origin: DVec3, mut at: DVec3) -> DVec3 {
        for axis in 0..3 {
            // Most are within already.
            if let Some(period) = self.0[axis]
                && !(origin[axis]..origin[axis] + period).contains(&at[axis])
            {
                at[axis] -= period * ((at[axis] - origin[axis]) / period).floor();
            }
        }
        at
    }
}
