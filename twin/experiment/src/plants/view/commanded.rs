//! Origin of the commands of a study, for its page.

use crate::plants::study::Study;

/// Returns a sentence on the commands.
pub(super) fn commanded(study: &Study) -> &'static str {
    if study.commanded {
        "The controller's commands were recorded once, in a run of the complete rig, and are \
         replayed to every plant: results differ by the plant, not by the response of a \
         controller."
    } else {
        "The commands are constant: results differ by the plant only."
    }
}
