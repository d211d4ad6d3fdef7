//! Contact of trunk, knees and ankles with the ground: closed forms, balances of momentum and
//! energy, and snapshots.

use std::ops::Range;

use nalgebra::{UnitQuaternion, Vector3};
use twinrig::Registry;
use twinrig_contact::{Ground, Levels, Patch, Terrain};
use twinrig_kernel::{SimTime, stream};
use twinrig_legged::{
    Abduction, Base, Contacts, Drives, Push, PushShape, PushTarget, Setup, StartPose,
};
use twinrig_robot::leg::Pantograph;
use twinrig_robot::{GRAVITY, Robot};
use twinrig_runtime::{Plant, PlantEventKind, PlantState};
use twinrig_testing::abduction::{JOINT, servo};
use twinrig_tests::shipped;

use crate::pushes::plants::{Held, cheetah, in_the_air, plant, plant_of, push, standing};

const LEGS: [&str; 4] = ["LF", "RF", "LH", "RH"];
const PLANTS: [(&str, Contacts); 2] = [
    ("massless compliant", Contacts::Trunk),
    ("lcp compliant", Contacts::All),
];

/// Motion of a trunk.
struct Motion {
    height: f64,
    attitude: UnitQuaternion<f64>,
    velocity: Vector3<f64>,
    turning: Vector3<f64>,
}

impl Motion {
    fn at(height: f64) -> Self {
        Self {
            height,
            attitude: UnitQuaternion::identity(),
            velocity: Vector3::zeros(),
            turning: Vector3::zeros(),
        }
    }

    /// Draws the motion of a robot that falls, in any attitude.
    fn drawn(seed: u64) -> Self {
        let mut stream = stream(seed, "fall");
        let mut drawn = || 2.0 * stream.unit() - 1.0;
        let mut vector = || Vector3::new(drawn(), drawn(), drawn());
        Self {
            height: 0.3,
            attitude: UnitQuaternion::from_scaled_axis(vector() * 3.0),
            velocity: vector() * 0.5,
            turning: vector() * 3.0,
        }
    }

    /// Sets the motion of a plant; legs keep theirs.
    fn set(&self, plant: &mut dyn Plant) {
        let attitude = self.attitude.quaternion();
        let attitude = [attitude.w, attitude.i, attitude.j, attitude.k];
        let mut state = PlantState::at(SimTime::ZERO)
            .with("body/position", &[0.0, 0.0, self.height])
            .with("body/orientation", &attitude)
            .with("body/velocity", self.velocity.as_slice())
            .with("body/angular_velocity", self.turning.as_slice());
        let own = plant.state().unwrap();
        for (name, values) in own.iter().filter(|(name, _)| name.starts_with("leg/")) {
            state = state.with(name, values);
        }
        assert_eq!(plant.resume_from(&state).unwrap(), Vec::<String>::new());
    }
}

fn flat(friction: f64) -> Ground {
    Ground::new(Terrain::Flat, friction, 0.0).unwrap()
}

/// The trunk of a robot, on the ground.
fn trunk(ground: Ground) -> Setup {
    Setup {
        ground: Some(ground),
        contacts: Contacts::Trunk,
        ..in_the_air(&[])
    }
}

/// A robot whose drives hold its legs, with contact of these parts.
fn robot(contacts: Contacts) -> Setup {
    Setup {
        contacts,
        ..standing()
    }
}

/// A plant in a motion, whose drives hold its legs.
fn started(mut plant: Box<dyn Plant>, motion: &Motion) -> Held {
    motion.set(&mut *plant);
    Held::new(plant)
}

/// The robot, with joints of abduction.
fn abducting() -> Robot {
    let mut robot = cheetah();
    for mount in &mut robot.legs {
        mount.leg.abduction = Some(JOINT);
    }
    robot
}

#[test]
fn a_trunk_rests_on_its_corners() {
    let robot = cheetah();
    let contact = robot.contact.unwrap();
    let weight = GRAVITY * robot.trunk.mass;
    // Four springs, half a toe region less.
    let depth = weight / (4.0 * contact.stiffness) + 0.5 * contact.toe_region;
    for (method, _) in PLANTS {
        for (turn, half) in [
            (Vector3::zeros(), 0.5 * robot.trunk.size[2]),
            (
                Vector3::x() * core::f64::consts::PI,
                0.5 * robot.trunk.size[2],
            ),
            (
                Vector3::x() * core::f64::consts::FRAC_PI_2,
                0.5 * robot.trunk.size[1],
            ),
            (
                Vector3::y() * core::f64::consts::FRAC_PI_2,
                0.5 * robot.trunk.size[0],
            ),
        ] {
            let motion = Motion {
                attitude: UnitQuaternion::from_scaled_axis(turn),
                ..Motion::at(half + 5e-3)
            };
            let mut plant = started(plant(method, &trunk(flat(0.6)), &[]), &motion);
            plant.advance(1_500_000);
            let height = plant.read("body/position")[2];
            assert!(
                (height - (half - depth)).abs() < 1e-6,
                "{method} {turn}: {height}"
            );
            plant.plant.begin_window();
            plant.advance(1_600_000);
            let force = plant.vector("body/contact/force");
            assert!(
                (force - Vector3::z() * weight).norm() < 1e-3,
                "{method}: {force}"
            );
        }
    }
}

#[test]
fn a_trunk_that_slides_stops_by_friction() {
    let (robot, friction) = (cheetah(), 0.6);
    let contact = robot.contact.unwrap();
    let height = 0.5 * robot.trunk.size[2]
        - GRAVITY * robot.trunk.mass / (4.0 * contact.stiffness)
        - 0.5 * contact.toe_region;
    let motion = Motion {
        velocity: Vector3::new(0.8, 0.6, 0.0),
        ..Motion::at(height)
    };
    let distance = 1.0 / (2.0 * friction * GRAVITY);
    for (method, _) in PLANTS {
        let mut rough = started(plant(method, &trunk(flat(friction)), &[]), &motion);
        rough.advance(500_000);
        let moved = rough.vector("body/position");
        let along = (moved.x * 0.8 + moved.y * 0.6) / distance;
        // The bristles stretch first, and damping does not bear on them.
        assert!((along - 1.0).abs() < 0.01, "{method}: {along}");
        assert!(
            (moved.y * 0.8 - moved.x * 0.6).abs() < 1e-3,
            "{method}: {moved}"
        );
        let ice = Patch {
            friction: 0.0,
            extent: 0.01..9.0,
            begin: SimTime::ZERO,
            end: None,
        };
        let ground = flat(friction).with_patches(vec![ice]).unwrap();
        let mut onto_ice = started(plant(method, &trunk(ground), &[]), &motion);
        onto_ice.advance(500_000);
        let speed = onto_ice.vector("body/velocity").norm();
        let expected = libm::sqrt(1.0 - 2.0 * friction * GRAVITY * 0.01 / 0.8);
        assert!(
            (speed / expected - 1.0).abs() < 0.02,
            "{method}: {speed} {expected}"
        );
    }
}

/// A push on the trunk while it falls, and its impulse, which follows from the shape.
fn shove(seed: u64) -> (Push, Vector3<f64>) {
    let mut stream = stream(seed, "shove");
    let mut drawn = || 2.0 * stream.unit() - 1.0;
    let peak = Vector3::new(drawn(), drawn(), drawn()) * 6.0;
    let place = [0.08 * drawn(), 0.04 * drawn(), 0.02 * drawn()];
    let (target, shape) = (PushTarget::Trunk(place), PushShape::HalfSine);
    let push = push(target, 100_500, 80_000, shape, peak.into());
    (push, peak * (0.08 * core::f64::consts::FRAC_2_PI))
}

/// Lets robots fall, by these seeds, and checks that they obey the laws of energy and momentum and
/// come to rest on the ground.
fn check_falls(seeds: Range<u64>) {
    let locked = (cheetah(), Abduction::Locked);
    let free = (abducting(), Abduction::Servos(servo(2.0)));
    let cases = [locked, free]
        .into_iter()
        .flat_map(|case| PLANTS.map(|plant| (case.clone(), plant)));
    for ((robot_file, abduction), (method, contacts)) in cases {
        let half_height = 0.5 * robot_file.trunk.size[2];
        let mut at_rest = 0;
        for seed in seeds.clone() {
            let (motion, (push, impulse)) = (Motion::drawn(seed), shove(seed));
            let setup = Setup {
                abduction: abduction.clone(),
                ..robot(contacts)
            };
            let plant = plant_of(&robot_file, method, &setup, &[push]);
            let mut plant = started(plant, &motion);
            plant.plant.begin_window();
            plant.advance(2_000_000);
            let name = format!("{method}, {abduction:?}, seed {seed}");
            let balance = plant.plant.energy();
            let residual = balance.residual / balance.exchanged;
            assert!(residual.abs() < 1e-4, "{name}: {residual}");
            // Corners are in the ground by millimetres at most.
            let height = plant.read("body/position")[2];
            assert!(height > half_height - 2e-3, "{name}: {height}");
            if balance.kinetic > 1e-4 {
                continue;
            }
            at_rest += 1;
            // The ground has borne the weight, and has taken the momentum of start and push.
            let mut force = plant.vector("body/contact/force");
            for leg in LEGS {
                force += plant.vector(&format!("leg/{leg}/foot/force"));
                if contacts == Contacts::All {
                    force += plant.vector(&format!("leg/{leg}/segments/force"));
                }
            }
            let mass = robot_file.mass();
            let borne = 2.0 * (force - Vector3::z() * robot_file.weight()) + impulse;
            // Legs move with the turning trunk: their centre of mass is within 2 cm of its own.
            let error = (borne / mass + motion.velocity).norm();
            assert!(
                error < 0.02 * motion.turning.norm() + 1e-3,
                "{name}: {error}"
            );
        }
        let all = seeds.end - seeds.start;
        assert!(
            at_rest * 10 >= all * 9,
            "{method}: {at_rest} of {all} at rest"
        );
    }
}

#[test]
fn robots_that_fall_in_any_attitude_lie_on_the_ground() {
    check_falls(0..12);
}

#[test]
#[ignore = "slow"]
fn five_hundred_falls_of_each_robot_in_each_plant_obey_the_laws() {
    check_falls(12..512);
}

#[test]
fn robots_without_contact_of_the_trunk_sink_into_the_ground() {
    for (method, _) in PLANTS {
        let motion = Motion {
            attitude: UnitQuaternion::from_scaled_axis(Vector3::x() * 3.0),
            ..Motion::at(0.1)
        };
        let mut plant = started(plant(method, &robot(Contacts::Feet), &[]), &motion);
        plant.advance(400_000);
        let height = plant.read("body/position")[2];
        assert!(height < -0.02, "{method}: {height}");
    }
}

#[test]
fn a_knee_stops_at_a_wall() {
    const WALL: f64 = 0.13;
    let wall = Ground::new(Terrain::Levels(Levels::strip(WALL, 1.0, 1.0)), 0.6, 0.0).unwrap();
    let motion = Motion {
        velocity: Vector3::x(),
        ..Motion::at(0.3)
    };
    let robot = cheetah();
    let leg = &robot.legs[0];
    // Depth of the knee in the wall after 40 ms, of a bent leg whose knee leads.
    let knee = |contacts| {
        let setup = Setup {
            base: Base::Planar,
            ground: Some(wall.clone()),
            contacts,
            start: StartPose {
                q: [0.2, -0.9, 0.9],
                rates: [0.0; 3],
            }
            .into(),
            ..in_the_air(&["LF"])
        };
        let mut plant = started(plant("lcp compliant", &setup, &[]), &motion);
        plant.advance(40_000);
        let angle = plant.read("leg/LF/angles")[0];
        let forward = plant.read("body/position")[0];
        forward + leg.hip[0] + leg.leg.l1 * libm::sin(angle) - WALL
    };
    let [free, stopped] = [Contacts::Feet, Contacts::All].map(knee);
    // The spring stops the robot, at 1 m/s, within √(m/k).
    let most = libm::sqrt(robot.mass() / robot.contact.unwrap().stiffness);
    assert!(
        free > 2.0 * most && stopped < most,
        "{free} {stopped} {most}"
    );
}

/// A pose with the ankles below the feet: first segments beyond the horizontal.
fn on_ankles(robot: &Robot) -> StartPose {
    let leg = Pantograph::new(&robot.legs[0].leg).unwrap();
    let hip = 100_f64.to_radians() - leg.hip_reference();
    let knee = -90_f64.to_radians();
    StartPose {
        q: [hip, knee, -knee],
        rates: [0.0; 3],
    }
}

#[test]
fn a_robot_that_slides_on_its_ankles_stops_by_friction() {
    let (robot_file, friction) = (cheetah(), 0.6);
    let setup = Setup {
        start: on_ankles(&robot_file).into(),
        ground: Some(flat(friction)),
        ..robot(Contacts::All)
    };
    let plant = plant_of(&robot_file, "lcp compliant", &setup, &[]);
    let mut still = Held::new(plant);
    still.advance(1_000_000);
    let motion = Motion {
        velocity: Vector3::x() * 0.5,
        ..Motion::at(still.read("body/position")[2])
    };
    let mut plant = started(plant_of(&robot_file, "lcp compliant", &setup, &[]), &motion);
    plant.advance(500_000);
    let along = plant.read("body/position")[0] * 2.0 * friction * GRAVITY / 0.25;
    // The robot pitches, and its bristles stretch.
    assert!((along - 1.0).abs() < 0.1, "{along}");
    plant.plant.begin_window();
    plant.advance(600_000);
    let loads = LEGS.map(|leg| plant.read(&format!("leg/{leg}/segments/force"))[2]);
    let borne = loads.iter().sum::<f64>() / robot_file.weight();
    assert!((borne - 1.0).abs() < 1e-3, "{loads:?}");
}

/// Legs of a fixed trunk whose ankles start in the ground.
#[test]
fn the_energy_balance_of_ankles_below_a_fixed_trunk_closes() {
    let setup = Setup {
        base: Base::Fixed,
        drives: Drives::None,
        start: on_ankles(&cheetah()).into(),
        ..robot(Contacts::All)
    };
    let mut plant = Held::new(plant("lcp compliant", &setup, &[]));
    plant.plant.begin_window();
    plant.advance(100_000);
    // The legs are props between trunk and ground.
    let force = plant.vector("leg/LF/segments/force");
    assert!(force.z > 1.0, "{force}");
    let balance = plant.plant.energy();
    let residual = balance.residual / balance.exchanged;
    assert!(residual.abs() < 1e-4, "{residual}");
    assert_eq!(plant.vector("body/velocity"), Vector3::zeros());
}

#[test]
fn contacts_in_the_air_change_no_bit() {
    for (method, contacts) in PLANTS {
        let run = |contacts| {
            let mut plant = Held::new(plant(method, &robot(contacts), &[]));
            plant.advance(200_000);
            (plant.read("body/position"), plant.plant.work())
        };
        assert_eq!(run(contacts), run(Contacts::Feet), "{method}");
    }
}

/// The hips of the file are at the height of the centre of mass, that of massless legs with them.
#[test]
fn a_robot_with_raised_hips_lies_on_its_back() {
    let mut robot_file = cheetah();
    for mount in &mut robot_file.legs {
        mount.hip[2] = 0.02;
    }
    let contact = robot_file.contact.unwrap();
    let depth = robot_file.weight() / (4.0 * contact.stiffness) + 0.5 * contact.toe_region;
    let height = 0.5 * robot_file.trunk.size[2] - depth;
    let motion = Motion {
        attitude: UnitQuaternion::from_scaled_axis(Vector3::x() * core::f64::consts::PI),
        ..Motion::at(height + 2e-3)
    };
    for (method, contacts) in PLANTS {
        let plant = plant_of(&robot_file, method, &robot(contacts), &[]);
        let mut plant = started(plant, &motion);
        plant.advance(1_500_000);
        let found = plant.read("body/position")[2];
        assert!((found - height).abs() < 2e-5, "{method}: {found} {height}");
    }
}

#[test]
fn contacts_are_refused_where_they_are_not_modelled() {
    let registry = Registry::standard();
    let refusal = |settings: &[(&str, &str)]| {
        let assembled = shipped(&registry, "fall.toml", settings);
        let rig = assembled.and_then(|assembly| assembly.rig());
        rig.map(|_| ()).unwrap_err().to_string()
    };
    let (all, lcp) = (("plant.contacts", "'all'"), ("plant.model", "'lcp'"));
    let rigid = ("plant.constraints", "'rigid'");
    for (text, part) in [
        (
            refusal(&[all]),
            "`massless` has no contact at knees and ankles",
        ),
        (
            refusal(&[rigid]),
            "`massless` with rigid constraints has contact at the feet only",
        ),
        (
            refusal(&[lcp, rigid]),
            "`lcp` with rigid constraints has contact at the feet only",
        ),
        (
            refusal(&[lcp, ("plant.toe", "true")]),
            "`lcp` with toe joints has contact at the feet only",
        ),
    ] {
        assert!(text.contains(part), "{text}");
    }
}

#[test]
fn corners_that_touch_are_events_and_part_of_snapshots() {
    let trunk_alone = ("lcp compliant", Contacts::Trunk);
    for (method, contacts) in PLANTS.into_iter().chain([trunk_alone]) {
        let motion = Motion::drawn(3);
        let mut first = started(plant(method, &robot(contacts), &[]), &motion);
        first.plant.log_events(true);
        let mut events = Vec::new();
        for step in 1..300 {
            first.advance(step * 2_000);
            events.extend(first.plant.events().iter().cloned());
        }
        let reached = |name: &str| {
            let mut all = events.iter();
            all.any(|event| event.part.ends_with(name) && event.kind == PlantEventKind::Reached)
        };
        assert!(
            reached("body/lower-corner") || reached("body/upper-corner"),
            "{method}"
        );
        let has_joints = contacts == Contacts::All;
        assert_eq!(reached("knee-contact"), has_joints, "{method}");
        // Depths of parts with contact alone: of corners and feet, millimetres.
        let violation = first.plant.constraint_violation().unwrap();
        assert!(violation < 3e-3, "{method}: {violation}");
        let saved = first.plant.save();
        let mut second = started(plant(method, &robot(contacts), &[]), &motion);
        second.plant.restore(&saved).unwrap();
        for plant in [&mut first, &mut second] {
            plant.advance(800_000);
        }
        assert_eq!(
            first.read("body/position"),
            second.read("body/position"),
            "{method}"
        );
        assert_eq!(first.plant.energy(), second.plant.energy(), "{method}");
    }
}
