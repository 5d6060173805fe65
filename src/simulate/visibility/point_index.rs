//! Points in a tree, so that whole boxes out of view or behind a face are passed over.

use nalgebra::Point3;

use super::places::PlaceSet;
use super::shadow::{Between, Few, Shadows};
use super::tree::{Node, Tree};
use super::{Occluders, View};

/// Points sorted into a tree of boxes.
#[derive(Clone, Debug, Default)]
pub struct PointIndex {
    points: Vec<Point3<f64>>,
    tree: Tree,
    /// The points of each node, for nodes so large that one set is united with another faster than points are
    /// added to it one by one.
    sets: Vec<Option<PlaceSet>>,
    /// Greatest coordinate, metres.
    reach: f64,
}

/// With more points than these (and few nodes in view) sets would only take memory.
const MOST_IN_SETS: usize = 1 << 22;

impl PointIndex {
    /// An index of points, named by their places.
    #[must_use]
    pub fn new(points: &[Point3<f64>]) -> Self {
        let boxes: Vec<_> = points.iter().map(|point| [*point, *point]).collect();
        let tree = Tree::new(&boxes);
        let reach = points.iter().fold(0.0, |reach: f64, point| reach.max(point.coords.amax()));
        let large = points.len() / 64 + 64;
        let set = |node: &Node| {
            (node.end - node.begin >= large && points.len() <= MOST_IN_SETS).then(|| {
                let mut set = PlaceSet::new(points.len());
                tree.order[node.begin..node.end].iter().for_each(|id| set.insert(*id));
                set
            })
        };
        let sets = tree.nodes.iter().map(set).collect();
        Self { points: tree.order.iter().map(|id| points[*id as usize]).collect(), tree, sets, reach }
    }

    /// Number of points.
    #[must_use]
    pub fn len(&self) -> usize {
        self.points.len()
    }

    /// Whether there is no point.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.points.is_empty()
    }

    /// Names of the points in the frustum of a view, ascending, those that faces hide left out.
    ///
    /// The same as [`View::project`] and [`Occluders::hides`] say of each point.
    ///
    /// * `set` — an empty set with room for every point; it is empty again afterwards.
    #[must_use]
    pub fn seen(&self, view: &View, occluders: Option<&Occluders>, set: &mut PlaceSet) -> Vec<u32> {
        if !self.tree.nodes.is_empty() {
            let shadows = occluders.map(|occluders| Shadows::new(occluders, view.center(), self.reach));
            let none = Few::default();
            let known = if shadows.is_some() { None } else { Some(&none) };
            let mut walk = Walk { index: self, view, shadows, set };
            walk.node(0, false, known);
        }
        set.drain()
    }
}

/// One view on its way through the tree.
struct Walk<'a> {
    index: &'a PointIndex,
    view: &'a View,
    shadows: Option<Shadows<'a>>,
    set: &'a mut PlaceSet,
}

impl Walk<'_> {
    /// Adds what is seen of a node.
    ///
    /// * `inside` — whether the node is known to be in the frustum.
    /// * `known` — faces of which alone some may hide anything in the node; `None` where they are too many.
    fn node(&mut self, at: usize, inside: bool, known: Option<&Few>) {
        let index = self.index;
        let node = &index.tree.nodes[at];
        let found = if inside { Some(true) } else { self.view.classify_box(&node.center, &node.half) };
        let Some(inside) = found else { return };
        let mark = self.shadows.as_ref().map_or(0, Shadows::mark);
        let between = match (&mut self.shadows, known) {
            (Some(shadows), known) if known.is_none_or(|few| !few.is_empty()) => {
                shadows.between(&node.center, &node.half, known)
            }
            _ => Between::Few(Few::default()),
        };
        let few = match between {
            Between::Hidden => None,
            Between::Few(few) => Some(Some(few)),
            Between::Many => Some(None),
        };
        if let Some(few) = few {
            if inside && few.as_ref().is_some_and(Few::is_empty) {
                match &index.sets[at] {
                    Some(set) => self.set.unite(set),
                    None => index.tree.order[node.begin..node.end].iter().for_each(|id| self.set.insert(*id)),
                }
            } else if node.exit == at + 1 {
                self.leaf(node.begin..node.end, inside, few.as_ref());
            } else {
                let mut child = at + 1;
                while child < node.exit {
                    self.node(child, inside, few.as_ref());
                    child = index.tree.nodes[child].exit;
                }
            }
        }
        if let Some(shadows) = &mut self.shadows {
            shadows.forget(mark);
        }
    }

    /// Adds the points of a leaf that are seen.
    fn leaf(&mut self, places: std::ops::Range<usize>, inside: bool, few: Option<&Few>) {
        for place in places {
            let point = &self.index.points[place];
            if !inside && self.view.project(point).is_none() {
                continue;
            }
            if !self.shadows.as_ref().is_some_and(|shadows| shadows.hide(point, few)) {
                self.set.insert(self.index.tree.order[place]);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::view::tests::{point, view};
    use super::*;
    use crate::simulate::scene::{Face, Scene};
    use nalgebra::Vector3;
    use proptest::prelude::*;

    /// Triangles and parallelograms, loose or many and small.
    fn scene() -> impl Strategy<Value = Scene> {
        let face = (any::<bool>(), prop::array::uniform3(point(3.0)), 0.05_f64..1.0);
        prop::collection::vec(face, 0..90).prop_map(|faces| Scene {
            faces: faces
                .into_iter()
                .map(|(quad, [a, b, c], size)| {
                    let (b, c) = (a + (b - a) * size, a + (c - a) * size);
                    let (along, up) = (b - a, c - a);
                    if quad {
                        Face::quad([a, b, b + up, a + up], 0)
                    } else {
                        Face::triangle([a, a + along, c], 0)
                    }
                })
                .collect(),
            edges: Vec::new(),
        })
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(512))]

        #[test]
        fn the_index_finds_the_points_that_are_in_view_and_not_hidden(
            view in view(),
            scene in scene(),
            mut points in prop::collection::vec(point(6.0), 0..400),
            on_faces in prop::collection::vec(prop::array::uniform2(0.0_f64..1.0), 0..600),
        ) {
            // Some points at one place, a plane, and points on the faces.
            let repeated: Vec<_> = points.iter().take(3).copied().collect();
            points.extend(repeated);
            points.iter_mut().skip(100).for_each(|point| point.z = 1.0);
            for (place, [a, b]) in on_faces.into_iter().enumerate() {
                if let Some(face) = scene.faces.get(place / 20) {
                    let corners = face.corners();
                    let sides: [Vector3<f64>; 2] = [corners[1] - corners[0], corners[2] - corners[1]];
                    points.push(corners[0] + sides[0] * a + sides[1] * (a * b));
                }
            }
            let index = PointIndex::new(&points);
            let occluders = Occluders::new(&scene);
            let mut set = PlaceSet::new(points.len());
            let named = |test: &dyn Fn(&Point3<f64>) -> bool| -> Vec<u32> {
                (0_u32..).zip(&points).filter(|(_, point)| test(point)).map(|(id, _)| id).collect()
            };
            let in_view = |point: &Point3<f64>| view.project(point).is_some();
            prop_assert_eq!(index.seen(&view, None, &mut set), named(&in_view));
            let seen = |point: &Point3<f64>| in_view(point) && !occluders.hides(&view.center(), point);
            prop_assert_eq!(index.seen(&view, Some(&occluders), &mut set), named(&seen));
        }
    }
}
