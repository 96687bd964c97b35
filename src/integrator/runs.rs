//! Runs: the walkers of a bounce sorted by what they have met, so that blocks of them can be treated alike. The order
//! within a run is that of the walkers, which no value depends on.

use std::ops::Range;

/// Indices by group, in one list.
#[derive(Debug)]
pub(super) struct Runs {
    /// Where each group's run ends.
    ends: Vec<usize>,
    indices: Vec<u32>,
    /// Of each index its group, or `NONE`.
    groups: Vec<u32>,
}

const NONE: u32 = u32::MAX;

impl Runs {
    /// For so many groups.
    pub(super) fn new(groups: usize) -> Self {
        Self {
            ends: vec![0; groups],
            indices: Vec::new(),
            groups: Vec::new(),
        }
    }

    /// Sorts indices, from 0 on, by the groups that are given; those without one are left out.
    pub(super) fn sort(&mut self, groups: impl Iterator<Item = Option<usize>>) {
        self.ends.fill(0);
        self.groups.clear();
        for group in groups {
            if let Some(group) = group {
                self.ends[group] += 1;
            }
            self.groups.push(group.map_or(NONE, |group| group as u32));
        }
        let mut start = 0;
        for end in &mut self.ends {
            let count = *end;
            *end = start;
            start += count;
        }
        self.indices.clear();
        self.indices.resize(start, 0);
        for (index, group) in (0..).zip(&self.groups) {
            if *group != NONE {
                let end = &mut self.ends[*group as usize];
                self.indices[*end] = index;
                *end += 1;
            }
        }
    }

    /// How many indices have a group.
    pub(super) fn count(&self) -> usize {
        self.indices.len()
    }

    /// The groups that have any of a range of the sorted indices, each with its indices.
    pub(super) fn part(&self, range: Range<usize>) -> impl Iterator<Item = (usize, &[u32])> {
        let starts = std::iter::once(0).chain(self.ends.iter().copied());
        let runs = starts.zip(&self.ends).map(move |(start, end)| {
            let (start, end) = (start.max(range.start), (*end).min(range.end));
            self.indices.get(start..end).unwrap_or_default()
        });
        runs.enumerate().filter(|(_, run)| !run.is_empty())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_index_is_in_its_group_s_run_in_order() {
        let mut runs = Runs::new(4);
        for groups in [
            vec![Some(2), None, Some(0), Some(2), Some(3), Some(0)],
            vec![None],
            vec![Some(1)],
        ] {
            runs.sort(groups.iter().copied());
            let found: Vec<(usize, u32)> = (runs.part(0..runs.count()))
                .flat_map(|(group, run)| run.iter().map(move |index| (group, *index)))
                .collect();
            let mut expected: Vec<(usize, u32)> = (0..)
                .zip(&groups)
                .filter_map(|(index, group)| Some(((*group)?, index)))
                .collect();
            expected.sort();
            assert_eq!(found, expected);
            assert_eq!(runs.count(), expected.len());
            for size in 1..4 {
                let parts = (0..runs.count()).step_by(size);
                let parts = parts.flat_map(|start| runs.part(start..start + size));
                let indices: Vec<u32> = parts.flat_map(|(_, run)| run.iter().copied()).collect();
                assert!(indices.into_iter().eq(expected.iter().map(|pair| pair.1)));
            }
        }
    }
}
