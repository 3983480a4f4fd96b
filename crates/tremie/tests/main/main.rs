//! The program as its users see it: through the real binary.

// Helpers of tests are tests too.
#![allow(clippy::unwrap_used)]

mod beams;
mod bodies;
mod casts;
mod particles;
mod robustness;
mod stl;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

use serde_json::Value;
use tempfile::TempDir;

/// A slump on coarse cells: a second or so in a debug build.
const CASE: &str = r#"title = "Coarse slump"
method = "lbm"

[material]
density = "2300 kg/m3"
bingham = { yield_stress = "50 Pa", plastic_viscosity = "30 Pa s" }

[domain]
min = ["0 mm", "0 mm", "0 mm"]
max = ["340 mm", "340 mm", "320 mm"]
sides = { x_min = "symmetry", y_min = "symmetry" }

[[fluid]]
cone = { base = ["0 m", "0 m", "0 m"], base_diameter = "200 mm", top_diameter = "100 mm", height = "300 mm" }

[lbm]
cell_size = "20 mm"

[gauges]
interval = "20 ms"
spread = { centre = ["0 m", "0 m"] }

[stop]
time = "1 s"

[output]
snapshot_interval = "0.3 s"
picture_interval = "0.5 s"
"#;

fn tremie(place: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_tremie"));
    command.current_dir(place).args(arguments).env("NO_COLOR", "1");
    command
}

fn output(place: &Path, arguments: &[&str]) -> Output {
    tremie(place, arguments).output().unwrap()
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).unwrap()
}

/// Runs the program, which must succeed; what it wrote to standard output.
fn done(place: &Path, arguments: &[&str]) -> String {
    let output = output(place, arguments);
    assert!(output.status.success(), "{arguments:?}: {}", text(&output.stderr));
    text(&output.stdout)
}

/// A folder with the case in it, after replacements in its text.
fn folder_with_case(replacements: &[(&str, &str)]) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let case = replacements.iter().fold(CASE.to_owned(), |case, (old, new)| {
        assert!(case.contains(old), "{old}");
        case.replace(old, new)
    });
    fs::write(folder.path().join("slump.toml"), case).unwrap();
    folder
}

/// A page without what is in its pictures, where any four letters may stand.
fn without_pictures(page: &str) -> String {
    let parts = page.split("src=\"data:").enumerate();
    parts
        .map(|(n, part)| if n == 0 { part } else { part.split_once('"').map_or("", |(_, rest)| rest) })
        .collect()
}

fn json(path: &Path) -> Value {
    serde_json::from_str(&fs::read_to_string(path).unwrap()).unwrap()
}

#[test]
fn a_run_leaves_a_complete_folder() {
    let place = folder_with_case(&[]);
    let told = done(place.path(), &["run", "slump.toml", "--quiet"]);
    assert!(told.contains("stop time reached") && told.contains("runs/slump"), "{told}");

    let run = place.path().join("runs/slump");
    assert_eq!(fs::read_to_string(run.join("case.toml")).unwrap(), CASE);
    let summary = json(&run.join("summary.json"));
    assert_eq!(summary["end_reason"], "time");
    assert!((0.3..0.5).contains(&summary["spread_m"].as_f64().unwrap()), "{summary}");
    let record = json(&run.join("run.json"));
    assert!(record["scaling"]["time_step_s"].as_f64().unwrap() > 0.0);
    assert_eq!(record["scaling"]["cells"], serde_json::json!([17, 17, 16]));

    let series = fs::read_to_string(run.join("series.csv")).unwrap();
    assert!(series.starts_with("time_s,spread_m,"), "{series}");
    assert!((50..=53).contains(&series.lines().count()), "{}", series.lines().count());
    // Five moments of the fields and four pictures: each interval, and the end.
    for (name, beginning) in [
        ("fluid_000004.vti", &b"<?xml"[..]),
        ("surface_000004.vtp", b"<?xml"),
        ("fluid.pvd", b"<?xml"),
        ("surface.pvd", b"<?xml"),
        ("above_000002.png", b"\x89PNG"),
        ("cut_000002.png", b"\x89PNG"),
    ] {
        let bytes = fs::read(run.join(name)).unwrap_or_else(|error| panic!("{name}: {error}"));
        assert!(bytes.starts_with(beginning), "{name}");
    }
    let vti = fs::read(run.join("fluid_000004.vti")).unwrap();
    let header = String::from_utf8_lossy(&vti[..400]).into_owned();
    assert!(header.contains("ImageData") && header.contains("WholeExtent"), "{header}");
}

#[test]
fn the_laboratory_tells_a_slump_flow() {
    let place = tempfile::tempdir().unwrap();
    // Stiff and thin enough to rest soon on cells that are far too coarse.
    let mix =
        ["lab", "slump-flow", "--cell-size", "20mm", "--yield-stress", "400Pa", "--viscosity", "20Pa.s"];
    let told = done(place.path(), &[&mix[..], &["--quiet"]].concat());
    for word in ["slump flow", "T500", "below SF1", "slump ", "spreading formula", "came to rest"] {
        assert!(told.contains(word), "{word}: {told}");
    }
    let run = place.path().join("runs/slump-flow");
    let page = fs::read_to_string(run.join("report.html")).unwrap();
    assert!(told.contains("runs/slump-flow/report.html") && page.contains("below SF1"), "{told}");
    let summary = json(&run.join("summary.json"));
    assert_eq!(summary["sf_class"], "below SF1");
    assert_eq!((&summary["vs_class"], &summary["t500_s"]), (&Value::Null, &Value::Null));
    assert!(summary["slump_mm"].as_f64().unwrap() > 100.0);
    let flow = 500.0 * (summary["spread_x_m"].as_f64().unwrap() + summary["spread_y_m"].as_f64().unwrap());
    assert!((summary["slump_flow_mm"].as_f64().unwrap() - flow).abs() < 1e-9);

    // Resumed after its end it tells the same, from its record.
    let again: Value =
        serde_json::from_str(&done(place.path(), &["resume", "runs/slump-flow", "--json", "-q"])).unwrap();
    assert_eq!(again["slump_flow_mm"], summary["slump_flow_mm"]);
    // Its case can be run by itself, in the same steps.
    done(place.path(), &["run", "runs/slump-flow/case.toml", "--out", "again", "-q", "--threads", "1"]);
    let series = |run: &Path| fs::read(run.join("series.csv")).unwrap();
    assert!(series(&run) == series(&place.path().join("again")));
}

#[test]
fn the_laboratory_lifts_a_cone_and_tells_a_slump() {
    let place = tempfile::tempdir().unwrap();
    let mix = ["--cell-size", "20mm", "--yield-stress", "400Pa", "--viscosity", "20Pa.s", "--lift", "0.3m/s"];
    let told = done(place.path(), &[&["lab", "slump", "--quiet"], &mix[..]].concat());
    for word in ["slump", "class", "from memory", "came to rest"] {
        assert!(told.contains(word), "{word}: {told}");
    }
    let run = place.path().join("runs/slump");
    let summary = json(&run.join("summary.json"));
    assert!(summary["slump_class"].as_str().unwrap().starts_with('S'), "{summary}");
    assert!(summary["time_s"].as_f64().unwrap() > 1.0, "the mould is lifted in 1 s");
    assert_eq!(summary["mould_force_x_N"], 0.0);
    let header = fs::read_to_string(run.join("series.csv")).unwrap();
    assert!(header.lines().next().unwrap().ends_with(",mould_moment_z_Nm"), "{header}");
}

#[test]
fn the_laboratory_lets_a_box_flow_through_bars() {
    let place = tempfile::tempdir().unwrap();
    // Stiff enough to rest soon on cells that are far too coarse.
    let mix = ["--cell-size", "20mm", "--yield-stress", "200Pa", "--bars", "2", "--bar-diameter", "40mm"];
    let told = done(place.path(), &[&["lab", "l-box", "--quiet"], &mix[..]].concat());
    for word in ["passing ability PL", "PL below 0.80, 2 bars", "T400", "from memory", "came to rest"] {
        assert!(told.contains(word), "{word}: {told}");
    }
    let run = place.path().join("runs/l-box");
    let summary = json(&run.join("summary.json"));
    let levels = ["H1", "H2"].map(|name| summary[&format!("level_{name}_m")].as_f64().unwrap());
    assert!(levels[0] > levels[1] && levels[0] < 0.6, "{levels:?}");
    assert!((summary["passing_ratio"].as_f64().unwrap() - levels[1] / levels[0]).abs() < 1e-12);
    let times = ["T200", "T400"].map(|name| summary[&format!("front_{name}_s")].as_f64());
    assert!(times[0].is_some_and(|t200| times[1].is_none_or(|t400| t200 < t400)), "{times:?}");
    assert!(summary["gate_force_z_N"].is_number() && summary["bars_force_x_N"].as_f64().unwrap() > 0.0);
    // The folder's summary is read again for the report.
    done(place.path(), &["report", "runs/l-box"]);
    assert!(fs::read_to_string(run.join("report.html")).unwrap().contains("Levels"));
}

#[test]
fn the_laboratory_pours_into_a_channel_and_tells_the_yield_stress() {
    let place = tempfile::tempdir().unwrap();
    // Stiff, thin and poured fast, on cells that are far too coarse.
    let mix =
        ["--cell-size", "20mm", "--yield-stress", "150Pa", "--viscosity", "10Pa.s", "--pour-time", "5s"];
    let told = done(place.path(), &[&["lab", "lcpc-box", "--quiet"], &mix[..]].concat());
    for word in ["spread L", "yield stress from L", "given: 150 Pa", "from memory", "came to rest"] {
        assert!(told.contains(word), "{word}: {told}");
    }
    let run = place.path().join("runs/lcpc-box");
    let summary = json(&run.join("summary.json"));
    assert!((summary["inlet1_inflow_m3"].as_f64().unwrap() / 6e-3 - 1.0).abs() < 1e-9, "{summary}");
    assert!((summary["volume_m3"].as_f64().unwrap() / 6e-3 - 1.0).abs() < 0.01, "{summary}");
    let number = |name: &str| summary[name].as_f64().unwrap();
    assert!((number("spread_mm") - 1e3 * number("front_L_m")).abs() < 1e-9);
    // The shorter the spread, the larger the yield stress.
    assert!((75.0..300.0).contains(&number("yield_stress_from_spread_Pa")), "{summary}");
    assert!(number("h0_mm") > 90.0 && number("h0_mm") < 150.0, "{summary}");
}

#[test]
fn a_report_is_one_page_with_all_of_a_run() {
    let place =
        folder_with_case(&[("\"1 s\"", "\"0.6 s\""), ("Coarse slump", "Coarse <slump> & \\\"co\\\"")]);
    let place = place.path();
    done(place, &["run", "slump.toml", "-q"]);
    done(place, &["report", "runs/slump"]);
    let page = fs::read_to_string(place.join("runs/slump/report.html")).unwrap();
    // A slump flow is known for one though nobody said so.
    for word in [
        "<h1>Coarse &lt;slump&gt; &amp; &quot;co&quot;</h1>",
        "slump flow",
        "T500",
        "plastic viscosity",
        "hydrostatic density error",
        "Mach number",
        "Roussel and Coussot",
        "Coarse: for a first look",
        "From above",
        "Yielded in a cut",
        "Pressure in a cut",
        "Apparent viscosity in a cut",
        "M each second",
        "yield_stress = &quot;50 Pa&quot;",
    ] {
        assert!(page.contains(word), "{word}");
    }
    // Four plots, six pictures of the last state, three times two over time; and nothing from elsewhere.
    assert_eq!(page.matches("<img src=\"data:image/png;base64,iVBORw0KGgo").count(), 4 + 6 + 6);
    assert_eq!(page.matches("src=").count(), 16);
    for word in ["http", "<script", "<link", "@import", "url("] {
        assert!(!page.contains(word), "{word}");
    }

    // With less in the folder it says what is missing.
    for name in ["checkpoint.tremie", "above_000000.png", "above_000001.png", "above_000002.png"] {
        fs::remove_file(place.join("runs/slump").join(name)).unwrap();
    }
    fs::write(place.join("runs/slump/cut_000001.png"), "no picture").unwrap();
    done(place, &["report", "runs/slump", "--out", "short.html"]);
    let page = fs::read_to_string(place.join("short.html")).unwrap();
    assert!(page.contains("the folder has no checkpoint") && page.contains("cut_000001.png is no picture"));
    assert_eq!(page.matches("<img").count(), 3 + 2);
}

#[test]
fn any_run_has_a_report_unless_its_files_are_damaged() {
    let place = folder_with_case(&[
        ("spread = { centre = [\"0 m\", \"0 m\"] }\n", ""),
        ("picture_interval = \"0.5 s\"\n", ""),
        ("\"1 s\"", "\"0.1 s\"\nrest = {}"),
    ]);
    let place = place.path();
    done(place, &["run", "slump.toml", "--out", "run", "-q"]);
    done(place, &["report", "run"]);
    let page = fs::read_to_string(place.join("run/report.html")).unwrap();
    let words = without_pictures(&page);
    assert!(
        words.contains("largest height") && words.contains("no picture_interval") && !words.contains("T500")
    );
    assert!(page.contains("had not come to rest"));

    refused(place, &["report"], &["<DIR>"]);
    refused(place, &["report", "none"], &["none holds no run"]);
    refused(place, &["report", "run", "--out", "none/report.html"], &["none/report.html cannot be written"]);
    let spoil = |name: &str, text: &str, words: &[&str]| {
        let path = place.join("run").join(name);
        let before = fs::read(&path).unwrap();
        fs::write(&path, text).unwrap();
        refused(place, &["report", "run"], words);
        fs::write(&path, before).unwrap();
    };
    spoil("case.toml", "title = 5", &["`title` is a number"]);
    spoil("run.json", "{", &["run.json is damaged"]);
    spoil("summary.json", "{", &["summary.json is damaged"]);
    spoil("summary.json", "{}", &["summary.json is damaged"]);
    spoil("summary.json", "[1]", &["summary.json is damaged"]);
    spoil("series.csv", "time_s,a\n1,b\n", &["series.csv", "line 2"]);
    spoil("checkpoint.tremie", "x", &["checkpoint.tremie", "not a checkpoint"]);
    fs::remove_file(place.join("run/summary.json")).unwrap();
    refused(place, &["report", "run"], &["no results yet", "tremie resume"]);
}

/// Starts a run and interrupts it when it has written some readings.
#[cfg(unix)]
fn interrupted(place: &Path, arguments: &[&str], series: &Path) -> Output {
    let mut child: Child =
        tremie(place, arguments).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    let began = Instant::now();
    let lines = || fs::read_to_string(series).map_or(0, |text| text.lines().count());
    while lines() < 15 {
        assert!(began.elapsed() < Duration::from_secs(60), "the run does not get going");
        assert!(child.try_wait().unwrap().is_none(), "the run ended before it could be interrupted");
        std::thread::sleep(Duration::from_millis(2));
    }
    assert!(Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap().success());
    child.wait_with_output().unwrap()
}

#[cfg(unix)]
#[test]
fn an_interrupted_run_goes_on_as_if_nothing_had_happened() {
    goes_on(&folder_with_case(&[("\"20 mm\"", "\"10 mm\""), ("\"1 s\"", "\"1.2 s\"")]));
}

/// A run of the case in a folder, 1.2 s long, leaves the same files if it is interrupted and resumed.
#[cfg(unix)]
fn goes_on(place: &TempDir) {
    let place = place.path();
    done(place, &["run", "slump.toml", "--out", "whole", "-q"]);

    let output =
        interrupted(place, &["run", "slump.toml", "--out", "parts"], &place.join("parts/series.csv"));
    let told = text(&output.stderr);
    assert_eq!(output.status.code(), Some(130), "{told}");
    assert!(told.contains("tremie resume parts"), "{told}");
    assert_eq!(json(&place.join("parts/run.json"))["end_reason"], "interrupted");
    let time = json(&place.join("parts/summary.json"))["time_s"].as_f64().unwrap();
    assert!(time < 1.1, "interrupted too late, at {time} s");
    done(place, &["resume", "parts", "-q"]);

    let names = |run: &str| {
        let entries = fs::read_dir(place.join(run)).unwrap();
        let mut names: Vec<String> =
            entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    };
    assert_eq!(names("whole"), names("parts"));
    // All but what tells of wall-clock time.
    for name in names("whole").iter().filter(|name| !["run.json", "summary.json"].contains(&name.as_str())) {
        let read = |run: &str| fs::read(place.join(run).join(name)).unwrap();
        assert!(read("whole") == read("parts"), "{name} differs");
    }
}

#[test]
fn check_tells_the_cost_and_writes_nothing() {
    let place = folder_with_case(&[]);
    let told = done(place.path(), &["check", "slump.toml"]);
    for word in ["4,624 cells of 20 mm", "wet cells", "memory", "time step", "tau", "Mach", "estimated time"]
    {
        assert!(told.contains(word), "{word}: {told}");
    }
    let numbers: Value =
        serde_json::from_str(&done(place.path(), &["check", "slump.toml", "--json"])).unwrap();
    for key in
        ["steps", "relaxation_time", "mach", "hydrostatic_error", "bingham", "reynolds", "estimated_time_s"]
    {
        assert!(numbers[key].as_f64().unwrap() > 0.0, "{key}");
    }
    assert_eq!(numbers["warnings"], serde_json::json!([]));
    assert_eq!(fs::read_dir(place.path()).unwrap().count(), 1);
}

#[test]
fn check_tells_where_bars_lie() {
    let place =
        folder_with_case(&[("[lbm]", "[[bars]]\ncsv = { file = \"cage.csv\", unit = \"cm\" }\n\n[lbm]")]);
    let cage = "x1,y1,z1,x2,y2,z2,diameter\n10,10,0,10,10,20,4\n20,10,0,20,10,20,4\n";
    fs::write(place.path().join("cage.csv"), cage).unwrap();
    let told = done(place.path(), &["check", "slump.toml"]);
    assert!(told.contains("bars1 (2), x 80 to 220, y 80 to 120, z 0 to 200 mm"), "{told}");
    // A run keeps the file beside its case.
    done(place.path(), &["run", "slump.toml", "--out", "run", "--quiet"]);
    assert_eq!(fs::read_to_string(place.path().join("run/cage.csv")).unwrap(), cage);
}

#[test]
fn check_warns_of_numbers_out_of_their_range() {
    for (setting, word) in [
        ("time_step = \"6 ms\"", "Mach number"),
        ("time_step = \"6 ms\"", "density"),
        ("time_step = \"0.01 ms\"", "below 0.505"),
    ] {
        let cells = format!("cell_size = \"20 mm\"\n{setting}");
        let place = folder_with_case(&[("cell_size = \"20 mm\"", &cells)]);
        let output = output(place.path(), &["check", "slump.toml", "--json"]);
        // So large a time step may break down within the first steps, which is told too.
        let told = text(&output.stdout) + &text(&output.stderr);
        assert!(told.contains(word) || told.contains("no longer near 1"), "{setting}: {told}");
    }
    let place = folder_with_case(&[
        ("cell_size = \"20 mm\"", "cell_size = \"20 mm\"\ntime_step = \"2 ms\""),
        ("\"30 Pa s\"", "\"300 Pa s\""),
    ]);
    let stiff = output(place.path(), &["check", "slump.toml"]);
    assert!(text(&stiff.stderr).contains("above 1.5"), "{}", text(&stiff.stderr));
    let place = folder_with_case(&[("height = \"300 mm\"", "height = \"60 mm\"")]);
    let output = output(place.path(), &["check", "slump.toml"]);
    assert!(text(&output.stderr).contains("3.0 cells across"), "{}", text(&output.stderr));
}

#[test]
fn a_breakdown_is_told_with_advice() {
    let place = folder_with_case(&[("cell_size = \"20 mm\"", "cell_size = \"20 mm\"\ntime_step = \"6 ms\"")]);
    let output = output(place.path(), &["run", "slump.toml", "-q"]);
    let told = text(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{told}");
    assert!(told.contains("error: at t = ") && told.contains("time_step"), "{told}");
    assert_eq!(json(&place.path().join("runs/slump/run.json"))["end_reason"], "breakdown");
}

/// Runs the program, which must refuse its input in one message that holds all the words.
fn refused(place: &Path, arguments: &[&str], words: &[&str]) {
    let output = output(place, arguments);
    let told = text(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{arguments:?}: {told}");
    assert_eq!(told.matches("error: ").count(), 1, "{arguments:?}: {told}");
    assert!(!told.contains("panicked") && output.stdout.is_empty(), "{arguments:?}: {told}");
    for word in words {
        assert!(told.contains(word), "{arguments:?} does not tell `{word}`: {told}");
    }
}

#[test]
fn wrong_cases_are_refused_with_the_line_and_advice() {
    for (old, new, words) in [
        ("yield_stress", "yeild_stress", &["slump.toml:6:", "did you mean `yield_stress`?"][..]),
        ("\"50 Pa\"", "\"50 mm\"", &["slump.toml:6:", "a length, not a stress", "\"50 Pa\""]),
        ("\"50 Pa\"", "50", &["slump.toml:6:", "has no unit"]),
        ("\"50 Pa\"", "\"-50 Pa\"", &["slump.toml:6:", "negative"]),
        ("\"30 Pa s\"", "\"0 Pa s\"", &["slump.toml:6:", "must be positive"]),
        ("\"2300 kg/m3\"", "\"2300 kg/mm\"", &["slump.toml:5:", "a density"]),
        ("method = \"lbm\"", "method = \"fem\"", &["slump.toml:2:", "\"lbm\""]),
        ("title = \"Coarse slump\"\n", "", &["slump.toml:", "`title` is missing"]),
        ("title = ", "title ", &["slump.toml:1:", "TOML"]),
        ("\"320 mm\"", "\"325 mm\"", &["slump.toml:10:", "not a whole number"]),
        ("[\"340 mm\", ", "[\"-340 mm\", ", &["slump.toml:10:", "larger than the smallest"]),
        ("x_min = \"symmetry\"", "x_min = \"periodic\"", &["slump.toml:11:", "opposite side"]),
        ("base = [\"0 m\"", "base = [\"9 m\"", &["slump.toml:1", "outside the domain"]),
        ("cell_size = \"20 mm\"", "cell_size = \"1 m\"", &["slump.toml:17:", "larger than the domain"]),
        ("cell_size = \"20 mm\"", "cell_size = \"1 um\"", &["slump.toml:17:", "larger cell size"]),
        ("centre = [\"0 m\"", "centre = [\"2 m\"", &["slump.toml:21:", "outside the domain"]),
        ("time = \"1 s\"", "time = \"1 s\"\nrest = 5", &["slump.toml:25:", "rest"]),
        ("[stop]\ntime = \"1 s\"\n", "", &["slump.toml:", "`stop` is missing", "[stop]"]),
    ] {
        let place = folder_with_case(&[(old, new)]);
        for command in ["run", "check"] {
            refused(place.path(), &[command, "slump.toml"], words);
        }
        assert!(!place.path().join("runs").exists());
    }
}

#[test]
fn calc_tells_a_formula_with_its_source_and_where_it_holds() {
    let place = tempfile::tempdir().unwrap();
    let place = place.path();
    let list = done(place, &["calc"]);
    for name in [
        "slump-flow",
        "slump",
        "yield-stress",
        "lcpc-box",
        "l-box",
        "pipe",
        "channel",
        "rheometer",
        "squeeze",
        "formwork",
        "layers",
        "stability",
        "suspension",
        "fibres",
    ] {
        assert!(list.contains(&format!("\n  {name} ")), "{name}: {list}");
        let help = done(place, &["calc", name, "--help"]);
        // Its examples work as they stand, and leave nothing behind.
        let (_, examples) = help.split_once("Examples:\n").unwrap();
        for example in examples.trim_end().split("  tremie ").skip(1) {
            let example: Vec<&str> = example.split_whitespace().collect();
            let told = done(place, &example);
            for word in ["equation", "source", "holds for"] {
                assert!(told.contains(word), "{name}: {told}");
            }
            let answer: Value =
                serde_json::from_str(&done(place, &[&example[..], &["--json"]].concat())).unwrap();
            let results = answer["results"].as_object().unwrap();
            assert!(!results.is_empty() && results.values().all(Value::is_number), "{answer}");
            assert!(answer["inputs"].is_object() && answer["warnings"].is_array(), "{answer}");
        }
    }
    assert_eq!(fs::read_dir(place).unwrap().count(), 0);

    let told = done(place, &["calc", "yield-stress", "--slump-flow", "60cm"]);
    assert!(told.contains("50 Pa") && told.contains("Roussel"), "{told}");
    let thick = output(place, &["calc", "slump-flow", "--yield-stress", "300Pa"]);
    assert!(thick.status.success() && text(&thick.stderr).contains("warning: the height is 0.3"));

    let refused =
        |arguments: &[&str], words: &[&str]| refused(place, &[&["calc"], arguments].concat(), words);
    refused(&["slump-flaw"], &["'slump-flow'"]);
    refused(&["slump-flow"], &["--yield-stress"]);
    refused(&["slump-flow", "--yield-stress", "50"], &["has no unit"]);
    refused(&["yield-stress", "--slump", "50cm"], &["less than the 300 mm"]);
    refused(&["yield-stress", "--slump", "5cm", "--l-box", "0.8"], &["cannot be used with"]);
    refused(&["yield-stress", "--l-box", "120%"], &["below 1"]);
    refused(&["squeeze", "--yield-stress", "100Pa", "--volume", "1l"], &["--force", "--height"]);
    refused(&["suspension", "--fraction", "70%"], &["below --packing"]);
    refused(&["yield-stress", "--slump-flow", "1e99m"], &["cannot be computed"]);
}

#[test]
fn wrong_files_and_arguments_are_refused_with_advice() {
    let place = folder_with_case(&[("\"1 s\"", "\"0.05 s\"")]);
    let place = place.path();
    fs::create_dir(place.join("folder")).unwrap();
    fs::write(place.join("binary.toml"), [0xff, 0xfe, 0x00]).unwrap();
    fs::write(place.join("empty.toml"), "").unwrap();
    fs::write(place.join("notes.txt"), "mine").unwrap();
    let refused = |arguments: &[&str], words: &[&str]| refused(place, arguments, words);

    refused(&["run", "none.toml"], &["none.toml", "No such file"]);
    refused(&["check", "none.toml"], &["none.toml", "No such file"]);
    refused(&["run", "folder"], &["folder", "directory"]);
    refused(&["run", "binary.toml"], &["binary.toml", "UTF-8"]);
    refused(&["run", "empty.toml"], &["`title` is missing"]);
    refused(&["run"], &["<CASE>"]);
    refused(&["resum", "x"], &["unrecognized subcommand 'resum'", "'resume'"]);
    refused(&["--threads", "0", "check", "slump.toml"], &["--threads", "zero"]);
    refused(&["run", "slump.toml", "--out", "notes.txt"], &["notes.txt"]);
    refused(&["run", "slump.toml", "--out", "."], &["is not empty", "--force"]);

    let lab = |option: &str, value: &str, words: &[&str]| {
        refused(&["lab", "slump-flow", option, value], words);
        assert!(!place.join("runs").exists());
    };
    lab("--yield-stress", "50mm", &["--yield-stress", "a length, not a stress"]);
    lab("--yield-stress", "50", &["has no unit", "\"50 Pa\""]);
    lab("--yield-stress", "0Pa", &["must be positive"]);
    lab("--yield-stress", "1e-9Pa", &["Pa at least"]);
    lab("--viscosity", "30Pas", &["Pas"]);
    lab("--density", "2,3t/m3", &["comma"]);
    lab("--cell-size", "100mm", &["--cell-size from 0.25 mm to 25 mm"]);
    lab("--precision", "f16", &["f32, f64"]);

    done(place, &["run", "slump.toml", "--out", "run", "-q"]);
    refused(
        &["run", "slump.toml", "--out", "run"],
        &["run is not empty", "resume", "--force", "another folder"],
    );
    done(place, &["run", "slump.toml", "--out", "run", "-q", "--force"]);

    refused(&["resume", "folder"], &["folder holds no run", "case.toml"]);
    refused(&["resume", "none"], &["none holds no run"]);
    let spoil = |name: &str, change: &dyn Fn(Vec<u8>) -> Vec<u8>, words: &[&str]| {
        let path: PathBuf = place.join("run").join(name);
        let before = fs::read(&path).unwrap();
        fs::write(&path, change(before.clone())).unwrap();
        refused(&["resume", "run"], words);
        fs::write(&path, before).unwrap();
    };
    let again = "tremie run run/case.toml --out run --force";
    let flipped = |mut bytes: Vec<u8>| {
        let middle = bytes.len() / 2;
        bytes[middle] ^= 0x10;
        bytes
    };
    spoil("checkpoint.tremie", &flipped, &["damaged", again]);
    spoil("checkpoint.tremie", &|bytes| bytes[..bytes.len() / 2].to_vec(), &["truncated", again]);
    spoil("checkpoint.tremie", &|_| b"{}".to_vec(), &["checkpoint", again]);
    spoil("run.json", &|_| b"{".to_vec(), &["run.json is damaged"]);
    let larger = |bytes: Vec<u8>| text(&bytes).replace("340 mm", "360 mm").into_bytes();
    spoil("case.toml", &larger, &["the checkpoint was written for", again]);
    fs::remove_file(place.join("run/checkpoint.tremie")).unwrap();
    refused(&["resume", "run"], &["no checkpoint yet", again]);
    // The user's own files are still there.
    assert_eq!(fs::read_to_string(place.join("notes.txt")).unwrap(), "mine");
}

#[test]
fn a_new_case_is_ready_to_run_and_replaces_nothing() {
    let place = tempfile::tempdir().unwrap();
    let place = place.path();
    let names: Vec<String> = done(place, &["new", "--list"])
        .lines()
        .map(|line| line.split_whitespace().next().unwrap().to_owned())
        .collect();
    assert_eq!(
        names,
        [
            "slump-flow",
            "l-box",
            "planar-collapse",
            "wu-slump",
            "wu-l-box",
            "squeeze-load",
            "squeeze-velocity",
            "casson-cavity",
            "skewed-cavity",
            "bingham-dam-break",
            "abrams-slump",
            "channel",
            "drop",
            "dam-break",
            "cavity",
            "slab",
            "beam",
            "wall",
            "fibre-slump",
            "heterogeneous-slump",
            "fibre-slab",
            "fibre-plate",
            "fibre-beam",
            "fibre-wall",
            "fibre-l-box",
            "couette-spheres",
            "couette-fibres",
            "l-form",
            "plain-beam",
            "random-fibre-beam",
            "aligned-fibre-beam",
            "thesis-b1",
            "thesis-b2",
            "thesis-b3"
        ]
    );
    for name in &names {
        let told = done(place, &["new", name]);
        let command = if name.ends_with("-beam") && name != "fibre-beam" || name.starts_with("thesis-") {
            "fracture"
        } else {
            "run"
        };
        assert!(told.contains(&format!("tremie {command} {name}.toml")), "{told}");
        let ready = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("../../cases/{name}/case.toml"));
        assert!(fs::read(place.join(format!("{name}.toml"))).unwrap() == fs::read(ready).unwrap());
    }
    // What a case names comes along, and replaces nothing either.
    done(place, &["check", "l-form.toml"]);
    fs::remove_file(place.join("l-form.toml")).unwrap();
    refused(place, &["new", "l-form"], &["form.stl exists already", "--force"]);
    assert!(!place.join("l-form.toml").exists());
    fs::write(place.join("mine.toml"), "mine").unwrap();
    refused(place, &["new", "drop", "mine.toml"], &["mine.toml exists already", "--force"]);
    assert_eq!(fs::read_to_string(place.join("mine.toml")).unwrap(), "mine");
    done(place, &["new", "drop", "mine.toml", "--force"]);
    done(place, &["check", "mine.toml"]);

    refused(place, &["new", "drop", "."], &["is a folder"]);
    refused(place, &["new", "drop", "none/case.toml"], &["no folder none"]);
    refused(place, &["new", "slumpflow"], &["'slump-flow'"]);
    refused(place, &["new"], &["EXPERIMENT", "--list"]);
}

#[test]
fn the_schema_is_that_of_a_case_file() {
    let place = tempfile::tempdir().unwrap();
    let schema: Value = serde_json::from_str(&done(place.path(), &["schema"])).unwrap();
    let keys: Vec<&String> = schema["properties"].as_object().unwrap().keys().collect();
    assert_eq!(
        keys,
        [
            "bars",
            "cage",
            "domain",
            "fibre_field",
            "fluid",
            "gauges",
            "inclusions",
            "inlet",
            "isph",
            "lbm",
            "ldd",
            "material",
            "method",
            "outlet",
            "output",
            "solid",
            "sph",
            "stop",
            "suspension",
            "title"
        ]
    );
}

#[test]
fn every_command_has_help_with_examples() {
    let place = tempfile::tempdir().unwrap();
    for command in [
        &[][..],
        &["lab", "slump-flow"],
        &["lab", "slump"],
        &["lab", "l-box"],
        &["lab", "lcpc-box"],
        &["lab", "j-ring"],
        &["lab", "v-funnel"],
        &["lab", "inverted-cone"],
        &["lab", "mini-slump"],
        &["lab", "u-box"],
        &["lab", "orimet"],
        &["run"],
        &["resume"],
        &["check"],
        &["new"],
        &["schema"],
        &["report"],
        &["export"],
        &["bench"],
        &["validate"],
    ] {
        let told = done(place.path(), &[command, &["--help"]].concat());
        assert!(told.contains("Examples:\n  tremie "), "{command:?}: {told}");
        assert_eq!(told, done(place.path(), &[&["help"], command].concat()));
    }
    assert!(done(place.path(), &["lab", "--help"]).contains("Usage: tremie"));
    assert_eq!(done(place.path(), &["--version"]), format!("tremie {}\n", env!("CARGO_PKG_VERSION")));
}

#[test]
fn the_cases_that_come_along_are_sound() {
    let cases = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../cases");
    let mut number = 0;
    for entry in fs::read_dir(cases).unwrap() {
        let case = entry.unwrap().path().join("case.toml");
        // Hardened beams are no casts.
        if fs::read_to_string(&case).unwrap().contains("[matrix]") {
            continue;
        }
        let numbers = done(&std::env::temp_dir(), &["check", case.to_str().unwrap(), "--json"]);
        let numbers: Value = serde_json::from_str(&numbers).unwrap();
        assert_eq!(numbers["warnings"], serde_json::json!([]), "{}", case.display());
        number += 1;
    }
    assert!(number >= 9);
}

#[test]
fn the_case_of_the_reference_is_sound() {
    let reference = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/case-file.md");
    let text = fs::read_to_string(reference).unwrap();
    let case = text.split("```toml\n").nth(1).unwrap().split("```").next().unwrap();
    tremie_case::Case::parse("docs/case-file.md", case).unwrap_or_else(|error| panic!("{error}"));
}
