//! What happens when things go wrong from outside: kills, full disks, damaged files, numbers that break down.

use std::time::Duration;

use super::*;

/// Replacements that let the program write a checkpoint after every step or so.
const CHECKPOINTS: (&str, &str) =
    ("picture_interval = \"0.5 s\"\n", "picture_interval = \"0.5 s\"\ncheckpoint_interval = \"1 us\"\n");

/// The same without fields and pictures.
const ONLY_CHECKPOINTS: (&str, &str) =
    ("snapshot_interval = \"0.3 s\"\npicture_interval = \"0.5 s\"\n", "checkpoint_interval = \"1 us\"\n");

/// Names of all files in a folder.
fn names(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).unwrap();
    let mut names: Vec<String> =
        entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

/// Whether two runs left the same files, but for what tells of wall-clock time.
fn same_results(a: &Path, b: &Path) {
    assert_eq!(names(a), names(b));
    for name in
        names(a).iter().filter(|name| !["run.json", "summary.json", "case.toml"].contains(&name.as_str()))
    {
        assert!(fs::read(a.join(name)).unwrap() == fs::read(b.join(name)).unwrap(), "{name} differs");
    }
}

#[cfg(unix)]
#[test]
fn a_run_killed_at_any_moment_goes_on_from_its_last_checkpoint() {
    let place = folder_with_case(&[("\"1 s\"", "\"0.5 s\"")]);
    let place = place.path();
    done(place, &["run", "slump.toml", "--out", "whole", "-q"]);
    let often = CASE.replace("\"1 s\"", "\"0.5 s\"").replace(CHECKPOINTS.0, CHECKPOINTS.1);
    fs::write(place.join("often.toml"), often).unwrap();

    let run = place.join("parts");
    let written = || fs::metadata(run.join("checkpoint.tremie")).and_then(|file| file.modified()).ok();
    for n in 0u64..12 {
        let before = written();
        let arguments: &[&str] = match before {
            Some(_) => &["resume", "parts", "-q"],
            None => &["run", "often.toml", "--out", "parts", "-q"],
        };
        let mut child =
            tremie(place, arguments).stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap();
        // Some moment after its first checkpoint, most likely in one of the next.
        let began = Instant::now();
        while written() == before {
            assert!(began.elapsed() < Duration::from_secs(60), "no checkpoint");
            assert!(child.try_wait().unwrap().is_none(), "the run ended before it could be killed");
            std::thread::sleep(Duration::from_millis(1));
        }
        std::thread::sleep(Duration::from_micros(n * 7919 % 23_000));
        child.kill().unwrap();
        child.wait().unwrap();
    }
    done(place, &["resume", "parts", "-q"]);
    same_results(&place.join("whole"), &run);
}

#[cfg(unix)]
#[test]
fn a_full_disk_is_told_and_leaves_the_last_checkpoint() {
    let place = folder_with_case(&[("\"20 mm\"", "\"10 mm\""), ONLY_CHECKPOINTS, ("\"1 s\"", "\"0.06 s\"")]);
    let place = place.path();
    // A shell that lets no file grow beyond so many blocks of 512 bytes.
    let limited = |blocks: u32, arguments: &str| {
        let script =
            format!("trap '' XFSZ; ulimit -f {blocks}; exec '{}' {arguments}", env!("CARGO_BIN_EXE_tremie"));
        Command::new("sh").current_dir(place).args(["-c", &script]).env("NO_COLOR", "1").output().unwrap()
    };
    let refused = |output: &Output, name: &str| {
        let told = text(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{told}");
        assert!(told.contains(name) && told.contains("too large") && !told.contains("panicked"), "{told}");
        assert_eq!(told.matches("error: ").count(), 1, "{told}");
    };
    // Not even a checkpoint fits, and no half of one is left.
    refused(&limited(20, "run slump.toml --out first -q"), "checkpoint.tremie");
    assert_eq!(names(&place.join("first")).iter().filter(|name| name.contains("checkpoint")).count(), 0);
    // The disk fills up later: the last good checkpoint is still there, and so the run can go on.
    done(place, &["run", "slump.toml", "--out", "second", "-q"]);
    let longer = fs::read_to_string(place.join("second/case.toml")).unwrap().replace("0.06 s", "0.12 s");
    fs::write(place.join("second/case.toml"), longer).unwrap();
    let before = fs::read(place.join("second/checkpoint.tremie")).unwrap();
    refused(&limited(20, "resume second -q"), "checkpoint.tremie");
    assert!(fs::read(place.join("second/checkpoint.tremie")).unwrap() == before);
    done(place, &["resume", "second", "-q"]);
}

#[cfg(target_os = "linux")]
#[test]
fn output_that_nobody_takes_is_no_reason_to_panic() {
    let place = folder_with_case(&[]);
    for arguments in [&["check", "slump.toml"][..], &["schema"], &["new", "--list"], &["validate", "scaling"]]
    {
        let full = fs::OpenOptions::new().write(true).open("/dev/full").unwrap();
        let output = tremie(place.path(), arguments).stdout(full).stderr(Stdio::piped()).output().unwrap();
        let told = text(&output.stderr);
        assert!(output.status.code().is_some_and(|code| code < 2), "{arguments:?}: {told}");
        assert!(!told.contains("panicked"), "{arguments:?}: {told}");
    }
}

#[cfg(target_os = "linux")]
#[test]
fn a_folder_that_cannot_be_written_is_refused() {
    let place = folder_with_case(&[]);
    // Nobody can make folders here, not even root.
    refused(place.path(), &["run", "slump.toml", "--out", "/proc/tremie"], &["/proc/tremie"]);
    refused(place.path(), &["run", "slump.toml", "--out", "slump.toml/run"], &["slump.toml/run"]);
}

#[test]
fn a_breakdown_keeps_the_last_good_checkpoint() {
    // At first slow, the flow soon becomes far too fast for so long a step.
    let step = "cell_size = \"20 mm\"\ntime_step = \"5 ms\"";
    let place = folder_with_case(&[
        ("cell_size = \"20 mm\"", step),
        ("\"30 Pa s\"", "\"0.1 Pa s\""),
        ("\"50 Pa\"", "\"0 Pa\""),
        CHECKPOINTS,
    ]);
    let place = place.path();
    let broken = output(place, &["run", "slump.toml", "-q"]);
    let told = text(&broken.stderr);
    assert_eq!(broken.status.code(), Some(1), "{told}");
    for word in
        ["error: at t = ", "near (", "the flow is too fast or too stiff", "last good state is in runs/slump"]
    {
        assert!(told.contains(word), "{word}: {told}");
    }
    assert_eq!(json(&place.join("runs/slump/run.json"))["end_reason"], "breakdown");
    // From the last good state it breaks down again at the same moment and place.
    let again = output(place, &["resume", "runs/slump", "-q"]);
    let breakdown =
        |told: &str| told.lines().find(|line| line.contains("error: at t = ")).unwrap().to_owned();
    assert_eq!(breakdown(&told), breakdown(&text(&again.stderr)));
}

#[test]
fn what_cannot_work_is_refused_before_anything_runs() {
    let lbm = |setting: &str| format!("cell_size = \"20 mm\"\n{setting}");
    for (old, new, words) in [
        (
            "cell_size = \"20 mm\"",
            lbm("time_step = \"40 ms\""),
            &["slump.toml:18:13", "time step is too long", "ms\" at most"][..],
        ),
        ("cell_size = \"20 mm\"", lbm("time_step = \"1 as\""), &["there is no unit"]),
        ("cell_size = \"20 mm\"", lbm("time_step = \"1e-18 s\""), &["slump.toml:18:13", "would take years"]),
        ("\"30 Pa s\"", "\"1e14 Pa s\"".into(), &["slump.toml:24:8", "would take years"]),
        ("time = \"1 s\"", "time = \"1e12 s\"".into(), &["999999 files"]),
        ("height = \"300 mm\"", "height = \"15 mm\"".into(), &["slump.toml:17:13", "thinner than a cell"]),
        (
            "height = \"300 mm\" }",
            "height = \"300 mm\" }\nvelocity = [\"1e12 m/s\", \"0 m/s\", \"0 m/s\"]".into(),
            &["would take years"],
        ),
        (
            "base = [\"0 m\", \"0 m\", \"0 m\"]",
            "base = [\"430 mm\", \"430 mm\", \"0 m\"]".into(),
            &["slump.toml:13:1", "none of this fluid"],
        ),
        (
            "max = [\"340 mm\", \"340 mm\", \"320 mm\"]\nsides = { x_min = \"symmetry\", y_min = \"symmetry\" }",
            "max = [\"20 m\", \"20 m\", \"20 m\"]\n".into(),
            &["none"],
        ),
    ] {
        if words == ["none"] {
            // As large as may be: it is computed where there is fluid.
            let place = folder_with_case(&[(old, &new)]);
            done(place.path(), &["check", "slump.toml"]);
            continue;
        }
        let place = folder_with_case(&[(old, &new)]);
        for command in ["run", "check"] {
            refused(place.path(), &[command, "slump.toml"], words);
        }
        assert!(!place.path().join("runs").exists());
    }
}

#[test]
fn more_memory_than_there_is_is_refused() {
    let place = folder_with_case(&[
        ("[\"340 mm\", \"340 mm\", \"320 mm\"]", "[\"1 m\", \"1 m\", \"1 m\"]"),
        (
            "cone = { base = [\"0 m\", \"0 m\", \"0 m\"], base_diameter = \"200 mm\", top_diameter = \"100 mm\", height = \"300 mm\" }",
            "box = { min = [\"0 m\", \"0 m\", \"0 m\"], max = [\"1 m\", \"1 m\", \"1 m\"] }",
        ),
        ("cell_size = \"20 mm\"", "cell_size = \"0.8 mm\""),
    ]);
    // 1250^3 cells full of fluid: 1.2 TB.
    if cfg!(target_os = "linux") {
        refused(place.path(), &["check", "slump.toml"], &["slump.toml:17:13", "of memory, this machine has"]);
    }
}
