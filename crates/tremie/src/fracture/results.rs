//! What tests tell: strengths, their scatter, fibres through sections.

use std::path::PathBuf;

use serde_json::{Value, json};
use tremie_case::{BeamCase, BeamTest};
use tremie_fracture::Reading;
use tremie_fracture::fibres::{Count, count};
use tremie_fracture::standard::{Scatter, Strengths};

use super::beam;
use crate::numbers::{duration, significant};

/// Where fibres are counted, from the crack plane in m: in it, as far beside it as cut faces are looked at, and in planes at the loads.
const SECTIONS: [f64; 9] = [-0.06, -0.03, -0.02, -0.01, 0.0, 0.01, 0.02, 0.03, 0.06];

/// A beam that was tested.
pub(super) struct Beam {
    pub(super) seed: u64,
    pub(super) readings: Vec<Reading>,
    pub(super) strengths: Strengths,
    /// Fibres in it, or parts of them.
    pub(super) fibres: usize,
    /// Share of the volume that they take.
    pub(super) share: f64,
    /// Fibres through sections, and where these are from the crack plane in m.
    pub(super) sections: Vec<(f64, Count)>,
}

impl Beam {
    /// The beam with a seed, and what was read.
    pub(super) fn new(case: &BeamCase, seed: u64, readings: Vec<Reading>) -> Self {
        let setup = beam::setup(case, seed);
        let places =
            SECTIONS.iter().filter(|off| (setup.crack + **off) > 0.0 && (setup.crack + **off) < setup.size.x);
        let sections = places
            .map(|off| {
                let above = if *off == 0.0 { setup.notch } else { 0.0 };
                (*off, count(&setup.fibres, setup.crack + off, above, setup.size))
            })
            .collect();
        let volume: f64 = setup.fibres.iter().map(|fibre| fibre.section() * fibre.length()).sum();
        Self {
            seed,
            strengths: Strengths::of(&readings),
            readings,
            fibres: setup.fibres.len(),
            share: volume / setup.size.element_product(),
            sections,
        }
    }

    /// Fibres through the crack.
    pub(super) fn crack(&self) -> Option<&Count> {
        self.sections.iter().find(|(off, _)| *off == 0.0).map(|(_, count)| count)
    }
}

/// Tests that are done.
pub(super) struct Done {
    pub(super) case: BeamCase,
    pub(super) beams: Vec<Beam>,
    /// Wall-clock time in s.
    pub(super) seconds: f64,
    pub(super) path: PathBuf,
}

/// Names of strengths, as the standard has them, and as keys.
pub(super) const STRENGTHS: [(&str, &str); 6] = [
    ("f_L", "limit_of_proportionality_Pa"),
    ("f_R1", "residual_0.5mm_Pa"),
    ("f_R2", "residual_1.5mm_Pa"),
    ("f_R3", "residual_2.5mm_Pa"),
    ("f_R4", "residual_3.5mm_Pa"),
    ("largest", "peak_Pa"),
];

/// The strengths of a beam in Pa, in this order.
pub(super) fn strengths(beam: &Beam) -> [f64; STRENGTHS.len()] {
    let Strengths { limit, residual: [a, b, c, d], peak, .. } = beam.strengths;
    [limit, a, b, c, d, peak]
}

impl Done {
    /// Each strength over all beams.
    pub(super) fn scatter(&self) -> [Scatter; STRENGTHS.len()] {
        let all: Vec<_> = self.beams.iter().map(strengths).collect();
        std::array::from_fn(|k| Scatter::of(&all.iter().map(|one| one[k]).collect::<Vec<_>>()))
    }

    /// The test in words.
    pub(super) fn test(&self) -> String {
        let mm = |x: f64| significant(1e3 * x);
        match self.case.test {
            BeamTest::Nsbt { span, inner, .. } => {
                format!("four-point bending (NSBT), spans {} and {} mm", mm(span), mm(inner))
            }
            BeamTest::En14651 { span, notch } => {
                format!("three-point bending (EN 14651), span {} mm, notch {} mm", mm(span), mm(notch))
            }
            BeamTest::Tension => "tension between plates".to_owned(),
            BeamTest::PullOut { .. } => "pull-out of a fibre".to_owned(),
        }
    }

    /// The results, as they are told.
    pub(super) fn rows(&self) -> Vec<(&'static str, String)> {
        let several = self.beams.len() > 1;
        let mpa = |stress: f64| format!("{:.2} MPa", 1e-6 * stress);
        let mut rows = vec![("test", self.test())];
        for ((name, _), scatter) in STRENGTHS.into_iter().zip(self.scatter()) {
            if scatter.mean.is_nan() {
                continue;
            }
            let more = if several {
                format!(
                    " mean, coefficient of variation {:.0} %, characteristic {}",
                    100.0 * scatter.variation,
                    mpa(scatter.characteristic)
                )
            } else {
                String::new()
            };
            rows.push((name, mpa(scatter.mean) + &more));
        }
        let mean =
            |of: &dyn Fn(&Beam) -> f64| self.beams.iter().map(of).sum::<f64>() / self.beams.len() as f64;
        let peak = mean(&|beam| beam.strengths.peak_opening);
        rows.push(("opening there", format!("{:.3} mm", 1e3 * peak)));
        let count = |of: &dyn Fn(&Beam) -> f64| format!("{:.0}", mean(of));
        if self.beams.iter().any(|beam| beam.fibres > 0) {
            rows.push((
                "fibres",
                format!(
                    "{} in the beam, {} % of its volume",
                    count(&|b| b.fibres as f64),
                    significant(100.0 * mean(&|b| b.share))
                ),
            ));
            let crack = |of: fn(&Count) -> f64| move |beam: &Beam| beam.crack().map_or(f64::NAN, of);
            rows.push((
                "in the crack",
                format!(
                    "{}, {} for each m2, {:.0} degrees to the beam's axis on average",
                    count(&crack(|c| c.fibres as f64)),
                    count(&crack(|c| c.density)),
                    mean(&crack(|c| c.angle)).to_degrees()
                ),
            ));
        }
        let [work, matrix, fibres] = [
            mean(&|beam| beam.strengths.work),
            mean(&|beam| beam.strengths.losses[0]),
            mean(&|beam| beam.strengths.losses[1]),
        ];
        rows.push((
            "work",
            format!(
                "{} J: {} in the matrix, {} in the fibres",
                significant(work),
                significant(matrix),
                significant(fibres)
            ),
        ));
        let worst = self.beams.iter().map(|beam| beam.strengths.imbalance).fold(0.0, f64::max);
        rows.push(("energy", format!("balanced within {:.2} %", 100.0 * worst)));
        rows.push(("cost", duration(self.seconds)));
        rows.push(("results", self.path.display().to_string()));
        rows.push(("report", self.path.join("report.html").display().to_string()));
        rows
    }

    /// The results in SI units; what is not known is null.
    pub(super) fn json(&self) -> Value {
        let beams = self.beams.iter().map(|beam| {
            let mut told = json!({
                "seed": beam.seed,
                "peak_opening_m": beam.strengths.peak_opening,
                "work_J": beam.strengths.work,
                "matrix_loss_J": beam.strengths.losses[0],
                "fibre_loss_J": beam.strengths.losses[1],
                "energy_imbalance": beam.strengths.imbalance,
                "fibres": beam.fibres,
                "volume_fraction": beam.share,
                "sections": beam.sections.iter().map(|(off, count)| json!({
                    "from_crack_m": off,
                    "fibres": count.fibres,
                    "fibres_per_m2": count.density,
                    "mean_angle_rad": count.angle,
                })).collect::<Vec<_>>(),
            });
            for ((_, key), stress) in STRENGTHS.into_iter().zip(strengths(beam)) {
                told[key] = json!(stress);
            }
            told
        });
        let mut all = json!({
            "title": self.case.title,
            "test": self.test(),
            "opening_m": self.case.opening,
            "beams": beams.collect::<Vec<_>>(),
            "wall_s": self.seconds,
        });
        for ((_, key), scatter) in STRENGTHS.into_iter().zip(self.scatter()) {
            all[key] = json!({
                "mean": scatter.mean,
                "coefficient_of_variation": scatter.variation,
                "characteristic": scatter.characteristic,
            });
        }
        all
    }
}
