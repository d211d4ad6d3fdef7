//! Serial devices of a robot: each has its frames, the driver that runs on the robot's computer and
//! an emulated board or sensor at the other end of the wire, in a module of its own. The
//! configuration of a device is a [`FramedDevice`], of which both sides are made.
//!
//! A further device is a module beside the others, with its tests, and a line in [`drivers`]; the
//! kind of bus that makes it of a scenario is a file in `twin/rig/src/parts`.

use std::error::Error;

use twinrig_runtime::Driver;

mod framed_device;
pub mod optoforce;
pub mod phidget;
pub mod rb110;
#[cfg(test)]
mod tests;

pub use framed_device::FramedDevice;

/// Returns the drivers of all devices, made of their [examples](FramedDevice::examples), for tests
/// of all alike.
///
/// # Errors
/// If an example is invalid.
pub fn drivers() -> Result<Vec<Box<dyn Driver>>, Box<dyn Error>> {
    let mut drivers = Vec::new();
    add::<optoforce::OptoForce>(&mut drivers)?;
    add::<phidget::Phidget>(&mut drivers)?;
    add::<rb110::Rb110>(&mut drivers)?;
    Ok(drivers)
}

fn add<D: FramedDevice>(drivers: &mut Vec<Box<dyn Driver>>) -> Result<(), D::Error> {
    for example in D::examples() {
        drivers.push(Box::new(example.driver()?));
    }
    Ok(())
}
