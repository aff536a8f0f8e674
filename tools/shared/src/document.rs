//! Parts of a Markdown document, of which a program writes one and leaves the others.

use std::path::Path;

/// A part between two lines that are comments.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Part {
    /// What it is called in its comments.
    pub name: &'static str,
    /// Whether it comes before the other parts.
    pub is_first: bool,
}

impl Part {
    fn begin(self) -> String {
        format!("<!-- begin of {}, which a program writes -->", self.name)
    }

    fn end(self) -> String {
        format!("<!-- end of {} -->", self.name)
    }

    /// The part in a document, its comments included.
    fn find(self, document: &str) -> Option<std::ops::Range<usize>> {
        let start = document.find(&self.begin())?;
        let end = self.end();
        let length = document[start..].find(&end)? + end.len();
        Some(start..start + length)
    }

    /// The part with its comments.
    fn written(self, body: &str) -> String {
        format!("{}\n\n{}\n\n{}", self.begin(), body.trim(), self.end())
    }

    /// A document with this part replaced. Where it is not there yet, the first part comes after the title, and
    /// others come last.
    pub fn replaced(self, document: &str, body: &str) -> String {
        let part = self.written(body);
        if let Some(found) = self.find(document) {
            return format!(
                "{}{part}{}",
                &document[..found.start],
                &document[found.end..]
            );
        }
        let (title, rest) = match document.split_once('\n') {
            Some((title, rest)) if title.starts_with("# ") => (title, rest.trim_start()),
            _ => ("", document),
        };
        let parts = match self.is_first {
            true => [title, &part, rest],
            false => [title, rest, &part],
        };
        let parts = parts.iter().map(|part| part.trim_end());
        let parts: Vec<_> = parts.filter(|part| !part.is_empty()).collect();
        parts.join("\n\n") + "\n"
    }

    /// The title of a document, and this part of it, if it is there: what is left when all else is written anew.
    pub fn alone(self, document: &str, title: &str) -> String {
        match self.find(document) {
            Some(found) => format!("{title}\n\n{}\n", &document[found]),
            None => format!("{title}\n"),
        }
    }

    /// Whether a document has it.
    pub fn is_in(self, document: &str) -> bool {
        self.find(document).is_some()
    }
}

/// A document; empty, if there is none yet.
pub fn read(path: &Path) -> Result<String, String> {
    match std::fs::read_to_string(path) {
        Ok(text) => Ok(text),
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => Ok(String::new()),
        Err(error) => Err(format!("{}: {error}", path.display())),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ONE: Part = Part {
        name: "one",
        is_first: true,
    };
    const TWO: Part = Part {
        name: "two",
        is_first: false,
    };

    #[test]
    fn parts_are_replaced_and_all_else_is_left() {
        let document = TWO.replaced("# Title\n\nBy hand.\n", "b");
        let document = ONE.replaced(&document, "a");
        let positions = ["# Title", "\na\n", "By hand.", "\nb\n"].map(|text| document.find(text));
        assert!(
            positions.is_sorted() && positions[0] == Some(0),
            "{document}"
        );
        let again = TWO.replaced(&document, "c");
        assert_eq!(again, document.replace("\nb\n", "\nc\n"));
        assert_eq!(ONE.replaced(&again, "a"), again);
    }

    #[test]
    fn a_part_can_be_kept_alone() {
        let document = ONE.replaced("# Title\n\nOld.\n", "a");
        let kept = ONE.alone(&document, "# New");
        assert!(kept.starts_with("# New\n\n<!-- begin") && !kept.contains("Old."));
        assert!(ONE.is_in(&kept) && !TWO.is_in(&kept));
        assert_eq!(ONE.alone("nothing", "# New"), "# New\n");
        assert_eq!(TWO.replaced("", "b"), TWO.written("b") + "\n");
    }
}
