//! What could not be used, and what else people should know.

use open_structure::structure::Exclusion;
use std::collections::BTreeMap;

use crate::text_release::Problems;

/// Counts what was left out, by file and reason, and keeps remarks.
#[derive(Debug, Default)]
pub(super) struct Ledger {
    /// `(file, reason)` → how many, and the first line.
    excluded: BTreeMap<(String, String), (u64, Option<u64>)>,
    notes: Vec<String>,
}

impl Ledger {
    /// Counts one thing that was left out.
    pub(super) fn exclude(&mut self, file: &str, reason: &str, line: Option<u32>) {
        self.exclude_many(file, reason, 1, line);
    }

    /// Counts several things that were left out; `line` is that of the first.
    pub(super) fn exclude_many(&mut self, file: &str, reason: &str, count: u64, line: Option<u32>) {
        if count == 0 {
            return;
        }
        let entry = self.excluded.entry((file.to_owned(), reason.to_owned())).or_insert((0, None));
        entry.0 += count;
        let line = line.map(u64::from);
        entry.1 = entry.1.into_iter().chain(line).min();
    }

    /// Keeps a remark.
    pub(super) fn note(&mut self, remark: String) {
        self.notes.push(remark);
    }

    /// Takes over what the reader told: losses are left out, the rest are remarks.
    pub(super) fn take_problems(&mut self, problems: &Problems) {
        for count in problems.counts() {
            let of_kind =
                || problems.listed().iter().filter(|p| p.file == count.file && p.kind.name() == count.kind);
            let line = of_kind().filter_map(|problem| problem.line).min();
            let reason =
                of_kind().next().map_or_else(|| count.kind.to_owned(), |first| first.kind.to_string());
            if count.is_loss {
                // Kinds with numbers in their words (`expected 4 fields, found 3`) are one reason each file.
                self.exclude_many(&count.file, &format!("{}: {reason}", count.kind), count.count, line);
            } else {
                let at = line.map_or_else(String::new, |line| format!(":{line}"));
                let times = if count.count > 1 { format!(" ({} times)", count.count) } else { String::new() };
                self.note(format!("{}{at}: {reason}{times}", count.file));
            }
        }
    }

    /// Takes over what another ledger counted.
    pub(super) fn take(&mut self, other: Self) {
        for ((file, reason), (count, line)) in other.excluded {
            let entry = self.excluded.entry((file, reason)).or_insert((0, None));
            entry.0 += count;
            entry.1 = entry.1.into_iter().chain(line).min();
        }
        self.notes.extend(other.notes);
    }

    /// What was left out, sorted by file and reason, and the remarks.
    pub(super) fn finish(self) -> (Vec<Exclusion>, Vec<String>) {
        let excluded = self
            .excluded
            .into_iter()
            .map(|((file, reason), (count, first_line))| Exclusion { file, reason, count, first_line })
            .collect();
        (excluded, self.notes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_reason_in_one_file_is_one_entry_with_its_first_line() {
        let mut ledger = Ledger::default();
        ledger.exclude("b.txt", "x", Some(9));
        ledger.exclude("b.txt", "x", Some(4));
        ledger.exclude_many("b.txt", "x", 5, None);
        ledger.exclude("a.txt", "x", None);
        ledger.exclude_many("c.txt", "x", 0, None);
        let (excluded, notes) = ledger.finish();
        let found: Vec<_> = excluded.iter().map(|e| (e.file.as_str(), e.count, e.first_line)).collect();
        assert_eq!(found, [("a.txt", 1, None), ("b.txt", 7, Some(4))]);
        assert!(notes.is_empty());
    }
}
