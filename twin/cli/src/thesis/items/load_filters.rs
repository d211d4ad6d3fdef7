//! Filters of the load: simulated, tuned, validated (sections 4.3.1 and 4.3.2.3).

use crate::error::TwinError;
use crate::thesis::context::Context;
use crate::thesis::item::{Item, Measurements, PrintedFigure, Source};
use crate::thesis::verdict::{Basis, Input, Measurement, Rule};

const MANY_MINIMA: &str = "the sign depends on the covariances: the objective of F2 has several \
                           minima, and its coefficients are right at some frequencies only";

pub(crate) const FIG_4_7: Item = Item {
    id: "fig-4-7",
    title: "Simulated load",
    place: "4.3.1.2, eq. 4.17, figure 4.7",
    run_s: 0.1,
    figures: &[
        PrintedFigure::statement(
            "bump",
            "load at nine tenths of half a bump, over the maximum",
            "eq. 4.17, figure 4.7b",
            "a bump, zero at both ends",
            "",
        )
        .rule(Rule::AtMost(1.0), "a maximum")
        .remark("the printed exponent 1/(1 − x²) grows without bound; with a minus it falls"),
        PrintedFigure::statement(
            "bump-minus",
            "the same with the exponent −1/(1 − x²)",
            "figure 4.7b",
            "a bump, zero at both ends",
            "",
        )
        .rule(Rule::AtMost(1.0), "a maximum"),
    ],
    sources: &[Source::rest(
        Basis::Arithmetic,
        &[Input::Set("printed formula")],
    )],
    measure: |_| Ok(fig_4_7()),
    commands: &["twin run scenarios/thesis/fig-4-8.toml"],
};

pub(crate) const FIG_4_8: Item = Item {
    id: "fig-4-8",
    title: "Filter with both sensors, and with each alone",
    place: "4.3.1.2, figure 4.8",
    run_s: 0.1,
    figures: &[
        PrintedFigure::statement(
            "both",
            "both sensors: RMS error",
            "4.3.1.2, figure 4.8",
            "follows the load well",
            "N",
        )
        .rule(Rule::AtMost(0.65), "5 % of the load of 13 N"),
        PrintedFigure::statement(
            "shape",
            "sensor of the rate alone: slope against the load",
            "4.3.1.2, figure 4.8",
            "has the shape of the load",
            "",
        )
        .rule(Rule::Between(0.9, 1.1), "a tenth"),
        PrintedFigure::statement(
            "drift",
            "sensor of the rate alone: greatest error",
            "4.3.1.2, figure 4.8",
            "drifts slowly",
            "N",
        )
        .rule(
            Rule::Between(1.3, 13.0),
            "a tenth of the load to all of it, in 8 s",
        ),
        PrintedFigure::statement(
            "lost",
            "piezoresistive cell alone: RMS error",
            "4.3.1.2, figure 4.8",
            "is lost soon",
            "N",
        )
        .rule(Rule::AtLeast(13.0), "the load itself")
        .remark("its gradient vanishes in saturation"),
    ],
    sources: &[
        Source::of(
            &["lost"],
            Basis::Outcome,
            &[Input::Set("cells and noises"), Input::Free("the estimate")],
        ),
        Source::rest(
            Basis::Given,
            &[
                Input::Set("cells, noises and bias"),
                Input::Fitted("constants of the filter are those of the cells"),
            ],
        ),
    ],
    measure: fig_4_8,
    commands: &["twin run scenarios/thesis/fig-4-8.toml"],
};

pub(crate) const FIG_4_9: Item = Item {
    id: "fig-4-9",
    title: "Tuning by particle swarm",
    place: "4.3.1.3, 4.3.2.3, figure 4.9",
    run_s: 120.0,
    figures: &[
        PrintedFigure::statement(
            "cost",
            "−ln O of F2 (eq. 4.19), tuned over untuned",
            "4.3.1.3, figure 4.9",
            "better covariances are found",
            "",
        )
        .rule(Rule::AtMost(0.99), "less than before"),
        PrintedFigure::value(
            "variances",
            "variance, piezoelectric over piezoresistive",
            "4.3.2.3",
            1000.0,
            "×",
        )
        .rule(Rule::Factor(10.0), "\"3 orders of magnitude\"")
        .remark(
            "a search trusts the cell whose model is right, which here is the piezoelectric \
             one; the thesis met the reverse, too, in particles of less fitness",
        ),
        PrintedFigure::statement(
            "rate",
            "error of the estimated rate over the rate, RMS, F2",
            "4.3.2.3, figure 4.15",
            "poor",
            "%",
        )
        .rule(Rule::AtLeast(30.0), "a third of the rate"),
    ],
    sources: &[
        Source::of(
            &["cost"],
            Basis::Given,
            &[Input::Fitted("covariances, by a search for this cost")],
        ),
        Source::rest(
            Basis::Substitute,
            &[
                Input::Set("cells"),
                Input::Free("covariances that a search finds"),
            ],
        ),
    ],
    measure: fig_4_9,
    commands: &["twin study estimate"],
};

pub(crate) const FIG_4_15: Item = Item {
    id: "fig-4-15",
    title: "Estimates of the tuned filter F2",
    place: "4.3.2.3, figure 4.15",
    run_s: 0.5,
    figures: &[
        PrintedFigure::statement(
            "low",
            "maxima at 1 Hz over those of the load",
            "4.3.2.3, figure 4.15a",
            "too low",
            "",
        )
        .rule(Rule::AtMost(0.99), "resolution of the figure")
        .remark(MANY_MINIMA),
        PrintedFigure::statement(
            "high",
            "maxima at 2.5 Hz over those of the load",
            "4.3.2.3, figure 4.15b",
            "too high",
            "",
        )
        .rule(Rule::AtLeast(1.01), "resolution of the figure")
        .remark(MANY_MINIMA),
        PrintedFigure::statement(
            "spread",
            "deviation at 1 Hz, greatest over least",
            "4.3.2.3, figure 4.15",
            "greatest at the maxima",
            "×",
        )
        .rule(Rule::AtLeast(2.0), "visible in the figure")
        .remark("in saturation the piezoresistive cell adds nothing"),
    ],
    sources: &[Source::rest(
        Basis::Substitute,
        &[
            Input::Fitted("covariances, by a search"),
            Input::Free("the estimate"),
        ],
    )],
    measure: fig_4_15,
    commands: &[
        "twin run scenarios/thesis/fig-4-15.toml",
        "twin study estimate",
    ],
};

fn fig_4_7() -> Measurements {
    const X: f64 = 0.9;
    let mut found = Measurements::default();
    let exponent = |x: f64| 1.0 / (1.0 - x * x);
    let over_maximum = libm::exp(exponent(X) - exponent(0.0));
    found.set("bump", over_maximum);
    found.set("bump-minus", 1.0 / over_maximum);
    found
}

fn fig_4_8(context: &Context<'_>) -> Result<Measurements, TwinError> {
    let mut found = Measurements::default();
    let run = context.run("thesis/fig-4-8.toml")?;
    for (key, expectation) in [
        ("both", "both sensors: the error is small"),
        ("shape", "rate alone: follows the shape"),
        ("drift", "rate alone: drifts with the bias"),
        ("lost", "piezoresistive cell alone: is lost in saturation"),
    ] {
        found.add(key, run.measured(expectation)?);
    }
    Ok(found)
}

/// The thesis' filter of figure 4.15.
const FILTER: &str = "F2";

fn fig_4_9(context: &Context<'_>) -> Result<Measurements, TwinError> {
    let mut found = Measurements::default();
    let study = context.tuning()?;
    let mut filters = study.filters.iter();
    if let Some(filter) = filters.find(|filter| filter.kind.name() == FILTER) {
        let [before, after] = filter.cost;
        found.set("cost", after / before);
        let settings = &filter.settings;
        let variances = settings.piezoelectric.zip(settings.piezoresistive);
        let ratio = variances.map(|(electric, resistive)| electric / resistive.variance);
        found.add("variances", ratio.map(Measurement::exact));
    }
    if let Some(row) = study.row(FILTER, None) {
        found.set("rate", 100.0 * row.rate_rmse_n_s / row.rate_rms_n_s);
    }
    Ok(found)
}

fn fig_4_15(context: &Context<'_>) -> Result<Measurements, TwinError> {
    let mut found = Measurements::default();
    let run = context.run("thesis/fig-4-15.toml")?;
    found.add("low", run.measured("F2 at 1 Hz: maxima not too low")?);
    found.add("high", run.measured("F2 at 2.5 Hz: maxima too high")?);
    let greatest = run.measured("F2 at 1 Hz: spread at the maxima")?;
    let least = run.measured("F2 at 1 Hz: spread at the minima")?;
    let ratio = greatest.zip(least);
    found.add(
        "spread",
        ratio.map(|(greatest, least)| Measurement::exact(greatest.value / least.value)),
    );
    Ok(found)
}
