//! Looking ids up, and counting those that are not there.

use std::collections::HashMap;

use super::finding::{Detail, Findings};
use super::rules::RuleId;

/// Most unknown ids that are told apart; a sequence with more has nothing right anyway.
const MOST_UNKNOWN: usize = 1 << 20;

/// Places of ids in an ascending list.
#[derive(Clone, Debug, Default)]
pub(crate) struct IdIndex {
    ids: Vec<i64>,
    /// Place of `first + i` plus one, where ids are dense; 0 for an id that is not there.
    dense: Vec<u32>,
}

impl IdIndex {
    /// An index of ascending ids, each once.
    pub(crate) fn new(ids: Vec<i64>) -> Self {
        let span = match (ids.first(), ids.last()) {
            (Some(first), Some(last)) => last.checked_sub(*first).and_then(|span| usize::try_from(span).ok()),
            _ => None,
        };
        let mut dense = Vec::new();
        if let Some(span) = span.filter(|span| *span < ids.len().saturating_mul(8).saturating_add(1024))
            && u32::try_from(ids.len()).is_ok_and(|count| count < u32::MAX)
        {
            dense = vec![0; span + 1];
            for (place, id) in (1_u32..).zip(&ids) {
                if let Ok(offset) = usize::try_from(id - ids[0]) {
                    dense[offset] = place;
                }
            }
        }
        Self { ids, dense }
    }

    /// The place of an id.
    #[inline]
    pub(crate) fn get(&self, id: i64) -> Option<usize> {
        if self.dense.is_empty() {
            return self.ids.binary_search(&id).ok();
        }
        let offset = usize::try_from(id.checked_sub(self.ids[0])?).ok()?;
        (*self.dense.get(offset)? as usize).checked_sub(1)
    }

    pub(crate) fn ids(&self) -> &[i64] {
        &self.ids
    }
}

/// Ids that are not where they should be, each with its first row and the number of its rows.
#[derive(Default)]
pub(crate) struct Unknown {
    rows: HashMap<i64, (u64, u64)>,
    others: u64,
}

impl Unknown {
    pub(crate) fn add(&mut self, id: i64, row: u64) {
        let full = self.rows.len() >= MOST_UNKNOWN;
        match self.rows.get_mut(&id) {
            Some(entry) => entry.1 += 1,
            None if full => self.others += 1,
            None => drop(self.rows.insert(id, (row, 1))),
        }
    }

    /// One finding for each id, in the order of their first rows.
    pub(crate) fn report(
        self,
        rule: RuleId,
        table: &'static str,
        word: &str,
        target: &str,
        findings: &mut Findings,
    ) {
        let mut listed: Vec<_> = self.rows.into_iter().collect();
        listed.sort_unstable_by_key(|(id, (row, _))| (*row, *id));
        for (id, (row, count)) in listed {
            findings.add_many(rule, Some(table), count, || {
                let expected = format!("{word} {id} in {target}");
                Detail::new(expected, format!("not there, named by {count} rows"))
                    .row(row)
                    .id(format!("{word} {id}"))
            });
        }
        if self.others > 0 {
            findings.add_many(rule, Some(table), self.others, || {
                Detail::new(format!("ids of {target}"), "others that are not there")
            });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_index_finds_what_is_there_and_nothing_else() {
        for ids in [vec![], vec![5], vec![0, 1, 2, 9], vec![i64::MIN, -1, 0, 7, i64::MAX]] {
            let index = IdIndex::new(ids.clone());
            for (place, id) in ids.iter().enumerate() {
                assert_eq!(index.get(*id), Some(place));
            }
            for other in [-2, 3, 8, 10, 2000, i64::MAX - 1, i64::MIN + 1] {
                assert_eq!(index.get(other), None, "{other} in {ids:?}");
            }
        }
    }
}
