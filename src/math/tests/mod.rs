//! Tests of the elementary functions as a family.

mod accuracy;
mod agreement;
mod arguments;
mod functions;
mod reference;
mod special_values;
