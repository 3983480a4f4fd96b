//! What standards read off a test, and how several tests are put together.

use crate::setup::Reading;

/// Openings in m at which EN 14651 reads the residual strengths f_R1 to f_R4.
pub const RESIDUAL: [f64; 4] = [0.5e-3, 1.5e-3, 2.5e-3, 3.5e-3];
/// Opening in m up to which the limit of proportionality f_L is the largest stress.
pub const LIMIT: f64 = 0.05e-3;

/// Openings in m at which a test is read, up to an end: fine where the matrix cracks, coarser after. Those of the standard are among them.
pub fn openings(end: f64) -> Vec<f64> {
    const STEPS: [(f64, f64); 4] =
        [(0.06e-3, 2.5e-6), (0.5e-3, 20e-6), (1.5e-3, 50e-6), (f64::INFINITY, 100e-6)];
    let mut all = Vec::new();
    let mut from = 0.0;
    for (to, step) in STEPS {
        let to = end.min(to);
        let count = ((to - from) / step).round().max(1.0) as usize;
        if to > from {
            all.extend((1..=count).map(|k| from + (to - from) * k as f64 / count as f64));
            from = to;
        }
    }
    all
}

/// Strengths of one beam in Pa.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Strengths {
    /// Largest stress up to an opening of 0.05 mm: the limit of proportionality f_L.
    pub limit: f64,
    /// Stresses at openings of 0.5, 1.5, 2.5 and 3.5 mm: f_R1 to f_R4; not a number beyond the end.
    pub residual: [f64; 4],
    /// Largest stress of all.
    pub peak: f64,
    /// Opening in m there.
    pub peak_opening: f64,
    /// Work in J up to the end.
    pub work: f64,
    /// What the matrix and the fibres have used up of it.
    pub losses: [f64; 2],
    /// Largest share of the work that was found neither stored nor used up.
    pub imbalance: f64,
}

impl Strengths {
    /// Of the readings of a test.
    pub fn of(readings: &[Reading]) -> Self {
        let early = readings.iter().filter(|reading| reading.opening <= LIMIT * (1.0 + 1e-9));
        let limit = early.map(|reading| reading.stress).fold(0.0, f64::max);
        let first = |best: Option<Reading>, next: &Reading| match best {
            Some(best) if best.stress >= next.stress => Some(best),
            _ => Some(*next),
        };
        let top = readings.iter().fold(None, first);
        let last = readings.last();
        Self {
            limit,
            residual: RESIDUAL.map(|opening| stress_at(readings, opening)),
            peak: top.map_or(0.0, |reading| reading.stress),
            peak_opening: top.map_or(0.0, |reading| reading.opening),
            work: last.map_or(0.0, |reading| reading.work),
            losses: last.map_or([0.0; 2], |reading| [reading.matrix_loss, reading.fibre_loss]),
            imbalance: readings.iter().map(|reading| reading.imbalance().abs()).fold(0.0, f64::max),
        }
    }
}

/// Stress in Pa at an opening in m, between readings; not a number beyond them.
pub fn stress_at(readings: &[Reading], opening: f64) -> f64 {
    let Some(next) = readings.iter().position(|reading| reading.opening >= opening * (1.0 - 1e-9)) else {
        return f64::NAN;
    };
    let (before, stress) =
        if next == 0 { (0.0, 0.0) } else { (readings[next - 1].opening, readings[next - 1].stress) };
    let part = ((opening - before) / (readings[next].opening - before)).min(1.0);
    stress + part * (readings[next].stress - stress)
}

/// Several values of one quantity.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scatter {
    /// Their mean.
    pub mean: f64,
    /// Coefficient of variation; not a number for fewer than two.
    pub variation: f64,
    /// The value that 95 % of all beams exceed: m (1 - k V), k = t sqrt(1 + 1/n) with Student's t for an unknown scatter (EN 1990, D.7.2).
    pub characteristic: f64,
}

impl Scatter {
    /// Of some values.
    pub fn of(values: &[f64]) -> Self {
        let number = values.len() as f64;
        let mean = values.iter().sum::<f64>() / number;
        let squares = values.iter().map(|x| (x - mean).powi(2)).sum::<f64>();
        let deviation = (squares / (number - 1.0)).sqrt();
        let (variation, factor) = match values.len() {
            0 | 1 => (f64::NAN, f64::NAN),
            n => (deviation / mean, student(n - 1) * (1.0 + 1.0 / number).sqrt()),
        };
        Self { mean, variation, characteristic: (mean - factor * deviation).max(0.0) + 0.0 * factor }
    }
}

/// The 95 % quantile of Student's distribution.
fn student(freedom: usize) -> f64 {
    const TABLE: [f64; 30] = [
        6.314, 2.920, 2.353, 2.132, 2.015, 1.943, 1.895, 1.860, 1.833, 1.812, 1.796, 1.782, 1.771, 1.761,
        1.753, 1.746, 1.740, 1.734, 1.729, 1.725, 1.721, 1.717, 1.714, 1.711, 1.708, 1.706, 1.703, 1.701,
        1.699, 1.697,
    ];
    // Beyond the table, z + (z^3 + z) / (4 n).
    TABLE.get(freedom - 1).copied().unwrap_or(1.645 + 1.524 / freedom as f64)
}

/// The straight line through points that leaves the least squares: slope, value at zero, and the share R2 of the scatter that it explains.
pub fn regression(points: &[[f64; 2]]) -> [f64; 3] {
    let number = points.len() as f64;
    let [x, y] = [0, 1].map(|k| points.iter().map(|p| p[k]).sum::<f64>() / number);
    let sum = |f: &dyn Fn(f64, f64) -> f64| points.iter().map(|p| f(p[0] - x, p[1] - y)).sum::<f64>();
    let (xx, xy, yy) = (sum(&|a, _| a * a), sum(&|a, b| a * b), sum(&|_, b| b * b));
    let slope = xy / xx;
    [slope, y - slope * x, xy * xy / (xx * yy)]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn reading(opening: f64, stress: f64) -> Reading {
        Reading {
            opening,
            load: 0.0,
            stress,
            deflection: 0.0,
            middle: 0.0,
            work: 0.0,
            matrix_loss: 0.0,
            fibre_loss: 0.0,
            attempts: 1,
        }
    }

    #[test]
    fn strengths_are_read_at_the_openings_of_the_standard() {
        let all = openings(4e-3);
        for opening in RESIDUAL.into_iter().chain([LIMIT]) {
            assert!(all.iter().any(|x| (x - opening).abs() < 1e-9), "{opening}");
        }
        assert!(all.windows(2).all(|pair| pair[1] > pair[0]) && (all[all.len() - 1] - 4e-3).abs() < 1e-12);
        assert!((openings(0.03e-3).last().unwrap() - 0.03e-3).abs() < 1e-15);
        // A stress that falls from 4 MPa by 1 MPa for each mm after 0.02 mm.
        let readings: Vec<Reading> = all
            .iter()
            .filter(|x| **x < 2.6e-3)
            .map(|x| reading(*x, if *x < 0.02e-3 { 2e11 * x } else { 4e6 - 1e9 * (x - 0.02e-3) }))
            .collect();
        let found = Strengths::of(&readings);
        assert!((found.limit - 4e6).abs() < 1.0 && (found.peak_opening - 0.02e-3).abs() < 1e-9);
        assert!((found.residual[1] - 2.52e6).abs() < 1.0 && found.residual[3].is_nan());
        assert!((stress_at(&readings, 1.025e-3) - 2.995e6).abs() < 1.0);
    }

    #[test]
    fn few_beams_have_a_low_characteristic_value() {
        let three = Scatter::of(&[2.0, 3.0, 4.0]);
        assert!((three.mean - 3.0).abs() < 1e-12 && (three.variation - 1.0 / 3.0).abs() < 1e-12);
        // k = 3.37 for three (EN 1990, table D1).
        let mild = Scatter::of(&[9.0, 10.0, 11.0]);
        assert!((mild.characteristic - (10.0 - 3.37)).abs() < 0.005);
        assert_eq!(three.characteristic, 0.0);
        assert!(Scatter::of(&[1.0]).characteristic.is_nan());
    }

    #[test]
    fn a_line_is_found() {
        let [slope, start, share] = regression(&[[1.0, 2.0], [2.0, 4.5], [3.0, 6.0]]);
        assert!((slope - 2.0).abs() < 1e-12 && (start - 1.0 / 6.0).abs() < 1e-12);
        assert!((share - 0.9796).abs() < 1e-3);
    }
}
