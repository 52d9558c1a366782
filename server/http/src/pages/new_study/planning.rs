//! The study that the form describes: checked, planned and created.

use super::clone::cloned;
use super::fields::{DESCRIPTION, KEPT_LEARNER, LEARNERS, NEW_SUBJECT, NewStudyFields, learner};
use super::tuned_and_fixed_bounds::SpaceEditor;
use crate::refused_fields::{FormCheck, RefusedFields};
use gait_optimizer::{InitialGuess, LocalOptimumChoice, SolveOptions};
use gaitwright_service::access::{Caller, Reach};
use gaitwright_service::error::Error;
use gaitwright_service::studies::seed;
use gaitwright_service::studies::simulated_walks_setting::SimulatedWalksSetting;
use gaitwright_service::studies::study_plan::{self, NewStudy};
use gaitwright_service::studies::subject::{self, NewSubject};
use gaitwright_store::studies::{AnswerSource, AtlasRole, SimulatedWalksEffect, Study, StudyPlan, WarmStartFrom};
use gaitwright_store::{Connection, SubjectId, Writer, consents};
use std::ops::ControlFlow;
use std::str::FromStr;

/// Creates the study, and the subject if a new one is entered.
pub(super) async fn make(
    writer: &mut Writer,
    caller: &Caller,
    fields: &NewStudyFields,
    editor: &SpaceEditor,
) -> Result<Study, Error> {
    let like = cloned(writer, caller.reach(), fields).await?;
    let subject = match subject_of(fields)? {
        StudySubject::New(new) => subject::add(writer, &caller.actor, &new).await?.id,
        StudySubject::Known(id) => id,
    };
    study_plan::create_by(writer, caller, study_of(fields, editor, subject, like.as_ref())?).await
}

/// The study that [`make`] would create.
async fn planned(
    db: &mut Connection,
    reach: Reach,
    fields: &NewStudyFields,
    editor: &SpaceEditor,
) -> Result<StudyPlan, Error> {
    let like = cloned(db, reach, fields).await?;
    match subject_of(fields)? {
        StudySubject::New(new) => {
            let study = study_of(fields, editor, SubjectId::fresh(), like.as_ref())?;
            study_plan::checked_for_new(db, reach, &new, study).await
        }
        StudySubject::Known(id) => {
            consents::has_not_withdrawn(db, id).await?;
            study_plan::checked(db, reach, study_of(fields, editor, id, like.as_ref())?).await
        }
    }
}

/// Every field that would be refused, and the plan with acceptable values in their place, if there is one.
pub(super) async fn faults(
    db: &mut Connection,
    reach: Reach,
    fields: &NewStudyFields,
) -> Result<(RefusedFields, Option<StudyPlan>), Error> {
    let mut check = FormCheck::new(fields);
    let plan = loop {
        let editor = SpaceEditor::typed(&check.form().space)?;
        let read = planned(db, reach, check.form(), &editor).await;
        if let ControlFlow::Break(plan) = check.step(read)? {
            break plan;
        }
    };
    Ok((check.into_refused(), plan))
}

/// The subject of the study.
enum StudySubject {
    New(NewSubject),
    Known(SubjectId),
}

fn subject_of(fields: &NewStudyFields) -> Result<StudySubject, Error> {
    if fields.subject != NEW_SUBJECT {
        nothing_described(fields)?;
        return Ok(StudySubject::Known(number("subject", &fields.subject, "a subject from the list")?));
    }
    Ok(StudySubject::New(NewSubject {
        pseudonym: fields.pseudonym.clone(),
        height_m: fields.units.read_height("height_m", &fields.height_m)?,
        body_mass_kg: fields.units.read_mass("body_mass_kg", &fields.body_mass_kg)?,
        notes: String::new(),
    }))
}

/// The study that the form describes. Values that the form does not show come from the cloned study.
fn study_of(
    fields: &NewStudyFields,
    editor: &SpaceEditor,
    subject: SubjectId,
    like: Option<&Study>,
) -> Result<NewStudy, Error> {
    let mut base = like.map_or_else(|| NewStudy::of(subject), |study| NewStudy::like(&study.plan));
    if base.subject_id != subject {
        // The muscle values of another person do not apply.
        base.gait_settings.muscles = Box::<gait_optimizer::GaitSettings>::default().muscles;
    }
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
        answer_source: AnswerSource::from_str(&fields.answer_source)
            .map_err(|_| Error::invalid("answer_source", fields.answer_source.as_str(), "gait_rmse, people or both"))?,
        solve_options: SolveOptions {
            initial_guesses: initial_guesses(fields)?,
            local_optimum_choice: local_optimum_choice(fields)?,
            ..base.solve_options
        },
        learner: match learner(&fields.learner) {
            Some(chosen) => chosen,
            None if like.is_some() && fields.learner == KEPT_LEARNER => base.learner,
            None => return Err(Error::invalid("learner", fields.learner.as_str(), &learners)),
        },
        number_of_trials: number("number_of_trials", &fields.number_of_trials, "1 to 10000")?,
        unchanged_limit: optional("unchanged_limit", &fields.unchanged_limit, "1 to 10000, or empty")?,
        parallel_trials: number("parallel_trials", &fields.parallel_trials, "1 to 64")?,
        seed: number("seed", &fields.seed, &format!("0 to {}", seed::MAX_SEED))?,
        repeat_results: Some(fields.repeat_results.is_some()),
        warm_start_from: if fields.warm_start_from_root.is_some() || fields.use_atlas.is_some() {
            WarmStartFrom::Root
        } else {
            WarmStartFrom::Incumbent
        },
        atlas: match base.atlas {
            AtlasRole::Make => AtlasRole::Make,
            _ if fields.use_atlas.is_some() => AtlasRole::Use,
            AtlasRole::Use | AtlasRole::None => AtlasRole::None,
        },
        simulated_walks: simulated_walks(fields)?,
        restricted: fields.restricted.is_some(),
        subject_id: subject,
        start: true,
        ..base
    })
}

/// Empty numbers have their defaults.
fn simulated_walks(fields: &NewStudyFields) -> Result<SimulatedWalksSetting, Error> {
    let default = SimulatedWalksSetting::default();
    let effect = SimulatedWalksEffect::ALL.into_iter().find(|effect| effect.as_str() == fields.simulated_walks_effect);
    let names = SimulatedWalksEffect::ALL.map(SimulatedWalksEffect::as_str).join(", ");
    let strides = "simulated_walks.least_mean_strides";
    let tolerance = "simulated_walks.gait_rmse_tolerance_rad";
    Ok(SimulatedWalksSetting {
        effect: effect.ok_or_else(|| {
            Error::invalid("simulated_walks.effect", fields.simulated_walks_effect.as_str(), &format!("one of {names}"))
        })?,
        number_of_simulated_walks: optional(
            "simulated_walks.number_of_simulated_walks",
            &fields.number_of_simulated_walks,
            "1 to 1000, or empty",
        )?
        .unwrap_or(default.number_of_simulated_walks),
        gait_rmse_tolerance_rad: optional(tolerance, &fields.gait_rmse_tolerance_rad, "0 to 10, or empty")?
            .unwrap_or(default.gait_rmse_tolerance_rad),
        least_mean_strides: optional(strides, &fields.least_mean_strides, "0 to 20, or empty")?
            .unwrap_or(default.least_mean_strides),
    })
}

/// Accepted entries of the field of a local optimum.
const LOCAL_OPTIMUM: &str = "a whole number from 1, or empty, and empty beside an objective tolerance";

fn initial_guesses(fields: &NewStudyFields) -> Result<usize, Error> {
    let field = "initial_guesses";
    let allowed = format!("1 to {}, or empty", InitialGuess::MAX_GUESSES);
    let number = optional(field, &fields.initial_guesses, &allowed)?.unwrap_or(SolveOptions::default().initial_guesses);
    let is_allowed = (1..=InitialGuess::MAX_GUESSES).contains(&number);
    is_allowed.then_some(number).ok_or_else(|| Error::invalid(field, fields.initial_guesses.as_str(), &allowed))
}

/// Without an entry, the lowest objective counts.
fn local_optimum_choice(fields: &NewStudyFields) -> Result<LocalOptimumChoice, Error> {
    let field = "nearest_within_percent";
    let allowed = "0 to 100, or empty";
    let within_percent = optional(field, &fields.nearest_within_percent, allowed)?;
    if let Some(number) = optional("local_optimum", &fields.local_optimum, LOCAL_OPTIMUM)? {
        let chosen = LocalOptimumChoice::Numbered { number };
        if within_percent.is_some() || chosen.validate().is_err() {
            return Err(Error::invalid("local_optimum", fields.local_optimum.as_str(), LOCAL_OPTIMUM));
        }
        return Ok(chosen);
    }
    let Some(within_percent) = within_percent else {
        return Ok(LocalOptimumChoice::LowestObjective);
    };
    let chosen = LocalOptimumChoice::NearestToReference { within_percent };
    chosen.validate().map_err(|_| Error::invalid(field, fields.nearest_within_percent.as_str(), allowed))?;
    Ok(chosen)
}

/// Refuses a new subject that is entered but not chosen, instead of ignoring it.
fn nothing_described(fields: &NewStudyFields) -> Result<(), Error> {
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

/// Reads an optional number.
fn optional<T: FromStr>(field: &str, text: &str, allowed: &str) -> Result<Option<T>, Error> {
    if text.trim().is_empty() { Ok(None) } else { number(field, text, allowed).map(Some) }
}
