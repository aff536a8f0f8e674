//! Types that are a name: what an app adds has one like what the crate has.

use std::{
    collections::BTreeSet,
    sync::{Mutex, PoisonError},
};

/// Names that were read from files, once each.
static NAMES: Mutex<BTreeSet<&'static str>> = Mutex::new(BTreeSet::new());

/// The same text, which lives as long as the app.
pub(crate) fn interned(name: &str) -> &'static str {
    let mut names = NAMES.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(known) = names.get(name) {
        return known;
    }
    let name: &'static str = name.to_owned().leak();
    names.insert(name);
    name
}

/// The one of `names` with this name, or a sentence that lists all of them. `what` they are: "technique".
pub(crate) fn find<N: Copy>(
    what: &str,
    names: impl Iterator<Item = N>,
    name_of: fn(N) -> &'static str,
    name: &str,
) -> Result<N, String> {
    let all: Vec<_> = names.collect();
    let found = all.iter().find(|n| name_of(**n) == name);
    found.copied().ok_or_else(|| {
        let names: Vec<_> = all.into_iter().map(name_of).collect();
        format!("no {what} '{name}'; there are {}", names.join(", "))
    })
}

/// How a `struct Name(&'static str)` is made and written: `Debug` has quotes, `Display` and files the bare name.
macro_rules! name_type {
    ($name:ident) => {
        impl $name {
            /// The one with this name. For a name that is known only at run time, use [`named`](Self::named).
            pub const fn new(name: &'static str) -> Self {
                Self(name)
            }

            /// The one with a name that is known only at run time, from a file or a command line. It need not exist.
            pub fn named(name: &str) -> Self {
                Self($crate::settings::name::interned(name))
            }

            /// Its name in lower case, as in settings files and on command lines.
            pub const fn name(self) -> &'static str {
                self.0
            }
        }

        impl std::fmt::Debug for $name {
            fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
                std::fmt::Debug::fmt(self.0, f)
            }
        }

        impl std::fmt::Display for $name {
            fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
                f.pad(self.0)
            }
        }

        impl serde::Serialize for $name {
            fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
                serializer.serialize_str(self.0)
            }
        }

        impl<'de> serde::Deserialize<'de> for $name {
            fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
                String::deserialize(deserializer).map(|name| Self::named(&name))
            }
        }
    };
}
pub(crate) use name_type;
