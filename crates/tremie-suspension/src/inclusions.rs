//! The bodies, as arrays.

use tremie_numerics::{DQuat, DVec3};

use crate::Form;

/// What bodies of one kind have in common.
#[derive(Debug, Clone, PartialEq)]
pub struct Kind {
    /// What the user calls them.
    pub name: String,
    /// Their form.
    pub form: Form,
    /// Their density in kg/m3.
    pub density: f64,
}

/// All bodies: body n has the nth entry of every array, wherever sorting has put it; its `id` stays.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Inclusions {
    /// The kinds there are.
    pub kinds: Vec<Kind>,
    /// Number that a body keeps for life.
    pub id: Vec<u64>,
    /// Kind, by its place among the kinds.
    pub kind: Vec<u16>,
    /// Batch that the body came with, from 1; 0 for none.
    pub batch: Vec<u16>,
    /// Centre in m.
    pub position: Vec<DVec3>,
    /// Turn from the body's axes to those of space.
    pub orientation: Vec<DQuat>,
    /// Velocity in m/s of the centre.
    pub velocity: Vec<DVec3>,
    /// Angular velocity in 1/s.
    pub angular_velocity: Vec<DVec3>,
    /// Bodies and walls that it touched in the last step.
    pub contacts: Vec<u32>,
}

impl Inclusions {
    /// Number of bodies.
    pub fn len(&self) -> usize {
        self.position.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.position.is_empty()
    }

    /// Adds a body at rest; its id is one more than the largest so far.
    pub fn add(&mut self, kind: u16, batch: u16, position: DVec3, orientation: DQuat) {
        self.id.push(self.id.iter().max().map_or(0, |id| id + 1));
        self.kind.push(kind);
        self.batch.push(batch);
        self.position.push(position);
        self.orientation.push(orientation);
        self.velocity.push(DVec3::ZERO);
        self.angular_velocity.push(DVec3::ZERO);
        self.contacts.push(0);
    }

    /// Form of a body.
    pub fn form(&self, n: usize) -> &Form {
        &self.kinds[usize::from(self.kind[n])].form
    }

    /// Axis of a body: its own z, as a unit vector.
    pub fn axis(&self, n: usize) -> DVec3 {
        self.orientation[n] * DVec3::Z
    }
}
