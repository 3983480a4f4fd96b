//! Faces that fluid comes in through.
//!
//! An inlet is a thin plate, a solid like others, whose front gives off fluid: a population that comes back from it through its face carries
//! (bounce-back from a wall of the velocity u, Ladd 1994)
//!
//! ```text
//!     f_i = f_opposite + 6 w_i rho c_i . u
//! ```
//!
//! more than it took there, rho being the cell's own density. That sum is the mass that comes in, and the sum without rho the volume.
//! u goes where the face looks, and is as large as the volume of the step asks for, whatever staircase the lattice makes of the face. Air
//! at an open face becomes interface; all else that happens to the fluid there is as everywhere. The plate's other sides are walls,
//! and when nothing comes, the front is one too.

use tremie_case::Case;
use tremie_geometry::{Body, Face};
use tremie_numerics::DVec3;

use crate::collision::{density_and_momentum, equilibrium};
use crate::grid::{Field, Grid};
use crate::lanes::{LANES, Lanes};
use crate::lattice::{C, Q, W};
use crate::real::Real;
use crate::rows::SurfaceRow;
use crate::source::Source;
use crate::surface::Cell;
use crate::topology::{AIR, CELLS, EDGE};

/// Thickness of a plate in cells: no link of the lattice is as long.
pub(crate) const THICKNESS: f64 = 2.0;

/// How far in cells a face is moved on for the lattice: a cell whose centre lies in it belongs to the plate; else it would be on neither side.
const AHEAD: f64 = 1e-6;

/// A face as the lattice has it, with cells of the edge `size` in m, and its plate.
pub(crate) fn plate(face: Face, size: f64) -> (Face, Body) {
    let face = Face { centre: face.centre + AHEAD * size * face.direction, ..face };
    let plate = face.plate(THICKNESS * size);
    (face, plate)
}
/// Weight of open links below which a face counts as closed.
const CLOSED: f64 = 1e-3;

/// The inlets of a case.
#[derive(Debug, Clone, Default)]
pub(crate) struct Inlets {
    pub(crate) all: Vec<Inlet>,
    /// Cells that fluid comes into in the coming step, in the order of their slots.
    mouths: Vec<Mouth>,
}

#[derive(Debug, Clone)]
pub(crate) struct Inlet {
    pub(crate) inlet: tremie_case::Inlet,
    /// The links across its face, where it was when they were last looked for.
    links: Option<Links>,
}

/// The links across a face.
#[derive(Debug, Clone)]
struct Links {
    /// Way in m of the face from where it is drawn.
    offset: DVec3,
    /// Share of the face that lies in the domain.
    share: f64,
    /// Cells in front of it, each with the velocities, as bits, that come out of the face.
    cells: Vec<([usize; 3], u32)>,
}

/// A cell in front of an open face.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Mouth {
    cell: Cell,
    inlet: usize,
    /// Velocities, as bits, that come out of the face.
    links: u32,
    /// Velocity of what comes, in lattice units.
    velocity: DVec3,
}

/// Volumes in m3 that have come in since the start.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Inflow {
    /// Through the whole face, as far as it lies beyond the domain too.
    pub(crate) whole: f64,
    /// Into the domain.
    pub(crate) volume: f64,
}

/// The velocities of a set of links.
fn each(links: u32) -> impl Iterator<Item = usize> {
    (1..Q).filter(move |i| links >> i & 1 == 1)
}

/// `6 w c.u`, the mass that a link brings at density 1.
fn brought(i: usize, velocity: DVec3) -> f64 {
    6.0 * W[i] * DVec3::from(C[i].map(f64::from)).dot(velocity)
}

impl Mouth {
    /// Volume in cells that comes in a step.
    fn volume(&self) -> f64 {
        each(self.links).map(|i| brought(i, self.velocity)).sum()
    }
}

impl Inlets {
    pub(crate) fn new(case: &Case) -> Self {
        let all = case.inlets.iter().map(|inlet| Inlet { inlet: inlet.clone(), links: None }).collect();
        Self { all, mouths: Vec::new() }
    }

    /// The mouths in a row.
    fn in_row(&self, slot: usize, first: usize) -> &[Mouth] {
        let from = self.mouths.partition_point(|mouth| mouth.cell < (slot, first));
        let to = self.mouths.partition_point(|mouth| mouth.cell < (slot, first + LANES));
        &self.mouths[from..to]
    }
}

impl Inlet {
    /// Volume in m3 through the whole face in the step that begins at `time`, if so much has already come.
    pub(crate) fn due(&self, time: f64, step: f64, whole: f64) -> f64 {
        let Self { inlet, .. } = self;
        let open = (time + step).min(inlet.stop) - time.max(inlet.start);
        (inlet.flow_rate * open.max(0.0)).min(inlet.volume - whole).max(0.0)
    }

    /// Way in m of its face at a time in s from where it is drawn.
    pub(crate) fn way(&self, time: f64) -> DVec3 {
        self.inlet.motion.offset(time)
    }

    /// Its face, so far from where it is drawn.
    pub(crate) fn face(&self, offset: DVec3) -> Face {
        Face { centre: self.inlet.face.centre + offset, ..self.inlet.face }
    }
}

impl<T: Real> Grid<T> {
    /// Opens the inlets for the step of the length `step` that begins at `time`, both in s; `before` has come in by then.
    pub(crate) fn open_inlets(&mut self, time: f64, step: f64, before: &[Inflow]) {
        self.inlets.mouths.clear();
        for n in 0..self.inlets.all.len() {
            let inlet = &self.inlets.all[n];
            let due = inlet.due(time, step, before[n].whole);
            if due > 0.0 {
                let offset = inlet.inlet.motion.offset(time);
                self.find_links(n, offset, time);
                self.open(n, due);
            }
        }
        self.inlets.mouths.sort_by_key(|mouth| mouth.cell);
    }

    /// What comes in during the step that begins at `time`, in m3.
    pub(crate) fn inflow(&self, time: f64, step: f64, before: &[Inflow]) -> Vec<Inflow> {
        let cell = self.solids.size().powi(3);
        let one = |(n, inlet): (usize, &Inlet)| {
            let mouths = self.inlets.mouths.iter().filter(|mouth| mouth.inlet == n);
            let volume = mouths.clone().map(Mouth::volume).sum::<f64>() * cell;
            let open = mouths.count() > 0;
            Inflow { whole: if open { inlet.due(time, step, before[n].whole) } else { 0.0 }, volume }
        };
        self.inlets.all.iter().enumerate().map(one).collect()
    }

    /// Finds the links across the face of an inlet, if it has moved since.
    fn find_links(&mut self, n: usize, offset: DVec3, time: f64) {
        let inlet = &self.inlets.all[n];
        if inlet.links.as_ref().is_some_and(|links| links.offset == offset) {
            return;
        }
        let size = self.solids.size();
        let (face, plate) = plate(inlet.face(offset), size);
        let direction = face.direction;
        let (min, max) = face.bounds(0.0);
        // Cells around the face, two to each side.
        let place = |p: DVec3, a: usize| ((p - self.solids.corner())[a] / size).floor();
        let from = [0, 1, 2].map(|a| (place(min, a) - 2.0).max(0.0) as usize);
        let to = [0, 1, 2].map(|a| (place(max, a) + 3.0).clamp(0.0, self.topology.cells[a] as f64) as usize);
        let mut cells = Vec::new();
        for z in from[2]..to[2] {
            for y in from[1]..to[1] {
                for x in from[0]..to[0] {
                    let at = [x, y, z];
                    let height = (self.solids.centre(at) - face.centre).dot(direction) / size;
                    if height <= 0.0 || height >= THICKNESS {
                        continue;
                    }
                    let out = |i: &usize| {
                        DVec3::from(C[*i].map(f64::from)).dot(direction) > 1e-9
                            && (self.topology.reached(at, C[*i].map(|c| -c)))
                                .is_some_and(|from| plate.signed_distance(self.solids.centre(from)) < 0.0)
                    };
                    let links = (1..Q).filter(out).fold(0, |bits, i| bits | 1u32 << i);
                    if links != 0 {
                        cells.push((at, links));
                    }
                }
            }
        }
        // Blocks for what comes, and to see the plate from there.
        for z in from[2] / EDGE..to[2].div_ceil(EDGE) {
            for y in from[1] / EDGE..to[1].div_ceil(EDGE) {
                for x in from[0] / EDGE..to[0].div_ceil(EDGE) {
                    self.allocate([x, y, z]);
                }
            }
        }
        self.mark_solids(time);
        let upper = DVec3::from(self.topology.cells.map(|n| n as f64)) * size;
        let share = face.share_within(self.solids.corner(), self.solids.corner() + upper);
        self.inlets.all[n].links = Some(Links { offset, share, cells });
    }

    /// Opens an inlet for a volume in m3 through its whole face.
    fn open(&mut self, n: usize, due: f64) {
        let inlet = &self.inlets.all[n];
        let Some(links) = &inlet.links else { return };
        let direction = inlet.inlet.face.direction;
        let mut mouths = Vec::new();
        let mut weight = 0.0;
        for &(at, links) in &links.cells {
            let slot = self.slot_at(at);
            let cell = (slot as usize, self.topology.cell_at(at));
            if slot == AIR || self.is_solid(cell) {
                continue;
            }
            let mouth = Mouth { cell, inlet: n, links, velocity: direction };
            weight += mouth.volume();
            mouths.push(mouth);
        }
        let volume = due * links.share / self.solids.size().powi(3);
        if weight < CLOSED {
            return;
        }
        let velocity = volume / weight * direction;
        for mouth in mouths {
            let (slot, cell) = mouth.cell;
            if self.is_air(mouth.cell) {
                self.set_populations(mouth.cell, &equilibrium(0.0, velocity.to_array()));
                self.begin_borne(&[mouth.cell]);
                self.set_interface(mouth.cell, 0.0, T::ZERO);
            }
            self.allocate_around(slot, cell);
            self.inlets.mouths.push(Mouth { velocity, ..mouth });
        }
    }

    /// The mass in cells that each mouth gave off in the last step, which began with the populations `before`.
    pub(crate) fn poured(&self, before: &[Box<Field<T>>]) -> Vec<(Cell, usize, f64)> {
        let mass = |mouth: &Mouth| {
            let (slot, cell) = mouth.cell;
            let f: [T; Q] = std::array::from_fn(|i| before[slot][(i, cell)]);
            (mouth.cell, mouth.inlet, (1.0 + density_and_momentum(&f).0) * mouth.volume())
        };
        self.inlets.mouths.iter().map(mass).collect()
    }
}

impl<T: Real> Source<'_, T> {
    /// Adds what comes in to the populations that arrive in a row, to the mass of its interface cells, and to what these gain.
    #[inline(never)]
    pub(crate) fn pour(
        &self,
        row: &SurfaceRow,
        first: usize,
        f: &mut [Lanes<T>; Q],
        mass: &mut [f64; CELLS],
        gain: &mut [f64; LANES],
    ) {
        for mouth in self.inlets.in_row(self.slot, first) {
            let cell = mouth.cell.1;
            let k = cell - first;
            let leaving: [T; Q] = std::array::from_fn(|i| self.own[(i, cell)]);
            let density = 1.0 + density_and_momentum(&leaving).0;
            for i in each(mouth.links) {
                f[i].0[k] += T::from_f64(density * brought(i, mouth.velocity));
            }
            if row.kinds.interface >> k & 1 == 1 {
                let poured = density * mouth.volume();
                mass[cell] += poured;
                gain[k] += poured;
            }
        }
    }
}
