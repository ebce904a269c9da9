use crate::Axes;
use crate::case::{ALONE, SOLVES};

/// One choice of components.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Mode {
    /// Short name, a column of the table.
    pub name: &'static str,
    /// Keys of the scene and their values.
    pub set: &'static [(&'static str, &'static str)],
    axes: Axes,
    /// Whether it takes systems of points alone.
    points_alone: bool,
}

const fn linear(name: &'static str, set: &'static [(&'static str, &'static str)]) -> Mode {
    Mode {
        name,
        set,
        axes: SOLVES,
        points_alone: false,
    }
}

/// One that cannot take arc lengths among the unknowns.
const fn of_points(name: &'static str, set: &'static [(&'static str, &'static str)]) -> Mode {
    Mode {
        points_alone: true,
        ..linear(name, set)
    }
}

const fn contact(name: &'static str, set: &'static [(&'static str, &'static str)]) -> Mode {
    Mode {
        name,
        set,
        axes: Axes {
            contact: true,
            ..ALONE
        },
        points_alone: false,
    }
}

/// Every choice beside the defaults, one component changed at a time.
static MODES: [Mode; 12] = [
    linear("f64", &[("solver.precision", "f64")]),
    linear("f32", &[("solver.precision", "f32")]),
    linear(
        "direct",
        &[("solver.kind", "direct"), ("solver.precision", "f64")],
    ),
    of_points(
        "refined",
        &[("solver.kind", "refined"), ("solver.precision", "f64")],
    ),
    linear("no-prec", &[("solver.preconditioner", "none")]),
    linear("diagonal", &[("solver.preconditioner", "diagonal")]),
    linear("b-jacobi", &[("solver.preconditioner", "block-jacobi")]),
    linear("chebyshev", &[("solver.preconditioner", "chebyshev")]),
    linear("multigrid", &[("solver.preconditioner", "multigrid")]),
    of_points("reassem.", &[("solver.matrix", "reassembled")]),
    contact("grid", &[("contact.broad_phase", "grid")]),
    contact("brute", &[("contact.broad_phase", "brute-force")]),
];

/// The choices that a case depends on and that it can be run with.
pub fn modes(axes: Axes) -> impl Iterator<Item = &'static Mode> {
    MODES.iter().filter(move |m| {
        let depends = (m.axes.linear && axes.linear) || (m.axes.contact && axes.contact);
        depends && m.applies(axes)
    })
}

/// All choices, in the order of the table's columns.
pub(crate) fn all() -> &'static [Mode] {
    &MODES
}

impl Mode {
    /// Whether a case can be run with it at all.
    pub fn applies(&self, axes: Axes) -> bool {
        !(self.points_alone && axes.scalars)
    }

    /// As overrides of a scene.
    pub fn overrides(&self) -> Vec<(String, String)> {
        let all = self.set.iter();
        all.map(|(k, v)| ((*k).to_owned(), (*v).to_owned()))
            .collect()
    }
}
