//! A figure of the page: a chart, its legend, and its numbers as a table.

use maud::{Markup, PreEscaped, html};

/// Colours of estimates, and dashes for those beyond.
const COLOURS: usize = 5;
const DASHES: usize = 4;
/// Longest name in a legend, characters; the whole one stands in its tooltip.
const LONGEST_NAME: usize = 40;

/// Classes of the n-th estimate.
pub(super) fn series(place: usize) -> String {
    format!("series-{} dash-{}", place % COLOURS, place % DASHES)
}

/// What a curve's legend says: its classes and its name.
pub(super) struct Entry<'a> {
    pub(super) class: &'a str,
    pub(super) name: &'a str,
}

/// A figure.
pub(super) struct Figure<'a> {
    pub(super) title: &'a str,
    /// What is shown, with units.
    pub(super) note: &'a str,
    /// What the axis to the right counts, so that the page can mark the frame that is shown: `frame` or `seconds`.
    pub(super) cursor: Option<&'static str>,
    /// An `svg` element.
    pub(super) svg: String,
    pub(super) legend: &'a [Entry<'a>],
    /// The numbers, where they do not stand beside the figure.
    pub(super) table: Option<Table>,
}

/// A table: a header and rows of cells, the first of each naming the row.
pub(super) struct Table {
    pub(super) header: Vec<String>,
    pub(super) rows: Vec<Vec<String>>,
    /// What was left out, if anything.
    pub(super) note: Option<String>,
}

impl Figure<'_> {
    pub(super) fn markup(&self) -> Markup {
        html! {
            figure.chart-figure data-cursor=[self.cursor] {
                figcaption {
                    h4 { (self.title) }
                    p.note { (self.note) }
                    @if self.legend.len() > 1 { (legend(self.legend)) }
                }
                (PreEscaped(&self.svg))
                @if let Some(table) = &self.table {
                    (table.details("Data as a table"))
                }
            }
        }
    }
}

/// The names of curves.
pub(super) fn legend(entries: &[Entry<'_>]) -> Markup {
    html! {
        ul.legend {
            @for entry in entries {
                li { span class=(format!("swatch {}", entry.class)) {} (named(entry.name)) }
            }
        }
    }
}

/// A name, shortened where it is long.
pub(super) fn named(name: &str) -> Markup {
    if name.chars().count() <= LONGEST_NAME {
        return html! { (name) };
    }
    let short: String = name.chars().take(LONGEST_NAME - 1).chain(['…']).collect();
    html! { span title=(name) { (short) } }
}

impl Table {
    /// The table where one can open it.
    pub(super) fn details(&self, summary: &str) -> Markup {
        html! {
            details.data {
                summary { (summary) }
                (self.markup())
            }
        }
    }

    pub(super) fn markup(&self) -> Markup {
        html! {
            @if let Some(note) = &self.note { p.note { (note) } }
            div.wide tabindex="0" role="group" aria-label=(format!("Table: {}", self.header.join(", "))) {
                table {
                    thead { tr { @for cell in &self.header { th scope="col" { (cell) } } } }
                    tbody {
                        @for row in &self.rows {
                            tr {
                                @for (place, cell) in row.iter().enumerate() {
                                    @if place == 0 { th scope="row" { (cell) } } @else { td { (cell) } }
                                }
                            }
                        }
                    }
                }
            }
        }
    }
}
