use super::*;
use crate::wilson_interval;
use proptest::prelude::*;
use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// Of 150 coefficients 38 are known, and their errors go together: this has ended in NaN.
#[test]
fn many_coefficients_of_which_nothing_is_known() {
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    for m in [3, 10, 40, 150] {
        let known = m / 4 + 1;
        let l: Vec<f64> = (0..known).map(|i| 10f64.powi(-(i as i32) / 3)).collect();
        let block = rotated(&rotation(known, &mut rng), &l);
        let mut precision = DMatrix::zeros(m, m);
        for (i, j) in (0..known).flat_map(|i| (0..known).map(move |j| (i, j))) {
            precision[(4 * i % m, 4 * j % m)] += block[(i, j)];
        }
        let ellipsoid = Ellipsoid::new(&vec![0.5; m], &precision).unwrap();
        assert!(ellipsoid.rank() <= known && ellipsoid.rank() > 0);
        assert!(ellipsoid.test(&gaussian(m, &mut rng)).unwrap().distance.is_finite());
    }
}

fn gaussian(m: usize, rng: &mut impl Rng) -> Vec<f64> {
    StandardNormal.sample_iter(rng).take(m).collect()
}

fn rotation(m: usize, rng: &mut impl Rng) -> DMatrix<f64> {
    DMatrix::from_vec(m, m, gaussian(m * m, rng)).qr().q()
}

fn rotated(q: &DMatrix<f64>, l: &[f64]) -> DMatrix<f64> {
    q * DMatrix::from_diagonal(&DVector::from_column_slice(l)) * q.transpose()
}

/// Precisions spread over so many decades, the largest 100.
fn decades(m: usize, decades: f64, rng: &mut impl Rng) -> Vec<f64> {
    (0..m).map(|_| 10_f64.powf(2.0 - decades * rng.random::<f64>())).collect()
}

fn random(m: usize, spread: f64, seed: u64) -> Ellipsoid {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let p = rotated(&rotation(m, &mut rng), &decades(m, spread, &mut rng));
    Ellipsoid::new(&gaussian(m, &mut rng), &p).unwrap()
}

fn diagonal(centre: &[f64], l: &[f64]) -> Ellipsoid {
    Ellipsoid::new(centre, &DMatrix::from_diagonal(&DVector::from_column_slice(l))).unwrap()
}

fn close(a: EllipsoidTest, b: EllipsoidTest, tolerance: f64) -> bool {
    let near =
        |a: LogProbability, b: LogProbability| (a.ln() - b.ln()).abs() <= tolerance * (1.0 + a.ln().abs());
    near(a.bound, b.bound) && near(a.saddlepoint, b.saddlepoint)
}

#[test]
fn distance_is_the_quadratic_form() {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let m = 30;
    let p = rotated(&rotation(m, &mut rng), &decades(m, 4.0, &mut rng));
    let (centre, w) = (gaussian(m, &mut rng), gaussian(m, &mut rng));
    let d = DVector::from_iterator(m, w.iter().zip(&centre).map(|(w, c)| w - c));
    let ellipsoid = Ellipsoid::new(&centre, &p).unwrap();
    let distance = ellipsoid.distance(&w).unwrap();
    assert!((distance / d.dot(&(&p * &d)) - 1.0).abs() < 1e-12);
    let test = ellipsoid.test(&w).unwrap();
    assert_eq!(test.distance, distance);
    assert!(close(test, ellipsoid.tail(distance), 1e-13));
}

/// The promise of the bound and of the saddlepoint value, against 200,000 draws each.
#[test]
fn bound_and_saddlepoint_against_monte_carlo() {
    const DRAWS: usize = 200_000;
    for (seed, (m, spread)) in [(3, 1.0), (8, 3.0), (10, 0.0), (30, 6.0)].into_iter().enumerate() {
        let ellipsoid = random(m, spread, seed as u64);
        let mut rng = ChaCha8Rng::seed_from_u64(100 + seed as u64);
        let mut d: Vec<f64> =
            (0..DRAWS).map(|_| ellipsoid.distance(&gaussian(m, &mut rng)).unwrap()).collect();
        d.sort_by(f64::total_cmp);
        for rate in [0.5, 0.1, 0.01, 0.001] {
            let hits = (rate * DRAWS as f64) as usize;
            let test = ellipsoid.tail(d[hits - 1]);
            let seen = wilson_interval(hits, DRAWS, 0.9999).unwrap();
            let (bound, saddlepoint) = (test.bound.p(), test.saddlepoint.p());
            assert!(bound >= seen.low, "{m}, {spread}, {rate}: {bound}");
            assert!(
                0.9 * seen.low <= saddlepoint && saddlepoint <= 1.1 * seen.high,
                "{m}, {spread}, {rate}: {saddlepoint}"
            );
        }
    }
}

/// A wrong and strongly uneven precision costs no honesty: of random keys a share of at most p scores p.
#[test]
fn calibrated_against_random_keys() {
    const KEYS: usize = 200_000;
    let mut rng = ChaCha8Rng::seed_from_u64(11);
    let l: Vec<f64> = (0..40).map(|i| 10_f64.powi(-(i % 12))).collect();
    let centre: Vec<f64> = (0..40).map(|i| 0.3 * f64::from(i % 9) - 1.2).collect();
    let ellipsoid = Ellipsoid::new(&centre, &rotated(&rotation(40, &mut rng), &l)).unwrap();
    let d: Vec<f64> = (0..KEYS).map(|_| ellipsoid.distance(&gaussian(40, &mut rng)).unwrap()).collect();
    for rate in [0.5, 0.1, 0.01, 0.001] {
        let threshold = ellipsoid.distance_at(LogProbability::from_p(rate));
        let hits = d.iter().filter(|d| **d <= threshold).count();
        let seen = wilson_interval(hits, KEYS, 0.999).unwrap();
        assert!(seen.low <= rate && hits > 0, "{hits} at {rate}");
        assert!(seen.high > 0.05 * rate, "the bound is loose: {hits} at {rate}");
    }
}

/// Fewer of `draws` random watermarks than chance allows score p ≤ 10⁻ᵏ, k = 1 to 4.
fn honest(ellipsoid: &Ellipsoid, draws: usize, rng: &mut impl Rng) -> Result<(), String> {
    let m = ellipsoid.dimension();
    let p: Vec<f64> = (0..draws).map(|_| ellipsoid.test(&gaussian(m, rng)).unwrap().bound.log10()).collect();
    for k in 1..=4 {
        let hits = p.iter().filter(|p| **p <= -f64::from(k)).count();
        let rate = 10_f64.powi(-k);
        if wilson_interval(hits, draws, 1.0 - 1e-9).unwrap().low > rate {
            return Err(format!("{hits} of {draws} at 1e-{k}"));
        }
    }
    Ok(())
}

/// What a claimant may choose: three directions that are known well, the others hardly, and a w* of length 1e17. As
/// (w - w*)ᵀ P (w - w*) the distance had no digit of w left, and the bound failed for 82 of 200 watermarks.
#[test]
fn huge_coefficients_are_no_evidence() {
    let mut rng = ChaCha8Rng::seed_from_u64(20);
    for (round, known) in (0..20).flat_map(|round| [(round, false), (round, true)]) {
        let mut l = vec![1e-9; 50];
        l[..3].copy_from_slice(&[1.0, 0.7, 0.4]);
        let q = rotation(50, &mut rng);
        let mut along = DVector::from_vec(gaussian(50, &mut rng));
        if known {
            along *= 1e17 / along.norm();
        } else {
            let length = along.rows(3, 47).norm();
            along.rows_mut(3, 47).scale_mut(1e17 / length);
        }
        let (centre, precision) = (&q * along, rotated(&q, &l));
        let ellipsoid = Ellipsoid::new(centre.as_slice(), &precision).unwrap();
        honest(&ellipsoid, 200, &mut rng).unwrap_or_else(|why| panic!("round {round}: {why}"));
        // The guard alone, with no direction left out.
        let axes = Axes::new(&precision).unwrap();
        let rotated = axes.rotated(centre.clone());
        let whole = Ellipsoid::from_axes(centre, axes, rotated);
        honest(&whole, 200, &mut rng).unwrap_or_else(|why| panic!("round {round}, all directions: {why}"));
    }
}

/// A direction in which w* is further out than any watermark is not known, and costs the others nothing.
#[test]
fn what_no_watermark_can_be_is_unknown() {
    let near = diagonal(&[0.4, -1.0], &[90.0, 20.0]);
    let far = diagonal(&[0.4, 1e17, -1.0, -1e4], &[90.0, 1e-9, 20.0, 50.0]);
    assert_eq!((far.dimension(), far.rank()), (4, 2));
    assert_eq!(near.test(&[0.5, -0.8]), far.test(&[0.5, 1.0, -0.8, -3.0]));
    assert_eq!(diagonal(&[999.0], &[1.0]).rank(), 1);
}

/// All rounding is on the side of caution: D is at least that of the same numbers in more digits.
#[test]
fn the_distance_is_never_too_small() {
    let mut rng = ChaCha8Rng::seed_from_u64(21);
    for _ in 0..100 {
        let c: Vec<f64> = gaussian(30, &mut rng).iter().map(|x| 100.0 * x).collect();
        let w: Vec<f64> = c.iter().zip(gaussian(30, &mut rng)).map(|(c, e)| c + 1e-7 * e).collect();
        let l = decades(30, 3.0, &mut rng);
        let exact: f64 = w.iter().zip(&c).zip(&l).map(|((w, c), l)| l * (w - c) * (w - c)).sum();
        // A rotation by halves, which doubles hold exactly: Hadamard's matrix of four, seven times and twice 1.
        let q = DMatrix::from_fn(30, 30, |i, j| match (i < 28 && i / 4 == j / 4, i == j) {
            (true, _) => {
                if ((i % 4) & (j % 4)).count_ones() % 2 == 1 {
                    -0.5
                } else {
                    0.5
                }
            }
            (false, same) => f64::from(u8::from(same)),
        });
        let turn = |x: &[f64]| (&q * DVector::from_column_slice(x)).as_slice().to_vec();
        let turned = Ellipsoid::new(&turn(&c), &rotated(&q, &l)).unwrap();
        let distance = turned.distance(&turn(&w)).unwrap();
        assert!(distance >= exact && distance < 1.1 * exact, "{distance} {exact}");
        assert!(diagonal(&c, &l).distance(&w).unwrap() >= exact * (1.0 - 1e-15));
    }
}

#[test]
fn distance_at_answers_as_the_test_does() {
    let ellipsoid = random(12, 5.0, 12);
    let mut rng = ChaCha8Rng::seed_from_u64(13);
    let mut counts = [0; 2];
    for _ in 0..2000 {
        let w = gaussian(12, &mut rng);
        let p = LogProbability::from_p(rng.random());
        let quick = ellipsoid.distance(&w).unwrap() <= ellipsoid.distance_at(p);
        assert_eq!(quick, ellipsoid.test(&w).unwrap().bound <= p);
        counts[usize::from(quick)] += 1;
    }
    assert!(counts.iter().all(|n| *n > 100), "{counts:?}");
}

/// Found at a noise of 1 %, a watermark of 300 coefficients gives ln p below -1000; unmarked ones give nothing.
#[test]
fn a_watermark_is_found() {
    let mut rng = ChaCha8Rng::seed_from_u64(14);
    let w = gaussian(300, &mut rng);
    let extracted: Vec<f64> = w.iter().zip(gaussian(300, &mut rng)).map(|(w, e)| w + 0.01 * e).collect();
    let ellipsoid = diagonal(&extracted, &[1e4; 300]);
    let test = ellipsoid.test(&w).unwrap();
    assert!(test.bound.ln() < -1000.0 && test.saddlepoint < test.bound, "{test:?}");
    assert!(ellipsoid.test(&gaussian(300, &mut rng)).unwrap().bound.p() > 1e-4);
    assert!((ellipsoid.effective_coefficients() - 300.0).abs() < 0.1);
    assert_eq!(test, ellipsoid.test(&w).unwrap());
    let clean = ellipsoid.test(&extracted).unwrap();
    assert_eq!(clean.distance, 0.0);
    assert!(clean.bound < test.bound && clean.bound.log10() > -16.0 * 300.0);
}

#[test]
fn scale_of_the_precision_cancels() {
    let mut rng = ChaCha8Rng::seed_from_u64(15);
    let p = rotated(&rotation(15, &mut rng), &decades(15, 3.0, &mut rng));
    let centre = gaussian(15, &mut rng);
    let w: Vec<f64> = centre.iter().map(|c| c + 0.1).collect();
    let plain = Ellipsoid::new(&centre, &p).unwrap().test(&w).unwrap();
    for c in [1e-200, 1e-30, 0.3, 7.0, 1e30, 1e200] {
        let scaled = Ellipsoid::new(&centre, &(&p * c)).unwrap().test(&w).unwrap();
        assert!(close(plain, scaled, 1e-9), "{c}: {plain:?} {scaled:?}");
        assert!((scaled.distance / c / plain.distance - 1.0).abs() < 1e-9);
    }
    let l: Vec<f64> = (0..15).map(|i| 10_f64.powi(4 * i - 30)).collect();
    let wide = diagonal(&centre, &l);
    assert_eq!(wide.rank(), 15);
    assert!(wide.test(&w).unwrap().bound.ln().is_finite());
}

#[test]
fn undetermined_directions_do_not_count() {
    let small = diagonal(&[0.4, -1.0], &[9.0, 2.0]);
    let padded = diagonal(&[0.4, 7.0, -1.0, 0.0], &[9.0, 0.0, 2.0, -1e-12]);
    assert_eq!((padded.dimension(), padded.rank()), (4, 2));
    assert_eq!(small.test(&[0.5, -0.8]), padded.test(&[0.5, 100.0, -0.8, -3.0]));
    assert_eq!(small.effective_coefficients(), padded.effective_coefficients());
    // Rank 5 of 20 under a rotation: rounding leaves no sixteenth direction behind.
    let mut rng = ChaCha8Rng::seed_from_u64(16);
    let mut l = [0.0; 20];
    l[..5].copy_from_slice(&[5.0, 4.0, 3.0, 2.0, 1.0]);
    let (q, y) = (rotation(20, &mut rng), gaussian(20, &mut rng));
    let turned = Ellipsoid::new(&gaussian(20, &mut rng), &rotated(&q, &l)).unwrap();
    assert_eq!(turned.rank(), 5);
    let w = gaussian(20, &mut rng);
    let mut hidden = DVector::from_column_slice(&y);
    hidden.rows_mut(0, 5).fill(0.0);
    let moved: Vec<f64> = w.iter().zip((&q * hidden).iter()).map(|(w, d)| w + 10.0 * d).collect();
    assert!(close(turned.test(&w).unwrap(), turned.test(&moved).unwrap(), 1e-10));
    let nothing = diagonal(&[1.0, 2.0], &[0.0, 0.0]);
    let test = nothing.test(&[1.0, 2.0]).unwrap();
    assert_eq!(
        (test.distance, test.bound, test.saddlepoint),
        (0.0, LogProbability::ONE, LogProbability::ONE)
    );
    assert_eq!(nothing.distance_at(LogProbability::from_p(0.5)), f64::NEG_INFINITY);
    assert_eq!(diagonal(&[], &[]).test(&[]).unwrap().bound, LogProbability::ONE);
}

#[test]
fn floors() {
    let ellipsoid = random(10, 6.0, 17);
    let w = gaussian(10, &mut ChaCha8Rng::seed_from_u64(18));
    assert_eq!(ellipsoid.with_floor(0.0).unwrap().test(&w), ellipsoid.test(&w));
    let floor = ellipsoid.with_floor(0.3).unwrap();
    for (l, f) in ellipsoid.precisions().iter().zip(floor.precisions()) {
        assert!((f * (1.0 + 0.09 * l) / l - 1.0).abs() < 1e-13);
    }
    // Adding τ twice is adding √2 τ once, and a huge τ makes all directions alike.
    let (twice, once) = (floor.with_floor(0.3).unwrap(), ellipsoid.with_floor(0.18_f64.sqrt()).unwrap());
    assert!(close(twice.test(&w).unwrap(), once.test(&w).unwrap(), 1e-10));
    let alike = ellipsoid.with_floor(1e9).unwrap();
    assert!(alike.precisions().iter().all(|l| (l * 1e18 - 1.0).abs() < 1e-9));
    let equal = diagonal(ellipsoid.centre.as_slice(), &[1.0; 10]);
    assert!(close(alike.test(&w).unwrap(), equal.test(&w).unwrap(), 1e-9));
    for tau in [-0.1, f64::NAN, f64::INFINITY] {
        assert!(matches!(ellipsoid.with_floor(tau), Err(EllipsoidError::Floor { .. })));
    }
    assert_eq!(diagonal(&[0.0], &[1e-320]).with_floor(1.0).unwrap().rank(), 1);
}

#[test]
fn senseless_questions() {
    let one = DMatrix::identity(2, 2);
    let shape = EllipsoidError::Shape { centre: 1, rows: 2, columns: 2 };
    assert_eq!(Ellipsoid::new(&[0.0], &one).err(), Some(shape));
    let centre = EllipsoidError::CentreNotFinite { index: 1 };
    assert_eq!(Ellipsoid::new(&[0.0, f64::NAN], &one).err(), Some(centre));
    let with = |values: [f64; 4]| Ellipsoid::new(&[0.0; 2], &DMatrix::from_row_slice(2, 2, &values)).err();
    let infinite = EllipsoidError::PrecisionNotFinite { row: 0, column: 1 };
    assert_eq!(with([1.0, f64::INFINITY, 0.0, 1.0]), Some(infinite));
    assert_eq!(with([1.0, 0.5, 0.0, 1.0]), Some(EllipsoidError::NotSymmetric { row: 1, column: 0 }));
    assert!(matches!(with([1.0, 2.0, 2.0, 1.0]), Some(EllipsoidError::NotPositive { .. })));
    assert!(matches!(with([-1.0, 0.0, 0.0, 0.0]), Some(EllipsoidError::NotPositive { .. })));
    assert_eq!(with([1.0, 1.0, 1.0, 1.0]), None);
    let ellipsoid = Ellipsoid::new(&[0.0; 2], &one).unwrap();
    let lengths = EllipsoidError::Lengths { watermark: 3, centre: 2 };
    assert_eq!(ellipsoid.test(&[0.0; 3]), Err(lengths));
    let damaged = EllipsoidError::WatermarkNotFinite { index: 0 };
    assert_eq!(ellipsoid.distance(&[f64::NAN, 0.0]), Err(damaged));
    assert_eq!(ellipsoid.tail(f64::NAN).bound, LogProbability::ONE);
    assert_eq!(ellipsoid.tail(f64::INFINITY).saddlepoint, LogProbability::ONE);
}

proptest! {
    #[test]
    fn any_bits_are_answered(
        rows in proptest::collection::vec((any::<f64>(), any::<f64>(), any::<f64>()), 0..6),
        off in any::<f64>(),
    ) {
        let (centre, w): (Vec<f64>, Vec<f64>) = rows.iter().map(|r| (r.0, r.1)).unzip();
        let l: Vec<f64> = rows.iter().map(|r| r.2.abs()).collect();
        let mut p = DMatrix::from_diagonal(&DVector::from_column_slice(&l));
        for off in [0.0, off] {
            if l.len() > 1 {
                (p[(0, 1)], p[(1, 0)]) = (off, off);
            }
            if let Ok(test) = Ellipsoid::new(&centre, &p).and_then(|e| e.test(&w)) {
                prop_assert!(test.bound.ln().is_finite() && test.saddlepoint <= test.bound);
            }
        }
    }

    /// Any precision up to a condition of 1e30, any w*: shares of at most 10⁻ᵏ of all watermarks score 10⁻ᵏ.
    #[test]
    fn no_choice_of_numbers_is_evidence(
        seed in any::<u64>(), m in 1..40_usize, spread in 0.0..30.0_f64,
        known in 0..5_usize, size in -2.0..18.0_f64, inverse in any::<bool>(),
    ) {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut l = decades(m, spread, &mut rng);
        l.iter_mut().take(known).for_each(|l| *l = 100.0);
        // Out along the directions that are known badly, or everywhere alike.
        let far = |(l, x): (&f64, f64)| if inverse { x / l.sqrt().min(1.0) } else { x } * 10_f64.powf(size);
        let c: Vec<f64> = l.iter().zip(gaussian(m, &mut rng)).map(far).collect();
        let q = rotation(m, &mut rng);
        let centre = &q * DVector::from_vec(c);
        let ellipsoid = Ellipsoid::new(centre.as_slice(), &rotated(&q, &l)).unwrap();
        for floor in [0.0, 0.3] {
            let honest = honest(&ellipsoid.with_floor(floor).unwrap(), 300, &mut rng);
            prop_assert!(honest.is_ok(), "{honest:?}");
        }
    }

    #[test]
    fn further_away_is_weaker(seed in 0_u64..50, near in 0.0..3.0, step in 0.0..1.0) {
        let ellipsoid = random(6, 4.0, seed);
        let along = gaussian(6, &mut ChaCha8Rng::seed_from_u64(seed + 1000));
        let at = |r: f64| {
            let w: Vec<f64> = ellipsoid.centre.iter().zip(&along).map(|(c, a)| c + r * a).collect();
            ellipsoid.test(&w).unwrap()
        };
        let (a, b) = (at(near), at(near + step));
        prop_assert!(a.bound.ln() <= b.bound.ln() + 1e-10 && a.saddlepoint.ln() <= b.saddlepoint.ln() + 1e-10);
    }
}
