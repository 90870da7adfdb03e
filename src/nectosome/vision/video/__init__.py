"""Videos: segments by their colours to angles and places, markers of several cameras to the pose of a body."""

from .angles import track_segments
from .clip import Clip, Frame
from .markers import track_markers
from .overlay import draw_over
from .propose import Proposal, proposal_text, propose
from .reasons import Reason
from .sheet import Colour, MarkerSheet, SegmentSheet, load_sheet

__all__ = [
    "Clip",
    "Colour",
    "Frame",
    "MarkerSheet",
    "Proposal",
    "Reason",
    "SegmentSheet",
    "draw_over",
    "load_sheet",
    "proposal_text",
    "propose",
    "track_markers",
    "track_segments",
]
