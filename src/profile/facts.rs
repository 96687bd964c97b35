//! What a profile says beside series and verdicts, in sentences: what the tree and threads bring, what a triangle
//! takes, and how calm the machine was.

use std::fmt::Write as _;

use super::Profile;

impl Profile {
    /// What there is to say beside series and verdicts, in sentences.
    pub fn facts(&self) -> Vec<String> {
        let mut facts = Vec::new();
        if let Some(crossover) = &self.crossover {
            let at = |x: Option<f64>| match x {
                Some(x) if crossover.least == x => {
                    format!("at all sizes, {x:.0} triangles and more")
                }
                Some(x) => format!("from {x:.0} triangles on"),
                None => "nowhere within these sizes".to_owned(),
            };
            facts.push(format!(
                "the tree is faster than brute force {}; with its build, for {} rays, {}",
                at(crossover.tracing),
                crossover.rays,
                at(crossover.with_build)
            ));
        }
        if let Some([geometry, tree]) = self.bytes_per_triangle {
            facts.push(format!(
                "a triangle takes {geometry:.1} bytes of geometry and {tree:.1} of tree"
            ));
        }
        let noise = &self.noise;
        for scaling in &self.scaling {
            let [low, high] = scaling.interval;
            let mut fact = format!(
                "{} with {} threads: {:.2} times as fast [{low:.2}, {high:.2}]",
                scaling.phase.bare_name(),
                scaling.threads,
                scaling.speedup
            );
            if let (Some(efficiency), Some(serial)) = (scaling.efficiency, scaling.serial) {
                let _ = write!(
                    fact,
                    ", {:.0} % of the arithmetic loop's {:.2}; Amdahl's serial part {:.1} %",
                    100.0 * efficiency,
                    noise.gain,
                    100.0 * serial
                );
            }
            facts.push(fact);
        }
        let waiting = noise.waiting.map_or(String::new(), |part| {
            format!(
                "; threads waited for a processor for {:.1} % of them",
                100.0 * part
            )
        });
        facts.push(format!(
            "noise: {} arithmetic loops of {:.0} ms spread over {:.1} %{waiting}; {} threads do {:.2} times as much as one",
            noise.loops,
            1e3 * noise.seconds,
            100.0 * noise.spread,
            noise.threads,
            noise.gain
        ));
        facts
    }
}
