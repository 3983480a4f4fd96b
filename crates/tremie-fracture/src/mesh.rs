//! The lattice's geometry: rigid cells, the facets between them, those in the crack plane, and those on the sides.

use tremie_numerics::{DMat3, DVec3};

use crate::nodes::{Grading, scatter};
use crate::voronoi::{Beyond, Face, cells};

/// Facets smaller than this share of the squared distance of nodes are slivers of rounding.
const SLIVER: f64 = 1e-11;

/// A facet between two cells, or between a cell and a side of the beam.
#[derive(Debug, Clone)]
pub struct Facet {
    /// The cell below: the one whose node has the smaller number, or the one on the side of smaller x in the crack plane.
    pub cell: usize,
    /// The other cell; none on the sides.
    pub other: Option<usize>,
    /// Area in m2.
    pub area: f64,
    /// Centroid in m.
    pub centroid: DVec3,
    /// Second moments of area about the centroid, in m4: the integral of r r'.
    pub moments: DMat3,
    /// Unit normal, out of `cell`.
    pub normal: DVec3,
    /// Distance in m between the nodes; from the node to the side where there is no other.
    pub length: f64,
    /// Corners in m.
    pub corners: Vec<DVec3>,
}

/// Cells and facets.
#[derive(Debug, Clone)]
pub struct Mesh {
    /// Dimensions of the beam in m; its lower corner is the origin.
    pub size: DVec3,
    /// Where the crack plane is, along x, in m.
    pub crack: f64,
    /// Nodes of the cells in m.
    pub nodes: Vec<DVec3>,
    /// Facets between cells but for those in the crack plane.
    pub facets: Vec<Facet>,
    /// Facets that tile the crack plane, from the cell at smaller x to its image.
    pub plane: Vec<Facet>,
    /// Facets on the sides: lower and upper in x, in y, in z.
    pub sides: [Vec<Facet>; 6],
}

impl Mesh {
    /// A lattice in the box from the origin to `size`, graded to the crack plane x = `crack` (all in m).
    pub fn new(size: DVec3, crack: f64, grading: Grading, seed: u64) -> Self {
        Self::of(scatter(size, crack, grading, seed), size, crack)
    }

    /// A lattice in the box from the origin to `size`, alike everywhere, with nodes at least `distance` apart (in m).
    pub fn even(size: DVec3, distance: f64, seed: u64) -> Self {
        // About a plane at one end nothing is mirrored.
        Self::new(size, 0.0, Grading { finest: distance, coarsest: distance }, seed)
    }

    /// The lattice of nodes that are given; those next to the crack plane must be mirrored about it.
    pub fn of(nodes: Vec<DVec3>, size: DVec3, crack: f64) -> Self {
        let mut mesh = Self { size, crack, facets: vec![], plane: vec![], sides: Default::default(), nodes };
        let rounding = 1e-9 * size.x;
        for (cell, faces) in cells(&mesh.nodes, DVec3::ZERO, size).into_iter().enumerate() {
            for face in faces {
                let facet = mesh.facet(cell, &face);
                match face.beyond {
                    Beyond::Side(side) => mesh.sides[side].push(facet),
                    Beyond::Node(_) if facet.area < SLIVER * facet.length.powi(2) => {}
                    Beyond::Node(other) => {
                        let [here, there] = [mesh.nodes[cell], mesh.nodes[other]];
                        let middle = 0.5 * (here.x + there.x);
                        let across = (middle - crack).abs() < rounding && facet.normal.x.abs() > 1.0 - 1e-12;
                        if across && here.x < crack {
                            mesh.plane.push(facet);
                        } else if !across && cell < other {
                            mesh.facets.push(facet);
                        }
                    }
                }
            }
        }
        mesh
    }

    fn facet(&self, cell: usize, face: &Face) -> Facet {
        let here = self.nodes[cell];
        match face.beyond {
            Beyond::Node(other) => Facet::between(&self.nodes, [cell, other], face.corners.clone()),
            Beyond::Side(side) => {
                let axis = side / 2;
                let sign = if side % 2 == 0 { -1.0 } else { 1.0 };
                let bound = if side % 2 == 0 { 0.0 } else { self.size[axis] };
                let normal = sign * [DVec3::X, DVec3::Y, DVec3::Z][axis];
                let Polygon { area, centroid, moments } = Polygon::of(&face.corners);
                let (length, corners) = ((bound - here[axis]).abs(), face.corners.clone());
                Facet { cell, other: None, area, centroid, moments, normal, length, corners }
            }
        }
    }
}

impl Facet {
    /// The facet between two of the cells, whose corners in m are given in order.
    pub fn between(nodes: &[DVec3], [cell, other]: [usize; 2], corners: Vec<DVec3>) -> Self {
        let way = nodes[other] - nodes[cell];
        let Polygon { area, centroid, moments } = Polygon::of(&corners);
        let (normal, length) = (way.normalize(), way.length());
        Self { cell, other: Some(other), area, centroid, moments, normal, length, corners }
    }
}

/// What there is to know of a flat convex polygon.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Polygon {
    pub(crate) area: f64,
    pub(crate) centroid: DVec3,
    /// Integral of r r' about the centroid.
    pub(crate) moments: DMat3,
}

impl Polygon {
    pub(crate) fn of(corners: &[DVec3]) -> Self {
        let Some(first) = corners.first() else {
            return Self { area: 0.0, centroid: DVec3::ZERO, moments: DMat3::ZERO };
        };
        let middle = corners.iter().sum::<DVec3>() / corners.len() as f64;
        let triangles = triangles(corners, middle);
        let area: f64 = triangles.iter().map(|t| t.0).sum();
        let weighted: DVec3 = triangles.iter().map(|(a, p)| *a * (p[0] + p[1] + p[2])).sum();
        let centroid = if area > 0.0 { weighted / (3.0 * area) } else { *first };
        let mut moments = DMat3::ZERO;
        for (a, corners) in &triangles {
            let [p, q, r] = corners.map(|corner| corner - centroid);
            for v in [p, q, r, p + q + r] {
                moments += outer(v, v) * (a / 12.0);
            }
        }
        Self { area, centroid, moments }
    }
}

/// Triangles of a convex polygon about a point within, with their areas.
fn triangles(corners: &[DVec3], centre: DVec3) -> Vec<(f64, [DVec3; 3])> {
    (0..corners.len())
        .map(|k| {
            let (a, b) = (corners[k], corners[(k + 1) % corners.len()]);
            (0.5 * (a - centre).cross(b - centre).length(), [centre, a, b])
        })
        .collect()
}

/// The matrix a b'.
pub(crate) fn outer(a: DVec3, b: DVec3) -> DMat3 {
    DMat3::from_cols(a * b.x, a * b.y, a * b.z)
}

/// Points and weights (areas in m2) that integrate polynomials of second degree over a convex polygon: the middles of the edges of its triangles
/// about the centroid.
pub(crate) fn quadrature(corners: &[DVec3]) -> Vec<(DVec3, f64)> {
    let polygon = Polygon::of(corners);
    triangles(corners, polygon.centroid)
        .into_iter()
        .flat_map(|(area, [p, q, r])| [p + q, q + r, r + p].map(|sum| (0.5 * sum, area / 3.0)))
        .collect()
}

/// What of a convex polygon lies above a height in m.
pub(crate) fn above(corners: &[DVec3], height: f64) -> Vec<DVec3> {
    let mut kept = Vec::with_capacity(corners.len() + 1);
    for k in 0..corners.len() {
        let (a, b) = (corners[k], corners[(k + 1) % corners.len()]);
        if a.z >= height {
            kept.push(a);
        }
        if (a.z > height && b.z < height) || (a.z < height && b.z > height) {
            kept.push(a + (b - a) * ((height - a.z) / (b.z - a.z)));
        }
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: DVec3 = DVec3::new(0.6, 0.15, 0.15);

    fn graded() -> Mesh {
        Mesh::new(SIZE, 0.3, Grading { finest: 0.012, coarsest: 0.025 }, 7)
    }

    #[test]
    fn cells_fill_the_beam_and_close() {
        let mesh = graded();
        let mut volume = vec![0.0; mesh.nodes.len()];
        let mut open = vec![DVec3::ZERO; mesh.nodes.len()];
        let sides = mesh.sides.iter().flatten();
        for facet in mesh.facets.iter().chain(&mesh.plane).chain(sides) {
            for (cell, sign) in [(Some(facet.cell), 1.0), (facet.other, -1.0)] {
                let Some(cell) = cell else { continue };
                let normal = sign * facet.normal;
                volume[cell] += facet.area * (facet.centroid - mesh.nodes[cell]).dot(normal) / 3.0;
                open[cell] += facet.area * normal;
            }
        }
        let total: f64 = volume.iter().sum();
        assert!((total / SIZE.element_product() - 1.0).abs() < 1e-9, "{total}");
        let worst = open.iter().map(|v| v.length()).fold(0.0, f64::max);
        assert!(worst < 1e-14, "{worst:e} m2");
        for (side, facets) in mesh.sides.iter().enumerate() {
            let area: f64 = facets.iter().map(|facet| facet.area).sum();
            let exact = SIZE.element_product() / SIZE[side / 2];
            assert!((area / exact - 1.0).abs() < 1e-9, "side {side}: {area}");
        }
    }

    #[test]
    fn facets_of_mirrored_pairs_tile_the_crack_plane() {
        for crack in [0.3, 0.24] {
            let mesh = Mesh::new(SIZE, crack, Grading { finest: 0.012, coarsest: 0.025 }, 3);
            let area: f64 = mesh.plane.iter().map(|facet| facet.area).sum();
            assert!((area / 0.0225 - 1.0).abs() < 1e-9, "{area}");
            assert!(mesh.plane.iter().all(|facet| (facet.centroid.x - crack).abs() < 1e-12));
        }
    }

    #[test]
    fn planes_of_facets_pass_half_way_between_the_nodes() {
        let mesh = graded();
        for facet in &mesh.facets {
            let middle = 0.5 * (mesh.nodes[facet.cell] + mesh.nodes[facet.other.unwrap()]);
            assert!((facet.centroid - middle).dot(facet.normal).abs() < 1e-12);
        }
    }

    #[test]
    fn quadrature_integrates_second_moments() {
        let mesh = graded();
        for facet in &mesh.plane {
            let sum: f64 = quadrature(&facet.corners)
                .iter()
                .map(|(point, weight)| weight * (*point - facet.centroid).z.powi(2))
                .sum();
            assert!((sum - facet.moments.z_axis.z).abs() < 1e-12 * facet.area);
        }
        let all = above(&mesh.plane[0].corners, -1.0);
        assert_eq!(all, mesh.plane[0].corners);
        let notched: f64 =
            mesh.plane.iter().map(|facet| Polygon::of(&above(&facet.corners, 0.025)).area).sum();
        assert!((notched / (0.15 * 0.125) - 1.0).abs() < 1e-9, "{notched}");
    }
}
