//! What the VTK XML files share: named arrays, and their zlib-compressed blocks at the end of the file.
//!
//! Layout after the VTK file format specification: raw appended data behind an underscore, each array as a header of
//! little-endian `u64` (number of blocks, bytes in a block, bytes in the last block or 0 if it is full, compressed
//! bytes of each block) followed by the blocks.

use std::borrow::Cow;
use std::fmt::Write as _;
use std::io::{self, Write};
use std::path::Path;

use flate2::Compression;
use flate2::write::ZlibEncoder;
use rayon::prelude::*;

use crate::{Error, atomic};

/// The values of a [`Field`]; a vector's components lie side by side.
#[derive(Debug, Clone, Copy)]
pub enum Values<'a> {
    /// Bytes, for flags.
    U8(&'a [u8]),
    /// Unsigned integers.
    U32(&'a [u32]),
    /// Single precision.
    F32(&'a [f32]),
    /// Double precision.
    F64(&'a [f64]),
}

impl<'a> Values<'a> {
    fn len(self) -> usize {
        match self {
            Self::U8(v) => v.len(),
            Self::U32(v) => v.len(),
            Self::F32(v) => v.len(),
            Self::F64(v) => v.len(),
        }
    }

    fn bytes(self) -> &'a [u8] {
        match self {
            Self::U8(v) => v,
            Self::U32(v) => bytemuck::cast_slice(v),
            Self::F32(v) => bytemuck::cast_slice(v),
            Self::F64(v) => bytemuck::cast_slice(v),
        }
    }

    fn vtk_type(self) -> &'static str {
        match self {
            Self::U8(_) => "UInt8",
            Self::U32(_) => "UInt32",
            Self::F32(_) => "Float32",
            Self::F64(_) => "Float64",
        }
    }
}

/// A named array over cells or points.
#[derive(Debug, Clone, Copy)]
pub struct Field<'a> {
    /// Name with its unit, for instance "pressure \[Pa\]".
    pub name: &'a str,
    /// 1 for a scalar, 3 for a vector, 6 for a symmetric tensor: XX, YY, ZZ, XY, YZ, XZ.
    pub components: usize,
    /// The values, `components` for each cell or point.
    pub values: Values<'a>,
}

/// A VTK XML file in the making: its XML, and the arrays appended to it.
pub(crate) struct Document {
    kind: &'static str,
    xml: String,
    appended: Vec<u8>,
}

impl Document {
    /// Begins a data set of type `kind`, with the given attributes, at `time` seconds.
    pub(crate) fn new(kind: &'static str, attributes: &str, time: f64) -> Self {
        let xml = format!(
            "<?xml version=\"1.0\"?>\n\
             <VTKFile type=\"{kind}\" version=\"1.0\" byte_order=\"LittleEndian\" header_type=\"UInt64\" \
             compressor=\"vtkZLibDataCompressor\">\n\
             <{kind}{attributes}>\n\
             <FieldData>\n\
             <DataArray type=\"Float64\" Name=\"TimeValue\" NumberOfTuples=\"1\" format=\"ascii\">{time:?}</DataArray>\n\
             </FieldData>\n"
        );
        Self { kind, xml, appended: Vec::new() }
    }

    /// Adds a line of XML.
    pub(crate) fn line(&mut self, xml: &str) {
        self.xml.push_str(xml);
        self.xml.push('\n');
    }

    /// Adds the fields, each with `components` values for each of `count` cells or points, as the section `name`.
    pub(crate) fn section(&mut self, name: &str, count: usize, fields: &[Field]) -> Result<(), Error> {
        self.line(&format!("<{name}>"));
        for field in fields {
            let (expected, found) = (count * field.components, field.values.len());
            if found != expected {
                return Err(Error::Length { what: field.name.to_owned(), expected, found });
            }
            self.array(field.name, field.components, field.values.vtk_type(), field.values.bytes());
        }
        self.line(&format!("</{name}>"));
        Ok(())
    }

    /// Adds one array.
    pub(crate) fn array(&mut self, name: &str, components: usize, vtk_type: &str, bytes: &[u8]) {
        let (name, offset) = (escape(name), self.appended.len());
        // The order is VTK's own; files of others often have YZ last but two or XZ before it, so that it is said.
        let tensor = ["XX", "YY", "ZZ", "XY", "YZ", "XZ"];
        let named = if components == tensor.len() { &tensor[..] } else { &[] };
        let named: String =
            named.iter().enumerate().map(|(n, name)| format!(" ComponentName{n}=\"{name}\"")).collect();
        // Writing to a string cannot fail.
        let _ = writeln!(
            self.xml,
            "<DataArray type=\"{vtk_type}\" Name=\"{name}\" NumberOfComponents=\"{components}\"{named} format=\"appended\" \
             offset=\"{offset}\"/>"
        );
        append_compressed(&mut self.appended, bytes);
    }

    /// Writes the file.
    pub(crate) fn write(&self, path: &Path) -> Result<(), Error> {
        atomic::write_with(path, |file| {
            file.write_all(self.xml.as_bytes())?;
            write!(file, "</{}>\n<AppendedData encoding=\"raw\">\n_", self.kind)?;
            file.write_all(&self.appended)?;
            file.write_all(b"\n</AppendedData>\n</VTKFile>\n")
        })
    }
}

fn append_compressed(out: &mut Vec<u8>, bytes: &[u8]) {
    const BLOCK: usize = 1 << 18;
    let blocks: Vec<Vec<u8>> = bytes.par_chunks(BLOCK).map(compressed).collect();
    let header = [blocks.len(), BLOCK, bytes.len() % BLOCK].into_iter().chain(blocks.iter().map(Vec::len));
    out.extend(header.flat_map(|n| (n as u64).to_le_bytes()));
    for block in &blocks {
        out.extend_from_slice(block);
    }
}

fn compressed(block: &[u8]) -> Vec<u8> {
    let write = || -> io::Result<Vec<u8>> {
        // Level 1: fields of numbers gain little from more, and cost much time.
        let mut encoder = ZlibEncoder::new(Vec::new(), Compression::fast());
        encoder.write_all(block)?;
        encoder.finish()
    };
    write().expect("writing to memory does not fail")
}

/// Text as it may stand in an XML attribute.
pub(crate) fn escape(text: &str) -> Cow<'_, str> {
    if !text.contains(|c: char| "&<>\"".contains(c) || c.is_control()) {
        return Cow::Borrowed(text);
    }
    let mut escaped = String::new();
    for c in text.chars() {
        match c {
            '&' => escaped.push_str("&amp;"),
            '<' => escaped.push_str("&lt;"),
            '>' => escaped.push_str("&gt;"),
            '"' => escaped.push_str("&quot;"),
            c if c.is_control() => escaped.push(' '),
            c => escaped.push(c),
        }
    }
    Cow::Owned(escaped)
}

/// Reading back what [`Document`] wrote, for the tests of the formats.
#[cfg(test)]
pub(crate) mod read_back {
    use std::collections::BTreeMap;
    use std::io::Read;
    use std::path::Path;

    use flate2::read::ZlibDecoder;

    /// The XML without the appended data, and the decompressed bytes of each array by name.
    pub(crate) fn arrays(path: &Path) -> (String, BTreeMap<String, Vec<u8>>) {
        let file = std::fs::read(path).unwrap();
        let mark: &[u8] = b"<AppendedData encoding=\"raw\">\n_";
        let start = file.windows(mark.len()).position(|w| w == mark).unwrap() + mark.len();
        assert!(file.ends_with(b"\n</AppendedData>\n</VTKFile>\n"));
        let mut xml = String::from_utf8(file[..start - 1].to_vec()).unwrap();
        xml.push_str("</AppendedData></VTKFile>");
        let document = roxmltree::Document::parse(&xml).unwrap();
        let mut arrays = BTreeMap::new();
        for node in document.descendants().filter(|n| n.attribute("format") == Some("appended")) {
            let offset: usize = node.attribute("offset").unwrap().parse().unwrap();
            arrays.insert(node.attribute("Name").unwrap().to_owned(), decompressed(&file[start + offset..]));
        }
        (xml, arrays)
    }

    fn decompressed(data: &[u8]) -> Vec<u8> {
        let word = |n: usize| u64::from_le_bytes(data[8 * n..8 * n + 8].try_into().unwrap()) as usize;
        let (blocks, size, last) = (word(0), word(1), word(2));
        let mut at = 8 * (3 + blocks);
        let mut out = Vec::new();
        for block in 0..blocks {
            let before = out.len();
            let bytes = &data[at..at + word(3 + block)];
            ZlibDecoder::new(bytes).read_to_end(&mut out).unwrap();
            at += bytes.len();
            let full = block + 1 < blocks || last == 0;
            assert_eq!(out.len() - before, if full { size } else { last });
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_survive_as_attributes() {
        let name = "a<b & \"c\" [m/s²]";
        let xml = format!("<x n=\"{}\"/>", escape(name));
        assert_eq!(roxmltree::Document::parse(&xml).unwrap().root_element().attribute("n"), Some(name));
        assert_eq!(escape("a\u{1}b"), "a b");
    }
}
