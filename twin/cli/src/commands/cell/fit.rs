//! `twin cell fit`: tables 4.4 and 4.5 of the thesis, recomputed.

mod text;

use serde::Serialize;
use twinrig_sensor::SensorError;
use twinrig_sensor::design::{
    CELLS, CellResponse, Effect, Electrode, Elimination, LinearModel, PrintedModel, THRESHOLD,
};

use super::report::key;

/// The design, and models of all responses.
#[derive(Debug, Serialize)]
pub(super) struct FitReport {
    cells: Vec<CellRow>,
    /// Effect that is constant over the design.
    defining_relation: Vec<String>,
    /// Pairs of two-factor interactions that the design cannot distinguish.
    aliased: Vec<[String; 2]>,
    threshold: f64,
    models: Vec<Models>,
}

/// Row of table 4.4.
#[derive(Debug, Serialize)]
struct CellRow {
    r#type: &'static str,
    layers: u32,
    glue: bool,
    length_m: f64,
    width_m: f64,
    /// Glue, layer, shape, length, width.
    coded: [f64; 5],
    sensitivity_s_per_n: f64,
    base_conductance_s: f64,
    saturation_load_n: f64,
    r_squared: f64,
}

/// Models of a response.
#[derive(Debug, Serialize)]
struct Models {
    response: &'static str,
    /// Name and unit.
    #[serde(skip)]
    title: String,
    /// The model of the thesis, recomputed.
    recomputed: Model,
    /// As table 4.5 has it.
    printed: Model,
    /// Greatest relative difference between the two.
    difference: f64,
    elimination: Selection,
}

/// Result of backward elimination.
#[derive(Debug, Serialize)]
struct Selection {
    /// Whether the effects are those of the thesis.
    same: bool,
    removed: Vec<Removed>,
    model: Model,
}

#[derive(Debug, Serialize)]
struct Removed {
    effect: String,
    p: f64,
}

#[derive(Debug, Serialize)]
struct Model {
    constant: f64,
    effects: Vec<Row>,
    residual: Residual,
    p: f64,
}

/// Row of an effect of one degree of freedom.
#[derive(Debug, Serialize)]
struct Row {
    effect: String,
    /// Two-factor interaction that the design cannot distinguish from the effect.
    alias: Option<String>,
    coefficient: f64,
    sum_of_squares: f64,
    f: f64,
    p: f64,
}

#[derive(Debug, Serialize)]
struct Residual {
    sum_of_squares: f64,
    degrees_of_freedom: u32,
    mean_square: f64,
}

/// Returns the two-factor interaction aliased with an interaction.
fn alias(effect: Effect) -> Option<Effect> {
    let aliases = effect.aliases().into_iter();
    let mut pairs = aliases.filter(|(alias, _)| effect.order() == 2 && alias.order() == 2);
    pairs.next().map(|(alias, _)| alias)
}

impl Row {
    fn of(effect: Effect, [coefficient, sum_of_squares, f, p]: [f64; 4]) -> Self {
        Self {
            effect: effect.to_string(),
            alias: alias(effect).map(|alias| alias.to_string()),
            coefficient,
            sum_of_squares,
            f,
            p,
        }
    }
}

impl From<&LinearModel> for Model {
    fn from(model: &LinearModel) -> Self {
        let rows = model.effects.iter();
        let rows =
            rows.map(|it| Row::of(it.effect, [it.coefficient, it.sum_of_squares, it.f, it.p]));
        Self {
            constant: model.constant,
            effects: rows.collect(),
            residual: Residual {
                sum_of_squares: model.residual,
                degrees_of_freedom: model.freedom,
                mean_square: model.variance(),
            },
            p: model.p,
        }
    }
}

impl From<&PrintedModel> for Model {
    fn from(model: &PrintedModel) -> Self {
        let rows = model.effects.iter();
        let rows =
            rows.map(|it| Row::of(it.effect, [it.coefficient, it.sum_of_squares, it.f, it.p]));
        Self {
            constant: model.constant,
            effects: rows.collect(),
            residual: Residual {
                sum_of_squares: model.residual,
                degrees_of_freedom: model.freedom,
                mean_square: model.variance,
            },
            p: model.p,
        }
    }
}

impl Model {
    /// Figures, in the order of the table.
    fn figures(&self) -> Vec<f64> {
        let rows = self.effects.iter();
        let rows = rows.flat_map(|row| [row.coefficient, row.sum_of_squares, row.f, row.p]);
        let residual = [self.residual.sum_of_squares, self.residual.mean_square];
        let whole = [self.constant, self.p];
        whole.into_iter().chain(residual).chain(rows).collect()
    }
}

impl Models {
    fn of(response: CellResponse) -> Result<Self, SensorError> {
        let printed = PrintedModel::of(response);
        let refit = printed.refit()?;
        let (recomputed, printed) = (Model::from(&refit), Model::from(printed));
        let figures = recomputed.figures().into_iter().zip(printed.figures());
        let difference = figures.map(|(ours, printed)| ((ours - printed) / printed).abs());
        let found = Elimination::of(response, THRESHOLD)?;
        let kept = |effect: Effect| found.model.effects.iter().any(|row| row.effect == effect);
        let same = found.model.effects.len() == refit.effects.len();
        let removed = found.removed.iter().map(|removal| Removed {
            effect: removal.effect.to_string(),
            p: removal.p,
        });
        Ok(Self {
            response: key(response),
            title: format!("{}, {}", response.name(), response.unit()),
            difference: difference.fold(0.0, f64::max),
            elimination: Selection {
                same: same && refit.effects.iter().all(|row| kept(row.effect)),
                removed: removed.collect(),
                model: Model::from(&found.model),
            },
            recomputed,
            printed,
        })
    }
}

impl FitReport {
    pub(super) fn new() -> Result<Self, SensorError> {
        let cells = CELLS.iter().map(|cell| {
            let design = cell.design();
            CellRow {
                r#type: match design.electrode {
                    Electrode::A => "A",
                    Electrode::B => "B",
                },
                layers: design.layers,
                glue: design.glue,
                length_m: design.length,
                width_m: design.width,
                coded: cell.coded,
                sensitivity_s_per_n: cell.sensitivity,
                base_conductance_s: cell.base,
                saturation_load_n: cell.saturation,
                r_squared: cell.r_squared,
            }
        });
        let relation = Effect::CONSTANT.aliases().into_iter();
        let pairs = Effect::estimable().into_iter().filter_map(|effect| {
            let alias = alias(effect)?;
            Some([effect.to_string(), alias.to_string()])
        });
        let models: Result<_, _> = CellResponse::ALL.into_iter().map(Models::of).collect();
        Ok(Self {
            cells: cells.collect(),
            defining_relation: relation.map(|(effect, _)| effect.to_string()).collect(),
            aliased: pairs.collect(),
            threshold: THRESHOLD,
            models: models?,
        })
    }
}
