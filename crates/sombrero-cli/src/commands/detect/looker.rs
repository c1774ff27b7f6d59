//! Who looks at suspects, before and after the basis is there.

use sombrero::io::Document;
use sombrero::{DetectError, DetectOptions, Detector, FirstLook, Glancer, Model, PreparedBasis, Suspect};

/// Who looks at suspects.
pub(super) enum Looker {
    /// For as long as all of them are other shapes; with the stored basis for who comes after.
    Glancer(Box<Glancer>, Option<PreparedBasis>),
    /// From the first on that is not.
    Detector(Detector),
    /// Nobody: the key does not fit the original, as the first who asked was told.
    Nobody,
}

impl Looker {
    pub(super) fn suspect(&self, file: &Document) -> Option<Suspect> {
        match self {
            Self::Glancer(glancer, _) => Some(glancer.suspect(file)),
            Self::Detector(detector) => Some(detector.suspect(file)),
            Self::Nobody => None,
        }
    }

    pub(super) fn look(&self, suspect: &Suspect, settings: &DetectOptions) -> Result<FirstLook, DetectError> {
        match self {
            Self::Glancer(glancer, _) => glancer.look(suspect, settings),
            _ => Ok(FirstLook::Open(None)),
        }
    }

    pub(super) fn model(&self) -> Option<&Model> {
        match self {
            Self::Glancer(glancer, _) => Some(glancer.model()),
            Self::Detector(detector) => Some(detector.model()),
            Self::Nobody => None,
        }
    }
}
