//! Which gait of a rater's pair is shown on which side: drawn by a fair coin, and read for the rater or after unblinding.

use super::balanced_draws::RandomDraw;
use crate::blind_pairs::{BlindPair, OrderedAnswer, SELECT};
use crate::{BlindPairId, Connection, StoreResult, StudyId, TrialId, now};
use sqlx::sqlite::SqliteRow;
use sqlx::{AssertSqlSafe, Row};

/// Draws which gait of a pair is shown first, by a fair coin. A biased one would not do: answers in the study reveal
/// earlier allocations to readers who know the answer of the rater. A pair that is shown again after a retraction keeps the
/// sides of the earlier pair (`same_sides_as`).
///
/// # Errors
/// A violated constraint if the pair has an allocation; errors of the database.
pub async fn of_pair(
    db: &mut Connection,
    id: BlindPairId,
    same_sides_as: Option<BlindPairId>,
    random: RandomDraw,
) -> StoreResult<()> {
    sqlx::query(
        "insert into blind_pair_allocations (pair_id, swapped, nonce, created_at) \
         values (?1, coalesce((select swapped from blind_pair_allocations where pair_id = ?2), ?3), ?4, ?5)",
    )
    .bind(id)
    .bind(same_sides_as)
    .bind(random.coin())
    .bind(random.nonce())
    .bind(now())
    .execute(db)
    .await?;
    Ok(())
}

/// A pair with its sides.
#[derive(Debug, Clone, PartialEq)]
pub struct PairWithSides {
    /// The pair.
    pub pair: BlindPair,
    swapped: bool,
}

impl PairWithSides {
    /// The gaits, in the order in which they are shown.
    pub fn shown(&self) -> (TrialId, TrialId) {
        let (a, b) = self.pair.trials();
        if self.swapped { (b, a) } else { (a, b) }
    }

    /// Converts an answer from sides to gaits of the pair, or back.
    pub fn turned(&self, answer: OrderedAnswer) -> OrderedAnswer {
        if self.swapped { answer.swapped() } else { answer }
    }

    /// The answer in terms of sides.
    pub fn answer(&self) -> Option<OrderedAnswer> {
        self.pair.answer.map(|answer| self.turned(answer))
    }
}

/// The pair with this code, if it belongs to the rater.
///
/// # Errors
/// Errors of the database.
pub async fn own_pair(db: &mut Connection, code: &str, rater: &str) -> StoreResult<Option<PairWithSides>> {
    let found = sided("where p.code = ? and p.rater = ?", &[Some(code), Some(rater)], db).await?;
    Ok(found.into_iter().next())
}

/// The pairs of unblinded raters of a study, in the order of the draws.
///
/// # Errors
/// Errors of the database.
pub async fn of_unblinded_raters(db: &mut Connection, study: StudyId) -> StoreResult<Vec<PairWithSides>> {
    let rest = "where p.study_id = ? and exists \
                (select 1 from rater_unblindings u where u.study_id = p.study_id and u.rater = p.rater) order by p.id";
    sided(rest, &[Some(&study.to_string())], db).await
}

/// A page of the pairs of unblinded raters of a study, in the order of the draws: of one rater or, without a name, of all.
///
/// # Errors
/// Errors of the database.
pub async fn page_of_unblinded_raters(
    db: &mut Connection,
    study: StudyId,
    rater: Option<&str>,
    after: Option<BlindPairId>,
    limit: u32,
) -> StoreResult<Vec<PairWithSides>> {
    let rest = "where p.study_id = ? and p.rater = coalesce(?, p.rater) and p.id > ? and exists \
                (select 1 from rater_unblindings u where u.study_id = p.study_id and u.rater = p.rater) \
                order by p.id limit cast(? as integer)";
    let (study, after, limit) =
        (study.to_string(), after.map_or_else(String::new, |id| id.to_string()), limit.to_string());
    sided(rest, &[Some(&study), rater, Some(&after), Some(&limit)], db).await
}

/// Reads pairs with their sides. `rest` states why the sides may be known.
async fn sided(rest: &'static str, values: &[Option<&str>], db: &mut Connection) -> StoreResult<Vec<PairWithSides>> {
    let columns = SELECT.replacen("select p.*", "select p.*, s.swapped", 1);
    let sql = format!("{columns} join blind_pair_allocations s on s.pair_id = p.id {rest}");
    let mut query = sqlx::query(AssertSqlSafe(sql));
    for value in values {
        query = query.bind(value.map(str::to_owned));
    }
    let row = |row: &SqliteRow| -> StoreResult<PairWithSides> {
        Ok(PairWithSides { pair: BlindPair::from_row(row)?, swapped: row.try_get("swapped")? })
    };
    query.fetch_all(db).await?.iter().map(row).collect()
}

/// Whether the sides of a pair are in this record.
///
/// # Errors
/// Errors of the database.
pub async fn is_included(db: &mut Connection, id: BlindPairId) -> StoreResult<bool> {
    let row = sqlx::query("select 1 from blind_pair_allocations where pair_id = ?").bind(id);
    Ok(row.fetch_optional(db).await?.is_some())
}
