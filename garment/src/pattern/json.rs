//! Typed access to JSON values; every error carries the path.

use crate::GarmentError;
use serde_json::{Map, Value};

/// Largest coordinate accepted [m]; far beyond any garment, small enough that
/// areas and products stay finite.
const MAX_COORDINATE: f64 = 1e4;

/// An entry that exists and is not `null`.
pub(super) fn present<'a>(map: &'a Map<String, Value>, key: &str) -> Option<&'a Value> {
    map.get(key).filter(|v| !v.is_null())
}

pub(super) fn member<'a>(
    map: &'a Map<String, Value>,
    path: &str,
    key: &'static str,
) -> Result<&'a Value, GarmentError> {
    map.get(key).ok_or_else(|| GarmentError::Missing {
        path: path.to_owned(),
        key,
    })
}

pub(super) fn object<'a>(v: &'a Value, path: &str) -> Result<&'a Map<String, Value>, GarmentError> {
    v.as_object().ok_or_else(|| wrong(path, "an object", v))
}

pub(super) fn array<'a>(v: &'a Value, path: &str) -> Result<&'a [Value], GarmentError> {
    v.as_array()
        .map(Vec::as_slice)
        .ok_or_else(|| wrong(path, "a list", v))
}

pub(super) fn string<'a>(v: &'a Value, path: &str) -> Result<&'a str, GarmentError> {
    v.as_str().ok_or_else(|| wrong(path, "a text", v))
}

pub(super) fn number(v: &Value, path: &str) -> Result<f64, GarmentError> {
    v.as_f64()
        .filter(|x| x.is_finite())
        .ok_or_else(|| wrong(path, "a number", v))
}

/// Indices written as `3` or `3.0`.
pub(super) fn index(v: &Value, path: &str) -> Result<u64, GarmentError> {
    let whole = v
        .as_f64()
        .filter(|x| (0.0..=f64::from(u32::MAX)).contains(x) && x.fract() == 0.0);
    whole
        .map(|x| x as u64)
        .ok_or_else(|| wrong(path, "a whole number from 0", v))
}

pub(super) fn flag(v: &Value, path: &str) -> Result<bool, GarmentError> {
    match v {
        Value::Bool(b) => Ok(*b),
        _ => match v.as_f64() {
            Some(0.0) => Ok(false),
            Some(1.0) => Ok(true),
            _ => Err(wrong(path, "0 or 1", v)),
        },
    }
}

pub(super) fn lengths<const N: usize>(
    v: &Value,
    path: &str,
    units: f64,
) -> Result<[f64; N], GarmentError> {
    let list = array(v, path)?;
    if list.len() != N {
        let expected = if N == 2 {
            "two numbers"
        } else {
            "three numbers"
        };
        return Err(wrong(path, expected, v));
    }
    let mut out = [0.0; N];
    for k in 0..N {
        let path = format!("{path}[{k}]");
        let value = number(&list[k], &path)? / units;
        if value.abs() > MAX_COORDINATE {
            return Err(GarmentError::OutOfRange {
                path,
                value,
                allowed: "-10000 to 10000",
            });
        }
        out[k] = value;
    }
    Ok(out)
}

/// Control points: relative ones are a few edge lengths at most.
pub(super) fn control(v: &Value, path: &str) -> Result<[f64; 2], GarmentError> {
    lengths::<2>(v, path, 1.0)
}

pub(super) fn wrong(path: &str, expected: &'static str, found: &Value) -> GarmentError {
    GarmentError::WrongType {
        path: path.to_owned(),
        expected,
        found: shorten(&found.to_string()),
    }
}

pub(super) fn shorten(text: &str) -> String {
    const LIMIT: usize = 60;
    if text.chars().count() <= LIMIT {
        return text.to_owned();
    }
    let mut short: String = text.chars().take(LIMIT).collect();
    short.push('…');
    short
}

/// The most similar name, when it is similar enough to help.
pub(super) fn nearest<'a>(name: &str, known: impl Iterator<Item = &'a str>) -> Option<String> {
    let name: String = name.chars().take(200).collect();
    known
        .map(|k| (strsim::jaro_winkler(&name, k), k))
        .fold(None, |best: Option<(f64, &str)>, x| match best {
            Some(b) if b.0 >= x.0 => Some(b),
            _ => Some(x),
        })
        .filter(|b| b.0 > 0.7)
        .map(|b| b.1.to_owned())
}
