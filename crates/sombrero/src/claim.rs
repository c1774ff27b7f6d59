//! Whom a verdict convinces.
//!
//! p is the chance that a mesh matches a key by accident. That is all for whoever made the key and knows that he tried
//! once. Others have to fear that the claimant made keys and originals until one of them matched. Every such try costs
//! a derivation ([`Derivation`](sombrero_watermark::Derivation)), and k tries bring the best of them to k p at most. So
//! others are convinced when p is small after more tries than anybody can pay for, or when a trusted timestamp shows that
//! the key is older than the suspect: then nothing could be tried on it.

use crate::detect::DetectOptions;
use serde::Serialize;
use sombrero_watermark::{KEY_VERSION, Key};

/// log10 of the derivations that a claimant could have tried: half a million years of a core, or some ten million dollars
/// of the graphics cards with the most memory bandwidth (docs/evidence.md).
pub const TRIES: f64 = 14.0;

/// What is small enough for a judge: log10 p of at most this.
pub const CONVINCING: f64 = -6.0;

/// log10 of the number of ways to set method, registration and resampling: 2 · 3 · 3. Whoever leaves the defaults may
/// have looked in all of them.
const SETTINGS: f64 = 1.255_272_505_103_306;

/// Who is convinced by a verdict.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Convinces {
    /// Nobody: the mark was not found, or with a chance that is not small.
    Nobody,
    /// The owner, who knows that he made one key and did not look for one that matches.
    Owner,
    /// Anybody.
    Anybody,
}

/// A timestamp of a key, as a verification found it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Commitment {
    /// When the key existed at the latest, RFC 3339.
    pub time: String,
    /// Whether an authority vouches for it that whoever is to be convinced trusts.
    pub trusted: bool,
}

/// What a verdict is worth to whom.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[non_exhaustive]
pub struct Claim {
    /// The version of the key's format.
    pub key_version: u32,
    /// When the key existed at the latest by its timestamp, RFC 3339; `None` without one.
    pub committed_at: Option<String>,
    /// Whether that timestamp was verified down to an authority that was given.
    pub trusted: bool,
    /// log10 of the chance that somebody who wants to deceive had such a match: p times what he could have tried. With a
    /// trusted timestamp these are the places in its tree of keys, otherwise 10^14 derivations.
    pub log10_p_claimant: f64,
    /// Who is convinced. With a trusted timestamp: provided that the suspect appeared after it.
    pub convinces: Convinces,
}

impl Claim {
    /// The worth of a verdict with this corrected log10 p. `commitment` is the key's timestamp, verified; `options` are
    /// those of the detection.
    pub fn new(
        detected: bool,
        log10_p: f64,
        key: &Key,
        commitment: Option<Commitment>,
        options: &DetectOptions,
    ) -> Self {
        let trusted = commitment.as_ref().is_some_and(|commitment| commitment.trusted);
        let places = key.path.as_ref().map_or(0.0, |path| libm::log10(path.weight()));
        let usual = DetectOptions { threshold: options.threshold, ..DetectOptions::default() };
        let ways = if *options == usual { 0.0 } else { SETTINGS };
        let tries = if trusted { places } else { TRIES };
        let log10_p_claimant = (log10_p + tries + ways).min(0.0);
        // A seed can be any of so many that no number of tries would do.
        let comparable = options.seed == usual.seed && key.derivation.is_acceptable();
        let convinces = if !detected || log10_p > CONVINCING {
            Convinces::Nobody
        } else if comparable && log10_p_claimant <= CONVINCING {
            Convinces::Anybody
        } else {
            Convinces::Owner
        };
        let committed_at = commitment.map(|commitment| commitment.time);
        Self { key_version: KEY_VERSION, committed_at, trusted, log10_p_claimant, convinces }
    }

    /// Who is convinced, and what would be needed to convince anybody, in one sentence.
    pub fn sentence(&self) -> String {
        let Self { log10_p_claimant: p, .. } = self;
        let chance = format!("10^{p:.1}");
        match (self.convinces, self.trusted, &self.committed_at) {
            (Convinces::Nobody, ..) => "It convinces nobody that the mark is there.".into(),
            (Convinces::Anybody, true, Some(time)) => format!(
                "It convinces anybody, if the suspect appeared after {time}, when the key existed: the chance is {chance} at most."
            ),
            (Convinces::Anybody, ..) => format!(
                "It convinces anybody: even after 10^{TRIES} tries, more than can be paid for, the chance of such a match is {chance} at most."
            ),
            (Convinces::Owner, true, Some(time)) => format!(
                "It convinces the key's owner; for others it falls short even if the suspect appeared after {time}, since the chance after all that could have been chosen is {chance}: look with the usual settings, or for log10 p of {:.0}.",
                CONVINCING - TRIES
            ),
            (Convinces::Owner, false, Some(time)) => format!(
                "It convinces the key's owner; for others, who have to reckon with 10^{TRIES} tries, the timestamp of {time} has to be checked with the certificate of its authority and be older than the suspect, or log10 p be {:.0}.",
                CONVINCING - TRIES
            ),
            (Convinces::Owner, ..) => format!(
                "It convinces the key's owner; for others, who have to reckon with 10^{TRIES} tries, the key would need a trusted timestamp older than the suspect, or log10 p be {:.0}.",
                CONVINCING - TRIES
            ),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::detect::Method;
    use sombrero_watermark::{Derivation, Identity, OriginalDigest, Path, Preset, Secret, Sibling};

    fn key() -> Key {
        let file = OriginalDigest::of_file(b"file");
        let parameters = Preset::default().parameters();
        let stub = Derivation::stub_for_experiments();
        let key = Key::new(&file, Identity::default(), Secret([9; 32]), parameters, &[1; 32], stub);
        Key { derivation: Derivation::STANDARD, ..key }
    }

    fn stamp(trusted: bool) -> Option<Commitment> {
        Some(Commitment { time: "2026-11-22T16:29:23Z".into(), trusted })
    }

    fn claim(log10_p: f64, commitment: Option<Commitment>) -> Claim {
        Claim::new(log10_p <= -6.0, log10_p, &key(), commitment, &DetectOptions::default())
    }

    #[test]
    fn who_is_convinced_depends_on_p_and_on_the_timestamp() {
        use Convinces::{Anybody, Nobody, Owner};
        for (log10_p, without, untrusted, trusted) in [
            (-5.9, Nobody, Nobody, Nobody),
            (-6.0, Owner, Owner, Anybody),
            (-19.9, Owner, Owner, Anybody),
            (-20.0, Anybody, Anybody, Anybody),
            (-300.0, Anybody, Anybody, Anybody),
        ] {
            assert_eq!(claim(log10_p, None).convinces, without, "{log10_p}");
            assert_eq!(claim(log10_p, stamp(false)).convinces, untrusted, "{log10_p}");
            assert_eq!(claim(log10_p, stamp(true)).convinces, trusted, "{log10_p}");
        }
        assert_eq!(claim(-20.0, None).log10_p_claimant, -6.0);
        assert_eq!(claim(-20.0, stamp(true)).log10_p_claimant, -20.0);
        assert_eq!(claim(-1.0, None).log10_p_claimant, 0.0);
    }

    #[test]
    fn every_place_in_a_tree_counts() {
        let path = Some(Path(vec![Sibling::Left([0; 32]); 10]));
        let key = Key { path, ..key() };
        let of = |log10_p| Claim::new(true, log10_p, &key, stamp(true), &DetectOptions::default());
        assert!((of(-9.0).log10_p_claimant + 9.0 - 1024_f64.log10()).abs() < 1e-12);
        assert_eq!(of(-9.1).convinces, Convinces::Anybody);
        assert_eq!(of(-9.0).convinces, Convinces::Owner);
    }

    #[test]
    fn other_settings_count_as_tries_and_a_seed_disqualifies() {
        let of = |options| Claim::new(true, -22.0, &key(), None, &options).convinces;
        let usual = DetectOptions::default();
        let paper = DetectOptions { method: Method::Paper, ..usual };
        assert_eq!(of(DetectOptions { threshold: 1e-9, ..usual }), Convinces::Anybody);
        assert_eq!(of(paper), Convinces::Anybody);
        assert_eq!(Claim::new(true, -20.5, &key(), None, &paper).convinces, Convinces::Owner);
        assert_eq!(of(DetectOptions { seed: 1, ..usual }), Convinces::Owner);
        let stub = Key { derivation: Derivation::stub_for_experiments(), ..key() };
        assert_eq!(Claim::new(true, -99.0, &stub, None, &usual).convinces, Convinces::Owner);
    }

    #[test]
    fn the_sentence_says_what_is_needed() {
        for (log10_p, stamp, words) in [
            (-1.0, None, "convinces nobody"),
            (-8.0, None, "trusted timestamp older than the suspect, or log10 p be -20"),
            (-8.0, stamp(false), "2026-11-22T16:29:23Z has to be checked"),
            (-8.0, stamp(true), "if the suspect appeared after 2026-11-22T16:29:23Z"),
            (-40.0, None, "even after 10^14 tries"),
        ] {
            let sentence = claim(log10_p, stamp).sentence();
            assert!(sentence.contains(words) && sentence.ends_with('.'), "{sentence}");
        }
    }
}
