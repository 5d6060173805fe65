//! What can keep a figure from being made.

/// Why there is no figure.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum PaperError {
    /// A figure without a panel, or panels without a finite number.
    #[error("{figure}: expected something to draw, found no finite number")]
    Nothing {
        /// What the figure shows.
        figure: String,
    },
    /// A size that leaves no room for what is drawn.
    #[error("{what}: expected at least {least_mm:.0} mm for this figure, found {found_mm} mm")]
    TooSmall {
        /// `width` or `height`.
        what: &'static str,
        /// What is needed, millimetres.
        least_mm: f64,
        /// What was asked for, millimetres.
        found_mm: f64,
    },
    /// A picture of more pixels than are written.
    #[error("{width} × {height} pixels: expected at most {most} along a side; a lower --dpi makes fewer")]
    TooLarge {
        /// Pixels.
        width: f64,
        /// Pixels.
        height: f64,
        /// Most pixels along a side.
        most: u32,
    },
    /// A library could not make the file of the drawing.
    #[error("{format}: {problem}")]
    Render {
        /// `PDF` or `PNG`.
        format: &'static str,
        /// What the library says.
        problem: String,
    },
}
