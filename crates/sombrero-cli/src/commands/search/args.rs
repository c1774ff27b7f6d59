//! What is typed after `sombrero search`.

use crate::args::finite;
use crate::catalogue::UnlockArgs;
use crate::shard::ShardArgs;
use std::path::PathBuf;

#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    /// The meshes to look at, and folders of them.
    #[arg(required = true, value_name = "SUSPECT")]
    pub(super) suspects: Vec<PathBuf>,
    /// The catalogue of originals.
    #[arg(long, value_name = "CATALOGUE")]
    pub(super) catalogue: PathBuf,
    /// The folder with the keys to test. Default: those that the catalogue keeps.
    #[arg(long, value_name = "DIR")]
    pub(super) keys: Option<PathBuf>,
    /// Only rank the originals by shape: test no key and ask for no passphrase.
    #[arg(long, conflicts_with = "keys")]
    pub(super) rank_only: bool,
    /// The number of originals to rank, and to test.
    #[arg(long, value_name = "N", default_value_t = 10, value_parser = clap::builder::RangedU64ValueParser::<usize>::new().range(1..=1000))]
    pub(super) top: usize,
    /// A mark counts as found when the chance that any of the tests of this search matches as well by accident is at most this.
    #[arg(long, value_name = "P", default_value_t = 1e-6, allow_negative_numbers = true, value_parser = finite)]
    pub(super) threshold: f64,
    /// Write a page with pictures of the candidates, and beside it the report of the best, FILE-detection.html.
    #[arg(long, value_name = "FILE")]
    pub(super) report: Option<PathBuf>,
    #[command(flatten)]
    pub(super) shard: ShardArgs,
    #[command(flatten)]
    pub(super) unlock: UnlockArgs,
    /// Replace reports that exist.
    #[arg(long)]
    pub(crate) force: bool,
}
