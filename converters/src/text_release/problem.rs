//! What a text release holds that cannot be used, told with file and line.

use std::fmt;

/// At most this many problems of one kind are listed for one file; all of them are counted.
pub const LISTED_PER_KIND: u64 = 100;

/// The longest excerpt of a file that a problem quotes, bytes.
const EXCERPT: usize = 60;

/// What is wrong.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub enum ProblemKind {
    /// A field that should be a number is none, or an id is no whole number. The line is left out.
    MalformedNumber,
    /// A line with too few or too many fields (the tag not counted). The line is left out.
    WrongFieldCount {
        /// How many fields such a line has.
        expected: usize,
        /// How many this one has.
        found: usize,
    },
    /// A number that is `nan`, infinite, or beyond the range of an f64. The line is left out.
    NonFinite,
    /// Lines with a tag that means nothing here, told once per tag. The lines are left out.
    UnknownTag {
        /// The tag, without its colon.
        tag: String,
        /// How many lines bear it.
        lines: u64,
    },
    /// Lines with a known tag that has no place in this kind of file, told once per tag. They are left out.
    MisplacedTag {
        /// The tag, without its colon.
        tag: &'static str,
        /// How many lines bear it.
        lines: u64,
    },
    /// A line of bare numbers in a file whose lines bear tags. The line is left out.
    BareLine,
    /// A group says that it has so many lines and lists another number of them. The listed ones are kept.
    GroupSize {
        /// What the group says.
        declared: i64,
        /// What it lists.
        listed: usize,
    },
    /// A group lists a line more than once. The group is kept as it is.
    RepeatedMember,
    /// A line is listed by more than one group. The groups are kept as they are.
    LineInSeveralGroups,
    /// An id that came before in the same block of rows. Both rows are kept, in the order of the file.
    DuplicateId,
    /// A landmark that was observed before in the same frame. Both rows are kept, in the order of the file.
    DuplicateObservation,
    /// A whole block of rows comes again with the same ids. All blocks are kept, in the order of the file.
    RepeatedBlock {
        /// The tag of the rows.
        tag: &'static str,
        /// How many rows the repeating block has.
        rows: usize,
    },
    /// A parameter without a value or a name, or too long to be one. It is left out.
    MalformedParameter,
    /// A file that is no text. It is left out.
    NotText,
    /// A file without a single usable line.
    NothingUsable,
    /// A file that plays no known part. It is left out.
    UnrecognisedFile,
    /// A file that plays a part another file has already taken. It is left out.
    RepeatedFile,
    /// A name in an archive that is absolute or climbs out of it, or is no regular file. It is left out.
    UnsafeName,
    /// An archive inside an archive. It is left out; unpack the outer one first.
    NestedArchive,
    /// A folder too deep, or one that cannot be listed. It is left out.
    UnreadFolder,
}

impl ProblemKind {
    /// How many kinds there are.
    pub(crate) const COUNT: usize = 20;

    /// A stable name for tables and JSON.
    #[must_use]
    pub fn name(&self) -> &'static str {
        NAMES[self.index()]
    }

    /// Whether something of the file is missing in what was read.
    #[must_use]
    pub fn is_loss(&self) -> bool {
        !matches!(
            self,
            Self::GroupSize { .. }
                | Self::RepeatedMember
                | Self::LineInSeveralGroups
                | Self::DuplicateId
                | Self::DuplicateObservation
                | Self::RepeatedBlock { .. }
        )
    }

    fn index(&self) -> usize {
        match self {
            Self::MalformedNumber => 0,
            Self::WrongFieldCount { .. } => 1,
            Self::NonFinite => 2,
            Self::UnknownTag { .. } => 3,
            Self::MisplacedTag { .. } => 4,
            Self::BareLine => 5,
            Self::GroupSize { .. } => 6,
            Self::RepeatedMember => 7,
            Self::LineInSeveralGroups => 8,
            Self::DuplicateId => 9,
            Self::DuplicateObservation => 10,
            Self::RepeatedBlock { .. } => 11,
            Self::MalformedParameter => 12,
            Self::NotText => 13,
            Self::NothingUsable => 14,
            Self::UnrecognisedFile => 15,
            Self::RepeatedFile => 16,
            Self::UnsafeName => 17,
            Self::NestedArchive => 18,
            Self::UnreadFolder => 19,
        }
    }
}

const NAMES: [&str; ProblemKind::COUNT] = [
    "malformed-number",
    "wrong-field-count",
    "non-finite",
    "unknown-tag",
    "misplaced-tag",
    "bare-line",
    "group-size",
    "repeated-member",
    "line-in-several-groups",
    "duplicate-id",
    "duplicate-observation",
    "repeated-block",
    "malformed-parameter",
    "not-text",
    "nothing-usable",
    "unrecognised-file",
    "repeated-file",
    "unsafe-name",
    "nested-archive",
    "unread-folder",
];

impl fmt::Display for ProblemKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::MalformedNumber => f.write_str("not a number"),
            Self::WrongFieldCount { expected, found } => {
                write!(f, "expected {expected} fields, found {found}")
            }
            Self::NonFinite => f.write_str("number is not finite"),
            Self::UnknownTag { tag, lines } => write!(f, "unknown tag `{tag}` on {lines} lines"),
            Self::MisplacedTag { tag, lines } => {
                write!(f, "tag `{tag}` does not belong here, on {lines} lines")
            }
            Self::BareLine => f.write_str("line without a tag"),
            Self::GroupSize { declared, listed } => {
                write!(f, "group declares {declared} lines and lists {listed}")
            }
            Self::RepeatedMember => f.write_str("group lists a line more than once"),
            Self::LineInSeveralGroups => f.write_str("line is in more than one group"),
            Self::DuplicateId => f.write_str("id came before"),
            Self::DuplicateObservation => f.write_str("landmark was observed before in this frame"),
            Self::RepeatedBlock { tag, rows } => {
                write!(f, "a block of {rows} `{tag}` rows repeats ids of an earlier block")
            }
            Self::MalformedParameter => f.write_str("not a parameter"),
            Self::NotText => f.write_str("file is not text"),
            Self::NothingUsable => f.write_str("file has no usable line"),
            Self::UnrecognisedFile => f.write_str("file plays no known part"),
            Self::RepeatedFile => f.write_str("another file already plays this part"),
            Self::UnsafeName => f.write_str("name is not a safe name of a regular file"),
            Self::NestedArchive => f.write_str("archive inside an archive"),
            Self::UnreadFolder => f.write_str("folder was not read"),
        }
    }
}

/// One thing that cannot be used, and where it stands.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Problem {
    /// The file, below the folder of its sequence; `archive.zip/inner.txt` inside an archive.
    pub file: String,
    /// The line, counted from 1; none for a whole file.
    pub line: Option<u32>,
    /// What is wrong.
    pub kind: ProblemKind,
    /// An excerpt of the line, or what else helps to find it. May be empty.
    pub detail: String,
}

impl fmt::Display for Problem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.file)?;
        if let Some(line) = self.line {
            write!(f, ":{line}")?;
        }
        write!(f, ": {}", self.kind)?;
        if !self.detail.is_empty() {
            write!(f, ": {}", self.detail)?;
        }
        Ok(())
    }
}

/// How many problems of one kind one file has.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ProblemCount {
    /// The file, as in [`Problem::file`].
    pub file: String,
    /// The kind, as [`ProblemKind::name`] gives it.
    pub kind: &'static str,
    /// How many lines (or files) are concerned: exact, however many are listed.
    pub count: u64,
    /// Whether what is concerned was left out, see [`ProblemKind::is_loss`].
    pub is_loss: bool,
}

/// The problems of a sequence: the first [`LISTED_PER_KIND`] of each kind and file, and all of them counted.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Problems {
    listed: Vec<Problem>,
    counts: Vec<ProblemCount>,
}

impl Problems {
    /// The listed problems, file by file in the order of reading, by line within a file.
    #[must_use]
    pub fn listed(&self) -> &[Problem] {
        &self.listed
    }

    /// The exact counts per file and kind.
    #[must_use]
    pub fn counts(&self) -> &[ProblemCount] {
        &self.counts
    }

    /// How many problems there are of the kind with this [`ProblemKind::name`].
    #[must_use]
    pub fn count_of(&self, kind: &str) -> u64 {
        self.counts.iter().filter(|count| count.kind == kind).map(|count| count.count).sum()
    }

    /// How many lines and files were left out.
    #[must_use]
    pub fn losses(&self) -> u64 {
        self.counts.iter().filter(|count| count.is_loss).map(|count| count.count).sum()
    }

    /// Whether nothing at all was found.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.counts.is_empty()
    }

    /// Takes over the problems of one file.
    pub(crate) fn add(&mut self, mut file: FileProblems) {
        // Tags are told once, at the end; sorted in, they stand where they first came up.
        file.listed.sort_by_key(|problem| problem.line);
        for (kind, (&count, &is_loss)) in file.counts.iter().zip(&file.losses).enumerate() {
            if count > 0 {
                self.counts.push(ProblemCount { file: file.file.clone(), kind: NAMES[kind], count, is_loss });
            }
        }
        self.listed.append(&mut file.listed);
    }

    /// Notes one problem of a whole file. Each comes once per file, so these are capped by kind alone; what is no longer
    /// listed is counted with the last that is.
    pub(crate) fn file(&mut self, file: &str, kind: ProblemKind, detail: String) {
        let name = kind.name();
        let before = self.listed.iter().filter(|problem| problem.kind.name() == name).count() as u64;
        let is_loss = kind.is_loss();
        if before < LISTED_PER_KIND {
            self.counts.push(ProblemCount { file: file.to_owned(), kind: name, count: 1, is_loss });
            self.listed.push(Problem { file: file.to_owned(), line: None, kind, detail });
        } else if let Some(last) = self.counts.iter_mut().rfind(|count| count.kind == name) {
            last.count += 1;
        }
    }

    /// Takes over the problems of another reading.
    pub(crate) fn append(&mut self, mut other: Self) {
        self.listed.append(&mut other.listed);
        self.counts.append(&mut other.counts);
    }
}

/// The problems of one file while it is being read.
#[derive(Debug)]
pub struct FileProblems {
    file: String,
    listed: Vec<Problem>,
    counts: [u64; ProblemKind::COUNT],
    losses: [bool; ProblemKind::COUNT],
}

impl FileProblems {
    /// An empty list for the file of this name.
    #[must_use]
    pub fn new(file: &str) -> Self {
        Self {
            file: file.to_owned(),
            listed: Vec::new(),
            counts: [0; ProblemKind::COUNT],
            losses: [false; ProblemKind::COUNT],
        }
    }

    /// How many problems were met.
    #[must_use]
    pub fn total(&self) -> u64 {
        self.counts.iter().sum()
    }

    /// The listed ones.
    #[must_use]
    pub fn listed(&self) -> &[Problem] {
        &self.listed
    }

    /// Notes one problem; the detail is made only where it will be listed.
    pub(crate) fn note(&mut self, line: Option<u32>, kind: ProblemKind, detail: impl FnOnce() -> String) {
        self.note_many(line, 1, kind, detail);
    }

    /// Notes a problem that concerns `count` lines, of which `line` is the first.
    pub(crate) fn note_many(
        &mut self,
        line: Option<u32>,
        count: u64,
        kind: ProblemKind,
        detail: impl FnOnce() -> String,
    ) {
        let index = kind.index();
        let before = self.counts[index];
        self.counts[index] += count;
        self.losses[index] = kind.is_loss();
        if before < LISTED_PER_KIND {
            self.listed.push(Problem { file: self.file.clone(), line, kind, detail: detail() });
        }
    }
}

/// The beginning of a line, fit to be printed.
pub(crate) fn excerpt(line: &[u8]) -> String {
    let shown = String::from_utf8_lossy(&line[..line.len().min(EXCERPT)]);
    let mut text: String = shown.trim().chars().map(|c| if c.is_control() { ' ' } else { c }).collect();
    if line.len() > EXCERPT {
        text.push('…');
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn problems_are_capped_and_counted() {
        let mut file = FileProblems::new("a.txt");
        for line in 1..=250 {
            file.note(Some(line), ProblemKind::NonFinite, String::new);
        }
        file.note_many(Some(3), 7, ProblemKind::UnknownTag { tag: "X".into(), lines: 7 }, String::new);
        let mut all = Problems::default();
        all.add(file);
        assert_eq!(all.listed().len(), 101);
        assert_eq!(all.listed()[3].kind.name(), "unknown-tag", "told where the tag first came up");
        assert_eq!(all.count_of("non-finite"), 250);
        assert_eq!(all.count_of("unknown-tag"), 7);
        assert_eq!(all.losses(), 257);
    }

    #[test]
    fn whole_files_are_capped_and_counted() {
        let mut all = Problems::default();
        for index in 0..150 {
            all.file(&format!("{index}.png"), ProblemKind::UnrecognisedFile, String::new());
        }
        assert_eq!(all.listed().len(), 100);
        assert_eq!(all.count_of("unrecognised-file"), 150);
    }

    #[test]
    fn an_excerpt_is_short_and_printable() {
        let shown = excerpt(&[b"\x1b[31m\0".as_slice(), &[b'x'; 500]].concat());
        assert!(shown.chars().count() <= EXCERPT + 1, "{shown}");
        assert!(!shown.chars().any(char::is_control));
    }

    #[test]
    fn a_problem_reads_like_a_compiler_message() {
        let problem = Problem {
            file: "observation.zip/association.txt".into(),
            line: Some(12),
            kind: ProblemKind::WrongFieldCount { expected: 4, found: 3 },
            detail: "MappointFrameAsso: 1 2 3".into(),
        };
        assert_eq!(
            problem.to_string(),
            "observation.zip/association.txt:12: expected 4 fields, found 3: MappointFrameAsso: 1 2 3"
        );
    }
}
