//! Warnings about accepted values that are probably mistakes, with code and position.

use crate::common::{catalogue, parse, text};
use twinrig_scenario::{Scenario, Setting};

fn warnings(scenario: &Scenario) -> Vec<(&'static str, usize)> {
    let warnings = scenario.warnings.iter();
    let place = |warning: &twinrig_document::Warning| warning.problem.place.clone().unwrap();
    warnings
        .map(|warning| (warning.code, place(warning).line()))
        .collect()
}

/// Returns codes and lines of the warnings of the minimal scenario with `more` appended from line
/// 12.
fn warnings_of(more: &str) -> Vec<(&'static str, usize)> {
    warnings(&parse(&text(more)).unwrap_or_else(|error| panic!("{error}")))
}

#[test]
fn times_beyond_the_end_are_reported() {
    let cases = [
        (
            "[[change]]\nat = '10 s'\nset = 'frequency'\nto = '2 Hz'",
            Some(("change-beyond-end", 13)),
        ),
        (
            "[[change]]\nat = '9.999 s'\nset = 'frequency'\nto = '2 Hz'",
            None,
        ),
        (
            "[[change]]\nat = '9 s'\nset = 'frequency'\nby = '1 Hz'\nevery = '1 s'\ntimes = 2",
            Some(("change-beyond-end", 17)),
        ),
        (
            "[[change]]\nat = '9 s'\nset = 'frequency'\nby = '1 Hz'\nevery = '1 s'",
            None,
        ),
        (
            "[bus]\nkind = 'sbcp'\n[[fault]]\nat = '11 s'\non = 'wire/sbcp'\nkind = 'drop'",
            Some(("fault-beyond-end", 15)),
        ),
        (
            "[[expect]]\nbody = { settles = { within = '1 mm', by = '10 s' } }",
            Some(("by-beyond-end", 13)),
        ),
        (
            "[[expect]]\nsignal = { name = 'x', settles = { within = 1, by = '3 s' } }\nbefore = '2 s'",
            Some(("by-beyond-end", 13)),
        ),
        (
            "[[expect]]\nbody = { settles = { within = '1 mm', by = '9 s' } }",
            None,
        ),
        (
            "[[expect]]\nsignal = { name = 'x', eventually = { min = 1 }, within = '6 s' }\nafter = '5 s'",
            Some(("within-beyond-end", 13)),
        ),
        (
            "[[expect]]\nresponse = { whenever = { name = 'x', min = 1 }, then = { name = 'x', max = 0 }, within = '6 s' }\nafter = '5 s'",
            Some(("within-beyond-end", 13)),
        ),
        (
            "[[expect]]\nprecedence = { whenever = { name = 'x', min = 1 }, before = { name = 'x', max = 0 } }\nafter = '5 s'",
            None,
        ),
        (
            "[[expect]]\nsignal = { name = 'x', eventually = { min = 1 }, within = '5 s' }\nafter = '5 s'",
            None,
        ),
        (
            "[[expect]]\nbody = { gets_up = { within = '4.6 s' } }\nafter = '5 s'",
            Some(("within-beyond-end", 13)),
        ),
        (
            "[[expect]]\nbody = { gets_up = { within = '4.5 s' } }\nafter = '5 s'",
            None,
        ),
        ("[actuator]\nlag = '11 s'", Some(("lag-beyond-run", 13))),
        (
            "[actuator]\nknee = { lag = '11 s' }",
            Some(("lag-beyond-run", 13)),
        ),
        ("[actuator]\nlag = '10 s'", None),
        (
            "[[sensor]]\nof = 'x'\ndelay = { min = '0 s', max = '10 s' }",
            Some(("delay-beyond-run", 14)),
        ),
    ];
    for (more, expected) in cases {
        assert_eq!(warnings_of(more), Vec::from_iter(expected), "{more}");
    }
}

#[test]
fn mean_times_above_the_period_are_reported() {
    for (model, warned) in [
        ("'2001 us'", true),
        ("'2 ms'", false),
        ("{ min = '1 ms', max = '3.1 ms' }", true),
        ("{ min = '0 ms', max = '4 ms' }", false),
        (
            "{ mean = '2.1 ms', deviation = '1 ms', min = '0 ms', max = '9 ms' }",
            true,
        ),
        ("{ trace = ['1 ms', '1 ms', '5 ms'] }", true),
        ("{ trace = ['1 ms', '1 ms', '4 ms'] }", false),
    ] {
        let computing = Vec::from_iter(warned.then_some(("compute-time-above-period", 12)));
        assert_eq!(
            warnings_of(&format!("compute_time = {model}")),
            computing,
            "{model}"
        );
        let transfer = Vec::from_iter(warned.then_some(("transfer-time-above-step", 13)));
        assert_eq!(
            warnings_of(&format!("[io]\ntransfer_time = {model}")),
            transfer,
            "{model}"
        );
    }
}

#[test]
fn long_run_is_reported_at_its_cause() {
    let cases = [
        ("[observe]\nperiod = '1 us'", None),
        ("[observe]\nperiod = '2 ns'", Some(13)),
        // Transfers begin with control steps, independent of the step of the I/O.
        ("[io]\nstep = '1 ns'", None),
    ];
    for (more, line) in cases {
        let line = line.map(|line| ("long-run", line));
        assert_eq!(warnings_of(more), Vec::from_iter(line), "{more}");
    }
    let with = |key: &str, value: &str| {
        let setting = Setting {
            origin: "--set".into(),
            key: key.into(),
            value: value.into(),
        };
        let folder = ".".as_ref();
        let scenario = Scenario::parse("run.toml", &text(""), folder, &[setting], &catalogue());
        scenario.unwrap().warnings
    };
    let step = with("plant.step", "1 ns");
    let text = step[0].to_string();
    assert!(
        text.contains("the run has 1e10 steps of the plant, one every 1 ns"),
        "{text}"
    );
    assert!(
        text.contains("--> --set:1:14") && text.contains("2.8 hours"),
        "{text}"
    );
    // A day of ordinary steps takes minutes; thirty years take days.
    assert_eq!(with("duration", "86400 s"), []);
    let years = with("duration", "1e9 s");
    assert!(years[0].to_string().contains("days"), "{}", years[0]);
}

#[test]
fn step_that_is_divided_is_reported() {
    let of = |observe: &str, settings: &[(&str, &str)]| {
        let setting = |(key, value): &(&str, &str)| Setting {
            origin: "--set".into(),
            key: (*key).into(),
            value: (*value).into(),
        };
        let settings: Vec<Setting> = settings.iter().map(setting).collect();
        let text = text(&format!("[observe]\nperiod = '{observe}'"));
        let scenario = Scenario::parse("run.toml", &text, ".".as_ref(), &settings, &catalogue());
        let warnings = scenario.unwrap().warnings;
        let found = warnings
            .iter()
            .map(|warning| (warning.code, warning.to_string()));
        found.collect::<Vec<_>>()
    };
    assert_eq!(of("2 ms", &[("plant.step", "2 ms")]), []);
    let [(code, message)] = &of("1 ms", &[("plant.step", "2 ms")])[..] else {
        panic!("one warning");
    };
    assert_eq!(*code, "step-above-observation");
    assert!(message.contains("the step of 2 ms is longer than the period of observation, 1 ms"));
    assert!(message.contains("write `step = \"1 ms\"`"), "{message}");
    let grid = ("plant.coupling", "{ grid = \"1 ms\" }");
    let [(_, message)] = &of("2 ms", &[("plant.step", "2 ms"), grid])[..] else {
        panic!("one warning");
    };
    assert!(
        message.contains("the communication grid, 1 ms"),
        "{message}"
    );
    assert_eq!(of("2 ms", &[("plant.step", "1 ms"), grid]), []);
}

#[test]
fn run_with_expectations_of_other_plants_only_is_reported() {
    let of_another = "[[expect]]\nbody = { fall = false }\nplants = ['mujoco']\n";
    assert_eq!(warnings_of(of_another), [("nothing-expected", 5)]);
    let of_both = format!("{of_another}[[expect]]\nbody = {{ fall = false }}");
    assert_eq!(warnings_of(&of_both), []);
    assert_eq!(warnings_of(""), []);
}

#[test]
fn key_set_twice_is_reported_at_the_lost_value() {
    let with = |settings: &[(&str, &str)]| {
        let setting = |(key, value): &(&str, &str)| Setting {
            origin: "--set".into(),
            key: (*key).into(),
            value: (*value).into(),
        };
        let settings: Vec<Setting> = settings.iter().map(setting).collect();
        let folder = ".".as_ref();
        Scenario::parse("run.toml", &text(""), folder, &settings, &catalogue()).unwrap()
    };
    let lost = [
        &[("duration", "3 s"), ("duration", "4 s")][..],
        &[
            ("plant.ground.friction", "0.5"),
            ("plant.ground", "{ friction = 0.4 }"),
        ],
        &[
            ("plant.ground", "{ friction = 0.5 }"),
            ("plant.ground.friction", "0.4"),
        ],
        &[("plant.ground.friction", "0.5"), ("plant.ground", "{}")],
    ];
    for settings in lost {
        let scenario = with(settings);
        assert_eq!(warnings(&scenario), [("set-twice", 1)], "{settings:?}");
    }
    let kept = [
        &[("duration", "4 s")][..],
        &[
            ("plant.ground", "{ friction = 0.5 }"),
            ("plant.ground.restitution", "0.4"),
        ],
        &[
            ("controller.frequency", "2 Hz"),
            ("controller.step_length", "5 cm"),
        ],
    ];
    for settings in kept {
        assert_eq!(warnings(&with(settings)), [], "{settings:?}");
    }
    let twice = with(lost[0]);
    assert_eq!(twice.duration.as_nanos(), 4_000_000_000, "the last counts");
    insta::assert_snapshot!(twice.warnings[0]);
}

#[test]
fn robot_value_replaced_twice_is_reported() {
    let more = "[override]\nleg.aslp.l1 = '44 mm'\n\"leg.aslp\".l1 = '45 mm'";
    assert_eq!(warnings_of(more), [("set-twice", 13)]);
    assert_eq!(warnings_of(&more.replace("\".l1", "\".l2")), []);
}

#[test]
fn exact_expectations_past_the_horizon_are_reported() {
    let count = "footstep = { count = { min = 5, max = 5 } }";
    let speed = |near: &str, within: &str| {
        format!("body = {{ speed = {{ near = '{near}', within = '{within}' }} }}")
    };
    let displaced = "[[change]]\nat = '2 s'\nset = 'frequency'\nto = '2 Hz'\n[[expect]]\n\
                     footstep = { displacement = { max = '1 mm' }, against = 'without changes' }";
    let expected = |text: &str| format!("[[expect]]\n{text}");
    for (horizon, more, warned) in [
        ("7 s", expected(count), true),
        ("7 s", expected(&format!("{count}\nbefore = '6 s'")), false),
        ("10 s", expected(count), false),
        (
            "7 s",
            expected("footstep = { count = { min = 5, max = 6 } }"),
            false,
        ),
        ("7 s", expected(&speed("1 m/s", "1 mm/s")), true),
        ("7 s", expected(&speed("1 m/s", "1 cm/s")), false),
        ("7 s", expected("body = { fall = false }"), false),
        // Of the first footstep after the change.
        ("1 s", displaced.to_owned(), true),
        ("7 s", displaced.to_owned(), false),
    ] {
        let horizon = format!("horizon = '{horizon}'\n");
        for (text, warned) in [(horizon + &text(&more), warned), (text(&more), false)] {
            let scenario = parse(&text).unwrap_or_else(|error| panic!("{error}\n{text}"));
            let codes: Vec<_> = warnings(&scenario).iter().map(|(code, _)| *code).collect();
            let code = warned.then_some("exact-beyond-horizon");
            assert_eq!(codes, Vec::from_iter(code), "{text}");
        }
    }
}

#[test]
fn ensemble_is_a_number_or_a_table_of_at_least_two_runs() {
    let read = |value: &str| parse(&format!("ensemble = {value}\n{}", text("")));
    for (value, runs, share) in [
        ("32", 32, 0.95),
        ("{ runs = 8 }", 8, 0.95),
        ("{ runs = 8, share = 1 }", 8, 1.0),
    ] {
        let found = read(value).unwrap().ensemble.unwrap();
        assert_eq!((found.runs, found.share), (runs, share));
    }
    for value in [
        "1",
        "10001",
        "{ share = 1 }",
        "{ runs = 8, share = 1.1 }",
        "true",
    ] {
        assert!(read(value).is_err(), "{value}");
    }
    assert_eq!(parse(&text("")).unwrap().ensemble, None);
}
