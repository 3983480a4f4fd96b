//! Aggregates and fibres: what a run writes of them, and how they go out and come in.

use super::*;

/// The coarse slump with fibres and a few stones, whole.
fn with_bodies(more: &[(&str, &str)]) -> TempDir {
    let bodies = "[[inclusions]]\nname = \"stones\"\nellipsoid = { axes = [\"20 mm\", \"24 mm\", \"28 mm\"] }\n\
        density = \"2600 kg/m3\"\nnumber = 3\n\n[[inclusions]]\nname = \"steel\"\n\
        fibre = { length = \"60 mm\", diameter = \"1 mm\" }\ndensity = \"7850 kg/m3\"\nnumber = 60\n\n\
        [[suspension.section]]\nname = \"middle\"\naxis = \"y\"\nat = \"50 mm\"\n\n[lbm]";
    folder_with_case(&[&[("\"20 mm\"", "\"10 mm\""), ("[lbm]", bodies)], more].concat())
}

/// The cells of a table, without its header.
fn rows(path: &Path) -> Vec<Vec<f64>> {
    let text = fs::read_to_string(path).unwrap();
    let number = |cell: &str| if cell.is_empty() { f64::NAN } else { cell.parse().unwrap() };
    text.lines().skip(1).map(|line| line.split(',').map(number).collect()).collect()
}

#[test]
fn a_run_tells_how_fibres_lie() {
    let place = with_bodies(&[("\"1 s\"", "\"0.4 s\"")]);
    let run = place.path().join("run");
    done(place.path(), &["run", "slump.toml", "--out", "run", "-q"]);
    let header = |name: &str| fs::read_to_string(run.join(name)).unwrap().lines().next().unwrap().to_owned();
    assert_eq!(
        header("orientation.csv"),
        "time_s,x_m,y_m,z_m,half,number,length_m,a11,a22,a33,a12,a13,a23,volume_share"
    );
    assert!(header("sections.csv").starts_with("time_s,middle_count,middle_orientation_factor,"));
    assert!(header("segregation.csv").ends_with(",fluid_m3,stones_share,steel_share,bodies_share"));
    let orientation = rows(&run.join("orientation.csv"));
    let mut times: Vec<f64> = orientation.iter().map(|row| row[0]).collect();
    times.dedup();
    // At the start, 0.3 s and the end.
    assert_eq!(times.len(), 3);
    let known: Vec<&Vec<f64>> = orientation.iter().filter(|row| row[6] > 0.0).collect();
    assert!(known.iter().all(|row| (row[7] + row[8] + row[9] - 1.0).abs() < 1e-9), "the trace is 1");
    let number: f64 = orientation.iter().filter(|row| row[0] == 0.0).map(|row| row[5]).sum();
    assert_eq!(number, 60.0);
    let segregation = rows(&run.join("segregation.csv"));
    assert_eq!(segregation.len(), 3 * 11);
    let layers = segregation[1..11].iter();
    let steel: f64 = layers.map(|row| row[4] * row[6]).sum();
    let whole = segregation[0][4] * segregation[0][6];
    assert!((steel / whole - 1.0).abs() < 0.02, "{steel} of {whole}");
    assert_eq!(rows(&run.join("sections.csv")).len(), rows(&run.join("series.csv")).len());
    for (name, beginning) in [
        ("orientation_000002.vtp", &b"<?xml"[..]),
        ("orientation.pvd", b"<?xml"),
        ("orientation_lower_000001.png", b"\x89PNG"),
        ("orientation_upper_000001.png", b"\x89PNG"),
    ] {
        assert!(fs::read(run.join(name)).unwrap().starts_with(beginning), "{name}");
    }
    let points = String::from_utf8_lossy(&fs::read(run.join("orientation_000002.vtp")).unwrap()).into_owned();
    assert!(points.contains("ComponentName4=\"YZ\" ComponentName5=\"XZ\""));
    done(place.path(), &["report", "run"]);
    let page = fs::read_to_string(run.join("report.html")).unwrap();
    assert!(page.contains("How fibres lie in the upper half"));

    // Where nothing swims nothing of it is written.
    let place = folder_with_case(&[("\"1 s\"", "\"20 ms\"")]);
    done(place.path(), &["run", "slump.toml", "--out", "run", "-q"]);
    for name in ["orientation.csv", "segregation.csv", "sections.csv", "orientation.pvd"] {
        assert!(!place.path().join("run").join(name).exists(), "{name}");
    }
}

#[cfg(unix)]
#[test]
fn an_interrupted_run_with_fibres_goes_on_as_if_nothing_had_happened() {
    goes_on(&with_bodies(&[("\"1 s\"", "\"1.2 s\"")]));
}

/// In place of the cone a hose over an open side, from which concrete comes with fibres; nothing swims at the start.
fn with_hose(more: &[(&str, &str)]) -> TempDir {
    let cone = "[[fluid]]\ncone = { base = [\"0 m\", \"0 m\", \"0 m\"], base_diameter = \"200 mm\", top_diameter = \"100 mm\", height = \"300 mm\" }";
    let hose = "[[inlet]]\ndisc = { centre = [\"240 mm\", \"0 mm\", \"160 mm\"], direction = [1, 0, -1], diameter = \"100 mm\" }\n\
        flow_rate = \"6 l/s\"\n[[inlet.inclusions]]\nname = \"steel\"\nfibre = { length = \"50 mm\", diameter = \"1 mm\" }\n\
        density = \"7850 kg/m3\"\nvolume_fraction = 0.004\n";
    let open = ("y_min = \"symmetry\" }", "y_min = \"symmetry\", x_max = \"open\" }");
    folder_with_case(&[&[("\"20 mm\"", "\"10 mm\""), (cone, hose), open], more].concat())
}

#[test]
fn fibres_that_come_in_and_leave_are_counted() {
    let place = with_hose(&[("\"1 s\"", "\"0.6 s\"")]);
    let place = place.path();
    // Of six litres a second half comes into the domain: 7.2 ml of steel, in fibres of 39.3 mm3.
    let told = done(place, &["check", "slump.toml"]);
    assert!(told.contains("183 steel to come by inlet 1, 0.4 % of what comes in"), "{told}");
    let numbers: Value = serde_json::from_str(&done(place, &["check", "slump.toml", "--json"])).unwrap();
    assert_eq!((&numbers["bodies"], &numbers["bodies_in"]), (&0.into(), &183.into()));

    let told = done(place, &["run", "slump.toml", "--out", "run", "-q"]);
    let run = place.join("run");
    let series = fs::read_to_string(run.join("series.csv")).unwrap();
    assert!(
        series.lines().next().unwrap().ends_with("bodies_steel_in,bodies_steel_out,bodies_steel_present")
    );
    for row in rows(&run.join("series.csv")) {
        let [came, left, present] = row[row.len() - 3..] else { panic!("{row:?}") };
        assert_eq!(came, left + present);
    }
    let summary = json(&run.join("summary.json"));
    let count = |what: &str| summary[format!("bodies_steel_{what}")].as_f64().unwrap() as usize;
    let [came, left, present] = ["in", "out", "present"].map(count);
    assert!(came > 150 && came <= 184 && left > 0 && came == left + present, "{came} {left} {present}");
    assert!(told.contains(&format!("{came} steel in all: {left} have left, {present} are there")), "{told}");
    assert_eq!(rows(&run.join("orientation.csv")).last().unwrap()[0], summary["time_s"]);
    assert_eq!(fs::read_to_string(run.join("bodies.csv")).unwrap().lines().count(), 1 + present);
    let told = done(place, &["export", "run", "--format", "csv"]);
    assert!(told.contains(&format!("fibres.csv written: {present} bodies")), "{told}");
    done(place, &["report", "run"]);
    assert!(
        fs::read_to_string(run.join("report.html")).unwrap().contains("How fibres lie in the upper half")
    );
}

#[cfg(unix)]
#[test]
fn an_interrupted_run_with_fibres_that_come_in_goes_on_as_if_nothing_had_happened() {
    goes_on(&with_hose(&[("\"1 s\"", "\"1.2 s\"")]));
}

#[test]
fn bodies_go_out_and_come_in_again() {
    let place = with_bodies(&[("\"1 s\"", "\"0.1 s\"")]);
    let place = place.path();
    done(place, &["run", "slump.toml", "--out", "run", "-q"]);
    let told = done(place, &["export", "run", "--format", "csv", "--out", "swim.csv"]);
    assert!(told.contains("swim.csv written: 63 bodies at t = 0.1"), "{told}");
    let told = done(place, &["export", "run", "--format", "ldpm"]);
    assert!(
        told.contains("fibres.txt written: 60 bodies") && told.contains("3 that are no fibres"),
        "{told}"
    );
    assert_eq!(fs::read_to_string(place.join("fibres.txt")).unwrap().lines().count(), 3 + 60);
    done(place, &["export", "run", "--format", "oofem"]);
    let packing = fs::read_to_string(place.join("packing.dat")).unwrap();
    assert_eq!(packing.lines().filter(|line| line.starts_with("ellipsoid ")).count(), 3);
    assert!(packing.starts_with("# packing v1\n# box 0.34 0.34 0.32\n# periodicity 0 0 0\n"), "{packing}");
    done(place, &["export", "run", "--format", "vtp"]);
    assert!(fs::read(place.join("bodies.vtp")).unwrap().starts_with(b"<?xml"));

    // A case that reads them writes them again as they were; a run takes the file along, and so goes on from its folder alone.
    let group = |name: &str| {
        format!(
            "[[inclusions]]\nname = \"{name}\"\ndensity = \"7850 kg/m3\"\ncsv = {{ file = \"swim.csv\" }}\n\n"
        )
    };
    let case = CASE
        .replace("20 mm", "10 mm")
        .replace("[lbm]", &format!("{}{}[lbm]", group("steel"), group("stones")))
        .replace(
            "cone = {",
            "box = { min = [\"0 m\", \"0 m\", \"0 m\"], max = [\"340 mm\", \"340 mm\", \"320 mm\"] }\n#",
        )
        .replace("\"1 s\"", "\"1 ms\"")
        .replace("[[fluid]]", "gravity = [\"0 m/s2\", \"0 m/s2\", \"0 m/s2\"]\n\n[[fluid]]")
        .replace("symmetry", "wall");
    let case = case.replace("sides = { x_min = \"wall\", y_min = \"wall\" }\n", "");
    fs::write(place.join("again.toml"), case).unwrap();
    done(place, &["check", "again.toml"]);
    let read = tremie_case::Case::read(&place.join("again.toml")).unwrap();
    let text = fs::read_to_string(place.join("swim.csv")).unwrap();
    assert_eq!(read.inclusions.len(), 63);
    for (line, n) in text.lines().skip(1).filter(|line| line.contains("steel")).zip(0..) {
        let cells: Vec<f64> = line.split(',').skip(1).take(6).map(|cell| cell.parse().unwrap()).collect();
        let ends = read.inclusions.ends(n).unwrap();
        let found = [ends[0].to_array(), ends[1].to_array()].concat();
        assert!(cells.iter().zip(found).all(|(a, b)| (a - b).abs() < 1e-9), "{line}");
    }
    done(place, &["run", "again.toml", "--out", "again", "-q"]);
    assert_eq!(fs::read_to_string(place.join("again/swim.csv")).unwrap(), text);
    done(place, &["resume", "again", "-q"]);
    assert_eq!(fs::read_to_string(place.join("again/bodies.csv")).unwrap().lines().count(), 1 + 63);
}

#[test]
fn exports_without_bodies_are_refused() {
    let place = folder_with_case(&[("\"1 s\"", "\"20 ms\"")]);
    let place = place.path();
    done(place, &["run", "slump.toml", "--out", "run", "-q"]);
    refused(place, &["export", "run", "--format", "csv"], &["its case has no [[inclusions]]"]);
    refused(place, &["export", "none", "--format", "csv"], &["none holds no run"]);
    refused(place, &["export", "run", "--format", "dxf"], &["csv", "oofem", "ldpm", "vtp"]);
    refused(place, &["export", "run"], &["--format"]);
}

#[test]
fn a_file_that_the_run_writes_itself_is_no_file_of_the_case() {
    let place =
        folder_with_case(&[("[lbm]", "[[bars]]\ncsv = { file = \"bodies.csv\", unit = \"cm\" }\n\n[lbm]")]);
    let bars = "x1,y1,z1,x2,y2,z2,diameter\n10,10,0,10,10,20,4\n";
    fs::write(place.path().join("bodies.csv"), bars).unwrap();
    refused(place.path(), &["run", "slump.toml", "-q"], &["the case names bodies.csv", "another name"]);
}

#[test]
fn check_counts_bodies_and_tells_what_they_add() {
    let place = with_bodies(&[]);
    let told = done(place.path(), &["check", "slump.toml"]);
    assert!(
        told.contains("60 steel, ") && told.contains("3 stones, ") && told.contains("to the time of a step"),
        "{told}"
    );
    let numbers: Value =
        serde_json::from_str(&done(place.path(), &["check", "slump.toml", "--json"])).unwrap();
    assert_eq!(numbers["bodies"], 63);
    let without = folder_with_case(&[("\"20 mm\"", "\"10 mm\"")]);
    let other: Value =
        serde_json::from_str(&done(without.path(), &["check", "slump.toml", "--json"])).unwrap();
    let memory = |numbers: &Value| numbers["memory_bytes"].as_f64().unwrap();
    let added = numbers["bodies_memory_bytes"].as_f64().unwrap();
    assert!(added > 0.0 && (memory(&numbers) - memory(&other) - added).abs() <= 2.0);
}
