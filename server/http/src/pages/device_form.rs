//! The page of a device: its values, and the form that derives a new device from it.

use crate::AppState;
use crate::accessible::Id;
use crate::authorization::Authorized;
use crate::extractors::{Form, FormFields};
use crate::form_errors;
use crate::format;
use crate::page_error::{PageError, PageResult, page};
use crate::refused_fields::{FieldLabels, FormCheck, RefusedFields, TypedForm, labels_of};
use askama::Template;
use axum::extract::State;
use axum::response::{IntoResponse, Redirect, Response};
use gait_optimizer::{Device as Definition, DeviceField};
use gaitwright_service::access::{Read, RequiredRight, Run};
use gaitwright_service::error::Error;
use gaitwright_service::studies::device;
use gaitwright_store::devices::{self, DeviceRow};
use gaitwright_store::{DeviceId, commit};
use serde_json::{Map, Value, json};
use std::ops::ControlFlow;

#[derive(Template)]
#[template(path = "device.html")]
struct DevicePage {
    device: DeviceRow,
    rows: Vec<FieldRow>,
    name: String,
    carried_limb: bool,
    may_run: bool,
    refused: RefusedFields,
}

struct FieldRow {
    field: DeviceField,
    allowed: String,
    value: String,
    source: String,
}

impl DevicePage {
    fn of(device: DeviceRow, may_run: bool) -> Self {
        let of_device = |field: &DeviceField| FieldRow {
            field: *field,
            allowed: format::range(field.minimum, field.maximum),
            value: (field.value)(&device.definition).to_string(),
            source: device.definition.sources.get(field.name).cloned().unwrap_or_default(),
        };
        let rows = Definition::FIELDS.iter().map(of_device).collect();
        let (name, carried_limb) = (device.name.clone(), device.definition.carried_limb);
        Self { device, rows, name, carried_limb, may_run, refused: RefusedFields::default() }
    }

    fn file_name(&self) -> String {
        format::file_name(&self.device.name)
    }

    /// The entries of a refused form.
    fn refusing(mut self, fields: &FormFields, refused: RefusedFields) -> Self {
        for row in &mut self.rows {
            row.value = fields.get(row.field.name).cloned().unwrap_or_default();
        }
        self.name = fields.get("name").cloned().unwrap_or_default();
        self.carried_limb = fields.contains_key("carried_limb");
        self.refused = refused;
        self
    }
}

/// The form as typed, and the device from which a new one is derived.
#[derive(Debug, Clone)]
struct DerivedDevice {
    before: Definition,
    fields: FormFields,
}

impl TypedForm for DerivedDevice {
    const LABELS: FieldLabels = &[("name", "Name")];

    fn labels(&self) -> Vec<(String, String)> {
        let quantities = Definition::FIELDS.iter().map(|field| (field.name.to_owned(), field.meaning.to_owned()));
        labels_of(Self::LABELS).into_iter().chain(quantities).collect()
    }

    fn repair(&mut self, field: &str) -> bool {
        let quantity = Definition::FIELDS.iter().find(|known| known.name == field);
        let value = match quantity {
            Some(known) => (known.value)(&self.before).to_string(),
            // A name that no device has.
            None if field == "name" => DeviceId::fresh().to_string(),
            None => return false,
        };
        self.fields.insert(field.to_owned(), value);
        true
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
    let mut writer = app.write().await?;
    let before = devices::get(&mut writer, id).await?;
    let mut check = FormCheck::new(&DerivedDevice { before: before.definition.clone(), fields: fields.clone() });
    let definition = loop {
        let read = async {
            let definition = changed(check.form())?;
            device::check_new(&mut writer, &definition).await?;
            Ok(definition)
        }
        .await;
        if let ControlFlow::Break(definition) = check.step(read)? {
            break definition;
        }
    };
    let refused = check.into_refused();
    if let Some(definition) = definition.filter(|_| refused.is_empty()) {
        let (added, _) = device::add(&mut writer, &authorized.caller.actor, &definition).await?;
        commit(writer).await?;
        return Ok(Redirect::to(&format!("/devices/{}", added.id)).into_response());
    }
    drop(writer);
    let status = refused.status();
    Ok((status, page(&DevicePage::of(before, true).refusing(&fields, refused))?).into_response())
}

/// The device with the entries. A changed value loses its source, which belongs to the old value.
fn changed(DerivedDevice { before, fields }: &DerivedDevice) -> Result<Definition, Error> {
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
