use twinrig::runtime::interrupt::Token;

use super::{SEEDS, STAND, Sweep, built};
use crate::common::{SOUND, panicking, registry};

fn with_share(share: &str) -> String {
    format!("{SEEDS}[[share]]\n{share}\n")
}

#[test]
fn shares_decide_verdict_and_exit_code() {
    // Twelve of twelve: from 75.7 % on.
    for (share, code, verdict) in [
        ("of = 'stands'\nmin = '75 %'", 0, "pass"),
        ("of = 'stands'\nmin = '76 %'", 1, "undecided"),
        (
            "of = 'stands'\nmin = '76 %'\nconfidence = '90 %'",
            0,
            "pass",
        ),
        ("of = 'verdict'\nmax = '75 %'", 1, "fail"),
    ] {
        let sweep = Sweep::new("shares", STAND, &with_share(share));
        let result = sweep.json(code, "out", &[]);
        assert_eq!(result["verdict"], verdict, "{share}");
        assert_eq!(result["shares"][0]["held"], 12);
        let low = result["shares"][0]["low"].as_f64().unwrap();
        assert!((0.75..0.82).contains(&low), "{low}");
    }
}

/// Twelve of twelve do not show 76 %: known before the runs, which do not take place here.
#[test]
fn share_that_cannot_pass_is_noted_before_the_runs() {
    let note = "the share of `stands` cannot pass with 12 points";
    for (bound, noted) in [("min = '76 %'", true), ("min = '75 %'", false)] {
        let sweep = Sweep::new(
            "noted",
            STAND,
            &with_share(&format!("of = 'stands'\n{bound}")),
        );
        let token = Token::new();
        token.request();
        let done = token.scope(|| sweep.run("out", &["--json"]));
        assert_eq!(
            done.err.matches(note).count(),
            usize::from(noted),
            "{}",
            done.err
        );
        let warning = crate::common::json(&done.out)[0]["warning"].clone();
        let text = warning.as_str().unwrap_or_default();
        assert_eq!(text.contains(note), noted, "{text}");
    }
}

#[test]
fn without_a_share_every_run_has_to_pass() {
    let spec = "[[dimension]]\nkey = 'duration'\nvalues = ['65 ms', '100 ms']\n";
    let sweep = Sweep::new("runs", STAND, spec);
    // The second expectation has too few samples in the first run.
    let done = sweep.run("out", &["--junit", &sweep.folder.join("junit.xml")]);
    assert_eq!(done.code, 1, "{done:?}");
    assert!(done.out.contains("FAIL  1 of 2 runs pass"), "{}", done.out);
    let junit = std::fs::read_to_string(sweep.folder.join("junit.xml")).unwrap();
    assert!(
        junit.contains("tests=\"2\" failures=\"1\" errors=\"0\""),
        "{junit}"
    );
    assert!(
        junit.contains("name=\"stand@duration-65ms\" time=\"0.000\"><failure message="),
        "{junit}"
    );
    assert!(
        junit.contains("name=\"stand@duration-100ms\" time=\"0.000\"/>"),
        "{junit}"
    );
}

/// A run that fails is not a failure where its share is judged.
#[test]
fn junit_judges_shares_where_there_are_any() {
    let spec = "[[dimension]]\nkey = 'duration'\nvalues = ['65 ms', '100 ms']\n\
                [[share]]\nof = 'stands'\nmin = 0.2\n[[share]]\nof = 'verdict'\nmin = 0.5\n";
    let sweep = Sweep::new("junit", STAND, spec);
    let path = sweep.folder.join("junit.xml");
    sweep.json(1, "out", &["--junit", &path]);
    let junit = std::fs::read_to_string(path).unwrap();
    for part in [
        "<testsuite name=\"spec: shares\" tests=\"2\" failures=\"1\"",
        "name=\"stands\" time=\"0.000\"/>",
        "name=\"verdict\" time=\"0.000\"><failure message=\"undecided: 1 of 2 held, ",
        "<testsuite name=\"spec\" tests=\"2\" failures=\"0\" errors=\"0\" skipped=\"1\" ",
        "name=\"stand@duration-65ms\" time=\"0.000\"><skipped",
    ] {
        assert!(junit.contains(part), "{part}\n{junit}");
    }
}

/// A share is judged once all points are done, and an interrupted sweep is an error.
#[test]
fn junit_of_an_incomplete_sweep_has_no_failed_share() {
    let sweep = Sweep::new("part", STAND, &with_share("of = 'stands'\nmin = '75 %'"));
    let path = sweep.folder.join("junit.xml");
    let read = || std::fs::read_to_string(&path).unwrap();
    sweep.json(0, "out", &["--junit", &path, "--partition", "1/3"]);
    let junit = read();
    for part in [
        "tests=\"1\" failures=\"0\" errors=\"0\" skipped=\"1\"",
        "name=\"stands\" time=\"0.000\"><skipped message=\"8 points are missing: 4 of 4 held",
        "<testsuite name=\"spec\" tests=\"4\" failures=\"0\" errors=\"0\"",
    ] {
        assert!(junit.contains(part), "{part}\n{junit}");
    }
    let token = Token::new();
    token.request();
    token.scope(|| sweep.json(2, "out", &["--junit", &path]));
    let junit = read();
    for part in [
        "<testsuite name=\"spec\" tests=\"5\" failures=\"0\" errors=\"1\"",
        "<error message=\"interrupted; 8 points are missing",
    ] {
        assert!(junit.contains(part), "{part}\n{junit}");
    }
}

/// As in the verdict of a run: an optional expectation without an observation holds. The second one
/// of a name has a number.
#[test]
fn shares_and_reasons_agree_with_the_verdicts_of_runs() {
    let scenario = format!(
        "{STAND}optional = true\n[[expect]]\nname = 'stands'\nbody = {{ height = {{ min = '9 m' }} }}\n"
    );
    let spec = "[[dimension]]\nkey = 'duration'\nvalues = ['65 ms']\n\
                [[share]]\nof = 'still stands'\nmin = 0.01\n[[share]]\nof = 'stands (2)'\nmax = 0.99\n";
    let sweep = Sweep::new("optional", &scenario, spec);
    let path = sweep.folder.join("junit.xml");
    let result = sweep.json(0, "out", &["--junit", &path]);
    assert_eq!(result["shares"][0]["held"], 1);
    assert_eq!(result["shares"][1]["held"], 0);
    let junit = std::fs::read_to_string(path).unwrap();
    assert!(
        junit.contains("<skipped message=\"stands (2); twin run"),
        "{junit}"
    );
    let page = &sweep.files("out")[2];
    assert!(page.contains("<span class=\"why\">stands (2)</span>"));
    let csv = &sweep.files("out")[0];
    assert!(csv.contains("stands: margin [m],") && csv.contains("stands (2): margin [m],"));
}

#[test]
fn runs_with_errors_are_rows_and_count_as_not_held() {
    let spec = "[[dimension]]\nkey = 'plant.model'\n\
                values = ['toy', 'panicking', 'unbuildable', 'snapping']\n\
                [[share]]\nof = 'speed'\nmin = 0.01\n";
    let sweep = Sweep::new("errors", SOUND, spec);
    let registry = panicking().with_build(twinrig::BuildKey::of_bytes(b"one"));
    let done = sweep.run_of(&registry, "out", &["--json"]);
    assert_eq!(done.code, 2, "{done:?}");
    let result = &crate::common::json(&done.out)[0];
    assert_eq!(result["verdict"], "error");
    assert_eq!(result["counts"]["error"], 3);
    assert_eq!(result["shares"][0]["held"], 1);
    assert_eq!(result["shares"][0]["runs"], 4);
    let errors = ["", "out of cheese", "no blueprint", "it snapped"];
    for (row, expected) in result["rows"].as_array().unwrap().iter().zip(errors) {
        let error = row["error"].as_str().unwrap_or_default();
        assert!(error.contains(expected), "{error}");
        assert_eq!(error.is_empty(), expected.is_empty(), "{error}");
    }
    let page = &sweep.files("out")[2];
    assert!(page.contains("out of cheese") && page.contains("--no-record"));
}

/// Equal runs are no independent draws.
#[test]
fn seed_without_effect_is_noted() {
    let sweep = Sweep::new("equal", SOUND, SEEDS);
    let done = sweep.run_of(&built("one"), "out", &[]);
    assert_eq!(done.code, 0, "{done:?}");
    let note = "`seed` has no effect";
    assert!(done.err.contains(note), "{}", done.err);
    assert!(sweep.files("out")[2].contains(note));
    // Nor in a grid with a dimension that has one.
    let spec = format!("{SEEDS}[[dimension]]\nkey = 'duration'\nvalues = ['0.5 s', '1 s']\n");
    let sweep = Sweep::new("equal-grid", SOUND, &spec);
    let done = sweep.run_of(&built("one"), "out", &[]);
    assert!(done.err.contains(note), "{}", done.err);
    let sweep = Sweep::new("different", STAND, SEEDS);
    assert_eq!(sweep.run("out", &[]).err, "");
}

/// The registry of a host program hashes the running program by default.
#[test]
fn build_is_the_hash_of_the_program() {
    let sweep = Sweep::new(
        "build",
        SOUND,
        "[[dimension]]\nkey = 'seed'\nvalues = [1]\n",
    );
    let done = sweep.run_of(&registry(), "out", &["--json"]);
    let build = &crate::common::json(&done.out)[0]["build"];
    let program = std::fs::read(std::env::current_exe().unwrap()).unwrap();
    let expected = twinrig::BuildKey::of_bytes(&program).to_string();
    assert_eq!(build.as_str(), Some(&*expected));
}
