//! What is not read: its name, and the converter that people use.

/// Magic numbers of what is not read: place, bytes, what it is, what helps.
pub(crate) type Known = (usize, &'static [u8], &'static str, &'static str);

pub(crate) const NOT_READ: [Known; 19] = [
    (257, b"ustar", "a tar archive", "unpack it with `tar xf`"),
    (
        0,
        b"#ROSBAG V2.0",
        "a ROS 1 bag",
        "convert it with `rosbags-convert --src FILE --dst FOLDER`, or to MCAP with `mcap convert`",
    ),
    (
        0,
        b"#ROSBAG V1",
        "a ROS 1 bag of version 1",
        "migrate it with `rosbag fix`, then convert it to MCAP with `mcap convert`",
    ),
    (
        0,
        b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1",
        "an old Office document (XLS)",
        "save it as CSV",
    ),
    (
        0,
        b"TDSm",
        "a National Instruments TDMS file",
        "convert it to HDF5 or CSV with nptdms (`tdmsinfo`, `TdmsFile.as_hdf`)",
    ),
    (
        0,
        b"\xa3\x95\x80\x80",
        "an ArduPilot DataFlash log (.bin)",
        "convert it with pymavlink: `mavlogdump.py --format csv --types ATT,RCOU FILE`",
    ),
    (
        0,
        b"LOGG",
        "a Vector BLF log",
        "convert it with asammdf or python-can, and decode the signals with the DBC file",
    ),
    (
        0,
        b"MDF     ",
        "an ASAM MDF file",
        "convert it with asammdf: `mdf.export('csv')` or `mdf.export('mat')`",
    ),
    (
        0,
        b"FEA1",
        "a Feather file of version 1",
        "write it anew as Feather 2: `pyarrow.feather.write_feather(table, FILE)`",
    ),
    (
        0,
        b"ORC",
        "an ORC table",
        "write it as Parquet: `pyarrow.parquet.write_table(pyarrow.orc.read_table(FILE), OUT)`",
    ),
    (0, b"Obj\x01", "an Avro file", "write it as CSV or Parquet"),
    (0, b"%PDF", "a PDF document", "the log itself is needed"),
    (0, b"7z\xbc\xaf\x27\x1c", "a 7z archive", "unpack it"),
    (0, b"BZh", "packed by bzip2", "unpack it with `bunzip2`"),
    (0, b"\xfd7zXZ\x00", "packed by xz", "unpack it with `unxz`"),
    (
        0,
        b"H Product:Blackbox flight data recorder",
        "a Betaflight or INAV blackbox log",
        "convert it to CSV with `blackbox_decode FILE`",
    ),
    (
        0,
        b"RRF2",
        "a Rerun recording",
        "query it with the Python package `rerun-sdk` and write the columns as Parquet or CSV",
    ),
    (
        0,
        b"\x80\x04\x95",
        "a Python pickle",
        "write it as Parquet or CSV: `pandas.read_pickle(FILE).to_csv(OUT)`",
    ),
    (
        0,
        b"\x80\x05\x95",
        "a Python pickle",
        "write it as Parquet or CSV: `pandas.read_pickle(FILE).to_csv(OUT)`",
    ),
];

/// Ending, what it is, what helps: of binary files without a magic number.
type Ending = (&'static str, &'static str, &'static str);

const BY_NAME: [Ending; 10] = [
    (
        "dslog",
        "a log of the FRC driver station",
        "open it in AdvantageScope and export it as WPILOG or CSV",
    ),
    (
        "dsevents",
        "a list of events of the FRC driver station",
        "open the .dslog beside it in AdvantageScope and export that as WPILOG or CSV",
    ),
    (
        "rlog",
        "a log of AdvantageKit's older format (RLOG)",
        "open it in AdvantageScope and export it as WPILOG or CSV",
    ),
    (
        "hoot",
        "a CTRE Phoenix 6 log",
        "convert it with owlet: `owlet -f wpilog FILE OUT`",
    ),
    (
        "revlog",
        "a REV log",
        "open it in AdvantageScope and export it as WPILOG or CSV",
    ),
    (
        "dlog",
        "a log without a known content (.dlog)",
        "export it as CSV in the program that wrote it",
    ),
    (
        "tlog",
        "a MAVLink telemetry log",
        "convert it with pymavlink: `mavlogdump.py --format csv --types ATTITUDE FILE`",
    ),
    (
        "mat",
        "a MATLAB file of version 4",
        "load it in MATLAB and save it with `save('log.mat', '-v7')`, or with scipy: `savemat(OUT, loadmat(FILE))`",
    ),
    (
        "dat",
        "measured data without a known content",
        "export it as CSV, MAT or MDF in the program that wrote it",
    ),
    (
        "bin",
        "a dump without a known content",
        "export it as CSV in the program that wrote it",
    ),
];

/// What a binary file without a magic number likely is, by the end of its name.
pub(crate) fn by_name(name: &str, head: &[u8]) -> Option<(&'static str, &'static str)> {
    if !head.contains(&0) {
        return None;
    }
    let (_, ending) = name.rsplit_once('.')?;
    let known = |(known, _, _): &&Ending| ending.eq_ignore_ascii_case(known);
    let (_, what, remedy) = BY_NAME.iter().find(known)?;
    Some((what, remedy))
}

/// Text that is no table, by how it begins.
pub(crate) fn by_text(head: &[u8]) -> Option<(&'static str, &'static str)> {
    let text = String::from_utf8_lossy(head);
    let mut lines = text.lines().map(str::trim).filter(|line| !line.is_empty());
    let (first, second) = (lines.next()?, lines.next().unwrap_or_default());
    let object = |line: &str| line.starts_with('{') && line.ends_with('}');
    if first.starts_with("date ") && second.starts_with("base ") {
        return Some((
            "a Vector ASC log",
            "decode its signals with the DBC file: asammdf, or python-can with cantools, write CSV",
        ));
    }
    let frame = first.starts_with('(') && first.split(' ').nth(2).is_some_and(|f| f.contains('#'));
    if frame {
        return Some((
            "a CAN dump (candump -l)",
            "decode its signals with the DBC file: python-can with cantools write CSV",
        ));
    }
    if object(first) && object(second) {
        return Some((
            "JSON, one object on each line",
            "write it as CSV: `pandas.read_json(FILE, lines=True).to_csv(OUT, index=False)`",
        ));
    }
    None
}

#[cfg(test)]
mod tests {
    use crate::{FormatError, Input};

    fn said(name: &str, bytes: &[u8]) -> Option<String> {
        match Input::from_bytes(bytes.to_vec(), name) {
            Err(error @ FormatError::NotRead { .. }) => Some(error.to_string()),
            _ => None,
        }
    }

    #[test]
    fn logs_without_a_magic_number_are_named_by_their_endings() {
        let binary = [0, 0, 0, 4, 7, 0];
        for (name, with) in [
            ("a.dslog", "AdvantageScope"),
            ("a.RLOG", "AdvantageScope"),
            ("a.hoot", "owlet"),
            ("a.tlog", "mavlogdump"),
            ("old.mat", "-v7"),
        ] {
            let said = said(name, &binary).unwrap();
            assert!(said.starts_with(name) && said.contains(with), "{said}");
        }
        assert_eq!(said("a.other", &binary), None);
        // The content decides: a table is read under any name.
        assert_eq!(said("a.hoot", b"t,u\n0,1\n"), None);
    }

    #[test]
    fn text_that_is_no_table_is_named_by_its_beginning() {
        for (text, with) in [
            (
                "date Sat Nov 21\nbase hex  timestamps absolute\n",
                "asammdf",
            ),
            ("(1436509052.249713) vcan0 044#2A366C2BBA\n", "cantools"),
            ("{\"t\":0,\"u\":1}\n{\"t\":1,\"u\":2}\n", "lines=True"),
        ] {
            let said = said("log", text.as_bytes()).unwrap();
            assert!(said.contains(with), "{said}");
        }
        for text in ["(a) b c\n1 2 3\n", "{\n\"test\": 1}\n", "date,base\n1,2\n"] {
            assert_eq!(said("log", text.as_bytes()), None, "{text}");
        }
    }

    #[test]
    fn text_of_two_bytes_a_letter_is_unpacked() {
        let text = "t,u\n0,1.5\n1,°\n";
        for little in [true, false] {
            let mut bytes = Vec::new();
            for unit in "\u{feff}".encode_utf16().chain(text.encode_utf16()) {
                bytes.extend(if little {
                    unit.to_le_bytes()
                } else {
                    unit.to_be_bytes()
                });
            }
            let input = Input::from_bytes(bytes.clone(), "log.csv").unwrap();
            assert_eq!(input.into_bytes().unwrap(), text.as_bytes());
            // One that is cut within a letter ends before it.
            bytes.pop();
            let input = Input::from_bytes(bytes, "log.csv").unwrap();
            let cut = input.into_bytes().unwrap();
            assert_eq!(cut, text.trim_end().as_bytes());
        }
    }
}
