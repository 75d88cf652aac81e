#!/usr/bin/env python3
"""Writes one recording in every format, each by its own ordinary writer.

    pip install -r requirements.txt
    python write_all.py RECORDING.csv FOLDER

The first column of the recording is its time in seconds, named `time_s`. All files hold the same
doubles; formats with integer stamps hold the time as nanoseconds or microseconds, from which it
comes back to the last digit as long as the recording itself has no finer times.

ULog has no writer that can be installed: `ulog` below follows the format's specification.
"""

import csv
import gzip
import io
import json
import shutil
import struct
import sys
from pathlib import Path

import h5py
import mcap.writer
import numpy as np
import pyarrow as pa
import pyarrow.feather
import pyarrow.parquet
import scipy.io
import zstandard
from google.protobuf import descriptor_pb2, descriptor_pool, message_factory
from mcap_ros2.writer import Writer as Ros2Writer
from mcap_protobuf.writer import Writer as ProtobufWriter
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as BagWriter
from rosbags.typesys import Stores, get_typestore
from wpiutil import DataLogWriter
from wpiutil.log import DoubleLogEntry


def recording(path):
    """Columns by name."""
    with open(path, newline="") as file:
        rows = list(csv.reader(line for line in file if not line.startswith("#")))
    values = np.array([[float(x) if x else np.nan for x in row] for row in rows[1:]])
    return {name: values[:, k].copy() for k, name in enumerate(rows[0])}


def nanoseconds(time):
    return [int(round(t * 1e9)) for t in time]


def wpilog(columns, path):
    log = DataLogWriter(str(path))
    time = [int(round(t * 1e6)) for t in columns["time_s"]]
    entries = {n: DoubleLogEntry(log, f"/drive/{n}") for n in columns if n != "time_s"}
    for k, stamp in enumerate(time):
        for name, entry in entries.items():
            # A stamp of 0 means now to this writer.
            entry.append(float(columns[name][k]), stamp + 1_000_000)
    log.flush()
    log.stop()


def ulog(columns, path):
    def message(kind, content):
        return struct.pack("<HB", len(content), ord(kind)) + content

    names = [n for n in columns if n != "time_s"]
    out = b"ULog\x01\x12\x35\x01" + struct.pack("<Q", 0)
    out += message("B", bytes(40))
    fields = "".join(f"double {n};" for n in names)
    out += message("F", f"drive:uint64_t timestamp;{fields}".encode())
    out += message("A", struct.pack("<BH", 0, 0) + b"drive")
    for k, t in enumerate(columns["time_s"]):
        values = [columns[n][k] for n in names]
        stamp = int(round(t * 1e6))
        out += message("D", struct.pack(f"<HQ{len(names)}d", 0, stamp, *values))
    path.write_bytes(out)


def mcap_json(columns, path, compression):
    with open(path, "wb") as file:
        writer = mcap.writer.Writer(file, compression=compression)
        writer.start()
        schema = writer.register_schema("drive", "jsonschema", b'{"type":"object"}')
        channel = writer.register_channel("/drive", "json", schema)
        names = [n for n in columns if n != "time_s"]
        for k, stamp in enumerate(nanoseconds(columns["time_s"])):
            data = {n: float(columns[n][k]) for n in names}
            writer.add_message(channel, stamp, json.dumps(data).encode(), stamp)
        writer.finish()


JOINT_STATE = """std_msgs/Header header
string[] name
float64[] position
float64[] velocity
float64[] effort
================================================================================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
================================================================================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
"""


def mcap_ros2(columns, path):
    """Columns as the velocities of joints that have their names."""
    names = [n for n in columns if n != "time_s"]
    with open(path, "wb") as file:
        writer = Ros2Writer(file)
        schema = writer.register_msgdef("sensor_msgs/msg/JointState", JOINT_STATE)
        for k, stamp in enumerate(nanoseconds(columns["time_s"])):
            message = {
                "header": {
                    "stamp": {"sec": stamp // 10**9, "nanosec": stamp % 10**9},
                    "frame_id": "base",
                },
                "name": names,
                "position": [],
                "velocity": [float(columns[n][k]) for n in names],
                "effort": [],
            }
            writer.write_message("/joint_states", schema, message, stamp, stamp)
        writer.finish()


def mcap_protobuf(columns, path):
    names = [n for n in columns if n != "time_s"]
    file = descriptor_pb2.FileDescriptorProto(name="drive.proto", package="drive", syntax="proto3")
    message = file.message_type.add(name="Sample")
    for k, name in enumerate(names):
        message.field.add(name=name, number=k + 1, type=1, label=1)
    pool = descriptor_pool.DescriptorPool()
    pool.Add(file)
    kind = message_factory.GetMessageClass(pool.FindMessageTypeByName("drive.Sample"))
    with open(path, "wb") as out:
        writer = ProtobufWriter(out)
        for k, stamp in enumerate(nanoseconds(columns["time_s"])):
            sample = kind(**{n: float(columns[n][k]) for n in names})
            writer.write_message("/drive", sample, stamp, stamp)
        writer.finish()


def bag(columns, path, storage):
    """A bag of std_msgs/Float64, one topic for each column."""
    store = get_typestore(Stores.ROS2_HUMBLE)
    float64 = store.types["std_msgs/msg/Float64"]
    shutil.rmtree(path, ignore_errors=True)
    with BagWriter(path, version=9, storage_plugin=storage) as writer:
        topics = {
            n: writer.add_connection(f"/drive/{n}", float64.__msgtype__, typestore=store)
            for n in columns
            if n != "time_s"
        }
        for k, stamp in enumerate(nanoseconds(columns["time_s"])):
            for name, topic in topics.items():
                data = store.serialize_cdr(float64(float(columns[name][k])), float64.__msgtype__)
                writer.write(topic, stamp, data)


def npy(columns, path):
    table = np.zeros(len(columns["time_s"]), dtype=[(n, "<f8") for n in columns])
    for name, values in columns.items():
        table[name] = values
    np.save(path, table)


def hdf5(columns, path, compression):
    with h5py.File(path, "w") as file:
        for name, values in columns.items():
            file.create_dataset(f"log/{name}", data=values, compression=compression)


def matlab73(columns, path):
    """What MATLAB's `save -v7.3` writes, as far as its readers look."""
    with h5py.File(path, "w", userblock_size=512) as file:
        for name, values in columns.items():
            data = file.create_dataset(name, data=values.reshape(1, -1), compression="gzip")
            data.attrs["MATLAB_class"] = np.bytes_("double")
    head = b"MATLAB 7.3 MAT-file, Platform: GLNXA64, Created on: today HDF5 schema 1.00 ."
    with open(path, "r+b") as file:
        file.write(head.ljust(116) + bytes(8) + b"\x00\x02IM")


def arrow_stream(table, path):
    with pa.OSFile(str(path), "wb") as out, pa.ipc.new_stream(out, table.schema) as writer:
        writer.write_table(table, max_chunksize=500)


def main(source, folder):
    columns = recording(source)
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    text = Path(source).read_bytes()
    (folder / "recording.csv").write_bytes(text)
    (folder / "recording.csv.gz").write_bytes(gzip.compress(text))
    (folder / "recording.csv.zst").write_bytes(zstandard.compress(text))
    wpilog(columns, folder / "recording.wpilog")
    ulog(columns, folder / "recording.ulg")
    for compression in ["NONE", "LZ4", "ZSTD"]:
        kind = getattr(mcap.writer.CompressionType, compression)
        mcap_json(columns, folder / f"json-{compression.lower()}.mcap", kind)
    mcap_ros2(columns, folder / "ros2.mcap")
    mcap_protobuf(columns, folder / "protobuf.mcap")
    bag(columns, folder / "bag-mcap", StoragePlugin.MCAP)
    bag(columns, folder / "bag-sqlite", StoragePlugin.SQLITE3)
    scipy.io.savemat(folder / "v6.mat", columns, do_compression=False)
    scipy.io.savemat(folder / "v7.mat", columns, do_compression=True, oned_as="column")
    matlab73(columns, folder / "v73.mat")
    hdf5(columns, folder / "plain.h5", None)
    hdf5(columns, folder / "packed.h5", "gzip")
    np.savez(folder / "plain.npz", **columns)
    np.savez_compressed(folder / "packed.npz", **columns)
    npy(columns, folder / "table.npy")
    table = pa.table(columns)
    for compression in ["none", "snappy", "gzip", "zstd", "lz4"]:
        path = folder / f"{compression}.parquet"
        pa.parquet.write_table(table, path, compression=compression)
    for compression in ["uncompressed", "lz4", "zstd"]:
        path = folder / f"{compression}.feather"
        pa.feather.write_feather(table, path, compression=compression)
    arrow_stream(table, folder / "stream.arrows")
    packed = io.BytesIO()
    pa.parquet.write_table(table, packed)
    (folder / "twice.parquet.gz").write_bytes(gzip.compress(packed.getvalue()))


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    main(*sys.argv[1:])
