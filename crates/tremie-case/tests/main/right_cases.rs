//! Right case files.

use std::path::Path;

use tremie_case::*;
use tremie_geometry::{Body, Face, Motion, Outline, Shape, Waypoint};
use tremie_numerics::{DVec2, DVec3};
use tremie_rheology::{FlowCurve, Regularisation, Thixotropy};

use super::SLUMP_FLOW;

#[test]
fn every_value_arrives_in_si_units() {
    let case = Case::parse("slump_flow.toml", SLUMP_FLOW).unwrap();
    let expected = Case {
        groups: Vec::new(),
        inclusions: Default::default(),
        fibre_field: None,
        following: Default::default(),
        title: "Slump flow, EN 12350-8".to_owned(),
        material: Material {
            density: 2300.0,
            curve: FlowCurve::Bingham { yield_stress: 50.0, plastic_viscosity: 30.0 },
            thixotropy: None,
            structure: 0.0,
            surface_tension: 0.0,
        },
        domain: Domain {
            min: DVec3::ZERO,
            max: DVec3::new(0.45, 0.45, 0.32),
            gravity: DVec3::new(0.0, 0.0, -9.81),
            sides: [
                Side::Symmetry,
                Side::REST,
                Side::Symmetry,
                Side::REST,
                Side::Wall { velocity: DVec3::new(0.1, 0.0, 0.0), surface: Surface::NoSlip },
                Side::REST,
            ],
        },
        fluid: vec![
            FluidRegion {
                shape: Shape::Cone { base: DVec3::ZERO, base_radius: 0.1, top_radius: 0.05, height: 0.3 },
                velocity: DVec3::new(0.0, 0.0, -0.1),
                batch: None,
                structure: None,
            },
            FluidRegion {
                shape: Shape::Cylinder { point: DVec3::ZERO, axis: DVec3::Y, radius: 0.005 },
                velocity: DVec3::ZERO,
                batch: None,
                structure: None,
            },
        ],
        inlets: Vec::new(),
        outlets: Vec::new(),
        solids: Vec::new(),
        cages: Vec::new(),
        meshes: Vec::new(),
        files: Vec::new(),
        method: Method::Lbm(Lbm {
            cell_size: 0.005,
            precision: Precision::F64,
            time_step: Some(0.0002),
            stepping: Stepping::Fixed,
            hydrostatic_error: 0.03,
            lattice_speed: 0.1,
            lattice_viscosity: 1.0 / 6.0,
            bulk_relaxation: 1.0,
            lattice: Lattice::D3q19,
            collision: Collision::Mtrt,
            preset: None,
        }),
        stop: Stop {
            time: 120.0,
            rest: Some(Rest {
                spread_rate: 5e-5,
                growth: 5e-3,
                speed: 0.002,
                level_rate: None,
                duration: 1.0,
            }),
            event: None,
        },
        gauges: Gauges {
            interval: 0.02,
            spread: Some(SpreadGauge { centre: DVec2::ZERO }),
            level: Vec::new(),
            pressure: Vec::new(),
            front: Vec::new(),
            light: Vec::new(),
            filling: None,
        },
        output: Output { snapshot_interval: Some(1.0), picture_interval: None, checkpoint_interval: 60.0 },
        name: "slump_flow.toml".to_owned(),
        text: SLUMP_FLOW.to_owned(),
    };
    assert_eq!(case, expected);
    assert_eq!(case.domain.cells(0.005), [90, 90, 64]);
}

/// A channel between two plates, driven by a body force, with nothing that could be left out.
const CHANNEL: &str = r#"
title = "Channel"
method = "lbm"
material = { density = "1 g/cm3", newtonian.viscosity = "1 Pa s" }
domain.min = ["-1 cm", "0 m", "0 m"]
domain.max = ["1 cm", "1 mm", "10 mm"]
domain.gravity = ["1 m/s2", "0 m/s2", "0 m/s2"]
domain.sides = { x_min = "periodic", x_max = "periodic", y_min = "periodic", y_max = "periodic" }
fluid = [{ box = { min = ["-1 m", "-1 m", "-1 m"], max = ["1 m", "1 m", "1 m"] } },
         { sphere = { centre = ["0 m", "0 m", "0 m"], diameter = "2 mm" } }]
lbm.cell_size = "1 mm"
gauges.interval = "1 s"
stop.time = "10 s"
"#;

#[test]
fn inline_tables_and_dotted_keys_do_as_well_as_headers() {
    let case = Case::parse("channel.toml", CHANNEL).unwrap();
    assert_eq!(
        case.material,
        Material {
            density: 1000.0,
            curve: FlowCurve::Newtonian { viscosity: 1.0 },
            thixotropy: None,
            structure: 0.0,
            surface_tension: 0.0,
        }
    );
    assert_eq!(case.domain.sides[0..4], [Side::Periodic; 4]);
    assert_eq!(case.domain.cells(0.001), [20, 1, 10]);
    assert_eq!(case.fluid[1].shape, Shape::Sphere { centre: DVec3::ZERO, radius: 0.001 });
}

#[test]
fn every_flow_curve_and_regularisation_can_be_written() {
    let viscosities =
        "zero_shear_viscosity = \"100 Pa s\", infinite_shear_viscosity = \"1 Pa s\", time = \"2 s\"";
    let (zero_shear_viscosity, infinite_shear_viscosity, time, index) = (100.0, 1.0, 2.0, 0.5);
    let (yield_stress, consistency, plastic_viscosity) = (50.0, 20.0, 5.0);
    let herschel_bulkley = FlowCurve::HerschelBulkley { yield_stress, consistency, index };
    let casson = FlowCurve::Casson { yield_stress, plastic_viscosity };
    let papanastasiou = Regularisation::Papanastasiou { exponent: 100.0 };
    let bi_viscosity = Regularisation::BiViscosity { largest_viscosity: 1e4 };
    for (written, curve) in [
        (
            "herschel_bulkley = { yield_stress = \"50 Pa\", consistency = \"20 Pa s^n\", index = 0.5 }",
            herschel_bulkley,
        ),
        ("casson = { yield_stress = \"50 Pa\", plastic_viscosity = \"5 Pa s\" }", casson),
        (
            "power_law = { consistency = \"20 Pa s^n\", index = 0.5 }",
            FlowCurve::PowerLaw { consistency, index },
        ),
        (
            &format!("cross = {{ {viscosities}, index = 0.5 }}"),
            FlowCurve::Cross { zero_shear_viscosity, infinite_shear_viscosity, time, index },
        ),
        (
            &format!("carreau_yasuda = {{ {viscosities}, index = 0.5 }}"),
            FlowCurve::CarreauYasuda {
                zero_shear_viscosity,
                infinite_shear_viscosity,
                time,
                index,
                transition: 2.0,
            },
        ),
        (
            "casson = { yield_stress = \"50 Pa\", plastic_viscosity = \"5 Pa s\" }, \
             regularisation = { papanastasiou = { exponent = \"100 s\" } }",
            casson.regularised(papanastasiou).unwrap(),
        ),
        (
            "herschel_bulkley = { yield_stress = \"50 Pa\", consistency = \"20 Pa s^n\", index = 0.5 }, \
             regularisation = { bi_viscosity = { largest_viscosity = \"1e4 Pa s\" } }",
            herschel_bulkley.regularised(bi_viscosity).unwrap(),
        ),
    ] {
        let text = CHANNEL.replace("newtonian.viscosity = \"1 Pa s\"", written);
        assert_eq!(Case::parse("channel.toml", &text).unwrap().material.curve, curve);
    }
}

#[test]
fn solids_stand_and_move() {
    let solids = r#"
[[solid]]
cone_shell = { base = ["0 m", "0 m", "0 m"], base_diameter = "10 mm", top_diameter = "5 mm", height = "9 mm", thickness = "2 mm" }
motion.uniform.velocity = ["0 m/s", "0 m/s", "0.15 m/s"]
[[solid]]
difference.from.box = { min = ["-5 mm", "0 m", "0 m"], max = ["5 mm", "1 mm", "10 mm"] }
difference.without = [{ capsule = { start = ["0 m", "0 m", "0 m"], end = ["0 m", "0 m", "5 mm"], diameter = "2 mm" } }]
motion.path.points = [{ time = "1 s", offset = ["0 m", "0 m", "0 m"] }, { time = "3 s", offset = ["1 m", "0 m", "0 m"] }]
[[solid]]
union.of = [{ plane = { point = ["0 m", "0 m", "1 mm"], normal = [0, 3, 4] } }]
surface = "free_slip"
"#;
    let case = Case::parse("channel.toml", &format!("{CHANNEL}{solids}")).unwrap();
    let [mould, gate, slope] = case.solids.as_slice() else { panic!("{:?}", case.solids) };
    let shell = Shape::ConeShell {
        base: DVec3::ZERO,
        base_radius: 0.005,
        top_radius: 0.0025,
        height: 0.009,
        thickness: 0.002,
    };
    let lifted = Motion::Uniform(DVec3::new(0.0, 0.0, 0.15));
    let name = "solid1".to_owned();
    assert_eq!(
        *mould,
        Solid { name, body: Body::Shape(shell), motion: lifted, load: None, surface: Surface::FreeSlip }
    );
    let point = |time, x| Waypoint { time, offset: DVec3::new(x, 0.0, 0.0) };
    assert_eq!(gate.motion, Motion::Path(vec![point(1.0, 0.0), point(3.0, 1.0)]));
    assert_eq!(gate.surface, Surface::NoSlip);
    assert!(gate.body.signed_distance(DVec3::new(0.002, 0.0005, 0.005)) < 0.0);
    assert!(gate.body.signed_distance(DVec3::new(0.0, 0.0005, 0.005)) > 0.0);
    assert_eq!((&slope.motion, slope.surface), (&Motion::REST, Surface::FreeSlip));
    assert!((slope.body.signed_distance(DVec3::new(0.0, 0.0, 0.002)) - 0.0008).abs() < 1e-15);
}

#[test]
fn a_fluid_may_stiffen_at_rest() {
    let thixotropy = "thixotropy = { build_up = \"12 Pa/min\", structure = 0.5 }\n[material.bingham]";
    let text = SLUMP_FLOW.replacen("[material.bingham]", thixotropy, 1);
    let text = text.replacen("[[fluid]]", "[[fluid]]\nstructure = 2", 1);
    let case = Case::parse("thixotropy.toml", &text).unwrap();
    let Thixotropy { build_up_time, breakdown } = case.material.thixotropy.unwrap();
    // 50 Pa at 0.2 Pa/s.
    assert!((build_up_time - 250.0).abs() < 1e-9 && breakdown == 0.005);
    let own = |n: usize| case.structure(case.fluid[n].structure);
    assert_eq!((own(0), own(1)), (Some(2.0), Some(0.5)));
    assert_eq!(Case::parse("slump_flow.toml", SLUMP_FLOW).unwrap().structure(None), None);
}

#[test]
fn fluid_comes_in_and_leaves() {
    let start = SLUMP_FLOW.find("[[fluid]]").unwrap();
    let end = SLUMP_FLOW.find("[lbm]").unwrap();
    let pour = "[[inlet]]\n\
        disc = { centre = [\"0.2 m\", \"0.2 m\", \"0.3 m\"], direction = [0, 0, -2], diameter = \"80 mm\" }\n\
        flow_rate = \"0.5 l/s\"\nstop = \"10 s\"\nbatch = \"first\"\nabove_fill = { distance = \"100 mm\" }\n\
        [[inlet]]\n\
        rectangle = { centre = [\"0 m\", \"0.2 m\", \"0.1 m\"], direction = [1, 0, 0], size = [\"60 mm\", \"0.1 m\"] }\n\
        speed = \"0.1 m/s\"\nstart = \"10 s\"\nvolume = \"2 l\"\nbatch = \"second\"\n\
        motion.uniform.velocity = [\"0 m/s\", \"0 m/s\", \"1 mm/s\"]\n\
        [[outlet]]\nbox = { min = [\"0.4 m\", \"0 m\", \"0 m\"], max = [\"0.45 m\", \"1 m\", \"1 m\"] }\n";
    let text = format!("{}{pour}{}", &SLUMP_FLOW[..start], &SLUMP_FLOW[end..]);
    let case = Case::parse("pour.toml", &text.replace("x_max = \"wall\"", "x_max = \"open\"")).unwrap();
    assert!(case.fluid.is_empty());
    let centre = DVec3::new(0.2, 0.2, 0.3);
    let disc = Face { centre, direction: DVec3::NEG_Z, outline: Outline::Disc { radius: 0.04 } };
    let [first, second] = case.inlets.as_slice() else { panic!("two inlets") };
    assert_eq!((first.face, &first.motion), (disc, &Motion::REST));
    assert_eq!(first.above_fill, Some(AboveFill { distance: 0.1, speed: 0.05 }));
    assert_eq!(second.above_fill, None);
    assert_eq!((first.flow_rate, first.start, first.stop), (0.5e-3, 0.0, 10.0));
    assert_eq!(first.volume, f64::INFINITY);
    assert_eq!(second.face.outline, Outline::Rectangle { size: [0.06, 0.1] });
    assert!((second.flow_rate - 0.6e-3).abs() < 1e-15);
    assert_eq!((second.start, second.stop, second.volume), (10.0, f64::INFINITY, 2e-3));
    assert_eq!(case.outlets[0].min, DVec3::new(0.4, 0.0, 0.0));
    assert_eq!(case.domain.sides[1], Side::Open);
    assert_eq!(case.batches(), ["first", "second"]);
}

#[test]
fn what_is_left_out_takes_its_default() {
    let case = Case::parse("channel.toml", CHANNEL).unwrap();
    let Method::Lbm(lbm) = case.method else { panic!("{:?}", case.method) };
    assert_eq!((lbm.precision, lbm.time_step, lbm.stepping), (Precision::F32, None, Stepping::Fixed));
    assert_eq!((lbm.hydrostatic_error, lbm.lattice_speed), (0.02, 0.1));
    assert_eq!(case.domain.sides[4..], [Side::REST; 2]);
    assert_eq!((case.stop.rest, case.gauges.spread), (None, None));
    assert_eq!(case.output.checkpoint_interval, 60.0);

    let without_gravity: String =
        CHANNEL.lines().filter(|line| !line.contains("gravity")).map(|l| format!("{l}\n")).collect();
    let case = Case::parse("channel.toml", &without_gravity).unwrap();
    assert_eq!(case.domain.gravity, DVec3::new(0.0, 0.0, -9.81));
}

/// A load is on the solid and its images beside its way, and with a mass weight is too.
#[test]
fn a_load_moves_a_solid() {
    let plate = "[[solid]]\nname = \"plate\"\nbox = { min = [\"-1 m\", \"-1 m\", \"0.31 m\"], max = [\"1 m\", \"1 m\", \"1 m\"] }\n\
                 motion.load = { force = [\"0 N\", \"0 N\", \"-8 N\"] }\n\n[lbm]";
    let case = Case::parse("plate.toml", &SLUMP_FLOW.replace("[lbm]", plate)).unwrap();
    let load = Load { force: DVec3::new(0.0, 0.0, -8.0), mass: 0.0 };
    assert_eq!((case.solids[0].load, &case.solids[0].motion), (Some(load), &Motion::REST));
    let mirrors = case.domain.sides[..4].iter().filter(|side| **side == Side::Symmetry).count() as i32;
    let share = 0.5f64.powi(mirrors);
    let loaded = case.loaded().unwrap();
    assert_eq!((loaded.solid, loaded.direction, loaded.mass), (0, DVec3::NEG_Z, 0.0));
    assert!((loaded.force - 8.0 * share).abs() < 1e-12);
    let heavy = plate.replace("\"-8 N\"] }", "\"-8 N\"], mass = \"2 kg\" }");
    let case = Case::parse("plate.toml", &SLUMP_FLOW.replace("[lbm]", &heavy)).unwrap();
    let weight = 2.0 * case.domain.gravity.length();
    assert!((case.loaded().unwrap().force - share * (8.0 + weight)).abs() < 1e-12);
    assert!(case.loaded().unwrap().mass == 2.0 * share && !case.solids_move(0.0));
}

/// The settings of another method may stand beside them.
#[test]
fn the_same_case_is_read_for_particles() {
    let sections = "[isph]\nspacing = \"10 mm\"\n\n[lbm]";
    let particles = SLUMP_FLOW.replace("\"lbm\"", "\"isph\"").replace("[lbm]", sections);
    let case = Case::parse("slump_flow.toml", &particles).unwrap();
    let expected = Isph {
        spacing: 0.01,
        courant: 0.25,
        stress: StressStep::Implicit,
        strain_convention: StrainConvention::Standard,
        largest_viscosity: None,
        time_step: None,
        scheme: Scheme::Projection,
    };
    assert_eq!(case.method, Method::Isph(expected));
    assert_eq!((case.method.name(), case.method.resolution_key()), ("isph", "isph.spacing"));

    let settings = "spacing = \"5 mm\"\ncourant = 0.1\nstress = \"explicit\"\nstrain_convention = \"paper\"\nlargest_viscosity = \"50 kPa s\"";
    let case = Case::parse("slump_flow.toml", &particles.replace("spacing = \"10 mm\"", settings)).unwrap();
    let expected = Isph {
        spacing: 0.005,
        courant: 0.1,
        stress: StressStep::Explicit,
        strain_convention: StrainConvention::Paper,
        largest_viscosity: Some(5e4),
        time_step: None,
        scheme: Scheme::Projection,
    };
    assert_eq!(case.method, Method::Isph(expected));

    let three = particles
        .replace("\"isph\"", "\"sph\"")
        .replace("[isph]", "[sph]\ntime_step = \"1 ms\"\npressure = \"sweep\"");
    let case = Case::parse("slump_flow.toml", &three).unwrap();
    let Method::Isph(isph) = case.method else { panic!("{:?}", case.method) };
    assert_eq!((isph.scheme, isph.time_step), (Scheme::ThreeStep(PressureStep::Sweep), Some(1e-3)));
    assert_eq!((case.method.name(), case.method.resolution_key()), ("sph", "sph.spacing"));
}

#[test]
fn rest_without_a_spread_gauge_is_judged_by_speed() {
    let case = Case::parse("channel.toml", &format!("{CHANNEL}stop.rest = {{}}\n")).unwrap();
    assert_eq!(
        case.stop.rest,
        Some(Rest { spread_rate: 5e-5, growth: 5e-3, speed: 1e-3, level_rate: None, duration: 1.0 })
    );
}

#[test]
fn a_file_is_read_by_its_path() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/main/slump_flow.toml");
    assert_eq!(Case::read(&path).unwrap().text, SLUMP_FLOW);
    let error = Case::read(Path::new("no/such/case.toml")).unwrap_err();
    assert!(
        error.render(false).starts_with("error: cannot read the case file no/such/case.toml: "),
        "{}",
        error.render(false)
    );
}
