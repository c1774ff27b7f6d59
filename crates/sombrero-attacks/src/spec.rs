//! The mini-language of attacks: `name` or `name:parameter=value,parameter=value`.

use crate::{Attack, SecondMark, Smoothing, Transform};
use std::fmt;
use std::str::FromStr;
use thiserror::Error;

/// A spec that cannot be read.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum SpecError {
    /// No attack has this name.
    #[error(
        "there is no attack `{name}`; known are none, reorder, noise, smooth, transform, simplify, watermark and crop"
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
        example: f64,
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
            "noise" => Self::Noise { amplitude: given.required("amplitude", 0.002)? },
            "smooth" => Self::Smooth(given.smoothing()?),
            "transform" => Self::Transform(Transform {
                rotation: given.number("rotation")?,
                translation: given.number("translation")?,
                scale: given.number("scale")?,
            }),
            "simplify" => Self::Simplify { ratio: given.required("ratio", 0.5)? },
            "watermark" => Self::Watermark(given.second_mark()?),
            "crop" => Self::Crop { fraction: given.required("fraction", 0.333)? },
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

    fn required(&mut self, parameter: &'static str, example: f64) -> Result<f64, SpecError> {
        let missing = SpecError::Missing { attack: self.attack.to_owned(), parameter, example };
        self.number(parameter)?.ok_or(missing)
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
        let mut mark = SecondMark::default();
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
            Self::Smooth(Smoothing { iterations, lambda, mu }) => {
                write!(f, "smooth:iterations={iterations},lambda={lambda},mu={mu}")
            }
            Self::Transform(Transform { rotation, translation, scale }) => {
                let given = [("rotation", rotation), ("translation", translation), ("scale", scale)];
                let given = given.iter().filter_map(|(name, value)| value.map(|x| format!("{name}={x}")));
                let given: Vec<String> = given.collect();
                f.write_str("transform")?;
                if given.is_empty() { Ok(()) } else { write!(f, ":{}", given.join(",")) }
            }
            Self::Simplify { ratio } => write!(f, "simplify:ratio={ratio}"),
            Self::Watermark(SecondMark { parameters }) => {
                let (basis, epsilon) = (parameters.basis, parameters.epsilon);
                write!(
                    f,
                    "watermark:epsilon={epsilon},coefficients={},basis={}",
                    basis.coefficients, basis.function
                )
            }
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
            "simplify:ratio=0.125",
            "watermark:epsilon=0.02,coefficients=20,basis=hat",
            "crop:fraction=0.333",
        ] {
            assert_eq!(spec.parse::<Attack>().map(|a| a.to_string()).as_deref(), Ok(spec));
        }
        assert_eq!("smooth".parse(), Ok(Attack::Smooth(Smoothing::default())));
        assert_eq!("watermark".parse(), Ok(Attack::Watermark(SecondMark::default())));
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
    }

    proptest! {
        #[test]
        fn any_text_is_an_attack_or_an_error(text in ".{0,40}") {
            if let Ok(attack) = text.parse::<Attack>() {
                prop_assert_eq!(attack.to_string().parse(), Ok(attack));
            }
        }
    }
}
