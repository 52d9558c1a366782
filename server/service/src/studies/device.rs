//! Adding a device: one way in for the REST interface and the command line.

use crate::error::Error;
use crate::printable;
use gait_optimizer::Device as Definition;
use gaitwright_store::Writer;
use gaitwright_store::audit::{self, Actor};
use gaitwright_store::devices::{self, Device};
use serde_json::json;

/// Checks a device's name and numbers.
///
/// # Errors
/// [`Error::Invalid`] naming the field.
pub fn check(definition: &Definition) -> Result<(), Error> {
    printable::name("device.name", &definition.name, 80)?;
    Ok(definition.validate()?)
}

/// Checks a device and writes it; the one that is there already where it is the very same. Two devices of one name could
/// not be told apart where one is chosen.
///
/// # Errors
/// [`Error::Invalid`] naming the field.
pub async fn add(writer: &mut Writer, actor: &Actor, definition: &Definition) -> Result<Device, Error> {
    check(definition)?;
    let name = definition.name.as_str();
    if devices::find(writer, definition).await?.is_none() && devices::has_name(writer, name).await? {
        return Err(Error::invalid("device.name", name, "a name that no other device has"));
    }
    let (device, added) = devices::ensure(writer, definition).await?;
    if added {
        let detail = json!({ "name": device.name });
        audit::append(writer, actor, "device.add", &format!("device {}", device.id), &detail).await?;
    }
    Ok(device)
}
