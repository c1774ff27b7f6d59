//! The command line, as `--help` shows it.

use clap::{Args, Parser, Subcommand, ValueEnum};
use sombrero::attacks::Attack;
use sombrero::basis::BasisFunction;
use sombrero::io::Limits;
use sombrero::watermark::Preset;
use std::path::PathBuf;

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
    /// How much is read of a mesh file.
    pub(crate) fn limits(&self) -> Limits {
        let usual = Limits::default();
        usual
            .with_max_bytes(self.max_bytes.unwrap_or(usual.max_bytes))
            .with_max_vertices(self.max_vertices.unwrap_or(usual.max_vertices))
    }
}

/// A number of bytes: digits, and K, M or G for powers of 1024.
fn bytes(text: &str) -> Result<u64, String> {
    let upper = text.to_ascii_uppercase();
    let digits = upper.trim_end_matches(['K', 'M', 'G']);
    let unit = match &upper[digits.len()..] {
        "" => Some(1),
        "K" => Some(1 << 10),
        "M" => Some(1 << 20),
        "G" => Some(1 << 30),
        _ => None,
    };
    let size = digits.parse::<u64>().ok().zip(unit).and_then(|(n, unit)| n.checked_mul(unit));
    size.ok_or_else(|| format!("`{text}` is not a size; write bytes, or a number with K, M or G"))
}

#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Mark a mesh file: a copy with invisible changes, and the secret key that finds them again.
    #[command(
        after_help = "Example: sombrero embed vase.obj -o vase-marked.obj --key vase.key --owner \"A. Museum\"\n\
        A copy for each buyer: sombrero embed vase.obj --recipients buyers.csv --out-dir copies\n\
        All models of a folder: sombrero embed models --out-dir marked\n\
        Keep the original file and the keys secret, and publish the marked copies. With --out-dir, keys go to\n\
        DIR/keys, and what is there already is kept: a run that was broken off goes on where it was.\n\
        buyers.csv has a first line of names and a column `recipient`; a column `file` names the copies."
    )]
    Embed(Embed),
    /// Tell whether a suspect mesh carries the mark.
    #[command(
        after_help = "Example: sombrero detect found.obj --original vase.obj --key vase.key --report found.html\n\
        Several: sombrero detect downloads more.stl --original vase.obj --key vase.key --json\n\
        Of a folder all files with a mesh's extension are looked at. Exit status: the worst of all."
    )]
    Detect(Detect),
    /// Find out whose copy a suspect mesh is, among many keys of one original.
    #[command(after_help = "Example: sombrero trace leaked.obj --original vase.obj --keys copies/keys\n\
        Several who averaged their copies are named too. The chance to name anybody who had no part is at most the\n\
        threshold, however many keys there are. For evidence against one of them, use `detect` with that key.")]
    Trace(Trace),
    /// Apply attacks to a mesh, to see what the mark survives.
    #[command(
        after_help = "Example: sombrero attack marked.obj -o noisy.obj noise:amplitude=0.002 smooth:iterations=10\n\
        Attacks: none, reorder, noise:amplitude=A, coordinate-noise:amplitude=A,\n\
        smooth:iterations=N,lambda=L,mu=M,\n\
        laplacian:iterations=N,lambda=L, quantize:bits=B,\n\
        transform:rotation=DEGREES,translation=T,scale=S, affine:strength=S, projective:strength=S,\n\
        ffd:strength=S,lattice=N, simplify:ratio=R, subdivide:scheme=midpoint|loop,iterations=N,\n\
        remesh:length=L,iterations=N, isosurface:resolution=N,\n\
        watermark:preset=P,epsilon=E,coefficients=N,basis=B, crop:fraction=F, crop:vertices=F.\n\
        Lengths are fractions of the largest side of the bounding box; that of remesh is a multiple of\n\
        the mean edge length."
    )]
    Attack(AttackArgs),
    /// Measure how far two meshes are apart.
    #[command(after_help = "Example: sombrero compare vase.obj vase-marked.obj")]
    Compare(Compare),
    /// Draw a mesh as a picture, or how far it is from another one.
    #[command(after_help = "Example: sombrero render vase-marked.obj -o vase.png --compare vase.obj\n\
        With --compare the colour shows how far each vertex is from the surface of the other mesh, as they stand.")]
    Render(Render),
    /// Say what a mesh file is and whether it can be marked.
    #[command(after_help = "Example: sombrero info vase.obj")]
    Info(Info),
    /// Compute once what every detection against an original needs, and store it beside the key.
    #[command(after_help = "Example: sombrero prepare --original vase.obj --key vase.key\n\
        It writes vase.key.prepared, which `detect` then uses: worth it for many suspects of a large original.\n\
        Keep it as private as the original.")]
    Prepare(Prepare),
    /// Check a key, or every figure of a report, by deriving all of it again.
    #[command(after_help = "Example: sombrero verify vase.key --original vase.obj\n\
        A report: sombrero verify found.html\n\
        A report is a page of `detect --report`, or what `detect --json` printed. The files that it names are read\n\
        again, from where it was made or beside the report; other places can be given. Exit status 1: a figure differs.")]
    Verify(Verify),
    /// Commit to a key before publishing: the digest to have timestamped, and the token to keep with the key.
    #[command(after_help = "Example: sombrero commit vase.obj --key vase.key\n\
        It prints a digest and writes vase.key.tsq, a request by RFC 3161. Send it to a timestamping authority, then\n\
        sombrero commit vase.obj --key vase.key --token vase.key.tsr --ca authority.pem\n\
        stores the answer in the key, and `verify` checks it.\n\
        What this proves: key, owner's and recipient's text and original existed at that time, in this form. What not:\n\
        who had them, who made the model, or that nobody had it before.")]
    Commit(Commit),
    /// Make models, mark and attack them, look for the marks: a table, meshes, keys, a picture and a report.
    #[command(after_help = "Example: sombrero demo -o demo")]
    Demo(Demo),
    /// Print what a shell needs to complete commands and options.
    #[command(
        after_help = "Example: sombrero completions bash > ~/.local/share/bash-completion/completions/sombrero"
    )]
    Completions(Completions),
    /// Write the manual pages.
    #[command(after_help = "Example: sombrero man -o ~/.local/share/man/man1")]
    Man(Man),
}

/// A number that one can compute with.
fn finite(text: &str) -> Result<f64, String> {
    let number = text.parse().ok().filter(|x: &f64| x.is_finite());
    number.ok_or_else(|| format!("`{text}` is not a number to compute with"))
}

#[derive(Debug, Args)]
pub(crate) struct Embed {
    /// The mesh to mark; with --out-dir several, and folders of them. They stay as they are.
    #[arg(required = true, value_name = "INPUT")]
    pub(crate) inputs: Vec<PathBuf>,
    /// The marked copy, in the same format.
    #[arg(short, long, value_name = "FILE")]
    pub(crate) output: Option<PathBuf>,
    /// The key to write: secret, readable by you alone.
    #[arg(long, value_name = "FILE")]
    pub(crate) key: Option<PathBuf>,
    /// A folder for many copies; their keys go to its subfolder `keys`.
    #[arg(long, value_name = "DIR", conflicts_with_all = ["output", "key"])]
    pub(crate) out_dir: Option<PathBuf>,
    /// A copy and a key for each line of this CSV file, which has a column `recipient`.
    #[arg(long, value_name = "CSV", requires = "out_dir", conflicts_with = "recipient")]
    pub(crate) recipients: Option<PathBuf>,
    /// Whose mark it is.
    #[arg(long, value_name = "TEXT", default_value = "")]
    pub(crate) owner: String,
    /// Whose copy it is.
    #[arg(long, value_name = "TEXT", default_value = "")]
    pub(crate) recipient: String,
    /// What the mark is made of: robust (200 coefficients that share the energy) or paper (the paper's 50). Both
    /// move vertices about equally far.
    #[arg(long, value_name = "NAME", default_value_t = Preset::default())]
    pub(crate) preset: Preset,
    /// How many coefficients carry the mark. Default: the preset's, or fewer on a small mesh.
    #[arg(long, value_name = "N")]
    pub(crate) coefficients: Option<usize>,
    /// Strength of the mark. Default: the preset's, 0.0088 or 0.01.
    #[arg(long, value_name = "E", allow_negative_numbers = true, value_parser = finite)]
    pub(crate) epsilon: Option<f64>,
    /// Lower epsilon so far that no vertex moves by more than this, in the units of the model, before the file rounds
    /// its numbers.
    #[arg(long, value_name = "LENGTH", allow_negative_numbers = true, value_parser = finite)]
    pub(crate) max_displacement: Option<f64>,
    /// Basis function: sombrero, derby or hat. Default: sombrero.
    #[arg(long, value_name = "NAME")]
    pub(crate) basis: Option<BasisFunction>,
    /// A file with the secret, 64 hexadecimal digits. Default: the environment's SOMBRERO_SECRET, else a new one
    /// from the operating system. With --out-dir each copy has a secret of its own that follows from it.
    #[arg(long, value_name = "FILE")]
    pub(crate) secret_file: Option<PathBuf>,
    /// Turn stored normals and tangents as the surface turns. Default: they are data and stay.
    #[arg(long)]
    pub(crate) recompute_normals: bool,
    /// Replace outputs that exist.
    #[arg(long)]
    pub(crate) force: bool,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum Method {
    /// What else was done to the shape is solved for too; several tests.
    Robust,
    /// The paper's: resampling, least squares, correlation, t test.
    Paper,
}

impl From<Method> for sombrero::Method {
    fn from(method: Method) -> Self {
        match method {
            Method::Robust => Self::Robust,
            Method::Paper => Self::Paper,
        }
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum When {
    /// As the suspect asks for; the paper's method tries with and without, and the better one counts.
    Auto,
    /// Only with it.
    Always,
    /// Only without it.
    Never,
}

impl From<When> for sombrero::When {
    fn from(step: When) -> Self {
        match step {
            When::Auto => Self::Auto,
            When::Always => Self::Always,
            When::Never => Self::Never,
        }
    }
}

#[derive(Debug, Args)]
pub(crate) struct Detect {
    /// The meshes to look at, and folders of them.
    #[arg(required = true, value_name = "SUSPECT")]
    pub(crate) suspects: Vec<PathBuf>,
    /// The file that was marked, exactly.
    #[arg(long, value_name = "FILE")]
    pub(crate) original: PathBuf,
    /// The key that `embed` wrote.
    #[arg(long, value_name = "FILE")]
    pub(crate) key: PathBuf,
    /// A prepared file of your own making, which is taken at its word. Default: the one beside the key, KEY.prepared;
    /// if there is one, what is found with it is confirmed without it.
    #[arg(long, value_name = "FILE")]
    pub(crate) prepared: Option<PathBuf>,
    /// How to look.
    #[arg(long, value_enum, default_value_t = Method::Robust)]
    pub(crate) method: Method,
    /// Align the suspect to the original first (similarity: turned, moved, scaled).
    #[arg(long, value_enum, default_value_t = When::Auto)]
    pub(crate) registration: When,
    /// Resample the suspect to the original's connectivity; with --method robust, compare surfaces instead of vertices.
    #[arg(long, value_enum, default_value_t = When::Auto)]
    pub(crate) resampling: When,
    /// The mark counts as found when the probability of a chance match is at most this.
    #[arg(long, value_name = "P", default_value_t = 1e-6, allow_negative_numbers = true, value_parser = finite)]
    pub(crate) threshold: f64,
    /// Write a report for people: one HTML page with plot, pictures and a view to turn. With several suspects a
    /// folder, where each has its page.
    #[arg(long, value_name = "FILE")]
    pub(crate) report: Option<PathBuf>,
    /// Seed of the points that resampling draws on the suspect.
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub(crate) seed: u64,
    /// Replace a report that exists.
    #[arg(long)]
    pub(crate) force: bool,
}

#[derive(Debug, Args)]
pub(crate) struct AttackArgs {
    /// The mesh to attack. It stays as it is.
    pub(crate) input: PathBuf,
    /// The attacked mesh, in the same format.
    #[arg(short, long, value_name = "FILE")]
    pub(crate) output: PathBuf,
    /// The attacks, in order.
    #[arg(required = true, value_name = "SPEC")]
    pub(crate) attacks: Vec<Attack>,
    /// Seed of everything random.
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub(crate) seed: u64,
    /// Replace an output that exists.
    #[arg(long)]
    pub(crate) force: bool,
}

#[derive(Debug, Args)]
pub(crate) struct Compare {
    /// The first mesh; relative lengths are fractions of its size.
    pub(crate) a: PathBuf,
    /// The second mesh.
    pub(crate) b: PathBuf,
}

#[derive(Debug, Args)]
pub(crate) struct Render {
    /// The mesh to draw.
    pub(crate) mesh: PathBuf,
    /// The picture, as PNG.
    #[arg(short, long, value_name = "FILE")]
    pub(crate) output: PathBuf,
    /// A mesh to measure the distance from; both stay where they stand.
    #[arg(long, value_name = "MESH")]
    pub(crate) compare: Option<PathBuf>,
    /// Pixels along each side.
    #[arg(long, value_name = "N", default_value_t = 800, value_parser = clap::value_parser!(u32).range(16..=4096))]
    pub(crate) size: u32,
    /// The axis that points upwards: y in most files for display, z in many of scanners and printers.
    #[arg(long, value_enum, default_value_t = Up::Y)]
    pub(crate) up: Up,
    /// Draw the edges of the triangles.
    #[arg(long)]
    pub(crate) wireframe: bool,
    /// Replace a picture that exists.
    #[arg(long)]
    pub(crate) force: bool,
}

/// An axis of the model.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum Up {
    Y,
    Z,
}

#[derive(Debug, Args)]
pub(crate) struct Info {
    /// The mesh.
    pub(crate) mesh: PathBuf,
}

#[derive(Debug, Args)]
pub(crate) struct Prepare {
    /// The file that was marked, exactly.
    #[arg(long, value_name = "FILE")]
    pub(crate) original: PathBuf,
    /// The key that `embed` wrote.
    #[arg(long, value_name = "FILE")]
    pub(crate) key: PathBuf,
    /// The prepared file, readable by you alone. Default: KEY.prepared, where `detect` looks for it.
    #[arg(short, long, value_name = "FILE")]
    pub(crate) output: Option<PathBuf>,
    /// Replace a prepared file that exists.
    #[arg(long)]
    pub(crate) force: bool,
}

#[derive(Debug, Args)]
pub(crate) struct Verify {
    /// The key, or the report.
    #[arg(value_name = "KEY|REPORT")]
    pub(crate) file: PathBuf,
    /// The file that the key was made for. A report names it.
    #[arg(long, value_name = "FILE")]
    pub(crate) original: Option<PathBuf>,
    /// For a report: the suspect, if it is elsewhere now.
    #[arg(long, value_name = "FILE")]
    pub(crate) suspect: Option<PathBuf>,
    /// For a report: the key, if it is elsewhere now.
    #[arg(long, value_name = "FILE")]
    pub(crate) key: Option<PathBuf>,
    /// Certificates (PEM) of the timestamping authorities that you trust.
    #[arg(long, value_name = "FILE")]
    pub(crate) ca: Option<PathBuf>,
}

#[derive(Debug, Args)]
pub(crate) struct Trace {
    /// The mesh to look at.
    pub(crate) suspect: PathBuf,
    /// The file that was marked, exactly.
    #[arg(long, value_name = "FILE")]
    pub(crate) original: PathBuf,
    /// The folder with the keys of all copies.
    #[arg(long, value_name = "DIR")]
    pub(crate) keys: PathBuf,
    /// Align the suspect to the original first (similarity: turned, moved, scaled).
    #[arg(long, value_enum, default_value_t = When::Auto)]
    pub(crate) registration: When,
    /// Compare surfaces instead of vertices.
    #[arg(long, value_enum, default_value_t = When::Auto)]
    pub(crate) resampling: When,
    /// A recipient is named when the chance that anybody without a part matches as well is at most this.
    #[arg(long, value_name = "P", default_value_t = 1e-6, allow_negative_numbers = true, value_parser = finite)]
    pub(crate) threshold: f64,
}

#[derive(Debug, Args)]
pub(crate) struct Commit {
    /// The file that was marked.
    pub(crate) input: PathBuf,
    /// Its key.
    #[arg(long, value_name = "FILE")]
    pub(crate) key: PathBuf,
    /// The request to write. Default: KEY.tsq.
    #[arg(short, long, value_name = "FILE", conflicts_with = "token")]
    pub(crate) output: Option<PathBuf>,
    /// Also write the statement that the digest is of. It opens the commitment and is as secret as the key.
    #[arg(long, value_name = "FILE")]
    pub(crate) statement: Option<PathBuf>,
    /// The authority's answer, to be checked and stored in the key.
    #[arg(long, value_name = "FILE")]
    pub(crate) token: Option<PathBuf>,
    /// Certificates (PEM) of the timestamping authorities that you trust.
    #[arg(long, value_name = "FILE", requires = "token")]
    pub(crate) ca: Option<PathBuf>,
    /// Replace outputs that exist, or a token that the key has.
    #[arg(long)]
    pub(crate) force: bool,
}

#[derive(Debug, Args)]
pub(crate) struct Completions {
    /// The shell.
    #[arg(value_enum)]
    pub(crate) shell: clap_complete::Shell,
}

#[derive(Debug, Args)]
pub(crate) struct Man {
    /// The folder for one page a command. Default: the page of `sombrero` to standard output.
    #[arg(short, long, value_name = "DIR")]
    pub(crate) output: Option<PathBuf>,
    /// Replace pages that exist.
    #[arg(long)]
    pub(crate) force: bool,
}

#[derive(Debug, Args)]
pub(crate) struct Demo {
    /// The folder to write to.
    #[arg(short, long, value_name = "DIR", default_value = "sombrero-demo")]
    pub(crate) output: PathBuf,
    /// Seed of everything random.
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub(crate) seed: u64,
    /// Replace files that exist.
    #[arg(long)]
    pub(crate) force: bool,
}
