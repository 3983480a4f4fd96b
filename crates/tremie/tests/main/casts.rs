//! The ready casts with fibres, in coarse cells and for their first seconds.

use std::collections::BTreeMap;

use super::*;

/// Name of each case, edge of its cells and of coarse ones, when it stops and when it stops here.
const CASTS: [(&str, [&str; 2], [&str; 2]); 5] = [
    ("fibre-slab", ["\"10 mm\"", "\"20 mm\""], ["\"90 s\"", "\"1 s\""]),
    ("fibre-plate", ["\"10 mm\"", "\"20 mm\""], ["\"90 s\"", "\"1 s\""]),
    ("fibre-beam", ["\"10 mm\"", "\"12.5 mm\""], ["\"20 s\"", "\"1 s\""]),
    ("fibre-wall", ["\"10 mm\"", "\"12.5 mm\""], ["\"60 s\"", "\"1 s\""]),
    ("fibre-l-box", ["\"3.3333333333 mm\"", "\"5 mm\""], ["\"20 s\"", "\"0.1 s\""]),
];

/// The column of the L-box is full at the start: m3, and fibres.
const COLUMN: (f64, f64) = (0.0144, 21734.0);

#[test]
fn fibres_of_the_ready_casts_come_in_and_none_is_lost() {
    let place = tempfile::tempdir().unwrap();
    let place = place.path();
    for (name, cells, stop) in CASTS {
        done(place, &["new", name]);
        let file = format!("{name}.toml");
        let mut case = fs::read_to_string(place.join(&file)).unwrap();
        for [from, to] in [cells, stop] {
            assert_eq!(case.matches(&format!("= {from} ")).count(), 1, "{name}: {from}");
            case = case.replace(&format!("= {from} "), &format!("= {to} "));
        }
        fs::write(place.join(&file), case).unwrap();
        done(place, &["run", &file, "--out", name, "-q"]);
        let series = fs::read_to_string(place.join(name).join("series.csv")).unwrap();
        let last: BTreeMap<&str, f64> = series
            .lines()
            .next()
            .unwrap()
            .split(',')
            .zip(series.lines().last().unwrap().split(',').map(|cell| cell.parse().unwrap()))
            .collect();
        let (present, out) = (last["bodies_fibres_present"], last["bodies_fibres_out"]);
        let placed = if let Some(inflow) = last.get("inlet1_inflow_m3") {
            let came = last["bodies_fibres_in"];
            assert_eq!((came, out), (present, 0.0), "{name}");
            // One fibre for each of its share of what came in, and no more than a few wait for their turn.
            let share = if name == "fibre-beam" { 0.002 } else { 0.005 };
            let due = inflow * share / (0.06 * std::f64::consts::PI / 4.0 * 0.75e-3_f64.powi(2));
            assert!((came - due).abs() < 2.0 + 0.01 * due, "{name}: {came} of {due}");
            *inflow
        } else {
            assert_eq!((COLUMN.1, out), (present, 0.0), "{name}");
            COLUMN.0
        };
        assert!((last["volume_m3"] / placed - 1.0).abs() < 0.005, "{name}: {last:?}");
        assert!(fs::read(place.join(name).join("orientation_upper_000001.png")).is_ok(), "{name}");
    }
}
