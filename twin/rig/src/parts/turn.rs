//! Kind of the controller that turns free shafts, from scenario options.

use twinrig_kernel::signal;
use twinrig_scenario::Accepts;
use twinrig_script::Turn;

use crate::error::BuildError;
use crate::parts::controller_kind::{ControllerContext, ControllerKind};
use crate::parts::option::option;

const MEASURE: &str = "measure";

pub(crate) fn kind() -> ControllerKind {
    let about = "turns the motors of a test bench at an even rate";
    let on_robot = |_: &ControllerContext<'_>| -> Result<Turn, BuildError> {
        Err("it turns motors on free shafts, which a robot does not have: use a bench".into())
    };
    ControllerKind::new(Turn::NAME, about, on_robot)
        .with_variables(|_| Ok(Turn::variables_of().into()))
        .or_without_robot(|context| {
            let command = |input: &String| {
                let (motor, what) = signal::parse_motor(input)?;
                (what == "voltage").then(|| motor.to_owned())
            };
            let motors: Vec<String> = context.taken.iter().filter_map(command).collect();
            let motors: Vec<&str> = motors.iter().map(String::as_str).collect();
            let measures = context.options.boolean(MEASURE).unwrap_or_default();
            Ok(Turn::new(&motors)?.with_measurement(measures))
        })
        .with_option(option(
            MEASURE,
            "read the encoders, and pass on `motor/NAME/frequency` (false)",
            Accepts::Boolean,
        ))
}
