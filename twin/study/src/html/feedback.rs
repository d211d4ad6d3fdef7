//! Page of a study of load feedback.

use crate::feedback::{FeedbackResult, FeedbackStudy};
use crate::machine::Machine;

use super::{document, drawing, introduction, reproduction};
use twinrig_report::html::element::{element, escaped};
use twinrig_report::html::line_plot::{LinePlot, Series, Shape};
use twinrig_report::html::marker::COLOURS;
use twinrig_report::html::marker::swatch;
use twinrig_report::html::table::HtmlTable;

impl FeedbackStudy {
    /// Returns the page, with the machine it ran on and the command that repeats it.
    pub fn html(&self, machine: &Machine, command: &str) -> String {
        let definitions = [
            (
                "load taken",
                "load at a step of the controller, after its own filter (`load_lag`)",
            ),
            (
                "error",
                "root mean square of the difference of the load taken from the plant's, over time \
                 and legs; without the delay, from the plant's load of that time before",
            ),
            (
                "delay",
                "delay at which the load taken correlates most with the plant's; mean of the legs",
            ),
            (
                "phases",
                "root mean square of the difference from the phases of the reference at the same \
                 step of the controller",
            ),
        ];
        let definitions = definitions.map(|(name, text)| (name.to_owned(), text.to_owned()));
        let undisplaced = self.cases.iter().filter_map(|it| {
            let why = it.undisplaced.as_ref()?;
            Some((
                "no displacement".to_owned(),
                format!("{}: {why}", it.label()),
            ))
        });
        let left_out = self.input.left_out.iter();
        let left_out = left_out.map(|left| ("left out".to_owned(), left.clone()));
        let terms = definitions.into_iter().chain(undisplaced).chain(left_out);
        let terms: Vec<(String, String)> = terms.collect();
        document(
            "Study of load feedback",
            &format!("True and measured loads: {}", self.input.name),
            &self.headline(),
            &(body(self) + &reproduction(machine, command, &self.input.files, &terms)),
        )
    }
}

fn body(study: &FeedbackStudy) -> String {
    let mut out = introduction(&format!(
        "A controller walks by the loads of its legs. The first scenario is the reference of each \
         plant. Gaits and loads count from {} s on, phases over the first {} s.",
        study.plan.after_s, study.plan.phases_s
    ));
    out += "<h2>Gaits and loads</h2>\n";
    out += &gaits(study);
    let heading = format!("Displacement of footsteps per change of {}", study.variable);
    out += &element("h2", "", &escaped(&heading));
    out += &displacements(study);
    let mut plants: Vec<&str> = Vec::new();
    for case in &study.input.cases {
        if !plants.contains(&&*case.plant) {
            plants.push(&case.plant);
        }
    }
    for plant in plants {
        out += &loads(study, plant);
    }
    out
}

fn gaits(study: &FeedbackStudy) -> String {
    let mut table = HtmlTable::new(
        "plant | loads | speed [m/s] | duty factor, fore | hind | phases [rad] | error [N] | \
         delay [ms] | error without it [N] | why",
        2,
    );
    for (index, result) in study.cases.iter().enumerate() {
        let number = |value: Option<f64>, digits: usize| {
            value.map_or(String::new(), |value| format!("{value:.digits$}"))
        };
        let fell = result.fell_at_s.map(|at_s| format!("fell at {at_s:.1} s"));
        let reference = study.is_reference(index);
        table.row(
            if reference { "first" } else { "" },
            vec![
                element("b", "", &escaped(&result.case.plant)),
                escaped(&result.case.source),
                number(result.speed_m_s, 3),
                number(result.duty[0], 3),
                number(result.duty[1], 3),
                number(result.phases_rad.filter(|_| !reference), 3),
                number(result.error_n(), 2),
                number(result.delay_s().map(|it| 1e3 * it), 1),
                number(result.rest_n(), 2),
                escaped(&result.why.clone().or(fell).unwrap_or_default()),
            ],
        );
    }
    table.html()
}

fn displacements(study: &FeedbackStudy) -> String {
    let steps = 1..=study.plan.modulation.steps;
    let head: Vec<String> = steps.map(|step| format!("step {step}, R²")).collect();
    let mut table = HtmlTable::new(&format!("plant | loads | {}", head.join(" | ")), 2);
    for result in &study.cases {
        let steps = result.steps.iter().map(|it| {
            let r_squared = it.r_squared.map(|it| format!(" ({it:.3})"));
            format!("{:.2}{}", it.slope, r_squared.unwrap_or_default())
        });
        let words = [&result.case.plant, &result.case.source].map(|it| escaped(it));
        table.row("", words.into_iter().chain(steps).collect());
    }
    table.html()
}

fn loads(study: &FeedbackStudy, plant: &str) -> String {
    let of_plant = study.cases.iter();
    let of_plant = of_plant.filter(|it| it.case.plant == plant && it.why.is_none());
    let drawings = of_plant.map(|result: &FeedbackResult| {
        let [truth, taken] = result.curves.clone();
        let plot = LinePlot {
            title: format!("load of the first leg, {}", result.label()),
            width: 540.0,
            height: 260.0,
            x_label: "time  [s]".to_owned(),
            y_label: "load  [N]".to_owned(),
            series: vec![
                Series {
                    number: 0,
                    shape: Shape::Line(truth),
                },
                Series {
                    number: COLOURS - 1,
                    shape: Shape::Dashed(taken),
                },
            ],
        };
        let entries = [
            (swatch(0, false), "of the plant".to_owned()),
            (swatch(COLOURS - 1, true), "taken".to_owned()),
        ];
        let heading = format!("Load of the first leg: {}", result.label());
        drawing(&heading, &entries, &plot.svg(), "")
    });
    element("div", "pair", &drawings.collect::<String>())
}
