//! Faults of timing on buses: each is in the report, fails a strict run, and leaves no expectation
//! about timing that it concerns with a pass.

use serde_json::Value;

use crate::common::{json, twin};

/// Expectations about timing, by what they are of.
const ROWS: [(&str, &str); 8] = [
    (
        "control",
        "{ name = 'control', timing = { of = 'control', deadline_misses = { max = 0 } } }",
    ),
    (
        "control",
        "{ name = 'jitter', timing = { of = 'control', jitter = { max = '0 us' } } }",
    ),
    (
        "sbcp",
        "{ name = 'sbcp', timing = { of = 'sbcp', deadline_misses = { max = 0 } } }",
    ),
    (
        "sbcp",
        "{ name = 'latency', timing = { of = 'sbcp', latency = { max = '2 ms' } } }",
    ),
    (
        "sbcp",
        "{ name = 'rate', timing = { of = 'sbcp', cycle_rate = { min = '495 Hz' } } }",
    ),
    (
        "rb110",
        "{ name = 'rb110', timing = { of = 'rb110', deadline_misses = { max = 0 } } }",
    ),
    (
        "rb110",
        "{ name = 'pulses', timing = { of = 'rb110', latency = { max = '20 ms' } } }",
    ),
    (
        "rb110",
        "{ name = 'answers', signal = { name = 'rb110/transfers', always = { min = 0 } } }",
    ),
];

/// Runs a scenario for some time with settings, and these expectations; strict.
fn run(file: &str, until: &str, settings: &[&str], rows: &[&str]) -> (u8, Value) {
    run_with(&["--strict"], file, until, settings, rows)
}

fn run_with(
    options: &[&str],
    file: &str,
    until: &str,
    settings: &[&str],
    rows: &[&str],
) -> (u8, Value) {
    let path = format!("{}/../../scenarios/{file}", env!("CARGO_MANIFEST_DIR"));
    let expect = format!("expect=[{}]", rows.join(", "));
    let mut words = vec!["run", &path, "--no-record", "--json"];
    words.extend(options);
    words.extend(["--until", until, "--set", &expect]);
    for setting in settings {
        words.extend(["--set", setting]);
    }
    let done = twin(&words);
    let report = json(&done.out).remove(0);
    (done.code, report)
}

const UNLIMITED: &str = "bus.sbcp.error_threshold=-1";

fn oncilla(settings: &[&str]) -> (u8, Value) {
    let rows = ROWS.map(|(_, row)| row);
    run(
        "oncilla-trot.toml",
        "6 s",
        &[settings, &[UNLIMITED]].concat(),
        &rows,
    )
}

fn bus<'v>(report: &'v Value, name: &str) -> &'v Value {
    let buses = report["buses"].as_array().unwrap();
    let found = buses.iter().find(|bus| bus["name"] == name);
    found.unwrap_or_else(|| panic!("no bus {name}: {report}"))
}

#[test]
fn healthy_buses_are_clean_and_pass_strictly() {
    let (_, report) = oncilla(&[]);
    // Its feet are commanded out of reach.
    let reasons = report["strict"].as_array().unwrap();
    let of_gait = |reason: &Value| reason.as_str().unwrap().contains("out of reach");
    assert!(reasons.iter().all(of_gait), "{report}");
    for (name, least) in [("sbcp", 2_000), ("rb110", 30)] {
        let bus = bus(&report, name);
        assert_eq!(
            (&bus["clean"], &bus["skipped"]),
            (&true.into(), &0.into()),
            "{bus}"
        );
        assert!(bus["packets"].as_u64().unwrap() > least, "{bus}");
        assert!(bus["answers"].as_u64().unwrap() > least, "{bus}");
    }
}

#[test]
fn no_expectation_about_timing_passes_under_a_fault_of_timing() {
    let unplugged = |place: &str| {
        format!("fault=[{{ at = '0.6 s', on = '{place}', kind = 'unplug', for = '9 s' }}]")
    };
    let late =
        "fault=[{ at = '0.6 s', on = 'wire/sbcp', kind = 'delay', by = '3 ms', for = '9 s' }]";
    for (bus_name, fault, what) in [
        ("sbcp", unplugged("wire/sbcp/RH"), "dead: board RH"),
        (
            "rb110",
            unplugged("wire/rb110"),
            "dead: servo board of rb110",
        ),
        ("sbcp", late.to_owned(), " × "),
        (
            "sbcp",
            "bus.sbcp.clock={ RH = '2 %' }".to_owned(),
            "missed points",
        ),
        (
            "sbcp",
            "bus.sbcp.clock={ RH = '-2 %' }".to_owned(),
            "slow clock",
        ),
        (
            "sbcp",
            "bus.sbcp.usb.latency_timer='16 ms'".to_owned(),
            "busy",
        ),
    ] {
        let (code, report) = oncilla(&[&fault]);
        assert_eq!(
            (code, &report["verdict"]),
            (1, &"fail".into()),
            "{fault}: {report}"
        );
        assert_eq!(bus(&report, bus_name)["clean"], false, "{fault}: {report}");
        let reasons = report["strict"].to_string();
        assert!(reasons.contains(what), "{fault}: {reasons}");
        let others = ["sbcp", "rb110"]
            .into_iter()
            .filter(|name| *name != bus_name);
        for other in others {
            assert_eq!(bus(&report, other)["clean"], true, "{fault}: {report}");
        }
        let lines = report["expectations"].as_array().unwrap();
        for ((of, _), line) in ROWS.iter().zip(lines) {
            let concerned = *of == bus_name || *of == "control";
            let passes = line["verdict"] == "pass";
            assert_eq!(passes, !concerned, "{fault}: {line}");
        }
        // Where all that is expected holds, the fault alone fails the run, if it is strict.
        let balance = ["{ name = 'balance', energy = { residual = { max = 0.01 } } }"];
        for (options, code, verdict) in [(&["--strict"][..], 1, "fail"), (&[], 0, "pass")] {
            let settings = [&fault, UNLIMITED];
            let (found, report) =
                run_with(options, "oncilla-trot.toml", "6 s", &settings, &balance);
            let found = (
                found,
                &report["verdict"],
                &report["expectations"][0]["verdict"],
            );
            assert_eq!(
                found,
                (code, &verdict.into(), &"pass".into()),
                "{fault}: {report}"
            );
        }
    }
}

/// Behind Oncilla's bus controller, boards that are late are all silent to it.
#[test]
fn bus_that_is_given_up_is_in_the_report() {
    let late =
        "fault=[{ at = '0.6 s', on = 'wire/sbcp', kind = 'delay', by = '3 ms', for = '9 s' }]";
    let rows = ROWS.map(|(_, row)| row);
    let (code, report) = run("oncilla-trot.toml", "6 s", &[late], &rows);
    assert_eq!(code, 2, "{report}");
    assert!(
        !bus(&report, "sbcp")["errors"]
            .as_array()
            .unwrap()
            .is_empty(),
        "{report}"
    );
}

/// A modelled transfer does not excuse itself by its own duration.
#[test]
fn transfers_longer_than_the_period_are_missed_cycles() {
    let rows = [ROWS[0].1];
    let (code, report) = run("trot.toml", "2 s", &["io.transfer_time='3 ms'"], &rows);
    assert_eq!(code, 1, "{report}");
    let line = &report["expectations"][0];
    assert_eq!(line["verdict"], "fail", "{line}");
    assert!(line["measured"].as_f64().unwrap() > 50.0, "{line}");
    assert!(report["strict"].to_string().contains("busy"), "{report}");
    let (code, report) = run("trot.toml", "2 s", &[], &rows);
    assert_eq!(
        (code, &report["buses"]),
        (0, &serde_json::json!([])),
        "{report}"
    );
}
