//! Cages: where they are, which bars they have; and every way in which they are refused.

// Helpers of tests are tests too.
#![allow(clippy::unwrap_used)]

use tremie_case::{Case, Course};
use tremie_geometry::{Body, Shape};
use tremie_numerics::DVec3;

use super::SLUMP_FLOW;

/// The slump flow with this before its `[lbm]` in line 27.
fn with(text: &str) -> Result<Case, String> {
    let text = SLUMP_FLOW.replace("[lbm]", &format!("{text}\n\n[lbm]"));
    Case::parse("case.toml", &text).map_err(|error| error.to_string())
}

const REGION: &str = "cone_shell = { base = [\"0.2 m\", \"0.2 m\", \"0 m\"], base_diameter = \"100 mm\", top_diameter = \"100 mm\", \
                      height = \"0.1 m\", thickness = \"4 mm\" }";

#[test]
fn a_cage_has_layers_of_straight_bars_and_hoops() {
    let case = with(&format!(
        "[[cage]]\n{REGION}\nlayers = [{{ direction = [0, 0, -2], diameter = \"28 mm\", spacing = \"15 cm\" }}, \
         {{ around = {{ point = [\"0.2 m\", \"0.2 m\", \"0 m\"], axis = [0, 0, 1] }}, diameter = \"1.2 cm\", spacing = \"20 cm\" }}]"
    ));
    let case = case.unwrap();
    let [cage] = case.cages.as_slice() else { panic!("{:?}", case.cages) };
    assert_eq!(cage.name, "cage1");
    assert!(matches!(cage.body, Body::Shape(Shape::ConeShell { .. })));
    let [upright, hoops] = cage.layers.as_slice() else { panic!("{cage:?}") };
    assert_eq!(upright.course, Course::Straight(-DVec3::Z));
    assert_eq!((upright.grid.diameter, upright.grid.spacing), (0.028, 0.15));
    let along = hoops.course.at(DVec3::new(0.2, 0.25, 0.07)).unwrap();
    assert!((along + DVec3::X).length() < 1e-12, "{along}");
    assert_eq!(hoops.course.at(DVec3::new(0.2, 0.2, 0.3)), None);
}

#[test]
fn wrong_cages_are_told_at_their_place() {
    const BARS: &str = "diameter = \"12 mm\", spacing = \"100 mm\"";
    for (cage, line, says) in [
        (REGION.to_owned(), 27, "`cage.layers` is missing"),
        (format!("layers = [{{ direction = [0, 0, 1], {BARS} }}]"), 27, "has no shape"),
        (format!("{REGION}\nlayers = [{{ {BARS} }}]"), 29, "does not say which way the bars go"),
        (format!("{REGION}\nlayers = [{{ direction = [0, 0, 0], {BARS} }}]"), 29, "this is no direction"),
        (
            format!(
                "{REGION}\nlayers = [{{ direction = [0, 0, 1], diameter = \"12 mm\", spacing = \"20 mm\" }}]"
            ),
            29,
            "write \"0.024 m\" at least",
        ),
        (
            format!(
                "{REGION}\nlayers = [{{ direction = [0, 0, 1], around = {{ point = [\"0 m\", \"0 m\", \"0 m\"], axis = [0, 0, 1] }}, {BARS} }}]"
            ),
            29,
            "keep only one of them",
        ),
        (
            format!(
                "box = {{ min = [\"2 m\", \"0 m\", \"0 m\"], max = [\"3 m\", \"1 m\", \"1 m\"] }}\nlayers = [{{ direction = [0, 0, 1], {BARS} }}]"
            ),
            27,
            "this cage lies outside the domain",
        ),
    ] {
        let message = with(&format!("[[cage]]\n{cage}")).unwrap_err();
        assert!(message.contains(says) && message.contains(&format!("case.toml:{line}:")), "{message}");
    }
    let one = format!("[[cage]]\nname = \"gate\"\n{REGION}\nlayers = [{{ direction = [0, 0, 1], {BARS} }}]");
    let message = with(&format!("{one}\n{one}")).unwrap_err();
    assert!(message.contains("called `gate`"), "{message}");
}

#[test]
fn bars_too_thin_for_the_cells_are_better_a_cage() {
    let bars = "[[bars]]\nlist.of = [{ start = [\"0.2 m\", \"0.2 m\", \"0 m\"], end = [\"0.2 m\", \"0.2 m\", \"0.1 m\"], diameter = \"2 mm\" }]";
    let message = with(bars).unwrap_err();
    assert!(message.contains("[[cage]] in place of the bars"), "{message}");
}
