//! Serialised state of a flow.

mod numbers;

use twinrig_legged::StepLoad;

use crate::constraints::contacts::CONTACTS;
use crate::constraints::contacts::Contact;
use crate::formulation::SavedFlow;
use crate::plant::flow::Flow;

impl<const N: usize> Flow<N> {
    /// Returns the state to be serialised.
    pub(crate) fn saved(&self) -> SavedFlow {
        let mut numbers = Vec::new();
        self.visit(&mut |x| numbers.push(x));
        let contact = |c: &Contact| (c.leg as u64, c.links as u64, c.slides);
        SavedFlow {
            numbers,
            contacts: self.run.mode.contacts.iter().map(contact).collect(),
            ledger: self.run.ledger,
            counts: self.run.counts,
        }
    }

    /// Restores a saved state; returns the mismatch on error.
    pub(crate) fn restore_saved(&mut self, saved: &SavedFlow) -> Result<(), String> {
        let mut expected = 0;
        self.visit(&mut |_| expected += 1);
        if saved.numbers.len() != expected {
            return Err(format!(
                "{} numbers, expected {expected}",
                saved.numbers.len()
            ));
        }
        let mut numbers = saved.numbers.iter();
        self.run.set_load(&StepLoad::default());
        let cached_recovery =
            self.replace(&mut || *numbers.next().expect("the number of values was checked"));
        self.run.mode.contacts.clear();
        if saved.contacts.len() > CONTACTS {
            return Err(format!(
                "{} contacts, at most {CONTACTS}",
                saved.contacts.len()
            ));
        }
        for &(leg, links, slides) in &saved.contacts {
            let contact = usize::try_from(leg).ok().zip(usize::try_from(links).ok());
            let Some((leg, links)) = contact
                .filter(|&(leg, links)| leg < self.model.legs.len() && (3..=N).contains(&links))
            else {
                return Err(format!("invalid contact of leg {leg} at link {links}"));
            };
            self.run.mode.contacts.push(Contact { leg, links, slides });
        }
        self.run.mode.update_any();
        (self.run.ledger, self.run.counts) = (saved.ledger, saved.counts);
        self.event_driven
            .restore_cache(&self.model, &mut self.run, cached_recovery);
        Ok(())
    }
}
