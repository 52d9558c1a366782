//! The names that the service answers to.
//!
//! A page of another site whose name suddenly means this machine (DNS rebinding) is of the same origin for a browser;
//! only the name in the request tells it apart.

use crate::error::Error;
use axum::extract::{Request, State};
use axum::http::header;
use axum::middleware::Next;
use axum::response::Response;
use std::net::{IpAddr, SocketAddr};
use std::sync::Arc;

/// The names that the service answers to.
#[derive(Debug, Clone)]
pub struct Hosts {
    listen: IpAddr,
    names: Arc<[String]>,
}

impl Hosts {
    /// The address that is listened to, and names that point at it.
    pub fn new(listen: SocketAddr, names: &[String]) -> Self {
        Self { listen: listen.ip(), names: names.iter().map(|name| name.to_ascii_lowercase()).collect() }
    }

    /// Whether a Host header (`name`, `name:port`, `[v6]:port`) means this service. The port does not matter: it may be
    /// mapped.
    fn answers_to(&self, host: &str) -> bool {
        if let Some(address) = address_in(host) {
            let here = self.listen.is_loopback() && address.is_loopback();
            return here || self.listen.is_unspecified() || address == self.listen;
        }
        let name = host.rsplit_once(':').map_or(host, |(name, _)| name).trim_end_matches('.').to_ascii_lowercase();
        name == "localhost" || self.names.contains(&name)
    }
}

fn address_in(host: &str) -> Option<IpAddr> {
    let bare = host.strip_prefix('[').and_then(|rest| rest.strip_suffix(']')).unwrap_or(host);
    bare.parse().ok().or_else(|| host.parse().ok().map(|address: SocketAddr| address.ip()))
}

/// Refuses a request for another name.
pub(super) async fn check(State(hosts): State<Hosts>, request: Request, next: Next) -> Result<Response, Error> {
    let host = request.headers().get(header::HOST).map(|value| value.to_str().unwrap_or_default());
    match host {
        Some(host) if !hosts.answers_to(host) => {
            let reason = format!("this service does not answer to the name {host:?}; `serve --host-name` makes it");
            Err(Error::Forbidden(reason))
        }
        _ => Ok(next.run(request).await),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_service_answers_to_its_address_to_localhost_and_to_names_it_was_given() {
        let hosts = |listen: &str| Hosts::new(listen.parse().unwrap(), &["Gait.Clinic.example".to_owned()]);
        let here = hosts("127.0.0.1:8080");
        for host in ["127.0.0.1:8080", "127.0.0.1", "localhost:9999", "LOCALHOST", "[::1]:8080", "gait.clinic.example"]
        {
            assert!(here.answers_to(host), "{host}");
        }
        for host in
            ["evil.example", "evil.example:8080", "localhost.evil.example", "10.0.0.7:8080", "", "127.0.0.1.nip.io"]
        {
            assert!(!here.answers_to(host), "{host}");
        }
        assert!(hosts("0.0.0.0:80").answers_to("10.0.0.7") && hosts("10.0.0.7:80").answers_to("10.0.0.7:80"));
        assert!(!hosts("0.0.0.0:80").answers_to("evil.example"));
    }
}
