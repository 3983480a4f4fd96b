//! What is measured of a cast: in all of it, in beams, and through planes.

use tremie_case::{Beam, Cuts, Plane};
use tremie_numerics::DVec3;
use tremie_simulation::gauges::{Held, cut, half_height, held};
use tremie_simulation::{Cells, Fluid};
use tremie_suspension::Inclusions;
use tremie_suspension::orientation::{Block, Crossing, Principal, Section, components, principal};

use super::Cast;

/// Names of the parts of which figures are told, in their order.
pub(super) const PARTS: [&str; 3] = ["whole", "lower half", "upper half"];

/// The figures of a cast.
pub(super) struct Figures {
    /// The folder of the run.
    pub(super) run: String,
    /// What the case is called.
    pub(super) title: String,
    /// Simulated time in s.
    pub(super) time: f64,
    /// Of all of it, and its lower and upper half by the volume of the fluid.
    pub(super) cast: [Lying; 3],
    /// Of beams.
    pub(super) beams: Vec<BeamFigures>,
    /// Of planes.
    pub(super) planes: Vec<PlaneFigures>,
}

/// How fibres lie in a part of the cast.
pub(super) struct Lying {
    /// What the part holds.
    pub(super) held: Held,
    /// Principal values and axes of the orientation tensor, if there are fibres.
    pub(super) principal: Option<Principal>,
}

/// Fibres through a section.
pub(super) struct Through {
    /// The fibres and what of the section is wet.
    pub(super) crossing: Crossing,
    /// The orientation factor alpha; not a number where there is none.
    pub(super) factor: f64,
}

/// The figures of a beam.
pub(super) struct BeamFigures {
    /// What it is called.
    pub(super) name: String,
    /// What of it lies in the domain.
    pub(super) block: Block,
    /// Its axis: 0, 1, 2 for x, y, z.
    pub(super) along: usize,
    /// Where its section is, along the axis, in m.
    pub(super) at: f64,
    /// Of all of it, and its lower and upper half by height.
    pub(super) parts: [Lying; 3],
    /// Its section in the middle.
    pub(super) section: Through,
}

/// The figures of a plane.
pub(super) struct PlaneFigures {
    /// What it is called.
    pub(super) name: String,
    /// Fibres through it.
    pub(super) through: Through,
}

impl Figures {
    /// Measures a cast; what is to be cut out of it lies in its domain, at least in part.
    pub(super) fn new(cast: &Cast, cuts: Option<&Cuts>) -> anyhow::Result<Self> {
        let Fluid::Cells(cells) = &cast.state.fluid;
        let bodies = &cast.state.inclusions;
        let run = cast.folder.path().display().to_string();
        let parts = Lying::parts(cells, bodies, &Block::SPACE, half_height(cells));
        let share = parts[0].held.share();
        let domain = Block { low: cast.case.domain.min, high: cast.case.domain.max };
        let (mut beams, mut planes) = (Vec::new(), Vec::new());
        if let Some(cuts) = cuts {
            let outside = |what: &str, n: usize, key: &str, name: &str| {
                let [low, high] = [domain.low, domain.high].map(millimetres);
                let problem = format!("{what} `{name}` lies outside the domain of {run}");
                cuts.refuse(&format!("{what}.{n}.{key}"), problem, format!("that goes from {low} to {high}"))
            };
            for (n, beam) in cuts.beams.iter().enumerate() {
                let found = BeamFigures::new(cells, bodies, beam, &domain);
                beams.push(found.ok_or_else(|| outside("beam", n, "min", &beam.name))?);
            }
            for (n, plane) in cuts.planes.iter().enumerate() {
                let found = PlaneFigures::new(cells, bodies, plane, &domain, share);
                planes.push(found.ok_or_else(|| outside("plane", n, "point", &plane.name))?);
            }
        }
        let (title, time) = (cast.case.title.clone(), cast.state.time);
        Ok(Self { run, title, time, cast: parts, beams, planes })
    }
}

/// A point as one would write it.
fn millimetres(point: DVec3) -> String {
    let [x, y, z] = point.to_array().map(|x| (1e6 * x).round() / 1e3);
    format!("[\"{x} mm\", \"{y} mm\", \"{z} mm\"]")
}

impl Lying {
    fn new(cells: &Cells, bodies: &Inclusions, block: &Block) -> Self {
        let held = held(cells, bodies, block);
        Self { held, principal: held.tensor().as_ref().map(principal) }
    }

    /// Of a block, and of what is below and above a height in m.
    fn parts(cells: &Cells, bodies: &Inclusions, block: &Block, height: f64) -> [Self; 3] {
        let lower = Block { high: block.high.with_z(height), ..*block };
        let upper = Block { low: block.low.with_z(height), ..*block };
        [*block, lower, upper].map(|part| Self::new(cells, bodies, &part))
    }

    /// The six components of the orientation tensor, if there are fibres: 11, 22, 33, 12, 13, 23.
    pub(super) fn components(&self) -> Option<[f64; 6]> {
        self.held.tensor().as_ref().map(components)
    }

    /// The axis along which most fibres lie: of both directions the one towards larger x, or else y, or else z.
    pub(super) fn axis(&self) -> Option<DVec3> {
        let axis = self.principal.as_ref()?.axes[0];
        let first = axis.to_array().into_iter().find(|x| x.abs() > 1e-12)?;
        Some(first.signum() * axis)
    }

    /// The angle in degrees of this axis to x in the horizontal plane, above -90 to 90; none if it is upright.
    pub(super) fn azimuth(&self) -> Option<f64> {
        let axis = self.axis()?;
        (axis.x.hypot(axis.y) > 1e-6).then(|| axis.y.atan2(axis.x).to_degrees())
    }
}

impl Through {
    /// Fibres through a section, where they have a share of the volume.
    fn new(crossing: Crossing, share: f64) -> Self {
        let factor = crossing.orientation_factor(share);
        Self { crossing, factor: if factor.is_finite() { factor } else { f64::NAN } }
    }

    /// Fibres for each m2; not a number where there is no concrete.
    pub(super) fn density(&self) -> f64 {
        if self.crossing.section > 0.0 { self.crossing.density() } else { f64::NAN }
    }
}

impl BeamFigures {
    /// Measures a beam; none if it lies outside the domain.
    fn new(cells: &Cells, bodies: &Inclusions, beam: &Beam, domain: &Block) -> Option<Self> {
        let block = Block { low: beam.min.max(domain.low), high: beam.max.min(domain.high) };
        if !block.low.cmplt(block.high).all() {
            return None;
        }
        let middle = 0.5 * (beam.min + beam.max);
        // Where the domain ends within the beam its halves are still those of the beam.
        let height = middle.z.clamp(block.low.z, block.high.z);
        let parts = Lying::parts(cells, bodies, &block, height);
        let at = middle[beam.along];
        let crossing = cut(cells, bodies, &Section::of_block(&block, beam.along, at));
        let section = Through::new(crossing, parts[0].held.share());
        Some(Self { name: beam.name.clone(), block, along: beam.along, at, parts, section })
    }
}

impl PlaneFigures {
    /// Measures a plane; none if it lies outside the domain.
    fn new(cells: &Cells, bodies: &Inclusions, plane: &Plane, domain: &Block, share: f64) -> Option<Self> {
        let section = Section::around(plane.point, plane.normal, plane.size);
        let [one, two] = section.sides;
        let corners = [DVec3::ZERO, one, two, one + two].map(|way| section.corner + way);
        let low = corners.into_iter().fold(DVec3::INFINITY, DVec3::min);
        let high = corners.into_iter().fold(DVec3::NEG_INFINITY, DVec3::max);
        if low.cmpgt(domain.high).any() || high.cmplt(domain.low).any() {
            return None;
        }
        let through = Through::new(cut(cells, bodies, &section), share);
        Some(Self { name: plane.name.clone(), through })
    }
}
