//! What is computed before anything flows: scales, flow curves, and their inversion on the lattice.

use tremie_lbm::{Bingham, Plan, Relaxation};
use tremie_rheology::FlowCurve;

use super::benchmark::{Check, Context};

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

/// Yield stress in Pa and viscosity in Pa s of the curves that are tried.
const CURVES: [(&str, f64, f64); 3] =
    [("Newtonian", 0.0, 30.0), ("Bingham", 50.0, 30.0), ("stiff Bingham", 500.0, 5.0)];

/// Flow curves and their inverses against closed forms, and the lattice's inversion against bisection.
pub(super) fn flow_curves(context: &Context) -> anyhow::Result<Vec<Check>> {
    let mut checks = Vec::new();
    for (name, yield_stress, viscosity) in CURVES {
        let curve = if yield_stress == 0.0 {
            FlowCurve::Newtonian { viscosity }
        } else {
            FlowCurve::Bingham { yield_stress, plastic_viscosity: viscosity }
        };
        let (mut stress, mut inverse) = (0.0, 0.0);
        for rate in spread_out(1e-4, 1e3) {
            let exact = yield_stress + viscosity * rate;
            stress = larger(stress, curve.stress(rate) / exact - 1.0);
            stress = larger(stress, curve.viscosity(rate) / (exact / rate) - 1.0);
            // The stress at a rate far below yield_stress/viscosity is the yield stress but for its last digits.
            let scale = rate + yield_stress / viscosity;
            inverse = larger(inverse, (curve.shear_rate(exact) - rate) / scale);
        }
        let lattice = lattice_inversion(curve);
        checks.extend([
            context.zero("closed form", format!("{name}: stress and viscosity"), "", stress)?,
            context.zero("closed form", format!("{name}: shear rate"), "", inverse)?,
            context.zero("closed form", format!("{name}: lattice inversion"), "", lattice)?,
        ]);
    }
    Ok(checks)
}

/// Largest relative error of the lattice's shear rate `omega q`, in a lattice of 5 mm cells and 0.2 ms steps.
fn lattice_inversion(curve: FlowCurve) -> f64 {
    let scaling = tremie_lbm::Scaling { cell_size: 0.005, time_step: 2e-4, density: 2300.0 };
    let yield_stress = scaling.stress(curve.yield_stress());
    let viscosity = scaling.viscosity(curve.plastic_viscosity());
    let law = Bingham::<f64>::new(yield_stress, viscosity);
    let mut error = 0.0;
    for q in spread_out(1e-8, 1.0) {
        error = larger(error, (law.omega(q) * q - bisect(yield_stress, viscosity, q)) / q);
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
