//! How much memory is free.

/// Bytes that programs can still take without swapping; known on Linux only.
pub(super) fn available() -> Option<u64> {
    parse(&std::fs::read_to_string("/proc/meminfo").ok()?)
}

fn parse(meminfo: &str) -> Option<u64> {
    let line = meminfo
        .lines()
        .find_map(|line| line.strip_prefix("MemAvailable:"))?;
    let kibibytes: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    kibibytes.checked_mul(1024)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_available_is_read_and_what_is_odd_is_not_believed() {
        let text = "MemTotal:       16 kB\nMemAvailable:    3 kB\n";
        assert_eq!(parse(text), Some(3072));
        for odd in [
            "",
            "MemAvailable: kB",
            "MemAvailable: 99999999999999999999 kB",
        ] {
            assert_eq!(parse(odd), None, "{odd}");
        }
    }
}
