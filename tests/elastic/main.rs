//! Solids that fall: lattices against closed forms and topology, motion against mechanics.

mod solids;
mod tetrahedra;

mod lattice;

mod motion;
