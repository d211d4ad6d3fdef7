//! A small synthetic run for the tests of recordings.
#![allow(dead_code, reason = "no test file uses all of it")]

use twinrig_kernel::{Direction, Layout, Port, SimDuration, SimTime, Unit};
use twinrig_record::{
    Cadence, Fingerprint, FootstepMessage, RecordError, RecordedGroup, Recorder, Recording,
    RunInfo, Skeleton, SkeletonLeg,
};
use twinrig_runtime::{Group, Observer, RunEvent};

pub fn plant_ports() -> Vec<Port> {
    vec![
        Port::output("body/position", Unit::Meter, 3),
        Port::output("body/orientation", Unit::One, 4),
        Port::output("leg/LF/angles", Unit::Radian, 3),
        Port::output("leg/LF/foot/load", Unit::Newton, 1),
        Port::output("body/velocity", Unit::MeterPerSecond, 3),
        Port::output("body/angular_velocity", Unit::RadianPerSecond, 3),
        Port::output("leg/LF/hip/position", Unit::Radian, 1),
        Port::output("leg/LF/hip/torque", Unit::NewtonMeter, 1),
    ]
}

pub fn layout(ports: &[Port]) -> Layout {
    Layout::of(ports, Direction::Output)
}

pub fn info() -> RunInfo {
    RunInfo {
        files: vec![
            ("scenario.toml".to_owned(), b"name = \"test\"\n".to_vec()),
            (
                "cheetah-cub.toml".to_owned(),
                b"name = \"cheetah-cub\"\n".to_vec(),
            ),
        ],
        description: "<robot/>".to_owned(),
        seed: 7,
        build: "0.1.0 (abc)".to_owned(),
        notes: [("plant".to_owned(), "massless".to_owned())].into(),
        tasks: vec!["direct".to_owned()],
        traces: vec!["sbcp/out".to_owned(), "left bus/2".to_owned()],
        variables: vec!["frequency".to_owned(), "step_length".to_owned()],
    }
}

pub fn skeleton() -> Skeleton {
    let leg = SkeletonLeg {
        name: "LF".to_owned(),
        hip: [0.1, 0.05, 0.0],
        segments: [0.044, 0.071, 0.039],
        reference: [0.0; 3],
        abduction: None,
    };
    Skeleton { legs: vec![leg] }
}

pub fn cadence() -> Cadence {
    Cadence {
        flush: SimDuration::from_millis(20),
        ..Cadence::default()
    }
}

pub const PERIOD_NS: u64 = 2_000_000;

/// Plant signals at `step`.
pub fn plant_values(step: u64) -> Vec<f64> {
    let t = step as f64 * 2e-3;
    let mut values = vec![
        0.3 * t,
        1e-3 * libm::sin(9.0 * t),
        0.14,
        1.0,
        0.0,
        -0.0,
        0.0,
    ];
    values.extend([
        0.5 * libm::sin(19.0 * t),
        -0.4,
        0.5,
        2.7 + libm::cos(19.0 * t),
    ]);
    values.extend([0.3, 9e-3 * libm::cos(9.0 * t), 0.0, 0.01, -0.02, 0.03]);
    values.extend([0.45 * libm::sin(19.0 * t), -0.2]);
    values
}

pub fn command_values(step: u64) -> Vec<f64> {
    vec![0.4 * libm::sin(0.038 * step as f64)]
}

pub fn footstep(step: u64) -> FootstepMessage {
    let t = step as f64 * 2e-3;
    FootstepMessage {
        leg: "LF".to_owned(),
        touch_down_s: t - 0.15,
        lift_off_s: t,
        position_m: Some([0.3 * t, 0.05, 0.0]),
        slip_m: 1e-4 / (1.0 + t),
        impulse_ns: 0.7,
        peak_load_n: 5.0 + t,
    }
}

/// Records `steps` samples; `change` may modify samples, `keep` selects the recorded signals of the
/// plant.
pub fn record<W: std::io::Write>(
    out: W,
    steps: u64,
    keep: &dyn Fn(&str) -> bool,
    change: &dyn Fn(Group, u64, &mut [f64]),
) -> Result<W, RecordError> {
    let plant = layout(&plant_ports());
    let commands = layout(&[Port::output("leg/LF/hip/command", Unit::Radian, 1)]);
    let groups = [
        RecordedGroup {
            group: Group::Plant,
            layout: &plant,
            keep,
        },
        RecordedGroup {
            group: Group::ProcessOutputs,
            layout: &commands,
            keep: &|_| true,
        },
    ];
    let mut recorder = Recorder::new(out, &info(), &groups, &skeleton(), cadence())?;
    let mut fingerprint = Fingerprint::new();
    for step in 0..steps {
        let now = SimTime::from_nanos(step * PERIOD_NS);
        let mut values = plant_values(step);
        change(Group::Plant, step, &mut values);
        fingerprint.samples(now, Group::Plant, &values);
        recorder.samples(now, Group::Plant, &values);
        let mut commands = command_values(step);
        change(Group::ProcessOutputs, step, &mut commands);
        recorder.samples(now, Group::ProcessOutputs, &commands);
        recorder.event(now, RunEvent::ProcessEnd);
        if step == 40 {
            recorder.event(
                now,
                RunEvent::Change {
                    variable: 1,
                    value: 0.11,
                },
            );
            recorder.event(
                now,
                RunEvent::TaskSkipped {
                    task: 0,
                    implied: false,
                },
            );
        }
        if step % 25 == 24 {
            recorder.message(now, &footstep(step));
            recorder.bytes(now, 1, &[step.to_le_bytes()[0], 0, 255]);
        }
    }
    recorder.finish(fingerprint.digest(), SimTime::from_nanos(steps * PERIOD_NS))
}

pub fn recorded(steps: u64) -> Vec<u8> {
    record(Vec::new(), steps, &|_| true, &|_, _, _| ()).expect("writing to memory")
}

pub fn read(bytes: &[u8]) -> Recording {
    Recording::from_bytes(bytes.to_vec()).expect("a recording")
}
