"""What the studio leans on in viser and websockets, which these do not promise."""

import ast
import inspect
from importlib import import_module
from operator import attrgetter
from pathlib import Path

import pytest
import viser
import viser._viser
import websockets.asyncio.server
from websockets.asyncio.server import ServerConnection

from nectosome.studio import uploads

from .test_web_server import LOCAL, client, serving


@pytest.fixture(scope="module")
def server():
    stops, server = serving(LOCAL)
    with stops:
        yield server


PRIVATE = {  # what the studio uses of viser and websockets that these do not promise
    "viser.infra._infra": ("websockets",),  # web_server: its `serve` is called from here
    "viser._messages": (
        "Message.deserialize",
        "FileTransferPart",
        "FileTransferPartAck",
        "FileTransferStartUpload",
        "GuiUpdateMessage",
        "NotificationProps",
        "NotificationUpdateMessage",
        "ViewerCameraMessage",
    ),
    "viser": ("ViserServer.request_share_url", "ViserServer.disconnect_share_url"),  # ours in their place
    "viser.infra": ("WebsockMessageHandler._handle_incoming_message", "WebsockMessageHandler.unregister_handler"),
    "websockets.asyncio.server": ("serve", "ServerConnection.recv"),  # ours in their place
}
OF_A_SERVER = ("_websock_server._server_thread", "_websock_server._background_event_loop")  # for tests
OF_A_PAGE = (
    "gui._handle_file_transfer_start",  # uploads: replaced
    "gui._handle_file_transfer_part",
    "gui._current_file_upload_states",
    "gui._gui_input_handle_from_uuid",
    "gui._websock_interface.unregister_handler",
    "gui._websock_interface.queue_message",  # values: what was refused is taken back
    "gui._handle_gui_updates",  # values: replaced
    "gui._setup_plotly_js",  # browser_script: plots come from the studio
    "_websock_connection.get_message_buffer",
    "_websock_connection.queue_message",
)
OF_A_BUTTON = ("_impl.uuid",)  # tasks/rig: a large one
NEEDS = (
    f"the studio needs it; known to have it are viser 1.1.1 with websockets 16.1.1, this is viser {viser.__version__} "
    f"with websockets {websockets.__version__}"
)


@pytest.mark.parametrize(("module", "name"), [(module, name) for module, names in PRIVATE.items() for name in names])
def test_there_still_is_what_is_not_promised(module, name):
    try:
        attrgetter(name)(import_module(module))
    except (AttributeError, ImportError) as error:
        pytest.fail(f"{module}.{name} is gone ({error}): {NEEDS}")


@pytest.mark.parametrize("name", [*OF_A_SERVER, *OF_A_PAGE])
def test_a_server_and_a_page_still_have_what_is_not_promised(server, name):
    with client(server):
        owner = server if name in OF_A_SERVER else server.get_clients().popitem()[1]
        try:
            attrgetter(name)(owner)
        except AttributeError as error:
            pytest.fail(f"{name} is gone ({error}): {NEEDS}")


@pytest.mark.parametrize("name", OF_A_BUTTON)
def test_a_button_still_has_what_is_not_promised(server, name):
    button = server.gui.add_button("Go")
    try:
        assert attrgetter(name)(button)
    except AttributeError as error:
        pytest.fail(f"{name} is gone ({error}): {NEEDS}")
    finally:
        button.remove()


def test_websockets_still_serves_with_what_is_given_to_it():
    taken = inspect.signature(websockets.asyncio.server.serve).parameters
    missing = {"process_request", "create_connection", "logger"} - {*taken}
    assert not missing, f"websockets.asyncio.server.serve takes no {missing}: {NEEDS}"
    assert inspect.iscoroutinefunction(ServerConnection.recv), f"ServerConnection.recv is not async: {NEEDS}"


def test_no_more_is_used_than_is_listed():
    """Each name with an underscore that the studio's files ask of another object, and each of viser's messages."""
    listed = {part for name in (*OF_A_PAGE, *OF_A_BUTTON, *sum(PRIVATE.values(), ())) for part in name.split(".")}
    listed |= {"_asdict", "_replace"}  # of named tuples, in spite of their names
    for file in Path(uploads.__file__).parent.rglob("*.py"):
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Attribute) and ast.unparse(node.value) not in ("self", "cls"):
                private = node.attr.startswith("_") and not node.attr.startswith("__")
                if private or ast.unparse(node.value) == "messages":
                    assert node.attr in listed, f"{file.name}, line {node.lineno}"
