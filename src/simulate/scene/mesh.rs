//! Triangle meshes from OBJ and PLY files.

use std::collections::HashMap;
use std::io::{BufRead, BufReader, Read};
use std::path::{Path, PathBuf};

use nalgebra::Point3;
use ply_rs_bw::parser::{Parser, Reader};
use ply_rs_bw::ply::{PropertyAccess, PropertyAccessResult};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::edges::creases;
use super::placement::check_numbers;
use super::{Face, MAX_FACES, Placement, Scene};
use crate::simulate::Error;
use crate::storage::{self, File, Found};

/// Largest mesh file that is read.
const MAX_BYTES: u64 = 2 << 30;
/// Largest coordinate, metres.
const MAX_COORDINATE_M: f64 = 1e7;

/// A triangle mesh from an OBJ or PLY file; polygons are cut into fans of triangles.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(inline)]
pub struct Mesh {
    /// The file, by a name that starts at the recipe's folder; `.obj` or `.ply`.
    pub file: PathBuf,
    /// Metres per unit of the file.
    #[serde(default = "one")]
    pub scale: f64,
    /// Angle between neighbouring triangles from which their common side counts as an edge, degrees.
    #[serde(default = "crease")]
    #[schemars(extend("x-unit" = "deg"))]
    pub crease_deg: f64,
    /// Where the file's origin goes, `world`, metres.
    #[serde(default)]
    #[schemars(extend("x-unit" = "m", "x-space" = "world"))]
    pub position_m: [f64; 3],
    /// Roll, pitch and yaw, degrees: turned about x, then y, then z of the world.
    #[serde(default)]
    #[schemars(extend("x-unit" = "deg"))]
    pub roll_pitch_yaw_deg: [f64; 3],
}

const fn one() -> f64 {
    1.0
}
const fn crease() -> f64 {
    20.0
}

/// Vertices and the triangles among them.
#[derive(Debug, Default)]
struct Soup {
    vertices: Vec<[f64; 3]>,
    triangles: Vec<[usize; 3]>,
}

impl Mesh {
    pub(super) fn check(&self, place: &str) -> Result<(), Error> {
        check_numbers(&format!("{place}.scale"), &[self.scale], 1e-9, 1e9, "m")?;
        check_numbers(&format!("{place}.crease_deg"), &[self.crease_deg], 0.1, 180.0, "deg")?;
        self.placement().check(place)
    }

    const fn placement(&self) -> Placement {
        Placement { position_m: self.position_m, roll_pitch_yaw_deg: self.roll_pitch_yaw_deg }
    }

    pub(super) fn add_to(&self, scene: &mut Scene, object: u32, folder: &Path) -> Result<(), Error> {
        let path = storage::named(folder, &self.file);
        let soup = read(&path)?;
        let content = |expected: &str, found: String| Error::Content {
            path: path.clone(),
            line: None,
            expected: expected.to_owned(),
            found,
        };
        let world_from_object = self.placement().world_from_object();
        // Vertices at one place are one vertex, whatever the file says: textures and normals split them.
        let mut places: HashMap<[u64; 3], usize> = HashMap::new();
        let mut points: Vec<Point3<f64>> = Vec::new();
        let mut point_of = Vec::with_capacity(soup.vertices.len());
        for vertex in &soup.vertices {
            let scaled = vertex.map(|number| number * self.scale);
            if scaled.iter().any(|number| number.is_nan() || number.abs() > MAX_COORDINATE_M) {
                return Err(content("coordinates of at most 1e7 m", format!("{vertex:?}")));
            }
            // Adding zero makes both zeros one.
            let place = *places.entry(scaled.map(|number| (number + 0.0).to_bits())).or_insert_with(|| {
                points.push(world_from_object * Point3::from(scaled));
                points.len() - 1
            });
            point_of.push(place);
        }
        let mut triangles = Vec::with_capacity(soup.triangles.len());
        for triangle in &soup.triangles {
            let mut welded = [0; 3];
            for (corner, index) in welded.iter_mut().zip(triangle) {
                *corner = *point_of.get(*index).ok_or_else(|| {
                    content(&format!("vertices up to {}", soup.vertices.len()), format!("vertex {index}"))
                })?;
            }
            let face = Face::triangle(welded.map(|corner| points[corner]), object);
            if face.normal().is_some() {
                scene.faces.push(face);
                triangles.push(welded);
            }
        }
        if triangles.is_empty() {
            return Err(content("triangles", "none that has an area".to_owned()));
        }
        scene.edges.extend(creases(&points, &triangles, self.crease_deg.to_radians(), object));
        Ok(())
    }
}

fn read(path: &Path) -> Result<Soup, Error> {
    let io = |source| Error::Io { path: path.to_owned(), source };
    let content = |line: Option<usize>, expected: &str, found: String| Error::Content {
        path: path.to_owned(),
        line,
        expected: expected.to_owned(),
        found,
    };
    let Found::File(bytes) = storage::find(path).map_err(io)? else {
        return Err(content(None, "an OBJ or PLY file", "a folder or a device".to_owned()));
    };
    if bytes > MAX_BYTES {
        return Err(content(None, "a mesh of at most 2 GiB", format!("{bytes} bytes")));
    }
    let mut reader = BufReader::new(File::open(path).map_err(io)?.take(MAX_BYTES));
    let extension =
        storage::without_query(path).extension().map(|extension| extension.to_string_lossy().to_lowercase());
    match extension.as_deref() {
        Some("obj") => read_obj(&mut reader).map_err(|found| content(None, "an OBJ file", found)),
        Some("ply") => read_ply(reader).map_err(|(line, found)| content(line, "a PLY file", found)),
        _ => Err(content(None, "a name that ends in .obj or .ply", path.display().to_string())),
    }
}

fn read_obj(reader: &mut impl BufRead) -> Result<Soup, String> {
    let options = tobj::LoadOptions {
        triangulate: true,
        ignore_points: true,
        ignore_lines: true,
        ..Default::default()
    };
    let no_materials = |_: &Path| Ok(<(Vec<tobj::Material>, _)>::default());
    let (models, _) =
        tobj::load_obj_buf(reader, &options, no_materials).map_err(|error| error.to_string())?;
    let mut soup = Soup::default();
    for model in models {
        let first = soup.vertices.len();
        soup.vertices.extend(model.mesh.positions.chunks_exact(3).map(|xyz| [xyz[0], xyz[1], xyz[2]]));
        soup.triangles.extend(
            model
                .mesh
                .indices
                .chunks_exact(3)
                .map(|corners| [0, 1, 2].map(|corner| first + corners[corner] as usize)),
        );
        if soup.triangles.len() > MAX_FACES {
            return Err(format!("over {MAX_FACES} triangles"));
        }
    }
    Ok(soup)
}

/// A vertex or a face of a PLY file; what is neither is passed over.
#[derive(Debug, Default)]
struct Element {
    position: [f64; 3],
    corners: Vec<usize>,
}

impl Element {
    fn set(&mut self, name: &str, value: f64) -> PropertyAccessResult {
        match name {
            "x" => self.position[0] = value,
            "y" => self.position[1] = value,
            "z" => self.position[2] = value,
            _ => return PropertyAccessResult::Ignored,
        }
        PropertyAccessResult::Set
    }

    fn set_corners<T: TryInto<usize> + Copy>(&mut self, name: &str, value: &[T]) -> PropertyAccessResult {
        if name != "vertex_indices" && name != "vertex_index" {
            return PropertyAccessResult::Ignored;
        }
        // A negative index is no vertex; it is reported where indices are looked up.
        self.corners = value.iter().map(|index| (*index).try_into().unwrap_or(usize::MAX)).collect();
        PropertyAccessResult::Set
    }
}

macro_rules! numbers {
    ($($method:ident: $type:ty),+) => {
        $(fn $method(&mut self, name: &str, value: $type) -> PropertyAccessResult { self.set(name, value.into()) })+
    };
}
macro_rules! lists {
    ($($method:ident: $type:ty),+) => {
        $(fn $method(&mut self, name: &str, value: Vec<$type>) -> PropertyAccessResult { self.set_corners(name, &value) })+
    };
}

impl PropertyAccess for Element {
    fn new() -> Self {
        Self::default()
    }
    numbers!(set_char: i8, set_uchar: u8, set_short: i16, set_ushort: u16, set_int: i32, set_uint: u32, set_float: f32, set_double: f64);
    lists!(set_list_char: i8, set_list_uchar: u8, set_list_short: i16, set_list_ushort: u16, set_list_int: i32, set_list_uint: u32);
}

fn read_ply(reader: impl BufRead) -> Result<Soup, (Option<usize>, String)> {
    let failed = |error: ply_rs_bw::parser::ParseError| (error.line(), error.to_string());
    let mut reader = Reader::new(reader);
    let parser = Parser::<Element>::new();
    let header = parser.read_header(&mut reader).map_err(failed)?;
    let mut soup = Soup::default();
    for (name, element) in &header.elements {
        if element.count > 3 * MAX_FACES || element.properties.is_empty() {
            return Err((
                None,
                format!(
                    "element {name} with a count of {} and {} properties",
                    element.count,
                    element.properties.len()
                ),
            ));
        }
        let rows = parser.read_payload_for_element(&mut reader, element, &header).map_err(failed)?;
        match name.as_str() {
            "vertex" => soup.vertices = rows.into_iter().map(|row| row.position).collect(),
            "face" => {
                for row in rows {
                    for pair in row.corners.windows(2).skip(1) {
                        soup.triangles.push([row.corners[0], pair[0], pair[1]]);
                    }
                }
            }
            _ => {}
        }
        if soup.triangles.len() > MAX_FACES {
            return Err((None, format!("over {MAX_FACES} triangles")));
        }
    }
    Ok(soup)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulate::scene::Object;
    use std::fs;

    const OBJ: &str = "o cube\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\n\
        f 1 4 3 2\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n";
    const PLY: &str = "ply\r\nformat ascii 1.0\r\nelement vertex 4\r\nproperty float x\r\nproperty double y\r\n\
        property float z\r\nproperty uchar red\r\nelement face 1\r\nproperty list uchar uint vertex_index\r\nend_header\r\n\
        0 0 0 1\r\n1 0 0 2\r\n1 1 0 3\r\n0 1 0 4\r\n4 0 1 2 3\r\n";

    fn load(name: &str, text: &[u8]) -> Result<Scene, Error> {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join(name), text).unwrap();
        let mesh = format!("kind = \"mesh\"\nfile = \"{name}\"\nscale = 2.0\nposition_m = [0, 0, 5]");
        Scene::build(&[toml::from_str::<Object>(&mesh).unwrap()], folder.path())
    }

    #[test]
    fn a_cube_of_an_obj_file_has_its_area_and_its_twelve_edges() {
        let scene = load("cube.obj", OBJ.as_bytes()).unwrap();
        assert_eq!((scene.faces.len(), scene.edges.len()), (12, 12));
        assert!((scene.area() - 24.0).abs() < 1e-12);
        assert!(scene.edges.iter().all(|edge| (edge.length() - 2.0).abs() < 1e-12));
        assert!(scene.faces.iter().flat_map(|face| face.corners().to_vec()).all(|corner| corner.z >= 5.0));
    }

    #[test]
    fn a_square_of_a_ply_file_ends_at_its_four_sides() {
        let scene = load("square.ply", PLY.as_bytes()).unwrap();
        assert_eq!((scene.faces.len(), scene.edges.len()), (2, 4));
        assert!((scene.area() - 4.0).abs() < 1e-12);
    }

    #[test]
    fn files_that_are_no_meshes_are_errors() {
        let cases: [(&str, &[u8]); 8] = [
            ("empty.obj", b""),
            ("index.obj", b"v 0 0 0\nv 1 0 0\nf 1 2 9\n"),
            ("flat.obj", b"v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n"),
            ("far.obj", b"v 0 0 0\nv 1e300 0 0\nv 2 1 0\nf 1 2 3\n"),
            ("mesh.stl", b"solid"),
            ("empty.ply", b""),
            ("count.ply", b"ply\nformat ascii 1.0\nelement vertex 999999999999\nend_header\n"),
            ("index.ply", b"ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n0\n3 0 -1 5\n"),
        ];
        for (name, text) in cases {
            let error = load(name, text).unwrap_err().to_string();
            assert!(error.contains(name), "{name}: {error}");
        }
    }
}
