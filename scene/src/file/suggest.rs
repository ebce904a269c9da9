//! What was probably meant.

/// The most similar of `known`, when it is similar enough to be a misspelling.
pub(crate) fn nearest<'a>(word: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let fold = |s: &str| s.to_lowercase().replace(['-', ' '], "_");
    let word = fold(word);
    known
        .into_iter()
        .map(|k| (strsim::jaro_winkler(&word, &fold(k)), k))
        .filter(|(score, _)| *score > 0.8)
        // the first of equals, whatever the order of comparison
        .fold(None, |best: Option<(f64, &str)>, next| match best {
            Some(b) if b.0 >= next.0 => Some(b),
            _ => Some(next),
        })
        .map(|(_, k)| k)
}

/// "did you mean …? " or nothing, to be followed by the list of names.
pub(crate) fn did_you_mean<'a>(word: &str, known: impl IntoIterator<Item = &'a str>) -> String {
    match nearest(word, known) {
        Some(k) => format!("did you mean `{k}`? "),
        None => String::new(),
    }
}

/// Units by what they measure, with their size in the SI unit of the first row
/// of the kind.
const UNITS: &[(&str, &str, f64)] = &[
    ("m", "m", 1.0),
    ("m", "cm", 1e-2),
    ("m", "mm", 1e-3),
    ("m", "um", 1e-6),
    ("m", "µm", 1e-6),
    ("m", "km", 1e3),
    ("m", "in", 0.0254),
    ("m", "inch", 0.0254),
    ("m", "ft", 0.3048),
    ("s", "s", 1.0),
    ("s", "sec", 1.0),
    ("s", "ms", 1e-3),
    ("s", "us", 1e-6),
    ("s", "µs", 1e-6),
    ("s", "min", 60.0),
    ("kg", "kg", 1.0),
    ("kg", "g", 1e-3),
    ("kg", "mg", 1e-6),
    ("kg/m²", "kg/m²", 1.0),
    ("kg/m²", "kg/m2", 1.0),
    ("kg/m²", "kg/m^2", 1.0),
    ("kg/m²", "g/m²", 1e-3),
    ("kg/m²", "g/m2", 1e-3),
    ("kg/m²", "g/m^2", 1e-3),
    ("kg/m²", "gsm", 1e-3),
    ("kg/m²", "oz/yd²", 0.033_905_75),
    ("kg/m²", "oz/yd2", 0.033_905_75),
    ("N/m", "N/m", 1.0),
    ("N/m", "kN/m", 1e3),
    ("N/m", "N/mm", 1e3),
    ("N/m", "N/cm", 1e2),
    ("N/m", "gf/cm", 0.980_665),
    ("N·m", "N·m", 1.0),
    ("N·m", "Nm", 1.0),
    ("N·m", "N*m", 1.0),
    ("N·m", "mN·m", 1e-3),
    ("N·m", "µN·m", 1e-6),
    ("N·m", "uN·m", 1e-6),
    ("N·m", "µNm", 1e-6),
    ("N·m", "gf·cm²/cm", 9.806_65e-5),
    ("N·m", "gf*cm2/cm", 9.806_65e-5),
    ("m/s²", "m/s²", 1.0),
    ("m/s²", "m/s2", 1.0),
    ("m/s²", "m/s^2", 1.0),
    ("1/s", "1/s", 1.0),
    ("1/s", "Hz", 1.0),
    ("1/s", "fps", 1.0),
    ("deg", "deg", 1.0),
    ("deg", "°", 1.0),
    ("deg", "rad", 57.295_779_513_082_32),
    ("J", "J", 1.0),
    ("J", "mJ", 1e-3),
    ("%", "%", 1.0),
];

/// What to write for a number given as text, perhaps with a unit: "10 cm" for
/// a key in metres.
pub(crate) fn number_in_text(text: &str, unit: &str) -> Option<String> {
    let text = text.trim();
    let split = text
        .char_indices()
        .map(|(i, _)| i)
        .chain([text.len()])
        .rev()
        .find(|i| {
            text[..*i]
                .trim_end()
                .parse::<f64>()
                .is_ok_and(f64::is_finite)
        })?;
    let number: f64 = text[..split].trim_end().parse().ok()?;
    let given = text[split..].trim();
    if given.is_empty() {
        return Some(format!("write {} without quotes", show(number)));
    }
    let factor = UNITS
        .iter()
        .find(|(kind, name, _)| *kind == unit && *name == given)?
        .2;
    let value: f64 = format!("{:.12e}", number * factor).parse().ok()?;
    Some(format!("write {}: the unit is always {unit}", show(value)))
}

/// A number without a tail of zeros.
pub(crate) fn show(x: f64) -> String {
    if x == 0.0 || (1e-4..1e6).contains(&x.abs()) {
        format!("{x}")
    } else {
        format!("{x:e}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Texts with a unit are converted, others are left alone.
    #[test]
    fn texts_with_units() {
        let help = |text, unit| number_in_text(text, unit);
        let write = |x: &str, unit| Some(format!("write {x}: the unit is always {unit}"));
        assert_eq!(help("10 cm", "m"), write("0.1", "m"));
        assert_eq!(help("1.5e1mm", "m"), write("0.015", "m"));
        assert_eq!(help("150 g/m²", "kg/m²"), write("0.15", "kg/m²"));
        assert_eq!(help("0.09 gf·cm²/cm", "N·m"), write("8.825985e-6", "N·m"));
        assert_eq!(help("0.1", "m"), Some("write 0.1 without quotes".into()));
        assert_eq!(help("3 s", "m"), None);
        assert_eq!(help("wide", "m"), None);
        assert_eq!(help("", "m"), None);
    }

    /// Close words are found, distant ones are not.
    #[test]
    fn close_words() {
        let known = ["tolerance", "max_iterations", "kind"];
        assert_eq!(nearest("tolerence", known), Some("tolerance"));
        assert_eq!(nearest("max-iterations", known), Some("max_iterations"));
        assert_eq!(nearest("colour", known), None);
    }
}
