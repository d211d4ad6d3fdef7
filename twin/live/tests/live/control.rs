//! Requests of visitors, without a clock and without a socket.

use std::path::Path;

use serde_json::{Value, json};
use twinrig_kernel::SimTime;
use twinrig_live::control::Control;
use twinrig_live::request::{Request, SERVICES};
use twinrig_live::{SNAPSHOT_BYTES, Session};
use twinrig_rig::{Assembly, Execution, Registry, execute_observed};
use twinrig_runtime::ProcessVariable;
use twinrig_scenario::Setting;
use twinrig_testing::folder::Folder;

fn ms(ms: u64) -> SimTime {
    SimTime::from_nanos(ms * 1_000_000)
}

fn assembly(registry: &Registry) -> Assembly<'_> {
    let setting = Setting {
        origin: "test".to_owned(),
        key: "until".to_owned(),
        value: "2 s".to_owned(),
    };
    let path = Path::new("../../scenarios/trot.toml");
    let settings = [setting];
    let builder = Assembly::builder(registry).settings(&settings);
    builder.file(path).unwrap()
}

fn request(service: &str, mut body: Value) -> Request {
    body["service"] = service.into();
    serde_json::from_value(body).unwrap()
}

/// Asks for a service; returns the response, or the refusal.
fn ask(control: &mut Control<'_>, service: &str, body: Value) -> Result<Value, String> {
    control.handle(&request(service, body), &mut ())
}

/// Runs `test` on a session that is at 1.5 s of a trot.
fn with_control(name: &str, test: impl FnOnce(&mut Control<'_>, &Path)) {
    let registry = Registry::standard();
    let assembly = assembly(&registry);
    let folder = Folder::new(name);
    let session = Session::new(&assembly, SNAPSHOT_BYTES).unwrap();
    let mut control = Control::new(session, folder.path());
    control.advance(ms(1500), &mut ());
    test(&mut control, folder.path());
}

/// Pause, two acts in the past, and the two futures: their footsteps are those of both runs, and
/// the file of the branch has its fingerprint.
#[test]
fn futures_are_those_of_both_runs() {
    with_control("futures", |control, folder| {
        let ok = json!({ "ok": true });
        assert_eq!(ask(control, "pause", json!({})), Ok(ok.clone()));
        assert_eq!(control.state()["status"], "paused");
        assert_eq!(ask(control, "seek", json!({ "at_s": 1.0 })), Ok(ok));
        let set = json!({ "variable": "frequency", "value": 3.2 });
        ask(control, "set", set).unwrap();
        assert_eq!(control.write_branches(), Ok(Vec::new()));
        control.advance(ms(1200), &mut ());
        let set = json!({ "variable": "step_length", "value": 0.12 });
        ask(control, "set", set).unwrap();
        control.advance(ms(2000), &mut ());
        let path = folder.join("trot-1.toml");
        assert_eq!(control.write_branches(), Ok(vec![path.clone()]));
        assert_eq!(control.write_branches(), Ok(Vec::new()));

        let registry = Registry::standard();
        let written = Assembly::builder(&registry).file(&path).unwrap();
        let report = execute_observed(&written, &Execution::default(), &mut ()).unwrap();
        let state = control.state();
        assert_eq!(
            state["branches"][1]["fingerprint"],
            json!(report.fingerprint)
        );
        assert_eq!(state["branches"][1]["begin_s"], json!(1.0));
        assert_eq!(
            state["branches"][1]["file"],
            json!(path.display().to_string())
        );

        let compared = ask(control, "compare", json!({ "one": 0, "other": 1 })).unwrap();
        let futures = &compared["futures"];
        assert_eq!(futures["window_s"], json!([1.0, 1.5]));
        let pairs = futures["pairs"].as_array().unwrap();
        assert!(pairs.len() >= 4, "{pairs:?}");
        let moved = |pair: &Value| {
            let at = &pair["touch_down_s"];
            at[1].as_f64().unwrap() - at[0].as_f64().unwrap()
        };
        // Up to the change they are the same, and a slower frequency lets steps be later.
        assert_eq!(moved(&pairs[0]), 0.0);
        assert!(moved(&pairs[pairs.len() - 1]) > 0.005, "{pairs:?}");
        let same = ask(control, "compare", json!({ "one": 1, "other": 1 })).unwrap();
        let same = same["futures"]["pairs"].as_array().unwrap();
        assert!(same.iter().all(|pair| moved(pair) == 0.0));
    });
}

/// Files of an earlier session are not replaced.
#[test]
fn files_of_earlier_sessions_stay() {
    let registry = Registry::standard();
    let assembly = assembly(&registry);
    let folder = Folder::new("earlier");
    let written = || {
        let session = Session::new(&assembly, SNAPSHOT_BYTES).unwrap();
        let mut control = Control::new(session, folder.path());
        let set = json!({ "variable": "frequency", "value": 3.2 });
        ask(&mut control, "set", set).unwrap();
        control.advance(ms(100), &mut ());
        control.write_branches().unwrap()
    };
    assert_eq!(written(), [folder.path().join("trot-0.toml")]);
    let other = folder.path().join("trot-fast-7.toml");
    std::fs::write(&other, "").unwrap();
    assert_eq!(written(), [folder.path().join("trot-1.toml")]);
    assert_eq!(std::fs::read(&other).unwrap(), b"");
}

#[test]
fn sets_are_saved_and_recalled() {
    with_control("recalled", |control, folder| {
        let values = |control: &Control<'_>| {
            let variables = control.session().variables().iter();
            variables.map(ProcessVariable::value).collect::<Vec<_>>()
        };
        let before = values(control);
        ask(control, "save", json!({ "name": "fast" })).unwrap();
        assert!(folder.join("sets/fast.toml").is_file());
        assert_eq!(control.state()["sets"], json!(["fast"]));
        let set = json!({ "variable": "frequency", "value": 3.0 });
        ask(control, "set", set).unwrap();
        control.advance(ms(1600), &mut ());
        assert_ne!(values(control), before);
        ask(control, "recall", json!({ "name": "fast" })).unwrap();
        control.advance(ms(1700), &mut ());
        assert_eq!(values(control), before);
        let none = ask(control, "recall", json!({ "name": "slow" })).unwrap_err();
        assert!(none.contains("slow.toml"), "{none}");
    });
}

/// A rate of half of the default value per second: 0.2 s change a tenth of it.
#[test]
fn rate_limit_is_in_default_values_per_second() {
    with_control("rate", |control, _| {
        ask(control, "slew", json!({ "rate": 0.5 })).unwrap();
        let frequency = |control: &Control<'_>| {
            let variables = control.session().variables().iter();
            let mut variables = variables.filter(|it| it.name() == "frequency");
            variables
                .next()
                .map(|it| (it.value(), it.default()))
                .unwrap()
        };
        let (start, default) = frequency(control);
        let set = json!({ "variable": "frequency", "value": start + default });
        ask(control, "set", set).unwrap();
        control.advance(ms(1700), &mut ());
        let (value, _) = frequency(control);
        let period = control.session().rig().period().as_secs_f64();
        let change = (value - start) / default;
        assert!((change - 0.1).abs() <= 0.5 * period + 1e-9, "{change}");
    });
}

#[test]
fn refusals_are_responses_and_are_shown() {
    with_control("refusals", |control, _| {
        for (service, body, why) in [
            (
                "seek",
                json!({ "at_s": -1.0 }),
                "-1 s is no instant of a run",
            ),
            (
                "seek",
                json!({ "at_s": 3.0 }),
                "after the end of the scenario",
            ),
            (
                "speed",
                json!({ "factor": -1.0 }),
                "a speed of -1 is not from 0 to 1000",
            ),
            (
                "slew",
                json!({ "rate": -0.5 }),
                "-0.5 is no rate of a change",
            ),
            (
                "branch",
                json!({ "number": 3, "at_s": null }),
                "there is no branch 3",
            ),
            (
                "compare",
                json!({ "one": 0, "other": 2 }),
                "there is no branch 2",
            ),
            ("save", json!({ "name": "../fast" }), "is no name of a set"),
            (
                "set",
                json!({ "variable": "frequency", "value": -1.0 }),
                "is not in [0, ∞[",
            ),
        ] {
            let refused = ask(control, service, body).unwrap_err();
            assert!(refused.contains(why), "{refused}");
            assert_eq!(control.state()["message"], json!(refused));
        }
        assert_eq!(control.session().branches().len(), 1);
        assert_eq!(control.session().now(), ms(1500));
        control.advance(ms(2000), &mut ());
        assert_eq!(
            ask(control, "play", json!({})).unwrap_err(),
            "the scenario has ended; go back first"
        );
        assert_eq!(control.state()["ended"], "the scenario has ended");
    });
}

/// Each name of a service is one of a request.
#[test]
fn requests_have_the_names_of_the_services() {
    for service in SERVICES {
        let read = serde_json::from_value::<Request>(json!({ "service": service }));
        // It may lack a field.
        let error = read.map_or_else(|error| error.to_string(), |_| String::new());
        assert!(!error.contains("unknown variant"), "{error}");
    }
    let unknown = serde_json::from_value::<Request>(json!({ "service": "stop" }));
    assert!(unknown.unwrap_err().to_string().contains("unknown variant"));
}
