//! The refused fields of a form, all of them at once. The service refuses one field at a time. A check of a form therefore puts
//! an acceptable value in place of a refused one and reads the form again, until nothing is refused.

use crate::form_errors;
pub(crate) use crate::form_errors::FieldLabels;
use axum::http::StatusCode;
use gaitwright_service::error::{Error, FieldError};
use std::ops::ControlFlow;

/// The fields of a form as typed.
pub(crate) trait TypedForm: Clone {
    /// The labels that do not depend on data. The template of the form shows them with [`TypedForm::label`], so that a page
    /// and its refusals have the same words.
    const LABELS: FieldLabels;

    /// The label of a field, for the template.
    fn label(field: &str) -> &'static str {
        label(Self::LABELS, field)
    }

    /// Every label, in the order of the form.
    fn labels(&self) -> Vec<(String, String)> {
        labels_of(Self::LABELS)
    }

    /// Puts an acceptable value in place of a refused one, to find the other fields that would be refused. Returns whether
    /// there is one.
    fn repair(&mut self, field: &str) -> bool;

    /// The field that shows a refused part of a request, such as `rate_hz` for `reading.rate_hz`.
    fn field_of(&self, refused: &str) -> String {
        refused.rsplit('.').next().unwrap_or(refused).to_owned()
    }

    /// The field that a conflict with the record is about, if any.
    fn field_in_conflict(&self) -> Option<&'static str> {
        None
    }
}

/// The label of a field. A field without one is still named in words.
pub(crate) fn label(labels: FieldLabels, field: &str) -> &'static str {
    labels.iter().find(|(name, _)| *name == field).map_or(form_errors::WITHOUT_LABEL, |(_, label)| label)
}

pub(crate) fn labels_of(labels: FieldLabels) -> Vec<(String, String)> {
    labels.iter().map(|&(name, label)| (name.to_owned(), label.to_owned())).collect()
}

/// Refused fields in the order of their form, each with a sentence for people that begins with its label.
#[derive(Debug, Default)]
pub(crate) struct RefusedFields {
    found: Vec<FieldError>,
    /// Whether nothing but the state of the record speaks against the form.
    only_conflicts: bool,
}

impl RefusedFields {
    /// The refusal of a form with one field that can be refused. Errors that are not about the form pass.
    pub(crate) fn of(error: Error, labels: FieldLabels) -> Result<Self, Error> {
        #[derive(Clone)]
        struct CheckedOnce(FieldLabels);
        impl TypedForm for CheckedOnce {
            const LABELS: FieldLabels = &[];
            fn labels(&self) -> Vec<(String, String)> {
                labels_of(self.0)
            }
            fn repair(&mut self, _: &str) -> bool {
                false
            }
        }
        let mut check = FormCheck::new(&CheckedOnce(labels));
        check.refuse(error)?;
        Ok(check.into_refused())
    }

    /// A refusal that names no field, because that would help somebody who guesses a password.
    pub(crate) fn without_field(reason: &str) -> Self {
        Self { found: vec![FieldError::in_words("", reason)], only_conflicts: false }
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.found.is_empty()
    }

    pub(crate) fn len(&self) -> usize {
        self.found.len()
    }

    pub(crate) fn has(&self, field: &str) -> bool {
        self.found.iter().any(|refused| refused.field == field)
    }

    pub(crate) fn iter(&self) -> impl Iterator<Item = &FieldError> {
        self.found.iter()
    }

    /// The attributes that mark a refused field and point to the reason. The first one gets the focus.
    pub(crate) fn invalid(&self, field: &str) -> &'static str {
        match self.found.iter().position(|refused| refused.field == field) {
            Some(0) => " aria-invalid=\"true\" aria-describedby=\"refused\" autofocus",
            Some(_) => " aria-invalid=\"true\" aria-describedby=\"refused\"",
            None => "",
        }
    }

    /// The status of a page that shows the form again.
    pub(crate) fn status(&self) -> StatusCode {
        match (self.is_empty(), self.only_conflicts) {
            (true, _) => StatusCode::OK,
            (false, true) => StatusCode::CONFLICT,
            (false, false) => StatusCode::UNPROCESSABLE_ENTITY,
        }
    }
}

/// The refusal of a form with one field that can be refused, if it was refused.
pub(crate) fn refused_once(done: Result<(), Error>, labels: FieldLabels) -> Result<RefusedFields, Error> {
    done.map_or_else(|error| RefusedFields::of(error, labels), |()| Ok(RefusedFields::default()))
}

/// The check of a form.
#[derive(Debug)]
pub(crate) struct FormCheck<F> {
    /// The form with acceptable values in place of the refused ones.
    repaired: F,
    labels: Vec<(String, String)>,
    refused: RefusedFields,
}

impl<F: TypedForm> FormCheck<F> {
    pub(crate) fn new(typed: &F) -> Self {
        let refused = RefusedFields { found: Vec::new(), only_conflicts: true };
        Self { repaired: typed.clone(), labels: typed.labels(), refused }
    }

    /// The form with acceptable values in place of those that were refused so far.
    pub(crate) fn form(&self) -> &F {
        &self.repaired
    }

    pub(crate) fn refuses(&self, field: &str) -> bool {
        self.refused.has(field)
    }

    pub(crate) fn refused_names(&self) -> Vec<String> {
        self.refused.found.iter().map(|fault| fault.field.clone()).collect()
    }

    pub(crate) fn is_clean(&self) -> bool {
        self.refused.is_empty()
    }

    /// Notes a refusal and repairs its field. Returns whether the form can be read again. Errors that are not about the form
    /// pass.
    pub(crate) fn refuse(&mut self, error: Error) -> Result<bool, Error> {
        let fault = match error {
            Error::Invalid(fault) => {
                self.refused.only_conflicts = false;
                *fault
            }
            Error::Conflict(message) => {
                FieldError::in_words(self.repaired.field_in_conflict().unwrap_or_default(), &message)
            }
            other => return Err(other),
        };
        let field = self.repaired.field_of(&fault.field);
        if self.refused.has(&field) {
            return Ok(false);
        }
        let label = self.labels.iter().find(|(name, _)| *name == field).map(|(_, label)| label.as_str());
        let message =
            label.map_or_else(|| form_errors::without_label(&fault), |label| form_errors::of_field(label, &fault));
        let goes_on = self.repaired.repair(&field);
        self.refused.found.push(FieldError { field, message, ..fault });
        Ok(goes_on)
    }

    /// Takes what was read from [`Self::form`]. `Continue` asks to read it again, after a refused field got an acceptable value;
    /// `Break` has what was read, or `None` if a refused field has no acceptable value.
    pub(crate) fn step<T>(&mut self, read: Result<T, Error>) -> Result<ControlFlow<Option<T>>, Error> {
        match read {
            Ok(read) => Ok(ControlFlow::Break(Some(read))),
            Err(error) => Ok(if self.refuse(error)? { ControlFlow::Continue(()) } else { ControlFlow::Break(None) }),
        }
    }

    /// Reads the form as often as it takes to find every refused field.
    pub(crate) fn read<T>(&mut self, read: impl Fn(&F) -> Result<T, Error>) -> Result<Option<T>, Error> {
        loop {
            let found = read(&self.repaired);
            if let ControlFlow::Break(read) = self.step(found)? {
                return Ok(read);
            }
        }
    }

    /// The refused fields, in the order of the form.
    pub(crate) fn into_refused(mut self) -> RefusedFields {
        let place = |field: &str| self.labels.iter().position(|(name, _)| name == field).unwrap_or(usize::MAX);
        self.refused.found.sort_by_key(|fault| place(&fault.field));
        self.refused
    }
}
