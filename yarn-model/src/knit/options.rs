use super::LoopTemplate;
use super::template::positive;
use crate::{YarnError, YarnMaterial};

/// How a chart is laid out.
#[derive(Clone, Debug, PartialEq)]
pub struct KnitOptions {
    /// The yarn, auxiliary yarns included.
    pub material: YarnMaterial,
    /// Shape of a loop.
    pub template: LoopTemplate,
}

impl Default for KnitOptions {
    fn default() -> Self {
        Self::new(YarnMaterial::default())
    }
}

impl KnitOptions {
    /// Gauge and loops that suit a yarn of radius R: 5.2 R between loops, 0.75
    /// times that between rows, contacts of 1.6 R, no slack.
    pub fn new(material: YarnMaterial) -> Self {
        let course = 5.2 * material.radius;
        Self::with_gauge(material, course, 0.75 * course, 1.0)
    }

    /// A gauge of `course` between loops and `row` between rows \[m\], and
    /// slack as a factor of the lengths between contacts.
    pub fn with_gauge(material: YarnMaterial, course: f64, row: f64, slack: f64) -> Self {
        let contact = 1.6 * material.radius;
        Self {
            template: LoopTemplate::flat(course, row, slack, contact),
            material,
        }
    }

    pub(super) fn validate(&self) -> Result<(), YarnError> {
        self.material.validate()?;
        positive("rest length of a stitch contact", self.template.contact())?;
        self.template.validate()
    }
}
