//! The page of a subject, with the forms for consent, withdrawal and corrections.

use super::saved::{Saved, confirmed};
use crate::AppState;
use crate::accessible::{DespiteWithdrawal, Id};
use crate::authorization::Authorized;
use crate::extractors::{Form, Params};
use crate::format::{variant, words};
use crate::page_error::{PageError, PageResult, page};
use crate::refused_fields::{FieldLabels, FormCheck, RefusedFields, TypedForm, refused_once};
use crate::units::Units;
use askama::Template;
use axum::extract::State;
use axum::response::{IntoResponse, Redirect, Response};
use gaitwright_service::access::{Administer, Caller, Reach, Read, RequiredRight, Run};
use gaitwright_service::error::Error;
use gaitwright_service::studies::consent::{self, ConsentWithdrawal, NewConsent};
use gaitwright_service::studies::lab::LabSessionView;
use gaitwright_service::studies::lifecycle;
use gaitwright_service::studies::subject::{self, NewCorrection};
use gaitwright_store::consents::{self, Consent, ConsentKind};
use gaitwright_store::studies::Study;
use gaitwright_store::subjects::{self, Correction, SubjectRow};
use gaitwright_store::trials::TrialCounts;
use gaitwright_store::{Connection, SubjectId, commit, lab_sessions, studies, trials};
use serde::Deserialize;

/// How many studies the page shows.
const PAGE: u32 = 100;

#[derive(Template)]
#[template(path = "subject.html")]
struct SubjectPage {
    units: Units,
    subject: SubjectRow,
    consents: Vec<Consent>,
    withdrawn: bool,
    may_run: bool,
    /// The newest ones.
    studies: Vec<StudyRow>,
    /// Lab sessions of these studies; empty after a withdrawal.
    sessions: Vec<SessionRow>,
    /// The newest consent row that the form knows, so that a repeated form is recorded once.
    after: i64,
    corrections: Vec<Correction>,
    /// The newest correction that the form knows, so that a repeated form is recorded once.
    corrected: i64,
    may_administer: bool,
    saved: bool,
    refused: RefusedFields,
    /// The correction as typed, or the present values.
    correction: Correcting,
    /// The form in a refused consent.
    consent_form: String,
    /// The reason in a refused withdrawal.
    withdrawal_reason: String,
}

impl SubjectPage {
    /// Height and body mass, with the other units in brackets.
    fn body(&self) -> String {
        let other = if self.units == Units::Si { Units::Customary } else { Units::Si };
        let (height, mass) = (&self.subject.height_m, &self.subject.body_mass_kg);
        let (units, both) = (self.units, |shown: String, other: String| format!("{shown} ({other})"));
        let (height, mass) =
            (both(units.height(height), other.height(height)), both(units.mass(mass), other.mass(mass)));
        format!("{height} · {mass}")
    }
}

/// The fields of the form that corrects height and mass.
struct Correcting {
    height_m: String,
    body_mass_kg: String,
    reason: String,
    /// Whether the form was refused.
    refused: bool,
}

impl Correcting {
    fn of(subject: &SubjectRow, units: Units) -> Self {
        let (height_m, body_mass_kg) = (units.height_entry(subject.height_m), units.mass_entry(subject.body_mass_kg));
        Self { height_m, body_mass_kg, reason: String::new(), refused: false }
    }
}

/// Outcome of a form of the page, with the entries of a refused one.
#[derive(Default)]
enum SentForm {
    #[default]
    Nothing,
    /// The form was saved.
    Saved,
    Correction(Correcting),
    Consent(String),
    Withdrawal(String),
}

/// A study of the subject.
struct StudyRow {
    study: Study,
    state: &'static str,
    variant: &'static str,
    counts: TrialCounts,
}

/// A lab session of the subject.
struct SessionRow {
    session: LabSessionView,
    study: String,
    state: String,
}

/// `GET /subjects/{id}`.
pub(super) async fn get(
    authorized: Authorized<Read>,
    State(app): State<AppState>,
    units: Units,
    Id(id, _): Id<SubjectId, Read>,
    Params(Saved { saved }): Params<Saved>,
) -> PageResult {
    let form = if saved { SentForm::Saved } else { SentForm::Nothing };
    show(&app, units, id, &authorized.caller, RefusedFields::default(), form).await
}

async fn show(
    app: &AppState,
    units: Units,
    id: SubjectId,
    caller: &Caller,
    refused: RefusedFields,
    typed: SentForm,
) -> PageResult {
    let (may_run, may_administer) = (caller.may(Run::NEEDED), caller.may(Administer::NEEDED));
    let mut reader = app.read().await?;
    let subject = subjects::get(&mut reader, id).await?;
    let consents = consents::of_subject(&mut reader, id).await?;
    let studies = studies_of(&mut reader, caller.reach(), id).await?;
    let mut sessions = Vec::new();
    let last = consents.last();
    let withdrawn = last.is_some_and(|last| last.kind == ConsentKind::Withdrawn);
    let corrections = if withdrawn { Vec::new() } else { subjects::corrections(&mut reader, id).await? };
    for row in studies.iter().filter(|_| !withdrawn) {
        sessions.extend(sessions_of(&mut reader, &row.study).await?);
    }
    drop(reader);
    let after = last.map_or(0, |last| last.seq);
    let corrected = corrections.last().map_or(0, |last| last.seq);
    let mut correction = Correcting::of(&subject, units);
    let (mut consent_form, mut withdrawal_reason) = (String::new(), String::new());
    let saved = matches!(typed, SentForm::Saved);
    match typed {
        SentForm::Nothing | SentForm::Saved => {}
        SentForm::Correction(typed) => correction = typed,
        SentForm::Consent(form) => consent_form = form,
        SentForm::Withdrawal(reason) => withdrawal_reason = reason,
    }
    page(&SubjectPage {
        units,
        subject,
        consents,
        withdrawn,
        may_run,
        studies,
        sessions,
        after,
        corrections,
        corrected,
        may_administer,
        saved,
        refused,
        correction,
        consent_form,
        withdrawal_reason,
    })
}

/// The studies of a subject that the caller can see, newest first.
async fn studies_of(db: &mut Connection, reach: Reach, id: SubjectId) -> Result<Vec<StudyRow>, Error> {
    let mut rows = Vec::new();
    for study in studies::of_subject(db, reach, id, PAGE).await? {
        let counts = trials::counts(db, study.id).await?;
        rows.push(StudyRow {
            state: lifecycle::in_words(study.state),
            variant: variant(study.plan.muscles),
            counts,
            study,
        });
    }
    Ok(rows)
}

/// The lab sessions of a study, newest first.
async fn sessions_of(db: &mut Connection, study: &Study) -> Result<Vec<SessionRow>, Error> {
    let sessions = lab_sessions::of_study(db, study.id).await?;
    let row = |session| {
        let session = LabSessionView::from(session);
        SessionRow { state: words(session.state.as_str()), session, study: study.plan.name.clone() }
    };
    Ok(sessions.iter().rev().map(row).collect())
}

/// The label of a new consent.
const CONSENT: FieldLabels = &[("form", "Signed consent form")];
/// The label of the reason for a withdrawal.
const WITHDRAWAL: FieldLabels = &[("reason", "Reason, or \u{201c}none given\u{201d}")];

/// The form that was signed.
#[derive(Debug, Deserialize)]
pub(super) struct Signed {
    form: String,
    after: i64,
}

/// `POST /subjects/{id}/consent`.
pub(super) async fn consent(
    authorized: Authorized<Run>,
    State(app): State<AppState>,
    units: Units,
    DespiteWithdrawal(id, _): DespiteWithdrawal<SubjectId, Run>,
    Form(form): Form<Signed>,
) -> Result<Response, PageError> {
    let typed = SentForm::Consent(form.form.clone());
    let refused = refused_once(give(&app, &authorized, id, form).await, CONSENT)?;
    answer(&app, units, id, &authorized.caller, refused, typed).await
}

async fn give(app: &AppState, authorized: &Authorized<Run>, id: SubjectId, form: Signed) -> Result<(), Error> {
    let mut writer = app.write().await?;
    let newest = consents::of_subject(&mut writer, id).await?.last().map_or(0, |last| last.seq);
    if newest != form.after {
        return Err(Error::conflict(
            "Nothing was changed, because consent was recorded or withdrawn after this form was loaded. Check the consent on \
             this page, then send the form again.",
        ));
    }
    consent::give(&mut writer, &authorized.caller.actor, id, &NewConsent { form: form.form }).await?;
    Ok(commit(writer).await?)
}

/// `POST /subjects/{id}/withdraw`.
pub(super) async fn withdraw(
    authorized: Authorized<Run>,
    State(app): State<AppState>,
    units: Units,
    DespiteWithdrawal(id, _): DespiteWithdrawal<SubjectId, Run>,
    Form(form): Form<Withdrawing>,
) -> Result<Response, PageError> {
    let why = ConsentWithdrawal { reason: form.reason };
    let done = if form.confirmed.as_deref() == Some("yes") {
        end(&app, &authorized, id, &why).await
    } else {
        Err(Error::conflict(
            "Nothing was changed. First tick the box to confirm that all studies of this subject will be stopped.",
        ))
    };
    answer(&app, units, id, &authorized.caller, refused_once(done, WITHDRAWAL)?, SentForm::Withdrawal(why.reason)).await
}

/// The form of a withdrawal.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Withdrawing {
    reason: String,
    /// `yes` if the box is ticked.
    confirmed: Option<String>,
}

async fn end(
    app: &AppState,
    authorized: &Authorized<Run>,
    id: SubjectId,
    why: &ConsentWithdrawal,
) -> Result<(), Error> {
    let mut writer = app.write().await?;
    let (_, cancelled) = consent::withdraw(&mut writer, &authorized.caller.actor, id, why).await?;
    commit(writer).await?;
    for trial in cancelled {
        app.scheduler.cancel_solve(trial).await;
    }
    app.scheduler.changed();
    Ok(())
}

/// Corrected height and mass, as typed.
#[derive(Debug, Clone, Deserialize)]
pub(super) struct CorrectionForm {
    height_m: String,
    body_mass_kg: String,
    /// The units in which the form was shown.
    #[serde(default)]
    units: Units,
    reason: String,
    before: i64,
}

impl CorrectionForm {
    fn read(&self) -> Result<NewCorrection, Error> {
        let (height_m, body_mass_kg) = self.units.read_height_and_mass(&self.height_m, &self.body_mass_kg)?;
        let new = NewCorrection { height_m, body_mass_kg, reason: self.reason.clone() };
        subject::check_correction(&new)?;
        Ok(new)
    }
}

impl TypedForm for CorrectionForm {
    const LABELS: FieldLabels = &[("height_m", "Height"), ("body_mass_kg", "Body mass"), ("reason", "Reason")];

    fn labels(&self) -> Vec<(String, String)> {
        self.units.with_headings(Self::LABELS)
    }

    fn repair(&mut self, field: &str) -> bool {
        match field {
            "height_m" => "1.75 m".clone_into(&mut self.height_m),
            "body_mass_kg" => "70 kg".clone_into(&mut self.body_mass_kg),
            "reason" => "a reason".clone_into(&mut self.reason),
            _ => return false,
        }
        true
    }
}

/// `POST /subjects/{id}/correct`.
pub(super) async fn correct(
    authorized: Authorized<Run>,
    State(app): State<AppState>,
    units: Units,
    Id(id, _): Id<SubjectId, Run>,
    Form(form): Form<CorrectionForm>,
) -> Result<Response, PageError> {
    let typed = Correcting {
        height_m: form.height_m.clone(),
        body_mass_kg: form.body_mass_kg.clone(),
        reason: form.reason.clone(),
        refused: true,
    };
    let mut check = FormCheck::new(&form);
    let new = check.read(CorrectionForm::read)?;
    if let Some(new) = new.filter(|_| check.is_clean())
        && let Err(error) = set_right(&app, &authorized, id, form.before, &new).await
    {
        check.refuse(error)?;
    }
    answer(&app, units, id, &authorized.caller, check.into_refused(), SentForm::Correction(typed)).await
}

async fn set_right(
    app: &AppState,
    authorized: &Authorized<Run>,
    id: SubjectId,
    before: i64,
    new: &NewCorrection,
) -> Result<(), Error> {
    let mut writer = app.write().await?;
    let newest = subjects::corrections(&mut writer, id).await?.last().map_or(0, |last| last.seq);
    if newest != before {
        return Err(Error::conflict(
            "Nothing was changed, because height and mass were corrected after this form was loaded. Check the values on this \
             page, then send the form again.",
        ));
    }
    subject::correct(&mut writer, &authorized.caller.actor, id, new).await?;
    Ok(commit(writer).await?)
}

/// Shows the subject again after a change, with the reasons if it was refused.
async fn answer(
    app: &AppState,
    units: Units,
    id: SubjectId,
    caller: &Caller,
    refused: RefusedFields,
    typed: SentForm,
) -> Result<Response, PageError> {
    if refused.is_empty() {
        return Ok(Redirect::to(&confirmed(&format!("/subjects/{id}"))).into_response());
    }
    Ok((refused.status(), show(app, units, id, caller, refused, typed).await?).into_response())
}
