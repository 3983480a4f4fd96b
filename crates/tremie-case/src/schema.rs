//! The keys of a case file: what there is, what it means, in which units, within which bounds, and what stands for it if
//! absent.
//!
//! A new flow curve is an entry in `FLOW_CURVES`, a new shape one in `SHAPES`, a new method one in `METHOD`; a new
//! section is a constant like the others and a key in `CASE`.

use std::f64::consts::TAU;

use serde_json::{Value as Json, json};
use tremie_geometry::{Body, Face, Motion, Outline, Shape, Union, Waypoint};
use tremie_numerics::{DVec2, DVec3};
use tremie_rheology::bars::{BarGrid, CLOSEST};
use tremie_rheology::{FlowCurve, Regularisation, Thixotropy};
use tremie_suspension::Inclusions;

use crate::bars;
use crate::case::{
    AboveFill, Cage, Case, Collision, Course, Domain, FillingGauge, FluidRegion, FrontGauge, Gauges, Inlet,
    Isph, Lattice, Layer, Lbm, Ldd, LddCoupling, LddLaplacian, LddScheme, LevelGauge, LightGauge, Load,
    Material, Method, Outlet, Output, Precision, Preset, PressureGauge, PressureStep, Rest, Role, Scheme,
    Side, Solid, SpreadGauge, Stepping, Stop, StrainConvention, StressStep, Surface,
};
use crate::describe::object;
use crate::document::{
    Bound, Choice, Document, Kind, List, Maybe, Name, Need, Or, Quantity, Rule, Section, Switch, Table, Text,
    Variants, Vector, WordOr, maybe, need, or,
};
use crate::fault::Fault;
use crate::fibre_field::{FIBRE_FIELD, FibreField};
use crate::inclusions::{self, Following, InclusionGroup, Incoming};
use crate::stl::{self, Place};
use crate::units::Dimension;

pub(crate) const fn quantity(dimension: Dimension, range: Bound, example: &'static str) -> Quantity {
    Quantity { dimension, range, example }
}

const COORDINATE: Quantity = quantity(Dimension::LENGTH, Bound::Any, "0.2 m");
pub(crate) const LENGTH: Quantity = quantity(Dimension::LENGTH, Bound::Positive, "200 mm");
const LENGTH_OR_ZERO: Quantity = quantity(Dimension::LENGTH, Bound::NotNegative, "200 mm");
const SPEED: Quantity = quantity(Dimension::SPEED, Bound::Positive, "1 mm/s");
const TIME: Quantity = quantity(Dimension::TIME, Bound::Positive, "1 s");
const POINT: Vector<3> = Vector(COORDINATE);
const MOTION: Vector<3> = Vector(quantity(Dimension::SPEED, Bound::Any, "0 m/s"));
const FORCE_VECTOR: Vector<3> = Vector(quantity(Dimension::FORCE, Bound::Any, "0 N"));
const VISCOSITY: Quantity = quantity(Dimension::VISCOSITY, Bound::Positive, "30 Pa s");

/// Reads the document; what is wrong only in combination is left to `check`.
pub(crate) fn read(document: &Document<'_>, name: &str, text: &str) -> Result<Case, Fault> {
    let case = CASE.read(&document.root())?;
    let (files, meshes) = (document.files.all(), document.files.meshes());
    Ok(Case { name: name.to_owned(), text: text.to_owned(), files, meshes, ..case })
}

/// The keys as JSON Schema.
pub(crate) fn describe() -> Json {
    let mut schema = object(json!({
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "Tremie case file",
        "description": "What is to be computed. Quantities are texts of a number and a unit, such as \"50 Pa\".",
    }));
    schema.extend(CASE.describe());
    schema.into()
}

const CASE: Section<Case> = {
    const TITLE: Need<Text> =
        need("title", "what you call it; it stands above the pictures", Text { example: "Slump flow" });
    const MATERIAL_KEY: Need<Section<Material>> = need("material", "the fluid", MATERIAL);
    const DOMAIN_KEY: Need<Section<Domain>> =
        need("domain", "the box in which the fluid flows, a whole number of cells along each axis", DOMAIN);
    const FLUID_KEY: Maybe<List<Section<FluidRegion>>> =
        maybe("fluid", "where fluid is at the start: regions, which may overlap", List(FLUID));
    const INLET_KEY: Maybe<List<Section<Inlet>>> =
        maybe("inlet", "where fluid comes in during the run", List(INLET));
    const SOURCES: Rule = Rule("anyOf", &["fluid", "inlet"]);
    const OUTLET_KEY: Maybe<List<Section<Outlet>>> =
        maybe("outlet", "where fluid leaves, besides sides that are open", List(OUTLET));
    const SOLID_KEY: Maybe<List<Section<Solid>>> =
        maybe("solid", "what stands or moves in the domain; solids may overlap", List(SOLID));
    const BARS_KEY: Maybe<List<Section<Solid>>> =
        maybe("bars", "reinforcing bars, at rest, to which the fluid sticks", List(BARS));
    const GROUPS_KEY: Maybe<List<Section<InclusionGroup>>> =
        maybe("inclusions", "aggregates and fibres in the fluid at the start", List(inclusions::GROUP));
    const FOLLOWING_KEY: Or<Section<Following>> =
        or("suspension", "{}", "how inclusions are followed", inclusions::FOLLOWING);
    const FIELD_KEY: Maybe<Section<FibreField>> = maybe(
        "fibre_field",
        "fibres too many to be followed one by one: how they lie, as a field that the fluid carries along",
        FIBRE_FIELD,
    );
    const CAGE_KEY: Maybe<List<Section<Cage>>> = maybe(
        "cage",
        "bars too thin for the cells: regions in which they hold the fluid up by their drag; they may overlap",
        List(CAGE),
    );
    const GAUGES_KEY: Need<Section<Gauges>> = need("gauges", "what is measured", GAUGES);
    const STOP_KEY: Need<Section<Stop>> = need("stop", "when the run ends", STOP);
    const OUTPUT_KEY: Or<Section<Output>> = or("output", "{}", "what is written", OUTPUT);
    Section {
        keys: &[
            &TITLE,
            &METHOD,
            &MATERIAL_KEY,
            &DOMAIN_KEY,
            &FLUID_KEY,
            &INLET_KEY,
            &SOURCES,
            &OUTLET_KEY,
            &SOLID_KEY,
            &BARS_KEY,
            &GROUPS_KEY,
            &FOLLOWING_KEY,
            &FIELD_KEY,
            &CAGE_KEY,
            &GAUGES_KEY,
            &STOP_KEY,
            &OUTPUT_KEY,
        ],
        example: &[],
        read: |t| {
            let case = Case {
                title: t.need(&TITLE)?,
                method: t.switch(&METHOD)?,
                material: t.need(&MATERIAL_KEY)?,
                domain: t.need(&DOMAIN_KEY)?,
                fluid: t.maybe(&FLUID_KEY)?.unwrap_or_default(),
                inlets: t.maybe(&INLET_KEY)?.unwrap_or_default(),
                outlets: t.maybe(&OUTLET_KEY)?.unwrap_or_default(),
                solids: [(t.maybe(&SOLID_KEY)?, "solid"), (t.maybe(&BARS_KEY)?, "bars")]
                    .map(|(solids, what)| called(solids, what, |solid| &mut solid.name))
                    .concat(),
                groups: t.maybe(&GROUPS_KEY)?.unwrap_or_default(),
                inclusions: Inclusions::default(),
                following: t.or(&FOLLOWING_KEY)?,
                fibre_field: t.maybe(&FIELD_KEY)?,
                cages: called(t.maybe(&CAGE_KEY)?, "cage", |cage| &mut cage.name),
                gauges: t.need(&GAUGES_KEY)?,
                stop: t.need(&STOP_KEY)?,
                output: t.or(&OUTPUT_KEY)?,
                meshes: Vec::new(),
                files: Vec::new(),
                name: String::new(),
                text: String::new(),
            };
            if case.fluid.is_empty() && case.inlets.is_empty() {
                let help = List(FLUID).example("fluid", "fluid");
                let (problem, label) = ("`fluid` or `inlet` is missing", "");
                return Err(Fault::new(t.itself().span(), problem, label).help(help));
            }
            Ok(case)
        },
    }
};

/// Things of which those without a name are called after what they are and their number.
fn called<T>(things: Option<Vec<T>>, what: &str, name: impl Fn(&mut T) -> &mut String) -> Vec<T> {
    let mut things = things.unwrap_or_default();
    for (n, thing) in things.iter_mut().enumerate() {
        let name = name(thing);
        if name.is_empty() {
            *name = format!("{what}{}", n + 1);
        }
    }
    things
}

const MATERIAL: Section<Material> = {
    const DENSITY: Need<Quantity> =
        need("density", "density of the fluid", quantity(Dimension::DENSITY, Bound::Positive, "2300 kg/m3"));
    const REGULARISATION_KEY: Maybe<Section<Regularisation>> = maybe(
        "regularisation",
        "lets the fluid creep below its yield stress, as many other programs do; without it a yield stress is exact",
        REGULARISATION,
    );
    const THIXOTROPY_KEY: Maybe<Section<Structured>> = maybe(
        "thixotropy",
        "lets the yield stress of a Bingham fluid grow at rest, and shear break it down again",
        THIXOTROPY,
    );
    const TENSION: Or<Quantity> = or(
        "surface_tension",
        "\"0 N/m\"",
        "tension of the free surface: counts where a yield stress is a few Pa and surfaces are curved by a few centimetres or less, as of pastes in small moulds (water: 0.072 N/m)",
        quantity(Dimension::SURFACE_TENSION, Bound::NotNegative, "0.05 N/m"),
    );
    Section {
        keys: &[&DENSITY, &REGULARISATION_KEY, &THIXOTROPY_KEY, &TENSION, &FLOW_CURVES],
        example: &[
            "density = \"2300 kg/m3\"",
            "bingham = { yield_stress = \"50 Pa\", plastic_viscosity = \"30 Pa s\" }",
        ],
        read: |t| {
            let density = t.need(&DENSITY)?;
            let mut curve = t.one_of(&FLOW_CURVES)?;
            if let Some(value) = t.value("regularisation") {
                curve = curve.regularised(REGULARISATION.read(&value)?).ok_or_else(|| {
                    value.fault("has nothing to act on: the flow curve has no yield stress", "remove this")
                })?;
            }
            let surface_tension = t.or(&TENSION)?;
            let Some(value) = t.value("thixotropy") else {
                return Ok(Material { density, curve, thixotropy: None, structure: 0.0, surface_tension });
            };
            let Structured { build_up, breakdown, structure } = THIXOTROPY.read(&value)?;
            let yield_stress = match curve {
                FlowCurve::Bingham { yield_stress, .. } if yield_stress > 0.0 => yield_stress,
                _ => {
                    let problem = "is for the flow curve `bingham` with a yield stress, as it stands";
                    return Err(value.fault(problem, "remove this, or change the flow curve"));
                }
            };
            let thixotropy = Some(Thixotropy { build_up_time: yield_stress / build_up, breakdown });
            Ok(Material { density, curve, thixotropy, structure, surface_tension })
        },
    }
};

/// `thixotropy` as written.
struct Structured {
    build_up: f64,
    breakdown: f64,
    structure: f64,
}

const THIXOTROPY: Section<Structured> = {
    const BUILD_UP: Need<Quantity> = need(
        "build_up",
        "what the yield stress grows by at rest, in a time (Athix)",
        quantity(Dimension::STRESS_RATE, Bound::Positive, "0.2 Pa/s"),
    );
    const BREAKDOWN: Or<Quantity> = or(
        "breakdown",
        "0.005",
        "breakdown of the structure by shear: its rate is this x structure x shear rate",
        quantity(Dimension::NUMBER, Bound::NotNegative, "0.005"),
    );
    const AT_FIRST: Or<Quantity> = or(
        "structure",
        "0",
        "structure of the fluid at the start and where it comes in: the yield stress is 1 + structure times that of the flow curve",
        quantity(Dimension::NUMBER, Bound::NotNegative, "0"),
    );
    Section {
        keys: &[&BUILD_UP, &BREAKDOWN, &AT_FIRST],
        example: &["build_up = \"0.2 Pa/s\""],
        read: |t| {
            Ok(Structured {
                build_up: t.need(&BUILD_UP)?,
                breakdown: t.or(&BREAKDOWN)?,
                structure: t.or(&AT_FIRST)?,
            })
        },
    }
};

const REGULARISATION: Section<Regularisation> = Section {
    keys: &[&REGULARISATIONS],
    example: &["papanastasiou = { exponent = \"100 s\" }"],
    read: |t| t.one_of(&REGULARISATIONS),
};

const REGULARISATIONS: Variants<Regularisation> = Variants {
    what: "regularisation",
    sections: &[
        ("papanastasiou", "the yield stress is multiplied by 1 - exp(-exponent x shear rate)", PAPANASTASIOU),
        ("bi_viscosity", "the apparent viscosity is limited", BI_VISCOSITY),
    ],
};

const PAPANASTASIOU: Section<Regularisation> = {
    const EXPONENT: Need<Quantity> = need(
        "exponent",
        "the longer, the nearer to a yield stress",
        quantity(Dimension::TIME, Bound::Positive, "100 s"),
    );
    Section {
        keys: &[&EXPONENT],
        example: &["exponent = \"100 s\""],
        read: |t| Ok(Regularisation::Papanastasiou { exponent: t.need(&EXPONENT)? }),
    }
};

const BI_VISCOSITY: Section<Regularisation> = {
    const LARGEST: Need<Quantity> = need(
        "largest_viscosity",
        "viscosity below the yield stress",
        quantity(Dimension::VISCOSITY, Bound::Positive, "1e4 Pa s"),
    );
    Section {
        keys: &[&LARGEST],
        example: &["largest_viscosity = \"1e4 Pa s\""],
        read: |t| Ok(Regularisation::BiViscosity { largest_viscosity: t.need(&LARGEST)? }),
    }
};

const FLOW_CURVES: Variants<FlowCurve> = Variants {
    what: "flow curve",
    sections: &[
        ("newtonian", "flow curve: stress = viscosity x shear rate", NEWTONIAN),
        (
            "bingham",
            "flow curve: no flow up to the yield stress, then stress = yield stress + plastic viscosity x shear rate",
            BINGHAM,
        ),
        (
            "herschel_bulkley",
            "flow curve: no flow up to the yield stress, then stress = yield stress + consistency x shear rate^index",
            HERSCHEL_BULKLEY,
        ),
        (
            "casson",
            "flow curve: no flow up to the yield stress, then the square roots of stress, yield stress and viscous stress add up",
            CASSON,
        ),
        ("power_law", "flow curve: stress = consistency x shear rate^index", POWER_LAW),
        ("cross", "flow curve: from one viscosity at rest to another at high shear rates (Cross)", CROSS),
        (
            "carreau_yasuda",
            "flow curve: from one viscosity at rest to another at high shear rates (Carreau and Yasuda)",
            CARREAU_YASUDA,
        ),
    ],
};

const YIELD_STRESS: Need<Quantity> = need(
    "yield_stress",
    "stress below which there is no flow",
    quantity(Dimension::STRESS, Bound::NotNegative, "50 Pa"),
);
const CONSISTENCY: Need<Quantity> = need(
    "consistency",
    "factor of the power of the shear rate",
    quantity(Dimension::CONSISTENCY, Bound::Positive, "20 Pa s^n"),
);
const INDEX: Need<Quantity> = need(
    "index",
    "exponent of the shear rate: below 1 the fluid thins when sheared, above it thickens",
    quantity(Dimension::NUMBER, Bound::Positive, "0.5"),
);
const REST_VISCOSITY: Need<Quantity> = need(
    "zero_shear_viscosity",
    "viscosity at rest",
    quantity(Dimension::VISCOSITY, Bound::Positive, "100 Pa s"),
);
const FAST_VISCOSITY: Need<Quantity> = need(
    "infinite_shear_viscosity",
    "viscosity at high shear rates",
    quantity(Dimension::VISCOSITY, Bound::NotNegative, "1 Pa s"),
);
const RELAXATION_TIME: Need<Quantity> =
    need("time", "one over the shear rate at which the viscosity begins to fall", TIME);

const HERSCHEL_BULKLEY: Section<FlowCurve> = Section {
    keys: &[&YIELD_STRESS, &CONSISTENCY, &INDEX],
    example: &["yield_stress = \"50 Pa\"", "consistency = \"20 Pa s^n\"", "index = 0.5"],
    read: |t| {
        Ok(FlowCurve::HerschelBulkley {
            yield_stress: t.need(&YIELD_STRESS)?,
            consistency: t.need(&CONSISTENCY)?,
            index: t.need(&INDEX)?,
        })
    },
};

const CASSON: Section<FlowCurve> = {
    const PLASTIC_VISCOSITY: Need<Quantity> =
        need("plastic_viscosity", "viscosity at high shear rates", VISCOSITY);
    Section {
        keys: &[&YIELD_STRESS, &PLASTIC_VISCOSITY],
        example: &["yield_stress = \"50 Pa\"", "plastic_viscosity = \"30 Pa s\""],
        read: |t| {
            Ok(FlowCurve::Casson {
                yield_stress: t.need(&YIELD_STRESS)?,
                plastic_viscosity: t.need(&PLASTIC_VISCOSITY)?,
            })
        },
    }
};

const POWER_LAW: Section<FlowCurve> = Section {
    keys: &[&CONSISTENCY, &INDEX],
    example: &["consistency = \"20 Pa s^n\"", "index = 0.5"],
    read: |t| Ok(FlowCurve::PowerLaw { consistency: t.need(&CONSISTENCY)?, index: t.need(&INDEX)? }),
};

const CROSS: Section<FlowCurve> = {
    // With a larger one the stress would fall where the shear rate grows.
    const CROSS_INDEX: Need<Quantity> = need(
        "index",
        "how steeply the viscosity falls, at most 1",
        quantity(Dimension::NUMBER, Bound::UpTo(1.0), "0.8"),
    );
    Section {
        keys: &[&REST_VISCOSITY, &FAST_VISCOSITY, &RELAXATION_TIME, &CROSS_INDEX],
        example: &[
            "zero_shear_viscosity = \"100 Pa s\"",
            "infinite_shear_viscosity = \"1 Pa s\"",
            "time = \"1 s\"",
            "index = 0.8",
        ],
        read: |t| {
            Ok(FlowCurve::Cross {
                zero_shear_viscosity: t.need(&REST_VISCOSITY)?,
                infinite_shear_viscosity: t.need(&FAST_VISCOSITY)?,
                time: t.need(&RELAXATION_TIME)?,
                index: t.need(&CROSS_INDEX)?,
            })
        },
    }
};

const CARREAU_YASUDA: Section<FlowCurve> = {
    const TRANSITION: Or<Quantity> = or(
        "transition",
        "2",
        "sharpness of the transition; 2 is the model of Carreau",
        quantity(Dimension::NUMBER, Bound::Positive, "2"),
    );
    Section {
        keys: &[&REST_VISCOSITY, &FAST_VISCOSITY, &RELAXATION_TIME, &INDEX, &TRANSITION],
        example: &[
            "zero_shear_viscosity = \"100 Pa s\"",
            "infinite_shear_viscosity = \"1 Pa s\"",
            "time = \"1 s\"",
            "index = 0.5",
        ],
        read: |t| {
            Ok(FlowCurve::CarreauYasuda {
                zero_shear_viscosity: t.need(&REST_VISCOSITY)?,
                infinite_shear_viscosity: t.need(&FAST_VISCOSITY)?,
                time: t.need(&RELAXATION_TIME)?,
                index: t.need(&INDEX)?,
                transition: t.or(&TRANSITION)?,
            })
        },
    }
};

const NEWTONIAN: Section<FlowCurve> = {
    const KEY: Need<Quantity> = need("viscosity", "viscosity", VISCOSITY);
    Section {
        keys: &[&KEY],
        example: &["viscosity = \"30 Pa s\""],
        read: |t| Ok(FlowCurve::Newtonian { viscosity: t.need(&KEY)? }),
    }
};

const BINGHAM: Section<FlowCurve> = {
    const PLASTIC_VISCOSITY: Need<Quantity> =
        need("plastic_viscosity", "slope of the flow curve above the yield stress", VISCOSITY);
    Section {
        keys: &[&YIELD_STRESS, &PLASTIC_VISCOSITY],
        example: &["yield_stress = \"50 Pa\"", "plastic_viscosity = \"30 Pa s\""],
        read: |t| {
            Ok(FlowCurve::Bingham {
                yield_stress: t.need(&YIELD_STRESS)?,
                plastic_viscosity: t.need(&PLASTIC_VISCOSITY)?,
            })
        },
    }
};

const MIN: Need<Vector<3>> = need("min", "corner with the smallest coordinates", POINT);
const MAX: Need<Vector<3>> = need("max", "corner with the largest coordinates", POINT);
const CORNERS: &[&str] = &["min = [\"0 m\", \"0 m\", \"0 m\"]", "max = [\"0.4 m\", \"0.4 m\", \"0.3 m\"]"];

const DOMAIN: Section<Domain> = {
    const GRAVITY: Or<Vector<3>> = or(
        "gravity",
        "[\"0 m/s2\", \"0 m/s2\", \"-9.81 m/s2\"]",
        "acceleration that drives the flow; z points upwards",
        Vector(quantity(Dimension::ACCELERATION, Bound::Any, "0 m/s2")),
    );
    const SIDES_KEY: Or<Section<[Side; 6]>> = or("sides", "{}", "what bounds the box", SIDES);
    Section {
        keys: &[&MIN, &MAX, &GRAVITY, &SIDES_KEY],
        example: CORNERS,
        read: |t| {
            Ok(Domain {
                min: t.need(&MIN)?.into(),
                max: t.need(&MAX)?.into(),
                gravity: t.or(&GRAVITY)?.into(),
                sides: t.or(&SIDES_KEY)?,
            })
        },
    }
};

/// Keys of the sides in the order of [`Domain::sides`].
pub(crate) const SIDE_KEYS: [&str; 6] = ["x_min", "x_max", "y_min", "y_max", "z_min", "z_max"];

const SIDES: Section<[Side; 6]> = {
    const fn side(number: usize) -> Or<WordOr<Side>> {
        or(SIDE_KEYS[number], "\"wall\"", "what bounds the box on this side", SIDE)
    }
    const KEYS: [Or<WordOr<Side>>; 6] = [side(0), side(1), side(2), side(3), side(4), side(5)];
    Section {
        keys: &[&KEYS],
        example: &["x_min = \"symmetry\""],
        read: |t| {
            let mut sides = [Side::REST; 6];
            for (side, key) in sides.iter_mut().zip(&KEYS) {
                *side = t.or(key)?;
            }
            Ok(sides)
        },
    }
};

const SIDE: WordOr<Side> = WordOr {
    words: Choice(&[
        ("wall", "a wall to which the fluid sticks", Side::REST),
        ("symmetry", "a plane of symmetry", Side::Symmetry),
        ("periodic", "what leaves here enters on the opposite side", Side::Periodic),
        ("open", "fluid that gets here leaves, into air", Side::Open),
    ]),
    table: {
        const VELOCITY: Or<Vector<3>> = or(
            "velocity",
            "[\"0 m/s\", \"0 m/s\", \"0 m/s\"]",
            "velocity of the wall, within its own plane",
            MOTION,
        );
        const SURFACE_KEY: Or<WordOr<Surface>> =
            or("surface", "\"no_slip\"", "what the wall does to the fluid", SURFACE);
        Section {
            keys: &[&VELOCITY, &SURFACE_KEY],
            example: &["velocity = [\"0.1 m/s\", \"0 m/s\", \"0 m/s\"]"],
            read: |t| Ok(Side::Wall { velocity: t.or(&VELOCITY)?.into(), surface: t.or(&SURFACE_KEY)? }),
        }
    },
};

const SURFACE: WordOr<Surface> = WordOr {
    words: Choice(&[
        ("no_slip", "the fluid sticks to it", Surface::NoSlip),
        ("free_slip", "the fluid slides along it without friction", Surface::FreeSlip),
    ]),
    table: Section {
        keys: &[&FRICTIONS],
        example: &["navier = { slip_length = \"80 mm\" }"],
        read: |t| t.one_of(&FRICTIONS),
    },
};

const FRICTIONS: Variants<Surface> = Variants {
    what: "law",
    sections: &[
        ("navier", "law: it slides faster the faster it is sheared there", NAVIER),
        (
            "film",
            "law: it sticks up to a stress, and beyond it slides on a thin film, as concrete does in pipes",
            FILM,
        ),
    ],
};

const NAVIER: Section<Surface> = {
    const SLIP_LENGTH: Need<Quantity> =
        need("slip_length", "how far beyond the surface the fluid would come to rest", LENGTH_OR_ZERO);
    Section {
        keys: &[&SLIP_LENGTH],
        example: &["slip_length = \"80 mm\""],
        read: |t| {
            let slip_length = t.need(&SLIP_LENGTH)?;
            Ok(if slip_length > 0.0 { Surface::Navier { slip_length } } else { Surface::NoSlip })
        },
    }
};

const FILM: Section<Surface> = {
    const WALL_YIELD_STRESS: Need<Quantity> = need(
        "wall_yield_stress",
        "stress up to which the fluid sticks",
        quantity(Dimension::STRESS, Bound::NotNegative, "5 Pa"),
    );
    const WALL_VISCOSITY: Need<Quantity> = need(
        "wall_viscosity",
        "what the stress grows by with the speed at which the fluid slides",
        quantity(Dimension::FILM_VISCOSITY, Bound::Positive, "300 Pa s/m"),
    );
    Section {
        keys: &[&WALL_YIELD_STRESS, &WALL_VISCOSITY],
        example: &["wall_yield_stress = \"5 Pa\"", "wall_viscosity = \"300 Pa s/m\""],
        read: |t| {
            let (yield_stress, viscosity) = (t.need(&WALL_YIELD_STRESS)?, t.need(&WALL_VISCOSITY)?);
            Ok(Surface::Film { yield_stress, viscosity })
        },
    }
};

const FLUID: Section<FluidRegion> = {
    const VELOCITY: Or<Vector<3>> =
        or("velocity", "[\"0 m/s\", \"0 m/s\", \"0 m/s\"]", "velocity at the start", MOTION);
    Section {
        keys: &[&VELOCITY, &BATCH, &STRUCTURE, &SHAPES],
        example: &["sphere = { centre = [\"0.2 m\", \"0.2 m\", \"0.1 m\"], diameter = \"100 mm\" }"],
        read: |t| {
            Ok(FluidRegion {
                shape: t.one_of(&SHAPES)?,
                velocity: t.or(&VELOCITY)?.into(),
                batch: t.maybe(&BATCH)?,
                structure: t.maybe(&STRUCTURE)?,
            })
        },
    }
};

pub(crate) const BATCH: Maybe<Text> = maybe(
    "batch",
    "name of the batch that this is, which is then followed through the flow; several may share one",
    Text { example: "first" },
);

const STRUCTURE: Maybe<Quantity> = maybe(
    "structure",
    "structure of this fluid, if another than `material.thixotropy` says",
    quantity(Dimension::NUMBER, Bound::NotNegative, "0.5"),
);

const INLET: Section<Inlet> = {
    const FLOW_RATE: Maybe<Quantity> = maybe(
        "flow_rate",
        "volume that comes through the whole face in a time",
        quantity(Dimension::FLOW_RATE, Bound::Positive, "1 l/s"),
    );
    const INFLOW_SPEED: Maybe<Quantity> = maybe("speed", "speed of the fluid, across the face", SPEED);
    const RATE: Rule = Rule("oneOf", &["flow_rate", "speed"]);
    const START: Or<Quantity> =
        or("start", "\"0 s\"", "when it begins", quantity(Dimension::TIME, Bound::NotNegative, "1 s"));
    const END: Maybe<Quantity> = maybe("stop", "when it ends, if not before", TIME);
    const VOLUME: Maybe<Quantity> = maybe(
        "volume",
        "volume through the whole face after which it ends",
        quantity(Dimension::VOLUME, Bound::Positive, "20 l"),
    );
    const MOTION_KEY: Maybe<Section<Motion>> =
        maybe("motion", "how the face moves; it rests if this is absent", MOTIONS);
    const ABOVE_FILL_KEY: Maybe<Section<AboveFill>> = maybe(
        "above_fill",
        "draws the face straight up as the fill rises, instead of a motion; it never goes down",
        ABOVE_FILL,
    );
    const INCLUSIONS: Maybe<List<Section<Incoming>>> =
        maybe("inclusions", "aggregates and fibres that come in with the fluid", List(inclusions::INCOMING));
    Section {
        keys: &[
            &FACES,
            &FLOW_RATE,
            &INFLOW_SPEED,
            &RATE,
            &START,
            &END,
            &VOLUME,
            &MOTION_KEY,
            &ABOVE_FILL_KEY,
            &BATCH,
            &STRUCTURE,
            &INCLUSIONS,
        ],
        example: &[
            "disc = { centre = [\"0.2 m\", \"0.2 m\", \"0.25 m\"], direction = [0, 0, -1], diameter = \"80 mm\" }",
            "flow_rate = \"1 l/s\"",
        ],
        read: |t| {
            let face = t.one_of(&FACES)?;
            let flow_rate = match (t.maybe(&FLOW_RATE)?, t.maybe(&INFLOW_SPEED)?) {
                (Some(rate), None) => rate,
                (None, Some(speed)) => speed * face.area(),
                (None, None) => {
                    let help = "add flow_rate = \"1 l/s\", say, or a speed";
                    return Err(t.itself().fault("does not say how much comes in", "").help(help));
                }
                (Some(_), Some(_)) => {
                    let speed = t.value("speed").unwrap_or_else(|| t.itself());
                    return Err(speed.fault("says again what the flow rate says", "keep only one of them"));
                }
            };
            Ok(Inlet {
                face,
                flow_rate,
                motion: t.maybe(&MOTION_KEY)?.unwrap_or(Motion::REST),
                above_fill: t.maybe(&ABOVE_FILL_KEY)?,
                start: t.or(&START)?,
                stop: t.maybe(&END)?.unwrap_or(f64::INFINITY),
                volume: t.maybe(&VOLUME)?.unwrap_or(f64::INFINITY),
                batch: t.maybe(&BATCH)?,
                structure: t.maybe(&STRUCTURE)?,
                inclusions: t.maybe(&INCLUSIONS)?.unwrap_or_default(),
            })
        },
    }
};

const ABOVE_FILL: Section<AboveFill> = {
    const DISTANCE: Need<Quantity> =
        need("distance", "height of the face's lowest point above the level around it", LENGTH);
    const RISE: Or<Quantity> = or("speed", "\"50 mm/s\"", "largest speed at which it rises", SPEED);
    Section {
        keys: &[&DISTANCE, &RISE],
        example: &["distance = \"100 mm\""],
        read: |t| Ok(AboveFill { distance: t.need(&DISTANCE)?, speed: t.or(&RISE)? }),
    }
};

const FACES: Variants<Face> = Variants {
    what: "face",
    sections: &[("disc", "face: a disc", DISC), ("rectangle", "face: a rectangle", RECTANGLE)],
};

const MIDDLE: Need<Vector<3>> = need("centre", "its middle", POINT);
const DIRECTION: Need<Vector<3>> = need(
    "direction",
    "where the fluid goes, across the face",
    Vector(quantity(Dimension::NUMBER, Bound::Any, "1")),
);

const DISC: Section<Face> = Section {
    keys: &[&MIDDLE, &DIRECTION, &DIAMETER],
    example: &[
        "centre = [\"0.2 m\", \"0.2 m\", \"0.25 m\"]",
        "direction = [0, 0, -1]",
        "diameter = \"80 mm\"",
    ],
    read: |t| {
        Ok(Face {
            centre: t.need(&MIDDLE)?.into(),
            // Zero where there is no direction, which `check` refuses.
            direction: DVec3::from(t.need(&DIRECTION)?).normalize_or_zero(),
            outline: Outline::Disc { radius: 0.5 * t.need(&DIAMETER)? },
        })
    },
};

const RECTANGLE: Section<Face> = {
    const SIZE: Need<Vector<2>> = need(
        "size",
        "its sides, the first along x where it looks straight up or down, and else horizontal",
        Vector(LENGTH),
    );
    Section {
        keys: &[&MIDDLE, &DIRECTION, &SIZE],
        example: &[
            "centre = [\"0.2 m\", \"0.2 m\", \"0.25 m\"]",
            "direction = [0, 0, -1]",
            "size = [\"80 mm\", \"60 mm\"]",
        ],
        read: |t| {
            Ok(Face {
                centre: t.need(&MIDDLE)?.into(),
                direction: DVec3::from(t.need(&DIRECTION)?).normalize_or_zero(),
                outline: Outline::Rectangle { size: t.need(&SIZE)? },
            })
        },
    }
};

const OUTLET: Section<Outlet> = {
    const WHERE: Need<Section<Outlet>> = need(
        "box",
        "a box in which fluid leaves",
        Section {
            keys: &[&MIN, &MAX],
            example: CORNERS,
            read: |t| Ok(Outlet { min: t.need(&MIN)?.into(), max: t.need(&MAX)?.into() }),
        },
    );
    Section {
        keys: &[&WHERE],
        example: &["box = { min = [\"0.3 m\", \"0 m\", \"0 m\"], max = [\"0.4 m\", \"0.1 m\", \"0.3 m\"] }"],
        read: |t| t.need(&WHERE),
    }
};

pub(crate) const SHAPES: Variants<Shape> = Variants {
    what: "shape",
    sections: &[
        ("box", "shape: a box with edges along the axes", BOX),
        ("sphere", "shape: a sphere", SPHERE),
        ("cone", "shape: an upright cone, or a frustum of one", CONE),
        ("cylinder", "shape: a cylinder without ends, cut off by the domain", CYLINDER),
    ],
};

pub(crate) const DIAMETER: Need<Quantity> = need("diameter", "diameter", LENGTH);

const BOX: Section<Shape> = Section {
    keys: &[&MIN, &MAX],
    example: CORNERS,
    read: |t| Ok(Shape::Box { min: t.need(&MIN)?.into(), max: t.need(&MAX)?.into() }),
};

const SPHERE: Section<Shape> = {
    const CENTRE: Need<Vector<3>> = need("centre", "centre", POINT);
    Section {
        keys: &[&CENTRE, &DIAMETER],
        example: &["centre = [\"0.2 m\", \"0.2 m\", \"0.1 m\"]", "diameter = \"100 mm\""],
        read: |t| Ok(Shape::Sphere { centre: t.need(&CENTRE)?.into(), radius: 0.5 * t.need(&DIAMETER)? }),
    }
};

const CONE: Section<Shape> = {
    const BASE: Need<Vector<3>> = need("base", "centre of the lower end", POINT);
    const BASE_DIAMETER: Need<Quantity> =
        need("base_diameter", "diameter of the lower end, zero for a point", LENGTH_OR_ZERO);
    const TOP_DIAMETER: Need<Quantity> =
        need("top_diameter", "diameter of the upper end, zero for a point", LENGTH_OR_ZERO);
    const HEIGHT: Need<Quantity> = need("height", "height", LENGTH);
    Section {
        keys: &[&BASE, &BASE_DIAMETER, &TOP_DIAMETER, &HEIGHT],
        example: &[
            "base = [\"0.2 m\", \"0.2 m\", \"0 m\"]",
            "base_diameter = \"200 mm\"",
            "top_diameter = \"100 mm\"",
            "height = \"300 mm\"",
        ],
        read: |t| {
            Ok(Shape::Cone {
                base: t.need(&BASE)?.into(),
                base_radius: 0.5 * t.need(&BASE_DIAMETER)?,
                top_radius: 0.5 * t.need(&TOP_DIAMETER)?,
                height: t.need(&HEIGHT)?,
            })
        },
    }
};

const CYLINDER: Section<Shape> = {
    const ON_AXIS: Need<Vector<3>> = need("point", "a point on the axis", POINT);
    const AXIS: Need<Vector<3>> =
        need("axis", "direction of the axis", Vector(quantity(Dimension::NUMBER, Bound::Any, "1")));
    Section {
        keys: &[&ON_AXIS, &AXIS, &DIAMETER],
        example: &["point = [\"0.2 m\", \"0 m\", \"0 m\"]", "axis = [0, 1, 0]", "diameter = \"100 mm\""],
        read: |t| {
            Ok(Shape::Cylinder {
                point: t.need(&ON_AXIS)?.into(),
                // Zero where there is no direction, which `check` refuses.
                axis: DVec3::from(t.need(&AXIS)?).normalize_or_zero(),
                radius: 0.5 * t.need(&DIAMETER)?,
            })
        },
    }
};

const CAPSULE: Section<Shape> = {
    const START: Need<Vector<3>> = need("start", "centre of one round end", POINT);
    const END: Need<Vector<3>> = need("end", "centre of the other", POINT);
    Section {
        keys: &[&START, &END, &DIAMETER],
        example: &[
            "start = [\"0.2 m\", \"0.2 m\", \"0.1 m\"]",
            "end = [\"0.2 m\", \"0.2 m\", \"0.3 m\"]",
            "diameter = \"50 mm\"",
        ],
        read: |t| {
            Ok(Shape::Capsule {
                start: t.need(&START)?.into(),
                end: t.need(&END)?.into(),
                radius: 0.5 * t.need(&DIAMETER)?,
            })
        },
    }
};

const BAR: Section<Shape> = {
    const START: Need<Vector<3>> = need("start", "centre of one end", POINT);
    const END: Need<Vector<3>> = need("end", "centre of the other", POINT);
    Section {
        keys: &[&START, &END, &DIAMETER],
        example: &[
            "start = [\"0.1 m\", \"0.2 m\", \"0 m\"]",
            "end = [\"0.1 m\", \"0.2 m\", \"0.3 m\"]",
            "diameter = \"12 mm\"",
        ],
        read: |t| {
            let (start, end) = (t.need(&START)?.into(), t.need(&END)?.into());
            let radius = 0.5 * t.need(&DIAMETER)?;
            no_length([start, end], t)?;
            Ok(Shape::Bar { start, end, radius })
        },
    }
};

/// Refuses a bar whose ends are the same point.
fn no_length([start, end]: [DVec3; 2], t: &Table<'_>) -> Result<(), Fault> {
    if start == end {
        let value = t.value("end").unwrap_or_else(|| t.itself());
        return Err(value.fault("is where the bar starts", "write another point"));
    }
    Ok(())
}

const PLANE: Section<Shape> = {
    const ON_PLANE: Need<Vector<3>> = need("point", "a point of the plane", POINT);
    const NORMAL: Need<Vector<3>> = need(
        "normal",
        "direction out of the solid, across the plane",
        Vector(quantity(Dimension::NUMBER, Bound::Any, "1")),
    );
    Section {
        keys: &[&ON_PLANE, &NORMAL],
        example: &["point = [\"0 m\", \"0 m\", \"0 m\"]", "normal = [-1, 0, 5]"],
        read: |t| {
            Ok(Shape::HalfSpace {
                point: t.need(&ON_PLANE)?.into(),
                // Zero where there is no direction, which `check` refuses.
                normal: DVec3::from(t.need(&NORMAL)?).normalize_or_zero(),
            })
        },
    }
};

const CONE_SHELL: Section<Shape> = {
    const BASE: Need<Vector<3>> = need("base", "centre of the lower end", POINT);
    const BASE_DIAMETER: Need<Quantity> =
        need("base_diameter", "inner diameter of the lower end", LENGTH_OR_ZERO);
    const TOP_DIAMETER: Need<Quantity> =
        need("top_diameter", "inner diameter of the upper end", LENGTH_OR_ZERO);
    const HEIGHT: Need<Quantity> = need("height", "height", LENGTH);
    const THICKNESS: Need<Quantity> = need("thickness", "thickness of the wall, outwards", LENGTH);
    Section {
        keys: &[&BASE, &BASE_DIAMETER, &TOP_DIAMETER, &HEIGHT, &THICKNESS],
        example: &[
            "base = [\"0 m\", \"0 m\", \"0 m\"]",
            "base_diameter = \"200 mm\"",
            "top_diameter = \"100 mm\"",
            "height = \"300 mm\"",
            "thickness = \"10 mm\"",
        ],
        read: |t| {
            Ok(Shape::ConeShell {
                base: t.need(&BASE)?.into(),
                base_radius: 0.5 * t.need(&BASE_DIAMETER)?,
                top_radius: 0.5 * t.need(&TOP_DIAMETER)?,
                height: t.need(&HEIGHT)?,
                thickness: t.need(&THICKNESS)?,
            })
        },
    }
};

const DRAWING_UNIT: Need<Choice<f64>> = need(
    "unit",
    "in which the file is drawn; it does not say so itself",
    Choice(&[
        ("mm", "millimetres", 1e-3),
        ("cm", "centimetres", 1e-2),
        ("m", "metres", 1.0),
        ("in", "inches of 25.4 mm", 0.0254),
    ]),
);

const STL: Section<Body> = {
    const FILE: Need<Text> = need(
        "file",
        "the file, binary or ASCII, by its path from the case file: beside it or in a folder below",
        Text { example: "form.stl" },
    );
    const ROLE: Or<Choice<Role>> = or(
        "role",
        "\"obstacle\"",
        "which side of its surface is solid",
        Choice(&[
            ("obstacle", "the inside", Role::Obstacle),
            ("formwork", "the outside, without end: the fluid is inside", Role::Formwork),
        ]),
    );
    const SCALE: Or<Quantity> = or(
        "scale",
        "1",
        "how many times larger it is made",
        quantity(Dimension::NUMBER, Bound::UpTo(1e6), "2"),
    );
    const ROTATE: Or<Vector<3>> = or(
        "rotate",
        "[\"0 deg\", \"0 deg\", \"0 deg\"]",
        "angles by which it is then turned about the axes of x, y and z, one after the other",
        Vector(quantity(Dimension::NUMBER, Bound::Any, "\"90 deg\"")),
    );
    const MOVE: Or<Vector<3>> =
        or("move", "[\"0 m\", \"0 m\", \"0 m\"]", "way by which it is then moved", POINT);
    Section {
        keys: &[&FILE, &DRAWING_UNIT, &ROLE, &SCALE, &ROTATE, &MOVE],
        example: &["file = \"form.stl\"", "unit = \"mm\""],
        read: |t| {
            let path = t.need(&FILE)?;
            let (unit, _, length) = t.need(&DRAWING_UNIT)?;
            let (.., role) = t.or(&ROLE)?;
            let (scale, rotate, way) = (t.or(&SCALE)?, t.or(&ROTATE)?, t.or(&MOVE)?);
            // Three plain numbers are radians, and who writes 90 means degrees.
            if let Some(value) = t.value("rotate")
                && rotate.iter().any(|angle| angle.abs() > TAU)
            {
                return Err(value.fault("is more than a full turn", "write degrees as \"90 deg\""));
            }
            let place = Place { unit, length: *length, scale, rotate, way: way.into() };
            stl::read(&t.value("file").unwrap_or_else(|| t.itself()), path, *role, &place)
        },
    }
};

/// A section for a shape as one for a body.
macro_rules! body {
    ($shape:ident) => {
        Section { keys: $shape.keys, example: $shape.example, read: |t| Ok(Body::Shape(($shape.read)(t)?)) }
    };
}

/// The shapes of solids, and further ones.
macro_rules! solid_shapes {
    ($($more:expr),*) => {
        &[
            ("box", "shape: a box with edges along the axes", body!(BOX)),
            ("sphere", "shape: a sphere", body!(SPHERE)),
            ("cone", "shape: an upright cone, or a frustum of one", body!(CONE)),
            ("cylinder", "shape: a cylinder without ends", body!(CYLINDER)),
            ("capsule", "shape: a cylinder with round ends", body!(CAPSULE)),
            ("bar", "shape: a cylinder with flat ends", body!(BAR)),
            ("plane", "shape: all that lies behind a plane", body!(PLANE)),
            ("cone_shell", "shape: the wall of an upright conical mould, open at both ends", body!(CONE_SHELL)),
            ("stl", "shape: what an STL file draws", STL),
            $($more),*
        ]
    };
}

/// What the readings of a solid are called.
const NAME: Maybe<Name> = maybe(
    "name",
    "what its columns of series.csv are called; after its number, as solid1, if this is absent",
    Name { example: "gate" },
);

const SOLID: Section<Solid> = {
    const MOTION_KEY: Maybe<Section<Moved>> =
        maybe("motion", "how it moves, or what moves it; it rests if this is absent", SOLID_MOTIONS);
    const SURFACE_KEY: Maybe<WordOr<Surface>> = maybe(
        "surface",
        "what its surface does to the fluid; free_slip for a cone_shell if absent, no_slip for all others",
        SURFACE,
    );
    Section {
        keys: &[&NAME, &SOLID_SHAPES, &MOTION_KEY, &SURFACE_KEY],
        example: &["box = { min = [\"0.2 m\", \"0 m\", \"0 m\"], max = [\"0.22 m\", \"0.1 m\", \"0.3 m\"] }"],
        read: |t| {
            let body = t.one_of(&SOLID_SHAPES)?;
            // To a mould that is lifted concrete must not stick: it would carry off several per cent as a film.
            let usual = match &body {
                Body::Shape(Shape::ConeShell { .. }) => Surface::FreeSlip,
                _ => Surface::NoSlip,
            };
            let surface = t.maybe(&SURFACE_KEY)?.unwrap_or(usual);
            let name = t.maybe(&NAME)?.unwrap_or_default();
            let (motion, load) = match t.maybe(&MOTION_KEY)? {
                None => (Motion::REST, None),
                Some(Moved::Prescribed(motion)) => (motion, None),
                Some(Moved::ByLoad(load)) => (Motion::REST, Some(load)),
            };
            Ok(Solid { name, body, motion, load, surface })
        },
    }
};

const SOLID_SHAPES: Variants<Body> = Variants {
    what: "shape",
    sections: solid_shapes!(
        ("difference", "shape: one from which others are cut", DIFFERENCE),
        ("union", "shape: several as one", UNION)
    ),
};

const PART: Section<Body> = {
    const SHAPES: Variants<Body> = Variants { what: "shape", sections: solid_shapes!() };
    Section {
        keys: &[&SHAPES],
        example: &[
            "cylinder = { point = [\"0.2 m\", \"0 m\", \"0 m\"], axis = [0, 1, 0], diameter = \"100 mm\" }",
        ],
        read: |t| t.one_of(&SHAPES),
    }
};

const UNION: Section<Body> = {
    const PARTS: Need<List<Section<Body>>> = need("of", "the shapes", List(PART));
    Section {
        keys: &[&PARTS],
        example: &["of = [{ sphere = { centre = [\"0 m\", \"0 m\", \"0 m\"], diameter = \"100 mm\" } }]"],
        read: |t| Ok(Body::Union(Union::new(t.need(&PARTS)?))),
    }
};

const DIFFERENCE: Section<Body> = {
    const FROM: Need<Section<Body>> = need("from", "the shape that is cut", PART);
    const WITHOUT: Need<List<Section<Body>>> = need("without", "the shapes that are cut from it", List(PART));
    Section {
        keys: &[&FROM, &WITHOUT],
        example: &[
            "from = { box = { min = [\"0.2 m\", \"0 m\", \"0 m\"], max = [\"0.22 m\", \"0.1 m\", \"0.3 m\"] } }",
            "without = [{ sphere = { centre = [\"0.21 m\", \"0.05 m\", \"0.1 m\"], diameter = \"50 mm\" } }]",
        ],
        read: |t| {
            let without = Body::Union(Union::new(t.need(&WITHOUT)?));
            Ok(Body::Difference(Box::new([t.need(&FROM)?, without])))
        },
    }
};

const BARS: Section<Solid> = Section {
    keys: &[&NAME, &BAR_SOURCES],
    example: &[
        "grid = { start = [\"0.1 m\", \"0.2 m\", \"0 m\"], end = [\"0.1 m\", \"0.2 m\", \"0.3 m\"], diameter = \"12 mm\", spacing = [\"50 mm\", \"0 m\", \"0 m\"], count = [3, 1, 1] }",
    ],
    read: |t| {
        Ok(Solid {
            name: t.maybe(&NAME)?.unwrap_or_default(),
            body: t.one_of(&BAR_SOURCES)?,
            motion: Motion::REST,
            load: None,
            surface: Surface::NoSlip,
        })
    },
};

const BAR_SOURCES: Variants<Body> = Variants {
    what: "bars",
    sections: &[
        ("list", "bars: one by one", BAR_LIST),
        ("grid", "bars: one that is repeated along the axes", BAR_GRID),
        ("csv", "bars: those of a CSV file", BAR_FILE),
    ],
};

const BAR_LIST: Section<Body> = {
    const PARTS: Need<List<Section<Shape>>> = need("of", "the bars", List(BAR));
    Section {
        keys: &[&PARTS],
        example: &[
            "of = [{ start = [\"0.1 m\", \"0.2 m\", \"0 m\"], end = [\"0.1 m\", \"0.2 m\", \"0.3 m\"], diameter = \"12 mm\" }]",
        ],
        read: |t| Ok(bars::body(t.need(&PARTS)?)),
    }
};

const BAR_GRID: Section<Body> = {
    const START: Need<Vector<3>> = need("start", "centre of one end of the first bar", POINT);
    const END: Need<Vector<3>> = need("end", "centre of its other end", POINT);
    const SPACING: Need<Vector<3>> =
        need("spacing", "distance between axes of bars, along each axis of coordinates", POINT);
    const COUNT: Need<Vector<3>> = need(
        "count",
        "number of bars along each axis of coordinates, all together no more than 100000",
        Vector(quantity(Dimension::NUMBER, Bound::UpTo(MOST_BARS), "1")),
    );
    const MOST_BARS: f64 = 1e5;
    Section {
        keys: &[&START, &END, &DIAMETER, &SPACING, &COUNT],
        example: &[
            "start = [\"0.1 m\", \"0.2 m\", \"0 m\"]",
            "end = [\"0.1 m\", \"0.2 m\", \"0.3 m\"]",
            "diameter = \"12 mm\"",
            "spacing = [\"50 mm\", \"0 m\", \"0 m\"]",
            "count = [3, 1, 1]",
        ],
        read: |t| {
            let ends = [t.need(&START)?.into(), t.need(&END)?.into()];
            let (radius, spacing) = (0.5 * t.need(&DIAMETER)?, t.need(&SPACING)?.into());
            let count = t.need(&COUNT)?;
            no_length(ends, t)?;
            let whole = count.iter().all(|n| n.fract() == 0.0);
            if !whole || count.iter().product::<f64>() > MOST_BARS {
                let value = t.value("count").unwrap_or_else(|| t.itself());
                let problem = "must be whole numbers, all together no more than 100000 bars";
                return Err(value.fault(problem, "write [3, 1, 1], say"));
            }
            Ok(bars::body(bars::grid(ends, radius, spacing, count.map(|n| n as usize))))
        },
    }
};

const BAR_FILE: Section<Body> = {
    const FILE: Need<Text> = need(
        "file",
        "path of the file from the folder of the case file; columns x1,y1,z1,x2,y2,z2,diameter, a line for each bar",
        Text { example: "cage.csv" },
    );
    Section {
        keys: &[&FILE, &DRAWING_UNIT],
        example: &["file = \"cage.csv\"", "unit = \"mm\""],
        read: |t| {
            let path = t.need(&FILE)?;
            let (.., length) = t.need(&DRAWING_UNIT)?;
            bars::read(&t.value("file").unwrap_or_else(|| t.itself()), &path, *length)
        },
    }
};

const CAGE: Section<Cage> = {
    const LAYERS: Need<List<Section<Layer>>> =
        need("layers", "its bars: a layer for each direction; their drags add up", List(LAYER));
    Section {
        keys: &[&NAME, &SOLID_SHAPES, &LAYERS],
        example: &[
            "box = { min = [\"0.2 m\", \"0 m\", \"0 m\"], max = [\"0.3 m\", \"0.4 m\", \"0.3 m\"] }",
            "layers = [{ direction = [0, 0, 1], diameter = \"12 mm\", spacing = \"100 mm\" }]",
        ],
        read: |t| {
            Ok(Cage {
                name: t.maybe(&NAME)?.unwrap_or_default(),
                body: t.one_of(&SOLID_SHAPES)?,
                layers: t.need(&LAYERS)?,
            })
        },
    }
};

const ANY_DIRECTION: Vector<3> = Vector(quantity(Dimension::NUMBER, Bound::Any, "1"));

const LAYER: Section<Layer> = {
    const STRAIGHT: Maybe<Vector<3>> = maybe("direction", "direction of straight bars", ANY_DIRECTION);
    const HOOPS: Maybe<Section<Course>> =
        maybe("around", "of hoops or a spiral instead: the axis that they go round", AXIS_OF_HOOPS);
    const COURSE: Rule = Rule("oneOf", &["direction", "around"]);
    const SPACING: Need<Quantity> = need(
        "spacing",
        "distance between axes of bars that stand on a square grid, at least twice the diameter; for others, the root of \
         the area for each",
        LENGTH,
    );
    Section {
        keys: &[&STRAIGHT, &HOOPS, &COURSE, &DIAMETER, &SPACING],
        example: &["direction = [0, 0, 1]", "diameter = \"12 mm\"", "spacing = \"100 mm\""],
        read: |t| {
            let course = match (t.maybe(&STRAIGHT)?, t.maybe(&HOOPS)?) {
                // Zero where there is no direction, which `check` refuses.
                (Some(direction), None) => Course::Straight(DVec3::from(direction).normalize_or_zero()),
                (None, Some(hoops)) => hoops,
                (None, None) => {
                    let help = "add direction = [0, 0, 1], say";
                    return Err(t.itself().fault("does not say which way the bars go", "").help(help));
                }
                (Some(_), Some(_)) => {
                    let around = t.value("around").unwrap_or_else(|| t.itself());
                    return Err(around.fault("says again which way the bars go", "keep only one of them"));
                }
            };
            let (diameter, spacing) = (t.need(&DIAMETER)?, t.need(&SPACING)?);
            if spacing < CLOSEST * diameter {
                let value = t.value("spacing").unwrap_or_else(|| t.itself());
                let advice = format!(
                    "write \"{} m\" at least, or use [[bars]] and cells that see them",
                    CLOSEST * diameter
                );
                return Err(value.fault("is less than two diameters, too little for a cage", advice));
            }
            Ok(Layer { course, grid: BarGrid::new(diameter, spacing) })
        },
    }
};

const AXIS_OF_HOOPS: Section<Course> = {
    const ON_AXIS: Need<Vector<3>> = need("point", "a point on the axis", POINT);
    const AXIS: Need<Vector<3>> = need("axis", "direction of the axis", ANY_DIRECTION);
    Section {
        keys: &[&ON_AXIS, &AXIS],
        example: &["point = [\"0.5 m\", \"0.5 m\", \"0 m\"]", "axis = [0, 0, 1]"],
        read: |t| {
            let (point, axis) = (t.need(&ON_AXIS)?.into(), DVec3::from(t.need(&AXIS)?));
            Ok(Course::Around { point, axis: axis.normalize_or_zero() })
        },
    }
};

const MOTIONS: Section<Motion> = Section {
    keys: &[&MOTION_KINDS],
    example: &["velocity = [\"0 m/s\", \"0 m/s\", \"0.15 m/s\"]"],
    read: |t| t.one_of(&MOTION_KINDS),
};

/// How a solid comes to move.
enum Moved {
    Prescribed(Motion),
    ByLoad(Load),
}

const SOLID_MOTIONS: Section<Moved> = Section {
    keys: &[&SOLID_MOTION_KINDS],
    example: &["uniform = { velocity = [\"0 m/s\", \"0 m/s\", \"0.15 m/s\"] }"],
    read: |t| t.one_of(&SOLID_MOTION_KINDS),
};

const SOLID_MOTION_KINDS: Variants<Moved> = {
    const PRESCRIBED_UNIFORM: Section<Moved> = Section {
        keys: UNIFORM.keys,
        example: UNIFORM.example,
        read: |t| Ok(Moved::Prescribed((UNIFORM.read)(t)?)),
    };
    const PRESCRIBED_PATH: Section<Moved> =
        Section { keys: PATH.keys, example: PATH.example, read: |t| Ok(Moved::Prescribed((PATH.read)(t)?)) };
    const LOAD: Section<Moved> = {
        const FORCE: Need<Vector<3>> =
            need("force", "the force, along an axis: the solid goes along it, without turning", FORCE_VECTOR);
        const MASS: Or<Quantity> = or(
            "mass",
            "\"0 kg\"",
            "mass of the solid, whose weight acts besides; without any it is as fast as lets the fluid bear the load",
            quantity(Dimension::MASS, Bound::NotNegative, "2 kg"),
        );
        Section {
            keys: &[&FORCE, &MASS],
            example: &["force = [\"0 N\", \"0 N\", \"-10 N\"]"],
            read: |t| Ok(Moved::ByLoad(Load { force: t.need(&FORCE)?.into(), mass: t.or(&MASS)? })),
        }
    };
    Variants {
        what: "motion",
        sections: &[
            ("uniform", "motion: always with the same velocity", PRESCRIBED_UNIFORM),
            (
                "path",
                "motion: straight from point to point, at rest before the first and after the last",
                PRESCRIBED_PATH,
            ),
            ("load", "motion: moved by a force against what the fluid does", LOAD),
        ],
    }
};

const MOTION_KINDS: Variants<Motion> = Variants {
    what: "motion",
    sections: &[
        ("uniform", "motion: always with the same velocity", UNIFORM),
        ("path", "motion: straight from point to point, at rest before the first and after the last", PATH),
    ],
};

const UNIFORM: Section<Motion> = {
    const VELOCITY: Need<Vector<3>> = need("velocity", "the velocity, from the start on", MOTION);
    Section {
        keys: &[&VELOCITY],
        example: &["velocity = [\"0 m/s\", \"0 m/s\", \"0.15 m/s\"]"],
        read: |t| Ok(Motion::Uniform(t.need(&VELOCITY)?.into())),
    }
};

const PATH: Section<Motion> = {
    const POINTS: Need<List<Section<Waypoint>>> =
        need("points", "the points, in the order of time", List(WAYPOINT));
    Section {
        keys: &[&POINTS],
        example: &["points = [{ time = \"1 s\", offset = [\"0 m\", \"0 m\", \"0.3 m\"] }]"],
        read: |t| Ok(Motion::Path(t.need(&POINTS)?)),
    }
};

const WAYPOINT: Section<Waypoint> = {
    const AT: Need<Quantity> =
        need("time", "simulated time", quantity(Dimension::TIME, Bound::NotNegative, "1 s"));
    const OFFSET: Need<Vector<3>> = need("offset", "way from where the solid is drawn", POINT);
    Section {
        keys: &[&AT, &OFFSET],
        example: &["time = \"1 s\"", "offset = [\"0 m\", \"0 m\", \"0.3 m\"]"],
        read: |t| Ok(Waypoint { time: t.need(&AT)?, offset: t.need(&OFFSET)?.into() }),
    }
};

const METHOD: Switch<Method> = Switch {
    name: "method",
    about: "how the flow is computed; its settings stand in a section of the same name",
    sections: &[
        ("lbm", "free-surface lattice Boltzmann", LBM),
        ("isph", "incompressible smoothed particle hydrodynamics", ISPH),
        ("sph", "smoothed particle hydrodynamics in three steps, with wall particles", SPH),
        ("ldd", "Lagrangian differencing dynamics", LDD),
    ],
};

const LDD: Section<Method> = {
    const SPACING: Need<Quantity> =
        need("spacing", "distance of nodes", quantity(Dimension::LENGTH, Bound::Positive, "5 mm"));
    const COURANT: Or<Quantity> = or(
        "courant",
        "0.3",
        "limit of the time step: how far a node may go in it, over the spacing",
        quantity(Dimension::NUMBER, Bound::UpTo(2.0), "0.3"),
    );
    const TIME_STEP: Maybe<Quantity> =
        maybe("time_step", "longest step; if absent, as long as the flow allows", TIME);
    const COUPLING: Or<Choice<LddCoupling>> = or(
        "coupling",
        "\"incremental\"",
        "in which order pressure and velocity are found",
        Choice(&[
            (
                "incremental",
                "velocities under the old pressure, and then what it must be besides",
                LddCoupling::Incremental,
            ),
            (
                "pressure_first",
                "the pressure from the old velocities, and then the new ones, as Basic (2021) has it",
                LddCoupling::PressureFirst,
            ),
        ]),
    );
    const SCHEME: Or<Choice<LddScheme>> = or(
        "scheme",
        "\"lagged\"",
        "what of a step's stress is that of the new velocities",
        Choice(&[
            ("lagged", "all but the apparent viscosity", LddScheme::Lagged),
            ("implicit", "the apparent viscosity, too: several solutions a step", LddScheme::Implicit),
            (
                "paper",
                "viscosity times the Laplacian of the velocity only, as Basic (2021) has it",
                LddScheme::Paper,
            ),
        ]),
    );
    const LAPLACIAN: Or<Choice<LddLaplacian>> = or(
        "laplacian",
        "\"exact\"",
        "how second derivatives are told",
        Choice(&[
            ("exact", "exact for quadratic fields, over 2.1 spacings", LddLaplacian::Exact),
            ("paper", "as Basic (2021, Eq. 15) has it, over 1.6 spacings", LddLaplacian::Paper),
        ]),
    );
    const LARGEST: Maybe<Quantity> = maybe(
        "largest_viscosity",
        "apparent viscosity of fluid that has not yielded; if absent, so large that it creeps by 1 % until the stop time under half of its yield stress",
        quantity(Dimension::VISCOSITY, Bound::Positive, "50 kPa s"),
    );
    Section {
        keys: &[&SPACING, &COURANT, &TIME_STEP, &COUPLING, &SCHEME, &LAPLACIAN, &LARGEST],
        example: &["spacing = \"5 mm\""],
        read: |t| {
            let (.., coupling) = t.or(&COUPLING)?;
            let (.., scheme) = t.or(&SCHEME)?;
            let (.., laplacian) = t.or(&LAPLACIAN)?;
            Ok(Method::Ldd(Ldd {
                spacing: t.need(&SPACING)?,
                courant: t.or(&COURANT)?,
                time_step: t.maybe(&TIME_STEP)?,
                coupling: *coupling,
                scheme: *scheme,
                laplacian: *laplacian,
                largest_viscosity: t.maybe(&LARGEST)?,
            }))
        },
    }
};

/// Keys of both schemes of particles.
mod particles {
    use super::*;

    pub(super) const SPACING: Need<Quantity> =
        need("spacing", "distance of particles", quantity(Dimension::LENGTH, Bound::Positive, "5 mm"));
    pub(super) const COURANT: Or<Quantity> = or(
        "courant",
        "0.25",
        "limit of the time step: how far a particle may go in it, over the smoothing length",
        quantity(Dimension::NUMBER, Bound::UpTo(0.5), "0.25"),
    );
    pub(super) const STRESS: Or<Choice<StressStep>> = or(
        "stress",
        "\"implicit\"",
        "how the viscous part of a step is taken",
        Choice(&[
            (
                "implicit",
                "by the velocities at its end: steps are as long as the flow allows",
                StressStep::Implicit,
            ),
            (
                "explicit",
                "by those at its beginning: steps are as short as the largest viscosity needs",
                StressStep::Explicit,
            ),
        ]),
    );
    pub(super) const LARGEST: Maybe<Quantity> = maybe(
        "largest_viscosity",
        "apparent viscosity of fluid that has not yielded; if absent, so large that it creeps by 1 % until the stop time under half of its yield stress",
        quantity(Dimension::VISCOSITY, Bound::Positive, "50 kPa s"),
    );
    pub(super) const TIME_STEP: Maybe<Quantity> = maybe(
        "time_step",
        "longest step; as long as speeds and gauges allow if absent",
        quantity(Dimension::TIME, Bound::Positive, "1 ms"),
    );
}

const ISPH: Section<Method> = {
    use particles::{COURANT, LARGEST, SPACING, STRESS, TIME_STEP};
    const CONVENTION: Or<Choice<StrainConvention>> = or(
        "strain_convention",
        "\"standard\"",
        "what stress and shear rate are",
        Choice(&[
            ("standard", "2 mu E at the shear rate sqrt(2 E:E)", StrainConvention::Standard),
            (
                "paper",
                "mu E at sqrt(E:E/2), as Wu (2016) prints them, to reproduce it",
                StrainConvention::Paper,
            ),
        ]),
    );
    Section {
        keys: &[&SPACING, &COURANT, &STRESS, &CONVENTION, &LARGEST, &TIME_STEP],
        example: &["spacing = \"5 mm\""],
        read: |t| {
            let (.., stress) = t.or(&STRESS)?;
            let (.., strain_convention) = t.or(&CONVENTION)?;
            Ok(Method::Isph(Isph {
                spacing: t.need(&SPACING)?,
                courant: t.or(&COURANT)?,
                stress: *stress,
                strain_convention: *strain_convention,
                largest_viscosity: t.maybe(&LARGEST)?,
                time_step: t.maybe(&TIME_STEP)?,
                scheme: Scheme::Projection,
            }))
        },
    }
};

const SPH: Section<Method> = {
    use particles::{COURANT, LARGEST, SPACING, STRESS, TIME_STEP};
    const PRESSURE: Or<Choice<PressureStep>> = or(
        "pressure",
        "\"solve\"",
        "how the pressure of a step is found",
        Choice(&[
            ("solve", "from all equations at once", PressureStep::Solve),
            (
                "sweep",
                "by each equation from the pressures of the step before, as the paper has it; with stress = \"explicit\"",
                PressureStep::Sweep,
            ),
        ]),
    );
    Section {
        keys: &[&SPACING, &COURANT, &STRESS, &PRESSURE, &LARGEST, &TIME_STEP],
        example: &["spacing = \"5 mm\""],
        read: |t| {
            let (.., stress) = t.or(&STRESS)?;
            let (.., pressure) = t.or(&PRESSURE)?;
            Ok(Method::Isph(Isph {
                spacing: t.need(&SPACING)?,
                courant: t.or(&COURANT)?,
                stress: *stress,
                strain_convention: StrainConvention::Standard,
                largest_viscosity: t.maybe(&LARGEST)?,
                time_step: t.maybe(&TIME_STEP)?,
                scheme: Scheme::ThreeStep(*pressure),
            }))
        },
    }
};

const LBM: Section<Method> = {
    const CELL_SIZE: Need<Quantity> =
        need("cell_size", "edge of a cell", quantity(Dimension::LENGTH, Bound::Positive, "5 mm"));
    const PRECISION: Or<Choice<Precision>> = or(
        "precision",
        "\"f32\"",
        "format of the numbers in the cells",
        Choice(&[
            ("f32", "32 bits", Precision::F32),
            ("f64", "64 bits: twice the memory, slower", Precision::F64),
        ]),
    );
    const TIME_STEP: Maybe<Quantity> = maybe(
        "time_step",
        "length of a step, or of the first; if absent, the largest that meets the three limits",
        TIME,
    );
    const STEPPING: Or<Choice<Stepping>> = or(
        "stepping",
        "\"fixed\"",
        "how long the other steps are",
        Choice(&[
            ("fixed", "as long as the first", Stepping::Fixed),
            (
                "adaptive",
                "longer when the flow has become slow and low, shorter when it has not",
                Stepping::Adaptive,
            ),
        ]),
    );
    const HYDROSTATIC_ERROR: Or<Quantity> = or(
        "hydrostatic_error",
        "0.02",
        "limit of the time step: largest relative change of density under the fluid's own weight",
        quantity(Dimension::NUMBER, Bound::UpTo(1.0), "0.02"),
    );
    // The bound is far enough below the speed of sound of the lattice, 1/sqrt(3).
    const LATTICE_SPEED: Or<Quantity> = or(
        "lattice_speed",
        "0.1",
        "limit of the time step: largest speed in cells a step",
        quantity(Dimension::NUMBER, Bound::UpTo(0.3), "0.1"),
    );
    const LATTICE_VISCOSITY: Or<Quantity> = or(
        "lattice_viscosity",
        "0.16666666666666666",
        "limit of the time step: kinematic viscosity in cells squared a step that it aims at",
        quantity(Dimension::NUMBER, Bound::Positive, "0.167"),
    );
    const BULK_RELAXATION: Or<Quantity> = or(
        "bulk_relaxation",
        "1",
        "relaxation rate of the trace of the stress; 0.2 lets sound die away up to nine times as fast, where solids that drive the fluid start at once",
        quantity(Dimension::NUMBER, Bound::UpTo(1.0), "1"),
    );
    const LATTICE: Or<Choice<Lattice>> = or(
        "lattice",
        "\"d3q19\"",
        "velocities of the populations",
        Choice(&[
            ("d3q15", "15; with a collision of the textbooks", Lattice::D3q15),
            ("d3q19", "19", Lattice::D3q19),
            ("d3q27", "27; with a collision of the textbooks", Lattice::D3q27),
        ]),
    );
    const COLLISION: Or<Choice<Collision>> = or(
        "collision",
        "\"mtrt\"",
        "how they collide; all but the first are for comparison: slow, in 64 bits, with the free surface of Svec (2013)",
        Choice(&[
            ("mtrt", "the program's own", Collision::Mtrt),
            ("bgk", "one relaxation time", Collision::Bgk),
            ("trt", "two relaxation times", Collision::Trt),
            ("regularised", "all but the stress forgotten", Collision::Regularised),
        ]),
    );
    const PRESET: Maybe<Choice<Preset>> = maybe(
        "preset",
        "lattice and collision as in a published work, to reproduce it",
        Choice(&[(
            "svec-2013",
            "Svec's thesis: D3Q15, one relaxation time between 0.501 and 8",
            Preset::Svec2013,
        )]),
    );
    Section {
        keys: &[
            &CELL_SIZE,
            &PRECISION,
            &TIME_STEP,
            &STEPPING,
            &HYDROSTATIC_ERROR,
            &LATTICE_SPEED,
            &LATTICE_VISCOSITY,
            &BULK_RELAXATION,
            &LATTICE,
            &COLLISION,
            &PRESET,
        ],
        example: &["cell_size = \"5 mm\""],
        read: |t| {
            let (.., precision) = t.or(&PRECISION)?;
            let (.., stepping) = t.or(&STEPPING)?;
            let (.., lattice) = t.or(&LATTICE)?;
            let (.., collision) = t.or(&COLLISION)?;
            Ok(Method::Lbm(Lbm {
                cell_size: t.need(&CELL_SIZE)?,
                precision: *precision,
                time_step: t.maybe(&TIME_STEP)?,
                stepping: *stepping,
                hydrostatic_error: t.or(&HYDROSTATIC_ERROR)?,
                lattice_speed: t.or(&LATTICE_SPEED)?,
                lattice_viscosity: t.or(&LATTICE_VISCOSITY)?,
                bulk_relaxation: t.or(&BULK_RELAXATION)?,
                lattice: *lattice,
                collision: *collision,
                preset: t.maybe(&PRESET)?.map(|(.., preset)| *preset),
            }))
        },
    }
};

const GAUGES: Section<Gauges> = {
    const INTERVAL: Need<Quantity> =
        need("interval", "simulated time between two readings (rows of series.csv)", TIME);
    const SPREAD_KEY: Maybe<Section<SpreadGauge>> =
        maybe("spread", "measures the diameter of the fluid around a vertical axis, and T500", SPREAD);
    const LEVELS: Maybe<List<Section<LevelGauge>>> = maybe(
        "level",
        "each measures the level of the surface over a rectangle, the median of its columns",
        List(LEVEL),
    );
    const FRONTS: Maybe<List<Section<FrontGauge>>> =
        maybe("front", "each tells how far the fluid has come, and when it reaches a plane", List(FRONT));
    const LIGHTS: Maybe<List<Section<LightGauge>>> = maybe(
        "light",
        "each tells when one first sees through a box from above, in which fluid has been",
        List(LIGHT),
    );
    const PRESSURES: Maybe<List<Section<PressureGauge>>> =
        maybe("pressure", "each measures what presses on a wall, in bands over its height", List(PRESSURE));
    const FILLING_KEY: Maybe<Section<FillingGauge>> = maybe(
        "filling",
        "tells when each place is filled, where fronts meet, where the fluid stands and where air is caught",
        FILLING,
    );
    Section {
        keys: &[&INTERVAL, &SPREAD_KEY, &LEVELS, &FRONTS, &LIGHTS, &PRESSURES, &FILLING_KEY],
        example: &["interval = \"20 ms\""],
        read: |t| {
            Ok(Gauges {
                interval: t.need(&INTERVAL)?,
                spread: t.maybe(&SPREAD_KEY)?,
                level: t.maybe(&LEVELS)?.unwrap_or_default(),
                front: t.maybe(&FRONTS)?.unwrap_or_default(),
                light: t.maybe(&LIGHTS)?.unwrap_or_default(),
                pressure: t.maybe(&PRESSURES)?.unwrap_or_default(),
                filling: t.maybe(&FILLING_KEY)?,
            })
        },
    }
};

const FILLING: Section<FillingGauge> = {
    const DEAD: Or<Quantity> = or(
        "dead_shear_rate",
        "\"0 1/s\"",
        "where the fluid has not been sheared faster since the place was filled it is dead; 0 1/s: where it has not yielded",
        quantity(Dimension::RATE, Bound::NotNegative, "0.01 1/s"),
    );
    Section {
        keys: &[&DEAD],
        example: &["dead_shear_rate = \"0.01 1/s\""],
        read: |t| Ok(FillingGauge { dead_shear_rate: t.or(&DEAD)? }),
    }
};

const LEVEL: Section<LevelGauge> = {
    const CALLED: Need<Name> = need("name", "what it is called in series.csv", Name { example: "H1" });
    const LOW: Need<Vector<2>> = need("min", "smallest x and y of the rectangle", Vector(COORDINATE));
    const HIGH: Need<Vector<2>> = need(
        "max",
        "largest x and y; along an axis the same as the smallest for a line of columns",
        Vector(COORDINATE),
    );
    Section {
        keys: &[&CALLED, &LOW, &HIGH],
        example: &["name = \"H1\"", "min = [\"0 m\", \"0 m\"]", "max = [\"0.1 m\", \"0.1 m\"]"],
        read: |t| {
            Ok(LevelGauge { name: t.need(&CALLED)?, min: t.need(&LOW)?.into(), max: t.need(&HIGH)?.into() })
        },
    }
};

const FRONT: Section<FrontGauge> = {
    const CALLED: Need<Name> = need("name", "what it is called in series.csv", Name { example: "T200" });
    const DIRECTION: Need<Choice<(usize, bool)>> = need(
        "direction",
        "the way the fluid goes",
        Choice(&[
            ("x", "along x", (0, true)),
            ("-x", "against x", (0, false)),
            ("y", "along y", (1, true)),
            ("-y", "against y", (1, false)),
            ("z", "upwards", (2, true)),
            ("-z", "downwards", (2, false)),
        ]),
    );
    const AT: Need<Quantity> = need("at", "coordinate of the plane along this direction", COORDINATE);
    Section {
        keys: &[&CALLED, &DIRECTION, &AT],
        example: &["name = \"T200\"", "direction = \"x\"", "at = \"0.3 m\""],
        read: |t| {
            let (.., (axis, forwards)) = *t.need(&DIRECTION)?;
            Ok(FrontGauge { name: t.need(&CALLED)?, axis, forwards, at: t.need(&AT)? })
        },
    }
};

const LIGHT: Section<LightGauge> = {
    const CALLED: Need<Name> = need("name", "what it is called in series.csv", Name { example: "tv" });
    const WITH: Maybe<Name> =
        maybe("with", "name of the solid with which it moves; at rest if absent", Name { example: "mould" });
    Section {
        keys: &[&CALLED, &MIN, &MAX, &WITH],
        example: &[
            "name = \"tv\"",
            "min = [\"0 m\", \"0 m\", \"0.1 m\"]",
            "max = [\"0.05 m\", \"0.05 m\", \"0.3 m\"]",
        ],
        read: |t| {
            Ok(LightGauge {
                name: t.need(&CALLED)?,
                min: t.need(&MIN)?.into(),
                max: t.need(&MAX)?.into(),
                with: t.maybe(&WITH)?,
            })
        },
    }
};

const PRESSURE: Section<PressureGauge> = {
    const CALLED: Need<Name> = need("name", "what it is called in series.csv", Name { example: "form" });
    const WALL: Need<Name> = need(
        "wall",
        "a side of the domain, \"x_min\" to \"z_max\", or the name of a solid",
        Name { example: "x_min" },
    );
    const LOW: Maybe<Vector<3>> =
        maybe("min", "smallest coordinates of what counts of it; all of it if absent", POINT);
    const HIGH: Maybe<Vector<3>> =
        maybe("max", "largest coordinates of what counts of it; all of it if absent", POINT);
    const BANDS: Or<Quantity> = or(
        "bands",
        "10",
        "number of bands of the same height, at most 100",
        quantity(Dimension::NUMBER, Bound::UpTo(MOST_BANDS), "10"),
    );
    const MOST_BANDS: f64 = 100.0;
    Section {
        keys: &[&CALLED, &WALL, &LOW, &HIGH, &BANDS],
        example: &["name = \"form\"", "wall = \"x_min\""],
        read: |t| {
            let bands = t.or(&BANDS)?;
            if bands.fract() != 0.0 {
                let value = t.value("bands").unwrap_or_else(|| t.itself());
                return Err(value.fault("must be a whole number", "write 10, say"));
            }
            Ok(PressureGauge {
                name: t.need(&CALLED)?,
                wall: t.need(&WALL)?,
                min: t.maybe(&LOW)?.map(DVec3::from),
                max: t.maybe(&HIGH)?.map(DVec3::from),
                bands: bands as usize,
            })
        },
    }
};

const SPREAD: Section<SpreadGauge> = {
    const CENTRE: Need<Vector<2>> = need("centre", "x and y of the axis", Vector(COORDINATE));
    Section {
        keys: &[&CENTRE],
        example: &["centre = [\"0 m\", \"0 m\"]"],
        read: |t| Ok(SpreadGauge { centre: DVec2::from(t.need(&CENTRE)?) }),
    }
};

const STOP: Section<Stop> = {
    const STOP_TIME: Need<Quantity> =
        need("time", "simulated time at which the run ends at the latest", TIME);
    const REST_KEY: Maybe<Section<Rest>> =
        maybe("rest", "ends the run earlier when the fluid is at rest", REST);
    const EVENT: Maybe<Name> = maybe(
        "event",
        "ends the run earlier when what the front or light gauge of this name waits for has come",
        Name { example: "tv" },
    );
    Section {
        keys: &[&STOP_TIME, &REST_KEY, &EVENT],
        example: &["time = \"60 s\""],
        read: |t| Ok(Stop { time: t.need(&STOP_TIME)?, rest: t.maybe(&REST_KEY)?, event: t.maybe(&EVENT)? }),
    }
};

const REST: Section<Rest> = {
    const SPREAD_RATE: Or<Quantity> = or(
        "spread_rate",
        "\"0.05 mm/s\"",
        "the spread changes by less than this, on average over the last fifth of the time since the start (needs the spread gauge)",
        SPEED,
    );
    const GROWTH: Or<Quantity> = or(
        "growth",
        "\"0.5 %\"",
        "the spread has less than this share still to grow, if its rate goes on falling with the square of the time (needs the spread gauge)",
        quantity(Dimension::NUMBER, Bound::UpTo(1.0), "0.5 %"),
    );
    const SLOW: Or<Quantity> = or("speed", "\"1 mm/s\"", "99 % of the fluid is slower than this", SPEED);
    const LEVEL_RATE: Maybe<Quantity> = maybe(
        "level_rate",
        "or half of the fluid is slower than `speed` and each level gauge changes by less than this, on average over the last fifth of the time since the start: films on walls run down for minutes",
        SPEED,
    );
    const DURATION: Or<Quantity> = or("duration", "\"1 s\"", "the speed stays so low for this long", TIME);
    Section {
        keys: &[&SPREAD_RATE, &GROWTH, &SLOW, &LEVEL_RATE, &DURATION],
        example: &["speed = \"1 mm/s\""],
        read: |t| {
            Ok(Rest {
                spread_rate: t.or(&SPREAD_RATE)?,
                growth: t.or(&GROWTH)?,
                speed: t.or(&SLOW)?,
                level_rate: t.maybe(&LEVEL_RATE)?,
                duration: t.or(&DURATION)?,
            })
        },
    }
};

const OUTPUT: Section<Output> = {
    const SNAPSHOT_INTERVAL: Maybe<Quantity> =
        maybe("snapshot_interval", "simulated time between two sets of fields for ParaView", TIME);
    const PICTURE_INTERVAL: Maybe<Quantity> =
        maybe("picture_interval", "simulated time between two pictures", TIME);
    const CHECKPOINT_INTERVAL: Or<Quantity> =
        or("checkpoint_interval", "\"60 s\"", "wall-clock time between two checkpoints", TIME);
    Section {
        keys: &[&SNAPSHOT_INTERVAL, &PICTURE_INTERVAL, &CHECKPOINT_INTERVAL],
        example: &["snapshot_interval = \"1 s\""],
        read: |t| {
            Ok(Output {
                snapshot_interval: t.maybe(&SNAPSHOT_INTERVAL)?,
                picture_interval: t.maybe(&PICTURE_INTERVAL)?,
                checkpoint_interval: t.or(&CHECKPOINT_INTERVAL)?,
            })
        },
    }
};
