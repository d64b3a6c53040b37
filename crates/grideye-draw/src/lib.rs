#![doc = include_str!("../README.md")]

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
