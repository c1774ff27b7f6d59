//! The mini-language of attacks: `name` or `name:parameter=value,parameter=value`.

use crate::{Attack, FreeForm, Laplacian, Remeshing, SecondMark, Smoothing, Subdivision, Transform};
use sombrero_basis::BasisOptions;
use sombrero_watermark::Preset;
use std::fmt;
use std::str::FromStr;
use thiserror::Error;

/// A spec that cannot be read.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum SpecError {
    /// No attack has this name.
    #[error(
        "there is no attack `{name}`; known are none, reorder, noise, coordinate-noise, smooth, laplacian, quantize, transform, affine, \
         projective, ffd, simplify, subdivide, remesh, isosurface, watermark and crop"
    )]
    Name {
        /// What was given.
        name: String,
    },
    /// The attack has no such parameter, or it was given twice.
    #[error("the attack {attack} has no parameter `{parameter}`, or has it twice; it takes {known}")]
    Parameter {
        /// The attack.
        attack: String,
        /// What was given.
        parameter: String,
        /// What it takes, in words.
        known: String,
    },
    /// A parameter that is needed is missing.
    #[error("the attack {attack} needs a value for {parameter}, for instance {attack}:{parameter}={example}")]
    Missing {
        /// The attack.
        attack: String,
        /// The parameter.
        parameter: &'static str,
        /// A value that makes sense.
        example: &'static str,
    },
    /// A value is not a number of the right kind.
    #[error("`{text}` is not a usable value for {attack}'s {parameter}; give {wanted}")]
    Value {
        /// The attack.
        attack: String,
        /// The parameter.
        parameter: &'static str,
        /// What was given.
        text: String,
        /// What is wanted, in words.
        wanted: &'static str,
    },
}

impl FromStr for Attack {
    type Err = SpecError;

    fn from_str(spec: &str) -> Result<Self, SpecError> {
        let (name, rest) = spec.split_once(':').unwrap_or((spec, ""));
        let mut given = Given::new(name, rest);
        let attack = match name {
            "none" => Self::None,
            "reorder" => Self::Reorder,
            "noise" => Self::Noise { amplitude: given.required("amplitude", "0.002")? },
            "coordinate-noise" => Self::CoordinateNoise { amplitude: given.required("amplitude", "0.001")? },
            "smooth" => Self::Smooth(given.smoothing()?),
            "laplacian" => Self::Laplacian(given.laplacian()?),
            "quantize" => Self::Quantize { bits: given.whole("bits", "10")? },
            "transform" => Self::Transform(Transform {
                rotation: given.number("rotation")?,
                translation: given.number("translation")?,
                scale: given.number("scale")?,
            }),
            "affine" => Self::Affine { strength: given.required("strength", "0.1")? },
            "projective" => Self::Projective { strength: given.required("strength", "0.1")? },
            "ffd" => Self::FreeForm(FreeForm {
                strength: given.required("strength", "0.02")?,
                lattice: given.whole_or("lattice", 4)?,
            }),
            "simplify" => Self::Simplify { ratio: given.required("ratio", "0.5")? },
            "subdivide" => Self::Subdivide(given.subdivision()?),
            "remesh" => Self::Remesh(Remeshing {
                length: given.required("length", "1")?,
                iterations: given.whole_or("iterations", 5)?,
            }),
            "isosurface" => Self::Isosurface { resolution: given.whole("resolution", "128")? },
            "watermark" => Self::Watermark(given.second_mark()?),
            "crop" => match given.number("vertices")? {
                Some(share) => Self::CropVertices { share },
                None => Self::Crop { fraction: given.required("fraction", "0.333")? },
            },
            _ => return Err(SpecError::Name { name: name.to_owned() }),
        };
        given.nothing_left()?;
        Ok(attack)
    }
}

/// The parameters of one spec that have not been used yet.
struct Given<'a> {
    attack: &'a str,
    left: Vec<(&'a str, &'a str)>,
    known: Vec<&'static str>,
}

impl<'a> Given<'a> {
    fn new(attack: &'a str, rest: &'a str) -> Self {
        let left = rest.split(',').filter(|p| !p.is_empty()).map(|p| p.split_once('=').unwrap_or((p, "")));
        Self { attack, left: left.collect(), known: Vec::new() }
    }

    fn text(&mut self, parameter: &'static str) -> Option<&'a str> {
        self.known.push(parameter);
        let at = self.left.iter().position(|(name, _)| *name == parameter)?;
        Some(self.left.remove(at).1)
    }

    fn parsed<T: FromStr>(
        &mut self,
        parameter: &'static str,
        wanted: &'static str,
    ) -> Result<Option<T>, SpecError> {
        let attack = self.attack;
        let value = |text: &str| {
            let wrong =
                || SpecError::Value { attack: attack.to_owned(), parameter, text: text.to_owned(), wanted };
            text.parse().map_err(|_| wrong())
        };
        self.text(parameter).map(value).transpose()
    }

    fn number(&mut self, parameter: &'static str) -> Result<Option<f64>, SpecError> {
        let Some(text) = self.text(parameter) else { return Ok(None) };
        let number = text.parse().ok().filter(|x: &f64| x.is_finite());
        let wrong = || SpecError::Value {
            attack: self.attack.to_owned(),
            parameter,
            text: text.to_owned(),
            wanted: "a number",
        };
        number.map(Some).ok_or_else(wrong)
    }

    fn required(&mut self, parameter: &'static str, example: &'static str) -> Result<f64, SpecError> {
        self.number(parameter)?.ok_or_else(|| self.missing(parameter, example))
    }

    fn whole(&mut self, parameter: &'static str, example: &'static str) -> Result<u32, SpecError> {
        self.parsed(parameter, "a whole number")?.ok_or_else(|| self.missing(parameter, example))
    }

    fn whole_or(&mut self, parameter: &'static str, usual: u32) -> Result<u32, SpecError> {
        Ok(self.parsed(parameter, "a whole number")?.unwrap_or(usual))
    }

    fn missing(&self, parameter: &'static str, example: &'static str) -> SpecError {
        SpecError::Missing { attack: self.attack.to_owned(), parameter, example }
    }

    fn subdivision(&mut self) -> Result<Subdivision, SpecError> {
        let scheme = self.parsed("scheme", "midpoint or loop")?;
        Ok(Subdivision {
            scheme: scheme.ok_or_else(|| self.missing("scheme", "loop"))?,
            iterations: self.whole_or("iterations", 1)?,
        })
    }

    fn laplacian(&mut self) -> Result<Laplacian, SpecError> {
        let usual = Laplacian::default();
        Ok(Laplacian {
            iterations: self.parsed("iterations", "a whole number")?.unwrap_or(usual.iterations),
            lambda: self.number("lambda")?.unwrap_or(usual.lambda),
        })
    }

    fn smoothing(&mut self) -> Result<Smoothing, SpecError> {
        let usual = Smoothing::default();
        Ok(Smoothing {
            iterations: self.parsed("iterations", "a whole number")?.unwrap_or(usual.iterations),
            lambda: self.number("lambda")?.unwrap_or(usual.lambda),
            mu: self.number("mu")?.unwrap_or(usual.mu),
        })
    }

    fn second_mark(&mut self) -> Result<SecondMark, SpecError> {
        let preset = self.parsed("preset", "paper or robust")?.unwrap_or(Preset::Paper);
        let mut mark = SecondMark { parameters: preset.parameters() };
        let parameters = &mut mark.parameters;
        if let Some(epsilon) = self.number("epsilon")? {
            parameters.epsilon = epsilon;
        }
        if let Some(coefficients) = self.parsed("coefficients", "a whole number")? {
            parameters.basis.coefficients = coefficients;
        }
        if let Some(function) = self.parsed("basis", "sombrero, derby or hat")? {
            parameters.basis.function = function;
        }
        Ok(mark)
    }

    fn nothing_left(self) -> Result<(), SpecError> {
        let known = if self.known.is_empty() { "none".to_owned() } else { self.known.join(", ") };
        match self.left.first() {
            None => Ok(()),
            Some((name, _)) => Err(SpecError::Parameter {
                attack: self.attack.to_owned(),
                parameter: (*name).to_owned(),
                known,
            }),
        }
    }
}

impl fmt::Display for Attack {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::None => f.write_str("none"),
            Self::Reorder => f.write_str("reorder"),
            Self::Noise { amplitude } => write!(f, "noise:amplitude={amplitude}"),
            Self::CoordinateNoise { amplitude } => write!(f, "coordinate-noise:amplitude={amplitude}"),
            Self::Smooth(Smoothing { iterations, lambda, mu }) => {
                write!(f, "smooth:iterations={iterations},lambda={lambda},mu={mu}")
            }
            Self::Laplacian(Laplacian { iterations, lambda }) => {
                write!(f, "laplacian:iterations={iterations},lambda={lambda}")
            }
            Self::Quantize { bits } => write!(f, "quantize:bits={bits}"),
            Self::Affine { strength } => write!(f, "affine:strength={strength}"),
            Self::Projective { strength } => write!(f, "projective:strength={strength}"),
            Self::FreeForm(FreeForm { strength, lattice }) => {
                write!(f, "ffd:strength={strength},lattice={lattice}")
            }
            Self::Transform(Transform { rotation, translation, scale }) => {
                let given = [("rotation", rotation), ("translation", translation), ("scale", scale)];
                let given = given.iter().filter_map(|(name, value)| value.map(|x| format!("{name}={x}")));
                let given: Vec<String> = given.collect();
                f.write_str("transform")?;
                if given.is_empty() { Ok(()) } else { write!(f, ":{}", given.join(",")) }
            }
            Self::Simplify { ratio } => write!(f, "simplify:ratio={ratio}"),
            Self::Subdivide(Subdivision { scheme, iterations }) => {
                write!(f, "subdivide:scheme={scheme},iterations={iterations}")
            }
            Self::Remesh(Remeshing { length, iterations }) => {
                write!(f, "remesh:length={length},iterations={iterations}")
            }
            Self::Isosurface { resolution } => write!(f, "isosurface:resolution={resolution}"),
            Self::Watermark(SecondMark { parameters }) => {
                let (basis, epsilon) = (parameters.basis, parameters.epsilon);
                let same = |preset: &&Preset| preset.parameters().basis.amplitudes == basis.amplitudes;
                let preset = Preset::ALL.iter().find(same).copied().unwrap_or_default();
                let BasisOptions { coefficients, function, .. } = basis;
                write!(
                    f,
                    "watermark:preset={preset},epsilon={epsilon},coefficients={coefficients},basis={function}"
                )
            }
            Self::CropVertices { share } => write!(f, "crop:vertices={share}"),
            Self::Crop { fraction } => write!(f, "crop:fraction={fraction}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn specs_are_read_and_written() {
        for spec in [
            "none",
            "reorder",
            "noise:amplitude=0.0045",
            "smooth:iterations=3,lambda=0.5,mu=-0.53",
            "transform",
            "transform:rotation=30,scale=2",
            "laplacian:iterations=5,lambda=0.2",
            "quantize:bits=9",
            "affine:strength=0.5",
            "projective:strength=0.25",
            "ffd:strength=0.02,lattice=5",
            "simplify:ratio=0.125",
            "subdivide:scheme=midpoint,iterations=2",
            "remesh:length=1.5,iterations=3",
            "isosurface:resolution=128",
            "watermark:preset=paper,epsilon=0.02,coefficients=20,basis=hat",
            "crop:fraction=0.333",
            "crop:vertices=0.3",
            "coordinate-noise:amplitude=0.005",
            "watermark:preset=robust,epsilon=0.02,coefficients=30,basis=derby",
        ] {
            assert_eq!(spec.parse::<Attack>().map(|a| a.to_string()).as_deref(), Ok(spec));
        }
        assert_eq!("smooth".parse(), Ok(Attack::Smooth(Smoothing::default())));
        assert_eq!("watermark".parse(), Ok(Attack::Watermark(SecondMark::default())));
        assert_eq!("laplacian".parse(), Ok(Attack::Laplacian(Laplacian { iterations: 10, lambda: 0.1 })));
        let full = |spec: &str| spec.parse::<Attack>().map(|attack| attack.to_string());
        assert_eq!(full("ffd:strength=0.1").as_deref(), Ok("ffd:strength=0.1,lattice=4"));
        assert_eq!(full("subdivide:scheme=loop").as_deref(), Ok("subdivide:scheme=loop,iterations=1"));
        assert_eq!(full("remesh:length=1").as_deref(), Ok("remesh:length=1,iterations=5"));
    }

    #[test]
    fn errors_name_the_thing() {
        let error = |spec: &str| spec.parse::<Attack>().unwrap_err().to_string();
        assert!(error("nose:amplitude=1").contains("no attack `nose`"));
        assert!(error("noise").contains("noise:amplitude=0.002"));
        assert!(error("noise:amplitude=much").contains("`much`"));
        assert!(error("noise:amplitude=inf").contains("`inf`"));
        assert!(error("noise:amplitude=1,amplitude=2").contains("twice"));
        assert!(error("crop:part=1").contains("fraction"));
        assert!(error("reorder:seed=1").contains("takes none"));
        assert!(error("smooth:iterations=-1").contains("a whole number"));
        assert!(error("quantize").contains("quantize:bits=10"));
        assert!(error("quantize:bits=8.5").contains("a whole number"));
        assert!(error("subdivide").contains("subdivide:scheme=loop"));
        assert!(error("subdivide:scheme=butterfly").contains("midpoint or loop"));
        assert!(error("isosurface:resolution=64,margin=2").contains("takes resolution"));
    }

    proptest! {
        #[test]
        fn numbers_come_back_as_they_were(x in prop::num::f64::NORMAL, n in any::<u32>(), which in 0usize..8) {
            let spec = [
                format!("laplacian:iterations={n},lambda={x}"),
                format!("quantize:bits={n}"),
                format!("affine:strength={x}"),
                format!("projective:strength={x}"),
                format!("ffd:strength={x},lattice={n}"),
                format!("subdivide:scheme=loop,iterations={n}"),
                format!("remesh:length={x},iterations={n}"),
                format!("isosurface:resolution={n}"),
            ][which].clone();
            prop_assert_eq!(spec.parse::<Attack>().map(|a| a.to_string()), Ok(spec));
        }

        #[test]
        fn any_text_is_an_attack_or_an_error(text in ".{0,40}") {
            if let Ok(attack) = text.parse::<Attack>() {
                prop_assert_eq!(attack.to_string().parse(), Ok(attack));
            }
        }
    }
}
