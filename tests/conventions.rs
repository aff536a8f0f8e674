//! What the compiler does not see: structs that Rust and WGSL share, and who may import whom.

use std::{
    collections::{BTreeMap, BTreeSet},
    fs,
    path::{Path, PathBuf},
};

/// Files below `src` with that extension, and their texts.
fn sources(extension: &str) -> Vec<(PathBuf, String)> {
    fn walk(folder: &Path, extension: &str, out: &mut Vec<(PathBuf, String)>) {
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                walk(&path, extension, out);
            } else if path.extension().is_some_and(|e| e == extension) {
                let text = fs::read_to_string(&path).unwrap();
                out.push((path, text));
            }
        }
    }
    let mut out = Vec::new();
    let src = Path::new("src");
    walk(src, extension, &mut out);
    out.sort();
    out
}

/// Fields of a struct: name and type, in order.
type Fields = Vec<(String, String)>;

/// Structs of a Rust or WGSL text whose names start with `prefix`, by the rest of the name.
fn structs(text: &str, prefix: &str) -> BTreeMap<String, Fields> {
    let mut found = BTreeMap::new();
    let mut lines = text.lines();
    while let Some(line) = lines.next() {
        let line = line
            .trim_start_matches("pub(crate) ")
            .trim_start_matches("pub(super) ")
            .trim_start_matches("pub ");
        let Some(name) = line
            .strip_prefix("struct ")
            .and_then(|rest| rest.strip_suffix(" {"))
            .and_then(|name| name.strip_prefix(prefix))
        else {
            continue;
        };
        let fields = lines
            .by_ref()
            .map(str::trim)
            .take_while(|line| *line != "}")
            .filter(|line| !line.starts_with("//") && !line.starts_with('#'))
            .filter_map(|line| line.trim_start_matches("pub ").split_once(": "))
            .map(|(name, kind)| (name.into(), kind.trim_end_matches(',').into()))
            .collect();
        found.insert(name.into(), fields);
    }
    found
}

/// The WGSL type of a Rust field.
fn wgsl_type(rust: &str) -> String {
    let inner = |outer: &str| {
        rust.strip_prefix(outer)
            .and_then(|r| r.strip_suffix(['>', ']']))
    };
    if let Some(element) = inner("Vec<") {
        return format!("array<{}>", wgsl_type(element));
    }
    if let Some((element, length)) = inner("[").and_then(|array| array.split_once("; ")) {
        // A constant comes as a shader definition.
        let length = match length.parse::<u32>() {
            Ok(_) => length.to_owned(),
            Err(_) => format!("#{{{length}}}"),
        };
        return format!("array<{}, {length}>", wgsl_type(element));
    }
    match rust {
        "Vec2" => "vec2<f32>",
        "Vec3" => "vec3<f32>",
        "Vec4" => "vec4<f32>",
        "UVec2" => "vec2<u32>",
        "UVec3" => "vec3<u32>",
        "IVec3" => "vec3<i32>",
        "Mat4" => "mat4x4<f32>",
        other => other.trim_start_matches("Gpu"),
    }
    .into()
}

/// `GpuX` in Rust and `X` in WGSL have the same fields of the same types in the same order. Offsets
/// and sizes follow: `ShaderType` lays Rust's fields out by WGSL's rules.
#[test]
fn gpu_structs_are_the_same_in_rust_and_wgsl() {
    let all = |extension, prefix| -> BTreeMap<String, Fields> {
        let files = sources(extension);
        files
            .iter()
            .flat_map(|(_, text)| structs(text, prefix))
            .collect()
    };
    let (rust, wgsl) = (all("rs", "Gpu"), all("wgsl", ""));
    assert!(rust.len() > 30, "only {} were found", rust.len());
    for (name, fields) in rust {
        let twin = wgsl.get(&name);
        let twin = twin.unwrap_or_else(|| panic!("Gpu{name} has no twin in WGSL"));
        let expected: Fields = fields
            .into_iter()
            .map(|(field, kind)| (field, wgsl_type(&kind)))
            .collect();
        assert_eq!(&expected, twin, "Gpu{name} and its twin in WGSL");
    }
}

/// Modules of the crate, each with what it may import besides its own parts.
const MAY_IMPORT: [(&str, &[&str]); 9] = [
    ("gpu", &[]),
    (
        "surface",
        &["camera", "gpu", "scene", "schedule", "settings"],
    ),
    ("scene", &["camera", "gpu", "schedule", "settings"]),
    (
        "technique",
        &[
            "camera", "debug", "gpu", "scene", "schedule", "settings", "surface",
        ],
    ),
    (
        "apply",
        &[
            "camera",
            "debug",
            "gpu",
            "scene",
            "schedule",
            "settings",
            "surface",
            "technique",
        ],
    ),
    (
        "debug",
        &["camera", "gpu", "scene", "schedule", "settings", "surface"],
    ),
    ("reference", &["camera", "scene", "settings"]),
    ("camera.rs", &["gpu", "settings"]),
    ("settings", &["gpu"]),
];

/// Modules that a text names after `crate::`.
fn imports(text: &str) -> Vec<String> {
    let mut found = Vec::new();
    let code: String = text
        .lines()
        .filter(|line| !line.trim_start().starts_with("//"))
        .collect::<Vec<_>>()
        .join("\n");
    for (at, _) in code.match_indices("crate::") {
        let rest = &code[at + "crate::".len()..];
        let first = |path: &str| -> String {
            path.trim()
                .chars()
                .take_while(|c| c.is_alphanumeric() || *c == '_')
                .collect()
        };
        let Some(group) = rest.strip_prefix('{') else {
            found.push(first(rest));
            continue;
        };
        // The first word of each part of `{a::{b, c}, d::e}`.
        let (mut depth, mut start) = (1, 0);
        for (i, c) in group.char_indices() {
            match c {
                '{' => depth += 1,
                '}' => depth -= 1,
                _ => {}
            }
            if depth == 0 || (depth == 1 && c == ',') {
                found.push(first(&group[start..i]));
                start = i + 1;
            }
            if depth == 0 {
                break;
            }
        }
    }
    found.retain(|name| !name.is_empty());
    found
}

/// Data flows one way: capture, technique, picture. Techniques know nothing of each other, and the
/// picture knows only what all techniques have in common.
#[test]
fn modules_import_only_what_lies_below_them() {
    let src = Path::new("src");
    let mut checked = 0;
    for (path, text) in sources("rs") {
        let relative = path.strip_prefix(src).unwrap();
        let module = relative.iter().next().unwrap().to_str().unwrap();
        let Some((_, allowed)) = MAY_IMPORT.iter().find(|(name, _)| *name == module) else {
            continue;
        };
        for import in imports(&text) {
            let own = module.trim_end_matches(".rs") == import;
            assert!(
                own || allowed.contains(&import.as_str()),
                "{} imports crate::{import}; it may import {allowed:?}",
                relative.display()
            );
        }
        if module == "technique" || module == "apply" {
            // The technique whose folder this is, if any.
            let own = relative.iter().nth(1).unwrap().to_str().unwrap();
            for (at, _) in text.match_indices("technique::") {
                let other: String = text[at + "technique::".len()..]
                    .chars()
                    .take_while(|c| c.is_alphanumeric() || *c == '_')
                    .collect();
                let is_technique = !other.is_empty() && src.join("technique").join(&other).is_dir();
                assert!(
                    other == own || !is_technique,
                    "{} names the technique {other}",
                    relative.display()
                );
            }
        }
        checked += 1;
    }
    assert!(checked > 20, "only {checked} files were found");
}

/// Shaders' import paths are their places.
#[test]
fn shader_import_paths_are_file_paths() {
    let src = Path::new("src");
    for (path, text) in sources("wgsl") {
        let Some(import) = text
            .lines()
            .find_map(|line| line.strip_prefix("#define_import_path "))
        else {
            continue;
        };
        let mut parts: Vec<_> = path
            .strip_prefix(src)
            .unwrap()
            .with_extension("")
            .iter()
            .map(|part| part.to_str().unwrap().to_owned())
            .collect();
        // A folder's main library is named after it.
        if parts.len() > 1 && parts[parts.len() - 1] == parts[parts.len() - 2] {
            parts.pop();
        }
        assert_eq!(
            import,
            format!("bevy_gi::{}", parts.join("::")),
            "{}",
            path.display()
        );
    }
}

/// Modules of the crate by their paths, each with its text without tests and comments.
fn modules() -> BTreeMap<Vec<String>, String> {
    let module = |(path, text): (PathBuf, String)| {
        let relative = path.strip_prefix("src").unwrap().with_extension("");
        let mut module: Vec<String> = relative
            .iter()
            .map(|part| part.to_str().unwrap().to_owned())
            .collect();
        if module.last().is_some_and(|last| last == "mod") {
            module.pop();
        }
        let code = text.split("#[cfg(test)]\nmod tests").next().unwrap();
        let lines = code
            .lines()
            .filter(|line| !line.trim_start().starts_with("//"));
        (module, lines.collect::<Vec<_>>().join("\n"))
    };
    sources("rs").into_iter().map(module).collect()
}

/// The paths of a tree of imports: `a::{b, c::{d}}` has `a::b` and `a::c::d`.
fn paths(tree: &str, prefix: &[String], found: &mut Vec<Vec<String>>) {
    let parts = |path: &str| -> Vec<String> {
        let path = path.split(" as ").next().unwrap();
        let parts = path.split("::").map(str::trim);
        parts.filter(|p| !p.is_empty()).map(str::to_owned).collect()
    };
    let Some((path, group)) = tree.trim().split_once('{') else {
        found.push([prefix, &parts(tree)[..]].concat());
        return;
    };
    let prefix = [prefix, &parts(path)[..]].concat();
    let group = &group[..group.rfind('}').unwrap()];
    let (mut depth, mut start) = (0, 0);
    for (i, c) in group.char_indices() {
        match c {
            '{' => depth += 1,
            '}' => depth -= 1,
            ',' if depth == 0 => {
                paths(&group[start..i], &prefix, found);
                start = i + 1;
            }
            _ => {}
        }
    }
    if !group[start..].trim().is_empty() {
        paths(&group[start..], &prefix, found);
    }
}

/// The modules that one imports from. What a module only hands on (`pub use`) is none of its business.
fn imported(
    module: &[String],
    text: &str,
    all: &BTreeMap<Vec<String>, String>,
) -> BTreeSet<Vec<String>> {
    let mut found = Vec::new();
    let mut rest = String::new();
    for statement in text.split_inclusive(';') {
        let line = statement.trim_start();
        let line = line.rsplit("}\n").next().unwrap().trim_start();
        if let Some(tree) = line.strip_prefix("use ") {
            paths(tree.trim_end_matches(';'), &[], &mut found);
        } else if !line.starts_with("pub") || !line.contains(" use ") {
            rest.push_str(statement);
        }
    }
    for start in ["crate::", "super::"] {
        for (at, _) in rest.match_indices(start) {
            let path = rest[at..]
                .split(|c: char| !(c.is_alphanumeric() || c == '_' || c == ':'))
                .next()
                .unwrap();
            paths(path, &[], &mut found);
        }
    }
    let resolve = |path: Vec<String>| -> Option<Vec<String>> {
        let mut base = match path.first()?.as_str() {
            "crate" => Vec::new(),
            "super" => module[..module.len().saturating_sub(1)].to_vec(),
            first if all.contains_key(&[module, &[first.to_owned()]].concat()) => module.to_vec(),
            _ => return None,
        };
        let mut rest = &path[..];
        if matches!(path[0].as_str(), "crate" | "super") {
            rest = &path[1..];
        }
        while rest.first().is_some_and(|part| part == "super") {
            base.pop();
            rest = &rest[1..];
        }
        let longest = (0..=rest.len()).rev();
        longest
            .map(|n| [&base[..], &rest[..n]].concat())
            .find(|candidate| !candidate.is_empty() && all.contains_key(candidate))
    };
    let mut imported: BTreeSet<_> = found.into_iter().filter_map(resolve).collect();
    imported.remove(module);
    imported
}

/// No module imports from one that imports from it, directly or by way of others.
#[test]
fn imports_make_no_circle() {
    let all = modules();
    let mut edges: BTreeMap<_, _> = all
        .iter()
        .map(|(module, text)| (module.clone(), imported(module, text, &all)))
        .collect();
    let count: usize = edges.values().map(BTreeSet::len).sum();
    assert!(count > 300, "only {count} imports were found");
    // What imports nothing that is left is taken away, until all that is left lies on circles, or above one.
    loop {
        let left: BTreeSet<_> = edges.keys().cloned().collect();
        let before = edges.len();
        edges.retain(|_, imports| imports.iter().any(|import| left.contains(import)));
        if edges.len() == before {
            break;
        }
    }
    let left: BTreeSet<_> = edges.keys().cloned().collect();
    let circles: Vec<_> = edges
        .iter()
        .map(|(module, imports)| {
            let imports = imports.intersection(&left).map(|path| path.join("::"));
            format!("{} -> {:?}", module.join("::"), imports.collect::<Vec<_>>())
        })
        .collect();
    assert!(circles.is_empty(), "{}", circles.join("\n"));
}
