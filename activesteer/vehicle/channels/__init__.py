"""The recorded channels, computed from the engine's raw rows.

In: raw rows of the engine.
Out: channels with name, unit and meaning.
"""

from activesteer.vehicle.channels.channel_map import MAX_VALUE, ChannelMap
from activesteer.vehicle.channels.native_channels import RawRows

__all__ = ["MAX_VALUE", "ChannelMap", "RawRows"]
