//! Stored members of studies, and restrictions of studies to them.

use super::{Connection, Instant, MemberId, StoreError, StoreResult, StudyId, now};
use crate::accessible_studies::Principal;
use crate::rights::Role;
use serde::{Deserialize, Serialize};
use sqlx::sqlite::SqliteRow;
use sqlx::{AssertSqlSafe, Row};
use utoipa::ToSchema;

/// Kind of member.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum MemberKind {
    /// A user.
    User,
    /// A token.
    Token,
}

/// Member of a study.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Member {
    /// Identifier of the membership.
    pub id: MemberId,
    /// Identifier of the study.
    pub study_id: StudyId,
    /// Whether it is a user or a token.
    pub kind: MemberKind,
    /// Name of the user or the token.
    pub name: String,
    /// Role of a user. Absent for a token.
    pub role: Option<Role>,
    /// Actor who added the member.
    pub added_by: String,
    /// Time at which the member was added.
    pub created_at: Instant,
}

/// The message of the trigger that refuses a second membership.
pub const MEMBER_ALREADY: &str = "already a member of this study";

const MEMBERS: &str = "select m.*, coalesce(u.name, t.name) as name, u.role as role from study_members m \
                       left join users u on u.id = m.user_id left join tokens t on t.id = m.token_id ";

/// The current members of a study, in the order in which they were added.
///
/// # Errors
/// Errors of the database.
pub async fn of_study(db: &mut Connection, study: StudyId) -> StoreResult<Vec<Member>> {
    let sql =
        format!("{MEMBERS} where m.study_id = ? and m.id in (select id from current_study_members) order by m.id");
    let rows = sqlx::query(AssertSqlSafe(sql)).bind(study).fetch_all(db).await?;
    rows.iter().map(from_row).collect()
}

/// A membership, even if it has ended.
///
/// # Errors
/// [`StoreError::Missing`]; errors of the database.
pub async fn get(db: &mut Connection, id: MemberId) -> StoreResult<Member> {
    let row = sqlx::query(AssertSqlSafe(format!("{MEMBERS} where m.id = ?"))).bind(id).fetch_optional(db).await?;
    row.as_ref()
        .map(from_row)
        .transpose()?
        .ok_or_else(|| StoreError::Missing { what: "membership", id: id.to_string() })
}

/// Adds a member.
///
/// # Errors
/// [`MEMBER_ALREADY`]; errors of the database.
pub async fn insert(db: &mut Connection, study: StudyId, who: Principal, actor: &str) -> StoreResult<MemberId> {
    let (user, token) = match who {
        Principal::User(id) => (Some(id), None),
        Principal::Token(id) => (None, Some(id)),
    };
    let id = MemberId::fresh();
    sqlx::query(
        "insert into study_members (id, study_id, user_id, token_id, actor, created_at) values (?, ?, ?, ?, ?, ?)",
    )
    .bind(id)
    .bind(study)
    .bind(user)
    .bind(token)
    .bind(actor)
    .bind(now())
    .execute(db)
    .await?;
    Ok(id)
}

/// Ends a membership. Returns `false` if it has already ended.
///
/// # Errors
/// Errors of the database.
pub async fn end(db: &mut Connection, id: MemberId, actor: &str) -> StoreResult<bool> {
    let sql = "insert into study_member_ends (member_id, actor, created_at) values (?, ?, ?) on conflict do nothing";
    Ok(sqlx::query(sql).bind(id).bind(actor).bind(now()).execute(db).await?.rows_affected() == 1)
}

/// Whether a study is restricted to its members.
///
/// # Errors
/// Errors of the database.
pub async fn is_restricted(db: &mut Connection, study: StudyId) -> StoreResult<bool> {
    let found =
        sqlx::query("select 1 from restricted_studies where study_id = ?").bind(study).fetch_optional(db).await?;
    Ok(found.is_some())
}

/// Restricts a study to its members, or opens it to all staff.
///
/// # Errors
/// Errors of the database.
pub async fn set_restricted(db: &mut Connection, study: StudyId, restricted: bool, actor: &str) -> StoreResult<()> {
    sqlx::query("insert into study_restrictions (study_id, restricted, actor, created_at) values (?, ?, ?, ?)")
        .bind(study)
        .bind(restricted)
        .bind(actor)
        .bind(now())
        .execute(db)
        .await?;
    Ok(())
}

/// Copies the restriction and the members, except raters, of a restricted study to another one. Does nothing for an
/// open study.
///
/// # Errors
/// Errors of the database.
pub async fn inherit(db: &mut Connection, from: StudyId, to: StudyId, actor: &str) -> StoreResult<()> {
    if !is_restricted(db, from).await? {
        return Ok(());
    }
    set_restricted(db, to, true, actor).await?;
    let rows = sqlx::query(
        "select m.user_id, m.token_id, u.role from current_study_members m \
                            left join users u on u.id = m.user_id where m.study_id = ?",
    )
    .bind(from)
    .fetch_all(&mut *db)
    .await?;
    for row in &rows {
        if row.try_get::<Option<&str>, _>("role")? == Some(Role::Rater.as_str()) {
            continue;
        }
        let user = row.try_get::<Option<_>, _>("user_id")?.map(Principal::User);
        let token = row.try_get::<Option<_>, _>("token_id")?.map(Principal::Token);
        if let Some(who) = user.or(token) {
            insert(db, to, who, actor).await?;
        }
    }
    Ok(())
}

fn from_row(row: &SqliteRow) -> StoreResult<Member> {
    let role: Option<&str> = row.try_get("role")?;
    let user: Option<&str> = row.try_get("user_id")?;
    Ok(Member {
        id: row.try_get("id")?,
        study_id: row.try_get("study_id")?,
        kind: if user.is_some() { MemberKind::User } else { MemberKind::Token },
        name: row.try_get("name")?,
        role: role.map(str::parse).transpose()?,
        added_by: row.try_get("actor")?,
        created_at: row.try_get("created_at")?,
    })
}
