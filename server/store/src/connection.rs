//! The connection type of the queries.

/// A plain connection, which a [`Reader`](crate::Reader) or a [`Writer`](crate::Writer) dereferences to.
pub type Connection = sqlx::SqliteConnection;
