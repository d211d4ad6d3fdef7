//! The run of a recording: its assembly, from the attached files and the noted settings.

use twinrig_record::Recording;

use crate::assembly::Assembly;
use crate::assembly::sources::{ROBOT_FILE, SCENARIO_FILE};
use crate::error::Error;
use crate::parts::constraints::DefaultRules;
use crate::registry::Registry;
use crate::run::recording::{
    DEFAULTS_NOTE, EXCHANGED_NOTE, HARDWARE_NOTE, SETTINGS_NOTE, settings_of,
};

/// Reason for which the run of a recording cannot be repeated.
#[derive(Debug, thiserror::Error)]
pub enum NotRepeatable {
    /// The recording lacks something, or its run had parts that are not simulated.
    #[error("{0}")]
    Recording(String),
    /// The attached scenario cannot be built.
    #[error(transparent)]
    Scenario(Box<Error>),
}

/// Returns the assembly of a recorded run.
///
/// # Errors
/// [`NotRepeatable`].
pub fn assembly_of<'r>(
    registry: &'r Registry,
    recorded: &Recording,
) -> Result<Assembly<'r>, NotRepeatable> {
    let lacks = NotRepeatable::Recording;
    let text = |name: &str| {
        let bytes = recorded.attachment(name);
        let text = bytes.and_then(|bytes| std::str::from_utf8(bytes).ok());
        text.ok_or_else(|| lacks(format!("it has no attachment `{name}`")))
    };
    if recorded.note(HARDWARE_NOTE).is_some() {
        return Err(lacks(
            "it was made on hardware; the attached scenario can be run on the twin".to_owned(),
        ));
    }
    if let Some(at_s) = recorded.note(EXCHANGED_NOTE) {
        return Err(lacks(format!(
            "its plant was exchanged at {at_s} s, and the run before is not recorded; run both \
             plants again with --from"
        )));
    }
    let settings = recorded.note(SETTINGS_NOTE).unwrap_or("[]");
    let settings: Vec<[String; 2]> = serde_json::from_str(settings)
        .map_err(|error| lacks(format!("its settings cannot be parsed: {error}")))?;
    let settings = settings_of(settings);
    let rules = match recorded.note(DEFAULTS_NOTE) {
        Some(_) => DefaultRules::Present,
        None => DefaultRules::Former,
    };
    let robot = recorded.attachment(ROBOT_FILE).is_some();
    let robot = robot.then(|| text(ROBOT_FILE)).transpose()?;
    let kept = recorded.attachments();
    let kept = kept.map(|(name, bytes)| (name.to_owned(), bytes.to_vec()));
    let scenario = text(SCENARIO_FILE)?;
    let builder = Assembly::builder(registry).settings(&settings).rules(rules);
    let builder = builder.files(kept.collect());
    let builder = match robot {
        Some(robot) => builder.robot(robot),
        None => builder,
    };
    let assembly = builder.recorded(scenario);
    assembly.map_err(|error| NotRepeatable::Scenario(Box::new(error)))
}
