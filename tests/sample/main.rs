//! The samplers as the rest of the program uses them: through the `Field` trait alone.

mod convergence;
mod creases;
mod density;
mod fields;
mod floaters;
mod follow;
mod graded;
mod grid;
mod lines;
mod options;
mod paper;
mod particles;
mod poisson;
mod rays;
mod refusals;
mod statistics;
mod thinning;
mod trace;
