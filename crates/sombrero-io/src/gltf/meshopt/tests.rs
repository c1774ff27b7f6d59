//! Streams that meshoptimizer's encoder made of a few numbers, and our own.

use proptest::prelude::*;

use super::*;

fn bytes(hex: &str) -> Vec<u8> {
    hex.as_bytes()
        .chunks(2)
        .map(|pair| u8::from_str_radix(std::str::from_utf8(pair).unwrap(), 16).unwrap())
        .collect()
}

fn form(mode: Mode, filter: Filter, stride: usize, count: usize) -> Form {
    Form { mode, filter, stride, count }
}

fn attributes(stride: usize, count: usize) -> Form {
    form(Mode::Attributes, Filter::None, stride, count)
}

/// Twenty elements of four 16-bit numbers: 37 i mod 500, 3 i², 7919 i, 0.
fn elements() -> Vec<u8> {
    let row = |i: u32| [i * 37 % 500, 3 * i * i, i * 7919, 0].map(|value| (value as u16).to_le_bytes());
    (0..20).flat_map(row).flatten().collect()
}

const VERSION_0: &str = "a007004a4a4a4a4a4a4a4a4a4a4a4a4a624aff0000004a4a4a4a0100020004070006121e2a36424e5a66727e8a96a2aeff00\
     0000bac6d2de0500000808820000000700212121212121212121212121212121ff0000002121212107003c3e3e3e3e3e3e3e\
     3e3e3e3e3e3e3eff0000003c3e3e3e00000000000000000000000000000000000000000000000000000000000000000000";

/// With widths for each byte, and literal bytes.
const VERSION_1: &str = "a173af004a4a4a4a4a4a4a4a4a4a4a4a4a624a4a4a4a4a01804002010006121e2a36424e5a66727e8a96a2aebac6d2de0000\
     440202090002020021212121212121212121212121212121212121003c3e3e3e3e3e3e3e3e3e3e3e3e3e3e3c3e3e3e000000\
     000000000000000000000000000000000000000000";

/// With differences of 16 bits.
const PAIRS: &str = "a1b3af004a4a4a4a4a4a4a4a4a4a4a4a4a9d4a4a4a4a4a010040030006121e2a36424e5a66727e8a96a2aebac6d2de002121\
     2121212121212121212121212121212121003c3e3e3e3e3e3e3e3e3e3e3e3e3e3e3c3e3e3e00000000000000000000000000\
     0000000000000000000100";

#[test]
fn attributes_of_another_encoder_are_read() {
    for stream in [VERSION_0, VERSION_1, PAIRS] {
        assert_eq!(decode(&bytes(stream), &attributes(8, 20)), Some(elements()), "{stream}");
    }
}

#[test]
fn differences_of_bits_turned_by_some_are_read() {
    let plain = "2382ac96fb83ac96b582ac960582ac961383ac965b83ac96fd82ac961f83ac965982ac962f82ac96a383ac961f83ac961f83\
         ac96cf82ac969d82ac962182ac960982ac965982ac963b83ac96f782ac963d82ac96dd83ac964d82ac961782ac96a782ac966782ac96\
         5382ac969782ac96bb83ac96db82ac966583ac964783ac96";
    let stream = "a1ae00eca7588b24d3f1a33bc65e00e8295e1428b1e665f0c82d58601a6296b0df110000000000000000000000000000000000\
         00002382ac9672";
    assert_eq!(decode(&bytes(stream), &attributes(4, 32)), Some(bytes(plain)));
}

const CORNERS: [u32; 24] = [0, 2, 1, 0, 1, 3, 1, 2, 3, 2, 0, 3, 4, 5, 6, 6, 5, 7, 7, 5, 900, 0, 1, 2];

fn corners() -> Vec<u8> {
    CORNERS.iter().flat_map(|corner| corner.to_le_bytes()).collect()
}

#[test]
fn indices_of_another_encoder_are_read() {
    let sequence = bytes("d100080202040806040402060c0404040002080006911c12040400000000");
    assert_eq!(decode(&sequence, &form(Mode::Indices, Filter::None, 4, 24)), Some(corners()));
    let narrow: Vec<u8> = CORNERS.iter().flat_map(|corner| (*corner as u16).to_le_bytes()).collect();
    assert_eq!(decode(&sequence, &form(Mode::Indices, Filter::None, 2, 24)), Some(narrow));
}

#[test]
fn triangles_of_another_encoder_are_read() {
    // That encoder turns some triangles about.
    let stream = bytes("e1fe0e1203ff1e1fd7f004ff020202fa0d007687566778a9866589689801690000");
    let read = decode(&stream, &form(Mode::Triangles, Filter::None, 4, 24)).unwrap();
    let read: Vec<u32> = read.as_chunks().0.iter().map(|four| u32::from_le_bytes(*four)).collect();
    let sorted = |corners: &[u32]| {
        let turned = |t: &[u32; 3]| {
            let first = (0..3).min_by_key(|i| t[*i]).unwrap();
            [t[first], t[(first + 1) % 3], t[(first + 2) % 3]]
        };
        corners.as_chunks().0.iter().map(turned).collect::<Vec<_>>()
    };
    assert_eq!(sorted(&read), sorted(&CORNERS));
}

#[test]
fn filters_are_undone() {
    let oct8 = "a0013f0000006cea7f013f00000091176b00013c0000000403000000000000000000000000000000000000000000000000000000\
         0000007f7f";
    let oct16 = "a0013f000000da7c26013f000000061118013f000000dc7a990137000000091a0000013c0000000403012400000000000000000000\
         000000000000000000000000000000000000000000ff07ff7f";
    let quaternion = "a0013f000000b26f83013f0000000b0e05013f000000b18659013f0000000a0413013f000000b1f4b9013f0000000a070b01\
         390000000500000000000000000000000000000000000000000000000000000000000000ff07";
    let exponential = "a000000001300000001b000130000000700001300000001b01300000000301100000000110000000013000\
         00001b01300000008f0130000000570001300000001b00000000000000000000000000000000000000030000000300000003483c0003";
    let color = "a1ff004cb217009c9735007e7e17007d7ffe00000000000000000000000000000000000000407fc1ff00";
    for (filter, stride, count, stream, plain) in [
        (Filter::Octahedral, 4, 4, oct8, "00007f7f4c9a0081b7b7b67f0d1a847f"),
        (Filter::Octahedral, 8, 4, oct16, "00000000ff7fff7fc54c95990000018023b623b607b6ff7fd60c97193f83ff7f"),
        (
            Filter::Quaternion,
            8,
            4,
            quaternion,
            "000000000000ff7f0f4006c0fa3ffa3fc70c9f59c70c94592f7339f366e612d0",
        ),
        (
            Filter::Exponential,
            16,
            2,
            exponential,
            "0000000000000000000000000020f147000000000000e040000080ba00000040",
        ),
        (Filter::Color, 4, 4, color, "fe0100ff3366998001feff00e6e61aff"),
    ] {
        let form = form(Mode::Attributes, filter, stride, count);
        assert_eq!(decode(&bytes(stream), &form), Some(bytes(plain)), "{filter:?} {stride}");
    }
}

#[test]
fn what_is_damaged_is_refused() {
    let stream = bytes(VERSION_1);
    for length in 0..stream.len() {
        assert_eq!(decode(&stream[..length], &attributes(8, 20)), None, "{length}");
    }
    assert_eq!(decode(&stream, &attributes(8, 200)), None);
    let no_edge = bytes("e110000000000000000000000000000000000000");
    assert_eq!(
        decode(&no_edge, &form(Mode::Triangles, Filter::None, 4, 3)),
        None,
        "an edge that was never there"
    );
}

proptest! {
    #[test]
    fn what_is_written_reads_back(
        stride in (1..=64_usize).prop_map(|words| 4 * words),
        count in 1..600_usize,
        // Random bits, few of them.
        seed in any::<u64>(),
        bits in 0..=8_u32,
        version in 0xa0..=0xa1_u8,
    ) {
        let mut state = seed | 1;
        let elements: Vec<u8> = (0..stride * count)
            .map(|_| {
                state = state.wrapping_mul(0x5851_f42d_4c95_7f2d).wrapping_add(0x1405_7b7e_f767_814f);
                ((state >> 56) >> (8 - bits)) as u8
            })
            .collect();
        let stream = encode(&elements, stride, &[version]);
        prop_assert_eq!(stream[0], version);
        // Whole groups, two bits for each, and the tail.
        prop_assert!(stream.len() <= stride * (count + count / 8 + 32) + 600);
        prop_assert_eq!(decode(&stream, &attributes(stride, count)), Some(elements));
    }
}

#[test]
fn streams_are_as_short_as_those_of_another_encoder() {
    let [zero, one] = [0xa0, 0xa1].map(|version| encode(&elements(), 8, &[version]));
    assert_eq!(zero, bytes(VERSION_0));
    assert!(one.len() <= bytes(PAIRS).len(), "{}", one.len());
}
