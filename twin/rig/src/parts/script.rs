//! Kind of the open-loop script controller, from scenario options.

use twinrig_document::Range;
use twinrig_kernel::Unit;
use twinrig_scenario::{Accepts, OptionSpec, OptionValue, Options};
use twinrig_script::{Plan, Script, Shape};

use crate::error::BuildError;
use crate::parts::controller_kind::ControllerKind;
use crate::parts::option::option;

const SHAPE: &str = "shape";
const PHASE_LAG: &str = "phase_lag";
const ABDUCTION: &str = "abduction";

pub(crate) fn kind() -> ControllerKind {
    let about = "open-loop periodic set-points for the drives";
    let lags = Range::between(-Plan::PHASE_LAG_MAX, Plan::PHASE_LAG_MAX);
    ControllerKind::new(Script::NAME, about, |context| {
        let plan = plan(context.options)?;
        Ok(Script::new(context.robot, context.legs, &plan)?)
    })
    .with_variables(|_| Ok(Script::variables_of()))
    .or_without_robot(|context| {
        let legs = context.legs.iter();
        let legs = legs.map(|leg| (leg.name.as_str(), leg.left));
        let plan = plan(context.options)?;
        let script = Script::of_legs(&legs.collect::<Vec<_>>(), &plan)?;
        Ok(script.for_plant(context.taken))
    })
    .with_option(shape())
    .with_option(option(
        PHASE_LAG,
        "phase lag of each leg relative to the previous one (0 deg)",
        Accepts::Quantity {
            unit: Unit::Radian,
            range: lags,
        },
    ))
    .with_option(option(
        ABDUCTION,
        "also command the hip-abduction servos, by `splay` (false)",
        Accepts::Boolean,
    ))
}

fn shape() -> OptionSpec {
    let shapes = Shape::ALL.map(|shape| shape.name().to_owned());
    let accepts = Accepts::Each(Box::new(Accepts::Choice(shapes.to_vec())));
    option(
        SHAPE,
        "waveform: one for all drives, or { hip, knee } (hold)",
        accepts,
    )
}

fn plan(options: &Options) -> Result<Plan, BuildError> {
    let mut plan = Plan {
        phase_lag: options.number(PHASE_LAG).unwrap_or_default(),
        abduction: options.boolean(ABDUCTION).unwrap_or_default(),
        ..Plan::default()
    };
    match options.get(SHAPE) {
        Some(OptionValue::All(value)) => {
            let shape = read(value)?;
            (plan.hip, plan.knee) = (shape, shape);
        }
        Some(OptionValue::Named(values)) => {
            for (drive, value) in values {
                plan = plan.with_shape(&drive.value, read(value)?)?;
            }
        }
        _ => {}
    }
    Ok(plan)
}

fn read(value: &OptionValue) -> Result<Shape, BuildError> {
    match value {
        OptionValue::Text(name) => Ok(name.parse()?),
        other => Err(format!("`{SHAPE}` cannot be {other:?}").into()),
    }
}
