//! The bodies, as arrays.

use tremie_numerics::{DMat3, DQuat, DVec3};

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
    /// The next such number.
    pub next: u64,
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
    /// Force in N of the fluid in the last step, beside what the body weighs less for lying in it.
    pub drag: Vec<DVec3>,
    /// Moment in N m of that force about the centre.
    pub torque: Vec<DVec3>,
    /// Mean of the drag in N over the steps before, the older the less.
    pub mean_drag: Vec<DVec3>,
    /// The same for the first moment of the forces of the fluid about the centre, `sum r F`, in N m: column c has the forces along axis c.
    pub mean_moment: Vec<DMat3>,
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

    /// Adds a body at rest.
    pub fn add(&mut self, kind: u16, batch: u16, position: DVec3, orientation: DQuat) {
        self.id.push(self.next);
        self.next += 1;
        self.kind.push(kind);
        self.batch.push(batch);
        self.position.push(position);
        self.orientation.push(orientation);
        self.velocity.push(DVec3::ZERO);
        self.angular_velocity.push(DVec3::ZERO);
        self.drag.push(DVec3::ZERO);
        self.torque.push(DVec3::ZERO);
        self.mean_drag.push(DVec3::ZERO);
        self.mean_moment.push(DMat3::ZERO);
        self.contacts.push(0);
    }

    /// All that changes, as numbers and labels that can be saved: 31 and 4 for each body.
    pub fn saved(&self) -> (Vec<f64>, Vec<u32>) {
        let (mut numbers, mut labels) = (Vec::new(), Vec::new());
        for n in 0..self.len() {
            let vectors = [
                self.position[n],
                self.velocity[n],
                self.angular_velocity[n],
                self.drag[n],
                self.torque[n],
                self.mean_drag[n],
            ];
            numbers.extend(vectors.iter().flat_map(|vector| vector.to_array()));
            numbers.extend(self.mean_moment[n].to_cols_array());
            numbers.extend(self.orientation[n].to_array());
            let (id, kind) = (self.id[n], u32::from(self.kind[n]) | u32::from(self.batch[n]) << 16);
            labels.extend([id as u32, (id >> 32) as u32, kind, self.contacts[n]]);
        }
        (numbers, labels)
    }

    /// Puts bodies of the same kinds in place of these, as they were saved; none if that is not what these are.
    pub fn load(&mut self, numbers: &[f64], labels: &[u32]) -> Option<()> {
        let mut new = Self { kinds: std::mem::take(&mut self.kinds), ..Self::default() };
        let fits = numbers.len().is_multiple_of(31) && numbers.len() / 31 * 4 == labels.len();
        for (numbers, labels) in numbers.chunks_exact(31).zip(labels.chunks_exact(4)) {
            let vector = |n: usize| DVec3::from_slice(&numbers[3 * n..]);
            let (kind, batch) = (labels[2] as u16, (labels[2] >> 16) as u16);
            if usize::from(kind) >= new.kinds.len() {
                return None;
            }
            new.add(kind, batch, vector(0), DQuat::from_slice(&numbers[27..]));
            let n = new.len() - 1;
            new.id[n] = u64::from(labels[0]) | u64::from(labels[1]) << 32;
            new.contacts[n] = labels[3];
            [new.velocity[n], new.angular_velocity[n]] = [vector(1), vector(2)];
            [new.drag[n], new.torque[n], new.mean_drag[n]] = [vector(3), vector(4), vector(5)];
            new.mean_moment[n] = DMat3::from_cols_slice(&numbers[18..]);
        }
        new.next = new.id.iter().max().map_or(0, |id| id.saturating_add(1));
        *self = new;
        fits.then_some(())
    }

    /// Puts bodies that lie in one cube of the edge `edge` in m beside each other in memory: what they ask of the fluid then is near too. Cubes follow each
    /// other along the last of the axes first.
    pub fn sort(&mut self, edge: f64, axes: [usize; 3]) {
        let cube = |n: &usize| {
            let cube = (self.position[*n] / edge).floor().to_array().map(|x| x as i64);
            (axes.map(|a| cube[a]), self.id[*n])
        };
        let mut order: Vec<usize> = (0..self.len()).collect();
        order.sort_by_cached_key(cube);
        self.pick(&order);
    }

    /// Takes out the bodies that do not stay; the others keep their order.
    pub fn retain(&mut self, stays: impl Fn(usize) -> bool) {
        let order: Vec<usize> = (0..self.len()).filter(|n| stays(*n)).collect();
        if order.len() < self.len() {
            self.pick(&order);
        }
    }

    /// Keeps the bodies at these places, in this order.
    fn pick(&mut self, order: &[usize]) {
        fn picked<T: Clone>(of: &[T], order: &[usize]) -> Vec<T> {
            order.iter().map(|n| of[*n].clone()).collect()
        }
        *self = Self {
            kinds: std::mem::take(&mut self.kinds),
            next: self.next,
            id: picked(&self.id, order),
            kind: picked(&self.kind, order),
            batch: picked(&self.batch, order),
            position: picked(&self.position, order),
            orientation: picked(&self.orientation, order),
            velocity: picked(&self.velocity, order),
            angular_velocity: picked(&self.angular_velocity, order),
            drag: picked(&self.drag, order),
            torque: picked(&self.torque, order),
            mean_drag: picked(&self.mean_drag, order),
            mean_moment: picked(&self.mean_moment, order),
            contacts: picked(&self.contacts, order),
        };
    }

    /// Form of a body.
    pub fn form(&self, n: usize) -> &Form {
        &self.kinds[usize::from(self.kind[n])].form
    }

    /// Both ends of a body in m, if it is a fibre.
    pub fn ends(&self, n: usize) -> Option<[DVec3; 2]> {
        let Form::Fibre { length, .. } = *self.form(n) else { return None };
        let half = 0.5 * length * self.axis(n);
        Some([self.position[n] - half, self.position[n] + half])
    }

    /// Axis of a body: its own z, as a unit vector.
    pub fn axis(&self, n: usize) -> DVec3 {
        self.orientation[n] * DVec3::Z
    }
}
