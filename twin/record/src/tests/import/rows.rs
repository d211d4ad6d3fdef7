//! Random rows, written as JSON and as CSV.

use std::fmt::Write as _;
use std::io::Write as _;

use flate2::Compression;
use flate2::write::GzEncoder;
use proptest::prelude::*;
use serde_json::{Map, Value, json};
use twinrig_kernel::SimTime;

use super::{import, mapping, recorded, series};

const MAPPING: &str = r#"
time = { column = "t", unit = "s", origin = "keep" }
[[signal]]
name = "a"
column = "a"
unit = "rad"
[[signal]]
name = "b"
column = "b"
scale = 0.5
offset = 1
unit = "mm"
group = "commanded"
"#;

/// Times \[ns\], and values of two columns.
fn rows() -> impl Strategy<Value = Vec<(u64, f64, f64)>> {
    let number = prop_oneof![
        any::<f64>().prop_filter("finite", |number| number.is_finite()),
        -10.0..10.0,
        Just(-0.0),
    ];
    let row = (1_u64..5_000_000_000, number, -1e6..1e6);
    prop::collection::vec(row, 1..40).prop_map(|mut rows| {
        let mut time = 0;
        for row in &mut rows {
            time += row.0;
            row.0 = time;
        }
        rows
    })
}

fn object(&(time, a, b): &(u64, f64, f64)) -> Value {
    let time = time as f64 / 1e9;
    json!({ "x": [1, {"t": "no"}], "t": time, "a": a, "text": "ü\n\"", "b": b })
}

fn compressed(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = GzEncoder::new(Vec::new(), Compression::fast());
    encoder.write_all(bytes).unwrap();
    encoder.finish().unwrap()
}

/// The same rows in each format: file name, text, and a key of the mapping.
fn written(rows: &[(u64, f64, f64)]) -> Vec<(&'static str, Vec<u8>, &'static str)> {
    let list: Vec<Value> = rows.iter().map(object).collect();
    let mut top = Map::new();
    top.insert("rate".to_owned(), json!(12));
    top.insert(
        "data".to_owned(),
        json!({ "before": [[]], "rows": list, "after": {} }),
    );
    let top = Value::from(top);
    let lines = list.iter().map(|row| format!("{row}\n"));
    let mut csv = "# first line\r\na;t;\"text\";b\r\n".to_owned();
    for (time, a, b) in rows {
        let time = *time as f64 / 1e9;
        writeln!(csv, "{a:e} ; {time};\"x;\"\"y\"\"\nz\";{b}\r").unwrap();
    }
    let pretty = serde_json::to_vec_pretty(&top).unwrap();
    vec![
        ("log.json", json!(list).to_string().into_bytes(), ""),
        ("log.jsonl", lines.collect::<String>().into_bytes(), ""),
        ("log.json.gz", compressed(&pretty), "rows = \"data.rows\"\n"),
        ("log.json", pretty, "rows = \"data.rows\"\n"),
        ("log.csv", csv.clone().into_bytes(), ""),
        ("log.csv.gz", compressed(csv.as_bytes()), ""),
    ]
}

proptest! {
    #[test]
    fn every_format_yields_the_same_numbers(rows in rows()) {
        let bits = |values: &[f64]| values.iter().map(|value| value.to_bits()).collect::<Vec<_>>();
        let times: Vec<u64> = rows.iter().map(|row| row.0).collect();
        let a: Vec<f64> = rows.iter().map(|row| row.1).collect();
        let b: Vec<f64> = rows.iter().map(|row| (row.2 * 0.5 + 1.0) / 1000.0).collect();
        let mut fingerprints = Vec::new();
        for (file, text, key) in written(&rows) {
            let log = import(file, &text, &mapping(&format!("{key}{MAPPING}")));
            let recording = recorded(&log.unwrap_or_else(|error| panic!("{file}: {error}")));
            let (found_times, found) = series(&recording, "a");
            prop_assert_eq!(&found_times, &times, "{}", file);
            prop_assert_eq!(bits(&found), bits(&a), "{}", file);
            let (found_times, found) = series(&recording, "b");
            prop_assert_eq!(&found_times, &times, "{}", file);
            prop_assert_eq!(bits(&found), bits(&b), "{}", file);
            prop_assert_eq!(recording.reached().map(SimTime::as_nanos), times.last().copied());
            fingerprints.push(recording.fingerprint().unwrap().to_owned());
        }
        fingerprints.dedup();
        prop_assert_eq!(fingerprints.len(), 1);
    }

    #[test]
    fn garbage_is_an_error_or_a_log(
        start in prop::sample::select(vec!["", "[", "[{\"t\":1,", "t,a,b\n", "{\"data\":{\"rows\":["]),
        garbage in prop::collection::vec(any::<u8>(), 0..200),
        text in "[\\[\\]{}\",:\\\\tabu0-9eE.+ \n;#-]{0,80}",
        is_text in any::<bool>(),
    ) {
        let rest = if is_text { text.into_bytes() } else { garbage };
        let log = [start.as_bytes(), &rest].concat();
        for file in ["log.json", "log.csv", "log.json.gz"] {
            for key in ["", "rows = \"data.rows\"\n"] {
                if let Ok(log) = import(file, &log, &mapping(&format!("{key}{MAPPING}"))) {
                    recorded(&log);
                }
            }
        }
    }

    /// A log that is cut off is an error, or has the rows before.
    #[test]
    fn truncated_logs_are_no_complete_logs(rows in rows(), cut in any::<prop::sample::Index>()) {
        for (file, text, key) in written(&rows) {
            let end = cut.index(text.len());
            let result = import(file, &text[..end], &mapping(&format!("{key}{MAPPING}")));
            match result {
                Err(error) => prop_assert!(!error.fault.to_string().is_empty()),
                // Lines of JSON and of CSV may end anywhere between rows, CSV within a number.
                Ok(log) => {
                    prop_assert!(["log.jsonl", "log.csv"].contains(&file) || end + 2 > text.len());
                    prop_assert!(log.rows <= rows.len() as u64);
                }
            }
        }
    }
}

#[test]
fn json_is_accepted_exactly_where_a_peer_accepts_it() {
    let mut runner = proptest::test_runner::TestRunner::default();
    let token = prop::sample::select(vec![
        "{",
        "}",
        "[",
        "]",
        ",",
        ":",
        "\"t\"",
        "\"\\u00e4\"",
        "\"\\ud83d\\ude00\"",
        "\"\\ud83d\"",
        "1",
        "-0",
        "01",
        "1.",
        ".5",
        "1e5",
        "1E+05",
        "-",
        "true",
        "nul",
        "null",
        " ",
        "\n",
        "\"\t\"",
        "\"",
        "\\",
        "+1",
        "1e",
        "é",
    ]);
    let texts = prop::collection::vec(token, 0..10);
    let mapping = mapping(
        "rows = \"no\"\n[time]\ncolumn = \"t\"\n[[signal]]\nname = 'a'\ncolumn = 'a'\nunit = '1'",
    );
    let checked = runner.run(&texts, |tokens| {
        let text = format!("{{\"x\":{}}}", tokens.concat());
        let error = import("log.json", text.as_bytes(), &mapping).unwrap_err();
        let accepted = matches!(*error.fault, twinrig_record::LogFault::NoList { .. });
        let peer = serde_json::from_str::<Value>(&text);
        prop_assert!(accepted == peer.is_ok(), "{text}: {error} {peer:?}");
        Ok(())
    });
    checked.unwrap();
}
