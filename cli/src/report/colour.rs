//! Colour scales, defined by formula in the perceptually uniform space OKLab
//! (B. Ottosson, 2020): equal steps of value are equal steps of lightness.

/// Which colour scale a field uses.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ColourMap {
    /// Dark violet to light yellow; lightness rises linearly with the value.
    Sequential,
    /// Blue, pale grey at the middle, red; lightness falls linearly to both ends.
    Diverging,
}

/// Colour of "no value here" (sRGB).
pub const MISSING: [u8; 3] = [150, 150, 150];

impl ColourMap {
    /// Colour of `t` in 0..=1 (clamped), in linear light.
    pub fn linear(self, t: f64) -> [f64; 3] {
        let t = if t.is_finite() {
            t.clamp(0.0, 1.0)
        } else {
            0.5
        };
        let (lightness, chroma, hue) = match self {
            Self::Sequential => (
                0.28 + 0.64 * t,
                0.135 + 0.045 * (2.0 * t - 1.0).powi(2),
                295.0 - 190.0 * t.powf(0.95),
            ),
            Self::Diverging => {
                let s = 2.0 * t - 1.0;
                let hue = if s < 0.0 { 255.0 } else { 32.0 };
                (0.94 - 0.50 * s.abs(), 0.19 * s.abs().powf(0.9), hue)
            }
        };
        in_gamut(lightness, chroma, hue)
    }

    /// Colour of `t` in 0..=1 (clamped), as sRGB bytes.
    pub fn srgb(self, t: f64) -> [u8; 3] {
        self.linear(t).map(encode)
    }

    /// The scale in 256 sRGB colours.
    pub(super) fn table(self) -> Vec<[u8; 3]> {
        (0..256).map(|i| self.srgb(f64::from(i) / 255.0)).collect()
    }
}

/// Fabric tint of a panel (linear light): equal lightness, hues by golden angle,
/// so that neighbouring panels differ and none stands out.
pub(super) fn panel_colour(panel: usize) -> [f64; 3] {
    let hue = 62.0 + 137.507_764 * panel as f64;
    in_gamut(0.80, 0.065, hue)
}

/// OKLCh to linear sRGB, chroma reduced until the colour can be displayed.
fn in_gamut(lightness: f64, chroma: f64, hue_deg: f64) -> [f64; 3] {
    let (sin, cos) = hue_deg.to_radians().sin_cos();
    let colour = |c: f64| oklab_to_linear(lightness, c * cos, c * sin);
    let displayable = |c: f64| colour(c).iter().all(|&v| (-1e-4..=1.0 + 1e-4).contains(&v));
    let (mut low, mut high) = (0.0, chroma);
    if displayable(chroma) {
        low = chroma;
    } else {
        for _ in 0..24 {
            let middle = 0.5 * (low + high);
            if displayable(middle) {
                low = middle;
            } else {
                high = middle;
            }
        }
    }
    colour(low).map(|v| v.clamp(0.0, 1.0))
}

fn oklab_to_linear(l: f64, a: f64, b: f64) -> [f64; 3] {
    let l_ = (l + 0.396_337_777_4 * a + 0.215_803_757_3 * b).powi(3);
    let m_ = (l - 0.105_561_345_8 * a - 0.063_854_172_8 * b).powi(3);
    let s_ = (l - 0.089_484_177_5 * a - 1.291_485_548_0 * b).powi(3);
    [
        4.076_741_662_1 * l_ - 3.307_711_591_3 * m_ + 0.230_969_929_2 * s_,
        -1.268_438_004_6 * l_ + 2.609_757_401_1 * m_ - 0.341_319_396_5 * s_,
        -0.004_196_086_3 * l_ - 0.703_418_614_7 * m_ + 1.707_614_701_0 * s_,
    ]
}

/// Linear light to an sRGB byte (IEC 61966-2-1).
pub(super) fn encode(v: f64) -> u8 {
    let v = v.clamp(0.0, 1.0);
    let s = if v <= 0.003_130_8 {
        12.92 * v
    } else {
        1.055 * v.powf(1.0 / 2.4) - 0.055
    };
    (s * 255.0).round() as u8
}

/// An sRGB byte to linear light.
pub(super) fn decode(v: u8) -> f64 {
    let s = f64::from(v) / 255.0;
    if s <= 0.040_45 {
        s / 12.92
    } else {
        ((s + 0.055) / 1.055).powf(2.4)
    }
}

/// `#rrggbb`.
pub(super) fn hex(c: [u8; 3]) -> String {
    format!("#{:02x}{:02x}{:02x}", c[0], c[1], c[2])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn luminance(c: [f64; 3]) -> f64 {
        0.2126 * c[0] + 0.7152 * c[1] + 0.0722 * c[2]
    }

    /// The sequential scale orders values by brightness alone, in steps that are never flat.
    #[test]
    fn sequential_brightness_is_strictly_increasing() {
        let y: Vec<f64> = (0..=64)
            .map(|i| luminance(ColourMap::Sequential.linear(f64::from(i) / 64.0)).cbrt())
            .collect();
        let mean = (y[64] - y[0]) / 64.0;
        for pair in y.windows(2) {
            let step = pair[1] - pair[0];
            assert!(step > 0.4 * mean && step < 2.0 * mean, "{step} of {mean}");
        }
    }

    /// The diverging scale is brightest in the middle and equally dark at both ends.
    #[test]
    fn diverging_is_balanced() {
        let y = |t| luminance(ColourMap::Diverging.linear(t)).cbrt();
        assert!(y(0.5) > y(0.25) && y(0.25) > y(0.0));
        assert!(y(0.5) > y(0.75) && y(0.75) > y(1.0));
        assert!((y(0.0) - y(1.0)).abs() < 0.12);
    }

    /// sRGB bytes survive the way to linear light and back.
    #[test]
    fn transfer_function_round_trip() {
        for v in 0..=255 {
            assert_eq!(encode(decode(v)), v);
        }
    }
}
