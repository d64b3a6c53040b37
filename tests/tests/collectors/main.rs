//! Real collectors and their stores: several on one database, a store that is mistreated, metrics, and the interface by its document.

mod careless_store;
mod observability;
mod rest;
mod several;
