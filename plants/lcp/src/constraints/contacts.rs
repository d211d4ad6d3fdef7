//! Contact points on the ground.

use core::ops::{Deref, DerefMut};

use crate::model::constants::LANES;

/// Maximum number of simultaneous contacts: two points of each leg.
pub(crate) const CONTACTS: usize = 2 * LANES;

/// Contact point on the ground.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Contact {
    pub(crate) leg: usize,
    /// Number of links above it: three for the end of the third segment, four for the tip of the
    /// toe.
    pub(crate) links: usize,
    /// None for a sticking foot; otherwise the last direction of sliding, in the tangents of the
    /// ground.
    pub(crate) slides: Option<[f64; 2]>,
}

/// Contact points on the ground in order of detection, in fixed storage without heap allocation.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Contacts {
    all: [Contact; CONTACTS],
    count: usize,
}

impl Contacts {
    pub(crate) fn none() -> Self {
        let contact = Contact {
            leg: 0,
            links: 3,
            slides: None,
        };
        Self {
            all: [contact; CONTACTS],
            count: 0,
        }
    }

    /// Adds a contact point.
    ///
    /// # Panics
    /// If there are [`CONTACTS`] already, which requires a duplicate point.
    pub(crate) fn push(&mut self, contact: Contact) {
        self.all[self.count] = contact;
        self.count += 1;
    }

    pub(crate) fn clear(&mut self) {
        self.count = 0;
    }

    /// Retains the contacts for which `keep` returns true, in their order.
    pub(crate) fn retain(&mut self, keep: impl Fn(&Contact) -> bool) {
        let mut count = 0;
        for i in 0..self.count {
            if keep(&self.all[i]) {
                self.all[count] = self.all[i];
                count += 1;
            }
        }
        self.count = count;
    }
}

impl Deref for Contacts {
    type Target = [Contact];

    fn deref(&self) -> &[Contact] {
        &self.all[..self.count]
    }
}

impl DerefMut for Contacts {
    fn deref_mut(&mut self) -> &mut [Contact] {
        &mut self.all[..self.count]
    }
}

impl<'a> IntoIterator for &'a Contacts {
    type Item = &'a Contact;
    type IntoIter = core::slice::Iter<'a, Contact>;

    fn into_iter(self) -> Self::IntoIter {
        self.iter()
    }
}

impl<'a> IntoIterator for &'a mut Contacts {
    type Item = &'a mut Contact;
    type IntoIter = core::slice::IterMut<'a, Contact>;

    fn into_iter(self) -> Self::IntoIter {
        self.iter_mut()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn retain_preserves_order() {
        let mut contacts = Contacts::none();
        for leg in 0..4 {
            contacts.push(Contact {
                leg,
                links: 3,
                slides: None,
            });
        }
        contacts.retain(|contact| contact.leg % 2 == 1);
        assert_eq!(contacts.iter().map(|c| c.leg).collect::<Vec<_>>(), [1, 3]);
        contacts.clear();
        assert!(contacts.is_empty());
    }
}
