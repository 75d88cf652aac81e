#!/usr/bin/env python3
"""Reads what loopsight writes for other programs, as they would: MCAP and Parquet.

    python read_back.py RECORDING.csv LOG.mcap [TABLE.parquet]

The MCAP file is checked for what Foxglove needs to plot it without further ado: JSON messages whose
schema has one plain type for each property, and holds for every message.
"""

import csv
import json
import sys

import jsonschema
import mcap.reader
import numpy as np
import pyarrow.parquet

PLAIN = {"number", "string", "boolean"}


def recording(path):
    """Columns by name; NaN: missing."""
    with open(path, newline="") as file:
        rows = list(csv.reader(line for line in file if not line.startswith("#")))
    values = np.array([[float(x) if x else np.nan for x in row] for row in rows[1:]])
    return {name: values[:, k] for k, name in enumerate(rows[0])}


def read_mcap(path):
    """Columns of the topic `loop`."""
    rows, topics = [], set()
    with open(path, "rb") as file:
        reader = mcap.reader.make_reader(file, validate_crcs=True)
        for schema, channel, message in reader.iter_messages():
            assert schema.encoding == "jsonschema", schema.encoding
            assert channel.message_encoding == "json", channel.message_encoding
            assert schema.name == f"loopsight.{channel.topic}", schema.name
            shape = json.loads(schema.data)
            if channel.topic not in topics:
                jsonschema.Draft7Validator.check_schema(shape)
                assert shape["type"] == "object", shape
                types = [field["type"] for field in shape["properties"].values()]
                assert all(isinstance(t, str) and t in PLAIN for t in types), types
                topics.add(channel.topic)
            data = json.loads(message.data)
            jsonschema.validate(data, shape)
            assert not data.keys() - shape["properties"].keys(), data
            assert message.log_time == round(data["time_s"] * 1e9), data
            if channel.topic == "loop":
                rows.append([data.get(name, np.nan) for name in shape["properties"]])
                names = list(shape["properties"])
    values = np.array(rows)
    return {name: values[:, k] for k, name in enumerate(names)}


def same(found, expected, path):
    assert set(found) == set(expected), (path, list(found), list(expected))
    for name, values in expected.items():
        # A JSON reader may be one place off in the last digit.
        np.testing.assert_allclose(found[name], values, rtol=1e-15, err_msg=f"{path}: {name}")
    print(f"{path}: {len(expected)} columns, {len(values)} rows, the same")


def main(source, log, table=None):
    columns = recording(source)
    same(read_mcap(log), columns, log)
    if table is None:
        return
    read = pyarrow.parquet.read_table(table)
    same({n: read[n].to_numpy() for n in read.column_names}, columns, table)
    for field in read.schema:
        unit = (field.metadata or {}).get(b"unit", b"").decode()
        assert unit and field.name.endswith(unit.replace("/", "_per_")), (field.name, unit)
    print(f"{table}: units", {field.name: field.metadata[b"unit"].decode() for field in read.schema})


if __name__ == "__main__":
    if len(sys.argv) not in (3, 4):
        sys.exit(__doc__)
    main(*sys.argv[1:])
