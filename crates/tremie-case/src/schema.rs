//! The keys of a case file: what there is, in which units, within which bounds, and what stands for it if absent.
//!
//! A new flow curve is an entry in `FLOW_CURVES`, a new shape one in `SHAPES`, a new method one in `METHODS`; a new
//! section is a constant like the others and a line in `read`.

use toml::de::DeValue;
use tremie_geometry::Shape;
use tremie_numerics::{DVec2, DVec3};
use tremie_rheology::{FlowCurve, Regularisation};

use crate::case::{
    Case, Domain, FluidRegion, Gauges, Lbm, Material, Method, Output, Precision, Rest, Side, SpreadGauge,
    Stop,
};
use crate::document::{
    Bound, Choice, Document, Kind, List, Quantity, Section, Text, Value, Variants, Vector,
};
use crate::fault::Fault;
use crate::units::Dimension;

const fn quantity(dimension: Dimension, range: Bound, example: &'static str) -> Quantity {
    Quantity { dimension, range, example }
}

const DENSITY: Quantity = quantity(Dimension::DENSITY, Bound::Positive, "2300 kg/m3");
const YIELD_STRESS: Quantity = quantity(Dimension::STRESS, Bound::NotNegative, "50 Pa");
const VISCOSITY: Quantity = quantity(Dimension::VISCOSITY, Bound::Positive, "30 Pa s");
const CONSISTENCY: Quantity = quantity(Dimension::CONSISTENCY, Bound::Positive, "20 Pa s^n");
const INDEX: Quantity = quantity(Dimension::NUMBER, Bound::Positive, "0.5");
/// With a larger one the stress would fall where the shear rate grows.
const CROSS_INDEX: Quantity = quantity(Dimension::NUMBER, Bound::UpTo(1.0), "0.8");
const ZERO_SHEAR_VISCOSITY: Quantity = quantity(Dimension::VISCOSITY, Bound::Positive, "100 Pa s");
const INFINITE_SHEAR_VISCOSITY: Quantity = quantity(Dimension::VISCOSITY, Bound::NotNegative, "1 Pa s");
const LARGEST_VISCOSITY: Quantity = quantity(Dimension::VISCOSITY, Bound::Positive, "1e4 Pa s");
const PAPANASTASIOU_EXPONENT: Quantity = quantity(Dimension::TIME, Bound::Positive, "100 s");
const POSITION: Quantity = quantity(Dimension::LENGTH, Bound::Any, "0.2 m");
const LENGTH: Quantity = quantity(Dimension::LENGTH, Bound::Positive, "200 mm");
const DIAMETER_OR_POINT: Quantity = quantity(Dimension::LENGTH, Bound::NotNegative, "200 mm");
const CELL_SIZE: Quantity = quantity(Dimension::LENGTH, Bound::Positive, "5 mm");
const VELOCITY: Quantity = quantity(Dimension::SPEED, Bound::Any, "0 m/s");
const SPEED: Quantity = quantity(Dimension::SPEED, Bound::Positive, "1 mm/s");
const ACCELERATION: Quantity = quantity(Dimension::ACCELERATION, Bound::Any, "0 m/s2");
const TIME: Quantity = quantity(Dimension::TIME, Bound::Positive, "1 s");
const DIRECTION: Quantity = quantity(Dimension::NUMBER, Bound::Any, "1");
const SHARE: Quantity = quantity(Dimension::NUMBER, Bound::UpTo(1.0), "0.02");
/// Far enough below the speed of sound of the lattice, 1/sqrt(3).
const LATTICE_SPEED: Quantity = quantity(Dimension::NUMBER, Bound::UpTo(0.3), "0.1");
const LATTICE_VISCOSITY: Quantity = quantity(Dimension::NUMBER, Bound::Positive, "0.167");

/// Reads the document; what is wrong only in combination is left to `check`.
pub(crate) fn read(document: &Document<'_>, text: &str) -> Result<Case, Fault> {
    Ok(Case { text: text.to_owned(), ..CASE.read(&document.root())? })
}

const CASE: Section<Case> = Section {
    keys: &[&"title", &"method", &"material", &"domain", &"fluid", &"gauges", &"stop", &"output", &METHODS],
    example: &[],
    read: |t| {
        Ok(Case {
            title: t.need("title", &Text { example: "Slump flow" })?,
            method: {
                let (key, section) = t.need("method", &Choice(METHODS.0))?;
                t.need(key, section)?
            },
            material: t.need("material", &MATERIAL)?,
            domain: t.need("domain", &DOMAIN)?,
            fluid: t.need("fluid", &List(FLUID))?,
            gauges: t.need("gauges", &GAUGES)?,
            stop: t.need("stop", &STOP)?,
            output: t.maybe("output", &OUTPUT)?.unwrap_or(Output {
                snapshot_interval: None,
                picture_interval: None,
                checkpoint_interval: CHECKPOINT_INTERVAL,
            }),
            text: String::new(),
        })
    },
};

const MATERIAL: Section<Material> = Section {
    keys: &[&"density", &"regularisation", &FLOW_CURVES],
    example: &[
        "density = \"2300 kg/m3\"",
        "bingham = { yield_stress = \"50 Pa\", plastic_viscosity = \"30 Pa s\" }",
    ],
    read: |t| {
        let density = t.need("density", &DENSITY)?;
        let mut curve = t.one_of("flow curve", &FLOW_CURVES)?;
        if let Some(value) = t.value("regularisation") {
            curve = curve.regularised(REGULARISATION.read(&value)?).ok_or_else(|| {
                value.fault("has nothing to act on: the flow curve has no yield stress", "remove this")
            })?;
        }
        Ok(Material { density, curve })
    },
};

const REGULARISATION: Section<Regularisation> = Section {
    keys: &[&"papanastasiou", &"bi_viscosity"],
    example: &["papanastasiou = \"100 s\""],
    read: |t| match (t.maybe("papanastasiou", &PAPANASTASIOU_EXPONENT)?, t.value("bi_viscosity")) {
        (Some(_), Some(second)) => Err(second.fault("is a second regularisation", "keep only one of them")),
        (Some(exponent), None) => Ok(Regularisation::Papanastasiou { exponent }),
        (None, _) => {
            Ok(Regularisation::BiViscosity { largest_viscosity: t.need("bi_viscosity", &LARGEST_VISCOSITY)? })
        }
    },
};

const FLOW_CURVES: Variants<FlowCurve> = Variants(&[
    (
        "newtonian",
        Section {
            keys: &[&"viscosity"],
            example: &["viscosity = \"30 Pa s\""],
            read: |t| Ok(FlowCurve::Newtonian { viscosity: t.need("viscosity", &VISCOSITY)? }),
        },
    ),
    (
        "bingham",
        Section {
            keys: &[&"yield_stress", &"plastic_viscosity"],
            example: &["yield_stress = \"50 Pa\"", "plastic_viscosity = \"30 Pa s\""],
            read: |t| {
                Ok(FlowCurve::Bingham {
                    yield_stress: t.need("yield_stress", &YIELD_STRESS)?,
                    plastic_viscosity: t.need("plastic_viscosity", &VISCOSITY)?,
                })
            },
        },
    ),
    (
        "herschel_bulkley",
        Section {
            keys: &[&"yield_stress", &"consistency", &"index"],
            example: &["yield_stress = \"50 Pa\"", "consistency = \"20 Pa s^n\"", "index = 0.5"],
            read: |t| {
                Ok(FlowCurve::HerschelBulkley {
                    yield_stress: t.need("yield_stress", &YIELD_STRESS)?,
                    consistency: t.need("consistency", &CONSISTENCY)?,
                    index: t.need("index", &INDEX)?,
                })
            },
        },
    ),
    (
        "casson",
        Section {
            keys: &[&"yield_stress", &"plastic_viscosity"],
            example: &["yield_stress = \"50 Pa\"", "plastic_viscosity = \"30 Pa s\""],
            read: |t| {
                Ok(FlowCurve::Casson {
                    yield_stress: t.need("yield_stress", &YIELD_STRESS)?,
                    plastic_viscosity: t.need("plastic_viscosity", &VISCOSITY)?,
                })
            },
        },
    ),
    (
        "power_law",
        Section {
            keys: &[&"consistency", &"index"],
            example: &["consistency = \"20 Pa s^n\"", "index = 0.5"],
            read: |t| {
                Ok(FlowCurve::PowerLaw {
                    consistency: t.need("consistency", &CONSISTENCY)?,
                    index: t.need("index", &INDEX)?,
                })
            },
        },
    ),
    (
        "cross",
        Section {
            keys: &[&"zero_shear_viscosity", &"infinite_shear_viscosity", &"time", &"index"],
            example: &[
                "zero_shear_viscosity = \"100 Pa s\"",
                "infinite_shear_viscosity = \"1 Pa s\"",
                "time = \"1 s\"",
                "index = 0.8",
            ],
            read: |t| {
                Ok(FlowCurve::Cross {
                    zero_shear_viscosity: t.need("zero_shear_viscosity", &ZERO_SHEAR_VISCOSITY)?,
                    infinite_shear_viscosity: t
                        .need("infinite_shear_viscosity", &INFINITE_SHEAR_VISCOSITY)?,
                    time: t.need("time", &TIME)?,
                    index: t.need("index", &CROSS_INDEX)?,
                })
            },
        },
    ),
    (
        "carreau_yasuda",
        Section {
            keys: &[&"zero_shear_viscosity", &"infinite_shear_viscosity", &"time", &"index", &"transition"],
            example: &[
                "zero_shear_viscosity = \"100 Pa s\"",
                "infinite_shear_viscosity = \"1 Pa s\"",
                "time = \"1 s\"",
                "index = 0.5",
            ],
            read: |t| {
                Ok(FlowCurve::CarreauYasuda {
                    zero_shear_viscosity: t.need("zero_shear_viscosity", &ZERO_SHEAR_VISCOSITY)?,
                    infinite_shear_viscosity: t
                        .need("infinite_shear_viscosity", &INFINITE_SHEAR_VISCOSITY)?,
                    time: t.need("time", &TIME)?,
                    index: t.need("index", &INDEX)?,
                    transition: t.maybe("transition", &INDEX)?.unwrap_or(2.0),
                })
            },
        },
    ),
]);

const DOMAIN: Section<Domain> = Section {
    keys: &[&"min", &"max", &"gravity", &"sides"],
    example: CORNERS,
    read: |t| {
        Ok(Domain {
            min: t.need("min", &Vector(POSITION))?.into(),
            max: t.need("max", &Vector(POSITION))?.into(),
            gravity: t
                .maybe("gravity", &Vector(ACCELERATION))?
                .map_or(DVec3::new(0.0, 0.0, -9.81), DVec3::from),
            sides: t.maybe("sides", &SIDES)?.unwrap_or([Side::REST; 6]),
        })
    },
};

const CORNERS: &[&str] = &["min = [\"0 m\", \"0 m\", \"0 m\"]", "max = [\"0.4 m\", \"0.4 m\", \"0.3 m\"]"];

/// Keys of the sides in the order of [`Domain::sides`].
pub(crate) const SIDE_KEYS: [&str; 6] = ["x_min", "x_max", "y_min", "y_max", "z_min", "z_max"];

const SIDES: Section<[Side; 6]> = Section {
    keys: &[&SIDE_KEYS],
    example: &["x_min = \"symmetry\""],
    read: |t| {
        let mut sides = [Side::REST; 6];
        for (side, key) in sides.iter_mut().zip(SIDE_KEYS) {
            *side = t.maybe(key, &SideKind)?.unwrap_or(Side::REST);
        }
        Ok(sides)
    },
};

/// A word, or a table for a wall that moves.
struct SideKind;

impl SideKind {
    const WORDS: Choice<Side> =
        Choice(&[("wall", Side::REST), ("symmetry", Side::Symmetry), ("periodic", Side::Periodic)]);

    const MOVING: Section<Side> = Section {
        keys: &[&"velocity"],
        example: &["velocity = [\"0.1 m/s\", \"0 m/s\", \"0 m/s\"]"],
        read: |t| Ok(Side::Wall { velocity: t.need("velocity", &Vector(VELOCITY))?.into() }),
    };
}

impl Kind for SideKind {
    type Out = Side;

    fn read(&self, value: &Value<'_>) -> Result<Side, Fault> {
        match value.get() {
            DeValue::Table(_) => Self::MOVING.read(value),
            DeValue::String(_) => Self::WORDS.read(value).map(|(_, side)| *side),
            _ => Err(value.wrong_type(format!(
                "{}, or {{ {} }}",
                Self::WORDS.written(),
                Self::MOVING.example[0]
            ))),
        }
    }

    fn example(&self, name: &str, key: &str) -> String {
        Self::WORDS.example(name, key)
    }
}

const FLUID: Section<FluidRegion> = Section {
    keys: &[&"velocity", &SHAPES],
    example: &["sphere = { centre = [\"0.2 m\", \"0.2 m\", \"0.1 m\"], diameter = \"100 mm\" }"],
    read: |t| {
        Ok(FluidRegion {
            shape: t.one_of("shape", &SHAPES)?,
            velocity: t.maybe("velocity", &Vector(VELOCITY))?.map_or(DVec3::ZERO, DVec3::from),
        })
    },
};

const SHAPES: Variants<Shape> = Variants(&[
    (
        "box",
        Section {
            keys: &[&"min", &"max"],
            example: CORNERS,
            read: |t| {
                Ok(Shape::Box {
                    min: t.need("min", &Vector(POSITION))?.into(),
                    max: t.need("max", &Vector(POSITION))?.into(),
                })
            },
        },
    ),
    (
        "sphere",
        Section {
            keys: &[&"centre", &"diameter"],
            example: &["centre = [\"0.2 m\", \"0.2 m\", \"0.1 m\"]", "diameter = \"100 mm\""],
            read: |t| {
                Ok(Shape::Sphere {
                    centre: t.need("centre", &Vector(POSITION))?.into(),
                    radius: 0.5 * t.need("diameter", &LENGTH)?,
                })
            },
        },
    ),
    (
        "cone",
        Section {
            keys: &[&"base", &"base_diameter", &"top_diameter", &"height"],
            example: &[
                "base = [\"0.2 m\", \"0.2 m\", \"0 m\"]",
                "base_diameter = \"200 mm\"",
                "top_diameter = \"100 mm\"",
                "height = \"300 mm\"",
            ],
            read: |t| {
                Ok(Shape::Cone {
                    base: t.need("base", &Vector(POSITION))?.into(),
                    base_radius: 0.5 * t.need("base_diameter", &DIAMETER_OR_POINT)?,
                    top_radius: 0.5 * t.need("top_diameter", &DIAMETER_OR_POINT)?,
                    height: t.need("height", &LENGTH)?,
                })
            },
        },
    ),
    (
        "cylinder",
        Section {
            keys: &[&"point", &"axis", &"diameter"],
            example: &["point = [\"0.2 m\", \"0 m\", \"0 m\"]", "axis = [0, 1, 0]", "diameter = \"100 mm\""],
            read: |t| {
                Ok(Shape::Cylinder {
                    point: t.need("point", &Vector(POSITION))?.into(),
                    // Zero where there is no direction, which `check` refuses.
                    axis: DVec3::from(t.need("axis", &Vector(DIRECTION))?).normalize_or_zero(),
                    radius: 0.5 * t.need("diameter", &LENGTH)?,
                })
            },
        },
    ),
]);

const METHODS: Variants<Method> = Variants(&[(
    "lbm",
    Section {
        keys: &[
            &"cell_size",
            &"precision",
            &"time_step",
            &"hydrostatic_error",
            &"lattice_speed",
            &"lattice_viscosity",
        ],
        example: &["cell_size = \"5 mm\""],
        read: |t| {
            Ok(Method::Lbm(Lbm {
                cell_size: t.need("cell_size", &CELL_SIZE)?,
                precision: t
                    .maybe("precision", &PRECISION)?
                    .map_or(Precision::F32, |(_, precision)| *precision),
                time_step: t.maybe("time_step", &TIME)?,
                hydrostatic_error: t.maybe("hydrostatic_error", &SHARE)?.unwrap_or(0.02),
                lattice_speed: t.maybe("lattice_speed", &LATTICE_SPEED)?.unwrap_or(0.1),
                lattice_viscosity: t.maybe("lattice_viscosity", &LATTICE_VISCOSITY)?.unwrap_or(1.0 / 6.0),
            }))
        },
    },
)]);

const PRECISION: Choice<Precision> = Choice(&[("f32", Precision::F32), ("f64", Precision::F64)]);

const GAUGES: Section<Gauges> = Section {
    keys: &[&"interval", &"spread"],
    example: &["interval = \"20 ms\""],
    read: |t| Ok(Gauges { interval: t.need("interval", &TIME)?, spread: t.maybe("spread", &SPREAD)? }),
};

const SPREAD: Section<SpreadGauge> = Section {
    keys: &[&"centre"],
    example: &["centre = [\"0 m\", \"0 m\"]"],
    read: |t| Ok(SpreadGauge { centre: DVec2::from(t.need("centre", &Vector(POSITION))?) }),
};

const STOP: Section<Stop> = Section {
    keys: &[&"time", &"rest"],
    example: &["time = \"60 s\""],
    read: |t| Ok(Stop { time: t.need("time", &TIME)?, rest: t.maybe("rest", &REST)? }),
};

const REST: Section<Rest> = Section {
    keys: &[&"spread_rate", &"speed", &"duration"],
    example: &["speed = \"1 mm/s\""],
    read: |t| {
        Ok(Rest {
            spread_rate: t.maybe("spread_rate", &SPEED)?.unwrap_or(5e-5),
            speed: t.maybe("speed", &SPEED)?.unwrap_or(1e-3),
            duration: t.maybe("duration", &TIME)?.unwrap_or(1.0),
        })
    },
};

const OUTPUT: Section<Output> = Section {
    keys: &[&"snapshot_interval", &"picture_interval", &"checkpoint_interval"],
    example: &["snapshot_interval = \"1 s\""],
    read: |t| {
        Ok(Output {
            snapshot_interval: t.maybe("snapshot_interval", &TIME)?,
            picture_interval: t.maybe("picture_interval", &TIME)?,
            checkpoint_interval: t.maybe("checkpoint_interval", &TIME)?.unwrap_or(CHECKPOINT_INTERVAL),
        })
    },
};

/// In s of wall-clock time.
const CHECKPOINT_INTERVAL: f64 = 60.0;
