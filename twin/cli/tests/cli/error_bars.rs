//! Numerical errors of measured values: `twin run --error-bars`.

use std::fs;

use serde_json::{Value, json};

use crate::common::{Folder, json as objects, twin};

/// A passive leg on a fixed trunk swings down.
fn scenario(limit: f64) -> String {
    format!(
        r#"
duration = "0.1 s"
robot = "cheetah-cub"
plant = {{ model = "lcp", base = "fixed", legs = ["LF"], start = {{ q1 = "30 deg" }} }}
actuator = {{ kind = "none" }}

[[expect]]
name = "hip"
signal = {{ name = "leg/LF/hip/position", always = {{ min = "{limit} rad" }} }}
"#
    )
}

#[test]
fn undecided_verdict_fails_the_command_and_no_verdict() {
    let folder = Folder::new("error-bars");
    let (path, junit) = (folder.join("leg.toml"), folder.join("junit.xml"));
    let run = |limit: f64, options: &[&str]| {
        fs::write(&path, scenario(limit)).unwrap();
        twin(&[&["run", &path, "--no-record"], options].concat())
    };
    let report = |limit: f64| {
        let done = run(limit, &["--error-bars", "--json"]);
        (objects(&done.out).remove(0), done.code)
    };
    let (far, code) = report(-10.0);
    let line = &far["expectations"][0];
    assert_eq!((code, &line["decided"]), (0, &json!(true)));
    assert_eq!(line["error_by"], "refinement");
    let of = |key: &str| line[key].as_f64().unwrap();
    assert!(of("error") > 0.0 && of("error") < 1e-3, "{line}");

    let near = of("measured") - 2.0 * of("error");
    let (report, code) = report(near);
    assert_eq!((code, &report["verdict"]), (1, &json!("pass")));
    assert_eq!(report["expectations"][0]["verdict"], "pass");
    assert_eq!(report["expectations"][0]["decided"], false);
    let done = run(near, &["--error-bars", "--junit", &junit]);
    for part in [
        " ± ",
        "undecided",
        "1 undecided within their numerical error",
    ] {
        assert!(done.out.contains(part), "{part}: {}", done.out);
    }
    let document = fs::read_to_string(&junit).unwrap();
    assert!(document.contains("type=\"undecided\""), "{document}");
    assert!(document.contains("--error-bars"), "{document}");

    // Without the option nothing is new.
    let plain = run(near, &["--json"]);
    let plain = objects(&plain.out).remove(0);
    assert_eq!(plain["fingerprint"], report["fingerprint"]);
    for key in ["error", "error_by", "decided"] {
        assert_eq!(plain["expectations"][0].get(key), None::<&Value>, "{key}");
    }
}

#[test]
fn error_bars_are_refused_where_there_is_no_finer_run() {
    let folder = Folder::new("error-bars-refused");
    let path = folder.file("leg.toml", &scenario(-10.0));
    let plants = ["--plant", "lcp", "--plant", "massless"];
    let done = twin(&[&["run", &path, "--error-bars"], &plants[..]].concat());
    assert_eq!(done.code, 2);
    assert!(
        done.err.contains("error bars are those of one plant"),
        "{}",
        done.err
    );
    let done = twin(&["run", &path, "--error-bars", "--port", "sbcp=/dev/null"]);
    assert_eq!(done.code, 2);
}
