//! Runs that end before the end of their scenario, and scenarios from standard input.

use std::io::Write as _;
use std::process::{Command, Stdio};

use twinrig_record::Recording;

use crate::common::{Done, Folder, json, twin};

/// Parts before 1 s.
const EARLY: &str = r#"
robot = "cheetah-cub"
plant = { model = "massless", ground = {} }
controller = { kind = "cpg", gait = "trot", period = "2 ms" }
[[push]]
on = "body"
at = "0.4 s"
for = "50 ms"
force = "2 N"
direction = "y"
[[change]]
at = "0.3 s"
set = "frequency"
by = "0.1 Hz"
[[expect]]
name = "stays up"
body = { fall = false }
[[expect]]
name = "is high"
before = "1 s"
body = { height = { min = "5 cm" } }
"#;

/// Parts from 1 s on, and expectations that need more than 1 s.
const LATE: &str = r#"
[[push]]
name = "late"
on = "body"
at = "1 s"
for = "50 ms"
force = "2 N"
direction = "y"
[[change]]
at = "1.2 s"
set = "frequency"
by = "0.1 Hz"
every = "0.1 s"
times = 3
[[surface]]
friction = 0.2
at = "1.5 s"
[[expect]]
name = "begins late"
after = "1 s"
body = { fall = false }
[[expect]]
name = "ends late"
before = "1.1 s"
body = { fall = false }
[[expect]]
name = "settles late"
body = { settles = { within = "1 m", by = "1 s" } }
[[expect]]
name = "happens late"
after = "0.5 s"
signal = { name = "body/position", component = "x", eventually = { min = "-1 m" }, within = "0.6 s" }
[[expect]]
name = "recovers late"
body = { recovers = { after = "late", within = "0.2 s", height = "5 cm" } }
"#;

#[test]
fn run_until_equals_run_of_file_without_later_parts() {
    let folder = Folder::new("until");
    let whole = format!("duration = \"2 s\"\n{EARLY}{LATE}");
    let whole = folder.file("whole.toml", &whole);
    let short = folder.file("short.toml", &format!("duration = \"1 s\"\n{EARLY}"));
    let report = |done: Done| {
        assert_eq!((done.code, done.err.as_str()), (0, ""), "{}", done.out);
        json(&done.out).remove(0)
    };
    let out = folder.join("out");
    let until = ["run", &whole, "--until", "1 s", "--json", "--out", &out];
    let ended = report(twin(&until));
    let short = report(twin(&["run", &short, "--json", "--no-record"]));
    assert_eq!(ended["fingerprint"], short["fingerprint"]);
    assert_eq!(ended["simulated_s"], 1.0);
    let names = |report: &serde_json::Value| {
        let lines = report["expectations"].as_array().unwrap().iter();
        lines.map(|it| it["name"].clone()).collect::<Vec<_>>()
    };
    assert_eq!(names(&ended), ["stays up", "is high"]);
    let left_out = ended["left_out"].as_array().unwrap().iter();
    let beyond = left_out.filter(|it| it["why"] == "`until` ends the run at 1 s");
    let beyond: Vec<_> = beyond.map(|it| it["part"].as_str().unwrap()).collect();
    assert_eq!(
        beyond,
        [
            "run from 1 s to 2 s",
            "changes of frequency from 1200 ms",
            "push `late` at 1 s",
            "friction 0.2 from 1500 ms",
            "expectation that begins late",
            "expectation that ends late",
            "expectation that settles late",
            "expectation that happens late",
            "expectation that recovers late",
        ]
    );
    let recording = ended["recording"].as_str().unwrap();
    let replayed = report(twin(&["replay", recording, "--json"]));
    assert_eq!(replayed["fingerprint"], ended["fingerprint"]);
}

#[test]
fn run_until_end_or_later_is_the_whole_run() {
    let folder = Folder::new("until-end");
    let file = format!("duration = \"1 s\"\n{EARLY}");
    let file = folder.file("short.toml", &file);
    let fingerprint = |more: &[&str]| {
        let done = twin(&[&["run", &file, "--no-record", "--json"], more].concat());
        let report = json(&done.out).remove(0);
        assert!(
            !report["left_out"].to_string().contains("until"),
            "{report}"
        );
        report["fingerprint"].clone()
    };
    let whole = fingerprint(&[]);
    assert_eq!(fingerprint(&["--until", "1 s"]), whole);
    assert_eq!(fingerprint(&["--until", "5 s"]), whole);
    let beyond = twin(&["run", &file, "--no-record", "--until", "5 s"]);
    assert!(
        beyond.err.contains("the run ends before, at 1 s"),
        "{}",
        beyond.err
    );
}

#[test]
fn short_options_are_settings() {
    let folder = Folder::new("short-options");
    let file = folder.file("run.toml", &format!("duration = \"2 s\"\n{EARLY}"));
    let of = |words: &[&str]| {
        let done = twin(&[&["run", &file, "--no-record", "--json"], words].concat());
        let report = json(&done.out).remove(0);
        (
            report["fingerprint"].clone(),
            report["seed"].clone(),
            report["simulated_s"].clone(),
        )
    };
    let short = of(&["--seed", "7", "--duration", "1.5 s"]);
    assert_eq!(short, of(&["--set", "seed=7", "--set", "duration=1.5 s"]));
    assert_eq!((short.1, short.2), (7.into(), 1.5.into()));
    let wrong = twin(&["run", &file, "--seed", "seven"]);
    assert!(
        wrong.code == 2 && wrong.err.contains("--> --seed:1"),
        "{}",
        wrong.err
    );
    for budget in ["30", "30 s", "0.5 min"] {
        let words = [
            "study",
            "stability",
            &file,
            "--budget",
            budget,
            "--plant",
            "none",
        ];
        let done = twin(&words);
        assert!(
            done.code == 2 && !done.err.contains("--budget"),
            "{}",
            done.err
        );
    }
    let wrong = twin(&["study", "stability", &file, "--budget", "30 m"]);
    assert!(
        wrong.code == 2 && wrong.err.contains("--budget"),
        "{}",
        wrong.err
    );
}

#[test]
fn run_until_before_every_expectation_is_a_warning() {
    let folder = Folder::new("until-nothing");
    let late = "[[expect]]\nafter = \"0.5 s\"\nbody = { fall = false }\n";
    let (head, _) = EARLY.split_once("[[expect]]").unwrap();
    let file = folder.file("late.toml", &format!("duration = \"1 s\"\n{head}{late}"));
    let done = twin(&["run", &file, "--until", "0.5 s", "--no-record"]);
    assert!(
        done.err.contains("every expectation is judged later"),
        "{}",
        done.err
    );
    let strict = twin(&["check", &file, "--set", "until=0.5 s", "--strict"]);
    assert_eq!(strict.code, 2, "{strict:?}");
}

/// Executes the program with `input` on standard input.
fn with_input(words: &[&str], input: &str) -> Done {
    let mut child = Command::new(env!("CARGO_BIN_EXE_twin"))
        .args(words)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    child
        .stdin
        .take()
        .unwrap()
        .write_all(input.as_bytes())
        .unwrap();
    let output = child.wait_with_output().unwrap();
    Done {
        code: output.status.code().unwrap().try_into().unwrap(),
        out: String::from_utf8(output.stdout).unwrap(),
        err: String::from_utf8(output.stderr).unwrap(),
    }
}

#[test]
fn dash_is_the_scenario_of_standard_input() {
    let folder = Folder::new("stdin");
    let text = format!("duration = \"1 s\"\nuntil = \"0.1 s\"\n{EARLY}");
    let file = folder.file("short.toml", &text);
    let of_file = twin(&["run", &file, "--no-record", "--json"]);
    let out = folder.join("out");
    let plants = ["--plant", "massless", "--plant", "lcp"];
    let words = [&["run", "-", "--json", "--out", &out], &plants[..]].concat();
    let reports = json(&with_input(&words, &text).out);
    assert_eq!(
        reports[0]["fingerprint"],
        json(&of_file.out)[0]["fingerprint"]
    );
    assert!(reports[0]["fingerprint"].is_string());
    assert_eq!(reports[1]["plant"], "lcp", "it is read once and run twice");
    let recording = reports[0]["recording"].as_str().unwrap();
    assert!(Recording::open(recording.as_ref()).unwrap().is_complete());
    assert_eq!(with_input(&["check", "-"], &text).code, 0);
    assert_eq!(with_input(&["plan", "-"], &text).code, 0);
    let wrong = with_input(&["check", "-"], &text.replace("cpg", "cgp"));
    assert_eq!(wrong.code, 2);
    assert!(
        wrong.err.contains(" --> <standard input>:6:23"),
        "{}",
        wrong.err
    );
}

/// The first scenario never ends, the second is not reached.
#[test]
fn budget_ends_run_with_verdict_and_complete_recording() {
    let folder = Folder::new("budget");
    let file = folder.file(
        "endless.toml",
        &format!("duration = \"1000000 s\"\n{EARLY}"),
    );
    let (out, junit) = (folder.join("out"), folder.join("junit.xml"));
    let words = [
        "run", &file, &file, "--json", "--budget", "300 ms", "--out", &out,
    ];
    let done = with_input(&[&words[..], &["--junit", &junit]].concat(), "");
    assert_eq!(done.code, 2, "{done:?}");
    let reports = json(&done.out);
    let error = |n: usize| reports[n]["error"].as_str().unwrap();
    assert!(error(0).starts_with("interrupted at "), "{}", error(0));
    assert!(
        error(0).ends_with(": the budget of 0.3 s is used up"),
        "{}",
        error(0)
    );
    assert!(error(1).starts_with("not run, "), "{}", error(1));
    let recording = reports[0]["recording"].as_str().unwrap();
    assert!(Recording::open(recording.as_ref()).unwrap().is_complete());
    let replayed = twin(&["replay", recording, "--json"]);
    assert_eq!(
        json(&replayed.out)[0]["cut_off_s"],
        reports[0]["simulated_s"]
    );
    assert!(
        std::fs::read_to_string(&junit)
            .unwrap()
            .contains("not run, ")
    );
    let unhurried = twin(&[
        "run",
        &file,
        "--until",
        "100 ms",
        "--budget",
        "1000 s",
        "--no-record",
    ]);
    assert_eq!(unhurried.code, 0, "{unhurried:?}");
}

#[test]
fn misspelt_command_has_a_suggestion() {
    for (word, command) in [("rnu", "run"), ("lsit", "list"), ("chek", "check")] {
        let done = twin(&[word]);
        assert_eq!(done.code, 2);
        let tip = format!("a similar subcommand exists: '{command}'");
        assert!(done.err.contains(&tip), "{}", done.err);
    }
    assert!(!twin(&["xyzzy"]).err.contains("similar"));
}
