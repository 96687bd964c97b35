//! A plugin of one scene file in another scene: with all that is nested in it, and with the folders in which the files that
//! it names are looked for.

use std::collections::HashMap;

use super::{Description, NodeId, Property, Value};

impl Description {
    /// Nests the node `id` of `other`, with all that it holds, in `parent`. Places stay those of the other file, which
    /// becomes one of [`Description::sources`], and its warnings are told with these.
    pub fn graft(&mut self, parent: NodeId, other: &Self, id: NodeId) {
        let scope = self.scopes.append(&other.scopes);
        let mut copies = HashMap::new();
        let copy = self.copy(other, id, scope, &mut copies);
        let location = other.nodes[id.index()].location.clone();
        let property = Property::new("", Value::Object(copy), location, scope);
        self.nodes[parent.index()].properties.push(property);
        self.warnings.extend_from_slice(&other.warnings);
        for source in &other.sources {
            if !self.sources.contains(source) {
                self.sources.push(source.clone());
            }
        }
    }

    /// Recursive: the depth of a description is bounded.
    fn copy(
        &mut self,
        other: &Self,
        id: NodeId,
        scope: u32,
        copies: &mut HashMap<NodeId, NodeId>,
    ) -> NodeId {
        if let Some(copy) = copies.get(&id) {
            return *copy;
        }
        let mut node = other.nodes[id.index()].clone();
        for property in &mut node.properties {
            property.scope += scope;
            if let Value::Object(nested) = &mut property.value {
                *nested = self.copy(other, *nested, scope, copies);
            }
        }
        let copy = NodeId(self.nodes.len() as u32);
        self.nodes.push(node);
        copies.insert(id, copy);
        copy
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::description::{Kind, Options};

    #[test]
    fn a_grafted_material_is_shared_located_and_finds_its_files_as_before() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("wood.png"), "").unwrap();
        let path = folder.path().join("wood.xml");
        let material = r#"<scene version="3.0.0"><texture type="bitmap" id="t">
            <string name="filename" value="wood.png"/></texture>
            <bsdf type="plastic"><ref name="a" id="t"/><ref name="b" id="t"/></bsdf></scene>"#;
        let other = Description::parse(material, &path, &Options::default()).unwrap();
        let text = r#"<scene version="3.0.0"><shape type="cube"/></scene>"#;
        let mut scene = Description::parse(text, Path::new("a.xml"), &Options::default()).unwrap();
        let shape = scene.children_of(NodeId::ROOT, Kind::Shape)[0];
        let bsdf = other.children_of(NodeId::ROOT, Kind::Bsdf)[0];
        scene.graft(shape, &other, bsdf);
        let root = scene.root();
        let bsdf = root.children(Kind::Shape)[0].children(Kind::Bsdf)[0];
        assert_eq!(bsdf.location().line, 3);
        let textures = bsdf.children(Kind::Texture);
        assert_eq!(textures[0].node_id(), textures[1].node_id());
        let file = textures[0].file("filename").unwrap();
        assert_eq!(file, folder.path().join("wood.png"));
        assert_eq!(scene.sources(), [Path::new("a.xml"), &path]);
    }
}
