//! The form for a new study.

mod chosen_reference;
mod space_editor;

use self::chosen_reference::Choice;
use self::space_editor::SpaceEditor;
use crate::AppState;
use crate::authorization::Authorized;
use crate::extractors::{Form, Params};
use crate::form_errors;
use crate::format;
use crate::page_error::{Page, PageError, page};
use askama::Template;
use axum::Json;
use axum::extract::State;
use axum::http::StatusCode;
use axum::response::{IntoResponse, Redirect, Response};
use gait_learner::{LearnerSettings, Method};
use gait_optimizer::{BasinChoice, SolveOptions, TunedBounds};
use gaitwright_service::access::{Caller, Run};
use gaitwright_service::error::{Error, FieldError};
use gaitwright_service::studies::study_plan::{self, NewStudy};
use gaitwright_service::studies::subject::{self, NewSubject};
use gaitwright_store::devices::Device;
use gaitwright_store::reference_gaits::ReferenceGait;
use gaitwright_store::studies::{FeedbackMode, Study, StudyPlan};
use gaitwright_store::subjects::{self, Subject};
use gaitwright_store::{Connection, SubjectId, Writer, commit, devices, reference_gaits, trials};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::str::FromStr;

/// The fields as typed, to show a refused form again.
#[derive(Debug, Clone, Deserialize)]
pub(super) struct Fields {
    #[serde(default)]
    name: String,
    subject: String,
    /// Present when ticked.
    #[serde(default)]
    restricted: Option<String>,
    #[serde(default)]
    pseudonym: String,
    #[serde(default)]
    height_m: String,
    #[serde(default)]
    body_mass_kg: String,
    #[serde(default)]
    device: String,
    #[serde(default)]
    reference_gait: String,
    muscles: String,
    feedback_mode: String,
    #[serde(default = "linecospar")]
    learner: String,
    trial_budget: String,
    #[serde(default)]
    unchanged_limit: String,
    parallel_trials: String,
    seed: String,
    /// Present when ticked.
    #[serde(default)]
    repeat_results: Option<String>,
    #[serde(default)]
    basin_within_percent: String,
    /// The entries of the search space, which the editor reads.
    #[serde(flatten)]
    space: BTreeMap<String, String>,
}

fn linecospar() -> String {
    LEARNERS[0].0.to_owned()
}

impl Default for Fields {
    fn default() -> Self {
        let text = str::to_owned;
        Self {
            name: String::new(),
            subject: String::new(),
            restricted: None,
            pseudonym: String::new(),
            height_m: String::new(),
            body_mass_kg: String::new(),
            device: String::new(),
            reference_gait: String::new(),
            muscles: text("on"),
            feedback_mode: text("automatic"),
            learner: linecospar(),
            trial_budget: text("15"),
            unchanged_limit: String::new(),
            parallel_trials: text("1"),
            seed: text("1"),
            repeat_results: None,
            basin_within_percent: String::new(),
            space: BTreeMap::new(),
        }
    }
}

/// The learners to choose from: value, label, and when to choose it. The benchmarks of the learner support this advice.
const LEARNERS: [(&str, &str, &str); 3] = [
    ("linecospar", "LineCoSpar", "the method of the paper; for answers by people, some of which may be wrong"),
    ("eubo", "EUBO", "for answers by Gait RMSE; after 10 comparisons, closer to the best gait than LineCoSpar"),
    (
        "eubo_uncertain",
        "EUBO for uncertain answers",
        "for answers by people who are often unsure, with 50 answers or more",
    ),
];

fn learner(name: &str) -> Option<LearnerSettings> {
    match name {
        "linecospar" => Some(LearnerSettings::of(Method::LineCoSpar)),
        "eubo" => Some(LearnerSettings::of(Method::Eubo)),
        "eubo_uncertain" => Some(LearnerSettings::for_uncertain_answers()),
        _ => None,
    }
}

/// The option of the subject field that stands for a new subject.
const NEW_SUBJECT: &str = "new";

/// The fields that describe a new subject.
const DESCRIPTION: [&str; 3] = ["pseudonym", "height_m", "body_mass_kg"];

/// The label of a field.
fn label(field: &str) -> String {
    let named = match field {
        "name" => "Name",
        "subject" => "Subject",
        "pseudonym" => "Pseudonym",
        "height_m" => "Height, m",
        "body_mass_kg" => "Body mass, kg",
        "device" | "device_id" => "Device",
        "reference_gait" | "reference_gait_id" => "Reference gait",
        "muscles" => "Variant",
        "feedback_mode" => "Comparisons are answered by",
        "trial_budget" => "Trials",
        "learner" => "Learner",
        "unchanged_limit" => "Stop early after",
        "parallel_trials" => "Parallel trials",
        "seed" => "Seed",
        "basin_within_percent" => "Objective tolerance, %",
        other => other,
    };
    match field.split_once('_') {
        Some(("tuned", bound)) => format!("{bound} is tuned"),
        Some(("values", bound)) => format!("Values of {bound}"),
        Some(("lengthscale", bound)) => format!("Lengthscale of {bound}"),
        Some(("fixed", bound)) => format!("Fixed value of {bound}"),
        _ => named.to_owned(),
    }
}

/// The choices of the form, and measured solve times.
struct Offered {
    subjects: Vec<Subject>,
    devices: Vec<Device>,
    references: Vec<ReferenceGait>,
    measured: [Option<trials::Measured>; 2],
}

impl Offered {
    async fn read(db: &mut Connection) -> Result<Self, Error> {
        // The first device is the default: the built-in one.
        let built_in = gait_optimizer::Device::ampro3()?;
        let mut devices = devices::all(db).await?;
        devices.sort_by_key(|device| device.definition != built_in);
        Ok(Self {
            subjects: subjects::all(db).await?,
            devices,
            references: reference_gaits::all(db).await?,
            measured: [trials::measured(db, true).await?, trials::measured(db, false).await?],
        })
    }
}

#[derive(Template)]
#[template(path = "study_new.html")]
struct NewStudyPage {
    offered: Offered,
    learners: &'static [(&'static str, &'static str, &'static str)],
    fields: Fields,
    editor: SpaceEditor,
    refused: Option<FieldError>,
}

impl NewStudyPage {
    fn selected(&self, subject: &Subject) -> bool {
        self.fields.subject == subject.id.to_string()
            || (self.fields.subject.is_empty() && subject.pseudonym == "paper-1")
    }

    fn refuses(&self, field: &str) -> bool {
        self.refused.as_ref().is_some_and(|refused| refused.field == field)
    }

    /// The attributes that mark a refused field, point to the reason and set the focus.
    fn invalid(&self, field: &str) -> &'static str {
        if self.refuses(field) { " aria-invalid=\"true\" aria-describedby=\"refused\" autofocus" } else { "" }
    }

    /// The same for the table of bounds, where a bound can be refused as a whole.
    fn invalid_part(&self, part: &str, bound: &str) -> &'static str {
        let of_part = self.invalid(&format!("{part}_{bound}"));
        if of_part.is_empty() { self.invalid(bound) } else { of_part }
    }

    /// Whether an entry of the table of bounds was refused, so that the table has to be shown.
    fn refuses_bound(&self) -> bool {
        let of_bound = |field: &str| TunedBounds::NAMES.iter().any(|bound| field.ends_with(bound));
        self.refused.as_ref().is_some_and(|refused| of_bound(&refused.field))
    }

    /// Whether a new subject is entered, or one of its fields was refused.
    fn describes(&self) -> bool {
        self.fields.subject == NEW_SUBJECT || DESCRIPTION.iter().any(|field| self.refuses(field))
    }

    /// Whether an expert setting was changed or refused, so that they have to be shown.
    fn expert(&self) -> bool {
        let (typed, default) = (&self.fields, Fields::default());
        let fields = |fields: &Fields| {
            let Fields { learner, unchanged_limit, parallel_trials, seed, basin_within_percent, .. } = fields.clone();
            [learner, unchanged_limit, parallel_trials, seed, basin_within_percent]
        };
        fields(typed) != fields(&default) || typed.repeat_results.is_some()
    }

    /// Measured solve times, with and without muscles.
    fn measured(&self) -> String {
        let words = |measured: &Option<trials::Measured>, variant: &str| {
            measured.as_ref().map(|m| format!("{:.1} s {variant} muscles (median of {})", m.median_seconds, m.solves))
        };
        let [with, without] = &self.offered.measured;
        let both: Vec<String> = [words(with, "with"), words(without, "without")].into_iter().flatten().collect();
        if both.is_empty() {
            return "No solve times measured yet; expect a few seconds to a minute per solve.".to_owned();
        }
        format!("Solve time here: {}.", both.join(", "))
    }
}

/// The subject to preselect.
#[derive(Debug, Deserialize)]
pub(super) struct For {
    #[serde(default)]
    subject: Option<SubjectId>,
}

/// `GET /studies/new`.
pub(super) async fn get(_: Authorized<Run>, State(app): State<AppState>, Params(For { subject }): Params<For>) -> Page {
    let offered = Offered::read(&mut *app.read().await?).await?;
    let subject = subject.map_or_else(String::new, |id| id.to_string());
    let fields = Fields { subject, ..Fields::default() };
    let editor = SpaceEditor::typed(&fields.space)?;
    page(&NewStudyPage { offered, learners: &LEARNERS, fields, editor, refused: None })
}

/// `POST /studies/new`.
pub(super) async fn post(
    authorized: Authorized<Run>,
    State(app): State<AppState>,
    Form(fields): Form<Fields>,
) -> Result<Response, PageError> {
    let editor = SpaceEditor::typed(&fields.space)?;
    let mut writer = app.write().await?;
    let refused = match make(&mut writer, &authorized.caller, &fields, &editor).await {
        Ok(study) => {
            commit(writer).await?;
            app.scheduler.changed();
            return Ok(Redirect::to(&format!("/studies/{}", study.id)).into_response());
        }
        Err(error) => as_refusal(error, &fields)?,
    };
    drop(writer);
    let offered = Offered::read(&mut *app.read().await?).await?;
    let form = page(&NewStudyPage { offered, learners: &LEARNERS, fields, editor, refused: Some(refused) })?;
    Ok((StatusCode::UNPROCESSABLE_ENTITY, form).into_response())
}

/// The check of a form that is still being filled in.
#[derive(Debug, Serialize)]
pub(super) struct Checked {
    /// The field that would be refused, if any.
    #[serde(skip_serializing_if = "Option::is_none")]
    field: Option<String>,
    /// Why it would be refused, or the size and duration of the study.
    text: String,
    /// The chosen reference gait, as a part of the page.
    #[serde(skip_serializing_if = "Option::is_none")]
    reference: Option<String>,
}

/// `POST /studies/new/check`: checks the form as `POST /studies/new` would, and writes nothing.
pub(super) async fn check(
    _: Authorized<Run>,
    State(app): State<AppState>,
    Form(fields): Form<Fields>,
) -> Result<Json<Checked>, PageError> {
    let editor = SpaceEditor::typed(&fields.space)?;
    let mut reader = app.read().await?;
    let planned = match planned(&mut reader, &fields, &editor).await {
        Ok(plan) => Ok((outlook(&mut reader, &plan).await?, Choice::read(&mut reader, &plan).await?)),
        Err(error) => Err(as_refusal(error, &fields)?),
    };
    drop(reader);
    let checked = match planned {
        Ok((text, choice)) => Checked { field: None, text, reference: Some(choice.shown()?) },
        Err(refused) => Checked { field: Some(refused.field), text: refused.message, reference: None },
    };
    Ok(Json(checked))
}

/// Converts an error about a field into a refusal; other errors pass.
fn as_refusal(error: Error, fields: &Fields) -> Result<FieldError, Error> {
    match error {
        Error::Invalid(refused) => {
            // A bound has one row in the table, whatever part of the study refuses it.
            let last = refused.field.rsplit('.').next().filter(|last| TunedBounds::NAMES.contains(last));
            let field = last.unwrap_or(&refused.field).to_owned();
            let message = form_errors::of_field(&label(&field), &refused);
            Ok(FieldError { field, message, ..*refused })
        }
        Error::Conflict(message) => Ok(FieldError {
            field: "pseudonym".to_owned(),
            value: Some(fields.pseudonym.clone().into()),
            allowed: Some("another pseudonym".to_owned()),
            message,
        }),
        other => Err(other),
    }
}

/// The size of the study and its expected duration.
async fn outlook(db: &mut Connection, plan: &StudyPlan) -> Result<String, Error> {
    let combinations = format::count(plan.search_space.len());
    let size = format!("The study tries {} of {combinations} combinations of bounds", plan.trial_budget);
    let people = format::besides_solves(plan.feedback_mode);
    // Parallel trials share the machine, so they are not counted as faster.
    let took = |measured: trials::Measured| measured.median_seconds * f64::from(plan.trial_budget);
    Ok(match trials::measured(db, plan.muscles).await?.map(took) {
        Some(seconds) => format!("{size} and takes about {}{people}.", format::duration(seconds)),
        None => format!(
            "{size}. No solve times with{} muscles measured yet: the first trial takes up to a minute, later ones a few \
             seconds{people}.",
            if plan.muscles { "" } else { "out" }
        ),
    })
}

/// Creates the study, and the subject if a new one is entered.
async fn make(writer: &mut Writer, caller: &Caller, fields: &Fields, editor: &SpaceEditor) -> Result<Study, Error> {
    let subject = match subject_of(fields)? {
        Chosen::New(new) => subject::add(writer, &caller.actor, &new).await?.id,
        Chosen::Known(id) => id,
    };
    study_plan::create_by(writer, caller, study_of(fields, editor, subject)?).await
}

/// The study that [`make`] would create.
async fn planned(db: &mut Connection, fields: &Fields, editor: &SpaceEditor) -> Result<StudyPlan, Error> {
    match subject_of(fields)? {
        Chosen::New(new) => study_plan::checked_for_new(db, &new, study_of(fields, editor, SubjectId::fresh())?).await,
        Chosen::Known(id) => study_plan::checked(db, study_of(fields, editor, id)?).await,
    }
}

/// The subject of the study.
enum Chosen {
    New(NewSubject),
    Known(SubjectId),
}

fn subject_of(fields: &Fields) -> Result<Chosen, Error> {
    if fields.subject != NEW_SUBJECT {
        nothing_described(fields)?;
        return Ok(Chosen::Known(number("subject", &fields.subject, "a subject from the list")?));
    }
    let height = "a number in metres, such as 1.75";
    let mass = "a number in kilograms, such as 65.7";
    Ok(Chosen::New(NewSubject {
        pseudonym: fields.pseudonym.clone(),
        height_m: number("height_m", &fields.height_m, height)?,
        body_mass_kg: number("body_mass_kg", &fields.body_mass_kg, mass)?,
        notes: String::new(),
    }))
}

fn study_of(fields: &Fields, editor: &SpaceEditor, subject: SubjectId) -> Result<NewStudy, Error> {
    let (search_space, base_bounds) = editor.read()?;
    let learners = format!("one of {}", LEARNERS.map(|(name, ..)| name).join(", "));
    Ok(NewStudy {
        name: Some(fields.name.trim().to_owned()).filter(|name| !name.is_empty()),
        device_id: optional("device", &fields.device, "a device from the list")?,
        reference_gait_id: optional("reference_gait", &fields.reference_gait, "a reference gait from the list")?,
        muscles: match fields.muscles.as_str() {
            "on" => true,
            "off" => false,
            other => return Err(Error::invalid("muscles", other, "on or off")),
        },
        search_space: Some(search_space.into()),
        base_bounds,
        feedback_mode: FeedbackMode::from_str(&fields.feedback_mode)
            .map_err(|_| Error::invalid("feedback_mode", fields.feedback_mode.as_str(), "automatic, human or mixed"))?,
        solve_options: SolveOptions { basin_choice: basin_choice(fields)?, ..SolveOptions::default() },
        learner: learner(&fields.learner)
            .ok_or_else(|| Error::invalid("learner", fields.learner.as_str(), &learners))?,
        trial_budget: number("trial_budget", &fields.trial_budget, "1 to 10000")?,
        unchanged_limit: optional("unchanged_limit", &fields.unchanged_limit, "1 to 10000, or empty")?,
        parallel_trials: number("parallel_trials", &fields.parallel_trials, "1 to 64")?,
        seed: number("seed", &fields.seed, &format!("0 to {}", study_plan::LARGEST_SEED))?,
        repeat_results: Some(fields.repeat_results.is_some()),
        restricted: fields.restricted.is_some(),
        ..NewStudy::of(subject)
    })
}

/// `None` if only the lowest objective counts.
fn basin_choice(fields: &Fields) -> Result<BasinChoice, Error> {
    let field = "basin_within_percent";
    let allowed = "0 to 100, or empty";
    let Some(within_percent) = optional(field, &fields.basin_within_percent, allowed)? else {
        return Ok(BasinChoice::LowestObjective);
    };
    let chosen = BasinChoice::NearestToReference { within_percent };
    chosen.validate().map_err(|_| Error::invalid(field, fields.basin_within_percent.as_str(), allowed))?;
    Ok(chosen)
}

/// Refuses a new subject that is entered but not chosen, instead of ignoring it.
fn nothing_described(fields: &Fields) -> Result<(), Error> {
    for (field, text) in DESCRIPTION.into_iter().zip([&fields.pseudonym, &fields.height_m, &fields.body_mass_kg]) {
        if !text.trim().is_empty() {
            let allowed = "empty, because a subject from the list is chosen. To add this subject, choose \u{201c}A new subject, entered below\u{201d}";
            return Err(Error::invalid(field, text.as_str(), allowed));
        }
    }
    Ok(())
}

fn number<T: FromStr>(field: &str, text: &str, allowed: &str) -> Result<T, Error> {
    text.trim().parse().map_err(|_| Error::invalid(field, text, allowed))
}

/// The same for optional fields.
fn optional<T: FromStr>(field: &str, text: &str, allowed: &str) -> Result<Option<T>, Error> {
    if text.trim().is_empty() { Ok(None) } else { number(field, text, allowed).map(Some) }
}
