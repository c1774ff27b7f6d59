//! The samples of a picture.

use crate::options::RenderOptions;

/// Pixels and samples.
pub(crate) struct Grid {
    pub(crate) width: usize,
    pub(crate) height: usize,
    /// Width in pixels of the strip at the right that the colour bar takes.
    pub(crate) strip: usize,
    /// Samples along a pixel's side.
    pub(crate) side: usize,
}

impl Grid {
    pub(crate) fn new(options: &RenderOptions) -> Self {
        const MOST_SAMPLES: usize = 1 << 26;
        let width = options.width.clamp(1, 4096) as usize;
        let height = options.height.clamp(1, 4096) as usize;
        let mut side = options.supersampling.clamp(1, 4) as usize;
        while side > 1 && width * height * side * side > MOST_SAMPLES {
            side -= 1;
        }
        let has_bar = options.heat_map.as_ref().is_some_and(|map| map.bar);
        let strip = if has_bar && width >= 64 { width / 12 } else { 0 };
        Self { width, height, strip, side }
    }

    pub(crate) fn columns(&self) -> usize {
        (self.width - self.strip) * self.side
    }

    pub(crate) fn rows(&self) -> usize {
        self.height * self.side
    }
}
