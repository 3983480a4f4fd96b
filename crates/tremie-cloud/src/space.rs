//! What the fluid flows in: walls that may move, and sides beyond which it goes on.

use crate::{Dimension, Kernel, Smoothing, Standing};
use tremie_geometry::{Body, Motion};
use tremie_numerics::DVec3;

/// A wall.
#[derive(Debug, Clone)]
pub struct Wall {
    /// What no fluid is in, where it is drawn.
    pub body: Body,
    /// Where it is at a time, from there.
    pub motion: Motion,
    /// Velocity in m/s of its surface besides, within its own plane.
    pub sliding: DVec3,
    /// Slip length in m: 0 where fluid sticks to it, infinite without friction.
    pub slip_length: f64,
    /// Whether fluid may be on several sides of it, so that what it hides from each other must be asked for; not so at the sides of a domain.
    pub hides: bool,
}

impl Wall {
    /// Its velocity in m/s in the mean of a step in s from a time in s on.
    pub fn velocity(&self, time: f64, step: f64) -> DVec3 {
        self.sliding + (self.motion.offset(time + step) - self.motion.offset(time)) / step
    }
}

/// Where particles are.
#[derive(Debug, Clone)]
pub struct Space {
    /// A plane or space.
    pub dimension: Dimension,
    /// Distance of particles in m: each stands for a square or a cube as wide.
    pub spacing: f64,
    /// Corners in m of the box that fluid is in.
    pub low: DVec3,
    /// The corner with the largest coordinates.
    pub high: DVec3,
    /// Axes along which what leaves the box comes back on the other side.
    pub periodic: [bool; 3],
    /// Its walls.
    pub walls: Vec<Wall>,
}

impl Space {
    /// Space without bounds and walls.
    pub fn free(dimension: Dimension, spacing: f64) -> Self {
        let [low, high] = [DVec3::NEG_INFINITY, DVec3::INFINITY];
        Self { dimension, spacing, low, high, periodic: [false; 3], walls: Vec::new() }
    }

    /// What a particle stands for, in m3, or m2 in a plane.
    pub fn volume(&self) -> f64 {
        self.spacing.powi(self.dimension.number() as i32)
    }

    /// Smoothing length in m: so short that particles right below the surface have neighbours on all sides.
    pub fn smoothing_length(&self) -> f64 {
        self.spacing
            * match self.dimension {
                Dimension::Two => 1.5,
                Dimension::Three => 1.3,
            }
    }

    /// The kernel of its particles.
    pub fn kernel(&self) -> Smoothing {
        Smoothing::new(Kernel::Wendland, self.dimension, self.smoothing_length())
    }

    /// Its walls where they are at a time in s.
    pub fn standing(&self, time: f64) -> Vec<Standing<'_>> {
        let flat = self.dimension == Dimension::Two;
        let of = |wall: &Wall| wall.motion.offset(time);
        self.walls.iter().map(|wall| Standing { body: &wall.body, offset: of(wall), flat }).collect()
    }

    /// A place where it is in the box.
    pub fn wrapped(&self, at: DVec3) -> DVec3 {
        let mut within = at;
        for axis in (0..3).filter(|axis| self.periodic[*axis]) {
            let (low, length) = (self.low[axis], self.high[axis] - self.low[axis]);
            within[axis] -= length * ((at[axis] - low) / length).floor();
        }
        within
    }
}
