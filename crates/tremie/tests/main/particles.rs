//! The same case by particles and by the lattice.

use std::fs;

use serde_json::Value;

use super::{CASE, done, folder_with_case, json, refused};

#[test]
fn the_same_case_runs_by_both_methods_and_is_compared() {
    let sections = ("[lbm]", "[isph]\nspacing = \"20 mm\"\n\n[lbm]");
    let place = folder_with_case(&[("\"lbm\"", "\"isph\""), sections, ("\"1 s\"", "\"0.6 s\"")]);
    let place = place.path();
    fs::write(place.join("cells.toml"), CASE.replace("\"1 s\"", "\"0.6 s\"")).unwrap();
    let checked = done(place, &["check", "slump.toml"]);
    assert!(checked.contains("particles 20 mm apart, in space"), "{checked}");
    done(place, &["run", "slump.toml", "--quiet"]);
    done(place, &["run", "cells.toml", "--quiet"]);
    let run = place.join("runs/slump");
    let record = json(&run.join("run.json"));
    assert_eq!((&record["method"], &record["scaling"]["plane"]), (&"isph".into(), &false.into()));
    done(place, &["report", "runs/slump"]);
    assert!(fs::read_to_string(run.join("report.html")).unwrap().contains("particles 20 mm apart"));

    let told = done(place, &["compare", "runs/cells", "runs/slump", "--out", "both"]);
    assert!(
        told.contains("cells (lbm)") && told.contains("slump (isph)") && told.contains("spread_m"),
        "{told}"
    );
    let compared = json(&place.join("both/comparison.json"));
    let off = compared["largest_difference"]["spread_m"][0].as_f64().unwrap();
    assert!((1e-6..0.3).contains(&off), "{compared}");
    let ends: Vec<f64> =
        compared["at_the_end"]["spread_m"].as_array().unwrap().iter().filter_map(Value::as_f64).collect();
    assert!(ends.len() == 2 && ends.iter().all(|spread| (0.3..0.6).contains(spread)), "{compared}");
    for picture in ["spread_m.png", "top_m.png", "profile.png"] {
        assert!(fs::read(place.join("both").join(picture)).unwrap().starts_with(b"\x89PNG"));
    }
    refused(place, &["compare", "runs/cells"], &["2 values"]);
    refused(place, &["compare", "runs/cells", "runs/none"], &["runs/none"]);
}
