//! Settings that a study varies.

use serde::{Deserialize, Serialize};

use crate::StudyError;

/// A key of the scene and the values it takes, or several keys that change
/// together: `a&b` with values such as `1&2`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Axis {
    /// Dotted key, as `--set` takes it; several are joined by `&`.
    pub key: String,
    /// What it takes.
    pub values: Values,
}

/// Values of an [`Axis`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Values {
    /// These, as texts that a scene file would hold.
    List(Vec<String>),
    /// Everything in between, for samples.
    Range(Range),
}

/// Numbers between two ends.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Range {
    /// Least value.
    pub low: f64,
    /// Greatest value.
    pub high: f64,
    /// Whether values are spread evenly by their logarithm: both ends are
    /// positive and at least a factor of ten apart.
    pub logarithmic: bool,
    /// Whether only whole numbers count: both ends are written as such.
    pub whole: bool,
}

impl Axis {
    /// Reads `key=a,b,c` or `key=low..high`. Commas inside brackets, braces and
    /// quotes belong to a value.
    ///
    /// # Errors
    /// [`StudyError::Axis`].
    pub fn parse(text: &str) -> Result<Self, StudyError> {
        let fail = |reason: String| StudyError::Axis {
            text: text.to_owned(),
            reason,
        };
        let example = "for example `solver.tolerance=1e-3,1e-2` or, for a sample, \
                       `solver.tolerance=1e-4..1e-1`";
        let (key, rest) = text
            .split_once('=')
            .map(|(k, v)| (k.trim(), v.trim()))
            .filter(|(k, _)| !k.is_empty())
            .ok_or_else(|| fail(format!("expected KEY=VALUE,VALUE,…, {example}")))?;
        if rest.is_empty() {
            return Err(fail(format!("`{key}` has no values, {example}")));
        }
        let keys: Vec<&str> = key.split('&').map(str::trim).collect();
        if keys.iter().any(|k| k.is_empty()) {
            return Err(fail("a key is missing beside `&`".to_owned()));
        }
        let key = keys.join("&");
        if let Some((low, high)) = rest.split_once("..") {
            if keys.len() > 1 {
                return Err(fail(
                    "keys that change together take lists of values".to_owned(),
                ));
            }
            let range = Range::new(low.trim(), high.trim()).map_err(fail)?;
            let values = Values::Range(range);
            return Ok(Self { key, values });
        }
        let values = split(rest);
        if values.iter().any(String::is_empty) {
            return Err(fail(format!("`{key}` has an empty value, {example}")));
        }
        if let Some(i) = (1..values.len()).find(|i| values[..*i].contains(&values[*i])) {
            return Err(fail(format!("the value `{}` is there twice", values[i])));
        }
        let count = |v: &&String| keys.len() > 1 && v.split('&').count() != keys.len();
        if let Some(value) = values.iter().find(count) {
            let (n, given) = (keys.len(), value.split('&').count());
            return Err(fail(format!(
                "`{value}` has {given} of {n} values, joined by `&`"
            )));
        }
        let values = Values::List(values);
        Ok(Self { key, values })
    }

    /// Its keys.
    pub fn keys(&self) -> impl Iterator<Item = &str> {
        self.key.split('&')
    }

    /// The keys with what one of the values gives to each.
    pub fn settings(&self, value: &str) -> Vec<(String, String)> {
        if !self.key.contains('&') {
            return vec![(self.key.clone(), value.to_owned())];
        }
        let each = self.keys().zip(value.split('&'));
        each.map(|(k, v)| (k.to_owned(), v.trim().to_owned()))
            .collect()
    }
}

impl Range {
    fn new(low: &str, high: &str) -> Result<Self, String> {
        let number = |text: &str| {
            let value = text.parse::<f64>().ok().filter(|x| x.is_finite());
            value.ok_or_else(|| format!("`{text}` is not a number: ranges are `1e-4..1e-1`"))
        };
        let whole = [low, high].iter().all(|t| t.parse::<i64>().is_ok());
        let (low, high) = (number(low)?, number(high)?);
        if low >= high {
            return Err(format!("the range from {low:e} to {high:e} is empty"));
        }
        Ok(Self {
            low,
            high,
            logarithmic: low > 0.0 && high >= 10.0 * low,
            whole,
        })
    }

    /// The value at a place between 0 and 1, as a text with six digits.
    pub fn at(&self, place: f64) -> String {
        let value = if self.logarithmic {
            self.low * (self.high / self.low).powf(place)
        } else {
            self.low + place * (self.high - self.low)
        };
        if self.whole {
            return format!("{}", value.round() as i64);
        }
        // Through the shortest text, without a tail of zeros.
        let rounded: f64 = format!("{value:.5e}").parse().unwrap_or(value);
        format!("{:?}", rounded.clamp(self.low, self.high))
    }
}

/// Splits at commas outside of brackets, braces and quotes.
fn split(text: &str) -> Vec<String> {
    let (mut values, mut value) = (Vec::new(), String::new());
    let (mut depth, mut quote) = (0_i32, None);
    for c in text.chars() {
        match (c, quote) {
            (',', None) if depth <= 0 => {
                values.push(std::mem::take(&mut value).trim().to_owned());
                continue;
            }
            ('[' | '{', None) => depth += 1,
            (']' | '}', None) => depth -= 1,
            ('"' | '\'', None) => quote = Some(c),
            (c, Some(q)) if c == q => quote = None,
            _ => {}
        }
        value.push(c);
    }
    values.push(value.trim().to_owned());
    values
}

#[cfg(test)]
mod tests {
    use super::*;

    fn list(text: &str) -> Vec<String> {
        match Axis::parse(text).unwrap().values {
            Values::List(values) => values,
            Values::Range(range) => panic!("{range:?}"),
        }
    }

    /// Lists, vectors, quoted texts and ranges are told apart.
    #[test]
    fn values_are_split() {
        assert_eq!(list("a.b = 1, 2e-3 ,x"), ["1", "2e-3", "x"]);
        assert_eq!(
            list("g=[0, -9.81, 0],[0,0,0]"),
            ["[0, -9.81, 0]", "[0,0,0]"]
        );
        assert_eq!(list("a='x,y',\"z\""), ["'x,y'", "\"z\""]);
        let axis = Axis::parse("t=1e-4..1e-1").unwrap();
        let Values::Range(range) = axis.values else {
            panic!()
        };
        assert!(range.logarithmic && !range.whole);
        assert_eq!(range.at(1.0 / 3.0), "0.001");
        let Values::Range(range) = Axis::parse("n=1..9").unwrap().values else {
            panic!()
        };
        assert_eq!((range.logarithmic, range.at(0.5)), (false, "5".to_owned()));
    }

    /// Keys joined by `&` change together.
    #[test]
    fn keys_together() {
        let axis = Axis::parse("a.b & c=1&x, 2&y").unwrap();
        let pair = |k: &str, v: &str| (k.to_owned(), v.to_owned());
        assert_eq!(axis.key, "a.b&c");
        assert_eq!(axis.settings("2&y"), [pair("a.b", "2"), pair("c", "y")]);
    }

    /// What cannot be meant is refused with a reason.
    #[test]
    fn mistakes_are_told() {
        for (text, word) in [
            ("solver.tolerance", "expected KEY=VALUE"),
            ("=1,2", "expected KEY=VALUE"),
            ("a=", "no values"),
            ("a=1,,2", "empty value"),
            ("a=1,2,1", "twice"),
            ("a=x..y", "not a number"),
            ("a=2..1", "empty"),
            ("a=1..inf", "not a number"),
            ("a&b=1&2,3", "1 of 2 values"),
            ("a&=1&2", "key is missing"),
            ("a&b=1..2", "lists"),
        ] {
            let message = Axis::parse(text).unwrap_err().to_string();
            assert!(message.contains(word), "{text}: {message}");
        }
    }
}
