//! Bars: one by one, on a grid, from a CSV file; and every way in which they are refused.

// Helpers of tests are tests too.
#![allow(clippy::unwrap_used)]

use std::fs;
use std::path::Path;

use tempfile::TempDir;
use tremie_case::{Case, Surface};
use tremie_geometry::Body;
use tremie_numerics::DVec3;

use super::SLUMP_FLOW;

/// The slump flow with these bars, before its `[lbm]` in line 27, in a folder.
fn parse(folder: &Path, bars: &str) -> Result<Case, String> {
    let name = folder.join("case.toml");
    let text = SLUMP_FLOW.replace("[lbm]", &format!("[[bars]]\n{bars}\n\n[lbm]"));
    Case::parse(name.to_str().unwrap(), &text).map_err(|error| error.to_string())
}

fn with(bars: &str) -> Result<Case, String> {
    parse(Path::new(""), bars)
}

/// The same with a file `cage.csv`.
fn from_file(text: &str) -> Result<Case, String> {
    let place = TempDir::new().unwrap();
    fs::write(place.path().join("cage.csv"), text).unwrap();
    parse(place.path(), "csv = { file = \"cage.csv\", unit = \"mm\" }")
}

const HEADER: &str = "x1,y1,z1,x2,y2,z2,diameter";

#[test]
fn a_list_a_grid_and_a_file_of_the_same_bars_are_the_same_body() {
    let bar = |x: u32, y: u32| {
        format!(
            "{{ start = [\"{x} mm\", \"{y} mm\", \"0 mm\"], end = [\"{x} mm\", \"{y} mm\", \"100 mm\"], diameter = \"12 mm\" }}"
        )
    };
    let places = [(200, 100), (250, 100), (200, 180), (250, 180)];
    let listed = places.map(|(x, y)| bar(x, y)).join(", ");
    let list = with(&format!("list.of = [{listed}]")).unwrap();
    let grid = "grid = { start = [\"20 cm\", \"10 cm\", \"0 cm\"], end = [\"20 cm\", \"10 cm\", \"10 cm\"], diameter = \"1.2 cm\", \
                spacing = [\"5 cm\", \"8 cm\", \"0 cm\"], count = [2, 2, 1] }";
    assert_eq!(with(grid).unwrap().solids, list.solids);
    let lines = places.map(|(x, y)| format!("{x},{y},0,{x},{y},100,12\n")).concat();
    let file = from_file(&format!("\u{feff}# A cage.\r\n{HEADER}\r\n\n{lines}")).unwrap();
    assert_eq!(file.solids, list.solids);
    assert_eq!(file.files[0].path, "cage.csv");

    let [bars] = list.solids.as_slice() else { panic!("{:?}", list.solids) };
    assert_eq!((bars.name.as_str(), bars.surface), ("bars1", Surface::NoSlip));
    assert!(matches!(&bars.body, Body::Union(union) if union.bodies().len() == 4));
    let (distance, normal) = bars.body.nearest(DVec3::new(0.24, 0.18, 0.05));
    assert!((distance - 0.004).abs() < 1e-12 && (normal + DVec3::X).length() < 1e-12);
    // They have flat ends.
    assert!((bars.body.signed_distance(DVec3::new(0.2, 0.1, 0.11)) - 0.01).abs() < 1e-12);
}

#[test]
fn bars_come_after_solids_and_have_names() {
    let bars = "name = \"cage\"\nlist.of = [{ start = [\"0.2 m\", \"0 m\", \"0 m\"], end = [\"0.2 m\", \"0 m\", \"0.1 m\"], diameter = \"10 mm\" }]\n\
                [[solid]]\nsphere = { centre = [\"0.3 m\", \"0.3 m\", \"0 m\"], diameter = \"50 mm\" }\n\
                [[bars]]\nlist.of = [{ start = [\"0 m\", \"0.2 m\", \"0 m\"], end = [\"0 m\", \"0.2 m\", \"0.1 m\"], diameter = \"10 mm\" }]";
    let case = with(bars).unwrap();
    let names: Vec<&str> = case.solids.iter().map(|solid| solid.name.as_str()).collect();
    assert_eq!(names, ["solid1", "cage", "bars2"]);
}

#[test]
fn wrong_bars_are_told_at_their_place() {
    const ENDS: &str = "start = [\"0.2 m\", \"0.2 m\", \"0 m\"], end = [\"0.2 m\", \"0.2 m\", \"0.1 m\"]";
    for (bars, line, column, says) in [
        ("name = \"cage\"".to_owned(), 1, 1, "`bars` has no bars"),
        (format!("list.of = [{{ {ENDS}, diameter = \"2 mm\" }}]"), 2, 0, "number 1 is 0.002 m thick"),
        (
            format!("list.of = [{{ {ENDS}, diameter = \"9 mm\" }}, {{ {ENDS}, diameter = \"4 mm\" }}]"),
            2,
            0,
            "too large to see 1 of 2 bars: number 2",
        ),
        (
            format!("grid = {{ {ENDS}, diameter = \"12 mm\", spacing = [\"1 cm\", \"1 cm\", \"1 cm\"], count = [1, 1.5, 1] }}"),
            2,
            0,
            "must be whole numbers",
        ),
        (
            format!("grid = {{ {ENDS}, diameter = \"12 mm\", spacing = [\"1 cm\", \"1 cm\", \"1 cm\"], count = [1000, 1000, 1] }}"),
            2,
            0,
            "no more than 100000 bars",
        ),
        (
            format!("grid = {{ {ENDS}, diameter = \"12 mm\", spacing = [\"1 cm\", \"1 cm\", \"1 cm\"], count = [1, 0, 1] }}"),
            2,
            0,
            "must be positive",
        ),
        (
            "list.of = [{ start = [\"2 m\", \"2 m\", \"0 m\"], end = [\"2 m\", \"3 m\", \"0 m\"], diameter = \"12 mm\" }]".to_owned(),
            1,
            1,
            "this solid lies outside the domain",
        ),
        ("csv = { file = \"none.csv\", unit = \"mm\" }".to_owned(), 2, 16, "cannot be read"),
        ("csv = { file = \"../cage.csv\", unit = \"mm\" }".to_owned(), 2, 16, "leads out of the case's folder"),
        ("csv = { file = \"cage.xls\", unit = \"mm\" }".to_owned(), 2, 16, "is not the name of a CSV file"),
        ("csv = { file = \"cage.csv\" }".to_owned(), 2, 7, "`bars.csv.unit` is missing"),
    ] {
        let message = with(&bars).unwrap_err();
        let place = format!("case.toml:{}:{}", line + 26, if column > 0 { column.to_string() } else { String::new() });
        assert!(message.contains(&place) && message.contains(says), "expected {place} {says}\nbut got\n{message}");
    }
}

#[test]
fn wrong_files_are_told_with_their_line() {
    for (text, says) in [
        (String::new(), "cage.csv: it is empty"),
        ("# nothing\n".to_owned(), "cage.csv: it is empty"),
        (format!("{HEADER}\n"), "cage.csv: it has no bar"),
        ("x,y,z\n1,2,3\n".to_owned(), "cage.csv, line 1: the columns are not those of bars"),
        (HEADER.replace(',', ";"), "with commas"),
        (format!("# cage\n{HEADER}\n0,0,0,0,0,100,12\n\n0,0,0,100,12\n"), "line 5: it has 5 values, not 7"),
        (format!("{HEADER}\n0,0,0,0,0,100,12 mm\n"), "line 2: diameter is \"12 mm\", not a number"),
        (format!("{HEADER}\n0,0,0,0,inf,100,12\n"), "line 2: y2 is \"inf\", not a number"),
        (format!("{HEADER}\n0,0,0,0,0,100,0\n"), "line 2: the diameter is not positive"),
        (format!("{HEADER}\n0,0,0,0,0,100,12\n0,0,5,0,0,5,12\n"), "line 3: both ends are the same point"),
        (format!("{HEADER}\n0,0,0,0,0,100,2\n"), "number 1 is 0.002 m thick"),
    ] {
        let message = from_file(&text).unwrap_err();
        assert!(
            message.contains("case.toml:28:16") && message.contains(says),
            "expected {says}\nbut got\n{message}"
        );
    }
    let place = TempDir::new().unwrap();
    fs::write(place.path().join("cage.csv"), [0xff, 0xfe, 0x00]).unwrap();
    let message = parse(place.path(), "csv = { file = \"cage.csv\", unit = \"mm\" }").unwrap_err();
    assert!(message.contains("is no text"), "{message}");
}
