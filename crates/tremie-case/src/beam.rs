//! The beam file: a hardened beam, its test, its matrix and its fibres.

use std::path::Path;

use serde_json::json;
use tremie_numerics::DVec3;
use tremie_suspension::Form;

use crate::case::NamedFile;
use crate::describe::object;
use crate::document::{
    Bound, Choice, Document, Kind, Maybe, Name, Need, Or, Quantity, Section, Table, Text, Variants, Vector,
    maybe, need, or,
};
use crate::fault::{CaseError, Fault, InvalidCase};
use crate::inclusions::whole;
use crate::listed;
use crate::schema::{LENGTH, quantity};
use crate::units::Dimension;

/// A beam and its test, in SI units.
#[derive(Debug, Clone, PartialEq)]
pub struct BeamCase {
    /// What it is called.
    pub title: String,
    /// Length, width and height in m; the lower face is in tension.
    pub size: DVec3,
    /// How it is tested.
    pub test: BeamTest,
    /// Opening in m to which it goes.
    pub opening: f64,
    /// The matrix.
    pub matrix: Matrix,
    /// The fibres, if there are any.
    pub fibres: Option<BeamFibres>,
    /// How they hold.
    pub bond: FibreBond,
    /// How it is computed.
    pub lattice: BeamLattice,
    /// The file, byte for byte.
    pub text: String,
    /// Files that it names.
    pub files: Vec<NamedFile>,
    name: String,
}

/// A test of a beam.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum BeamTest {
    /// Four-point bending without a notch, after NSBT.
    Nsbt {
        /// Distance of the supports in m.
        span: f64,
        /// Distance of the loads in m.
        inner: f64,
        /// How far the crack is from the middle, in m.
        offset: f64,
    },
    /// Three-point bending with a notch, after EN 14651.
    En14651 {
        /// Distance of the supports in m.
        span: f64,
        /// Depth of the notch in m.
        notch: f64,
    },
    /// Tension between plates that do not turn.
    Tension,
    /// A single fibre that is pulled out.
    PullOut {
        /// Length in m on the side that comes loose.
        embedded: f64,
        /// Diameter in m.
        diameter: f64,
        /// Angle in rad to the crack's normal.
        angle: f64,
    },
}

/// What surrounds the fibres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Matrix {
    /// Modulus of elasticity in Pa.
    pub modulus: f64,
    /// Tensile strength in Pa.
    pub strength: f64,
    /// Stress in Pa and opening in m where the softening has its kink.
    pub kink: [f64; 2],
    /// Opening in m from which on a crack bears nothing.
    pub last_opening: f64,
}

/// Where fibres come from.
#[derive(Debug, Clone, PartialEq)]
pub enum BeamFibres {
    /// At random.
    Random {
        /// Length in m.
        length: f64,
        /// Diameter in m.
        diameter: f64,
        /// Share of the volume.
        share: f64,
        /// How they lie.
        lying: Lying,
    },
    /// One by one from a file: both ends in m, with the beam's lower corner as origin, and diameters in m.
    Listed(Vec<([DVec3; 2], f64)>),
}

/// How fibres at random lie.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Lying {
    /// In all directions alike.
    Random,
    /// Along the beam.
    Aligned,
    /// In all horizontal directions.
    Planar,
    /// With a density exp(k cos^2) about the beam's axis.
    Concentrated(f64),
}

/// How fibres hold in the matrix.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FibreBond {
    /// Modulus of elasticity of the fibres in Pa.
    pub modulus: f64,
    /// Their tensile strength in Pa.
    pub strength: f64,
    /// Friction in Pa.
    pub friction: f64,
    /// Slip hardening.
    pub hardening: f64,
    /// Snubbing coefficient.
    pub snubbing: f64,
    /// Exponent of spalling.
    pub spalling: f64,
    /// Loss of strength by bending.
    pub bending: f64,
    /// Whether fibres stiffen what is not cracked.
    pub shear_lag: bool,
}

/// How finely a beam is computed, and how often.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BeamLattice {
    /// Distance in m of nodes at the crack.
    pub finest: f64,
    /// The same far from it.
    pub coarsest: f64,
    /// The first seed.
    pub seed: u64,
    /// How many beams, each with a seed of its own.
    pub beams: u64,
    /// Whether the crack may leave its plane.
    pub anywhere: bool,
}

/// Most beams of a file.
const MOST_BEAMS: u64 = 1000;
/// Supports are as far within the beam, in m.
const BEARING: f64 = 0.005;
/// Most facets in the crack plane: more would take more than 4 GB of memory.
const MOST_FACETS: f64 = 1500.0;
/// Most cells of a lattice, for the same reason.
const MOST_CELLS: f64 = 2e4;
/// Least facets across a beam.
const ACROSS: f64 = 4.0;

const ANY_NUMBER: Quantity = quantity(Dimension::NUMBER, Bound::Any, "0");
const SHARE: Quantity = quantity(Dimension::NUMBER, Bound::UpTo(0.3), "0.005");
const STRESS: Quantity = quantity(Dimension::STRESS, Bound::Positive, "2 MPa");
const NOT_NEGATIVE: Quantity = quantity(Dimension::NUMBER, Bound::NotNegative, "0.5");
const OFFSET: Quantity = quantity(Dimension::LENGTH, Bound::Any, "0 mm");
const SPAN: Need<Quantity> = need("span", "distance of the supports", LENGTH);

const FILE: Section<BeamCase> = {
    const TITLE: Need<Text> =
        need("title", "what you call it; it stands above the pictures", Text { example: "Beam B1" });
    const SIZE: Maybe<Vector<3>> = maybe(
        "size",
        "length, width and height of the beam, or of the prism in tension; a single fibre needs none",
        Vector(LENGTH),
    );
    const TEST: Need<Section<(BeamTest, f64)>> = need("test", "how it is tested", TESTS);
    const MATRIX_KEY: Need<Section<Matrix>> = need("matrix", "the concrete between the fibres", MATRIX);
    const FIBRES_KEY: Maybe<Section<BeamFibres>> = maybe(
        "fibres",
        "where fibres are; plain concrete if absent, unless they come from a cast (`--from`)",
        FIBRES,
    );
    const BOND_KEY: Or<Section<FibreBond>> = or("bond", "{}", "how fibres hold in the matrix", BOND);
    const LATTICE_KEY: Or<Section<BeamLattice>> = or("lattice", "{}", "how the beam is computed", LATTICE);
    Section {
        keys: &[&TITLE, &SIZE, &TEST, &MATRIX_KEY, &FIBRES_KEY, &BOND_KEY, &LATTICE_KEY],
        example: &[],
        read: |t| {
            let (test, opening) = t.need(&TEST)?;
            let size = match (t.maybe(&SIZE)?, test) {
                (Some(size), _) => size,
                (None, BeamTest::PullOut { .. }) => [0.0; 3],
                (None, _) => {
                    let help = "add size = [\"600 mm\", \"150 mm\", \"150 mm\"]";
                    return Err(Fault::new(t.itself().span(), "`size` is missing", "").help(help));
                }
            };
            let beam = BeamCase {
                title: t.need(&TITLE)?,
                size: size.into(),
                test,
                opening,
                matrix: t.need(&MATRIX_KEY)?,
                fibres: t.maybe(&FIBRES_KEY)?,
                bond: t.or(&BOND_KEY)?,
                lattice: t.or(&LATTICE_KEY)?,
                text: String::new(),
                files: Vec::new(),
                name: String::new(),
            };
            Ok(beam)
        },
    }
};

const TESTS: Section<(BeamTest, f64)> = {
    const OPENING: Or<Quantity> = or(
        "opening",
        "\"4 mm\"",
        "opening of the crack mouth at which the test ends; of a single fibre, how far it is pulled",
        LENGTH,
    );
    Section {
        keys: &[&KINDS, &OPENING],
        example: &["en14651 = { span = \"500 mm\", notch = \"25 mm\" }"],
        read: |t| Ok((t.one_of(&KINDS)?, t.or(&OPENING)?)),
    }
};

const KINDS: Variants<BeamTest> = Variants {
    what: "test",
    sections: &[
        ("nsbt", "four-point bending without a notch", NSBT),
        ("en14651", "three-point bending with a notch (EN 14651)", EN14651),
        ("tension", "tension between plates that do not turn", TENSION),
        ("pull_out", "a single fibre is pulled out of the matrix", PULL_OUT),
    ],
};

const NSBT: Section<BeamTest> = {
    const INNER: Need<Quantity> = need("inner_span", "distance of the loads", LENGTH);
    const OFF: Or<Quantity> = or(
        "crack_offset",
        "\"0 mm\"",
        "how far the crack plane is from the middle, along the beam; between the loads",
        OFFSET,
    );
    Section {
        keys: &[&SPAN, &INNER, &OFF],
        example: &["span = \"450 mm\"", "inner_span = \"150 mm\""],
        read: |t| Ok(BeamTest::Nsbt { span: t.need(&SPAN)?, inner: t.need(&INNER)?, offset: t.or(&OFF)? }),
    }
};

const EN14651: Section<BeamTest> = {
    const NOTCH: Or<Quantity> = or("notch", "\"25 mm\"", "depth of the notch", LENGTH);
    Section {
        keys: &[&SPAN, &NOTCH],
        example: &["span = \"500 mm\"", "notch = \"25 mm\""],
        read: |t| Ok(BeamTest::En14651 { span: t.need(&SPAN)?, notch: t.or(&NOTCH)? }),
    }
};

const TENSION: Section<BeamTest> = Section { keys: &[], example: &[], read: |_| Ok(BeamTest::Tension) };

const PULL_OUT: Section<BeamTest> = {
    const EMBEDDED: Need<Quantity> = need("embedded", "length on the side that comes loose", LENGTH);
    const DIAMETER: Need<Quantity> =
        need("diameter", "diameter of the fibre", quantity(Dimension::LENGTH, Bound::Positive, "0.75 mm"));
    const ANGLE: Or<Quantity> = or(
        "angle",
        "\"0 deg\"",
        "angle between the fibre and the crack's normal, below 90 degrees",
        quantity(Dimension::NUMBER, Bound::NotNegative, "30 deg"),
    );
    Section {
        keys: &[&EMBEDDED, &DIAMETER, &ANGLE],
        example: &["embedded = \"20 mm\"", "diameter = \"0.75 mm\""],
        read: |t| {
            let angle = t.or(&ANGLE)?;
            if angle >= 0.5 * std::f64::consts::PI {
                let value = t.value("angle").unwrap_or_else(|| t.itself());
                return Err(value.fault("is 90 degrees or more: it would not cross the crack", "write less"));
            }
            Ok(BeamTest::PullOut { embedded: t.need(&EMBEDDED)?, diameter: t.need(&DIAMETER)?, angle })
        },
    }
};

const MATRIX: Section<Matrix> = {
    const MODULUS: Or<Quantity> = or(
        "modulus",
        "\"30 GPa\"",
        "modulus of elasticity; Poisson's ratio is zero",
        quantity(Dimension::STRESS, Bound::Positive, "30 GPa"),
    );
    const STRENGTH: Need<Quantity> = need("strength", "tensile strength", STRESS);
    const KINK_STRESS: Need<Quantity> = need(
        "kink_stress",
        "stress at the kink of the softening",
        quantity(Dimension::STRESS, Bound::Positive, "0.5 MPa"),
    );
    const KINK_OPENING: Need<Quantity> = need(
        "kink_opening",
        "crack opening at the kink of the softening",
        quantity(Dimension::LENGTH, Bound::Positive, "0.05 mm"),
    );
    const LAST: Need<Quantity> = need(
        "last_opening",
        "crack opening from which on the matrix bears nothing",
        quantity(Dimension::LENGTH, Bound::Positive, "0.3 mm"),
    );
    Section {
        keys: &[&MODULUS, &STRENGTH, &KINK_STRESS, &KINK_OPENING, &LAST],
        example: &[
            "strength = \"2 MPa\"",
            "kink_stress = \"0.5 MPa\"",
            "kink_opening = \"0.05 mm\"",
            "last_opening = \"0.3 mm\"",
        ],
        read: |t| {
            let (strength, kink) = (t.need(&STRENGTH)?, [t.need(&KINK_STRESS)?, t.need(&KINK_OPENING)?]);
            let last_opening = t.need(&LAST)?;
            below(t, "kink_stress", kink[0], strength, "`strength`")?;
            below(t, "kink_opening", kink[1], last_opening, "`last_opening`")?;
            Ok(Matrix { modulus: t.or(&MODULUS)?, strength, kink, last_opening })
        },
    }
};

/// What stands under a key is less than something.
fn below(t: &Table<'_>, key: &str, found: f64, most: f64, what: &str) -> Result<(), Fault> {
    if found < most {
        return Ok(());
    }
    let value = t.value(key).unwrap_or_else(|| t.itself());
    Err(value.fault(format!("is not below {what}"), "write a smaller one"))
}

const FIBRES: Section<BeamFibres> = Section {
    keys: &[&SOURCES],
    example: &["random = { length = \"60 mm\", diameter = \"0.75 mm\", volume_fraction = 0.005 }"],
    read: |t| t.one_of(&SOURCES),
};

const SOURCES: Variants<BeamFibres> = Variants {
    what: "source of fibres",
    sections: &[
        ("random", "fibres at random, as in a beam that was sawn from something larger", RANDOM),
        ("listed", "fibres one by one, from a CSV file", LISTED),
    ],
};

const RANDOM: Section<BeamFibres> = {
    const LONG: Need<Quantity> =
        need("length", "length of a fibre", quantity(Dimension::LENGTH, Bound::Positive, "60 mm"));
    const DIAMETER: Need<Quantity> =
        need("diameter", "diameter of a fibre", quantity(Dimension::LENGTH, Bound::Positive, "0.75 mm"));
    const VOLUME: Need<Quantity> = need("volume_fraction", "share of the volume", SHARE);
    const DIRECTION: Or<Choice<Lying>> = or(
        "orientation",
        "\"random\"",
        "how they lie",
        Choice(&[
            ("random", "in all directions alike", Lying::Random),
            ("aligned", "along the beam", Lying::Aligned),
            ("planar", "in all horizontal directions", Lying::Planar),
        ]),
    );
    const CONCENTRATION: Maybe<Quantity> = maybe(
        "concentration",
        "k in a density of directions of exp(k cos^2) about the beam's axis, in place of `orientation`: above zero along it, below zero across",
        ANY_NUMBER,
    );
    Section {
        keys: &[&LONG, &DIAMETER, &VOLUME, &DIRECTION, &CONCENTRATION],
        example: &["length = \"60 mm\"", "diameter = \"0.75 mm\"", "volume_fraction = 0.005"],
        read: |t| {
            let (length, diameter) = (t.need(&LONG)?, t.need(&DIAMETER)?);
            below(t, "diameter", diameter, length, "the `length` of the fibre")?;
            let concentration = t.maybe(&CONCENTRATION)?;
            if let (Some(value), true) = (t.value("concentration"), t.value("orientation").is_some()) {
                return Err(value.fault("cannot stand beside `orientation`", "keep one of them"));
            }
            if let Some(value) =
                t.value("concentration").filter(|_| concentration.is_some_and(|k| k.abs() > 100.0))
            {
                return Err(value.fault("is beyond 100", "write \"aligned\" or \"planar\" as orientation"));
            }
            let lying = concentration.map_or(t.or(&DIRECTION)?.2, Lying::Concentrated);
            Ok(BeamFibres::Random { length, diameter, share: t.need(&VOLUME)?, lying })
        },
    }
};

const LISTED: Section<BeamFibres> = {
    const PATH: Need<Text> = need(
        "file",
        "path of the file from the folder of this one, in the format of `tremie export --format csv`; the beam's lower corner is its origin",
        Text { example: "B1.csv" },
    );
    const TYPE: Or<Name> =
        or("name", "\"fibres\"", "which of the file's types are the fibres", Name { example: "fibres" });
    Section {
        keys: &[&PATH, &TYPE],
        example: &["file = \"B1.csv\""],
        read: |t| {
            let path = t.need(&PATH)?;
            let value = t.value("file").unwrap_or_else(|| t.itself());
            let listed = listed::Table::open(&value, path)?.of_type(&value, &t.or(&TYPE)?)?;
            let fibre = |body: &listed::ListedBody| match listed.forms[body.form] {
                Form::Fibre { length, diameter } => {
                    let half = 0.5 * length * (body.orientation * DVec3::Z);
                    Ok(([body.position - half, body.position + half], diameter))
                }
                _ => Err(value
                    .fault(format!("has a body that is no fibre, in line {}", body.line), "write two ends")),
            };
            Ok(BeamFibres::Listed(listed.bodies.iter().map(fibre).collect::<Result<_, _>>()?))
        },
    }
};

const BOND: Section<FibreBond> = {
    const MODULUS: Or<Quantity> = or("modulus", "\"200 GPa\"", "modulus of elasticity of the fibres", STRESS);
    const STRENGTH: Or<Quantity> = or("strength", "\"1050 MPa\"", "tensile strength of the fibres", STRESS);
    const FRICTION: Or<Quantity> =
        or("friction", "\"4 MPa\"", "friction along the fibre; hooks are spread over it", STRESS);
    const HARDENING: Or<Quantity> = or(
        "hardening",
        "0",
        "how friction grows as a fibre slides out: by this for each diameter; weakens if negative",
        ANY_NUMBER,
    );
    const SNUBBING: Or<Quantity> = or(
        "snubbing",
        "0.5",
        "f in exp(f theta), by which fibres that lie at an angle bear more",
        NOT_NEGATIVE,
    );
    const SPALLING: Or<Quantity> = or(
        "spalling",
        "1.4",
        "b in cos(theta)^b, by which they bear less because the matrix spalls",
        NOT_NEGATIVE,
    );
    const BENDING: Or<Quantity> =
        or("bending", "0", "k in exp(-k theta), by which they break earlier", NOT_NEGATIVE);
    const LAG: Or<Choice<bool>> = or(
        "before_cracking",
        "\"stiffen\"",
        "what fibres do before the matrix cracks",
        Choice(&[
            ("stiffen", "they take their share by shear lag", true),
            ("nothing", "they do nothing", false),
        ]),
    );
    Section {
        keys: &[&MODULUS, &STRENGTH, &FRICTION, &HARDENING, &SNUBBING, &SPALLING, &BENDING, &LAG],
        example: &["friction = \"4 MPa\""],
        read: |t| {
            Ok(FibreBond {
                modulus: t.or(&MODULUS)?,
                strength: t.or(&STRENGTH)?,
                friction: t.or(&FRICTION)?,
                hardening: t.or(&HARDENING)?,
                snubbing: t.or(&SNUBBING)?,
                spalling: t.or(&SPALLING)?,
                bending: t.or(&BENDING)?,
                shear_lag: t.or(&LAG)?.2,
            })
        },
    }
};

const LATTICE: Section<BeamLattice> = {
    const FINEST: Or<Quantity> = or("spacing", "\"10 mm\"", "distance of nodes at the crack plane", LENGTH);
    const COARSEST: Or<Quantity> =
        or("coarsest", "\"25 mm\"", "distance of nodes far from the crack plane", LENGTH);
    const SEED: Or<Quantity> = or(
        "seed",
        "1",
        "a whole number; the same gives the same lattice and the same fibres at random",
        quantity(Dimension::NUMBER, Bound::NotNegative, "1"),
    );
    const BEAMS: Or<Quantity> = or(
        "beams",
        "1",
        "how many beams are tested, each with the next seed: mean, scatter and characteristic value",
        quantity(Dimension::NUMBER, Bound::Positive, "3"),
    );
    const CRACK: Or<Choice<bool>> = or(
        "crack",
        "\"plane\"",
        "where the crack may be",
        Choice(&[
            ("plane", "in one plane across the beam: seconds to minutes", false),
            (
                "anywhere",
                "wherever the beam is weakest, and as it turns on its way: minutes to an hour",
                true,
            ),
        ]),
    );
    Section {
        keys: &[&FINEST, &COARSEST, &SEED, &BEAMS, &CRACK],
        example: &["spacing = \"10 mm\"", "beams = 3"],
        read: |t| {
            let (finest, coarsest) = (t.or(&FINEST)?, t.or(&COARSEST)?);
            if finest > coarsest {
                let value = t.value("spacing").or_else(|| t.value("coarsest")).unwrap_or_else(|| t.itself());
                return Err(value.fault(
                    "makes the lattice finer far from the crack than at it",
                    "let `spacing` be at most `coarsest`",
                ));
            }
            let beams = whole(t, "beams", t.or(&BEAMS)?)?;
            if beams > MOST_BEAMS {
                let value = t.value("beams").unwrap_or_else(|| t.itself());
                return Err(value.fault(format!("is more than {MOST_BEAMS}"), "write fewer"));
            }
            let seed = whole(t, "seed", t.or(&SEED)?)?;
            Ok(BeamLattice { finest, coarsest, seed, beams, anywhere: t.or(&CRACK)?.2 })
        },
    }
};

/// What is wrong only in combination.
fn check(document: &Document<'_>, beam: &BeamCase) -> Result<(), Fault> {
    let at =
        |key: &str, problem: String, advice: &str| Err(Fault::new(document.locate(key), problem, advice));
    let mm = |length: f64| format!("{} mm", (1e6 * length).round() / 1e3);
    let [length, width, height] = beam.size.to_array();
    let span_fits = |key: &str, span: f64| {
        if span + 2.0 * BEARING <= length {
            return Ok(());
        }
        let problem = format!(
            "the supports, {} apart, do not stand under the beam, which is {} long",
            mm(span),
            mm(length)
        );
        at(key, problem, "let the span be shorter than the beam by 10 mm at least")
    };
    match beam.test {
        BeamTest::Nsbt { span, inner, offset } => {
            span_fits("test.nsbt.span", span)?;
            if inner >= span {
                return at(
                    "test.nsbt.inner_span",
                    "the loads stand beyond the supports".into(),
                    "write less than the span",
                );
            }
            if offset.abs() > 0.5 * inner {
                return at(
                    "test.nsbt.crack_offset",
                    "the crack is not between the loads".into(),
                    "write at most half of inner_span",
                );
            }
        }
        BeamTest::En14651 { span, notch } => {
            span_fits("test.en14651.span", span)?;
            if notch >= height {
                let problem =
                    format!("the notch is {} deep, the beam {} high: nothing is left", mm(notch), mm(height));
                return at("test.en14651.notch", problem, "write less than the height, such as \"25 mm\"");
            }
        }
        BeamTest::Tension => {}
        BeamTest::PullOut { .. } => return Ok(()),
    }
    let smallest = length.min(width).min(height);
    if beam.lattice.finest * ACROSS > smallest {
        let problem = format!(
            "the lattice is too coarse: {} apart, nodes leave fewer than four cells across {}",
            mm(beam.lattice.finest),
            mm(smallest)
        );
        return at("lattice.spacing", problem, "write a smaller `spacing`");
    }
    let plane = width * height / beam.lattice.finest.powi(2);
    if plane > MOST_FACETS {
        let problem = format!("the lattice is too fine: about {plane:.0} facets in the crack plane");
        return at(
            "lattice.spacing",
            problem,
            "write a larger `spacing`: 1,500 facets there take minutes and gigabytes already",
        );
    }
    if let (true, BeamTest::Nsbt { offset, .. }) = (beam.lattice.anywhere, beam.test)
        && offset != 0.0
    {
        return at(
            "test.nsbt.crack_offset",
            "a crack that may be anywhere has no place that could be given".into(),
            "leave it out, or write crack = \"plane\"",
        );
    }
    // At random, nodes fill about 0.57 of the cubes of their distance; without a notch, a crack may be anywhere in cells that are all alike.
    let notched = matches!(beam.test, BeamTest::En14651 { .. });
    if beam.lattice.anywhere && !notched {
        let cells = 0.57 * beam.size.element_product() / beam.lattice.finest.powi(3);
        if cells > MOST_CELLS {
            let problem = format!("the lattice is too fine for a crack anywhere: about {cells:.0} cells");
            return at("lattice.spacing", problem, "write a larger `spacing`, or crack = \"plane\"");
        }
    }
    let cells = 0.57 * beam.size.element_product() / beam.lattice.coarsest.powi(3);
    if cells > MOST_CELLS {
        let problem = format!("the lattice is too fine far from the crack: about {cells:.0} cells");
        return at(
            "lattice.coarsest",
            problem,
            "write a larger `coarsest`: \"25 mm\" is enough for most beams",
        );
    }
    if beam.test == BeamTest::Tension || beam.lattice.coarsest <= 0.5 * length {
        return Ok(());
    }
    at("lattice.coarsest", "fewer than two cells fit along the beam".into(), "write a smaller `coarsest`")
}

impl BeamCase {
    /// Reads a beam file from `text`; the files that it names lie in the folder of `name`.
    ///
    /// # Errors
    /// What is wrong with it, with the line.
    pub fn parse(name: &str, text: &str) -> Result<Self, CaseError> {
        let folder = Path::new(name).parent().unwrap_or(Path::new(""));
        let read = Document::parse(text, folder).and_then(|document| {
            let mut beam = FILE.read(&document.root())?;
            check(&document, &beam)?;
            beam.files = document.files.all();
            Ok(beam)
        });
        let beam = read.map_err(|fault| InvalidCase::new(name, text, fault))?;
        Ok(Self { text: text.to_owned(), name: name.to_owned(), ..beam })
    }

    /// Reads a beam file.
    ///
    /// # Errors
    /// If it cannot be read, or what is wrong with it, with the line.
    pub fn read(path: &Path) -> Result<Self, CaseError> {
        let text = std::fs::read_to_string(path)
            .map_err(|source| CaseError::Read { path: path.to_owned(), source })?;
        Self::parse(&path.display().to_string(), &text)
    }

    /// What somebody further up finds wrong, told at a key such as `lattice.spacing`.
    pub fn refuse(&self, key: &str, problem: impl Into<String>, advice: impl Into<String>) -> CaseError {
        let document = Document::parse(&self.text, Path::new(""));
        let span = document.map_or(0..0, |document| document.locate(key));
        InvalidCase::new(&self.name, &self.text, Fault::new(span, problem, advice)).into()
    }
}

/// The JSON Schema (draft 2020-12) of the beam file.
pub(crate) fn describe() -> serde_json::Value {
    let mut schema = object(json!({
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "Tremie beam file",
        "description": "A hardened beam and its test. Quantities are texts of a number and a unit, such as \"2 MPa\".",
    }));
    schema.extend(FILE.describe());
    schema.into()
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "title = \"Beam\"\nsize = [\"600 mm\", \"150 mm\", \"0.15 m\"]\n\n[test]\n\
        en14651 = { span = \"500 mm\", notch = \"25 mm\" }\nopening = \"3.5 mm\"\n\n[matrix]\nstrength = \"2 MPa\"\n\
        kink_stress = \"0.5 MPa\"\nkink_opening = \"0.05 mm\"\nlast_opening = \"0.3 mm\"\n\n[fibres.random]\n\
        length = \"60 mm\"\ndiameter = \"0.75 mm\"\nvolume_fraction = 0.005\n\n[lattice]\nspacing = \"12 mm\"\nbeams = 3\n";

    #[test]
    fn a_crack_may_be_anywhere() {
        let text = TEXT.replace("beams = 3", "crack = \"anywhere\"");
        assert!(BeamCase::parse("beam.toml", &text).unwrap().lattice.anywhere);
        let nsbt = "nsbt = { span = \"450 mm\", inner_span = \"150 mm\", crack_offset = \"20 mm\" }";
        let text = text.replace("en14651 = { span = \"500 mm\", notch = \"25 mm\" }", nsbt);
        let error = BeamCase::parse("beam.toml", &text).unwrap_err().to_string();
        assert!(error.contains("has no place that could be given"), "{error}");
        let fine = text.replace(", crack_offset = \"20 mm\"", "").replace("\"12 mm\"", "\"7 mm\"");
        let error = BeamCase::parse("beam.toml", &fine).unwrap_err().to_string();
        assert!(error.contains("too fine for a crack anywhere"), "{error}");
    }

    #[test]
    fn a_beam_is_read_in_si_units() {
        let beam = BeamCase::parse("beam.toml", TEXT).unwrap();
        assert!((beam.size - DVec3::new(0.6, 0.15, 0.15)).length() < 1e-12);
        assert_eq!(beam.test, BeamTest::En14651 { span: 0.5, notch: 0.025 });
        assert_eq!((beam.matrix.strength, beam.matrix.modulus), (2e6, 30e9));
        assert!((beam.opening - 0.0035).abs() < 1e-15 && (beam.bond.friction - 4e6).abs() < 1e-6);
        assert_eq!((beam.lattice.beams, beam.lattice.seed), (3, 1));
        let Some(BeamFibres::Random { share, lying, .. }) = beam.fibres else { panic!() };
        assert_eq!((share, lying), (0.005, Lying::Random));
        assert!(describe()["properties"]["matrix"]["properties"]["strength"].is_object());
    }

    #[test]
    fn fibres_come_from_a_file() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(
            folder.path().join("B1.csv"),
            "id,x1_m,y1_m,z1_m,x2_m,y2_m,z2_m,d_m,type\n1,0.1,0,0,0.16,0,0,0.00075,fibres\n",
        )
        .unwrap();
        let random = TEXT.find("[fibres.random]").unwrap()..TEXT.find("[lattice]").unwrap();
        let text = TEXT.replace(&TEXT[random], "[fibres.listed]\nfile = \"B1.csv\"\n\n");
        let name = folder.path().join("beam.toml").display().to_string();
        let beam = BeamCase::parse(&name, &text).unwrap();
        let Some(BeamFibres::Listed(fibres)) = beam.fibres else { panic!() };
        assert!((fibres[0].0[1] - DVec3::new(0.16, 0.0, 0.0)).length() < 1e-12 && fibres[0].1 == 0.00075);
        assert_eq!(beam.files.len(), 1);
    }

    #[test]
    fn mistakes_are_told_with_their_line() {
        for (old, new, line, says) in [
            ("span = \"500 mm\"", "span = \"600 mm\"", 5, "do not stand under the beam"),
            ("notch = \"25 mm\"", "notch = \"150 mm\"", 5, "nothing is left"),
            (
                "en14651 = { span = \"500 mm\", notch = \"25 mm\" }",
                "nsbt = { span = \"450 mm\", inner_span = \"450 mm\" }",
                5,
                "beyond the supports",
            ),
            (
                "en14651 = { span = \"500 mm\", notch = \"25 mm\" }",
                "nsbt = { span = \"450 mm\", inner_span = \"150 mm\", crack_offset = \"80 mm\" }",
                5,
                "not between the loads",
            ),
            ("en14651", "en14561", 5, "there is no key `en14561`"),
            ("strength = \"2 MPa\"\n", "", 8, "`matrix.strength` is missing"),
            ("\"0.5 MPa\"", "\"2 MPa\"", 10, "is not below `strength`"),
            ("\"0.05 mm\"", "\"0.5 mm\"", 11, "is not below `last_opening`"),
            ("\"0.75 mm\"", "\"75 mm\"", 16, "is not below the `length`"),
            ("0.005", "0.5", 17, "at most 0.3"),
            ("\"12 mm\"", "\"40 mm\"", 20, "finer far from the crack"),
            ("\"12 mm\"", "\"40 mm\"\ncoarsest = \"50 mm\"", 20, "too coarse"),
            ("\"12 mm\"", "\"1 mm\"", 20, "too fine"),
            ("\"12 mm\"", "\"5 mm\"\ncoarsest = \"5 mm\"", 21, "too fine far from the crack"),
            ("beams = 3", "beams = 2.5", 21, "whole"),
            ("beams = 3", "beams = 5000", 21, "more than 1000"),
        ] {
            assert!(TEXT.contains(old), "{old}");
            match BeamCase::parse("beam.toml", &TEXT.replacen(old, new, 1)) {
                Err(CaseError::Invalid(invalid)) => {
                    let told = invalid.to_string();
                    assert!(told.contains(says), "{told}, not {says}");
                    assert_eq!(invalid.line(), line, "{told}");
                }
                other => panic!("{says}: {other:?}"),
            }
        }
    }
}
