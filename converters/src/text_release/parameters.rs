//! The parameters of the run that made a sequence: `name:value` lines under a heading.

use super::parse::is_text;
use super::problem::{FileProblems, ProblemKind, excerpt};

/// A name or a value longer than this is none, bytes.
const LONGEST: usize = 256;

/// At most this many parameters are read.
const MOST: usize = 1000;

/// Reads `name:value` lines. A line that ends with its colon is a heading.
#[must_use]
pub fn parse_parameters(bytes: &[u8], problems: &mut FileProblems) -> Vec<(String, String)> {
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    if !is_text(bytes) {
        problems.note(None, ProblemKind::NotText, String::new);
        return Vec::new();
    }
    let mut parameters = Vec::new();
    let mut row = 0_u32;
    for line in bytes.split(|&byte| byte == b'\n') {
        row = row.saturating_add(1);
        let line = line.trim_ascii();
        if line.is_empty() || line.starts_with(b"#") || line.ends_with(b":") {
            continue;
        }
        let parameter = std::str::from_utf8(line).ok().and_then(|text| text.split_once(':'));
        match parameter.map(|(name, value)| (name.trim(), value.trim())) {
            Some((name, value))
                if !name.is_empty()
                    && name.len() <= LONGEST
                    && value.len() <= LONGEST
                    && parameters.len() < MOST =>
            {
                parameters.push((name.to_owned(), value.to_owned()));
            }
            _ => problems.note(Some(row), ProblemKind::MalformedParameter, || excerpt(line)),
        }
    }
    parameters
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parameters_keep_their_order_and_headings_are_passed_over() {
        let mut problems = FileProblems::new("system_parameter.txt");
        let text = b"The settings are saved in this file: \r\nframe_num_:447\r\n\npath: C:/x \nnonsense\n:3";
        let parameters = parse_parameters(text, &mut problems);
        let expected = [("frame_num_", "447"), ("path", "C:/x")];
        assert_eq!(parameters, expected.map(|(name, value)| (name.to_owned(), value.to_owned())));
        let lines: Vec<_> = problems.listed().iter().map(|problem| problem.line).collect();
        assert_eq!(lines, [Some(5), Some(6)]);
    }
}
