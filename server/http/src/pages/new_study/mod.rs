//! The form for a new study.

mod chosen_reference;
mod clone;
mod fields;
mod planning;
mod tuned_and_fixed_bounds;

use self::chosen_reference::ReferenceChoice;
use self::clone::cloned;
use self::fields::{DESCRIPTION, KEPT_LEARNER, LEARNERS, NEW_SUBJECT, NewStudyFields, SIMULATED_WALKS_EFFECTS};
use self::planning::{faults, make};
use self::tuned_and_fixed_bounds::SpaceEditor;
use crate::AppState;
use crate::accessible::{Named, accessible};
use crate::authorization::Authorized;
use crate::extractors::{Form, Params};
use crate::format;
use crate::page_error::{PageError, PageResult, page};
use crate::refused_fields::{FormCheck, RefusedFields, TypedForm};
use crate::units::Units;
use askama::Template;
use axum::Json;
use axum::extract::State;
use axum::http::StatusCode;
use axum::response::{IntoResponse, Redirect, Response};
use gait_optimizer::TunedBounds;
use gaitwright_service::access::Run;
use gaitwright_service::error::Error;
use gaitwright_service::studies::sample_study;
use gaitwright_store::devices::DeviceRow;
use gaitwright_store::reference_gaits::ReferenceGaitRow;
use gaitwright_store::studies::{self, SimulatedWalks, SimulatedWalksEffect, Study, StudyPlan};
use gaitwright_store::subjects::{self, SubjectRow};
use gaitwright_store::{
    Connection, StoreError, StudyId, SubjectId, commit, consents, devices, members, reference_gaits, trials,
};
use serde::{Deserialize, Serialize};

/// The choices of the form, and measured solve times.
struct FormChoices {
    subjects: Vec<SubjectRow>,
    devices: Vec<DeviceRow>,
    references: Vec<ReferenceGaitRow>,
    measured: [Option<trials::SolveTimes>; 2],
}

impl FormChoices {
    async fn read(db: &mut Connection) -> Result<Self, Error> {
        // The first device is the default: the built-in one.
        let built_in = gait_optimizer::Device::ampro3()?;
        let mut devices = devices::all(db).await?;
        devices.sort_by_key(|device| device.definition != built_in);
        Ok(Self {
            subjects: subjects::consenting(db).await?,
            devices,
            references: reference_gaits::all(db).await?,
            measured: [trials::measured(db, true).await?, trials::measured(db, false).await?],
        })
    }
}

#[derive(Template)]
#[template(path = "study_new.html")]
struct NewStudyPage {
    units: Units,
    offered: FormChoices,
    learners: &'static [(&'static str, &'static str, &'static str)],
    simulated_walks_effects: &'static [(SimulatedWalksEffect, &'static str, &'static str)],
    /// The defaults of simulated walks.
    walks: SimulatedWalks,
    fields: NewStudyFields,
    editor: SpaceEditor,
    /// Every refused field.
    refused: RefusedFields,
    /// The study that is cloned.
    cloned: Option<Study>,
    /// The chosen reference gait, as a part of the page; empty if none is known yet.
    reference: String,
    /// Why the chosen subject is not in the list; empty if it is.
    not_offered: String,
}

impl NewStudyPage {
    fn selected(&self, subject: &SubjectRow) -> bool {
        self.fields.subject == subject.id.to_string()
            || (self.fields.subject.is_empty() && subject.pseudonym == "paper-1")
    }

    /// The learner of a cloned study, if the form cannot show its settings.
    fn keeps_learner(&self) -> bool {
        self.cloned.is_some() && self.fields.learner == KEPT_LEARNER
    }

    /// The attributes of a field in the table of bounds, where a bound can be refused as a whole.
    fn invalid_part(&self, part: &str, bound: &str) -> &'static str {
        let of_part = self.refused.invalid(&format!("{part}_{bound}"));
        if of_part.is_empty() { self.refused.invalid(bound) } else { of_part }
    }

    /// Whether an entry of the table of bounds was refused, so that the table has to be shown.
    fn refuses_bound(&self) -> bool {
        let of_bound = |field: &str| TunedBounds::NAMES.iter().any(|bound| field.ends_with(bound));
        self.fields.relaxed || self.refused.iter().any(|refused| of_bound(&refused.field))
    }

    /// Whether a new subject is entered, or one of its fields was refused.
    fn describes(&self) -> bool {
        self.fields.subject == NEW_SUBJECT || DESCRIPTION.iter().any(|field| self.refused.has(field))
    }

    /// Whether an expert setting was changed or refused, so that they have to be shown.
    fn expert(&self) -> bool {
        let (typed, default) = (&self.fields, NewStudyFields::default());
        let fields = |fields: &NewStudyFields| {
            let NewStudyFields {
                learner,
                unchanged_limit,
                parallel_trials,
                seed,
                simulated_walks_effect,
                number_of_simulated_walks,
                gait_rmse_tolerance_rad,
                least_mean_strides,
                nearest_within_percent,
                initial_guesses,
                local_optimum,
                ..
            } = fields.clone();
            let walks =
                [simulated_walks_effect, number_of_simulated_walks, gait_rmse_tolerance_rad, least_mean_strides];
            let cold_starts = [nearest_within_percent, initial_guesses, local_optimum];
            ([learner, unchanged_limit, parallel_trials, seed], cold_starts, walks)
        };
        let ticks = [&typed.repeat_results, &typed.warm_start_from_root, &typed.use_atlas];
        fields(typed) != fields(&default) || ticks.into_iter().any(Option::is_some)
    }

    /// Measured solve times, with and without muscles.
    fn measured(&self) -> String {
        let words = |measured: &Option<trials::SolveTimes>, variant: &str| {
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

/// Values with which the form is filled in.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Preset {
    /// The subject.
    #[serde(default)]
    subject: Option<SubjectId>,
    /// A study to clone.
    #[serde(default)]
    like: Option<Named<StudyId>>,
    /// Bounds to relax in the clone, as `a5=0.03,a7=20`.
    #[serde(default)]
    relax: String,
    /// The local optimum with which the study begins.
    #[serde(default)]
    local_optimum: Option<u32>,
}

/// `GET /studies/new`.
pub(super) async fn get(
    authorized: Authorized<Run>,
    State(app): State<AppState>,
    units: Units,
    Params(preset): Params<Preset>,
) -> PageResult {
    let mut reader = app.read().await?;
    let mut fields = match accessible(&mut reader, authorized.caller.reach(), preset.like).await? {
        Some(id) => {
            consents::may_be_shown(&mut reader, id).await?;
            let study = studies::get(&mut reader, id).await?;
            NewStudyFields::of_clone(&study, members::is_restricted(&mut reader, id).await?)
        }
        None => NewStudyFields::default(),
    };
    if let Some(subject) = preset.subject {
        fields.subject = subject.to_string();
    }
    if let Some(number) = preset.local_optimum {
        fields.local_optimum = number.to_string();
        fields.nearest_within_percent.clear();
    }
    if !preset.relax.is_empty() {
        fields.relax(&preset.relax)?;
    }
    drop(reader);
    show(&app, units, &authorized, fields, RefusedFields::default(), None).await
}

async fn show(
    app: &AppState,
    units: Units,
    authorized: &Authorized<Run>,
    fields: NewStudyFields,
    refused: RefusedFields,
    plan: Option<StudyPlan>,
) -> PageResult {
    let mut reader = app.read().await?;
    let offered = FormChoices::read(&mut reader).await?;
    let cloned = cloned(&mut reader, authorized.caller.reach(), &fields).await?;
    let reference = match plan {
        Some(plan) => ReferenceChoice::read(&mut reader, &plan).await?.shown()?,
        None => String::new(),
    };
    let not_offered = not_offered(&mut reader, &offered.subjects, &fields.subject).await?;
    drop(reader);
    let editor = SpaceEditor::typed(&fields.space)?;
    let (simulated_walks_effects, walks) = (&SIMULATED_WALKS_EFFECTS, SimulatedWalks::default());
    page(&NewStudyPage {
        units,
        offered,
        learners: &LEARNERS,
        simulated_walks_effects,
        walks,
        fields,
        editor,
        refused,
        cloned,
        reference,
        not_offered,
    })
}

/// Why the chosen subject cannot have a new study. Empty if it can, and if none is chosen.
async fn not_offered(db: &mut Connection, offered: &[SubjectRow], chosen: &str) -> Result<String, Error> {
    let Ok(id) = chosen.parse::<SubjectId>() else { return Ok(String::new()) };
    if offered.iter().any(|subject| subject.id == id) {
        return Ok(String::new());
    }
    Ok(match subjects::get(db, id).await {
        Ok(subject) => {
            format!(
                "Subject {} withdrew consent and cannot have new studies. Choose another subject.",
                subject.pseudonym
            )
        }
        Err(StoreError::Missing { .. }) => "The chosen subject does not exist. Choose another one.".to_owned(),
        Err(other) => return Err(other.into()),
    })
}

/// `POST /studies/new`.
pub(super) async fn post(
    authorized: Authorized<Run>,
    State(app): State<AppState>,
    units: Units,
    Form(fields): Form<NewStudyFields>,
) -> Result<Response, PageError> {
    let editor = SpaceEditor::typed(&fields.space)?;
    let mut writer = app.write().await?;
    let first = match make(&mut writer, &authorized.caller, &fields, &editor).await {
        Ok(study) => {
            commit(writer).await?;
            app.scheduler.changed();
            return Ok(Redirect::to(&format!("/studies/{}", study.id)).into_response());
        }
        Err(error) => error,
    };
    drop(writer);
    let (mut refused, plan) = faults(&mut *app.read().await?, authorized.caller.reach(), &fields).await?;
    if refused.is_empty() {
        let mut check = FormCheck::new(&fields);
        check.refuse(first)?;
        refused = check.into_refused();
    }
    let form = show(&app, units, &authorized, fields, refused, plan).await?;
    Ok((StatusCode::UNPROCESSABLE_ENTITY, form).into_response())
}

/// `POST /studies/sample`: creates and starts a sample study, to see what a study looks like.
pub(super) async fn sample(authorized: Authorized<Run>, State(app): State<AppState>) -> Result<Response, PageError> {
    let mut writer = app.write().await?;
    let study = sample_study::create(&mut writer, &authorized.caller).await?;
    commit(writer).await?;
    app.scheduler.changed();
    Ok(Redirect::to(&format!("/studies/{}", study.id)).into_response())
}

/// The check of a form that is still being filled in.
#[derive(Debug, Serialize)]
pub(super) struct CheckedForm {
    /// The fields that would be refused, with the reasons.
    faults: Vec<Fault>,
    /// The size and duration of the study; empty if a field would be refused.
    text: String,
    /// The chosen reference gait, as a part of the page.
    #[serde(skip_serializing_if = "Option::is_none")]
    reference: Option<String>,
}

/// A field that would be refused.
#[derive(Debug, Serialize)]
struct Fault {
    field: String,
    text: String,
}

/// `POST /studies/new/check`: checks the form as `POST /studies/new` would, and writes nothing.
pub(super) async fn check(
    authorized: Authorized<Run>,
    State(app): State<AppState>,
    Form(fields): Form<NewStudyFields>,
) -> Result<Json<CheckedForm>, PageError> {
    let mut reader = app.read().await?;
    let (found, plan) = faults(&mut reader, authorized.caller.reach(), &fields).await?;
    let text = match &plan {
        Some(plan) if found.is_empty() => outlook(&mut reader, plan).await?,
        _ => String::new(),
    };
    let choice = match &plan {
        Some(plan) => Some(ReferenceChoice::read(&mut reader, plan).await?),
        None => None,
    };
    drop(reader);
    let faults = found.iter().map(|fault| Fault { field: fault.field.clone(), text: fault.message.clone() }).collect();
    Ok(Json(CheckedForm { faults, text, reference: choice.map(|choice| choice.shown()).transpose()? }))
}

/// The size of the study and its expected duration.
async fn outlook(db: &mut Connection, plan: &StudyPlan) -> Result<String, Error> {
    let combinations = format::count(plan.search_space.len());
    let size = format!("The study tries {} of {combinations} combinations of bounds", plan.number_of_trials);
    let people = format::also_waits_for(plan.answer_source);
    // Parallel trials share the machine, so they are not counted as faster.
    let took = |measured: trials::SolveTimes| measured.median_seconds * f64::from(plan.number_of_trials);
    Ok(match trials::measured(db, plan.muscles).await?.map(took) {
        Some(seconds) => format!("{size} and takes about {}{people}.", format::duration(seconds)),
        None => format!(
            "{size}. No solve with{} muscles has been timed here yet. The first trial takes up to a minute, and later ones \
             take a few seconds{people}.",
            if plan.muscles { "" } else { "out" }
        ),
    })
}
