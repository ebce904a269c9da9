//! Walks through an MCAP file that may be cut or damaged anywhere.
//!
//! Only what a checksum covers is handed on, and every gap is reported.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, BufReader, Read, Seek, SeekFrom};
use std::ops::ControlFlow;

use mcap::MAGIC;
use mcap::records::op;

/// Nothing of ours is larger; a damaged length must not fill the memory.
const CHUNK_LIMIT: u64 = 1 << 32;

/// Bytes of opcode and length before every record.
const PREFIX: usize = 9;

/// Where a message is: offset of its chunk in the file, and of its record in
/// the decompressed chunk.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Position {
    pub chunk: u64,
    pub inner: usize,
}

/// A message as it lies in the file.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RawMessage<'a> {
    pub topic: &'a str,
    pub sequence: u32,
    pub ns: u64,
    pub data: &'a [u8],
    pub at: Position,
}

/// What the walk meets.
pub(crate) enum Event<'a> {
    Metadata(&'a str, &'a BTreeMap<String, String>),
    Attachment(&'a str, &'a [u8]),
    Message(RawMessage<'a>),
    ChunkEnd,
    /// Something is missing or wrong from here on.
    Damage(String),
}

/// Why a walk could not even begin.
pub(crate) enum ScanError<E> {
    Io(io::Error),
    NotMcap,
    Visit(E),
}

/// Little-endian fields of a record, never beyond its end.
struct Cursor<'a>(&'a [u8]);

impl<'a> Cursor<'a> {
    fn take(&mut self, count: usize) -> Option<&'a [u8]> {
        let (head, rest) = self.0.split_at_checked(count)?;
        self.0 = rest;
        Some(head)
    }

    fn u16(&mut self) -> Option<u16> {
        Some(u16::from_le_bytes(self.take(2)?.try_into().ok()?))
    }

    fn u32(&mut self) -> Option<u32> {
        Some(u32::from_le_bytes(self.take(4)?.try_into().ok()?))
    }

    fn u64(&mut self) -> Option<u64> {
        Some(u64::from_le_bytes(self.take(8)?.try_into().ok()?))
    }

    fn string(&mut self) -> Option<&'a str> {
        let length = self.u32()? as usize;
        std::str::from_utf8(self.take(length)?).ok()
    }

    fn map(&mut self) -> Option<BTreeMap<String, String>> {
        let length = self.u32()? as usize;
        let mut entries = Cursor(self.take(length)?);
        let mut map = BTreeMap::new();
        while !entries.0.is_empty() {
            map.insert(entries.string()?.into(), entries.string()?.into());
        }
        Some(map)
    }
}

/// Splits off the first record.
fn split_record(bytes: &[u8]) -> Option<(u8, &[u8], &[u8])> {
    let mut cursor = Cursor(bytes);
    let opcode = cursor.take(1)?[0];
    let length = usize::try_from(cursor.u64()?).ok()?;
    let body = cursor.take(length)?;
    Some((opcode, body, cursor.0))
}

/// Unpacks the body of a chunk record.
fn unpack(body: &[u8], out: &mut Vec<u8>) -> Result<(), String> {
    let mut cursor = Cursor(body);
    let mut header = || {
        let (_start, _end) = (cursor.u64()?, cursor.u64()?);
        let (size, crc) = (cursor.u64()?, cursor.u32()?);
        let compression = cursor.string()?;
        let compressed = usize::try_from(cursor.u64()?).ok()?;
        Some((size, crc, compression, cursor.take(compressed)?))
    };
    let (size, crc, compression, data) = header().ok_or("its header is damaged")?;
    if crc == 0 {
        // Ours always have one: it is damaged, or somebody else's file.
        return Err("it has no checksum".into());
    }
    if size > CHUNK_LIMIT {
        return Err(format!("it claims {size} bytes"));
    }
    out.clear();
    match compression {
        "" => out.extend_from_slice(data),
        "zstd" => {
            // Grows with what is really there, not with what is claimed.
            zstd::stream::read::Decoder::new(data)
                .and_then(|decoder| decoder.take(size + 1).read_to_end(out))
                .map_err(|e| format!("it cannot be decompressed: {e}"))?;
        }
        other => return Err(format!("its compression {other:?} is unknown")),
    }
    if out.len() as u64 != size || crc32fast::hash(out) != crc {
        return Err("its checksum does not fit".into());
    }
    Ok(())
}

/// Reads and unpacks the chunk at `offset`.
pub(crate) fn read_chunk(file: &mut File, offset: u64, out: &mut Vec<u8>) -> Result<(), String> {
    let mut read = || {
        file.seek(SeekFrom::Start(offset))?;
        let mut prefix = [0; PREFIX];
        file.read_exact(&mut prefix)?;
        let [opcode, length @ ..] = prefix;
        let mut body = Vec::new();
        let length = u64::from_le_bytes(length);
        file.take(length).read_to_end(&mut body)?;
        Ok((opcode, length, body))
    };
    let (opcode, length, body) = read().map_err(|e: io::Error| e.to_string())?;
    if opcode != op::CHUNK || body.len() as u64 != length {
        return Err("there is no chunk".into());
    }
    unpack(&body, out)
}

/// Time and payload of the message at `inner` of an unpacked chunk.
pub(crate) fn message_at(chunk: &[u8], inner: usize) -> Option<(u64, &[u8])> {
    let (opcode, body, _) = split_record(chunk.get(inner..)?)?;
    let (_, _, ns, data) = message(body)?;
    (opcode == op::MESSAGE).then_some((ns, data))
}

fn message(body: &[u8]) -> Option<(u16, u32, u64, &[u8])> {
    let mut cursor = Cursor(body);
    let (channel, sequence) = (cursor.u16()?, cursor.u32()?);
    let (log_time, _publish_time) = (cursor.u64()?, cursor.u64()?);
    Some((channel, sequence, log_time, cursor.0))
}

fn channel(body: &[u8]) -> Option<(u16, String)> {
    let mut cursor = Cursor(body);
    let (id, _schema) = (cursor.u16()?, cursor.u16()?);
    Some((id, cursor.string()?.into()))
}

/// Hands everything that is readable to `visit`, in the order of the file.
pub(crate) fn scan<E>(
    file: &File,
    mut visit: impl FnMut(Event<'_>) -> Result<ControlFlow<()>, E>,
) -> Result<(), ScanError<E>> {
    let total = file.metadata().map_err(ScanError::Io)?.len();
    let mut input = BufReader::with_capacity(1 << 17, file);
    input.rewind().map_err(ScanError::Io)?;
    let mut magic = [0; MAGIC.len()];
    if total < MAGIC.len() as u64 {
        return Err(ScanError::NotMcap);
    }
    input.read_exact(&mut magic).map_err(ScanError::Io)?;
    if magic != *MAGIC {
        return Err(ScanError::NotMcap);
    }

    let mut walk = Walk {
        channels: BTreeMap::new(),
        unpacked: Vec::new(),
    };
    let mut crc = crc32fast::Hasher::new();
    crc.update(&magic);
    let mut body = Vec::new();
    let mut offset = MAGIC.len() as u64;
    loop {
        let left = total - offset;
        let mut prefix = [0; PREFIX];
        let cut = if left == 0 {
            Some(format!(
                "the recording ends at byte {offset} without having been closed"
            ))
        } else if left < PREFIX as u64 {
            Some(format!("the recording is cut at byte {offset}"))
        } else {
            input.read_exact(&mut prefix).map_err(ScanError::Io)?;
            let length = u64::from_le_bytes(std::array::from_fn(|i| prefix[i + 1]));
            (length > left - PREFIX as u64)
                .then(|| format!("the recording is cut or damaged at byte {offset}"))
        };
        if let Some(reason) = cut {
            return visit(Event::Damage(reason))
                .map(drop)
                .map_err(ScanError::Visit);
        }
        let length = u64::from_le_bytes(std::array::from_fn(|i| prefix[i + 1]));
        body.clear();
        input
            .by_ref()
            .take(length)
            .read_to_end(&mut body)
            .map_err(ScanError::Io)?;
        if body.len() as u64 != length {
            let reason = format!("the recording became shorter than {total} bytes");
            return visit(Event::Damage(reason))
                .map(drop)
                .map_err(ScanError::Visit);
        }
        if prefix[0] == op::DATA_END {
            if let Some(reason) = check_end(&body, crc.finalize(), &mut input, total) {
                return visit(Event::Damage(reason))
                    .map(drop)
                    .map_err(ScanError::Visit);
            }
            return Ok(());
        }
        crc.update(&prefix);
        crc.update(&body);
        let flow = walk
            .record(prefix[0], &body, offset, &mut visit)
            .map_err(ScanError::Visit)?;
        if flow.is_break() {
            return Ok(());
        }
        offset += PREFIX as u64 + length;
    }
}

/// What is wrong with the end of a file that was closed.
fn check_end(body: &[u8], crc: u32, input: &mut BufReader<&File>, total: u64) -> Option<String> {
    let Some(saved) = Cursor(body).u32() else {
        return Some("the end of the data is damaged".into());
    };
    if saved != crc {
        return Some("the checksum of the whole recording does not fit".into());
    }
    let mut magic = [0; MAGIC.len()];
    let ended = input
        .seek(SeekFrom::Start(total.saturating_sub(MAGIC.len() as u64)))
        .and_then(|_| input.read_exact(&mut magic))
        .is_ok();
    (!ended || magic != *MAGIC).then(|| "the index at the end of the recording is cut".into())
}

struct Walk {
    channels: BTreeMap<u16, String>,
    unpacked: Vec<u8>,
}

impl Walk {
    fn record<E>(
        &mut self,
        opcode: u8,
        body: &[u8],
        offset: u64,
        visit: &mut impl FnMut(Event<'_>) -> Result<ControlFlow<()>, E>,
    ) -> Result<ControlFlow<()>, E> {
        match opcode {
            op::CHUNK => self.chunk(body, offset, visit),
            op::METADATA => {
                let mut cursor = Cursor(body);
                match cursor.string().zip(cursor.map()) {
                    Some((name, map)) => visit(Event::Metadata(name, &map)),
                    None => visit(damage("metadata", offset)),
                }
            }
            op::ATTACHMENT => match attachment(body) {
                Some((name, data)) => visit(Event::Attachment(name, data)),
                None => visit(damage("attachment", offset)),
            },
            op::HEADER | op::MESSAGE_INDEX | op::SCHEMA | 0x80.. => Ok(ControlFlow::Continue(())),
            // A record that has no place here: lengths cannot be trusted.
            _ => visit(damage("record", offset)).map(|_| ControlFlow::Break(())),
        }
    }

    fn chunk<E>(
        &mut self,
        body: &[u8],
        offset: u64,
        visit: &mut impl FnMut(Event<'_>) -> Result<ControlFlow<()>, E>,
    ) -> Result<ControlFlow<()>, E> {
        if let Err(reason) = unpack(body, &mut self.unpacked) {
            return visit(Event::Damage(format!(
                "chunk at byte {offset} lost: {reason}"
            )));
        }
        let mut rest = &self.unpacked[..];
        while !rest.is_empty() {
            let inner = self.unpacked.len() - rest.len();
            let Some((opcode, body, after)) = split_record(rest) else {
                return visit(damage("chunk", offset));
            };
            rest = after;
            match opcode {
                op::CHANNEL => match channel(body) {
                    Some((id, topic)) => {
                        self.channels.insert(id, topic);
                    }
                    None => return visit(damage("chunk", offset)),
                },
                op::MESSAGE => {
                    let message = message(body)
                        .and_then(|(id, s, ns, data)| Some((self.channels.get(&id)?, s, ns, data)));
                    let Some((topic, sequence, ns, data)) = message else {
                        return visit(damage("chunk", offset));
                    };
                    let at = Position {
                        chunk: offset,
                        inner,
                    };
                    let message = RawMessage {
                        topic,
                        sequence,
                        ns,
                        data,
                        at,
                    };
                    if visit(Event::Message(message))?.is_break() {
                        return Ok(ControlFlow::Break(()));
                    }
                }
                _ => {}
            }
        }
        visit(Event::ChunkEnd)
    }
}

fn damage(what: &str, offset: u64) -> Event<'static> {
    Event::Damage(format!("{what} at byte {offset} is damaged"))
}

fn attachment(body: &[u8]) -> Option<(&str, &[u8])> {
    let (content, crc) = body.split_last_chunk::<4>()?;
    if u32::from_le_bytes(*crc) != crc32fast::hash(content) {
        return None;
    }
    let mut cursor = Cursor(content);
    let (_log_time, _create_time) = (cursor.u64()?, cursor.u64()?);
    let (name, _media_type) = (cursor.string()?, cursor.string()?);
    let length = usize::try_from(cursor.u64()?).ok()?;
    Some((name, cursor.take(length)?))
}
