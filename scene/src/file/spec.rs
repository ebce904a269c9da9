//! How a key of a scene file is described. One description serves reading,
//! validation, defaults, the JSON schema and the key reference.

use super::suggest::show;

/// Interval of numbers.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Range {
    pub min: f64,
    pub max: f64,
    /// Whether `min` itself is excluded.
    pub open_min: bool,
    /// Whether `max` itself is excluded.
    pub open_max: bool,
}

/// Any finite number.
pub(crate) const ANY: Range = Range {
    min: f64::NEG_INFINITY,
    max: f64::INFINITY,
    open_min: false,
    open_max: false,
};
/// Greater than zero.
pub(crate) const POSITIVE: Range = Range {
    min: 0.0,
    open_min: true,
    ..ANY
};
/// Zero or greater.
pub(crate) const NOT_NEGATIVE: Range = Range { min: 0.0, ..ANY };
/// Between zero and one, both excluded.
pub(crate) const FRACTION: Range = Range {
    max: 1.0,
    open_max: true,
    ..POSITIVE
};

impl Range {
    /// Greater than zero, at most `max`.
    pub const fn up_to(max: f64) -> Self {
        Self { max, ..POSITIVE }
    }

    /// Zero to `max`.
    pub const fn zero_to(max: f64) -> Self {
        Self {
            max,
            ..NOT_NEGATIVE
        }
    }

    /// From `-max` to `max`.
    pub const fn within(max: f64) -> Self {
        Self {
            min: -max,
            max,
            ..ANY
        }
    }

    /// Between two numbers, both excluded.
    pub const fn between(min: f64, max: f64) -> Self {
        Self {
            min,
            max,
            open_min: true,
            open_max: true,
        }
    }

    pub fn contains(&self, x: f64) -> bool {
        let above = x > self.min || (!self.open_min && x == self.min);
        let below = x < self.max || (!self.open_max && x == self.max);
        x.is_finite() && above && below
    }

    /// "greater than 0", "from 0 to 100", …
    pub fn describe(&self) -> String {
        let lower = match (self.min.is_finite(), self.open_min) {
            (false, _) => None,
            (true, true) => Some(format!("greater than {}", show(self.min))),
            (true, false) => Some(format!("at least {}", show(self.min))),
        };
        let upper = match (self.max.is_finite(), self.open_max) {
            (false, _) => None,
            (true, true) => Some(format!("less than {}", show(self.max))),
            (true, false) => Some(format!("at most {}", show(self.max))),
        };
        match (lower, upper) {
            (None, None) => "finite".to_owned(),
            (Some(a), None) | (None, Some(a)) => a,
            (Some(a), Some(b)) => format!("{a} and {b}"),
        }
    }
}

/// A name and what it means.
pub(crate) type Choice = (&'static str, &'static str);

/// What a key takes.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Kind {
    Bool,
    /// Free text.
    Text,
    /// A file or folder.
    Path,
    /// A whole number from `min` to `max`.
    Integer {
        min: i64,
        max: i64,
    },
    /// A number in a unit.
    Number {
        unit: &'static str,
        range: Range,
    },
    /// `len` numbers in a unit.
    Vector {
        len: usize,
        unit: &'static str,
        range: Range,
    },
    /// `len` whole numbers.
    Integers {
        len: usize,
        min: i64,
        max: i64,
    },
    /// Any number of whole numbers.
    Indices,
    /// Any number of texts.
    Texts,
    /// One of some names.
    Choice(&'static [Choice]),
    /// `true`, `false` or `"auto"`.
    Switch,
    /// Three Euler angles or `{ axis, angle }`.
    Rotation,
    /// A table.
    Table(&'static Table),
    /// A list of tables.
    Tables(&'static Table),
    /// Tables under names of one's own.
    Named(&'static Table),
    /// Texts under names of one's own.
    NamedTexts,
    /// Whole numbers from zero to `max` under names of one's own.
    NamedIntegers {
        max: i64,
    },
}

/// What a key is when it is absent.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Default {
    /// It has to be there.
    Required,
    /// Nothing; what that means is in the key's doc.
    Absent,
    /// A value, as JSON.
    Json(&'static str),
    /// A value that depends on others; the text is for the docs.
    Derived(&'static str),
}

/// One key.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Key {
    pub name: &'static str,
    pub kind: Kind,
    pub default: Default,
    pub doc: &'static str,
    /// Added to the help of a value out of range, usually the unit that was
    /// probably meant.
    pub hint: &'static str,
}

/// One of the forms of a table, chosen by its tag.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Variant {
    pub name: &'static str,
    pub doc: &'static str,
    pub keys: &'static [Key],
}

/// Forms of a table.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Variants {
    /// Key that names the form.
    pub tag: &'static str,
    /// Form when the key is absent.
    pub default: Option<&'static str>,
    pub list: &'static [Variant],
}

/// A table.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Table {
    pub doc: &'static str,
    pub keys: &'static [Key],
    pub variants: Option<Variants>,
    /// Whether exactly one of the keys has to be there.
    pub exactly_one: bool,
}

impl Table {
    pub const fn new(doc: &'static str, keys: &'static [Key]) -> Self {
        Self {
            doc,
            keys,
            variants: None,
            exactly_one: false,
        }
    }

    pub const fn tagged(self, tag: &'static str, list: &'static [Variant]) -> Self {
        Self {
            variants: Some(Variants {
                tag,
                default: None,
                list,
            }),
            ..self
        }
    }

    /// As [`tagged`](Self::tagged), with a form for tables without a tag.
    pub const fn tagged_or(
        self,
        tag: &'static str,
        default: &'static str,
        list: &'static [Variant],
    ) -> Self {
        Self {
            variants: Some(Variants {
                tag,
                default: Some(default),
                list,
            }),
            ..self
        }
    }

    pub const fn one_of(doc: &'static str, keys: &'static [Key]) -> Self {
        Self {
            exactly_one: true,
            ..Self::new(doc, keys)
        }
    }
}

/// A key with a default value, given as JSON.
pub(crate) const fn key(
    name: &'static str,
    kind: Kind,
    default: &'static str,
    doc: &'static str,
) -> Key {
    Key {
        name,
        kind,
        default: Default::Json(default),
        doc,
        hint: "",
    }
}

/// A key that has to be there.
pub(crate) const fn required(name: &'static str, kind: Kind, doc: &'static str) -> Key {
    Key {
        default: Default::Required,
        ..key(name, kind, "", doc)
    }
}

/// A key that may be absent.
pub(crate) const fn optional(name: &'static str, kind: Kind, doc: &'static str) -> Key {
    Key {
        default: Default::Absent,
        ..key(name, kind, "", doc)
    }
}

/// A key whose default depends on other keys.
pub(crate) const fn derived(
    name: &'static str,
    kind: Kind,
    from: &'static str,
    doc: &'static str,
) -> Key {
    Key {
        default: Default::Derived(from),
        ..key(name, kind, "", doc)
    }
}

impl Key {
    pub const fn hint(self, hint: &'static str) -> Self {
        Self { hint, ..self }
    }
}

/// A number in a unit.
pub(crate) const fn number(unit: &'static str, range: Range) -> Kind {
    Kind::Number { unit, range }
}

/// Three numbers in a unit.
pub(crate) const fn vec3(unit: &'static str, range: Range) -> Kind {
    Kind::Vector {
        len: 3,
        unit,
        range,
    }
}

/// A whole number from `min` to `max`.
pub(crate) const fn integer(min: i64, max: i64) -> Kind {
    Kind::Integer { min, max }
}
