//! The tags that describe no plugin and no property but how the file is to be read: `<include>`, `<path>`,
//! `<default>` and `<alias>`.

use std::path::{Path, PathBuf};

use super::{MAX_DEPTH, Place, Reader};
use crate::description::NodeId;
use crate::description::element::{Element, File};
use crate::description::report::CANDIDATES;
use crate::description::xml;
use crate::error::{Error, Result};

/// Includes carried out in all files together.
const MAX_INCLUDES: usize = 10_000;

impl Reader<'_> {
    pub(super) fn include(
        &mut self,
        element: &Element<'_>,
        file: &File<'_>,
        place: Place<'_>,
    ) -> Result<()> {
        element.only(&["filename", "name"])?;
        element.no_children(&file.lines)?;
        if place.depth >= MAX_DEPTH {
            return Err(element.error(format!("nested more than {MAX_DEPTH} levels deep")));
        }
        self.includes += 1;
        if self.includes > MAX_INCLUDES {
            let error = element.error(format!("more than {MAX_INCLUDES} includes"));
            self.report.close(error);
            return Ok(());
        }
        let wrong = |e: Error| e.at(element.attribute_location("filename"));
        let path = self
            .scopes
            .find(file.scope, element.filled("filename")?)
            .map_err(wrong)?;
        let file_id = canonical(&path);
        if let Some((_, first)) = self.open_files.iter().find(|(open, _)| *open == file_id) {
            return Err(element
                .error(format!("{} includes itself", path.display()))
                .related(first, "it was opened"));
        }
        let text = self.text(&path).map_err(wrong)?;
        self.open_files.push((file_id, element.location.clone()));
        let scope = self.scopes.open(&path, file.scope);
        let place = Place {
            depth: place.depth + 1,
            name: element.optional("name"),
            ..place
        };
        let result = self.document(&text, &path, scope, Some(place));
        self.open_files.pop();
        result
    }

    /// The text of a file; what is odd about it is noted.
    pub(super) fn read_text(&mut self, path: &Path) -> Result<String> {
        let xml::Text { text, warning } = xml::read_text(path)?;
        if let Some(warning) = warning {
            self.warn(warning);
        }
        Ok(text)
    }

    /// The text of a further file, as long as all together stay within bounds.
    pub(super) fn text(&mut self, path: &Path) -> Result<String> {
        let text = self.read_text(path)?;
        self.sources.push(path.to_owned());
        self.bytes += text.len() as u64;
        if self.bytes > xml::MAX_BYTES {
            let limit = xml::MAX_BYTES >> 20;
            return Err(Error::input(format!(
                "the files that the scene includes hold more than {limit} MiB"
            )));
        }
        Ok(text)
    }

    pub(super) fn default(&mut self, element: &Element<'_>, file: &File<'_>) -> Result<()> {
        element.only(&["name", "value"])?;
        element.no_children(&file.lines)?;
        let name = element.filled("name")?;
        self.defines.set_default(name, element.required("value")?);
        Ok(())
    }

    pub(super) fn path(
        &mut self,
        element: &Element<'_>,
        file: &File<'_>,
        parent: NodeId,
    ) -> Result<()> {
        element.only(&["value"])?;
        element.no_children(&file.lines)?;
        if parent != NodeId::ROOT {
            return Err(element.error("<path> stands directly inside <scene>"));
        }
        let folder = self
            .scopes
            .find(file.scope, element.filled("value")?)
            .map_err(|e| e.at(element.attribute_location("value")))?;
        if !folder.is_dir() {
            return Err(
                element.attribute_error("value", format!("{} is not a folder", folder.display()))
            );
        }
        self.scopes.add(file.scope, folder);
        Ok(())
    }

    pub(super) fn alias(&mut self, element: &Element<'_>, file: &File<'_>) -> Result<()> {
        element.only(&["id", "as"])?;
        element.no_children(&file.lines)?;
        let (id, alias) = (element.filled("id")?, element.filled("as")?);
        let Some(&(node, _)) = self.ids.get(id) else {
            return Err(element
                .attribute_error("id", format!("nothing above has the id {id:?}"))
                .suggest(id, self.ids.keys().take(CANDIDATES).map(String::as_str)));
        };
        self.register(alias, node, element, "as")
    }
}

/// The same for every way to write the path of a file.
pub(super) fn canonical(path: &Path) -> PathBuf {
    path.canonicalize().unwrap_or_else(|_| path.to_path_buf())
}
