//! What the names on the way to some files say: the sequence, its variant, and what the files hold.

use super::source::Container;
use std::path::{Component, Path};

/// What a place holds, told by the names on the way to it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Role {
    /// Ground truth, landmarks and observations.
    Observation,
    /// The initial graph and results.
    Baseline,
    /// The names do not tell.
    Untold,
}

/// Where some files belong.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Place {
    /// What stands above the sequence.
    pub(super) folder: String,
    /// The sequence.
    pub(super) name: String,
    /// What follows the role's word, without separators; may be empty.
    pub(super) variant: String,
    pub(super) role: Role,
    /// The container below the folder of the sequence.
    pub(super) label: String,
}

impl Place {
    /// * `folder` — the folder inside an archive, empty for its root and for a folder.
    pub(super) fn of(container: &Container, folder: &str) -> Self {
        let real = names(container.path());
        let mut way = real.clone();
        if let (Container::Archive(path), Some(last)) = (container, way.last_mut()) {
            *last = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        }
        way.extend(folder.split('/').filter(|part| !part.is_empty()).map(str::to_owned));

        let mut role = Role::Untold;
        let mut variant = String::new();
        // From within outwards, up to the first name that is more than a role.
        for (depth, part) in way.iter().enumerate().rev() {
            let word = RoleWord::of(part);
            if let Some(word) = &word {
                role = if role == Role::Untold { word.role } else { role };
                if variant.is_empty() {
                    variant.clone_from(&word.after);
                }
            }
            let name = word.as_ref().map_or(part, |word| &word.before);
            if name.is_empty() {
                continue;
            }
            // The container's own name stays in the label if the sequence's name is a piece of it.
            let first = depth + usize::from(word.is_none());
            let most = real.len() - usize::from(matches!(container, Container::Archive(_)));
            let label = real[first.min(most)..].join("/");
            return Self { folder: way[..depth].join("/"), name: name.clone(), variant, role, label };
        }
        let label = real.last().cloned().unwrap_or_default();
        Self { folder: String::new(), name: "sequence".to_owned(), variant, role, label }
    }
}

fn names(path: &Path) -> Vec<String> {
    path.components()
        .filter_map(|part| match part {
            Component::Normal(name) => Some(name.to_string_lossy().into_owned()),
            _ => None,
        })
        .collect()
}

/// A name that contains `observation` or `baseline`: `box1_observation_v2`.
struct RoleWord {
    before: String,
    role: Role,
    after: String,
}

impl RoleWord {
    fn of(part: &str) -> Option<Self> {
        let lower = part.to_ascii_lowercase();
        let [observation, baseline] =
            ["observation", "baseline"].map(|word| lower.find(word).map(|at| (at, word)));
        let ((at, word), role) = match (observation, baseline) {
            (Some(found), None) => (found, Role::Observation),
            (None, Some(found)) => (found, Role::Baseline),
            // A name with both words tells neither.
            _ => return None,
        };
        let after = &part[at + word.len()..];
        let after = after.strip_prefix(['s', 'S']).unwrap_or(after);
        Some(Self { before: trim(&part[..at]), role, after: trim(after) })
    }
}

fn trim(text: &str) -> String {
    text.trim_matches(|c: char| !c.is_alphanumeric()).to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn place(path: &str, folder: &str) -> (String, String, Role, String) {
        let archive = Path::new(path).extension().is_some_and(|ending| ending.eq_ignore_ascii_case("zip"));
        let container =
            if archive { Container::Archive(path.into()) } else { Container::Folder(path.into()) };
        let place = Place::of(&container, folder);
        (format!("{}|{}", place.folder, place.name), place.variant, place.role, place.label)
    }

    #[test]
    fn names_on_the_way_tell_sequence_variant_and_role() {
        use Role::{Baseline, Observation, Untold};
        let cases = [
            ("/d/box1/observation.zip", "", "d|box1", "", Observation, "observation.zip"),
            ("/d/box1/observation.zip", "observation", "d|box1", "", Observation, "observation.zip"),
            ("/d/far/baseline_v2.zip", "baseline_v2", "d|far", "v2", Baseline, "baseline_v2.zip"),
            ("/d/far/baseline_v2.zip", "baseline", "d|far", "v2", Baseline, "baseline_v2.zip"),
            ("/d/far/Observations-noisy", "", "d|far", "noisy", Observation, "Observations-noisy"),
            ("/d/box1/baseline/baseline", "", "d|box1", "", Baseline, "baseline/baseline"),
            ("/d/box1", "", "d|box1", "", Untold, ""),
            ("/d/box1.zip", "", "d|box1", "", Untold, "box1.zip"),
            ("/d/box1.zip", "observation", "d|box1", "", Observation, "box1.zip"),
            ("/d/box1.zip", "baseline_v3", "d|box1", "v3", Baseline, "box1.zip"),
            ("/d/all.zip", "release/box1/observation", "d/all/release|box1", "", Observation, "all.zip"),
            ("/d/box1_observation.zip", "", "d|box1", "", Observation, "box1_observation.zip"),
            ("/d/box1-baseline-v2", "", "d|box1", "v2", Baseline, "box1-baseline-v2"),
            ("/d/observation_and_baseline", "", "d|observation_and_baseline", "", Untold, ""),
            ("/observation.zip", "", "|sequence", "", Observation, "observation.zip"),
        ];
        for (path, folder, name, variant, role, label) in cases {
            let expected = (name.to_owned(), variant.to_owned(), role, label.to_owned());
            assert_eq!(place(path, folder), expected, "{path} :: {folder}");
        }
    }
}
