//! Process variables of the foot loci: table 3.3 of the thesis, and the start of a run.

use std::f64::consts::FRAC_PI_2;

use twinrig_kernel::Unit;
use twinrig_runtime::ProcessVariable;

use crate::limb::Limb;
use crate::steering::Steering;
use crate::{Abduction, FootLocus, LocusShape};

/// Names of the ends of the robot, in the order of [`crate::Corner::end`].
const ENDS: [&str; 2] = ["fore", "hind"];

/// Keys of the variables in the order in which a controller has them. The place of a variable in
/// the list of its controller enters the fingerprint of a run that changes it: a new key comes
/// last.
const ORDER: [&str; 25] = [
    "frequency",
    "excitation",
    "step_length",
    "coupling",
    "feedback",
    "load_lag",
    "phase_noise",
    "ramp",
    "crouch",
    "hip_height",
    "step_height",
    "mid_stance_offset",
    "duty_factor",
    "touch_down_angle",
    "take_off_angle",
    "compression",
    "phase_difference",
    "splay",
    "step_length_offset",
    "turn",
    "sidestep",
    "lateral_offset",
    "dead_band",
    "lead",
    "capture",
];

/// Process variables of a controller.
#[derive(Debug, Clone, Default)]
pub(crate) struct Variables(Vec<ProcessVariable>);

impl Variables {
    /// Adds a variable.
    pub(crate) fn add(&mut self, variable: ProcessVariable) {
        self.0.push(variable);
    }

    /// Adds a variable for each end, `NAME/fore` and `NAME/hind`.
    pub(crate) fn add_pair(
        &mut self,
        name: &str,
        variable: impl Fn(String, usize) -> ProcessVariable,
    ) {
        for (end, group) in ENDS.into_iter().enumerate() {
            self.add(variable(format!("{name}/{group}"), end));
        }
    }

    /// Returns the list in the order of the keys.
    pub(crate) fn sorted(mut self) -> Vec<ProcessVariable> {
        self.0.sort_by_key(|variable| {
            let key = variable.name().split('/').next();
            ORDER.iter().position(|known| Some(*known) == key)
        });
        self.0
    }
}

/// Index of the variable of that name, or of the first one of a group, in a list that has it.
pub(crate) fn index(variables: &[ProcessVariable], name: &str) -> usize {
    let is_named = |variable: &ProcessVariable| {
        let rest = variable.name().strip_prefix(name);
        rest.is_some_and(|rest| rest.is_empty() || rest.starts_with('/'))
    };
    let found = variables.iter().position(is_named);
    found.unwrap_or_else(|| panic!("`{name}` is not declared"))
}

/// Indices of the variables of the foot loci. Those of the hind legs follow those of the fore legs,
/// and those of each leg are in the robot's order.
#[derive(Debug, Clone)]
pub(crate) struct LocusVariables {
    step_length: usize,
    pub ramp: usize,
    pub crouch: usize,
    hip_height: usize,
    step_height: usize,
    mid_stance_offset: usize,
    touch_down_angle: usize,
    take_off_angle: usize,
    compression: usize,
    step_length_offset: usize,
    pub splay: usize,
    turn: usize,
    sidestep: usize,
    lateral_offset: usize,
    dead_band: usize,
    lead: usize,
    pub capture: usize,
}

impl LocusVariables {
    /// Declares the variables of `limbs` with ranges and defaults, which scale to the length of the
    /// legs.
    pub(crate) fn declare(variables: &mut Variables, limbs: &[Limb]) {
        let lengths = Limb::lengths_max(limbs);
        let reaches = Limb::reaches(limbs);
        let [fore, hind] = lengths;
        let longest = fore.max(hind);
        let length = |name, range, default| ProcessVariable::new(name, Unit::Meter, range, default);
        // Beyond reach feet go to the nearest point; a slip of a unit goes farther.
        let steps = 0.0..=20.0 * longest;
        variables.add(length("step_length".to_owned(), steps, 0.54 * fore));
        variables.add(ProcessVariable::new("ramp", Unit::Second, 0.0.., 1.0));
        variables.add(length("crouch".to_owned(), 0.0..=longest, 0.0));
        variables.add_pair("hip_height", |name, end| {
            ProcessVariable::new(name, Unit::Meter, reaches[end].clone(), 0.93 * lengths[end])
        });
        variables.add_pair("step_height", |name, end| {
            length(name, 0.0..=lengths[end], 0.17 * lengths[end])
        });
        variables.add_pair("mid_stance_offset", |name, end| {
            length(name, -lengths[end]..=lengths[end], 0.0)
        });
        let incidence = FootLocus::INCIDENCE_MIN..=FootLocus::INCIDENCE_MAX;
        for (key, default) in [("touch_down_angle", 1.67), ("take_off_angle", FRAC_PI_2)] {
            variables.add_pair(key, |name, _| {
                ProcessVariable::new(name, Unit::Radian, incidence.clone(), default)
            });
        }
        variables.add_pair("compression", |name, _| {
            ProcessVariable::new(name, Unit::One, 0.0..=1.0, 0.95)
        });
        for limb in limbs {
            let name = format!("step_length_offset/{}", limb.name);
            variables.add(length(name, -2.0 * longest..=2.0 * longest, 0.0));
        }
        variables.add(Abduction::variable());
        let rates = -Self::TURN_MAX..=Self::TURN_MAX;
        variables.add(ProcessVariable::new(
            "turn",
            Unit::RadianPerSecond,
            rates,
            0.0,
        ));
        // To the side, legs make steps of half their length and two of these a second.
        let speeds = -longest..=longest;
        let speed = Unit::MeterPerSecond;
        variables.add(ProcessVariable::new("sidestep", speed, speeds, 0.0));
        for limb in limbs {
            let name = format!("lateral_offset/{}", limb.name);
            variables.add(length(name, -longest..=longest, 0.0));
        }
        let half_widths = 0.0..=Self::DEAD_BAND_MAX;
        let dead_band = ProcessVariable::new("dead_band", Unit::Radian, half_widths, 0.0);
        variables.add(dead_band);
        let leads = 0.0..=Self::LEAD_MAX;
        variables.add(ProcessVariable::new("lead", Unit::Second, leads, 0.0));
        let times = 0.0..=Self::CAPTURE_MAX;
        variables.add(ProcessVariable::new("capture", Unit::Second, times, 0.0));
    }

    /// Greatest half-width of the dead band of a servo \[rad\].
    const DEAD_BAND_MAX: f64 = 0.2;

    /// Greatest lead \[s\].
    const LEAD_MAX: f64 = 0.2;

    /// Greatest shift of a foot by a velocity of the trunk \[s\]: that of a pendulum of 10 m.
    const CAPTURE_MAX: f64 = 1.0;

    /// Greatest rate of turning: a quarter of a turn in a second \[rad/s\].
    const TURN_MAX: f64 = FRAC_PI_2;

    /// Finds the variables in a list that has them.
    pub(crate) fn of(variables: &[ProcessVariable]) -> Self {
        let index = |name| index(variables, name);
        Self {
            step_length: index("step_length"),
            ramp: index("ramp"),
            crouch: index("crouch"),
            hip_height: index("hip_height"),
            step_height: index("step_height"),
            mid_stance_offset: index("mid_stance_offset"),
            touch_down_angle: index("touch_down_angle"),
            take_off_angle: index("take_off_angle"),
            compression: index("compression"),
            step_length_offset: index("step_length_offset"),
            splay: index("splay"),
            turn: index("turn"),
            sidestep: index("sidestep"),
            lateral_offset: index("lateral_offset"),
            dead_band: index("dead_band"),
            lead: index("lead"),
            capture: index("capture"),
        }
    }

    /// Step length of the leg with this index in the robot, its offset included \[m\].
    #[inline]
    pub(crate) fn step_length(&self, variables: &[ProcessVariable], leg: usize) -> f64 {
        let offset = variables[self.step_length_offset + leg].value();
        (variables[self.step_length].value() + offset).max(0.0)
    }

    /// Whether the variable at `index` is one of steps to the side.
    pub(crate) fn is_of_steering(&self, index: usize, legs: usize) -> bool {
        let offsets = self.lateral_offset..self.lateral_offset + legs;
        let common = [self.turn, self.sidestep, self.dead_band, self.lead];
        common.contains(&index) || offsets.contains(&index)
    }

    /// Steps to the side, by a fraction of the motion that is set, of a trunk that moves to the
    /// left with a velocity \[m/s\], if it is measured.
    pub(crate) fn steering(
        &self,
        variables: &[ProcessVariable],
        fraction: f64,
        left: Option<f64>,
    ) -> Steering {
        let value = |index: usize| variables[index].value();
        let capture = fraction * value(self.capture);
        Steering {
            splay: value(self.splay),
            turn: fraction * value(self.turn),
            sidestep: fraction * value(self.sidestep),
            dead_band: value(self.dead_band),
            lead: value(self.lead),
            capture_m: left.map_or(0.0, |left| {
                capture * (left - fraction * value(self.sidestep))
            }),
        }
    }

    /// Place of a leg's foot to the left beside that of `splay` \[m\].
    pub(crate) fn lateral_offset(&self, variables: &[ProcessVariable], leg: usize) -> f64 {
        variables[self.lateral_offset + leg].value()
    }

    /// Parameters of the foot locus of the fore (`end` 0) or hind (`end` 1) legs, without the step
    /// length, which each leg has for itself.
    pub(crate) fn shape(&self, variables: &[ProcessVariable], end: usize) -> LocusShape {
        let pair = |fore: usize| variables[fore + end].value();
        LocusShape {
            hip_height: pair(self.hip_height),
            step_height: pair(self.step_height),
            step_length: 0.0,
            mid_stance_offset: pair(self.mid_stance_offset),
            touch_down_angle: pair(self.touch_down_angle),
            take_off_angle: pair(self.take_off_angle),
            compression: pair(self.compression),
        }
    }
}
