//! Polygonizers: curves, meshes and roots from a field.
