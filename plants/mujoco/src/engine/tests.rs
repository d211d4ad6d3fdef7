//! The engine against MuJoCo's own step, and its errors.

use mujoco_rs::prelude::{MjData, MjModel};

use super::*;

const INTEGRATORS: [&str; 5] = ["Euler", "RK4", "implicit", "implicitfast", "discrete"];

/// A pendulum of two links with springs, a stop, friction and a motor.
fn pendulum(integrator: &str) -> String {
    format!(
        r#"<mujoco>
<option timestep="0.002" integrator="{integrator}"/>
<worldbody><body>
  <joint name="upper" axis="0 1 0" damping="0.01" stiffness="3"/>
  <geom type="capsule" fromto="0 0 0 0.1 0 0" size="0.01" mass="0.1"/>
  <body pos="0.1 0 0">
    <joint name="lower" axis="0 1 0" damping="0.01" range="-60 6" armature="1e-5"/>
    <geom type="capsule" fromto="0 0 0 0.1 0 0" size="0.01" mass="0.1"/>
  </body>
</body></worldbody>
<tendon><fixed name="rope" stiffness="5" damping="0.001" frictionloss="0.01"><joint joint="lower" coef="1"/></fixed></tendon>
<actuator><motor name="pull" joint="upper"/></actuator>
</mujoco>"#
    )
}

fn started(integrator: &str) -> Engine {
    let mut engine = Engine::compile(&pendulum(integrator)).unwrap();
    engine.data_mut().qvel_mut().copy_from_slice(&[1.0, -2.0]);
    engine
}

#[test]
fn step_equals_that_of_mujoco_bit_for_bit() {
    for integrator in INTEGRATORS {
        let mut engine = started(integrator);
        let model = MjModel::from_xml_string(&pendulum(integrator)).unwrap();
        let mut plain = MjData::new(&model);
        plain.qvel_mut().copy_from_slice(&[1.0, -2.0]);
        for step in 0..500 {
            let control = 0.1 * libm::sin(0.01 * f64::from(step));
            engine.data_mut().ctrl_mut()[0] = control;
            plain.ctrl_mut()[0] = control;
            engine.step(0.002).unwrap();
            plain.step();
            assert_eq!(engine.data().qpos(), plain.qpos(), "{integrator}, {step}");
            assert_eq!(engine.data().qvel(), plain.qvel(), "{integrator}, {step}");
        }
        assert_ne!(engine.data().qpos(), [0.0; 2]);
    }
}

#[test]
fn step_in_stages_equals_the_whole_step_bit_for_bit() {
    let (mut single, mut staged) = (started("RK4"), started("RK4"));
    for step in 0..500 {
        let control = 0.1 * libm::sin(0.01 * f64::from(step));
        for engine in [&mut single, &mut staged] {
            engine.data_mut().ctrl_mut()[0] = control;
        }
        single.step(0.002).unwrap();
        staged.forward().unwrap();
        for stage in 1..STAGES {
            staged.stage(stage, 0.002).unwrap();
        }
        staged.finish_stages(0.002).unwrap();
        assert_eq!(single.save(), staged.save(), "{step}");
    }
}

#[test]
fn restored_state_continues_bit_for_bit_in_another_engine_and_thread() {
    for integrator in INTEGRATORS {
        let mut engine = started(integrator);
        let run = |engine: &mut Engine| {
            for _ in 0..100 {
                engine.step(0.002).unwrap();
            }
            engine.save()
        };
        run(&mut engine);
        let saved = engine.save();
        let end = run(&mut engine);
        engine.restore(&saved).unwrap();
        assert_eq!(run(&mut engine), end, "{integrator}");
        let other = std::thread::Builder::new().spawn(move || {
            let mut other = started(integrator);
            other.restore(&saved).unwrap();
            run(&mut other)
        });
        assert_eq!(other.unwrap().join().unwrap(), end, "{integrator}");
    }
}

#[test]
fn retuned_model_equals_one_compiled_with_the_parameters() {
    let mut engine = started("implicitfast");
    let text = pendulum("implicitfast");
    let text = text.replace("frictionloss=\"0.01\"", "frictionloss=\"0.02\"");
    let mut compiled = Engine::compile(&text.replace("1e-5", "2e-5")).unwrap();
    compiled.data_mut().qvel_mut().copy_from_slice(&[1.0, -2.0]);
    // Constants that MuJoCo derives from the inertia of the initial pose remain as compiled.
    let weights = compiled.model().tendon_invweight0()[0];
    let joints = compiled.model().dof_invweight0().to_vec();
    // Two copies of the model alternate: an odd number of changes, and an even one.
    for friction in [0.03, 0.01, 0.02] {
        engine.set_parameters(|model| {
            model.tendon_frictionloss_mut()[0] = friction;
            model.dof_armature_mut()[1] = 2e-5;
            model.tendon_invweight0_mut()[0] = weights;
            model.dof_invweight0_mut().copy_from_slice(&joints);
        });
    }
    for _ in 0..50 {
        engine.step(0.002).unwrap();
        compiled.step(0.002).unwrap();
        assert_eq!(engine.data().qpos(), compiled.data().qpos());
    }
}

#[test]
fn diverging_step_is_a_fault_without_motion() {
    let mut engine = started("Euler");
    engine.data_mut().qvel_mut()[1] = 1e12;
    let previous = engine.save();
    let fault = engine.step(0.002).unwrap_err();
    assert!(matches!(fault, EngineFault::Diverged { .. }), "{fault}");
    assert_eq!(engine.data().qpos(), [0.0; 2]);
    assert_eq!(engine.save()[..5], previous[..5]);
    engine.data_mut().qvel_mut()[1] = 1.0;
    engine.data_mut().ctrl_mut()[0] = f64::NAN;
    let fault = engine.step(0.002).unwrap_err();
    let (what, of) = ("control", "pull".to_owned());
    assert_eq!(fault, EngineFault::Diverged { what, of });
    engine.data_mut().ctrl_mut()[0] = 0.0;
    engine.step(0.002).unwrap();
}

#[test]
fn unnamed_diverging_joint_is_named_by_its_body() {
    let text = r#"<mujoco><worldbody>
<body name="trunk"><freejoint/><geom size="0.1"/>
  <body name="shank"><joint axis="0 1 0"/><geom size="0.1"/><body><joint name="toe" type="ball"/><geom size="0.1"/></body></body>
</body></worldbody><actuator><motor joint="toe"/></actuator></mujoco>"#;
    let names = [
        "z of the free joint of trunk",
        "the rotation about y of the free joint of trunk",
        "the hinge of shank",
        "toe",
    ];
    for (dof, expected) in [2, 4, 6, 8].into_iter().zip(names) {
        let mut engine = Engine::compile(text).unwrap();
        engine.data_mut().qvel_mut()[dof] = f64::NAN;
        assert!(engine.step(0.002).is_err());
        let model = engine.model();
        assert_eq!(divergence::dof_name(model, dof), expected);
    }
    let mut engine = Engine::compile(text).unwrap();
    for (place, expected) in [
        (3, "the free joint of trunk"),
        (7, "the hinge of shank"),
        (11, "toe"),
    ] {
        assert_eq!(divergence::position_name(engine.model(), place), expected);
    }
    engine.data_mut().ctrl_mut()[0] = 1e12;
    let fault = engine.step(0.002).unwrap_err().to_string();
    assert!(
        fault.contains("the control of actuator number 0 is"),
        "{fault}"
    );
}

#[test]
fn refusal_has_the_complete_message_with_its_line() {
    let massless = format!(
        "<mujoco>\n<worldbody>\n<body name=\"{}\">\n<freejoint/></body></worldbody></mujoco>",
        "very".repeat(30)
    );
    let why = match Engine::compile(&massless) {
        Err(EngineError::Model(why)) => why,
        other => panic!("{:?}", other.map(|_| "an engine")),
    };
    assert!(
        why.starts_with("mass and inertia of moving bodies"),
        "{why}"
    );
    assert_eq!(refusal::line(&why), Some(3), "{why}");
}

#[test]
fn invalid_model_is_refused_with_the_message_of_mujoco() {
    let refused = |text: &str| match Engine::compile(text) {
        Err(EngineError::Model(why)) => why,
        other => panic!("{:?}", other.map(|_| "an engine")),
    };
    assert!(refused("<mujoco><worldbody><bod/></worldbody></mujoco>").contains("bod"));
    assert!(!refused("no model").is_empty());
    assert!(!refused("").is_empty());
    assert!(!refused("<mujoco>\0</mujoco>").is_empty());
}

#[test]
fn state_of_another_model_is_refused() {
    let mut engine = started("RK4");
    let error = engine.restore(&[0.0; 3]).unwrap_err();
    assert!(
        matches!(error, EngineError::State { found: 3, .. }),
        "{error}"
    );
}
