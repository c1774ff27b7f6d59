//! The mini-language of attacks: `name` or `name:parameter=value,parameter=value`.

use crate::error::SpecError;
use std::str::FromStr;

/// The parameters that a spec gives, read one by one by [`Operation::read`](crate::Operation::read).
#[derive(Debug)]
pub struct Given<'a> {
    attack: &'a str,
    example: &'static str,
    /// Those that have not been read yet.
    left: Vec<(&'a str, &'a str)>,
    /// The names that were asked for.
    known: Vec<&'static str>,
}

impl<'a> Given<'a> {
    /// The parameters `rest` of the attack of that name, for which `example` is a spec that makes sense.
    pub(crate) fn new(attack: &'a str, rest: &'a str, example: &'static str) -> Self {
        let left = rest.split(',').filter(|p| !p.is_empty()).map(|p| p.split_once('=').unwrap_or((p, "")));
        Self { attack, example, left: left.collect(), known: Vec::new() }
    }

    /// A parameter of any kind; `None` when it is not given. `wanted` says in words what it may be.
    ///
    /// # Errors
    /// [`SpecError::Value`] when the text is not such a value.
    pub fn value<T: FromStr>(
        &mut self,
        parameter: &'static str,
        wanted: &'static str,
    ) -> Result<Option<T>, SpecError> {
        let Some(text) = self.text(parameter) else { return Ok(None) };
        text.parse().map(Some).map_err(|_| self.wrong(parameter, text, wanted))
    }

    /// A number that is finite; `None` when it is not given.
    ///
    /// # Errors
    /// [`SpecError::Value`] when the text is no such number.
    pub fn number(&mut self, parameter: &'static str) -> Result<Option<f64>, SpecError> {
        let Some(text) = self.text(parameter) else { return Ok(None) };
        let number = text.parse().ok().filter(|x: &f64| x.is_finite());
        number.map(Some).ok_or_else(|| self.wrong(parameter, text, "a number"))
    }

    /// A whole number; `None` when it is not given.
    ///
    /// # Errors
    /// [`SpecError::Value`] when the text is no such number.
    pub fn whole<T: FromStr>(&mut self, parameter: &'static str) -> Result<Option<T>, SpecError> {
        self.value(parameter, "a whole number")
    }

    /// A parameter that must be there.
    ///
    /// # Errors
    /// [`SpecError::Missing`] when it is not.
    pub fn needed<T>(&self, parameter: &'static str, value: Option<T>) -> Result<T, SpecError> {
        let attack = self.attack.to_owned();
        value.ok_or(SpecError::Missing { attack, parameter, example: self.example })
    }

    /// A number that must be there.
    ///
    /// # Errors
    /// [`SpecError::Missing`] when it is not, and [`SpecError::Value`] when it is no number.
    pub fn needed_number(&mut self, parameter: &'static str) -> Result<f64, SpecError> {
        let number = self.number(parameter)?;
        self.needed(parameter, number)
    }

    /// Refuses what nobody has asked for.
    pub(crate) fn nothing_left(self) -> Result<(), SpecError> {
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

    fn text(&mut self, parameter: &'static str) -> Option<&'a str> {
        self.known.push(parameter);
        let at = self.left.iter().position(|(name, _)| *name == parameter)?;
        Some(self.left.remove(at).1)
    }

    fn wrong(&self, parameter: &'static str, text: &str, wanted: &'static str) -> SpecError {
        SpecError::Value { attack: self.attack.to_owned(), parameter, text: text.to_owned(), wanted }
    }
}

/// A spec of the attack `name` with these parameters.
pub(crate) fn spec(name: &str, parameters: &[(&'static str, String)]) -> String {
    let given: Vec<String> = parameters.iter().map(|(name, value)| format!("{name}={value}")).collect();
    if given.is_empty() { name.to_owned() } else { format!("{name}:{}", given.join(",")) }
}
