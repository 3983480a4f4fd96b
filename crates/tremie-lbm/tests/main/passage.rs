//! Bodies that come in through inlets and leave by outlets.

use tremie_case::Case;
use tremie_lbm::Plan;
use tremie_numerics::DVec3;
use tremie_simulation::{Fluid, Snapshot};
use tremie_suspension::Form;

use crate::{advance, advanced, case};

/// Concrete that comes through a face as wide as the channel, 30 mm from its closed end, and goes as a plug to its open one, with spheres and
/// fibres, so that each takes these shares of the volume.
fn channel(sphere: f64, fibre: f64, more: &str) -> String {
    format!(
        "[material]\ndensity = \"2300 kg/m3\"\nbingham = {{ yield_stress = \"20 Pa\", plastic_viscosity = \"20 Pa s\" }}\n\
         [domain]\nmin = [\"0 m\", \"0 m\", \"0 m\"]\nmax = [\"300 mm\", \"60 mm\", \"60 mm\"]\n\
         gravity = [\"0 m/s2\", \"0 m/s2\", \"0 m/s2\"]\n\
         sides = {{ y_min = \"symmetry\", y_max = \"symmetry\", z_min = \"symmetry\", z_max = \"symmetry\", x_max = \"open\" }}\n\
         [[inlet]]\nrectangle = {{ centre = [\"30 mm\", \"30 mm\", \"30 mm\"], direction = [1, 0, 0], size = [\"80 mm\", \"80 mm\"] }}\n\
         speed = \"0.1 m/s\"\nbatch = \"new\"\n{more}\
         [[inlet.inclusions]]\nname = \"stones\"\nsphere = {{ diameter = \"24 mm\" }}\ndensity = \"2300 kg/m3\"\nvolume_fraction = {sphere}\n\
         [[inlet.inclusions]]\nname = \"steel\"\nfibre = {{ length = \"50 mm\", diameter = \"0.5 mm\" }}\ndensity = \"7850 kg/m3\"\n\
         volume_fraction = {fibre}\n[lbm]\ncell_size = \"10 mm\"\n"
    )
}

/// Where the plate of the inlet ends.
const FRONT: f64 = 0.03;

/// How many of a kind are in the domain.
fn present(snapshot: &Snapshot, kind: usize) -> u64 {
    snapshot.inclusions.kind.iter().filter(|of| usize::from(**of) == kind).count() as u64
}

/// How many are due but have not come in yet, by kind, where the kinds are those that come in.
fn owed(case: &Case, snapshot: &Snapshot) -> Vec<i64> {
    let counts = case.incoming().zip(&snapshot.bodies_in);
    counts.map(|((inlet, of), came)| of.due(snapshot.inflow[inlet]) as i64 - *came as i64).collect()
}

#[test]
fn what_comes_in_is_there_or_has_left() {
    let case = case(&channel(0.04, 0.0005, ""));
    let mut simulation = advanced(&case, 0);
    let mut last = 0;
    while simulation.time() < 5.0 {
        advance(&mut *simulation, 50);
        let snapshot = simulation.snapshot();
        for kind in 0..2 {
            let (came, left) = (snapshot.bodies_in[kind], snapshot.bodies_out[kind]);
            assert_eq!(came, left + present(&snapshot, kind), "kind {kind} at {}", snapshot.time);
        }
        // As many as the volume asks for, but for those that wait for the fluid, or for others to make room.
        let owed = owed(&case, &snapshot);
        assert!(owed.iter().all(|owed| (0..=2).contains(owed)), "{owed:?} are owed at {}", snapshot.time);
        let bodies = &snapshot.inclusions;
        for n in 0..bodies.len() {
            let at = bodies.position[n];
            let radius = if bodies.kind[n] == 0 { 12e-3 } else { 0.25e-3 };
            for p in bodies.ends(n).unwrap_or([at; 2]) {
                // Within a tenth of a cell, as contacts are.
                let depth = [p.x - FRONT, p.y, 0.06 - p.y, p.z, 0.06 - p.z].map(|way| radius - way);
                assert!(depth.iter().all(|depth| *depth < 1e-3), "body {n} at {p}: {depth:?}");
            }
            assert!(at.x < 0.29, "body {n} is in the outlet");
            assert_eq!(bodies.batch[n], 1);
            // They go with the plug.
            let off = bodies.velocity[n] - DVec3::new(0.1, 0.0, 0.0);
            assert!(off.length() < 0.02, "body {n} at {at} goes at {}", bodies.velocity[n]);
        }
        // Nobody's number is another's, nor was.
        let mut ids = bodies.id.clone();
        ids.sort_unstable();
        assert!(ids.windows(2).all(|pair| pair[0] < pair[1]) && bodies.next >= last);
        assert!(ids.iter().all(|id| *id < bodies.next));
        last = bodies.next;
    }
    let snapshot = simulation.snapshot();
    assert_eq!(last, snapshot.bodies_in.iter().sum::<u64>());
    // In 5 s come 1.8 l: ten stones and some ninety fibres; what came in the first two seconds has left.
    assert!(snapshot.bodies_in[0] > 8 && snapshot.bodies_in[1] > 88, "{:?}", snapshot.bodies_in);
    assert!(snapshot.bodies_out[0] > 2 && snapshot.bodies_out[1] > 30, "{:?}", snapshot.bodies_out);
}

#[test]
fn bodies_pass_the_same_on_any_threads_and_after_a_restart() {
    let case = case(&(channel(0.1, 0.001, "") + "stepping = \"adaptive\"\n"));
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| advanced(&case, 1700))
    };
    let alone = with(1);
    // Some have left by then, and some wait.
    let snapshot = alone.snapshot();
    assert!(snapshot.bodies_out.iter().all(|left| *left > 0), "{:?}", snapshot.bodies_out);
    let alone = alone.save();
    assert!(alone == with(2).save());
    let saved = advanced(&case, 900).save();
    let mut other = tremie_lbm::simulation(&case);
    other.restore(&saved).unwrap();
    assert!(other.save() == saved);
    advance(&mut *other, 800);
    assert!(other.save() == alone);
}

#[test]
fn what_finds_no_room_stays_owed_and_comes_later() {
    // More stones than can lie beside each other as they come: they wait, and come once there is room.
    let case = case(
        &channel(0.45, 0.0, "volume = \"0.2 l\"\n")
            .replace("volume_fraction = 0\n", "volume_fraction = 1e-6\n"),
    );
    let mut simulation = advanced(&case, 0);
    let (mut most, mut before) = (0, 0);
    while simulation.time() < 0.6 {
        advance(&mut *simulation, 10);
        let snapshot = simulation.snapshot();
        most = most.max(owed(&case, &snapshot)[0]);
        assert!(snapshot.bodies_in[0] >= before);
        before = snapshot.bodies_in[0];
        let bodies = &snapshot.inclusions;
        for n in 0..bodies.len() {
            for m in 0..n {
                let apart = (bodies.position[n] - bodies.position[m]).length();
                assert!(apart > 0.024 * 0.98, "bodies {n} and {m} are {apart} m apart");
            }
        }
    }
    assert!(most > 1 && before > 2, "{most} waited, {before} came");
}

#[test]
fn behind_a_plane_of_symmetry_half_of_the_bodies_come() {
    let hose = |sides: &str, y: f64| {
        case(&format!(
            "[material]\ndensity = \"2300 kg/m3\"\nbingham = {{ yield_stress = \"20 Pa\", plastic_viscosity = \"20 Pa s\" }}\n\
             [domain]\nmin = [\"0 m\", \"0 m\", \"0 m\"]\nmax = [\"200 mm\", \"160 mm\", \"120 mm\"]\nsides = {{ {sides} }}\n\
             [[inlet]]\ndisc = {{ centre = [\"100 mm\", \"{y} mm\", \"80 mm\"], direction = [0, 0, -1], diameter = \"70 mm\" }}\n\
             flow_rate = \"1 l/s\"\n[[inlet.inclusions]]\nname = \"steel\"\nfibre = {{ length = \"50 mm\", diameter = \"0.5 mm\" }}\n\
             density = \"7850 kg/m3\"\nvolume_fraction = 0.001\n[lbm]\ncell_size = \"10 mm\"\n"
        ))
    };
    let (whole, half) = (hose("", 80.0), hose("y_min = \"symmetry\"", 0.0));
    // In the second of the case, of pi/4 (0.5 mm)^2 50 mm each.
    assert_eq!((Plan::new(&whole).incoming, Plan::new(&half).incoming), (vec![101], vec![50]));
    assert!(Plan::new(&whole).memory_of_bodies > Plan::new(&half).memory_of_bodies);
    let mut simulation = advanced(&half, 0);
    while simulation.time() < 0.5 {
        advance(&mut *simulation, 20);
    }
    let snapshot = simulation.snapshot();
    assert!((0..=3).contains(&owed(&half, &snapshot)[0]), "{:?}", snapshot.bodies_in);
    assert!(snapshot.bodies_in[0] >= 22 && snapshot.bodies_in[0] <= 25, "{:?}", snapshot.bodies_in);
    let bodies = &snapshot.inclusions;
    let Fluid::Cells(cells) = &snapshot.fluid;
    for n in 0..bodies.len() {
        assert_eq!(*bodies.form(n), Form::Fibre { length: 0.05, diameter: 0.5e-3 });
        assert!(bodies.ends(n).unwrap().iter().all(|end| end.y > -1e-3 && end.z > -1e-3));
        // In the fluid, or in a cell beside it.
        let place = ((bodies.position[n] - cells.origin) / cells.size).floor();
        let near =
            (0..27).map(|n| place + DVec3::new((n % 3) as f64, (n / 3 % 3) as f64, (n / 9) as f64) - 1.0);
        let count = DVec3::from(cells.count.map(|n| n as f64));
        let wet = near.filter(|at| at.cmpge(DVec3::ZERO).all() && at.cmplt(count).all()).any(|at| {
            let [i, j, k] = at.to_array().map(|n| n as usize);
            cells.fill[cells.index(i, j, k)] > 0.0
        });
        assert!(wet, "body {n} is out of the fluid at {}", bodies.position[n]);
    }
}
