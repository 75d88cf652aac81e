//! Small logs of every format, made by writers of their own.

#![allow(dead_code, reason = "not every test needs every writer")]

pub(crate) mod mcap;
pub(crate) mod tables;

/// Little-endian bytes behind a tag, as MATLAB has them.
fn element(kind: u32, data: &[u8]) -> Vec<u8> {
    let mut out = Vec::new();
    out.extend(kind.to_le_bytes());
    out.extend((data.len() as u32).to_le_bytes());
    out.extend(data);
    out.resize(out.len().next_multiple_of(8), 0);
    out
}

fn variable(class: u8, dims: &[u32], name: &str, content: &[u8]) -> Vec<u8> {
    let mut flags = vec![class, 0, 0, 0];
    flags.extend([0; 4]);
    let dims: Vec<u8> = dims.iter().flat_map(|d| d.to_le_bytes()).collect();
    let mut out = element(6, &flags);
    out.extend(element(5, &dims));
    out.extend(element(1, name.as_bytes()));
    out.extend(content);
    element(14, &out)
}

/// `u` of ten rows, `y` of ten rows and two columns packed by zlib, a text, a structure, a cell.
pub(crate) fn mat() -> Vec<u8> {
    use std::io::Write;
    let doubles = |n: usize, from: f64| -> Vec<u8> {
        let values = (0..n).flat_map(|k| (from + k as f64).to_le_bytes());
        element(9, &values.collect::<Vec<_>>())
    };
    let mut out = vec![b' '; 116];
    out[..6].copy_from_slice(b"MATLAB");
    out.extend([0; 8]);
    out.extend([0, 1, b'I', b'M']);
    out.extend(variable(6, &[10, 1], "u", &doubles(10, 0.0)));
    let packed = variable(6, &[10, 2], "y", &doubles(20, 100.0));
    let mut zlib = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::default());
    zlib.write_all(&packed).unwrap();
    let packed = zlib.finish().unwrap();
    out.extend(15u32.to_le_bytes());
    out.extend((packed.len() as u32).to_le_bytes());
    out.extend(packed);
    out.extend(variable(4, &[1, 2], "s", &element(16, b"hi")));
    let mut fields = element(5, &8u32.to_le_bytes());
    fields.extend(element(1, b"a\0\0\0\0\0\0\0b\0\0\0\0\0\0\0"));
    fields.extend(variable(6, &[1, 1], "", &doubles(1, 7.0)));
    fields.extend(variable(9, &[3, 1], "", &element(2, &[1, 2, 3])));
    out.extend(variable(2, &[1, 1], "d", &fields));
    let cell = variable(6, &[1, 1], "", &doubles(1, 9.0));
    out.extend(variable(1, &[1, 1], "c", &cell));
    out
}

fn wpilog_record(entry: u32, micros: u32, payload: &[u8]) -> Vec<u8> {
    let mut out = vec![3 | 3 << 2 | 3 << 4];
    out.extend(entry.to_le_bytes());
    out.extend((payload.len() as u32).to_le_bytes());
    out.extend(micros.to_le_bytes());
    out.extend(payload);
    out
}

fn wpilog_start(entry: u32, name: &str, kind: &str, metadata: &str) -> Vec<u8> {
    let mut payload = vec![0];
    payload.extend(entry.to_le_bytes());
    for text in [name, kind, metadata] {
        payload.extend((text.len() as u32).to_le_bytes());
        payload.extend(text.as_bytes());
    }
    wpilog_record(0, 0, &payload)
}

/// Numbers, booleans, arrays, texts, a struct and frames of a motor controller.
pub(crate) fn wpilog() -> Vec<u8> {
    let mut out = b"WPILOG\x00\x01\x00\x00\x00\x00".to_vec();
    out.extend(wpilog_start(1, "u", "double", r#"{"unit":"V"}"#));
    out.extend(wpilog_start(2, "on", "boolean", ""));
    out.extend(wpilog_start(3, "state", "string", ""));
    out.extend(wpilog_start(4, "speeds", "float[]", ""));
    out.extend(wpilog_start(
        5,
        "NT:/.schema/struct:Pose",
        "structschema",
        "",
    ));
    out.extend(wpilog_start(6, "pose", "struct:Pose", ""));
    out.extend(wpilog_start(7, "NT:/URCL", "URCL", ""));
    out.extend(wpilog_record(
        5,
        1,
        b"double x;int16 n[2];bool b:1;uint8 c:3",
    ));
    for k in 0u8..6 {
        let micros = 1000 * u32::from(k);
        let x = f64::from(k);
        out.extend(wpilog_record(1, micros, &x.to_le_bytes()));
        out.extend(wpilog_record(2, micros, &[k % 2]));
        out.extend(wpilog_record(
            3,
            micros,
            if k < 3 { b"up" } else { b"down" },
        ));
        let speeds: Vec<u8> = (0..3)
            .flat_map(|j| (x as f32 + j as f32).to_le_bytes())
            .collect();
        out.extend(wpilog_record(4, micros, &speeds));
        let mut pose = x.to_le_bytes().to_vec();
        pose.extend([k, 0, 2, 0, 0b1011]);
        out.extend(wpilog_record(6, micros, &pose));
        let mut frames = vec![0, 0, 0, 0, 1, 0, 0, 0];
        frames.extend(u32::from(k).to_le_bytes());
        frames.extend((6u16 << 10 | 1 << 6 | 11).to_le_bytes());
        frames.extend((100.0 * x as f32).to_le_bytes());
        frames.extend([30, 0, 6, 0]);
        out.extend(wpilog_record(7, micros, &frames));
    }
    out
}

fn ulog_message(kind: u8, content: &[u8]) -> Vec<u8> {
    let mut out = (content.len() as u16).to_le_bytes().to_vec();
    out.push(kind);
    out.extend(content);
    out
}

/// Two topics with nested formats and arrays, and a line that was logged.
pub(crate) fn ulog() -> Vec<u8> {
    let mut out = b"ULog\x01\x12\x35\x01\0\0\0\0\0\0\0\0".to_vec();
    out.extend(ulog_message(b'B', &[0; 40]));
    out.extend(ulog_message(b'F', b"cell:float v;uint8_t[2] flags;"));
    out.extend(ulog_message(
        b'F',
        b"battery:uint64_t timestamp;cell[2] cells;char[4] name;uint8_t[1] _padding0;",
    ));
    out.extend(ulog_message(
        b'F',
        b"rate:uint64_t timestamp;double x;int16_t n;",
    ));
    out.extend(ulog_message(b'A', b"\0\0\0battery"));
    out.extend(ulog_message(b'A', b"\x01\x01\0rate"));
    for k in 0u8..6 {
        let micros = (1000 * u64::from(k)).to_le_bytes();
        let mut battery = vec![0, 0];
        battery.extend(micros);
        for cell in 0..2u8 {
            battery.extend((f32::from(k) + f32::from(cell)).to_le_bytes());
            battery.extend([k, cell]);
        }
        battery.extend(b"up\0\0\0");
        out.extend(ulog_message(b'D', &battery));
        let mut rate = vec![1, 0];
        rate.extend(micros);
        rate.extend((0.5 * f64::from(k)).to_le_bytes());
        rate.extend((-i16::from(k)).to_le_bytes());
        out.extend(ulog_message(b'D', &rate));
    }
    out.extend(ulog_message(b'L', b"6\0\0\0\0\0\0\0\0hello"));
    out
}

/// An array of one type, or a structured one.
pub(crate) fn npy(header: &str, body: &[u8]) -> Vec<u8> {
    let mut text = header.to_owned();
    while (10 + text.len()) % 64 != 63 {
        text.push(' ');
    }
    text.push('\n');
    let mut out = b"\x93NUMPY\x01\x00".to_vec();
    out.extend((text.len() as u16).to_le_bytes());
    out.extend(text.as_bytes());
    out.extend(body);
    out
}

/// A table of five rows.
pub(crate) fn npy_table() -> Vec<u8> {
    let header = "{'descr': [('t', '<M8[ms]'), ('u', '>f4', (2,)), ('s', '<U2')], 'fortran_order': False, 'shape': (5,), }";
    let mut body = Vec::new();
    for k in 0..5i64 {
        body.extend((10 * k).to_le_bytes());
        body.extend((k as f32).to_be_bytes());
        body.extend((-k as f32).to_be_bytes());
        body.extend(b"a\0\0\0b\0\0\0");
    }
    npy(header, &body)
}

/// A matrix of three rows and two columns.
pub(crate) fn npy_matrix() -> Vec<u8> {
    let body: Vec<u8> = (0..6).flat_map(|k| f64::from(k).to_le_bytes()).collect();
    npy(
        "{'descr': '<f8', 'fortran_order': False, 'shape': (3, 2), }",
        &body,
    )
}

pub(crate) fn npz() -> Vec<u8> {
    use std::io::{Cursor, Write};
    use zip::write::SimpleFileOptions;
    let mut zip = zip::ZipWriter::new(Cursor::new(Vec::new()));
    let packed = [
        zip::CompressionMethod::Deflated,
        zip::CompressionMethod::Stored,
    ];
    for (name, method) in ["y.npy", "z.npy"].iter().zip(packed) {
        let options = SimpleFileOptions::default().compression_method(method);
        zip.start_file(*name, options).unwrap();
        zip.write_all(&npy_matrix()).unwrap();
    }
    zip.finish().unwrap().into_inner()
}

pub(crate) fn gzip(data: &[u8]) -> Vec<u8> {
    use std::io::Write;
    let mut out = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
    out.write_all(data).unwrap();
    out.finish().unwrap()
}

pub(crate) fn zstd(data: &[u8]) -> Vec<u8> {
    use ruzstd::encoding::{CompressionLevel, compress_to_vec};
    compress_to_vec(data, CompressionLevel::Fastest)
}
