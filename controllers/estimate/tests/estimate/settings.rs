//! Invalid settings are errors that name the entry.

use crate::support::{CELL, LINEAR, f1, f2, f3, settings};
use twinrig_estimate::{
    Butterworth, ChargeAmplifier, EstimateError, ForceEstimator, ForceResponse, Hysteresis, Model,
    Piezoresistive, Settings, Sigmoid,
};

fn error(settings: &Settings) -> String {
    ForceEstimator::new(settings).unwrap_err().to_string()
}

#[test]
fn each_variance_is_checked_by_name() {
    for model in [f1(), f2(), f3()] {
        let valid = settings(model, LINEAR);
        assert!(ForceEstimator::new(&valid).is_ok());
        for value in [-1.0, f64::NAN, f64::INFINITY] {
            for (i, name) in model.names().iter().enumerate() {
                let mut invalid = valid;
                invalid.model.states_mut()[i].noise = value;
                let expected =
                    format!("variance of {name} is {value}; it has to be finite and zero or more");
                assert!(error(&invalid).contains(&expected), "{}", error(&invalid));
                let mut invalid = valid;
                invalid.model.states_mut()[i].variance = value;
                assert!(error(&invalid).contains(&expected));
                let mut invalid = valid;
                invalid.model.states_mut()[i].initial = f64::NAN;
                assert!(error(&invalid).contains(&format!("{name} is NaN")));
            }
        }
        for value in [0.0, -1e-9, f64::NAN] {
            let mut invalid = valid;
            invalid.piezoelectric = Some(value);
            let message = error(&invalid);
            assert!(message.contains("piezoelectric cell is"), "{message}");
            assert!(message.ends_with("finite and positive"), "{message}");
            let mut invalid = valid;
            let cell = invalid.piezoresistive.as_mut().unwrap();
            cell.variance = value;
            assert!(error(&invalid).contains("piezoresistive cell is"));
            invalid = valid;
            invalid.frequency = Some(value);
            assert!(error(&invalid).contains("measured frequency is"));
            invalid = valid;
            invalid.period_s = value;
            assert!(error(&invalid).contains("period"));
            invalid = valid;
            invalid.recovery = Some(value);
            assert!(error(&invalid).contains("recovery"));
        }
    }
}

#[test]
fn a_filter_requires_its_sensors() {
    let mut blind = settings(f2(), LINEAR);
    blind.frequency = None;
    assert_eq!(ForceEstimator::new(&blind), Err(EstimateError::NoFrequency));
    for model in [f1(), f3()] {
        let mut none = settings(model, LINEAR);
        none.piezoresistive = None;
        assert!(ForceEstimator::new(&none).is_ok());
        none.piezoelectric = None;
        assert_eq!(ForceEstimator::new(&none), Err(EstimateError::NoSensor));
    }
}

#[test]
fn parameters_of_cells_are_checked() {
    let with = |loading| {
        let response = ForceResponse::Hysteresis(Hysteresis { loading, ..CELL });
        let mut settings = settings(f1(), LINEAR);
        settings.piezoresistive = Some(Piezoresistive {
            response,
            variance: 1.0,
        });
        settings
    };
    let flat = Sigmoid {
        b: 0.0,
        ..CELL.loading
    };
    assert!(error(&with(flat)).contains("steepness b of a sigmoid is 0"));
    let amplifier = |feedback_s, lag_s| {
        let mut settings = settings(f3(), LINEAR);
        let Model::F3 { states, .. } = settings.model else {
            unreachable!()
        };
        settings.model = Model::F3 {
            amplifier: ChargeAmplifier {
                sensitivity: 0.05,
                feedback_s,
                lag_s,
            },
            states,
        };
        error(&settings)
    };
    assert!(amplifier(0.0, 1.0).contains("feedback time"));
    assert!(amplifier(1.0, -1.0).contains("lag of the piezoelectric cell is -1"));
    for (order, cutoff, rate) in [
        (3, 10.0, 1e3),
        (0, 10.0, 1e3),
        (4, 500.0, 1e3),
        (4, 0.0, 1e3),
        (4, 10.0, f64::NAN),
    ] {
        let error = Butterworth::new(order, cutoff, rate);
        assert!(
            matches!(error, Err(EstimateError::Value { .. })),
            "{error:?}"
        );
    }
    let filter = Butterworth::new(4, 10.0, 1e3).unwrap();
    assert!(filter.zero_phase(&[0.0; 15]).is_err());
    assert!(filter.zero_phase(&[0.0; 16]).is_ok());
}
