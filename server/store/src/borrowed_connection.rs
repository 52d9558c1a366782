//! Borrowed connections: while one is held, the store cannot compute.

use super::Writer;
use sqlx::Sqlite;
use sqlx::pool::PoolConnection;
use std::marker::PhantomData;
use std::ops::{Deref, DerefMut};

/// A resource that borrows the store until it is dropped, so that [`Store::compute`](super::Store::compute) cannot be called.
#[derive(Debug)]
pub struct Borrowed<'a, T> {
    inner: T,
    _borrow: BorrowMarker<'a>,
}

/// Has a destructor, so that the borrow lasts until the end of the scope instead of the last use.
#[derive(Debug)]
struct BorrowMarker<'a>(PhantomData<&'a ()>);

impl Drop for BorrowMarker<'_> {
    fn drop(&mut self) {}
}

/// A read-only connection, with one consistent state per statement.
pub type Reader<'a> = Borrowed<'a, PoolConnection<Sqlite>>;

/// The only writing connection, within a change.
pub type BorrowedWriter<'a> = Borrowed<'a, Writer>;

impl<T> Borrowed<'_, T> {
    pub(super) fn new(inner: T) -> Self {
        Self { inner, _borrow: BorrowMarker(PhantomData) }
    }
}

impl BorrowedWriter<'_> {
    pub(super) fn into_writer(self) -> Writer {
        let Self { inner, .. } = self;
        inner
    }
}

impl<T> Deref for Borrowed<'_, T> {
    type Target = T;

    fn deref(&self) -> &T {
        &self.inner
    }
}

impl<T> DerefMut for Borrowed<'_, T> {
    fn deref_mut(&mut self) -> &mut T {
        &mut self.inner
    }
}
