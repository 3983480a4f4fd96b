//! The ready casts with fibres, in coarse cells and for their first seconds.

use std::collections::BTreeMap;

use super::*;

/// Runs a ready case with some of what its file says changed: values, or whole pieces of a line.
fn run_changed(place: &Path, name: &str, changes: &[[&str; 2]]) {
    done(place, &["new", name]);
    let file = format!("{name}.toml");
    let mut case = fs::read_to_string(place.join(&file)).unwrap();
    for [from, to] in changes {
        assert_eq!(case.matches(from).count(), 1, "{name}: {from}");
        case = case.replace(from, to);
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

/// Runs a ready cast for its first second, and sees to it that fibres of so large a share of the volume come in and none is lost.
fn fibres_come_in_and_none_is_lost(name: &str, share: f64, changes: &[[&str; 2]]) -> Vec<f64> {
    let place = tempfile::tempdir().unwrap();
    let place = place.path();
    run_changed(place, name, changes);
    let last = last(&place.join(name));
    let (came, present) = (last["bodies_fibres_in"], last["bodies_fibres_present"]);
    assert_eq!((came, last["bodies_fibres_out"]), (present, 0.0), "{name}");
    let inflow = last["inlet1_inflow_m3"];
    assert!((last["volume_m3"] / inflow - 1.0).abs() < 0.005, "{name}: {last:?}");
    // One fibre for each of its share of what came in, and no more than a few wait for their turn.
    let due = inflow * share / (0.06 * std::f64::consts::PI / 4.0 * 0.75e-3_f64.powi(2));
    assert!((came - due).abs() < 2.0 + 0.01 * due, "{name}: {came} of {due}");
    ends(&place.join(name))
}

/// How far along x the first ends of a run's fibres are, in m.
fn ends(run: &Path) -> Vec<f64> {
    let bodies = fs::read_to_string(run.join("bodies.csv")).unwrap();
    bodies.lines().skip(1).map(|row| row.split(',').nth(1).unwrap().parse().unwrap()).collect()
}

#[test]
fn fibres_come_into_the_ready_slab() {
    let changes = [["= \"10 mm\" ", "= \"20 mm\" "], ["\"90 s\" ", "\"1 s\" "]];
    fibres_come_in_and_none_is_lost("fibre-slab", 0.005, &changes);
}

#[test]
fn fibres_come_into_the_ready_plate() {
    let changes = [["= \"10 mm\" ", "= \"20 mm\" "], ["\"90 s\" ", "\"1 s\" "]];
    fibres_come_in_and_none_is_lost("fibre-plate", 0.005, &changes);
}

#[test]
fn fibres_come_into_the_ready_wall() {
    let changes = [["= \"10 mm\" ", "= \"12.5 mm\" "], ["\"60 s\" ", "\"1 s\" "]];
    fibres_come_in_and_none_is_lost("fibre-wall", 0.005, &changes);
}

/// From the middle, from the right, and from side to side, as the case says how.
#[test]
fn fibres_come_into_the_ready_beam_from_where_the_hose_is() {
    let coarse = [["= \"10 mm\" ", "= \"12.5 mm\" "], ["\"20 s\" ", "\"1 s\" "]];
    let with = |change: [&str; 2]| {
        let ends = fibres_come_in_and_none_is_lost("fibre-beam", 0.002, &[coarse[0], coarse[1], change]);
        let mean = ends.iter().sum::<f64>() / ends.len() as f64;
        let spread = (ends.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / ends.len() as f64).sqrt();
        (mean, spread)
    };
    let (middle, still) = with(["\"275 mm\", \"75 mm\"", "\"275 mm\", \"75 mm\""]);
    let (right, _) = with(["\"275 mm\", \"75 mm\"", "\"490 mm\", \"75 mm\""]);
    let (_, moving) = with(["#motion.path", "motion.path"]);
    assert!((middle - 0.275).abs() < 0.03 && right > 0.4, "{middle} {right}");
    assert!(moving > 1.3 * still, "{moving} {still}");
}

/// This one begins with all of its fibres, of which a tenth is enough here; coarse cells need thicker bars.
#[test]
fn fibres_of_the_ready_l_box_leave_the_column_and_none_is_lost() {
    let place = tempfile::tempdir().unwrap();
    let place = place.path();
    let changes = [
        ["= \"3.3333333333 mm\" ", "= \"10 mm\" "],
        ["\"9 mm\"", "\"20 mm\""],
        ["= \"20 s\" ", "= \"0.3 s\" "],
        ["= 21734 ", "= 2173 "],
        ["= \"0.1 s\" ", "= \"0.05 s\" "],
    ];
    run_changed(place, "fibre-l-box", &changes);
    let run = place.join("fibre-l-box");
    let last = last(&run);
    assert!((last["volume_m3"] / 0.0144 - 1.0).abs() < 0.005, "{last:?}");
    let ends = ends(&run);
    assert_eq!(ends.len(), 2173);
    assert!(ends.iter().any(|x| *x > 0.12) && ends.iter().all(|x| (0.0..0.7).contains(x)));
}

/// Aggregates and fibres of twice the size of theirs, an eighth as many, on cells twice as large.
#[test]
fn aggregates_and_fibres_of_the_ready_slump_go_with_it() {
    let place = tempfile::tempdir().unwrap();
    let place = place.path();
    let changes = [
        ["= \"4 mm\" ", "= \"8 mm\" "],
        ["diameter = \"10 mm\"", "diameter = \"20 mm\""],
        ["= 2626 ", "= 328 "],
        ["= 415 ", "= 52 "],
        ["time = \"60 s\" ", "time = \"0.5 s\" "],
        ["duration = \"1 s\"", "duration = \"0.1 s\""],
        ["= \"0.5 s\"       #", "= \"0.25 s\"       #"],
    ];
    run_changed(place, "heterogeneous-slump", &changes);
    let run = place.join("heterogeneous-slump");
    let last = last(&run);
    let cone = std::f64::consts::PI * 0.3 / 12.0 * (0.2_f64.powi(2) + 0.1_f64.powi(2) + 0.2 * 0.1);
    assert!((last["volume_m3"] / cone - 1.0).abs() < 0.02, "{last:?}");
    let (ends, reach) = (ends(&run), 0.5 * last["spread_m"]);
    assert_eq!(ends.len(), 328 + 52);
    assert!(reach > 0.12 && ends.iter().all(|x| x.abs() < reach + 0.02), "{reach} {last:?}");
}
