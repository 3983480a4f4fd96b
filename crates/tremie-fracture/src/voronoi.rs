//! The Voronoi diagram of nodes in a box: each cell is the box, cut at the planes half-way to the nodes around.
//!
//! Nodes further away than twice the furthest corner cut no more. Corners nearer to a plane than rounding lie on it, so that nodes that
//! are mirror images of each other, many of whose corners are shared by more than four cells, need no exact arithmetic: what becomes of
//! such a corner changes areas by no more than rounding.

use rayon::prelude::*;
use tremie_numerics::DVec3;

/// Distances below this share of the box are none.
const ROUNDING: f64 = 1e-13;

/// What lies beyond a face of a cell.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Beyond {
    /// The cell of another node.
    Node(usize),
    /// A side of the box: twice the axis, and one more for the upper side.
    Side(usize),
}

/// A flat face.
#[derive(Debug, Clone)]
pub(crate) struct Face {
    /// What is on its other side.
    pub(crate) beyond: Beyond,
    /// Its corners in m, in order.
    pub(crate) corners: Vec<DVec3>,
}

/// The cells of the nodes, each a list of faces.
pub(crate) fn cells(nodes: &[DVec3], low: DVec3, high: DVec3) -> Vec<Vec<Face>> {
    let bins = Bins::new(nodes, low, high);
    (0..nodes.len()).into_par_iter().map(|node| cell(node, nodes, &bins, low, high)).collect()
}

fn cell(node: usize, nodes: &[DVec3], bins: &Bins, low: DVec3, high: DVec3) -> Vec<Face> {
    let here = nodes[node];
    let rounding = ROUNDING * (high - low).max_element();
    let mut faces = sides(low, high);
    let mut reach = furthest(&faces, here);
    for ring in 0.. {
        // All that is nearer than this has been seen in the rings before.
        if bins.size * (ring as f64 - 1.0) >= 2.0 * reach || ring > bins.most() {
            break;
        }
        let mut near: Vec<(f64, usize)> = Vec::new();
        bins.ring(here, ring, |other| {
            if other != node {
                near.push((nodes[other].distance_squared(here), other));
            }
        });
        near.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        for (square, other) in near {
            if square.sqrt() < 2.0 * reach && cut(&mut faces, here, nodes[other], other, rounding) {
                reach = furthest(&faces, here);
            }
        }
    }
    faces
}

/// The six sides of a box.
fn sides(low: DVec3, high: DVec3) -> Vec<Face> {
    let bound = [low, high];
    let mut faces = Vec::new();
    for axis in 0..3 {
        for upper in 0..2 {
            let [one, two] = [(axis + 1) % 3, (axis + 2) % 3];
            let corners = [(0, 0), (1, 0), (1, 1), (0, 1)].map(|(a, b)| {
                let mut corner = DVec3::ZERO;
                corner[axis] = bound[upper][axis];
                corner[one] = bound[a][one];
                corner[two] = bound[b][two];
                corner
            });
            faces.push(Face { beyond: Beyond::Side(2 * axis + upper), corners: corners.to_vec() });
        }
    }
    faces
}

fn furthest(faces: &[Face], from: DVec3) -> f64 {
    let corners = faces.iter().flat_map(|face| &face.corners);
    corners.map(|corner| corner.distance_squared(from)).fold(0.0, f64::max).sqrt()
}

/// Cuts off what is nearer to another node; whether there was anything.
fn cut(faces: &mut Vec<Face>, here: DVec3, there: DVec3, other: usize, rounding: f64) -> bool {
    let normal = (there - here).normalize();
    let middle = 0.5 * (here + there);
    let beyond = |corner: &DVec3| (*corner - middle).dot(normal);
    if !faces.iter().flat_map(|face| &face.corners).any(|corner| beyond(corner) > rounding) {
        return false;
    }
    let mut rim: Vec<DVec3> = Vec::new();
    faces.retain_mut(|face| {
        let count = face.corners.len();
        let mut kept = Vec::with_capacity(count + 1);
        for k in 0..count {
            let (a, b) = (face.corners[k], face.corners[(k + 1) % count]);
            let (at_a, at_b) = (beyond(&a), beyond(&b));
            if at_a <= rounding {
                kept.push(a);
                if at_a >= -rounding {
                    rim.push(a);
                }
            }
            if (at_a < -rounding && at_b > rounding) || (at_a > rounding && at_b < -rounding) {
                // From the inside out: both faces at the edge find the same point.
                let (a, b, at_a, at_b) = if at_a < 0.0 { (a, b, at_a, at_b) } else { (b, a, at_b, at_a) };
                let point = a + (b - a) * (at_a / (at_a - at_b));
                kept.push(point);
                rim.push(point);
            }
        }
        face.corners = kept;
        face.corners.len() > 2
    });
    // The new face is convex: its corners are ordered by angle.
    let mut corners: Vec<DVec3> = Vec::new();
    for point in rim {
        if corners.iter().all(|corner| corner.distance(point) > 4.0 * rounding) {
            corners.push(point);
        }
    }
    if corners.len() > 2 {
        let centre = corners.iter().sum::<DVec3>() / corners.len() as f64;
        let across = normal.any_orthonormal_vector();
        let up = normal.cross(across);
        let angle = |corner: &DVec3| (*corner - centre).dot(up).atan2((*corner - centre).dot(across));
        corners.sort_by(|a, b| angle(a).total_cmp(&angle(b)));
        faces.push(Face { beyond: Beyond::Node(other), corners });
    }
    true
}

/// Nodes by cubes of space.
struct Bins {
    low: DVec3,
    size: f64,
    count: [usize; 3],
    members: Vec<Vec<usize>>,
}

impl Bins {
    fn new(nodes: &[DVec3], low: DVec3, high: DVec3) -> Self {
        let extent = high - low;
        let size = (extent.element_product() / nodes.len().max(1) as f64).cbrt();
        let count = extent.to_array().map(|length| (length / size).ceil().max(1.0) as usize);
        let mut bins = Self { low, size, count, members: vec![Vec::new(); count.iter().product()] };
        for (n, node) in nodes.iter().enumerate() {
            let [x, y, z] = bins.place(*node);
            bins.members[x + count[0] * (y + count[1] * z)].push(n);
        }
        bins
    }

    fn place(&self, point: DVec3) -> [usize; 3] {
        let place = ((point - self.low) / self.size).to_array();
        [0, 1, 2].map(|axis| (place[axis].max(0.0) as usize).min(self.count[axis] - 1))
    }

    fn most(&self) -> usize {
        self.count.into_iter().max().unwrap_or(0)
    }

    /// Visits all nodes in the bins that are `ring` bins away.
    fn ring(&self, point: DVec3, ring: usize, mut visit: impl FnMut(usize)) {
        let place = self.place(point);
        let low = [0, 1, 2].map(|axis| place[axis].saturating_sub(ring));
        let high = [0, 1, 2].map(|axis| (place[axis] + ring).min(self.count[axis] - 1));
        for z in low[2]..=high[2] {
            for y in low[1]..=high[1] {
                for x in low[0]..=high[0] {
                    let far = [x, y, z].into_iter().zip(place).map(|(a, b)| a.abs_diff(b)).max();
                    if far == Some(ring) {
                        self.members[x + self.count[0] * (y + self.count[1] * z)]
                            .iter()
                            .for_each(|n| visit(*n));
                    }
                }
            }
        }
    }
}
