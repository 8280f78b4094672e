"""Recordings: channel table, MCAP writer and reader, and the class `Recording`.

In: rows of channels, poses and metadata.
Out: MCAP files, and `Recording` with arrays by channel name.
"""

from activesteer.recording.contents import Link, Primitive, ScenePart
from activesteer.recording.recording import Recording
from activesteer.recording.rows import Poses
from activesteer.recording.schemas import ChannelTable
from activesteer.recording.writer import McapWriter, check_target

__all__ = ["ChannelTable", "Link", "McapWriter", "Poses", "Primitive", "Recording", "ScenePart", "check_target"]
