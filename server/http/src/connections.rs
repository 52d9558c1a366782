//! Limits open connections, in total and per address, so that file descriptors remain for the record and for other
//! clients. Above a limit, a new connection replaces the one that has been idle longest. Where none is idle, it replaces
//! one of the network that holds most, so that no number of busy clients of a few networks keeps the others out. A
//! network that already has its share is refused at once, because connections are accepted one after another.

use super::client_address::ClientAddress;
use super::trusted_proxies::Proxies;
use axum::extract::connect_info::Connected;
use axum_server::{AddrListener, Address};
use std::cmp::Reverse;
use std::collections::HashMap;
use std::io;
use std::net::SocketAddr;
use std::pin::Pin;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::task::{Context, Poll};
use std::time::{Duration, Instant};
use tokio::io::{AsyncRead, AsyncWrite, ReadBuf};
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::{OwnedSemaphorePermit, Semaphore};
use tokio_util::sync::{CancellationToken, WaitForCancellationFutureOwned};

/// Idle time after which a connection can be replaced.
const MIN_IDLE_TIME: Duration = Duration::from_millis(250);
/// Interval of the search for an idle connection while the service is full.
const IDLE_SEARCH_INTERVAL: Duration = Duration::from_millis(50);
/// Least time between two log lines about a limit.
const LOG_INTERVAL: Duration = Duration::from_secs(10);
/// File descriptors reserved for the record, backups and files.
const RESERVED: u64 = 128;
/// File descriptors that the process requests.
const WANTED: u64 = 65_536;

/// Limits of open connections.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ConnectionLimits {
    /// Largest number of open connections in total.
    pub total: usize,
    /// Per IPv4 address or /64 network of IPv6. Trusted proxies are exempt.
    pub per_address: usize,
}

impl ConnectionLimits {
    /// Raises the descriptor limit of the process, and lowers these limits to what it allows.
    #[must_use]
    pub fn within_descriptors(self) -> Self {
        let descriptors = descriptors();
        let most = if descriptors > 2 * RESERVED { descriptors - RESERVED } else { descriptors / 2 };
        Self { total: self.total.min(usize::try_from(most).unwrap_or(usize::MAX)).max(1), ..self }
    }
}

#[cfg(target_os = "linux")]
fn descriptors() -> u64 {
    use rustix::process::{Resource, Rlimit, getrlimit, setrlimit};
    let present = getrlimit(Resource::Nofile);
    let wanted = present.maximum.unwrap_or(WANTED).min(WANTED).max(present.current.unwrap_or(WANTED));
    // If the limit cannot be raised, the current one applies.
    let _ = setrlimit(Resource::Nofile, Rlimit { current: Some(wanted), maximum: present.maximum });
    getrlimit(Resource::Nofile).current.unwrap_or(WANTED)
}

#[cfg(not(target_os = "linux"))]
fn descriptors() -> u64 {
    2 * RESERVED
}

/// The remote end of a connection.
#[derive(Debug, Clone)]
pub struct Peer(SocketAddr);

impl Address for Peer {
    type Stream = HeldConnection;
    type Listener = LimitedListener;
}

impl Connected<Peer> for SocketAddr {
    fn connect_info(peer: Peer) -> Self {
        peer.0
    }
}

/// A listener that enforces the limits.
#[derive(Debug)]
pub struct LimitedListener {
    listener: TcpListener,
    connections: Arc<Connections>,
    proxies: Proxies,
}

impl LimitedListener {
    /// Wraps a non-blocking listener.
    ///
    /// # Errors
    /// If the runtime cannot use the listener.
    pub fn new(listener: std::net::TcpListener, limits: ConnectionLimits, proxies: Proxies) -> io::Result<Self> {
        let connections = Arc::new(Connections::new(limits));
        Ok(Self { listener: TcpListener::from_std(listener)?, connections, proxies })
    }
}

impl AddrListener<HeldConnection, Peer> for LimitedListener {
    async fn bind_to(address: Peer) -> io::Result<Self> {
        let listener = std::net::TcpListener::bind(address.0)?;
        listener.set_nonblocking(true)?;
        let limits = ConnectionLimits { total: usize::MAX, per_address: usize::MAX };
        Self::new(listener, limits.within_descriptors(), Proxies::default())
    }

    async fn accept_stream(&self) -> io::Result<(HeldConnection, Peer)> {
        loop {
            let (stream, peer) = self.listener.accept().await?;
            let network = (!self.proxies.trust(peer.ip())).then(|| ClientAddress::new(peer.ip()).network());
            if let Some(held) = self.connections.hold(stream, network).await {
                return Ok((held, Peer(peer)));
            }
        }
    }

    fn get_local_addr(&self) -> io::Result<Peer> {
        self.listener.local_addr().map(Peer)
    }
}

/// The open connections.
#[derive(Debug)]
struct Connections {
    limits: ConnectionLimits,
    /// Permits for descriptors. A connection returns its permit when it is closed.
    room: Arc<Semaphore>,
    begun: Instant,
    held: Mutex<ConnectionTable>,
}

#[derive(Debug, Default)]
struct ConnectionTable {
    next: u64,
    by_number: HashMap<u64, Arc<ClientConnection>>,
    by_network: HashMap<String, usize>,
    /// Closed and refused connections that are not logged yet.
    untold: (u64, u64),
    told_at: Option<Instant>,
}

/// The state of a connection.
#[derive(Debug)]
struct ClientConnection {
    /// Network of the client; `None` for a trusted proxy.
    network: Option<String>,
    /// Time of the last byte in either direction, in milliseconds since the start.
    active_at: AtomicU64,
    /// Whether the client has sent a byte.
    has_sent_request: AtomicBool,
    /// Cancelled when the connection must close.
    closing: CancellationToken,
}

impl Connections {
    fn new(limits: ConnectionLimits) -> Self {
        let room = Arc::new(Semaphore::new(limits.total.min(Semaphore::MAX_PERMITS)));
        Self { limits, room, begun: Instant::now(), held: Mutex::default() }
    }

    fn table(&self) -> MutexGuard<'_, ConnectionTable> {
        // The table is consistent between statements, so a poisoned lock is usable.
        self.held.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn milliseconds(&self) -> u64 {
        u64::try_from(self.begun.elapsed().as_millis()).unwrap_or(u64::MAX)
    }

    /// Accepts a connection; `None` if all connections that it could replace are busy.
    async fn hold(self: &Arc<Self>, stream: TcpStream, network: Option<String>) -> Option<HeldConnection> {
        if !self.make_room_for(network.as_deref()) {
            return None;
        }
        let permit = self.permit(network.as_deref()).await?;
        let connection = Arc::new(ClientConnection {
            network,
            active_at: self.milliseconds().into(),
            has_sent_request: false.into(),
            closing: CancellationToken::new(),
        });
        let number = self.table().enter(&connection);
        let closed = Box::pin(connection.closing.clone().cancelled_owned());
        Some(HeldConnection { stream, closed, number, connection, connections: Arc::clone(self), _permit: permit })
    }

    /// Makes room for a connection of a network, if necessary by closing its longest idle one. Returns whether there is
    /// room.
    fn make_room_for(&self, network: Option<&str>) -> bool {
        let Some(network) = network else { return true };
        let mut table = self.table();
        if table.count(Some(network)) < self.limits.per_address {
            return true;
        }
        let made =
            self.close_quietest(&mut table, MIN_IDLE_TIME, |connection| connection.network.as_deref() == Some(network));
        table.untold.1 += u64::from(!made);
        self.tell(&mut table);
        made
    }

    /// Waits for a permit for a connection of a network; `None` if the network has its share.
    async fn permit(&self, network: Option<&str>) -> Option<OwnedSemaphorePermit> {
        loop {
            if let Ok(permit) = Arc::clone(&self.room).try_acquire_owned() {
                return Some(permit);
            }
            if !self.close_one_for(network) {
                return None;
            }
            if let Ok(permit) = tokio::time::timeout(IDLE_SEARCH_INTERVAL, Arc::clone(&self.room).acquire_owned()).await
            {
                return permit.ok();
            }
        }
    }

    /// Closes an idle connection, or else one of the network that holds most, if it holds more than the network of the
    /// new connection will. Returns whether the new connection can wait for room.
    fn close_one_for(&self, network: Option<&str>) -> bool {
        let mut table = self.table();
        let mut closed = self.close_quietest(&mut table, MIN_IDLE_TIME, |_| true);
        if !closed && let Some(largest) = table.largest_beyond(network) {
            let of_largest = |connection: &ClientConnection| connection.network.as_ref() == Some(&largest);
            closed = self.close_quietest(&mut table, Duration::ZERO, of_largest);
        }
        let waits = closed || table.count(network) == 0 || table.is_closing();
        table.untold.1 += u64::from(!waits);
        self.tell(&mut table);
        waits
    }

    /// Closes the longest idle connection among some that have been idle for a time. Connections that never sent a byte
    /// come first.
    fn close_quietest(
        &self,
        table: &mut ConnectionTable,
        idle: Duration,
        among: impl Fn(&ClientConnection) -> bool,
    ) -> bool {
        let now = self.milliseconds();
        let quiet_since = |connection: &ClientConnection| connection.active_at.load(Ordering::Relaxed);
        let quietest = table
            .by_number
            .values()
            .filter(|connection| !connection.closing.is_cancelled() && among(connection))
            .filter(|connection| u128::from(now.saturating_sub(quiet_since(connection))) >= idle.as_millis())
            .min_by_key(|connection| (connection.has_sent_request.load(Ordering::Relaxed), quiet_since(connection)))
            .cloned();
        let Some(quietest) = quietest else { return false };
        quietest.closing.cancel();
        table.leave(quietest.network.as_deref());
        table.untold.0 += 1;
        true
    }

    fn tell(&self, table: &mut ConnectionTable) {
        let (closed, refused) = table.untold;
        if (closed, refused) == (0, 0) || table.told_at.is_some_and(|at| at.elapsed() < LOG_INTERVAL) {
            return;
        }
        let ConnectionLimits { total, per_address } = self.limits;
        let held = table.by_number.len();
        tracing::warn!(held, closed, refused, total, per_address, "too many connections; closing idle ones");
        (table.untold, table.told_at) = ((0, 0), Some(Instant::now()));
    }
}

impl ConnectionTable {
    fn enter(&mut self, connection: &Arc<ClientConnection>) -> u64 {
        let number = self.next;
        self.next += 1;
        self.by_number.insert(number, Arc::clone(connection));
        if let Some(network) = &connection.network {
            *self.by_network.entry(network.clone()).or_default() += 1;
        }
        number
    }

    /// Number of connections of a network, without those that were told to close.
    fn count(&self, network: Option<&str>) -> usize {
        network.and_then(|network| self.by_network.get(network)).copied().unwrap_or(0)
    }

    /// Whether a connection was told to close and is still open.
    fn is_closing(&self) -> bool {
        self.by_number.values().any(|connection| connection.closing.is_cancelled())
    }

    /// The network with the most connections, if it has more than the given network will have with one more.
    fn largest_beyond(&self, network: Option<&str>) -> Option<String> {
        let present = self.count(network);
        let (largest, count) = self.by_network.iter().max_by_key(|(network, count)| (**count, Reverse(*network)))?;
        (*count > present + 1).then(|| largest.clone())
    }

    fn leave(&mut self, network: Option<&str>) {
        let Some(count) = network.and_then(|network| self.by_network.get_mut(network)) else { return };
        *count = count.saturating_sub(1);
        if *count == 0
            && let Some(network) = network
        {
            self.by_network.remove(network);
        }
    }
}

/// An open connection that counts towards the limits.
#[derive(Debug)]
pub struct HeldConnection {
    stream: TcpStream,
    closed: Pin<Box<WaitForCancellationFutureOwned>>,
    number: u64,
    connection: Arc<ClientConnection>,
    connections: Arc<Connections>,
    _permit: OwnedSemaphorePermit,
}

impl HeldConnection {
    fn active(&self) {
        self.connection.active_at.store(self.connections.milliseconds(), Ordering::Relaxed);
    }
}

impl Drop for HeldConnection {
    fn drop(&mut self) {
        let mut table = self.connections.table();
        table.by_number.remove(&self.number);
        // A connection that was told to close no longer counts for its network.
        if !self.connection.closing.is_cancelled() {
            table.leave(self.connection.network.as_deref());
        }
    }
}

impl AsyncRead for HeldConnection {
    fn poll_read(mut self: Pin<&mut Self>, cx: &mut Context<'_>, buffer: &mut ReadBuf<'_>) -> Poll<io::Result<()>> {
        if self.closed.as_mut().poll(cx).is_ready() {
            return Poll::Ready(Err(io::ErrorKind::ConnectionAborted.into()));
        }
        let before = buffer.filled().len();
        let read = Pin::new(&mut self.stream).poll_read(cx, buffer);
        if buffer.filled().len() > before {
            self.connection.has_sent_request.store(true, Ordering::Relaxed);
            self.active();
        }
        read
    }
}

impl AsyncWrite for HeldConnection {
    fn poll_write(mut self: Pin<&mut Self>, cx: &mut Context<'_>, bytes: &[u8]) -> Poll<io::Result<usize>> {
        let written = Pin::new(&mut self.stream).poll_write(cx, bytes);
        if written.is_ready() {
            self.active();
        }
        written
    }

    fn poll_write_vectored(
        mut self: Pin<&mut Self>,
        cx: &mut Context<'_>,
        parts: &[io::IoSlice<'_>],
    ) -> Poll<io::Result<usize>> {
        let written = Pin::new(&mut self.stream).poll_write_vectored(cx, parts);
        if written.is_ready() {
            self.active();
        }
        written
    }

    fn is_write_vectored(&self) -> bool {
        self.stream.is_write_vectored()
    }

    fn poll_flush(mut self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.stream).poll_flush(cx)
    }

    fn poll_shutdown(mut self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.stream).poll_shutdown(cx)
    }
}
