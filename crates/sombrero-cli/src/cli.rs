//! The command line as a whole: the program, its commands, and what each is told beside its own arguments.

use crate::args::bytes;
use crate::commands::{
    attack, catalogue, commit, compare, completions, demo, detect, embed, info, man, prepare, render, search,
    trace, verify,
};
use clap::{Arg, CommandFactory, FromArgMatches, Parser, Subcommand};
use sombrero::io::Limits;
use std::ffi::OsString;

/// Prove whose a 3D model is: invisible, robust watermarks in the shape of triangle meshes.
#[derive(Debug, Parser)]
#[command(
    name = "sombrero",
    bin_name = "sombrero",
    version,
    propagate_version = true,
    arg_required_else_help = true
)]
#[command(after_help = "Exit status: 0 done (detect: found), 1 no watermark found, 2 any failure.\n\
    Formats: OBJ, PLY, STL, OFF, glTF/GLB, 3MF, told by content. `-` is standard input or output.\n\
    Try `sombrero demo`.")]
pub(crate) struct Cli {
    #[command(subcommand)]
    pub(crate) command: Command,

    /// Print exactly one JSON object on stdout; one a line where there are several inputs.
    #[arg(long, global = true)]
    pub(crate) json: bool,

    /// Print nothing but errors: no answer (but --json's), no progress.
    #[arg(short, long, global = true, conflicts_with = "verbose")]
    pub(crate) quiet: bool,

    /// Say on stderr how long each stage took.
    #[arg(short, long, global = true)]
    pub(crate) verbose: bool,

    /// Threads to use; the result does not depend on it. Default: all cores.
    #[arg(long, global = true, value_name = "N", value_parser = clap::builder::RangedU64ValueParser::<usize>::new().range(1..=1024))]
    pub(crate) threads: Option<usize>,

    /// The largest mesh file to read, such as 500M or 8G. Default: 2G.
    #[arg(long, global = true, value_name = "SIZE", value_parser = bytes)]
    pub(crate) max_bytes: Option<u64>,

    /// The most vertices that a mesh file may hold. Default: 200 million.
    #[arg(long, global = true, value_name = "N")]
    pub(crate) max_vertices: Option<usize>,
}

impl Cli {
    /// The command line of these words, the program's name first.
    pub(crate) fn parse_from_typed(words: &[OsString]) -> Result<Self, clap::Error> {
        Self::from_arg_matches(&command().try_get_matches_from(words)?)
    }

    /// The limits of what is read of a mesh file.
    pub(crate) fn limits(&self) -> Limits {
        let usual = Limits::default();
        usual
            .with_max_bytes(self.max_bytes.unwrap_or(usual.max_bytes))
            .with_max_vertices(self.max_vertices.unwrap_or(usual.max_vertices))
    }
}

/// The command line as clap knows it, for help, completions and manual pages too.
pub(crate) fn command() -> clap::Command {
    let of_trace = |arg: Arg| {
        match arg.get_id().as_str() {
        // It shares these arguments with `detect`, for which they are worded.
        "resampling" => arg.help("Compare surfaces instead of vertices"),
        "threshold" => arg.help(
            "A recipient is named when the chance that anybody without a part matches as well is at most this",
        ),
        _ => arg,
    }
    };
    let worded = |command: clap::Command| match command.get_name() {
        "trace" => command.mut_args(of_trace),
        _ => command,
    };
    Cli::command().mut_subcommands(worded)
}

#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Mark a mesh file: a copy with invisible changes, and the secret key that finds them again.
    #[command(after_help = "Example: sombrero embed vase.obj, which writes vase-marked.obj and vase.key\n\
        With names: sombrero embed vase.obj -o vase-marked.obj --key vase.key --owner \"A. Museum\"\n\
        A copy for each buyer: sombrero embed vase.obj --recipients buyers.csv --out-dir copies\n\
        All models of a folder and those below it: sombrero embed models --out-dir marked\n\
        Keep the original file and the keys secret, and publish the marked copies. With --out-dir, keys go to\n\
        DIR/keys, and what is there already is kept: a run that was broken off goes on where it was.\n\
        Kept for you, encrypted: sombrero embed vase.obj --catalogue models, and later sombrero search\n\
        buyers.csv has a first line of names and a column `recipient`; a column `file` names the copies. Commas, semicolons\n\
        or tabs separate columns.")]
    Embed(embed::args::Args),
    /// Tell whether a suspect mesh carries the mark.
    #[command(
        after_help = "Example: sombrero detect found.obj --original vase.obj --key vase.key --report found.html\n\
        Several: sombrero detect downloads more.stl --original vase.obj --key vase.key --json\n\
        Of a folder and those below it all files with a mesh's extension are looked at. Exit status of several: 2 when one\n\
        cannot be looked at, else 0 when one is found, else 1."
    )]
    Detect(detect::args::Args),
    /// Find out whose copy a suspect mesh is, among many keys of one original.
    #[command(after_help = "Example: sombrero trace leaked.obj --original vase.obj --keys copies/keys\n\
        Several who averaged their copies are named too. The chance to name anybody who had no part is at most the\n\
        threshold, however many keys there are. For evidence against one of them, use `detect` with that key.")]
    Trace(trace::Args),
    /// Find out which original of a catalogue a suspect mesh was made from, and whose copy it is.
    #[command(after_help = "Example: sombrero search leaked.obj --catalogue models\n\
        Originals are ranked by their shape. Where the catalogue keeps keys, or with --keys, the best are tested one after the other\n\
        until a mark is found, which names the recipient. What is kept is read with its passphrase, which is asked for.\n\
        Of several suspects each is a line. Exit status: 0 found (without keys: there is a candidate), 1 not, 2 any failure.")]
    Search(search::args::Args),
    /// Keep a catalogue of originals: a memory of their shapes, and if you like of the files and keys themselves.
    Catalogue(catalogue::Args),
    /// Apply attacks to a mesh, to see what the mark survives.
    #[command(
        after_help = "Example: sombrero attack marked.obj -o noisy.obj noise:amplitude=0.002 smooth:iterations=10\n\
        Attacks: none, reorder, noise:amplitude=A, coordinate-noise:amplitude=A,\n\
        smooth:iterations=N,lambda=L,mu=M,\n\
        laplacian:iterations=N,lambda=L, quantize:bits=B,\n\
        transform:rotation=DEGREES,translation=T,scale=S, affine:strength=S, projective:strength=S,\n\
        ffd:strength=S,lattice=N, simplify:ratio=R, subdivide:scheme=midpoint|loop,iterations=N,\n\
        remesh:length=L,iterations=N, isosurface:resolution=N,\n\
        watermark:preset=P,epsilon=E,coefficients=N,basis=B, crop:fraction=F, crop:vertices=F,\n\
        mirror, print:size=MM (printed and scanned, a simulation), points:count=N (a point cloud).\n\
        Lengths are fractions of the largest side of the bounding box; that of remesh is a multiple of\n\
        the mean edge length."
    )]
    Attack(attack::Args),
    /// Measure how far two meshes are apart.
    #[command(after_help = "Example: sombrero compare vase.obj vase-marked.obj")]
    Compare(compare::Args),
    /// Draw a mesh as a picture, or how far it is from another one.
    #[command(after_help = "Example: sombrero render vase-marked.obj -o vase.png --compare vase.obj\n\
        With --compare the colour shows how far each vertex is from the surface of the other mesh, as they stand.")]
    Render(render::Args),
    /// Say what a mesh file is and whether it can be marked.
    #[command(after_help = "Example: sombrero info vase.obj")]
    Info(info::Args),
    /// Compute once what every detection against an original needs, and store it beside the key.
    #[command(after_help = "Example: sombrero prepare --original vase.obj --key vase.key\n\
        It writes vase.key.prepared, which `detect` then uses: worth it for many suspects of a large original.\n\
        Keep it as private as the original.")]
    Prepare(prepare::Args),
    /// Check a key, or every figure and word of a report, by deriving all of it again.
    #[command(after_help = "Example: sombrero verify vase.key --original vase.obj\n\
        A report: sombrero verify found.html\n\
        A report is a page of `detect --report`, or what `detect --json` printed. The files that it names are\n\
        looked for beside it and nowhere else, unless their places are given. Exit status 1: something differs.")]
    Verify(verify::args::Args),
    /// Commit to a key before publishing: the digest to have timestamped, and the token to keep with the key.
    #[command(after_help = "Example: sombrero commit vase.obj --key vase.key\n\
        It prints a digest and writes vase.key.tsq, a request by RFC 3161. Send it to a timestamping authority, then\n\
        sombrero commit vase.obj --key vase.key --token vase.key.tsr --ca authority.pem\n\
        stores the answer in the key, and `verify` checks it.\n\
        What this proves: key, owner's and recipient's text and original existed at that time, in this form. What not:\n\
        who had them, who made the model, or that nobody had it before.")]
    Commit(commit::Args),
    /// Make models, mark and attack them, look for the marks: a table, meshes, keys, a picture and a report.
    #[command(after_help = "Example: sombrero demo -o demo")]
    Demo(demo::Args),
    /// Print what a shell needs to complete commands and options.
    #[command(
        after_help = "Example: sombrero completions bash > ~/.local/share/bash-completion/completions/sombrero"
    )]
    Completions(completions::Args),
    /// Write the manual pages.
    #[command(after_help = "Example: sombrero man -o ~/.local/share/man/man1")]
    Man(man::Args),
}
