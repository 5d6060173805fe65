//! The recipes of datasets say of cameras, licences and citations what the converters say.

use open_structure::datasets::{self, Dataset, Recipe};
use open_structure_converters::family::FAMILIES;

#[test]
fn recipes_and_families_agree() {
    for name in datasets::names() {
        let recipe = datasets::named(name).unwrap();
        let camera = &recipe.camera;
        let family = FAMILIES.iter().find(|family| family.name == camera.family).unwrap();
        assert_eq!([camera.fx, camera.fy, camera.cx, camera.cy], family.intrinsics, "{name}");
        assert!(family.sizes.contains(&[camera.width, camera.height]), "{name}");
        assert_eq!(camera.pixel_origin, family.pixel_origin, "{name}");
        let origin = family.origin.unwrap();
        let told = [recipe.dataset.name(), &recipe.url, &recipe.licence, &recipe.citation];
        assert_eq!(told, [origin.dataset, origin.url, origin.licence, origin.citation], "{name}");
    }
}

#[test]
fn every_sequence_has_the_dataset_that_its_name_tells() {
    for name in datasets::names() {
        let expected = match name {
            "carwelding" | "hospital" | "japanesealley" | "office" => Dataset::Tartanair,
            _ if name.contains("structure") => Dataset::Tum,
            _ => Dataset::Icl,
        };
        assert_eq!(datasets::named(name).unwrap().dataset, expected, "{name}");
    }
}

#[test]
fn the_recipe_of_the_readme_is_good() {
    let readme = include_str!("../../sequences/README.md");
    let text = readme.split("```toml\n").nth(2).unwrap().split("```").next().unwrap();
    let recipe = Recipe::from_toml(text).unwrap();
    let family = FAMILIES.iter().find(|family| family.name == recipe.camera.family).unwrap();
    let camera = &recipe.camera;
    assert_eq!([camera.fx, camera.fy, camera.cx, camera.cy], family.intrinsics);
    assert_eq!(recipe.arguments("in", "out", "x").join(" "), "tum in -o out --recipe x --stride 2");
}
