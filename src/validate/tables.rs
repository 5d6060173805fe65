//! What holds for every table: order, uniqueness, ids, numbers, row count, digest.

use std::collections::{BTreeMap, BTreeSet, HashSet};
use std::hash::{DefaultHasher, Hash, Hasher};
use std::sync::atomic::{AtomicU64, Ordering};

use super::finding::{Detail, Findings};
use super::rules::RuleId;
use super::source::Source;
use crate::format::Error;
use crate::structure::{ColumnSink, ContentDigest, Field, Record, TableSummary};

/// Most keys that are remembered to find one that comes twice in a table out of order.
const MOST_KEYS: usize = 1 << 24;
/// Most different message stamps that are remembered of a table.
const MOST_STAMPS: usize = 16;

/// Reports how far the work has come.
pub(crate) struct Progress<'a> {
    done: AtomicU64,
    total: u64,
    callback: Option<&'a (dyn Fn(u64, u64) + Sync)>,
}

impl<'a> Progress<'a> {
    pub(crate) fn new(total: u64, callback: Option<&'a (dyn Fn(u64, u64) + Sync)>) -> Self {
        Self { done: AtomicU64::new(0), total, callback }
    }

    fn add(&self, rows: u64) {
        let done = self.done.fetch_add(rows, Ordering::Relaxed) + rows;
        if let Some(callback) = self.callback {
            callback(done.min(self.total), self.total);
        }
    }
}

/// What the checks of all tables share.
pub(crate) struct Shared<'a> {
    pub(crate) source: Source<'a>,
    /// What the manifest promises; `None` when nothing is promised, as of a sequence in memory.
    pub(crate) summaries: Option<&'a [TableSummary]>,
    /// Tables that are there, those included that cannot be opened.
    pub(crate) present: BTreeSet<&'static str>,
    /// Tables whose columns do not fit: they are not read.
    pub(crate) skipped: BTreeSet<&'static str>,
    /// Tables with columns of a version that is not known yet: their digest covers what cannot be read.
    pub(crate) undigested: BTreeSet<&'static str>,
    pub(crate) progress: Progress<'a>,
}

impl Shared<'_> {
    /// Whether a table is there, if only as something that cannot be opened.
    pub(crate) fn has_table(&self, table: &str) -> bool {
        self.present.contains(table)
    }
}

/// What is known of a table after it was read.
#[derive(Clone, Debug, Default)]
pub(crate) struct Outcome {
    /// Rows that were read.
    pub(crate) rows: u64,
    /// Whether the table is there.
    pub(crate) there: bool,
    /// Whether the table could be read to its end.
    pub(crate) whole: bool,
    /// Whether rows come in the order of the key.
    pub(crate) ordered: bool,
    /// Stamps of the messages that held the rows, with their number.
    pub(crate) log_times: BTreeMap<u64, u64>,
}

/// Reads a table once, checks what holds for every table and hands the rows on.
///
/// `visit` is given a run of rows, the number of its first one, and the stamp of its message.
pub(crate) fn check<R: Record>(
    shared: &Shared<'_>,
    findings: &mut Findings,
    mut visit: impl FnMut(&[R], u64, Option<u64>, &mut Findings),
) -> Outcome {
    let table = R::TABLE.name;
    let mut outcome = Outcome { ordered: true, ..Outcome::default() };
    outcome.there = shared.has_table(table);
    if !shared.source.has::<R>() || shared.skipped.contains(table) {
        return outcome;
    }
    let mut last: Option<R> = None;
    let mut digest = ContentDigest::default();
    let read = shared.source.each_batch::<R>(|rows, log_time| {
        let first_row = outcome.rows;
        scan(rows, first_row, findings);
        outcome.ordered &= order(last.as_ref(), rows, first_row, findings);
        last = rows.last().cloned().or(last.take());
        if shared.summaries.is_some() {
            digest.update(rows);
        }
        if let Some(log_time) = log_time.filter(|_| !rows.is_empty())
            && (outcome.log_times.len() < MOST_STAMPS || outcome.log_times.contains_key(&log_time))
        {
            *outcome.log_times.entry(log_time).or_default() += 1;
        }
        visit(rows, first_row, log_time, findings);
        outcome.rows += rows.len() as u64;
        shared.progress.add(rows.len() as u64);
    });
    match read {
        Ok(()) => outcome.whole = true,
        Err(error) => damaged(&error, table, findings),
    }
    if outcome.whole && !outcome.ordered {
        scattered_keys::<R>(shared, findings);
    }
    let summary = shared.summaries.into_iter().flatten().find(|summary| summary.table == table);
    if let Some(summary) = summary.filter(|_| outcome.whole) {
        let digest = (!shared.undigested.contains(table)).then(|| digest.finish());
        hold(summary, outcome.rows, digest, table, findings);
    }
    outcome
}

fn hold(
    summary: &TableSummary,
    rows: u64,
    digest: Option<String>,
    table: &'static str,
    findings: &mut Findings,
) {
    if summary.rows != rows {
        findings.add(RuleId::TableRows, Some(table), || {
            Detail::new(format!("{} rows", summary.rows), format!("{rows} rows"))
        });
    }
    if let Some(digest) = digest.filter(|digest| summary.sha256 != *digest) {
        findings.add(RuleId::TableDigest, Some(table), || Detail::new(summary.sha256.clone(), digest));
    }
}

/// Turns an error of reading into a finding of the rule that it breaks.
pub(crate) fn damaged(error: &Error, table: &'static str, findings: &mut Findings) {
    let table = Some(table);
    match error {
        Error::MissingColumn { column, expected, .. } => {
            findings.add(RuleId::ColumnsPresent, table, || {
                Detail::new(format!("a column {column} of {expected}"), "no such column").id(column)
            });
        }
        Error::ColumnType { column, expected, found, .. } => {
            findings.add(RuleId::ColumnsTyped, table, || Detail::new(*expected, found.clone()).id(column));
        }
        Error::Null { row, column, .. } => {
            findings.add(RuleId::ColumnsNotNull, table, || {
                let found = format!("null in column {column}; the rows from here on are not checked");
                Detail::new("a value", found).row(*row)
            });
        }
        other => {
            findings.add(RuleId::ContainerReadable, table, || {
                Detail::new("rows that can be decoded", other.to_string())
            });
        }
    }
}

/// Checks the order of a run of rows; gives whether it holds.
pub(crate) fn order<R: Record>(
    before: Option<&R>,
    rows: &[R],
    first_row: u64,
    findings: &mut Findings,
) -> bool {
    let table = Some(R::TABLE.name);
    let mut ordered = true;
    let mut before = before;
    for (row, this) in (first_row..).zip(rows) {
        if let Some(before) = before {
            match before.compare_key(this) {
                std::cmp::Ordering::Less => {}
                std::cmp::Ordering::Equal => findings.add(RuleId::KeysUnique, table, || {
                    Detail::new("a key of its own", "the key of the row before").row(row).id(this.key_text())
                }),
                std::cmp::Ordering::Greater => {
                    ordered = false;
                    findings.add(RuleId::RowsOrdered, table, || {
                        let expected = format!("a key after {}", before.key_text());
                        Detail::new(expected, this.key_text()).row(row)
                    });
                }
            }
        }
        before = Some(this);
    }
    ordered
}

/// Finds keys that come twice in a table that is not sorted, where they need not be neighbours.
fn scattered_keys<R: Record>(shared: &Shared<'_>, findings: &mut Findings) {
    let mut seen: HashSet<(u64, u64)> = HashSet::new();
    let mut last: Option<R> = None;
    let mut row = 0_u64;
    // Whatever goes wrong here went wrong, and was said, the first time.
    let _ = shared.source.each_batch::<R>(|rows, _| {
        for this in rows {
            let repeated = last.as_ref().is_some_and(|last| last.compare_key(this).is_eq());
            if !repeated && seen.len() < MOST_KEYS {
                let key = this.key_text();
                let hash = |salt: u8| {
                    let mut hasher = DefaultHasher::new();
                    (salt, &key).hash(&mut hasher);
                    hasher.finish()
                };
                if !seen.insert((hash(0), hash(1))) {
                    findings.add(RuleId::KeysUnique, Some(R::TABLE.name), || {
                        Detail::new("a key of its own", "the key of an earlier row").row(row).id(&key)
                    });
                }
            }
            last = Some(this.clone());
            row += 1;
        }
    });
}

/// Whether a column of integers holds ids or row numbers.
fn is_id(field: &Field) -> bool {
    field.name.ends_with("_id") || field.name.ends_with("_ids") || field.name == "rows"
}

/// Looks at every number of some rows.
pub(crate) fn scan<R: Record>(rows: &[R], first_row: u64, findings: &mut Findings) {
    let mut scanner = Scanner { table: R::TABLE.name, fields: R::TABLE.fields, next: 0, first_row, findings };
    R::put(rows, &mut scanner);
}

/// Looks at every number of some rows, column by column.
struct Scanner<'a> {
    table: &'static str,
    fields: &'static [Field],
    next: usize,
    first_row: u64,
    findings: &'a mut Findings,
}

impl Scanner<'_> {
    fn field(&mut self) -> &'static Field {
        self.next += 1;
        &self.fields[self.next - 1]
    }

    fn integers(&mut self, values: impl Iterator<Item = (u64, i64)>) {
        let field = self.field();
        if !is_id(field) {
            return;
        }
        for (row, value) in values.filter(|(_, value)| *value < 0) {
            let row = self.first_row + row;
            self.findings.add(RuleId::IdsNotNegative, Some(self.table), || {
                Detail::new("0 or more", value.to_string()).row(row).id(field.name)
            });
        }
    }

    fn floats(&mut self, values: impl Iterator<Item = (u64, f64)>) {
        let field = self.field();
        for (row, value) in values.filter(|(_, value)| !value.is_finite()) {
            let row = self.first_row + row;
            self.findings.add(RuleId::ValuesFinite, Some(self.table), || {
                Detail::new("a finite number", value.to_string()).row(row).id(field.name)
            });
        }
    }
}

impl ColumnSink for Scanner<'_> {
    fn int64(&mut self, values: impl ExactSizeIterator<Item = i64>) {
        self.integers((0..).zip(values));
    }
    fn optional_int64(&mut self, values: impl ExactSizeIterator<Item = Option<i64>>) {
        self.integers((0..).zip(values).filter_map(|(row, value)| Some((row, value?))));
    }
    fn float64(&mut self, values: impl ExactSizeIterator<Item = f64>) {
        self.floats((0..).zip(values));
    }
    fn optional_float64(&mut self, values: impl ExactSizeIterator<Item = Option<f64>>) {
        self.floats((0..).zip(values).filter_map(|(row, value)| Some((row, value?))));
    }
    fn boolean(&mut self, _: impl ExactSizeIterator<Item = bool>) {
        self.field();
    }
    fn utf8<'v>(&mut self, _: impl ExactSizeIterator<Item = &'v str>) {
        self.field();
    }
    fn optional_utf8<'v>(&mut self, _: impl ExactSizeIterator<Item = Option<&'v str>>) {
        self.field();
    }
    fn optional_binary<'v>(&mut self, _: impl ExactSizeIterator<Item = Option<&'v [u8]>>) {
        self.field();
    }
    fn int64_list<I: Iterator<Item = i64>>(&mut self, values: impl ExactSizeIterator<Item = I>) {
        self.integers((0..).zip(values).flat_map(|(row, list)| list.map(move |value| (row, value))));
    }
    fn utf8_list<'v>(&mut self, _: impl ExactSizeIterator<Item = &'v [String]>) {
        self.field();
    }
    fn float64_list<'v>(&mut self, values: impl ExactSizeIterator<Item = &'v [f64]>) {
        self.floats((0..).zip(values).flat_map(|(row, list)| list.iter().map(move |value| (row, *value))));
    }
    fn optional_float64_list<'v>(&mut self, values: impl ExactSizeIterator<Item = Option<&'v [f64]>>) {
        let lists = (0..).zip(values).filter_map(|(row, list)| Some((row, list?)));
        self.floats(lists.flat_map(|(row, list)| list.iter().map(move |value| (row, *value))));
    }
}
