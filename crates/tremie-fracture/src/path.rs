//! How a test goes on: the opening of the crack grows, stiffnesses follow as secants, and the load comes out.
//!
//! With all stiffnesses fixed the opening is proportional to the load, so that the load at an opening is one linear solution. Stiffnesses
//! are then those of the jumps that were found, and so on, until nothing changes; the last few attempts are put together for the next (Anderson 1965).
//!
//! A load or deflection that falls back while the opening grows is no trouble. Where cracks compete, the opening may have to fall back too: a branch that
//! closes gives back more than the others take. Such a step is led by the work that is used up, which only grows (Gutierrez 2004; Verhoosel, Remmers and
//! Gutierrez 2009), until the opening is where it should be. What lies on the way back is not read, as in a test that is led by its opening, but its work
//! counts. Load and deflection are joined by straight lines: the work between two states is then what
//! springs whose laws are straight between them store and use up, and only kinks that are stepped over are lost.

use std::collections::VecDeque;

use tremie_numerics::definite;

use crate::setup::{Reading, TrialError};
use crate::sparse::Singular;

/// Attempts at a step that has to be taken.
const ATTEMPTS: usize = 150;
/// How near, over what is asked, the nearest attempt at the shortest step must be: a facet that has two ways to go on may take none for good.
const NEARLY: f64 = 20.0;
/// Work that is used up in a step that is led by it, as shares of all work so far: in the first, and in the longest and shortest.
const FIRST: f64 = 2e-3;
const LONGEST: f64 = 5e-2;
const SHORTEST: f64 = FIRST / 256.0;
/// By how much such steps grow, while they take no more than so many attempts.
const GROWTH: f64 = 1.5;
const EASY: usize = 15;
/// Earlier attempts that are put together with the last for the next.
const MEMORY: usize = 3;

/// How exactly a test is followed.
pub(crate) struct Care {
    /// Load and secants count as found when they change by no more than these shares.
    pub(crate) load: f64,
    pub(crate) secants: f64,
    /// Work that may get lost in a step, as a share of all work so far: load and deflection are joined by straight lines.
    pub(crate) slip: f64,
    /// Attempts at a step that is led by the opening, and how often it is halved before it is led by the work that it uses up.
    pub(crate) attempts: usize,
    pub(crate) halvings: usize,
}

/// What cracks: a beam whose stiffness is a sum over places that soften.
pub(crate) trait Cracking {
    /// Unknowns for a load of 1 N with these secants, and the opening that they make in m.
    fn respond(&mut self, secants: &[f64]) -> Result<(Vec<f64>, f64), Singular>;
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

/// What is given of the end of a step.
#[derive(Clone, Copy)]
enum Lead {
    /// The opening in m.
    Opening(f64),
    /// All that has been used up, in J.
    Loss(f64),
}

/// A state that was found: its reading and unknowns.
type Found = (Reading, Vec<f64>);

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
        let Care { attempts, halvings, slip, .. } = body.care();
        while let Some(next) = ahead.last().copied() {
            if self.last.opening >= next {
                ahead.pop();
                continue;
            }
            match self.step(body, Lead::Opening(next), attempts, false)? {
                Some(found) if self.slip(&found.0) <= slip => readings.push(self.take(body, found)),
                _ if ahead.len() <= halvings => ahead.push(0.5 * (self.last.opening + next)),
                _ => self.wear(body, next, &mut readings)?,
            }
        }
        Ok(readings)
    }

    /// Goes on to a larger opening in m by using up work, little by little; on the way the opening may fall back.
    fn wear(
        &mut self,
        body: &mut dyn Cracking,
        opening: f64,
        readings: &mut Vec<Reading>,
    ) -> Result<(), TrialError> {
        let (mut share, mut widest) = (FIRST, self.last.opening);
        while self.last.opening < opening {
            let shortest = share <= SHORTEST;
            let loss = self.last.lost() + share * self.last.work;
            let found = match self.step(body, Lead::Loss(loss), ATTEMPTS, shortest)? {
                Some(found) if shortest || self.slip(&found.0) <= body.care().slip => found,
                None if shortest => self
                    .step(body, Lead::Opening(opening), ATTEMPTS, true)?
                    .ok_or(TrialError::Lost { opening })?,
                _ => {
                    share *= 0.5;
                    continue;
                }
            };
            if found.0.attempts < EASY {
                share = (GROWTH * share).min(LONGEST);
            }
            let reading = self.take(body, found);
            if reading.opening > widest {
                widest = reading.opening;
                readings.push(reading);
            }
        }
        Ok(())
    }

    /// Takes a step.
    fn take(&mut self, body: &mut dyn Cracking, (reading, unknowns): Found) -> Reading {
        body.commit(&unknowns);
        self.last = reading;
        let [_, newer] = std::mem::take(&mut self.steps);
        self.steps = [newer, (reading.opening, unknowns)];
        reading
    }

    /// Work that gets lost on the way to a reading, as a share of all work so far.
    fn slip(&self, next: &Reading) -> f64 {
        let kept = |reading: &Reading| reading.stored() + reading.lost() - reading.work;
        (kept(next) - kept(&self.last)).abs() / next.work
    }

    /// One step; nothing if it does not converge. At the finest the nearest attempt is taken.
    fn step(
        &self,
        body: &mut dyn Cracking,
        lead: Lead,
        attempts: usize,
        finest: bool,
    ) -> Result<Option<Found>, TrialError> {
        // As the unknowns went on before.
        let [(before, older), (now, newer)] = &self.steps;
        let ahead = match lead {
            Lead::Opening(opening) if now > before => (opening - now) / (now - before),
            _ => 0.0,
        };
        let mut used: Vec<f64> =
            newer.iter().zip(older).map(|(new, old)| new + ahead * (new - old)).collect();
        let mut tried = VecDeque::new();
        let care = body.care();
        let (mut load, mut nearest) = (f64::INFINITY, None);
        let mut least = NEARLY * care.secants;
        for attempt in 1..=attempts {
            let secants = body.secants(&used);
            // Nothing bears any more: the beam is in two.
            let (mut unknowns, each) =
                body.respond(&secants).map_err(|_| TrialError::Lost { opening: *now })?;
            let found = match lead {
                Lead::Opening(opening) => Some(opening / each),
                Lead::Loss(loss) => {
                    let guess = if load.is_finite() { load } else { self.last.load };
                    self.load_at(body, &unknowns, &secants, loss, guess)
                }
            };
            let Some(found) = found else { return Ok(None) };
            unknowns.iter_mut().for_each(|unknown| *unknown *= found);
            let next = body.secants(&unknowns);
            let change = body.change(&secants, &next, &unknowns);
            let close = (found - load).abs() <= care.load * found.abs() && change <= care.secants;
            load = found;
            if close || finest && change < least {
                let [deflection, middle, matrix_loss, fibre_loss] = body.found(load, &unknowns, &secants);
                let last = &self.last;
                let opening = if let Lead::Opening(opening) = lead { opening } else { load * each };
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
                (least, nearest) = (change, Some((reading, unknowns.clone())));
            }
            tried.push_front((used, unknowns));
            tried.truncate(MEMORY + 1);
            used = mixed(&tried);
        }
        Ok(nearest)
    }

    /// The load in N at which so much has been used up in J, of the unknowns for each newton; nothing if no load does.
    fn load_at(
        &self,
        body: &dyn Cracking,
        each: &[f64],
        secants: &[f64],
        loss: f64,
        guess: f64,
    ) -> Option<f64> {
        /// How far apart a first bracket is, by how much it widens, and how near the loss must come, as shares.
        const WIDE: f64 = 0.02;
        const WIDER: f64 = 4.0;
        const NEAR: f64 = 1e-3;
        let begin = self.last.lost();
        if loss <= begin || guess <= 0.0 {
            return None;
        }
        let beyond = |load: f64| {
            let unknowns: Vec<f64> = each.iter().map(|unknown| load * unknown).collect();
            let [_, _, matrix, fibres] = body.found(load, &unknowns, secants);
            (matrix + fibres - loss) / (loss - begin)
        };
        let mut low = (0.0, -1.0);
        let mut high = (guess, beyond(guess));
        let mut wide = WIDE;
        while high.1 < 0.0 {
            low = high;
            high.0 *= 1.0 + wide;
            if high.0 > 1e9 * guess {
                return None;
            }
            high.1 = beyond(high.0);
            wide *= WIDER;
        }
        let mut wide = WIDE;
        while low.0 == 0.0 && wide < 1.0 {
            let load = (1.0 - wide) * guess;
            let next = (load, beyond(load));
            *(if next.1 < 0.0 { &mut low } else { &mut high }) = next;
            wide *= WIDER;
        }
        // False positions; an end that stays counts half (the Illinois rule, Dowell and Jarratt 1971).
        let mut stays = 0.0;
        for _ in 0..60 {
            let load = (low.0 * high.1 - high.0 * low.1) / (high.1 - low.1);
            let middle = (load, beyond(load));
            if middle.1.abs() < NEAR {
                return Some(load);
            }
            let side = middle.1.signum();
            let (moved, other) = if side < 0.0 { (&mut low, &mut high) } else { (&mut high, &mut low) };
            *moved = middle;
            if side == stays {
                other.1 *= 0.5;
            }
            stays = side;
        }
        Some(high.0)
    }
}

/// The unknowns to go on with, of pairs of those that were used and those that were found, the last first: put together so that the changes between them
/// cancel as far as they can.
fn mixed(tried: &VecDeque<(Vec<f64>, Vec<f64>)>) -> Vec<f64> {
    let (used, found) = &tried[0];
    let count = tried.len() - 1;
    let mut a = [[0.0; MEMORY]; MEMORY];
    let mut b = [0.0; MEMORY];
    (count..MEMORY).for_each(|i| a[i][i] = 1.0);
    for k in 0..used.len() {
        let change = |n: usize| tried[n].1[k] - tried[n].0[k];
        let now = change(0);
        let less: [f64; MEMORY] = std::array::from_fn(|i| if i < count { now - change(i + 1) } else { 0.0 });
        for i in 0..count {
            b[i] += less[i] * now;
            for j in 0..=i {
                a[i][j] += less[i] * less[j];
            }
        }
    }
    let parts = definite::solve(a, b, 1e-8).unwrap_or_default();
    let mut next = found.clone();
    for (part, (_, before)) in parts.iter().zip(tried.iter().skip(1)) {
        for (next, (found, before)) in next.iter_mut().zip(found.iter().zip(before)) {
            *next -= part * (found - before);
        }
    }
    next
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::softening::{Law, Softening};

    /// A bar that cracks in one place, pulled at its end: the opening is how much longer all of it is.
    struct Bar {
        /// Length in m per newton, without the crack.
        give: f64,
        law: Law,
        most: f64,
    }

    impl Cracking for Bar {
        fn respond(&mut self, secants: &[f64]) -> Result<(Vec<f64>, f64), Singular> {
            Ok((vec![1.0 / secants[0]], self.give + 1.0 / secants[0]))
        }

        fn secants(&self, jump: &[f64]) -> Vec<f64> {
            vec![self.law.secant(jump[0], self.most.max(jump[0]))]
        }

        fn care(&self) -> Care {
            Care { load: 1e-6, secants: 1e-6, slip: 1e-4, attempts: 20, halvings: 2 }
        }

        fn change(&self, old: &[f64], new: &[f64], _: &[f64]) -> f64 {
            (old[0] - new[0]).abs() / new[0]
        }

        fn found(&self, load: f64, jump: &[f64], _: &[f64]) -> [f64; 4] {
            let deflection = load * self.give + jump[0];
            [deflection, deflection, self.law.lost(self.most.max(jump[0])), 0.0]
        }

        fn commit(&mut self, jump: &[f64]) {
            self.most = self.most.max(jump[0]);
        }
    }

    #[test]
    fn a_long_bar_snaps_back_and_no_work_is_lost() {
        // An area of 1 m2, so that stress is load.
        let softening = Softening { strength: 2.0, kink_stress: 0.5, kink_opening: 0.05, last_opening: 0.3 };
        let law = softening.spring(1e-3, 1.0);
        for give in [0.01, 0.5] {
            let mut bar = Bar { give, law, most: 0.0 };
            let steps = [(0.0, vec![0.0]), (0.0, vec![0.0])];
            let mut path = Path { steps, last: Reading::default(), nominal: 1.0 };
            let mut readings = Vec::new();
            for k in 1..=30 {
                readings.extend(path.advance(&mut bar, 0.05 * f64::from(k)).unwrap());
            }
            assert!(readings.windows(2).all(|pair| pair[1].opening > pair[0].opening));
            let top = readings.iter().map(|r| r.load).fold(0.0, f64::max);
            assert!((top / 2.0 - 1.0).abs() < 0.02, "{give}: {top}");
            let breaks = |pair: &[Reading]| pair[0].load > 0.9 * top && pair[1].load < 0.1 * top;
            assert_eq!(readings.windows(2).any(breaks), give > 0.1, "all at once if the bar is long: {give}");
            for reading in &readings {
                let jump = reading.opening - give * reading.load;
                assert!((reading.load - law.stress(jump)).abs() < 1e-3, "{give}: {reading:?}");
                assert!(reading.imbalance().abs() < 2e-3, "{give}: {reading:?}");
            }
            let last = readings.last().unwrap();
            assert!((last.work / softening.energy() - 1.0).abs() < 2e-3, "{give}: {last:?}");
        }
    }
}
