//! Velocities and pressures of stiff fluid, which must be found together: the pressures p under which the viscous part of a step, u = V(p), leaves no excess s of pressure by itself ([`crate::stiffness`]).
//!
//! s is as good as linear in p. From round to round p falls by s, as Uzawa has it, but as far as leaves least of s, and by directions in which it has not fallen before (generalised conjugate residuals; Eisenstat, Elman
//! and Schultz 1983): where viscosities differ by orders of magnitude between neighbours, and at the foot of a front, a fixed share of s would be too much somewhere, and grow.

use tremie_numerics::DVec3;

use crate::Failure;

/// Rounds at most, and what share of itself the pressure may be wrong by.
const ROUNDS: usize = 5;
const SMALL: f64 = 0.05;
/// How many times the stress pressures fall by at most in a round: where a few nodes bear most of it and hardly answer, all others would be driven by whatever little they have of it.
const FARTHEST: f64 = 10.0;

/// The viscous part of a step under pressures.
pub trait Pressed {
    /// What velocities have of divergence too much, as a method tells it.
    type Excess;

    /// Gradients of pressures in Pa, in Pa/m.
    fn slopes(&self, pressures: &[f64]) -> Vec<DVec3>;

    /// Brings velocities in m/s, from those that are likely, to what they are at the end of the step under pressures in Pa and their `slopes`. Gives the iterations.
    ///
    /// # Errors
    /// If the linear system cannot be solved.
    fn advance(
        &self,
        slopes: &[DVec3],
        pressures: &[f64],
        velocities: &mut [DVec3],
    ) -> Result<usize, Failure>;

    /// What such velocities have of excess, and what pressures in Pa are too large by for that.
    fn excess(&self, slopes: &[DVec3], pressures: &[f64], velocities: &[DVec3]) -> (Self::Excess, Vec<f64>);

    /// Takes pressures off those that cannot have any.
    fn settle(&self, pressures: &mut [f64]);
}

/// What pushed velocities, by gradients in Pa/m, and what is left of excess, with what pressures in Pa may still fall by; and iterations that it took.
pub struct Balanced<E> {
    /// Gradients in Pa/m under which velocities are.
    pub pushed: Vec<DVec3>,
    /// What is left of excess.
    pub excess: E,
    /// What pressures in Pa may still fall by.
    pub stress: Vec<f64>,
    /// Iterations that it took.
    pub iterations: usize,
}

/// A way that has been tried: changes of pressures in Pa and velocities in m/s, and of the stress in Pa.
type Tried = (Vec<f64>, Vec<DVec3>, Vec<f64>);

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn add(to: &mut [f64], share: f64, of: &[f64]) {
    to.iter_mut().zip(of).for_each(|(to, of)| *to += share * of);
}

fn add_vectors(to: &mut [DVec3], share: f64, of: &[DVec3]) {
    to.iter_mut().zip(of).for_each(|(to, of)| *to += share * *of);
}

/// What nodes so far apart in m bear beside their pressures, by a weight in N/m3, viscosities in Pa s that they feel and shear rates in 1/s: shear stress, and a layer of themselves. The sum of the squares, in Pa2.
pub fn else_borne(weight: DVec3, spacing: f64, felt: &[f64], shear_rates: &[f64]) -> f64 {
    let layer = spacing * spacing * weight.length_squared();
    felt.iter().zip(shear_rates).map(|(viscosity, rate)| (viscosity * rate).powi(2) + layer).sum()
}

/// Brings velocities in m/s to the end of the step, and pressures in Pa to those under which they are, from such as belong to each other, with gradients `pushed` in Pa/m. Where pressures are none, as in channels and in
/// the air, there is `else_borne` ([`else_borne`]) beside them, in Pa2.
///
/// # Errors
/// If the linear system of a step cannot be solved.
pub fn balance<P: Pressed>(
    step: &P,
    mut pushed: Vec<DVec3>,
    pressures: &mut [f64],
    velocities: &mut [DVec3],
    else_borne: f64,
) -> Result<Balanced<P::Excess>, Failure> {
    let is_small = |stress: &[f64], pressures: &[f64]| {
        dot(stress, stress) <= SMALL * SMALL * (dot(pressures, pressures) + else_borne)
    };
    let mut iterations = 0;
    let (mut excess, mut stress) = step.excess(&pushed, pressures, velocities);
    let mut tried: Vec<Tried> = Vec::new();
    for _ in 0..ROUNDS {
        if is_small(&stress, pressures) {
            break;
        }
        let (mut p, mut u) = (pressures.to_owned(), velocities.to_owned());
        add(&mut p, -1.0, &stress);
        step.settle(&mut p);
        let slopes = step.slopes(&p);
        iterations += step.advance(&slopes, &p, &mut u)?;
        let (_, mut change) = step.excess(&slopes, &p, &u);
        add(&mut p, -1.0, pressures);
        add_vectors(&mut u, -1.0, velocities);
        add(&mut change, -1.0, &stress);
        for (dp, du, ds) in &tried {
            let share = -dot(&change, ds) / dot(ds, ds);
            add(&mut p, share, dp);
            add_vectors(&mut u, share, du);
            add(&mut change, share, ds);
        }
        let share = -dot(&stress, &change) / dot(&change, &change);
        // Nor is it finite where nothing changes.
        if share.is_nan() || share <= 0.0 {
            break;
        }
        let gone = share.min(FARTHEST);
        add(pressures, gone, &p);
        add_vectors(velocities, gone, &u);
        pushed = step.slopes(pressures);
        (excess, stress) = step.excess(&pushed, pressures, velocities);
        if gone == share {
            tried.push((p, u, change));
        }
    }
    if !is_small(&stress, pressures) {
        // A share of it might grow where the fluid has not followed.
        stress.fill(0.0);
    }
    Ok(Balanced { pushed, excess, stress, iterations })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Nodes that go up by what presses them, over how hard that is; they are to go so fast.
    struct Springs {
        hard: Vec<f64>,
        wanted: Vec<f64>,
    }

    impl Pressed for Springs {
        type Excess = ();

        fn slopes(&self, pressures: &[f64]) -> Vec<DVec3> {
            pressures.iter().map(|p| *p * DVec3::Z).collect()
        }

        fn advance(&self, slopes: &[DVec3], _: &[f64], velocities: &mut [DVec3]) -> Result<usize, Failure> {
            velocities.iter_mut().zip(slopes).zip(&self.hard).for_each(|((u, g), hard)| *u = *g / *hard);
            Ok(1)
        }

        fn excess(&self, _: &[DVec3], _: &[f64], velocities: &[DVec3]) -> ((), Vec<f64>) {
            ((), velocities.iter().zip(&self.wanted).map(|(u, wanted)| u.z - wanted).collect())
        }

        fn settle(&self, _: &mut [f64]) {}
    }

    /// Falling by the whole of the stress would take tens of rounds where it is hard, and grow where it is soft.
    #[test]
    fn pressures_are_found_in_as_many_rounds_as_there_are_kinds_of_nodes() {
        let hard: Vec<f64> = (0..30).map(|n| [0.2, 1.0, 5.0][n % 3]).collect();
        let wanted: Vec<f64> = (0..30).map(|n| 1.0 + 0.1 * f64::from(n)).collect();
        let springs = Springs { hard, wanted };
        let (mut pressures, mut velocities) = (vec![0.0; 30], vec![DVec3::ZERO; 30]);
        let pushed = springs.slopes(&pressures);
        let found = balance(&springs, pushed, &mut pressures, &mut velocities, 0.0).unwrap();
        assert_eq!(found.iterations, 3);
        for (p, (hard, wanted)) in pressures.iter().zip(springs.hard.iter().zip(&springs.wanted)) {
            assert!((p / (hard * wanted) - 1.0).abs() < 1e-9, "{p}");
        }
        for (u, pushed) in velocities.iter().zip(&found.pushed) {
            assert!(u.z > 0.0 && pushed.z > 0.0);
        }
    }

    /// Where it is too hard to be found, pressures do not fall by what is left.
    #[test]
    fn what_is_not_found_is_left() {
        let hard: Vec<f64> = (0..30).map(|n| 1e-4 * f64::from(n + 1).powi(3)).collect();
        let springs = Springs { hard, wanted: vec![1.0; 30] };
        let (mut pressures, mut velocities) = (vec![0.0; 30], vec![DVec3::ZERO; 30]);
        let pushed = springs.slopes(&pressures);
        let found = balance(&springs, pushed, &mut pressures, &mut velocities, 0.0).unwrap();
        assert_eq!(found.iterations, ROUNDS);
        let ((), left) = springs.excess(&found.pushed, &pressures, &velocities);
        assert!(dot(&left, &left) > SMALL * SMALL * dot(&pressures, &pressures));
        assert!(found.stress.iter().all(|stress| *stress == 0.0));
    }
}
