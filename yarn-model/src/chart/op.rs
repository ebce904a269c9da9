use std::fmt;

/// Most loops that one operation takes or makes.
pub const MAX_STACK: usize = 9;

/// Parents of a decrease in the order in which they lie on each other.
///
/// An entry is a parent's place counted from the right-most one; the first
/// entry lies in front, seen from the right side.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Stack {
    count: u8,
    order: [u8; MAX_STACK],
}

impl Stack {
    /// A stack in the given order front to back; `None` unless the order is a
    /// permutation of `0..n` with n from 2 to [`MAX_STACK`].
    pub fn new(order: &[u8]) -> Option<Self> {
        if !(2..=MAX_STACK).contains(&order.len()) {
            return None;
        }
        let mut kept = [0; MAX_STACK];
        for (k, o) in order.iter().enumerate() {
            if usize::from(*o) >= order.len() || order[..k].contains(o) {
                return None;
            }
            kept[k] = *o;
        }
        let count = order.len() as u8;
        Some(Self { count, order: kept })
    }

    /// Parents front to back.
    pub fn order(&self) -> &[u8] {
        &self.order[..usize::from(self.count)]
    }

    /// The same stack seen from the other side of the cloth: right becomes
    /// left and front becomes back.
    pub fn turned(self) -> Self {
        let mut order = [0; MAX_STACK];
        for (k, o) in self.order().iter().rev().enumerate() {
            order[k] = self.count - 1 - o;
        }
        Self { order, ..self }
    }

    /// Left-most on top: `k2tog`, `k3tog`, ...
    fn right_leaning(n: u8) -> Self {
        Self::from(n, |k| n - 1 - k)
    }

    /// Right-most on top: `ssk`, `sssk`, ...
    fn left_leaning(n: u8) -> Self {
        Self::from(n, |k| k)
    }

    /// Right-most passed over the others knitted together: `sk2p`, ...
    fn passed_over(n: u8) -> Self {
        Self::from(n, |k| if k == 0 { 0 } else { n - k })
    }

    /// `s2kp`: the centre on top [spec of stacks after Cirio2017].
    fn centred() -> Self {
        Self::from(3, |k| [1, 2, 0][usize::from(k)])
    }

    fn from(count: u8, place: impl Fn(u8) -> u8) -> Self {
        let mut order = [0; MAX_STACK];
        for k in 0..count {
            order[usize::from(k)] = place(k);
        }
        Self { count, order }
    }
}

/// One operation of a chart, as the right side shows it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Op {
    /// `k`, `p`: one loop through one.
    Plain {
        /// Purl instead of knit.
        purl: bool,
    },
    /// `yo`: a loop through none.
    YarnOver,
    /// One loop through several: `k2tog`, `ssk`, `s2kp`, ...
    Together {
        /// The parents.
        stack: Stack,
        /// Purl instead of knit.
        purl: bool,
    },
    /// Several loops through one: `kfb`, `kyok`, `kinc4`, ...
    Into {
        /// How many loops.
        children: u8,
        /// Purl instead of knit.
        purl: bool,
    },
}

/// Why a word is no operation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum NotAnOp {
    /// Nothing like it exists.
    Unknown,
    /// Several loops into several.
    Split { parents: usize, children: usize },
    /// More loops than [`MAX_STACK`], or fewer than two.
    Count,
}

/// Names for suggestions.
pub(super) const NAMES: [&str; 22] = [
    "k", "p", "yo", "k2tog", "p2tog", "ssk", "ssp", "skp", "s2kp", "s2pp", "sk2p", "sp2p", "k3tog",
    "p3tog", "sssk", "sssp", "kfb", "pfb", "kyok", "pyop", "kinc4", "pinc4",
];

impl Op {
    /// A knit stitch.
    pub const KNIT: Self = Self::Plain { purl: false };
    /// A purl stitch.
    pub const PURL: Self = Self::Plain { purl: true };

    /// Loops of the row below that it takes.
    pub fn takes(self) -> usize {
        match self {
            Self::Plain { .. } | Self::Into { .. } => 1,
            Self::YarnOver => 0,
            Self::Together { stack, .. } => stack.order().len(),
        }
    }

    /// Loops that it leaves for the row above.
    pub fn makes(self) -> usize {
        match self {
            Self::Into { children, .. } => usize::from(children),
            _ => 1,
        }
    }

    /// Whether the right side shows a purl stitch.
    pub fn purl(self) -> bool {
        match self {
            Self::Plain { purl } | Self::Together { purl, .. } | Self::Into { purl, .. } => purl,
            Self::YarnOver => false,
        }
    }

    /// What the other side of the cloth shows: `k` for `p`, `k2tog` for
    /// `p2tog`, `ssk` for `ssp`.
    pub fn turned(self) -> Self {
        match self {
            Self::Plain { purl } => Self::Plain { purl: !purl },
            Self::YarnOver => self,
            Self::Together { stack, purl } => Self::Together {
                stack: stack.turned(),
                purl: !purl,
            },
            Self::Into { children, purl } => Self::Into {
                children,
                purl: !purl,
            },
        }
    }

    /// Reads a name. Case does not matter.
    pub(super) fn parse(word: &str) -> Result<Self, NotAnOp> {
        let word = word.to_ascii_lowercase();
        match word.as_str() {
            "k" => return Ok(Self::KNIT),
            "p" => return Ok(Self::PURL),
            "yo" => return Ok(Self::YarnOver),
            "kfb" | "pfb" => return into(2, word.starts_with('p')),
            "kyok" | "pyop" => return into(3, word.starts_with('p')),
            "s2kp" | "s2pp" => return Ok(together(Stack::centred(), &word[2..3] == "p")),
            "skp" | "spp" => return Ok(together(Stack::left_leaning(2), &word[1..2] == "p")),
            _ => {}
        }
        if let Some(op) = slipped(&word) {
            return op;
        }
        let (purl, rest) = match (word.strip_prefix('k'), word.strip_prefix('p')) {
            (Some(rest), _) => (false, rest),
            (_, Some(rest)) => (true, rest),
            _ => return Err(NotAnOp::Unknown),
        };
        if let Some(n) = rest.strip_suffix("tog") {
            let n = stacked(number(n)?)?;
            return Ok(together(Stack::right_leaning(n), purl));
        }
        if let Some(n) = rest.strip_prefix("inc") {
            return into(stacked(number(n)?)?, purl);
        }
        if let Some((m, n)) = rest.split_once("to") {
            let (parents, children) = (number(m)?, number(n)?);
            return match (parents, children) {
                (1, 1) => Ok(Self::Plain { purl }),
                (m, 1) => Ok(together(Stack::right_leaning(stacked(m)?), purl)),
                (1, n) => into(stacked(n)?, purl),
                (0, _) | (_, 0) => Err(NotAnOp::Count),
                _ => Err(NotAnOp::Split { parents, children }),
            };
        }
        Err(NotAnOp::Unknown)
    }
}

/// A knit version's stack, turned for a purl.
fn together(stack: Stack, purl: bool) -> Op {
    let stack = if purl { stack.turned() } else { stack };
    Op::Together { stack, purl }
}

fn into(children: u8, purl: bool) -> Result<Op, NotAnOp> {
    Ok(Op::Into { children, purl })
}

/// `ssk`, `sssk`, ..., `sk2p`, `sk3p`, ... and their purls.
fn slipped(word: &str) -> Option<Result<Op, NotAnOp>> {
    let slips = word.bytes().take_while(|b| *b == b's').count();
    let rest = &word[slips..];
    if slips >= 2 && (rest == "k" || rest == "p") {
        let op = stacked(slips).map(|n| together(Stack::left_leaning(n), rest == "p"));
        return Some(op);
    }
    let middle = rest.strip_suffix('p')?;
    let (purl, n) = match (middle.strip_prefix('k'), middle.strip_prefix('p')) {
        (Some(n), _) => (false, n),
        (_, Some(n)) => (true, n),
        _ => return None,
    };
    if slips != 1 {
        return None;
    }
    let op = number(n).and_then(|n| match n {
        0 => Err(NotAnOp::Count),
        n => stacked(n.saturating_add(1)),
    });
    Some(op.map(|n| together(Stack::passed_over(n), purl)))
}

fn number(text: &str) -> Result<usize, NotAnOp> {
    if text.is_empty() || !text.bytes().all(|b| b.is_ascii_digit()) {
        return Err(NotAnOp::Unknown);
    }
    // More digits than fit are more loops than fit.
    Ok(text.parse().unwrap_or(usize::MAX))
}

fn stacked(n: usize) -> Result<u8, NotAnOp> {
    match n {
        2..=MAX_STACK => Ok(n as u8),
        _ => Err(NotAnOp::Count),
    }
}

impl fmt::Display for Op {
    /// The name in charts. A stack that has no name is written as its order,
    /// `k3tog[0 1 2]`-like.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let letter = |purl: bool| if purl { 'p' } else { 'k' };
        match *self {
            Self::Plain { purl } => write!(f, "{}", letter(purl)),
            Self::YarnOver => f.write_str("yo"),
            Self::Into { children, purl } => match (children, purl) {
                (2, _) => write!(f, "{}fb", letter(purl)),
                (3, false) => f.write_str("kyok"),
                (3, true) => f.write_str("pyop"),
                _ => write!(f, "{}inc{children}", letter(purl)),
            },
            Self::Together { stack, purl } => {
                let n = stack.count;
                let knit = if purl { stack.turned() } else { stack };
                let l = letter(purl);
                if knit == Stack::right_leaning(n) {
                    write!(f, "{l}{n}tog")
                } else if knit == Stack::left_leaning(n) {
                    write!(f, "{}{l}", "s".repeat(usize::from(n)))
                } else if knit == Stack::passed_over(n) {
                    write!(f, "s{l}{}p", n - 1)
                } else if n == 3 && knit == Stack::centred() {
                    write!(f, "s2{l}p")
                } else {
                    write!(f, "{l}{n}tog{:?}", stack.order())
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn order(word: &str) -> Vec<u8> {
        match Op::parse(word) {
            Ok(Op::Together { stack, .. }) => stack.order().to_vec(),
            other => panic!("{word}: {other:?}"),
        }
    }

    /// Orders of the published decreases, front to back.
    #[test]
    fn stacks() {
        assert_eq!(order("k2tog"), [1, 0]);
        assert_eq!(order("ssk"), [0, 1]);
        assert_eq!(order("sk2p"), [0, 2, 1]);
        assert_eq!(order("s2kp"), [1, 2, 0]);
        assert_eq!(order("k3tog"), [2, 1, 0]);
        assert_eq!(order("sssk"), [0, 1, 2]);
        assert_eq!(order("sk3p"), [0, 3, 2, 1]);
        // Two loops turned over lie as before: the front one is the back one
        // and the left one the right one.
        assert_eq!(order("p2tog"), [1, 0]);
        assert_eq!(order("ssp"), [0, 1]);
        assert_eq!(order("s2pp"), [2, 0, 1]);
    }

    /// Names are read back as written, and turning twice changes nothing.
    #[test]
    fn names() {
        for name in NAMES
            .iter()
            .chain(&["k9tog", "p5tog", "sssssk", "sk4p", "pinc9"])
        {
            let op = Op::parse(name).unwrap();
            assert_eq!(op.turned().turned(), op);
            if *name != "skp" {
                assert_eq!(op.to_string(), *name);
            }
        }
        assert_eq!(Op::parse("k2tog").unwrap().turned().to_string(), "p2tog");
        assert_eq!(Op::parse("ssk").unwrap().turned().to_string(), "ssp");
        assert_eq!(Op::parse("k4to1"), Op::parse("k4tog"));
        assert_eq!(Op::parse("k1to4"), Op::parse("kinc4"));
    }

    #[test]
    fn refused() {
        let split = NotAnOp::Split {
            parents: 3,
            children: 2,
        };
        assert_eq!(Op::parse("k3to2"), Err(split));
        for word in [
            "k1tog",
            "k10tog",
            "kinc1",
            "sssssssssssk",
            "k99999999999999999999999tog",
        ] {
            assert_eq!(Op::parse(word), Err(NotAnOp::Count), "{word}");
        }
        for word in [
            "", "x", "kk", "ktog", "k2toG2", "s2k", "kinc", "sp", "s", "toto",
        ] {
            assert_eq!(Op::parse(word), Err(NotAnOp::Unknown), "{word}");
        }
    }
}
