//! The samplers as the rest of the program uses them: through the `Field` trait alone.

mod fields;
mod floaters;
mod options;
mod particles;
mod thinning;
mod trace;
