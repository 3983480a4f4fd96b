//! Beams and prisms against beam theory, fracture energy and equilibrium.

use super::*;
use crate::{pull_out, softening};

/// The thesis's beam in four-point bending.
fn beam(distance: f64, seed: u64) -> Setup {
    Setup {
        size: DVec3::new(0.6, 0.15, 0.15),
        crack: 0.3,
        notch: 0.0,
        loading: Loading::FourPoint { span: 0.45, inner: 0.15 },
        modulus: 30e9,
        softening: softening::THESIS,
        bond: pull_out::THESIS,
        fibres: Vec::new(),
        shear_lag: true,
        grading: Grading { finest: distance, coarsest: 0.025 },
        seed,
    }
}

fn steps(end: f64) -> Vec<f64> {
    let mut all = Vec::new();
    let mut at = 0.0;
    while at < end - 1e-9 {
        at += if at < 0.06e-3 - 1e-9 { 2.5e-6 } else if at < 0.5e-3 - 1e-9 { 0.02e-3 } else { 0.1e-3 };
        all.push(at.min(end));
    }
    all
}

fn run(setup: Setup, end: f64) -> (Trial, Vec<Reading>) {
    let mut trial = Trial::new(setup).unwrap();
    let mut readings = Vec::new();
    for opening in steps(end) {
        readings.extend(trial.advance(opening).unwrap());
    }
    (trial, readings)
}

#[test]
fn a_plain_beam_breaks_as_its_fracture_energy_says() {
    let (_, readings) = run(beam(0.015, 1), 1.2e-3);
    let peak = readings.iter().max_by(|a, b| a.stress.total_cmp(&b.stress)).unwrap();
    let last = readings.last().unwrap();
    let share = last.work / (125.0 * 0.0225);
    let tail = readings.iter().find(|r| (r.opening - 1e-3).abs() < 1e-9).unwrap();
    let cost: usize = readings.iter().map(|r| r.attempts).sum();
    println!("peak {} at {}; share {share}; tail {}; {} {cost}", peak.stress, peak.opening, tail.stress, readings.len());
    println!("deflection {} middle {}", last.deflection, last.middle);
    let worst = readings.iter().map(|r| r.imbalance().abs()).fold(0.0, f64::max);
    println!("imbalance {worst}");
    assert!((peak.stress / 3.133e6 - 1.0).abs() < 0.005);
}

#[test]
#[ignore]
fn explore() {
    for (d, coarse) in [(0.015, 0.015), (0.012, 0.025), (0.01, 0.025)] {
        for seed in [1, 2] {
            let start = std::time::Instant::now();
            let mut setup = beam(d, seed);
            setup.grading.coarsest = coarse;
            let mut trial = Trial::new(setup).unwrap();
            let made = start.elapsed().as_secs_f64();
            let mut readings = Vec::new();
            for opening in steps(1.2e-3) {
                readings.extend(trial.advance(opening).unwrap());
            }
            let peak = readings.iter().max_by(|a, b| a.stress.total_cmp(&b.stress)).unwrap();
            let last = readings.last().unwrap();
            let g = 125.0 * 0.0225;
            let at = |x: f64| readings.iter().find(|r| (r.opening - x).abs() < 1e-9).map(|r| r.stress);
            println!("d {d} seed {seed} nodes {} plane {}: peak {:.0} at {:.2e}; W {:.5} loss {:.5}; s(.3) {:?} s(1.0) {:?} resid {:.1e} made {made:.2} s all {:.2} s {} solves",
                trial.mesh.nodes.len(), trial.mesh.plane.len(), peak.stress, peak.opening, last.work / g, last.matrix_loss / g, at(0.3e-3), at(1e-3), trial.residual(), start.elapsed().as_secs_f64(), readings.iter().map(|r| r.attempts).sum::<usize>());
        }
    }
}
