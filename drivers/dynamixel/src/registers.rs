use twinrig_kernel::{Snapshot, SnapshotError};

use crate::codes::ErrorNumber;
use crate::register::{Access, Bounds, Register};
use crate::request::{Kept, Span};
use crate::table::{CommonRegisters, Derived, EepromLock, Indirect, ServoModel};

/// Registers of a servo: a control table with its values.
///
/// Writes from the bus are checked as a whole: one that is refused changes nothing.
#[derive(Clone, Debug)]
pub struct Registers {
    model: &'static ServoModel,
    bytes: Vec<u8>,
    /// Content of the EEPROM, at its addresses: what a restart restores.
    stored: Vec<u8>,
    /// Hardware error of a model without a register for it.
    alarms: u8,
    /// Addresses and former values of the bytes that a write has changed so far.
    changed: Vec<(u16, u8)>,
}

impl Registers {
    /// Creates the registers with their initial values.
    pub fn new(model: &'static ServoModel) -> Self {
        let mut registers = Self {
            model,
            bytes: vec![0; model.size().into()],
            stored: vec![0; model.size().into()],
            alarms: 0,
            changed: Vec::new(),
        };
        registers.reset(|_| true);
        registers.derive(None);
        registers.stored.clone_from(&registers.bytes);
        registers
    }

    /// Returns the model of the servo.
    pub fn model(&self) -> &'static ServoModel {
        self.model
    }

    /// Sets registers to their initial values.
    fn reset(&mut self, which: impl Fn(&Register) -> bool) {
        for item in self.model.items.iter().filter(|item| which(item)) {
            self.store(item, item.initial);
        }
        for indirect in self.model.indirect {
            for n in 0..indirect.count {
                let [low, high] = (indirect.data + n).to_le_bytes();
                let at = usize::from(indirect.addresses + 2 * n);
                self.bytes[at..at + 2].copy_from_slice(&[low, high]);
            }
        }
    }

    /// Restarts the servo: registers have their initial values, those in the EEPROM the stored
    /// ones.
    pub fn restart(&mut self) {
        self.reset(|item| item.access != Access::Eeprom);
        let items = self.model.items.iter();
        for item in items.filter(|item| item.access == Access::Eeprom) {
            let at = usize::from(item.address);
            let range = at..at + usize::from(item.size);
            self.bytes[range.clone()].copy_from_slice(&self.stored[range]);
        }
        self.derive(None);
    }

    /// Sets all registers but `kept` to their initial values.
    pub fn factory_reset(&mut self, kept: Kept) {
        let roles = self.model.roles;
        let keeps = |item: &Register| match kept {
            Kept::Nothing => false,
            Kept::Id => item.address == roles.id,
            Kept::IdAndBaudRate => [roles.id, roles.baud_rate].contains(&item.address),
        };
        self.reset(|item| !keeps(item));
        self.derive(None);
        self.stored.clone_from(&self.bytes);
    }

    /// Sets the registers that others determine at the start, or by a write to an address.
    fn derive(&mut self, by_write: Option<u16>) {
        let model = self.model;
        let applies = |derived: &&Derived| match by_write {
            None => derived.at_start,
            Some(_) => derived.by_write == by_write,
        };
        for derived in model.derived.iter().filter(applies) {
            let initial = || model.item(derived.register).map_or(0, |item| item.initial);
            let value = derived.from.map_or_else(initial, |from| self.get(from));
            self.set(derived.register, value);
        }
    }

    /// Returns the bits of the hardware error of a model without a register for it.
    pub fn alarms(&self) -> u8 {
        self.alarms
    }

    /// Sets the bits of the hardware error of a model without a register for it.
    pub fn set_alarms(&mut self, alarms: u8) {
        self.alarms = alarms;
    }

    /// Returns the value of the register at an address; 0 if there is none.
    pub fn get(&self, address: u16) -> i32 {
        self.model.item(address).map_or(0, |item| self.load(item))
    }

    /// Sets the register at an address to the nearest value that it can hold, from the side of the
    /// servo.
    pub fn set(&mut self, address: u16, value: i32) {
        if let Some(item) = self.model.item(address) {
            self.store(item, item.representable(value));
            let at = usize::from(address);
            let range = at..at + usize::from(item.size);
            self.stored[range.clone()].copy_from_slice(&self.bytes[range]);
        }
    }

    /// Sets a register to the nearest integer.
    #[expect(clippy::cast_possible_truncation, reason = "the cast saturates")]
    pub fn set_nearest(&mut self, address: u16, value: f64) {
        self.set(address, libm::rint(value) as i32);
    }

    fn load(&self, item: &Register) -> i32 {
        let at = usize::from(item.address);
        let bytes = &self.bytes[at..at + usize::from(item.size)];
        item.decode(bytes).unwrap_or_default()
    }

    fn store(&mut self, item: &Register, value: i32) {
        let (at, size) = (usize::from(item.address), usize::from(item.size));
        self.bytes[at..at + size].copy_from_slice(&item.encode(value)[..size]);
    }

    /// Appends the values of registers to `data`. Addresses without a register read as 0: ASSUMED.
    ///
    /// # Errors
    /// [`ErrorNumber::ACCESS`] beyond the table.
    pub fn read(&self, span: Span, data: &mut Vec<u8>) -> Result<(), ErrorNumber> {
        let start = usize::from(span.address);
        let end = start + usize::from(span.length);
        if end > self.bytes.len() {
            return Err(ErrorNumber::ACCESS);
        }
        let addresses = span.address..span.address + span.length;
        data.extend(addresses.map(|address| self.bytes[usize::from(self.target(address))]));
        Ok(())
    }

    /// Returns the address for which an indirect register stands, or the address itself.
    fn target(&self, address: u16) -> u16 {
        let of = |it: &&Indirect| (it.data..it.data + it.count).contains(&address);
        let Some(indirect) = self.model.indirect.iter().find(of) else {
            return address;
        };
        let at = usize::from(indirect.addresses + 2 * (address - indirect.data));
        u16::from_le_bytes([self.bytes[at], self.bytes[at + 1]])
    }

    /// Writes to registers from the bus. Of a strict model, a register that a write begins, it must
    /// complete, unless it does so by indirect registers.
    ///
    /// # Errors
    /// [`ErrorNumber`], as its constants describe; none of a model that is not strict.
    pub fn write(&mut self, address: u16, data: &[u8]) -> Result<(), ErrorNumber> {
        self.changed.clear();
        let torque = self.model.roles.torque;
        let was_on = self.get(torque) != 0;
        if self.model.is_strict {
            self.write_strictly(address, data)?;
        } else {
            self.write_leniently(address, data);
        }
        let lock = self.model.roles.lock;
        let is_volatile = matches!(lock, EepromLock::Volatile(lock) if self.get(lock) != 0);
        if !is_volatile {
            for &(address, _) in &self.changed {
                let at = usize::from(address);
                self.stored[at] = self.bytes[at];
            }
        }
        self.follow_write(was_on);
        Ok(())
    }

    /// Sets the registers that the last write determines. When the torque is turned on, the goal is
    /// the position, unless the same write has one: ASSUMED.
    fn follow_write(&mut self, was_on: bool) {
        let model = self.model;
        let position = &model.position;
        let has_goal = self
            .changed
            .iter()
            .any(|(address, _)| *address == position.goal);
        if !was_on && !has_goal && self.get(model.roles.torque) != 0 {
            self.set(position.goal, self.get(position.present));
        }
        for index in 0..self.changed.len() {
            self.derive(Some(self.changed[index].0));
        }
    }

    fn write_strictly(&mut self, address: u16, data: &[u8]) -> Result<(), ErrorNumber> {
        let roles = &self.model.roles;
        let locked = match roles.lock {
            EepromLock::Torque => self.get(roles.torque) != 0,
            EepromLock::UntilRestart(lock) => self.get(lock) != 0,
            EepromLock::Volatile(_) => false,
        };
        let written = self.write_bytes(address, data, locked);
        let checked = written.and_then(|()| self.check_changed());
        if checked.is_err() {
            while let Some((address, byte)) = self.changed.pop() {
                self.bytes[usize::from(address)] = byte;
            }
        }
        checked
    }

    /// Writes the bytes that can be written, and limits values to their bounds.
    fn write_leniently(&mut self, address: u16, data: &[u8]) {
        let size = self.model.size();
        for (address, &byte) in (address..size).zip(data) {
            let item = self.model.item_around(address);
            if item.is_some_and(|item| item.access != Access::ReadOnly) {
                let place = &mut self.bytes[usize::from(address)];
                self.changed.push((address, *place));
                *place = byte;
            }
        }
        for index in 0..self.changed.len() {
            let item = self.model.item_around(self.changed[index].0);
            if let Some(item) = item
                && let Some([low, high]) = item.bounds.constant()
            {
                let value = self.load(item);
                let limited = value.clamp(low, high);
                if limited != value {
                    // Also the bytes of the register that were not written.
                    let places = item.address..item.address + u16::from(item.size);
                    let bytes = places.map(|it| (it, self.bytes[usize::from(it)]));
                    self.changed.extend(bytes);
                    self.store(item, limited);
                }
            }
        }
    }

    fn write_bytes(&mut self, address: u16, data: &[u8], locked: bool) -> Result<(), ErrorNumber> {
        if usize::from(address) + data.len() > self.bytes.len() {
            return Err(ErrorNumber::ACCESS);
        }
        if data.is_empty() {
            return Err(ErrorNumber::DATA_LENGTH);
        }
        for (direct, &byte) in (address..).zip(data) {
            let target = self.target(direct);
            let place = usize::from(target);
            match self.model.item_around(target) {
                Some(item) => {
                    let last = address + u16::try_from(data.len() - 1).unwrap_or(u16::MAX);
                    let end = item.address + u16::from(item.size) - 1;
                    match item.access {
                        Access::ReadOnly => return Err(ErrorNumber::ACCESS),
                        Access::Eeprom if locked => return Err(ErrorNumber::ACCESS),
                        _ if locked && self.model.roles.lock.is_register(item.address) => {
                            return Err(ErrorNumber::ACCESS);
                        }
                        _ if target == direct && (item.address < address || end > last) => {
                            return Err(ErrorNumber::DATA_LENGTH);
                        }
                        Access::Ram | Access::Eeprom => {}
                    }
                }
                None if self.model.indirect_around(target).is_some() => {}
                None => return Err(ErrorNumber::ACCESS),
            }
            self.changed.push((target, self.bytes[place]));
            self.bytes[place] = byte;
        }
        Ok(())
    }

    /// Checks the values of the registers that were just written.
    fn check_changed(&self) -> Result<(), ErrorNumber> {
        for &(address, _) in &self.changed {
            if let Some(item) = self.model.item_around(address) {
                self.check(item)?;
            } else if let Some(indirect) = self.model.indirect_around(address) {
                let first = indirect.addresses;
                if (first..first + 2 * indirect.count).contains(&address) {
                    let at = usize::from(address - (address - first) % 2);
                    let target = u16::from_le_bytes([self.bytes[at], self.bytes[at + 1]]);
                    let [low, high] = indirect.targets;
                    if !(low..=high).contains(&target) {
                        return Err(ErrorNumber::DATA_RANGE);
                    }
                }
            }
        }
        Ok(())
    }

    fn check(&self, item: &Register) -> Result<(), ErrorNumber> {
        if let Some((watchdog, goals)) = self.model.roles.watchdog
            && goals.contains(&item.address)
            && self.get(watchdog) == CommonRegisters::SILENCE
        {
            return Err(ErrorNumber::DATA_RANGE);
        }
        let value = self.load(item);
        let within = |low: i32, high: i32, error| {
            let inside = (low..=high).contains(&value);
            if inside { Ok(()) } else { Err(error) }
        };
        match item.bounds {
            Bounds::Between(low, high) => within(low, high, ErrorNumber::DATA_RANGE),
            Bounds::OneOf(values) if values.contains(&value) => Ok(()),
            Bounds::OneOf(_) => Err(ErrorNumber::DATA_RANGE),
            Bounds::Limit(address) => {
                let limit = self.get(address);
                within(-limit, limit, ErrorNumber::DATA_LIMIT)
            }
            Bounds::Positions {
                limits,
                mode,
                in_mode,
                otherwise,
            } => {
                if self.get(mode) == in_mode {
                    let [low, high] = limits.map(|address| self.get(address));
                    within(low, high, ErrorNumber::DATA_LIMIT)
                } else {
                    within(-otherwise, otherwise, ErrorNumber::DATA_RANGE)
                }
            }
            Bounds::AngleLimits { limits, greatest } => {
                match limits.map(|address| self.get(address)) {
                    [0, 0] => within(0, greatest, ErrorNumber::DATA_RANGE),
                    [low, high] => within(low, high, ErrorNumber::DATA_LIMIT),
                }
            }
        }
    }

    /// Saves the values.
    pub fn save(&self) -> Snapshot {
        Snapshot::of(&(&self.bytes, &self.stored, self.alarms))
    }

    /// Restores saved values.
    ///
    /// # Errors
    /// [`SnapshotError`] if they are of another table.
    pub fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError> {
        let (bytes, stored, alarms): (Vec<u8>, Vec<u8>, u8) = snapshot.read()?;
        if bytes.len() != self.bytes.len() || stored.len() != bytes.len() {
            return Err(SnapshotError::Mismatch {
                expected: format!("a control table of {} bytes", self.bytes.len()),
                found: format!("one of {}", bytes.len()),
            });
        }
        (self.bytes, self.stored, self.alarms) = (bytes, stored, alarms);
        Ok(())
    }
}
