//! Solids from STL files: a box of 100 x 60 x 40 mm, whole in `form.stl`, and broken in every way that has a message.

// Helpers of tests are tests too.
#![allow(clippy::unwrap_used)]

use std::fs;
use std::path::Path;

use proptest::prelude::*;
use stl_io::{Normal, Triangle, Vertex};
use tempfile::TempDir;
use tremie_case::{Case, MeshFile, Role};
use tremie_geometry::Body;
use tremie_numerics::DVec3;

use super::SLUMP_FLOW;

const FORM: &[u8] = include_bytes!("form.stl");

fn facets() -> Vec<Triangle> {
    let mesh = stl_io::read_stl(&mut std::io::Cursor::new(FORM)).unwrap();
    mesh.into_triangle_vec()
}

fn binary(facets: &[Triangle]) -> Vec<u8> {
    let mut bytes = Vec::new();
    stl_io::write_stl(&mut bytes, facets.iter()).unwrap();
    bytes
}

/// What `solid` makes of a file of the name `form.stl`.
fn read(bytes: &[u8], solid: &str) -> Result<Case, String> {
    let place = TempDir::new().unwrap();
    fs::write(place.path().join("form.stl"), bytes).unwrap();
    parse(place.path(), solid)
}

fn parse(folder: &Path, solid: &str) -> Result<Case, String> {
    let name = folder.join("case.toml");
    let text = SLUMP_FLOW.replace("[lbm]", &format!("[[solid]]\n{solid}\n\n[lbm]"));
    Case::parse(name.to_str().unwrap(), &text).map_err(|error| error.to_string())
}

const PLAIN: &str = "stl = { file = \"form.stl\", unit = \"mm\" }";

fn mesh(case: &Case) -> &MeshFile {
    let [mesh] = case.meshes.as_slice() else { panic!("{} meshes", case.meshes.len()) };
    mesh
}

fn bounds(case: &Case) -> (DVec3, DVec3) {
    mesh(case).mesh.bounds()
}

fn assert_near(a: (DVec3, DVec3), b: ([f64; 3], [f64; 3])) {
    let far = (a.0 - DVec3::from(b.0)).abs().max((a.1 - DVec3::from(b.1)).abs());
    assert!(far.max_element() < 1e-12, "{a:?} {b:?}");
}

#[test]
fn binary_and_ascii_files_give_the_same_body() {
    let ascii = read(FORM, PLAIN).unwrap();
    let binary = binary(&facets());
    let same = read(&binary, PLAIN).unwrap();
    assert_eq!(mesh(&ascii).mesh, mesh(&same).mesh);
    assert_eq!(ascii.solids, same.solids);
    assert_eq!((&*same.files[0].bytes, same.files[0].path.as_str()), (&*binary, "form.stl"));
    assert_near(bounds(&ascii), ([0.0; 3], [0.1, 0.06, 0.04]));
    assert!((ascii.solids[0].body.signed_distance(DVec3::new(0.05, 0.03, 0.01)) + 0.01).abs() < 1e-15);
    // Binary files whose header begins as ASCII files do, and ASCII files without a name.
    let mut named = binary;
    named[..6].copy_from_slice(b"solid ");
    assert_eq!(mesh(&read(&named, PLAIN).unwrap()).mesh, mesh(&ascii).mesh);
    let nameless = String::from_utf8(FORM.to_vec()).unwrap().replace(" form", "");
    assert_eq!(mesh(&read(nameless.as_bytes(), PLAIN).unwrap()).mesh, mesh(&ascii).mesh);
    // A vertex at -0 is the one at 0.
    let negative = String::from_utf8(FORM.to_vec()).unwrap().replacen("vertex 0 0 0", "vertex -0 0 -0", 1);
    assert_eq!(mesh(&read(negative.as_bytes(), PLAIN).unwrap()).mesh, mesh(&ascii).mesh);
}

#[test]
fn a_drawing_is_scaled_turned_and_moved() {
    let with = |more: &str| {
        let solid = format!("stl = {{ file = \"./form.stl\", {more} }}");
        bounds(&read(FORM, &solid).unwrap_or_else(|error| panic!("{error}")))
    };
    assert_near(with("unit = \"cm\", scale = 0.5"), ([0.0; 3], [0.5, 0.3, 0.2]));
    assert_near(with("unit = \"m\", scale = 0.01"), ([0.0; 3], [1.0, 0.6, 0.4]));
    assert_near(with("unit = \"in\", scale = 0.1"), ([0.0; 3], [0.254, 0.1524, 0.1016]));
    let way = "unit = \"mm\", move = [\"1 cm\", \"2 cm\", \"3 cm\"]";
    assert_near(with(way), ([0.01, 0.02, 0.03], [0.11, 0.08, 0.07]));
    // x to y, y to -x.
    let turn = "unit = \"mm\", rotate = [0, 0, \"90 deg\"], move = [\"60 mm\", \"0 m\", \"0 m\"]";
    assert_eq!(with(turn).0, DVec3::ZERO);
    assert_near(with(turn), ([0.0; 3], [0.06, 0.1, 0.04]));
    // First about x (y to z, z to -y), then about z (that -y to x).
    let both = "unit = \"mm\", rotate = [\"90 deg\", 0, \"90 deg\"]";
    assert_near(with(both), ([0.0, 0.0, 0.0], [0.04, 0.1, 0.06]));
}

#[test]
fn a_form_holds_the_fluid_and_several_files_make_one_solid() {
    let form = "stl = { file = \"form.stl\", unit = \"mm\", role = \"formwork\" }";
    let case = read(FORM, form).unwrap();
    assert!(matches!(&case.solids[0].body, Body::Complement(_)));
    assert_eq!(mesh(&case).role, Role::Formwork);
    for (p, solid) in [([0.05, 0.03, 0.02], false), ([0.05, 0.03, 0.05], true), ([0.2, 0.0, 0.0], true)] {
        assert_eq!(case.solids[0].body.signed_distance(p.into()) < 0.0, solid, "{p:?}");
    }
    let second = "stl = { file = \"form.stl\", unit = \"mm\", move = [\"200 mm\", \"0 m\", \"0 m\"] }";
    let case = read(FORM, &format!("union.of = [{{ {PLAIN} }}, {{ {second} }}]")).unwrap();
    assert_eq!(case.meshes.len(), 2);
    assert_near(case.solids[0].body.bounds(), ([0.0; 3], [0.3, 0.06, 0.04]));
}

#[test]
fn a_drawing_that_is_inside_out_is_turned() {
    let mut facets = facets();
    facets.iter_mut().for_each(|facet| facet.vertices.swap(0, 1));
    let case = read(&binary(&facets), PLAIN).unwrap();
    assert!(mesh(&case).mesh.turned());
    assert!(case.solids[0].body.signed_distance(DVec3::new(0.05, 0.03, 0.01)) < 0.0);
}

/// Facets of the box, moved and turned inside out or not.
fn copy(way: [f32; 3], facets: &[Triangle]) -> Vec<Triangle> {
    let moved = |v: Vertex| Vertex::new([v[0] + way[0], v[1] + way[1], v[2] + way[2]]);
    facets.iter().map(|facet| Triangle { vertices: facet.vertices.map(moved), ..*facet }).collect()
}

fn refused(bytes: &[u8], words: &[&str]) {
    let message = read(bytes, PLAIN).unwrap_err();
    assert_eq!(message.matches("error: ").count(), 1, "{message}");
    for word in [words, &["case.toml:28:16\n", "form.stl"]].concat() {
        assert!(message.contains(word), "does not tell `{word}`:\n{message}");
    }
}

#[test]
fn a_broken_file_is_told_with_count_place_and_line() {
    let whole = facets();
    // Half of the face at x = 100 mm is missing.
    let hole: Vec<Triangle> = [&whole[..3], &whole[4..]].concat();
    refused(
        &binary(&hole),
        &["3 edges are open, the first at x = 100,", "mm of the file", "close the holes"],
    );
    let mut flipped = whole.clone();
    flipped[4].vertices.swap(1, 2);
    let words = [
        "1 facet is flipped, the first at x = 66.6667, y = 0, z = 13.3333 mm of the file",
        "turn all normals",
    ];
    refused(&binary(&flipped), &words);
    let crossing = [whole.clone(), copy([50.0, 30.0, 20.0], &whole)].concat();
    refused(&binary(&crossing), &["edges pierce other facets, the first at x = ", "unite the parts"]);
    let flat = Triangle {
        normal: Normal::new([0.0, 0.0, 1.0]),
        vertices: [[0.0, 0.0, 0.0], [50.0, 30.0, 20.0], [100.0, 60.0, 40.0]].map(Vertex::new),
    };
    let words = ["1 facet has no area, the first at x = 50, y = 30, z = 20 mm of the file", "merge corners"];
    refused(&binary(&[whole.clone(), vec![flat]].concat()), &words);
    refused(
        b"Dear all,\nthe form is not ready yet.\n",
        &["not an STL file", "does not begin with \"solid\"", "export"],
    );

    let touching = [whole.clone(), copy([100.0, 0.0, 0.0], &whole)].concat();
    refused(&binary(&touching), &["5 edges join more than two facets", "keep them apart"]);
    let mut small = copy([0.0; 3], &whole);
    small.iter_mut().for_each(|f| f.vertices = f.vertices.map(|v| Vertex::new(v.0.map(|x| 20.0 + 0.1 * x))));
    refused(&binary(&[whole.clone(), small].concat()), &["1 shell is turned inside out", "leave it out"]);
    refused(&binary(&[]), &["there are no facets"]);
    refused(b"", &["not an STL file", "0 bytes"]);
    refused(b"solid form\nendsolid form\n", &["there are no facets"]);
    refused(&FORM[..FORM.len() / 2], &["not an STL file"]);
    refused(&binary(&whole)[..300], &["not an STL file", "12 binary facets"]);
    let mut no_number = binary(&whole);
    no_number[100..104].fill(0xff);
    refused(&no_number, &["corner is not a number"]);
}

#[test]
fn what_a_case_says_wrong_about_a_file_is_told() {
    for (solid, says) in [
        ("stl = { file = \"form.stl\" }", "`solid.stl.unit` is missing"),
        ("stl = { file = \"from.stl\", unit = \"mm\" }", "`solid.stl.file` cannot be read"),
        ("stl = { file = \"../form.stl\", unit = \"mm\" }", "leads out of the case's folder"),
        ("stl = { file = \"/form.stl\", unit = \"mm\" }", "leads out of the case's folder"),
        ("stl = { file = \"form.obj\", unit = \"mm\" }", "write a name that ends in \".stl\""),
        ("stl = { file = \"form.stl\", unit = \"km\" }", "`solid.stl.unit` cannot be \"km\""),
        ("stl = { file = \"form.stl\", unit = \"mm\", scale = 0 }", "must be positive and at most 1000000"),
        ("stl = { file = \"form.stl\", unit = \"mm\", rotate = [0, 0, 90] }", "write degrees as \"90 deg\""),
        ("stl = { file = \"form.stl\", unit = \"mm\", scale = 0.1 }", "thinner than one"),
        (
            "stl = { file = \"form.stl\", unit = \"mm\", scale = 1e300 }",
            "must be positive and at most 1000000",
        ),
        (
            "stl = { file = \"form.stl\", unit = \"mm\", move = [\"1 m\", \"0 m\", \"0 m\"] }",
            "this solid lies outside the domain",
        ),
        (
            "stl = { file = \"form.stl\", unit = \"mm\", role = \"formwork\", move = [\"1 m\", \"0 m\", \"0 m\"] }",
            "the inside of this formwork lies outside the domain",
        ),
    ] {
        let message = read(FORM, solid).unwrap_err();
        assert!(message.contains(says) && message.contains("case.toml:2"), "{solid}: {message}");
    }
    // The box is 4 mm thick, the cells are 5 mm: the four facets of the large faces are told.
    let message = read(FORM, "stl = { file = \"form.stl\", unit = \"mm\", scale = 0.1 }").unwrap_err();
    assert!(message.contains("at 4 of 12 facets, the first at 0.0"), "{message}");
}

proptest! {
    #[test]
    fn any_bytes_are_read_or_refused(bytes in prop::collection::vec(any::<u8>(), 0..400)) {
        let _ = read(&bytes, PLAIN);
        let _ = read(&[b"solid form\n", &bytes[..]].concat(), PLAIN);
    }

    #[test]
    fn any_facets_are_read_or_refused(
        corners in prop::collection::vec(prop::array::uniform9(prop_oneof![any::<f32>(), (-2i8..3).prop_map(f32::from)]), 0..12),
    ) {
        let facets: Vec<Triangle> = corners.iter().map(|c| Triangle {
            normal: Normal::default(),
            vertices: [0, 3, 6].map(|n| Vertex::new([c[n], c[n + 1], c[n + 2]])),
        }).collect();
        let _ = read(&binary(&facets), PLAIN);
    }

    #[test]
    fn any_damage_to_a_right_file_is_read_or_refused(place in 0usize..684, byte: u8, ascii: bool) {
        let mut bytes = if ascii { FORM.to_vec() } else { binary(&facets()) };
        let place = place % bytes.len();
        bytes[place] = byte;
        if let Ok(case) = read(&bytes, PLAIN) {
            case.solids[0].body.signed_distance(DVec3::splat(0.01));
        }
    }
}
