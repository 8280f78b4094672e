"""Rows of runs as tables: columns with types and units, and the joining of parts."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Sequence
from typing import Any, Final

import pyarrow as pa

from activesteer.studies.engine.run_task import CURVE, Row
from activesteer.units import unit_of

IDENTITY: Final = ("run", "run_id", "sample", "maneuver", "vehicle", "controller")
"""Columns that identify the run of a row; the factors follow them."""
OUTCOME: Final = ("status", "error")
"""Columns behind the factors; the metrics follow them."""
_TYPES: Final = {"run": pa.int64(), "sample": pa.int64()} | dict.fromkeys(
    ("run_id", "maneuver", "vehicle", "controller", "status", "error"), pa.string()
)


def table_of(rows: Sequence[Row], factors: Sequence[str]) -> pa.Table:
    """Return rows as a table, with a unit for each column."""
    names = dict.fromkeys([*IDENTITY, *factors, *OUTCOME, *(name for row in rows for name in row)])
    columns = {}
    for name in names:
        values = [row.get(name) for row in rows]
        if name in _TYPES:
            columns[name] = pa.array(values, _TYPES[name])
        elif name in factors:
            columns[name] = _factor_column(values)
        elif name.startswith(CURVE):
            columns[name] = pa.array(values, pa.list_(pa.float32()))
        else:
            columns[name] = pa.array(values, pa.float64(), from_pandas=False)
    fields = [pa.field(name, column.type, metadata={"unit": unit_of(name)}) for name, column in columns.items()]
    return pa.Table.from_arrays(list(columns.values()), schema=pa.schema(fields))


def joined_schema(schemas: Iterable[pa.Schema]) -> pa.Schema:
    """Return the columns of all parts; a factor with whole numbers in some parts only becomes a float."""
    fields: dict[str, pa.Field] = {}
    for schema in schemas:
        for field in schema:
            known = fields.get(field.name)
            fields[field.name] = field if known is None else known.with_type(_common(known.type, field.type))
    return pa.schema(list(fields.values()))


def _factor_column(values: Sequence[Any]) -> pa.Array:
    """Return a column of numbers, texts or truth values; anything else is written as JSON."""
    try:
        numbers = any(isinstance(value, float) for value in values)
        plain = [float(value) if numbers and value is not None else value for value in values]
        if not any(isinstance(value, (list, dict)) for value in plain):
            return pa.array(plain)
    except (TypeError, ValueError, pa.ArrowInvalid, pa.ArrowTypeError):
        pass
    return pa.array([None if value is None else json.dumps(value) for value in values], pa.string())


def _common(a: pa.DataType, b: pa.DataType) -> pa.DataType:
    if a == b or pa.types.is_null(b):
        return a
    if pa.types.is_null(a):
        return b
    both_numbers = all(pa.types.is_integer(kind) or pa.types.is_floating(kind) for kind in (a, b))
    return pa.float64() if both_numbers else pa.string()


def fitted(table: pa.Table, schema: pa.Schema) -> pa.Table:
    """Return the table with the columns of the schema; missing columns are empty."""
    present = set(table.column_names)
    columns = [
        table[field.name].cast(field.type) if field.name in present else pa.nulls(len(table), field.type)
        for field in schema
    ]
    return pa.Table.from_arrays(columns, schema=schema)


def batched(tables: Iterable[pa.Table], rows: int) -> Iterator[pa.Table]:
    """Return the rows in tables of equal length, so that the file does not depend on the division of the work."""
    waiting: list[pa.Table] = []
    count = 0
    for table in tables:
        waiting.append(table)
        count += len(table)
        while count >= rows:
            joined = pa.concat_tables(waiting).combine_chunks()
            yield joined.slice(0, rows)
            waiting, count = [joined.slice(rows)], count - rows
    if count:
        yield pa.concat_tables(waiting).combine_chunks()
