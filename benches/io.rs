//! Reading, and writing with new positions, in MB/s: half a million vertices, a million triangles.

use criterion::{BatchSize, BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use sombrero::io::{Document, Format, encode};
use sombrero::shapes;
use std::hint::black_box;

fn formats(criterion: &mut Criterion) {
    let soup = shapes::bumpy_sphere(500_000);
    let moved: Vec<_> = soup.points.iter().map(|p| p * 1.01).collect();
    let mut group = criterion.benchmark_group("files of 500k vertices");
    group.sample_size(10);
    let formats = [
        Format::Obj,
        Format::PlyAscii,
        Format::PlyBinaryLittleEndian,
        Format::Off,
        Format::StlAscii,
        Format::StlBinary,
        Format::Glb,
        Format::Gltf,
        Format::ThreeMf,
    ];
    for format in formats {
        let Ok(bytes) = encode(format, &soup) else { continue };
        group.throughput(Throughput::Bytes(bytes.len() as u64));
        group.bench_function(BenchmarkId::new("read", format), |b| {
            let read = |bytes| black_box(Document::parse(bytes, None).ok());
            b.iter_batched(|| bytes.clone(), read, BatchSize::LargeInput);
        });
        let Ok(document) = Document::parse(bytes, None) else { continue };
        // STL stores each corner; any other positions will do.
        let positions: Vec<_> = moved.iter().cycle().take(document.points().len()).copied().collect();
        group.bench_function(BenchmarkId::new("write", format), |b| {
            b.iter(|| black_box(document.with_points(&positions).ok()));
        });
    }
    group.finish();
}

criterion_group!(benches, formats);
criterion_main!(benches);
