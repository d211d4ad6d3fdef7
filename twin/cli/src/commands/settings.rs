//! Settings of the command line.

use twinrig_scenario::Setting;

use crate::args::Settings;

/// Origin of settings given by `--plant`.
const PLANT: &str = "--plant";
/// Key that it sets.
pub(super) const PLANT_KEY: &str = "plant.model";

/// Returns the settings of the command line.
pub(super) fn settings(args: &Settings) -> Vec<Setting> {
    let plant = args.plant.iter().map(|model| Setting {
        origin: PLANT.to_owned(),
        key: PLANT_KEY.to_owned(),
        value: format!("{model:?}"),
    });
    let set = args.set.iter().map(|(key, value)| Setting {
        origin: "--set".to_owned(),
        key: key.clone(),
        value: value.clone(),
    });
    plant.chain(set).collect()
}
