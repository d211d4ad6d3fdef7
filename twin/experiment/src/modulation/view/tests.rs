//! Tables of synthetic results, in which every value differs.

use twinrig_kernel::SimTime;

use super::*;
use crate::modulation::{IdealSlope, ModulationCase, ModulationInput, ModulationPlan};
use crate::page_parts::{assert_cards, rows};

fn cell(by: f64, step: usize, mean_m: f64) -> DisplacementCell {
    DisplacementCell {
        by,
        step,
        count: 40,
        missing: 3,
        mean_m,
        deviation_m: 0.1 * mean_m.abs(),
        range_m: [-5.0 * mean_m, 5.0 * mean_m],
        with_change: 30,
    }
}

fn table() -> DisplacementTable {
    let model = |form: ModelForm, number: f64| LinearModel {
        form,
        slope: 1.25 + number,
        interval: Some([1.5 + number, 1.75 + number]),
        second: -0.5 - number,
        r_squared: 0.75 + 0.0625 * number,
    };
    DisplacementTable {
        counting: Counting::Cycle,
        cells: vec![
            cell(-0.005, 1, -0.011),
            cell(-0.005, 2, 0.012),
            cell(-0.010, 1, -0.013),
            cell(-0.010, 2, -0.014),
        ],
        r_squared: vec![Some(0.91), Some(0.92)],
        models: ModelForm::ALL
            .into_iter()
            .zip([1.0, 2.0, 3.0])
            .map(|(form, number)| model(form, number))
            .collect(),
        first_step: Some(0.837),
        opposite: Some(cell(-0.005, 2, 0.012)),
    }
}

fn study() -> ModulationStudy {
    let case = CaseResult {
        case: ModulationCase {
            gait: "trot".to_owned(),
            plant: "full".to_owned(),
            factor: "as given".to_owned(),
            after: SimTime::ZERO,
            value: 0.1,
            duty: Some(0.5),
        },
        legs: Vec::new(),
        points_s: Vec::new(),
        period_s: 1.0,
        measured_duty: 0.6,
        runs: 20,
        fell: 5,
        failed: vec!["it snapped".to_owned()],
        displacements: Vec::new(),
        tables: vec![table()],
        ideal: Some(IdealSlope {
            by_duty: 2.01,
            by_stride: 2.02,
            first_step: -2.03,
        }),
        why: None,
    };
    ModulationStudy {
        input: ModulationInput {
            name: "trot".to_owned(),
            files: Vec::new(),
            variable: "step length".to_owned(),
            unit: Unit::Meter,
            cases: Vec::new(),
            left_out: Vec::new(),
        },
        plan: ModulationPlan {
            changes: vec![-0.005, -0.010],
            points: 10,
            steps: 2,
        },
        cases: vec![case],
    }
}

#[test]
fn models_have_their_values_below_their_heads() {
    assert_eq!(
        rows(&models(&study())),
        [
            "gait | plant | factor | counted by | k, (k n + k₀) Δ | 95 % | k₀ | k by geometry \
             | k₀ by geometry | stride over step | R² | R², k n Δ | R², k n Δ + c \
             | first step with Δ | greatest mean against Δ | missing | fell | of",
            "trot | full | as given | cycle | 4.250 | 4.50 … 4.75 | −3.50 | 2.01 | −2.03 | 2.02 \
             | 0.938 | 0.812 | 0.875 | 83 % | 12.0 mm at step 2, −5 mm | 12 | 5 | 20",
        ]
    );
    assert_cards(
        &cards(&study().cases[0]),
        [
            ["by cycle: displacement per step", "4.25 Δ", "R² 0.938"],
            [
                "by cycle: first step with Δ",
                "83 %",
                "greatest mean against Δ 12.0 mm",
            ],
        ],
    );
}

#[test]
fn means_have_their_deviations_and_correlations() {
    let study = study();
    let with_deviations = means(&study, &table(), true);
    assert_eq!(
        rows(&with_deviations),
        [
            "Δ | 1 | 2",
            "−5 mm | −11.0 ± 1.1 | 12.0 ± 1.2",
            "−10 mm | −13.0 ± 1.3 | −14.0 ± 1.4",
            "R² on Δ | 0.910 | 0.920",
        ]
    );
    let bare = means(&study, &table(), false);
    assert_eq!(rows(&bare)[1], "−5 mm | −11.0 | 12.0");
    // The only mean against its change.
    let html = with_deviations.html();
    assert_eq!(html.matches("class=\"doubtful\"").count(), 1);
    assert!(html.contains("<span class=\"doubtful\">12.0 ± 1.2</span>"));
}
