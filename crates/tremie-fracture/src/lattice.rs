//! Rigid cells and the springs between them.
//!
//! A cell moves as a rigid body (u, theta) about its node. At a facet the jump at the centroid c and the relative rotation are
//! Delta = u_j + theta_j x r_j - u_i - theta_i x r_i and phi = theta_j - theta_i, r = c - x. Springs of the stiffness E/h for each area, spread
//! over the facet, make the forces E A/h Delta and the moments (E/h)(tr S 1 - S) phi, S being the second moments of area; these are the
//! six springs of the rigid-body-spring network (Kawai 1978; Bolander and Saito 1998) without their principal axes. Any uniform strain is exact, with Poisson's
//! ratio zero.

use rayon::prelude::*;
use tremie_numerics::{DMat3, DVec3};

use crate::mesh::{Facet, Mesh};
use crate::sparse::{Element, Factor, Functional, Singular, UNKNOWNS};

/// A spring between two cells.
#[derive(Debug, Clone)]
pub(crate) struct Spring {
    pub(crate) cells: [usize; 2],
    /// Where its jump is taken, in m.
    pub(crate) at: DVec3,
    /// Forces in N and moments in N m for a jump in m and a rotation.
    pub(crate) stiffness: [[f64; 6]; 6],
}

/// Cells, springs and supports.
pub struct Lattice {
    /// Nodes of the cells in m.
    pub(crate) nodes: Vec<DVec3>,
    pub(crate) springs: Vec<Spring>,
    /// Unknowns that are zero.
    pub(crate) fixed: Vec<[bool; UNKNOWNS]>,
}

/// The stiffness of a facet for a modulus of elasticity in Pa.
pub(crate) fn elastic(facet: &Facet, modulus: f64) -> [[f64; 6]; 6] {
    let mut stiffness = [[0.0; 6]; 6];
    let moments = &facet.moments;
    let rotation =
        DMat3::from_diagonal(DVec3::splat(moments.x_axis.x + moments.y_axis.y + moments.z_axis.z)) - *moments;
    for k in 0..3 {
        stiffness[k][k] = modulus * facet.area / facet.length;
        for l in 0..3 {
            stiffness[3 + k][3 + l] = modulus / facet.length * rotation.col(l)[k];
        }
    }
    stiffness
}

/// How a force at a point, off the place where the jump is taken, acts on jump and rotation.
pub(crate) fn lever(direction: DVec3, off: DVec3) -> [f64; 6] {
    let moment = off.cross(direction);
    [direction.x, direction.y, direction.z, moment.x, moment.y, moment.z]
}

impl Lattice {
    /// The cells of a mesh, and the springs of all facets between them, for a modulus of elasticity in Pa.
    pub fn of(mesh: &Mesh, modulus: f64) -> Self {
        Self::new(mesh.nodes.clone(), mesh.facets.iter().chain(&mesh.plane), modulus)
    }

    /// Cells at nodes in m, and the springs of the facets between them, for a modulus of elasticity in Pa.
    pub fn new<'a>(nodes: Vec<DVec3>, facets: impl Iterator<Item = &'a Facet>, modulus: f64) -> Self {
        let springs = facets.filter_map(|facet| {
            let cells = [facet.cell, facet.other?];
            Some(Spring { cells, at: facet.centroid, stiffness: elastic(facet, modulus) })
        });
        Self { springs: springs.collect(), fixed: vec![[false; 6]; nodes.len()], nodes }
    }

    /// Glues a rigid plate to the facets of a side; its number among the cells. The springs are those of the material between node and side.
    pub(crate) fn plate(&mut self, facets: &[Facet], modulus: f64) -> usize {
        let plate = self.nodes.len();
        let area: f64 = facets.iter().map(|facet| facet.area).sum();
        self.nodes.push(facets.iter().map(|facet| facet.centroid * facet.area).sum::<DVec3>() / area);
        self.fixed.push([false; 6]);
        self.springs.extend(facets.iter().map(|facet| Spring {
            cells: [facet.cell, plate],
            at: facet.centroid,
            stiffness: elastic(facet, modulus),
        }));
        plate
    }

    /// The weights of a cell's unknowns in the displacement of a point along a direction.
    pub(crate) fn displacement(&self, cell: usize, point: DVec3, direction: DVec3) -> [f64; UNKNOWNS] {
        lever(direction, point - self.nodes[cell])
    }

    /// The matrices of the springs.
    pub(crate) fn elements(&self) -> Vec<Element> {
        self.springs.par_iter().map(|spring| self.element(spring)).collect()
    }

    /// The factorised stiffness matrix.
    pub(crate) fn factor(&self) -> Result<Factor, Singular> {
        Factor::new(&self.nodes, &self.elements(), self.fixed.clone(), &[], &[])
    }

    fn element(&self, spring: &Spring) -> Element {
        // Jump and rotation for each of the twelve unknowns.
        let mut jumps = [[0.0; 6]; 12];
        for (end, sign) in [(0, -1.0), (1, 1.0)] {
            let off = spring.at - self.nodes[spring.cells[end]];
            for axis in 0..3 {
                let unit = [DVec3::X, DVec3::Y, DVec3::Z][axis];
                jumps[6 * end + axis][axis] = sign;
                let turned = unit.cross(off);
                for k in 0..3 {
                    jumps[6 * end + 3 + axis][k] = sign * turned[k];
                }
                jumps[6 * end + 3 + axis][3 + axis] = sign;
            }
        }
        let mut matrix = [[0.0; 12]; 12];
        for (row, a) in jumps.iter().enumerate() {
            let forces: [f64; 6] =
                std::array::from_fn(|l| (0..6).map(|k| a[k] * spring.stiffness[k][l]).sum());
            for (column, b) in jumps.iter().enumerate() {
                matrix[row][column] = forces.iter().zip(b).map(|(f, b)| f * b).sum();
            }
        }
        Element { nodes: spring.cells, matrix }
    }

    /// The forces that hold the cells where some of their unknowns have given values in m and rad, in N and N m: six for each cell.
    ///
    /// # Errors
    /// If something can still move without a force.
    pub fn reactions(&self, given: &[[Option<f64>; UNKNOWNS]]) -> Result<Vec<f64>, Singular> {
        let moved: Vec<f64> = given.iter().flatten().map(|value| value.unwrap_or(0.0)).collect();
        let fixed = given.iter().map(|values| values.map(|value| value.is_some())).collect();
        let factor = Factor::new(&self.nodes, &self.elements(), fixed, &[], &[])?;
        let loads: Vec<f64> = self.forces(&moved).iter().map(|force| -force).collect();
        let found = factor.solve(&loads);
        let all: Vec<f64> = moved.iter().zip(&found).map(|(a, b)| a + b).collect();
        Ok(self.forces(&all))
    }

    /// The forces that hold displacements: six numbers for each cell, in N and N m.
    pub fn forces(&self, displacements: &[f64]) -> Vec<f64> {
        let mut forces = vec![0.0; displacements.len()];
        for spring in &self.springs {
            let (jump, turn) = self.motion(spring, displacements);
            let motion = [jump.x, jump.y, jump.z, turn.x, turn.y, turn.z];
            let own: [f64; 6] =
                spring.stiffness.map(|row| row.iter().zip(&motion).map(|(k, m)| k * m).sum::<f64>());
            let (force, moment) = (DVec3::from_slice(&own[..3]), DVec3::from_slice(&own[3..]));
            for (cell, sign) in spring.cells.into_iter().zip([-1.0, 1.0]) {
                let moment = moment + (spring.at - self.nodes[cell]).cross(force);
                let to = &mut forces[UNKNOWNS * cell..][..UNKNOWNS];
                for (k, value) in force.to_array().into_iter().chain(moment.to_array()).enumerate() {
                    to[k] += sign * value;
                }
            }
        }
        forces
    }

    /// The jump of a spring at its place, and the relative rotation.
    pub(crate) fn motion(&self, spring: &Spring, displacements: &[f64]) -> (DVec3, DVec3) {
        let [(u, a), (v, b)] = spring.cells.map(|cell| {
            let own = &displacements[UNKNOWNS * cell..][..UNKNOWNS];
            let (shift, turn) = (DVec3::from_slice(&own[..3]), DVec3::from_slice(&own[3..]));
            (shift + turn.cross(spring.at - self.nodes[cell]), turn)
        });
        (v - u, b - a)
    }
}

/// The value of a functional.
pub(crate) fn value(functional: &Functional, displacements: &[f64]) -> f64 {
    functional
        .iter()
        .map(|(node, weights)| {
            let own = &displacements[UNKNOWNS * node..][..UNKNOWNS];
            weights.iter().zip(own).map(|(w, u)| w * u).sum::<f64>()
        })
        .sum()
}

/// A functional as a load: six numbers for each of `nodes`.
pub(crate) fn load(functional: &Functional, nodes: usize) -> Vec<f64> {
    let mut load = vec![0.0; UNKNOWNS * nodes];
    for (node, weights) in functional {
        for (k, weight) in weights.iter().enumerate() {
            load[UNKNOWNS * node + k] += weight;
        }
    }
    load
}

/// Several functionals, each with a factor, as one.
pub(crate) fn combined(parts: &[(f64, &Functional)]) -> Functional {
    parts
        .iter()
        .flat_map(|(factor, part)| {
            part.iter().map(move |(node, weights)| (*node, weights.map(|w| factor * w)))
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::nodes::Grading;
    use crate::sparse::Factor;

    fn prism() -> (Mesh, Lattice) {
        let grading = Grading { finest: 0.02, coarsest: 0.03 };
        let mesh = Mesh::new(DVec3::new(0.3, 0.1, 0.1), 0.15, grading, 5);
        let lattice = Lattice::of(&mesh, 30e9);
        (mesh, lattice)
    }

    #[test]
    fn uniform_strains_leave_cells_inside_in_balance() {
        let (mesh, lattice) = prism();
        let strain = DMat3::from_cols_array(&[1.0, 0.4, -0.3, 0.4, -0.7, 0.2, -0.3, 0.2, 0.5]) * 1e-4;
        let mut displacements = vec![0.0; 6 * mesh.nodes.len()];
        for (n, node) in mesh.nodes.iter().enumerate() {
            displacements[6 * n..6 * n + 3].copy_from_slice(&(strain * *node).to_array());
        }
        let mut forces = lattice.forces(&displacements);
        // On the sides the tractions E strain n hold the balance.
        for facet in mesh.sides.iter().flatten() {
            let traction = 30e9 * (strain * facet.normal) * facet.area;
            let pull = lever(traction, facet.centroid - mesh.nodes[facet.cell]);
            (0..6).for_each(|k| forces[6 * facet.cell + k] -= pull[k]);
        }
        let scale = 30e9 * 1e-4 * 0.02 * 0.02;
        let worst = forces.iter().fold(0.0_f64, |worst, f| worst.max(f.abs()));
        assert!(worst < 1e-12 * scale, "{:e}", worst / scale);
    }

    #[test]
    fn rigid_motions_cost_nothing_and_holding_one_cell_stops_them() {
        let (mesh, lattice) = prism();
        for (shift, turn) in
            [(DVec3::new(1.0, -2.0, 0.5), DVec3::ZERO), (DVec3::ZERO, DVec3::new(0.3, 1.0, -0.6))]
        {
            let mut motion = vec![0.0; 6 * mesh.nodes.len()];
            for (n, node) in mesh.nodes.iter().enumerate() {
                motion[6 * n..6 * n + 3].copy_from_slice(&(shift + turn.cross(*node)).to_array());
                motion[6 * n + 3..6 * n + 6].copy_from_slice(&turn.to_array());
            }
            let worst = lattice.forces(&motion).iter().fold(0.0_f64, |worst, f| worst.max(f.abs()));
            assert!(worst < 1e-12 * 30e9 * 0.02, "{worst:e}");
        }
        let mut given = vec![[None; 6]; mesh.nodes.len()];
        given[3] = [Some(0.0); 6];
        let turned = 40;
        given[turned][3] = Some(1e-3);
        let held = lattice.reactions(&given).unwrap();
        // What turns one cell is held at the other.
        let arm = mesh.nodes[turned] - mesh.nodes[3];
        let force = DVec3::from_slice(&held[18..21]);
        assert!(force.length() < 1e-6 * held[6 * turned + 3].abs() / arm.length());
        assert!((held[21] + held[6 * turned + 3]).abs() < 1e-9 * held[21].abs());
    }

    /// Eight nodes at the corners of a cube and one within, as in OOFEM's test `sm/lattice3d2.in` (E = 1), which tells the reaction at one of them.
    #[test]
    fn a_small_lattice_is_as_stiff_as_in_another_program() {
        let corner = |k: usize| DVec3::new((k & 1) as f64, (k >> 1 & 1) as f64, (k >> 2) as f64);
        let mut nodes: Vec<DVec3> = (0..8).map(|k| 0.7 * corner(k)).collect();
        nodes.push(DVec3::splat(0.35));
        let mut facets = Vec::new();
        for i in 0..8 {
            for axis in [0, 1, 2].into_iter().filter(|axis| i >> axis & 1 == 0) {
                // A square about the middle of the edge, its corners 0.175 away along the other axes.
                let middle = nodes[i] + 0.35 * DVec3::AXES[axis];
                let [u, v] = [DVec3::AXES[(axis + 1) % 3], DVec3::AXES[(axis + 2) % 3]];
                let square = [u, v, -u, -v].map(|way| middle + 0.175 * way);
                facets.push(Facet::between(&nodes, [i, i + (1 << axis)], square.to_vec()));
            }
            // A hexagon half-way to the middle, through corners of those squares.
            let inwards = (nodes[8] - nodes[i]) / 0.35;
            let at = |a: f64, b: f64, c: f64| nodes[i] + 0.175 * inwards * DVec3::new(a, b, c);
            let hexagon = [
                at(0., 1., 2.),
                at(1., 0., 2.),
                at(2., 0., 1.),
                at(2., 1., 0.),
                at(1., 2., 0.),
                at(0., 2., 1.),
            ];
            facets.push(Facet::between(&nodes, [i, 8], hexagon.to_vec()));
        }
        let lattice = Lattice::new(nodes, facets.iter(), 1.0);
        let mut given = vec![[None; 6]; 9];
        given[0] = [Some(0.0); 6];
        for k in 1..8 {
            given[k][0] = Some(1e-3 * (k & 1) as f64);
        }
        let reaction = lattice.reactions(&given).unwrap()[0];
        assert!((reaction / -2.2533e-4 - 1.0).abs() < 1e-4, "{reaction}");
    }

    #[test]
    fn the_factor_solves_and_knows_what_loads_do_to_each_other() {
        let (mesh, mut lattice) = prism();
        lattice.fixed[0] = [true; 6];
        let one: Functional = vec![(5, lever(DVec3::Z, DVec3::ZERO))];
        let other: Functional = vec![(17, lever(DVec3::X, DVec3::new(0.0, 0.01, 0.0))), (5, [0.0; 6])];
        let kept: Vec<usize> = mesh.plane.iter().map(|facet| facet.cell).collect();
        let all = [one.clone(), other.clone()];
        let factor =
            Factor::new(&lattice.nodes, &lattice.elements(), lattice.fixed.clone(), &kept, &all).unwrap();
        let load = load(&one, lattice.nodes.len());
        let u = factor.solve(&load);
        let mut residual = lattice.forces(&u);
        residual.iter_mut().zip(&load).for_each(|(r, f)| *r -= f);
        residual[..6].fill(0.0);
        let worst = residual.iter().fold(0.0_f64, |worst, f| worst.max(f.abs()));
        assert!(worst < 1e-9, "{worst:e}");
        for (k, functional) in all.iter().enumerate() {
            let direct = value(functional, &u);
            assert!((factor.compliance[k] - direct).abs() < 1e-10 * direct.abs(), "{k}");
        }
        let swapped = factor.compliance[2];
        assert!((swapped - factor.compliance[1]).abs() < 1e-12 * swapped.abs());
    }
}
