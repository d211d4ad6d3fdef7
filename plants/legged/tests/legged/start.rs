//! Starts: equivalence of joint angles and commands, and rejection of invalid starts.

use proptest::prelude::*;
use twinrig_contact::{Ground, Terrain};
use twinrig_kernel::SimDuration;
use twinrig_legged::{
    Abduction, Base, Contacts, Drives, LeggedError, SetPoint, Setup, Start, StartPose,
};
use twinrig_robot::leg::{LegCommand, Pantograph, Planar, Stop};
use twinrig_robot::{Robot, RobotFile};

pub fn robot() -> Robot {
    let text = include_str!("../../../../robots/cheetah-cub.toml");
    let file = RobotFile::parse("cheetah-cub.toml", text).unwrap();
    file.robot().unwrap()
}

fn leg() -> Pantograph {
    Pantograph::new(&robot().legs[0].leg).unwrap()
}

fn pose(q: [f64; 3]) -> Start {
    Start::Pose(StartPose { q, rates: [0.0; 3] })
}

fn near(a: Planar, b: Planar, tolerance: f64) -> bool {
    (a - b).norm() < tolerance
}

/// Generates joint angles within the stops: the pantograph opens by a share of its range.
fn angles() -> impl Strategy<Value = [f64; 3]> {
    (-1.0..1.0_f64, -1.4..-0.02_f64, 0.02..0.98_f64).prop_map(|(hip, knee, share)| {
        let opening = share * leg().opening_stop(knee).unwrap().value;
        [hip, knee, opening - knee]
    })
}

proptest! {
    #[test]
    fn pose_start_has_its_joint_angles(q in angles()) {
        let leg = leg();
        let start = pose(q).of_leg("LF", &leg).unwrap();
        let joints = leg.joints(start.angles);
        prop_assert!((joints.q2 - q[1]).abs() < 1e-12 && (joints.q3 - q[2]).abs() < 1e-12);
        prop_assert!((start.angles[0] - leg.hip_reference() - q[0]).abs() < 1e-12);
        // Hip angle and foot determine the same pose, as long as the ankle is not folded beyond the
        // second segment.
        prop_assume!(start.angles[2] - start.angles[1] < 3.1);
        let (sine, cosine) = libm::sincos(start.angles[0]);
        let found = leg.pose(sine, cosine, start.foot).unwrap();
        for (found, expected) in found.angles().into_iter().zip(start.angles) {
            prop_assert!(libm::sin(found - expected).abs() < 1e-6, "{found} {expected}");
        }
        // The cable is taut.
        let cable = leg.cable_length(start.command.knee);
        prop_assert!(leg.gap(&found, Stop::Cable, cable).abs() < 1e-12);
    }

    #[test]
    fn foot_velocity_matches_finite_difference(q in angles(), rates in prop::array::uniform3(-20.0..20.0_f64)) {
        const H: f64 = 1e-6;
        let leg = leg();
        let at = |time: f64| {
            let q = [0, 1, 2].map(|i| q[i] + time * rates[i]);
            Start::Pose(StartPose { q, rates }).of_leg("LF", &leg).unwrap()
        };
        let start = at(0.0);
        let difference = (at(H).foot - at(-H).foot) / (2.0 * H);
        prop_assert!(near(start.foot_velocity, difference, 1e-6), "{difference}");
        for i in 0..3 {
            let difference = (at(H).angles[i] - at(-H).angles[i]) / (2.0 * H);
            prop_assert!((start.rates[i] - difference).abs() < 1e-6);
        }
    }

    #[test]
    fn leg_within_stops_is_accepted(q in angles()) {
        prop_assert!(pose(q).of_leg("LF", &leg()).is_ok());
    }

    #[test]
    fn equivalent_commands_and_joint_angles_start_equally(x in -0.04..0.04_f64, z in -0.13..-0.08_f64) {
        let leg = leg();
        let command = leg.inverse_closed(Planar::new(x, z)).unwrap();
        let commanded: Start = [("LF".to_owned(), command)].into_iter().collect();
        let commanded = commanded.of_leg("LF", &leg).unwrap();
        let joints = leg.joints(commanded.angles);
        let posed = pose([command.hip, joints.q2, joints.q3]).of_leg("LF", &leg).unwrap();
        prop_assert!(near(commanded.foot, posed.foot, 1e-12));
        prop_assert!(near(commanded.foot, Planar::new(x, z), 1e-12));
        prop_assert!((commanded.command.knee - posed.command.knee).abs() < 1e-9);
    }
}

#[test]
fn leg_without_command_stands_upright() {
    let leg = leg();
    let start = Start::default().of_leg("LF", &leg).unwrap();
    let upright = Planar::new(0.0, -0.9 * leg.length_max());
    assert!(near(start.foot, upright, 1e-12));
    assert_eq!((start.rates, start.foot_velocity.norm()), ([0.0; 3], 0.0));
}

#[test]
fn start_beyond_stop_reports_stop_and_distance() {
    let leg = leg();
    let rejected = |q| match pose(q).of_leg("LF", &leg) {
        Err(LeggedError::StartBeyondStop { leg, stop, by }) => {
            assert!(leg == "LF" && by > 1e-9);
            (stop, by)
        }
        other => panic!("{other:?}"),
    };
    // q2 + q3 < 0 compresses the pantograph.
    assert_eq!(rejected([0.0, -0.5, 0.4]).0, Stop::Closed);
    let opening = leg.opening_stop(-0.5).unwrap().value;
    let (stop, by) = rejected([0.0, -0.5, 0.5 + opening + 0.01]);
    assert_eq!(stop, Stop::Open);
    let (_, twice) = rejected([0.0, -0.5, 0.5 + opening + 0.02]);
    assert!((twice / by - 2.0).abs() < 0.1, "{by} {twice}");
    assert_eq!(rejected([0.0, 0.02, -0.02]).0, Stop::Extended);
    // The knee flexes by at most 95° (ASSUMED in the robot file).
    assert_eq!(rejected([0.0, -1.7, 1.7]).0, Stop::Bottomed);
}

#[test]
fn joints_bent_to_wrong_side_are_rejected_despite_valid_lengths() {
    let leg = leg();
    // Mirrored about the straight leg, springs and rods have the same lengths.
    let straight = leg.joints([0.0; 3]);
    let bent = [0.0, 2.0 * straight.q2 + 0.5, 2.0 * straight.q3 - 0.5];
    let error = pose(bent).of_leg("LF", &leg).unwrap_err();
    assert!(
        matches!(&error, LeggedError::StartBentWrongSide { joint: "knee", angle, .. } if *angle == bent[1]),
        "{error}"
    );
    // The rod has its closed length, with the third segment on the other side of the diagonal.
    let error = pose([0.0, -0.5, 3.5]).of_leg("LF", &leg).unwrap_err();
    assert!(
        matches!(
            error,
            LeggedError::StartBentWrongSide { joint: "ankle", .. }
        ),
        "{error}"
    );
}

#[test]
fn non_finite_start_is_rejected() {
    let leg = leg();
    for i in 0..6 {
        let mut numbers = [0.1, -0.2, 0.25, 0.0, 0.0, 0.0];
        numbers[i] = f64::NAN;
        let [q1, q2, q3, hip, knee, ankle] = numbers;
        let start = StartPose {
            q: [q1, q2, q3],
            rates: [hip, knee, ankle],
        };
        assert!(Start::Pose(start).of_leg("LF", &leg).is_err(), "{start:?}");
    }
    let command = LegCommand {
        hip: f64::NAN,
        knee: 0.5,
    };
    let start = Start::Commands(vec![("LF".to_owned(), command)]);
    assert!(start.of_leg("LF", &leg).is_err());
}

pub fn setup(base: Base, legs: &[&str], ground: Option<Terrain>) -> Setup {
    Setup {
        base,
        legs: legs.iter().map(|leg| (*leg).to_owned()).collect(),
        ground: ground.map(|terrain| Ground::new(terrain, 0.6, 0.0).unwrap()),
        step: SimDuration::from_millis(1),
        drives: Drives::None,
        abduction: Abduction::Locked,
        contacts: Contacts::Feet,
        set_point: SetPoint::Held,
        start: pose([0.3, -0.4, 0.4]),
    }
}

#[test]
fn lowest_foot_starts_at_zero_or_on_higher_ground() {
    let mut robot = robot();
    robot.legs[0].hip[2] = -0.01;
    let height = |setup: &Setup| {
        setup
            .height(&robot, |mount, start| {
                nalgebra::Vector3::from(mount.hip)
                    + nalgebra::Vector3::new(start.foot.x, 0.0, start.foot.y)
            })
            .unwrap()
    };
    let reach = -pose([0.3, -0.4, 0.4]).of_leg("LF", &leg()).unwrap().foot.y;
    let all = ["LF", "RF", "LH", "RH"];
    let on = |base, legs: &[&str], ground| height(&setup(base, legs, ground));
    let expected = [
        (on(Base::Free, &all, None), reach + 0.01),
        (on(Base::Free, &all[1..], None), reach),
        (on(Base::Free, &all[1..], Some(Terrain::Flat)), reach),
        // The height of a fixed trunk is determined by all legs of the robot.
        (on(Base::Fixed, &all[1..], None), reach + 0.01),
        (on(Base::Free, &[], None), 0.0),
    ];
    for (i, (found, expected)) in expected.into_iter().enumerate() {
        assert!((found - expected).abs() < 1e-12, "{i}: {found} {expected}");
    }
    let hole = Terrain::step_down(-5.0, 0.05);
    let above = on(Base::Free, &all[1..], Some(hole));
    assert!((above - reach).abs() < 1e-12, "{above}");
}
