//! Integration methods of plants and their settings, for studies.

use crate::offer::{MethodOffer, MethodSetting, SettingKind, Variant};
use twinrig_document::{print_quantity, quoted};
use twinrig_kernel::{SimDuration, Unit};
use twinrig_legged::Constraints;
use twinrig_scenario::{Accepts, OptionSpec, OptionValue, PlantSpec};

use crate::parts::constraints::CONSTRAINTS;

/// Plant option with the tolerance of adaptive methods.
pub(crate) const TOLERANCE: &str = "tolerance";

/// Plant option of methods whose steps are those of an engine alone. It is not declared, so that no
/// scenario has it.
pub const STEP_ONLY: &str = "step_only";

/// Integration method of a plant, and the plant options that select it.
///
/// ```
/// use twinrig_rig::Method;
/// use twinrig_kernel::SimDuration;
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
    removed: Vec<String>,
    reference: Option<MethodSetting>,
    step_only: bool,
    tabulated: bool,
}

impl Method {
    /// Creates a fixed-step method, set by the plant's `step`.
    pub fn stepped(name: &str, about: &str) -> Self {
        Self {
            name: name.to_owned(),
            about: about.to_owned(),
            set_by: SettingKind::Step,
            options: Vec::new(),
            removed: Vec::new(),
            reference: None,
            step_only: false,
            tabulated: false,
        }
    }

    /// Creates an adaptive method, set by the plant option `tolerance`.
    pub fn tolerant(name: &str, about: &str) -> Self {
        Self {
            set_by: SettingKind::Tolerance,
            ..Self::stepped(name, about)
        }
    }

    /// Selects the method by the plant option `name` with the text `word`.
    #[must_use]
    pub fn with_option(mut self, name: &str, word: &str) -> Self {
        let word = OptionValue::Text(word.to_owned());
        self.options.push((name.to_owned(), word));
        self
    }

    /// Sets the plant option `name` to `number`, in the declared unit of the option.
    #[must_use]
    pub fn with_number(mut self, name: &str, number: f64) -> Self {
        let number = OptionValue::Number(number);
        self.options.push((name.to_owned(), number));
        self
    }

    /// Sets the plant option `name` to the whole number `count`.
    #[must_use]
    pub fn with_count(mut self, name: &str, count: u64) -> Self {
        let count = OptionValue::Natural(count);
        self.options.push((name.to_owned(), count));
        self
    }

    /// Removes the plant option `name`, which the method does not accept.
    #[must_use]
    pub fn without_option(mut self, name: &str) -> Self {
        self.removed.push(name.to_owned());
        self
    }

    /// Reduces the steps to those of the engine alone, to measure their cost.
    #[must_use]
    pub fn step_only(mut self) -> Self {
        self.step_only = true;
        self.with_option(STEP_ONLY, "on")
    }

    /// Declares that the method takes forces from a table, so that studies vary its spacing by the
    /// plant option `cells`.
    #[must_use]
    pub(crate) fn tabulated(mut self) -> Self {
        self.tabulated = true;
        self
    }

    /// Selects the formulation of the constraints.
    #[must_use]
    pub(crate) fn with_constraints(self, constraints: Constraints) -> Self {
        self.with_option(CONSTRAINTS, constraints.name())
    }

    /// Declares the method at this step to be a reference. The first reference method of a plant is
    /// its reference, the second one verifies it.
    #[must_use]
    pub fn trusted_at_step(mut self, step: SimDuration) -> Self {
        self.reference = Some(MethodSetting::Step(step));
        self
    }

    /// Declares the method at this tolerance to be a reference, as [`Method::trusted_at_step`].
    #[must_use]
    pub fn trusted_at_tolerance(mut self, tolerance: f64) -> Self {
        self.reference = Some(MethodSetting::Tolerance(tolerance));
        self
    }

    /// Returns whether `variant` selects this method: a name may exist twice, set by a step and set
    /// by a tolerance.
    pub fn matches(&self, variant: &Variant) -> bool {
        self.name == variant.method && self.set_by == variant.setting.set_by()
    }

    /// Returns keys of the plant table and their values in TOML that select this method at
    /// `setting`, for a plant with the options `specs`.
    ///
    /// # Errors
    /// The reason why no scenario can have them.
    pub fn settings(
        &self,
        specs: &[OptionSpec],
        setting: MethodSetting,
    ) -> Result<Vec<[String; 2]>, String> {
        let mut settings = Vec::new();
        let mut options = self.options.clone();
        match setting {
            MethodSetting::Step(step) => {
                settings.push(["step".to_owned(), quoted(&step.to_string())]);
            }
            MethodSetting::Tolerance(tolerance) => {
                options.push((TOLERANCE.to_owned(), OptionValue::Number(tolerance)));
            }
        }
        for (name, value) in &options {
            let spec = specs.iter().find(|spec| spec.name == *name);
            let spec = spec.ok_or_else(|| format!("no scenario has its option `{name}`"))?;
            let text = match (value, &spec.accepts) {
                (OptionValue::Text(word), _) => quoted(word),
                (OptionValue::Natural(count), _) => count.to_string(),
                (OptionValue::Number(number), Accepts::Quantity { unit, .. })
                    if number.is_finite() =>
                {
                    quantity(*number, *unit)
                }
                _ => return Err(format!("no scenario can have its value of `{name}`")),
            };
            settings.push([name.clone(), text]);
        }
        Ok(settings)
    }

    /// Returns the description of the method for studies.
    pub fn offer(&self) -> MethodOffer {
        MethodOffer {
            name: self.name.clone(),
            about: self.about.clone(),
            set_by: self.set_by,
            reference: self.reference,
            step_only: self.step_only,
            tabulated: self.tabulated,
        }
    }

    /// Returns `plant` with this method at `setting`.
    pub fn set(&self, plant: &PlantSpec, setting: MethodSetting) -> PlantSpec {
        let mut plant = plant.clone();
        // Settings of the scenario do not apply to studies.
        plant.step = None;
        plant.options = plant.options.without(TOLERANCE);
        for name in &self.removed {
            plant.options = plant.options.without(name);
        }
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

/// Returns a quantity in TOML: a text with its unit, a number if it has none.
fn quantity(value: f64, unit: Unit) -> String {
    match (unit, unit == Unit::Meter && value < 1e-3) {
        (Unit::One, _) => value.to_string(),
        // Tolerances in metres have many zeros.
        (_, true) => quoted(&format!("{value:e} m")),
        _ => quoted(&print_quantity(value, unit)),
    }
}
