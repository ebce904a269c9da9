//! A part of a study that runs on its own.

use std::fmt;
use std::ops::Range;

use crate::StudyError;

/// Part `index` of `count`, from 0: every `count`-th job.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shard {
    /// Which part.
    pub index: usize,
    /// How many there are.
    pub count: usize,
}

impl Shard {
    /// The whole study as one part.
    pub const WHOLE: Self = Self { index: 0, count: 1 };

    /// Reads `i/n` with `i` from 0 to `n − 1`.
    ///
    /// # Errors
    /// [`StudyError::Shard`].
    pub fn parse(text: &str) -> Result<Self, StudyError> {
        let fail = |reason: String| StudyError::Shard {
            text: text.to_owned(),
            reason,
        };
        let number = |t: &str| t.trim().parse::<usize>().ok();
        let parts = text.split_once('/').map(|(i, n)| (number(i), number(n)));
        let Some((Some(index), Some(count))) = parts else {
            return Err(fail(
                "write I/N, for example 0/4 for the first of four".into(),
            ));
        };
        if count == 0 {
            return Err(fail("there has to be at least one part: 0/1".into()));
        }
        if index >= count {
            return Err(fail(format!(
                "of {count} there are 0/{count} to {}/{count}",
                count - 1
            )));
        }
        Ok(Self { index, count })
    }

    /// The part that a Slurm job array gives to this task, from the values of
    /// `SLURM_ARRAY_TASK_ID`, `SLURM_ARRAY_TASK_COUNT` and
    /// `SLURM_ARRAY_TASK_MIN`; `None` outside of an array.
    ///
    /// # Errors
    /// [`StudyError::Shard`] when they do not fit together.
    pub fn of_array(
        id: Option<&str>,
        count: Option<&str>,
        least: Option<&str>,
    ) -> Result<Option<Self>, StudyError> {
        let (Some(id), Some(count)) = (id, count) else {
            return Ok(None);
        };
        let number = |t: &str| t.trim().parse::<usize>().ok();
        let offset = least.and_then(number).unwrap_or(0);
        let index = number(id).and_then(|i| i.checked_sub(offset));
        let text = index.map_or_else(|| id.to_owned(), |i| i.to_string());
        Self::parse(&format!("{text}/{count}"))
            .map(Some)
            .map_err(|_| StudyError::Shard {
                text: format!("SLURM_ARRAY_TASK_ID={id} SLURM_ARRAY_TASK_COUNT={count}"),
                reason: "arrays have to count by one: --array=0-7".into(),
            })
    }

    /// Its jobs out of `jobs`.
    pub fn jobs(self, jobs: usize) -> std::iter::StepBy<Range<usize>> {
        (self.index.min(jobs)..jobs).step_by(self.count)
    }
}

impl fmt::Display for Shard {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.index, self.count)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// All parts together are the whole, without overlap.
    #[test]
    fn parts_make_the_whole() {
        for (jobs, count) in [(10, 3), (2, 5), (0, 2), (7, 1)] {
            let parts = (0..count).flat_map(|index| Shard { index, count }.jobs(jobs));
            let mut all: Vec<usize> = parts.collect();
            all.sort_unstable();
            assert_eq!(all, (0..jobs).collect::<Vec<_>>());
        }
    }

    /// Parts that do not exist are refused; arrays may start anywhere.
    #[test]
    fn reading() {
        assert_eq!(Shard::parse("3/4").unwrap(), Shard { index: 3, count: 4 });
        for text in ["5/4", "4/4", "0/0", "1", "a/b", "-1/2", ""] {
            assert!(Shard::parse(text).is_err(), "{text}");
        }
        let array = |id, count, least| Shard::of_array(id, count, least);
        assert_eq!(array(None, None, None).unwrap(), None);
        let third = Some(Shard { index: 2, count: 4 });
        assert_eq!(array(Some("3"), Some("4"), Some("1")).unwrap(), third);
        assert_eq!(array(Some("2"), Some("4"), None).unwrap(), third);
        assert!(array(Some("8"), Some("4"), Some("0")).is_err());
    }
}
