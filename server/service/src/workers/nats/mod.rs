//! Workers on other machines, through a NATS broker with JetStream.
//!
//! The broker carries jobs and results and may be wiped at any time: SQLite stays the only truth. Jobs wait in a
//! work-queue stream, one message for each attempt; a worker holds its message with signs of life and loses it to
//! another one when it is silent for a third of a lease. Results wait in a second stream until the
//! service has them in its record. Iterations are reported, but not kept.

mod broker_connection;
mod engine;
mod message;
mod same_version;
mod worker;

pub use broker_connection::reach;
pub use engine::JetStream;
pub use message::{ResultMessage, Sign, SolveOrder, pack, unpack};
pub use worker::NatsWorker;
