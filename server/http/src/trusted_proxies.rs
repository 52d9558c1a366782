//! Trusted reverse proxies: client address, scheme and host of a forwarded request, from the headers of the proxies.
//!
//! They are trusted only from the configured networks, and only in the configured kind of header. A proxy overwrites
//! the kind that it knows, but passes the other kind on as the client wrote it.

use super::network::Network;
use axum::http::{HeaderMap, HeaderName, HeaderValue, header};
use gaitwright_service::error::Error;
use std::net::{IpAddr, SocketAddr};
use std::sync::Arc;

const FOR: HeaderName = HeaderName::from_static("x-forwarded-for");
const PROTO: HeaderName = HeaderName::from_static("x-forwarded-proto");
const HOST: HeaderName = HeaderName::from_static("x-forwarded-host");

/// The kind of headers that the proxies write.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum ProxyHeaders {
    /// `X-Forwarded-For`, `-Proto` and `-Host`.
    #[default]
    XForwarded,
    /// `Forwarded` (RFC 7239).
    Forwarded,
}

/// The trusted reverse proxies.
#[derive(Debug, Clone, Default)]
pub struct Proxies {
    trusted: Arc<[Network]>,
    headers: ProxyHeaders,
}

/// The origin of a request according to trusted proxies.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct TrustedOrigin {
    /// Address of the client.
    pub(super) client: IpAddr,
    /// Whether the client used TLS; `None` if the proxy does not say.
    pub(super) secure: Option<bool>,
    /// The requested host; `None` if the proxy does not say.
    pub(super) host: Option<HeaderValue>,
}

/// One hop of a request, as a proxy recorded it: peer, scheme and host.
#[derive(Debug, Default, Clone)]
struct Hop {
    from: Option<String>,
    proto: Option<String>,
    host: Option<String>,
}

impl Proxies {
    /// Trusts proxies in these networks, which write this kind of headers.
    pub fn new(trusted: &[Network], headers: ProxyHeaders) -> Self {
        Self { trusted: trusted.into(), headers }
    }

    /// Whether any proxy is trusted.
    pub fn are_any(&self) -> bool {
        !self.trusted.is_empty()
    }

    /// Whether an address is that of a trusted proxy.
    pub fn trust(&self, address: IpAddr) -> bool {
        self.trusted.iter().any(|network| network.holds(address))
    }

    /// The origin of a request that came from `peer`.
    ///
    /// # Errors
    /// [`Error::Malformed`] if the headers of a trusted proxy are malformed.
    pub(super) fn believe(&self, peer: IpAddr, headers: &HeaderMap) -> Result<TrustedOrigin, Error> {
        let mut believed = TrustedOrigin { client: peer.to_canonical(), secure: None, host: None };
        if !self.trust(peer) {
            return Ok(believed);
        }
        let hops = match self.headers {
            ProxyHeaders::XForwarded => x_forwarded(headers)?,
            ProxyHeaders::Forwarded => forwarded(headers)?,
        };
        // The nearest proxy wrote the last hop. A hop from another trusted proxy makes the hop before it valid.
        for hop in hops.iter().rev() {
            if !self.trust(believed.client) {
                break;
            }
            let from = hop.from.as_deref().map(|from| Node::of(from).ok_or_else(|| unreadable("for", from)));
            let from = from.transpose()?.unwrap_or(Node::Hidden);
            if let Node::Address(address) = from {
                believed.client = address.to_canonical();
            }
            if let Some(proto) = &hop.proto {
                believed.secure = Some(match proto.to_ascii_lowercase().as_str() {
                    "https" => true,
                    "http" => false,
                    _ => return Err(unreadable("proto", proto)),
                });
            }
            if let Some(host) = &hop.host {
                believed.host = Some(HeaderValue::from_str(host).map_err(|_| unreadable("host", host))?);
            }
            // The hop before may be the client's own text. A hidden client counts as the proxy that hides it.
            if from == Node::Hidden {
                break;
            }
        }
        Ok(believed)
    }
}

/// Whether a proxy of any kind says that it forwarded the request.
pub(super) fn is_forwarded(headers: &HeaderMap) -> bool {
    const OTHERS: [&str; 8] = [
        "forwarded",
        "via",
        "x-real-ip",
        "x-client-ip",
        "true-client-ip",
        "cf-connecting-ip",
        "x-original-url",
        "x-envoy-external-address",
    ];
    headers.keys().any(|name| name.as_str().starts_with("x-forwarded-") || OTHERS.contains(&name.as_str()))
}

/// Removes the headers of proxies, so that no later code reads them.
pub(super) fn remove(headers: &mut HeaderMap) {
    for name in [FOR, PROTO, HOST, header::FORWARDED] {
        headers.remove(name);
    }
}

fn unreadable(what: &str, value: &str) -> Error {
    Error::Malformed(format!("A header of the reverse proxy is malformed: the value of `{what}` is {value:?}."))
}

/// The comma-separated parts of all lines of a header. An empty part is a hop of its own: without it, the last hop could
/// be the client's own text.
fn parts(headers: &HeaderMap, name: &HeaderName) -> Result<Vec<String>, Error> {
    let mut parts = Vec::new();
    for line in headers.get_all(name) {
        let text = line.to_str().map_err(|_| {
            Error::Malformed(format!("A header of the reverse proxy is malformed: {name} is not printable ASCII."))
        })?;
        let split = split(text, ',').ok_or_else(|| unreadable(name.as_str(), text))?;
        parts.extend(split.into_iter().map(|part| part.trim().to_owned()));
    }
    Ok(parts)
}

/// The hops of `X-Forwarded-*`. Schemes and hosts match the hops one by one if their numbers are equal. Otherwise only
/// the last one counts, which the nearest proxy wrote.
fn x_forwarded(headers: &HeaderMap) -> Result<Vec<Hop>, Error> {
    let (from, protos, hosts) = (parts(headers, &FOR)?, parts(headers, &PROTO)?, parts(headers, &HOST)?);
    let hops = from.len().max(1);
    let at = |values: &[String], hop: usize| {
        let place =
            if values.len() == hops { Some(hop) } else { values.len().checked_sub(1).filter(|_| hop + 1 == hops) };
        place.and_then(|place| values.get(place)).filter(|value| !value.is_empty()).cloned()
    };
    let hop = |hop| Hop { from: at(&from, hop), proto: at(&protos, hop), host: at(&hosts, hop) };
    Ok((0..hops).map(hop).collect())
}

/// The hops of `Forwarded`: `for=192.0.2.43;proto=https;host="gait.example", for="[2001:db8::7]"`.
fn forwarded(headers: &HeaderMap) -> Result<Vec<Hop>, Error> {
    let mut hops = Vec::new();
    for part in parts(headers, &header::FORWARDED)? {
        let mut hop = Hop::default();
        let mut names = Vec::new();
        let pairs = split(&part, ';').ok_or_else(|| unreadable("Forwarded", &part))?;
        for pair in pairs.into_iter().filter(|pair| !pair.trim().is_empty()) {
            let (name, value) = pair.split_once('=').ok_or_else(|| unreadable("Forwarded", &part))?;
            let value = value.trim();
            let bare = value.strip_prefix('"').and_then(|rest| rest.strip_suffix('"'));
            let value = bare.map_or_else(|| value.to_owned(), |quoted| quoted.replace('\\', ""));
            let name = name.trim().to_ascii_lowercase();
            match name.as_str() {
                "for" => hop.from = Some(value),
                "proto" => hop.proto = Some(value),
                "host" => hop.host = Some(value),
                _ => {}
            }
            // RFC 7239, section 4: a parameter occurs once.
            if names.contains(&name) {
                return Err(unreadable("Forwarded", &part));
            }
            names.push(name);
        }
        hops.push(hop);
    }
    Ok(hops)
}

/// Splits at separators outside quotes; `None` if a quote is not closed. A client that opens one would otherwise hide the
/// hop that the proxy appends.
fn split(text: &str, separator: char) -> Option<Vec<&str>> {
    let (mut quoted, mut escaped) = (false, false);
    let split = text
        .split(|c| {
            quoted ^= c == '"' && !escaped;
            escaped = quoted && c == '\\' && !escaped;
            c == separator && !quoted
        })
        .collect();
    (!quoted).then_some(split)
}

/// The peer of a proxy (RFC 7239, section 6).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Node {
    Address(IpAddr),
    /// `unknown`, or an identifier such as `_hidden`.
    Hidden,
}

impl Node {
    /// `192.0.2.43`, `192.0.2.43:4711`, `2001:db8::7`, `[2001:db8::7]`, `[2001:db8::7]:4711`, `unknown`, `_hidden:_port`.
    fn of(text: &str) -> Option<Self> {
        if let Some(address) = address_in(text) {
            return Some(Self::Address(address));
        }
        let (name, port) = text.rsplit_once(':').map_or((text, None), |(name, port)| (name, Some(port)));
        if port.is_some_and(|port| port.parse::<u16>().is_err() && !is_obfuscated(port)) {
            return None;
        }
        let is_hidden = name.eq_ignore_ascii_case("unknown") || is_obfuscated(name);
        if is_hidden { Some(Self::Hidden) } else { address_in(name).map(Self::Address) }
    }
}

fn is_obfuscated(text: &str) -> bool {
    let allowed = |c: char| c.is_ascii_alphanumeric() || "._-".contains(c);
    text.strip_prefix('_').is_some_and(|rest| !rest.is_empty() && rest.chars().all(allowed))
}

fn address_in(text: &str) -> Option<IpAddr> {
    let bare = text.strip_prefix('[').and_then(|rest| rest.strip_suffix(']')).unwrap_or(text);
    bare.parse().ok().or_else(|| text.parse().ok().map(|address: SocketAddr| address.ip()))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn proxies(headers: ProxyHeaders) -> Proxies {
        let trusted = ["127.0.0.1", "10.1.0.0/16", "fd00::/8"].map(|text| text.parse().unwrap());
        Proxies::new(&trusted, headers)
    }

    fn headers(lines: &[(&'static str, &str)]) -> HeaderMap {
        let mut map = HeaderMap::new();
        for (name, value) in lines {
            map.append(*name, value.parse().unwrap());
        }
        map
    }

    fn believed(peer: &str, kind: ProxyHeaders, lines: &[(&'static str, &str)]) -> (String, Option<bool>, String) {
        let found = proxies(kind).believe(peer.parse().unwrap(), &headers(lines)).unwrap();
        let host = found.host.map(|host| host.to_str().unwrap().to_owned()).unwrap_or_default();
        (found.client.to_string(), found.secure, host)
    }

    #[test]
    fn networks_contain_their_addresses_and_no_others() {
        let network = |text: &str| text.parse::<Network>();
        for (text, inside, outside) in [
            ("10.1.0.0/16", "10.1.255.7", "10.2.0.1"),
            ("127.0.0.1", "::ffff:127.0.0.1", "127.0.0.2"),
            ("fd00::/8", "fdff::1", "fe80::1"),
            ("0.0.0.0/0", "192.0.2.1", "::1"),
        ] {
            let network = network(text).unwrap();
            assert!(network.holds(inside.parse().unwrap()) && !network.holds(outside.parse().unwrap()), "{text}");
        }
        for bad in ["", "10.0.0.0/33", "::/129", "proxy.example", "10.0.0.0/-1", "10.0.0.0/8/8"] {
            assert!(network(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn forwarded_headers_are_believed_from_trusted_proxies_only() {
        let lines =
            [("x-forwarded-for", "192.0.2.9"), ("x-forwarded-proto", "https"), ("x-forwarded-host", "gait.example")];
        let x = ProxyHeaders::XForwarded;
        assert_eq!(believed("127.0.0.1", x, &lines), ("192.0.2.9".into(), Some(true), "gait.example".into()));
        assert_eq!(believed("192.0.2.7", x, &lines), ("192.0.2.7".into(), None, String::new()));
        // The client wrote the other kind of header.
        assert_eq!(believed("127.0.0.1", ProxyHeaders::Forwarded, &lines), ("127.0.0.1".into(), None, String::new()));
        let other = [("forwarded", "for=192.0.2.9;proto=https")];
        assert_eq!(believed("127.0.0.1", x, &other), ("127.0.0.1".into(), None, String::new()));
    }

    #[test]
    fn clients_cannot_forge_hops() {
        let x = ProxyHeaders::XForwarded;
        let forged = [
            ("x-forwarded-for", "127.0.0.1, 10.1.0.9"),
            ("x-forwarded-for", "192.0.2.9, 10.1.2.3"),
            ("x-forwarded-proto", "http, http, https, http"),
        ];
        assert_eq!(believed("127.0.0.1", x, &forged), ("192.0.2.9".into(), Some(true), String::new()));
        let forged =
            [("forwarded", "for=10.1.0.9;proto=http;host=evil, For=\"[2001:db8::7]:47\";Proto=HTTPS;host=\"a,b:1\"")];
        let expected = ("2001:db8::7".into(), Some(true), "a,b:1".into());
        assert_eq!(believed("fd00::1", ProxyHeaders::Forwarded, &forged), expected);
    }

    #[test]
    fn hidden_client_counts_as_the_proxy() {
        let proxy = ("127.0.0.1".to_owned(), Some(true), String::new());
        for hidden in ["unknown", "Unknown:4711", "_hidden", "_SEVKISEK", "_a.b-c:_port"] {
            let line = format!("for=192.0.2.9, for=\"{hidden}\";proto=https");
            assert_eq!(believed("127.0.0.1", ProxyHeaders::Forwarded, &[("forwarded", &line)]), proxy, "{hidden}");
            let lines = [("x-forwarded-for", &*format!("192.0.2.9, {hidden}")), ("x-forwarded-proto", "https")];
            assert_eq!(believed("127.0.0.1", ProxyHeaders::XForwarded, &lines), proxy, "{hidden}");
        }
        // The nearest of two trusted proxies is known, its client is not.
        let line = [("forwarded", "for=192.0.2.9, for=unknown, for=\"10.1.2.3:_hidden\"")];
        assert_eq!(believed("127.0.0.1", ProxyHeaders::Forwarded, &line).0, "10.1.2.3");
    }

    #[test]
    fn quote_of_a_client_does_not_swallow_the_hop_of_the_proxy() {
        for start in ["for=192.0.2.1;x=\"", "for=192.0.2.1;x=\"\\\"", "for=192.0.2.1;x=\"\\"] {
            for hop in ["for=203.0.113.9", "for=\"[2001:db8::7]\""] {
                let lines = [("forwarded", &*format!("{start}, {hop}"))];
                let found = proxies(ProxyHeaders::Forwarded).believe("127.0.0.1".parse().unwrap(), &headers(&lines));
                assert!(found.is_err(), "{lines:?}: {found:?}");
            }
        }
        let lines = [("forwarded", "for=192.0.2.1;x=\"a\\\", b\", for=203.0.113.9")];
        assert_eq!(believed("127.0.0.1", ProxyHeaders::Forwarded, &lines).0, "203.0.113.9");
    }

    #[test]
    fn empty_hop_counts_as_the_proxy() {
        let proxy = ("127.0.0.1".to_owned(), None, String::new());
        for line in ["6.6.6.6,", "6.6.6.6, ", "6.6.6.6,,", "6.6.6.6, \t", ""] {
            let lines = [("x-forwarded-for", line)];
            assert_eq!(believed("127.0.0.1", ProxyHeaders::XForwarded, &lines), proxy, "{line:?}");
            let line = line.replace("6.6.6.6", "for=6.6.6.6;proto=https;host=evil");
            assert_eq!(believed("127.0.0.1", ProxyHeaders::Forwarded, &[("forwarded", &line)]), proxy, "{line:?}");
        }
        let lines = [("x-forwarded-for", "6.6.6.6"), ("x-forwarded-for", ""), ("x-forwarded-proto", "https,")];
        assert_eq!(believed("127.0.0.1", ProxyHeaders::XForwarded, &lines), proxy);
        let lines = [("x-forwarded-for", "6.6.6.6,, 192.0.2.9"), ("x-forwarded-proto", "http, https")];
        let client = ("192.0.2.9".to_owned(), Some(true), String::new());
        assert_eq!(believed("127.0.0.1", ProxyHeaders::XForwarded, &lines), client);
    }

    #[test]
    fn repeated_parameter_of_a_hop_is_refused() {
        for line in [
            "for=6.6.6.6;for=192.0.2.9",
            "for=192.0.2.9;FOR=192.0.2.9",
            "for=192.0.2.9;proto=http;proto=https",
            "for=192.0.2.9;host=a;Host=b",
            "for=192.0.2.9;by=a; by=b",
        ] {
            let lines = [("forwarded", line)];
            let found = proxies(ProxyHeaders::Forwarded).believe("127.0.0.1".parse().unwrap(), &headers(&lines));
            assert!(found.is_err(), "{line}: {found:?}");
        }
    }

    #[test]
    fn malformed_headers_of_trusted_proxies_are_refused() {
        for lines in [
            [("x-forwarded-for", "somebody")],
            [("x-forwarded-for", "_")],
            [("x-forwarded-for", "unknown:port")],
            [("x-forwarded-proto", "gopher")],
        ] {
            let refused = proxies(ProxyHeaders::XForwarded).believe("127.0.0.1".parse().unwrap(), &headers(&lines));
            assert!(refused.is_err(), "{lines:?}");
        }
    }
}
