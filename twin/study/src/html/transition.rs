//! Page of a study of gait transitions.

use twinrig_kernel::Unit;

use crate::machine::Machine;
use crate::transition::{MIXED, TransitionResult, TransitionStudy, Way};

use super::gait_diagram::{GaitDiagram, colour};
use super::{document, drawing, introduction, reproduction};
use twinrig_report::html::element::{element, escaped, paragraph};
use twinrig_report::html::marker::{floor_swatch, swatch};
use twinrig_report::html::table::Table;

/// Time before and after a transition that its own diagram has \[s\].
const AROUND_S: f64 = 2.0;
/// Greatest number of diagrams of transitions of a run.
const DIAGRAMS: usize = 6;

impl TransitionStudy {
    /// Returns the page, with the machine it ran on and the command that repeats it.
    pub fn html(&self, machine: &Machine, command: &str) -> String {
        let definitions = [
            (
                "class",
                format!(
                    "pattern of touch-downs nearest to a cycle of the first leg, if no leg \
                     deviates by more than {} of the cycle from the pattern at its best rotation",
                    self.plan.tolerance
                ),
            ),
            (
                "transition",
                format!(
                    "from the last cycle of a gait to the first of the next one that lasts {} \
                     cycles",
                    self.plan.lasting
                ),
            ),
            (
                "speed",
                "of the trunk over a second, along its heading at the begin of the second; below \
                 zero it moves backwards"
                    .to_owned(),
            ),
            (
                "slip",
                "sum of the horizontal paths of all feet on the ground, whose soles deflect: also \
                 a standing robot with noise of the phases has some"
                    .to_owned(),
            ),
        ];
        let definitions = definitions.map(|(name, text)| (name.to_owned(), text));
        let left_out = self.input.left_out.iter();
        let left_out = left_out.map(|left| ("left out".to_owned(), left.clone()));
        let terms: Vec<(String, String)> = definitions.into_iter().chain(left_out).collect();
        let title = format!("Gaits while {} changes", self.input.variable);
        document(
            "Study of gait transitions",
            &format!("{title}: {}", self.input.name),
            &self.headline(),
            &(body(self)
                + &reproduction(
                    machine,
                    command,
                    std::slice::from_ref(&self.input.file),
                    &terms,
                )),
        )
    }

    fn classes(&self) -> Vec<String> {
        let mut names: Vec<String> = Vec::new();
        for pattern in &self.input.patterns {
            if !names.contains(&pattern.name) {
                names.push(pattern.name.clone());
            }
        }
        names
    }
}

fn body(study: &TransitionStudy) -> String {
    let mut out = introduction(&format!(
        "{} changes in steps; the phases of the touch-downs of each cycle are compared with the \
         patterns of gaits (thesis, section 3.3.2.3, figure 3.7).",
        study.input.variable
    ));
    out += "<h2>Transitions</h2>\n";
    out += &transitions(study);
    out += "<h2>Ways up and down</h2>\n";
    out += &hysteresis(study);
    let classes = study.classes();
    let unit = match study.input.unit {
        Unit::One => String::new(),
        unit => format!(" [{}]", unit.symbol()),
    };
    // The name has no room for more.
    let variable = format!("{}{unit}", study.input.variable);
    for result in study.cases.iter().filter(|it| it.why.is_none()) {
        out += &element("h2", "", &escaped(&study.label(result)));
        out += &diagrams(study, result, &classes, &variable);
    }
    out
}

fn diagrams(
    study: &TransitionStudy,
    result: &TransitionResult,
    classes: &[String],
    variable: &str,
) -> String {
    let end_s = result.run.fell_at_s.unwrap_or(result.run.end_s);
    let shares = result.shares();
    let mut entries: Vec<(String, String)> = Vec::new();
    for (class, seconds) in &shares {
        let text = format!("{class}: {seconds:.1} s");
        match colour(class, classes) {
            Some(colour) => entries.push((swatch(colour, false), text)),
            None if *class == MIXED => entries.push((floor_swatch(), text)),
            None => entries.push((String::new(), text)),
        }
    }
    let diagram = |span_s: [f64; 2]| GaitDiagram {
        result,
        classes,
        variable,
        span_s,
    };
    let whole = diagram([0.0, end_s.max(1.0)]).svg();
    let mut out = drawing("The whole run", &entries, &whole, "");
    for one in result.transitions.iter().take(DIAGRAMS) {
        let established_s = one.established_s.unwrap_or(one.begin_s);
        let span_s = [one.begin_s - AROUND_S, established_s + AROUND_S];
        let span_s = span_s.map(|at_s| at_s.clamp(0.0, end_s));
        if span_s[1] > span_s[0] {
            let heading = format!(
                "{} to {} at {:.1} s, {}",
                one.from,
                one.to,
                one.begin_s,
                study.value_text(one.value)
            );
            out += &drawing(&heading, &[], &diagram(span_s).svg(), "");
        }
    }
    out
}

fn transitions(study: &TransitionStudy) -> String {
    let mut table = Table::new(
        "run | from | to | begins [s] | established [s] | value | way | feet slip [mm] | why",
        3,
    );
    for result in &study.cases {
        let label = element("b", "", &escaped(&study.label(result)));
        if let Some(why) = &result.why {
            let mut cells = vec![String::new(); 9];
            cells[0].clone_from(&label);
            cells[8] = element("span", "why", &escaped(why));
            table.row("first", cells);
        }
        for (number, one) in result.transitions.iter().enumerate() {
            let established_s = one.established_s;
            table.row(
                if number == 0 { "first" } else { "" },
                vec![
                    label.clone(),
                    one.from.clone(),
                    one.to.clone(),
                    format!("{:.2}", one.begin_s),
                    established_s.map_or("never".to_owned(), |at_s| format!("{at_s:.2}")),
                    study.value_text(one.value),
                    way(one.way).to_owned(),
                    format!("{:.0}", 1e3 * one.slip_m),
                    String::new(),
                ],
            );
        }
    }
    table.html()
}

fn way(way: Way) -> &'static str {
    match way {
        Way::Up => "up",
        Way::Down => "down",
    }
}

fn hysteresis(study: &TransitionStudy) -> String {
    let mut table = Table::new("run | between | and | on the way up | on the way down", 3);
    let values = |values: &[f64]| {
        let texts: Vec<String> = values.iter().map(|it| study.value_text(*it)).collect();
        texts.join(", ")
    };
    let mut rows = 0;
    for result in &study.cases {
        for pair in &result.hysteresis {
            rows += 1;
            let [a, b] = &pair.classes;
            table.row(
                "",
                vec![
                    element("b", "", &escaped(&study.label(result))),
                    a.clone(),
                    b.clone(),
                    values(&pair.up),
                    values(&pair.down),
                ],
            );
        }
    }
    if rows == 0 {
        return paragraph("There is no transition between two gaits.");
    }
    table.html()
}
