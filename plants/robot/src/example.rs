use crate::{
    Actuators, Compliance, Contact, JointFriction, Leg, LegMass, LegMount, OneSided, Robot, Servo,
    Spring, Trunk,
};

impl Leg {
    /// Leg for examples and tests of other crates: Cheetah-cub's, as in `robots/cheetah-cub.toml`.
    #[doc(hidden)]
    pub fn example() -> Self {
        Self {
            l1: 0.0442,
            l2: 0.0714,
            l3: 0.0544,
            l_delta: 0.015,
            q2_ref: 35_f64.to_radians(),
            diagonal: Spring {
                stiffness: 4400.0,
                preload: 0.003,
            },
            parallel: Spring {
                stiffness: 1800.0,
                preload: 0.003,
            },
            parallel_travel: 0.010,
            diagonal_min: 0.063,
            joint_friction: JointFriction {
                hip: 1e-3,
                knee: 1e-3,
                ankle: 1e-3,
                toe: 1e-3,
            },
            mass: LegMass {
                l1: 0.01,
                l2: 0.01,
                l3: 0.01,
                foot: 0.02,
                lumped_foot: 0.03,
            },
            pulley_radius: 0.025,
            toe: None,
            abduction: None,
            compliance: Some(Compliance {
                stops: OneSided {
                    stiffness: 100e3,
                    damping: 100.0,
                    toe_region: 0.2e-3,
                },
                cable: OneSided {
                    stiffness: 200e3,
                    damping: 100.0,
                    toe_region: 0.2e-3,
                },
                sole: OneSided {
                    stiffness: 10e3,
                    damping: 40.0,
                    toe_region: 0.2e-3,
                },
                slip_deflection: 0.3e-3,
            }),
        }
    }
}

impl Robot {
    /// Robot for examples and tests of other crates: four example legs.
    #[doc(hidden)]
    pub fn example() -> Self {
        let servo = Servo {
            lag: 0.005,
            speed: 12.0,
            torque: 2.0,
            dead_band: 0.0,
            inertia: 1e-4,
        };
        let mount = |name: &str, x: f64, y: f64| LegMount {
            name: name.to_owned(),
            hip: [x, y, 0.0],
            kind: "aslp".to_owned(),
            leg: Leg::example(),
        };
        Self {
            name: "example".to_owned(),
            trunk: Trunk {
                mass: 0.9,
                inertia: [1e-3, 3e-3, 3e-3],
                size: [0.2, 0.1, 0.05],
                payloads: Vec::new(),
            },
            legs: vec![
                mount("LF", 0.1, 0.05),
                mount("RF", 0.1, -0.05),
                mount("LH", -0.1, 0.05),
                mount("RH", -0.1, -0.05),
            ],
            actuators: Actuators {
                hip: servo,
                knee: servo,
                abduction: None,
            },
            motors: None,
            serial: None,
            friction: 0.6,
            contact: Some(Contact {
                stiffness: 10e3,
                damping: 40.0,
                toe_region: 0.2e-3,
                slip_deflection: 0.3e-3,
            }),
        }
    }
}
