//! Lists by pages: one envelope, one cursor and one limit for every list of the REST interface.

use super::AppState;
use crate::problem_details::Refusal;
use crate::query_string::{self, Pairs};
use axum::extract::FromRequestParts;
use axum::http::request::Parts;
use gaitwright_service::error::Error;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use utoipa::ToSchema;

/// Entries on a page when the request does not say how many.
pub(super) const DEFAULT_LIMIT: u32 = 200;
/// Most entries on a page.
pub(super) const MAX_LIMIT: u32 = 1000;

/// A page of a list.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct Page<T> {
    /// The entries.
    items: Vec<T>,
    /// Send it as `cursor` to get the next page; null on the last page.
    #[schema(required)]
    next: Option<String>,
}

impl<T> Page<T> {
    /// The same page with other entries.
    pub(crate) fn map<U>(self, change: impl FnMut(T) -> U) -> Page<U> {
        Page { items: self.items.into_iter().map(change).collect(), next: self.next }
    }

    /// The entries and the cursor of the next page.
    pub(crate) fn into_parts(self) -> (Vec<T>, Option<String>) {
        (self.items, self.next)
    }

    /// A page whose entries were made from those of another page.
    pub(crate) fn of_parts(items: Vec<T>, next: Option<String>) -> Self {
        Self { items, next }
    }
}

/// A text that entries of a list contain, without surrounding spaces.
#[derive(Debug, Default, Deserialize)]
#[serde(try_from = "String")]
pub(crate) struct SearchText(String);

impl SearchText {
    /// Maximum length in characters.
    const MAX_LENGTH: usize = 200;

    pub(crate) fn as_str(&self) -> &str {
        self.0.trim()
    }
}

impl TryFrom<String> for SearchText {
    type Error = String;

    fn try_from(text: String) -> Result<Self, String> {
        match text.chars().count() {
            length if length > Self::MAX_LENGTH => Err(format!("at most {} characters long", Self::MAX_LENGTH)),
            _ => Ok(Self(text)),
        }
    }
}

/// The filter of a list that has none.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Unfiltered {}

/// The page that a request asks for: `cursor` and `limit` of its query, and the rest of it as a filter, which also has the
/// order.
///
/// `K` is the key by which the list is sorted. It consists of values of an entry, never of its position: while a client
/// reads the pages, entries come and go.
#[derive(Debug)]
pub(crate) struct Paging<K, F = Unfiltered> {
    /// Key of the last entry of the previous page; `None` for the first page.
    pub(crate) after: Option<K>,
    /// Which entries.
    pub(crate) filter: F,
    limit: u32,
    list: ListFingerprint,
}

impl<K: Serialize, F> Paging<K, F> {
    /// How many entries to read: one more than the page holds tells whether there is a next page.
    pub(crate) fn to_read(&self) -> u32 {
        self.limit + 1
    }

    /// The same, with at most `most` entries on the page: those that a request can compute.
    pub(crate) fn at_most(self, most: u32) -> Self {
        Self { limit: self.limit.min(most), ..self }
    }

    /// Makes the page from its entries and, if there is a next page, the first entry of that page.
    pub(crate) fn page<T>(&self, mut rows: Vec<T>, key: impl Fn(&T) -> K) -> Result<Page<T>, Error> {
        let limit = self.limit as usize;
        let last = if rows.len() > limit { rows.get(limit - 1).map(key) } else { None };
        rows.truncate(limit);
        Ok(Page { items: rows, next: last.map(|key| self.list.cursor(&key)).transpose()? })
    }

    /// The page of a short list that was read whole, in the order of its keys.
    pub(crate) fn cut<T>(&self, rows: Vec<T>, key: impl Fn(&T) -> K) -> Result<Page<T>, Error>
    where
        K: Ord,
    {
        let ahead = rows.into_iter().skip_while(|row| self.after.as_ref().is_some_and(|after| key(row) <= *after));
        self.page(ahead.take(self.to_read() as usize).collect(), &key)
    }
}

/// Identifies a list: its path, filters and order. Every cursor begins with it, because its key has a meaning only there.
#[derive(Debug, PartialEq, Eq)]
pub(crate) struct ListFingerprint([u8; 8]);

impl ListFingerprint {
    /// A list with its filter and order.
    pub(crate) fn of(path: &str, filter: &Pairs) -> Self {
        let mut sorted: Vec<&(String, String)> = filter.iter().collect();
        sorted.sort_unstable();
        let hash = Sha256::digest(format!("{path} {sorted:?}"));
        let mut first = [0; 8];
        first.iter_mut().zip(hash).for_each(|(own, byte)| *own = byte);
        Self(first)
    }

    /// The text of a cursor: opaque, so that nobody builds one.
    pub(crate) fn cursor<K: Serialize>(&self, key: &K) -> Result<String, Error> {
        let key = serde_json::to_vec(key).map_err(|e| Error::Internal(e.to_string()))?;
        Ok(hex::encode([&self.0[..], &key].concat()))
    }

    /// The key in a cursor of this list.
    pub(crate) fn key<K: DeserializeOwned>(&self, cursor: &str) -> Result<K, Error> {
        let invalid = || Error::invalid("cursor", cursor, "the value of `next` from the previous page");
        let bytes = hex::decode(cursor).map_err(|_| invalid())?;
        let (list, key) = bytes.split_first_chunk().ok_or_else(invalid)?;
        if *list != self.0 {
            return Err(Error::CursorOfAnotherList(cursor.to_owned()));
        }
        serde_json::from_slice(key).map_err(|_| invalid())
    }
}

impl<K: DeserializeOwned, F: DeserializeOwned> Paging<K, F> {
    fn read(path: &str, query: &str) -> Result<Self, Error> {
        let (mut cursor, mut limit, mut filter) = (None, None, Vec::new());
        for (name, value) in query_string::pairs(query)? {
            let given = match name.as_str() {
                "cursor" => cursor.replace(value).is_some(),
                "limit" => limit.replace(read_limit(&value)?).is_some(),
                _ => {
                    filter.push((name, value));
                    continue;
                }
            };
            if given {
                return Err(Error::Malformed(query_string::occurs_twice(&name)));
            }
        }
        let list = ListFingerprint::of(path, &filter);
        let filter = query_string::read(&filter)?;
        let after = cursor.map(|cursor| list.key(&cursor)).transpose()?;
        Ok(Self { after, filter, limit: limit.unwrap_or(DEFAULT_LIMIT), list })
    }
}

fn read_limit(text: &str) -> Result<u32, Error> {
    let refused = || Error::invalid("limit", text, &format!("1 to {MAX_LIMIT}"));
    text.parse().ok().filter(|limit| (1..=MAX_LIMIT).contains(limit)).ok_or_else(refused)
}

impl<K: DeserializeOwned, F: DeserializeOwned> FromRequestParts<AppState> for Paging<K, F> {
    type Rejection = Refusal;

    async fn from_request_parts(parts: &mut Parts, _: &AppState) -> Result<Self, Refusal> {
        Ok(Self::read(parts.uri.path(), parts.uri.query().unwrap_or_default())?)
    }
}

#[cfg(test)]
mod tests {
    use super::{Paging, Unfiltered};
    use gaitwright_service::error::Error;
    use serde::Deserialize;
    use std::cmp::Reverse;

    type Newest = Paging<Reverse<u32>>;

    fn newest(query: &str) -> Newest {
        Newest::read("/rows", query).unwrap()
    }

    fn pages(rows: &[u32], limit: usize) -> Vec<Vec<u32>> {
        let (mut pages, mut query) = (Vec::new(), format!("limit={limit}"));
        loop {
            let page = newest(&query).cut(rows.to_vec(), |row| Reverse(*row)).unwrap();
            pages.push(page.items);
            let Some(next) = page.next else { return pages };
            query = format!("limit={limit}&cursor={next}");
        }
    }

    #[test]
    fn pages_have_every_entry_once_and_the_last_page_has_no_next() {
        assert_eq!(pages(&[5, 4, 3, 2, 1], 2), [vec![5, 4], vec![3, 2], vec![1]]);
        assert_eq!(pages(&[4, 3, 2, 1], 2), [vec![4, 3], vec![2, 1]]);
        assert_eq!(pages(&[], 1), [Vec::<u32>::new()]);
    }

    #[test]
    fn entry_deleted_between_two_pages_hides_no_other_entry() {
        let first = newest("limit=2").cut(vec![5, 4, 3, 2], |row| Reverse(*row)).unwrap();
        let second = newest(&format!("limit=2&cursor={}", first.next.unwrap()));
        assert_eq!(second.cut(vec![5, 3, 2], |row| Reverse(*row)).unwrap().items, [3, 2]);
    }

    #[test]
    fn cursor_is_valid_only_for_its_list_filters_and_order() {
        #[derive(Debug, Deserialize)]
        struct Filter {
            #[expect(dead_code, reason = "only read")]
            state: Option<String>,
            #[expect(dead_code, reason = "only read")]
            sort: Option<String>,
        }
        let read = |path: &str, query: &str| Paging::<u32, Filter>::read(path, query);
        let next = read("/rows", "limit=1&state=a&sort=b").unwrap().page(vec![1, 2], |row| *row).unwrap().next.unwrap();
        for same in ["sort=b&state=a&limit=1", "state=a&sort=b&limit=5", "state=a&sort=b"] {
            assert_eq!(read("/rows", &format!("{same}&cursor={next}")).unwrap().after, Some(1), "{same}");
        }
        for (path, query) in [
            ("/rows", "state=a"),
            ("/rows", "state=a&sort=c"),
            ("/rows", "state=c&sort=b"),
            ("/others", "state=a&sort=b"),
        ] {
            let refused = read(path, &format!("{query}&cursor={next}"));
            assert!(matches!(refused, Err(Error::CursorOfAnotherList(_))), "{path} {query}: {refused:?}");
        }
    }

    #[test]
    fn invalid_paging_parameters_are_refused() {
        for query in
            ["limit=0", "limit=1001", "limit=-1", "limit=x", "cursor=x", "cursor=22", "limit=1&limit=2", "other=1"]
        {
            assert!(Paging::<u32, Unfiltered>::read("/rows", query).is_err(), "{query}");
        }
    }
}
