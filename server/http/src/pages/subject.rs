//! The pages of subjects, with the forms for consent, withdrawal and corrections.

use crate::AppState;
use crate::accessible::{DespiteWithdrawal, Id};
use crate::authorization::Authorized;
use crate::body_measures;
use crate::extractors::{Form, Params};
use crate::form_errors;
use crate::format::{variant, words};
use crate::page_error::{PageError, PageResult, page};
use crate::problem_details::Problem;
use crate::units::Units;
use askama::Template;
use axum::extract::State;
use axum::response::{IntoResponse, Redirect, Response};
use gaitwright_service::access::{Administer, Caller, Permission, Reach, Read, Run};
use gaitwright_service::error::{Error, FieldError};
use gaitwright_service::studies::consent::{self, NewConsent, Withdrawal};
use gaitwright_service::studies::lab::LabSessionView;
use gaitwright_service::studies::lifecycle;
use gaitwright_service::studies::subject::{self, NewCorrection, NewSubject};
use gaitwright_store::consents::{self, Consent, ConsentKind};
use gaitwright_store::studies::Study;
use gaitwright_store::subjects::{self, Correction, Subject};
use gaitwright_store::trials::TrialCounts;
use gaitwright_store::{Connection, SubjectId, commit, lab_sessions, studies, trials};
use serde::Deserialize;

/// How many subjects the list shows, and how many studies the page of a subject.
const PAGE: u32 = 100;

#[derive(Template)]
#[template(path = "subjects.html")]
struct SubjectsPage {
    units: Units,
    subjects: Vec<SubjectRow>,
    /// The last subject of this page, if more follow.
    next: Option<SubjectId>,
    may_run: bool,
    fields: SubjectFields,
    /// Every refused field.
    refused: Vec<FieldError>,
}

impl SubjectsPage {
    /// The attributes that mark a refused field and point to the reason. The first one gets the focus.
    fn invalid(&self, field: &str) -> &'static str {
        match self.refused.iter().position(|refused| refused.field == field) {
            Some(0) => " aria-invalid=\"true\" aria-describedby=\"refused\" autofocus",
            Some(_) => " aria-invalid=\"true\" aria-describedby=\"refused\"",
            None => "",
        }
    }
}

/// The fields as typed, to show a refused form again.
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub(super) struct SubjectFields {
    pseudonym: String,
    height_m: String,
    body_mass_kg: String,
    notes: String,
}

impl SubjectFields {
    fn read(&self) -> Result<NewSubject, Error> {
        let (height_m, body_mass_kg) = body_of(&self.height_m, &self.body_mass_kg)?;
        Ok(NewSubject { pseudonym: self.pseudonym.clone(), height_m, body_mass_kg, notes: self.notes.clone() })
    }
}

/// Height and mass as typed.
fn body_of(height: &str, mass: &str) -> Result<(f64, f64), Error> {
    Ok((body_measures::height_m("height_m", height)?, body_measures::mass_kg("body_mass_kg", mass)?))
}

/// Every field of a new subject that would be refused, in the order of the form.
fn faults(fields: &SubjectFields) -> Vec<FieldError> {
    let mut repaired = fields.clone();
    let mut found: Vec<FieldError> = Vec::new();
    // Each field is refused once, and an acceptable value takes its place.
    while let Err(Error::Invalid(fault)) = repaired.read().and_then(|new| subject::check_new(&new)) {
        if found.iter().any(|known| known.field == fault.field) {
            break;
        }
        match fault.field.as_str() {
            "pseudonym" => "S01".clone_into(&mut repaired.pseudonym),
            "height_m" => "1.75".clone_into(&mut repaired.height_m),
            "body_mass_kg" => "70".clone_into(&mut repaired.body_mass_kg),
            _ => repaired.notes.clear(),
        }
        found.push(form_errors::with_label(*fault));
    }
    let place = |fault: &FieldError| ["pseudonym", "height_m", "body_mass_kg"].iter().position(|f| *f == fault.field);
    found.sort_by_key(|fault| place(fault).unwrap_or(usize::MAX));
    found
}

struct SubjectRow {
    subject: Subject,
    consent: &'static str,
    withdrawn: bool,
}

#[derive(Template)]
#[template(path = "subject.html")]
struct SubjectPage {
    units: Units,
    subject: Subject,
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
    refused: Option<String>,
    /// The correction as typed, or the present values.
    correction: Correcting,
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
    fn of(subject: &Subject) -> Self {
        let (height_m, body_mass_kg) = (subject.height_m.to_string(), subject.body_mass_kg.to_string());
        Self { height_m, body_mass_kg, reason: String::new(), refused: false }
    }
}

/// The entries of a refused form of the page.
#[derive(Default)]
enum RefusedForm {
    #[default]
    Nothing,
    Correction(Correcting),
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

/// Which subjects to show.
#[derive(Debug, Deserialize)]
pub(super) struct SubjectsBefore {
    before: Option<SubjectId>,
}

/// `GET /subjects`.
pub(super) async fn list(
    authorized: Authorized<Read>,
    State(app): State<AppState>,
    units: Units,
    Params(SubjectsBefore { before }): Params<SubjectsBefore>,
) -> PageResult {
    show_list(&app, units, before, authorized.caller.may(Run::NEEDED), SubjectFields::default(), Vec::new()).await
}

/// `POST /subjects`: adds one, before it has a study.
pub(super) async fn add(
    authorized: Authorized<Run>,
    State(app): State<AppState>,
    units: Units,
    Form(fields): Form<SubjectFields>,
) -> Result<Response, PageError> {
    let added = async {
        let new = fields.read()?;
        let mut writer = app.write().await?;
        let subject = subject::add(&mut writer, &authorized.caller.actor, &new).await?;
        commit(writer).await?;
        Ok(subject.id)
    };
    let error = match added.await {
        Ok(id) => return Ok(Redirect::to(&format!("/subjects/{id}")).into_response()),
        Err(error @ (Error::Invalid(_) | Error::Conflict(_))) => error,
        Err(other) => return Err(other.into()),
    };
    let status = Problem::from(&error).status();
    let refused = match error {
        Error::Invalid(_) => faults(&fields),
        // The only possible conflict is a pseudonym that is taken.
        other => vec![FieldError::in_words("pseudonym", &other.to_string())],
    };
    Ok((status, show_list(&app, units, None, true, fields, refused).await?).into_response())
}

async fn show_list(
    app: &AppState,
    units: Units,
    before: Option<SubjectId>,
    may_run: bool,
    fields: SubjectFields,
    refused: Vec<FieldError>,
) -> PageResult {
    let mut reader = app.read().await?;
    let mut found = subjects::page(&mut reader, before, PAGE + 1).await?;
    let more = found.len() > PAGE as usize;
    found.truncate(PAGE as usize);
    let next = found.last().filter(|_| more).map(|subject| subject.id);
    let mut rows = Vec::with_capacity(found.len());
    for subject in found {
        let consents = consents::of_subject(&mut reader, subject.id).await?;
        let last = consents.last();
        let withdrawn = last.is_some_and(|last| last.kind == ConsentKind::Withdrawn);
        rows.push(SubjectRow { subject, consent: last.map_or("not on record", |last| last.kind.as_str()), withdrawn });
    }
    page(&SubjectsPage { units, subjects: rows, next, may_run, fields, refused })
}

/// `GET /subjects/{id}`.
pub(super) async fn get(
    authorized: Authorized<Read>,
    State(app): State<AppState>,
    units: Units,
    Id(id, _): Id<SubjectId, Read>,
) -> PageResult {
    show(&app, units, id, &authorized.caller, None, RefusedForm::Nothing).await
}

async fn show(
    app: &AppState,
    units: Units,
    id: SubjectId,
    caller: &Caller,
    refused: Option<String>,
    typed: RefusedForm,
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
    let (mut correction, mut withdrawal_reason) = (Correcting::of(&subject), String::new());
    match typed {
        RefusedForm::Nothing => {}
        RefusedForm::Correction(typed) => correction = typed,
        RefusedForm::Withdrawal(reason) => withdrawal_reason = reason,
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
        refused,
        correction,
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
    let done = give(&app, &authorized, id, form).await;
    answer(&app, units, id, &authorized.caller, done, RefusedForm::Nothing).await
}

async fn give(app: &AppState, authorized: &Authorized<Run>, id: SubjectId, form: Signed) -> Result<(), Error> {
    let mut writer = app.write().await?;
    let newest = consents::of_subject(&mut writer, id).await?.last().map_or(0, |last| last.seq);
    if newest != form.after {
        return Err(Error::conflict("Consent was recorded or withdrawn after this form was loaded. Check it first."));
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
    let why = Withdrawal { reason: form.reason };
    let done = if form.confirmed.as_deref() == Some("yes") {
        end(&app, &authorized, id, &why).await
    } else {
        Err(Error::conflict(
            "Nothing was changed. First tick the box to confirm that all studies of this subject stop.",
        ))
    };
    answer(&app, units, id, &authorized.caller, done, RefusedForm::Withdrawal(why.reason)).await
}

/// The form of a withdrawal.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Withdrawing {
    reason: String,
    /// `yes` if the box is ticked.
    confirmed: Option<String>,
}

async fn end(app: &AppState, authorized: &Authorized<Run>, id: SubjectId, why: &Withdrawal) -> Result<(), Error> {
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
#[derive(Debug, Deserialize)]
pub(super) struct Corrected {
    height_m: String,
    body_mass_kg: String,
    reason: String,
    before: i64,
}

/// `POST /subjects/{id}/correct`.
pub(super) async fn correct(
    authorized: Authorized<Run>,
    State(app): State<AppState>,
    units: Units,
    Id(id, _): Id<SubjectId, Run>,
    Form(form): Form<Corrected>,
) -> Result<Response, PageError> {
    let typed = Correcting {
        height_m: form.height_m.clone(),
        body_mass_kg: form.body_mass_kg.clone(),
        reason: form.reason.clone(),
        refused: true,
    };
    let done = set_right(&app, &authorized, id, form).await;
    answer(&app, units, id, &authorized.caller, done, RefusedForm::Correction(typed)).await
}

async fn set_right(app: &AppState, authorized: &Authorized<Run>, id: SubjectId, form: Corrected) -> Result<(), Error> {
    let (height_m, body_mass_kg) = body_of(&form.height_m, &form.body_mass_kg)?;
    let new = NewCorrection { height_m, body_mass_kg, reason: form.reason };
    let mut writer = app.write().await?;
    let newest = subjects::corrections(&mut writer, id).await?.last().map_or(0, |last| last.seq);
    if newest != form.before {
        return Err(Error::conflict("Height and mass were corrected after this form was loaded. Check them first."));
    }
    subject::correct(&mut writer, &authorized.caller.actor, id, &new).await?;
    Ok(commit(writer).await?)
}

/// Shows the subject again after a change, with the reason if it was refused.
async fn answer(
    app: &AppState,
    units: Units,
    id: SubjectId,
    caller: &Caller,
    done: Result<(), Error>,
    typed: RefusedForm,
) -> Result<Response, PageError> {
    match done {
        Ok(()) => Ok(Redirect::to(&format!("/subjects/{id}")).into_response()),
        Err(error @ (Error::Invalid(_) | Error::Conflict(_))) => {
            let shown = show(app, units, id, caller, Some(form_errors::in_words(&error)), typed).await?;
            Ok((Problem::from(&error).status(), shown).into_response())
        }
        Err(other) => Err(other.into()),
    }
}
