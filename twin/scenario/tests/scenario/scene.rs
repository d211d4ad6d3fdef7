//! Scenes contain the required parts and report the omitted ones.

use crate::common::{facts, legs, parse, scene, text};
use proptest::prelude::*;
use twinrig_kernel::{SimDuration, SimTime};
use twinrig_runtime::{Change, Timing};
use twinrig_scenario::{
    LegFact, OptionValue, PayloadSpec, Profile, Scenario, Setting, SurfaceSpec,
};

fn left_out(text: &str) -> Vec<String> {
    let scene = scene(text).unwrap();
    scene
        .left_out
        .into_iter()
        .map(|left| format!("{}: {}", left.part, left.why))
        .collect()
}

#[test]
fn scene_without_record_table_records_all_signals() {
    let scene = scene(&text("")).unwrap();
    assert_eq!(scene.wanted.len(), 2 + 7 * 4);
    assert_eq!(scene.recorded.len(), 2 + 9 * 4);
    assert_eq!(
        left_out(&text("")),
        [
            "contacts of trunk, knees and ankles: [plant] contacts = \"feet\"",
            "bus, packets and boards: there is no [bus]: signals go straight to the actuators",
        ]
    );
}

#[test]
fn unused_signals_are_omitted_and_reported() {
    let more = "[record]\nsignals = ['leg/*/hip/command']\nframes = '0 Hz'\n\n\
                [[expect]]\nfootstep = { slip = { max = '5 mm' } }";
    let scene = scene(&text(more)).unwrap();
    let feet: Vec<String> = ["LF", "RF", "LH", "RH"]
        .iter()
        .flat_map(|leg| {
            [
                format!("leg/{leg}/foot/position"),
                format!("leg/{leg}/foot/load"),
            ]
        })
        .collect();
    // The signals of the trunk are required to detect a fall, which affects footsteps.
    let trunk = ["body/position", "body/rpy"].map(str::to_owned).to_vec();
    assert_eq!(scene.wanted, [trunk, feet].concat());
    insta::assert_snapshot!(left_out(&text(more)).join("\n"));
}

#[test]
fn expectations_of_other_plants_are_omitted_and_reported() {
    let more = "[record]\nframes = '0 Hz'\n\n\
                [[expect]]\nname = 'balance'\nenergy = { residual = { max = 1e-6 } }\nplants = ['massless']\n\n\
                [[expect]]\nname = 'balance'\nenergy = { residual = { max = 1e-3 } }\nplants = ['mujoco']";
    let scene = scene(&text(more)).unwrap();
    let [kept] = &scene.scenario.expectations[..] else {
        panic!("{:?}", scene.scenario.expectations);
    };
    // Expectations of different plants have equal names without numbers.
    assert_eq!(
        (kept.name.as_str(), &kept.plants[..]),
        ("balance", &["massless".to_owned()][..])
    );
    let reported = "expectation that balance: it is about mujoco, not massless";
    assert!(
        left_out(&text(more)).contains(&reported.to_owned()),
        "{:?}",
        left_out(&text(more))
    );
}

#[test]
fn recording_of_poses_requires_its_signals() {
    let scene = scene(&text("[record]\nsignals = []\nframes = '50 Hz'")).unwrap();
    assert_eq!(scene.wanted, ["body/position"]);
}

#[test]
fn unnamed_legs_are_omitted() {
    let text = text("[record]\nsignals = []").replace("ground = {}", "legs = ['RH', 'LF']");
    let scenario = parse(&text).unwrap();
    let kept: Vec<String> = scenario
        .legs(&legs())
        .unwrap()
        .into_iter()
        .map(|leg| leg.name)
        .collect();
    assert_eq!(kept, ["LF", "RH"], "in the robot's order");
    let left = left_out(&text);
    assert!(
        left.iter()
            .any(|left| left.starts_with("every leg but the named ones")),
        "{left:?}"
    );
    assert!(
        left.iter().any(|left| left.starts_with("ground, contacts")),
        "{left:?}"
    );
}

#[test]
fn expectation_of_an_omitted_leg_is_an_error() {
    let text = text("[[expect]]\nfootstep = { leg = 'RF', slip = { max = '1 mm' } }")
        .replace("ground = {}", "legs = ['RH', 'LF']");
    let scenario = parse(&text).unwrap();
    let kept: Vec<LegFact> = scenario.legs(&legs()).unwrap();
    let error = scenario.scene(&facts(kept)).unwrap_err();
    insta::assert_snapshot!(error);
}

#[test]
fn all_values_of_a_file_are_read() {
    let more = r#"
        gait = "walk"
        compute_time = { mean = "0.3 ms", deviation = "0.1 ms", min = "0.1 ms", max = "0.9 ms" }
        frequency = "3 Hz"
        hip_height = { hind = "121.4 mm" }

        [actuator]
        lag = "5 ms"
        hip = { speed = "20 rad/s" }

        [io]
        step = "0.5 ms"
        transfer_time = { trace = ["0.1 ms", "0.2 ms"] }

        [observe]
        period = "4 ms"

        [[change]]
        at = "8 s"
        set = "hip_height"
        by = "-1 cm"

        [[change]]
        at = "4 s"
        set = "frequency"
        to = "2 Hz"
    "#;
    let text = text(more).replace(
        "ground = {}",
        "ground = { restitution = 0.25, profile = 'step-down', at = '1 m', height = '20 mm' }
        start = { q1 = '90 deg', q3 = '0.5 rad', q2_rate = '-3 rad/s' }",
    );
    let scenario = parse(&text).unwrap();
    let control = scenario.controller.as_ref().unwrap();
    assert_eq!(control.options.text("gait"), Some("walk"));
    assert_eq!(
        control.variables,
        [
            ("frequency".to_owned(), 3.0),
            ("hip_height/hind".to_owned(), 0.1214)
        ]
    );
    assert_eq!(
        scenario.plant.options.text("force"),
        Some("solve"),
        "by default"
    );
    assert_eq!(scenario.plant.options.number("crouch"), None);
    let (hip, knee) = (scenario.actuator.hip, scenario.actuator.knee);
    assert_eq!((hip.lag, hip.speed), (Some(0.005), Some(20.0)));
    assert_eq!((knee.lag, knee.speed), (Some(0.005), None));
    assert_eq!(scenario.io.step, SimDuration::from_micros(500));
    assert!(matches!(&scenario.io.transfer_time, Timing::Trace(times) if times.len() == 2));
    assert_eq!(scenario.observe.period, SimDuration::from_millis(4));
    let quarter = core::f64::consts::FRAC_PI_2;
    let start = scenario.plant.start.as_ref().unwrap();
    assert_eq!(start.q, [quarter, 0.0, 0.5]);
    assert_eq!(start.rates, [0.0, -3.0, 0.0]);
    let ground = scenario.plant.ground.as_ref().unwrap();
    assert_eq!((ground.friction, ground.restitution), (None, 0.25));
    assert_eq!(
        ground.profile,
        Profile::StepDown {
            at: 1.0,
            height: 0.02
        }
    );
    let changes: Vec<_> = scenario
        .changes
        .iter()
        .map(|c| (c.variable.as_str(), c.change))
        .collect();
    assert_eq!(
        changes,
        [
            ("frequency", Change::To(2.0)),
            ("hip_height/fore", Change::By(-0.01)),
            ("hip_height/hind", Change::By(-0.01)),
        ],
        "by time, a key without a group meaning all groups"
    );
    assert!(scenario.without_changes().changes.is_empty());
}

#[test]
fn repeated_change_is_one_change_at_each_of_its_times() {
    let times = |more: &str| -> Vec<(u64, String)> {
        let change = "[[change]]\nat = '1 s'\nset = 'frequency'\nby = '10 mHz'\n";
        let change = change.replace("10 mHz", "0.01 Hz");
        let scenario = parse(&text(&format!("{change}{more}"))).unwrap();
        let changes = scenario.changes.into_iter();
        changes
            .map(|change| {
                assert_eq!(change.change, Change::By(0.01));
                (change.at.as_nanos() / 1_000_000, change.variable)
            })
            .collect()
    };
    let at = |times: &[u64]| -> Vec<(u64, String)> {
        times
            .iter()
            .map(|&at| (at, "frequency".to_owned()))
            .collect()
    };
    assert_eq!(times("every = '2.5 s'\ntimes = 3"), at(&[1000, 3500, 6000]));
    // Without a number, those before the end of the run, which is at 10 s.
    assert_eq!(times("every = '4.5 s'"), at(&[1000, 5500]));
    assert_eq!(times("every = '4.499 s'"), at(&[1000, 5499, 9998]));
    assert_eq!(times("every = '1 min'"), at(&[1000]));
    assert_eq!(times(""), at(&[1000]));
}

#[test]
fn settings_override_the_file_and_are_reported_at_their_origin() {
    let with = |key: &str, value: &str| {
        let setting = Setting {
            origin: "--set".into(),
            key: key.into(),
            value: value.into(),
        };
        Scenario::parse(
            "run.toml",
            &text(""),
            ".".as_ref(),
            &[setting],
            &crate::common::catalogue(),
        )
    };
    let scenario = with("duration", "20 s").unwrap();
    assert_eq!(scenario.duration, SimDuration::from_secs(20));
    assert_eq!(
        with("plant.ground.friction", "0.3")
            .unwrap()
            .plant
            .ground
            .unwrap()
            .friction,
        Some(0.3)
    );
    insta::assert_snapshot!(with("controller.frequency", "3 mm").unwrap_err());
    insta::assert_snapshot!(with("controller.frequncy", "3 Hz").unwrap_err());
}

#[test]
fn overrides_are_kept_for_the_robot_file() {
    let scenario = parse(&text("[override.leg.aslp]\nparallel.preload = '0 mm'")).unwrap();
    assert!(!scenario.overrides.is_empty());
}

/// A file with most of the possible content.
const EXTENSIVE: &str = r#"
[override]
leg.aslp.l1 = "44 mm"
[actuator]
kind = "servo"
hip = { lag = "5 ms" }
[io]
transfer_time = { min = "0.1 ms", max = "0.2 ms" }
[footsteps]
touch_down = "0.5 N"
lift_off = "0.2 N"
[record]
signals = ["leg/*/foot/*", "**"]
[[change]]
at = "8 s"
set = "hip_height"
by = "-1 cm"
[[expect]]
footstep = { order = [["LF", "RH"], ["RF", "LH"]] }
after = "2 s"
[[expect]]
footstep = { displacement = { max = "1 mm" }, against = "without changes", cycle = 2 }
[[expect]]
footstep = { phase = { LF = 0, RF = 0.5, LH = 0.5, RH = 0 }, tolerance = 0.1 }
[[expect]]
body = { fall = { height = 0.4, tilt = "30 deg" } }
[[expect]]
signal = { name = "leg/*/foot/load", always = { min = "0 N" }, until = { name = "body/position", component = "z", max = "1 cm" } }
[[expect]]
timing = { of = "control", jitter = { near = "0 s", within = "1 us" } }
"#;

#[test]
fn extensive_file_is_valid() {
    assert!(
        scene(&text(EXTENSIVE)).is_ok(),
        "{}",
        scene(&text(EXTENSIVE)).unwrap_err()
    );
}

proptest! {
    /// Any edit of a file is read or rejected with a message.
    #[test]
    fn arbitrary_edits_cause_no_panic(
        cut in 0..2000_usize,
        length in 0..40_usize,
        replacement in prop_oneof![
            Just(String::new()), Just("0".into()), Just("nan".into()), Just("-1e300".into()), Just("\"\"".into()),
            Just("[]".into()), Just("{}".into()), Just("\"1e999 s\"".into()), Just("[[plant]]".into()), "[ -~]{0,8}",
        ],
    ) {
        let mut characters: Vec<char> = text(EXTENSIVE).chars().collect();
        let cut = cut % characters.len();
        let end = (cut + length).min(characters.len());
        characters.splice(cut..end, replacement.chars());
        if let Err(error) = scene(&characters.into_iter().collect::<String>()) {
            prop_assert!(!error.problems.is_empty());
            prop_assert!(error.to_string().contains("run.toml"));
        }
    }
}

#[test]
fn standalone_plant_requires_no_robot_and_omits_no_part_of_one() {
    let text = "duration = \"1 s\"\n\n[plant]\nmodel = \"own\"\nfile = \"pup.xml\"\n\n[plant.outputs]\n\
                \"leg/LF/hip/position\" = { joint = \"lf_hip\" }\n";
    let scenario = crate::common::parse(text).unwrap();
    assert_eq!(scenario.robot, None);
    let options = &scenario.plant.options;
    let file = options.name("file").unwrap();
    assert_eq!((file.value.as_str(), file.place.line()), ("pup.xml", 5));
    let [(signal, OptionValue::Group(group))] = options.named("outputs") else {
        panic!("{options:?}");
    };
    assert_eq!(signal.value, "leg/LF/hip/position");
    assert_eq!(group.name("joint").unwrap().value, "lf_hip");
    let scene = crate::common::scene(text).unwrap();
    let parts: Vec<&str> = scene.left_out.iter().map(|one| one.part.as_str()).collect();
    assert!(
        !parts.contains(&"ground, contacts and their solver"),
        "{parts:?}"
    );
    assert!(parts.contains(&"controller"), "{parts:?}");
    // A robot is optional, for a controller that depends on it.
    let named = crate::common::parse(&format!("robot = \"cheetah-cub\"\n{text}")).unwrap();
    assert_eq!(named.robot.unwrap().value, "cheetah-cub");
}

#[test]
fn payloads_and_surfaces_belong_to_the_plant() {
    let more = "[[payload]]\nmass = '50 g'\nat = ['-1 cm', '2 cm', '3 mm']\n\n\
                [[payload]]\nname = 'battery'\nmass = '0 kg'\nat = ['0 m', '0 m', '0 m']\n\n\
                [[surface]]\nfriction = 0.2\nto = '1.4 m'\nat = '500 ms'\nfor = '2 s'\n\n\
                [[surface]]\nfriction = 0.3";
    let plant = parse(&text(more)).unwrap().plant;
    let payload = |name: &str, mass, at| PayloadSpec {
        name: name.to_owned(),
        mass,
        at,
    };
    let expected = [
        payload("payload 1", 0.05, [-0.01, 0.02, 0.003]),
        payload("battery", 0.0, [0.0; 3]),
    ];
    assert_eq!(plant.payloads, expected);
    let everywhere = f64::NEG_INFINITY..f64::INFINITY;
    let surface = |friction, extent, begin, lasts: Option<u64>| SurfaceSpec {
        friction,
        extent,
        begin: SimTime::ZERO + SimDuration::from_millis(begin),
        end: lasts.map(|end| SimTime::ZERO + SimDuration::from_millis(end)),
    };
    let expected = [
        surface(0.2, f64::NEG_INFINITY..1.4, 500, Some(2500)),
        surface(0.3, everywhere, 0, None),
    ];
    assert_eq!(plant.ground.unwrap().surfaces, expected);
}
