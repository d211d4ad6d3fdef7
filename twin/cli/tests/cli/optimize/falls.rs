use super::{Optimization, SPACE, WALK};

/// A search whose runs end with a fall meets the same points, with the same values and costs, as
/// one whose runs go on; among them points that fall and points that do not.
#[test]
fn runs_that_end_with_a_fall_have_the_costs_of_runs_that_do_not() {
    for (more, objective) in [
        ("", "maximize = 'speed'"),
        ("constraints = 'all'\n", "maximize = 'speed'"),
        // It rates runs that fall.
        ("", "maximize = 'fitness'"),
        // Its window ends before most falls.
        ("constraints = ['stays up']\n", "minimize = 'level'"),
    ] {
        let space = more.to_owned() + &SPACE.replace("maximize = 'speed'", objective);
        let optimization = Optimization::new("falls", WALK, &space);
        let run = |out: &str, end: &str| {
            let result = optimization.run(out, &["--json", "--set", &format!("fall.end={end}")]);
            let result: serde_json::Value = serde_json::from_str(&result.out).unwrap();
            let counts = &result["counts"];
            let fell = counts["fell"].as_u64().unwrap();
            assert!(fell > 3 && fell < 27, "{counts}");
            (result["saved"].as_f64().unwrap(), result["history"].clone())
        };
        let ((saved, ending), (none, continuing)) = (run("end", "true"), run("on", "false"));
        assert_eq!(ending, continuing);
        assert!(saved > 0.05 && none == 0.0, "{saved} {none}");
        let costs = |out: &str| -> Vec<Vec<String>> {
            let text = optimization.read(out, "points.csv");
            let lines = text
                .lines()
                .map(|line| line.split(',').map(str::to_owned).collect());
            // Without simulated time and key, at the end.
            lines
                .map(|cells: Vec<String>| cells[..cells.len() - 2].to_vec())
                .collect()
        };
        assert_eq!(costs("end"), costs("on"));
        // By default they end.
        let result = optimization.json(0, "default", &[]);
        assert_eq!(result["saved"].as_f64().unwrap(), saved);
        assert_eq!(result["history"], ending);
    }
}

/// A scenario that decides itself is obeyed, also by a setting of the search space.
#[test]
fn own_choice_of_the_scenario_is_obeyed() {
    let own = format!("fall = {{ end = false }}\n{WALK}");
    let by_space =
        SPACE
            .replace("[[dimension]]", "[[set]]")
            .replacen("[[set]]", "[[dimension]]", 1);
    assert_ne!(by_space, SPACE);
    for (scenario, space) in [
        (own.as_str(), SPACE.to_owned()),
        (WALK, format!("set = {{ fall.end = false }}\n{SPACE}")),
    ] {
        let optimization = Optimization::new("own-fall", scenario, &space);
        let result = optimization.json(0, "out", &[]);
        assert!(result["counts"]["fell"].as_u64().unwrap() > 0);
        assert_eq!(result["saved"], 0.0);
    }
}

#[test]
fn falls_end_runs_with_other_thresholds_too() {
    let optimization = Optimization::new("thresholds", WALK, SPACE);
    for (out, fall) in [
        ("key", "fall.height=0.4"),
        ("table", "fall={ height = 0.4 }"),
    ] {
        let result = optimization.json(0, out, &["--set", fall]);
        assert!(result["saved"].as_f64().unwrap() > 0.05, "{fall}");
    }
}
