//! One digest for many: a hash tree (Merkle 1987), hashed as RFC 6962 (section 2.1) does.
//!
//! leaf = SHA-256(0x00 ‖ commitment), node = SHA-256(0x01 ‖ left ‖ right). The bytes in front keep a node from passing for
//! a leaf. A commitment's *path* is the list of its siblings from the leaf up; with it anybody computes the root, and
//! nobody can make a path from another commitment to the same root.

use sha2::{Digest, Sha256};

/// What stands beside one node on the way to the root.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sibling {
    /// The sibling is to the left.
    Left([u8; 32]),
    /// The sibling is to the right.
    Right([u8; 32]),
}

/// The siblings of a commitment, from the leaf up. Empty for a tree of one.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Path(pub Vec<Sibling>);

/// Nobody has 2⁶⁴ keys.
pub(crate) const DEEPEST: usize = 64;

impl Path {
    /// The root of the tree in which `commitment` has this path.
    pub fn root(&self, commitment: &[u8; 32]) -> [u8; 32] {
        self.0.iter().fold(leaf(commitment), |below, sibling| match sibling {
            Sibling::Left(left) => node(left, &below),
            Sibling::Right(right) => node(&below, right),
        })
    }

    /// 2 to the length of the path. For any tree of any shape the sum of the reciprocals over all leaves is at most 1
    /// (Kraft 1949). So whoever can choose among the leaves afterwards, and has his p multiplied by this, gains nothing
    /// by having many, or by hiding how many.
    pub fn weight(&self) -> f64 {
        libm::exp2(self.0.len() as f64)
    }
}

/// The root over `commitments`, and the path of each, in the same order. Where they are no power of two, the left
/// subtree takes the largest power of two below (RFC 6962). Nothing has the root of nothing: SHA-256 of no bytes.
pub fn hash_tree(commitments: &[[u8; 32]]) -> ([u8; 32], Vec<Path>) {
    let mut paths = vec![Path::default(); commitments.len()];
    (grow(commitments, &mut paths), paths)
}

fn grow(commitments: &[[u8; 32]], paths: &mut [Path]) -> [u8; 32] {
    match commitments {
        [] => Sha256::digest([]).into(),
        [only] => leaf(only),
        _ => {
            let middle = commitments.len().next_power_of_two() / 2;
            let (left, right) = commitments.split_at(middle);
            let (left_paths, right_paths) = paths.split_at_mut(middle);
            let (left, right) = (grow(left, left_paths), grow(right, right_paths));
            left_paths.iter_mut().for_each(|path| path.0.push(Sibling::Right(right)));
            right_paths.iter_mut().for_each(|path| path.0.push(Sibling::Left(left)));
            node(&left, &right)
        }
    }
}

fn leaf(commitment: &[u8; 32]) -> [u8; 32] {
    Sha256::new().chain_update([0]).chain_update(commitment).finalize().into()
}

fn node(left: &[u8; 32], right: &[u8; 32]) -> [u8; 32] {
    Sha256::new().chain_update([1]).chain_update(left).chain_update(right).finalize().into()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn three_leaves_have_the_root_of_rfc_6962() {
        let [a, b, c] = [[1; 32], [2; 32], [3; 32]];
        let (root, paths) = hash_tree(&[a, b, c]);
        assert_eq!(root, node(&node(&leaf(&a), &leaf(&b)), &leaf(&c)));
        assert_eq!(paths[1].0, [Sibling::Left(leaf(&a)), Sibling::Right(leaf(&c))]);
        assert_eq!(paths[2].0, [Sibling::Left(node(&leaf(&a), &leaf(&b)))]);
        assert_eq!(hash_tree(&[a]), (leaf(&a), vec![Path::default()]));
        let nothing = "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855";
        assert_eq!(hex::encode(hash_tree(&[]).0), nothing);
    }

    fn commitments() -> impl Strategy<Value = Vec<[u8; 32]>> {
        prop::collection::vec(any::<[u8; 32]>(), 1..40)
    }

    proptest! {
        #[test]
        fn every_commitment_leads_to_the_root(commitments in commitments()) {
            let (root, paths) = hash_tree(&commitments);
            for (commitment, path) in commitments.iter().zip(&paths) {
                prop_assert_eq!(path.root(commitment), root);
            }
            let kraft: f64 = paths.iter().map(|path| 1.0 / path.weight()).sum();
            prop_assert!((kraft - 1.0).abs() < 1e-12);
        }

        #[test]
        fn a_forged_path_leads_elsewhere(
            commitments in commitments(),
            place in any::<prop::sample::Index>(),
            step in any::<prop::sample::Index>(),
            bit in 0usize..256,
            how in 0usize..5,
        ) {
            let (root, paths) = hash_tree(&commitments);
            let place = place.index(commitments.len());
            let (mut commitment, mut path) = (commitments[place], paths[place].clone());
            let turned = |sibling: Sibling| match sibling {
                Sibling::Left(hash) => Sibling::Right(hash),
                Sibling::Right(hash) => Sibling::Left(hash),
            };
            match how {
                0 => commitment[bit / 8] ^= 1 << (bit % 8),
                1 => path.0.push(Sibling::Left([0; 32])),
                _ if path.0.is_empty() => return Ok(()),
                2 => { path.0.pop(); }
                3 => {
                    let step = step.index(path.0.len());
                    let (Sibling::Left(hash) | Sibling::Right(hash)) = &mut path.0[step];
                    hash[bit / 8] ^= 1 << (bit % 8);
                }
                _ => {
                    let step = step.index(path.0.len());
                    path.0[step] = turned(path.0[step]);
                }
            }
            prop_assert_ne!(path.root(&commitment), root);
        }
    }
}
