"""What pages send of their controls: values that these can have. A page of ours sends no others, but another could."""

import math
from typing import Any

import numpy as np
import viser
from viser import _messages as messages

_NUMBERS = {"wxyz": 4, "position": 3, "look_at": 3, "up_direction": 3}
_SCALARS = ("fov", "near", "far", "image_height", "image_width")


def check_camera(message: messages.ViewerCameraMessage) -> None:
    """Raise ValueError or TypeError unless a camera is made of finite numbers."""
    for name, count in (*_NUMBERS.items(), *((name, None) for name in _SCALARS)):
        numbers = np.asarray(getattr(message, name))
        fits = numbers.dtype.kind in "if" and numbers.shape == (() if count is None else (count,))
        if not (fits and np.isfinite(numbers).all()):
            raise ValueError(f"{name} of a camera")


def limit_values(gui: viser.GuiApi) -> None:
    """Let controls be given finite numbers and what is among their options; anything else is left alone."""
    take = gui._handle_gui_updates

    async def checked(client_id: Any, message: messages.GuiUpdateMessage) -> None:
        control: Any = gui._gui_input_handle_from_uuid.get(message.uuid)
        if control is not None and [*message.updates] == ["value"] and _possible(control, message.updates["value"]):
            await take(client_id, message)

    interface = gui._websock_interface
    interface.unregister_handler(messages.GuiUpdateMessage, take)
    interface.register_handler(messages.GuiUpdateMessage, checked)


def _possible(control: Any, value: Any) -> bool:
    """Whether a control may have a value; numbers outside of its range are left to what is asked for them."""
    if isinstance(control, viser.GuiDropdownHandle | viser.GuiButtonGroupHandle):
        return value in control.options
    return not isinstance(value, float) or math.isfinite(value)
