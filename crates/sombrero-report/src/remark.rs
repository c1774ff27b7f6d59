//! Remarks about the run rather than about the files.

/// A remark that a replay cannot find again, since it is about a file that the report does not name. So each is one
/// sentence without a word from outside, and anything else among the warnings is a forgery.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Remark {
    /// The basis came from a prepared file that the user vouched for.
    Unconfirmed,
    /// There was a prepared file beside the key, and it could not be used.
    Unused,
}

impl Remark {
    /// What is said.
    pub fn sentence(self) -> &'static str {
        match self {
            Self::Unconfirmed => {
                "The basis was taken from a prepared file and not derived anew, which `sombrero verify` does."
            }
            Self::Unused => "The prepared file beside the key was not used.",
        }
    }

    /// The remark with this sentence, if it goes together with a verdict and with what is said of the basis.
    pub(crate) fn find(sentence: &str, detected: bool, prepared: bool) -> Option<Self> {
        let fits = |remark: &Self| match remark {
            Self::Unconfirmed => detected && prepared,
            Self::Unused => !prepared,
        };
        [Self::Unconfirmed, Self::Unused]
            .into_iter()
            .find(|remark| remark.sentence() == sentence && fits(remark))
    }
}
