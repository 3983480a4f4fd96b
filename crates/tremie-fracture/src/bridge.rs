//! A fibre across a crack: elastic with the matrix around it, then pulled out.

use crate::fibres::Crossing;
use crate::pull_out::{Bond, PullOut};

/// The force of a fibre over the jump across the crack, and how far that has gone.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Bridge {
    law: PullOut,
    /// Jump in m at which the matrix around it cracks.
    first: f64,
    /// Force in N that it has taken by then.
    elastic: f64,
    /// Largest jump so far in m.
    pub(crate) most: f64,
}

impl Bridge {
    /// A fibre across a crack that begins at the jump `first` in m; until then it is a spring of the stiffness `along` in N/m along itself.
    pub(crate) fn new(bond: &Bond, diameter: f64, crossing: &Crossing, first: f64, along: f64) -> Self {
        let [a, b] = crossing.lengths;
        let law = PullOut::new(bond, diameter, a.min(b), crossing.angle);
        let elastic = (along * crossing.angle.cos().powi(2) * first).min(law.loose_force());
        Self { law, first, elastic, most: 0.0 }
    }

    /// Opening in m at which pulling out takes more force than it had before.
    fn taken_over(&self) -> f64 {
        let share = self.elastic / self.law.loose_force();
        if self.elastic > 0.0 { self.law.loose() * share * share } else { 0.0 }
    }

    /// Force in N at a jump that grows for the first time.
    fn force(&self, jump: f64) -> f64 {
        let opening = jump - self.first;
        if opening <= 0.0 {
            self.elastic * (jump / self.first).max(0.0)
        } else if opening < self.taken_over() {
            self.elastic
        } else {
            self.law.force(opening)
        }
    }

    /// Force over jump in N/m when the largest jump was `most`.
    pub(crate) fn secant(&self, jump: f64, most: f64) -> f64 {
        if most <= self.first {
            self.elastic / self.first
        } else if jump <= 0.0 {
            0.0
        } else {
            self.force(most) / most
        }
    }

    /// Work in J that is lost for good when the largest jump was `most`.
    pub(crate) fn lost(&self, most: f64) -> f64 {
        let opening = most - self.first;
        if opening <= 0.0 {
            return 0.0;
        }
        let flat = opening.min(self.taken_over());
        let work = 0.5 * self.elastic * self.first + self.elastic * flat + self.law.work(opening)
            - self.law.work(flat);
        work - 0.5 * self.force(most) * most
    }
}

/// A fibre across the crack, as it is at a moment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BridgeState {
    /// Which fibre of the beam it is.
    pub fibre: usize,
    /// Where it crosses, at what angle, and its lengths on both sides.
    pub crossing: Crossing,
    /// Opening in m there.
    pub opening: f64,
    /// Force in N across the crack.
    pub force: f64,
}
