//! Connections as the store lends them: as long as one is held, the store is borrowed.

use super::{Store, Writer};
use sqlx::Sqlite;
use sqlx::pool::PoolConnection;
use std::marker::PhantomData;
use std::ops::{Deref, DerefMut};

/// Something of the store that is given back when it is dropped. The store is borrowed until then, so nothing is computed
/// with it: see [`Store::compute`].
#[derive(Debug)]
pub struct Lent<'a, T> {
    inner: T,
    _borrowed: Borrowed<'a>,
}

/// Has a destructor, so that the borrow lasts until the end of the scope, and not only until the last use.
#[derive(Debug)]
struct Borrowed<'a>(PhantomData<&'a Store>);

impl Drop for Borrowed<'_> {
    fn drop(&mut self) {}
}

/// A connection to read with. Sees one consistent state per statement.
pub type Reader<'a> = Lent<'a, PoolConnection<Sqlite>>;

/// The one connection that writes, with a change begun.
pub type LentWriter<'a> = Lent<'a, Writer>;

impl<T> Lent<'_, T> {
    pub(super) fn new(inner: T) -> Self {
        Self { inner, _borrowed: Borrowed(PhantomData) }
    }
}

impl LentWriter<'_> {
    pub(super) fn into_writer(self) -> Writer {
        let Self { inner, .. } = self;
        inner
    }
}

impl<T> Deref for Lent<'_, T> {
    type Target = T;

    fn deref(&self) -> &T {
        &self.inner
    }
}

impl<T> DerefMut for Lent<'_, T> {
    fn deref_mut(&mut self) -> &mut T {
        &mut self.inner
    }
}
