//! What the formatter makes of each construct.
