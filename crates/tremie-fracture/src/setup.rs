//! A beam, how it is loaded, and what is read while its crack opens.

use tremie_numerics::DVec3;

use crate::fibres::Fibre;
use crate::nodes::Grading;
use crate::pull_out::Bond;
use crate::shear_lag::ShearLag;
use crate::softening::Softening;
use crate::sparse::Singular;

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
    /// Where the crack plane, or the notch, is along x.
    pub crack: f64,
    /// Whether the crack may leave that plane.
    pub anywhere: bool,
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
#[derive(Debug, Clone, Copy, Default, PartialEq)]
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

    /// Work in J that has been used up.
    pub fn lost(&self) -> f64 {
        self.matrix_loss + self.fibre_loss
    }

    /// What is missing of the work that was put in, as a share of it.
    pub fn imbalance(&self) -> f64 {
        let found = self.stored() + self.lost();
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
    pub(crate) fn lag(&self) -> Option<ShearLag> {
        let volume: f64 = self.fibres.iter().map(|fibre| fibre.section() * fibre.length()).sum();
        let share = volume / self.size.element_product();
        let counts = self.shear_lag && share > 0.0 && self.bond.modulus > self.modulus;
        counts.then_some(ShearLag { matrix: self.modulus, fibre: self.bond.modulus, share })
    }
}
