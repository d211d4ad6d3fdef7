//! Evaluation of expectations on hardware: observable ones are evaluated as in virtual time, others
//! are unobserved.

use std::thread::sleep;
use std::time::Duration;

use serde_json::{Value, json};

use super::{
    Running, STAND, WELL_RECORDED, bus_was_late, is_longer, run_on_twin, wait_until, with_retries,
};
use crate::common::{Folder, twin};

/// Returns a scenario with expectations of the bus, of the control cycle and of the plant;
/// `optional` is appended to the last. On an overloaded machine the bus is silent for a time.
fn scenario_with_expectations(optional: &str) -> String {
    format!(
        r#"{STAND}
[[expect]]
name = "there are cycles"
through_silence = true
signal = {{ name = "sbcp/cycles", always = {{ min = 1 }} }}
after = "0.9 s"

[[expect]]
name = "and control steps"
through_silence = true
timing = {{ of = "control", cycle_rate = {{ min = "1 Hz" }} }}

[[expect]]
name = "commands are moderate"
signal = {{ name = "leg/*/hip/command", always = {{ min = "-0.6 rad", max = "0.6 rad" }} }}

[[expect]]
name = "hips turn"
signal = {{ name = "leg/LF/hip/rate", eventually = {{ min = "0.01 rad/s" }} }}
{optional}
"#
    )
}

#[test]
fn unobservable_expectation_fails_unless_optional() {
    let folder = Folder::new("judging");
    let link = folder.join("bus");
    for (optional, code, verdict) in [("", 1, "fail"), ("optional = true", 0, "pass")] {
        let scenario = folder.file("bench.toml", &scenario_with_expectations(optional));
        let [run, _] = run_on_twin(&folder, &scenario, &link, &["--json"]);
        assert_eq!(run.code, Some(code), "{run:?}");
        let report = run.report();
        assert_eq!(report["verdict"], verdict);
        let verdicts: Vec<&Value> = lines(&report).map(|line| &line["verdict"]).collect();
        assert_eq!(verdicts, ["pass", "pass", "pass", "unobserved"], "{report}");
    }
}

fn lines(report: &Value) -> impl Iterator<Item = &Value> {
    report["expectations"].as_array().unwrap().iter()
}

#[test]
fn report_on_hardware_has_same_keys_and_timing() {
    let folder = Folder::new("keys");
    let scenario = folder.file("bench.toml", STAND);
    let [run, _] = run_on_twin(&folder, &scenario, &folder.join("bus"), &["--json"]);
    let report = run.report();
    let lockstep = twin(&[
        "run",
        &scenario,
        "--json",
        "--out",
        &folder.join("lockstep"),
    ]);
    let lockstep = &crate::common::json(&lockstep.out)[0];
    let keys = |report: &Value| {
        let keys = report.as_object().unwrap().keys();
        keys.cloned().collect::<Vec<_>>()
    };
    assert_eq!(keys(&report), keys(lockstep));
    assert!(lockstep["real_time"].is_null());
    for key in ["plant", "energy", "work"] {
        assert!(report[key].is_null() && !lockstep[key].is_null(), "{key}");
    }
    assert_eq!(report["simulated_s"], 1.0);

    let times = &report["real_time"];
    let count = |key: &str| times[key].as_u64().unwrap();
    // 1 s in steps of 2 ms, and both ends.
    assert_eq!(
        count("iterations") + count("overruns") + count("overslept"),
        501,
        "{times}"
    );
    assert_eq!(count("lost"), 0);
    // Privileges depend on the machine; missing ones are reported with the remedy.
    for note in times["notes"].as_array().unwrap() {
        assert!(note.as_str().unwrap().contains("raise the limit"), "{note}");
    }
    assert!(times["opening_s"].as_f64().unwrap() > 0.25, "{times}");
    for histogram in ["lateness", "jitter", "computing"] {
        assert!(times[histogram]["count"].as_u64().unwrap() > 0, "{times}");
        assert!(
            times[histogram]["longest_s"].as_f64() >= times[histogram]["mean_s"].as_f64(),
            "{times}"
        );
    }
    let [task] = &times["tasks"].as_array().unwrap()[..] else {
        panic!("{times}");
    };
    assert_eq!(task["name"], "sbcp");
    let transfers = task["took"]["count"].as_u64().unwrap();
    assert_eq!(
        transfers + task["skipped"].as_u64().unwrap(),
        count("iterations")
    );
}

/// A stop of the program counts as an interval of the control cycle, in the report and in the
/// expectation.
#[test]
fn jitter_of_report_and_expectation_is_equal() {
    let folder = Folder::new("jitter");
    let jitter = "[[expect]]\ntiming = { of = \"control\", jitter = { max = \"1 us\" } }";
    let scenario = STAND.replace("duration = \"1 s\"", "duration = \"2 s\"") + jitter;
    let scenario = folder.file("bench.toml", &scenario);
    let (link, recording) = (folder.join("bus"), folder.join("out/bench-seed1.mcap"));
    let run = with_retries(|| {
        let _ = std::fs::remove_file(&recording);
        let mut served = Running::serve(&folder, &scenario, &link, &[]);
        let mut run = Running::run(&folder, &scenario, &link, &["--json"]);
        wait_until("it is recorded", || {
            is_longer(&recording, WELL_RECORDED) || run.has_ended()
        });
        run.signal("-STOP");
        sleep(Duration::from_millis(100));
        run.signal("-CONT");
        let run = run.end().in_time("")?;
        served.end();
        Ok(run)
    });
    let report = run.report();
    let reported = report["real_time"]["jitter"]["longest_s"].as_f64().unwrap();
    let expectation = lines(&report).next().unwrap();
    assert!(reported > 0.05, "{report}");
    assert_eq!(expectation["unit"], "s");
    assert!(
        (expectation["measured"].as_f64().unwrap() - reported).abs() < 1e-9,
        "{report}"
    );
}

/// Footsteps, trunk and energy balance of the scene are not observed on hardware; what the drivers
/// count and measure is.
#[test]
fn walking_robot_runs_on_two_ports_without_plant() {
    let folder = Folder::new("trot");
    let trot = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../../scenarios/oncilla-trot.toml"
    );
    let text = std::fs::read_to_string(trot).unwrap();
    let text = text
        .replace("gains = ", "error_threshold = -1\ngains = ")
        .replace("duration = \"20 s\"", "duration = \"1 s\"")
        .replace("after = \"5 s\"", "after = \"0.1 s\"");
    let scenario = folder.file("trot.toml", &text);
    let [sbcp, rb110] = ["sbcp", "rb110"].map(|bus| format!("{bus}={}", folder.join(bus)));
    let out = folder.join("out");
    let run = with_retries(|| {
        let link = folder.join("sbcp");
        let mut served = Running::serve(&folder, &scenario, &link, &["--pty", &rb110]);
        let words = [
            "run", &scenario, "--port", &sbcp, "--port", &rb110, "--json", "--out", &out,
        ];
        let run = Running::twin(&folder, "run", &words).end();
        let run = run.in_time("")?;
        assert_eq!(served.end().code, Some(0));
        Ok(run)
    });
    assert_eq!(run.code, Some(1), "{run:?}");
    let report = run.report();
    assert_eq!(report["error"], json!(null));
    let observable = [
        "no transfer fails",
        "no cycle is missed",
        "hips within encoder range",
        "knees within encoder range",
        "the hip of LF follows its command within 50 ms",
    ];
    for line in lines(&report) {
        let observable = observable.contains(&line["name"].as_str().unwrap());
        let observed = line["verdict"] != "unobserved" || bus_was_late(line);
        assert_eq!(observed, observable, "{line}");
    }
    let tasks = report["real_time"]["tasks"].as_array().unwrap();
    let tasks: Vec<&Value> = tasks.iter().map(|task| &task["name"]).collect();
    assert_eq!(tasks, ["sbcp", "rb110"]);
}
