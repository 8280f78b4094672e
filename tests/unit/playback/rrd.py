"""Reader of a .rrd file with rerun's own reader: the logged data of each entity."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from rerun.chunk import RrdReader


class Rrd:
    """Columns of each entity, by entity path and component."""

    def __init__(self, path: Path) -> None:
        reader = RrdReader(path)
        self.blueprints = reader.blueprints()
        self.chunks = list(reader.stream().to_chunks())
        self.entities = {str(chunk.entity_path) for chunk in self.chunks}

    def column(self, entity: str, component: str) -> list[Any]:
        """Return the values of a component, one for each row."""
        found: list[Any] = []
        for chunk in self.chunks:
            batch = chunk.to_record_batch()
            if chunk.entity_path == entity and component in batch.schema.names:
                found += batch.column(component).to_pylist()
        return found

    def numbers(self, entity: str, component: str) -> np.ndarray:
        """Return the same values as an array, shape (rows, instances, ...)."""
        return np.array(self.column(entity, component), dtype=float)

    def time_s(self, entity: str) -> np.ndarray:
        """Return the times of an entity's rows [s]."""
        found = [
            np.asarray(chunk.to_record_batch().column("time").to_numpy(zero_copy_only=False), "timedelta64[ns]")
            for chunk in self.chunks
            if chunk.entity_path == entity and "time" in chunk.to_record_batch().schema.names
        ]
        return np.concatenate(found).astype(np.int64) / 1e9
