//! End-to-end tests of studies of gaits on short runs.

use crate::common::{Done, Folder, json, twin};

fn scenario(name: &str) -> String {
    format!("{}/../../scenarios/{name}", env!("CARGO_MANIFEST_DIR"))
}

fn study(kind: &str, words: &[&str], folder: &Folder) -> Done {
    let out = folder.join("out");
    let begin = ["study", kind, "--out", &out];
    twin(&[&begin[..], words].concat())
}

#[test]
fn no_change_moves_no_footstep_and_a_change_is_in_text_page_and_data() {
    let folder = Folder::new("study-modulation");
    let file = scenario("step-change.toml");
    let small = ["--points", "2", "--steps", "3", "--after", "3 s"];
    let words = [&[&*file, "--by=0 mm,-20 mm", "--json"][..], &small].concat();
    let mut printed = [(); 2].map(|()| {
        let done = study("modulation", &words, &folder);
        assert_eq!((done.code, done.err.as_str()), (0, ""), "{}", done.out);
        let mut printed = json(&done.out).remove(0);
        // Its load differs.
        printed.as_object_mut().unwrap().remove("machine");
        printed
    });
    assert_eq!(printed[0], printed[1]);
    let found = printed[0].take();
    let case = &found["cases"][0];
    assert_eq!((&case["runs"], &case["fell"]), (&4.into(), &0.into()));
    // Duty factors of 0.509 and 0.505.
    let by_duty = case["ideal"]["by_duty"].as_f64().unwrap();
    assert!((by_duty - 2.0 / (0.509 + 0.505)).abs() < 1e-12);
    for table in case["tables"].as_array().unwrap() {
        for cell in table["cells"].as_array().unwrap() {
            let mean = cell["mean_m"].as_f64().unwrap();
            if cell["by"] == 0.0 {
                assert_eq!(
                    (mean, &cell["range_m"]),
                    (0.0, &serde_json::json!([0.0, 0.0]))
                );
            }
        }
    }
    let by_cycle = case["tables"][0]["cells"].as_array().unwrap();
    let changed = by_cycle.iter().filter(|cell| cell["by"] == -0.02);
    assert!(changed.clone().count() == 3);
    assert!(
        changed
            .clone()
            .all(|cell| cell["mean_m"].as_f64().unwrap() < -0.005)
    );
    for ending in ["html", "csv", "json"] {
        let path = folder.join(&format!("out/modulation-step-change.{ending}"));
        assert!(std::path::Path::new(&path).exists(), "{path}");
    }
}

#[test]
fn factors_are_compared_and_unsuitable_requests_have_a_remedy() {
    let folder = Folder::new("study-modulation-factors");
    let file = scenario("step-change.toml");
    let small = [
        "--points",
        "1",
        "--steps",
        "1",
        "--after",
        "2 s",
        "--by=-20 mm",
    ];
    let done = study(
        "modulation",
        &[&[&*file, "--factors"][..], &small].concat(),
        &folder,
    );
    assert_eq!((done.code, done.err.as_str()), (0, ""));
    for expected in [
        "as given: ",
        "unsaturated servos: ",
        "by geometry",
        "of 1 by cycle",
    ] {
        assert!(
            done.out.contains(expected),
            "no {expected} in\n{}",
            done.out
        );
    }
    // Without feedback it is the same controller.
    assert!(!done.out.contains("no feedback"));
    let bench = scenario("bench.toml");
    for (words, why, help) in [
        (
            &[&*file, "--variable", "lenght"][..],
            "no variable `lenght`",
            "twin list",
        ),
        (&[&*file, "--by=-5 s"], "--by -5 s", "--by="),
        (
            &[&*file, "--variable", "frequency"],
            "`frequency` is not",
            "--by",
        ),
        (
            &[&*file, "--after", "2 s", "--steps", "200"],
            "footsteps of leg",
            "--steps",
        ),
        (&[&*bench], "touch no ground", "whole robot"),
    ] {
        let done = study("modulation", words, &folder);
        assert_eq!(
            (done.code, done.out.as_str()),
            (2, ""),
            "{why}: {}",
            done.err
        );
        assert!(
            done.err.contains(why) && done.err.contains(help),
            "{}",
            done.err
        );
    }
}
