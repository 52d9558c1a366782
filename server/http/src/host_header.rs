//! Checks the Host header, against DNS rebinding.
//!
//! A page of another site whose name is made to resolve to this machine has the same origin for a browser. Only the
//! name in the request reveals it.

use crate::problem_details::Refusal;
use axum::extract::{Request, State};
use axum::http::{Version, header};
use axum::middleware::Next;
use axum::response::Response;
use gaitwright_service::error::Error;
use std::net::{IpAddr, SocketAddr};
use std::sync::Arc;

/// The host names of the service.
#[derive(Debug, Clone)]
pub struct Hosts {
    listen: IpAddr,
    names: Arc<[String]>,
}

impl Hosts {
    /// The listening address, and names that resolve to it.
    pub fn new(listen: SocketAddr, names: &[String]) -> Self {
        Self { listen: listen.ip(), names: names.iter().map(|name| name.to_ascii_lowercase()).collect() }
    }

    /// Whether a Host header (`name`, `name:port`, `[v6]:port`) names this service. The port is ignored, because it may
    /// be mapped.
    fn answers_to(&self, host: &str) -> bool {
        if let Some(address) = address_in(host) {
            let here = self.listen.is_loopback() && address.is_loopback();
            return here || self.listen.is_unspecified() || address == self.listen;
        }
        let name = host.rsplit_once(':').map_or(host, |(name, _)| name).trim_end_matches('.').to_ascii_lowercase();
        name == "localhost" || self.names.contains(&name)
    }
}

/// Whether a host name always means the machine that resolves it (RFC 6761, section 6.3).
pub fn is_loopback_name(name: &str) -> bool {
    let name = name.trim_end_matches('.').to_ascii_lowercase();
    name == "localhost" || name.ends_with(".localhost") || address_in(&name).is_some_and(|found| found.is_loopback())
}

fn address_in(host: &str) -> Option<IpAddr> {
    let bare = host.strip_prefix('[').and_then(|rest| rest.strip_suffix(']')).unwrap_or(host);
    bare.parse().ok().or_else(|| host.parse().ok().map(|address: SocketAddr| address.ip()))
}

/// Refuses a request for another host, or with an ambiguous host.
pub(super) async fn check(State(hosts): State<Hosts>, request: Request, next: Next) -> Result<Response, Refusal> {
    match named(&request)? {
        Some(host) if !hosts.answers_to(host) => {
            let reason =
                format!("The host {host:?} is not a name of this service. Add it with `gaitwright serve --host-name`.");
            Err(Error::Forbidden(reason).into())
        }
        _ => Ok(next.run(request).await),
    }
}

/// The host of a request. HTTP/1.1 requires exactly one Host header: with two, or with another host in the request
/// line, a proxy and this service could choose different ones. HTTP/1.0 allows requests without a host.
fn named(request: &Request) -> Result<Option<&str>, Error> {
    let malformed = |reason: &str| Err(Error::Malformed(format!("The Host header {reason}.")));
    let mut all = request.headers().get_all(header::HOST).iter();
    let (first, second) = (all.next(), all.next());
    if second.is_some() {
        return malformed("occurs more than once");
    }
    let Some(first) = first else {
        return if request.version() < Version::HTTP_11 { Ok(None) } else { malformed("is missing") };
    };
    let Ok(host) = first.to_str() else { return malformed("contains characters that a host name cannot have") };
    match request.uri().authority() {
        Some(other) if !other.as_str().eq_ignore_ascii_case(host) => {
            malformed("differs from the host in the request line")
        }
        _ => Ok(Some(host)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn service_accepts_its_address_localhost_and_configured_names() {
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

    #[test]
    fn loopback_names_mean_this_machine_only() {
        for name in ["localhost", "LOCALHOST.", "gait.localhost", "127.0.0.1", "127.8.8.8", "[::1]"] {
            assert!(is_loopback_name(name), "{name}");
        }
        for name in ["", "gait.example", "localhost.example", "notlocalhost", "10.0.0.7", "0.0.0.0"] {
            assert!(!is_loopback_name(name), "{name}");
        }
    }
}
