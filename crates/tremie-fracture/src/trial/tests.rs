//! Beams and prisms against beam theory, fracture energy and equilibrium.

use super::*;
use crate::fibres::{Orientation, Placement};
use crate::{Grading, Loading};
use crate::{pull_out, softening};

const FOUR_POINT: Loading = Loading::FourPoint { span: 0.45, inner: 0.15 };
const THREE_POINT: Loading = Loading::ThreePoint { span: 0.5 };

/// The thesis's beam without fibres.
fn beam(loading: Loading, distance: f64, seed: u64) -> Setup {
    Setup {
        size: DVec3::new(0.6, 0.15, 0.15),
        crack: 0.3,
        anywhere: false,
        notch: if loading == THREE_POINT { 0.025 } else { 0.0 },
        loading,
        modulus: 30e9,
        softening: softening::THESIS,
        bond: pull_out::THESIS,
        fibres: Vec::new(),
        shear_lag: true,
        grading: Grading { finest: distance, coarsest: 0.03 },
        seed,
    }
}

fn run(trial: &mut Trial, end: f64) -> Vec<Reading> {
    let mut readings = Vec::new();
    while trial.last().opening < end * (1.0 - 1e-9) {
        let at = trial.last().opening;
        let step = if at < 0.05999e-3 {
            2.5e-6
        } else if at < 0.4999e-3 {
            0.02e-3
        } else {
            0.1e-3
        };
        readings.extend(trial.advance((at + step).min(end)).unwrap());
    }
    readings
}

fn peak(readings: &[Reading]) -> Reading {
    *readings.iter().max_by(|a, b| a.stress.total_cmp(&b.stress)).unwrap()
}

/// Energy goes where it should, and does not appear from nowhere.
fn balanced(readings: &[Reading]) {
    let worst = readings.iter().map(|r| r.imbalance().abs()).fold(0.0, f64::max);
    assert!(worst < 0.005, "{worst}");
}

#[test]
fn a_beam_bends_as_beam_theory_says() {
    // P l^3 / (48 E I) + P l / (4 k G A) and 23 P l^3 / (1296 E I) + P l / (6 k G A), k = 5/6, G = E/2; the lattice is 2 % stiffer at 20 mm
    // (the deflection of the load point also holds what the platens press in).
    for (loading, exact) in [(FOUR_POINT, 1.54444e-9), (THREE_POINT, 2.50206e-9)] {
        let mut setup = Setup { notch: 0.0, ..beam(loading, 0.02, 1) };
        setup.grading.coarsest = 0.02;
        let trial = Trial::new(setup).unwrap();
        let u = trial.elastic();
        let at = |x: f64| {
            let of = |n: &usize| {
                (trial.mesh().nodes[*n].x - x).abs() < 0.02 && (trial.mesh().nodes[*n].z - 0.075).abs() < 0.03
            };
            let cells: Vec<usize> = (0..trial.mesh().nodes.len()).filter(of).collect();
            cells.iter().map(|n| u[6 * n + 2]).sum::<f64>() / cells.len() as f64
        };
        let span = if loading == FOUR_POINT { 0.45 } else { 0.5 };
        let middle = 0.5 * (at(0.3 - 0.5 * span) + at(0.3 + 0.5 * span)) - at(0.3);
        assert!((middle / exact - 1.0).abs() < 0.08, "{loading:?}: {middle:e}");
        assert!(trial.residual() < 1e-10);
    }
}

#[test]
fn a_prism_in_tension_uses_up_its_fracture_energy() {
    let grading = Grading { finest: 0.02, coarsest: 0.03 };
    let setup =
        Setup { size: DVec3::new(0.2, 0.1, 0.1), crack: 0.1, grading, ..beam(Loading::Tension, 0.02, 2) };
    let mut trial = Trial::new(setup).unwrap();
    let readings = run(&mut trial, 0.35e-3);
    let last = readings.last().unwrap();
    assert!((last.work / (125.0 * 0.01) - 1.0).abs() < 0.005, "{}", last.work / 1.25);
    assert!(last.load.abs() < 1e-5 * 2e6 * 0.01);
    for reading in &readings {
        // Opening and elongation: the jump holds its own two half cells.
        let plane = &trial.mesh().plane;
        let length = plane.iter().map(|facet| facet.length * facet.area).sum::<f64>() / 0.01;
        let law = softening::THESIS.spring(length, 30e9);
        let w = reading.opening - reading.stress * length / 30e9;
        let elongation = reading.stress * 0.2 / 30e9 + w;
        assert!((law.stress(reading.opening) - reading.stress).abs() < 0.01 * 2e6, "{reading:?}");
        assert!((reading.deflection - elongation).abs() < 1e-6, "{reading:?}");
    }
    assert!(peak(&readings).stress < 2e6 * (1.0 + 1e-9));
    balanced(&readings);
}

#[test]
fn a_plain_beam_breaks_as_its_fracture_energy_says() {
    let mut trial = Trial::new(beam(FOUR_POINT, 0.015, 1)).unwrap();
    let readings = run(&mut trial, 1.2e-3);
    assert!((peak(&readings).stress / 3.133e6 - 1.0).abs() < 0.005, "{}", peak(&readings).stress);
    // A crack that opens linearly from nothing at the upper face to C at the lower: the mean of the work up to C.
    let work = readings.last().unwrap().work / (125.0 * 0.0225);
    assert!((work - 0.9361).abs() < 0.003, "{work}");
    balanced(&readings);
    // Rigid halves: the opening is 4 h / l times the deflection (Svec 2013, Eq. 7.2).
    let rigid = 0.45 / (4.0 * 0.15) * readings.last().unwrap().opening;
    assert!((readings.last().unwrap().middle / rigid - 1.0).abs() < 0.02);
    // The same from a state that was saved.
    let state = trial.save();
    let mut again = Trial::new(trial.setup().clone()).unwrap();
    again.restore(state.clone()).unwrap();
    let [a, b] = [&mut trial, &mut again].map(|trial| *trial.advance(1.25e-3).unwrap().last().unwrap());
    assert_eq!(a, b);
    let mut other = Trial::new(beam(FOUR_POINT, 0.02, 1)).unwrap();
    assert_eq!(other.restore(state), Err(TrialError::Foreign));
}

#[test]
fn a_notched_beam_cracks_from_its_notch() {
    let mut trial = Trial::new(beam(THREE_POINT, 0.015, 1)).unwrap();
    let readings = run(&mut trial, 1.2e-3);
    let top = peak(&readings);
    assert!((top.stress / 3.49e6 - 1.0).abs() < 0.02, "{}", top.stress);
    assert!((0.033e-3..0.041e-3).contains(&top.opening), "{}", top.opening);
    let work = readings.last().unwrap().work / (125.0 * 0.01875);
    assert!((work - 0.923).abs() < 0.006, "{work}");
    balanced(&readings);
}

#[test]
fn fibres_hold_the_crack_and_their_work_is_counted() {
    let placement =
        Placement { length: 0.06, diameter: 0.75e-3, share: 0.005, orientation: Orientation::Random };
    let plain = beam(FOUR_POINT, 0.018, 1);
    let fibres = placement.sow(plain.size, 3);
    let mut trial = Trial::new(Setup { fibres, ..plain }).unwrap();
    let crossing = crate::fibres::count(&trial.setup().fibres, 0.3, 0.0, trial.setup().size);
    assert_eq!(trial.bridges().len(), crossing.fibres);
    let readings = run(&mut trial, 2.5e-3);
    balanced(&readings);
    let last = readings.last().unwrap();
    assert!(last.stress > 1e6 && last.fibre_loss > last.matrix_loss, "{last:?}");
    // What bends the beam is the moment of the fibres' forces about the upper face, but for the little that is left of the matrix.
    let moment: f64 = trial.bridges().iter().map(|b| b.force * (0.15 - b.crossing.point.z)).sum();
    let exact = last.load / 2.0 * 0.15;
    assert!((moment / exact - 1.0).abs() < 0.06, "{moment} {exact}");
}

#[test]
fn fibres_stronger_than_the_matrix_take_over_where_it_cracks() {
    let grading = Grading { finest: 0.025, coarsest: 0.03 };
    let size = DVec3::new(0.2, 0.1, 0.1);
    let placement =
        Placement { length: 0.06, diameter: 0.75e-3, share: 0.02, orientation: Orientation::Aligned };
    for shear_lag in [false, true] {
        let fibres = placement.sow(size, 3);
        let plain = Setup { size, crack: 0.1, grading, fibres, shear_lag, ..beam(Loading::Tension, 0.02, 2) };
        let mut trial = Trial::new(plain).unwrap();
        let readings = run(&mut trial, 0.2e-3);
        assert!(peak(&readings).stress > 1.2 * 2e6 && peak(&readings).opening > 1e-5);
        balanced(&readings);
    }
}

#[test]
fn a_crack_anywhere_breaks_a_prism_at_its_strength_wherever_it_looks() {
    let setup = Setup {
        size: DVec3::new(0.2, 0.1, 0.1),
        crack: 0.1,
        anywhere: true,
        ..beam(Loading::Tension, 0.02, 3)
    };
    let mut trial = Trial::new(setup).unwrap();
    let readings = run(&mut trial, 0.35e-3);
    assert!((peak(&readings).stress / 2e6 - 1.0).abs() < 0.005, "{}", peak(&readings).stress);
    balanced(&readings);
    // A crack of many facets is rough; over its projection it takes the fracture energy, and a little more: two fifths more where facets along the way of the opening hold cells back.
    // (Of three lattices this is one whose crack is single; where two overlap, as in that of seed 1, it takes 1.22.)
    let work = readings.last().unwrap().work / 1.25;
    assert!((0.99..1.1).contains(&work), "{work}");
    assert!(trial.crack().iter().all(|(corners, opening)| corners.len() == opening.len()));
    let projected: f64 = trial
        .crack()
        .iter()
        .map(|(corners, _)| {
            let fan =
                (2..corners.len()).map(|k| (corners[k - 1] - corners[0]).cross(corners[k] - corners[0]).x);
            0.5 * fan.sum::<f64>().abs()
        })
        .sum();
    assert!(projected > 0.0099, "{projected}");
}

#[test]
fn a_crack_anywhere_stays_below_its_notch_and_goes_on_from_a_saved_state() {
    let plane = Setup { grading: Grading { finest: 0.025, coarsest: 0.03 }, ..beam(THREE_POINT, 0.025, 1) };
    let anywhere = Setup { anywhere: true, ..plane.clone() };
    let [mut a, mut b] = [plane, anywhere].map(|setup| Trial::new(setup).unwrap());
    let [one, other] = [&mut a, &mut b].map(|trial| run(trial, 0.1e-3));
    // By symmetry the same.
    assert!((peak(&other).stress / peak(&one).stress - 1.0).abs() < 0.01, "{}", peak(&other).stress);
    let state = b.save();
    let mut again = Trial::new(b.setup().clone()).unwrap();
    again.restore(state).unwrap();
    let [b, again] = [&mut b, &mut again].map(|trial| *trial.advance(0.11e-3).unwrap().last().unwrap());
    assert_eq!(b, again);
}

#[test]
fn what_cannot_be_tested_is_refused() {
    let coarse = beam(FOUR_POINT, 0.2, 1);
    assert!(matches!(Trial::new(coarse), Err(TrialError::Coarse { .. })));
    let mut brittle = beam(FOUR_POINT, 0.02, 1);
    brittle.softening.kink_opening = 1e-9;
    assert!(matches!(Trial::new(brittle), Err(TrialError::Brittle { .. })));
}
