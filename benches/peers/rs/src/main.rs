//! Peers in Rust. `peers STAGE MODEL...` prints a JSON line per measurement; `../README.md` tells the environment
//! variables and the files.

mod timer;

use faer::prelude::*;
use faer::sparse::{SparseColMat, SymbolicSparseColMat};
use serde_json::{Value, json};
use std::process::{Command, Stdio};
use std::{env, fs, thread, time::Duration};
use timer::{Timer, number};

/// One measurement: makes its inputs, times with the timer, and returns how good the answer is.
struct Job {
    /// The letter (or word) that the caller asks with.
    key: &'static str,
    stage: &'static str,
    peer: &'static str,
    package: &'static str,
    run: fn(&str, &mut Timer) -> Value,
}

#[rustfmt::skip]
const JOBS: &[Job] = &[
    Job { key: "limit", stage: "limit copy", peer: "1 thread(s)", package: "", run: |_, t| copy(1, t) },
    Job { key: "limit", stage: "limit read", peer: "1 thread(s)", package: "", run: |_, t| sum(1, t) },
    Job { key: "limit", stage: "limit copy", peer: "2 thread(s)", package: "", run: |_, t| copy(2, t) },
    Job { key: "limit", stage: "limit read", peer: "2 thread(s)", package: "", run: |_, t| sum(2, t) },
    Job { key: "a", stage: "a simplify to 200 faces", peer: "meshoptimizer (half-edge)", package: "meshopt", run: collapse },
    Job { key: "a", stage: "a simplify to 200 faces", peer: "meshoptimizer sloppy", package: "meshopt", run: sloppy },
    Job { key: "b", stage: "b build", peer: "parry3d f32, 1 thread", package: "parry3d", run: parry_f32::build },
    Job { key: "b", stage: "b query", peer: "parry3d f32, 1 thread", package: "parry3d", run: parry_f32::query },
    Job { key: "b", stage: "b build", peer: "parry3d f64, 1 thread", package: "parry3d-f64", run: parry_f64::build },
    Job { key: "b", stage: "b query", peer: "parry3d f64, 1 thread", package: "parry3d-f64", run: parry_f64::query },
    Job { key: "d", stage: "d least squares", peer: "faer sparse QR", package: "faer", run: sparse_qr },
    Job { key: "d", stage: "d least squares", peer: "faer dense QR", package: "faer", run: dense_qr },
    Job { key: "d", stage: "d least squares", peer: "faer dense normal equations", package: "faer", run: normal_equations },
    Job { key: "f", stage: "f load obj", peer: "tobj", package: "tobj", run: load_obj },
    Job { key: "f", stage: "f load ply", peer: "ply-rs", package: "ply-rs", run: load_ply },
];

impl Job {
    fn row(&self, model: &str) -> Value {
        json!({ "stage": self.stage, "model": model, "peer": self.peer, "version": version(self.package) })
    }

    fn wanted(&self) -> bool {
        let only = env::var("PEERS_ONLY").unwrap_or_default().to_lowercase();
        let mut parts = only.split(',').map(str::trim).filter(|part| !part.is_empty()).peekable();
        parts.peek().is_none() || parts.any(|part| self.peer.to_lowercase().contains(part))
    }
}

/// What the lock file says, so that no row tells an old version.
fn version(package: &str) -> &'static str {
    let name = format!("name = \"{package}\"\nversion = \"");
    let lock = include_str!("../Cargo.lock");
    lock.split_once(&name).and_then(|(_, rest)| rest.split('"').next()).unwrap_or("own")
}

fn main() {
    let args: Vec<String> = env::args().skip(1).collect();
    match args.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        ["--job", job, model] => child(&JOBS[job.parse::<usize>().expect("a number")], model),
        ["limit"] => run("limit", "256 MiB"),
        [key, ref models @ ..] if JOBS.iter().any(|job| job.key == key) => {
            models.iter().for_each(|m| run(key, m))
        }
        _ => {
            eprintln!("usage: peers limit, or peers a|b|d|f MODEL...");
            std::process::exit(2);
        }
    }
}

/// Each job in a process of its own, so that a crash, a hang and the memory are its alone.
fn run(key: &str, model: &str) {
    for (index, job) in JOBS.iter().enumerate().filter(|(_, job)| job.key == key && job.wanted()) {
        let this = env::current_exe().expect("a path");
        let mut child = Command::new(this);
        child.args(["--job", &index.to_string(), model]).stdout(Stdio::piped());
        let output = child.output().expect("a process");
        let text = String::from_utf8_lossy(&output.stdout);
        match text.lines().last() {
            Some(line) => println!("{line}"),
            None => println!("{}", failed(job, model, &output.status.to_string())),
        }
    }
}

fn failed(job: &Job, model: &str, why: &str) -> Value {
    let mut row = job.row(model);
    row["error"] = why.chars().take(160).collect::<String>().into();
    row
}

fn child(job: &'static Job, model: &str) {
    let fail = {
        let model = model.to_owned();
        move |why: &str| {
            println!("{}", failed(job, &model, why));
            std::process::exit(0)
        }
    };
    let limit = number("PEER_TIMEOUT", 300);
    let late = fail.clone();
    thread::spawn(move || {
        thread::sleep(Duration::from_secs(limit as u64));
        late(&format!("over {limit} s"))
    });
    std::panic::set_hook(Box::new(move |info| fail(info.payload_as_str().unwrap_or("panicked"))));

    let mut timer = Timer::new(number("REPEATS", 3));
    let acc = (job.run)(model, &mut timer);
    let mut row = job.row(model);
    timer.fill_in(&mut row);
    row["acc"] = acc;
    println!("{row}");
}

// The cases.

fn path(name: &str) -> String {
    format!("{}/{name}", env::var("CASES").unwrap_or("cases".into()))
}

fn read<const N: usize, T>(name: &str, from: fn([u8; N]) -> T) -> Vec<T> {
    let bytes = fs::read(path(name)).unwrap_or_else(|e| panic!("{name}: {e}"));
    bytes.as_chunks().0.iter().map(|&chunk| from(chunk)).collect()
}

fn reals(name: &str) -> Vec<f64> {
    read(name, f64::from_le_bytes)
}

fn points(name: &str) -> Vec<[f64; 3]> {
    reals(name).as_chunks().0.to_vec()
}

fn faces(model: &str) -> Vec<[u32; 3]> {
    read(&format!("{model}.f.u32"), u32::from_le_bytes).as_chunks().0.to_vec()
}

// a: simplification.

const TARGET: usize = 200;

type Simplify = fn(&[u32], &meshopt::VertexDataAdapter<'_>) -> Vec<u32>;

fn simplify(model: &str, t: &mut Timer, tag: &str, method: Simplify) -> Value {
    let vertices = reals(&format!("{model}.v.f64"));
    let bytes: Vec<u8> = vertices.iter().flat_map(|&x| (x as f32).to_le_bytes()).collect();
    let adapter = meshopt::VertexDataAdapter::new(&bytes, 12, 0).expect("three floats a vertex");
    let indices = faces(model).concat();
    let simple = t.run(|| method(&indices, &adapter));

    // The vertices are some of the original's; the caller scores the mesh.
    let tag = format!("{model}.{tag}");
    let base = format!("{}/{tag}", env::var("PEERS_TMP").unwrap_or("/tmp".into()));
    let v: Vec<u8> = vertices.iter().flat_map(|x| x.to_le_bytes()).collect();
    let f: Vec<u8> = simple.iter().flat_map(|x| x.to_le_bytes()).collect();
    fs::write(format!("{base}.v.f64"), v).expect("room");
    fs::write(format!("{base}.f.u32"), f).expect("room");
    json!({ "score": tag })
}

fn collapse(model: &str, t: &mut Timer) -> Value {
    simplify(model, t, "meshoptimizer", |f, v| {
        meshopt::simplify(f, v, TARGET * 3, 1.0, meshopt::SimplifyOptions::None, None)
    })
}

fn sloppy(model: &str, t: &mut Timer) -> Value {
    simplify(model, t, "meshoptimizer-sloppy", |f, v| meshopt::simplify_sloppy(f, v, TARGET * 3, 1.0, None))
}

// b: closest points.

macro_rules! parry {
    ($module:ident, $krate:ident, $real:ty) => {
        mod $module {
            use super::*;
            use $krate::{math::Vector, query::PointQuery, shape::TriMesh};

            fn vectors(name: &str) -> Vec<Vector> {
                points(name).iter().map(|p| Vector::new(p[0] as $real, p[1] as $real, p[2] as $real)).collect()
            }

            pub(super) fn build(model: &str, t: &mut Timer) -> Value {
                let (v, f) = (vectors(&format!("{model}.v.f64")), faces(model));
                t.run(|| TriMesh::new(v.clone(), f.clone()).expect("faces"));
                json!({})
            }

            pub(super) fn query(model: &str, t: &mut Timer) -> Value {
                let mesh = TriMesh::new(vectors(&format!("{model}.v.f64")), faces(model)).expect("faces");
                let queries = vectors(&format!("{model}.q.f64"));
                let closest = |q: &Vector| mesh.project_local_point(*q, false).point;
                let found = t.run(|| queries.iter().map(closest).collect::<Vec<_>>());
                let squares = found.iter().zip(&queries).map(|(a, b)| f64::from((*a - *b).length_squared()));
                let rms = (squares.sum::<f64>() / queries.len() as f64).sqrt();
                json!({ "rms_distance": rms, "queries": queries.len() })
            }
        }
    };
}
parry!(parry_f32, parry3d, f32);
parry!(parry_f64, parry3d_f64, f64);

// d: least squares.

fn least_squares(
    model: &str,
    t: &mut Timer,
    solve: fn(&SparseColMat<usize, f64>, &Mat<f64>) -> Mat<f64>,
) -> Value {
    let integers = |ext| read(&format!("{model}.lsq.{ext}"), |b| u64::from_le_bytes(b) as usize);
    let [values, r, w] = ["x", "r", "w"].map(|ext| reals(&format!("{model}.lsq.{ext}")));
    let nnz = values.len();
    let pattern = SymbolicSparseColMat::new_checked(r.len(), w.len(), integers("p"), None, integers("i"));
    let b = SparseColMat::new(pattern, values);
    let right = Mat::from_fn(r.len(), 1, |i, _| r[i]);
    let x = t.run(|| solve(&b, &right));
    let off: f64 = w.iter().enumerate().map(|(k, a)| (x[(k, 0)] - a).powi(2)).sum();
    json!({ "rel_err": (off / w.iter().map(|a| a * a).sum::<f64>()).sqrt(), "nnz": nnz })
}

fn sparse_qr(model: &str, t: &mut Timer) -> Value {
    least_squares(model, t, |b, r| b.sp_qr().expect("memory").solve_lstsq(r))
}

fn dense_qr(model: &str, t: &mut Timer) -> Value {
    least_squares(model, t, |b, r| b.to_dense().qr().solve_lstsq(r))
}

fn normal_equations(model: &str, t: &mut Timer) -> Value {
    least_squares(model, t, |b, r| {
        let d = b.to_dense();
        (d.transpose() * &d).llt(faer::Side::Lower).expect("full rank").solve(d.transpose() * r)
    })
}

// f: files.

fn rate(file: &str, t: &Timer) -> Value {
    json!({ "mb_s": fs::metadata(file).expect("a file").len() as f64 / 1e6 / t.least_cpu() })
}

fn load_obj(model: &str, t: &mut Timer) -> Value {
    let file = path(&format!("{model}.obj"));
    t.run(|| tobj::load_obj(&file, &tobj::LoadOptions::default()).expect("an OBJ file").0);
    rate(&file, t)
}

fn load_ply(model: &str, t: &mut Timer) -> Value {
    let file = path(&format!("{model}.ply"));
    t.run(|| {
        let mut reader = std::io::BufReader::new(fs::File::open(&file).expect("a file"));
        ply_rs::parser::Parser::<ply_rs::ply::DefaultElement>::new()
            .read_ply(&mut reader)
            .expect("a PLY file")
    });
    rate(&file, t)
}

// What memory allows.

const NUMBERS: usize = 32 << 20; // 256 MiB, to outgrow most caches

fn numbers() -> Vec<f64> {
    (0..NUMBERS).map(|i| i as f64).collect()
}

fn copy(threads: usize, t: &mut Timer) -> Value {
    let (from, mut to) = (numbers(), vec![1.0; NUMBERS]);
    let chunk = NUMBERS / threads;
    t.run(|| {
        thread::scope(|s| {
            for (a, b) in from.chunks(chunk).zip(to.chunks_mut(chunk)) {
                s.spawn(|| b.copy_from_slice(a));
            }
        });
    });
    json!({ "gb_s": 16e-9 * NUMBERS as f64 / t.best() })
}

fn sum(threads: usize, t: &mut Timer) -> Value {
    let from = numbers();
    let part = |chunk: &[f64]| {
        let mut sums = [0.0; 32]; // apart from each other, so that no addition waits for the one before
        for values in chunk.as_chunks::<32>().0 {
            sums.iter_mut().zip(values).for_each(|(sum, value)| *sum += value);
        }
        sums.iter().sum::<f64>()
    };
    t.run(|| {
        thread::scope(|s| {
            let parts: Vec<_> =
                from.chunks(NUMBERS / threads).map(|chunk| s.spawn(move || part(chunk))).collect();
            parts.into_iter().map(|sum| sum.join().expect("a sum")).sum::<f64>()
        })
    });
    json!({ "gb_s": 8e-9 * NUMBERS as f64 / t.best() })
}
