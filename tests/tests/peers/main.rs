//! Figures and files held against programs of PyPI that do or check the same.

mod arrays;
mod characterize;
mod metrics;
mod ray_casting;
