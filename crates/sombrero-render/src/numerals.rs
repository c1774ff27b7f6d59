//! Numbers in pictures, drawn from a few squares each: no font is needed, and they are the same everywhere.

use crate::image::Image;

/// Squares across and down.
const WIDE: usize = 3;
const HIGH: usize = 5;

/// The signs of numbers, row by row from the top, three bits each with the left one first.
const SIGNS: [(char, [u8; HIGH]); 14] = [
    ('0', [0b111, 0b101, 0b101, 0b101, 0b111]),
    ('1', [0b010, 0b110, 0b010, 0b010, 0b111]),
    ('2', [0b111, 0b001, 0b111, 0b100, 0b111]),
    ('3', [0b111, 0b001, 0b111, 0b001, 0b111]),
    ('4', [0b101, 0b101, 0b111, 0b001, 0b001]),
    ('5', [0b111, 0b100, 0b111, 0b001, 0b111]),
    ('6', [0b111, 0b100, 0b111, 0b101, 0b111]),
    ('7', [0b111, 0b001, 0b010, 0b010, 0b010]),
    ('8', [0b111, 0b101, 0b111, 0b101, 0b111]),
    ('9', [0b111, 0b101, 0b111, 0b001, 0b111]),
    ('.', [0b000, 0b000, 0b000, 0b000, 0b010]),
    ('-', [0b000, 0b000, 0b111, 0b000, 0b000]),
    ('e', [0b000, 0b111, 0b101, 0b110, 0b111]),
    (' ', [0; HIGH]),
];

/// `x` in three digits, as short as that can be.
pub(crate) fn short(x: f64) -> String {
    let rounded: f64 = format!("{x:.2e}").parse().unwrap_or(x);
    let plain = format!("{}", rounded + 0.0);
    let scientific = format!("{rounded:e}");
    if plain.len() <= scientific.len().max(6) { plain } else { scientific }
}

/// How large squares can be, in pixels, so that a number of this length fits; 0 when it cannot.
pub(crate) fn fitting(text: &str, width: usize, height: usize) -> usize {
    let columns = (WIDE + 1) * text.chars().count().max(1) - 1;
    (width / columns).min(height / HIGH)
}

/// Writes a number of squares of so many pixels, around the column `middle` and from the row `top` on.
pub(crate) fn write(image: &mut Image, text: &str, square: usize, middle: usize, top: usize, color: [u8; 4]) {
    let columns = (WIDE + 1) * text.chars().count().max(1) - 1;
    let left = middle.saturating_sub(columns * square / 2);
    for (place, sign) in text.chars().enumerate() {
        let Some((_, rows)) = SIGNS.iter().find(|(known, _)| *known == sign) else { continue };
        let start = left + (WIDE + 1) * square * place;
        for (row, bits) in rows.iter().enumerate() {
            for column in (0..WIDE).filter(|column| bits >> (WIDE - 1 - column) & 1 == 1) {
                fill(image, start + column * square, top + row * square, square, color);
            }
        }
    }
}

/// Fills a square as far as it is in the picture.
fn fill(image: &mut Image, left: usize, top: usize, side: usize, color: [u8; 4]) {
    let (width, height) = (image.width as usize, image.height as usize);
    for row in top..(top + side).min(height) {
        for column in left..(left + side).min(width) {
            let at = 4 * (row * width + column);
            image.rgba[at..at + 4].copy_from_slice(&color);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_short() {
        for (x, text) in [
            (0.0, "0"),
            (-0.0, "0"),
            (0.012_345, "0.0123"),
            (1.0 / 3.0, "0.333"),
            (-2.5, "-2.5"),
            (123_456.0, "123000"),
            (1.234_5e-7, "1.23e-7"),
            (6.02e23, "6.02e23"),
        ] {
            assert_eq!(short(x), text);
        }
    }

    #[test]
    fn a_number_is_drawn_where_it_is_wanted() {
        const BLACK: [u8; 4] = [0, 0, 0, 255];
        let mut image = Image::filled(20, 12, [255; 4]);
        assert_eq!((fitting("17", 14, 12), fitting("17", 13, 12), fitting("123456", 20, 9)), (2, 1, 0));
        write(&mut image, "17", 1, 10, 3, BLACK);
        let drawn: Vec<String> = (3..8)
            .map(|y| (7..14).map(|x| if image.pixel(x, y) == Some(BLACK) { '#' } else { '.' }).collect())
            .collect();
        assert_eq!(drawn, [".#..###", "##....#", ".#...#.", ".#...#.", "###..#."]);
        let dark = image.rgba.chunks(4).filter(|pixel| **pixel == BLACK).count();
        assert_eq!(dark, 8 + 7);
        // What does not fit is cut off.
        write(&mut image, "888", 9, 19, 9, BLACK);
    }
}
