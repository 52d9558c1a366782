//! Checks and adds a device, for REST and the command line.

use crate::error::Error;
use crate::printable;
use gait_optimizer::Device as Definition;
use gaitwright_store::audit::{self, Actor};
use gaitwright_store::devices::{self, DeviceRow};
use gaitwright_store::{Connection, Writer};
use serde_json::json;

/// Checks the name and the numbers of a device.
///
/// # Errors
/// [`Error::Invalid`] naming the field.
pub fn check(definition: &Definition) -> Result<(), Error> {
    printable::name("device.name", &definition.name, 80)?;
    Ok(definition.validate()?)
}

/// Checks a device as [`add`] does, without adding it. Names are unique, so that people can choose one from a list.
///
/// # Errors
/// [`Error::Invalid`] naming the field.
pub async fn check_new(db: &mut Connection, definition: &Definition) -> Result<(), Error> {
    check(definition)?;
    let name = definition.name.as_str();
    if devices::find(db, definition).await?.is_none() && devices::has_name(db, name).await? {
        return Err(Error::invalid("device.name", name, "a name that no other device has"));
    }
    Ok(())
}

/// Adds a device, or returns the identical one that is already on record.
///
/// # Errors
/// [`Error::Invalid`] naming the field.
pub async fn add(writer: &mut Writer, actor: &Actor, definition: &Definition) -> Result<(DeviceRow, bool), Error> {
    check_new(writer, definition).await?;
    let (device, added) = devices::ensure(writer, definition).await?;
    if added {
        let detail = json!({ "name": device.name });
        audit::append(writer, actor, "device.add", &format!("device {}", device.id), &detail).await?;
    }
    Ok((device, added))
}
