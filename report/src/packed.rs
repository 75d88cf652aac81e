//! What a page holds compressed: the charts' library and the charts' data.
//!
//! Both are gzip in base64. `page.js` unpacks them with the browser's `DecompressionStream`.

use std::io::Write as _;
use std::sync::OnceLock;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use flate2::Compression;
use flate2::write::GzEncoder;

/// plotly.js; `assets/README.md` says which, and how the file is made.
const LIBRARY: &[u8] = include_bytes!("../assets/plotly-basic.min.js.gz");

/// The charts' library, packed.
pub(crate) fn library() -> &'static str {
    static PACKED: OnceLock<String> = OnceLock::new();
    PACKED.get_or_init(|| STANDARD.encode(LIBRARY))
}

/// `text`, packed.
pub(crate) fn packed(text: &str) -> String {
    let mut encoder = GzEncoder::new(Vec::new(), Compression::default());
    // Writing to memory cannot fail; were it to, the browser would say that the data end too early.
    let _ = encoder.write_all(text.as_bytes());
    STANDARD.encode(encoder.finish().unwrap_or_default())
}

#[cfg(test)]
pub(crate) mod tests {
    use std::io::Read as _;

    use flate2::{Crc, read::GzDecoder};

    use super::*;

    /// What was packed.
    pub(crate) fn unpacked(packed: &str) -> String {
        let bytes = STANDARD.decode(packed).unwrap();
        let mut text = String::new();
        GzDecoder::new(&bytes[..])
            .read_to_string(&mut text)
            .unwrap();
        text
    }

    #[test]
    fn what_is_packed_comes_back() {
        let text = "[0.0,0.01,0.02]".repeat(1000);
        assert!(packed(&text).len() < text.len() / 10);
        assert_eq!(unpacked(&packed(&text)), text);
        assert_eq!(packed(&text), packed(&text));
        assert_eq!(unpacked(&packed("")), "");
    }

    #[test]
    fn the_library_is_the_one_that_the_readme_names() {
        let readme = include_str!("../assets/README.md");
        let library = unpacked(library());
        let version = library
            .split_once("plotly.js (basic - minified) v")
            .and_then(|(_, rest)| rest.lines().next())
            .unwrap();
        assert!(readme.contains(&format!("plotly.js {version}, its bundle `basic`")));
        let mut crc = Crc::new();
        crc.update(library.as_bytes());
        assert!(readme.contains(&format!("CRC-32 `{:08x}`", crc.sum())));
        assert!(include_str!("../assets/plotly.sh").contains(&format!("\nversion={version}\n")));
        assert!(include_str!("../assets/plotly-LICENSE").starts_with("MIT License"));
    }
}
