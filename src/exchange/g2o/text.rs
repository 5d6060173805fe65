//! g2o files as text, to the last digit.

use std::io::{BufRead, Write};

use super::element::{G2oElement, G2oGraph, LAYOUTS, Layout};
use crate::exchange::Error;
use crate::exchange::lines::{Lines, MOST_ELEMENTS};

/// What the comment with [`G2oGraph::point_offset`] begins with.
const OFFSET_COMMENT: &str = "# open-structure point-offset ";
/// Unknown tags that are counted each; more are counted together.
const MOST_TAGS: usize = 100;
/// The name under which further unknown tags are counted.
const OTHER_TAGS: &str = "others";

/// The elements of a g2o file, in the file's order.
///
/// Empty lines, comments, blanks at the ends of a line and either kind of line end are passed over, and so are lines
/// of tags that are not in [`super::G2oKind`]; the latter are counted in [`G2oGraph::passed_over`].
///
/// # Errors
/// [`Error::Content`] with the line for an element with too few or too many numbers, a number that is none or is not
/// finite, or a negative id; for a file without an element, with more than [`MOST_ELEMENTS`], or larger than
/// [`crate::exchange::LARGEST_FILE_BYTES`].
pub fn read_g2o(input: impl BufRead) -> Result<G2oGraph, Error> {
    let mut lines = Lines::new("", input);
    let mut graph = G2oGraph::default();
    while let Some(text) = lines.any()? {
        if text.starts_with('#') {
            let offset = text.strip_prefix(OFFSET_COMMENT).and_then(|word| word.parse().ok());
            graph.point_offset = offset.filter(|offset: &i64| *offset >= 0).unwrap_or(graph.point_offset);
            continue;
        }
        let mut fields = lines.fields_here();
        let Some(tag) = fields.word_or_end() else { continue };
        let Some(Layout { kind, ids, numbers, .. }) =
            LAYOUTS.iter().find(|layout| layout.tags.contains(&tag))
        else {
            let known = graph.passed_over.contains_key(tag) || graph.passed_over.len() < MOST_TAGS;
            let name = if known && tag.len() <= 80 { tag } else { OTHER_TAGS };
            *graph.passed_over.entry(name.to_owned()).or_default() += 1;
            continue;
        };
        let mut element = G2oElement::new(*kind, &[], Vec::with_capacity(*numbers));
        element.ids.push(fields.id("an id")?);
        if let Some(count) = ids {
            for _ in 1..*count {
                element.ids.push(fields.id("an id")?);
            }
        } else {
            while let Some(word) = fields.word_or_end() {
                let id = word.parse().ok().filter(|id: &i64| *id >= 0);
                element.ids.push(id.ok_or_else(|| fields.wrong("an id, an integer of at least 0", word))?);
            }
        }
        for place in 1..=*numbers {
            element.numbers.push(fields.number(&format!("number {place} of {numbers} of {tag}"))?);
        }
        fields.end()?;
        if graph.elements.len() == MOST_ELEMENTS {
            return Err(fields.wrong(&format!("at most {MOST_ELEMENTS} elements"), "more"));
        }
        graph.elements.push(element);
    }
    if graph.elements.is_empty() {
        let found = match graph.passed_over.keys().next() {
            None => "none".to_owned(),
            Some(tag) => format!("none, but lines that begin with `{tag}`"),
        };
        return Err(Error::content("", None, "vertices and edges of g2o", found));
    }
    Ok(graph)
}

/// Writes a g2o file that [`read_g2o`] reads to the same bits.
///
/// # Errors
/// [`Error::Io`] when the output fails.
pub fn write_g2o(output: &mut dyn Write, graph: &G2oGraph) -> Result<(), Error> {
    if graph.point_offset != 0 {
        writeln!(output, "{OFFSET_COMMENT}{}", graph.point_offset)?;
    }
    for element in &graph.elements {
        let layout = LAYOUTS.iter().find(|layout| layout.kind == element.kind);
        output.write_all(layout.map_or("", |layout| layout.tags[0]).as_bytes())?;
        for id in &element.ids {
            write!(output, " {id}")?;
        }
        for number in &element.numbers {
            write!(output, " {number:?}")?;
        }
        output.write_all(b"\n")?;
    }
    Ok(())
}
