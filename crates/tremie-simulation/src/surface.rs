//! The free surface of the fluid as a mesh of triangles, with speed and pressure on it.
//!
//! The surface is where the fill, interpolated between the centres of the cells, is one half. It is closed towards the
//! air, and cut where the fluid meets a side of the domain (floor, wall or symmetry plane), so that a mirror image
//! joins without a seam. Lengths in m.

use tremie_geometry::isosurface::{Mesh, marching_cubes};
use tremie_numerics::DVec3;

use crate::Cells;

/// Fill at the surface.
const ISO: f64 = 0.5;

/// The free surface at one moment.
#[derive(Debug, Clone, PartialEq)]
pub struct Surface {
    /// Points in m and triangles, seen counterclockwise from the air.
    pub mesh: Mesh,
    /// Speed at each point in m/s.
    pub speed: Vec<f32>,
    /// Pressure above that of the air at each point in Pa.
    pub pressure: Vec<f32>,
}

impl Surface {
    /// Builds the surface around cells.
    pub fn new(cells: &Cells) -> Self {
        // One layer of values around the cells: air, or the cell's own value at a side of the domain.
        let points = cells.count.map(|n| n + 2);
        let mut values = Vec::with_capacity(points.iter().product());
        let inner = [0, 1, 2].map(|a| {
            let at_side = |s: usize| {
                let edge = cells.origin[a] + if s == 0 { 0.0 } else { cells.count[a] as f64 * cells.size };
                (cells.domain[s][a] - edge).abs() < 0.5 * cells.size
            };
            let (first, last) = (at_side(0), at_side(1));
            (0..points[a])
                .map(|i| match i {
                    _ if cells.count[a] == 0 => None,
                    0 => first.then_some(0),
                    i if i > cells.count[a] => last.then_some(cells.count[a] - 1),
                    i => Some(i - 1),
                })
                .collect::<Vec<_>>()
        });
        for k in &inner[2] {
            for j in &inner[1] {
                for i in &inner[0] {
                    values.push(match (i, j, k) {
                        (Some(i), Some(j), Some(k)) => cells.fill[cells.index(*i, *j, *k)] as f32,
                        _ => 0.0,
                    });
                }
            }
        }
        let origin = cells.origin - 0.5 * cells.size;
        let mut mesh = marching_cubes(&values, points, origin.to_array(), [cells.size; 3], ISO as f32);
        let mut speed = Vec::with_capacity(mesh.positions.len());
        let mut pressure = Vec::with_capacity(mesh.positions.len());
        for position in &mut mesh.positions {
            // The outermost layer of points lies half a cell beyond the domain.
            let point = DVec3::from(*position).clamp(cells.domain[0], cells.domain[1]);
            *position = point.to_array();
            let (v, p) = at(cells, point);
            speed.push(v as f32);
            pressure.push(p as f32);
        }
        Self { mesh, speed, pressure }
    }
}

/// Speed and pressure at a point, interpolated between the eight cells around it, each as much as it holds fluid.
fn at(cells: &Cells, point: DVec3) -> (f64, f64) {
    let place = (point - cells.origin) / cells.size - 0.5;
    let first = place.floor();
    let t = place - first;
    let (mut weights, mut velocity, mut pressure) = (0.0, DVec3::ZERO, 0.0);
    for corner in 0..8 {
        let (mut weight, mut index) = (1.0, [0usize; 3]);
        for a in 0..3 {
            let upper = (corner >> a) & 1 == 1;
            weight *= if upper { t[a] } else { 1.0 - t[a] };
            let i = first[a] as isize + isize::from(upper);
            index[a] = i.clamp(0, cells.count[a] as isize - 1) as usize;
        }
        let n = cells.index(index[0], index[1], index[2]);
        weight *= cells.fill[n];
        weights += weight;
        velocity += weight * cells.velocity[n];
        pressure += weight * cells.pressure[n];
    }
    if weights > 0.0 { ((velocity / weights).length(), pressure / weights) } else { (0.0, 0.0) }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A ball of radius 0.1 m around `centre`, in cells of 1 cm that fill a domain of (0.3 m)^3.
    fn ball(centre: DVec3) -> Cells {
        let count = [30; 3];
        let number = count.iter().product();
        let mut cells = Cells {
            size: 0.01,
            count,
            fill: vec![0.0; number],
            pressure: vec![0.0; number],
            velocity: vec![DVec3::ZERO; number],
            domain: [DVec3::ZERO, DVec3::splat(0.3)],
            ..Cells::default()
        };
        for k in 0..30 {
            for j in 0..30 {
                for i in 0..30 {
                    let n = cells.index(i, j, k);
                    let distance = cells.centre(i, j, k).distance(centre) - 0.1;
                    cells.fill[n] = (0.5 - distance / cells.size).clamp(0.0, 1.0);
                    if cells.fill[n] > 0.0 {
                        cells.velocity[n] = DVec3::new(0.0, 3.0, -4.0);
                        cells.pressure[n] = 70.0;
                    }
                }
            }
        }
        cells
    }

    #[test]
    fn a_ball_in_the_air_is_closed() {
        let surface = Surface::new(&ball(DVec3::splat(0.15)));
        let exact = 4.0 / 3.0 * std::f64::consts::PI * 1e-3;
        assert!((surface.mesh.volume() / exact - 1.0).abs() < 0.01);
        // Dry cells do not dilute what is shown on the surface.
        assert!(surface.speed.iter().all(|speed| (speed - 5.0).abs() < 1e-6));
        assert!(surface.pressure.iter().all(|pressure| (pressure - 70.0).abs() < 1e-4));
    }

    #[test]
    fn a_surface_meets_floor_and_symmetry_plane_and_is_cut_there() {
        let surface = Surface::new(&ball(DVec3::new(0.0, 0.15, 0.0)));
        // A quarter of the ball's area, and no cap on either plane.
        let exact = std::f64::consts::PI * 1e-2;
        assert!((surface.mesh.area() / exact - 1.0).abs() < 0.02, "{} {exact}", surface.mesh.area());
        for a in [0, 2] {
            let lowest = surface.mesh.positions.iter().map(|p| p[a]).fold(f64::INFINITY, f64::min);
            assert_eq!(lowest, 0.0);
        }
    }

    #[test]
    fn cells_within_the_domain_are_surrounded_by_air() {
        // A full box of cells, whose lower side alone is the domain's.
        let mut cells = ball(DVec3::splat(0.15));
        cells.fill.fill(1.0);
        cells.domain = [DVec3::new(-1.0, -1.0, 0.0), DVec3::ONE];
        let mesh = Surface::new(&cells).mesh;
        assert!((mesh.area() / (5.0 * 0.09) - 1.0).abs() < 0.03, "{}", mesh.area());
    }

    #[test]
    fn no_fluid_has_no_surface() {
        assert!(Surface::new(&Cells { size: 0.1, ..Cells::default() }).mesh.triangles.is_empty());
    }
}
