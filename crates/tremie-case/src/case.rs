//! The case as plain data, in SI units.

use std::path::Path;
use std::sync::Arc;

use tremie_geometry::mesh::ClosedMesh;
use tremie_geometry::{Body, Face, Motion, Shape};
use tremie_numerics::{DVec2, DVec3};
use tremie_rheology::bars::BarGrid;
use tremie_rheology::{FlowCurve, Thixotropy};
use tremie_suspension::Inclusions;

use crate::document::Document;
use crate::fault::{CaseError, Fault, InvalidCase};
use crate::fibre_field::FibreField;
use crate::inclusions::{self, Following, InclusionGroup, Incoming};
use crate::schema::SIDE_KEYS;
use crate::{check, schema};

/// What is to be computed: complete, checked, and free of contradictions.
#[derive(Debug, Clone, PartialEq)]
pub struct Case {
    /// What the user calls it.
    pub title: String,
    /// The fluid.
    pub material: Material,
    /// The box in which it flows.
    pub domain: Domain,
    /// Where the fluid is at the start; at least one region if there is no inlet. Regions may overlap each other and reach beyond
    /// the domain, outside of which they count for nothing.
    pub fluid: Vec<FluidRegion>,
    /// Where fluid comes in.
    pub inlets: Vec<Inlet>,
    /// Where fluid leaves, besides open sides.
    pub outlets: Vec<Outlet>,
    /// What stands or moves in the domain, the bars last. Solids may overlap each other and reach beyond the domain.
    pub solids: Vec<Solid>,
    /// Bodies that are in the fluid at the start, as the case file has them.
    pub groups: Vec<InclusionGroup>,
    /// The bodies themselves.
    pub inclusions: Inclusions,
    /// How they are followed.
    pub following: Following,
    /// Fibres too many to be followed.
    pub fibre_field: Option<FibreField>,
    /// Where bars stand that are too thin for the cells; cages may overlap each other and reach beyond the domain.
    pub cages: Vec<Cage>,
    /// The meshes that solids are made from, in the order in which the case names them.
    pub meshes: Vec<MeshFile>,
    /// All files that the case names.
    pub files: Vec<NamedFile>,
    /// How the flow is computed.
    pub method: Method,
    /// When the run ends.
    pub stop: Stop,
    /// What is measured during the run.
    pub gauges: Gauges,
    /// What is written during the run.
    pub output: Output,
    /// Where it was read from, for messages.
    pub name: String,
    /// The case file as read.
    pub text: String,
}

/// A fluid.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Material {
    /// Density in kg/m3, positive.
    pub density: f64,
    /// Flow curve, of positive viscosity.
    pub curve: FlowCurve,
    /// Whether its yield stress grows at rest; a Bingham fluid then.
    pub thixotropy: Option<Thixotropy>,
    /// The structure that it has at the start and where it comes in, if nothing else is said.
    pub structure: f64,
    /// Tension of its surface in N/m, zero or more.
    pub surface_tension: f64,
}

/// The axis-parallel box in which the fluid flows, and what drives it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Domain {
    /// Corner with the smallest coordinates, in m.
    pub min: DVec3,
    /// Corner with the largest coordinates, in m.
    pub max: DVec3,
    /// Body acceleration in m/s2.
    pub gravity: DVec3,
    /// What bounds the domain at x_min, x_max, y_min, y_max, z_min, z_max.
    pub sides: [Side; 6],
}

impl Domain {
    /// Whether a point in m lies in it.
    pub fn holds(&self, at: DVec3) -> bool {
        at.cmpge(self.min).all() && at.cmple(self.max).all()
    }

    /// The place of what is seen at a point in m beyond periodic sides and planes of symmetry: in the domain, but for what is seen in a single mirror from further away than its size.
    pub fn image(&self, mut at: DVec3) -> DVec3 {
        for axis in 0..3 {
            let (low, length) = (self.min[axis], self.max[axis] - self.min[axis]);
            let way = at[axis] - low;
            let inside = match [self.sides[2 * axis], self.sides[2 * axis + 1]] {
                [Side::Periodic, _] => way.rem_euclid(length),
                [Side::Symmetry, Side::Symmetry] => {
                    let folded = way.rem_euclid(2.0 * length);
                    folded.min(2.0 * length - folded)
                }
                [Side::Symmetry, _] => way.abs(),
                [_, Side::Symmetry] => length - (length - way).abs(),
                _ => way,
            };
            at[axis] = low + inside;
        }
        at
    }

    /// Number of cells along each axis for cells of edge `cell_size` in m.
    pub fn cells(&self, cell_size: f64) -> [usize; 3] {
        ((self.max - self.min) / cell_size).to_array().map(|n| n.round() as usize)
    }
}

/// One of the six sides of the domain.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Side {
    /// A wall.
    Wall {
        /// Velocity of the wall in m/s, within its own plane.
        velocity: DVec3,
        /// What it does to the fluid.
        surface: Surface,
    },
    /// A plane of symmetry.
    Symmetry,
    /// What leaves here enters on the opposite side, which is periodic too.
    Periodic,
    /// Fluid that gets here leaves, into air.
    Open,
}

impl Side {
    /// A wall at rest to which the fluid sticks.
    pub const REST: Self = Self::Wall { velocity: DVec3::ZERO, surface: Surface::NoSlip };
}

/// Fluid at the start of the run.
#[derive(Debug, Clone, PartialEq)]
pub struct FluidRegion {
    /// Where it is.
    pub shape: Shape,
    /// How it moves, in m/s.
    pub velocity: DVec3,
    /// The batch that it belongs to, if it is to be followed.
    pub batch: Option<String>,
    /// The structure that it has, if another than the material's.
    pub structure: Option<f64>,
}

/// A face that fluid comes in through, such as the end of a hose.
#[derive(Debug, Clone, PartialEq)]
pub struct Inlet {
    /// Where it is drawn; the fluid goes where it looks.
    pub face: Face,
    /// Where it is at a time, from there.
    pub motion: Motion,
    /// How it is drawn up as the fill rises, if it is; it then has no motion of its own.
    pub above_fill: Option<AboveFill>,
    /// Volume that comes through the whole face in m3/s.
    pub flow_rate: f64,
    /// Time in s from which on it comes.
    pub start: f64,
    /// Time in s at which it ends; infinite if it does not.
    pub stop: f64,
    /// Volume in m3 through the whole face after which it ends; infinite if it does not.
    pub volume: f64,
    /// The batch that the fluid belongs to, if it is to be followed.
    pub batch: Option<String>,
    /// The structure that the fluid has, if another than the material's.
    pub structure: Option<f64>,
    /// Bodies that come in with it.
    pub inclusions: Vec<Incoming>,
}

/// A face that stays above the fill: its lowest point rises with the level around it, and never goes down.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AboveFill {
    /// Least height in m above the level.
    pub distance: f64,
    /// Largest speed in m/s at which it rises.
    pub speed: f64,
}

impl Inlet {
    /// Time in s at which it has let in all that it ever will, if nothing stands in its way; infinite if it never ends.
    pub fn end(&self) -> f64 {
        self.stop.min(self.start + self.volume / self.flow_rate)
    }
}

/// A box in which fluid leaves, into air.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Outlet {
    /// Corner with the smallest coordinates, in m.
    pub min: DVec3,
    /// Corner with the largest coordinates, in m.
    pub max: DVec3,
}

/// A rigid body that goes its prescribed way, whatever the fluid does, or is moved by a load against what the fluid does.
#[derive(Debug, Clone, PartialEq)]
pub struct Solid {
    /// What its readings are called: letters, digits and `_`; no two solids have the same name.
    pub name: String,
    /// Where it is drawn.
    pub body: Body,
    /// Where it is at a time, from there; at rest if a load moves it, which no time tells.
    pub motion: Motion,
    /// What moves it, if its motion is not prescribed.
    pub load: Option<Load>,
    /// What its surface does to the fluid.
    pub surface: Surface,
}

/// A force that moves a solid straight along its own line, without turning, against what the fluid does.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Load {
    /// Force in N along an axis, on the solid and its images in planes of symmetry.
    pub force: DVec3,
    /// Mass in kg of the solid and these images; with none it is as fast as lets the fluid bear the load.
    pub mass: f64,
}

impl Solid {
    /// Smallest axis-parallel box around all places of the solid from the time `start` to the time `end` in s, as its two corners in m.
    pub fn swept(&self, start: f64, end: f64) -> (DVec3, DVec3) {
        let (min, max) = self.body.bounds();
        let (low, high) = self.motion.range(start, end);
        (min + low, max + high)
    }
}

/// A solid under a load, as a method moves it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Loaded {
    /// Its number.
    pub solid: usize,
    /// Unit vector along its way.
    pub direction: DVec3,
    /// Force in N along it, with what gravity adds, on the part in the domain.
    pub force: f64,
    /// Mass in kg of that part.
    pub mass: f64,
}

impl Loaded {
    /// Speed in m/s that the load can give a mass of fluid in kg, over so long a way in m; less where the fluid is viscous.
    pub fn speed(&self, fluid: f64, way: f64) -> f64 {
        (2.0 * self.force.abs() * way / (fluid + self.mass)).sqrt()
    }
}

/// Bars that are not seen one by one but by their drag on the fluid that flows through: a porous zone.
#[derive(Debug, Clone, PartialEq)]
pub struct Cage {
    /// What its readings are called; no solid has the same name.
    pub name: String,
    /// Where it is.
    pub body: Body,
    /// Its bars, each layer with its own direction; at least one.
    pub layers: Vec<Layer>,
}

/// Bars of one direction, all over a cage.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Layer {
    /// The way they go.
    pub course: Course,
    /// How thick they are and how far apart.
    pub grid: BarGrid,
}

/// The way bars go.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Course {
    /// Along this unit vector.
    Straight(DVec3),
    /// As hoops around the axis through a point in m along a unit vector.
    Around {
        /// A point of the axis.
        point: DVec3,
        /// Its direction.
        axis: DVec3,
    },
}

impl Course {
    /// Unit vector along the bars at a place in m; none on the axis of hoops.
    pub fn at(&self, place: DVec3) -> Option<DVec3> {
        match *self {
            Self::Straight(direction) => Some(direction),
            Self::Around { point, axis } => axis.cross(place - point).try_normalize(),
        }
    }
}

/// A file that a case names.
#[derive(Debug, Clone, PartialEq)]
pub struct NamedFile {
    /// Path of the file from the folder of the case file; it leads nowhere else.
    pub path: String,
    /// The file as read.
    pub bytes: Arc<[u8]>,
}

/// A mesh that was read from a file.
#[derive(Debug, Clone, PartialEq)]
pub struct MeshFile {
    /// Path of the file from the folder of the case file.
    pub path: String,
    /// The mesh where it stands.
    pub mesh: Arc<ClosedMesh>,
    /// What it is there for.
    pub role: Role,
}

/// What a mesh is there for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Role {
    /// Its inside is solid.
    Obstacle,
    /// Its outside is solid.
    Formwork,
}

/// What a wall, or the surface of a solid, does to the fluid along it: how fast the fluid slides under a wall stress.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Surface {
    /// The fluid sticks to it.
    NoSlip,
    /// The fluid slides along it without friction.
    FreeSlip,
    /// The fluid slides as fast as if it went on beyond the surface, with the shear rate that it has there (Navier 1823).
    Navier {
        /// How far beyond the surface it would come to rest, in m; positive.
        slip_length: f64,
    },
    /// The fluid sticks up to a stress, and slides on a film beyond it: stress = yield stress + viscosity x sliding speed.
    /// So concrete slides in pipes, on a film of its finest (Kaplan 2001).
    Film {
        /// Yield stress of the film in Pa, not negative.
        yield_stress: f64,
        /// Viscosity of the film over its thickness in Pa s/m, positive.
        viscosity: f64,
    },
}

/// Numerical method and its settings.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Method {
    /// Free-surface lattice Boltzmann.
    Lbm(Lbm),
    /// Incompressible smoothed particle hydrodynamics, by one of its schemes.
    Isph(Isph),
    /// Lagrangian differencing dynamics.
    Ldd(Ldd),
}

impl Method {
    /// What it is called in the case file.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Lbm(_) => "lbm",
            Self::Isph(Isph { scheme: Scheme::Projection, .. }) => "isph",
            Self::Isph(Isph { scheme: Scheme::ThreeStep(_), .. }) => "sph",
            Self::Ldd(_) => "ldd",
        }
    }

    /// Edge of a cell, or distance of particles, in m.
    pub fn resolution(&self) -> f64 {
        match self {
            Self::Lbm(lbm) => lbm.cell_size,
            Self::Isph(isph) => isph.spacing,
            Self::Ldd(ldd) => ldd.spacing,
        }
    }

    /// The same method with cells or distances of another size in m.
    pub fn set_resolution(&mut self, size: f64) {
        match self {
            Self::Lbm(lbm) => lbm.cell_size = size,
            Self::Isph(isph) => isph.spacing = size,
            Self::Ldd(ldd) => ldd.spacing = size,
        }
    }

    /// The key that says so.
    pub fn resolution_key(&self) -> &'static str {
        match self {
            Self::Lbm(_) => "lbm.cell_size",
            Self::Isph(Isph { scheme: Scheme::Projection, .. }) => "isph.spacing",
            Self::Isph(Isph { scheme: Scheme::ThreeStep(_), .. }) => "sph.spacing",
            Self::Ldd(_) => "ldd.spacing",
        }
    }
}

/// Settings of Lagrangian differencing dynamics.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ldd {
    /// Distance of nodes in m; the domain is a whole number of them along each axis.
    pub spacing: f64,
    /// Spacings that a node may go in a step.
    pub courant: f64,
    /// Longest step in s, if there is one.
    pub time_step: Option<f64>,
    /// In which order pressure and velocity are found.
    pub coupling: LddCoupling,
    /// What of a step's stress is that of the new velocities.
    pub scheme: LddScheme,
    /// Which Laplacian is taken.
    pub laplacian: LddLaplacian,
    /// Largest apparent viscosity in Pa s; chosen by the solver if absent.
    pub largest_viscosity: Option<f64>,
}

/// In which order pressure and velocity are found.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LddCoupling {
    /// Velocities under the old pressure, and then the new one.
    Incremental,
    /// The pressure, and then velocities under it.
    PressureFirst,
}

/// What of a step's stress is that of the new velocities.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LddScheme {
    /// All but the apparent viscosity.
    Lagged,
    /// The apparent viscosity, too.
    Implicit,
    /// What Basic (2021, Eq. 19) takes: viscosity times the Laplacian of the velocity.
    Paper,
}

/// Which Laplacian is taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LddLaplacian {
    /// Exact for quadratic fields.
    Exact,
    /// That of Basic (2021, Eq. 15).
    Paper,
}

/// Settings of incompressible smoothed particle hydrodynamics.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Isph {
    /// Distance of particles in m; the domain is a whole number of them along each axis.
    pub spacing: f64,
    /// Share of a smoothing length that a particle may go in a step past others and along walls.
    pub courant: f64,
    /// How the viscous part of a step is taken.
    pub stress: StressStep,
    /// What stress and shear rate are taken to be.
    pub strain_convention: StrainConvention,
    /// Largest apparent viscosity in Pa s; chosen by the solver if absent.
    pub largest_viscosity: Option<f64>,
    /// Longest step in s; chosen by the solver if absent.
    pub time_step: Option<f64>,
    /// How a step goes.
    pub scheme: Scheme,
}

/// A scheme of incompressible smoothed particle hydrodynamics.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scheme {
    /// Cummins and Rudman's projection, as Wu (2016) takes it.
    Projection,
    /// Hosseini's three steps, with wall particles.
    ThreeStep(PressureStep),
}

/// How the three steps come to their pressure.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PressureStep {
    /// From all equations at once.
    Solve,
    /// From the pressures of the step before, by each equation for itself: steps must be short.
    Sweep,
}

/// How the viscous part of a step is taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StressStep {
    /// From the velocities at the end of the step.
    Implicit,
    /// From those at its beginning: steps must be short.
    Explicit,
}

/// What stress and shear rate are taken to be.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StrainConvention {
    /// Stress 2 mu E at the shear rate sqrt(2 E:E): |du/dy| in simple shear.
    Standard,
    /// As Wu (2016) prints them: mu E at sqrt(E:E/2).
    Paper,
}

/// Settings of the lattice Boltzmann method.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lbm {
    /// Edge of a cell in m; the domain is a whole number of cells along each axis.
    pub cell_size: f64,
    /// Format of the populations.
    pub precision: Precision,
    /// First time step in s; chosen by the solver if absent.
    pub time_step: Option<f64>,
    /// Whether later steps are longer or shorter.
    pub stepping: Stepping,
    /// Largest relative change of density due to the weight of the fluid (the method is slightly compressible).
    pub hydrostatic_error: f64,
    /// Largest speed in cells per time step.
    pub lattice_speed: f64,
    /// Kinematic viscosity in cells squared per time step that a chosen time step aims at.
    pub lattice_viscosity: f64,
    /// Relaxation rate of the trace of the stress; less than 1 lets sound die away sooner.
    pub bulk_relaxation: f64,
    /// Velocities of the populations.
    pub lattice: Lattice,
    /// How populations collide.
    pub collision: Collision,
    /// Choices of a published work, in place of lattice and collision.
    pub preset: Option<Preset>,
}

impl Lbm {
    /// The scheme of the textbooks that is asked for; none for the program's own.
    pub fn textbook(&self) -> Option<Textbook> {
        match (self.preset, self.collision) {
            (Some(Preset::Svec2013), _) => Some(Textbook {
                lattice: Lattice::D3q15,
                collision: Collision::Bgk,
                relaxation_times: Some([0.501, 8.0]),
            }),
            (None, Collision::Mtrt) => None,
            (None, collision) => Some(Textbook { lattice: self.lattice, collision, relaxation_times: None }),
        }
    }
}

/// A scheme of the textbooks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Textbook {
    /// Velocities.
    pub lattice: Lattice,
    /// Collision; not the program's own.
    pub collision: Collision,
    /// Relaxation times between which those of the flow curve are held.
    pub relaxation_times: Option<[f64; 2]>,
}

/// Velocities of the populations: 15, 19 or 27 in three dimensions.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Lattice {
    /// 15 velocities.
    D3q15,
    /// 19 velocities.
    D3q19,
    /// 27 velocities.
    D3q27,
}

/// How populations collide.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Collision {
    /// The program's own: stress, odd moments and all others each with their rate.
    Mtrt,
    /// One relaxation time (Bhatnagar, Gross and Krook 1954; Qian et al. 1992).
    Bgk,
    /// Two relaxation times (Ginzburg, Verhaeghe and d'Humieres 2008).
    Trt,
    /// All but the stress forgotten (Latt and Chopard 2006).
    Regularised,
}

/// Choices of a published work.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Preset {
    /// O. Svec, thesis, Technical University of Denmark, 2013: D3Q15, one relaxation time from 0.501 to 8.
    Svec2013,
}

/// How long time steps are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stepping {
    /// As long as the first.
    Fixed,
    /// As long as the flow at the time allows.
    Adaptive,
}

/// Floating-point format.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Precision {
    /// 32 bits.
    F32,
    /// 64 bits.
    F64,
}

/// When the run ends.
#[derive(Debug, Clone, PartialEq)]
pub struct Stop {
    /// At this simulated time in s at the latest.
    pub time: f64,
    /// Earlier if the fluid comes to rest.
    pub rest: Option<Rest>,
    /// Earlier if what the front or light gauge of this name waits for has come.
    pub event: Option<String>,
}

/// When the fluid counts as being at rest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rest {
    /// The spread grows by less than this, in m/s; counts only where there is a spread gauge.
    pub spread_rate: f64,
    /// The spread still has to grow by less than this share of it; counts only where there is a spread gauge.
    pub growth: f64,
    /// 99 % of the fluid is slower than this, in m/s.
    pub speed: f64,
    /// Or half of it is, and each level changes by less than this, in m/s.
    pub level_rate: Option<f64>,
    /// The speed stays so low for this long, in s.
    pub duration: f64,
}

/// What is measured during the run. No two gauges of a kind have the same name.
#[derive(Debug, Clone, PartialEq)]
pub struct Gauges {
    /// Simulated time between two readings in s.
    pub interval: f64,
    /// Diameter of the spreading fluid.
    pub spread: Option<SpreadGauge>,
    /// Levels of its surface.
    pub level: Vec<LevelGauge>,
    /// How far it has come, and when it arrives.
    pub front: Vec<FrontGauge>,
    /// Where one sees through from above, and when.
    pub light: Vec<LightGauge>,
    /// What it presses on walls with.
    pub pressure: Vec<PressureGauge>,
    /// How the form fills.
    pub filling: Option<FillingGauge>,
}

/// Measures the level of the fluid's surface over a rectangle, the median of its columns.
#[derive(Debug, Clone, PartialEq)]
pub struct LevelGauge {
    /// What it is called.
    pub name: String,
    /// Corner of the rectangle with the smallest x and y, in m.
    pub min: DVec2,
    /// Corner with the largest; along an axis it may be the same as the smallest, for a line of columns or a single one.
    pub max: DVec2,
}

/// Measures how far the fluid has come along an axis, and when it first reaches a plane across it.
#[derive(Debug, Clone, PartialEq)]
pub struct FrontGauge {
    /// What it is called.
    pub name: String,
    /// The axis: 0, 1, 2 for x, y, z.
    pub axis: usize,
    /// Whether the fluid comes along the axis, or against it.
    pub forwards: bool,
    /// Coordinate of the plane in m.
    pub at: f64,
}

/// Tells when one first sees through a box from above, in which fluid has been.
#[derive(Debug, Clone, PartialEq)]
pub struct LightGauge {
    /// What it is called.
    pub name: String,
    /// Corner of the box with the smallest coordinates, in m.
    pub min: DVec3,
    /// Corner with the largest.
    pub max: DVec3,
    /// Name of the solid with which it moves; it rests if absent.
    pub with: Option<String>,
}

/// Measures the normal stress on a wall, in bands over the height.
#[derive(Debug, Clone, PartialEq)]
pub struct PressureGauge {
    /// What it is called.
    pub name: String,
    /// Key of a side of the domain, or name of a solid.
    pub wall: String,
    /// Corners of the box in which cells count, in m; that of the domain if absent.
    pub min: Option<DVec3>,
    /// The corner with the largest coordinates.
    pub max: Option<DVec3>,
    /// Number of bands of the same height.
    pub bands: usize,
}

impl PressureGauge {
    /// Number of the side of the domain that is the wall, if it is one.
    pub fn side(&self) -> Option<usize> {
        SIDE_KEYS.iter().position(|key| *key == self.wall)
    }
}

/// Watches when each place is filled, where fronts meet, where the fluid stands, and where air is caught.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FillingGauge {
    /// Shear rate in 1/s that the fluid must not have exceeded in a dead zone since it was filled.
    pub dead_shear_rate: f64,
}

/// Measures how far the fluid has spread.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SpreadGauge {
    /// Vertical axis from which the spread is measured: x and y in m.
    pub centre: DVec2,
}

/// What is written during the run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Output {
    /// Simulated time between two snapshots of the fields in s; none are written if absent.
    pub snapshot_interval: Option<f64>,
    /// Simulated time between two pictures in s; none are drawn if absent.
    pub picture_interval: Option<f64>,
    /// Wall-clock time between two checkpoints in s.
    pub checkpoint_interval: f64,
}

impl Case {
    /// The batches that are to be followed, in the order in which the case names them.
    pub fn batches(&self) -> Vec<&str> {
        let mut batches: Vec<&str> = Vec::new();
        let fluid = self.fluid.iter().map(|region| &region.batch);
        let groups = self.groups.iter().map(|group| &group.batch);
        let inlets = self.inlets.iter().map(|inlet| &inlet.batch);
        for batch in fluid.chain(inlets).chain(groups).flatten() {
            if !batches.contains(&batch.as_str()) {
                batches.push(batch);
            }
        }
        batches
    }

    /// Bodies that come in, kind by kind, each with the number of its inlet.
    pub fn incoming(&self) -> impl Iterator<Item = (usize, &Incoming)> {
        let inlets = self.inlets.iter().enumerate();
        inlets.flat_map(|(n, inlet)| inlet.inclusions.iter().map(move |incoming| (n, incoming)))
    }

    /// Whether there are bodies in the fluid, at the start or later.
    pub fn has_bodies(&self) -> bool {
        !self.groups.is_empty() || !self.inclusions.is_empty() || self.incoming().next().is_some()
    }

    /// The box around the fluid that there is at the start, as its two corners in m; inside out if there is none.
    pub fn fluid_box(&self) -> (DVec3, DVec3) {
        let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for region in &self.fluid {
            let (min, max) = region.shape.bounds();
            low = low.min(min.max(self.domain.min));
            high = high.max(max.min(self.domain.max));
        }
        (low, high)
    }

    /// The structure of fluid for which `own` is given or nothing; none if the fluid is not thixotropic.
    pub fn structure(&self, own: Option<f64>) -> Option<f64> {
        self.material.thixotropy.map(|_| own.unwrap_or(self.material.structure))
    }

    /// Whether an inlet has yet to let fluid in at a time in s.
    pub fn pours(&self, time: f64) -> bool {
        self.inlets.iter().any(|inlet| inlet.end() > time && inlet.start < self.stop.time)
    }

    /// Whether fluid can leave.
    pub fn has_outlets(&self) -> bool {
        !self.outlets.is_empty() || self.domain.sides.contains(&Side::Open)
    }

    /// What moves a solid under a load, if it is one, and which: its number, the direction of its way, the force in N along it, weight included, and the mass in kg, of the part in the domain.
    pub fn loaded(&self) -> Option<Loaded> {
        let (solid, load) = self.solids.iter().enumerate().find_map(|(n, solid)| Some((n, solid.load?)))?;
        let direction = load.force.normalize_or_zero();
        let mirrors = |axis: usize| {
            let of_axis = &self.domain.sides[2 * axis..2 * axis + 2];
            of_axis.iter().filter(|side| direction[axis] == 0.0 && **side == Side::Symmetry).count() as i32
        };
        let share = 0.5f64.powi((0..3).map(mirrors).sum());
        let mass = share * load.mass;
        let force = share * load.force.length() + mass * self.domain.gravity.dot(direction);
        Some(Loaded { solid, direction, force, mass })
    }

    /// Whether a solid still moves in the domain at a time in s, or has yet to come into it, by a motion that is prescribed: one under a load rests with the fluid.
    pub fn solids_move(&self, time: f64) -> bool {
        self.solids.iter().any(|solid| {
            let (min, max) = solid.swept(time, self.stop.time.max(time));
            let meets = min.cmplt(self.domain.max).all() && max.cmpgt(self.domain.min).all();
            meets && solid.motion.largest_speed(time) > 0.0
        })
    }

    /// Reads a case from `text`; `name` stands for the file in messages. Files that the case names are read too; they lie in the
    /// folder of `name`.
    pub fn parse(name: &str, text: &str) -> Result<Self, CaseError> {
        let folder = Path::new(name).parent().unwrap_or(Path::new(""));
        let case = Document::parse(text, folder).and_then(|document| {
            let case = schema::read(&document, name, text)?;
            check::check(&case, &document)?;
            Ok(Self { inclusions: inclusions::placed(&case, &document)?, ..case })
        });
        case.map_err(|fault| InvalidCase::new(name, text, fault).into())
    }

    /// Reads a case file.
    pub fn read(path: &Path) -> Result<Self, CaseError> {
        let text = std::fs::read_to_string(path)
            .map_err(|source| CaseError::Read { path: path.to_owned(), source })?;
        Self::parse(&path.display().to_string(), &text)
    }

    /// What somebody further up finds wrong with this case, told at the first of `keys` that stands in the file.
    pub fn refuse(&self, keys: &[&str], problem: impl Into<String>, advice: impl Into<String>) -> CaseError {
        let span = Document::parse(&self.text, Path::new("")).map_or(0..0, |document| {
            let found = keys.iter().find_map(|key| document.find(key));
            found.unwrap_or_else(|| document.locate(keys.first().copied().unwrap_or_default()))
        });
        InvalidCase::new(&self.name, &self.text, Fault::new(span, problem, advice)).into()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn images_lie_behind_mirrors_and_periodic_sides() {
        use Side::{Open, Periodic, Symmetry};
        let domain = |sides| Domain { min: DVec3::ONE, max: DVec3::splat(3.0), gravity: DVec3::ZERO, sides };
        let seen = |sides: [Side; 2], at: f64| {
            let [low, high] = sides;
            domain([low, high, Open, Open, Open, Open]).image(DVec3::new(at, -5.0, 2.0))
        };
        for (sides, at, place) in [
            ([Periodic, Periodic], 7.5, 1.5),
            ([Periodic, Periodic], -0.5, 1.5),
            ([Symmetry, Symmetry], 6.5, 2.5),
            ([Symmetry, Symmetry], 0.5, 1.5),
            ([Symmetry, Open], 0.5, 1.5),
            ([Open, Symmetry], 3.5, 2.5),
            ([Open, Symmetry], 0.5, 0.5),
            ([Open, Open], 9.0, 9.0),
        ] {
            assert_eq!(seen(sides, at), DVec3::new(place, -5.0, 2.0), "{sides:?} {at}");
        }
    }
}
