//! A beam file as a lattice sees it.

use tremie_case::{BeamCase, BeamFibres, BeamTest, CaseError, Lying};
use tremie_fracture::fibres::{Fibre, Orientation, Placement};
use tremie_fracture::{Bond, Grading, Loading, Setup, Softening};
use tremie_numerics::DVec3;

/// How fibres hold.
pub(crate) fn bond(case: &BeamCase) -> Bond {
    let bond = &case.bond;
    Bond {
        modulus: bond.modulus,
        strength: bond.strength,
        friction: bond.friction,
        hardening: bond.hardening,
        snubbing: bond.snubbing,
        spalling: bond.spalling,
        bending: bond.bending,
    }
}

/// The fibres of the beam with a seed; those that are listed do not depend on it.
pub(crate) fn fibres(case: &BeamCase, seed: u64) -> Vec<Fibre> {
    match &case.fibres {
        None => Vec::new(),
        Some(BeamFibres::Listed(list)) => list
            .iter()
            .filter_map(|(ends, diameter)| {
                Fibre { ends: *ends, diameter: *diameter }.within(DVec3::ZERO, case.size)
            })
            .collect(),
        Some(BeamFibres::Random { length, diameter, share, lying }) => {
            let orientation = match lying {
                Lying::Random => Orientation::Random,
                Lying::Aligned => Orientation::Aligned,
                Lying::Planar => Orientation::Planar,
                Lying::Concentrated(k) => Orientation::Concentrated(*k),
            };
            Placement { length: *length, diameter: *diameter, share: *share, orientation }
                .sow(case.size, seed)
        }
    }
}

/// The test of the beam with a seed.
pub(crate) fn setup(case: &BeamCase, seed: u64) -> Setup {
    let (loading, notch, offset) = match case.test {
        BeamTest::Nsbt { span, inner, offset } => (Loading::FourPoint { span, inner }, 0.0, offset),
        BeamTest::En14651 { span, notch } => (Loading::ThreePoint { span }, notch, 0.0),
        // A single fibre has no lattice.
        BeamTest::Tension | BeamTest::PullOut { .. } => (Loading::Tension, 0.0, 0.0),
    };
    let matrix = &case.matrix;
    let [kink_stress, kink_opening] = matrix.kink;
    let last_opening = matrix.last_opening;
    Setup {
        size: case.size,
        crack: 0.5 * case.size.x + offset,
        anywhere: case.lattice.anywhere,
        notch,
        loading,
        modulus: matrix.modulus,
        softening: Softening { strength: matrix.strength, kink_stress, kink_opening, last_opening },
        bond: bond(case),
        fibres: fibres(case, seed),
        shear_lag: case.bond.shear_lag,
        grading: Grading { finest: case.lattice.finest, coarsest: case.lattice.coarsest },
        seed,
    }
}

/// What the lattice cannot do with a beam.
pub(crate) fn check(case: &BeamCase) -> Result<(), CaseError> {
    if let BeamTest::PullOut { .. } = case.test {
        return Ok(());
    }
    let seed = case.lattice.seed;
    if case.fibres.is_some() && fibres(case, seed).is_empty() {
        return Err(case.refuse(
            "fibres",
            "there are no fibres in the beam",
            "its lower corner is the origin; leave the section out for plain concrete",
        ));
    }
    let setup = setup(case, seed);
    let longest = setup.softening.longest(setup.modulus);
    if 2.0 * case.lattice.finest > longest {
        let problem = format!("the softening is too steep for cells of {} mm", 1e3 * case.lattice.finest);
        return Err(case.refuse(
            "matrix.kink_opening",
            problem,
            "make the softening longer, or `spacing` smaller",
        ));
    }
    Ok(())
}
