//! Wrong case files: each is the slump flow with one change, and is refused at the line and with the words expected.

use tremie_case::{Case, CaseError};

use super::SLUMP_FLOW;

/// What is replaced, by what, and the message expected: the part of the file that it points at, and a part of it.
struct Mistake {
    right: &'static str,
    wrong: &'static str,
    line: usize,
    column: usize,
    says: &'static str,
}

const fn mistake(
    right: &'static str,
    wrong: &'static str,
    line: usize,
    column: usize,
    says: &'static str,
) -> Mistake {
    Mistake { right, wrong, line, column, says }
}

/// The flow curve of the slump flow.
const BINGHAM: &str = "[material.bingham]\nyield_stress = \"50 Pa\"\nplastic_viscosity = \"30 Pa s\"";

const MISTAKES: &[Mistake] = &[
    // Syntax and keys.
    mistake("title =", "title", 1, 7, "key with no value, expected `=`"),
    mistake("\"lbm\"", "\"lbm", 2, 14, "not valid TOML"),
    mistake("[stop]", "[gauges]", 37, 2, "duplicate key"),
    mistake("yield_stress", "yeild_stress", 7, 1, "did you mean `yield_stress`?"),
    mistake("yield_stress", "yeild_stress", 7, 1, "known keys: yield_stress, plastic_viscosity"),
    mistake("cell_size", "temperature", 28, 1, "there is no key `temperature` in `lbm`"),
    mistake("[stop]", "[stopp]", 37, 2, "did you mean `stop`?"),
    mistake("[material.bingham]", "[material.bingam]", 6, 11, "did you mean `bingham`?"),
    mistake(
        "[material.bingham]",
        "[material.wax]",
        6,
        11,
        "known keys: density, regularisation, thixotropy, surface_tension, newtonian, bingham",
    ),
    mistake("[material.bingham]", "[material.power_law]", 7, 1, "known keys: consistency, index"),
    mistake("x_min", "left", 15, 1, "known keys: x_min, x_max, y_min"),
    mistake("top_diameter", "diameter", 21, 66, "in `fluid.cone`"),
    // Filling.
    mistake("[gauges]", "[gauges]\nfilling = true", 34, 11, "expected { dead_shear_rate"),
    mistake(
        "[gauges]",
        "[gauges]\nfilling = { dead_shear_rate = \"-1 1/s\" }",
        34,
        31,
        "must not be negative",
    ),
    mistake("[gauges]", "[gauges]\nfilling = { dead = \"1 1/s\" }", 34, 13, "there is no key `dead`"),
    // Surface tension.
    mistake(
        "[material.bingham]",
        "surface_tension = \"-0.07 N/m\"\n[material.bingham]",
        6,
        19,
        "must not be negative",
    ),
    mistake(
        "[material.bingham]",
        "surface_tension = \"0.07 N\"\n[material.bingham]",
        6,
        19,
        "0.07 N is a force, not a surface tension",
    ),
    // Thixotropy.
    mistake(
        BINGHAM,
        "newtonian = { viscosity = \"1 Pa s\" }\nthixotropy = { build_up = \"0.2 Pa/s\" }",
        7,
        14,
        "`material.thixotropy` is for the flow curve `bingham` with a yield stress",
    ),
    mistake(
        BINGHAM,
        "bingham = { yield_stress = \"0 Pa\", plastic_viscosity = \"30 Pa s\" }\nthixotropy = { build_up = \"0.2 Pa/s\" }",
        7,
        14,
        "remove this, or change the flow curve",
    ),
    mistake(
        BINGHAM,
        "bingham = { yield_stress = \"50 Pa\", plastic_viscosity = \"30 Pa s\" }\nthixotropy = { build_up = \"0.2 Pa/s\" }\nregularisation = { papanastasiou = { exponent = \"100 s\" } }",
        7,
        14,
        "as it stands",
    ),
    mistake(
        "[material.bingham]",
        "thixotropy = { breakdown = 0.005 }\n[material.bingham]",
        6,
        14,
        "`material.thixotropy.build_up` is missing",
    ),
    mistake(
        "[material.bingham]",
        "thixotropy = { build_up = \"0.2 Pa\" }\n[material.bingham]",
        6,
        27,
        "0.2 Pa/s",
    ),
    mistake(
        "[material.bingham]",
        "thixotropy = { build_up = \"0.2 Pa/s\", structure = -1 }\n[material.bingham]",
        6,
        51,
        "must not be negative",
    ),
    mistake("[[fluid]]", "[[fluid]]\nstructure = 0.5", 21, 13, "only a thixotropic fluid has a structure"),
    // Walls along which the fluid slides.
    mistake(
        "\nx_min = \"symmetry\"",
        "\nx_min = { surface = { slip_length = \"1 mm\" } }",
        15,
        23,
        "known keys: navier, film",
    ),
    mistake(
        "\nx_min = \"symmetry\"",
        "\nx_min = { surface = { navier = {}, film = {} } }",
        15,
        43,
        "is a second law",
    ),
    mistake(
        "\nx_min = \"symmetry\"",
        "\nx_min = { surface = { film = { wall_yield_stress = \"5 Pa\" } } }",
        15,
        30,
        "add wall_viscosity = \"300 Pa s/m\"",
    ),
    // Schemes of the textbooks.
    mistake(
        "cell_size =",
        "collision = \"cumulant\"\ncell_size =",
        28,
        13,
        "write \"mtrt\", \"bgk\", \"trt\" or \"regularised\"",
    ),
    mistake(
        "cell_size =",
        "lattice = \"d3q27\"\ncell_size =",
        28,
        11,
        "the program's own collision is for d3q19 only",
    ),
    mistake(
        "cell_size =",
        "collision = \"trt\"\npreset = \"svec-2013\"\ncell_size =",
        28,
        13,
        "the preset says this already",
    ),
    mistake(
        "cell_size =",
        "bulk_relaxation = 0.2\npreset = \"svec-2013\"\ncell_size =",
        28,
        19,
        "only the program's own scheme has a bulk viscosity to choose",
    ),
    mistake(
        "cell_size =",
        "stepping = \"adaptive\"\npreset = \"svec-2013\"\ncell_size =",
        28,
        12,
        "only the program's own scheme can change its steps",
    ),
    // Missing.
    mistake("title = \"Slump flow, EN 12350-8\"", "", 1, 1, "add title = \"Slump flow\""),
    mistake("density = \"2300 kg/m3\"", "", 4, 1, "add density = \"2300 kg/m3\""),
    mistake("cell_size = \"5 mm\"", "", 27, 1, "add cell_size = \"5 mm\""),
    mistake("time = \"2 min\"", "", 37, 1, "`stop.time` is missing"),
    mistake(", diameter = \"1 cm\"", "", 25, 12, "`fluid.cylinder.diameter` is missing"),
    mistake("cone = {", "#", 20, 1, "`fluid` has no shape"),
    mistake("[gauges]", "[output]\n[gauges]", 42, 2, "duplicate key"),
    // Types.
    mistake("\"2300 kg/m3\"", "true", 5, 11, "expected a density, such as \"2300 kg/m3\""),
    mistake("\"5 mm\"", "[5]", 28, 13, "expected a length, such as \"5 mm\""),
    mistake("\"Slump flow, EN 12350-8\"", "12350", 1, 9, "expected a text"),
    mistake("\"lbm\"", "1", 2, 10, "expected \"lbm\""),
    mistake("\"lbm\"", "\"fem\"", 2, 10, "`method` cannot be \"fem\""),
    mistake("\"f64\"", "\"f16\"", 29, 13, "write \"f32\" or \"f64\""),
    mistake("\"symmetry\"", "\"mirror\"", 15, 9, "write \"wall\", \"symmetry\", \"periodic\" or \"open\""),
    mistake("\"symmetry\"", "[]", 15, 9, "or { velocity = ["),
    mistake("max = [\"0.45 m\", ", "max = [", 12, 7, "is an array of 2 values"),
    mistake("[[fluid]]\ncylinder", "[fluid.x]\ny", 24, 8, "there is no key `x` in `fluid`"),
    mistake("{ centre = [\"0 m\", \"0 m\"] }", "\"yes\"", 35, 10, "expected { centre = "),
    // Quantities.
    mistake(
        BINGHAM,
        "[material.power_law]\nconsistency = \"9 Pa s\"\nindex = 1",
        7,
        15,
        "write \"9 Pa s^n\"",
    ),
    mistake("\"50 Pa\"", "50", 7, 16, "50 has no unit"),
    mistake("\"50 Pa\"", "\"50\"", 7, 16, "write \"50 Pa\""),
    mistake("\"50 Pa\"", "\"50 mm\"", 7, 16, "50 mm is a length, not a stress"),
    mistake("\"30 Pa s\"", "\"30 Pa sec\"", 8, 21, "there is no unit \"sec\""),
    mistake("\"2300 kg/m3\"", "\"2,3 t/m3\"", 5, 11, "write a decimal point"),
    mistake("\"2300 kg/m3\"", "nan", 5, 11, "does not begin with a number"),
    mistake("\"2300 kg/m3\"", "\"1e999 kg/m3\"", 5, 11, "too large"),
    mistake("\"0.32 m\"", "0.32", 12, 28, "write \"0.32 m\" or \"0.32 mm\""),
    mistake("\"3 %\"", "\"3 m\"", 31, 21, "3 m is a length, not a plain number"),
    // Bounds.
    mistake("\"2300 kg/m3\"", "\"-1 kg/m3\"", 5, 11, "`material.density` must be positive"),
    mistake("\"2300 kg/m3\"", "\"0 kg/m3\"", 5, 11, "`material.density` must be positive"),
    mistake("\"50 Pa\"", "\"-50 Pa\"", 7, 16, "must not be negative"),
    mistake("\"30 Pa s\"", "\"0 Pa s\"", 8, 21, "must be positive"),
    mistake("\"5 mm\"", "\"-5 mm\"", 28, 13, "`lbm.cell_size` must be positive"),
    mistake("\"0.2 ms\"", "\"0 s\"", 30, 13, "must be positive"),
    mistake("\"3 %\"", "\"300 %\"", 31, 21, "at most 1"),
    mistake("\"20 ms\"", "\"0 s\"", 34, 12, "`gauges.interval` must be positive"),
    mistake("\"2 min\"", "\"-2 min\"", 38, 8, "`stop.time` must be positive"),
    mistake("snapshot_interval = \"1 s\"", "snapshot_interval = \"-1 s\"", 42, 21, "must be positive"),
    mistake("\"300 mm\"", "\"0 mm\"", 21, 100, "`fluid.cone.height` must be positive"),
    mistake(
        BINGHAM,
        "[material.power_law]\nconsistency = \"9 Pa s^n\"\nindex = 0",
        8,
        9,
        "`material.power_law.index` must be positive",
    ),
    mistake(
        BINGHAM,
        "[material.cross]\nindex = 1.2\ntime = \"1 s\"\nzero_shear_viscosity = \"9 Pa s\"\n\
         infinite_shear_viscosity = \"0 Pa s\"",
        7,
        9,
        "`material.cross.index` must be positive and at most 1",
    ),
    // Contradictions.
    mistake(
        BINGHAM,
        "[material.carreau_yasuda]\nindex = 0.5\ntime = \"1 s\"\nzero_shear_viscosity = \"9 Pa s\"\n\
         infinite_shear_viscosity = \"10 Pa s\"",
        10,
        28,
        "write \"9 Pa s\" at most",
    ),
    mistake(
        BINGHAM,
        "newtonian = { viscosity = \"1 Pa s\" }\nregularisation = { papanastasiou = { exponent = \"100 s\" } }",
        7,
        18,
        "the flow curve has no yield stress",
    ),
    mistake(
        "[material.bingham]",
        "regularisation = { papanastasiou = { exponent = \"100 s\" }, bi_viscosity = { largest_viscosity = \"1e4 Pa s\" } }\n[material.bingham]",
        6,
        75,
        "is a second regularisation",
    ),
    mistake(
        "[material.bingham]",
        "regularisation = {}\n[material.bingham]",
        6,
        18,
        "`material.regularisation` has no regularisation",
    ),
    mistake(
        "[material.bingham]",
        "regularisation = { bi_viscosity = { largest_viscosity = \"20 Pa s\" } }\n[material.bingham]",
        6,
        57,
        "write more than \"30 Pa s\"",
    ),
    mistake(
        "[material.bingham]",
        "newtonian = { viscosity = \"1 Pa s\" }\n[material.bingham]",
        7,
        1,
        "second flow curve",
    ),
    mistake(
        "[\"0 m\", \"0 m\", \"0 m\"]",
        "[\"0 m\", \"0.45 m\", \"0 m\"]",
        12,
        18,
        "write more than \"0.45 m\"",
    ),
    mistake("x_min = \"symmetry\"", "x_min = \"periodic\"", 15, 9, "write x_max = \"periodic\" too"),
    mistake("x_max = \"wall\"", "z_max = \"periodic\"", 17, 9, "write z_min = \"periodic\" too"),
    mistake("x_max = \"wall\"", "x_max = \"periodic\"", 17, 9, "the opposite side"),
    mistake(
        "\"0.1 m/s\", \"0 m/s\", \"0 m/s\"",
        "\"0 m/s\", \"0 m/s\", \"1 m/s\"",
        18,
        41,
        "`z_min` must move within its own plane",
    ),
    mistake("\"5 mm\"", "\"0.4 m\"", 28, 13, "larger than the domain"),
    mistake("\"5 mm\"", "\"5 um\"", 28, 13, "5.18e14 cells"),
    mistake("\"0.45 m\", \"0.32 m\"", "\"0.4512 m\", \"0.32 m\"", 12, 18, "write \"0.45 m\" or \"0.455 m\""),
    mistake("\"0.32 m\"", "\"321 mm\"", 12, 28, "64.20 cells along z"),
    mistake("point = [\"0 m\"", "point = [\"1 m\"", 24, 1, "outside the domain"),
    mistake("[0, 2, 0]", "[0, 0, 0]", 25, 52, "has no direction"),
    mistake(
        "\"200 mm\", top_diameter = \"100 mm\"",
        "\"0 mm\", top_diameter = \"0 mm\"",
        21,
        56,
        "both diameters of the cone are zero",
    ),
    mistake(
        "cylinder = { point = [\"0 m\", \"0 m\", \"0 m\"], axis = [0, 2, 0], diameter = \"1 cm\" }",
        "box = { min = [\"1 m\", \"0 m\", \"0 m\"], max = [\"0 m\", \"1 m\", \"1 m\"] }",
        25,
        45,
        "the largest x must be larger",
    ),
    mistake("centre = [\"0 m\", \"0 m\"]", "centre = [\"0 m\", \"1 m\"]", 35, 29, "axis outside the domain"),
    mistake(
        "spread = { centre = [\"0 m\", \"0 m\"] }\n\n[stop]\ntime = \"2 min\"\nrest = {",
        "\n[stop]\ntime = \"2 min\"\nrest = { spread_rate = \"1 mm/s\",",
        38,
        24,
        "there is no spread gauge",
    ),
    // Numbers that are none, and infinite ones.
    mistake("\"50 Pa\"", "\"nan Pa\"", 7, 16, "does not begin with a number"),
    mistake("\"50 Pa\"", "\"inf Pa\"", 7, 16, "does not begin with a number"),
    mistake("\"2300 kg/m3\"", "inf", 5, 11, "does not begin with a number"),
    mistake("\"3 %\"", "nan", 31, 21, "does not begin with a number"),
    mistake("\"3 %\"", "-inf", 31, 21, "does not begin with a number"),
    mistake("[0, 2, 0]", "[nan, 0, 0]", 25, 53, "does not begin with a number"),
    mistake("[0, 2, 0]", "[0, inf, 0]", 25, 56, "does not begin with a number"),
    mistake("\"0.45 m\", \"0.45 m\"", "\"1e400 m\", \"0.45 m\"", 12, 8, "too large"),
    // Negative and zero where they mean nothing.
    mistake("\"0.2 ms\"", "\"-0.2 ms\"", 30, 13, "`lbm.time_step` must be positive"),
    mistake("\"3 %\"", "0", 31, 21, "must be positive"),
    mistake("\"3 %\"", "\"-3 %\"", 31, 21, "must be positive"),
    mistake("\"20 ms\"", "\"-20 ms\"", 34, 12, "must be positive"),
    mistake("\"2 min\"", "\"0 s\"", 38, 8, "`stop.time` must be positive"),
    mistake("\"2 mm/s\"", "\"-2 mm/s\"", 39, 18, "must be positive"),
    mistake("diameter = \"1 cm\"", "diameter = \"-1 cm\"", 25, 74, "must be positive"),
    mistake("base_diameter = \"200 mm\"", "base_diameter = \"-200 mm\"", 21, 56, "must not be negative"),
    mistake("hydrostatic_error = \"3 %\"", "lattice_speed = 0.5", 31, 17, "at most 0.3"),
    mistake("hydrostatic_error = \"3 %\"", "lattice_viscosity = -1", 31, 21, "must be positive"),
    mistake("snapshot_interval = \"1 s\"", "checkpoint_interval = \"0 s\"", 42, 23, "must be positive"),
    // Of another kind.
    mistake("\"-9.81 m/s2\"", "\"-9.81 m/s\"", 13, 32, "a speed, not an acceleration"),
    mistake("\"-9.81 m/s2\"", "-9.81", 13, 32, "-9.81 has no unit"),
    mistake("\"0 m/s\", \"0 m/s\", \"-0.1 m/s\"", "\"0 m/s\", \"-0.1 m/s\"", 22, 12, "an array of 2 values"),
    mistake("\"2300 kg/m3\"", "[\"2300 kg/m3\"]", 5, 11, "expected a density"),
    mistake("\"2300 kg/m3\"", "1979-05-27", 5, 11, "expected a density"),
    mistake("[output]", "[other]", 41, 2, "there is no key `other`"),
    mistake("rest = { speed = \"2 mm/s\" }", "rest = true", 39, 8, "expected {"),
    // What cannot work.
    mistake(
        "max = [\"0.45 m\", \"0.45 m\"",
        "max = [\"0.45 m\", \"15 mm\"",
        28,
        13,
        "only 3 cells across along y, too few beside a wall",
    ),
    mistake(
        "cylinder = { point = [\"0 m\", \"0 m\", \"0 m\"], axis = [0, 2, 0], diameter = \"1 cm\" }",
        "sphere = { centre = [\"0.5 m\", \"0.5 m\", \"0.1 m\"], diameter = \"130 mm\" }",
        24,
        1,
        "none of this fluid lies in the domain",
    ),
    mistake("diameter = \"1 cm\"", "diameter = \"1 um\"", 24, 1, "larger than a cell"),
    mistake("point = [\"0 m\"", "point = [\"1e300 m\"", 24, 1, "outside the domain"),
    mistake(
        "rest = { speed = \"2 mm/s\" }",
        "rest = { duration = \"3 min\" }",
        39,
        21,
        "the run ends before it can have been at rest for so long",
    ),
    mistake("snapshot_interval = \"1 s\"", "snapshot_interval = \"1 us\"", 42, 21, "more than 999999 files"),
    mistake("snapshot_interval = \"1 s\"", "picture_interval = \"0.1 ms\"", 42, 20, "more than 999999 files"),
];

/// Wrong solids, each put before the slump flow's `[lbm]` in line 27: line and column from there, and the words expected.
const WRONG_SOLIDS: &[(&str, usize, usize, &str)] = &[
    (
        "name = \"my gate\"\nsphere = { centre = [\"0.2 m\", \"0.1 m\", \"0.1 m\"], diameter = \"20 mm\" }",
        2,
        8,
        "write a letter, then letters, digits and _, such as \"gate\"",
    ),
    (
        "name = \"solid2\"\nsphere = { centre = [\"0.2 m\", \"0.1 m\", \"0.1 m\"], diameter = \"20 mm\" }\n\
         [[solid]]\nsphere = { centre = [\"0.2 m\", \"0.1 m\", \"0.1 m\"], diameter = \"20 mm\" }",
        4,
        1,
        "two solids are called `solid2`",
    ),
    (
        "bar = { start = [\"0.2 m\", \"0.1 m\", \"0 m\"], end = [\"20 cm\", \"0.1 m\", \"0 m\"], diameter = \"20 mm\" }",
        2,
        50,
        "is where the bar starts",
    ),
    ("surface = \"no_slip\"", 1, 1, "`solid` has no shape"),
    (
        "sphere = { centre = [\"0.2 m\", \"0.1 m\", \"0.1 m\"], diameter = \"20 mm\" }\nsurface = \"slippery\"",
        3,
        11,
        "write \"no_slip\" or \"free_slip\"",
    ),
    ("cube = {}", 2, 1, "known keys: name, box, sphere, cone, cylinder, capsule, bar, plane, cone_shell"),
    (
        "cone_shell = { base = [\"0 m\", \"0 m\", \"0 m\"], base_diameter = \"200 mm\", top_diameter = \"100 mm\", height = \"300 mm\", thickness = \"1.5 mm\" }",
        2,
        128,
        "write \"0.0051 m\" at least",
    ),
    (
        "union.of = [{ sphere = { centre = [\"0.1 m\", \"0.1 m\", \"0.1 m\"], diameter = \"2 mm\" } }]",
        2,
        75,
        "the cells are too large to see this",
    ),
    ("plane = { point = [\"0 m\", \"0 m\", \"0 m\"], normal = [0, 0, 0] }", 2, 51, "has no direction"),
    (
        "sphere = { centre = [\"2 m\", \"0.1 m\", \"0.1 m\"], diameter = \"20 mm\" }",
        1,
        1,
        "this solid lies outside the domain",
    ),
    (
        "sphere = { centre = [\"2 m\", \"0.1 m\", \"0.1 m\"], diameter = \"20 mm\" }\nmotion = {}",
        3,
        10,
        "`solid.motion` has no motion",
    ),
    (
        "sphere = { centre = [\"0.2 m\", \"0.1 m\", \"0.1 m\"], diameter = \"20 mm\" }\n\
         motion.path.points = [{ time = \"2 s\", offset = [\"0 m\", \"0 m\", \"0 m\"] }, { time = \"1 s\", offset = [\"0 m\", \"0 m\", \"0 m\"] }]",
        3,
        82,
        "write more than \"2 s\"",
    ),
];

/// Wrong inlets, in the same way.
const WRONG_INLETS: &[(&str, usize, usize, &str)] = &[
    ("flow_rate = \"1 l/s\"", 1, 1, "`inlet` has no face"),
    (DOWN, 1, 1, "add flow_rate = \"1 l/s\", say, or a speed"),
    (
        "disc = { centre = [\"0.1 m\", \"0.1 m\", \"0.2 m\"], direction = [0, 0, -1], diameter = \"80 mm\" }\n\
         flow_rate = \"1 l/s\"\nspeed = \"1 m/s\"",
        4,
        9,
        "keep only one of them",
    ),
    (
        "disc = { centre = [\"0.1 m\", \"0.1 m\", \"0.2 m\"], direction = [0, 0, 0], diameter = \"80 mm\" }\nspeed = \"1 m/s\"",
        2,
        60,
        "write [0, 0, -1] for downwards",
    ),
    (
        "rectangle = { centre = [\"0.1 m\", \"0.1 m\", \"0.2 m\"], direction = [0, 0, 1], size = [\"80 mm\", \"9 mm\"] }\nspeed = \"1 m/s\"",
        2,
        83,
        "write \"0.01 m\" at least",
    ),
    (
        "disc = { centre = [\"2 m\", \"0.1 m\", \"0.2 m\"], direction = [0, 0, 1], diameter = \"80 mm\" }\nspeed = \"1 m/s\"",
        1,
        1,
        "lies outside the domain from the start to the end",
    ),
    (
        "disc = { centre = [\"0.1 m\", \"0.1 m\", \"0.2 m\"], direction = [0, 0, 1], diameter = \"80 mm\" }\nspeed = \"1 m/s\"\n\
         start = \"2 s\"\nstop = \"1 s\"",
        5,
        8,
        "write more than \"2 s\"",
    ),
    (
        "disc = { centre = [\"0.1 m\", \"0.1 m\", \"0.2 m\"], direction = [0, 0, 1], diameter = \"80 mm\" }\nspeed = \"1 m/s\"\n\
         start = \"1 h\"",
        4,
        9,
        "the run ends before this inlet begins",
    ),
    (
        "disc = { centre = [\"0.1 m\", \"0.1 m\", \"0.2 m\"], direction = [0, 0, -1], diameter = \"80 mm\" }\nspeed = \"1 m/s\"\n\
         motion.uniform.velocity = [\"0 m/s\", \"0 m/s\", \"0 m/s\"]\nabove_fill = { distance = \"50 mm\" }",
        5,
        14,
        "keep only one of them",
    ),
    (
        "disc = { centre = [\"0.1 m\", \"0.1 m\", \"0.2 m\"], direction = [0, 0, -1], diameter = \"80 mm\" }\nspeed = \"1 m/s\"\n\
         above_fill = { distance = \"4 mm\" }",
        4,
        27,
        "write \"0.005 m\" at least",
    ),
    (
        "disc = { centre = [\"0.1 m\", \"0.1 m\", \"0.2 m\"], direction = [0, 0, -1], diameter = \"80 mm\" }\nspeed = \"1 m/s\"\n\
         above_fill = { speed = \"10 mm/s\" }",
        4,
        14,
        "`inlet.above_fill.distance` is missing",
    ),
    (
        "disc = { centre = [\"0.1 m\", \"0.1 m\", \"0.2 m\"], direction = [0, 0, -1], diameter = \"80 mm\" }\nspeed = \"1 m/s\"\n\
         above_fill = { distance = \"0 mm\", speed = \"10 mm/s\" }",
        4,
        27,
        "must be positive",
    ),
];

/// An inlet that does not say how much comes in.
const DOWN: &str =
    "disc = { centre = [\"0.1 m\", \"0.1 m\", \"0.2 m\"], direction = [0, 0, -1], diameter = \"80 mm\" }";

/// Wrong gauges and stop rules, each put after those of the slump flow (lines 35 and 40), and the words expected.
const WRONG_GAUGES: &[(&str, &str, usize, &str)] = &[
    ("level = []", "", 36, "`gauges.level` is empty"),
    (
        "level = [{ min = [\"0 m\", \"0 m\"], max = [\"1 cm\", \"1 cm\"] }]",
        "",
        36,
        "`gauges.level.name` is missing",
    ),
    (
        "level = [{ name = \"H\", min = [\"0 m\", \"2 cm\"], max = [\"1 cm\", \"1 cm\"] }]",
        "",
        36,
        "the largest y is smaller than the smallest",
    ),
    (
        "level = [{ name = \"H\", min = [\"0 m\", \"0 m\"], max = [\"1 cm\", \"46 cm\"] }]",
        "",
        36,
        "write \"-0.45 m\" to \"0.45 m\"",
    ),
    (
        "level = [{ name = \"H\", min = [\"0 m\", \"0 m\"], max = [\"0 m\", \"0 m\"] }, { name = \"H\", min = [\"0 m\", \"0 m\"], max = [\"0 m\", \"0 m\"] }]",
        "",
        36,
        "two level gauges are called `H`",
    ),
    ("pressure = [{ name = \"form\", wall = \"left\" }]", "", 36, "there is no side or solid called `left`"),
    (
        "pressure = [{ name = \"form\", wall = \"x_max\", bands = 2.5 }]",
        "",
        36,
        "`gauges.pressure.bands` must be a whole number",
    ),
    (
        "pressure = [{ name = \"form\", wall = \"x_max\", min = [\"0 m\", \"0 m\", \"1 cm\"], max = [\"1 cm\", \"1 cm\", \"1 cm\"] }]",
        "",
        36,
        "the box has no height",
    ),
    (
        "pressure = [{ name = \"form\", wall = \"x_max\", max = [\"0 m\", \"0 m\", \"9 m\"] }]",
        "",
        36,
        "what is measured lies outside the domain",
    ),
    (
        "front = [{ name = \"T\", direction = \"up\", at = \"1 cm\" }]",
        "",
        36,
        "`gauges.front.direction` cannot be \"up\"",
    ),
    ("front = [{ name = \"T\", direction = \"z\", at = \"1 m\" }]", "", 36, "write \"0 m\" to \"0.32 m\""),
    (
        "light = [{ name = \"t\", min = [\"0 m\", \"0 m\", \"0 m\"], max = [\"1 cm\", \"1 cm\", \"1 cm\"], with = \"mould\" }]",
        "",
        36,
        "there is no solid called `mould`",
    ),
    ("", "event = \"T\"", 40, "there is none: leave this out"),
    (
        "front = [{ name = \"T1\", direction = \"x\", at = \"20 cm\" }, { name = \"T2\", direction = \"x\", at = \"30 cm\" }]",
        "event = \"T\"",
        41,
        "write \"T1\" or \"T2\"",
    ),
];

#[test]
fn wrong_gauges_are_told_at_their_place() {
    for (gauge, stop, line, says) in WRONG_GAUGES {
        let newline = |text: &str| if text.is_empty() { String::new() } else { format!("{text}\n") };
        let text = SLUMP_FLOW
            .replace("\n[stop]", &format!("{}\n[stop]", newline(gauge)))
            .replace("\n[output]", &format!("{}\n[output]", newline(stop)));
        let message = refusal(&text).to_string();
        assert!(
            message.contains(&format!("slump_flow.toml:{line}:")) && message.contains(says),
            "expected line {line}: {says}\nbut got\n{message}"
        );
    }
}

fn each_is_told_at_its_place(table: &str, wrong: &[(&str, usize, usize, &str)]) {
    for (lines, line, column, says) in wrong {
        let error = refusal(&SLUMP_FLOW.replace("[lbm]", &format!("[[{table}]]\n{lines}\n\n[lbm]")));
        let message = error.to_string();
        let place = format!("slump_flow.toml:{}:{column}\n", line + 26);
        assert!(
            message.contains(&place) && message.contains(says),
            "expected {place}{says}\nbut got\n{message}"
        );
    }
}

#[test]
fn wrong_inlets_and_outlets_are_told_at_their_place() {
    each_is_told_at_its_place("inlet", WRONG_INLETS);
    let sideways = SLUMP_FLOW.replace("\"-9.81 m/s2\"]", "\"9.81 m/s2\"]");
    assert_ne!(sideways, SLUMP_FLOW);
    let hose =
        format!("[[inlet]]\n{DOWN}\nspeed = \"1 m/s\"\nabove_fill = {{ distance = \"50 mm\" }}\n\n[lbm]");
    let message = refusal(&sideways.replace("[lbm]", &hose)).to_string();
    assert!(message.contains("let gravity point along -z"), "{message}");
    let outside = "box = { min = [\"2 m\", \"0 m\", \"0 m\"], max = [\"3 m\", \"1 m\", \"1 m\"] }";
    each_is_told_at_its_place("outlet", &[(outside, 2, 7, "this outlet lies outside the domain")]);
    let flat = "box = { min = [\"0 m\", \"0 m\", \"0 m\"], max = [\"3 m\", \"0 m\", \"1 m\"] }";
    each_is_told_at_its_place("outlet", &[(flat, 2, 52, "the largest y must be larger")]);
    let simple = SLUMP_FLOW.replace("x_max = \"wall\"", "x_max = \"open\"");
    let message = refusal(&simple.replace("cell_size =", "collision = \"trt\"\ncell_size =")).to_string();
    assert!(message.contains("only the program's own scheme knows outlets and open sides"), "{message}");
}

/// What only the lattice knows is refused where it stands.
#[test]
fn what_particles_do_not_know_is_told() {
    let particles =
        SLUMP_FLOW.replace("\"lbm\"", "\"isph\"").replace("[lbm]", "[isph]\nspacing = \"10 mm\"\n\n[lbm]");
    let inlet = "[[inlet]]\ndisc = { centre = [\"0.2 m\", \"0.2 m\", \"0.3 m\"], direction = [0, 0, -1], diameter = \"80 mm\" }\nflow_rate = \"1 l/s\"\n\n[isph]";
    let film =
        "x_max = { surface = { film = { wall_yield_stress = \"10 Pa\", wall_viscosity = \"200 Pa s/m\" } } }";
    for (right, wrong, says) in [
        ("[isph]", inlet, ["the method `isph` does not know inlets", "write method = \"lbm\""]),
        ("x_max = \"wall\"", film, ["knows no walls with a film", "a slip length"]),
        (
            "[material.bingham]",
            "surface_tension = \"0.05 N/m\"\n[material.bingham]",
            ["the method `isph` does not know surface tension", "leave this out"],
        ),
        ("spacing = \"10 mm\"", "spacing = \"7 mm\"", ["64.29 cells along x", "\"0.448 m\""]),
        ("spacing = \"10 mm\"", "", ["`isph.spacing` is missing", "spacing ="]),
    ] {
        assert!(particles.contains(right), "{right}");
        let message = refusal(&particles.replacen(right, wrong, 1)).render(false);
        assert!(says.iter().all(|says| message.contains(says)), "{message}");
    }
}

#[test]
fn wrong_solids_are_told_at_their_place() {
    each_is_told_at_its_place("solid", WRONG_SOLIDS);
    // What is suggested is accepted.
    let (thin, ..) = WRONG_SOLIDS.iter().find(|(solid, ..)| solid.starts_with("cone_shell")).unwrap();
    let better = thin.replace("1.5 mm", "0.0051 m");
    Case::parse("better.toml", &SLUMP_FLOW.replace("[lbm]", &format!("[[solid]]\n{better}\n\n[lbm]")))
        .unwrap();
    let pressed = |force: &str| {
        format!(
            "[[solid]]\nsphere = {{ centre = [\"0.2 m\", \"0.1 m\", \"0.1 m\"], diameter = \"20 mm\" }}\nmotion.load.force = {force}\n"
        )
    };
    let down = pressed("[\"0 N\", \"0 N\", \"-1 N\"]");
    for (solids, says) in [
        (pressed("[\"1 N\", \"0 N\", \"-1 N\"]"), "the force is not along an axis"),
        (pressed("[\"0 N\", \"0 N\", \"0 N\"]"), "there is no force"),
        (format!("{down}{down}"), "more than one solid is moved by a load"),
    ] {
        let message = refusal(&SLUMP_FLOW.replace("[lbm]", &format!("{solids}[lbm]"))).to_string();
        assert!(message.contains(says), "{message}");
    }
    let nodes = SLUMP_FLOW.replace("\"lbm\"", "\"ldd\"");
    let nodes = nodes.replace("[lbm]", &format!("{down}[ldd]\nspacing = \"10 mm\"\n\n[lbm]"));
    let message = refusal(&nodes).to_string();
    assert!(message.contains("loads do not move solids by this method"), "{message}");
    // A solid may come into the domain later.
    let late = "[[solid]]\nsphere = { centre = [\"2 m\", \"0.1 m\", \"0.1 m\"], diameter = \"20 mm\" }\n\
                motion.uniform.velocity = [\"-0.1 m/s\", \"0 m/s\", \"0 m/s\"]\n[lbm]";
    Case::parse("late.toml", &SLUMP_FLOW.replace("[lbm]", late)).unwrap();
}

fn refusal(text: &str) -> CaseError {
    match Case::parse("slump_flow.toml", text) {
        Ok(_) => panic!("accepted:\n{text}"),
        Err(error) => error,
    }
}

#[test]
fn each_mistake_is_told_at_its_place() {
    let mut failures = String::new();
    for Mistake { right, wrong, line, column, says } in MISTAKES {
        assert!(SLUMP_FLOW.contains(right), "{right}");
        let error = refusal(&SLUMP_FLOW.replacen(right, wrong, 1));
        let message = error.to_string();
        let CaseError::Invalid(invalid) = error else { panic!("not about the text: {message}") };
        let place = format!("slump_flow.toml:{line}:{column}\n");
        let told = (invalid.line(), invalid.column()) == (*line, *column) && message.contains(&place);
        if !told || !message.contains(says) {
            failures += &format!("for {wrong:?} expected {place}{says}\nbut got\n{message}\n\n");
        }
    }
    assert!(failures.is_empty(), "{failures}");
}

#[test]
fn a_case_without_fluid_is_refused() {
    let start = SLUMP_FLOW.find("[[fluid]]").unwrap();
    let end = SLUMP_FLOW.find("[lbm]").unwrap();
    let without = format!("{}{}", &SLUMP_FLOW[..start], &SLUMP_FLOW[end..]);
    assert!(refusal(&without).to_string().contains("[[fluid]]\n"));
    assert!(refusal(&format!("fluid = []\n{without}")).to_string().contains("`fluid` is empty"));
    assert!(refusal(&format!("{without}[fluid]\n")).to_string().contains("expected [[fluid]]"));
}

#[test]
fn the_size_suggested_is_accepted() {
    // Sizes that are not round in binary, from corners that are not zero.
    for (min, max) in [("-0.013 m", "0.4499 m"), ("0.1 mm", "7 cm"), ("-30.007 m", "-29.5 m")] {
        let text = SLUMP_FLOW
            .replacen("min = [\"0 m\"", &format!("min = [\"{min}\""), 1)
            .replacen("max = [\"0.45 m\"", &format!("max = [\"{max}\""), 1)
            .replace("cone = { base = [\"0 m\"", "cone = { base = [\"-29.8 m\"");
        let message = refusal(&text).to_string();
        let (_, suggestions) = message.split_once("write \"").expect("a size to write");
        let (size, _) = suggestions.split_once('"').unwrap();
        let better = text.replacen(max, size, 1);
        if let Err(error) = Case::parse("better.toml", &better) {
            assert!(!error.to_string().contains("not a whole number"), "{error}");
        }
    }
}

#[test]
fn a_message_shows_the_line_and_what_to_write() {
    let message = refusal(&SLUMP_FLOW.replace("0.45 m", "0.4512 m")).to_string();
    let expected = r#"error: the domain is 90.24 cells along x, not a whole number
  --> slump_flow.toml:12:8
   |
12 | max = ["0.4512 m", "0.4512 m", "0.32 m"]
   |        ^^^^^^^^^^ write "0.45 m" or "0.455 m"
...
28 | cell_size = "5 mm"
   |             ------ the cell size"#;
    assert_eq!(message, expected);
}

#[test]
fn colours_are_shown_only_if_wanted() {
    let error = refusal("");
    assert!(error.render(true).contains('\u{1b}'));
    assert!(!error.render(false).contains('\u{1b}'));
    assert_eq!(error.render(false), error.to_string());
}

#[test]
fn a_rate_of_levels_needs_a_level() {
    let text = SLUMP_FLOW.replace("{ speed = \"2 mm/s\" }", "{ level_rate = \"0.1 mm/s\" }");
    let message = refusal(&text).to_string();
    assert!(message.contains("slump_flow.toml:39:") && message.contains("no level is read"), "{message}");
    let gauge = "level = [{ name = \"H\", min = [\"0 m\", \"0 m\"], max = [\"1 cm\", \"1 cm\"] }]";
    let text = text.replace("\n[stop]", &format!("{gauge}\n\n[stop]"));
    let case = Case::parse("slump_flow.toml", &text).unwrap();
    assert_eq!(case.stop.rest.and_then(|rest| rest.level_rate), Some(1e-4));
}
