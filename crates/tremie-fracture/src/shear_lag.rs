//! Fibres before the matrix cracks: elastic shear lag (Cox 1952).
//!
//! At a distance s from its middle a fibre of length L takes psi = 1 - cosh(b s) / cosh(b L/2) of the force that it would take if it
//! stretched as the matrix does, b^2 = 2 G / (E_f r^2 ln(R/r)), R/r = sqrt(pi / (4 V_f)). Where it crosses a facet, between nodes h apart, it is a spring of the
//! stiffness (E_f - E) A_f psi |p.n| / h along its direction p; over all facets these add up to what the same fibres add to a uniform strain.

use std::collections::BTreeMap;
use std::f64::consts::PI;

use tremie_numerics::DVec3;

use crate::fibres::Fibre;
use crate::lattice::{Lattice, Spring, lever};

/// Elastic fibres in a matrix.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct ShearLag {
    /// Modulus of elasticity of the matrix in Pa.
    pub(crate) matrix: f64,
    /// The same of the fibres in Pa.
    pub(crate) fibre: f64,
    /// Share of fibres in the volume.
    pub(crate) share: f64,
}

impl ShearLag {
    /// How much of its full force a fibre takes at a part of its length.
    pub(crate) fn efficiency(&self, fibre: &Fibre, part: f64) -> f64 {
        let radius = 0.5 * fibre.diameter;
        let around = (PI / (4.0 * self.share)).sqrt().max(1.1).ln();
        // Poisson's ratio is zero: G = E/2.
        let rate = (self.matrix / (self.fibre * radius * radius * around)).sqrt();
        let (s, half) = ((part - 0.5).abs() * fibre.length(), 0.5 * fibre.length());
        // cosh(a)/cosh(b) without large numbers.
        let (a, b) = (rate * s, rate * half);
        1.0 - (a - b).exp() * (1.0 + (-2.0 * a).exp()) / (1.0 + (-2.0 * b).exp())
    }

    /// Force in N along a fibre for a jump of 1 m along it, across nodes that are `length` m apart along a normal.
    pub(crate) fn stiffness(&self, fibre: &Fibre, part: f64, normal: DVec3, length: f64) -> f64 {
        let way = (fibre.ends[1] - fibre.ends[0]).normalize();
        let gain = (self.fibre - self.matrix) * fibre.section() * self.efficiency(fibre, part);
        gain * way.dot(normal).abs() / length
    }

    /// Adds the springs of the fibres where they cross facets other than those between `images`, the pairs across the crack plane.
    pub(crate) fn stiffen(&self, lattice: &mut Lattice, fibres: &[Fibre], images: &BTreeMap<usize, usize>) {
        let around = around(&lattice.springs, lattice.nodes.len());
        for fibre in fibres {
            for (part, spring) in walk(fibre, &lattice.nodes, &around) {
                let [i, j] = lattice.springs[spring].cells;
                if images.get(&i) == Some(&j) || images.get(&j) == Some(&i) {
                    continue;
                }
                let way = lattice.nodes[j] - lattice.nodes[i];
                let stiffness = self.stiffness(fibre, part, way.normalize(), way.length());
                let [start, end] = fibre.ends;
                let off = start + part * (end - start) - lattice.springs[spring].at;
                let arm = lever((end - start).normalize(), off);
                for k in 0..6 {
                    for l in 0..6 {
                        lattice.springs[spring].stiffness[k][l] += stiffness * arm[k] * arm[l];
                    }
                }
            }
        }
    }
}

/// Of each cell, the others around it and the springs to them.
pub(crate) fn around(springs: &[Spring], cells: usize) -> Vec<Vec<(usize, usize)>> {
    let mut around = vec![Vec::new(); cells];
    for (n, spring) in springs.iter().enumerate() {
        let [i, j] = spring.cells;
        around[i].push((j, n));
        around[j].push((i, n));
    }
    around
}

/// Walks along a fibre from cell to cell: at which part of its length it crosses which spring's facet.
pub(crate) fn walk(fibre: &Fibre, nodes: &[DVec3], around: &[Vec<(usize, usize)>]) -> Vec<(f64, usize)> {
    let [start, end] = fibre.ends;
    let way = end - start;
    let nearest = |best: usize, n: usize| {
        if nodes[n].distance_squared(start) < nodes[best].distance_squared(start) { n } else { best }
    };
    let mut cell = (0..nodes.len()).fold(0, nearest);
    let mut crossed = Vec::new();
    loop {
        let leave = |&(other, spring): &(usize, usize)| {
            let normal = nodes[other] - nodes[cell];
            let speed = way.dot(normal);
            let part = (0.5 * (nodes[cell] + nodes[other]) - start).dot(normal) / speed;
            (speed > 0.0).then_some((part, spring, other))
        };
        let first = around[cell].iter().filter_map(leave).min_by(|a, b| a.0.total_cmp(&b.0));
        match first {
            // Through a corner a cell may be left where it is entered, but never to and fro: each step goes forward.
            Some((part, spring, other)) if part < 1.0 && crossed.len() <= nodes.len() => {
                crossed.push((part.max(0.0), spring));
                cell = other;
            }
            _ => return crossed,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::Mesh;
    use crate::nodes::Grading;

    const LAG: ShearLag = ShearLag { matrix: 30e9, fibre: 200e9, share: 0.005 };

    #[test]
    fn fibres_take_nothing_at_their_ends_and_all_in_the_middle() {
        let fibre = Fibre { ends: [DVec3::ZERO, DVec3::new(0.06, 0.0, 0.0)], diameter: 0.75e-3 };
        assert!(LAG.efficiency(&fibre, 0.0).abs() < 1e-12);
        assert!((LAG.efficiency(&fibre, 0.5) - 1.0).abs() < 1e-6);
        let mean =
            (0..1000).map(|k| LAG.efficiency(&fibre, (f64::from(k) + 0.5) / 1000.0)).sum::<f64>() / 1e3;
        assert!((0.944..0.949).contains(&mean), "{mean}");
    }

    #[test]
    fn walks_cross_facets_in_order_half_way_between_nodes() {
        let mesh = Mesh::new(DVec3::new(0.3, 0.1, 0.1), 0.15, Grading { finest: 0.02, coarsest: 0.03 }, 5);
        let lattice = Lattice::of(&mesh, 30e9);
        let around = around(&lattice.springs, lattice.nodes.len());
        let fibre =
            Fibre { ends: [DVec3::new(0.11, 0.02, 0.03), DVec3::new(0.2, 0.06, 0.05)], diameter: 1e-3 };
        let crossed = walk(&fibre, &lattice.nodes, &around);
        assert!(crossed.len() > 3 && crossed.windows(2).all(|pair| pair[0].0 <= pair[1].0));
        for (part, spring) in crossed {
            let point = fibre.ends[0] + part * (fibre.ends[1] - fibre.ends[0]);
            let [i, j] = lattice.springs[spring].cells.map(|cell| point.distance(lattice.nodes[cell]));
            assert!((i - j).abs() < 1e-12);
            let nearest = lattice.nodes.iter().map(|node| node.distance(point)).fold(f64::INFINITY, f64::min);
            assert!(i < nearest + 1e-12);
        }
    }
}
