//! The numbers of a run: what a case means on the lattice, which of them are out of their good range, and how people
//! read them.

use indicatif::{HumanBytes, HumanCount};
use serde_json::{Value, json};
use tremie_case::{Case, CaseError, Side};

use crate::gaps::{self, Gap};
use crate::plan::Plan;

/// Relaxation times outside of which the collision is inaccurate (above) or close to unstable (below).
const RELAXATION_TIME: [f64; 2] = [0.505, 1.5];
/// Mach number above which the method's compressibility shows.
const MACH: f64 = 0.3;
/// Relative change of density under the fluid's own weight above which its volume is wrong.
const HYDROSTATIC_ERROR: f64 = 0.05;
/// Cells across the fluid below which it is hardly resolved.
const CELLS_ACROSS: f64 = 5.0;
/// Cells across a gap between solids below which what flows through it is wrong.
const CELLS_IN_GAP: f64 = 4.0;

/// Cells across the fluid below which there is nothing to compute.
const LEAST_CELLS_ACROSS: f64 = 1.0;
/// Relative change of density under the fluid's own weight at which the method's state makes no sense at all.
const BROKEN: f64 = 1.0;
/// Cell updates a second that no machine of today exceeds, and steps a second.
const FASTEST: [f64; 2] = [1e10, 1e6];
/// A wall-clock time in s that nobody waits for.
const YEAR: f64 = 3.15e7;

/// The numbers of a case.
pub(crate) struct Numbers {
    pub(crate) plan: Plan,
    /// Cells across the thinnest extent of all the fluid at the start, or of an inlet.
    pub(crate) cells_across: f64,
    /// The narrowest gap between solids, or a solid and a wall, at the start.
    gap: Option<Gap>,
    /// Files whose meshes were inside out.
    turned: Vec<String>,
    title: String,
    stop_time: f64,
    stops_at_rest: bool,
    /// Whether surface tension pulls at the fluid.
    drawn: bool,
}

impl Numbers {
    pub(crate) fn new(case: &Case) -> Self {
        let plan = Plan::new(case);
        Self {
            cells_across: thinnest(case) / plan.resolution(),
            gap: gaps::narrowest(case, plan.resolution()),
            turned: case.meshes.iter().filter(|m| m.mesh.turned()).map(|m| m.path.clone()).collect(),
            plan,
            title: case.title.clone(),
            stop_time: case.stop.time,
            stops_at_rest: case.stop.rest.is_some(),
            drawn: case.material.surface_tension > 0.0,
        }
    }

    /// For files, in SI units.
    pub(crate) fn json(&self) -> Value {
        let plan = &self.plan;
        let [height, speed, bingham, reynolds] = plan.flow();
        let mut json = json!({
            "title": self.title,
            "memory_bytes": plan.memory().round(),
            "time_step_s": plan.time_step(),
            "steps": plan.steps(),
            "stop_time_s": self.stop_time,
            "stops_at_rest": self.stops_at_rest,
            "height_m": height,
            "reference_speed_m_s": speed,
            "bingham": bingham,
            "reynolds": reynolds,
        });
        let own = match plan {
            Plan::Lattice(plan) => json!({
                "cell_size_m": plan.scaling.cell_size,
                "cells": plan.cells,
                "wet_cells": plan.wet_cells.round(),
                "inflow_m3": plan.inflow,
                "velocity_unit_m_s": plan.scaling.velocity_unit(),
                "stress_unit_Pa": plan.scaling.stress_unit(),
                "relaxation_time": plan.relaxation_time,
                "mach": plan.mach,
                "hydrostatic_error": plan.hydrostatic_error,
            }),
            Plan::Particles(plan) => json!({
                "spacing_m": plan.spacing,
                "plane": plan.plane,
                "particles": plan.particles,
                "largest_viscosity_Pa_s": plan.largest_viscosity,
            }),
        };
        if let (Some(all), Value::Object(own)) = (json.as_object_mut(), own) {
            all.extend(own);
        }
        json
    }

    /// Names and values for people.
    pub(crate) fn rows(&self) -> Vec<(&'static str, String)> {
        let plan = &self.plan;
        let [_, speed, bingham, reynolds] = plan.flow();
        let rest = if self.stops_at_rest { ", fewer if the fluid comes to rest" } else { "" };
        let mut rows = vec![(plan.elements(), plan.resolved())];
        if let Plan::Lattice(plan) = plan {
            let wet = HumanCount(plan.wet_cells.round() as u64);
            rows.push(("wet cells at the start", wet.to_string()));
            if plan.inflow > 0.0 {
                let cells = plan.inflow / plan.scaling.cell_size.powi(3);
                let litres = significant(1e3 * plan.inflow);
                let cells = HumanCount(cells.round() as u64);
                rows.push(("comes in", format!("{litres} litres, {cells} cells")));
            }
        }
        rows.extend([
            ("memory", format!("about {}", HumanBytes(plan.memory() as u64))),
            ("time step", seconds(plan.time_step())),
            (
                "steps",
                format!(
                    "{}{} to {}{rest}",
                    if plan.lattice().is_some() { "" } else { "at most " },
                    HumanCount(plan.steps() as u64),
                    seconds(self.stop_time)
                ),
            ),
        ]);
        rows.extend(match plan {
            Plan::Lattice(plan) => vec![
                ("relaxation time tau", format!("{:.3}  (good: 0.505 to 1.5)", plan.relaxation_time)),
                ("Mach number", format!("{:.3}  (good: below 0.3)", plan.mach)),
                (
                    "hydrostatic density error",
                    format!("{:.1} %  (good: below 5 %)", 100.0 * plan.hydrostatic_error),
                ),
            ],
            Plan::Particles(plan) => {
                vec![("largest viscosity", format!("{} Pa s", significant(plan.largest_viscosity)))]
            }
        });
        rows.extend([
            ("Bingham number", significant(bingham)),
            ("Reynolds number", format!("{}  (at {speed:.2} m/s)", significant(reynolds))),
        ]);
        rows
    }

    /// In two lines.
    pub(crate) fn short(&self) -> String {
        let plan = &self.plan;
        let [.., bingham, reynolds] = plan.flow();
        let wet = match plan {
            Plan::Lattice(plan) => format!(", {} wet", HumanCount(plan.wet_cells.round() as u64)),
            Plan::Particles(_) => String::new(),
        };
        let own = match plan {
            Plan::Lattice(plan) => format!(
                "tau {:.3}, Mach {:.3}, hydrostatic error {:.1} %",
                plan.relaxation_time,
                plan.mach,
                100.0 * plan.hydrostatic_error
            ),
            Plan::Particles(plan) => {
                format!("largest viscosity {} Pa s", significant(plan.largest_viscosity))
            }
        };
        format!(
            "  {}{wet}; {} steps of {} to {}\n  {own}, Bingham {}, Reynolds {}",
            plan.resolved(),
            HumanCount(plan.steps() as u64),
            seconds(plan.time_step()),
            seconds(self.stop_time),
            significant(bingham),
            significant(reynolds),
        )
    }

    /// What is out of its good range or beyond this machine, and what to do about it.
    pub(crate) fn warnings(&self) -> Vec<String> {
        let mut warnings = self.doubts();
        if let Some(memory) = Memory::of_this_machine()
            && self.plan.memory() > memory.available
        {
            warnings.push(format!(
                "the run needs about {}, but only {} of memory are free; use larger {}, or close other programs",
                HumanBytes(self.plan.memory() as u64),
                HumanBytes(memory.available as u64),
                match self.plan {
                    Plan::Lattice(_) => "cells or f32",
                    Plan::Particles(_) => "spacings",
                }
            ));
        }
        warnings
    }

    /// What is out of its good range, whatever the machine.
    pub(crate) fn doubts(&self) -> Vec<String> {
        let plan = &self.plan;
        let (elements, [_, speed, ..]) = (plan.elements(), plan.flow());
        let mut warnings = plan.lattice().map(of_lattice).unwrap_or_default();
        let mut warn = |wrong: bool, text: String| {
            if wrong {
                warnings.push(text);
            }
        };
        warn(
            speed == 0.0 && !self.drawn,
            "nothing drives the fluid: gravity and all velocities are zero".to_owned(),
        );
        warn(
            self.cells_across < CELLS_ACROSS,
            format!(
                "the fluid is only {:.1} {elements} across at its thinnest, less than 5; use smaller {}",
                self.cells_across,
                plan.sizes()
            ),
        );
        for file in &self.turned {
            warn(true, format!("{file} is inside out: all its facets are taken as turned the other way"));
        }
        if let Some(gap) = &self.gap {
            let cells = gap.width / plan.resolution();
            warn(
                cells < CELLS_IN_GAP * (1.0 - 1e-9),
                format!(
                    "between {} there are only {} {elements} at the start, less than 4; use smaller {}, or let them touch{}",
                    gap.between,
                    significant(cells),
                    plan.sizes(),
                    if plan.lattice().is_some() { ", or write bars as a [[cage]]" } else { "" }
                ),
            );
        }
        warnings
    }

    /// Why the case cannot be computed at all, or not on this machine.
    pub(crate) fn refusal(&self, case: &Case) -> Option<CaseError> {
        let plan = &self.plan;
        if self.cells_across < LEAST_CELLS_ACROSS {
            let thickness = significant(1e3 * self.cells_across * plan.resolution());
            return Some(case.refuse(
                &[case.method.resolution_key()],
                format!("at its thinnest ({thickness} mm) the fluid is thinner than a {}", plan.element()),
                "write a fifth of that at most",
            ));
        }
        if let Some(refusal) = plan.lattice().and_then(|plan| too_long(plan, case)) {
            return Some(refusal);
        }
        let least = plan.steps() * (plan.wet() / FASTEST[0]).max(1.0 / FASTEST[1]);
        // What is not a number will never end either.
        if least.is_nan() || least > YEAR {
            return Some(case.refuse(
                &[if plan.lattice().is_some() { "lbm.time_step" } else { "isph.stress" }, "stop.time"],
                format!(
                    "{:.1e} steps of {:.1e} s to the end of the run would take years",
                    plan.steps(),
                    plan.time_step()
                ),
                format!("use longer steps or larger {}, or stop earlier", plan.sizes()),
            ));
        }
        let memory = Memory::of_this_machine()?;
        (plan.memory() > memory.total).then(|| {
            case.refuse(
                &[case.method.resolution_key()],
                format!(
                    "the run needs about {} of memory, this machine has {}",
                    HumanBytes(plan.memory() as u64),
                    HumanBytes(memory.total as u64)
                ),
                format!("use larger {}", plan.sizes()),
            )
        })
    }
}

/// What is out of its good range on a lattice.
fn of_lattice(plan: &tremie_lbm::Plan) -> Vec<String> {
    let tau = plan.relaxation_time;
    let mut warnings = Vec::new();
    let mut warn = |wrong: bool, text: String| {
        if wrong {
            warnings.push(text);
        }
    };
    warn(
        tau > RELAXATION_TIME[1],
        format!(
            "the relaxation time {tau:.3} is above 1.5: walls and surface are inaccurate; set a smaller `time_step` or `lattice_viscosity` under [lbm]"
        ),
    );
    warn(
        tau < RELAXATION_TIME[0],
        format!(
            "the relaxation time {tau:.4} is below 0.505: the flow may become unstable; use smaller cells, or a larger `lattice_speed` or `hydrostatic_error` under [lbm]"
        ),
    );
    warn(
        plan.mach > MACH,
        format!(
            "the Mach number {:.3} is above 0.3: the fluid is compressed by its motion; set a smaller `time_step` or `lattice_speed` under [lbm]",
            plan.mach
        ),
    );
    warn(
        plan.hydrostatic_error > HYDROSTATIC_ERROR,
        format!(
            "the fluid's own weight changes its density by {:.1} %, more than 5 %; set a smaller `time_step` or `hydrostatic_error` under [lbm]",
            100.0 * plan.hydrostatic_error
        ),
    );
    warnings
}

/// Why a time step that the case itself gives is too long for a lattice.
fn too_long(plan: &tremie_lbm::Plan, case: &Case) -> Option<CaseError> {
    let given = &["lbm.time_step"];
    if plan.hydrostatic_error > BROKEN {
        let sound = plan.scaling.time_step * (0.02 / plan.hydrostatic_error).sqrt();
        return Some(case.refuse(
            given,
            format!(
                "the time step is too long: the fluid's own weight would change its density by {} %",
                significant(100.0 * plan.hydrostatic_error)
            ),
            format!("write \"{} ms\" at most, or leave it out", significant(1e3 * sound)),
        ));
    }
    let (cells, speed) = (plan.scaling.velocity(fastest(case)), fastest(case));
    if cells * 3f64.sqrt() > 1.0 {
        let sound = plan.scaling.time_step * 0.1 / cells;
        return Some(case.refuse(
            given,
            format!(
                "the time step is too long: what moves at {} m/s would go {} cells a step, faster than sound",
                significant(speed),
                significant(cells)
            ),
            format!("write \"{} ms\" at most, or leave it out", significant(1e3 * sound)),
        ));
    }
    None
}

/// Largest speed in m/s that the case itself gives to a wall, to fluid at the start, or to what comes in.
fn fastest(case: &Case) -> f64 {
    let walls = case.domain.sides.iter().map(|side| match side {
        Side::Wall { velocity, .. } => velocity.length(),
        Side::Symmetry | Side::Periodic | Side::Open => 0.0,
    });
    let inlets = case.inlets.iter().map(|inlet| inlet.flow_rate / inlet.face.area());
    let fluid = case.fluid.iter().map(|region| region.velocity.length());
    walls.chain(fluid).chain(inlets).fold(0.0, f64::max)
}

/// Smallest extent in m of all the fluid together within the domain, and of each inlet; periodic axes do not count.
fn thinnest(case: &Case) -> f64 {
    let extent = |axis: usize| {
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        for region in &case.fluid {
            let (min, max) = region.shape.bounds();
            low = low.min(min[axis].max(case.domain.min[axis]));
            high = high.max(max[axis].min(case.domain.max[axis]));
        }
        high - low
    };
    let inlets = case.inlets.iter().map(|inlet| inlet.face.least_extent());
    let confined =
        (0..3).filter(|axis| case.domain.sides[2 * axis] != Side::Periodic && !case.fluid.is_empty());
    confined.map(extent).chain(inlets).fold(f64::INFINITY, f64::min)
}

/// Memory in bytes.
struct Memory {
    total: f64,
    available: f64,
}

impl Memory {
    /// Known on Linux only.
    fn of_this_machine() -> Option<Self> {
        let text = std::fs::read_to_string("/proc/meminfo").ok()?;
        let bytes = |name: &str| {
            let line = text.lines().find_map(|line| line.strip_prefix(name))?;
            let kibibytes: f64 = line.trim_start_matches(':').split_whitespace().next()?.parse().ok()?;
            Some(1024.0 * kibibytes)
        };
        Some(Self { total: bytes("MemTotal")?, available: bytes("MemAvailable")? })
    }
}

/// A time for people: milliseconds below a second.
pub(crate) fn seconds(time: f64) -> String {
    if time < 1.0 { format!("{} ms", significant(1e3 * time)) } else { format!("{} s", significant(time)) }
}

/// A duration for people, as long as one waits for it: `0.8 s`, `42 s`, `3 min 20 s`, `2 h 05 min`.
pub(crate) fn duration(seconds: f64) -> String {
    let whole = seconds.round() as u64;
    match whole {
        _ if seconds < 9.95 => format!("{seconds:.1} s"),
        0..60 => format!("{whole} s"),
        60..3600 => format!("{} min {:02} s", whole / 60, whole % 60),
        3600..172_800 => format!("{} h {:02} min", whole / 3600, whole / 60 % 60),
        _ => format!("{} days", whole / 86_400),
    }
}

/// Three significant digits, without trailing zeros.
pub(crate) fn significant(number: f64) -> String {
    if number == 0.0 || !number.is_finite() {
        return if number == 0.0 { "0".into() } else { "-".into() };
    }
    let digits = 2 - number.abs().log10().floor() as i32;
    if !(-4..=8).contains(&digits) {
        return format!("{number:.2e}");
    }
    let text = format!("{number:.*}", digits.max(0) as usize);
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_written_for_people() {
        let written = [0.0, 5.0, 0.0001537, 1.999, 123.4, 9876.5, 1e9, f64::NAN].map(significant);
        assert_eq!(written, ["0", "5", "0.000154", "2", "123", "9876", "1.00e9", "-"]);
        assert_eq!([0.0001537, 0.25, 600.0].map(seconds), ["0.154 ms", "250 ms", "600 s"]);
        assert_eq!(
            [0.84, 9.99, 59.4, 59.6, 200.0, 7500.0, 1e6].map(duration),
            ["0.8 s", "10 s", "59 s", "1 min 00 s", "3 min 20 s", "2 h 05 min", "11 days"]
        );
    }
}
