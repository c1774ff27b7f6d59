//! The light: a soft sky and three lamps that move with the camera.
//!
//! For a unit normal n, albedo a and the lamps' unit directions lᵢ and colours cᵢ, in linear light:
//!
//! ```text
//! color = a (ground + (sky - ground) (1 + n_y)/2 + Σ cᵢ max(0, n · lᵢ)) + gloss max(0, n · h)¹⁶
//! ```
//!
//! The key lamp stands high at the left and grazes what faces the viewer, so that shallow dents get a bright and a
//! dark side; h is the half-way vector between it and the eye. Linear light and sRGB are related by a square
//! instead of the standard's power 2.4, which no two platforms compute alike; the pictures differ by less than the
//! eye sees.

use nalgebra::Vector3;

/// Linear red, green and blue.
pub(crate) type Light = Vector3<f64>;

/// An sRGB channel of [0, 255] in linear light.
pub(crate) fn linear(channel: f64) -> f64 {
    let c = channel / 255.0;
    c * c
}

/// The sRGB channel, rounded, of linear light.
pub(crate) fn encode(light: f64) -> u8 {
    // The cast saturates.
    (light.clamp(0.0, 1.0).sqrt() * 255.0 + 0.5) as u8
}

/// Linear light of an sRGB colour.
pub(crate) fn from_srgb(rgb: [f64; 3]) -> Light {
    Light::from(rgb.map(linear))
}

/// Directions (towards the lamp) and colours in view coordinates: x right, y up, z towards the eye.
const LAMPS: [([f64; 3], [f64; 3]); 3] = [
    ([-0.62, 0.62, 0.48], [0.92, 0.88, 0.82]),
    ([0.85, 0.10, 0.55], [0.24, 0.26, 0.30]),
    ([0.25, 0.75, -0.60], [0.30, 0.30, 0.32]),
];
const SKY: [f64; 3] = [0.27, 0.28, 0.30];
const GROUND: [f64; 3] = [0.09, 0.085, 0.08];
const GLOSS: f64 = 0.05;

/// Lamps with their directions at length one.
pub(crate) struct Rig {
    lamps: [(Vector3<f64>, Light); 3],
}

impl Rig {
    pub(crate) fn new() -> Self {
        let lamp = |(direction, color): ([f64; 3], [f64; 3])| {
            (Vector3::from(direction).normalize(), Light::from(color))
        };
        Self { lamps: LAMPS.map(lamp) }
    }

    /// Light that a surface of the given albedo sends to the eye; `normal` and `to_eye` are unit vectors.
    pub(crate) fn shade(&self, albedo: &Light, normal: &Vector3<f64>, to_eye: &Vector3<f64>) -> Light {
        let half = (self.lamps[0].0 + to_eye).normalize();
        let mut glint = normal.dot(&half).max(0.0);
        for _ in 0..4 {
            glint *= glint;
        }
        albedo.component_mul(&self.diffuse(normal)) + Light::repeat(GLOSS * glint)
    }

    /// Like [`shade`](Self::shade) but evened out, so that a colour that carries a number stays readable.
    pub(crate) fn shade_softly(&self, albedo: &Light, normal: &Vector3<f64>) -> Light {
        let brightness = self.diffuse(normal).sum() / 3.0;
        albedo * (0.45 + 0.55 * brightness)
    }

    fn diffuse(&self, normal: &Vector3<f64>) -> Light {
        let (sky, ground) = (Light::from(SKY), Light::from(GROUND));
        let ambient = ground + (sky - ground) * (0.5 + 0.5 * normal.y);
        self.lamps.iter().fold(ambient, |sum, (l, c)| sum + c * normal.dot(l).max(0.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn encoding_round_trips() {
        for channel in 0..=255_u8 {
            assert_eq!(encode(linear(f64::from(channel))), channel);
        }
        assert_eq!([encode(-1.0), encode(7.0), encode(f64::NAN)], [0, 255, 0]);
    }

    #[test]
    fn light_comes_from_above_left() {
        let rig = Rig::new();
        let brightness = |x: f64, y: f64, z: f64| {
            rig.shade(&Light::repeat(0.5), &Vector3::new(x, y, z).normalize(), &Vector3::z()).sum()
        };
        assert!(brightness(-1.0, 1.0, 1.0) > brightness(0.0, 0.0, 1.0));
        assert!(brightness(0.0, 0.0, 1.0) > brightness(1.0, -1.0, 1.0));
        assert!(brightness(0.0, -1.0, 0.0) > 0.0);
    }
}
