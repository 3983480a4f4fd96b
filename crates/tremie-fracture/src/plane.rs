//! A beam that cracks in one plane, across the beam.
//!
//! All that is not linear sits in the crack plane, which is a plane of symmetry: a facet there opens by a jump along x at its centroid and
//! by two rotations, and passes no shear. With C = G' K^-1 G the compliance of these jumps J in the intact lattice and D_0 their intact
//! stiffness, the lattice without its plane has the stiffness C^-1 - D_0, and the whole one obeys
//!
//!   (C^-1 - D_0 + D) J = P C^-1 G' K^-1 f,
//!
//! D being the secant stiffness of matrix and fibres, P the load and f its place. It is a dense positive system of three unknowns for each
//! facet; the rest of the lattice is factorised once. Facets of the plane are integrated point by point (a facet judged at its centroid alone keeps its rotational
//! stiffness, and acts as a hinge that does not give).

use tremie_numerics::DVec3;

use crate::beam::Beam;
use crate::bridge::{Bridge, BridgeState};
use crate::dense;
use crate::fibres::Crossing;
use crate::lattice::{Lattice, combined};
use crate::mesh::{Facet, above, quadrature};
use crate::path::{Care, Cracking};
use crate::setup::{Loading, Setup, TrialError};
use crate::softening::Law;
use crate::sparse::{Factor, Functional, Singular, UNKNOWNS};

/// A point of a facet of the crack plane.
struct Point {
    facet: usize,
    arm: [f64; 3],
    area: f64,
    /// Largest jump so far in m.
    most: f64,
}

/// A fibre across the crack plane.
struct Tie {
    fibre: usize,
    facet: usize,
    arm: [f64; 3],
    crossing: Crossing,
    bridge: Bridge,
}

/// The crack plane of a beam, and what the rest of the beam does to it.
pub(crate) struct Plane {
    factor: Factor,
    laws: Vec<Law>,
    points: Vec<Point>,
    ties: Vec<Tie>,
    /// Stiffness of the lattice without its crack plane, for the jumps.
    rest: Vec<f64>,
    /// Intact stiffness of the facets of the plane, for displacements.
    intact: Vec<[[f64; 3]; 3]>,
    /// Right-hand side for a load of 1 N.
    pull: Vec<f64>,
    /// The opening, as weights of the jumps.
    mouth: Vec<f64>,
    /// Deflections for a load of 1 N on the intact beam, and the jumps that a load makes there.
    deflection: [(f64, Vec<f64>); 2],
}

impl Plane {
    /// The crack plane of a beam, condensed.
    pub(crate) fn new(beam: &Beam) -> Result<Self, TrialError> {
        let (lattice, plane, modulus) = (&beam.lattice, &beam.mesh.plane, beam.setup.modulus);
        let mut kept: Vec<usize> = beam.images.iter().flat_map(|(i, j)| [*i, *j]).collect();
        kept.extend(&beam.plates);
        let mut functionals = vec![beam.force.clone(), beam.middle.clone()];
        functionals.extend(plane.iter().flat_map(|facet| jump_of(lattice, facet)));
        let factor =
            Factor::new(&lattice.nodes, &lattice.elements(), lattice.fixed.clone(), &kept, &functionals)?;

        let (count, wide) = (3 * plane.len(), functionals.len());
        let between = |i: usize, j: usize| factor.compliance[i * wide + j];
        let compliance: Vec<f64> =
            (0..count * count).map(|k| between(2 + k / count, 2 + k % count)).collect();
        let mut rest = dense::inverse(&compliance, count).map_err(|_| Singular)?;
        let free: Vec<f64> = (0..count).map(|k| between(0, 2 + k)).collect();
        let pull = rest.chunks(count).map(|row| row.iter().zip(&free).map(|(m, d)| m * d).sum()).collect();
        let intact: Vec<[[f64; 3]; 3]> = plane.iter().map(|facet| normal(facet, modulus)).collect();
        for (n, block) in intact.iter().enumerate() {
            for (k, row) in block.iter().enumerate() {
                for (l, stiffness) in row.iter().enumerate() {
                    rest[(3 * n + k) * count + 3 * n + l] -= stiffness;
                }
            }
        }
        let deflection =
            [0, 1].map(|which| (between(which, 0), (0..count).map(|k| between(which, 2 + k)).collect()));
        let laws: Vec<Law> =
            plane.iter().map(|facet| beam.setup.softening.spring(facet.length, modulus)).collect();
        let points = points(plane, beam.setup.notch);
        let ties = ties(beam, &laws);
        let mouth = mouth(&beam.setup, plane, &points);
        Ok(Self { factor, laws, points, ties, rest, intact, pull, mouth, deflection })
    }

    /// Jump in m at a point of a facet.
    fn jump(jumps: &[f64], facet: usize, arm: &[f64; 3]) -> f64 {
        arm.iter().zip(&jumps[3 * facet..]).map(|(a, j)| a * j).sum()
    }

    /// Adds up the stiffness of the plane, entry by entry.
    fn assemble(&self, secants: &[f64], mut add: impl FnMut(usize, usize, f64)) {
        let points = self.points.iter().map(|point| (point.facet, &point.arm, point.area));
        let ties = self.ties.iter().map(|tie| (tie.facet, &tie.arm, 1.0));
        for ((facet, arm, area), secant) in points.chain(ties).zip(secants) {
            for k in 0..3 {
                for l in 0..3 {
                    add(3 * facet + k, 3 * facet + l, area * secant * arm[k] * arm[l]);
                }
            }
        }
    }

    /// What the plane bears less than it did when it was intact, as loads on its jumps.
    fn relief(&self, jumps: &[f64], secants: &[f64]) -> Vec<f64> {
        let mut relief = vec![0.0; jumps.len()];
        self.assemble(secants, |row, column, stiffness| relief[row] += stiffness * jumps[column]);
        for (n, block) in self.intact.iter().enumerate() {
            for (k, row) in block.iter().enumerate() {
                relief[3 * n + k] -= row.iter().zip(&jumps[3 * n..]).map(|(s, j)| s * j).sum::<f64>();
            }
        }
        relief
    }

    /// The factorised intact beam.
    pub(crate) fn factor(&self) -> &Factor {
        &self.factor
    }

    /// Unknowns: three for each facet.
    pub(crate) fn unknowns(&self) -> usize {
        self.pull.len()
    }

    /// Fibres across the crack, where it is open by these jumps.
    pub(crate) fn bridges(&self, jumps: &[f64]) -> Vec<BridgeState> {
        let state = |tie: &Tie| {
            let jump = Self::jump(jumps, tie.facet, &tie.arm);
            let force = tie.bridge.secant(jump, tie.bridge.most) * jump;
            BridgeState { fibre: tie.fibre, crossing: tie.crossing, opening: jump.max(0.0), force }
        };
        self.ties.iter().map(state).collect()
    }

    /// The facets of the plane, with the openings in m at their corners.
    pub(crate) fn crack(&self, beam: &Beam, jumps: &[f64]) -> Vec<(Vec<DVec3>, Vec<f64>)> {
        let of = |(n, facet): (usize, &Facet)| {
            let opening = |corner: &DVec3| Self::jump(jumps, n, &arm(facet, *corner));
            (facet.corners.clone(), facet.corners.iter().map(opening).collect())
        };
        beam.mesh.plane.iter().enumerate().map(of).collect()
    }

    /// Displacements and rotations of the cells under a load in N: six numbers each, in m and rad, held at one of them.
    pub(crate) fn displacements(&self, beam: &Beam, load: f64, jumps: &[f64]) -> Vec<f64> {
        let relief = self.relief(jumps, &self.secants(jumps));
        let mut loads = beam.load();
        loads.iter_mut().for_each(|f| *f *= load);
        for (n, facet) in beam.mesh.plane.iter().enumerate() {
            for (k, functional) in jump_of(&beam.lattice, facet).iter().enumerate() {
                for (node, weights) in functional {
                    for (place, weight) in weights.iter().enumerate() {
                        loads[UNKNOWNS * node + place] -= weight * relief[3 * n + k];
                    }
                }
            }
        }
        let mut found = self.factor.solve(&loads);
        found.truncate(UNKNOWNS * beam.mesh.nodes.len());
        found
    }

    /// Largest jumps so far in m of points, then of fibres.
    pub(crate) fn save(&self) -> Vec<f64> {
        let points = self.points.iter().map(|point| point.most);
        points.chain(self.ties.iter().map(|tie| tie.bridge.most)).collect()
    }

    /// Takes these up again; false if they are of another beam.
    pub(crate) fn restore(&mut self, most: &[f64]) -> bool {
        if most.len() != self.points.len() + self.ties.len() {
            return false;
        }
        let (points, ties) = most.split_at(self.points.len());
        self.points.iter_mut().zip(points).for_each(|(point, most)| point.most = *most);
        self.ties.iter_mut().zip(ties).for_each(|(tie, most)| tie.bridge.most = *most);
        true
    }
}

impl Cracking for Plane {
    fn respond(&mut self, secants: &[f64]) -> Result<(Vec<f64>, f64), Singular> {
        let count = self.pull.len();
        let mut matrix = self.rest.clone();
        self.assemble(secants, |row, column, stiffness| matrix[row * count + column] += stiffness);
        dense::eliminate(&mut matrix, count, count).map_err(|_| Singular)?;
        let mut jumps = self.pull.clone();
        dense::forward(&matrix, count, &mut jumps);
        dense::backward(&matrix, count, &mut jumps);
        let opening = self.mouth.iter().zip(&jumps).map(|(c, j)| c * j).sum();
        Ok((jumps, opening))
    }

    /// Stress over jump of the points in Pa/m, then force over jump of the fibres in N/m.
    fn secants(&self, jumps: &[f64]) -> Vec<f64> {
        let points = self.points.iter().map(|point| {
            let jump = Self::jump(jumps, point.facet, &point.arm);
            self.laws[point.facet].secant(jump, point.most.max(jump))
        });
        let ties = self.ties.iter().map(|tie| {
            let jump = Self::jump(jumps, tie.facet, &tie.arm);
            tie.bridge.secant(jump, tie.bridge.most.max(jump))
        });
        points.chain(ties).collect()
    }

    fn care(&self) -> Care {
        Care { load: 1e-5, secants: 1e-5, slip: 2e-4, attempts: 150, halvings: 8 }
    }

    /// Those of the matrix as shares of the intact ones, those of fibres of their own.
    fn change(&self, old: &[f64], new: &[f64], _: &[f64]) -> f64 {
        let (points, ties) = old.split_at(self.points.len());
        let mut most = 0.0_f64;
        for (n, point) in self.points.iter().enumerate() {
            most = most.max((points[n] - new[n]).abs() / self.laws[point.facet].elastic());
        }
        let total: f64 = ties.iter().map(|k| k.abs()).sum();
        let moved: f64 = ties.iter().zip(&new[points.len()..]).map(|(a, b)| (a - b).abs()).sum();
        if total > 0.0 { most.max(moved / total) } else { most }
    }

    fn found(&self, load: f64, jumps: &[f64], secants: &[f64]) -> [f64; 4] {
        let relief = self.relief(jumps, secants);
        let [deflection, middle] = self
            .deflection
            .each_ref()
            .map(|(each, by)| load * each - by.iter().zip(&relief).map(|(c, r)| c * r).sum::<f64>());
        let points = self.points.iter().map(|point| {
            let most = point.most.max(Self::jump(jumps, point.facet, &point.arm));
            point.area * self.laws[point.facet].lost(most)
        });
        let ties = self
            .ties
            .iter()
            .map(|tie| tie.bridge.lost(tie.bridge.most.max(Self::jump(jumps, tie.facet, &tie.arm))));
        [deflection, middle, points.sum(), ties.sum()]
    }

    fn commit(&mut self, jumps: &[f64]) {
        for point in &mut self.points {
            point.most = point.most.max(Self::jump(jumps, point.facet, &point.arm));
        }
        for tie in &mut self.ties {
            tie.bridge.most = tie.bridge.most.max(Self::jump(jumps, tie.facet, &tie.arm));
        }
    }
}

/// The jump of a facet of the crack plane along x at its centroid, and its rotations about y and z.
fn jump_of(lattice: &Lattice, facet: &Facet) -> [Functional; 3] {
    let cells = [(facet.cell, -1.0), (facet.other.unwrap_or(facet.cell), 1.0)];
    let turn = |axis: usize| {
        cells.map(|(cell, sign)| {
            let mut weights = [0.0; UNKNOWNS];
            weights[3 + axis] = sign;
            (cell, weights)
        })
    };
    let shift = cells.map(|(cell, sign)| (cell, lattice.displacement(cell, facet.centroid, sign * DVec3::X)));
    [shift.to_vec(), turn(1).to_vec(), turn(2).to_vec()]
}

/// How jump and rotations of a facet add up at a point of it.
fn arm(facet: &Facet, point: DVec3) -> [f64; 3] {
    let off = point - facet.centroid;
    [1.0, off.z, -off.y]
}

/// The intact stiffness of a facet of the plane for its jump and rotations.
fn normal(facet: &Facet, modulus: f64) -> [[f64; 3]; 3] {
    let each = modulus / facet.length;
    let (yy, zz, yz) = (facet.moments.y_axis.y, facet.moments.z_axis.z, facet.moments.y_axis.z);
    [[each * facet.area, 0.0, 0.0], [0.0, each * zz, -each * yz], [0.0, -each * yz, each * yy]]
}

fn points(plane: &[Facet], notch: f64) -> Vec<Point> {
    let of = |(n, facet): (usize, &Facet)| {
        quadrature(&above(&facet.corners, notch))
            .into_iter()
            .filter(|(_, area)| *area > 0.0)
            .map(|(point, area)| Point { facet: n, arm: arm(facet, point), area, most: 0.0 })
            .collect::<Vec<_>>()
    };
    plane.iter().enumerate().flat_map(of).collect()
}

fn ties(beam: &Beam, laws: &[Law]) -> Vec<Tie> {
    let (setup, plane) = (&beam.setup, &beam.mesh.plane);
    let mut ties = Vec::new();
    for (n, fibre) in setup.fibres.iter().enumerate() {
        let Some(crossing) = fibre.crossing(setup.crack) else { continue };
        if crossing.point.z < setup.notch {
            continue;
        }
        // The nearest node's: the plane is tiled by the cells' own facets.
        let Some(facet) = (0..plane.len()).find(|n| holds(&plane[*n].corners, crossing.point)) else {
            continue;
        };
        let [a, b] = crossing.lengths;
        let along =
            beam.lag.map_or(0.0, |lag| lag.stiffness(fibre, a / (a + b), DVec3::X, plane[facet].length));
        let bridge = Bridge::new(&setup.bond, fibre.diameter, &crossing, laws[facet].first_jump(), along);
        ties.push(Tie { fibre: n, facet, arm: arm(&plane[facet], crossing.point), crossing, bridge });
    }
    ties
}

/// Whether a point of the crack plane lies in a convex polygon of it.
fn holds(corners: &[DVec3], point: DVec3) -> bool {
    let side = |k: usize| {
        let (a, b) = (corners[k], corners[(k + 1) % corners.len()]);
        (b - a).cross(point - a).x
    };
    let signs: Vec<f64> = (0..corners.len()).map(side).collect();
    signs.iter().all(|s| *s >= 0.0) || signs.iter().all(|s| *s <= 0.0)
}

/// The opening of the crack as weights of the jumps: along the lower edge, or the mean where all is pulled alike.
fn mouth(setup: &Setup, plane: &[Facet], points: &[Point]) -> Vec<f64> {
    let mut weights = vec![0.0; 3 * plane.len()];
    let mut add = |facet: usize, arm: [f64; 3], weight: f64| {
        arm.iter().enumerate().for_each(|(k, a)| weights[3 * facet + k] += weight * a);
    };
    if setup.loading == Loading::Tension {
        let area: f64 = points.iter().map(|point| point.area).sum();
        points.iter().for_each(|point| add(point.facet, point.arm, point.area / area));
        return weights;
    }
    let rounding = 1e-9 * setup.size.z;
    for (n, facet) in plane.iter().enumerate() {
        for k in 0..facet.corners.len() {
            let (a, b) = (facet.corners[k], facet.corners[(k + 1) % facet.corners.len()]);
            if a.z.abs() < rounding && b.z.abs() < rounding {
                add(n, arm(facet, 0.5 * (a + b)), a.distance(b) / setup.size.y);
            }
        }
    }
    weights
}

/// The opening of a notch, of the displacements of the cells beside it.
pub(crate) fn notch_opening(beam: &Beam) -> Functional {
    let weights = mouth(&beam.setup, &beam.mesh.plane, &[]);
    let facets = beam.mesh.plane.iter().zip(weights.as_chunks::<3>().0);
    let parts: Vec<(f64, Functional)> = facets
        .flat_map(|(facet, weights)| weights.iter().copied().zip(jump_of(&beam.lattice, facet)))
        .filter(|(weight, _)| *weight != 0.0)
        .collect();
    combined(&parts.iter().map(|(weight, part)| (*weight, part)).collect::<Vec<_>>())
}
