//! Force of the massless leg (section 2.7.1).

use twinrig_leg::Pantograph;

use crate::error::TwinError;
use crate::thesis::context::Context;
use crate::thesis::error::ThesisError;
use crate::thesis::item::{Item, Measurements, PrintedFigure};
use crate::thesis::verdict::Rule;

/// Greatest axial stiffness of a leg, and that of its diagonal spring \[N/m\].
const STIFFNESS: f64 = 253.27;
const DIAGONAL: f64 = 4400.0;

pub(crate) const FIG_2_9: Item = Item {
    id: "fig-2-9",
    title: "Force of the massless leg",
    place: "2.7.1, figure 2.9",
    run_s: 0.1,
    figures: &[
        PrintedFigure::value(
            "stiffness",
            "greatest axial stiffness",
            "2.7.1, figure 2.9",
            STIFFNESS,
            "N/m",
        )
        .rule(Rule::Within(0.01), "the geometry has three digits")
        .remark(
            "the geometry of the leg is not printed; that of the robot file was chosen to give \
             this stiffness from the printed springs",
        ),
        PrintedFigure::value(
            "ratio",
            "stiffness of the diagonal spring over it",
            "2.7.1, figure 2.9",
            DIAGONAL / STIFFNESS,
            "×",
        )
        .rule(Rule::Within(0.01), "as above")
        .remark("\"one order of magnitude\""),
    ],
    measure: fig_2_9,
    commands: &["cargo test -p twinrig-leg greatest_axial_stiffness"],
};

fn fig_2_9(context: &Context<'_>) -> Result<Measurements, TwinError> {
    const FILE: &str = "passive-legs.toml";
    let assembly = context.assembly(FILE)?;
    let robot = assembly.robot();
    let leg = robot.and_then(|robot| robot.legs.first());
    let leg = &leg
        .ok_or_else(|| ThesisError::Lacks {
            file: FILE.to_owned(),
            what: "leg",
        })?
        .leg;
    let pantograph = Pantograph::new(leg).map_err(ThesisError::from)?;
    let stiffness = pantograph.greatest_axial_stiffness();
    let stiffness = stiffness.map_err(ThesisError::from)?;
    let mut found = Measurements::default();
    found.set("stiffness", stiffness);
    found.set("ratio", leg.diagonal.stiffness / stiffness);
    Ok(found)
}
