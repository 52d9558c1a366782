//! The form for a new study.

mod chosen_reference;
mod space_editor;

use self::chosen_reference::Choice;
use self::space_editor::SpaceEditor;
use super::error::{Page, PageError, page};
use super::format;
use crate::AppState;
use crate::extract::Form;
use crate::may::May;
use askama::Template;
use axum::Json;
use axum::extract::State;
use axum::http::StatusCode;
use axum::response::{IntoResponse, Redirect, Response};
use gait_learner::{LearnerSettings, Method};
use gait_optimizer::{BasinChoice, SolveOptions, TunedBounds};
use gaitwright_service::access::{Caller, Run};
use gaitwright_service::error::{Error, FieldError};
use gaitwright_service::studies::person::{self, NewSubject};
use gaitwright_service::studies::plan::{self, NewStudy};
use gaitwright_store::devices::Device;
use gaitwright_store::reference_gaits::ReferenceGait;
use gaitwright_store::studies::{FeedbackMode, Study, StudyPlan};
use gaitwright_store::subjects::{self, Subject};
use gaitwright_store::{Connection, SubjectId, Writer, commit, devices, reference_gaits, trials};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::str::FromStr;

/// The fields as typed, so that a refused form comes back as it was.
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
    #[serde(default)]
    basin_within_percent: String,
    /// The search space: what the editor knows, and nothing else.
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
            basin_within_percent: String::new(),
            space: BTreeMap::new(),
        }
    }
}

/// The learners to choose from: name, name for people, when to take it. The measurements behind this are in the learner's
/// README.
const LEARNERS: [(&str, &str, &str); 3] = [
    ("linecospar", "LineCoSpar", "the paper's method: people answer, and an answer may now and then be wrong"),
    ("eubo", "EUBO", "Gait RMSE answers: from 10 comparisons on it is nearer to the best than LineCoSpar"),
    (
        "eubo_uncertain",
        "EUBO for uncertain answers",
        "people answer, are often unsure, and will answer 50 times or more",
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

/// The subject option that means: the person described below it.
const NEW_SUBJECT: &str = "new";

/// The fields that describe a new subject.
const DESCRIPTION: [&str; 3] = ["pseudonym", "height_m", "body_mass_kg"];

/// What people read beside a field.
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
        "unchanged_limit" => "Stop early",
        "parallel_trials" => "At the same time",
        "seed" => "Seed",
        "basin_within_percent" => "Of several gaits, the nearest to the reference within, %",
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

/// What there is to choose from, and how long solves took.
struct Offered {
    subjects: Vec<Subject>,
    devices: Vec<Device>,
    references: Vec<ReferenceGait>,
    measured: [Option<trials::Measured>; 2],
}

impl Offered {
    async fn read(db: &mut Connection) -> Result<Self, Error> {
        // The first one is chosen where nobody chooses: the built-in one.
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

    /// Attributes of a field: of the one that was refused, that it was and where it is said why, and the focus.
    fn invalid(&self, field: &str) -> &'static str {
        if self.refuses(field) { " aria-invalid=\"true\" aria-describedby=\"refused\" autofocus" } else { "" }
    }

    /// The same in the table of bounds, where a bound may be refused as a whole.
    fn invalid_part(&self, part: &str, bound: &str) -> &'static str {
        let of_part = self.invalid(&format!("{part}_{bound}"));
        if of_part.is_empty() { self.invalid(bound) } else { of_part }
    }

    /// Whether something in the table of bounds was refused: it is shown then.
    fn refuses_bound(&self) -> bool {
        let of_bound = |field: &str| TunedBounds::NAMES.iter().any(|bound| field.ends_with(bound));
        self.refused.as_ref().is_some_and(|refused| of_bound(&refused.field))
    }

    /// Whether a new subject is described, or something in that description was refused.
    fn describes(&self) -> bool {
        self.fields.subject == NEW_SUBJECT || DESCRIPTION.iter().any(|field| self.refuses(field))
    }

    /// Whether one of the fields for experts was changed or refused: they are shown then.
    fn expert(&self) -> bool {
        let (typed, default) = (&self.fields, Fields::default());
        let fields = |fields: &Fields| {
            let Fields { learner, unchanged_limit, parallel_trials, seed, basin_within_percent, .. } = fields.clone();
            [learner, unchanged_limit, parallel_trials, seed, basin_within_percent]
        };
        fields(typed) != fields(&default)
    }

    /// How long solves took, in words; the first with muscles, the second without.
    fn measured(&self) -> String {
        let words = |measured: &Option<trials::Measured>, variant: &str| {
            measured.as_ref().map(|m| format!("{:.1} s {variant} muscles (median of {})", m.median_seconds, m.solves))
        };
        let [with, without] = &self.offered.measured;
        let both: Vec<String> = [words(with, "with"), words(without, "without")].into_iter().flatten().collect();
        if both.is_empty() {
            return "No solve was measured yet: seconds to a minute each.".to_owned();
        }
        format!("What a solve took here: {}.", both.join(", "))
    }
}

/// `GET /studies/new`.
pub(super) async fn get(_: May<Run>, State(app): State<AppState>) -> Page {
    let offered = Offered::read(&mut *app.read().await?).await?;
    let fields = Fields::default();
    let editor = SpaceEditor::typed(&fields.space)?;
    page(&NewStudyPage { offered, learners: &LEARNERS, fields, editor, refused: None })
}

/// `POST /studies/new`.
pub(super) async fn post(
    may: May<Run>,
    State(app): State<AppState>,
    Form(fields): Form<Fields>,
) -> Result<Response, PageError> {
    let editor = SpaceEditor::typed(&fields.space)?;
    let mut writer = app.write().await?;
    let refused = match make(&mut writer, &may.caller, &fields, &editor).await {
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

/// What is thought of a form that is still being filled in.
#[derive(Debug, Serialize)]
pub(super) struct Checked {
    /// The field that would be refused.
    #[serde(skip_serializing_if = "Option::is_none")]
    field: Option<String>,
    /// Why, or what the study would be.
    text: String,
    /// The reference gait that is chosen, as a part of the page.
    #[serde(skip_serializing_if = "Option::is_none")]
    reference: Option<String>,
}

/// `POST /studies/new/check`: checks the form as it would be checked when it is sent, and writes nothing.
pub(super) async fn check(
    _: May<Run>,
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

/// A refusal that belongs to a field; any other error is passed on.
fn as_refusal(error: Error, fields: &Fields) -> Result<FieldError, Error> {
    match error {
        Error::Invalid(field) => {
            let said = field.message.strip_prefix(&field.field).map(|said| format!("{}{said}", label(&field.field)));
            Ok(FieldError { message: said.unwrap_or(field.message), ..*field })
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

/// How large the study is, and how long it will take.
async fn outlook(db: &mut Connection, plan: &StudyPlan) -> Result<String, Error> {
    let combinations = format::count(plan.search_space.len());
    let size = format!("{} of {combinations} combinations of bounds will be tried", plan.trial_budget);
    let people = format::besides_solves(plan.feedback_mode);
    // Trials that run at the same time share the machine: no gain is promised.
    let took = |measured: trials::Measured| measured.median_seconds * f64::from(plan.trial_budget);
    Ok(match trials::measured(db, plan.muscles).await?.map(took) {
        Some(seconds) => format!("{size}, in about {}{people}.", format::duration(seconds)),
        None => format!(
            "{size}. Nothing was measured here yet: the first takes up to a minute, later ones seconds{people}."
        ),
    })
}

/// Makes the study, and the subject where a new one is described.
async fn make(writer: &mut Writer, caller: &Caller, fields: &Fields, editor: &SpaceEditor) -> Result<Study, Error> {
    let subject = match subject_of(fields)? {
        Chosen::New(new) => person::add(writer, &caller.actor, &new).await?.id,
        Chosen::Known(id) => id,
    };
    plan::create_by(writer, caller, study_of(fields, editor, subject)?).await
}

/// What [`make`] would make.
async fn planned(db: &mut Connection, fields: &Fields, editor: &SpaceEditor) -> Result<StudyPlan, Error> {
    match subject_of(fields)? {
        Chosen::New(new) => plan::checked_for_new(db, &new, study_of(fields, editor, SubjectId::fresh())?).await,
        Chosen::Known(id) => plan::checked(db, study_of(fields, editor, id)?).await,
    }
}

/// Whom the study is of.
enum Chosen {
    New(NewSubject),
    Known(SubjectId),
}

fn subject_of(fields: &Fields) -> Result<Chosen, Error> {
    if fields.subject != NEW_SUBJECT {
        nothing_described(fields)?;
        return Ok(Chosen::Known(number("subject", &fields.subject, "a subject of the list")?));
    }
    let height = "a number of metres with a decimal point, as in 1.75";
    let mass = "a number of kilograms with a decimal point, as in 65.7";
    Ok(Chosen::New(NewSubject {
        pseudonym: fields.pseudonym.clone(),
        height_m: number("height_m", &fields.height_m, height)?,
        body_mass_kg: number("body_mass_kg", &fields.body_mass_kg, mass)?,
        notes: String::new(),
    }))
}

fn study_of(fields: &Fields, editor: &SpaceEditor, subject: SubjectId) -> Result<NewStudy, Error> {
    let (search_space, base_bounds) = editor.read()?;
    let learners = LEARNERS.map(|(name, ..)| name).join(", ");
    Ok(NewStudy {
        name: Some(fields.name.clone()),
        device_id: optional("device", &fields.device, "a device of the list")?,
        reference_gait_id: optional("reference_gait", &fields.reference_gait, "a reference gait of the list")?,
        muscles: match fields.muscles.as_str() {
            "on" => true,
            "off" => false,
            other => return Err(Error::invalid("muscles", other, "on, off")),
        },
        search_space: Some(search_space),
        base_bounds,
        feedback_mode: FeedbackMode::from_str(&fields.feedback_mode)
            .map_err(|_| Error::invalid("feedback_mode", fields.feedback_mode.as_str(), "automatic, human, mixed"))?,
        solve_options: SolveOptions { basin_choice: basin_choice(fields)?, ..SolveOptions::default() },
        learner: learner(&fields.learner)
            .ok_or_else(|| Error::invalid("learner", fields.learner.as_str(), &learners))?,
        trial_budget: number("trial_budget", &fields.trial_budget, "1 to 10000")?,
        unchanged_limit: optional("unchanged_limit", &fields.unchanged_limit, "1 to 10000, or nothing")?,
        parallel_trials: number("parallel_trials", &fields.parallel_trials, "1 to 64")?,
        seed: number("seed", &fields.seed, &format!("0 to {}", plan::LARGEST_SEED))?,
        restricted: fields.restricted.is_some(),
        ..NewStudy::of(subject)
    })
}

/// Nothing: the lowest objective counts alone.
fn basin_choice(fields: &Fields) -> Result<BasinChoice, Error> {
    let field = "basin_within_percent";
    let allowed = "0 to 100, or nothing";
    let Some(within_percent) = optional(field, &fields.basin_within_percent, allowed)? else {
        return Ok(BasinChoice::LowestObjective);
    };
    let chosen = BasinChoice::NearestToReference { within_percent };
    chosen.validate().map_err(|_| Error::invalid(field, fields.basin_within_percent.as_str(), allowed))?;
    Ok(chosen)
}

/// A person who is described but not chosen would be left out without a word.
fn nothing_described(fields: &Fields) -> Result<(), Error> {
    for (field, text) in DESCRIPTION.into_iter().zip([&fields.pseudonym, &fields.height_m, &fields.body_mass_kg]) {
        if !text.trim().is_empty() {
            let allowed = "nothing, as a subject of the list is chosen; or choose \"A new subject\"";
            return Err(Error::invalid(field, text.as_str(), allowed));
        }
    }
    Ok(())
}

fn number<T: FromStr>(field: &str, text: &str, allowed: &str) -> Result<T, Error> {
    text.trim().parse().map_err(|_| Error::invalid(field, text, allowed))
}

/// The same for what may be left empty.
fn optional<T: FromStr>(field: &str, text: &str, allowed: &str) -> Result<Option<T>, Error> {
    if text.trim().is_empty() { Ok(None) } else { number(field, text, allowed).map(Some) }
}
