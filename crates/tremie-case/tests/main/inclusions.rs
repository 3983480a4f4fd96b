//! Bodies in the fluid: what they are, where they are; and every way in which they are refused.

// Helpers of tests are tests too.
#![allow(clippy::unwrap_used)]

use tremie_case::Case;
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
