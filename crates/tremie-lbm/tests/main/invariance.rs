//! The same flow, set up in another way, is the same.

use tremie_numerics::DVec3;

use crate::{advance, advanced, case, cells};

/// A lop-sided block of Bingham fluid that collapses in a box, with all coordinates put through `place`.
fn collapse(place: impl Fn([f64; 3]) -> [f64; 3], precision: &str, sides: &str) -> String {
    let point = |p: [f64; 3]| {
        let [x, y, z] = place(p);
        format!("[\"{x} m\", \"{y} m\", \"{z} m\"]")
    };
    let corner = |a: [f64; 3], b: [f64; 3]| {
        let (a, b) = (place(a), place(b));
        let text = |f: fn(f64, f64) -> f64| {
            let [x, y, z] = [0, 1, 2].map(|n| f(a[n], b[n]));
            format!("[\"{x} m\", \"{y} m\", \"{z} m\"]")
        };
        format!("min = {}, max = {}", text(f64::min), text(f64::max))
    };
    let (low, high) = (place([-0.2, -0.15, 0.0]), place([0.2, 0.15, 0.15]));
    let (low, high) = ([0, 1, 2].map(|n| low[n].min(high[n])), [0, 1, 2].map(|n| low[n].max(high[n])));
    format!(
        "[material]\ndensity = \"2300 kg/m3\"\n\
         [material.bingham]\nyield_stress = \"50 Pa\"\nplastic_viscosity = \"20 Pa s\"\n\
         [domain]\nmin = [\"{} m\", \"{} m\", \"{} m\"]\nmax = [\"{} m\", \"{} m\", \"{} m\"]\n\
         {sides}\n\
         [[fluid]]\nbox = {{ {} }}\n\
         [[fluid]]\nsphere = {{ centre = {}, diameter = \"86 mm\" }}\n\
         [lbm]\ncell_size = \"10 mm\"\nprecision = \"{precision}\"\n",
        low[0],
        low[1],
        low[2],
        high[0],
        high[1],
        high[2],
        corner([-0.1, -0.04, 0.0], [0.06, 0.033, 0.11]),
        point([0.1, 0.05, 0.08]),
    )
}

/// The case with time steps that are fixed or adaptive; its last section is that of the lattice.
fn stepping_by(stepping: &str, case: &str) -> String {
    format!("{case}stepping = \"{stepping}\"\n")
}

fn as_is(p: [f64; 3]) -> [f64; 3] {
    p
}

#[test]
fn any_number_of_threads_gives_the_same_bits() {
    for stepping in ["fixed", "adaptive"] {
        let case = case(&stepping_by(stepping, &collapse(as_is, "f32", "")));
        let with = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| advanced(&case, 1200).save())
        };
        let alone = with(1);
        assert!(alone == with(2));
        assert!(alone == with(5));
    }
}

#[test]
fn what_is_seen_takes_the_place_of_what_was_seen_before() {
    let one = advanced(&case(&collapse(as_is, "f32", "")), 300);
    let grows = "thixotropy = { build_up = \"5 Pa/s\" }\n[material.bingham]";
    let mut other = collapse(as_is, "f32", "").replace("[material.bingham]", grows);
    other = other.replace("\n[[fluid]]\nsphere", "\nbatch = \"block\"\n[[fluid]]\nsphere");
    let mut other = advanced(&case(&other), 0);
    // A large box after a small one and the other way round, with batches and structure and without.
    let mut seen = one.snapshot();
    for _ in 0..2 {
        advance(&mut *other, 200);
        other.see(&mut seen);
        assert!(seen == other.snapshot());
        one.see(&mut seen);
        assert!(seen == one.snapshot());
    }
}

#[test]
fn a_restored_run_goes_on_to_the_bit() {
    for (precision, stepping) in [("f32", "fixed"), ("f64", "fixed"), ("f32", "adaptive")] {
        let case = case(&stepping_by(stepping, &collapse(as_is, precision, "")));
        let mut half = advanced(&case, 700);
        let saved = half.save();
        advance(&mut *half, 700);
        let mut other = tremie_lbm::simulation(&case);
        other.restore(&saved).unwrap();
        assert!(other.save() == saved);
        advance(&mut *other, 700);
        assert!(other.save() == half.save());
        assert_eq!(other.time(), half.time());
    }
}

#[test]
fn a_foreign_or_damaged_state_is_refused() {
    let case32 = case(&collapse(as_is, "f32", ""));
    let case64 = case(&collapse(as_is, "f64", ""));
    let saved = tremie_lbm::simulation(&case32).save();
    let mut other = tremie_lbm::simulation(&case64);
    assert!(other.restore(&saved).unwrap_err().to_string().contains("f32"));
    for n in 0..saved.arrays.len() {
        let mut damaged = saved.clone();
        let (name, _) = damaged.arrays.remove(n);
        let error = tremie_lbm::simulation(&case32).restore(&damaged).unwrap_err();
        assert!(error.to_string().contains(&name), "{error}");
    }
}

/// Compares two runs cell by cell, the second seen through `back` (which maps its points and vectors to the first).
fn same_flow(place: impl Fn([f64; 3]) -> [f64; 3], steps: usize, tolerance: f64) {
    let first = cells(&*advanced(&case(&collapse(as_is, "f64", "")), steps));
    let second = cells(&*advanced(&case(&collapse(&place, "f64", "")), steps));
    let mut compared = 0;
    for k in 0..first.count[2] {
        for j in 0..first.count[1] {
            for i in 0..first.count[0] {
                let n = first.index(i, j, k);
                let at = DVec3::from(place(first.centre(i, j, k).to_array())) - second.origin;
                let at = (at / second.size).floor();
                if at.min_element() < 0.0 || (0..3).any(|a| at[a] as usize >= second.count[a]) {
                    assert_eq!(first.fill[n], 0.0);
                    continue;
                }
                let m = second.index(at.x as usize, at.y as usize, at.z as usize);
                let turned = DVec3::from(place(first.velocity[n].to_array()));
                let scale = 1.0; // m/s, about the largest speed
                assert!((first.fill[n] - second.fill[m]).abs() < tolerance, "fill at {i} {j} {k}");
                assert!(
                    (turned - second.velocity[m]).length() < tolerance * scale,
                    "velocity at {i} {j} {k}"
                );
                compared += usize::from(first.fill[n] > 0.0);
            }
        }
    }
    assert!(compared > 1000);
}

#[test]
fn a_mirrored_set_up_gives_the_mirrored_flow() {
    same_flow(|[x, y, z]| [-x, y, z], 400, 1e-10);
    same_flow(|[x, y, z]| [x, -y, z], 400, 1e-10);
}

#[test]
fn a_turned_set_up_gives_the_turned_flow() {
    same_flow(|[x, y, z]| [-y, x, z], 400, 1e-10);
    same_flow(|[x, y, z]| [y, x, z], 400, 1e-10);
}

#[test]
fn a_quarter_behind_symmetry_planes_is_the_whole() {
    let text = |min: &str, sides: &str| {
        format!(
            "[material]\ndensity = \"2300 kg/m3\"\n\
             [material.bingham]\nyield_stress = \"50 Pa\"\nplastic_viscosity = \"20 Pa s\"\n\
             [domain]\nmin = [\"{min}\", \"{min}\", \"0 m\"]\nmax = [\"0.21 m\", \"0.21 m\", \"0.16 m\"]\n{sides}\n\
             [[fluid]]\ncone = {{ base = [\"0 m\", \"0 m\", \"0 m\"], base_diameter = \"200 mm\", \
             top_diameter = \"100 mm\", height = \"150 mm\" }}\n\
             [lbm]\ncell_size = \"10 mm\"\nprecision = \"f64\"\n"
        )
    };
    let symmetric = "[domain.sides]\nx_min = \"symmetry\"\ny_min = \"symmetry\"\n";
    let whole = cells(&*advanced(&case(&text("-0.21 m", "")), 300));
    let quarter = cells(&*advanced(&case(&text("0 m", symmetric)), 300));
    let shift = ((quarter.origin - whole.origin) / whole.size).round();
    for k in 0..quarter.count[2] {
        for j in 0..quarter.count[1] {
            for i in 0..quarter.count[0] {
                let n = quarter.index(i, j, k);
                let m = whole.index(i + shift.x as usize, j + shift.y as usize, k + shift.z as usize);
                assert!((quarter.fill[n] - whole.fill[m]).abs() < 1e-10);
                assert!((quarter.velocity[n] - whole.velocity[m]).length() < 1e-10);
            }
        }
    }
    let volume = |cells: &tremie_simulation::Cells| cells.fill.iter().sum::<f64>() * cells.copies();
    assert!((volume(&quarter) / volume(&whole) - 1.0).abs() < 1e-12);
}
