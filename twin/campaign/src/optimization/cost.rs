//! Costs of runs: one number, by which runs are ordered.

use serde::Serialize;

use super::space::Direction;
use crate::sweep::{ExpectationVerdict, RowExpectation, RowVerdict, SweepRow};

/// Expectation that a cost depends on.
#[derive(Clone, Debug, PartialEq)]
pub struct JudgedExpectation {
    /// Its name.
    pub name: String,
    /// End of its window \[s\]; none: the end of the run.
    pub before_s: Option<f64>,
    /// Whether its measured value is defined for runs in which the robot falls, by the time before
    /// the fall.
    pub rates_falls: bool,
}

/// Order of runs.
///
/// A run is better than another
///
/// 1. if only the other has an error;
/// 2. if only the other has no value of the objective; of two such runs the one that lasted longer,
///    up to a fall;
/// 3. if it violates fewer constraints; with as many, if it violates them less;
/// 4. if its objective is better.
///
/// A fall within the window of an expectation violates it as a constraint, and as the objective
/// leaves it without a value, unless it rates falls. So the order depends on the time before a fall
/// alone: a run may end there.
#[derive(Clone, Debug, PartialEq)]
pub struct CostRule {
    /// The objective.
    pub objective: JudgedExpectation,
    /// Which values of it are sought.
    pub direction: Direction,
    /// Expectations that have to hold.
    pub constraints: Vec<JudgedExpectation>,
    /// Greatest number of constraints of all cases of the search, so that their costs compare.
    pub constraints_most: usize,
}

/// Why a run has no value that counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum RunClass {
    /// All constraints hold.
    Feasible,
    /// A constraint is violated.
    Infeasible,
    /// The objective has no value.
    Unobserved,
    /// The run did not complete.
    Error,
}

impl RunClass {
    /// Returns the word of reports.
    pub fn word(self) -> &'static str {
        match self {
            Self::Feasible => "feasible",
            Self::Infeasible => "infeasible",
            Self::Unobserved => "unobserved",
            Self::Error => "error",
        }
    }
}

/// A run as a search sees it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Evaluation {
    /// Its cost: finite, and smaller for a better run.
    pub cost: f64,
    /// Class.
    pub class: RunClass,
    /// Value of the objective, in its SI unit.
    pub objective: Option<f64>,
    /// Number of violated constraints.
    pub violations: usize,
    /// Time of the fall \[s\].
    pub fell_at_s: Option<f64>,
    /// Simulated time \[s\].
    pub simulated_s: f64,
}

impl Evaluation {
    /// Returns the evaluation of a point by those of its runs, and the index of the one that
    /// counts: the worst one, of equal ones the first. The simulated time is that of all; none
    /// without a run.
    pub fn worst(runs: &[Self]) -> Option<(usize, Self)> {
        let (mut index, mut worst) = (0, *runs.first()?);
        for (other, run) in runs.iter().enumerate() {
            if run.cost > worst.cost {
                (index, worst) = (other, *run);
            }
        }
        worst.simulated_s = runs.iter().map(|run| run.simulated_s).sum();
        Some((index, worst))
    }
}

impl CostRule {
    /// Returns the evaluation of a run.
    ///
    /// With n constraints the cost of a feasible run is between −1 and 1, ∓x/(1 + |x|) of the
    /// objective x; of one that violates k constraints between 2k and 2k + 1; of one without a
    /// value of the objective, that lasted for t seconds, 2(n + 1) + 1/(1 + t); of an error 2(n +
    /// 2). Where cases differ in their constraints, n is the greatest number.
    pub fn evaluate(&self, row: &SweepRow) -> Evaluation {
        let count = self.constraints_most as f64;
        let violated: Vec<f64> = self
            .constraints
            .iter()
            .filter_map(|constraint| violation(constraint, row))
            .collect();
        let simulated_s = row.simulated_s.unwrap_or(0.0);
        let objective = self.value(row);
        let (class, cost) = match objective {
            _ if row.verdict == RowVerdict::Error => (RunClass::Error, 2.0 * (count + 2.0)),
            None => {
                let lasted_s = row.fell_at_s.unwrap_or(simulated_s).max(0.0);
                let cost = 2.0 * (count + 1.0) + 1.0 / (1.0 + lasted_s);
                (RunClass::Unobserved, cost)
            }
            Some(_) if !violated.is_empty() => {
                let number = violated.len() as f64;
                let mean = violated.iter().sum::<f64>() / number;
                (RunClass::Infeasible, 2.0 * number + mean)
            }
            Some(value) => {
                let bounded = value / (1.0 + value.abs());
                let cost = match self.direction {
                    Direction::Maximize => -bounded,
                    Direction::Minimize => bounded,
                };
                (RunClass::Feasible, cost)
            }
        };
        Evaluation {
            cost,
            class,
            objective: objective.filter(|_| class != RunClass::Error),
            violations: violated.len(),
            fell_at_s: row.fell_at_s,
            simulated_s,
        }
    }

    /// Returns the value of the objective.
    fn value(&self, row: &SweepRow) -> Option<f64> {
        let JudgedExpectation {
            name, rates_falls, ..
        } = &self.objective;
        let measured = row.expectation(name)?.measured;
        let counts = *rates_falls || !falls_within(&self.objective, row);
        measured.filter(|value| counts && value.is_finite())
    }
}

/// Returns whether the robot fell before the end of the window of an expectation.
fn falls_within(expectation: &JudgedExpectation, row: &SweepRow) -> bool {
    let fell = |at: f64| expectation.before_s.is_none_or(|before| at <= before);
    row.fell_at_s.is_some_and(fell)
}

/// Returns how much a constraint is violated, above 0 and up to 1; none if it holds. A violation of
/// which the amount is not known is one by 1.
fn violation(constraint: &JudgedExpectation, row: &SweepRow) -> Option<f64> {
    let Some(outcome) = row.expectation(&constraint.name) else {
        return Some(1.0);
    };
    if falls_within(constraint, row) && !constraint.rates_falls {
        return Some(1.0);
    }
    if outcome.holds {
        return None;
    }
    Some(match (outcome.verdict, amount(outcome)) {
        (ExpectationVerdict::Fail, Some(amount)) => amount,
        _ => 1.0,
    })
}

/// Returns the distance from the bound, as a share of itself and the bound: without a unit, and
/// less than 1 unless the bound is 0.
fn amount(outcome: &RowExpectation) -> Option<f64> {
    let (distance, bound) = (outcome.margin?.abs(), outcome.bound?.abs());
    let share = distance / (distance + bound);
    (share > 0.0).then_some(share)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    const NAMES: [&str; 3] = ["objective", "one", "two"];

    fn judged(name: &str, before_s: Option<f64>, rates_falls: bool) -> JudgedExpectation {
        JudgedExpectation {
            name: name.to_owned(),
            before_s,
            rates_falls,
        }
    }

    fn rule(direction: Direction, rates_falls: bool) -> CostRule {
        CostRule {
            objective: judged(NAMES[0], None, rates_falls),
            direction,
            constraints: vec![
                judged(NAMES[1], None, false),
                judged(NAMES[2], Some(3.0), false),
            ],
            constraints_most: 2,
        }
    }

    /// A run of 10 s; measured values and margins, none where unobserved.
    fn row(values: [Option<f64>; 3], fell_at_s: Option<f64>, error: bool) -> SweepRow {
        let outcome = |(name, value): (&&str, Option<f64>)| RowExpectation {
            name: (*name).to_owned(),
            verdict: match value {
                None => ExpectationVerdict::Unobserved,
                Some(value) if value < 0.0 => ExpectationVerdict::Fail,
                Some(_) => ExpectationVerdict::Pass,
            },
            holds: value.is_some_and(|value| value >= 0.0),
            measured: value,
            bound: value.map(|_| 2.0),
            margin: value,
            unit: "1".to_owned(),
            detail: String::new(),
        };
        SweepRow {
            verdict: if error {
                RowVerdict::Error
            } else {
                RowVerdict::Fail
            },
            seed: Some(1),
            simulated_s: Some(10.0),
            fell_at_s,
            fingerprint: None,
            error: None,
            expectations: NAMES.iter().zip(values).map(outcome).collect(),
        }
    }

    fn number() -> impl Strategy<Value = f64> {
        prop_oneof![-1e6..1e6_f64, -1.0..1.0_f64, Just(0.0)]
    }

    fn any_row() -> impl Strategy<Value = SweepRow> {
        let values = prop::array::uniform3(prop::option::of(number()));
        let fall = prop::option::of(0.0..10.0_f64);
        (values, fall, prop::bool::weighted(0.1))
            .prop_map(|(values, fall, error)| row(values, fall, error))
    }

    /// The classes in their order, and within each the quantity that decides.
    fn rank(rule: &CostRule, row: &SweepRow) -> (usize, f64) {
        let found = rule.evaluate(row);
        let sign = if rule.direction == Direction::Maximize {
            -1.0
        } else {
            1.0
        };
        match found.class {
            RunClass::Feasible => (0, sign * found.objective.unwrap()),
            RunClass::Infeasible => (found.violations, 0.0),
            RunClass::Unobserved => (8, -row.fell_at_s.unwrap_or(10.0)),
            RunClass::Error => (9, 0.0),
        }
    }

    proptest! {
        /// The point is as good as a bound exactly if all its runs are.
        #[test]
        fn worst_run_of_a_point_counts(
            rows in prop::collection::vec(any_row(), 1..5), bound in -1.0..9.0_f64,
        ) {
            let rule = rule(Direction::Maximize, false);
            let runs: Vec<Evaluation> = rows.iter().map(|row| rule.evaluate(row)).collect();
            let (index, worst) = Evaluation::worst(&runs).unwrap();
            prop_assert_eq!(worst.cost <= bound, runs.iter().all(|run| run.cost <= bound));
            let time_s: f64 = runs.iter().map(|run| run.simulated_s).sum();
            prop_assert_eq!(worst, Evaluation { simulated_s: time_s, ..runs[index] });
            prop_assert!(runs[..index].iter().all(|run| run.cost < worst.cost));
        }

        /// The number orders runs as the rule does, which is written here with tuples.
        #[test]
        fn costs_are_finite_and_order_runs_by_the_rule(
            one in any_row(), other in any_row(), maximize: bool, rates_falls: bool,
        ) {
            let direction = if maximize { Direction::Maximize } else { Direction::Minimize };
            let rule = rule(direction, rates_falls);
            let costs = [&one, &other].map(|row| rule.evaluate(row).cost);
            prop_assert!(costs.iter().all(|cost| cost.is_finite()));
            let (one, other) = (rank(&rule, &one), rank(&rule, &other));
            if one < other && one.1 + 1e-9 * one.1.abs().max(1.0) < other.1 || one.0 < other.0 {
                prop_assert!(costs[0] < costs[1], "{costs:?}");
            }
        }

        /// Values measured after a fall change nothing: with the objective only what is known to be
        /// of the time before it, and of constraints only those that end before it.
        #[test]
        fn what_follows_a_fall_has_no_influence(
            values in prop::array::uniform3(prop::option::of(number())),
            later in prop::array::uniform3(prop::option::of(number())),
            fell_at in 0.0..10.0_f64,
        ) {
            let rule = rule(Direction::Maximize, false);
            let changed = [later[0], later[1], if fell_at <= 3.0 { later[2] } else { values[2] }];
            let found = rule.evaluate(&row(values, Some(fell_at), false));
            let ended = SweepRow {
                simulated_s: Some(fell_at),
                ..row(changed, Some(fell_at), false)
            };
            prop_assert_eq!(found.cost, rule.evaluate(&ended).cost);
            prop_assert_eq!(found.class, RunClass::Unobserved);
        }
    }

    #[test]
    fn objective_that_rates_falls_keeps_its_value() {
        let fallen = row([Some(0.3), Some(1.0), Some(1.0)], Some(5.0), false);
        let mut rule = rule(Direction::Maximize, true);
        // The window of `one` is cut by the fall, that of `two` was over.
        let found = rule.evaluate(&fallen);
        assert_eq!((found.class, found.violations), (RunClass::Infeasible, 1));
        rule.constraints.remove(0);
        let found = rule.evaluate(&fallen);
        assert_eq!(found.class, RunClass::Feasible);
        assert_eq!((found.objective, found.cost), (Some(0.3), -0.3 / 1.3));
    }

    /// Of violations of one constraint the smaller one is better, whatever its unit.
    #[test]
    fn smaller_violations_are_better() {
        let rule = rule(Direction::Maximize, false);
        let cost = |margin| {
            rule.evaluate(&row([Some(1.0), Some(margin), Some(1.0)], None, false))
                .cost
        };
        let costs = [0.0, -1e-9, -0.1, -3.0, -1e9].map(cost);
        assert!(costs.is_sorted_by(|one, next| one < next), "{costs:?}");
    }
}
