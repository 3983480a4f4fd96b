//! A beam that cracks wherever it is too weak.
//!
//! Each point of each facet softens for itself. A jump Delta there makes the traction t = (1 - omega)(E/h) Delta. Pulled along a direction e, a
//! facet whose normal is at the angle psi to it bears sigma cos(psi) e: the resultant over the area projected along it, |t| / cos(psi), is
//! sigma whichever way the facet looks, so that strength and fracture energy have no preferred direction (Berton and Bolander 2006). |Delta| then
//! follows the law of a spring of the length h cos(psi), and uses up G_F of each projected area. psi stays as it is when the point cracks. Beyond 60 degrees
//! a crack begins as if twice n.Delta stood for |Delta|: in shear with a trace of tension the resultant over the projected area would tend to infinity. Nor
//! does a facet bear more in shear than the matrix, whose strength in shear is that of Mohr's straight envelope for a strength in compression of ten times that in
//! tension; pressure adds to it so steeply that nothing is crushed. Once a crack
//! has begun there it grows as |Delta| does: a facet that lies along the way of the opening must not hold the two sides of a crack together by its shear.
//!
//! Shear across a crack fades as its tension does; what closes passes pressure again, and does not add to |Delta|. A fibre is elastic at each facet that it crosses until the matrix
//! there cracks; then it bridges that facet along the direction in which it opens, at its angle to that direction.
//!
//! From one attempt to the next little changes: conjugate gradients lead from the last response to the next, with the factors of a lattice of not long ago
//! (Hestenes and Stiefel 1952). These are made anew when that would take longer.

use std::collections::BTreeMap;

use rayon::prelude::*;
use tremie_numerics::{DMat3, DVec3};

use crate::beam::Beam;
use crate::bearings::line;
use crate::bridge::{Bridge, BridgeState};
use crate::dense::dot;
use crate::fibres::{Crossing, Fibre};
use crate::lattice::{Lattice, Spring, combined, value};
use crate::mesh::{above, outer, quadrature};
use crate::path::{Care, Cracking};
use crate::plane::notch_opening;
use crate::pull_out::Bond;
use crate::setup::{Loading, TrialError};
use crate::shear_lag::{around, walk};
use crate::softening::{Law, Softening};
use crate::sparse::{Factor, Functional, Singular};

/// Cosine of the largest angle between a facet's normal and the traction on it at which the projected area counts.
const LEAST: f64 = 0.5;
/// Strength in shear over that in tension: sqrt(10)/2, where a straight line touches Mohr's circles of tension and of compression ten times as large.
const SHEAR: f64 = 1.581;
/// By how much a pressure adds to it.
const FRICTION: f64 = 20.0;
/// Most rounds of conjugate gradients; so many take as long as new factors. Work of what is left over that of the load when they end.
const ROUNDS: usize = 8;
const LEFT: f64 = 1e-12;
/// Share of the last opening from which on a facet is shown as part of the crack.
const SHOWN: f64 = 0.1;

/// A point of a facet.
#[derive(Clone, Copy)]
struct Point {
    /// Off the place where the facet's jump is taken, in m.
    off: DVec3,
    area: f64,
    /// Cosine of psi since it cracked; zero before.
    cosine: f64,
    /// Largest jump so far in m that drove the crack.
    most: f64,
    /// By how much in m the size of the jump was ahead of what drove the crack when it began.
    lead: f64,
    /// Size of the jump in m at the last reading.
    size: f64,
    /// Work in J that is lost.
    lost: f64,
}

/// A fibre where it crosses a facet.
struct Tie {
    fibre: usize,
    facet: usize,
    off: DVec3,
    /// The fibre's direction, and its stiffness along it in N/m before the matrix cracks.
    way: DVec3,
    along: f64,
    diameter: f64,
    crossing: Crossing,
    /// The direction in which the crack opens, and the force since then.
    open: Option<(DVec3, Bridge)>,
}

impl Tie {
    /// Its crossing of a crack that opens along a direction.
    fn across(&self, direction: DVec3) -> Crossing {
        let angle = self.way.dot(direction).abs().min(1.0).acos();
        Crossing { angle, ..self.crossing }
    }
}

/// A facet that may crack.
struct Facing {
    normal: DVec3,
    length: f64,
    corners: Vec<DVec3>,
    /// Its points, among all.
    points: std::ops::Range<usize>,
}

/// A state of not long ago.
struct Near {
    /// Its secants and its factors; none if it is the intact beam.
    secants: Vec<f64>,
    factor: Option<Factor>,
    /// The last response.
    found: Vec<f64>,
}

/// The facets of a beam, all of which may crack.
pub(crate) struct Anywhere {
    lattice: Lattice,
    factor: Factor,
    near: Near,
    load: Vec<f64>,
    force: Functional,
    middle: Functional,
    mouth: Functional,
    modulus: f64,
    softening: Softening,
    bond: Bond,
    /// By the springs of the lattice; the plates' springs after them do not crack.
    facets: Vec<Facing>,
    points: Vec<Point>,
    ties: Vec<Tie>,
    /// Ties by facet.
    ties_of: BTreeMap<usize, Vec<usize>>,
}

impl Anywhere {
    /// The facets of a beam.
    pub(crate) fn new(beam: &Beam) -> Result<Self, TrialError> {
        let (setup, mesh) = (&beam.setup, &beam.mesh);
        let (mut facets, mut points) = (Vec::new(), Vec::new());
        let cut = mesh.facets.len();
        for (n, facet) in mesh.facets.iter().chain(&mesh.plane).enumerate() {
            let kept = if n < cut { facet.corners.clone() } else { above(&facet.corners, setup.notch) };
            let first = points.len();
            points.extend(quadrature(&kept).into_iter().filter(|(_, area)| *area > 0.0).map(|(at, area)| {
                Point {
                    off: at - facet.centroid,
                    area,
                    cosine: 0.0,
                    most: 0.0,
                    lead: 0.0,
                    size: 0.0,
                    lost: 0.0,
                }
            }));
            facets.push(Facing {
                normal: facet.normal,
                length: facet.length,
                corners: kept,
                points: first..points.len(),
            });
        }
        let mut ties = Vec::new();
        let around = around(&beam.lattice.springs[..facets.len()], mesh.nodes.len());
        let cells = &beam.lattice.nodes[..mesh.nodes.len()];
        for (n, fibre) in setup.fibres.iter().enumerate() {
            for (part, spring) in walk(fibre, cells, &around) {
                if let Some(facet) = facets.get(spring) {
                    let tie = tie(beam, fibre, part, spring, facet);
                    ties.push(Tie { fibre: n, ..tie });
                }
            }
        }
        ties.retain(|tie| !facets[tie.facet].points.is_empty());
        let mut ties_of: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
        for (n, tie) in ties.iter().enumerate() {
            ties_of.entry(tie.facet).or_default().push(n);
        }
        let lattice = Lattice {
            nodes: beam.lattice.nodes.clone(),
            springs: beam.lattice.springs.clone(),
            fixed: beam.lattice.fixed.clone(),
        };
        let factor = lattice.factor()?;
        let load = beam.load();
        Ok(Self {
            near: Near { secants: Vec::new(), factor: None, found: factor.solve(&load) },
            load,
            force: beam.force.clone(),
            middle: beam.middle.clone(),
            mouth: gauge(beam)?,
            modulus: setup.modulus,
            softening: setup.softening,
            bond: setup.bond,
            lattice,
            factor,
            facets,
            points,
            ties,
            ties_of,
        })
    }

    /// The factorised intact beam, without what fibres add to it.
    pub(crate) fn factor(&self) -> &Factor {
        &self.factor
    }

    /// The jump of a facet at its place and the relative rotation.
    fn motion(&self, displacements: &[f64], facet: usize) -> (DVec3, DVec3) {
        self.lattice.motion(&self.lattice.springs[facet], displacements)
    }

    /// The law of a point whose traction is at the angle with this cosine to the normal of its facet.
    fn law(&self, facet: usize, cosine: f64) -> Law {
        self.softening.spring(self.facets[facet].length * cosine, self.modulus)
    }

    /// What a point has been through if the jump is this, and its law.
    fn state(&self, facet: usize, point: &Point, jump: DVec3) -> (Law, Point) {
        let across = jump.dot(self.facets[facet].normal);
        let along = (jump - across * self.facets[facet].normal).length();
        let size = along.hypot(across.max(0.0));
        let cosine = if point.cosine > 0.0 {
            point.cosine
        } else if across > LEAST * size {
            across / size
        } else {
            LEAST
        };
        let law = self.law(facet, cosine);
        let sheared = LEAST / SHEAR * (along + FRICTION * across.min(0.0));
        let beginning = size.min(sheared.max(across / LEAST));
        let driving = if point.cosine > 0.0 { beginning.max(size - point.lead) } else { beginning };
        if driving <= point.most {
            return (law, Point { size, ..*point });
        }
        // The integral of 1/2 (E/h) |Delta|^2 d(omega), where the law's own work has the jump that drives it in place of |Delta|.
        let excess = |size: f64, driving: f64| (size / driving).powi(2);
        let before = if point.cosine > 0.0 { excess(point.size, point.most) } else { excess(size, driving) };
        let gain = 0.5 * (before + excess(size, driving)) * (law.lost(driving) - law.lost(point.most));
        let lead = if point.cosine > 0.0 { point.lead } else { size - driving };
        (
            law,
            Point {
                cosine,
                most: driving,
                lead,
                size,
                lost: point.lost + point.area * cosine * gain,
                ..*point
            },
        )
    }

    /// A fibre that bridges the jump of its facet: the direction of that, and the bridge, if the matrix there is cracked.
    fn bridge(&self, tie: &Tie, jump: DVec3) -> Option<(DVec3, Bridge)> {
        if tie.open.is_some() {
            return tie.open;
        }
        let size = jump.length();
        let facet = &self.facets[tie.facet];
        let cosine = jump.dot(facet.normal) / size;
        let first = self.law(tie.facet, cosine.clamp(LEAST, 1.0)).first_jump();
        if !(cosine > 0.0 && size > first) {
            return None;
        }
        let direction = jump / size;
        let crossing = tie.across(direction);
        Some((direction, Bridge::new(&self.bond, tie.diameter, &crossing, first, tie.along)))
    }

    fn jump(motion: (DVec3, DVec3), off: DVec3) -> DVec3 {
        motion.0 + motion.1.cross(off)
    }

    /// Fibres across open facets.
    pub(crate) fn bridges(&self, displacements: &[f64]) -> Vec<BridgeState> {
        let state = |tie: &Tie| {
            let (direction, bridge) = tie.open?;
            let jump = Self::jump(self.motion(displacements, tie.facet), tie.off).dot(direction);
            let crossing = tie.across(direction);
            let force = bridge.secant(jump, bridge.most) * jump;
            Some(BridgeState { fibre: tie.fibre, crossing, opening: jump.max(0.0), force })
        };
        self.ties.iter().filter_map(state).collect()
    }

    /// The facets that are open by more than a tenth of what the matrix bridges, with the openings in m at their corners.
    pub(crate) fn crack(&self, displacements: &[f64]) -> Vec<(Vec<DVec3>, Vec<f64>)> {
        let mut open = Vec::new();
        for (n, facet) in self.facets.iter().enumerate() {
            let most = self.points[facet.points.clone()].iter().map(|point| point.most).fold(0.0, f64::max);
            if most > SHOWN * self.softening.last_opening {
                let motion = self.motion(displacements, n);
                let at = self.lattice.springs[n].at;
                let opening = |corner: &DVec3| Self::jump(motion, *corner - at).length();
                open.push((facet.corners.clone(), facet.corners.iter().map(opening).collect()));
            }
        }
        open
    }

    /// What points and fibres have been through.
    pub(crate) fn save(&self) -> Vec<f64> {
        let points = self
            .points
            .iter()
            .flat_map(|point| [point.cosine, point.most, point.lead, point.size, point.lost]);
        let ties = self.ties.iter().flat_map(|tie| match &tie.open {
            Some((direction, bridge)) => [direction.x, direction.y, direction.z, bridge.most],
            None => [0.0; 4],
        });
        // And from where the next response is found, so that it goes on to the bit.
        let near = self.near.found.iter().chain(&self.near.secants).copied();
        points.chain(ties).chain(near).collect()
    }

    /// Takes these up again; false if they are of another beam.
    pub(crate) fn restore(&mut self, state: &[f64]) -> bool {
        let counts = [5 * self.points.len(), 4 * self.ties.len(), self.near.found.len()];
        let secants = 2 * self.points.len() + 3 * self.ties.len();
        let rest = state.len().checked_sub(counts.iter().sum());
        if !rest.is_some_and(|rest| rest == 0 || rest == secants) {
            return false;
        }
        let (points, state) = state.split_at(counts[0]);
        let (ties, state) = state.split_at(counts[1]);
        let (found, secants) = state.split_at(counts[2]);
        let factor = match secants {
            [] => None,
            secants => match self.softened(secants).factor() {
                Ok(factor) => Some(factor),
                Err(Singular) => return false,
            },
        };
        self.near = Near { secants: secants.to_vec(), factor, found: found.to_vec() };
        for (point, state) in self.points.iter_mut().zip(points.chunks(5)) {
            let [cosine, most, lead, size, lost] = *state else { return false };
            *point = Point { cosine, most, lead, size, lost, ..*point };
        }
        for (n, state) in ties.chunks(4).enumerate() {
            let direction = DVec3::from_slice(&state[..3]);
            if direction == DVec3::ZERO {
                continue;
            }
            let tie = &self.ties[n];
            let cosine = direction.dot(self.facets[tie.facet].normal).clamp(LEAST, 1.0);
            let first = self.law(tie.facet, cosine).first_jump();
            let crossing = tie.across(direction);
            let mut bridge = Bridge::new(&self.bond, tie.diameter, &crossing, first, tie.along);
            bridge.most = state[3];
            self.ties[n].open = Some((direction, bridge));
        }
        true
    }

    /// The lattice with these secants.
    fn softened(&self, secants: &[f64]) -> Lattice {
        let springs = self.lattice.springs.par_iter().enumerate().map(|(n, spring)| {
            let stiffness = if n < self.facets.len() { self.stiffness(n, secants) } else { spring.stiffness };
            Spring { stiffness, ..spring.clone() }
        });
        Lattice {
            nodes: self.lattice.nodes.clone(),
            springs: springs.collect(),
            fixed: self.lattice.fixed.clone(),
        }
    }

    /// The stiffness of a facet with its fibres.
    fn stiffness(&self, n: usize, secants: &[f64]) -> [[f64; 6]; 6] {
        let facet = &self.facets[n];
        let points = &self.points[facet.points.clone()];
        let own = &secants[2 * facet.points.start..2 * facet.points.end];
        let mut sum = [[0.0; 6]; 6];
        let mut add = |matrix: DMat3, off: DVec3| {
            // T' matrix T, T = [1, -off x].
            let skew = DMat3::from_cols(
                DVec3::new(0.0, off.z, -off.y),
                DVec3::new(-off.z, 0.0, off.x),
                DVec3::new(off.y, -off.x, 0.0),
            );
            let turned = -1.0 * (matrix * skew);
            let twice = skew * turned;
            for k in 0..3 {
                for l in 0..3 {
                    sum[k][l] += matrix.col(l)[k];
                    sum[k][3 + l] += turned.col(l)[k];
                    sum[3 + l][k] += turned.col(l)[k];
                    sum[3 + k][3 + l] += twice.col(l)[k];
                }
            }
        };
        let normal = outer(facet.normal, facet.normal);
        for (point, [across, along]) in points.iter().zip(own.as_chunks::<2>().0) {
            let each = self.modulus / facet.length * point.area;
            add((DMat3::IDENTITY * *along + normal * (across - along)) * each, point.off);
        }
        for tie in self.ties_of.get(&n).into_iter().flatten() {
            let root = DVec3::from_slice(&secants[2 * self.points.len() + 3 * tie..][..3]);
            add(outer(root, root), self.ties[*tie].off);
        }
        sum
    }
}

impl Cracking for Anywhere {
    fn respond(&mut self, secants: &[f64]) -> Result<(Vec<f64>, f64), Singular> {
        let lattice = self.softened(secants);
        let factor = self.near.factor.as_ref().unwrap_or(&self.factor);
        let found = match improve(&lattice, factor, &self.load, &self.near.found) {
            Some(found) => found,
            None => {
                let factor = lattice.factor()?;
                let found = factor.solve(&self.load);
                self.near = Near { secants: secants.to_vec(), factor: Some(factor), found: Vec::new() };
                found
            }
        };
        self.near.found.clone_from(&found);
        let opening = value(&self.mouth, &found);
        Ok((found, opening))
    }

    /// Of each point, what is left of its stiffness across the facet and along it; of each fibre the root of its stiffness, as a vector.
    fn secants(&self, displacements: &[f64]) -> Vec<f64> {
        let facets = self.facets.par_iter().enumerate().flat_map_iter(|(n, facet)| {
            let motion = self.motion(displacements, n);
            self.points[facet.points.clone()].iter().flat_map(move |point| {
                let jump = Self::jump(motion, point.off);
                let (law, Point { most, .. }) = self.state(n, point, jump);
                let kept = law.secant(most, most) / law.elastic();
                [if jump.dot(facet.normal) > 0.0 { kept } else { 1.0 }, kept]
            })
        });
        let mut all: Vec<f64> = facets.collect();
        for tie in &self.ties {
            let jump = Self::jump(self.motion(displacements, tie.facet), tie.off);
            let root = match self.bridge(tie, jump) {
                Some((direction, bridge)) => {
                    let jump = jump.dot(direction);
                    bridge.secant(jump, bridge.most.max(jump)).max(0.0).sqrt() * direction
                }
                None => tie.along.sqrt() * tie.way,
            };
            all.extend(root.to_array());
        }
        all
    }

    /// Until one of several cracks has won, all soften a little more with each attempt at an opening: it is soon left to the work that is used up, by which one
    /// wins at once.
    fn care(&self) -> Care {
        Care { load: 1e-4, secants: 3e-3, slip: 2e-4, attempts: 15, halvings: 1 }
    }

    /// By how much stresses have changed, as shares of the strength; forces of fibres, as shares of all of them.
    fn change(&self, old: &[f64], new: &[f64], displacements: &[f64]) -> f64 {
        let mut most = 0.0_f64;
        for (n, facet) in self.facets.iter().enumerate() {
            let range = 2 * facet.points.start..2 * facet.points.end;
            if old[range.clone()] == new[range] {
                continue;
            }
            let motion = self.motion(displacements, n);
            let strength = self.law(n, 1.0).first_jump();
            for k in facet.points.clone() {
                let jump = Self::jump(motion, self.points[k].off);
                let across = jump.dot(facet.normal).abs() * (old[2 * k] - new[2 * k]).abs();
                let along = jump.length() * (old[2 * k + 1] - new[2 * k + 1]).abs();
                most = most.max(across.max(along) / strength);
            }
        }
        let (mut moved, mut total) = (0.0, 0.0);
        let first = 2 * self.points.len();
        for (n, tie) in self.ties.iter().enumerate() {
            let [a, b] = [old, new].map(|all| DVec3::from_slice(&all[first + 3 * n..][..3]).length_squared());
            let jump = Self::jump(self.motion(displacements, tie.facet), tie.off).length();
            moved += (a - b).abs() * jump;
            total += b * jump;
        }
        if total > 0.0 { most.max(moved / total) } else { most }
    }

    fn found(&self, _: f64, displacements: &[f64], _: &[f64]) -> [f64; 4] {
        let matrix: Vec<f64> = self
            .facets
            .par_iter()
            .enumerate()
            .map(|(n, facet)| {
                let motion = self.motion(displacements, n);
                let lost = |point: &Point| self.state(n, point, Self::jump(motion, point.off)).1.lost;
                self.points[facet.points.clone()].iter().map(lost).sum()
            })
            .collect();
        let fibres = self.ties.iter().map(|tie| {
            let jump = Self::jump(self.motion(displacements, tie.facet), tie.off);
            self.bridge(tie, jump)
                .map_or(0.0, |(direction, bridge)| bridge.lost(bridge.most.max(jump.dot(direction))))
        });
        [
            value(&self.force, displacements),
            value(&self.middle, displacements),
            matrix.iter().sum(),
            fibres.sum(),
        ]
    }

    fn commit(&mut self, displacements: &[f64]) {
        let mut points = std::mem::take(&mut self.points);
        for (n, facet) in self.facets.iter().enumerate() {
            let motion = self.motion(displacements, n);
            for point in &mut points[facet.points.clone()] {
                let (law, after) = self.state(n, point, Self::jump(motion, point.off));
                if after.most > law.first_jump() {
                    *point = after;
                }
            }
        }
        self.points = points;
        for n in 0..self.ties.len() {
            let tie = &self.ties[n];
            let jump = Self::jump(self.motion(displacements, tie.facet), tie.off);
            if let Some((direction, mut bridge)) = self.bridge(tie, jump) {
                bridge.most = bridge.most.max(jump.dot(direction));
                self.ties[n].open = Some((direction, bridge));
            }
        }
    }
}

/// The displacements of a lattice under a load, from a guess on, with the factors of a lattice that is nearly the same; nothing if it would take long.
fn improve(lattice: &Lattice, near: &Factor, load: &[f64], guess: &[f64]) -> Option<Vec<f64>> {
    let forces = |displacements: &[f64]| {
        let mut forces = lattice.forces(displacements);
        for (force, fixed) in forces.iter_mut().zip(lattice.fixed.as_flattened()) {
            *force = if *fixed { 0.0 } else { *force };
        }
        forces
    };
    let mut found = guess.to_vec();
    let mut left: Vec<f64> = load.iter().zip(forces(&found)).map(|(load, force)| load - force).collect();
    let mut led = near.solve(&left);
    let mut way = led.clone();
    let mut product = dot(&left, &led);
    for round in 0..=ROUNDS {
        if product <= LEFT * dot(load, &found).abs() {
            return Some(found);
        }
        if round == ROUNDS {
            break;
        }
        let held = forces(&way);
        let step = product / dot(&way, &held);
        found.iter_mut().zip(&way).for_each(|(found, way)| *found += step * way);
        left.iter_mut().zip(&held).for_each(|(left, held)| *left -= step * held);
        led = near.solve(&left);
        let next = dot(&left, &led);
        let turn = next / product;
        product = next;
        way.iter_mut().zip(&led).for_each(|(way, led)| *way = led + turn * *way);
    }
    None
}

fn tie(beam: &Beam, fibre: &Fibre, part: f64, spring: usize, facet: &Facing) -> Tie {
    let [start, end] = fibre.ends;
    let (length, way) = (fibre.length(), (end - start).normalize());
    let point = start + part * (end - start);
    let along = beam.lag.map_or(0.0, |lag| lag.stiffness(fibre, part, facet.normal, facet.length));
    Tie {
        fibre: 0,
        facet: spring,
        off: point - beam.lattice.springs[spring].at,
        way,
        along,
        diameter: fibre.diameter,
        crossing: Crossing { point, lengths: [part * length, (1.0 - part) * length], angle: 0.0 },
        open: None,
    }
}

/// The opening that leads the test: of the notch; of the lower face over the beam's height, or between the loads if these are further apart; or between the
/// plates.
fn gauge(beam: &Beam) -> Result<Functional, TrialError> {
    let (setup, mesh, lattice) = (&beam.setup, &beam.mesh, &beam.lattice);
    if setup.notch > 0.0 {
        return Ok(notch_opening(beam));
    }
    let inner = match setup.loading {
        Loading::Tension => return Ok(beam.force.clone()),
        Loading::FourPoint { inner, .. } => inner,
        Loading::ThreePoint { .. } => 0.0,
    };
    let half = 0.5 * inner.max(setup.size.z);
    let end = |sign: f64| {
        let at = 0.5 * setup.size.x + sign * half;
        line(lattice, mesh, 4, DVec3::X, at, setup.grading.finest, "the gauge of the opening")
    };
    Ok(combined(&[(-1.0, &end(-1.0)?), (1.0, &end(1.0)?)]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::setup::Setup;
    use crate::{Grading, pull_out, softening};

    #[test]
    fn facets_slide_at_the_strength_in_shear_unless_they_are_pressed() {
        let beam = Beam::new(Setup {
            size: DVec3::new(0.2, 0.1, 0.1),
            crack: 0.1,
            anywhere: true,
            notch: 0.0,
            loading: Loading::Tension,
            modulus: 30e9,
            softening: softening::THESIS,
            bond: pull_out::THESIS,
            fibres: Vec::new(),
            shear_lag: true,
            grading: Grading { finest: 0.03, coarsest: 0.03 },
            seed: 1,
        });
        let body = Anywhere::new(&beam.unwrap()).unwrap();
        for facet in [0, 7, 20] {
            let Facing { normal, length, ref points, .. } = body.facets[facet];
            let along = normal.any_orthonormal_vector();
            // The jump that an intact facet has under a traction in Pa.
            let jump = |traction: DVec3| length / 30e9 * traction;
            let cracks = |traction: DVec3| {
                let (law, point) = body.state(facet, &body.points[points.start], jump(traction));
                point.most > law.first_jump()
            };
            let strength = softening::THESIS.strength;
            assert!(!cracks(0.999 * strength * normal) && cracks(1.001 * strength * normal));
            assert!(!cracks(1.58 * strength * along) && cracks(1.59 * strength * along));
            let pressed = |shear: f64, pressure: f64| strength * (shear * along - pressure * normal);
            assert!(!cracks(pressed(3.0, 0.1)) && cracks(pressed(3.0, 0.05)));
            // What has slid far bears no shear any more, and pressure as before.
            let (law, point) = body.state(facet, &body.points[points.start], 1e-3 * along);
            assert!(law.secant(point.most, point.most) < 1e-6 * law.elastic());
            let (_, after) = body.state(facet, &point, jump(-50.0 * strength * normal));
            assert_eq!(after.most, point.most);
        }
    }
}
