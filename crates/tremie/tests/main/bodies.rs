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

const CUTS: &str = "[[beam]]\nname = \"foot\"\nmin = [\"0 mm\", \"10 mm\", \"0 mm\"]\n\
    max = [\"160 mm\", \"90 mm\", \"40 mm\"]\n\n[[beam]]\nname = \"core\"\nmin = [\"0 mm\", \"0 mm\", \"0 mm\"]\n\
    max = [\"60 mm\", \"60 mm\", \"400 mm\"]\nalong = \"z\"\n\n[[plane]]\nname = \"slanted\"\n\
    point = [\"80 mm\", \"50 mm\", \"30 mm\"]\nnormal = [1, 1, 0]\nsize = [\"60 mm\", \"100 mm\"]\n";

#[test]
fn beams_and_planes_are_cut_out_of_a_cast() {
    let place = with_bodies(&[("\"1 s\"", "\"0.2 s\"")]);
    let place = place.path();
    done(place, &["run", "slump.toml", "--out", "run", "-q"]);
    let told = done(place, &["fibres", "run"]);
    for word in ["Coarse slump, run at t = 0.2", "share [%]", "a11", "largest", "upper half"] {
        assert!(told.contains(word), "{word}: {told}");
    }
    assert!(!place.join("run/fibres").exists() && !told.contains("Written"));

    fs::write(place.join("cuts.toml"), CUTS).unwrap();
    let told = done(place, &["fibres", "run", "--cut", "cuts.toml"]);
    for word in ["x = 80 mm", "z = 200 mm", "slanted", "alpha", "run/fibres/foot.csv"] {
        assert!(told.contains(word), "{word}: {told}");
    }
    let found = done(place, &["fibres", "run", "--cut", "cuts.toml", "--out", "cuts", "--json"]);
    let found: Value = serde_json::from_str(&found).unwrap();
    let number = |value: &Value| value.as_f64().unwrap();
    let cast = &found["cast"]["whole"];
    assert_eq!(cast["count"], 60);
    assert!((number(&cast["length_m"]) - 60.0 * 0.06).abs() < 1e-9);
    let concrete = number(&cast["concrete_m3"]);
    assert!(
        (concrete / number(&json(&place.join("run/summary.json"))["volume_m3"]) * 4.0 - 1.0).abs() < 0.01
    );
    for part in [&found["cast"], &found["beams"][0]["fibres"], &found["beams"][1]["fibres"]] {
        for what in ["length_m", "volume_m3", "concrete_m3"] {
            let [whole, lower, upper] =
                ["whole", "lower_half", "upper_half"].map(|half| number(&part[half][what]));
            assert!((lower + upper - whole).abs() < 1e-9 * whole, "{what}: {part}");
        }
        let tensor = part["whole"]["tensor"].as_array().unwrap();
        let values = part["whole"]["eigenvalues"].as_array().unwrap();
        assert!((tensor[..3].iter().map(number).sum::<f64>() - 1.0).abs() < 1e-9);
        assert!((values.iter().map(number).sum::<f64>() - 1.0).abs() < 1e-9);
    }
    // Through the section of a beam alpha is N A_f / (phi A_c).
    let beam = &found["beams"][0];
    let (section, whole) = (&beam["section"], &beam["fibres"]["whole"]);
    let area = std::f64::consts::PI / 4.0 * 1e-6;
    let alpha = number(&section["count"]) * area
        / (number(&whole["volume_fraction"]) * number(&section["concrete_m2"]));
    assert!((alpha - number(&section["orientation_factor"])).abs() < 1e-9 && alpha > 0.0, "{beam}");
    assert_eq!((&section["axis"], &found["beams"][1]["section"]["axis"]), (&"x".into(), &"z".into()));
    assert!((number(&found["beams"][1]["max_m"][2]) - 0.32).abs() < 1e-12, "the domain ends there");

    // The same in the tables, here and there.
    let cuts = place.join("cuts");
    for name in ["beams.csv", "planes.csv", "foot.csv", "core.csv", "cuts.png"] {
        assert_eq!(
            fs::read(cuts.join(name)).unwrap(),
            fs::read(place.join("run/fibres").join(name)).unwrap()
        );
    }
    let table = fs::read_to_string(cuts.join("beams.csv")).unwrap();
    let lines: Vec<Vec<&str>> = table.lines().map(|line| line.split(',').collect()).collect();
    assert_eq!(lines.len(), 1 + 2 * 3);
    assert!(lines.iter().all(|line| line.len() == lines[0].len()));
    assert_eq!((lines[1][0], lines[1][1], lines[6][1]), ("foot", "whole", "upper half"));
    assert_eq!(lines[1].last().unwrap().parse::<f64>().unwrap(), number(&section["orientation_factor"]));
    assert!(fs::read_to_string(cuts.join("planes.csv")).unwrap().starts_with("plane,fibres,fibres_per_m2,"));
    let clipped = fs::read_to_string(cuts.join("foot.csv")).unwrap();
    assert_eq!(clipped.lines().count() - 1, whole["count"].as_u64().unwrap() as usize);
    let length = |line: &str| {
        let ends: Vec<f64> = line.split(',').skip(1).take(6).map(|cell| cell.parse().unwrap()).collect();
        (0..3).map(|a| (ends[a + 3] - ends[a]).powi(2)).sum::<f64>().sqrt()
    };
    let total: f64 = clipped.lines().skip(1).map(length).sum();
    assert!((total - number(&whole["length_m"])).abs() < 1e-9);

    // A case reads the pieces that are long enough for its cells.
    let long = |line: &&str| line.starts_with("id,") || length(line) > 0.031;
    let kept: Vec<&str> = clipped.lines().filter(long).collect();
    fs::write(place.join("foot.csv"), kept.join("\n")).unwrap();
    let group =
        "[[inclusions]]\nname = \"steel\"\ndensity = \"7850 kg/m3\"\ncsv = { file = \"foot.csv\" }\n\n[lbm]";
    let everywhere =
        "box = { min = [\"0 m\", \"0 m\", \"0 m\"], max = [\"340 mm\", \"340 mm\", \"320 mm\"] }\n#";
    let case = CASE.replace("20 mm", "10 mm").replace("[lbm]", group).replace("cone = {", everywhere);
    fs::write(place.join("again.toml"), case).unwrap();
    let read = tremie_case::Case::read(&place.join("again.toml")).unwrap();
    assert!(kept.len() > 2 && read.inclusions.len() == kept.len() - 1);

    // Against itself nothing differs.
    let told = done(place, &["fibres", "run", "--cut", "cuts.toml", "--against", "run"]);
    assert!(told.contains("Against run at t = 0.2") && told.contains("angle"), "{told}");
    let found = done(place, &["fibres", "run", "--cut", "cuts.toml", "--against", "run", "--json"]);
    let found: Value = serde_json::from_str(&found).unwrap();
    let difference = &found["difference"]["beams"][0];
    assert_eq!(difference["fibres"]["lower_half"]["count"], 0);
    assert_eq!(difference["fibres"]["whole"]["angle_degrees"], 0.0);
    assert_eq!(difference["section"]["orientation_factor"], 0.0);
    assert_eq!(found["difference"]["planes"][0]["count"], 0);
    // Against an earlier moment the difference is the first less the second.
    let case = fs::read_to_string(place.join("slump.toml")).unwrap().replace("\"0.2 s\"", "\"20 ms\"");
    fs::write(place.join("early.toml"), case).unwrap();
    done(place, &["run", "early.toml", "--out", "early", "-q"]);
    let found = done(place, &["fibres", "run", "--cut", "cuts.toml", "--against", "early", "--json"]);
    let found: Value = serde_json::from_str(&found).unwrap();
    let concrete = |of: &Value| number(&of["beams"][0]["fibres"]["whole"]["concrete_m3"]);
    assert!(concrete(&found) > concrete(&found["against"]), "it has spread over the beam");
    let [here, there] = [&found, &found["against"]].map(|of| {
        let beam = &of["beams"][0]["fibres"]["upper_half"];
        (number(&beam["count"]), number(&beam["eigenvalues"][0]))
    });
    let difference = &found["difference"]["beams"][0]["fibres"]["upper_half"];
    assert_eq!(number(&difference["count"]), here.0 - there.0);
    assert!((number(&difference["largest_eigenvalue"]) - (here.1 - there.1)).abs() < 1e-12);
    assert!(!place.join("early/fibres").exists());
}

#[test]
fn cuts_that_make_no_sense_are_refused() {
    let place = with_bodies(&[("\"1 s\"", "\"20 ms\"")]);
    let place = place.path();
    done(place, &["run", "slump.toml", "--out", "run", "-q"]);
    let command = ["fibres", "run", "--cut", "cuts.toml"];
    for (old, new, words) in [
        ("\"160 mm\"", "\"160\"", &["cuts.toml:4:", "has no unit"][..]),
        ("\"160 mm\"", "\"160 s\"", &["cuts.toml:4:", "a time, not a length"]),
        ("\"160 mm\"", "\"-160 mm\"", &["cuts.toml:4:", "is not above `min` along x"]),
        ("\"core\"", "\"foot\"", &["cuts.toml:6:", "two beams are called `foot`"]),
        ("normal =", "normale =", &["cuts.toml:15:", "did you mean `normal`?"]),
        ("[1, 1, 0]", "[0, 0, 0]", &["cuts.toml:15:", "has no direction"]),
        (
            "[\"80 mm\", \"50 mm\"",
            "[\"8 m\", \"50 mm\"",
            &["cuts.toml:14:", "`slanted` lies outside the domain of run", "\"340 mm\""],
        ),
        (
            "min = [\"0 mm\", \"10 mm\", \"0 mm\"]\nmax = [\"160 mm\"",
            "min = [\"-90 mm\", \"10 mm\", \"0 mm\"]\nmax = [\"0 mm\"",
            &["cuts.toml:3:", "beam `foot` lies outside the domain"],
        ),
    ] {
        assert!(CUTS.contains(old), "{old}");
        fs::write(place.join("cuts.toml"), CUTS.replace(old, new)).unwrap();
        refused(place, &command, words);
    }
    fs::write(place.join("cuts.toml"), "").unwrap();
    refused(place, &command, &["`beam` or `plane` is missing"]);
    refused(place, &["fibres", "run", "--cut", "none.toml"], &["cannot read the file of cuts none.toml"]);
    fs::write(place.join("cuts.toml"), CUTS).unwrap();
    refused(place, &["fibres", "none"], &["none holds no run"]);
    refused(place, &["fibres", "run", "--against", "none"], &["none holds no run"]);
    refused(place, &["fibres", "run", "--out", "cuts"], &["--cut"]);
    refused(place, &["fibres", "run", "--cut", "cuts.toml", "--out", "cuts.toml"], &["cannot be written"]);
    assert!(!place.join("run/fibres").exists());
    let plain = folder_with_case(&[("\"1 s\"", "\"20 ms\"")]);
    done(plain.path(), &["run", "slump.toml", "--out", "run", "-q"]);
    refused(plain.path(), &["fibres", "run"], &["run has no fibres"]);
}
