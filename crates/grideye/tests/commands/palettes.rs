//! The page has a table of 256 colors of each palette; what is drawn here has each seventeenth of the same.

use grideye_draw::palette::{DIFFERENCE, INFERNO, hex};

#[test]
fn the_page_and_the_pictures_have_the_same_inferno() {
    let page = include_str!("../../../grideye-collector/assets/palettes.js");
    let table = page.split("const INFERNO").nth(1).unwrap();
    let lines = table
        .split(';')
        .next()
        .unwrap()
        .split('"')
        .skip(1)
        .step_by(2);
    let digits: String = lines.collect();
    assert_eq!(digits.len(), 6 * 256);
    for (index, color) in INFERNO.iter().enumerate() {
        let of_the_page = &digits[6 * 17 * index..][..6];
        assert_eq!(hex(*color).trim_start_matches('#'), of_the_page, "{index}");
    }
}

#[test]
fn the_page_and_the_reports_have_the_same_colors_of_differences() {
    let page = include_str!("../../../grideye-studio/assets/difference.js");
    let [low, middle, high] =
        DIFFERENCE.map(|[red, green, blue]| format!("[{red}, {green}, {blue}]"));
    let stops = format!("const STOPS = [[0, {low}], [0.5, {middle}], [1, {high}]];");
    assert!(page.contains(&stops), "{stops}");
}
