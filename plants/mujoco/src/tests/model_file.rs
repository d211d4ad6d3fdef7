//! User-defined models against closed forms, against MuJoCo's own step, and against each other.

use std::path::{Path, PathBuf};

use proptest::prelude::*;
use twinrig_kernel::{Direction, SimDuration, SimTime, Unit};
use twinrig_mujoco::model_file::{
    BoundModel, ElementKind, Input, Leg, Mjcf, ModelFile, ModelFileError, ModelSignals, Output,
    Place, SignalError,
};
use twinrig_mujoco::mujoco_rs::prelude::{MjData, MjModel};
use twinrig_runtime::Plant;
use twinrig_testing::folder::Folder;

const STEP: SimDuration = SimDuration::from_millis(1);

fn pup() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenarios/models/pup.xml")
}

/// Compiles the model `text` from a file in a separate folder.
fn model(name: &str, text: &str) -> ModelFile {
    let folder = Folder::new(name);
    let path = folder.file("model.xml", text);
    ModelFile::read(Path::new(&path)).unwrap()
}

fn output(signal: &str, thing: ElementKind, name: &str) -> Output {
    Output {
        signal: signal.to_owned(),
        thing,
        name: name.to_owned(),
        word: None,
        unit: None,
    }
}

fn input(signal: &str, actuator: &str) -> Input {
    Input {
        signal: signal.to_owned(),
        actuator: actuator.to_owned(),
        unit: None,
    }
}

fn bind(file: ModelFile, inputs: Vec<Input>, outputs: Vec<Output>) -> BoundModel {
    let signals = ModelSignals {
        keyframe: None,
        inputs,
        outputs,
    };
    BoundModel::new(file, &signals).unwrap()
}

fn build(bound: &BoundModel) -> Mjcf {
    bound.plant(None, &|_| true).unwrap()
}

fn at(nanos: u64) -> SimTime {
    SimTime::ZERO + SimDuration::from_nanos(nanos)
}

fn outputs(plant: &mut Mjcf) -> Vec<f64> {
    let ports = plant.ports();
    let sizes = ports
        .iter()
        .filter(|port| port.direction == Direction::Output);
    let mut outputs = vec![0.0; sizes.map(|port| port.size).sum()];
    plant.observe(&mut outputs);
    outputs
}

/// Returns the values of an output.
fn read(plant: &mut Mjcf, signal: &str) -> Vec<f64> {
    let all = outputs(plant);
    let mut start = 0;
    for port in plant.ports() {
        if port.direction == Direction::Input {
            continue;
        }
        if port.name == signal {
            return all[start..start + port.size].to_vec();
        }
        start += port.size;
    }
    panic!("no {signal}");
}

/// Returns the model of a ball above a plane, at this height.
fn ball(height: f64) -> String {
    format!(
        r#"<mujoco><option timestep="0.001"/><worldbody>
  <geom name="ground" type="plane" size="1 1 0.1"/>
  <body name="ball" pos="0 0 {height}"><freejoint/>
    <geom name="skin" type="sphere" size="0.1" mass="0.5"/><site name="middle" size="0.11"/>
  </body>
</worldbody>
<sensor><touch name="touch" site="middle"/><clock name="clock"/></sensor></mujoco>"#
    )
}

fn ball_outputs() -> Vec<Output> {
    let mut load = output("touch/load", ElementKind::Sensor, "touch");
    load.unit = Some(Unit::Newton);
    vec![
        output("body/position", ElementKind::Body, "ball"),
        output("body/velocity", ElementKind::Body, "ball"),
        output("leg/B/foot/load", ElementKind::Geom, "skin"),
        output("leg/B/foot/force", ElementKind::Body, "ball"),
        load,
        output("clock", ElementKind::Sensor, "clock"),
    ]
}

#[test]
fn free_fall_agrees_with_the_integrator_and_its_residual_is_exact() {
    let bound = bind(model("falls", &ball(10.0)), Vec::new(), ball_outputs());
    let mut plant = build(&bound);
    plant.advance(at(500_000_000), &[]).unwrap();
    // Semi-implicit Euler: after n steps of h the velocity is -g n h, the displacement -g h² n (n +
    // 1) / 2.
    let (n, h, g) = (500.0, 1e-3, 9.81);
    let z = read(&mut plant, "body/position")[2];
    assert!(
        (z - (10.0 - g * h * h * n * (n + 1.0) / 2.0)).abs() < 1e-12,
        "{z}"
    );
    let v = read(&mut plant, "body/velocity")[2];
    assert!((v + g * n * h).abs() < 1e-12, "{v}");
    let balance = plant.energy();
    assert!((balance.kinetic - 0.25 * v * v).abs() < 1e-12);
    assert!((balance.gravity - 0.5 * g * z).abs() < 1e-12);
    // The excess displacement g h² n / 2 is work of gravity that remains in the residual.
    let missing = 0.5 * g * g * h * h * n / 2.0;
    assert!(
        (balance.residual + missing).abs() < 1e-10,
        "{} of {missing}",
        balance.residual
    );
}

#[test]
fn resting_load_equals_the_weight_by_geom_body_and_sensor() {
    let bound = bind(model("rests", &ball(0.1)), Vec::new(), ball_outputs());
    assert!((bound.weight() - 0.5 * 9.81).abs() < 1e-12);
    let mut plant = build(&bound);
    assert_eq!(
        read(&mut plant, "leg/B/foot/load"),
        [0.0],
        "mean over an empty window"
    );
    plant.advance(at(2_000_000_000), &[]).unwrap();
    plant.begin_window();
    plant.advance(at(2_100_000_000), &[]).unwrap();
    let weight = 0.5 * 9.81;
    // Two seconds are some hundred time constants of the contact.
    for (signal, axis) in [
        ("leg/B/foot/load", 0),
        ("leg/B/foot/force", 2),
        ("touch/load", 0),
    ] {
        let load = read(&mut plant, signal)[axis];
        assert!((load / weight - 1.0).abs() < 1e-6, "{signal}: {load}");
    }
    let depth = plant.constraint_violation().unwrap();
    let z = read(&mut plant, "body/position")[2];
    assert!(depth > 0.0 && (depth - (0.1 - z)).abs() < 1e-12, "{depth}");
}

#[test]
fn mean_force_equals_the_change_of_momentum() {
    let bound = bind(model("lands", &ball(0.15)), Vec::new(), ball_outputs());
    let mut plant = build(&bound);
    let (mut before, mut max_force) = (0.0, 0.0_f64);
    for k in 1..=200 {
        plant.begin_window();
        // Windows of two and a half steps, so that steps are shorter than the model's own.
        plant.advance(at(2_500_000 * k), &[]).unwrap();
        let v = read(&mut plant, "body/velocity")[2];
        let force = read(&mut plant, "leg/B/foot/force")[2];
        let change = 0.5 * ((v - before) / 2.5e-3 + 9.81);
        assert!(
            (force - change).abs() < 1e-9 * change.abs().max(1.0),
            "{k}: {force} {change}"
        );
        (before, max_force) = (v, max_force.max(force));
    }
    assert!(max_force > 20.0, "no landing: {max_force} N");
}

#[test]
fn work_of_a_motor_is_torque_times_angle() {
    let text = r#"<mujoco><option timestep="0.001" gravity="0 0 0"/><worldbody><body name="disc">
  <joint name="axle" axis="0 0 1"/><geom type="cylinder" size="0.1 0.01" mass="1"/>
</body></worldbody><actuator><motor name="motor" joint="axle"/></actuator></mujoco>"#;
    let outs = vec![
        output("axle/position", ElementKind::Joint, "axle"),
        output("axle/rate", ElementKind::Joint, "axle"),
        output("axle/torque", ElementKind::Actuator, "motor"),
    ];
    let bound = bind(
        model("motor", text),
        vec![input("motor/torque", "motor")],
        outs,
    );
    let mut plant = build(&bound);
    let port = plant.ports()[0].clone();
    assert_eq!((port.unit, port.size), (Unit::NewtonMeter, 1));
    plant.advance(at(1_000_000_000), &[0.02]).unwrap();
    // Moment of inertia of a disc: m r² / 2.
    let inertia = 0.5 * 0.01;
    let rate = read(&mut plant, "axle/rate")[0];
    assert!((rate - 0.02 / inertia).abs() < 1e-9, "{rate}");
    assert_eq!(read(&mut plant, "axle/torque"), [0.02]);
    let balance = plant.energy();
    assert!((balance.actuator - 0.5 * inertia * rate * rate).abs() < 1e-12);
    assert!(balance.residual.abs() < 1e-14, "{}", balance.residual);
}

/// Returns the signals of the pup with all joints, feet and drives.
fn pup_signals(keyframe: Option<&str>) -> ModelSignals {
    let mut signals = ModelSignals {
        keyframe: keyframe.map(str::to_owned),
        ..ModelSignals::default()
    };
    signals
        .outputs
        .push(output("body/position", ElementKind::Body, "trunk"));
    signals
        .outputs
        .push(output("body/rpy", ElementKind::Body, "trunk"));
    for leg in ["lf", "rf", "rh", "lh"] {
        let name = leg.to_uppercase();
        for joint in ["hip", "knee"] {
            let element = format!("{leg}_{joint}");
            let signal = |what: &str| format!("leg/{name}/{joint}/{what}");
            signals
                .outputs
                .push(output(&signal("position"), ElementKind::Joint, &element));
            signals
                .outputs
                .push(output(&signal("torque"), ElementKind::Actuator, &element));
            signals.inputs.push(input(&signal("command"), &element));
        }
        let foot = |what: &str| format!("leg/{name}/foot/{what}");
        signals.outputs.push(output(
            &foot("load"),
            ElementKind::Geom,
            &format!("{leg}_foot"),
        ));
        signals.outputs.push(output(
            &foot("position"),
            ElementKind::Site,
            &format!("{leg}_toe"),
        ));
    }
    signals
}

fn bound_pup() -> BoundModel {
    let file = ModelFile::read(&pup()).unwrap();
    BoundModel::new(file, &pup_signals(Some("crouched"))).unwrap()
}

/// Returns the `k`th commands of the drives.
fn commands(k: u64) -> [f64; 8] {
    std::array::from_fn(|i| {
        let phase = 0.3 * k as f64 + i as f64;
        0.4 + 0.4 * (i % 2) as f64 + 0.1 * libm::sin(phase)
    })
}

#[test]
fn legs_and_weight_are_those_of_the_model() {
    let bound = bound_pup();
    let leg = |name: &str, fore, left| Leg {
        name: name.to_owned(),
        fore,
        left,
    };
    let legs = [
        leg("LF", true, true),
        leg("RF", true, false),
        leg("RH", false, false),
        leg("LH", false, true),
    ];
    assert_eq!(bound.legs(), legs);
    // Trunk, thighs, shanks, feet.
    let mass = 2.0 + 4.0 * (0.1 + 0.05 + 0.01);
    assert!(
        (bound.weight() - 9.81 * mass).abs() < 1e-9,
        "{}",
        bound.weight()
    );
}

#[test]
fn steps_equal_those_of_mujoco_bit_for_bit() {
    let mut plant = build(&bound_pup());
    let model = MjModel::from_xml(pup()).unwrap();
    let mut plain = MjData::new(&model);
    plain.reset_keyframe(0).unwrap();
    for k in 1..=300 {
        let commands = commands(k / 5);
        plain.ctrl_mut().copy_from_slice(&commands);
        plain.step();
        plant.advance(at(k * 1_000_000), &commands).unwrap();
        let height = read(&mut plant, "body/position")[2];
        let knee = read(&mut plant, "leg/RH/knee/position");
        // The trunk's frame is at its centre of mass; a free joint has seven coordinates.
        assert_eq!(
            (height, knee[0]),
            (plain.qpos()[2], plain.qpos()[12]),
            "{k}"
        );
    }
}

#[test]
fn servos_hold_the_reference_pose_without_a_keyframe() {
    let file = ModelFile::read(&pup()).unwrap();
    let plant = build(&BoundModel::new(file, &pup_signals(None)).unwrap());
    let mut first = [9.0; 8];
    plant.initial_inputs(&mut first);
    assert_eq!(first, [0.0; 8]);
    let mut commands = [9.0; 8];
    build(&bound_pup()).initial_inputs(&mut commands);
    assert_eq!(commands, [0.4, 0.8, 0.4, 0.8, 0.4, 0.8, 0.4, 0.8]);
}

#[test]
fn non_finite_control_is_a_fault_that_names_its_actuator() {
    let mut plant = build(&bound_pup());
    let mut inputs = commands(0);
    inputs[3] = f64::NAN;
    let fault = plant.advance(at(5_000_000), &inputs).unwrap_err();
    assert_eq!(fault.time, SimTime::ZERO);
    assert!(fault.why.contains("rf_knee"), "{fault}");
}

#[test]
fn compiled_model_runs_identically_and_other_bytes_are_refused() {
    let binary = bound_pup().file().binary();
    let again = ModelFile::of_binary(&binary).unwrap();
    let again = BoundModel::new(again, &pup_signals(Some("crouched"))).unwrap();
    let run = |mut plant: Mjcf| {
        for k in 1..=100 {
            plant.advance(at(k * 2_000_000), &commands(k)).unwrap();
        }
        plant.save()
    };
    assert_eq!(run(build(&bound_pup())), run(build(&again)));
    let refused = |bytes: &[u8]| matches!(ModelFile::of_binary(bytes), Err(ModelFileError::Binary));
    assert!(refused(b"") && refused(&binary[..100]) && refused(&binary[..binary.len() - 1]));
    let mut damaged = binary;
    let middle = damaged.len() / 2;
    damaged[middle] ^= 1;
    assert!(refused(&damaged));
}

#[test]
fn includes_are_relative_to_the_model_and_part_of_its_binary() {
    let folder = Folder::new("includes");
    let corners = ["0 0 0", "0.1 0 0", "0 0.1 0", "0 0 0.1"].map(|at| format!("v {at}\n"));
    let faces = "f 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";
    folder.file("parts/corner.obj", &(corners.concat() + faces));
    let body = r#"<mujocoinclude><body name="corner"><freejoint/><geom type="mesh" mesh="corner" density="1000"/></body></mujocoinclude>"#;
    folder.file("parts/body.xml", body);
    let text = r#"<mujoco><compiler meshdir="parts"/><asset><mesh name="corner" file="corner.obj"/></asset>
<worldbody><include file="parts/body.xml"/></worldbody></mujoco>"#;
    let path = folder.file("model.xml", text);
    let file = ModelFile::read(Path::new(&path)).unwrap();
    let outs = || vec![output("body/position", ElementKind::Body, "corner")];
    let weight = bind(file, Vec::new(), outs()).weight();
    // A corner of a cube of 10 cm: a sixth of a litre of water.
    assert!((weight - 9.81 / 6.0).abs() < 1e-6, "{weight}");
    let binary = ModelFile::read(Path::new(&path)).unwrap().binary();
    drop(folder);
    let kept = bind(ModelFile::of_binary(&binary).unwrap(), Vec::new(), outs());
    assert_eq!(kept.weight(), weight);
}

/// Returns place and reason of the only mismatch.
fn refused(change: impl FnOnce(&mut ModelSignals)) -> (usize, bool, Place, SignalError) {
    let mut signals = pup_signals(None);
    change(&mut signals);
    match BoundModel::new(ModelFile::read(&pup()).unwrap(), &signals) {
        Err(ModelFileError::Signals(mismatches)) => match &mismatches[..] {
            [one] => (one.index, one.input, one.place, one.why.clone()),
            more => panic!("{more:?}"),
        },
        Err(other) => panic!("{other}"),
        Ok(_) => panic!("the signals were accepted"),
    }
}

#[test]
fn mismatched_signal_is_refused_at_its_place() {
    let (index, input, place, why) =
        refused(|signals| signals.inputs[2].actuator = "rf_hipp".to_owned());
    assert_eq!((index, input, place), (2, true, Place::ElementKind));
    let SignalError::Unknown { thing, known, .. } = why else {
        panic!("{why}");
    };
    assert_eq!((thing, known.len()), (ElementKind::Actuator, 8));

    let rename = |signal: &str| {
        let signal = signal.to_owned();
        refused(move |signals| signals.outputs[0].signal = signal)
    };
    assert!(matches!(
        rename("body/colour"),
        (0, false, Place::Signal, SignalError::Word { .. })
    ));
    assert!(matches!(
        rename("body//position"),
        (0, false, Place::Signal, SignalError::Name { .. })
    ));
    assert!(matches!(
        rename("energy/kinetic"),
        (0, false, Place::Signal, SignalError::Taken { .. })
    ));

    let (.., place, why) = refused(|signals| signals.outputs[0].word = Some("load".to_owned()));
    assert_eq!(place, Place::Signal);
    assert!(matches!(why, SignalError::Standard { .. }), "{why}");

    let (.., place, why) = refused(|signals| signals.inputs[0].unit = Some(Unit::NewtonMeter));
    let (known, wanted) = (Unit::Radian, Unit::NewtonMeter);
    assert_eq!(
        (place, why),
        (Place::Unit, SignalError::Unit { known, wanted })
    );

    let (index, .., why) = refused(|signals| signals.inputs[1].actuator = "lf_hip".to_owned());
    assert!(
        index == 1 && matches!(why, SignalError::Driven { .. }),
        "{why}"
    );

    let missing = BoundModel::new(
        ModelFile::read(&pup()).unwrap(),
        &pup_signals(Some("sitting")),
    );
    let Err(ModelFileError::Keyframe { known, .. }) = missing else {
        panic!("there is no such keyframe");
    };
    assert_eq!(known, ["crouched"]);
}

#[test]
fn invalid_model_file_is_refused_with_its_line() {
    let folder = Folder::new("refused");
    let text = "<mujoco>\n<worldbody>\n<bodi/>\n</worldbody></mujoco>";
    let path = folder.file("model.xml", text);
    let refused = ModelFile::read(Path::new(&path)).err();
    let why = refused.unwrap().to_string();
    assert!(why.contains("bodi") && why.contains("line 3"), "{why}");
    assert!(ModelFile::read(&folder.path().join("none.xml")).is_err());
    assert!(matches!(
        ModelFile::read(Path::new("a\0b")),
        Err(ModelFileError::Path)
    ));
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 24, ..ProptestConfig::default() })]

    /// At any instants, also between the model's steps, observations do not change the state, and a
    /// plant restored from a snapshot continues bit for bit.
    #[test]
    fn observing_saving_and_restoring_change_nothing(
        pieces in prop::collection::vec(1_u64..4_000_000, 2..40),
        cut in 0_usize..40,
    ) {
        let bound = bound_pup();
        let (mut observed, mut unobserved) = (build(&bound), build(&bound));
        let mut now = 0;
        for (k, piece) in pieces.iter().enumerate() {
            now += piece;
            let commands = commands(k as u64 / 2);
            observed.advance(at(now), &commands).unwrap();
            unobserved.advance(at(now), &commands).unwrap();
            let outputs_observed = outputs(&mut observed);
            observed.energy();
            if k == cut {
                let mut other = build(&bound);
                other.advance(at(1_000_000), &commands).unwrap();
                other.restore(&unobserved.save()).unwrap();
                prop_assert_eq!(&outputs(&mut other), &outputs_observed);
                unobserved = other;
            }
        }
        prop_assert_eq!(observed.save(), unobserved.save());
        prop_assert_eq!(outputs(&mut observed), outputs(&mut unobserved));
    }
}

#[test]
fn snapshot_of_another_model_or_other_outputs_is_refused() {
    let mut pup = build(&bound_pup());
    let ball = bind(model("snapshot", &ball(1.0)), Vec::new(), ball_outputs());
    assert!(pup.restore(&build(&ball).save()).is_err());
    let bare = bound_pup().plant(None, &|_| false).unwrap();
    assert!(pup.restore(&bare.save()).is_err());
}

#[test]
fn plant_reaches_the_requested_time_with_steps_within_the_limit() {
    let bound = bind(model("clock", &ball(10.0)), Vec::new(), ball_outputs());
    let mut plant = bound.plant(Some(STEP), &|_| true).unwrap();
    plant.advance(at(3_400_000), &[]).unwrap();
    assert_eq!(plant.work().steps, 4, "of 0.85 ms each");
    assert!((read(&mut plant, "clock")[0] - 3.4e-3).abs() < 1e-15);
}
