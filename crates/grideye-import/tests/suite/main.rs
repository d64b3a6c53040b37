//! Files as other people write them; `tests/peers` reads what numpy, pandas and polars write.

#[cfg(test)]
mod arrays;
#[cfg(test)]
mod bombs;
#[cfg(test)]
mod faults;
#[cfg(test)]
mod layouts;
#[cfg(test)]
mod linaige;
#[cfg(test)]
mod loggers;
#[cfg(test)]
mod support;
#[cfg(all(test, feature = "xlsx"))]
mod workbooks;
