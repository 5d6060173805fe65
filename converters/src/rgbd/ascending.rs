//! Rows of a list in the order of their keys.

use super::list::List;
use super::{Error, Ledger};

/// A row: its key (a stamp, a number), the line where it stands, and what it says.
pub(super) type Row<T> = (i64, u64, T);

/// Rows of a list by their keys, each of which stands there once.
///
/// * `key` — what keys are, for people.
///
/// # Errors
/// [`Error::Line`] for keys that do not ascend, unless lines may be left out: then rows are sorted, and of those with one
/// key the first counts.
pub(super) fn ascending<T>(
    list: &List,
    mut rows: Vec<Row<T>>,
    key: &str,
    ledger: &mut Ledger,
) -> Result<Vec<(i64, T)>, Error> {
    if let Some(pair) = rows.windows(2).find(|pair| pair[0].0 >= pair[1].0)
        && !ledger.keeps_going()
    {
        return Err(list.wrong(pair[1].1, format!("a {key} after the one before it")));
    }
    rows.sort_by_key(|(key, line, _)| (*key, *line));
    let mut kept: Vec<(i64, T)> = Vec::with_capacity(rows.len());
    for (found, line, row) in rows {
        if kept.last().is_some_and(|(last, _)| *last == found) {
            ledger.count(&list.path, &format!("a {key} that stands there twice"), 1, Some(line));
        } else {
            kept.push((found, row));
        }
    }
    Ok(kept)
}
