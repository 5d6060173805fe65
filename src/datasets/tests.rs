use proptest::prelude::*;

use super::*;

const SMALL: &str = r#"
name = "small"
dataset = "tum"
sequence = "rgbd_dataset_small"
url = "https://example.org"
licence = "CC0-1.0"
citation = "Nobody: Nothing. 2024."

[camera]
family = "tum-fr3"
fx = 535.4
fy = 539.2
cx = 320.1
cy = 247.6
width = 640
height = 480
pixel_origin = "pixel-center"

[convert]
keep_going = true
max_features = 500
min_length_px = 12.5
frames = "0..60"
verbose = false

[raw]
folder = "a/b"

[[raw.files]]
urls = ["https://example.org/a.tgz", "http://example.com/b.tgz"]
bytes = 5
sha256 = "0123456789abcdef0123456789abcdef0123456789abcdef0123456789abcdef"

[[raw.files]]
urls = ["https://example.org/download?id=5"]
name = "poses.txt"
unpack = false
into = "a"
"#;

#[test]
fn every_recipe_that_travels_with_the_program_is_good_and_named_by_its_file() {
    let names = names();
    assert_eq!(names.len(), 18);
    for name in names {
        let recipe = named(name).unwrap();
        assert_eq!(recipe.name, name);
        // The release has something of every one, at one commit, whose files stay as they are.
        let release = recipe.text_release.as_ref().unwrap();
        for file in &release.files {
            let [url] = file.urls.as_slice() else { panic!("{name}") };
            let place = "https://raw.githubusercontent.com/yanyan-li/Open-Structure/7aaff32e72b82139a8fe56e26415fec16bbceacd/dataset";
            assert_eq!(*url, format!("{place}/{name}/{}", file.file_name()));
            assert!(!file.unpack && file.bytes.is_some() == file.sha256.is_some(), "{name}");
        }
        // The folder to convert is one that comes out of the archives.
        for file in &recipe.raw.files {
            let only = file.only.as_deref().unwrap_or(recipe.raw.folder.as_path());
            assert!(file.unpack && only.starts_with(&recipe.raw.folder), "{name}");
        }
    }
    let Err(Error::Unknown { known, .. }) = named("box1") else { panic!() };
    assert!(known.contains("livingroom0"));
}

#[test]
fn a_recipe_is_the_same_after_json() {
    let small = Recipe::from_toml(SMALL).unwrap();
    for recipe in names().into_iter().map(|name| named(name).unwrap()).chain([small]) {
        let json = serde_json::to_string(&recipe).unwrap();
        assert_eq!(serde_json::from_str::<Recipe>(&json).unwrap(), recipe);
    }
}

#[test]
fn options_become_arguments_of_the_converter() {
    let recipe = Recipe::from_toml(SMALL).unwrap();
    let arguments = recipe.arguments("in", "out.mcap", "small.toml").join(" ");
    let expected = "tum in -o out.mcap --recipe small.toml --frames 0..60 --keep-going --max-features 500 --min-length-px 12.5";
    assert_eq!(arguments, expected);
    assert_eq!(recipe.raw.files[0].file_name(), "a.tgz");
    assert_eq!(recipe.raw.files[1].file_name(), "poses.txt");
}

#[test]
fn a_wrong_value_is_named_by_its_place() {
    let long = format!("name = \"{}\"", "x".repeat(101));
    for (from, to, place) in [
        ("name = \"small\"", "name = \"../x\"", "name"),
        ("name = \"small\"", "name = \"-x\"", "name"),
        ("name = \"small\"", long.as_str(), "name"),
        ("sequence = \"rgbd_dataset_small\"", "sequence = \" \"", "sequence"),
        ("CC0-1.0", "", "licence"),
        ("Nobody: Nothing. 2024.", "a\\nb", "citation"),
        ("url = \"https://example.org\"", "url = \"ftp://example.org\"", "url"),
        ("family = \"tum-fr3\"", "family = \"TUM\"", "camera.family"),
        ("fx = 535.4", "fx = 0.5", "camera.fx"),
        ("fx = 535.4", "fx = nan", "camera.fx"),
        ("fy = 539.2", "fy = inf", "camera.fy"),
        ("cx = 320.1", "cx = 641.0", "camera.cx"),
        ("cy = 247.6", "cy = nan", "camera.cy"),
        ("width = 640", "width = 0", "camera.width"),
        ("height = 480", "height = 100001", "camera.height"),
        ("pixel-center", "centre", "camera.pixel_origin"),
        ("max_features", "Max", "convert.Max"),
        ("12.5", "nan", "convert.min_length_px"),
        ("\"0..60\"", "\"a\\nb\"", "convert.frames"),
        ("folder = \"a/b\"", "folder = \"a/../b\"", "raw.folder"),
        ("folder = \"a/b\"", "folder = \"/a\"", "raw.folder"),
        ("folder = \"a/b\"", "frames = 0", "raw.frames"),
        ("https://example.org/a.tgz", "file:///etc/passwd", "raw.files[0].urls[0]"),
        ("http://example.com/b.tgz", "http:///b", "raw.files[0].urls[1]"),
        ("http://example.com/b.tgz", "http://a b", "raw.files[0].urls[1]"),
        ("bytes = 5", "bytes = 0", "raw.files[0].bytes"),
        ("0123456789abcdef0123", "0123456789ABCDEF0123", "raw.files[0].sha256"),
        ("name = \"poses.txt\"", "", "raw.files[1].name"),
        ("name = \"poses.txt\"", "name = \".hidden\"", "raw.files[1].name"),
        ("name = \"poses.txt\"", "name = \"a.tgz\"", "raw.files[1].name"),
        ("into = \"a\"", "into = \"..\"", "raw.files[1].into"),
        ("into = \"a\"", "only = \"a\"", "raw.files[1].only"),
        ("[\"https://example.org/download?id=5\"]", "[]", "raw.files[1].urls"),
    ] {
        assert!(SMALL.contains(from), "{from}");
        let Err(Error::Value { place: found, .. }) = Recipe::from_toml(&SMALL.replace(from, to)) else {
            panic!("{place}: {to}")
        };
        assert_eq!(found, place, "{to}");
    }
    let without = Recipe::from_toml(&SMALL.replace("licence", "license")).unwrap_err().to_string();
    assert!(without.contains("license"), "{without}");
    let line = Recipe::from_toml(&SMALL.replace("width = 640", "width = \"x\"")).unwrap_err().to_string();
    assert!(line.contains("line 15"), "{line}");
}

proptest! {
    /// Whatever stands in a recipe, it is refused or holds what it promises; there is no panic.
    #[test]
    fn changed_text_is_refused_or_good(at in any::<prop::sample::Index>(), with in "\\PC{0,6}") {
        let at = at.index(SMALL.len());
        let text = format!("{}{with}{}", &SMALL[..at], &SMALL[at + 1..]);
        if let Ok(recipe) = Recipe::from_toml(&text) {
            prop_assert!(recipe.check().is_ok());
        }
    }
}
