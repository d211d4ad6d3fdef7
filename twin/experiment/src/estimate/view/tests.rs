//! Tables of synthetic results, in which every value differs.

use twinrig_estimate::fit::{AmplifierFit, CoefficientFit, Fitted};
use twinrig_estimate::{
    ChargeAmplifier, Decay, Hysteresis, Model, Settings, Sigmoid, StateSettings,
};

use super::*;
use crate::estimate::{FilterRow, Identification, SearchSize, TunedFilter};
use crate::measured::Starts;
use crate::page_parts::{assert_cards, rows};

fn fitted<M>(model: M, r_squared: f64) -> Fitted<M> {
    Fitted {
        model,
        r_squared,
        residual: 0.25,
        iterations: 6,
    }
}

fn identification() -> Identification {
    let decay = |value: f64, scale_hz: f64| Decay { value, scale_hz };
    let sigmoid = |a: f64| Sigmoid {
        a,
        b: -1.0,
        c: -6.0,
        d: 0.5,
    };
    let hysteresis = Hysteresis {
        loading: sigmoid(2.0),
        unloading: sigmoid(3.0),
        switch: 1.0,
    };
    let amplifier = AmplifierFit {
        amplifier: ChargeAmplifier {
            sensitivity: -0.031,
            feedback_s: 0.032,
            lag_s: 0.033,
        },
        bias: 0.034,
    };
    Identification {
        hysteresis: fitted(hysteresis, 0.991),
        rate_sensor: fitted([0.041, 0.042], 0.992),
        frequencies: vec![1.5],
        coefficients: CoefficientFit {
            runs: vec![fitted([0.051, -0.052, 0.053], 0.993)],
            rate: fitted(decay(0.061, 7.0), 0.994),
            acceleration: fitted(decay(0.062, 8.0), 0.995),
        },
        planes_r_squared: 0.996,
        exponentials_r_squared: 0.997,
        amplifier: fitted(amplifier, 0.998),
        residuals: Vec::new(),
    }
}

fn row(hz: Option<f64>) -> FilterRow {
    FilterRow {
        filter: "F1",
        hz,
        periods: 9,
        force_rmse_n: 0.11,
        rate_rmse_n_s: 0.12,
        rate_rms_n_s: 0.13,
        maxima: 1.014,
        minima_n: 0.15,
        deviation_at_maxima_n: 0.16,
        deviation_at_minima_n: 0.17,
        nis: 1.18,
        nis_band: [1.1, 1.2],
        nees: 1.19,
        nees_band: [0.8, 0.9],
    }
}

fn study() -> EstimateStudy {
    let filter = TunedFilter {
        kind: FilterKind::F1,
        settings: Settings {
            model: Model::F1 {
                gain: 0.07,
                states: [StateSettings::default(); 3],
            },
            piezoresistive: None,
            piezoelectric: None,
            frequency: None,
            period_s: 0.001,
            white: 0.0,
            recovery: None,
        },
        cost: [-1.5, -2.5],
        evaluations: 300,
        truncated: true,
        history: Vec::new(),
    };
    EstimateStudy {
        scenario: "stand".to_owned(),
        file: "stand.toml".to_owned(),
        simulated_s: 20.0,
        seeds: [1, 2, 3],
        frequency_signal: String::new(),
        search: SearchSize {
            particles: 4,
            iterations: 5,
        },
        budget_s: 60.0,
        identification: identification(),
        filters: vec![filter],
        rows: vec![row(Some(1.5)), row(None)],
        loop_points: Vec::new(),
        voltages: Vec::new(),
        estimates: Vec::new(),
        starts: Starts::default(),
        left_out: Vec::new(),
    }
}

#[test]
fn filters_have_their_values_below_their_heads() {
    let study = study();
    let values = "9 | 110 mN | 120 mN/s | 130 mN/s | 1.014 | 150 mN | 160 mN | 170 mN | 1.180 \
                  | 1.100 … 1.200 | 1.190 | 0.800 … 0.900";
    assert_eq!(
        rows(&validation(&study)),
        [
            "filter | frequency | periods | force: RMS | rate: RMS | rate, of the truth | maxima \
             | minima | σ at maxima | at minima | NIS | 95 % | NEES | 95 %"
                .to_owned(),
            format!("F1 | 1.5 Hz | {values}"),
            format!("F1 | all | {values}"),
        ]
    );
    // Outside of its band in both rows.
    let html = validation(&study).html();
    assert_eq!(
        html.matches("<span class=\"doubtful\">1.190</span>")
            .count(),
        2
    );
    assert_eq!(html.matches("class=\"doubtful\"").count(), 2);
    assert_eq!(
        rows(&tuning(&study)),
        [
            "filter | −ln O before | tuned | evaluations |  | why",
            "F1 | −1.500 | −2.500 | 300 | the thesis' first filter: force, rate, bias \
             | ended by the budget",
        ]
    );
    assert_cards(
        &cards(&study),
        [["F1: force, RMS error", "0.11 N", FilterKind::F1.about()]],
    );
}

#[test]
fn cells_have_their_values_below_their_heads() {
    let study = study();
    assert_eq!(
        rows(&coefficients(&study)),
        [
            "frequency | a [V·s/N] | b [V·s²/N] | offset [V] | R²",
            "1.5 Hz | 0.051000 | −0.0520000 | 0.05300 | 0.993000",
            "charge amplifier | k −0.031000 | 32 ms, 33 ms |  | 0.998000",
        ]
    );
    let compared = rows(&thesis(&study));
    let figure = "R² of the hysteresis (fig. 4.11) | 0.995 | holds | 0.99100 | the form is";
    assert!(compared[1].starts_with(figure), "{compared:?}");
    assert_eq!(compared[0], "quantity | printed |  | ours | why");
}
