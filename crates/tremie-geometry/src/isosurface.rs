//! Surface of equal value through a grid of point values (marching cubes: Lorensen and Cline 1987).
//!
//! Values are stored with x running fastest, then y, then z; positions are in metres. The surface separates points
//! above `iso` (inside) from all others (outside, NaN included), and its triangles turn counter-clockwise seen from
//! outside. Vertices are shared: every edge belongs to exactly two triangles that run along it in opposite
//! directions, unless it lies on the border of the grid. So the surface is closed when no border point is above
//! `iso`. Triangles may have no area where a value equals `iso` exactly.
//!
//! The 256 cases are derived, not listed. On each face of a cube the surface leaves segments that depend on the four
//! values of that face alone (where two diagonal corners are inside, they are kept apart), so neighbouring cubes
//! agree; the segments of the six faces join to loops, and each loop is cut into triangles.

use std::collections::HashMap;
use std::sync::LazyLock;

use tremie_numerics::DVec3;

/// Triangle mesh with shared vertices.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Mesh {
    /// Vertex positions in metres.
    pub positions: Vec<[f64; 3]>,
    /// Vertex indices, counter-clockwise seen from outside.
    pub triangles: Vec<[u32; 3]>,
}

impl Mesh {
    /// From the corners of its triangles in metres: corners that agree in all bits are one vertex.
    pub fn weld(triangles: impl IntoIterator<Item = [[f64; 3]; 3]>) -> Self {
        let mut mesh = Self::default();
        let mut known = HashMap::new();
        for triangle in triangles {
            let corners = triangle.map(|corner| {
                // Adding zero makes a negative zero a positive one.
                let corner = corner.map(|coordinate| coordinate + 0.0);
                *known.entry(corner.map(f64::to_bits)).or_insert_with(|| {
                    mesh.positions.push(corner);
                    (mesh.positions.len() - 1) as u32
                })
            });
            mesh.triangles.push(corners);
        }
        mesh
    }

    /// Area in square metres.
    pub fn area(&self) -> f64 {
        self.triangles
            .iter()
            .map(|t| {
                let [a, b, c] = self.corners(*t);
                0.5 * (b - a).cross(c - a).length()
            })
            .sum()
    }

    /// Enclosed volume in cubic metres, if the mesh is closed; positive when its triangles face outwards.
    pub fn volume(&self) -> f64 {
        self.triangles
            .iter()
            .map(|t| {
                let [a, b, c] = self.corners(*t);
                a.dot(b.cross(c)) / 6.0
            })
            .sum()
    }

    fn corners(&self, triangle: [u32; 3]) -> [DVec3; 3] {
        triangle.map(|i| DVec3::from(self.positions[i as usize]))
    }
}

/// Surface where `values`, given on `points` grid points along each axis, crosses `iso`.
///
/// The first point lies at `origin`, neighbours are `spacing` apart (both in metres, spacing positive).
///
/// # Panics
/// If the number of values is not the product of `points`.
pub fn marching_cubes(
    values: &[f32],
    points: [usize; 3],
    origin: [f64; 3],
    spacing: [f64; 3],
    iso: f32,
) -> Mesh {
    let [nx, ny, nz] = points;
    assert_eq!(values.len(), nx * ny * nz, "one value for each grid point");
    let mut mesh = Mesh::default();
    if points.iter().any(|&n| n < 2) {
        return mesh;
    }
    let stride = [1, nx, nx * ny];
    let corner_offset: [usize; 8] =
        std::array::from_fn(|c| (0..3).map(|axis| (c >> axis & 1) * stride[axis]).sum());

    // Vertices on the grid edges that start in the current layer of points and in the next one, three a point.
    let mut vertices = [vec![NONE; 3 * nx * ny], vec![NONE; 3 * nx * ny]];
    for k in 0..nz - 1 {
        for j in 0..ny - 1 {
            for i in 0..nx - 1 {
                let cell = i + nx * (j + ny * k);
                let case = (0..8).fold(0, |case, corner| {
                    case | usize::from(values[cell + corner_offset[corner]] > iso) << corner
                });
                for triangle in &CASES[case] {
                    mesh.triangles.push(triangle.map(|edge| {
                        let (start, axis) = EDGES[edge as usize];
                        let first = cell + corner_offset[start];
                        let slot = &mut vertices[start >> 2][3 * (first % (nx * ny)) + axis];
                        if *slot == NONE {
                            *slot = mesh.positions.len() as u32;
                            let t = crossing(values[first], values[first + stride[axis]], iso);
                            let at = [i + (start & 1), j + (start >> 1 & 1), k + (start >> 2)];
                            mesh.positions.push(std::array::from_fn(|d| {
                                let along = if d == axis { t } else { 0.0 };
                                origin[d] + spacing[d] * (at[d] as f64 + along)
                            }));
                        }
                        *slot
                    }));
                }
            }
        }
        vertices.swap(0, 1);
        vertices[1].fill(NONE);
    }
    mesh
}

const NONE: u32 = u32::MAX;

/// Where between two grid points the value passes `iso`, from 0 to 1.
fn crossing(a: f32, b: f32, iso: f32) -> f64 {
    let t = (f64::from(iso) - f64::from(a)) / (f64::from(b) - f64::from(a));
    if t.is_finite() { t.clamp(0.0, 1.0) } else { 0.5 }
}

/// The twelve edges of a cube: the corner where each starts, and its axis. Corner `c` lies at `(c & 1, c >> 1 & 1,
/// c >> 2)`.
const EDGES: [(usize, usize); 12] =
    [(0, 0), (2, 0), (4, 0), (6, 0), (0, 1), (1, 1), (4, 1), (5, 1), (0, 2), (1, 2), (2, 2), (3, 2)];

/// The corners of the six faces, counter-clockwise seen from outside the cube.
const FACES: [[usize; 4]; 6] =
    [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];

/// Triangles of each case, by the edges that their vertices lie on. Bit `c` of the case: corner `c` is inside.
static CASES: LazyLock<Vec<Vec<[u8; 3]>>> = LazyLock::new(|| (0..256).map(triangulate).collect());

fn triangulate(case: usize) -> Vec<[u8; 3]> {
    let inside = |corner: usize| case >> corner & 1 == 1;
    // On every face, a segment cuts off each run of inside corners, from the edge before the run to the edge after.
    let mut next = [None; 12];
    for face in FACES {
        for end in 0..4 {
            let after = face[(end + 1) % 4];
            if inside(face[end]) && !inside(after) {
                let mut begin = end;
                while inside(face[(begin + 3) % 4]) {
                    begin = (begin + 3) % 4;
                }
                let before = face[(begin + 3) % 4];
                next[edge_between(before, face[begin])] = Some(edge_between(face[end], after));
            }
        }
    }
    let mut triangles = Vec::new();
    for start in 0..12 {
        let mut ring = Vec::new();
        let mut edge = start;
        while let Some(following) = next[edge].take() {
            ring.push(edge);
            edge = following;
        }
        if !ring.is_empty() {
            triangles.extend(fan(&ring));
        }
    }
    triangles
}

fn edge_between(a: usize, b: usize) -> usize {
    let (start, axis) = (a.min(b), (a ^ b).trailing_zeros() as usize);
    EDGES.iter().position(|&edge| edge == (start, axis)).expect("neighbouring corners of a cube")
}

/// Cuts a ring into triangles around one of its vertices, such that no cut lies in a face of the cube: the
/// neighbouring cube might cut there too, and four triangles would meet.
fn fan(ring: &[usize]) -> Vec<[u8; 3]> {
    let n = ring.len();
    let at = |k: usize| ring[k % n];
    let apex = (0..n)
        .find(|&a| (2..n - 1).all(|k| !share_face(at(a), at(a + k))))
        .expect("every ring of the 256 cases has such a vertex");
    (1..n - 1).map(move |k| [at(apex), at(apex + k), at(apex + k + 1)].map(|edge| edge as u8)).collect()
}

fn share_face(a: usize, b: usize) -> bool {
    let ends = |edge: usize| {
        let (start, axis) = EDGES[edge];
        [start, start | 1 << axis]
    };
    FACES.iter().any(|face| ends(a).iter().chain(&ends(b)).all(|corner| face.contains(corner)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    /// Every edge is run along once in each direction.
    fn assert_closed(mesh: &Mesh) {
        let mut edges: HashMap<(u32, u32), usize> = HashMap::new();
        for t in &mesh.triangles {
            for (a, b) in [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])] {
                assert_ne!(a, b);
                *edges.entry((a, b)).or_default() += 1;
            }
        }
        for ((a, b), count) in &edges {
            assert_eq!(*count, 1, "edge {a}-{b}");
            assert_eq!(edges.get(&(*b, *a)), Some(&1), "edge {a}-{b} has no partner");
        }
    }

    fn random_values(count: usize, mut seed: u64) -> impl Iterator<Item = f32> {
        (0..count).map(move |_| {
            seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (seed >> 40) as f32 / (1u64 << 24) as f32
        })
    }

    #[test]
    fn sphere_has_its_area_and_volume_and_faces_outwards() {
        let (n, radius, centre) = ([33, 41, 37], 0.3, DVec3::new(0.01, 0.72, -0.48));
        let (origin, spacing) = ([-0.4, 0.3, -0.9], [0.025, 0.021, 0.024]);
        let mut values = Vec::new();
        for k in 0..n[2] {
            for j in 0..n[1] {
                for i in 0..n[0] {
                    let p: [f64; 3] = std::array::from_fn(|d| origin[d] + spacing[d] * [i, j, k][d] as f64);
                    values.push((radius - centre.distance(DVec3::from(p))) as f32);
                }
            }
        }
        let mesh = marching_cubes(&values, n, origin, spacing, 0.0);
        assert_closed(&mesh);
        assert!((mesh.area() / (4.0 * PI * radius * radius) - 1.0).abs() < 0.01, "{}", mesh.area());
        let volume = 4.0 / 3.0 * PI * radius.powi(3);
        assert!((mesh.volume() / volume - 1.0).abs() < 0.01, "{}", mesh.volume());
        for p in &mesh.positions {
            assert!((centre.distance(DVec3::from(*p)) - radius).abs() < 1e-3);
        }
    }

    #[test]
    fn random_values_give_a_closed_surface() {
        let n = [9, 12, 11];
        for seed in 0..40 {
            let mut values: Vec<f32> = random_values(n[0] * n[1] * n[2], seed).collect();
            for k in 0..n[2] {
                for j in 0..n[1] {
                    for i in 0..n[0] {
                        let border = [i, j, k].iter().zip(n).any(|(&at, n)| at == 0 || at == n - 1);
                        if border {
                            values[i + n[0] * (j + n[1] * k)] = 0.0;
                        }
                    }
                }
            }
            let mesh = marching_cubes(&values, n, [0.0; 3], [1.0; 3], 0.2 + 0.015 * seed as f32);
            assert!(!mesh.triangles.is_empty());
            assert_closed(&mesh);
            assert!(mesh.volume() > 0.0);
        }
    }

    #[test]
    fn every_case_is_closed_by_its_neighbours() {
        for case in 0..256usize {
            let mut values = vec![0.0; 64];
            for corner in 0..8 {
                let at = [1 + (corner & 1), 1 + (corner >> 1 & 1), 1 + (corner >> 2)];
                values[at[0] + 4 * (at[1] + 4 * at[2])] = (case >> corner & 1) as f32;
            }
            let mesh = marching_cubes(&values, [4; 3], [0.0; 3], [1.0; 3], 0.5);
            assert_closed(&mesh);
            assert_eq!(mesh.triangles.is_empty(), case == 0);
        }
    }

    #[test]
    fn a_plane_lies_where_the_values_say() {
        let values: Vec<f32> = (0..27).map(|n| 2.0 - (n / 9) as f32).collect();
        let mesh = marching_cubes(&values, [3; 3], [0.0, 0.0, 5.0], [0.5; 3], 1.25);
        assert!(mesh.positions.iter().all(|p| (p[2] - 5.375).abs() < 1e-12));
        assert!((mesh.area() - 1.0).abs() < 1e-12);
        // High values below: the surface looks up.
        let [a, b, c] = mesh.corners(mesh.triangles[0]);
        assert!((b - a).cross(c - a).z > 0.0);
    }

    #[test]
    fn odd_values_do_no_harm() {
        for odd in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 0.5] {
            let mut values = vec![0.0; 125];
            values[62] = odd;
            values[63] = 1.0;
            let mesh = marching_cubes(&values, [5; 3], [0.0; 3], [1.0; 3], 0.5);
            assert_closed(&mesh);
            assert!(mesh.positions.iter().flatten().all(|x| x.is_finite()));
        }
        assert_eq!(marching_cubes(&[1.0; 4], [2, 2, 1], [0.0; 3], [1.0; 3], 0.5), Mesh::default());
    }
}
