//! Bodies of bytes in the description of the REST interface.

use utoipa::ToSchema;

/// Bytes that are not text, such as a picture or an archive.
#[derive(ToSchema)]
#[schema(value_type = String, format = Binary)]
pub(crate) struct Binary(#[allow(dead_code)] Vec<u8>);
