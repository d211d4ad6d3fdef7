//! End-to-end tests of studies of gaits on short runs.

use crate::common::{Done, Folder, json, study_result, twin};

fn scenario(name: &str) -> String {
    format!("{}/../../scenarios/{name}", env!("CARGO_MANIFEST_DIR"))
}

fn study(kind: &str, words: &[&str], folder: &Folder) -> Done {
    let out = folder.join("out");
    let begin = ["study", kind, "--out", &out];
    twin(&[&begin[..], words].concat())
}

#[test]
fn no_change_moves_no_footstep_and_a_change_is_in_text_page_and_data() {
    let folder = Folder::new("study-modulation");
    let file = scenario("step-change.toml");
    let small = ["--points", "2", "--steps", "3", "--after", "3 s"];
    let words = [&[&*file, "--by=0 mm,-20 mm", "--json"][..], &small].concat();
    let mut printed = ["one", "two"].map(|out| {
        // Rows of the first one are not those of the second.
        let out = folder.join(out);
        let words = [&["study", "modulation", "--out", &out][..], &words].concat();
        let done = twin(&words);
        let mut printed = study_result(&done);
        // It names the folder.
        printed.as_object_mut().unwrap().remove("command");
        printed
    });
    assert_eq!(printed[0], printed[1]);
    let found = printed[0].take();
    let case = &found["cases"][0];
    assert_eq!((&case["runs"], &case["fell"]), (&4.into(), &0.into()));
    // Duty factors of 0.509 and 0.505.
    let by_duty = case["ideal"]["by_duty"].as_f64().unwrap();
    assert!((by_duty - 2.0 / (0.509 + 0.505)).abs() < 1e-12);
    for table in case["tables"].as_array().unwrap() {
        for cell in table["cells"].as_array().unwrap() {
            let mean = cell["mean_m"].as_f64().unwrap();
            if cell["by"] == 0.0 {
                assert_eq!(
                    (mean, &cell["range_m"]),
                    (0.0, &serde_json::json!([0.0, 0.0]))
                );
            }
        }
    }
    let by_cycle = case["tables"][0]["cells"].as_array().unwrap();
    let changed = by_cycle.iter().filter(|cell| cell["by"] == -0.02);
    assert!(changed.clone().count() == 3);
    assert!(
        changed
            .clone()
            .all(|cell| cell["mean_m"].as_f64().unwrap() < -0.005)
    );
    for ending in ["html", "csv", "json"] {
        let path = folder.join(&format!("one/modulation-step-change.{ending}"));
        assert!(std::path::Path::new(&path).exists(), "{path}");
    }
}

#[test]
fn factors_are_compared_and_unsuitable_requests_have_a_remedy() {
    let folder = Folder::new("study-modulation-factors");
    let file = scenario("step-change.toml");
    let small = [
        "--points",
        "1",
        "--steps",
        "1",
        "--after",
        "2 s",
        "--by=-20 mm",
    ];
    let done = study(
        "modulation",
        &[&[&*file, "--factors"][..], &small].concat(),
        &folder,
    );
    assert_eq!((done.code, done.err.as_str()), (0, ""));
    for expected in [
        "as given: ",
        "unsaturated servos: ",
        "by geometry",
        "of 1 by cycle",
    ] {
        assert!(
            done.out.contains(expected),
            "no {expected} in\n{}",
            done.out
        );
    }
    // Without feedback it is the same controller.
    assert!(!done.out.contains("no feedback"));
    let bench = scenario("bench.toml");
    for (words, why, help) in [
        (
            &[&*file, "--variable", "lenght"][..],
            "no variable `lenght`",
            "twin list",
        ),
        (&[&*file, "--by=-5 s"], "--by -5 s", "--by="),
        (
            &[&*file, "--variable", "frequency"],
            "`frequency` is not",
            "--by",
        ),
        (
            &[&*file, "--after", "2 s", "--steps", "200"],
            "footsteps of leg",
            "--steps",
        ),
        (&[&*bench], "touch no ground", "whole robot"),
    ] {
        let done = study("modulation", words, &folder);
        assert_eq!(
            (done.code, done.out.as_str()),
            (2, ""),
            "{why}: {}",
            done.err
        );
        assert!(
            done.err.contains(why) && done.err.contains(help),
            "{}",
            done.err
        );
        // The remedy is the last line.
        let mut lines = done.err.lines().rev();
        assert!(lines.next().unwrap().starts_with("  = help: "));
        assert!(lines.next().unwrap().starts_with(" --> "), "{}", done.err);
    }
}

/// A run of five seconds, without expectations of later ones.
const SHORT: [&str; 4] = [
    "--set",
    "duration=5 s",
    "--set",
    "expect=[{body={fall=false}}]",
];
/// Legs that are in phase with those of their side from 3 s on.
const TO_PACE: &str = r#"change=[{at="3 s",set="phase_difference/LH",to="0 rad"},{at="3 s",set="phase_difference/RH",to="3.1 rad"}]"#;

#[test]
fn transition_moves_with_the_plateaus_and_its_value_is_that_of_the_variable() {
    let folder = Folder::new("study-transition");
    let file = scenario("trot.toml");
    let shorter = "controller.step_length=100 mm";
    let words = [&[&*file, "--set", TO_PACE, "--set", shorter][..], &SHORT].concat();
    let more = [
        "--plant",
        "massless",
        "--plant",
        "lcp",
        "--plateau",
        "3s,4s",
        "--json",
    ];
    let done = study("transition", &[&words[..], &more].concat(), &folder);
    assert_eq!((done.code, done.err.as_str()), (0, ""), "{}", done.out);
    let found = json(&done.out).remove(0);
    assert_eq!(found["variable"], "phase_difference/LH");
    let cases = found["cases"].as_array().unwrap();
    assert_eq!(cases.len(), 4);
    for case in cases {
        let plateau_s = case["plateau_s"].as_f64().unwrap();
        let first = &case["transitions"][0];
        assert!(first.is_object(), "{}", found["headline"]);
        assert_eq!(
            (&first["from"], &first["value"]),
            (&"trot".into(), &0.0.into())
        );
        let begin_s = first["begin_s"].as_f64().unwrap();
        // Two cycles of 0.275 s.
        assert!((plateau_s..plateau_s + 0.55).contains(&begin_s), "{first}");
        let values = case["values"].as_array().unwrap();
        assert_eq!(values[1], serde_json::json!([plateau_s, 0.0]));
    }
    for ending in ["html", "csv", "json"] {
        let path = folder.join(&format!("out/transition-trot.{ending}"));
        assert!(std::path::Path::new(&path).exists(), "{path}");
    }
}

#[test]
fn gait_without_transition_is_reported_and_a_scenario_without_changes_refused() {
    let folder = Folder::new("study-transition-none");
    let file = scenario("step-change.toml");
    let change = [
        "--set",
        r#"change=[{at="2 s",set="step_length",by="-1 cm"}]"#,
    ];
    let done = study(
        "transition",
        &[&[&*file][..], &SHORT, &change].concat(),
        &folder,
    );
    assert_eq!((done.code, done.err.as_str()), (0, ""));
    assert!(
        done.out.contains("no transition, mostly trot"),
        "{}",
        done.out
    );
    let trot = scenario("trot.toml");
    for (words, why) in [
        (&[&*trot][..], "changes no variable"),
        (&[&*file, "--variable", "ramp"], "it changes `step_length`"),
        (&[&*file, "--plateau", "0 s"], "positive"),
        (&[&*file, "--plateau", "61 min"], "at most 3600 s"),
        (&[&*file, "--tolerance", "0.6"], "at most 0.5"),
    ] {
        let done = study("transition", words, &folder);
        assert_eq!(
            (done.code, done.out.as_str()),
            (2, ""),
            "{why}: {}",
            done.err
        );
        assert!(done.err.contains(why), "{}", done.err);
    }
}

/// Runs of three seconds, of which the second and third count.
const BRIEF: [&str; 13] = [
    "--set",
    "duration=3 s",
    "--set",
    "expect=[{body={fall=false}}]",
    "--after",
    "1 s",
    "--phases",
    "1 s",
    "--by=-10 mm",
    "--points",
    "1",
    "--steps",
    "1",
];

#[test]
fn loads_differ_by_delay_and_error_and_equal_ones_are_void() {
    let folder = Folder::new("study-loads");
    let [own, force] = ["tegotae-trot.toml", "tegotae-force.toml"].map(scenario);
    let words = [&[&*own, &*force, "--lag", "5ms", "--json"][..], &BRIEF].concat();
    let done = study("loads", &words, &folder);
    assert_eq!((done.code, done.err.as_str()), (0, ""), "{}", done.out);
    let found = json(&done.out).remove(0);
    let legs = |case: usize, key: &str| -> Vec<f64> {
        let loads = found["cases"][case]["found"]["loads"].as_array().unwrap();
        loads.iter().map(|leg| leg[key].as_f64().unwrap()).collect()
    };
    // Without a bus a load arrives whole, one control period later.
    for (delay_s, rest_n) in legs(0, "delay_s").into_iter().zip(legs(0, "rest_n")) {
        assert!(
            (delay_s - 2e-3).abs() < 2e-5 && rest_n < 0.1,
            "{delay_s} {rest_n}"
        );
    }
    // A sample each millisecond, and a transfer of less.
    assert!(
        legs(1, "delay_s")
            .iter()
            .all(|delay_s| (0.0..2e-3).contains(delay_s))
    );
    // A filter of first order delays all frequencies by less than its time constant.
    assert!(
        legs(2, "delay_s")
            .iter()
            .all(|delay_s| (2e-3..7e-3).contains(delay_s))
    );
    for case in [1, 2] {
        let found = &found["cases"][case]["found"];
        assert!(found["phases_rad"].as_f64().unwrap() > 1e-3, "{found}");
    }
    let words = [&[&*own, &*own][..], &BRIEF].concat();
    let done = study("loads", &words, &folder);
    assert_eq!((done.code, done.err.as_str()), (1, ""), "{}", done.out);
    assert!(done.out.contains("never: void"), "{}", done.out);
    let done = study("loads", &[&[&*own][..], &BRIEF].concat(), &folder);
    assert_eq!((done.code, done.err.as_str()), (0, ""), "{}", done.out);
    assert!(done.out.contains("No other load"), "{}", done.out);
    let open_loop = scenario("trot.toml");
    let done = study("loads", &[&*open_loop], &folder);
    assert_eq!((done.code, done.out.as_str()), (2, ""), "{}", done.err);
    assert!(done.err.contains("takes no loads"), "{}", done.err);
}

#[test]
fn element_of_a_list_given_twice_is_refused() {
    let folder = Folder::new("study-twice");
    let (change, ramp) = (
        scenario("step-change.toml"),
        scenario("thesis/fig-3-7.toml"),
    );
    for (kind, file, option, twice) in [
        (
            "modulation",
            &change,
            "--by=-5 mm,-0.5 cm",
            "--by has the change -0.5 cm twice",
        ),
        (
            "transition",
            &ramp,
            "--plateau=5s,5000ms",
            "--plateau has `5.000 s` twice",
        ),
    ] {
        let done = study(kind, &[file, option], &folder);
        assert_eq!(done.code, 2, "{}", done.out);
        assert!(done.err.contains(twice), "{}", done.err);
    }
    let plants = ["--plant", "massless", "--plant", "massless"];
    let done = study("modulation", &[&[&*change][..], &plants].concat(), &folder);
    assert!(
        done.err.contains("--plant has `massless` twice"),
        "{}",
        done.err
    );
}

/// Against the run of the scenario itself, and the height of its hips.
#[test]
fn gait_at_the_values_of_the_scenario_is_that_of_its_run() {
    let folder = Folder::new("study-gait");
    let file = scenario("trot.toml");
    let axes = ["--frequency=3.64 Hz,3 Hz", "--step-length=135.5 mm,12 cm"];
    let words = [&[&*file, "--after", "5 s", "--json"][..], &axes].concat();
    let done = study("gait", &words, &folder);
    assert_eq!((done.code, done.err.as_str()), (0, ""), "{}", done.out);
    let found = json(&done.out).remove(0);
    let points = found["points"].as_array().unwrap();
    assert_eq!(points.len(), 4);
    let run = json(&twin(&["run", &file, "--no-record", "--json"]).out).remove(0);
    let lines = run["expectations"].as_array().unwrap();
    let speed = lines.iter().find(|line| line["name"] == "forward speed");
    assert_eq!(points[0]["speed_m_s"], speed.unwrap()["measured"]);
    for point in points {
        let [speed, froude, frequency, length] =
            ["speed_m_s", "froude", "frequency_hz", "step_length_m"]
                .map(|key| point[key].as_f64().unwrap());
        // A foot on the ground covers a step length in the duty factor's share of a cycle.
        let commanded = length * frequency / 0.507;
        assert!((speed / commanded - 1.0).abs() < 0.06, "{point}");
        // Hips at 114 and 123 mm, less the crouch of 8 mm and what the springs give.
        let height = speed * speed / (9.81 * froude);
        assert!((0.10..0.125).contains(&height), "{height}");
        assert!((0.5..2.0).contains(&point["cost_of_transport"].as_f64().unwrap()));
    }
    for (words, why) in [
        (&[&*file, "--frequency=3 mm"][..], "--frequency 3 mm"),
        (&[&*file, "--step-length=8 cm,80 mm"], "--step-length has"),
        (&[&*file, "--after=20 s"], "the run ends at 20 s"),
        (
            &[&*file, "--frequency=3 Hz,0 Hz"],
            "--frequency 0 Hz: it must be above 0",
        ),
        (
            &[&*file, "--frequency=1 MHz"],
            "above half of the control rate",
        ),
        (&[&*scenario("passive-legs.toml")], "cannot be studied"),
    ] {
        let done = study("gait", words, &folder);
        assert_eq!(
            (done.code, done.out.as_str()),
            (2, ""),
            "{why}: {}",
            done.err
        );
        assert!(done.err.contains(why), "{}", done.err);
    }
}
