//! PDF and PNG of a figure's SVG.

use std::sync::Arc;

use krilla::Document;
use krilla::SerializeSettings;
use krilla::geom::Size;
use krilla::metadata::Metadata;
use krilla::page::PageSettings;
use krilla_svg::{SurfaceExt as _, SvgSettings};
use resvg::tiny_skia::{Pixmap, Transform};
use resvg::usvg::{Options, Tree, fontdb};

use super::error::PaperError;
use super::face::ARIMO;

/// Units of an SVG in an inch, and points.
const UNITS_PER_INCH: f32 = 96.0;
const POINTS_PER_INCH: f32 = 72.0;
const METRES_PER_INCH: f64 = 0.0254;
/// Most pixels along a side: the width of a page at 1200 dots per inch has fewer.
const MOST_PIXELS: u32 = 12_000;

/// The drawing, with letters of the font that comes along and of no other.
fn tree(svg: &str, format: &'static str) -> Result<Tree, PaperError> {
    let mut fonts = fontdb::Database::new();
    fonts.load_font_data(ARIMO.to_vec());
    fonts.set_sans_serif_family("Arimo");
    let options = Options { font_family: "Arimo".to_owned(), fontdb: Arc::new(fonts), ..Options::default() };
    Tree::from_str(svg, &options)
        .map_err(|problem| PaperError::Render { format, problem: problem.to_string() })
}

/// A PDF of one page, as large as the figure: vectors, and text as text with the letters it needs. It has no date, so that the same
/// figure gives the same bytes.
///
/// # Errors
/// [`PaperError::Render`] where the SVG cannot be read or the PDF not be made.
pub fn pdf(svg: &str, title: &str) -> Result<Vec<u8>, PaperError> {
    let wrong = |problem: String| PaperError::Render { format: "PDF", problem };
    let tree = tree(svg, "PDF")?;
    let [width, height] =
        [tree.size().width(), tree.size().height()].map(|units| units / UNITS_PER_INCH * POINTS_PER_INCH);
    let size = Size::from_wh(width, height).ok_or_else(|| wrong(format!("{width} × {height} points")))?;
    let mut document = Document::new_with(SerializeSettings::default());
    document.set_metadata(Metadata::new().title(title.to_owned()).creator("os plot".to_owned()));
    let mut page = document.start_page_with(PageSettings::new(size));
    let mut surface = page.surface();
    surface.draw_svg(&tree, size, SvgSettings { embed_text: true, ..SvgSettings::default() });
    surface.finish();
    page.finish();
    document.finish().map_err(|problem| wrong(format!("{problem:?}")))
}

/// A PNG that says how large it is on paper.
///
/// # Errors
/// [`PaperError::TooLarge`] for more than twelve thousand pixels along a side, [`PaperError::Render`] where the PNG cannot be made.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "bounded before")]
pub fn png(svg: &str, dots_per_inch: f64) -> Result<Vec<u8>, PaperError> {
    let wrong = |problem: String| PaperError::Render { format: "PNG", problem };
    let tree = tree(svg, "PNG")?;
    let [width, height] = [tree.size().width(), tree.size().height()]
        .map(|units| (f64::from(units / UNITS_PER_INCH) * dots_per_inch).round().max(1.0));
    if ![width, height].iter().all(|pixels| *pixels <= f64::from(MOST_PIXELS)) {
        return Err(PaperError::TooLarge { width, height, most: MOST_PIXELS });
    }
    let mut pixels = Pixmap::new(width as u32, height as u32)
        .ok_or_else(|| wrong(format!("{width} × {height} pixels")))?;
    let scale =
        Transform::from_scale(width as f32 / tree.size().width(), height as f32 / tree.size().height());
    resvg::render(&tree, scale, &mut pixels.as_mut());
    // The paper is opaque, and so is every pixel.
    let colours: Vec<u8> =
        pixels.pixels().iter().flat_map(|pixel| [pixel.red(), pixel.green(), pixel.blue()]).collect();
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, width as u32, height as u32);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    let per_metre = (dots_per_inch / METRES_PER_INCH).round() as u32;
    encoder.set_pixel_dims(Some(png::PixelDimensions {
        xppu: per_metre,
        yppu: per_metre,
        unit: png::Unit::Meter,
    }));
    let mut writer = encoder.write_header().map_err(|problem| wrong(problem.to_string()))?;
    writer.write_image_data(&colours).map_err(|problem| wrong(problem.to_string()))?;
    writer.finish().map_err(|problem| wrong(problem.to_string()))?;
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::super::{Chart, Content, Curve, Drawn, Look, Panel, PaperFigure, Role, Scale};
    use super::*;

    fn drawn() -> String {
        let curve = Curve {
            name: "a".to_owned(),
            role: Role::Series(0),
            places: vec![[0.0, 1.0], [1.0, 2.0]],
            drawn: Drawn::Line,
        };
        let chart = Chart {
            x_name: Some("Time (s)".to_owned()),
            y_name: "APE (cm)".to_owned(),
            x: Scale::Linear,
            y: Scale::FromZero,
            same_scale: false,
            aspect: 0.4,
            colour_bar: None,
            curves: vec![curve],
        };
        let panels = vec![Panel { caption: None, content: Content::Chart(chart) }];
        let figure = PaperFigure { title: "t".to_owned(), panels, columns: 1 };
        figure.svg(&Look { height_mm: Some(50.8), ..Look::default() }).unwrap()
    }

    #[test]
    fn a_page_is_as_large_as_the_figure_and_the_same_every_time() {
        let one = pdf(&drawn(), "t").unwrap();
        let text = String::from_utf8_lossy(&one);
        let numbers: Vec<f64> = text
            .split("/MediaBox [")
            .nth(1)
            .unwrap()
            .split(']')
            .next()
            .unwrap()
            .split_whitespace()
            .map(|n| n.parse().unwrap())
            .collect();
        // Units of an SVG are rounded to single precision.
        assert!((numbers[2] - 252.0).abs() < 0.01 && (numbers[3] - 144.0).abs() < 0.01, "{numbers:?}");
        assert!(!text.contains("CreationDate") && !text.contains("ModDate"));
        assert_eq!(one, pdf(&drawn(), "t").unwrap());
    }

    #[test]
    fn a_png_has_the_pixels_its_dots_per_inch_ask_for_and_says_them() {
        let bytes = png(&drawn(), 300.0).unwrap();
        let mut reader = png::Decoder::new(std::io::Cursor::new(&bytes)).read_info().unwrap();
        // 3.5 by 2 inches.
        assert_eq!((reader.info().width, reader.info().height), (1050, 600));
        assert_eq!(reader.info().pixel_dims.unwrap().xppu, 11_811);
        let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
        reader.next_frame(&mut pixels).unwrap();
        assert_eq!(pixels[..3], [255, 255, 255]);
        // Letters, axes and a curve are drawn.
        assert!(pixels.chunks(3).filter(|pixel| pixel[0] < 60 && pixel[1] < 60).count() > 500);
        assert!(matches!(png(&drawn(), 1e6), Err(PaperError::TooLarge { .. })));
    }
}
