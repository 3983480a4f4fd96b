//! What is computed before anything flows: scales, flow curves, and their inversion on the lattice.

use tremie_lbm::{Bingham, Plan, Relaxation, Tabulated};
use tremie_rheology::{FlowCurve, Regularisation};

use super::benchmark::{Check, Context};
use super::profile::Model;

/// The worked example of the thesis.
pub(super) fn scaling(context: &Context) -> anyhow::Result<Vec<Check>> {
    let case = context.case("case.toml")?;
    let scaling = Plan::new(&case).scaling;
    let yield_stress = scaling.stress(case.material.curve.yield_stress());
    Ok(vec![
        context.relative("share", "steps a second", "1/s", 427.0, 1.0 / scaling.time_step)?,
        context.relative("share", "yield stress on the lattice", "", 8.77e-5, yield_stress)?,
    ])
}

/// The curves that are tried, each with its reference.
fn references() -> Vec<(&'static str, FlowCurve, Reference)> {
    let line = |yield_stress, viscosity| {
        let model = Model::HerschelBulkley { yield_stress, consistency: viscosity, index: 1.0 };
        Reference { model, by: None }
    };
    let bingham = |yield_stress, viscosity| FlowCurve::Bingham { yield_stress, plastic_viscosity: viscosity };
    let mut all = vec![
        ("Newtonian", FlowCurve::Newtonian { viscosity: 30.0 }, line(0.0, 30.0)),
        ("Bingham", bingham(50.0, 30.0), line(50.0, 30.0)),
        ("stiff Bingham", bingham(500.0, 5.0), line(500.0, 5.0)),
    ];
    let (yield_stress, consistency) = (50.0, 20.0);
    let power_law = |index| Model::HerschelBulkley { yield_stress: 0.0, consistency, index };
    let rigid = |index| Model::HerschelBulkley { yield_stress, consistency, index };
    let casson = Model::Casson { yield_stress, viscosity: 5.0 };
    for (name, model) in [
        ("power law, index 0.5", power_law(0.5)),
        ("power law, index 1.5", power_law(1.5)),
        ("Herschel-Bulkley, index 0.5", rigid(0.5)),
        ("Herschel-Bulkley, index 1.5", rigid(1.5)),
        ("Casson", casson),
        ("Cross", Model::Cross { zero: 1e3, infinite: 1.0, time: 20.0, index: 0.8 }),
        ("Carreau", Model::CarreauYasuda { zero: 100.0, infinite: 1.0, time: 2.0, index: 0.4, a: 2.0 }),
        (
            "Carreau-Yasuda",
            Model::CarreauYasuda { zero: 100.0, infinite: 0.0, time: 2.0, index: 0.6, a: 0.8 },
        ),
    ] {
        all.push((name, model.curve(), Reference { model, by: None }));
    }
    let papanastasiou = Regularisation::Papanastasiou { exponent: 100.0 };
    let bi_viscosity = Regularisation::BiViscosity { largest_viscosity: 3e4 };
    for (name, exact, model, by) in [
        ("Papanastasiou-Bingham", bingham(50.0, 30.0), line(50.0, 30.0).model, papanastasiou),
        ("Papanastasiou-Herschel-Bulkley", rigid(0.5).curve(), rigid(0.5), papanastasiou),
        ("Papanastasiou-Casson", casson.curve(), casson, papanastasiou),
        ("bi-viscosity Bingham", bingham(50.0, 30.0), line(50.0, 30.0).model, bi_viscosity),
        ("bi-viscosity Herschel-Bulkley", rigid(0.5).curve(), rigid(0.5), bi_viscosity),
        ("bi-viscosity Casson", casson.curve(), casson, bi_viscosity),
    ] {
        all.extend(exact.regularised(by).map(|curve| (name, curve, Reference { model, by: Some(by) })));
    }
    all
}

/// A flow curve, written down again, and its regularisation.
struct Reference {
    model: Model,
    by: Option<Regularisation>,
}

impl Reference {
    /// Stress in Pa at a shear rate in 1/s.
    fn stress(&self, rate: f64) -> f64 {
        match (self.by, self.model) {
            (None, model) => model.stress(rate),
            (Some(Regularisation::BiViscosity { largest_viscosity }), model) => {
                model.stress(rate).min(largest_viscosity * rate)
            }
            (Some(Regularisation::Papanastasiou { exponent }), Model::Casson { yield_stress, viscosity }) => {
                let share = 1.0 - (-(exponent * rate).sqrt()).exp();
                (share * yield_stress.sqrt() + (viscosity * rate).sqrt()).powi(2)
            }
            (Some(Regularisation::Papanastasiou { exponent }), model) => {
                let yield_stress = model.stress(0.0);
                model.stress(rate) - yield_stress * (-exponent * rate).exp()
            }
        }
    }
}

/// Flow curves and their inverses against closed forms, and the lattice's inversion against bisection.
pub(super) fn flow_curves(context: &Context) -> anyhow::Result<Vec<Check>> {
    let mut checks = Vec::new();
    for (name, curve, reference) in references() {
        let (mut stress, mut inverse) = (0.0, 0.0);
        for rate in spread_out(1e-4, 1e3) {
            let exact = reference.stress(rate);
            stress = larger(stress, curve.stress(rate) / exact - 1.0);
            stress = larger(stress, curve.viscosity(rate) / (exact / rate) - 1.0);
            // Where the curve is flat, the stress's last digits are all that tells the rates apart.
            let slope = (reference.stress(1.001 * rate) - exact) / (0.001 * rate);
            let scale = rate + exact / slope;
            inverse = larger(inverse, (curve.shear_rate(exact) - rate) / scale);
        }
        let closed = matches!(curve, FlowCurve::Newtonian { .. } | FlowCurve::Bingham { .. });
        let tolerance = if closed { "closed form" } else { "table" };
        let lattice = lattice_inversion(&curve, &reference);
        checks.extend([
            context.zero("closed form", format!("{name}: stress and viscosity"), "", stress)?,
            context.zero("closed form", format!("{name}: shear rate"), "", inverse)?,
            context.zero(tolerance, format!("{name}: lattice inversion"), "", lattice)?,
        ]);
    }
    Ok(checks)
}

/// Largest relative error of the lattice's shear rate `omega q`, in a lattice of 5 mm cells and 0.2 ms steps.
///
/// In closed form at 200 stress measures q; from tables at the q of 200 shear rates.
fn lattice_inversion(curve: &FlowCurve, reference: &Reference) -> f64 {
    let scaling = tremie_lbm::Scaling { cell_size: 0.005, time_step: 2e-4, density: 2300.0 };
    let mut error = 0.0;
    if let FlowCurve::Newtonian { .. } | FlowCurve::Bingham { .. } = curve {
        let yield_stress = scaling.stress(curve.yield_stress());
        let viscosity = scaling.viscosity(curve.plastic_viscosity());
        let law = Bingham::<f64>::new(yield_stress, viscosity);
        for q in spread_out(1e-8, 1.0) {
            error = larger(error, (law.omega(q) * q - bisect(yield_stress, viscosity, q)) / q);
        }
    } else {
        let law = Tabulated::<f64>::new(curve, &scaling);
        for rate in spread_out(1e-4, 1e3) {
            let s = rate * scaling.time_step;
            let q = 3.0 * scaling.stress(reference.stress(rate)) + 0.5 * s;
            error = larger(error, law.omega(q) * q / s - 1.0);
        }
    }
    error
}

/// Solves `3 sigma(s) + s/2 = q` for the lattice shear rate s; the left side increases.
fn bisect(yield_stress: f64, viscosity: f64, q: f64) -> f64 {
    let left = |s: f64| 3.0 * (yield_stress + viscosity * s) + 0.5 * s;
    if left(0.0) >= q {
        return 0.0;
    }
    let (mut low, mut high) = (0.0, 2.0 * q);
    loop {
        let middle = 0.5 * (low + high);
        if middle <= low || middle >= high {
            return middle;
        }
        if left(middle) < q { low = middle } else { high = middle }
    }
}

/// The larger magnitude; what is not a number stays.
fn larger(a: f64, b: f64) -> f64 {
    if b.abs() <= a { a } else { b.abs() }
}

/// 200 numbers, evenly spaced on a logarithmic scale.
fn spread_out(low: f64, high: f64) -> impl Iterator<Item = f64> {
    (0..200).map(move |n| low * (high / low).powf(f64::from(n) / 199.0))
}
