//! What the bench is asked for.

use std::path::PathBuf;

use clap::Parser;

use crate::meshes::Named;
use crate::ours;

/// Measures Étendue's rays beside those of obvhs and, where EMBREE_LIB names its library, of Embree 4.
#[derive(Debug, Parser)]
#[command(name = "rays")]
pub(crate) struct Arguments {
    /// What to trace; all, where nothing is named
    #[arg(value_enum)]
    meshes: Vec<Named>,

    /// A quarter of the rays, and no terrain unless it is named
    #[arg(long)]
    quick: bool,

    /// Rounds, after one that does not count
    #[arg(long, default_value_t = 5, value_parser = clap::value_parser!(u32).range(1..))]
    pub(crate) repeat: u32,

    /// Build each tree only once, with all threads, and none that is not traced
    #[arg(long)]
    pub(crate) once: bool,

    /// Of the others only these, by their names in the report, e.g. `Embree`; or `none`
    #[arg(long, value_name = "NAME", value_delimiter = ',')]
    beside: Vec<String>,

    /// Also write what was measured, as JSON
    #[arg(long, value_name = "FILE")]
    pub(crate) json: Option<PathBuf>,

    /// What `cargo bench` says to every bench
    #[arg(long, hide = true)]
    bench: bool,
}

impl Arguments {
    /// In the order in which they were named.
    pub(crate) fn meshes(&self) -> Vec<Named> {
        if !self.meshes.is_empty() {
            return self.meshes.clone();
        }
        let quick = |name: &Named| !(self.quick && *name == Named::Terrain);
        Named::ALL.into_iter().filter(quick).collect()
    }

    /// That only these names, those of tracers, are asked for.
    pub(crate) fn check(&self, names: &[&str]) -> Result<(), String> {
        let known = |name: &str| name == "none" || names.contains(&name);
        match self.beside.iter().find(|name| !known(name)) {
            Some(name) => Err(format!(
                "there is no tracer {name:?}; there are {}, and none",
                names.join(", ")
            )),
            None => Ok(()),
        }
    }

    /// Whether a tracer of this name is measured.
    pub(crate) fn wants(&self, name: &str) -> bool {
        self.beside.is_empty() || name == ours::NAME || self.beside.iter().any(|n| n == name)
    }

    /// How many rays a set has.
    pub(crate) fn rays(&self) -> usize {
        if self.quick { 1 << 16 } else { 1 << 18 }
    }
}
