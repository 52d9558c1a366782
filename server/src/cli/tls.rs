//! HTTPS without a proxy in front.

use axum_server::tls_rustls::{RustlsAcceptor, RustlsConfig};
use gaitwright_service::error::Error;
use std::path::PathBuf;
use std::sync::Arc;

/// Accepts connections with a certificate and its key, both PEM files.
pub(super) async fn acceptor(certificate: PathBuf, key: PathBuf) -> Result<RustlsAcceptor, Error> {
    // Fails only if the same provider is already installed.
    let _ = rustls::crypto::ring::default_provider().install_default();
    let name = certificate.display().to_string();
    let read = RustlsConfig::from_pem_file(certificate, key)
        .await
        .map_err(|e| Error::Malformed(format!("Cannot use the certificate {name} and its key: {e}.")))?;
    // The time limit for a request head exists for HTTP/1 only.
    let mut config = rustls::ServerConfig::clone(&read.get_inner());
    config.alpn_protocols = vec![b"http/1.1".to_vec()];
    Ok(RustlsAcceptor::new(RustlsConfig::from_config(Arc::new(config))))
}
