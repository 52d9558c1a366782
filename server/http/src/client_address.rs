//! The client address of a request, for sign-in limits, sessions and logs.

use super::{AppState, trusted_proxies};
use crate::problem_details::Refusal;
use axum::extract::{ConnectInfo, FromRequestParts, Request, State};
use axum::http::request::Parts;
use axum::http::{Extensions, HeaderValue, header};
use axum::middleware::Next;
use axum::response::Response;
use gaitwright_service::error::Error;
use std::convert::Infallible;
use std::fmt;
use std::net::{IpAddr, Ipv4Addr, Ipv6Addr, SocketAddr};

/// Tells browsers to use TLS for a year.
const ONLY_SECURELY: HeaderValue = HeaderValue::from_static("max-age=31536000");

/// The address that a request comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct ClientAddress(IpAddr);

impl ClientAddress {
    /// A client address. An IPv4-mapped IPv6 address equals its IPv4 address.
    pub fn new(address: IpAddr) -> Self {
        Self(address.to_canonical())
    }

    /// The address itself.
    pub fn ip(self) -> IpAddr {
        self.0
    }

    /// The network that one client controls: an IPv4 address, or the /64 network of an IPv6 address.
    pub fn network(self) -> String {
        match self.0 {
            IpAddr::V4(address) => address.to_string(),
            IpAddr::V6(address) => {
                let [a, b, c, d, ..] = address.segments();
                format!("{}/64", Ipv6Addr::new(a, b, c, d, 0, 0, 0, 0))
            }
        }
    }

    /// The largest network that providers usually delegate to one customer: the /48 network of an IPv6 address.
    pub fn site(self) -> Option<String> {
        let IpAddr::V6(address) = self.0 else { return None };
        let [a, b, c, ..] = address.segments();
        Some(format!("{}/48", Ipv6Addr::new(a, b, c, 0, 0, 0, 0, 0)))
    }
}

impl fmt::Display for ClientAddress {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}

/// Whether the browser uses TLS, with the service or a trusted proxy.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct Secure(pub(crate) bool);

impl Secure {
    /// The scheme of the service's addresses for the browser.
    pub(crate) fn scheme(self) -> &'static str {
        if self.0 { "https" } else { "http" }
    }
}

impl<S: Send + Sync> FromRequestParts<S> for Secure {
    type Rejection = Infallible;

    async fn from_request_parts(parts: &mut Parts, _: &S) -> Result<Self, Infallible> {
        Ok(parts.extensions.get::<Self>().copied().unwrap_or_default())
    }
}

/// The peer of the connection; 0.0.0.0 for a request without a connection, as in tests.
fn client_address(extensions: &Extensions) -> ClientAddress {
    let peer = extensions.get::<ConnectInfo<SocketAddr>>().map(|ConnectInfo(peer)| peer.ip());
    ClientAddress::new(peer.unwrap_or(IpAddr::V4(Ipv4Addr::UNSPECIFIED)))
}

/// Adds [`ClientAddress`] and [`Secure`] to the request, and sets the Host header to the host that the browser
/// requested: from the connection, or from the headers of a trusted proxy. Later layers, such as the checks of host and
/// origin, see the request as the client sent it. With TLS, cookies become secure and browsers are told to keep using
/// TLS.
pub(super) async fn note(State(app): State<AppState>, mut request: Request, next: Next) -> Result<Response, Refusal> {
    let peer = client_address(request.extensions());
    if app.access.open && trusted_proxies::is_forwarded(request.headers()) {
        let reason = "A proxy forwarded this request, but a service without sign-in accepts requests from this \
                      machine only. Start it without --no-sign-in to use it through a proxy.";
        return Err(Error::Forbidden(reason.to_owned()).into());
    }
    let believed = app.proxies.believe(peer.ip(), request.headers())?;
    let secure = Secure(believed.secure.unwrap_or(app.access.secure));
    trusted_proxies::remove(request.headers_mut());
    // A request with two Host headers is refused later.
    if let Some(host) = believed.host
        && request.headers().get_all(header::HOST).iter().count() < 2
    {
        request.headers_mut().insert(header::HOST, host);
    }
    request.extensions_mut().insert(ClientAddress::new(believed.client));
    request.extensions_mut().insert(secure);
    let mut response = next.run(request).await;
    if secure.0 {
        response.headers_mut().insert(header::STRICT_TRANSPORT_SECURITY, ONLY_SECURELY);
        for (name, cookie) in response.headers_mut().iter_mut() {
            if name == header::SET_COOKIE
                && let Ok(text) = cookie.to_str()
                && !text.split(';').any(|part| part.trim().eq_ignore_ascii_case("secure"))
                && let Ok(kept) = HeaderValue::from_str(&format!("{text}; Secure"))
            {
                *cookie = kept;
            }
        }
    }
    Ok(response)
}

impl<S: Send + Sync> FromRequestParts<S> for ClientAddress {
    type Rejection = Infallible;

    async fn from_request_parts(parts: &mut Parts, _: &S) -> Result<Self, Infallible> {
        Ok(parts.extensions.get::<Self>().copied().unwrap_or_else(|| client_address(&parts.extensions)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn addresses_of_one_ipv6_network_are_one_client() {
        let network = |text: &str| ClientAddress::new(text.parse().unwrap()).network();
        assert_eq!(network("2001:db8:1:2:3:4:5:6"), "2001:db8:1:2::/64");
        assert_eq!(network("2001:db8:1:2:ffff::1"), network("2001:db8:1:2:3:4:5:6"));
        assert_ne!(network("2001:db8:1:3::1"), network("2001:db8:1:2::1"));
        assert_eq!(network("::ffff:10.0.0.7"), "10.0.0.7");
        let site = |text: &str| ClientAddress::new(text.parse().unwrap()).site();
        assert_eq!(site("2001:db8:1:2:3:4:5:6").as_deref(), Some("2001:db8:1::/48"));
        assert_eq!(site("2001:db8:1:ffff::"), site("2001:db8:1::1"));
        assert_eq!([site("10.0.0.7"), site("::ffff:10.0.0.7")], [None, None]);
    }
}
