//! Runs against a baseline, and the baseline itself.

use serde_json::Value;

use crate::common::{Done, Folder, json, twin};

/// A trot of which no expectation notices the ground.
const TROT: &str = r#"
name = "trot"
robot = "cheetah-cub"
duration = "600 ms"
seed = 3

[plant]
model = "massless"
ground = { friction = 0.6 }

[actuator]
lag = "5 ms"
speed = "20 rad/s"
torque = "5 N·m"

[controller]
kind = "cpg"
gait = "trot"
period = "2 ms"
frequency = "3 Hz"
step_length = "10 cm"
hip_height = "125 mm"

[[expect]]
name = "height"
body = { height = { min = "20 mm" } }
"#;

/// Folder with the scenario and its baseline.
struct Rig {
    folder: Folder,
}

impl Rig {
    fn new(test: &str) -> Self {
        let rig = Self {
            folder: Folder::new(test),
        };
        assert_eq!(rig.run(TROT, &[]).code, 0);
        let accepted = rig.accept(&[&rig.recording()]);
        assert_eq!(accepted.code, 0, "{}", accepted.err);
        assert!(
            accepted.out.contains("trot-seed3.mcap  new"),
            "{}",
            accepted.out
        );
        rig
    }

    fn recording(&self) -> String {
        self.folder.join("out/trot-seed3.mcap")
    }

    /// Runs a scenario under the name of the first.
    fn run(&self, text: &str, words: &[&str]) -> Done {
        let file = self.folder.file("trot.toml", text);
        let out = self.folder.join("out");
        twin(&[&["run", &file, "--out", &out], words].concat())
    }

    /// Runs a scenario against the baseline, and returns its report.
    fn against(&self, text: &str) -> (u8, Value) {
        let done = self.run(text, &["--against", &self.folder.join("kept"), "--json"]);
        (done.code, json(&done.out).remove(0))
    }

    fn accept(&self, words: &[&str]) -> Done {
        twin(&[&["accept", &self.folder.join("kept")], words].concat())
    }
}

fn first(report: &Value) -> &str {
    report["against"]["differences"][0]
        .as_str()
        .unwrap_or_default()
}

#[test]
fn change_that_no_expectation_notices_fails_and_is_accepted() {
    let rig = Rig::new("baseline-accept");
    let (code, report) = rig.against(TROT);
    assert_eq!(code, 0, "{report}");
    assert_eq!(report["against"]["same"], true);
    assert_eq!(report["against"]["differences"], serde_json::json!([]));

    let slippery = TROT.replace("friction = 0.6", "friction = 0.1");
    let (code, report) = rig.against(&slippery);
    assert_eq!((code, &report["verdict"]), (1, &"fail".into()));
    assert_eq!(report["expectations"][0]["verdict"], "pass");
    assert!(
        first(&report).starts_with("first differs from the baseline at the ground: "),
        "{report}"
    );
    let differences = report["against"]["differences"].as_array().unwrap();
    assert!(differences.contains(&"not noticed by any expectation".into()));
    let of_leg = |it: &Value| it.as_str().unwrap().starts_with("LF: stance ");
    assert!(differences.iter().any(of_leg), "{report}");
    let before = &report["against"]["measured"][0];
    assert!(before.as_f64().unwrap() > 0.02, "{report}");

    // Printed, it stands first, and the verdict says it.
    let done = rig.run(&slippery, &["--against", &rig.folder.join("kept")]);
    let text = anstream::adapter::strip_str(&done.out).to_string();
    let [parts, expectation] =
        ["first differs from the baseline", "height"].map(|it| text.find(it).unwrap());
    assert!(parts < expectation, "{text}");
    assert!(text.contains("FAIL  1 of 1 expectation holds; the run differs from its baseline"));

    // By default the recordings of the names that are kept are taken.
    let from = rig.folder.join("out");
    let accepted = rig.accept(&["--from", &from]);
    assert_eq!(accepted.code, 0, "{}", accepted.err);
    assert!(
        accepted.out.contains("trot-seed3.mcap  changed"),
        "{}",
        accepted.out
    );
    assert!(
        accepted
            .out
            .contains("  first differs from the baseline at the ground"),
        "{}",
        accepted.out
    );
    assert!(accepted.out.contains(" later"), "{}", accepted.out);
    assert_eq!(rig.against(&slippery).0, 0);
    assert_eq!(rig.against(TROT).0, 1);
    assert_eq!(rig.run(&slippery, &[]).code, 0);
    let again = rig.accept(&["--from", &from, "--json"]);
    let again = json(&again.out).remove(0);
    assert_eq!(again["recordings"][0]["change"], "equal", "{again}");
}

#[test]
fn difference_by_which_runs_part_is_that_of_the_changed_part() {
    let rig = Rig::new("baseline-parting");
    for (was, is, place) in [
        ("lag = \"5 ms\"", "lag = \"6 ms\"", "in the drives: "),
        ("lag = \"5 ms\"", "lag = \"20 ms\"", "in the drives: "),
        (
            "speed = \"20 rad/s\"",
            "speed = \"8 rad/s\"",
            "in the drives: ",
        ),
        (
            "torque = \"5 N·m\"",
            "torque = \"0.3 N·m\"",
            "in the drives: ",
        ),
        ("friction = 0.6", "friction = 0.3", "at the ground: "),
        (
            "step_length = \"10 cm\"",
            "step_length = \"11 cm\"",
            "in the controller: ",
        ),
        (
            "kind = \"cpg\"",
            "kind = \"cpg\"\ncompute_time = \"1 ms\"",
            "in the timing: control step 1 ",
        ),
        (
            "[controller]",
            "[io]\ntransfer_time = \"3 ms\"\n[controller]",
            "in the timing: \"task skipped\" of io at ",
        ),
    ] {
        let changed = TROT.replace(was, is);
        assert_ne!(changed, TROT);
        // Named even where it is within the tolerances.
        let (_, report) = rig.against(&changed);
        let expected = format!("first differs from the baseline {place}");
        assert!(
            first(&report).starts_with(&expected),
            "{is}: {}",
            first(&report)
        );
    }
}

#[test]
fn missing_foreign_or_damaged_baseline_is_an_error() {
    let rig = Rig::new("baseline-refused");
    let kept = rig.folder.join("kept/trot-seed3.mcap");
    let refused = |report: &(u8, Value), why: &str| {
        let error = report.1["error"].as_str().unwrap_or_default();
        assert_eq!(report.0, 2, "{}", report.1);
        assert!(error.contains(why) && error.contains("help: "), "{error}");
    };
    let done = rig.run(TROT, &["--against", &rig.folder.join("nowhere"), "--json"]);
    assert_eq!(done.code, 2);
    assert!(done.out.contains("there is no such folder"), "{}", done.out);
    let renamed = TROT.replace("name = \"trot\"", "name = \"other\"");
    refused(
        &rig.against(&renamed),
        "its scenario is `trot`, not `other`",
    );
    let reseeded = TROT.replace("seed = 3", "seed = 4");
    refused(&rig.against(&reseeded), "has no recording of this run");
    let bytes = std::fs::read(&kept).unwrap();
    std::fs::write(&kept, &bytes[..bytes.len() / 2]).unwrap();
    refused(&rig.against(TROT), "was cut off");
    std::fs::write(&kept, "no recording").unwrap();
    let (code, report) = rig.against(TROT);
    assert_eq!((code, &report["verdict"]), (2, &"error".into()));
    std::fs::remove_file(&kept).unwrap();
    refused(&rig.against(TROT), "has no recording of this run");
    // Without its last bytes it may lack the last samples.
    std::fs::write(&kept, &bytes[..bytes.len() - 7]).unwrap();
    refused(&rig.against(TROT), "was cut off");
    std::fs::remove_file(&kept).unwrap();
    // The baseline is not replaced by the run that is compared with it.
    let done = rig.run(TROT, &["--against", &rig.folder.join("out")]);
    assert_eq!(done.code, 2);
    assert!(
        done.err.contains("would replace the baseline"),
        "{}",
        done.err
    );
    // Nothing names what to take; and what was cut off is not taken.
    assert_eq!(rig.accept(&[]).code, 2);
    let cut = rig.folder.join("cut.mcap");
    std::fs::write(&cut, &bytes[..bytes.len() / 2]).unwrap();
    let done = rig.accept(&[&cut]);
    assert_eq!(done.code, 2);
    assert!(done.err.contains("did not reach its end"), "{}", done.err);
}

#[test]
fn tolerances_are_those_of_the_baseline() {
    let rig = Rig::new("baseline-tolerances");
    let kept = rig.folder.join("kept/baseline.toml");
    assert!(
        std::fs::read_to_string(&kept)
            .unwrap()
            .contains("[signals]")
    );
    let changed = TROT.replace("lag = \"5 ms\"", "lag = \"5.2 ms\"");
    let with = |text: &str| {
        std::fs::write(&kept, text).unwrap();
        rig.against(&changed)
    };
    let wide = "time = '1 s'\nplace = '1 m'\n";
    let (code, report) = with(wide);
    assert_eq!(code, 0, "{report}");
    // It differs, but within them.
    assert!(first(&report).starts_with("first differs from"), "{report}");
    let limited = |pattern: &str, limit: &str| {
        let text = format!("{wide}[signals]\n'{pattern}' = '{limit}'\n");
        with(&text)
    };
    // No signal of the name has that unit.
    for (limit, code) in [("1 um", 1), ("0.1 %", 1), ("1 s", 2), ("1 m", 0)] {
        let (found, report) = limited("body/position", limit);
        assert_eq!(found, code, "{limit}: {report}");
    }
    assert_eq!(limited("body/*", "0.1 %").0, 1);
    // Of those with wildcards, the limit is that of the signals in its unit.
    assert_eq!(limited("body/*", "1 m").0, 0);
    let (code, report) = limited("body/positoin", "1 m");
    assert_eq!(code, 2);
    let error = report["error"].as_str().unwrap();
    assert!(
        error.contains("no signal of the recordings matches `body/positoin`"),
        "{error}"
    );
    // Equal runs are equal, whatever the limits.
    std::fs::write(&kept, "[signals]\n'**' = '0 %'\n").unwrap();
    assert_eq!(rig.against(TROT).0, 0);
    let one = |limit: &str| limited("body/position", limit);
    let (code, report) = one("1 um");
    assert_eq!(code, 1);
    let differences = report["against"]["differences"].to_string();
    assert!(
        differences.contains("body/position[0] differs by "),
        "{differences}"
    );
    let done = {
        std::fs::write(&kept, "tiem = '5 ms'").unwrap();
        rig.run(TROT, &["--against", &rig.folder.join("kept")])
    };
    assert_eq!(done.code, 2);
    assert!(done.err.contains("did you mean `time`?"), "{}", done.err);
}

#[test]
fn page_of_a_run_that_differs_shows_both() {
    let rig = Rig::new("baseline-page");
    let changed = TROT.replace("friction = 0.6", "friction = 0.1");
    let kept = rig.folder.join("kept");
    let done = rig.run(&changed, &["--against", &kept, "--report=failed", "--json"]);
    let report = json(&done.out).remove(0);
    let page = std::fs::read_to_string(report["page"].as_str().unwrap()).unwrap();
    assert!(page.contains("B, a run that differs from its baseline, A"));
    assert!(page.contains("B first differs from A at the ground: "));
    // One that passes has none.
    let done = rig.run(TROT, &["--against", &kept, "--report=failed", "--json"]);
    assert_eq!(json(&done.out).remove(0).get("page"), None);
    // Nor is that of the recording which it replaces left.
    assert!(!std::path::Path::new(&rig.folder.join("out/trot-seed3.html")).exists());
}

#[test]
fn report_replaces_no_recording_and_leaves_no_half_of_a_page() {
    let rig = Rig::new("baseline-report");
    let recording = rig.recording();
    let before = std::fs::read(&recording).unwrap();
    let report = |words: &[&str]| twin(&[&["report"], words].concat());
    let done = report(&[&recording, "--out", &recording]);
    assert_eq!(done.code, 2);
    assert!(
        done.err.contains("would replace the recording"),
        "{}",
        done.err
    );
    assert_eq!(
        report(&[&recording, "--out", &rig.folder.join("page.svg")]).code,
        2
    );
    let empty = rig.folder.join("empty.mcap");
    std::fs::write(&empty, &before[..1000]).unwrap();
    let done = report(&[&empty]);
    assert_eq!(done.code, 2);
    assert!(done.err.contains("has no samples"), "{}", done.err);
    let kept = rig.folder.join("kept/trot-seed3.mcap");
    let done = report(&[&recording, &kept, "--json"]);
    let written = json(&done.out).remove(0);
    let page = written["page"].as_str().unwrap();
    assert!(page.ends_with("trot-seed3-and-trot-seed3.html"), "{page}");
    assert!(std::path::Path::new(written["picture"].as_str().unwrap()).exists());
    assert_eq!(std::fs::read(&recording).unwrap(), before);
    // Two of one name cannot both be kept.
    let done = rig.accept(&[&recording, &kept]);
    assert_eq!(done.code, 2);
    assert!(
        done.err.contains("two of the recordings have this name"),
        "{}",
        done.err
    );
}
