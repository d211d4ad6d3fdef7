//! Kind of the controller of a servo on its bench, from scenario options.

use twinrig_scenario::Accepts;
use twinrig_script::{Shape, Swing};

use crate::error::BuildError;
use crate::parts::controller_kind::{ControllerContext, ControllerKind};
use crate::parts::option::option;

const SHAPE: &str = "shape";

pub(crate) fn kind() -> ControllerKind {
    let about = "commands the position of a servo on its bench by a shape";
    let on_robot = |_: &ControllerContext<'_>| -> Result<Swing, BuildError> {
        Err("it commands the servo of a bench: use the plant `servo`".into())
    };
    let shapes = Shape::ALL.map(|shape| shape.name().to_owned());
    ControllerKind::new(Swing::NAME, about, on_robot)
        .with_variables(|_| Ok(Swing::variables_of().into()))
        .or_without_robot(|context| {
            let shape = context.options.text(SHAPE).map(str::parse).transpose()?;
            Ok(Swing::new(shape.unwrap_or(Shape::Sine)))
        })
        .with_option(option(
            SHAPE,
            "course of the command (sine)",
            Accepts::Choice(shapes.to_vec()),
        ))
}
