//! Malformed logs and mappings: each fault with its place and its remedy.

use twinrig_document::Document;
use twinrig_record::{LogFault, LogMapping};

use super::{import, mapping, recorded, series};

const MAPPING: &str = r#"
time = { column = "t" }
[[signal]]
name = "angle"
column = "a"
unit = "deg"
"#;

/// Checks the error of a log: all parts are in its text.
fn fails(mapping_text: &str, file: &str, log: &str, parts: &[&str]) {
    let error = import(file, log.as_bytes(), &mapping(mapping_text));
    let text = error.map_or_else(|error| error.to_string(), |_| String::new());
    for part in parts {
        assert!(text.contains(part), "`{part}` is not in\n{text}");
    }
}

#[test]
fn faults_of_json_have_place_and_remedy() {
    let cases: &[(&str, &[&str])] = &[
        ("[", &["truncated", "middle of a list", "log.json:1\n"]),
        (
            "[{\"t\": 1, \"a\": 2},\n{\"t\": 2, \"a",
            &["middle of a text", "log.json:2 (row 2)"],
        ),
        ("[{\"t\": 1, \"a\": 1.", &["middle of a number"]),
        ("[]", &["the log has no rows", "`rows`"]),
        ("", &["truncated"]),
        ("[1]", &["`row` is 1", "(row 1)"]),
        (
            "[{\"t\": 1, \"angel\": 2}]",
            &[
                "no column `a`",
                "log.json:1 (row 1)",
                "columns of the log: t, angel",
                "optional",
            ],
        ),
        (
            "[{\"time\": 1, \"a\": 2}]",
            &["no column `t`", "columns of the log: time, a"],
        ),
        (
            "[{\"t\": 1, \"a\": 2},\n{\"t\": 2}]",
            &[
                "`a` has no value",
                "log.json:2 (row 2)",
                "missing = \"hold\"",
            ],
        ),
        (
            "[{\"t\": 1, \"a\": null}]",
            &["`a` has no value", "(row 1)"],
        ),
        (
            "[{\"t\": 1, \"a\": NaN}]",
            &["`a` is NaN, which is not a finite", "hold"],
        ),
        (
            "[{\"t\": 1, \"a\": -Infinity}]",
            &["`a` is -inf", "never imported"],
        ),
        (
            "[{\"t\": 1, \"a\": \"2\"}]",
            &["`a` is the text `2`; expected a number"],
        ),
        (
            "[{\"t\": 1, \"a\": [2]}]",
            &["`a` is a list; expected a number"],
        ),
        (
            "[{\"t\": \"1\", \"a\": 2}]",
            &["`t` is the text `1`; expected a time"],
        ),
        ("[{\"t\": NaN, \"a\": 2}]", &["`t` is NaN; expected a time"]),
        (
            "[{\"t\": 1e300, \"a\": 2}]",
            &["the time `1e300` is out of range", "`unit`"],
        ),
        ("[{\"t\": -1, \"a\": 2}]", &[]),
        (
            "[{\"t\": 3.5, \"a\": 2},\n\n{\"t\": 3.25,\n \"a\": 2}]",
            &[
                "time goes back by 0.25 s, from 3.5 s to 3.25 s",
                "log.json:3 (row 2)",
                "clock",
            ],
        ),
        (
            "[{\"t\": 3.5, \"a\": 2},\n{\"t\": 3.5, \"a\": 2}]",
            &[
                "two rows have the time 3.5 s",
                "log.json:2 (row 2)",
                "too coarse",
            ],
        ),
        ("[{\"t\": 1, \"a\": 2}] x", &["text after the end"]),
        (
            "[{\"t\": 1, 'a': 2}]",
            &["there is `'`; expected a key in quotes"],
        ),
        (
            "[{\"t\": 1 \"a\": 2}]",
            &["there is `\"`; expected `,` or `}`"],
        ),
        ("[{\"t\": 1, \"a\": nan}]", &["`nan` is not a value"]),
    ];
    for (log, parts) in cases {
        fails(MAPPING, "log.json", log, parts);
    }
    fails(
        &format!("rows = \"entires\"\n{MAPPING}"),
        "log.json",
        "{\"entries\": []}",
        &["no list `entires`", "did you mean `entries`?"],
    );
}

#[test]
fn faults_of_csv_have_place_and_remedy() {
    let cases: &[(&str, &[&str])] = &[
        ("", &["the log has no rows"]),
        ("t,a\n", &["the log has no rows"]),
        ("t,b\n1,2\n", &["no column `a`", "columns of the log: t, b"]),
        ("t,a,a\n1,2,3\n", &["two columns `a`"]),
        (
            "t,a\n1,2\n2\n",
            &[
                "1 fields, and the header 2",
                "log.csv:3 (row 2)",
                "double quotes",
            ],
        ),
        ("t,a\n1,2,3\n", &["3 fields, and the header 2"]),
        ("t;a\n1;2,5\n", &["`a` is the text `2,5`", "decimal point"]),
        ("t,a\n1,\n", &["`a` has no value", "log.csv:2 (row 1)"]),
        ("t,a\n1,inf\n", &["`a` is inf"]),
        ("t,a\n1,\"2\n", &["middle of a field in quotes"]),
        ("t,a\n1,\"2\"3\n", &["text behind a field in quotes"]),
    ];
    for (log, parts) in cases {
        fails(MAPPING, "log.csv", log, parts);
    }
}

#[test]
fn format_follows_from_the_name_or_the_mapping() {
    let csv = b"t,a\n1,180\n";
    for file in ["log.csv", "LOG.CSV", "a.b.csv.gz", "log.tsv"] {
        assert!(import(file, csv, &mapping(MAPPING)).is_ok(), "{file}");
    }
    let log = import(
        "log.txt",
        csv,
        &mapping(&format!("format = \"csv\"\n{MAPPING}")),
    )
    .unwrap();
    assert_eq!(log.groups[0].signals[0].values, [std::f64::consts::PI]);
    fails(
        MAPPING,
        "log.txt",
        "",
        &["format of the log is not known", ".jsonl"],
    );
    fails(MAPPING, "log.db3", "", &["SQLite", "ros2 bag convert"]);
    fails(
        MAPPING,
        "log.mcap",
        "",
        &["the mapping has columns, and the log is mcap"],
    );
}

#[test]
fn missing_values_are_held_where_the_mapping_says_so() {
    let text = format!("{MAPPING}missing = \"hold\"\n");
    let csv = b"t,a\n1,\n2,90\n3,nan\n4,null\n5,180\n";
    let log = import("log.csv", csv, &mapping(&text)).unwrap();
    let (times, values) = series(&recorded(&log), "angle");
    assert_eq!(times, [2, 3, 4, 5].map(|second| 1_000_000_000 * second));
    let degree = std::f64::consts::PI / 180.0;
    assert_eq!(
        values,
        [90.0, 90.0, 90.0, 180.0].map(|degrees| degrees * degree)
    );
    assert_eq!((log.rows, log.left_out), (5, 1));
    assert_eq!(recorded(&log).note("log.held.a"), Some("2"));
    assert_eq!(recorded(&log).note("log.left_out"), Some("1"));
    fails(
        &text,
        "log.csv",
        "t,a\n1,\n",
        &["no row has a value", "`a` never has one"],
    );
    fails(&text, "log.csv", "t,b\n1,2\n", &["no column `a`"]);
}

#[test]
fn optional_signal_is_left_out_of_logs_without_it() {
    let text = format!("{MAPPING}\n[[signal]]\nname='b'\ncolumn='b'\nunit='1'\noptional=true");
    let log = import("log.csv", b"t,a\n1,2\n", &mapping(&text)).unwrap();
    assert_eq!(
        (log.groups[0].signals.len(), log.absent.as_slice()),
        (1, &["b".to_owned()][..])
    );
    let log = import("log.csv", b"t,a,b\n1,2,true\n", &mapping(&text)).unwrap();
    assert_eq!(log.groups[0].signals[1].values, [1.0]);
    // A column that begins later is not dropped in silence.
    let late = "[{\"t\": 1, \"a\": 2}, {\"t\": 2, \"a\": 2, \"b\": 1}]";
    fails(&text, "log.json", late, &["`b` has no value"]);
}

#[test]
fn absolute_times_are_shifted_by_a_noted_origin() {
    let csv = b"t,a\n1705312345.25,1\n1705312345.250000001,2\n";
    let log = import("log.csv", csv, &mapping(MAPPING)).unwrap();
    let recording = recorded(&log);
    assert_eq!(series(&recording, "angle").0, [250_000_000, 250_000_001]);
    assert_eq!(recording.note("log.origin"), Some("1705312345 s"));
    for (unit, log) in [
        ("ns", "1705312345250000000"),
        ("ms", "1705312345250"),
        ("us", "1705312345250000.0"),
    ] {
        let text = MAPPING.replace("\"t\"", &format!("\"t\", unit = \"{unit}\""));
        let log = import(
            "log.csv",
            format!("t,a\n{log},1\n").as_bytes(),
            &mapping(&text),
        )
        .unwrap();
        assert_eq!(
            (log.origin_ns, log.span()[0].as_nanos()),
            (1_705_312_345_000_000_000, 250_000_000)
        );
    }
    let keep = MAPPING.replace("\"t\"", "\"t\", origin = \"keep\"");
    let log = import("log.csv", b"t,a\n1000000,1\n", &mapping(&keep)).unwrap();
    assert_eq!(log.span()[0].as_nanos(), 1_000_000_000_000_000);
    fails(
        &keep,
        "log.csv",
        "t,a\n-1,1\n",
        &["the time `-1 s` is out of range"],
    );
    let first = MAPPING.replace("\"t\"", "\"t\", origin = \"first\"");
    let log = import("log.csv", b"t,a\n-0.75,1\n", &mapping(&first)).unwrap();
    assert_eq!(
        (log.origin_ns, log.span()[0].as_nanos()),
        (-1_000_000_000, 250_000_000)
    );
}

#[test]
fn gaps_are_counted_and_listed() {
    let text = format!("gap = \"100 ms\"\n{MAPPING}");
    let csv = b"t,a\n0,1\n0.1,1\n0.3,1\n0.35,1\n";
    let log = import("log.csv", csv, &mapping(&text)).unwrap();
    let recording = recorded(&log);
    assert_eq!(recording.note("log.gaps.measured"), Some("1"));
    let listed = r#"[{"start_ns":100000000,"length_ns":200000000}]"#;
    assert_eq!(recording.note("log.gap_list.measured"), Some(listed));
}

#[test]
fn settings_are_constants_in_toml() {
    let text = format!(
        "{MAPPING}
[[setting]]
key = \"load.mass\"
column = \"mass\"
unit = \"g\"
[[setting]]
key = \"servo.gain\"
column = \"servo.kp\"
[[setting]]
key = \"servo.name\"
column = \"name\"
[[setting]]
key = \"servo.on\"
column = \"on\"
optional = true
[[note]]
name = \"bench\"
text = \"second\"
"
    );
    let note = |log: &str, file: &str, rows: &str, key: &str| {
        let log = import(file, log.as_bytes(), &mapping(&format!("{rows}{text}")));
        let log = log.unwrap_or_else(|error| panic!("{error}"));
        recorded(&log).note(key).map(str::to_owned)
    };
    let json = r#"{"mass": 490, "r": [{"t": 1, "a": 1}], "servo": {"kp": 8.0}, "name": "x \"1\""}"#;
    let of_json = |key| note(json, "log.json", "rows = \"r\"\n", key).unwrap_or_default();
    assert_eq!(of_json("setting.load.mass"), "\"0.49 kg\"");
    assert_eq!(of_json("setting.servo.gain"), "8");
    assert_eq!(of_json("setting.servo.name"), "\"x \\\"1\\\"\"");
    assert_eq!(
        (of_json("setting.servo.on"), of_json("note.bench")),
        (String::new(), "second".to_owned())
    );
    let csv = "t,a,mass,servo.kp,name,on\n1,1,0.5,8,y,true\n2,1,0.5,8,y,true\n";
    assert_eq!(
        note(csv, "log.csv", "", "setting.load.mass").unwrap(),
        "\"0.0005 kg\""
    );
    assert_eq!(
        note(csv, "log.csv", "", "setting.servo.on").unwrap(),
        "true"
    );
    fails(
        &text,
        "log.csv",
        &csv.replace("2,1,0.5", "2,1,0.6"),
        &[
            "`mass` is `0.5` at first, and then `0.6`",
            "log.csv:3 (row 2)",
            "split the log",
        ],
    );
    fails(
        &text,
        "log.csv",
        &csv.replace("0.5", "heavy"),
        &["`mass` is `heavy`"],
    );
    fails(&text, "log.csv", "t,a\n1,1\n", &["no column `mass`"]);
}

#[test]
fn fault_of_a_word_is_typed() {
    let text = format!("{MAPPING}word = \"i16\"\n");
    let error = import("log.csv", b"t,a\n1,65536\n", &mapping(&text)).unwrap_err();
    assert!(
        matches!(*error.fault, LogFault::NotAWord { bits: 16, .. }),
        "{error}"
    );
}

/// Checks the problems of a mapping.
fn refuses(text: &str, parts: &[&str]) {
    let document = Document::parse("mapping.toml", text).unwrap();
    let error = LogMapping::read(&document).unwrap_err().to_string();
    for part in parts {
        assert!(error.contains(part), "`{part}` is not in\n{error}");
    }
}

#[test]
fn mistakes_of_a_mapping_are_shown_at_their_places() {
    let signal = "[[signal]]\nname = 'a'\ncolumn = 'a'\nunit = 'rad'\n";
    let time = "time = { column = 't' }\n";
    refuses("", &["`signal` is missing"]);
    refuses(signal, &["no column of the time", "time = { column"]);
    refuses(&format!("{time}signal = []"), &["there are no signals"]);
    let of = |from: &str, to: &str| format!("{time}{}", signal.replace(from, to));
    refuses(
        &of("column", "colum"),
        &["unknown key `colum`", "did you mean `column`?", ":4:1"],
    );
    refuses(
        &of("'rad'", "'radd'"),
        &["`radd` is not a known unit", "mapping.toml:5:8"],
    );
    refuses(&of("unit", "sign = 2\nunit"), &["`sign` is 2", "1 or -1"]);
    refuses(
        &of("unit", "scale = '1/0'\nunit"),
        &["neither a number nor a ratio"],
    );
    refuses(
        &of("unit", "word = 'u16'\nunit"),
        &["`u16` is not a valid `word`", "`i16`"],
    );
    refuses(
        &of("'a'\nc", "'/a'\nc"),
        &["`/a` is not a path of a signal"],
    );
    refuses(
        &of("column", "topic = '/x'\ncolumn"),
        &["both a column and a topic"],
    );
    refuses(&of("column", "field"), &["`topic` is missing"]);
    refuses(
        &format!("{time}{signal}{signal}"),
        &["two signals `a`", ":7:8"],
    );
    let topic = "[[signal]]\nname = 'b'\ntopic = '/b'\nfield = 'b'\nunit = 'rad'\n";
    refuses(
        &format!("{time}{signal}{topic}"),
        &["signals with a column and others with a topic"],
    );
    refuses(
        &format!("time = {{ column = 't', unit = 'm' }}\n{signal}"),
        &["expected a duration"],
    );
    refuses(
        &format!("time = {{ column = 't', field = 'h' }}\n{signal}"),
        &["both `column`"],
    );
    let setting = "[[setting]]\nkey = 'a b'\ncolumn = 'm'\n";
    refuses(
        &format!("{time}{signal}{setting}"),
        &["`a b` is not a dotted key"],
    );
    let setting = setting.replace(' ', "");
    refuses(
        &format!("{topic}{setting}"),
        &["messages of topics have no constants"],
    );
    refuses(
        &format!("{time}{signal}{setting}{setting}"),
        &["two settings `ab`"],
    );
    let note = "[[note]]\nname = 'n'\n";
    refuses(
        &format!("{time}{signal}{note}"),
        &["`column` is missing in `note`"],
    );
}
