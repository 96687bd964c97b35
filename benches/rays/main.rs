//! Étendue's rays beside those of obvhs and Embree 4, on the same meshes, with the same rays, in one run.
//!
//!     cargo bench --bench rays                                       # everything that is there
//!     EMBREE_LIB=$(tools/embree) cargo bench --bench rays            # with Embree
//!     cargo bench --bench rays -- bunny dragon --repeat 9            # only these, more rounds
//!     cargo bench --bench rays -- crown --once --beside Embree       # Embree and its packets alone
//!     cargo bench --bench rays -- --quick --json target/rays.json    # fewer rays, no terrain
//!
//! The tracers take turns in each round, each with one thread and with two, so that what disturbs the machine
//! disturbs all alike. A ratio is the median over the rounds, and beside it stand the least and the greatest.
//! Two threads are to be held against what an arithmetic loop gains in the same rounds.
//! "Differ" counts the rays on which a tracer and Étendue do not agree.

#![allow(clippy::print_stdout, clippy::print_stderr)] // a bench's business

mod arguments;
mod embree;
mod measure;
mod meshes;
mod obvhs;
mod ours;
mod peer;
mod rays;
mod report;
mod strands;
mod watertight;

use std::process::ExitCode;
use std::sync::Arc;

use clap::Parser;

use arguments::Arguments;
use embree::Embree;
use meshes::Named;
use peer::Maker;
use report::Report;

fn main() -> ExitCode {
    match run(&Arguments::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(message) => {
            eprintln!("error: {message}");
            ExitCode::FAILURE
        }
    }
}

fn run(arguments: &Arguments) -> Result<(), String> {
    let embree = Embree::of_environment()?.map(Arc::new);
    if embree.is_none() {
        println!("EMBREE_LIB is not set: without Embree (tools/embree fetches it)");
    }
    let mut makers: Vec<Maker> = ours::makers()
        .into_iter()
        .chain(obvhs::makers())
        .chain(embree.iter().flat_map(embree::makers))
        .collect();
    let names: Vec<&str> = makers.iter().map(|maker| maker.name).collect();
    arguments.check(&names)?;
    makers.retain(|maker| arguments.wants(maker.name));
    let mut report = Report::default();
    for name in arguments.meshes() {
        if name == Named::Watertight {
            let misses = watertight::misses(&makers, arguments.rays())?;
            report::print_misses(&misses);
            report.watertight = Some(misses);
        } else if name == Named::Strands {
            let measured = strands::measure(embree.as_ref(), arguments)?;
            report::print_mesh(&measured);
            report.meshes.push(measured);
        } else if let Some(geometry) = meshes::load(name)? {
            let measured = measure::mesh(name, &geometry, &makers, arguments)?;
            report::print_mesh(&measured);
            report.meshes.push(measured);
        }
    }
    match &arguments.json {
        Some(path) => report.write(path),
        None => Ok(()),
    }
}
