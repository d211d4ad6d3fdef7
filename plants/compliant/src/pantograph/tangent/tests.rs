use std::sync::LazyLock;

use twinrig_robot::leg::Pantograph;
use twinrig_robot::{Compliance, JointFriction, Leg, OneSided, Robot};
use twinrig_testing::robots::robot_named;

use super::*;
use crate::PantographConstants;
use crate::lanes::{Features, Kernel, LANES, Simd, dispatch};
use crate::pantograph::{Depths, Internal};

/// Motion of a leg: angles of three links and the pulley, their rates, and a direction.
#[derive(Debug, Clone, Copy)]
struct Motion {
    angles: [f64; 4],
    rates: [f64; 4],
    direction: [f64; 4],
    compliance: Compliance,
}

/// Torques and tension against the direction, by differences and by the tangent; those of its
/// stiffness; and the depths of the elements.
struct Found {
    differences: [f64; 4],
    damped: [f64; 5],
    held: [f64; 5],
    depths: [f64; 6],
}

impl Kernel for Motion {
    type Output = Found;

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> Found {
        // Forces are linear in rates as long as they press.
        const SMALL: f64 = 1e-3;
        let leg = leg();
        let pantograph = Pantograph::new(leg).unwrap();
        let constants = [PantographConstants::<3>::new(leg, &pantograph); LANES];
        let legs = Pantographs::side_by_side(&constants, &[self.compliance; LANES]).load(simd);
        let [first, second, third, pulley] = self.angles.map(|angle| simd.splat(angle));
        let angles = [first, second, third];
        let turns = Turns::new(&angles);
        let rates = |along: f64| [0, 1, 2, 3].map(|i| self.rates[i] + along * self.direction[i]);
        let inside = |along: f64| {
            let [first, second, third, pulley_rate] = rates(along).map(|rate| simd.splat(rate));
            let joints = Joints {
                angles: &angles,
                rates: &[first, second, third],
                pulley,
                pulley_rate,
            };
            let tangent = Tangent::new(&legs, &turns, &joints);
            let depths = Depths::new(&legs, &turns, &joints).depths;
            (Internal::new(&legs, &turns, &joints, true), tangent, depths)
        };
        let ([after, before], (_, tangent, depths)) =
            ([SMALL, -SMALL].map(inside).map(|it| it.0), inside(0.0));
        let number = |lanes: S::Lanes| lanes.quad().0[0];
        let per = |after: S::Lanes, before: S::Lanes| number(after - before) / (2.0 * SMALL);
        let direction = self.direction.map(|rate| simd.splat(rate));
        let five =
            |([a, b, c, d], tension): ([S::Lanes; 4], S::Lanes)| [a, b, c, d, tension].map(number);
        Found {
            differences: [
                -per(after.torques[0], before.torques[0]),
                -per(after.torques[1], before.torques[1]),
                -per(after.torques[2], before.torques[2]),
                per(after.tension, before.tension),
            ],
            damped: five(tangent.damped(direction)),
            held: five(tangent.held(direction)),
            depths: depths.map(number),
        }
    }
}

/// Postures at which cable and stops are slack and pressed: bends of knee and pantograph, and
/// windings of the cable.
fn motions(compliance: Compliance) -> Vec<Motion> {
    let mut motions = Vec::new();
    for bend in 1..120 {
        for (closing, winding) in [(-0.01, 0.0), (0.01, 0.3), (-0.01, 0.6), (0.002, 1.2)] {
            let knee = 0.3 - 0.02 * f64::from(bend);
            motions.push(Motion {
                angles: [0.3, knee, 0.3 - closing, winding],
                rates: [0.3, -0.2, 0.1, 0.4],
                direction: [1.0, -0.7, 0.4, 1.3],
                compliance,
            });
        }
    }
    motions
}

fn leg() -> &'static Leg {
    static ROBOT: LazyLock<Robot> = LazyLock::new(|| robot_named("oncilla"));
    &ROBOT.legs[0].leg
}

fn compliance() -> Compliance {
    leg().compliance.unwrap()
}

#[test]
fn damping_is_that_of_differences() {
    let mut pressed = [0; 6];
    for motion in motions(compliance()) {
        let found = dispatch(Features::Detected, motion);
        let is_pressed = found.depths.map(|depth| depth > 0.0);
        let [.., open, _, dead_centre, _] = is_pressed;
        // What the tangent leaves out.
        if open || dead_centre {
            continue;
        }
        for (count, is_pressed) in pressed.iter_mut().zip(is_pressed) {
            *count += i32::from(is_pressed);
        }
        let [first, second, third, pulley, tension] = found.damped;
        let scale = found
            .damped
            .iter()
            .fold(1e-3, |most: f64, it| most.max(it.abs()));
        let own = [first, second, third, tension];
        for (own, difference) in own.into_iter().zip(found.differences) {
            assert!(
                (own - difference).abs() < 1e-6 * scale,
                "{motion:?}: {own} {difference}"
            );
        }
        let radius = leg().pulley_radius;
        assert!((pulley - radius * tension).abs() < 1e-12 * scale);
    }
    let [extended, bottomed, _, closed, _, cable] = pressed;
    assert!(
        [extended, bottomed, closed, cable]
            .into_iter()
            .all(|count| count > 10),
        "{pressed:?}"
    );
}

/// Damping and stiffness grow alike over the toe region: where one figure is half of the other, an
/// element responds to rates half as much as to angles.
#[test]
fn stiffness_acts_as_a_damping_of_its_figure_does() {
    let like = |side: OneSided| OneSided {
        damping: 0.5 * side.stiffness,
        ..side
    };
    let plain = compliance();
    let alike = Compliance {
        stops: like(plain.stops),
        cable: like(plain.cable),
        ..plain
    };
    let mut compared = 0;
    for motion in motions(alike) {
        let at_rest = Motion {
            rates: [0.0; 4],
            ..motion
        };
        let found = dispatch(Features::Detected, at_rest);
        let [first, second, third, _] = motion.direction;
        let JointFriction {
            hip, knee, ankle, ..
        } = leg().joint_friction;
        let (knee, ankle) = (knee * (second - first), ankle * (third - second));
        let friction = [hip * first - knee, knee - ankle, ankle, 0.0, 0.0];
        let scale = found
            .held
            .iter()
            .fold(1.0, |most: f64, it| most.max(it.abs()));
        for (i, held) in found.held.into_iter().enumerate() {
            let damped = 2.0 * (found.damped[i] - friction[i]);
            assert!(
                (held - damped).abs() < 1e-9 * scale,
                "{motion:?}: {held} {damped}"
            );
        }
        compared += i32::from(found.held[4] != 0.0);
    }
    assert!(compared > 10, "{compared}");
}
