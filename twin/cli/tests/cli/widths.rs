//! Output in narrow and wide terminals, in pipes, with and without colours.

use std::fmt::Write as _;
use std::process::Command;

use anstream::adapter::strip_str;
use unicode_width::UnicodeWidthStr;

use crate::common::Folder;

/// Columns of the terminals; none: a pipe.
const WIDTHS: [Option<usize>; 5] = [Some(40), Some(60), Some(80), Some(200), None];
/// Those whose output is kept, also with colours.
const KEPT: [Option<usize>; 2] = [Some(60), None];

/// Scenario of half a second with a short and a long remark.
const PASSES: &str = r#"
name = "trot of half a second"
robot = "cheetah-cub"
duration = "500 ms"
plant = { model = "massless", ground = { friction = 0.6 } }
actuator = { lag = "5 ms", speed = "20 rad/s", torque = "5 N·m" }

[controller]
kind = "cpg"
gait = "trot"
period = "2 ms"
frequency = "3 Hz"
step_length = "10 cm"
hip_height = "125 mm"
mid_stance_offset = "1 cm"

[[expect]]
name = "does not fall"
body = { height = { min = "57 mm" } }

[[expect]]
name = "forward speed, mean of the whole run"
body = { speed = { near = "0.3 m/s", within = "200 %" } }

[[expect]]
name = "no fall"
body = { fall = false }
"#;

/// Expectations that fail, and one that has nothing to judge.
const FAILS: &str = r#"
[[expect]]
name = "faster than it is"
body = { speed = { min = "5 m/s" } }

[[expect]]
name = "lower than it is"
body = { height = { max = "10 mm" } }

[[expect]]
name = "diagonal legs step together in every stride"
footstep = { phase = "trot", tolerance = 0.001 }
after = "450 ms"
"#;

const SWEEP: &str = r#"
name = "two stiff and two soft springs of a very long name"
points = 4
seed = 3
design = "random"

[[dimension]]
key = "controller.frequency"
from = "2.5 Hz"
to = "3.5 Hz"

[[share]]
of = "forward speed, mean of the whole run"
min = "20 %"

[[share]]
of = "no fall"
min = "99 %"
"#;

/// Commands with the names of their snapshots.
const COMMANDS: &[(&str, &[&str])] = &[
    ("run_pass", &["run", "passes.toml"]),
    ("run_fail", &["run", "fails.toml", "--no-record"]),
    ("plan", &["plan", "passes.toml"]),
    (
        "check",
        &["check", "passes.toml", "mistaken.toml", "fails.toml"],
    ),
    ("run_mistake", &["run", "mistaken.toml", "--set", "seed=2"]),
    ("list", &["list"]),
    ("list_robot", &["list", "cheetah-cub"]),
    (
        "diff",
        &[
            "diff",
            "recordings/passes-seed1.mcap",
            "recordings/other-seed1.mcap",
        ],
    ),
    (
        "diff_events",
        &[
            "diff",
            "--events",
            "recordings/passes-seed1.mcap",
            "recordings/other-seed1.mcap",
        ],
    ),
    (
        "sweep",
        &[
            "sweep",
            "passes.toml",
            "sweep.toml",
            "--out",
            "sweeps",
            "--jobs",
            "1",
        ],
    ),
    ("thesis", &["thesis", "--list"]),
    ("cell_fit", &["cell", "fit"]),
    ("examples", &["examples"]),
    ("help", &["--help"]),
    ("help_run", &["run", "--help"]),
    ("misspelt", &["run", "passes.toml", "--no-recording"]),
];

/// Commands whose output depends on the features of the build, or on many files: it is not kept.
const NOT_KEPT: [&str; 4] = ["list", "list_robot", "examples", "thesis"];

/// Standard output and standard error of the program.
fn output(folder: &str, words: &[&str], columns: Option<usize>, colour: &str) -> String {
    let mut command = Command::new(env!("CARGO_BIN_EXE_twin"));
    command
        .current_dir(folder)
        .args(words)
        .arg(format!("--color={colour}"));
    command
        .env_remove("COLUMNS")
        .env_remove("NO_COLOR")
        .env_remove("CLICOLOR_FORCE");
    if let Some(columns) = columns {
        command.env("COLUMNS", columns.to_string());
    }
    let output = command.output().unwrap();
    let text = [output.stdout, output.stderr].concat();
    redacted(&String::from_utf8(text).unwrap())
}

/// Leaves out the fact `time`, which differs from run to run, and the digits of fingerprints.
fn redacted(text: &str) -> String {
    let mut out = String::new();
    let mut is_time = false;
    for line in text.split_inclusive('\n') {
        let plain = strip_str(line).to_string();
        let is_fact = plain.starts_with("  ") && !plain.starts_with("   ");
        is_time =
            plain.starts_with("  time  ") || (is_time && !is_fact && !plain.trim().is_empty());
        if is_time {
            continue;
        }
        for word in line.split_inclusive([' ', '\n']) {
            let is_hash =
                word.trim().len() == 64 && word.trim().bytes().all(|b| b.is_ascii_hexdigit());
            out.push_str(if is_hash { "HASH…" } else { word });
            out.push_str(if is_hash && word.ends_with('\n') {
                "\n"
            } else {
                ""
            });
        }
    }
    out
}

/// Whether the words of a line cannot be broken: those of excerpts and places, and one long word.
fn is_whole(line: &str) -> bool {
    let line = line.trim_start_matches(|c: char| c == ' ' || c.is_ascii_digit());
    line.starts_with("--> ") || line.starts_with('|') || line.split_whitespace().count() == 1
}

fn folder(test: &str) -> (Folder, String) {
    let folder = Folder::new(test);
    folder.file("passes.toml", PASSES);
    folder.file("fails.toml", &format!("{PASSES}{FAILS}"));
    folder.file("other.toml", &PASSES.replace("3 Hz", "3.1 Hz"));
    let mistaken = PASSES
        .replace("frequency =", "frequncy = ")
        .replace("10 cm", "10 Hz");
    let long = "stepping with a length that no leg has";
    folder.file(
        "mistaken.toml",
        &mistaken.replace("\"10 Hz\"", &format!("\"10 Hz\" # {long}")),
    );
    folder.file("sweep.toml", SWEEP);
    let path = folder.join("");
    (folder, path)
}

#[test]
fn output_fits_the_terminal_with_and_without_colours() {
    let (_folder, path) = folder("widths");
    output(&path, &["run", "passes.toml", "other.toml"], None, "never");
    let sweep = COMMANDS.iter().find(|(name, _)| *name == "sweep").unwrap();
    output(&path, sweep.1, None, "never");
    for (name, words) in COMMANDS {
        let mut shown = String::new();
        for columns in WIDTHS {
            let plain = output(&path, words, columns, "never");
            assert!(!plain.contains('\u{1b}'), "{plain}");
            let most = columns.unwrap_or(usize::MAX);
            for line in plain.lines() {
                assert!(
                    line.width() <= most || is_whole(line),
                    "{name} {columns:?}: {line}"
                );
            }
            if !KEPT.contains(&columns) {
                continue;
            }
            let coloured = output(&path, words, columns, "always");
            let without = strip_str(&coloured).to_string();
            assert_eq!(without, plain, "{name} {columns:?}");
            let title = columns.map_or("piped".to_owned(), |columns| format!("{columns} columns"));
            let _ = writeln!(shown, "=== {title}\n{plain}");
            if *name == "run_fail" && columns == Some(60) {
                insta::assert_snapshot!("widths_coloured", coloured.replace('\u{1b}', "ESC"));
            }
        }
        if !NOT_KEPT.contains(name) {
            insta::assert_snapshot!(format!("widths_{name}"), shown);
        }
    }
}

#[test]
fn control_characters_of_names_are_escaped() {
    let (folder, path) = folder("escapes");
    let bad = "\\u001b[31m\\r\\u0000\\u202e";
    let text = format!("{PASSES}{FAILS}").replace("name = \"", &format!("name = \"{bad}"));
    folder.file("bad.toml", &text);
    let sweep = SWEEP.replace("of = \"", &format!("of = \"{bad}"));
    folder.file(
        "bad-sweep.toml",
        &sweep.replace("name = \"", &format!("name = \"{bad}")),
    );
    let strange = "a\u{1b}[31m\r.toml";
    folder.file(strange, &text);
    for words in [
        &["run", "bad.toml", strange][..],
        &["run", "bad.toml", "--plant", "massless", "--plant", "lcp"],
        &["plan", strange],
        &["check", "bad.toml", strange, "missing\u{1b}[31m.toml"],
        &["check", "passes.toml", "--set", "plant.\u{1b}[31mmodel=2"],
        &["list", "no\u{1b}[31mrobot"],
        &["replay", "recordings/bad-seed1.mcap"],
        &[
            "diff",
            "recordings/bad-seed1.mcap",
            "recordings/a\u{1b}[31m\r-seed1.mcap",
        ],
        &["sweep", "bad.toml", "bad-sweep.toml", "--out", "sweeps"],
        &[
            "study",
            "precision",
            strange,
            "--plant",
            "massless",
            "--budget",
            "0.05",
        ],
    ] {
        let shown = output(&path, words, Some(60), "never");
        assert!(!shown.is_empty(), "{words:?}");
        for line in shown.lines() {
            assert!(line.width() <= 60 || is_whole(line), "{words:?}: {line}");
        }
        let raw = shown
            .chars()
            .find(|c| (c.is_control() && *c != '\n') || *c == '\u{202e}');
        assert_eq!(raw, None, "{words:?}: {shown:?}");
        let is_named = shown.contains("\\u{1b}") || words[0] == "diff";
        assert!(is_named, "{words:?}: {shown}");
        // Excerpts of files show the picture of the character.
        let rest = shown.replace("\\u{1b}[31m", "").replace("␛[31m", "");
        assert!(!rest.contains("[31m"), "{words:?}: {shown}");
    }
}
