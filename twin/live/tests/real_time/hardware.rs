//! A run in real time whose variables visitors change. It has no bus: the controller alone runs.

use std::path::Path;

use serde_json::{Value, json};
use twinrig_kernel::SimTime;
use twinrig_live::hardware::HardwareControl;
use twinrig_live::request::Request;
use twinrig_rig::run::hardware::HardwareRun;
use twinrig_rig::{Assembly, Execution, Registry, RunObserver, RunProgress};
use twinrig_runtime::{Change, Group, RunEvent};
use twinrig_testing::folder::Folder;

const STAND: &str = "robot = 'cheetah-cub'\nduration = '0.5 s'\n\
                     plant = { model = 'massless' }\n\
                     controller = { kind = 'stand', period = '2 ms' }\n\
                     [[change]]\nat = '21 ms'\nset = 'hip_height/hind'\nto = '0.142 m'\n";
const VARIABLE: &str = "hip_height/fore";

/// Asks for a service; returns the response, or the refusal.
fn ask(control: &mut HardwareControl<'_>, service: &str, mut body: Value) -> Result<(), String> {
    body["service"] = service.into();
    let request: Request = serde_json::from_value(body).unwrap();
    control.handle(&request).map(|response| {
        assert_eq!(response, json!({ "ok": true }));
    })
}

fn set(control: &mut HardwareControl<'_>, value: f64) -> Result<(), String> {
    ask(
        control,
        "set",
        json!({ "variable": VARIABLE, "value": value }),
    )
}

/// Calls `visit` once, when the run has reached 50 ms, and keeps the changes.
struct Visit<'a, F> {
    control: HardwareControl<'a>,
    asked: Option<F>,
    changes: Vec<(SimTime, usize, f64)>,
}

impl<F: FnOnce(&mut HardwareControl<'_>)> RunObserver for Visit<'_, F> {
    fn samples(&mut self, now: SimTime, group: Group, values: &[f64]) {
        self.control.samples(now, group, values, &mut ());
    }
    fn event(&mut self, now: SimTime, event: RunEvent) {
        self.control.event(now, event, &mut ());
        if let RunEvent::Change { variable, value } = event {
            self.changes.push((now, variable, value));
        }
    }
    fn poll(&mut self, progress: &RunProgress<'_>) {
        if progress.now.as_nanos() >= 50_000_000
            && let Some(visit) = self.asked.take()
        {
            visit(&mut self.control);
        }
    }
}

/// Runs in real time with a visit; passes the control, the changes by visitors and the folder on.
fn run<F: FnOnce(&mut HardwareControl<'_>)>(
    name: &str,
    visit: F,
    check: impl FnOnce(&mut HardwareControl<'_>, &[(SimTime, usize, f64)], &Path),
) {
    let registry = Registry::standard();
    let builder = Assembly::builder(&registry);
    let assembly = builder.text("stand.toml", STAND, "".as_ref()).unwrap();
    let folder = Folder::new(name);
    let mut run = HardwareRun::new(&assembly, Execution::default()).unwrap();
    let steering = run.steering();
    let control = HardwareControl::new(&assembly, run.rig(), steering, folder.path()).unwrap();
    let mut visit = Visit {
        control,
        asked: Some(visit),
        changes: Vec::new(),
    };
    let report = run.run(&mut visit).unwrap();
    assert_eq!(report.error, None);
    let (of_scenario, by_visitors) = visit.changes.split_first().unwrap();
    assert_eq!(of_scenario.2, 0.142);
    check(&mut visit.control, by_visitors, folder.path());
}

/// A jump of a slider is a sequence of small steps, which the recording and the scenario of the
/// changes have.
#[test]
fn changes_are_slewed_and_written_as_a_scenario() {
    let visit = |control: &mut HardwareControl<'_>| {
        ask(control, "slew", json!({ "rate": 0.5 })).unwrap();
        set(control, 0.135).unwrap();
    };
    run("slewed", visit, |control, changes, folder| {
        let state = control.state();
        let variables = state["variables"].as_array().unwrap();
        let fore = variables.iter().find(|it| it["name"] == VARIABLE).unwrap();
        let default = fore["default"].as_f64().unwrap();
        // Half of the default value in a second, in periods of 2 ms.
        let step = default * 0.5 * 2e-3;
        let count = ((default - 0.135) / step).ceil();
        let made = u32::try_from(changes.len()).unwrap();
        assert_eq!(f64::from(made), count);
        let values = changes.iter().map(|(_, _, value)| *value);
        let mut before = default;
        for value in values {
            // Rounding of a sum.
            assert!((before - value).abs() <= step * (1.0 + 1e-9), "{changes:?}");
            before = value;
        }
        assert_eq!((before, &fore["value"]), (0.135, &json!(0.135)));
        assert_eq!(
            (&state["reach"], &state["status"]),
            (&json!(null), &json!("playing"))
        );

        let path = control.write_scenario().unwrap().unwrap();
        assert_eq!(path, folder.join("stand-0.toml"));
        let registry = Registry::standard();
        let written = Assembly::builder(&registry).file(&path).unwrap();
        // That of the scenario is not written twice.
        let (first, others) = {
            let mut all = written.changes();
            (all.next().unwrap(), all.collect::<Vec<_>>())
        };
        assert_eq!(first.1, "hip_height/hind");
        assert_eq!(others.len(), changes.len());
        for ((at, name, change), (event, _, value)) in others.iter().zip(changes) {
            let late = event.as_nanos() - at.as_nanos();
            assert_eq!((*name, *change), (VARIABLE, Change::To(*value)));
            assert!(
                at.as_nanos() % 2_000_000 == 0 && late < 2_000_000,
                "{at}, {event}"
            );
        }
    });
}

/// Creates the control of a run that does not begin; passes it on with the index of the variable.
fn idle(name: &str, text: &str, check: impl FnOnce(&mut HardwareControl<'_>, usize)) {
    let registry = Registry::standard();
    let builder = Assembly::builder(&registry);
    let assembly = builder.text("stand.toml", text, "".as_ref()).unwrap();
    let folder = Folder::new(name);
    let mut run = HardwareRun::new(&assembly, Execution::default()).unwrap();
    let steering = run.steering();
    let rig = run.rig();
    let variable = rig
        .process()
        .variables()
        .iter()
        .position(|it| it.name() == VARIABLE);
    let mut control = HardwareControl::new(&assembly, rig, steering, folder.path()).unwrap();
    check(&mut control, variable.unwrap());
}

/// A scenario has one change of a variable at an instant, and the last of a control step is the one
/// that counts.
#[test]
fn written_scenario_has_one_change_at_an_instant() {
    let text = STAND.replace("21 ms", "20 ms").replace("hind", "fore");
    idle("instant", &text, |control, variable| {
        let mut made = |at_us: u64, value: f64| {
            let at = SimTime::from_nanos(at_us * 1000);
            control.event(at, RunEvent::Change { variable, value }, &mut ());
        };
        made(10_100, 0.135);
        made(10_200, 0.136);
        // That of the scenario, and one by a visitor at the same step.
        made(20_100, 0.142);
        made(20_200, 0.137);
        let path = control.write_scenario().unwrap().unwrap();
        let registry = Registry::standard();
        let written = Assembly::builder(&registry).file(&path).unwrap();
        let at = |ms: u64| SimTime::from_nanos(ms * 1_000_000);
        let changes = [(10, 0.136), (20, 0.142), (22, 0.137)];
        assert_eq!(
            written.changes().collect::<Vec<_>>(),
            changes.map(|(ms, value)| (at(ms), VARIABLE, Change::To(value)))
        );
    });
}

/// A value that the controller has refused after all is not shown as the target for ever.
#[test]
fn value_that_is_not_approached_is_dropped() {
    idle("dropped", STAND, |control, variable| {
        let target = |control: &mut HardwareControl<'_>, at_ms: u64| {
            let at = SimTime::from_nanos(at_ms * 1_000_000);
            control.samples(at, Group::Plant, &[], &mut ());
            let state = control.state();
            let target = &state["variables"][variable]["target"];
            (target.as_f64(), state["message"].clone())
        };
        let (at_start, _) = target(control, 0);
        assert_ne!(at_start, Some(0.135));
        set(control, 0.135).unwrap();
        assert_eq!(target(control, 500), (Some(0.135), json!(null)));
        let refused = format!("the controller refuses the value of `{VARIABLE}`");
        assert_eq!(target(control, 501), (at_start, json!(refused)));
    });
}

/// What the controller would refuse is refused before it is sent, and so is time travel.
#[test]
fn refusals_change_nothing() {
    let visit = |control: &mut HardwareControl<'_>| {
        let error = set(control, -1.0).unwrap_err();
        assert!(error.contains(VARIABLE), "{error}");
        let error = ask(
            control,
            "set",
            json!({ "variable": "hip_hight/fore", "value": 0.1 }),
        );
        assert!(error.unwrap_err().contains("similar: hip_height"));
        for (service, body) in [
            ("pause", json!({})),
            ("play", json!({})),
            ("step", json!({})),
            ("seek", json!({ "at_s": 0.0 })),
            ("speed", json!({ "factor": 2.0 })),
            ("branch", json!({ "number": 0, "at_s": null })),
            ("compare", json!({ "one": 0, "other": 0 })),
        ] {
            let error = ask(control, service, body).unwrap_err();
            assert!(error.contains("on hardware"), "{service}: {error}");
        }
        assert_eq!(
            control.state()["message"]
                .as_str()
                .map(|it| it.contains("hardware")),
            Some(true)
        );
        ask(control, "recall", json!({ "name": "none" })).unwrap_err();
    };
    run("refusals", visit, |control, changes, _| {
        assert_eq!(changes, []);
        assert_eq!(control.write_scenario(), Ok(None));
    });
}

/// A set that is saved is recalled with all its values, at once without a limit.
#[test]
fn sets_are_recalled() {
    let visit = |control: &mut HardwareControl<'_>| {
        assert_eq!(control.state()["slew"], 1.0);
        ask(control, "slew", json!({ "rate": 0.0 })).unwrap();
        ask(control, "save", json!({ "name": "begin" })).unwrap();
        set(control, 0.135).unwrap();
        ask(control, "save", json!({ "name": "low" })).unwrap();
        ask(control, "recall", json!({ "name": "begin" })).unwrap();
        ask(control, "recall", json!({ "name": "low" })).unwrap();
        assert_eq!(control.state()["sets"], json!(["begin", "low"]));
    };
    run("sets", visit, |control, changes, folder| {
        assert!(folder.join("sets/low.toml").exists());
        let state = control.state();
        let variables = state["variables"].as_array().unwrap();
        let value = |name| &variables.iter().find(|it| it["name"] == name).unwrap()["value"];
        assert_eq!(value(VARIABLE), &json!(0.135));
        assert_eq!(value("hip_height/hind"), &json!(0.142));
        assert!(changes.len() >= 3, "{changes:?}");
    });
}
