"""From the engine's raw rows to the recorded channels: units, axes, signs. The only room that says what each is."""

from activesteer.vehicle.channels.channel_map import MAX_VALUE, ChannelMap
from activesteer.vehicle.channels.raw_rows import RawRows

__all__ = ["MAX_VALUE", "ChannelMap", "RawRows"]
