//! The lattice Boltzmann method of the textbooks and of Svec's thesis (2013, chapter 2), to be compared with and reproduced.
//!
//! Any of three lattices (`lattices`) with any of three collisions (`collision`), and the free surface as the thesis has it
//! (`surface`): the mass of interface cells by Eq. 2.14 and 2.15, populations from air, and from interface cells on the side of the
//! air, by Eq. 2.16, what is left over or missing shared by all interface cells. In 64 bits, on all cells of the domain; walls,
//! symmetry planes and periodic sides, no solids, fixed steps. The thesis's own choices (`preset = "svec-2013"`) are D3Q15, BGK,
//! and relaxation times between 0.501 and 8, which make of a Bingham fluid one that creeps at a viscosity of 2.5.
//!
//! For casting there is the program's own scheme (module `simulation`), which is faster by far and is what the benchmarks judge.

mod collision;
mod lattices;
mod surface;

use rayon::prelude::*;
use tremie_case::{Case, Lattice, Side, Textbook};
use tremie_numerics::DVec3;
use tremie_output::state::{Array, State};
use tremie_rheology::FlowCurve;
use tremie_simulation::{Breakdown, Cells, Fluid, Load, RestoreError, Simulation, Snapshot};

use crate::initial::{centre, velocity_at};
use crate::plan::{Plan, confined_gravity};
use crate::relaxation::{Bingham, Relaxation};
use crate::scaling::Scaling;
use crate::tabulated::Tabulated;

use collision::{Rules, Seen, collide, equilibrium};
use lattices::{D3Q15, D3Q19, D3Q27, Velocities};
use surface::Kind;

/// A flow curve on the lattice.
enum Law {
    Bingham(Bingham<f64>),
    Tabulated(Box<Tabulated<f64>>),
}

impl Law {
    fn new(curve: &FlowCurve, scaling: &Scaling) -> Self {
        match curve {
            FlowCurve::Newtonian { .. } | FlowCurve::Bingham { .. } => {
                let viscosity = scaling.viscosity(curve.plastic_viscosity());
                Self::Bingham(Bingham::new(scaling.stress(curve.yield_stress()), viscosity))
            }
            _ => Self::Tabulated(Box::new(Tabulated::new(curve, scaling))),
        }
    }

    fn omega(&self, q: f64) -> f64 {
        match self {
            Self::Bingham(law) => law.omega(q),
            Self::Tabulated(law) => law.omega(q),
        }
    }
}

/// A case made ready to run by a scheme of the textbooks.
pub(crate) fn simulation(case: &Case, textbook: Textbook) -> Box<dyn Simulation> {
    match textbook.lattice {
        Lattice::D3q15 => Box::new(Dense::<15>::new(case, textbook, D3Q15)),
        Lattice::D3q19 => Box::new(Dense::<19>::new(case, textbook, D3Q19)),
        Lattice::D3q27 => Box::new(Dense::<27>::new(case, textbook, D3Q27)),
    }
}

/// Bytes for each cell of the domain.
pub(crate) fn bytes_per_cell(lattice: Lattice) -> f64 {
    let bytes = match lattice {
        Lattice::D3q15 => Dense::<15>::BYTES,
        Lattice::D3q19 => Dense::<19>::BYTES,
        Lattice::D3q27 => Dense::<27>::BYTES,
    };
    bytes as f64
}

/// A velocity whose product with the gradient of the fill is less than this goes along the surface: otherwise rounding would
/// choose a side.
const ALONG_SURFACE: f64 = 1e-6;

/// Where a population comes from.
enum From {
    /// The cell of this number, in which it is this population.
    Cell(usize, usize),
    /// A wall of this velocity.
    Wall([f64; 3]),
}

/// All cells of the domain, x fastest.
struct Dense<const Q: usize> {
    case: Case,
    scaling: Scaling,
    lattice: Velocities<Q>,
    rules: Rules,
    count: [usize; 3],
    /// From a cell to the one that each velocity leads to.
    offset: [isize; Q],
    kinds: Vec<Kind>,
    mass: Vec<f64>,
    /// Populations after the last collision.
    front: Vec<[f64; Q]>,
    /// What that collision found in each cell that holds fluid.
    seen: Vec<Seen>,
    /// Cells that hold fluid, in order, and those of them that are interface.
    wet: Vec<usize>,
    interface: Vec<usize>,
    steps: u64,
    updates: u64,
}

impl<const Q: usize> Dense<Q> {
    /// Memory for each cell.
    const BYTES: usize = size_of::<([f64; Q], Seen, f64, Kind)>();

    fn new(case: &Case, textbook: Textbook, weights: [f64; 4]) -> Self {
        let plan = Plan::new(case);
        let scaling = plan.scaling;
        let count = plan.cells;
        let total = count.iter().product();
        let lattice = Velocities::new(weights);
        let stride = [1, count[0], count[0] * count[1]];
        let offset = lattice.c.map(|c: [i32; 3]| (0..3).map(|a| c[a] as isize * stride[a] as isize).sum());
        let mut new = Self {
            case: case.clone(),
            rules: Rules {
                collision: textbook.collision,
                law: Law::new(&case.material.curve, &scaling),
                gravity: case.domain.gravity.to_array().map(|g| scaling.acceleration(g)),
                relaxation_times: textbook.relaxation_times,
            },
            scaling,
            lattice,
            count,
            offset,
            kinds: vec![Kind::Air; total],
            mass: vec![0.0; total],
            front: vec![[0.0; Q]; total],
            seen: vec![Seen::default(); total],
            wet: Vec::new(),
            interface: Vec::new(),
            steps: 0,
            updates: 0,
        };
        new.fill();
        new.list();
        new
    }

    /// Lists the cells that hold fluid, and those of the interface.
    pub(super) fn list(&mut self) {
        let kinds = &self.kinds;
        self.wet.clear();
        self.wet.extend((0..kinds.len()).filter(|cell| kinds[*cell] != Kind::Air));
        self.interface.clear();
        self.interface.extend(self.wet.iter().filter(|cell| kinds[**cell] == Kind::Interface));
    }

    fn place(&self, cell: usize) -> [usize; 3] {
        let [nx, ny, _] = self.count;
        [cell % nx, cell / nx % ny, cell / nx / ny]
    }

    /// Where the population i of a cell comes from.
    #[inline(always)]
    fn from(&self, at: [usize; 3], i: usize) -> From {
        let mut flip = 0;
        let mut there = [0; 3];
        for axis in 0..3 {
            let n = self.count[axis] as i32;
            let x = at[axis] as i32 - self.lattice.c[i][axis];
            there[axis] = if (0..n).contains(&x) {
                x as usize
            } else {
                match self.case.domain.sides[2 * axis + usize::from(x >= n)] {
                    Side::Wall { velocity, .. } => {
                        return From::Wall(velocity.to_array().map(|u| self.scaling.velocity(u)));
                    }
                    Side::Symmetry => {
                        flip |= 1 << axis;
                        at[axis]
                    }
                    Side::Periodic => (x + n) as usize % n as usize,
                    // Of open sides these schemes know nothing: a case with one is refused.
                    Side::Open => return From::Wall([0.0; 3]),
                }
            };
        }
        let cell = there[0] + self.count[0] * (there[1] + self.count[1] * there[2]);
        From::Cell(cell, self.lattice.mirror[flip][i])
    }

    /// The first state: fills, and the pressure of the weight above.
    fn fill(&mut self) {
        let size = self.scaling.cell_size;
        let centres: Vec<DVec3> =
            (0..self.kinds.len()).map(|cell| centre(&self.case, size, self.place(cell))).collect();
        let fluid = &self.case.fluid;
        let fills: Vec<f64> = centres
            .par_iter()
            .map(|p| fluid.iter().map(|region| region.shape.fill(*p, size)).fold(0.0, f64::max))
            .collect();
        for cell in 0..fills.len() {
            let at = self.place(cell);
            let beside_air =
                || (1..Q).any(|i| matches!(self.from(at, i), From::Cell(beside, _) if fills[beside] <= 0.0));
            self.kinds[cell] = match fills[cell] {
                fill if fill <= 0.0 => Kind::Air,
                fill if fill >= 1.0 - 1e-9 && !beside_air() => Kind::Liquid,
                _ => Kind::Interface,
            };
        }
        let gravity = confined_gravity(&self.case);
        let axis = gravity.abs().max_position();
        let pull = 3.0 * self.scaling.acceleration(gravity[axis].abs());
        let mut depth = vec![0.0; fills.len()];
        let stride: usize = self.count[..axis].iter().product();
        for cell in 0..fills.len() {
            // From the top of each column downwards.
            if self.place(cell)[axis] != 0 {
                continue;
            }
            let column = |k: usize| {
                let k = if gravity[axis] < 0.0 { self.count[axis] - 1 - k } else { k };
                cell + stride * k
            };
            let mut above = 0.0;
            for k in 0..self.count[axis] {
                let fill = fills[column(k)];
                depth[column(k)] = above + fill - 0.5;
                above = if fill > 0.0 { above + fill } else { 0.0 };
            }
        }
        for cell in (0..fills.len()).filter(|cell| self.kinds[*cell] != Kind::Air) {
            let density = (pull * depth[cell]).exp();
            let velocity =
                velocity_at(&self.case, centres[cell]).to_array().map(|u| self.scaling.velocity(u));
            // Populations are those after a collision, in which the fluid has just felt the second half of the force.
            let pushed = std::array::from_fn(|a| velocity[a] + 0.5 * self.rules.gravity[a]);
            self.front[cell] = equilibrium(&self.lattice, density, pushed);
            self.mass[cell] = fills[cell] * density;
            self.seen[cell] = Seen { density, velocity, ..Seen::default() };
        }
    }

    /// Populations that arrive in a cell.
    #[inline(always)]
    fn arriving(&self, cell: usize) -> [f64; Q] {
        let at = self.place(cell);
        let own = &self.front[cell];
        let interface = self.kinds[cell] == Kind::Interface;
        if !interface && (0..3).all(|a| at[a] > 0 && at[a] + 1 < self.count[a]) {
            // Only fluid around, and no side of the domain.
            return std::array::from_fn(|i| self.front[cell.wrapping_add_signed(-self.offset[i])][i]);
        }
        let normal = if interface { self.normal(at) } else { [0.0; 3] };
        let gas =
            if interface { equilibrium(&self.lattice, 1.0, self.seen[cell].velocity) } else { [0.0; Q] };
        std::array::from_fn(|i| {
            let back = self.lattice.opposite(i);
            match self.from(at, i) {
                From::Wall(u) => own[back] + 6.0 * self.lattice.w[i] * self.lattice.along(i, u),
                From::Cell(beside, there) => {
                    let made_up = match self.kinds[beside] {
                        Kind::Air => true,
                        Kind::Interface => {
                            interface && i != 0 && self.lattice.along(i, normal) < -ALONG_SURFACE
                        }
                        Kind::Liquid => false,
                    };
                    if made_up { gas[i] + gas[back] - own[back] } else { self.front[beside][there] }
                }
            }
        })
    }

    /// Mass that an interface cell gains (Eq. 2.14 and 2.15): along a link with another one, times the mean of their masses.
    fn gain(&self, cell: usize) -> f64 {
        let at = self.place(cell);
        let mut gain = 0.0;
        for i in 1..Q {
            let From::Cell(beside, there) = self.from(at, i) else { continue };
            let share = match self.kinds[beside] {
                Kind::Air => continue,
                Kind::Interface => 0.5 * (self.mass[cell] + self.mass[beside]),
                Kind::Liquid => 1.0,
            };
            gain += share * (self.front[beside][there] - self.front[cell][self.lattice.opposite(i)]);
        }
        gain
    }

    /// From liquid to air: against the gradient of the fill.
    fn normal(&self, at: [usize; 3]) -> [f64; 3] {
        let mut normal = [0.0; 3];
        for i in 1..Q {
            if let From::Cell(beside, _) = self.from(at, i) {
                let fill = self.fill_of(beside);
                for axis in 0..3 {
                    normal[axis] += self.lattice.w[i] * f64::from(self.lattice.c[i][axis]) * fill;
                }
            }
        }
        normal
    }

    /// Share of a cell that holds fluid.
    fn fill_of(&self, cell: usize) -> f64 {
        match self.kinds[cell] {
            Kind::Air => 0.0,
            Kind::Liquid => 1.0,
            Kind::Interface => (self.mass[cell] / self.seen[cell].density).clamp(0.0, 1.0),
        }
    }

    fn identity(&self) -> String {
        format!(
            "lbm (textbook, {Q} velocities) with {:?} cells of {} m and steps of {:e} s",
            self.count, self.scaling.cell_size, self.scaling.time_step
        )
    }
}

impl<const Q: usize> Simulation for Dense<Q> {
    fn time(&self) -> f64 {
        self.steps as f64 * self.scaling.time_step
    }

    fn time_step(&self) -> f64 {
        self.scaling.time_step
    }

    fn advance(&mut self) -> Result<(), Breakdown> {
        let collided: Vec<([f64; Q], Seen, f64)> = self
            .wet
            .par_iter()
            .map(|&cell| {
                let (post, seen) = collide(&self.lattice, &self.rules, &self.arriving(cell));
                (post, seen, if self.kinds[cell] == Kind::Interface { self.gain(cell) } else { 0.0 })
            })
            .collect();
        for (&cell, (post, seen, gain)) in self.wet.iter().zip(collided) {
            self.front[cell] = post;
            self.seen[cell] = seen;
            self.mass[cell] += gain;
        }
        self.steps += 1;
        self.updates += self.wet.len() as u64;
        let sound = |cell: usize| (0.5..2.0).contains(&self.seen[cell].density);
        if let Some(&cell) = self.wet.iter().find(|cell| !sound(**cell)) {
            return Err(Breakdown {
                time: self.time(),
                position: centre(&self.case, self.scaling.cell_size, self.place(cell)),
                what: "the density there is no longer near 1 in lattice units".into(),
                advice: "this scheme is less stable than the program's own (no `preset`, `lattice` and `collision`); \
                         set a smaller `time_step` or `lattice_speed` under [lbm]"
                    .into(),
            });
        }
        self.convert();
        Ok(())
    }

    fn see(&self, snapshot: &mut Snapshot) {
        let size = self.scaling.cell_size;
        let stress = self.scaling.stress_unit();
        let symmetric = |n: usize| self.case.domain.sides[n] == Side::Symmetry;
        let wet = |cell: usize| f64::from(u8::from(self.kinds[cell] != Kind::Air));
        let all = 0..self.kinds.len();
        let of = |see: &dyn Fn(&Seen) -> f64| all.clone().map(|n| wet(n) * see(&self.seen[n])).collect();
        let velocity = |n: usize| wet(n) * self.scaling.velocity_unit() * DVec3::from(self.seen[n].velocity);
        let cells = Cells {
            origin: self.case.domain.min,
            size,
            count: self.count,
            fill: all.clone().map(|n| self.fill_of(n)).collect(),
            pressure: of(&|seen| (seen.density - 1.0) / 3.0 * stress),
            velocity: all.clone().map(velocity).collect(),
            shear_rate: of(&|seen| seen.shear_rate / self.scaling.time_step),
            stress: of(&|seen| seen.stress * stress),
            solid: vec![0; self.kinds.len()],
            density: self.scaling.density,
            domain: [self.case.domain.min, self.case.domain.max],
            symmetry: [0, 1, 2].map(|a| [symmetric(2 * a), symmetric(2 * a + 1)]),
            ..Cells::default()
        };
        *snapshot = Snapshot { time: self.time(), fluid: Fluid::Cells(cells), ..Snapshot::default() };
    }

    fn load(&self) -> Load {
        Load {
            wet: self.wet.len(),
            allocated: self.kinds.len(),
            bytes: Self::BYTES * self.kinds.len(),
            updates: self.updates,
            iterations: [0; 2],
        }
    }

    fn save(&self) -> State {
        let arrays = vec![
            ("populations".into(), Array::F64(self.front.as_flattened().to_vec())),
            ("mass".into(), Array::F64(self.mass.clone())),
            ("seen".into(), Array::F64(bytemuck::cast_slice(&self.seen).to_vec())),
            ("kinds".into(), Array::U8(self.kinds.iter().map(|kind| *kind as u8).collect())),
        ];
        State { header: serde_json::json!({ "for": self.identity(), "steps": self.steps }), arrays }
    }

    fn restore(&mut self, state: &State) -> Result<(), RestoreError> {
        let missing = |name: &str| RestoreError::Array(name.into());
        let found = state.header["for"].as_str().unwrap_or("another program").to_owned();
        if found != self.identity() {
            return Err(RestoreError::Mismatch { expected: self.identity(), found });
        }
        let array = |name: &str| state.arrays.iter().find(|(n, _)| n == name).map(|(_, array)| array);
        let numbers = |name: &str, each: usize| match array(name) {
            Some(Array::F64(values)) if values.len() == each * self.kinds.len() => Ok(values),
            _ => Err(missing(name)),
        };
        let (populations, mass, seen) =
            (numbers("populations", Q)?, numbers("mass", 1)?, numbers("seen", 6)?);
        let Some(Array::U8(kinds)) = array("kinds") else { return Err(missing("kinds")) };
        let kinds: Option<Vec<Kind>> = kinds.iter().map(|kind| Kind::of(*kind)).collect();
        let kinds = kinds.filter(|kinds| kinds.len() == self.kinds.len()).ok_or_else(|| missing("kinds"))?;
        self.steps = state.header["steps"].as_u64().ok_or_else(|| missing("steps"))?;
        self.front = populations.as_chunks().0.to_vec();
        self.mass = mass.clone();
        self.seen = bytemuck::cast_slice(seen).to_vec();
        self.kinds = kinds;
        self.list();
        Ok(())
    }
}
