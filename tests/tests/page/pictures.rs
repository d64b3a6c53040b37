//! The documents' pictures are those of the present program: this test makes them and compares them with the committed ones.
//! With `GRIDEYE_PICTURES=1` it writes them instead.

use grideye_tests::live_page::Outcome;
use grideye_tests::programs::grideye;
use grideye_tests::walkthrough::are_written;
use grideye_tests::webdriver::{Browser, Failure, left_out};
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use crate::demo::Demo;

/// The page of the demonstration, and a film of its images.
const PAGE: &str = "live-page.png";
const FILM: &str = "walk.png";
const FRAMES: u32 = 40;
const STEP: Duration = Duration::from_millis(300);
const FILM_BYTES_MAX: usize = 1_000_000;
/// Of a picture with few bytes.
const COLORS: usize = 255;
/// The square of the distance up to which two colors are one of these.
const ALIKE: u32 = 100;
/// Cells of the coarse picture to each side.
const COARSE: usize = 12;
/// By how much the cells of two coarse pictures may differ on average, of 255: people walk, numbers and fonts differ.
const APART_MAX: f64 = 16.0;

/// An image of three bytes a dot.
struct Picture {
    width: usize,
    height: usize,
    rgb: Vec<u8>,
}

impl Picture {
    fn read(bytes: &[u8]) -> Result<Self, Failure> {
        let mut decoder = png::Decoder::new(std::io::Cursor::new(bytes));
        decoder.set_transformations(png::Transformations::EXPAND);
        let mut reader = decoder.read_info()?;
        let mut dots = vec![0; reader.output_buffer_size().ok_or("too large")?];
        let info = reader.next_frame(&mut dots)?;
        let channels = info.color_type.samples();
        let rgb = dots[..info.buffer_size()]
            .chunks(channels)
            .flat_map(|dot| dot[..3].to_vec())
            .collect();
        let (width, height) = (usize::try_from(info.width)?, usize::try_from(info.height)?);
        Ok(Self { width, height, rgb })
    }

    fn part(&self, [left, top, width, height]: [usize; 4]) -> Self {
        let rows = (top..top + height).flat_map(|row| {
            let from = 3 * (row * self.width + left);
            self.rgb[from..from + 3 * width].to_vec()
        });
        Self {
            width,
            height,
            rgb: rows.collect(),
        }
    }

    /// The mean brightness of the cells of a coarse grid.
    fn coarse(&self) -> Vec<f64> {
        let mut cells = vec![(0.0, 0.0); COARSE * COARSE];
        for (index, dot) in self.rgb.chunks(3).enumerate() {
            let (row, column) = (index / self.width, index % self.width);
            let cell =
                &mut cells[row * COARSE / self.height * COARSE + column * COARSE / self.width];
            cell.0 += dot.iter().map(|part| f64::from(*part)).sum::<f64>() / 3.0;
            cell.1 += 1.0;
        }
        cells.into_iter().map(|(sum, dots)| sum / dots).collect()
    }

    fn apart(&self, other: &Self) -> f64 {
        let cells = self.coarse().into_iter().zip(other.coarse());
        let mean = cells.map(|(one, other)| ((one - other).abs(), 1.0));
        let (sum, cells) = mean.fold((0.0, 0.0), |all, one| (all.0 + one.0, all.1 + one.1));
        sum / cells
    }

    /// A PNG of its most frequent colors that differ; each other one is the nearest of these.
    fn small(&self) -> Result<Vec<u8>, Failure> {
        let mut counts: HashMap<[u8; 3], usize> = HashMap::new();
        for dot in self.rgb.chunks_exact(3) {
            *counts.entry([dot[0], dot[1], dot[2]]).or_default() += 1;
        }
        let mut colors: Vec<([u8; 3], usize)> = counts.into_iter().collect();
        colors.sort_by_key(|(color, count)| (std::cmp::Reverse(*count), *color));
        let apart = |one: [u8; 3], other: [u8; 3]| -> u32 {
            let parts = one.into_iter().zip(other);
            parts
                .map(|(one, other)| u32::from(one.abs_diff(other)).pow(2))
                .sum()
        };
        let mut palette: Vec<[u8; 3]> = Vec::new();
        for (color, _) in &colors {
            let is_new = palette.iter().all(|one| apart(*one, *color) > ALIKE);
            if is_new && palette.len() < COLORS {
                palette.push(*color);
            }
        }
        let nearest =
            |color: [u8; 3]| (0..palette.len()).min_by_key(|at| apart(color, palette[*at]));
        let mut known = HashMap::new();
        for (color, _) in &colors {
            known.insert(*color, u8::try_from(nearest(*color).ok_or("no dots")?)?);
        }
        let dots = self.rgb.chunks_exact(3);
        let dots: Vec<u8> = dots.map(|dot| known[&[dot[0], dot[1], dot[2]]]).collect();
        let mut bytes = Vec::new();
        let (width, height) = (u32::try_from(self.width)?, u32::try_from(self.height)?);
        let mut encoder = png::Encoder::new(&mut bytes, width, height);
        encoder.set_color(png::ColorType::Indexed);
        encoder.set_depth(png::BitDepth::Eight);
        encoder.set_palette(palette.concat());
        encoder.set_compression(png::Compression::High);
        encoder.write_header()?.write_image_data(&dots)?;
        Ok(bytes)
    }
}

/// Six shades of red and blue and seven of green.
fn palette() -> Vec<u8> {
    let shade = |index: usize, of: usize| u8::try_from(index * 255 / (of - 1)).unwrap_or(255);
    (0..252)
        .flat_map(|index| {
            [
                shade(index / 42, 6),
                shade(index / 6 % 7, 7),
                shade(index % 6, 6),
            ]
        })
        .collect()
}

fn indexed(rgb: &[u8]) -> Vec<u8> {
    let nearest = |part: u8, of: u32| (u32::from(part) * (of - 1) + 127) / 255;
    let index = |dot: &[u8]| nearest(dot[0], 6) * 42 + nearest(dot[1], 7) * 6 + nearest(dot[2], 6);
    rgb.chunks(3)
        .map(|dot| u8::try_from(index(dot)).unwrap_or(0))
        .collect()
}

/// An animated PNG that repeats.
fn film(pictures: &[Picture]) -> Result<Vec<u8>, Failure> {
    let first = pictures.first().ok_or("no pictures")?;
    let (width, height) = (u32::try_from(first.width)?, u32::try_from(first.height)?);
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, width, height);
    encoder.set_color(png::ColorType::Indexed);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_palette(palette());
    encoder.set_compression(png::Compression::High);
    encoder.set_animated(u32::try_from(pictures.len())?, 0)?;
    encoder.set_frame_delay(u16::try_from(STEP.as_millis())?, 1000)?;
    let mut writer = encoder.write_header()?;
    for picture in pictures {
        writer.write_image_data(&indexed(&picture.rgb))?;
    }
    writer.finish()?;
    Ok(bytes)
}

fn kept(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../crates/grideye-collector")
        .join(name)
}

/// What the window shows, in few bytes.
pub(crate) fn screenshot(browser: &Browser) -> Result<Vec<u8>, Failure> {
    Picture::read(&browser.screenshot()?)?.small()
}

/// Writes a picture, or compares it with the committed one.
pub(crate) fn keep_or_compare(kept: &Path, bytes: &[u8]) -> Outcome {
    if are_written() {
        return Ok(std::fs::write(kept, bytes)?);
    }
    let [committed, now] = [std::fs::read(kept)?, bytes.to_vec()];
    let [committed, now] = [Picture::read(&committed)?, Picture::read(&now)?];
    let size = |picture: &Picture| (picture.width, picture.height);
    let name = kept.display();
    assert_eq!(size(&committed), size(&now), "{name}");
    let apart = committed.apart(&now);
    assert!(
        apart <= APART_MAX,
        "{name} is no picture of the present page: {apart:.1} apart; look at it and run this test with GRIDEYE_PICTURES=1"
    );
    Ok(())
}

#[test]
fn the_documents_show_the_present_page() -> Outcome {
    if left_out("the_documents_show_the_present_page") {
        return Ok(());
    }
    let out = tempfile::tempdir()?;
    let demo = Demo::start_as(grideye(), out.path(), &[])?;
    let browser = Browser::start()?;
    browser.open(&demo.page)?;
    browser.wait_for_text("#recorded", |text| text.contains("Open the report"))?;
    browser.wait_for_text("#beside [data-field=verdict]", |text| text == "Agrees")?;
    keep_or_compare(&kept(PAGE), &browser.screenshot()?)?;
    let corners = "const { left, top, width, height } = document.querySelector('#beside .views').getBoundingClientRect();
        return [left, top, width, height].map(Math.round)";
    let place: [usize; 4] = serde_json::from_value(browser.execute(corners)?)?;
    let mut pictures = Vec::new();
    let began = Instant::now();
    for index in 0..FRAMES {
        std::thread::sleep((index * STEP).saturating_sub(began.elapsed()));
        pictures.push(Picture::read(&browser.screenshot()?)?.part(place));
    }
    let bytes = film(&pictures)?;
    assert!(bytes.len() <= FILM_BYTES_MAX, "{} bytes", bytes.len());
    keep_or_compare(&kept(FILM), &bytes)
}

/// A picture of another page is told apart.
#[test]
fn another_picture_is_told_apart() -> Outcome {
    let page = Picture::read(&std::fs::read(kept(PAGE))?)?;
    let dark = Picture {
        rgb: page.rgb.iter().map(|part| 255 - part).collect(),
        ..Picture::read(&std::fs::read(kept(PAGE))?)?
    };
    assert!(page.apart(&dark) > APART_MAX);
    // Its lower half above its upper one.
    let mut turned = page.rgb.clone();
    turned.rotate_left(page.rgb.len() / 2);
    let turned = Picture {
        rgb: turned,
        ..dark
    };
    assert!(page.apart(&turned) > APART_MAX, "{}", page.apart(&turned));
    Ok(())
}
