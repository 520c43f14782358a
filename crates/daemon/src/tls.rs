//! Encrypted connections, with certificates on both sides where that is wanted.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use thiserror::Error;
use tokio::net::TcpStream;
use tokio_rustls::TlsAcceptor;
use tokio_rustls::rustls::crypto::ring;
use tokio_rustls::rustls::pki_types::pem::PemObject;
use tokio_rustls::rustls::pki_types::{CertificateDer, PrivateKeyDer};
use tokio_rustls::rustls::server::{ServerConfig, WebPkiClientVerifier};
use tokio_rustls::rustls::{self, RootCertStore};

use uw_guidance::daemon::{Duplex, Encryption, Handshake};

/// Files of a TLS listener, PEM.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TlsFiles {
    /// The daemon's certificate chain.
    pub certificate: PathBuf,
    /// Its private key.
    pub key: PathBuf,
    /// Authorities whose certificates clients have to show; `None` asks for none.
    pub client_ca: Option<PathBuf>,
}

/// Why TLS cannot be offered.
#[derive(Debug, Error)]
pub enum TlsError {
    /// A file cannot be read or holds something else.
    #[error("{file}: must hold {expected} in PEM: {message}")]
    File {
        /// File name.
        file: String,
        /// What it should hold.
        expected: &'static str,
        /// What was found.
        message: String,
    },
    /// Certificate and key do not go together, or are of a kind that is not supported.
    #[error("tls: {0}")]
    Setup(String),
}

/// Makes the acceptor of a listener.
pub fn acceptor(files: &TlsFiles) -> Result<Arc<dyn Encryption>, TlsError> {
    let setup = |error: rustls::Error| TlsError::Setup(error.to_string());
    let provider = Arc::new(ring::default_provider());
    let builder = ServerConfig::builder_with_provider(Arc::clone(&provider))
        .with_safe_default_protocol_versions()
        .map_err(setup)?;
    let builder = match &files.client_ca {
        None => builder.with_no_client_auth(),
        Some(path) => {
            let mut roots = RootCertStore::empty();
            for authority in certificates(path)? {
                roots.add(authority).map_err(setup)?;
            }
            let verifier = WebPkiClientVerifier::builder_with_provider(Arc::new(roots), provider)
                .build()
                .map_err(|error| TlsError::Setup(error.to_string()))?;
            builder.with_client_cert_verifier(verifier)
        }
    };
    let key = PrivateKeyDer::from_pem_file(&files.key)
        .map_err(|error| wrong(&files.key, "a private key", error))?;
    let config = builder
        .with_single_cert(certificates(&files.certificate)?, key)
        .map_err(setup)?;
    Ok(Arc::new(Tls(TlsAcceptor::from(Arc::new(config)))))
}

/// TLS with the files of a configuration.
struct Tls(TlsAcceptor);

impl Encryption for Tls {
    fn accept(&self, plain: TcpStream) -> Handshake {
        let handshake = self.0.accept(plain);
        Box::pin(async move { Ok(Box::new(handshake.await?) as Box<dyn Duplex>) })
    }
}

fn certificates(path: &Path) -> Result<Vec<CertificateDer<'static>>, TlsError> {
    let what = "certificates";
    let found: Vec<_> = CertificateDer::pem_file_iter(path)
        .and_then(Iterator::collect)
        .map_err(|error| wrong(path, what, error))?;
    if found.is_empty() {
        return Err(wrong(path, what, "none found"));
    }
    Ok(found)
}

fn wrong(path: &Path, expected: &'static str, message: impl ToString) -> TlsError {
    TlsError::File {
        file: path.display().to_string(),
        expected,
        message: message.to_string(),
    }
}
