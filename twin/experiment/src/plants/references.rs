//! Assignment of references to plants: the plant's own reference, or that of the plant whose model
//! it solves.

use std::rc::Rc;

use serde::{Deserialize, Serialize};
use twinrig_rig::PlantId;
use twinrig_rig::{PlantOffer, Scales};

use crate::budget::Share;
use crate::measured::Measured;
use crate::plants::factory::PlantFactory;
use crate::plants::reference::{self, Reference, RunContext, Trust};
use crate::plants::reference_note::ReferenceNote;

/// References of a scenario, each built once.
pub(crate) struct References<'a> {
    context: RunContext<'a>,
    scales: Scales,
    trust: Trust,
    known: Vec<(PlantId, Result<Rc<Reference>, String>)>,
}

/// Reference assigned to a plant.
#[derive(Serialize, Deserialize)]
pub(crate) struct AssignedReference {
    pub(crate) reference: Option<Rc<Reference>>,
    pub(crate) note: ReferenceNote,
}

impl Measured for AssignedReference {}

/// Returns the plant whose model `offer` solves, if it can be built, and whether it is part of the
/// study.
pub(crate) fn model_of<'a>(
    factory: &'a dyn PlantFactory,
    offer: &PlantOffer,
) -> Option<(&'a PlantOffer, bool)> {
    let name = offer.model_of.as_ref()?;
    let named = |plants: &'a [PlantOffer]| plants.iter().find(|plant| plant.plant == **name);
    let studied = named(factory.plants()).map(|plant| (plant, true));
    studied.or_else(|| named(factory.reference_plants()).map(|plant| (plant, false)))
}

impl<'a> References<'a> {
    pub(crate) fn new(context: RunContext<'a>, scales: Scales, trust: Trust) -> Self {
        Self {
            context,
            scales,
            trust,
            known: Vec::new(),
        }
    }

    /// Returns the reference assigned to `offer`.
    pub(crate) fn of(&mut self, offer: &PlantOffer, share: Share) -> AssignedReference {
        let Some(name) = &offer.model_of else {
            return self.own_reference(offer, share);
        };
        let Some((model, studied)) = model_of(self.context.factory, offer) else {
            let why = format!("there is no plant {name}, whose model it solves");
            return self.own_reference(offer, share).with_fallback_note(&why);
        };
        match self.checked(model, share.part(2)) {
            Ok(reference) => {
                let suffix = if studied {
                    ""
                } else {
                    ", which is not in this study"
                };
                let why = format!("that of {name}{suffix}, whose model it solves");
                let note = reference.note().borrowed_by(&offer.plant, &why);
                AssignedReference {
                    reference: Some(reference),
                    note,
                }
            }
            Err(error) => {
                let why = format!("{name}, whose model it solves, has none ({error})");
                self.own_reference(offer, share.part(2))
                    .with_fallback_note(&why)
            }
        }
    }

    /// Returns the reference computed with the plant itself.
    fn own_reference(&mut self, offer: &PlantOffer, share: Share) -> AssignedReference {
        match self.checked(offer, share) {
            Ok(reference) => AssignedReference {
                note: reference.note(),
                reference: Some(reference),
            },
            Err(why) => AssignedReference {
                note: ReferenceNote::missing(&offer.plant, why),
                reference: None,
            },
        }
    }

    fn checked(&mut self, offer: &PlantOffer, share: Share) -> Result<Rc<Reference>, String> {
        let mut known = self.known.iter();
        if let Some((_, known)) = known.find(|(plant, _)| *plant == offer.plant) {
            return known.clone();
        }
        let found = reference::checked(&self.context, offer, self.scales, self.trust, share);
        let found = found.map(Rc::new);
        self.known.push((offer.plant.clone(), found.clone()));
        found
    }
}

impl AssignedReference {
    /// Adds to the note why the plant is its own reference.
    fn with_fallback_note(mut self, why: &str) -> Self {
        let own = "so it is measured against itself, and errors present at every step do not show";
        self.note.add_why(&format!("{why}: {own}"));
        self
    }
}

impl ReferenceNote {
    /// Returns the note of a plant that uses this reference.
    fn borrowed_by(self, plant: &PlantId, why: &str) -> Self {
        let mut note = Self {
            plant: plant.clone(),
            of_plant: Some(self.plant.label()),
            why: None,
            ..self
        };
        note.add_why(why);
        if let Some(more) = self.why {
            note.add_why(&more);
        }
        note
    }

    fn add_why(&mut self, why: &str) {
        self.why = Some(match self.why.take() {
            Some(before) => format!("{before}; {why}"),
            None => why.to_owned(),
        });
    }
}
