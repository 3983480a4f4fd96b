//! The file of cuts: beams and planes that are cut out of a finished cast, to see which fibres they hold.

use std::path::Path;

use tremie_numerics::DVec3;

use crate::document::{
    Bound, Choice, Document, Kind, List, Maybe, Name, Need, Section, Value, Vector, maybe, need,
};
use crate::fault::{CaseError, Fault, InvalidCase};
use crate::schema::{LENGTH, quantity};
use crate::units::Dimension;

/// What is to be cut out of a cast.
#[derive(Debug, Clone, PartialEq)]
pub struct Cuts {
    /// Beams; no two have names that differ in capitals only.
    pub beams: Vec<Beam>,
    /// Pieces of planes; no two have the same name.
    pub planes: Vec<Plane>,
    name: String,
    text: String,
}

/// A beam along the axes of space.
#[derive(Debug, Clone, PartialEq)]
pub struct Beam {
    /// What it is called.
    pub name: String,
    /// Lower corner in m.
    pub min: DVec3,
    /// Upper corner in m.
    pub max: DVec3,
    /// Its axis: 0, 1, 2 for x, y, z.
    pub along: usize,
}

/// A rectangular piece of a plane.
#[derive(Debug, Clone, PartialEq)]
pub struct Plane {
    /// What it is called.
    pub name: String,
    /// Its centre in m.
    pub point: DVec3,
    /// Unit normal.
    pub normal: DVec3,
    /// Its edges in m. The second is horizontal, or along y if all of the plane is; the first is square to it.
    pub size: [f64; 2],
}

/// Names of files that are written beside those called after beams.
const TAKEN: [&str; 2] = ["beams", "planes"];

const FILE: Section<(Vec<Beam>, Vec<Plane>)> = {
    const BEAMS: Maybe<List<Section<Beam>>> = maybe("beam", "boxes along the axes", List(BEAM));
    const PLANES: Maybe<List<Section<Plane>>> = maybe("plane", "pieces of planes", List(PLANE));
    Section {
        keys: &[&BEAMS, &PLANES],
        example: &[],
        read: |t| {
            let beams = t.maybe(&BEAMS)?.unwrap_or_default();
            let planes = t.maybe(&PLANES)?.unwrap_or_default();
            if beams.is_empty() && planes.is_empty() {
                let help = List(BEAM).example("beam", "beam");
                let problem = "`beam` or `plane` is missing";
                return Err(Fault::new(t.itself().span(), problem, "").help(help));
            }
            distinct(t.value("beam"), beams.iter().map(|beam| beam.name.as_str()), "beams")?;
            distinct(t.value("plane"), planes.iter().map(|plane| plane.name.as_str()), "planes")?;
            Ok((beams, planes))
        },
    }
};

/// No two of a list have names that differ in capitals only: there are file systems that do not tell them apart.
fn distinct<'a>(
    list: Option<Value<'_>>,
    names: impl Iterator<Item = &'a str>,
    what: &str,
) -> Result<(), Fault> {
    let names: Vec<String> = names.map(str::to_lowercase).collect();
    let twice = (0..names.len()).find_map(|n| Some((names[..n].iter().position(|m| *m == names[n])?, n)));
    match (twice, list) {
        (Some((first, second)), Some(list)) => {
            let spans = [first, second].map(|n| list.component(n).span());
            let problem = format!("two {what} are called `{}`", names[second]);
            let [first, second] = spans;
            Err(Fault::new(second, problem, "write another name").related(Some(first), "the first"))
        }
        _ => Ok(()),
    }
}

const BEAM: Section<Beam> = {
    const CALLED: Need<Name> = need("name", "what it is called in results", Name { example: "B1" });
    const CORNER: Vector<3> = Vector(quantity(Dimension::LENGTH, Bound::Any, "150 mm"));
    const LOW: Need<Vector<3>> = need("min", "corner with the smallest coordinates", CORNER);
    const HIGH: Need<Vector<3>> = need("max", "corner with the largest coordinates", CORNER);
    const ALONG: Maybe<Choice<usize>> = maybe(
        "along",
        "its axis; the longest edge if absent, the first of those that are equally long",
        Choice(&[("x", "along x", 0), ("y", "along y", 1), ("z", "along z", 2)]),
    );
    Section {
        keys: &[&CALLED, &LOW, &HIGH, &ALONG],
        example: &[
            "name = \"B1\"",
            "min = [\"250 mm\", \"100 mm\", \"0 mm\"]",
            "max = [\"850 mm\", \"250 mm\", \"150 mm\"]",
        ],
        read: |t| {
            let name = t.need(&CALLED)?;
            if TAKEN.contains(&name.to_lowercase().as_str()) {
                let value = t.value("name").unwrap_or_else(|| t.itself());
                let problem = format!("cannot be \"{name}\": {name}.csv is the table of all of them");
                return Err(value.fault(problem, "write another name"));
            }
            let [min, max] = [t.need(&LOW)?, t.need(&HIGH)?].map(DVec3::from);
            let size = max - min;
            if let Some(axis) = (0..3).find(|axis| size[*axis] <= 0.0) {
                let value = t.value("max").unwrap_or_else(|| t.itself());
                let problem = format!("is not above `min` along {}", ["x", "y", "z"][axis]);
                return Err(value.component(axis).fault(problem, "write a larger one"));
            }
            let longest = || (1..3).fold(0, |most, axis| if size[axis] > size[most] { axis } else { most });
            let along = t.maybe(&ALONG)?.map_or_else(longest, |(.., axis)| *axis);
            Ok(Beam { name, min, max, along })
        },
    }
};

const PLANE: Section<Plane> = {
    const CALLED: Need<Name> = need("name", "what it is called in results", Name { example: "middle" });
    const POINT: Need<Vector<3>> =
        need("point", "its centre", Vector(quantity(Dimension::LENGTH, Bound::Any, "75 mm")));
    const NORMAL: Need<Vector<3>> =
        need("normal", "direction across it", Vector(quantity(Dimension::NUMBER, Bound::Any, "1")));
    const SIZE: Need<Vector<2>> =
        need("size", "its edges; the second is horizontal, or along y if all of it is", Vector(LENGTH));
    Section {
        keys: &[&CALLED, &POINT, &NORMAL, &SIZE],
        example: &[
            "name = \"middle\"",
            "point = [\"600 mm\", \"600 mm\", \"75 mm\"]",
            "normal = [1, 0, 0]",
            "size = [\"150 mm\", \"150 mm\"]",
        ],
        read: |t| {
            let normal = DVec3::from(t.need(&NORMAL)?);
            let Some(normal) = normal.try_normalize() else {
                let value = t.value("normal").unwrap_or_else(|| t.itself());
                return Err(value.fault("has no direction", "write for example [1, 0, 0]"));
            };
            Ok(Plane { name: t.need(&CALLED)?, point: t.need(&POINT)?.into(), normal, size: t.need(&SIZE)? })
        },
    }
};

impl Cuts {
    /// Reads a file of cuts from `text`; `name` is how messages call it.
    ///
    /// # Errors
    /// What is wrong with it, with the line.
    pub fn parse(name: &str, text: &str) -> Result<Self, CaseError> {
        let read = Document::parse(text, Path::new("")).and_then(|document| FILE.read(&document.root()));
        let (beams, planes) = read.map_err(|fault| InvalidCase::new(name, text, fault))?;
        Ok(Self { beams, planes, name: name.to_owned(), text: text.to_owned() })
    }

    /// Reads a file of cuts.
    ///
    /// # Errors
    /// If it cannot be read, or what is wrong with it, with the line.
    pub fn read(path: &Path) -> Result<Self, CaseError> {
        let text = std::fs::read_to_string(path)
            .map_err(|source| CaseError::ReadCuts { path: path.to_owned(), source })?;
        Self::parse(&path.display().to_string(), &text)
    }

    /// The file as read.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// What somebody further up finds wrong, told at a key such as `beam.0.min`.
    pub fn refuse(&self, key: &str, problem: impl Into<String>, advice: impl Into<String>) -> CaseError {
        let document = Document::parse(&self.text, Path::new(""));
        let span = document.map_or(0..0, |document| document.locate(key));
        InvalidCase::new(&self.name, &self.text, Fault::new(span, problem, advice)).into()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "[[beam]]\nname = \"B1\"\nmin = [\"250 mm\", \"100 mm\", \"0 mm\"]\n\
        max = [\"850 mm\", \"25 cm\", \"0.15 m\"]\n\n[[beam]]\nname = \"core\"\nmin = [\"0 m\", \"0 m\", \"0 m\"]\n\
        max = [\"0.1 m\", \"0.1 m\", \"0.1 m\"]\nalong = \"z\"\n\n[[plane]]\nname = \"middle\"\n\
        point = [\"600 mm\", \"600 mm\", \"75 mm\"]\nnormal = [3, 0, 4]\nsize = [\"150 mm\", \"300 mm\"]\n";

    #[test]
    fn beams_and_planes_are_read_in_metres() {
        let cuts = Cuts::parse("cuts.toml", TEXT).unwrap();
        let [beam, core] = &cuts.beams[..] else { panic!("{cuts:?}") };
        assert_eq!((beam.name.as_str(), beam.min, beam.along), ("B1", DVec3::new(0.25, 0.1, 0.0), 0));
        assert!((beam.max - DVec3::new(0.85, 0.25, 0.15)).length() < 1e-12);
        assert_eq!(core.along, 2);
        let plane = &cuts.planes[0];
        assert!((plane.normal - DVec3::new(0.6, 0.0, 0.8)).length() < 1e-12);
        assert!((plane.size[1] - 0.3).abs() < 1e-12);
        // Of edges that are equally long the first is the axis.
        let cube = Cuts::parse("cuts.toml", &TEXT.replace("along = \"z\"\n", "")).unwrap();
        assert_eq!(cube.beams[1].along, 0);
    }

    #[test]
    fn mistakes_are_told_with_their_line() {
        for (old, new, line, says) in [
            ("name = \"B1\"\n", "", 1, "`beam.name` is missing"),
            ("\"850 mm\"", "\"850\"", 4, "has no unit"),
            ("\"850 mm\"", "\"200 mm\"", 4, "is not above `min` along x"),
            ("\"core\"", "\"b1\"", 6, "two beams are called `b1`"),
            ("\"core\"", "\"../core\"", 7, "part of names"),
            ("\"core\"", "\"Planes\"", 7, "Planes.csv is the table"),
            ("along = \"z\"", "along = \"w\"", 10, "cannot be \"w\""),
            ("[3, 0, 4]", "[0, 0, 0]", 15, "has no direction"),
            ("\"300 mm\"", "\"-300 mm\"", 16, "must be positive"),
            ("normal", "normals", 15, "there is no key `normals`"),
            ("[[plane]]", "[plane]", 12, "expected"),
            ("normal = [", "normal = ", 15, "not valid TOML"),
        ] {
            assert!(TEXT.contains(old), "{old}");
            match Cuts::parse("cuts.toml", &TEXT.replace(old, new)) {
                Err(CaseError::Invalid(invalid)) => {
                    let told = invalid.to_string();
                    assert!(told.contains(says) || invalid.problem().contains(says), "{told}, not {says}");
                    assert_eq!(invalid.line(), line, "{told}");
                }
                other => panic!("{other:?}"),
            }
        }
        let empty = Cuts::parse("cuts.toml", "").unwrap_err();
        assert!(empty.render(false).contains("`beam` or `plane` is missing"));
        let refused = Cuts::parse("c", TEXT).unwrap().refuse("beam.1.min", "too far", "write less");
        assert!(refused.render(false).contains("c:8:"), "{}", refused.render(false));
    }
}
