//! Studies of load filters on synthetic samples with known parameters.

use std::cell::Cell;
use std::f64::consts::TAU;

use twinrig_estimate::{ChargeAmplifier, Hysteresis, Sigmoid};
use twinrig_experiment::{
    EstimateInput, EstimatePlan, EstimateStudy, FilterKind, LoadRecorder, LoadRun, LoadSample,
    SearchSize, SteadyPart, StudyError, estimate,
};
use twinrig_kernel::stream;

use crate::pages::{elements, machine};

/// Cells with known parameters: the saturation is slow, so that its harmonics pass the filter.
const CELL: Hysteresis = Hysteresis {
    loading: Sigmoid {
        a: 3.0,
        b: -0.3,
        c: -8.0,
        d: 0.6,
    },
    unloading: Sigmoid {
        a: 3.0,
        b: -0.3,
        c: -7.0,
        d: 0.6,
    },
    switch: 0.5,
};
const AMPLIFIER: ChargeAmplifier = ChargeAmplifier {
    sensitivity: -0.05,
    feedback_s: 0.1,
    lag_s: 0.005,
};
/// Offset of the piezoelectric voltage \[V\].
const OFFSET: f64 = 0.02;
/// Deviation of the noise of the voltages \[V\]: of 16 bits over ±10 V.
const NOISE: f64 = 0.3e-3;

/// Bench of a force A (1 − cos 2πft) at a kilohertz.
pub struct Bench {
    input: EstimateInput,
    frequencies: &'static [f64],
    /// Periods of each frequency.
    periods: f64,
    /// Changes the samples of a run.
    spoil: fn(&mut Vec<LoadSample>),
    /// Number of runs.
    runs: Cell<usize>,
}

impl Bench {
    pub fn new(frequencies: &'static [f64], periods: f64) -> Self {
        Self {
            input: EstimateInput {
                name: "a <bench>".to_owned(),
                file: "bench.toml".to_owned(),
                duration_s: 10.0,
                seed: 7,
                frequency_signal: "motor/cam/frequency".to_owned(),
            },
            frequencies,
            periods,
            spoil: |_| {},
            runs: Cell::new(0),
        }
    }
}

impl LoadRecorder for Bench {
    fn input(&self) -> &EstimateInput {
        &self.input
    }

    /// The amplifier by its exact transition over a millisecond, in which the rate is a straight
    /// line to a millionth.
    fn record(&self, seed: u64) -> Result<LoadRun, String> {
        self.runs.set(self.runs.get() + 1);
        let mut noise = stream(seed, "bench");
        let (transition, _) = AMPLIFIER.transition(1e-3);
        let mut run = LoadRun::default();
        let (mut phase, mut crystal, mut voltage) = (0.0, 0.0, 0.0);
        let mut ms = 0_u64;
        for &hz in self.frequencies {
            let from_ns = (ms + 1000) * 1_000_000;
            let length = 1.0 + self.periods / hz;
            let milliseconds = (0_u64..).take_while(|&n| (n as f64) < 1000.0 * length);
            for n in milliseconds {
                let omega = TAU * hz;
                let force = 0.5 + 14.0 * (1.0 - libm::cos(phase));
                let rate = 14.0 * omega * libm::sin(phase);
                let acceleration = 14.0 * omega * omega * libm::cos(phase);
                let resistive = CELL.at(force, rate).voltage;
                run.samples.push(LoadSample {
                    at_ns: ms * 1_000_000,
                    volts: [
                        resistive + NOISE * noise.normal(),
                        voltage + OFFSET + NOISE * noise.normal(),
                    ],
                    reference: force + 1e-3 * noise.normal(),
                    saturated: [false; 3],
                    frequency: n.is_multiple_of(10).then_some(hz),
                });
                let state = [rate, acceleration, crystal, voltage];
                let row = |row: usize| -> f64 {
                    let terms = state.iter().enumerate();
                    terms.map(|(k, x)| transition[(row, k + 1)] * x).sum()
                };
                (crystal, voltage) = (row(3), row(4));
                phase += omega * 1e-3;
                ms += 1;
            }
            run.steady.push(SteadyPart {
                hz,
                from_ns,
                to_ns: ms * 1_000_000,
            });
        }
        (self.spoil)(&mut run.samples);
        Ok(run)
    }
}

pub fn plan(particles: usize, iterations: usize) -> EstimatePlan {
    EstimatePlan {
        search: SearchSize {
            particles,
            iterations,
        },
        budget_s: 1e6,
    }
}

fn study(particles: usize, iterations: usize) -> EstimateStudy {
    let bench = Bench::new(&[0.5, 1.0, 2.5], 5.0);
    estimate(&bench, &plan(particles, iterations), &mut ()).unwrap()
}

/// Coefficients of a sine follow from the response of the amplifier at its frequency:
/// V/Ḟ = −k/((1 + jωT₁)(1 + jωT₂)) = a + jω b.
#[test]
fn identification_returns_the_parameters_of_the_samples() {
    let study = study(1, 0);
    let found = &study.identification;
    let amplifier = found.amplifier.model;
    let near = |found: f64, expected: f64, share: f64| {
        assert!(
            (found / expected - 1.0).abs() < share,
            "{found} instead of {expected}"
        );
    };
    near(amplifier.amplifier.sensitivity, AMPLIFIER.sensitivity, 1e-3);
    near(amplifier.amplifier.feedback_s, AMPLIFIER.feedback_s, 2e-3);
    near(amplifier.amplifier.lag_s, AMPLIFIER.lag_s, 2e-2);
    near(amplifier.bias, OFFSET, 1e-2);
    for (hz, plane) in found.frequencies.iter().zip(&found.coefficients.runs) {
        let omega = TAU * hz;
        let (t1, t2) = (omega * AMPLIFIER.feedback_s, omega * AMPLIFIER.lag_s);
        let size = (1.0 + t1 * t1) * (1.0 + t2 * t2);
        near(
            plane.model[0],
            -AMPLIFIER.sensitivity * (1.0 - t1 * t2) / size,
            2e-3,
        );
        let b = AMPLIFIER.sensitivity * (t1 + t2) / (omega * size);
        near(plane.model[1], b, 2e-3);
        assert!(plane.r_squared > 0.9997, "{plane:?}");
    }
    // The filter without phase halves the harmonics at 10 Hz, which the corner of the loop has.
    let cell = found.hysteresis.model;
    assert!(found.hysteresis.r_squared > 0.999, "{:?}", found.hysteresis);
    for (branch, expected) in [
        (cell.loading, CELL.loading),
        (cell.unloading, CELL.unloading),
    ] {
        near(branch.c, expected.c, 0.05);
        near(branch.b, expected.b, 0.1);
        near(branch.a, expected.a, 0.1);
    }
}

#[test]
fn search_improves_every_filter_and_fusion_is_better_than_a_single_cell() {
    let study = study(12, 8);
    for filter in &study.filters {
        let [before, after] = filter.cost;
        assert!(after < before, "{:?}: {before} to {after}", filter.kind);
        let swarms = if filter.kind == FilterKind::F2 { 3 } else { 1 };
        assert_eq!(filter.evaluations, swarms * 12 * 9);
        assert!(!filter.truncated);
        let falls = filter.history.windows(2).all(|pair| pair[1] <= pair[0]);
        assert!(falls, "{:?}", filter.history);
    }
    let error = |filter: &str| study.row(filter, None).unwrap().force_rmse_n;
    assert!(
        error("F3") < 0.5 * error("piezoresistive-only"),
        "{:?}",
        study.rows
    );
    assert!(
        error("F3") < 0.5 * error("piezoelectric-only"),
        "{:?}",
        study.rows
    );
    // Three frequencies and all of them, of five filters.
    assert_eq!(study.rows.len(), 20);
    let row = study.row("F3", Some(1.0)).unwrap();
    assert_eq!(
        row.periods, 4,
        "five periods are four from middle to middle"
    );
    assert!((row.maxima - 1.0).abs() < 0.05, "{row:?}");
}

#[test]
fn results_are_the_same_twice_bit_for_bit() {
    let [first, second] = [study(6, 2), study(6, 2)];
    let text = |study: &EstimateStudy| study.json(&machine(), "").to_string();
    assert_eq!(text(&first), text(&second));
    assert_eq!(first.csv(), second.csv());
}

#[test]
fn page_is_well_formed_and_shows_every_figure() {
    let study = study(6, 2);
    let page = study.page(&machine(), "twin study <&> it").html();
    if let Some(folder) = std::env::var_os("STUDY_PAGES") {
        std::fs::write(std::path::Path::new(&folder).join("estimate.html"), &page).unwrap();
    }
    let elements = elements(&page);
    let count = |name: &str| elements.iter().filter(|it| *it == name).count();
    for absent in ["script", "link", "img", "iframe"] {
        assert_eq!(count(absent), 0, "{absent}");
    }
    for absent in ["http:", "https:", "url(", "NaN", "inf "] {
        assert!(!page.contains(absent), "{absent}");
    }
    // The loop, two voltages, three histograms, and two filters at two frequencies.
    assert_eq!(count("figure"), 1 + 2 + 3 + 4);
    assert_eq!(count("polygon"), 4, "± 3σ");
    for figure in ["4.11", "4.13", "4.14", "4.15"] {
        assert!(page.contains(&format!("Figure {figure}")), "{figure}");
    }
    for text in ["a &lt;bench&gt;", "[bus.filter.F3]", "too low", "0.9997"] {
        assert!(page.contains(text), "{text}");
    }
    let rows = study.csv().lines().count();
    assert_eq!(rows, 1 + 20);
}

#[test]
fn unsuitable_runs_are_errors() {
    let plan = plan(1, 0);
    let mut bench = Bench::new(&[1.0], 5.0);
    let error = |bench: &Bench| estimate(bench, &plan, &mut ()).unwrap_err();
    assert!(matches!(
        error(&bench),
        StudyError::FewFrequencies {
            found: 1,
            required: 2,
            ..
        }
    ));
    bench = Bench::new(&[1.0, 2.0], 3.0);
    assert!(matches!(
        error(&bench),
        StudyError::FewFrequencies { found: 0, .. }
    ));
    bench = Bench::new(&[1.0, 2.0], 6.0);
    bench.spoil = |samples| {
        samples.remove(500);
    };
    assert_eq!(error(&bench), StudyError::MissingSamples { gaps: 1 });
    bench.spoil = |samples| samples[500].saturated[2] = true;
    assert_eq!(error(&bench), StudyError::ReferenceSaturated { samples: 1 });
    bench.spoil = Vec::clear;
    assert!(matches!(
        error(&bench),
        StudyError::FewSamples { found: 0, .. }
    ));
}

/// Stops at the third report.
struct Impatient(usize);

impl twinrig_experiment::ProgressObserver for Impatient {
    fn at(&mut self, _: usize, _: usize, _: &str) -> bool {
        self.0 += 1;
        self.0 < 3
    }
}

#[test]
fn observer_ends_the_study_and_the_budget_ends_searches() {
    let bench = Bench::new(&[1.0, 2.0], 6.0);
    let stopped = estimate(&bench, &plan(4, 4), &mut Impatient(0));
    assert!(matches!(stopped, Err(StudyError::Interrupted { .. })));
    assert_eq!(bench.runs.get(), 2, "the run for validation is not begun");
    let short = EstimatePlan {
        budget_s: 1e-3,
        ..plan(4, 1_000_000)
    };
    let study = estimate(&bench, &short, &mut ()).unwrap();
    assert_eq!(study.cut().count(), 5);
    assert!(
        study
            .filters
            .iter()
            .all(|filter| filter.cost[1] <= filter.cost[0])
    );
}
