//! What is typed after `sombrero embed`, and what it means.

use crate::args::finite;
use crate::catalogue::LockArgs;
use crate::desk::Desk;
use crate::failure::Failure;
use crate::files;
use sombrero::EmbedOptions;
use sombrero::basis::{BasisFunction, BasisOptions};
use sombrero::io::{Decimals, Rewrite};
use sombrero::watermark::{Identity, Parameters, Preset, Secret};
use std::ffi::OsStr;
use std::path::{Path, PathBuf};

#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    /// The mesh to mark; with --out-dir several, and folders of them. They stay as they are.
    #[arg(required = true, value_name = "INPUT")]
    inputs: Vec<PathBuf>,
    /// The marked copy, in the same format. Default: INPUT-marked, beside the input.
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    /// The key to write: secret, readable by you alone. Default: INPUT.key, beside the input.
    #[arg(long, value_name = "FILE")]
    key: Option<PathBuf>,
    /// A folder for many copies; their keys go to its subfolder `keys`.
    #[arg(long, value_name = "DIR", conflicts_with_all = ["output", "key"])]
    out_dir: Option<PathBuf>,
    /// A copy and a key for each line of this CSV file, which has a column `recipient`.
    #[arg(long, value_name = "CSV", requires = "out_dir", conflicts_with = "recipient")]
    recipients: Option<PathBuf>,
    /// Whose mark it is.
    #[arg(long, value_name = "TEXT", default_value = "")]
    owner: String,
    /// Whose copy it is.
    #[arg(long, value_name = "TEXT", default_value = "")]
    recipient: String,
    /// What the mark is made of: faithful (fields that nobody sees), robust (200 bumps that share the energy; survives
    /// more, and is seen on flat faces) or paper (the paper's 50).
    /// Default: faithful, and robust where --basis is given.
    #[arg(long, value_name = "NAME")]
    preset: Option<Preset>,
    /// How many coefficients carry the mark. Default: the preset's, or fewer on a small mesh.
    #[arg(long, value_name = "N")]
    coefficients: Option<usize>,
    /// Strength of the mark. Default: the preset's, 0.0038 (radians that normals turn by), 0.0088 or 0.01.
    #[arg(long, value_name = "E", allow_negative_numbers = true, value_parser = finite)]
    epsilon: Option<f64>,
    /// Lower epsilon so far that no vertex moves by more than this, in the units of the model, before the file rounds
    /// its numbers.
    #[arg(long, value_name = "LENGTH", allow_negative_numbers = true, value_parser = finite)]
    max_displacement: Option<f64>,
    /// Basis function of the presets robust and paper: sombrero, derby or hat. Default: sombrero.
    #[arg(long, value_name = "NAME")]
    basis: Option<BasisFunction>,
    /// A file with the secret, 64 hexadecimal digits. Default: the environment's SOMBRERO_SECRET, else a new one
    /// from the operating system. With --out-dir each copy has a secret of its own that follows from it.
    #[arg(long, value_name = "FILE")]
    secret_file: Option<PathBuf>,
    /// Turn stored normals and tangents as the surface turns. Default: they are data and stay.
    #[arg(long)]
    recompute_normals: bool,
    /// Decimals of all coordinates of a text file, at most 20. Default: those that most of the original's have, or as many
    /// more as keep rounding below a hundredth of the mark.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u8).range(..=20))]
    decimals: Option<u8>,
    /// Add what is marked to this catalogue, which is made if it is not there, and keep originals and keys in it, encrypted.
    #[arg(long, value_name = "CATALOGUE")]
    catalogue: Option<PathBuf>,
    #[command(flatten)]
    lock: LockArgs,
    /// Replace outputs that exist.
    #[arg(long)]
    force: bool,
}

/// The copies that were asked for.
pub(super) struct Plan<'a> {
    pub(super) inputs: &'a [PathBuf],
    pub(super) target: Target<'a>,
    pub(super) order: Order<'a>,
}

/// The place of the copies.
pub(super) enum Target<'a> {
    /// One copy, and its key; without a name, beside the input.
    Files { output: Option<&'a Path>, key: Option<&'a Path> },
    /// A copy of each input to a folder.
    Folder(&'a Path),
    /// A copy for each line of a list to a folder.
    Recipients { folder: &'a Path, list: &'a Path },
}

/// The way in which copies are made, wherever they go.
pub(super) struct Order<'a> {
    /// The mark of all copies; each may have a recipient of its own, and writes to a file of its own.
    pub(super) options: EmbedOptions,
    secret_file: Option<&'a Path>,
    /// The catalogue that keeps what is marked, and its lock.
    pub(super) catalogue: Option<(&'a Path, &'a LockArgs)>,
    pub(super) force: bool,
}

impl<'a> Plan<'a> {
    /// The plan of what was typed, checked.
    pub(super) fn new(args: &'a Args) -> Result<Self, Failure> {
        let target = match (&args.out_dir, &args.recipients, &args.output, &args.key) {
            (Some(folder), Some(list), ..) => Target::Recipients { folder, list },
            (Some(folder), None, ..) => Target::Folder(folder),
            (None, _, output, key) => Target::Files { output: output.as_deref(), key: key.as_deref() },
        };
        let options = EmbedOptions {
            parameters: args.parameters()?,
            fewer_if_small: args.coefficients.is_none(),
            max_displacement: args.max_displacement,
            identity: Identity { owner: args.owner.clone(), recipient: args.recipient.clone() },
            rewrite: Rewrite::default()
                .with_renewed_normals(args.recompute_normals)
                .with_decimals(args.decimals.map_or(Decimals::Own, Decimals::Number)),
        };
        let catalogue = args.catalogue.as_deref().map(|folder| (folder, &args.lock));
        if catalogue.is_none() && args.lock.is_given() {
            let message =
                "--encrypt-to and --passphrase-file are for what a catalogue keeps; give --catalogue";
            return Err(Failure::new("usage", message));
        }
        if catalogue.is_some() && args.inputs.iter().any(|input| files::is_standard(input)) {
            return Err(Failure::new("usage", "an original in a catalogue needs a name; give a file"));
        }
        let secret_file = args.secret_file.as_deref();
        let order = Order { options, secret_file, catalogue, force: args.force };
        Ok(Self { inputs: &args.inputs, target, order })
    }
}

impl Args {
    /// The preset's, as far as nothing else was asked for.
    fn parameters(&self) -> Result<Parameters, Failure> {
        let usual = if self.basis.is_some_and(|f| f != BasisFunction::Field) {
            Preset::Robust
        } else {
            Preset::default()
        };
        let named = self.preset.unwrap_or(usual);
        let Parameters { preset, basis, epsilon } = named.parameters();
        if let Some(function) = self.basis.filter(|f| !basis.amplitudes.suit(*f)) {
            let cure = if function == BasisFunction::Field { "faithful" } else { "robust or paper" };
            let message = format!("--basis {function} is not of --preset {named}; give --preset {cure}");
            return Err(Failure::new("usage", &message));
        }
        let chosen = self.coefficients.is_some() || self.basis.is_some() || self.epsilon.is_some();
        Ok(Parameters {
            preset: preset.filter(|_| !chosen),
            basis: BasisOptions {
                coefficients: self.coefficients.unwrap_or(basis.coefficients),
                function: self.basis.unwrap_or(basis.function),
                ..basis
            },
            epsilon: self.epsilon.unwrap_or(epsilon),
        })
    }
}

impl Order<'_> {
    /// The secret that was given, if any.
    pub(super) fn secret(&self, desk: &Desk) -> Result<Option<Secret>, Failure> {
        files::given_secret(self.secret_file, desk)
    }

    /// The file that holds the secret, which no output may replace.
    pub(super) fn secret_file(&self) -> Option<&Path> {
        self.secret_file
    }

    /// The way to write the copy that gets this name.
    pub(super) fn rewrite(&self, output: &Path) -> Rewrite {
        let rewrite = self.options.rewrite.clone();
        match output.file_stem().and_then(OsStr::to_str) {
            Some(stem) => rewrite.with_stem(stem),
            None => rewrite,
        }
    }
}
