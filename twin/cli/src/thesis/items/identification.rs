//! Identification of both cells on the bench (sections 4.3.2.2 and 4.3.2.3).

use crate::error::TwinError;
use crate::thesis::context::Context;
use crate::thesis::item::{Item, Measurements, PrintedFigure, Source};
use crate::thesis::verdict::{Basis, Input, Rule};

const FITTED: &str = "the simulated cell is fitted to the printed figure";

pub(crate) const FIG_4_11: Item = Item {
    id: "fig-4-11",
    title: "Piezoresistive cell under a dynamic load",
    place: "4.3.2.2, figure 4.11",
    run_s: 3.0,
    figures: &[
        PrintedFigure::value("r-squared", "R² of eq. 4.21", "figure 4.11", 0.995, "")
            .rule(Rule::AtLeast(0.99), "twice the unexplained variance")
            .remark(FITTED),
        PrintedFigure::value("up", "saturation, rising force", "4.3.2.2", 10.0, "N")
            .rule(Rule::Within(0.2), "\"around\"")
            .remark(FITTED),
        PrintedFigure::value("down", "saturation, falling force", "4.3.2.2", 10.0, "N")
            .rule(Rule::Within(0.2), "\"around\"")
            .remark(FITTED),
    ],
    sources: &[Source::rest(
        Basis::Given,
        &[Input::Fitted("characteristics of the simulated cell")],
    )],
    measure: fig_4_11,
    commands: &[
        "twin study estimate",
        "twin run scenarios/thesis/fig-4-11.toml",
    ],
};

pub(crate) const FIG_4_12: Item = Item {
    id: "fig-4-12",
    title: "Piezoelectric cell without preload",
    place: "4.3.2.2, figure 4.12",
    run_s: 0.0,
    figures: &[PrintedFigure::statement(
        "response",
        "voltage over rate",
        "4.3.2.2, figure 4.12",
        "no simple relation",
        "",
    )
    .remark(
        "silicone with air bubbles under a foot that lifts off is not simulated; neither \
             data nor a model are printed",
    )],
    sources: &[],
    measure: |_| Ok(Measurements::default()),
    commands: &[],
};

pub(crate) const FIG_4_13: Item = Item {
    id: "fig-4-13",
    title: "Piezoelectric cell with preload",
    place: "4.3.2.2, figure 4.13",
    run_s: 3.0,
    figures: &[
        PrintedFigure::statement(
            "rate",
            "R² of the voltage on the rate alone",
            "figure 4.13",
            "no direct relation",
            "",
        )
        .rule(Rule::AtMost(0.5), "less than half of the variance"),
        PrintedFigure::value("r-squared", "R² of a Ḟ + b F̈", "figure 4.13", 0.9997, "")
            .rule(Rule::AtLeast(0.9994), "twice the unexplained variance"),
        PrintedFigure::statement(
            "decay",
            "R² of exponentials through a and b, the worse",
            "4.3.2.2",
            "both fall exponentially",
            "",
        )
        .rule(Rule::AtLeast(0.99), "a hundredth of the variance")
        .remark("charge amplifier and silicone, whose model knows no frequency"),
    ],
    sources: &[
        Source::of(
            &["r-squared"],
            Basis::Given,
            &[Input::Set(
                "a linear cell and amplifier, of which it holds at each frequency",
            )],
        ),
        Source::rest(
            Basis::Outcome,
            &[
                Input::Set("time constants of amplifier and silicone"),
                Input::Free("response over frequency"),
            ],
        ),
    ],
    measure: fig_4_13,
    commands: &["twin study estimate"],
};

pub(crate) const FIG_4_14: Item = Item {
    id: "fig-4-14",
    title: "Residuals of the identification",
    place: "4.3.2.3, figure 4.14",
    run_s: 3.0,
    figures: &[
        PrintedFigure::statement(
            "resistive",
            "piezoresistive: departure from a normal distribution",
            "4.3.2.3, figure 4.14",
            "not normal",
            "",
        )
        .rule(
            Rule::AtLeast(1.0),
            "greater of skewness / 0.5 and excess kurtosis / 1",
        ),
        PrintedFigure::statement(
            "electric",
            "piezoelectric: departure from a normal distribution",
            "4.3.2.3, figure 4.14",
            "not normal",
            "",
        )
        .remark(
            "the errors of the real cell are not printed as numbers; the simulated one has \
             none but harmonics",
        ),
    ],
    sources: &[Source::rest(
        Basis::Outcome,
        &[
            Input::Fitted("characteristics of the simulated cell"),
            Input::Free("distribution of the residuals"),
        ],
    )],
    measure: fig_4_14,
    commands: &["twin study estimate"],
};

fn fig_4_11(context: &Context<'_>) -> Result<Measurements, TwinError> {
    let mut found = Measurements::default();
    let study = context.identification()?;
    let fitted = &study.identification.hysteresis;
    found.set("r-squared", fitted.r_squared);
    let branches = [
        ("up", fitted.model.loading),
        ("down", fitted.model.unloading),
    ];
    for (key, branch) in branches {
        // Where the tangent in the middle meets the upper asymptote.
        found.set(key, 2.0 / branch.b.abs() - branch.c);
    }
    Ok(found)
}

fn fig_4_13(context: &Context<'_>) -> Result<Measurements, TwinError> {
    let mut found = Measurements::default();
    let study = context.identification()?;
    let identified = &study.identification;
    found.set("rate", identified.rate_sensor.r_squared);
    found.set("r-squared", identified.planes_r_squared);
    let (rate, acceleration) = (
        identified.coefficients.rate.r_squared,
        identified.coefficients.acceleration.r_squared,
    );
    found.set("decay", rate.min(acceleration));
    Ok(found)
}

fn fig_4_14(context: &Context<'_>) -> Result<Measurements, TwinError> {
    let mut found = Measurements::default();
    let study = context.identification()?;
    let residuals = study.identification.residuals.iter();
    for (key, residuals) in ["resistive", "electric"].into_iter().zip(residuals) {
        found.set(key, residuals.departure());
    }
    Ok(found)
}
