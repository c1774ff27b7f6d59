//! What is typed after `sombrero verify`.

use std::path::PathBuf;

#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    /// The key, or the report.
    #[arg(value_name = "KEY|REPORT")]
    pub(super) file: PathBuf,
    /// The file that the key was made for. For a report: if it is not beside it.
    #[arg(long, value_name = "FILE")]
    pub(super) original: Option<PathBuf>,
    /// For a report: the suspect, if it is not beside it.
    #[arg(long, value_name = "FILE")]
    pub(super) suspect: Option<PathBuf>,
    /// For a report: the key, if it is not beside it.
    #[arg(long, value_name = "FILE")]
    pub(super) key: Option<PathBuf>,
    /// Certificates (PEM) of the timestamping authorities that you trust.
    #[arg(long, value_name = "FILE")]
    pub(super) ca: Option<PathBuf>,
}
