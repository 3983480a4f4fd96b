//! Fibres as a field that the fluid carries along and turns.

use tremie_numerics::DVec3;
use tremie_simulation::Simulation;
use tremie_suspension::orientation::{principal, tensor_of};

use crate::{advance, advanced, case, cells};

/// A block of Bingham fluid with a field of fibres that collapses in a box, with all coordinates put through `place`.
fn collapse(place: impl Fn(DVec3) -> DVec3, along: DVec3, precision: &str) -> String {
    let vector = |v: DVec3| format!("[\"{} m\", \"{} m\", \"{} m\"]", v.x, v.y, v.z);
    let corners = |a: [f64; 3], b: [f64; 3]| {
        let (a, b) = (place(a.into()), place(b.into()));
        format!("min = {}\nmax = {}\n", vector(a.min(b)), vector(a.max(b)))
    };
    let along = place(along);
    format!(
        "[material]\ndensity = \"2300 kg/m3\"\nbingham = {{ yield_stress = \"50 Pa\", plastic_viscosity = \"20 Pa s\" }}\n\
         [domain]\n{}[domain.sides]\nz_max = \"open\"\n\
         [[fluid]]\n[fluid.box]\n{}\
         [fibre_field]\nfibre = {{ length = \"30 mm\", diameter = \"0.5 mm\" }}\nvolume_fraction = 0.005\n\
         direction = {{ along = [{}, {}, {}] }}\n\
         [lbm]\ncell_size = \"10 mm\"\nprecision = \"{precision}\"\n",
        corners([-0.2, -0.16, 0.0], [0.2, 0.16, 0.16]),
        corners([-0.1, -0.04, 0.0], [0.06, 0.03, 0.12]),
        along.x,
        along.y,
        along.z,
    )
}

fn as_is(p: DVec3) -> DVec3 {
    p
}

const ALONG: DVec3 = DVec3::new(0.6, 0.0, 0.8);

/// The tensors of the wet cells, by the places of the cells.
fn tensors(simulation: &dyn Simulation) -> Vec<(DVec3, [f64; 6])> {
    let cells = cells(simulation);
    let Some(lying) = &cells.lying else { panic!("there is no field of fibres") };
    let [nx, ny, _] = cells.count;
    let wet = (0..cells.fill.len()).filter(|n| cells.fill[*n] > 0.0);
    wet.map(|n| (cells.centre(n % nx, n / nx % ny, n / (nx * ny)), lying.tensors[n])).collect()
}

/// Each is one of orientation, and they are no longer what they were.
#[test]
fn tensors_stay_admissible() {
    let simulation = advanced(&case(&collapse(as_is, ALONG, "f32")), 1500);
    let found = tensors(&*simulation);
    let mut least = 1.0_f64;
    for (_, tensor) in &found {
        let values = principal(&tensor_of(*tensor)).values;
        assert!((values.iter().sum::<f64>() - 1.0).abs() < 1e-12 && values[2] > -1e-12, "{values:?}");
        least = least.min(tensor[2]);
    }
    // Upright fibres at the front lie down.
    assert!(found.len() > 500 && least < 0.2, "{} {least}", found.len());
}

#[test]
fn any_number_of_threads_and_a_pause_give_the_same_bits() {
    let case = case(&collapse(as_is, ALONG, "f32"));
    let with = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| advanced(&case, 605))
    };
    let (alone, saved) = (with(1), with(2).save());
    assert!(alone.save() == saved);
    let mut resumed = tremie_lbm::simulation(&case);
    resumed.restore(&saved).unwrap();
    let mut whole = alone;
    for simulation in [&mut whole, &mut resumed] {
        advance(&mut **simulation, 200);
    }
    assert!(whole.save() == resumed.save());
}

/// Mirrored, or with its axes exchanged, the same collapse has the same tensors.
#[test]
fn axes_and_mirrors_do_not_matter() {
    let run = |place: fn(DVec3) -> DVec3| tensors(&*advanced(&case(&collapse(place, ALONG, "f64")), 800));
    let one = run(as_is);
    let mirrored = run(|p| DVec3::new(-p.x, p.y, p.z));
    let exchanged = run(|p| DVec3::new(p.y, p.x, p.z));
    let at = |all: &[(DVec3, [f64; 6])], place: DVec3| {
        all.iter().find(|(at, _)| at.distance(place) < 1e-6).map(|(_, tensor)| *tensor)
    };
    let close = |a: [f64; 6], b: [f64; 6]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-6);
    for (place, [xx, yy, zz, xy, xz, yz]) in &one {
        let other = at(&mirrored, DVec3::new(-place.x, place.y, place.z)).unwrap();
        assert!(close(other, [*xx, *yy, *zz, -xy, -xz, *yz]), "{place} {other:?}");
        let other = at(&exchanged, DVec3::new(place.y, place.x, place.z)).unwrap();
        assert!(close(other, [*yy, *xx, *zz, *xy, *yz, *xz]), "{place} {other:?}");
    }
}

/// A field does nothing to the fluid.
#[test]
fn the_fluid_does_not_feel_it() {
    let with = collapse(as_is, ALONG, "f32");
    let without: String = {
        let (before, after) = with.split_once("[fibre_field]").unwrap();
        format!("{before}[lbm]{}", after.split_once("[lbm]").unwrap().1)
    };
    let [one, other] = [with, without].map(|text| cells(&*advanced(&case(&text), 300)));
    assert!(one.velocity == other.velocity && one.fill == other.fill);
}

/// In a layer of 15 mm fibres of 60 mm lie as flat as their ends ask for, and beside a wall along it; mirrors end nothing, however near they are to each other.
#[test]
fn fibres_stay_in_the_fluid() {
    for (width, side) in [(60, "periodic"), (10, "symmetry")] {
        let text = format!(
            "[material]\ndensity = \"2300 kg/m3\"\nbingham = {{ yield_stress = \"200 Pa\", plastic_viscosity = \"20 Pa s\" }}\n\
             [domain]\nmin = [\"0 m\", \"0 m\", \"0 m\"]\nmax = [\"60 mm\", \"{width} mm\", \"60 mm\"]\n\
             [domain.sides]\nx_min = \"symmetry\"\ny_min = \"{side}\"\ny_max = \"{side}\"\nx_max = {{ surface = \"free_slip\" }}\n\
             [[fluid]]\nbox = {{ min = [\"0 m\", \"0 m\", \"0 m\"], max = [\"60 mm\", \"60 mm\", \"15 mm\"] }}\n\
             [fibre_field]\nfibre = {{ length = \"60 mm\", diameter = \"0.5 mm\" }}\nvolume_fraction = 0.005\n\
             [lbm]\ncell_size = \"10 mm\"\nprecision = \"f64\"\ntime_step = \"0.2 ms\"\n"
        );
        let found = tensors(&*advanced(&case(&text), 30));
        let at = |x: f64, z: f64| {
            let place = DVec3::new(x, 0.005, z);
            found.iter().find(|(at, _)| at.distance(place) < 1e-6).unwrap().1
        };
        // From the middle of either cell it is half a cell to the floor or the surface, what is half full counting as whole; for (d^2 + h^2/12)/(L/2)^2 of all places in it.
        let most = 1.0 / 27.0;
        for x in [0.005, 0.025] {
            for z in [0.005, 0.015] {
                let [xx, yy, zz, ..] = at(x, z);
                assert!((zz - most).abs() < 1e-4 && (xx - yy).abs() < 1e-6, "{side}: {xx} {yy} {zz}");
            }
        }
        let [xx, yy, zz, ..] = at(0.055, 0.005);
        assert!(
            [xx - most, zz - most, yy - (1.0 - 2.0 * most)].iter().all(|off| off.abs() < 1e-4),
            "{side}: {xx} {yy} {zz}"
        );
    }
}
