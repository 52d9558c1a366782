//! HTTPS without a proxy in front.

use axum_server::tls_rustls::{RustlsAcceptor, RustlsConfig};
use gaitwright_service::error::Error;
use rustls::CertificateError::{Expired, ExpiredContext, NotValidYet, NotValidYetContext};
use rustls::client::WebPkiServerVerifier;
use rustls::client::danger::ServerCertVerifier;
use rustls::pki_types::pem::PemObject;
use rustls::pki_types::{CertificateDer, ServerName, UnixTime};
use rustls::{RootCertStore, crypto};
use std::path::{Path, PathBuf};
use std::sync::Arc;

const ALLOWED: &str = "Allowed: PEM files with an X.509 certificate of version 3 and its key (RSA of 2048 bits or more, P-256, P-384 or Ed25519), without a password.";

/// Accepts connections with a certificate and its key, both PEM files.
pub(super) async fn acceptor(certificate: PathBuf, key: PathBuf) -> Result<RustlsAcceptor, Error> {
    // Fails only if the same provider is already installed.
    let _ = rustls::crypto::ring::default_provider().install_default();
    let name = certificate.display().to_string();
    let read = RustlsConfig::from_pem_file(certificate, key)
        .await
        .map_err(|e| Error::Malformed(format!("Cannot use the certificate {name} and its key: {e}. {ALLOWED}")))?;
    // The time limit for a request head exists for HTTP/1 only.
    let mut config = rustls::ServerConfig::clone(&read.get_inner());
    config.alpn_protocols = vec![b"http/1.1".to_vec()];
    Ok(RustlsAcceptor::new(RustlsConfig::from_config(Arc::new(config))))
}

/// Whether browsers accept the dates of the first certificate in the file. Who issued it, and for which names, is not
/// checked.
///
/// # Errors
/// If it is expired or not valid yet, or cannot be read.
pub(super) fn valid_now(certificate: &Path) -> Result<(), Error> {
    let unusable = |reason: String| Error::Malformed(format!("The certificate {} {reason}.", certificate.display()));
    let mut chain = CertificateDer::pem_file_iter(certificate).map_err(|e| unusable(format!("cannot be read: {e}")))?;
    let first = chain.next().and_then(Result::ok).ok_or_else(|| unusable("cannot be read".to_owned()))?;
    // The certificate stands in for its issuer, because only its dates are of interest.
    let mut roots = RootCertStore::empty();
    roots.add(first.clone()).map_err(|e| unusable(format!("cannot be read: {e}")))?;
    let provider = Arc::new(crypto::ring::default_provider());
    let verifier = WebPkiServerVerifier::builder_with_provider(Arc::new(roots), provider)
        .build()
        .map_err(|e| unusable(format!("cannot be read: {e}")))?;
    let name = ServerName::try_from("localhost").map_err(|e| Error::Internal(e.to_string()))?;
    match verifier.verify_server_cert(&first, &[], &name, &[], UnixTime::now()) {
        Err(rustls::Error::InvalidCertificate(Expired | ExpiredContext { .. })) => {
            Err(unusable("has expired".to_owned()))
        }
        Err(rustls::Error::InvalidCertificate(NotValidYet | NotValidYetContext { .. })) => {
            Err(unusable("is not valid yet".to_owned()))
        }
        _ => Ok(()),
    }
}
