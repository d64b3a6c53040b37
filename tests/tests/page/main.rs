//! The live page and the editor in a real browser: each module is one side of them.

mod beside;
mod contrast;
mod demo;
mod devices;
mod editor;
mod exports;
mod keys;
mod live;
mod login;
mod people;
mod pictures;
mod recordings;
mod screens;
mod tutorial;
mod view;
