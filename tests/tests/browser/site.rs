//! A service that a browser can reach.

use gaitwright_service::workers::Explain;
use gaitwright_tests::analytic::Analytic;
use gaitwright_tests::service::Service;
use std::net::SocketAddr;
use std::path::PathBuf;
use std::time::Duration;
use tempfile::TempDir;
use tokio::net::TcpListener;
use tokio::task::JoinHandle;

/// A service on its own port.
pub(crate) struct Site {
    pub(crate) service: Service,
    pub(crate) origin: String,
    address: SocketAddr,
    answering: JoinHandle<()>,
    database: PathBuf,
    _folder: TempDir,
}

impl Site {
    pub(crate) async fn start(solver: Analytic) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let service = Service::start(&folder.path().join("a.db"), solver, 1).await;
        Self::of(folder, service).await
    }

    /// The same for a service that explains trials without a gait.
    pub(crate) async fn start_explaining(solver: Analytic, explain: impl Explain) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let service = Service::start_explaining(&folder.path().join("a.db"), solver, explain).await;
        Self::of(folder, service).await
    }

    async fn of(folder: TempDir, service: Service) -> Self {
        let database = service.store.path().to_owned();
        let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
        let address = listener.local_addr().unwrap();
        let answering = answer(&service, listener);
        Self { service, origin: format!("http://{address}"), address, answering, database, _folder: folder }
    }

    /// The same with a change to the service before it accepts requests.
    pub(crate) async fn start_with(solver: Analytic, change: impl FnOnce(&mut Service)) -> Self {
        let mut site = Self::start(solver).await;
        site.answering.abort();
        change(&mut site.service);
        let listener = bind(site.address).await;
        site.answering = answer(&site.service, listener);
        site
    }

    /// Ends the service, does something with its record, and starts it anew at the same address.
    pub(crate) async fn restart<F: Future<Output = ()>>(
        self,
        solver: Analytic,
        meanwhile: impl FnOnce(PathBuf) -> F,
    ) -> Self {
        self.answering.abort();
        self.service.stop().await;
        meanwhile(self.database.clone()).await;
        let service = Service::start(&self.database, solver, 1).await;
        let answering = answer(&service, bind(self.address).await);
        Self { service, answering, ..self }
    }

    /// An address of this service.
    pub(crate) fn at(&self, path: &str) -> String {
        format!("{}{path}", self.origin)
    }
}

fn answer(service: &Service, listener: TcpListener) -> JoinHandle<()> {
    let router = service.router();
    tokio::spawn(async move { axum::serve(listener, router).await.unwrap() })
}

/// The port becomes free a moment after the previous service has stopped.
async fn bind(address: SocketAddr) -> TcpListener {
    for _ in 0..100 {
        if let Ok(listener) = TcpListener::bind(address).await {
            return listener;
        }
        tokio::time::sleep(Duration::from_millis(20)).await;
    }
    panic!("{address} stays taken");
}
