//! Small MCAP files.

fn text(text: &str) -> Vec<u8> {
    let mut out = (text.len() as u32).to_le_bytes().to_vec();
    out.extend(text.as_bytes());
    out
}

fn record(opcode: u8, content: &[u8]) -> Vec<u8> {
    let mut out = vec![opcode];
    out.extend((content.len() as u64).to_le_bytes());
    out.extend(content);
    out
}

fn schema(name: &str, encoding: &str, data: &[u8]) -> Vec<u8> {
    let mut out = 1u16.to_le_bytes().to_vec();
    out.extend(text(name));
    out.extend(text(encoding));
    out.extend((data.len() as u32).to_le_bytes());
    out.extend(data);
    record(3, &out)
}

fn channel(topic: &str, encoding: &str) -> Vec<u8> {
    let mut out = vec![0, 0, 1, 0];
    out.extend(text(topic));
    out.extend(text(encoding));
    out.extend(0u32.to_le_bytes());
    record(4, &out)
}

fn message(k: u32, data: &[u8]) -> Vec<u8> {
    let mut out = 0u16.to_le_bytes().to_vec();
    out.extend(k.to_le_bytes());
    for _ in 0..2 {
        out.extend((10_000_000 * u64::from(k)).to_le_bytes());
    }
    out.extend(data);
    record(5, &out)
}

/// How a chunk is packed.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Packed {
    No,
    Lz4,
    Zstd,
}

fn file(records: &[u8], packed: Packed, checked: bool) -> Vec<u8> {
    use std::io::Write;
    let mut out = b"\x89MCAP0\r\n".to_vec();
    let mut header = text("");
    header.extend(text("test"));
    out.extend(record(1, &header));
    let (name, data) = match packed {
        Packed::No => ("", records.to_vec()),
        Packed::Lz4 => {
            let mut lz4 = lz4_flex::frame::FrameEncoder::new(Vec::new());
            lz4.write_all(records).unwrap();
            ("lz4", lz4.finish().unwrap())
        }
        Packed::Zstd => ("zstd", super::zstd(records)),
    };
    let mut chunk = vec![0; 16];
    chunk.extend((records.len() as u64).to_le_bytes());
    let crc = if checked { crc32fast::hash(records) } else { 0 };
    chunk.extend(crc.to_le_bytes());
    chunk.extend(text(name));
    chunk.extend((data.len() as u64).to_le_bytes());
    chunk.extend(data);
    out.extend(record(6, &chunk));
    out.extend(record(15, &[0; 4]));
    out.extend(record(2, &[0; 20]));
    out.extend(b"\x89MCAP0\r\n");
    out
}

/// Objects with numbers, a text, an array and elements with names.
pub(crate) fn json(packed: Packed, checked: bool) -> Vec<u8> {
    let mut records = schema("drive", "jsonschema", b"{}");
    records.extend(channel("/drive", "json"));
    for k in 0..5u32 {
        let data = format!(
            r#"{{"u":{k},"on":true,"mode":"up","deep":{{"x":[{k},2.5]}},"name":["l","r"],"speed":[{k},-{k}]}}"#
        );
        records.extend(message(k, data.as_bytes()));
    }
    file(&records, packed, checked)
}

/// States of joints as ROS 2 writes them; the order of their names changes on the way.
pub(crate) fn ros2(packed: Packed) -> Vec<u8> {
    let definition = "std_msgs/Header header\nstring[] name\nfloat64[] position\nfloat64[] velocity\nfloat64[] effort\n\
        ===\nMSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n";
    let mut records = schema(
        "sensor_msgs/msg/JointState",
        "ros2msg",
        definition.as_bytes(),
    );
    records.extend(channel("/joint_states", "cdr"));
    for k in 0..5u32 {
        let mut cdr = Cdr(vec![0, 1, 0, 0]);
        cdr.u32(0);
        cdr.u32(10_000_000 * k);
        cdr.text("base");
        let (left, right) = (f64::from(k), -f64::from(k));
        let (names, values) = match k {
            0..3 => (["left", "right"], [left, right]),
            _ => (["right", "left"], [right, left]),
        };
        cdr.u32(2);
        names.iter().for_each(|name| cdr.text(name));
        cdr.u32(0);
        cdr.u32(2);
        values.iter().for_each(|v| cdr.f64(*v));
        cdr.u32(0);
        records.extend(message(k, &cdr.0));
    }
    file(&records, packed, false)
}

struct Cdr(Vec<u8>);

impl Cdr {
    fn align(&mut self, n: usize) {
        let at = (self.0.len() - 4).next_multiple_of(n);
        self.0.resize(at + 4, 0);
    }

    fn u32(&mut self, value: u32) {
        self.align(4);
        self.0.extend(value.to_le_bytes());
    }

    fn f64(&mut self, value: f64) {
        self.align(8);
        self.0.extend(value.to_le_bytes());
    }

    fn text(&mut self, text: &str) {
        self.u32(text.len() as u32 + 1);
        self.0.extend(text.as_bytes());
        self.0.push(0);
    }
}

/// Samples `{ double u = 1; int32 n = 2; repeated float q = 3; string s = 4; }`.
pub(crate) fn protobuf() -> Vec<u8> {
    let field = |number: u8, data: &[u8]| -> Vec<u8> {
        let mut out = vec![number << 3 | 2, data.len() as u8];
        out.extend(data);
        out
    };
    let declare = |name: &str, number: u8, label: u8, kind: u8| {
        let mut out = field(1, name.as_bytes());
        out.extend([3 << 3, number, 4 << 3, label, 5 << 3, kind]);
        field(2, &out)
    };
    let mut sample = field(1, b"Sample");
    for (name, number, label, kind) in [
        ("u", 1, 1, 1),
        ("n", 2, 1, 5),
        ("q", 3, 3, 2),
        ("s", 4, 1, 9),
    ] {
        sample.extend(declare(name, number, label, kind));
    }
    let mut proto = field(1, b"d.proto");
    proto.extend(field(2, b"d"));
    proto.extend(field(4, &sample));
    proto.extend(field(12, b"proto3"));
    let mut records = schema("d.Sample", "protobuf", &field(1, &proto));
    records.extend(channel("/d", "protobuf"));
    for k in 0..5u8 {
        let mut data = vec![1 << 3 | 1];
        data.extend(f64::from(k).to_le_bytes());
        if k > 0 {
            data.extend([2 << 3, k]);
        }
        let q: Vec<u8> = (0..2)
            .flat_map(|j| (f32::from(k) + j as f32).to_le_bytes())
            .collect();
        data.extend(field(3, &q));
        data.extend(field(4, b"up"));
        records.extend(message(u32::from(k), &data));
    }
    file(&records, Packed::No, false)
}
