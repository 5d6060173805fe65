//! `os simulate` as a user meets it.

use std::fs;

use super::{SMALL, done, refused, text};

#[test]
fn recipes_that_cannot_be_followed_are_refused_with_the_place() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("recipe.toml");
    let output = folder.path().join("out");
    let cases: [(&str, &str, &str); 16] = [
        ("frames = 24", "frames = 0", "trajectory.frames"),
        ("frames = 24", "frames = -3", "line"),
        ("frames = 24", "frames = 24\nspeed = 3", "speed"),
        ("radius_m = 2.0", "radius_m = nan", "trajectory.radius_m"),
        ("kind = \"wave\"", "kind = \"loop\"", "loop"),
        ("size_m = [8.0, 7.0, 3.0]", "size_m = [8.0, -7.0, 3.0]", "scene[0].size_m"),
        ("size_m = [8.0, 7.0, 3.0]", "size_m = [8.0, 7.0]", "line"),
        ("steps = 5", "steps = 4000000000", "scene[2].steps"),
        ("count = 25", "count = 25\ndensity = \"rich\"", "lines"),
        ("count = 25", "count = 25\nmin_length_m = 100.0\nmax_length_m = 100.0", "lines.min_length_m"),
        ("count = 25", "count = 25\nfree = 0.9\noblique = 0.9", "lines"),
        ("outlier_fraction = 0.05", "outlier_fraction = 1.5", "outlier_fraction"),
        ("depth_range_m = [0.2, 12.0]", "depth_range_m = [12.0, 0.2]", "visibility.depth_range_m"),
        ("depth_range_m = [0.2, 12.0]", "depth_range_m = [0.2, 0.21]", "points"),
        ("rate_hz = 10.0", "rate_hz = 0.0", "rate_hz"),
        ("name = \"small\"", "name = \"../small\"", "name"),
    ];
    for (found, replaced, place) in cases {
        assert!(SMALL.contains(found));
        fs::write(&path, SMALL.replacen(found, replaced, 1)).unwrap();
        let stderr = refused(&["simulate", text(&path), "-o", text(&output)], 1);
        assert!(stderr.contains(place), "{replaced}: {stderr}");
        assert!(!output.exists() && fs::read_dir(folder.path()).unwrap().count() == 1, "{replaced}");
    }
}

#[test]
fn what_is_no_recipe_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let output = folder.path().join("out");
    let path = folder.path().join("recipe.toml");
    for bytes in [&b""[..], b"\xff\xfe", b"[[[[[[", &[b'['; 100_000], b"name = 'x'\nscene = []\n"] {
        fs::write(&path, bytes).unwrap();
        let stderr = refused(&["simulate", text(&path), "-o", text(&output)], 1);
        assert!(stderr.contains("recipe.toml"), "{stderr}");
    }
    let big = folder.path().join("big.toml");
    fs::write(&big, "# ".repeat(1 << 20)).unwrap();
    assert!(refused(&["simulate", text(&big), "-o", text(&output)], 1).contains("at most"));
    assert!(refused(&["simulate", "box7", "-o", text(&output)], 1).contains("box1, box2"));
    assert!(refused(&["simulate", "missing.toml", "-o", text(&output)], 1).contains("missing.toml"));
    assert!(refused(&["simulate", text(folder.path()), "-o", text(&output)], 1).contains("expected a file"));
    refused(&["simulate", "box1"], 2);
    fs::write(
        &path,
        SMALL.replace("kind = \"staircase\"\nsteps = 5", "kind = \"mesh\"\nfile = \"none.obj\""),
    )
    .unwrap();
    assert!(refused(&["simulate", text(&path), "-o", text(&output)], 1).contains("none.obj"));
}

#[test]
fn an_output_is_replaced_only_when_told_to() {
    let folder = tempfile::tempdir().unwrap();
    let [path, output] = ["small.toml", "small.mcap"].map(|name| folder.path().join(name));
    fs::write(&path, SMALL).unwrap();
    done(&["simulate", text(&path), "-o", text(&output), "--seed", "1"]);
    let before = fs::read(&output).unwrap();
    assert!(refused(&["simulate", text(&path), "-o", text(&output)], 1).contains("--force"));
    assert_eq!(fs::read(&output).unwrap(), before);
    done(&["simulate", text(&path), "-o", text(&output), "--force"]);
    assert_ne!(fs::read(&output).unwrap(), before);
}

#[test]
fn a_recipe_that_makes_something_else_than_it_says_is_noticed() {
    let folder = tempfile::tempdir().unwrap();
    let [path, output] = ["small.toml", "small"].map(|name| folder.path().join(name));
    let expected = "\n[expected]\nframes = 24\npoints = 1\nlines = 25\npoint_observations = 1\nline_observations = 1\ngroups = 3\nsha256 = \"\"\n";
    fs::write(&path, format!("{SMALL}{expected}")).unwrap();
    assert!(refused(&["simulate", text(&path), "-o", text(&output)], 3).contains("expects something else"));
    // With another seed nothing is expected.
    done(&["simulate", text(&path), "-o", text(&output), "--force", "--seed", "9"]);
}

#[test]
fn the_recipes_are_listed() {
    let listed = done(&["simulate", "--list"]);
    for name in ["box1", "box2", "corridor1", "corridor2", "sphere1", "sphere2"] {
        assert!(listed.lines().any(|line| line.starts_with(name)), "{listed}");
    }
}

proptest::proptest! {
    #[test]
    fn a_damaged_recipe_is_a_recipe_or_an_error(
        edits in proptest::collection::vec((0..SMALL.len(), proptest::char::any()), 1..6),
    ) {
        let mut characters: Vec<char> = SMALL.chars().collect();
        for (place, character) in edits {
            let last = characters.len() - 1;
            characters[place.min(last)] = character;
        }
        let text: String = characters.into_iter().collect();
        if let Ok(recipe) = open_structure::simulate::Recipe::from_toml(&text) {
            let _ = open_structure::simulate::scene::Scene::build(&recipe.scene, "".as_ref());
        }
    }
}
