use serde_json::Value;

use super::answers::Elsewhere;
use super::{Optimization, SPACE, WALK, built};

/// Two grounds; on one of them more points fall.
const CASES: &str = "[[case]]\nname = 'firm'\n\
                     [[case]]\nname = 'smooth'\nset = { plant.ground.friction = 0.15 }\n";

/// Columns of a table, by name.
fn columns<const N: usize>(csv: &str, names: [&str; N]) -> Vec<[String; N]> {
    let mut lines = csv.lines().map(|line| line.split(',').collect::<Vec<_>>());
    let heads = lines.next().unwrap();
    let places = names.map(|name| heads.iter().position(|head| *head == name).unwrap());
    let cells = lines.map(|cells| places.map(|place| cells[place].to_owned()));
    cells.collect()
}

/// The points of the first generation are the same, whatever their costs: each has the greater one
/// of the costs that it has in two searches without cases.
#[test]
fn worst_case_of_a_point_counts() {
    let space = format!("constraints = ['level']\n{SPACE}");
    let alone = Optimization::new("alone", WALK, &space);
    let more = ["--particles", "30", "--iterations", "0"];
    let points = |friction: &str| {
        let set = format!("plant.ground.friction={friction}");
        alone.run(friction, &[&more[..], &["--set", &set]].concat());
        columns(&alone.read(friction, "points.csv"), ["cost", "speed [m/s]"])
    };
    let (firm, smooth) = (points("0.6"), points("0.15"));
    let both = Optimization::new("cases", WALK, &(space + CASES));
    let done = both.run("out", &more);
    assert!(done.out.contains("60 runs in"), "{}", done.out);
    let found = columns(
        &both.read("out", "points.csv"),
        ["cost", "speed [m/s]", "case"],
    );
    assert_eq!(found.len(), 30);
    let cost = |text: &str| text.parse::<f64>().unwrap();
    let mut counted = [0, 0];
    for ((firm, smooth), found) in firm.iter().zip(&smooth).zip(&found) {
        let is_smooth = cost(&smooth[0]) > cost(&firm[0]);
        counted[usize::from(is_smooth)] += 1;
        let (worst, name) = if is_smooth {
            (smooth, "smooth")
        } else {
            (firm, "firm")
        };
        assert_eq!(found[..2], worst[..]);
        assert_eq!(found[2], name);
    }
    assert!(counted.iter().all(|&count| count > 2), "{counted:?}");
}

/// Workers have the settings of the cases; known rows are those of a case.
#[test]
fn cases_leave_the_answer_independent_of_engines_and_interruptions() {
    let optimization = Optimization::new("case-answers", WALK, &(SPACE.to_owned() + CASES));
    let best = optimization.json(0, "one", &["--jobs", "1"])["best"].clone();
    optimization.run("parts", &["--iterations", "1", "--jobs", "3"]);
    let more = optimization.run("parts", &[]);
    assert!(more.out.contains("36 runs in"), "{}", more.out);
    let registry = built().with_engine(Elsewhere);
    optimization.run_of(&registry, "elsewhere", &["--engine", "elsewhere"]);
    for other in ["parts", "elsewhere"] {
        assert_eq!(optimization.files(other), optimization.files("one"));
    }
    // The point has the value of its worse case.
    let cases = best["cases"].as_array().unwrap();
    let speeds = cases.iter().map(|case| case["objective"].as_f64().unwrap());
    let least = speeds.min_by(f64::total_cmp);
    assert_eq!(best["objective"].as_f64(), least, "{best}");
    let names: Vec<&Value> = cases.iter().map(|case| &case["name"]).collect();
    assert_eq!(names, ["firm", "smooth"]);
    assert!(!optimization.read("one", "best.toml").contains("0.15"));
    for part in ["  case       objective\n", "  smooth "] {
        assert!(more.out.contains(part), "{}", more.out);
    }
}

/// A search with one case that sets nothing is one without cases.
#[test]
fn case_without_settings_is_the_scenario() {
    let optimization = Optimization::new("no-case", WALK, SPACE);
    let space = format!("{SPACE}[[case]]\nname = 'itself'\n");
    let itself = Optimization::new("itself", WALK, &space);
    for name in ["hash", "history", "saved", "counts", "duration_s"] {
        let results = [&optimization, &itself].map(|it| it.json(0, "out", &[])[name].clone());
        assert_eq!(results[0], results[1], "{name}");
    }
}
