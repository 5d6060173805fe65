//! A figure: panels in rows and columns, with a legend and letters under them, at a size in millimetres.

use super::super::chart::Area;
use super::POINTS_PER_MM;
use super::bars::Bars;
use super::chart::Chart;
use super::error::PaperError;
use super::legend::{Entry, Legend};
use super::measurement_image::MeasurementImage;
use super::scene_view::SceneView;
use super::sheet::Sheet;
use super::style::{Margins, Style};
use super::theme::Theme;

/// Least width and height of what is drawn in a panel, points.
const LEAST: f64 = 18.0;
/// From the border of the figure, points.
const BORDER: f64 = 1.5;

/// At what size and in which colours a figure is drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Look {
    /// Width, millimetres.
    pub width_mm: f64,
    /// Height, millimetres; what suits the figure where none is given.
    pub height_mm: Option<f64>,
    /// Size of names and legends, points; numbers at axes have seven eighths of it.
    pub font_pt: f64,
    /// Colours.
    pub theme: Theme,
}

impl Look {
    /// A column of a journal of the IEEE, 3.5 inches; millimetres.
    pub const IEEE_COLUMN_MM: f64 = 88.9;
    /// A page of two columns of such a journal, millimetres.
    pub const IEEE_PAGE_MM: f64 = 182.0;
    /// The text of Springer's Lecture Notes in Computer Science, millimetres.
    pub const LNCS_TEXT_MM: f64 = 122.0;
    /// Size of text in figures, points.
    pub const FONT_PT: f64 = 8.0;
}

impl Default for Look {
    fn default() -> Self {
        Self { width_mm: Self::IEEE_COLUMN_MM, height_mm: None, font_pt: Self::FONT_PT, theme: Theme::Light }
    }
}

/// What a panel shows.
#[derive(Clone, Debug, PartialEq)]
pub enum Content {
    /// Curves.
    Chart(Chart),
    /// Bars.
    Bars(Bars),
    /// A scene with the camera's path.
    Scene(Box<SceneView>),
    /// What a frame shows.
    Image(MeasurementImage),
}

/// A panel of a figure.
#[derive(Clone, Debug, PartialEq)]
pub struct Panel {
    /// What stands under it after its letter, in a figure of several such panels.
    pub caption: Option<String>,
    /// What it shows.
    pub content: Content,
}

/// A figure.
#[derive(Clone, Debug, PartialEq)]
pub struct PaperFigure {
    /// What it shows, for those who cannot see it; a paper has a caption in its place.
    pub title: String,
    /// The panels, row by row.
    pub panels: Vec<Panel>,
    /// How many stand side by side.
    pub columns: usize,
}

impl Content {
    fn has_something(&self) -> bool {
        match self {
            Self::Chart(chart) => chart.has_places(),
            Self::Bars(bars) => bars.has_bars(),
            Self::Scene(scene) => scene.has_places(),
            // An image without features says that there are none.
            Self::Image(_) => true,
        }
    }

    fn margins(&self, style: &Style, inner: [f64; 2]) -> Margins {
        match self {
            Self::Chart(chart) => chart.margins(style, inner),
            Self::Bars(bars) => bars.margins(style, inner[1]),
            Self::Scene(_) | Self::Image(_) => Margins { left: 0.5, right: 0.5, top: 0.5, bottom: 0.5 },
        }
    }

    fn height(&self, style: &Style, cell: f64, inner: f64) -> f64 {
        match self {
            Self::Chart(chart) => chart.height(style, cell, inner),
            Self::Bars(bars) => bars.height(style, cell),
            Self::Scene(scene) => scene.aspect() * inner,
            Self::Image(image) => image.aspect() * inner,
        }
    }

    fn entries(&self, style: &Style) -> Vec<Entry> {
        match self {
            Self::Chart(chart) => chart.entries(style),
            Self::Bars(bars) => bars.entries(style),
            Self::Scene(scene) => scene.entries(style),
            Self::Image(image) => image.entries(style),
        }
    }

    fn draw(&self, sheet: &mut Sheet, style: &Style, area: Area, left: f64) {
        match self {
            Self::Chart(chart) => chart.draw(sheet, style, area, left),
            Self::Bars(bars) => bars.draw(sheet, style, area, left),
            Self::Scene(scene) => scene.draw(sheet, style, area),
            Self::Image(image) => image.draw(sheet, style, area),
        }
    }
}

/// Where everything stands.
struct Layout {
    /// Left border of each column's cells, and their width.
    cells: Vec<[f64; 2]>,
    /// Room at the left and the right of each column.
    sides: Vec<[f64; 2]>,
    /// Height of each row's inner box.
    rows: Vec<f64>,
    /// Room over and under each row's inner box.
    around: Vec<[f64; 2]>,
    legends: Legends,
    top: f64,
}

/// Names over the figure, or over each panel where panels differ in them.
struct Legends {
    shared: Option<Legend>,
    own: Vec<Legend>,
}

impl PaperFigure {
    /// The figure as SVG; the same figure gives the same bytes.
    ///
    /// # Errors
    /// [`PaperError::Nothing`] where no panel has a finite number, [`PaperError::TooSmall`] where width or height leave no room.
    pub fn svg(&self, look: &Look) -> Result<String, PaperError> {
        if !self.panels.iter().any(|panel| panel.content.has_something()) {
            return Err(PaperError::Nothing { figure: self.title.clone() });
        }
        let style = Style::new(look.theme, look.font_pt);
        let columns = self.columns.clamp(1, self.panels.len());
        let layout = self.layout(&style, look, columns)?;
        let height = layout.top + layout.around.iter().flatten().chain(&layout.rows).sum::<f64>() + BORDER;
        let width = look.width_mm * POINTS_PER_MM;
        let mut sheet = Sheet::new([width, height], style.colours, &self.title);
        if let Some(legend) = &layout.legends.shared {
            legend.draw(&mut sheet, &style, [layout.cells[0][0] + layout.sides[0][0], BORDER]);
        }
        let lettered = self.panels.iter().filter(|panel| panel.caption.is_some()).count() > 1;
        let mut letter = 0;
        let mut top = layout.top;
        for (row, panels) in self.panels.chunks(columns).enumerate() {
            let [over, under] = layout.around[row];
            for (column, panel) in panels.iter().enumerate() {
                let index = row * columns + column;
                let ([cell, width], [left, right]) = (layout.cells[column], layout.sides[column]);
                let area = Area {
                    left: cell + left,
                    top: top + over,
                    width: width - left - right,
                    height: layout.rows[row],
                };
                sheet.panel(index);
                if let Some(legend) = layout.legends.own.get(index) {
                    let own = panel.content.margins(&style, [area.width, area.height]).top;
                    legend.draw(&mut sheet, &style, [area.left, area.top - own - legend.height(&style)]);
                }
                panel.content.draw(&mut sheet, &style, area, left);
                if let Some(caption) = panel.caption.as_ref().filter(|_| lettered) {
                    let words = format!("{} {caption}", letter_of(letter));
                    letter += 1;
                    let words = style.face.fitted(&words, style.text, width);
                    let bottom = top + over + layout.rows[row] + under - 0.6 * style.text;
                    sheet.words(
                        [area.left + 0.5 * area.width, bottom],
                        style.text,
                        "middle",
                        style.colours.ink,
                        &words,
                    );
                }
                sheet.end();
            }
            top += over + layout.rows[row] + under;
        }
        Ok(sheet.finish())
    }

    fn layout(&self, style: &Style, look: &Look, columns: usize) -> Result<Layout, PaperError> {
        let width = look.width_mm * POINTS_PER_MM - 2.0 * BORDER;
        let gap = if columns > 1 { 1.2 * style.text } else { 0.0 };
        let cell = (width - gap * (columns - 1) as f64) / columns as f64;
        let cells: Vec<[f64; 2]> =
            (0..columns).map(|column| [BORDER + (cell + gap) * column as f64, cell]).collect();
        let rows = self.panels.len().div_ceil(columns);
        let lettered = self.panels.iter().filter(|panel| panel.caption.is_some()).count() > 1;

        // Numbers at an axis depend on its length, and what they leave is its length: a few rounds settle it.
        let mut sides = vec![[0.15 * cell, 0.02 * cell]; columns];
        let mut inner = vec![0.5 * cell; rows];
        let mut around = vec![[0.0; 2]; rows];
        let mut legends = self.legends(style, cell, width);
        let mut top = 0.0;
        for _ in 0..3 {
            let widest = |column: usize, sides: &[[f64; 2]]| cell - sides[column][0] - sides[column][1];
            for row in 0..rows {
                let panels = || self.panels.iter().enumerate().skip(row * columns).take(columns);
                let heights = panels()
                    .map(|(index, panel)| panel.content.height(style, cell, widest(index % columns, &sides)));
                inner[row] = heights.fold(LEAST, f64::max);
                let own = panels().map(|(index, panel)| {
                    let margins = panel.content.margins(style, [widest(index % columns, &sides), inner[row]]);
                    let caption = if lettered && panel.caption.is_some() { 1.9 * style.text } else { 0.0 };
                    [
                        margins.top + legends.own.get(index).map_or(0.0, |legend| legend.height(style)),
                        margins.bottom + caption + 0.3 * style.text,
                    ]
                });
                around[row] =
                    own.fold([0.0; 2], |most: [f64; 2], one| [most[0].max(one[0]), most[1].max(one[1])]);
            }
            let room: f64 = legends.shared.as_ref().map_or(0.0, |legend| legend.height(style));
            top = BORDER + room;
            if let Some(height_mm) = look.height_mm {
                let fixed: f64 = top + BORDER + around.iter().flatten().sum::<f64>();
                let wanted: f64 = inner.iter().sum();
                let left = height_mm * POINTS_PER_MM - fixed;
                if left < LEAST * rows as f64 {
                    let least_mm = (fixed + LEAST * rows as f64) / POINTS_PER_MM;
                    return Err(PaperError::TooSmall {
                        what: "height",
                        least_mm: least_mm.ceil(),
                        found_mm: height_mm,
                    });
                }
                inner.iter_mut().for_each(|row| *row *= left / wanted);
            }
            for (column, side) in sides.iter_mut().enumerate() {
                let before = cell - side[0] - side[1];
                let own = self.panels.iter().enumerate().filter(|(index, _)| index % columns == column).map(
                    |(index, panel)| {
                        let margins = panel.content.margins(style, [before, inner[index / columns]]);
                        [margins.left, margins.right]
                    },
                );
                *side = own.fold([0.0; 2], |most: [f64; 2], one| [most[0].max(one[0]), most[1].max(one[1])]);
                if cell - side[0] - side[1] < LEAST {
                    let missing = LEAST - (cell - side[0] - side[1]);
                    let least_mm = look.width_mm + missing * columns as f64 / POINTS_PER_MM;
                    return Err(PaperError::TooSmall {
                        what: "width",
                        least_mm: least_mm.ceil(),
                        found_mm: look.width_mm,
                    });
                }
            }
            legends = self.legends(style, cell - sides[0][0], width - sides[0][0]);
        }
        Ok(Layout { cells, sides, rows: inner, around, legends, top })
    }

    /// Legends: one where all panels have the same names, else one over each; none of one name alone.
    fn legends(&self, style: &Style, cell: f64, width: f64) -> Legends {
        let entries: Vec<Vec<Entry>> = self.panels.iter().map(|panel| panel.content.entries(style)).collect();
        let full = entries.iter().max_by_key(|entries| entries.len()).cloned().unwrap_or_default();
        let alike = entries.iter().all(|entries| entries.iter().all(|entry| full.contains(entry)));
        if alike {
            let shared = (full.len() > 1).then(|| Legend::new(style, &full, width));
            return Legends { shared, own: Vec::new() };
        }
        Legends {
            shared: None,
            own: entries.iter().map(|entries| Legend::new(style, entries, cell)).collect(),
        }
    }
}

/// `(a)`, `(b)`, … `(z)`, `(aa)`, ….
fn letter_of(place: usize) -> String {
    let mut letters = Vec::new();
    let mut rest = place + 1;
    while rest > 0 {
        letters.push(char::from(b'a' + u8::try_from((rest - 1) % 26).unwrap_or(0)));
        rest = (rest - 1) / 26;
    }
    format!("({})", letters.iter().rev().collect::<String>())
}

#[cfg(test)]
mod tests {
    use super::super::{Curve, Drawn, Role, Scale};
    use super::*;
    use proptest::prelude::*;

    fn chart(name: &str, places: Vec<[f64; 2]>) -> Panel {
        let curve = Curve { name: name.to_owned(), role: Role::Series(0), places, drawn: Drawn::Line };
        let content = Content::Chart(Chart {
            x_name: Some("Time (s)".to_owned()),
            y_name: "APE (cm)".to_owned(),
            x: Scale::Linear,
            y: Scale::FromZero,
            same_scale: false,
            aspect: 0.4,
            colour_bar: None,
            curves: vec![curve.clone(), Curve { role: Role::Truth, ..curve }],
        });
        Panel { caption: Some("<seq> & co".to_owned()), content }
    }

    fn figure(panels: Vec<Panel>) -> PaperFigure {
        PaperFigure { title: "APE of <seq>".to_owned(), panels, columns: 2 }
    }

    #[test]
    fn letters_go_on_after_z() {
        let letters: Vec<String> = [0, 25, 26, 27, 702].map(letter_of).into();
        assert_eq!(letters, ["(a)", "(z)", "(aa)", "(ab)", "(aaa)"]);
    }

    #[test]
    fn a_height_is_kept_and_one_without_room_is_refused() {
        let panels = vec![chart("a", vec![[0.0, 1.0], [1.0, 2.0]]), chart("b", vec![[0.0, 1.0], [1.0, 3.0]])];
        let look = Look { height_mm: Some(60.0), ..Look::default() };
        let svg = figure(panels.clone()).svg(&look).unwrap();
        assert!(svg.contains("width=\"88.90mm\" height=\"60.00mm\""), "{}", &svg[..200]);
        let small = figure(panels.clone()).svg(&Look { height_mm: Some(10.0), ..look });
        assert!(matches!(small, Err(PaperError::TooSmall { what: "height", .. })), "{small:?}");
        let narrow = figure(panels).svg(&Look { width_mm: 10.0, height_mm: None, ..look });
        assert!(matches!(narrow, Err(PaperError::TooSmall { what: "width", .. })), "{narrow:?}");
    }

    #[test]
    fn without_a_finite_number_there_is_no_figure() {
        let nothing = figure(vec![chart("a", vec![[0.0, f64::NAN]])]).svg(&Look::default());
        assert!(matches!(nothing, Err(PaperError::Nothing { .. })));
        assert!(matches!(figure(Vec::new()).svg(&Look::default()), Err(PaperError::Nothing { .. })));
    }

    #[test]
    fn names_stand_once_where_panels_share_them_and_over_each_panel_where_they_differ() {
        let places = vec![[0.0, 1.0], [1.0, 2.0]];
        let shared = figure(vec![chart("one", places.clone()), chart("one", places.clone())])
            .svg(&Look::default())
            .unwrap();
        assert_eq!(shared.matches(">one<").count(), 2, "a name for the curve and one for the truth");
        let own =
            figure(vec![chart("one", places.clone()), chart("two", places)]).svg(&Look::default()).unwrap();
        assert_eq!((own.matches(">one<").count(), own.matches(">two<").count()), (2, 2));
    }

    proptest! {
        #[test]
        fn numbers_of_any_size_make_figures_of_numbers(
            places in prop::collection::vec(prop::array::uniform2(any::<f64>()), 0..6),
            values in prop::collection::vec(any::<f64>(), 6),
            scale in prop::sample::select(vec![Scale::FromZero, Scale::Linear, Scale::Whole, Scale::Logarithmic, Scale::LogarithmicFrom(1.0)]),
            same_scale in any::<bool>(),
        ) {
            let mut panels = vec![chart("a", places.clone()), chart("b", places)];
            for (panel, drawn) in panels.iter_mut().zip([Drawn::Heat(values.clone()), Drawn::Steps(values[0])]) {
                if let Content::Chart(chart) = &mut panel.content {
                    chart.curves[0].drawn = drawn;
                    (chart.y, chart.same_scale) = (scale, same_scale);
                }
            }
            if let Ok(svg) = figure(panels).svg(&Look { width_mm: 182.0, ..Look::default() }) {
                prop_assert!(!svg.contains("NaN") && !svg.contains("inf"), "{svg}");
                prop_assert!(svg.contains("&lt;seq&gt; &amp; co") && !svg.contains("<seq>"));
            }
        }
    }
}
