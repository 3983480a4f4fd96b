//! How a test goes on: the opening of the crack grows, stiffnesses follow as secants, and the load comes out.
//!
//! With all stiffnesses fixed the opening is proportional to the load, so that the load at an opening is one linear solution. Stiffnesses
//! are then those of the jumps that were found, and so on, until nothing changes. The opening only grows: a load or deflection that falls
//! back is no trouble.

use crate::setup::{Reading, TrialError};
use crate::sparse::Singular;

/// Attempts at a step, and how often it is halved if they do not lead anywhere, or lose sight of energy.
const ATTEMPTS: usize = 150;
const HALVINGS: usize = 8;
/// How near, over what is asked, the nearest attempt at the shortest step must be: a facet that has two ways to go on may take none for good.
const NEARLY: f64 = 20.0;

/// How exactly a test is followed.
pub(crate) struct Care {
    /// Load and secants count as found when they change by no more than these shares.
    pub(crate) load: f64,
    pub(crate) secants: f64,
    /// Work that may get lost in a step, as a share of all work so far: load and deflection are joined by straight lines.
    pub(crate) slip: f64,
    /// Attempts after which secants are no longer taken as they come.
    pub(crate) patience: usize,
}

/// What cracks: a beam whose stiffness is a sum over places that soften.
pub(crate) trait Cracking {
    /// Unknowns for a load of 1 N with these secants, and the opening that they make in m.
    fn respond(&self, secants: &[f64]) -> Result<(Vec<f64>, f64), Singular>;
    /// The secants of all places at these unknowns, with what they have been through before.
    fn secants(&self, unknowns: &[f64]) -> Vec<f64>;
    /// How exactly it is followed.
    fn care(&self) -> Care;
    /// How much secants have changed, as a share.
    fn change(&self, old: &[f64], new: &[f64], unknowns: &[f64]) -> f64;
    /// Deflections in m at the load and in the middle, and what matrix and fibres have used up in J.
    fn found(&self, load: f64, unknowns: &[f64], secants: &[f64]) -> [f64; 4];
    /// Goes through these unknowns for good.
    fn commit(&mut self, unknowns: &[f64]);
}

/// How far a test has come.
pub(crate) struct Path {
    /// Openings in m and unknowns at the reading before the last, and at the last.
    pub(crate) steps: [(f64, Vec<f64>); 2],
    /// The last reading.
    pub(crate) last: Reading,
    /// Nominal stress in Pa for a load of 1 N.
    pub(crate) nominal: f64,
}

impl Path {
    /// Goes on to a larger opening in m: the readings on the way, and the last. A step is halved if it does not converge, or is so long that
    /// load times deflection is not the work that was done.
    pub(crate) fn advance(
        &mut self,
        body: &mut dyn Cracking,
        opening: f64,
    ) -> Result<Vec<Reading>, TrialError> {
        let mut readings = Vec::new();
        let mut ahead = vec![opening];
        while let Some(next) = ahead.last().copied() {
            let finest = ahead.len() > HALVINGS;
            match self.step(body, next, finest)? {
                Some((reading, unknowns)) if finest || self.slip(&reading) <= body.care().slip => {
                    body.commit(&unknowns);
                    self.last = reading;
                    let [_, newer] = std::mem::take(&mut self.steps);
                    self.steps = [newer, (reading.opening, unknowns)];
                    readings.push(reading);
                    ahead.pop();
                }
                None if finest => return Err(TrialError::Lost { opening: next }),
                _ => ahead.push(0.5 * (self.last.opening + next)),
            }
        }
        Ok(readings)
    }

    /// Work that gets lost on the way to a reading, as a share of all work so far.
    fn slip(&self, next: &Reading) -> f64 {
        let kept =
            |reading: &Reading| reading.stored() + reading.matrix_loss + reading.fibre_loss - reading.work;
        (kept(next) - kept(&self.last)).abs() / next.work
    }

    /// One step; nothing if it does not converge.
    fn step(
        &self,
        body: &dyn Cracking,
        opening: f64,
        finest: bool,
    ) -> Result<Option<(Reading, Vec<f64>)>, TrialError> {
        // As the unknowns went on before.
        let [(before, older), (now, newer)] = &self.steps;
        let ahead = if now > before { (opening - now) / (now - before) } else { 0.0 };
        let guess: Vec<f64> = newer.iter().zip(older).map(|(new, old)| new + ahead * (new - old)).collect();
        let mut secants = body.secants(&guess);
        let care = body.care();
        let (mut load, mut nearest) = (f64::INFINITY, None);
        let mut least = NEARLY * care.secants;
        for attempt in 1..=ATTEMPTS {
            // Nothing bears any more: the beam is in two.
            let (mut unknowns, each) = body.respond(&secants).map_err(|_| TrialError::Lost { opening })?;
            let found = opening / each;
            unknowns.iter_mut().for_each(|unknown| *unknown *= found);
            let next = body.secants(&unknowns);
            let change = body.change(&secants, &next, &unknowns);
            let close = (found - load).abs() <= care.load * found.abs() && change <= care.secants;
            load = found;
            let nearer = finest && change < least;
            if close || nearer {
                let [deflection, middle, matrix_loss, fibre_loss] = body.found(load, &unknowns, &secants);
                let last = &self.last;
                let reading = Reading {
                    opening,
                    load,
                    stress: load * self.nominal,
                    deflection,
                    middle,
                    work: last.work + 0.5 * (load + last.load) * (deflection - last.deflection),
                    matrix_loss,
                    fibre_loss,
                    attempts: attempt,
                };
                if close {
                    return Ok(Some((reading, unknowns)));
                }
                (least, nearest) = (change, Some((reading, unknowns)));
            }
            // Many fibres that begin to debond take over from the matrix within a micrometre, and all at once: then by smaller steps.
            let pace = if attempt <= care.patience {
                1.0
            } else if attempt <= 3 * care.patience {
                0.5
            } else {
                0.2
            };
            secants.iter_mut().zip(&next).for_each(|(secant, next)| *secant += pace * (next - *secant));
        }
        Ok(nearest)
    }
}
