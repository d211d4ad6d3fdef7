//! Stated against true errors on scenes with closed forms, and the conditions of an error bar.

use std::path::Path;

use twinrig_experiment::{execute, with_error_bars};
use twinrig_rig::assembly::Assembly;
use twinrig_rig::error::Error as RigError;
use twinrig_rig::report::{ErrorBar, ErrorSource, Report};
use twinrig_rig::{Execution, PlantKind, Registry};
use twinrig_scenario::Setting;

/// A free arm: the servo without torque, friction and losses of its gear is a pendulum.
const PENDULUM: &str = r#"
name = "pendulum"
duration = "0.2 s"
[plant]
model = "servo"
file = "xl330"
[override]
friction = { viscous = "0 N·m·s/rad", coulomb = "0 N·m" }
gear = { driving_square = 0, static_driving = 0, static_driven = 0 }
[controller]
kind = "swing"
period = "5 ms"
shape = "ramp"
amplitude = "0 rad"
frequency = "1 Hz"
[[change]]
at = "0 s"
set = "enable"
to = 0
[observe]
period = "1 ms"
[[expect]]
name = "angle"
signal = { name = "servo/angle", always = { min = "-10 rad" } }
after = "0.18 s"
[[expect]]
name = "rate"
signal = { name = "servo/rate", always = { min = "-100 rad/s" } }
after = "0.18 s"
"#;

/// Mass, length and inertia of the motor of benches/xl330.toml, and gravity.
const LOAD: [f64; 4] = [0.49, 0.1, 14.47e-4, 9.80665];

fn setting(key: &str, value: impl Into<String>) -> Setting {
    Setting {
        origin: "the test".to_owned(),
        key: key.to_owned(),
        value: value.into(),
    }
}

fn assembly<'r>(registry: &'r Registry, text: &str, settings: &[Setting]) -> Assembly<'r> {
    let builder = Assembly::builder(registry).settings(settings);
    builder.text("test.toml", text, Path::new("")).unwrap()
}

fn with_bars(assembly: &Assembly<'_>) -> Report {
    let report = execute(assembly, &Execution::default()).unwrap();
    with_error_bars(assembly, report, &mut |_, _| ()).unwrap()
}

/// Measured value and error bar of each expectation.
fn bars(report: &Report) -> Vec<(f64, ErrorBar)> {
    assert_eq!(report.error, None);
    let lines = report.expectations.iter();
    let bar = lines.map(|line| (line.outcome.measured.unwrap(), line.error_bar.unwrap()));
    bar.collect()
}

/// Quarter of the period of a pendulum of a rate in the small, from an amplitude: by the
/// arithmetic-geometric mean.
fn quarter(rate: f64, amplitude: f64) -> f64 {
    let (mut a, mut b) = (1.0, libm::cos(0.5 * amplitude));
    while f64::abs(a - b) > 1e-15 {
        (a, b) = (0.5 * (a + b), f64::sqrt(a * b));
    }
    0.5 * std::f64::consts::PI / (rate * a)
}

#[test]
fn stated_error_covers_the_true_one_of_a_pendulum() {
    let [mass, length, inertia, gravity] = LOAD;
    let rate = f64::sqrt(mass * gravity * length / (inertia + mass * length * length));
    // The amplitude from which the arm hangs down at the end of the run.
    let (mut low, mut high) = (0.1, 3.0);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if quarter(rate, middle) < 0.2 {
            low = middle;
        } else {
            high = middle;
        }
    }
    let amplitude = 0.5 * (low + high);
    let exact = [-amplitude, -2.0 * rate * libm::sin(0.5 * amplitude)];
    let registry = Registry::standard();
    let mut judged = 0;
    for step in ["1 ms", "0.5 ms", "0.2 ms", "0.1 ms", "50 us", "20 us"] {
        let settings = [
            setting("override.load.offset", format!("\"{amplitude} rad\"")),
            setting("plant.step", format!("\"{step}\"")),
        ];
        let report = with_bars(&assembly(&registry, PENDULUM, &settings));
        for ((measured, bar), exact) in bars(&report).into_iter().zip(exact) {
            let (stated, wrong) = (bar.error.unwrap(), (measured - exact).abs());
            assert!(wrong > 1e-12, "{step}: nothing is judged");
            assert!(stated >= wrong, "{step}: {stated:e} < {wrong:e}");
            assert!(stated < 20.0 * wrong, "{step}: {stated:e} for {wrong:e}");
            assert_eq!(bar.error_by, Some(ErrorSource::Refinement));
            judged += 1;
        }
    }
    assert_eq!(judged, 12);
}

/// A run without other settings has the fingerprint that it has with error bars.
#[test]
fn error_bars_change_nothing_else() {
    let registry = Registry::standard();
    let scene = assembly(&registry, PENDULUM, &[]);
    let plain = execute(&scene, &Execution::default()).unwrap();
    let report = with_bars(&scene);
    assert_eq!(plain.fingerprint, report.fingerprint);
    for (plain, line) in plain.expectations.iter().zip(&report.expectations) {
        assert_eq!(plain.outcome, line.outcome);
        assert_eq!(plain.error_bar, None);
    }
}

/// Limits as far from the measured value as `errors` of the stated errors.
#[test]
fn verdict_is_decided_from_three_errors_on() {
    let registry = Registry::standard();
    let of = |errors: f64| {
        let (measured, bar) = bars(&with_bars(&assembly(&registry, PENDULUM, &[])))[0];
        let limit = measured - errors * bar.error.unwrap();
        let text = PENDULUM.replace("-10 rad\"", &format!("{limit} rad\""));
        let report = with_bars(&assembly(&registry, &text, &[]));
        (bars(&report)[0].1.decided, report.exit_code())
    };
    assert_eq!(of(4.0), (true, 0));
    assert_eq!(of(2.0), (false, 1));
    // Fails, and is not decided either.
    assert_eq!(of(-2.0), (false, 1));
    assert_eq!(of(-4.0), (true, 1));
}

#[test]
fn plant_without_declared_accuracy_has_no_error_bars() {
    let kind = |kind: PlantKind| Registry::standard().with_plant(kind);
    let scenario = r#"
name = "drop"
robot = "cheetah-cub"
duration = "20 ms"
[plant]
model = "custom"
[actuator]
kind = "none"
[[expect]]
name = "is up"
signal = { name = "body/position", component = "z", always = { min = "0 m" } }
"#;
    let plain = kind(PlantKind::new(
        "custom",
        "a wrapped plant",
        twinrig_rig::lcp,
    ));
    let scene = assembly(&plain, scenario, &[]);
    let report = execute(&scene, &Execution::default()).unwrap();
    let found = with_error_bars(&scene, report, &mut |_, _| ());
    let error = found.unwrap_err();
    assert!(
        matches!(&error, twinrig_experiment::error::Error::Rig(RigError::Accuracy { plant, .. }) if plant == "custom"),
        "{error}"
    );
    let step = twinrig_kernel::SimDuration::from_millis(1);
    let stepped = PlantKind::new("custom", "a wrapped plant", twinrig_rig::lcp).with_step(step);
    let registry = kind(stepped);
    let report = with_bars(&assembly(&registry, scenario, &[]));
    assert!(report.expectations[0].error_bar.unwrap().decided);
}
