#![doc = include_str!("../README.md")]

pub mod canvas;
pub mod encode;
mod font;
pub mod number;
pub mod palette;
pub mod plot;
mod raster;
mod shape;
pub mod sketch;
pub mod still;
pub mod svg;
pub mod text;
pub mod thermogram;
mod vector;

pub use palette::Rgb;
