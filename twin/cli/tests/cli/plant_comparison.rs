//! Runs of several plants, and comparison of recordings footstep by footstep.

use crate::common::{Folder, SOUND, json, twin};

/// Scenario of a robot that trots for 900 ms.
const STEPPING: &str = r#"
name = "stepping"
robot = "cheetah-cub"
duration = "900 ms"
plant = { model = "massless", base = "free", ground = { friction = 0.6 }, step = "1 ms" }
actuator = { kind = "servo", lag = "5 ms", speed = "20 rad/s", torque = "5 N·m", dead_band = "0 deg" }
controller = { kind = "cpg", gait = "trot", period = "2 ms", frequency = "3.5 Hz", ramp = "100 ms" }

[[expect]]
name = "does not fall"
body = { fall = false }
"#;

#[test]
fn plants_are_run_and_compared_with_the_first() {
    let folder = Folder::new("plants");
    let scenario = folder.file("step.toml", STEPPING);
    let out = folder.join("out");
    let words = [
        "run", &scenario, "--out", &out, "--json", "--plant", "massless", "--plant", "lcp",
    ];
    let done = twin(&words);
    let all = json(&done.out);
    assert_eq!(all.len(), 3, "{done:?}");
    assert_eq!([&all[0]["plant"], &all[1]["plant"]], ["massless", "lcp"]);
    let recordings = [0, 1].map(|run| all[run]["recording"].as_str().unwrap());
    for (recording, plant) in recordings.iter().zip(["massless", "lcp"]) {
        assert!(
            recording.ends_with(&format!("out/step-seed1-{plant}.mcap")),
            "{recording}"
        );
    }
    let other = &all[2]["comparison"];
    assert_eq!(other["plant_b"], "lcp");
    assert!(
        other["footsteps"]["pairs"].as_u64().unwrap() >= 4,
        "{other}"
    );
    assert!(other["signals"][0]["aligned"]["max"].as_f64().unwrap() > 0.0);
    // The exit code is that of the runs; differences are not failures.
    assert!(done.code < 2);

    let diff = |bounds: &[&str]| {
        twin(
            &[
                &["diff", "--events", recordings[0], recordings[1], "--json"],
                bounds,
            ]
            .concat(),
        )
    };
    let close = diff(&["--time", "1 us", "--place", "1 um"]);
    assert_eq!(close.code, 1);
    assert_eq!(json(&close.out)[0]["first"]["what"], "moved");
    // Within unlimited tolerances only footsteps without a partner differ.
    let wide = diff(&["--time", "1 min", "--place", "1 km"]);
    let difference = &json(&wide.out)[0];
    let footsteps = &difference["footsteps"];
    let missing =
        footsteps["only_in_a"].as_u64().unwrap() + footsteps["only_in_b"].as_u64().unwrap();
    assert_eq!(wide.code, u8::from(missing > 0), "{difference}");
    assert_eq!(footsteps["pairs"], footsteps["same"]);
    let signals = diff(&["--time", "1 min", "--place", "1 km", "--share", "1 %"]);
    assert_eq!(signals.code, 1);
    assert!(!json(&signals.out)[0]["first_signal"].is_null());
    let text = twin(&["diff", "--events", recordings[0], recordings[1]]).out;
    check_text(&text);
    let text = twin(&["diff", "--events", recordings[0], recordings[0]]);
    assert!(
        text.code == 0 && text.out == "identical, bit for bit\n",
        "{}",
        text.out
    );
    assert_eq!(
        twin(&["diff", recordings[0], recordings[0], "--time", "1 s"]).code,
        2
    );
}

/// Checks the text form: the summary with the distance of the trunks, then one row per kind of
/// signal in the order in which they differ, the energy residual last.
fn check_text(text: &str) {
    let summary = text.lines().next().unwrap();
    assert!(
        summary.starts_with("different: b is ")
            && summary.contains(" at 0.9 s (")
            && summary.contains("footsteps are pairs; touch-downs within "),
        "{text}"
    );
    assert_eq!(text.matches(" median").count(), 3, "{text}");
    let rows = text
        .lines()
        .skip_while(|line| !line.contains("signals stride by stride"));
    let rows: Vec<&str> = rows.skip(2).map(str::trim).collect();
    // Two columns are times; the second is that of 10 %.
    let seconds = |cell: &str| {
        let (number, unit) = cell.trim().rsplit_once(' ')?;
        let factor = match unit {
            "s" => 1.0,
            "ms" => 1e-3,
            _ => return None,
        };
        Some(factor * number.parse::<f64>().ok()?)
    };
    let onset = |row: &&str| row.split("  ").filter_map(seconds).nth(1);
    let onsets: Vec<f64> = rows.iter().filter_map(onset).collect();
    assert!(onsets.len() > 2 && onsets.is_sorted(), "{text}");
    let feet = rows.iter().filter(|row| row.contains("/foot/load"));
    assert!(feet.count() <= 1, "one row for all four legs: {text}");
    let residual = rows
        .iter()
        .position(|row| row.starts_with("energy/residual "))
        .unwrap();
    assert!(
        rows[residual].contains("J ") && !rows[residual].contains('%'),
        "{text}"
    );
    assert!(
        rows[residual + 1..].iter().all(|row| !row.contains('%')),
        "it is the last row: {text}"
    );
}

#[test]
fn plants_resume_from_state_of_first_plant() {
    let folder = Folder::new("from");
    let scenario = folder.file("step.toml", STEPPING);
    let run = |words: &[&str]| {
        twin(
            &[
                &["run", &scenario, "--out", &folder.join("out"), "--json"],
                words,
            ]
            .concat(),
        )
    };
    let uninterrupted = run(&["--plant", "lcp"]);
    let done = run(&[
        "--plant", "lcp", "--plant", "massless", "--plant", "lcp", "--from", "500 ms",
    ]);
    let all = json(&done.out);
    assert_eq!(all.len(), 3, "one report and two comparisons: {done:?}");
    assert_eq!(
        all[0]["fingerprint"],
        json(&uninterrupted.out)[0]["fingerprint"],
        "saving does not change the run"
    );
    for (comparison, plant) in all[1..].iter().zip(["massless", "lcp"]) {
        let of = &comparison["comparison"];
        assert_eq!(
            (&of["plant_b"], &of["from_s"]),
            (&plant.into(), &0.5.into())
        );
        assert_eq!(of["not_taken_over"], serde_json::json!([]));
        // From the first observation after the exchange.
        assert_eq!(of["window_s"][1], 0.9);
        assert!(
            (of["window_s"][0].as_f64().unwrap() - 0.5).abs() < 0.005,
            "{of}"
        );
        let feet = of["signals"].as_array().unwrap().iter();
        let feet = feet.filter(|signal| signal["signal"] == "leg/LF/foot/position");
        // In the first tenth, 40 ms, the difference is small: 0.8 mm at 1 m/s².
        assert!(feet.clone().count() == 3);
        for foot in feet {
            assert!(
                foot["plain"]["rms_of_tenths"][0].as_f64().unwrap() < 5e-3,
                "{foot}"
            );
        }
    }
    let recording = all[1]["comparison"]["recording_b"].as_str().unwrap();
    assert!(recording.ends_with("-from-lcp-0.5s.mcap"), "{recording}");
    let replayed = twin(&["replay", recording]);
    assert!(replayed.code == 2 && replayed.err.contains("its plant was exchanged at 0.5 s"));
}

#[test]
fn incompatible_options_are_refused_with_remedy() {
    let folder = Folder::new("refused");
    let scenario = folder.file("bob.toml", SOUND);
    let run =
        |words: &[&str]| twin(&[&["run", &scenario, "--out", &folder.join("out")], words].concat());
    let one = run(&["--from", "1 s"]);
    assert!(
        one.code == 2 && one.err.contains("requires two plants"),
        "{one:?}"
    );
    let two = ["--plant", "toy", "--plant", "snapping"];
    let twice = run(&["--plant", "toy", "--plant", "snapping", "--plant", "toy"]);
    assert!(
        twice.code == 2
            && twice.err.contains("`toy` is named twice")
            && twice.err.contains("help: name each plant once"),
        "{twice:?}"
    );
    let file = twin(&["run", &scenario, "--out", &folder.join("x.mcap")]);
    assert!(
        file.code == 2 && file.err.contains("name a folder"),
        "{file:?}"
    );
    assert!(!std::path::Path::new(&folder.join("x.mcap")).exists());
    // Errors of the second plant are reported before the first run.
    let absent = run(&["--plant", "toy", "--plant", "absent"]);
    assert!(
        absent.code == 2 && absent.err.contains("absent") && absent.out.is_empty(),
        "{absent:?}"
    );
    assert!(!std::path::Path::new(&folder.join("out")).exists());
    let late = run(&[&two[..], &["--from", "1 s"]].concat());
    assert!(
        late.code == 2 && late.err.contains("is not before the end of the run"),
        "{late:?}"
    );
    // The toy plants cannot resume.
    let toys = run(&[&two[..], &["--from", "0.2 s"]].concat());
    assert!(
        toys.code == 2 && toys.out.contains("toy has no plant-independent state"),
        "{toys:?}"
    );
    let unrecorded = twin(&[
        "run",
        &scenario,
        "--no-record",
        "--plant",
        "toy",
        "--plant",
        "snapping",
    ]);
    assert!(
        unrecorded.code == 2 && unrecorded.err.contains("which --no-record disables"),
        "{unrecorded:?}"
    );
    // A run that fails earlier is different; without footsteps the signals are compared.
    let done = run(&[&two[..], &["--json"]].concat());
    let all = json(&done.out);
    assert_eq!(done.code, 2, "one of them failed");
    let comparison = &all[2]["comparison"];
    assert_eq!(
        (&comparison["same"], &comparison["ended_early"]),
        (&false.into(), &true.into())
    );
    assert_eq!(comparison["footsteps"]["a"], 0);
    assert_eq!(
        comparison["signals"][0]["aligned"]["max"], 0.0,
        "the motions are equal until then"
    );
}
