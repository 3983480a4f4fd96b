//! Bodies in the fluid: what they are, where they are; and every way in which they are refused.

// Helpers of tests are tests too.
#![allow(clippy::unwrap_used)]

use std::fs;

use tremie_case::{Bodies, Case};
use tremie_numerics::DVec3;
use tremie_suspension::{Amount, Coupling, Direction, Form};

use super::SLUMP_FLOW;

/// The slump flow with this before its `[lbm]` in line 27.
fn with(text: &str) -> Result<Case, String> {
    let text = SLUMP_FLOW.replace("[lbm]", &format!("{text}\n\n[lbm]"));
    Case::parse("case.toml", &text).map_err(|error| error.to_string())
}

const STONES: &str =
    "[[inclusions]]\nname = \"stones\"\ndensity = \"2600 kg/m3\"\nsphere = { diameter = \"20 mm\" }";

#[test]
fn bodies_are_placed_in_the_fluid() {
    let case = with(&format!(
        "{STONES}\nvolume_fraction = 0.1\n[[inclusions]]\nname = \"fibres\"\nfibre = {{ length = \"3 cm\", diameter = \"0.4 mm\" }}\n\
         density = \"7850 kg/m3\"\nnumber = 12\nseed = 7\ndirection = {{ along = [0, 0, 2] }}\n\
         [suspension]\ncoupling = \"svec\"\nfriction = 0.3"
    ))
    .unwrap();
    let [stones, fibres] = case.groups.as_slice() else { panic!("{:?}", case.groups) };
    let [Bodies::Random(stones), Bodies::Random(fibres)] = [&stones.bodies, &fibres.bodies] else { panic!() };
    assert_eq!(stones.amount, Amount::Share(0.1));
    assert_eq!((fibres.amount, fibres.direction), (Amount::Number(12), Direction::Aligned(DVec3::Z)));
    assert_eq!((case.following.method.coupling, case.following.contact.friction), (Coupling::Svec, 0.3));
    let bodies = &case.inclusions;
    let of = |kind: u16| bodies.kind.iter().filter(|k| **k == kind).count();
    // In the part of the cone that lies in the domain.
    let share = of(0) as f64 * Form::Sphere { diameter: 0.02 }.volume();
    assert!(of(1) == 12 && share > 0.0, "{share}");
    for n in 0..bodies.len() {
        let p = bodies.position[n];
        let inside = case.fluid.iter().any(|region| region.shape.signed_distance(p) < 0.0);
        assert!(inside && p.cmpge(case.domain.min).all(), "{p}");
    }
}

#[test]
fn wrong_bodies_are_told_at_their_place() {
    for (text, line, says) in [
        (STONES.to_owned(), 27, "does not say how many there are"),
        (format!("{STONES}\nnumber = 3\nvolume_fraction = 0.1"), 32, "keep only one of them"),
        (format!("{STONES}\nnumber = 3.5"), 31, "must be a whole number"),
        (format!("{STONES}\nnumber = 100000"), 27, "the bodies do not fit: only "),
        (format!("{STONES}\nnumber = 3\ndirection = {{ along = [0, 0, 0] }}"), 32, "names no direction"),
        (STONES.replace("20 mm", "2 mm") + "\nnumber = 3", 30, "too large to see bodies of 0.002 m"),
        (format!("{STONES}\nnumber = 3\n[suspension]\nrestitution = 2"), 33, "must not be above 1"),
    ] {
        let error = with(&text).unwrap_err();
        assert!(error.contains(says), "{error}\ninstead of {says}");
        assert!(error.contains(&format!("case.toml:{line}:")), "{error}\nnot in line {line}");
    }
}

/// An inlet above the slump flow, cut by a plane of symmetry, with fibres.
const POURED: &str = "[[inlet]]\n\
    disc = { centre = [\"200 mm\", \"0 mm\", \"310 mm\"], direction = [0, 0, -1], diameter = \"80 mm\" }\n\
    flow_rate = \"1 l/s\"\nbatch = \"second\"\n[[inlet.inclusions]]\nname = \"fibres\"\n\
    fibre = { length = \"60 mm\", diameter = \"0.75 mm\" }\ndensity = \"7850 kg/m3\"\nvolume_fraction = 0.005";

#[test]
fn bodies_come_in_with_the_fluid_of_an_inlet() {
    let stones = "[[inlet.inclusions]]\nname = \"stones\"\nsphere = { diameter = \"16 mm\" }\ndensity = \"2600 kg/m3\"\n\
        volume_fraction = 0.3\nseed = 7\ndirection = { along = [0, 0, 2] }";
    let case = with(&format!("{POURED}\n{stones}")).unwrap();
    let [fibres, stones] = case.inlets[0].inclusions.as_slice() else { panic!("{:?}", case.inlets) };
    assert_eq!((fibres.name.as_str(), fibres.share, fibres.seed), ("fibres", 0.005, 1));
    assert_eq!((stones.density, stones.seed, stones.direction), (2600.0, 7, Direction::Aligned(DVec3::Z)));
    // Half a per cent of a litre, in fibres of pi/4 (0.75 mm)^2 60 mm.
    assert_eq!((fibres.due(1e-3), fibres.due(0.0)), (188, 0));
    assert!(case.has_bodies() && case.inclusions.is_empty() && case.groups.is_empty());
    assert_eq!(case.incoming().map(|(inlet, of)| (inlet, of.seed)).collect::<Vec<_>>(), [(0, 1), (0, 7)]);
    assert_eq!(case.fibre_region(), Some(0.06));
    assert!(!with("").unwrap().has_bodies());
}

#[test]
fn wrong_bodies_of_inlets_are_told_at_their_place() {
    let fibre = "fibre = { length = \"60 mm\", diameter = \"0.75 mm\" }";
    let sphere = |diameter: &str| POURED.replace(fibre, &format!("sphere = {{ diameter = \"{diameter}\" }}"));
    let too_large = "too large to come in through the face of the inlet";
    // Of the disc half lies in the domain, 40 mm deep.
    with(&sphere("30 mm")).unwrap();
    // Along the plane there is room for 80 mm, and down for any length.
    let along = |x: f64, z: f64| {
        POURED.replace("60 mm", "100 mm") + &format!("\ndirection = {{ along = [{x}, 0, {z}] }}")
    };
    with(&along(0.0, 1.0)).unwrap();
    for (text, line, says) in [
        (POURED.replace("0.005", "0"), 35, "must be positive"),
        (POURED.replace("0.005", "0.7"), 35, "0.6"),
        (POURED.replace("volume_fraction = 0.005", ""), 31, "`inlet.inclusions.volume_fraction` is missing"),
        (POURED.replace("0.005", "0.005\nnumber = 3"), 36, "there is no key `number`"),
        (POURED.replace(fibre, "csv = { file = \"fibres.csv\" }"), 33, "there is no key `csv`"),
        (POURED.to_owned() + "\nseed = 1.5", 36, "must be a whole number"),
        (POURED.replace("60 mm", "6 mm"), 33, "too large to see bodies of 0.006 m"),
        (sphere("45 mm"), 33, too_large),
        (along(1.0, 0.0), 33, too_large),
    ] {
        let error = with(&text).unwrap_err();
        assert!(error.contains(says), "{error}\ninstead of {says}");
        assert!(error.contains(&format!("case.toml:{line}:")), "{error}\nnot in line {line}");
    }
}

/// The slump flow with these bodies from a file.
fn from_file(group: &str, csv: &str) -> Result<Case, String> {
    let place = tempfile::tempdir().unwrap();
    fs::write(place.path().join("bodies.csv"), csv).unwrap();
    let text = SLUMP_FLOW.replace("[lbm]", &format!("{group}\n\n[lbm]"));
    let name = place.path().join("case.toml");
    Case::parse(&name.display().to_string(), &text).map_err(|error| error.to_string())
}

const LISTED: &str =
    "[[inclusions]]\nname = \"steel\"\ndensity = \"7850 kg/m3\"\ncsv = { file = \"bodies.csv\" }";
const FILE: &str = "x1_m,y1_m,z1_m,x2_m,y2_m,z2_m,d_m,type\n0.01,0,0.1,0.07,0,0.1,0.001,steel\n\
    0.02,0.02,0.1,0.02,0.02,0.1,0.02,grains\n0.01,0,0.02,0.01,0,0.08,0.001,steel\n";

#[test]
fn bodies_are_read_from_a_file() {
    let grains = LISTED.replace("steel", "grains").replace("7850", "2600");
    let case = from_file(&format!("{LISTED}\n{grains}"), FILE).unwrap();
    let bodies = &case.inclusions;
    assert_eq!((bodies.len(), bodies.kinds.len(), case.files[0].path.as_str()), (3, 2, "bodies.csv"));
    let [a, b] = bodies.ends(0).unwrap();
    assert!(
        (a - DVec3::new(0.01, 0.0, 0.1)).length() < 1e-15
            && (b - DVec3::new(0.07, 0.0, 0.1)).length() < 1e-15
    );
    assert_eq!(bodies.kinds[1].name, "grains");
    assert_eq!(
        (*bodies.form(2), bodies.position[2]),
        (Form::Sphere { diameter: 0.02 }, DVec3::new(0.02, 0.02, 0.1))
    );
    assert!((case.fibre_region().unwrap() - 0.06).abs() < 1e-12);
}

#[test]
fn wrong_files_of_bodies_are_told_with_their_line() {
    for (group, csv, line, says) in [
        (format!("{LISTED}\nnumber = 3"), FILE.to_owned(), 31, "says again what the file says"),
        (LISTED.to_owned(), FILE.replace("0.07,", "7 cm,"), 30, "bodies.csv, line 2: x2_m is \"7 cm\""),
        (
            LISTED.to_owned(),
            FILE.replace("0.08", "4"),
            30,
            "no fluid where a body should be: bodies.csv, line 4",
        ),
        (LISTED.to_owned(), FILE.replace("0.07", "0.02"), 30, "too large to see bodies of 0.01 m"),
        (LISTED.replace("steel", "iron"), FILE.to_owned(), 30, "none is of the type \"iron\""),
        (LISTED.replace("bodies.csv", "none.csv"), FILE.to_owned(), 30, "cannot be read"),
    ] {
        let error = from_file(&group, &csv).unwrap_err();
        assert!(error.contains(says), "{error}\ninstead of {says}");
        assert!(error.contains(&format!("case.toml:{line}:")), "{error}\nnot in line {line}");
    }
}

#[test]
fn wrong_sections_are_told_at_their_place() {
    let fibres = STONES
        .replace("sphere = { diameter = \"20 mm\" }", "fibre = { length = \"60 mm\", diameter = \"1 mm\" }");
    let section = "[[suspension.section]]\nname = \"middle\"\naxis = \"z\"\nat = \"0.1 m\"";
    assert_eq!(with(&format!("{fibres}\nnumber = 3\n{section}")).unwrap().following.sections[0].axis, 2);
    for (text, line, says) in [
        (format!("{STONES}\nnumber = 3\n{section}"), 33, "no fibres to count"),
        (format!("{fibres}\nnumber = 3\n{section}\n{section}"), 37, "two sections are called `middle`"),
        (format!("{fibres}\nnumber = 3\n{}", section.replace("0.1 m", "9 m")), 35, "outside the domain"),
        (
            format!("{fibres}\nnumber = 3\n{section}\nmax = [\"-9 m\", \"1 m\", \"1 m\"]"),
            36,
            "nothing of this section lies in the domain",
        ),
        (format!("{fibres}\nnumber = 3\n[suspension]\nregion = \"1 mm\""), 33, "smaller than a cell"),
    ] {
        let error = with(&text).unwrap_err();
        assert!(error.contains(says), "{error}\ninstead of {says}");
        assert!(error.contains(&format!("case.toml:{line}:")), "{error}\nnot in line {line}");
    }
}
