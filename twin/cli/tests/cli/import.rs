//! Robots and logs of other programs, and robots for them.

use std::fs;

use crate::common::{Folder, json, twin};

#[test]
fn exported_robot_is_imported_and_nothing_is_overwritten() {
    let folder = Folder::new("import");
    let model = folder.join("cub.urdf");
    let done = twin(&["export", "urdf", "cheetah-cub", "--out", &model]);
    assert_eq!(
        (done.code, done.out.trim_end()),
        (0, format!("written {model}").as_str())
    );
    assert_eq!(
        twin(&["export", "urdf", "cheetah-cub"]).out,
        fs::read_to_string(&model).unwrap()
    );

    let out = folder.join("robots/cub.toml");
    let words = ["import", "urdf", &model, "--name", "Cub", "--out", &out];
    let done = twin(&words);
    assert_eq!((done.code, done.err.as_str()), (0, ""));
    let said = format!("written {out}: 24 entries from {model}, 21 ASSUMED\n");
    assert!(done.out.starts_with(&said), "{}", done.out);
    let text = fs::read_to_string(&out).unwrap();
    assert!(text.contains("\nname = \"Cub\"\n"), "{text}");
    assert_eq!(
        twin(&["import", "urdf", &model, "--name", "Cub", "--out", "-"]).out,
        text
    );
    // The marks are those that `twin list` shows.
    let listed = twin(&["list", &out]);
    assert!(
        listed.out.contains("1.1 kg") && listed.out.contains(" * follows from"),
        "{}",
        listed.out
    );

    let done = twin(&words);
    assert_eq!(done.code, 2);
    assert!(done.err.contains("cub.toml exists"), "{}", done.err);
    assert_eq!(fs::read_to_string(&out).unwrap(), text);
}

#[test]
fn imported_robot_trots_bit_for_bit_like_the_exported_one() {
    let folder = Folder::new("import-trot");
    let (model, out) = (folder.join("cub.urdf"), folder.join("cub.toml"));
    twin(&["export", "urdf", "cheetah-cub", "--out", &model]);
    twin(&["import", "urdf", &model, "--out", &out]);
    let trot = concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenarios/trot.toml");
    let fingerprint = |robot: &str| {
        let words = [
            "run",
            "--json",
            "--no-record",
            "--until",
            "2 s",
            trot,
            "--set",
        ];
        let done = twin(&[&words[..], &[&format!("robot={robot}")]].concat());
        json(&done.out)[0]["fingerprint"].clone()
    };
    let ours = fingerprint("cheetah-cub");
    assert!(ours.is_string());
    assert_eq!(fingerprint(&out), ours);
    let text = fs::read_to_string(&out).unwrap();
    fs::write(&out, text.replace("l1 = \"44.2 mm\"", "l1 = \"44.3 mm\"")).unwrap();
    assert_ne!(fingerprint(&out), ours);
}

#[test]
fn refused_files_are_named_with_place_and_remedy() {
    let folder = Folder::new("import-refused");
    let refused = |language: &str, file: &str, words: &[&str]| {
        let done = twin(&["import", language, file, "--out", "-"]);
        assert_eq!((done.code, done.out.as_str()), (2, ""));
        for word in words {
            assert!(done.err.contains(word), "`{word}` is not in\n{}", done.err);
        }
    };
    let robot = folder.file("cub.urdf", "<robot name=\"cub\">\n  <link/>\n</robot>\n");
    refused(
        "urdf",
        &robot,
        &["<link> has no `name`", "cub.urdf:2:3", "^^^^^^^"],
    );
    refused("mjcf", &robot, &["cub.urdf:1:1", "twin import urdf FILE"]);
    let absent = folder.join("absent.urdf");
    refused("urdf", &absent, &["cannot read the file", "absent.urdf"]);
    let latin = folder.join("latin.urdf");
    fs::write(&latin, b"<robot name=\"\xfcber\"/>").unwrap();
    refused(
        "urdf",
        &latin,
        &["not UTF-8 from byte 13 on", "save it as UTF-8"],
    );
}

const MAPPING: &str = "\
time = { column = 't', unit = 'ms' }
gap = '20 ms'
[[signal]]
name = 'servo/position'
column = 'angle'
unit = 'deg'
[[signal]]
name = 'servo/command'
column = 'goal'
unit = 'deg'
group = 'commanded'
missing = 'hold'
[[setting]]
key = 'load.mass'
column = 'mass'
unit = 'g'
";

const LOG: &str = "t,angle,goal,mass\n0,0,1,490\n10,90,,490\n40,180,2,490\n";

#[test]
fn imported_log_is_a_recording_with_its_facts() {
    let folder = Folder::new("import-log");
    let mapping = folder.file("servo.toml", MAPPING);
    let log = folder.file("log.csv", LOG);
    let out = folder.join("made/log.mcap");
    let words = ["import", "log", &log, "--mapping", &mapping, "--out", &out];
    let done = twin(&words);
    assert_eq!((done.code, done.err.as_str()), (0, ""));
    for line in [
        &format!("written {out}: {log}"),
        "  rows      3",
        "  time      0 s to 0.04 s",
        "  interval  p1 10 ms, p50 10 ms, p99 10 ms, longest 30 ms",
        "  gaps      1: 30 ms after 0.01 s",
        "  repeated  goal in 1 of 3 rows",
        "  settings  load.mass = \"0.49 kg\"",
        "  servo/position  measured           0    3.14159  rad",
    ] {
        assert!(
            done.out.lines().any(|found| found == line),
            "{line}\n{}",
            done.out
        );
    }
    let recording = twinrig_record::Recording::open(out.as_ref()).unwrap();
    let series = recording.series("servo/position").unwrap();
    assert_eq!(series.values, [0.0, 90.0, 180.0].map(f64::to_radians));
    assert_eq!(recording.note("setting.load.mass"), Some("\"0.49 kg\""));
    let same = twin(&["diff", &out, &out]);
    assert_eq!(same.code, 0, "{same:?}");

    let again = twin(&words);
    assert_eq!(again.code, 2);
    assert!(again.err.contains("log.mcap exists"), "{}", again.err);
}

#[test]
fn logs_are_imported_one_by_one_and_failures_are_listed() {
    let folder = Folder::new("import-logs");
    let mapping = folder.file("servo.toml", MAPPING);
    let good = folder.file("good.csv", LOG);
    let bad = folder.file("bad.csv", &LOG.replace("40,", "5,"));
    let out = format!("{}/", folder.join("made"));
    let words = [
        "import",
        "log",
        &bad,
        &good,
        "--mapping",
        &mapping,
        "--out",
        &out,
    ];
    let done = twin(&[&words[..], &["--json"]].concat());
    assert_eq!((done.code, done.err.as_str()), (2, ""));
    let outcomes = &json(&done.out)[0];
    let [failed, written] = [&outcomes[0], &outcomes[1]];
    let error = failed["error"].as_str().unwrap();
    assert!(
        error.contains("bad.csv:4 (row 3)") && error.contains("goes back"),
        "{error}"
    );
    assert_eq!(written["recording"], format!("{out}good.mcap"));
    assert_eq!(written["groups"][0]["periods"]["max_ns"], 30_000_000);
    assert_eq!(written["held"]["goal"], 1);
    assert!(fs::exists(format!("{out}good.mcap")).unwrap());
    assert!(!fs::exists(format!("{out}bad.mcap")).unwrap());
    let one = folder.join("one.mcap");
    let words = [
        "import",
        "log",
        &good,
        &bad,
        "--mapping",
        &mapping,
        "--out",
        &one,
    ];
    let done = twin(&words);
    assert!(
        done.code == 2 && done.err.contains("one file, for several logs"),
        "{done:?}"
    );
}

#[test]
fn mistakes_of_mappings_are_shown_at_their_places() {
    let folder = Folder::new("import-mapping");
    let log = folder.file("log.csv", LOG);
    let of = |mapping: &str| {
        let words = ["import", "log", &log, "--mapping", mapping];
        let done = twin(&words);
        assert_eq!((done.code, done.out.as_str()), (2, ""));
        done.err
    };
    let text = MAPPING
        .replace("unit = 'g'", "unit = 'gram'")
        .replace("gap", "gpa");
    let shown = of(&folder.file("wrong.toml", &text));
    for part in [
        "wrong.toml:2:1",
        "did you mean `gap`?",
        "`gram` is not a known unit",
        "'gram'",
    ] {
        assert!(shown.contains(part), "`{part}` is not in\n{shown}");
    }
    assert!(of("servo-bench-xl300").contains("did you mean `servo-bench-xl330`?"));
    assert!(of(&folder.join("absent.toml")).contains("cannot be read"));
    let shown = twin(&["import", "log", &log]).err;
    assert!(
        shown.contains("known are servo-bench-sts, servo-bench-xl330"),
        "{shown}"
    );
    // The mapping of another log.
    let shown = of("servo-bench-xl330");
    assert!(
        shown.contains("the log has no column `timestamp`"),
        "{shown}"
    );
}
