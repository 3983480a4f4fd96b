//! Periodic sides: what leaves on one side is there again beyond the other.

use tremie_numerics::DVec3;

/// A node that is there again, elsewhere.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Copy {
    /// Whose copy it is, by number.
    pub of: u32,
    /// How far from there, in m.
    pub off: DVec3,
}

/// The copies of nodes that are nearer than `reach` to the box from `low` to `high`, which is periodic along some axes; all in m.
pub fn copies(positions: &[DVec3], low: DVec3, high: DVec3, periodic: [bool; 3], reach: f64) -> Vec<Copy> {
    let axes = || (0..3).filter(|axis| periodic[*axis]);
    let numbers = |axis: usize| match periodic[axis] {
        true => (reach / (high[axis] - low[axis])).ceil() as i64,
        false => 0,
    };
    let [nx, ny, nz] = [0, 1, 2].map(numbers);
    let mut offsets: Vec<DVec3> = Vec::new();
    for k in -nz..=nz {
        for j in -ny..=ny {
            for i in -nx..=nx {
                if [i, j, k] != [0; 3] {
                    offsets.push(DVec3::new(i as f64, j as f64, k as f64) * (high - low));
                }
            }
        }
    }
    let mut found = Vec::new();
    for (of, at) in (0..).zip(positions) {
        let near = |off: &&DVec3| {
            axes().all(|axis| {
                let x = at[axis] + off[axis];
                x > low[axis] - reach && x < high[axis] + reach
            })
        };
        found.extend(offsets.iter().filter(near).map(|off| Copy { of, off: *off }));
    }
    found
}

#[cfg(test)]
mod tests {
    use tremie_geometry::{Body, Shape};

    use super::*;
    use crate::{Dimension, Kernel, Neighbours, Smoothing, nodes};

    /// In a box that is narrower than the kernel along y: sums over neighbours are the same everywhere.
    #[test]
    fn the_lattice_goes_on_beyond_periodic_sides() {
        let (spacing, high) = (0.01, DVec3::new(0.1, 0.02, 0.08));
        let full = Body::Shape(Shape::Box { min: DVec3::ZERO, max: high });
        let fluid = nodes(&full, spacing, Dimension::Three, 0.0);
        let kernel = Smoothing::new(Kernel::Wendland, Dimension::Three, 1.3 * spacing);
        let mut all = fluid.clone();
        let copies = copies(&fluid, DVec3::ZERO, high, [true; 3], kernel.support());
        all.extend(copies.iter().map(|copy| fluid[copy.of as usize] + copy.off));
        let near = Neighbours::within(&all, kernel.support());
        assert!((0..fluid.len()).all(|n| near.of(n).len() == 80));
    }
}
