"""The command `nectosome`, and `python -m nectosome`: load the commands, which may be interrupted, and run one."""

import os


def run() -> None:
    """Run the command of the shell and end the process."""
    try:
        from nectosome.cli import run as run_command
    except KeyboardInterrupt:
        os.write(2, b"cancelled.\n")
        os._exit(130)
    run_command()


if __name__ == "__main__":
    run()
