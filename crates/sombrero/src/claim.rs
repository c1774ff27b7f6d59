//! Whom a verdict convinces.
//!
//! p is the chance that a mesh matches a key by accident. That is all for whoever made the key and knows that he tried
//! once. Others have to fear that the claimant tried until something matched, and k tries bring the best of them to k p at
//! most. A try is a pair of a key and a suspect. Every key costs a derivation
//! ([`Derivation`](sombrero_watermark::Derivation)), but each can then be held against every model that is public. So
//! others are convinced when p is small after more keys than anybody can pay for and all suspects that he could choose
//! from. A trusted timestamp that is older than the suspect leaves him no keys to make, only those to choose from that he
//! had stamped beforehand.

use crate::detect::DetectOptions;
use serde::Serialize;
use sombrero_watermark::{KEY_VERSION, Key};

/// log10 of the keys that a claimant could have made: half a million years of a core, or some ten million dollars of the
/// graphics cards with the most memory bandwidth (docs/evidence.md).
pub const KEYS: f64 = 14.0;

/// log10 of the timestamps that a claimant could have had beforehand: one a minute for two years. Each may be of a tree of
/// keys, whose places count besides.
pub const TIMESTAMPS: f64 = 6.0;

/// log10 of the suspects that a claimant could have held each key against: the largest collection of public models has ten
/// million (Deitke et al. 2023, Objaverse-XL).
pub const SUSPECTS: f64 = 7.0;

/// What is small enough for a judge: log10 p of at most this.
pub const CONVINCING: f64 = -6.0;

/// The number of ways to set method, registration and resampling.
const SETTINGS: f64 = 2.0 * 3.0 * 3.0;

/// The part of a claimant's chance that goes to these settings; over all settings the parts sum to 1 at most.
///
/// Whoever leaves the defaults may have looked with all settings, and so may whoever comes with the defaults. They take a
/// half, and the others share the other half. p over its part bounds the chance then whichever are chosen (the union
/// bound). A seed of one's own is one of so many that nothing is left for it. Threshold and budget take no part: they may end a
/// search early, never with a smaller p than the whole search has.
pub fn settings_weight(options: &DetectOptions) -> f64 {
    let DetectOptions { threshold, budget, .. } = *options;
    let usual = DetectOptions { threshold, budget, ..DetectOptions::default() };
    if *options == usual {
        0.5
    } else if options.seed == usual.seed {
        0.5 / (SETTINGS - 1.0)
    } else {
        0.0
    }
}

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
    /// log10 of the chance that somebody who wants to deceive had such a match: p times what he could have tried. That is
    /// [`SUSPECTS`] for each of [`KEYS`], or with a trusted timestamp for each place in the trees of [`TIMESTAMPS`]; and the
    /// settings ([`settings_weight`]).
    pub log10_p_claimant: f64,
    /// Who is convinced. With a trusted timestamp: provided that the suspect appeared after it.
    pub convinces: Convinces,
    /// log10 of the places in the tree of keys that the timestamp is of.
    #[serde(skip)]
    places: f64,
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
        let weight = settings_weight(options);
        // Where keys or settings cost nothing, no number of tries would do.
        let bounded = weight > 0.0 && key.derivation.is_acceptable();
        let log10_p_claimant = match bounded {
            true => (log10_p + tries(trusted, places) - libm::log10(weight)).min(0.0),
            false => 0.0,
        };
        let convinces = if !detected || log10_p > CONVINCING {
            Convinces::Nobody
        } else if log10_p_claimant <= CONVINCING {
            Convinces::Anybody
        } else {
            Convinces::Owner
        };
        let committed_at = commitment.map(|commitment| commitment.time);
        Self { key_version: KEY_VERSION, committed_at, trusted, log10_p_claimant, convinces, places }
    }

    /// Who is convinced, what was counted for that, and what would be needed to convince anybody, in one sentence.
    pub fn sentence(&self) -> String {
        let chance = format!("the chance of such a match is 10^{:.1} at most", self.log10_p_claimant);
        let keys = format!("10^{KEYS} keys, each held against 10^{SUSPECTS} suspects");
        let stamped = format!("10^{TIMESTAMPS} such timestamps and 10^{SUSPECTS} suspects to choose from");
        let owner = "It convinces the key's owner; others have to reckon with";
        let needed = |trusted| {
            let usual = libm::log10(settings_weight(&DetectOptions::default()));
            format!("{:.1}", CONVINCING - tries(trusted, self.places) + usual)
        };
        let [without, with] = [false, true].map(needed);
        match (self.convinces, self.trusted, &self.committed_at) {
            (Convinces::Nobody, ..) => "It convinces nobody that the mark is there.".into(),
            (Convinces::Anybody, true, Some(time)) => format!(
                "It convinces anybody, if the suspect appeared after {time}, when the key existed: even with {stamped}, {chance}."
            ),
            (Convinces::Anybody, ..) => {
                format!(
                    "It convinces anybody: even after {keys}, which is more than can be paid for, {chance}."
                )
            }
            (Convinces::Owner, true, Some(time)) => format!(
                "{owner} {stamped}, and would need log10 p = {with} with the usual settings, if the suspect appeared after {time}."
            ),
            (Convinces::Owner, false, Some(time)) => format!(
                "{owner} {keys}, and would need log10 p = {without} with the usual settings, or {with} if the timestamp of {time} were checked with the certificate of its authority and older than the suspect."
            ),
            (Convinces::Owner, ..) => format!(
                "{owner} {keys}, and would need log10 p = {without} with the usual settings, or {with} with a trusted timestamp older than the suspect."
            ),
        }
    }
}

/// log10 of the pairs of a key and a suspect that a claimant could have tried.
fn tries(trusted: bool, places: f64) -> f64 {
    SUSPECTS + if trusted { TIMESTAMPS + places } else { KEYS }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::detect::Method;
    use sombrero_search::When;
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
            (-6.0, Owner, Owner, Owner),
            (-19.3, Owner, Owner, Owner),
            (-19.4, Owner, Owner, Anybody),
            (-27.3, Owner, Owner, Anybody),
            (-27.4, Anybody, Anybody, Anybody),
            (-300.0, Anybody, Anybody, Anybody),
        ] {
            assert_eq!(claim(log10_p, None).convinces, without, "{log10_p}");
            assert_eq!(claim(log10_p, stamp(false)).convinces, untrusted, "{log10_p}");
            assert_eq!(claim(log10_p, stamp(true)).convinces, trusted, "{log10_p}");
        }
    }

    /// 10^14 keys, or 10^6 timestamps, for each of 10^7 suspects; twice for the settings.
    #[test]
    fn tries_are_pairs_of_a_key_and_a_suspect() {
        let close = |claim: Claim, log10_p: f64| {
            assert!((claim.log10_p_claimant - log10_p).abs() < 1e-12, "{claim:?}");
        };
        close(claim(-30.0, None), -30.0 + 14.0 + 7.0 + 2_f64.log10());
        close(claim(-30.0, stamp(false)), -30.0 + 14.0 + 7.0 + 2_f64.log10());
        close(claim(-30.0, stamp(true)), -30.0 + 6.0 + 7.0 + 2_f64.log10());
        close(claim(-21.0, None), 0.0);
    }

    #[test]
    fn every_place_in_a_tree_counts() {
        let path = Some(Path(vec![Sibling::Left([0; 32]); 10]));
        let key = Key { path, ..key() };
        let of = |log10_p| Claim::new(true, log10_p, &key, stamp(true), &DetectOptions::default());
        let counted = 2_f64.log10() + 13.0 + 1024_f64.log10();
        assert!((of(-23.0).log10_p_claimant + 23.0 - counted).abs() < 1e-12);
        assert_eq!(of(-22.4).convinces, Convinces::Anybody);
        assert_eq!(of(-22.3).convinces, Convinces::Owner);
        assert!(of(-22.3).sentence().contains("log10 p = -22.3"), "{}", of(-22.3).sentence());
    }

    #[test]
    fn what_all_settings_take_is_one_at_most() {
        let mut sum = 0.0;
        let mut ways = 0.0;
        for method in [Method::Robust, Method::Paper] {
            for registration in [When::Auto, When::Always, When::Never] {
                for resampling in [When::Auto, When::Always, When::Never] {
                    for seed in [0, 1, u64::MAX] {
                        let usual = DetectOptions::default();
                        let options = DetectOptions { method, registration, resampling, seed, ..usual };
                        let weight = settings_weight(&options);
                        sum += weight;
                        ways += f64::from(u8::from(weight > 0.0));
                        let strict = DetectOptions { threshold: 1e-9, ..options };
                        assert_eq!(settings_weight(&strict), weight);
                    }
                }
            }
        }
        assert_eq!(ways, SETTINGS);
        assert!(sum <= 1.0 && sum > 0.999_999, "{sum}");
    }

    #[test]
    fn other_settings_count_as_tries_and_a_seed_disqualifies() {
        let of = |options| Claim::new(true, -28.6, &key(), None, &options);
        let usual = DetectOptions::default();
        let paper = DetectOptions { method: Method::Paper, ..usual };
        assert_eq!(of(DetectOptions { threshold: 1e-9, ..usual }).convinces, Convinces::Anybody);
        assert_eq!(of(paper).convinces, Convinces::Anybody);
        assert_eq!(Claim::new(true, -28.5, &key(), None, &paper).convinces, Convinces::Owner);
        let seeded = of(DetectOptions { seed: 1, ..usual });
        assert_eq!((seeded.convinces, seeded.log10_p_claimant), (Convinces::Owner, 0.0));
        let stub = Key { derivation: Derivation::stub_for_experiments(), ..key() };
        assert_eq!(Claim::new(true, -99.0, &stub, None, &usual).convinces, Convinces::Owner);
    }

    #[test]
    fn the_sentence_says_what_was_counted_and_what_is_needed() {
        for (log10_p, stamp, words) in [
            (-1.0, None, "convinces nobody"),
            (-8.0, None, "10^14 keys, each held against 10^7 suspects, and would need log10 p = -27.3"),
            (-8.0, None, "-19.3 with a trusted timestamp older than the suspect"),
            (-8.0, stamp(false), "-19.3 if the timestamp of 2026-11-22T16:29:23Z were checked"),
            (-8.0, stamp(true), "10^6 such timestamps and 10^7 suspects to choose from"),
            (-30.0, stamp(true), "if the suspect appeared after 2026-11-22T16:29:23Z"),
            (-30.0, stamp(true), "even with 10^6 such timestamps and 10^7 suspects to choose from"),
            (-40.0, None, "even after 10^14 keys, each held against 10^7 suspects"),
        ] {
            let sentence = claim(log10_p, stamp).sentence();
            assert!(sentence.contains(words) && sentence.ends_with('.'), "{sentence}");
        }
    }
}
