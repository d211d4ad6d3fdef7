//! Force of the massless leg (section 2.7.1).

use twinrig_leg::{LegError, Pantograph};

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

/// Range of leg lengths, as shares of the greatest: shorter ones are not reached in a gait, and at
/// the end the preload closes the pantograph.
const LENGTHS: [f64; 2] = [0.7, 0.98];
const POINTS: u32 = 400;

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
    let stiffness = greatest_stiffness(&pantograph).map_err(ThesisError::from)?;
    let mut found = Measurements::default();
    found.set("stiffness", stiffness);
    found.set("ratio", leg.diagonal.stiffness / stiffness);
    Ok(found)
}

/// Returns the greatest slope of the axial force over the length, without a hip torque \[N/m\].
fn greatest_stiffness(leg: &Pantograph) -> Result<f64, LegError> {
    const H: f64 = 1e-4;
    let force = |length: f64| {
        let at = leg.equilibrium(length, 0.0, f64::INFINITY)?;
        Ok::<f64, LegError>(at.axial)
    };
    let [shortest, longest] = LENGTHS;
    let mut greatest: f64 = 0.0;
    for point in 0..=POINTS {
        let share = shortest + (longest - shortest) * f64::from(point) / f64::from(POINTS);
        let length = share * leg.length_max();
        let slope = (force(length - H)? - force(length + H)?) / (2.0 * H);
        greatest = greatest.max(slope);
    }
    Ok(greatest)
}
