//! Forms and obstacles from STL files, through the real binary.

use std::fmt::Write;
use std::fs;

use serde_json::Value;
use tempfile::TempDir;

use super::{done, folder_with_case, json, output, refused, text};

type Facet = [[f64; 3]; 3];

/// A box between two corners in mm, each face cut in two.
fn box_of_facets(min: [f64; 3], max: [f64; 3]) -> Vec<Facet> {
    let corner = |n: usize| [0, 1, 2].map(|axis| if n >> axis & 1 == 1 { max[axis] } else { min[axis] });
    let faces = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    let halves = faces.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]);
    halves.map(|half| half.map(corner)).collect()
}

fn ascii(facets: &[Facet]) -> String {
    let mut file = "solid form\n".to_owned();
    for corners in facets {
        file += "facet normal 0 0 0\nouter loop\n";
        for [x, y, z] in corners {
            writeln!(file, "vertex {x} {y} {z}").unwrap();
        }
        file += "endloop\nendfacet\n";
    }
    file + "endsolid form\n"
}

/// The form: 280 mm wide, open to the planes of symmetry.
fn form() -> Vec<Facet> {
    box_of_facets([-40.0, -40.0, -40.0], [140.0, 140.0, 400.0])
}

/// A short run of the slump in a form; `stl` is more that the case says about the file.
fn folder_with_form(file: &[u8], stl: &str) -> TempDir {
    let solid = format!(
        "[[solid]]\nstl = {{ file = \"forms/form.stl\", unit = \"mm\", {stl} }}\n\n[lbm]\ncell_size = \"20 mm\""
    );
    let place = folder_with_case(&[("[lbm]\ncell_size = \"20 mm\"", &solid), ("\"1 s\"", "\"0.2 s\"")]);
    fs::create_dir(place.path().join("forms")).unwrap();
    fs::write(place.path().join("forms/form.stl"), file).unwrap();
    place
}

#[test]
fn a_form_holds_the_concrete_and_its_run_can_be_resumed_elsewhere() {
    let place = folder_with_form(ascii(&form()).as_bytes(), "role = \"formwork\"");
    let place = place.path();
    done(place, &["run", "slump.toml", "-q", "--out", "run"]);
    // The concrete has come to the wall at 140 mm, and none has passed.
    let spread = json(&place.join("run/summary.json"))["spread_x_m"].as_f64().unwrap();
    assert!((0.27..0.28).contains(&spread), "{spread}");
    // The folder of the run holds what it needs.
    let original = fs::read(place.join("forms/form.stl")).unwrap();
    assert_eq!(fs::read(place.join("run/forms/form.stl")).unwrap(), original);
    let elsewhere = tempfile::tempdir().unwrap();
    fs::rename(place.join("run"), elsewhere.path().join("moved")).unwrap();
    let case = elsewhere.path().join("moved/case.toml");
    fs::write(&case, fs::read_to_string(&case).unwrap().replace("\"0.2 s\"", "\"0.22 s\"")).unwrap();
    done(elsewhere.path(), &["resume", "moved", "-q"]);
    done(elsewhere.path(), &["report", "moved"]);
}

#[test]
fn check_tells_where_a_mesh_lies_and_that_it_was_turned() {
    let place = folder_with_form(ascii(&form()).as_bytes(), "move = [\"0 m\", \"0 m\", \"-0.38 m\"]");
    let told = done(place.path(), &["check", "slump.toml"]);
    let line = "forms/form.stl (obstacle), x -40 to 140, y -40 to 140, z -420 to 20 mm, ";
    assert!(told.contains(line), "{told}");
    let mut turned = form();
    turned.iter_mut().for_each(|corners| corners.swap(0, 1));
    let place = folder_with_form(ascii(&turned).as_bytes(), "role = \"formwork\"");
    let output = output(place.path(), &["check", "slump.toml", "--json"]);
    let told: Value = serde_json::from_str(&text(&output.stdout)).unwrap();
    assert_eq!(told["meshes"][0]["max_m"], serde_json::json!([0.14, 0.14, 0.4]));
    assert_eq!(
        (&told["meshes"][0]["role"], &told["meshes"][0]["turned"]),
        (&"formwork".into(), &true.into())
    );
    let warnings = told["warnings"].to_string();
    assert!(warnings.contains("forms/form.stl is inside out"), "{warnings}");
}

#[test]
fn broken_files_are_refused_with_the_line_and_the_place() {
    let refused = |facets: &[Facet], words: &[&str]| {
        let place = folder_with_form(ascii(facets).as_bytes(), "role = \"formwork\"");
        for command in ["check", "run"] {
            refused(
                place.path(),
                &[command, "slump.toml"],
                &[words, &["slump.toml:17:", "forms/form.stl"]].concat(),
            );
        }
        assert!(!place.path().join("runs").exists());
    };
    let hole = &form()[1..];
    refused(hole, &["3 edges are open, the first at x = ", "mm of the file", "close the holes"]);
    let mut flipped = form();
    flipped[2].swap(0, 1);
    refused(&flipped, &["1 facet is flipped, the first at x = 140, y = 80, z = 106.667 mm of the file"]);
    let crossing = [form(), box_of_facets([0.0; 3], [200.0; 3])].concat();
    refused(&crossing, &["edges pierce other facets, the first at x = ", "unite the parts"]);
    let flat = [[0.0, 0.0, 0.0], [10.0, 10.0, 10.0], [20.0, 20.0, 20.0]];
    refused(&[form(), vec![flat]].concat(), &["1 facet has no area, the first at x = 10, y = 10, z = 10 mm"]);

    let place = folder_with_form(b"\x89PNG\r\n\x1a\n, or any other file", "role = \"formwork\"");
    super::refused(
        place.path(),
        &["check", "slump.toml"],
        &["slump.toml:17:", "not an STL file", "export it again"],
    );
}
