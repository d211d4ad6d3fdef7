//! Process variables of the controller: table 3.3 of the thesis, and the start of a run.

use std::f64::consts::{FRAC_PI_2, PI};

use twinrig_kernel::Unit;
use twinrig_runtime::{Bound, ProcessVariable};

use crate::{Abduction, FootLocus, LocusShape};

/// Indices of the variables common to all legs, in the order of [`declare`].
pub(crate) const FREQUENCY: usize = 0;
pub(crate) const STEP_LENGTH: usize = 1;
pub(crate) const COUPLING: usize = 2;
pub(crate) const RAMP: usize = 3;
pub(crate) const CROUCH: usize = 4;
/// Index of the first variable with a value each for fore and hind legs: fore, hind, fore, hind, …
const PAIRS: usize = 5;
const HIP_HEIGHT: usize = 0;
const STEP_HEIGHT: usize = 1;
const MID_STANCE_OFFSET: usize = 2;
const DUTY_FACTOR: usize = 3;
const TOUCH_DOWN_ANGLE: usize = 4;
const TAKE_OFF_ANGLE: usize = 5;
const COMPRESSION: usize = 6;
const PAIR_COUNT: usize = 7;
/// Index of the first phase difference; there is one for each leg of the robot.
pub(crate) const PHASE_DIFFERENCES: usize = PAIRS + 2 * PAIR_COUNT;

/// Declares all variables with ranges and defaults. `lengths_max` are the lengths of the extended
/// fore and hind legs \[m\], to which the defaults scale; `phases` are the legs with their phase
/// differences.
pub(crate) fn declare(lengths_max: [f64; 2], phases: &[(&str, f64)]) -> Vec<ProcessVariable> {
    let [fore, hind] = lengths_max;
    let longest = fore.max(hind);
    let mut variables = vec![
        ProcessVariable::new("frequency", Unit::Hertz, .., 3.0),
        ProcessVariable::new("step_length", Unit::Meter, 0.0.., 0.54 * fore),
        ProcessVariable::new("coupling", Unit::RadianPerSecond, 0.0..=1000.0, 2.5),
        ProcessVariable::new("ramp", Unit::Second, 0.0.., 1.0),
        ProcessVariable::new("crouch", Unit::Meter, 0.0..=longest, 0.0),
    ];
    let incidence = FootLocus::INCIDENCE_MIN..=FootLocus::INCIDENCE_MAX;
    let open = (Bound::Excluded(0.0), Bound::Excluded(1.0));
    for pair in 0..PAIR_COUNT {
        for (end, length) in [("fore", fore), ("hind", hind)] {
            let height = (Bound::Excluded(0.0), Bound::Included(length));
            variables.push(match pair {
                HIP_HEIGHT => ProcessVariable::new(
                    format!("hip_height/{end}"),
                    Unit::Meter,
                    height,
                    0.93 * length,
                ),
                STEP_HEIGHT => ProcessVariable::new(
                    format!("step_height/{end}"),
                    Unit::Meter,
                    0.0..=length,
                    0.17 * length,
                ),
                MID_STANCE_OFFSET => {
                    ProcessVariable::new(format!("mid_stance_offset/{end}"), Unit::Meter, .., 0.0)
                }
                DUTY_FACTOR => {
                    ProcessVariable::new(format!("duty_factor/{end}"), Unit::One, open, 0.55)
                }
                TOUCH_DOWN_ANGLE => ProcessVariable::new(
                    format!("touch_down_angle/{end}"),
                    Unit::Radian,
                    incidence.clone(),
                    1.67,
                ),
                TAKE_OFF_ANGLE => ProcessVariable::new(
                    format!("take_off_angle/{end}"),
                    Unit::Radian,
                    incidence.clone(),
                    FRAC_PI_2,
                ),
                _ => ProcessVariable::new(format!("compression/{end}"), Unit::One, 0.0..=1.0, 0.95),
            });
        }
    }
    for (leg, phase) in phases {
        variables.push(ProcessVariable::new(
            format!("phase_difference/{leg}"),
            Unit::Radian,
            -PI..=PI,
            *phase,
        ));
    }
    variables.push(Abduction::variable());
    variables
}

/// Index of `splay`, the last variable of [`declare`].
pub(crate) fn splay(variables: &[ProcessVariable]) -> usize {
    variables.len() - 1
}

/// Parameters of the foot locus of the fore (`end` 0) or hind (`end` 1) legs.
pub(crate) fn shape(variables: &[ProcessVariable], end: usize) -> LocusShape {
    let pair = |which: usize| variables[PAIRS + 2 * which + end].value();
    LocusShape {
        hip_height: pair(HIP_HEIGHT),
        step_height: pair(STEP_HEIGHT),
        step_length: variables[STEP_LENGTH].value(),
        mid_stance_offset: pair(MID_STANCE_OFFSET),
        touch_down_angle: pair(TOUCH_DOWN_ANGLE),
        take_off_angle: pair(TAKE_OFF_ANGLE),
        compression: pair(COMPRESSION),
    }
}

/// Duty factor of the fore (`end` 0) or hind (`end` 1) legs.
pub(crate) fn duty_factor(variables: &[ProcessVariable], end: usize) -> f64 {
    variables[PAIRS + 2 * DUTY_FACTOR + end].value()
}
