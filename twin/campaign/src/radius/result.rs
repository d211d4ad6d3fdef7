//! Results of the searches along all axes.

use serde::{Serialize, Serializer};
use twinrig_kernel::Unit;

use super::axis::DisturbanceAxis;
use super::search::{AxisSearch, RunOutcome, TestedSize};
use crate::sweep::csv_line;

/// Radii of all expectations along all axes; a function of scenario, axes and build.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct RadiusResult {
    /// Name of the scenario.
    pub scenario: String,
    /// Its file.
    pub file: String,
    /// Hash of the program.
    pub build: String,
    /// Settings of all runs.
    pub settings: Vec<(String, String)>,
    /// Greatest width of a bracket, as a share of its upper end.
    pub precision: f64,
    /// Results, by axis.
    pub axes: Vec<AxisResult>,
    /// Reasons why other known disturbances do not apply.
    pub left_out: Vec<String>,
}

/// Result of an axis. Values are those of the axis, in its SI unit.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct AxisResult {
    /// Name.
    pub name: String,
    /// Meaning of the value.
    pub about: String,
    /// Keys that it sets.
    pub keys: Vec<String>,
    /// Unit.
    #[serde(serialize_with = "symbol")]
    pub unit: Unit,
    /// Value without a disturbance.
    pub nominal: f64,
    /// Value of the greatest disturbance that is tried.
    pub limit: f64,
    /// End of the axis.
    pub end: AxisEnd,
    /// Radii, in the order of the expectations.
    pub expectations: Vec<ExpectationRadius>,
    /// Expectations that fail first: no tested value separates them.
    pub first: Vec<String>,
    /// Values that were tested, in the order of their sizes.
    pub tested: Vec<f64>,
    /// Whether the search ended for the number of its runs, before brackets were closed.
    pub exhausted: bool,
}

/// End of an axis.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum AxisEnd {
    /// Its limit.
    Limit,
    /// The scenario is valid up to a value.
    Refused {
        /// Greatest value with which it is.
        to: f64,
        /// Least value with which it is not.
        from: f64,
        /// Reason.
        reason: String,
    },
}

/// Radius of an expectation.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ExpectationRadius {
    /// Name.
    pub name: String,
    /// Whether there is a radius.
    pub state: RadiusState,
    /// Greatest tested value below the first failure.
    pub holds_to: Option<f64>,
    /// Least tested value at which it fails.
    pub fails_at: Option<f64>,
    /// Whether the run with that value ended with an error; it is the reason.
    pub error: Option<String>,
    /// Whether the expectation was not observed in that run.
    pub unobserved: bool,
    /// Tested values beyond the first failure at which it holds again: it is not monotone.
    pub holds_again: Vec<f64>,
    /// Greatest distance of neighbouring tested values below the radius: a window of failures there
    /// is found for sure if it is wider, and may have been missed if not. None without a radius.
    pub resolution: Option<f64>,
    /// Value and margin of the runs in which it was observed.
    pub margins: Vec<(f64, f64)>,
}

/// State of a radius.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum RadiusState {
    /// The expectation fails within the axis.
    Found,
    /// It holds at all tested values.
    Beyond,
    /// It fails without a disturbance.
    FailsUndisturbed,
    /// It is optional and not observed without a disturbance.
    Unobserved,
}

impl RadiusState {
    /// Returns the word of reports.
    pub fn word(self) -> &'static str {
        match self {
            Self::Found => "found",
            Self::Beyond => "beyond",
            Self::FailsUndisturbed => "fails-undisturbed",
            Self::Unobserved => "unobserved",
        }
    }
}

impl RadiusResult {
    /// Returns the head of the table of all radii: `expectation`, and the names of the axes.
    pub fn head(&self) -> Vec<&str> {
        let names = self.axes.iter().map(|axis| axis.name.as_str());
        std::iter::once("expectation").chain(names).collect()
    }

    /// Returns the rows of that table: the name of an expectation, and its radius along each axis.
    pub fn rows(&self) -> impl Iterator<Item = (&str, Vec<(&AxisResult, &ExpectationRadius)>)> {
        let expectations = self.axes.first().map(|axis| &axis.expectations);
        let names = expectations.into_iter().flatten().map(|one| &*one.name);
        names.enumerate().map(|(index, name)| {
            let axes = self.axes.iter();
            let radii = axes.map(|axis| (axis, &axis.expectations[index]));
            (name, radii.collect())
        })
    }
}

impl AxisResult {
    /// Returns whether no expectation fails earlier along the axis than this one.
    pub fn fails_first(&self, one: &ExpectationRadius) -> bool {
        self.first.contains(&one.name)
    }

    /// Returns the result of a search for expectations of these names.
    pub fn new(axis: &DisturbanceAxis, names: &[String], search: &AxisSearch) -> Self {
        let values = &axis.values;
        let end = match search.refused() {
            None => AxisEnd::Limit,
            Some(bracket) => AxisEnd::Refused {
                to: values.value(bracket.holds),
                from: values.value(bracket.fails),
                reason: refusal(search, bracket.fails),
            },
        };
        let brackets = (0..names.len()).filter(|&one| search.is_searched(one));
        let brackets = brackets.filter_map(|one| Some((one, search.bracket(one)?)));
        let brackets: Vec<_> = brackets.collect();
        let least = brackets.iter().map(|(_, it)| it.fails);
        let least = least.fold(f64::INFINITY, f64::min);
        let first = brackets.iter().filter(|(_, it)| it.fails <= least);
        Self {
            name: axis.name.clone(),
            about: axis.about.clone(),
            keys: axis.keys.iter().map(|it| it.key.clone()).collect(),
            unit: values.unit,
            nominal: values.nominal,
            limit: values.limit,
            end,
            expectations: (0..names.len())
                .map(|one| ExpectationRadius::new(axis, &names[one], one, search))
                .collect(),
            first: first.map(|(one, _)| names[*one].clone()).collect(),
            tested: search
                .tested()
                .iter()
                .map(|it| values.value(it.size))
                .collect(),
            exhausted: search.is_exhausted(),
        }
    }

    /// Returns the width of the widest window of failures that could have been missed below a
    /// radius of the axis; none without one.
    pub fn resolution(&self) -> Option<f64> {
        let widths = self.expectations.iter().filter_map(|one| one.resolution);
        widths.reduce(f64::max)
    }

    /// Returns the last value with which the scenario is valid.
    pub fn last(&self) -> f64 {
        match self.end {
            AxisEnd::Limit => self.limit,
            AxisEnd::Refused { to, .. } => to,
        }
    }

    /// Returns the word for the direction of growth.
    pub fn direction(&self) -> &'static str {
        if self.limit < self.nominal {
            "down"
        } else {
            "up"
        }
    }
}

fn refusal(search: &AxisSearch, size: f64) -> String {
    let run = search.tested().iter().find(|it| it.size == size);
    match run.map(|it| &it.outcome) {
        Some(RunOutcome::Refused(reason)) => reason.clone(),
        _ => String::new(),
    }
}

impl ExpectationRadius {
    fn new(axis: &DisturbanceAxis, name: &str, index: usize, search: &AxisSearch) -> Self {
        let value = |size: f64| axis.values.value(size);
        let valid = search.valid();
        let observation = |run: &TestedSize| match &run.outcome {
            RunOutcome::Judged(outcomes) => outcomes.get(index).cloned(),
            _ => None,
        };
        let undisturbed = valid.first().and_then(observation);
        let bracket = search.bracket(index).filter(|_| search.is_searched(index));
        let state = match (undisturbed, bracket) {
            (Some(it), _) if it.holds && !it.is_observed => RadiusState::Unobserved,
            (Some(it), Some(_)) if it.holds => RadiusState::Found,
            (Some(it), None) if it.holds => RadiusState::Beyond,
            _ => RadiusState::FailsUndisturbed,
        };
        let fails = bracket.map_or(f64::INFINITY, |it| it.fails);
        let first = valid.iter().find(|it| it.size == fails);
        let again = valid.iter().filter(|it| it.size > fails && it.holds(index));
        let margin = |run: &TestedSize| Some((value(run.size), observation(run)?.margin?));
        Self {
            name: name.to_owned(),
            state,
            holds_to: match state {
                RadiusState::Beyond => Some(value(search.end())),
                _ => bracket.map(|it| value(it.holds)),
            },
            fails_at: bracket.map(|it| value(it.fails)),
            error: first.and_then(|run| match &run.outcome {
                RunOutcome::Ended(reason) => Some(reason.clone()),
                _ => None,
            }),
            unobserved: first
                .and_then(observation)
                .is_some_and(|it| !it.is_observed),
            resolution: match state {
                RadiusState::Found | RadiusState::Beyond => Some(search.resolution(index)),
                RadiusState::FailsUndisturbed | RadiusState::Unobserved => None,
            },
            holds_again: again.map(|it| value(it.size)).collect(),
            margins: valid.iter().filter_map(margin).collect(),
        }
    }

    /// Returns whether larger disturbances than the first at which it fails let it hold again.
    pub fn is_monotone(&self) -> bool {
        self.holds_again.is_empty()
    }
}

impl RadiusResult {
    /// Returns whether an expectation fails without a disturbance.
    pub fn fails_undisturbed(&self) -> bool {
        let all = self.axes.iter().flat_map(|axis| &axis.expectations);
        let mut states = all.map(|one| one.state);
        states.any(|state| state == RadiusState::FailsUndisturbed)
    }

    /// Returns the radii as CSV (RFC 4180), a line for each axis and expectation. Values are in the
    /// SI unit of the line.
    pub fn csv(&self) -> String {
        let head = "axis | direction | unit | nominal | end | expectation | state | holds to | \
                    fails at | first | monotone | holds again at | resolution";
        let mut text = csv_line(head.split(" | ").map(str::to_owned));
        let number = |value: Option<f64>| value.map_or(String::new(), |it| it.to_string());
        for axis in &self.axes {
            for one in &axis.expectations {
                let is_first = axis.first.contains(&one.name);
                let again: Vec<String> = one.holds_again.iter().map(f64::to_string).collect();
                text += &csv_line(vec![
                    axis.name.clone(),
                    axis.direction().to_owned(),
                    axis.unit.symbol().to_owned(),
                    axis.nominal.to_string(),
                    axis.last().to_string(),
                    one.name.clone(),
                    one.state.word().to_owned(),
                    number(one.holds_to),
                    number(one.fails_at),
                    is_first.to_string(),
                    one.is_monotone().to_string(),
                    again.join(" "),
                    number(one.resolution),
                ]);
            }
        }
        text
    }
}

#[expect(
    clippy::trivially_copy_pass_by_ref,
    reason = "serde passes fields by reference"
)]
fn symbol<S: Serializer>(unit: &Unit, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_str(unit.symbol())
}
