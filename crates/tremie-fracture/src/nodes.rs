//! Where the nodes are: at random, no two nearer than a distance that grows away from the crack plane, and mirrored about it.
//!
//! Random sequential addition (Widom 1966), strip by strip, the finest first. Nodes keep half a distance from the sides and
//! from the crack plane, so that those of mirrored pairs are a whole one apart, and the facets between pairs tile the plane.

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use tremie_numerics::DVec3;

/// Candidates refused one after the other at which a strip counts as full.
const REFUSALS: usize = 20_000;
/// How much coarser each strip is than the one before.
const GROWTH: f64 = 1.35;
/// Thickness of the first strip, and of the others, in its distances.
const THICKNESS: [f64; 2] = [2.0, 3.0];

/// How far nodes are apart.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Grading {
    /// Least distance in m of nodes at the crack plane.
    pub finest: f64,
    /// The same far from it, in m.
    pub coarsest: f64,
}

/// Nodes in the box from the origin to `size`, around the crack plane x = `crack` in m.
pub(crate) fn scatter(size: DVec3, crack: f64, grading: Grading, seed: u64) -> Vec<DVec3> {
    let mut random = Pcg64Mcg::seed_from_u64(seed);
    let mut taken = Taken::new(size, grading.finest);
    // What is nearer than this is mirrored; the rest of the longer side is filled by itself.
    let mirrored = crack.min(size.x - crack);
    let (mut from, mut distance, mut thickness) = (0.0, grading.finest, THICKNESS[0]);
    let end = crack.max(size.x - crack);
    while from < end {
        let last = distance >= grading.coarsest;
        let to = if last { end } else { (from + thickness * distance).min(end) };
        for side in [-1.0, 1.0] {
            let reach = if side < 0.0 { crack } else { size.x - crack };
            // Both sides get their images from below, as far as there are two.
            let start = if side < 0.0 { from } else { from.max(mirrored) };
            let wall = 0.5 * distance;
            let (start, stop) = (start.max(wall), to.min(reach - wall));
            let across = size - DVec3::splat(distance);
            if start >= stop || across.y <= 0.0 || across.z <= 0.0 {
                continue;
            }
            let mut refusals = 0;
            while refusals < REFUSALS {
                let mut uniform = || random.random::<f64>();
                let away = start + (stop - start) * uniform();
                let (y, z) = (wall + across.y * uniform(), wall + across.z * uniform());
                let node = DVec3::new(crack + side * away, y, z);
                if taken.near(node, distance) {
                    refusals += 1;
                    continue;
                }
                refusals = 0;
                taken.add(node);
                if side < 0.0 && away < mirrored {
                    taken.add(DVec3::new(crack + away, y, z));
                }
            }
        }
        from = to;
        distance = (distance * GROWTH).min(grading.coarsest);
        thickness = THICKNESS[1];
    }
    taken.nodes
}

/// Nodes by cubes of space.
struct Taken {
    nodes: Vec<DVec3>,
    size: f64,
    count: [usize; 3],
    members: Vec<Vec<u32>>,
}

impl Taken {
    fn new(extent: DVec3, size: f64) -> Self {
        let count = extent.to_array().map(|length| (length / size) as usize + 1);
        Self { nodes: Vec::new(), size, count, members: vec![Vec::new(); count.iter().product()] }
    }

    fn add(&mut self, node: DVec3) {
        let [x, y, z] = self.place(node);
        self.members[x + self.count[0] * (y + self.count[1] * z)].push(self.nodes.len() as u32);
        self.nodes.push(node);
    }

    fn place(&self, node: DVec3) -> [usize; 3] {
        let place = (node / self.size).to_array();
        [0, 1, 2].map(|axis| (place[axis].max(0.0) as usize).min(self.count[axis] - 1))
    }

    /// Whether a node is nearer than `distance`.
    fn near(&self, node: DVec3, distance: f64) -> bool {
        let reach = DVec3::splat(distance);
        let (low, high) = (self.place(node - reach), self.place(node + reach));
        (low[2]..=high[2]).any(|z| {
            (low[1]..=high[1]).any(|y| {
                (low[0]..=high[0]).any(|x| {
                    self.members[x + self.count[0] * (y + self.count[1] * z)]
                        .iter()
                        .any(|n| self.nodes[*n as usize].distance_squared(node) < distance * distance)
                })
            })
        })
    }
}
