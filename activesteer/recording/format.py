"""Names of topics and metadata records, and metadata as text.

A file holds, in this order: schemas and topics, attachments, the record of the run, the format record, chunks of about
a second, the record of the result, metrics. Metadata values are JSON text, metrics are numbers as text.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping

import numpy as np
from mcap.opcode import Opcode
from mcap.writer import MCAP0_MAGIC

from activesteer import limits
from activesteer.errors import RecordingError
from activesteer.recording.contents import check_metadata, check_metrics

FORMAT_VERSION = 1
"""Version of the format; raised when an older reader could misread a file."""

STATE_TOPIC, TRANSFORMS_TOPIC, SCENE_TOPIC, EVENTS_TOPIC = "/state/", "/tf", "/scene", "/events"
RUN_RECORD, RESULT_RECORD, METRICS_RECORD = "activesteer.run", "activesteer.result", "activesteer.metrics"
"""Names of the metadata records: known before the run, known after the run, metrics."""

FORMAT_RECORD = "activesteer.format"
"""Name of the metadata record that marks a file as ours."""


LIBRARY = "activesteer "
"""Name of the writing program in the header of a file; the version follows."""


def is_recording_start(data: bytes) -> bool:
    """Return whether a file with this beginning is ours, even if damaged or left empty by a full disk."""
    # Magic, opcode, length of the record, then two texts with their lengths: profile and library.
    start = len(MCAP0_MAGIC) + 9
    head = MCAP0_MAGIC + bytes([Opcode.HEADER])
    profile_end = start + 4 + int.from_bytes(data[start : start + 4], "little")
    return not data or (data.startswith(head) and data[profile_end + 4 :].startswith(LIBRARY.encode()))


def metadata_texts(metadata: Mapping[str, object]) -> tuple[dict[str, str], dict[str, str]]:
    """Convert metadata to the texts of an MCAP file.

    Args:
        metadata: Values that JSON can represent; numpy numbers and arrays become numbers and lists.

    Returns:
        The values as JSON text, without the keys `metrics` and `events`; and the metrics, as numbers in text.

    Raises:
        RecordingError: a value cannot be represented or has the wrong type, or a metric is not a number.
    """
    texts: dict[str, str] = {}
    metrics = metadata.get("metrics", {})
    if not isinstance(metrics, Mapping):
        raise RecordingError(
            f"is a {type(metrics).__name__}, expected numbers by name", file="the metadata", key="metrics"
        )
    metrics = {name: value.item() if isinstance(value, np.generic) else value for name, value in metrics.items()}
    # As in the rows, a value that is too large for a file becomes infinite.
    metrics |= {name: math.copysign(math.inf, value) for name, value in metrics.items()
                if isinstance(value, float) and abs(value) > limits.MAX_NUMBER}  # fmt: skip
    check_metrics(metrics)
    for key, value in metadata.items():
        if key in ("metrics", "events"):
            continue
        try:
            texts[str(key)] = json.dumps(value, default=_plain, ensure_ascii=False)
        except (TypeError, ValueError, RecursionError) as error:
            raise RecordingError(f"cannot be kept as JSON: {error}", file="the metadata", key=str(key)) from None
    check_metadata({key: json.loads(text) for key, text in texts.items()})
    return texts, {name: repr(float(value)) for name, value in metrics.items()}


def _plain(value: object) -> object:
    if isinstance(value, np.generic | np.ndarray):
        return value.tolist()
    if isinstance(value, Mapping):
        return dict(value)
    raise TypeError(f"a {type(value).__name__} ({value!r})")
