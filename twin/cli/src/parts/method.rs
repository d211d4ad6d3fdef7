//! How studies set the methods of a plant.

use twinrig_kernel::SimDuration;
use twinrig_scenario::{OptionValue, PlantSpec};
use twinrig_study::{MethodOffer, MethodSetting, SettingKind, Variant};

/// The option of a plant that holds the tolerance of a method which has one.
const TOLERANCE: &str = "tolerance";

/// A way to integrate a plant, and how a scenario asks for it.
///
/// ```
/// use twinrig::Method;
/// use twinrig::kernel::SimDuration;
///
/// let rk4 = Method::stepped("rk4", "of fourth order").with_option("integrator", "rk4");
/// let stiff = Method::tolerant("rodas4", "for stiff scenes")
///     .with_option("integrator", "rodas4")
///     .trusted_at_tolerance(1e-13);
/// # let _ = (rk4.trusted_at_step(SimDuration::from_micros(5)), stiff);
/// ```
#[derive(Clone, Debug)]
pub struct Method {
    name: String,
    about: String,
    set_by: SettingKind,
    options: Vec<(String, OptionValue)>,
    reference: Option<MethodSetting>,
}

impl Method {
    /// One that is set by its step, which is the plant's `step`.
    pub fn stepped(name: &str, about: &str) -> Self {
        Self {
            name: name.to_owned(),
            about: about.to_owned(),
            set_by: SettingKind::Step,
            options: Vec::new(),
            reference: None,
        }
    }

    /// One that is set by a tolerance, which is the plant's option `tolerance`.
    pub fn tolerant(name: &str, about: &str) -> Self {
        Self {
            set_by: SettingKind::Tolerance,
            ..Self::stepped(name, about)
        }
    }

    /// It takes this word for that option of the plant.
    #[must_use]
    pub fn with_option(mut self, name: &str, word: &str) -> Self {
        let word = OptionValue::Text(word.to_owned());
        self.options.push((name.to_owned(), word));
        self
    }

    /// It takes this number, in the unit that the option declares.
    #[must_use]
    pub fn with_number(mut self, name: &str, number: f64) -> Self {
        let number = OptionValue::Number(number);
        self.options.push((name.to_owned(), number));
        self
    }

    /// At this step it is good enough for others to be measured against. The first such method of a plant is its reference,
    /// the second the check of that.
    #[must_use]
    pub fn trusted_at_step(mut self, step: SimDuration) -> Self {
        self.reference = Some(MethodSetting::Step(step));
        self
    }

    /// The same at this tolerance.
    #[must_use]
    pub fn trusted_at_tolerance(mut self, tolerance: f64) -> Self {
        self.reference = Some(MethodSetting::Tolerance(tolerance));
        self
    }

    /// Whether a variant means this one: a method may be offered to be set by its step, and once more by a tolerance.
    pub(crate) fn is_meant_by(&self, variant: &Variant) -> bool {
        self.name == variant.method && self.set_by == variant.setting.set_by()
    }

    pub(crate) fn offer(&self) -> MethodOffer {
        MethodOffer {
            name: self.name.clone(),
            about: self.about.clone(),
            set_by: self.set_by,
            reference: self.reference,
        }
    }

    /// `plant`, integrated by this method, set so.
    pub(crate) fn set(&self, plant: &PlantSpec, setting: MethodSetting) -> PlantSpec {
        let mut plant = plant.clone();
        // A scenario's own setting is not that of a study.
        plant.step = None;
        plant.options = plant.options.without(TOLERANCE);
        for (name, value) in &self.options {
            plant.options = plant.options.with(name, value.clone());
        }
        match setting {
            MethodSetting::Step(step) => plant.step = Some(step),
            MethodSetting::Tolerance(tolerance) => {
                let value = OptionValue::Number(tolerance);
                plant.options = plant.options.with(TOLERANCE, value);
            }
        }
        plant
    }
}
