//! Which reference a plant is measured against: its own, or that of the plant whose model it solves by other means.

use std::rc::Rc;

use crate::budget::Share;
use crate::factory::{PlantFactory, PlantOffer, Scales};
use crate::reference::{self, Reference, ReferenceNote, Stage, Trust};

/// The references of a scene, each built once.
pub(crate) struct References<'a> {
    stage: Stage<'a>,
    scales: Scales,
    trust: Trust,
    known: Vec<(String, Result<Rc<Reference>, String>)>,
}

/// What a plant is measured against.
pub(crate) struct Standard {
    pub(crate) reference: Option<Rc<Reference>>,
    pub(crate) note: ReferenceNote,
}

/// The plant whose model `offer` solves, if it can be built, and whether it is in the study.
pub(crate) fn model_of<'a>(
    factory: &'a dyn PlantFactory,
    offer: &PlantOffer,
) -> Option<(&'a PlantOffer, bool)> {
    let name = offer.model_of.as_ref()?;
    let named = |plants: &'a [PlantOffer]| plants.iter().find(|plant| plant.name == *name);
    let studied = named(factory.plants()).map(|plant| (plant, true));
    studied.or_else(|| named(factory.bystanders()).map(|plant| (plant, false)))
}

impl<'a> References<'a> {
    pub(crate) fn new(stage: Stage<'a>, scales: Scales, trust: Trust) -> Self {
        Self {
            stage,
            scales,
            trust,
            known: Vec::new(),
        }
    }

    /// What `offer` is measured against.
    pub(crate) fn of(&mut self, offer: &PlantOffer, share: Share) -> Standard {
        let Some(name) = &offer.model_of else {
            return self.own(offer, share);
        };
        let Some((model, studied)) = model_of(self.stage.factory, offer) else {
            let why = format!("there is no plant {name}, whose model it solves");
            return self.own(offer, share).in_want(&why);
        };
        match self.checked(model, share.part(2)) {
            Ok(reference) => {
                let aside = if studied {
                    ""
                } else {
                    ", which is not in this study"
                };
                let why = format!("that of {name}{aside}, whose model it solves");
                let note = reference.note().borrowed_by(&offer.name, &why);
                Standard {
                    reference: Some(reference),
                    note,
                }
            }
            Err(error) => {
                let why = format!("{name}, whose model it solves, has none ({error})");
                self.own(offer, share.part(2)).in_want(&why)
            }
        }
    }

    /// A reference of its own.
    fn own(&mut self, offer: &PlantOffer, share: Share) -> Standard {
        match self.checked(offer, share) {
            Ok(reference) => Standard {
                note: reference.note(),
                reference: Some(reference),
            },
            Err(why) => Standard {
                note: ReferenceNote::missing(&offer.name, why),
                reference: None,
            },
        }
    }

    fn checked(&mut self, offer: &PlantOffer, share: Share) -> Result<Rc<Reference>, String> {
        let mut known = self.known.iter();
        if let Some((_, known)) = known.find(|(plant, _)| *plant == offer.name) {
            return known.clone();
        }
        let found = reference::checked(&self.stage, offer, self.scales, self.trust, share);
        let found = found.map(Rc::new);
        self.known.push((offer.name.clone(), found.clone()));
        found
    }
}

impl Standard {
    /// The same, which is its own for want of a better one.
    fn in_want(mut self, why: &str) -> Self {
        let own = "so it is measured against itself, and what is wrong with it at every step does not show";
        self.note.add_why(&format!("{why}: {own}"));
        self
    }
}

impl ReferenceNote {
    /// The note of a plant that is measured against this.
    fn borrowed_by(self, plant: &str, why: &str) -> Self {
        let mut note = Self {
            plant: plant.to_owned(),
            of_plant: Some(self.plant),
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
