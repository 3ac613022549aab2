//! Images, and images that move.

/// A picture: rows of pixels from the top, each from the left.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Image {
    /// Pixels in a row.
    pub width: usize,
    /// The number of rows.
    pub height: usize,
    /// Red, green, blue in sRGB and opacity (255 is opaque; colours are not multiplied by it);
    /// `width`·`height` of them.
    pub pixels: Vec<[u8; 4]>,
}

impl Image {
    /// Whether no pixel lets anything shine through.
    pub fn is_opaque(&self) -> bool {
        self.pixels.iter().all(|pixel| pixel[3] == u8::MAX)
    }
}

/// Pictures of one size that are shown one after the other, for ever.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Animation {
    /// The pictures.
    pub frames: Vec<Image>,
    /// For how many thousandths of a second each is shown.
    pub delay: u16,
}
