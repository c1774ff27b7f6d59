//! What becomes of attributes after they were unpacked. Of all but the exponential filter the specification asks for one unit
//! of the last place.

use super::Filter;

/// Turns what was stored into what is meant, in place.
pub(super) fn undo(filter: Filter, stride: usize, bytes: &mut [u8]) {
    match (filter, stride) {
        (Filter::Octahedral, 4) => {
            of_bytes(bytes, |v| octahedral(v.map(|c| f32::from(c as i8)), 127.0, v[3]))
        }
        (Filter::Octahedral, _) => {
            of_words(bytes, |v| octahedral(v.map(|c| f32::from(c as i16)), 32767.0, v[3]))
        }
        (Filter::Quaternion, _) => of_words(bytes, quaternion),
        (Filter::Color, 4) => of_bytes(bytes, |v| {
            let [y, co, cg, a] = v;
            color([y.into(), (co as i8).into(), (cg as i8).into(), a.into()], 255.0).map(|c| c as u8)
        }),
        (Filter::Color, _) => of_words(bytes, |v| {
            let [y, co, cg, a] = v;
            color([y.into(), (co as i16).into(), (cg as i16).into(), a.into()], 65535.0).map(|c| c as u16)
        }),
        (Filter::Exponential, _) => {
            for word in bytes.as_chunks_mut::<4>().0 {
                *word = exponential(i32::from_le_bytes(*word)).to_le_bytes();
            }
        }
        (Filter::None | Filter::Unknown, _) => {}
    }
}

fn of_bytes(bytes: &mut [u8], of: impl Fn([u8; 4]) -> [u8; 4]) {
    for element in bytes.as_chunks_mut::<4>().0 {
        *element = of(*element);
    }
}

fn of_words(bytes: &mut [u8], of: impl Fn([u16; 4]) -> [u16; 4]) {
    for element in bytes.as_chunks_mut::<8>().0 {
        let words = element.as_chunks::<2>().0;
        let new = of(std::array::from_fn(|i| words.get(i).map_or(0, |word| u16::from_le_bytes(*word))));
        for (word, new) in element.as_chunks_mut::<2>().0.iter_mut().zip(new) {
            *word = new.to_le_bytes();
        }
    }
}

/// A whole number kept in the low bits of `T`.
trait Kept {
    fn kept(value: f32) -> Self;
}

impl Kept for u8 {
    fn kept(value: f32) -> Self {
        value.round() as i8 as Self
    }
}

impl Kept for u16 {
    fn kept(value: f32) -> Self {
        value.round() as i16 as Self
    }
}

/// A direction from two coordinates on an unfolded octahedron; the third number is what stands for one, the fourth stays.
fn octahedral<T: Kept + Copy>([x, y, one, _]: [f32; 4], most: f32, last: T) -> [T; 4] {
    let [x, y] = [x / one, y / one];
    let z = 1.0 - x.abs() - y.abs();
    let fold = z.min(0.0);
    let [x, y] = [x - fold.copysign(x), y - fold.copysign(y)];
    let length = (x * x + y * y + z * z).sqrt();
    let [x, y, z] = [x, y, z].map(|c| T::kept(c / length * most));
    [x, y, z, last]
}

/// A rotation from its three smaller parts; the fourth number is what stands for one, and which part is missing.
fn quaternion(stored: [u16; 4]) -> [u16; 4] {
    let last = stored[3];
    let one = f32::from((last | 3) as i16);
    let part = |i: usize| f32::from(stored[i] as i16) / one * std::f32::consts::FRAC_1_SQRT_2;
    let [x, y, z] = [part(0), part(1), part(2)];
    let largest = (1.0 - x * x - y * y - z * z).max(0.0).sqrt();
    let at = usize::from(last & 3);
    let mut out = [0; 4];
    for (step, value) in [largest, x, y, z].into_iter().enumerate() {
        out[(at + step) % 4] = u16::kept(value * 32767.0);
    }
    out
}

/// 2^e m, e in the high byte.
fn exponential(stored: i32) -> f32 {
    let (exponent, mantissa) = (stored >> 24, stored << 8 >> 8);
    // Exact in 64 bits, whatever the exponent.
    let power = f64::from_bits(((1023 + i64::from(exponent)) as u64) << 52);
    (power * f64::from(mantissa)) as f32
}

/// Red, green, blue and opacity from brightness and two differences; the highest bit of the last number tells how many bits there are.
fn color([y, co, cg, alpha]: [i32; 4], most: f32) -> [i32; 4] {
    let bits = i32::BITS - alpha.leading_zeros();
    let scale = ((1_i64 << bits) - 1) as i32;
    let opacity = alpha & scale >> 1;
    let opacity = opacity << 1 | opacity & 1;
    [y + co - cg, y + cg, y - co - cg, opacity].map(|c| {
        let value = (c as f32 * (most / scale as f32)).round();
        value.clamp(0.0, most) as i32
    })
}
