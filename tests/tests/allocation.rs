//! Allocations: balanced, drawn by the operating system, and concealed from everyone but the device until unblinding.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use axum::http::{Method, StatusCode};
use gaitwright_service::access::{Right, Role};
use gaitwright_service::studies::lab::{self, NewLabSession};
use gaitwright_store::allocations::{self, RandomDraw};
use gaitwright_store::audit::Actor;
use gaitwright_store::blind_pairs::{self, BlindPairKind, NewBlindPair};
use gaitwright_store::studies::{AnswerSource, StudyState};
use gaitwright_store::trials::{Trial, TrialState};
use gaitwright_store::{
    Connection, LabSessionId, Store, StudyId, TokenId, TrialId, UserId, Writer, commit, lab_sessions,
};
use gaitwright_tests::analytic::Analytic;
use gaitwright_tests::archives::{exported, import};
use gaitwright_tests::callers::{self, As, FORM, rater_of, send, send_accepting, signed_in, token};
use gaitwright_tests::consistent_gaits::Consistent;
use gaitwright_tests::page_routes;
use gaitwright_tests::read_allocations::{gait_a_first, sides};
use gaitwright_tests::service::{Answer, Service};
use gaitwright_tests::sources;
use serde_json::{Value, json};
use sha2::{Digest, Sha256};
use skipped_tests::long_tests_are_skipped;
use sqlx::{AssertSqlSafe, Column, Row, TypeInfo, ValueRef};
use std::collections::BTreeMap;
use std::path::Path;
use tempfile::TempDir;

/// Quantile of the chi-squared distribution with one degree of freedom that is exceeded once in a million. The draws
/// are truly random, so a smaller one would fail too often.
const CRITICAL: f64 = 23.93;
const JSON: &str = "application/json";

fn chi_squared(count: usize, of: usize) -> f64 {
    let half = of as f64 / 2.0;
    2.0 * (count as f64 - half).powi(2) / half
}

/// Whether this number of correct guesses is compatible with chance: within five standard deviations of one half, which
/// chance exceeds less than once in a million.
fn is_chance(right: usize, of: usize) -> bool {
    (right as f64 - of as f64 / 2.0).abs() <= 2.5 * (of as f64).sqrt()
}

async fn finished(service: &Service) -> (StudyId, Vec<Trial>) {
    let study = service.study(|new| new.number_of_trials = 6).await;
    service.wait_for(study, &[StudyState::Finished]).await;
    let mut trials = service.trials(study).await;
    trials.retain(|trial| trial.state == TrialState::Converged);
    (study, trials)
}

/// Writes the rows of `studies` ended studies, with gaits like those of the first one.
async fn copies(writer: &mut Connection, study: StudyId, studies: u32) -> Vec<(StudyId, TrialId, TrialId)> {
    let columns = async |writer: &mut Connection, table: &str| -> Vec<String> {
        let rows =
            sqlx::query("select name from pragma_table_info(?) where name not in ('id', 'study_id', 'trial_id')")
                .bind(table);
        rows.fetch_all(&mut *writer).await.unwrap().iter().map(|row| row.get(0)).collect()
    };
    let (of_study, of_trial) =
        (columns(writer, "studies").await.join(", "), columns(writer, "trials").await.join(", "));
    let (of_gait, of_certificate) =
        (columns(writer, "gaits").await.join(", "), columns(writer, "certificates").await.join(", "));
    let mut made = Vec::new();
    for _ in 0..studies {
        let copy = StudyId::fresh();
        let sql = format!("insert into studies (id, {of_study}) select ?, {of_study} from studies where id = ?");
        sqlx::query(AssertSqlSafe(sql)).bind(copy).bind(study).execute(&mut *writer).await.unwrap();
        let gaits = [TrialId::fresh(), TrialId::fresh()];
        let numbers = "select number from trials where study_id = ? and state = 'converged' order by number limit 2";
        let numbers = sqlx::query(numbers).bind(study).fetch_all(&mut *writer).await.unwrap();
        for (gait, number) in gaits.iter().zip(&numbers) {
            let sql = format!(
                "insert into trials (id, study_id, {of_trial}) select ?, ?, {of_trial} from trials \
                 where study_id = ? and number = ?"
            );
            let query = sqlx::query(AssertSqlSafe(sql)).bind(gait).bind(copy).bind(study);
            query.bind(number.get::<i64, _>(0)).execute(&mut *writer).await.unwrap();
            // What makes a gait walkable.
            for (table, columns) in [("gaits", &of_gait), ("certificates", &of_certificate)] {
                let sql = format!(
                    "insert into {table} (trial_id, {columns}) select ?, {columns} from {table} where trial_id = \
                     (select id from trials where study_id = ? and number = ?)"
                );
                let query = sqlx::query(AssertSqlSafe(sql)).bind(gait).bind(study).bind(number.get::<i64, _>(0));
                query.execute(&mut *writer).await.unwrap();
            }
        }
        made.push((copy, gaits[0], gaits[1]));
    }
    made
}

async fn one_service() -> (TempDir, Service) {
    let folder = tempfile::tempdir().unwrap();
    let service = Service::start(&folder.path().join("a.db"), Analytic::default(), 1).await;
    (folder, service)
}

fn session_of((study, one, two): (StudyId, TrialId, TrialId)) -> (StudyId, NewLabSession) {
    (study, NewLabSession { trial_a: one, trial_b: two, notes: String::new() })
}

/// Plans a session of each study, and unblinds it before the next one is planned: the orders.
async fn planned_in_turn(writer: &mut Writer, studies: &[(StudyId, TrialId, TrialId)]) -> Vec<bool> {
    let mut orders = Vec::new();
    for &planned in studies {
        let (study, new) = session_of(planned);
        let session = lab::plan(writer, &Actor::program(), study, &new).await.unwrap();
        let unblinded = lab::unblind(writer, &Actor::program(), session.id, "walked").await.unwrap();
        orders.push(unblinded.allocation.gait_a_first.unwrap());
    }
    orders
}

/// The lead of one order after each session.
fn leads(orders: &[bool]) -> Vec<i32> {
    let mut lead = 0;
    let next = |first: &bool| {
        lead += if *first { 1 } else { -1 };
        lead
    };
    orders.iter().map(next).collect()
}

#[tokio::test]
async fn sessions_unblinded_one_after_another_stay_balanced() {
    let (_folder, service) = one_service().await;
    let (study, _) = finished(&service).await;
    let mut writer = service.store.write().await.unwrap();
    let studies = copies(&mut writer, study, 500).await;
    let mut of_number = Vec::new();
    for _ in 0..2 {
        of_number.push(planned_in_turn(&mut writer, &studies).await);
    }
    drop(writer);
    for orders in &of_number {
        let leads = leads(orders);
        let largest = leads.iter().map(|lead| lead.abs()).max().unwrap();
        let wide = leads.iter().filter(|lead| lead.abs() >= 6).count();
        println!("the lead is at most {largest}, and 6 or more after {wide} of 500 sessions");
        // Expected are 2 in 189; a lead of 18 comes once in 50 million sessions. Fair coins lead by 22 in the end.
        assert!(largest < 18 && wide <= 40, "{largest}, {wide}: {leads:?}");
        let ones = orders.iter().filter(|first| **first).count();
        assert!((243..=257).contains(&ones), "{ones} of 500");
    }
    // Sessions of the same study say nothing about each other.
    let same = of_number[0].iter().zip(&of_number[1]).filter(|(a, b)| a == b).count();
    assert!(is_chance(same, 500), "{same}");
    service.stop().await;
}

/// Minutes, so only with `GAITWRIGHT_LONG_TESTS=1`.
#[tokio::test]
async fn allocations_of_10_000_sessions_are_balanced_in_any_order_of_unblinding() {
    if long_tests_are_skipped("") {
        return;
    }
    let (_folder, service) = one_service().await;
    let (study, _) = finished(&service).await;
    let mut writer = service.store.write().await.unwrap();
    let studies = copies(&mut writer, study, 500).await;
    let mut in_turn = Vec::new();
    let mut concealed = Vec::new();
    // The sessions with one number are balanced among themselves, so every round has a lead of its own.
    for _ in 0..20 {
        in_turn.push(planned_in_turn(&mut writer, &studies).await);
    }
    for _ in 0..20 {
        for &of in &studies {
            let (study, new) = session_of(of);
            concealed.push(lab::plan(&mut writer, &Actor::program(), study, &new).await.unwrap().id);
        }
    }
    let mut coins = Vec::new();
    for id in concealed {
        let unblinded = lab::unblind(&mut writer, &Actor::program(), id, "walked").await.unwrap();
        coins.push(unblinded.allocation.gait_a_first.unwrap());
    }
    drop(writer);
    let largest = in_turn.iter().flat_map(|orders| leads(orders)).map(i32::abs).max().unwrap();
    let ones = coins.iter().filter(|first| **first).count();
    let coins = chi_squared(ones, 10_000);
    println!("10000 sessions: unblinded in turn, largest lead {largest}; concealed together, chi-squared {coins:.2}");
    assert!(coins < CRITICAL, "{coins}");
    // A session has a lead of 20 once in 450 million, so one of 10,000 sessions does in one run of 45,000.
    assert!(largest < 20, "{largest}: {in_turn:?}");
    service.stop().await;
}

/// Four sessions are open together, and all but one are unblinded.
#[tokio::test]
async fn unblinded_session_reveals_nothing_about_a_concealed_one() {
    let (_folder, service) = one_service().await;
    let (study, _) = finished(&service).await;
    let mut writer = service.store.write().await.unwrap();
    let studies = copies(&mut writer, study, 800).await;
    let (mut opposite, mut by_next) = (0, 0);
    for open in studies.chunks_exact(4) {
        let mut planned = Vec::new();
        for &of in open {
            let (study, new) = session_of(of);
            planned.push(lab::plan(&mut writer, &Actor::program(), study, &new).await.unwrap().id);
        }
        let mut orders = Vec::new();
        for id in &planned {
            let unblinded = lab::unblind(&mut writer, &Actor::program(), *id, "walked").await.unwrap();
            orders.push(unblinded.allocation.gait_a_first.unwrap());
        }
        opposite += usize::from(orders[0] != orders[1]);
        // The order that would even out the other three.
        let others = orders[1..].iter().filter(|first| **first).count();
        by_next += usize::from((others < 2) == orders[0]);
    }
    drop(writer);
    println!("guessed as the opposite of the other open one: {opposite} of 200; of three: {by_next} of 200");
    for right in [opposite, by_next] {
        assert!(right <= 132, "{right} of 200");
    }
    service.stop().await;
}

#[tokio::test]
async fn sides_of_10_000_pairs_are_balanced_and_independent_of_earlier_pairs() {
    let (_folder, service) = one_service().await;
    let (study, trials) = finished(&service).await;
    let mut writer = service.store.write().await.unwrap();
    for number in 1..=10_000 {
        let new = NewBlindPair {
            code: format!("{number:064}"),
            study_id: study,
            rater: "R".to_owned(),
            number,
            kind: BlindPairKind::New,
            pair: (trials[1].id, trials[0].id),
            repeats: None,
            could_have_known: false,
        };
        let id = blind_pairs::insert(&mut writer, &new).await.unwrap();
        allocations::of_pair(&mut writer, id, None, RandomDraw::draw().unwrap()).await.unwrap();
    }
    let rows = "select swapped from blind_pair_allocations order by rowid";
    let rows = sqlx::query(rows).fetch_all(&mut **writer).await.unwrap();
    drop(writer);
    let swapped: Vec<bool> = rows.iter().map(|row| row.get(0)).collect();
    let ones = swapped.iter().filter(|one| **one).count();
    println!("sides exchanged in {ones} of 10000, chi-squared {:.2}", chi_squared(ones, 10_000));
    assert!(chi_squared(ones, 10_000) < CRITICAL, "{ones}");
    for distance in 1..=4 {
        let same = swapped.iter().zip(&swapped[distance..]).filter(|(a, b)| a == b).count();
        assert!(chi_squared(same, 10_000 - distance) < CRITICAL, "{same} at distance {distance}");
    }
    service.stop().await;
}

#[tokio::test]
async fn allocations_do_not_depend_on_the_seed() {
    let (_folder, service) = one_service().await;
    let mut first_sessions = Vec::new();
    for _ in 0..24 {
        // Seed 1, as every study by default.
        let (study, trials) = finished(&service).await;
        let body = json!({"trial_a": trials[0].id, "trial_b": trials[1].id});
        let planned = service.post(&format!("/api/v1/studies/{study}/lab-sessions"), &body).await.json();
        first_sessions.push(gait_a_first(&service.store, planned["id"].as_str().unwrap().parse().unwrap()).await);
    }
    // Each of the two uniform outcomes of 24 coins has a probability of 1 in 17 million.
    let ones = first_sessions.iter().filter(|first| **first).count();
    assert!((1..=23).contains(&ones), "{first_sessions:?}");
    service.stop().await;
}

/// The data from which a program can guess: everything that is stored or served, except the allocations.
struct Seen {
    /// Rows of every other table, as text.
    tables: BTreeMap<String, Vec<Vec<String>>>,
}

impl Seen {
    async fn of(store: &Store) -> Self {
        let mut reader = store.read().await.unwrap();
        let names = "select name from sqlite_master where type = 'table' \
                     and name not in ('lab_allocations', 'blind_pair_allocations')";
        let mut tables = BTreeMap::new();
        for name in sqlx::query(names).fetch_all(&mut **reader).await.unwrap() {
            let name: String = name.get(0);
            let rows =
                sqlx::query(AssertSqlSafe(format!("select * from {name}"))).fetch_all(&mut **reader).await.unwrap();
            let text = |row: &sqlx::sqlite::SqliteRow| -> Vec<String> {
                row.columns().iter().map(|column| cell(row, column.ordinal())).collect()
            };
            tables.insert(name, rows.iter().map(text).collect());
        }
        Self { tables }
    }

    /// The columns of a table that hold one of two values, as guesses of the orders of its rows.
    fn column(&self, table: &str, column: usize) -> Vec<&str> {
        self.tables[table].iter().map(|row| row[column].as_str()).collect()
    }
}

fn cell(row: &sqlx::sqlite::SqliteRow, place: usize) -> String {
    let raw = row.try_get_raw(place).unwrap();
    match raw.type_info().name() {
        _ if raw.is_null() => String::new(),
        "INTEGER" | "BOOLEAN" => row.get::<i64, _>(place).to_string(),
        "REAL" => row.get::<f64, _>(place).to_string(),
        "BLOB" => format!("{:?}", row.get::<Vec<u8>, _>(place)),
        _ => row.get(place),
    }
}

/// One bit of a text, as a simple rule for guessing.
fn bit(text: &str) -> bool {
    Sha256::digest(text.as_bytes())[0] & 1 == 1
}

/// Every rule by which a guess can follow from the rows of a table that has one row per order: each column as it is,
/// each bit of the sum of its bytes, and whether it grew since the previous row.
fn guesses(seen: &Seen, table: &str) -> Vec<(String, Vec<bool>)> {
    let width = seen.tables[table].first().map_or(0, Vec::len);
    let mut all = Vec::new();
    for column in 0..width {
        let values = seen.column(table, column);
        let sum = |text: &&str| text.bytes().map(u64::from).sum::<u64>();
        for place in 0..4 {
            all.push((
                format!("{table}.{column} bit {place}"),
                values.iter().map(|v| sum(v) >> place & 1 == 1).collect(),
            ));
        }
        all.push((format!("{table}.{column} hash"), values.iter().map(|v| bit(v)).collect()));
        all.push((
            format!("{table}.{column} last"),
            values.iter().map(|v| v.ends_with(['1', '3', '5', '7', '9'])).collect(),
        ));
    }
    all
}

#[tokio::test]
async fn program_that_reads_everything_else_guesses_1_000_allocations_at_chance() {
    let (_folder, service) = one_service().await;
    let (study, _) = finished(&service).await;
    let mut writer = service.store.write().await.unwrap();
    let studies = copies(&mut writer, study, 250).await;
    commit(writer).await.unwrap();
    let mut ids = Vec::new();
    for _ in 0..4 {
        for &of in &studies {
            let (study, new) = session_of(of);
            // Sealed in a change of its own, as by a request.
            let mut writer = service.store.write().await.unwrap();
            ids.push(lab::plan(&mut writer, &Actor::program(), study, &new).await.unwrap().id);
            commit(writer).await.unwrap();
        }
    }
    let mut truth = Vec::new();
    for id in &ids {
        truth.push(gait_a_first(&service.store, *id).await);
    }
    let seen = Seen::of(&service.store).await;
    assert_eq!(seen.tables["lab_sessions"].len(), 1000);
    let mut tried = 0;
    for (rule, guess) in guesses(&seen, "lab_sessions") {
        let right = guess.iter().zip(&truth).filter(|(a, b)| a == b).count();
        println!("guessed by {rule}: {right} of 1000");
        assert!(is_chance(right, 1000), "{rule}: {right} of 1000");
        tried += 1;
    }
    // A draw from the seed of the study and the number of the session.
    let by_seed = |k: usize| bit(&format!("1 lab session {}", k / 250));
    assert!(is_chance((0..1000).filter(|k| by_seed(*k) == truth[*k]).count(), 1000));

    // The seal of an allocation is a hash of its row. Without the nonce it would reveal the order, because everything
    // else is known or can be tried.
    let seals = &seen.tables["seals"];
    let mut right = 0;
    for (id, order) in ids.iter().zip(&truth) {
        let seal = seals.iter().find(|row| row[1] == "lab_allocations" && row[2] == id.to_string()).unwrap();
        let planned = seen.tables["lab_sessions"].iter().find(|row| row[0] == id.to_string()).unwrap();
        let tried = by_hash(&seal[3], &id.to_string(), planned.last().unwrap());
        right += usize::from(tried.unwrap_or_else(|| bit(&seal[3])) == *order);
        assert_eq!(tried, None, "the hash of a row tells the order");
    }
    assert!(is_chance(right, 1000), "{right}");
    assert!(tried > 40, "{tried}");
    service.stop().await;
}

/// Tries every row that could have this hash, without its nonce.
fn by_hash(sha256: &str, session: &str, created_at: &str) -> Option<bool> {
    for first in [false, true] {
        let mut hash = Sha256::new();
        let mut column = |name: &str, kind: &str, bytes: &[u8]| {
            hash.update(format!("{name}\n{kind}\n{}\n", bytes.len()));
            hash.update(bytes);
        };
        column("created_at", "TEXT", created_at.as_bytes());
        column("gait_a_first", "INTEGER", &i64::from(first).to_be_bytes());
        column("lab_session_id", "TEXT", session.as_bytes());
        if hex::encode(hash.finalize()) == sha256 {
            return Some(first);
        }
    }
    None
}

#[tokio::test]
async fn best_guesser_with_all_unblinded_allocations_is_right_in_four_of_seven() {
    let (_folder, service) = one_service().await;
    let (study, _) = finished(&service).await;
    let mut writer = service.store.write().await.unwrap();
    let studies = copies(&mut writer, study, 1000).await;
    let orders = planned_in_turn(&mut writer, &studies).await;
    drop(writer);
    let (mut right, mut lead) = (0, 0);
    for first in &orders {
        // The rule is public: from a lead of three on, the rarer order is likelier. Below that, both orders are equally
        // likely.
        right += usize::from((lead < 0) == *first);
        lead += if *first { 1 } else { -1 };
    }
    println!("the best guesser is right in {right} of 1000");
    // 571 are expected, within five standard deviations.
    assert!((492..=650).contains(&right), "{right} of 1000");
    service.stop().await;
}

async fn get(service: &Service, who: &As, path: &str) -> Answer {
    send(service, who, &Method::GET, path, "", "").await
}

async fn post(service: &Service, who: &As, path: &str, body: &Value) -> Answer {
    send(service, who, &Method::POST, path, JSON, &body.to_string()).await
}

/// Exchanges every order of the record, and nothing else. The program does it, so that the rows are sealed.
async fn exchange_orders(database: &Path) {
    let store = Store::open(database).await.unwrap();
    let mut writer = store.write().await.unwrap();
    for (trigger, sql) in [
        ("lab_allocations_no_update", "update lab_allocations set gait_a_first = 1 - gait_a_first"),
        ("blind_pair_allocations_no_update", "update blind_pair_allocations set swapped = 1 - swapped"),
    ] {
        let text = sqlx::query_scalar("select sql from sqlite_master where name = ?").bind(trigger);
        let text: String = text.fetch_one(&mut **writer).await.unwrap();
        for sql in [format!("drop trigger {trigger}"), sql.to_owned(), text] {
            sqlx::query(sqlx::AssertSqlSafe(sql)).execute(&mut **writer).await.unwrap();
        }
    }
    gaitwright_store::commit(writer).await.unwrap();
    store.close().await;
}

/// Everything that a reader, a rater, an administrator or an anonymous caller can fetch, except the motions that the
/// rater is shown.
async fn everything(service: &Service, callers: &[As], ids: &[String], own: &str) -> Vec<(String, String)> {
    let document: Value = serde_json::from_str(&gaitwright_http::openapi::text().unwrap()).unwrap();
    // Each address in every available format.
    let mut paths: Vec<(String, Option<String>)> = vec![("/health".to_owned(), None), ("/ready".to_owned(), None)];
    for (path, item) in document["paths"].as_object().unwrap() {
        if item["get"].is_object() {
            paths.push((path.clone(), None));
            let forms = item["get"]["responses"]["200"]["content"].as_object();
            let forms = forms.into_iter().flat_map(|forms| forms.keys()).filter(|_| forms.is_some_and(|f| f.len() > 1));
            paths.extend(forms.map(|form| (path.clone(), Some(form.clone()))));
        }
    }
    let forms: Vec<&str> = paths.iter().filter_map(|(_, form)| form.as_deref()).collect();
    assert!(forms.contains(&"text/csv"), "{forms:?}");
    let pages = page_routes::all().into_iter().filter(|(method, _)| *method == Method::GET);
    paths.extend(pages.map(|(_, path)| (path, None)));
    // These differ from one call to the next, or are the sides as the rater sees them.
    let left_out = [
        "/metrics",
        "/system",
        "/api/v1/studies/{id}/events",
        "/api/v1/backups",
        "/api/v1/access-log",
        "/access-log",
        "/api/v1/studies/{id}/archive",
    ];
    let mut all = Vec::new();
    for (path, form) in paths.iter().filter(|(path, _)| !left_out.contains(&path.as_str())) {
        let sides = ["/rate/pair/", "/blind-pairs/"].iter().any(|part| path.contains(part));
        for id in if path.contains("{id}") { ids } else { &ids[..1] } {
            for (place, who) in callers.iter().enumerate() {
                if path.contains("controller.json") || sides && place == 0 {
                    continue;
                }
                let address = path
                    .replace("{id}", id)
                    .replace("{code}", own)
                    .replace("{side}", "first")
                    .replace("{file}", "rmse.csv");
                let answer = match form {
                    Some(form) => send_accepting(service, who, &address, form).await,
                    None => get(service, who, &address).await,
                };
                let form = form.as_deref().unwrap_or_default();
                let text =
                    answer.text.lines().filter(|line| !is_about_the_request(line)).collect::<Vec<_>>().join("\n");
                all.push((
                    format!("{place} {address} {form}"),
                    format!("{} {}", answer.status, without_request(&text)),
                ));
            }
        }
    }
    all
}

fn is_about_the_request(line: &str) -> bool {
    // Each form has a key of its own. Sessions have the time of their last use, which these requests change.
    let of_session =
        line.contains("with a password") || line.contains("with a link") || line.contains("</time></th><td><time");
    line.contains("name=\"key\"") || line.contains("request_id") || of_session
}

fn remove_what_tells_the_time(document: &mut Value) {
    match document {
        Value::Object(fields) => {
            for field in ["request_id", "instance", "seen_at", "uptime_s"] {
                fields.remove(field);
            }
            fields.values_mut().for_each(remove_what_tells_the_time);
        }
        Value::Array(rows) => rows.iter_mut().for_each(remove_what_tells_the_time),
        _ => {}
    }
}

/// Problem documents carry the identifier of their request.
fn without_request(text: &str) -> String {
    match serde_json::from_str::<Value>(text) {
        Ok(mut document) if document.is_object() || document.is_array() => {
            remove_what_tells_the_time(&mut document);
            document.to_string()
        }
        _ => text
            .split_inclusive(|c: char| !c.is_ascii_hexdigit())
            .map(
                |part| {
                    if part.trim_end_matches(|c: char| !c.is_ascii_hexdigit()).len() == 32 { "REQUEST" } else { part }
                },
            )
            .collect(),
    }
}

#[tokio::test]
async fn exchanging_every_allocation_changes_no_byte_served_before_unblinding() {
    let (folder, service) = callers::service().await;
    let (study, trials) = finished(&service).await;
    let human = service.study(|new| (new.answer_source, new.number_of_trials) = (AnswerSource::People, 8)).await;
    service.wait_for(human, &[StudyState::Waiting]).await;
    let rater = rater_of(&service, &[study, human]).await;
    let callers =
        [rater.clone(), signed_in(&service, Role::Administrator).await, token(&service, &[Right::Read]).await];
    // Answered pairs and an open one; sessions that are walked and answered, also with a walk that was unsafe.
    let mut own = String::new();
    for answer in ["first", "second", "no_difference", ""] {
        service.wait_for(human, &[StudyState::Waiting]).await;
        let mut pair = Value::Null;
        while pair.is_null() {
            let next = format!("/api/v1/studies/{human}/blind-pairs/next");
            pair = post(&service, &rater, &next, &json!({})).await.json()["pair"].clone();
        }
        own = pair["code"].as_str().unwrap().to_owned();
        if !answer.is_empty() {
            post(&service, &rater, &format!("/api/v1/blind-pairs/{own}/answer"), &json!({"answer": answer})).await;
        }
    }
    let mut sessions = Vec::new();
    for answer in ["first", "unsafe_second"] {
        let plan = json!({"trial_a": trials[0].id, "trial_b": trials[1].id});
        let path = format!("/api/v1/studies/{study}/lab-sessions");
        let planned = post(&service, &callers[1], &path, &plan).await;
        let id = planned.json()["id"].as_str().unwrap().to_owned();
        for walk in 1..=3 {
            post(&service, &rater, &format!("/api/v1/lab-sessions/{id}/walks"), &json!({"walk": walk})).await;
        }
        post(&service, &rater, &format!("/api/v1/lab-sessions/{id}/answers"), &json!({"number": 1, "answer": answer}))
            .await;
        sessions.push(id);
    }
    // Ends solves and answers, so that the record no longer changes.
    post(&service, &callers[1], &format!("/api/v1/studies/{human}/pause"), &json!({})).await;
    let mut ids = vec![study.to_string(), human.to_string(), trials[0].id.to_string(), trials[1].id.to_string()];
    ids.extend(sessions);
    ids.push(service.subject().await.to_string());
    let archive = async |store: &Store| [exported(store, study).await, exported(store, human).await];
    let archives = archive(&service.store).await;
    let before = everything(&service, &callers, &ids, &own).await;
    let access = std::sync::Arc::clone(&service.access);
    let drawn = sides(&service.store, human).await;
    service.stop().await;

    let database = folder.path().join("a.db");
    let exchanged = folder.path().join("b.db");
    std::fs::copy(&database, &exchanged).unwrap();
    exchange_orders(&exchanged).await;
    let mut service = Service::start_as_is(&exchanged, Analytic::default(), 1).await;
    service.access = access;
    let exchanged: Vec<_> = drawn.iter().map(|(first, second)| (*second, *first)).collect();
    assert_eq!(sides(&service.store, human).await, exchanged);
    assert!(archive(&service.store).await == archives, "archives differ");
    let after = everything(&service, &callers, &ids, &own).await;
    assert!(before.len() > 250, "{}", before.len());
    let statuses = before.iter().filter(|(_, text)| text.starts_with("200")).count();
    assert!(statuses > 100, "{statuses} of {}", before.len());
    let pairs = before.iter().zip(&after).filter(|(before, after)| before != after);
    let differing: Vec<&str> = pairs.map(|((what, _), _)| what.as_str()).collect();
    assert!(differing.is_empty() && before.len() == after.len(), "{differing:?}");
    service.stop().await;
}

#[tokio::test]
async fn archive_omits_concealed_allocations_and_a_session_without_one_cannot_be_unblinded() {
    let folder = tempfile::tempdir().unwrap();
    let service = Service::start(&folder.path().join("a.db"), Consistent::default(), 1).await;
    let (study, trials) = finished(&service).await;
    let body = json!({"trial_a": trials[0].id, "trial_b": trials[1].id});
    let mut ids: Vec<LabSessionId> = Vec::new();
    for _ in 0..2 {
        let planned = service.post(&format!("/api/v1/studies/{study}/lab-sessions"), &body).await.json();
        ids.push(planned["id"].as_str().unwrap().parse().unwrap());
    }
    let unblind = format!("/api/v1/lab-sessions/{}/unblind", ids[0]);
    assert_eq!(service.post(&unblind, &json!({"reason": "walked"})).await.status, StatusCode::OK);
    let file = exported(&service.store, study).await;
    let first = gait_a_first(&service.store, ids[0]).await;
    service.stop().await;

    let other = folder.path().join("b.db");
    let store = Store::open(&other).await.unwrap();
    import(&store, &file).await.unwrap();
    let mut reader = store.read().await.unwrap();
    let of = async |reader: &mut Connection, id| lab_sessions::get(reader, id).await.unwrap().allocation;
    assert_eq!(of(&mut reader, ids[0]).await.gait_a_first, Some(first));
    let blind = of(&mut reader, ids[1]).await;
    assert_eq!((blind.included, blind.gait_a_first), (false, None));
    drop(reader);
    let device = gaitwright_service::access::Caller::token(TokenId::fresh(), "rig", &[Right::Device]);
    let mut writer = store.write().await.unwrap();
    let refused = lab::for_device(&mut writer, &device, ids[1], 2).await.unwrap_err();
    assert!(refused.to_string().contains("did not include the allocation"), "{refused}");
    drop(writer);
    store.close().await;
    drop(store);
    let there = Service::start_as_is(&other, Analytic::default(), 1).await;
    let unblind = format!("/api/v1/lab-sessions/{}/unblind", ids[1]);
    let refused = there.post(&unblind, &json!({"reason": "walked"})).await;
    assert_eq!(refused.status, StatusCode::CONFLICT, "{}", refused.text);
    let page = there.fetch(&format!("/lab-sessions/{}", ids[1])).await.text;
    assert!(
        page.contains("its archive does not contain the allocation") && !page.contains("Unblind this session"),
        "{page}"
    );
    there.stop().await;
}

#[tokio::test]
async fn person_who_fetches_a_controller_file_is_recorded_as_unblinded_but_the_device_is_not() {
    let (_folder, service) = callers::service().await;
    let (study, trials) = finished(&service).await;
    let clinician = signed_in(&service, Role::Clinician).await;
    let (device, reader) =
        (token(&service, &[Right::Device]).await, token(&service, &[Right::Device, Right::Rate]).await);
    let plan = json!({"trial_a": trials[0].id, "trial_b": trials[1].id});
    let path = format!("/api/v1/studies/{study}/lab-sessions");
    let id = post(&service, &clinician, &path, &plan).await.json()["id"].as_str().unwrap().to_owned();
    let mut writer = service.store.write().await.unwrap();
    let row: LabSessionId = id.parse().unwrap();
    // An analytic gait has no controller file, so the test calls the function that records a download.
    let device_caller = gaitwright_service::access::Caller::token(TokenId::fresh(), "rig", &[Right::Device]);
    let reading_caller =
        gaitwright_service::access::Caller::token(TokenId::fresh(), "script", &[Right::Device, Right::Rate]);
    let gait = lab::for_device(&mut writer, &device_caller, row, 2).await.unwrap();
    let other = lab::for_device(&mut writer, &reading_caller, row, 3).await.unwrap();
    commit(writer).await.unwrap();
    assert_eq!(gait == lab::GaitOfWalk::A, gait_a_first(&service.store, row).await);
    assert_ne!(gait, other, "walk 3 is with the other gait");

    let session = get(&service, &clinician, &format!("/api/v1/lab-sessions/{id}")).await.json();
    let files: Vec<_> =
        session["controller_files"].as_array().unwrap().iter().map(|f| f["to_device"].clone()).collect();
    assert_eq!(files, [json!(true), json!(false)]);
    let mut writer = service.store.write().await.unwrap();
    for walk in 1..=3 {
        let walked = lab::RecordedWalk { walk, note: String::new() };
        lab::record_walk(&mut writer, &reading_caller.actor, row, &walked).await.unwrap();
    }
    let answer = lab::NewAnswer { number: 1, answer: blind_pairs::OrderedAnswer::First, note: String::new() };
    let seen = lab::answer(&mut writer, &reading_caller, row, &answer).await.unwrap();
    assert!(seen.answer.unwrap().could_have_known);
    commit(writer).await.unwrap();
    let session = get(&service, &clinician, &format!("/api/v1/lab-sessions/{id}")).await.json();
    assert_eq!(session["walks"][1]["recorded_after_unblinding"], true);

    // All other callers are refused, such as a token with the scope run and a rater.
    let file = format!("/api/v1/lab-sessions/{id}/controller.json?walk=2");
    for (who, may) in [
        (&device, true),
        (&reader, true),
        (&clinician, true),
        (&token(&service, &[Right::Read, Right::Run]).await, false),
        (&signed_in(&service, Role::Rater).await, false),
    ] {
        let answer = get(&service, who, &file).await;
        assert_eq!(answer.status != StatusCode::FORBIDDEN, may, "{who:?}: {}", answer.text);
    }
    service.stop().await;
}

#[tokio::test]
async fn controller_file_fetched_by_a_script_makes_answers_not_blind_but_by_a_device_does_not() {
    let (_folder, service) = one_service().await;
    let (study, trials) = finished(&service).await;
    let person = gaitwright_service::access::Caller::person(UserId::fresh(), "Ada", Role::Clinician);
    let script = gaitwright_service::access::Caller::token(TokenId::fresh(), "script", &[Right::Device, Right::Read]);
    let device = gaitwright_service::access::Caller::token(TokenId::fresh(), "rig", &[Right::Device]);
    for (fetched_by, could_have_known) in [(&script, true), (&device, false)] {
        let new = NewLabSession { trial_a: trials[0].id, trial_b: trials[1].id, notes: String::new() };
        let mut writer = service.store.write().await.unwrap();
        let id = lab::plan(&mut writer, &Actor::program(), study, &new).await.unwrap().id;
        lab::for_device(&mut writer, fetched_by, id, 2).await.unwrap();
        for walk in 1..=3 {
            let walked = lab::RecordedWalk { walk, note: String::new() };
            lab::record_walk(&mut writer, &person.actor, id, &walked).await.unwrap();
        }
        let answer = lab::NewAnswer { number: 1, answer: blind_pairs::OrderedAnswer::First, note: String::new() };
        let seen = lab::answer(&mut writer, &person, id, &answer).await.unwrap();
        assert_eq!(seen.answer.unwrap().could_have_known, could_have_known, "{}", fetched_by.name);
        commit(writer).await.unwrap();
    }
    service.stop().await;
}

#[tokio::test]
async fn answers_of_a_person_who_fetched_a_controller_file_are_recorded_as_not_blind() {
    let (_folder, service) = callers::service().await;
    let study = service.study(|new| (new.answer_source, new.number_of_trials) = (AnswerSource::People, 8)).await;
    service.wait_for(study, &[StudyState::Waiting]).await;
    let program = token(&service, &[Right::Rate, Right::Device]).await;
    let next = format!("/api/v1/studies/{study}/blind-pairs/next");
    let pair = post(&service, &program, &next, &json!({})).await.json()["pair"].clone();
    let drawn = sides(&service.store, study).await;
    let plan = NewLabSession { trial_a: drawn[0].0, trial_b: drawn[0].1, notes: String::new() };
    let mut writer = service.store.write().await.unwrap();
    let session = lab::plan(&mut writer, &Actor::program(), study, &plan).await.unwrap();
    let caller =
        gaitwright_service::access::Caller::token(TokenId::fresh(), "[Rate, Device]", &[Right::Rate, Right::Device]);
    lab::for_device(&mut writer, &caller, session.id, 2).await.unwrap();
    commit(writer).await.unwrap();
    let path = format!("/rate/pair/{}", pair["code"].as_str().unwrap());
    let said = send(&service, &program, &Method::POST, &path, FORM, "answer=first").await;
    assert!(said.status.is_redirection(), "{}", said.text);
    assert!(service.feedback(study).await.iter().any(|row| row.by_rater && row.could_have_known));
    service.stop().await;
}

#[tokio::test]
async fn refused_controller_file_does_not_reveal_which_gait_is_unsafe() {
    let (_folder, service) = one_service().await;
    let (study, trials) = finished(&service).await;
    let plan = json!({"trial_a": trials[0].id, "trial_b": trials[1].id});
    let planned = service.post(&format!("/api/v1/studies/{study}/lab-sessions"), &plan).await.json();
    let file = |walk| format!("/api/v1/lab-sessions/{}/controller.json?walk={walk}", planned["id"].as_str().unwrap());
    let (two, three) = (service.fetch(&file(2)).await, service.fetch(&file(3)).await);
    assert_eq!((two.status, without_request(&two.text)), (three.status, without_request(&three.text)));
    let none = service.fetch(&file(1)).await;
    assert!(
        none.status == StatusCode::UNPROCESSABLE_ENTITY && none.text.contains("without the device"),
        "{}",
        none.text
    );
    service.stop().await;
}

#[tokio::test]
async fn every_motion_for_a_rater_has_different_bytes() {
    let (_folder, service) = callers::service().await;
    let study = service.study(|new| (new.answer_source, new.number_of_trials) = (AnswerSource::People, 14)).await;
    let rater = rater_of(&service, &[study]).await;
    let mut motions: BTreeMap<TrialId, Vec<String>> = BTreeMap::new();
    let mut pictures: BTreeMap<TrialId, Vec<String>> = BTreeMap::new();
    for _ in 0..4000 {
        let present = service.wait_for(study, &[StudyState::Waiting, StudyState::Finished]).await;
        if present.state == StudyState::Finished {
            break;
        }
        let next = format!("/api/v1/studies/{study}/blind-pairs/next");
        let pair = post(&service, &rater, &next, &json!({})).await.json()["pair"].clone();
        let Some(code) = pair["code"].as_str() else {
            tokio::time::sleep(std::time::Duration::from_millis(5)).await;
            continue;
        };
        let (first, second) = *sides(&service.store, study).await.last().unwrap();
        let page = get(&service, &rater, &format!("/rate/pair/{code}")).await.text;
        let drawn: Vec<&str> = page.split("<svg class=\"tiles\"").skip(1).collect();
        assert_eq!(drawn.len(), 2, "{page}");
        for (place, trial) in [first, second].into_iter().enumerate() {
            let side = ["first", "second"][place];
            let motion = get(&service, &rater, &format!("/api/v1/blind-pairs/{code}/motions/{side}")).await.text;
            assert_eq!(motion, get(&service, &rater, &format!("/api/v1/blind-pairs/{code}/motions/{side}")).await.text);
            motions.entry(trial).or_default().push(motion);
            let picture = drawn[place].split_once("</svg>").unwrap().0;
            pictures.entry(trial).or_default().push(picture.to_owned());
        }
        post(&service, &rater, &format!("/api/v1/blind-pairs/{code}/answer"), &json!({"answer": "second"})).await;
    }
    let mut again = 0;
    for shown in motions.values().chain(pictures.values()) {
        let mut distinct = shown.clone();
        distinct.sort();
        distinct.dedup();
        assert_eq!(distinct.len(), shown.len());
        again += shown.len() - 1;
    }
    assert!(again > 4, "gaits were shown again: {again}");
    service.stop().await;
}

#[tokio::test]
async fn anonymous_callers_cannot_see_running_solves() {
    let (_folder, service) = callers::service().await;
    let health = get(&service, &As::Nobody, "/health").await.json();
    let fields: Vec<_> = health.as_object().unwrap().keys().collect();
    assert_eq!(fields, ["status", "version"]);
    let rater = signed_in(&service, Role::Rater).await;
    for path in ["/metrics", "/system"] {
        for who in [&As::Nobody, &rater] {
            assert!(!get(&service, who, path).await.status.is_success(), "{path} as {who:?}");
        }
    }
    service.stop().await;
}

#[test]
fn only_allocation_modules_name_the_allocation_tables() {
    let allowed = [
        "allocations/mod.rs",
        "allocations/balanced_draws.rs",
        "allocations/random_sides.rs",
        "archived_allocations.rs",
        "archived_rows.rs",
        "seals/tables.rs",
    ];
    let allowed = allowed.map(|file| format!("store/src/{file}"));
    let mut read = 0;
    for (name, text) in sources::of_server() {
        if allowed.contains(&name) {
            continue;
        }
        read += 1;
        for table in ["lab_allocations", "blind_pair_allocations"] {
            assert!(!text.contains(table), "{name} names {table}");
        }
    }
    assert!(read > 150, "{read}");
}
