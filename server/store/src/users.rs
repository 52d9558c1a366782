//! Stored users.

use super::{Connection, Instant, StoreError, StoreResult, UserId, now};
use crate::rights::Role;
use sqlx::Row;
use sqlx::sqlite::SqliteRow;

/// A person who signs in: administrator, clinician or rater.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct User {
    /// Identifier.
    pub id: UserId,
    /// Name or code, unique ignoring case.
    pub name: String,
    /// Role, which determines the rights of the user.
    pub role: Role,
    /// Whether the user has a password. Otherwise only one-time links work.
    pub has_password: bool,
    /// Time at which the user was disabled, if disabled.
    pub disabled_at: Option<Instant>,
    /// Time of creation.
    pub created_at: Instant,
    /// The argon2id hash in PHC format.
    pub password: Option<String>,
}

/// The unique name, as SQLite names it in a violation.
pub const NAME_UNIQUE: &str = "users.name";

/// Adds a user.
///
/// # Errors
/// A violated constraint ([`NAME_UNIQUE`]); errors of the database.
pub async fn insert(db: &mut Connection, name: &str, role: Role) -> StoreResult<User> {
    let user = User {
        id: UserId::fresh(),
        name: name.to_owned(),
        role,
        has_password: false,
        disabled_at: None,
        created_at: now(),
        password: None,
    };
    sqlx::query("insert into users (id, name, role, created_at) values (?, ?, ?, ?)")
        .bind(user.id)
        .bind(&user.name)
        .bind(role.as_str())
        .bind(user.created_at)
        .execute(db)
        .await?;
    Ok(user)
}

/// The user with this identifier.
///
/// # Errors
/// [`StoreError::Missing`]; errors of the database.
pub async fn get(db: &mut Connection, id: UserId) -> StoreResult<User> {
    let row = sqlx::query("select * from users where id = ?").bind(id).fetch_optional(db).await?;
    row.as_ref().map(from_row).transpose()?.ok_or_else(|| StoreError::Missing { what: "user", id: id.to_string() })
}

/// The user with this name.
///
/// # Errors
/// Errors of the database.
pub async fn by_name(db: &mut Connection, name: &str) -> StoreResult<Option<User>> {
    let row = sqlx::query("select * from users where name = ?").bind(name).fetch_optional(db).await?;
    row.as_ref().map(from_row).transpose()
}

/// Every user, oldest first.
///
/// # Errors
/// Errors of the database.
pub async fn all(db: &mut Connection) -> StoreResult<Vec<User>> {
    let rows = sqlx::query("select * from users order by id").fetch_all(db).await?;
    rows.iter().map(from_row).collect()
}

/// Sets the password of a user.
///
/// # Errors
/// Errors of the database.
pub async fn set_password(db: &mut Connection, id: UserId, password: &str) -> StoreResult<()> {
    sqlx::query("update users set password = ? where id = ?").bind(password).bind(id).execute(db).await?;
    Ok(())
}

/// Changes the role of a user.
///
/// # Errors
/// Errors of the database.
pub async fn set_role(db: &mut Connection, id: UserId, role: Role) -> StoreResult<()> {
    sqlx::query("update users set role = ? where id = ?").bind(role.as_str()).bind(id).execute(db).await?;
    Ok(())
}

/// The roles that a user had before the present one.
///
/// # Errors
/// Errors of the database.
pub async fn former_roles(db: &mut Connection, id: UserId) -> StoreResult<Vec<Role>> {
    let sql = "select json_extract(detail, '$.before') from audit where change = 'user.role' and object = ?";
    let words: Vec<String> = sqlx::query_scalar(sql).bind(format!("user {id}")).fetch_all(db).await?;
    words.iter().map(|word| word.parse()).collect()
}

/// Disables or enables a user.
///
/// # Errors
/// Errors of the database.
pub async fn set_disabled(db: &mut Connection, id: UserId, disabled: bool) -> StoreResult<()> {
    sqlx::query("update users set disabled_at = ? where id = ?").bind(disabled.then(now)).bind(id).execute(db).await?;
    Ok(())
}

fn from_row(row: &SqliteRow) -> StoreResult<User> {
    let password: Option<String> = row.try_get("password")?;
    Ok(User {
        id: row.try_get("id")?,
        name: row.try_get("name")?,
        role: row.try_get::<&str, _>("role")?.parse()?,
        has_password: password.is_some(),
        disabled_at: row.try_get("disabled_at")?,
        created_at: row.try_get("created_at")?,
        password,
    })
}
