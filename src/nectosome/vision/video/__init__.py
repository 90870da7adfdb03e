"""Videos: positions and angles of coloured segments, and the pose of a body from markers of several cameras."""

from .angles import track_segments
from .clip import Clip, Frame
from .markers import track_markers
from .overlay import draw_over
from .propose import Proposal, proposal_text, propose
from .reasons import Reason
from .sheet import Colour, MarkerSheet, SegmentSheet, load_sheet
