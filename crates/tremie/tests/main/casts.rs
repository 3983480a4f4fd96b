//! The ready casts with fibres, in coarse cells and for their first seconds.

use std::collections::BTreeMap;

use super::*;

/// Name of each case, edge of its cells and of coarse ones, when it stops and when it stops here.
const CASTS: [(&str, [&str; 2], [&str; 2]); 4] = [
    ("fibre-slab", ["\"10 mm\"", "\"20 mm\""], ["\"90 s\"", "\"1 s\""]),
    ("fibre-plate", ["\"10 mm\"", "\"20 mm\""], ["\"90 s\"", "\"1 s\""]),
    ("fibre-beam", ["\"10 mm\"", "\"12.5 mm\""], ["\"20 s\"", "\"1 s\""]),
    ("fibre-wall", ["\"10 mm\"", "\"12.5 mm\""], ["\"60 s\"", "\"1 s\""]),
];

/// Runs a ready case with some of what its file says changed.
fn run_changed(place: &Path, name: &str, changes: &[[&str; 2]]) {
    done(place, &["new", name]);
    let file = format!("{name}.toml");
    let mut case = fs::read_to_string(place.join(&file)).unwrap();
    for [from, to] in changes {
        assert_eq!(case.matches(&format!("= {from} ")).count(), 1, "{name}: {from}");
        case = case.replace(&format!("= {from} "), &format!("= {to} "));
    }
    fs::write(place.join(&file), &case).unwrap();
    done(place, &["run", &file, "--out", name, "-q"]);
    assert!(fs::read(place.join(name).join("orientation_upper_000001.png")).is_ok(), "{name}");
}

/// The last row of a run's gauges.
fn last(run: &Path) -> BTreeMap<String, f64> {
    let series = fs::read_to_string(run.join("series.csv")).unwrap();
    let names = series.lines().next().unwrap().split(',').map(str::to_owned);
    names.zip(series.lines().last().unwrap().split(',').map(|cell| cell.parse().unwrap())).collect()
}

#[test]
fn fibres_of_the_ready_casts_come_in_and_none_is_lost() {
    let place = tempfile::tempdir().unwrap();
    let place = place.path();
    for (name, cells, stop) in CASTS {
        run_changed(place, name, &[cells, stop]);
        let last = last(&place.join(name));
        let (came, present) = (last["bodies_fibres_in"], last["bodies_fibres_present"]);
        assert_eq!((came, last["bodies_fibres_out"]), (present, 0.0), "{name}");
        let inflow = last["inlet1_inflow_m3"];
        assert!((last["volume_m3"] / inflow - 1.0).abs() < 0.005, "{name}: {last:?}");
        // One fibre for each of its share of what came in, and no more than a few wait for their turn.
        let share = if name == "fibre-beam" { 0.002 } else { 0.005 };
        let due = inflow * share / (0.06 * std::f64::consts::PI / 4.0 * 0.75e-3_f64.powi(2));
        assert!((came - due).abs() < 2.0 + 0.01 * due, "{name}: {came} of {due}");
    }
}

/// This one begins with all of its fibres, of which a tenth is enough here.
#[test]
fn fibres_of_the_ready_l_box_leave_the_column_and_none_is_lost() {
    let place = tempfile::tempdir().unwrap();
    let place = place.path();
    done(place, &["new", "fibre-l-box"]);
    assert!(done(place, &["check", "fibre-l-box.toml"]).contains("21,734 fibres"));
    fs::remove_file(place.join("fibre-l-box.toml")).unwrap();
    let changes = [
        ["\"3.3333333333 mm\"", "\"5 mm\""],
        ["\"20 s\"", "\"0.2 s\""],
        ["21734", "2173"],
        ["\"0.1 s\"", "\"0.05 s\""],
    ];
    run_changed(place, "fibre-l-box", &changes);
    let run = place.join("fibre-l-box");
    let last = last(&run);
    assert!((last["volume_m3"] / 0.0144 - 1.0).abs() < 0.005, "{last:?}");
    let bodies = fs::read_to_string(run.join("bodies.csv")).unwrap();
    let ends: Vec<f64> =
        bodies.lines().skip(1).map(|row| row.split(',').nth(1).unwrap().parse().unwrap()).collect();
    assert_eq!(ends.len(), 2173);
    assert!(ends.iter().any(|x| *x > 0.12) && ends.iter().all(|x| (0.0..0.7).contains(x)));
}
