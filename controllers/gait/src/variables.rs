//! Process variables of the foot loci: table 3.3 of the thesis, and the start of a run.

use std::f64::consts::FRAC_PI_2;

use twinrig_kernel::Unit;
use twinrig_runtime::ProcessVariable;

use crate::limb::Limb;
use crate::{Abduction, FootLocus, LocusShape};

/// Names of the ends of the robot, in the order of [`crate::Corner::end`].
const ENDS: [&str; 2] = ["fore", "hind"];

/// Keys of the variables in the order in which a controller has them. The place of a variable in
/// the list of its controller enters the fingerprint of a run that changes it: a new key comes
/// last.
const ORDER: [&str; 19] = [
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
    }

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
        }
    }

    /// Step length of the leg with this index in the robot, its offset included \[m\].
    #[inline]
    pub(crate) fn step_length(&self, variables: &[ProcessVariable], leg: usize) -> f64 {
        let offset = variables[self.step_length_offset + leg].value();
        (variables[self.step_length].value() + offset).max(0.0)
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
