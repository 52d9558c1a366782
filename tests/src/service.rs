//! A service on a temporary record.

use crate::certified::{Verdicts, certificate};
use crate::explained::Clearance;
use axum::Router;
use axum::body::Body;
use axum::http::{HeaderMap, HeaderValue, Method, Request, Response, StatusCode, header};
use axum::middleware::map_request;
use gait_optimizer::Gait;
use gaitwright_http::{AccessState, AppState, Hosts, router};
use gaitwright_service::access::Reach;
use gaitwright_service::backups::Backups;
use gaitwright_service::studies::built_in_entries;
use gaitwright_service::studies::scheduler::Scheduler;
use gaitwright_service::studies::study_plan::{self, NewStudy};
use gaitwright_service::workers::{AfterSolves, Certify, Dispatch, Evaluate, Explain, InProcess};
use gaitwright_store::audit::Actor;
use gaitwright_store::certificates::{self, CertificateOnRecord};
use gaitwright_store::feedback::FeedbackRow;
use gaitwright_store::studies::{Study, StudyFilter, StudyState};
use gaitwright_store::trials::Trial;
use gaitwright_store::{
    ReferenceGaitId, Store, StudyId, SubjectId, commit, feedback, reference_gaits, studies, subjects, trials,
};
use http_body_util::BodyExt;
use serde_json::{Value, json};
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;
use tokio::task::JoinHandle;
use tower::ServiceExt;

/// A running service.
pub struct Service {
    /// The record.
    pub store: Store,
    /// Scheduler of its studies.
    pub scheduler: Scheduler,
    /// Access control. By default sign-in is off, so every caller has all rights.
    pub access: Arc<AccessState>,
    /// Backups on request.
    pub backups: Arc<Backups>,
    work: JoinHandle<()>,
    /// Passes every gait at once; `None` if the service certifies gaits itself.
    certifier: Option<JoinHandle<()>>,
}

/// An answer of the service.
#[derive(Debug)]
pub struct Answer {
    /// Its status.
    pub status: StatusCode,
    /// Its headers.
    pub headers: HeaderMap,
    /// Its body.
    pub text: String,
}

impl Answer {
    /// Status, headers and text of a response.
    pub async fn of(response: Response<Body>) -> Self {
        let (status, headers) = (response.status(), response.headers().clone());
        let bytes = response.into_body().collect().await.unwrap().to_bytes();
        Self { status, headers, text: String::from_utf8_lossy(&bytes).into_owned() }
    }

    /// The body as JSON.
    pub fn json(&self) -> Value {
        serde_json::from_str(&self.text).unwrap_or_else(|e| panic!("not JSON ({e}): {}", self.text))
    }

    /// The entries of a page of a list.
    pub fn items(&self) -> Value {
        self.json()["items"].take()
    }

    /// The content type.
    pub fn content_type(&self) -> &str {
        self.headers.get(header::CONTENT_TYPE).map_or("", |v| v.to_str().unwrap())
    }
}

impl Service {
    /// Starts a service with a solver and this number of workers.
    pub async fn start(database: &Path, solver: impl Evaluate, workers: usize) -> Self {
        Self::start_with(database, Arc::new(InProcess::new(workers, Arc::new(solver)).with_lower_priority())).await
    }

    /// Starts a service that certifies gaits on request only.
    pub async fn start_without_certificates(database: &Path, solver: impl Evaluate) -> Self {
        let engine = Arc::new(InProcess::new(1, Arc::new(solver)).with_lower_priority());
        Self::over(with_catalogue(database).await, engine, None)
    }

    /// Starts a service whose jobs go to an engine.
    pub async fn start_with(database: &Path, engine: Arc<dyn Dispatch>) -> Self {
        Self::over(with_catalogue(database).await, engine, None).passing_every_gait()
    }

    /// Starts a service that certifies gaits by itself and explains trials without a gait at once.
    pub async fn start_certifying(database: &Path, solver: impl Evaluate, certify: impl Certify) -> Self {
        Self::start_looking_back(database, solver, certify, Clearance::default()).await
    }

    /// Starts a service that explains trials without a gait by itself, and passes all gaits at once.
    pub async fn start_explaining(database: &Path, solver: impl Evaluate, explain: impl Explain) -> Self {
        let certify = Verdicts { pause: Duration::ZERO, passes: |_: &Gait| true };
        Self::start_looking_back(database, solver, certify, explain).await
    }

    /// Starts a service with a certifier and an explainer.
    pub async fn start_looking_back(
        database: &Path,
        solver: impl Evaluate,
        certify: impl Certify,
        explain: impl Explain,
    ) -> Self {
        let engine = Arc::new(InProcess::new(1, Arc::new(solver)).with_lower_priority());
        let after_solves = AfterSolves { certify: Arc::new(certify), explain: Arc::new(explain) };
        Self::over(with_catalogue(database).await, engine, Some(after_solves))
    }

    /// Starts a service on a record as it is, adding nothing to it.
    pub async fn start_as_is(database: &Path, solver: impl Evaluate, workers: usize) -> Self {
        let store = Store::open(database).await.unwrap();
        Self::over(store, Arc::new(InProcess::new(workers, Arc::new(solver))), None).passing_every_gait()
    }

    fn over(store: Store, engine: Arc<dyn Dispatch>, after_solves: Option<AfterSolves>) -> Self {
        let scheduler = Scheduler::new(&store, engine, None, after_solves);
        let work = tokio::spawn({
            let scheduler = scheduler.clone();
            async move { Box::pin(scheduler.run()).await.unwrap() }
        });
        Self {
            store,
            scheduler,
            access: Arc::new(AccessState::without_sign_in()),
            backups: Arc::default(),
            work,
            certifier: None,
        }
    }

    /// Passes every gait when it is found, because people compare certified gaits only.
    fn passing_every_gait(mut self) -> Self {
        let (store, scheduler) = (self.store.clone(), self.scheduler.clone());
        self.certifier = Some(tokio::spawn(async move {
            let mut pulse = scheduler.pulse();
            loop {
                if pass_every_gait(&store).await {
                    scheduler.changed();
                }
                if pulse.changed().await.is_err() {
                    return;
                }
            }
        }));
        self
    }

    /// Passes no further gaits.
    pub async fn stop_passing_gaits(&self) {
        if let Some(certifier) = &self.certifier {
            certifier.abort();
            while !certifier.is_finished() {
                tokio::task::yield_now().await;
            }
        }
    }

    /// Stops it and closes the record.
    pub async fn stop(self) {
        self.scheduler.stop();
        self.work.await.unwrap();
        if let Some(certifier) = self.certifier {
            certifier.abort();
            let _ = certifier.await;
        }
        self.store.close().await;
    }

    /// Stops the service and ignores errors of its tasks, which are possible if the record accepts no changes.
    pub async fn abandon(self) {
        self.scheduler.stop();
        self.work.abort();
        let _ = self.work.await;
        self.store.close().await;
    }

    /// The paper's first subject.
    pub async fn subject(&self) -> SubjectId {
        let mut reader = self.store.read().await.unwrap();
        subjects::by_pseudonym(&mut reader, "paper-1").await.unwrap().unwrap().id
    }

    /// The built-in reference gait.
    pub async fn reference(&self) -> ReferenceGaitId {
        reference_gaits::all(&mut self.store.read().await.unwrap()).await.unwrap()[0].id
    }

    /// Makes and starts a study of that subject.
    pub async fn study(&self, change: impl FnOnce(&mut NewStudy)) -> StudyId {
        let mut new = NewStudy::of(self.subject().await);
        change(&mut new);
        let mut writer = self.store.write().await.unwrap();
        let study = study_plan::create(&mut writer, &Actor::program(), Reach::Every, new).await.unwrap();
        commit(writer).await.unwrap();
        self.scheduler.changed();
        study.id
    }

    /// The study as it stands.
    pub async fn get(&self, study: StudyId) -> Study {
        studies::get(&mut self.store.read().await.unwrap(), study).await.unwrap()
    }

    /// Its trials.
    pub async fn trials(&self, study: StudyId) -> Vec<Trial> {
        trials::of_study(&mut self.store.read().await.unwrap(), study).await.unwrap()
    }

    /// Its feedback.
    pub async fn feedback(&self, study: StudyId) -> Vec<FeedbackRow> {
        feedback::of_study(&mut self.store.read().await.unwrap(), study, 0).await.unwrap()
    }

    /// Waits until the study is in one of these states.
    pub async fn wait_for(&self, study: StudyId, states: &[StudyState]) -> Study {
        for _ in 0..6000 {
            let present = self.get(study).await;
            if states.contains(&present.state) && self.is_certified(study).await {
                return present;
            }
            tokio::time::sleep(Duration::from_millis(10)).await;
        }
        panic!("the study did not reach {states:?}: {:?}", self.get(study).await);
    }

    /// Whether this harness has passed every gait, if it passes gaits.
    async fn is_certified(&self, study: StudyId) -> bool {
        let certificates = certificates::of_study(&mut self.store.read().await.unwrap(), study).await.unwrap();
        self.certifier.is_none() || !certificates.values().any(|found| *found == CertificateOnRecord::NotCertified)
    }

    /// Waits until this number of trials has ended.
    pub async fn wait_for_trials(&self, study: StudyId, ended: usize) {
        for _ in 0..6000 {
            let done = self.trials(study).await.iter().filter(|t| !t.state.is_open()).count();
            if done >= ended && self.is_certified(study).await {
                return;
            }
            tokio::time::sleep(Duration::from_millis(5)).await;
        }
        panic!("the study did not reach {ended} trials");
    }

    /// State of the handlers.
    pub fn state(&self) -> AppState {
        let hosts = Hosts::new(([127, 0, 0, 1], 0).into(), &[]);
        AppState::new(self.scheduler.clone(), Arc::clone(&self.access), Arc::clone(&self.backups), hosts)
    }

    /// The router; a request without a Host header is one for localhost.
    pub fn router(&self) -> Router {
        router(self.state()).layer(map_request(for_localhost))
    }

    /// Answers requests on a port of its own, for programs. Returns the address, without a scheme.
    pub async fn listening(&self) -> String {
        let listener = tokio::net::TcpListener::bind("127.0.0.1:0").await.unwrap();
        let address = listener.local_addr().unwrap().to_string();
        let router = self.router();
        tokio::spawn(async move { axum::serve(listener, router).await.unwrap() });
        address
    }

    /// `GET`.
    pub async fn fetch(&self, path: &str) -> Answer {
        self.send(Request::get(path).body(Body::empty()).unwrap()).await
    }

    /// `GET` of bytes.
    pub async fn fetch_bytes(&self, path: &str) -> (StatusCode, Vec<u8>) {
        let response = self.router().oneshot(Request::get(path).body(Body::empty()).unwrap()).await.unwrap();
        let status = response.status();
        (status, response.into_body().collect().await.unwrap().to_bytes().to_vec())
    }

    /// `POST` of a JSON document.
    pub async fn post(&self, path: &str, body: &Value) -> Answer {
        self.post_text(path, "application/json", &body.to_string()).await
    }

    /// Requests a backup over REST and waits until it is complete.
    pub async fn backed_up(&self) -> Value {
        let requested = self.post("/api/v1/backups", &json!({})).await;
        assert_eq!(requested.status, StatusCode::ACCEPTED, "{}", requested.text);
        let job = requested.headers["location"].to_str().unwrap().to_owned();
        for _ in 0..2000 {
            let found = self.fetch(&job).await.json();
            match found["state"].as_str() {
                Some("running") => tokio::time::sleep(Duration::from_millis(5)).await,
                Some("done") => return self.fetch(found["result"].as_str().unwrap()).await.json(),
                _ => panic!("{found}"),
            }
        }
        panic!("{job} does not end");
    }

    /// `PUT` of a JSON document.
    pub async fn put(&self, path: &str, body: &Value) -> Answer {
        let request = Request::put(path).header(header::CONTENT_TYPE, "application/json");
        self.send(request.body(Body::from(body.to_string())).unwrap()).await
    }

    /// `POST` of a text.
    pub async fn post_text(&self, path: &str, kind: &str, body: &str) -> Answer {
        let request = Request::builder()
            .method(Method::POST)
            .uri(path)
            .header(header::CONTENT_TYPE, kind)
            .body(Body::from(body.to_owned()))
            .unwrap();
        self.send(request).await
    }

    /// Any request.
    pub async fn send(&self, request: Request<Body>) -> Answer {
        Answer::of(self.router().oneshot(request).await.unwrap()).await
    }
}

/// Passes every gait that has no certificate. `false`: there was none.
async fn pass_every_gait(store: &Store) -> bool {
    let Ok(mut reader) = store.read().await else { return false };
    let mut waiting = Vec::new();
    for study in studies::page(&mut reader, Reach::Every, &StudyFilter::newest(1000)).await.unwrap() {
        let found = certificates::of_study(&mut reader, study.id).await.unwrap();
        waiting.extend(found.into_iter().filter(|(_, found)| *found == CertificateOnRecord::NotCertified));
    }
    drop(reader);
    if waiting.is_empty() {
        return false;
    }
    let Ok(mut writer) = store.write().await else { return false };
    for (trial, _) in &waiting {
        certificates::insert(&mut writer, *trial, &certificate(true)).await.unwrap();
    }
    commit(writer).await.is_ok()
}

/// A request with a Host header.
pub async fn for_localhost<B>(mut request: Request<B>) -> Request<B> {
    request.headers_mut().entry(header::HOST).or_insert(HeaderValue::from_static("localhost"));
    request
}

/// A record with the built-in objects of every service.
async fn with_catalogue(database: &Path) -> Store {
    let store = Store::open(database).await.unwrap();
    let mut writer = store.write().await.unwrap();
    built_in_entries::ensure(&mut writer).await.unwrap();
    commit(writer).await.unwrap();
    store
}
