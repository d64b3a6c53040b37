//! The drawing code that all crates share: one SVG writer, one plot, one canvas of dots, one font, one set of palettes, one
//! way to write numbers.
//!
//! ```text
//!  still ─▶ thermogram ─▶ canvas, in its font ─▶ encode ─▶ PNG
//!                 plot ─▶ svg ──────────────────────────▶ SVG, alone or in a page
//!  below them: palette, number, text
//! ```
//!
//! | module | contents |
//! |---|---|
//! | [`number`] | conversion between counts and lengths, and round steps for a scale |
//! | [`text`] | escaping, signed numbers, times, counts |
//! | [`palette`] | colors of temperatures, of differences and of rooms |
//! | [`svg`] | the SVG writer: one element at a time, every value escaped |
//! | [`plot`] | a plot in an HTML page: axes, lines, curves and labels |
//! | [`canvas`] | a canvas of dots: rectangles and text, in RGB or palette colors |
//! | [`encode`] | PNG files of a canvas |
//! | [`still`] | one frame as an image of the present moment |
//! | [`thermogram`] | frames colored by temperature, beside their color scale |
//!
//! ```
//! use grideye_draw::svg::Svg;
//!
//! let mut svg = Svg::default();
//! svg.element("text").with("x", 3).text("colder < warmer");
//! assert_eq!(svg.finish(), "<text x=\"3\">colder &lt; warmer</text>");
//! ```
//!
//! The crate must not know scenes, recordings or files. Its canvas and font are 150 lines, because `embedded-graphics` has
//! no scalable font.

pub mod canvas;
pub mod encode;
mod font;
pub mod number;
pub mod palette;
pub mod plot;
pub mod still;
pub mod svg;
pub mod text;
pub mod thermogram;

pub use palette::Rgb;
