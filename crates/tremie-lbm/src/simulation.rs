//! The method as a [`Simulation`]: one step, in the order in which things happen.

use bytemuck::cast_slice;
use tremie_case::{Case, Inlet, Precision, Side, Stepping, Surface};
use tremie_numerics::DVec3;
use tremie_output::state::{Array, State};
use tremie_simulation::{Breakdown, Load, RestoreError, Simulation, Snapshot};
use tremie_suspension::Suspension;

use crate::adapt::{INTERVAL, Look, Watch};
use crate::cage::Cages;
use crate::carried::Carried;
use crate::carrier::{Lattice, Sides};
use crate::collision::nearly_inviscid;
use crate::fibre_field::FibreField;
use crate::fluid::Fluid;
use crate::friction::Friction;
use crate::grid::{Grid, Kinds};
use crate::immersed::Immersed;
use crate::initial::{centre, region_at};
use crate::inlet::{Inflow, Inlets};
use crate::lattice::Q;
use crate::outlet::{Amount, outlets};
use crate::passage::Passage;
use crate::plan::{Plan, confined_gravity, settings, speed_of_first_fall};
use crate::plate::Plate;
use crate::real::Real;
use crate::rows::Rows;
use crate::scaling::{Limits, Scaling};
use crate::solids::Solids;
use crate::spread::order_of_axes;
use crate::standing::Braking;
use crate::stream::Findings;
use crate::structure::STRUCTURE;
use crate::surface::Ledger;
use crate::tension::Tension;
use crate::textbook;
use crate::topology::{Boundary, CELLS, EDGE, Topology};

/// Steps between looks for crumbs, for dry blocks, and for mass lost to rounding.
const CRUMBS: u64 = 32;
const DRY: u64 = 256;
const REPAY: u64 = 1000;
/// Steps between looks at the volume, and the share of what it has gained or lost by pressure that is given back then. (All of it at once would be heard.)
const KEEP: u64 = 100;
const KEPT: f64 = 0.2;
/// Steps after which bodies are sorted by where they are.
const SORT: u64 = 100;
/// Steps between looks at the level below inlets that stay above it.
const LOOK: u64 = 32;
/// Share of what solids hold by their motion beside what they should that is given back whenever crumbs are looked for.
const SETTLED: f64 = 0.1;

/// A case made ready to run by the lattice Boltzmann method, by the scheme and in the precision that it asks for.
pub fn simulation(case: &Case) -> Box<dyn Simulation> {
    match settings(case).textbook() {
        Some(textbook) => textbook::simulation(case, textbook),
        None => {
            let bodies = case.has_bodies();
            let following = &case.following;
            simulation_with(
                case,
                bodies.then(|| {
                    let (origin, periods) = (case.domain.min, case.periods());
                    let bodies = case.inclusions.clone();
                    Suspension::new(bodies, following.method, following.contact, origin, periods)
                }),
            )
        }
    }
}

/// The same with these bodies in it. (The schemes of the textbooks carry none.)
pub fn simulation_with(case: &Case, suspension: Option<Suspension>) -> Box<dyn Simulation> {
    with(case, suspension)
}

/// A lattice Boltzmann simulation that tells what it has of every kilogram.
pub trait LatticeBoltzmann: Simulation {
    /// Mass of the fluid in kg.
    fn mass(&self) -> f64;

    /// Mass in kg that has come in, that has left, and that was added so that the fluid keeps its volume, since the start.
    fn passed(&self) -> [f64; 3];

    /// Mass in kg of each batch that is followed.
    fn batches(&self) -> Vec<f64>;

    /// Mass in kg of each of them that has left.
    fn batches_out(&self) -> Vec<f64>;
}

/// The fluid of the case at time zero, in its precision, without bodies.
pub fn lattice_boltzmann(case: &Case) -> Box<dyn LatticeBoltzmann> {
    with(case, None)
}

/// The one place where the kernels are made for each precision: whoever uses this crate need not compile them again.
fn with(case: &Case, suspension: Option<Suspension>) -> Box<dyn LatticeBoltzmann> {
    match settings(case).precision {
        Precision::F32 => Box::new(FreeSurface::<f32>::new(case, suspension)),
        Precision::F64 => Box::new(FreeSurface::<f64>::new(case, suspension)),
    }
}

/// Free-surface lattice Boltzmann.
pub(crate) struct FreeSurface<T: Real> {
    pub(crate) case: Case,
    pub(crate) scaling: Scaling,
    pub(crate) fluid: Fluid<T>,
    pub(crate) grid: Grid<T>,
    pub(crate) rows: Vec<Rows>,
    findings: Vec<Findings>,
    pub(crate) ledger: Ledger,
    /// What swims in it.
    pub(crate) suspension: Option<Suspension>,
    /// The bodies that come in and leave.
    pub(crate) passage: Passage,
    /// How fibres lie that are too many to be bodies.
    pub(crate) fibres: Option<FibreField>,
    /// The solid that a load moves.
    pub(crate) plate: Option<Plate>,
    /// What has come in, by inlet.
    pub(crate) inflow: Vec<Inflow>,
    /// Mass at the start, or when the time step last changed, with what has come in and left since, which rounding is held against.
    mass: f64,
    /// Volume that the case gave the fluid at the start, in cells.
    volume: f64,
    /// Simulated time in s.
    time: f64,
    steps: u64,
    /// Simulated time in s up to which the structure of the fluid is known.
    structured: f64,
    /// What the length of the next time step is judged by.
    watch: Watch,
    updates: u64,
}

fn topology(case: &Case, scaling: &Scaling) -> Topology {
    let side = |n: usize| match case.domain.sides[n] {
        // Without friction the flow goes on mirrored, whatever the wall does.
        Side::Wall { surface: Surface::FreeSlip, .. } => Boundary::Symmetry,
        Side::Wall { velocity, .. } => Boundary::Wall(velocity.to_array().map(|u| scaling.velocity(u))),
        Side::Symmetry => Boundary::Symmetry,
        Side::Periodic => Boundary::Periodic,
        Side::Open => Boundary::Open,
    };
    let sides = [[side(0), side(1)], [side(2), side(3)], [side(4), side(5)]];
    let friction = |n: usize| match case.domain.sides[n] {
        Side::Wall { surface, .. } => Friction::new(surface, scaling),
        _ => None,
    };
    let frictions = [[friction(0), friction(1)], [friction(2), friction(3)], [friction(4), friction(5)]];
    let cells = case.domain.cells(scaling.cell_size);
    Topology { frictions, outlets: outlets(case, cells, scaling.cell_size), ..Topology::new(cells, sides) }
}

/// A grid without fluid.
fn grid<T: Real>(case: &Case, scaling: &Scaling, immersed: bool) -> Grid<T> {
    let batches = case.batches();
    let share = |batch: &Option<String>, of: &str| f64::from(u8::from(batch.as_deref() == Some(of)));
    let inflow = |inlet: &Inlet| {
        let shares = batches.iter().map(|of| share(&inlet.batch, of));
        shares.chain(case.structure(inlet.structure)).collect()
    };
    let structured = case.material.thixotropy.is_some();
    let whole =
        case.fluid.iter().all(|of| of.batch.is_some()) && case.inlets.iter().all(|of| of.batch.is_some());
    let carried = Carried::new(batches.len(), whole, structured, case.inlets.iter().map(inflow).collect());
    let immersed = Immersed::new(immersed);
    let (solids, inlets, cages) = (Solids::new(case, scaling), Inlets::new(case), Cages::new(case, scaling));
    let tension = Tension::new(case, scaling);
    Grid::new(topology(case, scaling), solids, inlets, carried, immersed, cages, tension)
}

/// What drives and resists, for a length of the time step.
fn fluid<T: Real>(case: &Case, scaling: &Scaling) -> Fluid<T> {
    Fluid::new(&case.material, case.domain.gravity.to_array(), settings(case).bulk_relaxation, scaling)
}

impl<T: Real> FreeSurface<T> {
    /// The case at time zero, with bodies in it.
    pub(crate) fn new(case: &Case, mut suspension: Option<Suspension>) -> Self {
        let passage = suspension.as_mut().map(|suspension| Passage::new(case, &mut suspension.inclusions));
        let scaling = Plan::new(case).scaling;
        let immersed = suspension.is_some();
        let mut new = Self {
            case: case.clone(),
            grid: grid(case, &scaling, immersed),
            scaling,
            fluid: fluid(case, &scaling),
            rows: Vec::new(),
            findings: Vec::new(),
            ledger: Ledger { drained_of: vec![Amount::default(); case.batches().len()], ..Ledger::default() },
            suspension,
            passage: passage.unwrap_or_default(),
            fibres: FibreField::new(case),
            plate: Plate::new(case),
            inflow: vec![Inflow::default(); case.inlets.len()],
            mass: 0.0,
            volume: 0.0,
            time: 0.0,
            steps: 0,
            structured: 0.0,
            watch: Watch::default(),
            updates: 0,
        };
        new.fill();
        if !new.stand() {
            new.grid = grid(case, &new.scaling, immersed);
            new.fill();
            new.rows.clear();
        }
        // The fluid has the mass that the case gives it, although the method presses it together a little: what the
        // pressure adds to the density, the surface gives back. Or, where it keeps its volume, that.
        if !new.keeps_volume() {
            let excess = new.grid.total_mass() - new.grid.volume();
            new.grid.spread_mass(-excess);
        }
        new.ledger.swept = new.grid.left_by_walls();
        new.mass = new.lattice_mass();
        new.volume = new.grid.volume() + new.ledger.swept;
        new.begin_carried();
        new.arrange();
        new.begin_immersed();
        if let Some(fibres) = &mut new.fibres {
            fibres.begin(&new.grid);
        }
        new
    }

    /// Puts the fluid of the case into an empty grid, with what it carries.
    fn fill(&mut self) {
        self.grid.fill(&self.case, &self.scaling);
        self.begin_carried();
    }

    /// Lets the bodies see the fluid of the first state.
    fn begin_immersed(&mut self) {
        let Self { fluid, grid, rows, suspension, .. } = self;
        if suspension.is_none() {
            return;
        }
        for slot in grid.slots().collect::<Vec<_>>() {
            let mut seen = std::mem::take(&mut grid.immersed.seen[slot]);
            if let Some(seen) = &mut seen {
                fluid.moments(grid, slot, &rows[slot], None, |cell, m, _| {
                    let [x, y, z] = m.velocity.map(|u| u * m.fill);
                    seen.cells_mut()[cell] = [x, y, z, m.fill];
                });
            }
            grid.immersed.seen[slot] = seen;
        }
    }

    /// Moves the bodies on by a step, and lets the fluid feel them in its own.
    fn carry_bodies(&mut self) {
        let Some(suspension) = &mut self.suspension else { return };
        if self.steps.is_multiple_of(SORT) {
            let axes = order_of_axes(&self.grid.topology);
            suspension.inclusions.sort(EDGE as f64 * self.scaling.cell_size, axes);
        }
        self.grid.look();
        let mut lattice = Lattice {
            grid: &mut self.grid,
            scaling: &self.scaling,
            corner: self.case.domain.min,
            gravity: self.case.domain.gravity,
            curve: &self.case.material.curve,
        };
        // What is seen and pushed has nothing to do with solids.
        let (topology, solids) = (lattice.grid.topology.clone(), std::mem::take(&mut lattice.grid.solids));
        let unit = self.scaling.velocity_unit();
        suspension.step(&mut lattice, &Sides::new(&topology, &solids, unit));
        self.grid.solids = solids;
    }

    /// Takes out the bodies that have come to where fluid leaves, and lets in those that are due.
    fn pass_bodies(&mut self) {
        let Self { case, suspension, passage, grid, scaling, .. } = self;
        if let Some(Suspension { inclusions, .. }) = suspension {
            passage.drain(inclusions, grid);
            passage.let_in(inclusions, grid, scaling, self.time, case, &self.inflow);
        }
    }

    /// Lets the load move its solid through the coming step, as fast as the fluid lets it.
    fn drive(&mut self) {
        let Some(plate) = &mut self.plate else { return };
        plate.accelerate(&self.grid, &self.rows, &self.scaling);
        self.grid.solids.send(plate.loaded.solid, plate.motion(self.time));
        self.grid.solids.place(self.time, &self.scaling);
        plate.way += plate.speed * self.scaling.time_step;
    }

    /// Gives the fluid what it carries at the start.
    fn begin_carried(&mut self) {
        let Self { case, scaling, grid, .. } = self;
        let batches = case.batches();
        grid.begin_carried(|at| {
            let region = region_at(case, centre(case, scaling.cell_size, at));
            let batch = region.and_then(|region| region.batch.as_deref());
            let shares = batches.iter().map(|of| f64::from(u8::from(batch == Some(*of))));
            shares.chain(case.structure(region.and_then(|region| region.structure))).collect()
        });
    }

    /// Finds stresses in which the fluid stands (module `standing`). Says whether the grid is fit to start from.
    fn stand(&mut self) -> bool {
        let flows = self.case.fluid.iter().any(|region| region.velocity.length() > 0.0);
        let gravity = confined_gravity(&self.case).abs().max_element();
        let braking = Braking::new(
            self.grid.largest_pressure(),
            self.scaling.acceleration(gravity),
            self.scaling.stress(self.largest_yield_stress()),
        );
        // A mould holds the fluid: its pressure is the right start. Where it can leave, it does not stand.
        let held = self.grid.topology.moving_walls() || self.grid.solids.any() || self.case.has_outlets();
        let Some(braking) = braking.filter(|_| !flows && !held) else {
            return true;
        };
        let held = self.grid.held();
        for _ in 0..braking.patience {
            for _ in 0..braking.crossing {
                self.arrange();
                self.fluid.step(&mut self.grid, &self.rows, None, &mut self.findings);
                self.grid.brake(&held, self.fluid.gravity().map(T::to_f64), &braking);
            }
            self.arrange();
            if self.fastest() < braking.rest {
                self.grid.put_back(&held);
                return true;
            }
        }
        false
    }

    /// Yield stress in Pa of the stiffest fluid at the start.
    fn largest_yield_stress(&self) -> f64 {
        let structures = self.case.fluid.iter().filter_map(|region| self.case.structure(region.structure));
        self.case.material.curve.yield_stress() * (1.0 + structures.fold(0.0, f64::max))
    }

    /// Largest speed in lattice units.
    fn fastest(&self) -> f64 {
        let mut fastest = 0.0f64;
        for slot in self.grid.slots() {
            self.fluid.moments(&self.grid, slot, &self.rows[slot], None, |_, m, _| {
                let square: f64 = m.velocity.iter().map(|u| u.to_f64().powi(2)).sum();
                fastest = fastest.max(square.sqrt());
            });
        }
        fastest
    }

    /// Mass in cells, with what is on its way.
    fn lattice_mass(&self) -> f64 {
        self.grid.total_mass() + self.ledger.waiting + self.ledger.swept
    }

    /// Volume in cells that the fluid should have.
    fn due_volume(&self) -> f64 {
        let cell = self.scaling.cell_size.powi(3);
        self.volume + self.inflow.iter().map(|inflow| inflow.volume / cell).sum::<f64>()
            - self.ledger.drained.volume
    }

    /// Whether the fluid keeps its volume, and not its mass: with each other step it is pressed together by another share, what comes in on top, or a plate, presses together what
    /// lies below, and what a gate or a mould has held up is pressed less once it is let go.
    fn keeps_volume(&self) -> bool {
        let adapts = settings(&self.case).stepping == Stepping::Adaptive;
        adapts || !self.case.inlets.is_empty() || self.grid.solids.any_moves()
    }

    /// Gives back to the interface a share of what it lost of the fluid's volume by pressure, or takes what it gained, and says how much that was.
    fn keep_volume(&mut self, share: f64) {
        let gained = share * (self.grid.volume() + self.ledger.swept - self.due_volume());
        if self.grid.spread_mass(-gained) {
            self.ledger.pressed -= gained;
            self.mass -= gained;
        }
    }

    /// Gives back to the interface what rounding took, or takes what it gave.
    fn repay(&mut self) {
        let missing = self.mass - (self.grid.total_mass() + self.ledger.swept);
        if missing != 0.0 && self.grid.spread_mass(missing) {
            self.ledger.waiting = 0.0;
        }
    }

    /// Gives back to the interface some of what solids hold by their motion beside the parts of cells that they leave, and all of it once liquid and solids have parted.
    fn settle(&mut self) {
        let beside = self.ledger.swept - self.grid.left_by_walls();
        if beside == 0.0 {
            return;
        }
        let share = if self.grid.solids_touch_liquid() { SETTLED } else { 1.0 };
        let mass = share * beside;
        if self.grid.spread_mass(mass) {
            self.ledger.swept -= mass;
        }
    }

    /// How many times as long the time step should be after the coming step, if it should change (module `adapt`).
    fn change_of_step(&mut self) -> Option<f64> {
        let lbm = settings(&self.case);
        if lbm.stepping == Stepping::Fixed || !self.steps.is_multiple_of(INTERVAL) {
            return None;
        }
        let limits = Limits {
            lattice_viscosity: lbm.lattice_viscosity,
            lattice_speed: lbm.lattice_speed,
            hydrostatic_error: lbm.hydrostatic_error,
        };
        let gravity = confined_gravity(&self.case);
        // What a load presses flows as if it fell.
        let pressed = self.plate.map_or(DVec3::ZERO, |plate| plate.acceleration(self.mass()));
        let (axis, falling) = ((gravity + pressed).abs().max_position(), (gravity + pressed).length());
        let (gravity, height) = (gravity.length(), self.grid.height(axis) as f64 * self.scaling.cell_size);
        let common = self.grid.common(self.fluid.gravity());
        let soon = self.time + INTERVAL as f64 * self.scaling.time_step;
        let mut speed = common.speed.max(self.scaling.velocity(self.solid_speed()));
        if let Some(first) = speed_of_first_fall(&self.case, self.time, soon) {
            speed = speed.max(common.energetic_speed).max(self.scaling.velocity(first));
        }
        // What stands as high as anything, or less.
        let hydrostatic_error = self.scaling.hydrostatic_error(gravity, height).min(common.excess);
        let look = Look {
            time: self.time,
            speed,
            hydrostatic_error: hydrostatic_error
                + self.scaling.capillary_error(self.case.material.surface_tension)
                + 3.0 * self.plate.map_or(0.0, |plate| plate.pressure),
            viscosity: self.scaling.viscosity(self.case.material.curve.plastic_viscosity()),
            fall: (2.0 * height / falling).sqrt(),
        };
        self.watch.change(&look, self.scaling.velocity_unit(), &limits)
    }

    /// Largest speed in m/s of solids from now on.
    fn solid_speed(&self) -> f64 {
        self.grid.solids.largest_speed(self.time, self.case.stop.time, self.case.domain.max)
    }

    /// Takes the new time step into use, once the populations are in its units.
    fn change_step(&mut self, factor: f64) {
        self.scaling.time_step *= factor;
        self.fluid = fluid(&self.case, &self.scaling);
        self.grid.topology = topology(&self.case, &self.scaling);
        self.grid.cages.rescale(&self.scaling);
        if let Some(tension) = &mut self.grid.tension {
            tension.rescale(&self.scaling);
        }
        self.grid.solids.rescale(&self.scaling);
        self.grid.reweigh();
    }

    /// Finds rows and surface as the cells are now: the next step needs them, and so does a snapshot.
    fn arrange(&mut self) {
        self.grid.solids.place(self.time, &self.scaling);
        let interface = |kinds: &Kinds| kinds.interface != 0;
        self.grid.open_inlets(self.time, self.scaling.time_step, &self.inflow);
        self.grid.solids.air = self.grid.solids.any() && self.grid.kinds.iter().flatten().any(interface);
        self.grid.arrange(&mut self.rows, self.fluid.gravity());
        self.grid.bend(&self.rows);
    }

    /// Counts what came in and left in the step that has just been taken.
    fn pass(&mut self) {
        let step = self.scaling.time_step;
        let more = self.grid.inflow(self.time, step, &self.inflow);
        for (inflow, more) in self.inflow.iter_mut().zip(more) {
            inflow.whole += more.whole;
            inflow.volume += more.volume;
        }
        // What the step began with is where the next will write.
        let poured = self.grid.poured(&self.grid.back);
        self.grid.carry(&self.rows, &poured);
        if let Some(fibres) = &mut self.fibres {
            for &(cell, _, mass) in &poured {
                let all = if self.grid.is_liquid(cell) { 1.0 } else { self.grid.mass[cell.0][cell.1] };
                fibres.pour(cell, (mass / all.max(mass)).clamp(0.0, 1.0));
            }
        }
        let poured: f64 = poured.iter().map(|(_, _, mass)| mass).sum();
        let batches = self.ledger.drained_of.len();
        let out = self.grid.drain(batches);
        self.ledger.poured += poured;
        let drained = std::iter::once(&mut self.ledger.drained).chain(&mut self.ledger.drained_of);
        for (drained, out) in drained.zip(&out) {
            drained.mass += out.mass;
            drained.volume += out.volume;
        }
        self.mass += poured - out[0].mass;
    }

    /// Lets the fluid build up structure and lose it by shear.
    fn restructure(&mut self) {
        let Some(thixotropy) = self.case.material.thixotropy else { return };
        let unit = 1.0 / self.scaling.time_step;
        let duration = self.time - self.structured;
        self.fluid.restructure(&mut self.grid, &self.rows, |structure, rate| {
            thixotropy.after(structure, rate * unit, duration)
        });
        self.structured = self.time;
    }

    /// Lets the flow carry and turn the fibres that are a field.
    fn turn_fibres(&mut self) {
        let Self { fibres, grid, fluid, rows, steps, time, scaling, .. } = self;
        if let Some(fibres) = fibres {
            fibres.follow(grid, fluid, rows, *steps, *time, scaling.time_step);
        }
    }

    fn breakdown(&self, slot: usize, cell: usize) -> Breakdown {
        let position = centre(&self.case, self.scaling.cell_size, self.grid.links[slot].coordinates(cell));
        let viscosity = self.scaling.viscosity(self.case.material.curve.plastic_viscosity());
        let slow = self.grid.common(self.fluid.gravity()).speed < settings(&self.case).lattice_speed;
        let advice = if slow && nearly_inviscid(viscosity) {
            format!(
                "the fluid is thin for such cells (lattice viscosity {viscosity:.4}); set smaller cells, \
                 and let it stick to walls along which it slides; smaller steps do not help"
            )
        } else {
            "the flow is too fast or too stiff for the time step; \
             set a smaller `time_step` or `lattice_speed` under [lbm], or smaller cells"
                .into()
        };
        let what = "the density there is no longer near 1 in lattice units".into();
        Breakdown { time: self.time(), position, what, advice }
    }

    /// What the numbers of a saved state are checked against.
    fn identity(&self) -> String {
        format!(
            "lbm in {} with {:?} cells of {} m and a first step of {:e} s",
            T::NAME,
            self.grid.topology.cells,
            self.scaling.cell_size,
            Plan::new(&self.case).scaling.time_step
        )
    }
}

impl<T: Real> LatticeBoltzmann for FreeSurface<T> {
    fn mass(&self) -> f64 {
        self.lattice_mass() * self.scaling.density * self.scaling.cell_size.powi(3)
    }

    fn passed(&self) -> [f64; 3] {
        let unit = self.scaling.density * self.scaling.cell_size.powi(3);
        [self.ledger.poured, self.ledger.drained.mass, self.ledger.pressed].map(|mass| mass * unit)
    }

    fn batches(&self) -> Vec<f64> {
        let unit = self.scaling.density * self.scaling.cell_size.powi(3);
        (0..self.case.batches().len()).map(|batch| self.grid.carried_amount(batch) * unit).collect()
    }

    fn batches_out(&self) -> Vec<f64> {
        let unit = self.scaling.density * self.scaling.cell_size.powi(3);
        self.ledger.drained_of.iter().map(|out| out.mass * unit).collect()
    }
}

impl<T: Real> Simulation for FreeSurface<T> {
    fn time(&self) -> f64 {
        self.time
    }

    fn time_step(&self) -> f64 {
        self.scaling.time_step
    }

    fn advance(&mut self) -> Result<(), Breakdown> {
        let change = self.change_of_step();
        if self.grid.solids.any() {
            self.grid.even_stores(&self.rows);
        }
        self.carry_bodies();
        self.drive();
        self.fluid.step(&mut self.grid, &self.rows, change.map(T::from_f64), &mut self.findings);
        self.pass();
        self.time += self.scaling.time_step;
        self.steps += 1;
        self.updates += self.grid.wet as u64;
        for slot in self.grid.slots() {
            if let Some(cell) = self.findings[slot].broken {
                return Err(self.breakdown(slot, cell));
            }
        }
        if let Some(factor) = change {
            self.change_step(factor);
        }
        self.grid.convert(&self.findings, &mut self.ledger);
        if change.is_some() {
            // The fluid is pressed together by another share from now on: it keeps its volume, not its mass, and gets back what
            // it gained or lost of it since pressures changed.
            self.ledger.pressed += self.lattice_mass() - self.mass;
            self.mass = self.lattice_mass();
            self.keep_volume(1.0);
        }
        for slot in self.grid.slots() {
            self.ledger.swept += self.findings.get(slot).map_or(0.0, |found| found.swept);
        }
        self.grid.solids.place(self.time, &self.scaling);
        self.grid.sweep(self.time, &mut self.ledger);
        if self.steps.is_multiple_of(CRUMBS) {
            self.grid.remove_crumbs(self.fluid.gravity(), &mut self.ledger);
            self.settle();
        }
        if self.steps.is_multiple_of(DRY) {
            self.grid.release_dry();
        }
        if self.steps.is_multiple_of(REPAY) {
            self.repay();
        }
        if self.steps.is_multiple_of(KEEP) && self.keeps_volume() {
            self.keep_volume(KEPT);
        }
        self.grid.find_values();
        if self.steps.is_multiple_of(LOOK) && self.case.pours(self.time) {
            self.grid.raise_inlets(self.time, LOOK as f64 * self.scaling.time_step);
        }
        self.arrange();
        self.pass_bodies();
        if self.steps.is_multiple_of(STRUCTURE) {
            self.restructure();
        }
        self.turn_fibres();
        Ok(())
    }

    fn see(&self, snapshot: &mut Snapshot) {
        self.show(snapshot);
    }

    fn load(&self) -> Load {
        let blocks = self.grid.slots().count();
        Load {
            wet: self.grid.wet,
            allocated: blocks * CELLS,
            bytes: self.grid.bytes() + self.fibres.as_ref().map_or(0, FibreField::bytes),
            updates: self.updates,
            iterations: [0; 2],
        }
    }

    fn save(&self) -> State {
        let (places, free) = self.grid.layout();
        let (mut fields, mut mass, mut kinds) = (Vec::<T>::new(), Vec::<f64>::new(), Vec::<u8>::new());
        let (mut carried, mut immersed) = (Vec::<f64>::new(), Vec::<T>::new());
        for slot in self.grid.slots() {
            // Where a cell has no such value, something is left over that means nothing; as zero it takes no room, and
            // the same moment of the same run gives the same file.
            let kinds_of = &self.grid.kinds[slot];
            let field = &self.grid.front[slot];
            let wet = |cell: usize| kinds_of[cell / EDGE].wet() >> (cell % EDGE) & 1 == 1;
            for number in 0..Q {
                fields.extend((0..CELLS).map(|cell| if wet(cell) { field[(number, cell)] } else { T::ZERO }));
            }
            let fill = &self.grid.fills[slot];
            fields.extend((0..CELLS).map(|cell| if wet(cell) { fill[(0, cell)] } else { T::ZERO }));
            let borne = &self.grid.borne[slot];
            let interface = |cell: usize| kinds_of[cell / EDGE].interface >> (cell % EDGE) & 1 == 1;
            fields.extend((0..CELLS).map(|cell| if interface(cell) { borne[(0, cell)] } else { T::ONE }));
            mass.extend_from_slice(&*self.grid.mass[slot]);
            kinds.extend_from_slice(cast_slice(&self.grid.kinds[slot]));
            carried.extend(self.grid.carried.saved(slot, wet));
            immersed.extend(self.grid.immersed.saved(slot, wet));
        }
        let mut header = serde_json::json!({
            "for": self.identity(),
            "steps": self.steps,
            "time": self.time,
            "structured": self.structured,
            "time_step": self.scaling.time_step,
            "speeds": self.watch.seen,
            "mass": self.mass,
            "waiting": self.ledger.waiting,
            "stranded": self.ledger.stranded,
            "swept": self.ledger.swept,
            "poured": self.ledger.poured,
            "pressed": self.ledger.pressed,
            "drained": std::iter::once(&self.ledger.drained).chain(&self.ledger.drained_of)
                .map(|out| [out.mass, out.volume]).collect::<Vec<_>>(),
            "rises": self.grid.rises(),
            "plate": self.plate.map(|plate| [plate.way, plate.speed]),
            "inflow": self.inflow.iter().map(|inflow| [inflow.whole, inflow.volume]).collect::<Vec<_>>(),
            "bodies": self.suspension.as_ref().map(|suspension| self.passage.counts(&suspension.inclusions)),
        });
        let mut arrays = vec![
            ("places".into(), Array::U32(places)),
            ("free".into(), Array::U32(free)),
            ("fields".into(), T::into_array(fields)),
            ("mass".into(), Array::F64(mass)),
            ("kinds".into(), Array::U8(kinds)),
            ("carried".into(), Array::F64(carried)),
        ];
        if let Some(suspension) = &self.suspension {
            let (numbers, labels) = suspension.inclusions.saved();
            arrays.push(("immersed".into(), T::into_array(immersed)));
            arrays.push(("inclusions".into(), Array::F64(numbers)));
            arrays.push(("labels".into(), Array::U32(labels)));
            let (forces, touching) = suspension.saved_contacts();
            arrays.push(("forces at contacts".into(), Array::F64(forces)));
            arrays.push(("contacts".into(), Array::U32(touching)));
        }
        if let Some(fibres) = &self.fibres {
            let (tensors, when) = fibres.saved(&self.grid);
            arrays.push(("fibre field".into(), Array::F64(tensors)));
            header["fibre field"] = serde_json::json!(when);
        }
        State { header, arrays }
    }

    fn restore(&mut self, state: &State) -> Result<(), RestoreError> {
        let missing = |name: &str| RestoreError::Array(name.into());
        let found = state.header["for"].as_str().unwrap_or("another program").to_owned();
        if found != self.identity() {
            return Err(RestoreError::Mismatch { expected: self.identity(), found });
        }
        let array = |name: &str| {
            state.arrays.iter().find(|(n, _)| n == name).map(|(_, array)| array).ok_or_else(|| missing(name))
        };
        let (Array::U32(places), Array::U32(free)) = (array("places")?, array("free")?) else {
            return Err(missing("places"));
        };
        let Array::F64(mass) = array("mass")? else { return Err(missing("mass")) };
        let Array::U8(kinds) = array("kinds")? else { return Err(missing("kinds")) };
        let fields = T::from_array(array("fields")?).ok_or_else(|| missing("fields"))?;
        let number = |name: &str| state.header[name].as_f64().ok_or_else(|| missing(name));
        let count = |name: &str| state.header[name].as_u64().ok_or_else(|| missing(name));

        let mut grid = self.grid.restored(places, free).ok_or_else(|| missing("places"))?;
        grid.solids.forget_all();
        let Array::F64(carried) = array("carried")? else { return Err(missing("carried")) };
        grid.load(fields, mass, kinds, carried).map_err(missing)?;
        if let Some(suspension) = &mut self.suspension {
            let immersed = T::from_array(array("immersed")?).ok_or_else(|| missing("immersed"))?;
            grid.load_immersed(immersed).ok_or_else(|| missing("immersed"))?;
            let (Array::F64(numbers), Array::U32(labels)) = (array("inclusions")?, array("labels")?) else {
                return Err(missing("inclusions"));
            };
            suspension.inclusions.load(numbers, labels).ok_or_else(|| missing("inclusions"))?;
            let (Array::F64(forces), Array::U32(touching)) =
                (array("forces at contacts")?, array("contacts")?)
            else {
                return Err(missing("contacts"));
            };
            suspension.load_contacts(forces, touching).ok_or_else(|| missing("contacts"))?;
            let counts =
                serde_json::from_value(state.header["bodies"].clone()).map_err(|_| missing("bodies"))?;
            self.passage.restore(counts, &mut suspension.inclusions).ok_or_else(|| missing("bodies"))?;
        }
        if let Some(fibres) = &mut self.fibres {
            let Array::F64(tensors) = array("fibre field")? else { return Err(missing("fibre field")) };
            let when = serde_json::from_value(state.header["fibre field"].clone())
                .map_err(|_| missing("fibre field"))?;
            fibres.load(&grid, tensors, when).ok_or_else(|| missing("fibre field"))?;
        }
        let rises = serde_json::from_value(state.header["rises"].clone()).map_err(|_| missing("rises"))?;
        grid.restore_rises(rises).ok_or_else(|| missing("rises"))?;
        let seen = serde_json::from_value(state.header["speeds"].clone()).map_err(|_| missing("speeds"))?;
        let (time, time_step) = (number("time")?, number("time_step")?);
        let pairs = |name: &str| -> Result<Vec<[f64; 2]>, RestoreError> {
            serde_json::from_value(state.header[name].clone()).map_err(|_| missing(name))
        };
        let drained = pairs("drained")?.into_iter().map(|[mass, volume]| Amount { mass, volume });
        let drained: Vec<Amount> = drained.collect();
        if drained.len() != 1 + self.ledger.drained_of.len() {
            return Err(missing("drained"));
        }
        let ledger = Ledger {
            stranded: count("stranded")?,
            waiting: number("waiting")?,
            swept: number("swept")?,
            poured: number("poured")?,
            drained: drained[0],
            drained_of: drained[1..].to_vec(),
            pressed: number("pressed")?,
        };
        let inflow: Vec<Inflow> =
            pairs("inflow")?.into_iter().map(|[whole, volume]| Inflow { whole, volume }).collect();
        if inflow.len() != self.inflow.len() {
            return Err(missing("inflow"));
        }
        (self.steps, self.mass, self.ledger) = (count("steps")?, number("mass")?, ledger);
        (self.time, self.watch, self.inflow) = (time, Watch { seen }, inflow);
        self.structured = number("structured")?;
        self.scaling.time_step = time_step;
        self.fluid = fluid(&self.case, &self.scaling);
        self.grid = grid;
        self.grid.topology = topology(&self.case, &self.scaling);
        self.grid.cages.rescale(&self.scaling);
        if let Some(tension) = &mut self.grid.tension {
            tension.rescale(&self.scaling);
        }
        self.grid.solids.rescale(&self.scaling);
        if let Some(plate) = &mut self.plate {
            [plate.way, plate.speed] =
                serde_json::from_value(state.header["plate"].clone()).map_err(|_| missing("plate"))?;
            self.grid.solids.send(plate.loaded.solid, plate.motion(time));
        }
        self.rows.clear();
        self.findings.clear();
        self.arrange();
        Ok(())
    }
}
