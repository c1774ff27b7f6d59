//! Numbers to colours.

/// A scale of colours from 0 to 1.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum ColorMap {
    /// Dark violet over green to yellow, brightness rising evenly (matplotlib's viridis): for amounts.
    #[default]
    Viridis,
    /// Blue over light grey to red (Moreland's diverging map): for signed values, with a range symmetric about zero.
    CoolWarm,
}

/// Nine evenly spaced colours of matplotlib's viridis, which is in the public domain (CC0).
const VIRIDIS: [[u8; 3]; 9] = [
    [68, 1, 84],
    [71, 45, 123],
    [59, 82, 139],
    [44, 114, 142],
    [33, 145, 140],
    [40, 174, 128],
    [94, 201, 98],
    [173, 220, 48],
    [253, 231, 37],
];

/// Nine evenly spaced colours of the diverging map in K. Moreland, "Diverging Color Maps for Scientific
/// Visualization" (2009).
const COOL_WARM: [[u8; 3]; 9] = [
    [59, 76, 192],
    [98, 130, 234],
    [141, 176, 254],
    [184, 208, 249],
    [221, 221, 221],
    [245, 196, 173],
    [244, 154, 123],
    [222, 96, 77],
    [180, 4, 38],
];

impl ColorMap {
    /// The sRGB colour at `t`, which is clamped to [0, 1]; NaN counts as 0.
    pub fn color(self, t: f64) -> [u8; 3] {
        self.blend(t).map(|c| (c + 0.5) as u8)
    }

    /// The colour at `t`, channels in [0, 255] and not rounded.
    pub(crate) fn blend(self, t: f64) -> [f64; 3] {
        let table = match self {
            Self::Viridis => &VIRIDIS,
            Self::CoolWarm => &COOL_WARM,
        };
        let steps = table.len() - 1;
        let t = if t > 0.0 { t.min(1.0) } else { 0.0 } * steps as f64;
        let low = (t as usize).min(steps - 1);
        let share = t - low as f64;
        std::array::from_fn(|channel| {
            let (a, b) = (f64::from(table[low][channel]), f64::from(table[low + 1][channel]));
            a + share * (b - a)
        })
    }
}

/// A scalar per vertex, shown as colour.
#[derive(Debug, Clone, PartialEq)]
pub struct HeatMap {
    /// One value per point, any unit. Where one is missing or not finite, the triangles at that point stay clay.
    pub values: Vec<f64>,
    /// Values of the first and the last colour; `None` takes the smallest and the largest finite value. Default `None`.
    pub range: Option<(f64, f64)>,
    /// The colours. Default viridis.
    pub colors: ColorMap,
    /// Draw the scale as a vertical bar at the right, high values on top. Default true.
    pub bar: bool,
}

impl HeatMap {
    /// Values over their whole range, in viridis, with a bar.
    pub fn new(values: Vec<f64>) -> Self {
        Self { values, range: None, colors: ColorMap::default(), bar: true }
    }

    /// The range in use; `None` when there is no finite value to take it from.
    pub(crate) fn effective_range(&self) -> Option<(f64, f64)> {
        if self.range.is_some_and(|(low, high)| low.is_finite() && high.is_finite()) {
            return self.range;
        }
        let finite = || self.values.iter().copied().filter(|v| v.is_finite());
        let low = finite().reduce(f64::min)?;
        Some((low, finite().reduce(f64::max)?))
    }
}

/// Place of a value in a range as a number in [0, 1] (if the value is inside); the middle of a range without extent.
pub(crate) fn fraction(value: f64, (low, high): (f64, f64)) -> f64 {
    // Halves, because the difference of two large doubles may overflow.
    let width = 0.5 * high - 0.5 * low;
    if width == 0.0 { 0.5 } else { (0.5 * value - 0.5 * low) / width }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ends_and_middle() {
        assert_eq!(ColorMap::Viridis.color(0.0), VIRIDIS[0]);
        assert_eq!(ColorMap::Viridis.color(1.0), VIRIDIS[8]);
        assert_eq!(ColorMap::CoolWarm.color(0.5), [221; 3]);
        assert_eq!(ColorMap::CoolWarm.color(-7.0), COOL_WARM[0]);
        assert_eq!(ColorMap::CoolWarm.color(f64::INFINITY), COOL_WARM[8]);
        assert_eq!(ColorMap::CoolWarm.color(f64::NAN), COOL_WARM[0]);
    }

    #[test]
    fn ranges() {
        let mut map = HeatMap::new(vec![f64::NAN, 2.0, -1.0, f64::INFINITY]);
        assert_eq!(map.effective_range(), Some((-1.0, 2.0)));
        map.range = Some((0.0, 1.0));
        assert_eq!(map.effective_range(), Some((0.0, 1.0)));
        map.range = Some((0.0, f64::NAN));
        assert_eq!(map.effective_range(), Some((-1.0, 2.0)));
        assert_eq!(HeatMap::new(vec![f64::NAN]).effective_range(), None);
        assert_eq!(fraction(3.0, (3.0, 3.0)), 0.5);
        assert_eq!(fraction(0.0, (-f64::MAX, f64::MAX)), 0.5);
        assert_eq!(fraction(1.0, (3.0, 1.0)), 1.0);
    }
}
