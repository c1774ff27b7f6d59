//! Pixels, pictures in a row, and PNG.

use thiserror::Error;

/// A picture of `height` rows of `width` pixels, top row first.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Image {
    /// Pixels in a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Red, green, blue and opacity of each pixel, sRGB, opacity not multiplied in; 4 × width × height bytes.
    pub rgba: Vec<u8>,
}

/// Why a picture could not be written as PNG.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum ImageError {
    /// The picture has no pixels or the wrong number of bytes.
    #[error("{width} × {height} pixels cannot be made of {bytes} bytes")]
    Size {
        /// Pixels in a row.
        width: u32,
        /// Rows.
        height: u32,
        /// Length of the pixel data.
        bytes: usize,
    },
    /// The encoder failed.
    #[error("the picture could not be encoded as PNG")]
    Encoding(#[from] png::EncodingError),
}

impl Image {
    /// A picture in one colour.
    pub fn filled(width: u32, height: u32, color: [u8; 4]) -> Self {
        Self { width, height, rgba: color.repeat(width as usize * height as usize) }
    }

    /// The pixel in column `x` from the left, row `y` from the top; `None` outside.
    pub fn pixel(&self, x: u32, y: u32) -> Option<[u8; 4]> {
        if x >= self.width || y >= self.height {
            return None;
        }
        let at = 4 * (y as usize * self.width as usize + x as usize);
        self.rgba.get(at..at + 4)?.try_into().ok()
    }

    /// The picture as the bytes of a PNG file: eight bits a channel, sRGB. The same picture gives the same bytes.
    ///
    /// # Errors
    ///
    /// When `rgba` does not have 4 × `width` × `height` bytes, or there are none.
    pub fn to_png(&self) -> Result<Vec<u8>, ImageError> {
        let expected = 4 * u64::from(self.width) * u64::from(self.height);
        if expected == 0 || self.rgba.len() as u64 != expected {
            let Self { width, height, .. } = *self;
            return Err(ImageError::Size { width, height, bytes: self.rgba.len() });
        }
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, self.width, self.height);
        encoder.set_color(png::ColorType::Rgba);
        encoder.set_depth(png::BitDepth::Eight);
        encoder.set_source_srgb(png::SrgbRenderingIntent::Perceptual);
        let mut writer = encoder.write_header()?;
        writer.write_image_data(&self.rgba)?;
        writer.finish()?;
        Ok(bytes)
    }

    /// Pictures from left to right, tops aligned, `gap` pixels of `background` between them and below shorter ones.
    pub fn beside(images: &[Self], gap: u32, background: [u8; 4]) -> Self {
        let width = total(images.iter().map(|i| i.width), gap);
        let height = images.iter().map(|i| i.height).max().unwrap_or(0);
        let mut row = Self::filled(width, height, background);
        let mut x = 0;
        for image in images {
            row.paste(image, x, 0);
            x = x.saturating_add(image.width).saturating_add(gap);
        }
        row
    }

    /// Pictures from top to bottom, left sides aligned, `gap` pixels of `background` between and beside them.
    pub fn stacked(images: &[Self], gap: u32, background: [u8; 4]) -> Self {
        let width = images.iter().map(|i| i.width).max().unwrap_or(0);
        let height = total(images.iter().map(|i| i.height), gap);
        let mut column = Self::filled(width, height, background);
        let mut y = 0;
        for image in images {
            column.paste(image, 0, y);
            y = y.saturating_add(image.height).saturating_add(gap);
        }
        column
    }

    /// Pictures in rows of `columns` (at least one), in reading order.
    pub fn grid(images: &[Self], columns: usize, gap: u32, background: [u8; 4]) -> Self {
        let rows: Vec<Self> =
            images.chunks(columns.max(1)).map(|row| Self::beside(row, gap, background)).collect();
        Self::stacked(&rows, gap, background)
    }

    fn paste(&mut self, image: &Self, x: u32, y: u32) {
        let (from, to) = (4 * image.width as usize, 4 * self.width as usize);
        if from == 0 || to == 0 {
            return;
        }
        let start = 4 * x as usize;
        let rows = self.rgba.chunks_exact_mut(to).skip(y as usize);
        for (row, source) in rows.zip(image.rgba.chunks_exact(from)) {
            if let Some(place) = row.get_mut(start..start + from) {
                place.copy_from_slice(source);
            }
        }
    }
}

/// Sum of lengths with gaps between them.
fn total(lengths: impl ExactSizeIterator<Item = u32>, gap: u32) -> u32 {
    let gaps = gap.saturating_mul(u32::try_from(lengths.len().saturating_sub(1)).unwrap_or(u32::MAX));
    lengths.fold(gaps, u32::saturating_add)
}

#[cfg(test)]
mod tests {
    use super::*;

    const RED: [u8; 4] = [255, 0, 0, 255];
    const BLUE: [u8; 4] = [0, 0, 255, 128];
    const WHITE: [u8; 4] = [255; 4];

    #[test]
    fn png_decodes_to_the_same_pixels() {
        let mut image = Image::filled(3, 2, RED);
        image.rgba[4..8].copy_from_slice(&BLUE);
        let bytes = image.to_png().unwrap();
        let mut reader = png::Decoder::new(std::io::Cursor::new(bytes)).read_info().unwrap();
        let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
        let info = reader.next_frame(&mut pixels).unwrap();
        assert_eq!((info.width, info.height, info.color_type), (3, 2, png::ColorType::Rgba));
        assert_eq!(pixels, image.rgba);
    }

    #[test]
    fn png_refuses_a_broken_picture() {
        let broken = Image { width: 2, height: 2, rgba: vec![0; 15] };
        assert!(matches!(broken.to_png(), Err(ImageError::Size { bytes: 15, .. })));
        assert!(Image::filled(0, 5, RED).to_png().is_err());
    }

    #[test]
    fn rows_columns_and_grids() {
        let (red, blue) = (Image::filled(2, 3, RED), Image::filled(1, 1, BLUE));
        let row = Image::beside(&[red.clone(), blue.clone()], 4, WHITE);
        assert_eq!((row.width, row.height), (7, 3));
        assert_eq!([row.pixel(1, 2), row.pixel(3, 0)], [Some(RED), Some(WHITE)]);
        assert_eq!([row.pixel(6, 0), row.pixel(6, 1)], [Some(BLUE), Some(WHITE)]);
        let column = Image::stacked(&[red.clone(), blue.clone()], 1, WHITE);
        assert_eq!((column.width, column.height), (2, 5));
        assert_eq!([column.pixel(0, 3), column.pixel(0, 4)], [Some(WHITE), Some(BLUE)]);
        let grid = Image::grid(&[red.clone(), blue, red], 2, 1, WHITE);
        assert_eq!((grid.width, grid.height), (4, 7));
        assert_eq!(grid.rgba.len(), 4 * 4 * 7);
    }

    #[test]
    fn nothing_and_broken_pictures_are_harmless() {
        assert_eq!(Image::beside(&[], 5, WHITE), Image::filled(0, 0, WHITE));
        assert_eq!(Image::grid(&[], 0, 5, WHITE).rgba.len(), 0);
        let broken = Image { width: 2, height: 2, rgba: vec![0; 9] };
        assert_eq!(broken.pixel(1, 1), None);
        let row = Image::beside(&[broken, Image::filled(1, 2, RED)], 0, WHITE);
        assert_eq!(row.rgba.len(), 4 * 3 * 2);
        assert_eq!(row.pixel(2, 1), Some(RED));
    }
}
