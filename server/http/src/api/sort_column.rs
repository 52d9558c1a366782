//! The column by which a list is sorted, as text: a leading minus sorts in descending order.

/// The column, and whether it sorts in descending order. `name_of` gives the name of a column.
///
/// # Errors
/// The allowed values, if no column has the name.
pub(super) fn column_and_direction<T: Copy>(
    sort: &str,
    columns: &[T],
    name_of: fn(T) -> &'static str,
) -> Result<(T, bool), String> {
    let (descending, name) = sort.strip_prefix('-').map_or((false, sort), |name| (true, name));
    let column = columns.iter().copied().find(|column| name_of(*column) == name);
    let names = || columns.iter().map(|column| name_of(*column)).collect::<Vec<_>>().join(", ");
    let column = column.ok_or_else(|| format!("one of {}, with a leading minus for descending order", names()))?;
    Ok((column, descending))
}
