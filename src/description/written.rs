//! A plugin as XML again, for files that are written: what was read of it, with parameters, references and includes
//! followed, and with absolute names of files, so that it says the same in whatever folder it stands.

use std::fmt::Write as _;

use glam::DVec3;

use super::{Description, NodeId, Property, Spectrum, Value};

/// A text as an attribute's value, without parameters.
pub fn escaped(text: &str) -> String {
    let text = text.replace('&', "&amp;").replace('"', "&quot;");
    text.replace('<', "&lt;").replace('$', "&#36;")
}

impl Description {
    /// The node and all that it holds as a tag of XML. What is shared stands there as often as it is used.
    pub fn written(&self, id: NodeId) -> String {
        let mut text = String::new();
        self.write_node(id, "", &mut text);
        text
    }

    /// Recursive: the depth of a description is bounded, and so is what it comes to.
    fn write_node(&self, id: NodeId, name: &str, text: &mut String) {
        let node = &self.nodes[id.index()];
        let (tag, plugin) = (node.kind.tag(), escaped(&node.plugin));
        let _ = write!(text, r#"<{tag} type="{plugin}""#);
        if !name.is_empty() {
            let _ = write!(text, r#" name="{}""#, escaped(name));
        }
        if node.properties.is_empty() {
            text.push_str("/>");
            return;
        }
        text.push('>');
        for property in &node.properties {
            match property.value {
                Value::Object(nested) => self.write_node(nested, &property.name, text),
                _ => self.write_value(property, text),
            }
        }
        let _ = write!(text, "</{tag}>");
    }

    fn write_value(&self, property: &Property, text: &mut String) {
        let name = escaped(&property.name);
        let mut plain = |tag: &str, value: &str| {
            let _ = write!(text, r#"<{tag} name="{name}" value="{}"/>"#, escaped(value));
        };
        match &property.value {
            Value::Boolean(value) => plain("boolean", &value.to_string()),
            Value::Integer(value) => plain("integer", &value.to_string()),
            Value::Float(value) => plain("float", &value.to_string()),
            Value::String(value) => plain("string", &self.named(property, value)),
            Value::Vector(value) => plain("vector", &numbers(*value)),
            Value::Rgb(value) => plain("rgb", &numbers(*value)),
            Value::Spectrum(Spectrum::Uniform(value)) => plain("spectrum", &value.to_string()),
            Value::Spectrum(Spectrum::Curve(curve)) => {
                let pairs = curve.iter().map(|(at, value)| format!("{at}:{value}"));
                plain("spectrum", &pairs.collect::<Vec<_>>().join(", "));
            }
            Value::Transform(matrix) => {
                let _ = write!(
                    text,
                    r#"<transform name="{name}">{}</transform>"#,
                    tag_of(matrix)
                );
            }
            Value::Animation(keyframes) => {
                let _ = write!(text, r#"<animation name="{name}">"#);
                for (time, matrix) in keyframes {
                    let matrix = tag_of(matrix);
                    let _ = write!(text, r#"<transform time="{time}">{matrix}</transform>"#);
                }
                text.push_str("</animation>");
            }
            Value::Object(_) => {}
        }
    }

    /// The value of a string, which may be a file's name.
    fn named(&self, property: &Property, value: &str) -> String {
        let is_file = property.name.starts_with("filename");
        let found = is_file.then(|| self.scopes.find(property.scope, value));
        let path = found.and_then(Result::ok);
        let absolute = path.and_then(|path| std::path::absolute(path).ok());
        absolute.map_or_else(
            || value.to_owned(),
            |path| path.to_string_lossy().into_owned(),
        )
    }
}

fn numbers(value: DVec3) -> String {
    format!("{}, {}, {}", value.x, value.y, value.z)
}

fn tag_of(matrix: &glam::DMat4) -> String {
    let rows = matrix.transpose().to_cols_array().map(|v| v.to_string());
    format!(r#"<matrix value="{}"/>"#, rows.join(" "))
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::description::{Kind, Options, Part};

    #[test]
    fn what_is_written_is_read_as_the_same() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("a.png"), "").unwrap();
        let text = r#"<scene version="3.0.0">
            <default name="rough" value="0.1"/>
            <texture type="bitmap" id="t"><string name="filename" value="a.png"/>
                <transform name="to_uv"><scale value="2"/><translate x="0.1"/></transform></texture>
            <bsdf type="twosided"><bsdf type="plastic">
                <ref id="t" name="diffuse_reflectance"/><boolean name="nonlinear" value="true"/>
                <float name="int_ior" value="$rough"/><integer name="i" value="-3"/>
                <rgb name="r" value="0.1, 0.2, 0.3"/><spectrum name="s" value="400:0.5, 700:0.25"/>
                <spectrum name="u" value="0.7"/><vector name="v" value="1, 2, 3"/>
                <string name="q" value='a "b" &lt;&amp; c'/>
                <animation name="m"><transform time="0"/><transform time="1"><translate y="1"/></transform></animation>
            </bsdf></bsdf></scene>"#;
        let read = |text: &str, path: &Path| {
            Description::parse(text, path, &Options::default()).unwrap_or_else(|e| panic!("{e}"))
        };
        let first = read(text, &folder.path().join("a.xml"));
        let bsdf = |scene: &Description| scene.children_of(NodeId::ROOT, Kind::Bsdf)[0];
        let written = first.written(bsdf(&first));
        let absolute = folder.path().join("a.png").display().to_string();
        let second = read(
            &format!(r#"<scene version="3.0.0">{written}</scene>"#),
            Path::new("elsewhere/b.xml"),
        );
        let only = format!(
            r#"<scene version="3.0.0">{}</scene>"#,
            text[text.find("<bsdf").unwrap()..].replace(
                r#"<ref id="t" name="diffuse_reflectance"/>"#,
                &format!(
                    r#"<texture type="bitmap" name="diffuse_reflectance"><string name="filename" value="{absolute}"/>
                    <transform name="to_uv"><scale value="2"/><translate x="0.1"/></transform></texture>"#
                ),
            ).replace("$rough", "0.1").replace("</scene>", "")
        );
        let expected = read(&only, Path::new("c.xml"));
        assert_eq!(
            second.canonical(Part::Scene).text,
            expected.canonical(Part::Scene).text
        );
    }
}
