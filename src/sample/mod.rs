//! Samplers: points on the zero set.
