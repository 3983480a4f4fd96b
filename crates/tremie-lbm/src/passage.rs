//! Bodies that come in through inlets and leave by outlets.
//!
//! With the fluid of an inlet come as many as its volume asks for. Each is drawn a place in front of the face, between its rim, straight on, and all that
//! is solid; one that finds no fluid there, or another body, stays owed and is drawn anew in the next steps. A body whose centre comes into a cell
//! of an outlet leaves. What is drawn depends on the numbers of the inlet, of the kind, of the body and of the try alone: so all that is kept are counts.

use tremie_case::{Case, Domain, Incoming};
use tremie_geometry::Face;
use tremie_numerics::DVec3;
use tremie_suspension::{Entrant, Film, Flat, Inclusions, Kind, Opening, Wall, Walls};

use crate::carrier::Sides;
use crate::grid::Grid;
use crate::inlet::Inflow;
use crate::real::Real;
use crate::scaling::Scaling;
use crate::topology::{AIR, EDGE};

/// Draws for one body in a step.
const TRIES: u32 = 10;

/// Bodies of one kind that come in through an inlet.
#[derive(Debug, Clone)]
struct Entry {
    /// What the case says of them.
    incoming: Incoming,
    inlet: usize,
    /// Number among what comes in through this inlet.
    number: usize,
    /// Their kind, which is no other's.
    kind: u16,
    batch: u16,
    /// Draws that have not let the next one in.
    tries: u64,
}

/// What comes in and leaves, and how many have.
#[derive(Debug, Clone, Default)]
pub(crate) struct Passage {
    entries: Vec<Entry>,
    /// Bodies of each kind that were there at the start or have come in since.
    came: Vec<u64>,
    /// Those that have left.
    left: Vec<u64>,
}

/// What is saved of a [`Passage`]: what came and left of each kind, the tries of each entry, and the number for the next body.
pub(crate) type Counts = ([Vec<u64>; 3], u64);

impl Passage {
    /// For the bodies at the start, to whose kinds those are added that come in.
    pub(crate) fn new(case: &Case, bodies: &mut Inclusions) -> Self {
        let batches = case.batches();
        let mut entries = Vec::new();
        for (inlet, of) in case.inlets.iter().enumerate() {
            let batch = of.batch.as_ref().and_then(|name| batches.iter().position(|batch| batch == name));
            let batch = batch.map_or(0, |batch| batch as u16 + 1);
            for (number, incoming) in of.inclusions.iter().enumerate() {
                let kind = bodies.kinds.len() as u16;
                let Incoming { name, form, density, .. } = incoming;
                bodies.kinds.push(Kind { name: name.clone(), form: *form, density: *density });
                entries.push(Entry { incoming: incoming.clone(), inlet, number, kind, batch, tries: 0 });
            }
        }
        let mut came = vec![0; bodies.kinds.len()];
        bodies.kind.iter().for_each(|kind| came[usize::from(*kind)] += 1);
        Self { entries, left: vec![0; came.len()], came }
    }

    /// Bodies of each kind that were there at the start or have come in since.
    pub(crate) fn came(&self) -> &[u64] {
        &self.came
    }

    /// Bodies of each kind that have left.
    pub(crate) fn left(&self) -> &[u64] {
        &self.left
    }

    /// The counts, to be saved with the bodies.
    pub(crate) fn counts(&self, bodies: &Inclusions) -> Counts {
        let tries = self.entries.iter().map(|entry| entry.tries).collect();
        ([self.came.clone(), self.left.clone(), tries], bodies.next)
    }

    /// Puts the counts back that were saved with these bodies; none if they do not belong together.
    pub(crate) fn restore(&mut self, counts: Counts, bodies: &mut Inclusions) -> Option<()> {
        let ([came, left, tries], next) = counts;
        let kinds = self.came.len();
        let fits = came.len() == kinds && left.len() == kinds && tries.len() == self.entries.len();
        if !fits || next < bodies.next {
            return None;
        }
        bodies.next = next;
        (self.came, self.left) = (came, left);
        self.entries.iter_mut().zip(tries).for_each(|(entry, tries)| entry.tries = tries);
        Some(())
    }

    /// Takes out the bodies that have come into outlets.
    pub(crate) fn drain<T: Real>(&mut self, bodies: &mut Inclusions, grid: &Grid<T>) {
        if grid.topology.outlets.is_empty() {
            return;
        }
        let leaves = |n: usize| grid.topology.drains(grid.cell_with(bodies.position[n]));
        let leaving: Vec<bool> = (0..bodies.len()).map(leaves).collect();
        for n in (0..bodies.len()).filter(|n| leaving[*n]) {
            self.left[usize::from(bodies.kind[n])] += 1;
        }
        bodies.retain(|n| !leaving[n]);
    }

    /// Lets in the bodies that are due by the time `time` in s, when so much has come in by each inlet.
    pub(crate) fn let_in<T: Real>(
        &mut self,
        bodies: &mut Inclusions,
        grid: &Grid<T>,
        scaling: &Scaling,
        time: f64,
        case: &Case,
        inflow: &[Inflow],
    ) {
        let periods = case.periods();
        let film = Film { viscosity: case.material.curve.plastic_viscosity(), grain: scaling.cell_size };
        for entry in &mut self.entries {
            // Behind a plane of symmetry come others, the images of these.
            let due = entry.incoming.due(inflow[entry.inlet].volume);
            let given = &mut self.came[usize::from(entry.kind)];
            if due <= *given {
                continue;
            }
            let inlet = &grid.inlets.all[entry.inlet];
            let (offset, next) = (inlet.way(time), inlet.way(time + scaling.time_step));
            let face = inlet.face(offset);
            let rate = inlet.due(time, scaling.time_step, inflow[entry.inlet].whole) / scaling.time_step;
            let velocity = rate / face.area() * face.direction + (next - offset) / scaling.time_step;
            let mouth = Mouth {
                face,
                domain: &case.domain,
                grid,
                sides: Sides::new(&grid.topology, &grid.solids, scaling.velocity_unit()),
            };
            while *given < due {
                let came = (0..TRIES).any(|_| {
                    let [inlet, number] = [entry.inlet, entry.number].map(|n| n as u64);
                    let draw = [entry.incoming.seed, inlet, number, *given, entry.tries];
                    let direction = entry.incoming.direction;
                    let entrant = Entrant { kind: entry.kind, batch: entry.batch, direction, velocity, draw };
                    entry.tries += 1;
                    bodies.enter(&entrant, &mouth, &periods, film)
                });
                if !came {
                    break;
                }
                *given += 1;
                entry.tries = 0;
            }
        }
    }
}

/// The face of an inlet as bodies see it.
struct Mouth<'a, T: Real> {
    face: Face,
    domain: &'a Domain,
    grid: &'a Grid<T>,
    sides: Sides<'a>,
}

impl<T: Real> Walls for Mouth<'_, T> {
    fn flat(&self) -> &[Flat] {
        self.sides.flat()
    }

    fn nearest(&self, at: DVec3, within: f64) -> Option<Wall> {
        let (distance, normal) = self.face.rim(at);
        let wall = self.sides.nearest(at, within);
        if distance < wall.map_or(within, |wall| wall.distance) {
            return Some(Wall { distance, normal, velocity: DVec3::ZERO });
        }
        wall
    }
}

impl<T: Real> Opening for Mouth<'_, T> {
    fn point(&self, numbers: [f64; 2]) -> Option<DVec3> {
        // A face along a side may lie a little beyond it.
        let at = self.face.point(numbers)?;
        let touch = 0.5 * self.grid.solids.size() * self.face.direction;
        self.domain.holds(at + touch).then_some(at)
    }

    fn direction(&self) -> DVec3 {
        self.face.direction
    }

    fn is_wet(&self, at: DVec3) -> bool {
        self.domain.holds(at) && self.grid.is_wet(self.grid.cell_with(at))
    }
}

impl<T: Real> Grid<T> {
    /// The cell of the lattice that a point in m lies in, or the nearest to it.
    fn cell_with(&self, at: DVec3) -> [usize; 3] {
        let place = ((at - self.solids.corner()) / self.solids.size()).floor();
        [0, 1, 2].map(|a| (place[a].max(0.0) as usize).min(self.topology.cells[a] - 1))
    }

    /// Whether a cell of the lattice holds fluid that does not leave.
    fn is_wet(&self, at: [usize; 3]) -> bool {
        let slot = self.slot_at(at);
        let cell = self.topology.cell_at(at);
        let wet = slot != AIR && self.kinds[slot as usize][cell / EDGE].wet() >> (cell % EDGE) & 1 == 1;
        wet && !self.topology.drains(at)
    }
}
