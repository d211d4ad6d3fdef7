//! Chapter 4, second half: load filters and the test bench.

use twinrig_bench::{BenchFile, BenchParameters, BenchSettings};

use crate::error::TwinError;
use crate::thesis::context::Context;
use crate::thesis::error::ThesisError;
use crate::thesis::item::{Item, Measurements, PrintedFigure};
use crate::thesis::verdict::{Measurement, Rule};

const WEIGHT: &str = "no sensor was made, and masses of cells are not simulated";
const FITTED: &str = "the simulated cell is fitted to the printed figure";
const MISPRINT: &str = "of the maker's data of the 90 W motor at 24 V";
const MANY_MINIMA: &str = "the sign depends on the covariances: the objective of F2 has several \
                           minima, and its coefficients are right at some frequencies only";

const fn demand(
    key: &'static str,
    quantity: &'static str,
    value: f64,
    unit: &'static str,
    rule: Rule,
) -> PrintedFigure {
    PrintedFigure::value(key, quantity, "table 4.1", value, unit).rule(rule, "a demand")
}

pub(super) const ITEMS: &[Item] = &[
    Item {
        id: "table-4-1",
        title: "Demands on a sensor of the load of a leg",
        place: "4.1.1, table 4.1",
        run_s: 0.1,
        figures: &[
            demand("most", "greatest load", 20.0, "N", Rule::AtLeast(20.0))
                .remark("of the reference cell on the bench, 12 mm cam"),
            demand("least", "least load", 0.0, "N", Rule::AtMost(1.0))
                .remark("the springs of the bench have a preload of 0.2 mm"),
            demand(
                "frequency",
                "frequency of the load",
                4.0,
                "Hz",
                Rule::AtLeast(4.0),
            ),
            demand("error-2", "error at 2 Hz", 200.0, "mN", Rule::AtMost(200.0))
                .remark("RMS of the estimate by the filter F3, which has both cells"),
            demand(
                "error-4",
                "error at 4.2 Hz",
                200.0,
                "mN",
                Rule::AtMost(200.0),
            )
            .remark("RMS of the estimate by the filter F3, which has both cells"),
            demand("delay", "time of a sample", 10.0, "ms", Rule::AtMost(10.0))
                .remark("delay of the estimate behind the load, at samples of 1 ms"),
            demand("tip", "weight at the tip", 2.0, "g", Rule::NotReproducible).remark(WEIGHT),
            demand(
                "total",
                "weight on the robot",
                20.0,
                "g",
                Rule::NotReproducible,
            )
            .remark(WEIGHT),
        ],
        measure: table_4_1,
        commands: &["twin run scenarios/bench.toml"],
    },
    Item {
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
        measure: fig_4_7,
        commands: &["twin run scenarios/thesis/fig-4-8.toml"],
    },
    Item {
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
            .rule(Rule::AtMost(0.7), "5 % of the load of 14 N"),
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
                Rule::Between(1.4, 14.0),
                "a tenth of the load to all of it, in 8 s",
            ),
            PrintedFigure::statement(
                "lost",
                "piezoresistive cell alone: RMS error",
                "4.3.1.2, figure 4.8",
                "is lost soon",
                "N",
            )
            .rule(Rule::AtLeast(14.0), "the load itself")
            .remark("its gradient vanishes in saturation"),
        ],
        measure: fig_4_8,
        commands: &["twin run scenarios/thesis/fig-4-8.toml"],
    },
    Item {
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
                "variance of the noise, piezoelectric over piezoresistive",
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
        measure: fig_4_9,
        commands: &["twin study estimate"],
    },
    Item {
        id: "fig-4-10",
        title: "Test bench",
        place: "4.3.2.1, figure 4.10",
        run_s: 0.2,
        figures: &[
            PrintedFigure::value("cam-1", "greatest force, cam of 1 mm", "4.3.2.1", 2.34, "N")
                .rule(Rule::Within(0.05), "rounding of the cam and scratches"),
            PrintedFigure::value(
                "cam-12",
                "greatest force, cam of 12 mm",
                "4.3.2.1",
                28.0,
                "N",
            )
            .rule(Rule::Within(0.05), "two printed digits"),
            PrintedFigure::value(
                "stall",
                "stall torque of the motor",
                "4.3.2.1",
                51.3,
                "mN·m",
            )
            .rule(Rule::Within(0.05), "data of the maker")
            .remark(MISPRINT),
            PrintedFigure::value(
                "speed",
                "greatest speed of the motor",
                "4.3.2.1",
                163e3,
                "1/min",
            )
            .rule(Rule::Within(0.05), "data of the maker")
            .remark(MISPRINT),
        ],
        measure: fig_4_10,
        commands: &["twin run scenarios/bench.toml"],
    },
    Item {
        id: "fig-4-11",
        title: "Piezoresistive cell under a dynamic load",
        place: "4.3.2.2, figure 4.11",
        run_s: 4.0,
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
        measure: fig_4_11,
        commands: &[
            "twin study estimate",
            "twin run scenarios/thesis/fig-4-11.toml",
        ],
    },
    Item {
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
        measure: |_| Ok(Measurements::default()),
        commands: &[],
    },
    Item {
        id: "fig-4-13",
        title: "Piezoelectric cell with preload",
        place: "4.3.2.2, figure 4.13",
        run_s: 4.0,
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
                "R² of exponentials through a and b over the frequency, the worse",
                "4.3.2.2",
                "both fall exponentially",
                "",
            )
            .rule(Rule::AtLeast(0.99), "a hundredth of the variance")
            .remark("charge amplifier and silicone, whose model knows no frequency"),
        ],
        measure: fig_4_13,
        commands: &["twin study estimate"],
    },
    Item {
        id: "fig-4-14",
        title: "Residuals of the identification",
        place: "4.3.2.3, figure 4.14",
        run_s: 4.0,
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
        measure: fig_4_14,
        commands: &["twin study estimate"],
    },
    Item {
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
                "deviation of the estimate at 1 Hz, greatest over least",
                "4.3.2.3, figure 4.15",
                "greatest at the maxima",
                "×",
            )
            .rule(Rule::AtLeast(2.0), "visible in the figure")
            .remark("in saturation the piezoresistive cell adds nothing"),
        ],
        measure: fig_4_15,
        commands: &[
            "twin run scenarios/thesis/fig-4-15.toml",
            "twin study estimate",
        ],
    },
];

fn table_4_1(context: &Context<'_>) -> Result<Measurements, TwinError> {
    let mut found = Measurements::default();
    let run = context.run("bench.toml")?;
    found.add("most", run.measured("loads up to 20 N and more")?);
    found.add("least", run.measured("loads down to 1 N and less")?);
    let rate = run.measured("turns 4.2 times a second")?;
    found.add(
        "frequency",
        rate.map(|rate| rate.times(1.0 / std::f64::consts::TAU)),
    );
    for (key, expectation) in [
        ("error-2", "error of the estimate at 2 Hz"),
        ("error-4", "error of the estimate at 4.2 Hz"),
        ("delay", "delay of the estimate at 2 Hz"),
    ] {
        let measured = run.measured(expectation)?;
        found.add(key, measured.map(|value| value.times(1e3)));
    }
    Ok(found)
}

fn fig_4_7(_: &Context<'_>) -> Result<Measurements, TwinError> {
    const X: f64 = 0.9;
    let mut found = Measurements::default();
    let exponent = |x: f64| 1.0 / (1.0 - x * x);
    let over_maximum = libm::exp(exponent(X) - exponent(0.0));
    found.set("bump", over_maximum);
    found.set("bump-minus", 1.0 / over_maximum);
    Ok(found)
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

/// Greatest force on the sensor.
const GREATEST: &str = r#"
[[expect]]
name = "greatest force"
signal = { name = "bench/force", eventually = { min = "1000 N" } }
after = "2.5 s"
before = "4 s"
"#;

fn fig_4_10(context: &Context<'_>) -> Result<Measurements, TwinError> {
    const FILE: &str = "bench.toml";
    let mut found = Measurements::default();
    for (key, cam) in [("cam-1", "\"1 mm\""), ("cam-12", "\"12 mm\"")] {
        let settings = [("plant.cam", cam), ("plant.preload", "\"0 mm\"")];
        let run = context.run_with(FILE, &settings, GREATEST)?;
        found.add(key, run.measured("greatest force")?);
    }
    let motor = parameters(context, FILE)?.motor;
    let (volts, constant) = (motor.voltage, motor.torque_constant);
    found.set("stall", 1e3 * constant * volts / motor.resistance);
    found.set("speed", 60.0 / std::f64::consts::TAU * volts / constant);
    Ok(found)
}

/// Returns the bench of a scenario.
fn parameters(context: &Context<'_>, scenario: &str) -> Result<BenchParameters, TwinError> {
    let path = context.path(scenario)?;
    let folder = path.parent().unwrap_or("".as_ref());
    let file = BenchFile::find("tactile", folder)?.ok_or_else(|| ThesisError::Lacks {
        file: scenario.to_owned(),
        what: "bench",
    })?;
    Ok(file.bench(&BenchSettings::default())?)
}

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
