//! Bodies bounded by triangles, as drawing programs export them.
//!
//! A [`ClosedMesh`] is made only from a mesh that bounds a body: every edge joins two facets that run along it in opposite
//! directions, no facet is without area, none crosses another, and every shell is turned outwards, or inwards where it bounds a
//! hollow. What is not so is told as a [`Defect`], with count and place.
//!
//! The distance is that of the nearest facet, found by a tree of boxes and, within a facet, after Ericson (Real-Time Collision
//! Detection, 2005, section 5.1.5). Its sign is that of the pseudo-normal at the nearest point: of the facet, of the two facets of
//! an edge, or of all at a vertex, each weighted with its angle there, which is right for any closed mesh (Baerentzen and Aanaes,
//! IEEE Trans. Vis. Comput. Graph. 11, 2005, 243-253). Coordinates are in m.

use std::collections::HashMap;
use std::f64::consts::PI;
use std::fmt;

use tremie_numerics::{DMat3, DVec3};

use crate::ROUNDING;
use crate::isosurface::Mesh;
use crate::tree::Tree;

/// A facet whose height is less than this share of its longest edge has no area: its normal would be that of rounding.
const FLAT: f64 = 1e-10;
/// An edge that passes a facet by less than this share of it crosses it.
const TOUCH: f64 = 1e-9;
/// Cosine of the angle between normals from which on two facets are the two sides of a wall, not those of an edge.
const FACING: f64 = -0.9;

/// Why a mesh bounds no body.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[error("{what}, the first at {} {} {} m", place.x, place.y, place.z)]
pub struct Defect {
    /// What is wrong, and how often.
    pub what: Trouble,
    /// Where it is wrong first, in m.
    pub place: DVec3,
}

/// What can be wrong with a mesh, and how often it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Trouble {
    /// It has no facets.
    Empty,
    /// Corners of facets that are not numbers.
    NotNumbers(usize),
    /// Facets without area.
    ZeroArea(usize),
    /// Edges with a facet on one side only: the rims of holes.
    Open(usize),
    /// Edges where more than two facets meet.
    Branching(usize),
    /// Facets that are turned the other way than the rest of their shell.
    Flipped(usize),
    /// Edges that pierce a facet.
    Crossing(usize),
    /// Shells that are turned inside out, but not all of them.
    Inverted(usize),
}

impl fmt::Display for Trouble {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (count, one, many) = match *self {
            Self::Empty => return f.write_str("there are no facets"),
            Self::NotNumbers(n) => (n, "corner is not a number", "corners are not numbers"),
            Self::ZeroArea(n) => (n, "facet has no area", "facets have no area"),
            Self::Open(n) => (n, "edge is open", "edges are open"),
            Self::Branching(n) => (n, "edge joins more than two facets", "edges join more than two facets"),
            Self::Flipped(n) => (n, "facet is flipped", "facets are flipped"),
            Self::Crossing(n) => (n, "edge pierces another facet", "edges pierce other facets"),
            Self::Inverted(n) => (n, "shell is turned inside out", "shells are turned inside out"),
        };
        write!(f, "{count} {}", if count == 1 { one } else { many })
    }
}

/// A body bounded by triangles.
#[derive(Debug, Clone, PartialEq)]
pub struct ClosedMesh {
    mesh: Mesh,
    facets: Vec<Facet>,
    tree: Tree,
    turned: bool,
}

/// A facet as distances need it.
#[derive(Debug, Clone, PartialEq)]
struct Facet {
    corners: [DVec3; 3],
    normal: DVec3,
    /// Pseudo-normals, of any length: of the edge after each corner, and of each corner.
    edges: [DVec3; 3],
    vertices: [DVec3; 3],
}

impl ClosedMesh {
    /// The body that a mesh bounds. A mesh that is right but for being inside out as a whole is turned.
    ///
    /// # Errors
    /// What is wrong with the mesh; of several things the first that is in the way of judging the others.
    pub fn new(mut mesh: Mesh) -> Result<Self, Defect> {
        let turned = diagnose(&mesh)?;
        if turned {
            mesh.triangles.iter_mut().for_each(|corners| corners.swap(1, 2));
        }
        Ok(Self::build(mesh, turned))
    }

    fn build(mesh: Mesh, turned: bool) -> Self {
        let corners = corners(&mesh);
        let normals: Vec<DVec3> = corners.iter().map(|&[a, b, c]| (b - a).cross(c - a).normalize()).collect();
        let mut vertices = vec![DVec3::ZERO; mesh.positions.len()];
        let mut edges: HashMap<[u32; 2], DVec3> = HashMap::new();
        for ((triangle, corners), &normal) in mesh.triangles.iter().zip(&corners).zip(&normals) {
            for k in 0..3 {
                let (next, last) = (corners[(k + 1) % 3] - corners[k], corners[(k + 2) % 3] - corners[k]);
                let angle = next.cross(last).length().atan2(next.dot(last));
                vertices[triangle[k] as usize] += angle * normal;
                *edges.entry(edge(triangle, k)).or_default() += normal;
            }
        }
        let facet = |((triangle, &corners), &normal): ((&[u32; 3], &[DVec3; 3]), &DVec3)| Facet {
            corners,
            normal,
            edges: [0, 1, 2].map(|k| edges.get(&edge(triangle, k)).copied().unwrap_or(normal)),
            vertices: triangle.map(|vertex| vertices[vertex as usize]),
        };
        let facets = mesh.triangles.iter().zip(&corners).zip(&normals).map(facet).collect();
        Self { tree: Tree::new(&corners), facets, mesh, turned }
    }

    /// The same body, turned about the origin by `rotation` and then moved by `offset` in m.
    #[must_use]
    pub fn moved(&self, rotation: DMat3, offset: DVec3) -> Self {
        let mut mesh = self.mesh.clone();
        mesh.positions.iter_mut().for_each(|p| *p = (rotation * DVec3::from(*p) + offset).into());
        Self::build(mesh, self.turned)
    }

    /// Its surface; facets are turned outwards.
    pub fn mesh(&self) -> &Mesh {
        &self.mesh
    }

    /// Whether the mesh it was made from was inside out.
    pub fn turned(&self) -> bool {
        self.turned
    }

    /// Smallest axis-parallel box around it, as its two corners.
    pub fn bounds(&self) -> (DVec3, DVec3) {
        self.tree.bounds()
    }

    /// Signed distance in m from `p` to the surface, negative inside, and its gradient: the unit normal of the surface at its nearest
    /// point, outwards.
    pub fn nearest(&self, p: DVec3) -> (f64, DVec3) {
        let found = self.tree.nearest(p, |n| {
            let (point, feature) = nearest_of_triangle(&self.facets[n].corners, p);
            (p.distance_squared(point), (n, point, feature))
        });
        let Some((square, (n, point, feature))) = found else { return (f64::INFINITY, DVec3::Z) };
        let facet = &self.facets[n];
        let outward = match feature {
            Feature::Inside => facet.normal,
            Feature::Edge(k) => facet.edges[k],
            Feature::Vertex(k) => facet.vertices[k],
        };
        let away = p - point;
        let sign = if away.dot(outward) < 0.0 { -1.0 } else { 1.0 };
        // On the surface itself what points away from it is rounding.
        let extent = facet.corners.iter().fold(p.abs(), |extent, corner| extent.max(corner.abs()));
        let normal = if square.sqrt() > ROUNDING * extent.max_element() { sign * away } else { outward };
        (sign * square.sqrt(), normal.normalize())
    }

    /// Where walls are thinner than `thickness` in m: number of facets that have another side so near behind their centre, and
    /// the first place. Sides that meet at an edge of less than 25 degrees count too.
    pub fn thin(&self, thickness: f64) -> Option<(usize, DVec3)> {
        let mut found: Option<(usize, DVec3)> = None;
        for facet in &self.facets {
            let start = facet.corners.iter().sum::<DVec3>() / 3.0;
            let end = start - thickness * facet.normal;
            let mut thin = false;
            self.tree.within(start.min(end), start.max(end), &mut |n| {
                let other = &self.facets[n];
                let facing = facet.normal.dot(other.normal) < FACING;
                thin |= facing && pierces(start, end, &other.corners).is_some();
            });
            if thin {
                found = Some(found.map_or((1, start), |(count, first)| (count + 1, first)));
            }
        }
        found
    }
}

/// What is nearest to a point on a triangle.
#[derive(Debug, Clone, Copy)]
enum Feature {
    Inside,
    /// The edge that begins at this corner.
    Edge(usize),
    Vertex(usize),
}

/// The point of a triangle that is nearest to `p` (Ericson 2005, 5.1.5): by the region of its plane, or its edge, in which `p` projects.
fn nearest_of_triangle(&[a, b, c]: &[DVec3; 3], p: DVec3) -> (DVec3, Feature) {
    let (ab, ac) = (b - a, c - a);
    let (d1, d2) = (ab.dot(p - a), ac.dot(p - a));
    if d1 <= 0.0 && d2 <= 0.0 {
        return (a, Feature::Vertex(0));
    }
    let (d3, d4) = (ab.dot(p - b), ac.dot(p - b));
    if d3 >= 0.0 && d4 <= d3 {
        return (b, Feature::Vertex(1));
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        return (a + ab * (d1 / (d1 - d3)), Feature::Edge(0));
    }
    let (d5, d6) = (ab.dot(p - c), ac.dot(p - c));
    if d6 >= 0.0 && d5 <= d6 {
        return (c, Feature::Vertex(2));
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        return (a + ac * (d2 / (d2 - d6)), Feature::Edge(2));
    }
    let va = d3 * d6 - d5 * d4;
    if va <= 0.0 && d4 >= d3 && d5 >= d6 {
        return (b + (c - b) * ((d4 - d3) / ((d4 - d3) + (d5 - d6))), Feature::Edge(1));
    }
    let sum = va + vb + vc;
    (a + ab * (vb / sum) + ac * (vc / sum), Feature::Inside)
}

/// Where the line from `p` to `q` meets a triangle, unless it lies in its plane.
fn pierces(p: DVec3, q: DVec3, &[a, b, c]: &[DVec3; 3]) -> Option<DVec3> {
    let normal = (b - a).cross(c - a);
    let (from, to) = (normal.dot(p - a), normal.dot(q - a));
    if from * to > 0.0 || from == to {
        return None;
    }
    let x = p + (q - p) * (from / (from - to));
    let area = |u: DVec3, v: DVec3| normal.dot((v - u).cross(x - u)) / normal.length_squared();
    (area(a, b).min(area(b, c)).min(area(c, a)) > -TOUCH).then_some(x)
}

/// An edge of a triangle, the one after corner `k`, whichever way it is run along.
fn edge(triangle: &[u32; 3], k: usize) -> [u32; 2] {
    let (a, b) = (triangle[k], triangle[(k + 1) % 3]);
    [a.min(b), a.max(b)]
}

fn corners(mesh: &Mesh) -> Vec<[DVec3; 3]> {
    mesh.triangles.iter().map(|t| t.map(|n| DVec3::from(mesh.positions[n as usize]))).collect()
}

/// Whether the mesh is inside out as a whole; or what else is wrong with it.
fn diagnose(mesh: &Mesh) -> Result<bool, Defect> {
    let corners = corners(mesh);
    if corners.is_empty() {
        return Err(Defect { what: Trouble::Empty, place: DVec3::ZERO });
    }
    let wrong = corners.iter().flatten().filter(|corner| !corner.is_finite());
    first(wrong.map(|_| DVec3::ZERO), Trouble::NotNumbers)?;
    let flat = |&&[a, b, c]: &&[DVec3; 3]| {
        let longest = (b - a).length_squared().max((c - b).length_squared()).max((a - c).length_squared());
        (b - a).cross(c - a).length() <= FLAT * longest
    };
    first(corners.iter().filter(flat).map(centre), Trouble::ZeroArea)?;
    let shells = Shells::of(mesh, &corners)?;
    crossings(mesh, &corners)?;
    shells.inside_out(&corners)
}

fn centre(corners: &[DVec3; 3]) -> DVec3 {
    corners.iter().sum::<DVec3>() / 3.0
}

/// A defect if there are any places of it.
fn first(mut places: impl Iterator<Item = DVec3>, what: impl Fn(usize) -> Trouble) -> Result<(), Defect> {
    match places.next() {
        Some(place) => Err(Defect { what: what(1 + places.count()), place }),
        None => Ok(()),
    }
}

/// No edge pierces a facet of which it has no corner.
fn crossings(mesh: &Mesh, corners: &[[DVec3; 3]]) -> Result<(), Defect> {
    let tree = Tree::new(corners);
    let mut places = Vec::new();
    for (triangle, points) in mesh.triangles.iter().zip(corners) {
        for k in 0..3 {
            // Each edge is run along in both directions: one of them will do.
            let ends = [triangle[k], triangle[(k + 1) % 3]];
            if ends[0] > ends[1] {
                continue;
            }
            let (p, q) = (points[k], points[(k + 1) % 3]);
            let mut found = None;
            tree.within(p.min(q), p.max(q), &mut |n| {
                if found.is_none() && !mesh.triangles[n].iter().any(|corner| ends.contains(corner)) {
                    found = pierces(p, q, &corners[n]);
                }
            });
            places.extend(found);
        }
    }
    first(places.into_iter(), Trouble::Crossing)
}

/// The connected parts of a mesh.
struct Shells(Vec<Vec<usize>>);

impl Shells {
    /// Walks from facet to facet over their edges, each of which must have two, and sees which ones are turned the other way.
    fn of(mesh: &Mesh, corners: &[[DVec3; 3]]) -> Result<Self, Defect> {
        let mut sides: HashMap<[u32; 2], Vec<usize>> = HashMap::new();
        for (n, triangle) in mesh.triangles.iter().enumerate() {
            (0..3).for_each(|k| sides.entry(edge(triangle, k)).or_default().push(n));
        }
        let mut open = Vec::new();
        let mut branching = Vec::new();
        for (n, triangle) in mesh.triangles.iter().enumerate() {
            for k in 0..3 {
                let around = &sides[&edge(triangle, k)];
                // Told once, by the first facet.
                if around.len() != 2 && around[0] == n {
                    let middle = 0.5 * (corners[n][k] + corners[n][(k + 1) % 3]);
                    if around.len() == 1 { &mut open } else { &mut branching }.push(middle);
                }
            }
        }
        first(branching.into_iter(), Trouble::Branching)?;
        first(open.into_iter(), Trouble::Open)?;

        let forwards = |n: usize, edge: [u32; 2]| {
            (0..3).any(|k| [mesh.triangles[n][k], mesh.triangles[n][(k + 1) % 3]] == edge)
        };
        let mut against: Vec<Option<bool>> = vec![None; corners.len()];
        let (mut shells, mut flipped) = (Vec::new(), Vec::new());
        for start in 0..corners.len() {
            if against[start].is_some() {
                continue;
            }
            against[start] = Some(false);
            let mut shell = vec![start];
            let mut next = 0;
            while let Some(&n) = shell.get(next) {
                next += 1;
                for k in 0..3 {
                    let edge = edge(&mesh.triangles[n], k);
                    for &other in sides[&edge].iter().filter(|&&other| other != n) {
                        let same = forwards(n, edge) != forwards(other, edge);
                        if against[other].is_none() {
                            against[other] = against[n].map(|against| against == same);
                            shell.push(other);
                        } else if (against[other] == against[n]) != same {
                            // Reached on two ways that contradict each other: the surface has one side only.
                            return Err(Defect { what: Trouble::Flipped(1), place: centre(&corners[other]) });
                        }
                    }
                }
            }
            let turned = shell.iter().filter(|&&n| against[n] == Some(true)).count();
            let fewer = Some(2 * turned <= shell.len());
            if turned > 0 {
                flipped.extend(shell.iter().filter(|&&n| against[n] == fewer).map(|&n| centre(&corners[n])));
            }
            shells.push(shell);
        }
        first(flipped.into_iter(), Trouble::Flipped)?;
        Ok(Self(shells))
    }

    /// Whether all shells are turned inside out; a defect if only some are. A shell is right if it encloses a positive volume and
    /// lies in none or an even number of others, or a negative volume in an odd number.
    fn inside_out(&self, corners: &[[DVec3; 3]]) -> Result<bool, Defect> {
        let volumes = self.0.iter().map(|shell| shell.iter().map(|&n| volume(&corners[n])).sum::<f64>());
        let boxes = self.0.iter().map(|shell| {
            let points = shell.iter().flat_map(|&n| corners[n]);
            points.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(min, max), p| (min.min(p), max.max(p)))
        });
        let boxes: Vec<(DVec3, DVec3)> = boxes.collect();
        let mut wrong = Vec::new();
        for (k, volume) in volumes.enumerate() {
            let p = corners[self.0[k][0]][0];
            let around = |&m: &usize| {
                let (min, max) = boxes[m];
                let near = m != k && p.cmpge(min).all() && p.cmple(max).all();
                near && self.0[m].iter().map(|&n| solid_angle(&corners[n], p)).sum::<f64>().abs() > 2.0 * PI
            };
            let hollow = (0..self.0.len()).filter(around).count() % 2 == 1;
            if (volume < 0.0) != hollow {
                wrong.push(p);
            }
        }
        if wrong.len() == self.0.len() {
            return Ok(true);
        }
        first(wrong.into_iter(), Trouble::Inverted).map(|()| false)
    }
}

/// Volume in m3 between a facet and the origin, positive if it faces away from there (divergence theorem).
fn volume(&[a, b, c]: &[DVec3; 3]) -> f64 {
    a.dot(b.cross(c)) / 6.0
}

/// Solid angle under which a facet is seen from `p` (van Oosterom and Strackee 1983); its sum over a closed shell is 4 pi within it.
fn solid_angle(corners: &[DVec3; 3], p: DVec3) -> f64 {
    let [a, b, c] = corners.map(|corner| corner - p);
    let [la, lb, lc] = [a, b, c].map(DVec3::length);
    2.0 * a.dot(b.cross(c)).atan2(la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Body, Shape};

    /// The faces of a box, each cut in two.
    fn box_mesh(min: DVec3, max: DVec3) -> Vec<[[f64; 3]; 3]> {
        let corner = |n: usize| [0, 1, 2].map(|axis| if n >> axis & 1 == 1 { max[axis] } else { min[axis] });
        let faces = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
        let halves = faces.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]);
        halves.map(|half| half.map(corner)).collect()
    }

    fn unit_box() -> Vec<[[f64; 3]; 3]> {
        box_mesh(DVec3::ZERO, DVec3::ONE)
    }

    /// An octahedron whose facets are cut in four `times` times and pushed out to the sphere.
    fn sphere_mesh(radius: f64, times: usize) -> Vec<[[f64; 3]; 3]> {
        let mut facets = Vec::new();
        for n in 0..8 {
            let sign = |axis: usize| if n >> axis & 1 == 1 { -1.0 } else { 1.0 };
            let [a, b, c] = [0, 1, 2].map(|axis| sign(axis) * DVec3::AXES[axis]);
            facets.push(if sign(0) * sign(1) * sign(2) > 0.0 { [a, b, c] } else { [a, c, b] });
        }
        for _ in 0..times {
            let quarters = facets.iter().flat_map(|&[a, b, c]| {
                let [d, e, f] = [(a + b).normalize(), (b + c).normalize(), (c + a).normalize()];
                [[a, d, f], [d, b, e], [f, e, c], [d, e, f]]
            });
            facets = quarters.collect();
        }
        facets.iter().map(|corners| corners.map(|p| (radius * p).to_array())).collect()
    }

    /// A frustum with an upright axis and `sides` flat sides, its corners on the cone.
    fn cone_mesh(base: f64, top: f64, height: f64, sides: usize) -> Vec<[[f64; 3]; 3]> {
        let at = |radius: f64, n: usize, z: f64| {
            let angle = 2.0 * PI * (n % sides) as f64 / sides as f64;
            [radius * angle.cos(), radius * angle.sin(), z]
        };
        let side = |n: usize| {
            let low = [at(base, n, 0.0), at(base, n + 1, 0.0)];
            let high = [at(top, n, height), at(top, n + 1, height)];
            [
                [low[0], low[1], high[1]],
                [low[0], high[1], high[0]],
                [[0.0, 0.0, 0.0], low[1], low[0]],
                [[0.0, 0.0, height], high[0], high[1]],
            ]
        };
        (0..sides).flat_map(side).collect()
    }

    fn closed(triangles: Vec<[[f64; 3]; 3]>) -> ClosedMesh {
        ClosedMesh::new(Mesh::weld(triangles)).unwrap_or_else(|defect| panic!("{defect}"))
    }

    fn defect(triangles: Vec<[[f64; 3]; 3]>) -> Defect {
        ClosedMesh::new(Mesh::weld(triangles)).unwrap_err()
    }

    /// Points in and around the box between -1.5 and 1.5, none of them anywhere special.
    fn points() -> impl Iterator<Item = DVec3> {
        let part = |n: u32, root: f64| 3.0 * (f64::from(n) * root).fract() - 1.5;
        // Shares of irrational numbers fill space evenly.
        (1..2000).map(move |n| DVec3::new(part(n, 0.819_172_5), part(n, 0.671_043_6), part(n, 0.549_700_5)))
    }

    /// Largest difference of distances between a mesh and a shape.
    fn error(mesh: &ClosedMesh, shape: Shape) -> f64 {
        points().map(|p| (mesh.nearest(p).0 - shape.signed_distance(p)).abs()).fold(0.0, f64::max)
    }

    #[test]
    fn a_box_of_facets_is_the_box() {
        let (min, max) = (DVec3::new(-0.7, -0.4, -1.1), DVec3::new(0.9, 0.3, 0.2));
        let (mesh, exact) = (closed(box_mesh(min, max)), Shape::Box { min, max });
        assert!(error(&mesh, exact) < 1e-15);
        assert_eq!(mesh.bounds(), (min, max));
        assert!((mesh.mesh().volume() - (max - min).element_product()).abs() < 1e-15);
        for p in points() {
            let (distance, normal) = mesh.nearest(p);
            // On the ridges inside, where two faces are equally near, either normal is right.
            let ridge = (min - p).max(p - max).to_array();
            let second = ridge.iter().filter(|&&d| (d - distance).abs() < 1e-9).count() > 1;
            let difference = (normal - exact.nearest(p).1).length();
            assert!(second || difference < 1e-9, "{p}: {normal}");
        }
    }

    /// So near to a surface, what points to its nearest point is rounding. (Walls of a form from half-way links had normals along them.)
    #[test]
    fn on_its_surface_a_mesh_has_the_normal_of_the_facet() {
        let (min, max) = (DVec3::new(-0.7, -0.4, -1.1), DVec3::new(0.9, 0.3, 0.2));
        let rotation = DMat3::from_rotation_z(0.3) * DMat3::from_rotation_y(1.1);
        let boxes = [DMat3::IDENTITY, rotation].map(|r| (r, closed(box_mesh(min, max)).moved(r, DVec3::ONE)));
        for p in points() {
            let inside = min + (max - min) * (0.05 + 0.3 * (p + 1.5));
            for (rotation, mesh) in &boxes {
                for axis in 0..3 {
                    for (side, sign) in [(min, -1.0), (max, 1.0)] {
                        let mut on = inside;
                        on[axis] = side[axis];
                        let (distance, normal) = mesh.nearest(*rotation * on + DVec3::ONE);
                        let exact = *rotation * (sign * DVec3::AXES[axis]);
                        assert!(distance.abs() < 1e-14 && (normal - exact).length() < 1e-9, "{on}: {normal}");
                    }
                }
            }
        }
    }

    #[test]
    fn distances_from_a_sphere_of_facets_converge_with_the_square_of_their_size() {
        let exact = Shape::Sphere { centre: DVec3::ZERO, radius: 1.0 };
        let errors = [2, 3, 4, 5].map(|times| error(&closed(sphere_mesh(1.0, times)), exact));
        for pair in errors.windows(2) {
            assert!((3.0..5.0).contains(&(pair[0] / pair[1])), "{errors:?}");
        }
        assert!(errors[3] < 2e-3, "{errors:?}");
        let volume = closed(sphere_mesh(1.0, 5)).mesh().volume();
        assert!((volume / (4.0 / 3.0 * PI) - 1.0).abs() < 3e-3, "{volume}");
    }

    #[test]
    fn a_cone_of_facets_is_off_by_no_more_than_its_sides_are() {
        let (sides, height) = (96, 1.2);
        let mesh = closed(cone_mesh(0.8, 0.4, height, sides));
        let exact = Shape::Cone { base: DVec3::ZERO, base_radius: 0.8, top_radius: 0.4, height };
        // The sagitta of a chord of the larger circle.
        let sagitta = 0.8 * (1.0 - (PI / sides as f64).cos());
        assert!(error(&mesh, exact) < 1.001 * sagitta, "{} {sagitta}", error(&mesh, exact));
        // Areas of the polygons in the circles are short by the same share at all heights.
        let share = (2.0 * PI / sides as f64).sin() / (2.0 * PI / sides as f64);
        let frustum = PI * height / 3.0 * (0.64 + 0.32 + 0.16);
        assert!((mesh.mesh().volume() / (share * frustum) - 1.0).abs() < 1e-12);
    }

    #[test]
    fn distances_turn_and_move_with_the_body() {
        let mesh = closed(cone_mesh(0.8, 0.0, 1.2, 7).into_iter().filter(|t| t[1] != t[2]).collect());
        let rotation =
            DMat3::from_rotation_z(0.3) * DMat3::from_rotation_y(1.1) * DMat3::from_rotation_x(-2.0);
        let offset = DVec3::new(0.2, -0.7, 3.0);
        let moved = mesh.moved(rotation, offset);
        for p in points() {
            let (distance, normal) = mesh.nearest(p);
            let (again, turned) = moved.nearest(rotation * p + offset);
            assert!((distance - again).abs() < 1e-14, "{p}");
            assert!((rotation * normal - turned).length() < 1e-6, "{p}: {normal} {turned}");
        }
    }

    #[test]
    fn a_form_is_what_lies_outside_its_inside() {
        let cavity = Body::Mesh(closed(unit_box()).into());
        let form = Body::Complement(Box::new(cavity));
        assert_eq!(form.nearest(DVec3::new(0.5, 0.5, 0.25)), (0.25, DVec3::Z));
        assert_eq!(form.signed_distance(DVec3::new(0.5, 0.5, -0.25)), -0.25);
        assert_eq!(form.bounds(), (DVec3::NEG_INFINITY, DVec3::INFINITY));
    }

    #[test]
    fn what_is_wrong_with_a_mesh_is_counted_and_located() {
        let told = |triangles| {
            let Defect { what, place } = defect(triangles);
            (what, place)
        };
        // Facet 0 lies in the plane x = 0.
        let hole = unit_box()[1..].to_vec();
        assert_eq!(told(hole).0, Trouble::Open(3));
        let mut flipped = unit_box();
        flipped[3].swap(0, 1);
        assert_eq!(told(flipped), (Trouble::Flipped(1), DVec3::new(1.0, 1.0 / 3.0, 2.0 / 3.0)));
        let mut crossing = unit_box();
        crossing.extend(box_mesh(DVec3::splat(0.5), DVec3::splat(1.5)));
        let (what, place) = told(crossing);
        // Three edges of each box, and those of their diagonals that pass.
        assert!(matches!(what, Trouble::Crossing(6..)), "{what:?}");
        assert!(place.cmpge(DVec3::splat(0.5)).all() && place.cmple(DVec3::ONE).all(), "{place}");
        let mut flat = unit_box();
        flat.push([[0.5, 0.5, 0.0], [0.25, 0.25, 0.0], [0.0, 0.0, 0.0]]);
        assert_eq!(told(flat), (Trouble::ZeroArea(1), DVec3::new(0.25, 0.25, 0.0)));
        // Boxes that stand on each other.
        let mut doubled = unit_box();
        doubled.extend(box_mesh(DVec3::Z, DVec3::new(1.0, 1.0, 2.0)));
        assert!(matches!(told(doubled).0, Trouble::Branching(4..)));
        let mut stacked = unit_box();
        stacked.extend(box_mesh(DVec3::new(0.25, 0.25, 1.0), DVec3::new(0.5, 0.75, 2.0)));
        assert!(matches!(told(stacked).0, Trouble::Crossing(_)));
        assert_eq!(told(Vec::new()).0, Trouble::Empty);
        let mut no_number = unit_box();
        no_number[2][0][1] = f64::NAN;
        assert_eq!(told(no_number).0, Trouble::NotNumbers(1));
        let message = defect(unit_box()[1..].to_vec()).to_string();
        assert!(message.starts_with("3 edges are open, the first at "), "{message}");
    }

    fn inside_out(mut triangles: Vec<[[f64; 3]; 3]>) -> Vec<[[f64; 3]; 3]> {
        triangles.iter_mut().for_each(|corners| corners.swap(0, 1));
        triangles
    }

    #[test]
    fn a_mesh_that_is_inside_out_is_turned_and_hollows_are_kept() {
        let turned = closed(inside_out(unit_box()));
        assert!(turned.turned() && !closed(unit_box()).turned());
        assert_eq!(turned.nearest(DVec3::new(0.5, 0.5, 0.25)), (-0.25, DVec3::NEG_Z));
        let inner = || box_mesh(DVec3::splat(0.25), DVec3::splat(0.75));
        let hollow = closed([unit_box(), inside_out(inner())].concat());
        assert!(!hollow.turned() && (hollow.mesh().volume() - 0.875).abs() < 1e-15);
        assert_eq!(hollow.nearest(DVec3::new(0.5, 0.5, 0.375)).0, 0.125);
        assert!(closed([inside_out(unit_box()), inner()].concat()).turned());
        // A body within a body: one of them must be meant otherwise.
        let within = defect([unit_box(), inner()].concat());
        assert_eq!((within.what, within.place), (Trouble::Inverted(1), DVec3::splat(0.25)));
    }

    #[test]
    fn walls_are_thin_but_edges_are_not() {
        let plate = closed(box_mesh(DVec3::ZERO, DVec3::new(1.0, 1.0, 0.01)));
        assert_eq!(plate.thin(0.0099), None);
        assert_eq!(plate.thin(0.011).map(|(count, _)| count), Some(4));
        let place = plate.thin(0.011).unwrap().1;
        assert!(place.z == 0.0 || place.z == 0.01, "{place}");
        assert_eq!(closed(sphere_mesh(1.0, 4)).thin(0.1), None);
        assert_eq!(closed(cone_mesh(0.8, 0.4, 1.2, 24)).thin(0.1), None);
    }
}
