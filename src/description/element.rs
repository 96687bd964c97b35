//! One XML tag with its attributes after substitution, each of them located, and the checks that every
//! tag needs: no unknown attribute, no missing one, no child where none belongs.

use std::borrow::Cow;

use super::defines::Defines;
use super::upgrade::Version;
use super::xml::Lines;
use crate::error::{Error, Location, Result};

/// The scene file that is being read.
#[derive(Debug)]
pub(super) struct File<'f> {
    pub(super) lines: Lines<'f>,
    pub(super) version: Version,
    /// Where the files that it names are looked for.
    pub(super) scope: u32,
}

/// A tag, with `$name` already replaced in its attributes.
#[derive(Debug)]
pub(super) struct Element<'f> {
    pub(super) tag: &'f str,
    pub(super) location: Location,
    attributes: Vec<Attribute<'f>>,
    node: roxmltree::Node<'f, 'f>,
}

#[derive(Debug)]
struct Attribute<'f> {
    name: &'f str,
    value: Cow<'f, str>,
    location: Location,
}

impl<'f> Element<'f> {
    pub(super) fn open(
        node: roxmltree::Node<'f, 'f>,
        lines: &Lines<'_>,
        defines: &mut Defines,
    ) -> Result<Self> {
        let mut attributes = Vec::new();
        for attribute in node.attributes() {
            let location = lines.at(attribute.range().start);
            let value = defines
                .substitute(attribute.value())
                .map_err(|e| e.at(&location))?;
            attributes.push(Attribute {
                name: attribute.name(),
                value,
                location,
            });
        }
        Ok(Self {
            tag: node.tag_name().name(),
            location: lines.at(node.range().start),
            attributes,
            node,
        })
    }

    /// An error at the tag.
    pub(super) fn error(&self, message: impl Into<String>) -> Error {
        Error::input(message).at(&self.location)
    }

    /// An error at the attribute, or at the tag where that is absent.
    pub(super) fn attribute_error(&self, name: &str, message: impl Into<String>) -> Error {
        Error::input(message).at(self.attribute_location(name))
    }

    /// The attribute's place, or the tag's where that is absent.
    pub(super) fn attribute_location(&self, name: &str) -> &Location {
        self.find(name).map_or(&self.location, |a| &a.location)
    }

    /// Refuses attributes other than `names`.
    pub(super) fn only(&self, names: &[&str]) -> Result<()> {
        match self.attributes.iter().find(|a| !names.contains(&a.name)) {
            None => Ok(()),
            Some(Attribute { name, location, .. }) => Err(Error::input(format!(
                "<{}> has no attribute {name:?}",
                self.tag
            ))
            .at(location)
            .suggest(name, names.iter().copied())),
        }
    }

    pub(super) fn optional(&self, name: &str) -> Option<&str> {
        self.find(name).map(|a| a.value.as_ref())
    }

    pub(super) fn required(&self, name: &str) -> Result<&str> {
        self.optional(name)
            .ok_or_else(|| self.error(format!("<{}> needs the attribute {name:?}", self.tag)))
    }

    /// A required attribute that says something.
    pub(super) fn filled(&self, name: &str) -> Result<&str> {
        match self.required(name)? {
            text if text.trim().is_empty() => {
                Err(self.attribute_error(name, format!("the attribute {name:?} is empty")))
            }
            text => Ok(text),
        }
    }

    /// Child elements in file order; comments and texts are passed over.
    pub(super) fn children(&self) -> impl Iterator<Item = roxmltree::Node<'f, 'f>> + use<'f> {
        self.node.children().filter(roxmltree::Node::is_element)
    }

    /// Refuses child elements.
    pub(super) fn no_children(&self, lines: &Lines<'_>) -> Result<()> {
        match self.children().next() {
            None => Ok(()),
            Some(child) => Err(Error::input(format!(
                "<{}> cannot stand inside <{}>",
                child.tag_name().name(),
                self.tag
            ))
            .at(&lines.at(child.range().start))),
        }
    }

    fn find(&self, name: &str) -> Option<&Attribute<'f>> {
        self.attributes.iter().find(|a| a.name == name)
    }
}
