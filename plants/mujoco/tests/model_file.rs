//! Models of one's own against closed forms, against MuJoCo's own step, and against themselves.

use std::fs;
use std::path::{Path, PathBuf};

use proptest::prelude::*;
use twinrig_kernel::{Direction, SimDuration, SimTime, Unit};
use twinrig_mujoco::model_file::{
    BoundModel, ElementKind, Input, Leg, Mjcf, ModelFile, ModelFileError, ModelSignals, Output,
    Place, SignalError,
};
use twinrig_mujoco::mujoco_rs::prelude::{MjData, MjModel};
use twinrig_runtime::Plant;

const STEP: SimDuration = SimDuration::from_millis(1);

fn pup() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenarios/models/pup.xml")
}

/// The model `text`, as it is in a file of a folder of its own.
fn model(name: &str, text: &str) -> ModelFile {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    fs::create_dir_all(&folder).unwrap();
    let path = folder.join("model.xml");
    fs::write(&path, text).unwrap();
    ModelFile::read(&path).unwrap()
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

fn wired(file: ModelFile, inputs: Vec<Input>, outputs: Vec<Output>) -> BoundModel {
    let signals = ModelSignals {
        keyframe: None,
        inputs,
        outputs,
    };
    BoundModel::new(file, &signals).unwrap()
}

fn built(wired: &BoundModel) -> Mjcf {
    wired.plant(None, &|_| true).unwrap()
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

/// The numbers of one output.
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

/// A ball that falls on a plane from so high.
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
fn what_falls_falls_as_the_integrator_says_and_its_books_balance_to_the_last_digits() {
    let wired = wired(model("falls", &ball(10.0)), Vec::new(), ball_outputs());
    let mut plant = built(&wired);
    plant.advance(at(500_000_000), &[]).unwrap();
    // Semi-implicit: after n steps of h the velocity is -g n h, the way -g h² n (n + 1) / 2.
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
    // The way that is fallen too far, g h² n / 2, is work of gravity that no book has.
    let missing = 0.5 * g * g * h * h * n / 2.0;
    assert!(
        (balance.residual + missing).abs() < 1e-10,
        "{} of {missing}",
        balance.residual
    );
}

#[test]
fn what_rests_weighs_what_it_weighs_by_geom_by_body_and_by_sensor() {
    let wired = wired(model("rests", &ball(0.1)), Vec::new(), ball_outputs());
    assert!((wired.weight() - 0.5 * 9.81).abs() < 1e-12);
    let mut plant = built(&wired);
    assert_eq!(
        read(&mut plant, "leg/B/foot/load"),
        [0.0],
        "a mean over no time"
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
fn a_mean_force_is_what_momentum_changes_by() {
    let wired = wired(model("lands", &ball(0.15)), Vec::new(), ball_outputs());
    let mut plant = built(&wired);
    let (mut before, mut heaviest) = (0.0, 0.0_f64);
    for k in 1..=200 {
        plant.begin_window();
        // Windows of two steps and a half: of steps that are shorter than the model's own.
        plant.advance(at(2_500_000 * k), &[]).unwrap();
        let v = read(&mut plant, "body/velocity")[2];
        let force = read(&mut plant, "leg/B/foot/force")[2];
        let change = 0.5 * ((v - before) / 2.5e-3 + 9.81);
        assert!(
            (force - change).abs() < 1e-9 * change.abs().max(1.0),
            "{k}: {force} {change}"
        );
        (before, heaviest) = (v, heaviest.max(force));
    }
    assert!(heaviest > 20.0, "it did land: {heaviest} N");
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
    let wired = wired(
        model("motor", text),
        vec![input("motor/torque", "motor")],
        outs,
    );
    let mut plant = built(&wired);
    let port = plant.ports()[0].clone();
    assert_eq!((port.unit, port.size), (Unit::NewtonMeter, 1));
    plant.advance(at(1_000_000_000), &[0.02]).unwrap();
    // Of a disc: m r² / 2.
    let inertia = 0.5 * 0.01;
    let rate = read(&mut plant, "axle/rate")[0];
    assert!((rate - 0.02 / inertia).abs() < 1e-9, "{rate}");
    assert_eq!(read(&mut plant, "axle/torque"), [0.02]);
    let balance = plant.energy();
    assert!((balance.actuator - 0.5 * inertia * rate * rate).abs() < 1e-12);
    assert!(balance.residual.abs() < 1e-14, "{}", balance.residual);
}

/// The pup with all its joints, feet and drives.
fn pup_wishes(keyframe: Option<&str>) -> ModelSignals {
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
            let called = format!("{leg}_{joint}");
            let signal = |what: &str| format!("leg/{name}/{joint}/{what}");
            signals
                .outputs
                .push(output(&signal("position"), ElementKind::Joint, &called));
            signals
                .outputs
                .push(output(&signal("torque"), ElementKind::Actuator, &called));
            signals.inputs.push(input(&signal("command"), &called));
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

fn wired_pup() -> BoundModel {
    let file = ModelFile::read(&pup()).unwrap();
    BoundModel::new(file, &pup_wishes(Some("crouched"))).unwrap()
}

/// What its drives are told at the `k`th command.
fn commands(k: u64) -> [f64; 8] {
    std::array::from_fn(|i| {
        let phase = 0.3 * k as f64 + i as f64;
        0.4 + 0.4 * (i % 2) as f64 + 0.1 * libm::sin(phase)
    })
}

#[test]
fn legs_and_weight_are_those_of_the_model() {
    let wired = wired_pup();
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
    assert_eq!(wired.legs(), legs);
    // Trunk, thighs, shanks, feet.
    let mass = 2.0 + 4.0 * (0.1 + 0.05 + 0.01);
    assert!(
        (wired.weight() - 9.81 * mass).abs() < 1e-9,
        "{}",
        wired.weight()
    );
}

#[test]
fn its_steps_are_those_of_mujoco_bit_for_bit() {
    let mut plant = built(&wired_pup());
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
        // The trunk's frame is at its centre of mass; a free joint is seven numbers.
        assert_eq!(
            (height, knee[0]),
            (plain.qpos()[2], plain.qpos()[12]),
            "{k}"
        );
    }
}

#[test]
fn with_no_keyframe_servos_hold_the_reference_pose() {
    let file = ModelFile::read(&pup()).unwrap();
    let plant = built(&BoundModel::new(file, &pup_wishes(None)).unwrap());
    let mut first = [9.0; 8];
    plant.first_inputs(&mut first);
    assert_eq!(first, [0.0; 8]);
    let mut held = [9.0; 8];
    built(&wired_pup()).first_inputs(&mut held);
    assert_eq!(held, [0.4, 0.8, 0.4, 0.8, 0.4, 0.8, 0.4, 0.8]);
}

#[test]
fn a_control_that_is_no_number_is_a_fault_that_names_its_actuator() {
    let mut plant = built(&wired_pup());
    let mut inputs = commands(0);
    inputs[3] = f64::NAN;
    let fault = plant.advance(at(5_000_000), &inputs).unwrap_err();
    assert_eq!(fault.time, SimTime::ZERO);
    assert!(fault.why.contains("rf_knee"), "{fault}");
}

#[test]
fn a_compiled_model_goes_the_same_way_and_other_bytes_are_none() {
    let binary = wired_pup().file().binary();
    let again = ModelFile::of_binary(&binary).unwrap();
    let again = BoundModel::new(again, &pup_wishes(Some("crouched"))).unwrap();
    let run = |mut plant: Mjcf| {
        for k in 1..=100 {
            plant.advance(at(k * 2_000_000), &commands(k)).unwrap();
        }
        plant.save()
    };
    assert_eq!(run(built(&wired_pup())), run(built(&again)));
    let refused = |bytes: &[u8]| matches!(ModelFile::of_binary(bytes), Err(ModelFileError::Binary));
    assert!(refused(b"") && refused(&binary[..100]) && refused(&binary[..binary.len() - 1]));
    let mut damaged = binary;
    let middle = damaged.len() / 2;
    damaged[middle] ^= 1;
    assert!(refused(&damaged));
}

#[test]
fn what_a_model_includes_is_seen_from_its_file_and_needed_no_more_when_it_is_compiled() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("includes");
    fs::create_dir_all(folder.join("parts")).unwrap();
    let corners = ["0 0 0", "0.1 0 0", "0 0.1 0", "0 0 0.1"].map(|at| format!("v {at}\n"));
    let faces = "f 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";
    fs::write(folder.join("parts/corner.obj"), corners.concat() + faces).unwrap();
    let body = r#"<mujocoinclude><body name="corner"><freejoint/><geom type="mesh" mesh="corner" density="1000"/></body></mujocoinclude>"#;
    fs::write(folder.join("parts/body.xml"), body).unwrap();
    let text = r#"<mujoco><compiler meshdir="parts"/><asset><mesh name="corner" file="corner.obj"/></asset>
<worldbody><include file="parts/body.xml"/></worldbody></mujoco>"#;
    fs::write(folder.join("model.xml"), text).unwrap();
    let file = ModelFile::read(&folder.join("model.xml")).unwrap();
    let outs = || vec![output("body/position", ElementKind::Body, "corner")];
    let weight = wired(file, Vec::new(), outs()).weight();
    // A corner of a cube of 10 cm: a sixth of a litre of water.
    assert!((weight - 9.81 / 6.0).abs() < 1e-6, "{weight}");
    let binary = ModelFile::read(&folder.join("model.xml")).unwrap().binary();
    fs::remove_dir_all(&folder).unwrap();
    let kept = wired(ModelFile::of_binary(&binary).unwrap(), Vec::new(), outs());
    assert_eq!(kept.weight(), weight);
}

/// Where a wish is wrong, and how.
fn refused(change: impl FnOnce(&mut ModelSignals)) -> (usize, bool, Place, SignalError) {
    let mut signals = pup_wishes(None);
    change(&mut signals);
    match BoundModel::new(ModelFile::read(&pup()).unwrap(), &signals) {
        Err(ModelFileError::Signals(misfits)) => match &misfits[..] {
            [one] => (one.index, one.input, one.place, one.why.clone()),
            more => panic!("{more:?}"),
        },
        Err(other) => panic!("{other}"),
        Ok(_) => panic!("it is accepted"),
    }
}

#[test]
fn a_signal_that_cannot_be_is_refused_at_its_place() {
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
        &pup_wishes(Some("sitting")),
    );
    let Err(ModelFileError::Keyframe { known, .. }) = missing else {
        panic!("there is no such keyframe");
    };
    assert_eq!(known, ["crouched"]);
}

#[test]
fn a_file_that_is_no_model_is_refused_with_its_line() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("refused");
    fs::create_dir_all(&folder).unwrap();
    let path = folder.join("model.xml");
    fs::write(
        &path,
        "<mujoco>\n<worldbody>\n<bodi/>\n</worldbody></mujoco>",
    )
    .unwrap();
    let why = ModelFile::read(&path).err().unwrap().to_string();
    assert!(why.contains("bodi") && why.contains("line 3"), "{why}");
    assert!(ModelFile::read(&folder.join("none.xml")).is_err());
    assert!(matches!(
        ModelFile::read(Path::new("a\0b")),
        Err(ModelFileError::Path)
    ));
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 24, ..ProptestConfig::default() })]

    /// Whatever the instants, also between the model's steps: a plant that is looked at goes where one goes that is not, and
    /// one that is saved and restored in another goes on bit for bit.
    #[test]
    fn looking_saving_and_restoring_change_nothing(
        pieces in prop::collection::vec(1_u64..4_000_000, 2..40),
        cut in 0_usize..40,
    ) {
        let wired = wired_pup();
        let (mut seen, mut unseen) = (built(&wired), built(&wired));
        let mut now = 0;
        for (k, piece) in pieces.iter().enumerate() {
            now += piece;
            let commands = commands(k as u64 / 2);
            seen.advance(at(now), &commands).unwrap();
            unseen.advance(at(now), &commands).unwrap();
            let looks = outputs(&mut seen);
            seen.energy();
            if k == cut {
                let mut other = built(&wired);
                other.advance(at(1_000_000), &commands).unwrap();
                other.restore(&unseen.save()).unwrap();
                prop_assert_eq!(&outputs(&mut other), &looks);
                unseen = other;
            }
        }
        prop_assert_eq!(seen.save(), unseen.save());
        prop_assert_eq!(outputs(&mut seen), outputs(&mut unseen));
    }
}

#[test]
fn a_snapshot_of_another_model_or_other_outputs_is_refused() {
    let mut pup = built(&wired_pup());
    let ball = wired(model("snapshot", &ball(1.0)), Vec::new(), ball_outputs());
    assert!(pup.restore(&built(&ball).save()).is_err());
    let bare = wired_pup().plant(None, &|_| false).unwrap();
    assert!(pup.restore(&bare.save()).is_err());
}

#[test]
fn the_clock_is_where_it_was_told_to_go_and_steps_are_no_longer_than_asked_for() {
    let wired = wired(model("clock", &ball(10.0)), Vec::new(), ball_outputs());
    let mut plant = wired.plant(Some(STEP), &|_| true).unwrap();
    plant.advance(at(3_400_000), &[]).unwrap();
    assert_eq!(plant.work().steps, 4, "of 0.85 ms each");
    assert!((read(&mut plant, "clock")[0] - 3.4e-3).abs() < 1e-15);
}
