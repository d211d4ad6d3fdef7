//! `twin plan --sufficient`: the cheapest plant and setting that answer a scenario.

use serde::Serialize;
use twinrig_experiment::{
    OmissionProof, ProgressObserver, START_PERTURBATION, Sufficiency, SufficiencyBuilder,
    SufficiencyPlan, sufficient,
};
use twinrig_rig::assembly::Assembly;
use twinrig_rig::error::Error;
use twinrig_rig::registry::Registry;
use twinrig_rig::run::interrupt;

use super::super::{FAILURE, NEGATIVE, SUCCESS, Terminal, settings, source};
use super::sufficient_text::text;
use crate::args::{PlanArgs, Settings};
use crate::error::TwinError;
use crate::progress::Progress;

/// Result of the search.
#[derive(Serialize)]
pub(super) struct SufficientTwin {
    pub(super) scenario: String,
    pub(super) file: String,
    #[serde(flatten)]
    pub(super) search: Sufficiency,
    /// Settings and starts for which the choice is shown to suffice.
    pub(super) scope: String,
    /// Factors by which the scenario's own choice, and the reference, take longer than the choice.
    pub(super) savings: [Option<f64>; 2],
    /// Lines of a scenario that make the choice.
    pub(super) toml: Option<String>,
    /// Options of `twin run` that make the choice.
    pub(super) options: Option<String>,
    /// Parts of the reference's model that the choice leaves out.
    pub(super) left_out_of_model: Vec<String>,
    /// Comparison with the scene in which everything is computed.
    pub(super) scene: Option<OmissionProof>,
    /// Plants and methods that are no candidates, with the reasons.
    pub(super) left_out: Vec<String>,
}

/// Shows the progress of the search and ends it on an interrupt.
struct ProgressLine(Progress);

impl ProgressObserver for ProgressLine {
    fn at(&mut self, part: usize, of: usize, description: &str) -> bool {
        self.0.part(part, of, description);
        !interrupt::is_requested()
    }
}

pub(super) fn search(registry: &Registry, args: &PlanArgs, terminal: &mut Terminal<'_>) -> u8 {
    if terminal.interactive {
        crate::interrupt::listen();
    }
    match found(registry, args, terminal) {
        Ok(found) => {
            if args.json {
                terminal.print_json(&found);
            } else {
                let text = text(&found);
                terminal.print(&text);
            }
            let holds = found.scene.as_ref().is_some_and(OmissionProof::holds);
            if holds { SUCCESS } else { NEGATIVE }
        }
        Err(error) => {
            terminal.report_error(&error, args.json);
            FAILURE
        }
    }
}

fn found(
    registry: &Registry,
    args: &PlanArgs,
    terminal: &mut Terminal<'_>,
) -> Result<SufficientTwin, TwinError> {
    if source::is_standard_input(&args.scenario) {
        return Err(TwinError::from(Error::InvalidOptions {
            why: "--sufficient does not read standard input".to_owned(),
            help: "write the scenario to a file".to_owned(),
        }));
    }
    let set = args.set.clone();
    let settings = settings(&Settings { set, plant: None });
    let own = Assembly::builder(registry)
        .settings(&settings)
        .file(&args.scenario)?;
    if !args.json {
        terminal.warn(&own.scenario().warnings);
    }
    let builder = SufficiencyBuilder::new(registry, &args.scenario, &settings, &args.plant)?;
    let plan = SufficiencyPlan {
        starts: args.ensemble,
        budget_s: args.budget,
        ..SufficiencyPlan::default()
    };
    let show_progress = terminal.interactive && !args.json;
    let mut observer = ProgressLine(Progress::new(&own.scenario().name, show_progress));
    let search = sufficient(&builder, &plan, &mut observer);
    let search = search
        .map_err(|source| twinrig_experiment::Error::of_study(&own.scenario().file, source))?;
    let choice = search.choice().map(|row| row.candidate.clone());
    let scene = choice.as_ref();
    let scene = scene.map(|choice| OmissionProof::of(&builder, choice));
    let settings = choice.as_ref().map(|choice| choice.settings.as_slice());
    Ok(SufficientTwin {
        scenario: own.scenario().name.clone(),
        file: own.scenario().file.clone(),
        scope: scope(search.starts),
        savings: search.savings(),
        toml: settings.map(toml),
        options: settings.map(options),
        left_out_of_model: left_out_of_model(&builder, &search),
        scene: scene.transpose()?,
        left_out: builder.left_out().to_vec(),
        search,
    })
}

/// Returns the settings and the starts of the runs that were compared.
fn scope(starts: usize) -> String {
    let starts = match starts {
        1 => "its start".to_owned(),
        _ => format!("{starts} starts within {START_PERTURBATION:e} m or rad"),
    };
    format!(
        "the scenario's settings only, from {starts}; near a bound, other settings may need another plant"
    )
}

/// Returns the lines of a scenario with these settings, by table.
fn toml(settings: &[[String; 2]]) -> String {
    let mut lines = Vec::new();
    let mut last = None;
    for [key, value] in settings {
        let (table, key) = key.split_once('.').unwrap_or(("", key));
        if last != Some(table) {
            lines.push(format!("[{table}]"));
            last = Some(table);
        }
        lines.push(format!("{key} = {value}"));
    }
    lines.join("\n")
}

/// Returns the settings as options of a command line, quoted for a POSIX shell.
fn options(settings: &[[String; 2]]) -> String {
    let words = settings
        .iter()
        .map(|[key, value]| format!("--set '{key}={value}'"));
    words.collect::<Vec<_>>().join(" ")
}

/// Returns the parts of the reference's model that the choice does not have.
fn left_out_of_model(builder: &SufficiencyBuilder<'_>, search: &Sufficiency) -> Vec<String> {
    let Some(choice) = search.choice() else {
        return Vec::new();
    };
    let [chosen, reference] = [&choice.candidate.plant, &search.reference.reference.plant];
    let mut parts = Vec::new();
    let is_massless = |name: &String| builder.massless().contains(name);
    if is_massless(&chosen.name) && !is_massless(&reference.name) {
        parts.push("the masses of the leg segments".to_owned());
    }
    if chosen.name != reference.name {
        parts.push(format!(
            "the model of {}, for which {} stands",
            reference.name, chosen.name
        ));
    }
    if let (Some(own), Some(other)) = (&chosen.constraints, &reference.constraints)
        && own != other
    {
        parts.push(format!("{other} constraints, for which {own} ones stand"));
    }
    parts
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn settings_of_a_table_share_its_header() {
        let settings = [
            ["plant.model", "\"lcp\""],
            ["plant.step", "\"1 ms\""],
            ["actuator.set_point", "\"held\""],
        ];
        let settings = settings.map(|pair| pair.map(str::to_owned));
        let expected =
            "[plant]\nmodel = \"lcp\"\nstep = \"1 ms\"\n[actuator]\nset_point = \"held\"";
        assert_eq!(toml(&settings), expected);
        assert!(options(&settings).starts_with("--set 'plant.model=\"lcp\"' --set"));
    }
}
