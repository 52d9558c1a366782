//! The access page of a study: its members, the forms that add and remove them, and the reliability of its raters.

use super::users::origin;
use crate::AppState;
use crate::accessible::{DespiteWithdrawal, Id, Named};
use crate::authorization::Authorized;
use crate::client_address::Secure;
use crate::extractors::Form;
use crate::format;
use crate::page_error::{PageError, PageResult, page};
use crate::qr_code;
use crate::refused_fields::{FieldLabels, FormCheck, RefusedFields, TypedForm};
use askama::Template;
use axum::extract::State;
use axum::http::HeaderMap;
use axum::response::{IntoResponse, Redirect, Response};
use gaitwright_service::access::{Administer, Caller, Read, RequiredRight, Run};
use gaitwright_service::error::Error;
use gaitwright_service::studies::blind::{self, RaterReliability, Share};
use gaitwright_service::studies::membership::{self, NewMember, StudyAccess};
use gaitwright_service::studies::rater_invitation;
use gaitwright_store::members::{Member, MemberKind};
use gaitwright_store::studies::Study;
use gaitwright_store::{MemberId, StudyId, Writer, commit, consents, studies};
use serde::Deserialize;
use std::ops::ControlFlow;

#[derive(Template)]
#[template(path = "study_members.html")]
struct MembersPage {
    study: Study,
    access: StudyAccess,
    /// Users and tokens that can be added: value and label.
    candidates: Vec<(String, String)>,
    /// Everyone who compared gaits blind. Empty if the subject withdrew consent.
    raters: Vec<RaterReliability>,
    may_run: bool,
    may_administer: bool,
    /// Whether the subject withdrew consent, so that members can only be removed.
    withdrawn: bool,
    /// A new sign-in link, shown only once: user and link.
    link: Option<(String, String)>,
    refused: RefusedFields,
    /// The entries of a refused form.
    typed: MembersForm,
}

impl MembersPage {
    fn role(member: &Member) -> &'static str {
        member.role.as_ref().map_or("token", format::role)
    }

    /// Whether the caller may unblind raters, and one of them is blind.
    fn may_unblind(&self) -> bool {
        self.may_administer && self.raters.iter().any(|rater| rater.first_preferred.is_none())
    }

    /// `6 of 8 (41 % to 93 %)`, the interval with a confidence of 95 %.
    fn share(share: &Share) -> String {
        match (share.low, share.high) {
            (Some(low), Some(high)) => {
                format!("{} of {} ({} to {})", share.count, share.of, format::percent(low), format::percent(high))
            }
            _ => "–".to_owned(),
        }
    }
}

/// `GET /studies/{id}/members`.
pub(super) async fn get(
    authorized: Authorized<Read>,
    State(app): State<AppState>,
    Id(id, _): Id<StudyId, Read>,
) -> PageResult {
    show(&app, &authorized.caller, id, AfterAction::default()).await
}

/// The parts of the page that depend on the last action.
#[derive(Default)]
struct AfterAction {
    link: Option<(String, String)>,
    refused: RefusedFields,
    typed: MembersForm,
}

async fn show(app: &AppState, caller: &Caller, id: StudyId, shown: AfterAction) -> PageResult {
    let mut reader = app.read().await?;
    let study = studies::get(&mut reader, id).await?;
    let access = membership::access(&mut reader, id).await?;
    let may_run = caller.may(Run::NEEDED);
    let withdrawn = consents::is_withdrawn(&mut reader, id).await?;
    let candidates =
        if may_run && !withdrawn { membership::candidates(&mut reader, &access.members).await? } else { Vec::new() };
    let raters = if withdrawn { Vec::new() } else { blind::reliability(&mut reader, id).await? };
    let candidates = candidates.into_iter().map(|(kind, name, role)| {
        let kind = if kind == MemberKind::User { "user" } else { "token" };
        (format!("{kind} {name}"), format!("{name} ({})", role.as_ref().map_or("token", format::role)))
    });
    page(&MembersPage {
        study,
        access,
        candidates: candidates.collect(),
        raters,
        may_run,
        may_administer: caller.may(Administer::NEEDED),
        withdrawn,
        link: shown.link,
        refused: shown.refused,
        typed: shown.typed,
    })
}

/// The fields of every form of the page.
#[derive(Debug, Clone, Default, Deserialize)]
pub(super) struct MembersForm {
    button: String,
    /// `user R1` or `token rig`.
    #[serde(default)]
    who: String,
    /// The membership to remove.
    #[serde(default)]
    member: String,
    /// The name of a rater to invite.
    #[serde(default)]
    name: String,
    /// The rater to unblind.
    #[serde(default)]
    rater: String,
    /// Why the rater is unblinded.
    #[serde(default)]
    reason: String,
}

impl TypedForm for MembersForm {
    const LABELS: FieldLabels =
        &[("who", "User or token"), ("name", "Name or code of the rater"), ("rater", "Rater"), ("reason", "Reason")];

    /// Only the lists have acceptable members and raters.
    fn repair(&mut self, field: &str) -> bool {
        match field {
            // An unused name.
            "name" => self.name = MemberId::fresh().to_string(),
            "reason" => "a reason".clone_into(&mut self.reason),
            _ => return false,
        }
        true
    }
}

/// `POST /studies/{id}/members`. Answers with the page instead of a redirect, because a link is not stored and can be shown
/// only here.
pub(super) async fn post(
    authorized: Authorized<Run>,
    State(app): State<AppState>,
    DespiteWithdrawal(id, _): DespiteWithdrawal<StudyId, Run>,
    secure: Secure,
    headers: HeaderMap,
    Form(form): Form<MembersForm>,
) -> Result<Response, PageError> {
    let mut check = FormCheck::new(&form);
    loop {
        let mut writer = app.write().await?;
        let applied = apply(&mut writer, &authorized.caller, id, check.form()).await;
        match check.step(applied)? {
            ControlFlow::Continue(()) => {}
            ControlFlow::Break(Some(invited)) if check.is_clean() => {
                commit(writer).await?;
                app.scheduler.changed();
                let Some((name, secret)) = invited else {
                    // Users who removed themselves can no longer see the study.
                    return Ok(Redirect::to(&format!("/studies/{id}/members")).into_response());
                };
                let link = Some((name, format!("{}/sign-in/{secret}", origin(secure, &headers))));
                let shown = AfterAction { link, ..AfterAction::default() };
                return Ok(show(&app, &authorized.caller, id, shown).await?.into_response());
            }
            ControlFlow::Break(_) => break,
        }
    }
    let refused = check.into_refused();
    let status = refused.status();
    let shown = AfterAction { refused, typed: form, link: None };
    Ok((status, show(&app, &authorized.caller, id, shown).await?).into_response())
}

/// Performs the action; returns name and secret of a sign-in link, if it created one.
async fn apply(
    writer: &mut Writer,
    caller: &Caller,
    study: StudyId,
    form: &MembersForm,
) -> Result<Option<(String, String)>, Error> {
    if form.button != "remove" {
        consents::may_be_shown(writer, study).await?;
    }
    match form.button.as_str() {
        "add" => {
            let unknown = || Error::invalid("who", form.who.as_str(), "a user or token from the list");
            let (kind, name) = form.who.split_once(' ').ok_or_else(unknown)?;
            let kind = match kind {
                "user" => MemberKind::User,
                "token" => MemberKind::Token,
                _ => return Err(unknown()),
            };
            membership::add(writer, &caller.actor, study, &NewMember { kind, name: name.to_owned() }).await?;
            Ok(None)
        }
        "remove" => {
            let unknown = |_| Error::invalid("member", form.member.as_str(), "a member listed on this page");
            let member: Named<MemberId> = form.member.parse().map_err(unknown)?;
            let member = member.accessible(writer, caller.reach()).await?;
            membership::end(writer, &caller.actor, member).await?;
            Ok(None)
        }
        "restrict" | "open" => {
            membership::restrict(writer, caller, study, form.button == "restrict").await?;
            Ok(None)
        }
        "invite" if caller.may(Administer::NEEDED) => {
            let (user, _, secret) = rater_invitation::invite(writer, &caller.actor, study, &form.name).await?;
            Ok(Some((user.name, secret)))
        }
        "invite" => Err(Error::Forbidden("Only administrators can create sign-in links.".to_owned())),
        "unblind" if caller.may(Administer::NEEDED) => {
            blind::unblind(writer, caller, study, &form.rater, &form.reason).await?;
            Ok(None)
        }
        "unblind" => Err(Error::Forbidden("Only administrators can unblind raters.".to_owned())),
        other => Err(Error::invalid("button", other, "add, remove, restrict, open, invite or unblind")),
    }
}
