//! Consistency checks of a nonlinear program: sparsity patterns and bounds.

use crate::nonlinear_program::SparsityPattern;
use crate::status::NlpError;

/// Checks size, column starts and row indices of a pattern, and that a lower triangle is one.
pub(crate) fn check_pattern(
    name: &str,
    pattern: &SparsityPattern,
    rows: usize,
    columns: usize,
    lower: bool,
) -> Result<(), NlpError> {
    let fail = |what: String| Err(NlpError::InvalidProblem(format!("{name} pattern: {what}")));
    if pattern.rows != rows || pattern.columns != columns {
        return fail(format!("its size is {} x {}; it must be {rows} x {columns}", pattern.rows, pattern.columns));
    }
    let starts = &pattern.column_starts;
    if starts.len() != columns + 1
        || starts.first() != Some(&0)
        || starts.last() != Some(&pattern.row_indices.len())
        || starts.windows(2).any(|s| s[0] > s[1])
    {
        return fail("column starts are not 0 = s_0 <= s_1 <= ... = number of entries".to_owned());
    }
    for j in 0..columns {
        let column = &pattern.row_indices[starts[j]..starts[j + 1]];
        if column.windows(2).any(|r| r[0] >= r[1]) {
            return fail(format!("row indices of column {j} are not ascending"));
        }
        if let Some(i) = column.last().filter(|&&i| i >= rows) {
            return fail(format!("column {j} has a row index of {i}; it must be less than {rows}"));
        }
        if lower && column.first().is_some_and(|&i| i < j) {
            return fail(format!("column {j} has an entry above the diagonal"));
        }
    }
    Ok(())
}

/// Checks that lower bounds are not above upper ones, that none is NaN and that every interval has a finite point.
pub(crate) fn check_bounds(name: &str, lower: &[f64], upper: &[f64]) -> Result<(), NlpError> {
    for (i, (l, u)) in lower.iter().zip(upper).enumerate() {
        if l.is_nan() || u.is_nan() || l > u || *l == f64::INFINITY || *u == f64::NEG_INFINITY {
            return Err(NlpError::InvalidProblem(format!(
                "the bounds of {name} {i}, {l} and {u}, admit no finite value"
            )));
        }
    }
    Ok(())
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    #[test]
    fn refused_pattern_and_bounds_are_quoted() {
        let pattern = SparsityPattern { rows: 2, columns: 1, column_starts: vec![0, 2], row_indices: vec![0, 2] };
        let error = check_pattern("Jacobian", &pattern, 2, 1, false).unwrap_err();
        let reason = "Jacobian pattern: column 0 has a row index of 2; it must be less than 2";
        assert_eq!(error, NlpError::InvalidProblem(reason.to_owned()));
        let error = check_bounds("variable", &[0.0, 1.0], &[0.0, -1.0]).unwrap_err();
        let reason = "the bounds of variable 1, 1 and -1, admit no finite value";
        assert_eq!(error, NlpError::InvalidProblem(reason.to_owned()));
    }
}
