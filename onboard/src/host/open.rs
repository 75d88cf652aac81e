//! Opens a serial port or a unix socket.

use std::io::{self, ErrorKind, Read, Write};
#[cfg(unix)]
use std::os::unix::{fs::FileTypeExt, net::UnixStream};
use std::time::Duration;

use serialport::SerialPort;

use super::LineError;

/// Reads and writes bytes; each call ends within a time.
pub(super) trait Stream: Read + Write + Send {
    /// It has a baud rate.
    fn has_baud(&self) -> bool;
}

#[cfg(unix)]
impl Stream for UnixStream {
    fn has_baud(&self) -> bool {
        false
    }
}

impl Stream for Box<dyn SerialPort> {
    fn has_baud(&self) -> bool {
        true
    }
}

/// Opens `path`.
pub(super) fn open(path: &str, baud: u32, timeout: Duration) -> Result<Box<dyn Stream>, LineError> {
    #[cfg(unix)]
    {
        let kind = match std::fs::metadata(path) {
            Ok(metadata) => metadata.file_type(),
            Err(error) => return Err(failed(path, error)),
        };
        if kind.is_socket() {
            return Ok(Box::new(socket(path, timeout)?));
        }
        let found = match kind {
            kind if kind.is_dir() => Some("a folder"),
            kind if kind.is_file() => Some("an ordinary file"),
            kind if kind.is_fifo() => Some("a pipe"),
            kind if kind.is_block_device() => Some("a disk"),
            _ => None,
        };
        if let Some(found) = found {
            let line = path.to_owned();
            return Err(LineError::NotALine { line, found });
        }
    }
    let port = serialport::new(path, baud).timeout(timeout).open();
    Ok(Box::new(port.map_err(|e| refused(path, e))?))
}

#[cfg(unix)]
fn socket(path: &str, timeout: Duration) -> Result<UnixStream, LineError> {
    let io = |error| failed(path, error);
    let stream = UnixStream::connect(path).map_err(io)?;
    stream.set_read_timeout(Some(timeout)).map_err(io)?;
    stream.set_write_timeout(Some(timeout)).map_err(io)?;
    Ok(stream)
}

/// An error of the system as an error of the line.
pub(super) fn failed(path: &str, source: io::Error) -> LineError {
    let line = path.to_owned();
    match source.kind() {
        ErrorKind::NotFound => LineError::Missing {
            line,
            ports: ports(),
        },
        ErrorKind::PermissionDenied => LineError::Permission { line },
        ErrorKind::ConnectionRefused => LineError::Nobody { line },
        ErrorKind::BrokenPipe | ErrorKind::ConnectionReset => LineError::HungUp { line },
        _ => LineError::Io { line, source },
    }
}

/// An error on opening a serial port as an error of the line.
fn refused(path: &str, error: serialport::Error) -> LineError {
    let line = path.to_owned();
    match error.kind {
        serialport::ErrorKind::NoDevice if std::fs::metadata(path).is_err() => LineError::Missing {
            line,
            ports: ports(),
        },
        serialport::ErrorKind::NoDevice => LineError::Busy { line },
        serialport::ErrorKind::Io(kind) => failed(path, io::Error::new(kind, error.description)),
        // ENOTTY, in the words of nix.
        serialport::ErrorKind::Unknown if error.description == "Not a typewriter" => {
            let found = "a device of another kind";
            LineError::NotALine { line, found }
        }
        _ => {
            let source = io::Error::other(error.description);
            LineError::Io { line, source }
        }
    }
}

/// Names of the serial ports of this machine.
fn ports() -> Vec<String> {
    let ports = serialport::available_ports().unwrap_or_default();
    let mut names: Vec<String> = ports.into_iter().map(|p| p.port_name).collect();
    names.sort();
    names
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_of_the_system_become_words() {
        let said = |error: LineError| error.to_string();
        let denied = io::Error::from(ErrorKind::PermissionDenied);
        assert!(
            said(failed("/dev/ttyACM0", denied)).contains("no permission to open `/dev/ttyACM0`")
        );
        let port = |kind, what: &str| refused("/", serialport::Error::new(kind, what));
        let denied = serialport::ErrorKind::Io(ErrorKind::PermissionDenied);
        assert!(matches!(
            port(denied, "Permission denied"),
            LineError::Permission { .. }
        ));
        // A program that has a port alone makes it seem to be gone.
        let busy = port(serialport::ErrorKind::NoDevice, "Device or resource busy");
        assert_eq!(said(busy), "`/` is in use by another program");
        let odd = port(serialport::ErrorKind::Unknown, "it rains");
        assert_eq!(said(odd), "the line `/` fails: it rains");
    }
}
