//! The machine, in words: its processor and how much memory it has. Known on Linux; elsewhere
//! the number of processors and the system's name.

use std::fs;
use std::thread;

use crate::budget::human_bytes;
use crate::lanes::Kernel;

/// Such as `AMD EPYC 7543, 2 processors, 16.4 GB, linux x86_64, AVX2`.
pub fn machine() -> String {
    let read = |file| fs::read_to_string(file).unwrap_or_default();
    let (model, memory) = (
        model(&read("/proc/cpuinfo")),
        memory(&read("/proc/meminfo")),
    );
    let processors = thread::available_parallelism().map_or(1, usize::from);
    let processors = match processors {
        1 => "1 processor".to_owned(),
        n => format!("{n} processors"),
    };
    let system = format!("{} {}", std::env::consts::OS, std::env::consts::ARCH);
    let parts = [
        model,
        Some(processors),
        memory.map(human_bytes),
        Some(system),
        Some(Kernel::best().name().to_owned()),
    ];
    parts.into_iter().flatten().collect::<Vec<_>>().join(", ")
}

/// What the processor is called.
fn model(cpuinfo: &str) -> Option<String> {
    let line = cpuinfo
        .lines()
        .find(|line| line.starts_with("model name"))?;
    let (_, name) = line.split_once(':')?;
    let name: Vec<&str> = name.split_whitespace().collect();
    (!name.is_empty()).then(|| name.join(" "))
}

/// Bytes of memory.
fn memory(meminfo: &str) -> Option<u64> {
    let line = meminfo
        .lines()
        .find_map(|line| line.strip_prefix("MemTotal:"))?;
    let kibibytes: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    kibibytes.checked_mul(1024)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn processor_and_memory_are_read_and_what_is_odd_is_left_out() {
        let cpuinfo = "processor\t: 0\nmodel name\t: Some  CPU @ 2 GHz\n";
        assert_eq!(model(cpuinfo).unwrap(), "Some CPU @ 2 GHz");
        assert_eq!(memory("MemTotal:       1000 kB\n"), Some(1_024_000));
        for odd in ["", "model name", "model name :", "MemTotal: many kB"] {
            assert_eq!((model(odd), memory(odd)), (None, None), "{odd}");
        }
        assert!(machine().contains("processor"));
    }
}
