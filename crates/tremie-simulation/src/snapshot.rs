//! What gauges and writers see: the state of the fluid at one moment, in SI units.

use tremie_numerics::{DMat3, DVec3};
use tremie_suspension::orientation::tensor_of;
use tremie_suspension::{Form, Inclusions};

/// The state of a simulation at one moment.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Snapshot {
    /// Simulated time in s.
    pub time: f64,
    /// The fluid.
    pub fluid: Fluid,
    /// What swims in it.
    pub inclusions: Inclusions,
    /// What the fluid does to each solid of the case, within the domain.
    pub solids: Vec<SolidLoad>,
    /// How far in m each solid of the case is from where it is drawn; empty where a method does not tell.
    pub moved: Vec<DVec3>,
    /// What it does to the bars of each cage of the case, within the domain.
    pub cages: Vec<SolidLoad>,
    /// What it does to the sides of the domain and to inlets, and to each piece of wall.
    pub walls: WallLoads,
    /// Volume in m3 that has come into the domain since the start, by inlet.
    pub inflow: Vec<f64>,
    /// Volume in m3 that has left the domain since the start; none where nothing can leave.
    pub outflow: Option<f64>,
    /// How much of that was of each batch that is followed, in the order of the case.
    pub batches_out: Vec<f64>,
    /// Number of bodies of each kind that were in the fluid at the start or have come in since: those that have left, and those that are there.
    pub bodies_in: Vec<u64>,
    /// How many of each kind have left since the start.
    pub bodies_out: Vec<u64>,
}

/// Force and moment of the fluid on a solid; pressure counts from that of the air.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct SolidLoad {
    /// Force in N.
    pub force: DVec3,
    /// Moment about the origin of coordinates in N m.
    pub moment: DVec3,
}

/// What the fluid does to walls, within the domain.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct WallLoads {
    /// Load on each side of the domain, in the order of the case's sides: all of it on walls, the part across it on planes of symmetry, and
    /// none elsewhere.
    pub sides: [SolidLoad; 6],
    /// Load on each inlet: what the plate behind it bears, with what comes in thrust back on it.
    pub inlets: Vec<SolidLoad>,
    /// Pieces of wall, each beside one cell that holds fluid.
    pub faces: Vec<WallFace>,
}

/// A side of the domain, or a solid, by its number in the case.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Wall {
    /// A side, in the order of the case's sides.
    Side(usize),
    /// A solid.
    Solid(usize),
}

/// What the fluid in one cell does to the wall beside it.
///
/// Force over area is the normal stress on the wall: pressure and what the flow adds to it. On a slanted wall it means
/// something as the sum of the forces over the sum of the areas of several faces.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WallFace {
    /// Whose wall it is.
    pub wall: Wall,
    /// Centre in m of the cell.
    pub cell: DVec3,
    /// Unit normal of the wall, into the fluid.
    pub normal: DVec3,
    /// Share of the cell that is filled.
    pub fill: f64,
    /// Area in m2 of the wall beside the cell.
    pub area: f64,
    /// Force in N that presses on it; pressure counts from that of the air.
    pub force: f64,
}

/// The fluid, in the way that its method describes it.
#[derive(Debug, Clone, PartialEq)]
pub enum Fluid {
    /// Cells of a regular grid.
    Cells(Cells),
}

/// A box of cubic cells around the fluid, x fastest: cell (i, j, k) is number `i + nx (j + ny k)`.
///
/// Fields are zero where there is no fluid.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Cells {
    /// Lower corner of the box in m.
    pub origin: DVec3,
    /// Edge of a cell in m.
    pub size: f64,
    /// Cells along each axis.
    pub count: [usize; 3],
    /// Share of each cell that is filled with fluid, 0 to 1; of one that a moving solid cuts, of what that leaves of it.
    pub fill: Vec<f64>,
    /// Pressure above that of the air in Pa.
    pub pressure: Vec<f64>,
    /// Velocity in m/s.
    pub velocity: Vec<DVec3>,
    /// Shear rate sqrt(2 D:D) in 1/s, zero where the fluid has not yielded.
    pub shear_rate: Vec<f64>,
    /// Shear stress sqrt(T:T/2) in Pa with T the deviatoric stress.
    pub stress: Vec<f64>,
    /// 1 in solid cells, 0 elsewhere.
    pub solid: Vec<u8>,
    /// Share of each cell that lies in a cage; none where there is no cage.
    pub cage: Option<Vec<f64>>,
    /// Names of the batches that are followed, and the share of each, 0 to 1, in the fluid of a cell.
    pub batches: Vec<(String, Vec<f64>)>,
    /// Structure lambda of a thixotropic fluid, whose yield stress is 1 + lambda times that of its flow curve.
    pub structure: Option<Vec<f64>>,
    /// How fibres lie that are too many to be among the bodies.
    pub lying: Option<Lying>,
    /// Density of the fluid in kg/m3.
    pub density: f64,
    /// The domain's lower and upper corner in m.
    pub domain: [DVec3; 2],
    /// For each axis, whether the domain's lower and its upper side is a symmetry plane, beyond which the body goes
    /// on mirrored.
    pub symmetry: [[bool; 2]; 3],
}

/// Fibres as a field: everywhere in the fluid the same share of the volume.
#[derive(Debug, Clone, PartialEq)]
pub struct Lying {
    /// Their form.
    pub form: Form,
    /// Share of the volume, of fluid and fibres together.
    pub share: f64,
    /// Orientation tensor a_ij in each cell, by its components 11, 22, 33, 12, 13, 23; zero where there is no fluid.
    pub tensors: Vec<[f64; 6]>,
}

impl Lying {
    /// Orientation tensor in a cell.
    pub fn tensor(&self, n: usize) -> DMat3 {
        tensor_of(self.tensors[n])
    }
}

impl Default for Fluid {
    fn default() -> Self {
        Self::Cells(Cells::default())
    }
}

impl Cells {
    /// A box of so many cells, in which all of the fields that are here are zero, in the memory that they have.
    #[must_use]
    pub fn blank(mut self, count: [usize; 3]) -> Self {
        fn zero<T: Clone + Default>(values: &mut Vec<T>, number: usize) {
            values.clear();
            values.resize(number, T::default());
        }
        let number = count.iter().product();
        self.count = count;
        let single = [&mut self.fill, &mut self.pressure, &mut self.shear_rate, &mut self.stress];
        let shares = self.batches.iter_mut().map(|(_, shares)| shares);
        for values in single.into_iter().chain(&mut self.cage).chain(&mut self.structure).chain(shares) {
            zero(values, number);
        }
        zero(&mut self.velocity, number);
        zero(&mut self.solid, number);
        if let Some(lying) = &mut self.lying {
            zero(&mut lying.tensors, number);
        }
        self
    }

    /// The field by which it is known how fibres lie: none if they are among the bodies.
    pub fn field_beside(&self, bodies: &Inclusions) -> Option<&Lying> {
        let followed = bodies.kinds.iter().any(|kind| matches!(kind.form, Form::Fibre { .. }));
        self.lying.as_ref().filter(|_| !followed)
    }

    /// Number of the cell (i, j, k) in the fields.
    pub fn index(&self, i: usize, j: usize, k: usize) -> usize {
        i + self.count[0] * (j + self.count[1] * k)
    }

    /// Centre of the cell (i, j, k) in m.
    pub fn centre(&self, i: usize, j: usize, k: usize) -> DVec3 {
        self.origin + self.size * (DVec3::new(i as f64, j as f64, k as f64) + 0.5)
    }

    /// The batch that there is most of in a cell, by its number from 1; 0 if the most is of none.
    pub fn batch(&self, n: usize) -> usize {
        let none = 1.0 - self.batches.iter().map(|(_, shares)| shares[n]).sum::<f64>();
        let mut most = (0, none);
        for (batch, (_, shares)) in self.batches.iter().enumerate() {
            if shares[n] > most.1 {
                most = (batch + 1, shares[n]);
            }
        }
        most.0
    }

    /// How many times the whole body holds what the domain holds: 2 for each symmetry plane.
    pub fn copies(&self) -> f64 {
        let planes = self.symmetry.iter().flatten().filter(|plane| **plane).count();
        2f64.powi(planes as i32)
    }
}
