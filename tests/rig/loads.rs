//! Loads that the controller with feedback reads: of the plant, of force sensors, and estimates of
//! tactile sensors.

use std::fmt::Write as _;
use std::sync::atomic::{AtomicUsize, Ordering};

use twinrig::{Assembly, Error, Registry};
use twinrig_kernel::SimTime;
use twinrig_runtime::{Group, Observer, RunEvent};

const LEGS: [&str; 4] = ["LF", "RF", "LH", "RH"];

/// Scenario of a robot that walks in place by the true load, with these keys of the controller and
/// buses.
fn scenario(controller: &str, buses: &str) -> String {
    format!(
        "robot = 'cheetah-cub'
        duration = '1 s'
        plant = {{ model = 'massless', ground = {{}} }}
        [controller]
        kind = 'tegotae'
        period = '2 ms'
        step_length = '0 m'
        {controller}
        {buses}
        [[expect]]
        body = {{ fall = false }}"
    )
}

/// Buses of one kind, one for each leg, with `*` for its name.
fn buses(of_leg: &str) -> String {
    LEGS.into_iter().fold(String::new(), |mut all, leg| {
        let _ = writeln!(all, "[[bus]]\n{}", of_leg.replace('*', leg));
        all
    })
}

/// Reads a scenario from a temporary file, since only a file can name the file of a sensor.
fn assembly<'r>(registry: &'r Registry, text: &str) -> Result<Assembly<'r>, Error> {
    static FILES: AtomicUsize = AtomicUsize::new(0);
    let number = FILES.fetch_add(1, Ordering::Relaxed);
    let name = format!("twinrig-loads-{}-{number}.toml", std::process::id());
    let path = std::env::temp_dir().join(name);
    std::fs::write(
        &path,
        text.replace("ROOT", concat!(env!("CARGO_MANIFEST_DIR"), "/..")),
    )
    .unwrap();
    let assembly = Assembly::builder(registry).file(&path);
    std::fs::remove_file(&path).unwrap();
    assembly
}

/// Sums of the inputs of the controller, and the last of its outputs.
#[derive(Default)]
struct Signals {
    inputs: Vec<f64>,
    outputs: Vec<f64>,
}

impl Observer for Signals {
    fn samples(&mut self, _: SimTime, group: Group, values: &[f64]) {
        match group {
            Group::ProcessInputs => {
                self.inputs.resize(values.len(), 0.0);
                for (sum, value) in self.inputs.iter_mut().zip(values) {
                    *sum += value;
                }
            }
            Group::ProcessOutputs => self.outputs = values.to_vec(),
            _ => {}
        }
    }

    fn event(&mut self, _: SimTime, _: RunEvent) {}
}

/// Mean load of all legs as read by the controller \[N\], and the last phases.
fn run(text: &str, component: usize, size: usize) -> (f64, Vec<f64>) {
    let registry = Registry::standard();
    let assembly = assembly(&registry, text).unwrap_or_else(|error| panic!("{error}"));
    let mut rig = assembly.rig().unwrap_or_else(|error| panic!("{error}"));
    let mut signals = Signals::default();
    rig.run_until(SimTime::from_nanos(1_000_000_000), &mut signals)
        .unwrap();
    let loads = signals.inputs.chunks(size).map(|signal| signal[component]);
    let phases = signals.outputs[8..].to_vec();
    (loads.sum::<f64>() / 501.0, phases)
}

#[test]
fn controller_reads_its_load_from_any_source() {
    let tactile = buses(
        "kind = 'tactile'\nname = 'tactile-*'\nsignal = 'leg/*/foot/load'\nsensor = 'ROOT/benches/tactile.toml'\n\
         filter.estimate = { model = 'F3', white = 1e13, piezoresistive = { noise = '5 mV', \
         loading = { base = '0.97 V', rise = '1.965 V', mid = '5.13 N', width = '2.056 N' }, \
         unloading = { base = '0.97 V', rise = '1.965 V', mid = '4.59 N', width = '2.056 N' }, switch = '10 N/s' }, \
         piezoelectric = { noise = '2 mV', gain = '0.05 V·s/N', amplifier_time = '100 ms', silicone_time = '5 ms' } }",
    );
    let force = buses(
        "kind = 'optoforce'\nname = 'force-*'\nsignal = 'leg/*/foot/force'\nspeed = '1000 Hz'\nfilter = '500 Hz'\nrange = '50 N'",
    );
    let cases = [
        ("", String::new(), 0, 1),
        (
            "load = 'leg/*/foot/force'\nload_component = 'z'",
            String::new(),
            2,
            3,
        ),
        ("load = 'force-*/force'\nload_component = 'z'", force, 2, 3),
        ("load = 'leg/*/foot/load/estimate'", tactile, 0, 1),
    ];
    let (_, without_feedback) = run(
        &scenario("phase_output = true\nfeedback = '0 rad/(N·s)'", ""),
        0,
        1,
    );
    for (keys, buses, component, size) in cases {
        let text = scenario(&format!("phase_output = true\n{keys}"), &buses);
        let (load, phases) = run(&text, component, size);
        // The robot weighs 10.8 N.
        assert!((load - 10.8).abs() < 1.0, "{keys}: {load}");
        for (leg, (found, free)) in phases.iter().zip(&without_feedback).enumerate() {
            assert!((found - free).abs() > 0.05, "{keys}: {leg} {found} {free}");
        }
    }
}

#[test]
fn leg_without_its_load_is_an_error_with_near_misses() {
    let registry = Registry::standard();
    let mount =
        "kind = 'tactile'\nsignal = 'leg/LF/foot/load'\nsensor = 'ROOT/benches/tactile.toml'";
    let text = scenario(
        "load = 'leg/*/foot/load/reference'",
        &format!("[[bus]]\n{mount}"),
    );
    let error = assembly(&registry, &text).and_then(|assembly| assembly.rig().map(drop));
    let error = error.unwrap_err().to_string();
    assert!(
        error.contains("nothing provides `leg/RF/foot/load/reference [N]`"),
        "{error}"
    );
    let text = scenario("load = 'leg/*/foot/lood'", "");
    let error = assembly(&registry, &text).and_then(|assembly| assembly.rig().map(drop));
    let error = error.unwrap_err().to_string();
    assert!(error.contains("there is `leg/LF/foot/load [N]`"), "{error}");
}

/// Parts of a scenario on which its gait depends, without the source of the loads.
fn gait(name: &str) -> toml::Table {
    let path = format!("{}/../scenarios/{name}", env!("CARGO_MANIFEST_DIR"));
    let mut parts: toml::Table = std::fs::read_to_string(path).unwrap().parse().unwrap();
    parts.retain(|key, _| {
        [
            "robot",
            "duration",
            "seed",
            "plant",
            "actuator",
            "controller",
        ]
        .contains(&key)
    });
    let controller = parts["controller"].as_table_mut().unwrap();
    controller.retain(|key, _| !["load", "load_component"].contains(&key));
    parts
}

#[test]
fn scenarios_on_true_measured_and_estimated_loads_have_the_same_gait() {
    let gaits = [
        "tegotae-trot.toml",
        "tegotae-force.toml",
        "tegotae-tactile.toml",
    ]
    .map(gait);
    assert_eq!(gaits[0].len(), 6);
    for other in &gaits[1..] {
        assert_eq!(&gaits[0], other);
    }
}
