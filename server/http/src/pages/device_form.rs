//! The page of a device: its values, and the form that derives a new device from it.

use crate::AppState;
use crate::accessible::Id;
use crate::authorization::Authorized;
use crate::extractors::{Form, FormFields};
use crate::form_errors;
use crate::format;
use crate::page_error::{PageError, PageResult, page};
use askama::Template;
use axum::extract::State;
use axum::http::StatusCode;
use axum::response::{IntoResponse, Redirect, Response};
use gait_optimizer::{Device as Definition, DeviceField};
use gaitwright_service::access::{Read, RequiredRight, Run};
use gaitwright_service::error::{Error, FieldError};
use gaitwright_service::studies::device;
use gaitwright_store::devices::{self, Device};
use gaitwright_store::{DeviceId, commit};
use serde_json::{Map, Value, json};

#[derive(Template)]
#[template(path = "device.html")]
struct DevicePage {
    device: Device,
    rows: Vec<DeviceRow>,
    name: String,
    carried_limb: bool,
    may_run: bool,
    refused: Option<FieldError>,
}

struct DeviceRow {
    field: DeviceField,
    allowed: String,
    value: String,
    source: String,
}

impl DevicePage {
    fn of(device: Device, may_run: bool) -> Self {
        let of_device = |field: &DeviceField| DeviceRow {
            field: *field,
            allowed: format::range(field.minimum, field.maximum),
            value: (field.value)(&device.definition).to_string(),
            source: device.definition.sources.get(field.name).cloned().unwrap_or_default(),
        };
        let rows = Definition::FIELDS.iter().map(of_device).collect();
        let (name, carried_limb) = (device.name.clone(), device.definition.carried_limb);
        Self { device, rows, name, carried_limb, may_run, refused: None }
    }

    fn file_name(&self) -> String {
        format::file_name(&self.device.name)
    }

    /// The entries of a refused form.
    fn refusing(mut self, fields: &FormFields, refused: FieldError) -> Self {
        for row in &mut self.rows {
            row.value = fields.get(row.field.name).cloned().unwrap_or_default();
        }
        self.name = fields.get("name").cloned().unwrap_or_default();
        self.carried_limb = fields.contains_key("carried_limb");
        let name = refused.field.trim_start_matches("device.");
        let label = Definition::FIELDS.iter().find(|field| field.name == name).map(|field| field.meaning);
        let message = match label {
            Some(label) => form_errors::of_field(label, &refused),
            None => form_errors::in_words(&refused.clone().into()),
        };
        self.refused = Some(FieldError { message, ..refused });
        self
    }

    fn refuses(&self, field: &str) -> bool {
        self.refused.as_ref().is_some_and(|refused| refused.field.trim_start_matches("device.") == field)
    }
}

/// `GET /devices/{id}`.
pub(super) async fn get(
    authorized: Authorized<Read>,
    State(app): State<AppState>,
    Id(id, _): Id<DeviceId, Read>,
) -> PageResult {
    let device = devices::get(&mut *app.read().await?, id).await?;
    page(&DevicePage::of(device, authorized.caller.may(Run::NEEDED)))
}

/// `POST /devices/{id}`: adds a device that is derived from this one.
pub(super) async fn post(
    authorized: Authorized<Run>,
    State(app): State<AppState>,
    Id(id, _): Id<DeviceId, Run>,
    Form(fields): Form<FormFields>,
) -> Result<Response, PageError> {
    let before = devices::get(&mut *app.read().await?, id).await?;
    let mut writer = app.write().await?;
    let added = match changed(&before.definition, &fields) {
        Ok(definition) => device::add(&mut writer, &authorized.caller.actor, &definition).await,
        Err(error) => Err(error),
    };
    match added {
        Ok((added, _)) => {
            commit(writer).await?;
            Ok(Redirect::to(&format!("/devices/{}", added.id)).into_response())
        }
        Err(Error::Invalid(refused)) => {
            let form = page(&DevicePage::of(before, true).refusing(&fields, *refused))?;
            Ok((StatusCode::UNPROCESSABLE_ENTITY, form).into_response())
        }
        Err(other) => Err(other.into()),
    }
}

/// The device with the entries. A changed value loses its source, which belongs to the old value.
fn changed(before: &Definition, fields: &FormFields) -> Result<Definition, Error> {
    let known = |name: &str| Definition::FIELDS.iter().any(|field| field.name == name);
    if let Some(name) = fields.keys().find(|name| !known(name) && !matches!(name.as_str(), "name" | "carried_limb")) {
        return Err(form_errors::unknown_field(name).into());
    }
    let mut values = Map::new();
    let mut sources = before.sources.clone();
    for field in &Definition::FIELDS {
        let text = fields.get(field.name).map_or("", String::as_str).trim();
        let allowed = || format!("{} to {}", field.minimum, field.maximum);
        let value: f64 = text.parse().map_err(|_| Error::invalid(field.name, text, &allowed()))?;
        if !(field.minimum..=field.maximum).contains(&value) {
            return Err(Error::invalid(field.name, text, &allowed()));
        }
        if value.to_bits() != (field.value)(before).to_bits() {
            sources.remove(field.name);
        }
        values.insert(field.name.to_owned(), json!(value));
    }
    values.insert("name".to_owned(), json!(fields.get("name").map_or("", String::as_str).trim()));
    values.insert("carried_limb".to_owned(), json!(fields.contains_key("carried_limb")));
    values.insert("sources".to_owned(), json!(sources));
    serde_json::from_value(Value::Object(values)).map_err(|e| Error::Internal(e.to_string()))
}
