//! Bodies of bytes in the description of the REST interface.

use utoipa::ToSchema;

/// Bytes that are no text: a picture, an archive.
#[derive(ToSchema)]
#[schema(value_type = String, format = Binary)]
pub(crate) struct Binary(#[allow(dead_code)] Vec<u8>);
