//! How a graph is built.

use super::Error;

/// Which frames become vertices.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KeyFrameRule {
    /// A frame becomes a key frame when it shares less than this part of the landmarks of the last one.
    pub most_shared: f64,
    /// At most so many frames lie between two key frames.
    pub longest_gap: usize,
}

impl Default for KeyFrameRule {
    fn default() -> Self {
        Self { most_shared: 0.8, longest_gap: 30 }
    }
}

/// Where a loop is closed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LoopRule {
    /// A landmark returns when it was not seen for at least so many frames of the graph.
    pub gap: usize,
    /// So many returned landmarks that one earlier frame saw close a loop to it.
    pub least_shared: usize,
    /// At least so many frames lie between two loop closures.
    pub spacing: usize,
}

impl Default for LoopRule {
    fn default() -> Self {
        Self { gap: 30, least_shared: 12, spacing: 10 }
    }
}

/// How a graph is built.
#[derive(Clone, Debug, PartialEq)]
pub struct GraphOptions {
    /// Name of the graph.
    pub name: String,
    /// A landmark is a vertex when at least so many frames of the graph measured it.
    pub least_views: usize,
    /// Which frames become vertices; all of them by default.
    pub key_frames: Option<KeyFrameRule>,
    /// Where loops are closed in a pose graph; `None` closes none.
    pub loops: Option<LoopRule>,
}

impl Default for GraphOptions {
    fn default() -> Self {
        Self {
            name: "tracked".to_owned(),
            least_views: 2,
            key_frames: None,
            loops: Some(LoopRule::default()),
        }
    }
}

impl GraphOptions {
    /// Holds the numbers against what they may be.
    pub(super) fn check(&self) -> Result<(), Error> {
        let wrong = |option, expected, found: String| Err(Error::Option { option, expected, found });
        if self.name.is_empty() {
            return wrong("name", "a name that is not empty", "an empty one".to_owned());
        }
        if self.least_views == 0 {
            return wrong("least_views", "at least 1", "0".to_owned());
        }
        if let Some(KeyFrameRule { most_shared, longest_gap }) = self.key_frames {
            if !(0.0..=1.0).contains(&most_shared) {
                return wrong("most_shared", "a part from 0 to 1", most_shared.to_string());
            }
            if longest_gap == 0 {
                return wrong("longest_gap", "at least 1", "0".to_owned());
            }
        }
        if let Some(LoopRule { gap, least_shared, .. }) = self.loops {
            if gap < 2 {
                return wrong("gap", "at least 2", gap.to_string());
            }
            if least_shared < 4 {
                return wrong("least_shared", "at least 4", least_shared.to_string());
            }
        }
        Ok(())
    }
}
