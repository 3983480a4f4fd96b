//! Hardened beams: files, casts, interruption, and what is refused.

use super::*;

/// A coarse beam: a fraction of a second even in a debug build.
const BEAM: &str = r#"title = "Coarse beam"
size = ["320 mm", "80 mm", "80 mm"]

[test]
en14651 = { span = "280 mm", notch = "12 mm" }
opening = "0.1 mm"

[matrix]
strength = "2 MPa"
kink_stress = "0.5 MPa"
kink_opening = "0.05 mm"
last_opening = "0.3 mm"

[lattice]
spacing = "14 mm"
coarsest = "16 mm"
"#;

const RANDOM: &str = "\n[fibres.random]\nlength = \"30 mm\"\ndiameter = \"0.5 mm\"\nvolume_fraction = 0.01\n";

/// Concrete that fills a trough, with fibres in it.
const CAST: &str = r#"title = "Trough"
method = "lbm"

[material]
density = "2300 kg/m3"
bingham = { yield_stress = "500 Pa", plastic_viscosity = "30 Pa s" }

[domain]
min = ["0 mm", "0 mm", "0 mm"]
max = ["400 mm", "120 mm", "120 mm"]

[[fluid]]
box = { min = ["0 mm", "0 mm", "0 mm"], max = ["400 mm", "120 mm", "100 mm"] }

[[inclusions]]
name = "fibres"
fibre = { length = "60 mm", diameter = "0.75 mm" }
density = "7850 kg/m3"
volume_fraction = 0.005

[lbm]
cell_size = "20 mm"

[gauges]
interval = "10 ms"

[stop]
time = "20 ms"
"#;

fn refused(place: &Path, arguments: &[&str], says: &[&str]) {
    let output = output(place, arguments);
    let told = text(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{told}");
    for word in says {
        assert!(told.contains(word), "{told}, not {word}");
    }
}

#[test]
fn a_test_leaves_a_complete_folder_and_is_not_overwritten() {
    let place = tempfile::tempdir().unwrap();
    let place = place.path();
    fs::write(place.join("beam.toml"), format!("{BEAM}beams = 3\n{RANDOM}")).unwrap();
    let told = done(place, &["fracture", "beam.toml", "-q"]);
    assert!(
        told.contains("f_L") && told.contains("characteristic") && told.contains("in the crack"),
        "{told}"
    );
    let run = place.join("runs/beam");
    let summary = json(&run.join("summary.json"));
    let limit = &summary["limit_of_proportionality_Pa"];
    assert!((2.5e6..6e6).contains(&limit["mean"].as_f64().unwrap()), "{summary}");
    assert!(limit["characteristic"].as_f64() < limit["mean"].as_f64());
    assert_eq!(summary["residual_0.5mm_Pa"]["mean"], Value::Null);
    assert!(summary["beams"][2]["energy_imbalance"].as_f64().unwrap() < 0.005);
    let readings = fs::read_to_string(run.join("beam_3.csv")).unwrap();
    assert!(readings.starts_with("opening_m,load_N,stress_Pa,"), "{readings}");
    for (name, beginning) in [
        ("crack_3.vtp", &b"<?xml"[..]),
        ("fibres_1.vtp", b"<?xml"),
        ("load_opening.png", b"\x89PNG"),
        ("crack.png", b"\x89PNG"),
        ("report.html", b"<!DOCTYPE"),
        ("sections.csv", b"beam,from_crack_m,fibres"),
    ] {
        let bytes = fs::read(run.join(name)).unwrap_or_else(|error| panic!("{name}: {error}"));
        assert!(bytes.starts_with(beginning), "{name}");
    }
    refused(place, &["fracture", "beam.toml", "-q"], &["--force"]);
    done(place, &["fracture", "beam.toml", "-q", "--force", "--threads", "1"]);
    // The same bits again, on one thread.
    assert_eq!(fs::read_to_string(run.join("beam_3.csv")).unwrap(), readings);
}

#[cfg(unix)]
#[test]
fn an_interrupted_test_goes_on_as_if_it_had_not_been() {
    let place = tempfile::tempdir().unwrap();
    let place = place.path();
    fs::write(place.join("beam.toml"), format!("{BEAM}beams = 6\n{RANDOM}")).unwrap();
    done(place, &["fracture", "beam.toml", "-q", "--out", "whole"]);
    let mut child = tremie(place, &["fracture", "beam.toml", "-q", "--out", "halves"])
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let start = Instant::now();
    while !place.join("halves/beam_1.csv").is_file() {
        assert!(start.elapsed() < Duration::from_secs(60), "nothing happens");
        std::thread::sleep(Duration::from_millis(1));
    }
    assert!(Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap().success());
    assert_eq!(child.wait().unwrap().code(), Some(130));
    done(place, &["fracture", "--resume", "halves", "-q"]);
    for name in ["results.csv", "beam_1.csv", "beam_6.csv", "crack_6.csv", "sections.csv"] {
        let [whole, halves] =
            ["whole", "halves"].map(|run| fs::read_to_string(place.join(run).join(name)).unwrap());
        assert_eq!(whole, halves, "{name}");
    }
    refused(place, &["fracture", "--resume", "whole"], &["come to its end"]);
}

#[test]
fn the_fibres_of_a_cast_hold_the_beam() {
    let place = tempfile::tempdir().unwrap();
    let place = place.path();
    fs::write(place.join("trough.toml"), CAST).unwrap();
    done(place, &["run", "trough.toml", "-q", "--out", "cast"]);
    let cuts = |beam: &str| format!("[[beam]]\nname = \"B1\"\n{beam}\n");
    fs::write(
        place.join("cuts.toml"),
        cuts("min = [\"40 mm\", \"20 mm\", \"0 mm\"]\nmax = [\"360 mm\", \"100 mm\", \"80 mm\"]"),
    )
    .unwrap();
    fs::write(place.join("beam.toml"), BEAM).unwrap();
    let from = ["fracture", "beam.toml", "--from", "cast", "--beam"];
    refused(place, &[&from[..], &["B1"]].concat(), &["tremie fibres cast --cut FILE"]);
    done(place, &["fibres", "cast", "--cut", "cuts.toml"]);
    refused(place, &[&from[..], &["B7"]].concat(), &["no beam `B7`", "B1"]);
    let told = done(place, &[&from[..], &["B1", "-q", "--out", "B1"]].concat());
    assert!(told.contains("in the crack"), "{told}");
    let summary = json(&place.join("B1/summary.json"));
    let share = summary["beams"][0]["volume_fraction"].as_f64().unwrap();
    assert!((0.002..0.009).contains(&share), "{share}");
    // The folder holds all that it takes to do it again.
    done(place, &["fracture", "B1/beam.toml", "-q", "--out", "again"]);
    let [one, two] =
        ["B1", "again"].map(|run| fs::read_to_string(place.join(run).join("beam_1.csv")).unwrap());
    assert_eq!(one, two);
    // What cannot be cut, or says again where fibres are.
    fs::write(place.join("random.toml"), format!("{BEAM}{RANDOM}")).unwrap();
    let random = ["fracture", "random.toml", "--from", "cast", "--beam", "B1"];
    refused(place, &random, &["fibres come from the cast", "random.toml"]);
    fs::write(place.join("larger.toml"), BEAM.replace("320 mm", "330 mm")).unwrap();
    refused(
        place,
        &["fracture", "larger.toml", "--from", "cast", "--beam", "B1"],
        &["another size", "\"320 mm\""],
    );
    for (beam, says) in [
        (
            "min = [\"200 mm\", \"20 mm\", \"0 mm\"]\nmax = [\"520 mm\", \"100 mm\", \"80 mm\"]",
            "lies outside the cast",
        ),
        (
            "min = [\"40 mm\", \"20 mm\", \"118 mm\"]\nmax = [\"360 mm\", \"100 mm\", \"120 mm\"]",
            "no fibres in beam",
        ),
    ] {
        fs::write(place.join("other.toml"), cuts(beam)).unwrap();
        refused(
            place,
            &["fracture", "--from", "cast", "--beam", "B1", "--cut", "other.toml"],
            &[says, "other.toml"],
        );
    }
}

#[test]
fn single_fibres_are_pulled_out_and_wrong_files_are_refused() {
    let place = tempfile::tempdir().unwrap();
    let place = place.path();
    let single = BEAM.replace(
        "en14651 = { span = \"280 mm\", notch = \"12 mm\" }\nopening = \"0.1 mm\"",
        "pull_out = { embedded = \"20 mm\", diameter = \"0.75 mm\", angle = \"0 deg\" }\nopening = \"25 mm\"",
    );
    fs::write(place.join("fibre.toml"), single).unwrap();
    done(place, &["fracture", "fibre.toml"]);
    let summary = json(&place.join("runs/fibre/summary.json"));
    assert!((summary["loose_force_N"].as_f64().unwrap() - 188.5).abs() < 0.05, "{summary}");
    assert!((1e3 * summary["work_J"].as_f64().unwrap() - 1890.3).abs() < 0.1, "{summary}");

    refused(place, &["fracture"], &["say what to test"]);
    refused(place, &["fracture", "nothing.toml"], &["nothing.toml"]);
    fs::write(place.join("deep.toml"), BEAM.replace("\"12 mm\"", "\"80 mm\"")).unwrap();
    refused(place, &["fracture", "deep.toml"], &["nothing is left", "deep.toml:5"]);
    fs::write(place.join("steep.toml"), BEAM.replace("\"0.05 mm\"", "\"1e-7 mm\"")).unwrap();
    refused(place, &["fracture", "steep.toml"], &["too steep", "steep.toml"]);
    assert!(!place.join("runs/steep").exists() && !place.join("runs/deep").exists());
}
