//! Robot, ground and actuators with the changes of a study.

use twinrig_kernel::SimDuration;
use twinrig_rig::Scales;
use twinrig_robot::Robot;
use twinrig_scenario::{ActuatorSpec, OptionValue, PlantSpec};

pub(super) fn scaled_robot(robot: &Robot, scales: &Scales) -> Robot {
    let mut robot = robot.clone();
    for mount in &mut robot.legs {
        let leg = &mut mount.leg;
        leg.diagonal.stiffness *= scales.stiffness;
        leg.parallel.stiffness *= scales.stiffness;
        if let Some(toe) = &mut leg.toe {
            toe.stiffness *= scales.stiffness;
        }
        let friction = &mut leg.joint_friction;
        for joint in [
            &mut friction.hip,
            &mut friction.knee,
            &mut friction.ankle,
            &mut friction.toe,
        ] {
            *joint *= scales.damping;
        }
        let compliance = leg.compliance;
        leg.compliance = compliance
            .map(|compliance| compliance.scaled(scales.compliance, scales.compliance_damping));
        let mass = &mut leg.mass;
        for segment in [&mut mass.l1, &mut mass.l2, &mut mass.l3] {
            *segment *= scales.mass;
        }
        if scales.bare_foot {
            mass.lumped_foot = mass.foot;
        }
        // What a leg lumps into its foot it must have.
        mass.lumped_foot = mass.lumped_foot.min(mass.total());
    }
    for servo in [&mut robot.actuators.hip, &mut robot.actuators.knee] {
        servo.lag /= scales.gain;
    }
    robot
}

pub(super) fn scaled_plant(mut plant: PlantSpec, scales: &Scales) -> PlantSpec {
    if let Some(ground) = &mut plant.ground {
        ground.friction = scales.friction.or(ground.friction);
        ground.restitution = scales.restitution.unwrap_or(ground.restitution);
    }
    if let Some(step) = scales.longest_step_s {
        plant.step = SimDuration::try_from_secs_f64(step).or(plant.step);
    }
    if let Some(cells) = scales.cells {
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a whole number of cells"
        )]
        let cells = OptionValue::Natural(cells as u64);
        plant.options = plant.options.with("cells", cells);
    }
    plant
}

/// Divides the lag of the position loops, the reciprocal of their gain.
pub(super) fn scaled_actuator(actuator: &ActuatorSpec, gain: f64) -> ActuatorSpec {
    let mut actuator = actuator.clone();
    for servo in [&mut actuator.hip, &mut actuator.knee] {
        servo.lag = servo.lag.map(|lag| lag / gain);
    }
    actuator
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use twinrig_robot::RobotFile;

    use super::*;

    #[test]
    fn longest_step_is_that_of_the_plant() {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenarios/trot.toml");
        let registry = twinrig_rig::registry::Registry::standard();
        let assembly = twinrig_rig::assembly::Assembly::builder(&registry)
            .file(&path)
            .unwrap();
        let plant = assembly.scenario().plant.clone();
        assert_eq!(scaled_plant(plant.clone(), &Scales::AS_IS), plant);
        let scales = Scales {
            longest_step_s: Some(2e-4),
            friction: Some(2.0),
            ..Scales::AS_IS
        };
        let scaled = scaled_plant(plant, &scales);
        assert_eq!(scaled.step, Some(SimDuration::from_micros(200)));
        assert_eq!(scaled.ground.unwrap().friction, Some(2.0));
    }

    #[test]
    fn scales_reach_what_they_are_of_and_nothing_else() {
        let robot = RobotFile::find("cheetah-cub", Path::new(""))
            .unwrap()
            .robot()
            .unwrap();
        assert_eq!(scaled_robot(&robot, &Scales::AS_IS), robot);
        let scales = Scales {
            stiffness: 2.0,
            mass: 0.5,
            damping: 3.0,
            gain: 4.0,
            compliance: 5.0,
            compliance_damping: 6.0,
            ..Scales::AS_IS
        };
        let scaled = scaled_robot(&robot, &scales);
        let (own, new) = (&robot.legs[0].leg, &scaled.legs[0].leg);
        assert_eq!(new.diagonal.stiffness, 2.0 * own.diagonal.stiffness);
        assert_eq!(new.parallel.stiffness, 2.0 * own.parallel.stiffness);
        assert_eq!(new.diagonal.preload, own.diagonal.preload);
        assert_eq!(new.mass.l3, 0.5 * own.mass.l3);
        assert_eq!(new.mass.foot, own.mass.foot);
        assert_eq!(new.joint_friction.ankle, 3.0 * own.joint_friction.ankle);
        assert_eq!(scaled.actuators.hip.lag, robot.actuators.hip.lag / 4.0);
        assert_eq!(scaled.trunk, robot.trunk);
        let [old, new] = [own, new].map(|leg| leg.compliance.unwrap());
        assert_eq!(new, old.scaled(5.0, 6.0));
        assert_ne!(new, old);
        // A leg of less than its lumped foot lumps what it has.
        let light = scaled_robot(
            &robot,
            &Scales {
                mass: 0.0,
                ..Scales::AS_IS
            },
        );
        assert_eq!(light.legs[0].leg.mass.lumped_foot, own.mass.foot);
    }
}
