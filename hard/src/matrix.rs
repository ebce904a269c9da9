use crate::Axes;

/// One choice of components.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Mode {
    /// Short name, a column of the table.
    pub name: &'static str,
    /// Keys of the scene and their values.
    pub set: &'static [(&'static str, &'static str)],
    axes: Axes,
}

const fn linear(name: &'static str, set: &'static [(&'static str, &'static str)]) -> Mode {
    Mode {
        name,
        set,
        axes: Axes {
            linear: true,
            contact: false,
        },
    }
}

const fn contact(name: &'static str, set: &'static [(&'static str, &'static str)]) -> Mode {
    Mode {
        name,
        set,
        axes: Axes {
            linear: false,
            contact: true,
        },
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
    linear(
        "refined",
        &[("solver.kind", "refined"), ("solver.precision", "f64")],
    ),
    linear("no-prec", &[("solver.preconditioner", "none")]),
    linear("diagonal", &[("solver.preconditioner", "diagonal")]),
    linear("b-jacobi", &[("solver.preconditioner", "block-jacobi")]),
    linear("chebyshev", &[("solver.preconditioner", "chebyshev")]),
    linear("multigrid", &[("solver.preconditioner", "multigrid")]),
    linear("reassem.", &[("solver.matrix", "reassembled")]),
    contact("grid", &[("contact.broad_phase", "grid")]),
    contact("brute", &[("contact.broad_phase", "brute-force")]),
];

/// The choices that a case depends on.
pub fn modes(axes: Axes) -> impl Iterator<Item = &'static Mode> {
    MODES
        .iter()
        .filter(move |m| (m.axes.linear && axes.linear) || (m.axes.contact && axes.contact))
}

/// All choices, in the order of the table's columns.
pub(crate) fn all() -> &'static [Mode] {
    &MODES
}

impl Mode {
    /// As overrides of a scene.
    pub fn overrides(&self) -> Vec<(String, String)> {
        let all = self.set.iter();
        all.map(|(k, v)| ((*k).to_owned(), (*v).to_owned()))
            .collect()
    }
}
