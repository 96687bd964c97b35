//! Changes to a description before anything is built from it: how the command line's options reach the
//! scene, on the same validated way as the file's own values.

use glam::DVec3;

use super::{Description, Kind, Node, NodeId, Property, Value};
use crate::error::Location;

impl Description {
    /// Gives a node's property a value, in place of the file's where it has one.
    pub fn set(&mut self, id: NodeId, name: &str, value: Value) {
        let properties = &mut self.nodes[id.index()].properties;
        properties.retain(|p| p.name != name);
        properties.push(Property::new(name, value, Location::command_line(), 0));
    }

    /// Makes a node another plugin of its kind, which keeps those of the old one's properties that it `knows`.
    pub fn replace(&mut self, id: NodeId, plugin: &str, knows: impl Fn(&Property) -> bool) {
        let node = &mut self.nodes[id.index()];
        plugin.clone_into(&mut node.plugin);
        node.location = Location::command_line();
        node.properties.retain(knows);
    }

    /// Puts a plugin of the same kind between a node and one that is nested in it; the answer is the new one.
    pub fn wrap(&mut self, parent: NodeId, child: NodeId, plugin: &str) -> NodeId {
        let id = NodeId(self.nodes.len() as u32);
        let kind = self.nodes[child.index()].kind;
        let mut node = Node::new(kind, plugin, Location::command_line());
        let nested = Property::new("", Value::Object(child), Location::command_line(), 0);
        node.properties.push(nested);
        self.nodes.push(node);
        for property in &mut self.nodes[parent.index()].properties {
            if property.value == Value::Object(child) {
                property.value = Value::Object(id);
            }
        }
        id
    }

    /// The nested plugins of a kind, in file order.
    pub fn children_of(&self, parent: NodeId, kind: Kind) -> Vec<NodeId> {
        let nested = |property: &Property| match property.value {
            Value::Object(id) if self.nodes[id.index()].kind == kind => Some(id),
            _ => None,
        };
        let properties = &self.nodes[parent.index()].properties;
        properties.iter().filter_map(nested).collect()
    }

    /// What a node's property holds.
    pub fn get(&self, id: NodeId, name: &str) -> Option<&Value> {
        let properties = &self.nodes[id.index()].properties;
        let property = properties.iter().find(|p| p.name == name);
        property.map(|p| &p.value)
    }

    /// The point that a node's transform looks at, where a `<lookat>` says so.
    pub fn target(&self, id: NodeId, name: &str) -> Option<DVec3> {
        let properties = &self.nodes[id.index()].properties;
        properties.iter().find(|p| p.name == name)?.target
    }

    /// The first nested plugin of a kind, which is added as `plugin` where there is none.
    pub fn child_or_new(&mut self, parent: NodeId, kind: Kind, plugin: &str) -> NodeId {
        if let Some(child) = self.children_of(parent, kind).first() {
            return *child;
        }
        let id = NodeId(self.nodes.len() as u32);
        self.nodes
            .push(Node::new(kind, plugin, Location::command_line()));
        let property = Property::new("", Value::Object(id), Location::command_line(), 0);
        self.nodes[parent.index()].properties.push(property);
        id
    }
}
