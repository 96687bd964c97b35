//! One way to read text, whoever wrote it: with a byte-order mark or without, in lines that end in LF, CRLF or CR.

/// What some programs put before text in UTF-8.
pub(crate) const BYTE_ORDER_MARK: &[u8] = b"\xef\xbb\xbf";

/// `text` behind its byte-order mark, if it has one.
pub(crate) fn without_mark(text: &[u8]) -> &[u8] {
    text.strip_prefix(BYTE_ORDER_MARK).unwrap_or(text)
}

/// The lines of `text` without their ends, and without a byte-order mark before the first.
pub(crate) fn lines(text: &[u8]) -> impl Iterator<Item = &[u8]> {
    let mut rest = Some(without_mark(text));
    std::iter::from_fn(move || {
        let text = rest?;
        let end = text.iter().position(|b| matches!(b, b'\n' | b'\r'));
        let (line, after) = text.split_at(end.unwrap_or(text.len()));
        rest = match after {
            [] => None,
            [b'\r', b'\n', after @ ..] | [_, after @ ..] => Some(after),
        };
        Some(line)
    })
}

/// Turns each CR that is not followed by an LF into an LF, so that every line ends in one. Where more text follows, a
/// CR at the end stays, for the next byte may be its LF.
pub(crate) fn end_lines_in_feeds(text: &mut [u8], is_last: bool) {
    if !text.contains(&b'\r') {
        return;
    }
    for i in 1..text.len() {
        if text[i - 1] == b'\r' && text[i] != b'\n' {
            text[i - 1] = b'\n';
        }
    }
    if let Some(last) = text.last_mut().filter(|last| is_last && **last == b'\r') {
        *last = b'\n';
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_the_same_whatever_ends_them() {
        let wanted: [&[u8]; 5] = [b"a b", b"", b"c", b"d", b""];
        for text in [
            "a b\n\nc\nd\n",
            "\u{feff}a b\r\n\r\nc\r\nd\r\n",
            "a b\r\rc\rd\r",
            "a b\n\r\nc\rd\r\n",
        ] {
            assert!(lines(text.as_bytes()).eq(wanted), "{text:?}");
            for cut in 0..=text.len() {
                let mut bytes = without_mark(text.as_bytes()).to_vec();
                let cut = cut.min(bytes.len());
                end_lines_in_feeds(&mut bytes[..cut], false);
                end_lines_in_feeds(&mut bytes[cut.saturating_sub(1)..], true);
                let lines: Vec<&[u8]> = bytes
                    .split(|&b| b == b'\n')
                    .map(<[u8]>::trim_ascii_end)
                    .collect();
                assert_eq!(lines, wanted, "{text:?} {cut}");
            }
        }
        assert!(lines(b"").eq([b""]) && lines(b"\xef\xbb\xbf").eq([b""]));
    }
}
