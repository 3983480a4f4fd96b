//! A test of a beam, led by the opening of its crack.
//!
//! All that is not linear sits in the crack plane, which is a plane of symmetry: a facet there opens by a jump along x at its centroid and
//! by two rotations, and passes no shear. With C = G' K^-1 G the compliance of these jumps J in the intact lattice and D_0 their intact
//! stiffness, the lattice without its plane has the stiffness C^-1 - D_0, and the whole one obeys
//!
//!   (C^-1 - D_0 + D) J = P C^-1 G' K^-1 f,
//!
//! D being the secant stiffness of matrix and fibres, P the load and f its place. It is a dense positive system of three unknowns for each
//! facet; the rest of the lattice is factorised once. Facets of the plane are integrated point by point (a facet judged at its centroid alone keeps its rotational
//! stiffness, and acts as a hinge that does not give). P follows from the opening that is asked for, which
//! only grows, so that a load or deflection that falls back is no trouble.

use std::collections::BTreeMap;

use tremie_numerics::DVec3;

use crate::dense;
use crate::fibres::{Crossing, Fibre};
use crate::lattice::{Lattice, combined, load, value};
use crate::mesh::{Facet, Mesh, above, quadrature};
use crate::nodes::Grading;
use crate::pull_out::{Bond, PullOut};
use crate::shear_lag::ShearLag;
use crate::softening::{Law, Softening};
use crate::sparse::{Factor, Functional, Singular, UNKNOWNS};

/// Width in m over which a support or a load bears at least.
const BEARING: f64 = 0.01;
/// Load and stiffnesses count as found when they change by no more than this share.
const CLOSE: f64 = 1e-5;
/// Attempts at a step, and how often it is halved if they do not lead anywhere, or lose sight of energy.
const ATTEMPTS: usize = 150;
const HALVINGS: usize = 8;
/// Attempts after which stiffnesses are no longer taken as they come.
const PATIENCE: usize = 25;
/// Work that may get lost in a step, as a share of all work so far: load and deflection are joined by straight lines.
const SLIP: f64 = 2e-4;
/// Largest residual of a linear system, as a share of the load.
const RESIDUAL: f64 = 1e-7;

/// How a beam is loaded.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Loading {
    /// Two supports, and two loads between them, all distances in m.
    FourPoint {
        /// Between the supports.
        span: f64,
        /// Between the loads.
        inner: f64,
    },
    /// Two supports, and a load in the middle.
    ThreePoint {
        /// Between the supports, in m.
        span: f64,
    },
    /// Pulled by plates at both ends that do not turn.
    Tension,
}

/// A beam and its test. Lengths are in m; x runs along the beam from one end, z upwards from the face in tension.
#[derive(Debug, Clone, PartialEq)]
pub struct Setup {
    /// Dimensions.
    pub size: DVec3,
    /// Where the crack plane is along x.
    pub crack: f64,
    /// Depth of the notch; zero if there is none.
    pub notch: f64,
    /// How it is loaded.
    pub loading: Loading,
    /// Modulus of elasticity of the matrix in Pa.
    pub modulus: f64,
    /// The matrix in tension.
    pub softening: Softening,
    /// How fibres hold.
    pub bond: Bond,
    /// The fibres, with the beam's lower corner as origin.
    pub fibres: Vec<Fibre>,
    /// Whether fibres stiffen what is not cracked.
    pub shear_lag: bool,
    /// How fine the lattice is.
    pub grading: Grading,
    /// Which of the lattices it is.
    pub seed: u64,
}

/// What is read at an opening.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reading {
    /// Opening of the crack at the face in tension, or its mean in tension, in m.
    pub opening: f64,
    /// Load in N.
    pub load: f64,
    /// Nominal stress in Pa: of an elastic beam, or mean.
    pub stress: f64,
    /// Deflection in m where the load is, against the supports; elongation in tension.
    pub deflection: f64,
    /// Deflection in m in the middle, at half the height, against the beam's half height over its supports.
    pub middle: f64,
    /// Work in J of the load so far.
    pub work: f64,
    /// What of it the matrix has used up.
    pub matrix_loss: f64,
    /// What of it the fibres have used up.
    pub fibre_loss: f64,
    /// Solutions it took.
    pub attempts: usize,
}

impl Reading {
    /// Work in J that is stored: what a straight way back to no load would return.
    pub fn stored(&self) -> f64 {
        0.5 * self.load * self.deflection
    }

    /// What is missing of the work that was put in, as a share of it.
    pub fn imbalance(&self) -> f64 {
        let found = self.stored() + self.matrix_loss + self.fibre_loss;
        if self.work > 0.0 { (found - self.work) / self.work } else { 0.0 }
    }
}

/// Why a test cannot be done, or go on.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum TrialError {
    /// The lattice is not held.
    #[error(transparent)]
    Singular(#[from] Singular),
    /// A linear system was not solved well.
    #[error("a linear system was solved with a residual of {residual:.1e} of the load only")]
    Residual {
        /// What is left.
        residual: f64,
    },
    /// Too few cells.
    #[error("the lattice is too coarse: {place} has no facets of its own")]
    Coarse {
        /// Where.
        place: &'static str,
    },
    /// Springs are so long that the softening snaps back within them.
    #[error("the softening is too steep for springs of {length} m; at most {most} m could follow it")]
    Brittle {
        /// Of the longest spring.
        length: f64,
        /// What could be followed.
        most: f64,
    },
    /// No equilibrium was found.
    #[error("no equilibrium was found at an opening of {opening} m")]
    Lost {
        /// Opening that was asked for, in m.
        opening: f64,
    },
    /// A state does not belong to this test.
    #[error("the state is not that of this test")]
    Foreign,
}

/// A point of a facet of the crack plane.
struct Point {
    facet: usize,
    arm: [f64; 3],
    area: f64,
    /// Largest jump so far in m.
    most: f64,
}

/// A fibre across the crack plane.
struct Bridge {
    facet: usize,
    arm: [f64; 3],
    crossing: Crossing,
    law: PullOut,
    /// Jump in m at which the matrix around it cracks.
    first: f64,
    /// Force in N that it has taken by then.
    elastic: f64,
    /// Largest jump so far in m.
    most: f64,
}

impl Bridge {
    /// Opening in m at which pulling out takes more force than it had before.
    fn taken_over(&self) -> f64 {
        let share = self.elastic / self.law.loose_force();
        if self.elastic > 0.0 { self.law.loose() * share * share } else { 0.0 }
    }

    /// Force in N at a jump that grows for the first time.
    fn force(&self, jump: f64) -> f64 {
        let opening = jump - self.first;
        if opening <= 0.0 {
            self.elastic * (jump / self.first).max(0.0)
        } else if opening < self.taken_over() {
            self.elastic
        } else {
            self.law.force(opening)
        }
    }

    /// Force over jump in N/m.
    fn secant(&self, jump: f64, most: f64) -> f64 {
        if most <= self.first {
            self.elastic / self.first
        } else if jump <= 0.0 {
            0.0
        } else {
            self.force(most) / most
        }
    }

    /// Work in J that is lost for good when the largest jump was `most`.
    fn lost(&self, most: f64) -> f64 {
        let opening = most - self.first;
        if opening <= 0.0 {
            return 0.0;
        }
        let flat = opening.min(self.taken_over());
        let work = 0.5 * self.elastic * self.first + self.elastic * flat + self.law.work(opening)
            - self.law.work(flat);
        work - 0.5 * self.force(most) * most
    }
}

/// A fibre across the crack, as it is at a moment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BridgeState {
    /// Where it crosses, at what angle, and its lengths on both sides.
    pub crossing: Crossing,
    /// Opening in m there.
    pub opening: f64,
    /// Force in N across the crack.
    pub force: f64,
}

/// A test that goes on.
pub struct Trial {
    setup: Setup,
    mesh: Mesh,
    lattice: Lattice,
    factor: Factor,
    force: Functional,
    laws: Vec<Law>,
    points: Vec<Point>,
    bridges: Vec<Bridge>,
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
    /// Jumps at the last reading and the one before, with the openings.
    jumps: [(f64, Vec<f64>); 2],
    last: Reading,
}

/// What a test is at a moment, to go on from.
#[derive(Debug, Clone, PartialEq)]
pub struct State {
    /// Largest jumps of points and fibres in m.
    pub most: Vec<f64>,
    /// Jumps at the last reading and at the one before.
    pub jumps: [Vec<f64>; 2],
    /// The last two openings in m.
    pub openings: [f64; 2],
    /// The last reading.
    pub last: Reading,
}

impl Trial {
    /// Makes a lattice of the beam and prepares its test.
    ///
    /// # Errors
    /// If the lattice is too coarse, not held, or cannot follow the softening.
    pub fn new(setup: Setup) -> Result<Self, TrialError> {
        let mesh = Mesh::new(setup.size, setup.crack, setup.grading, setup.seed);
        let plane = &mesh.plane;
        if plane.len() < 4 {
            return Err(TrialError::Coarse { place: "the crack plane" });
        }
        let length = plane.iter().map(|facet| facet.length).fold(0.0, f64::max);
        let most = setup.softening.longest(setup.modulus);
        if length >= most {
            return Err(TrialError::Brittle { length, most });
        }
        let mut lattice = Lattice::of(&mesh, setup.modulus);
        let images: BTreeMap<usize, usize> =
            plane.iter().filter_map(|facet| Some((facet.cell, facet.other?))).collect();
        let lag = setup.lag();
        if let Some(lag) = lag {
            lag.stiffen(&mut lattice, &setup.fibres, &images);
        }
        let mut kept: Vec<usize> = images.iter().flat_map(|(i, j)| [*i, *j]).collect();
        let (force, middle) = match setup.loading {
            Loading::Tension => {
                let plates = [0, 1].map(|side| lattice.plate(&mesh.sides[side], setup.modulus));
                lattice.fixed[plates[0]] = [true; UNKNOWNS];
                lattice.fixed[plates[1]] = [false, true, true, true, true, true];
                kept.extend(plates);
                let pull = vec![(plates[1], [1.0, 0.0, 0.0, 0.0, 0.0, 0.0])];
                (pull.clone(), pull)
            }
            bending => {
                let place = 0.25 * setup.size;
                let held = (0..mesh.nodes.len())
                    .min_by(|a, b| mesh.nodes[*a].distance(place).total_cmp(&mesh.nodes[*b].distance(place)));
                lattice.fixed[held.unwrap_or(0)] = [true; UNKNOWNS];
                (bend(&lattice, &mesh, bending, setup.grading.coarsest)?, sag(&lattice, &mesh, bending)?)
            }
        };
        let mut functionals = vec![force.clone(), middle];
        functionals.extend(plane.iter().flat_map(|facet| jump_of(&lattice, facet)));
        let factor =
            Factor::new(&lattice.nodes, &lattice.elements(), lattice.fixed.clone(), &kept, &functionals)?;

        let (count, wide) = (3 * plane.len(), functionals.len());
        let between = |i: usize, j: usize| factor.compliance[i * wide + j];
        let compliance: Vec<f64> =
            (0..count * count).map(|k| between(2 + k / count, 2 + k % count)).collect();
        let mut rest = dense::inverse(&compliance, count).map_err(|_| Singular)?;
        let free: Vec<f64> = (0..count).map(|k| between(0, 2 + k)).collect();
        let pull = rest.chunks(count).map(|row| row.iter().zip(&free).map(|(m, d)| m * d).sum()).collect();
        let intact: Vec<[[f64; 3]; 3]> = plane.iter().map(|facet| normal(facet, setup.modulus)).collect();
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
            plane.iter().map(|facet| setup.softening.spring(facet.length, setup.modulus)).collect();
        let points = points(plane, setup.notch);
        let bridges = bridges(&setup, plane, &laws, lag);
        let mouth = mouth(&setup, plane, &points);
        let zero = Reading {
            opening: 0.0,
            load: 0.0,
            stress: 0.0,
            deflection: 0.0,
            middle: 0.0,
            work: 0.0,
            matrix_loss: 0.0,
            fibre_loss: 0.0,
            attempts: 0,
        };
        let jumps = [(0.0, vec![0.0; count]), (0.0, vec![0.0; count])];
        let trial = Self {
            setup,
            lattice,
            factor,
            force,
            laws,
            points,
            bridges,
            rest,
            intact,
            pull,
            mouth,
            deflection,
            jumps,
            last: zero,
            mesh,
        };
        let residual = trial.residual();
        if residual > RESIDUAL || residual.is_nan() {
            return Err(TrialError::Residual { residual });
        }
        Ok(trial)
    }

    /// Residual of the intact beam under its load, as a share of the load.
    pub fn residual(&self) -> f64 {
        let load = load(&self.force, self.lattice.nodes.len());
        let forces = self.lattice.forces(&self.factor.solve(&load));
        let mut worst = 0.0_f64;
        for (k, (found, asked)) in forces.iter().zip(&load).enumerate() {
            if !self.lattice.fixed[k / UNKNOWNS][k % UNKNOWNS] {
                worst = worst.max((found - asked).abs());
            }
        }
        worst / load.iter().fold(0.0_f64, |most, f| most.max(f.abs()))
    }

    /// Goes on to a larger opening in m: the readings on the way, and the last. A step is halved if it does not converge, or is so long that
    /// load times deflection is not the work that was done.
    ///
    /// # Errors
    /// If no equilibrium is found.
    pub fn advance(&mut self, opening: f64) -> Result<Vec<Reading>, TrialError> {
        let mut readings = Vec::new();
        let mut ahead = vec![opening];
        while let Some(next) = ahead.last().copied() {
            let finest = ahead.len() > HALVINGS;
            match self.step(next)? {
                Some((reading, jumps)) if finest || self.slip(&reading) <= SLIP => {
                    self.commit(reading, jumps);
                    readings.push(reading);
                    ahead.pop();
                }
                None if finest => return Err(TrialError::Lost { opening: next }),
                _ => ahead.push(0.5 * (self.last.opening + next)),
            }
        }
        Ok(readings)
    }

    /// Work that gets lost on the way to a reading, as a share of all work so far.
    fn slip(&self, next: &Reading) -> f64 {
        let kept =
            |reading: &Reading| reading.stored() + reading.matrix_loss + reading.fibre_loss - reading.work;
        (kept(next) - kept(&self.last)).abs() / next.work
    }

    /// One step; nothing if it does not converge.
    fn step(&self, opening: f64) -> Result<Option<(Reading, Vec<f64>)>, TrialError> {
        let count = self.pull.len();
        // As the jumps went on before.
        let [(before, older), (now, newer)] = &self.jumps;
        let ahead = if now > before { (opening - now) / (now - before) } else { 0.0 };
        let mut jumps: Vec<f64> =
            newer.iter().zip(older).map(|(new, old)| new + ahead * (new - old)).collect();
        let mut secants = self.secants(&jumps);
        let mut load = f64::INFINITY;
        for attempt in 1..=ATTEMPTS {
            let mut matrix = self.rest.clone();
            self.assemble(&secants, |row, column, stiffness| matrix[row * count + column] += stiffness);
            // Nothing bears any more: the beam is in two.
            dense::eliminate(&mut matrix, count, count).map_err(|_| TrialError::Lost { opening })?;
            jumps.copy_from_slice(&self.pull);
            dense::forward(&matrix, count, &mut jumps);
            dense::backward(&matrix, count, &mut jumps);
            let each: f64 = self.mouth.iter().zip(&jumps).map(|(c, j)| c * j).sum();
            let found = opening / each;
            jumps.iter_mut().for_each(|jump| *jump *= found);
            let next = self.secants(&jumps);
            let change = self.change(&secants, &next);
            let close = (found - load).abs() <= CLOSE * found.abs() && change <= CLOSE;
            load = found;
            if close {
                return Ok(Some((self.read(opening, load, &jumps, &secants, attempt), jumps)));
            }
            // Many fibres that begin to debond take over from the matrix within a micrometre, and all at once: then by smaller steps.
            let pace = if attempt <= PATIENCE {
                1.0
            } else if attempt <= 3 * PATIENCE {
                0.5
            } else {
                0.2
            };
            secants.iter_mut().zip(&next).for_each(|(secant, next)| *secant += pace * (next - *secant));
        }
        Ok(None)
    }

    /// Largest change of the secants, those of the matrix as shares of the intact ones, those of fibres of their own.
    fn change(&self, old: &[f64], new: &[f64]) -> f64 {
        let (points, bridges) = old.split_at(self.points.len());
        let mut most = 0.0_f64;
        for (n, point) in self.points.iter().enumerate() {
            most = most.max((points[n] - new[n]).abs() / self.laws[point.facet].elastic());
        }
        let total: f64 = bridges.iter().map(|k| k.abs()).sum();
        let moved: f64 = bridges.iter().zip(&new[points.len()..]).map(|(a, b)| (a - b).abs()).sum();
        if total > 0.0 { most.max(moved / total) } else { most }
    }

    /// Jump in m at a point of a facet.
    fn jump(jumps: &[f64], facet: usize, arm: &[f64; 3]) -> f64 {
        arm.iter().zip(&jumps[3 * facet..]).map(|(a, j)| a * j).sum()
    }

    /// Stress over jump of the points in Pa/m, then force over jump of the fibres in N/m.
    fn secants(&self, jumps: &[f64]) -> Vec<f64> {
        let points = self.points.iter().map(|point| {
            let jump = Self::jump(jumps, point.facet, &point.arm);
            self.laws[point.facet].secant(jump, point.most.max(jump))
        });
        let bridges = self.bridges.iter().map(|bridge| {
            let jump = Self::jump(jumps, bridge.facet, &bridge.arm);
            bridge.secant(jump, bridge.most.max(jump))
        });
        points.chain(bridges).collect()
    }

    /// Adds up the stiffness of the plane, entry by entry.
    fn assemble(&self, secants: &[f64], mut add: impl FnMut(usize, usize, f64)) {
        let points = self.points.iter().map(|point| (point.facet, &point.arm, point.area));
        let bridges = self.bridges.iter().map(|bridge| (bridge.facet, &bridge.arm, 1.0));
        for ((facet, arm, area), secant) in points.chain(bridges).zip(secants) {
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

    fn read(&self, opening: f64, load: f64, jumps: &[f64], secants: &[f64], attempts: usize) -> Reading {
        let relief = self.relief(jumps, secants);
        let [deflection, middle] = self
            .deflection
            .each_ref()
            .map(|(each, by)| load * each - by.iter().zip(&relief).map(|(c, r)| c * r).sum::<f64>());
        let last = &self.last;
        let points = self.points.iter().map(|point| {
            let most = point.most.max(Self::jump(jumps, point.facet, &point.arm));
            point.area * self.laws[point.facet].lost(most)
        });
        let bridges = self
            .bridges
            .iter()
            .map(|bridge| bridge.lost(bridge.most.max(Self::jump(jumps, bridge.facet, &bridge.arm))));
        Reading {
            opening,
            load,
            stress: load * self.setup.nominal(),
            deflection,
            middle,
            work: last.work + 0.5 * (load + last.load) * (deflection - last.deflection),
            matrix_loss: points.sum(),
            fibre_loss: bridges.sum(),
            attempts,
        }
    }

    fn commit(&mut self, reading: Reading, jumps: Vec<f64>) {
        for point in &mut self.points {
            point.most = point.most.max(Self::jump(&jumps, point.facet, &point.arm));
        }
        for bridge in &mut self.bridges {
            bridge.most = bridge.most.max(Self::jump(&jumps, bridge.facet, &bridge.arm));
        }
        self.last = reading;
        let [_, newer] = std::mem::take(&mut self.jumps);
        self.jumps = [newer, (reading.opening, jumps)];
    }

    /// The last reading.
    pub fn last(&self) -> &Reading {
        &self.last
    }

    /// The beam and its test.
    pub fn setup(&self) -> &Setup {
        &self.setup
    }

    /// The lattice.
    pub fn mesh(&self) -> &Mesh {
        &self.mesh
    }

    /// Fibres across the crack.
    pub fn bridges(&self) -> Vec<BridgeState> {
        let jumps = &self.jumps[1].1;
        let state = |bridge: &Bridge| {
            let jump = Self::jump(jumps, bridge.facet, &bridge.arm);
            let force = bridge.secant(jump, bridge.most) * jump;
            BridgeState { crossing: bridge.crossing, opening: jump.max(0.0), force }
        };
        self.bridges.iter().map(state).collect()
    }

    /// The openings in m at the corners of each facet of the crack plane.
    pub fn openings(&self) -> Vec<Vec<f64>> {
        let jumps = &self.jumps[1].1;
        let of = |(n, facet): (usize, &Facet)| {
            facet.corners.iter().map(|corner| Self::jump(jumps, n, &arm(facet, *corner))).collect()
        };
        self.mesh.plane.iter().enumerate().map(of).collect()
    }

    /// Displacements and rotations of the cells: six numbers each, in m and rad, held at one of them.
    pub fn displacements(&self) -> Vec<f64> {
        let jumps = &self.jumps[1].1;
        let relief = self.relief(jumps, &self.secants(jumps));
        let mut loads = load(&self.force, self.lattice.nodes.len());
        loads.iter_mut().for_each(|f| *f *= self.last.load);
        for (n, facet) in self.mesh.plane.iter().enumerate() {
            for (k, functional) in jump_of(&self.lattice, facet).iter().enumerate() {
                for (node, weights) in functional {
                    for (place, weight) in weights.iter().enumerate() {
                        loads[UNKNOWNS * node + place] -= weight * relief[3 * n + k];
                    }
                }
            }
        }
        let mut found = self.factor.solve(&loads);
        found.truncate(UNKNOWNS * self.mesh.nodes.len());
        found
    }

    /// Displacements of the intact beam under a load of 1 N: six numbers a cell.
    pub fn elastic(&self) -> Vec<f64> {
        let mut found = self.factor.solve(&load(&self.force, self.lattice.nodes.len()));
        found.truncate(UNKNOWNS * self.mesh.nodes.len());
        found
    }

    /// The displacement that the load does work on, of displacements as [`Self::elastic`] gives them, in m.
    pub fn deflection_of(&self, displacements: &[f64]) -> f64 {
        value(&self.force, displacements)
    }

    /// What it takes to go on from here.
    pub fn save(&self) -> State {
        let most = self.points.iter().map(|point| point.most);
        let most = most.chain(self.bridges.iter().map(|bridge| bridge.most)).collect();
        let [older, newer] = self.jumps.clone();
        State { most, openings: [older.0, newer.0], jumps: [older.1, newer.1], last: self.last }
    }

    /// Goes on from a state of the same test.
    ///
    /// # Errors
    /// If it is of another.
    pub fn restore(&mut self, state: State) -> Result<(), TrialError> {
        let fits = state.most.len() == self.points.len() + self.bridges.len()
            && state.jumps.iter().all(|jumps| jumps.len() == self.pull.len());
        if !fits {
            return Err(TrialError::Foreign);
        }
        let (points, bridges) = state.most.split_at(self.points.len());
        self.points.iter_mut().zip(points).for_each(|(point, most)| point.most = *most);
        self.bridges.iter_mut().zip(bridges).for_each(|(bridge, most)| bridge.most = *most);
        let [older, newer] = state.jumps;
        self.jumps = [(state.openings[0], older), (state.openings[1], newer)];
        self.last = state.last;
        Ok(())
    }
}

impl Setup {
    /// Nominal stress in Pa for a load of 1 N: of an elastic beam at its face in tension above the notch, or the mean.
    pub fn nominal(&self) -> f64 {
        let (width, height) = (self.size.y, self.size.z - self.notch);
        match self.loading {
            Loading::FourPoint { span, inner } => 3.0 * (span - inner) / (2.0 * width * height * height),
            Loading::ThreePoint { span } => 3.0 * span / (2.0 * width * height * height),
            Loading::Tension => 1.0 / (width * height),
        }
    }

    /// The elastic action of the fibres, if there are any that count.
    fn lag(&self) -> Option<ShearLag> {
        let volume: f64 = self.fibres.iter().map(|fibre| fibre.section() * fibre.length()).sum();
        let share = volume / self.size.element_product();
        let counts = self.shear_lag && share > 0.0 && self.bond.modulus > self.modulus;
        counts.then_some(ShearLag { matrix: self.modulus, fibre: self.bond.modulus, share })
    }
}

/// A line across a side of the beam, at `at` along x, as the mean vertical displacement there: a platen without friction that tilts freely.
///
/// The facets near it have weights such that sum w = 1 and their first moments about the line's middle vanish: the load has no eccentricity.
fn line(
    lattice: &Lattice,
    mesh: &Mesh,
    side: usize,
    at: f64,
    coarsest: f64,
    place: &'static str,
) -> Result<Functional, TrialError> {
    let reach = f64::max(1.2 * coarsest, 0.05 * mesh.size.x);
    let near: Vec<&Facet> =
        mesh.sides[side].iter().filter(|facet| (facet.centroid.x - at).abs() < reach).collect();
    let size = (near.iter().map(|facet| facet.area).sum::<f64>() / near.len().max(1) as f64).sqrt();
    // As wide as it must be to hold a facet for every two along the line; next to the crack plane the nearest are half a distance away.
    let mut width = f64::max(BEARING, 0.8 * size);
    let facets: Vec<&&Facet> = loop {
        let facets: Vec<_> =
            near.iter().filter(|facet| (facet.centroid.x - at).abs() < 0.5 * width).collect();
        if facets.len() as f64 >= f64::max(4.0, 0.5 * mesh.size.y / size) {
            break facets;
        }
        if near.is_empty() || width > 4.0 * size {
            return Err(TrialError::Coarse { place });
        }
        width *= 1.25;
    };
    let area: f64 = facets.iter().map(|facet| facet.area).sum();
    let middle = 0.5 * mesh.size.y;
    // a (l0 + l1 x + l2 y), by Cramer's rule on the moments of the areas.
    let terms =
        |facet: &Facet| DVec3::new(1.0, (facet.centroid.x - at) / width, (facet.centroid.y - middle) / width);
    let mut moments = tremie_numerics::DMat3::ZERO;
    for facet in &facets {
        let t = terms(facet);
        moments += tremie_numerics::DMat3::from_cols(t * t.x, t * t.y, t * t.z) * (facet.area / area);
    }
    if moments.determinant().abs() < 1e-12 {
        return Err(TrialError::Coarse { place });
    }
    let lambda = moments.inverse() * DVec3::X / area;
    Ok(facets
        .iter()
        .map(|facet| {
            let weight = facet.area * lambda.dot(terms(facet));
            (facet.cell, lattice.displacement(facet.cell, facet.centroid, weight * DVec3::Z))
        })
        .collect())
}

/// Where supports and loads are.
fn places(mesh: &Mesh, loading: Loading) -> ([f64; 2], Vec<f64>) {
    let middle = 0.5 * mesh.size.x;
    match loading {
        Loading::FourPoint { span, inner } => {
            ([middle - 0.5 * span, middle + 0.5 * span], vec![middle - 0.5 * inner, middle + 0.5 * inner])
        }
        Loading::ThreePoint { span } => ([middle - 0.5 * span, middle + 0.5 * span], vec![middle]),
        Loading::Tension => ([0.0, mesh.size.x], Vec::new()),
    }
}

/// The deflection of the loads against the supports; as a load, both of them.
fn bend(lattice: &Lattice, mesh: &Mesh, loading: Loading, coarsest: f64) -> Result<Functional, TrialError> {
    let (supports, loads) = places(mesh, loading);
    let mut parts = Vec::new();
    for at in supports {
        parts.push((0.5, line(lattice, mesh, 4, at, coarsest, "a support")?));
    }
    for at in &loads {
        parts.push((-1.0 / loads.len() as f64, line(lattice, mesh, 5, *at, coarsest, "a load")?));
    }
    Ok(combined(&parts.iter().map(|(factor, part)| (*factor, part)).collect::<Vec<_>>()))
}

/// The deflection in the middle at half the height, against half the height over the supports.
fn sag(lattice: &Lattice, mesh: &Mesh, loading: Loading) -> Result<Functional, TrialError> {
    let level = |at: f64| {
        // Of the cells there, as many on both sides of the middle of the span.
        let mut cells: Vec<(f64, usize)> = (0..mesh.nodes.len())
            .map(|n| ((mesh.nodes[n].x - at).hypot(mesh.nodes[n].z - 0.5 * mesh.size.z), n))
            .collect();
        cells.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        cells.truncate(12);
        let weight = 1.0 / cells.len() as f64;
        let point = |n: usize| DVec3::new(at, mesh.nodes[n].y, 0.5 * mesh.size.z);
        cells
            .into_iter()
            .map(|(_, n)| (n, lattice.displacement(n, point(n), weight * DVec3::Z)))
            .collect::<Functional>()
    };
    let (supports, _) = places(mesh, loading);
    let [left, right] = supports.map(level);
    Ok(combined(&[(0.5, &left), (0.5, &right), (-1.0, &level(0.5 * mesh.size.x))]))
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

fn bridges(setup: &Setup, plane: &[Facet], laws: &[Law], lag: Option<ShearLag>) -> Vec<Bridge> {
    let mut bridges = Vec::new();
    for fibre in &setup.fibres {
        let Some(crossing) = fibre.crossing(setup.crack) else { continue };
        if crossing.point.z < setup.notch {
            continue;
        }
        // The nearest node's: the plane is tiled by the cells' own facets.
        let Some(facet) = (0..plane.len()).find(|n| holds(&plane[*n].corners, crossing.point)) else {
            continue;
        };
        let [a, b] = crossing.lengths;
        let law = PullOut::new(&setup.bond, fibre.diameter, a.min(b), crossing.angle);
        let first = laws[facet].first_jump();
        let elastic = lag.map_or(0.0, |lag| {
            let along = lag.stiffness(fibre, a / (a + b), DVec3::X, plane[facet].length);
            (along * crossing.angle.cos().powi(2) * first).min(law.loose_force())
        });
        bridges.push(Bridge {
            facet,
            arm: arm(&plane[facet], crossing.point),
            crossing,
            law,
            first,
            elastic,
            most: 0.0,
        });
    }
    bridges
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

#[cfg(test)]
mod tests;
